//! Journals of runs: the first byte chooses whether the checksums are made right.
//!
//! What is read must be a prefix: cut behind any of its records, the journal holds the same records; and with one byte of a
//! record changed, those before it.

#![no_main]

use fluxmorph::run::journal::parse;
use fluxmorph_fuzz::in_time;
use fluxmorph_fuzz::journal::sign;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| in_time(|| check(data)));

fn check(data: &[u8]) {
    let Some((choice, body)) = data.split_first() else { return };
    let mut bytes = if choice % 2 == 1 { sign(body) } else { body.to_vec() };
    let contents = match parse(&bytes) {
        Ok(contents) => contents,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    let length = usize::try_from(contents.length).expect("no longer than the bytes");
    assert_eq!(contents.length + contents.rest.bytes(), bytes.len() as u64);
    let variables = contents.identity.variables;
    for record in &contents.records {
        assert_eq!((record.design.len(), record.gradient.len()), (variables, variables));
        assert!(record.constraints.iter().all(|(_, derivative)| derivative.len() == variables));
        assert_eq!(record.constraints.len(), contents.identity.constraints);
    }
    let whole = parse(&bytes[..length]).expect("the header is whole");
    assert!(whole.records == contents.records && whole.rest.bytes() == 0);
    if let Some(before) = contents.records.len().checked_sub(1) {
        let cut = parse(&bytes[..length - 1]).expect("the header is whole");
        assert_eq!(cut.records, contents.records[..before]);
        let at = length - 1 - usize::from(*choice) % 16;
        bytes[at] ^= 0x10;
        let changed = parse(&bytes).expect("the header is whole");
        assert_eq!(changed.records, contents.records[..before]);
    }
}
