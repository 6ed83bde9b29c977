//! Evaluation, sampling and the proxy density say the same, from either side.

use super::*;

/// A grid of the sphere: rings of each hemisphere, and their sectors.
const RINGS: usize = 4;
const SECTORS: usize = 4;
const CELLS: usize = 2 * RINGS * SECTORS;

fn cell(o: Vector3<f64>) -> usize {
    let ring = (0.5 * (o.z + 1.0) * (2 * RINGS) as f64) as usize;
    let turn = o.y.atan2(o.x).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
    let sector = (turn * SECTORS as f64) as usize;
    ring.min(2 * RINGS - 1) * SECTORS + sector.min(SECTORS - 1)
}

/// Cosines of ω_i: from below too, if the stack is open.
fn origins(stack: &Layered<f64>) -> Vec<f64> {
    let mut cosines = vec![0.95, 0.5, 0.1];
    if stack.is_open() {
        cosines.extend([-0.9, -0.3]);
    }
    cosines
}

/// Sums of values, of which few at a time are not 0, and of their squares.
struct Sums {
    count: f64,
    cells: Vec<[f64; 2]>,
}

impl Sums {
    fn new() -> Self {
        Self {
            count: 0.0,
            cells: vec![[0.0; 2]; 4 * CELLS],
        }
    }

    /// Adds one estimate, which is 0 outside the cell of `o`.
    fn add(&mut self, o: Vector3<f64>, parts: [f64; 4]) {
        for (cell, value) in self.cells[4 * cell(o)..].iter_mut().zip(parts) {
            cell[0] += value;
            cell[1] += value * value;
        }
    }

    /// Mean and standard error of a cell.
    fn mean(&self, cell: usize) -> (f64, f64) {
        let [sum, squares] = self.cells[cell];
        let mean = sum / self.count;
        let variance = (squares - sum * mean) / (self.count - 1.0);
        (mean, (variance / self.count).sqrt())
    }
}

/// The weight that samples carry into each cell, for single scattering and the
/// rest and for two colours, against evaluation integrated over the cell with
/// the proxy's density.
#[test]
fn evaluation_meets_the_histograms_of_samples() {
    const SAMPLES: usize = 30_000;
    let zoo = zoo();
    let bound = worst_score(zoo.len() * 4 * CELLS * 4);
    let mut rng = stream(51);
    for (name, stack) in &zoo {
        for cos in origins(stack) {
            let wi = Vector3::spherical(cos, 0.6);
            let (mut sampled, mut integrated) = (Sums::new(), Sums::new());
            for _ in 0..SAMPLES {
                sampled.count += 1.0;
                if let Some(exit) = stack.sample(wi, &mut rng).filter(|exit| !exit.delta) {
                    let [red, _, blue] = exit.weight.0;
                    let parts = if exit.order == 1 {
                        [red, blue, 0.0, 0.0]
                    } else {
                        [0.0, 0.0, red, blue]
                    };
                    sampled.add(exit.direction, parts);
                }
                let wo = draw_proxy(stack, wi, &mut rng);
                let mut split = Split::default();
                stack.eval(wi, wo, &mut rng, &mut split);
                let Split { single, multiple } = split;
                let parts = [single.0[0], single.0[2], multiple.0[0], multiple.0[2]];
                let density = stack.pdf(wi, wo);
                integrated.count += 1.0;
                integrated.add(wo, parts.map(|part| part / density));
            }
            for k in 0..4 * CELLS {
                let (a, b) = (sampled.mean(k), integrated.mean(k));
                // Fewer than some hundred hits are not normally distributed.
                if a.0.max(b.0) > 5e-3 {
                    let score = (a.0 - b.0) / a.1.hypot(b.1);
                    assert!(
                        score.abs() < bound,
                        "{name}, cos {cos}, cell {k}: {a:?}, {b:?} ({score:.1})"
                    );
                }
            }
        }
    }
}

/// f(ω_i, ω_o) n_i² = f(ω_o, ω_i) n_o², order by order.
#[test]
fn evaluation_is_reciprocal() {
    const SAMPLES: usize = 10_000;
    let zoo = zoo();
    let pairs = [(0.9, 0.3), (0.3, 0.8), (0.15, -0.6), (-0.9, -0.4)];
    let bound = worst_score(zoo.len() * pairs.len() * 2);
    let mut rng = stream(52);
    for (name, stack) in &zoo {
        for (a, b) in pairs {
            let (wi, wo) = (Vector3::spherical(a, 0.2), Vector3::spherical(b, 2.2));
            let mut there = [Mean::default(); 2];
            let mut back = [Mean::default(); 2];
            let square = |w: Vector3<f64>| stack.outside(w).powi(2);
            for _ in 0..SAMPLES {
                for (means, wi, wo) in [(&mut there, wi, wo), (&mut back, wo, wi)] {
                    let mut split = Split::default();
                    stack.eval(wi, wo, &mut rng, &mut split);
                    let scale = square(wi) / wo.z.abs();
                    means[0].add(split.single.0[1] * scale);
                    means[1].add(split.multiple.0[1] * scale);
                }
            }
            for (k, (a, b)) in there.iter().zip(&back).enumerate() {
                if a.mean.max(b.mean) > 0.0 {
                    let score = a.score_against(b);
                    assert!(
                        score.abs() < bound,
                        "{name}, {wi:?} {wo:?}, {k}: {} ± {}, {} ± {} ({score:.1})",
                        a.mean,
                        a.error(),
                        b.mean,
                        b.error()
                    );
                }
            }
        }
    }
}

/// The proxy density integrates to 1, and is positive wherever the value is.
#[test]
fn the_proxy_density_integrates_to_one() {
    for (name, stack) in zoo() {
        for cos in origins(&stack) {
            let wi = Vector3::spherical(cos, 0.6);
            let half = |from, to| over_sphere(200, from, to, |o| stack.pdf(wi, o));
            let total = half(0.0, 1.0) + half(-1.0, 0.0);
            assert!((total - 1.0).abs() < 5e-3, "{name}, cos {cos}: {total}");
        }
    }
}
