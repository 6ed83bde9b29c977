//! Passes over the film, in parallel over its tiles, until a limit is reached.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use arrayvec::ArrayVec;
use rayon::prelude::*;

use super::kernel::pass_for;
use super::path::{PathTracer, Split};
use crate::camera::Camera;
use crate::features::{Features, has};
use crate::film::{Draws, Film, FilmTile, Spread};
use crate::sampler::{Dimension, Sampler};
use crate::scene::{RenderSettings, Scene};

/// Why rendering ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// All samples are taken.
    Samples,
    /// The time is up.
    Time,
    /// The image is clean enough.
    Noise,
    /// Somebody asked for it.
    Interrupted,
}

/// How far it is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Samples per pixel so far.
    pub spp: u32,
    /// How many there will be if nothing else stops it.
    pub target: u32,
    /// Time since the start.
    pub elapsed: Duration,
}

/// What was done.
#[derive(Clone, Copy, Debug)]
pub struct RenderReport {
    /// Samples per pixel in the film.
    pub spp: u32,
    /// Samples per pixel that this call added.
    pub added: u32,
    /// Wall-clock time of this call.
    pub wall: Duration,
    /// Rays traced by this call.
    pub rays: u64,
    /// Why it ended.
    pub stop: Stop,
    /// Estimated relative error at the end, from two samples per pixel on.
    pub noise: Option<f64>,
    /// The features of the kernel that ran.
    pub kernel: Features,
}

/// The least samples per pixel before an error estimate is believed.
const MIN_SPP_FOR_NOISE: u32 = 16;

/// Samples per pixel with equally many branches everywhere, by which those of
/// the others are decided.
const PILOT_SAMPLES: u32 = 4;

/// Samples per pixel by which the camera rays of the others are decided.
const OUTLINE_SAMPLES: u32 = 5;

/// Between two looks at the clock, at most this share of the time limit.
const TIME_SLICE: f64 = 0.05;

/// One pass over the film.
pub(super) struct Job<'a> {
    scene: &'a Scene,
    settings: &'a RenderSettings,
    camera: &'a Camera,
    /// Samples `first .. first + count` of every pixel.
    first: u32,
    count: u32,
    /// Whether the film takes note of how samples differ within themselves.
    pilot: bool,
}

impl Job<'_> {
    /// How camera path number `index` of a pixel splits, given what was planned for it.
    /// The draws of a pixel are numbered on through its paths.
    fn split(&self, planned: Draws, index: u32) -> Split {
        let pilot = if splits(self.settings) {
            Draws::PILOT
        } else {
            Draws::ONE
        };
        let piloted = if planned == Draws::UNPLANNED {
            u32::MAX
        } else if exceeds_pilot(planned) {
            0
        } else {
            PILOT_SAMPLES
        };
        let numbers = |pilot: u32, planned: u32| {
            let first = index.min(piloted) * pilot + index.saturating_sub(piloted) * planned;
            let count = if index < piloted { pilot } else { planned };
            first..first + count
        };
        Split {
            light_samples: numbers(pilot.light_samples, planned.light_samples),
            branches: numbers(pilot.branches, planned.branches),
        }
    }
}

/// Whether paths split at all; plain ones need neither pilots nor a plan.
fn splits(settings: &RenderSettings) -> bool {
    settings.branches != Some(1)
}

/// How many of a film's samples per pixel [`render`] goes on from: all, or none when
/// they are too few to know how paths are to split. What those tell about the others is
/// not kept with them.
pub fn begun(settings: &RenderSettings, film: &Film) -> u32 {
    match film.samples_per_pixel() {
        ..OUTLINE_SAMPLES if splits(settings) => 0,
        samples => samples,
    }
}

/// Whether the pilot samples of a pixel are too coarse to be averaged with the
/// others: all samples have the same weight.
fn exceeds_pilot(planned: Draws) -> bool {
    planned.camera_rays > Draws::PILOT.camera_rays
        || planned.light_samples > Draws::PILOT.light_samples
        || planned.branches > Draws::PILOT.branches
}

/// Why nothing can be rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// The scene has no camera.
    #[error("there is no `camera`, so there is nothing to see")]
    NoCamera,
}

/// How a render is watched and ended; none of it changes the image. Threads are those
/// of the rayon pool that it is called in.
#[derive(Default)]
pub struct Control<'a> {
    /// Becomes true when somebody wants the render to end.
    pub interrupt: Option<&'a AtomicBool>,
    /// Is called before each pass and at the end.
    pub progress: Option<&'a mut dyn FnMut(Progress)>,
}

/// Renders into `film`, which may have samples already: they are counted and
/// continued, see [`begun`]. The image depends on scene, seed and number of samples alone,
/// not on threads or passes. When somebody interrupts the render, the current pass is
/// finished first, so that all pixels have equally many samples.
///
/// # Errors
/// When the scene has no camera.
///
/// # Panics
/// When the film is of another layout than [`RenderSettings::film`].
pub fn render(
    scene: &Scene,
    settings: &RenderSettings,
    film: &mut Film,
    mut control: Control<'_>,
) -> Result<RenderReport, RenderError> {
    let start = Instant::now();
    assert!(
        film.window() == settings.window && film.aovs() == settings.aovs,
        "the film is of another layout"
    );
    let camera = scene.camera.as_ref().ok_or(RenderError::NoCamera)?;
    let limits = settings.limits;
    let (kernel, pass) = pass_for(scene, settings.all_in);
    let splits = splits(settings);
    let begun = begun(settings, film);
    if begun < film.samples_per_pixel() {
        *film = settings.film();
    }
    let mut progress = |progress| {
        if let Some(watch) = &mut control.progress {
            watch(progress);
        }
    };
    let mut spp = begun;
    let mut rays = 0;
    let mut noise = None;
    let mut scale = 0.0;
    let mut stop = Stop::Samples;
    let mut slowest_sample = Duration::ZERO;
    while spp < limits.spp {
        let elapsed = start.elapsed();
        progress(Progress {
            spp,
            target: limits.spp,
            elapsed,
        });
        if control
            .interrupt
            .is_some_and(|flag| flag.load(Ordering::Relaxed))
        {
            stop = Stop::Interrupted;
            break;
        }
        if limits
            .time
            .is_some_and(|t| spp > begun && elapsed + slowest_sample > t)
        {
            stop = Stop::Time;
            break;
        }
        let mut count = pass_length(spp - begun, limits.spp - spp, limits.time, slowest_sample);
        let pilot = splits && spp < OUTLINE_SAMPLES;
        if pilot {
            let planned = if spp < PILOT_SAMPLES {
                PILOT_SAMPLES
            } else {
                OUTLINE_SAMPLES
            };
            count = count.min(planned - spp);
        }
        let job = Job {
            scene,
            settings,
            camera,
            pilot,
            first: spp,
            count,
        };
        let pass_start = Instant::now();
        rays += pass(&job, film.tiles_mut());
        spp += count;
        slowest_sample = slowest_sample.max(pass_start.elapsed() / count);
        if pilot && spp == PILOT_SAMPLES {
            scale = film.plan(settings.branches);
        }
        if pilot && spp == OUTLINE_SAMPLES {
            film.plan_camera_rays(scale);
        }
        if let Some(target) = limits.noise {
            noise = film.relative_error();
            if spp >= MIN_SPP_FOR_NOISE && noise.is_some_and(|n| n <= target) {
                stop = Stop::Noise;
                break;
            }
        }
    }
    progress(Progress {
        spp,
        target: limits.spp,
        elapsed: start.elapsed(),
    });
    Ok(RenderReport {
        spp,
        added: spp - begun,
        wall: start.elapsed(),
        rays,
        stop,
        noise: noise.or_else(|| film.relative_error()),
        kernel,
    })
}

/// Samples per pixel of the next pass: doubling from one, so that early
/// interrupts are quick and late passes are long enough to keep threads busy.
fn pass_length(done: u32, left: u32, time: Option<Duration>, sample: Duration) -> u32 {
    let doubling = done.clamp(1, 64).min(left);
    match time {
        Some(time) if !sample.is_zero() => {
            let slice = (time.as_secs_f64() * TIME_SLICE / sample.as_secs_f64()) as u32;
            doubling.min(slice.max(1))
        }
        _ => doubling,
    }
}

/// Adds the job's samples to every tile; returns the rays traced.
pub(super) fn render_pass<const F: u32>(job: &Job<'_>, tiles: &mut [FilmTile]) -> u64 {
    let tracer = PathTracer::<F>::new(job.scene, job.settings, job.pilot);
    tiles
        .par_iter_mut()
        // A few tiles can cost most of a pass: none waits behind another.
        .with_max_len(1)
        .map(|tile| {
            let mut rays = 0;
            for pixel in tile.window().pixels() {
                let planned = tile.draws(pixel);
                let anew = job.first == PILOT_SAMPLES && exceeds_pilot(planned)
                    || job.first == OUTLINE_SAMPLES && planned.camera_rays > 1;
                if anew {
                    tile.clear(pixel);
                }
                let first = if anew { 0 } else { job.first };
                for sample in first..job.first + job.count {
                    rays += u64::from(render_sample(&tracer, job, pixel, sample, tile));
                }
            }
            rays
        })
        .sum()
}

/// Adds sample number `index` of a pixel; returns the rays traced.
fn render_sample<const F: u32>(
    tracer: &PathTracer<'_, F>,
    job: &Job<'_>,
    pixel: [u32; 2],
    index: u32,
    tile: &mut FilmTile,
) -> u32 {
    let RenderSettings { filter, seed, .. } = job.settings;
    let planned = tile.draws(pixel);
    // One before anything is planned.
    let camera_rays = planned.camera_rays.max(1);
    let mut paths = ArrayVec::<_, { Draws::MOST as usize }>::new();
    let mut spreads = [Spread::default(); 2];
    let mut rays = 0;
    for path in index * camera_rays..(index + 1) * camera_rays {
        let mut sampler = Sampler::new(*seed, pixel, path);
        let [dx, dy] = filter.offset(sampler.get_2d(Dimension::camera_pixel()));
        let raster = [pixel[0] as f32 + 0.5 + dx, pixel[1] as f32 + 0.5 + dy];
        let lens = if has::<F>(Features::DEPTH_OF_FIELD) {
            sampler.get_2d(Dimension::lens())
        } else {
            [0.5; 2]
        };
        let ray = job.camera.ray(raster, lens);
        // Depth counts along the view axis, not along the ray.
        let depth_scale = ray.direction.dot(job.camera.forward());
        let result = tracer.trace(ray, &mut sampler, job.split(planned, path));
        rays += result.rays;
        paths.push(result.to_sample(depth_scale));
        spreads = [result.light_samples, result.branches];
    }
    if tile.add(pixel, &paths) && job.pilot {
        let [light_samples, branches] = spreads;
        tile.add_pilot(pixel, light_samples, branches);
    }
    rays
}
