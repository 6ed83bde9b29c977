//! Rectangles seen from a point, sampled uniformly in solid angle (Ureña, Fajardo and
//! King 2013, "An Area-Preserving Parametrization for Spherical Rectangles"; names as
//! there).

use num_traits::{Float, FloatConst};

/// The steepest view, as the distance across over that to the plane, that f32 is enough
/// for. Beyond, angles cancel, and it takes f64.
const STEEPEST: f32 = 8.0;

/// The smallest rectangle, in sr, that is sampled as such: half way between what
/// rounding costs in f64 (about 1e-12 sr) and what it gains.
const LEAST_SOLID_ANGLE: f64 = 1e-6;

/// A rectangle in a plane at the distance 1, parallel to the axes.
pub(super) enum SphericalRectangle {
    /// In f32.
    Ordinary(Rectangle<f32>),
    /// In f64.
    Grazing(Rectangle<f64>),
}

impl SphericalRectangle {
    /// Between these two abscissae and these two ordinates, over the distance to the
    /// plane, each pair ascending. `None` where it is too small to be worth it.
    #[inline]
    pub fn new(x: [f32; 2], y: [f32; 2]) -> Option<Self> {
        let is_ordinary = |sides: [f32; 2]| sides[0] > -STEEPEST && sides[1] < STEEPEST;
        if is_ordinary(x) && is_ordinary(y) {
            Rectangle::new(x, y).map(Self::Ordinary)
        } else {
            Rectangle::new(x.map(f64::from), y.map(f64::from)).map(Self::Grazing)
        }
    }

    /// In sr.
    pub fn solid_angle(&self) -> f32 {
        match self {
            Self::Ordinary(rectangle) => rectangle.solid_angle,
            Self::Grazing(rectangle) => rectangle.solid_angle as f32,
        }
    }

    /// A point of it, over the distance to the plane.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> [f32; 2] {
        match self {
            Self::Ordinary(rectangle) => rectangle.sample(u),
            Self::Grazing(rectangle) => rectangle.sample(u.map(f64::from)).map(|at| at as f32),
        }
    }
}

/// The same in one type of number.
pub(super) struct Rectangle<T> {
    x: [T; 2],
    y: [T; 2],
    /// e^(i·k); the angle itself would take arc cosines.
    k: Turn<T>,
    solid_angle: T,
}

/// An angle, as that of a complex number.
#[derive(Clone, Copy)]
struct Turn<T> {
    cos: T,
    sin: T,
}

impl<T: Float + FloatConst> Turn<T> {
    fn of(angle: T) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { cos, sin }
    }

    /// The sum of two angles.
    fn and(self, other: Self) -> Self {
        Self {
            cos: self.cos * other.cos - self.sin * other.sin,
            sin: self.sin * other.cos + self.cos * other.sin,
        }
    }

    fn back(self) -> Self {
        Self {
            sin: -self.sin,
            ..self
        }
    }

    /// The same angle, of a number of length 1.
    fn unit(self) -> Self {
        let scale = (self.cos * self.cos + self.sin * self.sin).sqrt().recip();
        Self {
            cos: self.cos * scale,
            sin: self.sin * scale,
        }
    }

    /// The angle, from 0 to 2π.
    fn angle(self) -> T {
        let angle = self.sin.atan2(self.cos);
        // What rounding leaves of 0 stays next to it.
        if angle < -T::epsilon().sqrt() {
            angle + T::TAU()
        } else {
            angle
        }
    }
}

impl<T: Float + FloatConst> Rectangle<T> {
    #[inline]
    fn new(x: [T; 2], y: [T; 2]) -> Option<Self> {
        // From the foot of the point to a corner it is arctan(xy / √(1 + x² + y²)).
        let to = |x: T, y: T| Turn {
            cos: (T::one() + x * x + y * y).sqrt(),
            sin: x * y,
        };
        let [left, right] = x.map(|x| to(x, y[1]).and(to(x, y[0]).back()).unit());
        let solid_angle = right.and(left.back()).angle();
        // Nor where numbers have left their range.
        (solid_angle > T::from(LEAST_SOLID_ANGLE)?).then_some(Self {
            x,
            y,
            k: Turn {
                cos: -left.cos,
                sin: -left.sin,
            },
            solid_angle,
        })
    }

    #[inline]
    fn sample(&self, u: [T; 2]) -> [T; 2] {
        let (one, &Self { x, y, .. }) = (T::one(), self);
        let squared = y.map(|y| y * y + one);
        let [b0, b1] = [-y[0] / squared[0].sqrt(), y[1] / squared[1].sqrt()];
        let Turn { cos, sin } = Turn::of(u[0] * self.solid_angle).and(self.k);
        let fu = (cos * b0 - b1) / sin;
        // Rounding can leave the rectangle, and 0/0 on its edge leaves the numbers.
        let over_x_squared = (fu * fu - squared[0].recip()).max(T::zero());
        let xu = over_x_squared.sqrt().recip().copysign(fu);
        let xu = num_traits::clamp(xu, x[0], x[1]);
        let d_squared = xu * xu + one;
        let h = y.map(|y| y / (y * y + d_squared).sqrt());
        let hv = h[0] + u[1] * (h[1] - h[0]);
        let yv = hv * (d_squared / (one - hv * hv).max(T::min_positive_value())).sqrt();
        [xu, num_traits::clamp(yv, y[0], y[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECTANGLES: [[[f32; 2]; 2]; 5] = [
        [[-0.3, 0.4], [-0.2, 0.5]],
        [[-7.9, 7.9], [-7.9, 7.9]],
        [[7.5, 7.9], [-0.1, 7.9]],
        [[-7.9, -0.5], [0.1, 0.5]],
        [[0.0, 2.0], [-3.0, 0.0]],
    ];

    /// Where f32 is enough, f64 says the same.
    #[test]
    fn both_types_of_number_agree() {
        for [x, y] in RECTANGLES {
            let ordinary = Rectangle::new(x, y).expect("large enough");
            let exact = Rectangle::new(x.map(f64::from), y.map(f64::from)).expect("large enough");
            let off = f64::from(ordinary.solid_angle) / exact.solid_angle - 1.0;
            assert!(off.abs() < 2e-5, "{x:?} {y:?}: {off:e}");
            for i in 0..64_u8 {
                let u = [i / 8, i % 8].map(|k| (f32::from(k) + 0.5) / 8.0);
                let at = exact.sample(u.map(f64::from));
                for (a, b) in ordinary.sample(u).into_iter().zip(at) {
                    let off = f64::from(a) - b;
                    assert!(
                        off.abs() < 2e-3 * (1.0 + b.abs()),
                        "{x:?} {y:?} {u:?}: {off:e}"
                    );
                }
            }
        }
    }

    /// A share of u[0] and of u[1] is that share of the solid angle, as a midpoint
    /// quadrature of 1/(1 + x² + y²)^(3/2) has it.
    #[test]
    fn points_are_uniform_in_solid_angle() {
        let quadrature = |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| -> f64 {
            const N: u32 = 400;
            let (dx, dy) = ((x1 - x0) / f64::from(N), (y1 - y0) / f64::from(N));
            let at = |k: u32, start: f64, step: f64| start + (f64::from(k) + 0.5) * step;
            let points = (0..N * N).map(|k| (at(k / N, x0, dx), at(k % N, y0, dy)));
            points
                .map(|(x, y)| (1.0 + x * x + y * y).powf(-1.5) * dx * dy)
                .sum()
        };
        for [x, y] in RECTANGLES {
            let [x, y] = [x, y].map(|sides| sides.map(f64::from));
            let rectangle = Rectangle::new(x, y).expect("large enough");
            let all = quadrature(x, y);
            assert!((rectangle.solid_angle / all - 1.0).abs() < 1e-3);
            for u in [0.1, 0.5, 0.8] {
                let [to, _] = rectangle.sample([u, 0.5]);
                let share = quadrature([x[0], to], y) / all;
                assert!((share - u).abs() < 1e-3, "{x:?} {y:?}: {share} for {u}");
                // Along a line of points with the same u[0].
                let [at, to] = rectangle.sample([0.3, u]);
                let line = [at, at + 1e-6];
                let share = quadrature(line, [y[0], to]) / quadrature(line, y);
                assert!((share - u).abs() < 1e-3, "{x:?} {y:?}: {share} for {u}");
            }
        }
    }
}
