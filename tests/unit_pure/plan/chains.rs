//! The slots that the filters of a chain alternate between, and how much of a slice each of them writes.

use super::{fan, scene};
use crate::common::probes::voxels;
use crate::common::scenes;
use echolume::low_level::passes::chain::{copied, distance_end, picture_end};
use echolume::low_level::passes::{DispatchArgs, Part, Pass, Slot, by_name, rendered};
use echolume::low_level::probe::Advance;
use echolume::low_level::scene::{Input, Scene, VisibleBounds};
use echolume::low_level::source::StoredType;

fn pass(name: &str) -> &'static Pass {
    by_name(name).expect("pass")
}

/// The slots that a pass reads and writes as a link of its chain.
fn link(scene: &Scene, name: &str, iteration: u32) -> (Slot, Slot) {
    pass(name).link_slots(scene, &args(iteration)).expect("a link")
}

fn args(iteration: u32) -> DispatchArgs {
    DispatchArgs { iteration, ..DispatchArgs::default() }
}

#[test]
fn filters_alternate_between_two_slots_and_the_last_writes_the_target() {
    let filters = "slices = { median = true, sigma = {}, perona_malik = { scheme = 'aos', repeat = 2 } }";
    let frames = scene(voxels([8, 8, 5]), &format!("mode = 'mip'\n{filters}"));
    let link = |name: &str, iteration| link(&frames, name, iteration);
    assert_eq!(link("load_slice", 0), (Slot::Frames, Slot::SliceA));
    assert_eq!(link("median_slice", 0), (Slot::SliceA, Slot::SliceB));
    assert_eq!(link("sigma_slice", 0), (Slot::SliceB, Slot::SliceA));
    // Four dispatches are one step and one filter of the chain.
    for iteration in 0..4 {
        assert_eq!(link("aos_slice", iteration), (Slot::SliceA, Slot::SliceB));
        assert_eq!(link("aos_slice", 4 + iteration), (Slot::SliceB, Slot::Volume));
    }
    let smoothed = scene(voxels([8, 8, 5]), "slices = { median = true, smooth = { elevation = 1.0 } }");
    assert_eq!(self::link(&smoothed, "median_slice", 0), (Slot::SliceA, Slot::SharpVolume));
}

#[test]
fn filters_read_frames_that_are_not_scaled_as_they_are() {
    let of = |stored, range, toml: &str| scenes::scene(voxels([8, 8, 5]), Input { stored, range }, toml);
    let filters = "slices = { median = true, smooth = { lateral = 1.0 } }";
    for (stored, full) in [(StoredType::U8, 255.0), (StoredType::U16, 65535.0)] {
        let frames = of(stored, [0.0, full], filters);
        assert_eq!(pass("load_slice").needed(&frames), Err("the first filter reads frames as they are"));
        assert_eq!(link(&frames, "median_slice", 0), (Slot::Frames, Slot::SliceA));
        assert_eq!(link(&frames, "gaussian_lateral", 0), (Slot::SliceA, Slot::Volume));
        let read = pass("median_slice").reads(&frames, &args(0));
        assert_eq!((read[0].slot, read[0].part), (Slot::Frames, Part::Layers));
        assert!(
            pass("load_slice").is_needed(&of(stored, [0.0, full], "slices.format = 'r16f'")),
            "no filter reads them"
        );
        assert!(pass("load_slice").is_needed(&of(stored, [1.0, full], filters)), "scaled");
    }
    assert!(pass("load_slice").is_needed(&of(StoredType::F32, [0.0, 1.0], filters)), "clamped");
    let polar = scenes::scene(fan(Advance::None), Input { stored: StoredType::U8, range: [0.0, 255.0] }, filters);
    assert!(pass("scan_convert").is_needed(&polar));
}

#[test]
fn an_empty_chain_leaves_its_slot_unchanged() {
    let plain = scene(voxels([8, 8, 5]), "mode = 'sr'");
    assert_eq!((distance_end(&plain), picture_end(&plain)), (Slot::Distance, Slot::Picture));
    let filtered = scene(
        voxels([8, 8, 5]),
        "distance = { median = 3, perona_malik = { repeat = 3 } }\npost = { sigma = {}, perona_malik = { scheme = 'aos', repeat = 2 } }",
    );
    assert_eq!(link(&filtered, "median_distance", 0), (Slot::Distance, Slot::DistanceA));
    assert_eq!(link(&filtered, "perona_malik_distance", 1), (Slot::DistanceB, Slot::DistanceA));
    assert_eq!(distance_end(&filtered), Slot::DistanceB);
    assert_eq!(link(&filtered, "sigma_picture", 0), (Slot::Picture, Slot::SmoothPicture));
    assert_eq!(link(&filtered, "aos_picture", 5), (Slot::SmoothPictureB, Slot::SmoothPicture));
    assert_eq!(picture_end(&filtered), Slot::SmoothPicture);
}

#[test]
fn frames_are_copied_where_the_volume_stores_them_without_loss() {
    let of = |stored, range, toml: &str| copied(&scenes::scene(voxels([8, 8, 5]), Input { stored, range }, toml));
    let (bytes, words) = ([0.0, 255.0], [0.0, 65535.0]);
    let format = |format: &str| format!("slices = {{ format = '{format}' }}");
    assert_eq!(of(StoredType::U8, bytes, &format("r8")), Some(Slot::Volume));
    assert_eq!(of(StoredType::U16, words, &format("r16")), Some(Slot::Volume));
    let smoothed = "slices = { format = 'r8', smooth = { elevation = 1.0 } }";
    assert_eq!(of(StoredType::U8, bytes, smoothed), Some(Slot::SharpVolume));
    assert_eq!(of(StoredType::U8, [0.0, 200.0], &format("r8")), None);
    assert_eq!(of(StoredType::U16, [0.0, 4095.0], &format("r16")), None);
    for (stored, range, wider) in
        [(StoredType::U8, bytes, "r16"), (StoredType::U8, bytes, "r32f"), (StoredType::U16, words, "r32f")]
    {
        assert_eq!(of(stored, range, &format(wider)), Some(Slot::Volume), "{wider} holds them");
        assert_eq!(of(stored, [0.0, 100.0], &format(wider)), None, "scaled");
        assert_eq!(of(stored, range, &format("r16f")), None, "16-bit floats round");
    }
    assert_eq!(of(StoredType::U16, words, &format("r8")), None);
    assert_eq!(of(StoredType::F32, [0.0, 1.0], &format("r16")), None);
    assert_eq!(of(StoredType::F32, [0.0, 1.0], &format("r32f")), Some(Slot::Volume));
    assert_eq!(of(StoredType::F32, [0.0, 2.0], &format("r32f")), None);
    assert_eq!(of(StoredType::U8, bytes, "slices = { format = 'r8', median = true }"), None);
    assert_eq!(copied(&scene(fan(Advance::None), &format("r8"))), None, "lines are no pixels");
}

#[test]
fn renderings_with_several_rays_or_planes_use_an_intermediate_slot() {
    let of = |toml: &str| rendered(&scene(voxels([8, 8, 5]), toml));
    assert_eq!(of("mode = 'vr'"), Slot::Picture);
    assert_eq!(of("mode = 'vr'\nray = { rays = 2 }"), Slot::Rendered);
    assert_eq!(of("mode = 'vr'\nray = { subsampling = 2 }"), Slot::Rendered);
    assert_eq!(of("mode = 'vr'\nlayout = 'four'"), Slot::Rendered);
    assert_eq!(of("mode = 'plane'\nray = { rays = 2 }"), Slot::Picture, "planes cast no rays");
}

/// A slice of 400 x 400 of which columns and rows from `low` up to `high` are visible.
fn seen(filters: &str, low: u32, high: u32) -> Scene {
    let scene = scene(voxels([400, 400, 3]), &format!("mode = 'mip'\nslices = {{ {filters} }}"));
    Scene { visible_bounds: VisibleBounds { low: [low, low, 0], high: [high, high, 3] }, ..scene }
}

/// How many columns and rows around the visible bounds a pass writes, from where complete workgroups of 32 are added: to the left and right, above
/// and below.
fn around(filters: &str, pass: &str, iteration: u32) -> [u32; 4] {
    let whole = seen(filters, 192, 224);
    let of = |low, high| {
        let scene =
            Scene { visible_bounds: VisibleBounds { low: [low, low, 0], high: [high, high, 3] }, ..whole.clone() };
        self::pass(pass).rectangle(&scene, &args(iteration)).expect("a rectangle")
    };
    let before = |axis: usize| (192..224).filter(|low| of(*low, 230).first[axis] == 160).count() as u32;
    let behind = |axis: usize| {
        let end = |high| of(192, high).first[axis] + of(192, high).size[axis];
        (193..=224).filter(|high| end(*high) == 256).count() as u32
    };
    [before(0), behind(0), before(1), behind(1)]
}

#[test]
fn each_filter_covers_the_reach_of_the_filters_after_it() {
    let all = "median = true, estimator = 'nagao-matsuyama', sigma = { window = 9 }, enhanced_sigma = { window = 5, largest = 11 }, \
               perona_malik = { repeat = 3 }, smooth = { lateral = 2.0, depth = 1.0, elevation = 1.0 }";
    // Reaches: 1, 2, 4, 5, 1 a step, then 6 columns and 3 rows; across slices none in a plane.
    for (pass, iteration, columns, rows) in [
        ("load_slice", 0, 21, 18),
        ("median_slice", 0, 20, 17),
        ("estimator_slice", 0, 18, 15),
        ("sigma_slice", 0, 14, 11),
        ("enhanced_sigma_slice", 0, 9, 6),
        ("perona_malik_slice", 0, 8, 5),
        ("perona_malik_slice", 1, 7, 4),
        ("perona_malik_slice", 2, 6, 3),
        ("gaussian_lateral", 0, 0, 3),
        ("gaussian_depth", 0, 0, 0),
        ("gaussian_elevation", 0, 0, 0),
    ] {
        assert_eq!(around(all, pass, iteration), [columns, columns, rows, rows], "{pass} {iteration}");
    }
    assert_eq!(around("estimator = 'median'", "load_slice", 0), [1; 4]);
    // An estimate of the centre may look further than the window.
    let small = |centre: &str| format!("enhanced_sigma = {{ window = 3, largest = 3, centre = '{centre}' }}");
    assert_eq!(around(&small("nagao-matsuyama"), "load_slice", 0), [2; 4]);
    assert_eq!(around(&small("median"), "load_slice", 0), [1; 4]);
}

#[test]
fn rectangles_end_with_whole_workgroups_or_at_the_border() {
    let of = |low, high, pass: &str| {
        self::pass(pass).rectangle(&seen("median = true, sigma = { window = 5 }", low, high), &args(0))
    };
    let told = |low, high, pass: &str| of(low, high, pass).map(|r| (r.first, r.size));
    assert_eq!(told(200, 210, "sigma_slice"), Some(([192; 2], [32; 2])));
    assert_eq!(told(200, 230, "sigma_slice"), Some(([192; 2], [64; 2])));
    assert_eq!(told(0, 399, "load_slice"), Some(([0; 2], [400; 2])));
    assert_eq!(told(2, 390, "load_slice"), Some(([0; 2], [400; 2])));
    assert_eq!(told(200, 210, "tone"), None, "no filter of slices");
    assert_eq!(told(200, 210, "growth_slice"), Some(([0; 2], [400; 2])), "all of it is counted");
}

#[test]
fn rows_and_columns_of_elimination_are_whole() {
    let filters = "median = true, perona_malik = { scheme = 'aos', repeat = 1 }, smooth = { lateral = 1.0 }";
    let of = |pass: &str, iteration| {
        self::pass(pass).rectangle(&seen(filters, 200, 210), &args(iteration)).map(|r| (r.first, r.size))
    };
    assert_eq!(of("aos_slice", 0), None);
    assert_eq!(of("median_slice", 0), Some(([0; 2], [400; 2])), "all of it is eliminated behind");
    assert_eq!(of("gaussian_lateral", 0), Some(([192; 2], [32; 2])));
}
