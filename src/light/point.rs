//! Points, spheres and spots.

use super::tree::{Cone, Extent};
use super::warp;
use super::{LightSample, Rgb};
use crate::color::luminance;
use crate::embree::Ray;
use glam::{Mat3, Vec3};
use std::f32::consts::PI;

/// What a [`PointLight`] looks like from near by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bulb {
    /// A point without extent.
    Point,
    /// A disk of this radius, in metres, that faces whoever looks at it: the
    /// intensity is that of the point at any distance, the irradiance
    /// I / (d² + r²).
    Disk(f32),
    /// A sphere of this radius, in metres, that shines inwards too.
    Sphere(f32),
}

/// How the intensity of a spot falls off from its axis.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    to_local: Mat3,
    cos_half: f32,
    blend: f32,
    cosine: bool,
}

impl Beam {
    /// A cone of `half_angle` radians around the local −z that `to_world`
    /// gives, the outer share `blend` (0 to 1) of which, in cosines, is a
    /// smooth step. Scale along x and y makes the cone elliptic. `cosine`
    /// multiplies by the cosine to the axis on top, as Cycles did before 4.0.
    /// `None` for a `to_world` that flattens space.
    #[must_use]
    pub fn new(to_world: Mat3, half_angle: f32, blend: f32, cosine: bool) -> Option<Self> {
        let to_local = to_world.as_dmat3().inverse().as_mat3();
        let cos_half = half_angle.clamp(0.0, PI / 2.0).cos();
        to_local.is_finite().then_some(Self {
            to_local,
            cos_half,
            blend: (1.0 - cos_half) * blend.clamp(0.0, 1.0),
            cosine,
        })
    }

    /// A cone that holds all directions it shines into.
    fn bounds(&self) -> Cone {
        /// Beams with unequal scales are measured in as many directions.
        const RIM: u32 = 16;
        /// What the largest angle may exceed those by.
        const MARGIN: f32 = 1.05;
        let to_world = self.to_local.as_dmat3().inverse().as_mat3();
        let Some(axis) = (-to_world.z_axis).try_normalize() else {
            return Cone::ALL;
        };
        let sin_half = (1.0 - self.cos_half * self.cos_half).max(0.0).sqrt();
        let widest = (0..RIM)
            .map(|i| {
                let (sin, cos) = (2.0 * PI * i as f32 / RIM as f32).sin_cos();
                let rim = to_world * Vec3::new(sin_half * cos, sin_half * sin, -self.cos_half);
                rim.angle_between(axis)
            })
            .fold(0.0, f32::max);
        if widest.is_finite() {
            Cone::around(axis, (widest * MARGIN).min(PI))
        } else {
            Cone::ALL
        }
    }

    /// The factor on the intensity in a unit direction away from the light.
    #[must_use]
    pub fn profile(&self, direction: Vec3) -> f32 {
        self.profile_at(self.cosine_to_axis(direction))
    }

    fn cosine_to_axis(&self, direction: Vec3) -> f32 {
        -(self.to_local * direction).normalize_or_zero().z
    }

    fn profile_at(&self, cos: f32) -> f32 {
        let above = cos - self.cos_half;
        if above <= 0.0 {
            return 0.0;
        }
        let smooth = if above < self.blend {
            let t = above / self.blend;
            t * t * (3.0 - 2.0 * t)
        } else {
            1.0
        };
        if self.cosine { smooth * cos } else { smooth }
    }
}

/// A light that shines all round, or into the cone of a spot.
#[derive(Clone, Copy, Debug)]
pub struct PointLight {
    position: Vec3,
    intensity: Rgb,
    bulb: Bulb,
    beam: Option<Beam>,
}

impl PointLight {
    /// `position` in metres, `intensity` in W·sr⁻¹ (on the axis, for a spot).
    #[must_use]
    pub fn new(position: Vec3, intensity: Rgb, bulb: Bulb, beam: Option<Beam>) -> Self {
        let bulb = match bulb {
            Bulb::Disk(radius) | Bulb::Sphere(radius) if radius <= 0.0 => Bulb::Point,
            bulb => bulb,
        };
        Self {
            position,
            intensity,
            bulb,
            beam,
        }
    }

    /// The radiance of its surface, W·m⁻²·sr⁻¹; infinite for a point.
    #[must_use]
    pub fn radiance(&self) -> Rgb {
        self.intensity / (PI * self.radius() * self.radius())
    }

    /// What a tree of lights knows of it.
    pub(super) fn extent(&self) -> Extent {
        let radius = self.radius();
        Extent {
            center: self.position,
            radius,
            intensity: luminance(self.intensity),
            softening: radius * radius,
            cone: self.beam.as_ref().map_or(Cone::ALL, Beam::bounds),
        }
    }

    /// The luminance of about the irradiance at `p`, W·m⁻²; 0 only where the
    /// light can't reach.
    pub(super) fn contribution(&self, p: Vec3) -> f32 {
        let to_p = p - self.position;
        let radius = self.radius();
        let distance_squared = to_p.length_squared();
        let profile = match &self.beam {
            None => 1.0,
            Some(_) if distance_squared <= radius * radius => 1.0,
            Some(beam) => {
                // The most that any point of the bulb sends to p.
                let cos = beam.cosine_to_axis(to_p / distance_squared.sqrt());
                if radius == 0.0 {
                    beam.profile_at(cos)
                } else {
                    // As seen from p the bulb's points lie within this angle
                    // of its centre. A scaled beam bends angles, so the rest
                    // keeps a small chance.
                    let slack = radius.atan2(distance_squared.sqrt());
                    let nearest = (cos.clamp(-1.0, 1.0).acos() - slack).max(0.0);
                    beam.profile_at(nearest.cos()).max(0.01)
                }
            }
        };
        luminance(self.intensity) * profile / (distance_squared + radius * radius)
    }

    /// Samples a point that is seen from `p`; `selection` is the probability
    /// with which this light was chosen.
    pub(super) fn sample(&self, p: Vec3, selection: f32, u: [f32; 2]) -> Option<LightSample> {
        if self.bulb == Bulb::Point {
            let to_light = self.position - p;
            let distance = to_light.length();
            let direction = to_light / distance;
            return Some(LightSample {
                direction,
                distance,
                // Two divisions: d² would leave the range of f32 before this does.
                radiance: self.intensity * self.beamed(direction) / distance / distance,
                pdf: selection,
                delta: true,
                surrounds: false,
                emitter: None,
            });
        }
        let view = self.view(p)?;
        let (direction, cos) = view.cone.sample(u);
        Some(LightSample {
            direction,
            distance: view.distance(cos),
            radiance: self.radiance() * self.beamed(direction),
            pdf: selection * view.cone.pdf(),
            delta: false,
            surrounds: false,
            emitter: None,
        })
    }

    /// The radiance along a ray and the density with which
    /// [`PointLight::sample`] would have found it, sr⁻¹, without the
    /// probability of choosing this light; and how far away it is.
    pub(super) fn crossed(&self, ray: &Ray) -> Option<(Rgb, f32, f32)> {
        let view = self.view(ray.origin)?;
        if !view.cone.contains(ray.direction) {
            return None;
        }
        let t = view.distance(ray.direction.dot(view.axis));
        (t > ray.t_near && t < ray.t_far).then(|| {
            (
                self.radiance() * self.beamed(ray.direction),
                view.cone.pdf(),
                t,
            )
        })
    }

    fn radius(&self) -> f32 {
        match self.bulb {
            Bulb::Point => 0.0,
            Bulb::Disk(radius) | Bulb::Sphere(radius) => radius,
        }
    }

    /// The factor of the beam on what arrives from `direction`.
    fn beamed(&self, direction: Vec3) -> f32 {
        self.beam
            .as_ref()
            .map_or(1.0, |beam| beam.profile(-direction))
    }

    /// How the bulb looks from `p`; `None` for a point, and from the very centre of a disk.
    fn view(&self, p: Vec3) -> Option<View> {
        let to_light = self.position - p;
        let d = to_light.length();
        let axis = to_light.try_normalize();
        match self.bulb {
            Bulb::Point => None,
            Bulb::Disk(r) => {
                // cosθ = d/h at the rim, h² = d² + r²; 1 − cosθ without cancellation.
                let h = d.hypot(r);
                let axis = axis?;
                Some(View {
                    axis,
                    cone: warp::Cone::new(axis, (r / h) * (r / (h + d))),
                    surface: Surface::Disk { d },
                })
            }
            Bulb::Sphere(r) => {
                let axis = axis.unwrap_or(Vec3::Z);
                let one_minus_cos = if d > r {
                    let sin = r / d;
                    sin * sin / (1.0 + (1.0 - sin * sin).max(0.0).sqrt())
                } else {
                    2.0
                };
                Some(View {
                    axis,
                    cone: warp::Cone::new(axis, one_minus_cos),
                    surface: Surface::Sphere { d, r },
                })
            }
        }
    }
}

/// A bulb as it is seen from somewhere.
struct View {
    axis: Vec3,
    cone: warp::Cone,
    surface: Surface,
}

enum Surface {
    Disk { d: f32 },
    Sphere { d: f32, r: f32 },
}

impl View {
    /// How far the bulb is in a direction of this cosine to the axis.
    fn distance(&self, cos: f32) -> f32 {
        match self.surface {
            Surface::Disk { d } => d / cos,
            Surface::Sphere { d, r } => {
                let sin_squared = (1.0 - cos * cos).max(0.0);
                let half_chord = (r * r - d * d * sin_squared).max(0.0).sqrt();
                if d > r {
                    d * cos - half_chord
                } else {
                    d * cos + half_chord
                }
            }
        }
    }
}
