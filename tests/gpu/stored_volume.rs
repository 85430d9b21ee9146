//! Of the volume the device stores what is visible: the bytes are counted, every picture is that of the whole volume, and it stays so while
//! scenes change.

use crate::common::gpu::*;
use crate::visible_bounds::{FILTERS, WINDOWS, geometries, speckle};
use echolume::Source;
use echolume::low_level::passes::{Slot, Texels, chain, is_hit};
use echolume::low_level::picture::Picture;
use echolume::low_level::plan::Rerun;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Input, Scene, VisibleBounds};
use echolume::low_level::source::{Recording, StoredType};
use std::path::Path;

/// Bytes of the volume and of packed neighbours where only the visible part is stored, and where everything is.
fn bytes(geometry: &Geometry, input: Input, preset: &str, more: &str) -> [[u64; 2]; 2] {
    [false, true].map(|everything| {
        let mut layers = Layers::default();
        layers.preset(preset).expect("preset");
        let more = format!("slices.everything = {everything}\n{more}");
        layers.table("test", more.parse().expect("TOML"), Path::new("")).expect("settings");
        let settings = layers.finish().expect("settings");
        let scene = Scene::new(geometry.clone(), input, settings).expect("scene");
        [Slot::Volume, Slot::PackedNeighbours].map(|slot| slot.bytes(&scene))
    })
}

#[test]
fn the_volume_takes_the_bytes_of_what_is_visible() {
    let recording = Recording::open(&data("wobbler-4dc7/sweep.mha"), None).expect("recording");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let geometry = recording.geometry(0);
    // What is visible of the recording's box, and of a region in it, in complete workgroups of 32 columns and rows.
    let cut = "region = { lateral = [-12, 12], depth = [45, 65], elevation = [-8, 8] }";
    for (more, expected) in [("", [3_428_352, 10_126_336]), (cut, [1_523_712, 10_126_336])] {
        let [part, all] = bytes(&geometry, input, "fetal", more);
        assert_eq!([part[0], all[0]], expected, "{more}");
        assert_eq!(part[0] * all[1], part[1] * all[0], "neighbours are as many");
    }
    // A plane is stored as the slices that it crosses, a region as its columns and rows too.
    let of = |toml: &str| scene(cartesian([100, 70, 50]), BYTES, &format!("{toml}\nslices.format = 'r16'"));
    let plane = of("mode = 'plane'");
    assert_eq!(Slot::Volume.bytes(&plane), 100 * 70 * 2 * plane.visible_frames().len() as u64);
    assert!(plane.visible_frames().len() < 4);
    let vr = "mode = 'vr'\nregion = { lateral = [2, 4], depth = [3, 5], elevation = [2, 5] }";
    let VisibleBounds { low, high } = of(vr).visible_bounds;
    let span = |a: usize| u64::from(high[a].div_ceil(32) * 32).min([100, 70][a]) - u64::from(low[a] / 32 * 32);
    let (rectangle, slices) = (span(0) * span(1), u64::from(high[2] - low[2]));
    assert!(rectangle < 100 * 70 / 2 && slices < 25, "{low:?} to {high:?}");
    assert_eq!(Slot::Volume.bytes(&of(vr)), rectangle * slices * 2);
    let smooth = of(&format!("{vr}\nslices.smooth = {{ elevation = 0.5 }}"));
    let reach = u64::from(smooth.smoothing_radius()[2]);
    assert_eq!(Slot::SharpVolume.bytes(&smooth), rectangle * (slices + 2 * reach) * 2);
    let nothing = of("mode = 'vr'\nclip = [{ at = [500, 0, 0], normal = [-1, 0, 0] }]");
    assert_eq!(Slot::Volume.bytes(&nothing), 2, "at least one texel");
}

/// Formats, and ways to take samples.
const STORED: [(&str, &str); 7] = [
    ("r8", "quads"),
    ("r16", "exact"),
    ("r16f", "quads"),
    ("r32f", "exact"),
    ("r16", "quads"),
    ("r8", "exact"),
    ("r16f", "hardware"),
];

struct Drawn {
    picture: Picture,
    distance: Option<Texels>,
    volume: Texels,
    scene: Scene,
}

fn draw(device: &Device, scene: Scene, frames: &[Texels]) -> Drawn {
    let mut renderer = rendered(device, scene, frames);
    let picture = renderer.picture().expect("picture");
    let distance = renderer.read(Slot::Distance).expect("read");
    let volume = renderer.read(Slot::Volume).expect("read").expect("there");
    Drawn { picture, distance, volume, scene: renderer.scene().clone() }
}

/// What is read back of the volume is the same wherever it is visible.
fn same_texels(device: &Device, part: &Drawn, all: &Drawn, what: &str) {
    assert_eq!(part.volume.size, all.volume.size, "{what}");
    let VisibleBounds { low, high } = part.scene.visible_bounds;
    let visible = |volume: &Texels| -> Vec<f64> {
        let rows = (low[2]..high[2]).flat_map(|z| (low[1]..high[1]).map(move |y| (y, z)));
        let places = rows.flat_map(|(y, z)| (low[0]..high[0]).map(move |x| [x, y, z].map(|n| n as usize)));
        places.flat_map(|at| volume.get(at).to_vec()).collect()
    };
    assert!(same_values(device, &visible(&part.volume), &visible(&all.volume), 1e-5), "{what}: texels");
}

/// Bit for bit where texels are fetched. The device's filter takes coordinates that are divided by the size of the image: the quotients of
/// two sizes round differently, by at most 2^-24 of the larger size, which is 1e-5 of a texel here. A sample then differs by 1e-5 of the
/// difference of two texels, which may change the rounding of a level, and now and then what a threshold decides.
#[test]
fn pictures_of_the_stored_part_are_those_of_the_whole_volume() {
    let device = Device::new();
    let (mut stored, mut whole, mut filtered) = (0, 0, 0);
    for (g, (name, geometry)) in geometries().iter().enumerate() {
        // Every window in every second geometry.
        for (w, window) in WINDOWS.iter().enumerate().filter(|(w, _)| (g + w) % 2 == 0) {
            let (format, sampling) = STORED[(3 * g + w) % STORED.len()];
            let (filter, slices) = FILTERS[(5 * g + 2 * w) % FILTERS.len()];
            let of = |everything: bool| {
                let slices = format!("format = '{format}', pixels = 96, everything = {everything}, {slices}");
                let toml = format!(
                    "{window}\npicture.size = [26, 22]\ncamera = {{ azimuth = 25, elevation = -15 }}\nray.sampling = '{sampling}'\nslices = {{ {} }}",
                    slices.trim_end_matches([',', ' '])
                );
                scene(geometry.clone(), BYTES, &toml)
            };
            let frames = speckle(&of(true));
            let (part, all) = (draw(&device, of(false), &frames), draw(&device, of(true), &frames));
            let what = format!("{name}, {filter}, {format}, {sampling}, {window}");
            stored += Slot::Volume.bytes(&part.scene);
            whole += Slot::Volume.bytes(&all.scene);
            same_texels(&device, &part, &all, &what);
            if sampling != "hardware" {
                let is_same = same_picture(&device, &part.picture, &all.picture)
                    && same_slot(&device, &part.distance, &all.distance, GPU_MM);
                assert!(is_same, "{what}");
                continue;
            }
            filtered += 1;
            let (mean, largest) = difference(&part.picture, &all.picture);
            println!("{what}: {mean} levels on average, {largest} at most");
            assert!(mean < 0.02, "{what}: {mean} levels on average, {largest} at most");
            if let (Some(a), Some(b)) = (&part.distance, &all.distance) {
                let off = |(a, b): (&f64, &f64)| is_hit(*a) != is_hit(*b) || (is_hit(*a) && (a - b).abs() > 1e-3);
                assert!(a.values.iter().zip(&b.values).filter(|p| off(*p)).count() * 500 <= a.values.len(), "{what}");
            }
        }
    }
    println!("{stored} of {whole} bytes");
    assert!(filtered > 2 && stored * 4 < whole * 3, "{filtered}, {stored} of {whole}");
}

/// A scene of any window, which may smooth across slices, with or without everything else.
fn any_window(geometry: &Geometry, noise: &mut Noise) -> Scene {
    let mut pick = |n: usize| (noise.next() * n as f64) as usize;
    let window = WINDOWS[pick(WINDOWS.len())];
    let sampling = ["quads", "exact"][pick(2)];
    let smooth = ["0.4", "0.9", "1.4"][pick(3)];
    let everything = pick(5) == 0;
    let toml = format!(
        "{window}\npicture.size = [18, 16]\nray.sampling = '{sampling}'\nslices = {{ pixels = 72, everything = {everything}, smooth = {{ elevation = {smooth} }} }}"
    );
    scene(geometry.clone(), BYTES, &toml)
}

/// What was stored for an earlier scene is used where it holds the next; frames are asked for where it does not, and single frames may come
/// in between.
#[test]
fn any_change_of_what_is_visible_gives_the_picture_of_a_fresh_renderer() {
    let device = Device::new();
    for geometry in [Geometry::Sweep(wobbler()), cartesian([61, 70, 12])] {
        let mut noise = Noise(29);
        let first = any_window(&geometry, &mut noise);
        let mut frames = speckle(&first);
        let mut renderer = rendered(&device, first, &frames);
        let (mut kept, mut smaller) = (0, 0);
        for round in 0..40 {
            let scene = any_window(&geometry, &mut noise);
            let rerun = renderer.change(scene.clone()).expect("change");
            let now = renderer.scene().stored_bounds();
            assert!(now.holds(&scene.stored_bounds()), "round {round}");
            if matches!(rerun, Rerun::Steps { .. }) {
                kept += 1;
                smaller += usize::from(now != scene.stored_bounds());
            } else {
                assert_eq!(now, scene.stored_bounds(), "round {round}: no more than is shown");
                send(&mut renderer, &frames, 0);
            }
            if round % 4 == 1 {
                // A new frame, and the same in what a fresh renderer gets.
                let slice = (round / 4) % frames.len();
                frames[slice] = frames[(slice + 3) % frames.len()].clone();
                renderer.frame(slice as u32, &frames[slice].encode(frame_format(&scene)), 0).expect("frame");
                renderer.show(0).expect("show");
            }
            let picture = renderer.picture().expect("picture");
            let fresh = rendered(&device, scene.clone(), &frames).picture().expect("picture");
            assert!(picture == fresh, "round {round}: {rerun:?}, {:?}", scene.settings);
        }
        println!("{kept} of 40 changes needed no frames, {smaller} showed less than is stored");
        assert!(kept > 4 && smaller > 2, "{kept}, {smaller}");
    }
}

/// Smoothing that reaches further across slices needs slices that were never sent: the visible bounds are the same.
#[test]
fn smoothing_that_reaches_further_asks_for_the_slices_beyond() {
    let device = Device::new();
    let of = |elevation: f64| {
        let toml = format!("mode = 'plane'\npicture.size = [24, 20]\nslices.smooth = {{ elevation = {elevation} }}");
        scene(cartesian([24, 33, 21]), BYTES, &toml)
    };
    let (near, far) = (of(0.3), of(1.3));
    assert_eq!(near.visible_bounds, far.visible_bounds);
    let frames = speckle(&near);
    let mut renderer = rendered(&device, near.clone(), &frames);
    renderer.picture().expect("picture");
    assert_eq!(renderer.change(far.clone()).expect("change"), Rerun::Frames);
    send(&mut renderer, &frames, 0);
    assert_eq!(renderer.picture().expect("picture"), rendered(&device, far, &frames).picture().expect("picture"));
    assert!(matches!(renderer.change(near.clone()).expect("change"), Rerun::Steps { .. }), "what it needs is there");
    assert_eq!(renderer.picture().expect("picture"), rendered(&device, near, &frames).picture().expect("picture"));
}

/// Frames that no pass touches are cut out of the staging buffer by the copy: the first column and row, the length of a row and of a frame, and the
/// texel's size are those of what was staged.
#[test]
fn copied_frames_are_cut_to_what_is_stored() {
    let device = Device::new();
    for (stored, full, format) in [
        (StoredType::U8, 255.0, "r8"),
        (StoredType::U8, 255.0, "r16"),
        (StoredType::U8, 255.0, "r32f"),
        (StoredType::U16, 65535.0, "r16"),
        (StoredType::U16, 65535.0, "r32f"),
        (StoredType::F32, 1.0, "r32f"),
    ] {
        for smooth in ["", ", smooth = { elevation = 0.7 }"] {
            let of = |everything: bool| {
                let toml = format!(
                    "mode = 'mip'\npicture.size = [40, 32]\nray.sampling = 'exact'\ncamera = {{ azimuth = 25, elevation = -15 }}\nregion = {{ lateral = [14, 21], depth = [25, 33], elevation = [9, 13] }}\nslices = {{ format = '{format}', everything = {everything}{smooth} }}"
                );
                let grid = Grid { size: [150, 203, 24], spacing: [0.25, 0.25, 1.0], origin: [0.0; 3] };
                scene(Geometry::Cartesian(grid), Input { stored, range: [0.0, full] }, &toml)
            };
            let what = format!("{stored:?} in {format}{smooth}");
            let [column, row, slice] = Slot::Volume.first_texel(&of(false));
            assert!(column > 0 && row > 0 && slice > 0, "{what}: {:?}", of(false).stored_bounds());
            assert_eq!(
                chain::copied(&of(false)),
                Some(if smooth.is_empty() { Slot::Volume } else { Slot::SharpVolume })
            );
            let frames = speckle(&of(true));
            let (part, all) = (draw(&device, of(false), &frames), draw(&device, of(true), &frames));
            assert!(part.picture.rgba.iter().any(|v| *v > 0 && *v < 255), "{what}: black");
            assert!(part.picture == all.picture, "{what}");
            same_texels(&device, &part, &all, &what);
        }
    }
}
