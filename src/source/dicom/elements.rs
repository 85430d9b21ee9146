//! The elements of a DICOM file (PS3.5, PS3.10): preamble, file meta information, then tags with values and nested items.
//!
//! Only the elements of [`WANTED`] are kept: all others, and so everything that tells who the patient is, are skipped unread. The place of
//! pixel data is kept, not the data. A false length is an error before anything is allocated for it.

use super::super::packed::{InputFile, PixelStream};
use super::jpeg::has_end;
use crate::files::InputError;
use std::io::Read;

/// Group in the upper half, element in the lower one.
pub(super) type Tag = u32;

/// What the value of an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Text,
    /// Binary numbers of so many bytes.
    Numbers(usize),
    Sequence,
}

pub(super) const SOP_CLASS: Tag = 0x0008_0016;
pub(super) const MODALITY: Tag = 0x0008_0060;
pub(super) const MANUFACTURER: Tag = 0x0008_0070;
pub(super) const MODEL: Tag = 0x0008_1090;
pub(super) const SLICE_THICKNESS: Tag = 0x0018_0050;
pub(super) const SPACING_BETWEEN_SLICES: Tag = 0x0018_0088;
pub(super) const FRAME_TIME: Tag = 0x0018_1063;
pub(super) const FRAME_TIME_VECTOR: Tag = 0x0018_1065;
pub(super) const SLICE_LOCATIONS: Tag = 0x0018_2005;
pub(super) const REGIONS: Tag = 0x0018_6011;
pub(super) const REGION_FORMAT: Tag = 0x0018_6012;
pub(super) const REGION_TYPE: Tag = 0x0018_6014;
pub(super) const REGION_BOX: [Tag; 4] = [0x0018_6018, 0x0018_601a, 0x0018_601c, 0x0018_601e];
pub(super) const REFERENCE_PIXEL: [Tag; 2] = [0x0018_6020, 0x0018_6022];
pub(super) const UNITS: [Tag; 2] = [0x0018_6024, 0x0018_6026];
pub(super) const REFERENCE_VALUE: [Tag; 2] = [0x0018_6028, 0x0018_602a];
pub(super) const DELTA: [Tag; 2] = [0x0018_602c, 0x0018_602e];
pub(super) const DATA_TYPES: Tag = 0x0018_9807;
pub(super) const DATA_TYPE: Tag = 0x0018_9808;
pub(super) const SERIES: Tag = 0x0020_000e;
pub(super) const INSTANCE_NUMBER: Tag = 0x0020_0013;
pub(super) const POSITION_PATIENT: Tag = 0x0020_0032;
pub(super) const ORIENTATION_PATIENT: Tag = 0x0020_0037;
pub(super) const FRAME_CONTENT: Tag = 0x0020_9111;
pub(super) const PLANE_POSITION: Tag = 0x0020_9113;
pub(super) const PLANE_ORIENTATION: Tag = 0x0020_9116;
pub(super) const TEMPORAL_INDEX: Tag = 0x0020_9128;
pub(super) const POSITION_VOLUME: Tag = 0x0020_9301;
pub(super) const ORIENTATION_VOLUME: Tag = 0x0020_9302;
pub(super) const APEX: Tag = 0x0020_9308;
pub(super) const TO_TRANSDUCER: Tag = 0x0020_9309;
pub(super) const TIME_OFFSET: Tag = 0x0020_930d;
pub(super) const PLANE_POSITION_VOLUME: Tag = 0x0020_930e;
pub(super) const PLANE_ORIENTATION_VOLUME: Tag = 0x0020_930f;
pub(super) const TEMPORAL_POSITION: Tag = 0x0020_9310;
pub(super) const SAMPLES: Tag = 0x0028_0002;
pub(super) const PHOTOMETRIC: Tag = 0x0028_0004;
pub(super) const PLANAR: Tag = 0x0028_0006;
pub(super) const FRAMES: Tag = 0x0028_0008;
pub(super) const FRAME_POINTER: Tag = 0x0028_0009;
pub(super) const ROWS: Tag = 0x0028_0010;
pub(super) const COLUMNS: Tag = 0x0028_0011;
pub(super) const PIXEL_SPACING: Tag = 0x0028_0030;
pub(super) const BITS_ALLOCATED: Tag = 0x0028_0100;
pub(super) const BITS_STORED: Tag = 0x0028_0101;
pub(super) const HIGH_BIT: Tag = 0x0028_0102;
pub(super) const IS_SIGNED: Tag = 0x0028_0103;
pub(super) const INTERCEPT: Tag = 0x0028_1052;
pub(super) const SLOPE: Tag = 0x0028_1053;
pub(super) const PALETTE_ABOUT: [Tag; 3] = [0x0028_1101, 0x0028_1102, 0x0028_1103];
pub(super) const PALETTE: [Tag; 3] = [0x0028_1201, 0x0028_1202, 0x0028_1203];
pub(super) const SEGMENTED_PALETTE: [Tag; 3] = [0x0028_1221, 0x0028_1222, 0x0028_1223];
pub(super) const PIXEL_MEASURES: Tag = 0x0028_9110;
/// Philips' Cartesian volumes: the creator, slices, unit and spacing of the third axis, as public readers know them.
pub(super) const PHILIPS: Tag = 0x3001_0010;
pub(super) const PHILIPS_SLICES: Tag = 0x3001_1001;
pub(super) const PHILIPS_UNIT: Tag = 0x3001_1002;
pub(super) const PHILIPS_DELTA: Tag = 0x3001_1003;
pub(super) const SHARED_GROUPS: Tag = 0x5200_9229;
pub(super) const FRAME_GROUPS: Tag = 0x5200_9230;
pub(super) const EXTENDED_TABLE: Tag = 0x7fe0_0001;
const PIXEL_DATA: Tag = 0x7fe0_0010;
const META_LENGTH: Tag = 0x0002_0000;
const META_CLASS: Tag = 0x0002_0002;
const META_SYNTAX: Tag = 0x0002_0010;
const ITEM: Tag = 0xfffe_e000;
const ITEM_END: Tag = 0xfffe_e00d;
const SEQUENCE_END: Tag = 0xfffe_e0dd;
/// The group of GE's private elements that hold a Kretz file, and the creator that reserves a block of it.
const KRETZ_GROUP: u32 = 0x7fe1;
const KRETZ_CREATOR: &str = "KRETZ_US";

const WORDS: Kind = Kind::Numbers(2);
const LONGS: Kind = Kind::Numbers(4);
const REALS: Kind = Kind::Numbers(8);

/// The elements that are kept.
const WANTED: &[(Tag, Kind)] = &[
    (META_LENGTH, LONGS),
    (META_CLASS, Kind::Text),
    (META_SYNTAX, Kind::Text),
    (SOP_CLASS, Kind::Text),
    (MODALITY, Kind::Text),
    (MANUFACTURER, Kind::Text),
    (MODEL, Kind::Text),
    (SLICE_THICKNESS, Kind::Text),
    (SPACING_BETWEEN_SLICES, Kind::Text),
    (FRAME_TIME, Kind::Text),
    (FRAME_TIME_VECTOR, Kind::Text),
    (SLICE_LOCATIONS, Kind::Text),
    (REGIONS, Kind::Sequence),
    (REGION_FORMAT, WORDS),
    (REGION_TYPE, WORDS),
    (REGION_BOX[0], LONGS),
    (REGION_BOX[1], LONGS),
    (REGION_BOX[2], LONGS),
    (REGION_BOX[3], LONGS),
    (REFERENCE_PIXEL[0], LONGS),
    (REFERENCE_PIXEL[1], LONGS),
    (UNITS[0], WORDS),
    (UNITS[1], WORDS),
    (REFERENCE_VALUE[0], REALS),
    (REFERENCE_VALUE[1], REALS),
    (DELTA[0], REALS),
    (DELTA[1], REALS),
    (DATA_TYPES, Kind::Sequence),
    (DATA_TYPE, Kind::Text),
    (SERIES, Kind::Text),
    (INSTANCE_NUMBER, Kind::Text),
    (POSITION_PATIENT, Kind::Text),
    (ORIENTATION_PATIENT, Kind::Text),
    (FRAME_CONTENT, Kind::Sequence),
    (PLANE_POSITION, Kind::Sequence),
    (PLANE_ORIENTATION, Kind::Sequence),
    (TEMPORAL_INDEX, LONGS),
    (POSITION_VOLUME, REALS),
    (ORIENTATION_VOLUME, REALS),
    (APEX, REALS),
    (TO_TRANSDUCER, REALS),
    (TIME_OFFSET, REALS),
    (PLANE_POSITION_VOLUME, Kind::Sequence),
    (PLANE_ORIENTATION_VOLUME, Kind::Sequence),
    (TEMPORAL_POSITION, Kind::Sequence),
    (SAMPLES, WORDS),
    (PHOTOMETRIC, Kind::Text),
    (PLANAR, WORDS),
    (FRAMES, Kind::Text),
    (FRAME_POINTER, WORDS),
    (ROWS, WORDS),
    (COLUMNS, WORDS),
    (PIXEL_SPACING, Kind::Text),
    (BITS_ALLOCATED, WORDS),
    (BITS_STORED, WORDS),
    (HIGH_BIT, WORDS),
    (IS_SIGNED, WORDS),
    (INTERCEPT, Kind::Text),
    (SLOPE, Kind::Text),
    (PALETTE_ABOUT[0], WORDS),
    (PALETTE_ABOUT[1], WORDS),
    (PALETTE_ABOUT[2], WORDS),
    (PALETTE[0], WORDS),
    (PALETTE[1], WORDS),
    (PALETTE[2], WORDS),
    (SEGMENTED_PALETTE[0], WORDS),
    (SEGMENTED_PALETTE[1], WORDS),
    (SEGMENTED_PALETTE[2], WORDS),
    (PIXEL_MEASURES, Kind::Sequence),
    (PHILIPS, Kind::Text),
    (PHILIPS_SLICES, LONGS),
    (PHILIPS_UNIT, WORDS),
    (PHILIPS_DELTA, REALS),
    (SHARED_GROUPS, Kind::Sequence),
    (FRAME_GROUPS, Kind::Sequence),
    (EXTENDED_TABLE, REALS),
];

/// Longest value that is kept: a palette of 65536 words, or a time for each of as many frames.
const MAX_VALUE: u64 = 1 << 20;
/// Most elements: some thirty for each of 65536 frames.
const MAX_ELEMENTS: usize = 1 << 22;
/// Most items within items. Real files have about five.
const MAX_DEPTH: usize = 16;
/// The pixels, for messages.
const FIELD: &str = "pixel data (7FE0,0010)";
/// Bytes at the end of a fragment in which an end mark is looked for.
const TAIL: u64 = 32;
/// A length that is not stated: the end has a mark.
const UNDEFINED: u32 = u32::MAX;

/// The elements of a file or of an item of a sequence.
#[derive(Debug, Default)]
pub(super) struct Item {
    elements: Vec<(Tag, Value)>,
}

#[derive(Debug)]
enum Value {
    /// Numbers are little-endian.
    Bytes(Vec<u8>),
    Items(Vec<Item>),
}

impl Item {
    fn bytes(&self, tag: Tag) -> Option<&[u8]> {
        self.elements.iter().find(|(there, _)| *there == tag).and_then(|(_, value)| match value {
            Value::Bytes(bytes) => Some(&bytes[..]),
            Value::Items(_) => None,
        })
    }

    /// The items of a sequence; none if it is absent.
    pub fn items(&self, tag: Tag) -> &[Item] {
        self.elements
            .iter()
            .find(|(there, _)| *there == tag)
            .and_then(|(_, value)| match value {
                Value::Items(items) => Some(&items[..]),
                Value::Bytes(_) => None,
            })
            .unwrap_or_default()
    }

    /// Text without the spaces and zeros around it; empty if it is absent.
    pub fn text(&self, tag: Tag) -> String {
        let text = String::from_utf8_lossy(self.bytes(tag).unwrap_or_default());
        text.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_string()
    }

    /// Decimal numbers that stand as text; none if one of them is no number.
    pub fn decimals(&self, tag: Tag) -> Vec<f64> {
        let text = self.text(tag);
        let words = text.split('\\').filter(|word| !word.trim().is_empty());
        words.map(|word| word.trim().parse().ok()).collect::<Option<Vec<f64>>>().unwrap_or_default()
    }

    pub fn decimal(&self, tag: Tag) -> Option<f64> {
        self.decimals(tag).first().copied().filter(|value| value.is_finite())
    }

    pub fn words(&self, tag: Tag) -> Vec<u16> {
        self.bytes(tag).unwrap_or_default().as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect()
    }

    pub fn word(&self, tag: Tag) -> Option<u16> {
        self.words(tag).first().copied()
    }

    pub fn long(&self, tag: Tag) -> Option<u32> {
        self.bytes(tag)?.first_chunk().map(|b| u32::from_le_bytes(*b))
    }

    pub(crate) fn reals(&self, tag: Tag) -> Vec<f64> {
        self.bytes(tag).unwrap_or_default().as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect()
    }

    pub fn real(&self, tag: Tag) -> Option<f64> {
        self.reals(tag).first().copied().filter(|value| value.is_finite())
    }

    /// Whole numbers of 64 bits.
    pub(crate) fn offsets(&self, tag: Tag) -> Vec<u64> {
        self.bytes(tag).unwrap_or_default().as_chunks::<8>().0.iter().map(|b| u64::from_le_bytes(*b)).collect()
    }
}

/// Where the pixels are in the file: offset and length, bytes.
#[derive(Debug)]
pub(super) enum PixelData {
    /// The last one says that they stand in words of 16 bits (OW).
    Native(u64, u64, bool),
    /// The offsets of frames as the first item states them, and the fragments after it.
    Encapsulated(Vec<u32>, Vec<Fragment>),
}

/// A piece of compressed pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fragment {
    /// Offset in the file and length, bytes.
    pub at: u64,
    pub length: u64,
    /// Its first bytes, and zeros if there are fewer.
    pub head: [u8; 8],
    /// The end mark of a JPEG or JPEG 2000 is in it, with nothing but padding behind it.
    pub ends: bool,
}

/// What was found in a file.
#[derive(Debug)]
pub(super) struct Elements {
    /// UID of the transfer syntax.
    pub syntax: String,
    /// UID of the class, of the file meta information.
    pub class: String,
    pub big_endian: bool,
    pub root: Item,
    pub pixels: Option<PixelData>,
    /// Offset and length of a Kretz file inside.
    pub kretz: Option<(u64, u64)>,
}

/// True if a file begins like this.
pub(in super::super) fn is_one(start: &[u8]) -> bool {
    start.get(128..132) == Some(b"DICM")
}

impl Elements {
    /// Reads a file up to its end, without its pixels.
    ///
    /// # Errors
    /// A file that cannot be read, is cut short, or whose elements contradict each other; a compressed data set.
    pub fn read(file: &InputFile) -> Result<Elements, InputError> {
        let input = file.open().map_err(|e| InputError::unreadable(file.path, &e))?;
        let mut walk = Walk {
            file,
            input,
            at: 0,
            end: file.most_bytes(),
            explicit: true,
            big_endian: false,
            count: 0,
            pixels: None,
            creators: Vec::new(),
            kretz: None,
        };
        walk.skip(132, "preamble")?;
        let meta = walk.meta()?;
        let syntax = meta.text(META_SYNTAX);
        match syntax.as_str() {
            "1.2.840.10008.1.2" => walk.explicit = false,
            "1.2.840.10008.1.2.2" => walk.big_endian = true,
            "1.2.840.10008.1.2.1.99" => {
                return walk.fault("transfer syntax", "is deflated (1.2.840.10008.1.2.1.99), which is not read");
            }
            "" => return walk.fault("transfer syntax", "(0002,0010) is missing"),
            _ => {}
        }
        let mut root = Item::default();
        match walk.elements(None, 0, true, &mut root) {
            // What follows the pixels is padding, unless a volume may be in it.
            Err(_) if walk.pixels.is_some() && walk.creators.is_empty() => {}
            other => other?,
        }
        let Walk { pixels, kretz, big_endian, .. } = walk;
        Ok(Elements { syntax, class: meta.text(META_CLASS), big_endian, root, pixels, kretz })
    }
}

/// The head of an element.
struct Head {
    tag: Tag,
    vr: [u8; 2],
    length: u32,
}

struct Walk<'a> {
    file: &'a InputFile<'a>,
    input: PixelStream,
    /// Offset of the next byte.
    at: u64,
    /// Length of the file; the most that it can be for one that is packed.
    end: u64,
    explicit: bool,
    big_endian: bool,
    count: usize,
    pixels: Option<PixelData>,
    /// Blocks of private elements that hold Kretz files.
    creators: Vec<u32>,
    kretz: Option<(u64, u64)>,
}

/// A tag as the standard writes it.
fn name(tag: Tag) -> String {
    format!("({:04X},{:04X})", tag >> 16, tag & 0xffff)
}

impl Walk<'_> {
    fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.file.path, field, fault))
    }

    /// Exactly so many bytes; None at the end of the file if there is not even one.
    fn take<const N: usize>(&mut self, field: &str) -> Result<Option<[u8; N]>, InputError> {
        let mut bytes = [0; N];
        let mut got = 0;
        while got < N {
            match self.input.read(&mut bytes[got..]) {
                Ok(0) => break,
                Ok(n) => got += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => break,
                Err(e) => return Err(InputError::unreadable(self.file.path, &e)),
            }
        }
        self.at += got as u64;
        match got {
            0 => Ok(None),
            _ if got == N => Ok(Some(bytes)),
            _ => self.fault(field, format!("cut short after {} bytes", self.at)),
        }
    }

    fn need<const N: usize>(&mut self, field: &str) -> Result<[u8; N], InputError> {
        match self.take(field)? {
            Some(bytes) => Ok(bytes),
            None => self.fault(field, format!("cut short after {} bytes", self.at)),
        }
    }

    /// Checks that a value lies in the file.
    fn check(&self, length: u64, field: &str) -> Result<(), InputError> {
        let there = self.end.saturating_sub(self.at);
        match length > there {
            true => self.fault(field, format!("cut short, {there} of {length} bytes are there")),
            false => Ok(()),
        }
    }

    fn skip(&mut self, bytes: u64, field: &str) -> Result<(), InputError> {
        self.check(bytes, field)?;
        match self.input.skip(bytes) {
            Ok(()) => self.at += bytes,
            Err(_) => return self.fault(field, format!("cut short, {bytes} bytes after {} are not there", self.at)),
        }
        Ok(())
    }

    fn u16(&self, bytes: [u8; 2]) -> u16 {
        if self.big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) }
    }

    fn u32(&self, bytes: [u8; 4]) -> u32 {
        if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    }

    fn head(&mut self) -> Result<Option<Head>, InputError> {
        let Some([g0, g1, e0, e1]) = self.take("elements")? else { return Ok(None) };
        self.count += 1;
        if self.count > MAX_ELEMENTS {
            return self.fault("elements", format!("are more than {MAX_ELEMENTS}"));
        }
        let tag = u32::from(self.u16([g0, g1])) << 16 | u32::from(self.u16([e0, e1]));
        let rest: [u8; 4] = self.need(&name(tag))?;
        // Items and their ends have no type.
        if !self.explicit || tag >> 16 == 0xfffe {
            return Ok(Some(Head { tag, vr: [0; 2], length: self.u32(rest) }));
        }
        let [a, b, c, d] = rest;
        let vr = [a, b];
        if !vr.iter().all(u8::is_ascii_uppercase) {
            return self.fault(&name(tag), "has no type of value, which this transfer syntax demands");
        }
        let is_long = matches!(
            &vr,
            b"OB" | b"OD" | b"OF" | b"OL" | b"OV" | b"OW" | b"SQ" | b"SV" | b"UC" | b"UN" | b"UR" | b"UT" | b"UV"
        );
        let length = match is_long {
            true => {
                let bytes = self.need(&name(tag))?;
                self.u32(bytes)
            }
            false => u32::from(self.u16([c, d])),
        };
        Ok(Some(Head { tag, vr, length }))
    }

    /// The file meta information: group 0002, always little-endian with types.
    fn meta(&mut self) -> Result<Item, InputError> {
        let mut meta = Item::default();
        let Some(first) = self.head()? else { return self.fault("elements", "are missing") };
        if first.tag != META_LENGTH || first.length != 4 {
            return self.fault("(0002,0000)", "is not the first element");
        }
        let length = u32::from_le_bytes(self.need("(0002,0000)")?);
        let end = self.at + u64::from(length);
        self.check(length.into(), "file meta information")?;
        self.elements(Some(end), 0, true, &mut meta)?;
        Ok(meta)
    }

    /// The elements up to `end`, or to the end of an item or of the file. Those that are wanted are added to `item`.
    fn elements(&mut self, end: Option<u64>, depth: usize, keep: bool, item: &mut Item) -> Result<(), InputError> {
        if depth > MAX_DEPTH {
            return self.fault("items", format!("are nested more than {MAX_DEPTH} deep"));
        }
        while end.is_none_or(|end| self.at < end) {
            let Some(head) = self.head()? else {
                return match depth == 0 && end.is_none() {
                    true => Ok(()),
                    false => self.fault("elements", format!("cut short after {} bytes", self.at)),
                };
            };
            if head.tag == ITEM_END && end.is_none() && depth > 0 {
                return Ok(());
            }
            self.element(&head, depth, keep, item)?;
        }
        match end.is_some_and(|end| self.at > end) {
            true => self.fault("items", format!("end {} bytes after where they should", self.at - end.unwrap_or(0))),
            false => Ok(()),
        }
    }

    fn element(&mut self, head: &Head, depth: usize, keep: bool, item: &mut Item) -> Result<(), InputError> {
        let Head { tag, vr, length } = *head;
        let kind = WANTED.iter().find(|(wanted, _)| *wanted == tag).map(|(_, kind)| *kind);
        let wanted = keep && kind.is_some() && !item.elements.iter().any(|(there, _)| *there == tag);
        if tag == PIXEL_DATA && depth == 0 {
            return self.pixel_data(&vr, length);
        }
        let is_sequence = &vr == b"SQ" || (kind == Some(Kind::Sequence) && !self.explicit) || length == UNDEFINED;
        if is_sequence && (wanted || length == UNDEFINED) {
            // A sequence of unknown type has items without types.
            let explicit = self.explicit;
            self.explicit &= &vr != b"UN";
            let items = self.sequence(tag, length, depth, wanted);
            self.explicit = explicit;
            let items = items?;
            if wanted && kind == Some(Kind::Sequence) {
                item.elements.push((tag, Value::Items(items)));
            }
            return Ok(());
        }
        let length = u64::from(length);
        self.check(length, &name(tag))?;
        if depth == 0 && tag >> 16 == KRETZ_GROUP {
            return self.kretz_element(tag, length);
        }
        match kind {
            Some(kind) if wanted && kind != Kind::Sequence => {
                if length > MAX_VALUE {
                    return self.fault(&name(tag), format!("has {length} bytes, at most {MAX_VALUE} are read"));
                }
                let mut bytes = self.value(tag, length)?;
                // The bytes of OB stand alone, whatever they are used for.
                if let (Kind::Numbers(width), true) = (kind, self.big_endian && &vr != b"OB") {
                    bytes.chunks_exact_mut(width).for_each(<[u8]>::reverse);
                }
                item.elements.push((tag, Value::Bytes(bytes)));
                Ok(())
            }
            _ => self.skip(length, &name(tag)),
        }
    }

    /// The bytes of a value, whose length was checked.
    fn value(&mut self, tag: Tag, length: u64) -> Result<Vec<u8>, InputError> {
        let mut bytes = Vec::new();
        let read = (&mut self.input).take(length).read_to_end(&mut bytes);
        self.at += bytes.len() as u64;
        match read.is_ok() && bytes.len() as u64 == length {
            true => Ok(bytes),
            false => self.fault(&name(tag), format!("cut short, {} of {length} bytes are there", bytes.len())),
        }
    }

    fn sequence(&mut self, tag: Tag, length: u32, depth: usize, keep: bool) -> Result<Vec<Item>, InputError> {
        let end = match length {
            UNDEFINED => None,
            _ => {
                self.check(length.into(), &name(tag))?;
                Some(self.at + u64::from(length))
            }
        };
        let mut items = Vec::new();
        while end.is_none_or(|end| self.at < end) {
            let Some(head) = self.head()? else {
                return self.fault(&name(tag), format!("cut short after {} bytes", self.at));
            };
            match (head.tag, head.length) {
                (SEQUENCE_END, _) => return Ok(items),
                (ITEM, length) => {
                    let end = (length != UNDEFINED).then(|| self.at + u64::from(length));
                    if length != UNDEFINED {
                        self.check(length.into(), &name(tag))?;
                    }
                    let mut item = Item::default();
                    self.elements(end, depth + 1, keep, &mut item)?;
                    if keep {
                        items.push(item);
                    }
                }
                (other, _) => return self.fault(&name(tag), format!("has {} where an item begins", name(other))),
            }
        }
        Ok(items)
    }

    fn pixel_data(&mut self, vr: &[u8; 2], length: u32) -> Result<(), InputError> {
        if length != UNDEFINED {
            let found = PixelData::Native(self.at, length.into(), vr == b"OW");
            self.skip(length.into(), FIELD)?;
            self.pixels = Some(found);
            return Ok(());
        }
        let (mut table, mut fragments, mut is_first) = (Vec::new(), Vec::new(), true);
        loop {
            let Some(head) = self.head()? else {
                return self.fault(FIELD, format!("cut short after {} bytes", self.at));
            };
            match (head.tag, head.length) {
                (SEQUENCE_END, _) => break,
                (ITEM, length) if length != UNDEFINED => {
                    if std::mem::take(&mut is_first) {
                        self.check(length.into(), FIELD)?;
                        if u64::from(length) > MAX_VALUE {
                            return self.fault(FIELD, format!("has a table of {length} bytes"));
                        }
                        let bytes = self.value(PIXEL_DATA, length.into())?;
                        table = bytes.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
                        continue;
                    }
                    fragments.push(self.fragment(length.into())?);
                }
                (other, _) => return self.fault(FIELD, format!("has {} where a fragment begins", name(other))),
            }
        }
        self.pixels = Some(PixelData::Encapsulated(table, fragments));
        Ok(())
    }

    /// A fragment of so many bytes, of which only the first and the last are looked at.
    fn fragment(&mut self, length: u64) -> Result<Fragment, InputError> {
        self.check(length, FIELD)?;
        let at = self.at;
        let mut last = self.value(PIXEL_DATA, length.min(8))?;
        let mut head = [0; 8];
        head[..last.len()].copy_from_slice(&last);
        let rest = length - last.len() as u64;
        if rest > TAIL {
            self.skip(rest - TAIL, FIELD)?;
            last.clear();
        }
        last.extend(self.value(PIXEL_DATA, rest.min(TAIL))?);
        Ok(Fragment { at, length, head, ends: has_end(&last) })
    }

    /// An element of the group that may hold a Kretz file.
    fn kretz_element(&mut self, tag: Tag, length: u64) -> Result<(), InputError> {
        let element = tag & 0xffff;
        if (0x10..=0xff).contains(&element) && length <= 64 {
            let creator = self.value(tag, length)?;
            if String::from_utf8_lossy(&creator).trim_matches([' ', '\0']) == KRETZ_CREATOR {
                self.creators.push(element);
            }
            return Ok(());
        }
        if element & 0xff == 1 && self.creators.contains(&(element >> 8)) && self.kretz.is_none() {
            self.kretz = Some((self.at, length));
        }
        self.skip(length, &name(tag))
    }
}
