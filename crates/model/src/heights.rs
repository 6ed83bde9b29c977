//! Distributions of heights on the microsurface.
//!
//! The BSDF does not depend on them; they turn the depth τ of a walk into a
//! height: τ = −ln C1(h).

use super::Real;

/// A distribution of heights (in units of its own scale, mean 0).
pub trait Heights<F: Real> {
    /// The density P1(h).
    fn density(&self, h: F) -> F;

    /// The distribution function C1(h).
    fn below(&self, h: F) -> F;

    /// The height at which C1 is `c`, in (0, 1).
    fn at(&self, c: F) -> F;

    /// The height at optical depth `tau` ≥ 0 below the top, C1(h) = e^{−τ}.
    fn at_depth(&self, tau: F) -> F {
        self.at((-tau).exp())
    }
}

/// Normally distributed heights with standard deviation 1: those of the
/// Gaussian random surface whose slopes are Beckmann's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gaussian;

impl<F: Real> Heights<F> for Gaussian {
    fn density(&self, h: F) -> F {
        (-F::of(0.5) * h * h).exp() / F::TAU().sqrt()
    }

    fn below(&self, h: F) -> F {
        F::of(0.5) * (-h * F::FRAC_1_SQRT_2()).erfc()
    }

    fn at(&self, c: F) -> F {
        F::SQRT_2() * (F::of(2.0) * c - F::one()).erf_inv()
    }
}

/// Heights evenly distributed in [−1, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uniform;

impl<F: Real> Heights<F> for Uniform {
    fn density(&self, h: F) -> F {
        if h.abs() <= F::one() {
            F::of(0.5)
        } else {
            F::zero()
        }
    }

    fn below(&self, h: F) -> F {
        (F::of(0.5) * (h + F::one())).max(F::zero()).min(F::one())
    }

    fn at(&self, c: F) -> F {
        F::of(2.0) * c - F::one()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inverts(heights: impl Heights<f64>) {
        for c in [1e-6, 0.1, 0.5, 0.9, 1.0 - 1e-6] {
            let h = heights.at(c);
            assert!((heights.below(h) - c).abs() < 1e-12, "C1({h}) is not {c}");
            let step = 1e-6;
            let slope = (heights.below(h + step) - heights.below(h - step)) / (2.0 * step);
            assert!((slope - heights.density(h)).abs() < 1e-8);
        }
        assert!((heights.at_depth(0.7) - heights.at((-0.7f64).exp())).abs() < 1e-15);
    }

    #[test]
    fn distribution_functions_invert() {
        inverts(Gaussian);
        inverts(Uniform);
    }
}
