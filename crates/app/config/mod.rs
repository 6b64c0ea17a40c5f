//! The configuration: a TOML text becomes a typed [`Config`] in SI, or a report of all that is wrong with it.
//!
//! Every key is declared once, in the file of its table in `tables/`; `table/declare.rs` says how. The text is parsed into a
//! tree that knows the place of every value (`text`), overrides are laid over it, and the declarations walk it through
//! `section`, which gathers what is wrong. The same declarations describe the keys for `schema`. Names of regions and surfaces
//! are known once the mesh is: [`SourceMap`] keeps the places for those checks.
//!
//! From the ground up, each using only what is before it: `text`, `value`, `section`, `table`, `tables`, `error`, and on top of
//! these `schema`, `load` and the rest.

mod confinement;
pub mod diagnostics;
mod error;
mod load;
mod required;
pub mod schema;
mod section;
mod table;
mod tables;
mod text;
mod value;

pub use confinement::{OutputNamedBy, without_upward_steps};
pub use error::{ConfigError, DiagnosticReport, Subject};
pub use load::resolved_toml;
pub use required::{Morphing, Optimisation};
pub use tables::*;
pub use text::diagnostic::{Diagnostic, Span};
pub use text::dimension::Dimension;
pub use text::document::Document;
pub use text::nearest::{nearest, nearest_two};
pub use text::quantity::{QuantityError, parse_quantity};
pub use text::source::SourceMap;
pub(crate) use value::LONGEST_LENGTH;
