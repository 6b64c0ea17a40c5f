//! What moves: design variables to surface, surface to mesh, within bounds.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_remesh::{Motion, RemeshError, StepLimits};

use super::finite;
use crate::design::DesignSurface;
use crate::error::Error;
use crate::geometric::WallThickness;

/// What moves, how the mesh follows, and within which bounds.
#[derive(Debug)]
pub struct Shape {
    surface: DesignSurface,
    motion: Motion,
    /// How far a design may lie from the reference of its round, and how many rounds there may be.
    pub limits: StepLimits,
    thickness: Option<WallThickness>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    initial: Vec<f64>,
}

impl Shape {
    /// A surface that moves between the bounds `[lower, upper]` [m], from the undeformed mesh of `motion`; it begins at
    /// zero, or at the bound next to it.
    ///
    /// # Panics
    /// If there is not one bound a variable, or the bounds cross.
    pub fn new(surface: DesignSurface, motion: Motion, limits: StepLimits, bounds: [Vec<f64>; 2]) -> Self {
        let [lower, upper] = bounds;
        check_bounds(&surface, &lower, &upper);
        let initial = lower.iter().zip(&upper).map(|(&low, &high)| 0.0_f64.clamp(low, high)).collect();
        Self { surface, motion, limits, thickness: None, lower, upper, initial }
    }

    /// The same with the thickness of the designed body.
    #[must_use]
    pub fn with_thickness(self, thickness: Option<WallThickness>) -> Self {
        Self { thickness, ..self }
    }

    /// The same beginning at `initial` [m].
    ///
    /// # Panics
    /// If there is not one value a variable.
    #[must_use]
    pub fn starting_at(mut self, initial: Vec<f64>) -> Self {
        self.set_initial(initial);
        self
    }

    /// Begins at `initial` [m].
    ///
    /// # Panics
    /// If there is not one value a variable.
    pub fn set_initial(&mut self, initial: Vec<f64>) {
        assert_eq!(initial.len(), self.surface.variable_count(), "one value a variable");
        self.initial = initial;
    }

    /// Moves between other bounds `[lower, upper]` [m].
    ///
    /// # Panics
    /// If there is not one bound a variable, or the bounds cross.
    pub fn set_bounds(&mut self, [lower, upper]: [Vec<f64>; 2]) {
        check_bounds(&self.surface, &lower, &upper);
        (self.lower, self.upper) = (lower, upper);
    }

    /// Design variables to surface.
    pub fn surface(&self) -> &DesignSurface {
        &self.surface
    }

    /// Surface to mesh (Eq. 3) in the present round.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Begins another round, and gives back the motion of the one before.
    pub fn set_motion(&mut self, motion: Motion) -> Motion {
        std::mem::replace(&mut self.motion, motion)
    }

    /// Thickness of the designed body, where it has one.
    pub fn thickness(&self) -> Option<&WallThickness> {
        self.thickness.as_ref()
    }

    /// Lower bound of every variable [m].
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// Upper bound of every variable [m].
    pub fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// Where the optimisation starts [m].
    pub fn initial(&self) -> &[f64] {
        &self.initial
    }

    /// Displacement of the design nodes from the undeformed mesh [m], shape `(n_design, 3)`.
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn displacement(&self, p: &[f64]) -> Vec<Point> {
        assert_eq!(p.len(), self.surface.variable_count(), "one value a variable");
        self.surface.displacement(p)
    }

    /// The round that begins at a design: `reference` is its mesh, `displacement` that of every node from the undeformed
    /// one [m].
    ///
    /// # Errors
    /// As [`Motion::rebased`].
    pub fn next_round(
        &self,
        p: &[f64],
        reference: Mesh,
        displacement: Vec<Point>,
    ) -> Result<Motion, RemeshError> {
        self.motion.rebased(reference, displacement, self.displacement(p), self.motion.policy())
    }

    /// dF/dp of `owner` from dF/dx at the nodes, shape `(n_nodes, 3)`.
    pub(super) fn pull_back(&self, owner: &str, nodal: &[Point]) -> Result<Vec<f64>, Error> {
        finite::sensitivity(owner, nodal)?;
        Ok(self.surface.gradient(&self.motion.map().gradient(nodal)?))
    }
}

fn check_bounds(surface: &DesignSurface, lower: &[f64], upper: &[f64]) {
    assert_eq!([lower.len(), upper.len()], [surface.variable_count(); 2], "one bound a variable");
    assert!(lower.iter().zip(upper).all(|(low, high)| low <= high), "the lower bound is the lower one");
}
