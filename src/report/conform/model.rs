//! What the model says to a row.

use std::f64::consts::PI;

use smithwalk_model::{
    Conductor, ConductorFresnel, Dielectric, Diffuse, Draw, Estimator, Facets, Microsurface, Rgb,
    Total, Vector3,
};
use smithwalk_validation::Distribution;
use smithwalk_validation::points::{REPLICATES, Sobol, replicated};
use smithwalk_validation::statistics::Mean;

use super::{Claim, Facet, Quantity};

/// The check's number among those that draw from the same streams.
const CHECK: u64 = 0xc0f0;

/// The value of row `index`, over `samples` scrambled Sobol points in
/// [`REPLICATES`] sets.
pub fn measure(claim: &Claim, index: usize, samples: u32) -> Mean {
    match claim.facets {
        Facet::Conductor => {
            let fresnel = ConductorFresnel::Constant(Rgb([claim.color; 3]));
            of(claim, Conductor { fresnel }, index, samples)
        }
        Facet::Dielectric { eta } => {
            let tint = Rgb([claim.color; 3]);
            let eta = if claim.from_inside() {
                eta.recip()
            } else {
                eta
            };
            of(claim, Dielectric { eta, tint }, index, samples)
        }
        Facet::Diffuse => {
            let albedo = Rgb([claim.color; 3]);
            of(claim, Diffuse { albedo }, index, samples)
        }
    }
}

fn of(claim: &Claim, facets: impl Facets<Scalar = f64>, index: usize, samples: u32) -> Mean {
    let ndf: Distribution = claim.normals.into();
    let surface = Microsurface { ndf, facets };
    let each = samples.div_ceil(REPLICATES);
    let seed = (index as u32).wrapping_mul(REPLICATES);
    // Seen from inside, z is turned.
    let upright = |[cos, phi]: [f64; 2]| {
        let cos = if claim.from_inside() { -cos } else { cos };
        Vector3::spherical(cos, phi)
    };
    let walk = |wi: Vector3<f64>, reflected: bool, rng: &mut Sobol| -> f64 {
        let exit = if claim.single {
            surface.sample_single(wi, rng)
        } else {
            surface.sample(wi, rng)
        };
        let counted = exit.filter(|exit| (exit.direction.z > 0.0) == reflected);
        counted.map_or(0.0, |exit| exit.weight.0[0])
    };
    let sum = |estimate: &mut dyn FnMut(&mut Sobol) -> f64| replicated(CHECK, seed, each, estimate);
    match claim.quantity {
        Quantity::Albedo { wi } => sum(&mut |rng| walk(upright(wi), true, rng)),
        Quantity::Transmitted { wi } => sum(&mut |rng| walk(upright(wi), false, rng)),
        // ∫ E cosθ dω/π: cosθ is the root of a uniform number.
        Quantity::MeanAlbedo => sum(&mut |rng| {
            let (cos, phi): (f64, f64) = (rng.draw(), rng.draw());
            let wi = Vector3::spherical((1.0 - cos).sqrt(), 2.0 * PI * phi);
            walk(wi, true, rng)
        }),
        Quantity::F { wi, wo } => {
            let (wi, wo) = (upright(wi), upright(wo));
            sum(&mut |rng| {
                let value = if claim.single {
                    surface.eval_single(wi, wo, rng)
                } else {
                    let mut total = Total::default();
                    surface.eval(Estimator::PositionFree, wi, wo, rng, &mut total);
                    total.0
                };
                value.0[0] / wo.z.abs()
            })
        }
    }
}
