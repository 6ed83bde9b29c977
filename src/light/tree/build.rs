//! Which lights share a branch.

use super::{Cone, Extent, LEAF, Node, Tree, WIDTH};
use arrayvec::ArrayVec;
use glam::Vec3;
use std::ops::Range;
use wide::f32x8;

/// Places along each axis between which a branch may be cut.
const BINS: usize = 16;

/// From this depth on branches are cut in halves, so that no placement of the
/// lights makes a path longer than this and a few steps.
const DEPTH_OF_HALVES: usize = 24;

/// Light that leaves closer than this to the edge of its cone, in cosines, is
/// within rounding of it.
const EDGE: f32 = 1e-3;

/// The lights of a branch, taken together.
#[derive(Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
    intensity: f64,
    /// The mean softening, times the intensity.
    softening: f64,
    cone: Option<Cone>,
}

impl Bounds {
    const NONE: Self = Self {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
        intensity: 0.0,
        softening: 0.0,
        cone: None,
    };

    fn of(extent: &Extent) -> Self {
        let intensity = f64::from(extent.intensity);
        Self {
            low: extent.center - extent.radius,
            high: extent.center + extent.radius,
            intensity,
            softening: intensity * f64::from(extent.softening),
            cone: Some(extent.cone),
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            intensity: self.intensity + other.intensity,
            softening: self.softening + other.softening,
            cone: match (self.cone, other.cone) {
                (Some(a), Some(b)) => Some(a.union(b)),
                (a, b) => a.or(b),
            },
        }
    }

    /// The paper's M_A · M_Ω · intensity, with the squared diagonal for the area:
    /// lights in a plane or on a line have extent too.
    fn cost(&self) -> f64 {
        let Some(cone) = &self.cone else {
            return 0.0;
        };
        let diagonal = (self.high - self.low).as_dvec3().length_squared();
        diagonal * f64::from(cone.measure()) * self.intensity
    }

    fn extent(&self) -> Extent {
        let radius = (self.high - self.low).length() / 2.0;
        let intensity = self.intensity.min(f64::from(f32::MAX));
        let softening = if self.intensity > 0.0 {
            self.softening / self.intensity
        } else {
            0.0
        };
        Extent {
            center: (self.low + self.high) / 2.0,
            radius,
            intensity: intensity as f32,
            // The mean of 1/d² over a cube that the ball is round, from its
            // centre, is about 6/R².
            softening: softening as f32 + radius * radius / 6.0,
            cone: self.cone.unwrap_or(Cone::ALL),
        }
    }
}

pub(super) fn build(extents: &[Extent]) -> Option<Tree> {
    if extents.is_empty() {
        return None;
    }
    let mut builder = Builder {
        extents,
        numbers: (0..extents.len() as u32).collect(),
        nodes: Vec::new(),
    };
    builder.node(0..extents.len(), 0);
    Some(Tree {
        nodes: builder.nodes,
        numbers: builder.numbers,
        oriented: extents.iter().any(|extent| !extent.cone.is_all()),
    })
}

struct Builder<'a> {
    extents: &'a [Extent],
    /// The lights in the order of their ranks, as far as that is known.
    numbers: Vec<u32>,
    nodes: Vec<Node>,
}

impl Builder<'_> {
    /// Makes a node of the lights of these ranks and returns its number.
    fn node(&mut self, ranks: Range<usize>, depth: usize) -> u32 {
        let parts = self.parts(ranks, depth);
        let index = self.nodes.len();
        self.nodes.push(Node::empty());
        for (lane, part) in parts.into_iter().enumerate() {
            let single = part.len() == 1;
            let extent = if single {
                self.extents[self.numbers[part.start] as usize]
            } else {
                self.bounds(&part).extent()
            };
            let first = part.start as u32;
            let child = if single {
                LEAF
            } else {
                self.node(part, depth + 1)
            };
            self.nodes[index].set(lane, &extent, first, child);
        }
        index as u32
    }

    fn bounds(&self, ranks: &Range<usize>) -> Bounds {
        self.numbers[ranks.clone()]
            .iter()
            .map(|&number| Bounds::of(&self.extents[number as usize]))
            .fold(Bounds::NONE, Bounds::union)
    }

    /// Cuts a branch into as many parts as a node holds, the costliest first.
    fn parts(&mut self, ranks: Range<usize>, depth: usize) -> ArrayVec<Range<usize>, WIDTH> {
        if ranks.len() <= WIDTH {
            return ranks.map(|rank| rank..rank + 1).collect();
        }
        let mut parts = ArrayVec::<_, WIDTH>::new();
        parts.push((f64::INFINITY, ranks));
        while !parts.is_full() {
            // Where all lights are in one place, the part with the most of them.
            let next = (0..parts.len())
                .filter(|&i| parts[i].1.len() > 1)
                .max_by(|&a, &b| {
                    let key = |i: usize| {
                        if depth < DEPTH_OF_HALVES {
                            parts[i].0
                        } else {
                            0.0
                        }
                    };
                    key(a)
                        .total_cmp(&key(b))
                        .then(parts[a].1.len().cmp(&parts[b].1.len()))
                });
            let Some(next) = next else {
                break;
            };
            let (_, part) = parts.remove(next);
            let middle = self.cut(&part, depth);
            let halves = [part.start..middle, middle..part.end];
            for (i, half) in halves.into_iter().enumerate() {
                parts.insert(next + i, (self.bounds(&half).cost(), half));
            }
        }
        parts.into_iter().map(|(_, part)| part).collect()
    }

    /// Orders the lights of a branch about the best cut and returns its rank.
    fn cut(&mut self, ranks: &Range<usize>, depth: usize) -> usize {
        let extents = self.extents;
        let numbers = &mut self.numbers[ranks.clone()];
        let center = |number: u32| extents[number as usize].center;
        let low = numbers
            .iter()
            .fold(Vec3::INFINITY, |low, &n| low.min(center(n)));
        let high = numbers
            .iter()
            .fold(Vec3::NEG_INFINITY, |high, &n| high.max(center(n)));
        let size = high - low;
        let bin = |number: u32, axis: usize| {
            let share = (center(number)[axis] - low[axis]) / size[axis];
            ((share * BINS as f32) as usize).min(BINS - 1)
        };
        let mut best = (f64::INFINITY, 0, 0);
        if depth < DEPTH_OF_HALVES {
            for axis in (0..3).filter(|&axis| size[axis] > 0.0 && size[axis].is_finite()) {
                let mut bins = [Bounds::NONE; BINS];
                for &number in numbers.iter() {
                    let bin = &mut bins[bin(number, axis)];
                    *bin = bin.union(Bounds::of(&extents[number as usize]));
                }
                let mut above = bins;
                for i in (1..BINS).rev() {
                    above[i - 1] = above[i - 1].union(above[i]);
                }
                let mut below = Bounds::NONE;
                // Thin parts are worth less (the paper's K_r).
                let thinness = f64::from(size.max_element() / size[axis]);
                for i in 1..BINS {
                    below = below.union(bins[i - 1]);
                    if below.cone.is_some() && above[i].cone.is_some() {
                        let cost = thinness * (below.cost() + above[i].cost());
                        if cost < best.0 {
                            best = (cost, axis, i);
                        }
                    }
                }
            }
        }
        let (cost, axis, at) = best;
        if cost < f64::INFINITY {
            numbers.sort_by_key(|&number| bin(number, axis) >= at);
            return ranks.start + numbers.partition_point(|&number| bin(number, axis) < at);
        }
        // All in one place, or too deep.
        let axis = size.max_position();
        numbers.sort_by(|&a, &b| center(a)[axis].total_cmp(&center(b)[axis]));
        ranks.start + ranks.len() / 2
    }
}

impl Node {
    fn empty() -> Self {
        Self {
            center: [f32x8::ZERO; 3],
            radius: f32x8::splat(f32::NEG_INFINITY),
            intensity: f32x8::ZERO,
            softening: f32x8::ONE,
            axis: [f32x8::ZERO; 3],
            cos_normals: f32x8::ONE,
            sin_normals: f32x8::ZERO,
            cos_reach: f32x8::ONE,
            first: [u32::MAX; WIDTH],
            child: [LEAF; WIDTH],
        }
    }

    fn set(&mut self, lane: usize, extent: &Extent, first: u32, child: u32) {
        let cone = &extent.cone;
        let set = |lanes: &mut f32x8, value: f32| lanes.as_array_mut()[lane] = value;
        for axis in 0..3 {
            set(&mut self.center[axis], extent.center[axis]);
            set(&mut self.axis[axis], cone.axis[axis]);
        }
        set(&mut self.radius, extent.radius);
        set(&mut self.intensity, extent.intensity);
        set(&mut self.softening, extent.softening);
        let (sin, cos) = cone.normals.sin_cos();
        // Below any cosine, rounding included, where all normals may be.
        let cos = if cone.is_all() { -2.0 } else { cos };
        set(&mut self.cos_normals, cos);
        set(&mut self.sin_normals, sin);
        set(&mut self.cos_reach, cone.reach.cos() - EDGE);
        self.first[lane] = first;
        self.child[lane] = child;
    }
}
