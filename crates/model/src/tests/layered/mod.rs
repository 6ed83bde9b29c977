//! Stacks of layers: closed forms, energy, reciprocity, extremes.

mod closed;
mod consistent;
mod extremes;
mod furnace;

use super::*;
use crate::layered::proxy::Shape;
use crate::layered::*;

/// A number in [0, 1).
fn uniform(rng: &mut Stream<Pcg64Mcg>) -> f64 {
    rng.draw()
}

/// A finish of roughness α, by GGX; none at 0.
fn finish(alpha: f64) -> Finish<f64> {
    if alpha > 0.0 {
        Finish::Ggx(Ggx::isotropic(alpha))
    } else {
        Finish::Smooth
    }
}

fn lambert(albedo: f64) -> Base<f64> {
    Base::Diffuse {
        finish: Finish::Smooth,
        albedo: Rgb::splat(albedo),
    }
}

fn matte(alpha: f64, albedo: f64) -> Base<f64> {
    Base::Diffuse {
        finish: finish(alpha),
        albedo: Rgb::splat(albedo),
    }
}

fn metal(alpha: f64, reflectance: f64) -> Base<f64> {
    Base::Conductor {
        finish: finish(alpha),
        fresnel: ConductorFresnel::Constant(Rgb::splat(reflectance)),
    }
}

/// Interfaces of these indices and roughnesses over `base`.
fn stack(interfaces: &[(f64, f64)], base: Base<f64>) -> Layered<f64> {
    let interfaces: Vec<_> = interfaces
        .iter()
        .map(|&(ior, alpha)| Interface::new(ior, finish(alpha)))
        .collect();
    Layered::new(&interfaces, base).expect("a valid stack")
}

/// f |cosθ_o| in the first channel, all orders.
fn estimate(
    stack: &Layered<f64>,
    wi: Vector3<f64>,
    wo: Vector3<f64>,
    samples: usize,
    rng: &mut Stream<Pcg64Mcg>,
) -> Mean {
    let mut mean = Mean::default();
    for _ in 0..samples {
        let mut total = Total::default();
        stack.eval(wi, wo, rng, &mut total);
        mean.add(total.0.0[0]);
    }
    mean
}

/// The share of light from `wi` that leaves, in the first channel.
fn albedo(
    stack: &Layered<f64>,
    wi: Vector3<f64>,
    samples: usize,
    rng: &mut Stream<Pcg64Mcg>,
) -> Mean {
    let mut mean = Mean::default();
    for _ in 0..samples {
        mean.add(stack.sample(wi, rng).map_or(0.0, |exit| exit.weight.0[0]));
    }
    mean
}

/// A direction with the density [`Layered::pdf`], out of its lobes.
fn draw_proxy(stack: &Layered<f64>, wi: Vector3<f64>, rng: &mut Stream<Pcg64Mcg>) -> Vector3<f64> {
    let lobes = stack.lobes(wi);
    let mut rest = uniform(rng);
    let mut lobe = lobes[lobes.len() - 1];
    for other in lobes {
        rest -= other.share;
        if rest < 0.0 {
            lobe = other;
            break;
        }
    }
    let o = match lobe.shape {
        Shape::Cosine => {
            Vector3::spherical(uniform(rng).sqrt(), std::f64::consts::TAU * uniform(rng))
        }
        Shape::Mirror { ndf, from } => {
            let m = ndf.sample_visible(from, [uniform(rng), uniform(rng)]);
            let o = m * (2.0 * m.dot(from)) - from;
            Vector3::new(o.x, o.y, o.z.abs())
        }
    };
    match lobe.side {
        Side::Above => o,
        Side::Below => -o,
    }
}

/// Stacks of all kinds, by a name: rough and smooth, open and not, coloured.
fn zoo() -> Vec<(&'static str, Layered<f64>)> {
    let absorbing = |ior, alpha, absorption| Interface {
        absorption: Rgb(absorption),
        thickness: 0.5,
        ..Interface::new(ior, finish(alpha))
    };
    let brushed = Finish::Beckmann(Beckmann {
        alpha_x: 0.15,
        alpha_y: 0.5,
    });
    let made = |interfaces: &[Interface<f64>], base| {
        Layered::new(interfaces, base).expect("a valid stack")
    };
    vec![
        ("smooth on Lambert", stack(&[(1.5, 0.0)], lambert(0.8))),
        ("α 0.1 on Lambert", stack(&[(1.5, 0.1)], lambert(0.8))),
        ("α 0.7 on Lambert", stack(&[(1.5, 0.7)], lambert(0.8))),
        ("smooth on facets", stack(&[(1.5, 0.0)], matte(0.6, 0.9))),
        ("α 0.3 on facets", stack(&[(1.7, 0.3)], matte(0.5, 0.9))),
        ("smooth on metal", stack(&[(1.5, 0.0)], metal(0.4, 0.9))),
        ("α 0.2 on metal", stack(&[(1.5, 0.2)], metal(0.3, 0.9))),
        ("α 0.6 on mirror", stack(&[(1.5, 0.6)], metal(0.0, 1.0))),
        (
            "α 0.2 under smooth on metal",
            stack(&[(1.3, 0.0), (1.8, 0.2)], metal(0.5, 0.8)),
        ),
        (
            "two rough ones on Lambert",
            stack(&[(1.8, 0.2), (1.3, 0.5)], lambert(0.9)),
        ),
        (
            "tinted, α 0.2 under smooth on Lambert",
            made(
                &[
                    Interface {
                        reflection: Rgb([0.2, 1.0, 3.0]),
                        transmission: Rgb([0.9, 0.6, 1.0]),
                        ..Interface::new(1.5, Finish::Smooth)
                    },
                    Interface {
                        reflection: Rgb([1.0, 0.3, 2.0]),
                        ..Interface::new(1.8, finish(0.2))
                    },
                ],
                lambert(0.8),
            ),
        ),
        ("a pane", stack(&[(1.5, 0.3), (1.0, 0.4)], Base::Open)),
        ("into glass", stack(&[(1.3, 0.0), (1.6, 0.4)], Base::Open)),
        (
            "brushed and dyed on a mix",
            made(
                &[
                    Interface {
                        finish: brushed,
                        ..absorbing(1.5, 0.0, [0.1, 0.6, 2.0])
                    },
                    absorbing(1.2, 0.2, [1.0, 0.0, 0.2]),
                ],
                Base::Mix(vec![
                    (0.5, lambert(0.7)),
                    (
                        0.5,
                        Base::Mix(vec![(0.5, metal(0.4, 0.9)), (0.5, matte(0.8, 0.6))]),
                    ),
                ]),
            ),
        ),
        (
            "base alone",
            made(
                &[],
                Base::Diffuse {
                    finish: brushed,
                    albedo: Rgb([0.2, 0.5, 0.9]),
                },
            ),
        ),
    ]
}
