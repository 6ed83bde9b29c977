//! `smithwalk film`: what a saved film holds.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;
use smithwalk::film::SavedFilm;

#[derive(clap::Args)]
pub struct Args {
    /// The film
    film: PathBuf,
    /// For scripts
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, out: &mut dyn Write) -> anyhow::Result<ExitCode> {
    let SavedFilm { header, film, .. } = SavedFilm::read(&args.film)?;
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
            "spp": samples.count(), "target": header.target,
            "samples": ranges.collect::<Vec<_>>(),
            "share": [share.start, share.end.min(header.target)],
            "aovs": aovs, "noise": noise,
            "faults": film.faults().iter().map(|f| f.samples).sum::<u64>(),
            "identity": header.identity,
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
    let (count, target) = (samples.count(), header.target);
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
    super::render::tell_faults(out, &film)?;
    for (name, value) in &header.identity {
        writeln!(out, "  {name}: {value}")?;
    }
    Ok(ExitCode::SUCCESS)
}
