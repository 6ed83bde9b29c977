//! Passes over a film, in parallel over its tiles, and over the pilots before it.

use arrayvec::ArrayVec;
use rayon::prelude::*;

use super::path::{PathTracer, TrainingPath};
use super::roulette::{Grid, Roulette};
use super::split::{CELL, Cells, Draws, Pilot, Plan};
use crate::camera::Camera;
use crate::embree::Ray;
use crate::features::{Features, has};
use crate::film::{FilmTile, Sample};
use crate::sampler::{Dimension, Sampler};
use crate::scene::{RenderSettings, Scene};

/// What a pass is over, and how far it goes.
pub(super) struct Job<'a> {
    pub scene: &'a Scene,
    pub settings: &'a RenderSettings,
    pub camera: &'a Camera,
    pub plan: &'a Plan,
    pub roulette: &'a Roulette,
    /// Each tile gets the samples with an index below this that it has not had.
    pub end: u32,
    /// Looked at by all threads between a tile's samples: whether to leave off here.
    pub leave_off: &'a (dyn Fn(u64) -> bool + Sync),
}

impl Job<'_> {
    /// The camera ray through `pixel` for these numbers on filter and lens, and what
    /// turns the distance along it into the depth along the view axis.
    fn camera_ray<const F: u32>(
        &self,
        pixel: [u32; 2],
        film: [f32; 2],
        lens: [f32; 2],
    ) -> (Ray, f32) {
        let [dx, dy] = self.settings.filter.offset(film);
        let raster = [pixel[0] as f32 + 0.5 + dx, pixel[1] as f32 + 0.5 + dy];
        let lens = if has::<F>(Features::DEPTH_OF_FIELD) {
            lens
        } else {
            [0.5; 2]
        };
        let ray = self.camera.ray(raster, lens);
        (ray, ray.direction.dot(self.camera.forward()))
    }
}

/// Adds the job's samples to every tile; returns the rays traced. All pixels of a tile
/// have equally many samples at any time, tiles only when the job was not left off.
pub(super) fn samples<const F: u32>(
    tracer: &PathTracer<'_, F>,
    job: &Job<'_>,
    tiles: &mut [FilmTile],
) -> u64 {
    tiles
        .par_iter_mut()
        // A few tiles can cost most of a pass: none waits behind another.
        .with_max_len(1)
        .map(|tile| {
            let mut rays = 0;
            while tile.next() < job.end && !(job.leave_off)(tile.window().area() as u64) {
                let index = tile.next();
                for pixel in tile.window().pixels() {
                    rays += sample(tracer, job, pixel, index, tile);
                }
                tile.advance();
            }
            rays
        })
        .sum()
}

/// Adds sample number `index` of a pixel; returns the rays traced.
fn sample<const F: u32>(
    tracer: &PathTracer<'_, F>,
    job: &Job<'_>,
    pixel: [u32; 2],
    index: u32,
    tile: &mut FilmTile,
) -> u64 {
    let draws = job.plan.at(pixel);
    let survival = job.roulette.at(pixel);
    let mut paths = ArrayVec::<Sample, { Draws::MOST as usize }>::new();
    let mut rays = 0;
    for path in index * draws.camera_rays..(index + 1) * draws.camera_rays {
        let mut sampler = Sampler::new(job.settings.seed, pixel, path);
        let film = sampler.get_2d(Dimension::camera_pixel());
        let lens = sampler.get_2d(Dimension::lens());
        let (ray, depth_scale) = job.camera_ray::<F>(pixel, film, lens);
        let result = tracer.trace(ray, &mut sampler, draws.split(path), survival);
        rays += u64::from(result.rays);
        paths.push(result.to_sample(job.settings.gain, depth_scale));
    }
    tile.add(pixel, &paths);
    rays
}

/// Traces the pilot paths of these cells, row by row. Those that come after the job
/// was left off are empty.
pub(super) fn pilots<const F: u32>(
    tracer: &PathTracer<'_, F>,
    job: &Job<'_>,
    cells: &Cells,
) -> Vec<Pilot> {
    (0..cells.count())
        .into_par_iter()
        .with_min_len(16)
        .map(|index| match (job.leave_off)(0) {
            true => Pilot::default(),
            false => pilot(tracer, job, cells.cell(index)),
        })
        .collect()
}

/// Traces two paths through a pixel of a cell, see [`Pilot`].
fn pilot<const F: u32>(tracer: &PathTracer<'_, F>, job: &Job<'_>, cell: [u32; 2]) -> Pilot {
    let mut sampler = Sampler::pilot(job.settings.seed, cell);
    let within = sampler.get_2d(Dimension::pilot_pixel());
    let pixel = [0, 1].map(|axis| {
        let pixel = cell[axis] * CELL + (within[axis] * CELL as f32) as u32;
        pixel.min(job.settings.resolution[axis] - 1)
    });
    let film = sampler.get_2d(Dimension::camera_pixel());
    let lens = sampler.get_2d(Dimension::lens());
    let survival = job.roulette.at(pixel);
    let mut pilot = Pilot::default();
    for path in 0..2 {
        let opposite = |u: [f32; 2]| u.map(|u| (u + 0.5 * path as f32).fract());
        let (ray, _) = job.camera_ray::<F>(pixel, opposite(film), opposite(lens));
        let result = tracer.trace(ray, &mut sampler, Draws::PILOT.split(0), survival);
        pilot.paths[path] = [result.light_samples, result.branches];
        pilot.radiance[path] = result.radiance.total().to_array();
        pilot.rays += result.rays;
    }
    pilot
}

/// Traces a plain path through each cell of a grid, row by row.
pub(super) fn training<const F: u32>(
    tracer: &PathTracer<'_, F>,
    job: &Job<'_>,
    grid: &Grid,
) -> Vec<TrainingPath> {
    let cells: Vec<_> = grid.cells().collect();
    cells
        .into_par_iter()
        .with_min_len(16)
        .map(|cell| {
            if (job.leave_off)(0) {
                return TrainingPath::default();
            }
            let mut sampler = Sampler::training(job.settings.seed, cell);
            let pixel = grid.pixel(cell, sampler.get_2d(Dimension::pilot_pixel()));
            let film = sampler.get_2d(Dimension::camera_pixel());
            let lens = sampler.get_2d(Dimension::lens());
            let (ray, _) = job.camera_ray::<F>(pixel, film, lens);
            tracer.train(ray, &mut sampler, job.roulette.at(pixel))
        })
        .collect()
}
