//! Journals by chance: any bytes, any records, cut at any byte, with any bit changed.

use std::collections::BTreeMap;
use std::path::Path;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;

use super::*;

/// Any number with its bits, those that are none included.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>(), any::<u64>().prop_map(f64::from_bits), Just(0.0), Just(-0.0)]
}

/// A number that the history takes.
fn finite() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("finite", |x| x.is_finite())
}

fn row() -> impl Strategy<Value = Evaluation> {
    let counts = (0usize..1000, 0usize..1000, 0usize..5);
    let numbers = (finite(), finite(), finite(), finite());
    let rest = (proptest::option::of(finite()), proptest::option::of("\\PC{0,12}"));
    (counts, numbers, rest, proptest::collection::btree_map("\\PC{1,8}", finite(), 0..3)).prop_map(
        |(
            (evaluation, linear_iterations, round),
            (objective, ratio, seconds, step),
            (least, region),
            constraints,
        )| {
            let constraints: BTreeMap<String, f64> = constraints;
            Evaluation {
                evaluation,
                iteration: evaluation,
                objective,
                ratio,
                gradient_norm: step.abs(),
                step_norm: step,
                worst_quality: 0.5,
                min_thickness_m: least,
                max_thickness_m: None,
                linear_iterations,
                seconds,
                step_to_inversion: least,
                inversion_element: None,
                inversion_region: region,
                round,
                constraints,
            }
        },
    )
}

fn record(variables: usize, constraints: usize) -> impl Strategy<Value = Record> {
    let methods = prop_oneof![Just(None), (0..Method::ALL.len()).prop_map(|at| Some(Method::ALL[at]))];
    let numbers = (vec(number(), variables), vec(number(), variables));
    let limits = vec((number(), vec(number(), variables)), constraints);
    (row(), any::<bool>(), numbers, limits, any::<[u8; 32]>(), vec(methods, 0..4), number()).prop_map(
        |(row, improved, (design, gradient), constraints, reference, methods, worst_residual)| Record {
            row,
            improved,
            design,
            gradient,
            constraints,
            reference,
            methods,
            worst_residual,
            timings: Timings { state: worst_residual, ..Timings::default() },
        },
    )
}

/// Bytes of a journal with the ends of its header and records, and the records.
#[derive(Clone, Debug)]
struct Written {
    bytes: Vec<u8>,
    ends: Vec<usize>,
    identity: Identity,
    records: Vec<Record>,
}

fn written() -> impl Strategy<Value = Written> {
    (0usize..5, 0usize..3).prop_flat_map(|(variables, constraints)| {
        let hashes = (any::<[u8; 32]>(), any::<[u8; 32]>(), "[0-9.a-z]{0,10}");
        (hashes, vec(record(variables, constraints), 0..4)).prop_map(
            move |((configuration, mesh, version), records)| {
                let identity = Identity { version, configuration, mesh, variables, constraints };
                write(identity, records)
            },
        )
    })
}

fn write(identity: Identity, records: Vec<Record>) -> Written {
    let (mut bytes, mut chain) = codec::header(&identity);
    let mut ends = vec![bytes.len()];
    for record in &records {
        let (own, next) = codec::record(record, &identity, &chain);
        bytes.extend(own);
        ends.push(bytes.len());
        chain = next;
    }
    Written { bytes, ends, identity, records }
}

/// All bits of records, which may hold numbers that are not equal to themselves.
fn bits(records: &[Record], identity: &Identity) -> Vec<Vec<u8>> {
    let chain = [0; codec::CHECKSUM];
    records.iter().map(|record| codec::record(record, identity, &chain).0).collect()
}

impl Written {
    /// Whole records before a byte; `None` where the header is not whole.
    fn whole_before(&self, at: usize) -> Option<usize> {
        self.ends.iter().filter(|&&end| end <= at).count().checked_sub(1)
    }

    #[track_caller]
    fn assert_holds(&self, contents: &Contents, count: usize) {
        assert_eq!(contents.identity, self.identity);
        assert_eq!(bits(&contents.records, &self.identity), bits(&self.records[..count], &self.identity));
        assert_eq!(contents.length as usize, self.ends[count]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn any_bytes_are_read_or_refused(bytes in vec(any::<u8>(), 0..300)) {
        prop_assert!(parse(&bytes).is_err());
        let behind_a_mark = [b"FLXMJRNL\x01\0\0\0", &bytes[..]].concat();
        prop_assert!(parse(&behind_a_mark).is_err());
    }

    #[test]
    fn any_records_are_read_back_to_the_bit(written in written()) {
        let contents = parse(&written.bytes).expect("as written");
        written.assert_holds(&contents, written.records.len());
        prop_assert_eq!(contents.rest.bytes(), 0);
    }

    #[test]
    fn any_bytes_behind_records_are_dropped(written in written(), tail in vec(any::<u8>(), 0..200)) {
        let contents = parse(&[&written.bytes[..], &tail].concat()).expect("the header is whole");
        written.assert_holds(&contents, written.records.len());
        prop_assert_eq!(contents.rest.bytes() as usize, tail.len());
    }

    #[test]
    fn cut_at_any_byte_a_journal_is_a_prefix_of_its_records(written in written(), cut in any::<Index>()) {
        let cut = cut.index(written.bytes.len());
        match (parse(&written.bytes[..cut]), written.whole_before(cut)) {
            (Ok(contents), Some(whole)) => written.assert_holds(&contents, whole),
            (Err(_), None) => {}
            (other, whole) => prop_assert!(false, "{whole:?}: {other:?}"),
        }
    }

    #[test]
    fn changed_bits_shorten_a_journal_and_never_alter_it(
        written in written(),
        flips in vec((any::<Index>(), 0u8..8), 1..4),
    ) {
        let mut bytes = written.bytes.clone();
        for (at, bit) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        // Two of the changes may undo one another.
        let Some(first) = (0..bytes.len()).find(|&at| bytes[at] != written.bytes[at]) else { return Ok(()) };
        match (parse(&bytes), written.whole_before(first)) {
            (Ok(contents), Some(whole)) => written.assert_holds(&contents, whole),
            (Err(_), None) => {}
            (other, whole) => prop_assert!(false, "{whole:?}: {other:?}"),
        }
    }
}

fn example() -> Written {
    let identity = Identity {
        version: "0.1.0".into(),
        configuration: [1; 32],
        mesh: [2; 32],
        variables: 2,
        constraints: 1,
    };
    let row = |evaluation: usize| Evaluation {
        evaluation,
        iteration: evaluation,
        objective: 0.5 + evaluation as f64,
        ratio: 1.0,
        gradient_norm: 1.0,
        step_norm: 0.0,
        worst_quality: 0.25,
        min_thickness_m: None,
        max_thickness_m: Some(0.02),
        linear_iterations: 7,
        seconds: 0.25,
        step_to_inversion: None,
        inversion_element: None,
        inversion_region: Some("air".to_owned()),
        round: 1,
        constraints: BTreeMap::from([("volume".to_owned(), -0.5)]),
    };
    let record = |evaluation: usize| Record {
        row: row(evaluation),
        improved: evaluation.is_multiple_of(2),
        design: vec![0.25, -0.0],
        gradient: vec![1.0, f64::NAN],
        constraints: vec![(-0.5, vec![0.1, 0.2])],
        reference: [3; 32],
        methods: vec![None, Some(Method::ALL[0])],
        worst_residual: 1e-12,
        timings: Timings::default(),
    };
    write(identity, (0..3).map(record).collect())
}

#[test]
fn every_changed_bit_of_a_journal_is_found() {
    let written = example();
    for bit in 0..8 * written.bytes.len() {
        let mut bytes = written.bytes.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        match (parse(&bytes), written.whole_before(bit / 8)) {
            (Ok(contents), Some(whole)) => written.assert_holds(&contents, whole),
            (Err(_), None) => {}
            (other, whole) => panic!("bit {bit}, {whole:?}: {other:?}"),
        }
    }
}

/// Writes the seeds of the fuzz target: `cargo test --release -p fluxmorph-optimizer --lib -- --ignored write_the_journals`.
#[test]
#[ignore = "writes fuzz/seeds"]
fn write_the_journals() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/journal");
    std::fs::create_dir_all(&folder).expect("a folder");
    let written = example();
    // The target makes the checksums right where the first byte is odd.
    for (name, choice, end) in [("whole", 0, 3), ("signed", 1, 3), ("one", 1, 1), ("header", 1, 0)] {
        let bytes = [&[choice], &written.bytes[..written.ends[end]]].concat();
        std::fs::write(folder.join(name), bytes).expect("a file");
    }
}

#[test]
fn every_seed_of_the_fuzz_target_is_a_journal() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/journal");
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("readable").path();
        let bytes = std::fs::read(&path).expect("readable");
        let contents = parse(&bytes[1..]).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(contents.rest.bytes(), 0, "{}", path.display());
    }
}
