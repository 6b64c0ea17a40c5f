//! Before and after: the terms of an expansion beside its main ones.

use fluxmorph_solver::multipole::Harmonic;
use maud::{Markup, html};

use super::bars::{self, Row};
use super::plot::svg;
use super::tables::of_first_state;
use super::ticks::number;
use crate::build::multipole::main_terms;
use crate::config::Config;
use crate::files::{HarmonicResult, MultipoleResult, RunResult};

/// A figure for every expansion that has terms beside the main ones, of the first state.
pub(super) fn figures(config: &Config, result: &RunResult) -> Markup {
    let before = result.initial.first().map_or(&[][..], |state| state.multipoles.as_slice());
    html! {
        @for (k, (set, after)) in config.multipoles.iter().zip(&result.multipoles).enumerate() {
            @let main: Vec<String> = main_terms(set).iter().map(Harmonic::to_string).collect();
            @let shown = shown(&main, [before.get(k), Some(after)]);
            @if !shown.is_empty() {
                figure class="narrow" {
                    (draw(&after.name, &shown))
                    figcaption {
                        "Terms of the expansion " (after.name) " at " (number(1e3 * after.radius_m, 4))
                        " mm in units of 1e-4 of " (main.join(", ")) (of_first_state(result))
                        @if before.get(k).is_some() { ": before above, after below." } @else { "." }
                    }
                }
            }
        }
    }
}

/// Every term beside the main ones with its size before and after, in units.
fn shown(main: &[String], [before, after]: [Option<&MultipoleResult>; 2]) -> Vec<Row> {
    let units = |set: Option<&MultipoleResult>, name: &str| {
        set.and_then(|set| set.terms.iter().find(|term| term.name == name)).and_then(|term| term.units)
    };
    let row = |term: &HarmonicResult| {
        let sizes = [("bar-before", units(before, &term.name)), ("bar-after", Some(term.units?))];
        let bar = |(class, size): (_, Option<f64>)| size.map(|size| (class, size, number(size, 3)));
        Some((term.name.clone(), sizes.map(bar).to_vec()))
    };
    let terms = after.into_iter().flat_map(|set| &set.terms).filter(|term| !main.contains(&term.name));
    terms.filter_map(row).collect()
}

fn draw(expansion: &str, shown: &[Row]) -> Markup {
    let sizes = shown.iter().flat_map(|(_, bars)| bars).flatten().map(|(_, size, _)| *size);
    let most = sizes.fold(f64::MIN_POSITIVE, f64::max);
    let (rows, bottom) = bars::rows(["term", "units of 1e-4"], shown, most);
    let label = format!("Terms of the expansion {expansion}, the largest {} units", number(most, 3));
    svg(bottom + 4.0, &label, &rows)
}
