//! Emissive meshes.

use super::select::Table;
use super::tree::{Cone, Extent};
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

/// All emissive triangles. A few are chosen together, by area times luminance.
#[derive(Clone, Debug)]
pub(super) struct Triangles {
    triangles: Vec<EmissiveTriangle>,
    /// How one of them is chosen, where they are not among many lights.
    few: Option<Few>,
}

/// Triangles that are one light among few.
#[derive(Clone, Debug)]
struct Few {
    table: Table,
    /// m²·(W·m⁻²·sr⁻¹), the sum over one side of all.
    weight: f64,
    center: Vec3,
    radius: f32,
    area: f32,
}

impl EmissiveTriangle {
    /// The luminance of the intensity at right angles, W·sr⁻¹.
    fn weight(&self) -> f64 {
        let weight = area(&self.vertices) * f64::from(luminance(self.radiance));
        if weight.is_finite() {
            weight.max(0.0)
        } else {
            0.0
        }
    }
}

impl Triangles {
    /// `together` when they are to be one light. `None` when nothing shines.
    pub(super) fn new(triangles: Vec<EmissiveTriangle>, together: bool) -> Option<Self> {
        let shines = triangles.iter().any(|t| t.weight() > 0.0);
        let few = together.then(|| Few::new(&triangles)).flatten();
        shines.then_some(Self { triangles, few })
    }

    /// Whether they are one light.
    pub(super) fn are_together(&self) -> bool {
        self.few.is_some()
    }

    /// How many there are, dark ones counted.
    pub(super) fn len(&self) -> usize {
        self.triangles.len()
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.triangles.as_slice())
            + self.few.as_ref().map_or(0, |few| few.table.bytes())
    }

    /// The luminance of about the irradiance at `p` of all together, W·m⁻².
    pub(super) fn contribution(&self, p: Vec3) -> f32 {
        self.few.as_ref().map_or(0.0, |few| few.contribution(p))
    }

    /// The triangle that `u` falls into when they are one light, and the
    /// probability of that.
    pub(super) fn choose(&self, u: f32) -> Option<(usize, f32)> {
        let (index, probability, _) = self.few.as_ref()?.table.sample(u);
        Some((index, probability))
    }

    /// The probability with which [`Triangles::choose`] takes one.
    pub(super) fn probability(&self, index: usize) -> f32 {
        let few = self.few.as_ref();
        few.map_or(0.0, |few| few.table.probability(index))
    }

    /// One of them as a light among many.
    pub(super) fn extent(&self, index: usize) -> Extent {
        let triangle = &self.triangles[index];
        let center = triangle.vertices.iter().sum::<Vec3>() / 3.0;
        let radii = triangle.vertices.map(|corner| corner.distance(center));
        Extent {
            center,
            radius: radii.into_iter().fold(0.0, f32::max),
            intensity: triangle.weight() as f32,
            softening: area(&triangle.vertices) as f32 / PI,
            cone: Cone::ALL,
        }
    }

    /// Samples a point of one of them that is seen from `p`; `selection` is
    /// the probability with which it was chosen.
    pub(super) fn sample(
        &self,
        p: Vec3,
        index: usize,
        selection: f32,
        u: [f32; 2],
    ) -> Option<LightSample> {
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
        let density = selection / area(&[a, b, c]) as f32;
        Some(LightSample {
            direction,
            distance,
            radiance,
            pdf: per_steradian(density, distance, direction.dot(normal)),
            delta: false,
            surrounds: false,
            emitter: Some((EmitterId(index as u32), [v, w])),
        })
    }

    /// The density with which [`Triangles::sample`] from `p` finds `point` of
    /// a triangle, sr⁻¹, given the probability of choosing it.
    pub(super) fn pdf(
        &self,
        p: Vec3,
        index: usize,
        selection: f32,
        point: Vec3,
        normal: Vec3,
    ) -> f32 {
        if selection == 0.0 {
            return 0.0;
        }
        let density = selection / area(&self.triangles[index].vertices) as f32;
        let to_light = point - p;
        let distance = to_light.length();
        per_steradian(density, distance, (to_light / distance).dot(normal))
    }
}

impl Few {
    fn new(triangles: &[EmissiveTriangle]) -> Option<Self> {
        let table = Table::new(triangles.iter().map(EmissiveTriangle::weight))?;
        let shining = || triangles.iter().filter(|t| t.weight() > 0.0);
        let corners = || shining().flat_map(|t| t.vertices);
        let low = corners().fold(Vec3::INFINITY, Vec3::min);
        let high = corners().fold(Vec3::NEG_INFINITY, Vec3::max);
        let area: f64 = shining().map(|t| self::area(&t.vertices)).sum();
        Some(Self {
            table,
            weight: triangles.iter().map(EmissiveTriangle::weight).sum(),
            center: (low + high) / 2.0,
            radius: (high - low).length() / 2.0,
            area: area as f32,
        })
    }

    /// The luminance of about the irradiance at `p`, W·m⁻².
    fn contribution(&self, p: Vec3) -> f32 {
        // As a ball that the triangles line: half of their area faces p.
        let distance_squared = (p - self.center).length_squared();
        let nearest = self.area / PI + self.radius * self.radius / 4.0;
        self.weight as f32 / 2.0 / (distance_squared + nearest)
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
