//! `kill -9` at random moments, again and again, until the run is done.

use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use crate::support::device::{Device, SATURATED, block, shipped, written};
use crate::support::essence::{assert_same, essence};
use crate::support::folder::files;
use crate::support::program::{end_of, finish, folder, resume, send};
use crate::support::whole::{Logs, torn};

const SIGKILL: i32 = 9;

/// What came of the kills.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    /// Processes killed while they worked.
    pub(crate) kills: usize,
    /// Of these, `resume` and not `run`.
    pub(crate) of_resumes: usize,
    /// Runs brought to their end.
    pub(crate) runs: usize,
    /// Kills so early that the run was started again.
    pub(crate) started_again: usize,
    /// Most kills that one run took.
    pub(crate) most: usize,
}

/// Kills runs of a device until there are so many kills; every run ends as the undisturbed one.
pub(crate) fn torture(device: &Device, home: &Path, kills: usize, seed: u64) -> Tally {
    let (expected, duration) = device.undisturbed(home);
    let mut random = fastrand::Rng::with_seed(seed);
    let mut tally = Tally::default();
    // Whatever the machine does meanwhile, some kills hit a resumed run.
    while tally.kills < kills || tally.of_resumes == 0 {
        let out = home.join(format!("run_{}", tally.runs));
        let before = tally.kills;
        loop {
            let context = format!("{}, run {}, kill {}", device.name, tally.runs, tally.kills);
            let begun = out.join("config.toml").exists();
            let mut command = if begun { resume(&out) } else { device.command("run", &out) };
            // A resumption may use other threads.
            command.args(["--threads", ["1", "2", "4"][random.usize(..3)]]);
            if !begun && out.join("manifest.json").exists() {
                command.arg("--force");
            }
            let mut child = command.stderr(Stdio::null()).spawn().expect("the program starts");
            // Uniform over a whole run: early and late moments, and one in a few comes to the end.
            std::thread::sleep(Duration::from_secs_f64(random.f64() * duration.as_secs_f64()));
            let _ = child.kill();
            let status = end_of(&mut child);
            let found = if out.exists() { files(&out) } else { Default::default() };
            assert_eq!(torn(&found, Logs::MayBeCut), Vec::<String>::new(), "{context}");
            if status.signal() == Some(SIGKILL) {
                tally.kills += 1;
                tally.of_resumes += usize::from(begun);
                tally.started_again += usize::from(!out.join("config.toml").exists());
            } else {
                assert!(matches!(status.code(), Some(0 | 1)), "{context}: {status}");
                break;
            }
        }
        assert_same(&essence(&files(&out)), &expected, device.name);
        tally.runs += 1;
        tally.most = tally.most.max(tally.kills - before);
        std::fs::remove_dir_all(&out).expect("removed");
    }
    tally
}

#[test]
fn a_run_that_is_killed_again_and_again_ends_as_if_it_had_not_been() {
    let home = folder();
    torture(&block(home.path(), 12), home.path(), 8, 1);
}

/// Nearly all of the time of such a run is in Newton's method.
#[test]
fn a_run_that_is_killed_within_newtons_method_ends_as_if_it_had_not_been() {
    let home = folder();
    let cells = ("cells = [2, 2, 1]", "cells = [4, 4, 2]");
    let [steel, field, force, at_rest] = SATURATED;
    let device = written("saturated", home.path(), &[steel, field, force, at_rest, cells]);
    torture(&device, home.path(), 6, 2);
}

#[test]
fn a_terminal_that_is_closed_loses_nothing() {
    let home = folder();
    let device = shipped("shield_quick", &["--set", "output.fields=every"])
        .with("optimizer.max_evaluations=6")
        .with("output.verify_refinement=0");
    let (expected, duration) = device.undisturbed(home.path());
    let out = home.path().join("out");
    let mut child = device.command("run", &out).stderr(Stdio::null()).spawn().expect("the program starts");
    std::thread::sleep(duration / 2);
    // A run that was done before is a run all the same.
    send("HUP", child.id());
    end_of(&mut child);
    if out.join("config.toml").exists() {
        finish(&mut resume(&out)).completed();
    } else {
        finish(device.command("run", &out).arg("--force")).completed();
    }
    assert_same(&essence(&files(&out)), &expected, "hung up");
}
