//! `journal.bin`: every evaluation of a run with its raw bits, so that a run can go on where it was broken off.
//!
//! NLopt keeps its state to itself, but its methods are deterministic: started afresh and told the same objectives,
//! constraints and gradients, it asks for the same designs and is in the same state at the end. The journal holds what it
//! was told. [`fluxmorph_optimizer::driver`] answers from it as long as designs, rounds and reference meshes agree to the last bit.
//!
//! The file is a header and records, appended and synced one by one (`codec` has the bytes). Each carries a checksum over
//! itself and the checksum before it: a record that was cut short, changed or moved ends what is read. A journal belongs to
//! an [`Identity`]: program version, configuration and mesh.

mod codec;
mod identity;

use fluxmorph_optimizer::driver::Record;

use crate::output::{OutputError, RunDirectory, SyncedLog};

pub use identity::{Identity, Mismatch, configuration_hash, mesh_hash};

/// Largest journal that is read [bytes]: a million evaluations of a thousand variables.
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
    /// What is behind them.
    pub rest: Rest,
    /// Checksum that the next record carries on.
    chain: [u8; codec::CHECKSUM],
}

/// What is behind the whole records of a journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// Nothing.
    Nothing,
    /// The beginning of a record that a crash cut short, of so many bytes.
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
pub enum JournalError {
    /// The file begins otherwise.
    #[error("it does not begin as a journal of fluxmorph does")]
    NotAJournal,
    /// The form is that of another program version.
    #[error("its form has the version {found}, expected {expected}")]
    Form {
        /// Version in the file.
        found: u32,
        /// Version that is read.
        expected: u32,
    },
    /// The header is damaged.
    #[error("its header is damaged")]
    Header,
}

/// Reads the bytes of a journal. Whatever does not agree with its checksum ends the records.
///
/// # Errors
/// [`JournalError`] when the header cannot be read.
pub fn parse(bytes: &[u8]) -> Result<Contents, JournalError> {
    codec::parse(bytes)
}

/// A journal that is written.
#[derive(Debug)]
pub struct Journal {
    log: SyncedLog,
    identity: Identity,
    chain: [u8; codec::CHECKSUM],
}

impl Journal {
    /// A new journal in a run directory, without records.
    ///
    /// # Errors
    /// When the operating system refuses.
    pub fn create(directory: &RunDirectory, identity: Identity) -> Result<Self, OutputError> {
        let (header, chain) = codec::header(&identity);
        Ok(Self { log: directory.log(&directory.journal(), &header)?, identity, chain })
    }

    /// Reads the journal of a run directory; `None` where there is none, since the run was broken off before.
    ///
    /// # Errors
    /// [`OutputError::Damaged`] when its header cannot be read, or when the operating system refuses.
    pub fn read(directory: &RunDirectory) -> Result<Option<Contents>, OutputError> {
        let path = directory.journal();
        match directory.disk().read(&path, LARGEST) {
            Ok(bytes) => match parse(&bytes) {
                Ok(contents) => Ok(Some(contents)),
                Err(error) => {
                    let message = format!("{error} (without the file all evaluations are computed anew)");
                    Err(OutputError::Damaged { path, message })
                }
            },
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(OutputError::io("read", path)(error)),
        }
    }

    /// Keeps a copy of a damaged journal beside it, before it is cut behind its whole records.
    ///
    /// # Errors
    /// When the operating system refuses.
    pub fn keep_damaged(directory: &RunDirectory) -> Result<(), OutputError> {
        let path = directory.journal();
        let bytes = directory.disk().read(&path, LARGEST).map_err(OutputError::io("read", &path))?;
        directory.write(&directory.damaged_journal(), &bytes)
    }

    /// A journal to go on with behind what was read of it.
    ///
    /// # Errors
    /// [`OutputError::InUse`] when another process writes it, or when the operating system refuses.
    pub fn reopen(directory: &RunDirectory, contents: &Contents) -> Result<Self, OutputError> {
        let log = directory.reopened(&directory.journal(), contents.length)?;
        Ok(Self { log, identity: contents.identity.clone(), chain: contents.chain })
    }

    /// Appends a record and waits until it is on the disk.
    ///
    /// # Errors
    /// When the operating system refuses.
    ///
    /// # Panics
    /// If the record has another number of variables or constraints than the identity says.
    pub fn append(&mut self, record: &Record) -> Result<(), OutputError> {
        let (bytes, chain) = codec::record(record, &self.identity, &self.chain);
        self.log.append(&bytes)?;
        self.chain = chain;
        Ok(())
    }
}

#[cfg(test)]
mod properties;
#[cfg(test)]
mod tests;
