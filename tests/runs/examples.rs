//! Every program in `examples/` runs and its own assertions hold.

#[path = "../../examples/field_analysis.rs"]
mod field_analysis;
#[path = "../../examples/gradient_check.rs"]
mod gradient_check;
#[path = "../../examples/optimisation.rs"]
mod optimisation;

#[test]
fn the_field_analysis_runs() {
    field_analysis::main().unwrap();
}

#[test]
fn the_optimisation_runs() {
    optimisation::main().unwrap();
}

#[test]
fn the_gradient_check_runs() {
    gradient_check::main().unwrap();
}
