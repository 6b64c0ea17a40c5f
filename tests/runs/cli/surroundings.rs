//! Closed pipes, full disks, names that are no UTF-8, colours.

use std::io::Read;
use std::process::Stdio;

use super::tiny;
use crate::support::folder::read_json;
use crate::support::program::{finish, fluxmorph_in, program};

#[test]
fn a_reader_that_has_enough_is_no_error() {
    let folder = tiny();
    let commands: [&[&str]; 6] = [
        &["--help"],
        &["run", "--help"],
        &["check", "tiny.toml"],
        &["check", "tiny.toml", "--json"],
        &["generate", "man"],
        &["generate", "completions", "zsh"],
    ];
    for arguments in commands {
        let mut command = program();
        command.args(arguments).current_dir(folder.path()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        // As `head -c 0`: the pipe is closed before anything is read.
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().expect("a pipe").read_to_string(&mut stderr).expect("text");
        let code = child.wait().expect("it ends").code();
        assert_eq!((code, stderr.contains("error")), (Some(0), false), "{arguments:?}: {stderr}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_behind_standard_output_is_told() {
    let folder = tiny();
    let json = &["check", "tiny.toml", "--json"];
    for arguments in [&["check", "tiny.toml"][..], json, &["generate", "man"], &["run", "--help"]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        finish(program().args(arguments).current_dir(folder.path()).stdout(full))
            .with(5, &["cannot write to `standard output`"]);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_run_whose_result_cannot_be_printed_loses_nothing_else() {
    let folder = tiny();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    finish(program().args(["run", "tiny.toml", "--json"]).current_dir(folder.path()).stdout(full))
        .with(5, &["report: ", "cannot write to `standard output`"]);
    let out = folder.path().join("runs/tiny");
    assert!(out.join("report.html").is_file() && out.join("result.json").is_file());
    assert_eq!(read_json(&out.join("manifest.json"))["status"], "stopped");
}

#[test]
fn the_environment_asks_for_no_more_threads_than_the_command_line_may() {
    let folder = tiny();
    for arguments in [&["check", "tiny.toml"][..], &["run", "tiny.toml"], &["generate", "man"]] {
        finish(program().args(arguments).current_dir(folder.path()).env("RAYON_NUM_THREADS", "5000"))
            .with(2, &["RAYON_NUM_THREADS asks for 5000 threads", "at most 1024"]);
    }
    assert!(!folder.path().join("runs").exists());
    finish(program().args(["check", "tiny.toml"]).current_dir(folder.path()).env("RAYON_NUM_THREADS", "2"))
        .exits_with(0);
}

#[test]
#[cfg(unix)]
fn names_that_are_no_utf_8_are_names_or_refused() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::OsStrExt;

    let folder = tiny();
    let odd = OsStr::from_bytes(b"pl\xe4te.toml");
    std::fs::copy(folder.path().join("tiny.toml"), folder.path().join(odd)).expect("copied");
    let cases: [(&[&OsStr], i32); 8] = [
        (&["check".as_ref(), odd], 0),
        (&["check".as_ref(), OsStr::from_bytes(b"\xff\xfe")], 5),
        (&["resume".as_ref(), OsStr::from_bytes(b"\xff")], 5),
        (&["run".as_ref(), odd, "--out".as_ref(), OsStr::from_bytes(b"out\xe4"), "--quiet".as_ref()], 1),
        (&["init".as_ref(), odd], 2),
        (&["init".as_ref(), "x".as_ref(), "--out".as_ref(), OsStr::from_bytes(b"in\xe4")], 0),
        (&["run".as_ref(), "tiny.toml".as_ref(), "--set".as_ref(), OsStr::from_bytes(b"a=\xff")], 2),
        (&[OsStr::from_bytes(b"r\xfcn")], 2),
    ];
    for (arguments, code) in cases {
        let finished = fluxmorph_in(folder.path(), arguments);
        let arguments: Vec<OsString> = arguments.iter().map(|&argument| argument.to_owned()).collect();
        assert_eq!(finished.code, Some(code), "{arguments:?}: {}", finished.stderr);
        assert!(!finished.stderr.contains("a fault of the program itself"), "{}", finished.stderr);
    }
}

#[test]
fn nothing_is_coloured_off_a_terminal() {
    let folder = tiny();
    let commands: [&[&str]; 5] = [
        &["--help"],
        &["walk"],
        &["check", "absent.toml"],
        &["check", "tiny.toml", "--set", "analysis.frequency=x"],
        &["solve", "tiny.toml", "--progress", "bar", "--force"],
    ];
    for arguments in commands {
        for (name, value) in
            [("NO_COLOR", ""), ("NO_COLOR", "1"), ("TERM", "xterm-256color"), ("TERM", "dumb")]
        {
            let finished = finish(program().args(arguments).current_dir(folder.path()).env(name, value));
            let text = finished.stdout + &finished.stderr;
            assert!(!text.contains('\u{1b}') && !text.is_empty(), "{arguments:?} {name}={value}: {text}");
        }
    }
}

#[test]
fn json_is_one_value_and_progress_does_not_touch_it() {
    let folder = tiny();
    let commands: [(&[&str], &str); 5] = [
        (&["check", "tiny.toml"], "title"),
        (&["solve", "tiny.toml", "--out", "s"], "objective"),
        (&["run", "tiny.toml", "--out", "r", "--progress", "plain"], "objective"),
        (&["morph", "motion.toml", "--out", "m", "--progress", "bar"], "cases"),
        (&["gradient", "tiny.toml"], "directions"),
    ];
    for (arguments, key) in commands {
        let json = fluxmorph_in(folder.path(), &[arguments, &["--json"]].concat()).json();
        assert!(json.get(key).is_some(), "{arguments:?}: {json}");
        if let [_, _, "--out", out, ..] = arguments {
            assert_eq!(json, read_json(&folder.path().join(out).join("result.json")), "{arguments:?}");
        }
    }
    let plain = fluxmorph_in(folder.path(), &["run", "tiny.toml"]);
    assert!(plain.stdout.is_empty(), "progress belongs to standard error: {}", plain.stdout);
    assert!(plain.stderr.contains("Tiny plate"), "{}", plain.stderr);
}
