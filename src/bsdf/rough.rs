//! Rough surfaces: the Smith microsurface model behind the closure contract.

use glam::Vec3;
use wide::f32x8;

use super::{Albedos, BsdfSample, ByOrder, MeanWeight, Width, WidthInLanes, to_model};
use crate::color::Rgb;
use crate::features::{Features, has};
use smithwalk_model::{
    self as model, Conductor, Draw, Estimator, LANES, Microsurface, Tally, Vector3,
};

/// How a rough surface's scattering is computed.
#[derive(Clone, Copy, Debug)]
pub enum Method {
    /// All orders, by this estimator.
    Multiple(Estimator),
    /// The same, but those above the first only as often as they are worth
    /// their time. For facets whose first order is known in closed form.
    Thinned(Estimator),
    /// The first order alone: what meets a second facet is lost.
    Single,
    /// The first order with the masking of either direction by itself, G1 G1: what
    /// Cycles has up to 3.6.
    Separable,
    /// The first order, scaled to about the albedo that all orders have
    /// together.
    Compensated(&'static Albedos),
}

/// A microsurface with normals distributed by `N` and facets `I`.
#[derive(Clone, Copy, Debug)]
pub struct Rough<N, I> {
    /// The model.
    pub surface: Microsurface<N, I>,
    /// Which orders, and how.
    pub method: Method,
}

impl<N, I> Rough<N, I> {
    /// Whether code for the features `F` has to know the method.
    #[inline(always)]
    pub(super) fn is_in<const F: u32>(&self) -> bool {
        has::<F>(Features::MULTIPLE_SCATTERING) || !self.method.is_multiple()
    }
}

impl Method {
    /// Whether it has orders above the first.
    #[must_use]
    #[inline(always)]
    pub fn is_multiple(&self) -> bool {
        matches!(self, Self::Multiple(_) | Self::Thinned(_))
    }
}

/// How often orders above the first are evaluated: the square of this times Λ times
/// the square of what a facet reflects, on white facets always from a Λ of 1/128 on.
/// This and [`TURN`] are the roundest that measured well (docs/estimators.md).
const ROOT_CHANCE_PER_LAMBDA: f32 = 128.0;

/// How far towards grazing one facet well turns light, over α. A facet of slope
/// α turns it by twice that.
const TURN: f32 = 1.5;

/// The least chance: what is evaluated stands for no more than 16 that are not,
/// so that rare bright paths do not show as specks.
const LEAST_CHANCE: f32 = 1.0 / 16.0;

/// A cosine, of tanθ = 2, that light inside the microsurface can have whatever
/// the directions outside are.
const INSIDE: f32 = 0.447_213_6;

impl<N: Width, I: MeanWeight> Rough<N, I> {
    /// One walk, or one visible normal for single scattering.
    #[inline]
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
        let exit = match self.method {
            Method::Multiple(_) | Method::Thinned(_) => self.surface.sample(to_model(wo), rng),
            Method::Single => self.surface.sample_single(to_model(wo), rng),
            Method::Separable => {
                let wo = to_model(wo);
                let mut exit = self.surface.sample_single(wo, rng)?;
                exit.weight = exit.weight * self.separation(wo, exit.direction);
                Some(exit)
            }
            Method::Compensated(albedos) => {
                let mut exit = self.surface.sample_single(to_model(wo), rng)?;
                exit.weight *= albedos.scale(&self.surface, wo.z);
                Some(exit)
            }
        }?;
        Some(BsdfSample::from(exit))
    }

    /// Adds an unbiased estimate of f·|cosθ_i|, sr⁻¹, to `tally`, order by order;
    /// all that compensation adds counts as first order.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, rng: &mut impl Draw<f32>, tally: &mut impl Tally<f32>) {
        let (wo, wi) = (to_model(wo), to_model(wi));
        match self.method {
            Method::Multiple(estimator) => self.eval_orders(estimator, 1.0, wo, wi, rng, tally),
            Method::Thinned(estimator) => {
                let chance = self.chance(wo, wi);
                self.eval_orders(estimator, chance, wo, wi, rng, tally);
            }
            Method::Single => tally.add(1, self.surface.eval_single(wo, wi, rng)),
            Method::Separable => {
                let value = self.surface.eval_single(wo, wi, rng);
                tally.add(1, value * self.separation(wo, wi));
            }
            Method::Compensated(albedos) => {
                let scale = albedos.scale(&self.surface, wo.z);
                tally.add(1, self.surface.eval_single(wo, wi, rng) * scale);
            }
        }
    }

    /// All orders, those above the first with this `chance`.
    #[inline]
    fn eval_orders(
        &self,
        estimator: Estimator,
        chance: f32,
        wo: Vector3<f32>,
        wi: Vector3<f32>,
        rng: &mut impl Draw<f32>,
        tally: &mut impl Tally<f32>,
    ) {
        let thinned = chance < 1.0;
        if thinned {
            tally.add(1, self.surface.eval_single(wo, wi, rng));
            if rng.draw() >= chance {
                return;
            }
        }
        let mut orders = Orders {
            first: if thinned { 2 } else { 1 },
            scale: chance.recip(),
            tally,
        };
        self.surface.eval(estimator, wo, wi, rng, &mut orders);
    }

    /// How often orders above the first are evaluated. Their share goes with what
    /// two facets keep and with the chance to meet a second one, Λ, along the most
    /// grazing direction that one facet can well turn the light to: where normals are
    /// spread unevenly, towards the rougher axis.
    #[inline]
    fn chance(&self, wo: Vector3<f32>, wi: Vector3<f32>) -> f32 {
        let low = if wo.z < wi.z.abs() { wo } else { wi };
        let across = low.x.hypot(low.y);
        let [alpha_x, alpha_y] = self.surface.ndf.alphas();
        let up = low.z.abs() - TURN * alpha_x.max(alpha_y) * across;
        if up <= 0.0 {
            return 1.0;
        }
        let grazing = if up < INSIDE {
            let stretch = (1.0 - up * up).sqrt() / across;
            let (x, y) = if alpha_x == alpha_y {
                (low.x, low.y)
            } else if alpha_x > alpha_y {
                (across, 0.0)
            } else {
                (0.0, across)
            };
            Vector3 {
                x: x * stretch,
                y: y * stretch,
                z: up,
            }
        } else {
            // Between the axes.
            let side = INSIDE * std::f32::consts::SQRT_2;
            Vector3 {
                x: side,
                y: side,
                z: INSIDE,
            }
        };
        let kept = self.surface.facets.weight_aslant();
        let root = ROOT_CHANCE_PER_LAMBDA * self.surface.ndf.lambda(grazing) * (kept * kept);
        // Glass reflects so little at one facet that higher orders weigh more.
        let faint = if I::TRANSMITS && wo.z * wi.z > 0.0 {
            root
        } else {
            root * root
        };
        faint.clamp(LEAST_CHANCE, 1.0)
    }

    /// Masking and shadowing by themselves over the two together (Heitz 2014,
    /// "Understanding the Masking-Shadowing Function", eq. 98, 99; by transmission
    /// the Beta function, Heitz et al. 2016).
    #[inline]
    fn separation(&self, wo: Vector3<f32>, wi: Vector3<f32>) -> f32 {
        let upright = |v: Vector3<f32>| Vector3::new(v.x, v.y, v.z.abs());
        let [o, i] = [wo, wi].map(|v| 1.0 + self.surface.ndf.lambda(upright(v)));
        let both = if wi.z < 0.0 {
            model::ln_beta(o, i).exp()
        } else {
            1.0 / (o + i - 1.0)
        };
        1.0 / (o * i * both)
    }

    /// The density that stands in for the sampler's, sr⁻¹.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (wo, wi) = (to_model(wo), to_model(wi));
        match self.method {
            Method::Multiple(_) | Method::Thinned(_) => self.surface.pdf(wo, wi),
            Method::Single | Method::Separable | Method::Compensated(_) => {
                self.surface.pdf_single(wo, wi)
            }
        }
    }
}

impl<N: WidthInLanes> Rough<N, Conductor<f32>> {
    /// Whether [`Self::eval_lanes`] is worth its time. On surfaces that are too smooth
    /// orders above the first are evaluated so rarely that one evaluation is enough.
    #[inline]
    pub fn suits_lanes(&self) -> bool {
        self.is_automatic()
            && self.surface.ndf.width() >= N::LANES_FROM
            && self.surface.suits_position_free()
    }

    /// Whether the choice of the estimator was left to the material: only then may
    /// lanes stand in for it.
    #[inline]
    pub fn is_automatic(&self) -> bool {
        matches!(self.method, Method::Thinned(Estimator::PositionFree))
    }

    /// Eight times [`Self::sample`], each with the [`Self::pdf`] of its direction.
    #[inline]
    pub fn sample_lanes(
        &self,
        wo: Vec3,
        rng: &mut impl Draw<f32x8>,
    ) -> [Option<(BsdfSample, f32)>; LANES] {
        let exits = self.surface.sample_lanes(to_model(wo), rng);
        exits.map(|exit| exit.map(|(exit, pdf)| (BsdfSample::from(exit), pdf)))
    }

    /// As [`Self::eval`], with the mean of eight evaluations of the orders above the
    /// first whenever they are evaluated.
    #[inline]
    pub fn eval_eightfold(
        &self,
        wo: Vec3,
        wi: Vec3,
        rng: &mut impl Draw<f32>,
        tally: &mut impl Tally<f32>,
    ) {
        let (wo, wi) = (to_model(wo), to_model(wi));
        tally.add(1, self.surface.eval_single(wo, wi, rng));
        let chance = self.chance(wo, wi);
        if chance < 1.0 && rng.draw() >= chance {
            return;
        }
        let mut orders = Orders {
            first: 2,
            scale: chance.recip(),
            tally,
        };
        if self.surface.suits_position_free() {
            self.surface
                .eval_multiple_in_lanes(wo, wi, rng, &mut orders);
        } else {
            self.surface
                .eval(Estimator::TwoWalk, wo, wi, rng, &mut orders);
        }
    }

    /// Estimates of f·|cosθ_i|, sr⁻¹, towards each of `wi`.
    #[inline]
    pub fn eval_lanes(
        &self,
        wo: Vec3,
        wi: [Vec3; LANES],
        rng: &mut impl Draw<f32x8>,
    ) -> [ByOrder; LANES] {
        let (wo, wi) = (to_model(wo), wi.map(to_model));
        let chance = wi.map(|wi| self.chance(wo, wi));
        let values = self.surface.eval_lanes(wo, &wi, chance, rng);
        values.map(|value| ByOrder {
            single: Rgb::from(value.single.0),
            multiple: Rgb::from(value.multiple.0),
        })
    }
}

/// Scales orders from `first` on, and drops those below.
struct Orders<'a, T> {
    first: u32,
    scale: f32,
    tally: &'a mut T,
}

impl<T: Tally<f32>> Tally<f32> for Orders<'_, T> {
    #[inline]
    fn add(&mut self, order: u32, value: model::Rgb<f32>) {
        if order >= self.first {
            self.tally.add(order, value * self.scale);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::ByOrder;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;
    use smithwalk_model::{ConductorFresnel, Ggx, Rgb as Color, Stream};

    const N: u32 = 400_000;

    /// Of orders above the first, summed over the channels: mean, standard error and the
    /// share of estimates that are not 0.
    fn higher(surface: Microsurface<Ggx<f32>, Conductor<f32>>, method: Method) -> [f64; 3] {
        let rough = Rough { surface, method };
        let [wo, wi] = [(0.5, 0.3), (0.7, 2.0)]
            .map(|(cos, phi)| Vector3::spherical(cos, phi))
            .map(|v| Vec3::new(v.x, v.y, v.z));
        let mut rng = Stream(Pcg64Mcg::seed_from_u64(17));
        let (mut sum, mut squares, mut found) = (0.0, 0.0, 0);
        for _ in 0..N {
            let mut value = ByOrder::ZERO;
            rough.eval(wo, wi, &mut rng, &mut value);
            let value = f64::from(value.multiple.element_sum());
            sum += value;
            squares += value * value;
            found += u32::from(value > 0.0);
        }
        let n = f64::from(N);
        let mean = sum / n;
        let error = ((squares / n - mean * mean) / n).sqrt();
        [mean, error, f64::from(found) / n]
    }

    /// Orders that few wait for have the mean that they have when all do: three
    /// differences at 4.5 standard errors, a false alarm in 50 000 seeds.
    #[test]
    fn dark_facets_are_walked_seldom_and_keep_the_mean() {
        let dark = Color::splat(0.3);
        let plastic = ConductorFresnel::Dielectric {
            eta: 1.5,
            f0: Color::splat(0.04),
            f90: Color::white(),
        };
        for (alpha, fresnel) in [
            (0.25, plastic),
            (0.1, plastic),
            (0.1, ConductorFresnel::Constant(dark)),
        ] {
            let surface = Microsurface {
                ndf: Ggx::isotropic(alpha),
                facets: Conductor { fresnel },
            };
            let [all, thinned] = [Method::Multiple, Method::Thinned]
                .map(|method| higher(surface, method(Estimator::PositionFree)));
            let apart = (all[0] - thinned[0]) / all[1].hypot(thinned[1]);
            assert!(apart.abs() < 4.5, "{alpha} {fresnel:?}: {apart} σ");
            assert!(all[0] > 10.0 * all[1], "{all:?}");
            assert!(thinned[2] < 0.2 * all[2], "{alpha}: {thinned:?} {all:?}");
        }
    }
}
