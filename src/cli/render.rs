//! `smithwalk render`.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, ensure};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use smithwalk::description::{Description, Estimator};
use smithwalk::features::Features;
use smithwalk::film::{Film, sidecar_path};
use smithwalk::image::{OutputPath, Window};
use smithwalk::integrator::{Control, Progress, RenderReport, Stop, begun, render};
use smithwalk::scene::{Limits, RenderSettings, Scene};

use super::scene::SceneArgs;

/// Samples per pixel beyond which only `--time` or `--noise` make sense.
const MOST_SPP: u32 = 1 << 24;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Image to write, .exr (scene-linear) or .png; may be given several times [default: the scene's name with .exr and .png]
    #[arg(short, long = "output", value_name = "OUT.exr|OUT.png")]
    output: Vec<PathBuf>,
    /// Samples per pixel [default: the scene's; without limit if --time or --noise is given]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SPP)))]
    spp: Option<u32>,
    /// Stop after this many seconds
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    time: Option<f64>,
    /// Stop at this estimated relative error of the image, e.g. 0.02
    #[arg(long, value_name = "REL", value_parser = positive)]
    noise: Option<f64>,
    /// Seed of the random numbers [default: the scene's]
    #[arg(long)]
    seed: Option<u64>,
    /// Threads; the image does not depend on it [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Render these pixels alone: left, top, right and bottom edge
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_crop)]
    crop: Option<[u32; 4]>,
    /// Go on from the samples of an earlier run
    #[arg(long)]
    resume: bool,
    /// How multiple scattering is computed [default: the scene's]
    #[arg(long)]
    estimator: Option<EstimatorName>,
    /// Use the kernel with every feature, to see what leaving out saves
    #[arg(long, hide = true)]
    all_in: bool,
}

/// The names of the estimators on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum EstimatorName {
    /// The best one for each material
    Auto,
    /// One random walk per evaluation: the reference
    Walk,
    /// Two walks, from both directions
    TwoWalk,
    /// Two walks with the depth integrated out
    PositionFree,
    /// Single scattering, which loses energy
    Single,
    /// Single scattering scaled to the albedo it should have
    Compensated,
}

impl From<EstimatorName> for Estimator {
    fn from(name: EstimatorName) -> Self {
        match name {
            EstimatorName::Auto => Self::Auto,
            EstimatorName::Walk => Self::Walk,
            EstimatorName::TwoWalk => Self::TwoWalk,
            EstimatorName::PositionFree => Self::PositionFree,
            EstimatorName::Single => Self::Single,
            EstimatorName::Compensated => Self::Compensated,
        }
    }
}

pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number greater than zero".to_owned()),
    }
}

fn parse_crop(text: &str) -> Result<[u32; 4], String> {
    let edges: Vec<u32> = text
        .split(',')
        .map(|edge| {
            edge.trim()
                .parse()
                .map_err(|_| format!("`{edge}` is no pixel position"))
        })
        .collect::<Result<_, _>>()?;
    match edges[..] {
        [x0, y0, x1, y1] if x0 < x1 && y0 < y1 => Ok([x0, y0, x1, y1]),
        [_, _, _, _] => Err("the window is empty: X0 < X1 and Y0 < Y1 are needed".to_owned()),
        _ => Err("expected four numbers, X0,Y0,X1,Y1".to_owned()),
    }
}

pub fn run(args: &Args, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<ExitCode> {
    let mut description = args.scene.describe()?;
    apply(args, &mut description);
    let outputs = outputs(args)?;
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(threads))
            .build_global()
            .context("can't start the threads")?;
    }

    let (scene, settings) = args.scene.resolve(&description, log)?;
    let settings = override_settings(args, settings)?;
    let mut film = settings.film();
    let fingerprint = fingerprint(&description);
    let sidecar = sidecar_path(outputs[0].path());
    if args.resume && sidecar.exists() {
        film.resume(&sidecar, fingerprint)?;
        match begun(&settings, &film) {
            0 => writeln!(log, "too few samples to go on from: starting afresh")?,
            samples => writeln!(log, "resuming at {samples} samples per pixel")?,
        }
    }

    let interrupt = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupt);
    // A second render in one process would find the handler set; there is none.
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .context("can't listen for Ctrl-C")?;
    let bar = progress_bar(&settings.limits);
    let mut progress = |progress| show(&bar, &settings.limits, progress);
    let control = Control {
        interrupt: Some(&interrupt),
        progress: Some(&mut progress),
    };
    let cpu_before = cpu_seconds();
    let report = render(&scene, &settings, &mut film, control)
        .with_context(|| args.scene.scene.display().to_string())?;
    bar.finish_and_clear();
    let cpu = cpu_before
        .zip(cpu_seconds())
        .map(|(before, after)| after - before);

    let mut image = film.develop();
    image.attributes = attributes(args, &description, &report);
    let mut failed = None;
    for output in &outputs {
        // One that fails must not keep the others from being written.
        match output.write(&image, settings.exposure) {
            Ok(()) => writeln!(out, "{}", output.path().display())?,
            Err(error) => failed = Some(error),
        }
    }
    if args.resume || matches!(report.stop, Stop::Interrupted) {
        film.save(&sidecar, fingerprint)?;
    }
    summarise(out, &scene, &film, &report, cpu)?;
    match failed {
        Some(error) => Err(error.into()),
        None => Ok(ExitCode::SUCCESS),
    }
}

/// Puts what the command line says in place of what the file says.
fn apply(args: &Args, description: &mut Description) {
    if let Some(seed) = args.seed {
        description.sampling.seed = seed;
    }
    if let Some(estimator) = args.estimator {
        description.sampling.estimator = estimator.into();
    }
}

/// What the command line says beside the description.
fn override_settings(args: &Args, settings: RenderSettings) -> anyhow::Result<RenderSettings> {
    let open_ended = args.time.is_some() || args.noise.is_some();
    let default = if open_ended {
        MOST_SPP
    } else {
        settings.limits.spp
    };
    Ok(RenderSettings {
        window: window(args, settings.resolution)?,
        limits: Limits {
            spp: args.spp.unwrap_or(default),
            time: args.time.map(Duration::from_secs_f64),
            noise: args.noise,
        },
        all_in: args.all_in,
        ..settings
    })
}

/// The files to write, each checked now so that no finished render is lost.
fn outputs(args: &Args) -> anyhow::Result<Vec<OutputPath>> {
    let mut paths = args.output.clone();
    if paths.is_empty() {
        let stem = args
            .scene
            .scene
            .file_stem()
            .context("the scene file has no name")?;
        paths.extend(["exr", "png"].map(|kind| PathBuf::from(stem).with_extension(kind)));
    }
    let outputs = paths
        .into_iter()
        .map(OutputPath::new)
        .collect::<Result<Vec<_>, _>>()?;
    for output in &outputs {
        output.check()?;
    }
    Ok(outputs)
}

fn window(args: &Args, [width, height]: [u32; 2]) -> anyhow::Result<Window> {
    let Some([x0, y0, x1, y1]) = args.crop else {
        return Ok(Window::full([width, height]));
    };
    ensure!(
        x1 <= width && y1 <= height,
        "--crop {x0},{y0},{x1},{y1} reaches beyond the image of {width} × {height} pixels"
    );
    Ok(Window {
        x: x0,
        y: y0,
        width: x1 - x0,
        height: y1 - y0,
    })
}

/// Tells renders of other scenes apart, so that their samples are not mixed.
fn fingerprint(description: &Description) -> u64 {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    // How many samples are taken does not change what a sample is.
    let mut description = description.clone();
    description.sampling.spp = 0;
    format!("{description:?}").hash(&mut hasher);
    hasher.finish()
}

fn attributes(
    args: &Args,
    description: &Description,
    report: &RenderReport,
) -> Vec<(String, String)> {
    let pairs = [
        ("smithwalk.version", env!("CARGO_PKG_VERSION").to_owned()),
        ("smithwalk.scene", args.scene.scene.display().to_string()),
        ("smithwalk.spp", report.spp.to_string()),
        ("smithwalk.seed", description.sampling.seed.to_string()),
        (
            "smithwalk.estimator",
            format!("{:?}", description.sampling.estimator),
        ),
        (
            "smithwalk.max_bounces",
            description.sampling.max_bounces.to_string(),
        ),
        (
            "smithwalk.seconds",
            format!("{:.3}", report.wall.as_secs_f64()),
        ),
    ];
    pairs
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}

fn progress_bar(limits: &Limits) -> ProgressBar {
    let bar = match limits.time {
        Some(time) => ProgressBar::new(time.as_millis() as u64),
        None => ProgressBar::new(u64::from(limits.spp)),
    };
    if !std::io::stderr().is_terminal() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let style = ProgressStyle::with_template("{wide_bar} {percent}% {msg}, {eta} left")
        .expect("a valid template");
    bar.with_style(style)
}

fn show(bar: &ProgressBar, limits: &Limits, progress: Progress) {
    bar.set_message(format!("{} spp", progress.spp));
    bar.set_position(match limits.time {
        Some(_) => progress.elapsed.as_millis() as u64,
        None => u64::from(progress.spp),
    });
}

fn summarise(
    out: &mut dyn Write,
    scene: &Scene,
    film: &Film,
    report: &RenderReport,
    cpu: Option<f64>,
) -> anyhow::Result<()> {
    let seconds = report.wall.as_secs_f64();
    let rate = report.rays as f64 / seconds.max(1e-9) / 1e6;
    write!(out, "{} spp in {seconds:.2} s", report.spp)?;
    if let Some(cpu) = cpu {
        write!(out, " ({cpu:.2} s CPU)")?;
    }
    writeln!(out, ", {rate:.2} Mrays/s")?;
    if let Some(noise) = report.noise {
        writeln!(out, "estimated relative error {noise:.4}")?;
    }
    let why = match report.stop {
        Stop::Samples => None,
        Stop::Time => Some("the time is up"),
        Stop::Noise => Some("the noise limit is reached"),
        Stop::Interrupted => Some("interrupted; --resume goes on from here"),
    };
    if let Some(why) = why {
        writeln!(out, "stopped: {why}")?;
    }
    let left_out: Vec<&str> = Features::ALL
        .iter()
        .filter(|(feature, ..)| !scene.features.contains(*feature))
        .filter(|(feature, ..)| !report.kernel.contains(*feature))
        .map(|(_, name, _)| *name)
        .collect();
    if !left_out.is_empty() {
        writeln!(out, "left out: {}", left_out.join(", "))?;
    }
    for fault in film.faults() {
        writeln!(
            out,
            "warning: {} samples were {} and left out, the first in pixels {:?}",
            fault.samples, fault.fault, fault.pixels
        )?;
    }
    Ok(())
}

/// CPU time of this process so far, seconds; `None` where the system does not
/// tell.
fn cpu_seconds() -> Option<f64> {
    cpu_time::ProcessTime::try_now()
        .ok()
        .map(|t| t.as_duration().as_secs_f64())
}
