//! The channels of an OpenEXR file, and which of them are its colour.

use exr::block::chunk::CompressedBlock;
use exr::compression::Compression;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{FlatImage, FlatSamples, IntegerBounds, ReadChannels, ReadLayers, Text};
use std::io::{BufRead, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::memory::Bytes;

/// What the best compression of image formats makes of one byte: deflate's 1032,
/// of bits that become bytes.
pub(crate) const MOST_PER_BYTE: u64 = 8300;

/// Reads all that a file of `length` bytes holds, at its largest resolution, if
/// that takes no more than `most` bytes.
///
/// # Errors
/// In words, when the file is broken or too large.
pub(crate) fn read_flat(
    mut reader: impl BufRead + Seek + Send,
    length: u64,
    most: u64,
) -> Result<FlatImage, String> {
    let headers = MetaData::read_from_buffered(&mut reader, false)
        .map_err(|error| error.to_string())?
        .headers;
    let mut bytes = 0u64;
    for header in &headers {
        let pixels = (header.layer_size.0 as u64).saturating_mul(header.layer_size.1 as u64);
        let channels = header.channels.list.iter().map(|channel| {
            let samples = pixels / (channel.sampling.area() as u64).max(1);
            samples.saturating_mul(channel.sample_type.bytes_per_sample() as u64)
        });
        let layer = channels.fold(0u64, u64::saturating_add);
        bytes = bytes.saturating_add(layer);
    }
    is_plausible(bytes, length)?;
    if bytes > most {
        return Err(format!(
            "its {} of pixels are more than the {} that are left",
            Bytes(bytes),
            Bytes(most)
        ));
    }
    if headers.iter().all(|header| header.deep) {
        return Err("it holds deep data alone, which is not read".to_owned());
    }
    let start = |reader: &mut dyn Seek| {
        let at = reader.seek(SeekFrom::Start(0));
        at.map(|_| ()).map_err(|error| error.to_string())
    };
    start(&mut reader)?;
    if headers.iter().any(is_dwa) {
        check_dwa(&mut reader)?;
        start(&mut reader)?;
    }
    // The decompressors are others' code, and a panic of theirs ends here: in a thread
    // of a pool it would end the program.
    let read = || {
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_buffered(reader)
    };
    catch_unwind(AssertUnwindSafe(read))
        .map_err(|_| "it is broken: its decoder gave up".to_owned())?
        .map_err(|error| error.to_string())
}

fn is_dwa(header: &Header) -> bool {
    matches!(
        header.compression,
        Compression::DWAA(_) | Compression::DWAB(_)
    )
}

/// Refuses DWA streams that claim more than their bytes can hold: the decoder takes the
/// memory that they claim, and an allocation that fails ends the program.
fn check_dwa(reader: impl Read + Seek) -> Result<(), String> {
    let text = |error: exr::error::Error| error.to_string();
    let file = exr::block::read(reader, false).map_err(text)?;
    let headers = file.headers().to_vec();
    for chunk in file.all_chunks(false).map_err(text)? {
        let chunk = chunk.map_err(text)?;
        let header = &headers[chunk.layer_index];
        let stream = match &chunk.compressed_block {
            CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
            CompressedBlock::Tile(block) => &block.compressed_pixels_le,
            CompressedBlock::DeepScanLine(_) | CompressedBlock::DeepTile(_) => continue,
        };
        let pixels = header
            .get_block_data_indices(&chunk.compressed_block)
            .and_then(|block| header.get_absolute_block_pixel_coordinates(block))
            .map_err(text)?;
        // Blocks that would not shrink are stored as they are.
        let is_raw = stream.len() >= pixels.size.area() * header.channels.bytes_per_pixel;
        if !is_dwa(header) || is_raw {
            continue;
        }
        // A version, nine sizes, and a kind of compression, of eight bytes each.
        let sizes = stream.chunks_exact(8).skip(1).take(9);
        let number = |size: &[u8]| size.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b));
        let largest = sizes.map(number).max();
        is_plausible(largest.unwrap_or(0), stream.len() as u64)?;
    }
    Ok(())
}

/// Whether pixels of so many bytes can come from a file of that length. What is
/// claimed is taken before it is found to be missing.
pub(crate) fn is_plausible(bytes: u64, length: u64) -> Result<(), String> {
    if bytes / MOST_PER_BYTE <= length {
        return Ok(());
    }
    let (bytes, length) = (Bytes(bytes), Bytes(length));
    Err(format!(
        "it claims {bytes} of pixels, which {length} can't hold"
    ))
}

/// A channel of a file, with its name split at the last dot.
pub(crate) struct Plane<'a> {
    pub layer: String,
    pub channel: String,
    pub window: IntegerBounds,
    pub samples: &'a FlatSamples,
}

impl<'a> Plane<'a> {
    pub fn all(file: &'a FlatImage) -> Vec<Self> {
        let mut planes = Vec::new();
        for part in &file.layer_data {
            let part_name = part.attributes.layer_name.as_ref().map(text);
            for channel in &part.channel_data.list {
                let name = text(&channel.name);
                let (layer, channel_name) = name.rsplit_once('.').unwrap_or(("", &name));
                // In a file of several parts, a layer may be named by its part.
                let layer = match &part_name {
                    Some(part) if layer.is_empty() && file.layer_data.len() > 1 => part,
                    _ => layer,
                };
                planes.push(Self {
                    layer: layer.to_owned(),
                    channel: channel_name.to_owned(),
                    window: part.absolute_bounds(),
                    samples: &channel.sample_data,
                });
            }
        }
        planes
    }

    pub fn full_name(&self) -> String {
        join(&self.layer, &self.channel)
    }

    /// Whether there is a sample for each pixel.
    pub fn is_whole(&self) -> bool {
        self.samples.len() == self.window.size.area()
    }
}

pub(crate) fn join(layer: &str, channel: &str) -> String {
    if layer.is_empty() {
        channel.to_owned()
    } else {
        format!("{layer}.{channel}")
    }
}

/// The format's strings are bytes; we take and write UTF-8, as Blender does.
pub(crate) fn text(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Which channels are the colour of an image.
pub(crate) struct Chosen {
    /// Red, green and blue; three times the same for grey.
    pub color: [usize; 3],
    /// The alpha of the same layer.
    pub alpha: Option<usize>,
}

/// The indices of the colour, or what is wrong. In this order: `R`, `G`, `B`;
/// those of the one layer called `Combined`, as in Blender's multilayer files;
/// those of the one layer that has them; `X`, `Y`, `Z`, as of normals; a lone
/// luminance `Y`; a lone channel of any name.
pub(crate) fn find_color(planes: &[Plane]) -> Result<Chosen, &'static str> {
    let find = |layer: &str, channel: &str| {
        planes
            .iter()
            .position(|plane| plane.layer == layer && plane.channel.eq_ignore_ascii_case(channel))
    };
    let three = |layer: &str, names: [&str; 3]| {
        let [Some(x), Some(y), Some(z)] = names.map(|name| find(layer, name)) else {
            return None;
        };
        let alpha = find(layer, "A");
        let color = [x, y, z];
        Some(Chosen { color, alpha })
    };
    let rgb = |layer: &str| three(layer, ["R", "G", "B"]);
    if let Some(chosen) = rgb("") {
        return Ok(chosen);
    }
    let mut layers: Vec<&str> = planes.iter().map(|plane| plane.layer.as_str()).collect();
    layers.sort_unstable();
    layers.dedup();
    layers.retain(|layer| rgb(layer).is_some());
    let combined = |layer: &&str| layer.rsplit('.').next() == Some("Combined");
    if layers.iter().copied().any(|layer| combined(&layer)) {
        layers.retain(combined);
    }
    match layers.as_slice() {
        [layer] => Ok(rgb(layer).expect("layers without colour were dropped")),
        [] => {
            if find("", "RY").is_some() || find("", "BY").is_some() {
                return Err("and chroma (RY, BY) is not read");
            }
            if let Some(chosen) = three("", ["X", "Y", "Z"]) {
                return Ok(chosen);
            }
            let alone = (planes.len() == 1).then_some(0);
            let grey = find("", "Y")
                .or(alone)
                .ok_or("but no layer has R, G and B")?;
            Ok(Chosen {
                color: [grey; 3],
                alpha: find("", "A").filter(|&alpha| alpha != grey),
            })
        }
        _ => Err("but more than one layer could be meant"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{
        AnyChannels, Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage,
    };
    use std::io::Cursor;

    fn dwa() -> Vec<u8> {
        let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
            let x = (at.0 * 7 % 13) as f32 + at.1 as f32;
            (x, 0.5 * x, 0.0)
        });
        let encoding = Encoding {
            compression: Compression::DWAA(None),
            ..Encoding::FAST_LOSSLESS
        };
        let layer = Layer::new((64, 64), LayerAttributes::default(), encoding, channels);
        let mut bytes = Cursor::new(Vec::new());
        let image: Image<Layer<_>> = Image::from_layer(layer);
        image.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn read(bytes: &[u8]) -> Result<FlatImage, String> {
        read_flat(Cursor::new(bytes), bytes.len() as u64, 1 << 30)
    }

    #[test]
    fn streams_that_claim_too_much_are_refused() {
        let sound = dwa();
        let file: FlatImage = read(&sound).expect("a sound file is read");
        let _: &AnyChannels<FlatSamples> = &file.layer_data[0].channel_data;
        // The counters stand at the start of a chunk's stream.
        let mut chunks = exr::block::read(Cursor::new(&sound), false)
            .unwrap()
            .all_chunks(false)
            .unwrap();
        let Some(Ok(chunk)) = chunks.next() else {
            panic!("there are chunks");
        };
        let CompressedBlock::Tile(block) = chunk.compressed_block else {
            panic!("they are tiles");
        };
        let stream = block.compressed_pixels_le;
        let at = sound
            .windows(stream.len())
            .position(|bytes| bytes == stream)
            .expect("the stream is in the file");
        for counter in 1..10 {
            let mut broken = sound.clone();
            broken[at + 8 * counter + 6] = 1;
            let error = read(&broken).expect_err("2⁴⁸ bytes");
            assert!(error.contains("can't hold"), "{error}");
        }
    }
}
