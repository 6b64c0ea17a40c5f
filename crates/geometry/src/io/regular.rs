//! Opens regular files only: a pipe that nobody writes into would be waited for without end, and some devices never end.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Opens a file for reading if it is a regular one, or a link to one.
///
/// # Errors
/// What the system says, and for anything else than a regular file what it is.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // Before it is opened: opening a named pipe waits for its writer.
    check(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    // And after: the path may lead elsewhere by now.
    check(&file.metadata()?)?;
    Ok(file)
}

/// All bytes of a regular file that has so many at most, whatever size it reports.
///
/// # Errors
/// As [`open_regular`], and [`io::ErrorKind::FileTooLarge`] beyond.
pub fn read_at_most(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
}

/// All bytes of a regular file.
///
/// # Errors
/// As [`open_regular`], and when there is no memory for them.
pub(crate) fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = open_regular(path)?;
    let mut bytes = Vec::new();
    let length = usize::try_from(file.metadata()?.len()).unwrap_or(usize::MAX);
    bytes.try_reserve_exact(length)?;
    // What is appended meanwhile is not waited for.
    file.by_ref().take(length as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn check(found: &std::fs::Metadata) -> io::Result<()> {
    if found.is_file() {
        return Ok(());
    }
    let what = if found.is_dir() { "it is a folder" } else { "it is a pipe, a socket or a device" };
    Err(io::Error::new(io::ErrorKind::InvalidInput, format!("{what}, not a regular file")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_are_opened() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("file");
        std::fs::write(&file, b"abc").expect("written");
        assert_eq!(read_regular(&file).expect("regular"), b"abc");
        let error = open_regular(folder.path()).expect_err("a folder");
        assert!(error.to_string().contains("a folder"), "{error}");
        assert_eq!(
            open_regular(&folder.path().join("none")).expect_err("none").kind(),
            io::ErrorKind::NotFound
        );
        #[cfg(target_os = "linux")]
        {
            // It never ends.
            let error = open_regular(Path::new("/dev/zero")).expect_err("a device");
            assert!(error.to_string().contains("a device"), "{error}");
        }
    }
}
