//! Mixes of materials that never come to an end.

use super::{Material, MaterialRef};
use std::collections::{BTreeMap, BTreeSet};

type Materials = BTreeMap<String, Material>;

/// Deeper mixes are mistakes, and shading them would overflow the stack.
const MAX_MIXES: usize = 64;

/// A trail of mixes that can't be shaded.
enum Endless<'a> {
    Cycle(Vec<&'a str>),
    Deep,
}

/// The materials that mix without end, and what to say about each.
pub(super) fn endless(materials: &Materials) -> Vec<(&str, String)> {
    let mut done = BTreeSet::new();
    let mut faults = Vec::new();
    for name in materials.keys() {
        if let Some(endless) = find_endless(materials, name, &mut Vec::new(), &mut done) {
            let message = match endless {
                Endless::Cycle(names) => {
                    format!("this mix contains itself: {}", names.join(" → "))
                }
                Endless::Deep => format!("mixes are nested more than {MAX_MIXES} deep"),
            };
            faults.push((name.as_str(), message));
        }
    }
    faults
}

/// Follows the names in mixes from one material on, to the first trail that
/// returns to where it was before.
fn find_endless<'a>(
    materials: &'a Materials,
    name: &'a str,
    trail: &mut Vec<&'a str>,
    done: &mut BTreeSet<&'a str>,
) -> Option<Endless<'a>> {
    if let Some(start) = trail.iter().position(|earlier| *earlier == name) {
        done.extend(trail.iter().copied());
        return Some(Endless::Cycle([&trail[start..], &[name]].concat()));
    }
    if trail.len() == MAX_MIXES {
        done.extend(trail.iter().copied());
        return Some(Endless::Deep);
    }
    if done.contains(name) {
        return None;
    }
    trail.push(name);
    let mut names = Vec::new();
    if let Some(material) = materials.get(name) {
        mixed_names(material, &mut names);
    }
    let cycle = names
        .into_iter()
        .find_map(|next| find_endless(materials, next, trail, done));
    trail.pop();
    done.insert(name);
    cycle
}

fn mixed_names<'a>(material: &'a Material, names: &mut Vec<&'a str>) {
    let Material::Mix(mix) = material else { return };
    for part in [&mix.a, &mix.b] {
        match part {
            MaterialRef::Name(name) => names.push(name),
            MaterialRef::Inline(material) => mixed_names(material, names),
        }
    }
}
