//! The keys of each format: how its reader treats them, and which keys of a file it did not use. A part of docs/formats.md is generated
//! from the tables.

use super::describe::{Remarks, warned};
use crate::files::{InputError, escaped};
use crate::tree::Name;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::LazyLock;

/// Longest name that is shown, characters, and most different ones that are kept.
const MAX_NAME: usize = 64;
const MAX_NAMES: usize = 256;

/// What a key of a file's header describes: a property of the samples, or anything else. The names are those of docs/formats.md.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Name)]
#[tree(rename_all = "lowercase")]
pub enum Aspect {
    /// Sizes, spacings and positions.
    Geometry,
    /// The meaning of the sample values.
    #[tree(rename = "values")]
    Value,
    #[tree(rename = "times")]
    Time,
    /// The directions of the axes.
    Orientation,
    /// The location and the encoding of the samples.
    Storage,
    /// Anything else.
    About,
}

impl Aspect {
    /// True if whoever looks at a picture must know that such a key was not used.
    fn matters(self) -> bool {
        matches!(self, Aspect::Geometry | Aspect::Value | Aspect::Time | Aspect::Orientation)
    }
}

/// How a reader treats a key of a file. A neutral value is one that has no effect. Values that are numbers are compared as numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// The key is read. There is a warning if another key takes precedence and the key describes geometry, values, times or orientation.
    Used,
    /// The key is read, unless another key of the same meaning takes precedence, which needs no warning.
    Optional,
    /// The key is not read. A value other than these neutral ones gives a warning.
    Warned(&'static [&'static str]),
    /// The key is not read. A file with a value other than these neutral ones is refused.
    Refused(&'static [&'static str]),
    /// The key is not read and has no effect on pictures.
    Listed,
}

/// A key of a file format and how its reader treats it.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Name of the key in the format. `N` stands for any number, `*` for any text.
    pub name: &'static str,
    pub aspect: Aspect,
    pub done: Use,
}

impl Key {
    pub(super) const fn new(name: &'static str, aspect: Aspect, done: Use) -> Key {
        Key { name, aspect, done }
    }
}

/// The keys of a format with many of them.
pub(super) type Keys = LazyLock<Vec<Key>>;

/// The keys of groups, in order. A group: names, divided by `|`, since some hold spaces, and what is common to them.
pub(super) fn keys(groups: &[(&'static str, Aspect, Use)]) -> Vec<Key> {
    let each = |&(names, aspect, done): &(&'static str, _, _)| names.split('|').map(move |n| Key::new(n, aspect, done));
    groups.iter().flat_map(each).collect()
}

/// A row of a table of keys in docs/formats.md.
pub struct Row {
    pub name: String,
    pub aspect: Aspect,
    pub done: Use,
}

/// One row for each key of the tables.
pub(super) fn rows(tables: &[&[Key]]) -> Vec<Row> {
    let row = |key: &Key| Row { name: key.name.into(), aspect: key.aspect, done: key.done };
    tables.iter().flat_map(|table| table.iter().map(row)).collect()
}

/// Whether a value is one that changes nothing.
fn is_neutral(value: &str, neutral: &[&str]) -> bool {
    let same = |word: &str, other: &str| match (word.parse::<f64>(), other.parse::<f64>()) {
        (Ok(a), Ok(b)) => a == b,
        _ => word.eq_ignore_ascii_case(other),
    };
    let mut words = value.split([' ', '\t', '\\', ',', '(', ')']).filter(|word| !word.is_empty());
    words.all(|word| neutral.iter().any(|other| same(word, other)))
}

/// Names of the keys that a file states and its reader did not use. Names in text headers that differ only in numbers are counted as one, such as
/// `Seq_FrameN_FrameNumber`.
#[derive(Clone, Debug, Default)]
pub struct Unused {
    /// By the name without numbers: a name, and how often there is such a one.
    names: BTreeMap<String, (String, usize)>,
    /// How many more there are than are kept.
    more: usize,
}

impl Unused {
    /// Adds the name of a key, with `N` for its numbers. Never pass a value, which may be a patient's.
    pub(super) fn note(&mut self, name: &str) {
        self.noted(without_numbers(&escaped(name, MAX_NAME)), name);
    }

    /// Adds the name of a key with its numbers, where they distinguish keys.
    pub(super) fn note_as_it_is(&mut self, name: &str) {
        self.noted(escaped(name, MAX_NAME), name);
    }

    fn noted(&mut self, pattern: String, name: &str) {
        let has_room = self.names.len() < MAX_NAMES;
        match self.names.get_mut(&pattern) {
            Some((_, count)) => *count += 1,
            None if has_room => drop(self.names.insert(pattern, (escaped(name, MAX_NAME), 1))),
            None => self.more += 1,
        }
    }

    /// The names, one line each, with the number of keys that a name stands for if it is above 1. If there were too many names, the last line says
    /// how many more keys there are.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let line = |(pattern, (name, count)): (&String, &(String, usize))| match count {
            1 => name.clone(),
            _ => format!("{pattern} ({count} times)"),
        };
        let more = (self.more > 0).then(|| format!("{} more", self.more));
        self.names.iter().map(line).chain(more).collect()
    }
}

/// A name with `N` in the place of every number.
fn without_numbers(name: &str) -> String {
    let mut pattern = String::new();
    for c in name.chars() {
        match c.is_ascii_digit() {
            true if pattern.ends_with('N') => {}
            true => pattern.push('N'),
            false => pattern.push(c),
        }
    }
    pattern
}

/// The keys of a text header with their values, and which of them a reader has queried.
pub(super) struct Stated {
    keys: &'static [Key],
    values: HashMap<&'static str, String>,
    asked: RefCell<BTreeSet<&'static str>>,
    unused: Unused,
}

impl Stated {
    /// Starts without values. `keys`: those that the format has.
    pub(super) fn new(keys: &'static [Key]) -> Stated {
        Stated { keys, values: HashMap::new(), asked: RefCell::default(), unused: Unused::default() }
    }

    /// Stores the value of a key that the format has; of other keys only the name is noted.
    ///
    /// # Errors
    /// The name of a key that is given twice.
    pub(super) fn put(&mut self, name: &str, value: &str) -> Result<(), &'static str> {
        let Some(key) = self.keys.iter().find(|key| key.name == name) else {
            self.note(name);
            return Ok(());
        };
        match self.values.insert(key.name, value.to_string()) {
            Some(_) => Err(key.name),
            None => Ok(()),
        }
    }

    /// Adds the name of a key to the unused ones.
    pub(super) fn note(&mut self, name: &str) {
        self.unused.note(name);
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.values.contains_key(name)
    }

    /// True if the header has this key with exactly this value.
    pub(super) fn is(&self, name: &str, value: &str) -> bool {
        self.values.get(name).is_some_and(|other| other == value)
    }

    /// The value of a key, which from then on counts as used; None if the header does not have it.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        let (key, value) = self.values.get_key_value(name)?;
        self.asked.borrow_mut().insert(key);
        Some(value)
    }

    /// The keys that were not used; call it when everything was read. What a user must know of them is added to `remarks` as warnings.
    ///
    /// # Errors
    /// A key for which the file has to be refused.
    pub(super) fn finish(mut self, path: &Path, remarks: &mut Remarks) -> Result<Unused, InputError> {
        let asked = self.asked.take();
        for key in self.keys.iter().filter(|key| !asked.contains(key.name)) {
            let Some(value) = self.values.get(key.name) else { continue };
            self.unused.note(key.name);
            not_used(path, key, value, remarks)?;
        }
        Ok(self.unused)
    }
}

/// Treats a key that the file states and no reader used as [`Key::done`] says: adds a warning to `remarks`, refuses the file, or does nothing.
///
/// # Errors
/// The file has to be refused because of this key.
pub(super) fn not_used(path: &Path, key: &Key, value: &str, remarks: &mut Remarks) -> Result<(), InputError> {
    let why = match key.done {
        Use::Refused(neutral) if !is_neutral(value, neutral) => {
            let fault = "is stated and is not read: without it the samples would be read wrong";
            return Err(InputError::new(path, key.name, fault));
        }
        Use::Used if key.aspect.matters() => "is stated, but another key comes before it",
        Use::Warned(neutral) if !is_neutral(value, neutral) => "is stated and is not read",
        _ => return Ok(()),
    };
    let text = format!("{} {why}; it concerns {}", key.name, key.aspect.name());
    remarks.push(warned(path, "not used", text));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Aspect, Key, Stated, Unused, Use, is_neutral};
    use std::path::Path;

    static KEYS: [Key; 4] = [
        Key::new("Spacing", Aspect::Geometry, Use::Used),
        Key::new("Slope", Aspect::Value, Use::Warned(&["1"])),
        Key::new("SliceHeader", Aspect::Storage, Use::Refused(&["0"])),
        Key::new("Name", Aspect::About, Use::Listed),
    ];

    fn finished(fields: &[(&str, &str)], asked: &[&str]) -> (Result<Vec<String>, String>, usize) {
        let mut stated = Stated::new(&KEYS);
        for (name, value) in fields {
            stated.put(name, value).expect("once");
        }
        for name in asked {
            stated.get(name);
        }
        let mut remarks = Vec::new();
        let unused = stated.finish(Path::new("a"), &mut remarks);
        (unused.map(|unused| unused.lines()).map_err(|fault| fault.field().into()), remarks.len())
    }

    #[test]
    fn what_is_stated_and_not_used_is_listed_warned_about_or_refused() {
        let lines = |lines: &[&str]| Ok(lines.iter().map(ToString::to_string).collect());
        assert_eq!(finished(&[("Spacing", "1")], &["Spacing"]), (lines(&[]), 0));
        assert_eq!(finished(&[("Spacing", "1")], &[]), (lines(&["Spacing"]), 1));
        assert_eq!(finished(&[("Slope", "1.0"), ("Name", "x")], &[]), (lines(&["Name", "Slope"]), 0));
        assert_eq!(finished(&[("Slope", "2")], &[]), (lines(&["Slope"]), 1));
        assert_eq!(finished(&[("SliceHeader", "0")], &[]), (lines(&["SliceHeader"]), 0));
        assert_eq!(finished(&[("SliceHeader", "8")], &[]), (Err("SliceHeader".into()), 0));
        assert_eq!(finished(&[("Other", "8")], &[]), (lines(&["Other"]), 0));
    }

    #[test]
    fn every_word_of_a_neutral_value_is_neutral() {
        assert!(is_neutral("0 0.0 -0", &["0"]) && is_neutral("(0,0)", &["0"]) && is_neutral("", &["0"]));
        assert!(is_neutral("identity", &["IDENTITY"]) && is_neutral("1\\1", &["1"]));
        assert!(!is_neutral("0 1", &["0"]) && !is_neutral("INVERSE", &["IDENTITY"]));
    }

    #[test]
    fn names_that_differ_in_numbers_are_one_and_their_number_is_bounded() {
        let mut unused = Unused::default();
        (0..300).for_each(|n| unused.note(&format!("Seq_Frame{n:04}_Angle")));
        unused.note("axis 3 name");
        assert_eq!(unused.lines(), ["Seq_FrameN_Angle (300 times)", "axis 3 name"]);
        let letters = |n: usize| char::from_u32(0x4e00 + n as u32).unwrap_or('a').to_string();
        (0..300).for_each(|n| unused.note(&letters(n)));
        let lines = unused.lines();
        assert!(lines.len() == 257 && lines.last().is_some_and(|line| line == "46 more"), "{lines:?}");
        unused.note(&"a".repeat(100_000));
    }
}
