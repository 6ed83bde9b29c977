//! Stacks of interfaces as materials of scenes.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;
use rand::SeedableRng;
use smithwalk::bsdf::Bsdf;
use smithwalk::description::{Estimator, Material};
use smithwalk::scene::compile_alone;
use smithwalk_model::{Draw, Stream};

type Rng = Stream<rand_pcg::Pcg64Mcg>;

fn stream(seed: u64) -> Rng {
    Stream(rand_pcg::Pcg64Mcg::seed_from_u64(seed))
}

/// The closures of a material that looks the same everywhere, seen from `wo`.
fn bsdf(yaml: &str, wo: Vec3) -> Bsdf {
    let material =
        Material::from_yaml(yaml).unwrap_or_else(|problems| panic!("{yaml}: {problems}"));
    let compiled = compile_alone(&material, Estimator::Auto);
    compiled
        .unwrap_or_else(|error| panic!("{yaml}: {error}"))
        .horizontal(wo)
}

/// A unit vector of this cosine with the normal.
fn slanted(cos: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).sqrt();
    Vec3::new(0.6 * sin, 0.8 * sin, cos)
}

/// Mean and standard error.
#[derive(Default)]
struct Mean {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    fn add(&mut self, value: f32) {
        let value = f64::from(value);
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    fn join(&mut self, more: &Self) {
        self.count += more.count;
        self.sum += more.sum;
        self.squares += more.squares;
    }

    fn of(&self) -> f64 {
        self.sum / self.count
    }

    fn error(&self) -> f64 {
        let mean = self.of();
        ((self.squares / self.count - mean * mean).max(0.0) / (self.count - 1.0)).sqrt()
    }
}

/// What share of the light leaves: by walks, and by walks and evaluation combined as
/// the renderer does it.
fn albedos(bsdf: &Bsdf, wo: Vec3, samples: u32, rng: &mut Rng) -> [Mean; 2] {
    let mut means = [Mean::default(), Mean::default()];
    let cosine = |wi: Vec3| wi.z.abs() * FRAC_1_PI / 2.0;
    for _ in 0..samples {
        let mut both = 0.0;
        let choice = rng.draw();
        let walk = bsdf.sample(wo, choice, rng);
        if let Some(sample) = walk {
            let pdf = bsdf.pdf(wo, sample.wi);
            let share = if sample.delta {
                1.0
            } else {
                pdf / (pdf + cosine(sample.wi))
            };
            both += sample.weight.x * share;
        }
        means[0].add(walk.map_or(0.0, |sample| sample.weight.x));
        let (u, v, side): (f32, f32, f32) = (rng.draw(), rng.draw(), rng.draw());
        let (sin, cos) = (v * TAU).sin_cos();
        let z = (1.0 - u).sqrt();
        let wi = Vec3::new(
            u.sqrt() * cos,
            u.sqrt() * sin,
            if side < 0.5 { z } else { -z },
        );
        let value = bsdf.eval(wo, wi, rng).total().x;
        both += value / (bsdf.pdf(wo, wi) + cosine(wi)).max(f32::MIN_POSITIVE);
        means[1].add(both);
    }
    means
}

/// All of them return all the light.
const WHITE: &[&str] = &[
    "layered: {interfaces: [{alpha: 0}], base: {diffuse: {}}}",
    "layered: {interfaces: [{alpha: 0.2, ior: 2.5}], base: {rough_diffuse: {alpha: 0.5}}}",
    "layered: {interfaces: [{alpha: 0.5}, {alpha: 0.05, ior: 1.8}], base: {conductor: {alpha: 0.1}}}",
    "layered: {interfaces: [{alpha_x: 0.1, alpha_y: 0.6, distribution: beckmann}], base: {mix: {factor: 0.25, a: {diffuse: {}}, b: {conductor: {alpha: 0}}}}, rotation: 0.1}",
    "layered: {interfaces: [{alpha: 0.2}, {alpha: 0, ior: 1}]}",
    "layered: {interfaces: [{alpha: 0.3, ior: 1.33}], base: {dielectric: {alpha: 0.1, ior: 1.7}}}",
    "principled: {version: 5.0, layering: walks, base_color: 1, roughness: 0.6, diffuse_roughness: 0.7, metallic: 0.3, transmission_weight: 0.4, specular_ior_level: 1, anisotropic: 0.8, coat_weight: 0.6, coat_roughness: 0.3, coat_ior: 1.8, sheen_weight: 1, sheen_roughness: 0.4, alpha: 0.9}",
    "layered: {interfaces: [{alpha: 0.3, thin_film: {ior: 1.33, thickness: 400}}, {alpha: 0, ior: 1, thin_film: {ior: 1.8, thickness: 250}}]}",
    "principled: {version: 5.0, layering: walks, base_color: 1, roughness: 0.6, transmission_weight: 0.4, coat_weight: 0.6, coat_roughness: 0.3, coat_ior: 1.8, thin_film_thickness: 500}",
    "principled: {version: 3.4, layering: walks, base_color: 1, roughness: 0.6, metallic: 0.3, specular: 1, specular_tint: 1, anisotropic: 0.8, transmission: 0.4, clearcoat: 3, clearcoat_roughness: 0.2, alpha: 0.9}",
    "openpbr: {base_color: 1, base_diffuse_roughness: 0.7, base_metalness: 0.3, specular_roughness: 0.6, specular_weight: 2, specular_roughness_anisotropy: 0.8, transmission_weight: 0.4, coat_weight: 0.6, coat_roughness: 0.3, coat_roughness_anisotropy: 0.5, fuzz_weight: 1, geometry_opacity: 0.9}",
    "openpbr: {base_color: 1, specular_roughness: 0.4, transmission_weight: 0.4, coat_weight: 0.6, coat_roughness: 0.3, thin_film_weight: 0.7, thin_film_thickness: 0.4}",
];

/// 48 figures of 5 standard errors each: a false alarm every 36,000 runs.
#[test]
fn white_stacks_return_all_the_light_from_either_side() {
    let mut rng = stream(7);
    for yaml in WHITE {
        for cos in [0.8, -0.3] {
            let wo = slanted(cos);
            let bsdf = bsdf(yaml, wo);
            for mean in albedos(&bsdf, wo, 8_000, &mut rng) {
                let score = (mean.of() - 1.0) / mean.error().max(4e-6);
                assert!(
                    score.abs() < 5.0,
                    "{yaml}, cosθ {cos}: {} ± {}",
                    mean.of(),
                    mean.error()
                );
            }
        }
    }
}

/// The same to a standard error of 3e-4, in parts that can be run alone: `cargo test
/// --release --test suite layers::white -- --ignored --nocapture`. Hours in all.
mod white {
    use super::{Mean, WHITE, albedos, bsdf, slanted, stream};

    /// Samples in rounds until both means have a standard error of 3e-4.
    fn returns_all_to_three_digits(yaml: &str, cosines: [f32; 2]) {
        for cos in cosines {
            let wo = slanted(cos);
            let bsdf = bsdf(yaml, wo);
            // Each has numbers of its own: figures by the same ones are off together.
            let seed = yaml.bytes().fold(u64::from(cos.to_bits()), |seed, byte| {
                seed.wrapping_mul(31).wrapping_add(u64::from(byte))
            });
            let mut rng = stream(seed);
            let mut means = [Mean::default(), Mean::default()];
            while means
                .iter()
                .any(|mean| mean.count == 0.0 || mean.error() > 3e-4)
            {
                for (mean, more) in means.iter_mut().zip(albedos(&bsdf, wo, 500_000, &mut rng)) {
                    mean.join(&more);
                }
            }
            for (way, mean) in ["walks", "walks and evaluation"].iter().zip(means) {
                let off = mean.of() - 1.0;
                println!(
                    "{way}: {:.6} ± {:.6}, {:+.1} σ, cosθ {cos}, {yaml}",
                    mean.of(),
                    mean.error(),
                    off / mean.error().max(4e-6)
                );
                assert!(off.abs() < 1e-3 + 3.0 * mean.error());
            }
        }
    }

    /// The entries of the list that hold all of these words.
    fn listed(words: &[&str]) {
        let mut found = 0;
        for yaml in WHITE {
            if words.iter().all(|word| yaml.contains(word)) {
                returns_all_to_three_digits(yaml, [0.8, -0.3]);
                found += 1;
            }
        }
        assert!(found > 0, "{words:?}");
    }

    #[test]
    #[ignore = "takes minutes"]
    fn stacks() {
        listed(&["layered: "]);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn principled_3_4() {
        listed(&["principled: ", "version: 3.4"]);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn principled_5_0() {
        listed(&["principled: ", "version: 5.0"]);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn openpbr() {
        listed(&["openpbr: "]);
    }

    /// One interface of this roughness over white bases of all kinds.
    fn through(alpha: f32) {
        for ior in [1.2, 1.5, 2.5] {
            for base in [
                "conductor: {alpha: 0}",
                "diffuse: {}",
                "rough_diffuse: {alpha: 0.5}",
            ] {
                let yaml = format!(
                    "layered: {{interfaces: [{{alpha: {alpha}, ior: {ior}}}], base: {{{base}}}}}"
                );
                returns_all_to_three_digits(&yaml, [0.8, 0.2]);
            }
        }
    }

    #[test]
    #[ignore = "takes minutes"]
    fn alpha_0() {
        through(0.0);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn alpha_0_05() {
        through(0.05);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn alpha_0_2() {
        through(0.2);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn alpha_0_5() {
        through(0.5);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn alpha_1() {
        through(1.0);
    }
}

#[test]
fn a_smooth_slab_lets_light_straight_through() {
    let yaml = "layered: {interfaces: [{alpha: 0}, {alpha: 0, ior: 1}]}";
    let mut rng = stream(9);
    for cos in [0.7, -0.4] {
        let wo = slanted(cos);
        let bsdf = bsdf(yaml, wo);
        assert!(!bsdf.has_smooth());
        for _ in 0..100 {
            let sample = bsdf.sample(wo, 0.5, &mut rng).expect("nothing absorbs");
            let mirrored = Vec3::new(-wo.x, -wo.y, wo.z);
            let expected = if sample.wi.z * wo.z < 0.0 {
                -wo
            } else {
                mirrored
            };
            assert!(sample.delta && sample.wi.distance(expected) < 1e-5);
        }
    }
}

/// Nodes by walks are the stacks that they stand for, but for rounding.
#[test]
fn nodes_by_walks_are_stacks() {
    let pairs = [
        (
            "principled: {version: 4.5, layering: walks, base_color: [0.8, 0.2, 0.1], roughness: 0.4, ior: 1.6}",
            "layered: {interfaces: [{ior: 1.6, roughness: 0.4}], base: {diffuse: {color: [0.8, 0.2, 0.1]}}}",
        ),
        (
            "openpbr: {base_color: [0.8, 0.2, 0.1], coat_weight: 1}",
            "layered: {interfaces: [{ior: 1.6, roughness: 0}, {ior: 1.5, roughness: 0.3}], base: {diffuse: {color: [0.8, 0.2, 0.1]}}}",
        ),
        (
            "principled: {version: 5.0, layering: walks, base_color: 0.9, metallic: 1, roughness: 0.4, coat_weight: 1, coat_roughness: 0.2, coat_ior: 1.4}",
            "layered: {interfaces: [{ior: 1.4, roughness: 0.2}], base: {conductor: {f0: 0.9, edge_tint: 1, roughness: 0.4}}}",
        ),
    ];
    let (wo, wi) = (slanted(0.7), Vec3::new(-0.3, 0.4, 0.75_f32.sqrt()));
    for (node, stack) in pairs {
        let values = [node, stack].map(|yaml| {
            let bsdf = bsdf(yaml, wo);
            let mut rng = stream(11);
            let mut sum = Vec3::ZERO;
            for _ in 0..100 {
                sum += bsdf.eval(wo, wi, &mut rng).total();
            }
            (sum, bsdf.pdf(wo, wi))
        });
        let [(node_sum, node_pdf), (sum, pdf)] = values;
        assert!(
            sum.max_element() > 0.0 && sum.abs_diff_eq(node_sum, 1e-5 * sum.max_element()),
            "{node}: {node_sum}, not {sum}"
        );
        assert!((node_pdf - pdf).abs() <= 1e-5 * pdf, "{node}");
    }
}

/// A smooth interface over Lambert's law:
/// F + (1 − F)(1 − F̄)ρ/(1 − ρF̄), with F̄ the mean reflectance from inside.
#[test]
fn plastic_has_the_albedo_of_the_closed_form() {
    let eta = 1.5;
    let fresnel = |cos| smithwalk_model::fresnel::dielectric(cos, 1.0 / eta).0;
    let steps = 200_000;
    let inside: f64 = (0..steps)
        .map(|i| {
            let cos2 = (f64::from(i) + 0.5) / f64::from(steps);
            fresnel(cos2.sqrt()) / f64::from(steps)
        })
        .sum();
    let yaml = "layered: {interfaces: [{alpha: 0}], base: {diffuse: {color: 0.5}}}";
    let wo = slanted(0.6);
    let outside = smithwalk_model::fresnel::dielectric(f64::from(wo.z), eta).0;
    let expected = outside + (1.0 - outside) * (1.0 - inside) * 0.5 / (1.0 - 0.5 * inside);
    let bsdf = bsdf(yaml, wo);
    for mean in albedos(&bsdf, wo, 100_000, &mut stream(10)) {
        let score = (mean.of() - expected) / mean.error();
        assert!(
            score.abs() < 5.0,
            "{} ± {}, not {expected}",
            mean.of(),
            mean.error()
        );
    }
}
