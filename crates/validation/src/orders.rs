//! The share of each scattering order, and the lobes of the orders.

use super::grid::Effort;
use super::model::Distribution;
use super::model::{Model, stream};
use crate::plot::{Axis, Chart, Mark, PlotError, Series};
use rayon::prelude::*;
use serde::Serialize;
use smithwalk_model::{Estimator, Facets, Ggx, Microsurface, PerOrder, Vector3};

/// A cap on the order is to cost no more than this share of the energy.
pub const CAP_LOSS: f64 = 1e-3;

/// How the energy of white GGX facets is spread over the scattering orders.
#[derive(Clone, Debug, Serialize)]
pub struct OrderRow {
    /// What the facets are.
    pub facets: &'static str,
    /// Slope roughness α.
    pub alpha: f64,
    /// Cosine of the angle of incidence.
    pub cos: f64,
    /// Share of the light that leaves after 1, 2, 3 and 4 facets.
    pub shares: [f64; 4],
    /// Share of the light that meets 5 facets or more.
    pub tail: f64,
    /// Share of the light that meets more than 10: what the cap that renderers
    /// have would lose.
    pub beyond_ten: f64,
    /// The mean number of facets met.
    pub mean_order: f64,
    /// The least cap on the order that costs no more than 0.1 % of the light.
    pub cap: u32,
    /// Walks that were made; a share s has the standard error √(s(1 − s)/walks).
    pub walks: u32,
}

fn row<M: Model, I: Facets<Scalar = f64>>(
    model: M,
    (facets, name): (I, &'static str),
    alpha: f64,
    cos: f64,
    walks: u32,
) -> OrderRow {
    let surface = Microsurface {
        ndf: model.ndf(Distribution::Ggx(Ggx::isotropic(alpha))),
        facets,
    };
    let wi = Vector3::spherical(cos, 0.0);
    let mut rng = stream(90, (alpha * 1e4 + cos * 1e2) as usize);
    let mut counts: Vec<f64> = Vec::new();
    for _ in 0..walks {
        let order = model.sample(&surface, wi, &mut rng).map_or(1, |e| e.order) as usize;
        if counts.len() < order {
            counts.resize(order, 0.0);
        }
        counts[order - 1] += 1.0 / f64::from(walks);
    }
    let share = |k: usize| counts.get(k).copied().unwrap_or(0.0);
    let beyond_order = |k: usize| counts.iter().skip(k).fold(0.0, |sum, c| sum + c);
    let mut beyond = 0.0;
    let mut cap = counts.len();
    while cap > 1 && beyond + counts[cap - 1] <= CAP_LOSS {
        cap -= 1;
        beyond += counts[cap];
    }
    OrderRow {
        facets: name,
        alpha,
        cos,
        shares: [share(0), share(1), share(2), share(3)],
        tail: beyond_order(4),
        beyond_ten: beyond_order(10),
        mean_order: (1..).zip(&counts).map(|(k, c)| f64::from(k) * c).sum(),
        cap: cap as u32,
        walks,
    }
}

/// The table over facets, roughness and angle.
pub fn table<M: Model>(model: M, effort: Effort) -> Vec<OrderRow> {
    let walks = effort.pick(2_000, 200_000);
    let alphas: &[f64] = effort.pick(&[0.1, 1.0], &[0.01, 0.1, 0.2, 0.5, 1.0, 2.0]);
    let cosines: &[f64] = effort.pick(&[1.0, 0.1], &[1.0, 0.5, 0.1, 0.01]);
    let grid: Vec<_> = (0..3)
        .flat_map(|kind| {
            super::grid::cross(alphas, cosines)
                .into_iter()
                .map(move |p| (kind, p))
        })
        .collect();
    let rows = grid.par_iter().map(|&(kind, (alpha, cos))| match kind {
        0 => row(model, (model.conductor(), "conductor"), alpha, cos, walks),
        1 => row(
            model,
            (model.dielectric(1.5), "dielectric 1.5"),
            alpha,
            cos,
            walks,
        ),
        _ => row(model, (model.diffuse(), "diffuse"), alpha, cos, walks),
    });
    rows.collect()
}

/// f |cosθ_o| of orders 1 to 4 in the plane of incidence, for conductor,
/// dielectric and diffuse facets: one figure each.
pub fn lobes<M: Model>(model: M, effort: Effort) -> Result<Vec<String>, PlotError> {
    let samples = effort.pick(300, 20_000);
    Ok(vec![
        lobe(model, model.conductor(), "conductor", samples)?,
        lobe(model, model.dielectric(1.5), "dielectric η 1.5", samples)?,
        lobe(model, model.diffuse(), "diffuse", samples)?,
    ])
}

fn lobe<M: Model, I: Facets<Scalar = f64> + Sync>(
    model: M,
    facets: I,
    name: &str,
    samples: u32,
) -> Result<String, PlotError> {
    const ORDERS: usize = 4;
    let alpha = 1.0;
    let surface = Microsurface {
        ndf: model.ndf(Distribution::Ggx(Ggx::isotropic(alpha))),
        facets,
    };
    let wi = Vector3::spherical(0.5, 0.0);
    let reach: i32 = if I::TRANSMITS { 175 } else { 85 };
    let angles: Vec<_> = (-reach..=reach)
        .step_by(5)
        .filter(|a| a.abs() != 90)
        .collect();
    let values = angles.par_iter().map(|&a| {
        let (sin, cos) = f64::from(a).to_radians().sin_cos();
        let wo = Vector3::new(-sin, 0.0, cos);
        let mut rng = stream(91, (a + 180) as usize);
        let mut sums = [0.0; ORDERS];
        for _ in 0..samples {
            let mut orders = PerOrder::default();
            model.eval(&surface, Estimator::TwoWalk, wi, wo, &mut rng, &mut orders);
            for (sum, value) in sums.iter_mut().zip(&orders.0) {
                *sum += value.0[0] / f64::from(samples);
            }
        }
        sums
    });
    let values: Vec<_> = values.collect();
    let series = (0..ORDERS).map(|k| {
        let points = angles
            .iter()
            .zip(&values)
            .map(|(&a, v)| (f64::from(a), v[k]));
        Series::new(format!("order {}", k + 1), Mark::Line, points)
    });
    Chart {
        title: format!("Lobes by order: {name}, GGX α {alpha}, ω_i at 60°"),
        x: Axis::linear("angle of ω_o in the plane of incidence (°, 0 = normal)"),
        y: Axis::linear("f |cosθ_o| (1/sr)"),
        series: series.collect(),
    }
    .to_svg()
}
