//! Tests of the crate from outside: the elastic map, boundaries, the laws of motion, steps to inversion.
#![allow(clippy::unwrap_used)]

mod boundaries;
mod guards;
mod hyperelastic;
mod inversion;
mod mapping;
mod rails;
mod skin;
mod support;
mod torture;
mod trends;
