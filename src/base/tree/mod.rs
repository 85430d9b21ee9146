//! Values of TOML and JSON as a tree, and the types that are read from it and written as it. Each value of a TOML text keeps its position.
//!
//! [`FromNode`] and [`ToNode`] are what serde's traits are elsewhere. Serde's derives generate a visitor, a key type and loops for each type, and the compiler
//! makes them once for each kind of input. The derives of these traits generate a table of keys and places, over which the functions here loop.
//! docs/experiments/compiling.md states the savings.

mod formats;
#[cfg(test)]
mod tests;
mod values;

use serde::de::Unexpected;
use std::fmt::{self, Display};
use std::ops::Range;

pub use echolume_derive::{All, Defaults, FromNode, Name, ToNode};

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
            Content::List(_) => Unexpected::Other("list"),
            Content::Table(_) => Unexpected::Other("table"),
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

/// A part of a type whose keys stand in the table of the whole, by `#[tree(flatten)]`.
pub trait Part {
    /// Each key with its place.
    fn slots(&mut self) -> Vec<(&'static str, &mut dyn Slot)>;

    /// Each key with its value.
    fn entries(&self) -> Vec<(&'static str, Option<&dyn ToNode>)>;
}

/// Reads the values of a table into the places of their keys. Places of keys that the table lacks stay as they are.
///
/// # Errors
/// `node` is no table, a value does not fit its place, or there is an unknown key and `denies_unknown` is true.
pub fn read_table<'a>(
    node: Node,
    denies_unknown: bool,
    slots: &mut [(&'a str, &'a mut dyn Slot)],
) -> Result<(), NodeError> {
    read_table_and(node, denies_unknown, slots, &mut [])
}

/// The same for a table that has the keys of a [`Part`], too.
///
/// # Errors
/// As above.
pub fn read_table_and<'a>(
    node: Node,
    denies_unknown: bool,
    slots: &mut [(&'a str, &'a mut dyn Slot)],
    part: &mut [(&'a str, &'a mut dyn Slot)],
) -> Result<(), NodeError> {
    let Content::Table(table) = node.content else { return Err(node.invalid("a table")) };
    for (name, value) in table {
        let Content::Text(key) = &name.content else { return Err(name.invalid("a key")) };
        if let Some((_, slot)) = slots.iter_mut().chain(part.iter_mut()).find(|(known, _)| known == key) {
            slot.fill(value).map_err(|e| e.within(key))?;
        } else if denies_unknown {
            let known = one_of(slots.iter().chain(&*part).map(|(name, _)| *name));
            let message = format!("unknown field `{key}`, {known}");
            return Err(NodeError { fault: Fault::UnknownKey, ..name.fault(message) });
        }
    }
    Ok(())
}

/// A table of these entries, without those that have no value.
pub fn write_table(entries: &[(&str, Option<&dyn ToNode>)]) -> Node {
    write_table_and(entries, &[])
}

/// The same of a type with a [`Part`], whose entries follow.
pub fn write_table_and(entries: &[(&str, Option<&dyn ToNode>)], part: &[(&str, Option<&dyn ToNode>)]) -> Node {
    let written = entries.iter().chain(part).filter_map(|(key, value)| Some((key.to_node(), (*value)?.to_node())));
    Node::of(Content::Table(written.collect()))
}

/// A list of these values.
pub fn write_list(values: &[&dyn ToNode]) -> Node {
    Node::of(Content::List(values.iter().map(|value| value.to_node()).collect()))
}
