//! Whether a mesh can be the mesh of a device: what its connectivity and its coordinates say together.
//!
//! A [`crate::Mesh`] has positive volumes, and two elements at a common face lie on its two sides. So the number of elements
//! that cover a point changes only across the outer faces, and all that is left to go wrong shows there: volumes that overlap
//! or touch without common nodes ([`contacts`]), holes and walls that nobody gave a condition ([`open_patches`]). The sum of the
//! volumes is then the flux of `x / 3` through the outer faces by the divergence theorem, overlap or not, and says nothing more.
//! [`separate_parts`] finds what hangs in the air, and [`leaning_layers`] looks at layers under a surface. The work is a sort of the outer faces and one look at every element.
//!
//! Does not live here: what a region or a condition is for, and whether a finding is refused.

mod contact;
mod hull;
mod layers;
mod parts;
mod patches;

pub use contact::{Contact, Meeting, contacts};
pub use hull::Hull;
pub use layers::{Leaning, leaning_layers};
pub use parts::{Part, separate_parts};
pub use patches::{OpenPatch, Situation, open_patches};

#[cfg(test)]
mod tests;
