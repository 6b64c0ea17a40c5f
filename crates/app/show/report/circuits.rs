//! Tables of what coils are in circuits, and of expansions of the field.

use maud::{Markup, html};

use super::tables::{ERROR_BAR, MOST_ROWS, bar, behind_title, of_first_state, titled_table};
use super::ticks::number;
use crate::files::{Amplitude, CoilResult, RunResult};
use crate::show::states::{State, peaks};

/// Terminals, inductances and coupling of coils; terms of expansions. Of several states all but the inductances for each.
pub(super) fn circuits(result: &RunResult, states: &[State<'_>]) -> Markup {
    let first = of_first_state(result);
    html! {
        @for state in states { (terminals(state)) }
        (matrix(&format!("Inductances [H]{first}"), &result.inductance_h, result))
        @if result.coils.len() > 1 { (matrix(&format!("Coupling{first}"), &result.coupling, result)) }
        @for state in states { (expansions(state)) }
    }
}

/// What the terminals of coils see.
fn terminals(state: &State<'_>) -> Markup {
    let errors = state.errors;
    let row = |coil: &CoilResult| {
        let behind = |error: Option<&f64>| error.map_or(String::new(), |_| format!(" {}", bar(error, 1.0)));
        let of_current = behind(errors.and_then(|errors| errors.currents_a.get(&coil.name)));
        let of_resistance = behind(errors.and_then(|errors| errors.resistances_ohm.get(&coil.name)));
        vec![
            coil.name.clone(),
            format!("{}{of_current}", amplitude(coil.current_a, "A")),
            amplitude(coil.flux_linkage_wb, "Wb"),
            bar(errors.and_then(|errors| errors.flux_linkages_wb.get(&coil.name)), 1.0),
            coil.resistance_ohm
                .map_or_else(String::new, |own| format!("{} Ω{of_resistance}", number(own, 5))),
            amplitude(coil.voltage_v, "V"),
        ]
    };
    let rows: Vec<Vec<String>> = state.coils.iter().map(row).collect();
    let head = ["coil", "current", "flux linkage", ERROR_BAR, "resistance", "voltage"];
    let peaks = state.coils.first().map_or("", |coil| peaks(coil.voltage_v));
    titled_table(&format!("Coils of the meshed part{}{peaks}", behind_title(state)), &head, &rows, MOST_ROWS)
}

/// The terms of expansions.
fn expansions(state: &State<'_>) -> Markup {
    let behind = behind_title(state);
    html! {
        @for set in state.multipoles {
            (titled_table(
                &format!("Expansion {}, at {} mm{behind}", set.name, number(1e3 * set.radius_m, 4)),
                &["term", "value", ERROR_BAR, "units of 1e-4"],
                &set.terms.iter().map(|term| {
                    let units = term.units.map_or(String::new(), |units| number(units, 5));
                    let error = state.errors.and_then(|errors| errors.multipoles_t.get(&set.name)?.get(&term.name));
                    vec![term.name.clone(), amplitude(term.value_t, "T"), bar(error, 1.0), units]
                }).collect::<Vec<_>>(),
                MOST_ROWS,
            ))
        }
    }
}

/// A square matrix between coils.
fn matrix(title: &str, rows: &[Vec<f64>], result: &RunResult) -> Markup {
    let names: Vec<&str> = result.coils.iter().map(|coil| coil.name.as_str()).collect();
    let head: Vec<&str> = std::iter::once("").chain(names.iter().copied()).collect();
    let row = |(name, values): (&&str, &Vec<f64>)| {
        std::iter::once((*name).to_owned()).chain(values.iter().map(|v| number(*v, 6))).collect()
    };
    let rows: Vec<Vec<String>> = names.iter().zip(rows).map(row).collect();
    titled_table(title, &head, &rows, MOST_ROWS)
}

/// A value in statics; of a phasor magnitude and angle.
fn amplitude(amplitude: Amplitude, unit: &str) -> String {
    match amplitude {
        Amplitude::Static(value) => format!("{} {unit}", number(value, 5)),
        Amplitude::Phasor([re, im]) => {
            format!("{} {unit} ∠ {}°", number(re.hypot(im), 5), number(im.atan2(re).to_degrees(), 4))
        }
    }
}
