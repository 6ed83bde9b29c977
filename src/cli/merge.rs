//! `smithwalk merge`: the image of films that are parts of one render.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{bail, ensure};
use smithwalk::film::{Film, FilmError, SavedFilm, difference};
use smithwalk::image::{Display, OutputPath, check_output};

#[derive(clap::Args)]
pub struct Args {
    /// Films of the same render, in any order
    #[arg(required = true, value_name = "PART.film")]
    parts: Vec<PathBuf>,
    /// File to write: .exr, .png or .film; may be given several times
    #[arg(
        short,
        long = "output",
        required = true,
        value_name = "OUT.exr|OUT.png|OUT.film"
    )]
    output: Vec<PathBuf>,
    /// Exposure of PNG files, in stops; they are plain sRGB
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
}

pub fn run(args: &Args, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<ExitCode> {
    let is_film = |path: &&PathBuf| path.extension().is_some_and(|kind| kind == "film");
    let (films, images): (Vec<_>, Vec<_>) = args.output.iter().partition(is_film);
    let images: Vec<OutputPath> = images
        .into_iter()
        .map(OutputPath::new)
        .collect::<Result<_, _>>()?;
    for path in &args.output {
        check_output(path)?;
    }
    let parts = read(&args.parts)?;
    let [first, ..] = &parts[..] else {
        bail!("no parts");
    };
    let header = first.header.clone();
    let film = merge(parts)?;

    let samples = film.common();
    let (count, target) = (samples.count(), header.target);
    if count < target {
        writeln!(
            log,
            "{count} of {target} samples per pixel are there: {samples}"
        )?;
    }
    for path in films {
        film.save(path, &header.identity, target)?;
    }
    let mut image = film.develop();
    let known = |name: &str| header.identity.get(name).cloned().unwrap_or_default();
    image.attributes = vec![
        ("smithwalk.version".to_owned(), known("program")),
        ("smithwalk.spp".to_owned(), count.to_string()),
        ("smithwalk.seed".to_owned(), known("seed")),
    ];
    for output in &images {
        output.write(&image, &Display::srgb(args.exposure))?;
    }
    for path in &args.output {
        writeln!(out, "{}", path.display())?;
    }
    writeln!(out, "{count} spp from {} films", args.parts.len())?;
    if let Some(noise) = film.relative_error() {
        writeln!(out, "estimated relative error {noise:.4}")?;
    }
    super::render::tell_faults(out, &film)?;
    Ok(ExitCode::SUCCESS)
}

/// Reads all parts and holds them against the first.
fn read(paths: &[PathBuf]) -> anyhow::Result<Vec<SavedFilm>> {
    let mut parts: Vec<SavedFilm> = Vec::new();
    for path in paths {
        let part = SavedFilm::read(path)?;
        if let Some(first) = parts.first() {
            let difference = difference(&part.header.identity, &first.header.identity)
                .or_else(|| part.header.layout_difference(&first.header));
            if let Some(difference) = difference {
                let path = path.clone();
                let error = FilmError::OtherRender { path, difference };
                let first = first.path.display();
                return Err(anyhow::Error::new(error).context(format!("can't go with {first}")));
            }
        }
        parts.push(part);
    }
    Ok(parts)
}

fn merge(parts: Vec<SavedFilm>) -> anyhow::Result<Film> {
    let (paths, mut films): (Vec<_>, Vec<_>) =
        parts.into_iter().map(|part| (part.path, part.film)).unzip();
    let taken: Vec<_> = films.iter().map(Film::common).collect();
    let mut film = films.remove(0);
    if let Err([a, b]) = film.merge(&films) {
        ensure!(
            paths[a] != paths[b],
            "{} is given twice",
            paths[a].display()
        );
        bail!(
            "{} and {} have samples in common: {} and {}",
            paths[a].display(),
            paths[b].display(),
            taken[a],
            taken[b]
        );
    }
    Ok(film)
}
