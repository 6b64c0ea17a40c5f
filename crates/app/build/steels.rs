//! Steels that the program knows by name, with their sources.

use fluxmorph_solver::BhCurve;

use crate::config::Steel;

/// All of them.
pub(crate) const ALL: [Steel; 4] = [Steel::Team20, Steel::Team13, Steel::M40050A, Steel::PureIron];

/// A steel's table as `fluxmorph generate materials` prints it, with its source in comments.
pub(crate) fn table(steel: Steel) -> &'static str {
    match steel {
        Steel::Team20 => include_str!("../materials/team20_steel.csv"),
        Steel::Team13 => include_str!("../materials/team13_steel.csv"),
        Steel::M40050A => include_str!("../materials/m400_50a.csv"),
        Steel::PureIron => include_str!("../materials/pure_iron.csv"),
    }
}

/// Whether a line of a table has a point: no comment, and not empty.
pub(crate) fn is_row(line: &str) -> bool {
    !line.trim().is_empty() && !line.trim_start().starts_with('#')
}

/// A steel's law.
pub(super) fn curve(steel: Steel) -> BhCurve {
    let number = |field: &str| field.trim().parse::<f64>().expect("the tables of the program hold numbers");
    let point = |line: &str| -> [f64; 2] {
        let (h, b) = line.split_once(',').expect("the tables of the program have two columns");
        [number(h), number(b)]
    };
    let points: Vec<[f64; 2]> = table(steel).lines().filter(|line| is_row(line)).map(point).collect();
    BhCurve::new(&points).expect("the tables of the program are sound")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_steel_saturates_at_its_end_and_names_its_source() {
        for steel in ALL {
            let curve = curve(steel);
            assert!(curve.ends_saturated(), "{steel:?}");
            assert!(curve.end().is_some_and(|[_, b]| b > 2.0), "{steel:?}");
            assert!(
                ["TEAM", "Pyleecan", "Metals Handbook"].iter().any(|source| table(steel).contains(source)),
                "{steel:?}"
            );
        }
    }
}
