//! Values of TOML from `toml`, of JSON from `serde_json`, and both to text.

use super::{Content, FromNode, Node, NodeError, ToNode};
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::collections::HashSet;
use std::fmt;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

impl Node {
    /// Parses a TOML text.
    ///
    /// # Errors
    /// The text is not valid TOML.
    pub fn parse(text: &str) -> Result<Node, NodeError> {
        let table = DeTable::parse(text)?;
        Ok(Node { span: Some(table.span()), content: content_of_table(table.into_inner()) })
    }

    /// Parses a JSON text.
    ///
    /// # Errors
    /// The text is not valid JSON. The message has the line and the column.
    pub fn parse_json(text: &[u8]) -> Result<Node, NodeError> {
        serde_json::from_slice(text).map_err(|e| NodeError::new(e.to_string(), &None))
    }

    /// The value as the crate `toml` has it.
    ///
    /// # Errors
    /// A whole number is above that of i64, a path is not UTF-8, or the value or an element of a list is `null`.
    pub fn into_toml(self) -> Result<Value, NodeError> {
        Ok(match self.content {
            Content::Boolean(value) => Value::Boolean(value),
            Content::Integer(value) => match value.try_into() {
                Ok(value) => Value::Integer(value),
                Err(_) => return Err(NodeError::new("a whole number is out of range", &self.span)),
            },
            Content::Float(value) => Value::Float(value),
            Content::Text(text) => Value::String(text),
            Content::List(list) => Value::Array(list.into_iter().map(Node::into_toml).collect::<Result<_, _>>()?),
            Content::Table(table) => {
                let mut entries = Table::new();
                for (key, value) in table {
                    if !matches!(value.content, Content::Null) {
                        entries.insert(String::from_node(key)?, value.into_toml()?);
                    }
                }
                Value::Table(entries)
            }
            Content::Null | Content::Date => return Err(self.invalid("a value of TOML")),
            Content::Fault(message) => return Err(NodeError::new(message, &self.span)),
        })
    }
}

fn content_of_table(table: DeTable) -> Content {
    let entry = |(key, value): (toml::Spanned<toml::de::DeString>, toml::Spanned<DeValue>)| {
        let name = Node { span: Some(key.span()), content: Content::Text(key.into_inner().into_owned()) };
        (name, of_spanned(value))
    };
    Content::Table(table.into_iter().map(entry).collect())
}

fn of_spanned(value: toml::Spanned<DeValue>) -> Node {
    let span = Some(value.span());
    let content = match value.into_inner() {
        DeValue::String(text) => Content::Text(text.into_owned()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(number) => Content::Integer(number.into()),
            Err(_) => Content::Fault("integer number overflowed"),
        },
        DeValue::Float(number) => match number.as_str().parse::<f64>() {
            Ok(value) if value.is_finite() || !number.as_str().contains(|c: char| c.is_ascii_digit()) => {
                Content::Float(value)
            }
            _ => Content::Fault("floating-point number overflowed"),
        },
        DeValue::Boolean(value) => Content::Boolean(value),
        DeValue::Datetime(_) => Content::Date,
        DeValue::Array(list) => Content::List(list.into_iter().map(of_spanned).collect()),
        DeValue::Table(table) => content_of_table(table),
    };
    Node { span, content }
}

impl From<Value> for Node {
    fn from(value: Value) -> Node {
        Node::of(match value {
            Value::String(text) => Content::Text(text),
            Value::Integer(number) => Content::Integer(number.into()),
            Value::Float(number) => Content::Float(number),
            Value::Boolean(value) => Content::Boolean(value),
            Value::Datetime(_) => Content::Date,
            Value::Array(list) => Content::List(list.into_iter().map(Node::from).collect()),
            Value::Table(table) => {
                Content::Table(table.into_iter().map(|(key, value)| (key.to_node(), Node::from(value))).collect())
            }
        })
    }
}

impl Serialize for Node {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.content {
            Content::Null => serializer.serialize_none(),
            Content::Boolean(value) => serializer.serialize_bool(*value),
            Content::Integer(value) => match i64::try_from(*value) {
                Ok(value) => serializer.serialize_i64(value),
                Err(_) => serializer.serialize_u64(u64::try_from(*value).map_err(S::Error::custom)?),
            },
            Content::Float(value) => serializer.serialize_f64(*value),
            Content::Text(text) => serializer.serialize_str(text),
            Content::Date => Err(S::Error::custom("a date cannot be written")),
            Content::Fault(message) => Err(S::Error::custom(message)),
            Content::List(list) => serializer.collect_seq(list),
            Content::Table(table) => serializer.collect_map(table.iter().map(|(key, value)| (key, value))),
        }
    }
}

/// Of JSON.
impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Node, D::Error> {
        deserializer.deserialize_any(Visitor).map(Node::of)
    }
}

struct Visitor;

impl<'de> de::Visitor<'de> for Visitor {
    type Value = Content;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a value of JSON")
    }

    fn visit_unit<E>(self) -> Result<Content, E> {
        Ok(Content::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Content, E> {
        Ok(Content::Boolean(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Content, E> {
        Ok(Content::Integer(value.into()))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Content, E> {
        Ok(Content::Integer(value.into()))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Content, E> {
        Ok(Content::Float(value))
    }

    fn visit_str<E>(self, text: &str) -> Result<Content, E> {
        Ok(Content::Text(text.into()))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, mut access: A) -> Result<Content, A::Error> {
        let mut list = Vec::new();
        while let Some(value) = access.next_element()? {
            list.push(value);
        }
        Ok(Content::List(list))
    }

    fn visit_map<A: de::MapAccess<'de>>(self, mut access: A) -> Result<Content, A::Error> {
        let (mut table, mut keys) = (Vec::new(), HashSet::new());
        while let Some((key, value)) = access.next_entry::<String, Node>()? {
            table.push((key.to_node(), value));
            if let Some(twice) = keys.replace(key) {
                return Err(de::Error::custom(format!("duplicate field `{twice}`")));
            }
        }
        Ok(Content::Table(table))
    }
}
