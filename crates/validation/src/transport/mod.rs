//! Statements 6, 7 and 8: energy, reciprocity and single scattering of whole
//! walks.

mod energy;
mod reciprocity;
mod single;

pub use energy::white_furnace;
pub use reciprocity::reciprocal;
pub use single::single_scattering;

use crate::model::{Distribution, Model, Rng, uniform};
use smithwalk_model::{Estimator, Facets, Ggx, Microsurface, Ndf, Vector3};
use std::f64::consts::TAU;

/// The least |ln η| at which refraction bends light enough. With less, light
/// goes nearly straight on, and its phase function is a peak at any roughness.
const LEAST_BEND: f64 = 0.3;

/// Whether the walk's estimates for fixed directions have tails light enough
/// for normal scores: its connections are as high as the lobe of a facet, which
/// refraction makes narrower.
fn wide<I: Facets<Scalar = f64>>(d: Distribution, _: &I, bend: f64) -> bool {
    let least = if I::TRANSMITS { 1.0 } else { 0.5 };
    d.alpha().0.min(d.alpha().1) >= least && bend >= LEAST_BEND
}

/// Runs `$body` with `$facets` as all the model's facets in turn; collects.
/// `$bend` is |ln η|, ∞ for those that do not refract.
macro_rules! each_facets {
    ($model:expr, $effort:expr, |$name:ident, $facets:ident, $bend:ident| $body:expr) => {{
        let mut all = Vec::new();
        {
            let ($name, $facets, $bend) = ("mirror".to_owned(), $model.conductor(), f64::INFINITY);
            all.extend($body);
        }
        {
            let ($name, $facets, $bend) = ("diffuse".to_owned(), $model.diffuse(), f64::INFINITY);
            all.extend($body);
        }
        for &eta in $effort.indices() {
            let name = format!("η {eta:.2}");
            let ($name, $facets, $bend) = (name, $model.dielectric(eta), eta.ln().abs());
            all.extend($body);
        }
        all
    }};
}
use each_facets;

/// The estimators that `facets` have.
fn estimators<I: Facets<Scalar = f64>>(_: &I) -> &'static [Estimator] {
    if I::MIRRORS {
        &[Estimator::Walk, Estimator::TwoWalk, Estimator::PositionFree]
    } else {
        &[Estimator::Walk, Estimator::TwoWalk]
    }
}

/// Whether an integral of evaluations has tails light enough for normal scores
/// with [`Proposal`]: either higher orders have wide lobes, or there are hardly
/// any. What walks carry out is tested everywhere.
fn tame<I: Facets<Scalar = f64>>(d: Distribution, w: Vector3<f64>, _: &I, bend: f64) -> bool {
    let (x, y) = d.alpha();
    let tan = (1.0 - w.z * w.z).max(0.0).sqrt() / w.z;
    let least = if I::TRANSMITS { 0.5 } else { 0.2 };
    (x.min(y) >= least && bend >= LEAST_BEND) || x.max(y) * tan <= 0.5
}

/// Directions to evaluate in: a mixture of uniform ones, of the first bounce,
/// and of that of a surface twice as rough, whose lobes are as wide as those
/// of higher orders.
struct Proposal<N, I> {
    surface: Microsurface<N, I>,
    rougher: Microsurface<N, I>,
}

impl<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>> Proposal<N, I> {
    fn new<M: Model<Ndf = N>>(model: M, d: Distribution, facets: I) -> Self {
        let (x, y) = d.alpha();
        let rougher = Distribution::Ggx(Ggx {
            alpha_x: 2.0 * x,
            alpha_y: 2.0 * y,
        });
        Self {
            surface: Microsurface {
                ndf: model.ndf(d),
                facets,
            },
            rougher: Microsurface {
                ndf: model.ndf(rougher),
                facets,
            },
        }
    }

    /// A direction and its density (sr⁻¹).
    fn pick(&self, wi: Vector3<f64>, rng: &mut Rng) -> Option<(Vector3<f64>, f64)> {
        let shares = if I::CLOSED_PHASE {
            [0.2, 0.5, 0.3]
        } else {
            [1.0, 0.0, 0.0]
        };
        let u = uniform(rng);
        let wo = if u < shares[0] {
            let z = uniform(rng);
            let below = I::TRANSMITS && uniform(rng) < 0.5;
            Vector3::spherical(if below { -z } else { z }, TAU * uniform(rng))
        } else if u < shares[0] + shares[1] {
            self.surface.sample_single(wi, rng)?.direction
        } else {
            self.rougher.sample_single(wi, rng)?.direction
        };
        let sphere = if I::TRANSMITS { 2.0 } else { 1.0 } * TAU;
        let mut density = shares[0] / sphere;
        if I::CLOSED_PHASE {
            density += shares[1] * self.surface.pdf_single(wi, wo);
            density += shares[2] * self.rougher.pdf_single(wi, wo);
        }
        Some((wo, density))
    }
}
