//! What must hold for a number with a unit. The tests of configurations include this file.

use fluxmorph::config::{Dimension, parse_quantity};

/// Reads a text as every dimension.
///
/// # Panics
/// If what is accepted is not finite, or not the same when it is written in SI.
pub fn measure(text: &str) {
    for dimension in Dimension::ALL {
        match parse_quantity(text, dimension) {
            Ok(value) => {
                assert!(value.is_finite(), "{text}: {value}");
                let again = parse_quantity(&format!("{value:e} {}", dimension.si_unit()), dimension);
                assert_eq!(again.map(f64::to_bits), Ok(value.to_bits()), "{text}");
            }
            Err(error) => assert!(!error.to_string().is_empty(), "{text}"),
        }
    }
}
