//! Surfaces that scatter widely, in closed form: everything diffuse but Lambert's
//! law on the viewer's side.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use glam::Vec3;

use super::{BsdfSample, Clearcoat, Lambert, Sheen};
use crate::color::Rgb;
use smithwalk_model::Draw;

/// A wide lobe.
#[derive(Clone, Copy, Debug)]
pub enum Diffuser {
    /// Oren and Nayar's rough diffuse surface.
    OrenNayar(OrenNayar),
    /// The diffuse base of Burley 2012, "Physically Based Shading at Disney",
    /// § 5.3.
    Burley {
        /// The albedo at normal incidence.
        albedo: Rgb,
        /// 0 darkens grazing angles, 1 brightens them.
        roughness: f32,
    },
    /// The sheen of the same, § 5.5: f = (1 − ω·h)⁵.
    BurleySheen(Rgb),
    /// The velvet of Ashikhmin, Premože and Shirley 2000, "A microfacet-based BRDF
    /// generator", § 4.3.
    Velvet {
        /// A factor on its light.
        color: Rgb,
        /// 1/σ², σ the slope by which fibres lean.
        steepness: f32,
    },
    /// Fibres on a surface.
    Sheen(Sheen),
    /// Lambert's law, on the other side.
    Translucent(Rgb),
    /// Not so wide: the coat of Burley 2012.
    Clearcoat(Clearcoat),
}

impl Diffuser {
    /// Draws from a density that all of the lobe is covered by.
    #[inline]
    pub fn sample(&self, wo: Vec3, rng: &mut impl Draw<f32>) -> Option<BsdfSample> {
        let lambert = Lambert { albedo: Rgb::ONE };
        let wi = match self {
            Self::Clearcoat(coat) => return coat.sample(wo, rng),
            Self::Sheen(sheen) => return Some(sheen.sample(wo, rng)),
            Self::Velvet { .. } => {
                let (z, v) = (rng.draw(), rng.draw());
                let (sin, cos) = (v * TAU).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                Vec3::new(r * cos, r * sin, z)
            }
            Self::Translucent(_) => -lambert.sample(rng).wi,
            Self::OrenNayar(_) | Self::Burley { .. } | Self::BurleySheen(_) => {
                lambert.sample(rng).wi
            }
        };
        Some(BsdfSample {
            wi,
            weight: self.eval(wo, wi) / self.pdf(wo, wi).max(f32::MIN_POSITIVE),
            order: 1,
            delta: false,
        })
    }

    /// f·|cosθ_i|, sr⁻¹.
    #[must_use]
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if let Self::Translucent(color) = self {
            return *color * self.pdf(wo, wi);
        }
        if wi.z <= 0.0 {
            return Rgb::ZERO;
        }
        match self {
            Self::OrenNayar(rough) => rough.eval(wo, wi),
            Self::Burley { albedo, roughness } => {
                let (fo, fi) = (fifth(wo.z), fifth(wi.z));
                // 2 r cos²θ_d, with cos 2θ_d = ω_o·ω_i
                let retro = roughness * (1.0 + wo.dot(wi));
                let base = (1.0 - 0.5 * fo) * (1.0 - 0.5 * fi);
                let back = retro * (fo + fi + fo * fi * (retro - 1.0));
                *albedo * (FRAC_1_PI * wi.z * (base + back))
            }
            Self::BurleySheen(color) => {
                let cos = (0.5 * (1.0 + wo.dot(wi))).max(0.0).sqrt();
                *color * (fifth(cos) * wi.z)
            }
            Self::Velvet { color, steepness } => *color * velvet(wo, wi, *steepness),
            Self::Clearcoat(coat) => coat.eval(wo, wi),
            Self::Sheen(sheen) => sheen.eval(wo, wi),
            Self::Translucent(_) => Rgb::ZERO,
        }
    }

    /// The density of [`Self::sample`], sr⁻¹.
    #[must_use]
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Clearcoat(coat) => coat.pdf(wo, wi),
            Self::Sheen(sheen) => sheen.pdf(wo, wi),
            Self::Translucent(_) => (-wi.z).max(0.0) * FRAC_1_PI,
            _ if wi.z <= 0.0 => 0.0,
            Self::Velvet { .. } => 0.5 * FRAC_1_PI,
            Self::OrenNayar(_) | Self::Burley { .. } | Self::BurleySheen(_) => wi.z * FRAC_1_PI,
        }
    }
}

/// Schlick's (1 − cosθ)⁵.
fn fifth(cos: f32) -> f32 {
    (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

/// f·cosθ_i of Ashikhmin's velvet: D G/(4 cosθ_o), D an inverted Gaussian, G the
/// masking of V-shaped grooves.
fn velvet(wo: Vec3, wi: Vec3, steepness: f32) -> f32 {
    let h = (wo + wi).normalize_or_zero();
    let (cos_h, cos_d) = (h.z, wo.dot(h));
    let sin2 = 1.0 - cos_h * cos_h;
    if cos_h <= 0.0 || cos_d <= 1e-5 || sin2 <= 1e-5 {
        return 0.0;
    }
    let d = (-cos_h * cos_h / sin2 * steepness).exp() * steepness * FRAC_1_PI / (sin2 * sin2);
    let groove = 2.0 * cos_h / cos_d;
    let g = (groove * wo.z).min(groove * wi.z).min(1.0);
    0.25 * d * g / wo.z
}

/// Oren and Nayar 1994, in the form of Fujii 2012, "Improved Oren–Nayar model"
/// (<https://mimosa-pudica.net/improved-oren-nayar.html>), which Cycles has.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    albedo: Rgb,
    /// f = albedo (a + b t), sr⁻¹.
    a: f32,
    b: f32,
    /// What light that meets further facets adds, over 1 − E(θ_i), sr⁻¹.
    further: Rgb,
}

impl OrenNayar {
    /// As Cycles 3 has it: it reflects less the rougher it is.
    #[must_use]
    pub fn of_cycles_3(albedo: Rgb, roughness: f32) -> Self {
        let a = 1.0 / (PI + (3.0 * PI - 4.0) / 6.0 * roughness);
        Self {
            albedo,
            a,
            b: roughness * a,
            further: Rgb::ZERO,
        }
    }

    /// As Cycles 4.4 and later have it, seen from `wo`: with what light adds that
    /// meets further facets, after Portsmouth, Kutz and Hill 2025, "EON: A
    /// practical energy-preserving rough diffuse BRDF". White loses nothing. As in
    /// Cycles the colour multiplies that once more than in the paper.
    #[must_use]
    pub fn of_cycles_4(albedo: Rgb, roughness: f32, wo: Vec3) -> Self {
        let a = 1.0 / (PI + (FRAC_PI_2 - 2.0 / 3.0) * roughness);
        let b = roughness * a;
        let single = Self {
            albedo,
            a,
            b,
            further: Rgb::ZERO,
        };
        // Ē = aπ + b (2π − 28/5)/3
        let mean = a * PI + b * (TAU - 5.6) / 3.0;
        let lost = 1.0 - mean;
        let further = if lost > 0.0 {
            albedo * albedo * albedo * (FRAC_1_PI * mean / lost) / (Rgb::ONE - albedo * lost)
        } else {
            Rgb::ZERO
        };
        Self {
            further: further * (1.0 - single.directional(wo.z)),
            ..single
        }
    }

    /// E(θ) of a white surface without further facets: aπ + b G(θ).
    fn directional(&self, cos: f32) -> f32 {
        self.a * PI + self.b * spread(cos)
    }

    fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let mut t = wo.dot(wi) - wo.z * wi.z;
        if t > 0.0 {
            t /= wo.z.max(wi.z);
        }
        let further = if self.further == Rgb::ZERO {
            Rgb::ZERO
        } else {
            self.further * (1.0 - self.directional(wi.z))
        };
        (self.albedo * (self.a + self.b * t) + further) * wi.z
    }
}

/// G(θ) = sinθ (θ − sinθ cosθ − 2/3) + (2/3) tanθ (1 − sin³θ), by its series at
/// grazing angles, where it is a difference.
fn spread(cos: f32) -> f32 {
    if cos < 1e-3 {
        return FRAC_PI_2 - 2.0 / 3.0 - cos;
    }
    let cos = cos.min(1.0);
    let sin = (1.0 - cos * cos).sqrt();
    sin * (cos.acos() - sin * cos - 2.0 / 3.0) + 2.0 / 3.0 * (sin / cos) * (1.0 - sin * sin * sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use smithwalk_model::Stream;

    fn at(cos: f32, azimuth: f32) -> Vec3 {
        let sin = (1.0 - cos * cos).sqrt();
        Vec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos)
    }

    /// ∫ f cosθ_i dω_i by a product rule with nodes even in cosθ and azimuth.
    fn albedo(lobe: &Diffuser, wo: Vec3) -> f64 {
        const N: usize = 256;
        let mut sum = 0.0;
        for i in 0..N {
            let cos = (i as f32 + 0.5) / N as f32;
            for j in 0..2 * N {
                let wi = at(cos, PI * (j as f32 + 0.5) / N as f32);
                sum += f64::from(lobe.eval(wo, wi).x);
                sum += f64::from(lobe.eval(wo, -wi).x);
            }
        }
        sum * f64::from(PI) / (N * N) as f64
    }

    fn all(wo: Vec3) -> Vec<(&'static str, Diffuser)> {
        let c = Rgb::splat(0.7);
        vec![
            ("3.4", Diffuser::OrenNayar(OrenNayar::of_cycles_3(c, 0.8))),
            (
                "4.5",
                Diffuser::OrenNayar(OrenNayar::of_cycles_4(c, 0.8, wo)),
            ),
            (
                "Burley",
                Diffuser::Burley {
                    albedo: c,
                    roughness: 0.9,
                },
            ),
            ("sheen", Diffuser::BurleySheen(c)),
            (
                "velvet",
                Diffuser::Velvet {
                    color: c,
                    steepness: 2.0,
                },
            ),
            ("translucent", Diffuser::Translucent(c)),
            ("fibres", Diffuser::Sheen(Sheen::new(c, 0.4, wo.z))),
            ("coat", Diffuser::Clearcoat(Clearcoat { alpha: 0.4 })),
        ]
    }

    #[test]
    fn white_oren_nayar_loses_nothing_since_cycles_4() {
        for roughness in [0.1, 0.5, 1.0] {
            for cos in [0.05, 0.3, 0.7, 1.0] {
                let wo = at(cos, 0.4);
                let lobe = Diffuser::OrenNayar(OrenNayar::of_cycles_4(Rgb::ONE, roughness, wo));
                let found = albedo(&lobe, wo);
                assert!((found - 1.0).abs() < 2e-3, "{roughness} {cos}: {found}");
            }
        }
    }

    /// The closed form of the albedo that the energy term stands on.
    #[test]
    fn oren_nayars_albedo_is_its_closed_form() {
        for cos in [0.05, 0.3, 0.7, 1.0] {
            let wo = at(cos, 0.4);
            let rough = OrenNayar {
                further: Rgb::ZERO,
                ..OrenNayar::of_cycles_4(Rgb::ONE, 0.9, wo)
            };
            let found = albedo(&Diffuser::OrenNayar(rough), wo);
            let expected = f64::from(rough.directional(cos));
            assert!((found - expected).abs() < 1e-3, "{cos}: {found} {expected}");
        }
    }

    /// Samples against values: in each of eight
    /// boxes of directions the samples' light is the integral. 8 lobes × 3 angles ×
    /// 8 means at 4.5 σ: by chance alone it fails once in 770; the seed is fixed.
    #[test]
    fn samples_follow_values() {
        const SAMPLES: u32 = 200_000;
        let mut rng = Stream(rand_pcg::Pcg64Mcg::seed_from_u64(3));
        for cos in [0.2, 0.6, 0.95] {
            let wo = at(cos, 0.4);
            for (name, lobe) in all(wo) {
                let bin = |wi: Vec3| {
                    usize::from(wi.x > 0.0)
                        + 2 * usize::from(wi.y > 0.0)
                        + 4 * usize::from(wi.z.abs() > 0.5)
                };
                let (mut sum, mut squares) = ([0.0f64; 8], [0.0f64; 8]);
                for _ in 0..SAMPLES {
                    let Some(sample) = lobe.sample(wo, &mut rng) else {
                        continue;
                    };
                    let weight = f64::from(sample.weight.x);
                    sum[bin(sample.wi)] += weight;
                    squares[bin(sample.wi)] += weight * weight;
                }
                let mut expected = [0.0f64; 8];
                const N: usize = 256;
                for i in 0..N {
                    let cos = (i as f32 + 0.5) / N as f32;
                    for j in 0..2 * N {
                        let wi = at(cos, PI * (j as f32 + 0.5) / N as f32);
                        for wi in [wi, Vec3::new(wi.x, wi.y, -wi.z)] {
                            expected[bin(wi)] +=
                                f64::from(lobe.eval(wo, wi).x) * f64::from(PI) / (N * N) as f64;
                        }
                    }
                }
                let n = f64::from(SAMPLES);
                for b in 0..8 {
                    let mean = sum[b] / n;
                    let error = ((squares[b] / n - mean * mean) / n).sqrt();
                    let off = (mean - expected[b]).abs();
                    assert!(
                        off < 4.5 * error + 1e-3 * expected[b] + 1e-5,
                        "{name}, cos {cos}, box {b}: {mean} ± {error}, not {}",
                        expected[b]
                    );
                }
            }
        }
    }
}
