//! The surroundings: orientation, densities, energy.

use crate::light::common::*;
use glam::{DVec3, Mat3, Vec3};
use rand::RngExt;
use smithwalk::description;
use smithwalk::light::{Environment, Lights, World, resolve_world};
use smithwalk::texture::EnvironmentImage;
use std::f64::consts::PI;

fn lights(environment: Environment) -> Lights {
    Lights::new(
        Vec::new(),
        World::Environment(Box::new(environment)),
        Vec::new(),
    )
}

fn noise(width: usize, height: usize, seed: u64) -> Vec<[f32; 3]> {
    let mut rng = rng(seed);
    (0..width * height)
        .map(|_| [rng.random::<f32>().powi(8) * 10.0; 3])
        .collect()
}

fn image(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> EnvironmentImage {
    EnvironmentImage {
        width,
        height,
        pixels,
    }
}

fn unturned(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Option<Environment> {
    Environment::new(image(width, height, pixels), Vec3::ONE, Mat3::IDENTITY)
}

/// As a scene file asks for it, with Blender's Euler angles in degrees.
fn turned(image: EnvironmentImage, rotation: [f32; 3]) -> Environment {
    let world = description::World::Environment {
        hidden_from: Vec::new(),
        file: "sky.exr".into(),
        strength: 2.0,
        color: [0.5; 3],
        rotation,
    };
    match resolve_world::<()>(&world, |_| Ok(image)) {
        Ok(World::Environment(environment)) => *environment,
        other => panic!("{other:?} is no environment"),
    }
}

/// The irradiance on the side of `normal` by a light sample and a cosine sample
/// each, with the power heuristic's weights: neither finds all light alone.
fn by_both(lights: &Lights, normal: Vec3, n: usize, seed: u64) -> Estimate {
    let mut rng = rng(seed);
    let heuristic = |own: f64, other: f64| own * own / (own * own + other * other);
    let cosine = |d: Vec3| f64::from(d.dot(normal).max(0.0)) / PI;
    Estimate::of(n, || {
        let light = lights.sample(Vec3::ZERO, 0.5, pair(&mut rng));
        let sampled = light.map_or(0.0, |light| {
            let (own, other) = (f64::from(light.pdf), cosine(light.direction));
            f64::from(light.radiance.x) * PI * other / own * heuristic(own, other)
        });
        // On the unit sphere round the tip of the normal: Lambert's law.
        let Some(towards) = (normal + direction(&mut rng)).try_normalize() else {
            return sampled;
        };
        let (radiance, other) = lights.world(Vec3::ZERO, towards);
        let own = cosine(towards);
        sampled + f64::from(radiance.x) * PI * heuristic(own.max(1e-12), other.into())
    })
}

#[test]
fn texels_are_where_blender_has_them() {
    // 8 × 4 texels of their own colours: (column, row, 0) plus one.
    let (width, height) = (8, 4);
    let pixels: Vec<[f32; 3]> = (0..width * height)
        .map(|i| [(i % width + 1) as f32, (i / width + 1) as f32, 0.0])
        .collect();
    let at = |rotation: [f32; 3], direction: Vec3| {
        let environment = turned(image(width, height, pixels.clone()), rotation);
        environment.radiance(direction.normalize())
    };
    let near = |a: Vec3, b: [f32; 2]| {
        assert!(
            (a.x - b[0]).abs() < 1e-4 && (a.y - b[1]).abs() < 1e-4,
            "{a} is not {b:?}"
        );
    };
    let identity = [0.0; 3];
    // +x is the middle of the image: between columns 4 and 5, rows 2 and 3.
    near(at(identity, Vec3::X), [4.5, 2.5]);
    // +y is a quarter to the left of it, −y to the right; −x is the seam.
    near(at(identity, Vec3::Y), [2.5, 2.5]);
    near(at(identity, Vec3::NEG_Y), [6.5, 2.5]);
    near(at(identity, Vec3::new(-1.0, 1e-9, 0.0)), [4.5, 2.5]);
    // Up is the first row.
    assert!((at(identity, Vec3::Z).y - 1.0).abs() < 1e-4);
    assert!((at(identity, Vec3::NEG_Z).y - 4.0).abs() < 1e-4);
    // The centre of column 3 (u = 2.5/8), row 2 (v = 2.5/4).
    let azimuth = 2.0 * PI * (0.5 - 2.5 / 8.0);
    let elevation = PI * (2.5 / 4.0 - 0.5);
    let direction = DVec3::new(
        elevation.cos() * azimuth.cos(),
        elevation.cos() * azimuth.sin(),
        elevation.sin(),
    );
    near(at(identity, direction.as_vec3()), [3.0, 2.0]);
    // A Mapping node that turns by 90° about z sends +x to where +y was.
    near(at([0.0, 0.0, 90.0], Vec3::X), [2.5, 2.5]);
    // First x by 90°: z to −y; then z by 90°: −y to +x.
    near(at([90.0, 0.0, 90.0], Vec3::Z), [4.5, 2.5]);
}

#[test]
fn a_grey_image_is_a_constant_world() {
    let pixels = vec![[1.0; 3]; 32 * 16];
    let environment = turned(image(32, 16, pixels), [0.0; 3]);
    let lights = lights(environment);
    by_both(&lights, Vec3::X, 200_000, 50).assert_is(PI, "a grey sky");
    let (radiance, pdf) = lights.world(Vec3::ZERO, Vec3::new(0.6, 0.0, 0.8));
    assert_eq!(radiance, Vec3::ONE);
    assert!((f64::from(pdf) * 4.0 * PI - 1.0).abs() < 1e-4);
}

/// Noise under a rotation, against quadrature over directions; and all of the
/// density, sampled and looked up.
#[test]
fn samples_agree_with_quadrature_and_their_density() {
    for (i, (width, height)) in [(16, 8), (5, 7), (1, 1), (2, 1), (64, 33)]
        .into_iter()
        .enumerate()
    {
        let pixels = noise(width, height, 60 + i as u64);
        let environment = turned(image(width, height, pixels), [30.0, -50.0, 110.0]);
        let normal = Vec3::new(0.3, 0.5, 0.8).normalize();
        // The midpoint rule in azimuth and z.
        let n = 1500;
        let mut expected = 0.0;
        for k in 0..n * n {
            let z = (f64::from(k % n) + 0.5) / f64::from(n) * 2.0 - 1.0;
            let (sin, cos) = ((f64::from(k / n) + 0.5) / f64::from(n) * 2.0 * PI).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let direction = DVec3::new(r * cos, r * sin, z).as_vec3();
            let cos = f64::from(direction.dot(normal).max(0.0));
            if cos > 0.0 {
                expected += f64::from(environment.radiance(direction).x) * cos;
            }
        }
        expected *= 4.0 * PI / f64::from(n * n);
        let lights = lights(environment);
        let name = format!("noise of {width} × {height}");
        by_both(&lights, normal, 400_000, 70).assert_is(expected, &name);

        let mut directions = rng(71);
        Estimate::of(1_000_000, || {
            let (_, pdf) = lights.world(Vec3::ZERO, direction(&mut directions));
            f64::from(pdf) * 4.0 * PI
        })
        .assert_is(1.0, &name);

        let mut rng = rng(72);
        let mut off = 0;
        for _ in 0..10_000 {
            let sample = lights.sample(Vec3::ZERO, 0.5, pair(&mut rng)).unwrap();
            let (radiance, pdf) = lights.world(Vec3::ZERO, sample.direction);
            let same = (pdf / sample.pdf - 1.0).abs() < 1e-3
                && (radiance - sample.radiance).length() < 1e-2 * radiance.length() + 1e-3;
            off += usize::from(!same);
        }
        // Next to an edge of a texel rounding may look up its neighbour.
        assert!(off <= 20, "{name}: {off} of 10000");
    }
}

/// Light samples leave to BSDF samples what is darker than half of the mean,
/// and nothing else.
#[test]
fn what_is_darker_than_half_of_the_mean_is_left_to_bsdf_samples() {
    // Columns of 1, 3 and 8: 2 is half of their mean; four of each, so that
    // interpolation leaves some texels alone.
    let (width, height) = (12, 4);
    let column = [1.0, 1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 3.0, 8.0, 8.0, 8.0, 8.0];
    let pixels = (0..width * height)
        .map(|i| [column[i % width]; 3])
        .collect();
    let lights = lights(unturned(width, height, pixels).unwrap());
    let density = |column: usize| {
        let azimuth = 2.0 * std::f32::consts::PI * (0.5 - (column as f32 + 0.5) / width as f32);
        let (sin, cos) = azimuth.sin_cos();
        lights.world(Vec3::ZERO, Vec3::new(cos, sin, 0.0)).1
    };
    assert_eq!(density(2), 0.0);
    assert!((density(9) / density(5) - 6.0).abs() < 1e-3);
}

#[test]
fn what_is_bright_has_a_density() {
    // One bright texel spreads by half a texel around through interpolation.
    let mut pixels = vec![[0.0; 3]; 16 * 8];
    pixels[3 * 16] = [1e6; 3];
    let environment = unturned(16, 8, pixels).unwrap();
    let lights = lights(environment);
    let mut rng = rng(80);
    let mut bright = 0;
    for _ in 0..200_000 {
        let (radiance, pdf) = lights.world(Vec3::ZERO, direction(&mut rng));
        if radiance.x > 0.0 {
            bright += 1;
            assert!(pdf > 0.0);
        }
    }
    assert!(bright > 1000);
}

#[test]
fn poles_of_fine_images_keep_their_digits() {
    // The polar row of 8192 spans less than one step of the sine in f32.
    let (width, height) = (2, 8192);
    let mut pixels = vec![[0.0; 3]; width * height];
    pixels[0] = [1.0; 3];
    pixels[1] = [1.0; 3];
    let environment = unturned(width, height, pixels).unwrap();
    let lights = lights(environment);
    let mut rng = rng(81);
    let row = PI / height as f64;
    let mut inner = 0;
    let n = 20_000;
    for _ in 0..n {
        // The lower half of the second row is black, and gives nothing.
        let Some(sample) = lights.sample(Vec3::ZERO, 0.5, pair(&mut rng)) else {
            continue;
        };
        let d = sample.direction.as_dvec3();
        let angle = d.x.hypot(d.y).atan2(d.z);
        assert!(angle < 2.0 * row * 1.001);
        inner += usize::from(angle < row);
        let (_, pdf) = lights.world(Vec3::ZERO, sample.direction);
        assert!(pdf > 0.0);
    }
    // Weights 0.875 and 0.125 over solid angles 1 and 3: 0.7 in the polar row.
    // Five standard deviations.
    let share = inner as f64 / f64::from(n);
    assert!(
        (share - 0.7).abs() < 5.0 * (0.21 / f64::from(n)).sqrt(),
        "{share}"
    );
}

#[test]
fn a_black_image_is_no_environment() {
    assert!(unturned(2, 1, vec![[0.0; 3]; 2]).is_none());
    let world = description::World::Environment {
        hidden_from: Vec::new(),
        file: "night.exr".into(),
        strength: 1.0,
        color: [1.0; 3],
        rotation: [0.0; 3],
    };
    let black = resolve_world::<()>(&world, |_| Ok(image(2, 1, vec![[0.0; 3]; 2])));
    let lights = Lights::new(Vec::new(), black.unwrap(), Vec::new());
    assert!(lights.is_empty());
    assert_eq!(lights.world(Vec3::ZERO, Vec3::Z), (Vec3::ZERO, 0.0));
}

#[test]
fn a_constant_world_is_not_sampled() {
    let world = description::World::Constant {
        hidden_from: Vec::new(),
        color: [1.0; 3],
        strength: 2.0,
    };
    let world = resolve_world::<()>(&world, |_| unreachable!()).unwrap();
    let lights = Lights::new(Vec::new(), world, Vec::new());
    assert!(lights.is_empty());
    assert!(lights.sample(Vec3::ZERO, 0.5, [0.5; 2]).is_none());
    assert_eq!(lights.world(Vec3::ZERO, Vec3::Z), (Vec3::splat(2.0), 0.0));
}
