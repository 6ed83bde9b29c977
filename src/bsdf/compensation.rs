//! Single scattering scaled up to the energy that it lost: the approximation
//! that stands in for the model in most renderers, as a baseline.
//!
//! Turquin 2019, "Practical multiple scattering compensation for microfacet
//! models"
//! (<https://blog.selfshadow.com/publications/turquin/ms_comp_final.pdf>):
//! with E(ω_o) the albedo of single scattering on facets that absorb nothing,
//! f is multiplied by
//!
//! 1 + F_ms (1 − E)/E,  F_ms = F̄ Ē / (1 − F̄ (1 − Ē)),
//!
//! where F̄ is the mean share of light that a facet does not absorb and Ē the
//! mean of E, both weighted with the cosine. F_ms is what light keeps that
//! meets a second facet, a third, and so on (Jakob et al. 2014; Kulla and Conty
//! 2017). White surfaces get 1/E and so lose nothing. The result looks like
//! single scattering, only brighter, and it is not reciprocal.
//!
//! Cycles does the same from 4.0 on. As there, an anisotropic surface takes
//! the E of the isotropic one with α = √(α_x α_y), which is wrong for it.
//! Glass is scaled by the albedo of reflection and transmission together, with
//! its colour for F̄; diffuse facets likewise with their albedo.

use std::fmt;
use std::sync::{LazyLock, Mutex};

use rayon::prelude::*;

use super::table::with_ndf;
use super::{Distribution, Width};
use smithwalk_model::{
    Conductor, ConductorFresnel, Dielectric, Diffuse, Draw, Facets, Glass, Microsurface, Ndf,
    Refraction, Rgb, Vector3,
};

/// Cosines of a table; odd, for Simpson's rule.
const COSINES: usize = 33;

/// Roughnesses of a table; more, since Beckmann glass bends sharply from √α =
/// 0.7 on.
const ROUGHNESSES: usize = 65;

/// Samples of single scattering for each node.
const SAMPLES: u32 = 4096;

/// Roughness √α of the last node; rougher surfaces are taken for this one.
const MAX_ROUGHNESS: f32 = 4.0;

/// The smallest cosine that is sampled, in place of 0.
const GRAZING: f32 = 1e-5;

/// Facets that absorb nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WhiteFacets {
    /// Perfect mirrors.
    Conductor,
    /// Interfaces of this index of refraction, inside over outside.
    Dielectric(f32),
    /// Perfect diffusers.
    Diffuse,
}

/// The albedo of single scattering on white facets, by roughness and angle.
pub struct Albedos {
    /// Seen from the side that facets have a relative index ≥ 1 from.
    outer: Grid,
    /// From the other side; absent where both are alike.
    inner: Option<Grid>,
}

/// The tables that were asked for so far: few, and needed as long as any scene.
static TABLES: Mutex<Vec<(Distribution, WhiteFacets, &Albedos)>> = Mutex::new(Vec::new());

impl Albedos {
    /// The table for these facets, computed when it is first asked for (about a
    /// second of CPU time, two for glass) and kept for the life of the process.
    pub fn of(distribution: Distribution, facets: WhiteFacets) -> &'static Self {
        // Tables are whole or not there: a poisoned lock has lost nothing.
        let mut tables = TABLES.lock().unwrap_or_else(|e| e.into_inner());
        let known = tables
            .iter()
            .find(|(d, f, _)| (*d, *f) == (distribution, facets));
        if let Some((.., table)) = known {
            return table;
        }
        let table: &'static Self = Box::leak(Box::new(with_ndf!(
            distribution,
            N => Self::compute(|alpha| <N as Width>::of(alpha, alpha), facets)
        )));
        tables.push((distribution, facets, table));
        table
    }

    fn compute<N: Ndf<Scalar = f32>>(ndf: fn(f32) -> N, facets: WhiteFacets) -> Self {
        let white = Rgb([1.0; 3]);
        match facets {
            WhiteFacets::Conductor => {
                let fresnel = ConductorFresnel::Constant(white);
                Self {
                    outer: Grid::measure(ndf, Conductor { fresnel }),
                    inner: None,
                }
            }
            WhiteFacets::Diffuse => Self {
                outer: Grid::measure(ndf, Diffuse { albedo: white }),
                inner: None,
            },
            WhiteFacets::Dielectric(ior) => {
                let eta = ior.max(1.0 / ior);
                let facets = |eta| Dielectric { eta, tint: white };
                Self {
                    outer: Grid::measure(ndf, facets(eta)),
                    inner: Some(Grid::measure(ndf, facets(1.0 / eta))),
                }
            }
        }
    }

    /// The factor on single scattering on surfaces of the α `width` that keep the
    /// share `f` of light at each facet, over that on those that keep all.
    #[must_use]
    pub fn darkening(&self, width: f32, cos: f32, f: f32) -> f32 {
        let (albedo, mean) = self.outer.at(width.sqrt(), cos);
        let lost = (1.0 - albedo) / albedo;
        (1.0 + f * mean / (1.0 - f * (1.0 - mean)) * lost) / (1.0 + lost)
    }

    /// The factor on single scattering towards a viewer at cosine `cos` from
    /// the normal.
    #[inline]
    pub fn scale<N: Width, I: MeanWeight>(
        &self,
        surface: &Microsurface<N, I>,
        cos: f32,
    ) -> Rgb<f32> {
        let grid = match &self.inner {
            Some(inner) if surface.facets.relative_index() < 1.0 => inner,
            _ => &self.outer,
        };
        let (albedo, mean) = grid.at(surface.ndf.width().sqrt(), cos);
        let lost = (1.0 - albedo) / albedo;
        surface
            .facets
            .mean_weight()
            .map(|f| 1.0 + f * mean / (1.0 - f * (1.0 - mean)) * lost)
    }
}

impl fmt::Debug for Albedos {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Albedos").finish_non_exhaustive()
    }
}

/// Albedos at nodes even in √α/(1 + √α) and in √cosθ: close to each other
/// where the albedo bends, for smooth surfaces and at grazing angles.
struct Grid {
    /// E, a row of cosines for each roughness.
    albedo: Vec<[f32; COSINES]>,
    /// Ē = 2 ∫ E cosθ d(cosθ) of each row.
    mean: Vec<f32>,
}

impl Grid {
    fn measure<N: Ndf<Scalar = f32>, I: Facets<Scalar = f32> + Sync>(
        ndf: fn(f32) -> N,
        facets: I,
    ) -> Self {
        let row = |i: usize| -> [f32; COSINES] {
            let x = i as f32 / (ROUGHNESSES - 1) as f32 * place(MAX_ROUGHNESS);
            let roughness = x / (1.0 - x);
            if i == 0 {
                return [1.0; COSINES]; // smooth: one facet, nothing in its way
            }
            let ndf = ndf(roughness * roughness);
            std::array::from_fn(|j| {
                let y = j as f32 / (COSINES - 1) as f32;
                single_albedo(&Microsurface { ndf, facets }, (y * y).max(GRAZING))
            })
        };
        let albedo: Vec<_> = (0..ROUGHNESSES).into_par_iter().map(row).collect();
        let mean = albedo.iter().map(mean_over_hemisphere).collect();
        Self { albedo, mean }
    }

    /// E and Ē, bilinear between the nodes.
    #[inline]
    fn at(&self, roughness: f32, cos: f32) -> (f32, f32) {
        let (i, s) = split(place(roughness) / place(MAX_ROUGHNESS), ROUGHNESSES);
        let (j, t) = split(cos.max(0.0).sqrt(), COSINES);
        let row = |i: usize| between(self.albedo[i][j], self.albedo[i][j + 1], t);
        (
            between(row(i), row(i + 1), s),
            between(self.mean[i], self.mean[i + 1], s),
        )
    }
}

/// The node below a place `at` from 0 to 1 among evenly spread ones, and how far
/// it is to the next.
#[inline]
pub(super) fn split(at: f32, nodes: usize) -> (usize, f32) {
    let at = at.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let node = (at as usize).min(nodes - 2);
    (node, at - node as f32)
}

#[inline]
pub(super) fn between(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Where a roughness is on its axis.
#[inline]
fn place(roughness: f32) -> f32 {
    roughness / (1.0 + roughness)
}

/// The share of light that leaves after one facet, at cosine `cos`, by Sobol
/// points, whose error is below that of interpolation.
fn single_albedo<N: Ndf<Scalar = f32>, I: Facets<Scalar = f32>>(
    surface: &Microsurface<N, I>,
    cos: f32,
) -> f32 {
    let wi = Vector3::spherical(cos, 0.0);
    let weight = |index| {
        let mut point = SobolPoint::new(index);
        let exit = surface.sample_single(wi, &mut point);
        exit.map_or(0.0, |exit| f64::from(exit.weight.0[0]))
    };
    let sum: f64 = (0..SAMPLES).map(weight).sum();
    // Far below what any surface of use has, and keeps 1/E finite.
    ((sum / f64::from(SAMPLES)) as f32).max(1e-3)
}

/// 2 ∫ E cosθ d(cosθ) = 4 ∫ E y³ dy with y = √cosθ, by Simpson's rule.
fn mean_over_hemisphere(row: &[f32; COSINES]) -> f32 {
    let step = 1.0 / (COSINES - 1) as f32;
    let term = |(j, albedo): (usize, &f32)| {
        let weight = match j {
            0 => 1.0,
            _ if j == COSINES - 1 => 1.0,
            _ if j % 2 == 1 => 4.0,
            _ => 2.0,
        };
        weight * albedo * (j as f32 * step).powi(3)
    };
    4.0 * step / 3.0 * row.iter().enumerate().map(term).sum::<f32>()
}

/// The leading coordinates of the points that all nodes of all tables take.
static POINTS: LazyLock<Vec<[f32; 4]>> = LazyLock::new(|| {
    let point = |index| [0, 1, 2, 3].map(|dimension| sobol_burley::sample(index, dimension, 0));
    (0..SAMPLES).map(point).collect()
});

/// One Owen-scrambled Sobol point, coordinate after coordinate.
pub(super) struct SobolPoint {
    index: u32,
    dimension: u32,
}

impl SobolPoint {
    pub(super) fn new(index: u32) -> Self {
        Self {
            index,
            dimension: 0,
        }
    }
}

impl Draw<f32> for SobolPoint {
    fn draw(&mut self) -> f32 {
        let dimension = self.dimension;
        self.dimension += 1;
        let leading = POINTS.get(self.index as usize);
        match leading.and_then(|point| point.get(dimension as usize)) {
            Some(&coordinate) => coordinate,
            None => sobol_burley::sample(self.index, dimension, 0),
        }
    }
}

/// What facets keep of the light.
pub trait MeanWeight: Facets<Scalar = f32> {
    /// F̄ = 2 ∫ F cosθ d(cosθ): the mean share that one facet does not absorb.
    fn mean_weight(&self) -> Rgb<f32>;

    /// The share that a facet keeps of light at 60°, in the channel where it is largest;
    /// 1 for facets that hardly absorb.
    #[inline]
    fn weight_aslant(&self) -> f32 {
        1.0
    }
}

impl MeanWeight for Conductor<f32> {
    #[inline]
    fn mean_weight(&self) -> Rgb<f32> {
        match self.fresnel {
            ConductorFresnel::Constant(color) => color,
            // 2 ∫ (1 − c)⁵ c dc = 1/21
            ConductorFresnel::Schlick { f0 } => f0.map(|f0| f0 + (1.0 - f0) / 21.0),
            fresnel => {
                let mut sum = Rgb([0.0; 3]);
                for (cos, weight) in GAUSS {
                    sum += fresnel.reflectance(cos) * (2.0 * weight * cos);
                }
                sum
            }
        }
    }

    #[inline]
    fn weight_aslant(&self) -> f32 {
        match self.fresnel {
            // A film's colour takes longer to find than the orders that it could save.
            ConductorFresnel::Film { .. } => 1.0,
            fresnel => fresnel.reflectance(0.5).max_channel(),
        }
    }
}

impl MeanWeight for Dielectric<f32> {
    #[inline]
    fn mean_weight(&self) -> Rgb<f32> {
        self.tint
    }
}

impl MeanWeight for Glass<f32> {
    #[inline]
    fn mean_weight(&self) -> Rgb<f32> {
        self.transmission
    }
}

impl MeanWeight for Refraction<f32> {
    #[inline]
    fn mean_weight(&self) -> Rgb<f32> {
        self.tint
    }
}

impl MeanWeight for Diffuse<f32> {
    #[inline]
    fn mean_weight(&self) -> Rgb<f32> {
        self.albedo
    }
}

/// Gauss–Legendre nodes and weights on [0, 1], exact for polynomials up to
/// degree 9.
const GAUSS: [(f32, f32); 5] = [
    (0.046_910_077, 0.118_463_44),
    (0.230_765_34, 0.239_314_34),
    (0.5, 0.284_444_45),
    (0.769_234_66, 0.239_314_34),
    (0.953_089_9, 0.118_463_44),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::{Method, Rough};
    use glam::Vec3;
    use rand::SeedableRng;
    use smithwalk_model::{Beckmann, Ggx};

    const WHITE: Rgb<f32> = Rgb([1.0; 3]);

    /// Mean weight of compensated samples with its standard error, channel by
    /// channel, at a cosine that is on no node.
    fn albedo<N: Width, I: MeanWeight>(
        distribution: Distribution,
        white: WhiteFacets,
        surface: Microsurface<N, I>,
        [cos, azimuth]: [f32; 2],
    ) -> ([f64; 3], f64) {
        const WALKS: u32 = 100_000;
        let rough = Rough {
            surface,
            method: Method::Compensated(Albedos::of(distribution, white)),
        };
        let mut rng = smithwalk_model::Stream(rand_pcg::Pcg64Mcg::seed_from_u64(7));
        let sin = (1.0 - cos * cos).sqrt();
        let wo = Vec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos);
        let (mut sum, mut squares) = ([0.0; 3], 0.0);
        for _ in 0..WALKS {
            if let Some(sample) = rough.sample(wo, &mut rng) {
                for (sum, weight) in sum.iter_mut().zip(sample.weight.to_array()) {
                    *sum += f64::from(weight);
                }
                squares += f64::from(sample.weight[0]).powi(2);
            }
        }
        let n = f64::from(WALKS);
        let mean = sum.map(|s| s / n);
        (mean, ((squares / n - mean[0].powi(2)) / n).sqrt())
    }

    fn mirrors(color: Rgb<f32>) -> Conductor<f32> {
        Conductor {
            fresnel: ConductorFresnel::Constant(color),
        }
    }

    /// 200 albedos within 4.5 σ and the error of the table: by chance alone this
    /// fails once in 730 (two-sided, normal); the seed is fixed.
    #[test]
    fn white_surfaces_get_all_their_energy_back() {
        const TABLE: f64 = 2e-3;
        let mut worst = 0.0_f64;
        let mut wrong = Vec::new();
        let mut check = |what: String, (mean, error): ([f64; 3], f64)| {
            let excess = (mean[0] - 1.0).abs() - 4.5 * error;
            worst = worst.max(excess);
            if excess > TABLE {
                wrong.push(format!("{what}: {} ± {error}", mean[0]));
            }
        };
        for roughness in [0.15_f32, 0.33, 0.5, 0.77, 1.0] {
            for cos in [0.999, 0.71, 0.5, 0.23, 0.1] {
                let at = [cos, 0.3];
                let alpha = roughness * roughness;
                let at_what = format!("√α {roughness}, cos {cos}");
                macro_rules! each {
                    ($normals:ident, $ndf:expr) => {{
                        let (normals, ndf) = (Distribution::$normals, $ndf);
                        let what = |name: &str| format!("{name} {normals:?}, {at_what}");
                        let facets = mirrors(WHITE);
                        let found = albedo(
                            normals,
                            WhiteFacets::Conductor,
                            Microsurface { ndf, facets },
                            at,
                        );
                        check(what("conductor"), found);
                        let facets = Diffuse { albedo: WHITE };
                        let found = albedo(
                            normals,
                            WhiteFacets::Diffuse,
                            Microsurface { ndf, facets },
                            at,
                        );
                        check(what("diffuse"), found);
                        for eta in [1.5, 1.0 / 1.5] {
                            let facets = Dielectric { eta, tint: WHITE };
                            let white = WhiteFacets::Dielectric(1.5);
                            let found = albedo(normals, white, Microsurface { ndf, facets }, at);
                            check(what(&format!("dielectric {eta}")), found);
                        }
                    }};
                }
                each!(Ggx, Ggx::isotropic(alpha));
                each!(Beckmann, Beckmann::isotropic(alpha));
            }
        }
        println!("largest excess over 4.5 σ: {worst}");
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    /// What Cycles 4.5 gives for gold of Blender's roughness r, green channel,
    /// at cosθ .999, .5 and .1 (measured; relative standard error below
    /// 1.1e-3). Its own tables are coarser, and off by up to 7e-3 on white.
    #[test]
    fn coloured_metal_is_as_bright_as_in_cycles() {
        let measured = [
            (0.5_f32, [0.6913, 0.6779, 0.6856]),
            (0.7, [0.6315, 0.6329, 0.6741]),
            (0.85, [0.5546, 0.5829, 0.6545]),
            (1.0, [0.4642, 0.5149, 0.6247]),
        ];
        for (roughness, expected) in measured {
            for (cos, expected) in [0.999, 0.5, 0.1].into_iter().zip(expected) {
                let surface = Microsurface {
                    ndf: Ggx::isotropic(roughness * roughness),
                    facets: mirrors(Rgb([1.0, 0.71, 0.29])),
                };
                let (mean, _) = albedo(
                    Distribution::Ggx,
                    WhiteFacets::Conductor,
                    surface,
                    [cos, 0.0],
                );
                let off = mean[1] / expected - 1.0;
                println!(
                    "r {roughness} cos {cos}: {:.4}, Cycles {expected}: {off:+.4}",
                    mean[1]
                );
                assert!(
                    off.abs() < 7e-3,
                    "r {roughness}, cos {cos}: {mean:?}, not {expected}"
                );
            }
        }
    }

    /// Single-scattering albedo of GGX mirrors, α = 1, at normal incidence.
    #[test]
    fn the_table_meets_a_closed_form() {
        let surface = Microsurface {
            ndf: Ggx::isotropic(1.0),
            facets: mirrors(WHITE),
        };
        let found = single_albedo(&surface, 1.0);
        assert!((found - (1.0 - 2.0_f32.ln())).abs() < 3e-4, "{found}");
    }

    #[test]
    fn mean_reflectances_are_those_of_a_fine_sum() {
        let f0 = Rgb([1.0, 0.78, 0.34]);
        let curves = [
            ConductorFresnel::Schlick { f0 },
            ConductorFresnel::F82 {
                f0,
                f82: Rgb([0.9, 0.8, 0.5]),
            },
            ConductorFresnel::Complex {
                eta: Rgb([0.183, 0.421, 2.911]),
                k: Rgb([3.424, 2.346, 3.089]),
            },
        ];
        for fresnel in curves {
            let mut fine = [0.0_f64; 3];
            for i in 0..10_000 {
                let cos = (f64::from(i) + 0.5) / 1e4;
                for (sum, f) in fine.iter_mut().zip(fresnel.reflectance(cos as f32).0) {
                    *sum += f64::from(f) * 2.0 * cos / 1e4;
                }
            }
            let found = Conductor { fresnel }.mean_weight();
            for (found, fine) in found.0.into_iter().zip(fine) {
                assert!(
                    (f64::from(found) - fine).abs() < 2e-4,
                    "{fresnel:?}: {found} {fine}"
                );
            }
        }
    }
}
