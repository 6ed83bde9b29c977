//! The same domain eight walks at a time: every lane has what a scalar call may
//! have, and the first order and the density are those of one.

use super::calls::starts;
use super::domain::{ALPHAS, COSINES, Grazing, Metered, direction, metals, stream};
use super::findings::{Findings, Kind};
use rayon::prelude::*;
use smithwalk_model::*;
use std::fmt::Debug;
use wide::f32x8;

/// A metered stream in each lane, the first numbers of which differ.
struct Eight([Metered<'static, f32>; LANES]);

impl Eight {
    fn new(starts: &'static [Vec<f32>; 5], seed: u64) -> Self {
        let lane = |i: usize| Metered::new(&starts[(i + seed as usize) % 5], 8 * seed + i as u64);
        Self(std::array::from_fn(lane))
    }
}

impl Draw<f32x8> for Eight {
    fn draw(&mut self) -> f32x8 {
        self.0.each_mut().map(|lane| -> f32 { lane.draw() }).into()
    }
}

/// Below this cosine, closures scatter nothing.
const LEAST: f32 = 1e-7;

/// As near as single precision has both. Where cosines are so small that squares
/// underflow, nothing is asked but finiteness.
fn near(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-3 * a.max(b) || a.max(b) < 1e-20
}

fn ask<N: NdfInLanes + Debug>(
    surface: &Microsurface<N, Conductor<f32>>,
    wi: Vector3<f32>,
    wo: &[Vector3<f32>; LANES],
    mut rng: Eight,
    found: &mut Findings,
) {
    let lossless = surface.facets.fresnel == ConductorFresnel::Constant(Rgb::white());
    found.calls += 4 * LANES as u64;
    for (lane, exit) in surface.sample_lanes(wi, &mut rng).into_iter().enumerate() {
        let context = || format!("{surface:?}, {wi:?}, lane {lane}: {exit:?}");
        let Some((exit, pdf)) = exit else {
            found.expect(!lossless || wi.z < LEAST, Kind::Energy, context);
            continue;
        };
        let weight = exit.weight.0;
        found.expect(
            (exit.direction.length() - 1.0).abs() < 1e-5 && exit.direction.z > 0.0,
            Kind::Direction,
            context,
        );
        found.expect(
            weight.iter().all(|w| (0.0..1.0 + 1e-5).contains(w)),
            Kind::Energy,
            context,
        );
        found.expect(!lossless || weight == [1.0; 3], Kind::Energy, context);
        let expected = surface.pdf(wi, exit.direction);
        let seen = pdf > 0.0 || exit.direction.z <= LEAST;
        found.expect(
            pdf.is_finite() && seen && near(pdf, expected),
            Kind::Density,
            || format!("{}, scalar {expected}", context()),
        );
    }
    let values = surface.eval_lanes(wi, wo, [1.0; LANES], &mut rng);
    for (value, &wo) in values.iter().zip(wo) {
        let context = || format!("{surface:?}, {wi:?} → {wo:?}: {value:?}");
        let channels = || value.single.0.into_iter().chain(value.multiple.0);
        found.expect(
            channels().all(|c| c.is_finite() && c >= 0.0),
            Kind::Value,
            context,
        );
        let expected = surface.eval_single(wi, wo, &mut rng.0[0]);
        let same = expected.0.into_iter().zip(value.single.0);
        // How far a dielectric's curve has risen is a difference, exact to the last
        // digits of the whole.
        let rounding = 1e-6 * expected.max_channel();
        found.expect(
            same.into_iter()
                .all(|(a, b)| near(a, b) || (a - b).abs() <= rounding),
            Kind::Value,
            || format!("{}, scalar {expected:?}", context()),
        );
    }
    let drawn = rng.0[0].drawn;
    found.expect(drawn < 8 * 4096, Kind::Steps, || format!("{drawn} draws"));
}

#[test]
fn lanes_hold_everywhere_on_ggx() {
    hold_everywhere(|(alpha_x, alpha_y)| Ggx { alpha_x, alpha_y });
}

#[test]
fn lanes_hold_everywhere_on_beckmann() {
    hold_everywhere(|(alpha_x, alpha_y)| Beckmann { alpha_x, alpha_y });
}

fn hold_everywhere<N: NdfInLanes + Debug>(new: impl Fn((f32, f32)) -> N + Sync) {
    let starts: &'static [Vec<f32>; 5] = Box::leak(Box::new(starts::<f32>()));
    let cases: Vec<_> = ALPHAS
        .into_iter()
        .flat_map(|alpha| metals::<f32>().map(|fresnel| (alpha, fresnel)))
        .collect();
    let all = cases.par_iter().enumerate().map(|(k, &(alpha, fresnel))| {
        let mut found = Findings::default();
        let surface = Microsurface {
            ndf: new((alpha.0 as f32, alpha.1 as f32)),
            facets: Conductor { fresnel },
        };
        // Rougher ones are not evaluated in lanes.
        if !surface.suits_position_free() {
            return found;
        }
        let cosines = COSINES.into_iter().filter(|&cos| cos as f32 > LEAST);
        for (i, cos) in cosines.clone().enumerate() {
            let all: Vec<f64> = cosines.clone().collect();
            for turn in 0..200 {
                let wo = std::array::from_fn(|lane| {
                    let azimuths = [0.3, 0.3 + std::f64::consts::PI, 1.0];
                    direction(all[(lane + turn) % all.len()], azimuths[(lane + i) % 3])
                });
                let seed = ((k * 12 + i) * 200 + turn) as u64;
                let wi = direction(cos, 0.3);
                ask(&surface, wi, &wo, Eight::new(starts, seed), &mut found);
            }
        }
        found
    });
    let all = all.reduce(Findings::default, Findings::merged);
    all.assert_clean();
    assert!(all.calls > 2_000_000, "{all}");
}

#[test]
fn lanes_hold_for_grazing_pairs_on_ggx() {
    hold_for_grazing_pairs(|(alpha_x, alpha_y)| Ggx { alpha_x, alpha_y });
}

#[test]
fn lanes_hold_for_grazing_pairs_on_beckmann() {
    hold_for_grazing_pairs(|(alpha_x, alpha_y)| Beckmann { alpha_x, alpha_y });
}

fn hold_for_grazing_pairs<N: NdfInLanes + Debug>(new: impl Fn((f32, f32)) -> N + Sync) {
    let starts: &'static [Vec<f32>; 5] = Box::leak(Box::default());
    let all = (0..100_000u64).into_par_iter().map(|pair| {
        let mut found = Findings::default();
        let Grazing { alpha, ends } = Grazing::new(&mut stream(pair));
        let [wi, wo] = ends.map(|(cos, phi)| direction(cos, phi));
        let surface = Microsurface {
            ndf: new((alpha.0 as f32, alpha.1 as f32)),
            facets: Conductor {
                fresnel: metals()[pair as usize % 7],
            },
        };
        if surface.suits_position_free() {
            let rng = Eight::new(starts, pair);
            ask(&surface, wi, &[wo; LANES], rng, &mut found);
        }
        found
    });
    all.reduce(Findings::default, Findings::merged)
        .assert_clean();
}
