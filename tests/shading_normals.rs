//! Shading normals that differ from the triangle's: every white closure gives back all
//! light, to whoever looks, by sampling, by light samples and by both.

use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};

use glam::Vec3;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use smithwalk::bsdf::{Bsdf, seen_by_closures};
use smithwalk::description::{Description, Estimator, Material};
use smithwalk::embree::Ray;
use smithwalk::features::Features;
use smithwalk::memory::Budget;
use smithwalk::mesh::Mesh;
use smithwalk::scene::{self, Assets, Ground, Surface, View, assemble, compile_alone};
use smithwalk_model::{Draw, LANES, Stream};
use wide::f32x8;

type Rng = Stream<Pcg64Mcg>;

/// White closures of every kind, and whether light samples alone find them: lobes
/// that are not too narrow.
const MATERIALS: [(&str, bool); 13] = [
    ("diffuse: {color: [1, 1, 1]}", true),
    ("conductor: {alpha: 0}", false),
    ("dielectric: {alpha: 0, ior: 1.5}", false),
    ("conductor: {alpha: 0.1}", false),
    ("conductor: {alpha: 0.6}", true),
    ("conductor: {distribution: beckmann, alpha: 0.1}", false),
    ("conductor: {distribution: beckmann, alpha: 0.6}", true),
    ("conductor: {alpha_x: 0.6, alpha_y: 0.2}", false),
    ("dielectric: {alpha: 0.1, ior: 1.5}", false),
    ("dielectric: {alpha: 0.6, ior: 1.5}", true),
    (
        "dielectric: {distribution: beckmann, alpha: 0.6, ior: 1.5}",
        true,
    ),
    ("rough_diffuse: {alpha: 0.5}", true),
    (
        "mix: {factor: 0.4, a: {conductor: {alpha: 0.6}}, b: {diffuse: {color: [1, 1, 1]}}}",
        true,
    ),
];

/// Angles between the two normals, radians; the geometric one is z.
const TILTS: [f32; 4] = [0.02, 0.3, 0.9, 1.5];

fn material(text: &str) -> scene::Material {
    let material = Material::from_yaml(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    compile_alone(&material, Estimator::Auto).expect("no names")
}

/// The material on a horizontal surface whose shading normal leans towards x.
fn leaning(material: &scene::Material, tilt: f32, wo: Vec3) -> Bsdf {
    let normal = Vec3::new(tilt.sin(), 0.0, tilt.cos());
    let surface = Surface::horizontal(true).with_normal(normal);
    material.bsdf(Ground::default(), &surface, View { wo, camera: false })
}

fn uniform(rng: &mut Rng) -> Vec3 {
    let (u, v): (f32, f32) = (rng.draw(), rng.draw());
    let z = 1.0 - 2.0 * u;
    let (sin, cos) = (v * TAU).sin_cos();
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

const UNIFORM_PDF: f32 = 0.25 / PI;

#[derive(Default)]
struct Sums {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, value: f32) {
        let value = f64::from(value);
        self.n += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    /// Mean and standard error.
    fn mean(&self) -> (f64, f64) {
        let mean = self.sum / self.n;
        let variance = (self.squares / self.n - mean * mean).max(0.0);
        (mean, (variance / self.n).sqrt())
    }
}

/// Layers weigh what lies below by their own albedo: it must be the one that they have
/// for the viewer as closures see it, or coarse meshes would darken or shine.
#[test]
fn layers_weigh_each_other_for_the_viewer_that_closures_see() {
    for text in [
        "principled: {version: 3.4, base_color: 1, roughness: 0.3, clearcoat: 1, sheen: 1}",
        "principled: {version: 4.5, base_color: 1, roughness: 0.3, coat_weight: 1}",
        "principled: {version: 5.0, base_color: 1, roughness: 0, diffuse_roughness: 1}",
        "principled: {version: 5.0, base_color: 1, roughness: 0.2, transmission_weight: 0.5}",
        "diffuse: {color: 1, roughness: 1}",
    ] {
        let material = material(text);
        let mut rng = Stream(Pcg64Mcg::seed_from_u64(7));
        for tilt in TILTS {
            let normal = Vec3::new(tilt.sin(), 0.0, tilt.cos());
            for _ in 0..2_000 {
                let wo = uniform(&mut rng);
                let wo = wo * wo.z.signum();
                let seen = seen_by_closures(normal, Vec3::Z, wo);
                let mut surface = Surface::horizontal(true).with_normal(normal);
                let leaning: Bsdf =
                    material.bsdf(Ground::default(), &surface, View { wo, camera: false });
                surface.geometric_normal = normal;
                let view = View {
                    wo: seen,
                    camera: false,
                };
                let level: Bsdf = material.bsdf(Ground::default(), &surface, view);
                let choice = rng.draw();
                let weight = |bsdf: &Bsdf, wo: Vec3| {
                    let sample = bsdf.sample(wo, choice, &mut rng.clone());
                    sample.map_or(Vec3::ZERO, |s| s.weight)
                };
                let (ours, right) = (weight(&leaning, wo), weight(&level, seen));
                assert!(
                    (ours - right).abs().max_element() <= 2e-3 * right.max_element(),
                    "{text}, {tilt} rad, {wo}: {ours}, not {right}"
                );
                let _: f32 = rng.draw();
            }
        }
    }
}

/// 124 means at 5 standard errors (and 1e-4 for directions that rounding puts on the
/// wrong side): a false alarm in 10⁴ seeds.
#[test]
fn white_closures_give_back_all_light_from_above_the_true_surface() {
    for (index, (text, broad)) in MATERIALS.into_iter().enumerate() {
        let material = material(text);
        for tilt in TILTS {
            let mut rng = Stream(Pcg64Mcg::seed_from_u64(index as u64));
            let mut sums: [(&str, Sums); 3] = Default::default();
            for _ in 0..10_000 {
                let wo = uniform(&mut rng);
                let wo = wo * wo.z.signum();
                let bsdf = leaning(&material, tilt, wo);
                let choice = rng.draw();
                let sample = bsdf.sample(wo, choice, &mut rng);
                let weight = sample.map_or(0.0, |s| s.weight.x);
                let mut both = 0.0;
                if let Some(sample) = sample {
                    let pdf = bsdf.pdf(wo, sample.wi);
                    assert!(
                        sample.delta || (sample.pdf / pdf - 1.0).abs() < 1e-2,
                        "{text}, {tilt}: {pdf} for {sample:?}"
                    );
                    both += if sample.delta {
                        weight
                    } else {
                        weight * pdf / (pdf + UNIFORM_PDF)
                    };
                }
                let wi = uniform(&mut rng);
                let value = bsdf.eval(wo, wi, &mut rng).total().x;
                let pdf = bsdf.pdf(wo, wi);
                assert!(value == 0.0 || pdf > 0.0, "{text}, {tilt}: {wo}, {wi}");
                both += value / (pdf + UNIFORM_PDF);
                for (sum, (name, value)) in sums.iter_mut().zip([
                    ("BSDF samples", weight),
                    ("both", both),
                    ("light samples", value / UNIFORM_PDF),
                ]) {
                    sum.0 = name;
                    sum.1.add(value);
                }
            }
            for (name, sum) in &sums[..if broad { 3 } else { 2 }] {
                let (mean, error) = sum.mean();
                assert!(
                    (mean - 1.0).abs() <= 5.0 * error + 1e-4,
                    "{text}, {tilt} rad, {name}: {mean} ± {error}"
                );
            }
        }
    }
}

struct Eight([Rng; LANES]);

impl Draw<f32x8> for Eight {
    fn draw(&mut self) -> f32x8 {
        self.0.each_mut().map(|lane| -> f32 { lane.draw() }).into()
    }
}

/// 16 means at 5 standard errors of their difference: a false alarm in 10⁵ seeds.
#[test]
fn lanes_bend_directions_as_single_calls_do() {
    for text in [
        "conductor: {alpha: 0.6}",
        "conductor: {distribution: beckmann, alpha: 0.6}",
    ] {
        let material = material(text);
        for tilt in TILTS {
            let mut one = Stream(Pcg64Mcg::seed_from_u64(7));
            let lane = |i| Stream(Pcg64Mcg::seed_from_u64(8 + i as u64));
            let mut eight = Eight(std::array::from_fn(lane));
            for azimuth in [0.6f32, 2.5] {
                // A light beside the lune between the horizons; a viewer beside it, and
                // one that the larger tilts turn away from.
                let (sin, cos) = azimuth.sin_cos();
                let wo = Vec3::new(0.8 * cos, 0.8 * sin, 0.6);
                let wi = Vec3::new(0.96, 0.0, 0.28);
                let bsdf = leaning(&material, tilt, wo);
                let lanes = bsdf.in_lanes().expect("rough metals go in lanes");
                let (mut scalar, mut laned) = (Sums::default(), Sums::default());
                for _ in 0..500 {
                    for sample in lanes.sample(wo, &mut eight).into_iter().flatten() {
                        let expected = bsdf.pdf(wo, sample.wi);
                        assert!(
                            (sample.pdf / expected - 1.0).abs() < 1e-2,
                            "{text}, {tilt}: {expected} for {sample:?}"
                        );
                    }
                    for value in lanes.eval(wo, [wi; LANES], &mut eight) {
                        laned.add(value.total().x);
                        scalar.add(bsdf.eval(wo, wi, &mut one).total().x);
                    }
                }
                let ((a, ea), (b, eb)) = (scalar.mean(), laned.mean());
                assert!(a > 0.0, "{text}, {tilt}: nothing to compare");
                assert!(
                    (a - b).abs() <= 5.0 * ea.hypot(eb) + 1e-5 * a,
                    "{text}, {tilt}: {a} ± {ea} and {b} ± {eb}"
                );
            }
        }
    }
}

/// A mirrored texture, a mirrored object and a look from behind each turn the tangents'
/// handedness, and two of them turn it back.
#[test]
fn tangents_know_their_handedness() {
    for bits in 0..8 {
        let [texture, object, behind] = [1, 2, 4].map(|bit| bits & bit != 0);
        let sign = |mirrored| if mirrored { -1.0 } else { 1.0 };
        let text = format!(
            "smithwalk: 1\n\
             materials: {{m: {{conductor: {{alpha_x: 0.1, alpha_y: 0.2}}}}}}\n\
             meshes: {{quad: {{file: quad.obj}}}}\n\
             objects: [{{mesh: quad, material: m, transform: {{scale: [{}, 1, 1]}}}}]\n",
            sign(object)
        );
        let quad = Mesh {
            positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            uvs: Some(
                [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]]
                    .map(|[u, v]| [u * sign(texture), v])
                    .to_vec(),
            ),
            ..Mesh::default()
        };
        let description = Description::from_str(&text, "quad", &[]).expect("reads");
        let assets = Assets {
            meshes: BTreeMap::from([("quad".to_owned(), quad)]),
            ..Assets::default()
        };
        let scene = assemble(&description, assets, &Budget::of_machine())
            .expect("builds")
            .scene;
        let down = -sign(behind);
        let ray = Ray::new(Vec3::new(0.0, 0.0, -down), Vec3::new(0.0, 0.0, down));
        let hit = scene.accelerator.intersect(ray).expect("the quad is there");
        let surface = scene.surface::<{ Features::EVERYTHING.bits() }>(&ray, &hit);
        let along_v = Vec3::Y;
        let turn = surface.along_u.cross(along_v).dot(surface.normal);
        assert_eq!(surface.right_handed, turn > 0.0, "{bits}: {surface:?}");
        assert_eq!(surface.right_handed, !(texture ^ object ^ behind), "{bits}");
    }
}
