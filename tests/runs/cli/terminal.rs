//! On a terminal: the bar, the colours, and what is left behind. Needs python3 for a pseudo-terminal; skipped without.

use std::path::Path;
use std::process::{Command, Stdio};

use super::tiny;
use crate::support::repository;

/// What arrives on a terminal of 110 columns, and the exit code; `None` where there is no python3.
fn on_terminal(
    folder: &Path,
    term: &str,
    interrupt_after: &str,
    arguments: &[&str],
) -> Option<(String, i32)> {
    let output = Command::new("python3")
        .arg(repository("tools/terminal.py"))
        .args(["--raw", "--interrupt-at", interrupt_after, "--", env!("CARGO_BIN_EXE_fluxmorph")])
        .args(arguments)
        .current_dir(folder)
        .env("TERM", term)
        .env_remove("NO_COLOR")
        .stdin(Stdio::null())
        .output();
    match output {
        Ok(output) => {
            let code = output.status.code().expect("it is not killed");
            Some((String::from_utf8_lossy(&output.stdout).into_owned(), code))
        }
        Err(error) => {
            eprintln!("skipped: python3 does not start: {error}");
            None
        }
    }
}

#[test]
#[ignore = "needs python3"]
fn a_bar_is_shown_and_taken_away() {
    let folder = tiny();
    let Some((text, code)) = on_terminal(folder.path(), "xterm-256color", "", &["run", "tiny.toml"]) else {
        return;
    };
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("/2 [=====     ] F/F0 1.0000  quality "), "{text}");
    assert!(text.contains("\u{1b}[1;33mall evaluations are used\u{1b}[0m"), "{text}");
    // After the last bar the line is cleared, the cursor was never hidden, and the summary follows.
    let (_, end) = text.rsplit_once("/2 [").expect("a bar");
    assert!(end.contains("\r\u{1b}[2K") && end.contains("F/F0"), "{end}");
    assert!(!text.contains("\u{1b}[?25l"), "{text}");
}

#[test]
#[ignore = "needs python3"]
fn a_dumb_terminal_has_plain_lines() {
    let folder = tiny();
    for (term, progress) in [("dumb", "auto"), ("dumb", "bar"), ("xterm-256color", "plain")] {
        let arguments = ["run", "tiny.toml", "--force", "--progress", progress];
        let Some((text, _)) = on_terminal(folder.path(), term, "", &arguments) else { return };
        assert!(text.contains("setting up mesh and matrices ...") && !text.contains("/2 ["), "{text}");
        assert_eq!(text.contains('\u{1b}'), term != "dumb", "{text}");
    }
}

#[test]
#[ignore = "needs python3"]
fn a_signal_takes_the_bar_away_for_good() {
    let folder = tiny();
    let arguments = ["run", "tiny.toml", "--max-evaluations", "5000", "--set", "optimizer.ftol_rel=0"];
    let Some((text, code)) = on_terminal(folder.path(), "xterm-256color", "2/5000", &arguments) else {
        return;
    };
    assert_eq!(code, 130, "{text}");
    let (_, end) = text.split_once("finishing the evaluation in hand").expect("it is told");
    assert!(!end.contains("/5000 [") && end.contains("go on with"), "{end}");
}

#[test]
#[ignore = "needs python3"]
fn an_error_leaves_no_bar() {
    let folder = tiny();
    let arguments = ["run", "tiny.toml", "--set", "coils=[]"];
    let Some((text, code)) = on_terminal(folder.path(), "xterm-256color", "", &arguments) else { return };
    assert_eq!(code, 4, "{text}");
    let (bar, end) = text.rsplit_once("error").expect("an error");
    assert!(bar.ends_with("\r\u{1b}[2K") || bar.ends_with('\n') || bar.ends_with("[0m"), "{text}");
    assert!(!end.contains("/2 ["), "{end}");
}
