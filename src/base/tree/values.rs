//! The types of numbers, texts, lists and tables.

use super::{Content, Elements, FromNode, Node, NodeError, ToNode, write_list};
use glam::DVec3;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

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
        each(node.list("a list")?)
    }
}

fn each<T: FromNode>(list: Vec<Node>) -> Result<Vec<T>, NodeError> {
    let mut values = Vec::with_capacity(list.len());
    for (n, value) in list.into_iter().enumerate() {
        values.push(T::from_node(value).map_err(|e| e.within(&format!("[{n}]")))?);
    }
    Ok(values)
}

impl<T: ToNode> ToNode for Vec<T> {
    fn to_node(&self) -> Node {
        Node::of(Content::List(self.iter().map(ToNode::to_node).collect()))
    }
}

impl<T: FromNode, const N: usize> FromNode for [T; N] {
    fn from_node(node: Node) -> Result<[T; N], NodeError> {
        let expected = format!("a list of {N}");
        let span = node.span.clone();
        each(node.array(N, &expected)?)?.try_into().map_err(|_| NodeError::new(format!("expected {expected}"), &span))
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
        let mut both = Elements(node.array(2, "a list of 2")?.into_iter(), span);
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
        let Content::Table(table) = node.content else { return Err(node.invalid("a table")) };
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
            _ => Err(NodeError::new("expected a table", &span)),
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
            Ok(_) => Err(node.invalid("a table")),
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
