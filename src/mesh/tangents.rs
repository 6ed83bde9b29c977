//! Tangents for normal maps: Mikkelsen 2008, "Simulation of wrinkled surfaces
//! revisited", by the code that Blender and most programs that bake normal maps use.

use super::Mesh;
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::Vec3;
use std::collections::HashMap;

impl Mesh {
    /// Gives every vertex a tangent, splitting those whose corners differ, as at the
    /// seam of a mirrored texture. Without texture coordinates there is none.
    pub fn add_tangents(&mut self) {
        let Some(uvs) = &self.uvs else {
            return;
        };
        let corners = tangents(self, uvs);
        self.tangents = Some(self.per_vertex(&corners));
    }

    /// Values of corners as values of vertices. A vertex whose corners differ is split.
    fn per_vertex<const N: usize>(&mut self, corners: &[[f32; N]]) -> Vec<[f32; N]> {
        let mut triangles = std::mem::take(&mut self.triangles);
        let mut values: Vec<Option<[f32; N]>> = vec![None; self.positions.len()];
        let mut split = HashMap::new();
        for (index, value) in triangles.as_flattened_mut().iter_mut().zip(corners) {
            let bits = value.map(f32::to_bits);
            let known = values[*index as usize].get_or_insert(*value);
            if known.map(f32::to_bits) == bits {
                continue;
            }
            let copy = split.entry((*index, bits)).or_insert_with(|| {
                values.push(Some(*value));
                self.copy_vertex(*index as usize)
            });
            *index = *copy;
        }
        self.triangles = triangles;
        self.positions.reserve(1);
        let none = [0.0; N];
        values.into_iter().map(|v| v.unwrap_or(none)).collect()
    }

    /// The index of a new vertex that is like this one.
    fn copy_vertex(&mut self, vertex: usize) -> u32 {
        fn copy<T: Copy>(values: &mut Vec<T>, index: usize) {
            values.push(values[index]);
        }
        let index = self.positions.len() as u32;
        copy(&mut self.positions, vertex);
        if let Some(normals) = &mut self.normals {
            copy(normals, vertex);
        }
        if let Some(uvs) = &mut self.uvs {
            copy(uvs, vertex);
        }
        index
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
