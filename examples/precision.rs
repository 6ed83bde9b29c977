//! What single precision costs: the model's functions in `f32` against `f64`
//! over roughness and angle.
//!
//! `cargo run --release --example precision` draws the heat maps of
//! docs/images/ and writes the table of docs/stability.md.

use plotters::prelude::*;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use smithwalk_model::*;
use std::path::Path;

type Error = Box<dyn std::error::Error>;

/// Steps to a decade, of α and of cosθ.
const STEPS: i32 = 2;

/// Directions in a cell.
const DIRECTIONS: u32 = 100;

/// log₁₀ of the least and of the largest α and cosθ.
const ALPHA: (i32, i32) = (-8, 4);
const COS: (i32, i32) = (-12, 0);

/// log₁₀ of the errors at the ends of the colour scale.
const COLORS: (f64, f64) = (-8.0, -2.0);

/// Draws nothing: what is compared here needs no random numbers of its own.
struct Nothing;

impl<F> Draw<F> for Nothing {
    fn draw(&mut self) -> F {
        unreachable!("closed forms draw nothing")
    }
}

fn narrowed(v: Vector3<f64>) -> Vector3<f32> {
    Vector3::new(v.x as f32, v.y as f32, v.z as f32)
}

fn widened(v: Vector3<f32>) -> Vector3<f64> {
    Vector3::new(v.x.into(), v.y.into(), v.z.into())
}

/// |single/double − 1|; `None` where `f32` has no normal number, or the value
/// is zero.
fn relative(single: f32, double: f64) -> Option<f64> {
    let shown = double.abs() > 1e-35 && double.abs() < 1e37;
    shown.then(|| (f64::from(single) / double - 1.0).abs())
}

/// One map of errors.
struct Quantity {
    file: &'static str,
    title: &'static str,
}

const QUANTITIES: [Quantity; 6] = [
    Quantity {
        file: "sigma",
        title: "σ(ω), projected area",
    },
    Quantity {
        file: "sigma_below",
        title: "σ(−ω), projected area from below",
    },
    Quantity {
        file: "lambda",
        title: "Λ(ω)",
    },
    Quantity {
        file: "normal",
        title: "visible normal (distance, in units of min(α, 1))",
    },
    Quantity {
        file: "mirror",
        title: "first order of mirrors",
    },
    Quantity {
        file: "glass",
        title: "first order of refraction, η = 1.5",
    },
];

/// The largest error of each quantity over some directions of the same cosine.
fn cell<S: Ndf<Scalar = f32>, D: Ndf<Scalar = f64>>(
    single: S,
    double: D,
    alpha: f64,
    cos: f64,
) -> [Option<f64>; QUANTITIES.len()] {
    let mut worst = [None::<f64>; QUANTITIES.len()];
    let mut rng = Stream(Pcg64Mcg::seed_from_u64(1));
    let mut uniform = || -> f64 { rng.draw() };
    for _ in 0..DIRECTIONS {
        // Anywhere within the cell, in the azimuth too.
        let cos = (cos * 10f64.powf((uniform() - 0.5) / f64::from(STEPS))).min(1.0);
        let w = narrowed(Vector3::spherical(cos, std::f64::consts::TAU * uniform()));
        let exact = widened(w);
        let u = [uniform(), uniform()].map(|u| u as f32);
        let m = double.sample_visible(exact, u.map(f64::from));
        let reflected = narrowed((m * (2.0 * exact.dot(m)) - exact).normalized());
        let refracted = {
            let (_, cos_t) = fresnel::dielectric(exact.dot(m).clamp(0.0, 1.0), 1.5);
            narrowed((m * (exact.dot(m) / 1.5 - cos_t) - exact * (1.0 / 1.5)).normalized())
        };
        let normal = {
            let m32 = single.sample_visible(w, u);
            let off = (widened(m32) - m).length();
            Some(off / alpha.min(1.0))
        };
        let mirror = {
            let facets = Conductor {
                fresnel: ConductorFresnel::Constant(Rgb::<f32>::white()),
            };
            let small = Microsurface {
                ndf: single,
                facets,
            };
            let facets = Conductor {
                fresnel: ConductorFresnel::Constant(Rgb::<f64>::white()),
            };
            let large = Microsurface {
                ndf: double,
                facets,
            };
            let value = small.eval_single(w, reflected, &mut Nothing).0[0];
            let expected = large.eval_single(exact, widened(reflected), &mut Nothing);
            relative(value, expected.0[0])
        };
        let glass = {
            let (eta, tint) = (1.5, Rgb::<f32>::white());
            let small = Microsurface {
                ndf: single,
                facets: Dielectric { eta, tint },
            };
            let (eta, tint) = (1.5, Rgb::<f64>::white());
            let large = Microsurface {
                ndf: double,
                facets: Dielectric { eta, tint },
            };
            let value = small.eval_single(w, refracted, &mut Nothing).0[0];
            let expected = large.eval_single(exact, widened(refracted), &mut Nothing);
            relative(value, expected.0[0])
        };
        let errors = [
            relative(single.projected_area(w), double.projected_area(exact)),
            relative(single.projected_area(-w), double.projected_area(-exact)),
            relative(single.lambda(w), double.lambda(exact)),
            normal,
            mirror,
            glass,
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            // Not a number is the worst of all.
            let rank = |e: f64| if e.is_nan() { f64::INFINITY } else { e };
            *worst = error.map(rank).max_by(*worst);
        }
    }
    worst
}

/// The larger of two errors that may be missing.
trait MaxBy {
    fn max_by(self, other: Self) -> Self;
}

impl MaxBy for Option<f64> {
    fn max_by(self, other: Self) -> Self {
        match (self, other) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        }
    }
}

/// 10^(k/STEPS) for all k between the powers of ten.
fn axis((from, to): (i32, i32)) -> impl Iterator<Item = f64> + Clone {
    (from * STEPS..=to * STEPS).map(|k| 10f64.powf(f64::from(k) / f64::from(STEPS)))
}

/// White for rounding, dark for nothing left; grey where nothing is compared.
fn color(error: Option<f64>) -> RGBColor {
    let Some(error) = error else {
        return RGBColor(225, 225, 225);
    };
    let t = ((error.max(1e-30).log10() - COLORS.0) / (COLORS.1 - COLORS.0)).clamp(0.0, 1.0);
    let mix = |a: f64, b: f64, t: f64| (a + (b - a) * t) as u8;
    if t < 0.5 {
        let t = 2.0 * t;
        RGBColor(
            mix(255.0, 86.0, t),
            mix(255.0, 160.0, t),
            mix(255.0, 211.0, t),
        )
    } else {
        let t = 2.0 * t - 1.0;
        RGBColor(mix(86.0, 70.0, t), mix(160.0, 10.0, t), mix(211.0, 60.0, t))
    }
}

/// A number as a power of ten, for the ends of axes.
fn power(exponent: f64) -> String {
    format!("1e{exponent:.0}")
}

/// Cells over the logarithms of x and y, each half a step wide about its place.
fn heat_map(
    path: &Path,
    title: &str,
    [(x_name, x_range), (y_name, y_range)]: [(&str, (i32, i32)); 2],
    cells: &[(f64, f64, Option<f64>)],
) -> Result<(), Error> {
    let half = 0.5 / f64::from(STEPS);
    let area = SVGBackend::new(path, (620, 420)).into_drawing_area();
    area.fill(&WHITE)?;
    let ends = |(from, to): (i32, i32)| f64::from(from) - half..f64::from(to) + half;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 16))
        .margin(12)
        .margin_right(110)
        .x_label_area_size(46)
        .y_label_area_size(64)
        .build_cartesian_2d(ends(x_range), ends(y_range))?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc(x_name)
        .y_desc(y_name)
        .x_label_formatter(&|v| power(*v))
        .y_label_formatter(&|v| power(*v))
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 15))
        .draw()?;
    chart.draw_series(cells.iter().map(|&(x, y, error)| {
        let (x, y) = (x.log10(), y.log10());
        let corners = [(x - half, y - half), (x + half, y + half)];
        Rectangle::new(corners, color(error).filled())
    }))?;
    // The colour scale.
    area.draw(&Text::new("error", (522, 44), ("sans-serif", 13)))?;
    for k in 0..=6 {
        let error = 10f64.powf(COLORS.0 + f64::from(k));
        let y = 66 + 24 * k;
        let corners = [(522, y), (546, y + 24)];
        area.draw(&Rectangle::new(corners, color(Some(error)).filled()))?;
        area.draw(&Rectangle::new(corners, BLACK.mix(0.3)))?;
        let label = power(COLORS.0 + f64::from(k));
        area.draw(&Text::new(label, (552, y + 6), ("sans-serif", 13)))?;
    }
    area.present()?;
    Ok(())
}

/// The table's row: the largest error for α from 1e-3 to 10 and cosθ ≥ 1e-3,
/// where scenes are, and anywhere.
fn row(name: &str, cells: &[(f64, f64, Option<f64>)]) -> String {
    let worst = |inside: &dyn Fn(f64, f64) -> bool| {
        let mut worst = (0.0, 0.0, 0.0);
        for &(x, y, error) in cells.iter().filter(|c| inside(c.0, c.1)) {
            if error.is_some_and(|e| e > worst.2) {
                worst = (x, y, error.unwrap_or(0.0));
            }
        }
        worst
    };
    let usual = worst(&|cos, alpha| cos > 0.9e-3 && (0.9e-3..11.0).contains(&alpha));
    let any = worst(&|_, _| true);
    format!(
        "| {name} | {:.1e} | {:.1e} | α {:.0e}, cosθ {:.0e} |\n",
        usual.2, any.2, any.1, any.0
    )
}

fn maps<S: Ndf<Scalar = f32>, D: Ndf<Scalar = f64>>(
    images: &Path,
    name: &str,
    pair: impl Fn(f32) -> (S, D),
) -> Result<String, Error> {
    let mut all: [Vec<(f64, f64, Option<f64>)>; QUANTITIES.len()] = Default::default();
    for alpha in axis(ALPHA) {
        // What `f32` holds of it.
        let (single, double) = pair(alpha as f32);
        for cos in axis(COS) {
            let errors = cell(single, double, alpha, cos);
            for (cells, error) in all.iter_mut().zip(errors) {
                cells.push((cos, alpha, error));
            }
        }
    }
    let mut rows = String::new();
    for (quantity, cells) in QUANTITIES.iter().zip(&all) {
        let file = format!("precision_{}_{}.svg", quantity.file, name.to_lowercase());
        let title = format!("{name}: {}", quantity.title);
        let axes = [("cosθ", COS), ("α", ALPHA)];
        heat_map(&images.join(file), &title, axes, cells)?;
        rows += &row(&title, cells);
    }
    Ok(rows)
}

/// x B(x, y) over 1 + Λ for both.
fn beta(images: &Path) -> Result<String, Error> {
    let range = (-4, 8);
    let mut cells = Vec::new();
    for a in axis(range) {
        for b in axis(range) {
            let (x, y) = (1.0 + a as f32, 1.0 + b as f32);
            let exact = (f64::from(x), f64::from(y));
            let double = exact.0 * ln_beta(exact.0, exact.1).exp();
            cells.push((a, b, relative(x * ln_beta(x, y).exp(), double)));
        }
    }
    let title = "(1 + Λᵢ) B(1 + Λᵢ, 1 + Λₒ)";
    let axes = [("Λᵢ", range), ("Λₒ", range)];
    heat_map(&images.join("precision_beta.svg"), title, axes, &cells)?;
    let worst = cells
        .iter()
        .filter_map(|c| c.2)
        .fold(0.0f64, |a, b| a.max(b));
    let usual = cells
        .iter()
        .filter(|c| c.0 < 1.1e3 && c.1 < 1.1e3)
        .filter_map(|c| c.2)
        .fold(0.0f64, |a, b| a.max(b));
    Ok(format!(
        "| {title} | {usual:.1e} | {worst:.1e} | anywhere up to Λ = 1e8 |\n"
    ))
}

const BEGIN: &str = "<!-- written by examples/precision.rs -->\n";
const END: &str = "<!-- end -->";

fn main() -> Result<(), Error> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let images = docs.join("images");
    let mut table = String::from(
        "| quantity | α 1e-3 to 10, cosθ ≥ 1e-3 | anywhere | where |\n|---|---|---|---|\n",
    );
    table += &maps(&images, "GGX", |alpha| {
        (Ggx::isotropic(alpha), Ggx::isotropic(f64::from(alpha)))
    })?;
    table += &maps(&images, "Beckmann", |alpha| {
        let double = Beckmann::isotropic(f64::from(alpha));
        (Beckmann::isotropic(alpha), double)
    })?;
    table += &beta(&images)?;
    print!("{table}");

    let path = docs.join("stability.md");
    let page = std::fs::read_to_string(&path)?;
    let missing = || format!("{}: the marks round the table are missing", path.display());
    let (before, rest) = page.split_once(BEGIN).ok_or_else(missing)?;
    let (_, after) = rest.split_once(END).ok_or_else(missing)?;
    std::fs::write(&path, format!("{before}{BEGIN}{table}{END}{after}"))?;
    Ok(())
}
