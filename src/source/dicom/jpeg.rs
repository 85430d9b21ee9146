//! Frames that are compressed as JPEG baseline, JPEG lossless (process 14) or JPEG 2000, as numbers in little-endian order, pixel by pixel.

use crate::files::escaped;
#[cfg(feature = "jpeg2000")]
use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use jpeg_decoder::{ColorTransform, Decoder};
use std::io::Cursor;

/// What a decompressed frame has to be; other frames are refused.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected {
    /// Columns and rows of a frame.
    pub size: [usize; 2],
    /// Numbers of a pixel: 1 or 3.
    pub channels: usize,
    /// Bytes of one number, 1 or 2.
    pub width: usize,
}

impl Expected {
    pub fn bytes(&self) -> usize {
        self.size[0] * self.size[1] * self.channels * self.width
    }

    /// # Errors
    /// One line: a picture of another size.
    fn check_size(&self, columns: usize, rows: usize) -> Result<(), String> {
        match [columns, rows] == self.size {
            true => Ok(()),
            false => Err(format!("has {columns} x {rows} pixels, not {} x {}", self.size[0], self.size[1])),
        }
    }
}

/// The end mark of all three kinds, which the two kinds of padding follow.
const END: [u8; 2] = [0xff, 0xd9];

/// A frame without what fills it up behind its end mark: zeros as the standard demands, or FF as some scanners write.
fn without_padding(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|b| !matches!(b, 0 | 0xff)).map_or(0, |last| last + 1);
    bytes.get(..end).unwrap_or_default()
}

/// True if a fragment with these last bytes may end a frame: they end with the end mark, padding apart. Padding alone, or the second half of the
/// mark alone, counts too.
pub(super) fn has_end(tail: &[u8]) -> bool {
    let tail = without_padding(tail);
    tail.is_empty() || tail == [END[1]] || tail.ends_with(&END)
}

/// The frame without padding. The decoders make up what is missing at the end, and do not see a second picture.
///
/// # Errors
/// One line: a missing end, or several pictures.
fn whole(bytes: &[u8]) -> Result<&[u8], String> {
    let frame = without_padding(bytes);
    if !frame.ends_with(&END) {
        return Err("is cut short: its end mark is missing".into());
    }
    // Every mark begins with the byte that may be padding as well.
    let begins_again = |(end, _): (usize, &[u8])| {
        let behind = &frame[end + 2..];
        let padding = behind.iter().take_while(|b| matches!(b, 0 | 0xff)).count();
        let mark = padding.checked_sub(1).and_then(|from| behind.get(from..from + 2));
        matches!(mark, Some([0xff, 0xd8 | 0x4f]))
    };
    match frame.windows(2).enumerate().filter(|(_, mark)| *mark == END).any(begins_again) {
        true => Err("holds several pictures, one behind the other".into()),
        false => Ok(frame),
    }
}

fn unreadable(kind: &str, fault: impl ToString) -> String {
    format!("is no {kind} that is read: {}", escaped(&fault.to_string(), 200))
}

/// Decodes JPEG baseline or extended of 8 bits, grey or RGB, to pixels row by row.
///
/// # Errors
/// One line: what is wrong with the frame.
pub(super) fn baseline(bytes: &[u8], expected: Expected) -> Result<Vec<u8>, String> {
    let bytes = whole(bytes)?;
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

/// What the headers of a lossless JPEG say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct LosslessHeader {
    precision: u8,
    columns: usize,
    rows: usize,
    channels: usize,
    /// Numbers between two markers that begin anew; 0 for none.
    restart: u16,
    /// Channels of the first scan, and the bits that were cut off before.
    scan: usize,
    shift: u8,
}

/// The frame header (SOF3: Huffman, sequential, lossless) and the first scan's; None if the frame is of another kind or cut short.
fn lossless_header(bytes: &[u8]) -> Option<LosslessHeader> {
    let mut header = LosslessHeader::default();
    let mut at = 2;
    (word(bytes, 0)? == 0xffd8).then_some(())?;
    loop {
        let marker = word(bytes, at)?;
        // A byte of padding.
        if marker == 0xffff {
            at += 1;
            continue;
        }
        let length = usize::from(word(bytes, at + 2)?);
        match marker {
            0xffc3 => {
                let [precision, .., channels] = *bytes.get(at + 4..at + 10)? else { return None };
                let [rows, columns] = [word(bytes, at + 5)?, word(bytes, at + 7)?].map(usize::from);
                header = LosslessHeader { precision, columns, rows, channels: usize::from(channels), ..header };
            }
            0xffdd => header.restart = word(bytes, at + 4)?,
            0xffda => {
                (header.channels > 0).then_some(())?;
                (header.scan, header.shift) =
                    (usize::from(*bytes.get(at + 4)?), *bytes.get((at + 1).checked_add(length)?)? & 15);
                return Some(header);
            }
            // Tables and comments.
            0xffc4 | 0xffcc | 0xffdb | 0xffe0..=0xffef | 0xfffe => {}
            _ => return None,
        }
        at += 2 + length;
    }
}

/// A number of two bytes, the highest first.
fn word(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..at + 2).and_then(|b| b.first_chunk()).map(|b| u16::from_be_bytes(*b))
}

/// Decodes lossless JPEG with any predictor: 8 to 16 bits of grey, or 8 bits of three channels, which stay as they are stored. Refused are
/// restart markers and dropped low bits (point transform), which version 0.3.2 of the decoder gets wrong.
///
/// # Errors
/// One line: what is wrong with the frame.
pub(super) fn lossless(bytes: &[u8], expected: Expected) -> Result<Vec<u8>, String> {
    const KIND: &str = "lossless JPEG";
    let bytes = whole(bytes)?;
    let header = lossless_header(bytes).ok_or_else(|| unreadable(KIND, "its frame header is missing"))?;
    expected.check_size(header.columns, header.rows)?;
    let width = match header.precision {
        8 => 1,
        9..=16 => 2,
        other => return Err(unreadable(KIND, format!("{other} bits"))),
    };
    if header.channels != expected.channels || width > expected.width || (header.channels > 1 && width > 1) {
        return Err(unreadable(KIND, format!("{} numbers a pixel of {} bits", header.channels, header.precision)));
    }
    if header.restart > 0 || header.shift > 0 || header.scan != header.channels {
        return Err(unreadable(KIND, "restart intervals, a point transform or several scans"));
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

/// Most tiles of a code stream, and most parts of code blocks: each takes some 100 bytes before one of them is read.
const MAX_TILES: u64 = 1 << 16;
const MAX_BLOCK_PARTS: u64 = 1 << 22;
/// Least size of a precinct, as a power of two.
const LEAST_PRECINCT: u8 = 4;

/// Checks what a code stream (ITU-T T.800 annex A) says of its size, since the decoder allocates by that alone.
///
/// # Errors
/// One line: what is not read.
fn check_code_stream(bytes: &[u8], expected: Expected) -> Result<(), String> {
    let cut = || "its headers are cut short".to_string();
    let long = |at: usize| {
        let long = bytes.get(at..at + 4).and_then(|b| b.first_chunk()).map(|b| u64::from(u32::from_be_bytes(*b)));
        long.ok_or_else(cut)
    };
    let short = |at: usize| word(bytes, at).ok_or_else(cut);
    if short(0)? != 0xff4f || short(2)? != 0xff51 {
        return Err("it is no bare code stream".into());
    }
    let size = [long(8)?.checked_sub(long(16)?), long(12)?.checked_sub(long(20)?)];
    if size != expected.size.map(|n| Some(n as u64)) {
        let [columns, rows] = size.map(Option::unwrap_or_default);
        return Err(format!("it has {columns} x {rows} pixels, not {} x {}", expected.size[0], expected.size[1]));
    }
    let channels = usize::from(short(40)?);
    if channels != expected.channels {
        return Err(format!("{channels} numbers a pixel"));
    }
    for channel in 0..channels {
        let [depth, across, down] = *bytes.get(42 + 3 * channel..45 + 3 * channel).ok_or_else(cut)? else {
            return Err(cut());
        };
        if depth & 0x80 != 0 || across != 1 || down != 1 {
            return Err("signed numbers, or channels of several sizes".into());
        }
    }
    let tiles = |end: usize, tile: usize, first: usize| -> Result<u64, String> {
        Ok(long(end)?.saturating_sub(long(first)?).div_ceil(long(tile)?.max(1)))
    };
    if tiles(8, 24, 32)?.saturating_mul(tiles(12, 28, 36)?) > MAX_TILES {
        return Err(format!("more than {MAX_TILES} tiles"));
    }
    // The main header, and that of every part of a tile.
    let (mut at, mut is_main) = (4 + usize::from(short(4)?), true);
    let pixels = (expected.size[0] * expected.size[1] * channels) as u64;
    while at + 2 < bytes.len() {
        let marker = short(at)?;
        if marker == 0xffd9 {
            break;
        }
        let length = usize::from(short(at + 2)?);
        match marker {
            // The start of a part; its length counts from here, and 0 stands for the rest.
            0xff90 => {
                is_main = false;
                let (begin, part) = (at, long(at + 6)? as usize);
                let mut inside = at + 2 + length;
                while short(inside)? != 0xff93 {
                    if matches!(short(inside)?, 0xff52 | 0xff53) {
                        return Err("tiles with a coding style of their own".into());
                    }
                    inside += 2 + usize::from(short(inside + 2)?);
                }
                at = match part {
                    0 => bytes.len(),
                    part => begin.checked_add(part.max(inside - begin)).ok_or_else(cut)?,
                };
                continue;
            }
            0xff52 if is_main => check_coding_style(bytes.get(at + 4..at + 2 + length).ok_or_else(cut)?, pixels)?,
            0xff53 => return Err("channels with a coding style of their own".into()),
            _ => {}
        }
        at += 2 + length;
    }
    Ok(())
}

/// Checks a default coding style: layers, and the sizes of code blocks and precincts, as powers of two.
fn check_coding_style(style: &[u8], pixels: u64) -> Result<(), String> {
    let [flags, _, high, low, _, _, width, height, _, _, precincts @ ..] = style else {
        return Err("its coding style is cut short".into());
    };
    let mut block = [width, height].map(|n| u32::from(n & 15) + 2);
    for precinct in precincts.iter().filter(|_| flags & 1 != 0) {
        let sides = [precinct & 15, precinct >> 4];
        if sides.iter().any(|side| *side < LEAST_PRECINCT) {
            return Err(format!("precincts of less than {} pixels", 1 << LEAST_PRECINCT));
        }
        // A precinct of a subband has half the size, and bounds its code blocks.
        block = [0, 1].map(|n| block[n].min(u32::from(sides[n]) - 1));
    }
    let layers = u64::from(u16::from_be_bytes([*high, *low]));
    match (pixels >> (block[0] + block[1])).max(1).saturating_mul(layers) > MAX_BLOCK_PARTS {
        true => Err(format!("more than {MAX_BLOCK_PARTS} parts of code blocks")),
        false => Ok(()),
    }
}

const JPEG_2000: &str = "JPEG 2000";

/// Decodes JPEG 2000, lossless or not: the bare code stream that DICOM demands, up to 16 bits unsigned, grey or three channels.
///
/// # Errors
/// One line: what is wrong with the frame.
pub(super) fn jpeg_2000(bytes: &[u8], expected: Expected) -> Result<Vec<u8>, String> {
    let bytes = whole(bytes)?;
    check_code_stream(bytes, expected).map_err(|why| unreadable(JPEG_2000, why))?;
    decoded_2000(bytes, expected)
}

#[cfg(not(feature = "jpeg2000"))]
fn decoded_2000(_: &[u8], _: Expected) -> Result<Vec<u8>, String> {
    Err(crate::left_out(JPEG_2000, "jpeg2000"))
}

/// # Errors
/// One line: what is wrong with the frame.
#[cfg(feature = "jpeg2000")]
fn decoded_2000(bytes: &[u8], expected: Expected) -> Result<Vec<u8>, String> {
    // Of what is damaged nothing is made up.
    let settings = DecodeSettings { strict: true, ..DecodeSettings::default() };
    let image = Image::new(bytes, &settings).map_err(|e| unreadable(JPEG_2000, e))?;
    expected.check_size(image.width() as usize, image.height() as usize)?;
    let mut context = DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(|e| unreadable(JPEG_2000, e))?;
    let channels = decoded.components();
    let most = if expected.width == 1 { 8 } else { 16 };
    let pixels = expected.size[0] * expected.size[1];
    let is_right = |c: &hayro_jpeg2000::ComponentData| c.bit_depth() <= most && c.samples().len() == pixels;
    if channels.len() != expected.channels || !channels.iter().all(is_right) {
        let bits = channels.first().map_or(0, |c| c.bit_depth());
        return Err(unreadable(JPEG_2000, format!("{} numbers a pixel of {bits} bits", channels.len())));
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

    /// The frame of a file of the tests, from its first marker on.
    fn frame(file: &[u8], begin: [u8; 3]) -> Vec<u8> {
        let from = file.windows(3).position(|w| w == begin).expect("a frame");
        let end = file.windows(2).rposition(|w| w == [0xff, 0xd9]).expect("an end");
        file[from..end + 2].to_vec()
    }

    const WORDS: Expected = Expected { size: [7, 6], channels: 1, width: 2 };

    #[test]
    fn headers_are_found_behind_tables() {
        let tables = [0xff, 0xd8, 0xff, 0xc4, 0, 4, 1, 2, 0xff, 0xff, 0xfe, 0, 2];
        let frame = [0xff, 0xc3, 0, 11, 12, 1, 0x2c, 0, 200, 1, 1, 0x11, 0];
        let scan = [0xff, 0xdd, 0, 4, 0, 9, 0xff, 0xda, 0, 8, 1, 1, 0, 5, 0, 3];
        let whole = [&tables[..], &frame, &scan].concat();
        let header =
            LosslessHeader { precision: 12, columns: 200, rows: 300, channels: 1, restart: 9, scan: 1, shift: 3 };
        assert_eq!(lossless_header(&whole), Some(header));
        // Another process, and headers that are cut.
        assert_eq!(lossless_header(&[&tables[..], &[0xff, 0xc0, 0, 11], &scan].concat()), None);
        assert!((0..whole.len()).all(|n| lossless_header(&whole[..n]).is_none()));
    }

    #[test]
    fn lossless_frames_that_the_decoder_gets_wrong_are_refused() {
        let good = frame(include_bytes!("../../../tests/data/dicom/image-lossless.dcm"), [0xff, 0xd8, 0xff]);
        assert_eq!(lossless(&good, WORDS).map(|numbers| numbers.len()), Ok(84));
        let scan = good.windows(2).position(|w| w == [0xff, 0xda]).expect("a scan");
        let restarts = [&good[..scan], &[0xff, 0xdd, 0, 4, 0, 7], &good[scan..]].concat();
        let mut shifted = good.clone();
        shifted[scan + 9] |= 1;
        for bad in [restarts, shifted] {
            assert!(lossless(&bad, WORDS).is_err_and(|why| why.contains("restart intervals, a point transform")));
        }
        let bits = |bits: u8| {
            let mut other = good.clone();
            let header = good.windows(2).position(|w| w == [0xff, 0xc3]).expect("a frame header");
            other[header + 4] = bits;
            lossless(&other, WORDS)
        };
        assert!(bits(7).is_err_and(|why| why.contains("7 bits")) && bits(17).is_err());
    }

    #[cfg(feature = "jpeg2000")]
    #[test]
    fn code_streams_that_ask_for_more_than_they_hold_are_refused() {
        let good = frame(include_bytes!("../../../tests/data/dicom/image-j2k.dcm"), [0xff, 0x4f, 0xff]);
        assert_eq!(jpeg_2000(&good, WORDS).map(|numbers| numbers.len()), Ok(84));
        let with = |changes: &[(usize, &[u8])]| {
            let mut bad = good.clone();
            changes.iter().for_each(|(at, bytes)| bad[*at..at + bytes.len()].copy_from_slice(bytes));
            jpeg_2000(&bad, WORDS).expect_err("refused")
        };
        assert!(with(&[(43, &[255])]).contains("several sizes"));
        assert!(with(&[(42, &[0x8f])]).contains("signed"));
        assert!(with(&[(40, &[0, 255])]).contains("255 numbers"));
        assert!(with(&[(8, &[0, 0, 0xff, 0xff])]).contains("65535 x 6"));
        // The same size far from the origin, in tiles of one pixel from there on.
        let far = [0x7f, 0xff, 0, 0];
        let far_end = [0x7f, 0xff, 0, 7];
        let tiles = with(&[(8, &far_end), (16, &far), (24, &[0, 0, 0, 1]), (28, &[0, 0, 0, 1])]);
        assert!(tiles.contains("more than 65536 tiles"), "{tiles}");
        assert!(with(&[(0, &[0, 0])]).contains("no bare code stream"));
        let style = good.windows(2).position(|w| w == [0xff, 0x52]).expect("a coding style");
        assert!(with(&[(style + 1, &[0x53])]).contains("of their own"));
        assert!(check_coding_style(&[0, 0, 0, 1, 0, 5, 4, 4, 0, 1], 1 << 26).is_ok());
        for (wrong, why) in [
            (&[0, 0, 0xff, 0xff, 0, 5, 4, 4, 0, 1][..], "parts of code blocks"),
            (&[0, 0, 0, 2, 0, 0, 0, 0, 0, 1], "parts of code blocks"),
            (&[1, 0, 0, 1, 0, 0, 4, 4, 0, 1, 0], "less than 16 pixels"),
            (&[1, 0, 0, 1, 0], "cut short"),
        ] {
            assert!(check_coding_style(wrong, 1 << 26).is_err_and(|e| e.contains(why)), "{wrong:?}");
        }
    }

    #[test]
    fn padding_behind_the_end_mark_is_no_part_of_a_frame() {
        let good = [0xff, 0xd8, 7, 0xff, 0xd9];
        for padding in [&[][..], &[0], &[0xff], &[0xff, 0xff, 0xff], &[0, 0xff, 0, 0]] {
            assert_eq!(whole(&[&good[..], padding].concat()), Ok(&good[..]), "{padding:?}");
            assert!(has_end(&[&good[..], padding].concat()) && has_end(padding));
        }
        for between in [&[][..], &[0, 0], &[0xff, 0xff, 0xff]] {
            let two = [&good[..], between, &good].concat();
            assert!(whole(&two).is_err_and(|why| why.contains("several pictures")), "{between:?}");
        }
        assert!(whole(&[0xff, 0xd9, 7]).is_err() && whole(&[0xd9, 0xff]).is_err() && whole(&[]).is_err());
        assert!(!has_end(&[0xff, 0xd9, 7]) && !has_end(&[7, 0xd9]) && has_end(&[0xd9, 0]));
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
