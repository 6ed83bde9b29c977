//! YAML to a tree that knows the place of every node.
//!
//! `saphyr-parser` says where things are, `serde_yaml` what a scalar means.

use super::problem::{Place, Sources};
use super::tree::{Key, Kind, Mapping, Node, Scalar, dotted};
use crate::text::excerpt;
use saphyr_parser::{Event, Parser, ScalarStyle, Span};
use serde::de::IgnoredAny;
use serde_yaml::Value;
use std::borrow::Cow;
use std::collections::HashMap;

/// Deeper files are not scenes, and would overflow the stack of what walks
/// over them.
pub(super) const MAX_DEPTH: usize = 64;
/// How many nodes aliases may add before a file is taken for an attack.
const MAX_ALIASED: usize = 1_000_000;
/// How many bytes may be read again and again for tabs that the parser refuses.
const MAX_REREAD: usize = 1 << 28;
/// What the parser says of a tab between a colon and a value, which YAML allows
/// (1.2.2, 6.2).
const TAB_REFUSED: &str = "':' must be followed by a valid YAML whitespace";

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
    for event in Parser::new_from_str(&with_spaces_after_colons(text)) {
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

/// The text with spaces for the tabs that the parser refuses; as long, so that
/// places stay what they are.
fn with_spaces_after_colons(text: &str) -> Cow<'_, str> {
    if !text.contains(":\t") {
        return Cow::Borrowed(text);
    }
    // JSON, as many programs indent it: no string of it can hold a tab.
    if serde_json::from_str::<IgnoredAny>(text).is_ok() {
        return Cow::Owned(text.replace('\t', " "));
    }
    let mut text = text.to_owned();
    for _ in 0..1 + MAX_REREAD / text.len() {
        // After an error the parser gives it again without end.
        let error = Parser::new_from_str(&text).find_map(Result::err);
        let refused = error.filter(|error| error.info() == TAB_REFUSED);
        let refused = refused.map(|error| error.marker().index());
        let Some(value) = refused else { break };
        let Some((value, _)) = text.char_indices().nth(value) else {
            break;
        };
        let start = text[..value].trim_end_matches('\t').len();
        if start == value {
            break;
        }
        text.replace_range(start..value, &" ".repeat(value - start));
    }
    Cow::Owned(text)
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
        Place::new(self.source, line, column + offset, width.max(1))
    }

    fn path(&self) -> String {
        let steps = self.open.iter().filter_map(|open| match &open.kind {
            Kind::Sequence(items) => Some(items.len().to_string()),
            _ => open.key.as_ref().map(|key| key.name.to_string()),
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
                format!("expected no YAML tag, found `{}`", excerpt(&tag)),
                None,
            );
        }
        match event {
            Event::Scalar(text, style, anchor, _) => {
                let scalar = scalar(&text, style);
                let number = match scalar {
                    Scalar::Unsigned(number) => number as f64,
                    Scalar::Signed(number) => number as f64,
                    Scalar::Float(number) => number,
                    _ => 0.0,
                };
                let mut node = Node::new(Kind::Scalar(scalar), place);
                if !(number as f32).is_finite() {
                    let text = excerpt(&text);
                    let message = format!("expected a finite number, found `{text}`");
                    sources.report(place, self.path(), message, None);
                    node.pruned = true;
                }
                self.add(node, anchor, Some(&text), sources);
            }
            Event::SequenceStart(anchor, _) => {
                self.begin(Kind::Sequence(Vec::new()), place, anchor, sources)?
            }
            Event::MappingStart(anchor, _) => {
                self.begin(Kind::Mapping(Mapping::default()), place, anchor, sources)?
            }
            Event::SequenceEnd | Event::MappingEnd => {
                if let Some(Open {
                    mut kind,
                    place,
                    anchor,
                    ..
                }) = self.open.pop()
                {
                    // Millions of them are what a large scene consists of.
                    match &mut kind {
                        Kind::Scalar(_) => {}
                        Kind::Sequence(items) => items.shrink_to_fit(),
                        Kind::Mapping(mapping) => mapping.shrink_to_fit(),
                    }
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
    fn add(&mut self, node: Node, anchor: usize, text: Option<&str>, sources: &mut Sources) {
        if anchor != 0 {
            self.anchors.insert(anchor, node.clone());
        }
        let Some(open) = self.open.last_mut() else {
            self.root = Some(node);
            return;
        };
        let mapping = match &mut open.kind {
            Kind::Sequence(items) => return items.push(node),
            Kind::Mapping(mapping) => mapping,
            Kind::Scalar(_) => unreachable!("scalars are never open"),
        };
        if let Some(key) = open.key.take() {
            if !open.drop_next {
                mapping.push(key, node);
            }
            return;
        }
        let place = node.place;
        let fault = match text {
            None => Some("expected a name as key, found a collection".to_owned()),
            Some("<<") => Some(
                "merge keys are not read: give the keys themselves, or an alias for the whole"
                    .to_owned(),
            ),
            Some(name) => mapping.position(name).map(|first| {
                let line = mapping.entries()[first].0.place.line;
                let name = excerpt(name);
                format!("the key `{name}` is given twice, first in line {line}")
            }),
        };
        open.drop_next = fault.is_some();
        if let Some(fault) = fault {
            sources.report(place, self.path(), fault, None);
        }
        if let Some(open) = self.open.last_mut() {
            open.key = Some(Key {
                name: text.unwrap_or_default().into(),
                place,
            });
        }
    }
}

/// The meaning of a scalar: text when quoted, else what YAML says.
fn scalar(text: &str, style: ScalarStyle) -> Scalar {
    let as_text = || Scalar::Text(text.into());
    if style != ScalarStyle::Plain {
        return as_text();
    }
    // Most are names or decimals, which need no parser.
    const WORDS: [&str; 9] = [
        "null", "Null", "NULL", "true", "True", "TRUE", "false", "False", "FALSE",
    ];
    let digits = |bytes: &[u8]| bytes.len() < 15 && bytes.iter().all(u8::is_ascii_digit);
    let decimal = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
    let parsed = match text.as_bytes() {
        [first, ..] if first.is_ascii_alphabetic() && !WORDS.contains(&text) => return as_text(),
        [b'1'..=b'9', rest @ ..] if digits(rest) => text.parse().ok().map(Scalar::Unsigned),
        [b'-', b'1'..=b'9', rest @ ..] if digits(rest) => text.parse().ok().map(Scalar::Signed),
        [b'0'..=b'9', rest @ ..] | [b'-', b'0'..=b'9', rest @ ..]
            if rest.contains(&b'.') && rest.iter().all(decimal) =>
        {
            text.parse().ok().map(Scalar::Float)
        }
        _ => None,
    };
    if let Some(scalar) = parsed {
        return scalar;
    }
    match serde_yaml::from_str(text) {
        Ok(Value::Null) => Scalar::Null,
        Ok(Value::Bool(flag)) => Scalar::Bool(flag),
        Ok(Value::Number(number)) => match (number.as_u64(), number.as_i64()) {
            (Some(number), _) => Scalar::Unsigned(number),
            (None, Some(number)) => Scalar::Signed(number),
            (None, None) => Scalar::Float(number.as_f64().unwrap_or(f64::NAN)),
        },
        _ => as_text(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tree::Step;
    use super::*;
    use proptest::prelude::*;
    use serde_yaml::Mapping as YamlMapping;

    fn value_of(node: &Node) -> Value {
        match &node.kind {
            Kind::Scalar(Scalar::Null) => Value::Null,
            Kind::Scalar(Scalar::Bool(flag)) => Value::Bool(*flag),
            Kind::Scalar(Scalar::Unsigned(number)) => Value::Number((*number).into()),
            Kind::Scalar(Scalar::Signed(number)) => Value::Number((*number).into()),
            Kind::Scalar(Scalar::Float(number)) => Value::Number((*number).into()),
            Kind::Scalar(Scalar::Text(text)) => Value::String(text.to_string()),
            Kind::Sequence(items) => Value::Sequence(items.iter().map(value_of).collect()),
            Kind::Mapping(mapping) => {
                let entries = mapping.entries().iter();
                let entries = entries
                    .map(|(key, node)| (Value::String(key.name.to_string()), value_of(node)));
                Value::Mapping(entries.collect::<YamlMapping>())
            }
        }
    }

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
                .collect::<Option<YamlMapping>>()
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
            value_of(&tree),
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
                    prop_assert_eq!(value_of(&tree), value);
                }
            }
        }
    }
}
