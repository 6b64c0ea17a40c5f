//! The texts of a configuration: values with their places, overrides, and what is wrong where.

pub(super) mod cases;
pub(super) mod diagnostic;
pub(super) mod dimension;
pub(super) mod document;
pub(super) mod message;
pub(super) mod nearest;
pub(super) mod quantity;
pub(super) mod source;
mod syntax;
pub(super) mod tree;
mod written_paths;
