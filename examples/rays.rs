//! What share of a render goes into tracing its rays: those of a few samples
//! per pixel are recorded, then traced again by a bare loop over Embree. The
//! rows of a table in `docs/speed.md`.
//!
//! ```text
//! cargo run --release --features record-rays --example rays -- scenes/*/scene.yaml
//! ```
//!
//! All on one thread; times are the thread's CPU time, the median of five runs
//! that take turns. Shadow rays ask for any hit, but for the nearest one where
//! surfaces may let them through.

use std::hint::black_box;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use cpu_time::ThreadTime;
use smithwalk::description::Description;
use smithwalk::embree::{Accelerator, Query, Ray, recorded};
use smithwalk::film::{AovSet, PixelFilter};
use smithwalk::integrator::{Control, RenderReport, render};
use smithwalk::scene::{Limits, RenderSettings, Resolved, Scene, resolve};

/// Samples per pixel, the pilots before them left alone: ten to thirty
/// million rays for the scenes of the repository.
const SPP: u32 = 8;

/// Runs of each measurement.
const REPEATS: usize = 5;

fn main() -> Result<()> {
    let scenes: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    ensure!(!scenes.is_empty(), "expected scene files");
    println!(
        "| scene | million rays | of them for any hit | render, Mrays/s | Embree alone, Mrays/s \
         | for the nearest hit | for any hit | Embree's share |"
    );
    println!("|{}", "---|".repeat(8));
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    one_thread.install(|| scenes.iter().try_for_each(|path| row(path)))
}

/// Measures one scene and prints its row.
fn row(path: &Path) -> Result<()> {
    let description = Description::load(path, &[])?;
    let Resolved {
        scene, settings, ..
    } = resolve(&description)?;
    let settings = RenderSettings {
        filter: PixelFilter::box_filter(),
        aovs: AovSet::NONE,
        limits: Limits::samples(SPP),
        ..settings
    };
    let render = || rendered(&scene, &settings);

    let mut report = None;
    let queries = recorded(|| report = Some(render()));
    let rays = report.context("nothing was rendered")??.rays;
    ensure!(
        rays == queries.len() as u64,
        "the renderer counts {rays} rays, but traced {}",
        queries.len()
    );
    let (nearest, any) = split(&queries);

    let mut times: [Vec<f64>; 4] = Default::default();
    for _ in 0..REPEATS {
        let runs = [
            seconds(|| drop(black_box(render()))),
            seconds(|| all(&scene.accelerator, &queries)),
            seconds(|| intersect(&scene.accelerator, &nearest)),
            seconds(|| occluded(&scene.accelerator, &any)),
        ];
        for (times, run) in times.iter_mut().zip(runs) {
            times.push(run);
        }
    }
    let [whole, bare, hits, anys] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[REPEATS / 2]
    });
    let rate = |count: usize, seconds: f64| match count {
        0 => "–".to_owned(),
        _ => format!("{:.2}", count as f64 / seconds / 1e6),
    };
    let folder = path.parent().and_then(Path::file_name);
    println!(
        "| {} | {:.2} | {:.0} % | {} | {} | {} | {} | {:.0} % |",
        folder.unwrap_or_default().to_string_lossy(),
        queries.len() as f64 / 1e6,
        100.0 * any.len() as f64 / queries.len() as f64,
        rate(queries.len(), whole),
        rate(queries.len(), bare),
        rate(nearest.len(), hits),
        rate(any.len(), anys),
        100.0 * bare / whole,
    );
    Ok(())
}

fn rendered(scene: &Scene, settings: &RenderSettings) -> Result<RenderReport> {
    let mut film = settings.film();
    Ok(render(scene, settings, &mut film, Control::default())?)
}

/// The rays that look for the nearest hit, and those that look for any.
fn split(queries: &[Query]) -> (Vec<Ray>, Vec<Ray>) {
    let (mut nearest, mut any) = (Vec::new(), Vec::new());
    for query in queries {
        match *query {
            Query::Intersect(ray) => nearest.push(ray),
            Query::Occluded(ray) => any.push(ray),
        }
    }
    (nearest, any)
}

fn all(accelerator: &Accelerator, queries: &[Query]) {
    for query in queries {
        match *query {
            Query::Intersect(ray) => {
                black_box(accelerator.intersect(ray));
            }
            Query::Occluded(ray) => {
                black_box(accelerator.occluded(ray));
            }
        }
    }
}

fn intersect(accelerator: &Accelerator, rays: &[Ray]) {
    for &ray in rays {
        black_box(accelerator.intersect(ray));
    }
}

fn occluded(accelerator: &Accelerator, rays: &[Ray]) {
    for &ray in rays {
        black_box(accelerator.occluded(ray));
    }
}

/// CPU seconds of this thread.
fn seconds(work: impl FnOnce()) -> f64 {
    let start = ThreadTime::now();
    work();
    start.elapsed().as_secs_f64()
}
