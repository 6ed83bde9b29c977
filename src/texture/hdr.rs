//! Radiance files, whose headers say more than the decoder takes.

use super::{Image, Repair, Texels};
use crate::image::planes::is_plausible;
use crate::memory::Bytes;
use crate::text::excerpt;
use image::{DynamicImage, codecs::hdr::HdrDecoder};
use std::io::{BufRead, Cursor, Read};

/// In bytes; longer lines of a header are none.
const MAX_LINE: u64 = 1 << 14;
/// More lines than any header has.
const MAX_LINES: usize = 1 << 12;

/// What follows the header: so many lines of so many pixels, and where they go.
#[derive(Clone, Copy)]
struct Layout {
    lines: u32,
    length: u32,
    /// Lines are columns of the image.
    columns: bool,
    /// From right to left.
    from_right: bool,
    /// From the bottom up.
    from_bottom: bool,
}

/// Reads an image whose first line begins with `#?`, whatever program it names:
/// `RADIANCE` and `RGBE` are the usual ones. Lines may run along any side, from
/// any corner (Ward, "Real Pixels", Graphics Gems II; Radiance's filefmts.pdf).
/// Exposure and colour corrections are not applied, as in Cycles.
///
/// # Errors
/// In words.
pub(super) fn image(
    mut reader: impl BufRead,
    file_length: u64,
    most: u64,
) -> Result<(Image, Vec<Repair>), String> {
    let mut repairs = Vec::new();
    let layout = header(&mut reader, &mut repairs)?;
    let pixels = u64::from(layout.lines) * u64::from(layout.length);
    let bytes = pixels.saturating_mul(size_of::<[f32; 3]>() as u64);
    // A line has four bytes at least.
    is_plausible(
        bytes,
        file_length.min(file_length.saturating_sub(4 * u64::from(layout.lines))),
    )
    .map_err(|error| format!("the image is broken: {error}"))?;
    if bytes > most {
        let (bytes, most) = (Bytes(bytes), Bytes(most));
        return Err(format!("the image takes {bytes}, and {most} are left"));
    }
    let Layout { lines, length, .. } = layout;
    let plain = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {lines} +X {length}\n");
    let broken = |error: image::ImageError| {
        let error = error.to_string();
        format!("the image is broken: {}", error.trim())
    };
    let decoder = HdrDecoder::new(Cursor::new(plain).chain(reader)).map_err(broken)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(broken)?;
    let mut values = decoded.into_rgb32f().into_raw();
    let (mut width, mut height) = (length as usize, lines as usize);
    if layout.columns {
        values = transposed(&values, width, height);
        (width, height) = (height, width);
    }
    if layout.from_bottom {
        let rows: Vec<&[f32]> = values.chunks_exact(3 * width).rev().collect();
        values = rows.concat();
    }
    if layout.from_right {
        for row in values.chunks_exact_mut(3 * width) {
            row.reverse();
            row.chunks_exact_mut(3).for_each(<[f32]>::reverse);
        }
    }
    let image = Image {
        width,
        height,
        channels: 3,
        texels: Texels::F32(values),
    };
    Ok((image, repairs))
}

/// RGB pixels with rows for columns.
fn transposed(values: &[f32], width: usize, height: usize) -> Vec<f32> {
    let mut turned = Vec::with_capacity(values.len());
    for x in 0..width {
        for y in 0..height {
            let pixel = 3 * (y * width + x);
            turned.extend_from_slice(&values[pixel..pixel + 3]);
        }
    }
    turned
}

fn header(reader: &mut impl BufRead, repairs: &mut Vec<Repair>) -> Result<Layout, String> {
    line(reader)?;
    for _ in 0..MAX_LINES {
        let line = line(reader)?;
        if line.is_empty() {
            return layout(&self::line(reader)?);
        }
        let Some((key, value)) = line.split_once('=') else {
            continue;
        };
        let value = value.trim();
        let is_one = value
            .split_ascii_whitespace()
            .all(|number| number.parse::<f64>() == Ok(1.0));
        match key.trim().to_ascii_uppercase().as_str() {
            "FORMAT" if value != "32-bit_rle_rgbe" => {
                let value = excerpt(value);
                return Err(format!(
                    "expected the format 32-bit_rle_rgbe, found `{value}`"
                ));
            }
            "EXPOSURE" if !is_one => repairs.push(Repair::NotApplied("the exposure")),
            "COLORCORR" if !is_one => repairs.push(Repair::NotApplied("the colour correction")),
            "GAMMA" if !is_one => repairs.push(Repair::NotApplied("the gamma")),
            _ => {}
        }
    }
    Err("the image is broken: its header has no end".to_owned())
}

fn layout(line: &str) -> Result<Layout, String> {
    let fault = || {
        let line = excerpt(line);
        format!("expected a size such as `-Y 512 +X 1024`, found `{line}`")
    };
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let [first, lines, second, length] = words[..] else {
        return Err(fault());
    };
    let size = |text: &str| text.parse::<u32>().map_err(|_| fault());
    let (lines, length) = (size(lines)?, size(length)?);
    let axes = [first, second].map(str::as_bytes);
    let [
        [first_sign @ (b'+' | b'-'), first],
        [second_sign @ (b'+' | b'-'), second],
    ] = axes
    else {
        return Err(fault());
    };
    let (x_sign, y_sign, columns) = match (first, second) {
        (b'Y', b'X') => (second_sign, first_sign, false),
        (b'X', b'Y') => (first_sign, second_sign, true),
        _ => return Err(fault()),
    };
    Ok(Layout {
        lines,
        length,
        columns,
        from_right: *x_sign == b'-',
        from_bottom: *y_sign == b'+',
    })
}

/// A line of the header without its end.
fn line(reader: &mut impl BufRead) -> Result<String, String> {
    let mut bytes = Vec::new();
    reader
        .take(MAX_LINE)
        .read_until(b'\n', &mut bytes)
        .map_err(|error| format!("the image can't be read: {error}"))?;
    if bytes.pop() != Some(b'\n') {
        return Err("the image is broken: its header ends in the middle".to_owned());
    }
    if bytes.last() == Some(&b'\r') {
        bytes.pop();
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
