//! Scenes whose answer is a formula: no reference of ours is asked.

mod edges;
mod ramps;
mod shadows;

use super::built_in::{BYTES, FLOATS, body_frames, frames, scene, wobbler};
use super::{Bench, Check, Found, drawn, shown};
use crate::gpu::{GpuError, Renderer, RendererOptions};
use crate::passes::{MISS, Slot, Texels, is_hit};
use crate::picture::Picture;
use crate::probe::{Axis, Geometry, Grid, Probe};
use crate::scene::Scene;
use crate::verify::report::{Fault, Figure, Level, Shown, Unit, Worst};
use glam::DVec3;

/// Of this version: the same at every level. What takes longest comes last.
pub fn checks(_: Level) -> Vec<Check> {
    let of = |name: &str, work: fn(&mut Bench) -> Result<Found, GpuError>| Check::new("known answers", name, work);
    vec![
        of("every level of a picture", levels),
        of("volume images that take turns", turns),
        of("the soft shadow of a hill", shadows::of_a_hill),
        of("contrast that is just a surface", edges::contrast),
        of("the largest sample of a ray", largest),
        of("a plate in front of parallel rays", plate),
        of("a sphere in a sweep", sphere),
        of("a ramp of space through scan conversion", ramps::in_space),
        of("ten thousand thin samples", thin_samples),
        of("light through a constant medium", constant_medium),
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

/// One channel of what was got, beside the same with what is known in its places: pictures of the last fault.
fn show(
    found: &mut Found,
    what: &str,
    got: &Texels,
    channel: usize,
    known: impl IntoIterator<Item = ([usize; 3], f64)>,
) {
    let got = Texels::from_fn(got.size, 1, |at, _| got.get(at)[channel]);
    let mut expected = got.clone();
    known.into_iter().for_each(|(at, value)| expected.set(at, &[value]));
    let fault = found.faults.len().checked_sub(1);
    found.pictures.push(Shown { fault, ..shown::shown(what, &expected, &got, 0) });
}

/// Opacity over a path of constant medium is 1 - (1 - a)^(voxels), whatever the step (Beer and Lambert).
fn constant_medium(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut largest) = (Found::default(), 0.0f64);
    for step in [0.07, 0.33, 0.5, 3.0, 40.0] {
        for opacity in [1e-4, 0.02, 0.3, 1.0] {
            let toml = format!(
                "mode = 'vr'\npicture = {{ size = [8, 8] }}\nray = {{ step = {step}, early_end = 0.0 }}\n\
                 [volume]\ntransfer = [{{ at = 0.0, colour = [1.0, 0.5, 0.0], opacity = {opacity} }}]"
            );
            // Half a voxel beyond the outer centres is part of the volume: 20 voxels of 0.5 mm are 10 mm.
            let scene = made(block(0.5, [20, 20, 20]), &toml)?;
            let picture = drawn::slot(&bench.context, &scene, &frames(&scene, |_| 0.6), Slot::Picture)?;
            let expected = 1.0 - (1.0f64 - opacity).powi(20);
            // The picture is R16F: 11 bits.
            for (channel, share) in [(3, 1.0), (0, 1.0), (1, 0.5), (2, 0.0)] {
                let got = picture.get([4, 4, 0])[channel];
                let error = (got - share * expected).abs() / (expected / 1500.0 + 1e-7);
                largest = largest.max(error);
                if error.is_nan() || error > 1.0 {
                    let input = format!("opacity {opacity} a voxel, steps of {step} mm");
                    found.faults.push(fault(
                        input,
                        "not as opaque as its path",
                        "picture",
                        [4, 4, 0],
                        [share * expected, got],
                    ));
                    show(&mut found, "picture", &picture, channel, [([4, 4, 0], share * expected)]);
                }
            }
        }
    }
    found.figures.push(Figure::error("share of the tolerance", largest, 1.0, Unit::Share));
    Ok(found)
}

fn thin_samples(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut largest) = (Found::default(), 0.0f64);
    for (opacity, step, tolerance) in
        [(1e-4f64, 0.002, 1e-3), (1e-7, 0.002, 2e-3), (1.0, 1e-3, 0.0), (0.999, 30.0, 1e-3)]
    {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [2, 2] }}\nray = {{ step = {step}, early_end = 0.0 }}\n\
             [volume]\ntransfer = [{{ at = 0.0, colour = [1.0, 1.0, 1.0], opacity = {opacity} }}]"
        );
        let scene = made(block(0.5, [4, 40, 4]), &toml)?;
        let picture = drawn::slot(&bench.context, &scene, &frames(&scene, |_| 1.0), Slot::Picture)?;
        let got = picture.get([1, 1, 0])[3];
        let expected = -(40.0 * (-opacity).ln_1p()).exp_m1();
        // 4e-6 is below R16F's normal numbers, which are 6e-8 apart there.
        let error = (got - expected).abs() / (tolerance * expected + 6e-8);
        largest = largest.max(error);
        if error.is_nan() || error > 1.0 {
            let input = format!("opacity {opacity} a voxel, steps of {step} mm");
            found.faults.push(fault(input, "digits are lost on the way", "picture", [1, 1, 0], [expected, got]));
            show(&mut found, "picture", &picture, 3, [([1, 1, 0], expected)]);
        }
    }
    found.figures.push(Figure::error("share of the tolerance", largest, 1.0, Unit::Share));
    Ok(found)
}

/// Distances of an output against what they are by formula; `None` where a ray cannot be judged.
fn distances(found: &mut Found, got: &Texels, formula: impl Fn(usize, usize) -> Option<f64>, allowed: f64) {
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
    found.expect(rays > 100, || format!("only {rays} rays can be judged"));
    found.expect(holes == 0, || format!("{holes} of {rays} rays miss a surface that is there"));
    if worst.0 > allowed {
        let mut fault = fault(String::new(), "the surface is somewhere else", "distance_map", worst.1, worst.2);
        fault.worst.iter_mut().for_each(|w| (w.beyond, w.texels) = (beyond, rays));
        found.faults.push(fault);
    }
    if !found.faults.is_empty() {
        show(found, "distance_map", got, 0, known);
    }
    found.figures.push(Figure::error("largest error", worst.0, allowed, Unit::Millimetres));
}

/// A probe with lines, frames and samples close to one another.
fn fine() -> Probe {
    Probe {
        lines: Axis::centred(1.1 / 127.0, 128),
        slices: Axis::centred(0.8 / 60.0, 61),
        sample_pitch: 0.2,
        samples: 256,
        ..wobbler()
    }
}

/// Through scan conversion, sweep map and detector.
fn sphere(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, centre, radius) = (Found::default(), DVec3::new(1.5, 50.0, -2.0), 9.0);
    let toml = "mode = 'sr'\npicture = { size = [64, 64] }\nray = { step = 0.2 }\nsurface = { threshold = 0.2 }
                camera = { zoom = 3.0, target = [1.5, 30.0, -2.0], elevation = 10, field_of_view = 20 }";
    let scene = scene(Geometry::Sweep(fine()), FLOATS, toml).map_err(GpuError::Broken)?;
    let frames = body_frames(&scene, |p| ((radius - p.distance(centre)) / 0.6 + 0.5).clamp(0.0, 1.0));
    let got = drawn::slot(&bench.context, &scene, &frames, Slot::Distance)?;
    let formula = |x: usize, y: usize| {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let along = (centre - origin).dot(direction);
        let offset = (origin + direction * along).distance(centre);
        // Further out the chord is shorter than the detector's ring.
        (offset < 0.8 * radius).then(|| along - (radius * radius - offset * offset).sqrt())
    };
    // Half a step: the lattice of frames, 0.013 rad at 45 mm, is 0.6 mm wide across a curved edge.
    distances(&mut found, &got, formula, 0.1);
    Ok(found)
}

/// An edge half a millimetre wide lies where it is half as bright, at the depth of its middle.
fn plate(bench: &mut Bench) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let toml =
        "mode = 'sr'\npicture = { size = [24, 24] }\nray = { step = 0.1 }\nsurface = { threshold = 0.2, rough = 1 }
                camera = { field_of_view = 0 }";
    let scene = made(block(0.25, [60, 120, 60]), toml)?;
    // Along the depth, which the rays follow: 0.25 mm a voxel.
    let edge = 16.3;
    let frames = body_frames(&scene, |p| ((p.y - edge) / 0.75 + 0.5).clamp(0.0, 1.0));
    let got = drawn::slot(&bench.context, &scene, &frames, Slot::Distance)?;
    let formula = |x: usize, y: usize| {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let at = (edge - origin.y) / direction.y;
        let p = origin + direction * at;
        let inside = |axis: usize| p[axis] > scene.low[axis] + 1.0 && p[axis] < scene.high[axis] - 1.0;
        (direction.y > 0.5 && inside(0) && inside(2)).then_some(at)
    };
    distances(&mut found, &got, formula, 0.08);
    Ok(found)
}

/// Every level that a volume of 8 bits has is that level in the picture.
fn levels(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut wrong) = (Found::default(), 0);
    for floats in [false, true] {
        let toml = format!(
            "mode = 'plane'\npicture = {{ size = [16, 16] }}\nplanes = {{ plane = 'a', lines = false, position = [4, 4, 0.5] }}\n\
             post = {{ floats = {floats} }}\nray = {{ sampling = 'exact' }}"
        );
        let scene = made(block(0.5, [16, 16, 3]), &toml)?;
        let frames = frames(&scene, |[x, y, _]| (16 * y + x) as f64 / 255.0);
        let picture = drawn::picture(&bench.context, &scene, &frames)?;
        for (i, texel) in picture.rgba.chunks_exact(4).enumerate() {
            let apart = texel[..3].iter().map(|v| v.abs_diff(i as u8)).max().unwrap_or(0);
            if apart > 0 && {
                wrong += 1;
                wrong <= 4
            } {
                let at = [i % 16, i / 16, 0];
                let input = if floats { "a picture of floats, then of 8 bits" } else { "a picture straight of 8 bits" };
                found.faults.push(fault(input.into(), "another level", "screen", at, [i as f64, f64::from(texel[0])]));
                let expected = Picture { rgba: (0..=255).flat_map(|v| [v, v, v, 255]).collect(), ..picture.clone() };
                let fault = found.faults.len().checked_sub(1);
                found.pictures.push(Shown { fault, ..shown::pictures(input, &expected, &picture) });
            }
        }
    }
    found.figures.push(Figure::error("levels that are others", f64::from(wrong), 0.0, Unit::Count));
    Ok(found)
}

/// MIP of dark tissue with one bright voxel a column is that voxel's value, wherever along the ray it lies.
fn largest(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut off) = (Found::default(), 0.0f64);
    for depth in [0, 1, 7, 22, 23] {
        let toml = "mode = 'mip'\npicture = { size = [12, 12] }\nray = { step = 0.5, sampling = 'exact' }\ncamera = { field_of_view = 0 }\npost = { floats = true }";
        let scene = made(block(0.5, [12, 24, 12]), toml)?;
        let frames = frames(&scene, |[_, y, _]| if y == depth { 0.8 } else { 0.2 });
        let picture = drawn::slot(&bench.context, &scene, &frames, Slot::Picture)?;
        let got = picture.get([6, 6, 0])[0];
        // Steps as long as voxels meet each between its middle and half a voxel beside it.
        let (low, high) = (0.5 - 0.002, 0.8 + 0.002);
        off = off.max(if (low..=high).contains(&got) { 0.0 } else { 1.0 });
        if !(low..=high).contains(&got) {
            let input = format!("a bright layer {depth} voxels deep");
            found.faults.push(fault(input, "the brightest sample is not seen", "picture", [6, 6, 0], [0.8, got]));
            show(&mut found, "picture", &picture, 0, [([6, 6, 0], 0.8)]);
        }
    }
    found.figures.push(Figure::error("layers that are not seen", off, 0.0, Unit::Count));
    let miss = MISS;
    found.expect(miss > 3e38, || "a miss is the largest float".into());
    Ok(found)
}

/// Volumes that are filled by turns: what is shown is the one that was asked for.
fn turns(bench: &mut Bench) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let toml = "mode = 'plane'\npicture = { size = [16, 16] }\nplanes = { plane = 'a', lines = false, position = [4, 4, 0.5] }\n\
                ray = { sampling = 'exact' }";
    let scene = made(block(0.5, [16, 16, 3]), toml)?;
    let levels = [40u8, 90, 200];
    let options = RendererOptions { volume_images: levels.len() as u32, ..RendererOptions::default() };
    let mut renderer = Renderer::new(&bench.context, scene.clone(), &options)?;
    for (image, level) in levels.iter().enumerate() {
        drawn::send(&mut renderer, &frames(&scene, |_| f64::from(*level) / 255.0), image as u32)?;
    }
    for image in [1usize, 0, 2] {
        renderer.show(image as u32)?;
        let picture = renderer.picture()?;
        let (got, expected) = (picture.rgba[0], levels[image]);
        if got != expected {
            let at = [f64::from(expected), f64::from(got)];
            found.faults.push(fault(format!("image {image}"), "another volume is shown", "screen", [0; 3], at));
            let flat = [expected, expected, expected, 255].repeat(picture.rgba.len() / 4);
            let (fault, flat) = (found.faults.len().checked_sub(1), Picture { rgba: flat, ..picture.clone() });
            found.pictures.push(Shown { fault, ..shown::pictures(&format!("image {image}"), &flat, &picture) });
        }
    }
    Ok(found)
}
