//! Pixels of files: number types, channels and scales, and the conversion to stored samples.

use super::samples::{Replaced, put, store};
use crate::SampleType;
use crate::tree::Name;

/// A number type in which files and messages have samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Name)]
#[tree(rename_all = "lowercase")]
pub enum Number {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl Number {
    /// Size of one number, bytes.
    pub fn bytes(self) -> usize {
        match self {
            Number::U8 | Number::I8 => 1,
            Number::U16 | Number::I16 => 2,
            Number::U32 | Number::I32 | Number::F32 => 4,
            Number::U64 | Number::I64 | Number::F64 => 8,
        }
    }

    /// The type that samples have: the same, or the next larger one that is drawn.
    pub(super) fn sample(self) -> SampleType {
        match self {
            Number::U8 => SampleType::U8,
            Number::U16 => SampleType::U16,
            Number::I8 | Number::I16 => SampleType::I16,
            _ => SampleType::F32,
        }
    }

    /// The value of little- or big-endian bytes; 0 if there are too few.
    fn value(self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut ordered = [0; 8];
        let size = self.bytes();
        let Some(given) = bytes.get(..size) else { return 0.0 };
        ordered[..size].copy_from_slice(given);
        if big_endian {
            ordered[..size].reverse();
        }
        let [a, b, c, d, ..] = ordered;
        match self {
            Number::U8 => f64::from(a),
            Number::I8 => f64::from(a.cast_signed()),
            Number::U16 => f64::from(u16::from_le_bytes([a, b])),
            Number::I16 => f64::from(i16::from_le_bytes([a, b])),
            Number::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Number::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Number::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Number::U64 => u64::from_le_bytes(ordered) as f64,
            Number::I64 => i64::from_le_bytes(ordered) as f64,
            Number::F64 => f64::from_le_bytes(ordered),
        }
    }
}

/// Weights of red, green and blue in luminance (ITU-R BT.601).
pub(super) const LUMINANCE: [f64; 3] = [0.299, 0.587, 0.114];

/// How a file stores its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PixelFormat {
    pub number: Number,
    /// Numbers of a pixel: 1 (grey), 3 (red, green, blue) or 4 (the same and one that is not read).
    pub channels: usize,
    pub big_endian: bool,
    /// Slope and intercept by which a stored number becomes a value; None: it is the value.
    pub scale: Option<[f64; 2]>,
}

impl PixelFormat {
    /// The format of pixels of one little-endian grey number.
    pub fn grey(number: Number) -> PixelFormat {
        PixelFormat { number, channels: 1, big_endian: false, scale: None }
    }

    /// Size of a pixel before its conversion, bytes.
    pub fn bytes(&self) -> usize {
        self.number.bytes() * self.channels
    }

    /// The type of the samples that pixels are converted to.
    pub fn sample(&self) -> SampleType {
        if self.scale.is_some() { SampleType::F32 } else { self.number.sample() }
    }

    /// A text for users on how pixels are converted; None if they are read unchanged.
    pub fn remark(&self) -> Option<String> {
        let name = self.number.name();
        let kept = match self.sample() {
            SampleType::F32 if self.number != Number::F32 => format!("{name} read as f32"),
            SampleType::I16 if self.number == Number::I8 => "i8 read as i16".into(),
            _ => String::new(),
        };
        let scaled =
            self.scale.map(|[slope, intercept]| format!("values are {slope} times the number plus {intercept}"));
        let colour = (self.channels > 1).then(|| "colours read as their luminance".to_string());
        let parts: Vec<String> = [Some(kept).filter(|k| !k.is_empty()), scaled, colour].into_iter().flatten().collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }

    /// Converts complete pixels, as the file has them, to stored samples. The second result counts the samples that were replaced by 0.
    pub fn convert(&self, mut bytes: Vec<u8>) -> (Vec<u8>, Replaced) {
        let sample = self.sample();
        let is_stored = matches!(self.number, Number::U8 | Number::U16 | Number::I16 | Number::F32);
        if is_stored && self.channels == 1 && self.scale.is_none() {
            let replaced = store(sample, self.big_endian, &mut bytes);
            return (bytes, replaced);
        }
        let mut stored = vec![0; bytes.len() / self.bytes() * sample.bytes()];
        for (pixel, place) in bytes.chunks_exact(self.bytes()).zip(stored.chunks_exact_mut(sample.bytes())) {
            let value = |number: &[u8]| self.number.value(number, self.big_endian);
            let each = pixel.chunks_exact(self.number.bytes());
            let grey = match self.channels {
                1 => value(pixel),
                _ => each.zip(LUMINANCE).map(|(colour, share)| share * value(colour)).sum(),
            };
            let scaled = self.scale.map_or(grey, |[slope, intercept]| slope * grey + intercept);
            put(sample, scaled, place);
        }
        let replaced = store(sample, false, &mut stored);
        (stored, replaced)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shorts(bytes: &[u8]) -> Vec<u16> {
        bytes.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect()
    }

    fn floats(bytes: &[u8]) -> Vec<f32> {
        bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
    }

    #[test]
    fn every_number_type_keeps_its_values() {
        let i8s = PixelFormat::grey(Number::I8).convert([-128i8, -1, 0, 127].map(i8::cast_unsigned).to_vec());
        assert_eq!(shorts(&i8s.0), [32640, 32767, 32768, 32895]);
        let of = |number, bytes: Vec<u8>| floats(&PixelFormat::grey(number).convert(bytes).0);
        assert_eq!(of(Number::I32, [-7i32, 70_000].map(i32::to_le_bytes).concat()), [-7.0, 70_000.0]);
        assert_eq!(of(Number::U32, [7u32, u32::MAX].map(u32::to_le_bytes).concat()), [7.0, 4_294_967_296.0]);
        assert_eq!(of(Number::F64, [0.5f64, -2.25].map(f64::to_le_bytes).concat()), [0.5, -2.25]);
        assert_eq!(of(Number::I64, [-3i64, 9].map(i64::to_le_bytes).concat()), [-3.0, 9.0]);
        assert_eq!(of(Number::U64, [3u64, 1 << 40].map(u64::to_le_bytes).concat()), [3.0, 1.099_511_6e12]);
        let big = PixelFormat { big_endian: true, ..PixelFormat::grey(Number::F64) };
        assert_eq!(floats(&big.convert(1.5f64.to_be_bytes().to_vec()).0), [1.5]);
        let (bytes, replaced) =
            PixelFormat::grey(Number::F64).convert([1e300, f64::NAN, 1.0].map(f64::to_le_bytes).concat());
        assert_eq!((floats(&bytes), replaced.not_finite), (vec![0.0, 0.0, 1.0], 2));
    }

    #[test]
    fn colours_become_luminance_and_scales_are_applied() {
        let colour = PixelFormat { channels: 3, ..PixelFormat::grey(Number::U8) };
        assert_eq!(colour.convert(vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9]).0, [76, 150, 29, 9]);
        let scaled = PixelFormat { scale: Some([0.5, -10.0]), ..PixelFormat::grey(Number::U8) };
        assert_eq!(floats(&scaled.convert(vec![0, 100]).0), [-10.0, 40.0]);
        assert!(colour.remark().is_some_and(|text| text.contains("luminance")));
        assert_eq!(PixelFormat::grey(Number::U16).remark(), None);
    }
}
