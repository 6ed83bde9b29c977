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
mod rectangle;
mod resolve;
mod select;
mod sun;
mod tree;
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
use crate::rays::{RayKind, RayKinds};
use glam::Vec3;
use select::{Chooser, FEW, Far, Many, Reach};
use tree::{Extent, Tree};
use triangles::Triangles;

/// What light arrives at.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Metres.
    pub position: Vec3,
    /// A unit normal, by whose side light counts; `None` where light from all
    /// around counts alike.
    pub normal: Option<Vec3>,
}

impl From<Vec3> for Receiver {
    /// A point that takes light from all around.
    fn from(position: Vec3) -> Self {
        Self {
            position,
            normal: None,
        }
    }
}

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
    /// Whether it is of the image that surrounds the scene.
    pub surrounds: bool,
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
    /// The kinds of rays that meet it, and of scattering that light samples reach.
    pub seen_by: RayKinds,
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
    /// Whether it shines at all.
    fn shines(&self) -> bool {
        match self.reach() {
            Reach::Near(extent) => extent.intensity > 0.0,
            Reach::Far(light) => light.irradiance > 0.0,
        }
    }

    /// How it counts among many.
    fn reach(&self) -> Reach {
        match self {
            Self::Point(light) => Reach::Near(light.extent()),
            Self::Sun(light) => Reach::Far(light.far()),
            Self::Area(light) => Reach::Near(light.extent()),
        }
    }

    /// Its ball, if rays can meet it somewhere.
    fn ball(&self) -> Option<Extent> {
        match self.reach() {
            Reach::Near(extent) if extent.radius > 0.0 => Some(extent),
            _ => None,
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
    fn crossed(&self, ray: &Ray) -> Option<(Rgb, f32, f32)> {
        match self {
            Self::Point(light) => light.crossed(ray),
            Self::Sun(light) if ray.t_far == f32::INFINITY => {
                let (radiance, pdf) = light.seen(ray.direction)?;
                Some((radiance, pdf, f32::INFINITY))
            }
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

impl World {
    /// The bytes that its image and tables take.
    #[must_use]
    pub fn memory(&self) -> usize {
        match self {
            Self::Constant(_) => 0,
            Self::Environment(image) => size_of::<Environment>() + image.bytes(),
        }
    }
}

/// Everything in the scene that shines.
#[derive(Clone, Debug)]
pub struct Lights {
    lamps: Vec<Light>,
    world: World,
    triangles: Option<Triangles>,
    chooser: Option<Chooser>,
    /// The lamps with size that are not infinitely far, for rays to meet.
    sized: Vec<u32>,
    /// The same as a tree, when they are several.
    sized_tree: Option<Tree>,
    /// The suns that are disks.
    suns: Vec<u32>,
    /// The rays that see the surroundings.
    world_seen_by: RayKinds,
}

/// What there is to choose from, in the order of the chooser's indices.
#[derive(Clone, Copy)]
enum Candidate<'a> {
    Lamp(&'a Light),
    Environment(&'a Environment),
    /// All triangles, as one light among few.
    Together(&'a Triangles),
    /// One of them, among many.
    Triangle(&'a Triangles, usize),
}

impl Lights {
    /// Lights without power are left out; so are the tables that nothing needs.
    /// The triangles keep the numbers of their places in the list
    /// ([`EmitterId`]).
    #[must_use]
    pub fn new(mut lamps: Vec<Light>, world: World, triangles: Vec<EmissiveTriangle>) -> Self {
        lamps.retain(|light| light.shape.shines());
        let has_environment = matches!(world, World::Environment(_));
        let many = lamps.len() + usize::from(has_environment) + triangles.len() > FEW;
        let which = |wanted: fn(&Shape) -> bool| {
            let numbered = (0..).zip(&lamps);
            let wanted = numbered.filter(|(_, light)| wanted(&light.shape));
            wanted.map(|(index, _)| index).collect::<Vec<u32>>()
        };
        let sized = which(|shape| shape.ball().is_some());
        let suns = which(|shape| matches!(shape, Shape::Sun(sun) if sun.is_disk()));
        let balls: Vec<Extent> = sized
            .iter()
            .filter_map(|&index| lamps[index as usize].shape.ball())
            .collect();
        let mut lights = Self {
            lamps,
            world,
            triangles: Triangles::new(triangles, !many),
            chooser: None,
            sized_tree: (balls.len() > 1).then(|| Tree::new(&balls)).flatten(),
            sized,
            suns,
            world_seen_by: RayKinds::ALL,
        };
        let candidates = || (0..).map_while(|index| lights.candidate(index));
        lights.chooser = if many {
            let reaches = candidates().map(|candidate| match candidate {
                Candidate::Lamp(light) => light.shape.reach(),
                Candidate::Environment(image) => Reach::Far(Far {
                    irradiance: image.irradiance(),
                    towards: None,
                }),
                Candidate::Together(triangles) => Reach::Near(triangles.extent(0)),
                Candidate::Triangle(triangles, index) => Reach::Near(triangles.extent(index)),
            });
            Many::new(reaches).map(|many| Chooser::ByTree(Box::new(many)))
        } else {
            match candidates().count() {
                0 => None,
                1 => Some(Chooser::Only),
                n => Some(Chooser::ByContribution(n)),
            }
        };
        lights
    }

    /// The same with surroundings that are black for all other rays.
    #[must_use]
    pub fn with_world_seen_by(self, kinds: RayKinds) -> Self {
        Self {
            world_seen_by: kinds,
            ..self
        }
    }

    /// Whether some lamp is hidden from rays beside those from the camera.
    #[must_use]
    pub fn hides_from_scattered(&self) -> bool {
        self.lamps
            .iter()
            .any(|light| light.seen_by.hides_from_scattered())
    }

    /// The rays that see the surroundings.
    #[must_use]
    #[inline(always)]
    pub fn world_seen_by(&self) -> RayKinds {
        self.world_seen_by
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

    /// Whether they are so many that bounds are weighed, with the receiver's
    /// normal.
    #[must_use]
    pub fn are_many(&self) -> bool {
        matches!(self.chooser, Some(Chooser::ByTree(_)))
    }

    /// Whether rays can meet any of them: lamps with size, suns with a disk.
    #[must_use]
    pub fn can_be_crossed(&self) -> bool {
        !(self.sized.is_empty() && self.suns.is_empty())
    }

    /// The surroundings.
    #[must_use]
    pub fn surroundings(&self) -> &World {
        &self.world
    }

    /// The surroundings alone.
    #[must_use]
    pub fn into_surroundings(self) -> World {
        self.world
    }

    /// Whether any triangle shines.
    #[must_use]
    pub fn has_triangles(&self) -> bool {
        self.triangles.is_some()
    }

    /// What it takes, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + size_of_val(self.lamps.as_slice())
            + self.world.memory()
            + self.triangles.as_ref().map_or(0, Triangles::bytes)
            + self.chooser.as_ref().map_or(0, Chooser::bytes)
            + size_of_val(self.sized.as_slice())
            + self.sized_tree.as_ref().map_or(0, Tree::bytes)
            + size_of_val(self.suns.as_slice())
    }

    /// Chooses a light by `u_select` and a point on it by `u`, all in [0, 1),
    /// as seen from the receiver. A few lights are chosen by what they are
    /// about to contribute there, many by bounds of that. `None` when the chosen one
    /// does not reach it; the sample then counts as zero.
    #[must_use]
    pub fn sample(
        &self,
        receiver: impl Into<Receiver>,
        u_select: f32,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let (sample, _) = self.sample_with_kinds(&receiver.into(), u_select, u)?;
        Some(sample)
    }

    /// As [`Lights::sample`], with the kinds of scattering that see the lamp or the
    /// surroundings; who sees a triangle is its object's matter.
    #[must_use]
    pub fn sample_with_kinds(
        &self,
        receiver: &Receiver,
        u_select: f32,
        u: [f32; 2],
    ) -> Option<(LightSample, RayKinds)> {
        let p = receiver.position;
        let (index, selection, rest) =
            self.chooser
                .as_ref()?
                .choose(receiver, u_select, u, |index| self.contribution(index, p))?;
        let candidate = self.candidate(index)?;
        let kinds = match candidate {
            Candidate::Lamp(light) => light.seen_by,
            Candidate::Environment(_) => self.world_seen_by,
            Candidate::Together(_) | Candidate::Triangle(..) => RayKinds::ALL,
        };
        let sample = match candidate {
            Candidate::Lamp(light) => light.shape.sample(p, selection, u),
            Candidate::Environment(image) => Some(image.sample(selection, u)),
            Candidate::Together(triangles) => {
                let (triangle, probability) = triangles.choose(rest)?;
                triangles.sample(p, triangle, selection * probability, u)
            }
            Candidate::Triangle(triangles, triangle) => triangles.sample(p, triangle, selection, u),
        }?;
        // From a light itself, from its plane, or beyond the range of f32.
        let usable = sample.pdf > 0.0
            && sample.pdf.is_finite()
            && sample.distance > 0.0
            && sample.direction.is_finite()
            && sample.radiance.is_finite()
            && sample.radiance != Rgb::ZERO;
        usable.then_some((sample, kinds))
    }

    /// Calls `visit` with the radiance (W·m⁻²·sr⁻¹) and the density (sr⁻¹, as
    /// [`Lights::sample`] from the ray's origin has it for that normal) of every lamp that the
    /// ray meets before its end, and of every sun when the end is infinite.
    /// Rays of this `kind` do not see all lights.
    /// The ray's direction must be a unit vector.
    #[inline]
    pub fn crossed(
        &self,
        ray: &Ray,
        normal: Option<Vec3>,
        kind: RayKind,
        mut visit: impl FnMut(Rgb, f32, f32),
    ) {
        let receiver = Receiver {
            position: ray.origin,
            normal,
        };
        let mut test = |index: u32| {
            let light = &self.lamps[index as usize];
            if !light.seen_by.contains(kind) {
                return;
            }
            if let Some((radiance, pdf, distance)) = light.shape.crossed(ray) {
                let pdf = pdf * self.selection(index as usize, &receiver);
                visit(radiance, pdf, distance);
            }
        };
        match &self.sized_tree {
            Some(tree) => tree.along(ray, |number| test(self.sized[number as usize])),
            None => self.sized.iter().copied().for_each(&mut test),
        }
        if ray.t_far == f32::INFINITY {
            self.suns.iter().copied().for_each(&mut test);
        }
    }

    /// The radiance (W·m⁻²·sr⁻¹) of the surroundings in a unit direction and
    /// the density (sr⁻¹) with which [`Lights::sample`] would have chosen it: 0 for constant surroundings. Suns are not part of it.
    #[must_use]
    pub fn world(&self, receiver: impl Into<Receiver>, direction: Vec3) -> (Rgb, f32) {
        match &self.world {
            World::Constant(radiance) => (*radiance, 0.0),
            World::Environment(image) => {
                let (radiance, pdf) = image.seen(direction);
                (
                    radiance,
                    pdf * self.selection(self.lamps.len(), &receiver.into()),
                )
            }
        }
    }

    /// The density (sr⁻¹) with which [`Lights::sample`] would have chosen
    /// `hit_point` on an emissive triangle of this unit
    /// `geometric_normal` (of either sign).
    #[must_use]
    pub fn triangle_pdf(
        &self,
        receiver: impl Into<Receiver>,
        emitter: EmitterId,
        hit_point: Vec3,
        geometric_normal: Vec3,
    ) -> f32 {
        let Some(triangles) = &self.triangles else {
            return 0.0;
        };
        let receiver = receiver.into();
        let base = self.lamps.len() + usize::from(self.has_environment());
        let triangle = emitter.0 as usize;
        let selection = if triangles.are_together() {
            self.selection(base, &receiver) * triangles.probability(triangle)
        } else {
            self.selection(base + triangle, &receiver)
        };
        triangles.pdf(
            receiver.position,
            triangle,
            selection,
            hit_point,
            geometric_normal,
        )
    }

    fn has_environment(&self) -> bool {
        matches!(self.world, World::Environment(_))
    }

    fn candidate(&self, index: usize) -> Option<Candidate<'_>> {
        if let Some(light) = self.lamps.get(index) {
            return Some(Candidate::Lamp(light));
        }
        let mut index = index - self.lamps.len();
        if let World::Environment(image) = &self.world {
            if index == 0 {
                return Some(Candidate::Environment(image));
            }
            index -= 1;
        }
        let triangles = self.triangles.as_ref()?;
        if triangles.are_together() {
            (index == 0).then_some(Candidate::Together(triangles))
        } else {
            (index < triangles.len()).then_some(Candidate::Triangle(triangles, index))
        }
    }

    /// The luminance of about the irradiance that a candidate causes at `p`.
    fn contribution(&self, index: usize, p: Vec3) -> f32 {
        match self.candidate(index) {
            Some(Candidate::Lamp(light)) => light.shape.contribution(p),
            Some(Candidate::Environment(image)) => image.irradiance(),
            Some(Candidate::Together(triangles)) => triangles.contribution(p),
            // Weighed by the tree.
            Some(Candidate::Triangle(..)) | None => 0.0,
        }
    }

    /// The probability with which a candidate is chosen.
    fn selection(&self, index: usize, receiver: &Receiver) -> f32 {
        self.chooser.as_ref().map_or(0.0, |chooser| {
            chooser.probability(receiver, index, |index| {
                self.contribution(index, receiver.position)
            })
        })
    }
}
