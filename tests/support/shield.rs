//! The shipped quick shield in its two models, and the independent reference of the shield.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use fluxmorph_geometry::fem::c64;
use serde_json::Value;

use super::folder::read_json;
use super::program::{Finished, finish, program};
use super::repository;

/// The shipped quick configuration.
pub(crate) fn quick() -> PathBuf {
    repository("configs/shield_quick.toml")
}

/// `COMMAND quick.toml --out OUT` with further arguments.
pub(crate) fn on_quick(name: &str, out: &Path, further: &[&str]) -> Finished {
    let own: [OsString; 4] = [name.into(), quick().into(), "--out".into(), out.into()];
    finish(program().args(own).args(further))
}

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
        let json = read_json(&repository("tests/reference/shield.json"));
        let vectors = |value: &Value| -> Vec<[f64; 3]> {
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
