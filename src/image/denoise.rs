//! Images without noise, by Open Image Denoise.

use super::{Image, Layer, Window};
use crate::embree::{DenoiseError, Denoiser, Guides};

/// The layer that holds it beside the noisy colour.
pub const DENOISED: &str = "denoised";

impl Image {
    /// The colour without noise, guided by the layers `albedo` and `normal`.
    ///
    /// # Errors
    /// When one of the layers is not there, or the library refuses.
    pub fn denoised(&self, denoiser: &Denoiser) -> Result<Vec<[f32; 3]>, DenoiseError> {
        let albedo = self.guide("albedo", ["R", "G", "B"])?;
        let normal = self.guide("normal", ["X", "Y", "Z"])?;
        let Window { width, height, .. } = self.window;
        let guides = Guides {
            albedo: &albedo,
            normal: &normal,
        };
        denoiser.denoise(&self.color, [width as usize, height as usize], guides)
    }

    fn guide(
        &self,
        name: &'static str,
        channels: [&str; 3],
    ) -> Result<Vec<[f32; 3]>, DenoiseError> {
        let found = self.layer(name).and_then(|layer| layer.triples(channels));
        found.ok_or(DenoiseError::NoGuide(name))
    }
}

impl Layer {
    /// A layer of a colour.
    pub fn of_color(name: &str, color: &[[f32; 3]]) -> Self {
        Self {
            name: name.to_owned(),
            channels: ["R", "G", "B"].map(str::to_owned).to_vec(),
            planes: [0, 1, 2]
                .map(|c| color.iter().map(|p| p[c]).collect())
                .to_vec(),
        }
    }
}
