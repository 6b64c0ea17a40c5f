//! What the top-level tests share: shipped configurations, and the reference of the shield.

#![allow(dead_code, reason = "every test binary uses its part")]

use std::path::PathBuf;

use fluxmorph_geometry::fem::c64;
use fluxmorph_optimizer::config::{Config, SourceMap};
use fluxmorph_optimizer::setup::{Purpose, Setup, set_up};

/// A file of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A shipped configuration with overrides `key=value`.
pub(crate) fn config(name: &str, overrides: &[&str]) -> (Config, SourceMap) {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    Config::from_file(&repository("configs").join(name), &overrides).unwrap_or_else(|e| panic!("{e}"))
}

/// The problem of a shipped configuration with overrides.
pub(crate) fn setup(name: &str, overrides: &[&str]) -> Setup {
    let (config, source) = config(name, overrides);
    set_up(&config, &source, Purpose::Optimisation).unwrap_or_else(|e| panic!("{e}"))
}

/// The independent reference of the shield (`tests/reference/shield.json`): B in the 12 observation cells.
pub(crate) struct ShieldReference {
    /// B of the flat plate [T], shape `(12, 3)`.
    pub(crate) flat: Vec<[c64; 3]>,
    /// B of the framed plate [T].
    pub(crate) framed: Vec<[c64; 3]>,
    /// The framed plate's design variables [m].
    pub(crate) framed_design: Vec<f64>,
    /// Where B was taken [m].
    pub(crate) points: Vec<[f64; 3]>,
}

impl ShieldReference {
    /// Reads the reference file.
    pub(crate) fn read() -> Self {
        let text = std::fs::read_to_string(repository("tests/reference/shield.json")).expect("it is there");
        let json: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
        let vectors = |value: &serde_json::Value| -> Vec<[f64; 3]> {
            serde_json::from_value(value.clone()).expect("a list of vectors")
        };
        let complex = |case: &str| -> Vec<[c64; 3]> {
            let (re, im) = (vectors(&json[case]["b_re_t"]), vectors(&json[case]["b_im_t"]));
            re.iter().zip(&im).map(|(re, im)| std::array::from_fn(|d| c64::new(re[d], im[d]))).collect()
        };
        Self {
            flat: complex("flat"),
            framed: complex("framed"),
            framed_design: serde_json::from_value(json["framed"]["design_m"].clone()).expect("a list"),
            points: vectors(&json["points_m"]),
        }
    }
}

/// Relative l2 difference of complex vectors.
pub(crate) fn relative_l2(values: &[[c64; 3]], reference: &[[c64; 3]]) -> f64 {
    assert_eq!(values.len(), reference.len());
    let sum = |f: &dyn Fn(usize, usize) -> c64| -> f64 {
        (0..values.len()).flat_map(|k| (0..3).map(move |d| (k, d))).map(|(k, d)| f(k, d).norm_sqr()).sum()
    };
    (sum(&|k, d| values[k][d] - reference[k][d]) / sum(&|k, d| reference[k][d])).sqrt()
}
