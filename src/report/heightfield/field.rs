//! Random height fields, and the meshes of their periodic patches.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rustfft::{FftPlanner, num_complex::Complex};

use crate::embree::{Accelerator, Device, EmbreeError, Geometry, Hit, Vertices};
use crate::rays::RayKinds;
use smithwalk_model::{Draw, Stream};

/// The random numbers of everything here.
pub(super) type Random = Stream<Pcg64Mcg>;

/// A stream of its own for the `part`-th piece of work under `seed`.
pub(super) fn stream(seed: u64, part: u64) -> Random {
    // The generator hashes its seed: neighbouring ones are unrelated.
    let mixed = seed ^ part.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    Stream(Pcg64Mcg::seed_from_u64(mixed))
}

/// The sampling of a patch: a square of `side` correlation lengths, `cells`
/// by `cells` of a grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Side in correlation lengths ℓ, the period of the surface.
    pub side: f64,
    /// Cells along a side.
    pub cells: usize,
}

/// One realisation of a stationary Gaussian field of mean 0 and variance 1,
/// periodic, on the vertices of `grid`, row by row.
///
/// The autocorrelation is e^{−r²/ℓ²} (repeated with the period), so the
/// spectrum is Gaussian as well: with k = 2πn/L and L = `side`·ℓ, mode n has
/// the variance (π ℓ²/L²) e^{−k²ℓ²/4}. Every mode gets a normal amplitude and
/// a uniform phase, so that any number of modes gives an exactly Gaussian
/// field; the real part of the transform is the realisation.
pub(super) fn synthesize(grid: Grid, rng: &mut Random) -> Vec<f64> {
    let n = grid.cells;
    let deviation = |index: usize| {
        // Indices past the middle are the negative frequencies.
        let mode = index.min(n - index) as f64;
        let x = PI * mode / grid.side;
        // One factor of √(π ℓ²/L²) e^{−k²ℓ²/4} under a square root for each axis.
        (PI.sqrt() / grid.side * (-x * x).exp()).sqrt()
    };
    let deviations: Vec<f64> = (0..n).map(deviation).collect();
    let mut field: Vec<Complex<f64>> = Vec::with_capacity(n * n);
    for &row in &deviations {
        for &column in &deviations {
            let (u, v): (f64, f64) = (rng.draw(), rng.draw());
            // Both parts standard normal (Box and Muller).
            let normal = Complex::from_polar((-2.0 * (-u).ln_1p()).sqrt(), TAU * v);
            field.push(normal * (row * column));
        }
    }
    let transform = FftPlanner::new().plan_fft_inverse(n);
    transform.process(&mut field);
    transpose(&mut field, n);
    transform.process(&mut field);
    field.into_iter().map(|c| c.re).collect()
}

fn transpose(field: &mut [Complex<f64>], n: usize) {
    for row in 0..n {
        for column in 0..row {
            field.swap(row * n + column, column * n + row);
        }
    }
}

/// The mesh of one period of a surface with Beckmann slopes, ready for rays.
///
/// Lengths are in RMS heights. With the autocorrelation e^{−x²/ℓ²} the slope
/// variance is 2/ℓ², so the slope roughness α (variance α²/2) asks for the
/// correlation length ℓ = 2/α along each axis.
pub(super) struct Patch {
    accelerator: Accelerator,
    vertices: Arc<Vertices>,
    triangles: Arc<Vec<[u32; 3]>>,
    /// Half the period along x and y; the patch is centred at the origin.
    pub half: DVec2,
    /// The lowest and the highest point.
    pub low: f64,
    /// See `low`.
    pub high: f64,
}

impl Patch {
    /// Stretches `heights` (of [`synthesize`]) to the slope roughness `alpha`.
    /// The mesh goes one cell past the period on every side: rays that end
    /// at the border by rounding still find it.
    pub fn new(
        device: &Arc<Device>,
        grid: Grid,
        heights: &[f64],
        alpha: [f64; 2],
    ) -> Result<Self, EmbreeError> {
        let n = grid.cells;
        let period = DVec2::from(alpha.map(|alpha| grid.side * 2.0 / alpha));
        let cell = period / n as f64;
        let row = n + 3;
        let mut positions = Vec::with_capacity(row * row);
        for j in 0..row {
            for i in 0..row {
                // The lattice point (i − 1, j − 1), wrapped.
                let height = heights[(j + n - 1) % n * n + (i + n - 1) % n];
                positions.push([
                    ((i as f64 - 1.0) * cell.x - 0.5 * period.x) as f32,
                    ((j as f64 - 1.0) * cell.y - 0.5 * period.y) as f32,
                    height as f32,
                ]);
            }
        }
        let mut triangles = Vec::with_capacity(2 * (row - 1) * (row - 1));
        for j in 0..row - 1 {
            for i in 0..row - 1 {
                let corner = (j * row + i) as u32;
                let above = corner + row as u32;
                triangles.push([corner, corner + 1, above]);
                triangles.push([corner + 1, above + 1, above]);
            }
        }
        let (low, high) = positions
            .iter()
            .map(|p| f64::from(p[2]))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
                (low.min(z), high.max(z))
            });
        let vertices = Arc::new(Vertices::from(positions));
        let triangles = Arc::new(triangles);
        let mesh = Geometry::Mesh {
            seen_by: RayKinds::ALL,
            vertices: Arc::clone(&vertices),
            triangles: Arc::clone(&triangles),
        };
        Ok(Self {
            accelerator: Accelerator::build(Arc::clone(device), Vec::new(), &[mesh])?,
            vertices,
            triangles,
            half: 0.5 * period,
            low,
            high,
        })
    }

    pub fn accelerator(&self) -> &Accelerator {
        &self.accelerator
    }

    /// The place of `hit` and the upper unit normal of its facet. The place
    /// comes from the facet's corners: it is as precise as they are, which
    /// the distance along a long ray is not.
    pub fn facet(&self, hit: &Hit) -> (DVec3, DVec3) {
        let corners = self.triangles[hit.triangle as usize];
        let [a, b, c] =
            corners.map(|corner| DVec3::from(self.vertices[corner as usize].map(f64::from)));
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        let (along, across) = (b - a, c - a);
        (a + u * along + v * across, along.cross(across).normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variance of heights, and of slopes along both axes, averaged over
    /// realisations; each with its standard error.
    #[test]
    fn heights_and_slopes_have_the_variance_asked_for() {
        let grid = Grid {
            side: 16.0,
            cells: 128,
        };
        let step = grid.side / grid.cells as f64;
        let n = grid.cells;
        let samples: Vec<[f64; 4]> = (0..64)
            .map(|r| {
                let h = synthesize(grid, &mut stream(7, r));
                let mut sums = [0.0; 4];
                for j in 0..n {
                    for i in 0..n {
                        let at = h[j * n + i];
                        let x = (h[j * n + (i + 1) % n] - at) / step;
                        let y = (h[(j + 1) % n * n + i] - at) / step;
                        for (sum, value) in sums.iter_mut().zip([at, at * at, x * x, y * y]) {
                            *sum += value / (n * n) as f64;
                        }
                    }
                }
                sums
            })
            .collect();
        // The variance of a difference quotient over one cell is
        // 2 (1 − e^{−step²}) / step².
        let slope = -2.0 * (-step * step).exp_m1() / (step * step);
        for (which, expected) in [0.0, 1.0, slope, slope].into_iter().enumerate() {
            let values: Vec<f64> = samples.iter().map(|s| s[which]).collect();
            let mean = values.iter().sum::<f64>() / 64.0;
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 63.0;
            let score = (mean - expected) / (variance / 64.0).sqrt();
            // Student's t with 63 degrees of freedom passes 5 once in 2e5.
            assert!(score.abs() < 5.0, "quantity {which}: {mean} for {expected}");
        }
    }

    /// The fourth moment tells a Gaussian field from one with fixed amplitudes.
    #[test]
    fn one_height_is_normally_distributed_over_realisations() {
        let grid = Grid {
            side: 2.0,
            cells: 8,
        };
        let count = 20_000;
        let mut moments = [0.0; 2];
        for r in 0..count {
            let h = synthesize(grid, &mut stream(11, r))[5];
            moments[0] += h * h / count as f64;
            moments[1] += h.powi(4) / count as f64;
        }
        // Var h² = 2 and Var h⁴ = 96; on so small a period the repetitions
        // add e^{−4} to the variance at each of the nearest four.
        let variance = (1.0 + 2.0 * (-4.0f64).exp() + 2.0 * (-16.0f64).exp()).powi(2);
        let count = count as f64;
        let scores = [
            (moments[0] / variance - 1.0) / (2.0 / count).sqrt(),
            (moments[1] / variance.powi(2) - 3.0) / (96.0 / count).sqrt(),
        ];
        assert!(scores.iter().all(|z| z.abs() < 4.5), "{scores:?}");
    }
}
