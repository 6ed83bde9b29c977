//! Images that several textures share.

use super::{ColorSpace, Image, Interpolation, Repair, Texture, TextureError, load};
use crate::memory::Budget;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

type Loaded = Result<(Arc<Image>, Vec<Repair>), TextureError>;

/// Image files, each read once and kept once, whatever it is called.
#[derive(Debug)]
pub struct Images<'a> {
    budget: &'a Budget,
    by_path: Mutex<HashMap<PathBuf, Arc<OnceLock<Loaded>>>>,
}

impl<'a> Images<'a> {
    /// None yet. They may take what the budget has.
    #[must_use]
    pub fn new(budget: &'a Budget) -> Self {
        Self {
            budget,
            by_path: Mutex::default(),
        }
    }

    /// As [`Texture::load`]. Several threads may ask at once.
    ///
    /// # Errors
    /// As [`Texture::load`], or when there is no room for it.
    pub fn texture(
        &self,
        path: &Path,
        color_space: ColorSpace,
        interpolation: Interpolation,
        scale: [f32; 2],
        offset: [f32; 2],
    ) -> Result<(Texture, Vec<Repair>), TextureError> {
        // Where there is no such file, reading it will say so.
        let key = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let slot = {
            let mut by_path = self.by_path.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(by_path.entry(key).or_default())
        };
        let loaded = slot.get_or_init(|| {
            load::image(path, self.budget).map(|(image, repairs)| (Arc::new(image), repairs))
        });
        let (image, repairs) = loaded.clone()?;
        let texture = Texture {
            image,
            color_space,
            interpolation,
            scale,
            offset,
        };
        Ok((texture, repairs))
    }
}
