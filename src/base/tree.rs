//! Values of TOML and JSON as a tree, and the types that are read from it and written as it. Each value of a TOML text keeps its position.
//!
//! [`FromNode`] and [`ToNode`] are what serde's traits are elsewhere. Serde's derives generate a visitor, a key type and loops for each type, and the compiler
//! makes them once for each kind of input. The derives of these traits generate a table of keys and places, over which the functions here loop.
//! docs/experiments/compiling.md states the savings.

use glam::DVec3;
use serde::de::Unexpected;
use serde::ser::{Error as _, SerializeMap, SerializeSeq};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::collections::BTreeMap;
use std::fmt::{self, Display};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

pub use echolume_derive::{FromNode, ToNode};

/// A value and, if it was parsed from a TOML text, the range of bytes of that text.
#[derive(Clone, Debug)]
pub struct Node {
    span: Option<Range<usize>>,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    /// The `null` of JSON. TOML has none: an entry of a table with this value is not written.
    Null,
    Boolean(bool),
    /// Of the range of i64 or u64.
    Integer(i128),
    Float(f64),
    Text(String),
    /// A date or a time. No type that is read here has one.
    Date,
    List(Vec<Node>),
    /// Pairs of key and value, in the order of the keys if they come from a TOML text.
    Table(Vec<(Node, Node)>),
    /// A value that its type cannot hold, or that cannot be written, in words.
    Fault(&'static str),
}

/// A type that is read from a value of TOML or JSON.
pub trait FromNode: Sized {
    /// # Errors
    /// The value does not fit the type.
    fn from_node(node: Node) -> Result<Self, NodeError>;

    /// The value for a key that is missing. None: the key is needed.
    fn missing() -> Option<Self> {
        None
    }
}

/// A type that is written as a value of TOML or JSON.
pub trait ToNode {
    fn to_node(&self) -> Node;
}

/// Why a value does not fit its type, in one line.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeError {
    fault: Fault,
    message: String,
    span: Option<Range<usize>>,
    /// Keys and indices that lead to the value if it has no position.
    path: String,
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
    fn new(message: impl Into<String>, span: &Option<Range<usize>>) -> NodeError {
        NodeError { fault: Fault::Other, message: message.into(), span: span.clone(), path: String::new() }
    }

    /// That a table lacks a key. `span`: the position of the table.
    pub fn missing(key: &str, span: &Option<Range<usize>>) -> NodeError {
        NodeError { fault: Fault::MissingKey, ..NodeError::new(format!("missing field `{key}`"), span) }
    }

    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// The message, without the position in the text or the keys that lead there.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The range of the faulty bytes of the text. None if the value does not come from a TOML text.
    pub fn span(&self) -> Option<Range<usize>> {
        self.span.clone()
    }

    fn within(mut self, step: &str) -> NodeError {
        let dot = if self.path.is_empty() || self.path.starts_with('[') { "" } else { "." };
        self.path = format!("{step}{dot}{}", self.path);
        self
    }
}

/// The message, after the keys that lead to the value if it has no position in a text: `passes[2].median: invalid type ...`.
impl Display for NodeError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match (&self.span, self.path.as_str()) {
            (Some(_), _) | (None, "") => f.write_str(&self.message),
            (None, path) => write!(f, "{path}: {}", self.message),
        }
    }
}

impl std::error::Error for NodeError {}

impl From<toml::de::Error> for NodeError {
    fn from(error: toml::de::Error) -> NodeError {
        NodeError::new(error.message(), &error.span())
    }
}

/// Reads a type from a TOML text.
///
/// # Errors
/// The text is not valid TOML, or a value does not fit the type. The error has the position.
pub fn from_toml<T: FromNode>(text: &str) -> Result<T, NodeError> {
    T::from_node(Node::parse(text)?)
}

/// Reads a type from a JSON text.
///
/// # Errors
/// The text is not valid JSON, or a value does not fit the type.
pub fn from_json<T: FromNode>(text: &[u8]) -> Result<T, NodeError> {
    T::from_node(Node::parse_json(text)?)
}

/// A value as TOML text. `value` is a table.
///
/// # Errors
/// A value cannot be written as TOML: a number above that of i64, or a path that is not UTF-8.
pub fn to_toml(value: &dyn ToNode) -> Result<String, toml::ser::Error> {
    toml::to_string(&value.to_node())
}

/// A value as JSON text in one line. Numbers that are infinite or NaN become `null`.
///
/// # Errors
/// A path is not UTF-8.
pub fn to_json(value: &dyn ToNode) -> Result<String, serde_json::Error> {
    serde_json::to_string(&value.to_node())
}

/// A value as JSON text in lines, without a line break at its end. Numbers that are infinite or NaN become `null`.
///
/// # Errors
/// A path is not UTF-8.
pub fn to_json_lines(value: &dyn ToNode) -> Result<String, serde_json::Error> {
    serde_json::to_string_pretty(&value.to_node())
}

impl Node {
    fn of(content: Content) -> Node {
        Node { span: None, content }
    }

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

    /// The range of bytes of the TOML text that this value was parsed from.
    pub fn span(&self) -> Option<Range<usize>> {
        self.span.clone()
    }

    /// That this value is wrong, at its position.
    pub fn fault(&self, message: impl Into<String>) -> NodeError {
        NodeError::new(message, &self.span)
    }

    /// Removes a key from this table and returns its value. None if the key is missing or this value is not a table.
    pub fn take(&mut self, key: &str) -> Option<Node> {
        let Content::Table(table) = &mut self.content else { return None };
        let at = table.iter().position(|(name, _)| name.is_text(key))?;
        Some(table.remove(at).1)
    }

    /// The value of a key of this table. None if the key is missing or this value is not a table.
    pub fn at(&mut self, key: &str) -> Option<&mut Node> {
        let Content::Table(table) = &mut self.content else { return None };
        table.iter_mut().find(|(name, _)| name.is_text(key)).map(|(_, value)| value)
    }

    /// Adds a key with an integer to this table. Does nothing if the key exists or this value is not a table.
    pub fn add(&mut self, key: &str, value: i64) {
        let is_there = self.at(key).is_some();
        if let (Content::Table(table), false) = (&mut self.content, is_there) {
            table.push((key.to_node(), value.to_node()));
        }
    }

    pub fn as_bool(&self) -> Option<bool> {
        match self.content {
            Content::Boolean(value) => Some(value),
            _ => None,
        }
    }

    /// The value if it is a whole number of the range of u64.
    pub fn as_u64(&self) -> Option<u64> {
        match self.content {
            Content::Integer(value) => value.try_into().ok(),
            _ => None,
        }
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

    fn is_text(&self, wanted: &str) -> bool {
        matches!(&self.content, Content::Text(text) if text == wanted)
    }

    /// The kind of the value, as `toml` names it.
    fn kind(&self) -> &'static str {
        match self.content {
            Content::Null => "null",
            Content::Boolean(_) => "boolean",
            Content::Integer(_) => "integer",
            Content::Float(_) => "float",
            Content::Text(_) => "string",
            Content::Date => "datetime",
            Content::List(_) => "array",
            Content::Table(_) => "table",
            Content::Fault(_) => "number",
        }
    }

    fn unexpected(&self) -> Unexpected<'_> {
        match &self.content {
            Content::Null => Unexpected::Other("null"),
            Content::Boolean(value) => Unexpected::Bool(*value),
            Content::Integer(value) => match i64::try_from(*value) {
                Ok(value) => Unexpected::Signed(value),
                Err(_) => Unexpected::Unsigned(u64::try_from(*value).unwrap_or(u64::MAX)),
            },
            Content::Float(value) => Unexpected::Float(*value),
            Content::Text(text) => Unexpected::Str(text),
            Content::Date => Unexpected::Other("date"),
            Content::List(_) => Unexpected::Seq,
            Content::Table(_) => Unexpected::Map,
            Content::Fault(message) => Unexpected::Other(message),
        }
    }

    /// That this value is of another type than the one that is expected.
    pub fn invalid(&self, expected: &str) -> NodeError {
        match self.content {
            Content::Fault(message) => self.fault(message),
            _ => self.fault(format!("invalid type: {}, expected {expected}", self.unexpected())),
        }
    }

    fn list(self, expected: &str) -> Result<Vec<Node>, NodeError> {
        match self.content {
            Content::List(list) => Ok(list),
            _ => Err(self.invalid(expected)),
        }
    }

    /// The elements of a list of `count`.
    fn array(self, count: usize, expected: &str) -> Result<Vec<Node>, NodeError> {
        let span = self.span.clone();
        let list = self.list(expected)?;
        match list.len() == count {
            true => Ok(list),
            false => Err(NodeError::new(format!("invalid length {}, expected {expected}", list.len()), &span)),
        }
    }

    fn integer(self, low: i128, high: i128) -> Result<i128, NodeError> {
        const EXPECTED: &str = "a whole number";
        match self.content {
            Content::Integer(value) if (low..=high).contains(&value) => Ok(value),
            Content::Integer(_) => {
                Err(self.fault(format!("invalid value: {}, expected {EXPECTED}", self.unexpected())))
            }
            _ => Err(self.invalid(EXPECTED)),
        }
    }

    /// The index of the variant whose name this text is, or whose name is the only key of this table, and what the variant holds. `names`: all
    /// names with the index of their variant.
    ///
    /// # Errors
    /// This value has another form, or names none of the variants.
    pub fn variant(self, names: &[(&str, usize)]) -> Result<(usize, Held), NodeError> {
        let span = self.span.clone();
        let fault = |message: &str| Err(NodeError::new(message, &span));
        let (name, value) = match self.content {
            Content::Text(_) => (self, None),
            Content::Table(table) => {
                let mut entries = table.into_iter();
                match (entries.next(), entries.next()) {
                    (None, _) => return fault("wanted exactly 1 element, found 0 elements"),
                    (Some((name, value)), None) => (name, Some(value)),
                    _ => return fault("wanted exactly 1 element, more than 1 element"),
                }
            }
            _ => return fault("wanted string or table"),
        };
        Ok((name.index_of(names)?, Held { node: value, span: name.span }))
    }

    /// As [`Node::variant`], of a table whose key `tag` names the variant. The rest of the table is what the variant holds.
    ///
    /// # Errors
    /// This value is no table with that key, or names none of the variants.
    pub fn tagged(mut self, tag: &str, names: &[(&str, usize)]) -> Result<(usize, Held), NodeError> {
        if !matches!(self.content, Content::Table(_)) {
            return Err(self.invalid("a table"));
        }
        let name = self.take(tag).ok_or_else(|| NodeError::missing(tag, &self.span))?;
        let index = name.index_of(names).map_err(|e| e.within(tag))?;
        Ok((index, Held { span: self.span.clone(), node: Some(self) }))
    }

    fn index_of(&self, names: &[(&str, usize)]) -> Result<usize, NodeError> {
        let Content::Text(name) = &self.content else { return Err(self.invalid("variant identifier")) };
        let found = names.iter().find(|(known, _)| known == name);
        found.map(|(_, index)| *index).ok_or_else(|| {
            let known = one_of(names.iter().map(|(name, _)| *name));
            self.fault(format!("unknown variant `{name}`, {known}"))
        })
    }
}

/// Which names are expected, in words.
fn one_of<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    match names.as_slice() {
        [] => "there are no fields".into(),
        [one] => format!("expected {one}"),
        [one, other] => format!("expected {one} or {other}"),
        _ => format!("expected one of {}", names.join(", ")),
    }
}

/// What a variant holds; nothing if only its name is given.
pub struct Held {
    node: Option<Node>,
    /// The position of the variant's name.
    span: Option<Range<usize>>,
}

impl Held {
    /// That the variant holds nothing.
    ///
    /// # Errors
    /// It is given something.
    pub fn unit(self) -> Result<(), NodeError> {
        let Some(node) = self.node else { return Ok(()) };
        match &node.content {
            Content::List(list) if list.is_empty() => Ok(()),
            Content::Table(table) if table.is_empty() => Ok(()),
            Content::List(_) => Err(node.fault("expected empty array")),
            Content::Table(_) => Err(node.fault("expected empty table")),
            _ => Err(node.fault(format!("expected table, found {}", node.kind()))),
        }
    }

    /// What a variant of this kind holds.
    ///
    /// # Errors
    /// Only its name is given.
    pub fn needed(self, kind: &str) -> Result<Node, NodeError> {
        let Held { node, span } = self;
        node.ok_or_else(|| NodeError::new(format!("invalid type: unit variant, expected {kind}"), &span))
    }

    /// What the variant holds as a table; an empty one if only its name is given.
    pub fn table(self) -> Node {
        self.node.unwrap_or(Node { span: self.span, content: Content::Table(Vec::new()) })
    }

    /// The `count` elements that the variant holds.
    ///
    /// # Errors
    /// It is given something else.
    pub fn tuple(self, count: usize) -> Result<Elements, NodeError> {
        let node = self.needed("tuple variant")?;
        let span = node.span.clone();
        match node.content {
            Content::List(list) if list.len() == count => Ok(Elements(list.into_iter(), span)),
            Content::List(_) => Err(NodeError::new(format!("expected tuple with length {count}"), &span)),
            _ => Err(node.fault(format!("expected table, found {}", node.kind()))),
        }
    }
}

/// The elements of a tuple.
pub struct Elements(std::vec::IntoIter<Node>, Option<Range<usize>>);

impl Elements {
    /// # Errors
    /// No element is left.
    pub fn next_element(&mut self) -> Result<Node, NodeError> {
        self.0.next().ok_or_else(|| NodeError::new("an element is missing", &self.1))
    }
}

/// A place that a value of a table is read into.
pub trait Slot {
    /// # Errors
    /// The value does not fit the type of the place.
    fn fill(&mut self, node: Node) -> Result<(), NodeError>;
}

impl<T: FromNode> Slot for T {
    fn fill(&mut self, node: Node) -> Result<(), NodeError> {
        *self = T::from_node(node)?;
        Ok(())
    }
}

/// A place without a value before it is read.
pub struct Needed<T>(pub Option<T>);

impl<T: FromNode> Needed<T> {
    /// The value that was read, or that of the type for a missing key. `span`: the position of the table.
    ///
    /// # Errors
    /// The key is missing and the type has no value for that.
    pub fn or_missing(self, key: &str, span: &Option<Range<usize>>) -> Result<T, NodeError> {
        self.0.or_else(T::missing).ok_or_else(|| NodeError::missing(key, span))
    }
}

impl<T: FromNode> Slot for Needed<T> {
    fn fill(&mut self, node: Node) -> Result<(), NodeError> {
        self.0 = Some(T::from_node(node)?);
        Ok(())
    }
}

/// A place whose value a function reads.
pub struct ReadBy<'a, T>(pub &'a mut T, pub fn(Node) -> Result<T, NodeError>);

impl<T> Slot for ReadBy<'_, T> {
    fn fill(&mut self, node: Node) -> Result<(), NodeError> {
        *self.0 = self.1(node)?;
        Ok(())
    }
}

/// Reads the values of a table into the places of their keys. Places of keys that the table lacks stay as they are. `what` names the type.
///
/// # Errors
/// `node` is no table, a value does not fit its place, a key is there twice, or there is an unknown key and `denies_unknown` is true.
pub fn read_table(
    node: Node,
    what: &str,
    denies_unknown: bool,
    slots: &mut [(&str, &mut dyn Slot)],
) -> Result<(), NodeError> {
    let Content::Table(table) = node.content else { return Err(node.invalid(what)) };
    let mut are_filled = vec![false; slots.len()];
    for (name, value) in table {
        let Content::Text(key) = &name.content else { return Err(name.invalid("a key")) };
        let Some(at) = slots.iter().position(|(known, _)| known == key) else {
            if denies_unknown {
                let known = one_of(slots.iter().map(|(name, _)| *name));
                let message = format!("unknown field `{key}`, {known}");
                return Err(NodeError { fault: Fault::UnknownKey, ..name.fault(message) });
            }
            continue;
        };
        if std::mem::replace(&mut are_filled[at], true) {
            return Err(name.fault(format!("duplicate field `{key}`")));
        }
        slots[at].1.fill(value).map_err(|e| e.within(key))?;
    }
    Ok(())
}

/// A table of these entries, without those that have no value.
pub fn write_table(entries: &[(&str, Option<&dyn ToNode>)]) -> Node {
    let written = entries.iter().filter_map(|(key, value)| Some((key.to_node(), (*value)?.to_node())));
    Node::of(Content::Table(written.collect()))
}

/// A list of these values.
pub fn write_list(values: &[&dyn ToNode]) -> Node {
    Node::of(Content::List(values.iter().map(|value| value.to_node()).collect()))
}

macro_rules! integers {
    ($($kind:ty),*) => {$(
        impl FromNode for $kind {
            fn from_node(node: Node) -> Result<$kind, NodeError> {
                node.integer(<$kind>::MIN as i128, <$kind>::MAX as i128).map(|value| value as $kind)
            }
        }

        impl ToNode for $kind {
            fn to_node(&self) -> Node {
                Node::of(Content::Integer(*self as i128))
            }
        }
    )*};
}
integers!(u8, u16, u32, u64, usize, i32, i64);

impl FromNode for f64 {
    fn from_node(node: Node) -> Result<f64, NodeError> {
        match node.content {
            Content::Float(value) => Ok(value),
            Content::Integer(value) => Ok(value as f64),
            _ => Err(node.invalid("a number")),
        }
    }
}

impl ToNode for f64 {
    fn to_node(&self) -> Node {
        Node::of(Content::Float(*self))
    }
}

impl FromNode for bool {
    fn from_node(node: Node) -> Result<bool, NodeError> {
        node.as_bool().ok_or_else(|| node.invalid("true or false"))
    }
}

impl ToNode for bool {
    fn to_node(&self) -> Node {
        Node::of(Content::Boolean(*self))
    }
}

impl FromNode for String {
    fn from_node(node: Node) -> Result<String, NodeError> {
        match node.content {
            Content::Text(text) => Ok(text),
            _ => Err(node.invalid("a text")),
        }
    }
}

impl ToNode for String {
    fn to_node(&self) -> Node {
        self.as_str().to_node()
    }
}

impl ToNode for str {
    fn to_node(&self) -> Node {
        Node::of(Content::Text(self.into()))
    }
}

impl<T: ToNode + ?Sized> ToNode for &T {
    fn to_node(&self) -> Node {
        (**self).to_node()
    }
}

impl FromNode for PathBuf {
    fn from_node(node: Node) -> Result<PathBuf, NodeError> {
        String::from_node(node).map(PathBuf::from)
    }
}

impl ToNode for PathBuf {
    fn to_node(&self) -> Node {
        self.as_path().to_node()
    }
}

impl ToNode for Path {
    fn to_node(&self) -> Node {
        let fault = || Node::of(Content::Fault("path contains invalid UTF-8 characters"));
        self.to_str().map_or_else(fault, |text| text.to_node())
    }
}

impl<T: FromNode> FromNode for Option<T> {
    fn from_node(node: Node) -> Result<Option<T>, NodeError> {
        match node.content {
            Content::Null => Ok(None),
            _ => T::from_node(node).map(Some),
        }
    }

    fn missing() -> Option<Option<T>> {
        Some(None)
    }
}

impl<T: ToNode> ToNode for Option<T> {
    fn to_node(&self) -> Node {
        self.as_ref().map_or(Node::of(Content::Null), ToNode::to_node)
    }
}

impl<T: FromNode> FromNode for Vec<T> {
    fn from_node(node: Node) -> Result<Vec<T>, NodeError> {
        let list = node.list("a sequence")?;
        let mut values = Vec::with_capacity(list.len());
        for (n, value) in list.into_iter().enumerate() {
            values.push(T::from_node(value).map_err(|e| e.within(&format!("[{n}]")))?);
        }
        Ok(values)
    }
}

impl<T: ToNode> ToNode for Vec<T> {
    fn to_node(&self) -> Node {
        Node::of(Content::List(self.iter().map(ToNode::to_node).collect()))
    }
}

impl<T: FromNode, const N: usize> FromNode for [T; N] {
    fn from_node(node: Node) -> Result<[T; N], NodeError> {
        let expected = format!("an array of length {N}");
        let span = node.span.clone();
        let list = Node { span: node.span.clone(), content: Content::List(node.array(N, &expected)?) };
        Vec::from_node(list)?.try_into().map_err(|_| NodeError::new(format!("expected {expected}"), &span))
    }
}

impl<T: ToNode, const N: usize> ToNode for [T; N] {
    fn to_node(&self) -> Node {
        Node::of(Content::List(self.iter().map(ToNode::to_node).collect()))
    }
}

impl<A: FromNode, B: FromNode> FromNode for (A, B) {
    fn from_node(node: Node) -> Result<(A, B), NodeError> {
        let span = node.span.clone();
        let mut both = Elements(node.array(2, "a list of two")?.into_iter(), span);
        Ok((A::from_node(both.next_element()?)?, B::from_node(both.next_element()?)?))
    }
}

impl<A: ToNode, B: ToNode> ToNode for (A, B) {
    fn to_node(&self) -> Node {
        write_list(&[&self.0, &self.1])
    }
}

impl<T: FromNode> FromNode for Box<T> {
    fn from_node(node: Node) -> Result<Box<T>, NodeError> {
        T::from_node(node).map(Box::new)
    }
}

impl<T: ToNode> ToNode for Box<T> {
    fn to_node(&self) -> Node {
        (**self).to_node()
    }
}

impl<T: FromNode> FromNode for BTreeMap<String, T> {
    fn from_node(node: Node) -> Result<BTreeMap<String, T>, NodeError> {
        let Content::Table(table) = node.content else { return Err(node.invalid("a map")) };
        let mut values = BTreeMap::new();
        for (key, value) in table {
            let key = String::from_node(key)?;
            let value = T::from_node(value).map_err(|e| e.within(&key))?;
            values.insert(key, value);
        }
        Ok(values)
    }
}

impl<T: ToNode> ToNode for BTreeMap<String, T> {
    fn to_node(&self) -> Node {
        Node::of(Content::Table(self.iter().map(|(key, value)| (key.to_node(), value.to_node())).collect()))
    }
}

/// A value of TOML or JSON as it is.
impl FromNode for Node {
    fn from_node(node: Node) -> Result<Node, NodeError> {
        Ok(node)
    }
}

impl ToNode for Node {
    fn to_node(&self) -> Node {
        self.clone()
    }
}

impl FromNode for Table {
    fn from_node(node: Node) -> Result<Table, NodeError> {
        let span = node.span.clone();
        match node.into_toml()? {
            Value::Table(table) => Ok(table),
            _ => Err(NodeError::new("expected a map", &span)),
        }
    }
}

impl ToNode for Table {
    fn to_node(&self) -> Node {
        Node::from(Value::Table(self.clone()))
    }
}

/// A table of JSON as `serde_json` has it.
impl FromNode for serde_json::Map<String, serde_json::Value> {
    fn from_node(node: Node) -> Result<serde_json::Map<String, serde_json::Value>, NodeError> {
        match serde_json::to_value(&node) {
            Ok(serde_json::Value::Object(table)) => Ok(table),
            Ok(_) => Err(node.invalid("a map")),
            Err(e) => Err(node.fault(e.to_string())),
        }
    }
}

impl ToNode for serde_json::Map<String, serde_json::Value> {
    fn to_node(&self) -> Node {
        let entry = |(key, value): (&String, &serde_json::Value)| (key.to_node(), value.to_node());
        Node::of(Content::Table(self.iter().map(entry).collect()))
    }
}

impl ToNode for serde_json::Value {
    fn to_node(&self) -> Node {
        // A value of JSON is a tree of the same kinds.
        Node::deserialize(self).unwrap_or(Node::of(Content::Fault("is no value of JSON")))
    }
}

impl FromNode for DVec3 {
    fn from_node(node: Node) -> Result<DVec3, NodeError> {
        <[f64; 3]>::from_node(node).map(DVec3::from_array)
    }
}

impl ToNode for DVec3 {
    fn to_node(&self) -> Node {
        self.to_array().to_node()
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
            Content::List(list) => {
                let mut written = serializer.serialize_seq(Some(list.len()))?;
                list.iter().try_for_each(|value| written.serialize_element(value))?;
                written.end()
            }
            Content::Table(table) => {
                let mut written = serializer.serialize_map(Some(table.len()))?;
                table.iter().try_for_each(|(key, value)| written.serialize_entry(key, value))?;
                written.end()
            }
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
        let mut table = Vec::new();
        while let Some(entry) = access.next_entry()? {
            table.push(entry);
        }
        Ok(Content::Table(table))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::{Deserialize, Serialize};

    #[derive(Debug, Default, PartialEq, Deserialize, Serialize, FromNode, ToNode)]
    #[serde(deny_unknown_fields, default)]
    #[tree(deny_unknown_fields, default)]
    struct All {
        number: f64,
        count: u8,
        word: String,
        is_on: bool,
        maybe: Option<f64>,
        pair: [f64; 2],
        inner: Option<Inner>,
        list: Vec<Inner>,
        named: BTreeMap<String, u32>,
        choice: Choice,
        path: std::path::PathBuf,
    }

    #[derive(Debug, Default, PartialEq, Deserialize, Serialize, FromNode, ToNode)]
    #[serde(deny_unknown_fields)]
    #[tree(deny_unknown_fields)]
    struct Inner {
        at: f64,
        #[serde(default)]
        #[tree(default)]
        of: Choice,
    }

    #[derive(Debug, Default, PartialEq, Deserialize, Serialize, FromNode, ToNode)]
    #[serde(rename_all = "kebab-case", deny_unknown_fields)]
    #[tree(rename_all = "kebab-case", deny_unknown_fields)]
    enum Choice {
        #[default]
        NoneOfAll,
        Of(Box<Inner>),
        Both {
            low: f64,
        },
        Two(f64, f64),
    }

    /// What serde says was expected, in the words of this program.
    fn in_words(message: &str) -> String {
        // Of a variant's keys. `toml` has words of its own for them.
        if let Some(key) = message.strip_prefix("unexpected keys in table: ") {
            return format!("unknown field `{}`", key.replace(", available keys: ", "`, expected `"));
        }
        let Some((before, expected)) = message.rsplit_once("expected ") else { return message.into() };
        let words = match expected {
            "f32" | "f64" => "a number",
            "u8" | "u16" | "u32" | "u64" | "usize" | "i32" | "i64" => "a whole number",
            "a boolean" => "true or false",
            "a string" | "path string" => "a text",
            other => other,
        };
        format!("{before}expected {words}")
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
            let (ours, theirs) = (from_toml::<All>(text), toml::from_str::<All>(text));
            match (ours, theirs) {
                (Ok(ours), Ok(theirs)) => assert_eq!(ours, theirs, "{text}"),
                (Err(ours), Err(theirs)) => {
                    let said = in_words(theirs.message());
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
            let (ours, theirs) = (All::from_node(Node::from(Value::Table(table))), from_toml::<All>(text));
            assert_eq!(ours.as_ref().ok(), theirs.as_ref().ok(), "{text}");
            assert_eq!(ours.err().map(|e| e.message), theirs.err().map(|e| e.message), "{text}");
        }
    }

    #[test]
    fn a_key_that_lacks_and_one_that_is_too_many_are_told_apart() {
        #[derive(Debug, FromNode)]
        #[tree(deny_unknown_fields)]
        struct Two {
            #[tree(rename = "needed")]
            _needed: u32,
        }
        for (text, fault, said) in [
            ("", Fault::MissingKey, "missing field `needed`"),
            ("needed = 1\nother = 2", Fault::UnknownKey, "unknown field `other`, expected `needed`"),
            ("needed = 'x'", Fault::Other, "invalid type: string \"x\", expected a whole number"),
        ] {
            let error = from_toml::<Two>(text).expect_err(text);
            assert_eq!((error.fault(), error.message()), (fault, said));
        }
    }

    #[test]
    fn json_is_read_and_written_as_serde_json_does() {
        for text in TEXTS {
            let Ok(all) = from_toml::<All>(text) else { continue };
            let [ours, theirs] = [to_json(&all), serde_json::to_string(&all)].map(|text| text.expect("is written"));
            assert_eq!(ours, theirs);
            assert_eq!(to_json_lines(&all).ok(), serde_json::to_string_pretty(&all).ok());
            assert_eq!(to_toml(&all).ok(), toml::to_string(&all).ok());
            assert_eq!(all.to_node().into_toml().ok(), Value::try_from(&all).ok());
            // JSON has no infinite numbers.
            if all.number.is_finite() {
                assert_eq!(from_json::<All>(ours.as_bytes()).ok(), Some(all), "{ours}");
            }
        }
    }

    #[test]
    fn a_fault_in_json_is_named_by_its_keys() {
        for (text, said) in [
            (r#"{"list": [{"at": 1}, {"at": "x"}]}"#, r#"list[1].at: invalid type: string "x", expected a number"#),
            (r#"{"number": null}"#, "number: invalid type: null, expected a number"),
            (r#"{"number": 1, "number": 2}"#, "duplicate field `number`"),
            (r#"{"number": "#, "EOF while parsing a value at line 1 column 11"),
        ] {
            assert_eq!(from_json::<All>(text.as_bytes()).expect_err(text).to_string(), said);
        }
    }

    #[test]
    fn what_is_too_large_or_a_date_is_refused_in_words() {
        for (text, said) in [
            ("count = 99999999999999999999", "integer number overflowed"),
            ("number = 1979-05-27", "invalid type: date, expected a number"),
            // The crate `toml` ignores the third number.
            ("pair = [1, 2, 3]", "invalid length 3, expected an array of length 2"),
        ] {
            assert_eq!(from_toml::<All>(text).expect_err("it is refused").message(), said);
        }
    }
}
