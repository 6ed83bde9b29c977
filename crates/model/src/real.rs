//! The floating-point types that the model is generic over.

use num_traits::{Float, FloatConst, NumAssign};
use std::fmt::Debug;

/// `f32` or `f64`: the arithmetic of `num-traits` plus the special functions
/// that the model needs.
pub trait Real: Float + FloatConst + NumAssign + Debug + Default + Send + Sync + 'static {
    /// The abscissa from which [`Real::mills_excess`] uses its continued
    /// fraction, and c in the number c/x + 3 of terms that reaches full
    /// precision there.
    const FRACTION: (f64, f64);

    /// The nearest value to `x`.
    fn of(x: f64) -> Self;

    /// This value in double precision.
    fn as_f64(self) -> f64;

    /// Complementary error function, erfc(x) = (2/√π) ∫ₓ^∞ e^{−t²} dt.
    fn erfc(self) -> Self;

    /// Inverse error function on (−1, 1).
    fn erf_inv(self) -> Self;

    /// ln Γ(x) for x > 0.
    fn ln_gamma(self) -> Self;

    /// t(x) in erfc(x) = e^{−x²} / (√π (x + t(x))), for x ≥ 0.
    ///
    /// What e^{−x²}/√π − x·erfc(x) and its like lose to cancellation at large
    /// x is exactly t, which Laplace's continued fraction
    /// t = (1/2)/(x + 1/(x + (3/2)/(x + …))) gives to full relative precision.
    #[inline]
    fn mills_excess(self) -> Self {
        let (from, terms) = Self::FRACTION;
        if self < Self::of(from) {
            return (-self * self).exp() / (Self::PI().sqrt() * self.erfc()) - self;
        }
        let mut tail = Self::zero();
        let terms = (Self::of(terms) / self).to_u32().unwrap_or(0) + 3;
        for k in (1..=terms).rev() {
            tail = Self::of(0.5 * f64::from(k)) / (self + tail);
        }
        tail
    }

    /// First repeated integral of erfc, ierfc(x) = e^{−x²}/√π − x erfc(x),
    /// for x ≥ 0, without cancellation.
    #[inline]
    fn ierfc(self) -> Self {
        let gauss = (-self * self).exp() / Self::PI().sqrt();
        if self < Self::of(Self::FRACTION.0) {
            return gauss - self * self.erfc();
        }
        if gauss == Self::zero() {
            return gauss;
        }
        let t = self.mills_excess();
        gauss * (t / (self + t))
    }
}

impl Real for f32 {
    const FRACTION: (f64, f64) = (2.0, 32.0);

    #[inline(always)]
    fn of(x: f64) -> Self {
        x as f32
    }

    #[inline(always)]
    fn as_f64(self) -> f64 {
        f64::from(self)
    }

    #[inline]
    fn erfc(self) -> Self {
        libm::erfcf(self)
    }

    #[inline]
    fn erf_inv(self) -> Self {
        statrs::function::erf::erf_inv(f64::from(self)) as f32
    }

    #[inline]
    fn ln_gamma(self) -> Self {
        libm::lgammaf(self)
    }
}

impl Real for f64 {
    const FRACTION: (f64, f64) = (3.0, 96.0);

    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn as_f64(self) -> f64 {
        self
    }

    #[inline]
    fn erfc(self) -> Self {
        libm::erfc(self)
    }

    #[inline]
    fn erf_inv(self) -> Self {
        statrs::function::erf::erf_inv(self)
    }

    #[inline]
    fn ln_gamma(self) -> Self {
        libm::lgamma(self)
    }
}

/// ln of the Stirling remainder, μ(x) = ln Γ(x) − (x − ½) ln x + x − ½ ln 2π,
/// for x ≥ 1.
#[inline]
fn stirling_remainder<F: Real>(x: F) -> F {
    if x < F::of(12.0) {
        return x.ln_gamma() - (x - F::of(0.5)) * x.ln() + x
            - F::of(0.5 * (2.0 * std::f64::consts::PI).ln());
    }
    // Bernoulli series; the first term left out is 8.4e-4 / x⁹.
    let (y, q) = (x.recip(), (x * x).recip());
    y * (F::of(1.0 / 12.0)
        - q * (F::of(1.0 / 360.0) - q * (F::of(1.0 / 1260.0) - q * F::of(1.0 / 1680.0))))
}

/// ln B(x, y), the Beta function, for x, y ≥ 1, up to arguments where ln Γ
/// itself would leave no digits to the difference.
#[inline]
pub fn ln_beta<F: Real>(x: F, y: F) -> F {
    let half = F::of(0.5);
    F::of(0.5 * (2.0 * std::f64::consts::PI).ln())
        - (x - half) * (y / x).ln_1p()
        - y * (x / y).ln_1p()
        - half * y.ln()
        + stirling_remainder(x)
        + stirling_remainder(y)
        - stirling_remainder(x + y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ierfc at points on both sides of the switches, from mpmath (40 digits).
    const IERFC: [(f64, f64); 7] = [
        (0.0, 0.5641895835477563),
        (0.3, 0.31421848264721974),
        (1.9, 0.001564185764713108),
        (2.1, 0.0006009450216041504),
        (2.9, 6.421599771933939e-06),
        (3.25, 6.104794348467044e-07),
        (6.5, 2.88935889029054e-21),
    ];

    #[test]
    fn ierfc_keeps_relative_precision_into_the_tail() {
        for (x, expected) in IERFC {
            let rel = (x.ierfc() / expected - 1.0).abs();
            assert!(rel < 1e-13, "f64: x = {x}, relative error {rel:e}");
            let rel = f64::from((x as f32).ierfc()) / expected - 1.0;
            // e^{−x²} alone costs x² ulp in f32.
            assert!(
                rel.abs() < 2e-7 * (4.0 + x * x),
                "f32: x = {x}, relative error {rel:e}"
            );
        }
    }

    #[test]
    fn ierfc_at_infinity_is_zero() {
        assert_eq!(f32::INFINITY.ierfc(), 0.0);
        assert_eq!(f64::INFINITY.ierfc(), 0.0);
    }

    #[test]
    fn ln_beta_holds_from_one_to_huge() {
        for (x, y, expected) in [
            (1.0, 1.0, 0.0),
            (1.5, 2.25, -1.4827261013362656),
            (1.0, 11.75, -2.463853240590168),
            (12.5, 12.5, -17.31603437423943),
            (3.0, 400.0, -17.288730882473626),
            (1000000.0, 1.25, -17.36766019012712),
            (1.0625, 1000000000.0, -22.051427052082342),
            (1000000000000.0, 1000000000000.0, -1386294361132.4406),
        ] {
            let got: f64 = ln_beta(x, y);
            assert!(
                (got - expected).abs() < 1e-12 * (1.0 + expected.abs()),
                "B({x}, {y}): {got} against {expected}"
            );
            let got = f64::from(ln_beta(x as f32, y as f32));
            assert!(
                (got - expected).abs() < 2e-6 * (1.0 + expected.abs()),
                "f32 B({x}, {y}): {got} against {expected}"
            );
        }
    }
}
