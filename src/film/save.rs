//! Saving a film between runs and for other machines, bit by bit.
//!
//! Layout, numbers little-endian: 16 magic bytes, the last of them the version; the length
//! of the header (u32) and the header, JSON of [`Header`]; how PNGs look: the exposure
//! (f32), the nodes per side of the view transform's table (u32, 0 without one), and of a
//! table its offset, min and max (f32) and its nodes (3 × f32 each); then per tile the
//! ranges of its samples (a u32 count and 2 × u32 each), its sums, its halves (6 × f32 per
//! pixel), the samples left out (u32 per pixel, and again for AOVs if there are any), and
//! its faults (per cause a u64 count, a u32 number of pixels and 2 × u32 each); last the
//! XXH3 of all that (u128).
//!
//! Version 6 has neither [`Finish`] nor how PNGs look.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3Default;

use super::exact::ExactSums;
use super::tile::{FAULT_PIXELS, FilmTile};
use super::{Aov, AovSet, Film, Taken};
use crate::image::{Display, Log2, Lut, OutputError, Window, replace_with};

/// The first bytes, but for the version after them.
const MAGIC: &[u8; 15] = b"smithwalk film\0";
/// The version that is written.
const VERSION: u8 = 7;
/// The last version before films said how their images look.
const WITHOUT_FINISH: u8 = 6;

/// About as many bytes are written to a file at once.
const AT_ONCE: usize = 1 << 20;

/// Longer headers are refused: a scene of 10⁶ objects stays below.
const LONGEST_HEADER: usize = 1 << 28;

/// What decides about the samples of a film, named, each as a hash or a short value:
/// two films with the same have samples of the same image.
pub type Identity = BTreeMap<String, String>;

/// Why a saved film can't be used.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// There is no such file, or it can't be read.
    #[error("can't read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Not a film, one of another version, cut off, or damaged.
    #[error("{} is no film of this version: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A render of something else.
    #[error("{} is of another render: {difference}", path.display())]
    OtherRender {
        /// The file.
        path: PathBuf,
        /// How it differs.
        difference: String,
    },
}

/// What a film is of.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// What decides about its samples.
    pub identity: Identity,
    /// Samples per pixel that the whole render is to have.
    pub target: u32,
    /// What its images have beside samples; films of version 6 don't say.
    pub finish: Option<Finish>,
}

/// What images of a render have beside its samples, which do not depend on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Finish {
    /// The scene's file, as the render was told it.
    pub scene: String,
    /// A hash of all that decides about the image of all samples.
    pub complete: String,
    /// How PNGs look.
    pub display: Display,
}

/// What a file says of its film before the tiles.
#[derive(Serialize, Deserialize)]
struct Header<'a> {
    identity: Cow<'a, Identity>,
    target: u32,
    #[serde(default)]
    scene: Cow<'a, str>,
    #[serde(default)]
    complete: Cow<'a, str>,
    resolution: [u32; 2],
    /// Left, top, width, height.
    window: [u32; 4],
    aovs: Vec<Aov>,
    /// The samples that it is to have.
    share: [u32; 2],
}

/// A film from a file.
#[derive(Clone, Debug)]
pub struct SavedFilm {
    /// The file.
    pub path: PathBuf,
    /// What it is of.
    pub origin: Origin,
    /// The sums.
    pub film: Film,
}

/// Where the film behind an image file is saved: `image.exr.film`.
pub fn sidecar_path(image: &Path) -> PathBuf {
    let mut name = image.as_os_str().to_owned();
    name.push(".film");
    name.into()
}

/// How two identities differ, for people: at most a few names; `None` when they don't.
fn difference(theirs: &Identity, ours: &Identity) -> Option<String> {
    const NAMED: usize = 4;
    let names = theirs
        .keys()
        .chain(ours.keys().filter(|key| !theirs.contains_key(*key)));
    let differing: Vec<String> = names
        .filter_map(|name| {
            // Hashes say nothing to people, short values do.
            let shown = |value: &String| value.len() < 20;
            match (theirs.get(name), ours.get(name)) {
                (Some(theirs), Some(ours)) if theirs == ours => None,
                (Some(theirs), Some(ours)) if shown(theirs) && shown(ours) => {
                    Some(format!("{name} {theirs}, not {ours}"))
                }
                (Some(_), Some(_)) => Some(format!("another {name}")),
                (Some(_), None) => Some(format!("{name}, which is not there now")),
                (None, _) => Some(format!("no {name}")),
            }
        })
        .collect();
    let more = differing.len().saturating_sub(NAMED);
    match differing.len() {
        0 => None,
        1..=NAMED => Some(format!("it has {}", differing.join("; "))),
        _ => Some(format!(
            "it has {}; and {more} more differences",
            differing[..NAMED].join("; ")
        )),
    }
}

impl Film {
    /// Saves the accumulators, all bits of them, with what they are of; without
    /// [`Origin::finish`] as version 6.
    ///
    /// # Errors
    /// When the file can't be written; one that was there before stays.
    pub fn save(&self, path: &Path, origin: &Origin) -> Result<(), OutputError> {
        let Window {
            x,
            y,
            width,
            height,
        } = self.window;
        let finish = origin.finish.as_ref();
        let header = Header {
            identity: Cow::Borrowed(&origin.identity),
            target: origin.target,
            scene: finish.map_or("", |finish| &finish.scene).into(),
            complete: finish.map_or("", |finish| &finish.complete).into(),
            resolution: self.resolution,
            window: [x, y, width, height],
            aovs: self.aovs.iter().collect(),
            share: [self.share.start, self.share.end],
        };
        let header = serde_json::to_vec(&header).expect("strings and numbers alone");
        let mut bytes = MAGIC.to_vec();
        bytes.push(finish.map_or(WITHOUT_FINISH, |_| VERSION));
        bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&header);
        if let Some(finish) = finish {
            bytes.extend_from_slice(&finish.display.to_bytes());
        }
        replace_with(path, |file| {
            let mut hash = Xxh3Default::new();
            let mut write = |bytes: &[u8]| {
                hash.update(bytes);
                file.write_all(bytes)
            };
            // All at once would be as much again as the film.
            for tile in &self.tiles {
                if bytes.len() >= AT_ONCE {
                    write(&bytes)?;
                    bytes.clear();
                }
                write_tile(tile, &mut bytes);
            }
            write(&bytes)?;
            file.write_all(&hash.digest128().to_le_bytes())
        })
    }

    /// Goes on with a saved film, which must be of the same layout and identity.
    ///
    /// # Errors
    /// When it is not, or has gaps between its samples. This film is then unchanged.
    pub fn resume(&mut self, saved: SavedFilm, identity: &Identity) -> Result<(), FilmError> {
        let SavedFilm { path, origin, film } = saved;
        let other = |difference| Err(FilmError::OtherRender { path, difference });
        let difference = difference(&origin.identity, identity);
        if let Some(difference) = difference.or_else(|| film.layout_difference(self)) {
            return other(difference);
        }
        let begins = |tile: &FilmTile| match tile.taken.ranges() {
            [] => true,
            [range] => range.start == self.share.start,
            _ => false,
        };
        if !film.tiles.iter().all(begins) {
            let (theirs, ours) = (film.common(), self.share.start);
            return other(format!(
                "it has samples {theirs}, which can't be gone on with from sample {ours}"
            ));
        }
        let share = self.share.clone();
        *self = film;
        self.share = share;
        Ok(())
    }

    /// How the image differs from another film's, for people; `None` when it doesn't.
    fn layout_difference(&self, other: &Self) -> Option<String> {
        if (self.resolution, self.window) != (other.resolution, other.window) {
            Some("it has another resolution or crop".to_owned())
        } else if self.aovs != other.aovs {
            Some("it has other AOVs".to_owned())
        } else {
            None
        }
    }
}

impl SavedFilm {
    /// What keeps it from being a part of the same render as another, for people; `None`
    /// when it is one.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let target = || {
            let [theirs, ours] = [self.origin.target, other.origin.target];
            (theirs != ours)
                .then(|| format!("it is a part of {theirs} samples per pixel, not of {ours}"))
        };
        difference(&self.origin.identity, &other.origin.identity)
            .or_else(|| self.film.layout_difference(&other.film))
            .or_else(target)
    }

    /// Reads a film.
    ///
    /// # Errors
    /// When the file is no film, is damaged, or says what no film can.
    pub fn read(path: &Path) -> Result<Self, FilmError> {
        let io = |source| FilmError::Io {
            path: path.to_owned(),
            source,
        };
        let format = |reason: &str| FilmError::Format {
            path: path.to_owned(),
            reason: reason.to_owned(),
        };
        // A pipe or a device may never end.
        if !std::fs::metadata(path).map_err(io)?.is_file() {
            return Err(format("it is no regular file"));
        }
        let mut file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        let mut magic = [0; MAGIC.len() + 1];
        if length < magic.len() as u64 {
            return Err(format("it begins differently"));
        }
        file.read_exact(&mut magic).map_err(io)?;
        let version = match magic.strip_prefix(MAGIC) {
            Some(&[version @ (WITHOUT_FINISH | VERSION)]) => version,
            Some(_) => return Err(format("it is of another version")),
            None => return Err(format("it begins differently")),
        };
        let damaged = || format("it is cut off or damaged");
        let overhead = (magic.len() + size_of::<u128>()) as u64;
        let mut reader = Reader {
            left: length.checked_sub(overhead).ok_or_else(damaged)?,
            file: BufReader::with_capacity(AT_ONCE, file),
            hash: Xxh3Default::new(),
        };
        reader.hash.update(&magic);
        let read = read(&mut reader, version);
        if !reader.finish().map_err(io)? {
            return Err(damaged());
        }
        let (origin, film) = read.ok_or_else(|| format("its content contradicts itself"))?;
        Ok(Self {
            path: path.to_owned(),
            origin,
            film,
        })
    }
}

fn write_tile(tile: &FilmTile, bytes: &mut Vec<u8>) {
    let ranges = tile.taken.ranges();
    bytes.extend_from_slice(&(ranges.len() as u32).to_le_bytes());
    for value in ranges.iter().flat_map(|range| [range.start, range.end]) {
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    tile.sums.write(bytes);
    for value in tile.halves.as_flattened().as_flattened() {
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    for value in tile.left_out.iter().chain(&tile.aovs_left_out) {
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

/// All between the magic bytes and the hash; `None` when it can't be a film's.
fn read(reader: &mut Reader, version: u8) -> Option<(Origin, Film)> {
    let length = reader.u32()? as usize;
    if length > LONGEST_HEADER {
        return None;
    }
    let header = reader.bytes(length)?;
    let header: Header = serde_json::from_slice(&header).ok()?;
    let display = match version {
        WITHOUT_FINISH => None,
        _ => Some(reader.display()?),
    };
    let [x, y, width, height] = header.window;
    let window = Window {
        x,
        y,
        width,
        height,
    };
    let [columns, rows] = header.resolution;
    let fits = |start: u32, size: u32, full| start.checked_add(size).is_some_and(|end| end <= full);
    // Each pixel takes more than a hundred bytes: what is too large is not allocated.
    let area = u64::from(width) * u64::from(height);
    let [first, end] = header.share;
    if !fits(x, width, columns) || !fits(y, height, rows) || area > reader.left || first > end {
        return None;
    }
    let aovs: AovSet = header.aovs.iter().copied().collect();
    let mut film = Film::new(header.resolution, window, aovs);
    film.set_share(first..end);
    for tile in &mut film.tiles {
        reader.tile(tile)?;
    }
    let finish = display.map(|display| Finish {
        scene: header.scene.into_owned(),
        complete: header.complete.into_owned(),
        display,
    });
    let origin = Origin {
        identity: header.identity.into_owned(),
        target: header.target,
        finish,
    };
    (reader.left == 0).then_some((origin, film))
}

/// A saved film as it is read: whole in memory it would be as much again as the film.
struct Reader {
    file: BufReader<File>,
    /// Bytes that are yet to be read before the hash.
    left: u64,
    /// Of what has been read.
    hash: Xxh3Default,
}

impl Reader {
    /// `None` past the end, or where the system refuses, which [`Self::finish`] then
    /// meets again.
    fn fill(&mut self, bytes: &mut [u8]) -> Option<()> {
        self.left = self.left.checked_sub(bytes.len() as u64)?;
        self.file.read_exact(bytes).ok()?;
        self.hash.update(bytes);
        Some(())
    }

    fn bytes(&mut self, count: usize) -> Option<Vec<u8>> {
        if count as u64 > self.left {
            return None;
        }
        let mut bytes = vec![0; count];
        self.fill(&mut bytes)?;
        Some(bytes)
    }

    /// Reads on to the end; whether the hash is that of all before it.
    fn finish(mut self) -> std::io::Result<bool> {
        let mut rest = [0; 4096];
        while self.left > 0 {
            let count = rest.len().min(self.left as usize);
            self.file.read_exact(&mut rest[..count])?;
            self.hash.update(&rest[..count]);
            self.left -= count as u64;
        }
        let mut sum = [0; size_of::<u128>()];
        self.file.read_exact(&mut sum)?;
        Ok(u128::from_le_bytes(sum) == self.hash.digest128())
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut taken = [0; N];
        self.fill(&mut taken)?;
        Some(taken)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    /// So many numbers of 32 bits.
    fn words(&mut self, count: usize) -> Option<Vec<u32>> {
        let bytes = self.bytes(count.checked_mul(size_of::<u32>())?)?;
        let words = bytes.chunks_exact(size_of::<u32>());
        let word = |word: &[u8]| u32::from_le_bytes(word.try_into().expect("four bytes"));
        Some(words.map(word).collect())
    }

    fn floats(&mut self, count: usize) -> Option<Vec<f32>> {
        let words = self.words(count)?;
        Some(words.into_iter().map(f32::from_bits).collect())
    }

    fn display(&mut self) -> Option<Display> {
        let exposure = f32::from_bits(self.u32()?);
        let lut = match self.u32()? as usize {
            0 => None,
            side => {
                let domain = self.floats(3)?;
                let domain = Log2 {
                    offset: domain[0],
                    min: domain[1],
                    max: domain[2],
                };
                let nodes = self.floats(side.checked_pow(3)?.checked_mul(3)?)?;
                let nodes = nodes.chunks_exact(3).map(|n| [n[0], n[1], n[2]]);
                Some(Lut::new(domain, side, nodes.collect())?)
            }
        };
        exposure.is_finite().then_some(Display { exposure, lut })
    }

    fn tile(&mut self, tile: &mut FilmTile) -> Option<()> {
        let ranges = self.u32()? as usize;
        if ranges as u64 > self.left / 8 {
            return None;
        }
        let ends = self.words(2 * ranges)?;
        let ranges = ends.chunks_exact(2).map(|ends| ends[0]..ends[1]);
        tile.taken = Taken::new(ranges.collect())?;
        tile.sums = ExactSums::read(&self.bytes(tile.sums.bytes())?)?;
        let halves = tile.halves.as_flattened_mut().as_flattened_mut();
        halves.copy_from_slice(&self.floats(halves.len())?);
        for counts in [&mut tile.left_out, &mut tile.aovs_left_out] {
            *counts = self.words(counts.len())?;
        }
        for fault in &mut tile.faults {
            fault.samples = u64::from_le_bytes(self.take()?);
            let pixels = self.u32()? as usize;
            if pixels > FAULT_PIXELS {
                return None;
            }
            let places = self.words(2 * pixels)?;
            fault.pixels = places.chunks_exact(2).map(|at| [at[0], at[1]]).collect();
        }
        tile.is_possible().then_some(())
    }
}
