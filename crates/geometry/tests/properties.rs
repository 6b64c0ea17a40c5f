//! Gmsh files by chance: any bytes behind a right header, sound files with random changes, and meshes that are written and
//! read again.

use std::time::Duration;

use crate::msh_support::{Device, Form, Random, Version, Writer, assert_same, fuzzed};
use cpu_time::ThreadTime;
use fluxmorph_geometry::io::{MshEncoding, msh_bytes, read_msh};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};

/// Longest time that a small file may take: what takes longer hangs as far as a user can tell. A sound file of this size
/// takes less than a millisecond.
const HANG: Duration = Duration::from_secs(2);

/// Reads a file in time, and what is accepted once more from a file of its own.
fn read(bytes: &[u8]) {
    let start = ThreadTime::now();
    fuzzed::read(bytes);
    assert!(start.elapsed() < HANG, "{:?}", start.elapsed());
}

fn form() -> impl Strategy<Value = Form> {
    select(vec![Form::Ascii, Form::Little, Form::Big])
}

fn version() -> impl Strategy<Value = Version> {
    select(vec![Version::V2, Version::V4])
}

/// A piece of a file: a mark, a number as readers see it, or bytes of no meaning.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let sections = ["PhysicalNames", "Entities", "Nodes", "Elements", "Periodic", "Anything"];
    prop_oneof![
        select(sections.to_vec()).prop_map(|name| format!("${name}\n").into_bytes()),
        select(sections.to_vec()).prop_map(|name| format!("$End{name}\n").into_bytes()),
        any::<i32>().prop_map(|n| format!("{n} ").into_bytes()),
        (0u64..6).prop_map(|n| format!("{n} ").into_bytes()),
        (0u64..6).prop_map(|n| n.to_le_bytes().to_vec()),
        (0i32..12).prop_map(|n| n.to_le_bytes().to_vec()),
        any::<f64>().prop_map(|x| format!("{x:e} ").into_bytes()),
        any::<f64>().prop_map(|x| x.to_le_bytes().to_vec()),
        Just(b"\n".to_vec()),
        Just(b"3 1 \"iron\"\n".to_vec()),
        vec(any::<u8>(), 0..16),
    ]
}

/// A change of a file that keeps its lines or its records of four bytes.
#[derive(Clone, Debug)]
enum Change {
    /// Takes a line out.
    WithoutLine(Index),
    /// Puts a line at another place once more.
    LineAgain(Index, Index),
    /// Puts another number in the place of a word.
    Word(Index, Index, &'static str),
    /// Puts eight bytes in the place of others.
    Record(Index, [u8; 8]),
    /// Takes bytes out.
    WithoutBytes(Index, usize),
    /// Puts a byte in the place of another.
    Byte(Index, u8),
}

fn change() -> impl Strategy<Value = Change> {
    let words = ["0", "-1", "3", "4", "11", "1e308", "nan", "4294967296", "18446744073709551615"];
    prop_oneof![
        any::<Index>().prop_map(Change::WithoutLine),
        any::<(Index, Index)>().prop_map(|(from, to)| Change::LineAgain(from, to)),
        (any::<Index>(), any::<Index>(), select(words.to_vec())).prop_map(|(l, w, n)| Change::Word(l, w, n)),
        (any::<Index>(), prop_oneof![Just([0xff; 8]), Just([0; 8]), any::<[u8; 8]>()])
            .prop_map(|(at, bytes)| Change::Record(at, bytes)),
        (any::<Index>(), 1usize..20).prop_map(|(at, count)| Change::WithoutBytes(at, count)),
        any::<(Index, u8)>().prop_map(|(at, byte)| Change::Byte(at, byte)),
    ]
}

impl Change {
    fn apply(&self, bytes: Vec<u8>) -> Vec<u8> {
        let mut lines: Vec<Vec<u8>> = bytes.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
        match self {
            Self::WithoutLine(at) => drop(lines.remove(at.index(lines.len()))),
            Self::LineAgain(from, to) => {
                let line = lines[from.index(lines.len())].clone();
                lines.insert(to.index(lines.len()), line);
            }
            Self::Word(line, word, number) => {
                let line = line.index(lines.len());
                let mut words: Vec<&[u8]> = lines[line].split(|&b| b == b' ').collect();
                let word = word.index(words.len());
                words[word] = number.as_bytes();
                lines[line] = words.join(&b' ');
            }
            Self::Record(at, record) => {
                let mut bytes = bytes;
                let at = at.index(bytes.len().saturating_sub(8).max(1));
                for (byte, new) in bytes[at..].iter_mut().zip(record) {
                    *byte = *new;
                }
                return bytes;
            }
            Self::WithoutBytes(at, count) => {
                let mut bytes = bytes;
                let at = at.index(bytes.len());
                bytes.drain(at..(at + count).min(bytes.len()));
                return bytes;
            }
            Self::Byte(at, byte) => {
                let mut bytes = bytes;
                let at = at.index(bytes.len());
                bytes[at] = *byte;
                return bytes;
            }
        }
        lines.join(&b'\n')
    }
}

proptest! {
    // Some seconds for all four together, with overflow checks and debug assertions.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1500) })]

    #[test]
    fn any_bytes_are_read_or_refused(bytes in vec(any::<u8>(), 0..400)) {
        read(&bytes);
    }

    #[test]
    fn any_pieces_behind_a_right_header_are_read_or_refused(
        version in version(),
        form in form(),
        pieces in vec(piece(), 0..40),
    ) {
        let mut file = Writer { bytes: Vec::new(), form };
        file.header(version);
        file.bytes.extend(pieces.concat());
        read(&file.bytes);
    }

    #[test]
    fn a_changed_file_is_read_or_refused(
        seed in 0u64..50,
        version in version(),
        form in form(),
        changes in vec(change(), 1..4),
    ) {
        let sound = Device::random(&mut Random(seed), 1000).bytes(version, form);
        read(&changes.iter().fold(sound, |bytes, change| change.apply(bytes)));
    }

    #[test]
    fn a_written_mesh_is_read_back_to_the_bit(
        seed in any::<u64>(),
        version in version(),
        form in form(),
        unit in select(vec![1.0, 1e-2, 1e-3, 1e-6, 0.0254]),
    ) {
        let device = Device::random(&mut Random(seed), 1 << 30);
        let read = read_msh(&device.bytes(version, form), unit).expect("sound");
        for encoding in [MshEncoding::Ascii, MshEncoding::Binary] {
            let written = msh_bytes(&read.mesh, unit, encoding).expect("finite");
            assert_same(&read_msh(&written, unit).expect("written").mesh, &read.mesh);
        }
    }
}
