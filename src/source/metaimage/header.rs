//! The text header of a MetaImage: `Key = Value` lines up to `ElementDataFile`, read into the few fields that are known.

use crate::source::InputError;
use crate::source::error::quoted;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longest header, in bytes and in lines.
const LONGEST: u64 = 1 << 20;
const MOST_LINES: usize = 100_000;

/// The fields that are read. All others are passed over unseen, so that none can carry a patient's name into a message.
const KEYS: &[&str] = &[
    "ObjectType",
    "NDims",
    "DimSize",
    "ElementType",
    "ElementSpacing",
    "ElementSize",
    "Offset",
    "Position",
    "Origin",
    "TransformMatrix",
    "Rotation",
    "Orientation",
    "BinaryData",
    "BinaryDataByteOrderMSB",
    "ElementByteOrderMSB",
    "CompressedData",
    "CompressedDataSize",
    "ElementNumberOfChannels",
    "HeaderSize",
    "ElementDataFile",
    "Kinds",
    "UltrasoundImageOrientation",
    "UltrasoundImageType",
    "IsTransducerConvex",
    "TransducerRadius",
    "ScanLinePitch",
    "MotorType",
    "MotorRadius",
    "FramePitch",
    "AxialResolution",
];

pub(super) struct Header<'a> {
    path: &'a Path,
    fields: HashMap<&'static str, String>,
    /// Time stamps by frame, s: `Seq_FrameNNNN_Timestamp`.
    pub times: BTreeMap<usize, f64>,
    /// Frames whose `Seq_FrameNNNN_ImageStatus` is not OK.
    pub not_ok: usize,
    /// There are `Seq_` fields: frames in time.
    pub sequence: bool,
    /// Bytes up to and with the line of `ElementDataFile`.
    pub length: u64,
}

impl<'a> Header<'a> {
    pub fn read(path: &'a Path) -> Result<Header<'a>, InputError> {
        let file = File::open(path).map_err(|e| InputError::unreadable(path, &e))?;
        let mut input = BufReader::new(file.take(LONGEST));
        let mut header =
            Header { path, fields: HashMap::new(), times: BTreeMap::new(), not_ok: 0, sequence: false, length: 0 };
        let mut line = Vec::new();
        for number in 1..=MOST_LINES {
            line.clear();
            header.length += input.read_until(b'\n', &mut line).map_err(|e| InputError::unreadable(path, &e))? as u64;
            if line.is_empty() || header.length >= LONGEST {
                break;
            }
            let text = String::from_utf8_lossy(&line);
            let text = text.trim();
            if text.is_empty() {
                continue;
            }
            // The text itself is not shown: it may be anything.
            let Some((key, value)) = text.split_once('=') else {
                return Err(InputError::new(path, format!("line {number}"), "is not 'Key = Value'"));
            };
            let (key, value) = (key.trim(), value.trim());
            if let Some(known) = KEYS.iter().find(|k| **k == key) {
                if header.fields.insert(known, value.to_string()).is_some() {
                    return header.fault(known, "is given twice");
                }
            } else if let Some(of_frame) = key.strip_prefix("Seq_Frame") {
                header.sequence = true;
                header.frame_field(of_frame, value)?;
            }
            // Data begin behind this line, whatever they look like.
            if key == "ElementDataFile" {
                return Ok(header);
            }
        }
        header.fault("ElementDataFile", "is missing, or not within the first 1 MiB and 100000 lines")
    }

    /// `0012_Timestamp` and `0012_ImageStatus`; other fields of frames are passed over.
    fn frame_field(&mut self, key: &str, value: &str) -> Result<(), InputError> {
        let Some((number, field)) = key.split_once('_') else { return Ok(()) };
        let Ok(number) = number.parse::<usize>() else { return Ok(()) };
        match field {
            "Timestamp" => match value.parse::<f64>() {
                Ok(time) if time.is_finite() => drop(self.times.insert(number, time)),
                _ => {
                    let field = format!("Seq_Frame{number:04}_Timestamp");
                    return self.fault(&field, format!("{} is not a finite number", quoted(value)));
                }
            },
            "ImageStatus" if value != "OK" => self.not_ok += 1,
            _ => {}
        }
        Ok(())
    }

    pub fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.path, field, fault))
    }

    pub fn get(&self, field: &str) -> Option<&str> {
        self.fields.get(field).map(String::as_str)
    }

    /// The first of several spellings that is there, with its value.
    pub fn first_of<'n>(&self, names: &[&'n str]) -> Option<(&'n str, &str)> {
        names.iter().find_map(|name| self.get(name).map(|value| (*name, value)))
    }

    pub fn need(&self, field: &str) -> Result<&str, InputError> {
        self.get(field).map_or_else(|| self.fault(field, "is missing"), Ok)
    }

    /// True, False, 1 or 0, as MetaIO writes and reads them; `None` if absent.
    pub fn flag(&self, field: &str) -> Result<Option<bool>, InputError> {
        match self.get(field) {
            None => Ok(None),
            Some("True" | "true" | "TRUE" | "T" | "1") => Ok(Some(true)),
            Some("False" | "false" | "FALSE" | "F" | "0") => Ok(Some(false)),
            Some(other) => self.fault(field, format!("{} is neither True nor False", quoted(other))),
        }
    }

    pub fn integer(&self, field: &str) -> Result<Option<i64>, InputError> {
        let Some(value) = self.get(field) else { return Ok(None) };
        match value.parse() {
            Ok(value) => Ok(Some(value)),
            Err(_) => self.fault(field, format!("{} is not a whole number", quoted(value))),
        }
    }

    /// Exactly `count` finite numbers.
    pub fn numbers(&self, field: &str, count: usize) -> Result<Vec<f64>, InputError> {
        let words: Vec<&str> = self.need(field)?.split_whitespace().collect();
        if words.len() != count {
            return self.fault(field, format!("has {} entries, must have {count}", words.len()));
        }
        let mut numbers = Vec::new();
        for (i, word) in words.iter().enumerate() {
            match word.parse::<f64>() {
                Ok(number) if number.is_finite() => numbers.push(number),
                _ => return self.fault(field, format!("{}{} is not a finite number", which(i, count), quoted(word))),
            }
        }
        Ok(numbers)
    }

    /// One number above 0, or of at least 0.
    pub fn size(&self, field: &str, may_be_zero: bool) -> Result<f64, InputError> {
        let value = self.numbers(field, 1)?[0];
        match value > 0.0 || (may_be_zero && value == 0.0) {
            true => Ok(value),
            false if may_be_zero => self.fault(field, format!("is {value}, must be at least 0")),
            false => self.fault(field, format!("is {value}, must be above 0")),
        }
    }
}

/// "3rd entry " of a list, nothing for a lone value.
pub(super) fn which(index: usize, count: usize) -> String {
    match (index, count) {
        (_, 1) => String::new(),
        (0, _) => "1st entry ".into(),
        (1, _) => "2nd entry ".into(),
        (2, _) => "3rd entry ".into(),
        _ => format!("{}th entry ", index + 1),
    }
}
