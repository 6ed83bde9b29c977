//! Light that BSDF samples find: lamps crossed, surfaces that shine, the world.

use super::result::Found;
use super::state::Path;
use super::tracer::PathTracer;
use crate::color::Rgb;
use crate::embree::Ray;
use crate::features::{Features, has};
use crate::light::EmitterId;
use crate::scene::Surface;

impl<const F: u32> PathTracer<'_, F> {
    /// What the lights without geometry add along the path's ray, up to a surface at
    /// distance `to_surface`.
    pub(super) fn lamps(&self, path: &Path, to_surface: Option<f32>) -> Rgb {
        if !has::<F>(Features::AREA_LIGHTS) {
            return Rgb::ZERO;
        }
        let Path { ray, last, .. } = path;
        let mut sum = Rgb::ZERO;
        // Densities are those at the last vertex, so that is where the segment starts.
        let segment = Ray {
            origin: last.receiver.position,
            t_near: last.travelled + ray.t_near,
            t_far: last.travelled + to_surface.unwrap_or(ray.t_far),
            ..*ray
        };
        self.scene.lights.crossed(
            &segment,
            last.receiver.normal,
            path.kind,
            |radiance, light_pdf, distance| {
                let found = radiance * last.mis_weight(light_pdf);
                sum += if has::<F>(Features::ABSORPTION) && !path.media.is_empty() {
                    found * path.media.transmittance(distance - last.travelled)
                } else {
                    found
                };
            },
        );
        sum
    }

    /// What a ray that leaves the scene brings.
    pub(super) fn world(&self, path: &Path, found: &mut Found) -> Rgb {
        let lights = &self.scene.lights;
        if has::<F>(Features::RAY_VISIBILITY) && !lights.world_seen_by().contains(path.kind) {
            path.see_through(found);
            return Rgb::ZERO;
        }
        let (mut radiance, light_pdf) = lights.world(path.last.receiver, path.ray.direction);
        if has::<F>(Features::ABSORPTION) && !path.media.is_empty() {
            radiance *= path.media.transmittance(f32::INFINITY);
        }
        if has::<F>(Features::LIGHT_SAMPLING) {
            radiance * path.last.mis_weight_of_surroundings(light_pdf)
        } else {
            radiance
        }
    }

    /// What a surface shines by itself.
    pub(super) fn surface_emission(&self, path: &Path, surface: &Surface) -> Rgb {
        let Some(first) = self.scene.objects[surface.object].first_emitter else {
            return Rgb::ZERO;
        };
        let radiance = self.scene.emission(surface, path.view());
        if radiance == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let last = &path.last;
        let light_pdf = match last.pdf {
            Some(_) => self.scene.lights.triangle_pdf(
                last.receiver,
                EmitterId(first + surface.triangle),
                surface.position,
                surface.geometric_normal,
            ),
            None => 0.0,
        };
        radiance * last.mis_weight(light_pdf)
    }
}
