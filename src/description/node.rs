//! Nodes of a YAML file, and how typed values are read from them.

use super::tree::{Key, Kind, Node, Scalar};
use serde::de::value::{BorrowedStrDeserializer, Error};
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error as _, MapAccess, SeqAccess, Unexpected,
    VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

/// What an enum is written as: a mapping whose only key names the variant.
const SINGLE_KEY: &str = "map with a single key";

impl Node {
    fn unexpected(&self) -> Unexpected<'_> {
        match &self.kind {
            Kind::Scalar(Scalar::Null) => Unexpected::Unit,
            Kind::Scalar(Scalar::Bool(flag)) => Unexpected::Bool(*flag),
            Kind::Scalar(Scalar::Unsigned(number)) => Unexpected::Unsigned(*number),
            Kind::Scalar(Scalar::Signed(number)) => Unexpected::Signed(*number),
            Kind::Scalar(Scalar::Float(number)) => Unexpected::Float(*number),
            Kind::Scalar(Scalar::Text(text)) => Unexpected::Str(text),
            Kind::Sequence(_) => Unexpected::Seq,
            Kind::Mapping(_) => Unexpected::Map,
        }
    }
}

/// Pruned nodes are left out. Nothing is copied: scenes have millions of nodes.
impl<'de> Deserializer<'de> for &'de Node {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match &self.kind {
            Kind::Scalar(Scalar::Null) => visitor.visit_unit(),
            Kind::Scalar(Scalar::Bool(flag)) => visitor.visit_bool(*flag),
            Kind::Scalar(Scalar::Unsigned(number)) => visitor.visit_u64(*number),
            Kind::Scalar(Scalar::Signed(number)) => visitor.visit_i64(*number),
            Kind::Scalar(Scalar::Float(number)) => visitor.visit_f64(*number),
            Kind::Scalar(Scalar::Text(text)) => visitor.visit_borrowed_str(text),
            Kind::Sequence(items) => {
                let mut left = Items(items.iter());
                let value = visitor.visit_seq(&mut left)?;
                match left.size_hint() {
                    Some(0) | None => Ok(value),
                    Some(_) => {
                        let count = items.iter().filter(|item| !item.pruned).count();
                        Err(Error::invalid_length(count, &"fewer elements in sequence"))
                    }
                }
            }
            Kind::Mapping(mapping) => visitor.visit_map(Entries {
                left: mapping.entries().iter(),
                value: None,
            }),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.kind {
            Kind::Scalar(Scalar::Null) => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    /// Nothing is an empty list.
    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match &self.kind {
            Kind::Scalar(Scalar::Null) => visitor.visit_seq(Items([].iter())),
            Kind::Sequence(_) => self.deserialize_any(visitor),
            _ => Err(Error::invalid_type(self.unexpected(), &visitor)),
        }
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Error> {
        self.deserialize_seq(visitor)
    }

    /// Nothing is an empty mapping.
    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match &self.kind {
            Kind::Scalar(Scalar::Null) => visitor.visit_map(Entries {
                left: [].iter(),
                value: None,
            }),
            Kind::Mapping(_) => self.deserialize_any(visitor),
            _ => Err(Error::invalid_type(self.unexpected(), &visitor)),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.deserialize_map(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match &self.kind {
            Kind::Scalar(Scalar::Text(name)) => visitor.visit_enum(Variant {
                name,
                content: None,
            }),
            Kind::Mapping(mapping) => {
                let mut kept = mapping.entries().iter().filter(|(_, node)| !node.pruned);
                match (kept.next(), kept.next()) {
                    (Some((key, content)), None) => visitor.visit_enum(Variant {
                        name: &key.name,
                        content: Some(content),
                    }),
                    _ => Err(Error::invalid_value(Unexpected::Map, &SINGLE_KEY)),
                }
            }
            _ => Err(Error::invalid_type(self.unexpected(), &visitor)),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf
        unit unit_struct tuple_struct identifier ignored_any
    }
}

struct Items<'de>(std::slice::Iter<'de, Node>);

impl<'de> SeqAccess<'de> for Items<'de> {
    type Error = Error;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Error> {
        let next = self.0.find(|item| !item.pruned);
        next.map(|item| seed.deserialize(item)).transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.clone().filter(|item| !item.pruned).count())
    }
}

struct Entries<'de> {
    left: std::slice::Iter<'de, (Key, Node)>,
    /// That of the key that was read last.
    value: Option<&'de Node>,
}

impl<'de> MapAccess<'de> for Entries<'de> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Error> {
        let Some((key, node)) = self.left.find(|(_, node)| !node.pruned) else {
            return Ok(None);
        };
        self.value = Some(node);
        let name: BorrowedStrDeserializer<Error> = BorrowedStrDeserializer::new(&key.name);
        seed.deserialize(name).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Error> {
        let value = self.value.take();
        seed.deserialize(value.expect("a value is asked for after its key"))
    }
}

/// A name alone, or with what stands below it.
struct Variant<'de> {
    name: &'de str,
    content: Option<&'de Node>,
}

impl<'de> EnumAccess<'de> for Variant<'de> {
    type Error = Error;
    type Variant = Self;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), Error> {
        let name: BorrowedStrDeserializer<Error> = BorrowedStrDeserializer::new(self.name);
        Ok((seed.deserialize(name)?, self))
    }
}

impl<'de> Variant<'de> {
    fn content(&self, expected: &str) -> Result<&'de Node, Error> {
        self.content
            .ok_or_else(|| Error::invalid_type(Unexpected::UnitVariant, &expected))
    }
}

impl<'de> VariantAccess<'de> for Variant<'de> {
    type Error = Error;

    fn unit_variant(self) -> Result<(), Error> {
        match self.content {
            None => Ok(()),
            Some(_) => Err(Error::invalid_type(Unexpected::Map, &"unit variant")),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Error> {
        seed.deserialize(self.content("newtype variant")?)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Error> {
        self.content("tuple variant")?.deserialize_seq(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.content("struct variant")?.deserialize_map(visitor)
    }
}
