//! Recordings built by the tests.

pub use crate::common::files::{Folder, SWEEP, data as stored};
use echolume::Source;
pub use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
pub use echolume::low_level::source::{Frame, InputError, Recording, SampleType, StoredType};
pub use flate2::{Compression, write::ZlibEncoder};
pub use proptest::prelude::*;
pub use std::fs;
pub use std::io::Write;
pub use std::path::Path;

pub fn open(path: impl AsRef<Path>) -> Recording {
    Recording::open(path.as_ref(), None).unwrap_or_else(|e| panic!("{e}"))
}

pub fn all_frames(recording: &mut Recording) -> Result<Vec<Frame>, InputError> {
    let mut frames = Vec::new();
    while let Some(frame) = recording.next_frame()? {
        frames.push(frame);
    }
    Ok(frames)
}

pub fn all_bytes(path: impl AsRef<Path>) -> Result<Vec<u8>, InputError> {
    let mut recording = Recording::open(path.as_ref(), None)?;
    let _ = recording.description();
    Ok(all_frames(&mut recording)?.into_iter().flat_map(|f| f.bytes).collect())
}

/// Any bytes must give frames, or one line that fits on a screen.
pub fn total(path: impl AsRef<Path>) -> Result<Vec<u8>, String> {
    all_bytes(path).map_err(|error| {
        let line = error.to_string();
        assert_eq!(line.lines().count(), 1, "{line}");
        assert!(line.len() < 2000 && !line.chars().any(char::is_control), "{line:?}");
        line
    })
}

pub fn probe_of(recording: &Recording) -> Probe {
    match recording.geometry(0) {
        Geometry::Sweep(probe) => probe,
        Geometry::Cartesian(grid) => panic!("not polar: {grid:?}"),
    }
}

pub fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A MetaImage of the given header lines.
pub fn image(size: &str, element: &str, more: &str, data: &[u8]) -> Vec<u8> {
    let header = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = {size}\nElementType = {element}\n{more}ElementDataFile = LOCAL\n"
    );
    [header.as_bytes(), data].concat()
}

pub fn item(group: u16, element: u16, bytes: &[u8]) -> Vec<u8> {
    let length = bytes.len() as u32;
    [&group.to_le_bytes()[..], &element.to_le_bytes(), &length.to_le_bytes(), bytes].concat()
}

pub fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A Kretz volume of 4 samples with the given angle tables (centred on 0), and more items before the voxels.
pub fn kretz(lines: &[f64], sweep: &[f64], more: &[u8]) -> Vec<u8> {
    let centred = |table: &[f64]| doubles(&table.iter().map(|a| a + std::f64::consts::FRAC_PI_2).collect::<Vec<_>>());
    let voxels: Vec<u8> = (0..4 * lines.len() * sweep.len()).map(|v| v as u8).collect();
    [
        b"KRETZFILE 1.0   ".to_vec(),
        item(0x0110, 2, b"SECRET^PATIENT\n\x1b[2J"),
        item(0x0120, 1, b"SECRET-NUMBER"),
        item(0xc000, 1, &4u16.to_le_bytes()),
        item(0xc000, 2, &(lines.len() as u16).to_le_bytes()),
        item(0xc000, 3, &(sweep.len() as u16).to_le_bytes()),
        item(0xc100, 1, &doubles(&[0.0005])),
        item(0xc200, 1, &doubles(&[80.0])),
        item(0xc200, 2, &doubles(&[-30.0])),
        item(0xc300, 1, &centred(sweep)),
        item(0xc300, 2, &centred(lines)),
        more.to_vec(),
        item(0xd000, 1, &voxels),
        item(0xffff, 0xffff, b""),
    ]
    .concat()
}

pub fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9, "{a} is not {b}");
}
