//! Makes the released tables of `docs/tables`.
//!
//! ```text
//! cargo run --release -p smithwalk-validation --example tables -- docs/tables 1e-4
//! ```
//!
//! The number is the largest standard error that a value may have.

use std::path::Path;
use std::time::Instant;

use smithwalk_validation::tables::{ALBEDO_HEADER, Shares, cases, measured, orders_header};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [folder, error] = [1, 2].map(|n| std::env::args().nth(n));
    let folder = folder.ok_or("expected a folder")?;
    let folder = Path::new(&folder);
    let error: f64 = error.ok_or("expected a standard error")?.parse()?;
    std::fs::create_dir_all(folder)?;
    let begin = Instant::now();
    let rows = measured(&cases(), error);
    let worst = rows.iter().map(Shares::worst).fold(0.0, f64::max);
    let title = |what: &str| {
        format!(
            "# smithwalk {}: {what}; standard errors at most {worst:.1e}\n",
            env!("CARGO_PKG_VERSION"),
        )
    };
    let orders = rows.iter().map(|row| row.line() + "\n");
    let text = title("shares of the light by order, white facets")
        + &orders_header()
        + "\n"
        + &orders.collect::<String>();
    std::fs::write(folder.join("orders.csv"), text)?;
    let albedos = rows.iter().flat_map(Shares::albedos);
    let text = title("albedos, for `smithwalk conform --against`")
        + ALBEDO_HEADER
        + "\n"
        + &albedos.map(|line| line + "\n").collect::<String>();
    std::fs::write(folder.join("albedo.csv"), text)?;
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "{} cases, standard errors at most {worst:.1e}, {seconds:.0} s",
        rows.len()
    );
    Ok(())
}
