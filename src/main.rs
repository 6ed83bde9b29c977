//! The `smithwalk` command.

mod cli;

use std::process::ExitCode;

use clap::Parser;

/// An Embree path tracer whose rough surfaces keep their energy.
#[derive(Parser)]
#[command(version)]
enum Command {
    Diff(cli::diff::Args),
}

fn main() -> ExitCode {
    let mut out = std::io::stdout().lock();
    let result = match Command::parse() {
        Command::Diff(args) => cli::diff::run(&args, &mut out),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(2)
    })
}
