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
    /// integral over the spectrum by 32 wavelengths in place of their Fourier transform.
    /// The sensitivities are those of Rec. 709's primaries in CIE 1931's observer, each
    /// normalised; what comes out of their negative parts is clamped to [0, 1]. For films of
    /// up to 1 µm and of index 1.2 to 2.5 the largest of the three is within 0.0018 of the
    /// integral in steps of 1 nm on plastics of index 1.3 to 2, 0.0001 on average, and within
    /// 0.043 on metals, 0.0010 on average; for 1 to 2 µm within 0.012, 0.0004 on average, and
    /// 0.092, 0.0046 on average (`benches/film_spectrum.py`).
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

/// Wavelengths in nm, and their weights for red, green and blue: by least squares over
/// random films on plastics and metals, by `benches/film_spectrum.py --fit`.
#[rustfmt::skip]
const SPECTRUM: [[f64; 4]; WAVELENGTHS] = [
    [393.24, 0.000874, -0.000945, 0.005429],
    [406.93, 0.001899, -0.002157, 0.015909],
    [414.73, 0.004684, -0.001869, 0.026997],
    [420.98, 0.001593, -0.010939, 0.039882],
    [425.58, 0.010683, -0.001875, 0.061380],
    [431.39, 0.006826, -0.014184, 0.092755],
    [436.80, 0.012849, -0.012606, 0.105073],
    [443.35, 0.009934, -0.013208, 0.134428],
    [450.08, 0.006826, -0.013614, 0.131894],
    [457.12, 0.003722, -0.009228, 0.134953],
    [464.31, 0.002245, -0.000842, 0.118922],
    [471.36, -0.019594, 0.000573, 0.097008],
    [478.56, -0.006138, 0.013565, 0.062460],
    [486.11, -0.031642, 0.028021, 0.054373],
    [495.71, -0.038677, 0.044392, 0.028789],
    [504.61, -0.046730, 0.067573, 0.014895],
    [513.36, -0.059376, 0.086832, -0.002428],
    [521.18, -0.054684, 0.098656, -0.000716],
    [529.51, -0.056050, 0.125666, -0.012414],
    [538.16, -0.036752, 0.130320, -0.014124],
    [547.19, -0.025265, 0.136188, -0.016216],
    [557.54, 0.029672, 0.149062, -0.019840],
    [568.94, 0.079392, 0.121409, -0.016409],
    [580.70, 0.154063, 0.084433, -0.016348],
    [592.19, 0.194735, 0.039398, -0.009244],
    [602.48, 0.182847, 0.008813, -0.006830],
    [611.79, 0.188927, -0.003014, -0.003077],
    [622.87, 0.190697, -0.018612, -0.005438],
    [635.82, 0.150864, -0.011689, 0.000363],
    [650.96, 0.085950, -0.013460, -0.003251],
    [662.25, 0.029953, -0.003523, 0.002101],
    [682.81, 0.025673, -0.003136, -0.001276],
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

    /// CIE 1931's colour matching functions at `l` nm, by Gaussians with a width on either
    /// side as in Wyman, Sloan and Shirley 2013, but more of them: within 0.0086 of the
    /// tables, and what they make of films within 0.0012, 0.0001 on average.
    fn cie_1931(l: f64) -> [f64; 3] {
        /// Height, wavelength in nm, and the inverse widths below and above it in 1/nm.
        type Lobe = [f64; 4];
        const X: &[Lobe] = &[
            [0.4493, 438.6, 0.0582, 0.0288],
            [1.2083, 611.8, 0.0223, 0.0293],
            [-0.0957, 484.2, 0.0805, 0.0215],
            [-0.4156, 635.0, 0.0482, 0.0352],
            [-0.0495, 512.4, 0.0358, 0.0824],
            [-0.1163, 422.2, 0.0820, 0.0296],
        ];
        const Y: &[Lobe] = &[
            [0.6716, 568.7, 0.0202, 0.0244],
            [0.6260, 537.9, 0.0552, 0.0237],
            [-0.2390, 537.0, 0.0824, 0.0211],
            [0.0294, 616.7, 0.0673, 0.0491],
            [-0.0032, 421.1, 0.0523, 0.1448],
        ];
        const Z: &[Lobe] = &[
            [1.2444, 439.4, 0.0601, 0.0291],
            [0.6770, 459.0, 0.0412, 0.0745],
            [-0.1963, 417.6, 0.0946, 0.1833],
            [-0.0542, 450.9, 0.2129, 0.0565],
            [0.0065, 412.4, 0.1122, 0.0117],
        ];
        let lobe = |&[height, at, below, above]: &Lobe| {
            let t = (l - at) * if l < at { below } else { above };
            height * (-0.5 * t * t).exp()
        };
        [X, Y, Z].map(|lobes| lobes.iter().map(lobe).sum())
    }

    /// The same of f64 sums in steps of 1 nm. Errors are the largest and the mean over all
    /// films of the largest of the three channels.
    #[test]
    fn the_spectrum_is_that_of_narrow_steps() {
        const REC709: [[f64; 3]; 3] = [
            [3.240_454_2, -1.537_138_5, -0.498_531_4],
            [-0.969_266_0, 1.876_010_8, 0.041_556_0],
            [0.055_643_4, -0.204_025_9, 1.057_225_2],
        ];
        let steps: Vec<_> = (380..=780)
            .map(|l| {
                let xyz = cie_1931(f64::from(l));
                let rgb = REC709.map(|row| row.iter().zip(xyz).map(|(m, x)| m * x).sum::<f64>());
                (f64::from(l), rgb)
            })
            .collect();
        let whole = [0, 1, 2].map(|c| steps.iter().map(|(_, rgb)| rgb[c]).sum::<f64>());
        let integral = |way: &Way<f64>, eta, k| {
            let [s, p] = way.onto(&Base::new(eta, k, way.sin2));
            let mut sums = [0.0; 3];
            for &(l, rgb) in &steps {
                let delta = way.length / l;
                let mean = 0.5 * (s.reflectance(delta) + p.reflectance(delta));
                sums = [0, 1, 2].map(|c| sums[c] + rgb[c] / whole[c] * mean);
            }
            sums.map(|sum| sum.clamp(0.0, 1.0))
        };
        let plastics: &[_] = &[(1.3, 0.0), (1.5, 0.0), (1.7, 0.0), (2.0, 0.0)];
        let metals: &[_] = &[(0.2, 3.4), (2.9, 3.1), (1.2, 7.0)];
        let thin = 0..=20;
        let thick = 21..=40;
        for (bases, steps_of_50_nm, largest, mean) in [
            (plastics, thin.clone(), 0.0015, 0.000_14),
            (plastics, thick.clone(), 0.012, 0.000_44),
            (metals, thin, 0.043, 0.0013),
            (metals, thick, 0.084, 0.0050),
        ] {
            let mut errors = Vec::new();
            for &(eta, k) in bases {
                for ior in [1.2, 1.33, 1.5, 1.8, 2.2, 2.5] {
                    for step in steps_of_50_nm.clone() {
                        for cos in [1.0, 0.6, 0.3, 0.1f64] {
                            let film = Film {
                                ior,
                                thickness: 50.0 * f64::from(step),
                                cover: 1.0,
                            };
                            let found = film.reflectance(cos, Rgb::splat(eta), Rgb::splat(k));
                            let way = Way::into(&film, cos).expect("denser than the outside");
                            let expected = integral(&way, eta, k);
                            let off = [0, 1, 2].map(|c| (found.0[c] - expected[c]).abs());
                            errors.push(off.into_iter().fold(0.0, f64::max));
                        }
                    }
                }
            }
            let worst = errors.iter().copied().fold(0.0, f64::max);
            let average = errors.iter().sum::<f64>() / errors.len() as f64;
            assert!(
                worst < largest && average < mean,
                "{bases:?}, {steps_of_50_nm:?}: {worst}, {average}"
            );
        }
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
