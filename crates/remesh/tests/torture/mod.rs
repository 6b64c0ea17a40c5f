//! Motions at which a mesh breaks, and what each law of motion makes of them in one step.
//!
//! `write_the_table` (`just torture-meshes`) puts the tables into docs/torture.md.

mod cases;
mod laws;
mod page;
mod shield;
