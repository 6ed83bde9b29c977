//! Many lights: none is lost, and they are no noisier than few.

use crate::light::common::*;
use glam::{Mat3, Vec3};
use rand::RngExt;
use smithwalk::embree::Ray;
use smithwalk::light::{
    AreaLight, Beam, Bulb, EmissiveTriangle, Environment, Light, Lights, Outline, PointLight,
    Receiver, Shape, SunLight, World,
};
use smithwalk::rays::{RayKind, RayKinds};
use smithwalk::texture::EnvironmentImage;
use std::collections::HashMap;
use std::f32::consts::PI;

/// Lamps of 10 W in a grid above a floor of 20 m, at heights of 1 m to 2 m.
fn above_the_floor(count: usize, power: f32) -> Vec<Shape> {
    let mut rng = rng(500);
    let side = (count as f32).sqrt().ceil();
    (0..count)
        .map(|i| {
            let at = |k: f32| (k + 0.5) / side * 20.0 - 10.0;
            let (x, y) = (i as f32 % side, (i as f32 / side).floor());
            let position = Vec3::new(at(x), at(y), 1.0 + rng.random::<f32>());
            bulb(position, power / (4.0 * PI), Bulb::Point)
        })
        .collect()
}

fn floor_points(count: usize) -> Vec<Vec3> {
    let mut rng = rng(501);
    (0..count)
        .map(|_| {
            Vec3::new(
                rng.random_range(-10.0..10.0),
                rng.random_range(-10.0..10.0),
                0.0,
            )
        })
        .collect()
}

/// The mean irradiance of the floor, its error, and the mean variance of one
/// sample over the squared mean of its point.
fn floor(lights: &Lights, points: &[Vec3], n: usize) -> (Estimate, f64) {
    let each: Vec<Estimate> = (0..)
        .zip(points)
        .map(|(seed, &position)| {
            let normal = Some(Vec3::Z);
            irradiance(
                lights,
                Receiver { position, normal },
                Vec3::Z,
                n,
                1000 + seed,
            )
        })
        .collect();
    let count = points.len() as f64;
    let sum = |f: &dyn Fn(&Estimate) -> f64| each.iter().map(f).sum::<f64>();
    let mean = sum(&|e| e.mean) / count;
    let error = sum(&|e| e.error * e.error).sqrt() / count;
    let noise = sum(&|e| (e.error / e.mean).powi(2)) * n as f64 / count;
    (Estimate { mean, error }, noise)
}

/// A lamp far away and a sun from below, which have most of the power and give
/// nothing: the mean is that of the two halves of the lamps, to .5 %, and the
/// error that is said is that of the mean, within a factor of two.
#[test]
fn no_light_is_lost_beside_stronger_ones() {
    let points = floor_points(64);
    let near = above_the_floor(40, 10.0);
    let halves: Vec<f64> = [&near[..20], &near[20..]]
        .into_iter()
        .map(|half| floor(&lamps(half.iter().copied()), &points, 20_000).0.mean)
        .collect();
    let expected = halves[0] + halves[1];
    for distance in [100.0, 1e3, 3e3, 7e3] {
        for sun in [false, true] {
            let far = bulb(
                Vec3::new(distance, 0.0, 2.0),
                10.0 / (4.0 * PI),
                Bulb::Point,
            );
            let sun = sun.then(|| Shape::Sun(SunLight::parallel(Vec3::NEG_Z, Vec3::splat(3.0))));
            let lights = lamps(near.iter().copied().chain([far]).chain(sun));
            let (all, noise) = floor(&lights, &points, 2000);
            let off = all.mean / expected - 1.0;
            assert!(
                off.abs() < 0.005,
                "{distance} m, {sun:?}: {off} ± {}",
                all.error / expected
            );
            assert!(off.abs() * expected < SIGMAS * all.error + 0.001 * expected);
            // Four times that of the lamps alone.
            assert!(noise < 1.0, "{distance} m: {noise}");
        }
    }
}

/// Each light is found as often as its density says: the mean of 1/p over the
/// samples that find it is 1. Lamps of sixteen decades of power among them, one
/// next to the point, some far away.
#[test]
fn probabilities_are_those_of_the_choice() {
    for count in [20, 33, 300, 5000] {
        let mut rng = rng(510);
        let mut at = || {
            let scale = 10.0_f32.powf(rng.random_range(-1.0..3.0));
            direction(&mut rng) * scale
        };
        let positions: Vec<Vec3> = (0..count).map(|_| at()).collect();
        let power = |i: usize| 10.0_f32.powi(i as i32 % 17 - 8);
        let lights = lamps((0..count).map(|i| bulb(positions[i], power(i), Bulb::Point)));
        for p in [Vec3::ZERO, positions[3] + Vec3::splat(1e-3)] {
            let n = 400_000;
            let mut found = HashMap::<[u32; 3], (u32, f32)>::new();
            for _ in 0..n {
                let sample = lights.sample(p, rng.random(), pair(&mut rng)).unwrap();
                let key = sample.direction.to_array().map(f32::to_bits);
                let entry = found.entry(key).or_insert((0, sample.pdf));
                assert_eq!(entry.1, sample.pdf, "one light, one density");
                entry.0 += 1;
            }
            let mut total = 0.0;
            for &(hits, pdf) in found.values() {
                let (mean, pdf) = (f64::from(hits) / f64::from(n), f64::from(pdf));
                let sigma = (pdf * (1.0 - pdf) / f64::from(n)).sqrt();
                // Poisson's tail is wider than that of a normal.
                let slack = 12.0 / f64::from(n);
                assert!(
                    (mean - pdf).abs() < 5.5 * sigma + slack,
                    "{count} lights: found with {mean}, said {pdf}"
                );
                total += pdf;
            }
            if found.len() == count {
                assert!((total - 1.0).abs() < 1e-4, "{total}");
            }
            // Five thousand floors of 1/64: each is found 1.2 times at least.
            assert!(found.len() > count * 6 / 10, "{} of {count}", found.len());
        }
    }
}

/// One more light does not bring another kind of choice.
#[test]
fn thirty_three_lights_are_no_noisier_than_thirty_two() {
    let points = floor_points(200);
    let noise = |count: usize| {
        let lights = lamps(above_the_floor(count, 400.0 / count as f32));
        floor(&lights, &points, 2000).1
    };
    let (few, many) = (noise(32), noise(33));
    assert!(many < few, "{many} beside {few}");
}

/// Ten thousand lights are no noisier than ten of the same power in all.
#[test]
fn ten_thousand_lights_are_no_noisier_than_ten() {
    let points = floor_points(200);
    let noise = |count: usize| {
        let lights = lamps(above_the_floor(count, 400.0 / count as f32));
        floor(&lights, &points, 1000).1
    };
    let (few, many) = (noise(10), noise(10_000));
    assert!(many < few, "{many} beside {few}");
}

fn spot(position: Vec3, to_world: Mat3, radius: f32) -> Shape {
    let beam = Beam::new(to_world, 0.5, 0.3, false);
    let bulb = if radius > 0.0 {
        Bulb::Disk(radius)
    } else {
        Bulb::Point
    };
    Shape::Point(PointLight::new(position, Vec3::splat(3.0), bulb, beam))
}

fn narrow(position: Vec3, to_world: Mat3) -> Shape {
    let size = [0.5, 1.0];
    let light = AreaLight::new(position, to_world, Outline::Ellipse, size, Vec3::ONE, 0.8);
    Shape::Area(light.expect("an area"))
}

/// Lamps of every kind turned every way, triangles, suns and an image.
struct Mixture {
    lamps: Vec<Shape>,
    triangles: Vec<EmissiveTriangle>,
    environment: Environment,
}

fn mixture() -> Mixture {
    let mut rng = rng(520);
    let mut lamps = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..60 {
        let position = direction(&mut rng) * rng.random_range(1.0..6.0);
        let z = direction(&mut rng);
        let (x, y) = z.any_orthonormal_pair();
        let turned = Mat3::from_cols(x, y, z);
        let squeezed = turned * Mat3::from_diagonal(Vec3::new(2.0, 0.7, 1.0));
        lamps.push(match i % 6 {
            0 => bulb(position, 0.5, Bulb::Point),
            1 => bulb(position, 0.5, Bulb::Sphere(0.3)),
            2 => spot(position, turned, 0.0),
            3 => spot(position, squeezed, 0.2),
            4 => narrow(position, turned),
            _ => {
                let size = [0.6, 0.3];
                let light = AreaLight::new(
                    position,
                    turned,
                    Outline::Rectangle,
                    size,
                    Vec3::splat(2.0),
                    PI,
                );
                Shape::Area(light.expect("an area"))
            }
        });
        let size = rng.random_range(0.1..0.6);
        triangles.extend(quad(-position, [size, 0.4], rng.random_range(0.1..2.0)));
    }
    lamps.push(Shape::Sun(SunLight::disk(
        Vec3::new(0.6, 0.0, 0.8),
        0.2,
        Vec3::splat(3.0),
    )));
    lamps.push(Shape::Sun(SunLight::parallel(
        Vec3::new(0.0, 0.8, 0.6),
        Vec3::splat(0.5),
    )));
    lamps.push(Shape::Sun(SunLight::parallel(
        Vec3::NEG_Z,
        Vec3::splat(2.0),
    )));
    let pixels = (0..32 * 16)
        .map(|i| [0.1 + (i % 7) as f32 * 0.05; 3])
        .collect();
    let image = EnvironmentImage {
        width: 32,
        height: 16,
        pixels,
    };
    Mixture {
        lamps,
        triangles,
        environment: Environment::new(image, Vec3::ONE, Mat3::IDENTITY).expect("it shines"),
    }
}

impl Mixture {
    fn lights(&self, lamps: &[Shape], triangles: &[EmissiveTriangle], image: bool) -> Lights {
        let lamps = lamps.iter().map(|&shape| Light {
            shape,
            seen_by: RayKinds::ALL,
        });
        let world = if image {
            World::Environment(Box::new(self.environment.clone()))
        } else {
            black()
        };
        Lights::new(lamps.collect(), world, triangles.to_vec())
    }
}

/// All kinds together give what their parts, few lights each, give apart.
#[test]
fn a_mixture_of_all_kinds_is_the_sum_of_its_parts() {
    let mixture = mixture();
    let all = mixture.lights(&mixture.lamps, &mixture.triangles, true);
    let mut parts = vec![mixture.lights(&[], &[], true)];
    parts.extend(
        mixture
            .lamps
            .chunks(16)
            .map(|lamps| mixture.lights(lamps, &[], false)),
    );
    parts.extend(
        mixture
            .triangles
            .chunks(16)
            .map(|t| mixture.lights(&[], t, false)),
    );
    let mut rng = rng(530);
    for seed in 0..6 {
        let p = direction(&mut rng) * rng.random_range(0.0..5.0);
        let normal = direction(&mut rng);
        let receiver = Receiver {
            position: p,
            normal: (seed % 2 == 0).then_some(normal),
        };
        let together = irradiance(&all, receiver, normal, 200_000, 540 + seed);
        let apart: Vec<Estimate> = parts
            .iter()
            .map(|part| irradiance(part, p, normal, 40_000, 550 + seed))
            .collect();
        let expected: f64 = apart.iter().map(|part| part.mean).sum();
        let variance: f64 = apart.iter().map(|part| part.error * part.error).sum();
        let error = together.error.hypot(variance.sqrt());
        Estimate { error, ..together }.assert_is(expected, &format!("at {p}"));
    }
}

/// What rays meet has the density that samples have, triangles and image apart.
#[test]
fn densities_of_a_mixture_agree() {
    let mixture = mixture();
    let sized = |shape: &&Shape| match shape {
        Shape::Point(_) | Shape::Area(_) => true,
        Shape::Sun(_) => false,
    };
    let all: Vec<Shape> = mixture.lamps.iter().filter(sized).copied().collect();
    let lights = mixture.lights(&all, &[], false);
    let apart: Vec<Lights> = all.iter().map(|&shape| lamps([shape])).collect();
    let mut rng = rng(560);
    let mut met = 0;
    for _ in 0..30_000 {
        let p = direction(&mut rng) * rng.random_range(0.0..6.0);
        let mut ray = Ray::new(p, direction(&mut rng));
        if rng.random() {
            ray.t_near = rng.random_range(0.0..2.0);
            ray.t_far = rng.random_range(2.0..6.0);
        }
        let mut found = Vec::new();
        lights.crossed(&ray, None, RayKind::Diffuse, |radiance, pdf, _| {
            found.push((radiance.x, pdf))
        });
        let mut expected = Vec::new();
        for light in &apart {
            light.crossed(&ray, None, RayKind::Diffuse, |radiance, pdf, _| {
                expected.push((radiance.x, pdf))
            });
        }
        assert_eq!(found.len(), expected.len(), "{ray:?}");
        let sum = |list: &[(f32, f32)]| list.iter().map(|l| l.0).sum::<f32>();
        assert!((sum(&found) - sum(&expected)).abs() <= 1e-5 * sum(&expected));
        met += found.len();
    }
    assert!(met > 500, "{met}");
    // Every sample of a lamp with size is met again with its density.
    let mut again = 0;
    for _ in 0..20_000 {
        let p = direction(&mut rng) * rng.random_range(0.0..6.0);
        let Some(sample) = lights.sample(p, rng.random(), pair(&mut rng)) else {
            continue;
        };
        if sample.delta {
            continue;
        }
        let mut ray = Ray::new(p, sample.direction);
        ray.t_far = sample.distance * 1.01;
        let mut same = false;
        lights.crossed(&ray, None, RayKind::Diffuse, |_, pdf, _| {
            same |= (pdf / sample.pdf - 1.0).abs() < 1e-3
        });
        again += i32::from(same) - i32::from(!same) * 1000;
    }
    // Rounding may miss the very rim a few times.
    assert!(again > 0, "{again}");
}
