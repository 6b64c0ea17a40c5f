//! The JSON schema of the configuration, for editors and other programs, and the page made from it.
//!
//! What a key is, its range and its words stand in the declarations of the tables: this module turns them into one
//! document. Nothing here knows a key.

mod document;
pub(super) mod keys;
mod page;
mod prose;

pub use document::{document, text};
pub use page::page;
