//! Frames that are compressed as JPEG baseline, JPEG lossless (process 14) or JPEG 2000, as numbers in little-endian order, pixel by pixel.

use crate::files::escaped;
use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use jpeg_decoder::{ColorTransform, Decoder};
use std::io::Cursor;

/// What a decompressed frame must be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Numbers of a pixel.
    pub channels: usize,
    /// Bytes of a number, 1 or 2.
    pub width: usize,
}

impl Expected {
    fn bytes(&self) -> usize {
        self.size[0] * self.size[1] * self.channels * self.width
    }

    /// # Errors
    /// In words, a picture of another size.
    fn check_size(&self, columns: usize, rows: usize) -> Result<(), String> {
        match [columns, rows] == self.size {
            true => Ok(()),
            false => Err(format!("has {columns} x {rows} pixels, not {} x {}", self.size[0], self.size[1])),
        }
    }
}

/// The decoders make up what is missing at the end. All three kinds end with the same mark; one byte may follow that makes their length even.
///
/// # Errors
/// In words, a missing end.
fn check_end(bytes: &[u8]) -> Result<(), String> {
    let end = bytes.iter().rposition(|b| *b != 0).unwrap_or(0);
    match bytes.get(end.saturating_sub(1)..=end) {
        Some([0xff, 0xd9]) => Ok(()),
        _ => Err("is cut short: its end mark is missing".into()),
    }
}

fn unreadable(kind: &str, fault: impl ToString) -> String {
    format!("is no {kind} that is read: {}", escaped(&fault.to_string(), 200))
}

/// JPEG baseline and extended, 8 bits: grey, or red, green and blue.
///
/// # Errors
/// In words, what is wrong with the frame.
pub(super) fn baseline(bytes: &[u8], expected: Expected) -> Result<Vec<u8>, String> {
    check_end(bytes)?;
    let reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Jpeg);
    let decoder = reader.into_decoder().map_err(|e| unreadable("JPEG", e))?;
    let (columns, rows) = decoder.dimensions();
    expected.check_size(columns as usize, rows as usize)?;
    let image = DynamicImage::from_decoder(decoder).map_err(|e| unreadable("JPEG", e))?;
    Ok(match expected.channels {
        1 => image.into_luma8().into_raw(),
        _ => image.into_rgb8().into_raw(),
    })
}

/// What the frame header of a lossless JPEG says.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FrameHeader {
    precision: u8,
    columns: usize,
    rows: usize,
    channels: usize,
}

/// The frame header (SOF3: Huffman, sequential, lossless); None if the frame is of another kind or cut short.
fn lossless_header(bytes: &[u8]) -> Option<FrameHeader> {
    let word = |at: usize| bytes.get(at..at + 2).and_then(|b| b.first_chunk()).map(|b| u16::from_be_bytes(*b));
    let mut at = 2;
    (word(0)? == 0xffd8).then_some(())?;
    loop {
        let (marker, length) = (word(at)?, usize::from(word(at + 2)?));
        match marker {
            0xffc3 => {
                let [precision, .., channels] = *bytes.get(at + 4..at + 10)? else { return None };
                let [rows, columns] = [word(at + 5)?, word(at + 7)?].map(usize::from);
                return Some(FrameHeader { precision, columns, rows, channels: usize::from(channels) });
            }
            // Tables and comments come before it.
            0xffc4 | 0xffcc | 0xffdb | 0xffdd | 0xffe0..=0xffef | 0xfffe => at += 2 + length,
            // A byte of padding.
            0xffff => at += 1,
            _ => return None,
        }
    }
}

/// JPEG lossless with any predictor: 2 to 16 bits of grey, or 8 bits of three channels, which stay as they are stored.
///
/// # Errors
/// In words, what is wrong with the frame.
pub(super) fn lossless(bytes: &[u8], expected: Expected) -> Result<Vec<u8>, String> {
    const KIND: &str = "lossless JPEG";
    check_end(bytes)?;
    let header = lossless_header(bytes).ok_or_else(|| unreadable(KIND, "its frame header is missing"))?;
    expected.check_size(header.columns, header.rows)?;
    let width = match header.precision {
        2..=8 => 1,
        9..=16 => 2,
        other => return Err(unreadable(KIND, format!("{other} bits"))),
    };
    if header.channels != expected.channels || width > expected.width || (header.channels > 1 && width > 1) {
        return Err(unreadable(KIND, format!("{} numbers a pixel of {} bits", header.channels, header.precision)));
    }
    let mut decoder = Decoder::new(bytes);
    decoder.set_color_transform(ColorTransform::None);
    decoder.set_max_decoding_buffer_size(expected.bytes());
    let mut numbers = decoder.decode().map_err(|e| unreadable(KIND, e))?;
    match (width, expected.width) {
        // In the order of the machine.
        (2, _) => numbers.as_chunks_mut::<2>().0.iter_mut().for_each(|b| *b = u16::from_ne_bytes(*b).to_le_bytes()),
        (1, 2) => numbers = numbers.into_iter().flat_map(|n| [n, 0]).collect(),
        _ => {}
    }
    Ok(numbers)
}

/// JPEG 2000, lossless or not: the bare code stream that DICOM asks for, up to 16 bits without a sign, grey or three channels.
///
/// # Errors
/// In words, what is wrong with the frame.
pub(super) fn jpeg_2000(bytes: &[u8], expected: Expected) -> Result<Vec<u8>, String> {
    const KIND: &str = "JPEG 2000";
    /// Where the size segment, which is the first, has the depth of the first channel; the highest bit is that of signed numbers.
    const DEPTH: usize = 42;
    check_end(bytes)?;
    if bytes.get(DEPTH).is_none_or(|depth| depth & 0x80 != 0) {
        return Err(unreadable(KIND, "signed numbers, or no code stream"));
    }
    // Of what is damaged nothing is made up.
    let settings = DecodeSettings { strict: true, ..DecodeSettings::default() };
    let image = Image::new(bytes, &settings).map_err(|e| unreadable(KIND, e))?;
    expected.check_size(image.width() as usize, image.height() as usize)?;
    let mut context = DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(|e| unreadable(KIND, e))?;
    let channels = decoded.components();
    let most = match expected.width {
        1 => 8,
        _ => 16,
    };
    let pixels = expected.size[0] * expected.size[1];
    let is_right = |c: &hayro_jpeg2000::ComponentData| c.bit_depth() <= most && c.samples().len() == pixels;
    if channels.len() != expected.channels || !channels.iter().all(is_right) {
        let bits = channels.first().map_or(0, |c| c.bit_depth());
        return Err(unreadable(KIND, format!("{} numbers a pixel of {bits} bits", channels.len())));
    }
    let mut numbers = Vec::with_capacity(expected.bytes());
    for pixel in 0..pixels {
        for channel in channels {
            // Lossy numbers may lie beyond.
            let high = (1u32 << channel.bit_depth()) - 1;
            let number = channel.samples()[pixel].round().clamp(0.0, high as f32) as u16;
            numbers.extend_from_slice(&number.to_le_bytes()[..expected.width]);
        }
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_header_is_found_behind_tables() {
        let tables = [0xff, 0xd8, 0xff, 0xc4, 0, 4, 1, 2, 0xff, 0xff, 0xfe, 0, 2];
        let frame = [0xff, 0xc3, 0, 11, 12, 1, 0x2c, 0, 200, 1, 1, 0x11, 0];
        let found = lossless_header(&[&tables[..], &frame].concat());
        assert_eq!(found, Some(FrameHeader { precision: 12, columns: 200, rows: 300, channels: 1 }));
        // Another process, and a frame that is cut.
        assert_eq!(lossless_header(&[&tables[..], &[0xff, 0xc0, 0, 11]].concat()), None);
        assert!((0..tables.len() + 10).all(|n| lossless_header(&[&tables[..], &frame].concat()[..n]).is_none()));
    }

    #[test]
    fn frames_without_an_end_are_refused() {
        for decode in [baseline, lossless, jpeg_2000] {
            let expected = Expected { size: [1, 1], channels: 1, width: 1 };
            let fault = decode(&[0xff, 0xd8, 0xff], expected).expect_err("refused");
            assert!(fault.contains("end mark"), "{fault}");
        }
    }
}
