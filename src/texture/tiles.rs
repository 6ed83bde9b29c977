//! Textures of several images, one for each square of texture coordinates.

use super::{Image, TextureError};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What stands in a file's name for the number of a tile.
const TOKEN: &str = "<UDIM>";

/// The number of the square from (0, 0) to (1, 1); the one to its right has one more,
/// the one above ten more.
const FIRST: u32 = 1001;
/// Squares side by side.
const ACROSS: i64 = 10;

/// The image files of a texture: with `<UDIM>` in the file's name one for each tile
/// that there is, from 1001 up to 9999, by their number; else the one.
///
/// # Errors
/// Where there is no tile, or the folder can't be read.
pub fn files(path: &Path) -> Result<Vec<(Option<u32>, PathBuf)>, TextureError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let Some((before, after)) = name.split_once(TOKEN) else {
        return Ok(vec![(None, path.to_owned())]);
    };
    let fault = |message: String| TextureError {
        path: path.to_owned(),
        message,
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let cannot_read = |error| fault(format!("the folder of its tiles can't be read: {error}"));
    let mut tiles = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(cannot_read)? {
        let entry = entry.map_err(cannot_read)?;
        let name = entry.file_name();
        let number = name
            .to_str()
            .and_then(|name| name.strip_prefix(before)?.strip_suffix(after))
            .filter(|digits| digits.len() == 4)
            .and_then(|digits| digits.parse::<u32>().ok())
            .filter(|number| *number >= FIRST);
        tiles.extend(number.map(|number| (Some(number), entry.path())));
    }
    tiles.sort();
    if tiles.is_empty() {
        return Err(fault(format!(
            "expected a file for each tile, such as `{before}{FIRST}{after}`, found none"
        )));
    }
    Ok(tiles)
}

/// The images of a texture.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Tiles {
    /// One everywhere.
    One(Arc<Image>),
    /// By their number, in order; never empty.
    Many(Arc<[(u32, Arc<Image>)]>),
}

impl Tiles {
    /// # Panics
    /// Without an image.
    pub fn new(images: Vec<(Option<u32>, Arc<Image>)>) -> Self {
        match &images[..] {
            [(None, image)] => Self::One(Arc::clone(image)),
            _ => Self::Many(
                images
                    .into_iter()
                    .map(|(number, image)| (number.unwrap_or(FIRST), image))
                    .collect(),
            ),
        }
    }

    pub fn first(&self) -> &Image {
        match self {
            Self::One(image) => image,
            Self::Many(tiles) => &tiles[0].1,
        }
    }

    pub fn all(&self) -> impl Iterator<Item = &Arc<Image>> {
        let (one, many) = match self {
            Self::One(image) => (Some(image), &[][..]),
            Self::Many(tiles) => (None, &tiles[..]),
        };
        one.into_iter().chain(many.iter().map(|(_, image)| image))
    }

    /// The image at a place, and the place within it; `None` where a tile is missing.
    /// As in Cycles, what is left of the first square or below it, by less than one,
    /// belongs to that, too.
    pub fn at(&self, place: [f64; 2]) -> Option<(&Image, [f64; 2])> {
        let tiles = match self {
            Self::One(image) => return Some((image, place)),
            Self::Many(tiles) => tiles,
        };
        let [x, y] = place.map(|place| place as i64);
        if !(0..ACROSS).contains(&x) || !(0..1000).contains(&y) {
            return None;
        }
        let number = FIRST + (ACROSS * y + x) as u32;
        let index = tiles.binary_search_by_key(&number, |(number, _)| *number);
        let (_, image) = &tiles[index.ok()?];
        Some((image, [place[0] - x as f64, place[1] - y as f64]))
    }
}
