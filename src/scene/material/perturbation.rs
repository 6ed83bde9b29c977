//! Normals out of textures.

use glam::{Vec3, Vec3A, Vec4};

use super::super::Surface;
use super::value::{Number, Point};
use crate::description::NormalSpace;

/// What takes the place of an interpolated normal.
#[derive(Clone, Debug, PartialEq)]
pub struct Perturbation {
    /// A texture of normals.
    pub normal: NormalMap,
}

/// A texture of normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// The index of the texture.
    pub texture: usize,
    /// How much of it counts, 0 or more.
    pub strength: Number,
    /// What its axes are.
    pub space: NormalSpace,
}

impl Perturbation {
    /// The surface with the normal that it has here.
    #[inline]
    pub(super) fn surface<const F: u32>(&self, point: &Point<'_>, surface: &Surface) -> Surface {
        surface.with_normal(self.normal.at::<F>(point, surface))
    }
}

impl NormalMap {
    /// The normal at a point, on the viewer's side, as Cycles' Normal Map node has it
    /// (`svm_node_normal_map` in `kernel/svm/tex_coord.h`, 3.4): what the map says,
    /// then mixed with the interpolated normal by the strength.
    fn at<const F: u32>(&self, point: &Point<'_>, surface: &Surface) -> Vec3 {
        let Some((object, _)) = point.ground.on else {
            return surface.normal;
        };
        let [r, g, b, _] = point.ground.textures[self.texture].sample(point.uv.into());
        let stored = Vec3::new(r, g, b) * 2.0 - 1.0;
        let outward = match self.space {
            NormalSpace::World => Some(stored),
            NormalSpace::Object => Some(object.normal_to_world * stored),
            NormalSpace::Tangent => tangent_axes(point, surface).map(|[t, b, n]| {
                let local = (t * stored.x + b * stored.y + n * stored.z).normalize_or_zero();
                Vec3::from(object.normal_to_world * local)
            }),
        };
        let Some(outward) = outward.and_then(Vec3::try_normalize) else {
            return surface.normal;
        };
        let full = if surface.front { outward } else { -outward };
        let strength = self.strength.at::<F>(point).max(0.0);
        let mixed = surface.normal + (full - surface.normal) * strength;
        mixed.try_normalize().unwrap_or(surface.normal)
    }
}

/// The axes of a normal map in the object's space, not of unit length: tangent,
/// bitangent and the interpolated normal, outward; `None` where texture coordinates
/// have no direction.
fn tangent_axes(point: &Point<'_>, surface: &Surface) -> Option<[Vec3A; 3]> {
    let (object, mesh) = point.ground.on?;
    let tangents = mesh.tangents.as_ref()?;
    let corners = mesh.triangles[surface.triangle as usize].map(|i| i as usize);
    let [u, v] = surface.weights.into();
    let weights = [1.0 - u - v, u, v];
    let tangent: Vec4 = (0..3)
        .map(|i| Vec4::from(tangents[corners[i]]) * weights[i])
        .sum();
    if tangent.truncate() == Vec3::ZERO {
        return None;
    }
    let normal = match &mesh.normals {
        Some(normals) => (0..3)
            .map(|i| {
                let normal = Vec3A::from(normals[corners[i]]);
                let local = match object.to_world {
                    Some(_) => normal,
                    None => (object.normal_to_object * normal).normalize_or_zero(),
                };
                local * weights[i]
            })
            .sum(),
        None => {
            let side = if surface.front { 1.0 } else { -1.0 };
            let outward = Vec3A::from(surface.geometric_normal * side);
            (object.normal_to_object * outward).normalize_or_zero()
        }
    };
    let sign = tangent.w;
    let tangent = Vec3A::from(tangent.truncate());
    Some([tangent, normal.cross(tangent) * sign, normal])
}
