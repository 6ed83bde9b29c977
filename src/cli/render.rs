//! `smithwalk render`.

mod frames;
mod outputs;
mod progress;
mod signals;

use std::io::Write;
use std::ops::{Range, RangeInclusive};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, ensure};
use smithwalk::description::{Description, Estimator};
use smithwalk::embree::Denoiser;
use smithwalk::features::Features;
use smithwalk::film::{Aov, Film, Finish, Identity, Origin, SavedFilm};
use smithwalk::image::{DENOISED, Display, Image, Layer, OutputPath, Window};
use smithwalk::integrator::{Checkpoint, Control, RenderReport, Stop, render};
use smithwalk::scene::{Limits, RenderSettings, Resolved, Scene};
use xxhash_rust::xxh3::xxh3_128;

use super::scene::{SceneArgs, display};
use outputs::Outputs;
use progress::{ProgressKind, Reporter};
use signals::Signals;

/// Samples per pixel beyond which only `--time` or `--noise` make sense.
const MOST_SPP: u32 = 1 << 24;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// File to write: .exr (scene-linear), .png, or .film (all sums, for `merge` and --resume); may be given several times [default: the scene's name with .exr and .png]
    #[arg(short, long = "output", value_name = "OUT.exr|OUT.png|OUT.film")]
    output: Vec<PathBuf>,
    /// Samples per pixel [default: the scene's; without limit if --time or --noise is given]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SPP)))]
    spp: Option<u32>,
    /// Stop after this many seconds
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    time: Option<f64>,
    /// Stop at this estimated relative error of the image, e.g. 0.02
    #[arg(long, value_name = "REL", value_parser = positive)]
    noise: Option<f64>,
    /// Seed of the random numbers [default: the scene's]
    #[arg(long)]
    seed: Option<u64>,
    /// Threads; the image does not depend on it [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Render these pixels alone: left, top, right and bottom edge
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_crop)]
    crop: Option<[u32; 4]>,
    /// Go on from the samples of an earlier run
    #[arg(long)]
    resume: bool,
    /// Save the samples so often on the way; 0: never
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = interval)]
    checkpoint: f64,
    /// Render this share of the samples of every pixel alone, I from 0 to N − 1, for `merge`
    #[arg(long, value_name = "I/N", value_parser = parse_part)]
    part: Option<Part>,
    /// Render these frames of an animation, both ends included; a row of # in OUT stands for the number
    #[arg(long, value_name = "A..B", value_parser = parse_frames, allow_hyphen_values = true)]
    frames: Option<FrameRange>,
    /// Also write the image without noise, as OUT.denoised.exr and a layer of OUT.exr, by Open Image Denoise
    #[arg(long, conflicts_with = "part")]
    denoise: bool,
    /// How progress is told on stderr
    #[arg(long, value_name = "KIND", default_value = "bar")]
    progress: ProgressKind,
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
    /// One random walk per evaluation, as in the paper; rare large estimates
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

/// One of several shares of a render's samples.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    index: u32,
    count: u32,
}

impl Part {
    /// Its samples among so many; parts differ by one at most.
    fn of(self, spp: u32) -> Range<u32> {
        let edge = |index: u32| {
            let edge = u64::from(spp) * u64::from(index) / u64::from(self.count);
            u32::try_from(edge).expect("at most the number of samples")
        };
        edge(self.index)..edge(self.index + 1)
    }
}

fn parse_part(text: &str) -> Result<Part, String> {
    let (index, count) = text.split_once('/').ok_or("expected I/N, e.g. 0/8")?;
    let number = |text: &str| {
        let error = |_| format!("`{text}` is no number of a part");
        text.trim().parse::<u32>().map_err(error)
    };
    let (index, count) = (number(index)?, number(count)?);
    if index < count {
        Ok(Part { index, count })
    } else {
        Err(format!(
            "there are parts 0 to N − 1 of N; found {index}/{count}"
        ))
    }
}

/// Numbers of frames.
type FrameRange = RangeInclusive<i32>;

fn parse_frames(text: &str) -> Result<FrameRange, String> {
    let number = |text: &str| {
        let error = |_| format!("`{text}` is no number of a frame");
        text.trim().parse::<i32>().map_err(error)
    };
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let (first, last) = (number(first)?, number(last.trim_start_matches('='))?);
    if first <= last {
        Ok(first..=last)
    } else {
        Err(format!("frame {last} comes before frame {first}"))
    }
}

/// The longest time that can be asked for, in seconds: a thousand years.
const LONGEST_TIME: f64 = 3.2e10;

fn seconds(text: &str) -> Result<f64, String> {
    match positive(text)? {
        time if time <= LONGEST_TIME => Ok(time),
        _ => Err("expected a time below a thousand years, in seconds".to_owned()),
    }
}

fn interval(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(0.0) => Ok(0.0),
        _ => seconds(text),
    }
}

pub fn run(args: &Args, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<ExitCode> {
    if let Some(range) = &args.frames {
        return frames::run(args, range, out, log);
    }
    let mut description = args.scene.describe()?;
    apply(args, &mut description);
    let display = display(&description)?;
    let outputs = Outputs::new(args, None)?;
    start_threads(args)?;
    let settings = override_settings(args, RenderSettings::new(&description))?;
    let film = settings.memory() + outputs.resumed_bytes(args);
    let resolved = args.scene.resolve_beside(&description, film, log)?;
    let signals = Signals::listen()?;
    let shot = Shot {
        args,
        description: &description,
        outputs: &outputs,
        signals: &signals,
        display: &display,
        frame: None,
    };
    let done = shot.take(&resolved, log)?;
    shot.tell(&done, &resolved.scene, out)?;
    Ok(signals.exit_code())
}

fn start_threads(args: &Args) -> anyhow::Result<()> {
    let Some(threads) = args.threads else {
        return Ok(());
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(threads))
        .build_global()
        .context("can't start the threads")
}

/// One image to be rendered.
struct Shot<'a> {
    args: &'a Args,
    description: &'a Description,
    outputs: &'a Outputs,
    signals: &'a Signals,
    display: &'a Display,
    /// The number of the frame in an animation.
    frame: Option<i32>,
}

/// What came of it.
struct Done {
    film: Film,
    report: RenderReport,
    /// Seconds of all cores.
    cpu: Option<f64>,
}

impl Done {
    fn is_interrupted(&self) -> bool {
        self.report.stop == Stop::Interrupted
    }
}

impl Shot<'_> {
    /// Renders and writes all files.
    fn take(&self, resolved: &Resolved, log: &mut dyn Write) -> anyhow::Result<Done> {
        let &Self {
            args,
            description,
            outputs,
            signals,
            display,
            frame,
        } = self;
        let Resolved {
            scene,
            settings,
            identity,
            ..
        } = resolved;
        let settings = override_settings(args, settings.clone())?;
        let threads = args.threads.map_or(0, usize::from);
        let denoiser = args.denoise.then(|| Denoiser::open(threads));
        let denoiser = denoiser.transpose()?;
        let mut film = settings.film();
        if args.resume && outputs.film.exists() {
            film.resume(SavedFilm::read(&outputs.film)?, identity)
                .context("start afresh without --resume, or with another output")?;
            let samples = film.samples_per_pixel();
            writeln!(log, "resuming at {samples} samples per pixel")?;
        }

        let reporter = Reporter::new(args.progress, &settings.limits, frame);
        let origin = self.origin(identity, &settings);
        let mut save = |film: &Film| match film.save(&outputs.film, &origin) {
            Ok(()) => reporter.saved(),
            Err(error) => reporter.warn(&format!("{error}; it is tried again later")),
        };
        let cpu_before = cpu_seconds();
        let show = |progress| reporter.show(progress);
        let control = Control {
            interrupt: Some(signals.interrupt()),
            progress: Some(&show),
            checkpoint: Some(Checkpoint {
                interval: (args.checkpoint > 0.0).then(|| Duration::from_secs_f64(args.checkpoint)),
                now: signals.save(),
                save: &mut save,
            }),
        };
        let report = render(scene, &settings, &mut film, control)
            .with_context(|| args.scene.scene.display().to_string())?;
        reporter.finish();
        let cpu = cpu_before
            .zip(cpu_seconds())
            .map(|(before, after)| after - before);

        let interrupted = report.stop == Stop::Interrupted;
        let mut failed = outputs.keep_film(&film, &origin, interrupted).err();
        let mut image = film.develop();
        image.attributes = attributes(&origin, report.spp);
        let seconds = format!("{:.3}", report.wall.as_secs_f64());
        let seconds = ("smithwalk.seconds".to_owned(), seconds);
        image.attributes.push(seconds);
        if !interrupted {
            let mark = complete_mark(identity, description, &settings, display);
            image.attributes.push((COMPLETE.to_owned(), mark));
        }
        // One that fails must not keep the others from being written.
        let mut write = |outputs: &[OutputPath], image: &Image| {
            for output in outputs {
                if let Err(error) = output.write(image, display) {
                    failed = Some(error.into());
                }
            }
        };
        let denoised = denoiser.map(|denoiser| image.denoised(&denoiser));
        if let Some(Ok(color)) = &denoised {
            image.layers.push(Layer::of_color(DENOISED, color));
        }
        write(&outputs.images, &image);
        match denoised {
            Some(Ok(color)) => {
                image.color = color;
                // The alpha stays, without a name of its own.
                image.layers.retain(|layer| layer.name.is_empty());
                write(&outputs.denoised, &image);
            }
            Some(Err(error)) => failed = Some(error.into()),
            None => {}
        }
        if let Some(error) = failed {
            let rescued = outputs.rescue(&film, &origin);
            return Err(error.context(rescued));
        }
        Ok(Done { film, report, cpu })
    }

    /// What the film says that it is of.
    fn origin(&self, identity: &Identity, settings: &RenderSettings) -> Origin {
        let target = settings.limits.spp;
        let whole = RenderSettings {
            share: 0..u32::MAX,
            limits: Limits::samples(target),
            ..settings.clone()
        };
        Origin {
            identity: identity.clone(),
            target,
            finish: Some(Finish {
                scene: self.args.scene.scene.display().to_string(),
                complete: complete_mark(identity, self.description, &whole, self.display),
                display: self.display.clone(),
            }),
        }
    }

    /// Prints it. All files come first: standard output may be closed.
    fn tell(&self, done: &Done, scene: &Scene, out: &mut dyn Write) -> anyhow::Result<()> {
        for path in self.outputs.written(done.is_interrupted()) {
            writeln!(out, "{}", path.display())?;
        }
        summarise(out, scene, &done.film, &done.report, done.cpu)
    }
}

/// The attribute of complete images.
pub const COMPLETE: &str = "smithwalk.complete";

/// A hash of all that decides about a complete image; the table of a view transform
/// counts by its colours, wherever it lies.
fn complete_mark(
    identity: &Identity,
    description: &Description,
    settings: &RenderSettings,
    display: &Display,
) -> String {
    let RenderSettings {
        window,
        share,
        limits,
        ..
    } = settings;
    let mut film = description.film.clone();
    film.view = None;
    let view = xxh3_128(&display.to_bytes());
    let all = format!("{identity:?} {film:?} {view:032x} {window:?} {share:?} {limits:?}");
    format!("{:032x}", xxh3_128(all.as_bytes()))
}

/// Puts what the command line says in place of what the file says.
fn apply(args: &Args, description: &mut Description) {
    if let Some(seed) = args.seed {
        description.sampling.seed = seed;
    }
    if let Some(estimator) = args.estimator {
        description.sampling.estimator = estimator.into();
    }
    if args.denoise {
        for guide in [Aov::Albedo, Aov::Normal] {
            if !description.film.aovs.contains(&guide) {
                description.film.aovs.push(guide);
            }
        }
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
    let spp = args.spp.unwrap_or(default);
    let share = match args.part {
        Some(part) => {
            ensure!(
                args.spp.is_some() || !open_ended,
                "--part is a share of a number of samples: --time or --noise need --spp with it"
            );
            let share = part.of(spp);
            let (samples, parts) = (spp, part.count);
            ensure!(
                !share.is_empty(),
                "{samples} samples are too few for {parts} parts"
            );
            share
        }
        None => settings.share,
    };
    Ok(RenderSettings {
        share,
        window: window(args, settings.resolution)?,
        limits: Limits {
            spp,
            time: args.time.map(Duration::from_secs_f64),
            noise: args.noise,
        },
        all_in: args.all_in,
        ..settings
    })
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

/// What EXR files say of a render, whole or merged of parts, with so many samples.
pub fn attributes(origin: &Origin, spp: u32) -> Vec<(String, String)> {
    let known = |name: &str| origin.identity.get(name).cloned();
    let scene = origin.finish.as_ref().map(|finish| finish.scene.clone());
    let pairs = [
        ("version", known("program")),
        ("scene", scene),
        ("spp", Some(spp.to_string())),
        ("seed", known("seed")),
        ("estimator", known("estimator")),
        ("max_bounces", known("max_bounces")),
    ];
    let named = pairs.map(|(name, value)| Some((format!("smithwalk.{name}"), value?)));
    named.into_iter().flatten().collect()
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
    tell_faults(out, film)
}

/// Warns of samples that could not be averaged in.
pub fn tell_faults(out: &mut dyn Write, film: &Film) -> anyhow::Result<()> {
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
