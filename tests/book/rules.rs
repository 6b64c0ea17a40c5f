//! Commands of the pages that are not run, or not always, and why.

use crate::repository;
use crate::support::repository_text;

/// Commands that take a minute or more wherever they stand, and those that resume what these leave.
const LONG: [&str; 2] = ["run configs/shield.toml", "resume configs/runs/shield"];

/// A kind of command that no test runs.
pub(crate) struct Rule {
    /// How such a command begins.
    begins: &'static str,
    /// Why it is not run; for the reader of this file.
    #[allow(dead_code, reason = "a rule without a reason is none")]
    reason: &'static str,
    exists: Exists,
}

/// How it is known that what a command calls exists.
enum Exists {
    /// Nothing of this repository is called.
    Elsewhere,
    /// The command, with `--locked` or without, is a step of this file.
    Step(&'static str),
    /// Its first argument is a target of the justfile.
    JustTarget,
    /// Its arguments that are no options are paths of the repository.
    Paths,
}

const fn rule(begins: &'static str, reason: &'static str, exists: Exists) -> Rule {
    Rule { begins, reason, exists }
}

const NEVER_RUN: [Rule; 13] = [
    rule("git clone ", "needs the address of the repository", Exists::Elsewhere),
    rule("cd fluxmorph", "the folder of the clone", Exists::Elsewhere),
    rule("cargo test --release --workspace", "is what runs this test", Exists::Step(".ci/run")),
    rule("cargo test ", "the test command with a filter", Exists::Elsewhere),
    rule("cargo install ", "compiles for minutes; see `just dist`", Exists::Elsewhere),
    rule("cargo build ", "compiles for minutes, and is built here", Exists::Elsewhere),
    rule("just ", "its targets are cargo commands over the tests", Exists::JustTarget),
    rule("paraview ", "a window, on what other commands make", Exists::Elsewhere),
    rule("pip install ", "the tests have their own Python below target/", Exists::Elsewhere),
    rule("mpirun ", "needs MPI; tests/mpi has it", Exists::Elsewhere),
    rule("sbatch ", "needs a cluster", Exists::Elsewhere),
    rule("tools/scale.py", "takes an hour, and needs MPI", Exists::Elsewhere),
    rule("mdbook ", "mdBook is not needed to read the book", Exists::Paths),
];

/// Whether a command takes a minute or more.
pub(crate) fn is_long(command: &str) -> bool {
    LONG.iter().any(|long| match command.split_once(long) {
        Some((_, rest)) => rest.is_empty() || rest.starts_with(' '),
        None => false,
    })
}

/// The rule by which a command is never run.
pub(crate) fn never_run(command: &str) -> Option<&'static Rule> {
    // `NAME=value command`
    let command = command.trim_start_matches(|c: char| c.is_ascii_uppercase() || c == '_');
    let command = match command.strip_prefix('=').and_then(|rest| rest.split_once(' ')) {
        Some((_, command)) => command,
        None => command,
    };
    NEVER_RUN.iter().find(|rule| command.starts_with(rule.begins) || command == rule.begins.trim_end())
}

impl Rule {
    /// What is wrong with a command that is not run.
    pub(crate) fn fault(&self, command: &str) -> Option<String> {
        let argument = command.split_whitespace().nth(1).unwrap_or_default();
        match self.exists {
            Exists::Elsewhere => None,
            Exists::Step(file) => {
                let text = repository_text(file);
                let stands = text.lines().any(|line| line.replace("--locked ", "").ends_with(command));
                (!stands).then(|| format!("`{command}` is no step of {file}"))
            }
            Exists::JustTarget => {
                let text = repository_text("justfile");
                let target =
                    |line: &str| line.split([' ', ':']).next() == Some(argument) && line.contains(':');
                let exists = argument.is_empty() || text.lines().any(target);
                (!exists).then(|| format!("`{argument}` is no target of the justfile"))
            }
            Exists::Paths => {
                let mut words = command.split_whitespace().skip(2).filter(|word| !word.starts_with('-'));
                let missing = words.find(|path| !repository(path).exists());
                missing.map(|path| format!("`{command}`: there is no {path}"))
            }
        }
    }
}

#[test]
fn what_is_never_run_is_checked() {
    let fault = |command: &str| never_run(command).expect("a rule").fault(command);
    assert_eq!(fault("just ci"), None);
    assert!(never_run("FLUXMORPH_RUN=a paraview --script=b").is_some());
    assert_eq!(fault("just fuzz msh22"), None);
    assert!(fault("just no-such-target").is_some());
    assert_eq!(fault("cargo test --release --workspace"), None);
}
