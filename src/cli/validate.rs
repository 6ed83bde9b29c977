//! `smithwalk validate`: the microsurface model against what must hold for it.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use serde_json::json;
use smithwalk::report::validate::{Effort, validate};

#[derive(clap::Args)]
pub struct Args {
    /// Directory for the page with figures (validate.html) and validate.json
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// The corners of the grid, with few samples: seconds in place of minutes
    #[arg(long)]
    quick: bool,
    /// For scripts
    #[arg(long)]
    json: bool,
}

/// Exit code 1 when a statement does not hold.
pub fn run(args: &Args, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<ExitCode> {
    if let Some(directory) = &args.output {
        std::fs::create_dir_all(directory)
            .with_context(|| format!("cannot make the directory {}", directory.display()))?;
    }
    let effort = if args.quick {
        Effort::Quick
    } else {
        Effort::Full
    };
    let report = validate(effort, &mut |statement| {
        let verdict = if statement.passed() { "holds" } else { "FAILS" };
        // A log that can't be written to is no reason to stop.
        let _ = writeln!(
            log,
            "{:>2} {verdict}: {}",
            statement.number, statement.title
        );
    })?;
    let summary = json!({ "passed": report.passed(), "report": report });
    if let Some(directory) = &args.output {
        let files = [
            ("validate.html", report.to_html()),
            ("validate.json", format!("{summary:#}\n")),
        ];
        for (name, text) in files {
            let path = directory.join(name);
            std::fs::write(&path, text)
                .with_context(|| format!("cannot write {}", path.display()))?;
            writeln!(log, "{}", path.display())?;
        }
    }
    if args.json {
        writeln!(out, "{summary}")?;
    } else {
        write!(out, "{}", report.to_text())?;
    }
    Ok(if report.passed() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}
