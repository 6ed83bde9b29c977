//! The irradiance that samples give, against closed forms.

use crate::light::common::*;
use glam::{DVec3, Mat3, Vec3};
use smithwalk::light::{AreaLight, Beam, Bulb, Lights, Outline, PointLight, Shape, SunLight};
use smithwalk::rays::RayKinds;
use std::f32::consts::PI;
use std::f64::consts::PI as PI64;

const N: usize = 40_000;

fn tilted(degrees: f32) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new(sin, 0.0, cos)
}

#[test]
fn points_follow_the_inverse_square() {
    let lights = lamps([bulb(Vec3::new(0.0, 0.0, 2.0), 3.0, Bulb::Point)]);
    let estimate = irradiance(&lights, Vec3::ZERO, tilted(60.0), 10, 1);
    estimate.assert_is(3.0 * 0.5 / 4.0, "a point");
}

#[test]
fn soft_bulbs_keep_their_intensity() {
    for (d, r) in [(2.0, 0.5), (0.1, 1.0), (1e-3, 1.0), (100.0, 0.01)] {
        let lights = lamps([bulb(Vec3::new(0.0, 0.0, d), 3.0, Bulb::Disk(r))]);
        // The disk stays above the horizon of a plane that faces it.
        let expected = 3.0 / f64::from(d * d + r * r);
        irradiance(&lights, Vec3::ZERO, Vec3::Z, N, 2).assert_is(expected, "a facing disk");
    }
    // Tilted, while the disk (half-angle 14°) stays above the horizon.
    let lights = lamps([bulb(Vec3::new(0.0, 0.0, 2.0), 3.0, Bulb::Disk(0.5))]);
    let expected = 3.0 * 0.5 / (4.0 + 0.25);
    irradiance(&lights, Vec3::ZERO, tilted(60.0), N, 3).assert_is(expected, "a tilted disk");
}

#[test]
fn spheres_shine_as_their_projection() {
    for (d, r) in [(2.0, 0.5), (1.01, 1.0), (100.0, 0.01)] {
        let lights = lamps([bulb(Vec3::new(0.0, 0.0, d), 3.0, Bulb::Sphere(r))]);
        // E = πL (r/d)², and πL r² is the intensity.
        let expected = 3.0 / f64::from(d * d);
        irradiance(&lights, Vec3::ZERO, Vec3::Z, N, 4).assert_is(expected, "a sphere");
    }
    // From inside it is a uniform hemisphere: πL = I/r².
    let lights = lamps([bulb(Vec3::new(0.2, 0.1, 0.3), 3.0, Bulb::Sphere(0.5))]);
    irradiance(&lights, Vec3::ZERO, tilted(20.0), N, 5).assert_is(12.0, "inside a sphere");
}

#[test]
fn suns_give_their_irradiance() {
    let sun = SunLight::parallel(tilted(60.0), Vec3::splat(2.0));
    irradiance(&lamps([Shape::Sun(sun)]), Vec3::ZERO, Vec3::Z, 10, 6)
        .assert_is(1.0, "parallel light");
    for half_angle in [1e-5_f32, 0.004_65, 0.2, 1.2] {
        let radiance = 2.0 / (PI * half_angle.sin().powi(2));
        let sun = SunLight::disk(Vec3::Z, half_angle, Vec3::splat(radiance));
        irradiance(&lamps([Shape::Sun(sun)]), Vec3::ZERO, Vec3::Z, N, 7).assert_is(2.0, "a sun");
    }
}

#[test]
fn disks_agree_with_the_coaxial_formula() {
    for (d, r) in [(2.0, 0.5), (0.5, 1.0), (30.0, 0.1)] {
        let disk = area(
            Vec3::new(0.0, 0.0, d),
            Outline::Ellipse,
            [2.0 * r, 2.0 * r],
            5.0,
        );
        let (d, r) = (f64::from(d), f64::from(r));
        let expected = 5.0 * PI64 * r * r / (r * r + d * d);
        irradiance(&lamps([disk]), Vec3::ZERO, Vec3::Z, 4 * N, 8).assert_is(expected, "a disk");
    }
}

#[test]
fn far_ellipses_shine_by_their_area() {
    let ellipse = area(
        Vec3::new(0.0, 0.0, 1000.0),
        Outline::Ellipse,
        [2.0, 0.5],
        5.0,
    );
    let expected = 5.0 * PI64 * 0.25 / 1e6;
    irradiance(&lamps([ellipse]), Vec3::ZERO, Vec3::Z, N, 9).assert_is(expected, "an ellipse");
}

#[test]
fn rectangles_agree_with_lamberts_formula() {
    // Near, off the side, grazing, far, tiny, and needles. 2⁻¹⁰ m, so that
    // the triangles' corners are exact in f32.
    for (center, size) in [
        ([0.0, 0.0, 1.0], [1.5, 1.0]),
        ([2.0, 1.0, 0.5], [1.5, 1.0]),
        ([0.3, -0.2, 0.05], [3.0, 4.0]),
        ([8.0, 0.0, 2.0], [1.0, 1.0]),
        ([0.0, 3.0, 50.0], [1.0, 0.2]),
        ([0.0, 3.0, 5.0], [0.0009765625; 2]),
        ([0.0, 0.0, 1.0], [10.0, 0.0009765625]),
    ] {
        let center = Vec3::from(center);
        let rectangle = area(center, Outline::Rectangle, size, 2.0);
        let expected = 2.0 * lambert(&corners(center, size, Vec3::ZERO), DVec3::Z);
        let name = format!("a rectangle at {center} of {size:?}");
        irradiance(&lamps([rectangle]), Vec3::ZERO, Vec3::Z, 4 * N, 10).assert_is(expected, &name);
        if center.z < 0.1 {
            // Triangles are sampled by area, whose variance has no bound near by.
            continue;
        }
        let triangles = Lights::new(Vec::new(), black(), quad(center, size, 2.0));
        irradiance(&triangles, Vec3::ZERO, Vec3::Z, 10 * N, 11)
            .assert_is(expected, &format!("{name} in triangles"));
    }
}

#[test]
fn rectangles_turn_with_their_transform() {
    // Shines along +x from (−3, 0, 0.5), width along y.
    let to_world = Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::NEG_X);
    let turned = |to_world| {
        AreaLight::new(
            Vec3::new(-3.0, 0.0, 0.5),
            to_world,
            Outline::Rectangle,
            [2.0, 1.0],
            Vec3::ONE,
            PI,
        )
        .unwrap()
    };
    let normal = Vec3::NEG_X;
    let corners: Vec<DVec3> = [[-1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[y, z]| DVec3::new(-3.0, y, z))
        .to_vec();
    let expected = lambert(&corners, normal.as_dvec3());
    // A mirrored transform still shines along its own −z.
    let mirrored = Mat3::from_cols(-to_world.x_axis, to_world.y_axis, to_world.z_axis);
    for to_world in [to_world, mirrored] {
        let light = turned(to_world);
        assert!((light.area() - 2.0).abs() < 1e-6);
        irradiance(&lamps([Shape::Area(light)]), Vec3::ZERO, normal, 4 * N, 12)
            .assert_is(expected, "a turned rectangle");
    }
    let away = turned(Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X));
    let mut rng = rng(13);
    let lights = lamps([Shape::Area(away)]);
    assert!((0..100).all(|_| lights.sample(Vec3::ZERO, 0.5, pair(&mut rng)).is_none()));
}

/// A light with a spread, far below it on the axis and off it.
#[test]
fn a_spread_narrows_and_keeps_the_power() {
    for degrees in [1.0_f32, 20.0, 90.0, 150.0, 180.0] {
        let spread = degrees.to_radians();
        for outline in [Outline::Rectangle, Outline::Ellipse] {
            // 1 mm seen from 10 m: its profile is that of the formula.
            let light = AreaLight::new(
                Vec3::ZERO,
                Mat3::IDENTITY,
                outline,
                [1e-3, 1e-3],
                Vec3::ONE,
                spread,
            )
            .unwrap();
            let light_area = f64::from(light.area());
            let lights = lamps([Shape::Area(light)]);
            let h = (PI64 - f64::from(spread)) / 2.0;
            let limit = f64::from(spread) / 2.0;
            let mut total = 0.0;
            let steps = 400;
            for step in 0..steps {
                let theta = (f64::from(step) + 0.5) / f64::from(steps) * limit;
                let (sin, cos) = theta.sin_cos();
                let p = DVec3::new(sin, 0.0, -cos) * 10.0;
                let facing = -p.normalize().as_vec3();
                let measured = irradiance(&lights, p.as_vec3(), facing, 32, 14).mean;
                let tan_h = if degrees == 180.0 { 0.0 } else { h.tan() };
                let profile =
                    (1.0 - tan_h * theta.tan()).max(0.0) * 2.0 / (2.0 + (2.0 * h - PI64) * tan_h);
                let expected = light_area * cos * profile / 100.0;
                // The light's own extent blurs the profile by 1e-4 rad.
                let blur =
                    light_area / 100.0 * 2e-4 * (1.0 + tan_h) * profile.max(1.0) / limit.min(1.0);
                assert!(
                    (measured - expected).abs() <= blur + 1e-3 * expected,
                    "{degrees}° at {theta}: {measured} for {expected}"
                );
                total += measured * 100.0 * 2.0 * PI64 * sin * limit / f64::from(steps);
            }
            // Whatever the spread, the power is πA·L.
            let expected = PI64 * light_area;
            assert!(
                (total / expected - 1.0).abs() < 0.01,
                "{degrees}°: {total} for {expected}"
            );
        }
    }
}

#[test]
fn a_near_spread_agrees_with_quadrature() {
    let spread = 40.0_f32.to_radians();
    for (outline, size) in [
        (Outline::Rectangle, [2.0, 1.0]),
        (Outline::Ellipse, [2.0, 1.0]),
    ] {
        let light = AreaLight::new(
            Vec3::new(0.3, 0.1, 1.0),
            Mat3::IDENTITY,
            outline,
            size,
            Vec3::ONE,
            spread,
        )
        .unwrap();
        // ∫ L(θ) cos²θ/d² dA by the midpoint rule.
        let tan_h = f64::from((PI - spread) / 2.0).tan();
        let norm = 2.0 / (2.0 - f64::from(spread) * tan_h);
        let n = 1000;
        let mut expected = 0.0;
        for i in 0..n * n {
            let s = (f64::from(i % n) + 0.5) / f64::from(n) - 0.5;
            let t = (f64::from(i / n) + 0.5) / f64::from(n) - 0.5;
            if outline == Outline::Ellipse && s * s + t * t > 0.25 {
                continue;
            }
            let at = DVec3::new(0.3 + s * 2.0, 0.1 + t, 1.0);
            let cos = 1.0 / at.length();
            let tan = at.x.hypot(at.y);
            let radiance = (1.0 - tan_h * tan).max(0.0) * norm;
            expected += radiance * cos.powi(4) * 2.0 / f64::from(n * n);
        }
        let lights = lamps([Shape::Area(light)]);
        let estimate = irradiance(&lights, Vec3::ZERO, Vec3::Z, 10 * N, 15);
        estimate.assert_is(expected, "a spread near by");
        check_crossings(&lights, Vec3::ZERO, 2000, 16, 1e-3);
    }
}

#[test]
fn spots_have_the_step_of_their_cone() {
    // 60° with a blend of 0.5: full inside of cos = (1 + cos 30°)/2 … .
    let half_angle = PI / 6.0;
    for cosine in [false, true] {
        let beam = Beam::new(Mat3::IDENTITY, half_angle, 0.5, cosine).unwrap();
        let spot = PointLight::new(
            Vec3::new(0.0, 0.0, 2.0),
            Vec3::splat(5.0),
            Bulb::Point,
            Some(beam),
        );
        let lights = lamps([Shape::Point(spot)]);
        for degrees in [0.0_f32, 10.0, 20.0, 25.0, 29.0, 29.99] {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let p = Vec3::new(2.0 * (sin / cos) as f32, 0.0, 0.0);
            let edge = (PI64 / 6.0).cos();
            let t = ((cos - edge) / ((1.0 - edge) * 0.5)).clamp(0.0, 1.0);
            let step = t * t * (3.0 - 2.0 * t) * if cosine { cos } else { 1.0 };
            let facing = (Vec3::new(0.0, 0.0, 2.0) - p).normalize();
            let expected = 5.0 * step * cos * cos / 4.0;
            let measured = irradiance(&lights, p, facing, 2, 17).mean;
            assert!(
                (measured - expected).abs() < 1e-5 * 5.0 / 4.0,
                "{degrees}°: {measured} for {expected}"
            );
        }
        assert!(lights.sample(Vec3::X * 2.0, 0.5, [0.5; 2]).is_none());
    }
    // No blend: a hard edge.
    let beam = Beam::new(Mat3::IDENTITY, half_angle, 0.0, false).unwrap();
    assert_eq!(beam.profile(-tilted(29.9)), 1.0);
    assert_eq!(beam.profile(-tilted(30.1)), 0.0);
    // Twice as wide along x.
    let wide = Mat3::from_diagonal(Vec3::new(2.0, 1.0, 1.0));
    let beam = Beam::new(wide, half_angle, 0.0, false).unwrap();
    assert_eq!(beam.profile(-tilted(49.0)), 1.0);
    assert_eq!(beam.profile(-tilted(49.2)), 0.0);
}

#[test]
fn many_lights_add_up() {
    let sun = Shape::Sun(SunLight::disk(Vec3::Z, 0.1, Vec3::splat(4.0)));
    let sun_irradiance = 4.0 * PI64 * 0.1_f64.sin().powi(2);
    let rectangle_at = Vec3::new(0.5, 0.0, 1.5);
    let rectangle = area(rectangle_at, Outline::Rectangle, [1.0, 1.0], 1.0);
    let quad_at = Vec3::new(-2.0, 1.0, 2.0);
    let one_sided = lambert(&corners(rectangle_at, [1.0; 2], Vec3::ZERO), DVec3::Z);
    let triangles = lambert(&corners(quad_at, [1.0; 2], Vec3::ZERO), DVec3::Z);
    // As few as are compared at every point, and so many that a tree decides.
    for points in [3, 100] {
        let mut shapes = vec![sun, rectangle];
        let mut expected = sun_irradiance + one_sided + 3.0 * triangles;
        for i in 0..points {
            let at = Vec3::new(i as f32 * 0.1 - 1.0, 1.0, 2.0);
            shapes.push(bulb(at, 0.1, Bulb::Point));
            let at = at.as_dvec3();
            expected += 0.1 * at.z / at.length().powi(3);
        }
        let lamps = shapes
            .into_iter()
            .map(|shape| smithwalk::light::Light {
                shape,
                seen_by: RayKinds::ALL,
            })
            .collect();
        let lights = Lights::new(lamps, black(), quad(quad_at, [1.0; 2], 3.0));
        irradiance(&lights, Vec3::ZERO, Vec3::Z, 20 * N, 18)
            .assert_is(expected, &format!("{points} points, a sun, and areas"));
    }
}
