//! Normal maps from afar: what a pixel does not resolve makes the surface rougher.

use std::f64::consts::TAU;
use std::path::Path;

use crate::common::{Settings, folder, image};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Pixels of the normal map along a side, over 1 m.
const SIDE: usize = 256;
/// Waves that the surface is made of: periods over the square in x and y, phase,
/// height in metres.
struct Waves(Vec<([f64; 2], f64, f64)>);

impl Waves {
    /// Slopes of this root mean square along each axis, of Gaussian distribution in
    /// about.
    fn new(rms: f64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let mut waves = Vec::new();
        for _ in 0..200 {
            let angle = rng.random_range(0.0..TAU);
            let periods = rng.random_range(10.0..20.0);
            let [x, y] = [angle.cos(), angle.sin()].map(|c: f64| (c * periods).round());
            if x != 0.0 || y != 0.0 {
                waves.push(([x, y], rng.random_range(0.0..TAU), 1.0));
            }
        }
        let mut waves = Self(waves);
        for wave in &mut waves.0 {
            wave.2 = 1.0 / (wave.0[0].hypot(wave.0[1]) * TAU);
        }
        let mut squares = 0.0;
        for i in 0..SIDE * SIDE {
            let [p, q] = waves.slope(place(i % SIDE), place(i / SIDE));
            squares += (p * p + q * q) / 2.0;
        }
        let scale = rms / (squares / (SIDE * SIDE) as f64).sqrt();
        for wave in &mut waves.0 {
            wave.2 *= scale;
        }
        waves
    }

    fn height(&self, x: f64, y: f64) -> f64 {
        let wave = |([i, j], phase, height): &([f64; 2], f64, f64)| {
            height * (TAU * (i * x + j * y) + phase).cos()
        };
        self.0.iter().map(wave).sum()
    }

    fn slope(&self, x: f64, y: f64) -> [f64; 2] {
        let mut slope = [0.0; 2];
        for ([i, j], phase, height) in &self.0 {
            let rise = -height * TAU * (TAU * (i * x + j * y) + phase).sin();
            slope[0] += rise * i;
            slope[1] += rise * j;
        }
        slope
    }
}

/// The centre of a pixel.
fn place(index: usize) -> f64 {
    (index as f64 + 0.5) / SIDE as f64
}

/// A square of 3 m with the map of 1 m on it, and one of the shape itself.
fn write(folder: &Path, waves: &Waves) {
    let map = image::ImageBuffer::from_fn(SIDE as u32, SIDE as u32, |x, y| {
        let [p, q] = waves.slope(place(x as usize), place(SIDE - 1 - y as usize));
        let length = (p * p + q * q + 1.0).sqrt();
        image::Rgb([-p, -q, 1.0].map(|c| ((c / length * 0.5 + 0.5) * 65535.0).round() as u16))
    });
    map.save(folder.join("n.png")).unwrap();
    let flat = "v -1 -1 0\nv 2 -1 0\nv 2 2 0\nv -1 2 0\nvt -1 -1\nvt 2 -1\nvt 2 2\nvt -1 2\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.join("flat.obj"), flat).unwrap();
    const CELLS: usize = 440;
    let mut explicit = String::new();
    let step = |index: usize| index as f64 * 1.25 / CELLS as f64 - 0.125;
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            let height = waves.height(step(i), step(j));
            explicit += &format!("v {} {} {height}\n", step(i), step(j));
        }
    }
    for j in 0..CELLS {
        for i in 0..CELLS {
            let a = j * (CELLS + 1) + i + 1;
            let b = a + CELLS + 1;
            explicit += &format!("f {a} {} {} {b}\n", a + 1, b + 1);
        }
    }
    std::fs::write(folder.join("explicit.obj"), explicit).unwrap();
    std::fs::write(folder.join("scene.yaml"), SCENE).unwrap();
}

const SCENE: &str = "\
smithwalk: 1
camera:
  transform: {look_at: {from: [0.5, -1.5, 4], to: [0.5, 0.5, 0]}}
  projection: {orthographic: {scale: 1, sensor_fit: horizontal}}
film: {width: 256, height: 256}
textures: {n: {file: n.png}}
materials:
  map: {conductor: {distribution: beckmann, alpha: 0.1, metal: gold, normal: {texture: n, filter: slopes}}}
  plain: {conductor: {distribution: beckmann, alpha: 0.1, metal: gold}}
meshes: {flat: {file: flat.obj}, explicit: {file: explicit.obj}}
objects: [{mesh: flat, material: map}]
lights:
  - {area: {shape: {rectangle: {width: 2, height: 2}}, power: 100, transform: {look_at: {from: [0.5, 2.5, 4], to: [0.5, 0.5, 0], up: [1, 0, 0]}}}}
world: {constant: {color: [0.5, 0.6, 0.8], strength: 0.3}}
";

/// Of each image.
const SAMPLES: u32 = 1 << 20;

fn mean(path: &Path, pixels: u32, objects: &str) -> f64 {
    let side = pixels.to_string();
    let overrides = [
        ("film.width", side.as_str()),
        ("film.height", &side),
        ("objects", objects),
    ];
    let spp = SAMPLES / (pixels * pixels);
    let image = image_of(path, &overrides, spp);
    let sum: f64 = image.iter().flatten().map(|&c| f64::from(c)).sum();
    sum / image.len() as f64 / 3.0
}

fn image_of(path: &Path, overrides: &[(&str, &str)], spp: u32) -> Vec<[f32; 3]> {
    image(path, overrides, Settings::spp(spp), &[]).color
}

/// The camera sees 1 m across, so that pixels are 1 and 64 texels wide. Means of 10⁶
/// samples have a standard error of .1 %, so that 1 % is far from chance. Footprints
/// that hold a part of a wave alone, as 8 texels do here, are too bright: see
/// docs/layers.md. Takes minutes:
/// `cargo test --release --test suite -- leadr --ignored --nocapture`.
#[test]
#[ignore = "takes minutes"]
fn a_normal_map_from_afar_shines_as_from_near_and_as_the_shape_itself() {
    let folder = folder("leadr");
    write(&folder, &Waves::new(0.12));
    let path = folder.join("scene.yaml");
    let map = "[{mesh: flat, material: map}]";
    let explicit = mean(&path, 256, "[{mesh: explicit, material: plain}]");
    let [near, far] = [256, 4].map(|pixels| mean(&path, pixels, map));
    println!("explicit {explicit}, 1 texel {near}, 64 texels {far}");
    assert!((far / near - 1.0).abs() < 0.01);
    for seen in [near, far] {
        assert!((seen / explicit - 1.0).abs() < 0.02);
    }
}
