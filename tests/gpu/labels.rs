//! Labels over pictures against bodies whose places are formulas: the outline on a plane is the circle of a ball of labels, the shell in a rendering is
//! the ball.

use crate::common::gpu::*;
use echolume::low_level::passes::Slot;
use echolume::low_level::picture::Picture;
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::{LabelVolume, Scene};
use glam::{DAffine3, DQuat, DVec3};

const RADIUS: f64 = 9.0;
const COLOUR: [f64; 3] = [1.0, 0.5, 0.0];
const OTHER: [f64; 3] = [0.0, 0.5, 1.0];
const MIDDLE: DVec3 = DVec3::new(1.5, 14.0, -2.0);
/// Echo of all tissue.
const ECHO: f64 = 0.4;

/// A scene of a block of even tissue, with a ball of labels of a lattice that lies obliquely in it: label 1, and 2 in one half if it has two.
fn labelled(toml: &str, has_two: bool) -> Scene {
    let grid = Grid { size: [64, 60, 56], spacing: [0.5; 3], origin: [-16.0, 0.0, -14.0] };
    let toml = format!("picture.size = [120, 120]\n{toml}");
    let mut scene = scene(Geometry::Cartesian(grid), BYTES, &toml);
    let (size, spacing, first) = ([70, 72, 68], 0.3, DVec3::new(-10.5, -10.8, -10.2));
    let to_space = DAffine3::from_translation(MIDDLE)
        * DAffine3::from_quat(DQuat::from_rotation_x(0.5) * DQuat::from_rotation_y(0.8))
        * DAffine3::from_translation(first)
        * DAffine3::from_scale(DVec3::splat(spacing));
    let at = |n: usize| DVec3::from([n % 70, n / 70 % 72, n / (70 * 72)].map(|n| n as f64));
    let label = |place: DVec3| match place.distance(MIDDLE) < RADIUS {
        true if has_two && place.x > MIDDLE.x => 2,
        inside => u8::from(inside),
    };
    let voxels: Vec<u8> = (0..70 * 72 * 68).map(|n| label(to_space.transform_point3(at(n)))).collect();
    let colour = |label: u8| Some(if label == 1 { COLOUR } else { OTHER });
    scene.settings.labels.volume = Some(LabelVolume::new(size, &voxels, to_space, colour).expect("labels").into());
    scene
}

fn drawn(device: &Device, scene: &Scene) -> Picture {
    let frames = body_frames(scene, |_| ECHO);
    rendered(device, scene.clone(), &frames).picture().expect("picture")
}

fn pixel(picture: &Picture, x: usize, y: usize) -> [f64; 3] {
    std::array::from_fn(|c| f64::from(picture.rgba[4 * (y * picture.width as usize + x) + c]) / 255.0)
}

/// How far a colour is from a mixture.
fn off(got: [f64; 3], below: [f64; 3], over: [f64; 3], opacity: f64) -> f64 {
    (0..3).map(|c| (got[c] - below[c] - (over[c] - below[c]) * opacity).abs()).fold(0.0, f64::max)
}

#[test]
fn the_outline_on_a_plane_is_the_circle_of_the_ball() {
    let device = Device::new();
    for (planes, apart) in [("position = [0, 14, -2]", 0.0), ("position = [0, 14, 3.4], zoom = 1.7", 5.4)] {
        let scene = labelled(&format!("mode = 'plane'\nplanes = {{ {planes} }}"), false);
        let (mut plain, tiling) = (scene.clone(), scene.tiling());
        plain.settings.labels.volume = None;
        let (picture, below) = (drawn(&device, &scene), drawn(&device, &plain));
        let radius = (RADIUS * RADIUS - apart * apart).sqrt();
        let tile = &tiling.tiles[0];
        let (mut counts, mut least, mut sum) = ([0; 3], 1.0_f64, 0.0);
        for (x, y) in (0..120).flat_map(|y| (0..120).map(move |x| (x, y))) {
            let place = tiling.place(tile, x, y);
            let from = (place - MIDDLE).with_z(0.0).length();
            // Pixels outwards from the circle. The voxels' steps move it by a third of a voxel, smoothing by a tenth.
            let (outwards, slack) = ((from - radius) / tile.pixel, 0.4 * 0.3 / tile.pixel);
            let (got, below) = (pixel(&picture, x, y), pixel(&below, x, y));
            let (kind, opacity) = match outwards {
                d if d.abs() < 0.15 => (0, 1.0),
                d if d < -2.25 - slack => (1, 0.25),
                d if d > 2.25 + slack => (2, 0.0),
                _ => continue,
            };
            counts[kind] += 1;
            if kind == 0 {
                let shown = (got[2] - below[2]) / (COLOUR[2] - below[2]);
                (least, sum) = (least.min(shown), sum + shown);
                continue;
            }
            let off = off(got, below, COLOUR, opacity);
            assert!(off < 0.01, "{planes}: pixel {x}, {y}, {outwards:.2} pixels outwards: {got:?}, off by {off}");
        }
        let mean = sum / f64::from(counts[0]);
        assert!(least > 0.4 && mean > 0.93, "{planes}: opacity of the line {least}, {mean} in the mean");
        assert!(counts[0] > 4 && counts[1] > 200 && counts[2] > 200, "{planes}: {counts:?}");
    }
}

#[test]
fn two_labels_that_touch_have_a_boundary_in_both_colours() {
    let device = Device::new();
    let scene = labelled("mode = 'plane'\nplanes = { position = [0, 14, -2] }\nlabels = { fill = 0 }", true);
    let (picture, tiling) = (drawn(&device, &scene), scene.tiling());
    let tile = &tiling.tiles[0];
    for x in 0..120 {
        let place = tiling.place(tile, x, 60);
        let across = (place.x - MIDDLE.x) / tile.pixel;
        if (place - MIDDLE).with_z(0.0).length() > RADIUS - 4.0 * tile.pixel {
            continue;
        }
        let grey = [pixel(&picture, x, 60)[2]; 3];
        let (over, opacity) = match across {
            a if a.abs() > 2.25 + 0.6 => (grey, 0.0),
            a if a.abs() < 0.75 - 0.6 => continue,
            a if (0.0..0.6).contains(&a) => (OTHER, 1.0),
            a if (-0.6..0.0).contains(&a) => (COLOUR, 1.0),
            _ => continue,
        };
        let off = off(pixel(&picture, x, 60), grey, over, opacity);
        assert!(off < 0.25, "{across:.2} pixels from the boundary: {:?}", pixel(&picture, x, 60));
    }
    let of = |colour: [f64; 3]| (0..120).filter(|x| off(pixel(&picture, *x, 60), [0.0; 3], colour, 1.0) < 0.25).count();
    assert!(of(COLOUR) >= 1 && of(OTHER) >= 1, "{} and {} pixels of either", of(COLOUR), of(OTHER));
}

#[test]
fn the_shell_is_the_ball_lit_from_the_eye() {
    let device = Device::new();
    for camera in ["azimuth = 30, elevation = -20", "azimuth = -50, field_of_view = 40, zoom = 1.2"] {
        for rays in ["", "ray.subsampling = 2\n", "ray.rays = 2\n"] {
            let scene = labelled(&format!("mode = 'mip'\n{rays}camera = {{ {camera} }}"), false);
            let mut plain = scene.clone();
            plain.settings.labels.volume = None;
            let (picture, below) = (drawn(&device, &scene), drawn(&device, &plain));
            let per_pixel = f64::from(scene.settings.ray.rays) / f64::from(scene.settings.ray.subsampling);
            let (mut sum, mut lit) = (0.0, 0);
            for (x, y) in (0..120).flat_map(|y| (0..120).map(move |x| (x, y))) {
                let (from, along) = scene.rays.at((x as f64 + 0.5) * per_pixel, (y as f64 + 0.5) * per_pixel);
                let nearest = (MIDDLE - from).dot(along);
                let off_axis = (from + along * nearest).distance(MIDDLE);
                let (got, below) = (pixel(&picture, x, y), pixel(&below, x, y));
                if off_axis > RADIUS + 0.3 {
                    assert!(off(got, below, COLOUR, 0.0) < 0.003, "{camera}: {x}, {y} beside the ball: {got:?}");
                } else if off_axis < RADIUS - 0.5 {
                    let light = 0.35 + 0.65 * (1.0 - (off_axis / RADIUS).powi(2)).sqrt();
                    let off = off(got, below, COLOUR.map(|c| c * light), 0.5);
                    // Where the ball is parallel to faces of the lattice its normal follows the steps of voxels.
                    assert!(off < 0.06, "{camera}: {x}, {y}, {off_axis:.2} mm from the axis: {got:?}, off by {off}");
                    (sum, lit) = (sum + off, lit + 1);
                }
            }
            assert!(
                lit > 400 && sum / f64::from(lit) < 0.01,
                "{camera}: {lit} pixels, off by {}",
                sum / f64::from(lit)
            );
        }
    }
}

#[test]
fn a_surface_in_front_dims_the_shell_and_one_behind_does_not() {
    let device = Device::new();
    // Seen from the front: towards greater elevation or lesser, whichever it is, a wall is nearer to the eye than the ball or further.
    let look = "mode = 'sr'\nsurface = { threshold = 0.2 }\ncamera = {}\npost.antialias = false\n";
    let scene = labelled(&format!("{look}labels = {{ shell = 0.8, behind = 0.25 }}"), false);
    let mut plain = scene.clone();
    plain.settings.labels.volume = None;
    let forward = scene.rays.at(60.0, 60.0).1;
    for (side, opacity) in [(-1.0, 0.2), (1.0, 0.8)] {
        let wall = |p: DVec3| match (p - MIDDLE).dot(forward) * side - RADIUS {
            0.8..2.3 => 0.9,
            _ => 0.02,
        };
        let pictures = [&scene, &plain].map(|scene| {
            let frames = body_frames(scene, wall);
            rendered(&device, scene.clone(), &frames).picture().expect("picture")
        });
        let mut seen = 0;
        for (x, y) in (0..120).flat_map(|y| (0..120).map(move |x| (x, y))) {
            let (from, along) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let off_axis = (from + along * (MIDDLE - from).dot(along)).distance(MIDDLE);
            if off_axis > 0.6 * RADIUS {
                continue;
            }
            let light = 0.35 + 0.65 * (1.0 - (off_axis / RADIUS).powi(2)).sqrt();
            let [got, below] = [0, 1].map(|n| pixel(&pictures[n], x, y));
            let off = off(got, below, COLOUR.map(|c| c * light), opacity);
            assert!(below[0] > 0.05 && off < 0.06, "side {side}: {x}, {y}: {got:?} over {below:?}, off by {off}");
            seen += 1;
        }
        assert!(seen > 100, "{seen}");
    }
}

#[test]
fn without_labels_nothing_of_them_is_in_the_plan() {
    let device = Device::new();
    for mode in ["mode = 'sr'\nlayout = 'four'", "mode = 'orthogonal'", "mode = 'vr'"] {
        let scene = labelled(mode, false);
        let mut none = scene.clone();
        none.settings.labels.volume = None;
        let mut hidden = scene.clone();
        (hidden.settings.labels.fill, hidden.settings.labels.outline, hidden.settings.labels.shell) = (0.0, false, 0.0);
        let has =
            |scene: &Scene| Plan::new(scene).slots.iter().any(|slot| [Slot::Labels, Slot::Unlabelled].contains(slot));
        assert_eq!([&scene, &none, &hidden].map(has), [true, false, false], "{mode}");
        assert_eq!(drawn(&device, &none).rgba, drawn(&device, &hidden).rgba, "{mode}");
        // Labels that come and go in one renderer, and change their look.
        let frames = body_frames(&none, |_| ECHO);
        let mut renderer = rendered(&device, none.clone(), &frames);
        let mut faint = scene.clone();
        faint.settings.labels.shell = 0.1;
        for step in [&scene, &faint, &none, &scene] {
            renderer.change(step.clone()).expect("changed");
            assert!(renderer.picture().expect("picture").rgba == drawn(&device, step).rgba, "{mode}");
        }
    }
}
