//! The number types of samples.

use crate::tree::{FromNode, ToNode};
use std::fmt;

/// Number type of the samples in an input file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    U8,
    U16,
    I16,
    F32,
}

/// Number type of the samples in the memory of a [`Frame`](super::Frame).
#[derive(Clone, Copy, Debug, PartialEq, Eq, ToNode, FromNode)]
pub enum StoredType {
    U8,
    U16,
    F32,
}

/// Added to an i16 to store it as u16.
const I16_SHIFT: f64 = 32768.0;

impl SampleType {
    /// Size of one sample, bytes.
    pub fn bytes(self) -> usize {
        self.stored().bytes()
    }

    /// The type in which samples of this type are stored in frames.
    pub fn stored(self) -> StoredType {
        match self {
            SampleType::U8 => StoredType::U8,
            SampleType::U16 | SampleType::I16 => StoredType::U16,
            SampleType::F32 => StoredType::F32,
        }
    }

    /// The name of the type in a MetaImage header.
    pub fn metaimage(self) -> &'static str {
        match self {
            SampleType::U8 => "MET_UCHAR",
            SampleType::U16 => "MET_USHORT",
            SampleType::I16 => "MET_SHORT",
            SampleType::F32 => "MET_FLOAT",
        }
    }

    /// The stored value of a sample minus its value in the file: 32768 for i16, otherwise 0.
    pub fn shift(self) -> f64 {
        if self == SampleType::I16 { I16_SHIFT } else { 0.0 }
    }
}

impl From<StoredType> for SampleType {
    fn from(stored: StoredType) -> SampleType {
        match stored {
            StoredType::U8 => SampleType::U8,
            StoredType::U16 => SampleType::U16,
            StoredType::F32 => SampleType::F32,
        }
    }
}

impl StoredType {
    /// Size of one sample, bytes.
    pub fn bytes(self) -> usize {
        match self {
            StoredType::U8 => 1,
            StoredType::U16 => 2,
            StoredType::F32 => 4,
        }
    }

    /// Value of one little-endian sample; 0 if the number of bytes is not that of the type.
    pub fn value(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (StoredType::U8, [a]) => f64::from(*a),
            (StoredType::U16, [a, b]) => f64::from(u16::from_le_bytes([*a, *b])),
            (StoredType::F32, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => 0.0,
        }
    }

    /// Calls `each` with every little-endian sample of `bytes`.
    pub fn for_each(self, bytes: &[u8], mut each: impl FnMut(f64)) {
        match self {
            StoredType::U8 => bytes.iter().for_each(|b| each(f64::from(*b))),
            StoredType::U16 => bytes.as_chunks().0.iter().for_each(|b| each(f64::from(u16::from_le_bytes(*b)))),
            StoredType::F32 => bytes.as_chunks().0.iter().for_each(|b| each(f64::from(f32::from_le_bytes(*b)))),
        }
    }

    /// Appends a value to `bytes` as a little-endian sample. For an integer type it is rounded and limited to the range of the type; NaN becomes 0.
    pub fn append(self, value: f64, bytes: &mut Vec<u8>) {
        match self {
            StoredType::U8 => bytes.push(value.round() as u8),
            StoredType::U16 => bytes.extend((value.round() as u16).to_le_bytes()),
            StoredType::F32 => bytes.extend((value as f32).to_le_bytes()),
        }
    }
}

impl fmt::Display for SampleType {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            SampleType::U8 => "u8",
            SampleType::U16 => "u16",
            SampleType::I16 => "i16 (stored as u16, 32768 added)",
            SampleType::F32 => "f32",
        })
    }
}
