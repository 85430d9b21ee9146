//! What a DICOM file says of its pixels, and where each frame of them is.

use super::super::packed::Encoding;
use super::super::pixel::{LUMINANCE, Number, PixelFormat};
use super::classes::syntax;
use super::elements::{self as tags, Elements, PixelData};
use super::frames::{Arrangement, Coding, Place};
use crate::files::{InputError, quoted};
use std::path::Path;
use std::sync::Arc;

/// Most frames of a file.
const MAX_FRAMES: u64 = 1 << 20;
/// Most bytes of a frame.
const MAX_FRAME_BYTES: u64 = 1 << 30;
/// The same of lossless JPEG, whose decoder takes 7 bytes for each number, and of JPEG 2000, whose decoder takes some 30 bytes for each number.
const MAX_LOSSLESS_BYTES: u64 = 1 << 28;
const MAX_JPEG_2000_BYTES: u64 = 1 << 26;

/// The pixels of one file.
pub(super) struct Image {
    /// Columns and rows.
    pub size: [usize; 2],
    pub pixel: PixelFormat,
    pub coding: Coding,
    pub arrangement: Arrangement,
    /// Of each frame, in the order of the file.
    pub places: Vec<Place>,
    pub parts: Vec<(u64, u64)>,
    /// Luminance is taken of colours that the format of the pixels does not tell.
    pub from_colour: bool,
}

impl Image {
    /// `slices`: pictures that each stated frame may have, one after another.
    ///
    /// # Errors
    /// Pixels that are missing, cut short or of a kind that is not read.
    pub fn of(path: &Path, elements: &Elements, slices: u32) -> Result<Image, InputError> {
        let fault = |field: &str, fault: String| Err(InputError::new(path, field, fault));
        let root = &elements.root;
        let (name, is_read) = syntax(&elements.syntax);
        if !is_read {
            let uid = quoted(&elements.syntax);
            return fault(
                "transfer syntax",
                format!("{name} ({uid}) is not read: uncompressed, RLE, JPEG and JPEG 2000 are"),
            );
        }
        let side = |field: &str, tag| match root.word(tag) {
            Some(n @ 1..) => Ok(usize::from(n)),
            Some(0) => Err(InputError::new(path, field, "is 0, must be at least 1")),
            None => Err(InputError::new(path, field, "is missing")),
        };
        let size = [side("columns (0028,0011)", tags::COLUMNS)?, side("rows (0028,0010)", tags::ROWS)?];
        let frames = match root.text(tags::FRAMES).as_str() {
            "" => 1,
            text => match text.parse() {
                Ok(n @ 1..=MAX_FRAMES) => n,
                _ => return fault("frames (0028,0008)", format!("{} is not 1 to {MAX_FRAMES}", quoted(text))),
            },
        };
        let (coding, pixels) = match (elements.syntax.as_str(), &elements.pixels) {
            (_, None) => return fault("pixel data (7FE0,0010)", "is missing".into()),
            ("1.2.840.10008.1.2.5", Some(pixels)) => (Coding::Rle, pixels),
            ("1.2.840.10008.1.2.4.57" | "1.2.840.10008.1.2.4.70", Some(pixels)) => (Coding::JpegLossless, pixels),
            ("1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91", Some(pixels)) => (Coding::Jpeg2000, pixels),
            (uid, Some(pixels)) if uid.starts_with("1.2.840.10008.1.2.4.") => (Coding::Jpeg, pixels),
            (_, Some(pixels)) => (Coding::Native, pixels),
        };
        let (pixel, arrangement, stored) = format(path, elements, coding)?;
        let each = size[0] as u64 * size[1] as u64 * stored as u64;
        let most = match coding {
            Coding::Jpeg2000 => MAX_JPEG_2000_BYTES,
            Coding::JpegLossless => MAX_LOSSLESS_BYTES,
            _ => MAX_FRAME_BYTES,
        };
        if each > most {
            return fault("rows and columns", format!("make frames of {each} bytes, at most {most} are read"));
        }
        let all = frames.saturating_mul(slices.into());
        let holds_all = match pixels {
            PixelData::Native(_, length) => each.saturating_mul(all) <= *length,
            PixelData::Encapsulated(_, fragments) => fragments.len() as u64 == all,
        };
        let frames = if holds_all && all <= MAX_FRAMES { all.max(frames) } else { frames };
        if arrangement == Arrangement::LumaPairs && !size[0].is_multiple_of(2) {
            return fault("columns (0028,0011)", "must be even for colours that two pixels share".into());
        }
        let (places, parts) = match (coding, pixels) {
            (Coding::Native, PixelData::Native(offset, length)) => {
                let claimed = each.saturating_mul(frames);
                if claimed > *length {
                    return fault("data", format!("cut short, {length} of {claimed} bytes are there"));
                }
                let parts = (0..frames).map(|n| (offset + n * each, each)).collect();
                ((0..frames as usize).map(|n| Place { file: 0, first: n, count: 1 }).collect(), parts)
            }
            (
                Coding::Rle | Coding::Jpeg | Coding::JpegLossless | Coding::Jpeg2000,
                PixelData::Encapsulated(table, fragments),
            ) => {
                let there = fragments.iter().fold(0u64, |all, (_, length)| all.saturating_add(*length));
                let most = there.saturating_mul(Encoding::Dicom(coding).most()).saturating_add(1024);
                let claimed = each.saturating_mul(frames);
                if claimed > most {
                    let why = format!("{there} compressed bytes cannot hold {claimed} bytes of frames");
                    return fault("pixel data (7FE0,0010)", why);
                }
                let groups = grouped(frames as usize, table, fragments);
                let groups = groups.map_err(|why| InputError::new(path, "pixel data (7FE0,0010)", why))?;
                (groups.into_iter().map(|(first, count)| Place { file: 0, first, count }).collect(), fragments.clone())
            }
            _ => return fault("pixel data (7FE0,0010)", format!("is not in the form of {name}")),
        };
        let from_colour = matches!(arrangement, Arrangement::Luma | Arrangement::LumaPairs | Arrangement::Palette(_));
        Ok(Image { size, pixel, coding, arrangement, places, parts, from_colour })
    }
}

/// The fragments of each frame: first and number.
fn grouped(frames: usize, table: &[u32], fragments: &[(u64, u64)]) -> Result<Vec<(usize, usize)>, String> {
    if fragments.len() == frames {
        return Ok((0..frames).map(|n| (n, 1)).collect());
    }
    if frames == 1 && !fragments.is_empty() {
        return Ok(vec![(0, fragments.len())]);
    }
    let uneven = || format!("has {} fragments for {frames} frames, and no table that divides them", fragments.len());
    let (Some((begin, _)), true) = (fragments.first(), table.len() == frames && fragments.len() > frames) else {
        return Err(uneven());
    };
    let firsts = table.iter().map(|at| fragments.binary_search_by_key(&(begin + u64::from(*at)), |(at, _)| *at));
    let mut firsts = firsts.collect::<Result<Vec<usize>, usize>>().map_err(|_| uneven())?;
    firsts.push(fragments.len());
    match firsts[0] == 0 && firsts.windows(2).all(|pair| pair[0] < pair[1]) {
        true => Ok(firsts.windows(2).map(|pair| (pair[0], pair[1] - pair[0])).collect()),
        false => Err(uneven()),
    }
}

/// The pixels as they are read, how they stand in the file, and the bytes that one of them takes there.
fn format(path: &Path, elements: &Elements, coding: Coding) -> Result<(PixelFormat, Arrangement, usize), InputError> {
    let fault = |field: &str, fault: String| Err(InputError::new(path, field, fault));
    let root = &elements.root;
    let samples = root.word(tags::SAMPLES).unwrap_or(1);
    let bits = root.word(tags::BITS_ALLOCATED).unwrap_or(0);
    let stored_bits = root.word(tags::BITS_STORED).unwrap_or(bits);
    let signed = root.word(tags::IS_SIGNED).unwrap_or(0) == 1;
    let number = match (bits, signed) {
        (8, false) => Number::U8,
        (8, true) => Number::I8,
        (16, false) => Number::U16,
        (16, true) => Number::I16,
        (32, false) => Number::U32,
        (32, true) => Number::I32,
        _ => return fault("bits allocated (0028,0100)", format!("is {bits}: 8, 16 and 32 are read")),
    };
    let high = root.word(tags::HIGH_BIT).unwrap_or(stored_bits.saturating_sub(1));
    if stored_bits == 0
        || stored_bits > bits
        || high.checked_add(1) != Some(stored_bits)
        || (signed && stored_bits != bits)
    {
        return fault("bits stored (0028,0101)", format!("{stored_bits} of {bits}, up to bit {high}, are not read"));
    }
    let (most, name) = match coding {
        Coding::Native | Coding::Rle => (32, ""),
        Coding::Jpeg => (8, "JPEG, 8"),
        Coding::JpegLossless => (16, "lossless JPEG, 8 and 16"),
        Coding::Jpeg2000 => (16, "JPEG 2000, 8 and 16"),
    };
    if bits > most {
        return fault("bits allocated (0028,0100)", format!("is {bits}: of {name} are read"));
    }
    let photometric = root.text(tags::PHOTOMETRIC);
    let planar = root.word(tags::PLANAR).unwrap_or(0) == 1 && coding == Coding::Native;
    let bytes = number.bytes();
    let most = (f64::from(stored_bits)).exp2() - 1.0;
    let (slope, intercept) = (root.decimal(tags::SLOPE).unwrap_or(1.0), root.decimal(tags::INTERCEPT).unwrap_or(0.0));
    let mut scale = [slope, intercept];
    let (channels, arrangement, stored) = match (photometric.as_str(), samples, coding) {
        ("MONOCHROME2", 1, _) => (1, Arrangement::Plain, 1),
        ("MONOCHROME1", 1, _) => {
            scale = [-slope, slope * most + intercept];
            (1, Arrangement::Plain, 1)
        }
        ("PALETTE COLOR", 1, Coding::Native | Coding::Rle | Coding::JpegLossless) if number == Number::U8 => {
            (1, Arrangement::Palette(palette(path, elements)?), 1)
        }
        ("RGB" | "YBR_FULL" | "YBR_FULL_422", 3, Coding::Jpeg) => (3, Arrangement::Plain, 3),
        // The decoder undoes the transform of the colours.
        ("YBR_RCT" | "YBR_ICT", 3, Coding::Jpeg2000) => (3, Arrangement::Plain, 3),
        ("RGB", 3, _) if planar => (3, Arrangement::Planes, 3),
        ("RGB", 3, _) => (3, Arrangement::Plain, 3),
        ("YBR_FULL", 3, _) if number == Number::U8 && !planar => (1, Arrangement::Luma, 3),
        ("YBR_FULL_422", 3, Coding::Native) if number == Number::U8 && !planar => (1, Arrangement::LumaPairs, 2),
        _ => {
            let shown = quoted(&photometric);
            return fault(
                "photometric interpretation (0028,0004)",
                format!("{shown} of {samples} numbers is not read"),
            );
        }
    };
    let is_scaled = scale != [1.0, 0.0] && scale.iter().all(|v| v.is_finite()) && scale[0] != 0.0;
    // What is decompressed is in little-endian order.
    let big_endian = elements.big_endian && coding == Coding::Native;
    let pixel = PixelFormat { number, channels, big_endian, scale: is_scaled.then_some(scale) };
    Ok((pixel, arrangement, stored * bytes))
}

/// The luminance of every colour of a palette.
fn palette(path: &Path, elements: &Elements) -> Result<Arc<[u8]>, InputError> {
    let mut tables = Vec::new();
    for (about, table) in tags::PALETTE_ABOUT.into_iter().zip(tags::PALETTE) {
        let words = elements.root.words(table);
        let (count, first, bits) = match elements.root.words(about)[..] {
            // 0 stands for 65536.
            [count, first, bits] => (if count == 0 { 65536 } else { usize::from(count) }, first, bits),
            _ => (0, 1, 0),
        };
        let entries: Vec<u8> = match bits {
            16 => words.iter().map(|word| (word >> 8) as u8).collect(),
            8 if words.len() * 2 <= count + 1 => words.iter().flat_map(|word| word.to_le_bytes()).collect(),
            8 => words.iter().map(|word| *word as u8).collect(),
            _ => Vec::new(),
        };
        if first != 0 || entries.len() < count || count == 0 {
            return Err(InputError::new(path, "palette (0028,1101)", "is not whole, or does not begin at 0"));
        }
        tables.push(entries);
    }
    let [red, green, blue] = &tables[..] else { return Ok(Arc::new([])) };
    let grey = |((r, g), b): ((&u8, &u8), &u8)| {
        let all = [r, g, b].into_iter().zip(LUMINANCE);
        all.map(|(value, share)| f64::from(*value) * share).sum::<f64>().round() as u8
    };
    Ok(red.iter().zip(green).zip(blue).map(grey).collect())
}

#[cfg(test)]
mod tests {
    use super::grouped;

    #[test]
    fn fragments_are_divided_by_the_table() {
        let fragments = [(100, 10), (118, 10), (136, 10)];
        assert_eq!(grouped(3, &[], &fragments), Ok(vec![(0, 1), (1, 1), (2, 1)]));
        assert_eq!(grouped(1, &[], &fragments), Ok(vec![(0, 3)]));
        assert_eq!(grouped(2, &[0, 36], &fragments), Ok(vec![(0, 2), (2, 1)]));
        for table in [&[][..], &[0, 35], &[36, 0], &[18, 36], &[0, 0]] {
            assert!(grouped(2, table, &fragments).is_err(), "{table:?}");
        }
        assert!(grouped(4, &[0, 18, 36, 54], &fragments).is_err());
        assert!(grouped(1, &[], &[]).is_err());
    }
}
