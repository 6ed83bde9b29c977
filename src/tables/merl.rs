//! MERL's binary of isotropic BRDFs (Matusik, Pfister, Brand and McMillan 2003, "A
//! Data-Driven Reflectance Model").

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::TableError;
use super::estimate::Source;

/// Steps of θ_h, θ_d and φ_d.
const SIZE: [usize; 3] = [90, 90, 180];

/// What readers multiply the channels by.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// The file: three `i32` of the size, then `f64` of f, sr⁻¹, divided by the scales of
/// the channels, channel by channel, in steps of √θ_h, θ_d and φ_d, the last running
/// fastest. Values are those in the middle of a step, as readers take the nearest;
/// where a direction is below the horizon they are 0.
///
/// # Errors
/// If light goes through.
pub fn merl(source: &Source<'_>) -> Result<Vec<u8>, TableError> {
    if source.transmits() {
        return Err(TableError::Transmits);
    }
    let count: usize = SIZE.iter().product();
    let values: Vec<[f64; 3]> = (0..count)
        .into_par_iter()
        .map(|index| {
            let [light, viewer] = directions(index);
            if light.z <= 0.0 || viewer.z <= 0.0 {
                return [0.0; 3];
            }
            let (wi, wo) = (light.as_vec3(), viewer.as_vec3());
            let found = source.scattered(wo, wi, 1, index as u64);
            found.value.map(|x| x / light.z)
        })
        .collect();
    let mut file: Vec<u8> = SIZE
        .iter()
        .flat_map(|&n| (n as i32).to_le_bytes())
        .collect();
    for (channel, scale) in SCALE.into_iter().enumerate() {
        file.extend(
            values
                .iter()
                .flat_map(|value| (value[channel] / scale).to_le_bytes()),
        );
    }
    Ok(file)
}

/// ω_i and ω_o of a cell: half and difference angles of Rusinkiewicz 1998, "A New
/// Change of Variables for Efficient BRDF Representation".
fn directions(index: usize) -> [DVec3; 2] {
    let [halves, differences, azimuths] = SIZE;
    let part = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let root = part(index / azimuths / differences, halves);
    let theta_h = FRAC_PI_2 * root * root;
    let theta_d = FRAC_PI_2 * part(index / azimuths % differences, differences);
    let phi_d = PI * part(index % azimuths, azimuths);
    let (sin, cos) = theta_d.sin_cos();
    let light = DVec3::new(sin * phi_d.cos(), sin * phi_d.sin(), cos);
    let viewer = DVec3::new(-light.x, -light.y, light.z);
    let turn = DQuat::from_rotation_y(theta_h);
    [turn * light, turn * viewer]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cell that a reader finds for two directions is the one they come from.
    #[test]
    fn cells_are_found_again() {
        for index in [0, 1, 179, 180, 54_321, 1_000_000, 1_457_999] {
            let [light, viewer] = directions(index);
            let half = (light + viewer).normalize();
            let (theta_h, phi_h) = (half.z.acos(), half.y.atan2(half.x));
            let difference =
                DQuat::from_rotation_y(-theta_h) * (DQuat::from_rotation_z(-phi_h) * light);
            let theta_d = difference.z.acos();
            let phi_d = difference.y.atan2(difference.x).rem_euclid(PI);
            let cell = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
            let found = (cell((theta_h / FRAC_PI_2).sqrt(), SIZE[0]) * SIZE[1]
                + cell(theta_d / FRAC_PI_2, SIZE[1]))
                * SIZE[2]
                + cell(phi_d / PI, SIZE[2]);
            assert_eq!(found, index);
        }
    }
}
