//! `smithwalk merge`: the image of films that are parts of one render.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{bail, ensure};
use smithwalk::film::{Film, FilmError, Finish, Origin, SavedFilm};
use smithwalk::image::{Display, OutputPath, check_output};

use super::render::{COMPLETE, attributes, tell_faults};

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
    /// Exposure of PNG files, in stops [default: the scene's]
    #[arg(long, allow_negative_numbers = true)]
    exposure: Option<f32>,
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
    // PNGs come from films, too.
    let are_shown = !films.is_empty() || images.iter().any(OutputPath::is_png);
    let origin = Origin {
        finish: finish(args, &parts, are_shown, log)?,
        ..first.origin.clone()
    };
    let film = merge(parts)?;

    let samples = film.common();
    let (count, target) = (samples.count(), origin.target);
    if count < target {
        writeln!(
            log,
            "{count} of {target} samples per pixel are there: {samples}"
        )?;
    }
    for path in films {
        film.save(path, &origin)?;
    }
    let mut image = film.develop();
    image.attributes = attributes(&origin, count);
    let finish = origin.finish.as_ref();
    let mut display = finish.map_or_else(Display::default, |finish| finish.display.clone());
    match (finish, args.exposure) {
        (Some(finish), None) if count == target => {
            let mark = (COMPLETE.to_owned(), finish.complete.clone());
            image.attributes.push(mark);
        }
        (_, Some(exposure)) => display.exposure = exposure,
        _ => {}
    }
    for output in &images {
        output.write(&image, &display)?;
    }
    for path in &args.output {
        writeln!(out, "{}", path.display())?;
    }
    writeln!(out, "{count} spp from {} films", args.parts.len())?;
    if let Some(noise) = film.relative_error() {
        writeln!(out, "estimated relative error {noise:.4}")?;
    }
    tell_faults(out, &film)?;
    Ok(ExitCode::SUCCESS)
}

/// Reads all parts and holds them against the first.
fn read(paths: &[PathBuf]) -> anyhow::Result<Vec<SavedFilm>> {
    let mut parts: Vec<SavedFilm> = Vec::new();
    for path in paths {
        let part = SavedFilm::read(path)?;
        if let Some(first) = parts.first() {
            if let Some(difference) = part.difference(first) {
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

/// What images have beside samples: what the first part that says it says. `tells` warns of
/// parts that say otherwise.
fn finish(
    args: &Args,
    parts: &[SavedFilm],
    tells: bool,
    log: &mut dyn Write,
) -> anyhow::Result<Option<Finish>> {
    let first = parts.iter().find(|part| part.origin.finish.is_some());
    let finish = first.and_then(|part| part.origin.finish.clone());
    let look = first.map_or("plain sRGB".to_owned(), |part| {
        format!("as {} says", part.path.display())
    });
    for part in parts.iter().filter(|_| tells) {
        let difference = match (&part.origin.finish, &finish) {
            (Some(theirs), Some(ours)) => display_difference(args, &theirs.display, &ours.display)
                .map(|difference| format!("has {difference}")),
            _ => Some("is of an older format, without exposure and view transform".to_owned()),
        };
        if let Some(difference) = difference {
            let path = part.path.display();
            writeln!(log, "warning: {path} {difference}; PNGs are {look}")?;
        }
    }
    Ok(finish)
}

/// How PNGs look otherwise, for people; `None` where they don't.
fn display_difference(args: &Args, theirs: &Display, ours: &Display) -> Option<String> {
    let (exposure, expected) = (theirs.exposure, ours.exposure);
    let is_asked = args.exposure.is_some();
    let exposure =
        (!is_asked && exposure != expected).then(|| format!("exposure {exposure}, not {expected}"));
    let view = match (&theirs.lut, &ours.lut) {
        (theirs, ours) if theirs == ours => None,
        (None, _) => Some("no view transform".to_owned()),
        (Some(_), None) => Some("a view transform".to_owned()),
        (Some(_), Some(_)) => Some("another view transform".to_owned()),
    };
    let all: Vec<String> = exposure.into_iter().chain(view).collect();
    (!all.is_empty()).then(|| all.join(" and "))
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
