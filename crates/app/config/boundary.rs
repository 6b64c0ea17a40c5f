//! `[boundaries]`: what the field does at the outer faces and symmetry planes.

use schemars::JsonSchema;
use serde::Serialize;

use super::Dimension;
use super::range::Range;
use super::section::Section;
use crate::schema::form::{length, name_or_names, names, not_all_zero, quantity};

/// What the field does at the outer faces and symmetry planes, by name of the surface. Each surface has at most one
/// condition. On an outer face without one the flux crosses at right angles, n × H = 0, as into iron of infinite permeability.
///
/// ```toml
/// [boundaries]
/// flux_parallel = ["x_min", "y_min", "z_max"]
/// flux_normal = ["z_min"]
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(default)]
pub struct Boundaries {
    /// No flux crosses these surfaces: n × A = 0.
    #[schemars(transform = names)]
    pub flux_parallel: Vec<String>,
    /// The flux crosses these surfaces at right angles: n · A = 0.
    #[schemars(transform = names)]
    pub flux_normal: Vec<String>,
    /// A uniform field applied from outside.
    pub uniform_field: Option<UniformField>,
}

/// A uniform field applied from outside: A = ½ B × (x − `center`) is prescribed on some surfaces. Where planes with a
/// condition touch these surfaces, the field must agree with it: parallel to flux-parallel planes, at right angles to
/// flux-normal ones.
///
/// ```toml
/// [boundaries.uniform_field]
/// surfaces = ["outer"]
/// b = ["0 T", "0 T", "1 mT"]
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UniformField {
    /// The surfaces on which A is given.
    #[schemars(transform = name_or_names)]
    pub surfaces: Vec<String>,
    /// Amplitude of the flux density far away [T], not zero.
    #[schemars(transform = quantity(Dimension::FluxDensity, Range::FINITE), transform = not_all_zero)]
    pub b: [f64; 3],
    /// Where the given A is zero [m]; B does not depend on it, but flux-parallel planes that touch the surfaces must pass
    /// through it. Default: on these planes, and at 0 in the directions without one.
    #[schemars(transform = length(Range::FINITE))]
    pub center: Option<[f64; 3]>,
}

impl Boundaries {
    pub(super) fn read(section: &Section<'_>) -> Self {
        let boundaries = Self {
            flux_parallel: section.names("flux_parallel").unwrap_or_default(),
            flux_normal: section.names("flux_normal").unwrap_or_default(),
            uniform_field: section.table("uniform_field").map(UniformField::read),
        };
        for (i, name) in boundaries.flux_normal.iter().enumerate().take_while(|_| !section.is_crowded()) {
            let Some(k) = boundaries.flux_parallel.iter().position(|other| other == name) else { continue };
            section.clash(
                [&format!("flux_parallel[{k}]"), &format!("flux_normal[{i}]")],
                format!("`{name}` is flux-parallel and flux-normal at once"),
                "each surface in one of the two lists",
            );
        }
        let given = boundaries.uniform_field.iter().flat_map(|field| &field.surfaces);
        for (i, name) in given.enumerate().take_while(|_| !section.is_crowded()) {
            for (key, list) in
                [("flux_parallel", &boundaries.flux_parallel), ("flux_normal", &boundaries.flux_normal)]
            {
                let Some(k) = list.iter().position(|other| other == name) else { continue };
                section.clash(
                    [&format!("{key}[{k}]"), &format!("uniform_field.surfaces[{i}]")],
                    format!("`{name}` is {} and has a uniform field at once", key.replace('_', "-")),
                    "each surface with one condition",
                );
            }
        }
        boundaries
    }
}

impl UniformField {
    fn read(section: Section<'_>) -> Self {
        let surfaces = section.name_or_names("surfaces");
        let b: Option<[f64; 3]> = section.quantities("b", Dimension::FluxDensity, Range::FINITE);
        if b == Some([0.0; 3]) {
            section.wrong(
                "b",
                format!("`{}.b` is zero: there is no field", section.path()),
                "a flux density",
            );
        }
        let center = section.lengths("center", Range::FINITE);
        let field = Self {
            surfaces: section.need("surfaces", surfaces, "[\"outer\"]"),
            b: section.need("b", b, "[\"0 T\", \"0 T\", \"1 T\"]"),
            center,
        };
        section.finish();
        field
    }
}
