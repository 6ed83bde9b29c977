//! Factors of mixes.

use super::value::{Number, Point, left_out};
use crate::features::{Features, has};
use smithwalk_model::fresnel;

/// The share of a mix's second material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Factor {
    /// A number or a texture.
    Share(Number),
    /// The reflectance of a smooth interface towards the viewer; the index is the
    /// inside's over the outside's.
    Fresnel(Number),
    /// 1 − cosθ^b, the Facing output of Blender's Layer Weight node.
    Facing(Number),
    /// 1 seen from inside.
    Backfacing,
    /// 1 for camera rays.
    CameraRay,
}

impl Factor {
    /// Its value at a point, 0 to 1.
    #[inline]
    pub(super) fn at<const F: u32>(self, point: &Point<'_>) -> f32 {
        if let Self::Share(share) = self {
            return share.share::<F>(point);
        }
        if !has::<F>(Features::VIEW_DEPENDENT) {
            left_out();
        }
        let one_if = |condition| if condition { 1.0 } else { 0.0 };
        match self {
            Self::Share(share) => share.share::<F>(point),
            Self::Fresnel(ior) => {
                let ior = ior.at::<F>(point).max(1e-5);
                let eta = if point.front { ior } else { 1.0 / ior };
                fresnel::dielectric(point.cos.min(1.0), eta).0
            }
            Self::Facing(blend) => {
                let blend = blend.at::<F>(point).clamp(0.0, 1.0 - 1e-5);
                let exponent = if blend < 0.5 {
                    2.0 * blend
                } else {
                    0.5 / (1.0 - blend)
                };
                1.0 - point.cos.min(1.0).powf(exponent)
            }
            Self::Backfacing => one_if(!point.front),
            Self::CameraRay => one_if(point.camera),
        }
    }

    /// What stands for it when a light is chosen among others.
    pub(super) fn typical(self) -> f32 {
        match self {
            Self::Share(Number::Constant(share)) => share,
            Self::CameraRay => 0.0,
            _ => 0.5,
        }
    }

    /// What a kernel needs for it.
    #[must_use]
    pub fn features(self) -> Features {
        match self {
            Self::Share(_) => Features::NONE,
            _ => Features::VIEW_DEPENDENT,
        }
    }
}
