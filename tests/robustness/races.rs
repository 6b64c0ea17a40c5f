//! Several processes that want the same directory at the same instant: one has it, the others are refused, and what is in
//! it in the end is what one alone leaves.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::support::device::{Device, written};
use crate::support::essence::{Essence, assert_same};
use crate::support::folder::{files, read_text};
use crate::support::program::{command, finish, folder};
use crate::support::whole::{Logs, torn};
use crate::support::write_into_page;

/// Evaluations of every run.
const EVALUATIONS: &str = "4";
/// What a process that was refused may say.
const REFUSALS: [&str; 5] = [
    "is written by another process of fluxmorph: wait for it or stop it",
    "holds an earlier run; replace it with --force",
    "holds no run of fluxmorph",
    "another process is working on it",
    "not empty and holds no",
];

#[derive(Clone, Copy, Debug)]
enum Racer {
    Run,
    Force,
    Resume,
    Report,
    Sweep,
}

use Racer::{Force, Report, Resume, Run, Sweep};

/// Who meets, and in what: a new directory, or one with a run that was stopped.
const RACES: [(&[Racer], Start); 6] = [
    (&[Run, Run], Start::New),
    (&[Run, Force, Run], Start::New),
    (&[Force, Resume], Start::Stopped),
    (&[Resume, Force, Force], Start::Stopped),
    (&[Resume, Resume, Report], Start::Stopped),
    (&[Sweep, Run, Sweep], Start::New),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Start {
    New,
    Stopped,
}

/// The head of the table; `force` is `run --force`. What the last two columns count ends the test.
const TABLE: &str = "| at the same instant | directory | races | one did its work | several, one after the other | refused, exit 5 | \
                     other bits at the end | torn files |\n|---|---|---|---|---|---|---|---|\n";

/// The block on so many elements that a run takes a fraction of a second.
fn device(home: &Path) -> Device {
    let finer = ("cells = [2, 2, 1]", "cells = [6, 6, 3]");
    let changes = [
        ("cells = [1, 1, 1]", "cells = [3, 3, 3]"),
        finer,
        finer,
        ("max_evaluations = 6", "max_evaluations = 4"),
    ];
    written("race", home, &changes).with("design.upper=\"3 mm\"")
}

struct Track {
    home: tempfile::TempDir,
    device: Device,
    expected: Essence,
}

impl Track {
    fn new() -> Self {
        let home = folder();
        let device = device(home.path());
        let (expected, _) = device.undisturbed(home.path());
        Self { home, device, expected }
    }

    /// The command of a racer; the run directory is that of a sweep's only combination.
    fn command(&self, racer: Racer, sweep: &Path, run: &Path) -> Command {
        let mut command = match racer {
            Run => self.device.command("run", run),
            Force => {
                let mut command = self.device.command("run", run);
                command.arg("--force");
                command
            }
            Resume => command(&[&"resume", &run, &"--max-evaluations", &EVALUATIONS]),
            Report => command(&[&"report", &run]),
            Sweep => {
                command(&[&"sweep", &self.device.config, &"--out", &sweep, &"--set", &"design.upper=3 mm"])
            }
        };
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }

    /// Lets them race; how many did their work and how many were refused.
    fn race(&self, trial: usize, racers: &[Racer], start: Start) -> [usize; 2] {
        let sweep = self.home.path().join(format!("trial_{trial}"));
        let run = sweep.join("design.upper=3mm");
        let context = format!("trial {trial}, {racers:?} into {start:?}");
        if start == Start::Stopped {
            finish(self.device.command("run", &run).args(["--max-evaluations", "2"])).completed();
        }
        // All commands are ready before the first is started.
        let mut commands: Vec<Command> =
            racers.iter().map(|racer| self.command(*racer, &sweep, &run)).collect();
        let processes: Vec<Child> =
            commands.iter_mut().map(|command| command.spawn().expect("the program starts")).collect();
        let (mut winners, mut refused) = (0, 0);
        for (racer, process) in racers.iter().zip(processes) {
            let output = process.wait_with_output().expect("it ends");
            let said = String::from_utf8_lossy(&output.stderr).into_owned() + &logs(&sweep);
            match output.status.code() {
                Some(0 | 1) => winners += usize::from(!matches!(racer, Report)),
                Some(5) => {
                    refused += 1;
                    assert!(REFUSALS.iter().any(|text| said.contains(text)), "{context}, {racer:?}: {said}");
                }
                other => panic!("{context}, {racer:?}: {other:?}: {said}"),
            }
        }
        assert!(winners >= 1, "{context}: all were refused");
        if start == Start::New && racers.iter().all(|racer| matches!(racer, Run)) {
            assert_eq!(winners, 1, "{context}");
        }
        let left = files(&run);
        assert_eq!(torn(&left, Logs::AreWhole), Vec::<String>::new(), "{context}");
        assert_same(&crate::support::essence::essence(&left), &self.expected, &context);
        assert!(read_text(&run.join("report.html")).ends_with("</html>\n"), "{context}");
        assert!(read_text(&run.join("manifest.json")).contains("\"status\": \"stopped\""), "{context}");
        [winners, refused]
    }

    /// Every mixture so many times; what became of them, a row each.
    fn races(&self, rounds: usize) -> String {
        let mut table = TABLE.to_owned();
        for (k, (racers, start)) in RACES.into_iter().enumerate() {
            let (mut alone, mut refused) = (0, 0);
            for round in 0..rounds {
                let [winners, lost] = self.race(rounds * k + round, racers, start);
                alone += usize::from(winners == 1);
                refused += lost;
            }
            let names: Vec<String> = racers.iter().map(|racer| format!("{racer:?}").to_lowercase()).collect();
            let place = match start {
                Start::New => "new",
                Start::Stopped => "interrupted",
            };
            table += &format!(
                "| {} | {place} | {rounds} | {alone} | {} | {refused} | 0 | 0 |\n",
                names.join(", "),
                rounds - alone
            );
        }
        table
    }
}

/// What the runs of a sweep have said.
fn logs(sweep: &Path) -> String {
    let Ok(entries) = std::fs::read_dir(sweep.join("logs")) else { return String::new() };
    let paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.iter().map(|path| read_text(path)).collect()
}

#[test]
fn of_several_processes_one_has_the_directory() {
    Track::new().races(1);
}

#[test]
#[ignore = "takes minutes"]
fn sixty_races_lose_nothing() {
    write_into_page("docs/robustness.md", "races", &Track::new().races(10));
}
