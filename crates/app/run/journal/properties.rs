//! Journals by chance: any bytes, any records, any bytes behind them, records with changed characters and a right checksum.

use std::path::{Path, PathBuf};

use fluxmorph_optimizer::problem::Timings;
use fluxmorph_solver::linear::Method;
use proptest::collection::{btree_map, vec};
use proptest::option::of;
use proptest::prelude::*;
use proptest::sample::{Index, select};

use super::tests::{Written, record as example_record};
use super::*;
use crate::show::Evaluation;

/// Any number, by its value or its bits.
fn number() -> impl Strategy<Value = f64> {
    let any_bits = any::<u64>().prop_map(f64::from_bits);
    prop_oneof![any::<f64>(), any_bits, Just(0.0), Just(-0.0)].prop_filter("finite", |x| x.is_finite())
}

fn record(variables: usize, constraints: usize) -> impl Strategy<Value = Record> {
    let vectors = vec(vec(number(), variables), 2 + constraints);
    let names = (btree_map("c_\\PC{1,8}", number(), 0..3), of("\\PC{0,12}"));
    let methods = vec(of(select(&Method::ALL[..])), 0..4);
    (0usize..1000, any::<bool>(), vec(number(), 6 + constraints), vectors, names, methods).prop_map(
        |(count, improved, numbers, vectors, (row_constraints, inversion_region), methods)| Record {
            row: Evaluation {
                evaluation: count,
                objective: numbers[0],
                ratio: numbers[1],
                step_norm: numbers[2],
                min_thickness_m: Some(numbers[3]).filter(|_| improved),
                linear_iterations: count,
                inversion_region,
                constraints: row_constraints,
                ..example_record(0).row
            },
            improved,
            design: vectors[0].clone(),
            gradient: vectors[1].clone(),
            constraints: numbers[6..].iter().copied().zip(vectors[2..].iter().cloned()).collect(),
            methods,
            worst_residual: numbers[4],
            timings: Timings { state: numbers[5], ..Timings::default() },
            ..example_record(0)
        },
    )
}

fn written() -> impl Strategy<Value = Written> {
    (0usize..5, 0usize..3).prop_flat_map(|(variables, constraints)| {
        let texts = ("[0-9a-f]{64}", "[0-9a-f]{64}", "[0-9.a-z]{0,10}");
        (texts, vec(record(variables, constraints), 0..4)).prop_map(
            move |((configuration, mesh, version), records)| {
                let identity =
                    Identity { version, configuration, mesh, tables: String::new(), variables, constraints };
                Written::new(identity, records)
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn any_bytes_are_read_or_refused(bytes in vec(any::<u8>(), 0..300)) {
        prop_assert!(parse(&bytes).is_err());
        let behind_a_mark = [b"{\"fluxmorph_journal\":2,", &bytes[..]].concat();
        prop_assert!(parse(&behind_a_mark).is_err());
    }

    #[test]
    fn any_records_are_read_back_to_the_bit(written in written()) {
        let rest = written.assert_prefix(&written.bytes, written.bytes.len());
        prop_assert_eq!(rest, Some(Rest::Nothing));
    }

    #[test]
    fn any_bytes_behind_records_are_dropped(written in written(), tail in vec(any::<u8>(), 0..200)) {
        let whole = written.bytes.len();
        written.assert_prefix(&[&written.bytes[..], &tail].concat(), whole);
    }

    /// As an attacker writes it, who knows the checksum.
    #[test]
    fn a_changed_record_with_a_right_sum_has_the_sizes_of_the_header_or_is_none(
        changes in vec((any::<Index>(), prop_oneof!["[\\[\\]{},:\"]", "[0-9.eE-]{1,3}", "null|true|\\PC"]), 1..4),
    ) {
        let (identity, record) = (super::tests::identity(), example_record(1));
        let (header, sum) = line::header(&identity);
        let mut body = serde_json::to_string(&record).expect("JSON");
        for (at, text) in changes {
            let at = at.index(body.len());
            let next = (at + 1..).find(|&next| body.is_char_boundary(next)).expect("the end is one");
            if body.is_char_boundary(at) {
                body.replace_range(at..next, &text);
            }
        }
        body.pop();
        let bytes = format!("{header}{body}{}", line::tail(&line::checksum(&sum, body.as_bytes())));
        let contents = parse(bytes.as_bytes()).expect("the header is whole");
        prop_assert_eq!(contents.length + contents.rest.bytes(), bytes.len() as u64);
        for record in &contents.records {
            prop_assert_eq!((record.design.len(), record.gradient.len(), record.constraints.len()), (3, 3, 1));
        }
    }
}

fn seeds() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/journal")
}

/// Writes the seeds of the fuzz target: `cargo test --release --workspace --lib -- --ignored write_the_journals`.
#[test]
#[ignore = "writes fuzz/seeds"]
fn write_the_journals() {
    std::fs::create_dir_all(seeds()).expect("a folder");
    let written = Written::example();
    // The target makes the checksums right where the first byte is odd.
    for (name, choice, end) in [("whole", 0, 3), ("signed", 1, 3), ("one", 1, 1), ("header", 1, 0)] {
        let bytes = [&[choice], &written.bytes[..written.ends[end]]].concat();
        std::fs::write(seeds().join(name), bytes).expect("a file");
    }
}

#[test]
fn every_seed_of_the_fuzz_target_is_a_journal() {
    for entry in std::fs::read_dir(seeds()).expect("a folder") {
        let path = entry.expect("readable").path();
        let bytes = std::fs::read(&path).expect("readable");
        let contents = parse(&bytes[1..]).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(contents.rest.bytes(), 0, "{}", path.display());
    }
}
