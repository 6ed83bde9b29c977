//! The map from the unit square to a density that is given at the points of a grid
//! and bilinear between them: first the row by its integral, then the column.

/// Values of a density at the points of a regular grid over the unit square.
pub struct Warp {
    columns: usize,
    /// Row by row.
    values: Vec<f64>,
    /// ∫ over each row.
    rows: Vec<f64>,
}

impl Warp {
    /// Of at least two rows and columns, with an integral above 0.
    pub fn new(columns: usize, values: Vec<f64>) -> Self {
        let rows = values
            .chunks_exact(columns)
            .map(|row| trapezoids(row).iter().sum())
            .collect();
        Self {
            columns,
            values,
            rows,
        }
    }

    /// The point (column, row) in the unit square that uniform numbers stand for.
    pub fn sample(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (row, v) = invert(&self.rows, y);
        let between: Vec<f64> = (0..self.columns)
            .map(|column| {
                let at = |row: usize| self.values[row * self.columns + column];
                at(row) + v * (at(row + 1) - at(row))
            })
            .collect();
        let (column, u) = invert(&between, x);
        [
            (column as f64 + u) / (self.columns - 1) as f64,
            (row as f64 + v) / (self.rows.len() - 1) as f64,
        ]
    }
}

/// The integral of a linear interpolant over each of its parts.
fn trapezoids(values: &[f64]) -> Vec<f64> {
    let width = 0.5 / (values.len() - 1) as f64;
    values.windows(2).map(|v| width * (v[0] + v[1])).collect()
}

/// The part of a linear interpolant, and the place in it, below which a share `u` of
/// its integral lies.
fn invert(values: &[f64], u: f64) -> (usize, f64) {
    let parts = trapezoids(values);
    let mut left = u * parts.iter().sum::<f64>();
    let mut part = 0;
    while part + 1 < parts.len() && left > parts[part] {
        left -= parts[part];
        part += 1;
    }
    let (a, b) = (values[part], values[part + 1]);
    // Of t a + t² (b − a)/2 = c, the form that has no difference in it.
    let c = left * (values.len() - 1) as f64;
    let root = (a * a + 2.0 * c * (b - a)).max(0.0).sqrt();
    let place = if a + root > 0.0 {
        2.0 * c / (a + root)
    } else {
        0.0
    };
    (part, place.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the density 4xy, rows and columns are √u.
    #[test]
    fn products_are_inverted_apart() {
        let n = 9;
        let at = |i: usize| i as f64 / (n - 1) as f64;
        let values = (0..n * n).map(|i| 4.0 * at(i % n) * at(i / n)).collect();
        let warp = Warp::new(n, values);
        for [x, y] in [[0.0, 0.0], [0.25, 0.5], [0.9, 0.01], [1.0, 1.0]] {
            let [u, v] = warp.sample([x, y]);
            assert!((u - f64::sqrt(x)).abs() < 1e-12, "{x}: {u}");
            assert!((v - f64::sqrt(y)).abs() < 1e-12, "{y}: {v}");
        }
    }
}
