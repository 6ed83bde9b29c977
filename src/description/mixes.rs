//! Mixes of materials that never come to an end.

use super::{Material, MaterialRef};
use std::collections::BTreeMap;

type Materials = BTreeMap<String, Material>;

/// Deeper mixes are mistakes, and shading them would overflow the stack.
const MAX_MIXES: usize = 64;

/// The materials that mix without end, and what to say about each.
pub(super) fn endless(materials: &Materials) -> Vec<(&str, String)> {
    let mut depths = BTreeMap::new();
    let mut faults = Vec::new();
    for name in materials.keys() {
        let mut trail = Vec::new();
        if let Err(message) = depth(materials, name, &mut trail, &mut depths) {
            faults.push((name.as_str(), message));
            // Once is enough for all that are part of it.
            depths.extend(trail.into_iter().map(|name| (name, 0)));
        }
    }
    faults
}

/// How many mixes are inside each other below a name. `trail` leads to it, and
/// is left as it is where something is wrong.
fn depth<'a>(
    materials: &'a Materials,
    name: &'a str,
    trail: &mut Vec<&'a str>,
    depths: &mut BTreeMap<&'a str, usize>,
) -> Result<usize, String> {
    if let Some(start) = trail.iter().position(|earlier| *earlier == name) {
        let cycle = [&trail[start..], &[name]].concat();
        return Err(format!("this mix contains itself: {}", cycle.join(" → ")));
    }
    if let Some(&depth) = depths.get(name) {
        return Ok(depth);
    }
    let too_deep = || format!("mixes are nested more than {MAX_MIXES} deep");
    if trail.len() > MAX_MIXES {
        return Err(too_deep());
    }
    trail.push(name);
    let mut names = Vec::new();
    if let Some(material) = materials.get(name) {
        mixed_names(material, &mut names);
    }
    let mut deepest = 0;
    for next in names {
        deepest = deepest.max(1 + depth(materials, next, trail, depths)?);
    }
    if deepest > MAX_MIXES {
        return Err(too_deep());
    }
    trail.pop();
    depths.insert(name, deepest);
    Ok(deepest)
}

fn mixed_names<'a>(material: &'a Material, names: &mut Vec<&'a str>) {
    for part in material.parts() {
        match part {
            MaterialRef::Name(name) => names.push(name),
            MaterialRef::Inline(material) => mixed_names(material, names),
        }
    }
}
