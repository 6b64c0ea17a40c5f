//! What a run directory holds, read for a page. What is missing is stated with its reason; what is damaged is an error.

use std::io::ErrorKind;
use std::path::PathBuf;

use fluxmorph_geometry::ElementId;
use fluxmorph_geometry::io::VtuArray;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::driver::Record;

use super::ReportedRun;
use super::field_file::{contents, field_contents};
use crate::build::{Outline, build_mesh, outline};
use crate::config::{Config, FieldsKept, MeshConfig, SourceMap};
use crate::error::Error;
use crate::files::{Accuracy, Manifest, MeshHash, OutputError, Refinements, RunDirectory, RunResult};
use crate::run::journal::{Journal, mesh_hash};
use crate::show::Evaluation;

/// Largest configuration that is read [bytes].
const LARGEST_TEXT: u64 = 1 << 28;

/// A run as its directory holds it.
#[derive(Debug)]
pub(super) struct RunData {
    /// Absolute.
    pub(super) directory: PathBuf,
    pub(super) manifest: Manifest,
    pub(super) config: Config,
    /// `resolved.toml`; `None` where it was not written yet.
    pub(super) resolved: Option<String>,
    pub(super) history: Vec<Evaluation>,
    /// `None` where the run has not come to an end.
    pub(super) result: Option<RunResult>,
    /// Evaluation of the best design; `None` before the first one.
    pub(super) best: Option<usize>,
    /// The variables before and after [m].
    pub(super) designs: [Option<Vec<f64>>; 2],
    /// Mesh and design surface, or why there are none.
    pub(super) outline: Result<Outline, String>,
    /// Fields before and after, or why there are none. A single analysis has only the second.
    pub(super) fields: [Result<Snapshot, String>; 2],
    /// What every element adds to the estimated error of the best design, on the mesh of its field; `None` where that is not
    /// there.
    pub(super) error: Option<Vec<f64>>,
    /// Files of the directory that a reader may want to open, relative to it.
    pub(super) files: Vec<String>,
}

/// What a field file holds, as far as a page shows it.
#[derive(Debug)]
pub(super) struct Snapshot {
    /// Its evaluation.
    pub(super) evaluation: usize,
    /// Moved nodes [m].
    pub(super) points: Vec<Point>,
    /// |B| of every element at the first frequency [T].
    pub(super) flux_density: Vec<f64>,
    /// What every element misses of the field quality that is asked for [T]; `None` where the file says nothing of it.
    pub(super) deviation: Option<Vec<f64>>,
}

impl RunData {
    /// How exact the objective is, where that is known.
    pub(super) fn accuracy(&self) -> Option<&Accuracy> {
        self.result.as_ref()?.accuracy.as_ref()
    }

    /// Reads the directory.
    ///
    /// # Errors
    /// [`OutputError::Damaged`], and files that cannot be read.
    pub(super) fn read(run: ReportedRun) -> Result<Self, Error> {
        let ReportedRun { directory, manifest, config, source } = run;
        let result = match RunResult::read(&directory) {
            Err(OutputError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => None,
            read => Some(read?),
        };
        let records = Journal::read_records(&directory)?;
        let history: Vec<Evaluation> = records.iter().map(|record| record.row.clone()).collect();
        let best = match &result {
            Some(RunResult { objective: Some(objective), .. }) => Some(objective.best_evaluation),
            Some(_) => Some(0),
            None => last_improved(&history),
        };
        let refinements = Refinements::read(&directory)?;
        // The best design is on the mesh of its level; the first evaluation there has the initial one on it.
        let level = best.and_then(|best| history.get(best)).map_or(0, |row| row.level);
        let first = history.iter().find(|row| row.level == level).map(|row| row.evaluation);
        let outline = outline_of_run(&manifest, (&config, &source), &refinements.marks(level));
        let kept = directory.evaluations_with_fields()?;
        let fields = [first.or(Some(0)).filter(|_| manifest.command == "run"), best].map(|evaluation| {
            let Some(evaluation) = evaluation else { return Ok(Err(NO_EVALUATION.to_owned())) };
            if !kept.contains(&evaluation) {
                return Ok(Err(not_kept(&config, evaluation)));
            }
            Snapshot::read(&directory, evaluation, &outline)
        });
        let [before, after] = fields;
        let (before, after) = (before?, after?);
        let error = match &after {
            Ok(after) => error_map(&directory, after.flux_density.len())?,
            Err(_) => None,
        };
        let mut files =
            ["fields.pvd", "error.vtu", "optimum.msh", "optimum_refined.msh"].map(str::to_owned).to_vec();
        files.extend(manifest.surfaces.iter().cloned());
        files.extend(
            ["history.csv", "result.json", "refinements.json", "resolved.toml", "config.toml"]
                .map(str::to_owned),
        );
        let there =
            directory.disk().names(directory.path()).map_err(OutputError::io("read", directory.path()))?;
        files.retain(|file| there.contains(file));
        files.extend(directory.fields_in_collection(&kept)?);
        let path = directory.resolved();
        let resolved = OutputError::unless_missing(&path, directory.disk().read(&path, LARGEST_TEXT))?;
        Ok(Self {
            // However the path is typed, the page is the same.
            directory: std::path::absolute(directory.path()).unwrap_or_else(|_| directory.path().to_owned()),
            resolved: resolved.map(String::from_utf8).transpose().map_err(OutputError::damaged(path))?,
            designs: designs(&records, &config, result.as_ref(), best, &outline),
            fields: [before, after],
            error,
            manifest,
            config,
            history,
            result,
            best,
            outline,
            files,
        })
    }

    /// Whether this is an optimisation, and no single analysis.
    pub(super) fn is_run(&self) -> bool {
        self.manifest.command == "run"
    }

    /// F of the best design over F of the first, if both are known.
    pub(super) fn ratio(&self) -> Option<f64> {
        let of_result = self.result.as_ref().and_then(|result| result.objective.as_ref()).map(|o| o.ratio);
        of_result.or_else(|| self.row(self.best?).map(|row| row.ratio))
    }

    /// The row of an evaluation.
    pub(super) fn row(&self, evaluation: usize) -> Option<&Evaluation> {
        self.history.iter().find(|row| row.evaluation == evaluation)
    }
}

/// Mesh and design surface of the run; why there are none where its mesh is gone, or has become another.
fn outline_of_run(
    manifest: &Manifest,
    (config, source): (&Config, &SourceMap),
    marks: &[Vec<ElementId>],
) -> Result<Outline, String> {
    let unbuilt = |error: Error| format!("the mesh cannot be rebuilt: {}", reason(&error));
    let mesh = build_mesh(config, source).map_err(unbuilt)?;
    if let Some(MeshHash { origin, blake3, .. }) = &manifest.mesh
        && *blake3 != mesh_hash(&mesh)
    {
        return Err(match &config.mesh {
            MeshConfig::File { .. } => {
                format!("the mesh of {origin} is another than that of the run: restore the file")
            }
            _ => format!(
                "the generator {origin} makes another mesh than that of the run, which version {} made",
                manifest.version
            ),
        });
    }
    outline((config, source), mesh, marks).map_err(unbuilt)
}

/// The estimated error of so many elements; `None` where there is none of this mesh.
fn error_map(directory: &RunDirectory, count: usize) -> Result<Option<Vec<f64>>, Error> {
    let path = directory.error_map();
    let there =
        directory.disk().names(directory.path()).map_err(OutputError::io("read", directory.path()))?;
    if !there.iter().any(|name| path.ends_with(name)) {
        return Ok(None);
    }
    let mut contents = contents(directory, &path)?;
    let error = match contents.cell_data.remove("error_estimate") {
        Some(VtuArray::Scalar(error)) => error,
        _ => return Err(OutputError::damaged(&path)("it has no array `error_estimate`").into()),
    };
    if !error.iter().all(|v| v.is_finite()) {
        return Err(OutputError::damaged(&path)("it holds a value that is not finite").into());
    }
    Ok(Some(error).filter(|error| error.len() == count))
}

/// Why there is no field.
const NO_EVALUATION: &str = "no evaluation was completed";

fn not_kept(config: &Config, evaluation: usize) -> String {
    match config.output.fields {
        FieldsKept::Nothing => "no field files were kept (output.fields = \"none\")".to_owned(),
        kept => format!(
            "the field of evaluation {evaluation} is not in the directory (output.fields = \"{}\")",
            kept.name()
        ),
    }
}

/// An error in one line.
fn reason(error: &Error) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

/// The last evaluation that was better than all before it.
fn last_improved(history: &[Evaluation]) -> Option<usize> {
    let mut best: Option<&Evaluation> = None;
    for row in history {
        if best.is_none_or(|best| row.iteration > best.iteration || row.level > best.level) {
            best = Some(row);
        }
    }
    best.map(|row| row.evaluation)
}

/// The variables before and after: of the configuration and the result, else of the journal.
fn designs(
    records: &[Record],
    config: &Config,
    result: Option<&RunResult>,
    best: Option<usize>,
    outline: &Result<Outline, String>,
) -> [Option<Vec<f64>>; 2] {
    let Some(design) = &config.design else { return [None, None] };
    let Some(outlined) = outline.as_ref().ok().and_then(|outline| outline.design.as_ref()) else {
        return [None, None];
    };
    let variables = outlined.surface.variable_count();
    let before = design.initial.values(variables, design.lower, design.upper);
    let of_result = result.and_then(|result| result.design.as_ref()).map(|design| design.values_m.clone());
    let of_journal = || Some(records.get(best?)?.design.clone());
    let after = of_result.or_else(of_journal);
    let fits = |values: &Vec<f64>| values.len() == variables && values.iter().all(|v| v.is_finite());
    // A single analysis begins at the undeformed surface.
    let before = if result.is_some_and(|result| result.command == "solve") {
        Some(vec![0.0; variables])
    } else {
        before
    };
    [before, after].map(|values| values.filter(fits))
}

impl Snapshot {
    /// Reads the field file of an evaluation.
    fn read(
        directory: &RunDirectory,
        evaluation: usize,
        outline: &Result<Outline, String>,
    ) -> Result<Result<Self, String>, Error> {
        let outline = match outline {
            Ok(outline) => outline,
            Err(cause) => return Ok(Err(cause.clone())),
        };
        let (path, mut contents) = field_contents(directory, evaluation)?;
        let topology = outline.mesh.topology();
        if contents.points.len() != topology.node_count() || contents.tets != topology.tets() {
            return Ok(Err(
                "the field file and the mesh of the configuration do not belong together".to_owned()
            ));
        }
        let missing = |name: &str| OutputError::damaged(&path)(format!("it has no array `{name}`"));
        let Some(VtuArray::Scalar(flux_density)) = contents.cell_data.remove("B_abs") else {
            return Err(missing("B_abs").into());
        };
        let deviation = match contents.cell_data.remove("deviation") {
            Some(VtuArray::Scalar(deviation)) => Some(deviation),
            Some(_) => {
                return Err(OutputError::damaged(&path)("its array `deviation` is not one of numbers").into());
            }
            None => None,
        };
        let points = contents.points;
        let numbers = points.iter().flatten().chain(&flux_density).chain(deviation.iter().flatten());
        let finite = numbers.copied().all(f64::is_finite);
        if !finite {
            return Err(OutputError::damaged(&path)("it holds a value that is not finite").into());
        }
        Ok(Ok(Self { evaluation, points, flux_density, deviation }))
    }
}
