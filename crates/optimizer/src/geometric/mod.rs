//! Functions of the shape alone, for constraints: volume or mass of a region, least and greatest thickness.
//!
//! Each gives its value and its exact gradient with respect to the design variables. None of them needs a field; what
//! does lives with the objectives. Bounds on these values and their scaling are the caller's.

mod thickness;
mod volume;

pub use thickness::{Bound, ThicknessBound};
pub use volume::Volume;

use fluxmorph_geometry::MeshError;

/// Why a geometric function cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GeometricError {
    /// A name that the mesh does not have.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The region has no elements, and no surface stands for it.
    #[error(
        "the region `{region}` has no elements in the mesh: its volume is not defined; name a region that is meshed"
    )]
    NoElements {
        /// Its name.
        region: String,
    },
    /// The region is cut by two parallel outer planes along x, along y and along z.
    #[error(
        "the region `{region}` is replaced by its impedance surface and ends at two outer planes along each of x, y and \
         z: its volume does not follow from that surface; take model = \"volume\""
    )]
    Boxed {
        /// Its name.
        region: String,
    },
    /// The design has no thickness.
    #[error(
        "the thickness along the design's direction is not defined: there is no body behind the design surface, or some \
         line through it meets no opposite face; leave the thickness limit out, or give the body a [regions] entry"
    )]
    NoThickness,
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::config::Config;
    use crate::problem::Problem;
    use crate::setup::{Purpose, Setup, set_up};

    pub(super) fn shield(overrides: &[&str]) -> Setup {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/shield_quick.toml");
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
        let (config, source) = Config::from_file(&path, &overrides).unwrap_or_else(|e| panic!("{e}"));
        set_up(&config, &source, Purpose::Optimisation).unwrap_or_else(|e| panic!("{e}"))
    }

    /// A design inside the bounds that is flat nowhere.
    pub(super) fn wavy(problem: &Problem) -> Vec<f64> {
        let variables = problem.shape.as_ref().expect("a shape").surface.variable_count();
        (0..variables).map(|k| 4e-3 + 3e-3 * (1.7 * k as f64).sin()).collect()
    }

    /// Slope 2 of the Taylor remainder, or a remainder that is rounding alone, in a direction that is flat nowhere.
    pub(super) fn taylor(value: impl Fn(&[f64]) -> (f64, Vec<f64>), p: &[f64], first_step: f64) {
        let direction: Vec<f64> = (0..p.len()).map(|k| (0.9 * k as f64 + 0.4).cos()).collect();
        let (base, gradient) = value(p);
        let slope: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        let remainder = |h: f64| {
            let moved: Vec<f64> = p.iter().zip(&direction).map(|(p, d)| p + h * d).collect();
            (value(&moved).0 - base - h * slope).abs()
        };
        let steps: Vec<f64> = (0..4).map(|i| first_step * 0.5_f64.powi(i)).collect();
        let remainders: Vec<f64> = steps.iter().map(|&h| remainder(h)).collect();
        println!("value {base:e}, slope {slope:e}, remainders {remainders:?}");
        // A sum of some thousand terms of the value's size carries this much rounding.
        let rounding = 1e-13 * base.abs();
        for pair in remainders.windows(2).filter(|pair| pair[1] > 10.0 * rounding) {
            let order = (pair[0] / pair[1]).log2();
            assert!((1.9..2.2).contains(&order), "order {order}: {remainders:?}");
        }
        // Without second order the remainder is nothing but rounding: then the gradient is exact as it stands.
        assert!(
            remainders[0] < 0.5 * (first_step * slope).abs() + rounding,
            "{remainders:?} against {slope}"
        );
    }
}
