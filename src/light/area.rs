//! Flat lights: rectangles and ellipses.

use super::rectangle::SphericalRectangle;
use super::tree::{Cone, Extent};
use super::warp::unit_disk;
use super::{LightSample, Rgb};
use crate::color::luminance;
use crate::embree::Ray;
use glam::{Mat3, Vec3};
use std::f32::consts::PI;
use std::f64::consts::FRAC_PI_2;

/// The outline of an [`AreaLight`], in its local xy plane, centred.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outline {
    /// Of the given width and height.
    Rectangle,
    /// With the given width and height as diameters.
    Ellipse,
}

/// Below this ratio of a rectangle's area to its squared distance, points are
/// chosen uniformly in area: the density in solid angle then varies by too
/// little to pay for the spherical rectangle.
const NEAR: f32 = 0.1;

/// The least full angle of a spread, in radians; parallel light would have an
/// infinite radiance.
const LEAST_SPREAD: f64 = 1e-4;

/// A flat light that shines to one side.
#[derive(Clone, Copy, Debug)]
pub struct AreaLight {
    center: Vec3,
    x: Vec3,
    y: Vec3,
    /// The unit normal on the side that shines.
    normal: Vec3,
    half: [f32; 2],
    outline: Outline,
    area: f32,
    radiance: Rgb,
    spread: Option<Spread>,
}

/// How a light is narrowed by a grid before it.
#[derive(Clone, Copy, Debug)]
struct Spread {
    /// tan h, h = (π − s)/2: the slope of the grid's walls.
    tan_grid: f32,
    /// cot h: the largest tangent that anything leaves with.
    tan_limit: f32,
    /// What keeps the power: 2 / (2 + (2h − π) tan h).
    normalization: f32,
}

impl Spread {
    /// Of the full angle `spread` in radians; `None` for the half-space.
    fn new(spread: f32) -> Option<Self> {
        let spread = f64::from(spread).max(LEAST_SPREAD);
        if spread >= 2.0 * FRAC_PI_2 * (1.0 - 1e-6) {
            return None;
        }
        let tan_grid = 1.0 / (spread / 2.0).tan();
        Some(Self {
            tan_grid: tan_grid as f32,
            tan_limit: (spread / 2.0).tan() as f32,
            normalization: (2.0 / (2.0 - spread * tan_grid)) as f32,
        })
    }

    /// The factor on the radiance at a cosine to the normal.
    fn profile(&self, cos: f32) -> f32 {
        let tan = (1.0 - cos * cos).max(0.0).sqrt() / cos;
        (1.0 - self.tan_grid * tan).max(0.0) * self.normalization
    }
}

/// A part of the light's plane, in its local coordinates, in metres.
#[derive(Clone, Copy, Debug)]
struct Window {
    x: [f32; 2],
    y: [f32; 2],
}

impl Window {
    fn area(&self) -> f32 {
        (self.x[1] - self.x[0]) * (self.y[1] - self.y[0])
    }
}

impl AreaLight {
    /// A light at `center` (metres) that spans `width` and `height` metres
    /// along the x and y of `to_world`, shines to the side of its −z with
    /// `radiance` W·m⁻²·sr⁻¹ (before the spread), into the full angle `spread`
    /// in radians. Axes that are not at right angles are made so, area kept.
    /// `None` when it has no area.
    #[must_use]
    pub fn new(
        center: Vec3,
        to_world: Mat3,
        outline: Outline,
        [width, height]: [f32; 2],
        radiance: Rgb,
        spread: f32,
    ) -> Option<Self> {
        let x_side = to_world.x_axis.as_dvec3() * f64::from(width);
        let y_side = to_world.y_axis.as_dvec3() * f64::from(height);
        let x = x_side.try_normalize()?;
        let y_side = y_side - x * x.dot(y_side);
        let y = y_side.try_normalize()?;
        let normal = x.cross(y);
        let shines_back = normal.dot(to_world.z_axis.as_dvec3()) >= 0.0;
        let half = [x_side.length() / 2.0, y_side.length() / 2.0];
        let area = half[0] * half[1] * outline.area_of_unit();
        let area = area as f32;
        (area.is_normal()).then(|| Self {
            center,
            x: x.as_vec3(),
            y: y.as_vec3(),
            normal: if shines_back { -normal } else { normal }.as_vec3(),
            half: half.map(|half| half as f32),
            outline,
            area,
            radiance,
            spread: Spread::new(spread),
        })
    }

    /// The area that shines, in m².
    #[must_use]
    pub fn area(&self) -> f32 {
        self.area
    }

    /// The same light with another radiance, in W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn with_radiance(self, radiance: Rgb) -> Self {
        Self { radiance, ..self }
    }

    /// The radiance in the direction of the normal without a spread, W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn radiance(&self) -> Rgb {
        self.radiance
    }

    /// What a tree of lights knows of it.
    pub(super) fn extent(&self) -> Extent {
        let (reach, peak) = match &self.spread {
            Some(spread) => (spread.tan_limit.atan(), spread.normalization),
            None => (PI / 2.0, 1.0),
        };
        Extent {
            center: self.center,
            radius: self.half[0].hypot(self.half[1]),
            intensity: luminance(self.radiance) * peak * self.area,
            softening: self.area / PI,
            cone: Cone::around(self.normal, reach),
        }
    }

    /// The luminance of about the irradiance at `p`, W·m⁻²; 0 only where the
    /// light can't reach.
    pub(super) fn contribution(&self, p: Vec3) -> f32 {
        let local = self.local(p);
        let Some(window) = self.window(local) else {
            return 0.0;
        };
        let area = window.area().min(self.area);
        let to_center = [
            (window.x[0] + window.x[1]) / 2.0 - local.x,
            (window.y[0] + window.y[1]) / 2.0 - local.y,
        ];
        let across = to_center[0] * to_center[0] + to_center[1] * to_center[1];
        let distance_squared = across + local.z * local.z;
        // A point near the plane still sees the near edge well.
        let cos = (local.z / distance_squared.sqrt()).max(0.1);
        let profile = self.spread.as_ref().map_or(1.0, |spread| {
            spread.profile(cos).max(0.1 * spread.normalization)
        });
        luminance(self.radiance) * profile * area * cos / (distance_squared + area / PI)
    }

    /// Samples a point that is seen from `p`; `selection` is the probability
    /// with which this light was chosen.
    pub(super) fn sample(&self, p: Vec3, selection: f32, u: [f32; 2]) -> Option<LightSample> {
        let local = self.local(p);
        let window = self.window(local)?;
        let spherical = self.spherical(local, &window);
        let [x, y] = match (&spherical, self.as_ellipse(&window)) {
            (Some(rectangle), _) => {
                let [x, y] = rectangle.sample(u);
                [local.x + local.z * x, local.y + local.z * y]
            }
            (None, false) => [
                window.x[0] + u[0] * (window.x[1] - window.x[0]),
                window.y[0] + u[1] * (window.y[1] - window.y[0]),
            ],
            (None, true) => {
                let [x, y] = unit_disk(u);
                [x * self.half[0], y * self.half[1]]
            }
        };
        if self.outline == Outline::Ellipse && !self.covers(x, y) {
            return None;
        }
        let to_light = self.x * (x - local.x) + self.y * (y - local.y) - self.normal * local.z;
        let distance = to_light.length();
        let direction = to_light / distance;
        let cos = local.z / distance;
        Some(LightSample {
            direction,
            distance,
            radiance: self.emitted(cos),
            pdf: selection * self.pdf(spherical.as_ref(), &window, distance, cos),
            delta: false,
            surrounds: false,
            emitter: None,
        })
    }

    /// The radiance along a ray and the density with which
    /// [`AreaLight::sample`] would have found it, sr⁻¹, without the
    /// probability of choosing this light; and how far away it is.
    #[inline]
    pub(super) fn crossed(&self, ray: &Ray) -> Option<(Rgb, f32, f32)> {
        let cos = -ray.direction.dot(self.normal);
        if cos <= 0.0 {
            return None;
        }
        let from_center = ray.origin - self.center;
        let t = from_center.dot(self.normal) / cos;
        if !(t > 0.0 && t > ray.t_near && t < ray.t_far) {
            return None;
        }
        let at = from_center + ray.direction * t;
        if !self.covers(at.dot(self.x), at.dot(self.y)) {
            return None;
        }
        let (radiance, pdf) = self.found(ray.origin, t, cos)?;
        Some((radiance, pdf, t))
    }

    /// The radiance at a cosine to the normal, from a point of the light at the
    /// distance `t` from `p`, and its density.
    fn found(&self, p: Vec3, t: f32, cos: f32) -> Option<(Rgb, f32)> {
        let radiance = self.emitted(cos);
        let local = self.local(p);
        let window = self.window(local)?;
        let spherical = self.spherical(local, &window);
        (radiance != Rgb::ZERO).then(|| (radiance, self.pdf(spherical.as_ref(), &window, t, cos)))
    }

    /// In the light's axes, in metres; z > 0 where it shines.
    fn local(&self, p: Vec3) -> Vec3 {
        let from_center = p - self.center;
        Vec3::new(
            from_center.dot(self.x),
            from_center.dot(self.y),
            from_center.dot(self.normal),
        )
    }

    #[inline]
    fn covers(&self, x: f32, y: f32) -> bool {
        let (x, y) = (x / self.half[0], y / self.half[1]);
        match self.outline {
            Outline::Rectangle => x.abs() <= 1.0 && y.abs() <= 1.0,
            Outline::Ellipse => x * x + y * y <= 1.0,
        }
    }

    /// The radiance at a cosine to the normal, W·m⁻²·sr⁻¹.
    fn emitted(&self, cos: f32) -> Rgb {
        match &self.spread {
            Some(spread) => self.radiance * spread.profile(cos),
            None => self.radiance,
        }
    }

    /// A rectangle that holds all that a point at `local` can see.
    fn window(&self, local: Vec3) -> Option<Window> {
        if local.z <= 0.0 {
            return None;
        }
        let reach = match &self.spread {
            Some(spread) => local.z * spread.tan_limit,
            None => f32::INFINITY,
        };
        let clip = |at: f32, half: f32| [(at - reach).max(-half), (at + reach).min(half)];
        let window = Window {
            x: clip(local.x, self.half[0]),
            y: clip(local.y, self.half[1]),
        };
        (window.x[0] < window.x[1] && window.y[0] < window.y[1]).then_some(window)
    }

    /// The window as a spherical rectangle, where it is sampled as that.
    fn spherical(&self, local: Vec3, window: &Window) -> Option<SphericalRectangle> {
        if self.outline == Outline::Ellipse {
            return None;
        }
        let x = (window.x[0] + window.x[1]) / 2.0 - local.x;
        let y = (window.y[0] + window.y[1]) / 2.0 - local.y;
        let distance_squared = x * x + y * y + local.z * local.z;
        if window.area() < NEAR * distance_squared {
            return None;
        }
        let seen = |sides: [f32; 2], at: f32| sides.map(|side| (side - at) / local.z);
        SphericalRectangle::new(seen(window.x, local.x), seen(window.y, local.y))
    }

    /// sr⁻¹.
    fn pdf(
        &self,
        spherical: Option<&SphericalRectangle>,
        window: &Window,
        distance: f32,
        cos: f32,
    ) -> f32 {
        match (spherical, self.as_ellipse(window)) {
            (Some(rectangle), _) => 1.0 / rectangle.solid_angle(),
            (None, false) => distance / cos * (distance / window.area()),
            (None, true) => distance / cos * (distance / self.area),
        }
    }

    /// Whether points are chosen on the whole ellipse; a smaller window is
    /// sampled itself, and what misses the ellipse is dropped.
    fn as_ellipse(&self, window: &Window) -> bool {
        self.outline == Outline::Ellipse && self.area <= window.area()
    }
}

impl Outline {
    /// The area of the outline with half-axes of 1.
    fn area_of_unit(self) -> f64 {
        match self {
            Self::Rectangle => 4.0,
            Self::Ellipse => std::f64::consts::PI,
        }
    }
}
