//! One camera path: unidirectional path tracing with a light sample at every
//! vertex, combined with BSDF samples by the power heuristic. At the first surface
//! that scatters it the path splits (Arvo and Kirk 1990, "Particle transport and
//! image synthesis") into several light samples and branches.

mod direct;
mod emission;
mod lanes;
mod mean;
mod media;
mod result;
mod state;
mod tracer;
mod training;

pub use result::{FirstHit, PathResult};
pub use tracer::PathTracer;
pub(super) use training::TrainingPath;

use std::ops::Range;

use crate::bsdf::{Bsdf, ScatterSample};
use crate::camera::Cone;
use crate::color::Rgb;
use crate::embree::Ray;
use crate::features::{Features, has};
use crate::integrator::roulette::Survival;
use crate::integrator::split::{Split, Spread};
use crate::rays::RayKind;
use crate::sampler::{Dimension, Purpose, Sampler};
use crate::scene::{Surface, View};

use lanes::WORTH_LANES;
use mean::Mean;
use result::Found;
use state::{Path, Vertex};
use tracer::MAX_STRAIGHT;

impl<const F: u32> PathTracer<'_, F> {
    /// The light that arrives along `ray` at the camera: what the ray meets on the way
    /// to the first surface that scatters, the mean of that surface's light samples,
    /// and the mean of the branches behind it.
    pub fn trace(
        &self,
        ray: Ray,
        sampler: &mut Sampler,
        split: Split,
        survival: Survival,
    ) -> PathResult {
        let mut found = Found::default();
        let mut trunk = Path::from_camera(ray, self.cone(&ray), survival);
        let Some(surface) = self.next_surface(&mut trunk, &mut found) else {
            return PathResult::of(found);
        };
        let mut bsdf = Bsdf::<F>::new(surface.geometric_normal);
        self.scene.add_closures(&mut bsdf, &surface, trunk.view());
        let most = split.light_samples.len().max(split.branches.len());
        let lanes = (most >= WORTH_LANES).then(|| bsdf.in_lanes()).flatten();
        let lanes_for = |samples: &Range<u32>| {
            let worth = samples.len() >= WORTH_LANES;
            lanes.as_ref().filter(|_| worth)
        };

        trunk.branches_per_light_sample =
            split.branches.len() as f32 / split.light_samples.len() as f32;
        let mut result = PathResult {
            first: self
                .describe_first
                .then(|| FirstHit::of(self.scene, &trunk, &surface)),
            ..PathResult::of(found)
        };
        if has::<F>(Features::LIGHT_SAMPLING) {
            let (light, spread) = match lanes_for(&split.light_samples) {
                Some(lanes) => {
                    let samples = split.light_samples;
                    self.light_samples_in_lanes(samples, &trunk, &surface, &bsdf, lanes, sampler)
                }
                None => self.light_samples(split.light_samples, &trunk, &surface, &bsdf, sampler),
            };
            result.add(light);
            result.light_samples = spread;
        }
        let (light, spread) = match lanes_for(&split.branches) {
            Some(lanes) => self.branches_in_lanes(split.branches, &trunk, &surface, lanes, sampler),
            None => self.branches(split.branches, &trunk, &surface, &bsdf, sampler),
        };
        result.add(light);
        result.branches = spread;
        result
    }

    fn cone(&self, ray: &Ray) -> Cone {
        match &self.scene.camera {
            Some(camera) if has::<F>(Features::FOOTPRINTS) => camera.cone(ray.direction),
            _ => Cone::default(),
        }
    }

    /// The mean of the branches with these indices, from the surface that `trunk` has
    /// come to.
    fn branches(
        &self,
        indices: Range<u32>,
        trunk: &Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        sampler: &mut Sampler,
    ) -> (Found, Spread) {
        let mut mean = Mean::new(indices.len(), self.pilot);
        for index in indices {
            sampler.set_index(index);
            let mut branch = trunk.clone();
            if self.scatter(&mut branch, surface, bsdf, sampler) {
                mean.add(self.follow(&mut branch, sampler));
            }
        }
        mean.finish()
    }

    /// Follows a scattered path to its end.
    fn follow(&self, path: &mut Path, sampler: &mut Sampler) -> Found {
        let mut found = Found::default();
        while let Some(surface) = &self.next_surface(path, &mut found) {
            sampler.begin_vertex(path.vertex);
            let mut bsdf = Bsdf::<F>::new(surface.geometric_normal);
            self.scene.add_closures(&mut bsdf, surface, path.view());
            self.light_sample(path, surface, &bsdf, sampler, &mut found);
            if !self.scatter(path, surface, &bsdf, sampler) {
                break;
            }
        }
        found
    }

    /// Follows the path to the next surface that may scatter it, and takes up
    /// the light on the way; `None` when the path ends.
    fn next_surface(&self, path: &mut Path, found: &mut Found) -> Option<Surface> {
        loop {
            found.rays += 1;
            let hit = self.intersect(path.ray, path.kind);
            let mut emitted = self.lamps(path, hit.map(|hit| hit.t));
            let Some(hit) = hit else {
                emitted += self.world(path, found);
                path.deposit(emitted, &mut found.radiance);
                return None;
            };
            let mut surface = self.scene.surface::<F>(&path.ray, &hit);
            if has::<F>(Features::FOOTPRINTS) {
                surface.footprint = path.cone.at(hit.t);
            }
            path.to_surface = hit.t;
            if has::<F>(Features::ABSORPTION) && !path.media.is_empty() {
                path.deposit(emitted, &mut found.radiance);
                emitted = Rgb::ZERO;
                path.throughput *= path.media.transmittance(hit.t);
                if path.throughput == Rgb::ZERO {
                    return None;
                }
            }
            if has::<F>(Features::RAY_VISIBILITY)
                && path.kind == RayKind::Camera
                && self.scene.objects[surface.object].holdout
            {
                path.deposit(emitted, &mut found.radiance);
                path.see_through(found);
                return None;
            }
            if has::<F>(Features::EMISSIVE_MESHES) {
                emitted += self.surface_emission(path, &surface);
            }
            path.deposit(emitted, &mut found.radiance);
            if path.bounce <= self.settings.max_bounces {
                return Some(surface);
            }
            // No more scattering, but what goes straight through still arrives.
            if !has::<F>(Features::TRANSPARENCY) || path.vertex >= MAX_STRAIGHT {
                return None;
            }
            path.throughput *= self.transparency(&surface, path.view());
            if path.throughput == Rgb::ZERO {
                return None;
            }
            self.cross(path, &surface);
            path.pass_through(&surface);
        }
    }

    /// The share of light that a surface lets straight through, per channel.
    fn transparency(&self, surface: &Surface, view: View) -> Rgb {
        let mut bsdf = Bsdf::<F>::new(surface.geometric_normal);
        self.scene.add_closures(&mut bsdf, surface, view);
        bsdf.transparency()
    }

    /// Keeps what the path is inside of when it goes through a surface.
    #[inline(always)]
    fn cross(&self, path: &mut Path, surface: &Surface) {
        if has::<F>(Features::ABSORPTION) {
            path.media.cross(self.scene, surface);
        }
    }

    /// Samples the direction in which the path goes on from a surface; false when
    /// it ends.
    fn scatter(
        &self,
        path: &mut Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        sampler: &mut Sampler,
    ) -> bool {
        let wo = -path.ray.direction;
        let choice = if has::<F>(Features::MIXES) {
            sampler.get_1d(Dimension::closure_choice(path.vertex))
        } else {
            0.0
        };
        let mut stream = sampler.walk_stream(path.vertex, Purpose::Sample);
        let Some(sample) = bsdf.sample(wo, choice, &mut stream) else {
            return false;
        };
        self.go_on(path, surface, sampler, sample)
    }

    /// Goes on in the direction of a BSDF sample; false when Russian roulette ends the
    /// path.
    #[inline(always)]
    fn go_on(
        &self,
        path: &mut Path,
        surface: &Surface,
        sampler: &mut Sampler,
        sample: ScatterSample,
    ) -> bool {
        path.throughput *= sample.weight;
        // What it comes to next has one light sample for it.
        let branches_per_light_sample = std::mem::replace(&mut path.branches_per_light_sample, 1.0);
        if has::<F>(Features::TRANSPARENCY) && sample.straight {
            // Goes on as if nothing had been there.
            self.cross(path, surface);
            path.pass_through(surface);
            return path.vertex <= MAX_STRAIGHT;
        }
        if sample.wi.dot(surface.geometric_normal) < 0.0 {
            self.cross(path, surface);
        }
        path.vertex += 1;
        path.bounce += 1;
        path.ray = surface.spawn(sample.wi);
        path.cone.width = surface.footprint;
        path.multiple |= sample.order > 1;
        path.kind = sample.kind;
        path.last = Vertex {
            receiver: self.scene.receiver(surface),
            pdf: (has::<F>(Features::LIGHT_SAMPLING) && !sample.delta).then_some(sample.pdf),
            branches_per_light_sample,
            travelled: 0.0,
        };
        let throughput = path.throughput.max_element();
        let survival = path.survival.chance(path.bounce, path.kind, throughput);
        if survival >= 1.0 {
            return true;
        }
        if sampler.get_1d(Dimension::roulette(path.vertex)) >= survival {
            return false;
        }
        path.throughput /= survival;
        true
    }
}
