//! What single precision costs against double.

use super::domain::{ALPHAS, direction, stream};
use smithwalk_model::*;

/// Largest relative difference of single from double precision over a grid,
/// the inputs being the same: those that single precision can hold.
struct Worst {
    difference: f64,
    at: String,
}

impl Worst {
    fn new() -> Self {
        Self {
            difference: 0.0,
            at: String::new(),
        }
    }

    fn compare(&mut self, single: f32, double: f64, at: impl Fn() -> String) {
        // Below the normal numbers of f32 there is no relative precision.
        if double.abs() > 1e-35 && double.abs() < 1e37 {
            let difference = (f64::from(single) / double - 1.0).abs();
            if difference > self.difference || difference.is_nan() {
                self.difference = difference;
                self.at = format!("{}: {single:e} against {double:e}", at());
            }
        }
    }

    fn below(&self, what: &str, bound: f64) {
        println!("{what}: {:.1e} at {}", self.difference, self.at);
        assert!(
            self.difference < bound,
            "{what}: {:.1e} at {}",
            self.difference,
            self.at
        );
    }
}

/// The f64 vector with exactly the components of the f32 one.
fn widened(v: Vector3<f32>) -> Vector3<f64> {
    Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

fn precision<S: Ndf<Scalar = f32>, D: Ndf<Scalar = f64>>(name: &str, pairs: &[(S, D)]) {
    let (mut sigma, mut lambda, mut density, mut visible) =
        (Worst::new(), Worst::new(), Worst::new(), Worst::new());
    for (k, (single, double)) in pairs.iter().enumerate() {
        for i in 0..200 {
            for cos in [
                1.0 - 10f64.powf(-f64::from(i) / 25.0),
                10f64.powf(-f64::from(i) / 20.0),
            ] {
                let w = direction::<f32>(cos, 0.3 + f64::from(i));
                let at = || format!("pair {k}, {w:?}");
                for w in [w, -w] {
                    sigma.compare(
                        single.projected_area(w),
                        double.projected_area(widened(w)),
                        at,
                    );
                }
                if w.z > 0.0 {
                    lambda.compare(single.lambda(w), double.lambda(widened(w)), at);
                }
                // Normals as they are met.
                let u = [(f64::from(i) + 0.5) / 200.0, 0.3];
                let m = double.sample_visible(widened(w), u);
                let rounded = Vector3::new(m.x as f32, m.y as f32, m.z as f32);
                density.compare(
                    single.density(rounded),
                    double.density(widened(rounded)),
                    at,
                );
                let from_single = single.sample_visible(w, u.map(|u| u as f32));
                visible.compare(
                    1.0 + (widened(from_single)
                        - double.sample_visible(widened(w), u.map(|u| f64::from(u as f32))))
                    .length() as f32,
                    1.0,
                    at,
                );
            }
        }
    }
    sigma.below(&format!("{name} σ"), 3e-5);
    lambda.below(&format!("{name} Λ"), 3e-5);
    density.below(&format!("{name} D"), 3e-6);
    visible.below(&format!("{name} visible normal (absolute)"), 1e-5);
}

#[test]
fn single_precision_follows_double() {
    let alphas = ALPHAS.map(|(x, y)| (x as f32, y as f32));
    let widen = |(x, y): (f32, f32)| (f64::from(x), f64::from(y));
    let ggx: Vec<_> = alphas
        .iter()
        .map(|&a| {
            let (x, y) = widen(a);
            (
                Ggx {
                    alpha_x: a.0,
                    alpha_y: a.1,
                },
                Ggx {
                    alpha_x: x,
                    alpha_y: y,
                },
            )
        })
        .collect();
    precision("GGX", &ggx);
    let beckmann: Vec<_> = alphas
        .iter()
        .map(|&a| {
            let (x, y) = widen(a);
            (
                Beckmann {
                    alpha_x: a.0,
                    alpha_y: a.1,
                },
                Beckmann {
                    alpha_x: x,
                    alpha_y: y,
                },
            )
        })
        .collect();
    precision("Beckmann", &beckmann);
    precision("quadratic", &[(Quadratic::new(), Quadratic::new())]);

    let mut beta = Worst::new();
    for i in 0..60 {
        for j in 0..60 {
            let (x, y) = (
                1.0 + 10f32.powf(i as f32 / 5.0 - 4.0),
                1.0 + 10f32.powf(j as f32 / 5.0 - 4.0),
            );
            let double = f64::from(x) * ln_beta(f64::from(x), f64::from(y)).exp();
            beta.compare(x * ln_beta(x, y).exp(), double, || format!("B({x}, {y})"));
        }
    }
    beta.below("x B(x, y)", 5e-5);
}

/// Level directions cancel in scalar products: what rough glass reflects at
/// grazing angles must not round to a density of 0 where it was sampled.
#[test]
fn grazing_glass_has_a_density_where_it_reflects() {
    for eta in [1e-3, 1.0 / 1.5, 1.5f32] {
        let surface = Microsurface {
            ndf: Beckmann::isotropic(1e-3f32),
            facets: Dielectric {
                eta,
                tint: Rgb::white(),
            },
        };
        let mut rng = stream(1);
        for cos in [1e-4, 1e-5, 1e-6] {
            let wi = direction(cos, 0.7);
            let exits = (0..2000).filter_map(|_| surface.sample_single(wi, &mut rng));
            let reflected = exits.filter(|exit| exit.direction.z > 0.0);
            let densities: Vec<f32> = reflected
                .map(|exit| surface.pdf_single(wi, exit.direction))
                .collect();
            assert!(densities.len() > 200, "{}", densities.len());
            let missing = densities.iter().filter(|&&pdf| pdf <= 0.0).count();
            assert_eq!(missing, 0, "η {eta}, cosθ {cos}: of {}", densities.len());
        }
    }
}
