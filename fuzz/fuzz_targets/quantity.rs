//! Numbers with units, read as every dimension.

#![no_main]

use fluxmorph_fuzz::in_time;
use fluxmorph::config::{Dimension, parse_quantity};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| in_time(|| check(data)));

fn check(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    for dimension in Dimension::ALL {
        match parse_quantity(text, dimension) {
            Ok(value) => {
                assert!(value.is_finite(), "{text}: {value}");
                // Written in SI it is the same number.
                let again = parse_quantity(&format!("{value:e} {}", dimension.si_unit()), dimension);
                assert_eq!(again.map(f64::to_bits), Ok(value.to_bits()), "{text}");
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}
