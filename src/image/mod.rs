//! Finished images: in memory, as OpenEXR files, as output files.
//!
//! [`OutputPath`] writes an [`Image`] as EXR or PNG, [`read_exr`] reads one back.

mod denoise;
mod display;
mod exr;
mod lut;
mod output;
pub(crate) mod planes;
mod window;

pub use denoise::DENOISED;
pub use display::Display;
pub use exr::{ExrError, read_exr};
pub use lut::{Log2, Lut, LutError};
pub use output::{OutputError, OutputPath, check_output, encode_png, replace, replace_with};
pub use window::Window;

/// An image with its layers, as developed from a film or read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width and height of the full image in pixels.
    pub resolution: [u32; 2],
    /// The part of the full image that there are pixels of.
    pub window: Window,
    /// Scene-linear Rec. 709, row by row from the top left of `window`.
    pub color: Vec<[f32; 3]>,
    /// What there is beside the colour.
    pub layers: Vec<Layer>,
    /// Whether the colour was read from half floats, of 11 significant bits.
    pub half: bool,
    /// Names and values of a file's attributes, those of the container format
    /// left out.
    pub attributes: Vec<(String, String)>,
}

/// Further channels of an image, of equal size.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// The layer's name, the part of a channel's name before the last dot.
    pub name: String,
    /// The channels' names, the part after the last dot.
    pub channels: Vec<String>,
    /// The values of each channel, row by row.
    pub planes: Vec<Vec<f32>>,
}

impl Image {
    /// A black image without layers.
    pub fn black(resolution: [u32; 2], window: Window) -> Self {
        Self {
            resolution,
            window,
            color: vec![[0.0; 3]; window.area()],
            layers: Vec::new(),
            half: false,
            attributes: Vec::new(),
        }
    }

    /// The layer of that name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// The share of each pixel that is covered, which the colour is multiplied by already;
    /// `None` where all are whole.
    pub fn alpha(&self) -> Option<&[f32]> {
        self.layer("")?.channel("A")
    }

    /// The part of the image within `window`, which must lie in its own.
    ///
    /// # Panics
    /// If it does not.
    pub fn crop(&self, window: Window) -> Self {
        assert_eq!(self.window.intersect(window), Some(window));
        let indices = || window.pixels().map(|pixel| self.window.index(pixel));
        let crop_layer = |layer: &Layer| Layer {
            name: layer.name.clone(),
            channels: layer.channels.clone(),
            planes: layer
                .planes
                .iter()
                .map(|plane| indices().map(|i| plane[i]).collect())
                .collect(),
        };
        Self {
            resolution: self.resolution,
            window,
            color: indices().map(|i| self.color[i]).collect(),
            layers: self.layers.iter().map(crop_layer).collect(),
            half: self.half,
            attributes: self.attributes.clone(),
        }
    }

    /// The value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(n, _)| n == name);
        found.map(|(_, value)| value.as_str())
    }
}

impl Layer {
    /// A layer of zeros.
    pub fn black(name: &str, channels: &[&str], pixels: usize) -> Self {
        Self {
            name: name.to_owned(),
            channels: channels.iter().map(|&c| c.to_owned()).collect(),
            planes: vec![vec![0.0; pixels]; channels.len()],
        }
    }

    /// The values of one channel.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        let index = self.channels.iter().position(|c| c == name)?;
        Some(&self.planes[index])
    }

    /// Red, green and blue per pixel, if those channels are there.
    pub fn rgb(&self) -> Option<Vec<[f32; 3]>> {
        self.triples(["R", "G", "B"])
    }

    /// These three channels per pixel, if they are there.
    pub fn triples(&self, channels: [&str; 3]) -> Option<Vec<[f32; 3]>> {
        let [a, b, c] = channels.map(|name| self.channel(name));
        let (a, b, c) = (a?, b?, c?);
        Some((0..a.len()).map(|i| [a[i], b[i], c[i]]).collect())
    }
}
