//! What nodal elements lose in a meshed conductor, before anything is solved.
//!
//! Below the skin `A + ∇ψ = 0`, though `A` is not zero: it goes on through the conductor. With both of one degree `∇ψ` is of a
//! degree less than `A`, so that in an element of size `h` the sum vanishes for an `A` of that degree alone. Of first order it leaves
//! `h|∇A|`, which the eddy term weighs with `2ν/δ²`. That has two ends:
//!
//! * `A` is held constant as if its reluctivity there were `ν (h/δ)²`. Where that is more than what the field has outside,
//!   `ν0 L/t` by the conductor's thickness and size, `A` stays zero in the conductor and its normal part around the edges too,
//!   which no field goes around that is in H¹: as with impedance surfaces without `ψ` (`reentrant`).
//! * What is left of `A + ∇ψ` makes loss: with `|∇A| ≈ μ0 |H|` more than the skin's own, where `h² t > δ³ μr²`.
//!
//! An impedance surface keeps what is left from the field, but not from its losses, `h²/(δ μr)²` of them.
//!
//! Second order has `h²|∇²A|` in place of it. The factors are fitted to prisms with blocks, slabs and plates of all sizes, where
//! they hold but for a factor of three; of losses they are upper ones, ten times too large in plates along flux-parallel walls
//! (`tests/physics/prisms/locking.rs`; docs/verification.md, 2.8). Edge elements have gradients of the degree of `A`.

use super::SkinAudit;
use crate::elements::Order;

/// Of the field: error over `(h/δ)² t/(μr L)`.
const FIELD: f64 = 0.06;

/// Of the losses of a conductor with a skin: error over `h² t/(δ³ μr²)`.
const SKIN: f64 = 0.4;

/// Of the losses of a conductor that the field fills, along the field: error over `h²/(t μr)²`.
const FILLED: f64 = 2.0;

/// In second order, of field and losses: error over that in first order and `h²/L²`.
const SECOND: [f64; 2] = [0.03, 0.2];

/// Of the losses of an impedance surface in first order: error over `(h/(δ μr))²`.
const SURFACE: f64 = 0.03;

/// Thickness in skin depths above which the field of both faces does not meet.
const SKIN_FORMS: f64 = 3.0;

/// Relative errors that nodal elements have beside and in a conductor, roughly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodalErrors {
    /// Of the field outside.
    pub field: f64,
    /// Of the losses.
    pub losses: f64,
    /// Whether the losses are that wrong only in a field along the conductor, which it does not shield.
    pub is_filled: bool,
}

impl SkinAudit {
    /// What nodal elements of an order make of this conductor.
    pub fn nodal_errors(&self, order: Order) -> NodalErrors {
        let depths = self.thickness_in_skin_depths;
        let thickness = depths * self.skin_depth;
        let square = (self.edge_length / self.skin_depth).powi(2);
        let is_filled = depths < SKIN_FORMS;
        let losses = self.relative_permeability.powi(-2)
            * if is_filled { FILLED * square / (depths * depths) } else { SKIN * square * depths };
        let field = FIELD * square * thickness / (self.relative_permeability * self.extent);
        let finer = match order {
            Order::Linear => [1.0; 2],
            Order::Quadratic => SECOND.map(|factor| factor * (self.edge_length / self.extent).powi(2)),
        };
        NodalErrors { field: finer[0] * field, losses: finer[1] * losses, is_filled }
    }

    /// What nodal elements of an order make of its impedance surface: there `A + ∇ψ` is not zero either, but is left with `h|∇A|` in
    /// first order.
    pub fn nodal_surface_errors(&self, order: Order) -> NodalErrors {
        let losses = match order {
            Order::Linear => {
                SURFACE * (self.edge_length / (self.skin_depth * self.relative_permeability)).powi(2)
            }
            // At most 0.2 % of all that was measured.
            Order::Quadratic => 0.0,
        };
        NodalErrors { field: 0.0, losses, is_filled: false }
    }

    /// The relative permeability of iron without eddy currents that would carry as much flux along this conductor, up to its
    /// own: `μr min(t, δ)/L`.
    pub fn carrying_permeability(&self) -> f64 {
        let carrying = self.skin_depth * self.thickness_in_skin_depths.min(1.0);
        self.relative_permeability * (carrying / self.extent).min(1.0)
    }
}
