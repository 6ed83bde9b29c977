//! The files that a render writes.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use smithwalk::film::{Film, Identity, sidecar_path};
use smithwalk::image::{OutputPath, check_output};

use super::Part;

/// Where image and film go.
pub struct Outputs {
    /// The images, each checked beforehand so that no finished render is lost.
    pub images: Vec<OutputPath>,
    /// The film: checkpoints, and where an interrupted render goes on from.
    pub film: PathBuf,
    /// Whether it stays when the render is complete.
    keep: bool,
}

impl Outputs {
    /// The files that were asked for, or else those named like the scene.
    pub fn new(
        scene: &Path,
        asked: &[PathBuf],
        part: Option<Part>,
        resume: bool,
    ) -> anyhow::Result<Self> {
        let stem = PathBuf::from(scene.file_stem().context("the scene file has no name")?);
        let paths = match part {
            _ if !asked.is_empty() => asked.to_vec(),
            Some(part) => {
                let kind = format!("{}-of-{}.film", part.index, part.count);
                vec![stem.with_extension(kind)]
            }
            None => ["exr", "png"].map(|kind| stem.with_extension(kind)).into(),
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
        for image in &images {
            image.check()?;
        }
        let named = films.into_iter().next();
        let keep = named.is_some() || part.is_some() || resume;
        let film = match (named, images.first()) {
            (Some(film), _) => film,
            (None, Some(image)) => sidecar_path(image.path()),
            (None, None) => unreachable!("there is an output"),
        };
        check_output(&film)?;
        Ok(Self { images, film, keep })
    }

    /// Saves the film if it is to stay, and else removes what checkpoints or an earlier
    /// run have left: a later --resume would go on from it.
    pub fn keep_film(
        &self,
        film: &Film,
        identity: &Identity,
        target: u32,
        interrupted: bool,
    ) -> anyhow::Result<()> {
        if self.stays(interrupted) {
            film.save(&self.film, identity, target)?;
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
    pub fn rescue(&self, film: &Film, identity: &Identity, target: u32) -> String {
        let name = format!("smithwalk-{}.film", std::process::id());
        let place = std::env::temp_dir().join(name);
        match film.save(&place, identity, target) {
            Ok(()) => format!("all samples are in {}", place.display()),
            Err(error) => error.to_string(),
        }
    }

    /// What there is now.
    pub fn written(&self, interrupted: bool) -> impl Iterator<Item = &Path> {
        let film = self.stays(interrupted).then_some(self.film.as_path());
        self.images.iter().map(OutputPath::path).chain(film)
    }
}
