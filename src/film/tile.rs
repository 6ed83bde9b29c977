//! The accumulators of a tile of pixels.

use super::aov::Accumulation;
use super::exact::ExactSums;
use super::{Aov, AovSet, Taken};
use crate::image::Window;

/// Pixel positions that are remembered per cause of a fault.
pub(super) const FAULT_PIXELS: usize = 8;

/// What one camera path contributes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Radiance, W·sr⁻¹·m⁻², scene-linear Rec. 709.
    pub color: [f32; 3],
    aovs: [Option<[f32; 3]>; Aov::COUNT],
}

impl Sample {
    /// Of this radiance, W·sr⁻¹·m⁻², without AOVs.
    #[must_use]
    pub fn of(color: [f32; 3]) -> Self {
        Self {
            color,
            ..Self::default()
        }
    }

    /// With a value of an AOV; further ones than it has channels are not looked at.
    #[must_use]
    pub fn with(mut self, aov: Aov, value: [f32; 3]) -> Self {
        self.aovs[aov as usize] = Some(value);
        self
    }
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

    /// Adds what another has counted.
    pub(super) fn absorb(&mut self, other: &Self) {
        self.samples += other.samples;
        other.pixels.iter().for_each(|&pixel| self.remember(pixel));
    }
}

/// Channels of the colour, and of its squares.
const COLOR_SUMS: usize = 6;

/// An AOV that a film keeps sums of.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stored {
    aov: Aov,
    /// Where its channels are among a pixel's sums.
    offset: usize,
    channels: usize,
    /// Whether the sum of the shares of samples that have a value follows.
    weighed: bool,
}

/// A rectangle of pixels and their accumulators.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmTile {
    window: Window,
    /// The samples that all pixels have had, those left out among them.
    pub(super) taken: Taken,
    /// Index of the first sample of this film.
    first: u32,
    /// Per pixel, row by row: colour, squares of the colour, and the AOVs of `stored`.
    pub(super) sums: ExactSums,
    stored: Vec<Stored>,
    /// Number of sums of a pixel.
    stride: usize,
    /// Per pixel, with Q the largest power of two that sample indices have reached:
    /// the colour's sums over its samples below Q/2 and from there to Q.
    pub(super) halves: Vec<[[f32; 3]; 2]>,
    /// Per pixel, samples left out for a [`Fault`] of their colour.
    pub(super) left_out: Vec<u32>,
    /// Per pixel, samples whose AOVs alone were left out; empty without AOVs.
    pub(super) aovs_left_out: Vec<u32>,
    /// In the order of [`Fault::ALL`].
    pub(super) faults: [FaultCount; 4],
}

impl FilmTile {
    pub(super) fn new(window: Window, aovs: AovSet, first: u32) -> Self {
        let mut stride = COLOR_SUMS;
        let mut stored = Vec::new();
        for aov in aovs.iter() {
            let row = aov.row();
            let weighed = match row.accumulation {
                Accumulation::Mean => false,
                Accumulation::MeanOfHits(_) => true,
                Accumulation::OfColor => continue,
            };
            let channels = row.channels.len();
            stored.push(Stored {
                aov,
                offset: stride,
                channels,
                weighed,
            });
            stride += channels + usize::from(weighed);
        }
        let area = window.area();
        Self {
            window,
            taken: Taken::default(),
            first,
            sums: ExactSums::new(stride * area),
            halves: vec![[[0.0; 3]; 2]; area],
            left_out: vec![0; area],
            aovs_left_out: vec![0; if stored.is_empty() { 0 } else { area }],
            stored,
            stride,
            faults: Fault::ALL.map(FaultCount::new),
        }
    }

    /// The pixels of this tile.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Which samples all pixels have.
    pub fn taken(&self) -> &Taken {
        &self.taken
    }

    /// The index of the next sample.
    pub fn next(&self) -> u32 {
        self.taken.end().max(self.first)
    }

    /// Adds sample [`Self::next`] of `pixel` (column, row of the full image), the mean
    /// of these camera paths, or counts it as a [`Fault`]; false when its colour was
    /// left out for that. When all pixels have had theirs, [`Self::advance`] follows.
    pub fn add(&mut self, pixel: [u32; 2], paths: &[Sample]) -> bool {
        let index = self.window.index(pixel);
        let share = 1.0 / paths.len() as f32;
        let mut mean = [0.0; 3];
        for path in paths {
            for (mean, value) in mean.iter_mut().zip(path.color) {
                *mean += share * value;
            }
        }
        // One path can hide in the mean: black takes a negative one up.
        let colors = paths.iter().map(|path| path.color);
        if let Some(fault) = colors.chain([mean]).find_map(Fault::of_color) {
            self.left_out[index] += 1;
            self.faults[fault as usize].add(pixel);
            return false;
        }
        let first = index * self.stride;
        for (channel, value) in mean.into_iter().enumerate() {
            let value = f64::from(value);
            self.sums.add(first + channel, value);
            self.sums.add(first + 3 + channel, value * value);
        }
        if !self.stored.is_empty() {
            self.add_aovs(index, pixel, paths, share);
        }
        true
    }

    /// Adds the AOVs of a sample, or none of them when one is impossible.
    fn add_aovs(&mut self, index: usize, pixel: [u32; 2], paths: &[Sample], share: f32) {
        let finite = |stored: &Stored| {
            let values = paths
                .iter()
                .filter_map(|path| path.aovs[stored.aov as usize]);
            values
                .flat_map(|value| value.into_iter().take(stored.channels))
                .all(f32::is_finite)
        };
        if !self.stored.iter().all(finite) {
            self.aovs_left_out[index] += 1;
            self.faults[Fault::Aov as usize].add(pixel);
            return;
        }
        let first = index * self.stride;
        for stored in &self.stored {
            let mut mean = [0.0; 3];
            let mut weight = 0.0;
            for value in paths
                .iter()
                .filter_map(|path| path.aovs[stored.aov as usize])
            {
                weight += share;
                for (mean, value) in mean.iter_mut().zip(value) {
                    *mean += share * value;
                }
            }
            let offset = first + stored.offset;
            for (channel, &value) in mean.iter().take(stored.channels).enumerate() {
                self.sums.add(offset + channel, value.into());
            }
            if stored.weighed {
                self.sums.add(offset + stored.channels, weight.into());
            }
        }
    }

    /// All pixels have had sample [`Self::next`].
    pub fn advance(&mut self) {
        let next = self.next();
        self.taken.push(next);
        if (next + 1).is_power_of_two() {
            self.mark_half();
        }
    }

    /// Sample indices have reached a power of two: it takes the place of Q.
    fn mark_half(&mut self) {
        for (index, [early, late]) in self.halves.iter_mut().enumerate() {
            for channel in 0..3 {
                let total = self.sums.get(index * self.stride + channel);
                early[channel] += late[channel];
                late[channel] = (total - f64::from(early[channel])) as f32;
            }
        }
    }

    fn count_at(&self, index: usize) -> u32 {
        self.taken.count() - self.left_out[index]
    }

    /// Number of samples of `pixel` that were averaged in.
    pub fn count(&self, pixel: [u32; 2]) -> u32 {
        self.count_at(self.window.index(pixel))
    }

    /// Mean radiance of `pixel`; black without a sample.
    pub fn color(&self, pixel: [u32; 2]) -> [f64; 3] {
        let index = self.window.index(pixel);
        let n = f64::from(self.count_at(index).max(1));
        [0, 1, 2].map(|channel| self.sums.get(index * self.stride + channel) / n)
    }

    /// Estimated variance of [`Self::color`], in its unit squared:
    /// (Σx² − (Σx)²/n) / (n (n − 1)), as for independent samples. Stratified
    /// samples vary less than that, so it errs on the large side. Zero with
    /// fewer than two samples.
    pub fn variance(&self, pixel: [u32; 2]) -> [f64; 3] {
        let index = self.window.index(pixel);
        let count = self.count_at(index);
        let n = f64::from(count);
        if count < 2 {
            return [0.0; 3];
        }
        [0, 1, 2].map(|channel| {
            let sum = self.sums.get(index * self.stride + channel);
            let squares = self.sums.get(index * self.stride + 3 + channel);
            (squares - sum * sum / n).max(0.0) / (n * (n - 1.0))
        })
    }

    /// An estimate of the variance of [`Self::color`] that is far too uncertain
    /// for a single pixel, but sees what stratification gains: from the squared
    /// distance of the means m₁, m₂ over the first n₁ samples and the next n₂, the
    /// halves up to a power of two of the sample index, v = (m₁ − m₂)²/(1/n₁ + 1/n₂)
    /// for one sample, and v/n for n. If it were not for the strata that the halves
    /// share, its expectation would be right. `None` while a half has no sample.
    pub(super) fn halves_variance(&self, pixel: [u32; 2]) -> Option<[f64; 3]> {
        let index = self.window.index(pixel);
        let whole = self.taken.end().checked_ilog2().map_or(0, |log2| 1 << log2);
        let first = self.taken.count_below(whole / 2);
        let second = self.taken.count_below(whole) - first;
        if first == 0 || second == 0 {
            return None;
        }
        // Samples left out are taken to be as frequent in both halves.
        let n = f64::from(self.count_at(index));
        let kept = n / f64::from(self.taken.count());
        let [n1, n2] = [first, second].map(|count| f64::from(count) * kept);
        let [early, late] = self.halves[index];
        Some([0, 1, 2].map(|channel| {
            let [m1, m2] = [
                f64::from(early[channel]) / n1,
                f64::from(late[channel]) / n2,
            ];
            (m1 - m2).powi(2) / (1.0 / n1 + 1.0 / n2) / n
        }))
    }

    /// The channels of `aov` in `pixel`.
    ///
    /// # Panics
    /// If the film was made without that AOV.
    pub(super) fn aov(&self, pixel: [u32; 2], aov: Aov) -> Vec<f64> {
        let empty = match aov.row().accumulation {
            Accumulation::OfColor => return self.variance(pixel).to_vec(),
            Accumulation::Mean => 0.0,
            Accumulation::MeanOfHits(empty) => empty,
        };
        let stored = self.stored.iter().find(|stored| stored.aov == aov);
        let stored = stored.expect("an AOV that the film keeps");
        let index = self.window.index(pixel);
        let offset = index * self.stride + stored.offset;
        let weight = if stored.weighed {
            self.sums.get(offset + stored.channels)
        } else {
            f64::from(self.count_at(index) - self.aovs_left_out[index])
        };
        let mean = |channel| {
            if weight > 0.0 {
                self.sums.get(offset + channel) / weight
            } else {
                empty
            }
        };
        (0..stored.channels).map(mean).collect()
    }

    /// Adds the samples of a tile of the same pixels, which has none that this one has.
    /// In the order of their indices, so that the halves have the same bits.
    pub(super) fn merge(&mut self, other: &Self, taken: Taken) {
        let before = |end: u32| end.checked_ilog2().map_or(0, |log2| 1_u32 << log2);
        let whole = before(taken.end());
        // What `tile` has below half of the new Q, and from there to Q.
        let halves = |tile: &Self, index: usize| {
            let [early, late] = tile.halves[index];
            let own = before(tile.taken.end());
            let (below, end) = (whole / 2, tile.taken.end());
            let total = |channel| tile.sums.get(index * tile.stride + channel) as f32;
            [0, 1, 2].map(|channel| {
                let (early, late) = (early[channel], late[channel]);
                match () {
                    () if end <= below => [total(channel), 0.0],
                    () if own == whole => [early, late],
                    // From `own` = Q/2 on, all below Q.
                    () => [early + late, total(channel) - early - late],
                }
            })
        };
        for index in 0..self.halves.len() {
            let [mine, others] = [halves(self, index), halves(other, index)];
            for channel in 0..3 {
                for half in 0..2 {
                    self.halves[index][half][channel] = mine[channel][half] + others[channel][half];
                }
            }
        }
        self.sums.merge(&other.sums);
        let counts = [
            (&mut self.left_out, &other.left_out),
            (&mut self.aovs_left_out, &other.aovs_left_out),
        ];
        for (counts, others) in counts {
            for (count, other) in counts.iter_mut().zip(others) {
                *count += other;
            }
        }
        for (fault, other) in self.faults.iter_mut().zip(&other.faults) {
            fault.absorb(other);
        }
        self.taken = taken;
        self.first = self.first.min(other.first);
    }

    /// Whether the sums can be those of so many samples, when they come from a file.
    pub(super) fn is_possible(&self) -> bool {
        let count = self.taken.count();
        let halves = self.halves.as_flattened().as_flattened();
        let counts = self.left_out.iter().zip(
            self.aovs_left_out
                .iter()
                .copied()
                .chain(std::iter::repeat(0)),
        );
        // Means of single-precision numbers are such numbers; counts come first, which
        // means are taken by.
        let mut colors = self.window.pixels().flat_map(|pixel| self.color(pixel));
        halves.iter().all(|half| half.is_finite())
            && counts
                .into_iter()
                .all(|(&left_out, aovs)| left_out.checked_add(aovs).is_some_and(|sum| sum <= count))
            && colors.all(|color| (color as f32).is_finite())
    }

    pub(super) fn fault(&self, fault: Fault) -> &FaultCount {
        &self.faults[fault as usize]
    }

    pub(super) fn bytes(&self) -> usize {
        self.sums.bytes()
            + size_of_val(self.halves.as_slice())
            + size_of_val(self.left_out.as_slice())
            + size_of_val(self.aovs_left_out.as_slice())
    }
}
