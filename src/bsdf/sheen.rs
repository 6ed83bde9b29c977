//! Fibres on a surface, as Cycles 4 and later have them.

mod fit;

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::{BsdfSample, Lambert};
use crate::color::Rgb;
use fit::{B, DEGREE, LN_A, LOGIT_ALBEDO};
use smithwalk_model::Draw;

/// Light that a layer of fibres scatters back, as often as it comes: a linearly
/// transformed cosine lobe (Zeltner, Burley and Chiang 2022, "Practical
/// Multiple-Scattering Sheen Using Linearly Transformed Cosines").
///
/// Its parameters are a fit of our own to what Cycles 4.5 renders
/// (`blender/measure_sheen.py`): from a roughness of 0.1 on the albedo is within 0.0072
/// of the measured one, from 0.3 on within 0.0037, and the mean of ω_i within 0.011 and
/// 0.005. Below 0.1 roughness counts as 0.1.
#[derive(Clone, Copy, Debug)]
pub struct Sheen {
    /// A factor on its light.
    pub color: Rgb,
    /// The share of light that it scatters, without that factor.
    pub albedo: f32,
    a: f32,
    b: f32,
}

/// The range that the fit is for.
const LEAST_ROUGHNESS: f32 = 0.1;
const LEAST_COS: f32 = 0.02;

impl Sheen {
    /// Fibres as loose as `roughness`, 0 to 1, seen at the cosine `cos` ≥ 0.
    #[must_use]
    pub fn new(color: Rgb, roughness: f32, cos: f32) -> Self {
        let x = chebyshev(2.0 * roughness.clamp(LEAST_ROUGHNESS, 1.0) - 1.0);
        let y = chebyshev(2.0 * cos.clamp(LEAST_COS, 1.0).sqrt() - 1.0);
        let sum = |rows: &[[f32; DEGREE + 1]; DEGREE + 1]| -> f32 {
            let row =
                |row: &[f32; DEGREE + 1]| -> f32 { row.iter().zip(y).map(|(c, y)| c * y).sum() };
            rows.iter().zip(x).map(|(c, x)| row(c) * x).sum()
        };
        Self {
            color,
            albedo: 1.0 / (1.0 + (-sum(&LOGIT_ALBEDO)).exp()),
            a: sum(&LN_A).exp().clamp(0.02, 1.0),
            b: sum(&B).clamp(-0.3, 0.1),
        }
    }

    /// Draws from the lobe.
    #[must_use]
    #[inline]
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> BsdfSample {
        let cosine = Lambert { albedo: Rgb::ONE }.sample(rng);
        let v = cosine.wi;
        let (x, y) = ((v.x - self.b * v.z) / self.a, v.y / self.a);
        let along = azimuth(wo);
        let across = Vec3::new(-along.y, along.x, 0.0);
        BsdfSample {
            wi: (along * x + across * y + Vec3::Z * v.z).normalize(),
            weight: self.color * self.albedo,
            ..cosine
        }
    }

    /// f·cosθ_i, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        self.color * (self.albedo * self.pdf(wo, wi))
    }

    /// The density of the lobe, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let along = azimuth(wo);
        let x = self.a * wi.dot(along) + self.b * wi.z;
        let y = self.a * (wi.y * along.x - wi.x * along.y);
        let square = x * x + y * y + wi.z * wi.z;
        let stretch = self.a / square.max(f32::MIN_POSITIVE);
        FRAC_1_PI * wi.z.max(0.0) * stretch * stretch
    }
}

/// Where a direction points on the surface; somewhere if it is the normal.
#[inline]
fn azimuth(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, 0.0).try_normalize().unwrap_or(Vec3::X)
}

/// Chebyshev's polynomials at `x`, from degree 0.
#[inline]
fn chebyshev(x: f32) -> [f32; DEGREE + 1] {
    let mut values = [1.0, x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for k in 2..=DEGREE {
        values[k] = 2.0 * x * values[k - 1] - values[k - 2];
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Albedos that Cycles 4.5 rendered, not on the nodes of the fit.
    #[test]
    fn the_albedo_is_that_of_cycles() {
        for (roughness, cos, albedo) in [
            (1.0, 0.999, 0.342_092),
            (1.0, 0.5, 0.498_734),
            (1.0, 0.02, 0.740_768),
            (0.5, 0.5, 0.153_923),
            (0.5, 0.02, 0.668_068),
            (0.3, 0.2, 0.237_564),
            (0.2, 0.06, 0.439_301),
            (0.15, 0.02, 0.547_723),
        ] {
            let sheen = Sheen::new(Rgb::ONE, roughness, cos);
            assert!(
                (sheen.albedo - albedo).abs() < 0.0073,
                "roughness {roughness}, cosθ {cos}: {}, not {albedo}",
                sheen.albedo
            );
        }
    }

    #[test]
    fn the_lobe_integrates_to_one() {
        for (roughness, cos) in [(0.1, 0.02), (0.2, 0.5), (0.5, 0.1), (1.0, 0.9)] {
            let sheen = Sheen::new(Rgb::ONE, roughness, cos);
            let wo = Vec3::new((1.0f32 - cos * cos).sqrt(), 0.0, cos);
            let (rings, sectors) = (2000, 200);
            let mut sum = 0.0;
            for i in 0..rings {
                // Denser towards grazing angles, where rough lobes are high.
                let t = (i as f32 + 0.5) / rings as f32;
                let (z, dz) = (t * t, 2.0 * t / rings as f32);
                let r = (1.0 - z * z).sqrt();
                for k in 0..sectors {
                    let phi = (k as f32 + 0.5) * std::f32::consts::TAU / sectors as f32;
                    let wi = Vec3::new(r * phi.cos(), r * phi.sin(), z);
                    sum += sheen.pdf(wo, wi) * dz * std::f32::consts::TAU / sectors as f32;
                }
            }
            assert!((sum - 1.0).abs() < 2e-3, "{roughness}, {cos}: {sum}");
        }
    }
}
