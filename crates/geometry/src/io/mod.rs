//! Files: meshes from Gmsh and back, fields for ParaView, surfaces for printing.
//!
//! Writers make bytes and never touch the disk: whether a file replaces another whole is not decided here.

pub mod msh;
pub mod pvd;
mod regular;
pub mod stl;
pub mod vtu;

pub use msh::{MshEncoding, MshError, MshMesh, MshNotices, msh_bytes, read_msh, read_msh_file};
pub use pvd::pvd_text;
pub use regular::{open_regular, read_at_most};
pub use stl::stl_bytes;
pub use vtu::{
    ArrayData, Field, VtuArray, VtuContents, VtuPiece, join_pieces, pvtu_pieces, pvtu_text, read_vtu,
    vtu_bytes, vtu_bytes_at, vtu_contents,
};
