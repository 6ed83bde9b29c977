//! Random numbers of a path: Owen-scrambled Sobol points for the choices that
//! every path makes, and a PCG stream behind them for walks of unknown length.
//!
//! Every number has an address, a [`Dimension`]. Who leaves out a feature
//! skips its addresses and shifts nobody else's, so an integrator specialised
//! to a scene draws exactly what the general one does.
//!
//! Dimensions come in sets of four, stratified jointly. Each set is the first
//! four dimensions of Sobol's sequence under a scramble of its own ("padding",
//! Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4), section 5).
//! The first dimensions have the best two-dimensional projections at the low
//! sample counts of a pixel, and a path may be as long as it likes.

mod lanes;
mod sobol;
mod walk;

pub use lanes::LaneStream;
pub use walk::WalkStream;

use sobol::{LOG2_SEQUENCE, sobol_4d};

/// Sets of dimensions that belong to the camera: film and lens, time, pilots. A set that
/// nobody draws from costs nothing, so there are some for what is to come: whoever needs
/// one shifts no other number and changes no image that does without.
const CAMERA_SETS: u32 = 16;
/// Sets of dimensions that belong to each path vertex: light and closure, BSDF,
/// roulette, the walk of a light connection, choices among layers, the descent of a
/// light tree, the way through a medium, the way of a light connection through one. The
/// same holds for the rest.
const VERTEX_SETS: u32 = 64;

/// The address of a random number within a sample.
///
/// `bounce` counts path vertices: 0 is where the camera ray lands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimension {
    /// Which four jointly stratified numbers.
    set: u32,
    /// The first of them that is meant.
    lane: usize,
}

impl Dimension {
    const fn vertex(bounce: u32, set: u32, lane: usize) -> Self {
        Self {
            set: CAMERA_SETS + bounce * VERTEX_SETS + set,
            lane,
        }
    }

    /// Position within the pixel filter, two numbers.
    pub const fn camera_pixel() -> Self {
        Self { set: 0, lane: 0 }
    }

    /// Position on the lens, two numbers.
    pub const fn lens() -> Self {
        Self { set: 0, lane: 2 }
    }

    /// The moment between opening and closing of the shutter, one number.
    pub const fn time() -> Self {
        Self { set: 1, lane: 0 }
    }

    /// Which pixel of its cell a pilot path goes through, two numbers.
    pub const fn pilot_pixel() -> Self {
        Self { set: 2, lane: 0 }
    }

    /// Which light to connect to, one number.
    pub const fn light_choice(bounce: u32) -> Self {
        Self::vertex(bounce, 0, 0)
    }

    /// Where on that light, two numbers.
    pub const fn light_position(bounce: u32) -> Self {
        Self::vertex(bounce, 0, 1)
    }

    /// Which closure of a mix to sample, one number.
    pub const fn closure_choice(bounce: u32) -> Self {
        Self::vertex(bounce, 0, 3)
    }

    /// Direction to leave in, four numbers. They are also the leading numbers
    /// of the [`Purpose::Sample`] walk of that vertex: a closure either has a
    /// closed-form sampler or walks.
    pub const fn bsdf(bounce: u32) -> Self {
        Self::vertex(bounce, 1, 0)
    }

    /// Whether the path goes on, one number.
    pub const fn roulette(bounce: u32) -> Self {
        Self::vertex(bounce, 2, 0)
    }

    /// Choices among the closures of a surface beyond [`Self::closure_choice`], four
    /// numbers.
    pub const fn layers(bounce: u32) -> Self {
        Self::vertex(bounce, 4, 0)
    }

    /// Choices on the way down a light tree, four numbers.
    pub const fn light_tree(bounce: u32) -> Self {
        Self::vertex(bounce, 5, 0)
    }

    /// The way through a medium behind the vertex: distance, channel, direction, four
    /// numbers.
    pub const fn medium(bounce: u32) -> Self {
        Self::vertex(bounce, 6, 0)
    }

    /// The way of a light connection through media, four numbers.
    pub const fn medium_light(bounce: u32) -> Self {
        Self::vertex(bounce, 7, 0)
    }
}

/// What a microsurface walk at a path vertex is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Sampling the direction in which the path goes on.
    Sample,
    /// Evaluating the BSDF towards a light.
    Light,
}

impl Purpose {
    /// The numbers of its walks at vertex `bounce`.
    const fn set(self, bounce: u32) -> u32 {
        match self {
            Self::Sample => Dimension::bsdf(bounce).set,
            Self::Light => Dimension::vertex(bounce, 3, 0).set,
        }
    }
}

/// The random numbers of one sample of one pixel.
///
/// All numbers are in [0, 1) and depend on the seed, the pixel, the sample and
/// the dimension, and on nothing else: neither the order nor the number of
/// requests matters.
#[derive(Clone, Debug)]
pub struct Sampler {
    /// Hash of seed and pixel.
    pixel_key: u64,
    /// The same, with the number of the sequence when there is a second one.
    key: u64,
    /// Index into the Sobol sequence.
    index: u32,
    /// The set evaluated last. Neighbouring requests share one: evaluating four
    /// dimensions costs as much as one.
    last: Set,
    /// The set of a closure's sampler, where [`Self::begin_vertex`] has evaluated it.
    ahead: Set,
}

/// Four numbers that are stratified jointly.
#[derive(Clone, Copy, Debug)]
struct Set {
    /// Which; `u32::MAX` for none.
    number: u32,
    values: [f32; 4],
}

impl Set {
    const NONE: Self = Self {
        number: u32::MAX,
        values: [0.0; 4],
    };
}

impl Sampler {
    /// Starts sample number `sample` of `pixel` (column, row, from the top
    /// left of the full image, so that a crop shows the same noise).
    pub fn new(seed: u64, pixel: [u32; 2], sample: u32) -> Self {
        let pixel = u64::from(pixel[0]) | (u64::from(pixel[1]) << 32);
        let mut sampler = Self {
            pixel_key: mix(mix(seed) ^ pixel),
            key: 0,
            index: 0,
            last: Set::NONE,
            ahead: Set::NONE,
        };
        sampler.set_index(sample);
        sampler
    }

    /// The numbers of pilot paths through a cell of pixels (column, row from the top left
    /// of the full image): others than those of any sample.
    pub fn pilot(seed: u64, cell: [u32; 2]) -> Self {
        Self::new(mix(seed), cell, 0)
    }

    /// The numbers of the training path through a cell of a grid over the full image
    /// (column, row from the top left): others than those of any sample or pilot.
    pub fn training(seed: u64, cell: [u32; 2]) -> Self {
        Self::new(mix(mix(seed)), cell, 0)
    }

    /// Goes on with another sample of the pixel, for all dimensions that are
    /// drawn from now on: paths that share their first vertices are samples
    /// of their own behind those.
    #[inline]
    pub fn set_index(&mut self, sample: u32) {
        let sequence = u64::from(sample >> LOG2_SEQUENCE);
        self.key = mix(self.pixel_key.wrapping_add(sequence));
        self.index = sample & ((1 << LOG2_SEQUENCE) - 1);
        self.last = Set::NONE;
        self.ahead = Set::NONE;
    }

    /// Evaluates the sets that most surfaces ask for at vertex `bounce`, both at once:
    /// neither waits for the other's hash.
    #[inline]
    pub fn begin_vertex(&mut self, bounce: u32) {
        [self.last, self.ahead] =
            [Dimension::light_choice(bounce), Dimension::bsdf(bounce)].map(|dimension| Set {
                number: dimension.set,
                values: sobol_4d(self.index, self.set_key(dimension.set)),
            });
    }

    /// One number in [0, 1).
    #[inline]
    pub fn get_1d(&mut self, dimension: Dimension) -> f32 {
        self.set(dimension.set)[dimension.lane]
    }

    /// Two jointly stratified numbers in [0, 1).
    ///
    /// # Panics
    /// If `dimension` is the last of its set; none of those that are said to
    /// have two numbers is.
    #[inline]
    pub fn get_2d(&mut self, dimension: Dimension) -> [f32; 2] {
        let set = self.set(dimension.set);
        [set[dimension.lane], set[dimension.lane + 1]]
    }

    /// The four jointly stratified numbers of the set that `dimension` is in,
    /// in [0, 1).
    #[inline]
    pub fn get_4d(&mut self, dimension: Dimension) -> [f32; 4] {
        self.set(dimension.set)
    }

    /// The stream of microsurface walks at vertex `bounce`.
    #[inline]
    pub fn walk_stream(&mut self, bounce: u32, purpose: Purpose) -> WalkStream {
        let set = purpose.set(bounce);
        let first = (self.ahead.number == set).then_some(self.ahead.values);
        WalkStream::new(self.set_key(set), self.index, first)
    }

    /// Walks of several samples at once at vertex `bounce`, those with these indices.
    /// Their numbers are stratified among themselves and with those of other calls,
    /// but not the ones that [`Self::walk_stream`] gives.
    #[inline]
    pub fn lane_stream(
        &mut self,
        bounce: u32,
        purpose: Purpose,
        indices: impl Fn(usize) -> u32,
    ) -> LaneStream {
        // All lanes follow one sequence: the first decides which.
        self.set_index(indices(0));
        let set = purpose.set(bounce);
        let lanes = std::array::from_fn(|lane| indices(lane) & ((1 << LOG2_SEQUENCE) - 1));
        let sets = match purpose {
            Purpose::Sample => 2,
            Purpose::Light => 1,
        };
        LaneStream::new(self.set_key(set), lanes, sets)
    }

    #[inline]
    fn set(&mut self, set: u32) -> [f32; 4] {
        if self.last.number != set {
            self.last = Set {
                number: set,
                values: sobol_4d(self.index, self.set_key(set)),
            };
        }
        self.last.values
    }

    #[inline]
    fn set_key(&self, set: u32) -> u64 {
        mix(self.key.wrapping_add(u64::from(set)))
    }
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014, "Fast Splittable
/// Pseudorandom Number Generators", with the constants of Stafford's mix 13)
/// behind one step of its counter, so that 0 is no fixed point.
#[inline]
const fn mix(x: u64) -> u64 {
    let mut x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::walk::WALK_SETS;
    use super::*;

    /// Every dimension of the first two vertices, by name.
    fn layout() -> Vec<(Dimension, usize)> {
        let mut all = vec![
            (Dimension::camera_pixel(), 2),
            (Dimension::lens(), 2),
            (Dimension::time(), 1),
            (Dimension::pilot_pixel(), 2),
        ];
        for bounce in 0..2 {
            all.push((Dimension::light_choice(bounce), 1));
            all.push((Dimension::light_position(bounce), 2));
            all.push((Dimension::closure_choice(bounce), 1));
            all.push((Dimension::bsdf(bounce), 4));
            all.push((Dimension::roulette(bounce), 1));
            all.push((Dimension::layers(bounce), 4));
            all.push((Dimension::light_tree(bounce), 4));
            all.push((Dimension::medium(bounce), 4));
            all.push((Dimension::medium_light(bounce), 4));
        }
        all
    }

    /// The first number of a walk behind the stratified ones.
    fn tail_start(mut walk: WalkStream) -> f32 {
        for _ in 0..4 * WALK_SETS {
            walk.next_f32();
        }
        walk.next_f32()
    }

    #[test]
    fn dimensions_do_not_overlap() {
        let mut seen = std::collections::HashSet::new();
        for (dimension, count) in layout() {
            for lane in dimension.lane..dimension.lane + count {
                assert!(lane < 4, "{dimension:?} runs out of its set");
                assert!(seen.insert((dimension.set, lane)), "{dimension:?}");
            }
        }
    }

    #[test]
    fn numbers_do_not_depend_on_the_order_of_requests() {
        let numbers = |order: &mut dyn Iterator<Item = (Dimension, usize)>| {
            let mut sampler = Sampler::new(7, [3, 5], 11);
            let mut found: Vec<_> = order
                .map(|(d, _)| {
                    sampler.walk_stream(0, Purpose::Light).next_f32();
                    (d.set, d.lane, sampler.get_1d(d).to_bits())
                })
                .collect();
            found.sort_unstable();
            found
        };
        let forward = numbers(&mut layout().into_iter());
        assert_eq!(forward, numbers(&mut layout().into_iter().rev()));
        let only_roulette = Sampler::new(7, [3, 5], 11).get_1d(Dimension::roulette(1));
        assert!(forward.iter().any(|f| f.2 == only_roulette.to_bits()));
    }

    #[test]
    fn a_vertex_begun_at_once_has_the_same_numbers() {
        for bounce in 0..3 {
            let mut begun = Sampler::new(7, [3, 5], 11);
            let mut plain = begun.clone();
            begun.begin_vertex(bounce);
            for purpose in [Purpose::Sample, Purpose::Light] {
                let mut walks = [&mut begun, &mut plain].map(|s| s.walk_stream(bounce, purpose));
                for _ in 0..12 {
                    let [a, b] = walks.each_mut().map(WalkStream::next_f32);
                    assert_eq!(a, b, "{bounce} {purpose:?}");
                }
            }
            for (dimension, _) in layout() {
                assert_eq!(begun.get_1d(dimension), plain.get_1d(dimension));
            }
        }
    }

    /// Any 2^k first samples fall into the 2^k strata of each dimension, and of
    /// the elementary boxes of each pair that must be stratified jointly.
    #[test]
    fn first_samples_are_stratified() {
        const N: usize = 64;
        for (dimension, count) in layout() {
            let mut strata = [false; N];
            let mut boxes = [false; N];
            for sample in 0..N as u32 {
                let mut sampler = Sampler::new(1, [17, 4], sample);
                strata[(sampler.get_1d(dimension) * N as f32) as usize] = true;
                if count >= 2 && dimension.lane == 0 {
                    let [x, y] = sampler.get_2d(dimension);
                    boxes[(x * 8.0) as usize * 8 + (y * 8.0) as usize] = true;
                }
            }
            assert!(strata.iter().all(|&hit| hit), "{dimension:?}");
            // Sobol's dimensions 0 and 1 form a (0, 2)-sequence.
            if count >= 2 && dimension.lane == 0 {
                assert!(boxes.iter().all(|&hit| hit), "{dimension:?}");
            }
        }
    }

    /// Past 2^16 samples comes another sequence, not the first one again.
    #[test]
    fn a_second_sequence_follows() {
        let d = Dimension::bsdf(0);
        for sample in 0..32 {
            let first = Sampler::new(1, [0, 0], sample).get_4d(d);
            let second = Sampler::new(1, [0, 0], sample + (1 << 16)).get_4d(d);
            assert_ne!(first, second);
        }
    }

    /// Correlations between what should be independent: neighbouring pixels,
    /// seeds, sets, and walks of different purpose. Each statistic is a mean
    /// of n products of centred uniforms, normal with variance 1/(144 n); the
    /// bound of 5σ is passed by chance with probability 6e-7 each, fewer than
    /// 1e-5 for all of them.
    #[test]
    fn neighbours_are_uncorrelated() {
        const N: u32 = 40_000;
        type Pair = fn(u32) -> [f32; 2];
        let pairs: [(&str, Pair); 6] = [
            ("pixels in a row", |i| {
                [i, i + 1].map(|x| Sampler::new(1, [x, 9], 0).get_1d(Dimension::lens()))
            }),
            ("pixels in a column", |i| {
                [i, i + 1].map(|y| Sampler::new(1, [9, y], 0).get_1d(Dimension::lens()))
            }),
            ("seeds", |i| {
                [0, 1].map(|s| Sampler::new(s, [i, 2], 3).get_1d(Dimension::bsdf(1)))
            }),
            ("vertices", |i| {
                [0, 1].map(|b| Sampler::new(1, [i, 2], 3).get_1d(Dimension::bsdf(b)))
            }),
            ("purposes", |i| {
                [Purpose::Sample, Purpose::Light]
                    .map(|p| tail_start(Sampler::new(1, [i, 2], 3).walk_stream(0, p)))
            }),
            ("tails of samples", |i| {
                [2 * i, 2 * i + 1]
                    .map(|s| tail_start(Sampler::new(1, [0, 0], s).walk_stream(0, Purpose::Sample)))
            }),
        ];
        let bound = 5.0 / (144.0 * f64::from(N)).sqrt();
        for (name, pair) in pairs {
            let sum: f64 = (0..N)
                .map(|i| {
                    let [a, b] = pair(i).map(|u| f64::from(u) - 0.5);
                    a * b
                })
                .sum();
            let mean = sum / f64::from(N);
            assert!(mean.abs() < bound, "{name}: {mean:.2e}, bound {bound:.2e}");
        }
    }

    /// Mean and variance of the PCG tail, and the range of both parts. The
    /// mean of n uniforms has σ = 1/√(12 n), that of their squares
    /// √(4/45/n); the bound is 5σ, chance 6e-7 each.
    #[test]
    fn walks_draw_uniforms() {
        const STREAMS: u32 = 1000;
        const DRAWS: u32 = 200;
        let (mut sum, mut squares) = (0.0, 0.0);
        for pixel in 0..STREAMS {
            let mut stream = Sampler::new(3, [pixel, 0], 0).walk_stream(2, Purpose::Sample);
            let lead = Sampler::new(3, [pixel, 0], 0).get_4d(Dimension::bsdf(2));
            assert_eq!(lead, [0; 4].map(|_| stream.next_f32()));
            for _ in 0..DRAWS {
                let u = stream.next_f32();
                assert!((0.0..1.0).contains(&u));
                sum += f64::from(u);
                squares += f64::from(u) * f64::from(u);
            }
        }
        let n = f64::from(STREAMS * DRAWS);
        assert!((sum / n - 0.5).abs() < 5.0 / (12.0 * n).sqrt());
        assert!((squares / n - 1.0 / 3.0).abs() < 5.0 * (4.0 / 45.0 / n).sqrt());
    }
}
