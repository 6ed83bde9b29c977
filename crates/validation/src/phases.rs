//! Statements 4 and 5, and the samplers: phase functions and visible normals.

use super::check::{Case, Check, Statement};
use super::grid::Effort;
use super::model::{Distribution, Model, Rng, stream};
use super::slopes::Slopes;
use super::statistics::{Mean, chi_square, gauss};
use crate::plot::{Axis, Chart, Mark, PlotError, Series};
use rayon::prelude::*;
use smithwalk_model::{At, Draw, Facets, Ndf, Side, Vector3, fresnel};
use std::f64::consts::TAU;

/// Nodes a side of the quadratures over normals.
const NODES: usize = 32;

/// What differences over this step leave of a derivative is 10⁻⁹ and less.
const STEP: f64 = 1e-5;

/// What is demanded of the integrals; the Jacobians by differences and the
/// onset of total reflection keep the quadrature from being better.
const INTEGRAL: f64 = 1e-6;

/// How well the share of a cell of normals is to be known: to a small part of
/// one count.
const CELL: f64 = 1e-6;

/// The law of reflection.
fn reflected(w: Vector3<f64>, m: Vector3<f64>) -> Option<Vector3<f64>> {
    Some((m * (2.0 * w.dot(m)) - w).normalized())
}

/// Snell's law; `None` under total reflection.
fn refracted(w: Vector3<f64>, m: Vector3<f64>, eta: f64) -> Option<Vector3<f64>> {
    let cos = w.dot(m);
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    let cos_t = (1.0 - sin2).sqrt();
    (sin2 < 1.0).then(|| (m * (cos / eta - cos_t) - w * eta.recip()).normalized())
}

fn cross_product(a: Vector3<f64>, b: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        a.y * b.z - a.z * b.y,
        a.z * b.x - a.x * b.z,
        a.x * b.y - a.y * b.x,
    )
}

/// dω/dm of a law, by central differences on the sphere over `step`.
fn spread(
    law: impl Fn(Vector3<f64>) -> Option<Vector3<f64>>,
    m: Vector3<f64>,
    step: f64,
) -> Option<f64> {
    let helper = if m.x.abs() < 0.6 {
        Vector3::new(1.0, 0.0, 0.0)
    } else {
        Vector3::new(0.0, 1.0, 0.0)
    };
    let a = cross_product(m, helper).normalized();
    let b = cross_product(m, a);
    let slope = |t: Vector3<f64>| {
        let (ahead, behind) = (
            law((m + t * step).normalized())?,
            law((m - t * step).normalized())?,
        );
        Some((ahead - behind) * (0.5 / step))
    };
    Some(cross_product(slope(a)?, slope(b)?).length())
}

/// Where light comes from, in the model's terms.
fn at<N: Ndf<Scalar = f64>>(ndf: &N, side: Side, w: Vector3<f64>) -> At<f64> {
    At {
        side,
        w,
        sigma: ndf.projected_area(w),
    }
}

/// The density of normals that the phase function implies: its value where a
/// normal sends the light, times dω/dm. Reflection and transmission.
fn implied<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>>(
    ndf: &N,
    facets: &I,
    at: At<f64>,
    eta: f64,
    m: Vector3<f64>,
) -> [f64; 2] {
    if at.w.dot(m) <= STEP {
        return [0.0; 2];
    }
    let value = |o: Option<Vector3<f64>>, crosses, spread: Option<f64>| match (o, spread) {
        (Some(o), Some(j)) => facets.phase(ndf, at, o, crosses, m).density * j,
        _ => 0.0,
    };
    let mirror = |m| reflected(at.w, m);
    let through = |m| refracted(at.w, m, eta);
    let transmitted = if I::TRANSMITS {
        // Refraction bends ever more towards the critical angle.
        let cos = at.w.dot(m);
        let cos2 = 1.0 - (1.0 - cos * cos) / (eta * eta);
        let step = STEP * cos2.clamp(f64::EPSILON, 1.0);
        value(through(m), true, spread(through, m, step))
    } else {
        0.0
    };
    [
        value(mirror(m), false, spread(mirror, m, STEP)),
        transmitted,
    ]
}

/// Facets that light from `w` meets.
struct Setting<N, I> {
    name: String,
    d: Distribution,
    ndf: N,
    facets: I,
    side: Side,
    /// The index of the far side over that of the near side.
    eta: f64,
    w: Vector3<f64>,
    index: usize,
}

impl<N: Ndf<Scalar = f64>, I> Setting<N, I> {
    fn origin(&self) -> At<f64> {
        at(&self.ndf, self.side, self.w)
    }
}

/// What is done with facets of all kinds.
trait Visit {
    fn visit<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>>(&self, at: &Setting<N, I>) -> Case;
}

/// Mirrors, and dielectrics of all indices from either side.
fn visit_all<M: Model>(model: M, effort: Effort, visitor: &(impl Visit + Sync)) -> Vec<Case> {
    let all = effort.sphere_of_all();
    let visited = all.par_iter().enumerate().flat_map_iter(|(i, &(d, w))| {
        let ndf = model.ndf(d);
        let name = |kind: String| format!("{kind}, {}, w_z {:.2}", d.name(), w.z);
        let mut cases = vec![visitor.visit(&Setting {
            name: name("mirror".into()),
            d,
            ndf,
            facets: model.conductor(),
            side: Side::Above,
            eta: 1.0,
            w,
            index: i << 8,
        })];
        for &eta in effort.indices() {
            for side in [Side::Above, Side::Below] {
                cases.push(visitor.visit(&Setting {
                    name: name(format!("η {eta:.2} {side:?}")),
                    d,
                    ndf,
                    facets: model.dielectric(eta),
                    side,
                    eta: if side == Side::Above { eta } else { 1.0 / eta },
                    w,
                    index: i << 8 | cases.len(),
                }));
            }
        }
        cases
    });
    visited.collect()
}

struct Integral;

impl Visit for Integral {
    fn visit<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>>(&self, at: &Setting<N, I>) -> Case {
        let from = at.origin();
        let sum = Slopes::seen(at.d, at.w).integrate(NODES, |m| {
            let [r, t] = implied(&at.ndf, &at.facets, from, at.eta, m);
            r + t
        });
        Case::new(at.name.clone(), sum - 1.0)
    }
}

/// χ² of where facets send light against their phase function.
struct Scattering {
    samples: usize,
}

impl Visit for Scattering {
    fn visit<N: Ndf<Scalar = f64>, I: Facets<Scalar = f64>>(&self, at: &Setting<N, I>) -> Case {
        let (from, slopes) = (at.origin(), Slopes::seen(at.d, at.w));
        let mut expected = Vec::new();
        for part in 0..2 {
            let density = |m| implied(&at.ndf, &at.facets, from, at.eta, m)[part];
            expected.extend(slopes.integrate_cells(CELL, density));
        }
        let samples = self.samples as f64;
        expected.iter_mut().for_each(|e| *e *= samples);
        let mut seen = vec![0.0; 2 * Slopes::CELLS];
        let mut rng = stream(40, at.index);
        for _ in 0..self.samples {
            let m = at.ndf.sample_visible(at.w, [rng.draw(), rng.draw()]);
            let bounce = at.facets.scatter(at.side, at.w, m, &mut rng);
            // The normal that the direction tells of.
            let h = if bounce.crosses {
                at.w + bounce.direction * at.eta
            } else {
                at.w + bounce.direction
            };
            let h = if h.z < 0.0 { -h } else { h }.normalized();
            seen[usize::from(bounce.crosses) * Slopes::CELLS + slopes.cell(h)] += 1.0;
        }
        Case::new(at.name.clone(), chi_square(&seen, &expected))
    }
}

/// χ² of sampled visible normals against D_w, with what quadrature says is σ.
fn normals<M: Model>(model: M, effort: Effort) -> Vec<Case> {
    let samples = effort.pick(20_000, 100_000);
    let all = effort.sphere_of_all();
    let tested = all.par_iter().enumerate().map(|(index, &(d, w))| {
        let ndf = model.ndf(d);
        let slopes = Slopes::seen(d, w);
        let mut expected = slopes.integrate_cells(CELL * d.projected_area(w), |m| {
            m.dot(w).max(0.0) * ndf.density(m)
        });
        let sigma: f64 = expected.iter().sum();
        expected
            .iter_mut()
            .for_each(|e| *e *= samples as f64 / sigma);
        let mut seen = vec![0.0; Slopes::CELLS];
        let mut rng = stream(41, index);
        for _ in 0..samples {
            seen[slopes.cell(ndf.sample_visible(w, [rng.draw(), rng.draw()]))] += 1.0;
        }
        Case::new(
            format!("{}, w_z {:.2}", d.name(), w.z),
            chi_square(&seen, &expected),
        )
    });
    tested.collect()
}

/// χ² of the directions off a diffuse facet: cos² and azimuth are even.
fn diffuse_lobes<M: Model>(model: M, effort: Effort) -> Vec<Case> {
    const SIDE: usize = 12;
    let samples = effort.pick(20_000, 200_000);
    let normals = [0.05, 0.5, 0.99].map(|z| Vector3::spherical(z, 1.0 + z));
    let tested = normals.par_iter().enumerate().map(|(index, &m)| {
        let mut rng: Rng = stream(42, index);
        let side_x = Vector3::new(m.y, -m.x, 0.0).normalized();
        let side_y = cross_product(m, side_x);
        let mut seen = vec![0.0; SIDE * SIDE];
        for _ in 0..samples {
            let o = model
                .diffuse()
                .scatter(Side::Above, m, m, &mut rng)
                .direction;
            let turn = o.dot(side_y).atan2(o.dot(side_x)).rem_euclid(TAU) / TAU;
            let cell = |x: f64| ((x * SIDE as f64) as usize).min(SIDE - 1);
            seen[cell(o.dot(m).max(0.0).powi(2)) * SIDE + cell(turn)] += 1.0;
        }
        let expected = vec![samples as f64 / (SIDE * SIDE) as f64; SIDE * SIDE];
        Case::new(format!("m_z {:.2}", m.z), chi_square(&seen, &expected))
    });
    tested.collect()
}

/// ∫ p dω of diffuse facets with a given normal, in the normal's own frame.
fn diffuse_integrals<M: Model>(model: M, effort: Effort) -> Vec<Case> {
    let rule = gauss(16);
    let all = effort.sphere_of_all();
    let summed = all.iter().map(|&(d, w)| {
        let ndf = model.ndf(d);
        let m = Vector3::spherical(0.6, 0.7);
        let side_x = Vector3::new(m.y, -m.x, 0.0).normalized();
        let side_y = cross_product(m, side_x);
        let mut sum = 0.0;
        for &(z, weight) in &rule {
            for k in 0..16 {
                let local = Vector3::spherical(z, TAU * f64::from(k) / 16.0);
                let o = side_x * local.x + side_y * local.y + m * local.z;
                let phase = model
                    .diffuse()
                    .phase(&ndf, at(&ndf, Side::Above, w), o, false, m);
                sum += weight * TAU / 16.0 * phase.density;
            }
        }
        Case::new(format!("{}, w_z {:.2}", d.name(), w.z), sum - 1.0)
    });
    summed.collect()
}

/// Statement 4, and the χ² tests of the samplers under it.
pub fn normalised<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let samples = effort.pick(10_000, 30_000);
    let index = effort.indices()[effort.indices().len() - 2];
    let d = super::escape::shown_distributions()[1];
    let ndf = model.ndf(d);
    // A section through the phase function in the plane of incidence.
    let w = Vector3::spherical(0.5, 0.0);
    let section = |crosses: bool, eta: f64| {
        let ndf = &ndf;
        (-90..=90).map(move |a| {
            let (sin, cos) = (2.0 * f64::from(a)).to_radians().sin_cos();
            let o = Vector3::new(-sin, 0.0, cos);
            let at = at(ndf, Side::Above, w);
            let m = Vector3::new(0.0, 0.0, 1.0);
            (
                2.0 * f64::from(a),
                model.dielectric(eta).phase(ndf, at, o, crosses, m).density,
            )
        })
    };
    let mut series = Vec::new();
    for eta in [1.5, index] {
        if series.is_empty() || eta != 1.5 {
            let name = |part| format!("{part}, η {eta:.2}");
            series.push(Series::new(
                name("reflected"),
                Mark::Line,
                section(false, eta),
            ));
            series.push(Series::new(
                name("refracted"),
                Mark::Line,
                section(true, eta),
            ));
        }
    }
    let figure = Chart {
        title: format!(
            "Phase function of dielectric facets, {}, from θ 60°",
            d.name()
        ),
        x: Axis::linear("angle of ω in the plane of incidence (°, 0 = normal)")
            .between(-180.0, 180.0),
        y: Axis::linear("p (1/sr)"),
        series,
    };
    Ok(Statement {
        number: 4,
        title: "Phase functions are normalised, for light going up or down",
        equation: "∫ p(d → ω) dω = 1",
        checks: vec![
            Check::deviations(
                "mirrors and dielectrics, both sides; dω/dm from the laws by differences",
                INTEGRAL,
                visit_all(model, effort, &Integral),
            ),
            Check::deviations("diffuse facets", 1e-12, diffuse_integrals(model, effort)),
            Check::p_values(
                "sampled visible normals against ⟨m·ω⟩ D(m)",
                normals(model, effort),
            ),
            Check::p_values(
                "sampled reflections and refractions against the phase function",
                visit_all(model, effort, &Scattering { samples }),
            ),
            Check::p_values("sampled diffuse lobes", diffuse_lobes(model, effort)),
        ],
        figures: vec![figure.to_svg()?],
    })
}

/// A direction off a facet seen from `w`, so that narrow lobes are met.
fn partner<N: Ndf<Scalar = f64>>(
    ndf: &N,
    w: Vector3<f64>,
    eta: Option<f64>,
    rng: &mut Rng,
) -> Option<Vector3<f64>> {
    let m = ndf.sample_visible(w, [rng.draw(), rng.draw()]);
    match eta {
        None => reflected(w, m),
        Some(eta) => refracted(w, m, eta),
    }
}

/// Statement 5.
pub fn reciprocal<M: Model>(model: M, effort: Effort) -> Result<Statement, PlotError> {
    let pairs = effort.pick(20, 200);
    let all = effort.sphere_of_all();
    let up = Vector3::new(0.0, 0.0, 1.0);
    // Two values that are equal but for rounding; where both are far down a
    // tail, the exponent has taken the digits.
    let unequal = |a: f64, b: f64| {
        if a.abs() + b.abs() < 1e-200 {
            0.0
        } else {
            (a - b) / (a.abs() + b.abs())
        }
    };
    let closed = all.par_iter().enumerate().flat_map_iter(|(i, &(d, w))| {
        let ndf = model.ndf(d);
        let mut rng = stream(5, i);
        let mut cases = Vec::new();
        for _ in 0..pairs {
            let named = |name: String, value| {
                Case::new(format!("{name}, {}, w_z {:.2}", d.name(), w.z), value)
            };
            let there = at(&ndf, Side::Above, w);
            if let Some(o) = partner(&ndf, w, None, &mut rng) {
                let back = at(&ndf, Side::Above, o);
                let (f, g) = (
                    model.conductor().phase(&ndf, there, o, false, up),
                    model.conductor().phase(&ndf, back, w, false, up),
                );
                cases.push(named(
                    "mirror".into(),
                    unequal(there.sigma * f.density, back.sigma * g.density),
                ));
            }
            for &eta in effort.indices() {
                let facets = model.dielectric(eta);
                let Some(o) = partner(&ndf, w, Some(eta), &mut rng) else {
                    continue;
                };
                let back = at(&ndf, Side::Below, -o);
                let (f, g) = (
                    facets.phase(&ndf, there, o, true, up),
                    facets.phase(&ndf, back, -w, true, up),
                );
                cases.push(named(
                    format!("refraction η {eta:.2}"),
                    unequal(there.sigma * f.density, back.sigma * g.density * eta * eta),
                ));
            }
        }
        cases
    });
    let closed: Vec<_> = closed.collect();
    // The transmitted share of a flat facet by Fresnel, as the phase function
    // holds it: both ways through an interface are alike.
    let fresnel = effort.indices().iter().flat_map(|&eta| {
        (1..50).filter_map(move |i| {
            let cos = f64::from(i) / 50.0;
            let (f, cos_t) = fresnel::dielectric(cos, eta);
            let back = fresnel::dielectric(cos_t, 1.0 / eta).0;
            (f < 1.0).then(|| Case::new(format!("η {eta:.2}, cosθ {cos}"), f - back))
        })
    });
    // Diffuse facets: an estimate, over sampled normals.
    let samples = effort.pick(4_000, 40_000);
    let diffuse = all.par_iter().enumerate().filter_map(|(i, &(d, w))| {
        let ndf = model.ndf(d);
        let mut rng = stream(50, i);
        let o = Vector3::spherical(0.35, 2.0);
        let mut run = |w: Vector3<f64>, o| {
            let mut mean = Mean::default();
            let at = at(&ndf, Side::Above, w);
            for _ in 0..samples {
                let m = ndf.sample_visible(w, [rng.draw(), rng.draw()]);
                mean.add(at.sigma * model.diffuse().phase(&ndf, at, o, false, m).density);
            }
            mean
        };
        let (there, back) = (run(w, o), run(o, w));
        let name = format!("{}, w_z {:.2}", d.name(), w.z);
        // Rare facets that face both leave no normal distribution.
        let common =
            there.mean > 0.01 * d.projected_area(w) && back.mean > 0.01 * d.projected_area(o);
        common.then(|| Case::new(name, there.score_against(&back)))
    });
    let diffuse = diffuse.collect();
    let d = super::escape::shown_distributions()[0];
    let ndf = model.ndf(d);
    let w = Vector3::spherical(0.5, 0.0);
    let line = |forth: bool| {
        let ndf = &ndf;
        (-40..90).map(move |a| {
            let (sin, cos) = f64::from(a).to_radians().sin_cos();
            let o = Vector3::new(-sin, 0.0, cos);
            let (from, to) = if forth { (w, o) } else { (o, w) };
            let at = at(ndf, Side::Above, from);
            let phase = model.conductor().phase(ndf, at, to, false, up);
            (f64::from(a), at.sigma * phase.density)
        })
    };
    let figure = Chart {
        title: format!("σ p there and back, mirrors, {}, ω_i at 60°", d.name()),
        x: Axis::linear("angle of ω_o in the plane of incidence (°)"),
        y: Axis::linear("σ p (1/sr)"),
        series: vec![
            Series::new("σ(ω_i) p(−ω_i → ω_o)", Mark::Line, line(true)),
            Series::new("σ(ω_o) p(−ω_o → ω_i)", Mark::Points, line(false).step_by(4)),
        ],
    };
    Ok(Statement {
        number: 5,
        title: "Phase functions are reciprocal",
        equation: "σ(−ω_i) p(ω_i, ω_o) = σ(−ω_o) p(ω_o, ω_i), times n² across an interface",
        checks: vec![
            Check::deviations("mirrors, and refraction both ways", 1e-8, closed),
            Check::deviations("Fresnel reflectance both ways", 1e-10, fresnel.collect()),
            Check::scores("diffuse facets over sampled normals", diffuse),
        ],
        figures: vec![figure.to_svg()?],
    })
}
