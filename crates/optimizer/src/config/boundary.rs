//! `[boundaries]`: what the field does at the outer faces and symmetry planes.

use serde::Serialize;

use super::Dimension;
use super::range::Range;
use super::section::Section;

/// Surfaces with a boundary condition, by name. All lists are empty by default.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Boundaries {
    /// No flux crosses these: `n × A = 0`.
    pub flux_parallel: Vec<String>,
    /// The flux crosses these at right angles: `n · A = 0`.
    pub flux_normal: Vec<String>,
    /// A uniform field applied from outside. Default none.
    pub uniform_field: Option<UniformField>,
}

/// A uniform applied field: `A = ½ B × (x − center)` is prescribed on surfaces.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UniformField {
    /// The surfaces, by name.
    pub surfaces: Vec<String>,
    /// Flux density far away, amplitude [T].
    pub b: [f64; 3],
    /// Where the prescribed `A` is zero [m]; `B` does not depend on it, but a flux-parallel plane that touches the surfaces
    /// must hold it. Default: on these planes, and at the origin in the directions without one.
    pub center: Option<[f64; 3]>,
}

impl Boundaries {
    pub(super) fn read(section: &Section<'_>) -> Self {
        let boundaries = Self {
            flux_parallel: section.names("flux_parallel").unwrap_or_default(),
            flux_normal: section.names("flux_normal").unwrap_or_default(),
            uniform_field: section.table("uniform_field").map(UniformField::read),
        };
        if let Some(name) = boundaries.flux_parallel.iter().find(|name| boundaries.flux_normal.contains(name))
        {
            section.wrong(
                "flux_normal",
                format!("`{name}` is flux-parallel and flux-normal at once"),
                "each surface in one of the two lists",
            );
        }
        let given = boundaries.uniform_field.iter().flat_map(|field| &field.surfaces);
        for name in given {
            for (kind, list) in
                [("flux-parallel", &boundaries.flux_parallel), ("flux-normal", &boundaries.flux_normal)]
            {
                if list.contains(name) {
                    section.wrong(
                        "uniform_field",
                        format!("`{name}` is {kind} and has a uniform field at once"),
                        "each surface with one condition",
                    );
                }
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
