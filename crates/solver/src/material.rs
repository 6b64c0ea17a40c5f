//! Linear isotropic materials and what follows from them at one frequency.

/// Permeability of vacuum `μ0` [H/m] (CODATA before 2019, exact to 2e-10 after).
pub const VACUUM_PERMEABILITY: f64 = 4e-7 * std::f64::consts::PI;

/// A linear isotropic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// `μr` [1].
    pub relative_permeability: f64,
    /// `σ` [S/m].
    pub conductivity: f64,
}

impl Material {
    /// Air: `μr = 1`, `σ = 0`.
    pub const AIR: Self = Self { relative_permeability: 1.0, conductivity: 0.0 };

    /// Reluctivity `ν = 1/(μ0 μr)` [m/H].
    pub fn reluctivity(&self) -> f64 {
        1.0 / (VACUUM_PERMEABILITY * self.relative_permeability)
    }

    /// Skin depth `δ = sqrt(2/(ω σ μ))` [m] at the angular frequency `ω` [rad/s]; `None` where nothing is induced.
    pub fn skin_depth(&self, angular_frequency: f64) -> Option<f64> {
        let product = angular_frequency * self.conductivity / self.reluctivity();
        (product > 0.0).then(|| (2.0 / product).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skin_depth_of_the_papers_steel() {
        let steel = Material { relative_permeability: 800.0, conductivity: 7e6 };
        let depth = |hertz: f64| steel.skin_depth(2.0 * std::f64::consts::PI * hertz);
        // Tabulated: 0.9511 mm at 50 Hz.
        assert!((depth(50.0).unwrap() - 0.9511e-3).abs() < 5e-8);
        assert_eq!(depth(0.0), None);
        assert_eq!(Material::AIR.skin_depth(1.0), None);
    }
}
