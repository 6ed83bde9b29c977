//! Albedos of the model beside those of Blender's Cycles 3.4 and 4.5, over
//! roughness and angle: the tables and figures of `docs/albedo.md`.
//!
//! ```text
//! cargo run --example albedo_against_cycles -- docs/images
//! ```
//!
//! Prints the tables, and writes the figures to the folder that is named.
//! Cycles' values come from `tests/data`, measured by
//! `blender/measure_albedo.py`; the model's are computed here, in f64.

#[path = "../tests/cycles/measured.rs"]
mod measured;

use std::error::Error;
use std::path::{Path, PathBuf};

use measured::{GOLD, Glass, Mean, Metal, means, rows};
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use smithwalk::report::plot::{Axis, Chart, Mark, Series};
use smithwalk_model::*;

/// Points of each of 16 Sobol sets, for every albedo.
const POINTS: u32 = 16_384;

/// The rows that are printed; figures have all.
const PRINTED: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];

/// An albedo three times.
struct Row {
    roughness: f64,
    cos: f64,
    exact: Mean,
    cycles_3_4: Mean,
    cycles_4_5: Mean,
}

/// The rows of both versions' files of a `kind` that `keep` wants, in pairs.
fn pairs<R: DeserializeOwned>(kind: &str, keep: impl Fn(&R) -> bool) -> Vec<[R; 2]> {
    let [old, new] = ["3.4", "4.5"].map(|version| {
        let mut rows: Vec<R> = rows(&format!("cycles_{version}_albedo_{kind}.csv"));
        rows.retain(&keep);
        rows
    });
    assert_eq!(old.len(), new.len());
    old.into_iter().zip(new).map(|(o, n)| [o, n]).collect()
}

/// Gold's green channel.
fn metal() -> Vec<Row> {
    let isotropic = |r: &Metal| r.distribution == "MULTI_GGX" && r.anisotropy == 0.0;
    let rows = pairs("conductor", isotropic).into_par_iter();
    let rows = rows.map(|[old, new]| {
        assert_eq!((old.roughness, old.cos), (new.roughness, new.cos));
        let (alpha_x, alpha_y) = old.alpha();
        let surface = Microsurface {
            ndf: Ggx { alpha_x, alpha_y },
            facets: Conductor {
                fresnel: ConductorFresnel::Constant(Rgb(GOLD)),
            },
        };
        let [exact] = means(POINTS, |rng| {
            let exit = surface.sample(old.view(), rng);
            [exit.map_or(0.0, |exit| exit.weight.0[1])]
        });
        Row {
            roughness: old.roughness,
            cos: old.cos,
            exact,
            cycles_3_4: old.measured()[1],
            cycles_4_5: new.measured()[1],
        }
    });
    rows.collect()
}

/// Reflectance of glass from one side.
fn glass(side: &str) -> Vec<Row> {
    let on_side = |r: &Glass| r.distribution == "MULTI_GGX" && r.side == side;
    let rows = pairs("dielectric", on_side).into_par_iter();
    let rows = rows.map(|[old, new]| {
        assert_eq!((old.roughness, old.cos), (new.roughness, new.cos));
        let surface = Microsurface {
            ndf: Ggx::isotropic(old.roughness * old.roughness),
            facets: Dielectric {
                eta: old.eta(),
                tint: Rgb::white(),
            },
        };
        let wi = Vector3::spherical(old.cos, 0.0);
        let [exact] = means(POINTS, |rng| {
            let exit = surface.sample(wi, rng);
            [exit.map_or(0.0, |exit| f64::from(exit.direction.z > 0.0))]
        });
        Row {
            roughness: old.roughness,
            cos: old.cos,
            exact,
            cycles_3_4: old.measured()[0],
            cycles_4_5: new.measured()[0],
        }
    });
    rows.collect()
}

fn table(title: &str, rows: &[Row]) {
    println!("\n{title}\n");
    println!("| r | cosθ | exact | Cycles 3.4 | Cycles 4.5 | 3.4 − exact | 4.5 − exact |");
    println!("|---|---|---|---|---|---|---|");
    let mean = |m: Mean| format!("{:.5} ± {:.5}", m.value, m.error);
    let signed = |m: Mean| format!("{:+.5} ± {:.5}", m.value, m.error);
    let mut rows: Vec<&Row> = rows
        .iter()
        .filter(|row| PRINTED.contains(&row.roughness))
        .collect();
    rows.sort_by(|a, b| a.roughness.total_cmp(&b.roughness));
    for row in rows {
        println!(
            "| {} | {} | {} | {} | {} | {} | {} |",
            row.roughness,
            row.cos,
            mean(row.exact),
            mean(row.cycles_3_4),
            mean(row.cycles_4_5),
            signed(row.cycles_3_4.above(row.exact)),
            signed(row.cycles_4_5.above(row.exact)),
        );
    }
}

/// White metal loses nothing in the model and in 3.4; what 4.5 does to it.
fn white() {
    println!("\nWhite metal, Cycles 4.5\n");
    let mut rows: Vec<Metal> = rows("cycles_4.5_albedo_conductor.csv");
    rows.retain(|r| r.distribution == "MULTI_GGX");
    let mut header = String::from("| r |");
    for cos in cosines(rows.iter().map(|r| r.cos)) {
        header += &format!(" cosθ {cos} |");
    }
    println!(
        "{header}\n|{}",
        "---|".repeat(header.matches('|').count() - 1)
    );
    for roughness in PRINTED {
        let of_roughness = rows.iter().filter(|r| r.roughness == roughness);
        let cells = of_roughness.map(|r| {
            let [red, _] = r.measured();
            format!(" {:.5} ± {:.5} |", red.value, red.error)
        });
        println!("| {roughness} |{}", cells.collect::<String>());
    }
    let errors = rows.iter().map(|r| r.measured()[0].value - 1.0);
    let (least, most) = errors.fold((0.0_f64, 0.0_f64), |(a, b), e| (a.min(e), b.max(e)));
    println!("\nfrom {least:+.4} to {most:+.4} over all roughnesses");
}

/// Values without repetition, in the order in which they come.
fn cosines(all: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut seen = Vec::new();
    for cos in all {
        if !seen.contains(&cos) {
            seen.push(cos);
        }
    }
    seen
}

/// What is on the horizontal axis, and what tells the colours apart.
#[derive(Clone, Copy)]
enum Over {
    Roughness([f64; 3]),
    Angle([f64; 3]),
}

/// Series of each of three parameters: lines for the model, dots for 3.4,
/// dashes for 4.5.
fn figure(title: &str, quantity: &str, over: Over, rows: &[Row]) -> Chart {
    let (label, name, parameters) = match over {
        Over::Roughness(cosines) => ("roughness r = √α", "cosθ", cosines),
        Over::Angle(roughnesses) => ("cosθ", "r", roughnesses),
    };
    let mut series = Vec::new();
    for (color, parameter) in parameters.into_iter().enumerate() {
        let mut line: Vec<&Row> = rows
            .iter()
            .filter(|row| match over {
                Over::Roughness(_) => row.cos == parameter,
                Over::Angle(_) => row.roughness == parameter,
            })
            .collect();
        let x = |row: &Row| match over {
            Over::Roughness(_) => row.roughness,
            Over::Angle(_) => row.cos,
        };
        line.sort_by(|a, b| x(a).total_cmp(&x(b)));
        let mut add = |what: &str, mark, of: fn(&Row) -> Mean| {
            let points = line
                .iter()
                .map(|row| (x(row), of(row).value, of(row).error));
            let name = format!("{what}, {name} {parameter}");
            series.push(Series::new(name, mark, points).colored(color));
        };
        add("exact", Mark::Line, |row| row.exact);
        add("3.4", Mark::Points, |row| row.cycles_3_4);
        add("4.5", Mark::Dashes, |row| row.cycles_4_5);
    }
    Chart {
        title: title.into(),
        x: Axis::linear(label),
        y: Axis::linear(quantity),
        series,
    }
}

/// What Cycles is above the model, with errors.
fn difference(title: &str, cosines: [f64; 3], rows: &[Row]) -> Chart {
    let mut series = Vec::new();
    for (color, cos) in cosines.into_iter().enumerate() {
        let mut add = |what: &str, mark, of: fn(&Row) -> Mean| {
            let line = rows.iter().filter(|row| row.cos == cos);
            let points = line.map(|row| {
                let d = of(row).above(row.exact);
                (row.roughness, d.value, d.error)
            });
            let name = format!("{what}, cosθ {cos}");
            series.push(Series::new(name, mark, points).colored(color));
        };
        add("3.4 − exact", Mark::Points, |row| row.cycles_3_4);
        add("4.5 − exact", Mark::Both, |row| row.cycles_4_5);
    }
    Chart {
        title: title.into(),
        x: Axis::linear("roughness r = √α"),
        y: Axis::linear("difference of albedo"),
        series,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = std::env::args_os()
        .nth(1)
        .ok_or("expected the folder for the figures")?
        .into();
    let save = |name: &str, chart: Chart| -> Result<(), Box<dyn Error>> {
        Ok(std::fs::write(
            Path::new(&folder).join(name),
            chart.to_svg()?,
        )?)
    };
    const COSINES: [f64; 3] = [0.999, 0.5, 0.1];

    let gold = metal();
    table("Gold, green channel (0.71 per facet)", &gold);
    white();
    let quantity = "albedo of gold, green";
    let over = Over::Roughness(COSINES);
    save(
        "albedo_gold_roughness.svg",
        figure(
            "Multiscatter GGX: gold over roughness",
            quantity,
            over,
            &gold,
        ),
    )?;
    let over = Over::Angle([0.5, 0.7, 1.0]);
    save(
        "albedo_gold_angle.svg",
        figure("Multiscatter GGX: gold over angle", quantity, over, &gold),
    )?;
    let title = "Multiscatter GGX: gold, Cycles less the model";
    save(
        "albedo_gold_difference.svg",
        difference(title, COSINES, &gold),
    )?;

    for side in ["outside", "inside"] {
        let rows = glass(side);
        table(&format!("Glass 1.5 from {side}, reflectance"), &rows);
        let title = format!("Multiscatter GGX: glass 1.5 from {side}");
        let over = Over::Roughness(COSINES);
        let chart = figure(&title, "reflectance", over, &rows);
        save(&format!("albedo_glass_{side}.svg"), chart)?;
    }
    Ok(())
}
