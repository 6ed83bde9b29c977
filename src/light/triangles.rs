//! Emissive meshes.

use super::select::Table;
use super::{LightSample, Rgb};
use crate::color::luminance;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// A triangle that shines, by its place in the list that
/// [`Lights::new`](super::Lights::new) was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmitterId(pub u32);

/// A triangle of a mesh with an emissive material; both sides shine.
#[derive(Clone, Copy, Debug)]
pub struct EmissiveTriangle {
    /// In world space, metres.
    pub vertices: [Vec3; 3],
    /// Its radiance, W·m⁻²·sr⁻¹. Of a textured one an estimate, which only
    /// decides how often it is chosen and should not be zero where the texture
    /// isn't.
    pub radiance: Rgb,
}

/// All emissive triangles, chosen by area times luminance.
#[derive(Clone, Debug)]
pub(super) struct Triangles {
    triangles: Vec<EmissiveTriangle>,
    table: Table,
    /// m²·(W·m⁻²·sr⁻¹), the sum over one side of all.
    weight: f64,
    center: Vec3,
    radius: f32,
    area: f32,
}

impl Triangles {
    /// `None` when nothing shines.
    pub(super) fn new(triangles: Vec<EmissiveTriangle>) -> Option<Self> {
        let weight = |t: &EmissiveTriangle| {
            let weight = area(&t.vertices) * f64::from(luminance(t.radiance));
            if weight.is_finite() {
                weight.max(0.0)
            } else {
                0.0
            }
        };
        let total: f64 = triangles.iter().map(weight).sum();
        let table = Table::new(triangles.iter().map(weight))?;
        let shining = || triangles.iter().filter(|t| weight(t) > 0.0);
        let corners = || shining().flat_map(|t| t.vertices);
        let low = corners().fold(Vec3::INFINITY, Vec3::min);
        let high = corners().fold(Vec3::NEG_INFINITY, Vec3::max);
        let area: f64 = shining().map(|t| self::area(&t.vertices)).sum();
        Some(Self {
            table,
            weight: total,
            center: (low + high) / 2.0,
            radius: (high - low).length() / 2.0,
            area: area as f32,
            triangles,
        })
    }

    pub(super) fn bounds(&self) -> (Vec3, f32) {
        (self.center, self.radius)
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.triangles.as_slice()) + self.table.bytes()
    }

    /// The luminance of the power of both sides, W.
    pub(super) fn power(&self) -> f32 {
        (2.0 * self.weight) as f32 * PI
    }

    /// The luminance of about the irradiance at `p`, W·m⁻².
    pub(super) fn contribution(&self, p: Vec3) -> f32 {
        // As a ball that the triangles line: half of their area faces p.
        let distance_squared = (p - self.center).length_squared();
        let nearest = self.area / PI + self.radius * self.radius / 4.0;
        self.weight as f32 / 2.0 / (distance_squared + nearest)
    }

    /// Samples a point that is seen from `p`; `u_select` chooses the triangle,
    /// `selection` is the probability with which the triangles were chosen.
    pub(super) fn sample(
        &self,
        p: Vec3,
        selection: f32,
        u_select: f32,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let (index, probability, _) = self.table.sample(u_select);
        let EmissiveTriangle {
            vertices: [a, b, c],
            radiance,
        } = self.triangles[index];
        // Uniform in area without a square root (Heitz 2019, "A Low-Distortion
        // Map Between Triangle and Square").
        let [v, w] = if u[1] > u[0] {
            [u[0] / 2.0, u[1] - u[0] / 2.0]
        } else {
            [u[0] - u[1] / 2.0, u[1] / 2.0]
        };
        let to_light = (a - p) + (b - a) * v + (c - a) * w;
        let distance = to_light.length();
        let direction = to_light / distance;
        let normal = normal(&[a, b, c])?;
        let density = probability / area(&[a, b, c]) as f32;
        Some(LightSample {
            direction,
            distance,
            radiance,
            pdf: selection * per_steradian(density, distance, direction.dot(normal)),
            delta: false,
            emitter: Some((EmitterId(index as u32), [v, w])),
        })
    }

    /// The density with which [`Triangles::sample`] from `p` finds `point` of
    /// a triangle, sr⁻¹, without the probability of choosing the triangles.
    pub(super) fn pdf(&self, p: Vec3, emitter: EmitterId, point: Vec3, normal: Vec3) -> f32 {
        let index = emitter.0 as usize;
        let probability = self.table.probability(index);
        if probability == 0.0 {
            return 0.0;
        }
        let density = probability / area(&self.triangles[index].vertices) as f32;
        let to_light = point - p;
        let distance = to_light.length();
        per_steradian(density, distance, (to_light / distance).dot(normal))
    }
}

/// From a density per m² on a surface to sr⁻¹ at a distance from it.
fn per_steradian(density: f32, distance: f32, cos: f32) -> f32 {
    distance * density * (distance / cos.abs())
}

/// In m²; in f64, as the square of a millimetre's square is lost in f32.
fn area(vertices: &[Vec3; 3]) -> f64 {
    cross(vertices).length() / 2.0
}

fn normal(vertices: &[Vec3; 3]) -> Option<Vec3> {
    cross(vertices).try_normalize().map(|n| n.as_vec3())
}

fn cross([a, b, c]: &[Vec3; 3]) -> DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}
