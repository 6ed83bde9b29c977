//! Look-up tables of colours: `.cube` files over a logarithmic domain.

use std::io::Read;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::file;
use crate::text::excerpt;

/// The most nodes per side: 256³ triples take 200 MB.
const MOST: usize = 256;
/// Bytes of a file that are read: the longest table's, with 60 for each triple.
const LONGEST: u64 = 60 * (MOST * MOST * MOST) as u64;

/// How scene-linear values become places in a table: log₂(x + offset), `min` to `max` on
/// the whole table, cut off beyond. OpenColorIO calls this the `lg2` allocation.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Log2 {
    /// What is added before the logarithm, so that black has one.
    pub offset: f32,
    /// The logarithm at the table's first node.
    pub min: f32,
    /// The logarithm at the table's last node.
    pub max: f32,
}

/// A table of display colours over scene-linear ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Lut {
    domain: Log2,
    /// Nodes per side.
    side: usize,
    /// Red fastest, encoded for the display, in [0, 1].
    nodes: Vec<[f32; 3]>,
}

/// Why a file is no table.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {message}", path.display(), line.map(|n| format!(":{n}")).unwrap_or_default())]
pub struct LutError {
    path: PathBuf,
    /// From 1.
    line: Option<usize>,
    message: String,
}

impl Lut {
    /// Reads a `.cube` file with a three-dimensional table (Adobe, Cube LUT Specification
    /// 1.0) over the unit cube.
    ///
    /// # Errors
    /// When the file can't be read, or is not such a table: with file and line.
    pub fn read(path: &Path, domain: Log2) -> Result<Self, LutError> {
        let error = |line, message| LutError {
            path: path.to_owned(),
            line,
            message,
        };
        let mut text = String::new();
        file::open(path)
            .and_then(|file| file.take(LONGEST).read_to_string(&mut text))
            .map_err(|e| error(None, e.to_string()))?;
        Self::parse(&text, domain).map_err(|(line, message)| error(line, message))
    }

    /// The table, or the line (from 1) of a fault and what it is.
    fn parse(text: &str, domain: Log2) -> Result<Self, (Option<usize>, String)> {
        let mut side = None;
        let mut nodes = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let expected = |what: &str| {
                let message = format!("expected {what}, found `{}`", excerpt(line));
                (Some(index + 1), message)
            };
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                [] => {}
                [first, ..] if first.starts_with('#') || first == "TITLE" => {}
                ["LUT_3D_SIZE", count] => {
                    let count = count.parse().ok().filter(|n| (2..=MOST).contains(n));
                    side = Some(count.ok_or_else(|| expected(&format!("2 to {MOST} nodes")))?);
                }
                ["DOMAIN_MIN", ref color @ ..] if numbers(color) == Some([0.0; 3]) => {}
                ["DOMAIN_MAX", ref color @ ..] if numbers(color) == Some([1.0; 3]) => {}
                [first, ..] if first.starts_with("DOMAIN") => {
                    return Err(expected("a domain of 0 0 0 to 1 1 1"));
                }
                ref color if side.is_some() => {
                    let color = numbers(color).ok_or_else(|| expected("three numbers"))?;
                    nodes.push(color.map(|x| x.clamp(0.0, 1.0)));
                }
                _ => return Err(expected("LUT_3D_SIZE")),
            }
        }
        let side: usize = side.ok_or_else(|| (None, "has no LUT_3D_SIZE".to_owned()))?;
        let (expected, found) = (side.pow(3), nodes.len());
        if found != expected {
            let message = format!("expected {expected} colours of {side}³ nodes, found {found}");
            return Err((None, message));
        }
        Ok(Self {
            domain,
            side,
            nodes,
        })
    }

    /// A table of these colours, in [0, 1] and red fastest, on `side` nodes per side; `None`
    /// where they are no table's.
    pub(crate) fn new(domain: Log2, side: usize, nodes: Vec<[f32; 3]>) -> Option<Self> {
        let is_color = |&x: &f32| (0.0..=1.0).contains(&x);
        let is_table = (2..=MOST).contains(&side)
            && nodes.len() == side.pow(3)
            && nodes.as_flattened().iter().all(is_color);
        is_table.then_some(Self {
            domain,
            side,
            nodes,
        })
    }

    /// How values become places in the table.
    #[must_use]
    pub fn domain(&self) -> Log2 {
        self.domain
    }

    /// Nodes per side.
    #[must_use]
    pub fn side(&self) -> usize {
        self.side
    }

    /// The colours of all nodes, red fastest, in [0, 1].
    pub(crate) fn nodes(&self) -> &[[f32; 3]] {
        &self.nodes
    }

    /// The display's colour for a scene-linear one, by the tetrahedron of nodes around it;
    /// NaN counts as black.
    #[must_use]
    pub fn look_up(&self, color: [f32; 3]) -> [f32; 3] {
        let Log2 { offset, min, max } = self.domain;
        let last = (self.side - 1) as f32;
        let places = color.map(|c| {
            // `max` turns NaN into its other operand.
            let log = (c.max(0.0) + offset).log2();
            ((log - min) / (max - min)).clamp(0.0, 1.0) * last
        });
        let cells = places.map(|p| (p as usize).min(self.side - 2));
        let within = [0, 1, 2].map(|i| places[i] - cells[i] as f32);
        let strides = [1, self.side, self.side * self.side];
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| within[b].total_cmp(&within[a]));
        // From the cell's lowest corner to its highest, along the steepest axis first.
        let mut node = (0..3).map(|i| cells[i] * strides[i]).sum::<usize>();
        let mut weight = 1.0 - within[order[0]];
        let mut sum = self.nodes[node].map(|x| weight * x);
        for (step, axis) in order.into_iter().enumerate() {
            node += strides[axis];
            weight = within[axis] - order.get(step + 1).map_or(0.0, |&next| within[next]);
            for (sum, x) in sum.iter_mut().zip(self.nodes[node]) {
                *sum += weight * x;
            }
        }
        sum
    }
}

/// Three finite numbers.
fn numbers(words: &[&str]) -> Option<[f32; 3]> {
    let parse = |word: &&str| word.parse().ok().filter(|x: &f32| x.is_finite());
    let numbers: Option<Vec<f32>> = words.iter().map(parse).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOMAIN: Log2 = Log2 {
        offset: 1.0,
        min: 0.0,
        max: 4.0,
    };

    /// A table of values that are linear in the places gives back the places.
    #[test]
    fn what_is_linear_is_interpolated_exactly() {
        let mut text = String::from("TITLE \"test\"\n# red fastest\nLUT_3D_SIZE 5\n");
        for i in 0..125 {
            let [r, g, b] = [i % 5, i / 5 % 5, i / 25].map(|n| n as f32 / 4.0);
            text += &format!("{r} {} {b}\n", 0.5 * g + 0.25 * r);
        }
        let lut = Lut::parse(&text, DOMAIN).expect("a table");
        for color in [[0.0, 1.0, 3.0], [0.3, 6.5, 14.9], [2.2, 2.2, 0.1]] {
            let [r, g, b] = color.map(|c: f32| (c + 1.0).log2() / 4.0);
            let expected = [r, 0.5 * g + 0.25 * r, b];
            for (found, expected) in lut.look_up(color).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-6, "{found} for {expected}");
            }
        }
        assert_eq!(
            lut.look_up([f32::NAN, -3.0, f32::INFINITY]),
            [0.0, 0.0, 1.0]
        );
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let table = |side: usize, node: f32| Lut::new(DOMAIN, side, vec![[node; 3]; 8]);
        assert!(table(2, 0.5).is_some());
        for (side, node) in [(0, 0.5), (1, 0.5), (3, 0.5), (2, 1.5), (2, f32::NAN)] {
            assert_eq!(table(side, node), None, "{side}, {node}");
        }
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let cases = [
            (
                "LUT_3D_SIZE 1",
                Some(1),
                "expected 2 to 256 nodes, found `LUT_3D_SIZE 1`",
            ),
            (
                "LUT_1D_SIZE 4",
                Some(1),
                "expected LUT_3D_SIZE, found `LUT_1D_SIZE 4`",
            ),
            (
                "LUT_3D_SIZE 2\n0 0",
                Some(2),
                "expected three numbers, found `0 0`",
            ),
            (
                "LUT_3D_SIZE 2\n0 0 nan",
                Some(2),
                "expected three numbers, found `0 0 nan`",
            ),
            (
                "DOMAIN_MAX 1 1 2",
                Some(1),
                "expected a domain of 0 0 0 to 1 1 1, found `DOMAIN_MAX 1 1 2`",
            ),
            (
                "LUT_3D_SIZE 2\n0 0 0",
                None,
                "expected 8 colours of 2³ nodes, found 1",
            ),
            ("", None, "has no LUT_3D_SIZE"),
        ];
        for (text, line, message) in cases {
            let fault = Lut::parse(text, DOMAIN).expect_err(text);
            assert_eq!(fault, (line, message.to_owned()));
        }
    }
}
