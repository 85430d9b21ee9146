//! Recordings.

use super::{told, written};
use echolume::low_level::source::recorder::Reader;
use echolume::low_level::source::{Geometry, InputError, OpenOptions, Recording, Source};
use std::path::Path;

/// Bytes read at most: a few bytes of zlib expand to a thousand times as many.
const MOST_READ: usize = 8 << 20;

/// A probe that fits most frames, for sweeps without one.
const PROBE: &[u8] = b"[array]\nkind = 'curved'\nradius_mm = 40\n[lines]\nsector_angle_deg = 70\n[depth]\nend_mm = 120\n\
                       [motion]\nkind = 'fan'\nwobble_radius_mm = 25\nfan_angle_deg = 60\nspeed_ratio = 0.4\nboth_ways = true\n";

fn read(mut source: Box<dyn Source>) -> Result<String, InputError> {
    let (volumes, mut bytes) = (source.volumes(), 0);
    let slices = source.geometry(0).slices();
    while let Some(frame) = source.next_frame()? {
        assert!(frame.slice < slices, "slice {} of {slices}", frame.slice);
        bytes += frame.bytes.len();
        if bytes > MOST_READ {
            break;
        }
    }
    source.skip_to_volume(volumes / 2)?;
    // Its first frame may be damaged.
    source.next_frame()?;
    Ok(format!("{} volumes", volumes.min(3)))
}

/// A stream of frames in a file.
pub fn stream(bytes: &[u8]) -> String {
    let path = written("input.pipe", bytes);
    outcome(echolume::low_level::source::open(&path, None).and_then(|source| {
        // Poses far apart make a lattice of any size.
        let is_large =
            matches!(source.geometry(0), Geometry::Cartesian(grid) if grid.size.iter().product::<usize>() > 1 << 20);
        if is_large { Ok("large".into()) } else { read(source) }
    }))
}

fn outcome(result: Result<String, InputError>) -> String {
    result.unwrap_or_else(told)
}

fn recording(path: &Path, probe: Option<&Path>) -> String {
    outcome(Recording::open(path, probe).and_then(|recording| {
        let _ = recording.description();
        read(Box::new(recording))
    }))
}

pub fn metaimage(bytes: &[u8]) -> String {
    let (path, probe) = (written("input.mha", bytes), written("fan.toml", PROBE));
    recording(&path, None) + &recording(&path, Some(&probe))
}

/// Tracked pictures, with a calibration; and the same bytes as a configuration.
pub fn tracked(bytes: &[u8]) -> String {
    let calibration = ["ImageToProbe=0.5 0 0 0 0 0.5 0 0 0 0 0.5 0".parse().expect("a calibration")];
    let as_pictures = OpenOptions { calibration: &calibration, ..OpenOptions::default() };
    // A pose far away makes a lattice of any size.
    let one = |path: &Path, options| {
        outcome(
            echolume::low_level::source::description(path, options)
                .map(|found| (found.rows.len() + found.unused.lines().len()).to_string()),
        )
    };
    let config = written("plus.xml", bytes);
    let as_config = OpenOptions { plus_config: Some(&config), ..OpenOptions::default() };
    one(&written("input.mha", bytes), as_pictures) + &one(&written("still.mha", TRACKED), as_config)
}

/// One tracked picture.
const TRACKED: &[u8] = b"ObjectType = Image\nNDims = 3\nDimSize = 2 2 1\nElementType = MET_UCHAR\n\
                         Seq_Frame0000_ProbeToTrackerTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\nElementDataFile = LOCAL\nabcd";

pub fn nrrd(bytes: &[u8]) -> String {
    recording(&written("input.nrrd", bytes), None)
}

pub fn nifti(bytes: &[u8]) -> String {
    recording(&written("input.nii", bytes), None)
}

/// As a file, and as one of a folder of two.
pub fn dicom(bytes: &[u8]) -> String {
    let folder = super::folder().join("series");
    std::fs::create_dir_all(&folder).expect("a folder for inputs");
    written("series/one.dcm", bytes);
    written("series/two.dcm", SLICE);
    recording(&written("input.dcm", bytes), None) + &recording(&folder, None)
}

/// One slice of a series.
const SLICE: &[u8] = include_bytes!("../../data/dicom/series/0.dcm");

/// An HDF5 file of USTB.
pub fn uff(bytes: &[u8]) -> String {
    outcome(echolume::low_level::source::open(&written("input.uff", bytes), None).and_then(read))
}

/// A stack of two pictures; names of pictures, a line each; and a file that states their spacing.
pub fn stack(bytes: &[u8]) -> String {
    let spaced = OpenOptions { voxel_spacing: Some([0.5, 0.25, 1.0]), ..OpenOptions::default() };
    let one = |name: &str, options| {
        outcome(Recording::open_with(&super::folder().join(name), options).and_then(|recording| {
            let _ = recording.description();
            read(Box::new(recording))
        }))
    };
    let new = |name: &str| {
        let folder = super::folder().join(name);
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).expect("a folder for inputs");
    };
    new("stack");
    for name in ["stack/slice-1.png", "stack/slice-2.png"] {
        written(name, bytes);
    }
    let pictures = one("stack", spaced);
    new("names");
    let is_plain = |c: &char| c.is_alphanumeric() || "-_. ".contains(*c);
    for line in String::from_utf8_lossy(bytes).lines().take(6) {
        let name: String = line.chars().filter(is_plain).take(40).collect();
        written(&format!("names/{name}.pgm"), PGM);
    }
    let names = one("names", spaced);
    new("spacing");
    written("spacing/slice-1.pgm", PGM);
    written("spacing/probe.toml", bytes);
    pictures + &names + &one("spacing", OpenOptions::default())
}

/// A picture of two pixels.
const PGM: &[u8] = b"P5 2 1 255 ab";

pub fn kretz(bytes: &[u8]) -> String {
    recording(&written("input.vol", bytes), None)
}

/// A file of frames, unchanged and with checksums that make its contents valid.
pub fn frames(bytes: &[u8]) -> String {
    let once = |bytes: &[u8]| {
        let path = written("input.frames", bytes);
        outcome(Reader::open(&path).and_then(|replay| {
            let whole = read(Box::new(replay))?;
            Reader::open(&path)?.description().map(|_| whole)
        }))
    };
    let mut right = bytes.to_vec();
    mend(&mut right);
    once(bytes) + &once(&right)
}

/// Sets the length and checksum of the header, and those of the frames after it as far as they are linked. None if the file is too short.
fn mend(bytes: &mut [u8]) -> Option<()> {
    // The header is JSON: it ends with the brace before the first frame.
    let frame = bytes.windows(4).position(|w| w == b"FRAM").unwrap_or(bytes.len());
    let length = frame.checked_sub(20)?;
    bytes.get_mut(12..16)?.copy_from_slice(&(length as u32).to_le_bytes());
    let mut at = sum(bytes, 0, 16 + length)?;
    let is_posed = bytes[16..16 + length].windows(12).any(|w| w == b"\"posed\":true");
    let before = if is_posed { 136 } else { 40usize };
    while bytes.get(at..at + 4)? == b"FRAM" {
        let length = u32::from_le_bytes(bytes.get(at + 20..at + 24)?.try_into().ok()?) as usize;
        at = sum(bytes, at, at.checked_add(before)?.checked_add(length)?)?;
    }
    None
}

/// Writes the CRC-32 of a range after it. Returns where the checksum ends.
fn sum(bytes: &mut [u8], from: usize, to: usize) -> Option<usize> {
    let crc = bytes.get(from..to)?.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    });
    bytes.get_mut(to..to + 4)?.copy_from_slice(&(!crc).to_le_bytes());
    Some(to + 4)
}
