//! Every operation on files of a run, and of a resumed run, fails in every way once: nothing is lost, nothing is torn, and
//! no failed write is taken for a success.

use std::path::Path;

use fluxmorph::config::{Config, Optimizer, SourceMap};
use fluxmorph::files::{OutputError, RunResult};
use fluxmorph::run::RunLimits;
use fluxmorph::{Error, ExitCode};
use rayon::prelude::*;

use crate::disk::{Fault, SimulatedDisk};
use crate::in_memory::{FOLDER, block, constrained, moved_by, resume, run};
use crate::support::device::LINEAR;
use crate::support::essence::{Essence, assert_same, essence};
use crate::support::whole::{Logs, torn};

/// What was tried, and what came of it.
#[derive(Debug, Default)]
struct Tally {
    faults: usize,
    failed: usize,
    resumed: usize,
    started_again: usize,
}

impl std::ops::Add for Tally {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            faults: self.faults + other.faults,
            failed: self.failed + other.failed,
            resumed: self.resumed + other.resumed,
            started_again: self.started_again + other.started_again,
        }
    }
}

/// One failing work on a disk: from `disk`, do `work` with the fault, and bring it to its end.
struct Trial<'a> {
    disk: &'a SimulatedDisk,
    device: &'a (Config, SourceMap),
    expected: &'a Essence,
    /// Of the resumption that follows a failure.
    limits: RunLimits,
    work: &'a (dyn Fn(&SimulatedDisk) -> Result<RunResult, Error> + Sync),
}

impl Trial<'_> {
    /// All faults at all operations.
    fn all(&self) -> Tally {
        let undisturbed = self.disk.copy();
        (self.work)(&undisturbed).unwrap_or_else(|e| panic!("{e}"));
        let operations = undisturbed.operations();
        let cases: Vec<(usize, Fault)> =
            (0..operations.len()).flat_map(|n| Fault::ALL.map(|fault| (n, fault))).collect();
        let tallies: Vec<Tally> =
            cases.par_iter().map(|&(number, fault)| self.one(number, operations[number], fault)).collect();
        tallies.into_iter().fold(Tally::default(), |sum, tally| sum + tally)
    }

    fn one(&self, number: usize, operation: &str, fault: Fault) -> Tally {
        let context = format!("{fault:?} at operation {number}, {operation}");
        if fault == Fault::ShortWrite && operation != "write" {
            return Tally::default();
        }
        let mut tally = Tally { faults: 1, ..Tally::default() };
        let disk = self.disk.copy();
        disk.fail_at(number, fault);
        match (self.work)(&disk) {
            Ok(_) => assert_eq!(fault, Fault::ShortWrite, "{context}: a failure went unnoticed"),
            Err(error) => {
                assert_eq!(error.exit_code(), ExitCode::Files, "{context}: {error}");
                assert!(error.to_string().contains(FOLDER), "{context}: no file is named: {error}");
                tally.failed = 1;
            }
        }
        disk.mend();
        check_whole(&disk, fault, &context);
        let config = Path::new("config.toml");
        let is_older =
            disk.files(FOLDER.as_ref()).get(config).is_some_and(|text| *text != self.expected[config]);
        if tally.failed == 1 && is_older {
            // An earlier run was to be replaced and still stands there.
            run(&disk.shared(), self.device).unwrap_or_else(|e| panic!("{context}: {e}"));
            tally.started_again = 1;
        } else if tally.failed == 1 {
            match resume(&disk.shared(), self.limits) {
                Ok(_) => tally.resumed = 1,
                // So early that there is nothing to resume.
                Err(Error::NotResumable { .. } | Error::Output(OutputError::NoRun { .. })) => {
                    let journal = disk.files(FOLDER.as_ref()).remove(Path::new("journal.jsonl"));
                    assert!(journal.is_none(), "{context}: evaluations are there, and cannot be resumed");
                    run(&disk.shared(), self.device).unwrap_or_else(|e| panic!("{context}: {e}"));
                    tally.started_again = 1;
                }
                Err(error) => panic!("{context}: {error}"),
            }
        }
        assert_same(&essence(&disk.files(FOLDER.as_ref())), self.expected, &context);
        tally
    }
}

/// No file under its final name is torn; logs may end in the middle of a record after a crash.
fn check_whole(disk: &SimulatedDisk, fault: Fault, context: &str) {
    let logs = if fault.is_crash() { Logs::MayBeCut } else { Logs::AreWhole };
    assert_eq!(torn(&disk.files(FOLDER.as_ref()), logs), Vec::<String>::new(), "{context}");
}

/// The essence of a run without faults.
fn reference(device: &(Config, SourceMap)) -> Essence {
    let disk = SimulatedDisk::default();
    run(&disk.shared(), device).unwrap_or_else(|e| panic!("{e}"));
    essence(&disk.files(Path::new(FOLDER)))
}

#[test]
fn no_fault_of_the_disk_loses_or_tears_anything() {
    let of = |(config, source): (Config, SourceMap), max_evaluations: usize| {
        let optimizer = Optimizer { max_evaluations, ..config.optimizer };
        (Config { optimizer, ..config }, source)
    };
    let start = |device: &(Config, SourceMap)| {
        let expected = reference(device);
        let work = |disk: &SimulatedDisk| run(&disk.shared(), device);
        let limits = RunLimits::default();
        Trial { disk: &SimulatedDisk::default(), device, expected: &expected, limits, work: &work }.all()
    };
    let again = |device: &(Config, SourceMap), evaluations: usize| {
        let expected = reference(device);
        let disk = SimulatedDisk::default();
        run(&disk.shared(), &of(device.clone(), evaluations)).unwrap_or_else(|e| panic!("{e}"));
        let limits = RunLimits { max_evaluations: Some(device.0.optimizer.max_evaluations), max_time: None };
        let work = |disk: &SimulatedDisk| resume(&disk.shared(), limits);
        Trial { disk: &disk, device, expected: &expected, limits, work: &work }.all()
    };
    let replaced = |device: &(Config, SourceMap)| {
        let expected = reference(device);
        let disk = SimulatedDisk::default();
        run(&disk.shared(), &block(&[])).unwrap_or_else(|e| panic!("{e}"));
        let work = |disk: &SimulatedDisk| run(&disk.shared(), device);
        let limits = RunLimits::default();
        Trial { disk: &disk, device, expected: &expected, limits, work: &work }.all()
    };
    let tallies = [
        start(&of(block(&[]), 3)),
        again(&of(block(&[]), 4), 2),
        replaced(&of(constrained(), 3)),
        again(&of(moved_by(LINEAR), 8), 4),
    ];
    println!("{tallies:?}");
    let total = tallies.into_iter().fold(Tally::default(), |sum, tally| sum + tally);
    println!("together: {total:?}");
    assert!(total.faults >= 1500, "{total:?}");
    assert!(total.resumed > 5 * total.started_again, "most states can be resumed: {total:?}");
}
