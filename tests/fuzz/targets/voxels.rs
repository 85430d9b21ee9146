//! Tracked frames with any pose.

use super::{Bytes, told};
use echolume::low_level::probe::Grid;
use echolume::low_level::source::StoredType;
use echolume::low_level::source::freehand::{Compounder, CompoundingOptions, Lattice, Pose, TrackedFrame};
use glam::{DAffine3, DVec3};

const MOST_VOXELS: usize = 1 << 12;

fn pose(bytes: &mut Bytes, nearly: bool) -> Pose {
    let mut axis = |usual: DVec3| match nearly {
        true => usual + DVec3::from(std::array::from_fn(|_| bytes.number().clamp(-1.0, 1.0) / 8.0)),
        false => DVec3::from(std::array::from_fn(|_| bytes.number())),
    };
    let to_space = DAffine3::from_cols(axis(DVec3::X), axis(DVec3::Y), axis(DVec3::Z), axis(DVec3::ZERO));
    Pose { to_space, size: [1 + usize::from(bytes.u8() % 9), 1 + usize::from(bytes.u8() % 9)] }
}

pub fn compounder(bytes: &[u8]) -> String {
    let mut bytes = Bytes(bytes);
    let stored = |n: u8| [StoredType::U8, StoredType::U16, StoredType::F32][usize::from(n % 3)];
    let options = CompoundingOptions {
        max_hole: if bytes.u8() < 128 { 2.0 } else { bytes.number() },
        clip: (bytes.u8() > 200).then(|| std::array::from_fn(|_| usize::from(bytes.u8()) << (bytes.u8() % 8))),
        spacing: (bytes.u8() > 128).then(|| bytes.number()),
        margin: if bytes.u8() < 200 { 1.0 } else { bytes.number() },
        extent: (bytes.u8() > 200).then(|| bytes.number()),
        max_voxels: MOST_VOXELS,
    };
    let first = (bytes.u8(), bytes.u8() < 200);
    let lattice = match first {
        (0..128, nearly) => {
            let poses = [pose(&mut bytes, nearly), pose(&mut bytes, nearly)];
            match Lattice::around(&poses, &options) {
                Ok(lattice) => lattice,
                Err(fault) => return told(fault),
            }
        }
        _ => {
            let size = std::array::from_fn(|_| usize::from(bytes.u8() % 13));
            let grid = Grid { size, spacing: [1.0, bytes.number(), 1.0], origin: [0.0, bytes.number(), 0.0] };
            Lattice { grid, to_volume: glam::DAffine3::IDENTITY }
        }
    };
    let kept = stored(bytes.u8());
    let mut compounder = match Compounder::new(lattice, kept, options) {
        Ok(compounder) => compounder,
        Err(fault) => return told(fault),
    };
    let [x, y, z] = lattice.grid.size;
    assert!(x * y * z <= MOST_VOXELS);
    let mut outcome = String::new();
    for _ in 0..8 {
        let nearly = bytes.u8() < 200;
        let pose = pose(&mut bytes, nearly);
        let stored = stored(bytes.u8());
        let [columns, rows] = pose.size;
        let mut samples = bytes.take(columns * rows * stored.bytes()).to_vec();
        if samples.len() % 7 != 1 {
            samples.resize(columns * rows * stored.bytes(), 99);
        }
        match compounder.push(&TrackedFrame { pose, stored, bytes: &samples }) {
            Ok(inside) => assert!(inside <= (columns * rows) as u64),
            Err(fault) => outcome += &told(fault),
        }
        let changed = compounder.changed_slices();
        assert!(changed.is_sorted() && changed.last().is_none_or(|last| *last < z));
        outcome += if changed.is_empty() { "nothing" } else { "voxels" };
    }
    for k in 0..z {
        let slice = compounder.slice(k).expect("is there");
        assert_eq!(slice.len(), x * y * kept.bytes());
        if kept == StoredType::F32 {
            let finite = |v: &[u8; 4]| f32::from_le_bytes(*v).is_finite();
            assert!(slice.as_chunks().0.iter().all(finite), "slice {k} has a voxel that is not finite");
        }
    }
    assert!(compounder.slice(z).is_none());
    let counts = compounder.counts();
    assert_eq!(counts.frames + counts.refused, 8);
    outcome
}
