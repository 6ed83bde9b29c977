//! Beckmann in lanes, and the special functions of it.

use std::f32::consts::{FRAC_1_PI, PI};

use wide::{CmpGe, CmpGt, CmpLt, f32x8};

use super::math::Directions;
use super::ndf::{NdfInLanes, NdfLanes};
use crate::Beckmann;

/// A Beckmann distribution, the same in all lanes.
pub struct BeckmannLanes {
    alpha_x: f32x8,
    alpha_y: f32x8,
    /// π α_x α_y
    norm: f32x8,
}

/// Cotangents, in units of α, are held below this. Past it nothing changes but the
/// scale of the slopes seen from below, which is not taken from them.
const STEEPEST: f32 = 1e6;

impl NdfInLanes for Beckmann<f32> {
    type Lanes = BeckmannLanes;

    #[inline]
    fn in_lanes(&self) -> BeckmannLanes {
        BeckmannLanes {
            alpha_x: self.alpha_x.into(),
            alpha_y: self.alpha_y.into(),
            norm: (PI * self.alpha_x * self.alpha_y).into(),
        }
    }
}

impl NdfLanes for BeckmannLanes {
    #[inline(always)]
    fn density(&self, h: Directions) -> f32x8 {
        let (x, y) = (h.x / self.alpha_x, h.y / self.alpha_y);
        let squared = h.z * h.z;
        let gauss = (-(x * x + y * y) / squared).exp();
        let ratio = h.dot(h) / squared;
        let seen = h.z.cmp_gt(f32x8::ZERO) & gauss.cmp_gt(f32x8::ZERO);
        seen.blend(gauss * ratio * ratio / self.norm, f32x8::ZERO)
    }

    #[inline(always)]
    fn projected_areas(&self, w: Directions) -> [f32x8; 2] {
        let (x, y) = (self.alpha_x * w.x, self.alpha_y * w.y);
        let s = (x * x + y * y).sqrt();
        let least = f32x8::HALF * s * ierfc(w.z.abs() / s);
        [
            least + w.z.fast_max(f32x8::ZERO),
            least + (-w.z).fast_max(f32x8::ZERO),
        ]
    }

    #[inline(always)]
    fn sample_visible(&self, w: Directions, [u, v]: [f32x8; 2]) -> Directions {
        let (zero, one) = (f32x8::ZERO, f32x8::ONE);
        // As in the scalar code, quantiles of 0 are kept finite.
        let least = f32x8::from(0.25 * f32::EPSILON);
        let (u, v) = (u.fast_max(least), v.fast_max(least));
        let (x, y) = (self.alpha_x * w.x, self.alpha_y * w.y);
        let s = (x * x + y * y).sqrt();
        let along = slope_along(w.z, s, u);
        let across = erf_inv_of_twice_less_one(v);
        // The normal before it is turned to the azimuth of w, of any length: seen from
        // below its slope is that of w and `along` more, and s times that is finite.
        let up = w.z.cmp_ge(zero).blend(one, s);
        let towards = up * along + (-w.z).fast_max(zero);
        let aside = -(up * across);
        let slanted = s.cmp_gt(zero);
        let (cos, sin) = (slanted.blend(x / s, one), slanted.blend(y / s, zero));
        let m = Directions {
            x: self.alpha_x * (cos * towards - sin * aside),
            y: self.alpha_y * (sin * towards + cos * aside),
            z: up,
        };
        m.scaled(one / m.dot(m).sqrt())
    }
}

/// Numerator and denominator, P and Q, of t(x) in erfc(x) = e^{−x²} / (√π (x + t(x))),
/// for 0 ≤ x ≤ [`STEEPEST`]; see [`crate::Real::mills_excess`].
///
/// The rational function of degrees 4 and 5 of the least relative error, 8.2e-8 (found
/// by reweighted least squares). All terms are positive, so none of what is made of
/// them cancels.
#[inline(always)]
fn mills_excess(x: f32x8) -> [f32x8; 2] {
    let horner = |terms: &[f32]| {
        terms
            .iter()
            .rev()
            .map(|&term| f32x8::from(term))
            .reduce(|sum, term| sum.mul_add(x, term))
            .unwrap_or_default()
    };
    [
        horner(&[22.050_104, 23.284_59, 12.152_462, 3.521_395_3, 0.5]),
        horner(&[
            39.082_79,
            66.443_31,
            53.652_797,
            25.303_091,
            7.042_821_5,
            1.0,
        ]),
    ]
}

/// ∫ₓ^∞ erfc(t) dt = e^{−x²}/√π · t/(x + t), for x ≥ 0.
#[inline(always)]
pub(crate) fn ierfc(x: f32x8) -> f32x8 {
    let x = x.fast_min(STEEPEST.into());
    let [p, q] = mills_excess(x);
    f32x8::from(FRAC_1_PI.sqrt()) * (-x * x).exp() * (p / x.mul_add(q, p))
}

/// erf⁻¹(2u − 1) for 0 < u < 1.
///
/// Giles 2010, "Approximating the erfinv function", single precision.
#[inline(always)]
pub(crate) fn erf_inv_of_twice_less_one(u: f32x8) -> f32x8 {
    let horner = |x: f32x8, terms: [f32; 9]| {
        terms
            .into_iter()
            .map(f32x8::from)
            .reduce(|sum, term| sum.mul_add(x, term))
            .unwrap_or_default()
    };
    let x = u + u - f32x8::ONE;
    let w = -(f32x8::from(4.0) * u * (f32x8::ONE - u)).ln();
    let middle = horner(
        w - f32x8::from(2.5),
        [
            2.810_226_4e-8,
            3.432_739_4e-7,
            -3.523_387_7e-6,
            -4.391_506_5e-6,
            0.000_218_580_87,
            -0.001_253_725,
            -0.004_177_681_6,
            0.246_640_73,
            1.501_409_4,
        ],
    );
    let tails = horner(
        w.fast_max(f32x8::ZERO).sqrt() - f32x8::from(3.0),
        [
            -0.000_200_214_26,
            0.000_100_950_56,
            0.001_349_343_2,
            -0.003_673_428_4,
            0.005_739_507_7,
            -0.007_622_461_3,
            0.009_438_870_5,
            1.001_674,
            2.832_976_8,
        ],
    );
    x * w.cmp_lt(f32x8::from(5.0)).blend(middle, tails)
}

/// Steps of Halley's method, which triples the digits, from [`gap`] to those that single
/// precision has.
const STEPS: usize = 2;

/// What [`slope_along`] begins with: a fit of two variables, the cosine of the view in
/// the stretched frame and √(−ln u), after which one step leaves a relative error of
/// the probability of 4e-4 at most, and two 2e-8.
#[inline(always)]
fn gap(cos: f32x8, root: f32x8) -> f32x8 {
    let quadratic = |[a, b, c]: [f32; 3]| {
        let slope = f32x8::from(c).mul_add(cos, b.into());
        slope.mul_add(cos, a.into())
    };
    let numerator = quadratic([0.136_784_5, 0.308_020_3, 0.172_019_6])
        .mul_add(root, quadratic([0.741_411, 0.840_265_4, 0.100_841_2]));
    let denominator = quadratic([1.0, 2.015_715, 1.015_699])
        .mul_add(root, quadratic([0.270_272, 0.000_815_096, -0.267_119_1]));
    root * numerator / denominator
}

/// Facets that face a direction of this cosine, where `s` is the sine in units of 1/α,
/// have a slope −y along its azimuth that is below c = cosθ/s with the density
/// ∝ (c + y) e^{−y²}, y > −c. Returns the y that a share `u` of them is above; from
/// below, where that is −c and more, what it is above −c.
///
/// All with b = max(−c, 0), C = max(c, 0), and z = y + C > 0, how far the slope is from
/// level with the direction.
#[inline(always)]
fn slope_along(cos: f32x8, s: f32x8, u: f32x8) -> f32x8 {
    let (zero, one, two, half) = (f32x8::ZERO, f32x8::ONE, f32x8::from(2.0), f32x8::HALF);
    let steepest = f32x8::from(STEEPEST);
    let c = (cos / s).fast_min(steepest).fast_max(-steepest);
    let (b, top) = ((-c).fast_max(zero), c.fast_max(zero));
    // Twice the share of facets with more, times e^{b²}.
    let whole = two * f32x8::from(PI.sqrt()) * top;
    let mass = |y: f32x8, gauss: f32x8| {
        let magnitude = y.abs();
        let x = b + magnitude;
        let [p, q] = mills_excess(x);
        let falls = y.cmp_lt(zero);
        let lever = magnitude + falls.blend(-top, top);
        falls.blend(whole, zero) + gauss * (lever.mul_add(q, p) / x.mul_add(q, p))
    };
    let target = u * mass(-top, (-top * top).exp());
    // Begin with z (z − c − y∞) = gap, where y∞ is what y is for c → ∞, a Gaussian; and
    // with the one of the two solutions that is positive, by a sum.
    let far = -erf_inv_of_twice_less_one(u);
    let gap = gap(cos / (cos * cos + s * s).sqrt(), (-u.ln()).sqrt());
    let ahead = c + far;
    let near = two * gap / ((ahead * ahead + f32x8::from(4.0) * gap).sqrt() + ahead.abs());
    let mut y = near + ahead.cmp_gt(zero).blend(far - b, -top);
    for _ in 0..STEPS {
        // Halley's step for a zero of g = ln(mass/target).
        let z = y + top;
        let magnitude = y.abs();
        let gauss = (-magnitude * (two * b + magnitude)).exp();
        let mass = mass(y, gauss);
        let slope = -two * z * gauss / mass;
        let curvature = one / z - two * (b + y) - slope;
        let newton = (mass / target).ln() / slope;
        let step = newton / (one - half * newton * curvature).fast_max(half);
        // Past the end of the density: halve the distance to it instead.
        y = z.cmp_gt(step).blend(y - step, y - half * z);
    }
    y
}
