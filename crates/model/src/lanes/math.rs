//! Directions and Fresnel's reflectance for one direction
//! in each lane: the formulas of [`crate::fresnel`], with masks for branches.

use wide::{CmpGe, CmpGt, f32x8};

use crate::{ConductorFresnel, Rgb, Vector3};

/// A direction in each lane.
#[derive(Clone, Copy)]
pub struct Directions {
    /// Along the tangent.
    pub x: f32x8,
    /// Along the bitangent.
    pub y: f32x8,
    /// Along the macroscopic normal.
    pub z: f32x8,
}

impl Directions {
    /// The same direction in all lanes.
    #[inline(always)]
    pub fn splat(v: Vector3<f32>) -> Self {
        Self {
            x: v.x.into(),
            y: v.y.into(),
            z: v.z.into(),
        }
    }

    /// A direction for each lane.
    #[inline(always)]
    pub fn of(v: &[Vector3<f32>; 8]) -> Self {
        Self {
            x: v.map(|v| v.x).into(),
            y: v.map(|v| v.y).into(),
            z: v.map(|v| v.z).into(),
        }
    }

    /// Scalar products.
    #[inline(always)]
    pub fn dot(self, o: Self) -> f32x8 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// Each times the number of its lane.
    #[inline(always)]
    pub fn scaled(self, s: f32x8) -> Self {
        Self {
            x: self.x * s,
            y: self.y * s,
            z: self.z * s,
        }
    }

    /// Sums.
    #[inline(always)]
    pub fn plus(self, o: Self) -> Self {
        Self {
            x: self.x + o.x,
            y: self.y + o.y,
            z: self.z + o.z,
        }
    }

    /// The opposite directions.
    #[inline(always)]
    pub fn reversed(self) -> Self {
        self.scaled(f32x8::from(-1.0))
    }

    /// The mirror image about the unit normals `m`, and its cosine.
    #[inline(always)]
    pub fn mirrored(self, m: Self) -> (Self, f32x8) {
        let cos = self.dot(m).fast_max(f32x8::ZERO);
        let d = m.scaled(cos + cos).plus(self.reversed());
        // As Vector3::polished.
        let length = f32x8::from(1.5) - f32x8::from(0.5) * d.dot(d);
        (d.scaled(length), cos)
    }
}

/// The reflectance at these cosines of incidence, per channel.
#[inline]
pub(super) fn reflectance(fresnel: &ConductorFresnel<f32>, cos: f32x8) -> [f32x8; 3] {
    let cos = cos.fast_min(f32x8::ONE);
    let each = |f: &dyn Fn(usize) -> f32x8| [f(0), f(1), f(2)];
    match fresnel {
        ConductorFresnel::Constant(Rgb(color)) => color.map(f32x8::from),
        ConductorFresnel::Complex { eta, k } => each(&|c| complex(cos, eta.0[c], k.0[c])),
        ConductorFresnel::Schlick { f0 } => f0.0.map(|f0| schlick(cos, f0)),
        ConductorFresnel::F82 { f0, f82: edge } => each(&|c| f82(cos, f0.0[c], edge.0[c])),
        ConductorFresnel::Dielectric { eta, f0, f90 } => {
            let normal = crate::fresnel::normal_reflectance(*eta);
            let rise = ((complex(cos, *eta, 0.0) - f32x8::from(normal))
                * f32x8::from((1.0 - normal).recip()))
            .fast_max(f32x8::ZERO);
            each(&|c| f32x8::from(f0.0[c]) + rise * f32x8::from(f90.0[c] - f0.0[c]))
        }
        ConductorFresnel::Film { .. } => {
            let lanes = cos.to_array().map(|cos| fresnel.reflectance(cos).0);
            each(&|c| f32x8::from(lanes.map(|color| color[c])))
        }
    }
}

#[inline(always)]
fn schlick(cos: f32x8, f0: f32) -> f32x8 {
    let c = (f32x8::ONE - cos).fast_max(f32x8::ZERO);
    let squared = c * c;
    f32x8::from(f0) + f32x8::from(1.0 - f0) * (squared * squared * c)
}

#[inline(always)]
fn f82(cos: f32x8, f0: f32, edge: f32) -> f32x8 {
    let at = 1.0 / 7.0f32;
    let dip = (crate::fresnel::schlick(at, f0) - edge) / (at * (1.0 - at).powi(6));
    let c = (f32x8::ONE - cos).fast_max(f32x8::ZERO);
    let squared = c * c;
    (schlick(cos, f0) - f32x8::from(dip) * cos * (squared * squared * squared))
        .fast_max(f32x8::ZERO)
        .fast_min(f32x8::ONE)
}

#[inline(always)]
fn complex(cos: f32x8, eta: f32, k: f32) -> f32x8 {
    let (one, zero, half) = (f32x8::ONE, f32x8::ZERO, f32x8::HALF);
    let sin2 = ((one - cos) * (one + cos)).fast_max(zero);
    let t = f32x8::from((eta - k) * (eta + k)) - sin2;
    let ab = f32x8::from(eta * k);
    let modulus = (t * t + f32x8::from(4.0) * ab * ab).sqrt();
    // The larger of a and b by a sum, the other from their product.
    let large = (half * (modulus + t.abs())).sqrt();
    let small = large.cmp_gt(zero).blend(ab / large, zero);
    let real = t.cmp_ge(zero);
    let (a, b) = (real.blend(large, small), real.blend(small, large));
    let ratio = |less: f32x8, more: f32x8| more.cmp_gt(zero).blend(less / more, one);
    let bc = b * cos;
    let (minus, plus) = (cos - a, cos + a);
    let rs = ratio(minus * minus + b * b, plus * plus + b * b);
    let (minus, plus) = (a * cos - sin2, a * cos + sin2);
    let rp = rs * ratio(minus * minus + bc * bc, plus * plus + bc * bc);
    (half * (rs + rp)).fast_min(one)
}
