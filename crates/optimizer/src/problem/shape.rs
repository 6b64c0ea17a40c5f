//! What moves: design variables to surface, surface to mesh, within bounds.

use fluxmorph_geometry::tet4::Point;
use fluxmorph_remesh::{Carried, Motion, Moved, RemeshError};

use super::finite;
use crate::design::DesignSurface;
use crate::error::Error;
use crate::geometric::{NoThickness, WallThickness};

/// Steps at most towards the carried designs; what is left then is cut off the way from a carried one.
const MOST_PUSHES: usize = 20;

/// What moves, how the mesh follows, and within which bounds.
#[derive(Debug)]
pub struct Shape {
    surface: DesignSurface,
    motion: Motion,
    /// Least quality (Eq. 4) of an element that may move, of a design that is evaluated.
    pub least_quality: f64,
    thickness: Result<WallThickness, NoThickness>,
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
    pub fn new(surface: DesignSurface, motion: Motion, least_quality: f64, bounds: [Vec<f64>; 2]) -> Self {
        let [lower, upper] = bounds;
        check_bounds(&surface, &lower, &upper);
        let initial = lower.iter().zip(&upper).map(|(&low, &high)| 0.0_f64.clamp(low, high)).collect();
        Self { surface, motion, least_quality, thickness: Err(NoThickness::default()), lower, upper, initial }
    }

    /// The same with the thickness of the designed bodies.
    #[must_use]
    pub fn with_thickness(self, thickness: Result<WallThickness, NoThickness>) -> Self {
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

    /// Surface to mesh.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Thickness of the designed bodies, where they have one.
    pub fn thickness(&self) -> Option<&WallThickness> {
        self.thickness.as_ref().ok()
    }

    /// The same, or why there is none.
    ///
    /// # Errors
    /// [`NoThickness`].
    pub fn measured_thickness(&self) -> Result<&WallThickness, NoThickness> {
        self.thickness.as_ref().map_err(|why| *why)
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

    /// How far the mesh follows the straight way from a design to another one, and the room there by the variables.
    ///
    /// # Errors
    /// As [`Motion::carried_along`].
    ///
    /// # Panics
    /// If a design has another length than there are variables.
    pub fn carried(&self, from: &[f64], to: &[f64]) -> Result<Carried, RemeshError> {
        let path = |t: f64| self.displacement(&between(from, to, t));
        self.motion.carried_along(&path)
    }

    /// A design near `p`, the end of a way that is `carried` in part, and between the bounds that the mesh carries, or nearly does:
    /// every element that is squeezed too much pushes the variables around it back, by subgradient steps of Polyak's length, which
    /// come nearer to *every* carried design. `p` itself where the nodes do not come to rest there.
    ///
    /// # Errors
    /// As [`Motion::shortfall`].
    ///
    /// # Panics
    /// If `p` has another length than there are variables.
    pub fn pushed_back(&self, p: &[f64], carried: &Carried) -> Result<Vec<f64>, RemeshError> {
        let mut design = p.to_vec();
        let mut shortfall = self.motion.shortfall_at_end(carried)?;
        for push in 1..=MOST_PUSHES {
            let Some(own) = shortfall.take() else { break };
            let gradient = self.surface.gradient(&own.gradient);
            let square: f64 = gradient.iter().map(|g| g * g).sum();
            if square == 0.0 {
                break;
            }
            // Of the root of the shortfall, whose least value is known to be zero.
            let length = 2.0 * own.value / square;
            for (k, x) in design.iter_mut().enumerate() {
                *x = (*x - length * gradient[k]).clamp(self.lower[k], self.upper[k]);
            }
            if push < MOST_PUSHES {
                shortfall = self.motion.shortfall(&self.displacement(&design), Some(&own))?;
            }
        }
        Ok(design)
    }

    /// dF/dp of `owner` from dF/dx at the nodes of a mesh, shape `(n_nodes, 3)`.
    pub(super) fn pull_back(&self, owner: &str, moved: &Moved, nodal: &[Point]) -> Result<Vec<f64>, Error> {
        finite::sensitivity(owner, nodal)?;
        Ok(self.surface.gradient(&moved.pull_back(nodal)?))
    }
}

/// The design at a share `t` of the straight way from one to another; at 1 the other to the last bit.
pub fn between(from: &[f64], to: &[f64], t: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| if t == 1.0 { *to } else { from + t * (to - from) }).collect()
}

fn check_bounds(surface: &DesignSurface, lower: &[f64], upper: &[f64]) {
    assert_eq!([lower.len(), upper.len()], [surface.variable_count(); 2], "one bound a variable");
    assert!(lower.iter().zip(upper).all(|(low, high)| low <= high), "the lower bound is the lower one");
}
