//! The closures of one shading point: a mix, laid flat.

use arrayvec::ArrayVec;
use glam::Vec3;
use wide::f32x8;

use super::closure::{Laned, MIN_COS};
use super::horizons::Horizons;
use super::{ByOrder, Closure, Frame};
use crate::color::Rgb;
use crate::features::{Features, has};
use crate::rays::{RayKind, RayKinds};
use smithwalk_model::{self as model, Draw, LANES, Tally};

/// The most closures that a material may flatten to.
pub const MAX_CLOSURES: usize = 16;

/// One closure of the mix, weighted for the viewer's direction.
#[derive(Clone, Debug)]
pub struct WeightedClosure {
    /// The factor on its light, per channel. It may depend on `wo`: a coat weighs
    /// what lies below it by one minus its own albedo.
    pub weight: Rgb,
    /// How often it is sampled, relative to the others'.
    pub chance: f32,
    /// The frame it scatters in, z on the viewer's side.
    pub frame: Frame,
    /// What it scatters like.
    pub closure: Closure,
}

/// A direction sampled from a mix, in world space.
#[derive(Clone, Copy, Debug)]
pub struct ScatterSample {
    /// Unit length.
    pub wi: Vec3,
    /// f·|cosθ_i| over the density of `wi`.
    pub weight: Rgb,
    /// [`Bsdf::pdf`] of `wi`, sr⁻¹, in code for scenes with lights to sample.
    pub pdf: f32,
    /// Facets met; 1 is single scattering.
    pub order: u32,
    /// Whether the closure scatters into single directions, which no light
    /// sample can meet.
    pub delta: bool,
    /// Whether the direction is the straight continuation of the ray.
    pub straight: bool,
    /// What the ray that goes on is seen as.
    pub kind: RayKind,
}

/// All closures at a hit, with the geometric normal that tells reflection from
/// transmission. What is done with them is compiled for the features `F`:
/// without mixes there is at most one, of weight one.
#[derive(Clone, Debug)]
pub struct Bsdf<const F: u32 = { Features::EVERYTHING.bits() }> {
    closures: ArrayVec<WeightedClosure, MAX_CLOSURES>,
    /// Geometric normal on the viewer's side, world space.
    normal: Vec3,
    /// The sum of the chances.
    total: f32,
}

impl<const F: u32> Bsdf<F> {
    /// None yet, on a surface with this geometric normal (viewer's side).
    #[must_use]
    pub fn new(normal: Vec3) -> Self {
        Self {
            closures: ArrayVec::new(),
            normal,
            total: 0.0,
        }
    }

    /// Adds a closure; those that are never sampled are left out.
    ///
    /// # Panics
    /// Past [`MAX_CLOSURES`], which scenes are checked for when they are resolved.
    #[inline(always)]
    pub fn push(&mut self, part: WeightedClosure) {
        if part.chance > 0.0 {
            self.total += part.chance;
            self.closures.push(part);
        }
    }

    /// Whether any closure can be met by light samples.
    #[must_use]
    #[inline(always)]
    pub fn has_smooth(&self) -> bool {
        self.known().any(|part| !part.closure.is_delta())
    }

    /// The share of light that goes straight through, per channel.
    #[must_use]
    pub fn transparency(&self) -> Rgb {
        let straight = |part: &WeightedClosure| match part.closure {
            Closure::Transparent(color) => color * part.weight,
            _ => Rgb::ZERO,
        };
        self.closures.iter().map(straight).sum()
    }

    /// Chooses a closure by its chance with `choice` in [0, 1), and samples it.
    #[inline]
    pub fn sample(&self, wo: Vec3, choice: f32, rng: &mut impl Draw<f32>) -> Option<ScatterSample> {
        let part = self.choose(choice)?;
        if !part.closure.is_in::<F>() {
            return None;
        }
        let horizons = part.horizons(self.normal);
        let local = part.frame.to_local(horizons.viewer(wo));
        let sample = part.closure.sample(local, rng)?;
        let (wi, density) = horizons.lift(part.frame.to_world(sample.wi));
        if !same_side(self.normal, wi, sample.wi.z) {
            return None;
        }
        let pdf = if !has::<F>(Features::LIGHT_SAMPLING) || sample.delta {
            0.0
        } else if self.closures.len() == 1 {
            // Both directions are in its frame already.
            part.closure.pdf(local, sample.wi) * density
        } else {
            self.pdf(wo, wi)
        };
        Some(ScatterSample {
            wi,
            pdf,
            weight: if has::<F>(Features::MIXES) {
                sample.weight * (part.weight / part.chance * self.total)
            } else {
                sample.weight
            },
            order: sample.order,
            delta: sample.delta,
            straight: matches!(part.closure, Closure::Transparent(_)),
            kind: part.closure.kind(sample.wi.z),
        })
    }

    /// f·|cosθ_i| of the mix or an estimate of it, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, rng: &mut impl Draw<f32>) -> ByOrder {
        let mut sum = ByOrder::ZERO;
        self.eval_orders(wo, wi, rng, &mut sum);
        sum
    }

    /// As [`Self::eval`], of the closures alone whose rays are of one of these kinds.
    #[must_use]
    #[inline]
    pub fn eval_seen_by(
        &self,
        kinds: RayKinds,
        wo: Vec3,
        wi: Vec3,
        rng: &mut impl Draw<f32>,
    ) -> ByOrder {
        let mut sum = ByOrder::ZERO;
        self.tally(kinds, wo, wi, rng, &mut sum);
        sum
    }

    /// Adds f·|cosθ_i| or an estimate of it, sr⁻¹, to `tally`, order by order.
    #[inline]
    pub fn eval_orders(
        &self,
        wo: Vec3,
        wi: Vec3,
        rng: &mut impl Draw<f32>,
        tally: &mut impl Tally<f32>,
    ) {
        self.tally(RayKinds::ALL, wo, wi, rng, tally);
    }

    #[inline(always)]
    fn tally(
        &self,
        kinds: RayKinds,
        wo: Vec3,
        wi: Vec3,
        rng: &mut impl Draw<f32>,
        tally: &mut impl Tally<f32>,
    ) {
        for (part, seen) in self.see(wo, wi) {
            let Seen { wo, wi, density } = seen;
            if density == 0.0 {
                continue;
            }
            if has::<F>(Features::RAY_VISIBILITY) && !kinds.contains(part.closure.kind(wi.z)) {
                continue;
            }
            let weight = if has::<F>(Features::MIXES) {
                part.weight * density
            } else {
                Rgb::splat(density)
            };
            let mut scaled = Scaled {
                weight: weight.into(),
                tally: &mut *tally,
            };
            part.closure.eval(wo, wi, rng, &mut scaled);
        }
    }

    /// All there is, if it is one closure that can be evaluated for several directions
    /// at once, for less than that many evaluations cost.
    #[inline(always)]
    pub fn in_lanes(&self) -> Option<InLanes<'_, F>> {
        if !(has::<F>(Features::METALS) && has::<F>(Features::MULTIPLE_SCATTERING)) {
            return None;
        }
        let [part] = self.closures.as_slice() else {
            return None;
        };
        Some(InLanes {
            closure: part.closure.in_lanes::<F>()?,
            part,
            normal: self.normal,
        })
    }

    /// The density of the mix for multiple importance sampling, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let density = |part: &WeightedClosure, seen: Seen| {
            if seen.density == 0.0 {
                return 0.0;
            }
            part.closure.pdf(seen.wo, seen.wi) * seen.density
        };
        if !has::<F>(Features::MIXES) {
            let only = self.known().next();
            return only.map_or(0.0, |part| density(part, part.see(self.normal, wo, wi)));
        }
        let sum: f32 = self
            .see(wo, wi)
            .map(|(part, seen)| density(part, seen) * part.chance)
            .sum();
        if sum > 0.0 { sum / self.total } else { 0.0 }
    }

    /// The closures, each with both directions in its frame. Most mixes have one frame
    /// for all, which is gone into once.
    #[inline(always)]
    fn see(&self, wo: Vec3, wi: Vec3) -> impl Iterator<Item = (&WeightedClosure, Seen)> {
        let mut last: Option<(&Frame, Seen)> = None;
        self.known().map(move |part| {
            let seen = match last {
                Some((frame, seen)) if *frame == part.frame => seen,
                _ => part.see(self.normal, wo, wi),
            };
            if has::<F>(Features::MIXES) {
                last = Some((&part.frame, seen));
            }
            (part, seen)
        })
    }

    /// The closures, of kinds that there is code for: all.
    #[inline(always)]
    fn known(&self) -> impl Iterator<Item = &WeightedClosure> {
        let most = if has::<F>(Features::MIXES) {
            MAX_CLOSURES
        } else {
            1
        };
        let closures = self.closures.iter().take(most);
        closures.filter(|part| part.closure.is_in::<F>())
    }

    #[inline(always)]
    fn choose(&self, choice: f32) -> Option<&WeightedClosure> {
        if !has::<F>(Features::MIXES) {
            return self.closures.first();
        }
        let mut rest = choice * self.total;
        for part in &self.closures {
            rest -= part.chance;
            if rest < 0.0 {
                return Some(part);
            }
        }
        // Rounding may leave a hair's breadth past the last one.
        self.closures.last()
    }
}

/// Directions in a closure's frame, as the horizon of its normal makes them.
#[derive(Clone, Copy)]
struct Seen {
    wo: Vec3,
    wi: Vec3,
    /// The factor on densities over `wi`; 0 where the closure sends nothing. (An
    /// `Option` would pass through memory on the hottest path there is.)
    density: f32,
}

impl WeightedClosure {
    #[inline(always)]
    fn horizons(&self, geometric: Vec3) -> Horizons {
        Horizons::new(self.frame.z, geometric)
    }

    /// Both directions in the closure's frame.
    #[inline(always)]
    fn see(&self, geometric: Vec3, wo: Vec3, wi: Vec3) -> Seen {
        let horizons = self.horizons(geometric);
        let (moved, density) = horizons.lower(wi);
        let local = self.frame.to_local(moved);
        let lit = same_side(geometric, wi, local.z);
        Seen {
            wo: self.frame.to_local(horizons.viewer(wo)),
            wi: local,
            density: if lit { density } else { 0.0 },
        }
    }
}

/// Whether `wi` is on the side of the true surface that a closure means by this
/// cosine. Beside the horizon rounding may bring it to the other.
#[inline(always)]
fn same_side(normal: Vec3, wi: Vec3, local_z: f32) -> bool {
    wi.dot(normal) * local_z > 0.0
}

/// A closure at a hit, to be evaluated for several directions at once.
pub struct InLanes<'a, const F: u32> {
    closure: Laned<'a>,
    part: &'a WeightedClosure,
    normal: Vec3,
}

impl<const F: u32> InLanes<'_, F> {
    /// Eight times [`Bsdf::sample`].
    #[must_use]
    #[inline]
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32x8>) -> [Option<ScatterSample>; LANES] {
        let horizons = self.part.horizons(self.normal);
        let wo = self.part.frame.to_local(horizons.viewer(wo));
        if wo.z.is_nan() || wo.z <= MIN_COS {
            return [None; LANES];
        }
        let exits = match self.closure {
            Laned::Ggx(rough) => rough.sample_lanes(wo, rng),
            Laned::Beckmann(rough) if has::<F>(Features::BECKMANN) => rough.sample_lanes(wo, rng),
            Laned::Beckmann(_) => [None; LANES],
        };
        exits.map(|exit| {
            let (sample, pdf) = exit.filter(|(sample, _)| sample.is_usable())?;
            let (wi, density) = horizons.lift(self.part.frame.to_world(sample.wi));
            let lit = same_side(self.normal, wi, sample.wi.z);
            let sample = ScatterSample {
                wi,
                weight: sample.weight * self.part.weight,
                pdf: pdf * density,
                order: sample.order,
                delta: false,
                straight: false,
                kind: RayKind::Glossy,
            };
            lit.then_some(sample)
        })
    }

    /// Estimates of f·|cosθ_i|, sr⁻¹, as [`Bsdf::eval`] has them, towards each of `wi`.
    #[must_use]
    #[inline]
    pub fn eval(
        &self,
        wo: Vec3,
        wi: [Vec3; LANES],
        rng: &mut impl Draw<f32x8>,
    ) -> [ByOrder; LANES] {
        let horizons = self.part.horizons(self.normal);
        let wo = self.part.frame.to_local(horizons.viewer(wo));
        if wo.z.is_nan() || wo.z <= MIN_COS {
            return [ByOrder::ZERO; LANES];
        }
        let mut densities = [1.0; LANES];
        let mut local = [Vec3::NEG_Z; LANES];
        for (i, &wi) in wi.iter().enumerate() {
            // No light comes from below a metal.
            let (moved, density) = horizons.lower(wi);
            let moved = self.part.frame.to_local(moved);
            if density > 0.0 && moved.z > MIN_COS && same_side(self.normal, wi, moved.z) {
                (local[i], densities[i]) = (moved, density);
            }
        }
        let values = match self.closure {
            Laned::Ggx(rough) => rough.eval_lanes(wo, local, rng),
            Laned::Beckmann(rough) if has::<F>(Features::BECKMANN) => {
                rough.eval_lanes(wo, local, rng)
            }
            Laned::Beckmann(_) => [ByOrder::ZERO; LANES],
        };
        std::array::from_fn(|i| values[i] * (self.part.weight * densities[i]))
    }
}

/// Multiplies what it is given by a closure's weight, and hands it on.
struct Scaled<'a, T> {
    weight: [f32; 3],
    tally: &'a mut T,
}

impl<T: Tally<f32>> Tally<f32> for Scaled<'_, T> {
    #[inline]
    fn add(&mut self, order: u32, value: model::Rgb<f32>) {
        self.tally.add(order, value * model::Rgb(self.weight));
    }
}
