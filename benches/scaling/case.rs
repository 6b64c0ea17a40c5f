//! One case: a mesh, a method, a number of threads; what is measured of it.

use std::path::Path;
use std::time::Instant;

use cpu_time::ProcessTime;
use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::Config;
use fluxmorph::files::{fields, peak_memory_bytes};
use fluxmorph::show::Silent;
use fluxmorph_optimizer::driver::{self, Unrecorded};
use fluxmorph_optimizer::problem::{Derivatives, NoProgress, Problem, SEARCH_ADJOINT_TOLERANCE, SolverCache};
use fluxmorph_solver::adjoint;
use serde::{Deserialize, Serialize};

use crate::MESHES;

/// What to measure.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Case {
    pub(crate) mesh: String,
    pub(crate) threads: usize,
    pub(crate) settings: Vec<String>,
    pub(crate) kind: Kind,
}

/// Which measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Kind {
    /// The phases of one design step.
    Step,
    /// A whole optimisation without files.
    Optimisation,
}

/// CPU and wall time [s].
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Time {
    pub(crate) cpu: f64,
    pub(crate) wall: f64,
}

impl std::ops::Add for Time {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { cpu: self.cpu + other.cpu, wall: self.wall + other.wall }
    }
}

/// What was measured.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Record {
    pub(crate) mesh: String,
    pub(crate) threads: usize,
    pub(crate) method: String,
    pub(crate) tets: usize,
    pub(crate) unknowns: usize,
    pub(crate) set_up: Time,
    pub(crate) elastic: Time,
    pub(crate) assembly: Time,
    pub(crate) factor: Time,
    pub(crate) state: Time,
    pub(crate) adjoint: Time,
    pub(crate) gradient: Time,
    pub(crate) fields: Time,
    pub(crate) iterations: [usize; 2],
    pub(crate) preconditioner_bytes: usize,
    pub(crate) peak_bytes: u64,
    pub(crate) objective: f64,
    pub(crate) gradient_norm: f64,
    pub(crate) run: Time,
    pub(crate) evaluations: usize,
}

impl Record {
    /// Elastic solves, assembly, factor, state, adjoint and gradient.
    pub(crate) fn step(&self) -> Time {
        self.elastic + self.assembly + self.factor + self.state + self.adjoint + self.gradient
    }
}

impl Case {
    pub(crate) fn step(mesh: &str, threads: usize) -> Self {
        Self { mesh: mesh.to_owned(), threads, settings: Vec::new(), kind: Kind::Step }
    }

    pub(crate) fn optimisation(mesh: &str) -> Self {
        Self { kind: Kind::Optimisation, ..Self::step(mesh, 1) }
    }

    pub(crate) fn with_method(mut self, method: &str) -> Self {
        self.settings.push(format!("analysis.linear_solver.method=\"{method}\""));
        self
    }

    pub(crate) fn quadratic(mut self) -> Self {
        self.settings.push("analysis.order=2".to_owned());
        self
    }

    /// Does the work and measures it; to be called once in a process.
    pub(crate) fn measure(&self) -> Record {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield.toml");
        let mesh = MESHES.iter().find(|(name, _)| *name == self.mesh).expect("a mesh of the list");
        let settings: Vec<String> =
            mesh.1.iter().map(|s| (*s).to_owned()).chain(self.settings.iter().cloned()).collect();
        let (config, source) = Config::from_file(&path, &settings).unwrap_or_else(|e| panic!("{e}"));
        let (set_up, setup) =
            timed(|| set_up(&config, &source, Mode::Optimisation).unwrap_or_else(|e| panic!("{e}")));
        let mut problem = setup.problem;
        let mut record = Record {
            mesh: self.mesh.clone(),
            threads: self.threads,
            set_up,
            tets: problem.original().topology().tets().len(),
            unknowns: problem.states()[0].unknown_count(),
            ..Record::default()
        };
        match self.kind {
            Kind::Step => step(&problem, &mut record),
            Kind::Optimisation => {
                let optimizer = &config.optimizer;
                let (run, optimised) = timed(|| {
                    driver::optimise(
                        &mut problem,
                        &optimizer.settings(),
                        &mut Silent,
                        &mut Unrecorded,
                        &|| false,
                    )
                    .unwrap_or_else(|e| panic!("{e}"))
                });
                record.run = run;
                record.evaluations = optimised.evaluations;
                record.peak_bytes = peak_memory_bytes();
                record.objective = optimised.best.objective / optimised.initial;
            }
        }
        record
    }
}

/// The phases of a design step with nothing remembered of another.
fn step(problem: &Problem, record: &mut Record) {
    let (model, shape) = (&problem.states()[0], problem.shape().expect("the shield has a design"));
    let p: Vec<f64> = (0..shape.surface().variable_count()).map(|k| 2e-3 * (k as f64).sin()).collect();
    let (forward, moved) = timed(|| problem.moved(&p).expect("a small motion"));
    let mesh = moved.mesh.clone();
    let (assembly, (matrix, load)) = timed(|| (model.assemble(&mesh), model.load(&mesh)));
    record.assembly = assembly;
    let (factor, mut system) = timed(|| model.prepare(matrix).expect("it is regular"));
    record.factor = factor;
    let (time, state) = timed(|| model.solve_prepared(&mut system, &load).expect("it converges"));
    record.state = time;
    let functional = &problem.objective().expect("it has an objective").terms[0].functional;
    let (evaluation, value) = timed(|| functional.evaluate((model, &mesh, &state)).expect("it is finite"));
    let (time, lambda) = timed(|| {
        adjoint::solve_to(&mut system, &value.derivative, SEARCH_ADJOINT_TOLERANCE).expect("it converges")
    });
    record.adjoint = time;
    record.iterations = [state.report().iterations, lambda.report().iterations];
    record.method = model.method_name();
    record.preconditioner_bytes = system.preconditioner_bytes();
    let (nodes, nodal) = timed(|| {
        adjoint::node_gradient((model, &mesh, &state), &lambda, shape.motion().moving()).expect("it is here")
    });
    record.gradient = evaluation + nodes;
    let (backward, gradient) =
        timed(|| shape.surface().gradient(&shape.motion().map().gradient(&nodal).expect("it converges")));
    record.elastic = forward + backward;
    record.objective = value.value;
    record.gradient_norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
    drop((system, lambda, nodal));
    record.peak_bytes = peak_memory_bytes();
    if record.tets < 200_000 {
        let analysis = problem
            .analyse(moved, Derivatives::None, &mut SolverCache::default(), &mut NoProgress)
            .expect("it converges");
        record.fields =
            timed(|| fields::vtu(problem.states(), &fields::FieldData::of(&analysis)).expect("it is finite"))
                .0;
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> (Time, T) {
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    let result = work();
    (Time { cpu: cpu.elapsed().as_secs_f64(), wall: wall.elapsed().as_secs_f64() }, result)
}
