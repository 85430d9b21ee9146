//! UFF of USTB: beamformed data and their scan, written by h5py as USTB lays them out (tests/data/uff/make.py).

use crate::common::files::data;
use echolume::low_level::probe::{Geometry, Indices};
use echolume::low_level::source::{OpenOptions, StoredType, description, open};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::PathBuf;

#[derive(serde::Deserialize)]
struct Expected {
    /// Samples, lines, slices, volumes.
    size: [usize; 4],
    /// Indices and the place in USTB's coordinates, mm: x lateral, y elevation, z depth.
    places: Vec<([usize; 3], [f64; 3])>,
}

fn expected() -> BTreeMap<String, Expected> {
    serde_json::from_slice(&std::fs::read(data("uff/expected.json")).expect("read")).expect("the places")
}

fn file(name: &str) -> PathBuf {
    data("uff").join(name)
}

/// d of the generator, dB.
fn decibels(sample: usize, line: usize, slice: usize, volume: usize) -> f64 {
    ((7 * sample + 11 * line + 5 * slice + 3 * volume) % 41) as f64
}

#[test]
fn every_pixel_is_where_ustb_has_it_and_has_its_decibels() {
    let expected = expected();
    assert_eq!(expected.len(), 6);
    for (name, Expected { size: [samples, lines, slices, volumes], places }) in expected {
        let mut source = open(&file(&format!("{name}.uff")), None).expect("a recording");
        let Geometry::Sweep(probe) = source.geometry(0) else { panic!("{name}: scan lines") };
        assert_eq!(
            [probe.samples, probe.lines.len(), probe.slices.len(), source.volumes()],
            [samples, lines, slices, volumes]
        );
        for ([i, j, k], [x, y, z]) in places {
            let at = probe.to_space(Indices { sample: i as f64, line: j as f64, slice: k as f64 });
            // To a micrometre.
            let off = at.distance(DVec3::new(x, z, y));
            assert!(off < 1e-3, "{name}: pixel {i}, {j}, {k} is {off} mm away");
        }
        let is_grey = name == "linear-3d";
        let stored = if is_grey { StoredType::U8 } else { StoredType::F32 };
        assert_eq!(source.stored_type(), stored, "{name}");
        let mut frames = 0;
        while let Some(frame) = source.next_frame().expect("a frame") {
            assert_eq!((frame.volume as usize, frame.slice), (frames / slices, frames % slices));
            for n in 0..samples * lines {
                let meant = decibels(n % samples, n / samples, frame.slice, frame.volume as usize);
                let read = match stored {
                    StoredType::U8 => -f64::from(frame.bytes[n]),
                    _ => f64::from(f32::from_le_bytes(*frame.bytes[4 * n..].first_chunk().expect("a sample"))),
                };
                // The largest amplitude of the file is that of 0 dB.
                assert!((read + meant).abs() < 1e-4, "{name}: {n} of frame {frames} is {read}, not {}", -meant);
            }
            frames += 1;
        }
        assert_eq!(frames, slices * volumes, "{name}");
        source.skip_to_volume(volumes - 1).expect("the last volume");
        assert_eq!(source.next_frame().expect("a frame").map(|f| f.volume as usize), Some(volumes - 1));
        let shown = if is_grey { [0.0, 255.0] } else { [-60.0, 0.0] };
        assert_eq!(source.range(), shown, "{name}");
    }
}

#[test]
fn what_is_not_read_is_named_in_one_line() {
    for (name, named) in [
        ("rf.uff", "both signs: RF data"),
        ("channels.uff", "several channels or waves"),
        ("wrong.uff", "has 35 pixels, the scan has 36"),
        ("uneven.uff", "z_axis: is not even"),
        ("channel-data.uff", "uff.channel_data"),
        ("other.h5", "not one of USTB"),
        // Chunks that are not there: a gigabyte of zeros from a small file.
        (
            "hollow.uff",
            "has the shape 65536 x 1 x 1 x 4096, 1073741824 bytes; a file of 19216 bytes holds at most 20879488",
        ),
    ] {
        let error = open(&file(name), None).err().expect(name).to_string();
        assert!(error.contains(named) && error.lines().count() == 1 && error.contains(name), "{name}: {error}");
    }
    let options = OpenOptions { voxel_spacing: Some([1.0; 3]), ..OpenOptions::default() };
    let error = description(&file("sector.uff"), options).expect_err("refused").to_string();
    assert!(error.contains("--voxel-spacing"), "{error}");
    let said = description(&file("sector-3d.uff"), OpenOptions::default()).expect("a description");
    let said = said.rows.iter().map(|(name, value)| format!("{name}: {value}\n")).collect::<String>();
    assert!(said.contains("UFF of USTB, sector_scan") && said.contains("decibels of their envelope"), "{said}");
    assert!(!said.contains("uneven"), "axes of f32 are even as far as they can be: {said}");
}
