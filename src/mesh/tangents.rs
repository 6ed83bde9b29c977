//! Tangents for normal maps: Mikkelsen 2008, "Simulation of wrinkled surfaces
//! revisited", by the code that Blender and most programs that bake normal maps use.

use super::Mesh;
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::Vec3;

impl Mesh {
    /// Gives every vertex a tangent, splitting those whose corners differ, as at the
    /// seam of a mirrored texture. Without texture coordinates there is none.
    pub fn add_tangents(&mut self) {
        if let Some(uvs) = &self.uvs {
            let corners = tangents(self, uvs);
            self.tangents = Some(self.per_vertex(&corners));
        }
    }

    /// The same for other texture coordinates.
    pub fn add_tangents_of(&mut self, uv_map: &str) {
        if let Some(map) = self.uv_maps.get(uv_map) {
            let corners = tangents(self, &map.uvs);
            let tangents = self.per_vertex(&corners);
            if let Some(map) = self.uv_maps.get_mut(uv_map) {
                map.tangents = Some(tangents);
            }
        }
    }
}

/// A unit tangent along u for every corner, and the sign that makes sign · n × t the
/// bitangent along v; zero where the texture coordinates have no direction.
fn tangents(mesh: &Mesh, uvs: &[[f32; 2]]) -> Vec<[f32; 4]> {
    let mut corners = Corners {
        mesh,
        uvs,
        tangents: vec![[0.0; 4]; 3 * mesh.triangles.len()],
    };
    // There is no error that it could give.
    let _: Result<(), _> = generate_tangents(&mut corners);
    corners.tangents
}

struct Corners<'a> {
    mesh: &'a Mesh,
    uvs: &'a [[f32; 2]],
    tangents: Vec<[f32; 4]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)]
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        match &self.mesh.normals {
            Some(normals) => normals[self.vertex(face, corner)],
            None => {
                let [a, b, c] = self.mesh.triangles[face]
                    .map(|index| Vec3::from(self.mesh.positions[index as usize]));
                (b - a).cross(c - a).normalize_or_zero().into()
            }
        }
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, corner)]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(tangent) = tangent {
            self.tangents[3 * face + corner] = tangent.tangent_encoded();
        }
    }
}
