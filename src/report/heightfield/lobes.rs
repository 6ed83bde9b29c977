//! Where light goes: outgoing directions by scattering order.

use rayon::prelude::*;

use super::departure::{Departure, Distance, Estimate};
use super::field::{Patch, Random, stream};
use super::{Config, HeightFieldError};
use smithwalk_model::{
    Beckmann, Conductor, ConductorFresnel, Dielectric, Diffuse, Draw, Exit, Facets, Microsurface,
    Rgb, Vector3,
};

/// Orders that are told apart; the last one takes all higher ones as well.
pub const ORDERS: usize = 5;

/// Bins of the angle ψ over [−90°, 90°].
pub const PSI_BINS: usize = 36;

/// Reflected and transmitted.
const SIDES: usize = 2;

/// The material of the facets, without loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Mirrors of reflectance 1.
    Conductor,
    /// A dielectric with this relative index, n(below) / n(above).
    Dielectric(f64),
    /// Lambertian with reflectance 1.
    Diffuse,
}

/// One scattering order's light on one side of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Lobe {
    /// Number of facets met, ≥ 1; [`ORDERS`] stands for that many and more.
    pub order: usize,
    /// Whether it came out below.
    pub transmitted: bool,
    /// The share of the incident light, on the surface.
    pub share: Estimate,
    /// The same in the model.
    pub share_model: Estimate,
    /// Share of the incident light per radian of ψ, on the surface: ψ is the
    /// angle from the surface's axis, ±z, of a direction's projection into
    /// the plane of incidence, positive away from the light.
    pub surface: Vec<Estimate>,
    /// The same in the model.
    pub model: Vec<Estimate>,
}

/// The light that one incident direction sends out.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeCase {
    /// Facets.
    pub facets: Material,
    /// Slope roughness along x and y.
    pub alpha: [f64; 2],
    /// cosθ of the incident direction, which is in the xz plane.
    pub cos: f64,
    /// Reflected light by order, then transmitted light (dielectrics alone).
    pub lobes: Vec<Lobe>,
    /// Total variation distance of the shares of the orders, reflected and
    /// transmitted.
    pub shares: Departure,
    /// Total variation distance of the first order's directions (ψ and side),
    /// both normalised to the order's share.
    pub single: Departure,
    /// The same for all higher orders together.
    pub multiple: Departure,
    /// Rays that rounding lost, of all that were traced.
    pub lost: u64,
}

/// What defines a case, and the departures that long runs found for it.
struct Setting {
    facets: Material,
    alpha: [f64; 2],
    cos: f64,
    /// Of shares, single and multiple scattering.
    tabulated: [f64; 3],
}

const fn setting(facets: Material, alpha: f64, cos: f64, tabulated: [f64; 3]) -> Setting {
    Setting {
        facets,
        alpha: [alpha; 2],
        cos,
        tabulated,
    }
}

const GLASS: Material = Material::Dielectric(1.5);
const OUT_OF_GLASS: Material = Material::Dielectric(1.0 / 1.5);

const SETTINGS: [Setting; 16] = [
    setting(Material::Conductor, 0.5, 0.5, [0.016, 0.005, 0.103]),
    setting(Material::Conductor, 0.5, 0.2, [0.020, 0.016, 0.168]),
    setting(Material::Conductor, 1.0, 1.0, [0.027, 0.008, 0.069]),
    setting(Material::Conductor, 1.0, 0.5, [0.035, 0.019, 0.043]),
    setting(Material::Conductor, 1.0, 0.2, [0.027, 0.018, 0.117]),
    Setting {
        alpha: [1.0, 0.25],
        ..setting(Material::Conductor, 1.0, 0.5, [0.026, 0.017, 0.249])
    },
    setting(GLASS, 0.5, 0.5, [0.005, 0.005, 0.096]),
    setting(GLASS, 0.5, 0.2, [0.017, 0.022, 0.112]),
    setting(GLASS, 1.0, 1.0, [0.002, 0.003, 0.052]),
    setting(GLASS, 1.0, 0.5, [0.028, 0.025, 0.176]),
    setting(OUT_OF_GLASS, 0.5, 0.5, [0.020, 0.010, 0.057]),
    setting(OUT_OF_GLASS, 1.0, 0.5, [0.030, 0.023, 0.037]),
    setting(Material::Diffuse, 0.5, 0.5, [0.002, 0.005, 0.025]),
    setting(Material::Diffuse, 1.0, 1.0, [0.003, 0.005, 0.013]),
    setting(Material::Diffuse, 1.0, 0.5, [0.011, 0.016, 0.026]),
    setting(Material::Diffuse, 1.0, 0.2, [0.021, 0.020, 0.033]),
];

/// Energy by order, side and ψ, per unit of incident light; and rays lost.
struct Histogram {
    bins: Vec<f64>,
    lost: u64,
}

impl Histogram {
    /// Of `count` exits; `None` is light that got lost.
    fn of(count: usize, mut exit: impl FnMut() -> Option<Exit<f64>>) -> Self {
        let mut histogram = Self {
            bins: vec![0.0; ORDERS * SIDES * PSI_BINS],
            lost: 0,
        };
        for _ in 0..count {
            match exit() {
                Some(exit) => histogram.bins[bin(&exit)] += exit.weight.0[0] / count as f64,
                None => histogram.lost += 1,
            }
        }
        histogram
    }
}

/// Light comes from +x, so ψ > 0 is at x < 0.
fn bin(exit: &Exit<f64>) -> usize {
    let w = exit.direction;
    let psi = (-w.x).atan2(w.z.abs()) / std::f64::consts::PI + 0.5;
    let psi = ((psi * PSI_BINS as f64) as usize).min(PSI_BINS - 1);
    let order = (exit.order as usize).clamp(1, ORDERS) - 1;
    (order * SIDES + usize::from(w.z < 0.0)) * PSI_BINS + psi
}

/// The bins of one order (from 0) and side.
fn range(order: usize, side: usize) -> std::ops::Range<usize> {
    let first = (order * SIDES + side) * PSI_BINS;
    first..first + PSI_BINS
}

/// A pair of histograms that share a realisation's number and nothing else.
struct Batch {
    surface: Histogram,
    model: Histogram,
}

impl Setting {
    fn batch(&self, patch: &Patch, config: &Config, rng: &mut Random) -> Batch {
        let white = Rgb::white();
        match self.facets {
            Material::Conductor => {
                let fresnel = ConductorFresnel::Constant(white);
                self.trace(Conductor { fresnel }, patch, config, rng)
            }
            Material::Dielectric(eta) => {
                self.trace(Dielectric { eta, tint: white }, patch, config, rng)
            }
            Material::Diffuse => self.trace(Diffuse { albedo: white }, patch, config, rng),
        }
    }

    fn trace<I: Facets<Scalar = f64>>(
        &self,
        facets: I,
        patch: &Patch,
        config: &Config,
        rng: &mut Random,
    ) -> Batch {
        let wi = Vector3::spherical(self.cos, 0.0);
        let surface = Histogram::of(config.rays, || {
            let place = [rng.draw(), rng.draw()];
            patch.walk(&facets, wi, place, rng)
        });
        let [alpha_x, alpha_y] = self.alpha;
        let model = Microsurface {
            ndf: Beckmann { alpha_x, alpha_y },
            facets,
        };
        let walks = config.rays * config.walks_per_ray;
        Batch {
            surface,
            model: Histogram::of(walks, || model.sample(wi, rng)),
        }
    }

    fn case(&self, batches: &[Batch]) -> LobeCase {
        let transmits = matches!(self.facets, Material::Dielectric(_));
        let lobes = (0..=usize::from(transmits))
            .flat_map(|side| (0..ORDERS).map(move |order| (order, side)))
            .map(|(order, side)| lobe(batches, order, side))
            .collect();
        let [shares, single, multiple] = self.tabulated;
        let by_share = |h: &Histogram| -> Vec<f64> { h.bins.chunks(PSI_BINS).map(sum).collect() };
        // The orders `from..to` summed, and scaled to a sum of 1.
        let by_direction = |h: &Histogram, from: usize, to: usize| -> Vec<f64> {
            let mut bins = vec![0.0; SIDES * PSI_BINS];
            for order in from..to {
                for (bin, value) in bins.iter_mut().zip(&h.bins[range(order, 0).start..]) {
                    *bin += value;
                }
            }
            let total = sum(&bins).max(f64::MIN_POSITIVE);
            bins.iter().map(|b| b / total).collect()
        };
        let departure = |of: &dyn Fn(&Histogram) -> Vec<f64>, tabulated| {
            let differences: Vec<Vec<f64>> = batches
                .iter()
                .map(|b| {
                    let pair = of(&b.surface).into_iter().zip(of(&b.model));
                    pair.map(|(surface, model)| surface - model).collect()
                })
                .collect();
            Departure::new(&differences, Distance::TotalVariation, tabulated)
        };
        LobeCase {
            facets: self.facets,
            alpha: self.alpha,
            cos: self.cos,
            lobes,
            shares: departure(&by_share, shares),
            single: departure(&|h| by_direction(h, 0, 1), single),
            multiple: departure(&|h| by_direction(h, 1, ORDERS), multiple),
            lost: batches.iter().map(|b| b.surface.lost).sum(),
        }
    }
}

fn lobe(batches: &[Batch], order: usize, side: usize) -> Lobe {
    let bins = range(order, side);
    let share = |of: fn(&Batch) -> &Histogram| {
        Estimate::of(batches.iter().map(|b| sum(&of(b).bins[bins.clone()])))
    };
    let width = std::f64::consts::PI / PSI_BINS as f64;
    let density = |of: fn(&Batch) -> &Histogram| {
        bins.clone()
            .map(|i| Estimate::of(batches.iter().map(|b| of(b).bins[i] / width)))
            .collect()
    };
    Lobe {
        order: order + 1,
        transmitted: side == 1,
        share: share(|b| &b.surface),
        share_model: share(|b| &b.model),
        surface: density(|b| &b.surface),
        model: density(|b| &b.model),
    }
}

fn sum(values: &[f64]) -> f64 {
    values.iter().sum()
}

/// The light that leaves the surface and the model by scattering order,
/// reflected and transmitted, for facets that are mirrors, dielectric and
/// diffuse.
///
/// # Errors
/// When Embree is missing or out of memory, or `config` makes no surface.
pub fn outgoing_lobes(config: &Config) -> Result<Vec<LobeCase>, HeightFieldError> {
    config.check()?;
    let mut batches: Vec<Vec<Batch>> = SETTINGS.iter().map(|_| Vec::new()).collect();
    let mut alphas: Vec<[f64; 2]> = Vec::new();
    for setting in &SETTINGS {
        if !alphas.contains(&setting.alpha) {
            alphas.push(setting.alpha);
        }
    }
    config.over_patches(&alphas, |realisation, alpha, patch| {
        let here: Vec<(usize, Batch)> = SETTINGS
            .par_iter()
            .enumerate()
            .filter(|(_, setting)| setting.alpha == alpha)
            .map(|(index, setting)| {
                let part = (((index + 1) << 40) | realisation) as u64;
                let mut rng = stream(config.seed, part);
                (index, setting.batch(patch, config, &mut rng))
            })
            .collect();
        for (index, batch) in here {
            batches[index].push(batch);
        }
    })?;
    Ok(SETTINGS
        .iter()
        .zip(&batches)
        .map(|(setting, batches)| setting.case(batches))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check can fail: a model of half the roughness of the surface.
    #[test]
    fn a_wrong_roughness_departs_too_far() {
        let config = Config::quick();
        let right = &SETTINGS[4];
        let wrong = Setting {
            alpha: [0.5; 2],
            ..*right
        };
        let mut batches = [Vec::new(), Vec::new()];
        config
            .over_patches(&[right.alpha], |realisation, _, patch| {
                for (setting, batches) in [right, &wrong].into_iter().zip(&mut batches) {
                    let mut rng = stream(6, realisation as u64);
                    batches.push(setting.batch(patch, &config, &mut rng));
                }
            })
            .expect("a surface");
        let departures = |case: LobeCase| [case.shares, case.single, case.multiple];
        let right = departures(right.case(&batches[0]));
        let wrong = departures(wrong.case(&batches[1]));
        assert!(right.iter().all(|d| d.holds(1e-4)), "{right:#?}");
        assert!(!wrong[1].holds(1e-4), "{wrong:#?}");
    }
}
