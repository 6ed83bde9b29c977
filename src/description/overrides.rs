//! Values given on the command line as `path=value`.

use super::document::{Key, Kind, Node, dotted, parse};
use super::problem::{Place, Sources, nearest};
use super::read::describe;
use serde_yaml::Value;

/// The sections whose keys are names that the file chooses.
const NAMED: [&str; 3] = ["textures", "materials", "meshes"];

/// Sets the value at a dotted path. Keys that the file leaves out are added,
/// for whoever deserialises the tree to judge; names are not.
pub(super) fn apply(root: &mut Node, path: &str, value: &str, sources: &mut Sources) {
    let source = sources.add("-D", &format!("{path}={value}"));
    let offset = path.chars().count() + 1;
    let place = Place {
        source,
        line: 1,
        column: 1,
        width: offset - 1,
    };
    if path.split('.').any(str::is_empty) {
        sources.report(
            place,
            String::new(),
            format!("expected keys joined by dots, found `{path}`"),
            None,
        );
        return;
    }
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
    let mut segments: &[&str] = &path.split('.').collect::<Vec<_>>();
    let mut target = root;
    let mut walked = Vec::new();
    while !segments.is_empty() {
        match step(target, segments, &walked, place) {
            Ok((next, taken)) => {
                target = next;
                walked.push(segments[..taken].join("."));
                segments = &segments[taken..];
            }
            Err(Refusal { message, nearest }) => {
                sources.report(place, dotted(&walked), message, nearest);
                return;
            }
        }
    }
    *target = node;
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
    if let Kind::Scalar(Value::Null) = node.kind {
        node.kind = Kind::Mapping(Vec::new());
    }
    match &mut node.kind {
        Kind::Scalar(_) => {
            let message = format!(
                "expected something with a key `{}`, found {found}",
                segments[0]
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
                    message: format!("expected an index below {count}, found `{}`", segments[0]),
                    nearest: None,
                })
        }
        Kind::Mapping(entries) => {
            let taken = (1..=segments.len()).rev().find(|&taken| {
                let name = segments[..taken].join(".");
                entries.iter().any(|(key, _)| key.name == name)
            });
            let taken = match (taken, walked) {
                (Some(taken), _) => taken,
                (None, [section]) if NAMED.contains(&section.as_str()) => {
                    let names = entries.iter().map(|(key, _)| key.name.as_str());
                    return Err(Refusal {
                        message: format!("the scene has no `{}` here", segments[0]),
                        nearest: nearest(segments[0], names),
                    });
                }
                (None, _) => {
                    let key = Key {
                        name: segments[0].to_owned(),
                        place,
                    };
                    entries.push((key, Node::new(Kind::Scalar(Value::Null), place)));
                    1
                }
            };
            let name = segments[..taken].join(".");
            let index = entries
                .iter()
                .position(|(key, _)| key.name == name)
                .expect("found or added above");
            Ok((&mut entries[index].1, taken))
        }
    }
}
