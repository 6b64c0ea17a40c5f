//! The lines of a journal: JSON objects that end with a checksum.
//!
//! The first line is the header, `{"fluxmorph_journal":2,` and the fields of an [`Identity`]; every other one has the fields
//! of a [`Record`]. The last field, `"sum"`, has the first 32 hexadecimal digits of BLAKE3 over the sum of the line before
//! (the header: over nothing) and the bytes of its own line before `,"sum"`.

use fluxmorph_optimizer::driver::Record;
use serde::{Deserialize, Serialize};

use super::{Contents, Identity, JournalError, Rest};

/// How a journal begins.
const MARK: &str = "{\"fluxmorph_journal\":";

/// Version of the form. The first one had other bytes, in a file of another name.
const FORM: u32 = 2;

/// What stands before a checksum, and nowhere else: quotes within texts are escaped.
const SUM: &str = ",\"sum\":\"";

/// Hexadecimal digits of a checksum.
const DIGITS: usize = 32;

/// Bytes from [`SUM`] to the end of a line.
const TAIL: usize = SUM.len() + DIGITS + "\"}\n".len();

/// Longest header [bytes].
const LONGEST_HEADER: usize = 4096;

/// Most characters of the program's version in a header.
const LONGEST_VERSION: usize = 64;

#[derive(Deserialize)]
struct Form {
    fluxmorph_journal: u32,
}

#[derive(Serialize)]
struct Header<'a> {
    fluxmorph_journal: u32,
    #[serde(flatten)]
    identity: &'a Identity,
}

/// The header of a journal, and its checksum.
pub(super) fn header(identity: &Identity) -> (String, String) {
    seal(&Header { fluxmorph_journal: FORM, identity }, "")
}

/// The line of a header or a record after a checksum, and its own checksum.
pub(super) fn seal(object: &impl Serialize, before: &str) -> (String, String) {
    let mut line = serde_json::to_string(object).expect("numbers and text have a JSON form");
    line.pop();
    let sum = checksum(before, line.as_bytes());
    line.push_str(&tail(&sum));
    (line, sum)
}

pub(super) fn tail(sum: &str) -> String {
    format!("{SUM}{sum}\"}}\n")
}

pub(super) fn checksum(before: &str, body: &[u8]) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(before.as_bytes()).update(body);
    hasher.finalize().to_hex()[..DIGITS].to_owned()
}

/// All whole records of a journal.
pub(super) fn parse(bytes: &[u8]) -> Result<Contents, JournalError> {
    let (identity, header, mut sum) = parse_header(bytes)?;
    let (mut records, mut whole) = (Vec::new(), header);
    while let Some(line) = first_line(&bytes[whole..], longest_record(&identity))
        && let Some(next) = sum_of(line, &sum)
        && let Some(record) = parse_record(line, &identity)
    {
        records.push(record);
        (sum, whole) = (next, whole + line.len());
    }
    let rest = rest(&bytes[whole..], (whole - header).checked_div(records.len()));
    Ok(Contents { identity, records, length: whole as u64, rest, sum })
}

/// What a journal belongs to, the length of its header, and the checksum that the first record carries on.
fn parse_header(bytes: &[u8]) -> Result<(Identity, usize, String), JournalError> {
    if !bytes.starts_with(MARK.as_bytes()) {
        return Err(JournalError::NotAJournal);
    }
    let line = first_line(bytes, LONGEST_HEADER).ok_or(JournalError::Header)?;
    let Form { fluxmorph_journal: found } = serde_json::from_slice(line).map_err(|_| JournalError::Header)?;
    if found != FORM {
        return Err(JournalError::Form { found, expected: FORM });
    }
    let sum = sum_of(line, "").ok_or(JournalError::Header)?;
    let identity: Identity = serde_json::from_slice(line).map_err(|_| JournalError::Header)?;
    let is_hash = |text: &str| text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let is_version = |text: &str| text.len() <= LONGEST_VERSION && !text.contains(char::is_control);
    let Identity { version, configuration, mesh, tables, .. } = &identity;
    let hashes = is_hash(configuration) && is_hash(mesh) && (tables.is_empty() || is_hash(tables));
    let is_sound = is_version(version) && hashes;
    if is_sound { Ok((identity, line.len(), sum)) } else { Err(JournalError::Header) }
}

/// The record in a line, if it has the sizes that the header says.
pub(super) fn parse_record(line: &[u8], identity: &Identity) -> Option<Record> {
    let Identity { variables, constraints, .. } = *identity;
    let record: Record = serde_json::from_slice(line).ok()?;
    let derivatives = record.constraints.iter().map(|(_, derivative)| derivative);
    let fits = record.constraints.len() == constraints
        && [&record.design, &record.gradient].into_iter().chain(derivatives).all(|v| v.len() == variables);
    (fits && line.len() <= longest_record(identity)).then_some(record)
}

/// The first line with its end; `None` where it has none within so many bytes.
fn first_line(bytes: &[u8], longest: usize) -> Option<&[u8]> {
    let end = bytes.iter().take(longest).position(|&byte| byte == b'\n')?;
    Some(&bytes[..=end])
}

/// The checksum of a line, if it is right after another one.
fn sum_of(line: &[u8], before: &str) -> Option<String> {
    let (body, own) = line.split_at_checked(line.len().checked_sub(TAIL)?)?;
    let sum = checksum(before, body);
    (own == tail(&sum).as_bytes()).then_some(sum)
}

/// Bytes that no record of such sizes exceeds. The names in it come from a configuration of at most 1 MiB, and an escaped
/// character has six bytes.
fn longest_record(identity: &Identity) -> usize {
    let numbers = identity.constraints.saturating_add(2).saturating_mul(identity.variables.saturating_add(1));
    numbers.saturating_mul(32).saturating_add(1 << 23)
}

/// What is after the whole records. One that was cut short is a part of one line, and hardly longer than is usual.
fn rest(rest: &[u8], usual: Option<usize>) -> Rest {
    let bytes = rest.len() as u64;
    let is_one_line = rest.iter().rev().skip(1).all(|&byte| byte != b'\n');
    let sums = rest.windows(SUM.len()).filter(|window| *window == SUM.as_bytes()).count();
    match bytes {
        0 => Rest::Nothing,
        _ if is_one_line && sums <= 1 && usual.is_none_or(|usual| rest.len() / 2 <= usual) => {
            Rest::Torn(bytes)
        }
        _ => Rest::Damaged(bytes),
    }
}
