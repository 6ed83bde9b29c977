//! What the commands that take a scene file share.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use smithwalk::description::{Description, Frame, ViewTransform};
use smithwalk::image::{Display, Lut};
use smithwalk::memory::Budget;
use smithwalk::scene::{RenderSettings, ResolveError, Resolved, Stage, resolve_within};
use smithwalk::text::bounded;

/// How the scene's PNG files look.
pub fn display(description: &Description) -> anyhow::Result<Display> {
    let film = &description.film;
    let read = |view: &ViewTransform| Lut::read(&description.resolve_path(&view.lut), view.log2);
    Ok(Display {
        exposure: film.exposure,
        lut: film.view.as_ref().map(read).transpose()?,
    })
}

/// In bytes; longer warnings are cut.
const MAX_WARNING: usize = 2000;

/// A scene file and changes to it.
#[derive(clap::Args)]
pub struct SceneArgs {
    /// The scene file
    pub scene: PathBuf,
    /// Change a value of the scene file, e.g. -D materials.gold.conductor.roughness=0.3
    #[arg(short = 'D', value_name = "PATH=VALUE", value_parser = parse_override)]
    pub overrides: Vec<(String, String)>,
    /// Refuse what takes more memory, e.g. 8e9 [default: what the machine has]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes)]
    pub memory: Option<u64>,
}

fn parse_bytes(text: &str) -> Result<u64, String> {
    let number = text.parse::<f64>().ok();
    number
        .filter(|bytes| (1.0..1e18).contains(bytes))
        .map(|bytes| bytes as u64)
        .ok_or_else(|| "expected a number of bytes, e.g. 8e9".to_owned())
}

pub fn parse_override(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((path, value)) if !path.is_empty() => Ok((path.to_owned(), value.to_owned())),
        _ => Err("expected PATH=VALUE, e.g. sampling.spp=16".to_owned()),
    }
}

impl SceneArgs {
    /// Reads and checks the scene file.
    pub fn describe(&self) -> anyhow::Result<Description> {
        Ok(Description::load(&self.scene, &self.overrides)?)
    }

    /// Builds the scene and tells of repairs.
    pub fn resolve(
        &self,
        description: &Description,
        log: &mut dyn Write,
    ) -> anyhow::Result<Resolved> {
        self.resolve_beside(description, RenderSettings::new(description).memory(), log)
    }

    /// As [`SceneArgs::resolve`], if the scene and a film of so many bytes fit into
    /// the memory.
    pub fn resolve_beside(
        &self,
        description: &Description,
        film: u64,
        log: &mut dyn Write,
    ) -> anyhow::Result<Resolved> {
        let resolve = |budget: &Budget| resolve_within(description, budget);
        self.within(0, description, film, log, resolve)
    }

    /// As [`SceneArgs::resolve_beside`], the scene of a frame, with what the stage has of
    /// others.
    pub fn resolve_frame(
        &self,
        frame: &Frame,
        stage: &mut Stage,
        film: u64,
        log: &mut dyn Write,
    ) -> anyhow::Result<Resolved> {
        let held = stage.memory();
        let resolve = |budget: &Budget| stage.resolve(frame, budget);
        self.within(held, &frame.description, film, log, resolve)
    }

    fn within(
        &self,
        held: u64,
        description: &Description,
        film: u64,
        log: &mut dyn Write,
        resolve: impl FnOnce(&Budget) -> Result<Resolved, ResolveError>,
    ) -> anyhow::Result<Resolved> {
        let context = || format!("{} can't be rendered", self.scene.display());
        let [width, height] = [description.film.width, description.film.height];
        // What the machine has left is beside what this process holds.
        let (budget, held) = match self.memory {
            Some(limit) => (Budget::new(limit), held),
            None => (Budget::of_machine(), 0),
        };
        budget
            .take(held, "what frames have in common")
            .and_then(|()| budget.take(film, format!("a film of {width} × {height} pixels")))
            .with_context(context)?;
        let resolved = resolve(&budget).with_context(context)?;
        for repair in &resolved.repairs {
            writeln!(log, "warning: {}", bounded(repair, MAX_WARNING))?;
        }
        Ok(resolved)
    }
}
