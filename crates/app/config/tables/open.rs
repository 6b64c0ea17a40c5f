//! `[open]`: a shell that stands for all space outside the mesh.

use crate::config::section::Section;
use crate::config::table::table;

/// Most layers of a shell: its error falls with the cube of their number or faster.
const MOST_LAYERS: usize = 32;

table! {
    /// Open space: a shell of elements around the mesh stands for everything outside, so that no wall is needed far away.
    /// It is put around the outer `surfaces` of any mesh, or is a `region` of a mesh file. In the shell is air; matter,
    /// coils with their windows and what is observed belong inside.
    ///
    /// ```toml
    /// [open]
    /// surfaces = ["x_max", "y_max", "z_min", "z_max"]
    /// ```
    pub struct Open {
        /// Outer surfaces beyond which space is open: all but symmetry planes. They take no condition; the shell adds the
        /// region `open` and, where it ends, the surface `infinity` with A = 0.
        surfaces: Option<Vec<String>> = NAMES;
        /// A region of a mesh file that is such a shell already, instead of `surfaces`. It lies between two surfaces that every ray
        /// from the center meets once, at best of twice the size of each other.
        region: Option<String> = TEXT;
        /// The point from which space is stretched [m]: every open surface must be seen from it, and symmetry planes must pass
        /// through it.
        center: [f64; 3] = length(FINITE) => [0.0; 3];
        /// Layers of elements of the shell around `surfaces`.
        layers: usize = integer(1, MOST_LAYERS) => 4;
    }
    check = Open::check;
    rules = |rules| rules.exactly_one(&["surfaces", "region"]);
}

impl Open {
    /// Outer surfaces beyond which space is open; none where the shell is a region.
    pub fn surfaces(&self) -> &[String] {
        self.surfaces.as_deref().unwrap_or_default()
    }

    /// One of the two forms.
    fn check(&mut self, section: &Section<'_>) {
        match ["region", "surfaces"].map(|key| section.has(key)) {
            [false, false] => section.missing(
                &["surfaces"],
                "surfaces = [\"outer\"]: the outer surfaces beyond which space is open, or region = \"shell\"",
            ),
            [true, true] => section.clash(
                ["region", "surfaces"],
                "the shell is a region of the mesh and put around it at once".to_owned(),
                "one of the two",
            ),
            _ => {}
        }
    }
}
