//! A field problem distributed over ranks: what each does when rank 0 asks for a matrix, a solution or a gradient.
//!
//! A rank assembles the rows of its own nodes, solves with all others, and differentiates on its own elements. Loads,
//! functionals and recovery stay with rank 0, which has the whole solution: they are a small part of the work. `leader` is what rank 0 has of it, `follower` what
//! every rank does. Does not live here: how commands are sent ([`fluxmorph_geometry::parallel`]), and what solves ([`crate::linear::distributed`]).

mod follower;
mod leader;

pub(crate) use follower::Follower;
pub(crate) use leader::Distributed;
