//! Light samples and branches of rough metals, several at once in the lanes of a vector.

use std::ops::Range;

use arrayvec::ArrayVec;

use super::direct::Arriving;
use super::mean::Mean;
use super::result::Found;
use super::state::Path;
use super::tracer::PathTracer;
use crate::bsdf::{Bsdf, ByOrder, InLanes};
use crate::features::{Features, has};
use crate::integrator::split::Spread;
use crate::rays::RayKind;
use crate::sampler::{Purpose, Sampler};
use crate::scene::Surface;
use smithwalk_model::LANES;

/// How often a light sample is evaluated in lanes, where that takes little longer
/// than once.
const EVALUATIONS: usize = 2;

/// The least number of branches or light samples that are worth lanes.
pub(super) const WORTH_LANES: usize = 3;

/// A light sample that waits for the others of its batch.
#[derive(Clone, Copy)]
struct Waiting {
    index: u32,
    arriving: Arriving,
}

/// As many light samples as are evaluated at once.
type Batch = ArrayVec<Waiting, { LANES / EVALUATIONS }>;

impl<const F: u32> PathTracer<'_, F> {
    /// As [`Self::light_samples`], a batch at a time.
    pub(super) fn light_samples_in_lanes(
        &self,
        indices: Range<u32>,
        path: &Path,
        surface: &Surface,
        bsdf: &Bsdf<F>,
        lanes: &InLanes<'_, F>,
        sampler: &mut Sampler,
    ) -> (Found, Spread) {
        let mut mean = Mean::new(indices.len(), self.pilot);
        let mut batch = Batch::new();
        for index in indices {
            sampler.set_index(index);
            let mut rays = 0;
            let arriving = self.arriving(path, surface, bsdf, sampler, &mut rays);
            mean.add_rays(rays);
            // Lanes are for metals.
            let seen = |a: &Arriving| {
                !has::<F>(Features::RAY_VISIBILITY) || a.seen_by.contains(RayKind::Glossy)
            };
            if let Some(arriving) = arriving.filter(seen) {
                batch.push(Waiting { index, arriving });
            }
            if batch.is_full() {
                evaluate(&batch, path, lanes, sampler, &mut mean);
                batch.clear();
            }
        }
        if !batch.is_empty() {
            evaluate(&batch, path, lanes, sampler, &mut mean);
        }
        mean.finish()
    }
    /// As [`Self::branches`], with the directions that they take sampled in lanes.
    pub(super) fn branches_in_lanes(
        &self,
        indices: Range<u32>,
        trunk: &Path,
        surface: &Surface,
        lanes: &InLanes<'_, F>,
        sampler: &mut Sampler,
    ) -> (Found, Spread) {
        let mut mean = Mean::new(indices.len(), self.pilot);
        let wo = -trunk.ray.direction;
        for first in indices.clone().step_by(LANES) {
            let index = |lane| first + lane as u32;
            let mut stream = sampler.lane_stream(trunk.vertex, Purpose::Sample, index);
            let samples = lanes.sample(wo, &mut stream);
            for (index, sample) in (first..indices.end).zip(samples) {
                sampler.set_index(index);
                let mut branch = trunk.clone();
                let goes_on =
                    sample.is_some_and(|sample| self.go_on(&mut branch, surface, sampler, sample));
                if goes_on {
                    mean.add(self.follow(&mut branch, sampler));
                }
            }
        }
        mean.finish()
    }
}

/// Adds the samples of a batch to `mean`, each the mean of its evaluations.
fn evaluate<const F: u32>(
    batch: &Batch,
    path: &Path,
    lanes: &InLanes<'_, F>,
    sampler: &mut Sampler,
    mean: &mut Mean,
) {
    // Lanes that are left over look at the last one again, for nothing.
    let waiting = |lane: usize| batch[(lane / EVALUATIONS).min(batch.len() - 1)];
    let mut stream = sampler.lane_stream(path.vertex, Purpose::Light, |lane| {
        waiting(lane).index * EVALUATIONS as u32 + (lane % EVALUATIONS) as u32
    });
    let wi = std::array::from_fn(|lane| waiting(lane).arriving.wi);
    let values = lanes.eval(-path.ray.direction, wi, &mut stream);
    for (sample, values) in batch.iter().zip(values.chunks_exact(EVALUATIONS)) {
        let mut value = ByOrder::ZERO;
        for &evaluated in values {
            value += evaluated;
        }
        let light = path.throughput * sample.arriving.light;
        mean.add(Found {
            radiance: value * (light * (1.0 / EVALUATIONS as f32)),
            ..Found::default()
        });
    }
}
