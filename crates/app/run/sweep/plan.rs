//! A sweep as it is meant: every combination with its configuration read, before anything runs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use fluxmorph_geometry::io::open_regular;

use super::state::{fingerprint, mesh_file};
use super::{Combination, Criterion, Setting, SweepError, combinations};
use crate::build::{memory_limit, with_names};
use crate::config::{
    Config, ConfigError, Diagnostic, DiagnosticReport, Objective, OutputNamedBy, SourceMap, resolved_toml,
};
use crate::error::Error;
use crate::files::{FileHash, LimitsInForce, OverwritePolicy, blake3_hex, check_text};
use crate::run::RunLimits;

/// Combinations whose faults are shown; the rest are counted.
const MOST_REPORTS: usize = 5;

/// Whether the files that a configuration names may lie outside of its folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// They may.
    Allowed,
    /// They are faults.
    Refused,
}

/// What was asked for.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The configuration.
    pub config: &'a Path,
    /// `key=v1,v2` as typed.
    pub set: &'a [String],
    /// The directory, in place of the one that the configuration implies.
    pub out: Option<&'a Path>,
    /// Limits in place of those of the configuration.
    pub limits: RunLimits,
    /// Files elsewhere.
    pub outside: Outside,
    /// What becomes of runs that are no combination; [`OverwritePolicy::Replace`] also overrides the memory check.
    pub overwrite: OverwritePolicy,
}

/// A sweep whose configurations are sound.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The configuration: its path as typed, and the hash of its text.
    pub config: FileHash,
    /// Title of the configuration.
    pub title: String,
    /// Where everything is written.
    pub directory: PathBuf,
    /// The keys and their values.
    pub settings: Vec<Setting>,
    /// Limits of the command line.
    pub limits: RunLimits,
    /// Files elsewhere.
    pub outside: Outside,
    /// What becomes of runs that are no combination.
    pub overwrite: OverwritePolicy,
    /// The combinations; the first key changes slowest.
    pub combinations: Vec<Planned>,
}

/// A combination whose configuration is sound.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Name and values.
    pub combination: Combination,
    /// Identifies its configuration, except for the path of its mesh file.
    pub fingerprint: [u8; 32],
    /// The mesh file, where the mesh is read.
    pub mesh: Option<PathBuf>,
    /// When it ends at the latest.
    pub limits: LimitsInForce,
    /// What is optimised.
    pub objective: Option<Objective>,
    /// What its result is compared by with those of the others; `None` where nothing is traded.
    pub criteria: Option<[Criterion; 2]>,
}

impl Sweep {
    /// Reads the configuration of every combination.
    ///
    /// # Errors
    /// [`SweepError`] where the values are no sweep, and [`SweepError::Faults`] with what is wrong in any combination; a
    /// configuration that cannot be read at all.
    pub fn plan(request: &Request<'_>) -> Result<Self, Error> {
        // The commands of the runs are text, and so is the folder of their configuration in their manifests.
        check_text(&std::path::absolute(request.config).unwrap_or_else(|_| request.config.to_owned()))?;
        let settings =
            request.set.iter().map(|typed| Setting::parse(typed)).collect::<Result<Vec<_>, _>>()?;
        let mut planned = Vec::new();
        let mut faulty = FaultyCombinations::default();
        let mut known: BTreeMap<String, usize> = BTreeMap::new();
        let mut first = None;
        for combination in combinations(&settings)? {
            let (config, source) = match read(request, &combination.overrides) {
                Ok(read) => read,
                Err(ConfigError::Invalid(report)) => {
                    faulty.push(&combination.name, report);
                    continue;
                }
                Err(other) => return Err(other.into()),
            };
            let same = known.insert(blake3_hex(resolved_toml(&config).as_bytes()), planned.len());
            if let Some(index) = same {
                let Planned { combination: Combination { name, .. }, .. } = &planned[index];
                return Err(SweepError::Same { first: name.clone(), second: combination.name }.into());
            }
            let configured = LimitsInForce::of(&config.optimizer);
            planned.push(Planned {
                combination,
                fingerprint: fingerprint(&config, source.directory()),
                mesh: mesh_file(&config).map(Path::to_owned),
                limits: LimitsInForce {
                    max_evaluations: request.limits.max_evaluations.unwrap_or(configured.max_evaluations),
                    max_time_s: request.limits.max_time.or(configured.max_time_s),
                },
                objective: config.objective.clone(),
                criteria: Criterion::pair(&config, &settings),
            });
            first.get_or_insert((config, source));
        }
        faulty.check(planned.len())?;
        let (config, source) = first.expect("a product has at least one combination");
        let directory = request.out.map_or_else(|| beside(&config.output.directory), Path::to_owned);
        check_text(&directory)?;
        Ok(Self {
            config: FileHash {
                path: request.config.display().to_string(),
                blake3: blake3_hex(source.text().as_bytes()),
            },
            title: config.title,
            directory,
            settings,
            limits: request.limits,
            outside: request.outside,
            overwrite: request.overwrite,
            combinations: planned,
        })
    }

    /// The keys with several values.
    pub fn swept(&self) -> impl Iterator<Item = &Setting> {
        self.settings.iter().filter(|setting| setting.is_swept())
    }

    /// The keys that are the same for all.
    pub fn fixed(&self) -> impl Iterator<Item = &Setting> {
        self.settings.iter().filter(|setting| !setting.is_swept())
    }

    /// The run directory of a combination.
    pub fn run_directory(&self, planned: &Planned) -> PathBuf {
        self.directory.join(&planned.combination.name)
    }
}

/// `runs/shield_sweep` for `runs/shield`.
fn beside(directory: &Path) -> PathBuf {
    let mut name = directory.file_name().unwrap_or_default().to_owned();
    name.push("_sweep");
    directory.with_file_name(name)
}

/// The configuration of one combination, as `run` would read it.
fn read(request: &Request<'_>, overrides: &[String]) -> Result<(Config, SourceMap), ConfigError> {
    let (config, source) = Config::from_file(request.config, overrides)?;
    if request.outside == Outside::Refused {
        let by = if request.out.is_some() { OutputNamedBy::User } else { OutputNamedBy::Configuration };
        source.confined(by)?;
    }
    config.optimisation(&source)?;
    if request.overwrite == OverwritePolicy::Keep {
        memory_limit::check_mesh(&config, &source)?;
    }
    if let Some(fault) = missing_mesh(&config, &source) {
        return Err(source.error(vec![fault]));
    }
    Ok((config, source))
}

/// A mesh file that cannot be opened.
fn missing_mesh(config: &Config, source: &SourceMap) -> Option<Diagnostic> {
    let path = mesh_file(config)?;
    let error = open_regular(path).err()?;
    let fault = source.diagnostic("mesh.file", format!("cannot open the mesh `{}`: {error}", path.display()));
    Some(fault.expected("the path of a Gmsh mesh"))
}

/// Combinations that cannot be read.
#[derive(Default)]
struct FaultyCombinations {
    count: usize,
    /// Key and message of every fault so far.
    known: BTreeSet<(String, String)>,
    /// Combinations with faults that none before has.
    reports: Vec<(String, Box<DiagnosticReport>)>,
}

impl FaultyCombinations {
    fn push(&mut self, name: &str, report: Box<DiagnosticReport>) {
        self.count += 1;
        let before = self.known.len();
        self.known.extend(report.diagnostics.iter().map(|fault| (fault.path.clone(), fault.message.clone())));
        if self.known.len() > before && self.reports.len() < MOST_REPORTS {
            self.reports.push((name.to_owned(), report));
        }
    }

    fn check(self, sound: usize) -> Result<(), SweepError> {
        if self.count == 0 {
            return Ok(());
        }
        // Looking up names takes the mesh: only for what is shown.
        let with_mesh_names = |(name, report)| (name, with_names(ConfigError::Invalid(report)));
        let reports = self.reports.into_iter().map(with_mesh_names).collect();
        Err(SweepError::Faults { faulty: self.count, of: self.count + sound, reports })
    }
}
