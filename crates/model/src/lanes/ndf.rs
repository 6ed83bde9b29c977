//! What lanes need of a distribution of normals, and GGX.

use wide::{CmpEq, CmpGe, CmpGt, f32x8};

use super::math::Directions;
use crate::{Ggx, Ndf};

/// A distribution that can be evaluated and sampled in lanes.
pub trait NdfInLanes: Ndf<Scalar = f32> {
    /// It, the same in all lanes.
    type Lanes: NdfLanes;

    /// This distribution in all lanes.
    fn in_lanes(&self) -> Self::Lanes;
}

/// The functions of [`Ndf`] for one direction in each lane.
pub trait NdfLanes {
    /// D of the normal along `h`, of any length; 0 below the horizon.
    fn density(&self, h: Directions) -> f32x8;

    /// σ(w) and σ(−w).
    fn projected_areas(&self, w: Directions) -> [f32x8; 2];

    /// Normals visible from `w`.
    fn sample_visible(&self, w: Directions, u: [f32x8; 2]) -> Directions;
}

/// A GGX distribution, the same in all lanes.
pub struct GgxLanes {
    alpha_x: f32x8,
    alpha_y: f32x8,
    /// π α_x α_y
    norm: f32x8,
}

impl NdfInLanes for Ggx<f32> {
    type Lanes = GgxLanes;

    #[inline]
    fn in_lanes(&self) -> GgxLanes {
        GgxLanes {
            alpha_x: self.alpha_x.into(),
            alpha_y: self.alpha_y.into(),
            norm: (std::f32::consts::PI * self.alpha_x * self.alpha_y).into(),
        }
    }
}

impl NdfLanes for GgxLanes {
    #[inline(always)]
    fn density(&self, h: Directions) -> f32x8 {
        let (x, y) = (h.x / self.alpha_x, h.y / self.alpha_y);
        let squared = h.dot(h);
        let ratio = squared / (x * x + y * y + h.z * h.z);
        h.z.cmp_gt(f32x8::ZERO)
            .blend(ratio * ratio / self.norm, f32x8::ZERO)
    }

    #[inline(always)]
    fn projected_areas(&self, w: Directions) -> [f32x8; 2] {
        let (x, y) = (self.alpha_x * w.x, self.alpha_y * w.y);
        let a = x * x + y * y;
        let s = (w.z * w.z + a).sqrt();
        let least = f32x8::HALF * a / (s + w.z.abs());
        [
            least + w.z.fast_max(f32x8::ZERO),
            least + (-w.z).fast_max(f32x8::ZERO),
        ]
    }

    #[inline(always)]
    fn sample_visible(&self, w: Directions, [u, v]: [f32x8; 2]) -> Directions {
        let one = f32x8::ONE;
        let w = Directions {
            x: self.alpha_x * w.x,
            y: self.alpha_y * w.y,
            z: w.z,
        };
        let w = w.scaled(one / w.dot(w).sqrt());
        let below = one - w.z;
        let level = w.x * w.x + w.y * w.y;
        let above = w.z.cmp_ge(f32x8::ZERO).blend(one + w.z, level / below);
        let rise = (one - u) * above;
        let sin = (u * above * (below + rise)).fast_max(f32x8::ZERO).sqrt();
        let (sin_phi, cos_phi) = (f32x8::from(std::f32::consts::TAU) * v).sin_cos();
        let m = Directions {
            x: self.alpha_x * (sin * cos_phi + w.x),
            y: self.alpha_y * (sin * sin_phi + w.y),
            z: rise,
        };
        let length = m.dot(m).sqrt();
        let level = level.sqrt();
        let known = length.cmp_gt(f32x8::ZERO);
        let slanted = level.cmp_gt(f32x8::ZERO);
        // Seen from straight below, a horizontal normal.
        let limit = [
            slanted.blend(w.x / level, one),
            slanted.blend(w.y / level, f32x8::ZERO),
        ];
        Directions {
            x: known.blend(m.x / length, limit[0]),
            y: known.blend(m.y / length, limit[1]),
            z: known.blend(m.z / length, f32x8::ZERO),
        }
    }
}

/// The density of the phase function of mirrors from `w`, with `sigma` = σ(w),
/// towards `o`, sr⁻¹; and |w + o|, twice the cosine at the facet.
#[inline(always)]
pub(super) fn phase(
    ndf: &impl NdfLanes,
    w: Directions,
    sigma: f32x8,
    o: Directions,
) -> (f32x8, f32x8) {
    let h = w.plus(o);
    let length = h.dot(h).sqrt();
    let density = ndf.density(h) / (f32x8::from(4.0) * sigma);
    let none = length.cmp_eq(f32x8::ZERO) | sigma.cmp_eq(f32x8::ZERO);
    (none.blend(f32x8::ZERO, density), length)
}
