//! Group "known answers": scenes whose correct result is a formula, independent of the f64 reference.

use super::built_in::{BYTES, FLOATS, body_frames, frames, scene, wobbler};
use super::compare::{ExtraTolerance, compare_outputs, count_figure, picture_comparison, texel_comparison};
use super::each_pass::{POISON, untouched};
use super::{Check, DeviceUnderTest, Findings, render};
use crate::gpu::{GpuError, Renderer, RendererOptions};
use crate::passes::raycast::still::final_sums;
use crate::passes::shade::SHADOW;
use crate::passes::slots::Format;
use crate::passes::{Arrays, DispatchArgs, MISS, Slot, Texels, is_hit};
use crate::picture::Picture;
use crate::probe::{Axis, Geometry, Grid, Probe};
use crate::report::{Fault, Figure, Level, Unit, Worst};
use crate::scene::Scene;
use glam::DVec3;

/// The checks of the group "known answers", which are the same at every level. The slowest come last.
pub fn checks(_: Level) -> Vec<Check> {
    let of = |name: &str, work: fn(&mut DeviceUnderTest) -> Result<Findings, GpuError>| {
        Check::new("known answers", name, work)
    };
    vec![
        of("every level of a picture", levels),
        of("volume images that take turns", volume_images),
        of("the soft shadow of a hill", shadow_of_a_hill),
        of("contrast that is just a surface", contrast),
        of("the largest sample of a ray", largest),
        of("a plate in front of parallel rays", plate),
        of("a sphere in a sweep", sphere),
        of("a ramp of space through scan conversion", ramp_in_space),
        of("ten thousand thin samples", thin_samples),
        of("light through a constant medium", constant_medium),
        of("paths of a still through a constant medium", paths),
    ]
}

fn made(geometry: Geometry, toml: &str) -> Result<Scene, GpuError> {
    scene(geometry, BYTES, toml).map_err(GpuError::Broken)
}

fn block(spacing: f64, size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { size, spacing: [spacing; 3], origin: [0.0; 3] })
}

fn fault(input: String, what: &str, output: &str, at: [usize; 3], [expected, got]: [f64; 2]) -> Fault {
    let worst = Worst { output: output.into(), at, channel: 0, expected, got, beyond: 1, texels: 1 };
    Fault { pass: None, input, worst: Some(worst), ..Fault::new(what) }
}

/// Adds comparison pictures of one channel to the last fault: the result, and the same with the known values inserted.
fn show(
    findings: &mut Findings,
    what: &str,
    got: &Texels,
    channel: usize,
    known: impl IntoIterator<Item = ([usize; 3], f64)>,
) {
    let got = Texels::from_fn(got.size, 1, |at, _| got.get(at)[channel]);
    let mut expected = got.clone();
    known.into_iter().for_each(|(at, value)| expected.set(at, &[value]));
    findings.show(texel_comparison(what, &expected, &got, 0));
}

/// Opacity over a path of constant medium is 1 - (1 - a)^(voxels), whatever the step (Beer and Lambert).
fn constant_medium(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut largest) = (Findings::default(), 0.0f64);
    for step in [0.07, 0.33, 0.5, 3.0, 40.0] {
        for opacity in [1e-4, 0.02, 0.3, 1.0] {
            let toml = format!(
                "mode = 'vr'\npicture = {{ size = [8, 8] }}\nray = {{ step = {step}, early_end = 0.0 }}\n\
                 [volume]\ntransfer = [{{ at = 0.0, colour = [1.0, 0.5, 0.0], opacity = {opacity} }}]"
            );
            // The volume extends half a voxel beyond the outer centres: 20 voxels of 0.5 mm are 10 mm.
            let scene = made(block(0.5, [20, 20, 20]), &toml)?;
            let picture = render::slot(&dut.context, &scene, &frames(&scene, |_| 0.6), Slot::Picture)?;
            let expected = 1.0 - (1.0f64 - opacity).powi(20);
            // The picture is R16F: 11 bits.
            for (channel, share) in [(3, 1.0), (0, 1.0), (1, 0.5), (2, 0.0)] {
                let got = picture.get([4, 4, 0])[channel];
                let error = (got - share * expected).abs() / (expected / 1500.0 + 1e-7);
                largest = largest.max(error);
                if error.is_nan() || error > 1.0 {
                    let input = format!("opacity {opacity} a voxel, steps of {step} mm");
                    let both = [share * expected, got];
                    findings.faults.push(fault(input, "not as opaque as its path", "picture", [4, 4, 0], both));
                    show(&mut findings, "picture", &picture, channel, [([4, 4, 0], share * expected)]);
                }
            }
        }
    }
    findings.figures.push(Figure::error("share of the tolerance", largest, 1.0, Unit::Share));
    Ok(findings)
}

/// Of the paths of a still as many collide in a constant medium as Beer and Lambert's law says, within the confidence interval of 99.9 %; and where
/// nothing is absorbed and light comes from everywhere, each brings exactly that light.
fn paths(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut largest) = (Findings::default(), 0.0f64);
    for extinction in [0.01f64, 0.1, 0.5] {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [8, 8] }}\nstill = {{ samples = 64, batch = 16, events = 1024 }}\n\
             light = {{ diffuse = 0.0, ambient = 1.0 }}\n[volume]\nextinction = {extinction}\n\
             transfer = [{{ at = 0.0, colour = [1.0, 1.0, 1.0], opacity = 1.0 }}]"
        );
        let scene = made(block(0.5, [20, 20, 20]), &toml)?;
        let sums = render::slot(&dut.context, &scene, &frames(&scene, |_| 0.6), final_sums(&scene)[0])?;
        let expected = 1.0 - (-10.0 * extinction).exp();
        let inside: Vec<[usize; 3]> = (2..6).flat_map(|y| (2..6).map(move |x| [x, y, 0])).collect();
        let count = 64.0 * inside.len() as f64;
        let got = inside.iter().map(|at| sums.get(*at)[3]).sum::<f64>() / count;
        let error = (got - expected).abs() / (3.29 * (expected * (1.0 - expected) / count).sqrt());
        let input = format!("extinction of {extinction} a mm");
        if error.is_nan() || error > 1.0 {
            let what = "another share of the paths collides";
            findings.faults.push(fault(input.clone(), what, "sums", [4, 4, 0], [expected, got]));
        }
        let uneven = inside.iter().map(|at| (sums.get(*at)[1] - sums.get(*at)[3]).abs()).fold(0.0, f64::max);
        findings.expect(uneven <= 1e-3, || format!("{input}: light is lost in a white furnace: {uneven} of 64 paths"));
        largest = largest.max(error);
    }
    findings.figures.push(Figure::error("share of the confidence interval", largest, 1.0, Unit::Share));
    Ok(findings)
}

fn thin_samples(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut largest) = (Findings::default(), 0.0f64);
    for (opacity, step, tolerance) in
        [(1e-4f64, 0.002, 1e-3), (1e-7, 0.002, 2e-3), (1.0, 1e-3, 0.0), (0.999, 30.0, 1e-3)]
    {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [2, 2] }}\nray = {{ step = {step}, early_end = 0.0 }}\n\
             [volume]\ntransfer = [{{ at = 0.0, colour = [1.0, 1.0, 1.0], opacity = {opacity} }}]"
        );
        let scene = made(block(0.5, [4, 40, 4]), &toml)?;
        let picture = render::slot(&dut.context, &scene, &frames(&scene, |_| 1.0), Slot::Picture)?;
        let got = picture.get([1, 1, 0])[3];
        let expected = -(40.0 * (-opacity).ln_1p()).exp_m1();
        // 4e-6 is below the normal numbers of R16F; denormals have a spacing of 6e-8.
        let error = (got - expected).abs() / (tolerance * expected + 6e-8);
        largest = largest.max(error);
        if error.is_nan() || error > 1.0 {
            let input = format!("opacity {opacity} a voxel, steps of {step} mm");
            findings.faults.push(fault(input, "digits are lost on the way", "picture", [1, 1, 0], [expected, got]));
            show(&mut findings, "picture", &picture, 3, [([1, 1, 0], expected)]);
        }
    }
    findings.figures.push(Figure::error("share of the tolerance", largest, 1.0, Unit::Share));
    Ok(findings)
}

/// Compares distances with those by a formula, which returns None for rays that cannot be judged. `allowed` in mm.
fn distances(findings: &mut Findings, got: &Texels, formula: impl Fn(usize, usize) -> Option<f64>, allowed: f64) {
    let (mut rays, mut holes, mut beyond, mut worst) = (0, 0, 0, (0.0f64, [0; 3], [0.0; 2]));
    let mut known = Vec::new();
    for (x, y) in (0..got.size[1]).flat_map(|y| (0..got.size[0]).map(move |x| (x, y))) {
        let Some(expected) = formula(x, y) else { continue };
        let distance = got.one(x, y, 0);
        known.push(([x, y, 0], expected));
        rays += 1;
        holes += usize::from(!is_hit(distance));
        let error = (distance - expected).abs();
        beyond += usize::from(error.is_nan() || error > allowed);
        if is_hit(distance) && error > worst.0 {
            worst = (error, [x, y, 0], [expected, distance]);
        }
    }
    findings.expect(rays > 100, || format!("only {rays} rays can be judged"));
    findings.expect(holes == 0, || format!("{holes} of {rays} rays miss a surface that is there"));
    if worst.0 > allowed {
        let mut fault = fault(String::new(), "the surface is somewhere else", "distance_map", worst.1, worst.2);
        fault.worst.iter_mut().for_each(|w| (w.beyond, w.texels) = (beyond, rays));
        findings.faults.push(fault);
    }
    if !findings.faults.is_empty() {
        show(findings, "distance_map", got, 0, known);
    }
    findings.figures.push(Figure::error("largest error", worst.0, allowed, Unit::Millimetres));
}

/// A probe with a fine spacing of lines, frames and samples.
fn fine() -> Probe {
    Probe {
        lines: Axis::centred(1.1 / 127.0, 128),
        slices: Axis::centred(0.8 / 60.0, 61),
        sample_pitch: 0.2,
        samples: 256,
        ..wobbler()
    }
}

/// A sphere through scan conversion, sweep map and detector.
fn sphere(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, centre, radius) = (Findings::default(), DVec3::new(1.5, 50.0, -2.0), 9.0);
    let toml =
        "mode = 'sr'\npicture = { size = [64, 64] }\nray = { step = 0.2 }\nsurface = { threshold = 0.2, edge = 0.8 }
                camera = { zoom = 3.0, target = [1.5, 30.0, -2.0], elevation = 10, field_of_view = 20 }";
    let scene = scene(Geometry::Sweep(fine()), FLOATS, toml).map_err(GpuError::Broken)?;
    let frames = body_frames(&scene, |p| ((radius - p.distance(centre)) / 0.6 + 0.5).clamp(0.0, 1.0));
    let got = render::slot(&dut.context, &scene, &frames, Slot::Distance)?;
    let formula = |x: usize, y: usize| {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let along = (centre - origin).dot(direction);
        let offset = (origin + direction * along).distance(centre);
        // Further out the chord is shorter than the window of the detector.
        (offset < 0.8 * radius).then(|| along - (radius * radius - offset * offset).sqrt())
    };
    // Half a step: the spacing of frames, 0.013 rad at 45 mm, is 0.6 mm across a curved edge.
    distances(&mut findings, &got, formula, 0.1);
    Ok(findings)
}

/// A surface is detected at the middle of an edge, where it is half as bright.
fn plate(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let toml =
        "mode = 'sr'\npicture = { size = [24, 24] }\nray = { step = 0.1 }\nsurface = { threshold = 0.2, rough = 1, edge = 0.4 }
                camera = { field_of_view = 0 }";
    let scene = made(block(0.25, [60, 120, 60]), toml)?;
    // Along the depth, which the rays follow: 0.25 mm a voxel.
    let edge = 16.3;
    let frames = body_frames(&scene, |p| ((p.y - edge) / 0.75 + 0.5).clamp(0.0, 1.0));
    let got = render::slot(&dut.context, &scene, &frames, Slot::Distance)?;
    let formula = |x: usize, y: usize| {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let at = (edge - origin.y) / direction.y;
        let p = origin + direction * at;
        let inside = |axis: usize| p[axis] > scene.low[axis] + 1.0 && p[axis] < scene.high[axis] - 1.0;
        (direction.y > 0.5 && inside(0) && inside(2)).then_some(at)
    };
    distances(&mut findings, &got, formula, 0.08);
    Ok(findings)
}

/// Every level of a volume of 8 bits is the same level in the picture.
fn levels(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut wrong) = (Findings::default(), 0);
    for floats in [false, true] {
        let toml = format!(
            "mode = 'plane'\npicture = {{ size = [16, 16] }}\nplanes = {{ plane = 'a', lines = false, position = [4, 4, 0.5] }}\n\
             post = {{ floats = {floats} }}\nray = {{ sampling = 'exact' }}"
        );
        let scene = made(block(0.5, [16, 16, 3]), &toml)?;
        let frames = frames(&scene, |[x, y, _]| (16 * y + x) as f64 / 255.0);
        let picture = render::picture(&dut.context, &scene, &frames)?;
        for (i, texel) in picture.rgba.chunks_exact(4).enumerate() {
            let apart = texel[..3].iter().map(|v| v.abs_diff(i as u8)).max().unwrap_or(0);
            if apart > 0 && {
                wrong += 1;
                wrong <= 4
            } {
                let at = [i % 16, i / 16, 0];
                let input = if floats { "a picture of floats, then of 8 bits" } else { "a picture straight of 8 bits" };
                let both = [i as f64, f64::from(texel[0])];
                let expected = Picture { rgba: (0..=255).flat_map(|v| [v, v, v, 255]).collect(), ..picture.clone() };
                let fault = fault(input.into(), "another level", "screen", at, both);
                findings.add_shown(fault, picture_comparison(input, &expected, &picture));
            }
        }
    }
    findings.figures.push(Figure::error("levels that are others", f64::from(wrong), 0.0, Unit::Count));
    Ok(findings)
}

/// MIP of dark tissue with one bright voxel per column is the value of that voxel, at any position along the ray.
fn largest(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut off) = (Findings::default(), 0.0f64);
    for depth in [0, 1, 7, 22, 23] {
        let toml = "mode = 'mip'\npicture = { size = [12, 12] }\nray = { step = 0.5, sampling = 'exact' }\ncamera = { field_of_view = 0 }\npost = { floats = true }";
        let scene = made(block(0.5, [12, 24, 12]), toml)?;
        let frames = frames(&scene, |[_, y, _]| if y == depth { 0.8 } else { 0.2 });
        let picture = render::slot(&dut.context, &scene, &frames, Slot::Picture)?;
        let got = picture.get([6, 6, 0])[0];
        // With steps as long as voxels, a sample is at most half a voxel from the centre of the bright one.
        let (low, high) = (0.5 - 0.002, 0.8 + 0.002);
        off = off.max(if (low..=high).contains(&got) { 0.0 } else { 1.0 });
        if !(low..=high).contains(&got) {
            let input = format!("a bright layer {depth} voxels deep");
            findings.faults.push(fault(input, "the brightest sample is not seen", "picture", [6, 6, 0], [0.8, got]));
            show(&mut findings, "picture", &picture, 0, [([6, 6, 0], 0.8)]);
        }
    }
    findings.figures.push(Figure::error("layers that are not seen", off, 0.0, Unit::Count));
    let miss = MISS;
    findings.expect(miss > 3e38, || "a miss is the largest float".into());
    Ok(findings)
}

/// With several volume images, the selected one is shown.
fn volume_images(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let toml = "mode = 'plane'\npicture = { size = [16, 16] }\nplanes = { plane = 'a', lines = false, position = [4, 4, 0.5] }\n\
                ray = { sampling = 'exact' }";
    let scene = made(block(0.5, [16, 16, 3]), toml)?;
    let levels = [40u8, 90, 200];
    let options = RendererOptions { volume_images: levels.len() as u32, ..RendererOptions::default() };
    let mut renderer = Renderer::new(&dut.context, scene.clone(), &options)?;
    for (image, level) in levels.iter().enumerate() {
        render::send(&mut renderer, &frames(&scene, |_| f64::from(*level) / 255.0), image as u32)?;
    }
    for image in [1usize, 0, 2] {
        renderer.show(image as u32)?;
        let picture = renderer.picture()?;
        let (got, expected) = (picture.rgba[0], levels[image]);
        if got != expected {
            let (input, both) = (format!("image {image}"), [f64::from(expected), f64::from(got)]);
            let flat = [expected, expected, expected, 255].repeat(picture.rgba.len() / 4);
            let pictures = picture_comparison(&input, &Picture { rgba: flat, ..picture.clone() }, &picture);
            findings.add_shown(fault(input, "another volume is shown", "screen", [0; 3], both), pictures);
        }
    }
    Ok(findings)
}

/// Voxel spacing, mm.
const VOXEL: f64 = 0.25;
/// Sample spacing, mm: more than a voxel, so that an edge of one voxel fits between two samples.
const STEP: f64 = 0.3;

/// The detector compares the difference of two means; for a step from 0 it is the height of the step. A step 1 % above the threshold is a
/// surface, a step 1 % below is none. The surface is midway between the samples around the step.
fn contrast(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut wrong, mut max_error) = (Findings::default(), 0, 0.0f64);
    for (place, threshold) in [("peak", 0.2), ("first-crossing", 0.2), ("peak", 0.6)] {
        for (height, is_surface) in [(1.01, true), (0.99, false)] {
            let toml = format!(
                "mode = 'sr'\npicture = {{ size = [9, 9] }}\nslices.format = 'r32f'\nray = {{ step = {STEP}, sampling = 'exact' }}\n\
                 surface = {{ threshold = {threshold}, place = '{place}', rough = 1, edge = {} }}\ncamera = {{ field_of_view = 0 }}",
                4.0 * STEP
            );
            let scene = scene(block(VOXEL, [40, 80, 40]), FLOATS, &toml).map_err(GpuError::Broken)?;
            // Samples before the last dark voxel. There must be no sample between it and the first bright one.
            let before = |voxel: usize| (voxel as f64 * VOXEL - scene.low.y) / STEP - 0.5;
            let fits = |voxel: &usize| before(*voxel).floor() == before(voxel + 1).floor();
            // Several walls: how much of the way to one is skipped follows from where it is.
            for dark in (40..70).filter(fits).take(4) {
                let frames = frames(&scene, |[_, y, _]| if y > dark { height * threshold } else { 0.0 });
                let map = render::slot(&dut.context, &scene, &frames, Slot::Distance)?;
                let got = map.one(4, 4, 0);
                let input = || format!("{height} times a threshold of {threshold}, {place}");
                let faults = findings.faults.len();
                let (origin, direction) = scene.rays.at(4.5, 4.5);
                let expected = (scene.low.y + STEP * (before(dark).floor() + 1.0) - origin.y) / direction.y;
                if is_hit(got) != is_surface {
                    wrong += 1;
                    let what = if is_surface { "a surface is overlooked" } else { "something is taken for a surface" };
                    findings.faults.push(fault(input(), what, "distance_map", [4, 4, 0], [height * threshold, got]));
                } else if is_surface && place == "peak" {
                    max_error = max_error.max((got - expected).abs());
                    if (got - expected).abs() > 5e-4 {
                        let what = "the surface is somewhere else";
                        findings.faults.push(fault(input(), what, "distance_map", [4, 4, 0], [expected, got]));
                    }
                }
                if findings.faults.len() > faults {
                    show(
                        &mut findings,
                        "distance_map",
                        &map,
                        0,
                        [([4, 4, 0], if is_surface { expected } else { MISS })],
                    );
                }
            }
        }
    }
    findings.figures.push(Figure::error("edges that are misjudged", f64::from(wrong), 0.0, Unit::Count));
    findings.figures.push(Figure::error("largest error", max_error, 5e-4, Unit::Millimetres));
    Ok(findings)
}

/// A plane through the sweep, and its tolerance.
struct RampView {
    plane: &'static str,
    /// Rotation of the plane, deg.
    azimuth: f64,
    position: [f64; 3],
    zoom: f64,
    /// Length of the ramp from black to white, mm.
    shown: f64,
    /// Maximum error, mm.
    allowed: f64,
}

/// A wide view is limited by the 11 bits of its picture for 80 mm. A near view shows positions between samples, lines and frames, where
/// straight lines approximate arcs: the error is 1.3 um for 0.013 rad at 60 mm, and texture sampling adds as much.
const VIEWS: [RampView; 4] = {
    let wide =
        RampView { plane: "a", azimuth: 0.0, position: [0.7, 40.3, -0.4], zoom: 3.0, shown: 80.0, allowed: 0.05 };
    [
        RampView { ..wide },
        RampView { plane: "b", ..wide },
        RampView { azimuth: 20.0, ..wide },
        RampView { plane: "b", azimuth: 20.0, position: [3.7, 47.3, 9.4], zoom: 12.0, shown: 4.0, allowed: 0.003 },
    ]
};

/// A ramp along an axis of space, through the conversion of a sweep, has the same values in a plane as in space: nothing is mirrored,
/// swapped or shifted by half a texel.
fn ramp_in_space(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut wide, mut near) = (Findings::default(), 0.0f64, 0.0f64);
    for axis in 0..3 {
        for view in &VIEWS {
            let error = ramp_along(dut, axis, view, &mut findings)?;
            let largest = if view.shown > 10.0 { &mut wide } else { &mut near };
            *largest = if error.is_nan() { error } else { largest.max(error) };
        }
    }
    findings.figures.push(Figure::error("largest error beyond rounding", wide, VIEWS[0].allowed, Unit::Millimetres));
    findings.figures.push(Figure::error("the same from near", near, VIEWS[3].allowed, Unit::Millimetres));
    Ok(findings)
}

/// The largest error of one ramp in one view, mm.
fn ramp_along(
    dut: &mut DeviceUnderTest,
    axis: usize,
    view: &RampView,
    findings: &mut Findings,
) -> Result<f64, GpuError> {
    let name = ["lateral", "depth", "elevation"][axis];
    let RampView { plane, azimuth, position, zoom, shown, allowed } = *view;
    // 0..1 over 80 mm, so that nothing is clipped; the window shows a part of it.
    let low = if axis == 1 { 0.0 } else { -40.0 };
    let level = |p: DVec3| (p[axis] - low) / 80.0;
    let of = |window: [f64; 2]| {
        let toml = format!(
            "mode = 'plane'\npicture = {{ size = [48, 40] }}\nslices = {{ pixels = 160, format = 'r32f' }}\npost = {{ floats = true }}\n\
             planes = {{ plane = '{plane}', azimuth = {azimuth}, position = {position:?}, zoom = {zoom}, lines = false, window = {window:?} }}\n\
             ray = {{ sampling = 'exact' }}"
        );
        scene(Geometry::Sweep(fine()), FLOATS, &toml).map_err(GpuError::Broken)
    };
    let full = of([0.0, 1.0])?;
    // The value in the middle of the picture.
    let middle = full.tiling().tiles.first().map_or(0.5, |tile| level(tile.plane.at));
    let window = if shown < 80.0 { [-0.5, 0.5].map(|side| middle + side * shown / 80.0) } else { [0.0, 1.0] };
    let scene = of(window)?;
    let got = render::slot(&dut.context, &scene, &body_frames(&scene, level), Slot::Picture)?;
    let (tiling, mut largest, mut judged) = (scene.tiling(), 0.0f64, 0);
    let ([tile], Some(sweep)) = (&tiling.tiles[..], scene.probe()) else { return Ok(f64::NAN) };
    let (faults, mut known) = (findings.faults.len(), Vec::new());
    let from_middle = |at: usize, axis: usize| (at as f64 + 0.5 - f64::from(tile.size[axis]) / 2.0) * tiling.pixel;
    for (x, y) in (0..got.size[1]).flat_map(|y| (0..got.size[0]).map(move |x| (x, y))) {
        let p = tile.plane.at + tile.plane.right * from_middle(x, 0) + tile.plane.down * from_middle(y, 1);
        // Only away from the border, where black is mixed in.
        let (at, within) = (sweep.to_indices(p), |v: f64, n: usize| v > 1.0 && v < n as f64 - 2.0);
        let expected = (level(p) - window[0]) / (window[1] - window[0]);
        let is_seen = within(at.sample, sweep.samples)
            && within(at.line, sweep.lines.len())
            && within(at.slice, sweep.slices.len())
            && (0.01..0.99).contains(&expected);
        if !is_seen {
            continue;
        }
        judged += 1;
        known.push(([x, y, 0], expected));
        let value = got.get([x, y, 0])[0];
        // A driver may round to either neighbour.
        let rounding = Texels::spacing(Format::Rgba16f, expected);
        let error = ((value - expected).abs() - rounding).max(0.0) * shown;
        largest = if error.is_nan() || largest.is_nan() { f64::NAN } else { largest.max(error) };
        if (error.is_nan() || error > allowed) && findings.faults.len() < 4 {
            let input =
                format!("a ramp along {name}, plane {plane} turned by {azimuth} deg, {shown} mm from black to white");
            let at = [x, y, 0];
            findings.faults.push(fault(
                input,
                "a value of the ramp is at the wrong position",
                "picture",
                at,
                [expected, value],
            ));
        }
    }
    if findings.faults.len() > faults {
        show(findings, &format!("a ramp along {name}, plane {plane}"), &got, 0, known);
    }
    findings.expect(judged > 200, || format!("only {judged} texels of a ramp along {name} can be judged"));
    Ok(largest)
}

/// A hill under a low light, whose shadow is mostly edge, unlike that of noise. Compared with the reference: texels may be beyond tolerance
/// only where a ray to the light grazes the hill.
fn shadow_of_a_hill(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let toml = "mode = 'sr'\npicture = { size = [64, 48] }\nslices = { pixels = 12 }\ncamera = { field_of_view = 0 }\n\
                light = { direction = [1.0, 0.3, 0.5], shadow = { softness = 0.8 } }";
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml).map_err(GpuError::Broken)?;
    let hill = |x: usize, y: usize| ((x as f64 - 40.0).powi(2) + (y as f64 - 24.0).powi(2)) / 40.0;
    let distances =
        Texels::from_fn([64, 48, 1], 1, |[x, y, _], _| f64::from((60.0 - 12.0 * (-hill(x, y)).exp()) as f32));
    let (args, mut inputs) = (DispatchArgs::default(), Arrays::default());
    for bind in SHADOW.reads(&scene, &args) {
        inputs.insert(bind.name, distances.clone());
    }
    let (mut expected, writes) = (untouched(&scene, &SHADOW, &args), SHADOW.writes(&scene, &args));
    SHADOW.expected(&scene, &args, &inputs, &mut expected);
    let got = dut.pass_runner().run(&scene, &SHADOW, &args, &inputs, POISON)?;
    let compared = compare_outputs(&SHADOW, &scene, ExtraTolerance::default(), POISON, &expected, &got, &writes);
    let edge = expected.get("shadow").values.iter().filter(|v| (0.02..0.98).contains(*v)).count();
    findings.expect(edge > 150, || format!("only {edge} texels are an edge of the shadow"));
    if let Some(worst) = compared.worst {
        let fault = Fault { worst: Some(worst), ..Fault::new("the edge of a shadow is another") };
        findings.add_shown(fault, texel_comparison("shadow", expected.get("shadow"), got.get("shadow"), 0));
    }
    let allowed = SHADOW.tolerance.outliers;
    findings.figures.push(Figure::error("texels beyond tolerance", compared.outliers, allowed, Unit::Share));
    findings.figures.push(count_figure("texels of edge", edge));
    Ok(findings)
}
