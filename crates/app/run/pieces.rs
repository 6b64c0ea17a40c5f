//! The field of an evaluation written by all ranks, each the piece of its own elements.
//!
//! Rank 0 makes the folder before and writes the header after; every rank writes one file into it, through the same layer as
//! all files. The run directory must be one that all ranks see, as a shared file system has it.

use std::path::PathBuf;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::parallel::{
    Command, CommandChannel, CommandHandler, Communicator, Ownership, complex_of, numbers_of,
};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::problem::{Analysis, Problem};
use fluxmorph_solver::{FieldModel, FieldSolution};

use crate::error::Error;
use crate::files::fields::{self, FieldData};
use crate::files::{RunDirectory, system_disk};

/// What all ranks write with.
#[derive(Debug)]
pub(super) struct SharedPieces {
    channel: CommandChannel,
    ranks: usize,
}

impl SharedPieces {
    /// Shares the work of writing into a directory; every rank does, after its set-up. `None` for one process.
    pub(super) fn of(problem: &Problem, directory: PathBuf) -> Option<Self> {
        let share = problem.share()?;
        let states = problem.states().iter().map(FieldModel::of_one_process).collect();
        let has_thickness = problem.shape().is_some_and(|shape| shape.thickness().is_some());
        let mesh = problem.original().clone();
        let writer = PieceWriter { states, share: share.clone(), mesh, has_thickness, directory };
        Some(Self { channel: share.group.register(Box::new(writer)), ranks: share.group.size() })
    }

    /// Writes the field of an evaluation.
    pub(super) fn write(
        &self,
        directory: &RunDirectory,
        evaluation: usize,
        problem: &Problem,
        analysis: &Analysis,
    ) -> Result<(), Error> {
        let (thickness, deviation) =
            (fields::thickness(problem, analysis), fields::deviation(problem, analysis));
        let data = FieldData {
            thickness: thickness.as_deref(),
            deviation: deviation.as_deref(),
            ..FieldData::of(analysis)
        };
        directory.begin_pieces(evaluation)?;
        let mut numbers = vec![evaluation as f64];
        numbers.extend_from_slice(analysis.mesh.points().as_flattened());
        numbers.extend_from_slice(data.displacement.as_flattened());
        match data.sensitivity {
            Some(sensitivity) => numbers.extend_from_slice(sensitivity.as_flattened()),
            None => numbers.resize(numbers.len() + 3 * data.displacement.len(), 0.0),
        }
        numbers.extend_from_slice(data.thickness.unwrap_or_default());
        numbers.push(f64::from(u8::from(data.deviation.is_some())));
        numbers.extend_from_slice(data.deviation.unwrap_or_default());
        for solution in data.solutions {
            numbers.extend(numbers_of(solution.values()));
        }
        self.channel.execute(0, numbers).map_err(|cause| Error::Pieces { cause })?;
        let names: Vec<String> =
            (0..self.ranks).map(|rank| RunDirectory::piece_in_header(evaluation, rank)).collect();
        Ok(directory.finish_pieces(evaluation, &fields::header(problem.states(), &data, &names))?)
    }
}

/// What a rank writes its pieces with.
struct PieceWriter {
    states: Vec<FieldModel>,
    share: Ownership,
    /// Of the topology that all designs have.
    mesh: Mesh,
    /// Whether the fields come with the thickness of designed bodies.
    has_thickness: bool,
    directory: PathBuf,
}

impl CommandHandler for PieceWriter {
    fn handle(&mut self, command: &Command, _: &dyn Communicator) -> Result<Vec<f64>, String> {
        let nodes = self.mesh.points().len();
        let mut rest = command.numbers.as_slice();
        let mut take = |count: usize| -> Result<&[f64], String> {
            let (taken, others) = rest.split_at_checked(count).ok_or("the command is too short")?;
            rest = others;
            Ok(taken)
        };
        let evaluation = take(1)?[0] as usize;
        let mut points = || take(3 * nodes).map(|numbers| numbers.as_chunks::<3>().0.to_vec());
        let (places, displacement, sensitivity): (Vec<Point>, Vec<Point>, Vec<Point>) =
            (points()?, points()?, points()?);
        let thickness = if self.has_thickness { Some(take(nodes)?) } else { None };
        let elements = self.mesh.topology().tets().len();
        let deviation = if take(1)?[0] > 0.0 { Some(take(elements)?) } else { None };
        let mut solutions = Vec::with_capacity(self.states.len());
        for state in &self.states {
            let values = complex_of(take(2 * state.unknown_count())?);
            solutions.push(FieldSolution::of_state(values));
        }
        let said = |error: &dyn std::fmt::Display| error.to_string();
        let mesh = Mesh::new(self.mesh.topology().clone(), places).map_err(|e| said(&e))?;
        let data = FieldData {
            mesh: &mesh,
            displacement: &displacement,
            sensitivity: Some(&sensitivity),
            thickness,
            error: None,
            deviation,
            solutions: &solutions,
            bodies: &[],
        };
        let rank = self.share.group.rank();
        let own = self.share.partition.elements_of(rank);
        let bytes = fields::piece(&self.states, &data, own).map_err(|e| said(&e))?;
        let directory = RunDirectory::open(&system_disk(), &self.directory).map_err(|e| said(&e))?;
        directory.write(&directory.field_piece(evaluation, rank), &bytes).map_err(|e| said(&e))?;
        Ok(Vec::new())
    }
}
