//! What is not finite is refused by name, before an optimiser sees it.

use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache, finite};

use crate::problems::{initial, quick};

fn named(error: Result<(), Error>) -> String {
    let error = error.expect_err("it is not finite");
    assert!(error.is_numerical());
    error.to_string()
}

fn evaluated(problem: &Problem) -> Analysis {
    let p = initial(problem);
    problem
        .evaluate(&p, Derivatives::First, &mut SolverCache::default(), &mut NoProgress)
        .expect("a sound case")
}

#[test]
fn an_evaluation_with_a_number_that_is_none_is_refused_by_name() {
    let mut damaged = evaluated(&quick(&[]).0);
    assert!(finite::analysis(&damaged, &[]).is_ok());
    damaged.objective = Some(f64::INFINITY);
    assert!(named(finite::analysis(&damaged, &[])).starts_with("the objective is inf"));
    damaged.objective = Some(1.0);
    let gradient = damaged.gradient.as_mut().expect("it was asked for");
    gradient[5] = f64::NAN;
    assert!(
        named(finite::analysis(&damaged, &[])).contains("objective with respect to design variable 5 is NaN")
    );
    // Finite, but not its square: the norm in the history would be infinite.
    damaged.gradient.as_mut().expect("it was asked for")[5] = 1e200;
    assert!(named(finite::analysis(&damaged, &[])).contains("squared gradient norm of the objective is inf"));
    damaged.gradient = None;
    damaged.quality.worst = f64::NAN;
    assert!(named(finite::analysis(&damaged, &[])).contains("quality of element"));
    let mut nodal = vec![[0.0; 3]; 9];
    nodal[7][2] = f64::NEG_INFINITY;
    assert!(
        named(finite::sensitivity("the objective", &nodal))
            .contains("with respect to the position of node 7 is -inf")
    );
}

/// The share of an evaluation that the checks take; docs/robustness.md has the number.
#[test]
#[ignore = "a measurement: the clock is the process', and other tests run in it"]
fn the_checks_take_less_than_a_hundredth_of_an_evaluation() {
    let problem = quick(&[]).0;
    let analysed = evaluated(&problem);
    let cpu = || cpu_time::ProcessTime::now();
    let start = cpu();
    evaluated(&problem);
    let evaluation = start.elapsed().as_secs_f64();
    let start = cpu();
    const REPEATS: u32 = 20;
    for _ in 0..REPEATS {
        finite::state((&problem.states()[0], &analysed.mesh, &analysed.solutions[0])).expect("sound");
        finite::analysis(&analysed, problem.constraints()).expect("sound");
    }
    let checks = start.elapsed().as_secs_f64() / f64::from(REPEATS);
    println!(
        "checks {:.2} ms of {:.1} ms: {:.2} %",
        1e3 * checks,
        1e3 * evaluation,
        100.0 * checks / evaluation
    );
    assert!(checks < 0.01 * evaluation, "{checks} s of {evaluation} s");
}
