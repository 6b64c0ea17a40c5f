//! Tables of what coils are in circuits, and of expansions of the field.

use maud::{Markup, html};

use super::tables::{MOST_ROWS, titled_table};
use super::ticks::number;
use crate::files::{Amplitude, RunResult};

/// Terminals, inductances and coupling of coils; terms of expansions.
pub(super) fn circuits(result: &RunResult) -> Markup {
    let rows: Vec<Vec<String>> = result
        .coils
        .iter()
        .map(|coil| {
            vec![
                coil.name.clone(),
                amplitude(coil.current_a, "A"),
                amplitude(coil.flux_linkage_wb, "Wb"),
                format!("{} Ω", number(coil.resistance_ohm, 5)),
                amplitude(coil.voltage_v, "V"),
            ]
        })
        .collect();
    let head = ["coil", "current", "flux linkage", "resistance", "voltage"];
    html! {
        (titled_table("Coils of the meshed part", &head, &rows, MOST_ROWS))
        (matrix("Inductances [H]", &result.inductance_h, result))
        @if result.coils.len() > 1 { (matrix("Coupling", &result.coupling, result)) }
        @for set in &result.multipoles {
            (titled_table(
                &format!("Expansion {}, at {} mm", set.name, number(1e3 * set.radius_m, 4)),
                &["term", "value", "units of 1e-4"],
                &set.terms.iter().map(|term| {
                    let units = term.units.map_or(String::new(), |units| number(units, 5));
                    vec![term.name.clone(), amplitude(term.value_t, "T"), units]
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
