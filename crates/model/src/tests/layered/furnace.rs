//! White furnace: lossless stacks return all the light.

use super::*;

/// Both ways to the share of light from `wi` that leaves, which must be 1: by
/// sampling, and by evaluation integrated with the proxy's density. What
/// smooth surfaces alone mirror is no part of evaluation, and taken from samples.
fn shares(
    stack: &Layered<f64>,
    wi: Vector3<f64>,
    rng: &mut Stream<Pcg64Mcg>,
    means: &mut [Mean; 2],
) {
    let exit = stack.sample(wi, rng);
    let weight = exit.map_or(0.0, |exit| exit.weight.0[0]);
    means[0].add(weight);
    let mut value = if exit.is_some_and(|exit| exit.delta) {
        weight
    } else {
        0.0
    };
    if !stack.is_delta() {
        let wo = draw_proxy(stack, wi, rng);
        let density = stack.pdf(wi, wo);
        let mut total = Total::default();
        stack.eval(wi, wo, rng, &mut total);
        value += total.0.0[0] / density;
    }
    means[1].add(value);
}

/// White stacks of every interface, index and base, and of two interfaces.
fn white() -> Vec<(String, Layered<f64>)> {
    let mut stacks = Vec::new();
    let bases = [
        ("Lambert", lambert(1.0)),
        ("diffuse facets α 0.5", matte(0.5, 1.0)),
        ("metal α 0.3", metal(0.3, 1.0)),
        ("mirror", metal(0.0, 1.0)),
    ];
    for (base_name, base) in &bases {
        for alpha in [0.0, 0.05, 0.2, 0.5, 1.0] {
            for ior in [1.2, 1.5, 2.5] {
                let name = format!("α {alpha}, n {ior}, {base_name}");
                stacks.push((name, stack(&[(ior, alpha)], base.clone())));
            }
        }
        for layers in [
            [(1.5, 0.0), (1.2, 0.0)],
            [(1.5, 0.05), (1.8, 0.3)],
            [(2.5, 0.5), (1.3, 0.1)],
        ] {
            let name = format!("{layers:?}, {base_name}");
            stacks.push((name, stack(&layers, base.clone())));
        }
    }
    for layers in [[(1.5, 0.2), (1.0, 0.05)], [(1.5, 0.0), (2.5, 0.5)]] {
        stacks.push((format!("{layers:?}, open"), stack(&layers, Base::Open)));
    }
    stacks
}

#[test]
fn lossless_stacks_return_all_the_light() {
    let white = white();
    let bound = worst_score(white.len() * 4);
    let mut rng = stream(61);
    for (name, stack) in &white {
        for cos in [0.9, 0.2] {
            let wi = Vector3::spherical(cos, 0.4);
            let mut means = [Mean::default(); 2];
            for _ in 0..6000 {
                shares(stack, wi, &mut rng, &mut means);
            }
            for (way, mean) in ["sampled", "evaluated"].iter().zip(means) {
                let score = mean.score(1.0);
                assert!(
                    score.abs() < bound,
                    "{name}, cos {cos}, {way}: {} ± {} ({score:.1})",
                    mean.mean,
                    mean.error()
                );
            }
        }
    }
}

/// The same to a standard error of 3e-4: `cargo test --release -p smithwalk-model
/// to_three_digits -- --ignored --nocapture`.
#[test]
#[ignore = "takes a quarter of an hour"]
fn lossless_stacks_return_all_the_light_to_three_digits() {
    const ERROR: f64 = 3e-4;
    const MOST: usize = 30_000_000;
    let mut rng = stream(62);
    let mut worst = 0.0f64;
    let cos = 0.6;
    for (name, stack) in white() {
        let wi = Vector3::spherical(cos, 0.4);
        let mut means = [Mean::default(); 2];
        let mut count = 0;
        while count == 0 || (means[1].error() > ERROR && count < MOST) {
            for _ in 0..20_000 {
                shares(&stack, wi, &mut rng, &mut means);
            }
            count += 20_000;
        }
        let [sampled, evaluated] = means;
        println!(
            "{name}: sampled {:.6} ± {:.6}, evaluated {:.6} ± {:.6}, {} samples",
            sampled.mean,
            sampled.error(),
            evaluated.mean,
            evaluated.error(),
            count
        );
        for mean in means {
            worst = worst.max((mean.mean - 1.0).abs() - 3.0 * mean.error());
        }
    }
    assert!(worst < 1e-3, "{worst}");
}
