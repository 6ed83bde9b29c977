//! `smithwalk bsdf`: measurements of one material, for scripts.

mod albedo;
mod eval;
mod sample;
mod table;
mod tail;

use std::io::Write;
use std::process::ExitCode;

use anyhow::ensure;
use glam::Vec3;
use smithwalk::description::{self, Estimator};
use smithwalk::scene::{Material, compile_alone};
use smithwalk_model::Stream;

#[derive(clap::Subcommand)]
pub enum Command {
    /// Directional albedo: what share of the light comes back, and how often it met a facet
    Albedo(albedo::Args),
    /// f·|cosθ_i| for a pair of directions, in sr⁻¹
    Eval(eval::Args),
    /// Sampled directions with weights
    Sample(sample::Args),
    /// Tables for other programs: npz, EXR, measured materials of RGL and MERL
    Table(table::Args),
}

pub fn run(
    command: &Command,
    out: &mut dyn Write,
    log: &mut dyn Write,
) -> anyhow::Result<ExitCode> {
    match command {
        Command::Albedo(args) => albedo::run(args, out)?,
        Command::Eval(args) => eval::run(args, out, log)?,
        Command::Sample(args) => sample::run(args, out)?,
        Command::Table(args) => table::run(args, out)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// What all measurements take.
#[derive(clap::Args)]
struct MaterialArgs {
    /// A material as in a scene file, e.g. 'conductor: {distribution: ggx, alpha: 0.5}'
    #[arg(long, value_name = "YAML")]
    material: String,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// JSON on one line; the only format there is
    #[arg(long)]
    json: bool,
}

impl MaterialArgs {
    fn compile(&self, estimator: Estimator) -> anyhow::Result<Material> {
        let material = description::Material::from_yaml(&self.material)?;
        let compiled = compile_alone(&material, estimator)?;
        ensure!(!compiled.emits(), "an emissive material does not scatter");
        Ok(compiled)
    }

    fn rng(&self, stream: u64) -> Stream<rand_pcg::Pcg64Mcg> {
        use rand::SeedableRng;
        let seed = self
            .seed
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .wrapping_add(stream);
        Stream(rand_pcg::Pcg64Mcg::seed_from_u64(seed))
    }
}

fn parse_direction(text: &str) -> Result<Vec3, String> {
    let parts: Vec<f32> = text
        .split(',')
        .map(|part| {
            part.trim()
                .parse()
                .map_err(|_| format!("`{part}` is no number"))
        })
        .collect::<Result<_, _>>()?;
    let [x, y, z] = parts[..] else {
        return Err("expected three numbers, x,y,z".to_owned());
    };
    let direction = Vec3::new(x, y, z).as_dvec3().try_normalize();
    let direction = direction.ok_or_else(|| "the direction has no length".to_owned())?;
    if direction.z.abs() <= LEVEL {
        return Err(format!(
            "the direction is level: materials scatter nothing within {LEVEL:e} of the horizon"
        ));
    }
    Ok(direction.as_vec3())
}

/// Materials take directions of this cosine and below as inside the surface.
const LEVEL: f64 = 1e-7;

/// The most samples that a command takes: those of days.
const MOST_SAMPLES: u64 = 100_000_000_000;
