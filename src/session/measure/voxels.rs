//! The volume of the voxels of a box whose echo reaches a threshold, computed from the frames on the CPU in f64.

use crate::source::convert::Volume;
use glam::DVec3;
use rayon::prelude::*;

/// Most voxels that are counted.
const MAX_VOXELS: f64 = 4e6;
/// Most voxels along an edge of the box.
const MAX_EDGE: f64 = 4096.0;

/// The voxels of a box whose echo reaches a threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted {
    /// Volume of the voxels whose echo reaches the threshold, mm^3.
    pub volume: f64,
    /// Number of voxels in the box. `above` is the number of those whose echo reaches the threshold.
    pub voxels: u64,
    pub above: u64,
    /// Lengths of the edges of a voxel, mm.
    pub voxel: DVec3,
}

/// Counts the voxels of a box, from `low` to `high` in space, mm, whose echo is at least `threshold`, in stored values. The box is divided
/// into equal voxels of about `pitch` mm, or larger ones if that would make more than 4 million. Each voxel is judged by the echo at its
/// centre. Voxels outside the insonified volume do not count. None if the box is empty.
pub fn count(volume: &Volume, [low, high]: [DVec3; 2], pitch: f64, threshold: f64) -> Option<Counted> {
    let size = high - low;
    let is_box = size.is_finite() && size.min_element() > 0.0 && pitch.is_finite() && pitch > 0.0;
    if !is_box {
        return None;
    }
    let pitch = pitch.max((size.element_product() / MAX_VOXELS).cbrt());
    let counts = (size / pitch).round().clamp(DVec3::ONE, DVec3::splat(MAX_EDGE));
    let voxel = size / counts;
    let [columns, rows, slices] = counts.to_array().map(|n| n as u64);
    let of_row = |n: u64| {
        let (row, slice) = (n % rows, n / rows);
        let is_above = |column: &u64| {
            let centre = DVec3::new(*column as f64, row as f64, slice as f64) + 0.5;
            volume.at(low + voxel * centre).is_some_and(|echo| echo >= threshold)
        };
        (0..columns).filter(is_above).count() as u64
    };
    let above: u64 = (0..rows * slices).into_par_iter().map(of_row).sum();
    let volume = above as f64 * voxel.element_product();
    Some(Counted { volume, voxels: columns * rows * slices, above, voxel })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::{Geometry, Grid};
    use crate::source::{Frame, StoredType};

    /// A ball of 12 mm in 30 mm, one voxel a mm, with an edge of one voxel.
    fn ball() -> Volume {
        let grid = Grid { size: [31, 31, 31], spacing: [1.0; 3], origin: [-15.0; 3] };
        let mut volume = Volume::new(Geometry::Cartesian(grid), StoredType::U8);
        for slice in 0..31usize {
            let echo = |n: usize| {
                let at = DVec3::new((n % 31) as f64, (n / 31) as f64, slice as f64) - 15.0;
                (255.0 * (12.0 - at.length() + 0.5).clamp(0.0, 1.0)).round() as u8
            };
            let bytes = (0..31 * 31).map(echo).collect();
            volume.take(Frame::of_slice(0, slice, bytes));
        }
        volume
    }

    #[test]
    fn a_ball_has_its_volume_to_one_percent_and_a_part_of_it_its_own() {
        let (volume, truth) = (ball(), 4.0 / 3.0 * std::f64::consts::PI * 1728.0);
        let all = count(&volume, [DVec3::splat(-14.0), DVec3::splat(14.0)], 0.5, 127.5).expect("a box");
        assert!((all.volume / truth - 1.0).abs() < 0.01, "{} of {truth}", all.volume);
        let half = count(&volume, [DVec3::splat(-14.0), DVec3::new(14.0, 0.0, 14.0)], 0.5, 127.5).expect("a box");
        assert!((half.volume / truth - 0.5).abs() < 0.01, "{} of {truth}", half.volume);
    }

    #[test]
    fn the_count_is_bounded_and_what_is_outside_counts_nothing() {
        let volume = ball();
        let huge = count(&volume, [DVec3::splat(-1e4), DVec3::splat(1e4)], 1e-3, 0.0).expect("a box");
        assert!(huge.voxels <= 4_200_000, "{}", huge.voxels);
        let beside = count(&volume, [DVec3::splat(20.0), DVec3::splat(30.0)], 1.0, 0.0).expect("a box");
        assert_eq!((beside.above, beside.volume), (0, 0.0));
        assert_eq!(count(&volume, [DVec3::ONE, DVec3::ONE], 1.0, 0.0), None);
        assert_eq!(count(&volume, [DVec3::ZERO, DVec3::splat(f64::NAN)], 1.0, 0.0), None);
    }
}
