//! What the runs of a sweep have found, side by side: `sweep.csv`, and the numbers of the page.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::state::Input;
use super::{Criterion, Layout, Planned, Sweep, front, page, state};
use crate::config::Goal;
use crate::error::Error;
use crate::files::{
    Manifest, OutputError, RunDirectory, RunResult, RunStatus, StopReason, Verdict, csv_text,
};
use crate::run::journal::Journal;

/// The results of all combinations, in their order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The directory of the sweep.
    pub directory: String,
    /// The swept keys.
    pub keys: Vec<String>,
    /// The row of the best objective; `None` where nothing can be compared.
    pub best: Option<usize>,
    /// The two quantities that the runs trade for each other; empty where they trade none.
    pub criteria: Vec<Criterion>,
    /// The rows that keep their constraints and that no other one beats in both criteria, from the best one in the first on.
    pub front: Vec<usize>,
    /// The rows.
    pub combinations: Vec<Row>,
    /// Which way the objective is better that all runs have; `None` where theirs differ.
    #[serde(skip)]
    pub(super) goal: Option<Goal>,
}

/// One combination.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// Values of the swept keys.
    pub values: Vec<String>,
    /// How far its run is, also of one that failed before it had a directory; `None` where it has not begun.
    pub status: Option<RunStatus>,
    /// Why it ended.
    pub stop_reason: Option<StopReason>,
    /// Evaluations so far.
    pub evaluations: Option<usize>,
    /// The objective at the initial design.
    pub objective_initial: Option<f64>,
    /// The objective at the best design.
    pub objective_best: Option<f64>,
    /// Best over initial objective.
    pub ratio: Option<f64>,
    /// The same on a freshly generated mesh.
    pub verified_ratio: Option<f64>,
    /// Whether the gain is the shape's; `None` where it was not checked.
    pub verdict: Option<Verdict>,
    /// Names of the constraints that the best design violates.
    pub violated: Vec<String>,
    /// The criteria at the best design, in SI; empty where there are none, or no result.
    pub criteria: Vec<f64>,
    /// Worst quality (Eq. 4) of the mesh of the best design.
    pub worst_quality: Option<f64>,
    /// Wall time [s].
    pub seconds: Option<f64>,
    /// Most memory held [bytes].
    pub peak_memory_bytes: Option<u64>,
    /// The run directory, relative to that of the sweep.
    pub directory: String,
    /// Evaluation and ratio, as they came.
    #[serde(skip)]
    pub(super) curve: Vec<[f64; 2]>,
    /// Mesh and tables that it has read from files.
    #[serde(skip)]
    pub(super) inputs: Vec<Input>,
    /// Why it is no run of this sweep, and what it has found is not here; `None` where it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) difference: Option<String>,
    /// What there is to read about the run, relative to the sweep, and what it is called.
    #[serde(skip)]
    pub(super) file: Option<(String, &'static str)>,
}

impl Comparison {
    /// Reads what the run directories hold.
    ///
    /// # Errors
    /// When a file that is there cannot be read.
    pub fn read(sweep: &Sweep, layout: &Layout) -> Result<Self, Error> {
        let rows = sweep.combinations.iter().map(|planned| Row::read(sweep, layout, planned));
        let mut comparison = Self {
            directory: layout.path().display().to_string(),
            keys: sweep.swept().map(|setting| setting.key.clone()).collect(),
            best: None,
            criteria: criteria(&sweep.combinations),
            front: Vec::new(),
            combinations: rows.collect::<Result<_, _>>()?,
            goal: common_goal(&sweep.combinations),
        };
        comparison.compare();
        Ok(comparison)
    }

    /// Reads one combination again.
    pub fn update(&mut self, sweep: &Sweep, layout: &Layout, index: usize) -> Result<(), Error> {
        self.combinations[index] = Row::read(sweep, layout, &sweep.combinations[index])?;
        self.compare();
        Ok(())
    }

    /// The runs that are not compared, and why.
    pub fn differences(&self) -> impl Iterator<Item = (&Row, &str)> {
        self.combinations.iter().filter_map(|row| Some((row, row.difference.as_deref()?)))
    }

    /// Takes what they have found from runs of another configuration, and from those that have read another content of a file than
    /// the first run that read it, of those that have ended if there are any: the file was changed meanwhile.
    fn leave_out_others(&mut self) {
        let mut order: Vec<usize> = (0..self.combinations.len()).collect();
        order.sort_by_key(|row| !self.combinations[*row].has_ended());
        let mut known: BTreeMap<(String, String), (String, String)> = BTreeMap::new();
        for index in order {
            let row = &mut self.combinations[index];
            for Input { key, blake3 } in &row.inputs {
                let (first, directory) =
                    known.entry(key.clone()).or_insert_with(|| (blake3.clone(), row.directory.clone()));
                if first != blake3 && row.difference.is_none() {
                    let (file, _) = key;
                    row.difference =
                        Some(format!("`{file}` was another file when it began than for `{directory}`"));
                }
            }
            if row.difference.is_some() {
                *row = row.without_what_it_found();
            }
        }
    }

    /// Finds what only all rows together say.
    fn compare(&mut self) {
        self.leave_out_others();
        self.best = self.find_best();
        let points: Vec<(usize, [f64; 2])> =
            self.points().filter(|(row, _)| self.combinations[*row].violated.is_empty()).collect();
        let sign = |k: usize| if self.criteria[k].smaller_is_better { 1.0 } else { -1.0 };
        self.front =
            if points.is_empty() { Vec::new() } else { front::non_dominated(&points, [sign(0), sign(1)]) };
    }

    /// The rows that have both criteria, with these.
    pub(super) fn points(&self) -> impl Iterator<Item = (usize, [f64; 2])> + '_ {
        let of =
            |(index, row): (usize, &Row)| Some((index, <[f64; 2]>::try_from(row.criteria.as_slice()).ok()?));
        self.combinations.iter().enumerate().filter_map(of).filter(|_| self.criteria.len() == 2)
    }

    /// Writes `sweep.csv` and `sweep.html`.
    pub fn write(&self, sweep: &Sweep, layout: &Layout) -> Result<(), Error> {
        layout.write("sweep.csv", self.csv().as_bytes())?;
        Ok(layout.write("sweep.html", page::page(sweep, self).as_bytes())?)
    }

    /// The content of `sweep.csv`: shortest digits that read back as the same number; empty for what is not there.
    pub fn csv(&self) -> String {
        let columns = self.keys.iter().map(|key| csv_text(key)).chain(COLUMNS.map(str::to_owned));
        let traded = self.criteria.iter().map(|criterion| csv_text(&criterion.title()));
        let on_front = (!self.criteria.is_empty()).then(|| "on_front".to_owned());
        let mut table = columns.chain(traded).chain(on_front).collect::<Vec<_>>().join(",") + "\n";
        for (index, row) in self.combinations.iter().enumerate() {
            let value = serde_json::to_value(row).expect("numbers and text have a JSON form");
            let cell = |column: &str| match &value[column] {
                Value::Null if column == "status" => "not_begun".to_owned(),
                Value::Null => String::new(),
                Value::String(text) => csv_text(text),
                Value::Array(_) => csv_text(&row.violated.join(" ")),
                other => other.to_string(),
            };
            let cells = row.values.iter().map(|value| csv_text(value)).chain(COLUMNS.map(cell));
            let traded = (0..self.criteria.len())
                .map(|k| row.criteria.get(k).map_or(String::new(), |value| Value::from(*value).to_string()));
            let on_front = (!self.criteria.is_empty()).then(|| self.front.contains(&index).to_string());
            table += &(cells.chain(traded).chain(on_front).collect::<Vec<_>>().join(",") + "\n");
        }
        table
    }

    /// What the runs are compared by, if it is a number: the objective where all have the same, and else its share of their own
    /// beginnings.
    pub(super) fn compared_value(&self, row: &Row) -> Option<f64> {
        let value = if self.goal.is_some() { row.objective_best } else { row.ratio };
        value.filter(|value| value.is_finite())
    }

    /// That, in letters.
    pub(super) fn compared_symbol(&self) -> &'static str {
        if self.goal.is_some() { "F" } else { "F / F₀" }
    }

    /// The best of the rows that keep their constraints, where all have the same objective. Their beginnings may differ, so that the
    /// ratio says nothing.
    fn find_best(&self) -> Option<usize> {
        let sign = self.goal?.sign();
        let sound = self.combinations.iter().enumerate().filter(|(_, row)| row.violated.is_empty());
        let known = sound.filter_map(|(index, row)| Some((index, sign * self.compared_value(row)?)));
        known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }
}

/// The goal of runs that have the same objective.
fn common_goal(combinations: &[Planned]) -> Option<Goal> {
    let first = combinations.first()?.objective.as_ref()?;
    let same = combinations.iter().all(|planned| planned.objective.as_ref() == Some(first));
    same.then_some(first.goal)
}

/// Columns of `sweep.csv` after those of the keys.
const COLUMNS: [&str; 13] = [
    "status",
    "stop_reason",
    "evaluations",
    "objective_initial",
    "objective_best",
    "ratio",
    "verified_ratio",
    "verdict",
    "violated",
    "worst_quality",
    "seconds",
    "peak_memory_bytes",
    "directory",
];

/// Whether the log of a run that has no directory says why: one whose configuration or mesh is refused begins none.
fn has_failed(layout: &Layout, planned: &Planned) -> bool {
    let log = std::fs::read_to_string(layout.log(planned)).unwrap_or_default();
    log.lines().any(|line| line.starts_with("error: "))
}

impl Row {
    /// Reads the run directory of a combination.
    ///
    /// # Errors
    /// When a file that is there cannot be read.
    pub fn read(sweep: &Sweep, layout: &Layout, planned: &Planned) -> Result<Self, OutputError> {
        let blank = Self::blank(planned);
        let run = match RunDirectory::open(layout.disk(), &sweep.run_directory(planned)) {
            Ok(run) => run,
            Err(OutputError::NoRun { .. }) => {
                let log = has_failed(layout, planned).then(|| (layout.log_name(planned), "log"));
                return Ok(Self { status: log.as_ref().map(|_| RunStatus::Failed), file: log, ..blank });
            }
            Err(error) => return Err(error),
        };
        let manifest = Manifest::read(&run)?;
        let curve = curve(&run)?;
        let result = state::result(&run, &manifest);
        let is_configured = run.holds_configuration() || result.is_some();
        let read = match state::other_command(&manifest) {
            Some(difference) => Err(difference),
            None if is_configured => state::configured(&run, &manifest, planned)
                .map(|(config, _)| state::inputs(&config, &manifest)),
            None => Ok(Vec::new()),
        };
        let (inputs, difference) = match read {
            Ok(inputs) => (inputs, None),
            Err(difference) => (Vec::new(), Some(difference)),
        };
        let objective = result.as_ref().and_then(|result| result.objective.as_ref());
        let of_result = |value: fn(&RunResult) -> Option<f64>| result.as_ref().and_then(value);
        let length = Some(curve.len()).filter(|length| *length > 0);
        Ok(Self {
            status: Some(manifest.status),
            stop_reason: result.as_ref().map(|result| result.stop_reason),
            evaluations: result.as_ref().map(|result| result.evaluations).or(length),
            objective_initial: objective.map(|objective| objective.initial),
            objective_best: objective.map(|objective| objective.best),
            ratio: objective.map(|objective| objective.ratio),
            verified_ratio: objective.and_then(|objective| objective.verified_ratio),
            verdict: result.as_ref().and_then(|result| result.accuracy.as_ref()?.verdict),
            criteria: result.as_ref().and_then(|result| values(planned, result)).unwrap_or_default(),
            worst_quality: of_result(|result| Some(result.mesh.worst_quality_final)),
            seconds: of_result(|result| result.timings_s.get("total").copied()),
            peak_memory_bytes: result.as_ref().map(|result| result.peak_memory_bytes),
            violated: result.as_ref().map_or(Vec::new(), RunResult::violated),
            inputs,
            difference,
            file: Some(if is_file(layout, &run.report()) {
                (format!("{}/report.html", blank.directory), "report")
            } else {
                (format!("{}/", blank.directory), "files")
            }),
            curve,
            ..blank
        })
    }

    /// How it ended, and where it is.
    fn without_what_it_found(&self) -> Self {
        Self {
            values: self.values.clone(),
            status: self.status,
            stop_reason: self.stop_reason,
            evaluations: self.evaluations,
            seconds: self.seconds,
            directory: self.directory.clone(),
            inputs: self.inputs.clone(),
            difference: self.difference.clone(),
            file: self.file.clone(),
            ..Self::default()
        }
    }

    fn blank(planned: &Planned) -> Self {
        Self {
            values: planned.combination.values.clone(),
            directory: planned.combination.name.clone(),
            ..Self::default()
        }
    }
}

/// The criteria of a sweep: those of all its combinations, if these are the same.
fn criteria(combinations: &[Planned]) -> Vec<Criterion> {
    let first = combinations.first().and_then(|planned| planned.criteria.as_ref());
    let same =
        first.filter(|first| combinations.iter().all(|planned| planned.criteria.as_ref() == Some(first)));
    same.map_or(Vec::new(), |pair| pair.to_vec())
}

/// The criteria of a combination in its result.
fn values(planned: &Planned, result: &RunResult) -> Option<Vec<f64>> {
    planned.criteria.as_ref()?.iter().map(|criterion| criterion.value(result)).collect()
}

fn is_file(layout: &Layout, path: &Path) -> bool {
    let folder = path.parent().unwrap_or(path);
    layout.disk().names(folder).is_ok_and(|names| names.iter().any(|name| path.ends_with(name)))
}

/// Evaluation and ratio of every evaluation; a last one that is being written is left out.
fn curve(run: &RunDirectory) -> Result<Vec<[f64; 2]>, OutputError> {
    let records = Journal::read_records(run)?;
    Ok(records.iter().map(|record| [record.row.evaluation as f64, record.row.ratio]).collect())
}
