//! Runs the blocks of a page in a copy of the project's files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::sync::OnceLock;

use tempfile::TempDir;

use crate::page::{Block, Command, Page};
use crate::{repository, rules};

/// Which blocks are run.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extent {
    /// Those that take seconds and need nothing.
    Short,
    /// All whose tools exist.
    All,
}

/// What came of a page.
#[derive(Default)]
pub(crate) struct Outcome {
    pub(crate) run: usize,
    pub(crate) left_out: usize,
    pub(crate) faults: Vec<String>,
}

/// What a reader has before them, and what of it a page may change.
const FILES: [&str; 6] =
    ["configs", "docs/device", "docs/device_own", "examples/python", "examples/paraview", "tools"];

/// Runs the blocks of a page in order, and compares the files that it quotes.
pub(crate) fn run_page(page: &Page, extent: Extent) -> Outcome {
    let mut outcome = Outcome::default();
    let mut place: Option<Place> = None;
    for block in &page.blocks {
        let at = format!("{}:{}", page.path, block.line);
        let unknown = block.unknown_flags();
        if !unknown.is_empty() {
            outcome.faults.push(format!("{at}: unknown words {unknown:?} behind the language"));
        }
        if block.file().is_none() && block.commands().is_empty() {
            continue;
        }
        let place = place.get_or_insert_with(Place::new);
        if let Some(file) = block.file() {
            outcome.faults.extend(place.take_file(file, block).map(|fault| format!("{at}: {fault}")));
        }
        if let Some(reason) = left_out(block, extent) {
            println!("{at}: left out, {reason}");
            outcome.left_out += block.commands().len();
            continue;
        }
        for command in block.commands() {
            if rules::never_run(&command.text).is_some()
                || extent == Extent::Short && rules::is_long(&command.text)
            {
                outcome.left_out += 1;
                continue;
            }
            outcome.run += 1;
            let fault = place.run(&command, block.tools().contains(&"pyvista"));
            outcome.faults.extend(fault.map(|fault| format!("{}:{}: {fault}", page.path, command.line)));
        }
        // Another release of Gmsh makes another mesh, with other numbers behind it.
        place.own_mesh |= block.tools().contains(&"gmsh");
    }
    outcome
}

fn left_out(block: &Block, extent: Extent) -> Option<String> {
    if extent == Extent::Short {
        return (block.is_long() || !block.tools().is_empty())
            .then(|| "it is for `just test-long`".to_owned());
    }
    let missing = block.tools().into_iter().find(|tool| match *tool {
        "pyvista" => python().is_none(),
        tool => !exists(tool),
    });
    missing.map(|tool| format!("there is no {tool} on this machine"))
}

fn exists(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

/// A Python with what `examples/python` needs.
fn python() -> Option<&'static Path> {
    static PYTHON: OnceLock<Option<PathBuf>> = OnceLock::new();
    PYTHON.get_or_init(installed_python).as_deref()
}

/// Installs it below the target directory, unless it is there already.
fn installed_python() -> Option<PathBuf> {
    let environment = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book-python");
    let python = environment.join("bin/python");
    let works = |command: &mut Process| command.output().is_ok_and(|output| output.status.success());
    if works(Process::new(&python).args(["-c", "import pandas, pyvista"])) {
        return Some(python);
    }
    let packages = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "pandas", "pyvista"];
    let installed = works(Process::new("python3").args(["-m", "venv"]).arg(&environment))
        && works(Process::new(&python).args(packages));
    installed.then_some(python)
}

/// The folder in which the commands of a page run.
struct Place {
    home: TempDir,
    /// Working directory; `cd` changes it.
    folder: PathBuf,
    /// Whether the reader has made a mesh that is not the one in the repository.
    own_mesh: bool,
}

impl Place {
    fn new() -> Self {
        let home = tempfile::tempdir().expect("a temporary folder");
        let folder = home.path().join("fluxmorph");
        for path in FILES {
            if repository(path).exists() {
                copy(&repository(path), &folder.join(path));
            }
        }
        let programs = home.path().join("bin");
        fs::create_dir_all(&programs).expect("a temporary folder can be written");
        let binary = env!("CARGO_BIN_EXE_fluxmorph");
        std::os::unix::fs::symlink(binary, programs.join("fluxmorph")).expect("a link");
        // `cargo run --release -- …` is the program that this test was built with.
        let cargo = "#!/bin/sh\n\
                     if [ \"$1 $2 $3\" != \"run --release --\" ]; then echo \"cargo $*: not run\" >&2; exit 99; fi\n\
                     shift 3\nexec fluxmorph \"$@\"\n";
        write_program(&programs.join("cargo"), cargo);
        Self { home, folder, own_mesh: false }
    }

    /// A file of the repository must have the content of the block; another one gets it.
    fn take_file(&self, file: &str, block: &Block) -> Option<String> {
        let content: String = block.lines.iter().map(|line| format!("{line}\n")).collect();
        let path = self.folder.join(file);
        match fs::read_to_string(&path) {
            Ok(known) if known == content => None,
            Ok(_) => Some(format!("the block is not what {file} holds")),
            Err(_) => {
                fs::create_dir_all(path.parent().expect("a file in a folder")).expect("a folder");
                fs::write(&path, content).expect("a temporary file");
                None
            }
        }
    }

    /// Runs a command; what is wrong with how it ended or what it printed.
    fn run(&mut self, command: &Command, own_python: bool) -> Option<String> {
        if let Some(folder) = command.text.strip_prefix("cd ") {
            self.folder.push(folder.trim());
            return (!self.folder.is_dir()).then(|| format!("there is no folder {folder}"));
        }
        let programs = self.home.path().join("bin");
        if own_python && let Some(python) = python() {
            write_program(
                &programs.join("python3"),
                &format!("#!/bin/sh\nexec '{}' \"$@\"\n", python.display()),
            );
        }
        let known = std::env::var_os("PATH").unwrap_or_default();
        let paths = [programs].into_iter().chain(std::env::split_paths(&known));
        let paths = std::env::join_paths(paths).expect("paths without colons");
        let run = || {
            Process::new("sh")
                .args(["-c", &format!("{} 2>&1", grouped(&command.text))])
                .current_dir(&self.folder)
                .env("PATH", &paths)
                .env("NO_COLOR", "1")
                .stdin(Stdio::null())
                .output()
                .expect("a shell")
        };
        let mut output = run();
        // Two X servers that start at once may want the same number.
        for _ in 0..4 {
            if output.status.success() || !command.text.starts_with("xvfb-run ") {
                break;
            }
            output = run();
        }
        let text = String::from_utf8_lossy(&output.stdout);
        if output.status.code() != Some(command.exit_code) {
            let expected = command.exit_code;
            return Some(format!("`{}`: {}, expected {expected}:\n{text}", command.text, output.status));
        }
        let expected = command.prints.as_ref()?;
        let printed: Vec<&str> = text.lines().collect();
        let agrees = self.own_mesh || matches(&trimmed(expected), &printed);
        (!agrees).then(|| format!("`{}`: expected\n{}\nprinted\n{text}", command.text, expected.join("\n")))
    }
}

/// All commands of a line in one group, so that the messages of every one are caught.
fn grouped(command: &str) -> String {
    format!("{{ {command}\n}}")
}

/// Without empty lines at the end, which only part it from the next command.
fn trimmed(lines: &[String]) -> Vec<&str> {
    let end = lines.iter().rposition(|line| !line.trim().is_empty()).map_or(0, |last| last + 1);
    lines[..end].iter().map(String::as_str).collect()
}

/// Whether lines are as expected; a line `...` stands for any number of lines.
fn matches(expected: &[&str], printed: &[&str]) -> bool {
    match (expected.split_first(), printed.split_first()) {
        (None, _) => printed.iter().all(|line| line.trim().is_empty()),
        (Some((&"...", rest)), _) => (0..=printed.len()).any(|skipped| matches(rest, &printed[skipped..])),
        (Some((line, rest)), Some((first, others))) => line_matches(line, first) && matches(rest, others),
        (Some(_), None) => false,
    }
}

/// Whether a line is as expected; `...` stands for any text, and any number of blanks is one.
fn line_matches(expected: &str, line: &str) -> bool {
    let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
    let parts: Vec<String> =
        expected.split("...").map(|part| part.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    let (first, rest) = parts.split_first().expect("a split has a part");
    let Some((last, inner)) = rest.split_last() else { return *first == line };
    let Some(mut line) = line.strip_prefix(first.as_str()) else { return false };
    for part in inner {
        let Some(at) = line.find(part.as_str()) else { return false };
        line = &line[at + part.len()..];
    }
    line.ends_with(last.as_str())
}

fn write_program(path: &Path, text: &str) {
    use std::os::unix::fs::PermissionsExt;
    fs::write(path, text).expect("a temporary file");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("own files");
}

/// Copies a folder or file, without the results of runs.
fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).expect("a temporary folder");
        for entry in fs::read_dir(from).expect("a folder of the repository") {
            let name = entry.expect("a folder of the repository").file_name();
            if name != "runs" && name != "__pycache__" {
                copy(&from.join(&name), &to.join(&name));
            }
        }
    } else {
        fs::create_dir_all(to.parent().expect("a file in a folder")).expect("a temporary folder");
        fs::copy(from, to).unwrap_or_else(|error| panic!("{}: {error}", from.display()));
    }
}

#[test]
fn dots_stand_for_text_and_lines() {
    assert!(matches(&["a ... c", "...", "end"], &["a b c", "x", "y", "end", ""]));
    assert!(matches(&["..."], &[]));
    assert!(!matches(&["a"], &["a", "b"]));
    assert!(!matches(&["a", "...", "end"], &["a", "b"]));
    assert!(line_matches("F ... x ... z", "F 1 x 2 z"));
    assert!(line_matches("F/F0  0.5 ... kept ...", " F/F0 0.5 1 kept "));
    assert!(!line_matches("F/F0", "F/F0 0.5"));
    assert!(!line_matches("F ... x ... z", "F 1 y 2 z"));
}
