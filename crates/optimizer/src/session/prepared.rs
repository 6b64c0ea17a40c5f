//! What `run`, `solve` and `resume` begin with: a problem that is set up, before anything is written.

use std::time::Instant;

use fluxmorph_geometry::ranks::Team;

use super::{Options, Session, mesh_hash};
use crate::config::{Config, Source};
use crate::error::Error;
use crate::memory_estimate::of_evaluation;
use crate::memory_limit;
use crate::observer::Observer;
use crate::output::{LimitsInForce, Manifest, RunDirectory, surface_files};
use crate::rounds::RoundEvent;
use crate::setup::blame::placed;
use crate::setup::{Purpose, Setup, set_up_watched};

/// A problem that is set up, and what its set-up was given.
pub(super) struct Prepared<'a> {
    pub(super) config: &'a Config,
    pub(super) source: &'a Source,
    pub(super) options: Options<'a>,
    pub(super) setup: Setup,
    clock: Instant,
}

impl<'a> Prepared<'a> {
    /// Sets a problem up that fits into the memory.
    ///
    /// # Errors
    /// Faults of the configuration, and [`Error::Interrupted`].
    pub(super) fn new(
        config: &'a Config,
        source: &'a Source,
        purpose: Purpose,
        options: Options<'a>,
        observer: &mut dyn Observer,
    ) -> Result<Self, Error> {
        let clock = Instant::now();
        observer.phase("setting up mesh and matrices");
        let stages = &mut |stage| observer.stage(stage);
        let setup = set_up_watched(config, source, purpose, options.team, stages)?;
        memory_limit::check_problem(of_evaluation(&setup.problem), source, options.older_run)?;
        Error::unless(options.interrupted)?;
        Ok(Self { config, source, options, setup, clock })
    }

    /// Takes the mesh near the initial design.
    ///
    /// # Errors
    /// A design that the mesh cannot reach is a fault of the configuration; [`Error::Interrupted`].
    pub(super) fn approach_initial(&mut self) -> Result<Vec<RoundEvent>, Error> {
        let problem = &mut self.setup.problem;
        let initial = problem.shape.as_ref().map(|shape| shape.initial.clone()).unwrap_or_default();
        problem.approach(&initial, self.options.interrupted).map_err(|error| match error {
            Error::DesignUnreached { .. } => placed(error, self.config, self.source),
            other => other,
        })
    }

    /// Takes the output directory, and writes the manifest.
    ///
    /// # Errors
    /// When the directory is not ours, or the operating system refuses.
    pub(super) fn begin(
        self,
        command: &'static str,
        observer: &mut dyn Observer,
    ) -> Result<Session<'a>, Error> {
        let Self { config, source, options, .. } = self;
        let directory = RunDirectory::create(options.disk, &config.output.directory, options.older_run)?;
        let mut manifest = Manifest::started(command, options.threads).reading(source);
        manifest.mesh = Some(mesh_hash(config, &self.setup.full_mesh));
        manifest.ranks = options.team.map(Team::size);
        manifest.surfaces = surface_files(&config.output.stl);
        manifest.limits = (command == "run").then(|| LimitsInForce::of(&config.optimizer));
        manifest.write(&directory)?;
        let session = self.session(command, directory, manifest);
        session.announce(observer);
        Ok(session)
    }

    /// A session in a directory with a manifest; the set-up ends here.
    pub(super) fn session(
        self,
        command: &'static str,
        directory: RunDirectory,
        manifest: Manifest,
    ) -> Session<'a> {
        let Self { config, source, options, setup, clock } = self;
        let (setup_seconds, interrupted) = (clock.elapsed().as_secs_f64(), options.interrupted);
        Session { command, config, source, setup, directory, manifest, clock, setup_seconds, interrupted }
    }
}
