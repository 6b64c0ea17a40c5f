//! Prisms: a family of devices whose field is known exactly, whatever their shape, iron, conductors and walls.
//!
//! `exact` has the field and why it is exact, `derivative` how it changes when a wall moves, on `polygon`, `source` and
//! `diffusion`. `cases` are prisms with sides along the axes, meshed in `boxed`; `unstructured` reads those of
//! `fixtures/`, which Gmsh meshed. `problem` makes a problem of the program from any of them and measures its errors;
//! `gradient` compares its derivatives with the exact ones. `discretisation` is the list of elements, with what each must
//! get right; `known` asserts that; `locking` compares what nodal elements lose in meshed conductors with what the audit
//! expects. `convergence` fits orders; `iron_circuit` is a device
//! without closed form. All numbers, in some minutes:
//!
//! `cargo test --release --test physics -- --ignored --nocapture prisms::table`

mod boxed;
mod cases;
mod convergence;
mod derivative;
mod diffusion;
mod discretisation;
mod estimate;
mod exact;
mod gradient;
mod hand;
mod iron_circuit;
mod known;
mod locking;
mod polygon;
mod problem;
mod saturation;
mod source;
mod table;
mod unstructured;

/// Region of air.
const AIR: &str = "air";
