//! The declarations of the filters' passes: when they are needed, and with which shader, slots, parameters
//! and constants. tests/unit_pure/rules.rs compares the names with the shaders; these tests check their meaning.

use super::*;
use echolume::low_level::passes::{Slot, Value};
use echolume::low_level::scene::DeviceFacts;

/// A dispatch as text: shader, slots read and written, invocations.
fn told(scene: &Scene, name: &str, iteration: u32) -> String {
    let (pass, args) = (pass(name), DispatchArgs { iteration, slice: 1, slices: 2, ..DispatchArgs::default() });
    assert_eq!(pass.name, name);
    assert!(pass.is_needed(scene), "{name}: {:?}", pass.needed(scene));
    let slots = |binds: Vec<echolume::low_level::passes::Bind>| {
        binds.iter().map(|b| b.slot.name()).collect::<Vec<_>>().join(", ")
    };
    let (reads, writes) = (slots(pass.reads(scene, &args)), slots(pass.writes(scene, &args)));
    format!("{}: {reads} -> {writes} {:?}", pass.shader(scene, &args), (pass.extent)(scene, &args))
}

fn numbers(scene: &Scene, name: &str) -> Vec<(&'static str, f64)> {
    let of = |value: &Value| match value {
        Value::F32(v) => vec![f64::from(*v)],
        Value::I32(v) => vec![f64::from(*v)],
        Value::Floats(v) => v.iter().map(|v| f64::from(*v)).collect(),
        other => panic!("{other:?}"),
    };
    let args = DispatchArgs { slice: 1, slices: 2, ..DispatchArgs::default() };
    let params = (pass(name).params)(scene, &args);
    params.0.iter().flat_map(|(name, value)| of(value).into_iter().map(|value| (*name, value))).collect()
}

/// The constants that a pass names; whether slices go to layers is seen by their slot.
fn constants(scene: &Scene, name: &str, iteration: u32) -> Vec<(&'static str, i32)> {
    let all = pass(name).constants(scene, &DispatchArgs { iteration, ..DispatchArgs::default() });
    all.into_iter().filter(|(name, _)| *name != "LAYERED").collect()
}

const ALL: &str =
    "median = true, estimator = 'gradient-inverse', sigma = {}, enhanced_sigma = { growth = true }, perona_malik = {}";

#[test]
fn filters_of_slices_go_from_slot_to_slot_and_the_last_into_the_volume() {
    let scene = slices([21, 10], &format!("{ALL}, smooth = {{ lateral = 1.0, depth = 2.0, elevation = 1.0 }}"));
    for (name, expected) in [
        ("median_slice", "filter/median.slice: slice_a -> slice_b [6, 3, 2]"),
        ("estimator_slice", "filter/estimator: slice_b -> slice_a [21, 10, 2]"),
        ("sigma_slice", "filter/sigma.slice: slice_a -> slice_b [21, 3, 2]"),
        ("growth_slice", "filter/enhanced_sigma.slice: slice_b -> growth [21, 10, 2]"),
        ("enhanced_sigma_slice", "filter/enhanced_sigma.slice: slice_b -> slice_a [21, 10, 2]"),
        ("perona_malik_slice", "filter/perona_malik.slice: slice_a -> slice_b [21, 10, 2]"),
        ("gaussian_lateral", "filter/gaussian: slice_b -> slice_a [3, 10, 2]"),
        ("gaussian_depth", "filter/gaussian: slice_a -> sharp_volume [21, 2, 2]"),
        ("gaussian_elevation", "filter/gaussian: sharp_volume -> volume [21, 10, 1]"),
    ] {
        assert_eq!(told(&scene, name, 0), expected);
        // Alone each writes the volume.
        let alone = expected.split(' ').next().expect("a shader");
        let filter = match name {
            "growth_slice" | "gaussian_elevation" => continue,
            "median_slice" => "median = true",
            "estimator_slice" => "estimator = 'median'",
            "gaussian_lateral" => "smooth = { lateral = 1.0 }",
            "gaussian_depth" => "smooth = { depth = 1.0 }",
            "sigma_slice" => "sigma = {}",
            "enhanced_sigma_slice" => "enhanced_sigma = {}",
            _ => "perona_malik = { repeat = 1 }",
        };
        let told = told(&slices([21, 10], filter), name, 0);
        assert!(told.starts_with(alone) && told.contains("slice_a -> volume"), "{told}");
    }
}

/// What goes to a layer of a batch is where its invocations are; what goes to the volume is placed by its slice.
#[test]
fn only_the_last_filter_of_slices_places_them_in_the_volume() {
    let scene = slices([21, 10], "median = true, sigma = {}, smooth = { elevation = 1.0 }");
    for (name, is_layered) in [("load_slice", 1), ("median_slice", 1), ("sigma_slice", 0), ("gaussian_elevation", 0)] {
        let constants = pass(name).constants(&scene, &DispatchArgs::default());
        assert!(constants.contains(&("LAYERED", is_layered)), "{name}: {constants:?}");
    }
}

#[test]
fn elimination_goes_forth_and_back_along_rows_and_then_columns() {
    let scene = slices([21, 10], "perona_malik = { scheme = 'aos', repeat = 2 }");
    assert_eq!((pass("aos_slice").repeat)(&scene), 8);
    let last = "shares, slice_forward, slice_rows -> ";
    for (iteration, expected) in [
        (0, "filter/aos_forward.slice: slice_a -> slice_shares, slice_forward [10, 1, 2]".into()),
        (1, "filter/aos_backward.slice: slice_shares, slice_forward -> slice_rows [10, 1, 2]".into()),
        (2, "filter/aos_forward.slice: slice_a -> slice_shares, slice_forward [21, 1, 2]".into()),
        (3, format!("filter/aos_backward.slice: slice_{last}slice_b [21, 1, 2]")),
        (4, "filter/aos_forward.slice: slice_b -> slice_shares, slice_forward [10, 1, 2]".into()),
        (7, format!("filter/aos_backward.slice: slice_{last}volume [21, 1, 2]")),
    ] {
        let expected: String = expected;
        assert_eq!(told(&scene, "aos_slice", iteration), expected);
        let axis = i32::from(iteration % 4 > 1);
        let own = if iteration % 2 == 0 { ("CONDUCTANCE", 0) } else { ("RICHARDSON", 0) };
        let expected = [("AXIS", axis), own];
        assert_eq!(constants(&scene, "aos_slice", iteration), expected);
    }
    let scene = picture(
        [21, 10],
        "perona_malik = { scheme = 'aos', conductance = 'exponential', edge = 0.5, step = 4.0, repeat = 2 }",
    );
    assert_eq!((pass("aos_picture").repeat)(&scene), 8);
    let shares = "picture_shares, picture_forward";
    for (iteration, expected) in [
        (0, format!("filter/aos_forward.picture: picture -> {shares} [10, 1, 1]")),
        (1, format!("filter/aos_backward.picture: {shares} -> picture_rows [10, 1, 1]")),
        (2, format!("filter/aos_forward.picture: picture -> {shares} [21, 1, 1]")),
        (3, format!("filter/aos_backward.picture: {shares}, picture_rows -> smooth_picture [21, 1, 1]")),
    ] {
        assert_eq!(told(&scene, "aos_picture", iteration), expected);
    }
    assert_eq!(constants(&scene, "aos_picture", 0), [("AXIS", 0), ("CONDUCTANCE", 1)]);
    assert_eq!(numbers(&scene, "aos_picture"), [("edge", 0.5), ("tau", 4.0)]);
    let back =
        (pass("aos_picture").params)(&scene, &DispatchArgs { iteration: 1, slice: 2, ..DispatchArgs::default() });
    assert_eq!(back.0, [("slice", Value::I32(2))]);
}

#[test]
fn workgroups_solve_rows_and_columns_that_their_memory_holds() {
    let of = |size, bytes| {
        let aos = slices(size, "perona_malik = { scheme = 'aos', repeat = 2 }");
        Scene { device: DeviceFacts { shared_memory: bytes, ..aos.device }, ..aos }
    };
    let scene = of([21, 300], 16 << 10);
    assert_eq!((pass("aos_slice").repeat)(&scene), 4);
    for (iteration, expected) in [
        (0, "filter/aos_solve.slice: slice_a -> slice_rows [38400, 1, 2]"),
        (1, "filter/aos_solve.slice: slice_a, slice_rows -> slice_b [2688, 1, 2]"),
        (2, "filter/aos_solve.slice: slice_b -> slice_rows [38400, 1, 2]"),
        (3, "filter/aos_solve.slice: slice_b, slice_rows -> volume [2688, 1, 2]"),
    ] {
        assert_eq!(told(&scene, "aos_slice", iteration), expected);
    }
    assert_eq!(constants(&scene, "aos_slice", 2), [("AXIS", 0), ("CONDUCTANCE", 0), ("RICHARDSON", 0), ("CHUNK", 1)]);
    assert_eq!(constants(&scene, "aos_slice", 3), [("AXIS", 1), ("CONDUCTANCE", 0), ("RICHARDSON", 0), ("CHUNK", 3)]);
    // 16 bytes a pixel of a slice, 28 of a picture, in whole chunks of 128.
    for (size, bytes, dispatches) in [
        ([1024, 9], 16 << 10, 4),
        ([1025, 9], 16 << 10, 8),
        ([9, 1025], 16 << 10, 8),
        ([9, 1025], 32 << 10, 4),
        ([2048, 9], 64 << 10, 4),
        ([2049, 9], 64 << 10, 8),
        ([9, 9], 0, 8),
    ] {
        assert_eq!((pass("aos_slice").repeat)(&of(size, bytes)), dispatches, "{size:?} in {bytes} bytes");
    }
    for (size, dispatches) in [([512, 9], 2), ([513, 9], 4)] {
        let aos = picture(size, "perona_malik = { scheme = 'aos', repeat = 1 }");
        assert_eq!(
            (pass("aos_picture").repeat)(&Scene {
                device: DeviceFacts { shared_memory: 16 << 10, ..aos.device },
                ..aos
            }),
            dispatches,
            "{size:?}"
        );
    }
}

#[test]
fn filters_that_are_off_or_change_nothing_are_skipped_and_explained() {
    let plain = slices([8, 8], "");
    let flat = scene([8; 3], "mode = 'mip'");
    for name in ["median", "estimator", "sigma", "enhanced_sigma", "growth", "perona_malik", "aos"] {
        assert_eq!(pass(&format!("{name}_slice")).needed(&plain), Err("not asked for"));
    }
    for name in [
        "gaussian_lateral",
        "gaussian_depth",
        "gaussian_elevation",
        "sigma_picture",
        "enhanced_sigma_picture",
        "aos_picture",
    ] {
        assert_eq!(pass(name).needed(&plain), Err("not asked for"));
    }
    for name in ["median", "bilateral", "sigma", "enhanced_sigma", "perona_malik"].map(|n| format!("{n}_distance")) {
        assert_eq!(pass(&name).needed(&plain), Err("not asked for"));
        assert_eq!(pass(&name).needed(&flat), Err("no distance map in this mode"));
    }
    let nothing = slices(
        [8, 8],
        "sigma = { sigma = 0.0 }, enhanced_sigma = { sigma = 0.0, growth = true }, perona_malik = { edge = 0.0 }",
    );
    for name in ["sigma_slice", "enhanced_sigma_slice"] {
        assert_eq!(pass(name).needed(&nothing), Err("a sigma of 0 changes nothing"));
    }
    assert_eq!(pass("growth_slice").needed(&nothing), Err("a sigma of 0 grows no window"));
    assert_eq!(pass("perona_malik_slice").needed(&nothing), Err("an edge of 0 changes nothing"));
    assert_eq!(pass("aos_slice").needed(&nothing), Err("an edge of 0 changes nothing"));
    let explicit = slices([8, 8], "perona_malik = {}, enhanced_sigma = {}");
    assert_eq!(pass("aos_slice").needed(&explicit), Err("another scheme was asked for"));
    assert_eq!(pass("growth_slice").needed(&explicit), Err("not asked for"));
    assert_eq!((pass("perona_malik_slice").repeat)(&explicit), 5);
}

#[test]
fn filters_of_distance_maps_alternate_between_two_slots() {
    let scene = distances(
        [21, 10],
        "median = 5, bilateral = { pixels = 1.2, distance = 4.0, repeat = 2 }, sigma = {}, enhanced_sigma = {}, perona_malik = {}",
    );
    for (name, iteration, expected) in [
        ("median_distance", 0, "filter/median.distance: distance_map -> distance_a [21, 3, 1]"),
        ("bilateral_distance", 0, "filter/bilateral.distance: distance_a -> distance_b [21, 3, 1]"),
        ("bilateral_distance", 1, "filter/bilateral.distance: distance_b -> distance_a [21, 3, 1]"),
        ("sigma_distance", 0, "filter/sigma.distance: distance_a -> distance_b [21, 3, 1]"),
        ("enhanced_sigma_distance", 0, "filter/enhanced_sigma.distance: distance_b -> distance_a [21, 10, 1]"),
        ("perona_malik_distance", 4, "filter/perona_malik.distance: distance_a -> distance_b [21, 10, 1]"),
    ] {
        assert_eq!(told(&scene, name, iteration), expected);
    }
    assert_eq!(constants(&scene, "median_distance", 0), [("RADIUS", 2)]);
    assert_eq!(constants(&scene, "bilateral_distance", 0), [("RADIUS", 3)]);
    let expected =
        [("place_narrowness", f64::from((0.5 / 1.44f64) as f32)), ("distance_narrowness", 0.03125), ("slice", 1.0)];
    assert_eq!(numbers(&scene, "bilateral_distance"), expected);
    // It does not run unless requested; its parameters are defined all the same.
    assert_eq!(constants(&distances([4, 4], ""), "bilateral_distance", 0), [("RADIUS", 2)]);
    let picture = picture([21, 10], "sigma = {}, enhanced_sigma = {}, perona_malik = { repeat = 1 }");
    assert_eq!(told(&picture, "sigma_picture", 0), "filter/sigma.picture: picture -> smooth_picture [21, 5, 1]");
    let second = "filter/enhanced_sigma.picture: smooth_picture -> smooth_picture_b [21, 10, 1]";
    assert_eq!(told(&picture, "enhanced_sigma_picture", 0), second);
    let third = "filter/perona_malik.picture: smooth_picture_b -> smooth_picture [21, 10, 1]";
    assert_eq!(told(&picture, "perona_malik_picture", 0), third);
}

#[test]
fn shaders_and_references_get_the_same_parameters() {
    let scene = slices(
        [8, 8],
        "sigma = { window = 9, sigma = 0.125, noise = 'multiplicative' },
         enhanced_sigma = { window = 7, largest = 13, sigma = 0.25, edge = 0.5, centre = 'nagao-matsuyama' },
         perona_malik = { edge = 0.5, step = 0.125, conductance = 'exponential' }, smooth = { lateral = 2.0, depth = 1.0, elevation = 0.5 }",
    );
    let tie = f64::from(1e-6f32);
    assert_eq!(numbers(&scene, "sigma_slice"), [("range", 0.25), ("tie", tie), ("few", 4.0), ("slice", 1.0)]);
    for (shared_memory, tiled) in [(0, 0), (4 << 10, 1)] {
        let scene = Scene { device: DeviceFacts { shared_memory, ..scene.device }, ..scene.clone() };
        assert_eq!(constants(&scene, "sigma_slice", 0), [("RADIUS", 4), ("MULTIPLICATIVE", 1), ("TILED", tiled)]);
    }
    // 16 KB of shared memory hold the tile of any window, but leave a GPU too few workgroups.
    let wide = slices([8, 8], "sigma = { window = 41, sigma = 0.125 }");
    let wide = Scene { device: DeviceFacts { shared_memory: 16 << 10, ..wide.device }, ..wide };
    assert_eq!(constants(&wide, "sigma_slice", 0)[2], ("TILED", 0));
    let least = f64::from((1.0 / 510.0) as f32);
    let expected = [("range", 0.5), ("tie", tie), ("few", 3.0), ("edge", 0.5), ("least", least), ("slice", 1.0)];
    assert_eq!(numbers(&scene, "enhanced_sigma_slice"), expected);
    assert_eq!(numbers(&scene, "growth_slice"), expected);
    let expected = [("RADIUS", 3), ("MAX_RADIUS", 6), ("ESTIMATOR", 3), ("MULTIPLICATIVE", 0), ("GROWTH", 0)];
    assert_eq!(constants(&scene, "enhanced_sigma_slice", 0), expected);
    assert_eq!(numbers(&scene, "perona_malik_slice"), [("edge", 0.5), ("lambda", 0.125), ("slice", 1.0)]);
    assert_eq!(constants(&scene, "perona_malik_slice", 0), [("CONDUCTANCE", 1)]);
    for (axis, name, radius, deviation) in
        [(0, "gaussian_lateral", 6, 2.0), (1, "gaussian_depth", 3, 1.0), (2, "gaussian_elevation", 2, 0.5)]
    {
        let on_device = |shared_memory: u32| {
            constants(&Scene { device: DeviceFacts { shared_memory, ..scene.device }, ..scene.clone() }, name, 0)
        };
        let expected = |tiled| [("RADIUS", radius), ("AXIS", axis), ("SHARPENS", 0), ("TILED", tiled)];
        assert_eq!(on_device(0), expected(0));
        assert_eq!(on_device(16 << 10), expected(i32::from(axis == 0)));
        let numbers = numbers(&scene, name);
        assert_eq!(numbers[..2], [("slice", 1.0), ("slices", 2.0)]);
        let bell = |n: usize| (-0.5 * (n as f64 / deviation).powi(2)).exp();
        let sum: f64 = (1..=radius as usize).map(|n| 2.0 * bell(n)).sum::<f64>() + 1.0;
        for (n, (name, weight)) in numbers[2..].iter().enumerate() {
            let expected = if n <= radius as usize { bell(n) / sum } else { 0.0 };
            assert!(*name == "weights" && (weight - expected).abs() < 1e-7, "{n}: {weight}");
        }
    }
    let estimators = ["median", "perona-malik", "gradient-inverse", "nagao-matsuyama"];
    for (n, estimator) in estimators.iter().enumerate() {
        let scene = slices([8, 8], &format!("estimator = '{estimator}'"));
        assert_eq!(constants(&scene, "estimator_slice", 0), [("ESTIMATOR", n as i32)]);
    }
    // An infinite sigma becomes the largest f32 that can be multiplied.
    let endless = slices([8, 8], "sigma = { window = 3, sigma = inf }");
    assert_eq!(numbers(&endless, "sigma_slice")[..3], [("range", f64::from(1e30f32)), ("tie", tie), ("few", 1.0)]);
    // Distances have no levels.
    assert_eq!(numbers(&distances([4, 4], "sigma = {}"), "sigma_distance")[1], ("tie", 0.0));
    assert_eq!(Slot::Growth.name(), "growth");
}
