//! The field of an evaluation as its run directory holds it: one VTU file, or the pieces that a PVTU file names.

use std::path::{Path, PathBuf};

use fluxmorph_geometry::io::{VtuContents, join_pieces, pvtu_pieces, vtu_contents};

use crate::files::{FieldForm, OutputError, RunDirectory};

/// Largest field file that is read [bytes].
const LARGEST_FIELD: u64 = 1 << 34;

/// Largest header of pieces that is read [bytes]: a line for each of a million ranks.
const LARGEST_HEADER: u64 = 1 << 26;

/// The whole field of an evaluation, and the file that stands for it in messages.
///
/// # Errors
/// [`OutputError`] names the file, or the piece, that is missing or damaged.
pub(super) fn field_contents(
    directory: &RunDirectory,
    evaluation: usize,
) -> Result<(PathBuf, VtuContents), OutputError> {
    if directory.field_form(evaluation)? != Some(FieldForm::Pieces) {
        let path = directory.field(evaluation);
        let contents = contents(directory, &path)?;
        return Ok((path, contents));
    }
    let path = directory.field_header(evaluation);
    let bytes = directory.disk().read(&path, LARGEST_HEADER).map_err(OutputError::io("read", &path))?;
    let names = pvtu_pieces(&bytes).map_err(OutputError::damaged(&path))?;
    let piece = |name: String| {
        if !RunDirectory::is_piece_in_header(evaluation, &name) {
            let cause = format!("it names `{name}`, which is no piece of this evaluation");
            return Err(OutputError::damaged(&path)(cause));
        }
        let contents = contents(directory, &directory.fields().join(&name))?;
        Ok((name, contents))
    };
    let pieces = names.into_iter().map(piece).collect::<Result<Vec<_>, OutputError>>()?;
    let whole = join_pieces(pieces).map_err(OutputError::damaged(&path))?;
    Ok((path, whole))
}

/// The content of a VTU file.
///
/// # Errors
/// [`OutputError`] names the file.
pub(super) fn contents(directory: &RunDirectory, path: &Path) -> Result<VtuContents, OutputError> {
    let bytes = directory.disk().read(path, LARGEST_FIELD).map_err(OutputError::io("read", path))?;
    vtu_contents(&bytes).map_err(OutputError::damaged(path))
}
