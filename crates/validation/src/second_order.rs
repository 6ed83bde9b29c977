//! Statement 13: the second order of mirrors by quadrature, which no random number has a
//! part in.
//!
//! Light from ω_i is turned by two facets, with the direction d between them. The
//! depth enters by exponentials alone, so its mean is closed and an integral over d is
//! left:
//!
//! f₂ cosθ_o = ∫ [F D(h) / 4σ(ω_i)] [F′ D(h′) / 4σ(−d)] S(d) dω_d,
//!
//! with h between ω_i and d, and h′ between −d and ω_o. The first facet is at a depth of
//! the rate a = 1 + Λ(ω_i), and d meets others at the rate r = σ(−d)/|d_z|. Going down
//! adds an exponential depth, and the light gets out with the chance
//! S = a/(a + Λ_o) · r/(r + Λ_o). Going up it collides before the top with the chance
//! r/(a + r), at a depth that is of rate a again: S = r/(a + r) · a/(a + Λ_o).

use super::check::{Case, Check, Statement};
use super::grid::Effort;
use super::model::{Distribution, Model, Rng, stream, uniform};
use super::plot::PlotError;
use super::points::{REPLICATES, replicated};
use super::statistics::{Mean, gauss};
use rayon::prelude::*;
use smithwalk_model::{
    Beckmann, Conductor, ConductorFresnel, Estimator, Ggx, Microsurface, Ndf, NdfInLanes, PerOrder,
    Rgb, Vector3,
};
use std::f64::consts::{PI, TAU};

/// Points along each of the two parts of d_z to begin with, and the most; twice as many
/// in the azimuth.
const POINTS: (usize, usize) = (32, 1024);

/// The azimuths are gathered on a scale of this times the distance in d_z.
const GATHERED: f64 = 1.0;

/// The relative change, from one number of points to twice as many, at which the finer
/// sum is taken.
const CHANGE: f64 = 2e-6;

/// f₂(ω_i, ω_o) cosθ_o in sr⁻¹, and the relative change from half as many points.
///
/// Both facets face up for −cosθ_i < d_z < cosθ_o alone, and the integrand is smooth in
/// d_z but for these ends and 0: Gauss–Legendre quadrature on both parts. At either end
/// is a point, d = −ω_i or ω_o, at which the facet is grazed and its normal anything; so
/// the nearer to the end, the more the azimuths are gathered about this point.
pub fn second_order<N: Ndf<Scalar = f64>>(
    ndf: &N,
    fresnel: &ConductorFresnel<f64>,
    wi: Vector3<f64>,
    wo: Vector3<f64>,
) -> (Rgb<f64>, f64) {
    let mut points = POINTS.0;
    let mut coarse = sum(ndf, fresnel, wi, wo, points);
    loop {
        points *= 2;
        let fine = sum(ndf, fresnel, wi, wo, points);
        let change = [0, 1, 2].map(|c| (coarse.0[c] - fine.0[c]).abs() / fine.0[c]);
        let change = change.into_iter().fold(0.0, f64::max);
        if change <= CHANGE || points >= POINTS.1 {
            return (fine, change);
        }
        coarse = fine;
    }
}

fn sum<N: Ndf<Scalar = f64>>(
    ndf: &N,
    fresnel: &ConductorFresnel<f64>,
    wi: Vector3<f64>,
    wo: Vector3<f64>,
    points: usize,
) -> Rgb<f64> {
    let sigma = ndf.projected_area(wi);
    let rate = sigma / wi.z;
    let lambda = ndf.lambda(wo);
    let gets_out = rate / (rate + lambda);
    let mut total = Rgb::black();
    let turns = gauss(2 * points);
    for (x, weight) in gauss(points) {
        // From the grazed point towards level.
        for grazed in [-wi, wo] {
            let z = grazed.z * (1.0 - x);
            let middle = grazed.y.atan2(grazed.x);
            let scale = (GATHERED * x * grazed.z.abs()).min(1.0);
            let end = (PI / scale).asinh();
            let mut ring = Rgb::black();
            for &(t, weight) in &turns {
                let s = end * (2.0 * t - 1.0);
                let d = Vector3::spherical(z, middle + scale * s.sinh());
                let (h, there) = (wi + d, wo - d);
                let facets = ndf.density(h.normalized()) * ndf.density(there.normalized());
                if facets > 0.0 {
                    let back = ndf.projected_area(-d);
                    // S/σ(−d) without the factor of `gets_out`, with r multiplied out.
                    let stays = if z < 0.0 { -lambda * z } else { rate * z };
                    let tint = fresnel.reflectance(0.5 * h.length())
                        * fresnel.reflectance(0.5 * there.length());
                    ring += tint * (weight * s.cosh() * facets / (back + stays));
                }
            }
            total += ring * (weight * grazed.z.abs() * 2.0 * end * scale);
        }
    }
    total * (gets_out / (16.0 * sigma))
}

/// A metal and two directions.
#[derive(Clone, Copy, Debug)]
struct Configuration {
    distribution: Distribution,
    fresnel: ConductorFresnel<f64>,
    wi: Vector3<f64>,
    wo: Vector3<f64>,
    /// The channel that is compared.
    channel: usize,
}

/// Configurations that are compared.
const CONFIGURATIONS: usize = 40;

/// The least cosine of their directions. Where one is more grazing, and on smoother
/// surfaces, walks from one end come upon the paths that matter so rarely that their
/// own error is not to be trusted.
const LEAST_COSINE: f64 = 0.3;

impl Configuration {
    /// GGX and Beckmann in turn, of complex indices and others.
    fn all() -> Vec<Self> {
        let alphas = [(0.4, 0.4), (0.6, 0.6), (1.0, 1.0), (1.5, 1.5), (0.9, 0.5)];
        let rgb = Rgb::<f64>;
        let fresnels = [
            // Gold, and an index that dips.
            ConductorFresnel::Complex {
                eta: rgb([0.143, 0.374, 1.442]),
                k: rgb([3.983, 2.386, 1.603]),
            },
            ConductorFresnel::Complex {
                eta: rgb([2.9, 1.5, 0.05]),
                k: rgb([3.1, 0.2, 1.0]),
            },
            ConductorFresnel::F82 {
                f0: rgb([0.9, 0.6, 0.5]),
                f82: rgb([0.8, 0.6, 0.9]),
            },
        ];
        let mut rng: Rng = stream(13, 0);
        let mut direction = || {
            let cos = LEAST_COSINE + (1.0 - LEAST_COSINE) * uniform(&mut rng);
            Vector3::spherical(cos, TAU * uniform(&mut rng))
        };
        let each = |i: usize| {
            let (alpha_x, alpha_y) = alphas[i / 2 % alphas.len()];
            Self {
                distribution: if i % 2 == 0 {
                    Distribution::Ggx(Ggx { alpha_x, alpha_y })
                } else {
                    Distribution::Beckmann(Beckmann { alpha_x, alpha_y })
                },
                fresnel: fresnels[i % fresnels.len()],
                wi: direction(),
                wo: direction(),
                channel: i / 3 % 3,
            }
        };
        (0..CONFIGURATIONS).map(each).collect()
    }

    fn name(&self) -> String {
        let (from, to) = (self.wi.z, self.wo.z);
        format!("{}, cosθ {from:.3} to {to:.3}", self.distribution.name())
    }

    fn exact(&self) -> f64 {
        let (value, _) = second_order(&self.distribution, &self.fresnel, self.wi, self.wo);
        value.0[self.channel]
    }

    /// The second order alone.
    fn second<F: Copy + Into<f64>>(&self, orders: &PerOrder<F>) -> f64 {
        let second = orders.0.get(1);
        second.map_or(0.0, |value| value.0[self.channel].into())
    }

    /// The estimator's mean.
    fn estimate<M: Model>(
        &self,
        model: M,
        estimator: Estimator,
        samples: u32,
        index: usize,
    ) -> Mean {
        let surface = Microsurface {
            ndf: model.ndf(self.distribution),
            facets: model.metal(self.fresnel),
        };
        let seed = index as u32 * REPLICATES;
        replicated(130 + estimator as u64, seed, samples, |points| {
            let mut orders = PerOrder::default();
            model.eval(&surface, estimator, self.wi, self.wo, points, &mut orders);
            self.second(&orders)
        })
    }

    /// The mean of eight walks at a time, which are in single precision.
    fn in_lanes(&self, samples: u32, index: usize) -> Mean {
        let fresnel = self.fresnel.to_single();
        let facets = Conductor { fresnel };
        let (x, y) = self.distribution.alpha();
        let (alpha_x, alpha_y) = (x as f32, y as f32);
        if matches!(self.distribution, Distribution::Beckmann(_)) {
            let ndf = Beckmann { alpha_x, alpha_y };
            self.mean_in_lanes(&Microsurface { ndf, facets }, samples, index)
        } else {
            let ndf = Ggx { alpha_x, alpha_y };
            self.mean_in_lanes(&Microsurface { ndf, facets }, samples, index)
        }
    }

    fn mean_in_lanes<N: NdfInLanes>(
        &self,
        surface: &Microsurface<N, Conductor<f32>>,
        samples: u32,
        index: usize,
    ) -> Mean {
        let [wi, wo] = [self.wi, self.wo].map(|w| Vector3::new(w.x as f32, w.y as f32, w.z as f32));
        replicated(139, index as u32 * REPLICATES, samples, |points| {
            let mut orders = PerOrder::default();
            surface.eval_multiple_in_lanes(wi, wo, points, &mut orders);
            self.second(&orders)
        })
    }
}

/// The deviation of all lanes together from quadrature, relative, each configuration
/// weighted by its precision; its standard error; and the scores one by one. `samples`
/// is for each of 32 scramblings of each configuration.
pub fn pooled_lanes(samples: u32) -> (f64, f64, Vec<Case>) {
    let all = Configuration::all();
    let all = all.par_iter().enumerate().map(|(i, configuration)| {
        let exact = configuration.exact();
        let mean = configuration.in_lanes(samples, i);
        (
            configuration.name(),
            mean.mean / exact - 1.0,
            mean.error() / exact,
        )
    });
    let all: Vec<_> = all.collect();
    let weights: f64 = all.iter().map(|(_, _, error)| error.powi(-2)).sum();
    let sum: f64 = all.iter().map(|(_, off, error)| off / error.powi(2)).sum();
    let scores = all
        .into_iter()
        .map(|(name, off, error)| Case::new(name, off / error));
    (sum / weights, weights.sqrt().recip(), scores.collect())
}

/// Statement 13.
pub fn against_quadrature<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let all = Configuration::all();
    let freedom = f64::from(REPLICATES - 1);
    let exact: Vec<_> = all.par_iter().map(Configuration::exact).collect();
    let samples = effort.pick(256, 8192);
    let mut checks = Vec::new();
    for estimator in [Estimator::Walk, Estimator::TwoWalk, Estimator::PositionFree] {
        let scores = all.par_iter().zip(&exact).enumerate();
        let scores = scores.map(|(i, (configuration, &exact))| {
            let mean = configuration.estimate(model, estimator, samples, i);
            Case::new(configuration.name(), mean.score(exact))
        });
        checks.push(Check::student_scores(
            format!("{estimator:?} against quadrature"),
            freedom,
            scores.collect(),
        ));
    }
    let (pooled, error, scores) = pooled_lanes(samples);
    checks.push(Check::student_scores(
        "eight walks at a time against quadrature",
        freedom,
        scores,
    ));
    checks.push(Check::deviations(
        "the same, all together",
        effort.pick(2e-3, 5e-4),
        vec![Case::new(format!("standard error {error:.1e}"), pooled)],
    ));
    Ok(Statement {
        number: 13,
        title: "Mirrors: the second order is its integral over one direction",
        equation: "f₂ cosθₒ = ∫ F D(h)/(4σ(ωᵢ)) · F′ D(h′)/(4σ(−d)) · S(d) dω_d",
        checks,
        figures: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_converges() {
        for configuration in Configuration::all() {
            let Configuration {
                distribution,
                fresnel,
                wi,
                wo,
                ..
            } = configuration;
            let (there, change) = second_order(&distribution, &fresnel, wi, wo);
            assert!(change <= CHANGE, "{configuration:?}: {change}");
            // f(ω_i, ω_o) = f(ω_o, ω_i)
            let (back, _) = second_order(&distribution, &fresnel, wo, wi);
            for (there, back) in there.0.into_iter().zip(back.0) {
                let off = there * wi.z / (back * wo.z) - 1.0;
                assert!(off.abs() < 2.0 * CHANGE, "{configuration:?}: {off}");
            }
        }
    }

    /// A rare first bounce: 3·10⁵ walks from ω_i alone say 3.0e-7 ± 0.1e-7.
    #[test]
    fn quadrature_knows_what_walks_miss() {
        let ndf = Beckmann {
            alpha_x: 0.2236,
            alpha_y: 0.8429,
        };
        let white = ConductorFresnel::Constant(Rgb::white());
        let wi = Vector3::spherical(0.4572, 5.8043);
        let wo = Vector3::spherical(0.6378, 4.6332);
        let (value, change) = second_order(&ndf, &white, wi, wo);
        assert!(change <= CHANGE);
        assert!((value.0[0] / 4.559e-7 - 1.0).abs() < 1e-3, "{value:?}");
        let mut rng = stream(1313, 0);
        let mut mean = Mean::default();
        let facets = Conductor { fresnel: white };
        for _ in 0..200_000 {
            let mut orders = PerOrder::default();
            let surface = Microsurface { ndf, facets };
            surface.eval(Estimator::TwoWalk, wi, wo, &mut rng, &mut orders);
            mean.add(orders.0.get(1).map_or(0.0, |value| value.0[0]));
        }
        let score = mean.score(value.0[0]);
        assert!(score.abs() < 3.9, "{} ± {}", mean.mean, mean.error());
    }

    /// `cargo test --release -p smithwalk-validation -- --ignored --nocapture pooled`
    #[test]
    #[ignore = "takes minutes"]
    fn pooled_lanes_have_four_digits() {
        let (off, error, _) = pooled_lanes(1 << 13);
        println!("relative error of all lanes together: {off:.2e} ± {error:.1e}");
        assert!(off.abs() <= 5e-5 && error <= 2.5e-5, "{off} ± {error}");
    }
}
