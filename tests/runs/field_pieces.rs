//! Fields that several ranks wrote in pieces are, read back, those of one whole file, and the report shows the same.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::sync::Arc;

use fluxmorph::build::{Mode, set_up};
use fluxmorph::files::fields::{self, FieldData};
use fluxmorph::files::{Disk, RunDirectory, system_disk};
use fluxmorph::run;
use fluxmorph::show::Silent;
use fluxmorph::show::report::ReportedRun;
use fluxmorph_geometry::io::{VtuArray, join_pieces, pvtu_pieces, vtu_contents};
use fluxmorph_geometry::{ElementId, Partition};
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, Problem, SolverCache};

use crate::support::{config, options};

/// Three ranks, and one that owns no element.
const RANKS: usize = 4;

/// A run of one evaluation at two frequencies in a directory, and that evaluation computed again.
fn run(disk: &Arc<dyn Disk>, directory: &Path) -> (Problem, Analysis) {
    let overrides = ["optimizer.max_evaluations=1", "output.verify_refinement=0", "output.fields=every"];
    let (mut config, source) = config("shield_two_frequencies.toml", &overrides);
    config.output.directory = directory.to_owned();
    run::run(&config, &source, options(disk), &mut Silent).unwrap();
    let problem = set_up(&config, &source, Mode::Optimisation).unwrap().problem;
    let initial = problem.shape().unwrap().initial().to_vec();
    let analysis =
        problem.evaluate(&initial, Derivatives::First, &mut SolverCache::default(), &mut NoProgress).unwrap();
    (problem, analysis)
}

/// The elements of every rank; the last one owns none.
fn parts(analysis: &Analysis) -> Vec<Vec<ElementId>> {
    let topology = analysis.mesh.topology();
    let partition = Partition::new(topology, RANKS - 1, &vec![4; topology.node_count()], &[]).unwrap();
    let mut parts: Vec<Vec<ElementId>> = (0..RANKS - 1).map(|r| partition.elements_of(r).to_vec()).collect();
    parts.push(Vec::new());
    parts
}

fn write_pieces(directory: &RunDirectory, problem: &Problem, analysis: &Analysis) {
    let thickness = fields::thickness(problem, analysis).unwrap();
    let data = FieldData { thickness: Some(&thickness), ..FieldData::of(analysis) };
    directory.begin_pieces(0).unwrap();
    for (rank, elements) in parts(analysis).iter().enumerate() {
        let bytes = fields::piece(problem.states(), &data, elements).unwrap();
        directory.write(&directory.field_piece(0, rank), &bytes).unwrap();
    }
    let names: Vec<String> = (0..RANKS).map(|rank| RunDirectory::piece_in_header(0, rank)).collect();
    directory.finish_pieces(0, &fields::header(problem.states(), &data, &names)).unwrap();
}

/// All numbers of an array as bits: zeros of either sign differ.
fn bits(array: &VtuArray) -> Vec<u64> {
    match array {
        VtuArray::Scalar(values) => values.iter().map(|v| v.to_bits()).collect(),
        VtuArray::Vector(values) => values.as_flattened().iter().map(|v| v.to_bits()).collect(),
        VtuArray::Integer(values) => values.iter().map(|&v| v as u64).collect(),
    }
}

#[test]
fn fields_in_pieces_are_those_of_the_whole_and_are_reported_alike() {
    let folder = tempfile::tempdir().unwrap();
    let disk = system_disk();
    let path = folder.path().join("run");
    let (problem, analysis) = run(&disk, &path);
    let directory = RunDirectory::open(&disk, &path).unwrap();
    let page = folder.path().join("page.html");
    let report = || {
        let written = ReportedRun::open(&disk, &path).and_then(|run| run.write(Some(&page)));
        written.map(|page| std::fs::read_to_string(page).unwrap()).map_err(|error| error.to_string())
    };

    let whole = std::fs::read(directory.field(0)).unwrap();
    let thickness = fields::thickness(&problem, &analysis).unwrap();
    let data = FieldData { thickness: Some(&thickness), ..FieldData::of(&analysis) };
    assert!(whole == fields::vtu(problem.states(), &data).unwrap(), "the run's file");
    let whole = vtu_contents(&whole).unwrap();
    let of_whole = report().unwrap();
    write_pieces(&directory, &problem, &analysis);
    assert!(!directory.field(0).exists());

    // The joined arrays, bit for bit.
    let header = std::fs::read(directory.field_header(0)).unwrap();
    let read = |name: String| {
        let bytes = std::fs::read(directory.fields().join(&name)).unwrap();
        (name, vtu_contents(&bytes).unwrap())
    };
    let pieces: Vec<_> = pvtu_pieces(&header).unwrap().into_iter().map(read).collect();
    for ((_, piece), elements) in pieces.iter().zip(parts(&analysis)) {
        assert_eq!(piece.tets.len(), elements.len());
        if let Some(VtuArray::Integer(ids)) = piece.cell_data.get("GlobalCellIds") {
            assert!(elements.iter().map(|e| e.0 as i32).eq(ids.iter().copied()));
        }
    }
    let found = join_pieces(pieces).unwrap();
    assert_eq!((&found.points, &found.tets), (&whole.points, &whole.tets));
    for (found, whole) in [(&found.point_data, &whole.point_data), (&found.cell_data, &whole.cell_data)] {
        assert!(found.keys().eq(whole.keys()), "{:?}", found.keys());
        assert!(whole.keys().any(|name| name.ends_with("_200Hz")), "both frequencies");
        for (name, array) in whole {
            assert!(bits(&found[name]) == bits(array), "{name}");
        }
    }

    // The report, but for the name of the file that it leads to.
    assert!(of_whole.contains("fields/eval_0000.vtu"));
    assert!(report().unwrap() == of_whole.replace("fields/eval_0000.vtu", "fields/eval_0000.pvtu"));

    // What is wrong with a piece names it.
    let second = directory.field_piece(0, 1);
    let bytes = std::fs::read(&second).unwrap();
    std::fs::write(&second, &bytes[..bytes.len() / 2]).unwrap();
    let text = report().unwrap_err();
    assert!(text.contains("eval_0000/rank_001.vtu"), "{text}");
    std::fs::remove_file(&second).unwrap();
    let text = report().unwrap_err();
    assert!(text.contains("eval_0000/rank_001.vtu"), "{text}");
    std::fs::write(&second, std::fs::read(directory.field_piece(0, 0)).unwrap()).unwrap();
    let text = report().unwrap_err();
    assert!(text.contains("eval_0000.pvtu") && text.contains("`eval_0000/rank_001.vtu`"), "{text}");
    let header = String::from_utf8(header).unwrap().replace("eval_0000/rank_001", "../../elsewhere");
    std::fs::write(directory.field_header(0), header).unwrap();
    let text = report().unwrap_err();
    assert!(text.contains("`../../elsewhere.vtu`"), "{text}");
}
