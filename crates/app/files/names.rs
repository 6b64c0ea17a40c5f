//! Names: of the files of a run that depend on a number or on a surface, and of the run directory for a shell.

use std::path::Path;

use super::OutputError;
use crate::config::MOST_EVALUATIONS;
use crate::printable::is_hidden;

/// Most characters of a surface's name in the name of its file: names of files are limited to 255 bytes.
const LONGEST_NAME: usize = 50;

/// Names of the STL files of surfaces, in their order: letters, digits, `-` and `_` stay, all else becomes `_`.
///
/// Names that come out equal, in small letters or capitals, are numbered: some file systems see no difference.
pub fn surface_files(surfaces: &[String]) -> Vec<String> {
    let mut taken = std::collections::BTreeSet::new();
    let safe = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    let mut file = |surface: &String| {
        let stem: String = surface.chars().take(LONGEST_NAME).map(safe).collect();
        let numbered = (2..).map(|n| format!("{stem}_{n}"));
        let free =
            std::iter::once(stem.clone()).chain(numbered).find(|name| taken.insert(name.to_lowercase()));
        format!("optimum_{}.stl", free.unwrap_or(stem))
    };
    surfaces.iter().map(&mut file).collect()
}

/// The folder of the fields in a run directory.
pub(super) const FIELDS: &str = "fields";

/// Whether a name is one of [`surface_files`].
pub(super) fn is_surface(name: &str) -> bool {
    name.strip_prefix("optimum_")
        .and_then(|rest| rest.strip_suffix(".stl"))
        .is_some_and(|stem| stem.chars().all(|c| c.is_alphanumeric() || c == '-' || c == '_'))
}

pub(super) fn morph_name(case: Option<usize>, what: &str) -> String {
    match case {
        None => format!("{what}.vtu"),
        Some(case) => format!("case_{:02}_{what}.vtu", case + 1),
    }
}

/// Whether a name is one that [`morph_name`] gives a case.
pub(super) fn is_case(name: &str) -> bool {
    let number = |end| name.strip_prefix("case_").and_then(|rest| rest.strip_suffix(end));
    ["_before.vtu", "_after.vtu"]
        .into_iter()
        .filter_map(number)
        .any(|digits| digits.len() >= 2 && digits.bytes().all(|byte| byte.is_ascii_digit()))
}

/// The command that resumes a run, as a shell takes it.
pub fn resume_command(directory: &Path) -> String {
    format!("fluxmorph resume {}", shell_word(directory))
}

/// The command that resumes a run that has used up so many evaluations.
pub fn extend_command(directory: &Path, evaluations: usize) -> String {
    let more = evaluations.saturating_mul(2).clamp(1, MOST_EVALUATIONS);
    format!("{} --max-evaluations {more}", resume_command(directory))
}

/// Refuses a path that a file cannot keep as text.
///
/// # Errors
/// [`OutputError::NoText`].
pub(crate) fn check_text(path: &Path) -> Result<(), OutputError> {
    path.to_str().map(|_| ()).ok_or_else(|| OutputError::NoText { path: path.to_owned() })
}

/// A path as one word of a shell's command line; bytes that are no text, or that a terminal would act on, as `bash` and its like take
/// them between `$'` and `'`.
pub(crate) fn shell_word(path: &Path) -> String {
    // A name that begins with a dash would be taken for an option.
    let bytes = path.as_os_str().as_encoded_bytes();
    let folder = if bytes.starts_with(b"-") { "./" } else { "" };
    if path.to_str().is_none_or(|text| text.contains(is_hidden)) {
        let escaped = |byte: &u8| match byte {
            b'\'' | b'\\' => format!("\\{}", char::from(*byte)),
            b' '..=b'~' => char::from(*byte).to_string(),
            other => format!("\\{other:03o}"),
        };
        return format!("$'{folder}{}'", bytes.iter().map(escaped).collect::<String>());
    }
    let path = if bytes.is_empty() { ".".to_owned() } else { format!("{folder}{}", path.display()) };
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:@%".contains(c);
    if path.chars().all(is_plain) { path } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_surfaces_have_safe_names_of_their_own() {
        let names =
            ["plate|air", "plate/air", "Top side", "top_SIDE", "../x", "Fläche", ""].map(str::to_owned);
        let files = surface_files(&names);
        let expected = [
            "optimum_plate_air.stl",
            "optimum_plate_air_2.stl",
            "optimum_Top_side.stl",
            "optimum_top_SIDE_2.stl",
            "optimum____x.stl",
            "optimum_Fläche.stl",
            "optimum_.stl",
        ];
        assert_eq!(files, expected);
        assert!(files.iter().all(|file| is_surface(file)));
        assert!(surface_files(&["ä".repeat(500)])[0].len() < 255);
    }

    #[test]
    fn the_command_to_go_on_is_one_that_a_shell_takes() {
        for (path, expected) in [
            ("runs/shield", "fluxmorph resume runs/shield"),
            ("/a b/it's", r"fluxmorph resume '/a b/it'\''s'"),
            ("two\nlines", "fluxmorph resume 'two\nlines'"),
            ("$(rm)", "fluxmorph resume '$(rm)'"),
            ("-out", "fluxmorph resume ./-out"),
            ("", "fluxmorph resume ."),
            ("it's \u{1b}[1m\\", r"fluxmorph resume $'it\'s \033[1m\\'"),
            ("-ä\u{202e}", r"fluxmorph resume $'./-\303\244\342\200\256'"),
        ] {
            assert_eq!(resume_command(Path::new(path)), expected);
        }
    }
}
