//! Which light to sample.

use super::warp::BELOW_ONE;

/// Up to this many candidates are compared at every shading point.
pub(super) const FEW: usize = 32;

/// A table of probabilities, sampled by inversion.
#[derive(Clone, Debug)]
pub(super) struct Table {
    cumulative: Vec<f32>,
    guide: Vec<u32>,
}

impl Table {
    /// In proportion to `weights`, finite and not negative; `None` when all
    /// are zero.
    pub(super) fn new(weights: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let mut cumulative = Vec::with_capacity(weights.size_hint().0);
        accumulate(weights, &mut cumulative)?;
        let mut guide = Vec::new();
        guide_through(&cumulative, &mut guide);
        Some(Self { cumulative, guide })
    }

    /// As [`sample`].
    pub(super) fn sample(&self, u: f32) -> (usize, f32, f32) {
        sample(&self.cumulative, &self.guide, u)
    }

    /// As [`probability`].
    pub(super) fn probability(&self, index: usize) -> f32 {
        probability(&self.cumulative, index)
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.cumulative.as_slice()) + size_of_val(self.guide.as_slice())
    }
}

/// How many numbers [`guide_through`] appends for sums of this length: a power
/// of two, so that scaling by it is exact, and about one for eight sums, which
/// share a cache line or two.
pub(super) fn guide_length(sums: usize) -> usize {
    (sums / 8).next_power_of_two()
}

/// Appends where to start to look: in place k, how many of the sums are at
/// most k over the guide's length (Chen and Asau 1974, the guide table method).
pub(super) fn guide_through(cumulative: &[f32], guide: &mut Vec<u32>) {
    let length = guide_length(cumulative.len());
    let mut index = 0;
    guide.extend((0..length).map(|k| {
        let start = k as f32 / length as f32;
        while index < cumulative.len() && cumulative[index] <= start {
            index += 1;
        }
        index as u32
    }));
}

/// Appends the normalised running sums of `weights` and returns their total;
/// `None`, with zeros appended, when they are all zero.
pub(super) fn accumulate(
    weights: impl Iterator<Item = f64> + Clone,
    cumulative: &mut Vec<f32>,
) -> Option<f64> {
    let total: f64 = weights.clone().sum();
    if total <= 0.0 {
        cumulative.extend(weights.map(|_| 0.0));
        return None;
    }
    let mut sum = 0.0;
    cumulative.extend(weights.map(|weight| {
        sum += weight;
        (sum / total) as f32
    }));
    Some(total)
}

/// Finds the entry that `u` falls into: its index, its probability (not zero)
/// and where in it `u` lies, 0 to 1.
pub(super) fn sample(cumulative: &[f32], guide: &[u32], u: f32) -> (usize, f32, f32) {
    let u = u.clamp(0.0, BELOW_ONE);
    let k = (u * guide.len() as f32) as usize;
    let low = guide[k] as usize;
    let high = guide.get(k + 1).map_or(cumulative.len(), |&i| i as usize);
    let index = low + cumulative[low..high].partition_point(|&sum| sum <= u);
    let index = index.min(cumulative.len() - 1);
    let probability = probability(cumulative, index);
    let below = match index {
        0 => 0.0,
        _ => cumulative[index - 1],
    };
    let rest = (u - below) / probability;
    (index, probability, rest.clamp(0.0, BELOW_ONE))
}

/// The probability of an entry: what [`sample`] really does, rounding included.
pub(super) fn probability(cumulative: &[f32], index: usize) -> f32 {
    match index {
        0 => cumulative[0],
        _ => cumulative[index] - cumulative[index - 1],
    }
}

/// How one of several lights is chosen.
#[derive(Clone, Debug)]
pub(super) enum Chooser {
    /// There is one.
    Only,
    /// By the estimated contribution at the shading point.
    ByContribution(usize),
    /// By power, for the many.
    ByPower(Table),
}

impl Chooser {
    /// Among lights of these powers; `None` when there is none.
    pub(super) fn new(powers: &[f32]) -> Option<Self> {
        match powers.len() {
            0 => None,
            1 => Some(Self::Only),
            n if n <= FEW => Some(Self::ByContribution(n)),
            _ => Table::new(powers.iter().map(|&power| power.min(MOST).into())).map(Self::ByPower),
        }
    }

    /// Chooses by `u`: the index, its probability and what is left of `u`.
    /// `None` when nothing contributes. `contribution` gives the estimate for
    /// a candidate.
    pub(super) fn choose(
        &self,
        u: f32,
        contribution: impl Fn(usize) -> f32,
    ) -> Option<(usize, f32, f32)> {
        match self {
            Self::Only => Some((0, 1.0, u)),
            Self::ByPower(table) => Some(table.sample(u)),
            Self::ByContribution(n) => {
                let mut sums = [0.0; FEW];
                let mut total = 0.0;
                for (i, sum) in sums[..*n].iter_mut().enumerate() {
                    total += bounded(contribution(i));
                    *sum = total;
                }
                if total <= 0.0 {
                    return None;
                }
                let at = u.clamp(0.0, BELOW_ONE) * total;
                let index = sums[..*n]
                    .iter()
                    .position(|&sum| sum > at)
                    // u·total may round up to the total: the last that counts.
                    .or_else(|| sums[..*n].iter().position(|&sum| sum == total))?;
                let below = if index == 0 { 0.0 } else { sums[index - 1] };
                let weight = sums[index] - below;
                let rest = ((at - below) / weight).clamp(0.0, BELOW_ONE);
                Some((index, weight / total, rest))
            }
        }
    }

    /// The probability with which [`Chooser::choose`] takes `index`.
    pub(super) fn probability(&self, index: usize, contribution: impl Fn(usize) -> f32) -> f32 {
        match self {
            Self::Only => 1.0,
            Self::ByPower(table) => table.probability(index),
            Self::ByContribution(n) => {
                // The same sums as in `choose`, rounding included.
                let (mut below, mut weight, mut total) = (0.0, 0.0, 0.0_f32);
                for i in 0..*n {
                    if i == index {
                        below = total;
                    }
                    total += bounded(contribution(i));
                    if i == index {
                        weight = total - below;
                    }
                }
                if total > 0.0 { weight / total } else { 0.0 }
            }
        }
    }

    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::ByPower(table) => table.bytes(),
            _ => 0,
        }
    }
}

/// No estimate is above this, so that sums stay finite.
const MOST: f32 = 1e30;

/// At a light itself the estimate is infinite, or 0/0.
fn bounded(contribution: f32) -> f32 {
    if contribution < MOST {
        contribution
    } else {
        MOST
    }
}
