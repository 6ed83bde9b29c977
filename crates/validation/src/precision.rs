//! f32 against f64: what single precision loses in deterministic quantities.

use super::check::{Case, Check};
use super::grid::Effort;
use super::model::Distribution;
use serde::Serialize;
use smithwalk_model::{
    Beckmann, Conductor, ConductorFresnel, Ggx, Microsurface, Ndf, Quadratic, Rgb, StudentT,
    Vector3,
};

/// The largest relative difference that is allowed.
pub const BOUND: f64 = 1e-4;

/// The largest relative difference of a quantity.
#[derive(Clone, Debug, Serialize)]
pub struct PrecisionRow {
    /// The quantity.
    pub quantity: &'static str,
    /// The distribution of normals.
    pub distribution: String,
    /// |f32/f64 − 1|.
    pub difference: f64,
    /// The cosine of the direction at which it occurs.
    pub cos: f64,
}

fn narrowed(v: Vector3<f64>) -> Vector3<f32> {
    Vector3::new(v.x as f32, v.y as f32, v.z as f32)
}

fn widened(v: Vector3<f32>) -> Vector3<f64> {
    Vector3::new(v.x.into(), v.y.into(), v.z.into())
}

/// Compares both precisions at the same, representable, direction.
fn rows<N: Ndf<Scalar = f32>, M: Ndf<Scalar = f64>>(
    d: Distribution,
    single: N,
    double: M,
    views: &[Vector3<f64>],
) -> Vec<PrecisionRow> {
    let names = [
        "σ(ω)",
        "σ(−ω)",
        "Λ(ω)",
        "G1(ω)",
        "D(m)",
        "D(m) G1(ω)",
        "first order of mirrors",
    ];
    let mut worst = names.map(|_| (0.0, 0.0));
    for &view in views {
        let w = narrowed(view);
        let exact = widened(w);
        let mut pairs = vec![
            (
                0,
                f64::from(single.projected_area(w)),
                double.projected_area(exact),
            ),
            (
                1,
                f64::from(single.projected_area(-w)),
                double.projected_area(-exact),
            ),
            (2, f64::from(single.lambda(w)), double.lambda(exact)),
            (3, f64::from(single.masking(w)), double.masking(exact)),
        ];
        for r in [0.0, 0.5, 1.0, 2.0] {
            let (x, y) = d.alpha();
            let m = narrowed(Vector3::new(-0.8 * x * r, 0.6 * y * r, 1.0).normalized());
            let m64 = widened(m);
            let (a, b) = (single.density(m), double.density(m64));
            pairs.push((4, a.into(), b));
            let (g, h) = (single.masking(w), double.masking(exact));
            pairs.push((5, (a * g).into(), b * h));
            let wo = narrowed((m64 * (2.0 * exact.dot(m64)) - exact).normalized());
            if wo.z > 0.01 && exact.dot(m64) > 0.01 {
                let small = Microsurface {
                    ndf: single,
                    facets: Conductor {
                        fresnel: ConductorFresnel::Constant(Rgb::<f32>::white()),
                    },
                };
                let large = Microsurface {
                    ndf: double,
                    facets: Conductor {
                        fresnel: ConductorFresnel::Constant(Rgb::<f64>::white()),
                    },
                };
                let mut rng = super::model::stream(92, 0);
                let a = small.eval_single(w, wo, &mut rng).0[0];
                let b = large.eval_single(exact, widened(wo), &mut rng).0[0];
                pairs.push((6, a.into(), b));
            }
        }
        for (k, a, b) in pairs {
            // Below what f32 holds with full precision there is nothing to compare.
            if b.abs() > 1e-30 {
                let difference: f64 = (a / b - 1.0).abs();
                if difference.is_nan() || difference > worst[k].0 {
                    worst[k] = (difference, view.z);
                }
            }
        }
    }
    let rows = names.into_iter().zip(worst);
    rows.map(|(quantity, (difference, cos))| PrecisionRow {
        quantity,
        distribution: d.name(),
        difference,
        cos,
    })
    .collect()
}

/// The table over the grid.
pub fn table(effort: Effort) -> Vec<PrecisionRow> {
    let views = effort.views();
    let rows = effort.distributions().into_iter().flat_map(|d| match d {
        Distribution::Ggx(g) => {
            let (alpha_x, alpha_y) = (g.alpha_x as f32, g.alpha_y as f32);
            let double = Ggx {
                alpha_x: alpha_x.into(),
                alpha_y: alpha_y.into(),
            };
            rows(d, Ggx { alpha_x, alpha_y }, double, &views)
        }
        Distribution::Beckmann(b) => {
            let (alpha_x, alpha_y) = (b.alpha_x as f32, b.alpha_y as f32);
            let double = Beckmann {
                alpha_x: alpha_x.into(),
                alpha_y: alpha_y.into(),
            };
            rows(d, Beckmann { alpha_x, alpha_y }, double, &views)
        }
        Distribution::StudentT(s) => {
            let [alpha_x, alpha_y, gamma] = [s.alpha_x, s.alpha_y, s.gamma].map(|x| x as f32);
            let double = StudentT {
                alpha_x: alpha_x.into(),
                alpha_y: alpha_y.into(),
                gamma: gamma.into(),
            };
            let single = StudentT {
                alpha_x,
                alpha_y,
                gamma,
            };
            rows(d, single, double, &views)
        }
        Distribution::Quadratic => rows(d, Quadratic::new(), Quadratic::new(), &views),
    });
    rows.collect()
}

/// The table's verdict.
pub fn check(rows: &[PrecisionRow]) -> Check {
    let cases = rows.iter().map(|r| {
        let name = format!("{}, {}, cosθ {:.2}", r.quantity, r.distribution, r.cos);
        Case::new(name, r.difference)
    });
    Check::deviations("f32 against f64", BOUND, cases.collect())
}
