//! The header of a NRRD: its fields, the keys that programs add, and the names of its data files.

use super::super::keys::{Aspect, Keys, Stated, Unused, Use, keys};
use super::super::layout::Remarks;
use super::super::packed::InputFile;
use super::super::plus::PlusFrames;
use crate::files::{InputError, quoted};
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longest header, bytes and lines: those of tracked sequences have some ten lines for every frame.
const MAX_HEADER_BYTES: u64 = 32 << 20;
const MAX_HEADER_LINES: usize = 500_000;
/// Most vectors of a field.
const MAX_VECTORS: usize = 8;

/// The fields of NRRD, and the keys of other programs that are read, with how they are treated.
pub(in super::super) static KEYS: Keys = Keys::new(|| {
    keys(&[
        ("type", Aspect::Storage, Use::Used),
        ("dimension", Aspect::Geometry, Use::Used),
        ("space", Aspect::Orientation, Use::Used),
        ("space dimension", Aspect::Geometry, Use::Optional),
        ("sizes", Aspect::Geometry, Use::Used),
        ("space directions", Aspect::Orientation, Use::Used),
        ("spacings", Aspect::Geometry, Use::Used),
        ("kinds|labels", Aspect::Time, Use::Used),
        ("space units|units|space origin", Aspect::Geometry, Use::Used),
        ("encoding", Aspect::Storage, Use::Used),
        ("endian", Aspect::Storage, Use::Optional),
        ("line skip|byte skip|data file", Aspect::Storage, Use::Used),
        ("axis mins|axis maxs", Aspect::Geometry, Use::Used),
        ("centerings", Aspect::Geometry, Use::Optional),
        (ORIENTATION, Aspect::Orientation, Use::Used),
        (IMAGE_TYPE, Aspect::Value, Use::Used),
        ("axis N index values|axis N index type", Aspect::Time, Use::Used),
        ("old min|old max", Aspect::Value, Use::Warned(&[])),
        ("block size", Aspect::Storage, Use::Listed),
        ("content|number|min|max|sample units|thicknesses", Aspect::About, Use::Listed),
        // Of vectors and tensors, and of the segments of a segmentation.
        ("measurement frame|SegmentN_*|Segmentation_*", Aspect::About, Use::Listed),
    ])
});
/// Other spellings of fields.
const SPELLINGS: [(&str, &str); 10] = [
    ("datafile", "data file"),
    ("lineskip", "line skip"),
    ("byteskip", "byte skip"),
    ("axismins", "axis mins"),
    ("axismaxs", "axis maxs"),
    ("centers", "centerings"),
    ("oldmin", "old min"),
    ("oldmax", "old max"),
    ("blocksize", "block size"),
    ("sampleunits", "sample units"),
];

/// Key in which PLUS states the orientation of the pictures of a whole sequence. [`IMAGE_TYPE`] is the one in which it states their type.
pub(super) const ORIENTATION: &str = "ultrasound image orientation";
pub(super) const IMAGE_TYPE: &str = "ultrasound image type";

/// The start of the keys of a segment, before its number.
const SEGMENT: &str = "segment";

/// The numbers of a vector that a header writes in brackets.
pub(super) type Vector = Vec<f64>;

pub(super) struct Header<'a> {
    pub path: &'a Path,
    stated: Stated,
    /// Keys with values that are read: those of PLUS for a whole sequence, and `axis N index ...`.
    values: HashMap<String, String>,
    /// Keys of segments, in lower case, with their values.
    segments: HashMap<String, String>,
    /// What the keys `Seq_Frame...` of PLUS state, each of one frame.
    pub frames: PlusFrames,
    /// The lines after `data file: LIST`, each the name of a data file.
    pub list: Vec<String>,
    /// Length of the header up to and including its empty line, bytes.
    pub length: u64,
}

impl<'a> Header<'a> {
    pub(super) fn read(file: &InputFile<'a>) -> Result<Header<'a>, InputError> {
        let path = file.path;
        let unreadable = |e| InputError::unreadable(path, &e);
        let mut input = BufReader::new(file.open().map_err(unreadable)?.take(MAX_HEADER_BYTES));
        let mut header = Header {
            path,
            stated: Stated::new(&KEYS),
            values: HashMap::new(),
            segments: HashMap::new(),
            frames: PlusFrames::default(),
            list: Vec::new(),
            length: 0,
        };
        let mut line = Vec::new();
        for number in 1..=MAX_HEADER_LINES {
            line.clear();
            header.length += input.read_until(b'\n', &mut line).map_err(unreadable)? as u64;
            if header.length >= MAX_HEADER_BYTES {
                break;
            }
            let text = text_of(&line);
            let text = text.trim();
            // A detached header may end with the file.
            if text.is_empty() {
                let is_detached = header.stated.has("data file");
                return match line.is_empty() && !is_detached {
                    true => header.fault("header", "is cut short: there is no empty line before the samples"),
                    false => Ok(header),
                };
            }
            if header.is_list() {
                header.list.push(text.to_string());
            } else if number > 1 && !text.starts_with('#') {
                header.line(number, text)?;
            }
        }
        header.fault("header", "is longer than 32 MiB or 500000 lines")
    }

    fn line(&mut self, number: usize, text: &str) -> Result<(), InputError> {
        if let Some((key, value)) = text.split_once(":=") {
            return self.value_line(key.trim(), value.trim());
        }
        // The text itself is not quoted: it may contain anything.
        let Some((key, value)) = text.split_once(':') else {
            return Err(InputError::new(self.path, format!("line {number}"), "is not 'field: value'"));
        };
        let key = key.trim().to_ascii_lowercase();
        let key = SPELLINGS.iter().find(|(other, _)| *other == key).map_or(&*key, |(_, name)| name);
        match self.stated.put(key, value.trim()) {
            Err(twice) => self.fault(twice, "is given twice"),
            Ok(()) => Ok(()),
        }
    }

    /// A key with a value, which programs add. Others than those of PLUS and of axes are skipped, so that no patient's name gets into a
    /// message.
    fn value_line(&mut self, key: &str, value: &str) -> Result<(), InputError> {
        if let Some(of_frame) = key.strip_prefix("Seq_Frame") {
            if !self.frames.field(self.path, of_frame, value)? {
                self.stated.note(key);
            }
            return Ok(());
        }
        let lower = key.to_ascii_lowercase();
        let is_of_axis =
            lower.starts_with("axis ") && (lower.ends_with(" index values") || lower.ends_with(" index type"));
        if lower == ORIENTATION || lower == IMAGE_TYPE || is_of_axis {
            self.values.insert(lower, value.to_string());
        } else {
            self.stated.note(key);
            if lower.starts_with(SEGMENT) {
                self.segments.insert(lower, value.to_string());
            }
        }
        Ok(())
    }

    /// True once `data file: LIST` was read, which is the last field.
    fn is_list(&self) -> bool {
        self.get("data file").is_some_and(|name| name.split_whitespace().next() == Some("LIST"))
    }

    pub(super) fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.path, field, fault))
    }

    pub(super) fn get(&self, field: &str) -> Option<&str> {
        self.stated.get(field)
    }

    pub(super) fn need(&self, field: &str) -> Result<&str, InputError> {
        self.get(field).map_or_else(|| self.fault(field, "is missing"), Ok)
    }

    /// True if the header has this field.
    pub(super) fn has(&self, field: &str) -> bool {
        self.stated.has(field)
    }

    /// The fields that were not used; call it when everything was read. What a user must know of them is added to `remarks`.
    ///
    /// # Errors
    /// A field for which the file has to be refused.
    pub(super) fn unused(self, remarks: &mut Remarks) -> Result<Unused, InputError> {
        self.stated.finish(self.path, remarks)
    }

    /// The value of a key that is not of NRRD itself but of a program; None if it is absent.
    pub(super) fn value(&self, key: &str) -> Option<&str> {
        self.values.get(key).map(String::as_str)
    }

    /// True if the file is a segmentation of 3D Slicer.
    pub(super) fn has_segments(&self) -> bool {
        self.segments.keys().any(|key| key.starts_with("segment0_"))
    }

    /// The value of a field, in lower case, of the segment with this number in a segmentation; None if it is absent.
    pub(super) fn of_segment(&self, segment: usize, field: &str) -> Option<&str> {
        self.segments.get(&format!("{SEGMENT}{segment}_{field}")).map(String::as_str)
    }

    /// The words of a field, which must be `count`. A word in quotes may be empty. None if the field is absent.
    ///
    /// # Errors
    /// The field has another number of words.
    pub(super) fn words(&self, field: &str, count: usize) -> Result<Option<Vec<String>>, InputError> {
        let Some(text) = self.get(field) else { return Ok(None) };
        let words = words(text);
        if words.len() != count {
            return self.fault(field, format!("has {} entries, must have {count}", words.len()));
        }
        Ok(Some(words))
    }

    /// The numbers of a field, one for each of `count` axes. None for an axis whose number is NaN (not known), and for all if the field is
    /// absent.
    ///
    /// # Errors
    /// The field has another number of entries, or one is not a finite number.
    pub(super) fn numbers(&self, field: &str, count: usize) -> Result<Vec<Option<f64>>, InputError> {
        let Some(words) = self.words(field, count)? else { return Ok(vec![None; count]) };
        let number = |word: &String| match word.parse::<f64>() {
            Ok(number) if number.is_nan() => Ok(None),
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => self.fault(field, format!("{} is not a finite number", quoted(word))),
        };
        words.iter().map(number).collect()
    }

    /// The vectors of a field. An inner None stands for the word `none` or a vector of NaN; the result is None if the field is absent.
    ///
    /// # Errors
    /// The field is not a list of vectors of 2 to 4 finite numbers in brackets.
    pub(super) fn vectors(&self, field: &str) -> Result<Option<Vec<Option<Vector>>>, InputError> {
        let Some(mut rest) = self.get(field) else { return Ok(None) };
        let mut vectors = Vec::new();
        while !rest.trim_start().is_empty() && vectors.len() < MAX_VECTORS {
            rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix("none") {
                vectors.push(None);
                rest = after;
                continue;
            }
            let Some((inside, after)) = rest.strip_prefix('(').and_then(|text| text.split_once(')')) else {
                return self.fault(field, "is not a list of vectors in brackets");
            };
            vectors.push(self.vector(field, inside)?);
            rest = after;
        }
        Ok(Some(vectors))
    }

    /// The numbers of a vector; None if all are NaN, which is how some programs write none.
    fn vector(&self, field: &str, inside: &str) -> Result<Option<Vector>, InputError> {
        let numbers: Option<Vector> = inside.split(',').map(|word| word.trim().parse().ok()).collect();
        match numbers {
            Some(numbers) if !(2..=4).contains(&numbers.len()) => {
                self.fault(field, format!("{} is not a vector of 2 to 4 numbers", quoted(inside)))
            }
            Some(numbers) if numbers.iter().all(|number| number.is_nan()) => Ok(None),
            Some(numbers) if numbers.iter().all(|number| number.is_finite()) => Ok(Some(numbers)),
            _ => self.fault(field, format!("{} is not a vector of finite numbers", quoted(inside))),
        }
    }
}

/// The text of a line. One that is no UTF-8 is Latin-1, where the sign for micro is a byte.
fn text_of(line: &[u8]) -> Cow<'_, str> {
    std::str::from_utf8(line).map_or_else(|_| line.iter().map(|byte| char::from(*byte)).collect(), Cow::Borrowed)
}

/// Words between spaces, or in quotes.
fn words(mut text: &str) -> Vec<String> {
    let mut words = Vec::new();
    loop {
        text = text.trim_start();
        let (word, rest) = match text.strip_prefix('"') {
            Some(inside) => inside.split_once('"').unwrap_or((inside, "")),
            None => text.split_once(char::is_whitespace).unwrap_or((text, "")),
        };
        if text.is_empty() {
            return words;
        }
        words.push(word.trim().to_string());
        text = rest;
    }
}

#[cfg(test)]
mod tests {
    use super::{text_of, words};

    #[test]
    fn a_line_is_utf_8_or_latin_1() {
        assert_eq!(text_of("\u{3bc}m".as_bytes()), "\u{3bc}m");
        assert_eq!(text_of(b"\xb5m"), "\u{b5}m");
    }

    #[test]
    fn words_may_be_in_quotes_and_empty() {
        assert_eq!(words(r#""mm" "" "micro meter"  s"#), ["mm", "", "micro meter", "s"]);
        assert_eq!(words("\"mm\"\"mm\" \"open"), ["mm", "mm", "open"]);
        assert!(words("  ").is_empty());
    }
}
