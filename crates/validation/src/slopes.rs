//! Quadrature and cells over the normals that are seen from a direction.
//!
//! In slopes divided by α, the part of the plane that faces ω is a half-plane,
//! p < c along the azimuth of ω, q any across. So no integrand has a kink, and
//! Gauss quadrature converges for any roughness, anisotropy and direction.

use super::model::Distribution;
use super::statistics::gauss;
use smithwalk_model::Vector3;

/// Slope coordinates for the normals seen from a direction.
pub struct Slopes {
    alpha: (f64, f64),
    /// Unit vector along which p is measured.
    along: (f64, f64),
    /// The slope p at which facets turn away; may be infinite.
    end: f64,
    /// The length in p on which the density falls off below the end.
    fall: f64,
    gaussian: bool,
}

impl Slopes {
    /// Coordinates for the normals of `d` seen from `w`.
    pub fn seen(d: Distribution, w: Vector3<f64>) -> Self {
        let alpha = d.alpha();
        let (x, y) = (alpha.0 * w.x, alpha.1 * w.y);
        let length = x.hypot(y);
        let along = if length > 0.0 {
            (x / length, y / length)
        } else {
            (1.0, 0.0)
        };
        let end = w.z / length;
        let gaussian = matches!(d, Distribution::Beckmann(_));
        let depth = 1.0 + (-end).max(0.0);
        let fall = if gaussian { depth.recip() } else { depth };
        Self {
            alpha,
            along,
            end,
            fall,
            gaussian,
        }
    }

    /// Across, densities fall off on this length.
    fn breadth(&self, p: f64) -> f64 {
        if self.gaussian { 1.0 } else { p.hypot(1.0) }
    }

    /// The normal at (p, q), and the solid angle per dp dq.
    fn normal(&self, p: f64, q: f64) -> (Vector3<f64>, f64) {
        let (x, y) = (
            p * self.along.0 - q * self.along.1,
            p * self.along.1 + q * self.along.0,
        );
        let m = Vector3::new(-self.alpha.0 * x, -self.alpha.1 * y, 1.0).normalized();
        (m, self.alpha.0 * self.alpha.1 * m.z.powi(3))
    }

    /// The two parts of the half-plane, as ranges of the coordinate s in which
    /// p is even: p = start ± fall·s/(1 − s).
    fn parts(&self) -> [(f64, f64, f64); 2] {
        let start = self.end.min(0.0);
        let rest = self.end - start;
        let last = if rest.is_infinite() {
            1.0
        } else {
            rest / (self.fall + rest)
        };
        [(start, -self.fall, 1.0), (start, self.fall, last)]
    }

    /// The rectangle [s0, s1] × [t0, t1] of part `part`, by `rule`², where q is
    /// breadth·t/(1 − |t|): calls `each` with a normal and its solid angle.
    fn rectangle(
        &self,
        part: usize,
        (s0, s1): (f64, f64),
        (t0, t1): (f64, f64),
        rule: &[(f64, f64)],
        each: &mut impl FnMut(Vector3<f64>, f64),
    ) {
        let (start, fall, _) = self.parts()[part];
        for &(x, u) in rule {
            let s = s0 + (s1 - s0) * x;
            let p = start + fall * s / (1.0 - s);
            let dp = (s1 - s0) * fall.abs() / (1.0 - s).powi(2);
            let breadth = self.breadth(p);
            for &(y, v) in rule {
                let t = t0 + (t1 - t0) * y;
                let q = breadth * t / (1.0 - t.abs());
                let dq = (t1 - t0) * breadth / (1.0 - t.abs()).powi(2);
                let (m, per_slope) = self.normal(p, q);
                each(m, u * v * dp * dq * per_slope);
            }
        }
    }

    /// ∫ g(m) dm over the normals that are seen, with `n` nodes a side.
    pub fn integrate(&self, n: usize, mut g: impl FnMut(Vector3<f64>) -> f64) -> f64 {
        let rule = gauss(n);
        let mut sum = 0.0;
        for (part, (.., last)) in self.parts().into_iter().enumerate() {
            if last > 0.0 {
                for t in [(-1.0, 0.0), (0.0, 1.0)] {
                    self.rectangle(part, (0.0, last), t, &rule, &mut |m, dm| sum += dm * g(m));
                }
            }
        }
        sum
    }

    /// How many cells [`Slopes::cell`] has.
    pub const CELLS: usize = 2 * Self::SIDE * Self::SIDE;
    const SIDE: usize = 8;

    /// The cell that holds the normal `m`.
    pub fn cell(&self, m: Vector3<f64>) -> usize {
        let (x, y) = (-m.x / (self.alpha.0 * m.z), -m.y / (self.alpha.1 * m.z));
        let p = x * self.along.0 + y * self.along.1;
        let q = y * self.along.0 - x * self.along.1;
        let start = self.end.min(0.0);
        let part = usize::from(p > start);
        let last = self.parts()[part].2;
        let far = (p - start).abs() / self.fall;
        let s = if far.is_finite() {
            far / (1.0 + far)
        } else {
            1.0
        };
        let breadth = self.breadth(p);
        let t = if q.is_finite() {
            q / (breadth + q.abs())
        } else {
            q.signum()
        };
        let side = Self::SIDE as f64;
        let i = (s / last * side) as usize;
        let j = (0.5 * (t + 1.0) * side) as usize;
        (part * Self::SIDE + i.min(Self::SIDE - 1)) * Self::SIDE + j.min(Self::SIDE - 1)
    }

    /// ∫ g(m) dm over each cell, to about `tolerance`.
    pub fn integrate_cells(&self, tolerance: f64, g: impl Fn(Vector3<f64>) -> f64) -> Vec<f64> {
        let rules = [gauss(5), gauss(8)];
        let side = Self::SIDE as f64;
        let mut sums = vec![0.0; Self::CELLS];
        for (part, (.., last)) in self.parts().into_iter().enumerate() {
            if last <= 0.0 {
                continue;
            }
            for i in 0..Self::SIDE {
                for j in 0..Self::SIDE {
                    let edge = |k: usize| last * k as f64 / side;
                    let across = |k: usize| 2.0 * k as f64 / side - 1.0;
                    sums[(part * Self::SIDE + i) * Self::SIDE + j] = self.refined(
                        part,
                        [(edge(i), edge(i + 1)), (across(j), across(j + 1))],
                        &rules,
                        (tolerance, 0),
                        &g,
                    );
                }
            }
        }
        sums
    }

    /// ∫ g(m) dm over a rectangle; where two rules disagree, as they do where
    /// total reflection sets in, over its quarters.
    fn refined(
        &self,
        part: usize,
        [s, t]: [(f64, f64); 2],
        rules: &[Vec<(f64, f64)>; 2],
        (tolerance, depth): (f64, u32),
        g: &impl Fn(Vector3<f64>) -> f64,
    ) -> f64 {
        const DEEPEST: u32 = 5;
        let [coarse, fine] = [0, 1].map(|k| {
            let mut sum = 0.0;
            self.rectangle(part, s, t, &rules[k], &mut |m, dm| sum += dm * g(m));
            sum
        });
        if depth == DEEPEST || (fine - coarse).abs() <= tolerance {
            return fine;
        }
        let middle = |(a, b): (f64, f64)| 0.5 * (a + b);
        let halves = |r: (f64, f64)| [(r.0, middle(r)), (middle(r), r.1)];
        let mut sum = 0.0;
        for s in halves(s) {
            for t in halves(t) {
                sum += self.refined(part, [s, t], rules, (0.5 * tolerance, depth + 1), g);
            }
        }
        sum
    }
}
