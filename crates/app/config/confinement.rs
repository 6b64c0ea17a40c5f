//! Which files a configuration may name: none outside of its own folder, unless the user says so.
//!
//! A configuration may come from a stranger. Its paths are relative and lead downwards; no link on the way may lead out of
//! the folder. The path of the configuration itself, `--out`, and keys that the user types as overrides are trusted.
//!
//! Paths are taken as they are written: `~`, `$HOME`, `%TEMP%` and wildcards are plain text.

use std::path::{Component, Path, PathBuf};

use super::error::ConfigError;
use super::text::source::SourceMap;

/// Who names the directory that is written into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputNamedBy {
    /// The configuration, or its default.
    Configuration,
    /// The user, on the command line.
    User,
}

/// How a path leaves a folder.
#[derive(Debug, PartialEq, Eq)]
enum Escape {
    /// It does not begin in the folder.
    Absolute,
    /// It goes upwards.
    Upwards,
    /// This link on its way leads out.
    Link(PathBuf),
    /// This link on its way leads nowhere.
    DeadLink(PathBuf),
}

impl SourceMap {
    /// Refuses paths that lead out of the folder of the configuration.
    ///
    /// # Errors
    /// A fault at the key of each such path.
    pub fn confined(&self, output: OutputNamedBy) -> Result<(), ConfigError> {
        let mut diagnostics = Vec::new();
        for source in std::iter::once(self).chain(self.cases.iter()) {
            let mesh = source.written.mesh.as_deref().map(|path| ("mesh.file", path));
            let default = format!("runs/{}", source.stem);
            let directory = source.written.directory.as_deref().unwrap_or(&default);
            let directory =
                (output == OutputNamedBy::Configuration).then_some(("output.directory", directory));
            let curves = source.written.curves.iter().map(|(key, path)| (key.as_str(), path.as_str()));
            for (key, path) in mesh.into_iter().chain(directory).chain(curves) {
                // Overrides are the user's own words.
                let by_user = source.spans.get(key).is_some_and(|span| span.document > 0);
                let mut steps = Path::new(path);
                if key == "output.directory" {
                    // A resolved configuration names the folder that it lies in by its whole path.
                    steps = steps.strip_prefix(&self.directory).unwrap_or(steps);
                }
                let escape = if by_user { None } else { escape(&self.directory, steps) };
                let Some(escape) = escape else { continue };
                let (why, help) = explained(key, &escape);
                let diagnostic = source
                    .diagnostic(key, format!("`{key}` is `{}`, {why}", path.escape_debug()))
                    .expected("a relative path below the folder of the configuration")
                    .help(help);
                // A case that does not change a key has the fault of the configuration.
                if !diagnostics.contains(&diagnostic) {
                    diagnostics.push(diagnostic);
                }
            }
        }
        self.check(diagnostics)
    }
}

/// A path from the root without `..`, which a configuration that is written there may not name; links before one are followed.
pub fn without_upward_steps(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut plain = PathBuf::new();
    for component in path.components() {
        if component == Component::ParentDir {
            plain = plain.canonicalize().unwrap_or(plain);
            plain.pop();
        } else {
            plain.push(component);
        }
    }
    plain
}

/// What an escape is, and what to do.
fn explained(key: &str, escape: &Escape) -> (String, String) {
    let why = match escape {
        Escape::Absolute => "an absolute path".to_owned(),
        Escape::Upwards => "which leads upwards by `..`".to_owned(),
        Escape::Link(link) => {
            format!("and the link `{}` leads out of the folder", link.display().to_string().escape_debug())
        }
        Escape::DeadLink(link) => {
            format!("and the link `{}` leads nowhere", link.display().to_string().escape_debug())
        }
    };
    let help = match key {
        "mesh.file" => "put the mesh beside the configuration, or give --allow-outside if you trust the file",
        "output.directory" => "give --out DIR, or --allow-outside if you trust the file",
        _ => "put the table beside the configuration, or give --allow-outside if you trust the file",
    };
    (why, help.to_owned())
}

/// How a path, taken from a folder, leaves it; `None` when it does not.
fn escape(folder: &Path, path: &Path) -> Option<Escape> {
    let mut steps = Vec::new();
    for component in path.components() {
        match component {
            Component::Prefix(_) | Component::RootDir => return Some(Escape::Absolute),
            Component::ParentDir => return Some(Escape::Upwards),
            Component::CurDir => {}
            Component::Normal(step) => steps.push(step),
        }
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    // A folder that cannot be looked into fails where it is used.
    let folder = folder.canonicalize().ok()?;
    let mut at = folder.clone();
    for step in steps {
        at.push(step);
        // Behind what does not exist there are no links.
        let entry = std::fs::symlink_metadata(&at).ok()?;
        if entry.is_symlink() {
            match at.canonicalize() {
                Ok(real) if real.starts_with(&folder) => at = real,
                Ok(_) => return Some(Escape::Link(at)),
                Err(_) => return Some(Escape::DeadLink(at)),
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_may_only_lead_downwards() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let of = |path: &str| escape(folder.path(), Path::new(path));
        for inside in ["a.msh", "./a.msh", "a/b/c.msh", "~/a.msh", "$HOME/a", "a..b", "...", "a\\..\\b"] {
            assert_eq!(of(inside), None, "{inside}");
        }
        for upwards in ["..", "../a.msh", "a/../b.msh", "a/.."] {
            assert_eq!(of(upwards), Some(Escape::Upwards), "{upwards}");
        }
        assert_eq!(of("/etc/passwd"), Some(Escape::Absolute));
        let own = folder.path().join("a.msh");
        assert_eq!(escape(folder.path(), &own), Some(Escape::Absolute));
    }

    #[cfg(unix)]
    #[test]
    fn links_may_stay_and_not_leave() {
        use std::os::unix::fs::symlink;
        let home = tempfile::tempdir().expect("a temporary folder");
        let (inside, outside) = (home.path().join("inside"), home.path().join("outside"));
        std::fs::create_dir_all(inside.join("deep")).expect("made");
        std::fs::create_dir(&outside).expect("made");
        symlink(&outside, inside.join("out")).expect("linked");
        symlink("deep", inside.join("in")).expect("linked");
        symlink("../..", inside.join("deep/up")).expect("linked");
        symlink("round", inside.join("round")).expect("linked");
        symlink("nothing", inside.join("nowhere")).expect("linked");
        let of = |path: &str| escape(&inside, Path::new(path));
        let real = inside.canonicalize().expect("it is there");
        assert_eq!(of("in/a.msh"), None);
        assert_eq!(of("out/a.msh"), Some(Escape::Link(real.join("out"))));
        assert_eq!(of("out"), Some(Escape::Link(real.join("out"))));
        assert_eq!(of("in/up/a.msh"), Some(Escape::Link(real.join("deep/up"))));
        assert_eq!(of("round"), Some(Escape::DeadLink(real.join("round"))));
        assert_eq!(of("nowhere/a"), Some(Escape::DeadLink(real.join("nowhere"))));
        // The folder itself may be reached by a link: that path is the user's.
        assert_eq!(escape(&inside.join("in"), Path::new("a.msh")), None);
    }
}
