//! Distributions of micro-normals.

mod beckmann;
mod ggx;
mod quadratic;
mod student_t;
mod tabulated;

pub use beckmann::Beckmann;
pub use ggx::Ggx;
pub use quadratic::Quadratic;
pub use student_t::StudentT;
pub use tabulated::{NormalTable, NormalTableError, Tabulated};

use num_traits::{Float, Zero};

use super::{Real, Vector3};

/// A distribution of micro-normals D(m) on the upper hemisphere, normalised
/// to ∫ D(m) m_z dm = 1, whose heights and normals are independent (Smith).
///
/// Every function of a direction `w` holds on the whole sphere: rays inside
/// the microsurface also go up, and then see it from below.
pub trait Ndf: Copy {
    /// What it is computed in, `f32` or `f64`.
    type Scalar: Real;

    /// D(m), sr⁻¹: the area of micro-facets with normal around m per unit of
    /// macroscopic area and solid angle. 0 for m_z ≤ 0.
    fn density(&self, m: Vector3<Self::Scalar>) -> Self::Scalar;

    /// σ(w) = ∫ ⟨m·w⟩ D(m) dm: the area of all micro-facets that face w,
    /// projected along w, per unit of macroscopic area. σ(w) − σ(−w) = w_z.
    fn projected_area(&self, w: Vector3<Self::Scalar>) -> Self::Scalar;

    /// σ(w) and σ(−w), for little more than one of them. Adding up what lies
    /// below the horizon and w_z loses no digits.
    #[inline]
    fn projected_areas(&self, w: Vector3<Self::Scalar>) -> [Self::Scalar; 2] {
        if w.z >= Self::Scalar::zero() {
            let below = self.projected_area(-w);
            [below + w.z, below]
        } else {
            let below = self.projected_area(w);
            [below, below - w.z]
        }
    }

    /// Smith's Λ(w) = σ(−w) / w_z, for w_z ≥ 0 (∞ at w_z = 0).
    #[inline]
    fn lambda(&self, w: Vector3<Self::Scalar>) -> Self::Scalar {
        self.projected_area(-w) / w.z
    }

    /// Smith's masking G1(w) = 1 / (1 + Λ(w)) = w_z / σ(w), for w_z ≥ 0.
    #[inline]
    fn masking(&self, w: Vector3<Self::Scalar>) -> Self::Scalar {
        w.z / self.projected_area(w)
    }

    /// D_w(m) = ⟨m·w⟩ D(m) / σ(w), sr⁻¹: the density of normals seen from w.
    #[inline]
    fn visible_density(&self, w: Vector3<Self::Scalar>, m: Vector3<Self::Scalar>) -> Self::Scalar {
        let facing = w.dot(m).max(Self::Scalar::zero());
        if facing == Self::Scalar::zero() {
            Self::Scalar::zero()
        } else {
            facing * self.density(m) / self.projected_area(w)
        }
    }

    /// A unit normal with density [`Ndf::visible_density`], from two uniform
    /// numbers in [0, 1); continuous in both. Seen from straight below
    /// (w = −z, where σ = 0) it is the limit, a horizontal normal.
    fn sample_visible(
        &self,
        w: Vector3<Self::Scalar>,
        u: [Self::Scalar; 2],
    ) -> Vector3<Self::Scalar>;
}

/// √(x² + y²). Where the squares underflow, so does what it is needed for.
#[inline]
fn length<F: Real>(x: F, y: F) -> F {
    (x * x + y * y).sqrt()
}

/// Turns a vector given in the frame whose x axis is the azimuth of (x, y)
/// back into the frame that (x, y) is given in.
#[inline]
fn rotate_to_azimuth<F: Real>(x: F, y: F, v: Vector3<F>) -> Vector3<F> {
    let r = length(x, y);
    if r == F::zero() {
        return v;
    }
    let (cos, sin) = (x / r, y / r);
    Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z)
}

/// The zero between `left` and `right` of a rising function that is given with its
/// slope: Newton's method, and halves where that leaves the interval.
fn zero(f: impl Fn(f64) -> (f64, f64), mut left: f64, mut right: f64) -> f64 {
    let mut x = 0.5 * (left + right);
    for _ in 0..100 {
        let (value, slope) = f(x);
        if value > 0.0 {
            right = x;
        } else {
            left = x;
        }
        let newton = x - value / slope;
        let next = if newton > left && newton < right {
            newton
        } else {
            0.5 * (left + right)
        };
        let moved = (next - x).abs();
        x = next;
        if moved <= 1e-15 * (1.0 + x.abs()) {
            break;
        }
    }
    x
}
