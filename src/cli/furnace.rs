//! `smithwalk furnace`: white materials in a white world give back all light.

mod rendered;
mod table;

use std::io::Write;
use std::process::ExitCode;

use serde_json::json;
use smithwalk::description::{Description, Estimator, World};

use super::render::EstimatorName;
use super::scene::SceneArgs;

#[derive(clap::Args)]
pub struct Args {
    /// A scene to light evenly from everywhere with radiance 1 instead; its own lights are left out
    scene: Option<std::path::PathBuf>,
    /// Change a value of the scene file
    #[arg(short = 'D', value_name = "PATH=VALUE", value_parser = super::scene::parse_override)]
    overrides: Vec<(String, String)>,
    /// Walks per row of the table
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(100..))]
    samples: u64,
    /// Samples per pixel of the rendered part
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..))]
    spp: u32,
    /// How multiple scattering is computed [default: auto, or the scene's]
    #[arg(long)]
    estimator: Option<EstimatorName>,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// For scripts
    #[arg(long)]
    json: bool,
}

/// Exit code 1 when a row is off by more than this many standard errors (and by
/// more than f32 sums can explain).
const SIGMAS: f64 = 5.0;

/// What single-precision weights along a walk may lose.
const ROUNDING: f64 = 2e-5;

pub fn run(args: &Args, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<ExitCode> {
    if let Some(path) = &args.scene {
        let source = SceneArgs {
            scene: path.clone(),
            overrides: args.overrides.clone(),
            memory: None,
        };
        return scene(args, &source, out, log);
    }
    let estimator = args.estimator.map_or(Estimator::Auto, Into::into);
    let table = table::measure(estimator, args.samples, args.seed)?;
    let rendered = rendered::measure(estimator, args.spp, args.seed)?;
    let within = |mean: f64, se: f64| (mean - 1.0).abs() <= SIGMAS * se + ROUNDING;
    let passed = table
        .iter()
        .all(|r| within(r.sampled, r.sampled_se) && within(r.combined, r.combined_se))
        && rendered
            .iter()
            .all(|r| within(r.furnace.mean, r.furnace.se));
    if args.json {
        let report = json!({
            "table": table.iter().map(table::Row::to_json).collect::<Vec<_>>(),
            "rendered": rendered.iter().map(rendered::Row::to_json).collect::<Vec<_>>(),
            "passed": passed,
        });
        writeln!(out, "{report}")?;
    } else {
        table::write(&table, out)?;
        rendered::write(&rendered, out)?;
        let verdict = if passed {
            "all light comes back"
        } else {
            "light is lost or gained"
        };
        writeln!(out, "{verdict} (within {SIGMAS} standard errors)")?;
    }
    Ok(if passed {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// Lights a scene evenly and reports what share of the light the pixels that
/// see a surface give back.
fn scene(
    args: &Args,
    source: &SceneArgs,
    out: &mut dyn Write,
    log: &mut dyn Write,
) -> anyhow::Result<ExitCode> {
    let mut description: Description = source.describe()?;
    description.lights.clear();
    if let Some(estimator) = args.estimator {
        description.sampling.estimator = estimator.into();
    }
    description.world = Some(World::Constant {
        hidden_from: Vec::new(),
        color: [1.0; 3],
        strength: 1.0,
    });
    let resolved = source.resolve(&description, log)?;
    let result = rendered::render_furnace(&resolved.scene, resolved.settings, args.spp, args.seed)?;
    if args.json {
        writeln!(out, "{}", result.to_json())?;
    } else {
        writeln!(
            out,
            "{} pixels see a surface; they give back {:.6} ± {:.6} of the light, {:.6} the least and {:.6} the most",
            result.pixels, result.mean, result.se, result.least, result.most
        )?;
    }
    Ok(ExitCode::SUCCESS)
}
