//! What shines: lamps, the surroundings, emissive meshes.
//!
//! [`Lights`] answers the two questions of next event estimation with multiple
//! importance sampling: "a light seen from here, and with which density" and
//! "which lights does this ray meet, and with which density would they have
//! been sampled". Both take the same branches, so that the densities agree.
//!
//! Lamps do not block rays, as in Cycles.

mod area;
mod environment;
mod point;
mod resolve;
mod select;
mod sun;
mod triangles;
pub(crate) mod warp;

pub use area::{AreaLight, Outline};
pub use environment::Environment;
pub use point::{Beam, Bulb, PointLight};
pub use resolve::{LightError, resolve_light, resolve_world};
pub use sun::SunLight;
pub use triangles::{EmissiveTriangle, EmitterId};

use crate::color::Rgb;
use crate::embree::Ray;
use glam::Vec3;
use select::Chooser;
use std::f32::consts::PI;
use triangles::Triangles;

/// A point of a light, seen from the shading point.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// In metres; infinite for suns and the surroundings.
    pub distance: f32,
    /// Radiance, W·m⁻²·sr⁻¹; for a delta light its irradiance of a facing
    /// plane, W·m⁻².
    pub radiance: Rgb,
    /// Density in solid angle with the probability of choosing the light in
    /// it, sr⁻¹; for a delta light that probability alone.
    pub pdf: f32,
    /// Whether the light has no extent, so that no ray meets it.
    pub delta: bool,
    /// The emissive triangle that was chosen and the barycentric weights of
    /// its second and third vertex. `radiance` is then the one that
    /// [`EmissiveTriangle`] gave: where the emission has a texture, look it up
    /// here instead.
    pub emitter: Option<(EmitterId, [f32; 2])>,
}

/// A lamp.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// What it is.
    pub shape: Shape,
    /// Whether camera rays see it.
    pub visible_to_camera: bool,
}

/// The kinds of lamps.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A point, a sphere or a spot.
    Point(PointLight),
    /// From infinitely far.
    Sun(SunLight),
    /// A rectangle or an ellipse.
    Area(AreaLight),
}

impl Shape {
    /// The luminance of its power, W; that of a sun on a disk of `radius` metres.
    fn power(&self, radius: f32) -> f32 {
        match self {
            Self::Point(light) => light.power(),
            Self::Sun(light) => light.irradiance() * PI * radius * radius,
            Self::Area(light) => light.power(),
        }
    }

    /// A ball that holds it; `None` for what is infinitely far.
    fn bounds(&self) -> Option<(Vec3, f32)> {
        match self {
            Self::Point(light) => Some(light.bounds()),
            Self::Sun(_) => None,
            Self::Area(light) => Some(light.bounds()),
        }
    }

    fn contribution(&self, p: Vec3) -> f32 {
        match self {
            Self::Point(light) => light.contribution(p),
            Self::Sun(light) => light.irradiance(),
            Self::Area(light) => light.contribution(p),
        }
    }

    fn sample(&self, p: Vec3, selection: f32, u: [f32; 2]) -> Option<LightSample> {
        match self {
            Self::Point(light) => light.sample(p, selection, u),
            Self::Sun(light) => Some(light.sample(selection, u)),
            Self::Area(light) => light.sample(p, selection, u),
        }
    }

    #[inline]
    fn crossed(&self, ray: &Ray) -> Option<(Rgb, f32)> {
        match self {
            Self::Point(light) => light.crossed(ray),
            Self::Sun(light) if ray.t_far == f32::INFINITY => light.seen(ray.direction),
            Self::Sun(_) => None,
            Self::Area(light) => light.crossed(ray),
        }
    }
}

/// What surrounds the scene.
#[derive(Clone, Debug)]
pub enum World {
    /// The same radiance from everywhere, W·m⁻²·sr⁻¹: found by the rays that
    /// leave the scene alone, and never sampled.
    Constant(Rgb),
    /// An image, sampled by importance.
    Environment(Box<Environment>),
}

/// Everything in the scene that shines.
#[derive(Clone, Debug)]
pub struct Lights {
    lamps: Vec<Light>,
    world: World,
    triangles: Option<Triangles>,
    chooser: Option<Chooser>,
}

/// What there is to choose from, in the order of the chooser's indices.
#[derive(Clone, Copy)]
enum Candidate<'a> {
    Lamp(&'a Light),
    Environment(&'a Environment),
    Triangles(&'a Triangles),
}

impl Lights {
    /// Lights without power are left out; so are the tables that nothing needs.
    /// The triangles keep the numbers of their places in the list
    /// ([`EmitterId`]).
    #[must_use]
    pub fn new(mut lamps: Vec<Light>, world: World, triangles: Vec<EmissiveTriangle>) -> Self {
        lamps.retain(|light| light.shape.power(1.0) > 0.0);
        let mut lights = Self {
            lamps,
            world,
            triangles: Triangles::new(triangles),
            chooser: None,
        };
        let radius = lights.radius();
        let powers: Vec<f32> = (0..)
            .map_while(|index| lights.candidate(index))
            .map(|candidate| match candidate {
                Candidate::Lamp(light) => light.shape.power(radius),
                Candidate::Environment(image) => image.irradiance() * PI * radius * radius,
                Candidate::Triangles(triangles) => triangles.power(),
            })
            .collect();
        lights.chooser = Chooser::new(&powers);
        lights
    }

    /// Whether there is nothing to sample: no lamps, no emissive triangles and
    /// a constant world.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.chooser.is_none()
    }

    /// The lamps that have power.
    #[must_use]
    pub fn lamps(&self) -> &[Light] {
        &self.lamps
    }

    /// The surroundings.
    #[must_use]
    pub fn surroundings(&self) -> &World {
        &self.world
    }

    /// Whether any triangle shines.
    #[must_use]
    pub fn has_triangles(&self) -> bool {
        self.triangles.is_some()
    }

    /// What it takes, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let world = match &self.world {
            World::Constant(_) => 0,
            World::Environment(image) => size_of::<Environment>() + image.bytes(),
        };
        size_of::<Self>()
            + size_of_val(self.lamps.as_slice())
            + world
            + self.triangles.as_ref().map_or(0, Triangles::bytes)
            + self.chooser.as_ref().map_or(0, Chooser::bytes)
    }

    /// Chooses a light by `u_select` and a point on it by `u`, all in [0, 1),
    /// as seen from `p` (metres). A few lights are chosen by what they are
    /// about to contribute at `p`, many by power. `None` when the chosen one
    /// does not reach `p`; the sample then counts as zero.
    #[must_use]
    pub fn sample(&self, p: Vec3, u_select: f32, u: [f32; 2]) -> Option<LightSample> {
        let (index, selection, rest) = self
            .chooser
            .as_ref()?
            .choose(u_select, |index| self.contribution(index, p))?;
        let sample = match self.candidate(index)? {
            Candidate::Lamp(light) => light.shape.sample(p, selection, u),
            Candidate::Environment(image) => Some(image.sample(selection, u)),
            Candidate::Triangles(triangles) => triangles.sample(p, selection, rest, u),
        }?;
        // From a light itself, from its plane, or beyond the range of f32.
        let usable = sample.pdf > 0.0
            && sample.pdf.is_finite()
            && sample.distance > 0.0
            && sample.direction.is_finite()
            && sample.radiance.is_finite()
            && sample.radiance != Rgb::ZERO;
        usable.then_some(sample)
    }

    /// Calls `visit` with the radiance (W·m⁻²·sr⁻¹) and the density (sr⁻¹, as
    /// [`Lights::sample`] from the ray's origin has it) of every lamp that the
    /// ray meets before its end, and of every sun when the end is infinite.
    /// `camera` says that it is a camera ray, which does not see all lights.
    /// The ray's direction must be a unit vector.
    #[inline]
    pub fn crossed(&self, ray: &Ray, camera: bool, mut visit: impl FnMut(Rgb, f32)) {
        for (index, light) in self.lamps.iter().enumerate() {
            if camera && !light.visible_to_camera {
                continue;
            }
            if let Some((radiance, pdf)) = light.shape.crossed(ray) {
                visit(radiance, pdf * self.selection(index, ray.origin));
            }
        }
    }

    /// The radiance (W·m⁻²·sr⁻¹) of the surroundings in a unit direction and
    /// the density (sr⁻¹) with which [`Lights::sample`] from `p` would have
    /// chosen it: 0 for constant surroundings. Suns are not part of it.
    #[must_use]
    pub fn world(&self, p: Vec3, direction: Vec3) -> (Rgb, f32) {
        match &self.world {
            World::Constant(radiance) => (*radiance, 0.0),
            World::Environment(image) => {
                let (radiance, pdf) = image.seen(direction);
                (radiance, pdf * self.selection(self.lamps.len(), p))
            }
        }
    }

    /// The density (sr⁻¹) with which [`Lights::sample`] from `p` would have
    /// chosen `hit_point` on an emissive triangle of this unit
    /// `geometric_normal` (of either sign).
    #[must_use]
    pub fn triangle_pdf(
        &self,
        p: Vec3,
        emitter: EmitterId,
        hit_point: Vec3,
        geometric_normal: Vec3,
    ) -> f32 {
        let Some(triangles) = &self.triangles else {
            return 0.0;
        };
        let index = self.lamps.len() + usize::from(self.has_environment());
        triangles.pdf(p, emitter, hit_point, geometric_normal) * self.selection(index, p)
    }

    fn has_environment(&self) -> bool {
        matches!(self.world, World::Environment(_))
    }

    fn candidate(&self, index: usize) -> Option<Candidate<'_>> {
        if let Some(light) = self.lamps.get(index) {
            return Some(Candidate::Lamp(light));
        }
        match (index - self.lamps.len(), &self.world) {
            (0, World::Environment(image)) => Some(Candidate::Environment(image)),
            (0, World::Constant(_)) | (1, World::Environment(_)) => {
                self.triangles.as_ref().map(Candidate::Triangles)
            }
            _ => None,
        }
    }

    /// The luminance of about the irradiance that a candidate causes at `p`.
    fn contribution(&self, index: usize, p: Vec3) -> f32 {
        match self.candidate(index) {
            Some(Candidate::Lamp(light)) => light.shape.contribution(p),
            Some(Candidate::Environment(image)) => image.irradiance(),
            Some(Candidate::Triangles(triangles)) => triangles.contribution(p),
            None => 0.0,
        }
    }

    /// The probability with which a candidate is chosen at `p`.
    fn selection(&self, index: usize, p: Vec3) -> f32 {
        self.chooser.as_ref().map_or(0.0, |chooser| {
            chooser.probability(index, |index| self.contribution(index, p))
        })
    }

    /// The radius of a ball round all that is not infinitely far, metres; 1
    /// when there is nothing. It weighs suns against lamps when they are many.
    fn radius(&self) -> f32 {
        let balls = || {
            let lamps = self.lamps.iter().filter_map(|light| light.shape.bounds());
            lamps.chain(self.triangles.as_ref().map(Triangles::bounds))
        };
        let low = balls().fold(Vec3::INFINITY, |low, (c, r)| low.min(c - r));
        let high = balls().fold(Vec3::NEG_INFINITY, |high, (c, r)| high.max(c + r));
        let radius = (high - low).length() / 2.0;
        if radius.is_normal() { radius } else { 1.0 }
    }
}
