//! The closures of one shading point: a mix, laid flat.

use arrayvec::ArrayVec;
use glam::Vec3;
use wide::f32x8;

use super::closure::{Laned, MIN_COS};
use super::{ByOrder, Closure, Frame};
use crate::color::Rgb;
use crate::features::{Features, has};
use smithwalk_model::{self as model, Draw, LANES, Tally};

/// The most closures that a material may flatten to.
pub const MAX_LAYERS: usize = 8;

/// One closure of a mix.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// Its share of the mix; the shares of a material's closures, emission
    /// among them, add up to one.
    pub share: f32,
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
    /// Facets met; 1 is single scattering.
    pub order: u32,
    /// Whether the closure scatters into single directions, which no light
    /// sample can meet.
    pub delta: bool,
    /// Whether the direction is the straight continuation of the ray.
    pub straight: bool,
}

/// All closures at a hit, with the geometric normal that tells reflection from
/// transmission. What is done with them is compiled for the features `F`:
/// without mixes there is at most one, of share one.
#[derive(Clone, Debug)]
pub struct Layers<const F: u32 = { Features::EVERYTHING.bits() }> {
    layers: ArrayVec<Layer, MAX_LAYERS>,
    /// Geometric normal on the viewer's side, world space.
    normal: Vec3,
    /// The sum of the shares.
    total: f32,
}

impl<const F: u32> Layers<F> {
    /// None yet, on a surface with this geometric normal (viewer's side).
    #[must_use]
    pub fn new(normal: Vec3) -> Self {
        Self {
            layers: ArrayVec::new(),
            normal,
            total: 0.0,
        }
    }

    /// Adds a closure; those without a share are left out.
    ///
    /// # Panics
    /// Past [`MAX_LAYERS`], which scenes are checked for when they are resolved.
    pub fn push(&mut self, layer: Layer) {
        if layer.share > 0.0 {
            self.total += layer.share;
            self.layers.push(layer);
        }
    }

    /// Whether any closure can be met by light samples.
    #[must_use]
    #[inline(always)]
    pub fn has_smooth(&self) -> bool {
        self.known().any(|layer| !layer.closure.is_delta())
    }

    /// The share of light that goes straight through, per channel.
    #[must_use]
    pub fn transparency(&self) -> Rgb {
        let straight = |layer: &Layer| match layer.closure {
            Closure::Transparent(color) => color * layer.share,
            _ => Rgb::ZERO,
        };
        self.layers.iter().map(straight).sum()
    }

    /// Chooses a closure by its share with `choice` in [0, 1), and samples it.
    #[inline]
    pub fn sample(&self, wo: Vec3, choice: f32, rng: &mut impl Draw<f32>) -> Option<ScatterSample> {
        let layer = self.choose(choice)?;
        if !layer.closure.is_in::<F>() {
            return None;
        }
        let sample = layer.closure.sample(layer.frame.to_local(wo), rng)?;
        let wi = layer.frame.to_world(sample.wi);
        if !self.same_side(wi, sample.wi.z) {
            return None;
        }
        Some(ScatterSample {
            wi,
            // share / (share / total)
            weight: if has::<F>(Features::MIXES) {
                sample.weight * self.total
            } else {
                sample.weight
            },
            order: sample.order,
            delta: layer.closure.is_delta(),
            straight: matches!(layer.closure, Closure::Transparent(_)),
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

    /// Adds f·|cosθ_i| or an estimate of it, sr⁻¹, to `tally`, order by order.
    #[inline]
    pub fn eval_orders(
        &self,
        wo: Vec3,
        wi: Vec3,
        rng: &mut impl Draw<f32>,
        tally: &mut impl Tally<f32>,
    ) {
        for layer in self.known() {
            let local = layer.frame.to_local(wi);
            if !self.same_side(wi, local.z) {
                continue;
            }
            let local_wo = layer.frame.to_local(wo);
            if has::<F>(Features::MIXES) {
                let mut scaled = Scaled {
                    share: layer.share,
                    tally: &mut *tally,
                };
                layer.closure.eval(local_wo, local, rng, &mut scaled);
            } else {
                layer.closure.eval(local_wo, local, rng, tally);
            }
        }
    }

    /// All there is, if it is one closure that can be evaluated for several directions
    /// at once, for less than that many evaluations cost.
    #[inline(always)]
    pub fn in_lanes(&self) -> Option<InLanes<'_, F>> {
        if !(has::<F>(Features::METALS) && has::<F>(Features::MULTIPLE_SCATTERING)) {
            return None;
        }
        let [layer] = self.layers.as_slice() else {
            return None;
        };
        Some(InLanes {
            closure: layer.closure.in_lanes::<F>()?,
            layer,
            normal: self.normal,
        })
    }

    /// The density of the mix for multiple importance sampling, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let density = |layer: &Layer| {
            let local = layer.frame.to_local(wi);
            if self.same_side(wi, local.z) {
                layer.closure.pdf(layer.frame.to_local(wo), local)
            } else {
                0.0
            }
        };
        if !has::<F>(Features::MIXES) {
            return self.known().next().map_or(0.0, density);
        }
        let sum: f32 = self.known().map(|layer| density(layer) * layer.share).sum();
        if sum > 0.0 { sum / self.total } else { 0.0 }
    }

    /// The closures, of kinds that there is code for: all.
    #[inline(always)]
    fn known(&self) -> impl Iterator<Item = &Layer> {
        let most = if has::<F>(Features::MIXES) {
            MAX_LAYERS
        } else {
            1
        };
        let layers = self.layers.iter().take(most);
        layers.filter(|layer| layer.closure.is_in::<F>())
    }

    #[inline(always)]
    fn choose(&self, choice: f32) -> Option<&Layer> {
        if !has::<F>(Features::MIXES) {
            return self.layers.first();
        }
        let mut rest = choice * self.total;
        for layer in &self.layers {
            rest -= layer.share;
            if rest < 0.0 {
                return Some(layer);
            }
        }
        // Rounding may leave a hair's breadth past the last one.
        self.layers.last()
    }

    /// Interpolated normals make directions that are above the shading normal's
    /// horizon and below the true surface's, or the other way round: such light
    /// would leak through, so it is refused both when sampling and evaluating.
    fn same_side(&self, wi: Vec3, local_z: f32) -> bool {
        same_side(self.normal, wi, local_z)
    }
}

/// See [`Layers::same_side`].
fn same_side(normal: Vec3, wi: Vec3, local_z: f32) -> bool {
    wi.dot(normal) * local_z > 0.0
}

/// A closure at a hit, to be evaluated for several directions at once.
pub struct InLanes<'a, const F: u32> {
    closure: Laned<'a>,
    layer: &'a Layer,
    normal: Vec3,
}

impl<const F: u32> InLanes<'_, F> {
    /// Eight times [`Layers::sample`], each with the [`Layers::pdf`] of its direction.
    #[must_use]
    #[inline]
    pub fn sample(
        &self,
        wo: Vec3,
        rng: &mut impl Draw<f32x8>,
    ) -> [Option<(ScatterSample, f32)>; LANES] {
        let wo = self.layer.frame.to_local(wo);
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
            let wi = self.layer.frame.to_world(sample.wi);
            let lit = same_side(self.normal, wi, sample.wi.z);
            let sample = ScatterSample {
                wi,
                weight: sample.weight * self.layer.share,
                order: sample.order,
                delta: false,
                straight: false,
            };
            lit.then_some((sample, pdf))
        })
    }

    /// Estimates of f·|cosθ_i|, sr⁻¹, as [`Layers::eval`] has them, towards each of `wi`.
    #[must_use]
    #[inline]
    pub fn eval(
        &self,
        wo: Vec3,
        wi: [Vec3; LANES],
        rng: &mut impl Draw<f32x8>,
    ) -> [ByOrder; LANES] {
        let wo = self.layer.frame.to_local(wo);
        if wo.z.is_nan() || wo.z <= MIN_COS {
            return [ByOrder::ZERO; LANES];
        }
        let local = wi.map(|wi| {
            let local = self.layer.frame.to_local(wi);
            let lit = local.z > MIN_COS && same_side(self.normal, wi, local.z);
            // No light comes from below a metal.
            if lit { local } else { Vec3::NEG_Z }
        });
        let values = match self.closure {
            Laned::Ggx(rough) => rough.eval_lanes(wo, local, rng),
            Laned::Beckmann(rough) if has::<F>(Features::BECKMANN) => {
                rough.eval_lanes(wo, local, rng)
            }
            Laned::Beckmann(_) => [ByOrder::ZERO; LANES],
        };
        values.map(|value| value * Rgb::splat(self.layer.share))
    }
}

/// Multiplies what it is given by a layer's share, and hands it on.
struct Scaled<'a, T> {
    share: f32,
    tally: &'a mut T,
}

impl<T: Tally<f32>> Tally<f32> for Scaled<'_, T> {
    #[inline]
    fn add(&mut self, order: u32, value: model::Rgb<f32>) {
        self.tally.add(order, value * self.share);
    }
}
