//! On a terminal: the bar, the colours, and what is left behind. Needs a pseudo-terminal, which `script` of util-linux
//! makes; skipped without.

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use snapbox::Data;
use snapbox::data::DataFormat;

use super::tiny;

/// What arrives on a terminal of 110 columns, where Ctrl-C is pressed as soon as a text has come (never for an empty one),
/// and the exit code; `None` where there is no such `script`.
fn on_terminal(
    folder: &Path,
    term: &str,
    interrupt_after: &str,
    arguments: &[&str],
) -> Option<(String, i32)> {
    let program = [env!("CARGO_BIN_EXE_fluxmorph")].into_iter().chain(arguments.iter().copied());
    let program: Vec<String> = program.map(|word| format!("'{word}'")).collect();
    let line = format!("stty cols 110 rows 30; exec {}", program.join(" "));
    let child = Command::new("script")
        .args(["--quiet", "--flush", "--return", "--command", &line, "/dev/null"])
        .current_dir(folder)
        .envs([("TERM", term), ("SHELL", "/bin/sh")])
        .env_remove("NO_COLOR")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let Ok(mut child) = child else {
        eprintln!("skipped: there is no `script`");
        return None;
    };
    let mut keyboard = child.stdin.take().expect("a pipe");
    let mut screen = child.stdout.take().expect("a pipe");
    let (mut bytes, mut buffer, mut is_waiting) = (Vec::new(), [0; 4096], !interrupt_after.is_empty());
    while let Ok(count @ 1..) = screen.read(&mut buffer) {
        bytes.extend_from_slice(&buffer[..count]);
        if is_waiting && String::from_utf8_lossy(&bytes).contains(interrupt_after) {
            keyboard.write_all(b"\x03").expect("the terminal listens");
            is_waiting = false;
        }
    }
    let code = child.wait().expect("it ends").code().expect("it is not killed");
    Some((String::from_utf8_lossy(&bytes).into_owned(), code))
}

/// What stands on the screen after these bytes: of every line what was written since it was cleared.
fn screen(bytes: &str) -> String {
    let shown = |line: &str| line.rsplit("\u{1b}[2K").next().unwrap_or_default().to_owned();
    bytes.replace("\r\n", "\n").split('\n').map(shown).collect::<Vec<_>>().join("\n").replace('\r', "")
}

#[test]
#[ignore = "writes docs/images/terminal.svg: just screenshot-terminal"]
fn draw_the_terminal() {
    let folder = env!("CARGO_MANIFEST_DIR");
    let arguments = ["run", "configs/shield_quick.toml", "--force"];
    let (bytes, code) = on_terminal(Path::new(folder), "xterm-256color", "", &arguments).expect("a terminal");
    assert_eq!(code, 1, "{bytes}");
    // A picture says nothing of the machine that it was made on.
    let bytes = bytes.replace(&format!("{folder}/"), "");
    let at = bytes.find("3/5 [").expect("a bar");
    let length = bytes[at..].find('\r').expect("it is cleared");
    let titled =
        |title: &str, bytes: &str| format!("\u{1b}[2m{title}\u{1b}[0m\n{}\n", screen(bytes).trim_end());
    let prompt = "\u{1b}[32m$\u{1b}[0m fluxmorph run configs/shield_quick.toml\n\n";
    let [middle, end] = [("after three evaluations", &bytes[..at + length]), ("at the end", &bytes)]
        .map(|(title, bytes)| titled(title, bytes));
    let picture = Data::text(format!("{prompt}{middle}\n{end}")).coerce_to(DataFormat::TermSvg);
    let path = Path::new(folder).join("docs/images/terminal.svg");
    picture.write_to_path(&path).expect("the picture can be written");
}

#[test]
#[ignore = "needs a pseudo-terminal"]
fn a_bar_is_shown_and_taken_away() {
    let folder = tiny();
    let Some((text, code)) = on_terminal(folder.path(), "xterm-256color", "", &["run", "tiny.toml"]) else {
        return;
    };
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("/2 [=====     ] F/F0 1.0000  quality "), "{text}");
    assert!(text.contains("\u{1b}[1m\u{1b}[33mall evaluations are used\u{1b}[0m"), "{text}");
    // After the last bar the line is cleared, the cursor was never hidden, and the summary follows.
    let (_, end) = text.rsplit_once("/2 [").expect("a bar");
    assert!(end.contains("\r\u{1b}[2K") && end.contains("F/F0"), "{end}");
    assert!(!text.contains("\u{1b}[?25l"), "{text}");
}

#[test]
#[ignore = "needs a pseudo-terminal"]
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
#[ignore = "needs a pseudo-terminal"]
fn a_signal_takes_the_bar_away_for_good() {
    let folder = tiny();
    let arguments = ["run", "tiny.toml", "--max-evaluations", "5000", "--set", "optimizer.ftol_rel=0"];
    let Some((text, code)) = on_terminal(folder.path(), "xterm-256color", "2/5000", &arguments) else {
        return;
    };
    assert_eq!(code, 130, "{text}");
    let (_, end) = text.split_once("finishing the current work").expect("it is reported");
    assert!(!end.contains("/5000 [") && end.contains("resume with"), "{end}");
}

#[test]
#[ignore = "needs a pseudo-terminal"]
fn an_error_leaves_no_bar() {
    let folder = tiny();
    let arguments = ["run", "tiny.toml", "--set", "coils=[]"];
    let Some((text, code)) = on_terminal(folder.path(), "xterm-256color", "", &arguments) else { return };
    assert_eq!(code, 3, "{text}");
    let (bar, end) = text.rsplit_once("error").expect("an error");
    let bar = bar.trim_end_matches("\u{1b}[91m").trim_end_matches("\u{1b}[1m");
    assert!(bar.ends_with("\r\u{1b}[2K") || bar.ends_with('\n'), "{text:?}");
    assert!(!end.contains("/2 ["), "{end}");
}
