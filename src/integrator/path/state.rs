//! A path on its way.

use super::media::Media;
use super::result::Found;
use crate::bsdf::ByOrder;
use crate::camera::Cone;
use crate::color::Rgb;
use crate::embree::Ray;
use crate::integrator::roulette::Survival;
use crate::light::Receiver;
use crate::rays::RayKind;
use crate::scene::{Surface, View};

/// A path on its way.
#[derive(Clone)]
pub(super) struct Path {
    pub ray: Ray,
    pub throughput: Rgb,
    /// Whether some surface has scattered it more than once.
    pub multiple: bool,
    /// Where it was scattered last.
    pub last: Vertex,
    /// Surfaces met, which address random numbers.
    pub vertex: u32,
    /// Those of them that scattered it.
    pub bounce: u32,
    /// Distance from the ray's start to the surface that it meets.
    pub to_surface: f32,
    /// What it is inside of.
    pub media: Media,
    /// What its ray is seen as: by the last scattering.
    pub kind: RayKind,
    /// How likely it is to go on.
    pub survival: Survival,
    /// How wide a pixel is along the ray, where something needs it; reflection and
    /// refraction leave it its spread.
    pub cone: Cone,
    /// Branches for each light sample at the surface that it comes to; 1 but where it
    /// splits.
    pub branches_per_light_sample: f32,
}

/// The last vertex that light samples could have continued from.
#[derive(Clone)]
pub(super) struct Vertex {
    /// Where it is, as light samples there had it.
    pub receiver: Receiver,
    /// Density of the direction taken, sr⁻¹; `None` where no light sample
    /// competes: at the camera and after single directions.
    pub pdf: Option<f32>,
    /// Branches for each light sample there.
    pub branches_per_light_sample: f32,
    /// Distance from there to where the current ray starts: more than
    /// zero after passing straight through surfaces.
    pub travelled: f32,
}

impl Path {
    pub fn from_camera(ray: Ray, cone: Cone, survival: Survival) -> Self {
        Self {
            ray,
            throughput: Rgb::ONE,
            multiple: false,
            last: Vertex {
                receiver: ray.origin.into(),
                pdf: None,
                branches_per_light_sample: 1.0,
                travelled: 0.0,
            },
            vertex: 0,
            bounce: 0,
            to_surface: 0.0,
            media: Media::default(),
            kind: RayKind::Camera,
            survival,
            cone,
            branches_per_light_sample: 1.0,
        }
    }

    /// Straight on behind the surface that the ray has met.
    pub fn pass_through(&mut self, surface: &Surface) {
        self.vertex += 1;
        self.last.travelled += self.to_surface;
        let t_far = self.ray.t_far - self.to_surface;
        self.ray = Ray {
            t_far,
            ..surface.spawn(self.ray.direction)
        };
        self.cone.width = surface.footprint;
    }

    /// Nothing is there: what the camera's ray carries is what the film lets through.
    pub fn see_through(&self, found: &mut Found) {
        if self.kind == RayKind::Camera {
            found.let_through += self.throughput.element_sum() / 3.0;
        }
    }

    /// Who looks at the surface that the ray meets.
    pub fn view(&self) -> View {
        View {
            wo: -self.ray.direction,
            camera: self.bounce == 0,
        }
    }

    /// Adds `light` that arrives along the ray.
    pub fn deposit(&self, light: Rgb, radiance: &mut ByOrder) {
        let light = self.throughput * light;
        if self.multiple {
            radiance.multiple += light;
        } else {
            radiance.single += light;
        }
    }

    /// Adds light that the surface at the end of the ray scatters along it.
    pub fn deposit_scattered(&self, light: ByOrder, radiance: &mut ByOrder) {
        if self.multiple {
            radiance.multiple += self.throughput * light.total();
        } else {
            *radiance += light * self.throughput;
        }
    }
}

impl Vertex {
    /// The power heuristic's weight of a BSDF sample whose direction light sampling
    /// would have found with density `light_pdf` (sr⁻¹).
    pub fn mis_weight(&self, light_pdf: f32) -> f32 {
        match self.pdf {
            Some(pdf) => pdf * pdf / (pdf * pdf + light_pdf * light_pdf),
            None => 1.0,
        }
    }

    /// As [`Self::mis_weight`], of a direction to the image that surrounds the scene.
    /// Samples of an image differ as much as those of a BSDF do, so that the numbers of
    /// both count (Veach 1997, eq. 9.13). Those of lamps differ little from the first one
    /// on, as they are uniform in solid angle or close to it.
    pub fn mis_weight_of_surroundings(&self, light_pdf: f32) -> f32 {
        self.mis_weight(light_pdf / self.branches_per_light_sample)
    }
}
