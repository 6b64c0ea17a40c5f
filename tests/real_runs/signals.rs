//! Signals, timed: the first is answered at once and obeyed after the evaluation in hand, the second at once.
//!
//! Times are measured from here, and include what the machine needs to wake three processes. Where it is loaded, the best
//! of a few trials counts; the bound itself is never widened.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use crate::device::files;
use crate::device::{Device, block, endless, shipped, slow};
use crate::essence::{assert_same, essence};
use crate::process::{end_of, ended, fluxmorph, resume, rows, send, wait_until};
use crate::whole::{Logs, torn};

/// The answer to the first signal.
const MESSAGE: Duration = Duration::from_millis(100);

/// The end after the second signal.
const SECOND: Duration = Duration::from_secs(1);

/// Trials of which the best counts.
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

    /// How long the answer to a signal took.
    pub(crate) fn answer(&mut self, signal: &str) -> Duration {
        let pulled = Trigger::new(signal, &self.child).pull();
        loop {
            let (at, line) = self.lines.recv_timeout(Duration::from_secs(60)).expect("an answer");
            let is_answer = line.contains("once more to leave at once");
            self.said.push(line);
            if is_answer {
                return at.saturating_duration_since(pulled);
            }
        }
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
    let before = rows(out);
    let answer = run.answer(signal);
    let (code, said) = run.end();
    assert_eq!(code, Some(if signal == "INT" { 130 } else { 143 }), "{said}");
    assert!(said.contains(&format!("fluxmorph resume {}", out.display())), "{said}");
    assert_eq!(torn(&files(out), Logs::AreWhole), Vec::<String>::new());
    (answer, rows(out) - before)
}

/// One run with two signals: how long the answer to the first and the end after the second took.
pub(crate) fn second_signal(command: &mut Command, begun: impl Fn() -> bool) -> (Duration, Duration) {
    let mut run = Timed::start(command);
    wait_until("the work", begun);
    let answer = run.answer("INT");
    let (end, code) = run.end_after("INT");
    assert_eq!(code, Some(130));
    (answer, end)
}

/// The best of a few trials.
fn best<T: PartialOrd>(bound: &T, mut trial: impl FnMut(usize) -> T) -> T {
    let mut least = trial(0);
    for number in 1..TRIALS {
        if least <= *bound {
            break;
        }
        let next = trial(number);
        least = if next < least { next } else { least };
    }
    least
}

#[test]
fn the_first_signal_is_answered_at_once_and_the_run_ends_with_its_state_saved() {
    let home = tempfile::tempdir().expect("a temporary folder");
    for signal in ["INT", "TERM"] {
        let answer = best(&MESSAGE, |trial| {
            first_signal(&endless(), &home.path().join(format!("{signal}_{trial}")), signal).0
        });
        assert!(answer <= MESSAGE, "{signal}: {answer:?}");
    }
}

#[test]
fn a_run_ends_after_the_evaluation_in_hand() {
    let home = tempfile::tempdir().expect("a temporary folder");
    // Evaluations so long that the signal is there before the next one.
    let (_, evaluations) = first_signal(&slow(home.path()), &home.path().join("out"), "INT");
    assert!(evaluations <= 1, "{evaluations}");
}

#[test]
fn the_second_signal_ends_a_run_at_once_and_it_can_be_gone_on_with() {
    let home = tempfile::tempdir().expect("a temporary folder");
    let device = slow(home.path()).with("optimizer.max_evaluations=2");
    let mut out = home.path().to_owned();
    let (answer, end) = best(&(MESSAGE, SECOND), |trial| {
        out = home.path().join(format!("out_{trial}"));
        second_signal(&mut device.command("run", &out), || out.join("journal.jsonl").exists())
    });
    assert!(answer <= MESSAGE && end <= SECOND, "{answer:?}, {end:?}");
    assert_eq!(torn(&files(&out), Logs::MayBeCut), Vec::<String>::new());
    ended(&mut resume(&out)).completed();
    let (expected, _) = device.undisturbed(home.path());
    assert_same(&essence(&files(&out)), &expected, "left at once");
}

#[test]
fn a_single_solve_is_finished_and_a_second_signal_leaves_it() {
    let home = tempfile::tempdir().expect("a temporary folder");
    let (device, out) = (slow(home.path()), home.path().join("out"));
    let mut solve = Timed::start(&mut device.command("solve", &out));
    wait_until("the manifest", || out.join("manifest.json").exists());
    solve.answer("TERM");
    let (code, said) = solve.end();
    assert_eq!(code, Some(143), "{said}");
    assert!(out.join("result.json").exists());
    let again = home.path().join("again");
    let (answer, end) = best(&(MESSAGE, SECOND), |trial| {
        let out = again.join(trial.to_string());
        second_signal(&mut device.command("solve", &out), || out.join("manifest.json").exists())
    });
    assert!(answer <= MESSAGE && end <= SECOND, "{answer:?}, {end:?}");
    // It is done in one go, and says so.
    ended(&mut resume(&again.join("0"))).with(3, &["holds a `solve`", "start it again"]);
}

#[test]
fn a_gradient_ends_after_the_evaluation_in_hand() {
    let home = tempfile::tempdir().expect("a temporary folder");
    let mut gradient = Timed::start(&mut fluxmorph(&[&"gradient", &slow(home.path()).config]));
    // Past the start of the process, where signals still have their default.
    std::thread::sleep(Duration::from_millis(300));
    gradient.answer("INT");
    let (code, said) = gradient.end();
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("interrupted before there was anything to keep"), "{said}");
}

#[test]
fn a_signal_during_the_set_up_or_the_approach_leaves_nothing() {
    let home = tempfile::tempdir().expect("a temporary folder");
    // Its first design lies many rounds away.
    let far = slow(home.path()).with("design.initial=\"3.5 mm\"").with("remesh.inversion_share=0.05");
    for (device, wait) in [(slow(home.path()), 100), (far, 1000)] {
        let out = home.path().join("out");
        let mut run = Timed::start(&mut device.command("run", &out));
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
    let home = tempfile::tempdir().expect("a temporary folder");
    let device = block(home.path(), 6);
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join("out");
    let run = Timed::start(&mut device.command("run", &out));
    wait_until("the manifest", || out.join("manifest.json").exists());
    send("INT", &run.child);
    let (code, said) = run.end();
    if code == Some(130) {
        assert!(said.contains("fluxmorph resume"), "{said}");
        ended(&mut resume(&out)).completed();
    }
    assert_same(&essence(&files(&out)), &expected, "interrupted early");
}

#[test]
fn a_check_on_a_fresh_mesh_that_is_interrupted_is_made_up_for() {
    let home = tempfile::tempdir().expect("a temporary folder");
    // A check so much finer that it takes longer than the run.
    let device = shipped("shield_quick", &["--set", "output.verify_refinement=2.5"]);
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join("out");
    let mut run = Timed::start(&mut device.command("run", &out));
    wait_until("the result before the check", || out.join("result.json").exists());
    run.answer("INT");
    let (code, said) = run.end();
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("not checked on a fresh mesh") && said.contains("fluxmorph resume"), "{said}");
    ended(&mut resume(&out)).completed();
    assert_same(&essence(&files(&out)), &expected, "interrupted check");
}

#[test]
fn a_run_that_is_out_of_time_goes_on() {
    let home = tempfile::tempdir().expect("a temporary folder");
    let device = block(home.path(), 12);
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join("out");
    // Time for the first evaluation alone.
    let first = ended(device.command("run", &out).args(["--max-time", "0.001 ms"]));
    first.with(1, &["all evaluations are saved", "fluxmorph resume"]);
    assert_eq!(rows(&out), 1);
    ended(resume(&out).args(["--max-time", "1 h"])).completed();
    assert_same(&essence(&files(&out)), &expected, "out of time");
}
