//! The numbers of what meshes give names to: UV maps and colours of vertices.

use crate::description::Description;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The names of all meshes' UV maps and colours, in the order of their numbers.
#[derive(Clone, Debug, Default)]
pub struct Attributes {
    uv_maps: Arc<[String]>,
    colors: Arc<[String]>,
}

impl Attributes {
    /// Those of a description.
    #[must_use]
    pub fn of(description: &Description) -> Self {
        let meshes = || description.meshes.values();
        let sorted = |names: BTreeSet<&String>| names.into_iter().cloned().collect();
        Self {
            uv_maps: sorted(meshes().flat_map(|mesh| mesh.uv_maps.keys()).collect()),
            colors: sorted(meshes().flat_map(|mesh| mesh.colors.keys()).collect()),
        }
    }

    /// The names of UV maps by their number, which counts from 1: 0 stands for the
    /// texture coordinates of a mesh's own file.
    pub fn uv_maps(&self) -> impl Iterator<Item = (usize, &str)> {
        (1..).zip(self.uv_maps.iter().map(String::as_str))
    }

    /// The number of an UV map; 0 for `None` and for names that no mesh has.
    #[must_use]
    pub fn uv_map(&self, name: Option<&str>) -> usize {
        let mut maps = self.uv_maps();
        let found = maps.find(|(_, known)| Some(*known) == name);
        found.map_or(0, |(number, _)| number)
    }

    /// The names of colours by their number, from 0.
    pub fn color_names(&self) -> impl Iterator<Item = &str> {
        self.colors.iter().map(String::as_str)
    }

    /// The number of colours; past all for names that no mesh has.
    #[must_use]
    pub fn colors(&self, name: &str) -> usize {
        let position = self.colors.iter().position(|known| known == name);
        position.unwrap_or(self.colors.len())
    }
}
