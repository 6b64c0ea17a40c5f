//! What `run`, `solve` and `resume` begin with: a problem that is set up before anything is written.

use std::time::Instant;

use fluxmorph_geometry::parallel::RankGroup;
use fluxmorph_optimizer::Error as OptimizerError;

use super::facets::FirstFacets;
use super::{Options, Session, mesh_hash, table_hashes};
use crate::build::{Mode, Setup, Truncation, check_on_ranks, memory_limit, set_up_watched};
use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::files::{LimitsInForce, Manifest, MeshHash, RunDirectory, surface_files};
use crate::show::RunObserver;

/// A problem that is set up, and what its set-up was given.
pub(super) struct Prepared<'a> {
    pub(super) setup: Setup,
    config: &'a Config,
    source: &'a SourceMap,
    pub(super) facets: FirstFacets,
    near_wall: Option<String>,
    options: Options<'a>,
    clock: Instant,
}

impl<'a> Prepared<'a> {
    /// Sets a problem up that fits into the memory.
    pub(super) fn new(
        config: &'a Config,
        source: &'a SourceMap,
        mode: Mode,
        options: Options<'a>,
        observer: &mut dyn RunObserver,
    ) -> Result<Self, Error> {
        let clock = Instant::now();
        observer.phase("setting up mesh and matrices");
        let stages = &mut |stage| observer.stage(stage);
        let setup = set_up_watched(config, source, mode, options.ranks, stages)?;
        memory_limit::check_problem(&setup.problem, source, options.overwrite_policy)?;
        OptimizerError::check_interrupted(options.interrupted)?;
        check_on_ranks(&setup, source)?;
        let facets = FirstFacets::of(config, &setup.full_mesh);
        let near_wall = Truncation::of(config, &setup).and_then(|truncation| truncation.described());
        Ok(Self { setup, config, source, facets, near_wall, options, clock })
    }

    /// Origin and hash of its mesh.
    pub(super) fn mesh_hash(&self) -> MeshHash {
        mesh_hash(self.config, &self.setup.full_mesh)
    }

    /// Takes the output directory, and writes the manifest with the hash of the `mesh` of the configuration.
    pub(super) fn begin(
        self,
        command: &'static str,
        mesh: MeshHash,
        observer: &mut dyn RunObserver,
    ) -> Result<Session<'a>, Error> {
        let Self { config, source, options, .. } = self;
        let mut manifest = Manifest::new(command, options.threads).reading(source)?;
        let directory =
            RunDirectory::create(options.disk, &config.output.directory, options.overwrite_policy)?;
        manifest.mesh = Some(mesh);
        manifest.tables = table_hashes(&self.setup.tables);
        manifest.ranks = options.ranks.map(RankGroup::size);
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
        let Self { setup, config, source, facets, near_wall, options, clock } = self;
        let setup_seconds = clock.elapsed().as_secs_f64();
        Session {
            command,
            config,
            source,
            warnings: setup.warnings.clone(),
            setup,
            facets,
            near_wall,
            directory,
            manifest,
            clock,
            replayed_seconds: 0.0,
            setup_seconds,
            interrupted: options.interrupted,
            searched: options.searched,
        }
    }
}
