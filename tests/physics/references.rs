//! Reference numbers of `tests/reference/`.

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::Material;
use serde_json::Value;

pub(crate) use crate::support::folder::named;
use crate::support::folder::read_json;
use crate::support::repository;

/// The numbers of one file.
pub(crate) fn reference(file: &str) -> Value {
    read_json(&repository("tests/reference").join(file))
}

/// The number of a key.
pub(crate) fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("no number `{key}`"))
}

/// A complex number of two.
pub(crate) fn complex(value: &Value) -> c64 {
    let part = |i: usize| value[i].as_f64().expect("two numbers");
    c64::new(part(0), part(1))
}

/// The material of an entry.
pub(crate) fn material(value: &Value) -> Material {
    Material {
        relative_permeability: number(value, "relative_permeability"),
        conductivity: number(value, "conductivity_S_per_m"),
    }
}
