//! TIFF files.

use super::Becomes::{Mean, Refused, Told};
use super::check;

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
