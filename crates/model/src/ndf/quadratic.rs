use std::marker::PhantomData;

use super::{Ndf, Real, Vector3, length, rotate_to_azimuth};

/// D(m) = (2/π) m_z² on the hemisphere: the distribution whose Smith mirror
/// BRDF is known in closed form to all orders (Dupuy 2026), which makes it the
/// model's yardstick. It is very rough, and has no parameter.
///
/// σ(w) = (1 + w_z)²/4.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quadratic<F>(PhantomData<F>);

impl<F: Real> Quadratic<F> {
    /// The one there is.
    #[inline]
    pub fn new() -> Self {
        Self(PhantomData)
    }

    /// f(ω_i, ω_o) cosθ_o of its perfect mirror, all orders, sr⁻¹:
    /// f = (cosθ_i + cosθ_o) / (π (1 + ω_i·ω_o)).
    pub fn mirror_all_orders(wi: Vector3<F>, wo: Vector3<F>) -> F {
        wo.z * (wi.z + wo.z) / (F::PI() * (F::one() + wi.dot(wo)))
    }

    /// First order of the same, sr⁻¹, cosine included:
    /// the whole divided by 1 + cosθ_i cosθ_o.
    pub fn mirror_first_order(wi: Vector3<F>, wo: Vector3<F>) -> F {
        Self::mirror_all_orders(wi, wo) / (F::one() + wi.z * wo.z)
    }
}

/// 1 + z of a unit vector, without cancellation near z = −1.
#[inline]
fn one_plus_z<F: Real>(w: Vector3<F>) -> F {
    if w.z >= F::zero() {
        F::one() + w.z
    } else {
        (w.x * w.x + w.y * w.y) / (F::one() - w.z)
    }
}

impl<F: Real> Ndf for Quadratic<F> {
    type Scalar = F;

    #[inline]
    fn density(&self, m: Vector3<F>) -> F {
        if m.z <= F::zero() {
            F::zero()
        } else {
            F::of(2.0) * F::FRAC_1_PI() * m.z * m.z
        }
    }

    #[inline]
    fn projected_area(&self, w: Vector3<F>) -> F {
        let rise = one_plus_z(w);
        F::of(0.25) * rise * rise
    }

    /// Mirror directions r off the visible normals have a density
    /// ∝ (w_z + r_z)² / (1 + w·r). Its integral over the azimuth of r is
    /// ∝ w_z + r_z, linear in r_z; given r_z, the azimuth is ∝ 1/(A + B cosφ),
    /// whose distribution function inverts by the half-angle tangent.
    #[inline]
    fn sample_visible(&self, w: Vector3<F>, u: [F; 2]) -> Vector3<F> {
        let (one, two) = (F::one(), F::of(2.0));
        let above = one_plus_z(w);
        let rise = above * (one - u[0]).sqrt();
        // r_z = rise − w_z; 1 − r_z and 1 + r_z by sums of positive terms.
        let low = above * (u[0] / (one + (one - u[0]).sqrt()));
        let r_sin = (low * (two - low)).max(F::zero()).sqrt();
        let w_sin = length(w.x, w.y);
        // A + B and A − B, with (A + B)(A − B) = rise²; A = 1 + w_z r_z from
        // what w_z is above −1 and r_z below 1, as both may be small.
        let sum = low + above * (one - low) + w_sin * r_sin;
        let difference = if sum > F::zero() {
            rise * rise / sum
        } else {
            F::zero()
        };
        // tan(φ/2) = √((A+B)/(A−B)) tan(π(u − ½))
        let (s, c) = (F::PI() * (u[1] - F::of(0.5))).sin_cos();
        let (s, c) = (s * sum.max(F::zero()).sqrt(), c * difference.sqrt());
        let n = s * s + c * c;
        let (cos_phi, sin_phi) = if n > F::zero() {
            ((c * c - s * s) / n, two * s * c / n)
        } else {
            (-one, F::zero())
        };
        let h = Vector3::new(w_sin + r_sin * cos_phi, r_sin * sin_phi, rise);
        let length = h.length();
        let m = if length > F::zero() {
            h * length.recip()
        } else {
            Vector3::new(one, F::zero(), F::zero())
        };
        rotate_to_azimuth(w.x, w.y, m)
    }
}
