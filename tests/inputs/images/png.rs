//! PNG files.

use super::Becomes::{Mean, Refused, Told};
use super::check;

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())))
}

fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let body = [&kind[..], data].concat();
    let length = (data.len() as u32).to_be_bytes();
    [&length[..], &body, &crc(&body).to_be_bytes()].concat()
}

/// Data as zlib has it that does not compress.
fn stored(data: &[u8]) -> Vec<u8> {
    let (a, b) = data.iter().fold((1u32, 0u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65521;
        (a, (b + a) % 65521)
    });
    let length = data.len() as u16;
    let mut out = vec![0x78, 1, 1];
    out.extend(length.to_le_bytes());
    out.extend((!length).to_le_bytes());
    out.extend(data);
    out.extend((b << 16 | a).to_be_bytes());
    out
}

/// A PNG file with these chunks before the pixels, which are `rows` without filter.
pub fn png(width: u32, depth: u8, kind: u8, chunks: &[(&[u8; 4], &[u8])], rows: &[&[u8]]) -> Vec<u8> {
    let mut header = [width.to_be_bytes(), (rows.len() as u32).to_be_bytes()].concat();
    header.extend([depth, kind, 0, 0, 0]);
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    file.extend(chunk(b"IHDR", &header));
    for (kind, data) in chunks {
        file.extend(chunk(kind, data));
    }
    let data: Vec<u8> = rows.iter().flat_map(|row| [&[0], *row].concat()).collect();
    file.extend(chunk(b"IDAT", &stored(&data)));
    file.extend(chunk(b"IEND", b""));
    file
}

#[test]
fn png_files() {
    let palette: &[u8] = &[255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    let half = [0.5; 3];
    let gamma = |value: u32| value.to_be_bytes();
    let whole = png(1, 8, 2, &[], &[&[255, 0, 51]]);
    let mut broken = whole.clone();
    let middle = broken.len() - 20;
    broken[middle] ^= 1;
    let huge = {
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        file.extend(chunk(b"IHDR", &[0, 0, 0x4e, 0x20, 0, 0, 0x4e, 0x20, 8, 6, 0, 0, 0]));
        file.extend(chunk(b"IDAT", &stored(&[0])));
        file.extend(chunk(b"IEND", b""));
        file
    };
    check(
        "png",
        1e-6,
        &[
            ("RGB", whole.clone(), Mean([1.0, 0.0, 0.2])),
            ("RGBA", png(1, 8, 6, &[], &[&[255, 0, 51, 128]]), Mean([1.0, 0.0, 0.2])),
            ("grey", png(1, 8, 0, &[], &[&[51]]), Mean([0.2; 3])),
            ("grey and alpha", png(1, 8, 4, &[], &[&[51, 0]]), Mean([0.2; 3])),
            ("1 bit", png(8, 1, 0, &[], &[&[0b1111_0000]]), Mean(half)),
            ("1 bit, part of a byte", png(3, 1, 0, &[], &[&[0b0101_1111]]), Mean([1.0 / 3.0; 3])),
            ("2 bits", png(4, 2, 0, &[], &[&[0b0001_1011]]), Mean(half)),
            ("4 bits", png(2, 4, 0, &[], &[&[0x0f]]), Mean(half)),
            ("16 bits", png(1, 16, 0, &[], &[&[0x80, 0]]), Mean([32768.0 / 65535.0; 3])),
            ("16 bits RGB", png(1, 16, 2, &[], &[&[255, 255, 0, 0, 0x33, 0x33]]), Mean([1.0, 0.0, 0.2])),
            ("16 bits RGBA", png(1, 16, 6, &[], &[&[255, 255, 0, 0, 0x33, 0x33, 0, 0]]), Mean([1.0, 0.0, 0.2])),
            ("a palette", png(2, 8, 3, &[(b"PLTE", palette)], &[&[0, 2]]), Mean([0.5, 0.0, 0.5])),
            ("a palette of 1 bit", png(2, 1, 3, &[(b"PLTE", palette)], &[&[0b0100_0000]]), Mean([0.5, 0.5, 0.0])),
            ("a palette of 2 bits", png(4, 2, 3, &[(b"PLTE", palette)], &[&[0b0001_1011]]), Mean(half)),
            ("a palette with alpha", png(1, 8, 3, &[(b"PLTE", palette), (b"tRNS", &[0])], &[&[0]]), Mean([1.0, 0.0, 0.0])),
            ("a transparent grey", png(2, 8, 0, &[(b"tRNS", &[0, 51])], &[&[51, 51]]), Mean([0.2; 3])),
            ("a transparent colour", png(1, 8, 2, &[(b"tRNS", &[0, 255, 0, 0, 0, 51])], &[&[255, 0, 51]]), Mean([1.0, 0.0, 0.2])),
            ("sRGB by name", png(1, 8, 0, &[(b"sRGB", &[0])], &[&[51]]), Mean([0.2; 3])),
            ("sRGB by gamma", png(1, 8, 0, &[(b"gAMA", &gamma(45455))], &[&[51]]), Mean([0.2; 3])),
            ("linear by gamma", png(1, 8, 0, &[(b"gAMA", &gamma(100_000))], &[&[51]]), Told([0.2; 3], "the gamma that the image file gives is not applied")),
            ("an index past the palette", png(1, 8, 3, &[(b"PLTE", &palette[..3])], &[&[7]]), Mean([0.0; 3])),
            ("no palette", png(1, 8, 3, &[], &[&[0]]), Refused("the image is broken")),
            ("a wrong checksum", broken, Refused("the image is broken")),
            ("half of it", whole[..whole.len() / 2].to_vec(), Refused("the image is broken")),
            ("too few rows", png(1, 8, 2, &[], &[&[255, 0]]), Refused("the image is broken")),
            ("no pixels", png(0, 8, 2, &[], &[&[]]), Refused("the image is broken")),
            ("a depth that is none", png(1, 3, 0, &[], &[&[0]]), Refused("the image is broken")),
            ("20000 × 20000 pixels of nothing", huge, Refused("it claims 1.6 GB of pixels")),
        ],
    );
}
