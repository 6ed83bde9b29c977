//! `smithwalk diff`: how far an image is from its reference.

mod html;

use std::borrow::Cow;
use std::ffi::OsStr;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use smithwalk::image::{OutputPath, check_output, read_exr, replace};
use smithwalk::metrics::{
    Comparison, DifferenceMap, FALSE_ALARM_RATE, OUTLIER, Outliers, Pair, ZTest,
};

/// Compare an image with its reference.
///
/// Reads the OpenEXR files of `smithwalk render` and of Blender. Exits with 1
/// when a bound is passed or a pixel is not finite, with 2 when the images
/// can't be compared.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The image
    a: PathBuf,
    /// The reference that it is measured against
    b: PathBuf,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
    /// Write the difference of each pixel as colours: blue where A is darker
    /// than B, red where it is brighter; with --z, z-scores
    #[arg(long, value_name = "MAP.png")]
    out: Option<PathBuf>,
    /// Write a page with both images, maps, pixel values and figures: one file
    #[arg(long, value_name = "REPORT.html")]
    html: Option<PathBuf>,
    /// Largest relative bias to accept, as in 0.005 for 0.5 %
    #[arg(long, value_name = "X", value_parser = bound, allow_negative_numbers = true)]
    max_rel_bias: Option<f64>,
    /// Largest relative mean squared error to accept
    #[arg(long, value_name = "X", value_parser = bound, allow_negative_numbers = true)]
    max_relmse: Option<f64>,
    /// Let the bounds hold for all but the worst 0.1 % of the pixels
    #[arg(long)]
    trimmed: bool,
    /// Test whether noise explains the difference, by the variance layers;
    /// counts as a bound
    #[arg(long)]
    z: bool,
    /// Exposure at which FLIP looks at the images, in stops
    #[arg(
        long,
        value_name = "STOPS",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    exposure: f32,
}

fn bound(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if value >= 0.0 => Ok(value),
        _ => Err("expected a number that is not negative".to_owned()),
    }
}

/// What is printed as JSON.
#[derive(serde::Serialize)]
struct Report<'a> {
    a: &'a Path,
    b: &'a Path,
    #[serde(flatten)]
    figures: &'a Comparison,
    /// The bounds that were passed, as sentences.
    failures: &'a [String],
}

/// Compares, prints to `out` and says by the exit code whether all bounds hold.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<ExitCode> {
    let map_path = args.out.as_deref().map(map_path).transpose()?;
    args.html.as_deref().map(check_output).transpose()?;
    let (a, b) = (read_exr(&args.a)?, read_exr(&args.b)?);
    let pair = Pair::new(&a, &b)
        .with_context(|| format!("{} against {}", args.a.display(), args.b.display()))?;
    let mut figures = pair.compare(args.exposure)?;
    if args.z {
        figures.z = Some(pair.z_test()?);
    }
    let failures = failures(args, &figures);
    if let Some(path) = &args.html {
        let page = html::page(&pair, &figures, names(&args.a, &args.b), args.exposure)?;
        replace(path, page.as_bytes())?;
    }
    if args.json {
        let report = Report {
            a: &args.a,
            b: &args.b,
            figures: &figures,
            failures: &failures,
        };
        serde_json::to_writer_pretty(&mut *out, &report)?;
        writeln!(out)?;
    } else {
        write_table(args, &figures, &failures, out)?;
    }
    if let Some(path) = map_path {
        let map = match args.z {
            true => pair.z_map()?,
            false => pair.difference_map(),
        };
        let window = pair.window();
        path.write_rgb8(&map.pixels, [window.width, window.height])?;
        if !args.json {
            write_legend(args, &map, out)?;
        }
    }
    Ok(match failures.is_empty() {
        true => ExitCode::SUCCESS,
        false => ExitCode::from(1),
    })
}

/// What the images are called on the page: by their files' names, or their paths where
/// those are alike.
fn names<'a>(a: &'a Path, b: &'a Path) -> [Cow<'a, str>; 2] {
    match [a, b].map(|path| path.file_stem().map(OsStr::to_string_lossy)) {
        [Some(a), Some(b)] if a != b => [a, b],
        _ => [a, b].map(Path::to_string_lossy),
    }
}

/// Checks the name and the folder of the map before anything is read.
fn map_path(path: &Path) -> Result<OutputPath> {
    if path
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case("png"))
    {
        bail!(
            "--out {}: expected a name that ends in .png",
            path.display()
        );
    }
    let path = OutputPath::new(path)?;
    path.check()?;
    Ok(path)
}

/// The bounds that don't hold. Written so that NaN fails.
fn failures(args: &Args, figures: &Comparison) -> Vec<String> {
    let mut failures = Vec::new();
    let mut check = |name: &str, value: f64, bound: Option<f64>| {
        if let Some(bound) = bound {
            if value
                .abs()
                .partial_cmp(&bound)
                .is_none_or(|order| order.is_gt())
            {
                failures.push(format!("{name} is {value:.6}, past the bound of {bound}"));
            }
        }
    };
    let (bias, rel_mse) = match args.trimmed {
        true => (figures.rel_bias_trimmed, figures.rel_mse_trimmed),
        false => (figures.rel_bias, figures.rel_mse),
    };
    check("the relative bias", bias, args.max_rel_bias);
    check("relMSE", rel_mse, args.max_relmse);
    if let Some(z) = &figures.z {
        if z.z_failed_pixels > 0 {
            let (count, largest, bound) = (z.z_failed_pixels, z.z_max, z.z_bound);
            failures.push(format!(
                "{count} pixels differ by more than noise: |z| up to {largest:.2}, bound {bound:.2}"
            ));
        }
        if z.z_failed_blocks > 0 {
            let (count, largest, bound) = (z.z_failed_blocks, z.z_block_max, z.z_block_bound);
            failures.push(format!(
                "{count} blocks of 8 × 8 pixels differ by more than noise: \
                 |z| up to {largest:.2}, bound {bound:.2}"
            ));
        }
    }
    if figures.non_finite_pixels > 0 {
        let count = figures.non_finite_pixels;
        failures.push(format!("{count} pixels are infinite or not a number"));
    }
    failures
}

fn write_table(
    args: &Args,
    figures: &Comparison,
    failures: &[String],
    out: &mut dyn Write,
) -> std::io::Result<()> {
    let Comparison { width, height, .. } = figures;
    writeln!(out, "A  {}", args.a.display())?;
    writeln!(out, "B  {}", args.b.display())?;
    writeln!(out, "{width} × {height} pixels compared\n")?;
    writeln!(out, "{:<28}{:>11}{:>11}{:>11}", "", "red", "green", "blue")?;
    for (name, mean) in [("mean of A", figures.mean_a), ("mean of B", figures.mean_b)] {
        let [r, g, b] = mean;
        writeln!(out, "{name:<28}{r:>11.6}{g:>11.6}{b:>11.6}")?;
    }
    let [r, g, b] = figures.rel_bias_rgb.map(|bias| 100.0 * bias);
    writeln!(
        out,
        "{:<28}{r:>+9.3} %{g:>+9.3} %{b:>+9.3} %\n",
        "relative bias"
    )?;

    writeln!(
        out,
        "{:<28}{:>11}{:>22}",
        "", "all pixels", "worst 0.1 % left out"
    )?;
    let percent = |name: &str, all: f64, trimmed: f64, out: &mut dyn Write| {
        let (all, trimmed) = (100.0 * all, 100.0 * trimmed);
        writeln!(out, "{name:<28}{all:>+9.3} %{trimmed:>+20.3} %")
    };
    percent(
        "relative bias",
        figures.rel_bias,
        figures.rel_bias_trimmed,
        out,
    )?;
    let (all, trimmed) = (figures.rel_mse, figures.rel_mse_trimmed);
    writeln!(out, "{:<28}{all:>11.4e}{trimmed:>22.4e}", "relMSE")?;
    let (all, trimmed) = (100.0 * all.sqrt(), 100.0 * trimmed.sqrt());
    writeln!(
        out,
        "{:<28}{all:>9.3} %{trimmed:>20.3} %",
        "relative RMSE (√relMSE)"
    )?;
    writeln!(out, "{:<28}{:>11.4e}", "RMSE", figures.rmse)?;
    writeln!(out, "{:<28}{:>11.4}", "FLIP, 0 to 1", figures.flip)?;
    let pixels = *width as usize * *height as usize;
    let Outliers {
        robust_sd,
        largest_deviation,
        outliers,
    } = figures.outliers;
    writeln!(
        out,
        "{:<28}{largest_deviation:>11.1} robust standard deviations of {:.3} %; {outliers} of {} values beyond {OUTLIER}",
        "largest difference",
        100.0 * robust_sd,
        3 * (pixels - figures.non_finite_pixels),
    )?;
    if let Some(z) = &figures.z {
        write_z(z, out)?;
    }
    if !failures.is_empty() {
        writeln!(out)?;
    }
    for failure in failures {
        writeln!(out, "FAILED: {failure}")?;
    }
    Ok(())
}

fn write_z(z: &ZTest, out: &mut dyn Write) -> std::io::Result<()> {
    let runs = 1.0 / FALSE_ALARM_RATE;
    writeln!(
        out,
        "\nIs it noise? Chance passes each bound in at most 1 of {runs:.0} runs."
    )?;
    writeln!(
        out,
        "{:<28}{:>11}{:>11}{:>11}",
        "", "largest |z|", "bound", "past it"
    )?;
    let rows = [
        ("pixels", z.z_max, z.z_bound, z.z_failed_pixels),
        (
            "blocks of 8 × 8",
            z.z_block_max,
            z.z_block_bound,
            z.z_failed_blocks,
        ),
    ];
    for (name, largest, bound, past) in rows {
        writeln!(out, "{name:<28}{largest:>11.2}{bound:>11.2}{past:>11}")?;
    }
    let [r, g, b] = z.z_mean;
    let name = "z of the mean, r g b";
    writeln!(out, "{name:<28}{r:>+11.2}{g:>+11.2}{b:>+11.2}")?;
    writeln!(
        out,
        "{:<28}{:>11.4}   ({:+.1} σ from 1; below 1: variances overrated)",
        "mean z² (reduced χ²)", z.z_chi2, z.z_chi2_score
    )
}

fn write_legend(args: &Args, map: &DifferenceMap, out: &mut dyn Write) -> std::io::Result<()> {
    let Some(path) = &args.out else { return Ok(()) };
    let scale = match args.z {
        true => format!("|z| ≥ {}", map.full_scale),
        false => format!("{} % of B or more", 100.0 * map.full_scale),
    };
    writeln!(
        out,
        "\n{}: red where A is brighter than B, blue where it is darker,",
        path.display()
    )?;
    writeln!(
        out,
        "white where they agree, full colour at {scale}, green where not finite"
    )
}
