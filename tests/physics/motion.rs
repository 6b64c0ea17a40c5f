//! The mesh as one function of the design, in evaluations and in runs.

use std::cell::Cell;

use cpu_time::ProcessTime;
use fluxmorph::build::{Mode, set_up};
use fluxmorph::files::StopReason;
use fluxmorph::show::Observer;
use fluxmorph_optimizer::driver::optimise;
use fluxmorph_optimizer::problem::{Derivatives, NoProgress, Problem, SolverCache, Stage};

use crate::problems::{Rows, objective, quick, variables};
use crate::support::config;

const LAWS: [&str; 2] = ["remesh.law=\"rails\"", "remesh.law=\"hyperelastic\""];

/// Up to 20 mm thicker and 4 mm thinner, node by node.
fn rough(problem: &Problem, seed: usize) -> Vec<f64> {
    let sine = |k: usize| (1.7 * k as f64 + 0.9 * (seed * (k % 7)) as f64).sin();
    (0..variables(problem)).map(|k| 8e-3 + 12e-3 * sine(k)).collect()
}

/// One problem that has seen nothing else, and one that comes from twenty other designs, with what linear solvers keep of them.
#[test]
fn a_design_has_the_same_mesh_and_objective_whatever_came_before() {
    for law in LAWS {
        let (cold, warm) = (quick(&[law]).0, quick(&[law]).0);
        let design = rough(&cold, 0);
        let mut cache = SolverCache::default();
        for seed in 1..=20 {
            let other = warm.evaluate(&rough(&warm, seed), Derivatives::None, &mut cache, &mut NoProgress);
            assert!(other.is_ok_and(|other| other.quality.worst > 0.0), "{law}: {seed}");
        }
        let again = warm.evaluate(&design, Derivatives::None, &mut cache, &mut NoProgress);
        let again = again.unwrap_or_else(|e| panic!("{e}"));
        let mesh = cold.moved(&design).unwrap_or_else(|e| panic!("{e}")).mesh;
        assert_eq!(again.mesh.points(), mesh.points(), "{law}: to the bit");
        let (again, expected) = (again.objective.expect("an objective"), objective(&cold, &design));
        assert!((again / expected - 1.0).abs() < 1e-10, "{law}: {again} and {expected}");
    }
}

/// Raises a signal as the mesh of an evaluation begins to move.
struct SignalInMotion<'a> {
    moved: usize,
    at: usize,
    is_raised: &'a Cell<bool>,
}

impl Observer for SignalInMotion<'_> {
    fn stage(&mut self, stage: Stage) {
        self.moved += usize::from(stage == Stage::Moving);
        self.is_raised.set(self.moved >= self.at);
    }
}

#[test]
fn a_signal_while_the_mesh_moves_does_not_cost_the_evaluation_in_hand() {
    for law in LAWS.into_iter().chain(["remesh.law=\"linear\""]) {
        let (mut problem, settings) = quick(&[law]);
        let is_raised = Cell::new(false);
        let mut observer = SignalInMotion { moved: 0, at: 3, is_raised: &is_raised };
        let mut rows = Rows::default();
        let interrupted = || is_raised.get();
        let optimised = optimise(&mut problem, &settings.settings(), &mut observer, &mut rows, &interrupted);
        let optimised = optimised.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(optimised.stop_reason, StopReason::Interrupted, "{law}");
        assert_eq!(
            (observer.moved, rows.rows.len()),
            (3, 3),
            "{law}: the third is finished, and no fourth begun"
        );
    }
}

/// CPU seconds of a mesh, with the derivatives of one functional taken back through it, against those of the whole evaluation on
/// linear elements but for its mesh. For docs/performance.md.
#[test]
#[ignore = "measures time"]
fn what_the_laws_cost() {
    println!("| tets | evaluation | rails | steps | share | hyperelastic | steps | share |");
    for (name, refinement) in
        [("shield_quick.toml", "0.55"), ("shield_quick.toml", "1"), ("shield.toml", "1.25")]
    {
        let mesh = format!("mesh.shield.refinement={refinement}");
        let mut line = String::new();
        for law in LAWS {
            let (config, source) = config(name, &[&mesh, law, "remesh.stiffness=\"inverse_volume\""]);
            let problem =
                set_up(&config, &source, Mode::Optimisation).unwrap_or_else(|e| panic!("{e}")).problem;
            let p: Vec<f64> =
                (0..variables(&problem)).map(|k| 8e-3 + 8e-3 * (0.3 * k as f64).sin()).collect();
            let clock = ProcessTime::now();
            let moved = problem.moved(&p).unwrap_or_else(|e| panic!("{e}"));
            let steps = moved.newton_steps;
            let nodal = vec![[1.0; 3]; moved.mesh.points().len()];
            moved.pull_back(&nodal).unwrap_or_else(|e| panic!("{e}"));
            let motion = clock.elapsed().as_secs_f64();
            let clock = ProcessTime::now();
            let cache = &mut SolverCache::default();
            problem
                .analyse(moved, Derivatives::First, cache, &mut NoProgress)
                .unwrap_or_else(|e| panic!("{e}"));
            let field = clock.elapsed().as_secs_f64();
            if line.is_empty() {
                line = format!("| {} | {field:.2} |", problem.original().topology().tets().len());
            }
            line += &format!(" {motion:.3} | {steps} | {:.0} % |", 100.0 * motion / field);
        }
        println!("{line}");
    }
}
