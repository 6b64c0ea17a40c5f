//! The configuration: a TOML text becomes a typed [`Config`] in SI, or a report of all that is wrong with it.
//!
//! Every key is declared once, in the file of its table in `tables/`; `table` says how. The text is parsed into a tree that
//! knows the place of every value (`text`), overrides are laid over it, and the declarations walk it through `section`, which
//! gathers what is wrong. The same declarations describe the keys for `schema`. Names of regions and surfaces are known
//! once the mesh is: [`SourceMap`] keeps the places for those checks.

pub mod diagnostics;
mod load;
pub mod schema;
mod section;
mod table;
mod tables;
mod text;
mod value;

pub use load::resolved_toml;
pub use tables::*;
pub use text::OutputNamedBy;
pub use text::diagnostic::{Diagnostic, Span};
pub use text::source::{ConfigError, DiagnosticReport, Document, SourceMap, Subject};
pub use value::nearest::{nearest, nearest_two};
pub use value::quantity::{Dimension, QuantityError, parse_quantity};
