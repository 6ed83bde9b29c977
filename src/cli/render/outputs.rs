//! The files that a render writes.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use smithwalk::film::{Film, Origin, sidecar_path};
use smithwalk::image::{OutputPath, check_output, read_exr};
use smithwalk::numbered::Numbered;

use super::{Args, COMPLETE};

/// Where image and film go.
pub struct Outputs {
    /// The images, each checked beforehand so that no finished render is lost.
    pub images: Vec<OutputPath>,
    /// The same without noise, if asked for.
    pub denoised: Vec<OutputPath>,
    /// The film: checkpoints, and where an interrupted render goes on from.
    pub film: PathBuf,
    /// Whether it stays when the render is complete.
    keep: bool,
}

impl Outputs {
    /// The files that were asked for, or else those named like the scene; of a frame,
    /// those with its number.
    pub fn new(args: &Args, frame: Option<i32>) -> anyhow::Result<Self> {
        let scene = &args.scene.scene;
        let mut stem = scene
            .file_stem()
            .context("the scene file has no name")?
            .to_owned();
        if let Some(frame) = frame {
            stem.push("_");
            stem.push(Numbered::new("####")?.at(frame));
        }
        let stem = PathBuf::from(stem);
        let paths = match (args.part, frame) {
            (_, Some(frame)) if !args.output.is_empty() => {
                let only = args.frames.as_ref().is_some_and(|f| f.start() == f.end());
                let paths = args.output.iter().map(|path| numbered(path, frame, only));
                paths.collect::<anyhow::Result<_>>()?
            }
            _ if !args.output.is_empty() => args.output.clone(),
            (Some(part), _) => {
                let kind = format!("{}-of-{}.film", part.index, part.count);
                vec![stem.with_extension(kind)]
            }
            (None, _) => ["exr", "png"].map(|kind| stem.with_extension(kind)).into(),
        };
        let is_film = |path: &PathBuf| path.extension().is_some_and(|kind| kind == "film");
        let (films, images): (Vec<_>, Vec<_>) = paths.into_iter().partition(is_film);
        ensure!(
            films.len() <= 1,
            "{} and {} are both films; one is enough",
            films[0].display(),
            films[1].display()
        );
        let images = images.into_iter().map(OutputPath::new);
        let images = images.collect::<Result<Vec<_>, _>>()?;
        let without_noise = |image: &OutputPath| {
            let kind = image.path().extension().unwrap_or_default();
            let kind = Path::new("denoised").with_extension(kind);
            OutputPath::new(image.path().with_extension(kind))
        };
        let denoised = if args.denoise {
            images.iter().map(without_noise).collect::<Result<_, _>>()?
        } else {
            Vec::new()
        };
        for image in images.iter().chain(&denoised) {
            image.check()?;
        }
        let named = films.into_iter().next();
        // Of a frame, the image says that it is complete.
        let resume = args.resume && frame.is_none();
        let keep = named.is_some() || args.part.is_some() || resume;
        let film = match (named, images.first()) {
            (Some(film), _) => film,
            (None, Some(image)) => sidecar_path(image.path()),
            (None, None) => unreachable!("there is an output"),
        };
        check_output(&film)?;
        Ok(Self {
            images,
            denoised,
            film,
            keep,
        })
    }

    /// What the film that the render goes on from takes, in bytes: it is there before the
    /// pilots, which a fresh one comes after.
    pub fn resumed_bytes(&self, args: &Args) -> u64 {
        let film = args.resume.then(|| std::fs::metadata(&self.film));
        film.map_or(0, |film| film.map_or(0, |film| film.len()))
    }

    /// Whether all images are there, and one of them says that it is complete by this
    /// mark. A film that is there is of an interrupted render.
    pub fn are_complete(&self, mark: &str) -> bool {
        let says_so = |output: &OutputPath| {
            let path = output.path();
            path.extension().is_some_and(|kind| kind == "exr")
                && read_exr(path).is_ok_and(|image| image.attribute(COMPLETE) == Some(mark))
        };
        !self.keep
            && !self.film.exists()
            && self.all_images().all(|output| output.path().exists())
            && self.images.iter().any(says_so)
    }

    /// Saves the film if it is to stay, and else removes what checkpoints or an earlier
    /// run have left: a later --resume would go on from it.
    pub fn keep_film(&self, film: &Film, origin: &Origin, interrupted: bool) -> anyhow::Result<()> {
        if self.stays(interrupted) {
            film.save(&self.film, origin)?;
        } else if self.film.exists() {
            let path = self.film.display();
            std::fs::remove_file(&self.film).with_context(|| format!("can't remove {path}"))?;
        }
        Ok(())
    }

    fn stays(&self, interrupted: bool) -> bool {
        self.keep || interrupted
    }

    /// Saves the film elsewhere when an output can't be written; says where.
    pub fn rescue(&self, film: &Film, origin: &Origin) -> String {
        let name = format!("smithwalk-{}.film", std::process::id());
        let place = std::env::temp_dir().join(name);
        match film.save(&place, origin) {
            Ok(()) => format!("all samples are in {}", place.display()),
            Err(error) => error.to_string(),
        }
    }

    /// What there is now.
    pub fn written(&self, interrupted: bool) -> impl Iterator<Item = &Path> {
        let film = self.stays(interrupted).then_some(self.film.as_path());
        self.all_images().map(OutputPath::path).chain(film)
    }

    fn all_images(&self) -> impl Iterator<Item = &OutputPath> {
        self.images.iter().chain(&self.denoised)
    }
}

/// The name of a frame's file; one without a place for the number does for the only
/// frame.
fn numbered(path: &Path, frame: i32, only: bool) -> anyhow::Result<PathBuf> {
    let name = path
        .to_str()
        .context("expected the name of an output in UTF-8")?;
    match Numbered::new(name) {
        Ok(name) => Ok(name.at(frame)),
        Err(_) if only => Ok(path.to_owned()),
        Err(error) => Err(error).context("several frames can't be written to one file"),
    }
}
