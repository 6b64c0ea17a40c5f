//! The texts of a configuration: values with their places, overrides, and what is wrong where.

pub(super) mod cases;
mod confinement;
pub(super) mod diagnostic;
pub(super) mod source;
mod syntax;
pub(super) mod tree;

pub use confinement::OutputNamedBy;
