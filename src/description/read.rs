//! From a tree of nodes to typed values, collecting all errors on the way.

use super::problem::{Place, Sources, nearest};
use super::tree::{Kind, Node, Scalar, Step, dotted};
use super::value::CLASH_SEPARATOR;
use crate::text::excerpt;
use serde::de::DeserializeOwned;
use serde_path_to_error::Segment;

/// Deserialises a tree. Serde stops at the first error, so what it stumbles
/// over is reported, cut off, and the rest tried again; errors that only
/// follow from such a cut are not reported.
pub(super) fn read<T: DeserializeOwned>(tree: &mut Node, sources: &mut Sources) -> Option<T> {
    loop {
        let mut track = serde_path_to_error::Track::new();
        let deserializer = serde_path_to_error::Deserializer::new(&*tree, &mut track);
        let error = match T::deserialize(deserializer) {
            Ok(value) => return Some(value),
            Err(error) => Fault::parse(&error.to_string()),
        };
        let steps: Vec<Step> = track.path().iter().filter_map(step).collect();
        let (node, key_place, path) = tree.descend_by_key(&steps);
        let cut = error.judge(node, key_place, &path, sources);
        if sources.is_full() || cut.is_empty() {
            return None;
        }
        tree.at_mut(&cut)?.pruned = true;
    }
}

fn step(segment: &Segment) -> Option<Step> {
    match segment {
        Segment::Seq { index } => Some(Step::Index(*index)),
        Segment::Map { key } => Some(Step::Key(key.clone())),
        // Enums are written as mappings.
        Segment::Enum { variant } => Some(Step::Key(variant.clone())),
        Segment::Unknown => None,
    }
}

/// What serde says is wrong. It hands errors on as text alone, in wordings
/// that its documentation fixes.
enum Fault {
    UnknownKey {
        name: String,
        known: Vec<String>,
    },
    UnknownVariant {
        name: String,
        known: Vec<String>,
    },
    MissingKey(String),
    /// Keys that do not go together, and the one to point at.
    Clash {
        key: String,
        message: String,
    },
    Mismatch {
        expected: String,
    },
    Other(String),
}

impl Fault {
    fn parse(text: &str) -> Self {
        let quoted = |text: &str| -> Vec<String> {
            text.split('`')
                .skip(1)
                .step_by(2)
                .map(str::to_owned)
                .collect()
        };
        if let Some((key, message)) = text.split_once(CLASH_SEPARATOR) {
            Self::Clash {
                key: key.to_owned(),
                message: message.to_owned(),
            }
        } else if let Some(rest) = text.strip_prefix("unknown field ") {
            let mut names = quoted(rest).into_iter();
            Self::UnknownKey {
                name: names.next().unwrap_or_default(),
                known: names.collect(),
            }
        } else if let Some(rest) = text.strip_prefix("unknown variant ") {
            let mut names = quoted(rest).into_iter();
            Self::UnknownVariant {
                name: names.next().unwrap_or_default(),
                known: names.collect(),
            }
        } else if let Some(rest) = text.strip_prefix("missing field ") {
            Self::MissingKey(quoted(rest).into_iter().next().unwrap_or_default())
        } else if let Some((_, expected)) = text
            .split_once(", expected ")
            .filter(|_| text.starts_with("invalid "))
        {
            Self::Mismatch {
                expected: plain(expected),
            }
        } else {
            Self::Other(text.to_owned())
        }
    }

    /// Reports the fault, found at a node, unless it follows from an earlier
    /// cut. Gives the path of what to cut off next.
    fn judge(
        self,
        node: &Node,
        key_place: Option<Place>,
        path: &[String],
        sources: &mut Sources,
    ) -> Vec<String> {
        let child = |name: &str| [path, &[name.to_owned()]].concat();
        // Serde's path to an unknown key may or may not include it.
        let locate = |name: &str| match (key_place, node.key_place(name)) {
            (Some(place), _) if path.last().is_some_and(|last| last == name) => {
                (path.to_vec(), place)
            }
            (_, Some(place)) => (child(name), place),
            _ => (path.to_vec(), node.place),
        };
        let has_cut = match &node.kind {
            Kind::Scalar(_) => false,
            Kind::Sequence(items) => items.iter().any(|item| item.pruned),
            Kind::Mapping(_) => node.entries().iter().any(|(_, value)| value.pruned),
        };
        match self {
            Self::UnknownKey { name, known } => {
                let (path, place) = locate(&name);
                let message = format!(
                    "unknown key `{}`, expected {}",
                    excerpt(&name),
                    one_of(&known)
                );
                let nearest = nearest(&name, known.iter().map(String::as_str));
                sources.report(place, dotted(&path), message, nearest);
                path
            }
            Self::UnknownVariant { name, known } => {
                let (path, place) = locate(&name);
                let message = format!("expected {}, found `{}`", one_of(&known), excerpt(&name));
                let nearest = nearest(&name, known.iter().map(String::as_str));
                sources.report(place, dotted(&path), message, nearest);
                path
            }
            Self::MissingKey(name) => {
                let cut_before = node.get(&name).is_some_and(|value| value.pruned);
                if !cut_before {
                    sources.report(
                        node.place,
                        dotted(path),
                        format!("the key `{name}` is missing"),
                        None,
                    );
                }
                path.to_vec()
            }
            // What was cut off is missing for that reason alone.
            Self::Clash { key, .. } if node.get(&key).is_some_and(|value| value.pruned) => {
                path.to_vec()
            }
            Self::Clash { key, message } => {
                let place = node.key_place(&key).unwrap_or(node.place);
                sources.report(place, dotted(&child(&key)), message, None);
                if node.get(&key).is_some() {
                    child(&key)
                } else {
                    path.to_vec()
                }
            }
            Self::Mismatch { .. } | Self::Other(_) if has_cut => path.to_vec(),
            Self::Mismatch { expected } => {
                let found = match &node.kind {
                    Kind::Mapping(_) if node.entries().len() > 1 => {
                        let keys = node.entries().iter();
                        let keys: Vec<_> = keys.map(|(key, _)| excerpt(&key.name)).collect();
                        format!("the keys `{}`", keys.join("`, `"))
                    }
                    _ => describe(node),
                };
                let message = format!("expected {expected}, found {found}");
                sources.report(node.place, dotted(path), message, None);
                path.to_vec()
            }
            Self::Other(message) => {
                sources.report(node.place, dotted(path), message, None);
                path.to_vec()
            }
        }
    }
}

fn one_of(names: &[String]) -> String {
    match names {
        [] => "none".to_owned(),
        [name] => format!("`{name}`"),
        [names @ .., last] => format!("`{}` or `{last}`", names.join("`, `")),
    }
}

/// What serde expects, in the words of someone who writes scenes.
fn plain(expected: &str) -> String {
    match expected {
        "f32" => "a number".to_owned(),
        "u32" | "u64" => "a whole number, 0 or more".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a string" => "text".to_owned(),
        "path string" => "the path of a file".to_owned(),
        "a map" => "a mapping".to_owned(),
        "a sequence" => "a list".to_owned(),
        "map with a single key" => "one kind and its keys, as in `{kind: {key: value}}`".to_owned(),
        "struct variant" | "newtype variant" => {
            "the keys of this kind below it, as in `{kind: {key: value}}`".to_owned()
        }
        "unit variant" => "a name alone".to_owned(),
        "fewer elements in sequence" => "a shorter list".to_owned(),
        _ => match (
            expected.strip_prefix("an array of length "),
            expected.split_once(' '),
        ) {
            (Some(length), _) => format!("a list of {length}"),
            (None, Some(("struct" | "enum", _))) => "a mapping".to_owned(),
            _ => expected.to_owned(),
        },
    }
}

pub(super) fn describe(node: &Node) -> String {
    match &node.kind {
        Kind::Scalar(Scalar::Null) => "nothing".to_owned(),
        Kind::Scalar(Scalar::Bool(flag)) => format!("`{flag}`"),
        Kind::Scalar(Scalar::Unsigned(number)) => format!("the number {number}"),
        Kind::Scalar(Scalar::Signed(number)) => format!("the number {number}"),
        Kind::Scalar(Scalar::Float(number)) => format!("the number {number:?}"),
        Kind::Scalar(Scalar::Text(text)) => format!("the text `{}`", excerpt(text)),
        Kind::Sequence(items) => format!("a list of {}", items.len()),
        Kind::Mapping(_) => "a mapping".to_owned(),
    }
}
