//! `smithwalk converge`: error against samples, wall time and CPU time.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, ensure};
use clap::ValueEnum;
use serde_json::json;
use smithwalk::image::read_exr;
use smithwalk::report::converge::{
    Abscissa, Curve, Fit, Plan, Reach, Reference, Run, View, chart, measure, read_peers,
};
use smithwalk::scene::{RenderSettings, Scene};

use super::render::{EstimatorName, positive};
use super::scene::SceneArgs;

/// Samples of the reference for each of the longest measured render.
const REFERENCE_FACTOR: u32 = 32;

/// Keeps the seeds of references apart from those of measured images.
const REFERENCE_SEED: u64 = 1 << 63;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for runs.csv, summary.json and the charts
    #[arg(short, long = "output", value_name = "DIR")]
    output: PathBuf,
    /// Converged image to compare with, for all estimators alike [default: rendered; biased estimators get one each]
    #[arg(long, value_name = "R.exr")]
    reference: Option<PathBuf>,
    /// Samples per pixel of rendered references [default: 32 × --spp]
    #[arg(long, value_name = "N", conflicts_with = "reference", value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    reference_spp: Option<u32>,
    /// Estimators to measure
    #[arg(long, value_delimiter = ',', default_values = ["auto", "walk", "single", "compensated"])]
    estimators: Vec<EstimatorName>,
    /// Most samples per pixel; errors are measured at all powers of two up to it
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    spp: u32,
    /// Images to average the error over
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..))]
    seeds: u16,
    /// Seed of the first image
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(..REFERENCE_SEED - 65536))]
    seed: u64,
    /// Relative error (root of the relative mean squared one) to give the time to
    #[arg(long, value_name = "REL", default_value_t = 0.02, value_parser = positive)]
    error: f64,
    /// Measurements of another renderer: columns name, spp, wall_s, cpu_s, rel_mse; may be given several times
    #[arg(long, value_name = "CSV")]
    peer: Vec<PathBuf>,
}

pub fn run(args: &Args, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<ExitCode> {
    // All that can go wrong with files goes wrong before hours of rendering.
    let peers = peers(args)?;
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("can't make the folder {}", args.output.display()))?;
    let mut measured = measure_all(args, log)?;
    let mut all_runs = std::mem::take(&mut measured.runs);
    all_runs.extend(peers.iter().cloned());
    measured.curves.extend(Curve::from_runs(&peers));

    write_runs(args, &all_runs)?;
    write_summary(args, &measured)?;
    let title = format!("Error of {}", args.scene.scene.display());
    for abscissa in Abscissa::ALL {
        let svg = chart(&title, &measured.curves, abscissa).to_svg()?;
        write_file(args, &format!("error-{}.svg", abscissa.name()), &svg)?;
    }
    print(args, &measured.curves, out)?;
    Ok(ExitCode::SUCCESS)
}

fn peers(args: &Args) -> anyhow::Result<Vec<Run>> {
    let mut runs = Vec::new();
    for path in &args.peer {
        runs.extend(read_peers(path)?);
    }
    let estimators: Vec<String> = args.estimators.iter().map(|&e| name_of(e)).collect();
    for run in &runs {
        ensure!(
            !estimators.contains(&run.name),
            "a peer has the name `{}`, which is that of a measured estimator",
            run.name
        );
    }
    Ok(runs)
}

fn name_of(estimator: EstimatorName) -> String {
    let value = estimator.to_possible_value().expect("none is skipped");
    value.get_name().to_owned()
}

struct Measured {
    runs: Vec<Run>,
    curves: Vec<Curve>,
    resolution: [u32; 2],
    plan: Plan,
    reference_spp: Option<u32>,
}

/// A scene with one estimator.
struct Prepared {
    scene: Scene,
    settings: RenderSettings,
}

impl Prepared {
    fn new(args: &Args, estimator: EstimatorName, log: &mut dyn Write) -> anyhow::Result<Self> {
        let mut description = args.scene.describe()?;
        description.sampling.estimator = estimator.into();
        let resolved = args.scene.resolve(&description, log)?;
        let prepared = Self {
            scene: resolved.scene,
            settings: resolved.settings,
        };
        View::new(&prepared.scene, &prepared.settings)
            .with_context(|| args.scene.scene.display().to_string())?;
        Ok(prepared)
    }

    fn view(&self) -> View<'_> {
        View::new(&self.scene, &self.settings).expect("checked above")
    }
}

fn measure_all(args: &Args, log: &mut dyn Write) -> anyhow::Result<Measured> {
    let plan = Plan {
        spp: args.spp,
        seeds: (args.seed..).take(usize::from(args.seeds)).collect(),
    };
    let reference_spp = args
        .reference_spp
        .unwrap_or_else(|| args.spp.saturating_mul(REFERENCE_FACTOR).max(2));
    let model = Prepared::new(args, EstimatorName::Auto, log)?;
    let resolution = model.settings.resolution;
    let truth = match &args.reference {
        Some(path) => {
            let image = read_exr(path)?;
            let reference = Reference::from_image(&image, resolution, &plan.seeds)
                .with_context(|| format!("{} can't be the reference", path.display()))?;
            if reference.floor.is_none() {
                let path = path.display();
                writeln!(
                    log,
                    "warning: {path} has no layer `variance`: its noise counts as error"
                )?;
            }
            reference
        }
        None => {
            writeln!(log, "rendering the reference, {reference_spp} spp")?;
            Reference::render(&model.view(), reference_spp, REFERENCE_SEED)
        }
    };

    let (mut runs, mut curves) = (Vec::new(), Vec::new());
    for &estimator in &args.estimators {
        let name = name_of(estimator);
        let prepared = Prepared::new(args, estimator, log)?;
        let biased = matches!(
            estimator,
            EstimatorName::Single | EstimatorName::Compensated
        );
        let own = if biased && args.reference.is_none() {
            writeln!(
                log,
                "rendering the reference of {name}, {reference_spp} spp"
            )?;
            Some(Reference::render(
                &prepared.view(),
                reference_spp,
                REFERENCE_SEED,
            ))
        } else {
            None
        };
        let reference = own.as_ref().unwrap_or(&truth);
        writeln!(log, "measuring {name}")?;
        let (of_estimator, tails) = measure(&name, &prepared.view(), reference, &plan);
        let mut curve = Curve::from_runs(&of_estimator).remove(0);
        curve.floor = reference.floor;
        curve.bias = own.as_ref().map(|own| truth.bias(own));
        curve.tails = Some(tails);
        curves.push(curve);
        runs.extend(of_estimator);
    }
    Ok(Measured {
        runs,
        curves,
        resolution,
        plan,
        reference_spp: args.reference.is_none().then_some(reference_spp),
    })
}

fn write_file(args: &Args, name: &str, text: &str) -> anyhow::Result<()> {
    let path = args.output.join(name);
    std::fs::write(&path, text).with_context(|| format!("can't write {}", path.display()))
}

/// Every run, peers included; the file can serve as a peer itself.
fn write_runs(args: &Args, runs: &[Run]) -> anyhow::Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for run in runs {
        writer.serialize(run)?;
    }
    let text = String::from_utf8(writer.into_inner()?)?;
    write_file(args, "runs.csv", &text)
}

/// The slopes and times of one curve.
fn figures(curve: &Curve, error: f64) -> serde_json::Value {
    let target = error * error;
    let by = |abscissa: Abscissa| {
        let at = move |p: &_| abscissa.of(p);
        let fit: Option<Fit> = curve.fit(at);
        let reach: Option<Reach> = curve.reach(target, at);
        json!({"slope": fit.map(|f| f.slope), "to_error": reach})
    };
    json!({
        "spp": by(Abscissa::Samples),
        "wall_s": by(Abscissa::Wall),
        "cpu_s": by(Abscissa::Cpu),
        "rel_mse_cpu_s": curve.cost(),
    })
}

fn write_summary(args: &Args, measured: &Measured) -> anyhow::Result<()> {
    let curves: Vec<_> = measured
        .curves
        .iter()
        .map(|curve| {
            let mut value = json!(curve);
            value["by"] = figures(curve, args.error);
            value
        })
        .collect();
    let summary = json!({
        "scene": args.scene.scene,
        "width": measured.resolution[0],
        "height": measured.resolution[1],
        "seeds": measured.plan.seeds,
        "threads": rayon::current_num_threads(),
        "reference": args.reference,
        "reference_spp": measured.reference_spp,
        "error": args.error,
        "curves": curves,
    });
    write_file(
        args,
        "summary.json",
        &serde_json::to_string_pretty(&summary)?,
    )
}

fn print(args: &Args, curves: &[Curve], out: &mut dyn Write) -> anyhow::Result<()> {
    writeln!(
        out,
        "{:<24} {:>6} {:>9} {:>9} {:>9} {:>11} {:>7} {:>10} {:>9} {:>9}  to {:.3} (s wall)",
        "",
        "spp",
        "rel.RMSE",
        "CPU s",
        "bias",
        "MSE × CPU s",
        "slope",
        "variance",
        "kurtosis",
        "largest",
        args.error
    )?;
    let number = |value: Option<f64>, digits: usize| match value {
        Some(value) => format!("{value:.digits$}"),
        None => "–".to_owned(),
    };
    for curve in curves {
        let last = curve.points.last().expect("every curve has runs");
        let reach = curve.reach(args.error * args.error, |p| Abscissa::Wall.of(p));
        let slope = curve.fit(|p| Abscissa::Samples.of(p)).map(|f| f.slope);
        let tails = curve.tails.as_ref();
        writeln!(
            out,
            "{:<24} {:>6} {:>9.5} {:>9.3} {:>9} {:>11.3e} {:>7} {:>10} {:>9} {:>9}  {}",
            curve.name,
            last.spp,
            last.rel_mse.max(0.0).sqrt(),
            last.cpu_s,
            number(curve.bias.map(|b| b.max(0.0).sqrt()), 5),
            last.rel_mse * last.cpu_s,
            number(slope, 2),
            number(tails.map(|t| t.variance), 4),
            number(tails.map(|t| t.kurtosis), 0),
            number(tails.map(|t| t.largest), 1),
            match reach {
                Some(reach) if reach.extrapolated => format!("{:.2} (extrapolated)", reach.at),
                Some(reach) => format!("{:.2}", reach.at),
                None => "not reached".to_owned(),
            }
        )?;
    }
    if let Some(floor) = curves.iter().find_map(|curve| curve.floor) {
        writeln!(
            out,
            "noise of the reference: {:.5} (relative RMSE), subtracted",
            floor.max(0.0).sqrt()
        )?;
    }
    writeln!(
        out,
        "{}: runs.csv, summary.json, error-*.svg",
        args.output.display()
    )?;
    Ok(())
}
