//! Gmsh files of version 2.2: the first byte chooses the form of the numbers, or that the whole file follows.

#![no_main]

use fluxmorph_fuzz::mesh::{Form, read, with_header};
use fluxmorph_fuzz::{in_time, mutation};
use libfuzzer_sys::{fuzz_mutator, fuzz_target};

fuzz_target!(|data: &[u8]| in_time(|| check(data)));

fn check(data: &[u8]) {
    let Some((choice, body)) = data.split_first() else { return };
    match choice {
        b'a' => read(&with_header("2.2", Form::Ascii, body)),
        b'l' => read(&with_header("2.2", Form::Little, body)),
        b'b' => read(&with_header("2.2", Form::Big, body)),
        _ => read(body),
    }
}

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    if data.first() == Some(&b'l') || data.first() == Some(&b'b') {
        mutation::records(data, size, max_size, seed)
    } else {
        mutation::text(data, size, max_size, seed)
    }
});
