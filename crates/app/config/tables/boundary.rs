//! `[boundaries]`: what the field does at the outer faces and symmetry planes.

use crate::config::section::Section;
use crate::config::table::table;

table! {
    /// What the field does at the outer faces and symmetry planes, by name of the surface. Each surface has at most one
    /// condition. On an outer face without one the flux crosses at right angles, n × H = 0, as into iron of infinite permeability.
    ///
    /// ```toml
    /// [boundaries]
    /// flux_parallel = ["x_min", "y_min", "z_max"]
    /// flux_normal = ["z_min"]
    /// ```
    pub struct Boundaries: Default {
        /// No flux crosses these surfaces: n × A = 0.
        flux_parallel: Vec<String> = NAMES => Vec::new();
        /// The flux crosses these surfaces at right angles: n · A = 0.
        flux_normal: Vec<String> = NAMES => Vec::new();
        /// A uniform field applied from outside.
        uniform_field: Option<UniformField> = TABLE;
    }
    check = Boundaries::check;
}

impl Boundaries {
    /// The surfaces that have a condition.
    pub fn surfaces(&self) -> impl Iterator<Item = &String> {
        let applied = self.uniform_field.iter().flat_map(|field| &field.surfaces);
        self.flux_parallel.iter().chain(&self.flux_normal).chain(applied)
    }

    /// Whether no surface has a condition.
    pub fn is_empty(&self) -> bool {
        self.flux_parallel.is_empty() && self.flux_normal.is_empty() && self.uniform_field.is_none()
    }
}

table! {
    /// A uniform field applied from outside: A = ½ B × (x − `center`) is prescribed on some surfaces. Where planes with a
    /// condition touch these surfaces, the field must agree with it: parallel to flux-parallel planes, at right angles to
    /// flux-normal ones.
    ///
    /// ```toml
    /// [boundaries.uniform_field]
    /// surfaces = ["outer"]
    /// b = ["0 T", "0 T", "1 mT"]
    /// ```
    pub struct UniformField {
        /// The surfaces on which A is given.
        surfaces: Vec<String> = NAME_OR_NAMES, need "[\"outer\"]";
        /// Amplitude of the flux density far away [T], not zero.
        #[also(not_all_zero)]
        b: [f64; 3] = quantity(FluxDensity, FINITE), need "[\"0 T\", \"0 T\", \"1 T\"]";
        /// Where the given A is zero [m]; B does not depend on it, but flux-parallel planes that touch the surfaces must pass
        /// through it. Default: on these planes, and at 0 in the directions without one.
        center: Option<[f64; 3]> = length(FINITE);
    }
    check = |field, section| {
        if field.b == [0.0; 3] {
            section.wrong("b", format!("`{}.b` is zero: there is no field", section.path()), "a flux density");
        }
    };
}

impl Boundaries {
    /// A surface has one condition.
    fn check(&mut self, section: &Section<'_>) {
        for (i, name) in self.flux_normal.iter().enumerate().take_while(|_| !section.is_crowded()) {
            let Some(k) = self.flux_parallel.iter().position(|other| other == name) else { continue };
            section.clash(
                [&format!("flux_parallel[{k}]"), &format!("flux_normal[{i}]")],
                format!("`{name}` is flux-parallel and flux-normal at once"),
                "each surface in one of the two lists",
            );
        }
        let given = self.uniform_field.iter().flat_map(|field| &field.surfaces);
        for (i, name) in given.enumerate().take_while(|_| !section.is_crowded()) {
            for (key, list) in [("flux_parallel", &self.flux_parallel), ("flux_normal", &self.flux_normal)] {
                let Some(k) = list.iter().position(|other| other == name) else { continue };
                section.clash(
                    [&format!("{key}[{k}]"), &format!("uniform_field.surfaces[{i}]")],
                    format!("`{name}` is {} and has a uniform field at once", key.replace('_', "-")),
                    "each surface with one condition",
                );
            }
        }
    }
}
