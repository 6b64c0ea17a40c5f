//! The bytes of a journal, all numbers little-endian.
//!
//! Header: mark (8 bytes), version of the form (u32), length of what follows (u32), version of the program (u32 length,
//! UTF-8), hashes of configuration and mesh (32 bytes each), number of variables and of constraints (u32 each), checksum.
//! Record: length of what follows without the checksum (u32), improved (u8), hash of the reference mesh (32), worst
//! residual (f64), six times (f64), objective (f64), design and gradient (n f64 each), for every constraint value and
//! gradient (1 + n f64), methods (u32 count, u8 each), row of the history (u32 length, JSON), checksum.
//! A checksum is the first 16 bytes of BLAKE3 over the checksum before it and the bytes since then.

use fluxmorph_solver::linear::Method;

use super::{Contents, Identity, JournalError, Record, Rest};
use crate::observer::Evaluation;
use fluxmorph_optimizer::problem::Timings;

/// Bytes of a checksum.
pub(super) const CHECKSUM: usize = 16;

const MARK: &[u8; 8] = b"FLXMJRNL";
const FORM: u32 = 1;

/// Bytes of a record beside its designs and derivatives, about; most are the row of the history.
const LIKELY_RECORD: usize = 1200;

type Chain = [u8; CHECKSUM];

/// The header of a journal, and the checksum that the first record carries on.
pub(super) fn header(identity: &Identity) -> (Vec<u8>, Chain) {
    let mut body = Vec::new();
    put_bytes(&mut body, identity.version.as_bytes());
    body.extend(identity.configuration);
    body.extend(identity.mesh);
    put_count(&mut body, identity.variables);
    put_count(&mut body, identity.constraints);
    let mut bytes = MARK.to_vec();
    bytes.extend(FORM.to_le_bytes());
    put_bytes(&mut bytes, &body);
    let chain = checksum(&[0; CHECKSUM], &bytes);
    bytes.extend(chain);
    (bytes, chain)
}

/// A record behind a checksum, and its own.
pub(super) fn record(record: &Record, identity: &Identity, before: &Chain) -> (Vec<u8>, Chain) {
    let Record { row, design, gradient, constraints, timings, .. } = record;
    assert_eq!(
        (design.len(), gradient.len()),
        (identity.variables, identity.variables),
        "one value a variable"
    );
    assert_eq!(constraints.len(), identity.constraints, "one value a constraint");
    let mut body = vec![u8::from(record.improved)];
    body.extend(record.reference);
    let Timings { remesh, assembly, factor, state, adjoint, gradient: derivatives } = *timings;
    put_numbers(&mut body, &[record.worst_residual, remesh, assembly, factor, state, adjoint, derivatives]);
    put_numbers(&mut body, &[row.objective]);
    put_numbers(&mut body, design);
    put_numbers(&mut body, gradient);
    for (value, derivative) in constraints {
        assert_eq!(derivative.len(), identity.variables, "one derivative a variable");
        put_numbers(&mut body, &[*value]);
        put_numbers(&mut body, derivative);
    }
    let method = |method: &Option<Method>| {
        let position = Method::ALL.iter().position(|known| Some(known) == method.as_ref());
        position.map_or(0, |position| position as u8 + 1)
    };
    put_bytes(&mut body, &record.methods.iter().map(method).collect::<Vec<u8>>());
    put_bytes(&mut body, &serde_json::to_vec(row).expect("numbers and text have a JSON form"));
    let mut bytes = Vec::with_capacity(body.len() + 4 + CHECKSUM);
    put_bytes(&mut bytes, &body);
    let chain = checksum(before, &bytes);
    bytes.extend(chain);
    (bytes, chain)
}

/// All whole records of a journal.
pub(super) fn parse(bytes: &[u8]) -> Result<Contents, JournalError> {
    let mut cursor = Cursor { bytes, at: 0 };
    if cursor.take(MARK.len()) != Some(MARK) {
        return Err(JournalError::NotAJournal);
    }
    let found = cursor.count().ok_or(JournalError::Header)? as u32;
    if found != FORM {
        return Err(JournalError::Form { found, expected: FORM });
    }
    let body = cursor.sized().ok_or(JournalError::Header)?;
    let identity = parse_identity(body).ok_or(JournalError::Header)?;
    let mut chain = cursor.checked(0, &[0; CHECKSUM]).ok_or(JournalError::Header)?;
    let header = cursor.at;
    let (mut records, mut whole) = (Vec::new(), header);
    while let Some(body) = cursor.sized()
        && let Some(next) = cursor.checked(whole, &chain)
        && let Some(record) = parse_record(body, &identity)
    {
        records.push(record);
        (chain, whole) = (next, cursor.at);
    }
    let rest = rest(&bytes[whole..], &identity, [header, whole], records.len());
    Ok(Contents { identity, records, length: whole as u64, rest, chain })
}

/// What is behind the whole records, which stand from `header` to `whole`.
fn rest(rest: &[u8], identity: &Identity, [header, whole]: [usize; 2], records: usize) -> Rest {
    let Identity { variables, constraints, .. } = *identity;
    let numbers = (2 + constraints).saturating_mul(variables);
    if rest.is_empty() {
        return Rest::Nothing;
    }
    let length = Cursor { bytes: rest, at: 0 }.count();
    let has_more = length.is_some_and(|length| length.saturating_add(4 + CHECKSUM) < rest.len());
    // Records hardly differ in length: more than two are no torn one, whatever its own length says.
    let usual = (whole - header)
        .checked_div(records)
        .unwrap_or(numbers.saturating_mul(8).saturating_add(LIKELY_RECORD));
    let is_long = rest.len() / 2 > usual;
    if has_more || is_long { Rest::Damaged(rest.len() as u64) } else { Rest::Torn(rest.len() as u64) }
}

fn parse_identity(body: &[u8]) -> Option<Identity> {
    let mut cursor = Cursor { bytes: body, at: 0 };
    let identity = Identity {
        version: String::from_utf8(cursor.sized()?.to_vec()).ok()?,
        configuration: cursor.array()?,
        mesh: cursor.array()?,
        variables: cursor.count()?,
        constraints: cursor.count()?,
    };
    cursor.is_at_end().then_some(identity)
}

fn parse_record(body: &[u8], identity: &Identity) -> Option<Record> {
    let mut cursor = Cursor { bytes: body, at: 0 };
    let n = identity.variables;
    let improved = match cursor.take(1)? {
        [0] => false,
        [1] => true,
        _ => return None,
    };
    let reference = cursor.array()?;
    let worst_residual = cursor.number()?;
    let mut time = || cursor.number();
    let timings = Timings {
        remesh: time()?,
        assembly: time()?,
        factor: time()?,
        state: time()?,
        adjoint: time()?,
        gradient: time()?,
    };
    let objective = cursor.number()?;
    let (design, gradient) = (cursor.numbers(n)?, cursor.numbers(n)?);
    let mut constraints = Vec::new();
    for _ in 0..identity.constraints {
        constraints.push((cursor.number()?, cursor.numbers(n)?));
    }
    let method = |&byte: &u8| match byte {
        0 => Some(None),
        _ => Method::ALL.get(usize::from(byte) - 1).map(|&method| Some(method)),
    };
    let methods = cursor.sized()?.iter().map(method).collect::<Option<Vec<_>>>()?;
    let row: Evaluation = serde_json::from_slice(cursor.sized()?).ok()?;
    let agrees = row.objective.to_bits() == objective.to_bits() && cursor.is_at_end();
    let record =
        Record { row, improved, design, gradient, constraints, reference, methods, worst_residual, timings };
    agrees.then_some(record)
}

fn checksum(before: &Chain, bytes: &[u8]) -> Chain {
    let mut hasher = blake3::Hasher::new();
    hasher.update(before).update(bytes);
    let hash = hasher.finalize();
    std::array::from_fn(|k| hash.as_bytes()[k])
}

fn put_count(bytes: &mut Vec<u8>, count: usize) {
    let count = u32::try_from(count).expect("fewer than 2^32 of anything in a record");
    bytes.extend(count.to_le_bytes());
}

fn put_bytes(bytes: &mut Vec<u8>, content: &[u8]) {
    put_count(bytes, content.len());
    bytes.extend(content);
}

fn put_numbers(bytes: &mut Vec<u8>, numbers: &[f64]) {
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
}

/// Reads on in bytes; `None` where they end.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn count(&mut self) -> Option<usize> {
        Some(u32::from_le_bytes(self.array()?) as usize)
    }

    fn sized(&mut self) -> Option<&'a [u8]> {
        let length = self.count()?;
        self.take(length)
    }

    fn number(&mut self) -> Option<f64> {
        Some(f64::from_le_bytes(self.array()?))
    }

    fn numbers(&mut self, count: usize) -> Option<Vec<f64>> {
        let bytes = self.take(count.checked_mul(8)?)?;
        Some(
            bytes.chunks_exact(8).filter_map(|chunk| chunk.try_into().ok().map(f64::from_le_bytes)).collect(),
        )
    }

    /// The checksum that stands here, if it is that of the bytes since `start`.
    fn checked(&mut self, start: usize, before: &Chain) -> Option<Chain> {
        let expected = checksum(before, &self.bytes[start..self.at]);
        (self.array::<CHECKSUM>()? == expected).then_some(expected)
    }

    fn is_at_end(&self) -> bool {
        self.at == self.bytes.len()
    }
}
