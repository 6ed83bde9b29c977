//! Reflectance of a smooth interface at a micro-facet.

use super::{Film, Real, Rgb};

/// Reflectance of unpolarised light at a dielectric interface, and the cosine
/// of the refracted ray: (F, cosθ_t), for the cosine `cos` ≥ 0 of incidence
/// and the relative index `eta` = n(far side) / n(near side).
///
/// Under total reflection F = 1 and cosθ_t = 0. Amplitudes and cosines are
/// formed from η² − 1 = (η − 1)(η + 1) and sin²θ = (1 − cosθ)(1 + cosθ), so
/// that F keeps its relative precision as η → 1.
#[inline]
pub fn dielectric<F: Real>(cos: F, eta: F) -> (F, F) {
    let (one, zero) = (F::one(), F::zero());
    let excess = (eta - one) * (eta + one);
    let eta2 = eta * eta;
    // (η cosθ_t)² = η² − sin²θ
    let sin2 = (one - cos) * (one + cos);
    let q2 = if cos > F::of(0.5) {
        eta2 - sin2
    } else {
        excess + cos * cos
    };
    if q2 <= zero {
        // At η = 1 a grazing ray goes straight on.
        return if excess == zero {
            (zero, zero)
        } else {
            (one, zero)
        };
    }
    let q = q2.sqrt();
    let cos_t = q / eta;
    // r_s = (cosθ − q)/(cosθ + q) and r_p = (η² cosθ − q)/(η² cosθ + q), with
    // both numerators times their conjugates.
    let s = cos + q;
    let p = eta2 * cos + q;
    let rs = excess / (s * s);
    let rp = excess * (eta2 * cos * cos - sin2) / (p * p);
    let f = F::of(0.5) * (rs * rs + rp * rp);
    (f.min(one), cos_t.min(one))
}

/// Transmittance 1 − F from the cosines of both rays, which must obey Snell's
/// law; precise where F → 1, and symmetric in the two sides.
#[inline]
pub fn transmittance<F: Real>(cos: F, cos_t: F, eta: F) -> F {
    let (s, p) = (cos + eta * cos_t, eta * cos + cos_t);
    let both = eta * cos * cos_t;
    if both <= F::zero() {
        return F::zero();
    }
    (F::of(2.0) * (both / (s * s) + both / (p * p))).min(F::one())
}

/// Reflectance of unpolarised light at a conductor with the complex index
/// η + ik relative to the outside, for the cosine `cos` ≥ 0 of incidence.
///
/// The textbook form (Born and Wolf, "Principles of Optics", § 14.2) with
/// a + ib = √((η + ik)² − sin²θ): R_s = |cosθ − (a + ib)|² / |cosθ + (a + ib)|²
/// and R_p = R_s |(a + ib) cosθ − sin²θ|² / |(a + ib) cosθ + sin²θ|².
#[inline]
pub fn complex<F: Real>(cos: F, eta: F, k: F) -> F {
    let (one, two, half) = (F::one(), F::of(2.0), F::of(0.5));
    let sin2 = ((one - cos) * (one + cos)).max(F::zero());
    let t = (eta - k) * (eta + k) - sin2;
    let ab = eta * k;
    let modulus = t.hypot(two * ab);
    // The larger of a and b by a sum, the other from their product.
    let (a, b) = if t >= F::zero() {
        let a = (half * (modulus + t)).sqrt();
        (a, if a > F::zero() { ab / a } else { F::zero() })
    } else {
        let b = (half * (modulus - t)).sqrt();
        (ab / b, b)
    };
    let square = |x: F| x * x;
    let ratio = |less: F, more: F| if more > F::zero() { less / more } else { one };
    let rs = ratio(square(cos - a) + b * b, square(cos + a) + b * b);
    let rp = rs
        * ratio(
            square(a * cos - sin2) + square(b * cos),
            square(a * cos + sin2) + square(b * cos),
        );
    (half * (rs + rp)).min(one)
}

/// Schlick 1994: F0 + (1 − F0)(1 − cosθ)⁵.
#[inline]
pub fn schlick<F: Real>(cos: F, f0: F) -> F {
    f0 + (F::one() - f0) * (F::one() - cos).max(F::zero()).powi(5)
}

/// Schlick's curve, lowered to go through the reflectance `f82` at
/// cosθ = 1/7 (about 82°, where metals dip), clamped to [0, 1].
///
/// The correcting term c (1 − c)⁶ is Lazányi and Szirmay-Kalos 2005, the
/// parameter Hoffman 2019, "Fresnel Equations Considered Harmful".
#[inline]
pub fn f82<F: Real>(cos: F, f0: F, f82: F) -> F {
    let one = F::one();
    let at = F::of(1.0 / 7.0);
    let dip = (schlick(at, f0) - f82) / (at * (one - at).powi(6));
    let c = (one - cos).max(F::zero());
    (schlick(cos, f0) - dip * cos * c.powi(6))
        .max(F::zero())
        .min(one)
}

/// The complex index η + ik whose reflectance is `f0` at normal incidence and, as nearly
/// as any can, `f82` at cosθ = 1/7.
///
/// All indices of one reflectance r at normal incidence have η from (1 − r)/(1 + r) to
/// (1 + √r)/(1 − √r) (Gulbrandsen 2014, "Artist Friendly Metallic Fresnel"); the larger
/// η, the less is reflected near 82°.
pub fn complex_through<F: Real>(f0: F, f82: F) -> (F, F) {
    let (zero, one, half) = (F::zero(), F::one(), F::of(0.5));
    // All that is reflected by none has an infinite index.
    let r = f0.max(zero).min(F::of(0.9999));
    let root = r.sqrt();
    let extinction = |eta: F| {
        let square = (r * (eta + one) * (eta + one) - (eta - one) * (eta - one)) / (one - r);
        square.max(zero).sqrt()
    };
    let (mut low, mut high) = ((one - r) / (one + r), (one + root) / (one - root));
    for _ in 0..24 {
        let middle = half * (low + high);
        if complex(F::of(1.0 / 7.0), middle, extinction(middle)) > f82 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let eta = half * (low + high);
    (eta, extinction(eta))
}

/// A dielectric's reflectance at normal incidence, ((η − 1)/(η + 1))².
#[inline]
pub fn normal_reflectance<F: Real>(eta: F) -> F {
    let r = (eta - F::one()) / (eta + F::one());
    r * r
}

/// How far the reflectance of a dielectric of relative index `eta` has risen at
/// the cosine `cos` from that at normal incidence, 0, to all, 1.
#[inline]
pub fn rise<F: Real>(cos: F, eta: F) -> F {
    let f0 = normal_reflectance(eta);
    let f = dielectric(cos, eta).0;
    // F keeps its minimum at normal incidence, but for rounding.
    ((f - f0) / (F::one() - f0)).max(F::zero())
}

/// The reflectance of conductor facets, per colour channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConductorFresnel<F> {
    /// The same at all angles.
    Constant(Rgb<F>),
    /// From the complex index η + ik relative to the outside.
    Complex {
        /// Real part of the index (dimensionless).
        eta: Rgb<F>,
        /// Extinction coefficient (dimensionless).
        k: Rgb<F>,
    },
    /// Schlick's curve from the reflectance at normal incidence.
    Schlick {
        /// Reflectance at normal incidence.
        f0: Rgb<F>,
    },
    /// Schlick's curve with its dip near grazing incidence.
    F82 {
        /// Reflectance at normal incidence.
        f0: Rgb<F>,
        /// Reflectance at cosθ = 1/7.
        f82: Rgb<F>,
    },
    /// The curve of a dielectric, stretched to go from `f0` to `f90`.
    Dielectric {
        /// Relative index of refraction, inside over outside.
        eta: F,
        /// Reflectance at normal incidence.
        f0: Rgb<F>,
        /// Reflectance at grazing incidence and under total reflection.
        f90: Rgb<F>,
    },
    /// A thin film on metal, or on a dielectric whose inside is dark.
    Film {
        /// The film.
        film: Film<F>,
        /// Real part of the index below it, relative to the outside.
        eta: Rgb<F>,
        /// Extinction coefficient below it.
        k: Rgb<F>,
    },
}

impl<F: Real> ConductorFresnel<F> {
    /// The reflectance at the cosine `cos` ≥ 0 of incidence.
    #[inline]
    pub fn reflectance(&self, cos: F) -> Rgb<F> {
        let cos = cos.min(F::one());
        match *self {
            Self::Constant(color) => color,
            Self::Complex { eta, k } => {
                Rgb(std::array::from_fn(|c| complex(cos, eta.0[c], k.0[c])))
            }
            Self::Schlick { f0 } => f0.map(|f0| schlick(cos, f0)),
            Self::F82 { f0, f82: edge } => {
                Rgb(std::array::from_fn(|c| f82(cos, f0.0[c], edge.0[c])))
            }
            Self::Dielectric { eta, f0, f90 } => {
                let rise = rise(cos, eta);
                f0 * (F::one() - rise) + f90 * rise
            }
            Self::Film { film, eta, k } => film.reflectance(cos, eta, k),
        }
    }
}

impl ConductorFresnel<f64> {
    /// The same in single precision.
    pub fn to_single(&self) -> ConductorFresnel<f32> {
        let rgb = |c: Rgb<f64>| Rgb(c.0.map(|c| c as f32));
        match *self {
            Self::Constant(color) => ConductorFresnel::Constant(rgb(color)),
            Self::Complex { eta, k } => ConductorFresnel::Complex {
                eta: rgb(eta),
                k: rgb(k),
            },
            Self::Schlick { f0 } => ConductorFresnel::Schlick { f0: rgb(f0) },
            Self::F82 { f0, f82 } => ConductorFresnel::F82 {
                f0: rgb(f0),
                f82: rgb(f82),
            },
            Self::Dielectric { eta, f0, f90 } => ConductorFresnel::Dielectric {
                eta: eta as f32,
                f0: rgb(f0),
                f90: rgb(f90),
            },
            Self::Film { film, eta, k } => ConductorFresnel::Film {
                film: Film {
                    ior: film.ior as f32,
                    thickness: film.thickness as f32,
                    cover: film.cover as f32,
                },
                eta: rgb(eta),
                k: rgb(k),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectric_knows_its_closed_cases() {
        // Normal incidence: ((η − 1)/(η + 1))².
        for eta in [0.5, 1.5, 3.0, 1e-3, 1e3f64] {
            let expected = ((eta - 1.0) / (eta + 1.0)).powi(2);
            assert!((dielectric(1.0, eta).0 - expected).abs() < 1e-14);
        }
        // Brewster's angle, tanθ = η: only half of the s polarisation's R.
        let eta = 1.5f64;
        let cos = 1.0 / (1.0 + eta * eta).sqrt();
        let rs = ((1.0 - eta * eta) / (1.0 + eta * eta)).powi(2);
        assert!((dielectric(cos, eta).0 - 0.5 * rs).abs() < 1e-14);
        // Past the critical angle, sinθ = η.
        assert_eq!(dielectric(0.7, 1.0 / 1.5), (1.0, 0.0));
        assert!(dielectric(0.75, 1.0 / 1.5).0 < 1.0);
        assert!((dielectric(0.0, 1.5).0 - 1.0f64).abs() < 1e-15);
    }

    #[test]
    fn nothing_is_lost_at_the_interface() {
        for eta in [0.4, 0.99, 1.5, 3.0] {
            for cos in [1e-6, 0.2, 0.95, 1.0f64] {
                let (f, cos_t) = dielectric(cos, eta);
                assert!(
                    (f + transmittance(cos, cos_t, eta) - 1.0).abs() < 1e-12,
                    "η {eta}, cos {cos}"
                );
            }
        }
    }

    #[test]
    fn dielectric_is_reciprocal_and_precise_near_one() {
        for eta in [1.0 + 1e-7, 1.0 - 1e-7, 1.01, 1.5, 2.5] {
            for cos in [1e-3, 0.1, 0.5, 0.9] {
                let (there, cos_t) = dielectric::<f64>(cos, eta);
                if cos_t > 0.0 {
                    let back = dielectric(cos_t, 1.0 / eta).0;
                    assert!(
                        (there - back).abs() < 1e-8 * there,
                        "η {eta}, cos {cos}: {there} {back}"
                    );
                }
            }
        }
        let (f, cos_t) = dielectric(0.0f32, 1.0);
        assert_eq!((f, cos_t), (0.0, 0.0));
        // ((η − 1)/(η + 1))² with the f32 nearest to 1 + 1e-7.
        let eta = 1.0 + 1e-7f32;
        let expected = (f64::from(eta) - 1.0).powi(2) / 4.0;
        assert!((f64::from(dielectric(1.0, eta).0) / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn complex_meets_the_dielectric_and_the_mirror() {
        for cos in [0.0, 1e-4, 0.3, 0.8, 1.0f64] {
            let real = dielectric(cos, 1.7).0;
            assert!((complex(cos, 1.7, 0.0) - real).abs() < 1e-13, "cos {cos}");
            let f = complex(cos as f32, 1e-3, 1e4);
            assert!((0.999..=1.0).contains(&f), "cos {cos}: {f}");
        }
        // Normal incidence: ((η − 1)² + k²)/((η + 1)² + k²).
        let (eta, k) = (0.2f64, 3.9f64);
        let expected = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((complex(1.0, eta, k) - expected).abs() < 1e-14);
    }

    #[test]
    fn a_stretched_dielectric_goes_from_end_to_end() {
        let eta = 1.5;
        let own = |cos| {
            let f0 = Rgb([normal_reflectance(eta); 3]);
            let f90 = Rgb([1.0; 3]);
            ConductorFresnel::Dielectric { eta, f0, f90 }
                .reflectance(cos)
                .0[1]
        };
        for cos in [0.0, 0.1, 0.5, 0.9, 1.0f64] {
            assert!(
                (own(cos) - dielectric(cos, eta).0).abs() < 1e-15,
                "cos {cos}"
            );
        }
        let (f0, f90) = (Rgb([0.2, 0.4, 0.0]), Rgb([1.0, 0.5, 0.3]));
        let curve = ConductorFresnel::Dielectric { eta, f0, f90 };
        for c in 0..3 {
            assert!((curve.reflectance(1.0).0[c] - f0.0[c]).abs() < 1e-14);
            assert!((curve.reflectance(0.0).0[c] - f90.0[c]).abs() < 1e-14);
        }
    }

    #[test]
    fn complex_indices_go_through_two_reflectances() {
        // Silver, copper, iron: what they reflect leads back to it.
        for (eta, k) in [(0.05, 3.3), (0.8, 2.6), (2.9, 3.1f64)] {
            let (f0, edge) = (complex(1.0, eta, k), complex(1.0 / 7.0, eta, k));
            let (found, extinction) = complex_through(f0, edge);
            assert!(
                (complex(1.0, found, extinction) - f0).abs() < 1e-6,
                "{eta} + {k}i"
            );
            assert!(
                (complex(1.0 / 7.0, found, extinction) - edge).abs() < 1e-5,
                "{eta} + {k}i"
            );
        }
        for f0 in [0.0, 0.04, 0.5, 1.0f64] {
            for edge in [0.0, 0.5, 1.0] {
                let (eta, k) = complex_through(f0, edge);
                assert!(
                    (complex(1.0, eta, k) - f0).abs() < 2e-4,
                    "{f0}, {edge}: {eta} + {k}i"
                );
            }
        }
    }

    #[test]
    fn f82_goes_through_its_two_points() {
        assert_eq!(f82(1.0, 0.7, 0.6), 0.7);
        assert!((f82(1.0 / 7.0, 0.7, 0.6) - 0.6f64).abs() < 1e-15);
        assert!((f82(0.0, 0.7, 0.6) - 1.0f64).abs() < 1e-15);
    }
}
