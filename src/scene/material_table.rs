//! The materials that objects turn out to have.

use std::collections::BTreeMap;

use super::compile::Materials;
use super::{Material, SceneMesh};
use crate::description::Assignment;
use crate::features::Features;

/// Materials by name, compiled once an object has them.
pub(super) struct MaterialTable<'a> {
    pub source: Materials<'a>,
    indices: BTreeMap<String, usize>,
    pub compiled: Vec<Material>,
    pub features: Features,
    pub notes: Vec<String>,
    pub problems: Vec<String>,
}

impl<'a> MaterialTable<'a> {
    pub fn new(source: Materials<'a>) -> Self {
        Self {
            source,
            indices: BTreeMap::new(),
            compiled: Vec::new(),
            features: Features::NONE,
            notes: Vec::new(),
            problems: Vec::new(),
        }
    }

    /// What the first of these materials that is not content with a mesh asks for, as
    /// [`Description::places`] has it.
    pub fn lack(&mut self, indices: &[usize], mesh: &SceneMesh) -> Option<String> {
        let names: Vec<_> = self.indices.iter().collect();
        for (name, index) in names {
            if !indices.contains(index) {
                continue;
            }
            let Some(Ok(compiled)) = self.source.get(name) else {
                continue;
            };
            let needs = &compiled.needs;
            let flat = !needs.features.contains(Features::NORMAL_MAPS);
            if !flat && needs.uvs && mesh.uvs.is_none() {
                return Some(format!("material {name}"));
            }
            let (uv_maps, colors) = (needs.uv_maps.clone(), needs.colors.clone());
            let attributes = self.source.attributes();
            for map in uv_maps.keys() {
                if mesh.uvs(attributes.uv_map(Some(map))).is_none() {
                    return Some(format!("UV map {map}"));
                }
            }
            for color in &colors {
                if mesh
                    .colors
                    .get(attributes.colors(color))
                    .is_none_or(Option::is_none)
                {
                    return Some(format!("set of colours {color}"));
                }
            }
        }
        None
    }

    /// The index of the material of this name; `None` if there is no such name.
    fn index(&mut self, name: &str) -> Option<usize> {
        if let Some(&index) = self.indices.get(name) {
            return Some(index);
        }
        let material = match self.source.get(name)? {
            Ok(compiled) => {
                self.features = self.features.with(compiled.needs.features);
                let notes = compiled.needs.notes.iter();
                self.notes
                    .extend(notes.map(|note| format!("material `{name}`: {note}")));
                compiled.material.clone()
            }
            Err(error) => {
                self.problems.push(format!("materials.{name}: {error}"));
                Material::default()
            }
        };
        self.compiled.push(material);
        self.indices
            .insert(name.to_owned(), self.compiled.len() - 1);
        Some(self.compiled.len() - 1)
    }
}

/// The material of each slot of a mesh.
pub(super) fn assign(
    assignment: &Assignment,
    slots: &[String],
    object: &str,
    materials: &mut MaterialTable<'_>,
) -> Result<Vec<usize>, String> {
    let mut find = |name: &str, why: &str| {
        materials.index(name).ok_or_else(|| {
            let known: Vec<&str> = materials.source.names().collect();
            format!(
                "{object}: there is no material `{name}`{why}; there are: {}",
                known.join(", ")
            )
        })
    };
    match assignment {
        Assignment::All(name) => Ok(vec![find(name, "")?; slots.len().max(1)]),
        Assignment::BySlot(map) if slots.is_empty() => match map.values().next() {
            Some(name) if map.len() == 1 => Ok(vec![find(name, "")?]),
            _ => Err(format!(
                "{object}: `materials` names slots, but the mesh has no usemtl line"
            )),
        },
        Assignment::BySlot(map) => slots
            .iter()
            .map(|slot| match map.get(slot) {
                Some(name) => find(name, ""),
                None => Err(format!(
                    "{object}: `materials` has nothing for the slot `{slot}`"
                )),
            })
            .collect(),
        Assignment::FromMesh if slots.is_empty() => Err(format!(
            "{object}: has neither `material` nor `materials`, and the mesh has no usemtl line"
        )),
        Assignment::FromMesh => slots
            .iter()
            .map(|slot| find(slot, ", which the mesh's usemtl line asks for"))
            .collect(),
    }
}
