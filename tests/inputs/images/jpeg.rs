//! JPEG files.

use super::Becomes::{Mean, Refused, Told};
use super::check;

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
