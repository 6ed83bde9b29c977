//! YAML with the place of every node.
//!
//! `saphyr-parser` says where things are, `serde_yaml` what a scalar means.

use super::problem::{Place, Sources};
use saphyr_parser::{Event, Parser, ScalarStyle, Span};
use serde_yaml::{Mapping, Value};
use std::collections::HashMap;

/// Deeper files are not scenes, and would overflow the stack of what walks
/// over them.
const MAX_DEPTH: usize = 64;
/// How many nodes aliases may add before a file is taken for an attack.
const MAX_ALIASED: usize = 1_000_000;

/// A node of a YAML file.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub kind: Kind,
    pub place: Place,
    /// Left out of what is deserialised, since something is wrong with it.
    pub pruned: bool,
}

#[derive(Clone, Debug)]
pub(super) enum Kind {
    Scalar(Value),
    Sequence(Vec<Node>),
    /// Keys are unique.
    Mapping(Vec<(Key, Node)>),
}

#[derive(Clone, Debug)]
pub(super) struct Key {
    pub name: String,
    pub place: Place,
}

/// One step down from a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Step {
    Key(String),
    /// Among the elements that are not pruned.
    Index(usize),
}

/// Joins keys and indices by dots.
pub(super) fn dotted(path: &[String]) -> String {
    path.join(".")
}

impl Node {
    pub fn new(kind: Kind, place: Place) -> Self {
        Self {
            kind,
            place,
            pruned: false,
        }
    }

    fn count(&self) -> usize {
        match &self.kind {
            Kind::Scalar(_) => 1,
            Kind::Sequence(items) => 1 + items.iter().map(Node::count).sum::<usize>(),
            Kind::Mapping(entries) => {
                1 + entries.iter().map(|(_, node)| node.count()).sum::<usize>()
            }
        }
    }

    /// The entries of a mapping; none for anything else.
    pub fn entries(&self) -> &[(Key, Node)] {
        match &self.kind {
            Kind::Mapping(entries) => entries,
            _ => &[],
        }
    }

    /// The value of a key, pruned or not.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entries()
            .iter()
            .find(|(name, _)| name.name == key)
            .map(|(_, node)| node)
    }

    /// The place of a key.
    pub fn key_place(&self, key: &str) -> Option<Place> {
        self.entries()
            .iter()
            .find(|(name, _)| name.name == key)
            .map(|(name, _)| name.place)
    }

    /// What is left after pruning.
    pub fn to_value(&self) -> Value {
        match &self.kind {
            Kind::Scalar(value) => value.clone(),
            Kind::Sequence(items) => Value::Sequence(
                items
                    .iter()
                    .filter(|item| !item.pruned)
                    .map(Node::to_value)
                    .collect(),
            ),
            Kind::Mapping(entries) => Value::Mapping(
                entries
                    .iter()
                    .filter(|(_, node)| !node.pruned)
                    .map(|(key, node)| (Value::String(key.name.clone()), node.to_value()))
                    .collect::<Mapping>(),
            ),
        }
    }

    /// Follows the steps as far as they lead; gives the last node, and the
    /// path to it in terms of the file, in which pruned elements count.
    pub fn descend(&self, steps: &[Step]) -> (&Node, Vec<String>) {
        let (node, _, path) = self.descend_by_key(steps);
        (node, path)
    }

    /// As [`Node::descend`], with the place of the last key besides.
    pub fn descend_by_key(&self, steps: &[Step]) -> (&Node, Option<Place>, Vec<String>) {
        let mut node = self;
        let mut key_place = None;
        let mut path = Vec::new();
        for step in steps {
            let next = match (step, &node.kind) {
                (Step::Key(key), Kind::Mapping(_)) => {
                    node.get(key).map(|child| (key.clone(), child))
                }
                (Step::Index(index), Kind::Sequence(items)) => items
                    .iter()
                    .enumerate()
                    .filter(|(_, item)| !item.pruned)
                    .nth(*index)
                    .map(|(index, item)| (index.to_string(), item)),
                _ => None,
            };
            let Some((name, child)) = next else { break };
            key_place = node.key_place(&name);
            path.push(name);
            node = child;
        }
        (node, key_place, path)
    }

    /// The node at a path in terms of the file.
    pub fn at_mut(&mut self, path: &[String]) -> Option<&mut Node> {
        let Some((first, rest)) = path.split_first() else {
            return Some(self);
        };
        match &mut self.kind {
            Kind::Scalar(_) => None,
            Kind::Sequence(items) => items.get_mut(first.parse::<usize>().ok()?)?.at_mut(rest),
            Kind::Mapping(entries) => entries
                .iter_mut()
                .find(|(key, _)| key.name == *first)
                .and_then(|(_, node)| node.at_mut(rest)),
        }
    }
}

/// What encloses the node that is being read.
struct Open {
    kind: Kind,
    place: Place,
    anchor: usize,
    /// The key whose value comes next.
    key: Option<Key>,
    /// Whether the next node is the value of a key that makes no sense.
    drop_next: bool,
}

/// Reads a source that was added before. Problems are reported; nothing comes
/// back when there is no tree to speak of.
pub(super) fn parse(
    text: &str,
    source: usize,
    offset: usize,
    sources: &mut Sources,
) -> Option<Node> {
    let mut reader = Reader {
        source,
        offset,
        anchors: HashMap::new(),
        aliased: 0,
        open: Vec::new(),
        root: None,
    };
    let mut documents = 0;
    for event in Parser::new_from_str(text) {
        match event {
            Ok((Event::DocumentStart(_), span)) => {
                documents += 1;
                if documents > 1 {
                    let place = reader.place(span);
                    sources.report(
                        place,
                        String::new(),
                        "expected one YAML document, found another".into(),
                        None,
                    );
                    return None;
                }
            }
            Ok((event, span)) => reader.event(event, span, sources)?,
            Err(error) => {
                let place = reader.place(Span::empty(*error.marker()));
                sources.report(
                    place,
                    String::new(),
                    format!("not valid YAML: {}", error.info()),
                    None,
                );
                return None;
            }
        }
    }
    reader.root
}

struct Reader {
    source: usize,
    /// How many characters of the source's first line come before the text.
    offset: usize,
    anchors: HashMap<usize, Node>,
    aliased: usize,
    open: Vec<Open>,
    root: Option<Node>,
}

impl Reader {
    fn place(&self, span: Span) -> Place {
        let (line, column) = (span.start.line().max(1), span.start.col() + 1);
        let width = if span.end.line() == span.start.line() {
            span.len()
        } else {
            usize::MAX
        };
        let offset = if line == 1 { self.offset } else { 0 };
        Place {
            source: self.source,
            line,
            column: column + offset,
            width: width.max(1),
        }
    }

    fn path(&self) -> String {
        let steps = self.open.iter().filter_map(|open| match &open.kind {
            Kind::Sequence(items) => Some(items.len().to_string()),
            _ => open.key.as_ref().map(|key| key.name.clone()),
        });
        dotted(&steps.collect::<Vec<_>>())
    }

    fn event(&mut self, event: Event, span: Span, sources: &mut Sources) -> Option<()> {
        let place = self.place(span);
        let tag = match &event {
            Event::Scalar(.., Some(tag))
            | Event::SequenceStart(_, Some(tag))
            | Event::MappingStart(_, Some(tag)) => Some(match tag.is_yaml_core_schema() {
                true => format!("!!{}", tag.suffix),
                false => tag.to_string(),
            }),
            _ => None,
        };
        if let Some(tag) = tag {
            sources.report(
                place,
                self.path(),
                format!("expected no YAML tag, found `{tag}`"),
                None,
            );
        }
        match event {
            Event::Scalar(text, style, anchor, _) => {
                let mut node = Node::new(Kind::Scalar(scalar(&text, style)), place);
                if let Kind::Scalar(Value::Number(number)) = &node.kind {
                    if !number
                        .as_f64()
                        .is_some_and(|number| (number as f32).is_finite())
                    {
                        let message = format!("expected a finite number, found `{text}`");
                        sources.report(place, self.path(), message, None);
                        node.pruned = true;
                    }
                }
                self.add(node, anchor, Some(text.into_owned()), sources);
            }
            Event::SequenceStart(anchor, _) => {
                self.begin(Kind::Sequence(Vec::new()), place, anchor, sources)?
            }
            Event::MappingStart(anchor, _) => {
                self.begin(Kind::Mapping(Vec::new()), place, anchor, sources)?
            }
            Event::SequenceEnd | Event::MappingEnd => {
                if let Some(Open {
                    kind,
                    place,
                    anchor,
                    ..
                }) = self.open.pop()
                {
                    self.add(Node::new(kind, place), anchor, None, sources);
                }
            }
            Event::Alias(anchor) => {
                // An anchor inside itself is not known yet.
                let Some(node) = self.anchors.get(&anchor).cloned() else {
                    sources.report(
                        place,
                        self.path(),
                        "this alias names what it stands in".into(),
                        None,
                    );
                    return None;
                };
                self.aliased += node.count();
                if self.aliased > MAX_ALIASED {
                    sources.report(
                        place,
                        self.path(),
                        "the aliases of this file unfold without end".into(),
                        None,
                    );
                    return None;
                }
                self.add(node, 0, None, sources);
            }
            _ => {}
        }
        Some(())
    }

    fn begin(
        &mut self,
        kind: Kind,
        place: Place,
        anchor: usize,
        sources: &mut Sources,
    ) -> Option<()> {
        if self.open.len() >= MAX_DEPTH {
            sources.report(
                place,
                self.path(),
                format!("nested more than {MAX_DEPTH} deep"),
                None,
            );
            return None;
        }
        self.open.push(Open {
            kind,
            place,
            anchor,
            key: None,
            drop_next: false,
        });
        Some(())
    }

    /// Puts a finished node where it belongs. `text` is a scalar's, as written.
    fn add(&mut self, node: Node, anchor: usize, text: Option<String>, sources: &mut Sources) {
        if anchor != 0 {
            self.anchors.insert(anchor, node.clone());
        }
        let path = self.path();
        let Some(open) = self.open.last_mut() else {
            self.root = Some(node);
            return;
        };
        match &mut open.kind {
            Kind::Sequence(items) => items.push(node),
            Kind::Mapping(entries) => match open.key.take() {
                Some(_) if open.drop_next => {}
                Some(key) => entries.push((key, node)),
                None => {
                    let first = entries
                        .iter()
                        .find(|(key, _)| Some(&key.name) == text.as_ref());
                    let fault = match (&text, first) {
                        (None, _) => Some("expected a name as key, found a collection".to_owned()),
                        (Some(name), Some((key, _))) => Some(format!(
                            "the key `{name}` is given twice, first in line {}",
                            key.place.line
                        )),
                        (Some(_), None) => None,
                    };
                    open.drop_next = fault.is_some();
                    if let Some(fault) = fault {
                        sources.report(node.place, path, fault, None);
                    }
                    open.key = Some(Key {
                        name: text.unwrap_or_default(),
                        place: node.place,
                    });
                }
            },
            Kind::Scalar(_) => unreachable!("scalars are never open"),
        }
    }
}

/// The meaning of a scalar: text when quoted, else what YAML says.
fn scalar(text: &str, style: ScalarStyle) -> Value {
    let as_text = || Value::String(text.to_owned());
    match style {
        ScalarStyle::Plain => match serde_yaml::from_str(text) {
            Ok(value @ (Value::Null | Value::Bool(_) | Value::Number(_))) => value,
            _ => as_text(),
        },
        _ => as_text(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The tree and whether anything was reported.
    fn tree_of(text: &str) -> (Option<Node>, bool) {
        let mut sources = Sources::default();
        let source = sources.add("test", text);
        let tree = parse(text, source, 0, &mut sources);
        (tree, sources.count() > 0)
    }

    /// Keys are names here, whatever they look like; none when they can't be.
    fn with_names_as_keys(value: Value) -> Option<Value> {
        match value {
            Value::Mapping(mapping) => mapping
                .into_iter()
                .map(|(key, value)| {
                    let name = match key {
                        Value::String(name) => name,
                        Value::Number(number) => number.to_string(),
                        _ => return None,
                    };
                    Some((Value::String(name), with_names_as_keys(value)?))
                })
                .collect::<Option<Mapping>>()
                .map(Value::Mapping),
            Value::Sequence(items) => items
                .into_iter()
                .map(with_names_as_keys)
                .collect::<Option<_>>()
                .map(Value::Sequence),
            value => Some(value),
        }
    }

    fn assert_same_as_serde_yaml(text: &str) {
        let (Some(tree), false) = tree_of(text) else {
            panic!("expected a tree of {text}")
        };
        assert_eq!(
            tree.to_value(),
            serde_yaml::from_str::<Value>(text).unwrap(),
            "{text}"
        );
    }

    #[test]
    fn trees_mean_what_serde_yaml_reads() {
        for text in [
            "a: 1\nb: -2.5e-3\nc: 0x10\nd: 1_000\ne: .5\nf: +3\ng: 007",
            "a: true\nb: yes\nc: ~\nd: null\ne:\nf: 'true'\ng: \"1\"\nh: |\n  two\n  lines\ni: >\n  folded\n  lines\n",
            "[point: {power: 1, size: [1, 2]}, {spot: {power: 2}}, [a: b]]",
            "- a: 1\n  b: 2\n-\n  - x\n  - # nothing\n- {}\n- []",
            "a: &x {b: [1, 2]}\nc: *x\nd: [*x, *x]",
            "Größe: 'it''s'\n\"k \\u00e9\": a b  c\n? long\n: value",
        ] {
            assert_same_as_serde_yaml(text);
        }
    }

    #[test]
    fn places_are_those_of_the_text() {
        let (tree, _) = tree_of("ä: {b: [1, 23]}\nc: 'd e'");
        let tree = tree.unwrap();
        let (node, path) =
            tree.descend(&[Step::Key("ä".into()), Step::Key("b".into()), Step::Index(1)]);
        assert_eq!(path, ["ä", "b", "1"]);
        assert_eq!(
            node.place,
            Place {
                source: 0,
                line: 1,
                column: 12,
                width: 2
            }
        );
        assert_eq!(
            tree.get("c").unwrap().place,
            Place {
                source: 0,
                line: 2,
                column: 4,
                width: 5
            }
        );
        assert_eq!(
            tree.key_place("c"),
            Some(Place {
                source: 0,
                line: 2,
                column: 1,
                width: 1
            })
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 10_000,
            failure_persistence: None,
            rng_seed: proptest::test_runner::RngSeed::Fixed(7),
            ..ProptestConfig::default()
        })]

        /// Two parsers that share no code agree on what both take for YAML.
        #[test]
        fn flow_texts_mean_what_serde_yaml_reads(text in "(\\{|\\[|\\}|\\]|, |: |a|b: |c |'d'|1|-2|\n| ){0,16}") {
            if let ((Some(tree), false), Ok(value)) = (tree_of(&text), serde_yaml::from_str::<Value>(&text)) {
                if let Some(value) = with_names_as_keys(value) {
                    prop_assert_eq!(tree.to_value(), value);
                }
            }
        }
    }
}
