//! Images that several textures share.

use super::tiles::{Tiles, files};
use super::{Image, Lookup, Repair, Texture, TextureError, load};
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
        lookup: Lookup,
    ) -> Result<(Texture, Vec<Repair>), TextureError> {
        let mut images = Vec::new();
        let mut repairs = Vec::new();
        for (number, path) in files(path)? {
            let (image, mended) = self.image(&path)?;
            images.push((number, image));
            repairs.extend(mended);
        }
        let images = Tiles::new(images);
        let texture = Texture {
            images,
            lookup,
            slopes: None,
        };
        Ok((texture, repairs))
    }

    fn image(&self, path: &Path) -> Loaded {
        // Where there is no such file, reading it will say so.
        let key = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let slot = {
            let mut by_path = self.by_path.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(by_path.entry(key).or_default())
        };
        let loaded = slot.get_or_init(|| {
            load::image(path, self.budget).map(|(image, repairs)| (Arc::new(image), repairs))
        });
        loaded.clone()
    }
}
