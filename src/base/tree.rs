//! Values of a TOML text or table as a tree from which types are deserialized. Each value keeps its position in the text.
//!
//! The compiler generates serde's code for a type once for each kind of input. `toml` has four kinds: a table in memory and three for text.
//! [`Node`] is the only kind here. docs/experiments/compiling.md states the savings.

use serde::de::{self, DeserializeOwned, DeserializeSeed, Deserializer, Unexpected, Visitor};
use std::fmt::{self, Display};
use std::ops::Range;
use toml::Value;
use toml::de::{DeTable, DeValue};

/// A value of TOML and, if it was parsed from a text, the range of bytes of that text.
#[derive(Clone, Debug)]
pub struct Node {
    span: Option<Range<usize>>,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    Boolean(bool),
    Integer(i64),
    Float(f64),
    Text(String),
    /// A date or a time. No type that is read here has one.
    Date,
    List(Vec<Node>),
    /// Pairs of key and value, in the order of the keys if they come from a text.
    Table(Vec<(Node, Node)>),
    /// A number that its type cannot hold, in words.
    Overflow(&'static str),
}

/// Why a value does not fit the type that is deserialized, in one line.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeError {
    fault: Fault,
    message: String,
    span: Option<Range<usize>>,
}

/// The kinds of errors that are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A table lacks a key that its type needs.
    MissingKey,
    /// A table has a key that its type does not have.
    UnknownKey,
    /// Any other fault, such as a syntax error of the text.
    Other,
}

impl NodeError {
    fn new(message: String, span: Option<Range<usize>>) -> NodeError {
        NodeError { fault: Fault::Other, message: in_words(message), span }
    }

    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// The message, without the position in the text.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The range of the faulty bytes of the text. None if the value comes from a table in memory.
    pub fn span(&self) -> Option<Range<usize>> {
        self.span.clone()
    }

    /// This error at `span`, unless it has a place already.
    fn at(mut self, span: &Option<Range<usize>>) -> NodeError {
        if self.span.is_none() {
            self.span.clone_from(span);
        }
        self
    }
}

impl Display for NodeError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// A message with words that a user knows in place of the type that serde expected.
fn in_words(message: String) -> String {
    let Some((before, expected)) = message.rsplit_once("expected ") else { return message };
    let words = match expected {
        "f32" | "f64" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" | "i32" | "i64" => "a whole number",
        "a boolean" => "true or false",
        "a string" => "a text",
        _ => return message,
    };
    format!("{before}expected {words}")
}

impl std::error::Error for NodeError {}

impl de::Error for NodeError {
    fn custom<T: Display>(message: T) -> NodeError {
        NodeError::new(message.to_string(), None)
    }

    fn missing_field(field: &'static str) -> NodeError {
        let Words(message) = de::Error::missing_field(field);
        NodeError { fault: Fault::MissingKey, message, span: None }
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> NodeError {
        let Words(message) = de::Error::unknown_field(field, expected);
        NodeError { fault: Fault::UnknownKey, message, span: None }
    }
}

/// What serde says of a fault.
#[derive(Debug)]
struct Words(String);

impl Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Words {}

impl de::Error for Words {
    fn custom<T: Display>(message: T) -> Words {
        Words(message.to_string())
    }
}

impl From<toml::de::Error> for NodeError {
    fn from(error: toml::de::Error) -> NodeError {
        NodeError::new(error.message().to_string(), error.span())
    }
}

/// Deserializes a type from a TOML text.
///
/// # Errors
/// The text is not valid TOML, or a value does not fit the type. The error has the position.
pub fn from_text<T: DeserializeOwned>(text: &str) -> Result<T, NodeError> {
    T::deserialize(Node::parse(text)?)
}

impl Node {
    /// Parses a TOML text.
    ///
    /// # Errors
    /// The text is not valid TOML.
    pub fn parse(text: &str) -> Result<Node, NodeError> {
        let table = DeTable::parse(text)?;
        Ok(Node { span: Some(table.span()), content: content_of_table(table.into_inner()) })
    }

    /// Removes a key from this table and returns its value. None if the key is missing or this value is not a table.
    pub fn take(&mut self, key: &str) -> Option<Node> {
        let Content::Table(table) = &mut self.content else { return None };
        let at = table.iter().position(|(name, _)| matches!(&name.content, Content::Text(name) if name == key))?;
        Some(table.remove(at).1)
    }

    /// The value of a key of this table. None if the key is missing or this value is not a table.
    pub fn at(&mut self, key: &str) -> Option<&mut Node> {
        let Content::Table(table) = &mut self.content else { return None };
        let is_named = |name: &Node| matches!(&name.content, Content::Text(name) if name == key);
        table.iter_mut().find(|(name, _)| is_named(name)).map(|(_, value)| value)
    }

    /// Adds a key with an integer to this table. Does nothing if the key exists or this value is not a table.
    pub fn add(&mut self, key: &str, value: i64) {
        let is_there = self.at(key).is_some();
        if let (Content::Table(table), false) = (&mut self.content, is_there) {
            let name = Node { span: None, content: Content::Text(key.into()) };
            table.push((name, Node { span: None, content: Content::Integer(value) }));
        }
    }

    pub fn as_bool(&self) -> Option<bool> {
        match self.content {
            Content::Boolean(value) => Some(value),
            _ => None,
        }
    }

    /// The kind of the value, as `toml` names it.
    fn kind(&self) -> &'static str {
        match self.content {
            Content::Boolean(_) => "boolean",
            Content::Integer(_) => "integer",
            Content::Float(_) => "float",
            Content::Text(_) => "string",
            Content::Date => "datetime",
            Content::List(_) => "array",
            Content::Table(_) => "table",
            Content::Overflow(_) => "number",
        }
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
            Ok(number) => Content::Integer(number),
            Err(_) => Content::Overflow("integer number overflowed"),
        },
        DeValue::Float(number) => match number.as_str().parse::<f64>() {
            Ok(value) if value.is_finite() || !number.as_str().contains(|c: char| c.is_ascii_digit()) => {
                Content::Float(value)
            }
            _ => Content::Overflow("floating-point number overflowed"),
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
        let content = match value {
            Value::String(text) => Content::Text(text),
            Value::Integer(number) => Content::Integer(number),
            Value::Float(number) => Content::Float(number),
            Value::Boolean(value) => Content::Boolean(value),
            Value::Datetime(_) => Content::Date,
            Value::Array(list) => Content::List(list.into_iter().map(Node::from).collect()),
            Value::Table(table) => {
                let entry = |(key, value)| (Node { span: None, content: Content::Text(key) }, Node::from(value));
                Content::Table(table.into_iter().map(entry).collect())
            }
        };
        Node { span: None, content }
    }
}

impl<'de> Deserializer<'de> for Node {
    type Error = NodeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, NodeError> {
        let span = self.span;
        match self.content {
            Content::Boolean(value) => visitor.visit_bool(value),
            Content::Integer(value) => visitor.visit_i64(value),
            Content::Float(value) => visitor.visit_f64(value),
            Content::Text(value) => visitor.visit_string(value),
            Content::Date => Err(de::Error::invalid_type(Unexpected::Other("date"), &visitor)),
            Content::Overflow(message) => Err(de::Error::custom(message)),
            Content::List(list) => visitor.visit_seq(Elements(list.into_iter())),
            Content::Table(table) => visitor.visit_map(Entries { rest: table.into_iter(), value: None }),
        }
        .map_err(|error| error.at(&span))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, NodeError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, NodeError> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, NodeError> {
        let span = self.span.clone();
        let (name, value) = self.variant()?;
        visitor.visit_enum(Variant { name, value }).map_err(|error: NodeError| error.at(&span))
    }

    serde::forward_to_deserialize_any! {
        bool u8 u16 u32 u64 i8 i16 i32 i64 f32 f64 char str string seq bytes byte_buf map struct unit ignored_any unit_struct
        tuple_struct tuple identifier
    }
}

impl Node {
    /// That a table has no other keys than these.
    fn check_keys(&self, fields: &[&str]) -> Result<(), NodeError> {
        let Content::Table(table) = &self.content else { return Ok(()) };
        for (name, _) in table {
            if let Content::Text(key) = &name.content
                && !fields.contains(&key.as_str())
            {
                let message = format!("unexpected keys in table: {key}, available keys: {}", fields.join(", "));
                return Err(NodeError::new(message, name.span.clone()));
            }
        }
        Ok(())
    }

    /// The name of a variant, and what it holds.
    fn variant(self) -> Result<(Node, Option<Node>), NodeError> {
        let fault = |message: &str| NodeError::new(message.into(), self.span.clone());
        match self.content {
            Content::Text(_) => Ok((self, None)),
            Content::Table(ref table) if table.is_empty() => Err(fault("wanted exactly 1 element, found 0 elements")),
            Content::Table(table) => {
                let mut entries = table.into_iter();
                match (entries.next(), entries.next()) {
                    (Some((name, value)), None) => Ok((name, Some(value))),
                    _ => Err(NodeError::new("wanted exactly 1 element, more than 1 element".into(), self.span)),
                }
            }
            _ => Err(fault("wanted string or table")),
        }
    }
}

struct Elements(std::vec::IntoIter<Node>);

impl<'de> de::SeqAccess<'de> for Elements {
    type Error = NodeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, NodeError> {
        self.0.next().map(|element| seed.deserialize(element)).transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

struct Entries {
    rest: std::vec::IntoIter<(Node, Node)>,
    value: Option<Node>,
}

impl<'de> de::MapAccess<'de> for Entries {
    type Error = NodeError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, NodeError> {
        let Some((key, value)) = self.rest.next() else { return Ok(None) };
        self.value = Some(value);
        seed.deserialize(key).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, NodeError> {
        let value = self.value.take().ok_or_else(|| <NodeError as de::Error>::custom("a value without a key"))?;
        let span = value.span.clone();
        seed.deserialize(value).map_err(|error| error.at(&span))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}

struct Variant {
    name: Node,
    value: Option<Node>,
}

impl<'de> de::EnumAccess<'de> for Variant {
    type Error = NodeError;
    type Variant = Held;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Held), NodeError> {
        Ok((seed.deserialize(self.name)?, Held(self.value)))
    }
}

/// What a variant holds; none if only its name is given.
struct Held(Option<Node>);

impl Held {
    fn needed(self, what: &'static str) -> Result<Node, NodeError> {
        self.0.ok_or_else(|| de::Error::invalid_type(Unexpected::UnitVariant, &what))
    }
}

impl<'de> de::VariantAccess<'de> for Held {
    type Error = NodeError;

    fn unit_variant(self) -> Result<(), NodeError> {
        let Some(node) = self.0 else { return Ok(()) };
        let fault = |message: String| Err(NodeError::new(message, node.span.clone()));
        match &node.content {
            Content::List(list) if list.is_empty() => Ok(()),
            Content::Table(table) if table.is_empty() => Ok(()),
            Content::List(_) => fault("expected empty array".into()),
            Content::Table(_) => fault("expected empty table".into()),
            _ => fault(format!("expected table, found {}", node.kind())),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, NodeError> {
        seed.deserialize(self.needed("newtype variant")?)
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, NodeError> {
        let node = self.needed("tuple variant")?;
        let message = match &node.content {
            Content::List(list) if list.len() == length => return node.deserialize_any(visitor),
            Content::List(_) => format!("expected tuple with length {length}"),
            _ => format!("expected table, found {}", node.kind()),
        };
        Err(NodeError::new(message, node.span))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, NodeError> {
        let node = self.needed("struct variant")?;
        node.check_keys(fields)?;
        node.deserialize_any(visitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::{Deserialize, Serialize};
    use std::collections::BTreeMap;

    #[derive(Debug, Default, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    struct All {
        number: f64,
        count: u8,
        word: String,
        is_on: bool,
        maybe: Option<f32>,
        pair: [f64; 2],
        inner: Option<Inner>,
        list: Vec<Inner>,
        named: BTreeMap<String, u32>,
        choice: Choice,
        path: std::path::PathBuf,
    }

    #[derive(Debug, Default, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields)]
    struct Inner {
        at: f64,
        #[serde(default)]
        of: Choice,
    }

    #[derive(Debug, Default, PartialEq, Deserialize, Serialize)]
    #[serde(rename_all = "kebab-case")]
    enum Choice {
        #[default]
        NoneOfAll,
        Of(Box<Inner>),
        Both {
            low: f64,
        },
        Two(f64, f64),
    }

    const TEXTS: &[&str] = &[
        "",
        "number = 3",
        "number = 1e400",
        "number = -inf",
        "count = 255\nword = 'a'\nis_on = true\nmaybe = 0.1\npair = [1, 2.5]\npath = '/x'",
        "choice = 'none-of-all'",
        "choice = { of = { at = 1.0 } }",
        "[choice.both]\nlow = 2",
        "choice = { two = [1, 2] }",
        "[[list]]\nat = 1\n[[list]]\nat = 2\nof = { both = { low = 1 } }",
        "[named]\na = 1\n'b c' = 2",
        // Each of these is wrong.
        "number = 'x'",
        "\ncount = 256",
        "count = -1",
        "word = 1",
        "is_on = 'yes'",
        "pair = [1]",
        "pair = [1, 2, 3]",
        "pair = [1,\n 'x']",
        "unknown = 1",
        "[inner]\nof = 'none-of-all'",
        "[inner]\nat = 1\nmore = 2",
        "[[list]]\nat = 1\n[[list]]\nat = 'x'",
        "list = 3",
        "choice = 'other'",
        "choice = 3",
        "choice = {}",
        "choice = 'of'",
        "choice = 'both'",
        "choice = 'two'",
        "choice = { none-of-all = 3 }",
        "choice = { none-of-all = [1] }",
        "choice = { none-of-all = { a = 1 } }",
        "choice = { two = [1] }",
        "choice = { two = 3 }",
        "choice = { of = 1 }",
        "choice = { of = { at = 1 }, both = { low = 1 } }",
        "choice = { both = { low = 1, high = 2 } }",
        "[named]\na = -1",
        "number = ",
        "number = 1\nnumber = 2",
        "[inner]\nat = 1\n[inner]\nat = 2",
    ];

    /// Prevents a reading that differs from that of the crate `toml`: in a value, in a message or in its place.
    #[test]
    fn a_text_is_read_as_toml_reads_it() {
        for text in TEXTS {
            let (ours, theirs) = (from_text::<All>(text), toml::from_str::<All>(text));
            match (ours, theirs) {
                (Ok(ours), Ok(theirs)) => assert_eq!(ours, theirs, "{text}"),
                (Err(ours), Err(theirs)) => {
                    let said = in_words(theirs.message().into());
                    assert_eq!((ours.message(), ours.span()), (said.as_str(), theirs.span()), "{text}");
                }
                (ours, theirs) => panic!("{text}: {ours:?}, of toml {theirs:?}"),
            }
        }
    }

    /// Prevents a table in memory that is read otherwise than its text.
    #[test]
    fn a_table_is_read_as_its_text() {
        for text in TEXTS {
            let Ok(table) = toml::from_str::<toml::Table>(text) else { continue };
            let (ours, theirs) = (All::deserialize(Node::from(Value::Table(table))), from_text::<All>(text));
            assert_eq!(ours.as_ref().ok(), theirs.as_ref().ok(), "{text}");
            assert_eq!(ours.err().map(|e| e.to_string()), theirs.err().map(|e| e.to_string()), "{text}");
        }
    }

    #[test]
    fn a_key_that_lacks_and_one_that_is_too_many_are_told_apart() {
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Two {
            #[serde(rename = "needed")]
            _needed: u32,
        }
        for (text, fault, said) in [
            ("", Fault::MissingKey, "missing field `needed`"),
            ("needed = 1\nother = 2", Fault::UnknownKey, "unknown field `other`, expected `needed`"),
            ("needed = 'x'", Fault::Other, "invalid type: string \"x\", expected a whole number"),
        ] {
            let error = from_text::<Two>(text).expect_err(text);
            assert_eq!((error.fault(), error.message()), (fault, said));
        }
    }

    #[test]
    fn what_is_too_large_or_a_date_is_refused_in_words() {
        for (text, said) in [
            ("count = 99999999999999999999", "integer number overflowed"),
            ("number = 1979-05-27", "invalid type: date, expected a number"),
        ] {
            assert_eq!(from_text::<All>(text).expect_err("it is refused").message(), said);
        }
    }
}
