//! Only the visible part is converted and filtered: no sample of stage 2 is outside of it, the picture is the same bit for
//! bit, and frames are requested again only if more becomes visible.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::filter::gaussian;
use echolume::low_level::passes::{DispatchArgs, Slot, Texels, by_name};
use echolume::low_level::plan::Rerun;
use echolume::low_level::probe::{Advance, Geometry, Probe};
use echolume::low_level::scene::{Elevation, Mode, Scene, VisibleBounds};
use glam::DVec3;

fn moved(probe: Probe) -> Probe {
    Probe { advance: Advance::Same(0.7 * probe.slices.pitch()), ..probe }
}

pub fn geometries() -> Vec<(&'static str, Geometry)> {
    let each = (0..9).map(|k| if k % 3 == 0 { 0.03 } else { -0.02 }).collect();
    vec![
        ("Cartesian", cartesian([61, 70, 9])),
        ("fan", Geometry::Sweep(wobbler())),
        ("fan, motor moving", Geometry::Sweep(moved(wobbler()))),
        ("fan, uneven and moving", Geometry::Sweep(Probe { advance: Advance::Each(each), ..uneven(wobbler()) })),
        ("translated", Geometry::Sweep(linear())),
        ("translated, moving", Geometry::Sweep(moved(linear()))),
        ("single frame", Geometry::Sweep(still())),
        ("radial, moving", Geometry::Sweep(moved(radial()))),
    ]
}

/// Texel indices of a point, by the exact inverse of the probe's maps; none if it is not insonified.
fn texel(scene: &Scene, place: DVec3) -> Option<[f64; 3]> {
    let column = |v: f64, axis: usize| (v - scene.grid.origin[axis]) / scene.grid.pitch[axis];
    match &scene.geometry {
        Geometry::Cartesian(grid) => Some(std::array::from_fn(|a| (place[a] - grid.origin[a]) / grid.spacing[a])),
        Geometry::Sweep(probe) => {
            let (x, y, _) = probe.inverse_sweep_map(place);
            let at = probe.to_indices(place);
            let within = |index: f64, count: usize| index >= 0.0 && index <= (count - 1) as f64;
            let inside = within(at.sample, probe.samples)
                && within(at.line, probe.lines.len())
                && within(at.slice, probe.slices.len());
            inside.then(|| [column(x, 0), column(y, 1), at.slice])
        }
    }
}

/// The texels that a sample at these indices mixes.
fn mixed(scene: &Scene, at: [f64; 3]) -> VisibleBounds {
    let last = scene.volume_size().map(|n| f64::from(n - 1));
    let clamped = |v: f64, axis: usize| v.clamp(0.0, last[axis]) as u32;
    // The B-spline mixes four slices.
    let more = |a: usize| f64::from(u8::from(a == 2 && scene.settings.ray.elevation != Elevation::Linear));
    VisibleBounds {
        low: std::array::from_fn(|a| clamped(at[a].floor() - more(a), a)),
        high: std::array::from_fn(|a| clamped(at[a].floor() + 1.0 + more(a), a) + 1),
    }
}

fn random_scene(geometry: &Geometry, noise: &mut Noise) -> Scene {
    let free = scene(geometry.clone(), BYTES, "");
    let offset = free.probe().map_or(0.0, |p| p.array_radius());
    let mut sides = Vec::new();
    for (axis, name) in ["lateral", "depth", "elevation"].iter().enumerate() {
        let off = if axis == 1 { offset } else { 0.0 };
        let (low, high) = (free.low[axis] - off, free.high[axis] - off);
        let at = noise.range(low, high);
        let end = noise.range(at, high).max(at + 0.02 * (high - low));
        if noise.next() < 0.7 {
            sides.push(format!("{name} = [{at}, {end}]"));
        }
    }
    let mode = ["sr", "vr", "mixed", "mip", "plane", "cube"][(noise.next() * 6.0) as usize];
    let clip = match noise.next() < 0.4 {
        true => {
            let at = (free.low + free.high) / 2.0 - DVec3::Y * offset;
            let n: [f64; 3] = std::array::from_fn(|_| noise.range(-1.0, 1.0));
            format!("clip = [{{ at = [{}, {}, {}], normal = [{}, {}, {}] }}]", at.x, at.y, at.z, n[0], n[1], n[2])
        }
        false => String::new(),
    };
    let pick = |noise: &mut Noise, of: &[&str]| of[(noise.next() * of.len() as f64) as usize].to_string();
    let ray = pick(
        noise,
        &["", "ray.sliding = 3", "ray.sliding = 5", "ray.spread = 1.0", "ray.entries = 5", "ray.elevation = 'bspline'"],
    );
    let rough = pick(noise, &["1", "2", "5"]);
    let planes =
        ["", "planes = { tilt = 20, azimuth = -35 }", "planes = { plane = 'b', thickness = 3 }"][sides.len() % 3];
    let depth = free.low.y - offset + noise.range(0.0, 0.5) * (free.high.y - free.low.y);
    let start = if noise.next() < 0.3 { format!("surface.start_depth = {depth}") } else { String::new() };
    let toml = format!(
        "mode = '{mode}'\nslices.pixels = 120\nsurface.rough = {rough}\n{ray}\n{planes}\n{start}\n{clip}\nregion = {{ {} }}",
        sides.join(", ")
    );
    let settings = settings(&toml);
    // A start depth below the region, or a face that leaves nothing, is refused: then only the region is set.
    Scene::new(geometry.clone(), BYTES, settings)
        .unwrap_or_else(|_| scene(geometry.clone(), BYTES, &format!("mode = '{mode}'\nslices.pixels = 120")))
}

/// A point that a pass may sample: inside the kept part, or at most as far from it as its samples reach.
fn sampled(scene: &Scene, noise: &mut Noise) -> Option<DVec3> {
    let sr = scene.settings.mode == Mode::Surface || (scene.settings.mode == Mode::Mixed && noise.next() < 0.5);
    let low = if sr { scene.surface_view().low } else { scene.low };
    // Corners and edges are where a bound fails first.
    let within = |noise: &mut Noise, a: f64, b: f64| match noise.next() {
        s if s < 0.2 => a,
        s if s < 0.4 => b,
        _ => noise.range(a, b),
    };
    let place = DVec3::from_array(std::array::from_fn(|a| within(noise, low[a], scene.high[a])));
    if scene.clips().any(|(normal, limit)| normal.dot(place) > limit) {
        return None;
    }
    let marches = !matches!(scene.settings.mode, Mode::Plane | Mode::Cube);
    let ring = if sr { scene.ring.half * scene.settings.surface.rough + scene.ring.samples() } else { 0 };
    let steps = if marches { ring + scene.settings.ray.sliding / 2 } else { 0 };
    let away = DVec3::from_array(std::array::from_fn(|_| noise.range(-1.0, 1.0))).normalize_or_zero();
    let step = if sr { scene.ring.step } else { scene.step };
    let far = within(noise, 0.0, 1.0);
    if scene.settings.mode == Mode::Plane {
        return on_plane(scene, place);
    }
    Some(place + away * (f64::from(steps) * step * far))
}

/// The place of a plane, or of its slab, below another; none if that is not shown.
fn on_plane(scene: &Scene, place: DVec3) -> Option<DVec3> {
    let plane = scene.tiling().tiles[0].plane;
    let share = Noise(place.x.to_bits()).range(-0.5, 0.5);
    let below = place - plane.normal * ((place - plane.at).dot(plane.normal) - scene.settings.planes.thickness * share);
    let is_kept = (0..3).all(|a| below[a] >= scene.low[a] && below[a] <= scene.high[a])
        && scene.clips().all(|(normal, limit)| normal.dot(below) <= limit);
    is_kept.then_some(below)
}

#[test]
fn samples_stay_within_the_visible_bounds_and_the_bounds_are_tight() {
    let mut noise = Noise(17);
    for (name, geometry) in geometries() {
        let (mut bounds, mut least, mut cases) = (0.0, 0.0, 0);
        for _ in 0..60 {
            let scene = random_scene(&geometry, &mut noise);
            let mut found: Option<VisibleBounds> = None;
            for _ in 0..4000 {
                let Some(at) = sampled(&scene, &mut noise).and_then(|place| texel(&scene, place)) else { continue };
                let mixed = mixed(&scene, at);
                assert!(
                    scene.visible_bounds.holds(&mixed),
                    "{name}: {at:?} is not of {:?}\n{:?}",
                    scene.visible_bounds,
                    scene.settings
                );
                let old = found.unwrap_or(mixed);
                found = Some(VisibleBounds {
                    low: std::array::from_fn(|a| old.low[a].min(mixed.low[a])),
                    high: std::array::from_fn(|a| old.high[a].max(mixed.high[a])),
                });
            }
            let Some(found) = found else { continue };
            // A plane's box may be one slice thick: its slack is more than that.
            if scene.settings.mode == Mode::Plane {
                continue;
            }
            // Two texels of slack on each side, and those that random points have missed.
            let (size, count) = (scene.volume_size(), |low: [u32; 3], high: [u32; 3]| {
                (0..3).map(|a| f64::from(high[a] - low[a])).product::<f64>()
            });
            least += count(
                found.low.map(|n| n.saturating_sub(2)),
                std::array::from_fn(|a| (found.high[a] + 2).min(size[a])),
            );
            bounds += count(scene.visible_bounds.low, scene.visible_bounds.high);
            cases += 1;
        }
        println!("{name}: {:.2} of the least boxes of {cases} scenes", bounds / least);
        // The advance of the motor within a frame may be one of nine slices on each side: the box covers sweeps in both directions.
        assert!(cases > 20 && bounds / least < 3.0, "{name}");
    }
}

#[test]
fn each_side_of_a_region_cuts_its_own_side_of_the_volume() {
    let all =
        |toml: &str| scene(Geometry::Sweep(wobbler()), BYTES, &format!("mode = 'vr'\nslices.pixels = 200\n{toml}"));
    let whole = all("").visible_bounds;
    assert_eq!(whole, VisibleBounds::all(all("").volume_size()));
    let cuts = |toml: &str| {
        let seen = all(toml).visible_bounds;
        let sides = (0..3).flat_map(|a| [seen.low[a] > whole.low[a] + 1, seen.high[a] + 1 < whole.high[a]]);
        sides.enumerate().filter(|(_, cut)| *cut).map(|(i, _)| i).collect::<Vec<_>>()
    };
    assert_eq!(cuts("region.lateral = [-5, 60]"), [0]);
    assert_eq!(cuts("region.lateral = [-60, 5]"), [1]);
    assert_eq!(cuts("region.elevation = [2, 60]"), [4]);
    assert_eq!(cuts("region.elevation = [-60, -2]"), [5]);
    assert!(cuts("region.depth = [30, 90]").contains(&2), "the near side");
    assert!(cuts("region.depth = [-9, 20]").contains(&3), "the far side");
    assert_eq!(cuts("volume.start_depth = 30"), cuts("region.depth = [30, 90]"));
    assert_eq!(cuts("clip = [{ at = [5, 0, 0], normal = [2, 0, 0] }]"), [1]);
    assert_eq!(
        all("clip = [{ at = [500, 0, 0], normal = [-1, 0, 0] }]").visible_bounds,
        VisibleBounds::default(),
        "all is cut away"
    );
    assert_eq!(cuts("region.lateral = [-5, 5]\nslices.everything = true"), [0; 0]);
}

pub const FILTERS: [(&str, &str); 11] = [
    ("none", ""),
    ("median", "median = true"),
    ("Nagao-Matsuyama", "estimator = 'nagao-matsuyama'"),
    ("sigma", "sigma = { window = 9, sigma = 0.1 }"),
    ("enhanced sigma", "enhanced_sigma = { window = 3, largest = 11, sigma = 0.05, centre = 'nagao-matsuyama' }"),
    ("Perona-Malik", "perona_malik = { repeat = 12 }"),
    (
        "AOS between filters",
        "median = true, perona_malik = { scheme = 'aos', step = 3.0, repeat = 2 }, smooth = { lateral = 1.0 }",
    ),
    ("Gaussian", "smooth = { lateral = 1.2, depth = 0.9, elevation = 0.8 }"),
    ("kernel", "smooth = { kernel = 5 }"),
    ("slight blur", "blur = true, median = true"),
    (
        "all",
        "median = true, estimator = 'perona-malik', sigma = { window = 5 }, enhanced_sigma = { window = 3, largest = 7 }, \
         perona_malik = { repeat = 2 }, smooth = { lateral = 0.8, depth = 0.8, elevation = 1.1 }",
    ),
];

/// Windows on the volume, in depths below the face or along the axes of the Cartesian one.
pub const WINDOWS: [&str; 9] = [
    "mode = 'plane'\nplanes = { tilt = 8, thickness = 1.5 }",
    "mode = 'plane'\nplanes = { plane = 'c', zoom = 2.0 }\nray.elevation = 'bspline'",
    "mode = 'tomography'\nplanes = { plane = 'b', columns = 2, rows = 1, spacing = 3.0 }\nregion = { depth = [8, 22] }",
    "mode = 'sr'\nray.elevation = 'bspline'\nregion = { lateral = [-6, 9], depth = [14, 24], elevation = [-2, 3] }",
    "mode = 'vr'\nvolume = { start_depth = 13.0 }\nray.sliding = 3\nregion = { lateral = [-20, 4] }",
    "mode = 'mixed'\nsurface = { start_depth = 16.0 }\nvolume = { start_depth = 10.0 }\nlight.skin = {}\nregion = { elevation = [-3, 1] }",
    "mode = 'vr'\nlayout = 'beside'\nregion = { lateral = [-3, 8], depth = [5, 19] }",
    "mode = 'mip'\nlayout = 'four'\nregion = { lateral = [-3, 8], depth = [5, 19] }\nclip = [{ at = [4, 15, 0], normal = [1, 0.4, 0.3] }]",
    "mode = 'cube'\ncube.inset.right = 3\nregion = { depth = [8, 22], elevation = [-1, 2] }",
];

pub fn speckle(scene: &Scene) -> Vec<Texels> {
    let mut noise = Noise(23);
    let mut frames = body_frames(scene, |p| 0.35 + 0.3 * (0.4 * (p.x + 1.3 * p.y + 0.7 * p.z)).sin());
    frames.iter_mut().flat_map(|f| &mut f.values).for_each(|v| *v = (*v + 0.3 * noise.next()).clamp(0.0, 1.0));
    frames
}

#[test]
fn the_picture_equals_that_of_the_completely_filtered_volume() {
    let device = Device::new();
    let mut smallest = 1.0f64;
    for (g, (name, geometry)) in geometries().iter().enumerate() {
        for (f, (filter, slices)) in FILTERS.iter().enumerate() {
            let window = WINDOWS[(g + f) % WINDOWS.len()];
            let toml = |everything: bool| {
                let slices = format!("pixels = 96, everything = {everything}, {slices}");
                format!(
                    "{window}\npicture.size = [26, 22]\ncamera = {{ azimuth = 25, elevation = -15 }}\nslices = {{ {} }}",
                    slices.trim_end_matches([',', ' '])
                )
            };
            let made = |everything: bool| scene(geometry.clone(), BYTES, &toml(everything));
            let frames = speckle(&made(true));
            let draw = |renderer: &mut Renderer| {
                let picture = renderer.picture().expect("picture");
                let distance = renderer.read(Slot::Distance).expect("read");
                // Planes are toned as they are cut.
                let slot = if renderer.plan().slots.contains(&Slot::Picture) { Slot::Picture } else { Slot::Screen };
                let drawn = renderer.read(slot).expect("read").expect("there");
                (renderer.scene().visible_share(), picture, distance, drawn)
            };
            // The visible part first, so that nothing of the complete volume exists yet.
            let mut renderer = rendered(&device, made(false), &frames);
            let (share, b, b_distance, b_drawn) = draw(&mut renderer);
            let rerun = renderer.change(made(true)).expect("change");
            assert_eq!(rerun == Rerun::Frames, share < 1.0, "{name}, {filter}: {rerun:?}");
            send(&mut renderer, &frames, 0);
            let (whole, a, a_distance, a_drawn) = draw(&mut renderer);
            assert_eq!(whole, 1.0);
            smallest = smallest.min(share);
            assert!(a_drawn.values.iter().any(|v| *v > 0.0), "{name}, {filter}: a black picture shows nothing");
            let is_same = same_picture(&device, &a, &b)
                && same_values(&device, &a_drawn.values, &b_drawn.values, GPU_LEVELS / 255.0)
                && same_slot(&device, &a_distance, &b_distance, GPU_MM);
            assert!(is_same, "{name}, {filter}, {window}");
        }
    }
    assert!(smallest < 0.1, "{smallest}: the windows hide too little");
}

const WINDOW: &str =
    "mode = 'sr'\npicture.size = [24, 24]\nray.step = 0.1\nsurface.edge = 0.4\ncamera = { target = [0, 25, 0] }";

fn with(window: &str, slices: &str) -> Scene {
    scene(Geometry::Sweep(wobbler()), BYTES, &format!("{WINDOW}\nslices = {{ pixels = 200{slices} }}\n{window}"))
}

/// A plane takes the slices that it crosses, and those that smoothing across slices mixes into them.
#[test]
fn planes_upload_and_filter_the_slices_that_they_cross() {
    let device = Device::new();
    let still = Geometry::Sweep(still());
    for (geometry, toml, sent, converted) in [
        (cartesian([24, 33, 11]), "mode = 'plane'", 2..=3, "load_slice"),
        (cartesian([24, 33, 11]), "mode = 'plane'\nplanes.thickness = 2.0", 3..=6, "load_slice"),
        (cartesian([24, 33, 11]), "mode = 'plane'\nslices.smooth = { elevation = 0.3 }", 4..=5, "load_slice"),
        (cartesian([24, 33, 11]), "mode = 'plane'\nplanes.plane = 'b'", 11..=11, "load_slice"),
        (cartesian([24, 33, 11]), "mode = 'orthogonal'", 11..=11, "load_slice"),
        (cartesian([24, 33, 11]), "mode = 'plane'\nslices.everything = true", 11..=11, "load_slice"),
        (Geometry::Sweep(wobbler()), "mode = 'plane'\nslices.median = true", 2..=3, "scan_convert"),
        (still, "mode = 'plane'", 1..=1, "scan_convert"),
    ] {
        // A format that no frame is copied to without a pass.
        let scene = scene(
            geometry,
            BYTES,
            &format!("{toml}\npicture.size = [24, 20]\nslices.pixels = 48\nslices.format = 'r16f'"),
        );
        let frames = speckle(&scene);
        let mut renderer = Renderer::new(&device, scene.clone(), &RendererOptions::default()).expect("renderer");
        let passes = renderer
            .dispatch_extents(|r| {
                send(r, &frames, 0);
                r.picture()
            })
            .expect("recorded");
        let slices_of =
            |pass: &str| -> u32 { passes.iter().filter(|(name, _)| *name == pass).map(|(_, e)| e[2]).sum() };
        let count = slices_of(converted) as usize;
        assert!(sent.contains(&count), "{toml}: {count} slices are converted");
        assert_eq!(renderer.skipped_frames() as usize, frames.len() - count, "{toml}");
        let times = renderer.take_times().expect("times");
        let uploads = times.iter().find(|t| t.name == "upload").map_or(count as u64, |t| u64::from(t.runs));
        assert_eq!(uploads, count as u64, "{toml}");
        if toml.contains("median") {
            assert_eq!(slices_of("median_slice") as usize, count);
        }
    }
}

/// A B-mode picture is its plane: no ray is cast, and no range of bricks is made.
#[test]
fn the_b_mode_preset_takes_two_dispatches() {
    let device = Device::new();
    let mut layers = echolume::low_level::scene::load::Layers::default();
    layers.preset("bmode").expect("preset");
    let mut settings = layers.finish().expect("settings");
    settings.picture.size = [24, 20];
    let scene = Scene::new(Geometry::Sweep(still()), BYTES, settings).expect("scene");
    let frames = speckle(&scene);
    let mut renderer = Renderer::new(&device, scene, &RendererOptions::default()).expect("renderer");
    let passes = renderer
        .dispatched_passes(|r| {
            send(r, &frames, 0);
            r.picture()
        })
        .expect("recorded");
    assert_eq!(passes, ["scan_convert", "raycast_planes_toned"]);
}

#[test]
fn nothing_outside_the_visible_bounds_is_dispatched_uploaded_or_written() {
    let device = Device::new();
    let smooth = ", median = true, smooth = { lateral = 1.0, elevation = 0.3 }";
    let scene = with("region = { lateral = [-4, 6], depth = [20, 30], elevation = [4, 9] }", smooth);
    let frames = scene.visible_frames();
    assert!(
        frames.len() < 8 && frames.len() > scene.visible_bounds.slices().len(),
        "{frames:?} of 9, {:?}",
        scene.visible_bounds
    );
    let bright = speckle(&scene);
    let mut renderer = Renderer::new(&device, scene.clone(), &RendererOptions::default()).expect("renderer");
    let recorded = renderer
        .dispatch_extents(|r| {
            send(r, &bright, 0);
            r.picture()
        })
        .expect("recorded");
    assert_eq!(renderer.skipped_frames(), 9 - frames.len() as u64);
    for name in ["scan_convert", "median_slice", "gaussian_lateral", "gaussian_elevation"] {
        let made =
            by_name(name).expect("pass").rectangle(&scene, &DispatchArgs::default()).expect("a pass over slices");
        let extents: Vec<[u32; 3]> = recorded.iter().filter(|(n, _)| *n == name).map(|(_, e)| *e).collect();
        // Some passes write several texels an invocation.
        let run = |axis: usize| match (name, axis) {
            ("median_slice", _) => 4,
            ("gaussian_lateral", 0) => gaussian::RUN,
            _ => 1,
        };
        let expected = [0, 1].map(|axis| made.size[axis].div_ceil(run(axis)));
        let each = extents.iter().all(|[x, y, _]| [*x, *y] == expected);
        assert!(each && made.size[0] < scene.grid.size[0] / 2, "{name}: {extents:?}, {made:?}");
        let slices = if name == "gaussian_elevation" { scene.visible_bounds.slices().len() } else { frames.len() };
        let run = if name == "gaussian_elevation" { gaussian::RUN } else { 1 };
        assert_eq!(extents.iter().map(|e| e[2]).sum::<u32>(), (slices as u32).div_ceil(run), "{name}");
    }
    for (slot, pass, slices) in [
        (Slot::SharpVolume, "gaussian_lateral", frames),
        (Slot::Volume, "gaussian_elevation", scene.visible_bounds.slices()),
    ] {
        let made =
            by_name(pass).expect("pass").rectangle(&scene, &DispatchArgs::default()).expect("a pass over slices");
        let volume = renderer.read(slot).expect("read").expect("there");
        let [width, height, depth] = volume.size;
        let mut written = 0;
        for (x, y, z) in (0..depth).flat_map(|z| (0..height).flat_map(move |y| (0..width).map(move |x| (x, y, z)))) {
            let along = |at: usize, a: usize| (made.first[a]..made.first[a] + made.size[a]).contains(&(at as u32));
            let inside = along(x, 0) && along(y, 1) && slices.contains(&(z as u32));
            let value = volume.one(x, y, z);
            assert!(inside || value == 0.0, "{}: {x}, {y}, {z} is {value}", slot.name());
            written += u32::from(value > 0.0);
        }
        assert!(written > 1000, "{}: {written}", slot.name());
    }
}

#[test]
fn a_region_that_shrinks_needs_no_frames_and_one_that_grows_does() {
    let device = Device::new();
    let smooth = ", smooth = { lateral = 1.0, elevation = 0.8 }";
    // Bricks, which a GPU always skips, know the ranges of what was visible alone: a region that grows back needs frames for them.
    let [small, middle, large] = ["[-3, 4]", "[-6, 7]", "[-10, 12]"]
        .map(|side| with(&format!("ray.brick = 0\nregion = {{ lateral = {side}, elevation = {side} }}"), smooth));
    let frames = speckle(&small);
    let fresh = |scene: &Scene| rendered(&device, scene.clone(), &frames).picture().expect("picture");
    let without_frames = |rerun: &Rerun| matches!(rerun, Rerun::Steps { .. });

    let mut renderer = rendered(&device, middle.clone(), &frames);
    assert_eq!(renderer.picture().expect("picture"), fresh(&middle));
    assert!(without_frames(&renderer.change(small.clone()).expect("change")), "it shrinks");
    let passes = renderer.dispatched_passes(|r| r.picture()).expect("picture");
    assert!(passes[0] == "raycast_surface", "{passes:?}");
    assert_eq!(renderer.picture().expect("picture"), fresh(&small));
    assert!(without_frames(&renderer.change(middle.clone()).expect("change")), "what was there is there still");
    assert_eq!(renderer.picture().expect("picture"), fresh(&middle));
    assert_eq!(renderer.change(large.clone()).expect("change"), Rerun::Frames, "it grows");
    send(&mut renderer, &frames, 0);
    assert_eq!(renderer.picture().expect("picture"), fresh(&large));

    // A frame received meanwhile was filtered over the smaller region, and so were slices smoothed meanwhile.
    assert!(without_frames(&renderer.change(small.clone()).expect("change")));
    renderer.frame(4, &frames[4].encode(frame_format(&small)), 0).expect("frame");
    assert_eq!(renderer.change(large.clone()).expect("change"), Rerun::Frames);
    send(&mut renderer, &frames, 0);
    assert!(without_frames(&renderer.change(small.clone()).expect("change")));
    renderer.picture().expect("picture");
    assert_eq!(renderer.change(large.clone()).expect("change"), Rerun::Frames);
    send(&mut renderer, &frames, 0);
    assert_eq!(renderer.picture().expect("picture"), fresh(&large));

    // While a region is dragged the complete volume is kept; afterwards new frames are cut again.
    let dragged = with("region = { lateral = [-3, 4] }", &format!("{smooth}, everything = true"));
    assert_eq!(renderer.change(dragged).expect("change"), Rerun::Frames);
    send(&mut renderer, &frames, 0);
    renderer.picture().expect("picture");
    for scene in [&small, &large, &middle] {
        assert!(without_frames(&renderer.change(scene.clone()).expect("change")));
        assert_eq!(renderer.picture().expect("picture"), fresh(scene));
    }
    let recorded =
        renderer.dispatch_extents(|r| r.frame(4, &frames[4].encode(frame_format(&middle)), 0)).expect("frame");
    assert!(recorded.iter().all(|(_, [x, _, _])| *x < middle.grid.size[0]), "{recorded:?}");
}
