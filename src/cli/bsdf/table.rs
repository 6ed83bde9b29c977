//! `smithwalk bsdf table`.

use std::cell::OnceCell;
use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, bail};
use serde_json::json;
use smithwalk::description::Estimator;
use smithwalk::image::{Display, OutputPath, check_output, replace};
use smithwalk::tables::{AngleTable, Angles, Rgl, Source, merl, rgl};

use super::MaterialArgs;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    material: MaterialArgs,
    /// File to write, once or more: .npz and .exr hold f over (θ_i, θ_o, φ) with
    /// standard errors; .bsdf is a measured material for Mitsuba (RGL), .binary one of MERL
    #[arg(short, long, value_name = "FILE", required = true, value_parser = parse_output)]
    output: Vec<Output>,
    /// Estimates per value
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..=1_000_000_000))]
    samples: u32,
    /// .npz, .exr: numbers of angles θ_i in 0…90°, θ_o in 0…90° (and as many below
    /// where light goes through), φ in 0…180°
    #[arg(long, value_name = "N,N,N", default_value = "18,18,37", value_parser = parse_angles)]
    angles: Angles,
    /// .bsdf: number of angles θ_i, and of points along either side of a slice
    #[arg(long, value_name = "N,N", default_value = "32,64", value_parser = parse_rgl)]
    rgl: Rgl,
}

#[derive(Clone, Copy)]
enum Format {
    Npz,
    Exr,
    Rgl,
    Merl,
}

#[derive(Clone)]
struct Output {
    path: PathBuf,
    format: Format,
}

fn parse_output(text: &str) -> Result<Output, String> {
    let path = PathBuf::from(text);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let format = match extension.to_ascii_lowercase().as_str() {
        "npz" => Format::Npz,
        "exr" => Format::Exr,
        "bsdf" => Format::Rgl,
        "binary" => Format::Merl,
        _ => return Err("expected a name that ends in .npz, .exr, .bsdf or .binary".to_owned()),
    };
    Ok(Output { path, format })
}

/// As many numbers as there are names, each from `least` to 1024.
fn counts<const N: usize>(text: &str, least: [usize; N]) -> Result<[usize; N], String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    let numbers: [usize; N] = numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| format!("expected {N} whole numbers with commas between"))?;
    match numbers
        .iter()
        .zip(least)
        .find(|(n, least)| !(*least..=1024).contains(*n))
    {
        Some((n, least)) => Err(format!("expected numbers from {least} to 1024, found {n}")),
        None => Ok(numbers),
    }
}

fn parse_angles(text: &str) -> Result<Angles, String> {
    let [theta_i, theta_o, phi] = counts(text, [1, 1, 2])?;
    Ok(Angles {
        theta_i,
        theta_o,
        phi,
    })
}

fn parse_rgl(text: &str) -> Result<Rgl, String> {
    let [theta_i, side] = counts(text, [2, 2])?;
    Ok(Rgl { theta_i, side })
}

/// Writes the files, and one object that has for each its `file` and, where the format
/// holds them, `relative_error`, the standard errors' root mean square over that of the
/// values.
pub fn run(args: &Args, out: &mut dyn Write) -> anyhow::Result<()> {
    let material = args.material.compile(Estimator::Auto)?;
    let source = Source::new(&material, args.samples, args.material.seed)?;
    for output in &args.output {
        check_output(&output.path)?;
        if source.transmits() && matches!(output.format, Format::Rgl | Format::Merl) {
            bail!(smithwalk::tables::TableError::Transmits);
        }
    }
    let texts = [
        ("material", args.material.material.clone()),
        ("samples", args.samples.to_string()),
        ("seed", args.material.seed.to_string()),
        ("smithwalk", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    let table = OnceCell::new();
    let angles = || table.get_or_init(|| AngleTable::measure(&source, args.angles));
    let mut written = Vec::new();
    for Output { path, format } in &args.output {
        let mut entry = json!({ "file": path });
        if matches!(format, Format::Npz | Format::Exr) {
            entry["relative_error"] = angles().relative_error().into();
        }
        match format {
            Format::Npz => replace(path, &angles().npz(&texts).context("the archive")?)?,
            Format::Exr => {
                OutputPath::new(path)?.write(&angles().image(&texts), &Display::default())?
            }
            Format::Rgl => replace(path, &rgl(&source, args.rgl, &args.material.material)?)?,
            Format::Merl => replace(path, &merl(&source)?)?,
        }
        written.push(entry);
    }
    let report = json!({ "tables": written, "samples": args.samples });
    writeln!(out, "{report}")?;
    Ok(())
}
