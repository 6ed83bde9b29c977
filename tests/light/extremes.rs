//! Scenes far too small, far too large, and points where lights are not.

use crate::light::common::*;
use glam::{DVec3, Vec3};
use rand::RngExt;
use smithwalk::light::{Bulb, Lights, Outline, Shape, SunLight};
use smithwalk::rays::RayKind;

/// The shapes of a scene of size `s` with radiances that don't depend on it.
fn shapes(s: f32) -> Vec<Shape> {
    vec![
        bulb(Vec3::new(0.3, 0.1, 2.0) * s, s * s, Bulb::Point),
        bulb(Vec3::new(0.3, 0.1, 2.0) * s, s * s, Bulb::Disk(0.5 * s)),
        bulb(Vec3::new(0.3, 0.1, 2.0) * s, s * s, Bulb::Sphere(0.5 * s)),
        area(
            Vec3::new(0.3, 0.1, 2.0) * s,
            Outline::Rectangle,
            [s, 2.0 * s],
            1.0,
        ),
        area(
            Vec3::new(0.3, 0.1, 2.0) * s,
            Outline::Ellipse,
            [s, 2.0 * s],
            1.0,
        ),
    ]
}

#[test]
fn irradiance_does_not_depend_on_the_scale() {
    for s in [1e-8_f32, 1e-4, 1e6, 1e10] {
        let pairs = shapes(1.0).into_iter().zip(shapes(s));
        for (i, (unit, scaled)) in pairs.enumerate() {
            let reference = irradiance(&lamps([unit]), Vec3::ZERO, Vec3::Z, 2000, 100).mean;
            let estimate = irradiance(&lamps([scaled]), Vec3::ZERO, Vec3::Z, 2000, 100).mean;
            // The same random numbers: only rounding differs.
            assert!(
                (estimate / reference - 1.0).abs() < 1e-4,
                "shape {i} at {s}: {estimate} for {reference}"
            );
        }
        let triangles = quad(Vec3::new(0.3, 0.1, 2.0) * s, [s, 2.0 * s], 1.0);
        let lights = Lights::new(Vec::new(), black(), triangles);
        let corners = corners(Vec3::new(0.3, 0.1, 2.0), [1.0, 2.0], Vec3::ZERO);
        irradiance(&lights, Vec3::ZERO, Vec3::Z, 100_000, 101)
            .assert_is(lambert(&corners, DVec3::Z), "triangles");
        // Together, the choice between them must not break either.
        let all = irradiance(&lamps(shapes(s)), Vec3::ZERO, Vec3::Z, 100_000, 102);
        let reference = irradiance(&lamps(shapes(1.0)), Vec3::ZERO, Vec3::Z, 100_000, 102);
        assert!((all.mean / reference.mean - 1.0).abs() < 1e-3);
    }
}

/// From on, in, behind and near every light: whatever comes is finite.
#[test]
fn samples_are_finite_wherever_they_are_taken_from() {
    let mut points = vec![
        Vec3::new(0.3, 0.1, 2.0),
        Vec3::new(0.3, 0.1, 2.0 + 1e-7),
        Vec3::new(0.3, 0.1, 2.0 - 1e-6),
        // On the rim, on a corner, in the plane beside it, behind.
        Vec3::new(0.8, 0.1, 2.0),
        Vec3::new(0.8, 1.1, 2.0),
        Vec3::new(0.8, 1.1, 2.0 - 1e-6),
        Vec3::new(5.0, 0.1, 2.0),
        Vec3::new(0.3, 0.1, 3.0),
    ];
    for exponent in (-45..=38).step_by(3) {
        let step = 10.0_f32.powi(exponent);
        points.push(Vec3::new(0.3, 0.1, 2.0 - step));
        points.push(Vec3::new(step, -step, -step));
    }
    let mut rng = rng(110);
    let mut alone: Vec<Lights> = shapes(1.0)
        .into_iter()
        .map(|shape| lamps([shape]))
        .collect();
    alone.push(lamps(shapes(1.0)));
    alone.push(lamps(shapes(1.0).iter().cycle().take(60).copied()));
    alone.push(Lights::new(
        Vec::new(),
        black(),
        quad(Vec3::new(0.3, 0.1, 2.0), [1.0, 2.0], 1.0),
    ));
    for lights in &alone {
        for &p in &points {
            for _ in 0..200 {
                if let Some(sample) = lights.sample(p, rng.random(), pair(&mut rng)) {
                    assert!(sample.radiance.is_finite() && sample.radiance.x > 0.0);
                    assert!(sample.pdf.is_finite() && sample.pdf > 0.0);
                    assert!((sample.direction.length() - 1.0).abs() < 1e-5);
                    assert!(sample.distance > 0.0);
                }
                let ray = smithwalk::embree::Ray::new(p, direction(&mut rng));
                lights.crossed(&ray, None, RayKind::Diffuse, |radiance, pdf, _| {
                    assert!(radiance.is_finite() && pdf >= 0.0 && !pdf.is_nan());
                });
            }
        }
    }
    // The unit square's own corners, where maps have their seams.
    for u in [0.0, 0.5, 1.0 - f32::EPSILON / 2.0] {
        for v in [0.0, 0.5, 1.0 - f32::EPSILON / 2.0] {
            for lights in &alone {
                let sample = lights.sample(Vec3::ZERO, u, [u, v]).unwrap();
                assert!(sample.radiance.is_finite() && sample.pdf.is_finite());
            }
        }
    }
}

#[test]
fn lights_without_power_are_left_out() {
    let dark = [
        bulb(Vec3::Z, 0.0, Bulb::Point),
        area(Vec3::Z, Outline::Rectangle, [1.0; 2], 0.0),
        Shape::Sun(SunLight::parallel(Vec3::Z, Vec3::ZERO)),
    ];
    assert!(lamps(dark).is_empty());
    let lit = bulb(Vec3::Z, 1.0, Bulb::Point);
    let lights = lamps(dark.into_iter().chain([lit]));
    assert_eq!(lights.lamps().len(), 1);
    // No choice to make.
    assert_eq!(lights.sample(Vec3::ZERO, 0.3, [0.5; 2]).unwrap().pdf, 1.0);
    let triangles = quad(Vec3::Z, [1.0; 2], 0.0);
    assert!(Lights::new(Vec::new(), black(), triangles).is_empty());
}

#[test]
fn radiances_may_span_forty_decades() {
    for radiance in [1e-20_f32, 1e20] {
        let rectangle = area(Vec3::Z, Outline::Rectangle, [1.0; 2], radiance);
        let point = bulb(Vec3::Z * 2.0, radiance, Bulb::Point);
        let corners = corners(Vec3::Z, [1.0; 2], Vec3::ZERO);
        let expected = f64::from(radiance) * (lambert(&corners, DVec3::Z) + 0.25);
        irradiance(&lamps([rectangle, point]), Vec3::ZERO, Vec3::Z, 50_000, 120)
            .assert_is(expected, "bright or dark");
    }
}
