//! The `smithwalk` command: parses, dispatches, sets the exit code. Commands
//! write to the streams they are given and never print by themselves.

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    match cli.run(&mut std::io::stdout().lock(), &mut Remarks) {
        Ok(code) => code,
        // A closed pipe (`| head`) is no failure of ours.
        Err(error) if cli::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", cli::told(&error));
            ExitCode::from(2)
        }
    }
}

/// Standard error, where nobody has to listen: remarks that can't be written must not
/// end a render. Not locked, since progress comes from several threads.
struct Remarks;

impl std::io::Write for Remarks {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let _ = std::io::stderr().write_all(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
