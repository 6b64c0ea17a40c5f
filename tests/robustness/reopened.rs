//! Run directories that something happened to before they are resumed.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::device::{Device, SATURATED, block, shipped, written};
use crate::support::essence::{Essence, assert_same, essence};
use crate::support::folder::{files, read_text};
use crate::support::program::{Finished, command, finish, folder, program, resume};
use crate::support::{changed, with_mesh_file};

const ALL: &str = "12";

/// A run of which three evaluations are done, and what the whole one leaves.
struct Begun {
    home: tempfile::TempDir,
    device: Device,
    out: PathBuf,
    expected: Essence,
}

fn begun(name: &str) -> Begun {
    let home = folder();
    let device = block(home.path(), 12);
    let (expected, _) = device.undisturbed(home.path());
    let out = home.path().join(name);
    finish(device.command("run", &out).args(["--max-evaluations", "3"])).completed();
    Begun { home, device, out, expected }
}

impl Begun {
    fn resumed(&self) -> Finished {
        finish(resume(&self.out).args(["--max-evaluations", ALL]))
    }

    /// It comes to the end of the undisturbed run.
    #[track_caller]
    fn goes_on(&self, context: &str) -> Finished {
        let ended = self.resumed().completed();
        assert_same(&essence(&files(&self.out)), &self.expected, context);
        ended
    }

    /// It is refused, and nothing is touched.
    #[track_caller]
    fn is_refused(&self, code: i32, fragments: &[&str]) {
        let before = files(&self.out);
        self.resumed().with(code, fragments);
        assert!(files(&self.out) == before, "a file was touched");
    }

    fn journal(&self) -> PathBuf {
        self.out.join("journal.jsonl")
    }

    fn edit(&self, name: &str, from: &str, to: &str) {
        let path = self.out.join(name);
        std::fs::write(&path, changed(&read_text(&path), &[(from, to)])).expect("written");
    }
}

#[test]
fn a_damaged_journal_goes_on_with_what_is_whole_or_is_refused() {
    let run = begun("out");
    let whole = std::fs::read(run.journal()).expect("a journal");
    let header = 1 + whole.iter().position(|&byte| byte == b'\n').expect("a header");
    let restored = |bytes: &[u8]| std::fs::write(run.journal(), bytes).expect("written");
    restored(&[]);
    run.is_refused(5, &["journal.jsonl` is damaged", "does not begin as a journal"]);
    restored(&whole[..header - 1]);
    run.is_refused(5, &["journal.jsonl` is damaged", "header"]);
    // Another version of the program, of which the checksum knows nothing.
    let version = env!("CARGO_PKG_VERSION").as_bytes();
    let at = whole.windows(version.len()).position(|bytes| bytes == version).expect("a version");
    let mut other = whole.clone();
    other[at] = b'9';
    restored(&other);
    run.is_refused(5, &["journal.jsonl` is damaged", "header"]);
    restored(b"PK\x03\x04 and so on");
    run.is_refused(5, &["journal.jsonl` is damaged"]);
    let mut random = fastrand::Rng::with_seed(3);
    let garbage: Vec<u8> = (0..5000).map(|_| random.u8(..)).collect();
    let cases: [(&str, Vec<u8>, &str); 4] = [
        ("the header alone", whole[..header].to_vec(), "resuming after 0 evaluations"),
        ("cut", whole[..whole.len() - 7].to_vec(), "are an incomplete record"),
        ("garbage behind", [&whole[..], &garbage].concat(), "is damaged after evaluation 2"),
        ("all records twice", [&whole[..], &whole[header..]].concat(), "is damaged after evaluation 2"),
    ];
    for (name, bytes, words) in cases {
        restored(&bytes);
        let said = run.goes_on(name).stderr;
        assert!(said.contains(words), "{name}: {said}");
        let kept = std::fs::read(run.out.join("journal.damaged.jsonl")).ok();
        assert_eq!(kept, words.starts_with("is damaged").then_some(bytes), "{name}");
        std::fs::remove_dir_all(&run.out).expect("removed");
        finish(run.device.command("run", &run.out).args(["--max-evaluations", "3"])).completed();
    }
    std::fs::remove_file(run.journal()).expect("there");
    run.goes_on("no journal");
}

#[test]
fn a_run_of_an_earlier_version_is_refused_and_may_be_replaced() {
    let run = begun("out");
    std::fs::rename(run.journal(), run.out.join("journal.bin")).expect("renamed");
    std::fs::write(run.out.join("history.jsonl"), "{}\n").expect("written");
    run.is_refused(3, &["journal.bin` is the journal of version", "start the run again with --force"]);
    finish(&mut command(&[&"report", &run.out])).with(3, &["journal.bin` is the journal of version"]);
    finish(run.device.command("run", &run.out).arg("--force")).completed();
    assert_same(&essence(&files(&run.out)), &run.expected, "replaced");
}

#[test]
fn another_configuration_is_refused_and_what_does_not_matter_is_not() {
    let run = begun("out");
    run.edit("config.toml", "b = [0.0, 0.0, 0.1]", "b = [0.0, 0.0, 0.2]");
    let changed = "`boundaries.uniform_field.b[2]` is not what it was";
    run.is_refused(3, &["journal.jsonl", "another configuration", "restore the config.toml", changed]);
    run.edit("config.toml", "b = [0.0, 0.0, 0.2]", "b = [0.0, 0.0,");
    run.is_refused(3, &["config.toml"]);
    run.edit("config.toml", "b = [0.0, 0.0,", "b = [0.0, 0.0, 0.1]");
    // The file that the run was started with has no say any more.
    std::fs::write(&run.device.config, "nonsense").expect("written");
    run.goes_on("restored");
}

#[test]
fn a_table_that_has_changed_is_refused() {
    let home = folder();
    let table = home.path().join("steel.csv");
    let text = "# H [A/m], B [T]\n100, 0.5\n1000, 1.5\n100000, 2.2\n";
    std::fs::write(&table, text).expect("written");
    let [(permeability, _), further @ ..] = SATURATED;
    let changes = [&[(permeability, "bh_file = \"steel.csv\"\n")], &further[..]].concat();
    let device = written("steel", home.path(), &changes);
    let out = home.path().join("out");
    let run = finish(device.command("run", &out).args(["--max-evaluations", "2"]));
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    let manifest = read_text(&out.join("manifest.json"));
    assert!(manifest.contains("steel.csv") && manifest.contains("\"tables\""), "{manifest}");
    std::fs::write(&table, text.replace("1.5", "1.50001")).expect("written");
    finish(resume(&out).args(["--max-evaluations", "4"])).with(3, &["other B–H tables", "restore it"]);
    // What is read counts, and a comment is read too.
    std::fs::write(&table, text).expect("written");
    let resumed = finish(resume(&out).args(["--max-evaluations", "4"]));
    assert_eq!(resumed.code, Some(1), "{}", resumed.stderr);
}

#[test]
fn a_mesh_file_that_has_changed_is_refused() {
    let home = folder();
    let solved = home.path().join("solved");
    let device = block(home.path(), 6);
    finish(device.command("run", &solved).args(["--set", "output.stl=[]"])).completed();
    let (mesh, config) = (home.path().join("block.msh"), home.path().join("meshed.toml"));
    std::fs::copy(solved.join("optimum.msh"), &mesh).expect("a mesh");
    std::fs::write(&config, with_mesh_file(&read_text(&device.config), "block.msh")).expect("written");
    let out = home.path().join("out");
    let run = finish(&mut command(&[&"run", &config, &"--out", &out, &"--max-evaluations", &"2"]));
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    let whole = std::fs::read_to_string(&mesh).expect("text");
    // Same topology, one node elsewhere by as little as can be written.
    let nodes = whole.find("$Nodes").expect("nodes");
    let corner = whole[nodes..]
        .lines()
        .find(|line| line.ends_with(" 40.0"))
        .expect("a node of the upper side")
        .to_owned();
    let other = corner.replace(" 40.0", " 40.0000000001");
    std::fs::write(&mesh, whole.replacen(&format!("\n{corner}\n"), &format!("\n{other}\n"), 1))
        .expect("written");
    finish(resume(&out).args(["--max-evaluations", "4"])).with(3, &["another mesh", "restore the mesh file"]);
    // One that does not suit the configuration is no error of that.
    std::fs::write(&mesh, whole.replace("\"face\"", "\"side\"")).expect("written");
    finish(resume(&out).args(["--max-evaluations", "4"])).with(3, &["another mesh", "restore the mesh file"]);
    std::fs::remove_file(&mesh).expect("there");
    let gone = finish(resume(&out).args(["--max-evaluations", "4"]));
    assert!(gone.code == Some(3) && gone.stderr.contains("block.msh"), "{:?}: {}", gone.code, gone.stderr);
    std::fs::write(&mesh, &whole).expect("written");
    finish(resume(&out).args(["--max-evaluations", "4"])).completed();
}

#[test]
fn what_is_no_interrupted_run_is_left_alone() {
    let run = begun("out");
    run.goes_on("first");
    // It has used up its evaluations: nothing is done, and the same result given.
    let before = files(&run.out);
    finish(&mut resume(&run.out)).with(1, &["nothing to resume", "--max-evaluations"]);
    assert!(files(&run.out) == before);
    let home = run.home.path();
    let solved = home.join("solved");
    finish(&mut run.device.command("solve", &solved)).with(0, &[]);
    finish(&mut resume(&solved)).with(3, &["holds a `solve`", "start it again"]);
    let (empty, foreign, file) = (home.join("empty"), home.join("foreign"), home.join("file"));
    std::fs::create_dir(&empty).expect("made");
    std::fs::create_dir(&foreign).expect("made");
    std::fs::write(foreign.join("manifest.json"), "{\"program\": \"other\"}").expect("written");
    std::fs::write(&file, "").expect("written");
    for path in [&empty, &foreign, &file, &home.join("absent")] {
        finish(&mut resume(path)).with(5, &["holds no run of fluxmorph"]);
    }
    // A pipe is not waited for.
    let piped = home.join("piped");
    std::fs::create_dir(&piped).expect("made");
    let made = Command::new("mkfifo").arg(piped.join("manifest.json")).status();
    assert!(made.expect("mkfifo is there").success());
    finish(&mut resume(&piped)).with(5, &["manifest.json`: it is no plain file"]);
}

/// The command that a message offers, given to a shell that finds this program first.
fn as_told(said: &str, folder: &Path, further: &str) -> Finished {
    let (_, rest) = said.split_once("fluxmorph resume ").expect("how to resume");
    // Up to the end of the message: a newline may be part of a name.
    let command =
        rest.trim_end().trim_end_matches('`').split(" --max-evaluations").next().expect("a command");
    let program = Path::new(env!("CARGO_BIN_EXE_fluxmorph")).parent().expect("a folder");
    let path = std::env::join_paths(
        std::iter::once(program.to_owned())
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    );
    let line = format!("fluxmorph resume {command} {further}");
    finish(Command::new("bash").args(["-c", &line]).current_dir(folder).env("PATH", path.expect("a path")))
}

#[test]
fn a_directory_of_any_name_is_gone_on_with_as_the_message_says() {
    let home = folder();
    let device = block(home.path(), 12);
    let (expected, _) = device.undisturbed(home.path());
    let long = "l".repeat(250);
    let deep = [long.as_str(); 12].join("/");
    let names = ["plain", "a b", "it's", "-dash", "two\nlines", "$(exit 9)", "a;b&c|d", "\"quoted\"", "Ω→"];
    for name in names.into_iter().chain(["it's \u{1b}[1m", "-\u{202e}\\"]).chain([long.as_str(), &deep]) {
        let mut run = device.command("run", Path::new(name));
        // Relative: the message is for whoever stands where the run was started.
        run = rebuilt(run, name);
        let first = finish(run.args(["--max-evaluations", "3"]).current_dir(home.path()));
        assert_eq!(first.code, Some(1), "{name}: {}", first.stderr);
        let again = as_told(&first.stderr, home.path(), "--max-evaluations 12");
        assert!(matches!(again.code, Some(0 | 1)), "{name}: {}", again.stderr);
        assert_same(&essence(&files(&home.path().join(name))), &expected, name);
    }
    // Longer than a name, and longer than a path, may be.
    for name in ["n".repeat(300), vec![long.as_str(); 20].join("/")] {
        finish(&mut device.command("run", &home.path().join(name))).with(5, &["error: cannot"]);
    }
}

/// The same command with `--out=NAME`: a name that begins with a dash is no option then.
fn rebuilt(command: Command, name: &str) -> Command {
    let mut arguments: Vec<_> = command.get_args().map(OsStr::to_owned).collect();
    let at = arguments.iter().position(|argument| argument == "--out").expect("there");
    arguments.splice(at..at + 2, [format!("--out={name}").into()]);
    let mut rebuilt = program();
    rebuilt.args(arguments);
    rebuilt
}

#[test]
fn a_directory_behind_a_link_or_without_a_readable_name_is_gone_on_with() {
    let run = begun("out");
    let link = run.home.path().join("link");
    std::os::unix::fs::symlink(&run.out, &link).expect("linked");
    finish(resume(&link).args(["--max-evaluations", ALL])).completed();
    assert_same(&essence(&files(&run.out)), &run.expected, "behind a link");
    let odd = run.home.path().join(OsStr::from_bytes(b"latin-1 \xe4"));
    let first = finish(run.device.command("run", &odd).args(["--max-evaluations", "3"])).completed();
    as_told(&first.stderr, run.home.path(), &format!("--max-evaluations {ALL}")).completed();
    assert_same(&essence(&files(&odd)), &run.expected, "without a readable name");
}

#[test]
fn a_mesh_is_found_from_wherever_a_run_is_gone_on_with() {
    // Paths are relative to the configuration's folder, as it was then.
    let home = folder();
    let device = shipped("shield_quick", &[]);
    let relative = device.config.file_name().expect("a name");
    let folder = device.config.parent().expect("a folder");
    let out = home.path().join("out");
    let mut run = command(&[&"run", &relative, &"--out", &out, &"--max-evaluations", &"2"]);
    finish(run.current_dir(folder)).completed();
    finish(resume(Path::new("out")).args(["--max-evaluations", "3"]).current_dir(home.path())).completed();
    assert_eq!(crate::support::folder::rows(&out), 3);
}
