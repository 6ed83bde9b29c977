//! The configurations that are checked.

use super::model::Distribution;
use smithwalk_model::{StudentT, Vector3};

/// How much is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// The corners of the grid, with few samples.
    Quick,
    /// The whole grid.
    Full,
}

impl Effort {
    /// `quick` or `full`, as the effort is.
    pub fn pick<T>(self, quick: T, full: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Full => full,
        }
    }

    /// GGX and Beckmann over roughness and anisotropy, the quadratic one, and Student's
    /// t-distribution between them. (Its longer tails, γ < 2, are beyond the quadrature.)
    pub fn distributions(self) -> Vec<Distribution> {
        let alphas: &[(f64, f64)] = self.pick(
            &[(0.01, 0.01), (0.5, 0.5), (2.0, 2.0), (1.0, 0.05)],
            &[
                (0.01, 0.01),
                (0.05, 0.05),
                (0.2, 0.2),
                (0.5, 0.5),
                (1.0, 1.0),
                (2.0, 2.0),
                (0.01, 0.2),
                (1.0, 0.05),
                (0.1, 2.0),
            ],
        );
        let mut all = vec![Distribution::Quadratic];
        for &(alpha_x, alpha_y) in alphas {
            all.extend(Distribution::of_roughness(alpha_x, alpha_y));
        }
        let students: &[(f64, f64, f64)] = self.pick(
            &[(0.5, 0.5, 2.5), (1.0, 0.2, 4.0)],
            &[
                (0.2, 0.2, 2.5),
                (0.5, 0.5, 2.5),
                (0.5, 0.5, 4.0),
                (1.0, 1.0, 3.0),
                (1.0, 0.2, 20.0),
            ],
        );
        all.extend(students.iter().map(|&(alpha_x, alpha_y, gamma)| {
            Distribution::StudentT(StudentT {
                alpha_x,
                alpha_y,
                gamma,
            })
        }));
        all
    }

    /// Directions above the surface, from grazing to the normal.
    pub fn views(self) -> Vec<Vector3<f64>> {
        let cosines: &[f64] = self.pick(&[0.01, 0.3, 1.0], &[0.01, 0.05, 0.2, 0.5, 0.8, 1.0]);
        directions(cosines)
    }

    /// Directions on the whole sphere: rays inside also see the surface from
    /// below.
    pub fn sphere(self) -> Vec<Vector3<f64>> {
        let cosines: &[f64] = self.pick(
            &[-0.5, 0.01, 0.5, 1.0],
            &[-0.9, -0.4, -0.05, 0.01, 0.1, 0.4, 0.8, 1.0],
        );
        directions(cosines)
    }

    /// Relative indices of refraction, both ways through the surface.
    pub fn indices(self) -> &'static [f64] {
        self.pick(&[1.0 / 1.5, 1.5], &[0.5, 1.0 / 1.5, 1.1, 1.5, 3.0])
    }

    /// `distributions` × `views`.
    pub fn views_of_all(self) -> Vec<(Distribution, Vector3<f64>)> {
        cross(&self.distributions(), &self.views())
    }

    /// `distributions` × `sphere`, but for directions from so far below that
    /// less than 10⁻⁹ of the surface can be seen.
    pub fn sphere_of_all(self) -> Vec<(Distribution, Vector3<f64>)> {
        use smithwalk_model::Ndf;
        let mut all = cross(&self.distributions(), &self.sphere());
        all.retain(|(d, w)| d.projected_area(*w) > 1e-9);
        all
    }
}

/// Directions with the given cosines and azimuths off all axes.
fn directions(cosines: &[f64]) -> Vec<Vector3<f64>> {
    let azimuth = |i: usize| 0.4 + 1.3 * i as f64;
    let cosines = cosines.iter().enumerate();
    cosines
        .map(|(i, &cos)| Vector3::spherical(cos, azimuth(i)))
        .collect()
}

/// All pairs.
pub fn cross<A: Copy, B: Copy>(a: &[A], b: &[B]) -> Vec<(A, B)> {
    a.iter()
        .flat_map(|&a| b.iter().map(move |&b| (a, b)))
        .collect()
}
