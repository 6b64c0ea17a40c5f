//! The table of inputs: one text file a group, one paragraph a case.
//!
//! ```text
//! # What the case is about; only where the edit does not say it.
//! on shield_quick.toml            the sound base of this and all following cases
//! - grid = [7, 13]                the first place of this text in the configuration, or else in the mesh file …
//! + grid = [7, «1»]               … becomes this, or nothing; marks stand around what must be underlined, and are taken out
//! set design.lower=«"1 m"»        an override of the command line
//! command run                     instead of `check`
//! error: `design.grid[1]` is 1    what is said, without the frame around the excerpt: the message,
//! ^ the label of the marked place
//! ~ text: the label of another place
//! = help: notes and advice
//! > design.grid[0] = 7            for a sound input: a value of the resolved configuration
//! warning: `steel` has …          … a part of a warning
//! no warning: turns               … what none of its warnings says; `no warning` alone: it has none
//! ```

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::program::write;
use crate::support::{repository, repository_text};

/// Where the sound bases lie.
const BASES: [&str; 5] = [
    "configs",
    "fuzz/seeds/config",
    "tests/config/bases",
    "tests/support",
    "crates/geometry/tests/msh_support",
];

/// How the lines of what is expected begin.
const EXPECTED: [&str; 8] = ["error: ", "^ ", "~ ", "= ", "|", "> ", "warning: ", "no warning"];

/// A test for each file of a folder of the table, by the function `holds` of the module, and one that finds all files.
macro_rules! groups {
    ($folder:literal: $($group:ident),+ $(,)?) => {
        const GROUPS: &[&str] = &[$(stringify!($group)),+];
        $(#[test]
        fn $group() {
            holds(stringify!($group));
        })+

        #[test]
        fn every_file_of_the_table_is_a_test() {
            assert_eq!($crate::case::names($folder), GROUPS.iter().copied().map(str::to_owned).collect());
        }
    };
}
pub(crate) use groups;

/// One input.
#[derive(Clone, Debug, Default)]
pub(crate) struct Case {
    /// File and line, for messages of the tests.
    pub(crate) at: String,
    base: String,
    /// From and to; `None` until a line of it is read.
    edits: Vec<(String, Option<String>)>,
    pub(crate) set: Vec<String>,
    pub(crate) command: String,
    /// Lines of what is expected.
    pub(crate) expected: Vec<String>,
}

/// Where the marks stood.
#[derive(Debug, PartialEq)]
pub(crate) struct Marked {
    pub(crate) file: String,
    /// From 1.
    pub(crate) line: usize,
    /// In characters, from 1; the text of an override is the line of TOML that it stands for, with columns of its own.
    pub(crate) column: Option<usize>,
    pub(crate) text: String,
}

/// Takes the marks out of a text; where they stood.
pub(crate) fn unmarked(file: &str, text: &str) -> (String, Option<Marked>) {
    let (Some(start), Some(end)) = (text.find('«'), text.find('»')) else { return (text.to_owned(), None) };
    let before = &text[..start];
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    let marked = Marked {
        file: file.to_owned(),
        line: before.matches('\n').count() + 1,
        column: Some(before[line_start..].chars().count() + 1),
        text: text[start + '«'.len_utf8()..end].to_owned(),
    };
    (text.replace(['«', '»'], ""), Some(marked))
}

fn is_expected(line: &str) -> bool {
    EXPECTED.iter().any(|start| line.starts_with(start))
}

/// The file of a group, such as `wrong/design`.
fn path_of(group: &str) -> PathBuf {
    repository("tests/config").join(format!("{group}.txt"))
}

/// The groups of a folder: the names of its files.
pub(crate) fn names(folder: &str) -> BTreeSet<String> {
    let files = fs::read_dir(repository("tests/config").join(folder)).expect("the table");
    files.map(|file| file.expect("a file").file_name().to_string_lossy().replace(".txt", "")).collect()
}

/// All cases of a group.
pub(crate) fn read(group: &str) -> Vec<Case> {
    let text = fs::read_to_string(path_of(group)).unwrap_or_else(|error| panic!("{group}: {error}"));
    let (mut base, mut cases, mut line) = (String::new(), Vec::new(), 1);
    for paragraph in text.split("\n\n") {
        let mut case = Case { at: format!("{group}.txt:{line}"), command: "check".into(), ..Case::default() };
        for text in paragraph.trim_end().lines() {
            case.take(text, &mut base);
        }
        if !case.expected.is_empty() || !case.edits.is_empty() || !case.set.is_empty() {
            cases.push(Case { base: base.clone(), ..case });
        }
        line += paragraph.matches('\n').count() + 2;
    }
    cases
}

/// Writes a group anew with other expectations, one list of lines a case.
pub(crate) fn overwrite(group: &str, expected: &[Vec<String>]) {
    let text = fs::read_to_string(path_of(group)).expect("it was read");
    let mut expected = expected.iter();
    let paragraph = |paragraph: &str| {
        let input: Vec<&str> = paragraph.trim_end().lines().filter(|line| !is_expected(line)).collect();
        let is_case = input.len() < paragraph.trim_end().lines().count()
            || input.iter().any(|line| line.starts_with('-') || line.starts_with("set "));
        let new = if is_case { expected.next().map_or(&[][..], Vec::as_slice) } else { &[] };
        input.into_iter().chain(new.iter().map(String::as_str)).collect::<Vec<_>>().join("\n")
    };
    let all: Vec<String> = text.split("\n\n").map(paragraph).collect();
    fs::write(path_of(group), all.join("\n\n") + "\n").expect("written");
}

impl Case {
    /// Takes in one line of a paragraph.
    fn take(&mut self, line: &str, base: &mut String) {
        let rest = |start: &str| line.strip_prefix(start).map(|rest| rest.strip_prefix(' ').unwrap_or(rest));
        if is_expected(line) {
            self.expected.push(line.to_owned());
        } else if let Some(name) = rest("on ") {
            name.clone_into(base);
        } else if let Some(set) = rest("set ") {
            self.set.push(set.to_owned());
        } else if let Some(command) = rest("command ") {
            command.clone_into(&mut self.command);
        } else if let Some(from) = rest("-") {
            match self.edits.last_mut() {
                Some((all, None)) => *all += &format!("\n{from}"),
                _ => self.edits.push((from.to_owned(), None)),
            }
        } else if let Some(more) = rest("+") {
            let (_, to) = self.edits.last_mut().unwrap_or_else(|| panic!("{}: no `-`", self.at));
            *to = Some(to.as_ref().map_or(more.to_owned(), |to| format!("{to}\n{more}")));
        } else {
            assert!(line.is_empty() || line.starts_with('#'), "{}: what is `{line}`?", self.at);
        }
    }

    /// Configuration and mesh file, with the edits made and the marks in.
    fn files(&self) -> (String, Option<String>) {
        let base = BASES.iter().map(|folder| format!("{folder}/{}", self.base));
        let base = base.into_iter().find(|path| repository(path).is_file());
        let base = repository_text(&base.unwrap_or_else(|| panic!("{}: no base `{}`", self.at, self.base)));
        let is_mesh = self.base.ends_with(".msh");
        let (mut config, mut mesh) = if is_mesh {
            (repository_text("tests/config/bases/of_file.toml"), base)
        } else {
            (base, String::new())
        };
        for (from, to) in &self.edits {
            let edited = if mesh.contains(from) { &mut mesh } else { &mut config };
            assert!(edited.contains(from), "{}: no `{from}`", self.at);
            *edited = edited.replacen(from, to.as_deref().unwrap_or_default(), 1);
        }
        (config, is_mesh.then_some(mesh))
    }

    /// The base alone: its name, and the case without its edits and overrides.
    pub(crate) fn sound(&self) -> (String, Self) {
        (self.base.clone(), Self { edits: Vec::new(), set: Vec::new(), ..self.clone() })
    }

    /// The configuration without marks.
    pub(crate) fn config(&self) -> String {
        unmarked("", &self.files().0).0
    }

    /// Writes `device.toml` and what it names into a folder; the place that must be underlined.
    pub(crate) fn write(&self, home: &Path) -> Option<Marked> {
        let (config, mesh) = self.files();
        if config.contains("\"meshes/") {
            fs::create_dir_all(home.join("meshes")).expect("made");
            for mesh in ["inductor.msh", "rotor.msh", "ball.msh"] {
                let mesh = Path::new("meshes").join(mesh);
                fs::copy(repository("configs").join(&mesh), home.join(&mesh)).expect("copied");
            }
        }
        let curve = "steel_team20.csv";
        if config.contains(curve) {
            fs::copy(repository("configs").join(curve), home.join(curve)).expect("copied");
        }
        let put = |name: &str, marked: &str| {
            let (text, place) = unmarked(name, marked);
            write(home, name, text);
            place
        };
        let of_config = put("device.toml", &config);
        let of_mesh = mesh.and_then(|mesh| put("device.msh", &mesh));
        let of_set = self.set.iter().find_map(|set| {
            let (bare, place) = unmarked("", set);
            place.map(|place| Marked { file: format!("--set '{bare}'"), column: None, ..place })
        });
        of_config.or(of_mesh).or(of_set)
    }

    /// The overrides as arguments.
    pub(crate) fn arguments(&self) -> Vec<String> {
        self.set.iter().flat_map(|set| ["--set".to_owned(), unmarked("", set).0]).collect()
    }
}
