//! Signals: the first is answered at once and obeyed after the current evaluation, the second at once.
//!
//! "At once" is a claim about the order of things, whatever else the machine does: the answer comes before the current
//! evaluation ends, the end before it has a result. The times themselves are measured by `page`, in long series.

use std::cell::Cell;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use fluxmorph::Error;
use fluxmorph::files::{RunDirectory, RunResult, RunStatus, system_disk};
use fluxmorph::run::{self, Options, RunLimits, SavedRun};
use fluxmorph::show::{Observer, RunObserver, Silent};
use fluxmorph_optimizer::Error as OptimizerError;

use crate::support::device::{BLOCK, Device, block, endless, shipped, slow};
use crate::support::essence::{assert_same, essence};
use crate::support::folder::{RunFolder, count, files, rows};
use crate::support::program::{JOURNAL, PATIENCE, command, end_of, finish, folder, resume, send, wait_until};
use crate::support::whole::{Logs, torn};
use crate::support::{changed, options, parsed};

/// What every command writes once it listens to signals.
const LISTENS: &str = "setting up mesh and matrices";

/// An evaluation may end between a signal and the look at what it has done: trials of which one must show the claim.
const TRIALS: usize = 5;

/// A process whose lines on standard error come with their time.
pub(crate) struct Timed {
    child: Child,
    lines: Receiver<(Instant, String)>,
    said: Vec<String>,
}

/// A shell that has been started already, and sends a signal as soon as it reads a line.
struct Trigger(Child, ChildStdin);

impl Trigger {
    fn new(signal: &str, target: &Child) -> Self {
        let script = format!("read line; kill -{signal} {}", target.id());
        let child = Command::new("sh").args(["-c", &script]).stdin(Stdio::piped()).spawn();
        let mut child = child.expect("a shell is there");
        let stdin = child.stdin.take().expect("it is piped");
        Self(child, stdin)
    }

    /// When the signal was asked for.
    fn pull(mut self) -> Instant {
        let now = Instant::now();
        self.1.write_all(b"\n").expect("the shell waits");
        assert!(self.0.wait().expect("a child of this process").success());
        now
    }
}

impl Timed {
    pub(crate) fn start(command: &mut Command) -> Self {
        let mut child = command.stderr(Stdio::piped()).spawn().expect("the program starts");
        let stderr = child.stderr.take().expect("it is piped");
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                let _ = sender.send((Instant::now(), line));
            }
        });
        Self { child, lines, said: Vec::new() }
    }

    /// Waits for a line with a text; when it came.
    pub(crate) fn wait_for(&mut self, text: &str) -> Instant {
        loop {
            let line = self.lines.recv_timeout(PATIENCE);
            let (at, line) = line.unwrap_or_else(|_| panic!("no `{text}` in:\n{}", self.said.join("\n")));
            self.said.push(line);
            if self.said.last().is_some_and(|line| line.contains(text)) {
                return at;
            }
        }
    }

    /// How long the answer to a signal took.
    pub(crate) fn answer(&mut self, signal: &str) -> Duration {
        let pulled = Trigger::new(signal, &self.child).pull();
        self.wait_for("interrupt again to exit at once").saturating_duration_since(pulled)
    }

    /// How long the end after a signal took, and the exit code.
    pub(crate) fn end_after(&mut self, signal: &str) -> (Duration, Option<i32>) {
        let pulled = Trigger::new(signal, &self.child).pull();
        let status = end_of(&mut self.child);
        (pulled.elapsed(), status.code())
    }

    /// The exit code in the end, and all that was said.
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let status = end_of(&mut self.child);
        self.said.extend(self.lines.iter().map(|(_, line)| line));
        (status.code(), self.said.join("\n"))
    }
}

/// One run with one signal: how long the answer took, and the evaluations done after it.
pub(crate) fn first_signal(device: &Device, out: &Path, signal: &str) -> (Duration, usize) {
    let mut run = Timed::start(&mut device.command("run", out));
    wait_until("the first evaluation", || rows(out) > 0);
    assert_eq!(RunFolder(out.to_owned()).json("manifest.json")["status"], "running");
    assert!(!out.join("result.json").exists());
    let answer = run.answer(signal);
    let before = rows(out);
    let (code, said) = run.end();
    assert_eq!(code, Some(if signal == "INT" { 130 } else { 143 }), "{said}");
    assert!(said.contains(&format!("fluxmorph resume {}", out.display())), "{said}");
    assert_eq!(torn(&files(out), Logs::AreWhole), Vec::<String>::new());
    state_is_saved(out);
    (answer, rows(out) - before)
}

/// A result of all evaluations that were done, in files that say that the run was interrupted.
fn state_is_saved(out: &Path) {
    let run = RunFolder(out.to_owned());
    let result = run.result();
    assert_eq!(run.json("manifest.json")["status"], "interrupted");
    assert_eq!((&result["status"], &result["stop_reason"]), (&"interrupted".into(), &"interrupted".into()));
    assert_eq!(rows(out) as u64, count(&result, "/evaluations"));
}

/// One command with two signals: how long the answer to the first and the end after the second took.
pub(crate) fn second_signal(command: &mut Command, begun: impl Fn() -> bool) -> (Duration, Duration) {
    let mut run = Timed::start(command);
    wait_until("the work", begun);
    let answer = run.answer("INT");
    let (end, code) = run.end_after("INT");
    assert_eq!(code, Some(130));
    (answer, end)
}

#[test]
fn the_first_signal_is_answered_at_once_and_the_run_ends_after_the_evaluation_in_hand() {
    let home = folder();
    for signal in ["INT", "TERM"] {
        // Evaluations so long that the answer is there before the one in hand is done.
        let is_answered_within = |trial: usize| {
            let out = home.path().join(format!("{signal}_{trial}"));
            let (_, after) = first_signal(&slow(home.path()), &out, signal);
            assert!(after <= 1, "{after} evaluations after the answer");
            after == 1
        };
        assert!((0..TRIALS).any(is_answered_within), "{signal}: answered only when the evaluation was done");
    }
}

#[test]
fn a_run_of_short_evaluations_keeps_the_fields_of_all_that_were_done() {
    let home = folder();
    let out = home.path().join("out");
    first_signal(&endless().with("output.fields=every"), &out, "TERM");
    let run = RunFolder(out);
    let result = run.result();
    for evaluation in 0..count(&result, "/evaluations") {
        assert_eq!(run.field(evaluation).points.len() as u64, count(&result, "/mesh/nodes"));
    }
}

#[test]
fn evaluations_that_another_program_removes_are_not_said_to_be_saved() {
    let home = folder();
    let out = home.path().join("out");
    let mut run = Timed::start(&mut endless().command("run", &out));
    wait_until("the first evaluation", || rows(&out) > 0);
    std::fs::remove_file(out.join(JOURNAL)).expect("it is there");
    run.answer("INT");
    let (code, said) = run.end();
    assert_eq!(code, Some(130), "{said}");
    assert!(
        said.contains("journal.jsonl` holds 0 of ") && said.contains("computes the others anew"),
        "{said}"
    );
    assert!(!said.contains("all evaluations are saved"), "{said}");
}

/// Two signals to a command on a device of long evaluations once a file is there; the directory that it left without a
/// result.
fn left_at_once(device: &Device, name: &str, begun: &str, home: &Path) -> std::path::PathBuf {
    for trial in 0..TRIALS {
        let out = home.join(format!("{name}_{trial}"));
        second_signal(&mut device.command(name, &out), || out.join(begun).exists());
        if !out.join("result.json").exists() {
            return out;
        }
    }
    panic!("`{name}` came to its result in spite of a second signal");
}

#[test]
fn the_second_signal_ends_a_run_at_once_and_it_can_be_gone_on_with() {
    let home = folder();
    let device = slow(home.path()).with("optimizer.max_evaluations=2");
    let out = left_at_once(&device, "run", JOURNAL, home.path());
    assert_eq!(torn(&files(&out), Logs::MayBeCut), Vec::<String>::new());
    finish(&mut resume(&out)).completed();
    let (expected, _) = device.undisturbed(home.path());
    assert_same(&essence(&files(&out)), &expected, "left at once");
}

/// The library that orders matrices puts a handler of its own in the place of any while it works, which jumps anywhere on other
/// threads than its own: no signal may reach one.
#[test]
#[cfg(target_os = "linux")]
fn a_signal_while_a_matrix_is_ordered_ends_a_command_as_at_any_other_moment() {
    use std::os::unix::process::ExitStatusExt;
    const TERM: i32 = 15;
    let home = folder();
    let out = home.path().join("out");
    let device = shipped("shield", &[]).with("analysis.order=2");
    let mut solve = Timed::start(device.command("solve", &out).arg("--force"));
    solve.wait_for(LISTENS);
    assert_eq!(threads_that_take(TERM, solve.child.id()), Vec::<String>::new());
    solve.answer("TERM");
    solve.end_after("TERM");
    for trial in 1..8 {
        let mut solve = device.command("solve", &out).arg("--force").spawn().expect("the program starts");
        std::thread::sleep(Duration::from_millis(150 * trial));
        send("TERM", solve.id());
        std::thread::sleep(Duration::from_millis(50));
        if solve.try_wait().expect("a child of this process").is_none() {
            // The first lets the work in hand be finished.
            send("TERM", solve.id());
        }
        let status = end_of(&mut solve);
        // In the first moments of a process it has its default.
        assert!(status.code() == Some(143) || status.signal() == Some(TERM), "trial {trial}: {status}");
    }
}

/// The threads of a process that do not block a signal, by their names; that which waits for it is the one called `signals`.
#[cfg(target_os = "linux")]
fn threads_that_take(signal: i32, process: u32) -> Vec<String> {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).expect("it runs");
    let of = |status: &str, what: &str| -> String {
        status.lines().find_map(|line| line.strip_prefix(what)).expect("a line of its own").trim().to_owned()
    };
    let takes = |status: String| {
        let mask = u64::from_str_radix(&of(&status, "SigBlk:"), 16).expect("it is hexadecimal");
        (mask >> (signal - 1) & 1 == 0).then(|| of(&status, "Name:"))
    };
    threads
        .filter_map(|thread| std::fs::read_to_string(thread.ok()?.path().join("status")).ok())
        .filter_map(takes)
        .filter(|name| name != "signals")
        .collect()
}

#[test]
fn a_single_solve_is_finished_and_a_second_signal_leaves_it() {
    let home = folder();
    let (device, out) = (slow(home.path()), home.path().join("out"));
    let mut solve = Timed::start(&mut device.command("solve", &out));
    wait_until("the manifest", || out.join("manifest.json").exists());
    solve.answer("TERM");
    let (code, said) = solve.end();
    assert_eq!(code, Some(143), "{said}");
    assert!(out.join("result.json").exists());
    // It is done in one go, and says so.
    let out = left_at_once(&device, "solve", "manifest.json", home.path());
    finish(&mut resume(&out)).with(3, &["holds a `solve`", "start it again"]);
}

#[test]
fn a_gradient_ends_after_the_evaluation_in_hand() {
    let home = folder();
    let mut gradient = command(&[&"gradient", &slow(home.path()).config]);
    let mut gradient = Timed::start(gradient.stdout(Stdio::null()));
    gradient.wait_for(LISTENS);
    gradient.answer("INT");
    let (code, said) = gradient.end();
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("interrupted before there was anything to keep"), "{said}");
}

#[test]
fn a_signal_during_the_set_up_leaves_nothing() {
    let home = folder();
    let device = slow(home.path());
    // Where the signal finds it depends on the machine; what must hold does not.
    for wait in [0, 1000] {
        let out = home.path().join("out");
        let mut run = Timed::start(&mut device.command("run", &out));
        run.wait_for(LISTENS);
        std::thread::sleep(Duration::from_millis(wait));
        run.answer("INT");
        let (code, said) = run.end();
        assert_eq!(code, Some(130), "{said}");
        if out.exists() {
            // A fast machine was in the first evaluation already.
            assert!(said.contains("fluxmorph resume"), "{said}");
            std::fs::remove_dir_all(&out).expect("removed");
        } else {
            assert!(said.contains("interrupted before there was anything to keep"), "{said}");
            assert!(!said.contains("fluxmorph resume"), "{said}");
        }
    }
}

#[test]
fn a_signal_before_the_first_evaluation_leaves_a_run_to_go_on_with() {
    let home = folder();
    let device = block(home.path(), 6);
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join("out");
    let run = Timed::start(&mut device.command("run", &out));
    wait_until("the manifest", || out.join("manifest.json").exists());
    send("INT", run.child.id());
    let (code, said) = run.end();
    if code == Some(130) {
        assert!(said.contains("fluxmorph resume"), "{said}");
        finish(&mut resume(&out)).completed();
    }
    assert_same(&essence(&files(&out)), &expected, "interrupted early");
}

#[test]
fn a_check_on_a_fresh_mesh_that_is_interrupted_is_made_up_for() {
    let home = folder();
    // A check so much finer that it takes longer than the run.
    let device = shipped("shield_quick", &["--set", "output.verify_refinement=2.5"]);
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join("out");
    let mut run = Timed::start(&mut device.command("run", &out));
    wait_until("the result before the check", || out.join("result.json").exists());
    run.answer("INT");
    let (code, said) = run.end();
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("not checked on a finer mesh") && said.contains("fluxmorph resume"), "{said}");
    finish(&mut resume(&out)).completed();
    assert_same(&essence(&files(&out)), &expected, "interrupted check");
}

#[test]
fn a_run_that_is_out_of_time_goes_on() {
    let home = folder();
    let device = block(home.path(), 12);
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join("out");
    // Time for the first evaluation alone.
    let first = finish(device.command("run", &out).args(["--max-time", "0.001 ms"]));
    first.with(1, &["all evaluations are saved", "fluxmorph resume"]);
    assert_eq!((rows(&out), &RunFolder(out.clone()).result()["stop_reason"]), (1, &"max_time".into()));
    // However short the time, a resumed run gets on.
    finish(&mut resume(&out)).with(1, &["all evaluations are saved"]);
    assert_eq!(rows(&out), 2);
    finish(resume(&out).args(["--max-time", "1 h"])).completed();
    assert_same(&essence(&files(&out)), &expected, "out of time");
}

/// Where nothing but the estimate of its error is left of a run, and a signal comes before that is done.
#[test]
fn an_estimate_after_the_search_that_is_interrupted_is_made_up_for() {
    let home = folder();
    let (mut config, source) = parsed(&changed(BLOCK, &[("max_evaluations = 6", "max_evaluations = 3")]));
    let disk = system_disk();
    config.output.verify_refinement = 1.0;
    config.output.directory = home.path().join("whole");
    let whole = run::run(&config, &source, options(&disk), &mut Silent).expect("it ends");
    let estimate = |result: &RunResult| result.accuracy.as_ref().and_then(|own| own.error_estimate);
    assert!(estimate(&whole).is_some());
    config.output.directory = home.path().join("cut");
    let signal = Cell::new(false);
    let interrupted = || signal.get();
    let searched = |_: &RunDirectory| {
        signal.set(true);
        None
    };
    let asking = Options { interrupted: &interrupted, searched: &searched, ..options(&disk) };
    let cut = run::run(&config, &source, asking, &mut Silent).expect("the search is complete");
    assert!(cut.status == RunStatus::Interrupted && estimate(&cut).is_none(), "{:?}", cut.status);
    let saved = SavedRun::open(&disk, &config.output.directory).expect("a run");
    let resumed = run::resume(&saved, RunLimits::default(), options(&disk), &mut Silent).expect("it ends");
    assert_eq!((resumed.objective, resumed.status), (whole.objective, whole.status));
}

/// Gives a signal as an estimate of the error begins.
struct AtEstimate<'a> {
    before: usize,
    signal: &'a Cell<bool>,
}

impl Observer for AtEstimate<'_> {
    fn phase(&mut self, name: &str) {
        if name == "estimating the error of the mesh" {
            self.signal.set(self.before == 0);
            self.before = self.before.saturating_sub(1);
        }
    }
}

impl RunObserver for AtEstimate<'_> {}

/// A signal within the estimate that a refinement follows from, before the search and after it: that refinement is not begun, and the
/// run that is resumed makes it.
#[test]
fn a_signal_while_the_mesh_is_refined_begins_no_further_refinement() {
    let edges = ("frequency = \"50 Hz\"", "frequency = \"50 Hz\"\nelements = \"edge\"");
    let tolerance = ("[output]", "[accuracy]\ntolerance = \"3.2 %\"\n\n[output]");
    let many = ("max_evaluations = 6", "max_evaluations = 60");
    let home = folder();
    let (mut config, source) = parsed(&changed(BLOCK, &[edges, tolerance, many]));
    let disk = system_disk();
    let evaluations_before = |out: &Path| -> Vec<u64> {
        let Ok(text) = std::fs::read_to_string(out.join("refinements.json")) else { return Vec::new() };
        let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let steps = json["refinements"].as_array().expect("a list").iter();
        steps.map(|step| step["evaluations"].as_u64().expect("a number")).collect()
    };
    config.output.directory = home.path().join("whole");
    let whole = run::run(&config, &source, options(&disk), &mut Silent).expect("it ends");
    let all = evaluations_before(&config.output.directory);
    println!("refinements after {all:?} evaluations");
    let before_search = all.iter().filter(|evaluations| **evaluations == 0).count();
    assert!(before_search > 0 && before_search < all.len(), "{all:?}");
    // The last estimate before the search is within the tolerance.
    for (before, made) in [(0, 0), (before_search + 1, before_search)] {
        let out = home.path().join(before.to_string());
        config.output.directory = out.clone();
        let signal = Cell::new(false);
        let interrupted = || signal.get();
        let asking = Options { interrupted: &interrupted, ..options(&disk) };
        let mut observer = AtEstimate { before, signal: &signal };
        match run::run(&config, &source, asking, &mut observer) {
            Ok(cut) => assert!(made > 0 && cut.status == RunStatus::Interrupted, "{:?}", cut.status),
            Err(error) => {
                assert!(matches!(error, Error::Optimizer(OptimizerError::InterruptedRun)) && made == 0)
            }
        }
        assert_eq!(evaluations_before(&out).len(), made);
        let saved = SavedRun::open(&disk, &out).expect("a run");
        let resumed =
            run::resume(&saved, RunLimits::default(), options(&disk), &mut Silent).expect("it ends");
        assert_eq!(evaluations_before(&out), all);
        assert_eq!(resumed.objective, whole.objective);
    }
}
