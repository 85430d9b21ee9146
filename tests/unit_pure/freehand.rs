//! Freehand compounding: known answers, an f64 reference written from the formula, holes, and invalid poses. Needs no GPU.

use crate::common::figures::figure;
use echolume::low_level::probe::Grid;
use echolume::low_level::source::StoredType;
use echolume::low_level::source::freehand::*;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use proptest::prelude::*;

fn grid(size: [usize; 3], spacing: f64) -> Grid {
    Grid { size, spacing: [spacing; 3], origin: [-1.0, 2.0, 0.5] }
}

/// A lattice whose axes are those of the tracker.
fn lattice(grid: Grid) -> Lattice {
    Lattice { grid, to_volume: DAffine3::IDENTITY }
}

/// A pose without a rotation, at the first voxel of a slice.
fn straight(grid: &Grid, slice: f64) -> DAffine3 {
    let scale = DMat3::from_diagonal(DVec3::from(grid.spacing));
    let first = DVec3::from(grid.origin) + DVec3::Z * slice * grid.spacing[2];
    DAffine3::from_mat3_translation(scale, first)
}

fn options() -> CompoundingOptions {
    CompoundingOptions { max_hole: 0.0, ..CompoundingOptions::default() }
}

fn compounder(grid: Grid, stored: StoredType, options: CompoundingOptions) -> Compounder {
    Compounder::new(lattice(grid), stored, options).unwrap()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn frame<'a>(to_space: DAffine3, size: [usize; 2], stored: StoredType, bytes: &'a [u8]) -> TrackedFrame<'a> {
    TrackedFrame { pose: Pose { to_space, size }, stored, bytes }
}

/// All voxels.
fn volume(compounder: &mut Compounder) -> Vec<f32> {
    compounder.changed_slices();
    let slices = (0..compounder.lattice().grid.size[2]).map(|k| compounder.slice(k).unwrap());
    match compounder.stored() {
        StoredType::U8 => slices.flatten().map(|v| f32::from(*v)).collect(),
        StoredType::U16 => slices.flat_map(|s| s.as_chunks().0).map(|v| f32::from(u16::from_le_bytes(*v))).collect(),
        StoredType::F32 => slices.flat_map(|s| s.as_chunks().0).map(|v| f32::from_le_bytes(*v)).collect(),
    }
}

#[test]
fn an_untouched_pose_does_not_move_or_blur_a_pixel() {
    let grid = grid([5, 4, 6], 0.1);
    let values: Vec<u16> = (0..20).map(|n| n * 3000 + 7).collect();
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut compounder = compounder(grid, StoredType::U16, options());
    let pushed = compounder.push(&frame(straight(&grid, 3.0), [5, 4], StoredType::U16, &bytes));
    assert_eq!(pushed, Ok(20));
    for (n, value) in volume(&mut compounder).into_iter().enumerate() {
        let expected = if n / 20 == 3 { values[n % 20] } else { 0 };
        assert_eq!(value, f32::from(expected), "voxel {n}");
    }
}

#[test]
fn a_turned_frame_lies_where_its_pose_says() {
    // Columns run along elevation, rows along minus lateral.
    let grid = Grid { size: [6, 7, 8], spacing: [1.0; 3], origin: [0.0; 3] };
    let turn = DMat3::from_cols(DVec3::Z, -DVec3::X, DVec3::Y);
    let pose = DAffine3::from_mat3_translation(turn, DVec3::new(5.0, 2.0, 1.0));
    let bytes: Vec<u8> = (1..=12).collect();
    let mut compounder = compounder(grid, StoredType::U8, options());
    assert_eq!(compounder.push(&frame(pose, [4, 3], StoredType::U8, &bytes)), Ok(12));
    let volume = volume(&mut compounder);
    for (n, value) in bytes.iter().enumerate() {
        let [x, y, z] = [5 - n / 4, 2, 1 + n % 4];
        assert_eq!(volume[(z * 7 + y) * 6 + x], f32::from(*value));
    }
    assert_eq!(volume.iter().filter(|v| **v > 0.0).count(), 12);
}

/// Smooth freehand poses: rotated about every axis, each frame a little further.
fn poses(count: usize) -> Vec<DAffine3> {
    let pose = |n: usize| {
        let t = n as f64 / count as f64;
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3 * t - 0.1, 0.2 - 0.3 * t, 0.4 * t);
        let place = DVec3::new(1.0 + t, 0.5 * t, 0.7 + 7.0 * t);
        DAffine3::from_mat3_translation(DMat3::from_quat(turn) * 0.7, place)
    };
    (0..count).map(pose).collect()
}

fn noise(n: usize) -> f32 {
    (n as u32).wrapping_mul(2_654_435_761).wrapping_add(977).wrapping_mul(2_246_822_519) as f32 / u32::MAX as f32
}

/// By voxel: the sum over all pixels of tent(dx) tent(dy) tent(dz) times their value, and the sum of these weights.
fn reference(grid: &Grid, frames: &[(DAffine3, Vec<f32>)], columns: usize) -> Vec<(f64, f64)> {
    let cells = grid.size.iter().product::<usize>();
    let mut sums = vec![(0.0, 0.0); cells];
    for (pose, values) in frames {
        for (n, value) in values.iter().enumerate() {
            let place = pose.transform_point3(DVec3::new((n % columns) as f64, (n / columns) as f64, 0.0));
            let at = (place - DVec3::from(grid.origin)) / DVec3::from(grid.spacing);
            for (cell, sum) in sums.iter_mut().enumerate() {
                let [x, y, _] = grid.size;
                let middle = DVec3::new((cell % x) as f64, (cell / x % y) as f64, (cell / (x * y)) as f64);
                let weight = (1.0 - (at - middle).abs()).max(DVec3::ZERO).element_product();
                *sum = (sum.0 + weight * f64::from(*value), sum.1 + weight);
            }
        }
    }
    sums
}

#[test]
fn the_weighted_mean_is_that_of_the_formula_in_any_order() {
    let grid = Grid { size: [9, 8, 10], spacing: [0.9, 1.0, 0.8], origin: [0.5, -0.5, 0.0] };
    let frames: Vec<_> =
        poses(9).into_iter().enumerate().map(|(f, p)| (p, (0..120).map(|n| noise(f * 120 + n)).collect())).collect();
    let expected = reference(&grid, &frames, 12);
    let mut results = Vec::new();
    for order in [[0, 1, 2, 3, 4, 5, 6, 7, 8], [8, 2, 5, 0, 7, 1, 3, 6, 4]] {
        let mut compounder = compounder(grid, StoredType::F32, options());
        for f in order {
            let (pose, values) = &frames[f];
            compounder.push(&frame(*pose, [12, 10], StoredType::F32, &floats(values))).unwrap();
        }
        results.push(volume(&mut compounder));
    }
    let (mut filled, mut worst) = (0, 0.0f64);
    for (n, (sum, weight)) in expected.iter().enumerate() {
        for result in &results {
            // A weight below the rounding limit may be counted in one and not in the other.
            if *weight > 0.01 {
                worst = worst.max((f64::from(result[n]) - sum / weight).abs());
            } else if *weight == 0.0 {
                assert_eq!(result[n], 0.0);
            }
        }
        filled += usize::from(*weight > 0.01);
    }
    println!("{filled} voxels of {}, worst error {worst:e}", expected.len());
    assert!(filled > 300);
    // Some ten additions in f32 of values up to 1, and up to 1e-6 a pixel that is left out beside 0.01.
    assert!(worst < 5e-4, "{worst}");
    figure("splat", &format!("{worst:.0e}"));
    let apart = results[0].iter().zip(&results[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart < 1e-5, "{apart}");
}

#[test]
fn a_linear_field_stays_linear() {
    // Frames half a voxel apart, of pixels of 0.35 voxels, tilted: every voxel within has some twenty pixels on all sides.
    let grid = Grid { size: [14, 14, 14], spacing: [1.0; 3], origin: [0.0; 3] };
    let field = |p: DVec3| 100.0 + 3.0 * p.x - 2.0 * p.y + 4.0 * p.z;
    let mut compounder = compounder(grid, StoredType::F32, options());
    let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.2, -0.15, 0.5));
    for k in 0..60 {
        let start = turn * DVec3::new(-10.0, -12.0, 0.5 * k as f64 - 8.0);
        let pose = DAffine3::from_mat3_translation(turn * 0.35, start + DVec3::new(4.0, 4.0, 0.0));
        let place = |n: usize| pose.transform_point3(DVec3::new((n % 80) as f64, (n / 80) as f64, 0.0));
        let values: Vec<f32> = (0..6400).map(|n| field(place(n)) as f32).collect();
        compounder.push(&frame(pose, [80, 80], StoredType::F32, &floats(&values))).unwrap();
    }
    let (mut within, mut worst) = (0, 0.0f64);
    let volume = volume(&mut compounder);
    for (n, value) in volume.into_iter().enumerate() {
        let cell = [n % 14, n / 14 % 14, n / 196];
        if cell.iter().all(|c| (3..11).contains(c)) {
            within += 1;
            let place = DVec3::from_array(cell.map(|c| c as f64));
            worst = worst.max((f64::from(value) - field(place)).abs());
        }
    }
    println!("{within} voxels, worst error {worst}: {} of a voxel's gradient", worst / 29f64.sqrt());
    assert!(within == 512 && worst < 0.01 * 29f64.sqrt(), "{worst}");
    figure("splat-linear", &format!("{:.3}", worst / 29f64.sqrt()));
}

#[test]
fn holes_up_to_the_width_are_bridged_and_wider_ones_stay_empty() {
    for (stored, low, high) in [(StoredType::U8, 40.0, 200.0), (StoredType::F32, -8.0, 8.0)] {
        for gap in 1..=5usize {
            let grid = grid([4, 4, 12], 0.5);
            let mut compounder =
                compounder(grid, stored, CompoundingOptions { max_hole: 1.5, ..CompoundingOptions::default() });
            for (slice, value) in [(2, low), (3 + gap, high)] {
                let values = floats(&[value; 16]);
                compounder.push(&frame(straight(&grid, slice as f64), [4, 4], StoredType::F32, &values)).unwrap();
            }
            for (n, value) in volume(&mut compounder).into_iter().enumerate() {
                let z = n / 16;
                let expected = match z {
                    2 => low,
                    z if z == 3 + gap => high,
                    // Sticks at any angle end in the two frames, in the same shares: the result is the straight line between them.
                    z if z > 2 && z < 3 + gap && gap <= 3 => low + (high - low) * (z - 2) as f32 / (gap + 1) as f32,
                    _ => 0.0,
                };
                let half = if stored == StoredType::U8 { 0.5 } else { 1e-5 };
                assert!((value - expected).abs() <= half, "gap {gap}, slice {z}: {value}, not {expected}");
            }
        }
    }
}

#[test]
fn only_slices_near_a_frame_are_given_out_again() {
    let grid = grid([4, 3, 20], 1.0);
    let mut compounder =
        compounder(grid, StoredType::U8, CompoundingOptions { max_hole: 2.0, ..CompoundingOptions::default() });
    assert!(compounder.changed_slices().is_empty());
    let push = |compounder: &mut Compounder, slice: f64, value: u8| {
        compounder.push(&frame(straight(&grid, slice), [4, 3], StoredType::U8, &[value; 12])).unwrap()
    };
    push(&mut compounder, 10.0, 50);
    assert_eq!(compounder.slice(10), Some(&[0; 12][..]), "not before it is asked for");
    assert_eq!(compounder.changed_slices(), [8, 9, 10, 11, 12]);
    assert!(compounder.changed_slices().is_empty());
    push(&mut compounder, 12.5, 100);
    assert_eq!(compounder.changed_slices(), [10, 11, 12, 13, 14, 15]);
    // Slice 11 is between the previous frame and half of the new one.
    let middle: Vec<u8> = [10, 11, 12, 13].map(|k| compounder.slice(k).unwrap()[5]).into();
    assert_eq!(middle, [50, 75, 100, 100]);
    push(&mut compounder, 0.0, 9);
    push(&mut compounder, 19.0, 9);
    assert_eq!(compounder.changed_slices(), [0, 1, 2, 17, 18, 19]);
    assert_eq!((compounder.slice(0), compounder.slice(20)), (Some(&[9; 12][..]), None));
}

#[test]
fn frames_at_one_place_become_their_mean() {
    let grid = grid([2, 2, 2], 1.0);
    let mut compounder = compounder(grid, StoredType::U8, options());
    for value in [20, 30, 10] {
        compounder.push(&frame(straight(&grid, 0.0), [2, 2], StoredType::U8, &[value; 4])).unwrap();
    }
    assert_eq!(volume(&mut compounder)[..4], [20.0; 4]);
}

#[test]
fn a_probe_that_is_held_still_does_not_make_its_picture_drift() {
    let grid = grid([1, 1, 1], 1.0);
    let mut compounder = compounder(grid, StoredType::F32, options());
    let pose =
        DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(1e-5)), DVec3::from(grid.origin) + 0.2);
    let bytes: Vec<u8> = (0..160_000).map(|n| 199 + (n % 3) as u8).collect();
    for _ in 0..20 {
        compounder.push(&frame(pose, [400, 400], StoredType::U8, &bytes)).unwrap();
    }
    let value = volume(&mut compounder)[0];
    assert!((value - 200.0).abs() < 0.01, "{value} after 3.2 million pixels");
}

#[test]
fn no_unusable_frame_changes_the_volume_or_goes_uncounted() {
    let grid = grid([4, 4, 4], 1.0);
    let mut compounder = compounder(grid, StoredType::U8, options());
    let good = straight(&grid, 1.0);
    let with = |change: &dyn Fn(&mut DAffine3)| {
        let mut pose = good;
        change(&mut pose);
        pose
    };
    let poses = [
        with(&|p| p.translation.y = f64::NAN),
        with(&|p| p.matrix3.x_axis.x = f64::INFINITY),
        with(&|p| p.matrix3.z_axis.z = f64::NEG_INFINITY),
        with(&|p| p.matrix3.y_axis = p.matrix3.x_axis * 2.0),
        with(&|p| p.matrix3.x_axis = DVec3::ZERO),
        with(&|p| p.matrix3 = DMat3::ZERO),
        with(&|p| p.translation.x = 1e7),
        with(&|p| p.matrix3.x_axis *= 1e-300),
        with(&|p| p.matrix3.y_axis *= 1e300),
    ];
    for pose in &poses {
        let refused = compounder.push(&frame(*pose, [4, 4], StoredType::U8, &[9; 16])).unwrap_err();
        assert!(refused.starts_with("a pose ") && refused.lines().count() == 1, "{refused}");
    }
    for (size, count) in [([0, 4], 0), ([4, 4], 15), ([4, 4], 17), ([1 << 40, 1 << 40], 16)] {
        assert!(compounder.push(&frame(good, size, StoredType::U8, &vec![9; count])).is_err());
    }
    let counts = CompoundingCounts { refused: 13, ..CompoundingCounts::default() };
    assert_eq!(compounder.counts(), counts);
    assert!(volume(&mut compounder).iter().all(|v| *v == 0.0));
    // Outside the volume, and inside it again with non-finite pixels.
    let away = with(&|p| p.translation.z += 100.0);
    assert_eq!(compounder.push(&frame(away, [4, 4], StoredType::U8, &[9; 16])), Ok(0));
    let bytes = floats(&[1.0, f32::NAN, f32::INFINITY, -1e31]);
    assert_eq!(compounder.push(&frame(good, [2, 2], StoredType::F32, &bytes)), Ok(1));
    assert_eq!(compounder.counts(), CompoundingCounts { frames: 2, outside: 1, pixels: 3, ..counts });
    assert_eq!(volume(&mut compounder).iter().sum::<f32>(), 1.0);
    // A single pixel.
    let one = with(&|p| p.translation += 0.5);
    assert_eq!(compounder.push(&frame(one, [1, 1], StoredType::U8, &[8])), Ok(1));
}

#[test]
fn clipped_pixels_are_not_compounded() {
    let grid = grid([4, 4, 1], 1.0);
    for (clip, expected) in [
        ([1, 2, 2, 1], Some(vec![9, 10])),
        ([3, 3, 100, usize::MAX], Some(vec![15])),
        ([4, 0, 1, 1], None),
        ([0, 0, 0, 4], None),
    ] {
        let mut compounder = compounder(grid, StoredType::U8, CompoundingOptions { clip: Some(clip), ..options() });
        let bytes: Vec<u8> = (0..16).collect();
        let pushed = compounder.push(&frame(straight(&grid, 0.0), [4, 4], StoredType::U8, &bytes));
        assert_eq!(pushed.is_ok(), expected.is_some(), "{pushed:?}");
        let left: Vec<usize> = volume(&mut compounder).iter().filter(|v| **v > 0.0).map(|v| *v as usize).collect();
        assert_eq!(left, expected.unwrap_or_default());
    }
}

#[test]
fn a_lattice_lies_around_its_frames_along_their_axes() {
    let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.9, -1.2, 2.0));
    let pose = |k: f64| {
        let start = DVec3::new(40.0, -20.0, 7.0) + turn * DVec3::new(0.0, 0.0, k);
        let scaled = DMat3::from_cols(turn.x_axis * 0.2, turn.y_axis * 0.1, turn.z_axis);
        Pose { to_space: DAffine3::from_mat3_translation(scaled, start), size: [101, 201] }
    };
    let poses: Vec<Pose> = (0..11).map(|k| pose(f64::from(k))).collect();
    let options = CompoundingOptions { margin: 1.0, ..CompoundingOptions::default() };
    let lattice = Lattice::around(&poses, &options).unwrap();
    let grid = lattice.grid;
    // 20 x 20 x 10 mm and 1 mm on either side.
    assert_eq!(grid.size, [111, 221, 61]);
    for (axis, (spacing, origin)) in [(0.2, -11.0), (0.1, -1.0), (0.2, -6.0)].into_iter().enumerate() {
        assert!((grid.spacing[axis] - spacing).abs() < 1e-9 && (grid.origin[axis] - origin).abs() < 1e-9, "{grid:?}");
    }
    let moved = lattice.to_volume.transform_vector3(turn * DVec3::new(1.0, 2.0, 3.0));
    assert!((moved - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-9, "{moved}");
    assert!((lattice.to_volume.matrix3.determinant() - 1.0).abs() < 1e-9, "turned over");
    // Every pixel is inside.
    let mut all = Compounder::new(lattice, StoredType::U8, options.clone()).unwrap();
    for pose in &poses {
        let frame = TrackedFrame { pose: *pose, stored: StoredType::U8, bytes: &vec![200; 101 * 201] };
        assert_eq!(all.push(&frame), Ok(101 * 201));
    }
    // Coarser until it fits, and not much coarser than that.
    for most in [100_000, 1000, 1] {
        let options = CompoundingOptions { max_voxels: most, spacing: Some(0.05), ..options.clone() };
        let Grid { size, spacing, .. } = Lattice::around(&poses, &options).unwrap().grid;
        let count: usize = size.iter().product();
        assert!(count <= most && spacing[0] == spacing[2] && (most == 1 || count > most / 3), "{size:?}");
    }
    let clipped = CompoundingOptions { clip: Some([50, 100, 1, 1]), margin: 0.0, ..options.clone() };
    assert_eq!(Lattice::around(&poses[..1], &clipped).unwrap().grid.size, [1; 3]);
    let none = Pose { to_space: DAffine3::NAN, size: [4, 4] };
    assert!(Lattice::around(&[none], &options).unwrap_err().contains("none of 1 poses"));
    assert!(Lattice::around(&[], &options).is_err());
    assert_eq!(Lattice::around(&[none, poses[0]], &options), Lattice::around(&poses[..1], &options));
    // Poses in all directions have no mean: the first one is used.
    let back = Pose { to_space: poses[0].to_space * DAffine3::from_rotation_z(std::f64::consts::PI), ..poses[0] };
    let (both, first) = (Lattice::around(&[poses[0], back], &options), Lattice::around(&poses[..1], &options));
    assert!((both.unwrap().to_volume.matrix3 - first.unwrap().to_volume.matrix3).abs_diff_eq(DMat3::ZERO, 1e-9));
    for wrong in [
        CompoundingOptions { margin: -1.0, ..options.clone() },
        CompoundingOptions { margin: f64::NAN, ..options.clone() },
        CompoundingOptions { spacing: Some(0.0), ..options.clone() },
        CompoundingOptions { spacing: Some(f64::INFINITY), ..options.clone() },
        CompoundingOptions { clip: Some([500, 0, 1, 1]), ..options.clone() },
    ] {
        assert!(Lattice::around(&poses, &wrong).is_err(), "{wrong:?}");
    }
}

/// Pictures of 21 x 11 pixels, 0.5 mm apart, whose samples are a linear field of their place.
fn picture(turn: DQuat, at: DVec3) -> (Pose, Vec<u8>) {
    let pose = Pose {
        to_space: DAffine3::from_scale_rotation_translation(DVec3::new(0.5, 0.5, 1.0), turn, at),
        size: [21, 11],
    };
    let values: Vec<f32> = (0..231).map(|n| field(pose.place((n % 21) as f64, (n / 21) as f64)) as f32).collect();
    (pose, floats(&values))
}

fn field(place: DVec3) -> f64 {
    1000.0 + 3.0 * place.x - 2.0 * place.y + place.z
}

/// Every voxel of a sweep that is filled, as its difference from the field at its place.
fn off(sweep: &Sweep) -> Vec<f64> {
    let lattice = sweep.lattice().expect("a place");
    let Grid { size: [x, y, z], spacing, origin } = lattice.grid;
    let back = lattice.to_volume.inverse();
    let mut off = Vec::new();
    for k in 0..z {
        for (n, value) in sweep.slice(k).expect("a slice").as_chunks().0.iter().enumerate().take(x * y) {
            let cell = DVec3::new((n % x) as f64, (n / x) as f64, k as f64);
            let place = back.transform_point3(DVec3::from(origin) + cell * DVec3::from(spacing));
            let value = f64::from(f32::from_le_bytes(*value));
            off.extend((value != 0.0).then(|| value - field(place)));
        }
    }
    off
}

/// A sweep of 75 mm of which the first 25 mm or 5 mm place the volume.
#[test]
fn a_volume_grows_around_pictures_that_leave_it() {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -0.3, 1.0);
    let along = turn * DVec3::Z;
    // The first is large enough to stay as fine as it began, the second becomes coarser, the third cannot grow so far.
    for (most, first, coarser) in [(1 << 25, 100, 1.0..=1.0), (50_000, 100, 1.2..=2.01), (6_000, 20, 1.2..=2.01)] {
        let options = CompoundingOptions { max_voxels: most, margin: 1.0, ..options() };
        let mut sweep = Sweep::new(options, Schedule { first, ..Schedule::default() }, StoredType::F32);
        let (mut lost, mut began, mut finest) = (0, None, 0.0);
        for n in 0..300 {
            let (pose, bytes) = picture(turn, DVec3::new(50.0, -20.0, 8.0) + along * 0.25 * f64::from(n));
            lost += u32::from(sweep.push(pose, bytes) == Err(Refusal::Outside));
            sweep.update(n == 299, |refusal| panic!("{refusal:?}"));
            if began.is_none()
                && let Some(lattice) = sweep.lattice()
            {
                (began, finest) = (Some(lattice.grid.size[2]), lattice.grid.spacing[0]);
            }
        }
        let Grid { size, spacing, .. } = sweep.lattice().expect("a place").grid;
        assert!(size.iter().product::<usize>() <= most && Some(size[2]) != began, "{size:?}");
        let ratio = spacing[0] / finest;
        assert!(coarser.contains(&((ratio * 1e6).round() / 1e6)), "{most}: {ratio}");
        let off = off(&sweep);
        let length = (size[2] - 1) as f64 * spacing[2];
        match most {
            6_000 => assert!(lost > 0 && length < 74.75, "{lost} lost, {length} mm"),
            _ => assert!(lost == 0 && length >= 74.75, "{lost} lost, {length} mm"),
        }
        // At the border a pixel goes to voxels as far as a diagonal, 0.9 mm and more where it is coarser, of a slope of 3.7 a mm. Within that cancels.
        let [worst, sum] = off.iter().fold([0.0f64, 0.0], |[most, sum], off| [most.max(off.abs()), sum + off.abs()]);
        assert!(worst < 6.0 * ratio && sum / (off.len() as f64) < 0.9 * ratio, "{worst}, {}", sum / off.len() as f64);
        assert!(off.len() > 1500, "{}", off.len());
    }
}

/// With the same spacing nothing is computed again: the volume is that of one with the room from the beginning.
#[test]
fn growth_keeps_every_voxel() {
    let swept = |extent: Option<f64>| {
        let options = CompoundingOptions { extent, spacing: Some(0.5), margin: 1.0, ..options() };
        let mut sweep = Sweep::new(options, Schedule { first: 3, ..Schedule::default() }, StoredType::F32);
        let mut sizes = Vec::new();
        for n in 0..30 {
            let (pose, bytes) = picture(DQuat::IDENTITY, DVec3::new(0.0, 0.1 * f64::from(n % 3), -0.5 * f64::from(n)));
            assert_eq!(sweep.push(pose, bytes), Ok(()));
            sweep.update(n == 29, |refusal| panic!("{refusal:?}"));
            sizes.extend(sweep.lattice().map(|lattice| lattice.grid.size));
        }
        sizes.dedup();
        (off(&sweep), sizes.len(), sweep.lattice().expect("a place").grid)
    };
    let ((grown, sizes, _), (stated, one, grid)) = (swept(None), swept(Some(14.5)));
    // In the direction of the sweep: 14.5 mm and 1 mm on either side, which nothing outgrows.
    assert!(sizes > 2 && one == 1 && grid.size[2] == 34, "{sizes} {one} {grid:?}");
    assert!(grown == stated && grown.len() > 6000, "{} {}", grown.len(), stated.len());
}

/// A sweep of fewer pictures than place a volume is placed when no more come.
#[test]
fn silence_ends_the_wait_for_the_first_pictures() {
    for (silence, expected) in [(std::time::Duration::ZERO, Some(true)), (std::time::Duration::from_secs(60), None)] {
        let mut sweep = Sweep::new(options(), Schedule { silence, ..Schedule::default() }, StoredType::F32);
        for n in 0..5 {
            let (pose, bytes) = picture(DQuat::IDENTITY, DVec3::Z * f64::from(n));
            assert_eq!(sweep.push(pose, bytes), Ok(()));
        }
        assert_eq!(sweep.update(false, |refusal| panic!("{refusal:?}")), expected);
    }
}

#[test]
fn a_volume_that_is_too_large_is_refused_before_anything_is_allocated() {
    let huge = usize::MAX;
    for (grid, options, named) in [
        (grid([1 << 21, 1 << 21, 1 << 21], 1.0), options(), "at most 33554432"),
        (
            grid([1 << 12, 1 << 12, 1 << 12], 1.0),
            CompoundingOptions { max_voxels: huge, ..options() },
            "at most 2147483648",
        ),
        (grid([4, 0, 4], 1.0), options(), "size"),
        (grid([4, 4, 4], f64::NAN), options(), "spacing"),
        (grid([4, 4, 4], 1.0), CompoundingOptions { max_hole: 65.0, ..options() }, "widest hole"),
        (grid([4, 4, 4], 1.0), CompoundingOptions { max_hole: f64::NAN, ..options() }, "widest hole"),
    ] {
        let refused = Compounder::new(lattice(grid), StoredType::U8, options).err().unwrap();
        assert!(refused.contains(named) && refused.lines().count() == 1, "{refused}");
    }
    let nowhere = Lattice { to_volume: DAffine3::NAN, ..lattice(grid([2, 2, 2], 1.0)) };
    assert!(Compounder::new(nowhere, StoredType::U8, options()).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_pose_causes_a_panic(
        numbers in prop::collection::vec(prop_oneof![-20.0..20.0f64, any::<f64>()], 24),
        size in prop::array::uniform2(0usize..9),
        clip in prop::option::of(prop::array::uniform4(0usize..9)),
        values in prop::collection::vec(any::<f32>(), 64),
    ) {
        let grid = Grid { size: [5, 6, 7], spacing: [1.0; 3], origin: [-2.0; 3] };
        let options = CompoundingOptions { clip, max_voxels: 20_000, ..CompoundingOptions::default() };
        let mut compounder = compounder(grid, StoredType::F32, options.clone());
        let mut poses = Vec::new();
        for numbers in numbers.chunks(12) {
            let pose = DAffine3::from_cols_array(numbers.try_into().unwrap());
            poses.push(Pose { to_space: pose, size });
            let count = (size[0] * size[1]).min(64);
            let _ = compounder.push(&frame(pose, size, StoredType::F32, &floats(&values[..count])));
        }
        let counts = compounder.counts();
        prop_assert_eq!(counts.frames + counts.refused, 2);
        prop_assert!(volume(&mut compounder).iter().all(|v| v.is_finite() && !v.is_subnormal()));
        if let Ok(lattice) = Lattice::around(&poses, &options) {
            prop_assert!(lattice.grid.size.iter().product::<usize>() <= 20_000 && lattice.grid.check().is_ok());
            if let Ok(mut compounder) = Compounder::new(lattice, StoredType::U16, options) {
                let bytes = vec![1; size[0] * size[1]];
                for pose in &poses {
                    let _ = compounder.push(&TrackedFrame { pose: *pose, stored: StoredType::U8, bytes: &bytes });
                }
                // The lattice contains the frames that it was made for.
                prop_assert_eq!(compounder.counts().outside, 0);
            }
        }
    }
}
