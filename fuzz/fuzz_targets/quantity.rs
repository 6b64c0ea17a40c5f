//! Numbers with units, read as every dimension.

#![no_main]

use fluxmorph_fuzz::in_time;
use fluxmorph_fuzz::quantity::measure;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| in_time(|| {
    if let Ok(text) = std::str::from_utf8(data) {
        measure(text);
    }
}));
