//! DICOM files that are written: an Enhanced US Volume (PS3.3 A.59), or a multi-frame grayscale byte secondary capture (A.8.3), in explicit
//! little-endian order, slice by slice.
//!
//! Nothing is invented: attributes of the patient are empty, dates and the exposure of the acquisition are left out although the standard
//! demands some of them. Identifiers are made of a digest of everything else in the file, so that the same volume gives the same bytes.

use super::tags::{self, Tag};
use crate::files::Unfinished;
use crate::probe::{Grid, World};
use glam::DVec3;
use sha2::{Digest, Sha256};
use std::io::{self, Write};

/// Length of every identifier that is made here: "2.25." and 39 digits.
const UID_LENGTH: usize = 44;
const ENHANCED_VOLUME: &str = "1.2.840.10008.5.1.4.1.1.6.2";
const CAPTURE: &str = "1.2.840.10008.5.1.4.1.1.7.2";
const EXPLICIT_LITTLE_ENDIAN: &str = "1.2.840.10008.1.2.1";
/// Name of this program, as manufacturer and model in the files that it writes.
pub(super) const NAME: &str = "Echolume";
/// Offset of the length of the file meta information, and of the first byte that it counts.
const META_LENGTH_AT: usize = 140;
const META_BEGIN: usize = 144;
/// Largest number of bytes of pixels in a file: the largest even length of 32 bits, of which the value of all ones means "not stated".
pub(in super::super) const MOST_BYTES: u64 = 0xffff_fffe;

/// A DICOM file that is being written: a header first, then the samples.
pub(in super::super) struct DicomWriter {
    file: Unfinished,
    digest: Sha256,
    identifiers: Vec<(usize, Identifier)>,
    bytes: u64,
}

/// The identifiers of a file. Each has a value of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Identifier {
    Instance,
    Study,
    Series,
    Space,
    VolumeSpace,
    Clock,
    Dimensions,
}

impl Identifier {
    /// The UUID of a digest, as a decimal number below 2.25 (PS3.5 B.2). Its highest bit is set, so that it always has 39 digits.
    fn value(self, digest: &[u8]) -> String {
        let own = Sha256::new().chain_update(digest).chain_update([self as u8]).finalize();
        let mut bits = own.first_chunk::<16>().map_or(0, |b| u128::from_be_bytes(*b));
        // Version 8 of RFC 9562: made by a rule of its own.
        bits = bits & !(0xf << 76) | 8 << 76;
        bits = bits & !(0b11 << 62) | 0b10 << 62;
        format!("2.25.{}", bits | 1 << 127)
    }
}

impl DicomWriter {
    /// Writes all elements before the samples. `size`: columns, rows, slices. `capture`: true for a secondary capture, false for an Enhanced US
    /// Volume. `width`: bytes of a sample, 1 or 2; 1 in a capture.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(
        file: Unfinished,
        size: [usize; 3],
        world: &World,
        capture: bool,
        width: usize,
    ) -> io::Result<DicomWriter> {
        DicomWriter::begin(file, Header::new(size, world, capture, width))
    }

    /// Begins a file with these elements, of which the last is the head of the samples.
    pub(super) fn begin(file: Unfinished, header: Header) -> io::Result<DicomWriter> {
        let mut writer = DicomWriter { file, digest: Sha256::new(), identifiers: header.identifiers, bytes: 0 };
        writer.file.write_all(&header.bytes)?;
        writer.digest.update(&header.bytes);
        Ok(writer)
    }

    /// Writes the unique identifiers, which depend on the content, into the header, and renames the complete file to its target.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        if !self.bytes.is_multiple_of(2) {
            self.write_all(&[0])?;
        }
        let digest = self.digest.finalize();
        for (at, identifier) in self.identifiers {
            self.file.patch(at as u64, identifier.value(&digest).as_bytes())?;
        }
        self.file.complete()
    }
}

impl Write for DicomWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.digest.update(&bytes[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Elements one after another, in the order of their tags.
#[derive(Default)]
pub(super) struct Header {
    bytes: Vec<u8>,
    /// Where identifiers stand.
    identifiers: Vec<(usize, Identifier)>,
}

/// A decimal number of at most 16 characters, the nearest there is.
pub(super) fn decimal(value: f64) -> String {
    // No negative zero.
    let value = value + 0.0;
    let plain = (0..15).map(|digits| format!("{value:.digits$}"));
    let powers = (0..15).map(|digits| format!("{value:.digits$e}"));
    let off = |text: &String| text.parse().map_or(f64::INFINITY, |read: f64| (read - value).abs());
    let shown = [format!("{value}")].into_iter().chain(plain).chain(powers).filter(|text| text.len() <= 16);
    shown.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or_default()
}

pub(super) fn decimals<const N: usize>(values: [f64; N]) -> String {
    values.map(decimal).join("\\")
}

/// The two words of a tag, group and element, each with its low byte first.
fn words(tag: Tag) -> [u8; 4] {
    tag.rotate_left(16).to_le_bytes()
}

impl Header {
    fn new(size: [usize; 3], world: &World, capture: bool, width: usize) -> Header {
        let mut header = Header::default();
        let class = if capture { CAPTURE } else { ENHANCED_VOLUME };
        header.meta(class);
        match capture {
            true => header.capture(class, size, world),
            false => header.enhanced(class, size, world, width),
        }
        let length = (size[0] * size[1] * size[2] * width) as u64;
        // The length was checked against MOST_BYTES.
        let length = (length + length % 2) as u32;
        let vr = if width == 1 { b"OB" } else { b"OW" };
        header.head(tags::PIXEL_DATA, vr, length);
        header
    }

    pub(super) fn head(&mut self, tag: Tag, vr: &[u8; 2], length: u32) {
        self.bytes.extend(words(tag));
        self.bytes.extend(vr);
        match vr {
            b"OB" | b"OW" | b"SQ" => {
                self.bytes.extend([0; 2]);
                self.bytes.extend(length.to_le_bytes());
            }
            // All other values that are written here are short.
            _ => self.bytes.extend((length as u16).to_le_bytes()),
        }
    }

    pub(super) fn value(&mut self, tag: Tag, vr: &[u8; 2], value: &[u8]) {
        self.head(tag, vr, value.len() as u32);
        self.bytes.extend(value);
    }

    pub(super) fn text(&mut self, tag: Tag, vr: &[u8; 2], text: &str) {
        let mut bytes = text.as_bytes().to_vec();
        if !bytes.len().is_multiple_of(2) {
            bytes.push(if vr == b"UI" { 0 } else { b' ' });
        }
        self.value(tag, vr, &bytes);
    }

    pub(super) fn empty(&mut self, tag: Tag, vr: &[u8; 2]) {
        self.value(tag, vr, &[]);
    }

    pub(super) fn word(&mut self, tag: Tag, value: u16) {
        self.value(tag, b"US", &value.to_le_bytes());
    }

    pub(super) fn longs(&mut self, tag: Tag, vr: &[u8; 2], values: &[u32]) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.value(tag, vr, &bytes);
    }

    fn reals(&mut self, tag: Tag, values: &[f64]) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| (v + 0.0).to_le_bytes()).collect();
        self.value(tag, b"FD", &bytes);
    }

    pub(super) fn tag(&mut self, tag: Tag, value: Tag) {
        self.value(tag, b"AT", &words(value));
    }

    pub(super) fn identifier(&mut self, tag: Tag, identifier: Identifier) {
        self.head(tag, b"UI", UID_LENGTH as u32);
        self.identifiers.push((self.bytes.len(), identifier));
        self.bytes.extend([b'0'; UID_LENGTH]);
    }

    /// A sequence of items, each with an end mark.
    pub(super) fn sequence(&mut self, tag: Tag, items: usize, mut item: impl FnMut(&mut Header, usize)) {
        self.head(tag, b"SQ", u32::MAX);
        for n in 0..items {
            self.bytes.extend([0xfe, 0xff, 0x00, 0xe0, 0xff, 0xff, 0xff, 0xff]);
            item(self, n);
            self.bytes.extend([0xfe, 0xff, 0x0d, 0xe0, 0, 0, 0, 0]);
        }
        self.bytes.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
    }

    pub(super) fn one(&mut self, tag: Tag, item: impl Fn(&mut Header)) {
        self.sequence(tag, 1, |header, _| item(header));
    }

    pub(super) fn code(&mut self, tag: Tag, value: &str, scheme: &str, meaning: &str) {
        self.one(tag, |item| {
            item.text(0x0008_0100, b"SH", value);
            item.text(0x0008_0102, b"SH", scheme);
            item.text(0x0008_0104, b"LO", meaning);
        });
    }

    /// What is not known, as the standard lets it be said.
    fn unknown(&mut self, tag: Tag) {
        self.code(tag, "261665006", "SCT", "Unknown");
    }

    pub(super) fn meta(&mut self, class: &str) {
        self.bytes.resize(128, 0);
        self.bytes.extend(b"DICM");
        self.longs(0x0002_0000, b"UL", &[0]);
        self.value(0x0002_0001, b"OB", &[0, 1]);
        self.text(0x0002_0002, b"UI", class);
        self.identifier(0x0002_0003, Identifier::Instance);
        self.text(0x0002_0010, b"UI", EXPLICIT_LITTLE_ENDIAN);
        // Of this program, whatever it writes.
        let program = Identifier::Instance.value(NAME.as_bytes());
        self.text(0x0002_0012, b"UI", &program);
        self.text(0x0002_0013, b"SH", "ECHOLUME");
        let length = (self.bytes.len() - META_BEGIN) as u32;
        self.bytes[META_LENGTH_AT..META_BEGIN].copy_from_slice(&length.to_le_bytes());
    }

    /// Appends the elements of group 0008 from the type of the image to the modality; date, time and accession number are empty.
    pub(super) fn general(&mut self, class: &str, image_type: &str, modality: &str) {
        self.text(0x0008_0008, b"CS", image_type);
        self.text(tags::SOP_CLASS, b"UI", class);
        self.identifier(0x0008_0018, Identifier::Instance);
        self.empty(0x0008_0020, b"DA");
        self.empty(0x0008_0030, b"TM");
        self.empty(0x0008_0050, b"SH");
        self.text(tags::MODALITY, b"CS", modality);
    }

    pub(super) fn patient(&mut self) {
        self.empty(0x0010_0010, b"PN");
        self.empty(0x0010_0020, b"LO");
        self.empty(0x0010_0030, b"DA");
        self.empty(0x0010_0040, b"CS");
    }

    pub(super) fn study(&mut self) {
        self.identifier(0x0020_000d, Identifier::Study);
        self.identifier(tags::SERIES, Identifier::Series);
        self.empty(0x0020_0010, b"SH");
        self.text(0x0020_0011, b"IS", "1");
        self.text(tags::INSTANCE_NUMBER, b"IS", "1");
        self.empty(0x0020_0020, b"CS");
    }

    /// Group 0028 up to the pixels' bits.
    /// `bits`: of a sample; `increment`: the element that tells frames apart, of a capture; `spacing`: of rows and of columns, mm.
    pub(super) fn pixels(&mut self, size: [usize; 3], bits: u16, increment: Option<Tag>, spacing: Option<[f64; 2]>) {
        let [columns, rows, slices] = size;
        self.word(tags::SAMPLES, 1);
        self.text(tags::PHOTOMETRIC, b"CS", "MONOCHROME2");
        self.text(tags::FRAMES, b"IS", &slices.to_string());
        if let Some(increment) = increment {
            self.tag(0x0028_0009, increment);
        }
        // The sizes were checked against the format.
        self.word(tags::ROWS, rows as u16);
        self.word(tags::COLUMNS, columns as u16);
        if let Some(spacing) = spacing {
            self.text(tags::PIXEL_SPACING, b"DS", &decimals(spacing));
        }
        self.word(tags::BITS_ALLOCATED, bits);
        self.word(tags::BITS_STORED, bits);
        self.word(tags::HIGH_BIT, bits - 1);
        self.word(tags::IS_SIGNED, 0);
    }

    /// States that no identity and no face is in the pixels, and that stored numbers are the values: slope 1, intercept 0.
    fn plain_values(&mut self) {
        self.text(0x0028_0301, b"CS", "NO");
        self.text(0x0028_0302, b"CS", "NO");
        self.text(tags::INTERCEPT, b"DS", "0");
        self.text(tags::SLOPE, b"DS", "1");
    }

    fn enhanced(&mut self, class: &str, size: [usize; 3], world: &World, width: usize) {
        const KIND: &str = "DERIVED\\PRIMARY\\VOLUME\\RESAMPLED";
        // The axes of the volume are those that are drawn, which are those of the transducer: y is depth.
        let Grid { spacing, origin: [x, y, z], .. } = world.grid(size);
        let directions = world.directions();
        self.general(class, KIND, "US");
        self.text(tags::MANUFACTURER, b"LO", NAME);
        self.empty(0x0008_0090, b"PN");
        self.text(tags::MODEL, b"LO", NAME);
        self.unknown(0x0008_2218);
        self.patient();
        // Programs of ITK read place and spacing of this class here only. Their slices follow each other along rows x columns.
        let is_right_handed = directions.determinant() > 0.0;
        if is_right_handed {
            self.text(tags::SPACING_BETWEEN_SLICES, b"DS", &decimal(spacing[2]));
        }
        self.text(0x0018_1000, b"LO", "0");
        self.text(0x0018_1020, b"LO", env!("CARGO_PKG_VERSION"));
        self.text(0x0018_106a, b"CS", "NO TRIGGER");
        self.text(0x0018_1800, b"CS", "N");
        let depth = (spacing[1] * size[1] as f64).round().clamp(0.0, 1e9);
        self.text(0x0018_5050, b"IS", &depth.to_string());
        self.text(0x0018_9004, b"CS", "RESEARCH");
        self.code(0x0018_9809, "125242", "DCM", "Volume scan pattern");
        self.text(0x0018_980c, b"CS", "RIGID");
        self.unknown(0x0018_980d);
        self.unknown(0x0018_980e);
        self.unknown(0x0018_980f);
        self.study();
        let both = [directions.x_axis.to_array(), directions.y_axis.to_array()].map(decimals).join("\\");
        if is_right_handed {
            self.text(tags::POSITION_PATIENT, b"DS", &decimals(world.origin().to_array()));
            self.text(tags::ORIENTATION_PATIENT, b"DS", &both);
        }
        self.identifier(0x0020_0052, Identifier::Space);
        self.empty(0x0020_0060, b"CS");
        self.identifier(0x0020_0200, Identifier::Clock);
        self.empty(0x0020_1040, b"LO");
        self.one(0x0020_9221, |item| item.identifier(0x0020_9164, Identifier::Dimensions));
        self.one(0x0020_9222, |item| {
            item.identifier(0x0020_9164, Identifier::Dimensions);
            item.tag(0x0020_9165, tags::POSITION_VOLUME);
            item.tag(0x0020_9167, tags::PLANE_POSITION_VOLUME);
        });
        self.text(0x0020_9307, b"CS", "PATIENT");
        let one = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        self.reals(tags::TO_TRANSDUCER, &one);
        self.text(0x0020_930c, b"CS", "ESTIMATED");
        self.text(0x0020_9311, b"CS", "3D");
        self.identifier(0x0020_9312, Identifier::VolumeSpace);
        self.pixels(size, 8 * width as u16, None, is_right_handed.then_some([spacing[1], spacing[0]]));
        self.plain_values();
        self.text(0x0028_2110, b"CS", "00");
        self.head(0x0040_0555, b"SQ", 0);
        self.unknown(0x0054_0220);
        self.text(0x2050_0020, b"CS", "IDENTITY");
        let most = ((8 * width) as f64).exp2() - 1.0;
        self.one(tags::SHARED_GROUPS, |item| {
            item.one(0x0018_9806, |item| {
                item.text(0x0008_9007, b"CS", KIND);
                item.text(0x0008_9206, b"CS", "VOLUME");
                item.text(0x0008_9207, b"CS", "NONE");
            });
            item.one(tags::DATA_TYPES, |item| {
                item.text(tags::DATA_TYPE, b"CS", "TISSUE_INTENSITY");
                item.text(0x0018_980b, b"CS", "NO");
            });
            item.one(tags::PLANE_ORIENTATION, |item| item.text(tags::ORIENTATION_PATIENT, b"DS", &both));
            let own = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
            item.one(tags::PLANE_ORIENTATION_VOLUME, |item| item.reals(tags::ORIENTATION_VOLUME, &own));
            item.one(tags::PIXEL_MEASURES, |item| {
                item.text(tags::SLICE_THICKNESS, b"DS", &decimal(spacing[2]));
                item.text(tags::PIXEL_SPACING, b"DS", &decimals([spacing[1], spacing[0]]));
            });
            item.one(0x0028_9132, |item| {
                item.text(0x0028_1050, b"DS", &decimal((most + 1.0) / 2.0));
                item.text(0x0028_1051, b"DS", &decimal(most + 1.0));
            });
        });
        self.sequence(tags::FRAME_GROUPS, size[2], |item, slice| {
            let k = slice as f64;
            item.one(tags::FRAME_CONTENT, |item| {
                item.longs(tags::TEMPORAL_INDEX, b"UL", &[1]);
                item.longs(0x0020_9157, b"UL", &[slice as u32 + 1]);
            });
            let at = decimals(world.at(DVec3::Z * k).to_array());
            item.one(tags::PLANE_POSITION, |item| item.text(tags::POSITION_PATIENT, b"DS", &at));
            let at = [x, y, z + k * spacing[2]];
            item.one(tags::PLANE_POSITION_VOLUME, |item| item.reals(tags::POSITION_VOLUME, &at));
        });
    }

    fn capture(&mut self, class: &str, size: [usize; 3], world: &World) {
        let spacing = [0, 1, 2].map(|n| world.axis(n).length());
        self.general(class, "DERIVED\\SECONDARY", "US");
        self.text(0x0008_0064, b"CS", "WSD");
        self.text(tags::MANUFACTURER, b"LO", NAME);
        self.empty(0x0008_0090, b"PN");
        self.text(tags::MODEL, b"LO", NAME);
        self.patient();
        self.text(0x0018_1020, b"LO", env!("CARGO_PKG_VERSION"));
        // A value of 64 KiB is the longest that this form holds.
        let places: Vec<String> = (0..size[2]).map(|k| decimal(spacing[2] * k as f64)).collect();
        let places = places.join("\\");
        let is_stated = size[2] > 1 && places.len() < 0xffff;
        if is_stated {
            self.text(tags::SLICE_LOCATIONS, b"DS", &places);
        }
        self.study();
        self.empty(0x0020_0060, b"CS");
        self.pixels(size, 8, is_stated.then_some(tags::SLICE_LOCATIONS), Some([spacing[1], spacing[0]]));
        self.plain_values();
        self.text(0x0028_1054, b"LO", "US");
        self.text(0x2050_0020, b"CS", "IDENTITY");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_short_and_near() {
        for (value, text) in [(0.25, "0.25"), (-0.0, "0"), (127.5, "127.5"), (-3.0, "-3"), (1e-9, "0.000000001")] {
            assert_eq!(decimal(value), text);
        }
        for value in [1.0 / 3.0, -1e5 / 7.0, -std::f64::consts::PI * 1e-6, 0.0123456789012345, -0.999_999_999_999_999_9]
        {
            let text = decimal(value);
            let read: f64 = text.parse().expect("a number");
            assert!(text.len() <= 16 && (read - value).abs() <= 1e-9 * value.abs(), "{text} is not {value}");
        }
    }

    #[test]
    fn identifiers_differ_and_have_one_length() {
        use Identifier::*;
        let all = [Instance, Study, Series, Space, VolumeSpace, Clock, Dimensions].map(|i| i.value(b"digest"));
        assert!(all.iter().all(|uid| uid.len() == UID_LENGTH && uid.starts_with("2.25.")));
        let different: std::collections::BTreeSet<&String> = all.iter().collect();
        assert_eq!(different.len(), all.len());
        assert_ne!(Instance.value(b"other"), all[0]);
        let number: u128 = all[0][5..].parse().expect("a number");
        assert_eq!((number >> 76 & 0xf, number >> 62 & 0b11), (8, 0b10));
    }
}
