//! Edges of the parameters, both precisions, and what is refused.

use super::*;

/// An interface and a base at the edge of what is possible.
fn edge<F: Real>(ior: f64, alpha: f64, beckmann: bool, base: usize) -> Layered<F> {
    let alpha = F::of(alpha);
    let finish = if beckmann {
        Finish::Beckmann(Beckmann {
            alpha_x: alpha,
            alpha_y: F::of(0.3) * alpha,
        })
    } else {
        Finish::Ggx(Ggx::isotropic(alpha))
    };
    let interface = Interface::new(F::of(ior), finish);
    let (interfaces, base) = match base {
        0 => (
            vec![interface],
            Base::Diffuse {
                finish,
                albedo: Rgb::splat(F::of(0.9)),
            },
        ),
        1 => (
            vec![interface],
            Base::Conductor {
                finish: Finish::Smooth,
                fresnel: ConductorFresnel::Constant(Rgb::white()),
            },
        ),
        2 => (
            vec![
                interface,
                Interface {
                    absorption: Rgb([F::of(1e-3), F::zero(), F::of(1e3)]),
                    ..Interface::new(F::of(1.3), Finish::Smooth)
                },
            ],
            Base::Conductor {
                finish,
                fresnel: ConductorFresnel::Constant(Rgb::white()),
            },
        ),
        _ => (
            vec![interface, Interface::new(F::one(), finish)],
            Base::Open,
        ),
    };
    Layered::new(&interfaces, base).expect("a valid stack")
}

/// Samples and evaluates at the edges; everything is finite, nothing negative.
fn survives<F: Real>(rng: &mut (impl Draw<F> + Draw<f64>)) {
    for ior in [0.3, 1.0, 1.0 + 1e-7, 1.0001, 1.5, 3.0] {
        for alpha in [1e-8, 1e-6, 1e-4, 1e-2, 1.0, 10.0] {
            for (beckmann, base) in [(false, 0), (true, 1), (false, 2), (true, 3), (false, 3)] {
                let stack = edge::<F>(ior, alpha, beckmann, base);
                for cos in [1.0, 0.6, 1e-3, 1e-7, 1e-20, -0.5, -1e-8] {
                    let what = format!("n {ior}, α {alpha}, base {base}, cos {cos}");
                    let wi = Vector3::spherical(F::of(cos), F::of(0.4));
                    let exit = stack.sample(wi, rng);
                    if let Some(exit) = exit {
                        let length = exit.direction.length().as_f64();
                        assert!((length - 1.0).abs() < 1e-5, "{what}: {exit:?}");
                        let weight = exit.weight.max_channel().as_f64();
                        assert!(weight > 0.0 && weight < 20.0, "{what}: {exit:?}");
                    }
                    let mirrored = Vector3::new(-wi.x, -wi.y, wi.z);
                    let other: f64 = Draw::<f64>::draw(rng);
                    let any = Vector3::spherical(F::of(2.0 * other - 1.0), F::of(9.0 * other));
                    for wo in [mirrored, -wi, any, exit.map_or(any, |exit| exit.direction)] {
                        let mut total = Total::default();
                        stack.eval(wi, wo, rng, &mut total);
                        let pdf = stack.pdf(wi, wo);
                        let values = total.0.0;
                        assert!(
                            values.iter().all(|v| v.is_finite() && *v >= F::zero()),
                            "{what} to {wo:?}: {values:?}"
                        );
                        assert!(
                            pdf >= F::zero() && pdf.is_finite(),
                            "{what} to {wo:?}: {pdf:?}"
                        );
                        let lit = total.0.max_channel() > F::zero();
                        assert!(pdf > F::zero() || !lit, "{what} to {wo:?}: {values:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn edges_give_finite_values_and_walks_end() {
    let mut rng = stream(71);
    survives::<f32>(&mut rng);
    survives::<f64>(&mut rng);
}

/// Means of f |cosθ_o| in single precision against double, near the mirrored
/// direction and away from it.
#[test]
fn single_precision_has_the_means_of_double() {
    let alphas = [1e-5, 1e-3, 0.05, 0.4];
    let bound = worst_score(alphas.len() * 2 * 3 * 2);
    let mut rng = stream(72);
    for alpha in alphas {
        for base in [0, 2] {
            let double = edge::<f64>(1.5, alpha, false, base);
            let single = edge::<f32>(1.5, alpha, false, base);
            for (cos, out) in [(0.8, 0.75), (0.1, 0.6), (0.6, 0.1)] {
                let mut means = [Mean::default(); 4];
                for _ in 0..4000 {
                    let (wi, wo) = (Vector3::spherical(cos, 0.3), Vector3::spherical(out, 3.4));
                    let mut split = Split::default();
                    double.eval(wi, wo, &mut rng, &mut split);
                    means[0].add(split.single.0[1]);
                    means[1].add(split.multiple.0[1]);
                    let (wi, wo) = (
                        Vector3::spherical(cos as f32, 0.3),
                        Vector3::spherical(out as f32, 3.4),
                    );
                    let mut split = Split::default();
                    single.eval(wi, wo, &mut rng, &mut split);
                    means[2].add(f64::from(split.single.0[1]));
                    means[3].add(f64::from(split.multiple.0[1]));
                }
                for k in 0..2 {
                    let (a, b) = (means[k], means[k + 2]);
                    if a.mean.max(b.mean) > 1e-9 {
                        let rounding = 1e-5 * a.mean;
                        let error = a.error().hypot(b.error()).hypot(rounding);
                        let score = (a.mean - b.mean) / error;
                        assert!(
                            score.abs() < bound,
                            "α {alpha}, base {base}, cos {cos} to {out}, {k}: {} ± {}, {} ± {}",
                            a.mean,
                            a.error(),
                            b.mean,
                            b.error()
                        );
                    }
                }
            }
        }
    }
}

/// Interfaces between equal media are none, whatever their roughness.
#[test]
fn interfaces_of_index_one_are_the_base_alone() {
    let bare = stack(&[], matte(0.5, 0.8));
    let coated = stack(&[(1.0, 0.7), (1.0, 0.0)], matte(0.5, 0.8));
    let bound = worst_score(3);
    let mut rng = stream(73);
    for (cos, out) in [(0.9, 0.5), (0.3, 0.7), (0.5, 0.1)] {
        let (wi, wo) = (Vector3::spherical(cos, 0.3), Vector3::spherical(out, 2.0));
        let a = estimate(&bare, wi, wo, 20_000, &mut rng);
        let b = estimate(&coated, wi, wo, 20_000, &mut rng);
        assert!(a.score_against(&b).abs() < bound, "{} {}", a.mean, b.mean);
        let exit = coated.sample(wi, &mut rng).expect("a way out");
        assert!(!exit.delta && exit.surfaces >= 5);
    }
}

/// A slab that absorbs darkens the light on its slanted way, down and up.
#[test]
fn slabs_absorb_along_the_slanted_way() {
    let absorption = Rgb([0.0, 0.4, 2.0]);
    let interface = Interface {
        absorption,
        thickness: 0.25,
        ..Interface::new(1.5, Finish::Smooth)
    };
    let base = metal(0.0, 1.0);
    let stack = Layered::new(&[interface], base).expect("a valid stack");
    let cos: f64 = 0.5;
    let (f, cos_t) = fresnel::dielectric(cos, 1.5);
    let expected = absorption.map(|a| {
        let slab = (-2.0 * a * 0.25 / cos_t).exp();
        f + (1.0 - f).powi(2) * slab / (1.0 - f * slab)
    });
    let mut rng = stream(74);
    let mut means = [Mean::default(); 3];
    for _ in 0..50_000 {
        let exit = stack.sample(Vector3::spherical(cos, 1.0), &mut rng);
        let weight = exit.map_or(Rgb::black(), |exit| exit.weight);
        for (mean, weight) in means.iter_mut().zip(weight.0) {
            mean.add(weight);
        }
    }
    for (mean, expected) in means.iter().zip(expected.0) {
        let score = mean.score(expected);
        assert!(
            score.abs() < worst_score(3),
            "{} against {expected}",
            mean.mean
        );
    }
}

#[test]
fn impossible_stacks_are_refused_by_name() {
    let clear = Interface::new(1.5, Finish::Smooth);
    let refused = |interfaces: &[Interface<f64>], base: Base<f64>| {
        Layered::new(interfaces, base)
            .expect_err("refused")
            .to_string()
    };
    let cases = [
        (refused(&[], Base::Open), "needs an interface or a base"),
        (
            refused(&[clear, Interface { ior: 0.0, ..clear }], lambert(0.5)),
            "interface 2: the index of refraction is 0",
        ),
        (
            refused(
                &[Interface {
                    ior: f64::NAN,
                    ..clear
                }],
                lambert(0.5),
            ),
            "interface 1: the index of refraction is NaN",
        ),
        (
            refused(
                &[Interface {
                    thickness: -1.0,
                    ..clear
                }],
                lambert(0.5),
            ),
            "interface 1: the thickness is -1",
        ),
        (
            refused(
                &[Interface {
                    absorption: Rgb([0.0, -2.0, 0.0]),
                    ..clear
                }],
                lambert(0.5),
            ),
            "interface 1: the absorption is -2",
        ),
        (
            refused(
                &[Interface {
                    absorption: Rgb::white(),
                    ..clear
                }],
                Base::Open,
            ),
            "without a base there is no slab",
        ),
        (
            refused(
                &[Interface::new(1.5, Finish::Ggx(Ggx::isotropic(-0.1)))],
                lambert(0.5),
            ),
            "interface 1: the alpha is -0.1",
        ),
        (
            refused(&[clear], lambert(1.5)),
            "base: the reflectance is 1.5",
        ),
        (refused(&[clear], Base::Mix(vec![])), "add up to 0"),
        (
            refused(
                &[clear],
                Base::Mix(vec![(0.5, lambert(0.5)), (0.2, lambert(0.1))]),
            ),
            "add up to 0.7",
        ),
        (
            refused(
                &[clear],
                Base::Mix(vec![(0.5, lambert(0.5)), (0.5, Base::Open)]),
            ),
            "a part of the base's mix is open",
        ),
    ];
    for (said, expected) in cases {
        assert!(said.contains(expected), "{said:?} lacks {expected:?}");
    }
}
