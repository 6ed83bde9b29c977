//! Output files: checked before the render, whole after it.

use std::fs::{self, File};
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use ::image::codecs::png::PngEncoder;
use ::image::{ExtendedColorType, ImageEncoder, ImageError};

use super::{Display, Image, exr};

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

    /// Whether it is shown, and not scene-linear.
    pub fn is_png(&self) -> bool {
        self.format == Format::Png
    }

    /// Makes the folder if there is none and tries to write a file into it. To
    /// be called before the render: hours later is too late to find out.
    ///
    /// # Errors
    /// When [`Self::write`] could not succeed.
    pub fn check(&self) -> Result<(), OutputError> {
        check_output(&self.path)
    }

    /// Writes the image: scene-linear with all layers and attributes as EXR;
    /// colour and alpha, as `display` shows them, as PNG. The file is replaced once the
    /// new one is complete.
    ///
    /// # Errors
    /// When the system refuses; a file that was there before stays.
    pub fn write(&self, image: &Image, display: &Display) -> Result<(), OutputError> {
        match self.format {
            Format::Exr => {
                let mut bytes = Cursor::new(Vec::new());
                let encoded = exr::encode(image, &mut bytes);
                encoded.map_err(|error| self.refused(&error))?;
                replace(&self.path, bytes.get_ref())
            }
            Format::Png => {
                let size = [image.window.width, image.window.height];
                match image.alpha() {
                    Some(alpha) => {
                        let pixels = display.encode_with_alpha(image, alpha);
                        self.write_png(&pixels, size, ExtendedColorType::Rgba8)
                    }
                    None => self.write_rgb8(&display.encode(image), size),
                }
            }
        }
    }

    /// Writes 8-bit sRGB of the given width and height as PNG, whatever the
    /// extension.
    ///
    /// # Errors
    /// When the system refuses; a file that was there before stays.
    pub fn write_rgb8(&self, pixels: &[u8], size: [u32; 2]) -> Result<(), OutputError> {
        self.write_png(pixels, size, ExtendedColorType::Rgb8)
    }

    fn write_png(
        &self,
        pixels: &[u8],
        size: [u32; 2],
        kind: ExtendedColorType,
    ) -> Result<(), OutputError> {
        let bytes = png(pixels, size, kind).map_err(|error| self.refused(&error))?;
        replace(&self.path, &bytes)
    }

    fn refused(&self, error: &dyn std::error::Error) -> OutputError {
        OutputError::Write {
            path: self.path.clone(),
            reason: error.to_string(),
        }
    }
}

/// A PNG file of 8-bit sRGB of the given width and height.
///
/// # Errors
/// When there are not so many pixels.
pub fn encode_png(pixels: &[u8], size: [u32; 2]) -> Result<Vec<u8>, ImageError> {
    png(pixels, size, ExtendedColorType::Rgb8)
}

fn png(
    pixels: &[u8],
    [width, height]: [u32; 2],
    kind: ExtendedColorType,
) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(pixels, width, height, kind)?;
    Ok(bytes)
}

/// Whether a file can be written at `path`: makes its folder if there is none and
/// tries to write into it.
///
/// # Errors
/// When the file could not be replaced.
pub fn check_output(path: &Path) -> Result<(), OutputError> {
    let place = Place::of(path);
    let target = match &place {
        Place::File(target) => target,
        Place::Stream(_) => return Ok(()),
    };
    if target.is_dir() {
        return Err(OutputError::IsFolder(path.to_owned()));
    }
    let probe = temporary(target);
    let tried = create_new(&probe).and_then(|_| fs::remove_file(&probe));
    tried.map_err(|source| OutputError::Folder {
        folder: folder(target).to_owned(),
        source,
    })
}

/// Puts a file of these bytes at `path`: under a temporary name beside it first, on disk
/// before it is renamed, so that there is either the old file or all of the new one,
/// whatever happens. Where a symbolic link leads is replaced, not the link; pipes and
/// devices are written to.
///
/// # Errors
/// When the system refuses; a file that was there before stays.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    replace_with(path, |file| file.write_all(bytes))
}

/// As [`replace`], with what `write` writes, which need not be in memory at once.
///
/// # Errors
/// When the system refuses; a file that was there before stays.
pub fn replace_with(
    path: &Path,
    write: impl FnOnce(&mut File) -> std::io::Result<()>,
) -> Result<(), OutputError> {
    let failed = |error: std::io::Error| OutputError::Write {
        path: path.to_owned(),
        reason: error.to_string(),
    };
    let target = match Place::of(path) {
        Place::File(target) => target,
        Place::Stream(stream) => {
            let file = File::options().write(true).open(stream);
            return file.and_then(|mut file| write(&mut file)).map_err(failed);
        }
    };
    let temporary = temporary(&target);
    let written = create_new(&temporary).and_then(|mut file| {
        write(&mut file)?;
        file.sync_all()
    });
    if let Err(error) = written {
        // Best effort: the error that matters is the one at hand.
        let _ = fs::remove_file(&temporary);
        return Err(failed(error));
    }
    fs::rename(&temporary, &target).map_err(|source| OutputError::Rename {
        temporary,
        path: path.to_owned(),
        source,
    })?;
    // The new name is on disk with its folder; not all systems can say so.
    let _ = File::open(folder(&target)).and_then(|folder| folder.sync_all());
    Ok(())
}

/// What is at the name of an output.
enum Place {
    /// A regular file, or nothing so far; where links lead.
    File(PathBuf),
    /// A pipe or a device.
    Stream(PathBuf),
}

impl Place {
    fn of(path: &Path) -> Self {
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        match fs::metadata(&target) {
            Ok(found) if !found.is_file() && !found.is_dir() => Self::Stream(target),
            _ => Self::File(target),
        }
    }
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Makes a file, and its folder if there is none, in place of what a process that was
/// killed has left there. It follows no link.
fn create_new(path: &Path) -> std::io::Result<File> {
    fs::create_dir_all(folder(path))?;
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    File::create_new(path)
}

/// A name in the same folder, hence on the same file system, which the next output of
/// this name takes again.
fn temporary(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    folder(path).join(format!(".{name}.part"))
}
