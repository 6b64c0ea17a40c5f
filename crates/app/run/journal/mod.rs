//! `journal.jsonl`: every evaluation of a run to the last bit, so that an interrupted run can be resumed.
//!
//! NLopt keeps its state to itself, but its methods are deterministic: started afresh and given the same objectives,
//! constraints and gradients, they ask for the same designs and are in the same state at the end. The journal holds what
//! they were given. [`crate::driver`] replays it as long as designs agree to the last bit.
//!
//! The file is a header and records, a line each (`line`), appended and synced one by one. Numbers are decimal, with the
//! digits that read back as the same bits. Every line carries a checksum over itself and the checksum before it: a record
//! that was cut short, changed or moved ends what is read. A journal belongs to an [`Identity`]: program version,
//! configuration and mesh.

mod changed_key;
mod identity;
mod line;

use fluxmorph_optimizer::driver::Record;

use crate::config::{Config, SourceMap};
use crate::error::Error;
use crate::files::{Manifest, OutputError, RunDirectory, SyncedLog, blake3_hex};

pub(super) use changed_key::changed_key;
pub use identity::{Identity, configuration_hash, describe_meshes, mesh_hash};

/// Largest journal that is read [bytes]: four hundred thousand evaluations of a thousand variables.
const LARGEST: u64 = 1 << 34;

/// What the bytes of a journal hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// What the journal belongs to.
    pub identity: Identity,
    /// The whole records, in their order.
    pub records: Vec<Record>,
    /// Bytes of header and whole records.
    pub length: u64,
    /// What is after them.
    pub rest: Rest,
    /// Checksum that the next record carries on.
    sum: String,
}

/// What is after the whole records of a journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// Nothing.
    Nothing,
    /// A record that a crash cut short or left half-written, of so many bytes.
    Torn(u64),
    /// More than one record, of so many bytes: something in the first of them was changed.
    Damaged(u64),
}

impl Rest {
    /// Its length [bytes].
    pub fn bytes(self) -> u64 {
        match self {
            Self::Nothing => 0,
            Self::Torn(bytes) | Self::Damaged(bytes) => bytes,
        }
    }
}

/// Why bytes are no journal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum JournalError {
    /// The file begins otherwise.
    #[error("it does not begin as a journal of fluxmorph does")]
    NotAJournal,
    /// The form is that of another program version.
    #[error("its form has the version {found}, expected {expected}")]
    Form { found: u32, expected: u32 },
    /// The header is damaged.
    #[error("its header is damaged")]
    Header,
}

/// Reads the bytes of a journal. Whatever does not agree with its checksum ends the records.
///
/// # Errors
/// [`JournalError`] when the header cannot be read.
pub fn parse(bytes: &[u8]) -> Result<Contents, JournalError> {
    line::parse(bytes)
}

/// A journal that is written.
#[derive(Debug)]
pub struct Journal {
    log: SyncedLog,
    identity: Identity,
    sum: String,
}

impl Journal {
    /// A new journal in a run directory, without records.
    pub fn create(directory: &RunDirectory, identity: Identity) -> Result<Self, OutputError> {
        let (header, sum) = line::header(&identity);
        Ok(Self { log: directory.log(&directory.journal(), header.as_bytes())?, identity, sum })
    }

    /// Reads the journal of a run directory; `None` where there is none, since the run was interrupted before.
    ///
    /// # Errors
    /// [`OutputError::Damaged`] when its header cannot be read, [`OutputError::OlderJournal`], or when the operating system
    /// refuses.
    pub fn read(directory: &RunDirectory) -> Result<Option<Contents>, OutputError> {
        let path = directory.journal();
        let read = directory.disk().read(&path, LARGEST);
        let Some(bytes) = OutputError::unless_missing(&path, read)? else {
            return directory.refuse_older_journal().map(|()| None);
        };
        let advised = |error| format!("{error} (without the file `resume` computes all evaluations anew)");
        parse(&bytes).map(Some).map_err(advised).map_err(OutputError::damaged(path))
    }

    /// The evaluations in the journal of a run directory, for a look at them: one that is being written, or was cut short, is
    /// left out. None where there is no journal.
    ///
    /// # Errors
    /// As [`Journal::read`], and [`OutputError::Damaged`] where more follows than a record that was cut short.
    pub fn read_records(directory: &RunDirectory) -> Result<Vec<Record>, OutputError> {
        let Some(contents) = Self::read(directory)? else { return Ok(Vec::new()) };
        let Rest::Damaged(bytes) = contents.rest else { return Ok(contents.records) };
        let message = format!("{bytes} bytes after {} evaluations are not records", contents.records.len());
        Err(OutputError::Damaged { path: directory.journal(), message })
    }

    /// What to say where the journal of a run that has ended lacks evaluations: another program has removed, cut or damaged it.
    pub(super) fn loss(directory: &RunDirectory, evaluations: usize) -> Option<String> {
        let saved = match Self::read(directory) {
            Ok(contents) => contents.map_or(0, |contents| contents.records.len()),
            Err(error) => return Some(error.to_string()),
        };
        (saved < evaluations).then(|| {
            format!(
                "`{}` holds {saved} of {evaluations} evaluations: another program has removed or changed it while the run went on, and \
                 `resume` computes the others anew",
                directory.journal().display()
            )
        })
    }

    /// Keeps a copy of a damaged journal beside it, before it is cut after its whole records.
    pub fn keep_damaged(directory: &RunDirectory) -> Result<(), OutputError> {
        let path = directory.journal();
        let bytes = directory.disk().read(&path, LARGEST).map_err(OutputError::io("read", &path))?;
        directory.write(&directory.damaged_journal(), &bytes)
    }

    /// A journal to append to after what was read of it.
    ///
    /// # Errors
    /// [`OutputError::InUse`] when another process writes it, or when the operating system refuses.
    pub fn reopen(directory: &RunDirectory, contents: &Contents) -> Result<Self, OutputError> {
        let log = directory.reopen(&directory.journal(), contents.length)?;
        Ok(Self { log, identity: contents.identity.clone(), sum: contents.sum.clone() })
    }

    /// Appends a record and waits until it is on the disk.
    ///
    /// # Errors
    /// When the record would not read back as it is, for a number that is not finite or for other sizes than the identity
    /// says: nothing is written then. When the operating system refuses.
    pub fn append(&mut self, record: &Record) -> Result<(), Error> {
        let (line, sum) = line::seal(record, &self.sum);
        if line::parse_record(line.as_bytes(), &self.identity).as_ref() != Some(record) {
            let cause = "an evaluation holds a number that is not finite, or has not the problem's variables and constraints: \
                         the journal does not take it";
            return Err(fluxmorph_optimizer::Error::Optimisation { cause }.into());
        }
        self.log.append(line.as_bytes())?;
        self.sum = sum;
        Ok(())
    }
}

/// Whether a configuration is, to the letter, the one that a directory was made with, or one that its run may be resumed with.
pub(crate) fn is_of_run(
    directory: &RunDirectory,
    manifest: &Manifest,
    (config, source): (&Config, &SourceMap),
) -> Result<bool, Error> {
    let now = blake3_hex(source.text().as_bytes());
    if manifest.config.as_ref().is_none_or(|own| own.blake3 == now) {
        return Ok(true);
    }
    let of_run = Journal::read(directory)?.map(|contents| contents.identity.configuration);
    Ok(of_run.is_some_and(|own| own == configuration_hash(config)))
}

#[cfg(test)]
mod properties;
#[cfg(test)]
mod tests;
