//! `[boundaries]`: what the field does at the outer faces and symmetry planes.

use serde::Serialize;

use super::section::Section;

/// Surfaces with a boundary condition, by name. Both lists are empty by default.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Boundaries {
    /// No flux crosses these: `n × A = 0`.
    pub flux_parallel: Vec<String>,
    /// The flux crosses these at right angles: `n · A = 0`.
    pub flux_normal: Vec<String>,
}

impl Boundaries {
    pub(super) fn read(section: &Section<'_>) -> Self {
        let boundaries = Self {
            flux_parallel: section.names("flux_parallel").unwrap_or_default(),
            flux_normal: section.names("flux_normal").unwrap_or_default(),
        };
        if let Some(name) = boundaries.flux_parallel.iter().find(|name| boundaries.flux_normal.contains(name))
        {
            section.wrong(
                "flux_normal",
                format!("`{name}` is flux-parallel and flux-normal at once"),
                "each surface in one of the two lists",
            );
        }
        if section.table("uniform_field").is_some() {
            section.wrong(
                "uniform_field",
                "a uniform applied field is not supported",
                "flux_parallel and flux_normal only, with coils as sources",
            );
        }
        boundaries
    }
}
