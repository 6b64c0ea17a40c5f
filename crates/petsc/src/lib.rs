//! The foreign libraries: METIS for orderings and partitions, MPI and PETSc for several ranks.
//!
//! This is the one crate that calls C, and the only one with `unsafe`. Its functions take plain numbers, check their lengths
//! and are safe; what a graph, a rank or a matrix means is the callers' business. `metis` needs nothing but a C compiler, and
//! without its feature has no answers. [`petsc`], behind the feature `link`, needs the two libraries on the machine.

pub mod metis;
#[cfg(feature = "link")]
pub mod petsc;
