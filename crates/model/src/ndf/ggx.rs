use super::{Ndf, Real, Vector3};

/// The GGX (Trowbridge–Reitz) distribution with slope roughness α along x
/// and y: D(m) = 1 / (π α_x α_y (m_x²/α_x² + m_y²/α_y² + m_z²)²), the normals
/// of an ellipsoid.
///
/// Walter et al. 2007, "Microfacet Models for Refraction through Rough
/// Surfaces", eq. 33; anisotropic as in Heitz 2014, "Understanding the
/// Masking-Shadowing Function", eq. 85.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx<F> {
    /// Slope roughness along x (dimensionless, > 0).
    pub alpha_x: F,
    /// Slope roughness along y (dimensionless, > 0).
    pub alpha_y: F,
}

impl<F: Real> Ggx<F> {
    /// The same roughness in all directions.
    #[inline]
    pub fn isotropic(alpha: F) -> Self {
        Self {
            alpha_x: alpha,
            alpha_y: alpha,
        }
    }
}

impl<F: Real> Ndf for Ggx<F> {
    type Scalar = F;

    #[inline]
    fn density(&self, m: Vector3<F>) -> F {
        if m.z <= F::zero() {
            return F::zero();
        }
        let (x, y) = (m.x / self.alpha_x, m.y / self.alpha_y);
        let t = x * x + y * y + m.z * m.z;
        (F::PI() * self.alpha_x * self.alpha_y * t * t).recip()
    }

    /// (w_z + s)/2 with s² = w_z² + α_x² w_x² + α_y² w_y²; below the horizon
    /// the conjugate form, which has no difference in it.
    #[inline]
    fn projected_area(&self, w: Vector3<F>) -> F {
        let (x, y) = (self.alpha_x * w.x, self.alpha_y * w.y);
        let a = x * x + y * y;
        let s = (w.z * w.z + a).sqrt();
        let half = F::of(0.5);
        if w.z >= F::zero() {
            half * (w.z + s)
        } else {
            half * a / (s - w.z)
        }
    }

    /// The spherical-cap construction of Dupuy and Benyoub 2023, "Sampling
    /// Visible GGX Normals with Spherical Caps". Stretched by α, the normals
    /// are a hemisphere's, and the mirror directions off its visible part fill
    /// the cap z ≥ −w_z evenly. That holds for w below the horizon too, if
    /// 1 + w_z is formed without cancellation.
    #[inline]
    fn sample_visible(&self, w: Vector3<F>, u: [F; 2]) -> Vector3<F> {
        let (one, zero) = (F::one(), F::zero());
        // Stretch the view direction to the hemisphere's frame.
        let w = Vector3::new(self.alpha_x * w.x, self.alpha_y * w.y, w.z).normalized();
        let above = if w.z >= zero {
            one + w.z
        } else {
            (w.x * w.x + w.y * w.y) / (one - w.z)
        };
        let below = one - w.z;
        // Pick a mirror direction in the cap; h is the half vector, unscaled.
        let rise = (one - u[0]) * above;
        let sin = (u[0] * above * (below + rise)).max(zero).sqrt();
        let (sin_phi, cos_phi) = (F::TAU() * u[1]).sin_cos();
        let h = Vector3::new(sin * cos_phi + w.x, sin * sin_phi + w.y, rise);
        // Unstretch the normal.
        let m = Vector3::new(self.alpha_x * h.x, self.alpha_y * h.y, h.z);
        let length = m.length();
        if length > zero {
            m * length.recip()
        } else {
            horizontal(w)
        }
    }
}

/// The limit of the visible normals as w goes to straight below.
#[inline]
fn horizontal<F: Real>(w: Vector3<F>) -> Vector3<F> {
    let r = w.x.hypot(w.y);
    if r > F::zero() {
        Vector3::new(w.x / r, w.y / r, F::zero())
    } else {
        Vector3::new(F::one(), F::zero(), F::zero())
    }
}
