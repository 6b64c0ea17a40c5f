//! One broken configuration: a good one with small edits, and the place that must be underlined.
//!
//! In the text that an edit puts in, `«` and `»` stand around that place and are taken out before the file is written.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

/// What is edited.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Base {
    /// A shipped configuration, with its mesh file where it has one.
    Shipped(&'static str),
    /// A text of the test.
    Own(&'static str),
}

/// A broken configuration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    /// What is wrong.
    pub(crate) name: &'static str,
    pub(crate) base: Base,
    /// Parts of the configuration, each there, and what takes the place of the first of its kind.
    pub(crate) edits: &'static [(&'static str, &'static str)],
    /// Overrides; marks may stand here as well.
    pub(crate) set: &'static [&'static str],
    /// The mesh file `device.msh` beside the configuration, with marks.
    pub(crate) mesh: Option<(&'static str, &'static [(&'static str, &'static str)])>,
    /// Faults reported.
    pub(crate) faults: usize,
}

/// A case with one fault in a configuration.
pub(crate) const fn case(
    name: &'static str,
    base: Base,
    edits: &'static [(&'static str, &'static str)],
) -> Case {
    Case { name, base, edits, set: &[], mesh: None, faults: 1 }
}

/// Where the marks stood.
#[derive(Debug, PartialEq)]
struct Marked {
    file: String,
    /// From 1.
    line: usize,
    /// In characters, from 1.
    column: usize,
    text: String,
}

impl Case {
    /// The same with more faults than one, the first of which is marked.
    pub(crate) const fn with(self, faults: usize) -> Self {
        Self { faults, ..self }
    }

    /// The same with edits of the configuration beside a mesh file.
    pub(crate) const fn in_config(self, edits: &'static [(&'static str, &'static str)]) -> Self {
        Self { edits, ..self }
    }
}

/// What a case showed.
pub(crate) struct Shown {
    /// Standard error, with the folder left out of paths.
    pub(crate) text: String,
    /// Whether the marked place is the first that is underlined; why not, if not.
    pub(crate) points: Result<(), String>,
}

/// Takes the marks out of a text; where they stood.
fn unmarked(file: &str, text: &str) -> (String, Option<Marked>) {
    let (Some(start), Some(end)) = (text.find('«'), text.find('»')) else { return (text.to_owned(), None) };
    let before = &text[..start];
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    let marked = Marked {
        file: file.to_owned(),
        line: before.matches('\n').count() + 1,
        column: before[line_start..].chars().count() + 1,
        text: text[start + '«'.len_utf8()..end].to_owned(),
    };
    (text.replace(['«', '»'], ""), Some(marked))
}

fn edited(mut text: String, edits: &[(&str, &str)], name: &str) -> String {
    for (from, to) in edits {
        assert!(text.contains(from), "{name}: no `{from}`");
        text = text.replacen(from, to, 1);
    }
    text
}

pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

impl Case {
    /// Runs `fluxmorph check` on the case.
    pub(crate) fn shown(&self) -> Shown {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let marked = self.write(&folder);
        let mut command = Command::new(env!("CARGO_BIN_EXE_fluxmorph"));
        command.args(["check", "device.toml"]).current_dir(folder.path()).stdin(Stdio::null());
        command
            .env_remove("NO_COLOR")
            .args(self.set.iter().flat_map(|set| ["--set".to_owned(), unmarked("", set).0]));
        let output = command.output().expect("the binary starts");
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        let home = folder.path().canonicalize().expect("it is there");
        let text = stderr
            .replace(&format!("{}/", home.display()), "")
            .replace(&format!("{}/", folder.path().display()), "");
        assert_eq!(output.status.code(), Some(3), "{}:\n{text}", self.name);
        assert!(output.stdout.is_empty(), "{}", self.name);
        assert!(!text.contains("panicked") && !text.contains('\u{1b}'), "{}:\n{text}", self.name);
        let count = text.matches("error: ").count();
        assert_eq!(count, self.faults, "{}: one edit, one fault\n{text}", self.name);
        let points = points_at(&text, &marked);
        Shown { text, points }
    }

    /// Writes the files; the place that must be underlined.
    fn write(&self, folder: &TempDir) -> Marked {
        let text = match self.base {
            Base::Shipped(name) => {
                let meshes = folder.path().join("meshes");
                fs::create_dir(&meshes).expect("made");
                for mesh in ["inductor.msh", "rotor.msh", "ball.msh"] {
                    fs::copy(repository("configs/meshes").join(mesh), meshes.join(mesh)).expect("copied");
                }
                fs::read_to_string(repository("configs").join(name)).expect("a shipped configuration")
            }
            Base::Own(text) => text.to_owned(),
        };
        let (text, marked) = unmarked("device.toml", &edited(text, self.edits, self.name));
        fs::write(folder.path().join("device.toml"), text).expect("written");
        let of_mesh = self.mesh.and_then(|(text, edits)| {
            let (text, marked) = unmarked("device.msh", &edited(text.to_owned(), edits, self.name));
            fs::write(folder.path().join("device.msh"), text).expect("written");
            marked
        });
        let of_set =
            self.set.iter().find_map(|set| unmarked(&format!("--set '{}'", unmarked("", set).0), set).1);
        marked.or(of_mesh).or(of_set).unwrap_or_else(|| panic!("{}: no marks", self.name))
    }
}

/// Whether the first excerpt of a message underlines the marked place: file, line, column and characters.
fn points_at(text: &str, marked: &Marked) -> Result<(), String> {
    let objection = |what: &str| Err(format!("{what}; expected {marked:?} in\n{text}"));
    let place = text.lines().find_map(|line| line.trim_start().strip_prefix("--> "));
    let Some((file, line, column)) = place.and_then(|place| {
        let mut parts = place.rsplitn(3, ':');
        let (column, line): (usize, usize) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
        Some((parts.next()?.to_owned(), line, column))
    }) else {
        return objection("no place");
    };
    let is_set = marked.file.starts_with("--set");
    // The text of an override is the line of TOML that it stands for.
    if file != marked.file || line != marked.line || (column != marked.column && !is_set) {
        return objection(&format!("shown {file}:{line}:{column}"));
    }
    let Some(underlining) = text.lines().position(|line| line.contains('^')) else {
        return objection("nothing underlined");
    };
    let lines: Vec<&str> = text.lines().collect();
    let Some(source) = lines[..underlining]
        .iter()
        .rev()
        .find(|line| line.trim_start().starts_with(|c: char| c.is_ascii_digit()))
    else {
        return objection("no excerpt");
    };
    let carets: Vec<usize> =
        lines[underlining].chars().enumerate().filter(|(_, c)| *c == '^').map(|(at, _)| at).collect();
    let underlined: String = source.chars().skip(carets[0]).take(carets.len()).collect();
    let enough = if marked.text.is_empty() { carets.len() == 1 } else { underlined == marked.text };
    if enough { Ok(()) } else { objection(&format!("underlined `{underlined}`")) }
}

/// Compares what the cases of a theme show with the text that is kept, and says which do not point.
pub(crate) fn compare(theme: &str, cases: &[Case]) {
    let mut all = String::new();
    let mut wrong = Vec::new();
    for case in cases {
        let shown = case.shown();
        all += &format!("==== {}\n{}\n", case.name, shown.text);
        wrong.extend(shown.points.err().map(|why| format!("{}: {why}", case.name)));
    }
    let path = repository("tests/diagnostics/snapshots").join(format!("{theme}.txt"));
    if std::env::var_os("SNAPSHOTS").is_some_and(|value| value == "overwrite") {
        fs::write(&path, &all).expect("written");
    }
    println!("{theme}: {} of {} cases point at the exact place", cases.len() - wrong.len(), cases.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n----\n"));
    let kept = snapbox::Data::read_from(&path, None);
    snapbox::assert_data_eq!(all, kept.raw());
}
