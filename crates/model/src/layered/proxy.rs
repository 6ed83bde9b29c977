//! A density in closed form that follows a stack, for multiple importance
//! sampling.

use super::Layered;
use crate::fresnel;
use crate::{At, Conductor, ConductorFresnel, Facets, Ggx, Microsurface, Ndf, Real, Rgb, Side};
use crate::{GRAZING, Vector3};
use smallvec::SmallVec;

/// The least share of the cosine lobe, for light that takes the long way: it
/// keeps the density positive where the others underflow.
const LEAST_SHARE: f64 = 0.02;

/// Cosines below this count as this where spreads are compared.
const LEAST_COS: f64 = 0.1;

/// The least slope roughness of a lobe.
const LEAST_ALPHA: f64 = 1e-4;

/// A part of the density that integrates to 1 over its side of the stack.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobe<F> {
    /// Its share of the density.
    pub share: F,
    /// The side of the stack that it fills.
    pub side: Side,
    /// How it is spread.
    pub shape: Shape<F>,
}

/// How a lobe is spread over its hemisphere.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape<F> {
    /// ∝ cosθ.
    Cosine,
    /// That of a GGX mirror seen from the unit vector `from` (above it), with
    /// what goes on into the surface folded back at the horizon.
    Mirror {
        /// Its normals.
        ndf: Ggx<F>,
        /// Where it is seen from.
        from: Vector3<F>,
    },
}

impl<F: Real> Shape<F> {
    /// The density (sr⁻¹) at `o`, above the horizon.
    fn density(&self, o: Vector3<F>) -> F {
        match *self {
            Self::Cosine => o.z * F::FRAC_1_PI(),
            Self::Mirror { ndf, from } => {
                let facets = Conductor {
                    fresnel: ConductorFresnel::Constant(Rgb::white()),
                };
                let at = At {
                    side: Side::Above,
                    w: from,
                    sigma: ndf.projected_area(from),
                };
                let folded = Vector3::new(o.x, o.y, -o.z);
                let towards = |o| facets.phase(&ndf, at, o, false, from).density;
                towards(o) + towards(folded)
            }
        }
    }
}

/// How far slopes of roughness α move the light that leaves: squares of
/// transverse momentum n sinθ, along x and y.
type Spread<F> = [F; 2];

/// `spread` and what slopes `alphas` add that change the momentum by `lever`
/// per unit of slope.
fn widened<F: Real>(spread: Spread<F>, alphas: [F; 2], lever: F) -> Spread<F> {
    let part = |k: usize| {
        let moved = alphas[k] * lever;
        spread[k] + moved * moved
    };
    [part(0), part(1)]
}

impl<F: Real> Layered<F> {
    /// A density (sr⁻¹, no cosine) that is positive wherever [`Layered::eval`]
    /// is and integrates to 1; 0 everywhere on a stack that
    /// [`Layered::is_delta`].
    ///
    /// A mixture with a lobe for each surface off which light comes straight
    /// back: it goes down through smooth media, loses what Fresnel's formulas
    /// say, and is spread by every rough surface on the way. Diffuse light and
    /// that of longer ways is a cosine lobe.
    ///
    /// Weighting two strategies by it is unbiased, as long as both use it;
    /// [`Layered::sample`] has a weight of its own.
    pub fn pdf(&self, wi: Vector3<F>, wo: Vector3<F>) -> F {
        if self.entry(wi).is_none() || self.entry(wo).is_none() {
            return F::zero();
        }
        let (side, o) = if wo.z > F::zero() {
            (Side::Above, wo)
        } else {
            (Side::Below, -wo)
        };
        let mut sum = F::zero();
        for lobe in self.lobes(wi) {
            if lobe.side == side {
                sum += lobe.share * lobe.shape.density(o);
            }
        }
        sum
    }

    /// The lobes for light from `wi`, which can enter. Those below the stack
    /// are given point-reflected.
    pub(crate) fn lobes(&self, wi: Vector3<F>) -> SmallVec<[Lobe<F>; 4]> {
        let mut lobes = SmallVec::new();
        if self.is_delta() {
            return lobes;
        }
        let (one, two, half) = (F::one(), F::of(2.0), F::of(0.5));
        let entered = if wi.z > F::zero() {
            Side::Above
        } else {
            Side::Below
        };
        let from = if wi.z > F::zero() { wi } else { -wi };
        let count = self.levels.len();
        let outside = self
            .medium(if wi.z > F::zero() { 0 } else { count - 1 }, wi)
            .ior;
        // The light on its way: n, cosθ, its share, and how it has been spread.
        let mut ior = outside;
        let mut cos = from.z;
        let mut share = one;
        let mut spread = [F::zero(); 2];
        let (mut total, mut long) = (F::zero(), F::of(LEAST_SHARE));
        let mut add = |lobes: &mut SmallVec<[Lobe<F>; 4]>, lobe: Lobe<F>| {
            if lobe.share > F::zero() {
                total += lobe.share;
                lobes.push(lobe);
            }
        };
        // A mirror's slopes move the momentum by 2n cosθ times themselves.
        let lever = |ior: F, cos: F| two * ior * cos.max(F::of(LEAST_COS));
        let mirror = |share, side, from: Vector3<F>, ior: F, spread: Spread<F>| {
            let lever = lever(ior, from.z);
            let alpha = spread.map(|s| (s.sqrt() / lever).max(F::of(LEAST_ALPHA)));
            Lobe {
                share: if spread == [F::zero(); 2] {
                    F::zero()
                } else {
                    share
                },
                side,
                shape: Shape::Mirror {
                    ndf: Ggx {
                        alpha_x: alpha[0],
                        alpha_y: alpha[1],
                    },
                    from,
                },
            }
        };
        let mut diffuse = F::zero();
        for step in 0..count {
            let level = match entered {
                Side::Above => step,
                Side::Below => count - 1 - step,
            };
            let mut before = F::zero();
            for (upto, surface) in &self.levels[level].surfaces {
                let part = share * (*upto - before);
                before = *upto;
                let alphas = surface.alphas();
                // Back through all of it a second time.
                let back = spread.map(|s| two * s);
                let tilted = widened(back, alphas, lever(ior, cos));
                if let Some(metal) = surface.metal(cos) {
                    let lobe = mirror(part * metal.max_channel(), entered, from, outside, tilted);
                    add(&mut lobes, lobe);
                } else if let Some(albedo) = surface.albedo() {
                    diffuse += part * albedo.max_channel();
                }
                let rough = Microsurface {
                    ndf: Ggx {
                        alpha_x: alphas[0].max(F::of(LEAST_ALPHA)),
                        alpha_y: alphas[1].max(F::of(LEAST_ALPHA)),
                    },
                    facets: Conductor {
                        fresnel: ConductorFresnel::Constant(Rgb::white()),
                    },
                };
                long += half * part * rough.multiple_share();
                if let Some(eta) = surface.relative_index() {
                    let eta = match entered {
                        Side::Above => eta,
                        Side::Below => eta.recip(),
                    };
                    let (plain, cos_t) = fresnel::dielectric(cos, eta);
                    let reflectance = surface.filmed(entered, cos).unwrap_or(plain);
                    let lobe = mirror(part * reflectance, entered, from, outside, tilted);
                    add(&mut lobes, lobe);
                    let through = ior * eta;
                    spread = widened(spread, alphas, through * cos_t - ior * cos);
                    ior = through;
                    cos = cos_t;
                    share = part * (one - reflectance);
                }
            }
        }
        if self.is_open() && share > F::zero() && cos > F::of(GRAZING) {
            let sin = ((one - cos) * (one + cos)).max(F::zero()).sqrt();
            let across = from.x.hypot(from.y);
            let stretch = if across > F::zero() {
                sin / across
            } else {
                F::zero()
            };
            // The refracted ray leaves along −(x, y); point-reflected, a mirror
            // sends it there that is seen from the other azimuth.
            let from = Vector3::new(-from.x * stretch, -from.y * stretch, cos);
            let lobe = mirror(share, entered.other(), from, ior, spread);
            add(&mut lobes, lobe);
        }
        let sides = if self.is_open() { half } else { one };
        for side in [Side::Above, Side::Below] {
            if side == Side::Above || self.is_open() {
                let mut share = long * sides;
                if side == entered {
                    share += diffuse;
                }
                add(
                    &mut lobes,
                    Lobe {
                        share,
                        side,
                        shape: Shape::Cosine,
                    },
                );
            }
        }
        for lobe in &mut lobes {
            lobe.share /= total;
        }
        lobes
    }
}
