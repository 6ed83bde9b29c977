//! Layered surfaces against what they stand for: parallel planes with the renderer's own
//! surfaces, a centimetre apart, that rays are traced between.

use crate::common::{Settings, film};
use smithwalk::description::Description;
use smithwalk::memory::Budget;
use smithwalk::mesh::Mesh;
use smithwalk::scene::{Assets, Resolved, assemble};
use smithwalk::texture::EnvironmentImage;
use std::collections::BTreeMap;

/// A stack as one surface, and as planes from the top.
struct Stack {
    layered: &'static str,
    planes: &'static [&'static str],
}

/// Smooth and rough interfaces over all kinds of bases, with absorption.
const STACKS: [Stack; 5] = [
    Stack {
        layered: "interfaces: [{alpha: 0}], base: {diffuse: {color: 0.8}}",
        planes: &["dielectric: {alpha: 0}", "diffuse: {color: 0.8}"],
    },
    Stack {
        layered: "interfaces: [{alpha: 0.3}], base: {diffuse: {color: 0.5}}",
        planes: &["dielectric: {alpha: 0.3}", "diffuse: {color: 0.5}"],
    },
    Stack {
        layered: "interfaces: [{alpha: 0.1, absorption: 30, thickness: 0.01}], base: {conductor: {alpha: 0.3, color: 0.9}}",
        planes: &[
            "filled: {surface: {dielectric: {alpha: 0.1}}, absorption: 30}",
            "conductor: {alpha: 0.3, color: 0.9}",
        ],
    },
    Stack {
        layered: "interfaces: [{alpha: 0.5, ior: 1.8}], base: {rough_diffuse: {alpha: 0.5, color: 0.9}}",
        planes: &[
            "dielectric: {alpha: 0.5, ior: 1.8}",
            "rough_diffuse: {alpha: 0.5, color: 0.9}",
        ],
    },
    Stack {
        layered: "interfaces: [{alpha_x: 0.1, alpha_y: 0.4}, {alpha: 0.4, ior: 1.2, distribution: beckmann}], base: {conductor: {alpha: 0.2}}",
        planes: &[
            "dielectric: {alpha_x: 0.1, alpha_y: 0.4}",
            "dielectric: {alpha: 0.4, ior: 0.8, distribution: beckmann}",
            "conductor: {alpha: 0.2}",
        ],
    },
];

/// Half a side of the planes, in metres: light that leaves by their edges is lost.
const HALF: f32 = 50.0;

fn plane() -> Mesh {
    let corner = |x: f32, y: f32| [HALF * x, HALF * y, 0.0];
    Mesh {
        positions: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        uvs: Some(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// Surroundings that are uneven: a bright window in a dim sky.
fn sky() -> EnvironmentImage {
    let (width, height) = (64, 32);
    let pixel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let window = (20..30).contains(&x) && (5..11).contains(&y);
        [if window { 6.0 } else { 0.3 }; 3]
    };
    EnvironmentImage {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
    }
}

/// The radiance of such planes a centimetre apart towards a camera at this cosine, and
/// its standard error from pixels that all show the same: of as many images of `spp`
/// samples per pixel as make the error at most this part of the radiance. Images by the
/// same seed are off together, so each has the next of `seeds`.
fn radiance(
    planes: &[String],
    cos: f32,
    spp: u32,
    most_error: f64,
    seeds: &mut impl Iterator<Item = u64>,
) -> [f64; 2] {
    let sin = (1.0 - cos * cos).sqrt();
    let mut text = format!(
        "smithwalk: 1\n\
         camera: {{projection: {{orthographic: {{scale: 0.001}}}}, transform: {{look_at: {{from: [{}, 0, {}], to: [0, 0, 0]}}}}}}\n\
         film: {{width: 16, height: 16}}\n\
         sampling: {{max_bounces: 1000, branches: 1}}\n\
         world: {{environment: {{file: sky.exr}}}}\n\
         meshes: {{plane: {{file: plane.obj}}}}\n\
         materials:\n",
        10.0 * sin,
        10.0 * cos
    );
    for (index, material) in planes.iter().enumerate() {
        text += &format!("  m{index}: {{{material}}}\n");
    }
    text += "objects:\n";
    for index in 0..planes.len() {
        let z = -0.01 * index as f32;
        text += &format!(
            "  - {{mesh: plane, material: m{index}, transform: {{location: [0, 0, {z}]}}}}\n"
        );
    }
    let description = Description::from_str(&text, "planes", &[])
        .unwrap_or_else(|problems| panic!("{text}\n{problems}"));
    let assets = Assets {
        meshes: BTreeMap::from([("plane".to_owned(), plane())]),
        environment: Some(sky()),
        ..Assets::default()
    };
    let resolved: Resolved = assemble(&description, assets, &Budget::of_machine()).unwrap();
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for seed in seeds {
        let settings = Settings {
            seed,
            ..Settings::spp(spp)
        };
        for pixel in film(&resolved, settings, &[]).develop().color {
            let value = f64::from(pixel[0]);
            count += 1.0;
            sum += value;
            squares += value * value;
        }
        let mean = sum / count;
        let error = ((squares / count - mean * mean) / (count - 1.0)).sqrt();
        if error <= most_error * mean {
            return [mean, error];
        }
    }
    unreachable!("there is always another seed");
}

/// Compares all stacks from three angles, and says how far both are apart.
fn compare(spp: u32, most_error: f64) {
    let mut seeds = 1..;
    for stack in &STACKS {
        let layered = [format!("layered: {{{}}}", stack.layered)];
        let planes: Vec<String> = stack.planes.iter().map(|&m| m.to_owned()).collect();
        for cos in [0.95, 0.6, 0.25] {
            let each = most_error / std::f64::consts::SQRT_2;
            let [one, one_error] = radiance(&layered, cos, spp, each, &mut seeds);
            let [other, other_error] = radiance(&planes, cos, spp, each, &mut seeds);
            let error = one_error.hypot(other_error);
            println!(
                "cosθ {cos}, {}: layered {one:.5} ± {one_error:.5}, planes {other:.5} ± {other_error:.5}, {:+.2} % ± {:.2} %",
                stack.layered,
                100.0 * (one / other - 1.0),
                100.0 * error / other
            );
            assert!(
                (one - other).abs() < 5.0 * error,
                "{}: {one} ± {one_error}, planes {other} ± {other_error}",
                stack.layered
            );
        }
    }
}

/// 15 comparisons of 5 standard errors: a false alarm every 100,000 runs.
#[test]
fn layers_are_what_rays_between_planes_find() {
    compare(24, 0.08);
}

/// The same with standard errors of 0.3 % at the most: `cargo test --release --test suite
/// explicit_stack -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes"]
fn layers_are_what_rays_between_planes_find_to_three_digits() {
    compare(8192, 0.003);
}
