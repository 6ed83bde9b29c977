//! The accumulators of a tile of pixels.

use super::plan::{Draws, Pilot, Spread};
use super::{Aov, AovSet};
use crate::image::Window;

/// Pixel positions that are remembered per cause of a fault.
pub(super) const FAULT_PIXELS: usize = 8;

/// Depth where no sample met a surface, as in Blender, in metres.
const NO_DEPTH: f64 = 1e10;

/// What one camera path contributes. What was not asked for is not looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Radiance, W·sr⁻¹·m⁻², scene-linear Rec. 709.
    pub color: [f32; 3],
    /// [`Aov::Albedo`].
    pub albedo: [f32; 3],
    /// [`Aov::Normal`].
    pub normal: [f32; 3],
    /// [`Aov::Depth`], in metres; `None` when the ray met nothing.
    pub depth: Option<f32>,
    /// [`Aov::Single`], part of `color`.
    pub single: [f32; 3],
    /// [`Aov::Multiple`], part of `color`.
    pub multiple: [f32; 3],
}

/// Why a sample can't be averaged in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Its colour is not a number.
    NotANumber,
    /// Its colour is infinite.
    Infinite,
    /// Its colour is negative.
    Negative,
    /// An AOV is infinite or not a number. The colour counts, the AOV doesn't.
    Aov,
}

impl Fault {
    /// All causes.
    pub const ALL: [Self; 4] = [Self::NotANumber, Self::Infinite, Self::Negative, Self::Aov];

    /// What is wrong with a colour, if anything.
    fn of_color(color: [f32; 3]) -> Option<Self> {
        // One comparison passes the good ones: it fails for NaN.
        if color.iter().all(|&c| (0.0..=f32::MAX).contains(&c)) {
            None
        } else if color.iter().any(|c| c.is_nan()) {
            Some(Self::NotANumber)
        } else if color.iter().any(|c| c.is_infinite()) {
            Some(Self::Infinite)
        } else {
            Some(Self::Negative)
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotANumber => "not a number",
            Self::Infinite => "infinite",
            Self::Negative => "negative",
            Self::Aov => "an AOV that is infinite or not a number",
        })
    }
}

/// How often a fault came up, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultCount {
    /// The cause.
    pub fault: Fault,
    /// Number of samples.
    pub samples: u64,
    /// The first few pixels (column, row of the full image), row by row.
    pub pixels: Vec<[u32; 2]>,
}

impl FaultCount {
    pub(super) const fn new(fault: Fault) -> Self {
        Self {
            fault,
            samples: 0,
            pixels: Vec::new(),
        }
    }

    fn add(&mut self, pixel: [u32; 2]) {
        self.samples += 1;
        self.remember(pixel);
    }

    /// Keeps the topmost pixels, whatever the order in which they come: it
    /// changes when a render is interrupted.
    fn remember(&mut self, pixel: [u32; 2]) {
        let row_major = |&[x, y]: &[u32; 2]| [y, x];
        let place = self
            .pixels
            .binary_search_by_key(&row_major(&pixel), row_major);
        if let Err(place) = place {
            self.pixels.insert(place, pixel);
            self.pixels.truncate(FAULT_PIXELS);
        }
    }

    pub(super) fn merge(mut self, other: &Self) -> Self {
        self.samples += other.samples;
        other.pixels.iter().for_each(|&pixel| self.remember(pixel));
        self
    }
}

/// Sums over the samples of a pixel's colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ColorSum {
    pub sum: [f64; 3],
    pub squares: [f64; 3],
    /// The mean when the count last was a power of two.
    pub milestone: [f32; 3],
    /// How far the mean had moved by then, since the power of two before.
    pub moved: [f32; 3],
    /// Samples averaged in.
    pub count: u32,
    /// Samples left out for a [`Fault`] of their colour.
    pub left_out: u32,
    /// See [`FilmTile::draws`].
    pub draws: Draws,
}

/// A rectangle of pixels and their accumulators, in f64.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmTile {
    window: Window,
    /// Per pixel, row by row.
    pub(super) colors: Vec<ColorSum>,
    /// Per pixel, and there per stored AOV: the sum of each channel, and the
    /// number of samples in it, of which a path can be a part.
    pub(super) sums: Vec<f64>,
    /// The AOVs in `sums`, and where each begins within a pixel.
    offsets: Vec<(Aov, usize)>,
    /// Length of a pixel in `sums`.
    stride: usize,
    /// In the order of [`Fault::ALL`].
    pub(super) faults: [FaultCount; 4],
    /// Per pixel, what [`super::Film::plan`] goes by; empty when there is none.
    pub(super) pilots: Vec<Pilot>,
}

impl FilmTile {
    pub(super) fn new(window: Window, aovs: AovSet) -> Self {
        let mut stride = 0;
        let mut offsets = Vec::new();
        // The variance needs no sums but those of the colour.
        for aov in aovs.iter().filter(|&aov| aov != Aov::Variance) {
            offsets.push((aov, stride));
            stride += aov.channels().len() + 1;
        }
        Self {
            window,
            colors: vec![ColorSum::default(); window.area()],
            sums: vec![0.0; stride * window.area()],
            offsets,
            stride,
            faults: Fault::ALL.map(FaultCount::new),
            pilots: Vec::new(),
        }
    }

    /// The pixels of this tile.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Adds a sample of `pixel` (column, row of the full image), the mean of these
    /// camera paths, or counts it as a [`Fault`]; false when its colour was left out
    /// for that.
    pub fn add(&mut self, pixel: [u32; 2], paths: &[Sample]) -> bool {
        let index = self.window.index(pixel);
        let share = 1.0 / paths.len() as f32;
        let mut mean = [0.0; 3];
        for path in paths {
            for (mean, value) in mean.iter_mut().zip(path.color) {
                *mean += share * value;
            }
        }
        let color = &mut self.colors[index];
        // One path can hide in the mean: black takes a negative one up.
        let colors = paths.iter().map(|path| path.color);
        if let Some(fault) = colors.chain([mean]).find_map(Fault::of_color) {
            color.left_out += 1;
            self.faults[fault as usize].add(pixel);
            return false;
        }
        color.count += 1;
        for (channel, value) in mean.into_iter().enumerate() {
            let value = f64::from(value);
            color.sum[channel] += value;
            color.squares[channel] += value * value;
        }
        if color.count.is_power_of_two() {
            for channel in 0..3 {
                let mean = (color.sum[channel] / f64::from(color.count)) as f32;
                color.moved[channel] = mean - color.milestone[channel];
                color.milestone[channel] = mean;
            }
        }
        if self.stride > 0 {
            let mut broken = false;
            for path in paths {
                broken |= !self.add_aovs(index, path, f64::from(share));
            }
            if broken {
                self.faults[Fault::Aov as usize].add(pixel);
            }
        }
        true
    }

    /// Adds this share of a sample; false when one of its AOVs had to be left out.
    fn add_aovs(&mut self, index: usize, path: &Sample, share: f64) -> bool {
        let sums = &mut self.sums[index * self.stride..][..self.stride];
        let mut broken = false;
        for &(aov, offset) in &self.offsets {
            let depth = path.depth.map(|depth| [depth]);
            let values: &[f32] = match aov {
                Aov::Albedo => &path.albedo,
                Aov::Normal => &path.normal,
                Aov::Depth => match &depth {
                    Some(depth) => depth,
                    None => continue,
                },
                Aov::Single => &path.single,
                Aov::Multiple => &path.multiple,
                Aov::Variance => unreachable!("the variance is not stored"),
            };
            if !values.iter().all(|value| value.is_finite()) {
                broken = true;
                continue;
            }
            for (sum, &value) in sums[offset..].iter_mut().zip(values) {
                *sum += share * f64::from(value);
            }
            sums[offset + values.len()] += share;
        }
        !broken
    }

    /// Number of samples of `pixel` so far, with those left out: the index of
    /// its next sample.
    pub fn samples(&self, pixel: [u32; 2]) -> u32 {
        let color = &self.colors[self.window.index(pixel)];
        color.count + color.left_out
    }

    pub(super) fn samples_per_pixel(&self) -> u32 {
        let taken = self.colors.iter().map(|c| c.count + c.left_out);
        taken.min().unwrap_or(0)
    }

    /// Mean radiance of `pixel`; black without a sample.
    pub fn color(&self, pixel: [u32; 2]) -> [f64; 3] {
        let color = &self.colors[self.window.index(pixel)];
        color.sum.map(|sum| sum / f64::from(color.count.max(1)))
    }

    /// Estimated variance of [`Self::color`], in its unit squared:
    /// (Σx² − (Σx)²/n) / (n (n − 1)), as for independent samples. Stratified
    /// samples vary less than that, so it errs on the large side. Zero with
    /// fewer than two samples.
    pub fn variance(&self, pixel: [u32; 2]) -> [f64; 3] {
        let color = &self.colors[self.window.index(pixel)];
        let n = f64::from(color.count);
        if color.count < 2 {
            return [0.0; 3];
        }
        [0, 1, 2].map(|channel| {
            let sum = color.sum[channel];
            let deviations = color.squares[channel] - sum * sum / n;
            deviations.max(0.0) / (n * (n - 1.0))
        })
    }

    /// How the paths of `pixel` split; none at all as long as
    /// [`super::Film::plan`] has not decided.
    pub fn draws(&self, pixel: [u32; 2]) -> Draws {
        self.colors[self.window.index(pixel)].draws
    }

    pub(super) fn set_draws(&mut self, pixel: [u32; 2], draws: Draws) {
        self.colors[self.window.index(pixel)].draws = draws;
    }

    /// Takes note of how the parts of a sample of `pixel` differ.
    pub fn add_pilot(&mut self, pixel: [u32; 2], light_samples: Spread, branches: Spread) {
        self.pilots.resize(self.window.area(), Pilot::default());
        let pilot = &mut self.pilots[self.window.index(pixel)];
        pilot.light_samples += light_samples;
        pilot.branches += branches;
    }

    /// Forgets the samples of `pixel` and how they differ; faults found in them stay
    /// counted.
    pub fn clear(&mut self, pixel: [u32; 2]) {
        let index = self.window.index(pixel);
        let draws = self.colors[index].draws;
        self.colors[index] = ColorSum {
            draws,
            ..ColorSum::default()
        };
        self.sums[index * self.stride..][..self.stride].fill(0.0);
        if let Some(pilot) = self.pilots.get_mut(index) {
            *pilot = Pilot::default();
        }
    }

    /// An estimate of the variance of [`Self::color`] that is far too uncertain
    /// for a single pixel, but sees what stratification gains: the squared
    /// distance that the mean moved when the number of samples n₂ last doubled.
    /// With the means m₁, m₂ of both halves that is (m₁ − m₂)²/4; if it were not
    /// for the strata that the halves share, its expectation would be the
    /// variance of (m₁ + m₂)/2. Samples since then are taken to reduce it by
    /// n₂/n. Useless with fewer than two samples.
    pub(super) fn doubling_variance(&self, pixel: [u32; 2]) -> [f64; 3] {
        let color = &self.colors[self.window.index(pixel)];
        let doubled = color.count.checked_ilog2().map_or(0, |log2| 1 << log2);
        let share = f64::from(doubled) / f64::from(color.count);
        color.moved.map(|moved| share * f64::from(moved).powi(2))
    }

    /// The channels of `aov` in `pixel`.
    ///
    /// # Panics
    /// If the film was made without that AOV.
    pub(super) fn aov(&self, pixel: [u32; 2], aov: Aov) -> Vec<f64> {
        if aov == Aov::Variance {
            return self.variance(pixel).to_vec();
        }
        let stored = self.offsets.iter().find(|(stored, _)| *stored == aov);
        let &(_, offset) = stored.expect("an AOV that the film keeps");
        let channels = aov.channels().len();
        let sums = &self.sums[self.window.index(pixel) * self.stride + offset..];
        let count = sums[channels];
        if aov == Aov::Depth && count == 0.0 {
            return vec![NO_DEPTH];
        }
        sums[..channels]
            .iter()
            .map(|sum| if count > 0.0 { sum / count } else { 0.0 })
            .collect()
    }

    pub(super) fn fault(&self, fault: Fault) -> &FaultCount {
        &self.faults[fault as usize]
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.colors.as_slice()) + size_of_val(self.sums.as_slice())
    }
}
