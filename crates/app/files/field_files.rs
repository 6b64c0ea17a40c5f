//! The field files of a run: one VTU file an evaluation, or a header with a folder of pieces where several ranks wrote it.
//!
//! `fields/eval_0004.vtu`, or `fields/eval_0004.pvtu` beside `fields/eval_0004/rank_000.vtu` …: the header names the pieces,
//! comes after the last of them and goes before the first, so that a header always stands for whole pieces. Where a
//! resumed run has left both forms, the VTU file counts. Does not live here: what is in the files.

use std::io;
use std::path::PathBuf;

use super::OutputError;
use super::names::FIELDS;
use super::run_directory::RunDirectory;

const WHOLE: &str = ".vtu";
const HEADER: &str = ".pvtu";

/// How the field of an evaluation is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldForm {
    /// One VTU file.
    Whole,
    /// A PVTU file with a folder of pieces.
    Pieces,
}

impl RunDirectory {
    /// `fields`, the folder of the field files.
    pub fn fields(&self) -> PathBuf {
        self.path().join(FIELDS)
    }

    /// The VTU file of one evaluation.
    pub fn field(&self, evaluation: usize) -> PathBuf {
        self.fields().join(stem(evaluation) + WHOLE)
    }

    /// The header of the pieces of one evaluation.
    pub fn field_header(&self, evaluation: usize) -> PathBuf {
        self.fields().join(stem(evaluation) + HEADER)
    }

    /// The piece of one evaluation that a rank writes.
    pub fn field_piece(&self, evaluation: usize, rank: usize) -> PathBuf {
        self.fields().join(Self::piece_in_header(evaluation, rank))
    }

    /// A piece as the header names it, relative to the header.
    pub fn piece_in_header(evaluation: usize, rank: usize) -> String {
        format!("{}/{}", stem(evaluation), piece_name(rank))
    }

    /// Whether a header of this evaluation may name a piece so: another name could lead anywhere.
    pub fn is_piece_in_header(evaluation: usize, name: &str) -> bool {
        let own = stem(evaluation);
        name.split_once('/').is_some_and(|(folder, piece)| folder == own && is_piece(piece))
    }

    /// The field files of evaluations as a collection names them, relative to the run directory; the VTU file where
    /// there is none yet.
    pub fn fields_in_collection(&self, evaluations: &[usize]) -> Result<Vec<String>, OutputError> {
        let names = self.entries(&self.fields())?;
        let file = |&evaluation: &usize| {
            let end =
                if self.form_among(&names, evaluation) == Some(FieldForm::Pieces) { HEADER } else { WHOLE };
            format!("{FIELDS}/{}{end}", stem(evaluation))
        };
        Ok(evaluations.iter().map(file).collect())
    }

    /// How the field of an evaluation is kept; `None` where it is not.
    pub fn field_form(&self, evaluation: usize) -> Result<Option<FieldForm>, OutputError> {
        Ok(self.form_among(&self.entries(&self.fields())?, evaluation))
    }

    fn form_among(&self, names: &[String], evaluation: usize) -> Option<FieldForm> {
        let is_there = |end: &str| names.binary_search(&(stem(evaluation) + end)).is_ok();
        let forms = [(WHOLE, FieldForm::Whole), (HEADER, FieldForm::Pieces)];
        forms.into_iter().find(|(end, _)| is_there(end)).map(|(_, form)| form)
    }

    /// Evaluations with a field file of either form, ascending.
    pub fn evaluations_with_fields(&self) -> Result<Vec<usize>, OutputError> {
        let number = |name: &String| number(name, WHOLE).or_else(|| number_of_header(name));
        let mut numbers: Vec<usize> = self.entries(&self.fields())?.iter().filter_map(number).collect();
        numbers.sort_unstable();
        numbers.dedup();
        Ok(numbers)
    }

    /// Writes the VTU file of an evaluation; pieces of it that were there go.
    pub fn write_field(&self, evaluation: usize, bytes: &[u8]) -> Result<(), OutputError> {
        self.write(&self.field(evaluation), bytes)?;
        let is_of_pieces = |name: &String| [stem(evaluation), stem(evaluation) + HEADER].contains(name);
        if self.entries(&self.fields())?.iter().any(is_of_pieces) {
            self.remove_pieces(evaluation)
        } else {
            Ok(())
        }
    }

    /// Makes the empty folder that ranks write the pieces of an evaluation into; there is no header until
    /// [`RunDirectory::finish_pieces`].
    pub fn begin_pieces(&self, evaluation: usize) -> Result<(), OutputError> {
        self.remove_pieces(evaluation)?;
        let folder = self.fields().join(stem(evaluation));
        if self.disk().is_link(&folder) {
            return Err(OutputError::Linked { path: folder });
        }
        self.make(&folder)
    }

    /// Writes the header of an evaluation, all of whose pieces are there; a VTU file that was there goes.
    pub fn finish_pieces(&self, evaluation: usize, header: &str) -> Result<(), OutputError> {
        self.write(&self.field_header(evaluation), header.as_bytes())?;
        self.remove(&self.field(evaluation))
    }

    /// Removes the fields of all evaluations but some, pieces without a header, and what is half-written.
    pub(super) fn remove_fields(&self, kept: &[usize]) -> Result<(), OutputError> {
        let fields = self.fields();
        // A link may lead to the fields of another run: those stay.
        if self.disk().is_link(&fields) {
            return Ok(());
        }
        self.remove_unfinished(&fields)?;
        let names = self.entries(&fields)?;
        for name in &names {
            if number(name, WHOLE).is_some_and(|evaluation| !kept.contains(&evaluation)) {
                self.remove(&fields.join(name))?;
            }
            let of_pieces = number_of_header(name).or_else(|| number(name, ""));
            let Some(evaluation) = of_pieces else { continue };
            let is_whole = names.binary_search(&(stem(evaluation) + HEADER)).is_ok();
            if kept.contains(&evaluation) && is_whole {
                self.remove_unfinished(&self.piece_folder(evaluation))?;
            } else {
                self.remove_pieces(evaluation)?;
            }
        }
        Ok(())
    }

    /// Removes the header of an evaluation, then its pieces, then their folder, unless others have put something into it.
    fn remove_pieces(&self, evaluation: usize) -> Result<(), OutputError> {
        self.remove(&self.field_header(evaluation))?;
        let folder = self.piece_folder(evaluation);
        // What lies behind a link belongs to somebody else.
        if self.disk().is_link(&folder) {
            return Ok(());
        }
        let Ok(there) = self.disk().names(&folder) else { return Ok(()) };
        self.remove_unfinished(&folder)?;
        for name in there.iter().filter(|name| is_piece(name)) {
            self.remove(&folder.join(name))?;
        }
        match self.disk().remove_dir(&folder) {
            Err(error)
                if !matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::DirectoryNotEmpty) =>
            {
                Err(OutputError::io("remove", &folder)(error))
            }
            _ => Ok(()),
        }
    }

    fn piece_folder(&self, evaluation: usize) -> PathBuf {
        self.fields().join(stem(evaluation))
    }

    /// Whether there is nothing in the folder of the fields.
    pub(super) fn has_no_fields(&self) -> Result<bool, OutputError> {
        Ok(self.entries(&self.fields())?.is_empty())
    }
}

fn stem(evaluation: usize) -> String {
    format!("eval_{evaluation:04}")
}

fn piece_name(rank: usize) -> String {
    format!("rank_{rank:03}.vtu")
}

/// Whether a name is one that [`piece_name`] gives.
fn is_piece(name: &str) -> bool {
    let digits = name.strip_prefix("rank_").and_then(|rest| rest.strip_suffix(WHOLE));
    digits.is_some_and(|digits| digits.len() >= 3 && digits.bytes().all(|byte| byte.is_ascii_digit()))
}

/// The evaluation of a file with this end; of a folder of pieces where it is empty.
fn number(name: &str, end: &str) -> Option<usize> {
    let digits = name.strip_prefix("eval_")?.strip_suffix(end)?;
    let is_ours = digits.len() >= 4 && digits.bytes().all(|byte| byte.is_ascii_digit());
    digits.parse().ok().filter(|_| is_ours)
}

fn number_of_header(name: &str) -> Option<usize> {
    number(name, HEADER)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::disk::system_disk;
    use super::super::run_directory::OverwritePolicy;
    use super::*;

    fn fresh(folder: &tempfile::TempDir) -> RunDirectory {
        RunDirectory::create(&system_disk(), &folder.path().join("run"), OverwritePolicy::Keep).expect("new")
    }

    /// Three pieces and their header.
    fn write_pieces(run: &RunDirectory, evaluation: usize) {
        run.begin_pieces(evaluation).expect("a folder");
        for rank in 0..3 {
            run.write(&run.field_piece(evaluation, rank), b"piece").expect("written");
        }
        run.finish_pieces(evaluation, "header").expect("written");
    }

    #[test]
    fn names_of_both_forms() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let run = fresh(&folder);
        assert!(run.field(7).ends_with("fields/eval_0007.vtu"));
        assert!(run.field_header(7).ends_with("fields/eval_0007.pvtu"));
        assert!(run.field_piece(12345, 1234).ends_with("fields/eval_12345/rank_1234.vtu"));
        let name = RunDirectory::piece_in_header(7, 2);
        assert_eq!(name, "eval_0007/rank_002.vtu");
        assert!(RunDirectory::is_piece_in_header(7, &name) && !RunDirectory::is_piece_in_header(8, &name));
        for foreign in ["/etc/passwd", "../x.vtu", "eval_0007/../rank_000.vtu", "eval_0007/rank_0.vtu", ""] {
            assert!(!RunDirectory::is_piece_in_header(7, foreign), "{foreign}");
        }
    }

    #[test]
    fn evaluations_with_either_form_are_listed_and_the_collection_names_what_is_there() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let run = fresh(&folder);
        run.write_field(2, b"whole").expect("written");
        write_pieces(&run, 10);
        run.begin_pieces(11).expect("a folder");
        assert_eq!(run.evaluations_with_fields().expect("listed"), [2, 10], "11 has no header");
        let files = run.fields_in_collection(&[2, 10, 12]).expect("listed");
        assert_eq!(files, ["fields/eval_0002.vtu", "fields/eval_0010.pvtu", "fields/eval_0012.vtu"]);
        assert_eq!(run.field_form(10).expect("listed"), Some(FieldForm::Pieces));
        assert_eq!(run.field_form(11).expect("listed"), None);
    }

    #[test]
    fn one_form_takes_the_place_of_the_other() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let run = fresh(&folder);
        write_pieces(&run, 4);
        run.write_field(4, b"whole").expect("written");
        assert!(run.field(4).exists() && !run.field_header(4).exists());
        assert!(!run.fields().join("eval_0004").exists());
        write_pieces(&run, 4);
        assert!(!run.field(4).exists() && run.field_header(4).exists());
        // Fewer ranks than before: the pieces of the others are gone, and so is the header until all are there.
        run.begin_pieces(4).expect("a folder");
        assert!(!run.field_header(4).exists() && !run.field_piece(4, 0).exists());
    }

    #[test]
    fn what_is_not_kept_goes_with_its_pieces_and_foreign_files_stay() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let run = fresh(&folder);
        (0..3).for_each(|evaluation| write_pieces(&run, evaluation));
        run.write_field(3, b"whole").expect("written");
        // Half-written, and never finished.
        run.begin_pieces(5).expect("a folder");
        run.write(&run.field_piece(5, 0), b"piece").expect("written");
        let half = run.fields().join("eval_0001/.fluxmorph-rank_001.vtu");
        let notes = run.fields().join("eval_0002/notes.md");
        for path in [&half, &notes] {
            fs::write(path, "x").expect("written");
        }
        run.remove_leftovers(&[1, 5]).expect("removed");
        assert_eq!(run.evaluations_with_fields().expect("listed"), [1]);
        assert!(!half.exists() && run.field_piece(1, 2).exists());
        assert!(notes.exists() && !run.field_piece(2, 0).exists());
        let left = run.entries(&run.fields()).expect("listed");
        assert_eq!(left, ["eval_0001", "eval_0001.pvtu", "eval_0002"]);
    }

    #[cfg(unix)]
    #[test]
    fn pieces_behind_a_link_stay_and_none_are_written_there() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let run = fresh(&folder);
        let other = folder.path().join("other");
        fs::create_dir(&other).expect("made");
        fs::write(other.join("rank_000.vtu"), "theirs").expect("written");
        std::os::unix::fs::symlink(&other, run.fields().join("eval_0000")).expect("linked");
        run.remove_leftovers(&[]).expect("removed");
        assert!(other.join("rank_000.vtu").exists());
        assert!(matches!(run.begin_pieces(0), Err(OutputError::Linked { .. })));
    }
}
