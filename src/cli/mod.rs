//! The subcommands, one file each.

mod bsdf;
mod conform;
mod converge;
mod diff;
mod film;
mod furnace;
mod info;
mod merge;
mod render;
mod scene;
mod validate;

use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use smithwalk::text::bounded;

/// Renders Blender scenes with multiple-scattering microfacet materials, and
/// measures those materials.
#[derive(Parser)]
#[command(version, about, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene to EXR or PNG
    Render(render::Args),
    /// Put films that are parts of one render together to an image
    Merge(merge::Args),
    /// Show what a saved film holds
    Film(film::Args),
    /// Show what a scene uses, what is left out, and what each costs
    Info(info::Args),
    /// Compare two images
    Diff(diff::Args),
    /// Measure the error against samples and time, for several estimators
    Converge(converge::Args),
    /// White furnace: what share of the light each material gives back
    Furnace(furnace::Args),
    /// Test the microsurface model against what must hold for it
    Validate(validate::Args),
    /// Judge somebody's table of albedos or of f by the model, row by row
    Conform(conform::Args),
    /// Measure a material
    #[command(subcommand)]
    Bsdf(bsdf::Command),
}

impl Cli {
    /// Runs the command; results go to `out`, remarks to `log`.
    pub fn run(&self, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<ExitCode> {
        match &self.command {
            Command::Render(args) => render::run(args, out, log),
            Command::Merge(args) => merge::run(args, out, log),
            Command::Film(args) => film::run(args, out),
            Command::Info(args) => info::run(args, out, log),
            Command::Diff(args) => diff::run(args, out),
            Command::Converge(args) => converge::run(args, out, log),
            Command::Furnace(args) => furnace::run(args, out, log),
            Command::Validate(args) => validate::run(args, out, log),
            Command::Conform(args) => conform::run(args, out),
            Command::Bsdf(command) => bsdf::run(command, out, log),
        }
    }
}

/// In bytes: room for all that is wrong with a scene.
const MAX_ERROR: usize = 1 << 16;

/// An error and its causes, each once: many errors name theirs already.
pub fn told(error: &anyhow::Error) -> String {
    let mut said = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if said.is_empty() {
            said = cause;
        } else if !said.contains(&cause) {
            said = format!("{said}: {cause}");
        }
    }
    bounded(&said, MAX_ERROR)
}

/// Whether the error is the reader of our output having gone away.
pub fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<std::io::Error>())
        .any(|io| io.kind() == std::io::ErrorKind::BrokenPipe)
}
