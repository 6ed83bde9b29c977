//! Cycles' light units, value by value, as measured with Blender 3.4.1, 4.5
//! and 5.0. `P` is 200 W, the shading point 3 m below the light.

use crate::light::common::*;
use glam::{Affine3A, Mat3, Quat, Vec3};
use smithwalk::description::{self, AreaShape, LightKind, LightUnits, Transform};
use smithwalk::embree::Ray;
use smithwalk::light::{Light, LightError, Lights, resolve_light};
use smithwalk::rays::RayKind;
use std::f64::consts::PI;

const POWER: f32 = 200.0;
const BOTH: [LightUnits; 2] = [LightUnits::Cycles3, LightUnits::Cycles4];

fn description(kind: LightKind) -> description::Light {
    description::Light {
        name: None,
        transform: Transform::default(),
        color: [1.0; 3],
        exposure: 0.0,
        visible_to_camera: false,
        hidden_from: Vec::new(),
        kind,
    }
}

fn above() -> Affine3A {
    Affine3A::from_translation(Vec3::new(0.0, 0.0, 3.0))
}

fn resolved(kind: LightKind, to_world: Affine3A, units: LightUnits) -> Light {
    resolve_light(&description(kind), to_world, units).unwrap()
}

fn lights(kind: LightKind, units: LightUnits) -> Lights {
    Lights::new(vec![resolved(kind, above(), units)], black(), Vec::new())
}

/// The radiance that a ray straight up meets.
fn radiance(lights: &Lights) -> f64 {
    let mut radiance = f64::NAN;
    lights.crossed(
        &Ray::new(Vec3::ZERO, Vec3::Z),
        None,
        RayKind::Diffuse,
        |met, _, _| {
            radiance = f64::from(met.x);
        },
    );
    radiance
}

#[track_caller]
fn assert_close(measured: f64, expected: f64) {
    assert!(
        (measured / expected - 1.0).abs() < 1e-5,
        "{measured} for {expected}"
    );
}

fn up(lights: &Lights) -> f64 {
    irradiance(lights, Vec3::ZERO, Vec3::Z, 50_000, 90).mean
}

#[test]
fn a_point_has_intensity_p_over_four_pi() {
    for units in BOTH {
        let lights = lights(
            LightKind::Point {
                power: POWER,
                radius: 0.0,
                soft_falloff: true,
            },
            units,
        );
        assert_close(up(&lights), 200.0 / (4.0 * PI) / 9.0);
    }
}

#[test]
fn a_bulb_has_radiance_p_over_four_pi_squared_r_squared() {
    let kind = |soft_falloff| LightKind::Point {
        power: POWER,
        radius: 0.5,
        soft_falloff,
    };
    let intensity = 200.0 / (4.0 * PI);
    for (units, soft, distance_squared) in [
        (LightUnits::Cycles3, true, 9.25),
        // 3.x knows only the disk.
        (LightUnits::Cycles3, false, 9.25),
        (LightUnits::Cycles4, true, 9.25),
        (LightUnits::Cycles4, false, 9.0),
    ] {
        let lights = lights(kind(soft), units);
        assert_close(radiance(&lights), 200.0 / (4.0 * PI * PI * 0.25));
        let estimate = irradiance(&lights, Vec3::ZERO, Vec3::Z, 50_000, 91);
        estimate.assert_is(intensity / distance_squared, "a bulb");
    }
}

#[test]
fn a_spot_had_a_cosine_before_4() {
    let kind = LightKind::Spot {
        power: POWER,
        size: 90.0,
        blend: 0.0,
        radius: 0.0,
    };
    let p = Vec3::new(3.0 * 0.5, 0.0, 0.0);
    let cos = 3.0 / f64::from(p.length().hypot(3.0));
    let facing = (Vec3::Z * 3.0 - p).normalize();
    let expected = 200.0 / (4.0 * PI) * cos * cos / 9.0;
    for (units, factor) in [(LightUnits::Cycles3, cos), (LightUnits::Cycles4, 1.0)] {
        let measured = irradiance(&lights(kind, units), p, facing, 10, 92).mean;
        assert_close(measured, expected * factor);
    }
}

#[test]
fn an_area_light_had_p_over_four_before_4() {
    for (shape, area) in [
        (
            AreaShape::Rectangle {
                width: 1.5,
                height: 1.0,
            },
            1.5,
        ),
        (
            AreaShape::Disk {
                width: 1.5,
                height: 1.0,
            },
            1.5 * PI / 4.0,
        ),
    ] {
        let kind = LightKind::Area {
            power: POWER,
            shape,
            spread: 180.0,
        };
        assert_close(radiance(&lights(kind, LightUnits::Cycles3)), 50.0 / area);
        assert_close(
            radiance(&lights(kind, LightUnits::Cycles4)),
            200.0 / PI / area,
        );
        // Scale counts into the area, not into the power.
        let scaled = above() * Affine3A::from_scale(Vec3::new(2.0, 3.0, 1.0));
        let light = resolved(kind, scaled, LightUnits::Cycles4);
        let lights = Lights::new(vec![light], black(), Vec::new());
        assert_close(radiance(&lights), 200.0 / PI / (6.0 * area));
    }
}

#[test]
fn a_sun_is_its_irradiance() {
    let kind = |angle| LightKind::Sun {
        strength: 3.0,
        angle,
    };
    for units in BOTH {
        assert_close(up(&lights(kind(0.0), units)), 3.0);
    }
    let half = 10.0_f64.to_radians();
    let sine = 3.0 / (PI * half.sin().powi(2));
    let tangent = 3.0 / (PI * half.tan().powi(2));
    assert_close(radiance(&lights(kind(20.0), LightUnits::Cycles4)), sine);
    assert_close(radiance(&lights(kind(20.0), LightUnits::Cycles3)), tangent);
    // It shines along its local −z.
    let turned = Affine3A::from_quat(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
    let light = resolved(kind(0.0), turned, LightUnits::Cycles4);
    let lights = Lights::new(vec![light], black(), Vec::new());
    let sample = lights.sample(Vec3::ZERO, 0.5, [0.5; 2]).unwrap();
    assert!((sample.direction - Vec3::X).length() < 1e-6);
}

#[test]
fn color_and_exposure_multiply() {
    let kind = LightKind::Point {
        power: POWER,
        radius: 0.0,
        soft_falloff: true,
    };
    let light = description::Light {
        color: [1.0, 0.5, 0.25],
        exposure: 2.0,
        ..description(kind)
    };
    let light = resolve_light(&light, above(), LightUnits::Cycles4).unwrap();
    let lights = Lights::new(vec![light], black(), Vec::new());
    let sample = lights.sample(Vec3::ZERO, 0.5, [0.5; 2]).unwrap();
    let expected = Vec3::new(1.0, 0.5, 0.25) * (4.0 * POWER / (4.0 * PI as f32) / 9.0);
    assert!((sample.radiance - expected).length() < 1e-4 * expected.length());
}

#[test]
fn impossible_lights_are_refused() {
    let area = |width, height| LightKind::Area {
        power: POWER,
        shape: AreaShape::Rectangle { width, height },
        spread: 180.0,
    };
    let refused = |kind, to_world| {
        resolve_light(&description(kind), to_world, LightUnits::Cycles4).unwrap_err()
    };
    assert_eq!(refused(area(0.0, 1.0), above()), LightError::NoArea);
    assert_eq!(refused(area(1e-30, 1e-30), above()), LightError::NoArea);
    let flat = Affine3A::from_mat3(Mat3::from_diagonal(Vec3::new(1.0, 1.0, 0.0)));
    let sun = LightKind::Sun {
        strength: 1.0,
        angle: 0.0,
    };
    assert_eq!(refused(sun, flat), LightError::NoDirection);
    let nan = Affine3A::from_translation(Vec3::splat(f32::NAN));
    assert_eq!(refused(area(1.0, 1.0), nan), LightError::NotFinite);
}
