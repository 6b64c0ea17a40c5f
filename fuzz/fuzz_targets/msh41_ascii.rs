//! Gmsh files of version 4.1 as text: what stands behind the header.

#![no_main]

use fluxmorph_fuzz::mesh::{Form, read, with_header};
use fluxmorph_fuzz::{in_time, mutation};
use libfuzzer_sys::{fuzz_mutator, fuzz_target};

fuzz_target!(|data: &[u8]| in_time(|| read(&with_header("4.1", Form::Ascii, data))));

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutation::text(data, size, max_size, seed)
});
