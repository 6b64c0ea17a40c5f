//! Disks that are full, or let files grow to a limit only.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::device::{Device, block};
use crate::support::essence::{Essence, assert_same, essence};
use crate::support::folder::files;
use crate::support::program::{Finished, finish, folder, resume};
use crate::support::whole::{Logs, torn};

/// What came of the full disks.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    /// Disks that filled up in a run.
    pub(crate) full: usize,
    /// Of these, runs that `resume` went on with; the others were started again, having nothing yet.
    pub(crate) resumed: usize,
    /// Disks on which all had room.
    pub(crate) with_room: usize,
}

/// A small disk in memory, where the system lets this user mount one.
pub(crate) struct Mounted(PathBuf);

impl Mounted {
    pub(crate) fn new(at: &Path, options: &str) -> Option<Self> {
        std::fs::create_dir_all(at).expect("made");
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(at).output();
        mount.is_ok_and(|output| output.status.success()).then(|| Self(at.to_owned()))
    }

    /// Gives it other options, as its owner who frees some space.
    pub(crate) fn remount(&self, options: &str) {
        let options = format!("remount,{options}");
        let status = Command::new("mount").args(["-o", &options]).arg(&self.0).status();
        assert!(status.expect("mount is there").success());
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// A run that found no room names a file and ends with 5; given room it is resumed, and ends as the undisturbed one.
fn recovered(
    device: &Device,
    out: &Path,
    first: Finished,
    expected: &Essence,
    context: &str,
    make_room: impl FnOnce(),
) -> Tally {
    let mut tally = Tally::default();
    if matches!(first.code, Some(0 | 1)) {
        tally.with_room = 1;
    } else {
        assert_eq!(first.code, Some(5), "{context}: {}", first.stderr);
        assert!(first.stderr.contains(&format!("`{}", out.display())), "{context}: {}", first.stderr);
        let found = if out.exists() { files(out) } else { Default::default() };
        assert_eq!(torn(&found, Logs::AreWhole), Vec::<String>::new(), "{context}");
        make_room();
        tally.full = 1;
        if finish(&mut resume(out)).code.is_some_and(|code| code <= 1) {
            tally.resumed = 1;
        } else {
            finish(device.command("run", out).arg("--force")).completed();
        }
    }
    assert_same(&essence(&files(out)), expected, context);
    tally
}

fn add(tally: &mut Tally, more: Tally) {
    tally.full += more.full;
    tally.resumed += more.resumed;
    tally.with_room += more.with_room;
}

/// Runs on disks of growing sizes, or with growing numbers of files, until one has room for all; `None` where nothing can
/// be mounted.
pub(crate) fn full_disks(device: &Device, home: &Path, option: &str, sizes: &[usize]) -> Option<Tally> {
    let (expected, _) = device.undisturbed(home);
    let mut tally = Tally::default();
    for size in sizes {
        let disk = Mounted::new(&home.join(format!("{option}_{size}")), &format!("{option}={size}"))?;
        let out = disk.0.join("out");
        let context = format!("{} on a disk with {option}={size}", device.name);
        let first = finish(&mut device.command("run", &out));
        let more = recovered(device, &out, first, &expected, &context, || {
            disk.remount(&format!("{option}={}", if option == "size" { 1 << 28 } else { 100_000 }));
        });
        add(&mut tally, more);
        if more.with_room == 1 {
            break;
        }
    }
    Some(tally)
}

/// The same with a limit on the size of every file, in blocks of 512 bytes: nobody needs a right for that.
pub(crate) fn limited_files(device: &Device, home: &Path, blocks: &[usize]) -> Tally {
    let (expected, _) = device.undisturbed(home);
    let mut tally = Tally::default();
    for blocks in blocks {
        let out = home.join(format!("limit_{blocks}"));
        let context = format!("{} with files of up to {blocks} blocks", device.name);
        let run = device.command("run", &out);
        let mut limited = Command::new("sh");
        limited.arg("-c").arg(format!("ulimit -f {blocks}; exec \"$0\" \"$@\""));
        limited.arg(run.get_program()).args(run.get_args());
        add(&mut tally, recovered(device, &out, finish(&mut limited), &expected, &context, || {}));
    }
    tally
}

#[test]
fn a_file_that_may_not_grow_ends_a_run_with_five_and_loses_nothing() {
    let home = folder();
    let tally = limited_files(&block(home.path(), 12), home.path(), &[1, 4, 12]);
    assert!(tally.full >= 2 && tally.resumed >= 1, "{tally:?}");
}

#[test]
fn standard_error_that_takes_nothing_does_not_end_a_run() {
    let home = folder();
    let device = block(home.path(), 6);
    let (expected, _) = device.undisturbed(home.path());
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").ok();
    let (reader, closed) = std::io::pipe().expect("a pipe");
    drop(reader);
    let outlets = [Some(std::process::Stdio::from(closed)), full().map(std::process::Stdio::from)];
    for (number, outlet) in outlets.into_iter().flatten().enumerate() {
        let out = home.path().join(number.to_string());
        let status = device.command("run", &out).stderr(outlet).status().expect("the program starts");
        assert_eq!(status.code(), Some(1), "{number}");
        assert_same(&essence(&files(&out)), &expected, "nobody listens");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_link_to_a_full_device_is_replaced_and_not_written_to() {
    let home = folder();
    let device = block(home.path(), 12);
    let (expected, _) = device.undisturbed(home.path());
    for name in ["history.csv", "fields.pvd", "fields/eval_0001.vtu", "journal.jsonl"] {
        let out = home.path().join("out");
        finish(device.command("run", &out).args(["--max-evaluations", "3"])).completed();
        std::fs::remove_file(out.join(name)).expect("there");
        std::os::unix::fs::symlink("/dev/full", out.join(name)).expect("linked");
        let again = finish(resume(&out).args(["--max-evaluations", "12"]));
        if name == "journal.jsonl" {
            // What it held is gone; to read the device would take all memory.
            again.with(5, &["journal.jsonl", "no plain file"]);
        } else if name.ends_with(".vtu") {
            again.completed();
        } else {
            again.completed();
            assert_same(&essence(&files(&out)), &expected, name);
        }
        std::fs::remove_dir_all(&out).expect("removed");
    }
}
