//! The samples of images: their stored types, colours as luminance, and the values that are shown as 0 and 1.

use super::message::{Image, Scalar};
use crate::StoredType;
use crate::pixel::{LUMINANCE, PixelFormat};
use crate::samples::Replaced;
use crate::value_range::ValueRange;

/// The type in which samples of an image are stored: unsigned 8 and 16 bits unchanged, signed ones shifted to begin at 0, all others as f32.
pub(super) fn stored(scalar: Scalar) -> StoredType {
    if scalar == Scalar::I8 { StoredType::U8 } else { scalar.sample().stored() }
}

/// Converts an image to one little-endian sample a pixel, in the order of the image. The second result is the number of samples that were
/// replaced by 0.
///
/// Pixels of 3 or 4 components (red, green, blue, and any fourth) become their luminance.
///
/// # Errors
/// Pixels have another number of components.
pub(super) fn samples(image: Image) -> Result<(Vec<u8>, u64), String> {
    let Image { components, scalar, mut bytes, .. } = image;
    let channels = usize::from(components);
    let number = match (scalar, components) {
        (_, 0 | 2 | 5..) => return Err(format!("pixels have {components} components, must have 1, 3 or 4")),
        // Unlike those of files, these stay 8 bits. Adding 128 to an i8 flips its top bit.
        (Scalar::I8, 1) => {
            bytes.iter_mut().for_each(|byte| *byte ^= 0x80);
            Scalar::U8
        }
        (Scalar::I8, _) => {
            let weighted = |(colour, share): (&u8, f64)| share * f64::from(colour.cast_signed());
            let grey = |pixel: &[u8]| pixel.iter().zip(LUMINANCE).map(weighted).sum::<f64>();
            return Ok((bytes.chunks_exact(channels).map(|pixel| (grey(pixel) + 128.0).round() as u8).collect(), 0));
        }
        (number, _) => number,
    };
    let format = PixelFormat { channels, ..PixelFormat::grey(number) };
    let (bytes, Replaced { not_finite, denormal }) = format.convert(bytes);
    Ok((bytes, not_finite + denormal))
}

/// The values that are displayed as 0 and 1: 0 and 255 for u8, otherwise the range of the samples collected in `values`.
pub(super) fn range_of(stored: StoredType, values: ValueRange) -> [f64; 2] {
    if stored == StoredType::U8 {
        return [0.0, 255.0];
    }
    let measured = values.measured();
    if let Some(remark) = measured.remark() {
        tracing::warn!("{remark}");
    }
    measured.range
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::igtl::message::{Coordinates, Region};

    fn image(scalar: Scalar, components: u8, bytes: Vec<u8>) -> Image {
        Image {
            device: String::new(),
            time: 0.0,
            size: [1; 3],
            region: Region { offset: [0; 3], size: [1; 3] },
            scalar,
            components,
            coordinates: Coordinates::Ras,
            axes: [[1.0; 3]; 3],
            centre: [0.0; 3],
            bytes,
        }
    }

    #[test]
    fn the_order_of_values_survives_every_type() {
        let floats = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let words = |v: &[u16]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        for (scalar, bytes, expected, replaced) in [
            (Scalar::U8, vec![0, 7, 255], vec![0, 7, 255], 0),
            (Scalar::I8, vec![0x80, 0xff, 0, 127], vec![0, 127, 128, 255], 0),
            (Scalar::U16, words(&[0, 500]), words(&[0, 500]), 0),
            (Scalar::I16, words(&[0x8000, 0xffff, 5]), words(&[0, 32767, 32773]), 0),
            (Scalar::I32, (-3i32).to_le_bytes().to_vec(), floats(&[-3.0]), 0),
            (Scalar::U32, 4_000_000_000u32.to_le_bytes().to_vec(), floats(&[4e9]), 0),
            (Scalar::F32, floats(&[1.5, f32::NAN, 1e-40]), floats(&[1.5, 0.0, 0.0]), 2),
            (Scalar::F64, [0.25f64, 1e300].iter().flat_map(|v| v.to_le_bytes()).collect(), floats(&[0.25, 0.0]), 1),
        ] {
            assert_eq!(samples(image(scalar, 1, bytes)), Ok((expected, replaced)), "{scalar:?}");
        }
    }

    #[test]
    fn colours_become_their_luminance_and_nothing_else_passes() {
        for (components, pixel) in [(3, vec![10, 20, 30]), (4, vec![10, 20, 30, 255])] {
            // 2.99 + 11.74 + 3.42.
            assert_eq!(samples(image(Scalar::U8, components, pixel.clone())), Ok((vec![18], 0)));
            let signed: Vec<u8> = pixel.iter().map(|v| v ^ 0x80).collect();
            assert_eq!(samples(image(Scalar::I8, components, signed)), Ok((vec![18], 0)));
            let words: Vec<u8> = pixel.iter().flat_map(|v| (i16::from(*v) * 100).to_le_bytes()).collect();
            let expected = (1815u16 + 32768).to_le_bytes().to_vec();
            assert_eq!(samples(image(Scalar::I16, components, words)), Ok((expected, 0)));
        }
        for components in [2, 5, 255] {
            let refused = samples(image(Scalar::U8, components, vec![0; usize::from(components)])).unwrap_err();
            assert!(refused.contains(&format!("{components} components")), "{refused}");
        }
    }
}
