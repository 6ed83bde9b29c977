//! Saving a film between runs, bit by bit.
//!
//! Layout, all little-endian: the magic bytes and the version; the fingerprint
//! of what is rendered (u64); resolution and window (6 × u32); the AOVs' bits
//! (u8); then per tile its colour sums (per pixel 6 × f64, 6 × f32, 4 × u32),
//! its AOV sums (f64), and its faults (per cause a u64 count, a u32 number of
//! pixels and 2 × u32 each); last a checksum of all that (u64).

use std::io::Write;
use std::path::{Path, PathBuf};

use super::plan::Draws;
use super::tile::{FAULT_PIXELS, Fault};
use super::{AovSet, Film};
use crate::image::{OutputError, Window, replace};

const MAGIC: &[u8; 16] = b"smithwalk film\0\x05";

/// Why a saved film can't be taken up again.
#[derive(Debug, thiserror::Error)]
pub enum ResumeError {
    /// There is no such file, or it can't be read.
    #[error("can't read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Not a file of this version's, cut off, or damaged.
    #[error("{} is no saved render of this version: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A render of something else.
    #[error("{} was saved by a render with {difference}; start afresh without --resume",
        path.display())]
    OtherRender {
        /// The file.
        path: PathBuf,
        /// How it differs.
        difference: &'static str,
    },
}

/// Where the film behind an image file is saved: `image.exr.film`.
pub fn sidecar_path(image: &Path) -> PathBuf {
    let mut name = image.as_os_str().to_owned();
    name.push(".film");
    name.into()
}

impl Film {
    /// Saves the accumulators, all bits of them. `fingerprint` stands for
    /// whatever must be the same for a render to go on: scene, seed, estimator.
    ///
    /// # Errors
    /// When the file can't be written; one that was there before stays.
    pub fn save(&self, path: &Path, fingerprint: u64) -> Result<(), OutputError> {
        let mut bytes = Vec::with_capacity(self.bytes() + 4096);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&fingerprint.to_le_bytes());
        let Window {
            x,
            y,
            width,
            height,
        } = self.window;
        let [columns, rows] = self.resolution;
        for value in [columns, rows, x, y, width, height] {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        bytes.push(self.aovs.0);
        for tile in &self.tiles {
            for color in &tile.colors {
                for value in color.sum.iter().chain(&color.squares) {
                    bytes.extend_from_slice(&value.to_le_bytes());
                }
                for value in color.milestone.iter().chain(&color.moved) {
                    bytes.extend_from_slice(&value.to_le_bytes());
                }
                let Draws {
                    camera_rays,
                    light_samples,
                    branches,
                } = color.draws;
                let counts = [color.count, color.left_out];
                for value in counts
                    .into_iter()
                    .chain([camera_rays, light_samples, branches])
                {
                    bytes.extend_from_slice(&value.to_le_bytes());
                }
            }
            for value in &tile.sums {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            for fault in &tile.faults {
                bytes.extend_from_slice(&fault.samples.to_le_bytes());
                bytes.extend_from_slice(&(fault.pixels.len() as u32).to_le_bytes());
                for value in fault.pixels.as_flattened() {
                    bytes.extend_from_slice(&value.to_le_bytes());
                }
            }
        }
        let checksum = checksum(&bytes);
        bytes.extend_from_slice(&checksum.to_le_bytes());
        replace(path, |file| {
            file.write_all(&bytes).map_err(|error| error.to_string())
        })
    }

    /// Takes up a saved film into an empty one of the same layout.
    ///
    /// # Errors
    /// When the file is no film, is damaged, or belongs to another render. This
    /// film is then unchanged.
    pub fn resume(&mut self, path: &Path, fingerprint: u64) -> Result<(), ResumeError> {
        let bytes = std::fs::read(path).map_err(|source| ResumeError::Io {
            path: path.to_owned(),
            source,
        })?;
        let format = |reason| ResumeError::Format {
            path: path.to_owned(),
            reason,
        };
        let other = |difference| ResumeError::OtherRender {
            path: path.to_owned(),
            difference,
        };
        let Some((content, sum)) = bytes.split_last_chunk::<8>() else {
            return Err(format("it is too short"));
        };
        let Some(content) = content.strip_prefix(MAGIC) else {
            return Err(format("it begins differently"));
        };
        if u64::from_le_bytes(*sum) != checksum(&bytes[..bytes.len() - 8]) {
            return Err(format("it is cut off or damaged"));
        }
        let mut reader = Reader(content);
        let damaged = || format("its content contradicts itself");
        if reader.u64().ok_or_else(damaged)? != fingerprint {
            return Err(other("another scene, seed or estimator"));
        }
        let mut header = [0; 6];
        for value in &mut header {
            *value = reader.u32().ok_or_else(damaged)?;
        }
        let [columns, rows, x, y, width, height] = header;
        let window = Window {
            x,
            y,
            width,
            height,
        };
        if [columns, rows] != self.resolution || window != self.window {
            return Err(other("another resolution or crop"));
        }
        let aovs = AovSet(reader.take::<1>().ok_or_else(damaged)?[0]);
        if aovs != self.aovs {
            return Err(other("other AOVs"));
        }
        *self = reader.film(self).ok_or_else(damaged)?;
        Ok(())
    }
}

/// The part of a saved film that is yet to be read.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*taken)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f32(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    /// Everything behind the header, for a film of the layout of `empty`.
    fn film(mut self, empty: &Film) -> Option<Film> {
        let mut film = Film::new(empty.resolution, empty.window, empty.aovs);
        for tile in &mut film.tiles {
            for color in &mut tile.colors {
                for value in color.sum.iter_mut().chain(&mut color.squares) {
                    *value = self.f64()?;
                }
                for value in color.milestone.iter_mut().chain(&mut color.moved) {
                    *value = self.f32()?;
                }
                color.count = self.u32()?;
                color.left_out = self.u32()?;
                color.draws = Draws {
                    camera_rays: self.u32()?,
                    light_samples: self.u32()?,
                    branches: self.u32()?,
                };
            }
            for value in &mut tile.sums {
                *value = self.f64()?;
            }
            for fault in Fault::ALL {
                let fault = &mut tile.faults[fault as usize];
                fault.samples = self.u64()?;
                let pixels = self.u32()?;
                if pixels as usize > FAULT_PIXELS {
                    return None;
                }
                for _ in 0..pixels {
                    fault.pixels.push([self.u32()?, self.u32()?]);
                }
            }
        }
        self.0.is_empty().then_some(film)
    }
}

/// FNV-1a (Fowler, Noll, Vo) over 64-bit words: against truncation and bit rot,
/// not against malice.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.chunks(8).fold(0xcbf2_9ce4_8422_2325, |hash, chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        (hash ^ u64::from_le_bytes(word)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
