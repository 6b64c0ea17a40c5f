//! Tests of the crate from outside: the elastic map, boundaries, motion on rails, rounds and fallbacks, smoothing, steps to inversion.
#![allow(clippy::unwrap_used)]

mod boundaries;
mod guards;
mod hyperelastic;
mod inversion;
mod mapping;
mod rails;
mod rounds;
mod skin;
mod smoothing;
mod support;
mod torture;
mod trends;
