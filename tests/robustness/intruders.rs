//! Other processes and people at work in the same directory.

use std::path::Path;
use std::process::{Child, Stdio};

use crate::disks::Mounted;
use crate::support::device::{block, endless, slow};
use crate::support::essence::{assert_same, essence};
use crate::support::folder::{files, rows};
use crate::support::program::{end_of, finish, folder, resume, send, wait_until};

/// Waits for some evaluations of a run that is still going.
fn under_way(out: &Path, child: Child) -> Child {
    wait_until("two evaluations", || rows(out) > 1);
    child
}

#[test]
fn a_directory_in_use_is_refused_to_others_even_while_its_run_stands_still() {
    let home = folder();
    let (device, out) = (endless(), home.path().join("out"));
    let run = device.command("run", &out).stderr(Stdio::null()).spawn().expect("the program starts");
    let mut run = under_way(&out, run);
    let in_use = ["/out` is written by another process of fluxmorph", "wait for it or stop it"];
    for signal in ["CONT", "STOP"] {
        send(signal, run.id());
        finish(&mut resume(&out)).with(5, &in_use);
        for command in ["run", "solve"] {
            finish(device.command(command, &out).arg("--force")).with(5, &in_use);
            finish(&mut device.command(command, &out)).with(5, &["holds an earlier run"]);
        }
    }
    send("CONT", run.id());
    send("TERM", run.id());
    assert_eq!(end_of(&mut run).code(), Some(143));
    // Nothing of it was touched, and nobody holds it any more.
    let rows = rows(&out);
    let further = ["--max-evaluations", &(rows + 3).to_string()];
    finish(resume(&out).args(further)).completed();
    assert_eq!(crate::support::folder::rows(&out), rows + 3);
}

#[test]
fn a_run_that_stood_still_for_a_while_is_the_same_run() {
    let home = folder();
    let device = slow(home.path()).with("optimizer.max_evaluations=3").with("output.fields=none");
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join("out");
    let mut run = device.command("run", &out).stderr(Stdio::null()).spawn().expect("the program starts");
    wait_until("an evaluation", || rows(&out) > 0);
    for _ in 0..3 {
        send("STOP", run.id());
        std::thread::sleep(std::time::Duration::from_millis(50));
        send("CONT", run.id());
    }
    assert!(matches!(end_of(&mut run).code(), Some(0 | 1)));
    assert_same(&essence(&files(&out)), &expected, "stopped and continued");
}

#[test]
fn a_directory_that_is_removed_meanwhile_ends_the_run_with_five() {
    let home = folder();
    let (device, out) = (endless().with("output.fields=every"), home.path().join("out"));
    let run = device.command("run", &out).stderr(Stdio::piped()).spawn().expect("the program starts");
    let run = under_way(&out, run);
    // The run may make a file while its folder is being emptied.
    wait_until("the removal", || std::fs::remove_dir_all(&out).is_ok() || !out.exists());
    let output = run.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert!(
        said.contains(&format!("`{}` is no longer the folder in which this run began", out.display())),
        "{said}"
    );
    assert!(!said.contains("resume with"), "there is nothing left: {said}");
}

#[test]
fn a_directory_that_is_moved_meanwhile_is_gone_on_with_elsewhere() {
    let home = folder();
    let device = slow(home.path()).with("optimizer.max_evaluations=4").with("output.fields=every");
    let (expected, _) = device.undisturbed(home.path());
    let (out, moved) = (home.path().join("out"), home.path().join("moved"));
    let mut run = device.command("run", &out).stderr(Stdio::null()).spawn().expect("the program starts");
    wait_until("an evaluation", || rows(&out) > 0);
    std::fs::rename(&out, &moved).expect("moved");
    // What another run writes there stays its own.
    std::fs::create_dir(&out)
        .and_then(|()| std::fs::write(out.join("result.json"), "another's"))
        .expect("written");
    assert_eq!(end_of(&mut run).code(), Some(5));
    let files_there = files(&out);
    assert!(files_there.len() == 1 && std::fs::read(out.join("result.json")).expect("there") == b"another's");
    // The configuration may have gone as well: the run has its own.
    std::fs::remove_file(&device.config).expect("removed");
    finish(&mut resume(&moved)).completed();
    assert_same(&essence(&files(&moved)), &expected, "moved");
}

#[test]
fn a_disk_that_turns_read_only_ends_the_run_with_five_and_loses_nothing() {
    let home = folder();
    let Some(disk) = Mounted::new(&home.path().join("disk"), "size=64m") else {
        println!("nothing can be mounted here: left out");
        return;
    };
    let device = slow(home.path()).with("optimizer.max_evaluations=4").with("output.fields=none");
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join("disk/out");
    let run = device.command("run", &out).stderr(Stdio::piped()).spawn().expect("the program starts");
    wait_until("an evaluation", || rows(&out) > 0);
    // A journal that is open for writing keeps the disk from turning: as an administrator would, lazily.
    let turned = std::process::Command::new("mount")
        .args(["-o", "remount,ro"])
        .arg(home.path().join("disk"))
        .output()
        .expect("mount is there");
    let output = run.wait_with_output().expect("it ends");
    if turned.status.success() {
        assert_eq!(output.status.code(), Some(5), "{}", String::from_utf8_lossy(&output.stderr));
        disk.remount("rw");
        finish(&mut resume(&out)).completed();
    }
    // Read-only from the start.
    assert_same(&essence(&files(&out)), &expected, "read-only");
    disk.remount("ro");
    for command in ["run", "solve"] {
        let said = finish(device.command(command, &home.path().join("disk/other")).arg("--force"));
        said.with(5, &["disk/other", "choose a directory you may write to"]);
    }
    disk.remount("rw");
}

#[test]
fn a_folder_without_the_right_to_write_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let home = folder();
    let (device, closed) = (block(home.path(), 12), home.path().join("closed"));
    let (expected, _) = device.undisturbed(home.path());
    let out = closed.join("out");
    finish(device.command("run", &out).args(["--max-evaluations", "3"])).completed();
    let rights = |path: &Path, mode: u32| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).expect("ours");
    };
    rights(&out, 0o555);
    let is_bound = std::fs::write(out.join("probe"), "").is_err();
    if is_bound {
        finish(resume(&out).args(["--max-evaluations", "12"])).with(5, &["closed/out"]);
        rights(&closed, 0o555);
        finish(&mut device.command("run", &closed.join("new"))).with(5, &["closed/new"]);
        rights(&closed, 0o755);
    } else {
        println!("this user may write everywhere: left out");
        std::fs::remove_file(out.join("probe")).expect("removed");
    }
    rights(&out, 0o755);
    finish(resume(&out).args(["--max-evaluations", "12"])).completed();
    assert_same(&essence(&files(&out)), &expected, "closed and opened");
}
