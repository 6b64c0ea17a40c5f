//! `fluxmorph init`: a commented configuration to start from.
//!
//! Where it is written and what is said of it; the texts are in [`super::template`].

use std::io::Write;
use std::path::{Path, PathBuf};

use super::args::InitArgs;
use super::template::Template;
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::{OutputError, shell_word, system_disk, write_whole};
use crate::printable::printable;

/// Do what the command line says.
pub(super) fn init(args: &InitArgs) -> Result<ExitCode, Error> {
    let place = Place::of(args)?;
    let files: Vec<(PathBuf, Vec<u8>)> = place
        .template
        .files()
        .iter()
        .map(|file| {
            let name = format!("{}.{}", place.name, file.extension);
            (place.folder.join(name), file.content_for(&place.name).into_owned())
        })
        .collect();
    let taken = |(path, _): &&(PathBuf, Vec<u8>)| path.symlink_metadata().is_ok();
    if let Some((path, _)) = files.iter().find(taken).filter(|_| !args.force) {
        return Err(Error::FileExists { path: path.clone() });
    }
    let disk = system_disk();
    if !place.folder.as_os_str().is_empty() {
        disk.create_dir(&place.folder).map_err(OutputError::io("create the folder", &place.folder))?;
    }
    // The configuration last: where it is, all that it needs is there too.
    for (path, content) in files.iter().rev() {
        write_whole(&*disk, path, content)?;
    }
    if !args.quiet {
        let written: Vec<&Path> = files.iter().map(|(path, _)| path.as_path()).collect();
        let next = next_commands(&written, place.template);
        let _ = writeln!(std::io::stderr(), "{}", printable(&next));
    }
    Ok(ExitCode::Success)
}

/// What is written where.
#[derive(Debug, PartialEq, Eq)]
struct Place {
    folder: PathBuf,
    /// Of the files, without extension.
    name: String,
    template: Template,
}

impl Place {
    fn of(args: &InitArgs) -> Result<Self, Error> {
        let Some(given) = &args.name else {
            let template = args.template.unwrap_or(Template::Shield);
            let folder = args.out.clone().unwrap_or_default();
            return Ok(Self { folder, name: template.name().to_owned(), template });
        };
        let wrong = || Error::ConfigurationName { name: given.clone() };
        let text = given.to_str().ok_or_else(wrong)?;
        let file = given.file_name().and_then(|name| name.to_str()).ok_or_else(wrong)?;
        let name = file.strip_suffix(".toml").unwrap_or(file);
        let is_bad = |c: char| c.is_control() || matches!(c, '"' | '\\');
        if name.is_empty() || text.ends_with(std::path::is_separator) || name.contains(is_bad) {
            return Err(wrong());
        }
        let folder = match (&args.out, given.parent().filter(|folder| !folder.as_os_str().is_empty())) {
            (Some(out), Some(folder)) => out.join(folder),
            (Some(out), None) => out.clone(),
            (None, folder) => folder.map(Path::to_owned).unwrap_or_default(),
        };
        Ok(Self {
            folder,
            name: name.to_owned(),
            template: args.template.or_else(|| Template::by_name(name)).unwrap_or(Template::Shield),
        })
    }
}

/// What was written, and the next commands.
fn next_commands(files: &[&Path], template: Template) -> String {
    let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    let config = shell_word(files[0]);
    let command = template.command();
    format!(
        "wrote {}\n\nnext:\n  fluxmorph check {config:<24} # what it means, without solving\n  fluxmorph {command} \
         {config:<width$} # the work itself",
        names.join(", "),
        width = 29 - command.len()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(name: Option<&str>, template: Option<Template>, out: Option<&str>) -> InitArgs {
        InitArgs {
            name: name.map(PathBuf::from),
            template,
            out: out.map(PathBuf::from),
            force: false,
            quiet: true,
        }
    }

    #[test]
    fn names_templates_and_folders_are_found() {
        use Template::*;
        let cases = [
            (args(None, None, None), ("", "shield", Shield)),
            (args(None, Some(Pole), Some("a")), ("a", "pole", Pole)),
            (args(Some("gmsh"), None, None), ("", "gmsh", Gmsh)),
            (args(Some("pole"), Some(Block), None), ("", "pole", Block)),
            (args(Some("plate.toml"), None, None), ("", "plate", Shield)),
            (args(Some("x/block.toml"), None, Some("a")), ("a/x", "block", Block)),
            (args(Some("v1.2"), None, None), ("", "v1.2", Shield)),
        ];
        for (args, (folder, name, template)) in cases {
            let expected = Place { folder: folder.into(), name: name.to_owned(), template };
            assert_eq!(Place::of(&args).expect("a place"), expected);
        }
    }

    #[test]
    fn names_that_are_none_are_refused() {
        for name in ["", ".toml", "..", "/", "folder/", "a\nb", "a\"b", "a\\b"] {
            assert!(
                matches!(Place::of(&args(Some(name), None, None)), Err(Error::ConfigurationName { .. })),
                "{name:?}"
            );
        }
    }
}
