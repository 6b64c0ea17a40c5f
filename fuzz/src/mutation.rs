//! Mutations that keep the structure of a file: whole lines and whole numbers, in the form in which readers see them.
//!
//! libFuzzer's own mutations change bytes; they seldom turn one count, tag or coordinate into another, and never move a
//! line. Half of all mutations are theirs, half come from here.

use libfuzzer_sys::fuzzer_mutate;

/// Numbers at which readers decide: signs, sizes, and what is no number.
const NUMBERS: [&[u8]; 26] = [
    b"0",
    b"1",
    b"-1",
    b"2",
    b"3",
    b"4",
    b"5",
    b"11",
    b"15",
    b"100",
    b"65536",
    b"2147483647",
    b"-2147483648",
    b"4294967295",
    b"4294967296",
    b"9223372036854775808",
    b"18446744073709551615",
    b"18446744073709551616",
    b"1e-300",
    b"1e308",
    b"1e999",
    b"nan",
    b"-inf",
    b"0.5",
    b"-0",
    b"1e-17",
];

/// The same as 64 bits.
const WORDS: [u64; 14] = [
    0,
    1,
    2,
    3,
    4,
    7,
    100,
    u32::MAX as u64,
    1 << 32,
    i64::MAX as u64,
    u64::MAX,
    0x3ff0_0000_0000_0000,
    0x7ff0_0000_0000_0000,
    0x7ff8_0000_0000_0000,
];

/// A small source of numbers (splitmix64, Steele et al. 2014), so that a mutation follows from libFuzzer's seed alone.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to below `limit`, which is at least 1.
    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }
}

/// Mutates the first `size` bytes of `data` as text of lines and words; the new size, at most `most`.
pub fn text(data: &mut [u8], size: usize, most: usize, seed: u32) -> usize {
    let mut random = Random(u64::from(seed));
    if size == 0 || random.below(2) == 0 {
        return fuzzer_mutate(data, size, most);
    }
    let mut lines: Vec<Vec<u8>> = data[..size].split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
    let at = random.below(lines.len());
    match random.below(8) {
        0 if lines.len() > 1 => drop(lines.remove(at)),
        1 => lines.insert(at, lines[at].clone()),
        2 => {
            let other = random.below(lines.len());
            lines.swap(at, other);
        }
        3 => {
            let copy = lines[random.below(lines.len())].clone();
            lines.insert(at, copy);
        }
        _ => {
            let mut words: Vec<Vec<u8>> = lines[at].split(|&b| b == b' ').map(<[u8]>::to_vec).collect();
            let word = random.below(words.len());
            match random.below(6) {
                0 => drop(words.remove(word)),
                1 => words.insert(word, words[word].clone()),
                2 => {
                    let other = random.below(words.len());
                    words.swap(word, other);
                }
                3 => {
                    let line = &lines[random.below(lines.len())];
                    let mut others = line.split(|&b| b == b' ');
                    let count = others.clone().count();
                    if let Some(other) = others.nth(random.below(count)) {
                        words[word] = other.to_vec();
                    }
                }
                _ => words[word] = NUMBERS[random.below(NUMBERS.len())].to_vec(),
            }
            lines[at] = words.join(&b' ');
        }
    }
    store(data, &lines.join(&b'\n'), most)
}

/// Mutates the first `size` bytes of `data` as records of 4 and 8 bytes between lines of text; the new size, at most
/// `most`.
pub fn records(data: &mut [u8], size: usize, most: usize, seed: u32) -> usize {
    let mut random = Random(u64::from(seed));
    if size < 16 || random.below(2) == 0 {
        return fuzzer_mutate(data, size, most);
    }
    let mut bytes = data[..size].to_vec();
    // Records start behind the line of a mark, and go in steps of four bytes from there.
    let marks: Vec<usize> = (1..size).filter(|&i| bytes[i - 1] == b'\n').collect();
    let start = if marks.is_empty() { 0 } else { marks[random.below(marks.len())] };
    let at = (start + 4 * random.below((size - start) / 4 + 1)).min(size - 8);
    let width = if random.below(2) == 0 { 4 } else { 8 };
    match random.below(5) {
        0 => drop(bytes.drain(at..at + width)),
        1 => {
            let copy = bytes[at..at + width].to_vec();
            bytes.splice(at..at, copy);
        }
        2 => {
            let from = random.below(size - 8 + 1);
            let copy = bytes[from..from + width].to_vec();
            bytes[at..at + width].copy_from_slice(&copy);
        }
        _ => {
            let word = WORDS[random.below(WORDS.len())].to_le_bytes();
            let mut word = word[..width].to_vec();
            if random.below(2) == 0 {
                word.reverse();
            }
            bytes[at..at + width].copy_from_slice(&word);
        }
    }
    store(data, &bytes, most)
}

fn store(data: &mut [u8], bytes: &[u8], most: usize) -> usize {
    let size = bytes.len().min(most).min(data.len());
    data[..size].copy_from_slice(&bytes[..size]);
    size
}
