//! Damaged journals: what is cut or changed is dropped, and never read as something else.

use std::collections::BTreeMap;

use super::*;

fn identity() -> Identity {
    Identity { version: "1.2.3".into(), configuration: [1; 32], mesh: [2; 32], variables: 3, constraints: 1 }
}

fn record(number: usize) -> Record {
    let x = number as f64;
    Record {
        row: Evaluation {
            evaluation: number,
            iteration: number,
            objective: 0.1 + x / 3.0,
            ratio: 1.0,
            gradient_norm: 1e-300,
            step_norm: 0.0,
            worst_quality: 0.1,
            min_thickness_m: None,
            max_thickness_m: Some(0.02),
            linear_iterations: 7,
            seconds: 0.25,
            step_to_inversion: None,
            inversion_element: None,
            inversion_region: Some("air \"gap\"".to_owned()),
            round: 1,
            constraints: BTreeMap::from([("c_volume".to_owned(), -0.5)]),
        },
        improved: number.is_multiple_of(2),
        design: vec![x, -0.0, f64::MIN_POSITIVE],
        gradient: vec![1.0 / 3.0, x, -x],
        constraints: vec![(x, vec![0.1, 0.2, 0.3])],
        reference: [number as u8; 32],
        methods: vec![None, Some(Method::Direct), Some(Method::TwoLevel)],
        worst_residual: 1e-12,
        timings: Timings { factor: 1.5, ..Timings::default() },
    }
}

/// A journal of three records, and the ends of header and records.
fn journal() -> (Vec<u8>, Vec<usize>) {
    let (mut bytes, mut chain) = codec::header(&identity());
    let mut ends = vec![bytes.len()];
    for number in 0..3 {
        let (own, next) = codec::record(&record(number), &identity(), &chain);
        bytes.extend(own);
        ends.push(bytes.len());
        chain = next;
    }
    (bytes, ends)
}

#[test]
fn what_is_written_is_read_to_the_last_bit() {
    let contents = parse(&journal().0).expect("a journal");
    assert_eq!(contents.identity, identity());
    assert_eq!(contents.rest.bytes(), 0);
    let expected: Vec<Record> = (0..3).map(record).collect();
    assert_eq!(contents.records, expected);
    let bits = |record: &Record| record.design.iter().map(|p| p.to_bits()).collect::<Vec<_>>();
    assert_eq!(
        contents.records.iter().map(bits).collect::<Vec<_>>(),
        expected.iter().map(bits).collect::<Vec<_>>()
    );
}

#[test]
fn a_journal_cut_anywhere_keeps_its_whole_records() {
    let (bytes, ends) = journal();
    for cut in 0..bytes.len() {
        match parse(&bytes[..cut]) {
            Ok(contents) => {
                let whole = ends.iter().filter(|&&end| end <= cut).count() - 1;
                assert_eq!(contents.records.len(), whole, "cut at {cut}");
                assert_eq!(contents.length as usize, ends[whole]);
                assert_eq!(contents.rest.bytes() as usize, cut - ends[whole]);
            }
            Err(_) => assert!(cut < ends[0], "cut at {cut}"),
        }
    }
}

#[test]
fn a_changed_bit_anywhere_is_found() {
    let (bytes, ends) = journal();
    for at in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[at] ^= 1 << (at % 8);
        match parse(&changed) {
            Ok(contents) => {
                let before = ends.iter().filter(|&&end| end <= at).count() - 1;
                let is_last = before + 2 == ends.len();
                // A length that is wrong may hide what follows: three small records are not enough to tell.
                let is_length = (ends[before]..ends[before] + 4).contains(&at);
                let is_torn = matches!(contents.rest, Rest::Torn(_));
                assert!(is_torn == is_last || is_length, "byte {at}: {:?}", contents.rest);
                assert_eq!(contents.records, (0..before).map(record).collect::<Vec<_>>(), "byte {at}");
            }
            Err(_) => assert!(at < ends[0], "byte {at}"),
        }
    }
}

#[test]
fn records_of_another_place_are_not_taken() {
    let (bytes, ends) = journal();
    // The second record before the first.
    let mut moved = bytes[..ends[0]].to_vec();
    moved.extend(&bytes[ends[1]..ends[2]]);
    moved.extend(&bytes[ends[0]..ends[1]]);
    assert_eq!(parse(&moved).expect("a header").records, []);
}

#[test]
fn another_file_is_refused() {
    assert_eq!(parse(b""), Err(JournalError::NotAJournal));
    assert_eq!(parse(b"evaluation,iteration"), Err(JournalError::NotAJournal));
    let mut other_form = journal().0;
    other_form[8] = 9;
    assert_eq!(parse(&other_form), Err(JournalError::Form { found: 9, expected: 1 }));
}

#[test]
fn the_first_difference_between_identities_is_named() {
    let now = identity();
    assert_eq!(now.check(&now), Ok(()));
    for (other, word) in [
        (Identity { version: "2".into(), ..identity() }, "version 2"),
        (Identity { configuration: [9; 32], ..identity() }, "another configuration (hash 0909090909090909"),
        (Identity { mesh: [9; 32], ..identity() }, "another mesh"),
        (Identity { variables: 4, ..identity() }, "4 and 1 variables"),
    ] {
        let message = other.check(&now).expect_err("different").to_string();
        assert!(message.contains(word), "{message}");
    }
}
