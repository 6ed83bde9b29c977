//! From a scene to a film: pilots, then passes over the film until a limit is reached.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::kernel::{self, Kernel};
use super::pass::Job;
use super::roulette::{self, Grid, Roulette, Survival};
use super::split::{Plan, pass_length};
use crate::features::Features;
use crate::film::Film;
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
    /// Samples per pixel so far, on average over the film.
    pub spp: f64,
    /// How many there will be if nothing else stops it.
    pub target: u32,
    /// Time since the start.
    pub elapsed: Duration,
    /// Estimated relative error after the last pass, if it was looked at.
    pub noise: Option<f64>,
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

/// The bounce from which paths play by throughput where nothing better is known.
const PLAIN_ROULETTE: u32 = 8;

/// How often progress is told within a pass.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(500);

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
    /// Becomes true when somebody wants the render to end. It does so within the time
    /// that a thread needs for a sample of each pixel of a tile.
    pub interrupt: Option<&'a AtomicBool>,
    /// Is told how far it is, by any thread, a few times a second.
    pub progress: Option<&'a (dyn Fn(Progress) + Sync)>,
    /// When to save the film on the way.
    pub checkpoint: Option<Checkpoint<'a>>,
}

/// Saves a film during a render.
pub struct Checkpoint<'a> {
    /// Time between two of them, if they are to come by themselves.
    pub interval: Option<Duration>,
    /// Becomes true when somebody wants one now; is set back then.
    pub now: &'a AtomicBool,
    /// Saves it. The tiles of the film may have different numbers of samples.
    pub save: &'a mut dyn FnMut(&Film),
}

/// Renders into `film`, which may have samples already: those that are missing are
/// added. The image depends on scene, settings and samples alone, not on threads,
/// passes, interruptions, or what else is rendered of it.
///
/// An interrupted film may have more samples in some tiles than in others; a further
/// call goes on from them.
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
    assert!(
        film.window() == settings.window && film.aovs() == settings.aovs,
        "the film is of another layout"
    );
    let camera = scene.camera.as_ref().ok_or(RenderError::NoCamera)?;
    let (features, kernel) = kernel::for_scene(scene, settings.all_in);
    let Kernel {
        samples,
        pilots,
        training,
    } = kernel;
    let limits = settings.limits;
    let first = settings.share.start;
    let target = limits.spp.min(settings.share.end).saturating_sub(first);
    let watch = Watch::new(&control, film, target);

    let unplanned = Plan::default();
    let even = Survival::from(settings.roulette_start.unwrap_or(PLAIN_ROULETTE));
    let untrained = Roulette::Even(even);
    let mut job = Job {
        scene,
        settings,
        camera,
        plan: &unplanned,
        roulette: &untrained,
        end: first,
        leave_off: &|_| watch.interrupted(),
    };
    let pilot_rays = AtomicU64::new(0);
    let plain = settings.branches == Some(1) || settings.roulette_start.is_some();
    let trained = (!plain).then(|| {
        let grid = Grid::new(settings.resolution);
        let paths = training(&job, &grid);
        let rays = paths.iter().map(|path| u64::from(path.rays)).sum();
        pilot_rays.fetch_add(rays, Ordering::Relaxed);
        roulette::fit(&paths, grid, even)
    });
    job.roulette = trained.as_ref().unwrap_or(&untrained);
    let plan = Plan::new(settings, |cells| {
        let found = pilots(&job, cells);
        let rays = found.iter().map(|pilot| u64::from(pilot.rays)).sum();
        pilot_rays.fetch_add(rays, Ordering::Relaxed);
        found
    });
    job.plan = &plan;
    let mut rays = pilot_rays.into_inner();

    let begun = film.samples_per_pixel();
    let mut noise = None;
    let mut slowest_sample = Duration::ZERO;
    let stop = loop {
        let spp = film.samples_per_pixel();
        watch.tell(noise);
        if watch.interrupted() {
            break Stop::Interrupted;
        }
        if spp >= target {
            break Stop::Samples;
        }
        let elapsed = watch.start.elapsed();
        let late = |time| spp > begun && elapsed + slowest_sample > time;
        if limits.time.is_some_and(late) {
            break Stop::Time;
        }
        let count = pass_length(spp - begun, target - spp, limits.time, slowest_sample);
        let pass = Job {
            end: first + spp + count,
            leave_off: &|pixels| watch.look(pixels),
            ..job
        };
        let pass_start = Instant::now();
        rays += samples(&pass, film.tiles_mut());
        slowest_sample = slowest_sample.max(pass_start.elapsed() / count);
        if let (true, Some(checkpoint)) = (watch.save_is_due(), &mut control.checkpoint) {
            (checkpoint.save)(film);
            watch.saved();
        }
        if let (Some(target), true) = (limits.noise, film.samples_per_pixel() > spp) {
            noise = film.relative_error();
            let believed = film.samples_per_pixel() >= MIN_SPP_FOR_NOISE;
            if believed && noise.is_some_and(|n| n <= target) {
                break Stop::Noise;
            }
        }
    };
    let spp = film.samples_per_pixel();
    Ok(RenderReport {
        spp,
        added: spp - begun,
        wall: watch.start.elapsed(),
        rays,
        stop,
        noise: film.relative_error(),
        kernel: features,
    })
}

/// What threads look at while they render.
struct Watch<'a> {
    start: Instant,
    interrupt: Option<&'a AtomicBool>,
    progress: Option<&'a (dyn Fn(Progress) + Sync)>,
    save_now: Option<&'a AtomicBool>,
    save_interval: Option<Duration>,
    /// Of the last save, milliseconds since the start.
    saved: AtomicU64,
    target: u32,
    /// Pixels of the film.
    pixels: u64,
    /// Samples of all pixels so far.
    samples: AtomicU64,
    /// Of the last progress, milliseconds since the start.
    told: AtomicU64,
}

impl<'a> Watch<'a> {
    fn new(control: &Control<'a>, film: &Film, target: u32) -> Self {
        let pixels = |tile: &crate::film::FilmTile| tile.window().area() as u64;
        let samples = |tile| pixels(tile) * u64::from(tile.taken().count());
        let start = Instant::now();
        Self {
            start,
            interrupt: control.interrupt,
            progress: control.progress,
            save_now: control.checkpoint.as_ref().map(|c| c.now),
            save_interval: control.checkpoint.as_ref().and_then(|c| c.interval),
            saved: AtomicU64::new(0),
            target,
            pixels: film.tiles().iter().map(pixels).sum(),
            samples: AtomicU64::new(film.tiles().iter().map(samples).sum()),
            told: AtomicU64::new(0),
        }
    }

    fn interrupted(&self) -> bool {
        self.interrupt
            .is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn save_is_due(&self) -> bool {
        let now = self
            .save_now
            .is_some_and(|flag| flag.load(Ordering::Relaxed));
        let last = Duration::from_millis(self.saved.load(Ordering::Relaxed));
        let late = |interval| self.start.elapsed() >= last + interval;
        now || self.save_interval.is_some_and(late)
    }

    fn saved(&self) {
        let now = self.start.elapsed().as_millis() as u64;
        self.saved.store(now, Ordering::Relaxed);
        if let Some(flag) = self.save_now {
            flag.store(false, Ordering::Relaxed);
        }
    }

    /// Before a thread takes a sample of so many pixels: whether it is to leave off.
    fn look(&self, pixels: u64) -> bool {
        if self.interrupted() || self.save_is_due() {
            return true;
        }
        self.samples.fetch_add(pixels, Ordering::Relaxed);
        let now = self.start.elapsed();
        let told = self.told.load(Ordering::Relaxed);
        let due = now.as_millis() as u64 >= told + PROGRESS_INTERVAL.as_millis() as u64;
        let now_ms = now.as_millis() as u64;
        // One thread alone gets through.
        let ordering = Ordering::Relaxed;
        if due
            && self
                .told
                .compare_exchange(told, now_ms, ordering, ordering)
                .is_ok()
        {
            self.tell(None);
        }
        false
    }

    fn tell(&self, noise: Option<f64>) {
        if let Some(progress) = self.progress {
            progress(Progress {
                spp: self.samples.load(Ordering::Relaxed) as f64 / self.pixels as f64,
                target: self.target,
                elapsed: self.start.elapsed(),
                noise,
            });
        }
    }
}
