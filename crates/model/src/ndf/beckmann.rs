use super::{Ndf, Real, Vector3, length, rotate_to_azimuth};

/// The Beckmann distribution with slope roughness α (√2 times the RMS slope)
/// along x and y: Gaussian slopes, D(m) = exp(−tan²θ_m) / (π α_x α_y m_z⁴)
/// with the tangent measured in units of α.
///
/// Beckmann and Spizzichino 1963; anisotropic as in Heitz 2014,
/// "Understanding the Masking-Shadowing Function", eq. 82.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beckmann<F> {
    /// Slope roughness along x (dimensionless, > 0).
    pub alpha_x: F,
    /// Slope roughness along y (dimensionless, > 0).
    pub alpha_y: F,
}

impl<F: Real> Beckmann<F> {
    /// The same roughness in all directions.
    #[inline]
    pub fn isotropic(alpha: F) -> Self {
        Self {
            alpha_x: alpha,
            alpha_y: alpha,
        }
    }
}

impl<F: Real> Ndf for Beckmann<F> {
    type Scalar = F;

    #[inline]
    fn density(&self, m: Vector3<F>) -> F {
        if m.z <= F::zero() {
            return F::zero();
        }
        let (x, y) = (m.x / (self.alpha_x * m.z), m.y / (self.alpha_y * m.z));
        let gauss = (-(x * x + y * y)).exp();
        if gauss == F::zero() {
            return gauss;
        }
        let z2 = m.z * m.z;
        gauss / (F::PI() * self.alpha_x * self.alpha_y * z2 * z2)
    }

    /// With a = cotθ in units of α, σ = s·ierfc(a)/2 below the horizon, and
    /// w_z more above, where s = w_z/a. No difference of nearly equal terms.
    #[inline]
    fn projected_area(&self, w: Vector3<F>) -> F {
        let s = length(self.alpha_x * w.x, self.alpha_y * w.y);
        if s == F::zero() {
            return w.z.max(F::zero());
        }
        F::of(0.5) * s * (w.z.abs() / s).ierfc() + w.z.max(F::zero())
    }

    /// Stretched by α, the slope across the view azimuth is Gaussian and the
    /// one along it has the density ∝ (cosθ − x sinθ)⁺ e^{−x²}; the latter's
    /// distribution function is closed (Heitz and d'Eon 2014) and is inverted
    /// numerically, to the last digits.
    #[inline]
    fn sample_visible(&self, w: Vector3<F>, u: [F; 2]) -> Vector3<F> {
        let one = F::one();
        let w = Vector3::new(self.alpha_x * w.x, self.alpha_y * w.y, w.z).normalized();
        let sin = length(w.x, w.y);
        // The half step keeps the quantile of u = 0 finite.
        let quantile = |u: F| u.max(F::of(0.25) * F::epsilon());
        let along = if w.z >= F::zero() {
            slope_from_above(w.z, sin, quantile(u[0]))
        } else {
            slope_from_below(-w.z / sin, quantile(u[0]))
        };
        let across = (F::of(2.0) * quantile(u[1]) - one)
            .max(F::epsilon() - one)
            .erf_inv();
        let m = rotate_to_azimuth(w.x, w.y, Vector3::new(-along, -across, one));
        let m = Vector3::new(self.alpha_x * m.x, self.alpha_y * m.y, one);
        let length = m.length();
        if length.is_finite() {
            m * length.recip()
        } else {
            Vector3::new(one, F::zero(), F::zero())
        }
    }
}

/// Steps before a root is taken as it is. They stop far earlier; this only
/// bounds the run time, should rounding make them oscillate.
const MAX_STEPS: u32 = 20;

/// A step of Halley's method for a zero of g = ln `ratio`, from g' and g''/g'.
///
/// Convergence is cubic: after a step below [`enough`] the error is rounding.
#[inline]
fn halley<F: Real>(g: F, slope: F, curvature: F) -> F {
    let newton = g / slope;
    newton / (F::one() - F::of(0.5) * newton * curvature).max(F::of(0.5))
}

/// The size of a step after which the next would be lost in rounding.
#[inline]
fn enough<F: Real>() -> F {
    F::of(0.25) * F::epsilon().cbrt()
}

/// The u-quantile of the density ∝ (cos − x sin)⁺ e^{−x²}, for cos ≥ 0: a zero
/// of ln P − ln(u P(top)), with the distribution function
/// P(x) = (sin e^{−x²} + cos √π erfc(−x)) / 2.
#[inline]
fn slope_from_above<F: Real>(cos: F, sin: F, u: F) -> F {
    let (one, two, half) = (F::one(), F::of(2.0), F::of(0.5));
    let root_pi = F::PI().sqrt();
    // The quantiles of grazing incidence (Rayleigh) and of normal incidence
    // (Gaussian) enclose the root; it moves from one to the other with cos.
    let right = (two * u - one).max(F::epsilon() - one).erf_inv();
    let top = if sin > F::zero() {
        cos / sin
    } else {
        F::infinity()
    };
    if top >= F::of(1e8) {
        return right;
    }
    let left = -(-u.ln()).max(F::zero()).sqrt();
    let mass = |gauss: F, x: F| half * (sin * gauss + cos * root_pi * (-x).erfc());
    let target = u * mass((-top * top).exp(), top);
    let between = left + cos * (right - left);
    let mut x = if between < top {
        between
    } else {
        half * (left + top)
    };
    for _ in 0..MAX_STEPS {
        let gauss = (-x * x).exp();
        let (p, density) = (mass(gauss, x), (cos - x * sin) * gauss);
        let slope = density / p;
        let curvature = -sin * gauss / density - two * x - slope;
        let next = x - halley((p / target).ln(), slope, curvature);
        // Rounding where the density goes to zero can send a step anywhere.
        let next = if next < top {
            next.max(left)
        } else {
            half * (x + top)
        };
        let moved = (next - x).abs();
        x = next;
        if moved <= enough::<F>() * (top - x).min(one) {
            break;
        }
    }
    x
}

/// The same for cos < 0, in terms of b = −cos/sin > 0 and y = −x − b > 0,
/// which is small where b is large: then P ∝ e^{−2by − y²} (y + t) / (b + y + t)
/// with t = t(b + y) of [`Real::mills_excess`].
#[inline]
fn slope_from_below<F: Real>(b: F, u: F) -> F {
    let two = F::of(2.0);
    let t0 = b.mills_excess();
    let scale = (b + t0) / t0;
    let ln_u = u.ln();
    // Exact in the limits of small and of large b, up to the factor (y + t)/t.
    let mut y = -ln_u / ((b * b - ln_u).sqrt() + b);
    for _ in 0..2 * MAX_STEPS {
        let x = b + y;
        let t = x.mills_excess();
        let g = -y * (two * b + y) + (scale * (y + t) / (x + t)).ln() - ln_u;
        let slope = -two * y * (x + t) / (y + t);
        let next = y - g / slope;
        // Past the end of the density: halve the distance to it instead.
        let next = if next > F::zero() {
            next
        } else {
            F::of(0.5) * y
        };
        let moved = (next - y).abs();
        y = next;
        if moved <= F::of(4.0) * F::epsilon() * (y + t) {
            break;
        }
    }
    -(b + y)
}
