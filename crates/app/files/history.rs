//! `history.csv`: one row an evaluation, on the disk before the next evaluation starts.

use std::collections::BTreeMap;

use fluxmorph_optimizer::body::BodyForce;
use serde_json::Value;

use super::{OutputError, RunDirectory, SyncedLog, csv_text};
use crate::show::{Evaluation, column};

/// The history of a run, for people; all that is in it is in the journal as well.
#[derive(Debug)]
pub struct History {
    csv: SyncedLog,
    columns: Vec<String>,
}

impl History {
    /// Starts the file with the rows so far; `constraints` are the names of the constraints, and `forces` what is reported of bodies,
    /// in their order.
    pub fn create(
        directory: &RunDirectory,
        (constraints, forces): (&[&str], &[BodyForce]),
        rows: &[&Evaluation],
    ) -> Result<Self, OutputError> {
        let columns = columns(constraints, forces);
        let head: Vec<String> = columns.iter().map(|column| csv_text(column)).collect();
        let mut table = format!("{}\n", head.join(","));
        table.extend(rows.iter().map(|row| csv_line(row, &columns)));
        Ok(Self { csv: directory.log(&directory.history_csv(), table.as_bytes())?, columns })
    }

    /// Appends one evaluation, and waits until it is on the disk.
    pub fn append(&mut self, evaluation: &Evaluation) -> Result<(), OutputError> {
        self.csv.append(csv_line(evaluation, &self.columns).as_bytes())
    }
}

/// The columns of `history.csv`: those of every run, then one for each constraint, then six for each body in each load case.
fn columns(constraints: &[&str], forces: &[BodyForce]) -> Vec<String> {
    let fixed = Evaluation::COLUMNS.iter().map(|&name| name.to_owned());
    let of_bodies = forces.iter().flat_map(BodyForce::columns).map(|(column, _)| column);
    fixed.chain(constraints.iter().map(|name| column(name))).chain(of_bodies).collect()
}

/// The line of an evaluation in `history.csv`: shortest digits that read back as the same number; empty for what
/// the device does not have.
fn csv_line(evaluation: &Evaluation, columns: &[String]) -> String {
    let value = serde_json::to_value(evaluation).expect("numbers and text have a JSON form");
    let forces: BTreeMap<String, f64> = evaluation.forces.iter().flat_map(BodyForce::columns).collect();
    let cell = |column: &String| match (&value[column], forces.get(column)) {
        (_, Some(force)) => Value::from(*force).to_string(),
        (Value::Null, None) => String::new(),
        (Value::String(text), None) => csv_text(text),
        (other, None) => other.to_string(),
    };
    format!("{}\n", columns.iter().map(cell).collect::<Vec<_>>().join(","))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::{OverwritePolicy, system_disk};

    fn evaluation() -> Evaluation {
        Evaluation {
            evaluation: 3,
            iteration: 2,
            objective: 0.1 + 0.2,
            ratio: 1.0,
            gradient_norm: 1.25e-300,
            step_norm: 0.0,
            worst_quality: 0.104,
            min_thickness_m: Some(0.005),
            max_thickness_m: None,
            linear_iterations: 57,
            seconds: 4.2,
            step_to_inversion: Some(1.25),
            inversion_element: Some(17),
            inversion_region: Some("air, \"near\"".to_owned()),
            level: 0,
            forces: vec![BodyForce {
                name: "pole".to_owned(),
                state: Some("closed".to_owned()),
                force_n: [0.5, 0.0, -1.25],
                torque_nm: [0.0; 3],
            }],
            constraints: [("c_volume".to_owned(), -0.5)].into(),
        }
    }

    #[test]
    fn rows_have_the_documented_columns_and_exact_numbers() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let run = RunDirectory::create(&system_disk(), folder.path(), OverwritePolicy::Keep)
            .expect("a run directory");
        History::create(&run, (&["volume"], &evaluation().forces), &[&evaluation()])
            .and_then(|mut history| history.append(&evaluation()))
            .expect("written");

        let row = "3,2,0.30000000000000004,1.0,1.25e-300,0.0,0.104,0.005,,57,4.2,1.25,17,\"air, \"\"near\"\"\",0,-0.5,0.5,0.0,-1.25,0.0,0.0,0.0\n";
        let header = "evaluation,iteration,objective,ratio,gradient_norm,step_norm,worst_quality,\
                      min_thickness_m,max_thickness_m,linear_iterations,seconds,step_to_inversion,inversion_element,inversion_region,\
                      level,c_volume,force_pole_x_n_closed,force_pole_y_n_closed,force_pole_z_n_closed,torque_pole_x_nm_closed,\
                      torque_pole_y_nm_closed,torque_pole_z_nm_closed\n";
        let csv = std::fs::read_to_string(run.history_csv()).expect("read");
        assert_eq!(csv, format!("{header}{row}{row}"));
    }

    #[test]
    fn every_column_is_a_field_and_every_field_a_column() {
        let without_forces = Evaluation { forces: Vec::new(), ..evaluation() };
        let value = serde_json::to_value(without_forces).expect("an object");
        let keys: Vec<_> = value.as_object().expect("an object").keys().cloned().collect();
        assert_eq!(keys, columns(&["volume"], &[]));
    }
}
