//! `smithwalk film`: what a saved film holds.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;
use smithwalk::film::SavedFilm;
use smithwalk::image::{Display, Log2};

#[derive(clap::Args)]
pub struct Args {
    /// The film
    film: PathBuf,
    /// For scripts
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, out: &mut dyn Write) -> anyhow::Result<ExitCode> {
    let SavedFilm { origin, film, .. } = SavedFilm::read(&args.film)?;
    let display = origin.finish.as_ref().map(|finish| &finish.display);
    let (window, [width, height]) = (film.window(), film.resolution());
    let samples = film.common();
    let most = film.tiles().iter().map(|tile| tile.taken().count()).max();
    let aovs: Vec<_> = film.aovs().iter().map(|aov| aov.name()).collect();
    let noise = film.relative_error();
    if args.json {
        let ranges = samples.ranges().iter().map(|r| [r.start, r.end]);
        let share = film.share();
        let report = json!({
            "width": width, "height": height,
            "window": [window.x, window.y, window.x + window.width, window.y + window.height],
            "spp": samples.count(), "target": origin.target,
            "samples": ranges.collect::<Vec<_>>(),
            "share": [share.start, share.end.min(origin.target)],
            "aovs": aovs, "noise": noise,
            "scene": origin.finish.as_ref().map(|finish| &finish.scene),
            "display": display.map(|display| json!({
                "exposure": shortest(display.exposure),
                "view": display.lut.as_ref().map(|lut| {
                    let Log2 { offset, min, max } = lut.domain();
                    let [offset, min, max] = [offset, min, max].map(shortest);
                    let log2 = json!({ "offset": offset, "min": min, "max": max });
                    json!({ "nodes": lut.side(), "log2": log2 })
                }),
            })),
            "faults": film.faults().iter().map(|f| f.samples).sum::<u64>(),
            "identity": origin.identity,
        });
        writeln!(out, "{report:#}")?;
        return Ok(ExitCode::SUCCESS);
    }
    writeln!(
        out,
        "{width} × {height} pixels, columns {}–{} and rows {}–{}",
        window.x,
        window.x + window.width - 1,
        window.y,
        window.y + window.height - 1
    )?;
    let (count, target) = (samples.count(), origin.target);
    writeln!(out, "{count} of {target} samples per pixel: {samples}")?;
    if let Some(most) = most.filter(|&most| most > count) {
        writeln!(out, "up to {most} where the render was interrupted")?;
    }
    if let Some(noise) = noise {
        writeln!(out, "estimated relative error {noise:.4}")?;
    }
    if !aovs.is_empty() {
        writeln!(out, "with {}", aovs.join(", "))?;
    }
    match display {
        Some(Display { exposure, lut }) => {
            let view = lut.as_ref().map_or("sRGB".to_owned(), |lut| {
                format!("a table of {}³ colours", lut.side())
            });
            writeln!(out, "PNGs: exposure {exposure}, {view}")?;
        }
        None => writeln!(out, "PNGs: sRGB, since the film is of an older format")?,
    }
    super::render::tell_faults(out, &film)?;
    for (name, value) in &origin.identity {
        writeln!(out, "  {name}: {value}")?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The number whose digits are the fewest that tell `x`: 0.7 is not to become 0.699999988.
fn shortest(x: f32) -> f64 {
    x.to_string().parse().expect("digits of a number")
}
