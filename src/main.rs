//! The `smithwalk` command: parses, dispatches, sets the exit code. Commands
//! write to the streams they are given and never print by themselves.

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    match cli.run(&mut std::io::stdout().lock(), &mut std::io::stderr().lock()) {
        Ok(code) => code,
        // A closed pipe (`| head`) is no failure of ours.
        Err(error) if cli::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
