//! Results of earlier runs: JSON files that state their format and its version, and comparisons of two runs.

use crate::files::read_text;
use crate::text::escaped;
use crate::tree::{self, FromNode, Node, NodeError, ToNode};
use std::collections::{HashMap, HashSet};
use std::fmt::Display;
use std::hash::Hash;
use std::path::Path;

/// A result that is stored as a JSON file. The field `format` of the file is the name and the version of the format.
pub trait Stored: ToNode + FromNode {
    /// Content of the field `format` in files that are written: name and version of the format.
    const FORMAT: &'static str;
    /// Contents of the field `format` of earlier versions that can still be read.
    const EARLIER: &'static [&'static str] = &[];
    /// Quotation mark around names of formats in messages.
    const QUOTE: char = '\'';
    /// What such a file is, with its article, for messages: `a profile`.
    const WHAT: &'static str;
    /// Advice at the end of the message about another format: how to make a new file, for example `profile again with it`.
    const AGAIN: &'static str;
    /// Name of this kind of file in the messages of reading it: `profile`.
    const KIND: &'static str;
    /// Longest file that is read, bytes.
    const MAX_BYTES: u64;

    /// Name of the first field whose value contradicts other fields or is impossible, and what is wrong with it. None if the result is
    /// consistent.
    fn fault(&self) -> Option<(String, String)>;

    /// Converts a result that was read in one of the [`Stored::EARLIER`] versions to the current one. Also called for the current version.
    fn renew(&mut self) {}

    /// Checks that no field contradicts another one or is impossible.
    ///
    /// # Errors
    /// One line that names the first faulty field.
    fn check(&self) -> Result<(), String> {
        self.fault().map_or(Ok(()), |(field, fault)| Err(format!("{}: {}", escaped(&field), escaped(&fault))))
    }

    /// The result as JSON text. Reading it gives exactly the same numbers.
    ///
    /// # Errors
    /// One line: [`Stored::check`] refuses the result.
    fn to_json(&self) -> Result<String, String> {
        self.check()?;
        tree::to_json_lines(self).map(|text| text + "\n").map_err(|e| escaped(&e.to_string()))
    }

    /// Reads a result from JSON text and checks it.
    ///
    /// # Errors
    /// One line: the text is of another format, is not JSON of such a result, or [`Stored::check`] refuses it.
    fn from_json(text: &str) -> Result<Self, String> {
        let json = |e: NodeError| format!("not {}: {}", Self::WHAT, escaped(&e.to_string()));
        let mut node = Node::parse_json(text.as_bytes()).map_err(json)?;
        let format = format_of(&mut node).map_err(json)?;
        if format != Self::FORMAT && !Self::EARLIER.contains(&format.as_str()) {
            let (found, reads, quote, again) = (escaped(&format), Self::FORMAT, Self::QUOTE, Self::AGAIN);
            return Err(format!("format is {quote}{found}{quote}, this program reads {quote}{reads}{quote}; {again}"));
        }
        let mut result = Self::from_node(node).map_err(json)?;
        result.renew();
        result.check()?;
        Ok(result)
    }

    /// Reads a result from a file and checks it.
    ///
    /// # Errors
    /// One line that names the file: it cannot be read, or [`Stored::from_json`] refuses it.
    fn load(file: &Path) -> Result<Self, String> {
        let text = read_text(file, Self::MAX_BYTES, Self::KIND);
        text.and_then(|text| Self::from_json(&text)).map_err(|e| format!("{}: {e}", file.display()))
    }
}

fn format_of(node: &mut Node) -> Result<String, NodeError> {
    let format = node.at("format").ok_or_else(|| NodeError::missing("format", &None))?;
    String::from_node(format.clone())
}

/// An entry of the old run and the matching entry of the new run. One of them is None if only the other run has the entry.
pub type Match<'a, T> = (Option<&'a T>, Option<&'a T>);

/// Matches the entries of two runs by a key that is unique in each run. The entries of the new run come first, in their order; those that
/// only the old run has follow.
pub fn matched<'a, T, K: Eq + Hash>(old: &'a [T], new: &'a [T], key: impl Fn(&'a T) -> K) -> Vec<Match<'a, T>> {
    let before: HashMap<K, &T> = old.iter().map(|entry| (key(entry), entry)).collect();
    let now: HashSet<K> = new.iter().map(&key).collect();
    let gone = old.iter().filter(|entry| !now.contains(&key(entry))).map(|entry| (Some(entry), None));
    new.iter().map(|entry| (before.get(&key(entry)).copied(), Some(entry))).chain(gone).collect()
}

/// Lists the conditions (name and value) that differ between two runs, one line each, the old value before the new one. Both runs must list the same
/// names in the same order.
pub fn differing<N: Display>(
    old: impl IntoIterator<Item = (N, String)>,
    new: impl IntoIterator<Item = (N, String)>,
) -> Vec<String> {
    let both = old.into_iter().zip(new).filter(|((_, old), (_, new))| old != new);
    both.map(|((name, old), (_, new))| format!("{name}: {old} -> {new}")).collect()
}

/// Largest accepted ratio of the new time to the old one. A larger ratio is a failure of the comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold(f64);

impl Default for Threshold {
    fn default() -> Threshold {
        Threshold(1.05)
    }
}

impl Threshold {
    /// Accepts new times of up to `ratio` times the old ones: 1.05 is five percent slower.
    ///
    /// # Errors
    /// One line: the ratio is not finite or is below 1.
    pub fn new(ratio: f64) -> Result<Threshold, String> {
        match ratio.is_finite() && ratio >= 1.0 {
            true => Ok(Threshold(ratio)),
            false => Err(format!("threshold: {ratio} is not a ratio of at least 1 (1.05 is five percent slower)")),
        }
    }

    pub fn ratio(self) -> f64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_both_runs_are_matched_in_the_order_of_the_new_one() {
        let (old, new) = ([("a", 1), ("b", 2), ("c", 3)], [("d", 4), ("c", 5), ("a", 6)]);
        let found = matched(&old, &new, |entry| entry.0);
        let values: Vec<_> = found.iter().map(|(old, new)| [old, new].map(|entry| entry.map_or(0, |e| e.1))).collect();
        assert_eq!(values, [[0, 4], [3, 5], [1, 6], [2, 0]]);
    }

    #[test]
    fn a_threshold_below_one_is_refused() {
        for ratio in [0.99, f64::NAN, f64::INFINITY, -1.0] {
            let error = Threshold::new(ratio).expect_err("refused");
            assert!(error.ends_with("is not a ratio of at least 1 (1.05 is five percent slower)"), "{error}");
        }
        assert_eq!(Threshold::new(1.05), Ok(Threshold::default()));
    }
}
