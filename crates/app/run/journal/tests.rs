//! Damaged journals: what is cut or changed is dropped, and never read as something else.

use std::collections::BTreeMap;

use fluxmorph_optimizer::problem::Timings;
use fluxmorph_solver::linear::Method;

use super::*;
use crate::files::{OverwritePolicy, StopReason, system_disk};
use crate::show::Evaluation;

pub(super) fn identity() -> Identity {
    Identity {
        version: "1.2.3".into(),
        configuration: "1".repeat(64),
        mesh: "2".repeat(64),
        tables: "3".repeat(64),
        variables: 3,
        constraints: 1,
    }
}

pub(super) fn record(number: usize) -> Record {
    let x = number as f64;
    Record {
        row: Evaluation {
            evaluation: number,
            iteration: number,
            objective: 0.1 + x / 3.0,
            ratio: 1.0,
            gradient_norm: 1e-300,
            max_thickness_m: Some(0.02),
            linear_iterations: 7,
            inversion_region: Some("air,\"sum\":\"gap\"".to_owned()),
            constraints: BTreeMap::from([("c_volume".to_owned(), -0.5)]),
            ..Evaluation::default()
        },
        improved: number.is_multiple_of(2),
        stepped_back: number.is_multiple_of(3).then_some(StopReason::MaxEvaluations),
        design: vec![x, -0.0, f64::MIN_POSITIVE],
        gradient: vec![1.0 / 3.0, x, -x],
        constraints: vec![(x, vec![0.1, 0.2, 0.3])],
        members: vec![(-x, vec![0.4, 0.5, 0.6])],
        methods: vec![None, Some(Method::Direct), Some(Method::TwoLevel)],
        worst_residual: 1e-12,
        timings: Timings { factor: 1.5, ..Timings::default() },
    }
}

/// The bytes of a journal with the ends of its header and records, and what it holds.
#[derive(Clone, Debug)]
pub(super) struct Written {
    pub(super) bytes: Vec<u8>,
    pub(super) ends: Vec<usize>,
    pub(super) identity: Identity,
    pub(super) records: Vec<Record>,
}

impl Written {
    pub(super) fn new(identity: Identity, records: Vec<Record>) -> Self {
        let (header, mut sum) = line::header(&identity);
        let mut bytes = header.into_bytes();
        let mut ends = vec![bytes.len()];
        for record in &records {
            let (own, next) = line::seal(record, &sum);
            bytes.extend(own.into_bytes());
            ends.push(bytes.len());
            sum = next;
        }
        Self { bytes, ends, identity, records }
    }

    /// Of three records.
    pub(super) fn example() -> Self {
        Self::new(identity(), (0..3).map(record).collect())
    }

    /// Whole records before a byte; `None` where the header is not whole.
    pub(super) fn whole_before(&self, at: usize) -> Option<usize> {
        self.ends.iter().filter(|&&end| end <= at).count().checked_sub(1)
    }

    /// Bytes that agree with these before `at` have the whole records before it; returns what is after them.
    #[track_caller]
    pub(super) fn assert_prefix(&self, bytes: &[u8], at: usize) -> Option<Rest> {
        // Decimal digits are those of one number alone.
        let text = |records: &[Record]| records.iter().map(|r| line::seal(r, "").0).collect::<Vec<_>>();
        match (parse(bytes), self.whole_before(at)) {
            (Ok(contents), Some(whole)) => {
                assert_eq!(contents.identity, self.identity);
                assert_eq!(text(&contents.records), text(&self.records[..whole]), "byte {at}");
                assert_eq!(contents.length as usize, self.ends[whole]);
                assert_eq!(contents.rest.bytes() as usize, bytes.len() - self.ends[whole]);
                Some(contents.rest)
            }
            (Err(_), None) => None,
            (other, whole) => panic!("byte {at}, {whole:?}: {other:?}"),
        }
    }
}

#[test]
fn a_journal_cut_anywhere_keeps_its_whole_records() {
    let written = Written::example();
    for cut in 0..=written.bytes.len() {
        let rest = written.assert_prefix(&written.bytes[..cut], cut);
        let is_end = written.ends.contains(&cut);
        assert!(rest.is_none_or(|rest| (rest == Rest::Nothing) == is_end), "{rest:?} at {cut}");
        assert!(!matches!(rest, Some(Rest::Damaged(_))), "{rest:?} at {cut}");
    }
}

#[test]
fn every_changed_bit_is_found() {
    let written = Written::example();
    for bit in 0..8 * written.bytes.len() {
        let (at, mut bytes) = (bit / 8, written.bytes.clone());
        bytes[at] ^= 1 << (bit % 8);
        let Some(rest) = written.assert_prefix(&bytes, at) else { continue };
        let is_in_last = at >= written.ends[2];
        // A new line in the last record makes two of it.
        let is_torn = is_in_last && bytes[at] != b'\n';
        assert_eq!(matches!(rest, Rest::Torn(_)), is_torn, "bit {bit}: {rest:?}");
    }
}

#[test]
fn one_record_that_is_not_whole_is_torn_and_more_is_damage() {
    let Written { bytes, ends, .. } = Written::example();
    let (usual, last) = (ends[3] - ends[2], &bytes[ends[2]..]);
    let without_end = &last[..last.len() - 1];
    for (behind, is_torn) in [
        (vec![0; usual], true),
        (vec![0; 3 * usual], false),
        (last.to_vec(), true),
        ([last, last].concat(), false),
        ([without_end, last].concat(), false),
        (b"\n".to_vec(), true),
        (b"\n\n".to_vec(), false),
    ] {
        let rest = parse(&[&bytes[..], &behind].concat()).expect("a header").rest;
        let length = behind.len() as u64;
        let expected = if is_torn { Rest::Torn(length) } else { Rest::Damaged(length) };
        assert_eq!(rest, expected, "{}", String::from_utf8_lossy(&behind));
    }
}

#[test]
fn records_of_another_place_are_not_taken() {
    let Written { bytes, ends, .. } = Written::example();
    // The second record before the first.
    let moved = [&bytes[..ends[0]], &bytes[ends[1]..ends[2]], &bytes[ends[0]..ends[1]]].concat();
    assert_eq!(parse(&moved).expect("a header").records, []);
}

#[test]
fn records_of_other_sizes_are_not_taken() {
    let other = Identity { variables: 2, ..identity() };
    assert_eq!(parse(&Written::new(other, vec![record(0)]).bytes).expect("a header").records, []);
    let mut long = record(0);
    long.row.inversion_region = Some("3".repeat(1 << 24));
    let contents = parse(&Written::new(identity(), vec![record(0), long]).bytes).expect("a header");
    assert!(contents.records.len() == 1 && matches!(contents.rest, Rest::Damaged(_)), "{:?}", contents.rest);
}

#[test]
fn another_file_is_refused() {
    let refused = |text: &str| parse(text.as_bytes()).expect_err("no journal");
    assert_eq!(refused(""), JournalError::NotAJournal);
    assert_eq!(refused("evaluation,iteration"), JournalError::NotAJournal);
    assert_eq!(refused("FLXMJRNL\x01"), JournalError::NotAJournal);
    let of_later = refused("{\"fluxmorph_journal\":9,\"of\":\"later\"}\n");
    assert_eq!(of_later, JournalError::Form { found: 9, expected: 2 });
    assert_eq!(refused("{\"fluxmorph_journal\":2}\n"), JournalError::Header);
    for odd in [
        Identity { version: "1\x1b[2J".into(), ..identity() },
        Identity { version: "1".repeat(65), ..identity() },
        Identity { mesh: "ä".repeat(32), ..identity() },
        Identity { tables: "ä".repeat(32), ..identity() },
    ] {
        assert_eq!(parse(&Written::new(odd, Vec::new()).bytes), Err(JournalError::Header));
    }
}

#[test]
fn a_line_is_json_that_anybody_can_read() {
    let text = String::from_utf8(Written::example().bytes).expect("text");
    let lines: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(lines[0]["variables"], 3);
    assert_eq!(lines[2]["row"]["c_volume"], -0.5);
    assert_eq!(lines[2]["methods"], serde_json::json!([null, "direct", "two_level"]));
    assert_eq!(lines[2]["constraints"], serde_json::json!([[1.0, [0.1, 0.2, 0.3]]]));
    assert_eq!(lines[2]["timings_s"]["factor"], 1.5);
}

#[test]
fn what_would_not_read_back_is_not_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let directory = RunDirectory::create(&system_disk(), folder.path(), OverwritePolicy::Keep).expect("made");
    let mut journal = Journal::create(&directory, identity()).expect("created");
    journal.append(&record(0)).expect("written");
    let changes: [fn(&mut Record); 7] = [
        |record| record.design[1] = f64::NAN,
        |record| record.gradient[0] = f64::INFINITY,
        |record| record.constraints[0].0 = f64::NEG_INFINITY,
        |record| record.row.max_thickness_m = Some(f64::NAN),
        |record| record.timings.state = f64::NAN,
        |record| record.design.truncate(2),
        |record| record.constraints.clear(),
    ];
    for change in changes {
        let mut changed = record(1);
        change(&mut changed);
        let error = journal.append(&changed).expect_err("refused");
        assert!(error.to_string().contains("not finite"), "{error}");
    }
    journal.append(&record(1)).expect("written");
    assert_eq!(Journal::read_records(&directory).expect("read"), [record(0), record(1)]);
}

#[test]
fn the_first_difference_between_identities_is_named() {
    let now = identity();
    assert_eq!(now.check(&now), Ok(()));
    for (other, word) in [
        (Identity { version: "2".into(), ..identity() }, "version 2"),
        (
            Identity { configuration: "09".repeat(32), ..identity() },
            "another configuration (hash 0909090909090909,",
        ),
        (Identity { mesh: "9".repeat(64), ..identity() }, "another mesh"),
        (Identity { tables: String::new(), ..identity() }, "other B–H tables"),
        (Identity { variables: 4, ..identity() }, "4 and 1 variables"),
    ] {
        let message = other.check(&now).expect_err("different");
        assert!(message.contains(word), "{message}");
    }
}
