//! Output files: checked before the render, whole after it.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{Image, exr};

/// Why an image can't be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The name does not say which format to write.
    #[error("{}: expected a name that ends in .exr or .png", .0.display())]
    Extension(PathBuf),
    /// The name is that of a folder.
    #[error("{} is a folder; expected the name of a file", .0.display())]
    IsFolder(PathBuf),
    /// The folder can't be made, or nothing can be written into it.
    #[error("can't write into the folder {}: {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Writing failed. What was at `path` before is still there.
    #[error("can't write {}: {reason}", path.display())]
    Write {
        /// The file to be written.
        path: PathBuf,
        /// What the system or the encoder says.
        reason: String,
    },
    /// The image is complete, but could not be moved to its place.
    #[error("the image is in {}, since it can't be renamed to {}: {source}",
        temporary.display(), path.display())]
    Rename {
        /// Where the image is.
        temporary: PathBuf,
        /// Where it should be.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
}

/// The name of an image file to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputPath {
    path: PathBuf,
    format: Format,
}

impl OutputPath {
    /// Takes the format from the extension, `.exr` or `.png` in any case.
    ///
    /// # Errors
    /// [`OutputError::Extension`] for any other.
    pub fn new(path: impl Into<PathBuf>) -> Result<Self, OutputError> {
        let path = path.into();
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        let format = match extension.as_ref().and_then(|e| e.to_str()) {
            Some("exr") => Format::Exr,
            Some("png") => Format::Png,
            _ => return Err(OutputError::Extension(path)),
        };
        Ok(Self { path, format })
    }

    /// The file's name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the folder if there is none and tries to write a file into it. To
    /// be called before the render: hours later is too late to find out.
    ///
    /// # Errors
    /// When [`Self::write`] could not succeed.
    pub fn check(&self) -> Result<(), OutputError> {
        if self.path.is_dir() {
            return Err(OutputError::IsFolder(self.path.clone()));
        }
        let folder = folder(&self.path);
        let probe = temporary(&self.path);
        let tried = fs::create_dir_all(folder)
            .and_then(|()| File::create(&probe))
            .and_then(|_| fs::remove_file(&probe));
        tried.map_err(|source| OutputError::Folder {
            folder: folder.to_owned(),
            source,
        })
    }

    /// Writes the image: scene-linear with all layers and attributes as EXR;
    /// the colour alone as sRGB, scaled by 2^`exposure`, as PNG. The file is
    /// replaced once the new one is complete.
    ///
    /// # Errors
    /// When the system refuses; a file that was there before stays.
    pub fn write(&self, image: &Image, exposure: f32) -> Result<(), OutputError> {
        match self.format {
            Format::Exr => replace(&self.path, |file| {
                exr::encode(image, file).map_err(|error| error.to_string())
            }),
            Format::Png => {
                let size = [image.window.width, image.window.height];
                self.write_rgb8(&image.to_srgb8(exposure), size)
            }
        }
    }

    /// Writes 8-bit sRGB of the given width and height as PNG, whatever the
    /// extension.
    ///
    /// # Errors
    /// When the system refuses; a file that was there before stays.
    pub fn write_rgb8(&self, pixels: &[u8], size: [u32; 2]) -> Result<(), OutputError> {
        use ::image::ImageEncoder;
        let [width, height] = size;
        replace(&self.path, |file| {
            ::image::codecs::png::PngEncoder::new(file)
                .write_image(pixels, width, height, ::image::ExtendedColorType::Rgb8)
                .map_err(|error| error.to_string())
        })
    }
}

/// Writes a file under a temporary name beside `path` and renames it.
pub(crate) fn replace(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), String>,
) -> Result<(), OutputError> {
    let temporary = temporary(path);
    let written = File::create(&temporary)
        .map_err(|error| error.to_string())
        .and_then(|file| {
            let mut file = BufWriter::new(file);
            write(&mut file)?;
            file.flush().map_err(|error| error.to_string())?;
            file.get_ref().sync_all().map_err(|error| error.to_string())
        });
    if let Err(reason) = written {
        // Best effort: the error that matters is the one at hand.
        let _ = fs::remove_file(&temporary);
        let path = path.to_owned();
        return Err(OutputError::Write { path, reason });
    }
    fs::rename(&temporary, path).map_err(|source| OutputError::Rename {
        temporary,
        path: path.to_owned(),
        source,
    })
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// A name in the same folder, hence on the same file system, that no other
/// process uses.
fn temporary(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    folder(path).join(format!(".{name}.{}.part", std::process::id()))
}
