//! A tree of lights: from a shading point towards those that matter there, and
//! along a ray towards those that it may meet.
//!
//! Bounds of position, orientation and intensity stand for all lights of a
//! branch (Conty Estévez and Kulla 2018, "Importance Sampling of Many Lights
//! with Adaptive Tree Splitting", PACMCGIT 1(2)). Each node has up to eight
//! children, looked at together: a path through ten thousand lights takes five
//! steps, and a choice among eight estimates is nearer to the lights' own
//! contributions than three choices among two.

mod build;
mod cone;

pub(super) use cone::Cone;

use super::Receiver;
use crate::embree::Ray;
use glam::Vec3;
use wide::{CmpGe, CmpGt, CmpLe, f32x8};

/// No estimate is above this, so that sums stay finite.
pub(super) const MOST: f32 = 1e30;

/// Children of a node.
const WIDTH: usize = 8;

/// The least share of its intensity that a light is thought to send into the
/// directions that it reaches: what is seen from near its plane is seen well by
/// the light's near edge.
const LEAST_COSINE: f32 = 0.1;

/// The least cosine at the shading point that a light counts with: the normal
/// says little about narrow lobes, and may be an interpolated one.
pub(super) const LEAST_FACING: f32 = 0.02;

/// How many levels down the estimates of near branches are made.
const AHEAD: u32 = 1;

/// A branch is near where its radius exceeds this share of the distance.
const NEAR: f32 = 0.5;

/// What a tree knows of a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// The ball that holds it, metres.
    pub(super) center: Vec3,
    pub(super) radius: f32,
    /// The luminance of the largest intensity, W·sr⁻¹.
    pub(super) intensity: f32,
    /// Its irradiance at a distance d is about intensity / (d² + this), m².
    pub(super) softening: f32,
    /// Where it shines to.
    pub(super) cone: Cone,
}

/// Up to eight children, as structures of arrays. A lane that is not used has
/// no intensity, a ball that nothing meets, and the last of all ranks.
#[derive(Clone, Debug)]
struct Node {
    center: [f32x8; 3],
    radius: f32x8,
    intensity: f32x8,
    softening: f32x8,
    axis: [f32x8; 3],
    cos_normals: f32x8,
    sin_normals: f32x8,
    cos_reach: f32x8,
    /// The rank of the first light of each child.
    first: [u32; WIDTH],
    /// The node that each child is, or [`LEAF`].
    child: [u32; WIDTH],
}

/// A child that is one light.
const LEAF: u32 = u32::MAX;

/// Lights by rank: each branch holds consecutive ranks, by which a light's way
/// from the root is found without a record of it.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// The number of the light of each rank, as it was given.
    numbers: Vec<u32>,
    /// Whether any light shines more to one side than to another.
    oriented: bool,
}

/// The estimates of a node's children at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    each: [f32; WIDTH],
    /// About the irradiance that all of them cause, W·m⁻².
    pub(super) total: f64,
}

impl Weights {
    fn probability(&self, lane: usize) -> f64 {
        if self.total > 0.0 {
            f64::from(self.each[lane]) / self.total
        } else {
            0.0
        }
    }

    /// The lane that `u` in [0, 1) falls into and where in it; the total must
    /// not be zero.
    fn choose(&self, u: f64) -> (usize, f64) {
        let at = u * self.total;
        let mut below = 0.0;
        let mut last = (0, 0.0);
        for (lane, &weight) in self.each.iter().enumerate() {
            let weight = f64::from(weight);
            if weight > 0.0 {
                last = (lane, ((at - below) / weight).clamp(0.0, BELOW_ONE));
                if at < below + weight {
                    break;
                }
            }
            below += weight;
        }
        last
    }
}

/// The largest number below 1 that an `f64` holds.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

impl Tree {
    /// Of the lights with these extents; `None` when there are none.
    pub(super) fn new(extents: &[Extent]) -> Option<Self> {
        build::build(extents)
    }

    /// The numbers of the lights by rank.
    pub(super) fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.numbers.as_slice())
    }

    /// The estimates of the root's children.
    pub(super) fn root(&self, at: &Receiver) -> Weights {
        self.weights(0, at, AHEAD)
    }

    /// The rank of a light chosen by `u` in [0, 1) and its probability; `None`
    /// where nothing arrives. `root` are the estimates of [`Tree::root`] there.
    pub(super) fn choose(&self, at: &Receiver, root: Weights, mut u: f64) -> Option<(u32, f64)> {
        let mut probability = 1.0;
        let mut weights = root;
        let mut index = 0;
        while weights.total > 0.0 {
            let (lane, rest) = weights.choose(u);
            probability *= weights.probability(lane);
            let node = &self.nodes[index];
            if node.child[lane] == LEAF {
                return Some((node.first[lane], probability));
            }
            index = node.child[lane] as usize;
            u = rest;
            weights = self.weights(index, at, AHEAD);
        }
        None
    }

    /// The probability with which [`Tree::choose`] takes the light of a rank.
    pub(super) fn probability(&self, at: &Receiver, root: Weights, rank: u32) -> f64 {
        let mut probability = 1.0;
        let mut weights = root;
        let mut index = 0;
        loop {
            let node = &self.nodes[index];
            // Unused lanes have the last of all ranks.
            let lane = node.first.iter().filter(|&&first| first <= rank).count() - 1;
            probability *= weights.probability(lane);
            if node.child[lane] == LEAF || probability == 0.0 {
                return probability;
            }
            index = node.child[lane] as usize;
            weights = self.weights(index, at, AHEAD);
        }
    }

    /// Calls `visit` with the number of every light whose ball `ray`, of unit
    /// direction, meets between its ends.
    #[inline]
    pub(super) fn along(&self, ray: &Ray, mut visit: impl FnMut(u32)) {
        let mut stack = smallvec::SmallVec::<[(u32, u8); 32]>::new();
        let mut index = 0;
        let mut lanes = self.nodes[0].met(ray);
        loop {
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let node = &self.nodes[index as usize];
                if node.child[lane] == LEAF {
                    visit(self.numbers[node.first[lane] as usize]);
                } else {
                    stack.push((index, lanes));
                    index = node.child[lane];
                    lanes = self.nodes[index as usize].met(ray);
                }
            }
            match stack.pop() {
                Some(above) => (index, lanes) = above,
                None => return,
            }
        }
    }

    /// The estimates of a node's children. Where one is near, the sum of its
    /// own children's estimates is taken, so many levels `ahead`.
    #[inline]
    fn weights(&self, index: usize, at: &Receiver, ahead: u32) -> Weights {
        let node = &self.nodes[index];
        let (estimates, mut near) = node.estimates(at, self.oriented);
        let mut each = estimates.to_array();
        if ahead > 0 {
            while near != 0 {
                let lane = near.trailing_zeros() as usize;
                near &= near - 1;
                if node.child[lane] != LEAF && each[lane] > 0.0 {
                    let child = node.child[lane] as usize;
                    each[lane] = self.weights(child, at, ahead - 1).total as f32;
                }
            }
        }
        Weights {
            each,
            total: each.iter().map(|&weight| f64::from(weight)).sum(),
        }
    }
}

fn splat(p: Vec3) -> [f32x8; 3] {
    p.to_array().map(f32x8::splat)
}

fn dot(a: &[f32x8; 3], b: &[f32x8; 3]) -> f32x8 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Node {
    /// About the irradiance that each child causes, W·m⁻²; zero only
    /// where none of its lights reaches. The bits say which children are near.
    #[inline]
    fn estimates(&self, at: &Receiver, oriented: bool) -> (f32x8, u8) {
        let p = splat(at.position);
        let to_p: [f32x8; 3] = std::array::from_fn(|i| p[i] - self.center[i]);
        let distance_squared = dot(&to_p, &to_p);
        let facing = (self.intensity / (distance_squared + self.softening)).fast_min(MOST.into());
        let radius_squared = self.radius * self.radius;
        let near = radius_squared.cmp_gt(distance_squared * f32x8::splat(NEAR * NEAR));
        let near = near.move_mask() as u8;
        let distance = distance_squared.sqrt();
        // Two angles are taken off that to an axis: the spread of the normals,
        // and what the ball subtends; cos(a − b) = cos a cos b + sin a sin b.
        let less = |cos: f32x8, cos_off: f32x8, sin_off: f32x8| {
            let difference = cos * cos_off + sine(cos) * sin_off;
            cos.cmp_ge(cos_off).blend(f32x8::ONE, difference)
        };
        let sin_ball = self.radius / distance;
        let cos_ball = sine(sin_ball);
        let mut outside = f32x8::ONE;
        if let Some(normal) = at.normal {
            let cos = -dot(&splat(normal), &to_p) / distance;
            outside = less(cos, cos_ball, sin_ball).fast_max(LEAST_FACING.into());
        }
        if oriented {
            let cos = dot(&self.axis, &to_p) / distance;
            let cos = less(cos, self.cos_normals, self.sin_normals);
            let cos = less(cos, cos_ball, sin_ball);
            let reached = cos.cmp_gt(self.cos_reach);
            outside *= reached.blend(cos.fast_max(LEAST_COSINE.into()), f32x8::ZERO);
        }
        let inside = distance_squared.cmp_le(radius_squared);
        (facing * inside.blend(f32x8::ONE, outside), near)
    }

    /// The children whose balls `ray` meets between its ends, one bit each.
    #[inline]
    fn met(&self, ray: &Ray) -> u8 {
        /// What rounding may move a ball by, of its distance.
        const SLACK: f32 = 1e-6;
        let (origin, direction) = (splat(ray.origin), splat(ray.direction));
        let to_center: [f32x8; 3] = std::array::from_fn(|i| self.center[i] - origin[i]);
        let along = dot(&to_center, &direction);
        // The perpendicular itself: d² − along² would cancel.
        let across: [f32x8; 3] = std::array::from_fn(|i| to_center[i] - direction[i] * along);
        let reach = self.radius + dot(&to_center, &to_center).sqrt() * f32x8::splat(SLACK);
        let met = dot(&across, &across).cmp_le(reach * reach)
            & (along + reach).cmp_ge(f32x8::splat(ray.t_near))
            & (along - reach).cmp_le(f32x8::splat(ray.t_far));
        met.move_mask() as u8
    }
}

/// √(1 − c²).
fn sine(cos: f32x8) -> f32x8 {
    (f32x8::ONE - cos * cos).fast_max(f32x8::ZERO).sqrt()
}
