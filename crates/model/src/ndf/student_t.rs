use statrs::function::beta::{beta, beta_reg};

use super::{Ndf, Real, Vector3, length, rotate_to_azimuth, zero};

/// Student's t-distribution of slopes, with slope roughness α along x and y and
/// the exponent γ: D(m) = (1 + tan²θ_m/(γ − 1))^(−γ) / (π α_x α_y m_z⁴) with the
/// tangent measured in units of α. GGX at γ = 2, Beckmann as γ → ∞, and longer tails
/// than GGX's below 2.
///
/// Ribardière, Bringier, Meneveaux and Simonot 2017, "STD: Student's t-Distribution of
/// Slopes for Microfacet Based BSDFs", eq. 11. Everything is computed in double
/// precision; normals are found by inversion, some ten times slower than GGX's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StudentT<F> {
    /// Slope roughness along x (dimensionless, > 0).
    pub alpha_x: F,
    /// Slope roughness along y (dimensionless, > 0).
    pub alpha_y: F,
    /// γ > 3/2: below that the mean slope, and with it σ, is infinite.
    pub gamma: F,
}

impl<F: Real> StudentT<F> {
    /// The same roughness in all directions.
    #[inline]
    pub fn isotropic(alpha: F, gamma: F) -> Self {
        Self {
            alpha_x: alpha,
            alpha_y: alpha,
            gamma,
        }
    }

    fn slopes(&self) -> Slopes {
        Slopes::new(self.gamma.as_f64())
    }
}

impl<F: Real> Ndf for StudentT<F> {
    type Scalar = F;

    fn density(&self, m: Vector3<F>) -> F {
        let [z, gamma] = [m.z, self.gamma].map(F::as_f64);
        if z <= 0.0 {
            return F::zero();
        }
        let [alpha_x, alpha_y] = [self.alpha_x, self.alpha_y].map(F::as_f64);
        let (x, y) = (m.x.as_f64() / alpha_x, m.y.as_f64() / alpha_y);
        let z2 = z * z;
        let t = z2 + (x * x + y * y) / (gamma - 1.0);
        let power = (-gamma * (t / z2).ln() - 2.0 * z2.ln()).exp();
        F::of(power / (std::f64::consts::PI * alpha_x * alpha_y))
    }

    /// With a = cotθ in units of α, σ = s·H(a) below the horizon, and w_z more above,
    /// where s = w_z/a.
    fn projected_area(&self, w: Vector3<F>) -> F {
        let s = length(self.alpha_x * w.x, self.alpha_y * w.y).as_f64();
        let z = w.z.as_f64();
        if s == 0.0 {
            return F::of(z.max(0.0));
        }
        F::of(s * self.slopes().beyond(z.abs() / s) + z.max(0.0))
    }

    /// Stretched by α, the slope along the view azimuth has the density
    /// ∝ (cosθ − x sinθ)⁺ P(x), whose distribution function is that of Student's
    /// distribution and a power; the one across is of Student's distribution again,
    /// wider where the first is steep. Both are inverted numerically.
    fn sample_visible(&self, w: Vector3<F>, u: [F; 2]) -> Vector3<F> {
        let w = Vector3::new(self.alpha_x * w.x, self.alpha_y * w.y, w.z).normalized();
        let [x, y, z] = [w.x, w.y, w.z].map(F::as_f64);
        let slopes = self.slopes();
        // The half step keeps the quantile of u = 0 finite.
        let half = 0.25 * F::epsilon().as_f64();
        let [u, v] = u.map(|u| u.as_f64().clamp(half, 1.0 - half));
        let along = slopes.along(z, x.hypot(y), u);
        let across = slopes.across(along, v);
        let [along, across] = [along, across].map(|slope| F::of(-slope));
        let m = rotate_to_azimuth(w.x, w.y, Vector3::new(along, across, F::one()));
        let m = Vector3::new(self.alpha_x * m.x, self.alpha_y * m.y, F::one());
        let length = m.length();
        if length.is_finite() {
            m * length.recip()
        } else {
            Vector3::new(F::one(), F::zero(), F::zero())
        }
    }
}

/// Slopes in units of α: of one, Student's t with ν = 2γ − 2 degrees, divided by √2.
struct Slopes {
    gamma: f64,
    /// √(γ − 1), the slope at which its density is that of a power law.
    knee: f64,
    /// B(γ − 1, 1/2).
    beta: f64,
}

impl Slopes {
    fn new(gamma: f64) -> Self {
        Self {
            gamma,
            knee: (gamma - 1.0).sqrt(),
            beta: beta(gamma - 1.0, 0.5),
        }
    }

    /// 1/(1 + (a/knee)²).
    fn fall(&self, a: f64) -> f64 {
        let t = a / self.knee;
        1.0 / (1.0 + t * t)
    }

    /// P(a), the density of one slope.
    fn density(&self, a: f64) -> f64 {
        self.fall(a).powf(self.gamma - 0.5) / (self.knee * self.beta)
    }

    /// The chance of a slope above a ≥ 0.
    fn tail(&self, a: f64) -> f64 {
        0.5 * beta_reg(self.gamma - 1.0, 0.5, self.fall(a))
    }

    /// ∫ x P(x) dx from a to ∞, or from −∞ to a with the other sign.
    fn moment(&self, a: f64) -> f64 {
        let rest = 2.0 * self.gamma - 3.0;
        self.knee * self.fall(a).powf(0.5 * rest) / (rest * self.beta)
    }

    /// H(a) = ∫ (x − a) P(x) dx from a ≥ 0 to ∞. Far out that is the difference of
    /// nearly equal terms; there a series of positive ones has it.
    fn beyond(&self, a: f64) -> f64 {
        let x = self.fall(a);
        if x > 0.5 {
            return self.moment(a) - a * self.tail(a);
        }
        let rest = 2.0 * self.gamma - 3.0;
        let gamma = self.gamma;
        // Σ (γ − 1/2)ₙ₋₁/(γ)ₙ xⁿ, by the ratio of its terms.
        let (mut term, mut sum, mut n) = (x / gamma, 0.0, 1.0);
        while term > 1e-17 * sum {
            sum += term;
            term *= x * (gamma - 1.5 + n) / (gamma + n);
            n += 1.0;
        }
        let bracket = 1.0 / (rest * (rest + 1.0)) + sum / (4.0 * (gamma - 1.0));
        self.knee * x.powf(0.5 * rest) / self.beta * bracket
    }

    /// ∫ (cos − x sin)⁺ P(x) dx up to `slope`, without cancellation.
    fn facing(&self, cos: f64, sin: f64, slope: f64) -> f64 {
        let a = slope.abs();
        if cos >= 0.0 {
            let below = if slope < 0.0 {
                self.tail(a)
            } else {
                1.0 - self.tail(a)
            };
            cos * below + sin * self.moment(a)
        } else {
            sin * self.beyond(a) + (sin * a + cos).max(0.0) * self.tail(a)
        }
    }

    /// The u-quantile of the density ∝ (cos − x sin)⁺ P(x), over arsinh(x/knee), in
    /// which tails are straight lines.
    fn along(&self, cos: f64, sin: f64, u: f64) -> f64 {
        let top = if sin > 0.0 { cos / sin } else { f64::INFINITY };
        let slope = |x: f64| self.knee * x.sinh();
        let most = if top < 1e8 {
            self.facing(cos, sin, top)
        } else {
            cos
        };
        let target = (u * most).ln();
        let mass = |x: f64| {
            let at = slope(x);
            let mass = self.facing(cos, sin, at);
            let density = (cos - at * sin).max(0.0) * self.density(at);
            (mass.ln() - target, density * self.knee * x.cosh() / mass)
        };
        let end = (top.min(1e8) / self.knee).asinh();
        let mut left = end.min(0.0) - 1.0;
        while mass(left).0 > 0.0 && left > -700.0 {
            left *= 2.0;
        }
        slope(zero(mass, left, end))
    }

    /// The v-quantile of the other slope, given one: of Student's distribution with
    /// 2γ − 1 degrees, √(knee² + along²) wide.
    fn across(&self, along: f64, v: f64) -> f64 {
        let width = self.knee.hypot(along);
        let scale = beta(self.gamma - 0.5, 0.5);
        let both = 2.0 * v.min(1.0 - v);
        // −ln of the chance to be beyond, on either side.
        let rarity = |x: f64| {
            let cosh = x.cosh();
            let beyond = beta_reg(self.gamma - 0.5, 0.5, 1.0 / (cosh * cosh));
            let density = 2.0 * cosh.powf(1.0 - 2.0 * self.gamma) / scale;
            (both.ln() - beyond.ln(), density / beyond)
        };
        let mut end = 1.0;
        while rarity(end).0 < 0.0 && end < 700.0 {
            end *= 2.0;
        }
        let distance = width * zero(rarity, 0.0, end).sinh();
        if v < 0.5 { -distance } else { distance }
    }
}
