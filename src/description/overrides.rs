//! Values in place of a scene's, by their dotted path: on the command line as
//! `path=value`, in the files of frames.

use super::document::{MAX_DEPTH, parse};
use super::problem::{Place, Sources, nearest};
use super::read::describe;
use super::tree::{Key, Kind, Mapping, Node, Scalar, dotted};
use crate::text::excerpt;

/// The sections whose keys are names that the file chooses.
const NAMED: [&str; 3] = ["textures", "materials", "meshes"];

/// Sets the value that the command line gives to a dotted path.
pub(super) fn apply(root: &mut Node, path: &str, value: &str, sources: &mut Sources<'_>) {
    let source = sources.add("-D", format!("{path}={value}"));
    let offset = path.chars().count() + 1;
    let place = Place::new(source, 1, 1, offset - 1);
    let before = sources.count();
    let Some(node) = parse(value, source, offset, sources) else {
        if sources.count() == before {
            sources.report(
                place,
                path.to_owned(),
                "expected a value after `=`, found nothing".to_owned(),
                None,
            );
        }
        return;
    };
    set(root, path, place, node, sources);
}

/// Sets the value at a dotted path, which stands at `place`. Keys that the file leaves
/// out are added, for whoever deserialises the tree to judge; names are not. Gives the
/// keys, indices and names that the path is made of; what is wrong with it is reported.
pub(super) fn set(
    root: &mut Node,
    path: &str,
    place: Place,
    value: Node,
    sources: &mut Sources<'_>,
) -> Option<Vec<String>> {
    if path.split('.').any(str::is_empty) {
        sources.report(
            place,
            String::new(),
            format!("expected keys joined by dots, found `{}`", excerpt(path)),
            None,
        );
        return None;
    }
    let mut segments: &[&str] = &path.split('.').collect::<Vec<_>>();
    let mut target = root;
    let mut walked = Vec::new();
    while !segments.is_empty() {
        if walked.len() == MAX_DEPTH {
            let message = format!("expected at most {MAX_DEPTH} keys joined by dots");
            sources.report(place, dotted(&walked), message, None);
            return None;
        }
        match step(target, segments, &walked, place) {
            Ok((next, taken)) => {
                target = next;
                walked.push(segments[..taken].join("."));
                segments = &segments[taken..];
            }
            Err(Refusal { message, nearest }) => {
                sources.report(place, dotted(&walked), message, nearest);
                return None;
            }
        }
    }
    *target = value;
    Some(walked)
}

struct Refusal {
    message: String,
    nearest: Option<String>,
}

/// One step down, and how many segments of the path it took: names may hold
/// dots themselves, and the longest that is there wins.
fn step<'tree>(
    node: &'tree mut Node,
    segments: &[&str],
    walked: &[String],
    place: Place,
) -> Result<(&'tree mut Node, usize), Refusal> {
    let found = describe(node);
    if let Kind::Scalar(Scalar::Null) = node.kind {
        node.kind = Kind::Mapping(Mapping::default());
    }
    match &mut node.kind {
        Kind::Scalar(_) => {
            let message = format!(
                "expected something with a key `{}`, found {found}",
                excerpt(segments[0])
            );
            Err(Refusal {
                message,
                nearest: None,
            })
        }
        Kind::Sequence(items) => {
            let count = items.len();
            let index = segments[0]
                .parse::<usize>()
                .ok()
                .filter(|&index| index < count);
            index
                .map(|index| (&mut items[index], 1))
                .ok_or_else(|| Refusal {
                    message: format!(
                        "expected an index below {count}, found `{}`",
                        excerpt(segments[0])
                    ),
                    nearest: None,
                })
        }
        Kind::Mapping(mapping) => {
            // Names are not longer than this, and long paths have many beginnings.
            let longest = mapping
                .entries()
                .iter()
                .map(|(key, _)| key.name.len())
                .max();
            let mut name = String::new();
            let mut found = None;
            for (taken, segment) in segments.iter().enumerate() {
                name.push_str(if taken > 0 { "." } else { "" });
                name.push_str(segment);
                if longest.is_none_or(|longest| name.len() > longest) {
                    break;
                }
                if let Some(position) = mapping.position(&name) {
                    found = Some((position, taken + 1));
                }
            }
            let (position, taken) = match (found, walked) {
                (Some(found), _) => found,
                (None, [section]) if NAMED.contains(&section.as_str()) => {
                    let names = mapping.entries().iter().map(|(key, _)| &*key.name);
                    return Err(Refusal {
                        message: format!("the scene has no `{}` here", excerpt(segments[0])),
                        nearest: nearest(segments[0], names),
                    });
                }
                (None, _) => {
                    let key = Key {
                        name: segments[0].into(),
                        place,
                    };
                    mapping.push(key, Node::new(Kind::Scalar(Scalar::Null), place));
                    (mapping.entries().len() - 1, 1)
                }
            };
            Ok((mapping.node_mut(position), taken))
        }
    }
}
