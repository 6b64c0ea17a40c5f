//! Tests of the crate from outside: the generators' meshes, the files, the sparse factors under injected failures.

mod guards;
mod msh;
mod msh_damaged;
mod msh_support;
mod properties;
mod refine;
mod regressions;
mod shield;
mod tet_counts;
mod vtu;
mod vtu_pieces;
