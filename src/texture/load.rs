//! Image files.

use super::{Image, Repair, Texels, TextureError};
use exr::prelude::{ReadChannels, ReadLayers};
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// In bytes. An image that claims more is broken, or no texture.
const MAX_MEMORY: u64 = 8 << 30;
/// Brighter is no light, and decoding or summing it could overflow.
const MAX_VALUE: f32 = 1e15;
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

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
pub fn load_environment(path: &Path) -> Result<(EnvironmentImage, Vec<Repair>), TextureError> {
    let (
        Image {
            width,
            height,
            channels,
            texels,
        },
        mut repairs,
    ) = image(path)?;
    let Texels::F32(mut values) = texels else {
        let message = "expected an EXR or HDR image, found one with 8 bits per channel".to_owned();
        return Err(TextureError {
            path: path.to_owned(),
            message,
        });
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
pub(super) fn image(path: &Path) -> Result<(Image, Vec<Repair>), TextureError> {
    let fail = |message: String| TextureError {
        path: path.to_owned(),
        message,
    };
    let cannot_open = |error: std::io::Error| fail(format!("the image can't be read: {error}"));
    let mut reader = BufReader::new(File::open(path).map_err(cannot_open)?);
    let mut magic = Vec::new();
    reader
        .by_ref()
        .take(4)
        .read_to_end(&mut magic)
        .map_err(cannot_open)?;
    if magic.is_empty() {
        return Err(fail("expected an image, found an empty file".to_owned()));
    }
    reader.seek(SeekFrom::Start(0)).map_err(cannot_open)?;

    let mut image = if magic == EXR_MAGIC {
        exr_image(reader)
    } else {
        other_image(reader)
    }
    .map_err(fail)?;
    if image.width == 0 || image.height == 0 {
        return Err(fail(
            "expected an image, found one without pixels".to_owned(),
        ));
    }
    let mut repairs = Vec::new();
    if let Texels::F32(values) = &mut image.texels {
        let broken = values
            .iter_mut()
            .filter(|value| value.is_nan() || value.abs() > MAX_VALUE)
            .map(|value| *value = 0.0)
            .count();
        if broken > 0 {
            repairs.push(Repair::OutOfRange(broken));
        }
    }
    Ok((image, repairs))
}

/// By content, not by the file's extension.
fn other_image(mut file: BufReader<File>) -> Result<Image, String> {
    let mut reader = ImageReader::new(&mut file)
        .with_guessed_format()
        .map_err(|error| error.to_string())?;
    let format = reader.format();
    if format.is_none() {
        return Err(
            "expected a PNG, JPEG, TIFF, HDR or EXR image, found something else".to_owned(),
        );
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_MEMORY);
    reader.limits(limits);
    let image = reader
        .decode()
        .map_err(|error| format!("the image is broken: {}", error.to_string().trim()))?;
    if format == Some(ImageFormat::Jpeg)
        && !is_whole_jpeg(&mut file).map_err(|error| error.to_string())?
    {
        return Err("the image is broken: unexpected end of file".to_owned());
    }
    let (width, height) = (image.width() as usize, image.height() as usize);
    let from_u16 = |values: Vec<u16>| {
        Texels::F32(values.into_iter().map(|v| f32::from(v) / 65535.0).collect())
    };
    let (channels, texels) = match image {
        DynamicImage::ImageLuma8(image) => (1, Texels::U8(image.into_raw())),
        DynamicImage::ImageLumaA8(image) => (2, Texels::U8(image.into_raw())),
        DynamicImage::ImageRgb8(image) => (3, Texels::U8(image.into_raw())),
        DynamicImage::ImageRgba8(image) => (4, Texels::U8(image.into_raw())),
        DynamicImage::ImageLuma16(image) => (1, from_u16(image.into_raw())),
        DynamicImage::ImageLumaA16(image) => (2, from_u16(image.into_raw())),
        DynamicImage::ImageRgb16(image) => (3, from_u16(image.into_raw())),
        DynamicImage::ImageRgba16(image) => (4, from_u16(image.into_raw())),
        DynamicImage::ImageRgb32F(image) => (3, Texels::F32(image.into_raw())),
        image => (4, Texels::F32(image.into_rgba32f().into_raw())),
    };
    Ok(Image {
        width,
        height,
        channels,
        texels,
    })
}

/// Whether the marker that ends a JPEG follows the last one that starts
/// pixels: the decoder fills in what is missing.
fn is_whole_jpeg(file: &mut BufReader<File>) -> std::io::Result<bool> {
    const START_OF_SCAN: [u8; 2] = [0xff, 0xda];
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.read_to_end(&mut bytes)?;
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    Ok(last(END_OF_IMAGE) > last(START_OF_SCAN))
}

/// The first layer that has colours, or else luminance; Blender's names such
/// as `ViewLayer.Combined.R` count, too.
fn exr_image(reader: BufReader<File>) -> Result<Image, String> {
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(reader)
        .map_err(|error| format!("the EXR image is broken: {error}"))?;
    for layer in &file.layer_data {
        let channels = &layer.channel_data.list;
        let named = |wanted: &str| {
            channels.iter().find(|channel| {
                let name = channel.name.to_string();
                name.rsplit('.')
                    .next()
                    .is_some_and(|last| last.eq_ignore_ascii_case(wanted))
            })
        };
        let chosen = match (named("R"), named("G"), named("B"), named("Y")) {
            (Some(r), Some(g), Some(b), _) => [Some(r), Some(g), Some(b), named("A")],
            (.., Some(y)) => [Some(y), named("A"), None, None],
            _ => continue,
        };
        let chosen: Vec<_> = chosen.into_iter().flatten().collect();
        let (width, height) = (layer.size.width(), layer.size.height());
        let count = chosen.len();
        let mut values = vec![0.0; width * height * count];
        for (offset, channel) in chosen.into_iter().enumerate() {
            if channel.sample_data.len() != width * height {
                return Err(format!(
                    "expected a sample per pixel, found channel `{}` with fewer",
                    channel.name
                ));
            }
            for (value, sample) in values[offset..]
                .iter_mut()
                .step_by(count)
                .zip(channel.sample_data.values_as_f32())
            {
                *value = sample;
            }
        }
        return Ok(Image {
            width,
            height,
            channels: count,
            texels: Texels::F32(values),
        });
    }
    Err("expected an EXR image with channels R, G and B, or Y; found none".to_owned())
}
