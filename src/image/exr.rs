//! OpenEXR, scene-linear: our own files, and what Blender writes.

use std::io::{Cursor, Read, Seek, Write};
use std::path::{Path, PathBuf};

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatImage, FlatSamples, ImageAttributes,
    IntegerBounds, LayerAttributes, Text, Vec2, WritableImage,
};

use super::planes::{Plane, find_color, join, read_flat, text};
use super::{Image, Layer, Window};
use crate::memory::Budget;

/// Why an OpenEXR file can't be used.
#[derive(Debug, thiserror::Error)]
pub enum ExrError {
    /// There is no such file, or it can't be read.
    #[error("can't read {path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is damaged, no OpenEXR file, or uses a feature that is not
    /// supported.
    #[error("{path} is no OpenEXR file that can be read: {reason}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// Nothing in the file can be taken for the image's colour.
    #[error(
        "{path}: expected channels R, G, B, or those of one Combined pass \
         (as in ViewLayer.Combined.R), {problem}; found: {}",
        found.join(", ")
    )]
    NoColor {
        /// The file.
        path: PathBuf,
        /// What stands against the channels found.
        problem: &'static str,
        /// Full names of the channels that are there.
        found: Vec<String>,
    },
}

/// Reads an OpenEXR file, scanlines or tiles, half or float, single-part or
/// multi-part, any compression but HTJ2K.
///
/// The colour is, in this order, the channels `R`, `G`, `B`; the one layer
/// called `Combined`, as Blender's multilayer files have it; the one layer that
/// has `R`, `G` and `B`; `X`, `Y`, `Z`; a lone luminance `Y`; a lone channel of
/// any name. Of several resolution levels the
/// largest is taken. Alpha stays a channel of a layer and has no influence.
///
/// # Errors
/// When the file can't be read or has no such channels.
pub fn read_exr(path: &Path) -> Result<Image, ExrError> {
    let fail = |source| ExrError::Io {
        path: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    let mut file = crate::file::open(path).map_err(fail)?;
    file.read_to_end(&mut bytes).map_err(fail)?;
    decode(&bytes, path)
}

/// Reads the bytes of the file called `path`.
fn decode(bytes: &[u8], path: &Path) -> Result<Image, ExrError> {
    let format = |reason: String| ExrError::Format {
        path: path.to_owned(),
        reason,
    };
    let most = Budget::of_machine().left();
    let file = read_flat(Cursor::new(bytes), bytes.len() as u64, most).map_err(format)?;

    let planes = Plane::all(&file);
    let chosen = find_color(&planes).map_err(|problem| ExrError::NoColor {
        path: path.to_owned(),
        problem,
        found: planes.iter().map(Plane::full_name).collect(),
    })?;
    let colors = chosen.color;
    let data_window = planes[colors[0]].window;
    let (resolution, window) = place(file.attributes.display_window, data_window);
    let values = |index: usize| {
        let plane: &Plane = &planes[index];
        if !plane.is_whole() || plane.window != data_window {
            let name = plane.full_name();
            let problem = format!("channel {name} is subsampled or of another size");
            return Err(format(problem));
        }
        Ok(plane.samples.values_as_f32().collect::<Vec<_>>())
    };
    let [r, g, b] = [values(colors[0])?, values(colors[1])?, values(colors[2])?];

    let mut image = Image::black(resolution, window);
    image.color = (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect();
    image.half = colors
        .iter()
        .any(|&index| matches!(planes[index].samples, FlatSamples::F16(_)));
    for (index, plane) in planes.iter().enumerate() {
        if colors.contains(&index) || plane.window != data_window {
            continue;
        }
        // A layer that does not fit is of no use, but the colour may be.
        let Ok(values) = values(index) else { continue };
        let position = image.layers.iter().position(|l| l.name == plane.layer);
        let position = position.unwrap_or_else(|| {
            image.layers.push(Layer::black(&plane.layer, &[], 0));
            image.layers.len() - 1
        });
        let layer = &mut image.layers[position];
        layer.channels.push(plane.channel.clone());
        layer.planes.push(values);
    }
    image.attributes = attributes(&file);
    Ok(image)
}

/// The size of the full image and the part of it that the file's data covers.
/// Data that reaches beyond the display window is taken as the full image.
fn place(display: IntegerBounds, data: IntegerBounds) -> ([u32; 2], Window) {
    let size = [data.size.0 as u32, data.size.1 as u32];
    let offset = |data: i32, display: i32| u32::try_from(i64::from(data) - i64::from(display)).ok();
    let start = offset(data.position.0, display.position.0)
        .zip(offset(data.position.1, display.position.1));
    if let Some((x, y)) = start {
        let fits =
            |start: u32, size: u32, full: usize| u64::from(start) + u64::from(size) <= full as u64;
        if fits(x, size[0], display.size.0) && fits(y, size[1], display.size.1) {
            let resolution = [display.size.0 as u32, display.size.1 as u32];
            let [width, height] = size;
            let window = Window {
                x,
                y,
                width,
                height,
            };
            return (resolution, window);
        }
    }
    (size, Window::full(size))
}

/// Attributes with a value of a simple kind, as text.
fn attributes(file: &FlatImage) -> Vec<(String, String)> {
    let parts = file.layer_data.iter().map(|part| &part.attributes.other);
    let all = parts.chain([&file.attributes.other]).flatten();
    let mut found: Vec<_> = all
        .filter_map(|(name, value)| {
            let value = match value {
                AttributeValue::Text(value) => text(value),
                AttributeValue::F64(value) => value.to_string(),
                AttributeValue::F32(value) => value.to_string(),
                AttributeValue::I32(value) => value.to_string(),
                _ => return None,
            };
            Some((text(name), value))
        })
        .collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Writes an image as one part of 32-bit floats: `R`, `G`, `B`, and
/// `layer.channel` for each layer. ZIP compression loses nothing.
pub(super) fn encode(image: &Image, file: impl Write + Seek) -> Result<(), exr::error::Error> {
    let color = ["R", "G", "B"].into_iter().enumerate();
    let color = color.map(|(channel, name)| {
        let plane = image.color.iter().map(|color| color[channel]).collect();
        (name.to_owned(), plane)
    });
    let layers = image.layers.iter().flat_map(|layer| {
        let names = layer.channels.iter().map(|name| join(&layer.name, name));
        names.zip(layer.planes.iter().cloned())
    });
    let channels = color
        .chain(layers)
        .map(|(name, plane)| AnyChannel::new(exr_text(&name), FlatSamples::F32(plane)));

    let mut part_attributes = LayerAttributes {
        layer_position: Vec2(image.window.x as i32, image.window.y as i32),
        software_name: Some(exr_text(concat!("smithwalk ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (name, value) in &image.attributes {
        let value = AttributeValue::Text(exr_text(value));
        part_attributes.other.insert(exr_text(name), value);
    }
    let [width, height] = image.resolution.map(|size| size as usize);
    let part = exr::prelude::Layer::new(
        Vec2(image.window.width as usize, image.window.height as usize),
        part_attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    );
    exr::prelude::Image {
        attributes: ImageAttributes::with_size(Vec2(width, height)),
        layer_data: part,
    }
    .write()
    .to_buffered(file)
}

fn exr_text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}
