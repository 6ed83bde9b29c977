//! Light samples: next-event estimation at a vertex of a path.

use std::ops::Range;

use glam::Vec3;

use super::mean::Mean;
use super::result::Found;
use super::state::Path;
use super::tracer::{MAX_STRAIGHT, PathTracer};
use crate::bsdf::Bsdf;
use crate::color::Rgb;
use crate::embree::{Hit, Ray};
use crate::features::{Features, has};
use crate::integrator::split::Spread;
use crate::light::{EmitterId, LightSample};
use crate::rays::{RayKind, RayKinds};
use crate::sampler::{Dimension, Purpose, Sampler};
use crate::scene::{Surface, View};

/// Where shadow rays to points of the scene's own meshes end, as a share of the
/// distance: short of the emitting triangle itself.
const SHORT_OF_EMITTER: f32 = 1.0 - 1e-4;

/// A light sample that reaches a surface.
#[derive(Clone, Copy)]
pub(super) struct Arriving {
    /// Unit length, towards the light.
    pub wi: Vec3,
    /// L/p times the weight against BSDF samples.
    pub light: Rgb,
    /// The kinds of scattering that it takes part in.
    pub seen_by: RayKinds,
}

impl<const F: u32> PathTracer<'_, F> {
    /// The mean of the light samples with these indices at the surface that `path` has
    /// come to.
    pub(super) fn light_samples(
        &self,
        indices: Range<u32>,
        path: &Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        sampler: &mut Sampler,
    ) -> (Found, Spread) {
        let mut mean = Mean::new(indices.len(), self.pilot);
        for index in indices {
            sampler.set_index(index);
            let mut found = Found::default();
            self.light_sample(path, surface, bsdf, sampler, &mut found);
            mean.add(found);
        }
        mean.finish()
    }

    /// Adds one light sample, f·|cosθ|·L/p with its multiple-importance weight, at the
    /// surface that `path` has come to.
    pub(super) fn light_sample(
        &self,
        path: &Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        sampler: &mut Sampler,
        found: &mut Found,
    ) {
        if !has::<F>(Features::LIGHT_SAMPLING) || !bsdf.has_smooth() {
            return;
        }
        let Some(arriving) = self.arriving(path, surface, bsdf, sampler, &mut found.rays) else {
            return;
        };
        let wo = -path.ray.direction;
        let mut stream = sampler.walk_stream(path.vertex, Purpose::Light);
        let scattered = bsdf.eval_seen_by(arriving.seen_by, wo, arriving.wi, &mut stream);
        let scattered = scattered * arriving.light;
        path.deposit_scattered(scattered, &mut found.radiance);
    }

    /// Draws a light sample, if it reaches the surface and that can scatter it.
    pub(super) fn arriving(
        &self,
        path: &Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        sampler: &mut Sampler,
        rays: &mut u32,
    ) -> Option<Arriving> {
        let choice = sampler.get_1d(Dimension::light_choice(path.vertex));
        let position = sampler.get_2d(Dimension::light_position(path.vertex));
        let lights = &self.scene.lights;
        let receiver = self.scene.receiver(surface);
        let (light, mut seen_by) = lights.sample_with_kinds(&receiver, choice, position)?;
        if has::<F>(Features::RAY_VISIBILITY) && has::<F>(Features::EMISSIVE_MESHES) {
            if let Some((EmitterId(emitter), _)) = light.emitter {
                let object = self.scene.emitters[emitter as usize] as usize;
                seen_by = self.scene.objects[object].seen_by;
            }
        }
        let pdf = bsdf.pdf(-path.ray.direction, light.direction);
        if pdf <= 0.0 {
            return None;
        }
        let radiance = self.visible(path, surface, &light, rays)?;
        let pdf = if has::<F>(Features::ENVIRONMENT) && light.surrounds {
            pdf * path.branches_per_light_sample
        } else {
            pdf
        };
        // The power heuristic's weight over the density; a delta light has no rival.
        let factor = if light.delta {
            1.0 / light.pdf
        } else {
            light.pdf / (light.pdf * light.pdf + pdf * pdf)
        };
        Some(Arriving {
            wi: light.direction,
            light: radiance * factor,
            seen_by,
        })
    }

    /// The radiance of the light sample that reaches the surface; `None` when it
    /// is in shadow.
    fn visible(
        &self,
        path: &Path,
        surface: &Surface,
        light: &LightSample,
        rays: &mut u32,
    ) -> Option<Rgb> {
        let mut ray = surface.spawn(light.direction);
        ray.t_far = light.distance;
        let mut radiance = light.radiance;
        if has::<F>(Features::EMISSIVE_MESHES) {
            if let Some((EmitterId(emitter), barycentric)) = light.emitter {
                ray.t_far *= SHORT_OF_EMITTER;
                // Where all points shine alike the sample's own radiance is exact.
                if has::<F>(Features::TEXTURES) || has::<F>(Features::VIEW_DEPENDENT) {
                    let wo = -light.direction;
                    radiance = self.scene.emission_at(emitter, barycentric, wo);
                }
            }
        }
        *rays += 1;
        if has::<F>(Features::ABSORPTION) {
            return self.visible_through_media(path, surface, ray, radiance, rays);
        }
        if !has::<F>(Features::TRANSPARENCY) {
            return (!self.occluded(ray)).then_some(radiance);
        }
        for _ in 0..MAX_STRAIGHT {
            let Some(hit) = self.intersect(ray, RayKind::Shadow) else {
                return Some(radiance);
            };
            let (_, beyond) = self.through(ray, &hit, &mut radiance)?;
            ray = beyond;
            *rays += 1;
        }
        None
    }

    /// The blocker that a shadow ray has met, and the ray behind it; what is left of
    /// `radiance`. `None` if that is nothing.
    fn through(&self, ray: Ray, hit: &Hit, radiance: &mut Rgb) -> Option<(Surface, Ray)> {
        let blocker = self.scene.surface::<F>(&ray, hit);
        let view = View {
            wo: -ray.direction,
            camera: false,
        };
        *radiance *= self.transparency(&blocker, view);
        if radiance.max_element() <= 0.0 {
            return None;
        }
        let beyond = Ray {
            t_far: ray.t_far - hit.t,
            ..blocker.spawn(ray.direction)
        };
        Some((blocker, beyond))
    }

    /// The same where objects absorb that the ray goes through.
    fn visible_through_media(
        &self,
        path: &Path,
        surface: &Surface,
        mut ray: Ray,
        mut radiance: Rgb,
        rays: &mut u32,
    ) -> Option<Rgb> {
        let mut media = path.media.clone();
        if ray.direction.dot(surface.geometric_normal) < 0.0 {
            media.cross(self.scene, surface);
        }
        for _ in 0..MAX_STRAIGHT {
            let Some(hit) = self.intersect(ray, RayKind::Shadow) else {
                radiance *= media.transmittance(ray.t_far);
                return (radiance.max_element() > 0.0).then_some(radiance);
            };
            radiance *= media.transmittance(hit.t);
            let (blocker, beyond) = self.through(ray, &hit, &mut radiance)?;
            media.cross(self.scene, &blocker);
            ray = beyond;
            *rays += 1;
        }
        None
    }
}
