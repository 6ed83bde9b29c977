use std::f64::consts::{FRAC_PI_2, PI};
use std::marker::PhantomData;

use super::{Ndf, Real, Vector3, rotate_to_azimuth, zero};

/// A distribution of normals by rings about the macroscopic one, in each of which D is
/// constant: a measured or a made-up one, without a direction.
///
/// All that the model asks of it is closed but for the inversions of distribution
/// functions, which are numeric and exact to rounding; so a table is a distribution of its
/// own, not an approximation to one. Time goes with the number of rings.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalTable {
    /// cosθ at the edges, from 1 down.
    edges: Vec<f64>,
    /// D in each ring, sr⁻¹, with ∫ D(m) m_z dm = 1.
    density: Vec<f64>,
}

/// Why numbers are no table of normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalTableError {
    /// There is one edge more than rings, and at least one ring.
    Count {
        /// Edges given.
        edges: usize,
        /// Densities given.
        densities: usize,
    },
    /// Edges are angles from 0 that rise, to π/2 at most; this one does not.
    Edge(usize),
    /// Densities are finite, none below 0, and not all 0; this one is not.
    Density(usize),
}

impl std::fmt::Display for NormalTableError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Count { edges, densities } => write!(
                f,
                "expected an edge more than densities, found {edges} edges and {densities} densities"
            ),
            Self::Edge(index) => write!(
                f,
                "edge {index}: expected angles that begin with 0 and rise to π/2 at most"
            ),
            Self::Density(index) => write!(
                f,
                "density {index}: expected finite numbers from 0, one of them above it"
            ),
        }
    }
}

impl std::error::Error for NormalTableError {}

impl NormalTable {
    /// Rings between `edges`, angles θ from the normal in radians that begin with 0, with
    /// `densities` in proportion to D.
    ///
    /// # Errors
    /// With what is no table of normals.
    pub fn new(edges: &[f64], densities: &[f64]) -> Result<Self, NormalTableError> {
        if densities.is_empty() || edges.len() != densities.len() + 1 {
            return Err(NormalTableError::Count {
                edges: edges.len(),
                densities: densities.len(),
            });
        }
        let rises = |i: usize| {
            let below = if i == 0 {
                edges[0] == 0.0
            } else {
                edges[i] > edges[i - 1]
            };
            below && edges[i] <= FRAC_PI_2 + 1e-9
        };
        if let Some(index) = (0..edges.len()).find(|&i| !rises(i)) {
            return Err(NormalTableError::Edge(index));
        }
        let sound = |d: &f64| d.is_finite() && *d >= 0.0;
        if let Some(index) = densities.iter().position(|d| !sound(d)) {
            return Err(NormalTableError::Density(index));
        }
        let edges: Vec<f64> = edges.iter().map(|theta| theta.cos().max(0.0)).collect();
        let rings = edges.windows(2).zip(densities);
        let area: f64 = rings
            .map(|(z, d)| PI * d * (z[0] - z[1]) * (z[0] + z[1]))
            .sum();
        if area.is_nan() || area <= 0.0 || area.is_infinite() {
            return Err(NormalTableError::Density(0));
        }
        Ok(Self {
            edges,
            density: densities.iter().map(|d| d / area).collect(),
        })
    }

    /// The distribution, in the arithmetic of `F`; the table is in double precision.
    pub fn normals<F: Real>(&self) -> Tabulated<'_, F> {
        Tabulated(self, PhantomData)
    }

    /// ∫⟨m·w⟩ D(m) dm over the rings from the outermost to `ring`, for each ring in turn.
    fn areas(&self, view: View) -> impl Iterator<Item = (usize, f64)> {
        let mut below = view.area(self.edges[self.density.len()]);
        (0..self.density.len()).rev().map(move |ring| {
            let above = view.area(self.edges[ring]);
            let area = (above - below).max(0.0) * self.density[ring];
            below = above;
            (ring, area)
        })
    }
}

/// A direction by its cosine and sine.
#[derive(Clone, Copy)]
struct View {
    cos: f64,
    sin: f64,
}

impl View {
    fn of<F: Real>(w: Vector3<F>) -> Self {
        let [x, y, z] = [w.x, w.y, w.z].map(F::as_f64);
        Self {
            cos: z,
            sin: x.hypot(y),
        }
    }

    /// Half of the azimuths at which normals of cosθ = `t` are seen: ⟨m·w⟩ > 0 for
    /// |φ| below it.
    fn reach(self, t: f64) -> f64 {
        let (along, across) = (self.cos * t, self.sin * (1.0 - t * t).max(0.0).sqrt());
        if along >= across {
            PI
        } else if along <= -across {
            0.0
        } else {
            (-along / across).acos()
        }
    }

    /// ∫⟨m·w⟩ dφ at cosθ = `t`.
    fn ring(self, t: f64) -> f64 {
        let reach = self.reach(t);
        let across = self.sin * (1.0 - t * t).max(0.0).sqrt();
        2.0 * (self.cos * t * reach + across * reach.sin()).max(0.0)
    }

    /// ∫ [`View::ring`] from the horizon to cosθ = `t`.
    fn area(self, t: f64) -> f64 {
        let Self { cos, sin } = self;
        // Above that, all of a ring is seen, or nothing.
        let mixed = t.min(sin);
        let root = (sin * sin - mixed * mixed).max(0.0).sqrt();
        let turned = if sin > 0.0 {
            (mixed / sin).min(1.0).asin()
        } else {
            0.0
        };
        let partly = cos * mixed * mixed * self.reach(mixed) - cos * (cos * mixed).atan2(root)
            + turned
            + mixed * root;
        partly + PI * cos.max(0.0) * ((t - mixed) * (t + mixed)).max(0.0)
    }
}

/// The distribution of a [`NormalTable`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tabulated<'a, F>(&'a NormalTable, PhantomData<F>);

impl<F: Real> Ndf for Tabulated<'_, F> {
    type Scalar = F;

    fn density(&self, m: Vector3<F>) -> F {
        let z = m.z.as_f64();
        let table = self.0;
        // Edges fall: the ring is before the first edge that is not above z.
        let edge = table.edges.partition_point(|&edge| edge > z);
        let ring = edge.max(1) - 1;
        if z <= 0.0 || ring >= table.density.len() {
            return F::zero();
        }
        F::of(table.density[ring])
    }

    fn projected_area(&self, w: Vector3<F>) -> F {
        // From above, what is seen from below and the cosine: no digits are lost.
        let view = View::of(w);
        let below = View {
            cos: -view.cos.abs(),
            ..view
        };
        let area: f64 = self.0.areas(below).map(|(_, area)| area).sum();
        F::of(area + view.cos.max(0.0))
    }

    /// The ring by its share of the area that is seen, the cosine in it and the azimuth
    /// by inverting their distribution functions.
    fn sample_visible(&self, w: Vector3<F>, u: [F; 2]) -> Vector3<F> {
        let view = View::of(w);
        let table = self.0;
        let total: f64 = table.areas(view).map(|(_, area)| area).sum();
        let mut left = u[0].as_f64() * total;
        let mut chosen = None;
        for (ring, area) in table.areas(view) {
            if area > 0.0 {
                chosen = Some((ring, left.min(area)));
                if left <= area {
                    break;
                }
            }
            left -= area;
        }
        let Some((ring, left)) = chosen else {
            // Nothing is seen: the limit is a horizontal normal.
            return rotate_to_azimuth(w.x, w.y, Vector3::new(F::one(), F::zero(), F::zero()));
        };
        let (low, high) = (table.edges[ring + 1], table.edges[ring]);
        let target = view.area(low) + left / table.density[ring];
        let z = zero(|t| (view.area(t) - target, view.ring(t)), low, high);
        let reach = view.reach(z);
        let sin = (1.0 - z * z).max(0.0).sqrt();
        let (along, across) = (view.cos * z, view.sin * sin);
        let half = along * reach + across * reach.sin();
        let target = (2.0 * u[1].as_f64() - 1.0) * half;
        let turned = |phi: f64| {
            let facing = (along + across * phi.cos()).max(0.0);
            (along * phi + across * phi.sin() - target, facing)
        };
        let phi = zero(turned, -reach, reach);
        let m = Vector3::new(sin * phi.cos(), sin * phi.sin(), z);
        let m = Vector3::new(F::of(m.x), F::of(m.y), F::of(m.z));
        rotate_to_azimuth(w.x, w.y, m).normalized()
    }
}
