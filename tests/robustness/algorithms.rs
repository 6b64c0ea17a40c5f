//! Every algorithm, cut at every evaluation of a long run on a function that costs nothing: a replay of the
//! journal brings NLopt into the state that it was in.

use std::path::Path;

use fluxmorph::config::Algorithm;
use fluxmorph::files::{OverwritePolicy, RunDirectory};
use fluxmorph::run::journal::{Identity, Journal};
use fluxmorph::show::Evaluation;
use fluxmorph_optimizer::Error;
use fluxmorph_optimizer::driver::Record;
use fluxmorph_optimizer::nlopt::{Minimisation, Sample, minimise};

use crate::disk::SimulatedDisk;

/// As many as the paper's shield has.
const VARIABLES: usize = 91;

/// Length of the run.
const EVALUATIONS: usize = 60;

/// A chain of Rosenbrock's valleys about 10 mm, never done in so few evaluations, and the bound of a sphere on it.
fn function(p: &[f64]) -> (f64, Vec<f64>, (f64, Vec<f64>)) {
    let x: Vec<f64> = p.iter().map(|p| p / 0.01).collect();
    let (mut value, mut gradient) = (1.0, vec![0.0; x.len()]);
    for k in 0..x.len() - 1 {
        let (valley, slope) = (x[k + 1] - x[k] * x[k], 1.0 - x[k]);
        value += 100.0 * valley * valley + slope * slope;
        gradient[k] += (-400.0 * valley * x[k] - 2.0 * slope) / 0.01;
        gradient[k + 1] += 200.0 * valley / 0.01;
    }
    let sphere = x.iter().map(|x| x * x).sum::<f64>() / (0.9 * x.len() as f64) - 1.0;
    let normal = x.iter().map(|x| 2.0 * x / (0.9 * 0.01 * 91.0)).collect();
    (value, gradient, (sphere, normal))
}

fn record(number: usize, p: &[f64], constrained: bool) -> Record {
    let (objective, gradient, constraint) = function(p);
    Record {
        row: Evaluation { evaluation: number, objective, ..Evaluation::default() },
        design: p.to_vec(),
        gradient,
        constraints: if constrained { vec![constraint] } else { Vec::new() },
        ..Record::default()
    }
}

/// Minimises to the last evaluation, from a journal as far as it goes; returns the bytes of the journal then, and the number
/// of evaluations that were computed.
fn minimised(algorithm: Algorithm, journal: Option<&[u8]>) -> (Vec<u8>, usize) {
    let constrained = algorithm.takes_constraints();
    let identity = Identity {
        version: String::new(),
        configuration: "0".repeat(64),
        mesh: "0".repeat(64),
        tables: String::new(),
        variables: VARIABLES,
        constraints: usize::from(constrained),
    };
    let settings = Minimisation {
        algorithm,
        lower: vec![-0.005; VARIABLES],
        upper: vec![0.02; VARIABLES],
        constraints: identity.constraints,
        members: 0,
        ftol_rel: 0.0,
        xtol_rel: 0.0,
        first_step: 0.1,
    };
    let disk = SimulatedDisk::default();
    let directory =
        RunDirectory::create(&disk.shared(), Path::new("/run"), OverwritePolicy::Keep).expect("made");
    let (mut journal, replayed) = match journal {
        None => (Journal::create(&directory, identity).expect("created"), Vec::new()),
        Some(bytes) => {
            directory.write(&directory.journal(), bytes).expect("written");
            let contents = Journal::read(&directory).expect("read").expect("there");
            (Journal::reopen(&directory, &contents).expect("opened"), contents.records)
        }
    };
    let (mut count, mut computed) = (0, 0);
    // No two variables alike: a symmetric start would be a problem of few variables.
    let start: Vec<f64> = (0..VARIABLES).map(|k| -0.004 + 0.006 * (k as f64).sin().abs()).collect();
    minimise::<Error>(&settings, &start, |p| {
        if count == EVALUATIONS {
            return Err(Error::Optimisation { cause: "enough" });
        }
        let record = match replayed.get(count) {
            Some(record) => {
                let bits = |p: &[f64]| p.iter().map(|p| p.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(p), bits(&record.design), "{algorithm:?}, evaluation {count}");
                record.clone()
            }
            None => {
                computed += 1;
                let record = record(count, p, constrained);
                journal.append(&record).expect("appended");
                record
            }
        };
        count += 1;
        Ok(Sample {
            value: record.row.objective,
            gradient: record.gradient,
            constraints: record.constraints,
            ..Sample::default()
        })
    });
    let bytes = disk.files(Path::new("/run")).remove(Path::new("journal.jsonl")).expect("a journal");
    (bytes, computed)
}

#[test]
fn every_algorithm_is_brought_back_into_its_state_at_every_evaluation() {
    for algorithm in Algorithm::ALL {
        let (whole, computed) = minimised(algorithm, None);
        assert_eq!(computed, EVALUATIONS, "{algorithm:?} is to run that long");
        let lines: Vec<&[u8]> = whole.split_inclusive(|&byte| byte == b'\n').collect();
        for cut in 0..=EVALUATIONS {
            let length: usize = lines[..=cut].iter().map(|line| line.len()).sum();
            let (again, computed) = minimised(algorithm, Some(&whole[..length]));
            assert_eq!(computed, EVALUATIONS - cut, "{algorithm:?}, cut at {cut}");
            assert!(again == whole, "{algorithm:?}, cut at {cut}: other designs or values");
        }
    }
}
