//! Segmentations as DICOM: Segmentation Storage (PS3.3 A.51), binary, a frame for each slice of each segment that has voxels there.
//!
//! Nothing is invented, as in [`write`](super::write): what the segments are is stated as tissue, and nothing refers to other images.

use super::tags;
use super::write::{DicomWriter, Header, Identifier, MOST_BYTES, NAME, decimal, decimals};
use crate::files::{InputError, Unfinished};
use crate::probe::World;
use crate::text::single_line;
use glam::{DMat3, DVec3};
use std::io::{self, Write};
use std::path::Path;

const SEGMENTATION: &str = "1.2.840.10008.5.1.4.1.1.66.4";
const SEGMENT_NUMBER: u32 = 0x0062_000b;
const SEGMENT_IDENTIFICATION: u32 = 0x0062_000a;
/// Longest label of a segment, characters.
const MAX_NAME: usize = 64;

/// A segment: its label, its name, and its colour, 0..=1.
type Named<'a> = (u8, &'a str, [f64; 3]);

/// Writes the label of each voxel of a lattice of this size. Labels that are no segment are left out.
///
/// # Errors
/// A lattice that the format cannot hold, no voxel in any segment, a full disk, a folder that cannot be written.
pub(in super::super) fn write(
    path: &Path,
    size: [usize; 3],
    world: &World,
    segments: &[Named],
    label: impl Fn([usize; 3]) -> u8,
) -> Result<(), InputError> {
    let [width, height, depth] = size;
    let places = |z: usize| (0..height).flat_map(move |y| (0..width).map(move |x| [x, y, z]));
    // The number of a segment, from 1, by label.
    let mut numbers = [None; 256];
    segments.iter().enumerate().for_each(|(n, segment)| numbers[usize::from(segment.0)] = Some(n));
    let mut has = vec![vec![false; depth]; segments.len()];
    for at in (0..depth).flat_map(places) {
        if let Some(n) = numbers[usize::from(label(at))] {
            has[n][at[2]] = true;
        }
    }
    let frames: Vec<(usize, usize)> =
        has.iter().enumerate().flat_map(|(n, has)| (0..depth).filter(|z| has[*z]).map(move |z| (n, z))).collect();
    let fault = |why: &str| Err(InputError::new(path, "segmentation", why));
    let bytes = (width as u64 * height as u64 * frames.len() as u64).div_ceil(8);
    if frames.is_empty() {
        return fault("has no voxel with a label");
    }
    if width.max(height) > usize::from(u16::MAX) || bytes + 1 > MOST_BYTES {
        return fault("has more voxels than the format holds");
    }
    let write = || -> io::Result<()> {
        let header = header(size, world, segments, &frames, bytes as u32);
        let mut file = DicomWriter::begin(Unfinished::create(path)?, header)?;
        // A bit for each voxel, the lowest first; a frame begins where the one before ended.
        let (mut packed, mut bits, mut count) = (Vec::with_capacity(width * height / 8 + 1), 0u8, 0);
        for (n, z) in &frames {
            for at in places(*z) {
                bits |= u8::from(label(at) == segments[*n].0) << count;
                count += 1;
                if count == 8 {
                    packed.push(bits);
                    (bits, count) = (0, 0);
                }
            }
            file.write_all(&packed)?;
            packed.clear();
        }
        if count > 0 {
            file.write_all(&[bits])?;
        }
        file.finish()
    };
    write().map_err(|e| InputError::unwritable(path, &e))
}

fn header(
    [width, height, depth]: [usize; 3],
    world: &World,
    segments: &[Named],
    frames: &[(usize, usize)],
    bytes: u32,
) -> Header {
    let spacing = [0, 1, 2].map(|n| decimal(world.axis(n).length()));
    let directions = world.directions();
    let mut header = Header::default();
    header.meta(SEGMENTATION);
    header.general(SEGMENTATION, "DERIVED\\PRIMARY", "SEG");
    header.text(tags::MANUFACTURER, b"LO", NAME);
    header.empty(0x0008_0090, b"PN");
    header.text(tags::MODEL, b"LO", NAME);
    header.patient();
    header.text(0x0018_1000, b"LO", "0");
    header.text(0x0018_1020, b"LO", env!("CARGO_PKG_VERSION"));
    header.study();
    header.identifier(0x0020_0052, Identifier::Space);
    header.empty(0x0020_1040, b"LO");
    header.one(0x0020_9221, |item| item.identifier(0x0020_9164, Identifier::Dimensions));
    header.sequence(0x0020_9222, 2, |item, n| {
        let (pointer, group) =
            [(SEGMENT_NUMBER, SEGMENT_IDENTIFICATION), (tags::POSITION_PATIENT, tags::PLANE_POSITION)][n];
        item.identifier(0x0020_9164, Identifier::Dimensions);
        item.tag(0x0020_9165, pointer);
        item.tag(0x0020_9167, group);
    });
    header.pixels([width, height, frames.len()], 1, None, None);
    header.text(0x0028_2110, b"CS", "00");
    header.text(0x0062_0001, b"CS", "BINARY");
    header.sequence(0x0062_0002, segments.len(), |item, n| {
        let (_, name, colour) = segments[n];
        let name: String = single_line(name).replace('\\', "/").chars().take(MAX_NAME).collect();
        let ascii: String = name.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
        item.code(0x0062_0003, "85756007", "SCT", "Tissue");
        item.word(0x0062_0004, n as u16 + 1);
        item.text(0x0062_0005, b"LO", &ascii);
        item.text(0x0062_0008, b"CS", "SEMIAUTOMATIC");
        item.text(0x0062_0009, b"LO", NAME);
        let lab = cielab(colour);
        item.value(0x0062_000d, b"US", &lab.map(u16::to_le_bytes).concat());
        item.code(0x0062_000f, "85756007", "SCT", "Tissue");
    });
    header.text(0x0070_0080, b"CS", "LABELS");
    header.empty(0x0070_0081, b"LO");
    header.empty(0x0070_0084, b"PN");
    header.one(tags::SHARED_GROUPS, |item| {
        let both = [directions.x_axis.to_array(), directions.y_axis.to_array()].map(decimals).join("\\");
        item.one(tags::PLANE_ORIENTATION, |item| item.text(tags::ORIENTATION_PATIENT, b"DS", &both));
        item.one(tags::PIXEL_MEASURES, |item| {
            item.text(tags::SLICE_THICKNESS, b"DS", &spacing[2]);
            item.text(tags::SPACING_BETWEEN_SLICES, b"DS", &spacing[2]);
            item.text(tags::PIXEL_SPACING, b"DS", &format!("{}\\{}", spacing[1], spacing[0]));
        });
    });
    // Positions are numbered along the slices of the lattice that have any frame.
    let used: Vec<usize> = (0..depth).filter(|z| frames.iter().any(|(_, of)| of == z)).collect();
    header.sequence(tags::FRAME_GROUPS, frames.len(), |item, frame| {
        let (n, z) = frames[frame];
        let position = used.iter().position(|of| *of == z).unwrap_or(0);
        let indices = [n, position].map(|index| index as u32 + 1);
        item.one(tags::FRAME_CONTENT, |item| item.longs(0x0020_9157, b"UL", &indices));
        let at = decimals(world.at(DVec3::Z * z as f64).to_array());
        item.one(tags::PLANE_POSITION, |item| item.text(tags::POSITION_PATIENT, b"DS", &at));
        item.one(SEGMENT_IDENTIFICATION, |item| item.word(SEGMENT_NUMBER, n as u16 + 1));
    });
    header.head(tags::PIXEL_DATA, b"OB", bytes + bytes % 2);
    header
}

/// A colour of sRGB as CIE L*a*b* under D50, in the 16 bits of PS3.3 C.10.7.1.1: L 0..100, a and b -128..127.
fn cielab(colour: [f64; 3]) -> [u16; 3] {
    let linear = colour.map(|c| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) });
    // Of sRGB, adapted to D50 (ICC.1:2022, annex E).
    let to_xyz = DMat3::from_cols(
        DVec3::new(0.4360747, 0.2225045, 0.0139322),
        DVec3::new(0.3850649, 0.7168786, 0.0971045),
        DVec3::new(0.1430804, 0.0606169, 0.7141733),
    );
    let xyz = to_xyz * DVec3::from(linear) / DVec3::new(0.96422, 1.0, 0.82521);
    let bent = xyz.to_array().map(|v| if v > 0.008856 { v.cbrt() } else { 7.787 * v + 16.0 / 116.0 });
    let (l, a, b) = (116.0 * bent[1] - 16.0, 500.0 * (bent[0] - bent[1]), 200.0 * (bent[1] - bent[2]));
    [l / 100.0, (a + 128.0) / 255.0, (b + 128.0) / 255.0].map(|share| (share.clamp(0.0, 1.0) * 65535.0).round() as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the table of the IEC for sRGB under D50: white, black, and red at L 54.3, a 80.8, b 69.9.
    #[test]
    fn colours_are_those_of_cielab() {
        let back = |[l, a, b]: [u16; 3]| {
            let share = |v: u16| f64::from(v) / 65535.0;
            [100.0 * share(l), 255.0 * share(a) - 128.0, 255.0 * share(b) - 128.0]
        };
        for (colour, lab) in
            [([1.0; 3], [100.0, 0.0, 0.0]), ([0.0; 3], [0.0; 3]), ([1.0, 0.0, 0.0], [54.29, 80.81, 69.89])]
        {
            let found = back(cielab(colour));
            assert!(found.iter().zip(lab).all(|(a, b)| (a - b).abs() < 0.1), "{colour:?}: {found:?}");
        }
    }
}
