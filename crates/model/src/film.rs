//! Thin films: light that is reflected at both sides of one interferes.

use crate::{Real, Rgb, fresnel};

/// A film on a facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film<F> {
    /// Index of refraction, relative to the outside.
    pub ior: F,
    /// Thickness in nm.
    pub thickness: F,
    /// The share of the facets that it covers.
    pub cover: F,
}

/// The interfaces of a film at one angle and for one polarisation, which is all but the
/// wavelength.
struct Polarised<F> {
    /// |r₁₂|² + |r₂₃|², and 1 + |r₁₂|² |r₂₃|².
    sums: [F; 2],
    /// 2 |r₁₂| |r₂₃|, with the sign of r₁₂.
    product: F,
    /// The phase of r₂₃.
    phase: F,
}

impl<F: Real> Polarised<F> {
    fn new(r12: F, r23: [F; 2]) -> Self {
        let square = r23[0] * r23[0] + r23[1] * r23[1];
        let first = r12 * r12;
        Self {
            sums: [first + square, F::one() + first * square],
            product: F::of(2.0) * r12 * square.sqrt(),
            phase: r23[1].atan2(r23[0]),
        }
    }

    /// Airy's formula, for the phase δ that one way there and back through the film adds.
    #[inline]
    fn reflectance(&self, delta: F) -> F {
        let interference = self.product * (delta + self.phase).cos();
        let [over, under] = self.sums;
        (over + interference) / (under + interference)
    }
}

impl<F: Real> Film<F> {
    /// The reflectance for red, green and blue at the cosine `cos` ≥ 0 of incidence, of
    /// facets below the film with the complex index η + ik relative to the outside, per
    /// channel.
    ///
    /// Airy's formula for each polarisation, as in Belcour and Barla 2017, "A Practical
    /// Extension to Microfacet Theory for the Modeling of Varying Iridescence", with the
    /// integral over the spectrum by 32 wavelengths in place of their Fourier transform:
    /// within 0.0034 of the integral in steps of 1 nm for films of up to 1 µm, and within
    /// 0.023 for up to 2 µm. The sensitivities are those of Rec. 709's primaries by the fits
    /// of Wyman, Sloan and Shirley 2013, each normalised; what comes out of their negative
    /// parts is clamped to [0, 1].
    pub fn reflectance(&self, cos: F, eta: Rgb<F>, k: Rgb<F>) -> Rgb<F> {
        let bare = |c: usize| fresnel::complex(cos.max(F::zero()), eta.0[c], k.0[c]);
        let Some(way) = Way::into(self, cos) else {
            return self.covering(Rgb::white(), bare);
        };
        let covered = Rgb(std::array::from_fn(|channel| {
            let [s, p] = way.onto(&Base::new(eta.0[channel], k.0[channel], way.sin2));
            let mut sum = F::zero();
            for row in &SPECTRUM {
                let delta = way.length / F::of(row[0]);
                let both = s.reflectance(delta) + p.reflectance(delta);
                sum += F::of(0.5 * row[1 + channel]) * both;
            }
            sum.max(F::zero()).min(F::one())
        }));
        self.covering(covered, bare)
    }

    /// The same of facets between two media that absorb nothing, `eta` being
    /// n(far side) / n(near side). What is not reflected goes through, and as much goes
    /// through from the other side ([`Self::inverted`]) along the refracted ray. A film
    /// thinner in index than both media lets nothing through beyond its critical angle,
    /// however thin it is.
    pub fn on_dielectric(&self, cos: F, eta: F) -> Rgb<F> {
        let bare = |_| fresnel::dielectric(cos.max(F::zero()), eta).0;
        let Some(way) = Way::into(self, cos) else {
            return self.covering(Rgb::white(), bare);
        };
        let [s, p] = way.onto(&Base::new(eta, F::zero(), way.sin2));
        let mut sums = [F::zero(); 3];
        for row in &SPECTRUM {
            let delta = way.length / F::of(row[0]);
            let mean = F::of(0.5) * (s.reflectance(delta) + p.reflectance(delta));
            for (sum, &weight) in sums.iter_mut().zip(&row[1..]) {
                *sum += F::of(weight) * mean;
            }
        }
        self.covering(Rgb(sums.map(|sum| sum.max(F::zero()).min(F::one()))), bare)
    }

    /// The film as it is seen from the far side, whose index is `eta` times that of the
    /// near side.
    #[must_use]
    pub fn inverted(&self, eta: F) -> Self {
        Self {
            ior: self.ior / eta,
            // As long as before in wavelengths.
            thickness: self.thickness * eta,
            ..*self
        }
    }

    fn covering(&self, covered: Rgb<F>, bare: impl Fn(usize) -> F) -> Rgb<F> {
        if self.cover == F::one() {
            return covered;
        }
        Rgb(std::array::from_fn(|c| {
            covered.0[c] * self.cover + bare(c) * (F::one() - self.cover)
        }))
    }
}

/// The way of light through a film.
struct Way<F> {
    /// Of the film, relative to the outside.
    ior: F,
    /// sin²θ outside.
    sin2: F,
    /// cosθ inside.
    inside: F,
    /// The amplitudes r₁₂ of both polarisations.
    outer: [F; 2],
    /// 4π d n cosθ₂ in nm: the phase of one way there and back, times the wavelength.
    length: F,
}

impl<F: Real> Way<F> {
    /// `None` under total reflection.
    fn into(film: &Film<F>, cos: F) -> Option<Self> {
        let (zero, one) = (F::zero(), F::one());
        let cos = cos.max(zero).min(one);
        let sin2 = (one - cos) * (one + cos);
        let n = film.ior;
        let square = one - sin2 / (n * n);
        if square <= zero {
            return None;
        }
        let inside = square.sqrt();
        // r = (a − b)/(a + b) with the admittances a and b.
        let ratio = |a: F, b: F| if a + b > zero { (a - b) / (a + b) } else { one };
        Some(Self {
            ior: n,
            sin2,
            inside,
            outer: [ratio(cos, n * inside), ratio(n * cos, inside)],
            length: F::of(4.0) * F::PI() * film.thickness * n * inside,
        })
    }

    /// Both polarisations, with what is below the film.
    fn onto(&self, base: &Base<F>) -> [Polarised<F>; 2] {
        let [s, p] = base.amplitudes(self.ior, self.inside);
        [
            Polarised::new(self.outer[0], s),
            Polarised::new(self.outer[1], p),
        ]
    }
}

/// What is below a film, at one angle.
struct Base<F> {
    /// The square of its complex index.
    square: [F; 2],
    /// (η + ik) cosθ₃, the root in the first quadrant.
    normal: [F; 2],
}

impl<F: Real> Base<F> {
    fn new(eta: F, k: F, sin2: F) -> Self {
        let square = [(eta - k) * (eta + k), F::of(2.0) * eta * k];
        // √(n² − sin²θ)
        let (re, im) = (square[0] - sin2, square[1]);
        let modulus = re.hypot(im);
        let half = F::of(0.5);
        let root = |x: F| (half * x.max(F::zero())).sqrt();
        Self {
            square,
            normal: [root(modulus + re), root(modulus - re)],
        }
    }

    /// r₂₃ for both polarisations, from a film of index `n` with cosθ₂ = `inside`.
    fn amplitudes(&self, n: F, inside: F) -> [[F; 2]; 2] {
        let [re, im] = self.normal;
        // s: (n cosθ₂ − n₃ cosθ₃)/(n cosθ₂ + n₃ cosθ₃)
        let s = divided([n * inside - re, -im], [n * inside + re, im]);
        // p: (n₃² cosθ₂ n⁻¹ − n₃ cosθ₃)/(…+…), both times n₃.
        let [a, b] = self.square.map(|part| part * inside / n);
        let p = divided([a - re, b - im], [a + re, b + im]);
        [s, p]
    }
}

/// A quotient of complex numbers; 1 over 0 is 1.
fn divided<F: Real>([a, b]: [F; 2], [c, d]: [F; 2]) -> [F; 2] {
    let square = c * c + d * d;
    if square > F::zero() {
        [(a * c + b * d) / square, (b * c - a * d) / square]
    } else {
        [F::one(), F::zero()]
    }
}

const WAVELENGTHS: usize = 32;

/// Wavelengths in nm, and their weights for red, green and blue.
#[rustfmt::skip]
const SPECTRUM: [[f64; 4]; WAVELENGTHS] = [
    [399.84375, 0.000390, -0.000589, 0.006362],
    [409.53125, 0.003796, -0.003065, 0.020682],
    [419.21875, 0.008903, -0.008869, 0.064636],
    [428.90625, 0.012936, -0.017027, 0.140118],
    [438.59375, 0.019856, -0.022731, 0.183344],
    [448.28125, 0.015008, -0.019857, 0.190268],
    [457.96875, 0.002492, -0.011618, 0.181434],
    [467.65625, -0.009963, 0.000255, 0.148410],
    [477.34375, -0.019174, 0.014505, 0.096649],
    [487.03125, -0.030496, 0.031256, 0.054573],
    [496.71875, -0.043449, 0.051515, 0.028428],
    [506.40625, -0.055712, 0.077443, 0.011437],
    [516.09375, -0.065953, 0.108424, -0.001054],
    [525.78125, -0.067677, 0.134605, -0.009807],
    [535.46875, -0.053435, 0.144278, -0.014540],
    [545.15625, -0.026854, 0.142446, -0.016646],
    [554.84375, 0.009792, 0.131030, -0.016927],
    [564.53125, 0.053223, 0.111792, -0.015926],
    [574.21875, 0.098385, 0.087332, -0.014072],
    [583.90625, 0.139919, 0.059584, -0.011595],
    [593.59375, 0.171636, 0.032138, -0.008856],
    [603.28125, 0.188308, 0.008593, -0.006210],
    [612.96875, 0.182528, -0.006603, -0.004054],
    [622.65625, 0.157041, -0.013042, -0.002519],
    [632.34375, 0.120780, -0.013072, -0.001537],
    [642.03125, 0.083323, -0.009805, -0.000956],
    [651.71875, 0.051627, -0.005863, -0.000621],
    [661.40625, 0.028721, -0.002736, -0.000414],
    [671.09375, 0.014317, -0.000849, -0.000274],
    [680.78125, 0.006368, 0.000014, -0.000174],
    [690.46875, 0.002506, 0.000266, -0.000103],
    [700.15625, 0.000858, 0.000250, -0.000056],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// A film of no thickness is none: what is below shows as it is.
    #[test]
    fn a_film_of_no_thickness_is_none() {
        for (eta, k) in [(1.5, 0.0), (0.2, 3.4), (2.9, 3.1)] {
            for ior in [1.2, 1.33, 2.0] {
                for cos in [1.0, 0.7, 0.3, 0.05f64] {
                    let film = Film {
                        ior,
                        thickness: 0.0,
                        cover: 1.0,
                    };
                    let found = film.reflectance(cos, Rgb::splat(eta), Rgb::splat(k));
                    let expected = fresnel::complex(cos, eta, k);
                    for f in found.0 {
                        assert!(
                            (f - expected).abs() < 2e-6,
                            "{eta} + {k}i, {ior}, {cos}: {f}"
                        );
                    }
                }
            }
        }
    }

    /// A film as dense as what is below does nothing, however thick.
    #[test]
    fn a_film_like_its_base_does_nothing() {
        let film = Film {
            ior: 1.5,
            thickness: 700.0,
            cover: 1.0,
        };
        for cos in [1.0, 0.5, 0.1f64] {
            let found = film.reflectance(cos, Rgb::splat(1.5), Rgb::splat(0.0));
            let expected = fresnel::dielectric(cos, 1.5).0;
            assert!((found.0[1] - expected).abs() < 2e-6, "{cos}: {found:?}");
        }
    }

    /// At one wavelength, the characteristic matrix of the film (Born and Wolf 1999,
    /// section 1.6), which knows nothing of Airy's sum: fields E and H at the base taken
    /// through it. A unit of phase is that of exp(iωt), indices are n − ik.
    #[test]
    fn airy_s_formula_is_the_characteristic_matrix() {
        let times = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a * c - b * d, a * d + b * c];
        for (ior, eta, k) in [
            (1.33, 1.5, 0.0),
            (1.33, 0.2, 3.4),
            (1.8, 2.9, 3.1),
            (2.0, 1.2, 7.0),
        ] {
            for (thickness, cos) in [(80.0, 1.0), (300.0, 0.6), (650.0, 0.2), (900.0, 0.05)] {
                let film = Film {
                    ior,
                    thickness,
                    cover: 1.0,
                };
                let way = Way::into(&film, cos).expect("denser than the outside");
                let base = Base::new(eta, k, way.sin2);
                let polarised = way.onto(&base);
                let [re, im] = base.normal;
                // Admittances outside, in the film, and below: n cosθ, and n/cosθ.
                let below_p = {
                    let [a, b] = [base.square[0], -base.square[1]];
                    times([a, b], divided([1.0, 0.0], [re, -im]))
                };
                let admittances = [
                    (cos, ior * way.inside, [re, -im]),
                    (1.0 / cos, ior / way.inside, below_p),
                ];
                for (found, (outside, inside, below)) in polarised.iter().zip(admittances) {
                    for wavelength in [420.0, 550.0, 680.0] {
                        let delta = way.length / wavelength;
                        let (sine, cosine) = (0.5 * delta).sin_cos();
                        let through = times([0.0, sine], below);
                        let e = [cosine + through[0] / inside, through[1] / inside];
                        let h = [cosine * below[0], inside * sine + cosine * below[1]];
                        let over = [outside * e[0] - h[0], outside * e[1] - h[1]];
                        let under = [outside * e[0] + h[0], outside * e[1] + h[1]];
                        let [x, y] = divided(over, under);
                        let (expected, found) = (x * x + y * y, found.reflectance(delta));
                        assert!(
                            (found - expected).abs() < 1e-12,
                            "{film:?}, {eta} + {k}i, {cos}, {wavelength} nm: {found}, not {expected}"
                        );
                    }
                }
            }
        }
    }

    /// The same of f64 sums in steps of 1 nm, by the sensitivities that the weights are of.
    #[test]
    fn the_spectrum_is_that_of_narrow_steps() {
        let lobe = |x: f64, at: f64, below: f64, above: f64| {
            let t = (x - at) * if x < at { below } else { above };
            (-0.5 * t * t).exp()
        };
        let xyz = |l: f64| {
            [
                0.362 * lobe(l, 442.0, 0.0624, 0.0374) + 1.056 * lobe(l, 599.8, 0.0264, 0.0323)
                    - 0.065 * lobe(l, 501.1, 0.0490, 0.0382),
                0.821 * lobe(l, 568.8, 0.0213, 0.0247) + 0.286 * lobe(l, 530.9, 0.0613, 0.0322),
                1.217 * lobe(l, 437.0, 0.0845, 0.0278) + 0.681 * lobe(l, 459.0, 0.0385, 0.0725),
            ]
        };
        let rec709 = [
            [3.240_454_2, -1.537_138_5, -0.498_531_4],
            [-0.969_266_0, 1.876_010_8, 0.041_556_0],
            [0.055_643_4, -0.204_025_9, 1.057_225_2],
        ];
        let mut worst = [0.0f64; 2];
        for (ior, eta, k) in [
            (1.33, 1.5, 0.0),
            (1.33, 0.2, 3.4),
            (1.8, 1.5, 0.0),
            (2.0, 2.9, 3.1),
        ] {
            for thickness in [50.0, 200.0, 400.0, 650.0, 900.0, 1000.0, 1500.0, 2000.0] {
                for cos in [1.0, 0.6, 0.2f64] {
                    let film = Film {
                        ior,
                        thickness,
                        cover: 1.0,
                    };
                    let found = film.reflectance(cos, Rgb::splat(eta), Rgb::splat(k));
                    let way = Way::into(&film, cos).expect("denser than the outside");
                    let [s, p] = way.onto(&Base::new(eta, k, way.sin2));
                    for (c, row) in rec709.iter().enumerate() {
                        let (mut sum, mut whole) = (0.0, 0.0);
                        for l in 380..=780 {
                            let l = f64::from(l);
                            let weight: f64 = row.iter().zip(xyz(l)).map(|(m, x)| m * x).sum();
                            whole += weight;
                            sum += weight
                                * 0.5
                                * (s.reflectance(way.length / l) + p.reflectance(way.length / l));
                        }
                        let off = (found.0[c] - (sum / whole).clamp(0.0, 1.0)).abs();
                        let class = usize::from(thickness > 1000.0);
                        worst[class] = worst[class].max(off);
                    }
                }
            }
        }
        assert!(worst[0] < 0.0034 && worst[1] < 0.023, "{worst:?}");
    }

    /// Glass below a film reflects as a metal of no absorption does, from either side as
    /// much along the same ray.
    #[test]
    fn a_film_on_glass_is_the_same_from_both_sides() {
        for (ior, eta) in [(1.33, 1.5), (2.0, 1.5), (1.8, 1.1), (1.4, 1.0 / 1.5)] {
            for thickness in [0.0, 150.0, 400.0, 1200.0] {
                for cover in [1.0, 0.4] {
                    let film = Film {
                        ior,
                        thickness,
                        cover,
                    };
                    for cos in [1.0, 0.8, 0.3, 0.1f64] {
                        let found = film.on_dielectric(cos, eta);
                        let metal = film.reflectance(cos, Rgb::splat(eta), Rgb::splat(0.0));
                        let (_, cos_t) = fresnel::dielectric(cos, eta);
                        let back = film.inverted(eta).on_dielectric(cos_t, eta.recip());
                        for c in 0..3 {
                            assert!(
                                (found.0[c] - metal.0[c]).abs() < 1e-12,
                                "{film:?}, {eta}, {cos}"
                            );
                            assert!(
                                cos_t == 0.0 || (found.0[c] - back.0[c]).abs() < 1e-9,
                                "{film:?}, {eta}, {cos}: {found:?}, {back:?}"
                            );
                            assert!(
                                cos_t > 0.0 || found.0[c] > 1.0 - 2e-6,
                                "{film:?}, {eta}, {cos}"
                            );
                        }
                    }
                }
            }
        }
    }
}
