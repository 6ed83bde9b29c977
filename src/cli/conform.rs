//! `smithwalk conform`: somebody's table, judged by the model.

use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use serde_json::json;
use smithwalk::report::conform::{Verdict, Verdicts, read};

/// Judge somebody's table of albedos or of f by the model, row by row.
///
/// FILE is CSV with a header; docs/conform.md has the columns. Exits with 1 when a row,
/// or all rows together, differ from the model by more than their errors explain, with
/// 2 when the table can't be read.
#[derive(clap::Args)]
pub struct Args {
    /// The table
    #[arg(long, value_name = "FILE.csv")]
    against: PathBuf,
    /// Walks or evaluations of the model for each row
    #[arg(long, default_value_t = 1 << 18, value_parser = clap::value_parser!(u32).range(64..=1_000_000_000))]
    samples: u32,
    /// The chance that a table which is right is said to differ, over all its rows
    #[arg(long, value_name = "P", default_value_t = 0.01, value_parser = parse_chance)]
    false_alarm: f64,
    /// What a row may be off by whatever the noise, in units of its value
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = parse_tolerance)]
    tolerance: f64,
    /// For scripts
    #[arg(long)]
    json: bool,
}

fn parse_chance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(p) if p > 0.0 && p < 1.0 => Ok(p),
        _ => Err("expected a number between 0 and 1".to_owned()),
    }
}

fn parse_tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (0.0..f64::INFINITY).contains(&x) => Ok(x),
        _ => Err("expected a number that is not negative".to_owned()),
    }
}

/// Writes the verdicts; as JSON one object whose `rows` have `line`, `note`, `value`,
/// `model`, `error`, `stderr`, `score` and `verdict`.
pub fn run(args: &Args, out: &mut dyn Write) -> anyhow::Result<ExitCode> {
    let name = args.against.display();
    let file = File::open(&args.against).with_context(|| format!("can't read {name}"))?;
    let claims = read(file).with_context(|| name.to_string())?;
    let verdicts = Verdicts::of(claims, args.samples, args.false_alarm, args.tolerance);
    if args.json {
        writeln!(out, "{}", report(&verdicts))?;
    } else {
        print(&verdicts, out)?;
    }
    Ok(if verdicts.conforms() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

fn word(row: &Verdict) -> &'static str {
    if row.differs { "differs" } else { "agrees" }
}

fn report(verdicts: &Verdicts) -> serde_json::Value {
    let row = |row: &Verdict| {
        json!({
            "line": row.claim.line, "note": row.claim.note,
            "value": row.claim.value, "model": row.model,
            "error": row.error, "stderr": row.stderr, "score": row.score,
            "verdict": word(row),
        })
    };
    json!({
        "rows": verdicts.rows.iter().map(row).collect::<Vec<_>>(),
        "differing": verdicts.differing(),
        "chi_square": verdicts.chi_square,
        "p": verdicts.p,
        "differ_together": verdicts.differ_together(),
        "worst": verdicts.worst().map(row),
        "rms": verdicts.rms(),
        "false_alarm": verdicts.false_alarm,
        "tolerance": verdicts.tolerance,
        "conforms": verdicts.conforms(),
    })
}

fn print(verdicts: &Verdicts, out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(
        out,
        "line     value     model     error  ± stderr     score  verdict"
    )?;
    for row in &verdicts.rows {
        writeln!(
            out,
            "{:>4} {:>9.6} {:>9.6} {:>+9.6} ± {:.6} {:>+9.1}  {}  {}",
            row.claim.line,
            row.claim.value,
            row.model,
            row.error,
            row.stderr,
            row.score,
            word(row),
            row.claim.note
        )?;
    }
    let count = verdicts.rows.len();
    writeln!(
        out,
        "\n{} of {count} rows differ, at a false alarm rate of {} over all",
        verdicts.differing(),
        verdicts.false_alarm
    )?;
    if let Some(worst) = verdicts.worst() {
        writeln!(
            out,
            "the largest error is {:+.6} ± {:.6}, in line {}; their root mean square is {:.6}",
            worst.error,
            worst.stderr,
            worst.claim.line,
            verdicts.rms()
        )?;
    }
    writeln!(
        out,
        "all together: χ² = {:.1} of {count} rows, by chance {:.2e}{}",
        verdicts.chi_square,
        verdicts.p,
        if verdicts.differ_together() {
            ": they differ, one or many"
        } else {
            ""
        }
    )
}
