//! The quick shield plate in its two models, and its run directory read back without the program's own types.

use std::path::{Path, PathBuf};

use fluxmorph_geometry::io::{VtuArray, VtuContents, read_vtu};
use serde_json::Value;

use crate::program::{Finished, on_quick, read_json};

/// The two ways to model the plate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Model {
    /// As the quick configuration has it.
    Impedance,
    /// A-psi inside the plate, with few mesh lines below its faces: rough, and quick.
    Meshed,
}

impl Model {
    /// Both.
    pub(crate) const ALL: [Self; 2] = [Self::Impedance, Self::Meshed];

    /// What the command line adds to the quick configuration.
    pub(crate) fn arguments(self) -> &'static [&'static str] {
        match self {
            Self::Impedance => &[],
            Self::Meshed => &[
                "--set",
                "regions.plate.model=volume",
                "--set",
                "mesh.shield.skin=[\"0.8 mm\", \"2.5 mm\"]",
                "--set",
                "remesh.region=[\"plate\", \"remesh\"]",
                "--set",
                "remesh.stiffness=inverse_volume",
                "--set",
                "remesh.motion=along_design",
                "--set",
                "remesh.poisson=0.0",
            ],
        }
    }

    /// Runs a command on this model.
    pub(crate) fn command(self, name: &str, out: &Path, further: &[&str]) -> Finished {
        on_quick(name, out, &[self.arguments(), further].concat())
    }
}

/// A run directory.
pub(crate) struct RunFolder(pub(crate) PathBuf);

impl RunFolder {
    /// One JSON file of it.
    #[track_caller]
    pub(crate) fn json(&self, name: &str) -> Value {
        read_json(&self.0.join(name))
    }

    /// A text file of it.
    #[track_caller]
    pub(crate) fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The field file of one evaluation.
    #[track_caller]
    pub(crate) fn field(&self, evaluation: u64) -> VtuContents {
        let path = self.0.join(format!("fields/eval_{evaluation:04}.vtu"));
        read_vtu(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// `history.csv`: header and rows.
    #[track_caller]
    pub(crate) fn history(&self) -> (Vec<String>, Vec<Vec<String>>) {
        let text = self.text("history.csv");
        let mut rows = text.lines().map(|line| line.split(',').map(str::to_owned).collect());
        (rows.next().expect("a header"), rows.collect())
    }
}

/// A number of a JSON value.
#[track_caller]
pub(crate) fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer}"))
}

/// A whole number of a JSON value.
#[track_caller]
pub(crate) fn count(value: &Value, pointer: &str) -> u64 {
    value.pointer(pointer).and_then(Value::as_u64).unwrap_or_else(|| panic!("no count at {pointer}"))
}

/// A list of numbers of a JSON value.
#[track_caller]
pub(crate) fn numbers(value: &Value, pointer: &str) -> Vec<f64> {
    let list = value.pointer(pointer).and_then(Value::as_array);
    let list = list.unwrap_or_else(|| panic!("no list at {pointer}"));
    list.iter().map(|item| item.as_f64().expect("a number")).collect()
}

/// A scalar array, shape `(n,)`.
#[track_caller]
pub(crate) fn scalars(array: &VtuArray) -> &[f64] {
    match array {
        VtuArray::Scalar(values) => values,
        other => panic!("a scalar array was expected, not {} items of another kind", other.len()),
    }
}

/// A vector array, shape `(n, 3)`.
#[track_caller]
pub(crate) fn vectors(array: &VtuArray) -> &[[f64; 3]] {
    match array {
        VtuArray::Vector(values) => values,
        other => panic!("a vector array was expected, not {} items of another kind", other.len()),
    }
}

/// Bilinear height over the far face of a design of the 7 by 13 control grid, whose points lie every 20 mm: index
/// `13 i + j` at `x = 0.02 i`, `y = 0.02 j` (the order that the documentation fixes).
pub(crate) fn height(design: &[f64], x: f64, y: f64) -> f64 {
    let cell = |coordinate: f64, last: usize| {
        let index = ((coordinate / 0.02 + 1e-9) as usize).min(last - 1);
        (index, coordinate / 0.02 - index as f64)
    };
    let ((i, s), (j, t)) = (cell(x, 6), cell(y, 12));
    let p = |i: usize, j: usize| design[13 * i + j];
    (1.0 - s) * ((1.0 - t) * p(i, j) + t * p(i, j + 1)) + s * ((1.0 - t) * p(i + 1, j) + t * p(i + 1, j + 1))
}

/// Nodes of the far face of the undeformed plate: `z = -10 mm`, within 120 mm by 240 mm.
pub(crate) fn plate_bottom(points: &[[f64; 3]]) -> Vec<usize> {
    // Mesh lines are far more than a nanometre apart.
    let near = 1e-9;
    (0..points.len())
        .filter(|&n| {
            let [x, y, z] = points[n];
            (z + 0.01).abs() < near && x < 0.12 + near && y < 0.24 + near
        })
        .collect()
}

/// Signed volume of a tetrahedron [m³].
pub(crate) fn volume(corners: [[f64; 3]; 4]) -> f64 {
    let edge = |k: usize| -> [f64; 3] { std::array::from_fn(|d| corners[k][d] - corners[0][d]) };
    let (a, b, c) = (edge(1), edge(2), edge(3));
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    (0..3).map(|d| cross[d] * c[d]).sum::<f64>() / 6.0
}

/// Corners of every tetrahedron of a file.
pub(crate) fn corners(field: &VtuContents) -> Vec<[[f64; 3]; 4]> {
    field.tets.iter().map(|tet| tet.map(|node| field.points[node.index()])).collect()
}
