//! From samples to images.
//!
//! A [`Film`] is a list of [`FilmTile`]s. A tile owns its pixels' accumulators,
//! and a sample counts for the one pixel it was taken in, because pixel filters
//! are importance-sampled ([`PixelFilter`]) and not splatted. Threads that take
//! whole tiles from [`Film::tiles_mut`] therefore need no locks, and since the
//! samples of a pixel are added in order, the sums have the same bits for any
//! number of threads.
//!
//! [`Film::develop`] turns sums into an [`Image`].

mod aov;
mod exact;
mod filter;
mod noise;
mod save;
mod taken;
mod tile;

pub use aov::{Aov, AovSet};
pub use filter::PixelFilter;
pub use save::{FilmError, Finish, Identity, Origin, SavedFilm, sidecar_path};
pub use taken::Taken;
pub use tile::{Fault, FaultCount, FilmTile, Sample};

use std::ops::Range;

use crate::image::{Image, Layer, Window};

/// Side of a tile in pixels: small enough to share out evenly among threads,
/// large enough that neighbours in memory are worked on by one thread.
const TILE_SIZE: u32 = 16;

/// The accumulators of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Width and height of the full image in pixels.
    resolution: [u32; 2],
    /// The part of it that is rendered.
    window: Window,
    aovs: AovSet,
    /// Indices of the samples that it is to have.
    share: Range<u32>,
    /// In rows of tiles, left to right; tiles at the right and the bottom may
    /// be cut off.
    tiles: Vec<FilmTile>,
}

impl Film {
    /// An empty film for `window` of an image of `resolution` (width, height).
    ///
    /// # Panics
    /// If `window` reaches beyond the image.
    pub fn new(resolution: [u32; 2], window: Window, aovs: AovSet) -> Self {
        let reaches =
            |start: u32, size: u32, full| start.checked_add(size).is_none_or(|end| end > full);
        assert!(
            !reaches(window.x, window.width, resolution[0])
                && !reaches(window.y, window.height, resolution[1]),
            "the window {window:?} reaches beyond the image of {resolution:?} pixels"
        );
        let starts = |size: u32| (0..size).step_by(TILE_SIZE as usize);
        let tiles = starts(window.height)
            .flat_map(|y| starts(window.width).map(move |x| (x, y)))
            .map(|(x, y)| Window {
                x: window.x + x,
                y: window.y + y,
                width: TILE_SIZE.min(window.width - x),
                height: TILE_SIZE.min(window.height - y),
            })
            .map(|tile| FilmTile::new(tile, aovs, 0))
            .collect();
        Self {
            resolution,
            window,
            aovs,
            share: 0..u32::MAX,
            tiles,
        }
    }

    /// Makes this empty film one of a part of the samples, those with these indices.
    pub fn set_share(&mut self, share: Range<u32>) {
        for tile in &mut self.tiles {
            *tile = FilmTile::new(tile.window(), self.aovs, share.start);
        }
        self.share = share;
    }

    /// Indices of the samples that it is to have; without end for the whole of a render.
    pub fn share(&self) -> Range<u32> {
        self.share.clone()
    }

    /// Width and height of the full image in pixels.
    pub fn resolution(&self) -> [u32; 2] {
        self.resolution
    }

    /// The part of the image that is rendered.
    pub fn window(&self) -> Window {
        self.window
    }

    /// The AOVs that are kept.
    pub fn aovs(&self) -> AovSet {
        self.aovs
    }

    /// The tiles, to be filled in any order, each by one thread at a time.
    pub fn tiles_mut(&mut self) -> &mut [FilmTile] {
        &mut self.tiles
    }

    /// The tiles.
    pub fn tiles(&self) -> &[FilmTile] {
        &self.tiles
    }

    /// The number of samples that every pixel has had at least.
    pub fn samples_per_pixel(&self) -> u32 {
        let least = |tile: &FilmTile| tile.taken().count();
        self.tiles.iter().map(least).min().unwrap_or(0)
    }

    /// The samples of a tile that has the fewest.
    pub fn common(&self) -> Taken {
        let fewest = self
            .tiles
            .iter()
            .map(FilmTile::taken)
            .min_by_key(|t| t.count());
        fewest.cloned().unwrap_or_default()
    }

    /// Adds the samples of other films of the same layout, the order of which does not
    /// matter.
    ///
    /// # Errors
    /// When a sample is in more than one: the positions of two films that overlap, the
    /// first of them 0 for this film. It is then of no use any more.
    ///
    /// # Panics
    /// When the layouts differ.
    pub fn merge(&mut self, others: &[Self]) -> Result<(), [usize; 2]> {
        self.share = 0..u32::MAX;
        for (position, tile) in self.tiles.iter_mut().enumerate() {
            let mut parts: Vec<(usize, &FilmTile)> = others
                .iter()
                .map(|film| {
                    assert_eq!((film.window, film.aovs), (self.window, self.aovs));
                    &film.tiles[position]
                })
                .zip(1..)
                .map(|(tile, film)| (film, tile))
                .collect();
            let own = tile.clone();
            parts.push((0, &own));
            parts.sort_by_key(|(_, tile)| tile.taken().ranges().first().map_or(0, |r| r.start));
            *tile = FilmTile::new(own.window(), self.aovs, own.next());
            let mut before = 0;
            for (film, part) in parts {
                let Some(union) = tile.taken().union(part.taken()) else {
                    return Err([before, film]);
                };
                tile.merge(part, union);
                before = film;
            }
        }
        Ok(())
    }

    /// Samples that were left out of the image because their values were
    /// impossible, by cause; empty when all is well.
    pub fn faults(&self) -> Vec<FaultCount> {
        let per_tile = |fault| {
            let of_tiles = self.tiles.iter().map(move |tile| tile.fault(fault));
            of_tiles.fold(FaultCount::new(fault), |mut sum, count| {
                sum.absorb(count);
                sum
            })
        };
        let counts = Fault::ALL.into_iter().map(per_tile);
        counts.filter(|count| count.samples > 0).collect()
    }

    /// Bytes that the accumulators take.
    pub fn bytes(&self) -> usize {
        self.tiles.iter().map(FilmTile::bytes).sum()
    }

    /// The image so far: sums divided by counts. Pixels without a sample are
    /// black.
    pub fn develop(&self) -> Image {
        let mut image = Image::black(self.resolution, self.window);
        image.layers = self
            .aovs
            .iter()
            .map(|aov| Layer::black(aov.row().layer, aov.row().channels, self.window.area()))
            .collect();
        for tile in &self.tiles {
            for pixel in tile.window().pixels() {
                let index = self.window.index(pixel);
                image.color[index] = tile.color(pixel).map(|c| c as f32);
                for (layer, aov) in image.layers.iter_mut().zip(self.aovs.iter()) {
                    let value = tile.aov(pixel, aov);
                    for (plane, value) in layer.planes.iter_mut().zip(value) {
                        plane[index] = value as f32;
                    }
                }
            }
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Adds a sample of the one pixel.
    fn add(film: &mut Film, paths: &[Sample]) -> bool {
        let tile = &mut film.tiles_mut()[0];
        let counted = tile.add([0, 0], paths);
        tile.advance();
        counted
    }

    #[test]
    fn tiles_cover_the_window_once() {
        let window = Window {
            x: 5,
            y: 3,
            width: 37,
            height: 20,
        };
        let mut film = Film::new([64, 64], window, AovSet::NONE);
        let mut hits = vec![0; window.area()];
        for tile in film.tiles_mut() {
            for pixel in tile.window().pixels() {
                hits[window.index(pixel)] += 1;
            }
        }
        assert!(hits.iter().all(|&count| count == 1));
    }

    #[test]
    #[should_panic(expected = "beyond the image")]
    fn a_window_outside_the_image_is_refused() {
        let window = Window {
            x: u32::MAX,
            y: 0,
            width: 2,
            height: 1,
        };
        Film::new([8, 8], window, AovSet::NONE);
    }

    /// Samples 1 and 3: mean 2, variance of one sample 2, of the mean 1.
    #[test]
    fn mean_and_variance_of_two_samples() {
        let aovs = AovSet::from_iter([Aov::Variance, Aov::Depth]);
        let mut film = Film::new([1, 1], Window::full([1, 1]), aovs);
        add(&mut film, &[Sample::of([1.0, 0.0, 5.0])]);
        add(&mut film, &[Sample::of([3.0, 0.0, 5.0])]);
        let image = film.develop();
        assert_eq!(image.color, [[2.0, 0.0, 5.0]]);
        let variance = image.layer("variance").unwrap();
        assert_eq!(variance.planes, [[1.0], [0.0], [0.0]]);
        let depth = image.layer("depth").unwrap();
        assert_eq!(depth.planes, [[1e10]], "nothing was hit");
    }

    #[test]
    fn aovs_are_averaged_and_depth_over_hits() {
        let aovs = Aov::ALL.into_iter().collect();
        let mut film = Film::new([1, 1], Window::full([1, 1]), aovs);
        let hit = Sample::of([1.0; 3])
            .with(Aov::Albedo, [0.5, 0.25, 1.0])
            .with(Aov::Normal, [0.0, -1.0, 0.0])
            .with(Aov::Depth, [3.0, f32::NAN, 0.0])
            .with(Aov::Single, [0.75; 3])
            .with(Aov::Multiple, [0.25; 3])
            .with(Aov::Alpha, [0.5; 3]);
        let mut one_sample = film.clone();
        add(&mut one_sample, &[hit, Sample::default()]);
        add(&mut film, &[hit]);
        add(&mut film, &[Sample::default()]);
        for film in [film, one_sample] {
            let image = film.develop();
            let layer = |name| image.layer(name).unwrap().planes.concat();
            assert_eq!(image.color, [[0.5; 3]]);
            assert_eq!(layer("albedo"), [0.25, 0.125, 0.5]);
            assert_eq!(layer("normal"), [0.0, -0.5, 0.0]);
            assert_eq!(layer("depth"), [3.0]);
            assert_eq!(layer("single"), [0.375; 3]);
            assert_eq!(layer("multiple"), [0.125; 3]);
        }
    }

    #[test]
    fn one_impossible_path_spoils_a_sample() {
        let mut film = Film::new([1, 1], Window::full([1, 1]), AovSet::NONE);
        let [three, one, negative] = [3.0, 1.0, -1.0].map(|value| Sample::of([value; 3]));
        assert!(!add(&mut film, &[three, negative]));
        assert!(add(&mut film, &[three, one]));
        assert_eq!(film.faults()[0].samples, 1);
        assert_eq!(film.develop().color, [[2.0; 3]]);
    }

    #[test]
    fn impossible_samples_are_counted_by_cause_and_left_out() {
        let mut film = Film::new([40, 40], Window::full([40, 40]), AovSet::NONE);
        for tile in film.tiles_mut() {
            for color in [
                [2.0; 3],
                [1.0, f32::NAN, -1.0],
                [f32::INFINITY, 1.0, 1.0],
                [0.0, -1e-9, 1.0],
                [-0.0, 4.0, 4.0],
            ] {
                for pixel in tile.window().pixels() {
                    let diagonal = pixel[0] == pixel[1];
                    tile.add(
                        pixel,
                        &[Sample::of(if diagonal { color } else { [2.0; 3] })],
                    );
                }
                tile.advance();
            }
        }
        let image = film.develop();
        assert_eq!(image.color[41], [1.0, 3.0, 3.0]);
        assert_eq!(image.color[1], [2.0; 3]);
        assert_eq!(film.samples_per_pixel(), 5);
        let faults = film.faults();
        let causes: Vec<_> = faults.iter().map(|f| (f.fault, f.samples)).collect();
        let expected = Fault::ALL.into_iter().take(3).map(|fault| (fault, 40));
        assert_eq!(causes, expected.collect::<Vec<_>>());
        assert_eq!(faults[0].pixels[..2], [[0, 0], [1, 1]]);
    }

    /// Same bits from one thread and from many, whichever tile comes first.
    #[test]
    fn sums_do_not_depend_on_the_order_of_tiles() {
        use rayon::prelude::*;
        let fill = |tile: &mut FilmTile| {
            for index in 0..8 {
                for pixel in tile.window().pixels() {
                    let mut sampler = crate::sampler::Sampler::new(0, pixel, index);
                    let u = sampler.get_4d(crate::sampler::Dimension::bsdf(0));
                    tile.add(pixel, &[Sample::of([u[0], u[1] * 1e6, u[2] * 1e-6])]);
                }
                tile.advance();
            }
        };
        let new = || Film::new([70, 50], Window::full([70, 50]), AovSet::NONE);
        let (mut serial, mut parallel) = (new(), new());
        serial.tiles_mut().iter_mut().rev().for_each(fill);
        parallel.tiles_mut().par_iter_mut().for_each(fill);
        assert!(serial == parallel);
    }

    #[test]
    fn only_requested_aovs_take_memory() {
        let bytes = |aovs| Film::new([64, 64], Window::full([64, 64]), aovs).bytes();
        let none = bytes(AovSet::NONE);
        assert_eq!(bytes(AovSet::from_iter([Aov::Variance])), none);
        let depth = bytes(AovSet::from_iter([Aov::Depth]));
        // Two sums of 17 bytes, and how often it was left out.
        assert_eq!(depth - none, 64 * 64 * (2 * 17 + 4));
    }
}
