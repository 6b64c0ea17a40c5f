//! The binary with a limit on its memory, and what must hold for every refusal.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use crate::msh_support::{Form, Version};

/// Memory of the promise for each byte of a mesh file, and beside them [bytes].
pub(crate) const PER_BYTE: u64 = 12;
pub(crate) const BESIDE: u64 = 64 << 20;

/// Longest time of a refusal. The machine of the tests may be loaded: what takes this long hangs.
const LONGEST: Duration = Duration::from_secs(10);

/// How a command ended, and what it wrote.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: Vec<u8>,
    pub(crate) stderr: String,
    pub(crate) wall: Duration,
}

/// Runs the binary on one thread with at most `bytes` of data; `None` for no limit.
///
/// The limit is that on data (`RLIMIT_DATA`): heap, stacks and writable mappings, but not the addresses that the
/// allocator reserves without using them.
pub(crate) fn limited(bytes: Option<u64>, arguments: &[&OsStr]) -> Ended {
    let limit = bytes.map_or("unlimited".to_owned(), |bytes| (bytes / 1024).to_string());
    let clock = Instant::now();
    let output = Command::new("sh")
        .args(["-c", "ulimit -d \"$1\" && shift && exec \"$@\"", "sh", &limit])
        .arg(env!("CARGO_BIN_EXE_fluxmorph"))
        .args(arguments)
        .args(["--threads", "1"])
        .env_remove("NO_COLOR")
        .env("RUST_BACKTRACE", "1")
        .stdin(Stdio::null())
        .output()
        .expect("a shell");
    let stderr = String::from_utf8(output.stderr).expect("messages are UTF-8, whatever the files hold");
    Ended { code: output.status.code(), stdout: output.stdout, stderr, wall: clock.elapsed() }
}

/// The least limit with which the smallest healthy mesh is checked [bytes]: what the program takes for itself.
pub(crate) fn baseline() -> u64 {
    static BASELINE: OnceLock<u64> = OnceLock::new();
    *BASELINE.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let bytes = crate::meshes::device().bytes(Version::V4, Form::Ascii);
        let config = crate::meshes::written(folder.path(), &bytes);
        least_limit(1 << 30, |limit| {
            limited(Some(limit), &["check".as_ref(), config.as_os_str()]).code == Some(0)
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

/// What is wrong with a refusal; `None` when it is as it must be.
pub(crate) fn objection(ended: &Ended, codes: &[i32], says: &[&str]) -> Option<String> {
    let stderr = &ended.stderr;
    let lower = stderr.to_lowercase();
    if !ended.code.is_some_and(|code| codes.contains(&code)) {
        return Some(format!("exit code {:?}, expected {codes:?}:\n{stderr}", ended.code));
    }
    if !ended.stdout.is_empty() {
        return Some("something on standard output".to_owned());
    }
    if let Some(word) =
        ["panicked", "backtrace", "internal error", "unwrap"].iter().find(|w| lower.contains(**w))
    {
        return Some(format!("`{word}` in:\n{stderr}"));
    }
    if let Some(c) = stderr.chars().find(|c| c.is_control() && *c != '\n') {
        return Some(format!("the control character {c:?} in:\n{stderr:?}"));
    }
    // A screen or two, whatever the length of the names in the file.
    if stderr.len() > 20_000 {
        return Some(format!("{} bytes of messages", stderr.len()));
    }
    if let Some(fragment) = says.iter().find(|fragment| !stderr.contains(**fragment)) {
        return Some(format!("no `{fragment}` in:\n{stderr}"));
    }
    (ended.wall > LONGEST).then(|| format!("took {:?}", ended.wall))
}

/// The arguments of `check` on a configuration.
pub(crate) fn check(config: &Path) -> [&OsStr; 2] {
    ["check".as_ref(), config.as_os_str()]
}

/// Asserts that a folder holds these files and nothing else.
#[track_caller]
pub(crate) fn assert_holds(folder: &Path, names: &[&str]) {
    let mut found: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    found.sort();
    assert_eq!(found, names);
}
