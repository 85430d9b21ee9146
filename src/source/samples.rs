//! The conversion of samples from the bytes of a file to those that are stored and uploaded.

use crate::probe::{SampleType, StoredType};

/// Numbers of samples that were replaced by 0, by the reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Replaced {
    /// Number of samples that were NaN or infinite.
    pub not_finite: u64,
    /// Number of samples that were denormal f32. Many GPUs treat these as 0, so that they are always replaced.
    pub denormal: u64,
}

impl std::ops::AddAssign for Replaced {
    fn add_assign(&mut self, other: Replaced) {
        self.not_finite += other.not_finite;
        self.denormal += other.denormal;
    }
}

/// Converts the samples of a file to stored samples, in place. Bytes after the last complete sample are not changed.
pub(super) fn store(sample: SampleType, big_endian: bool, bytes: &mut [u8]) -> Replaced {
    let mut replaced = Replaced::default();
    match sample {
        SampleType::U8 => {}
        SampleType::U16 | SampleType::I16 => {
            let flip = if sample == SampleType::I16 { 0x8000 } else { 0 };
            if !big_endian && flip == 0 {
                return replaced;
            }
            for pair in bytes.as_chunks_mut::<2>().0 {
                let value = if big_endian { u16::from_be_bytes(*pair) } else { u16::from_le_bytes(*pair) };
                // Adding 32768 to an i16 flips its top bit.
                *pair = (value ^ flip).to_le_bytes();
            }
        }
        SampleType::F32 => {
            for word in bytes.as_chunks_mut::<4>().0 {
                let mut value = if big_endian { f32::from_be_bytes(*word) } else { f32::from_le_bytes(*word) };
                if !value.is_finite() {
                    replaced.not_finite += 1;
                    value = 0.0;
                } else if value.is_subnormal() {
                    replaced.denormal += 1;
                    value = 0.0;
                }
                *word = value.to_le_bytes();
            }
        }
    }
    replaced
}

/// Writes a value in the type of a file, little-endian and rounded to nearest. `place`: the bytes of the sample.
pub(super) fn put(sample: SampleType, value: f64, place: &mut [u8]) {
    match sample {
        SampleType::U8 => place.copy_from_slice(&[value.round() as u8]),
        SampleType::U16 => place.copy_from_slice(&(value.round() as u16).to_le_bytes()),
        SampleType::I16 => place.copy_from_slice(&(value.round() as i16).to_le_bytes()),
        SampleType::F32 => place.copy_from_slice(&(value as f32).to_le_bytes()),
    }
}

/// Extends `range` (smallest, largest) so that it contains all stored samples in `bytes`.
pub(super) fn widen(range: &mut [f64; 2], stored: StoredType, bytes: &[u8]) {
    fn span<const N: usize, T: PartialOrd + Copy + Into<f64>>(
        bytes: &[u8],
        read: impl Fn([u8; N]) -> T,
    ) -> Option<[f64; 2]> {
        let values = bytes.as_chunks::<N>().0;
        let first = read(*values.first()?);
        // A tuple stays in two registers, so that the loop is vectorised.
        let wider = |(low, high): (T, T), v: T| (if v < low { v } else { low }, if v > high { v } else { high });
        let (low, high) = values.iter().fold((first, first), |span, v| wider(span, read(*v)));
        Some([low.into(), high.into()])
    }
    let found = match stored {
        StoredType::U8 => span(bytes, u8::from_le_bytes),
        StoredType::U16 => span(bytes, u16::from_le_bytes),
        StoredType::F32 => span(bytes, f32::from_le_bytes),
    };
    if let Some([low, high]) = found {
        *range = [range[0].min(low), range[1].max(high)];
    }
}

/// The range, made wider if it is empty: that of constant data becomes 1 wide, or as wide as f32 can distinguish.
pub(super) fn not_empty([low, high]: [f64; 2]) -> [f64; 2] {
    match low < high {
        true => [low, high],
        false if low.is_finite() => [low, low + low.abs().max(1.0)],
        false => [0.0, 1.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_signed_samples_survives_storing() {
        let mut bytes: Vec<u8> = [-32768i16, -1, 0, 1, 32767].iter().flat_map(|v| v.to_be_bytes()).collect();
        store(SampleType::I16, true, &mut bytes);
        let stored: Vec<u16> = bytes.chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        assert_eq!(stored, [0, 32767, 32768, 32769, 65535]);
    }

    #[test]
    fn no_sample_that_is_not_finite_or_normal_gets_through() {
        let hostile = [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e-40, -1e-40, -2.5, 0.0, 7.0];
        let mut bytes: Vec<u8> = hostile.iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(store(SampleType::F32, false, &mut bytes), Replaced { not_finite: 3, denormal: 2 });
        let stored: Vec<f32> = bytes.chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        assert_eq!(stored, [0.0, 0.0, 0.0, 0.0, 0.0, -2.5, 0.0, 7.0]);
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        widen(&mut range, StoredType::F32, &bytes);
        assert_eq!(range, [-2.5, 7.0]);
    }

    #[test]
    fn constant_data_do_not_give_a_zero_range() {
        for value in [0.0, 5.0, -3.0, 1e30] {
            let [low, high] = not_empty([value, value]);
            assert!(high as f32 > low as f32, "{value}");
        }
        assert_eq!(not_empty([f64::INFINITY, f64::NEG_INFINITY]), [0.0, 1.0]);
    }
}
