//! A finished image in memory.

use super::Window;

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
            attributes: Vec::new(),
        }
    }

    /// The layer of that name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
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
        let [r, g, b] = ["R", "G", "B"].map(|name| self.channel(name));
        let (r, g, b) = (r?, g?, b?);
        Some((0..r.len()).map(|i| [r[i], g[i], b[i]]).collect())
    }
}
