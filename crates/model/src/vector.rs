//! Vectors and colours in the precision of the model.

use super::Real;
use std::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub};

/// A direction in the local frame: z along the macroscopic normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector3<F> {
    /// Along the tangent.
    pub x: F,
    /// Along the bitangent.
    pub y: F,
    /// Along the macroscopic normal.
    pub z: F,
}

impl<F: Real> Vector3<F> {
    /// The vector (x, y, z).
    #[inline(always)]
    pub fn new(x: F, y: F, z: F) -> Self {
        Self { x, y, z }
    }

    /// The unit vector at cosine `cos` from z and azimuth `phi` (radians).
    #[inline]
    pub fn spherical(cos: F, phi: F) -> Self {
        let sin = ((F::one() - cos) * (F::one() + cos)).max(F::zero()).sqrt();
        let (sin_phi, cos_phi) = phi.sin_cos();
        Self::new(sin * cos_phi, sin * sin_phi, cos)
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Euclidean length.
    #[inline(always)]
    pub fn length(self) -> F {
        self.dot(self).sqrt()
    }

    /// This vector scaled to length one; not finite for the null vector.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        self * self.length().recip()
    }

    /// Takes out the length error that a product of unit vectors picked up:
    /// one Newton step of 1/√, exact to second order around length one.
    #[inline(always)]
    pub(crate) fn polished(self) -> Self {
        self * (F::of(1.5) - F::of(0.5) * self.dot(self))
    }

    /// Whether no component is infinite or not a number.
    #[inline(always)]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
    }
}

impl<F: Real> Add for Vector3<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<F: Real> Sub for Vector3<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<F: Real> Neg for Vector3<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<F: Real> Mul<F> for Vector3<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: F) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

/// Three channels of a reflectance or of a BSDF value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgb<F>(pub [F; 3]);

impl<F: Real> Rgb<F> {
    /// The same value in all channels.
    #[inline(always)]
    pub fn splat(value: F) -> Self {
        Self([value; 3])
    }

    /// 0 in all channels.
    #[inline(always)]
    pub fn black() -> Self {
        Self::splat(F::zero())
    }

    /// 1 in all channels.
    #[inline(always)]
    pub fn white() -> Self {
        Self::splat(F::one())
    }

    /// The largest channel.
    #[inline(always)]
    pub fn max_channel(self) -> F {
        self.0[0].max(self.0[1]).max(self.0[2])
    }

    /// Each channel through `f`.
    #[inline(always)]
    pub fn map(self, f: impl FnMut(F) -> F) -> Self {
        Self(self.0.map(f))
    }
}

impl<F: Real> Add for Rgb<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<F: Real> AddAssign for Rgb<F> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<F: Real> Mul for Rgb<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self([self.0[0] * o.0[0], self.0[1] * o.0[1], self.0[2] * o.0[2]])
    }
}

impl<F: Real> Mul<F> for Rgb<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: F) -> Self {
        self.map(|c| c * s)
    }
}

impl<F: Real> MulAssign for Rgb<F> {
    #[inline(always)]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}
