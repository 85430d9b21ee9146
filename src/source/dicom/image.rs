//! What a DICOM file says of its pixels, and where each frame of them is.

use super::super::packed::Encoding;
use super::super::pixel::{Number, PixelFormat};
use super::classes::{Coding, syntax};
use super::elements::{Elements, Fragment, Item, PixelData};
use super::fragments::{Divided, Stream, divided};
use super::palette::{Indices, Palette, Tables};
use super::tags::{self, Tag};
use crate::files::{InputError, quoted};
use std::collections::BTreeSet;
use std::path::Path;

/// Most frames of a file.
const MAX_FRAMES: u64 = 1 << 20;
/// Most bytes of a frame.
const MAX_FRAME_BYTES: u64 = 1 << 30;
/// The same of lossless JPEG, whose decoder takes 7 bytes for each number, and of JPEG 2000, whose decoder takes some 30 bytes for each number.
const MAX_LOSSLESS_BYTES: u64 = 1 << 28;
const MAX_JPEG_2000_BYTES: u64 = 1 << 26;

/// How the numbers of a decompressed frame are arranged.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Arrangement {
    /// Pixel by pixel, in the channels that are read.
    Plain,
    /// Plane by plane: all of the first channel, then all of the next.
    Planes,
    /// Luminance and two colour differences for each pixel, of which the luminance is read.
    Luma,
    /// Luminance and two colour differences, plane by plane, of which the luminance is read.
    LumaPlane,
    /// For each pair of pixels two luminances and two shared colour differences; the luminances are read.
    LumaPairs,
    /// Indices into a palette, which are read as the luminance of their colours.
    Palette(Palette),
}

/// Where the bytes of a frame are: a file, and a range of [`Image::parts`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub file: usize,
    /// Index of the frame's first part in the list of parts; `count` is their number.
    pub first: usize,
    pub count: usize,
    /// True if the frame begins at an odd number of bytes from the first frame, so that in words of 16 bits it begins with the second byte of a
    /// word.
    pub odd: bool,
}

/// The pixels of one or more DICOM files: their size, coding and location.
pub(super) struct Image {
    /// Columns and rows of a picture.
    pub size: [usize; 2],
    pub pixel: PixelFormat,
    pub coding: Coding,
    pub arrangement: Arrangement,
    /// Where the bytes of each frame are, in the order of the file, or in that of reading once the frames are sorted.
    pub places: Vec<Place>,
    /// Offset and length, bytes, of each fragment, or of each uncompressed frame.
    pub parts: Vec<(u64, u64)>,
    /// True if uncompressed bytes are in big-endian words of 16 bits, so that the second byte of a word is the first pixel.
    pub swapped: bool,
    /// One line for each statement of the file that is wrong or missing.
    pub warnings: BTreeSet<String>,
}

impl Image {
    /// Reads how the pixels of a file are stored. `slices`: number of pictures, one after another, that each of the stated number of frames may
    /// consist of.
    ///
    /// # Errors
    /// The pixels are missing, cut short, too large or of a kind that is not read, or what the file states of them is invalid or incomplete.
    pub fn of(path: &Path, elements: &Elements, slices: u32) -> Result<Image, InputError> {
        let fault = |field: &str, fault: String| Err(InputError::new(path, field, fault));
        let root = &elements.root;
        let (name, coding) = syntax(&elements.syntax);
        let Some(coding) = coding else {
            let uid = quoted(&elements.syntax);
            let why = format!("{name} ({uid}) is not read: uncompressed, RLE, JPEG and JPEG 2000 are");
            return fault("transfer syntax", why);
        };
        let side = |field: &str, tag| match root.word(tag) {
            Some(n @ 1..) => Ok(usize::from(n)),
            Some(0) => Err(InputError::new(path, field, "is 0, must be at least 1")),
            None => Err(InputError::new(path, field, "is missing")),
        };
        let size = [side("columns (0028,0011)", tags::COLUMNS)?, side("rows (0028,0010)", tags::ROWS)?];
        let stated = match root.text(tags::FRAMES).as_str() {
            "" => None,
            text => match text.parse() {
                Ok(n @ 1..=MAX_FRAMES) => Some(n),
                _ => return fault("frames (0028,0008)", format!("{} is not 1 to {MAX_FRAMES}", quoted(text))),
            },
        };
        let Some(pixels) = &elements.pixels else { return fault("pixel data (7FE0,0010)", "is missing".into()) };
        let mut format = Format::of(path, elements, coding)?;
        if let PixelData::Native(_, length, _) = pixels {
            format.find_full(size, stated.unwrap_or(1), *length);
        }
        if format.arrangement == Arrangement::LumaPairs && format.planar {
            return fault("planar configuration (0028,0006)", "is 1, must be 0 for YBR_FULL_422".into());
        }
        if format.arrangement == Arrangement::LumaPairs && !size[0].is_multiple_of(2) {
            return fault("columns (0028,0011)", "must be even for colours that two pixels share".into());
        }
        let each = size[0] as u64 * size[1] as u64 * format.stored as u64;
        let most = match coding {
            Coding::Jpeg2000 => MAX_JPEG_2000_BYTES,
            Coding::JpegLossless => MAX_LOSSLESS_BYTES,
            _ => MAX_FRAME_BYTES,
        };
        if each > most {
            return fault("rows and columns", format!("make frames of {each} bytes, at most {most} are read"));
        }
        let Format { pixel, arrangement, mut warnings, .. } = format;
        let frames = StatedFrames { stated, slices: slices.into(), each };
        let mut swapped = false;
        let (places, parts) = match (coding, pixels) {
            (Coding::Native, PixelData::Native(offset, length, in_words)) => {
                let allocated = root.word(tags::BITS_ALLOCATED);
                if *in_words && elements.big_endian && allocated == Some(32) {
                    let why = "is 32 in big-endian words of 16 bits (OW): which word comes first is not certain";
                    return fault("bits allocated (0028,0100)", why.into());
                }
                swapped = *in_words && elements.big_endian && allocated == Some(8);
                let found = frames.native(*offset, *length, swapped, &mut warnings);
                found.map_err(|why| InputError::new(path, "data", why))?
            }
            (_, PixelData::Encapsulated(table, fragments)) if coding != Coding::Native => {
                let table = offsets(table, root);
                let found = frames.encapsulated(coding, &table, fragments, &mut warnings);
                found.map_err(|why| InputError::new(path, "pixel data (7FE0,0010)", why))?
            }
            _ => return fault("pixel data (7FE0,0010)", format!("is not in the form of {name}")),
        };
        Ok(Image { size, pixel, coding, arrangement, places, parts, swapped, warnings })
    }
}

/// The offsets of frames: the basic table, otherwise the extended one.
fn offsets(basic: &[u32], root: &Item) -> Vec<u64> {
    match basic.is_empty() {
        true => root.offsets(tags::EXTENDED_TABLE),
        false => basic.iter().map(|offset| u64::from(*offset)).collect(),
    }
}

type Places = (Vec<Place>, Vec<(u64, u64)>);

/// What a file says of the number of its frames.
struct StatedFrames {
    stated: Option<u64>,
    /// Pictures that each stated frame may have.
    slices: u64,
    /// Bytes of one that is not compressed.
    each: u64,
}

impl StatedFrames {
    /// Where uncompressed frames are, in pixel data of `length` bytes.
    ///
    /// # Errors
    /// One line: pixel data that are cut short.
    fn native(
        &self,
        offset: u64,
        length: u64,
        in_words: bool,
        warnings: &mut BTreeSet<String>,
    ) -> Result<Places, String> {
        let StatedFrames { stated, slices, each } = *self;
        let all = stated.unwrap_or(1).saturating_mul(slices);
        let (there, rest) = (length / each, length % each);
        let frames = match stated {
            _ if slices > 1 && all <= MAX_FRAMES && all <= there => all,
            // A byte may make the length even.
            None if (2..=MAX_FRAMES).contains(&there) && (rest == 0 || (rest == 1 && length.is_multiple_of(2))) => {
                let text = "frames (0028,0008) is missing; there are";
                warnings.insert(format!("{text} {there} frames in the pixel data, all are read"));
                there
            }
            stated => stated.unwrap_or(1),
        };
        let claimed = each.saturating_mul(frames);
        let claimed = if in_words { claimed.next_multiple_of(2) } else { claimed };
        if claimed > length {
            return Err(format!("cut short, {length} of {claimed} bytes are there"));
        }
        if length > claimed.next_multiple_of(2) {
            let text = format!("{frames} frames (0028,0008) have {claimed} bytes, but {length} are there");
            warnings.insert(format!("pixel data (7FE0,0010) is longer than stated: {text}; the rest is not read"));
        }
        let parts = (0..frames).map(|n| (offset + n * each, each)).collect();
        let place = |n: u64| Place { file: 0, first: n as usize, count: 1, odd: !(n * each).is_multiple_of(2) };
        Ok(((0..frames).map(place).collect(), parts))
    }

    /// Where compressed frames are.
    ///
    /// # Errors
    /// One line: fragments that nothing divides, or that are too small.
    fn encapsulated(
        &self,
        coding: Coding,
        table: &[u64],
        fragments: &[Fragment],
        warnings: &mut BTreeSet<String>,
    ) -> Result<Places, String> {
        let stated = self.stated.or((self.slices > 1).then_some(1));
        let pictures = stated.filter(|_| self.slices > 1).map(|n| n.saturating_mul(self.slices));
        let numbers: Vec<usize> = pictures.into_iter().chain(stated).filter_map(|n| usize::try_from(n).ok()).collect();
        let there = fragments.iter().fold(0u64, |all, fragment| all.saturating_add(fragment.length));
        let most = there.saturating_mul(Encoding::Dicom(coding).most()).saturating_add(1024);
        let check = |frames: u64| match self.each.saturating_mul(frames) {
            claimed if claimed > most => Err(format!("{there} compressed bytes cannot hold {claimed} bytes of frames")),
            _ => Ok(()),
        };
        check(stated.unwrap_or(1))?;
        let found = divided(&numbers, table, fragments, stream(coding, fragments))?;
        let Divided { frames, warnings: said } = found;
        check(frames.len() as u64)?;
        if frames.len() as u64 > MAX_FRAMES {
            return Err(format!("has {} frames, at most {MAX_FRAMES} are read", frames.len()));
        }
        warnings.extend(said);
        if coding == Coding::Rle && frames.len() < fragments.len() {
            warnings.insert("frames of RLE are in several fragments each, which the standard forbids".into());
        }
        let places = frames.into_iter().map(|(first, count)| Place { file: 0, first, count, odd: false }).collect();
        Ok((places, fragments.iter().map(|fragment| (fragment.at, fragment.length)).collect()))
    }
}

/// What a frame begins with. Of RLE these are the number of segments, which is the same in all, and the offset of the first one.
fn stream(coding: Coding, fragments: &[Fragment]) -> Stream<'_> {
    match coding {
        Coding::Jpeg2000 => Stream { start: &[0xff, 0x4f, 0xff, 0x51], has_end: true },
        Coding::Rle => Stream { start: fragments.first().map_or(&[], |first| &first.head), has_end: false },
        _ => Stream { start: &[0xff, 0xd8, 0xff], has_end: true },
    }
}

const JPEG_2000_LOSSLESS: &str = "1.2.840.10008.1.2.4.90";

/// How pixels are read.
struct Format {
    pixel: PixelFormat,
    arrangement: Arrangement,
    /// Bytes of a pixel in the file.
    stored: usize,
    /// Plane by plane.
    planar: bool,
    warnings: BTreeSet<String>,
}

impl Format {
    /// What the elements say of the pixels.
    ///
    /// # Errors
    /// Pixels of a kind that is not read, a palette that is not whole.
    fn of(path: &Path, elements: &Elements, coding: Coding) -> Result<Format, InputError> {
        let fault = |field: &str, fault: String| InputError::new(path, field, fault);
        let root = &elements.root;
        let samples = root.word(tags::SAMPLES).unwrap_or(1);
        let photometric = root.text(tags::PHOTOMETRIC);
        let is_palette = photometric == "PALETTE COLOR";
        let (number, stored_bits) = number(path, root, coding, is_palette)?;
        let mut warnings = BTreeSet::new();
        let planar = coding == Coding::Native && samples > 1 && is_planar(path, root, &photometric, &mut warnings)?;
        let (slope, intercept) =
            (root.decimal(tags::SLOPE).unwrap_or(1.0), root.decimal(tags::INTERCEPT).unwrap_or(0.0));
        let mut scale = [slope, intercept];
        // What is decompressed is in little-endian order.
        let big_endian = elements.big_endian && coding == Coding::Native;
        let is_exact = coding != Coding::Jpeg && (coding != Coding::Jpeg2000 || elements.syntax == JPEG_2000_LOSSLESS);
        let (channels, arrangement, stored) = match (photometric.as_str(), samples, coding) {
            ("MONOCHROME2", 1, _) => (1, Arrangement::Plain, 1),
            ("MONOCHROME1", 1, _) => {
                let most = f64::from(stored_bits).exp2() - 1.0;
                scale = [-slope, slope * most + intercept];
                (1, Arrangement::Plain, 1)
            }
            ("PALETTE COLOR", 1, _) if number.bytes() <= 2 && is_exact => {
                let signed = matches!(number, Number::I8 | Number::I16);
                let numbers = Indices { width: number.bytes(), bits: stored_bits.into(), signed, big_endian };
                let read = |tags: [Tag; 3]| tags.map(|tag| root.words(tag));
                let tables = Tables {
                    about: read(tags::PALETTE_ABOUT),
                    plain: read(tags::PALETTE),
                    segmented: read(tags::SEGMENTED_PALETTE),
                };
                let (palette, said) = Palette::of(&tables, numbers).map_err(|why| fault("palette (0028,1101)", why))?;
                warnings.extend(said);
                (1, Arrangement::Palette(palette), 1)
            }
            ("RGB" | "YBR_FULL" | "YBR_FULL_422", 3, Coding::Jpeg) => (3, Arrangement::Plain, 3),
            // The decoder undoes the transform of the colours.
            ("YBR_RCT" | "YBR_ICT", 3, Coding::Jpeg2000) => (3, Arrangement::Plain, 3),
            ("RGB", 3, _) if planar => (3, Arrangement::Planes, 3),
            ("RGB", 3, _) => (3, Arrangement::Plain, 3),
            ("YBR_FULL", 3, _) if number == Number::U8 && planar => (1, Arrangement::LumaPlane, 3),
            ("YBR_FULL", 3, _) if number == Number::U8 => (1, Arrangement::Luma, 3),
            ("YBR_FULL_422", 3, Coding::Native) if number == Number::U8 => (1, Arrangement::LumaPairs, 2),
            _ => {
                let why = format!("{} of {samples} numbers is not read", quoted(&photometric));
                return Err(fault("photometric interpretation (0028,0004)", why));
            }
        };
        let is_scaled = scale != [1.0, 0.0] && scale.iter().all(|v| v.is_finite()) && scale[0] != 0.0;
        let stored = stored * number.bytes();
        let (number, big_endian) = if is_palette { (Number::U8, false) } else { (number, big_endian) };
        let pixel = PixelFormat { number, channels, big_endian, scale: is_scaled.then_some(scale) };
        Ok(Format { pixel, arrangement, stored, planar, warnings })
    }

    /// Some files say that two pixels share their colours, but store three bytes for each: the length of the pixel data tells.
    fn find_full(&mut self, size: [usize; 2], frames: u64, length: u64) {
        if self.arrangement != Arrangement::LumaPairs {
            return;
        }
        let full = (size[0] as u64 * size[1] as u64 * 3).saturating_mul(frames);
        if length != full && length != full.saturating_add(full % 2) {
            return;
        }
        self.arrangement = if self.planar { Arrangement::LumaPlane } else { Arrangement::Luma };
        self.stored = 3;
        let text = "photometric interpretation (0028,0004) is YBR_FULL_422, but three bytes a pixel are stored";
        self.warnings.insert(format!("{text}; read as YBR_FULL"));
    }
}

/// The numbers of a file, and how many of their bits count.
///
/// # Errors
/// Numbers of a width that is not read, or bits that are not the lowest ones.
fn number(path: &Path, root: &Item, coding: Coding, is_palette: bool) -> Result<(Number, u16), InputError> {
    let fault = |field: &str, fault: String| Err(InputError::new(path, field, fault));
    let bits = root.word(tags::BITS_ALLOCATED).unwrap_or(0);
    let stored = root.word(tags::BITS_STORED).unwrap_or(bits);
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
    let high = root.word(tags::HIGH_BIT).unwrap_or(stored.saturating_sub(1));
    let is_lowest = stored > 0 && stored <= bits && high.checked_add(1) == Some(stored);
    // A sign is found among fewer bits only where they are indices.
    if !is_lowest || (signed && stored != bits && !is_palette) {
        return fault("bits stored (0028,0101)", format!("{stored} of {bits}, up to bit {high}, are not read"));
    }
    let (most, name) = match coding {
        Coding::Native | Coding::Rle => (32, ""),
        Coding::Jpeg => (8, "JPEG, 8"),
        Coding::JpegLossless => (16, "lossless JPEG, 8 and 16"),
        Coding::Jpeg2000 => (16, "JPEG 2000, 8 and 16"),
    };
    match bits > most {
        true => fault("bits allocated (0028,0100)", format!("is {bits}: of {name} are read")),
        false => Ok((number, stored)),
    }
}

/// True if native colours stand plane by plane.
///
/// # Errors
/// An order that the standard does not know.
fn is_planar(path: &Path, root: &Item, photometric: &str, warnings: &mut BTreeSet<String>) -> Result<bool, InputError> {
    const FIELD: &str = "planar configuration (0028,0006)";
    match root.word(tags::PLANAR) {
        Some(order @ 0..=1) => Ok(order == 1),
        Some(other) => Err(InputError::new(path, FIELD, format!("is {other}, must be 0 or 1"))),
        // Pairs of pixels have but one order.
        None if photometric == "YBR_FULL_422" => Ok(false),
        None => {
            warnings.insert(format!("{FIELD} is missing; the colours are taken pixel by pixel"));
            Ok(false)
        }
    }
}
