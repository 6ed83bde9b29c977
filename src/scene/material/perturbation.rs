//! Normals out of textures of normals and of heights.

use glam::{Vec2, Vec3, Vec3A, Vec4};

use super::super::Surface;
use super::value::{Number, Point};
use crate::bsdf::Frame;
use crate::description::NormalSpace;
use crate::texture::Channel;

/// What takes the place of an interpolated normal.
#[derive(Clone, Debug, PartialEq)]
pub struct Perturbation {
    /// A texture of normals.
    pub normal: Option<NormalMap>,
    /// A texture of heights, which leans what that says.
    pub bump: Option<Bump>,
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
    /// Whether normals that a pixel does not resolve make the surface rougher.
    pub filtered: bool,
}

/// How slopes spread that a pixel does not resolve.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlopeSpread {
    /// What slopes of 1 along u and along v are, as vectors in the plane of the normal.
    axes: [Vec3; 2],
    /// Of the slopes along u and v: of the first, of both, of the second.
    covariance: [f32; 3],
}

impl SlopeSpread {
    /// The microsurface of these roughnesses along the frame's axes, under a surface of
    /// such slopes: covariances of slopes add up. With Beckmann's distribution, whose
    /// slopes have the variance α²/2, that is what it is; GGX, whose have none, is
    /// taken to have it.
    pub fn widen(&self, alphas: [f32; 2], frame: Frame) -> ([f32; 2], Frame) {
        let [[ux, uy], [vx, vy]] = self.axes.map(|axis| [axis.dot(frame.x), axis.dot(frame.y)]);
        let [uu, uv, vv] = self.covariance;
        let xx = ux * ux * uu + 2.0 * ux * vx * uv + vx * vx * vv + alphas[0] * alphas[0] / 2.0;
        let yy = uy * uy * uu + 2.0 * uy * vy * uv + vy * vy * vv + alphas[1] * alphas[1] / 2.0;
        let xy = ux * uy * uu + (ux * vy + vx * uy) * uv + vx * vy * vv;
        let (mean, half) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
        let radius = half.hypot(xy);
        let alphas =
            [mean + radius, (mean - radius).max(0.0)].map(|variance| (2.0 * variance).sqrt());
        let (sin, cos) = (0.5 * xy.atan2(half)).sin_cos();
        let turned = Frame {
            x: frame.x * cos + frame.y * sin,
            y: frame.y * cos - frame.x * sin,
            z: frame.z,
        };
        (alphas, turned)
    }
}

/// A texture of heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bump {
    /// The index of the texture.
    pub texture: usize,
    /// Which of its numbers is the height.
    pub channel: Channel,
    /// How much of it counts, 0 or more.
    pub strength: Number,
    /// How high 1 is, metres.
    pub distance: Number,
    /// −1 where what is high is deep, else 1.
    pub sign: f32,
    /// How far apart heights are compared, in pixels.
    pub filter_width: f32,
}

impl Perturbation {
    /// The surface with the normal that it has here, and how slopes spread there.
    pub(super) fn surface<const F: u32>(
        &self,
        point: &Point<'_>,
        surface: &Surface,
    ) -> (Surface, Option<SlopeSpread>) {
        let (mut normal, mut spread) = (surface.normal, None);
        if let Some(map) = &self.normal {
            (normal, spread) = match map.averaged::<F>(point, surface) {
                Some((normal, spread)) => (normal, Some(spread)),
                None => (map.at::<F>(point, surface), None),
            };
        }
        if let Some(bump) = &self.bump {
            normal = bump.lean::<F>(point, surface, normal);
        }
        (surface.with_normal(normal), spread)
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
        let texture = &point.ground.textures[self.texture];
        let map = texture.uv_map();
        let [r, g, b, _] = texture.sample(point.uv_of::<F>(map).into());
        let stored = Vec3::new(r, g, b) * 2.0 - 1.0;
        let outward = match self.space {
            NormalSpace::World => Some(stored),
            NormalSpace::Object => Some(object.normal_to_world * stored),
            NormalSpace::Tangent => tangent_axes(point, surface, map).map(|[t, b, n]| {
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

impl NormalMap {
    /// The mean normal under the pixel's footprint, on the viewer's side, and how slopes
    /// spread there. The strength is a factor on slopes.
    fn averaged<const F: u32>(
        &self,
        point: &Point<'_>,
        surface: &Surface,
    ) -> Option<(Vec3, SlopeSpread)> {
        let (object, _) = point.ground.on.filter(|_| self.filtered)?;
        let texture = &point.ground.textures[self.texture];
        let map = texture.uv_map();
        let (x, y) = surface.geometric_normal.any_orthonormal_pair();
        let [along_x, along_y] = uv_steps(point, surface, map, [x, y])?;
        // Across the ray a pixel is a square, along the surface longer.
        let square = surface.footprint * surface.footprint / point.cos.max(LEAST_COS);
        let area = along_x.perp_dot(along_y).abs() * square;
        let slopes = texture.slopes(point.uv_of::<F>(map).into(), area)?;
        let strength = self.strength.at::<F>(point).max(0.0);
        let [t, b, n] =
            tangent_axes(point, surface, map)?.map(|axis| object.normal_to_world * axis);
        let mean = n + (t * slopes.mean[0] + b * slopes.mean[1]) * strength;
        let mean = Vec3::from(mean);
        let length = mean.length();
        let normal = mean.try_normalize()?;
        let scale = strength / length;
        let in_plane = |axis: Vec3A| {
            let axis = Vec3::from(axis) * scale;
            axis - normal * normal.dot(axis)
        };
        let spread = SlopeSpread {
            axes: [in_plane(t), in_plane(b)],
            covariance: slopes.covariance,
        };
        Some((if surface.front { normal } else { -normal }, spread))
    }
}

/// Seen flatter, a pixel is taken to be no longer.
const LEAST_COS: f32 = 0.05;

/// The axes of a normal map in the object's space, not of unit length: tangent,
/// bitangent and the interpolated normal, outward; `None` where texture coordinates
/// have no direction.
fn tangent_axes(point: &Point<'_>, surface: &Surface, map: usize) -> Option<[Vec3A; 3]> {
    let (object, mesh) = point.ground.on?;
    let tangents = mesh.tangents(map)?;
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

impl Bump {
    /// `normal`, leant by the differences of heights a part of a pixel apart, as Cycles'
    /// Bump node has it (`svm_node_set_bump` in `kernel/svm/displace.h`): what the
    /// heights give, then mixed with `normal` by the strength. What is high is raised
    /// towards the viewer on both sides.
    fn lean<const F: u32>(&self, point: &Point<'_>, surface: &Surface, normal: Vec3) -> Vec3 {
        let texture = &point.ground.textures[self.texture];
        let height = |uv: Vec2| texture.channel(uv.into(), self.channel);
        let step = surface.footprint * self.filter_width;
        let (x, y) = surface.geometric_normal.any_orthonormal_pair();
        let map = texture.uv_map();
        let Some([uv_x, uv_y]) = uv_steps(point, surface, map, [x * step, y * step]) else {
            return normal;
        };
        let (across_x, across_y) = (y.cross(normal), normal.cross(x));
        let uv = point.uv_of::<F>(map);
        let here = height(uv);
        let rise_x = height(uv + uv_x) - here;
        let rise_y = height(uv + uv_y) - here;
        let turn = x.dot(across_x);
        let scale = self.distance.at::<F>(point) * self.sign * turn.signum();
        let slope = (across_x * rise_x + across_y * rise_y) * scale;
        let Some(leant) = (normal * (turn.abs() * step) - slope).try_normalize() else {
            return normal;
        };
        let strength = self.strength.at::<F>(point).max(0.0);
        let mixed = leant * strength + normal * (1.0 - strength);
        mixed.try_normalize().unwrap_or(normal)
    }
}

/// How texture coordinates change along each of these steps in the triangle's plane,
/// metres; `None` where the triangle has no area.
fn uv_steps(
    point: &Point<'_>,
    surface: &Surface,
    map: usize,
    steps: [Vec3; 2],
) -> Option<[Vec2; 2]> {
    let (object, mesh) = point.ground.on?;
    let uvs = mesh.uvs(map)?;
    let corners = mesh.triangles[surface.triangle as usize].map(|i| i as usize);
    let [a, b, c] = corners.map(|i| Vec3A::from(mesh.vertices[i]));
    let edge = |edge: Vec3A| match &object.to_world {
        Some(to_world) => Vec3::from(to_world.transform_vector3a(edge)),
        None => Vec3::from(edge),
    };
    let (ab, ac) = (edge(b - a), edge(c - a));
    let normal = ab.cross(ac);
    let per_area = normal / normal.length_squared();
    if !per_area.is_finite() {
        return None;
    }
    let [a, b, c] = corners.map(|i| Vec2::from(uvs[i]));
    Some(steps.map(|step| {
        let (u, v) = (step.cross(ac).dot(per_area), ab.cross(step).dot(per_area));
        (b - a) * u + (c - a) * v
    }))
}
