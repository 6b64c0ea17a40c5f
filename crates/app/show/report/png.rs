//! PNG files of images with up to 256 colours, of which the first is transparent (ISO/IEC 15948: signature, then chunks of
//! length, type, data and CRC).

use std::io::Write;

use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};

const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'];

/// Colour type of an image with a palette.
const INDEXED: u8 = 3;

/// The file of an image: one palette index a pixel, row by row from the top.
///
/// # Panics
/// If there is not one index a pixel.
pub(super) fn png(width: usize, height: usize, pixels: &[u8], palette: &[[u8; 3]; 256]) -> Vec<u8> {
    assert_eq!(pixels.len(), width * height, "one index a pixel");
    let mut file = SIGNATURE.to_vec();
    let mut header = Vec::new();
    for side in [width, height] {
        header.extend(u32::try_from(side).expect("an image on a page is small").to_be_bytes());
    }
    // Eight bits an index, and the only methods of compression, filtering and interlacing that this needs.
    header.extend([8, INDEXED, 0, 0, 0]);
    chunk(&mut file, *b"IHDR", &header);
    chunk(&mut file, *b"PLTE", palette.as_flattened());
    chunk(&mut file, *b"tRNS", &[0]);
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    for row in pixels.chunks_exact(width) {
        // Filter 0, none: neighbouring indices are no neighbouring numbers of a photograph.
        encoder.write_all(&[0]).and_then(|()| encoder.write_all(row)).expect("memory takes all");
    }
    chunk(&mut file, *b"IDAT", &encoder.finish().expect("memory takes all"));
    chunk(&mut file, *b"IEND", &[]);
    file
}

fn chunk(file: &mut Vec<u8>, kind: [u8; 4], data: &[u8]) {
    file.extend(u32::try_from(data.len()).expect("an image on a page is small").to_be_bytes());
    let mut crc = Crc::new();
    crc.update(&kind);
    crc.update(data);
    file.extend(kind);
    file.extend(data);
    file.extend(crc.sum().to_be_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// CRC of ISO 3309 bit by bit.
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(
                crc ^ u32::from(byte),
                |crc, _| {
                    if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 }
                },
            )
        })
    }

    /// Chunks by their types, with the checksums compared.
    fn chunks(mut bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
        let mut found = Vec::new();
        while !bytes.is_empty() {
            let length = u32::from_be_bytes(bytes[..4].try_into().expect("four")) as usize;
            let (own, sum) = (&bytes[4..8 + length], &bytes[8 + length..12 + length]);
            assert_eq!(sum, crc(own).to_be_bytes());
            found.push((String::from_utf8_lossy(&own[..4]).into_owned(), own[4..].to_vec()));
            bytes = &bytes[12 + length..];
        }
        found
    }

    #[test]
    fn the_pixels_come_back() {
        let (width, height) = (37, 11);
        let pixels: Vec<u8> = (0..width * height).map(|i| (i * i % 256) as u8).collect();
        let palette: [[u8; 3]; 256] = std::array::from_fn(|i| [i as u8, 255 - i as u8, 7]);
        let file = png(width, height, &pixels, &palette);
        let (signature, rest) = file.split_at(8);
        assert_eq!(signature, SIGNATURE);
        let chunks = chunks(rest);
        let kinds: Vec<&str> = chunks.iter().map(|(kind, _)| kind.as_str()).collect();
        assert_eq!(kinds, ["IHDR", "PLTE", "tRNS", "IDAT", "IEND"]);
        assert_eq!(chunks[0].1, [0, 0, 0, 37, 0, 0, 0, 11, 8, 3, 0, 0, 0]);
        assert_eq!(chunks[1].1, palette.as_flattened());
        let mut rows = Vec::new();
        flate2::read::ZlibDecoder::new(&chunks[3].1[..]).read_to_end(&mut rows).expect("deflated");
        let read: Vec<u8> = rows.chunks(width + 1).flat_map(|row| row[1..].to_vec()).collect();
        assert!(rows.chunks(width + 1).all(|row| row[0] == 0));
        assert_eq!(read, pixels);
    }
}
