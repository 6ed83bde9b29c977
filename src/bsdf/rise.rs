//! How far the Fresnel reflectance of a rough interface has risen: what a layer
//! darkens those below it by.
//!
//! Cycles 4 and later take E = (1 − s) F₀ + s F₉₀ for the albedo of an interface
//! towards the viewer, with s the mean of (F − F₀)/(1 − F₀) over the visible
//! normals that reflect above the horizon, 0 for the others. That is computed
//! here from the model's own normals and Fresnel's law.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::compensation::{SobolPoint, between, split};
use smithwalk_model::{Draw, Ggx, Ndf, Vector3, fresnel};

/// Nodes along each axis.
const NODES: usize = 17;

/// Visible normals at each node.
const NORMALS: u32 = 1024;

/// s by √α, √cosθ and the index, even in ((η − 1)/(η + 1))^½: most nodes are
/// where indices are, from 1 to 2.
#[derive(Debug)]
pub struct Rises(Vec<f32>);

impl Rises {
    /// The table for GGX, computed when it is first asked for (about a second of CPU
    /// time) and kept for the life of the process.
    pub fn of_ggx() -> &'static Self {
        static TABLE: OnceLock<Rises> = OnceLock::new();
        TABLE.get_or_init(|| {
            let node = |i: usize| {
                let axis = |n: usize| (n % NODES) as f32 / (NODES - 1) as f32;
                let (z, y, x) = (axis(i / (NODES * NODES)), axis(i / NODES), axis(i));
                mean_rise(x * x, y * y, index_at(z))
            };
            Self(
                (0..NODES * NODES * NODES)
                    .into_par_iter()
                    .map(node)
                    .collect(),
            )
        })
    }

    /// s at slope roughness α = `alpha`, seen at the cosine `cos`, for the relative
    /// index `eta`.
    #[must_use]
    pub fn at(&self, alpha: f32, cos: f32, eta: f32) -> f32 {
        let (i, x) = split(alpha.sqrt(), NODES);
        let (j, y) = split(cos.max(0.0).sqrt(), NODES);
        let (k, z) = split(((eta - 1.0) / (eta + 1.0)).abs().sqrt(), NODES);
        let row = |j: usize, k: usize| {
            let at = (k * NODES + j) * NODES + i;
            between(self.0[at], self.0[at + 1], x)
        };
        let plane = |k: usize| between(row(j, k), row(j + 1, k), y);
        between(plane(k), plane(k + 1), z)
    }
}

/// The index whose ((η − 1)/(η + 1))^½ is `z`; finite at 1.
fn index_at(z: f32) -> f32 {
    let r = (z * z).min(0.98);
    (1.0 + r) / (1.0 - r)
}

/// s by Sobol points.
fn mean_rise(alpha: f32, cos: f32, eta: f32) -> f32 {
    let ndf = Ggx::isotropic(alpha.max(1e-6));
    let w = Vector3::spherical(cos.max(1e-4), 0.0);
    let rise = |index| {
        let mut point = SobolPoint::new(index);
        let m = ndf.sample_visible(w, [point.draw(), point.draw()]);
        let cos = w.dot(m);
        if 2.0 * cos * m.z > w.z {
            fresnel::rise(cos.clamp(0.0, 1.0), eta)
        } else {
            0.0
        }
    };
    (0..NORMALS).map(rise).sum::<f32>() / NORMALS as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A smooth interface has the rise of Fresnel's law itself.
    #[test]
    fn smooth_interfaces_rise_as_fresnel_says() {
        let table = Rises::of_ggx();
        for eta in [1.33, 1.5, 2.0] {
            for cos in [1.0, 0.7, 0.4, 0.15f32] {
                let (found, expected) = (table.at(0.0, cos, eta), fresnel::rise(cos, eta));
                assert!(
                    (found - expected).abs() < 8e-3,
                    "η {eta}, cos {cos}: {found} {expected}"
                );
            }
        }
    }

    /// Between nodes, against the mean itself: what interpolation leaves is far
    /// below a percent of what lies below.
    #[test]
    fn the_table_holds_between_its_nodes() {
        let table = Rises::of_ggx();
        for alpha in [0.03, 0.11, 0.47, 0.9] {
            for cos in [0.97, 0.61, 0.33, 0.12] {
                for eta in [1.2, 1.45, 1.8] {
                    let (found, mean) = (table.at(alpha, cos, eta), mean_rise(alpha, cos, eta));
                    assert!(
                        (found - mean).abs() < 8e-3,
                        "α {alpha}, cos {cos}, η {eta}: {found} {mean}"
                    );
                }
            }
        }
    }
}
