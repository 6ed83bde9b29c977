//! Image files: the colours of what is read, or what is said.

use super::{assert_none, directory};
use exr::prelude::*;
use smithwalk::memory::Budget;
use smithwalk::texture::{ColorSpace, Images, Interpolation, Lookup, Texture, UvTransform};
use std::path::Path;

/// What becomes of a file.
enum Becomes {
    /// This mean of all pixels, and nothing to tell.
    Mean([f32; 3]),
    /// As above, and this is told.
    Told([f32; 3], &'static str),
    /// This is said.
    Refused(&'static str),
}
use Becomes::{Mean, Refused, Told};

fn load(path: &Path) -> std::result::Result<(Texture, Vec<String>), String> {
    let budget = Budget::new(1 << 30);
    let images = Images::new(&budget);
    images
        .texture(path, Lookup { color_space: ColorSpace::NonColor, interpolation: Interpolation::Closest, ..Lookup::default() })
        .map(|(texture, repairs)| (texture, repairs.iter().map(ToString::to_string).collect()))
        .map_err(|error| error.to_string())
}

fn check(name: &str, within: f32, cases: &[(&str, Vec<u8>, Becomes)]) {
    let path = directory(name).join("image");
    let mut faults = Vec::new();
    for (what, bytes, becomes) in cases {
        std::fs::write(&path, bytes).unwrap();
        let found = match (load(&path), becomes) {
            (Ok((texture, repairs)), Mean(mean) | Told(mean, _)) => {
                let found = texture.mean();
                let near = found.iter().zip(mean).all(|(a, b)| (a - b).abs() <= within);
                let told = match becomes {
                    Told(_, told) => repairs.iter().any(|repair| repair.contains(told)),
                    _ => repairs.is_empty(),
                };
                if near && told {
                    continue;
                }
                format!("{found:?}, {repairs:?}")
            }
            (Ok((texture, repairs)), Refused(_)) => format!("{:?}, {repairs:?}", texture.mean()),
            (Err(error), Refused(message)) if error.contains(message) && error.len() < 1000 => {
                continue;
            }
            (Err(error), _) => error,
        };
        faults.push(format!("{what}: {found}"));
    }
    assert_none(&faults);
}

// PNG

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
fn png(width: u32, depth: u8, kind: u8, chunks: &[(&[u8; 4], &[u8])], rows: &[&[u8]]) -> Vec<u8> {
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

// JPEG

/// Marker segments and entropy-coded bits.
struct Jpeg {
    bytes: Vec<u8>,
    bits: Vec<bool>,
}

impl Jpeg {
    fn segment(&mut self, marker: u8, data: &[u8]) {
        self.bytes.extend([0xff, marker]);
        self.bytes.extend((data.len() as u16 + 2).to_be_bytes());
        self.bytes.extend(data);
    }

    fn push(&mut self, value: u32, count: u32) {
        self.bits.extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
    }

    fn flush(&mut self) {
        while self.bits.len() % 8 != 0 {
            self.bits.push(true);
        }
        for byte in self.bits.chunks_exact(8) {
            let byte = byte.iter().fold(0u8, |byte, &bit| byte << 1 | u8::from(bit));
            self.bytes.push(byte);
            if byte == 0xff {
                self.bytes.push(0);
            }
        }
        self.bits.clear();
    }
}

/// A JPEG file of one block of one colour, whose components have these values.
fn jpeg(components: &[u8], frame: u8, precision: u8, extra: &[(u8, &[u8])]) -> Vec<u8> {
    let mut file = Jpeg { bytes: vec![0xff, 0xd8], bits: Vec::new() };
    for (marker, data) in extra {
        file.segment(*marker, data);
    }
    file.segment(0xdb, &[&[0][..], &[8; 64]].concat());
    let count = components.len() as u8;
    let mut header = vec![precision, 0, 8, 0, 8, count];
    for id in 1..=count {
        header.extend([id, 0x11, 0]);
    }
    file.segment(frame, &header);
    // Sixteen codes of four bits for the sizes 0 to 11; one code for the end of a block.
    let sizes: Vec<u8> = (0..12).collect();
    file.segment(0xc4, &[&[0x00, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], &sizes].concat());
    file.segment(0xc4, &[0x10, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    let progressive = frame == 0xc2;
    let mut scan = vec![count];
    for id in 1..=count {
        scan.extend([id, 0]);
    }
    scan.extend(if progressive { [0, 0, 0] } else { [0, 63, 0] });
    file.segment(0xda, &scan);
    for &value in components {
        // The mean of a block is its first coefficient, times 8 by the transform and
        // over 8 by the table.
        let difference = i32::from(value) - 128;
        let size = 32 - difference.unsigned_abs().leading_zeros();
        file.push(size, 4);
        let bits = if difference < 0 { difference - 1 } else { difference };
        file.push(bits as u32 & ((1 << size) - 1), size);
        if !progressive {
            file.push(0, 1);
        }
    }
    file.flush();
    file.bytes.extend([0xff, 0xd9]);
    file.bytes
}

#[test]
fn jpeg_files() {
    let adobe = |transform: u8| [&b"Adobe"[..], &[0, 100, 0, 0, 0, 0, transform]].concat();
    let (plain, ycc, ycck) = (adobe(0), adobe(1), adobe(2));
    let turned = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0".to_vec();
    let upright = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x01\0\0\0\0\0\0".to_vec();
    let whole = jpeg(&[153, 128, 128], 0xc0, 8, &[]);
    let grey = [0.6; 3];
    check(
        "jpeg",
        3e-3,
        &[
            ("grey", jpeg(&[153], 0xc0, 8, &[]), Mean(grey)),
            ("luma and chroma", whole.clone(), Mean(grey)),
            ("a red", jpeg(&[76, 85, 255], 0xc0, 8, &[]), Mean([254.0 / 255.0, 0.0, 0.0])),
            ("with Adobe's marker", jpeg(&[153, 128, 128], 0xc0, 8, &[(0xee, &ycc)]), Mean(grey)),
            ("RGB as Adobe marks it", jpeg(&[255, 51, 0], 0xc0, 8, &[(0xee, &plain)]), Mean([1.0, 0.2, 0.0])),
            ("sequential with Huffman tables of its own", jpeg(&[153], 0xc1, 8, &[]), Mean(grey)),
            ("progressive", jpeg(&[153, 128, 128], 0xc2, 8, &[]), Mean(grey)),
            ("progressive grey", jpeg(&[153], 0xc2, 8, &[]), Mean(grey)),
            ("CMYK as Adobe inverts it", jpeg(&[255, 51, 255, 255], 0xc0, 8, &[(0xee, &plain)]), Mean([1.0, 0.2, 1.0])),
            ("CMYK over YCC", jpeg(&[153, 128, 128, 255], 0xc0, 8, &[(0xee, &ycck)]), Mean([0.4; 3])),
            ("turned by its EXIF", jpeg(&[153], 0xc0, 8, &[(0xe1, &turned)]), Told(grey, "the orientation that the image file gives is not applied")),
            ("upright by its EXIF", jpeg(&[153], 0xc0, 8, &[(0xe1, &upright)]), Mean(grey)),
            ("comments and unknown segments", jpeg(&[153], 0xc0, 8, &[(0xfe, b"a"), (0xef, b"b")]), Mean(grey)),
            ("12 bits", jpeg(&[153], 0xc1, 12, &[]), Refused("the image")),
            ("lossless", jpeg(&[153], 0xc3, 8, &[]), Refused("the image")),
            ("arithmetic", jpeg(&[153], 0xc9, 8, &[]), Refused("the image")),
            ("two components", jpeg(&[153, 153], 0xc0, 8, &[]), Refused("1, 3 or 4 components, found 2")),
            ("without its end", whole[..whole.len() - 2].to_vec(), Refused("unexpected end of file")),
            ("its first bytes", whole[..4].to_vec(), Refused("the image is broken")),
        ],
    );
}

// TIFF

/// A TIFF file of one strip: entries of tag, type, and values that are put where
/// there is room.
fn tiff(big_endian: bool, entries: &[(u16, u16, &[u32])], pixels: &[u8]) -> Vec<u8> {
    let two = |n: u16| {
        if big_endian { n.to_be_bytes() } else { n.to_le_bytes() }
    };
    let four = |n: u32| {
        if big_endian { n.to_be_bytes() } else { n.to_le_bytes() }
    };
    let mut file = if big_endian { b"MM".to_vec() } else { b"II".to_vec() };
    file.extend(two(42));
    let mut after = pixels.to_vec();
    if after.len() % 2 == 1 {
        after.push(0);
    }
    let mut directory = Vec::new();
    let strip = [(273u16, 4u16, vec![8u32]), (279, 4, vec![pixels.len() as u32])];
    let mut all: Vec<(u16, u16, Vec<u32>)> = entries.iter().map(|(tag, kind, values)| (*tag, *kind, values.to_vec())).collect();
    if !all.iter().any(|entry| entry.0 == 324) {
        all.extend(strip);
    }
    all.sort_by_key(|entry| entry.0);
    directory.extend(two(all.len() as u16));
    for (tag, kind, values) in &all {
        let data: Vec<u8> = values
            .iter()
            .flat_map(|&value| match kind {
                1 => vec![value as u8],
                3 => two(value as u16).to_vec(),
                _ => four(value).to_vec(),
            })
            .collect();
        directory.extend(two(*tag));
        directory.extend(two(*kind));
        directory.extend(four(values.len() as u32));
        if data.len() <= 4 {
            directory.extend(&data);
            directory.resize(directory.len() + 4 - data.len(), 0);
        } else {
            directory.extend(four(8 + after.len() as u32));
            after.extend(&data);
        }
    }
    directory.extend(four(0));
    file.extend(four(8 + after.len() as u32));
    file.extend(after);
    file.extend(directory);
    file
}

/// As above, of 2 × 1 pixels: bits of the samples, what is interpreted how.
fn tiff_of(bits: &[u32], photometric: u32, more: &[(u16, u16, &[u32])], pixels: &[u8]) -> Vec<u8> {
    let samples = [bits.len() as u32];
    let photometric = [photometric];
    let mut entries: Vec<(u16, u16, &[u32])> = vec![(256, 3, &[2]), (257, 3, &[1]), (258, 3, bits), (262, 3, &photometric), (277, 3, &samples), (278, 3, &[1])];
    entries.extend(more);
    tiff(false, &entries, pixels)
}

#[test]
fn tiff_files() {
    let none = (259, 3, &[1u32][..]);
    let float = (339, 3, &[3u32, 3, 3][..]);
    let halves: Vec<u8> = [0.25f32, 0.5, 4.0, 0.25, 0.5, 4.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let big: Vec<u8> = tiff(true, &[(256, 3, &[1]), (257, 3, &[1]), (258, 3, &[16]), (262, 3, &[1]), (277, 3, &[1]), (278, 3, &[1]), none], &[0x80, 0]);
    let rgb = [255, 0, 51, 255, 0, 51];
    let colour = [1.0, 0.0, 0.2];
    let mut no_samples = tiff_of(&[8, 8, 8], 2, &[none, (339, 3, &[])], &rgb);
    no_samples.truncate(no_samples.len());
    check(
        "tiff",
        1e-6,
        &[
            ("RGB", tiff_of(&[8, 8, 8], 2, &[none], &rgb), Mean(colour)),
            ("RGB without a word on compression", tiff_of(&[8, 8, 8], 2, &[], &rgb), Mean(colour)),
            ("RGBA", tiff_of(&[8, 8, 8, 8], 2, &[none, (338, 3, &[2])], &[255, 0, 51, 9, 255, 0, 51, 9]), Mean(colour)),
            ("grey", tiff_of(&[8], 1, &[none], &[51, 51]), Mean([0.2; 3])),
            ("black for white", tiff_of(&[8], 0, &[none], &[204, 204]), Mean([0.2; 3])),
            ("1 bit", tiff_of(&[1], 1, &[none], &[0b1000_0000]), Mean([0.5; 3])),
            ("16 bits", tiff_of(&[16], 1, &[none], &[0, 0x80, 0, 0x80]), Mean([32768.0 / 65535.0; 3])),
            ("16 bits, big endian", big, Mean([32768.0 / 65535.0; 3])),
            ("floats", tiff_of(&[32, 32, 32], 2, &[none, float], &halves), Mean([0.25, 0.5, 4.0])),
            ("PackBits", tiff_of(&[8], 1, &[(259, 3, &[32773])], &[0xff, 51]), Mean([0.2; 3])),
            ("CMYK", tiff_of(&[8, 8, 8, 8], 5, &[none], &[0, 255, 204, 0, 0, 255, 204, 0]), Mean(colour)),
            ("turned", tiff_of(&[8], 1, &[none, (274, 3, &[6])], &[51, 51]), Told([0.2; 3], "the orientation")),
            ("grey floats", tiff_of(&[32], 1, &[none, (339, 3, &[3])], &halves[..8]), Refused("of a kind that is not read")),
            ("a palette", tiff_of(&[8], 3, &[none], &[0, 0]), Refused("the image is of a kind that is not read")),
            ("signed", tiff_of(&[8], 1, &[none, (339, 3, &[2])], &[51, 51]), Refused("the image is of a kind that is not read")),
            ("planes apart", tiff_of(&[8, 8, 8], 2, &[none, (284, 3, &[2])], &rgb), Refused("the image")),
            ("CIELab", tiff_of(&[8, 8, 8], 8, &[none], &rgb), Refused("the image")),
            ("64-bit floats", tiff_of(&[64], 1, &[none, (339, 3, &[3])], &[0; 16]), Refused("the image")),
            ("a sample format of no samples", no_samples, Refused("the image")),
            ("no size", tiff(false, &[(258, 3, &[8]), (262, 3, &[1])], &[0]), Refused("the image is broken")),
            ("half of it", tiff_of(&[8, 8, 8], 2, &[none], &rgb)[..40].to_vec(), Refused("the image is broken")),
            ("a size of nothing", tiff(false, &[(256, 4, &[20000]), (257, 4, &[20000]), (258, 3, &[8, 8, 8]), (262, 3, &[2]), (277, 3, &[3])], &[0]), Refused("it claims 1.2 GB of pixels")),
        ],
    );
}

// Radiance

/// A file of the size that the last line of its header says.
fn hdr(header: &str, pixels: &[[u8; 4]]) -> Vec<u8> {
    [header.as_bytes(), pixels.as_flattened()].concat()
}

#[test]
fn radiance_files() {
    let start = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
    // Mantissas and exponent of (1, 0.5, 0.25).
    let sky = [[128, 64, 32, 129]; 32];
    let colour = [1.0, 0.5, 0.25];
    let of = |header: &str| hdr(header, &sky);
    let run_length = {
        let mut file = format!("{start}-Y 1 +X 8\n").into_bytes();
        file.extend([2, 2, 0, 8]);
        for value in [128, 64, 32, 129] {
            file.extend([128 + 8, value]);
        }
        file
    };
    let old_runs = hdr(&format!("{start}-Y 1 +X 8\n"), &[sky[0], [1, 1, 1, 7]]);
    let no_end = format!("#?RADIANCE\n{}", "A=B\n".repeat(5000)).into_bytes();
    let said = "that the image file gives is not applied";
    check(
        "hdr",
        1e-6,
        &[
            ("RADIANCE", of(&format!("{start}-Y 4 +X 8\n")), Mean(colour)),
            ("RGBE", of("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("a program's own name", of("#?AUTOPANO\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("no format", of("#?RADIANCE\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("comments", of("#?RADIANCE\n# by hand\npfilt -1\nFORMAT=32-bit_rle_rgbe\nSOFTWARE=a\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("line ends of Windows", of("#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 4 +X 8\n"), Mean(colour)),
            ("bytes that are no text", [b"#?RADIANCE\n# f\xfcr\n\n-Y 4 +X 8\n", sky.as_flattened()].concat(), Mean(colour)),
            ("from the bottom", of(&format!("{start}+Y 4 +X 8\n")), Mean(colour)),
            ("from the right", of(&format!("{start}-Y 4 -X 8\n")), Mean(colour)),
            ("by columns", of(&format!("{start}+X 8 -Y 4\n")), Mean(colour)),
            ("by columns from the right bottom", of(&format!("{start}-X 8 +Y 4\n")), Mean(colour)),
            ("runs", run_length, Mean(colour)),
            ("runs of old files", old_runs, Mean(colour)),
            ("an exposure of 1", of("#?RADIANCE\nEXPOSURE=1.0\n\n-Y 4 +X 8\n"), Mean(colour)),
            ("an exposure", of("#?RADIANCE\nEXPOSURE= 2.5\n\n-Y 4 +X 8\n"), Told(colour, said)),
            ("a colour correction", of("#?RADIANCE\nCOLORCORR=1 2 1\n\n-Y 4 +X 8\n"), Told(colour, said)),
            ("a gamma", of("#?RADIANCE\nGAMMA=2.2\n\n-Y 4 +X 8\n"), Told(colour, said)),
            ("XYZ", of("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 4 +X 8\n"), Refused("expected the format 32-bit_rle_rgbe, found `32-bit_rle_xyze`")),
            ("too few pixels", hdr(&format!("{start}-Y 4 +X 8\n"), &sky[..31]), Refused("the image is broken")),
            ("no size", of(start), Refused("the image is broken")),
            ("a size in words", of(&format!("{start}four by eight\n")), Refused("expected a size such as `-Y 512 +X 1024`, found `four by eight`")),
            ("two heights", of(&format!("{start}-Y 4 -Y 8\n")), Refused("found `-Y 4 -Y 8`")),
            ("no pixels", of(&format!("{start}-Y 0 +X 8\n")), Refused("without pixels")),
            ("a size past 32 bits", of(&format!("{start}-Y 4294967296 +X 8\n")), Refused("found `-Y 4294967296 +X 8`")),
            ("20000 × 20000 pixels of nothing", of(&format!("{start}-Y 20000 +X 20000\n")), Refused("it claims 4.8 GB of pixels")),
            ("a header without end", no_end, Refused("its header has no end")),
            ("a header that stops", b"#?RADIANCE\nFORM".to_vec(), Refused("its header ends in the middle")),
        ],
    );

    // One pixel of each colour, from the lower left over the lower right on.
    let [red, green, blue, white] = [[128, 0, 0, 129], [0, 128, 0, 129], [0, 0, 128, 129], [128, 128, 128, 129]];
    let path = directory("axes").join("image");
    for (layout, pixels) in [
        ("-Y 2 +X 2", [blue, white, red, green]),
        ("+Y 2 +X 2", [red, green, blue, white]),
        ("-Y 2 -X 2", [white, blue, green, red]),
        ("+Y 2 -X 2", [green, red, white, blue]),
        ("+X 2 -Y 2", [blue, red, white, green]),
        ("+X 2 +Y 2", [red, blue, green, white]),
        ("-X 2 -Y 2", [white, green, blue, red]),
        ("-X 2 +Y 2", [green, white, red, blue]),
    ] {
        std::fs::write(&path, hdr(&format!("{start}{layout}\n"), &pixels)).unwrap();
        let (texture, _) = load(&path).unwrap();
        let at = |u, v| texture.sample([u, v])[..3].to_vec();
        assert_eq!(at(0.25, 0.25), [1.0, 0.0, 0.0], "{layout}: lower left");
        assert_eq!(at(0.75, 0.25), [0.0, 1.0, 0.0], "{layout}: lower right");
        assert_eq!(at(0.25, 0.75), [0.0, 0.0, 1.0], "{layout}: upper left");
        assert_eq!(at(0.75, 0.75), [1.0, 1.0, 1.0], "{layout}: upper right");
    }
}

// OpenEXR

const SIZE: Vec2<usize> = Vec2(4, 4);

fn channels(values: &[(&str, f32)], half: bool) -> AnyChannels<FlatSamples> {
    let count = SIZE.area();
    let list = values.iter().map(|&(name, value)| {
        let samples = if half { FlatSamples::F16(vec![f16::from_f32(value); count]) } else { FlatSamples::F32(vec![value; count]) };
        AnyChannel::new(name, samples)
    });
    AnyChannels::sort(list.collect())
}

fn layer(name: Option<&str>, values: &[(&str, f32)], encoding: Encoding) -> exr::prelude::Layer<AnyChannels<FlatSamples>> {
    let attributes = LayerAttributes { layer_name: name.map(Text::from), ..LayerAttributes::default() };
    exr::prelude::Layer::new(SIZE, attributes, encoding, channels(values, false))
}

fn written(layers: Vec<exr::prelude::Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = exr::prelude::Image { attributes: ImageAttributes::with_size(SIZE), layer_data: layers.into_iter().collect::<smallvec::SmallVec<[_; 2]>>() };
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// A file with channels of these names, each of one value.
fn exr_file(values: &[(&str, f32)]) -> Vec<u8> {
    written(vec![layer(None, values, Encoding::SMALL_LOSSLESS)])
}

/// The header of a file of one float channel, and nothing more.
fn exr_header(side: i32) -> Vec<u8> {
    let mut file = b"\x76\x2f\x31\x01\x02\0\0\0".to_vec();
    let mut attribute = |name: &str, kind: &str, data: &[u8]| {
        file.extend(name.as_bytes());
        file.push(0);
        file.extend(kind.as_bytes());
        file.push(0);
        file.extend((data.len() as i32).to_le_bytes());
        file.extend(data);
    };
    let channel = b"Y\0\x02\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\0\0";
    let window: Vec<u8> = [0, 0, side - 1, side - 1].iter().flat_map(|n: &i32| n.to_le_bytes()).collect();
    attribute("channels", "chlist", channel);
    attribute("compression", "compression", &[0]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1f32.to_le_bytes());
    file.push(0);
    file
}

#[test]
fn exr_files() {
    let rgb = [("R", 1.0), ("G", 0.5), ("B", 0.25)];
    let colour = [1.0, 0.5, 0.25];
    let with = |more: &[(&'static str, f32)]| exr_file(&[&rgb[..], more].concat());
    let encoded = |compression, blocks| {
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        written(vec![layer(None, &rgb, encoding)])
    };
    let half = {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let layer = exr::prelude::Layer::new(SIZE, LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels(&rgb, true));
        exr::prelude::Image { attributes: ImageAttributes::with_size(SIZE), layer_data: layer }.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    };
    let albedo = [("R", 0.1), ("G", 0.1), ("B", 0.1)];
    let small = Encoding::SMALL_LOSSLESS;
    let parts = |first: (&'static str, &[(&str, f32)]), second: (&'static str, &[(&str, f32)])| written(vec![layer(Some(first.0), first.1, small), layer(Some(second.0), second.1, small)]);
    let whole = exr_file(&rgb);
    let several = "but more than one layer could be meant";
    let mut header_alone = whole.clone();
    header_alone.truncate(whole.len() - 100);
    check(
        "exr",
        1e-6,
        &[
            ("three channels", whole.clone(), Mean(colour)),
            ("halves", half, Mean(colour)),
            ("alpha", with(&[("A", 0.0)]), Mean(colour)),
            ("depth beside it", with(&[("Z", 9.0)]), Mean(colour)),
            ("a layer that sorts before", with(&[("Albedo.R", 0.1), ("Albedo.G", 0.1), ("Albedo.B", 0.1)]), Mean(colour)),
            ("a layer that sorts behind", with(&[("albedo.R", 0.1), ("albedo.G", 0.1), ("albedo.B", 0.1)]), Mean(colour)),
            ("normals beside it", with(&[("N.X", 0.0), ("N.Y", 0.3), ("N.Z", 1.0)]), Mean(colour)),
            (
                "Blender's layers",
                exr_file(&[
                    ("ViewLayer.AO.R", 0.1),
                    ("ViewLayer.AO.G", 0.1),
                    ("ViewLayer.AO.B", 0.1),
                    ("ViewLayer.Combined.R", 1.0),
                    ("ViewLayer.Combined.G", 0.5),
                    ("ViewLayer.Combined.B", 0.25),
                ]),
                Mean(colour),
            ),
            ("one layer of a name", exr_file(&[("beauty.R", 1.0), ("beauty.G", 0.5), ("beauty.B", 0.25)]), Mean(colour)),
            ("two layers of a name", exr_file(&[("a.R", 1.0), ("a.G", 0.5), ("a.B", 0.25), ("b.R", 1.0), ("b.G", 0.5), ("b.B", 0.25)]), Refused(several)),
            (
                "two combined ones",
                exr_file(&[("a.Combined.R", 1.0), ("a.Combined.G", 0.5), ("a.Combined.B", 0.25), ("b.Combined.R", 1.0), ("b.Combined.G", 0.5), ("b.Combined.B", 0.25)]),
                Refused(several),
            ),
            ("small letters", exr_file(&[("r", 1.0), ("g", 0.5), ("b", 0.25)]), Mean(colour)),
            ("normals alone", exr_file(&[("X", 0.0), ("Y", 0.3), ("Z", 1.0)]), Mean([0.0, 0.3, 1.0])),
            ("luminance", exr_file(&[("Y", 0.3)]), Mean([0.3; 3])),
            ("luminance and alpha", exr_file(&[("Y", 0.3), ("A", 0.5)]), Mean([0.3; 3])),
            ("luminance and chroma", exr_file(&[("Y", 0.3), ("RY", 0.0), ("BY", 0.0)]), Refused("and chroma (RY, BY) is not read")),
            ("a depth alone", exr_file(&[("Z", 7.0)]), Mean([7.0; 3])),
            ("a channel of any name", exr_file(&[("mask", 0.5)]), Mean([0.5; 3])),
            ("two channels of any name", exr_file(&[("u", 0.5), ("v", 0.5)]), Refused("but no layer has R, G and B; found u, v")),
            ("two colours alone", exr_file(&[("R", 0.5), ("G", 0.5)]), Refused("but no layer has R, G and B")),
            ("parts, the colour first", parts(("beauty", &rgb), ("depth", &[("Z", 1.0)])), Mean(colour)),
            ("parts, the colour last", parts(("depth", &[("Z", 1.0)]), ("beauty", &rgb)), Mean(colour)),
            ("parts of Blender", parts(("ViewLayer.AO", &albedo), ("ViewLayer.Combined", &rgb)), Mean(colour)),
            ("parts with colours both", parts(("a", &albedo), ("b", &rgb)), Refused(several)),
            ("no compression", encoded(Compression::Uncompressed, Blocks::ScanLines), Mean(colour)),
            ("RLE", encoded(Compression::RLE, Blocks::ScanLines), Mean(colour)),
            ("ZIP by lines", encoded(Compression::ZIP1, Blocks::ScanLines), Mean(colour)),
            ("PIZ", encoded(Compression::PIZ, Blocks::ScanLines), Mean(colour)),
            ("PXR24", encoded(Compression::PXR24, Blocks::ScanLines), Mean(colour)),
            ("tiles", encoded(Compression::ZIP16, Blocks::Tiles(Vec2(3, 2))), Mean(colour)),
            ("NaN and infinity", exr_file(&[("R", f32::NAN), ("G", f32::INFINITY), ("B", 0.25)]), Told([0.0, 0.0, 0.25], "32 values that are NaN, infinite")),
            ("half of it", header_alone, Refused("the EXR image can't be read")),
            ("its magic alone", b"\x76\x2f\x31\x01".to_vec(), Refused("the EXR image can't be read")),
            ("a version that is none", b"\x76\x2f\x31\x01\x09\0\0\0".to_vec(), Refused("the EXR image can't be read")),
            ("10⁶ × 10⁶ pixels of nothing", exr_header(1_000_000), Refused("it claims 4.0 TB of pixels")),
            ("30000 × 30000 pixels of nothing", exr_header(30_000), Refused("it claims 3.6 GB of pixels")),
            ("2³¹ pixels a side", exr_header(i32::MAX), Refused("the EXR image can't be read")),
        ],
    );
    let bytes = exr_header(1_000_000);
    let path = directory("diff").join("huge.exr");
    std::fs::write(&path, bytes).unwrap();
    let error = smithwalk::image::read_exr(&path).expect_err("no pixels").to_string();
    assert!(error.contains("it claims 4.0 TB of pixels"), "{error}");
}

#[test]
fn an_image_under_many_names_is_read_and_kept_once() {
    let folder = directory("shared");
    std::fs::write(folder.join("a"), png(2, 8, 2, &[], &[&[0; 6], &[0; 6]])).unwrap();
    let budget = Budget::new(12);
    let images = Images::new(&budget);
    let names = ["a", "./a", "../shared/a"];
    let textures: Vec<Texture> = (0..300)
        .map(|i| {
            let path = folder.join(names[i % 3]);
            let scale = [1.0 + i as f32; 2];
            images.texture(&path, Lookup { color_space: ColorSpace::Srgb, transform: UvTransform::from_parts(scale, 0.0, [0.0; 2]), ..Lookup::default() }).unwrap().0
        })
        .collect();
    assert_eq!(Texture::memory(&textures), 12);
    assert_eq!(budget.left(), 0);
    std::fs::write(folder.join("b"), png(2, 8, 2, &[], &[&[0; 6]])).unwrap();
    let no_room = images.texture(&folder.join("b"), Lookup { color_space: ColorSpace::Srgb, interpolation: Interpolation::Closest, ..Lookup::default() });
    let error = no_room.expect_err("the budget is spent").to_string();
    assert!(error.contains("left; --memory sets the limit"), "{error}");
}

#[test]
fn sixteen_bits_take_two_bytes() {
    let path = directory("sixteen").join("image");
    std::fs::write(&path, png(2, 16, 2, &[], &[&[1; 12]])).unwrap();
    let (texture, _) = load(&path).unwrap();
    assert_eq!(Texture::memory(&[texture]), 12);
}

/// What the fuzzer has found: decoders that panic, the second where overflows are
/// checked, as they are here.
#[test]
fn decoders_that_panic_end_nothing_else() {
    let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fuzz");
    let budget = smithwalk::memory::Budget::new(1 << 30);
    let file = data.join("sample_format.tiff");
    let error = smithwalk::texture::load_environment(&file, &budget).unwrap_err();
    assert!(error.to_string().contains("its decoder gave up"), "{error}");
    let read = smithwalk::image::read_exr(&data.join("b44.exr"));
    assert_eq!(read.is_err(), cfg!(debug_assertions));
}
