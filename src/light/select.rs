//! Which light to sample.

use super::Receiver;
use super::tree::{Extent, LEAST_FACING, MOST, Tree, Weights};
use super::warp::BELOW_ONE;
use glam::Vec3;

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

/// The least probability of an entry of a table whose weight is not zero: a
/// few of the 2⁻²³ between two random numbers, and of the last digits of the
/// sums. Less would be rounded to nothing, or to twice as much.
const LEAST: f64 = 1.0 / (1 << 20) as f64;

/// Appends the normalised running sums of `weights` and returns their total;
/// `None`, with zeros appended, when they are all zero. Weights that are lost
/// beside the others are raised to where they have the probability [`LEAST`],
/// or, in a long table, a sixteenth of an even share.
pub(super) fn accumulate(
    weights: impl Iterator<Item = f64> + Clone,
    cumulative: &mut Vec<f32>,
) -> Option<f64> {
    let total: f64 = weights.clone().sum();
    if total <= 0.0 {
        cumulative.extend(weights.map(|_| 0.0));
        return None;
    }
    let count = weights.clone().filter(|&weight| weight > 0.0).count();
    let floor = total * LEAST.min(1.0 / 16.0 / count as f64);
    let raised = weights.map(|weight| if weight > 0.0 { weight.max(floor) } else { 0.0 });
    let raised_total: f64 = raised.clone().sum();
    let mut sum = 0.0;
    cumulative.extend(raised.map(|weight| {
        sum += weight;
        (sum / raised_total) as f32
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
    /// By estimates of many together.
    ByTree(Box<Many>),
}

impl Chooser {
    /// Chooses by `u` in [0, 1) for a shading point: the index, its probability
    /// and what is left of `u`. `None` when nothing contributes. `more` are
    /// independent numbers, the digits of which go behind those of `u` where
    /// these are too few. `contribution` gives the estimate for a candidate.
    pub(super) fn choose(
        &self,
        at: &Receiver,
        u: f32,
        more: [f32; 2],
        contribution: impl Fn(usize) -> f32,
    ) -> Option<(usize, f32, f32)> {
        match self {
            Self::Only => Some((0, 1.0, u)),
            Self::ByTree(many) => {
                let (index, probability) = many.choose(at, refined(u, more))?;
                Some((index, probability, 0.0))
            }
            Self::ByContribution(n) => {
                let mut sums = [0.0; FEW];
                let total = running_sums(&mut sums[..*n], contribution);
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

    /// The probability with which [`Chooser::choose`] takes `index` there.
    pub(super) fn probability(
        &self,
        at: &Receiver,
        index: usize,
        contribution: impl Fn(usize) -> f32,
    ) -> f32 {
        match self {
            Self::Only => 1.0,
            Self::ByTree(many) => many.probability(at, index),
            Self::ByContribution(n) => {
                // The same sums as in `choose`, rounding included.
                let mut sums = [0.0; FEW];
                let total = running_sums(&mut sums[..*n], contribution);
                if total > 0.0 {
                    probability(&sums, index) / total
                } else {
                    0.0
                }
            }
        }
    }

    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::ByTree(many) => many.bytes(),
            _ => 0,
        }
    }
}

/// The least estimate of a light that reaches the point, as a share of the
/// largest one: another light's may be in shadow, and a sum in f32 must not
/// lose it.
const LEAST_SHARE: f32 = 1.0 / (1 << 16) as f32;

/// Fills in the running sums of the candidates' estimates; returns their total.
fn running_sums(sums: &mut [f32], contribution: impl Fn(usize) -> f32) -> f32 {
    let mut largest = 0.0_f32;
    let mut least = f32::INFINITY;
    for (i, sum) in sums.iter_mut().enumerate() {
        // At a light itself the estimate is infinite, or 0/0.
        let estimate = contribution(i);
        *sum = if estimate < MOST { estimate } else { MOST };
        largest = largest.max(*sum);
        if *sum > 0.0 {
            least = least.min(*sum);
        }
    }
    let floor = largest * LEAST_SHARE;
    let mut total = 0.0;
    for sum in sums {
        if least < floor && *sum > 0.0 {
            *sum = sum.max(floor);
        }
        total += *sum;
        *sum = total;
    }
    total
}

/// How often one of many lights is chosen regardless of all estimates, so that
/// none of them can keep a light from being found.
const REGARDLESS: f64 = 1.0 / 64.0;

/// `u` with digits of `more` behind its own 23, so that a light of probability
/// 10⁻⁹ is found as often as that.
fn refined(u: f32, more: [f32; 2]) -> f64 {
    let [a, b] = more.map(|u| u64::from(u.to_bits()));
    // The finaliser of SplitMix64.
    let mut digits = (a << 32 | b).wrapping_add(0x9e37_79b9_7f4a_7c15);
    digits = (digits ^ (digits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    digits = (digits ^ (digits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    let behind = ((digits ^ (digits >> 31)) >> 35) as f64;
    (f64::from(u) + behind / (1_u64 << (23 + 29)) as f64).clamp(0.0, 1.0 - f64::EPSILON)
}

/// How a light counts among many.
#[derive(Clone, Copy, Debug)]
pub(super) enum Reach {
    /// From somewhere.
    Near(Extent),
    /// From infinitely far.
    Far(Far),
}

/// A light infinitely far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Far {
    /// The luminance of its irradiance, W·m⁻².
    pub(super) irradiance: f32,
    /// The direction of its middle and the sine of its radius; `None` if it
    /// is all round.
    pub(super) towards: Option<(Vec3, f32)>,
}

impl Far {
    /// The irradiance at a shading point, about.
    fn estimate(&self, at: &Receiver) -> f64 {
        let facing = match (self.towards, at.normal) {
            (Some((towards, sin_radius)), Some(normal)) => {
                (towards.dot(normal) + sin_radius).clamp(LEAST_FACING, 1.0)
            }
            _ => 1.0,
        };
        f64::from(self.irradiance.min(MOST) * facing)
    }
}

/// Lights by a tree of those that are somewhere, weighed at the shading point
/// against those that are infinitely far.
#[derive(Clone, Debug)]
pub(super) struct Many {
    tree: Option<Tree>,
    far: Vec<Far>,
    /// The candidates: those in the tree by their ranks there, then the far ones.
    indices: Vec<u32>,
    /// The place of each candidate in `indices`; [`NOWHERE`] for one that does
    /// not shine.
    places: Vec<u32>,
}

const NOWHERE: u32 = u32::MAX;

/// The estimates at a shading point.
struct Weighed<'a> {
    /// The tree and those of its root's children.
    tree: Option<(&'a Tree, Weights)>,
    near: f64,
    far: f64,
}

impl Weighed<'_> {
    fn share(&self, weight: f64) -> f64 {
        let total = self.near + self.far;
        if total > 0.0 { weight / total } else { 0.0 }
    }
}

impl Many {
    /// Of candidates; `None` when none shines.
    pub(super) fn new(candidates: impl Iterator<Item = Reach>) -> Option<Self> {
        let (mut extents, mut far) = (Vec::new(), Vec::new());
        let (mut near_indices, mut far_indices) = (Vec::new(), Vec::new());
        let mut count = 0;
        for (index, candidate) in (0..).zip(candidates) {
            count += 1;
            match candidate {
                Reach::Near(extent) if extent.intensity > 0.0 => {
                    near_indices.push(index);
                    extents.push(extent);
                }
                Reach::Far(light) if light.irradiance > 0.0 => {
                    far_indices.push(index);
                    far.push(light);
                }
                _ => {}
            }
        }
        let tree = Tree::new(&extents);
        let ranked = tree.iter().flat_map(Tree::numbers);
        let ranked = ranked.map(|&number| near_indices[number as usize]);
        let indices: Vec<u32> = ranked.chain(far_indices).collect();
        let mut places = vec![NOWHERE; count];
        for (place, &index) in (0..).zip(&indices) {
            places[index as usize] = place;
        }
        (!indices.is_empty()).then_some(Self {
            tree,
            far,
            indices,
            places,
        })
    }

    fn weighed(&self, at: &Receiver) -> Weighed<'_> {
        let tree = self.tree.as_ref().map(|tree| (tree, tree.root(at)));
        Weighed {
            near: tree.map_or(0.0, |(_, root)| root.total),
            far: self.far.iter().map(|light| light.estimate(at)).sum(),
            tree,
        }
    }

    /// The index of a candidate and its probability.
    fn choose(&self, at: &Receiver, u: f64) -> Option<(usize, f32)> {
        let regardless = u - (1.0 - REGARDLESS);
        if regardless >= 0.0 {
            let count = self.indices.len();
            let place = (regardless / REGARDLESS * count as f64) as usize;
            let index = self.indices[place.min(count - 1)] as usize;
            return Some((index, self.probability(at, index)));
        }
        let weighed = self.weighed(at);
        let place = u / (1.0 - REGARDLESS) * (weighed.near + weighed.far);
        let (place, estimated) = match weighed.tree {
            Some((tree, root)) if place < weighed.near => {
                let (rank, probability) = tree.choose(at, root, place / weighed.near)?;
                (rank as usize, weighed.share(weighed.near) * probability)
            }
            _ => {
                let mut left = place - weighed.near;
                let found = self.far.iter().position(|light| {
                    left -= light.estimate(at);
                    left < 0.0
                });
                // The sum may round otherwise than the differences.
                let found = found.unwrap_or(self.far.len().checked_sub(1)?);
                let estimated = weighed.share(self.far[found].estimate(at));
                (self.indices.len() - self.far.len() + found, estimated)
            }
        };
        Some((self.indices[place] as usize, self.mixed(estimated)))
    }

    fn probability(&self, at: &Receiver, index: usize) -> f32 {
        let place = self.places[index];
        if place == NOWHERE {
            return 0.0;
        }
        let weighed = self.weighed(at);
        let in_tree = self.indices.len() - self.far.len();
        let estimated = match weighed.tree {
            Some((tree, root)) if (place as usize) < in_tree => {
                weighed.share(weighed.near) * tree.probability(at, root, place)
            }
            _ => weighed.share(self.far[place as usize - in_tree].estimate(at)),
        };
        self.mixed(estimated)
    }

    /// The probability of a light, given that by estimates.
    fn mixed(&self, estimated: f64) -> f32 {
        ((1.0 - REGARDLESS) * estimated + REGARDLESS / self.indices.len() as f64) as f32
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.tree.as_ref().map_or(0, Tree::bytes)
            + size_of_val(self.far.as_slice())
            + size_of_val(self.indices.as_slice())
            + size_of_val(self.places.as_slice())
    }
}
