//! The binary, with limits on its memory and computing time, and what must hold for every refusal.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use crate::support::program::{Finished, finish, folder};
use crate::support::repository_text;

/// Memory that a refusal may take beside that of the program itself and the bytes of a mesh file [bytes].
pub(crate) const BESIDE: u64 = 64 << 20;

/// Longest computing time of a command [s]: what takes this long hangs. Other load on the machine does not count.
const LONGEST: u32 = 60;

/// Writes a file into a folder; its path.
pub(crate) fn write(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, content).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    path
}

/// Runs the binary in a folder, on one thread, with at most `bytes` of data; `None` for no limit.
///
/// The limit is that on data (`RLIMIT_DATA`): heap, stacks and writable mappings, but not the addresses that the
/// allocator reserves without using them.
pub(crate) fn limited(home: &Path, bytes: Option<u64>, arguments: &[impl AsRef<OsStr>]) -> Finished {
    let memory = bytes.map_or("unlimited".to_owned(), |bytes| (bytes / 1024).to_string());
    let mut command = Command::new("sh");
    command
        .args(["-c", "ulimit -d \"$1\" && ulimit -t \"$2\" && shift 2 && exec \"$@\"", "sh", &memory])
        .arg(LONGEST.to_string())
        .arg(env!("CARGO_BIN_EXE_fluxmorph"))
        .args(arguments)
        .args(["--threads", "1"])
        .current_dir(home)
        .env_remove("NO_COLOR")
        .env("RUST_BACKTRACE", "1")
        .stdin(Stdio::null());
    finish(&mut command)
}

/// Runs `check device.toml` in a folder with the memory that a configuration may take, and further arguments.
pub(crate) fn check(home: &Path, further: &[&str]) -> Finished {
    limited(home, Some(baseline() + 4 * BESIDE), &[&["check", "device.toml"], further].concat())
}

/// The least limit with which a sound mesh of two tetrahedra is checked [bytes]: what the program takes for itself.
pub(crate) fn baseline() -> u64 {
    static BASELINE: OnceLock<u64> = OnceLock::new();
    *BASELINE.get_or_init(|| {
        let home = folder();
        write(home.path(), "device.msh", repository_text("crates/geometry/tests/msh_support/sound_v4.msh"));
        write(
            home.path(),
            "device.toml",
            repository_text("tests/config/bases/of_file.toml").replace("face", "left|outside"),
        );
        least_limit(1 << 30, |limit| {
            limited(home.path(), Some(limit), &["check", "device.toml"]).code == Some(0)
        })
    })
}

/// The least limit that suffices, to 1 MiB, at most `most` [bytes].
pub(crate) fn least_limit(most: u64, suffices: impl Fn(u64) -> bool) -> u64 {
    let (mut low, mut high) = (0, most >> 20);
    assert!(suffices(most), "{most} bytes do not suffice");
    while high - low > 1 {
        let middle = u64::midpoint(low, high);
        if suffices(middle << 20) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high << 20
}

/// Whether a letter acts on a terminal, or hides or turns round others.
pub(crate) fn is_hidden(letter: char) -> bool {
    letter != '\n'
        && (letter.is_control()
            || matches!(letter, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}'))
}

impl Finished {
    /// What is wrong with a refusal of this exit code that says these words; `None` when it is as it must be.
    pub(crate) fn objection(&self, code: i32, says: &[&str]) -> Option<String> {
        let stderr = &self.stderr;
        let lower = stderr.to_lowercase();
        if self.code != Some(code) {
            return Some(format!("exit code {:?}, expected {code}:\n{stderr}", self.code));
        }
        if !self.stdout.is_empty() {
            return Some("something on standard output".to_owned());
        }
        if let Some(word) =
            ["panicked", "backtrace", "internal error", "unwrap"].iter().find(|word| lower.contains(**word))
        {
            return Some(format!("`{word}` in:\n{stderr}"));
        }
        if let Some(c) = stderr.chars().find(|c| is_hidden(*c)) {
            return Some(format!("the control character {c:?} in:\n{stderr:?}"));
        }
        // A screen or two, whatever the length of the names in the file.
        if stderr.len() > 20_000 {
            return Some(format!("{} bytes of messages", stderr.len()));
        }
        says.iter().find(|word| !stderr.contains(**word)).map(|word| format!("no `{word}` in:\n{stderr}"))
    }

    /// Asserts a refusal of this exit code that says these words.
    #[track_caller]
    pub(crate) fn refuses(&self, code: i32, says: &[&str]) {
        if let Some(objection) = self.objection(code, says) {
            panic!("{objection}");
        }
    }

    /// Asserts success.
    #[track_caller]
    pub(crate) fn succeeds(&self) {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
    }
}

/// Asserts that a folder holds these files, in the order of their names, and nothing else.
#[track_caller]
pub(crate) fn assert_holds(folder: &Path, names: &[&str]) {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let mut found: Vec<String> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
    found.sort();
    assert_eq!(found, names);
}
