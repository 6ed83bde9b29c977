//! Means that must come out, over samples that fluctuate.

use super::domain::stream;
use smithwalk_model::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// A mean of independent samples with its standard error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    pub value: f64,
    pub error: f64,
}

impl Mean {
    pub fn of(samples: impl Iterator<Item = f64>) -> Self {
        let (mut n, mut value, mut squares) = (0.0, 0.0, 0.0);
        for x in samples {
            // Welford's update, as weights of long walks span many decades.
            n += 1.0;
            let off = x - value;
            value += off / n;
            squares += off * (x - value);
        }
        let error = (squares / (n * (n - 1.0))).sqrt();
        Self { value, error }
    }

    /// The difference from another mean over its standard error.
    pub fn score(self, other: Self) -> f64 {
        (self.value - other.value) / self.error.hypot(other.error)
    }
}

/// The score that the largest of `count` independent normal ones passes with a
/// chance of one in a thousand (Šidák 1967).
pub fn bound(count: usize) -> f64 {
    let each = -(-1e-3f64).ln_1p() / count as f64;
    Normal::standard().inverse_cdf(1.0 - 0.5 * each)
}

fn sampled<N: Ndf<Scalar = f32>, I: Facets<Scalar = f32>>(
    surface: &Microsurface<N, I>,
    wi: Vector3<f32>,
    seed: u64,
    count: u32,
) -> Vec<Option<Exit<f32>>> {
    let mut rng = stream(seed);
    (0..count).map(|_| surface.sample(wi, &mut rng)).collect()
}

/// Walks of thousands of orders end by roulette alone, and it keeps the mean:
/// nothing is lost on diffuse facets of α = 100 and 1000.
#[test]
fn roulette_keeps_the_mean_of_the_longest_walks() {
    let (mut longest, mut most_beyond) = (0, 0);
    for (k, alpha) in [100.0f32, 1000.0].into_iter().enumerate() {
        let surface = Microsurface {
            ndf: Ggx::isotropic(alpha),
            facets: Diffuse {
                albedo: Rgb::white(),
            },
        };
        let exits = sampled(&surface, Vector3::spherical(0.6, 0.0), k as u64, 50_000);
        let mean = Mean::of(
            exits
                .iter()
                .map(|e| e.map_or(0.0, |e| e.weight.0[0].into())),
        );
        let beyond = exits.iter().flatten().filter(|e| e.order > 1 << 14).count();
        longest = exits
            .iter()
            .flatten()
            .map(|e| e.order)
            .max()
            .max(Some(longest))
            .unwrap_or(0);
        println!("diffuse α {alpha}: {mean:?}, {beyond} of 50000 beyond 16384 orders");
        most_beyond = most_beyond.max(beyond);
        // Two comparisons: false alarm 1 in 1000.
        let score = (mean.value - 1.0) / mean.error;
        assert!(score.abs() < bound(2), "α {alpha}: {mean:?}");
    }
    assert!(most_beyond > 50, "no long walks to judge by");
    assert!(longest > 1 << 15, "{longest}");
}

/// Dark walks play from the third order on, once their weight is below 1/16.
/// With the albedo a the mean weight must be E[a^order] of white walks, on
/// both sides of every threshold: a³ = 1/16, a⁴ = 1/16, …
#[test]
fn roulette_keeps_the_mean_of_dark_walks() {
    let albedos = [0.9, 0.5, 0.501, 0.3968, 0.3970, 0.2, 0.05, 1e-3, 1e-12f32];
    let cases = 2 * albedos.len();
    for (k, alpha) in [0.5f32, 1.0].into_iter().enumerate() {
        let surface = |albedo| Microsurface {
            ndf: Ggx::isotropic(alpha),
            facets: Conductor {
                fresnel: ConductorFresnel::Constant(Rgb::splat(albedo)),
            },
        };
        let wi = Vector3::spherical(0.3, 0.0);
        let white = sampled(&surface(1.0), wi, 10 + k as u64, 50_000);
        for (j, albedo) in albedos.into_iter().enumerate() {
            let power =
                |e: &Option<Exit<f32>>| e.map_or(0.0, |e| f64::from(albedo).powi(e.order as i32));
            let expected = Mean::of(white.iter().map(power));
            let seed = 100 + (k * albedos.len() + j) as u64;
            let dark = sampled(&surface(albedo), wi, seed, 100_000);
            let got = Mean::of(dark.iter().map(|e| e.map_or(0.0, |e| e.weight.0[0].into())));
            let score = got.score(expected);
            assert!(
                score.abs() < bound(cases),
                "α {alpha}, albedo {albedo}: {got:?} against {expected:?}"
            );
        }
    }
}

/// Light that grazes glass of nearly the same index goes through thousands of
/// facets, straight on: it must come out below, and nearly all of it.
#[test]
fn grazing_walks_cross_hundreds_of_times_and_come_out_straight() {
    for eta in [1.0 + 1e-5, 1.0 - 1e-5f32] {
        let surface = Microsurface {
            ndf: Ggx::isotropic(1.0f32),
            facets: Dielectric {
                eta,
                tint: Rgb::white(),
            },
        };
        let wi = Vector3::spherical(1e-3, 0.4);
        let exits = sampled(&surface, wi, 3, 20_000);
        let mean = Mean::of(
            exits
                .iter()
                .map(|e| e.map_or(0.0, |e| e.weight.0[0].into())),
        );
        let orders = Mean::of(exits.iter().flatten().map(|e| f64::from(e.order)));
        let crossed = exits.iter().flatten().filter(|e| e.order > 100).count();
        println!("η {eta}: {mean:?}, orders {orders:?}, {crossed} of 20000 beyond 100");
        assert!(crossed > 19_000, "{crossed}");
        assert!(
            (mean.value - 1.0).abs() <= (4.0 * mean.error).max(1e-6),
            "{mean:?}"
        );
        let straight = exits
            .iter()
            .flatten()
            .filter(|e| (e.direction + wi).length() < 0.05)
            .count();
        assert!(straight > 19_000, "{straight} of 20000 go straight on");
    }
}
