//! Where multiple scattering goes: the model, what stands in for it in
//! renderers, and an explicit surface. The figures and tables of
//! `docs/lobes.md`.
//!
//! ```text
//! cargo run --example lobes -- docs/images
//! ```
//!
//! White mirrors of GGX and Beckmann normals. All that is compared has the
//! same albedo; the question is into which directions orders ≥ 2 leave:
//!
//! - the model's walk;
//! - a diffuse-like lobe (Kelemen and Szirmay-Kalos 2001; Kulla and Conty
//!   2017, "Revisiting Physically Based Shading at Imageworks"),
//!   f cosθ_o = (1 − E(μ_i)) (1 − E(μ_o)) μ_o / (π (1 − Ē)), where E is the
//!   albedo of single scattering and Ē its cosine-weighted mean;
//! - single scattering scaled up by 1/E (Turquin 2019), as
//!   `Method::Compensated` has it: the excess over single scattering;
//! - a ray-traced Gaussian height field, whose normals are Beckmann's.

use std::error::Error;
use std::f64::consts::{FRAC_2_PI, PI};
use std::path::PathBuf;

use glam::Vec3;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use smithwalk::bsdf::{Albedos, Distribution, Method, Rough, WhiteFacets, Width};
use smithwalk::report::heightfield::{
    Config, Estimate, LobeCase, Material, PSI_BINS, outgoing_lobes,
};
use smithwalk::report::plot::{Axis, Chart, Mark, Series};
use smithwalk_model::*;

/// Walks for each lobe.
const WALKS: u32 = 4_000_000;

/// Angles of incidence at which the albedo of single scattering is tabulated.
const NODES: usize = 64;

/// Samples of each node.
const NODE_SAMPLES: u32 = 100_000;

/// Slope roughness and cosine of the incident direction.
const CASES: [(f64, f64); 6] = [
    (0.5, 1.0),
    (0.5, 0.5),
    (0.5, 0.2),
    (1.0, 1.0),
    (1.0, 0.5),
    (1.0, 0.2),
];

/// Light by ψ, the angle of a direction's projection into the plane of
/// incidence, positive away from the light: shares of the incident light in
/// bins over [−90°, 90°], with standard errors.
#[derive(Clone)]
struct Lobe(Vec<Estimate>);

impl Lobe {
    /// From directions and weights of `count` samples, of which `None` gave
    /// nothing.
    fn of(count: u32, mut sample: impl FnMut() -> Option<(Vector3<f64>, f64)>) -> Self {
        let (mut sums, mut squares) = (vec![0.0; PSI_BINS], vec![0.0; PSI_BINS]);
        for (w, weight) in (0..count).filter_map(|_| sample()) {
            let psi = (-w.x).atan2(w.z) / PI + 0.5;
            let bin = ((psi * PSI_BINS as f64) as usize).min(PSI_BINS - 1);
            sums[bin] += weight;
            squares[bin] += weight * weight;
        }
        let n = f64::from(count);
        let estimate = |(sum, square): (&f64, &f64)| {
            let value = sum / n;
            let error = ((square / n - value * value) / n).sqrt();
            Estimate { value, error }
        };
        Self(sums.iter().zip(&squares).map(estimate).collect())
    }

    /// Orders ≥ 2 on the explicit surface.
    fn of_surface(case: &LobeCase) -> Self {
        let width = PI / PSI_BINS as f64;
        let bins = (0..PSI_BINS).map(|bin| {
            let higher = case.lobes.iter().filter(|l| l.order > 1 && !l.transmitted);
            higher.fold(Estimate::default(), |sum, lobe| Estimate {
                value: sum.value + lobe.surface[bin].value * width,
                error: sum.error.hypot(lobe.surface[bin].error * width),
            })
        });
        Self(bins.collect())
    }

    fn energy(&self) -> f64 {
        self.0.iter().map(|e| e.value).sum()
    }

    fn scaled(&self, factor: f64) -> Self {
        let scale = |e: &Estimate| Estimate {
            value: e.value * factor,
            error: e.error * factor,
        };
        Self(self.0.iter().map(scale).collect())
    }

    fn plus(&self, other: &Self) -> Self {
        let add = |(a, b): (&Estimate, &Estimate)| Estimate {
            value: a.value + b.value,
            error: a.error.hypot(b.error),
        };
        Self(self.0.iter().zip(&other.0).map(add).collect())
    }

    /// The total variation distance of the directions: which part of the
    /// energy would have to go elsewhere.
    fn distance(&self, other: &Self) -> Distance {
        let a = self.scaled(self.energy().recip());
        let b = other.scaled(other.energy().recip());
        let d = a.plus(&b.scaled(-1.0)).0;
        let errors = d.iter().map(|e| e.error.abs());
        Distance {
            value: 0.5 * d.iter().map(|e| e.value.abs()).sum::<f64>(),
            // E|z| = √(2/π) for every bin.
            noise: 0.5 * FRAC_2_PI.sqrt() * errors.clone().sum::<f64>(),
            error: 0.5 * errors.map(|e| e * e).sum::<f64>().sqrt(),
        }
    }

    /// As a share of the incident light per radian of ψ, over degrees.
    fn series(&self, name: &str, mark: Mark, color: usize) -> Series {
        let step = PI / PSI_BINS as f64;
        let points = self.0.iter().enumerate().map(|(i, e)| {
            let psi = (i as f64 + 0.5) * step - 0.5 * PI;
            (psi.to_degrees(), e.value / step, e.error / step)
        });
        Series::new(name, mark, points).colored(color)
    }
}

/// A distance, what noise alone makes of equal lobes, and its standard error.
struct Distance {
    value: f64,
    noise: f64,
    error: f64,
}

impl Distance {
    /// In percent.
    fn cell(&self) -> String {
        let [value, error, noise] = [self.value, self.error, self.noise].map(|x| 100.0 * x);
        format!("{value:.1} ± {error:.1} ({noise:.1})")
    }
}

/// Random numbers of one purpose.
fn stream(seed: u64) -> Stream<Pcg64Mcg> {
    Stream(Pcg64Mcg::seed_from_u64(seed))
}

fn mirrors<F: Real>() -> Conductor<F> {
    Conductor {
        fresnel: ConductorFresnel::Constant(Rgb::white()),
    }
}

/// What light from one direction does.
struct Compared {
    normals: &'static str,
    alpha: f64,
    cos: f64,
    single: Lobe,
    /// Orders ≥ 2 of the model.
    model: Lobe,
    diffuse_like: Lobe,
    /// What scaling adds to single scattering.
    scaling: Lobe,
    surface: Option<Lobe>,
}

impl Compared {
    fn new<N: Ndf<Scalar = f64> + Sync, S: Width>(
        normals: (Distribution, &'static str),
        (ndf, ndf_of_renderer): (N, S),
        (alpha, cos): (f64, f64),
    ) -> Self {
        let facets = mirrors();
        let surface = Microsurface { ndf, facets };
        let wi = Vector3::spherical(cos, 0.0);
        let mut rng = stream(1);
        let model = Lobe::of(WALKS, || {
            let exit = surface.sample(wi, &mut rng)?;
            (exit.order > 1).then_some((exit.direction, exit.weight.0[0]))
        });
        let mut rng = stream(2);
        let single = Lobe::of(WALKS, || {
            let exit = surface.sample_single(wi, &mut rng)?;
            Some((exit.direction, exit.weight.0[0]))
        });

        // Kulla and Conty: E at the middles of even intervals of μ.
        let albedos: Vec<f64> = (0..NODES)
            .into_par_iter()
            .map(|i| {
                let wi = Vector3::spherical((i as f64 + 0.5) / NODES as f64, 0.0);
                let mut rng = stream(100 + i as u64);
                let weight = |_| surface.sample_single(wi, &mut rng);
                let sum: f64 = (0..NODE_SAMPLES)
                    .filter_map(weight)
                    .map(|exit| exit.weight.0[0])
                    .sum();
                sum / f64::from(NODE_SAMPLES)
            })
            .collect();
        let albedo = |mu: f64| {
            let at = (mu * NODES as f64 - 0.5).clamp(0.0, (NODES - 1) as f64);
            let node = (at as usize).min(NODES - 2);
            albedos[node] + (albedos[node + 1] - albedos[node]) * (at - node as f64)
        };
        let mean: f64 = (0..NODES)
            .map(|i| 2.0 * albedos[i] * (i as f64 + 0.5) / (NODES * NODES) as f64)
            .sum();
        let mut rng = stream(3);
        let lost = 1.0 - single.energy();
        let diffuse_like = Lobe::of(WALKS, || {
            let mu = Draw::<f64>::draw(&mut rng).sqrt();
            let phi = 2.0 * PI * Draw::<f64>::draw(&mut rng);
            let weight = lost * (1.0 - albedo(mu)) / (1.0 - mean);
            Some((Vector3::spherical(mu, phi), weight))
        });

        // Turquin: as the renderer does it, less single scattering.
        let rough = |method| Rough {
            surface: Microsurface {
                ndf: ndf_of_renderer,
                facets: mirrors(),
            },
            method,
        };
        let compensated = rough(Method::Compensated(Albedos::of(
            normals.0,
            WhiteFacets::Conductor,
        )));
        let plain = rough(Method::Single);
        let wo = Vec3::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
        let mut rng = stream(4);
        let scaling = Lobe::of(WALKS, || {
            // The same numbers give both the same direction.
            let mut again = rng.clone();
            let more = compensated.sample(wo, &mut rng)?;
            let less = plain.sample(wo, &mut again)?;
            let [x, y, z] = more.wi.to_array().map(f64::from);
            let excess = f64::from(more.weight.x - less.weight.x);
            Some((Vector3::new(x, y, z), excess))
        });
        Self {
            normals: normals.1,
            alpha,
            cos,
            single,
            model,
            diffuse_like,
            scaling,
            surface: None,
        }
    }

    fn chart(&self) -> Chart {
        let mut series = Vec::new();
        if let Some(surface) = &self.surface {
            series.push(surface.series("explicit surface", Mark::Points, 6));
        }
        series.push(self.model.series("model", Mark::Line, 0));
        series.push(self.diffuse_like.series("Kulla–Conty", Mark::Dashes, 1));
        series.push(self.scaling.series("scaling", Mark::Dashes, 2));
        let angle = self.cos.acos().to_degrees();
        Chart {
            title: format!(
                "Orders ≥ 2: white mirrors, {} α {}, light from {angle:.0}°",
                self.normals, self.alpha
            ),
            x: Axis::linear("ψ (°), away from the light").between(-90.0, 90.0),
            y: Axis::linear("share of the light per radian of ψ"),
            series,
        }
    }

    fn file(&self) -> String {
        let name = self.normals.to_lowercase();
        format!("lobes_{name}_{}_{}.svg", self.alpha, self.cos)
    }
}

/// All cases, the surface's lobes among them.
fn compare() -> Result<Vec<Compared>, Box<dyn Error>> {
    let config = Config {
        realisations: 32,
        rays: 40_000,
        ..Config::standard()
    };
    let explicit = outgoing_lobes(&config)?;
    let mut all = Vec::new();
    for (alpha, cos) in CASES {
        let narrow = alpha as f32;
        all.push(Compared::new(
            (Distribution::Ggx, "GGX"),
            (Ggx::isotropic(alpha), Ggx::isotropic(narrow)),
            (alpha, cos),
        ));
        let mut beckmann = Compared::new(
            (Distribution::Beckmann, "Beckmann"),
            (Beckmann::isotropic(alpha), Beckmann::isotropic(narrow)),
            (alpha, cos),
        );
        let case = explicit.iter().find(|case| {
            (case.facets, case.alpha, case.cos) == (Material::Conductor, [alpha; 2], cos)
        });
        beckmann.surface = case.map(Lobe::of_surface);
        all.push(beckmann);
    }
    all.sort_by_key(|c| c.normals);
    Ok(all)
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = std::env::args_os()
        .nth(1)
        .ok_or("expected the folder for the figures")?
        .into();
    let all = compare()?;
    println!("From the explicit surface, orders ≥ 2\n");
    println!("| α | cosθ | share of the light | in the model | model | Kulla–Conty | scaling |");
    println!("|---|---|---|---|---|---|---|");
    for c in &all {
        let Some(surface) = &c.surface else { continue };
        println!(
            "| {} | {} | {:.2} | {:.2} | {} | {} | {} |",
            c.alpha,
            c.cos,
            100.0 * surface.energy(),
            100.0 * c.model.energy(),
            surface.distance(&c.model).cell(),
            surface.distance(&c.diffuse_like).cell(),
            surface.distance(&c.scaling).cell(),
        );
    }
    println!("\nFrom the model\n");
    println!(
        "| normals | α | cosθ | share of orders ≥ 2 | Kulla–Conty | scaling | Kulla–Conty, all orders | scaling, all orders |"
    );
    println!("|{}", "---|".repeat(8));
    for c in &all {
        let total = c.single.plus(&c.model);
        println!(
            "| {} | {} | {} | {:.2} | {} | {} | {} | {} |",
            c.normals,
            c.alpha,
            c.cos,
            100.0 * c.model.energy(),
            c.model.distance(&c.diffuse_like).cell(),
            c.model.distance(&c.scaling).cell(),
            total.distance(&c.single.plus(&c.diffuse_like)).cell(),
            total.distance(&c.single.plus(&c.scaling)).cell(),
        );
    }
    for c in &all {
        if c.surface.is_some() || c.cos == 0.5 {
            std::fs::write(folder.join(c.file()), c.chart().to_svg()?)?;
        }
    }
    Ok(())
}
