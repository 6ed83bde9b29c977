//! From training paths to chances.

use super::{Grid, LEAST, Roulette, Survival, index};
use crate::integrator::path::TrainingPath;

/// The share of paths of most worth that count as if they were worth the least of them:
/// a few fireflies are not to decide.
const CLAMPED: f64 = 0.002;

/// How hard to play: chances are multiplied by powers of 2^(1/2), from this one on.
const SOFTEST: i32 = 8;
/// Up to this one.
const HARDEST: i32 = -8;

/// Rays of a camera path's beginning that fall to one of its branches.
const SHARED_RAYS: f64 = 0.5;

/// How the variance of a sample goes with the rays of a branch, of which it then has the
/// fewer: between 1, were they independent, and 3/2, see the numbers of draws.
const EXPONENT: f64 = 1.25;

/// To play has to leave less than this of the cost.
const WORTH: f64 = 0.97;

/// Paths next to each other whose mean counts as what their pixels show.
const NEIGHBOURS: usize = 16;

/// A scattering, relative to what the pixel shows.
#[derive(Clone, Copy)]
struct Relative {
    kind: usize,
    /// Behind it.
    throughput: f64,
    /// Luminance that the path finds after it.
    left: f64,
    /// From it to the next one, or the end.
    rays: f64,
}

/// A path from its first scattering on.
type Steps = Vec<Relative>;

/// How paths are to play by what training paths found, one for each cell of the grid;
/// `otherwise` where that is as good.
pub(in super::super) fn fit(
    paths: &[TrainingPath],
    mut grid: Grid,
    otherwise: Survival,
) -> Roulette {
    let finite = |luminance: f32| {
        if luminance.is_finite() {
            luminance
        } else {
            0.0
        }
    };
    let luminances: Vec<f32> = paths.iter().map(|path| finite(path.luminance)).collect();
    grid.show(&luminances);
    let relative = relative(paths, &grid.inverse);
    let brought = brought(&relative);
    let best = (HARDEST..=SOFTEST)
        .map(|hard| {
            let factors = brought.map(|brought| brought * 2f64.powf(0.5 * f64::from(hard)));
            let chance = |kind: usize, throughput: f64| {
                (factors[kind] * throughput).clamp(f64::from(LEAST), 1.0)
            };
            (factors, cost(&relative, chance))
        })
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let plain = cost(&relative, |_, _| 1.0);
    match best {
        Some((factors, least)) if least < WORTH * plain => Roulette::ByWorth {
            factors: factors.map(|factor| factor as f32),
            grid,
        },
        _ => Roulette::Even(otherwise),
    }
}

/// The paths relative to what their pixels show; those worth most are made worth less.
fn relative(paths: &[TrainingPath], inverse: &[f32]) -> Vec<Steps> {
    let mut relative: Vec<Steps> = paths
        .iter()
        .zip(inverse)
        .map(|(path, &inverse)| {
            let left = |before: f32| {
                let left = f64::from(path.luminance - before) * f64::from(inverse);
                if left.is_finite() { left.max(0.0) } else { 0.0 }
            };
            let ends = path.steps.iter().skip(1).map(|next| next.rays_before);
            let steps = path.steps.iter().zip(ends.chain([path.rays]));
            let relative = steps.map(|(step, end)| Relative {
                kind: index(step.kind),
                throughput: f64::from(step.throughput) * f64::from(inverse),
                left: left(step.before),
                rays: f64::from(end - step.rays_before),
            });
            relative.collect()
        })
        .collect();
    let mut worth: Vec<f64> = relative.iter().map(worth).collect();
    if let Some(last) = worth.len().checked_sub(1) {
        let index = ((1.0 - CLAMPED) * last as f64) as usize;
        let limit = *worth.select_nth_unstable_by(index, f64::total_cmp).1;
        for path in &mut relative {
            let scale = (limit / self::worth(path)).min(1.0);
            for step in path {
                step.left *= scale;
            }
        }
    }
    relative
}

/// What a path finds after its first scattering.
fn worth(path: &Steps) -> f64 {
    path.first().map_or(0.0, |step| step.left)
}

/// The root of the mean square radiance that a path of throughput 1 finds behind a
/// scattering, over the root of the rays that it takes; for each kind.
fn brought(paths: &[Steps]) -> [f64; 3] {
    let mut sums = [(0.0, 0.0); 3];
    for path in paths {
        let mut rays = 0.0;
        for step in path.iter().rev() {
            rays += step.rays;
            if step.throughput > 0.0 {
                let (squares, to_go) = &mut sums[step.kind];
                *squares += (step.left / step.throughput).powi(2);
                *to_go += rays;
            }
        }
    }
    sums.map(|(squares, rays)| {
        let root = (squares / rays).sqrt();
        if root.is_finite() { root } else { 1.0 }
    })
}

/// Variance × a power of the rays of what paths find behind their first scattering, when
/// they go on with this chance by kind and relative throughput.
///
/// A path that finds e_i behind its i-th scattering, and reaches there with probability
/// P_i, has the second moment Σ_i (S_i² − S_{i+1}²)/P_i, where S_i = Σ_{j ≥ i} e_j.
fn cost(paths: &[Steps], chance: impl Fn(usize, f64) -> f64) -> f64 {
    let (mut moment, mut rays) = (0.0, 0.0);
    for path in paths {
        let mut survives = 1.0;
        for (at, step) in path.iter().enumerate() {
            survives *= chance(step.kind, step.throughput / survives);
            let next = path.get(at + 1).map_or(0.0, |next| next.left);
            moment += (step.left * step.left - next * next) / survives;
            rays += step.rays * survives;
        }
    }
    // The square of a mean is the mean product of two of those who share it.
    let (mut squares, mut groups) = (0.0, 0.0);
    for group in paths.chunks(NEIGHBOURS).filter(|group| group.len() > 1) {
        let values = group.iter().map(worth);
        let (sum, own) = values.fold((0.0, 0.0), |(sum, own), v| (sum + v, own + v * v));
        let n = group.len() as f64;
        squares += (sum * sum - own) / (n * (n - 1.0));
        groups += 1.0;
    }
    let n = paths.len() as f64;
    let variance = moment / n - if groups > 0.0 { squares / groups } else { 0.0 };
    variance.max(0.0) * (rays / n + SHARED_RAYS).powf(EXPONENT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::roulette::Step;
    use crate::rays::RayKind;

    const OTHERWISE: Survival = Survival::from(8);

    /// Paths of eight scatterings that each leave half of the light, and find this much
    /// behind each.
    fn paths(found: impl Fn(usize, u32) -> f32) -> (Vec<TrainingPath>, Grid) {
        let grid = Grid::new([64, 64]);
        let paths = grid.cells().enumerate().map(|(path, _)| {
            let mut luminance = 1.0;
            let mut steps = Vec::new();
            for bounce in 1..=8 {
                steps.push(Step {
                    kind: RayKind::Diffuse,
                    throughput: 0.5f32.powi(bounce),
                    before: luminance,
                    rays_before: 2 * bounce as u32,
                });
                luminance += found(path, bounce as u32);
            }
            TrainingPath {
                steps,
                luminance,
                rays: 18,
            }
        });
        (paths.collect(), grid)
    }

    /// A number in [0, 1) that differs from path to path.
    fn noise(path: usize, bounce: u32) -> f32 {
        (path as f32 * 0.618_034 + bounce as f32 * 0.414_214).fract()
    }

    #[test]
    fn tails_that_bring_little_are_cut() {
        // One in sixteen finds something.
        let found = |path, bounce| match noise(path, bounce) {
            u if u < 1.0 / 16.0 => 16.0 * 0.5f32.powi(bounce as i32),
            _ => 0.0,
        };
        let (paths, grid) = paths(found);
        let roulette = fit(&paths, grid, OTHERWISE);
        let survival = roulette.at([5, 5]);
        let chance =
            |bounce: u32| survival.chance(bounce, RayKind::Diffuse, 0.5f32.powi(bounce as i32));
        assert!(matches!(roulette, Roulette::ByWorth { .. }));
        assert!(chance(8) < 0.25, "{}", chance(8));
        assert!(chance(1) > chance(4) && chance(4) > chance(8));
    }

    /// All light comes at the end: who ends a path early loses it.
    #[test]
    fn paths_that_find_light_late_go_on() {
        let last = |path, bounce| if bounce == 8 { noise(path, 1) } else { 0.0 };
        let (paths, grid) = paths(last);
        assert!(matches!(fit(&paths, grid, OTHERWISE), Roulette::Even(_)));
    }

    #[test]
    fn nothing_found_and_impossible_light_change_nothing() {
        for value in [0.0, f32::NAN, f32::INFINITY] {
            let (paths, grid) = paths(|_, _| value);
            let Roulette::Even(survival) = fit(&paths, grid, OTHERWISE) else {
                panic!("{value}");
            };
            assert_eq!(survival.from, 8);
        }
        let none = Grid::new([1, 1]);
        assert!(matches!(
            fit(&[TrainingPath::default()], none, OTHERWISE),
            Roulette::Even(_)
        ));
    }

    /// Against playing all of a path's games, one by one.
    #[test]
    fn the_second_moment_is_that_of_games() {
        let (paths, _) = paths(noise);
        let inverse = vec![1.0; paths.len()];
        let relative = relative(&paths, &inverse);
        let chance = |_: usize, throughput: f64| (3.0 * throughput).clamp(0.05, 1.0);
        let (mut moment, mut expected) = (0.0, 0.0);
        for path in &relative {
            let mut survives = 1.0;
            let mut sum = 0.0;
            for (at, step) in path.iter().enumerate() {
                let goes_on = chance(0, step.throughput / survives);
                // Ends here: what was found so far, squared.
                expected += survives * (1.0 - goes_on) * sum * sum;
                survives *= goes_on;
                let next = path.get(at + 1).map_or(0.0, |next| next.left);
                moment += (step.left * step.left - next * next) / survives;
                sum += (step.left - next) / survives;
            }
            expected += survives * sum * sum;
        }
        assert!(
            (moment / expected - 1.0).abs() < 1e-9,
            "{moment} {expected}"
        );
    }
}
