//! The nodes of a YAML file, each with its place.

use super::problem::Place;
use std::collections::HashMap;

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
    Scalar(Scalar),
    Sequence(Vec<Node>),
    Mapping(Mapping),
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Scalar {
    Null,
    Bool(bool),
    Unsigned(u64),
    /// Below zero.
    Signed(i64),
    Float(f64),
    Text(Box<str>),
}

#[derive(Clone, Debug)]
pub(super) struct Key {
    pub name: Box<str>,
    pub place: Place,
}

/// Entries in the order of the file; their keys are unique.
#[derive(Clone, Debug, Default)]
pub(super) struct Mapping {
    entries: Vec<(Key, Node)>,
    /// Where each key is, for mappings of more than [`Mapping::FEW`].
    index: Option<Box<Index>>,
}

/// Positions of keys. Boxed where it is used: few nodes have one.
#[derive(Clone, Debug)]
struct Index(HashMap<Box<str>, usize>);

impl Mapping {
    /// Up to so many keys are compared one by one: most mappings have less.
    const FEW: usize = 16;

    pub fn entries(&self) -> &[(Key, Node)] {
        &self.entries
    }

    pub fn position(&self, name: &str) -> Option<usize> {
        match &self.index {
            Some(index) => index.0.get(name).copied(),
            None => self.entries.iter().position(|(key, _)| *key.name == *name),
        }
    }

    /// Adds an entry whose key is not there yet.
    pub fn push(&mut self, key: Key, node: Node) {
        if let Some(index) = &mut self.index {
            index.0.insert(key.name.clone(), self.entries.len());
        }
        self.entries.push((key, node));
        if self.index.is_none() && self.entries.len() > Self::FEW {
            let names = self.entries.iter().map(|(key, _)| key.name.clone());
            self.index = Some(Box::new(Index(names.zip(0..).collect())));
        }
    }

    /// Gives back what growing reserved: large scenes consist of millions of them.
    pub fn shrink_to_fit(&mut self) {
        self.entries.shrink_to_fit();
    }

    pub fn into_entries(self) -> Vec<(Key, Node)> {
        self.entries
    }

    pub fn node_mut(&mut self, position: usize) -> &mut Node {
        &mut self.entries[position].1
    }
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

    /// How many nodes it consists of.
    pub fn count(&self) -> usize {
        match &self.kind {
            Kind::Scalar(_) => 1,
            Kind::Sequence(items) => 1 + items.iter().map(Node::count).sum::<usize>(),
            Kind::Mapping(mapping) => {
                let nodes = mapping.entries.iter();
                1 + nodes.map(|(_, node)| node.count()).sum::<usize>()
            }
        }
    }

    /// The entries of a mapping; none for anything else.
    pub fn entries(&self) -> &[(Key, Node)] {
        match &self.kind {
            Kind::Mapping(mapping) => mapping.entries(),
            _ => &[],
        }
    }

    fn entry(&self, key: &str) -> Option<&(Key, Node)> {
        let Kind::Mapping(mapping) = &self.kind else {
            return None;
        };
        Some(&mapping.entries[mapping.position(key)?])
    }

    /// The value of a key, pruned or not.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entry(key).map(|(_, node)| node)
    }

    /// The place of a key.
    pub fn key_place(&self, key: &str) -> Option<Place> {
        self.entry(key).map(|(name, _)| name.place)
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
            Kind::Mapping(mapping) => {
                let position = mapping.position(first)?;
                mapping.node_mut(position).at_mut(rest)
            }
        }
    }
}
