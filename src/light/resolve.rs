//! From the watts and degrees of a scene file to radiometry.

use super::{
    AreaLight, Beam, Bulb, Environment, Light, Outline, PointLight, Shape, SunLight, World,
};
use crate::color::Rgb;
use crate::description::{self, AreaShape, LightKind, LightUnits};
use crate::texture::EnvironmentImage;
use glam::{Affine3A, EulerRot, Mat3};
use std::f32::consts::PI;
use std::path::Path;

/// Suns of a smaller half-angle, in radians, are parallel light: directions in
/// f32 tell no more.
const LEAST_SUN: f32 = 1e-6;

/// Why a light can't be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LightError {
    /// An area light with a width, a height or a scale of zero, or beyond f32.
    #[error(
        "the light has no area: its width, its height or its transform's scale is 0, or too large or too small to compute with"
    )]
    NoArea,
    /// A transform that flattens the light's axes.
    #[error("the light has no direction: its transform's scale is 0 along an axis")]
    NoDirection,
    /// A NaN or an infinity.
    #[error("the light's transform, color and power must be finite numbers")]
    NotFinite,
}

/// Turns a light as Cycles has it into radiance and intensity. `to_world` is
/// the light's transform.
///
/// With P in watts and colour folded in, per steradian and square metre:
/// points and spots shine with P/4π, area lights with P/(πA) (before Blender
/// 4.0: P/(4A)), suns with strength/(π sin²(angle/2)) (before: tan², by which
/// a wide sun fell short of its strength by cos²(angle/2)). Point lights keep
/// their radius whatever the scale.
///
/// # Errors
/// [`LightError`], when there is no such light.
pub fn resolve_light(
    light: &description::Light,
    to_world: Affine3A,
    units: LightUnits,
) -> Result<Light, LightError> {
    let linear = Mat3::from(to_world.matrix3);
    let position = to_world.translation.into();
    let color = Rgb::from(light.color) * light.exposure.exp2();
    if !(to_world.is_finite() && color.is_finite()) {
        return Err(LightError::NotFinite);
    }
    let finite = |c: Rgb| c.is_finite().then_some(c).ok_or(LightError::NotFinite);
    let shape = match light.kind {
        LightKind::Point {
            power,
            radius,
            soft_falloff,
        } => {
            let bulb = if soft_falloff || units == LightUnits::Cycles3 {
                Bulb::Disk(radius)
            } else {
                Bulb::Sphere(radius)
            };
            let intensity = finite(color * power / (4.0 * PI))?;
            Shape::Point(PointLight::new(position, intensity, bulb, None))
        }
        LightKind::Spot {
            power,
            size,
            blend,
            radius,
        } => {
            let cosine = units == LightUnits::Cycles3;
            let beam = Beam::new(linear, size.to_radians() / 2.0, blend, cosine)
                .ok_or(LightError::NoDirection)?;
            let intensity = finite(color * power / (4.0 * PI))?;
            Shape::Point(PointLight::new(
                position,
                intensity,
                Bulb::Disk(radius),
                Some(beam),
            ))
        }
        LightKind::Sun { strength, angle } => {
            let towards = linear
                .z_axis
                .as_dvec3()
                .try_normalize()
                .ok_or(LightError::NoDirection)?
                .as_vec3();
            let irradiance = finite(color * strength)?;
            let half_angle = angle.to_radians() / 2.0;
            Shape::Sun(if half_angle < LEAST_SUN {
                SunLight::parallel(towards, irradiance)
            } else {
                let radiance = |ratio: f32| irradiance / (PI * ratio * ratio);
                match units {
                    LightUnits::Cycles4 => {
                        SunLight::disk(towards, half_angle, radiance(half_angle.sin()))
                    }
                    LightUnits::Cycles3 => {
                        SunLight::flat_disk(towards, half_angle, radiance(half_angle.tan()))
                    }
                }
            })
        }
        LightKind::Area {
            power,
            shape,
            spread,
        } => {
            let (outline, size) = match shape {
                AreaShape::Rectangle { width, height } => (Outline::Rectangle, [width, height]),
                AreaShape::Disk { width, height } => (Outline::Ellipse, [width, height]),
            };
            let spread = spread.to_radians();
            let bare = AreaLight::new(position, linear, outline, size, Rgb::ONE, spread)
                .ok_or(LightError::NoArea)?;
            let per_area = match units {
                LightUnits::Cycles4 => PI,
                LightUnits::Cycles3 => 4.0,
            };
            let radiance = finite(color * power / per_area / bare.area())?;
            Shape::Area(bare.with_radiance(radiance))
        }
    };
    Ok(Light {
        shape,
        seen_by: light.seen_by(),
    })
}

/// Turns the surroundings into radiance; `load` reads the image when there is
/// one. What does not shine becomes constant black.
///
/// # Errors
/// Those of `load`.
pub fn resolve_world<E>(
    world: &description::World,
    load: impl FnOnce(&Path) -> Result<EnvironmentImage, E>,
) -> Result<World, E> {
    Ok(match world {
        description::World::Constant {
            color, strength, ..
        } => World::Constant(Rgb::from(*color) * *strength),
        description::World::Environment {
            file,
            strength,
            color,
            rotation,
            hidden_from: _,
        } => {
            let scale = Rgb::from(*color) * *strength;
            let [x, y, z] = rotation.map(f32::to_radians);
            // About x first: the last factor.
            let to_image = Mat3::from_euler(EulerRot::ZYX, z, y, x);
            match Environment::new(load(file)?, scale, to_image) {
                Some(environment) => World::Environment(Box::new(environment)),
                None => World::Constant(Rgb::ZERO),
            }
        }
    })
}
