//! Image files.

use super::{Image, Repair, Texels, TextureError, hdr};
use crate::image::planes::{Plane, find_color, is_plausible, read_flat};
use crate::memory::{Budget, Bytes};
use exr::prelude::FlatSamples;
use image::codecs::{jpeg::JpegDecoder, png::PngDecoder, tiff::TiffDecoder};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, Limits, guess_format};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Brighter is no light, and decoding or summing it could overflow.
const MAX_VALUE: f32 = 1e15;
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// The bytes that tell the formats apart.
const MAGIC_LENGTH: u64 = 16;
/// The exponent that PNG files of sRGB colours give, and how near to it others
/// look the same.
const SRGB_GAMMA: [f64; 2] = [0.45455, 0.01];

/// Radiance from all directions.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentImage {
    /// In pixels, all round the horizon.
    pub width: usize,
    /// In pixels, from pole to pole.
    pub height: usize,
    /// Scene-linear Rec. 709, finite and not negative, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
}

/// Reads an environment from an EXR or HDR file.
///
/// # Errors
/// When the file can't be opened, is not a whole image, or holds 8-bit colours.
pub fn load_environment(
    path: &Path,
    budget: &Budget,
) -> Result<(EnvironmentImage, Vec<Repair>), TextureError> {
    let (
        Image {
            width,
            height,
            channels,
            texels,
        },
        mut repairs,
    ) = image(path, budget)?;
    let mut values: Vec<f32> = match texels {
        Texels::F32(values) => values,
        Texels::F16(values) => values.into_iter().map(f32::from).collect(),
        Texels::U8(_) | Texels::U16(_) => {
            let message = "expected an EXR or HDR image, found one of whole numbers".to_owned();
            return Err(TextureError {
                path: path.to_owned(),
                message,
            });
        }
    };
    let negative = values
        .iter_mut()
        .filter(|value| **value < 0.0)
        .map(|value| *value = 0.0)
        .count();
    if negative > 0 {
        repairs.push(Repair::Negative(negative));
    }
    let pixels = values.chunks_exact(channels);
    let pixels = match channels {
        1 | 2 => pixels.map(|pixel| [pixel[0]; 3]).collect(),
        _ => pixels.map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect(),
    };
    Ok((
        EnvironmentImage {
            width,
            height,
            pixels,
        },
        repairs,
    ))
}

/// Reads an image, whatever its format.
pub(super) fn image(path: &Path, budget: &Budget) -> Result<(Image, Vec<Repair>), TextureError> {
    // The decoders are others' code: what they run into ends there.
    catch_unwind(AssertUnwindSafe(|| decode(path, budget)))
        .unwrap_or_else(|_| Err("the image is broken: its decoder gave up".to_owned()))
        .map_err(|message| TextureError {
            path: path.to_owned(),
            message,
        })
}

fn decode(path: &Path, budget: &Budget) -> Result<(Image, Vec<Repair>), String> {
    let cannot_open = |error: std::io::Error| format!("the image can't be read: {error}");
    let file = crate::file::open(path).map_err(cannot_open)?;
    let length = file.metadata().map_err(cannot_open)?.len();
    let mut reader = BufReader::new(file);
    let mut magic = Vec::new();
    reader
        .by_ref()
        .take(MAGIC_LENGTH)
        .read_to_end(&mut magic)
        .map_err(cannot_open)?;
    if magic.is_empty() {
        return Err("expected an image, found an empty file".to_owned());
    }
    reader.seek(SeekFrom::Start(0)).map_err(cannot_open)?;

    let (mut image, mut repairs) = if magic.starts_with(&EXR_MAGIC) {
        (exr_image(reader, length, budget.left())?, Vec::new())
    } else if magic.starts_with(b"#?") {
        hdr::image(reader, length, budget.left())?
    } else {
        other_image(reader, &magic, length, budget.left())?
    };
    if image.width == 0 || image.height == 0 {
        return Err("expected an image, found one without pixels".to_owned());
    }
    let size = format!("the image of {} × {} pixels", image.width, image.height);
    budget
        .take(image.memory() as u64, size)
        .map_err(|error| error.to_string())?;
    let broken = match &mut image.texels {
        Texels::U8(_) | Texels::U16(_) => 0,
        Texels::F16(values) => mend(values, |value| value.to_f32()),
        Texels::F32(values) => mend(values, |value| *value),
    };
    if broken > 0 {
        repairs.push(Repair::OutOfRange(broken));
    }
    Ok((image, repairs))
}

/// Sets values that are none to 0 and counts them.
fn mend<T: Default>(values: &mut [T], number: impl Fn(&T) -> f32) -> usize {
    let unusable = |value: &&mut T| {
        let number = number(value);
        number.is_nan() || number.abs() > MAX_VALUE
    };
    values
        .iter_mut()
        .filter(unusable)
        .map(|value| *value = T::default())
        .count()
}

/// By content, not by the file's extension.
fn other_image(
    mut file: BufReader<File>,
    magic: &[u8],
    length: u64,
    most: u64,
) -> Result<(Image, Vec<Repair>), String> {
    let mut repairs = Vec::new();
    let image = match guess_format(magic) {
        Ok(ImageFormat::Png) => {
            // The decoder does not tell.
            let [usual, near] = SRGB_GAMMA;
            if matches!(png_gamma(&mut file), Ok(Some(gamma)) if (gamma - usual).abs() > near) {
                repairs.push(Repair::NotApplied("the gamma"));
            }
            rewind(&mut file)?;
            let decoder = PngDecoder::with_limits(file, limits(most)).map_err(fault)?;
            pixels(decoder, length, most, &mut repairs)?
        }
        Ok(ImageFormat::Jpeg) => {
            judge_jpeg(&mut file)?;
            rewind(&mut file)?;
            let decoder = JpegDecoder::new(file).map_err(fault)?;
            pixels(decoder, length, most, &mut repairs)?
        }
        Ok(ImageFormat::Tiff) => {
            let decoder = TiffDecoder::new(file).map_err(fault)?;
            pixels(decoder, length, most, &mut repairs)?
        }
        _ => {
            return Err(
                "expected a PNG, JPEG, TIFF, HDR or EXR image, found something else".to_owned(),
            );
        }
    };
    let (width, height) = (image.width() as usize, image.height() as usize);
    let (channels, texels) = match image {
        DynamicImage::ImageLuma8(image) => (1, Texels::U8(image.into_raw())),
        DynamicImage::ImageLumaA8(image) => (2, Texels::U8(image.into_raw())),
        DynamicImage::ImageRgb8(image) => (3, Texels::U8(image.into_raw())),
        DynamicImage::ImageRgba8(image) => (4, Texels::U8(image.into_raw())),
        DynamicImage::ImageLuma16(image) => (1, Texels::U16(image.into_raw())),
        DynamicImage::ImageLumaA16(image) => (2, Texels::U16(image.into_raw())),
        DynamicImage::ImageRgb16(image) => (3, Texels::U16(image.into_raw())),
        DynamicImage::ImageRgba16(image) => (4, Texels::U16(image.into_raw())),
        DynamicImage::ImageRgb32F(image) => (3, Texels::F32(image.into_raw())),
        image => (4, Texels::F32(image.into_rgba32f().into_raw())),
    };
    let image = Image {
        width,
        height,
        channels,
        texels,
    };
    Ok((image, repairs))
}

fn limits(most: u64) -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(most);
    limits
}

fn fault(error: ImageError) -> String {
    let text = error.to_string();
    match error {
        ImageError::Unsupported(_) => format!("the image is of a kind that is not read: {text}"),
        ImageError::Limits(_) => {
            "the image needs more memory than is left; --memory sets the limit".to_owned()
        }
        _ => format!("the image is broken: {}", text.trim()),
    }
}

/// The pixels, if there is room for them.
fn pixels(
    mut decoder: impl ImageDecoder,
    length: u64,
    most: u64,
    repairs: &mut Vec<Repair>,
) -> Result<DynamicImage, String> {
    let bytes = decoder.total_bytes();
    is_plausible(bytes, length).map_err(|error| format!("the image is broken: {error}"))?;
    if bytes > most {
        let (bytes, most) = (Bytes(bytes), Bytes(most));
        return Err(format!(
            "the image needs {bytes}, but {most} are left; --memory sets the limit"
        ));
    }
    if !matches!(decoder.orientation(), Ok(Orientation::NoTransforms)) {
        // As in Cycles, texture coordinates are those of the stored pixels.
        repairs.push(Repair::NotApplied("the orientation"));
    }
    decoder.set_limits(limits(most)).map_err(fault)?;
    DynamicImage::from_decoder(decoder).map_err(fault)
}

fn rewind(file: &mut BufReader<File>) -> Result<(), String> {
    file.rewind()
        .map_err(|error| format!("the image can't be read: {error}"))
}

/// The exponent that a PNG file's colours are stored by, if it gives one alone
/// and not a colour space (PNG, 13.13: those count first).
fn png_gamma(file: &mut BufReader<File>) -> std::io::Result<Option<f64>> {
    const SIGNATURE: i64 = 8;
    file.seek_relative(SIGNATURE)?;
    let mut gamma = None;
    loop {
        let mut header = [0; 8];
        file.read_exact(&mut header)?;
        let [l0, l1, l2, l3, kind @ ..] = header;
        let mut length = i64::from(u32::from_be_bytes([l0, l1, l2, l3]));
        match &kind {
            b"IDAT" => return Ok(gamma),
            b"sRGB" | b"iCCP" | b"cICP" => return Ok(None),
            b"gAMA" if length == 4 => {
                let mut value = [0; 4];
                file.read_exact(&mut value)?;
                length = 0;
                gamma = Some(f64::from(u32::from_be_bytes(value)) / 1e5);
            }
            _ => {}
        }
        file.seek_relative(length + 4)?;
    }
}

/// Refuses JPEG files of which the decoder would make up something: those where
/// no end follows the start of the last scan, and those of two components.
fn judge_jpeg(file: &mut BufReader<File>) -> Result<(), String> {
    const START_OF_SCAN: [u8; 2] = [0xff, 0xda];
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    rewind(file)?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)
        .map_err(|error| format!("the image can't be read: {error}"))?;
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    if last(END_OF_IMAGE) <= last(START_OF_SCAN) {
        return Err("the image is broken: unexpected end of file".to_owned());
    }
    match jpeg_components(&bytes) {
        Some(1 | 3 | 4) | None => Ok(()),
        Some(count) => Err(format!(
            "expected a JPEG image of 1, 3 or 4 components, found {count}"
        )),
    }
}

/// How many components a JPEG file has, from the header of its frame.
fn jpeg_components(bytes: &[u8]) -> Option<u8> {
    let mut at = 2;
    loop {
        let [0xff, marker, high, low] = *bytes.get(at..)?.first_chunk()? else {
            return None;
        };
        match marker {
            0xff => at += 1,
            0xc4 | 0xc8 | 0xcc => at += 2 + usize::from(u16::from_be_bytes([high, low])),
            // Length, precision, height and width come before.
            0xc0..=0xcf => return bytes.get(at + 9).copied(),
            0xda => return None,
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])),
        }
    }
}

/// The channels that are its colour, and alpha.
fn exr_image(reader: BufReader<File>, length: u64, most: u64) -> Result<Image, String> {
    let file = read_flat(reader, length, most)
        .map_err(|error| format!("the EXR image can't be read: {error}"))?;
    let planes = Plane::all(&file);
    let chosen = find_color(&planes).map_err(|problem| {
        let names: Vec<_> = planes.iter().map(Plane::full_name).collect();
        let names = names.join(", ");
        format!("expected an EXR image with channels R, G and B, or Y, {problem}; found {names}")
    })?;
    let [r, g, b] = chosen.color;
    let colors = if r == g { &[r][..] } else { &[r, g, b] };
    let chosen: Vec<&Plane> = colors
        .iter()
        .copied()
        .chain(chosen.alpha)
        .map(|index| &planes[index])
        .collect();
    let window = chosen[0].window;
    if let Some(plane) = chosen
        .iter()
        .find(|plane| !plane.is_whole() || plane.window != window)
    {
        return Err(format!(
            "expected a sample per pixel, found channel `{}` with fewer",
            plane.full_name()
        ));
    }
    let halves: Option<Vec<_>> = chosen
        .iter()
        .map(|plane| match plane.samples {
            FlatSamples::F16(samples) => Some(samples.iter().copied()),
            _ => None,
        })
        .collect();
    let texels = match halves {
        Some(planes) => Texels::F16(interleaved(planes, window.size.area())),
        None => {
            let planes = chosen.iter().map(|plane| plane.samples.values_as_f32());
            Texels::F32(interleaved(planes.collect(), window.size.area()))
        }
    };
    Ok(Image {
        width: window.size.width(),
        height: window.size.height(),
        channels: chosen.len(),
        texels,
    })
}

/// The values of several channels of `count` pixels, pixel by pixel.
fn interleaved<T: Copy + Default>(planes: Vec<impl Iterator<Item = T>>, count: usize) -> Vec<T> {
    let channels = planes.len();
    let mut values = vec![T::default(); channels * count];
    for (offset, plane) in planes.into_iter().enumerate() {
        let places = values[offset..].iter_mut().step_by(channels);
        places.zip(plane).for_each(|(place, value)| *place = value);
    }
    values
}
