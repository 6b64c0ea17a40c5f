//! One run of a shipped configuration, and the numbers that are compared.

use serde_json::Value;

use super::rows::Case;
use crate::support::folder::list;
use crate::support::program::{command, finish, folder};
use crate::support::repository;

/// Which mesh a configuration is solved on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MeshSize {
    /// Cells of 1/0.6 the shipped size: a second or two.
    Coarse,
    /// As shipped.
    Shipped,
}

/// What `fluxmorph solve` says of a shipped configuration, as in `result.json`.
pub(crate) fn solved(config: &str, size: MeshSize) -> Value {
    let folder = folder();
    let (config, out) = (repository("configs").join(config), folder.path().join("run"));
    let mut command = command(&[&"solve", &config, &"--out", &out, &"--json", &"--quiet"]);
    // It is held against measurements: the error estimate is not looked at, and takes longer than all else.
    command.args(["--set", "accuracy.estimate=false"]);
    if size == MeshSize::Coarse {
        command.args(["--set", "mesh.boxes.refinement=0.6"]);
    }
    let result = finish(&mut command).exits_with(0).json();
    println!(
        "{} ({size:?}): {} tetrahedra, {} unknowns, {:.2} GB",
        config.display(),
        result["mesh"]["tets"],
        result["mesh"]["unknowns"],
        result["peak_memory_bytes"].as_f64().unwrap_or(f64::NAN) / 1e9,
    );
    result
}

/// The mesh of a result, under a name.
pub(crate) fn case(name: String, result: &Value) -> Case {
    let count = |key: &str| result["mesh"][key].as_u64().expect("a count") as usize;
    Case { name, tets: count("tets"), unknowns: count("unknowns") }
}

/// A list of numbers.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    list(value, "").iter().map(|number| number.as_f64().expect("a number")).collect()
}

/// One component of a list of vectors.
pub(crate) fn component(vectors: &Value, axis: usize) -> Vec<f64> {
    list(vectors, "").iter().map(|vector| vector[axis].as_f64().expect("a number")).collect()
}

/// Root mean square of the differences, over the largest measured magnitude.
pub(crate) fn rms_of_peak(values: &[f64], measured: &[f64]) -> f64 {
    assert_eq!(values.len(), measured.len());
    let squares: f64 = values.iter().zip(measured).map(|(a, b)| (a - b).powi(2)).sum();
    let peak = measured.iter().fold(0.0, |peak: f64, m| peak.max(m.abs()));
    (squares / values.len() as f64).sqrt() / peak
}
