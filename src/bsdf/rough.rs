//! Rough surfaces: the Smith microsurface model behind the closure contract.

use glam::Vec3;

use super::{Albedos, BsdfSample, MeanWeight, Width, from_model, to_model};
use crate::color::Rgb;
use crate::microsurface::{Draw, Estimator, Microsurface, Tally};

/// How a rough surface's scattering is computed.
#[derive(Clone, Copy, Debug)]
pub enum Method {
    /// All orders, by this estimator.
    Multiple(Estimator),
    /// The first order alone: what meets a second facet is lost.
    Single,
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

impl<N: Width, I: MeanWeight> Rough<N, I> {
    /// One walk, or one visible normal for single scattering.
    #[inline]
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
        let exit = match self.method {
            Method::Multiple(_) => self.surface.sample(to_model(wo), rng),
            Method::Single => self.surface.sample_single(to_model(wo), rng),
            Method::Compensated(albedos) => {
                let mut exit = self.surface.sample_single(to_model(wo), rng)?;
                exit.weight *= albedos.scale(&self.surface, wo.z);
                Some(exit)
            }
        }?;
        Some(BsdfSample {
            wi: from_model(exit.direction),
            weight: Rgb::from(exit.weight.0),
            order: exit.order,
        })
    }

    /// Adds an unbiased estimate of f·|cosθ_i|, sr⁻¹, to `tally`, order by order;
    /// all that compensation adds counts as first order.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, rng: &mut impl Draw<f32>, tally: &mut impl Tally<f32>) {
        let (wo, wi) = (to_model(wo), to_model(wi));
        match self.method {
            Method::Multiple(estimator) => self.surface.eval(estimator, wo, wi, rng, tally),
            Method::Single => tally.add(1, self.surface.eval_single(wo, wi, rng)),
            Method::Compensated(albedos) => {
                let scale = albedos.scale(&self.surface, wo.z);
                tally.add(1, self.surface.eval_single(wo, wi, rng) * scale);
            }
        }
    }

    /// The density that stands in for the sampler's, sr⁻¹.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (wo, wi) = (to_model(wo), to_model(wi));
        match self.method {
            Method::Multiple(_) => self.surface.pdf(wo, wi),
            Method::Single | Method::Compensated(_) => self.surface.pdf_single(wo, wi),
        }
    }
}
