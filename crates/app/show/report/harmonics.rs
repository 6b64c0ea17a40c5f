//! Before and after: the terms of an expansion beside its main ones.

use maud::{Markup, html};

use super::histogram::{BAR, LONGEST, ROW, START};
use super::plot::{rect, svg, text};
use super::ticks::number;
use crate::build::multipole::{main_terms, name};
use crate::config::Config;
use crate::files::{HarmonicResult, MultipoleResult, RunResult};

/// Room above the bars.
const ABOVE: f64 = 22.0;

/// A figure for every expansion that has terms beside the main ones, of the first state.
pub(super) fn figures(config: &Config, result: &RunResult) -> Markup {
    let before = result.initial.first().map_or(&[][..], |state| state.multipoles.as_slice());
    html! {
        @for (k, (set, after)) in config.multipoles.iter().zip(&result.multipoles).enumerate() {
            @let main: Vec<String> = main_terms(set).into_iter().map(name).collect();
            @let shown = shown(&main, [before.get(k), Some(after)]);
            @if !shown.is_empty() {
                figure class="narrow" {
                    (draw(&after.name, &shown))
                    figcaption {
                        "Terms of the expansion " (after.name) " at " (number(1e3 * after.radius_m, 4))
                        " mm in units of 1e-4 of " (main.join(", "))
                        @if before.get(k).is_some() { ": before above, after below." } @else { "." }
                    }
                }
            }
        }
    }
}

/// Every term beside the main ones with its size before and after, in units.
fn shown<'r>(
    main: &[String],
    [before, after]: [Option<&'r MultipoleResult>; 2],
) -> Vec<(&'r str, [Option<f64>; 2])> {
    let units = |set: Option<&MultipoleResult>, name: &str| {
        set.and_then(|set| set.terms.iter().find(|term| term.name == name)).and_then(|term| term.units)
    };
    let of = |term: &'r HarmonicResult| {
        (term.name.as_str(), [units(before, &term.name), units(after, &term.name)])
    };
    let terms = after.into_iter().flat_map(|set| &set.terms).filter(|term| !main.contains(&term.name));
    terms.map(of).filter(|(_, sizes)| sizes[1].is_some()).collect()
}

fn draw(expansion: &str, shown: &[(&str, [Option<f64>; 2])]) -> Markup {
    let sizes = shown.iter().flat_map(|(_, sizes)| sizes).flatten();
    let most = sizes.copied().fold(f64::MIN_POSITIVE, f64::max);
    let bar = |class: &str, units: f64, y: f64| {
        let length = LONGEST * units / most;
        html! {
            (rect(class, [START, y, length.max(0.8), BAR]))
            (text("count", START + length + 4.0, y + 8.0, &number(units, 3)))
        }
    };
    let content = html! {
        (text("title", 2.0, 13.0, "term"))
        (text("title", START, 13.0, "units of 1e-4"))
        @for (i, (term, sizes)) in shown.iter().enumerate() {
            @let top = ABOVE + ROW * i as f64;
            (text("tick end", START - 8.0, top + 15.0, term))
            @for (class, k) in [("bar-before", 0), ("bar-after", 1)] {
                @if let Some(units) = sizes[k] { (bar(class, units, top + 2.0 + (BAR + 1.0) * k as f64)) }
            }
        }
    };
    let label = format!("Terms of the expansion {expansion}, the largest {} units", number(most, 3));
    svg(ABOVE + ROW * shown.len() as f64 + 4.0, &label, &content)
}
