//! What other files say of a mesh's vertices: texture coordinates and colours beside
//! the first. Such a file is an OBJ of the same faces.

use super::{LineProblem, Mesh, MeshError, Repair, UvMap, Wanted};
use std::collections::HashMap;
use std::path::Path;

impl Mesh {
    /// Takes the texture coordinates of another OBJ file of the same faces, in the same
    /// order, as an UV map of this name.
    ///
    /// # Errors
    /// When the file can't be read, has other faces, or no texture coordinates.
    pub fn add_uv_map(&mut self, name: &str, path: &Path) -> Result<Vec<Repair>, MeshError> {
        let wanted = Wanted {
            uvs: true,
            normals: false,
            colors: false,
        };
        let (other, repairs) = Self::load(path, wanted)?;
        self.has_faces_of(&other).map_err(|m| fault(path, m))?;
        let Some(uvs) = &other.uvs else {
            let message =
                format!("expected texture coordinates for the UV map `{name}`, found none");
            return Err(fault(path, message));
        };
        let corners = other.triangles.as_flattened().iter();
        let corners: Vec<_> = corners.map(|&index| uvs[index as usize]).collect();
        let map = UvMap {
            uvs: self.per_vertex(&corners),
            tangents: None,
        };
        self.uv_maps.insert(name.to_owned(), map);
        Ok(repairs)
    }

    /// Takes the colours of vertices, the fourth to sixth number of `v` lines, of an OBJ
    /// file of the same faces, in the same order, or of the mesh's own.
    ///
    /// # Errors
    /// When the file can't be read, has other faces, or vertices without colour.
    pub fn add_colors(&mut self, name: &str, path: &Path) -> Result<Vec<Repair>, MeshError> {
        let wanted = Wanted {
            uvs: false,
            normals: false,
            colors: true,
        };
        let (mut other, repairs) = Self::load(path, wanted)?;
        self.has_faces_of(&other).map_err(|m| fault(path, m))?;
        let colors = other.colors.remove("").unwrap_or_default();
        let corners = other.triangles.as_flattened().iter();
        let corners: Vec<_> = corners.map(|&index| colors[index as usize]).collect();
        let colors = self.per_vertex(&corners);
        self.colors.insert(name.to_owned(), colors);
        Ok(repairs)
    }

    /// Whether all corners of another mesh stand where this one's do.
    fn has_faces_of(&self, other: &Self) -> Result<(), String> {
        let (count, found) = (self.triangles.len(), other.triangles.len());
        if count != found {
            return Err(format!(
                "expected the faces of the mesh, {count} triangles, found {found}"
            ));
        }
        let place = |mesh: &Self, index: u32| mesh.positions[index as usize];
        let differs = (0..count).find(|&triangle| {
            let pairs = self.triangles[triangle]
                .iter()
                .zip(other.triangles[triangle]);
            pairs
                .into_iter()
                .any(|(&a, b)| place(self, a) != place(other, b))
        });
        match differs {
            Some(triangle) => Err(format!(
                "expected the faces of the mesh in the same order, found another triangle {}",
                triangle + 1
            )),
            None => Ok(()),
        }
    }

    /// Values of corners as values of vertices. A vertex whose corners differ is split.
    pub(super) fn per_vertex<const N: usize>(&mut self, corners: &[[f32; N]]) -> Vec<[f32; N]> {
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
        if let Some(tangents) = &mut self.tangents {
            copy(tangents, vertex);
        }
        for map in self.uv_maps.values_mut() {
            copy(&mut map.uvs, vertex);
            if let Some(tangents) = &mut map.tangents {
                copy(tangents, vertex);
            }
        }
        for colors in self.colors.values_mut() {
            copy(colors, vertex);
        }
        index
    }
}

fn fault(path: &Path, message: String) -> MeshError {
    MeshError {
        source_name: path.display().to_string(),
        problems: vec![LineProblem {
            line: None,
            message,
        }],
    }
}
