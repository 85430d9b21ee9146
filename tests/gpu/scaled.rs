//! Pictures do not depend on the unit of length: a volume whose voxels, and every setting in mm, are scaled by one factor has the same picture.

use crate::common::gpu::*;
use crate::common::lengths::scaled;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::load::{Layers, PRESETS};
use echolume::low_level::scene::{Scene, Settings};
use std::path::Path;

/// Voxels that all presets, which are framed for the built-in phantom, find something in.
const GRID: Grid = Grid { size: [40, 30, 36], spacing: [3.1, 3.0, 3.4], origin: [-60.5, 18.0, -59.5] };

/// Scaling by a power of two rounds nothing in f32 or f64, unless a length is compared with, added to, or limited by one that is not scaled.
const EXACT: [f64; 4] = [1.0 / 1024.0, 0.125, 8.0, 1024.0];
const ROUNDED: [f64; 5] = [1e-3, 1e-2, 0.1, 10.0, 1e3];

/// Blobs of all echoes in dark fluid, with edges of a voxel or two.
fn tissue(at: [usize; 3]) -> f64 {
    let [x, y, z] = at.map(|n| n as f64);
    let wave = (0.42 * x + 0.3).sin() * (0.5 * y + 0.2).sin() + 0.7 * (0.46 * z + 0.25 * x).sin();
    (0.45 + 1.6 * wave).clamp(0.0, 1.0)
}

/// All modes, with what they have in mm.
const SCENES: &[(&str, &str)] = &[
    (
        "mip",
        "mode = 'mip'\ncamera = { azimuth = 25, elevation = 35 }\nregion.elevation = [-40, 45.5]\nprojection.start_depth = 25",
    ),
    (
        "minip, near",
        "mode = 'minip'\ncamera = { azimuth = 200, elevation = 15, field_of_view = 40, target = [3, 60, -5] }",
    ),
    ("mean", "mode = 'mean'\nslices.smooth = { lateral = 3, depth = 2, elevation_mm = 4 }"),
    (
        "vr",
        "mode = 'vr'\ncamera = { azimuth = 25, elevation = 35 }\nvolume.start_depth = 22\nclip = [{ at = [0, 55, 5], normal = [0.3, 1, -0.2] }]\n\
         slices.sigma = { window_mm = 9 }",
    ),
    (
        "vr, coded by depth, pre-integrated",
        "mode = 'vr'\nvolume = { shading = 'depth-coded', compositing = 'pre-integrated', extinction = 0.4 }\n\
         camera = { azimuth = 40, field_of_view = 35 }",
    ),
    ("vr, exponential", "mode = 'vr'\nray.step = 2.3\nvolume = { compositing = 'exponential', extinction = 0.2 }"),
    (
        "vr, first hit",
        "mode = 'vr'\nvolume.shading = 'first-hit'\ncamera = { azimuth = 25, elevation = 35 }\n\
         light = { position = [30, 45, 90], cliff = 6, occlusion = { radius = 9 }, shadow = {} }",
    ),
    ("vr, bricks", "mode = 'vr'\nvolume.threshold = 0.5\nray.brick = 4\ncamera.azimuth = 30"),
    ("vr, a sliding filter", "mode = 'vr'\nray = { sliding = 3, step = 2 }"),
    (
        "vr, cuts",
        "mode = 'vr'\nvolume.threshold = 0.3\n\
         cuts = [{ contour = [[-20, -15], [25, -10], [5, 30]], view = { at = [0, 30, 0], direction = [0.2, 1, 0.1], up = [0, 0, 1], eye = 150 }, depth = 40 },\n\
         { brush = { radius = 14, strokes = [[[30, 40, 30], [40, 60, 20]]] } }]",
    ),
    ("vr, a start curve", "mode = 'vr'\nvolume.threshold = 0.3\nregion.start_curve = [[-40, 40], [0, 60], [35, 30]]"),
    ("vr, floating", "mode = 'vr'\nvolume.threshold = 0.5\nfloating = 9000\nslices.format = 'r16'"),
    (
        "vr, light in the volume",
        "mode = 'vr'\nvolume = { threshold = 0.4, extinction = 0.3 }\nregion.fade = 12\nlight.volume = { cell = 3, depth = 12, scatter = 4, widening = 1.1, reach = 60, slope = 0.01 }",
    ),
    (
        "a still",
        "mode = 'vr'\nvolume.extinction = 0.3\nlight.volume = { cell = 3 }\nstill = { samples = 2, events = 8 }",
    ),
    (
        "sr",
        "mode = 'sr'\ncamera = { azimuth = 25, elevation = 35 }\nlight = { cliff = 6, shadow = {}, occlusion = { radius = 9 }, skin = {} }",
    ),
    (
        "sr, near, with filters",
        "mode = 'sr'\ncamera = { azimuth = 200, elevation = 15, field_of_view = 40, target = [3, 60, -5] }\n\
         surface = { edge = 9, start_depth = 22, detector = 'adaptive' }\n\
         light.position = [30, 45, 90]\n\
         distance = { median_mm = 6, bilateral = { mm = 4, distance = 3 }, sigma = { window_mm = 9, sigma = 2 }, \
         enhanced_sigma = { window_mm = 6, largest_mm = 15, sigma = 2, edge = 3 }, perona_malik = { edge = 2, width_mm = 5 } }",
    ),
    ("sr, coloured behind", "mode = 'sr'\nsurface = { colour = 'behind', colour_depth = 8 }"),
    ("sr, samples", "mode = 'sr'\nsurface.edge = 'samples'\nray.rays = 2"),
    ("sr, half of the rays", "mode = 'sr'\nray.subsampling = 2\nlight.cliff = 6"),
    ("mixed, caps", "mode = 'mixed'\nsurface.edge = 8\nclip = [{ at = [0, 50, 5], normal = [0.2, -1, 0.3] }]"),
    ("pair", "layout = 'pair'\ncamera.elevation = 20"),
    (
        "four",
        "layout = 'four'\nplanes = { position = [4, 60, 3], smooth = { lateral = 2, depth = 2, elevation_mm = 3 } }",
    ),
    (
        "plane",
        "mode = 'plane'\nplanes = { position = [4, 60, 3], azimuth = 20, tilt = 30, thickness = 11 }\n\
         clip = [{ at = [0, 70, 5], normal = [0.3, 1, -0.2] }]",
    ),
    (
        "orthogonal, a curved plane",
        "mode = 'orthogonal'\nplanes = { thickness = 7, slab = 'max', curve = { points = [[-30, 40], [0, 70], [25, 50]] } }",
    ),
    ("tomography", "mode = 'tomography'\nplanes = { columns = 3, rows = 2, spacing = 7.5 }"),
    (
        "cube",
        "mode = 'cube'\ncamera = { azimuth = 25, elevation = 35 }\ncube = { tilt = { left = [10, -5] }, inset = { left = 12, top = 9 } }\n\
         clip = [{ at = [0, 70, 5], normal = [0.3, 1, -0.2] }]",
    ),
];

fn settings(preset: Option<&str>, toml: &str) -> Settings {
    let mut layers = Layers::default();
    preset.into_iter().for_each(|name| layers.preset(name).expect("preset"));
    let shared = "picture.size = [40, 36]\npost.floats = true\nray.early_end = 0.0";
    [shared, toml].into_iter().for_each(|toml| {
        layers.table("test", toml.parse().expect("TOML"), Path::new("")).expect("settings");
    });
    layers.finish().expect("settings")
}

/// Every scene, by name.
fn all() -> Vec<(String, Settings)> {
    let own = SCENES.iter().map(|(name, toml)| (name.to_string(), settings(None, toml)));
    own.chain(PRESETS.iter().map(|(name, _)| (format!("preset {name}"), settings(Some(name), "")))).collect()
}

fn picture(device: &Device, settings: &Settings, factor: f64) -> Texels {
    let [spacing, origin] = [GRID.spacing, GRID.origin].map(|of| of.map(|mm| mm * factor));
    let geometry = Geometry::Cartesian(Grid { spacing, origin, ..GRID });
    let scene = Scene::new(geometry, BYTES, scaled(settings, factor)).expect("scene");
    let frames = frames(&scene, tissue);
    let mut renderer = rendered(device, scene, &frames);
    renderer.picture().expect("picture");
    renderer.read(Slot::Picture).expect("read").expect("there")
}

/// Calls `is_same` with each scene's picture and its picture at each of the factors; returns what it says is not.
fn compared(factors: &[f64], is_same: impl Fn(&Device, &Texels, &Texels) -> Result<(), String>) -> Vec<String> {
    let device = Device::new();
    let mut faults = Vec::new();
    for (name, settings) in all() {
        let here = picture(&device, &settings, 1.0);
        let (least, most) = here.values.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!(most - least > 0.2, "{name}: nothing is shown, {least} to {most}");
        for factor in factors {
            let there = picture(&device, &settings, *factor);
            if let Err(fault) = is_same(&device, &here, &there) {
                faults.push(format!("{name}, times {factor}: {fault}"));
            }
        }
    }
    faults
}

fn differences(here: &Texels, there: &Texels) -> Vec<f64> {
    here.values.iter().zip(&there.values).map(|(a, b)| (a - b).abs()).collect()
}

/// Prevents a length in a shader, a pass or the camera that is not one of the scene: a start offset, an epsilon, a limit in mm.
#[test]
fn a_volume_scaled_by_a_power_of_two_has_the_same_picture_bit_for_bit() {
    let faults = compared(&EXACT, |device, here, there| {
        let off = differences(here, there);
        let largest = off.iter().copied().fold(0.0, f64::max);
        let count = off.iter().filter(|d| **d > 0.0).count();
        match same_values(device, &here.values, &there.values, 4e-3) {
            true => Ok(()),
            false => Err(format!("{count} of {} values differ, by up to {largest:.1e}", off.len())),
        }
    });
    assert!(faults.is_empty(), "{} pictures depend on the unit:\n{}", faults.len(), faults.join("\n"));
}

/// The same by factors that round. A ray along a border, a clip plane or a cliff may fall on either side: one value in 200.
#[test]
fn a_volume_scaled_by_any_factor_has_nearly_the_same_picture() {
    let faults = compared(&ROUNDED, |_, here, there| {
        let off = differences(here, there);
        let wrong = off.iter().filter(|d| **d > 4e-3).count();
        let largest = off.iter().copied().fold(0.0, f64::max);
        match wrong * 200 <= off.len() {
            true => Ok(()),
            false => Err(format!("{wrong} of {} values are off by more than 4e-3, by up to {largest:.1e}", off.len())),
        }
    });
    assert!(faults.is_empty(), "{} pictures depend on the unit:\n{}", faults.len(), faults.join("\n"));
}
