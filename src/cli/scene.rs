//! What the commands that take a scene file share.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use smithwalk::description::Description;
use smithwalk::scene::{Resolved, resolve};

/// A scene file and changes to it.
#[derive(clap::Args)]
pub struct SceneArgs {
    /// The scene file
    pub scene: PathBuf,
    /// Change a value of the scene file, e.g. -D materials.gold.conductor.roughness=0.3
    #[arg(short = 'D', value_name = "PATH=VALUE", value_parser = parse_override)]
    pub overrides: Vec<(String, String)>,
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
        let resolved = resolve(description)
            .with_context(|| format!("{} can't be rendered", self.scene.display()))?;
        for repair in &resolved.repairs {
            writeln!(log, "warning: {repair}")?;
        }
        Ok(resolved)
    }
}
