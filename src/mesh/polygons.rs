//! Triangles of polygons.

use super::Mesh;
use earcut::{Earcut, deviation, utils3d::project3d_to_2d};
use glam::DVec3;

/// By how much of its area what is cut from a polygon may differ from it: far
/// more than rounding does to plane polygons.
const MAX_DEVIATION: f64 = 1e-3;

/// Cuts polygons into triangles. Those that a fan from their first corner covers
/// once, such as convex ones, become that fan, as in most programs; the others
/// are left to `earcut`, in the plane of their mean normal.
///
/// A polygon that reaches a hole by an edge there and back is cut right. One that
/// crosses itself has no inside to speak of: it is cut into something and counted.
#[derive(Default)]
pub(super) struct Triangulation {
    /// Polygons whose triangles have not the area that the polygon has.
    pub crossing: usize,
    earcut: Earcut<f64>,
    corners: Vec<[f64; 3]>,
    flat: Vec<[f64; 2]>,
    triangles: Vec<u32>,
}

impl Triangulation {
    /// Adds faces to the triangles of a mesh that has their vertices. The face
    /// `i` has `arities[i]` corners, or three where `arities` is empty; indices
    /// count from the vertex `base` on.
    pub fn add(&mut self, mesh: &mut Mesh, base: u32, indices: &[u32], arities: &[u32]) {
        let triangle = |t: &[u32]| [base + t[0], base + t[1], base + t[2]];
        if arities.is_empty() {
            mesh.triangles.extend(indices.chunks_exact(3).map(triangle));
            return;
        }
        let mut rest = indices;
        for &arity in arities {
            let (face, others) = rest.split_at(arity as usize);
            rest = others;
            if face.len() == 3 {
                mesh.triangles.push(triangle(face));
                continue;
            }
            self.cut(&mesh.positions[base as usize..], face);
            let corner = |&index: &u32| base + face[index as usize];
            let cut = self.triangles.chunks_exact(3);
            mesh.triangles
                .extend(cut.map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]));
        }
    }

    /// Leaves the triangles of a face of four corners or more, as indices into it.
    fn cut(&mut self, positions: &[[f32; 3]], face: &[u32]) {
        let at = |&index: &u32| DVec3::from(positions[index as usize].map(f64::from));
        // From the first corner on, which spares far polygons their last digits.
        let first = at(&face[0]);
        self.corners.clear();
        self.corners
            .extend(face.iter().map(|index| (at(index) - first).to_array()));
        self.triangles.clear();
        if !is_covered_by_fan(&self.corners, first.abs().max_element())
            && project3d_to_2d(&self.corners, face.len(), &mut self.flat)
        {
            let flat = self.flat.iter().copied();
            self.earcut.earcut(flat, &[], &mut self.triangles);
            if deviation(self.flat.iter().copied(), &[], &self.triangles) > MAX_DEVIATION {
                self.crossing += 1;
            }
        }
        if self.triangles.is_empty() {
            for i in 2..face.len() as u32 {
                self.triangles.extend([0, i - 1, i]);
            }
        }
    }
}

/// Whether all triangles between the first corner, which is the origin, and the
/// other edges turn as the polygon does, and together less than once round. `far`
/// is the largest coordinate, which says how well the corners are known.
fn is_covered_by_fan(corners: &[[f64; 3]], far: f64) -> bool {
    let edges = || {
        corners
            .windows(2)
            .map(|pair| (DVec3::from(pair[0]), DVec3::from(pair[1])))
    };
    // Newell's normal, of twice the polygon's area: the closing edges are at the origin.
    let normal = edges().map(|(a, b)| a.cross(b)).sum::<DVec3>();
    let Some(unit) = normal.try_normalize() else {
        // Without area there is nothing to cover.
        return true;
    };
    let rounding = f64::from(f32::EPSILON);
    let mut turn = 0.0;
    for (a, b) in edges() {
        let area = a.cross(b).dot(unit);
        let unknown = (far + a.abs().max_element()) * rounding * (a.length() + b.length());
        if area < -unknown {
            return false;
        }
        turn += area.atan2(a.dot(b));
    }
    turn < std::f64::consts::TAU * 0.999
}
