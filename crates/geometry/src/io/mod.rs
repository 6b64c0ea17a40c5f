//! Files: fields for ParaView.
//!
//! Writers make bytes and never touch the disk: whether a file replaces another whole is not decided here.

pub mod pvd;
pub mod vtu;

pub use pvd::pvd_text;
pub use vtu::{ArrayData, Field, VtuArray, VtuContents, read_vtu, vtu_bytes, vtu_contents, write_vtu};
