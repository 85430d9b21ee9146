//! What nobody chose: the levels of a recording's echoes, and the settings that follow from them, its size and the mode.

use crate::common::setting_keys::{self, Key};
use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Grid, Motion, Probe};
use echolume::low_level::scene::default_look::{Defaults, Recorded};
use echolume::low_level::scene::load::{Layers, PRESETS, rebase};
use echolume::low_level::scene::{
    Camera, ColourMap, EchoHistogram, EchoLevels, Input, Layout, Mode, Settings, Slices, transfer,
};
use echolume::low_level::source::StoredType;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

fn grid(size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { origin: [0.0; 3], spacing: [0.5; 3], size })
}

const BYTES: Input = Input { stored: StoredType::U8, range: [0.0, 255.0] };

/// Speckle of a mean: uniform between 0.4 and 1.6 of it, from a counter.
fn speckle(mean: f64, n: usize) -> u8 {
    let u = (n as f64 * 0.618_033_988_75).fract();
    (mean * (0.4 + 1.2 * u)).round() as u8
}

#[test]
fn fluid_and_tissue_are_told_apart_through_speckle() {
    // Samples of both overlap: those of fluid reach 64, those of tissue begin at 40.
    let mut histogram = EchoHistogram::new(&grid([64, 64, 1]), BYTES, 4.0);
    let frame: Vec<u8> = (0..64 * 64).map(|n| speckle(if n % 64 < 32 { 40.0 } else { 100.0 }, n)).collect();
    histogram.take(&frame);
    let levels = histogram.levels().expect("levels");
    assert!((levels.dark * 255.0 - 40.0).abs() < 4.0, "{levels:?}");
    assert!((levels.bright * 255.0 - 100.0).abs() < 4.0, "{levels:?}");
    assert!((levels.threshold * 255.0 - 70.0).abs() < 8.0, "{levels:?}");
    assert!((levels.mean * 255.0 - 70.0).abs() < 2.0 && levels.low < 0.1 && levels.high > 0.6, "{levels:?}");
    // In the order of the frames, and again.
    assert_eq!(histogram.levels(), Some(levels));
}

#[test]
fn what_is_outside_of_the_sector_does_not_count() {
    let mut with = EchoHistogram::new(&grid([64, 64, 1]), BYTES, 2.0);
    let mut without = with.clone();
    let inside = |n: usize| speckle(if n % 64 < 16 { 40.0 } else { 100.0 }, n);
    with.take(&(0..64 * 64).map(|n| if n % 64 < 48 { inside(n) } else { 0 }).collect::<Vec<u8>>());
    without.take(&(0..64 * 64).map(|n| if n % 64 < 48 { inside(n) } else { inside(n - 16) }).collect::<Vec<u8>>());
    let (with, without) = (with.levels().expect("levels"), without.levels().expect("levels"));
    assert!((with.dark - without.dark).abs() < 0.02 && (with.bright - without.bright).abs() < 0.02, "{with:?}");
}

/// A wall next to the probe, fluid, and a body behind it; without the wall there is nothing to leave out.
#[test]
fn what_is_of_interest_begins_behind_the_layer_next_to_the_probe() {
    let start = |wall: usize, body: usize| {
        let mut histogram = EchoHistogram::new(&grid([64, 64, 1]), BYTES, 1.0);
        let is_bright = |row: usize| row < wall || row >= body;
        let frame: Vec<u8> = (0..64 * 64).map(|n| speckle(if is_bright(n / 64) { 150.0 } else { 20.0 }, n)).collect();
        histogram.take(&frame);
        histogram.levels().expect("levels").start
    };
    // Rows of 0.5 mm: fluid from 6 to 16 mm, its middle within half a block of 11 mm.
    let found = start(12, 32).expect("a layer");
    assert!((found - 11.0).abs() <= 0.75, "{found}");
    assert_eq!((start(0, 32), start(12, 64)), (None, None));
}

#[test]
fn words_and_floats_have_the_levels_of_bytes() {
    let frame: Vec<f64> = (0..32 * 32).map(|n| if n % 32 < 20 { 0.1 } else { 0.7 }).collect();
    let levels = |stored: StoredType, range: [f64; 2], bytes: Vec<u8>| {
        let mut histogram = EchoHistogram::new(&grid([32, 32, 1]), Input { stored, range }, 1.0);
        histogram.take(&bytes);
        histogram.levels().expect("levels")
    };
    let bytes = levels(StoredType::U8, [0.0, 200.0], frame.iter().map(|v| (v * 200.0) as u8).collect());
    let words = frame.iter().flat_map(|v| ((v * 6e4) as u16).to_le_bytes()).collect();
    let words = levels(StoredType::U16, [0.0, 6e4], words);
    let floats = frame.iter().flat_map(|v| ((v - 3.0) as f32).to_le_bytes()).collect();
    let floats = levels(StoredType::F32, [-3.0, -2.0], floats);
    for levels in [bytes, words, floats] {
        assert!((levels.dark - 0.1).abs() < 2e-3 && (levels.bright - 0.7).abs() < 2e-3, "{levels:?}");
        // The middle of an empty gap.
        assert!((levels.threshold - 0.4).abs() < 2e-3, "{levels:?}");
    }
}

#[test]
fn nothing_follows_from_nothing() {
    let mut histogram = EchoHistogram::new(&grid([64, 64, 1]), BYTES, 2.0);
    assert_eq!(histogram.levels(), None);
    histogram.take(&[7; 10]);
    assert_eq!(histogram.levels(), None, "a frame that is cut short");
    histogram.take(&[0; 64 * 64]);
    assert_eq!(histogram.levels(), None, "all outside");
    histogram.take(&[9; 64 * 64]);
    assert_eq!(histogram.levels(), None, "all the same");
}

const LEVELS: EchoLevels =
    EchoLevels { dark: 0.1, threshold: 0.3, bright: 0.5, mean: 0.25, low: 0.02, high: 0.9, start: None };

fn voxels(slices: usize) -> Geometry {
    Geometry::Cartesian(Grid { origin: [0.0; 3], spacing: [1.0; 3], size: [100, 80, slices] })
}

fn fan() -> Geometry {
    Geometry::Sweep(Probe {
        array: Array::Curved { radius: 40.0 },
        lines: Axis::centred(0.01, 64),
        start_depth: 0.0,
        sample_pitch: 0.5,
        samples: 240,
        motion: Motion::Fan { wobble_radius: 25.0 },
        slices: Axis::centred(0.02, 32),
        advance: Advance::None,
        sound_speed: 1540.0,
    })
}

fn layers(presets: &[&str], sets: &[&str]) -> Layers {
    let mut layers = Layers::default();
    presets.iter().for_each(|preset| layers.preset(preset).expect("preset"));
    sets.iter().for_each(|set| layers.set(set).expect("set"));
    layers
}

fn completed(geometry: &Geometry, presets: &[&str], sets: &[&str]) -> Settings {
    layers(presets, sets).completed(geometry, Some(&LEVELS)).expect("settings").settings
}

fn span(settings: &Settings) -> [f64; 2] {
    let points = transfer::resolved(&settings.volume.transfer);
    [points[0].at, points[points.len() - 1].at]
}

#[test]
fn a_recording_gets_its_ramp_and_windows_from_its_echoes() {
    let settings = completed(&fan(), &[], &[]);
    assert_eq!(settings.mode, Mode::Volume);
    assert_eq!(span(&settings), [0.3, 0.5]);
    assert!(settings.light.volume.is_some() && settings.volume.extinction.is_some_and(|e| e > 1.0));
    assert_eq!((settings.surface.window, settings.planes.window), ([0.3, 0.8], [0.02, 0.9]));
    assert_eq!(completed(&fan(), &[], &["mode=mip"]).projection.window, [0.3, 0.9]);
    // Smaller volumes are smoothed less.
    let smooth = |geometry: &Geometry| completed(geometry, &[], &[]).slices.smooth.expect("smooth").lateral;
    assert!((smooth(&voxels(40)) - 0.9).abs() < 0.01 && smooth(&fan()) > 1.0);
}

#[test]
fn a_rendering_begins_behind_the_layer_next_to_the_probe() {
    let levels = EchoLevels { start: Some(20.0), ..LEVELS };
    let depth = |sets: &[&str]| {
        layers(&[], sets).completed(&fan(), Some(&levels)).expect("settings").settings.region.depth.map(|d| d[0])
    };
    assert_eq!((depth(&[]), depth(&["mode=sr"]), depth(&["mode=plane"])), (Some(20.0), Some(20.0), None));
    assert_eq!(depth(&["region.lateral=[-20,20]"]), None);
}

#[test]
fn what_a_user_sets_wins() {
    let given = completed(&fan(), &[], &["volume.window=[0.2,0.7]", "surface.threshold=0.05", "slices.median=true"]);
    assert_eq!((given.volume.window, given.surface.window, given.surface.threshold), ([0.2, 0.7], [0.0, 1.0], 0.05));
    assert_eq!(given.volume.transfer, Settings::default().volume.transfer);
    assert_eq!(given.slices, Slices { median: true, ..Slices::default() });
    assert_eq!(given.light.volume, None, "the light belongs to the ramp");
    // A transfer function with a name gets a window.
    let bone = completed(&fan(), &[], &["volume.transfer=bone"]);
    assert_ne!(bone.volume.window, [0.0, 1.0]);
    assert_eq!(completed(&fan(), &[], &["slices.smooth=none"]).slices.smooth, None);
    assert_eq!(completed(&fan(), &[], &["light.volume=none"]).light.volume, None);
    let mip = completed(&fan(), &[], &["mode=mip", "projection.window=[0,1]", "post.colour_map=ice"]);
    assert_eq!((mip.projection.window, mip.post.colour_map), ([0.0, 1.0], ColourMap::Ice));
}

#[test]
fn a_preset_keeps_its_pictures() {
    for (preset, _) in PRESETS {
        for mode in ["vr", "sr", "mixed", "mip", "xray"] {
            let set = format!("mode={mode}");
            let plain = layers(&[preset], &[&set]).finish().expect("settings");
            assert_eq!(completed(&fan(), &[preset], &[&set]), plain, "{preset}, {mode}");
        }
    }
    assert!(!layers(&["face"], &[]).needs_levels() && layers(&[], &["mode=vr"]).needs_levels());
}

#[test]
fn a_single_frame_is_a_plane_unless_a_mode_is_chosen() {
    assert_eq!(completed(&voxels(1), &[], &[]).mode, Mode::Plane);
    assert_eq!(completed(&voxels(1), &[], &["mode=vr"]).mode, Mode::Volume);
    assert_eq!(completed(&voxels(40), &[], &["layout=pair"]).mode, Mode::Surface);
}

#[test]
fn sections_show_the_whole_sector_hardly_filtered() {
    for preset in ["bone", "face", "face-classic", "fetal", "glass", "skeleton", "vessel"] {
        for mode in ["mode=orthogonal", "mode=plane", "mode=cube"] {
            let settings = completed(&fan(), &[preset], &[mode]);
            assert_eq!((settings.region.depth, settings.region.fade, settings.slices.median), (None, 0.0, false));
            let smooth = settings.slices.smooth.expect("light");
            assert!(smooth.lateral < 0.5 && smooth.elevation == 0.0 && smooth.elevation_mm.is_some(), "{smooth:?}");
            assert!(settings.slices.sigma.is_none());
        }
    }
    // Another key of the same table is no choice of the region or of a filter.
    let other = completed(&fan(), &["face"], &["mode=plane", "region.fade=1", "slices.pixels=256"]);
    assert_eq!((other.region.depth, other.region.fade, other.slices.median), (None, 1.0, false));
    let given = completed(&fan(), &["face"], &["mode=plane", "region.depth=[20,60]", "slices.blur=true"]);
    assert_eq!((given.region.depth, given.region.lateral.is_some()), (Some([20.0, 60.0]), true));
    assert!(given.slices.smooth.is_some_and(|s| s.lateral == 1.1), "as in the preset: {:?}", given.slices.smooth);
    // The pipeline of the thesis and a B-mode picture are what they are.
    for preset in ["thesis", "bmode"] {
        let set = ["mode=plane"];
        assert_eq!(completed(&fan(), &[preset], &set), layers(&[preset], &set).finish().expect("settings"));
    }
}

#[test]
fn planes_beside_a_rendering_have_a_volume_of_their_own() {
    for preset in [&[][..], &["face"], &["fetal"], &["bone"]] {
        let [alone, four] =
            ["layout=single", "layout=4up"].map(|layout| completed(&fan(), preset, &["mode=vr", layout]));
        let smooth = four.planes.smooth.expect("light");
        assert!(smooth.lateral < 0.5 && smooth.lateral == smooth.depth && smooth.elevation_mm == Some(smooth.depth));
        assert_eq!(
            (alone.planes.smooth, &alone.slices, &alone.region),
            (None, &four.slices, &four.region),
            "{preset:?}"
        );
    }
    let set = |set: &str| completed(&fan(), &["face"], &["layout=4up", set]).planes.smooth;
    assert_eq!(set("planes.smooth=none"), None);
    assert_eq!(set("planes.smooth={lateral=1}").map(|s| (s.lateral, s.depth)), Some((1.0, 0.0)));
    assert_eq!(completed(&fan(), &["thesis"], &["layout=4up"]).planes.smooth, None);
    // A window that changes to 4-up and back.
    let defaults = Defaults { layers: layers(&["face"], &[]), geometry: fan(), levels: None };
    let start = defaults.settings().expect("settings");
    let four = defaults.switched(&start, Settings { layout: Layout::Four, ..start.clone() });
    assert!(four.planes.smooth.is_some() && four.slices == start.slices);
    assert_eq!(defaults.switched(&four, Settings { layout: Layout::Single, ..four.clone() }), start);
}

#[test]
fn a_block_is_turned_and_cut_and_a_minimum_projection_takes_a_slab() {
    let block = completed(&fan(), &["face"], &["mode=cube"]);
    assert_eq!((block.camera.azimuth, block.camera.elevation, block.camera.target), (-30.0, 30.0, None));
    assert!(block.cube.inset.bottom > 5.0);
    let turned = completed(&fan(), &[], &["mode=cube", "camera.azimuth=10", "cube.inset.near=3"]);
    assert_eq!((turned.camera.azimuth, turned.camera.elevation, turned.cube.inset.bottom), (10.0, 0.0, 0.0));
    let slab = completed(&fan(), &[], &["mode=minip"]).region.depth.expect("slab");
    assert!((slab[1] - slab[0] - 12.0).abs() < 1e-3, "{slab:?}");
    let of_face = completed(&fan(), &["face"], &["mode=minip"]);
    assert_eq!((of_face.region.depth, of_face.camera.target), (Some([53.0, 65.0]), Some([2.0, 59.0, -1.0])));
    assert_eq!(completed(&fan(), &[], &["mode=minip", "region.depth=[10,90]"]).region.depth, Some([10.0, 90.0]));
}

#[test]
fn every_choice_is_said() {
    let said = layers(&[], &[]).completed(&fan(), Some(&LEVELS)).expect("settings").said.join("\n");
    for part in ["mode: volume", "slices.smooth", "threshold 0.300", "opaque from 0.3 to 0.5", "surface.window"] {
        assert!(said.contains(part), "{part} in {said}");
    }
    let blind = layers(&[], &[]).completed(&fan(), None).expect("settings").said.join("\n");
    assert!(blind.contains("as no echoes are known") && !blind.contains("from the echoes"), "{blind}");
    assert!(layers(&["face"], &[]).completed(&fan(), None).expect("settings").said.is_empty());
}

fn levels_of_halves() -> Option<EchoLevels> {
    let mut histogram = EchoHistogram::new(&grid([64, 64, 1]), BYTES, 4.0);
    histogram.take(&(0..64 * 64).map(|n| speckle(if n % 64 < 32 { 40.0 } else { 100.0 }, n)).collect::<Vec<u8>>());
    histogram.levels()
}

/// A window that changes to another mode shows what a picture of that mode alone shows, but for what the user set meanwhile.
#[test]
fn a_change_of_mode_brings_what_follows_from_it_and_keeps_what_was_set() {
    let given = |text: &str| {
        let mut layers = Layers::default();
        layers.table("test", toml::from_str(text).expect("TOML"), Path::new("")).expect("settings");
        layers
    };
    let geometry = grid([64, 64, 64]);
    let defaults = Defaults { layers: Layers::default(), geometry: geometry.clone(), levels: levels_of_halves() };
    let start = defaults.settings().expect("settings");
    for (mode, name) in [(Mode::Mixed, "mixed"), (Mode::Mip, "mip"), (Mode::Cube, "cube"), (Mode::Plane, "plane")] {
        let alone =
            Defaults { layers: given(&format!("mode = '{name}'")), ..defaults.clone() }.settings().expect("settings");
        let mut to = start.clone();
        to.set_mode(mode);
        let switched = defaults.switched(&start, to.clone());
        assert_eq!(switched, alone, "{name}");
        // And back.
        let back = Settings { mode: start.mode, ..switched.clone() };
        assert_eq!(defaults.switched(&switched, back), start, "{name}");
        // What was set stays, also what the mode changes otherwise.
        to.light.ambient = 0.123;
        to.projection.window = [0.11, 0.77];
        to.planes.window = [0.11, 0.77];
        to.slices.smooth.as_mut().expect("smooth").depth = 0.4321;
        let switched = defaults.switched(&Settings { mode: start.mode, ..to.clone() }, to.clone());
        let mut expected = alone.clone();
        expected.light.ambient = 0.123;
        expected.projection.window = [0.11, 0.77];
        expected.planes.window = [0.11, 0.77];
        expected.slices.smooth.as_mut().expect("smooth").depth = 0.4321;
        assert_eq!(switched, expected, "{name}");
    }
}

#[test]
fn values_that_were_changed_since_outlast_a_rebase() {
    let settings = |text: &str| -> Settings { Settings::from_toml(text).expect("settings") };
    let before = settings("[camera]\nzoom = 2\n[light.shadow]\nstrength = 0.5\n[region]\ndepth = [1, 2]");
    let after = settings("[camera]\nzoom = 3\nazimuth = 10\n[region]\nlateral = [3, 4]");
    assert_eq!(rebase(&before, &before, &after), Some(after.clone()));
    let current = Settings { camera: Camera { zoom: 5.0, ..before.camera }, ..before.clone() };
    let expected = Settings { camera: Camera { zoom: 5.0, ..after.camera }, ..after.clone() };
    assert_eq!(rebase(&current, &before, &after), Some(expected));
    // A table that `after` has no more stays whole if something in it was changed.
    let mut current = before.clone();
    current.light.shadow.as_mut().expect("shadow").strength = 0.7;
    let rebased = rebase(&current, &before, &after).expect("settings");
    assert_eq!((rebased.light.shadow, rebased.camera), (current.light.shadow, after.camera));
}

/// Every value of settings, by its path.
fn flat(settings: &Settings) -> BTreeMap<String, toml::Value> {
    fn collect(prefix: &str, table: &toml::Table, all: &mut BTreeMap<String, toml::Value>) {
        for (key, value) in table {
            match value {
                toml::Value::Table(inner) => {
                    all.insert(format!("{prefix}{key}"), "a table".into());
                    collect(&format!("{prefix}{key}."), inner, all);
                }
                other => drop(all.insert(format!("{prefix}{key}"), other.clone())),
            }
        }
    }
    let mut all = BTreeMap::new();
    collect("", &settings.to_table().expect("TOML"), &mut all);
    all
}

/// What a key means the same as: where it is set, defaults of these keys may be another or none.
fn same_as(path: &str) -> &'static [&'static str] {
    let starts = |with: &str| path == with || path.starts_with(&format!("{with}."));
    let filters = ["smooth", "sigma", "enhanced_sigma", "perona_malik", "estimator", "median", "blur"];
    match path {
        _ if filters.iter().any(|filter| starts(&format!("slices.{filter}"))) => &["slices"],
        // Bright windows and the filters of the distance map have a default each.
        "volume.window" | "volume.threshold" | "volume.transfer" | "volume.opacity" => &["volume", "light"],
        "surface.window" | "surface.threshold" => &["surface"],
        "volume.shading" => &["light"],
        // Refuses light in the volume, so that the default has none.
        "volume.compositing" | "light.position" => &["light"],
        "region.lateral" | "region.depth" | "region.elevation" | "region.start_curve" => {
            &["region", "cube.inset", "camera.target"]
        }
        "volume.start_depth" | "surface.start_depth" | "projection.start_depth" => &["region", "camera.target"],
        // What is sharpened across slices is not smoothed there.
        "ray.elevation" => &["slices.smooth", "planes.smooth"],
        // Fewer entries than the ramp has room for.
        "volume.entries" => &["volume.transfer"],
        "camera.target" | "camera.zoom" | "camera.azimuth" | "camera.elevation" => &["camera", "cube.inset"],
        _ if starts("cube.inset") => &["cube.inset"],
        _ if starts("distance") => &["distance"],
        _ if starts("planes.smooth") => &["planes.smooth"],
        _ => &[],
    }
}

/// The settings of keys that choose what is shown, and so what the defaults are.
fn chooses_the_picture(key: &Key) -> bool {
    ["mode", "layout"].contains(&&*key.path)
}

/// Prevents a key of accuracy, such as a format, from switching the look off that was found for the recording: a report would then compare two looks. And a
/// default that makes a scene that is refused, where the settings alone make one.
#[test]
fn a_key_changes_no_default_but_of_what_means_the_same() {
    let levels = EchoLevels { start: Some(20.0), ..LEVELS };
    let recorded = Recorded {
        levels: Some(levels),
        is_completed: true,
        ..Recorded::as_set(fan(), Input { stored: StoredType::U8, range: [0.0, 255.0] })
    };
    let as_set = Recorded { is_completed: false, ..recorded.clone() };
    let keys = setting_keys::all();
    let (mut set, mut faults) = (0, Vec::new());
    let looks: [(&[&str], &[&str]); 10] = [
        (&[], &[]),
        (&[], &["mode=sr"]),
        (&[], &["mode=mixed"]),
        (&[], &["mode=mip"]),
        (&[], &["mode=minip"]),
        (&[], &["mode=plane"]),
        (&[], &["mode=cube"]),
        (&[], &["layout=4up", "mode=vr"]),
        (&["face"], &["mode=cube"]),
        (&["face-classic"], &["mode=plane"]),
    ];
    for (presets, look) in looks {
        let base = recorded.scene(&layers(presets, look)).expect("a scene").settings;
        let before = flat(&base);
        for key in keys.iter().filter(|key| !chooses_the_picture(key)) {
            for value in key.values(before.get(&key.path)) {
                let mut with = layers(presets, look);
                if with.set(&format!("{}={value}", key.path)).is_err() || as_set.scene(&with).is_err() {
                    continue;
                }
                set += 1;
                let scene = match recorded.scene(&with) {
                    Ok(scene) => scene,
                    Err(fault) => {
                        faults.push(format!("{look:?} {}={value}: the defaults are refused: {fault}", key.path));
                        continue;
                    }
                };
                let after = flat(&scene.settings);
                let allowed = |path: &str| {
                    let within = |of: &str| path == of || path.starts_with(&format!("{of}."));
                    // A table around the key may be new with it, and then all that is in it.
                    let around = |table: &str| key.path.starts_with(&format!("{table}."));
                    let parents = key.path.match_indices('.').map(|(at, _)| &key.path[..at]);
                    let is_new = parents.into_iter().any(|table| !before.contains_key(table) && within(table));
                    within(&key.path) || around(path) || is_new || same_as(&key.path).iter().any(|of| within(of))
                };
                let paths = before.keys().chain(after.keys());
                let changed: Vec<_> = paths.filter(|p| before.get(*p) != after.get(*p) && !allowed(p)).collect();
                if !changed.is_empty() {
                    faults.push(format!("{presets:?} {look:?} {}={value} changes {changed:?}", key.path));
                }
            }
        }
    }
    println!("{} keys, {set} scenes", keys.len());
    assert!(faults.is_empty(), "{} faults, such as {:#?}", faults.len(), &faults[..faults.len().min(12)]);
    assert!(set > 10 * keys.len(), "{set} of {} keys in ten looks", keys.len());
}

/// Prevents a default of 300 pixels, which no filter takes, and a default step that makes more samples than a ray may have.
#[test]
fn defaults_of_extreme_voxels_are_cut_and_not_refused() {
    for spacing in [[1.0, 0.001, 1.0], [0.001, 1.0, 1.0], [1e-6; 3], [1.0, 1.0, 1e-4], [1e3; 3], [40.0, 0.01, 0.01]] {
        let geometry = Geometry::Cartesian(Grid { origin: [0.0; 3], spacing, size: [96, 80, 40] });
        for mode in ["vr", "sr", "mixed", "mip", "minip", "xray", "plane", "cube"] {
            let recorded =
                Recorded { levels: Some(LEVELS), is_completed: true, ..Recorded::as_set(geometry.clone(), BYTES) };
            let scene = recorded.scene(&layers(&[], &[&format!("mode={mode}")]));
            let scene = scene.unwrap_or_else(|fault| panic!("{spacing:?}, {mode}: {fault}"));
            let [lateral, depth, _] = scene.smoothing();
            assert!(lateral <= 32.0 && depth <= 32.0, "{spacing:?}, {mode}: {lateral} and {depth} pixels");
            let is_cut = spacing == [1.0, 0.001, 1.0] && mode == "vr";
            assert!(
                !is_cut || scene.found.iter().any(|line| line.contains("slices.smooth.depth")),
                "{:?}",
                scene.found
            );
        }
    }
    // The step alone, of a long and thin volume.
    let thin = Geometry::Cartesian(Grid { origin: [0.0; 3], spacing: [0.001, 1.0, 1.0], size: [8, 200, 8] });
    let recorded = Recorded::as_set(thin, BYTES);
    let scene = recorded.scene(&layers(&[], &["mode=vr"])).expect("a scene");
    assert!((scene.high - scene.low).length() / scene.step <= 65536.0 * (1.0 + 1e-9));
    assert!(scene.found.iter().any(|line| line.contains("ray.step") && line.contains("65536")), "{:?}", scene.found);
    let said = recorded.scene(&layers(&[], &["mode=vr", "ray.step=0.003"])).expect_err("too many").to_string();
    assert!(said.contains("ray.step") && !said.contains("65536 samples on a ray, at most 65536"), "{said}");
}

/// What the preset of the thesis keeps of what was set before: region, windows, threshold, camera and transfer function.
const KEPT_BY_THESIS: [&str; 6] =
    ["camera.", "region.", "surface.threshold", "surface.window", "volume.transfer", "volume.window"];

#[test]
fn the_preset_of_the_thesis_is_the_same_after_every_other() {
    let values = |presets: &[&str]| flat(&layers(presets, &[]).finish().expect("settings"));
    let alone = values(&["thesis"]);
    for (before, _) in PRESETS {
        let both = values(&[before, "thesis"]);
        let keys: BTreeSet<_> = alone.keys().chain(both.keys()).collect();
        let differing = keys.into_iter().filter(|key| alone.get(*key) != both.get(*key));
        let left: Vec<_> = differing.filter(|key| !KEPT_BY_THESIS.iter().any(|kept| key.starts_with(kept))).collect();
        assert!(left.is_empty(), "after {before}: {left:?}");
    }
}
