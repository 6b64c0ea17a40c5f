//! Letters that act on a terminal, or hide or turn round others, come from no file to the screen.

use std::fs;

use crate::program::{is_hidden, limited, write};
use crate::support::device::BLOCK;
use crate::support::program::{Finished, folder};
use crate::support::repository_text;

/// C0, C1, marks of direction, letters without width, separators.
const HOSTILE: [&str; 9] = [
    "\u{1b}[2J",
    "\u{7f}",
    "\u{9b}31m",
    "\u{85}",
    "\u{202e}",
    "\u{2066}",
    "\u{200b}",
    "\u{feff}",
    "\u{2028}",
];

#[track_caller]
fn assert_shown(ended: &Finished, context: &str) {
    for text in [&ended.stdout, &ended.stderr] {
        assert!(!text.contains(is_hidden), "{context}: {text:?}");
    }
}

#[test]
fn of_a_configuration() {
    for letters in HOSTILE {
        let home = folder();
        // In a text, in a comment beside a fault, in the name of a key, and in an override.
        let quick = repository_text("configs/shield_quick.toml");
        for (from, to) in [
            ("Shield plate", letters.to_owned()),
            ("\"60 Hz\"", format!("\"60 mm\" # {letters}")),
            ("axis = \"z\"", format!("\"{letters}\" = 1")),
            ("name = \"coil\"", format!("name = \"{letters}\"\nwrong = 1")),
        ] {
            write(home.path(), "device.toml", quick.replacen(from, &to, 1));
            assert_shown(
                &limited(home.path(), None, &["check", "device.toml"]),
                &format!("{letters:?} in {to:?}"),
            );
        }
    }
}

#[test]
fn of_a_mesh() {
    let mesh = repository_text("crates/geometry/tests/msh_support/sound_v4.msh");
    let config = repository_text("tests/config/bases/of_file.toml").replace("face", "left|outside");
    for letters in HOSTILE {
        let home = folder();
        write(home.path(), "device.toml", &config);
        write(home.path(), "device.msh", mesh.replacen("\"left\"", &format!("\"left{letters}\""), 1));
        for further in [&[][..], &["--json"]] {
            let ended = limited(home.path(), None, &[&["check", "device.toml"], further].concat());
            assert_shown(&ended, &format!("{letters:?}"));
        }
    }
}

#[test]
fn of_a_run_directory() {
    let home = folder();
    write(home.path(), "device.toml", BLOCK);
    limited(home.path(), None, &["run", "device.toml", "--out", "out", "--quiet", "--max-evaluations", "2"]);
    for name in ["result.json", "manifest.json", "journal.jsonl", "config.toml", "history.csv"] {
        let path = home.path().join("out").join(name);
        let whole = fs::read_to_string(&path).expect("a file of the run");
        for letters in HOSTILE {
            for word in ["stopped", "max_evaluations", "direct_single", "run", "iron", "version"] {
                fs::write(&path, whole.replace(word, &format!("{word}{letters}"))).expect("written");
                for command in [&["report", "out"][..], &["resume", "out", "--max-evaluations", "2"]] {
                    let ended = limited(home.path(), None, command);
                    assert_shown(&ended, &format!("{letters:?} behind {word} in {name}"));
                }
            }
        }
        fs::write(&path, whole).expect("written");
    }
}
