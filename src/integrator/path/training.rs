//! Paths that are told step by step, for what is planned by them.

use super::result::Found;
use super::state::Path;
use super::tracer::PathTracer;
use crate::bsdf::Bsdf;
use crate::color::Rgb;
use crate::embree::Ray;
use crate::integrator::roulette::{Step, Survival};
use crate::sampler::Sampler;

/// A plain path.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct TrainingPath {
    /// From its first scattering on.
    pub steps: Vec<Step>,
    /// The luminance of all that it found, W·m⁻²·sr⁻¹.
    pub luminance: f32,
    /// Rays traced.
    pub rays: u32,
}

impl<const F: u32> PathTracer<'_, F> {
    /// A plain path, told step by step.
    pub(in super::super) fn train(
        &self,
        ray: Ray,
        sampler: &mut Sampler,
        survival: Survival,
    ) -> TrainingPath {
        let luminance = |color: Rgb| color.dot(Rgb::new(0.2126, 0.7152, 0.0722));
        let mut path = Path::from_camera(ray, self.cone(&ray), survival);
        let mut found = Found::default();
        let mut steps = Vec::new();
        while let Some(surface) = self.next_surface(&mut path, &mut found) {
            let mut bsdf = Bsdf::<F>::new(surface.geometric_normal);
            self.scene.add_closures(&mut bsdf, &surface, path.view());
            self.light_sample(&path, &surface, &bsdf, sampler, &mut found);
            let bounce = path.bounce;
            if !self.scatter(&mut path, &surface, &bsdf, sampler) {
                break;
            }
            if path.bounce > bounce {
                steps.push(Step {
                    kind: path.kind,
                    throughput: path.throughput.max_element(),
                    before: luminance(found.radiance.total()),
                    rays_before: found.rays,
                });
            }
        }
        TrainingPath {
            steps,
            luminance: luminance(found.radiance.total()),
            rays: found.rays,
        }
    }
}
