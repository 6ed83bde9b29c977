//! Densities: they integrate to one, rays meet what is sampled, and samples
//! fall where the density says.

use crate::light::common::*;
use glam::{DVec3, Vec3};
use rand::RngExt;
use smithwalk::embree::Ray;
use smithwalk::light::{Bulb, EmitterId, Light, Lights, Outline, Shape, SunLight};
use smithwalk::rays::{RayKind, RayKinds};
use statrs::distribution::{ChiSquared, ContinuousCDF};

fn wide_lights() -> Vec<(&'static str, Shape)> {
    vec![
        (
            "a soft bulb",
            bulb(Vec3::new(0.2, 0.3, 0.5), 1.0, Bulb::Disk(0.7)),
        ),
        (
            "a sphere",
            bulb(Vec3::new(0.2, 0.3, 1.0), 1.0, Bulb::Sphere(0.7)),
        ),
        (
            "inside a sphere",
            bulb(Vec3::new(0.2, 0.3, 0.1), 1.0, Bulb::Sphere(0.7)),
        ),
        ("a sun", Shape::Sun(SunLight::disk(Vec3::Y, 0.6, Vec3::ONE))),
        (
            "a rectangle",
            area(
                Vec3::new(0.5, 0.2, 0.6),
                Outline::Rectangle,
                [1.5, 1.0],
                1.0,
            ),
        ),
        (
            "a disk",
            area(Vec3::new(0.5, 0.2, 0.6), Outline::Ellipse, [1.5, 1.0], 1.0),
        ),
        (
            "a rectangle sampled by area",
            area(
                Vec3::new(0.5, 0.2, 6.0),
                Outline::Rectangle,
                [1.8, 1.8],
                1.0,
            ),
        ),
    ]
}

#[test]
fn densities_integrate_to_one_and_rays_meet_what_is_sampled() {
    for (name, shape) in wide_lights() {
        let lights = lamps([shape]);
        total_density(&lights, Vec3::ZERO, 800_000, 21).assert_is(1.0, name);
        check_crossings(&lights, Vec3::ZERO, 4000, 22, 2e-4);
    }
}

#[test]
fn densities_of_several_lights_integrate_to_one() {
    let shapes: Vec<Shape> = wide_lights().into_iter().map(|(_, shape)| shape).collect();
    let lights = lamps(shapes.clone());
    total_density(&lights, Vec3::ZERO, 800_000, 23).assert_is(1.0, "all lights");
    check_crossings(&lights, Vec3::ZERO, 4000, 24, 2e-4);
    let many = lamps(shapes.iter().cycle().take(70).copied());
    total_density(&many, Vec3::ZERO, 400_000, 25).assert_is(1.0, "seventy lights");
}

/// The solid angle of a rectangle's part between the foot of the perpendicular
/// and (x, y), by the arc tangent.
fn solid_angle(x: f64, y: f64, z: f64) -> f64 {
    (x * y).atan2(z * DVec3::new(x, y, z).length())
}

/// Samples of a near rectangle fall into the cells of a grid in proportion to
/// the cells' solid angles: Pearson's χ² with 63 degrees of freedom, rejected
/// below p = 1e-6, five times.
#[test]
fn near_rectangles_are_sampled_in_solid_angle() {
    for (i, center) in [
        [0.0, 0.0, 1.0],
        [2.0, 1.0, 0.8],
        [0.4, -0.3, 0.02],
        [-1.5, 0.0, 0.5],
        [0.5, 0.5, 0.3],
    ]
    .into_iter()
    .enumerate()
    {
        let center = Vec3::from(center);
        let size = [1.5, 1.0];
        let lights = lamps([area(center, Outline::Rectangle, size, 1.0)]);
        let c = center.as_dvec3();
        const CELLS: usize = 8;
        let edge = |middle: f64, size: f32, k: usize| {
            middle + f64::from(size) * (k as f64 / CELLS as f64 - 0.5)
        };
        let cell = |k: usize, l: usize| {
            let at = |k, l| solid_angle(edge(c.x, size[0], k), edge(c.y, size[1], l), c.z);
            at(k + 1, l + 1) - at(k, l + 1) - at(k + 1, l) + at(k, l)
        };
        let total = {
            let at = |k, l| solid_angle(edge(c.x, size[0], k), edge(c.y, size[1], l), c.z);
            at(CELLS, CELLS) - at(0, CELLS) - at(CELLS, 0) + at(0, 0)
        };
        let n = 200_000;
        let mut counts = [[0_u32; CELLS]; CELLS];
        let mut rng = rng(30 + i as u64);
        for _ in 0..n {
            let sample = lights.sample(Vec3::ZERO, 0.5, pair(&mut rng)).unwrap();
            assert!((f64::from(sample.pdf) * total - 1.0).abs() < 1e-5);
            let at = (sample.direction * sample.distance).as_dvec3();
            let bin = |x: f64, size: f32| {
                let share = x / f64::from(size) + 0.5;
                ((share * CELLS as f64) as usize).min(CELLS - 1)
            };
            counts[bin(at.x - c.x, size[0])][bin(at.y - c.y, size[1])] += 1;
        }
        let mut chi_squared = 0.0;
        for (k, row) in counts.iter().enumerate() {
            for (l, &count) in row.iter().enumerate() {
                let expected = f64::from(n) * cell(k, l) / total;
                assert!(expected > 5.0, "{expected}");
                chi_squared += (f64::from(count) - expected).powi(2) / expected;
            }
        }
        let freedom = (CELLS * CELLS - 1) as f64;
        let p = ChiSquared::new(freedom).unwrap().sf(chi_squared);
        assert!(p > 1e-6, "{center}: χ² = {chi_squared}, p = {p}");
    }
}

#[test]
fn triangles_know_their_density() {
    // A textured one, a dark one that never is chosen, and a needle.
    let mut triangles = quad(Vec3::new(0.2, 0.1, 1.0), [1.0, 2.0], 1.0);
    triangles[1].radiance = Vec3::splat(3.0);
    let mut dark = triangles[0];
    dark.radiance = Vec3::ZERO;
    triangles.insert(1, dark);
    let mut needle = triangles[0];
    needle.vertices[2] = needle.vertices[1];
    triangles.push(needle);
    let lights = Lights::new(Vec::new(), black(), triangles.clone());
    let p = Vec3::new(0.5, -0.5, 0.2);
    let mut rng = rng(40);
    for _ in 0..10_000 {
        let sample = lights.sample(p, rng.random(), pair(&mut rng)).unwrap();
        let (emitter, [v, w]) = sample.emitter.unwrap();
        let [a, b, c] = triangles[emitter.0 as usize].vertices;
        let point = a * (1.0 - v - w) + b * v + c * w;
        assert!((p + sample.direction * sample.distance - point).length() < 1e-5);
        assert_eq!(sample.radiance, triangles[emitter.0 as usize].radiance);
        for normal in [Vec3::Z, Vec3::NEG_Z] {
            let pdf = lights.triangle_pdf(p, emitter, point, normal);
            assert!((pdf / sample.pdf - 1.0).abs() < 1e-4);
        }
    }
    for never in [1, 3] {
        assert_eq!(
            lights.triangle_pdf(p, EmitterId(never), Vec3::Z, Vec3::Z),
            0.0
        );
    }
    // ∫ pdf over the plane z = 1 as seen from p, by quadrature over area.
    let n = 400;
    let mut total = 0.0;
    for i in 0..n * n {
        let s = (i % n) as f32 / n as f32 + 0.5 / n as f32;
        let t = (i / n) as f32 / n as f32 + 0.5 / n as f32;
        let point = Vec3::new(0.2 + s - 0.5, 0.1 + 2.0 * t - 1.0, 1.0);
        let emitter = EmitterId(if s > t { 0 } else { 2 });
        let to = point - p;
        let per_area = to.normalize().z / to.length_squared();
        let pdf = lights.triangle_pdf(p, emitter, point, Vec3::Z);
        total += f64::from(pdf * per_area) * 2.0 / f64::from(n * n);
    }
    // Cells on the diagonal belong to either triangle: an error of 1/n.
    assert!((total - 1.0).abs() < 1.0 / f64::from(n), "{total}");
}

#[test]
fn camera_rays_see_only_visible_lights() {
    let shape = area(Vec3::Z, Outline::Rectangle, [1.0; 2], 2.0);
    for seen_by in [RayKinds::ALL, RayKinds::all_but([RayKind::Camera])] {
        let lamp = Light { shape, seen_by };
        let lights = Lights::new(vec![lamp], black(), Vec::new());
        let count = |ray: &Ray, kind| {
            let mut count = 0;
            lights.crossed(ray, None, kind, |_, _, _| count += 1);
            count
        };
        let mut ray = Ray::new(Vec3::ZERO, Vec3::Z);
        assert_eq!(count(&ray, RayKind::Glossy), 1);
        assert_eq!(
            count(&ray, RayKind::Camera),
            usize::from(seen_by == RayKinds::ALL)
        );
        ray.t_far = 0.9;
        assert_eq!(count(&ray, RayKind::Glossy), 0);
        // Behind the light there is nothing to see.
        assert_eq!(
            count(&Ray::new(Vec3::Z * 2.0, Vec3::NEG_Z), RayKind::Glossy),
            0
        );
    }
}

/// Shadow rays end at the light: how far a sample's point is from the surface
/// it should be on, by the surface's own equation.
#[test]
fn samples_lie_on_their_lights() {
    type Equation = fn(Vec3) -> f32;
    let center = Vec3::new(0.2, 0.3, 1.0);
    let near = Vec3::new(0.2, 0.3, 0.1);
    let cases: [(&str, Shape, Equation); 4] = [
        ("a sphere", bulb(center, 1.0, Bulb::Sphere(0.7)), |at| {
            // The side that faces the origin.
            let outward = (at - Vec3::new(0.2, 0.3, 1.0)) / 0.7;
            (outward.length() - 1.0).abs() + outward.dot(at).max(0.0)
        }),
        (
            "inside a sphere",
            bulb(near, 1.0, Bulb::Sphere(0.7)),
            |at| (at - Vec3::new(0.2, 0.3, 0.1)).length() - 0.7,
        ),
        ("a soft bulb", bulb(center, 1.0, Bulb::Disk(0.7)), |at| {
            let center = Vec3::new(0.2, 0.3, 1.0);
            let off_plane = (at - center).dot(center.normalize()).abs();
            off_plane + ((at - center).length() - 0.7).max(0.0)
        }),
        (
            "a disk",
            area(center, Outline::Ellipse, [1.0, 2.0], 1.0),
            |at| {
                let (x, y) = ((at.x - 0.2) / 0.5, at.y - 0.3);
                (at.z - 1.0).abs() + (x.hypot(y) - 1.0).max(0.0)
            },
        ),
    ];
    let mut rng = rng(50);
    for (name, shape, equation) in cases {
        let lights = lamps([shape]);
        for _ in 0..2000 {
            let sample = lights.sample(Vec3::ZERO, 0.5, pair(&mut rng)).unwrap();
            let off = equation(sample.direction * sample.distance);
            // A grazing view of the sphere doubles the digits lost: √ε.
            assert!(off.abs() < 1e-3, "{name}: {off}");
        }
    }
}
