//! The largest pictures and volumes: beyond what the device holds they are refused by name before anything is made, and at its limits
//! they are drawn right.

use super::built_in::{BYTES, FLOATS, frames, scene};
use super::failing::count;
use super::isolated_context::IsolatedContext;
use super::{Bench, Check, Found, drawn};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::probe::{Geometry, Grid};
use crate::scene::{MAX_PICTURE, Scene};
use crate::verify::report::{Fault, Figure, Level, Unit, Worst};
use std::sync::Arc;
use std::sync::atomic::Ordering;

pub fn checks(_: Level) -> Vec<Check> {
    let of = |name: &str, work: fn(&mut Bench) -> Result<Found, GpuError>| Check::new("failures", name, work);
    vec![
        of("pictures and volumes beyond the limits", beyond),
        of("volumes beyond the memory", beyond_memory),
        of("the largest pictures", largest),
    ]
}

fn block(size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { size, spacing: [0.5; 3], origin: [0.0; 3] })
}

fn of(size: [usize; 3], toml: &str) -> Result<Scene, GpuError> {
    scene(block(size), BYTES, toml).map_err(GpuError::Broken)
}

/// A fault unless the scene is refused by an error that says `names`, with nothing made.
fn refused(found: &mut Found, context: &Arc<Context>, what: &str, scene: Scene, names: [&str; 2]) {
    let before = context.counts.allocations.load(Ordering::Relaxed);
    match Renderer::new(context, scene, &RendererOptions::default()) {
        Ok(_) => found.expect(false, || format!("{what} was not refused")),
        Err(error) => {
            let text = error.to_string();
            let is_named = names.iter().all(|name| text.contains(name)) && text.lines().count() == 1;
            found.expect(is_named, || format!("{what}: expected {names:?}, the error says: {text}"));
        }
    }
    let made = context.counts.allocations.load(Ordering::Relaxed) - before;
    found.expect(made == 0, || format!("{what}: {made} allocations were made before it was refused"));
}

fn beyond(bench: &mut Bench) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let context = &bench.context;
    let three = context.limits.max_image_dimension3_d as usize;
    let small = "mode = 'vr'\npicture = { size = [4, 4] }";
    for axis in 0..3 {
        let mut size = [2; 3];
        size[axis] = three + 1;
        let what = format!("a volume of {size:?}");
        refused(&mut found, context, &what, of(size, small)?, ["volume", &three.to_string()]);
    }
    // Every edge is within the limits, and the whole beyond any allocation.
    let floats = format!("{small}\nslices = {{ format = 'r32f' }}");
    let bytes = context.candidate.max_bytes;
    if 4 * (three as u64).pow(3) > bytes {
        let whole = of([three; 3], &floats)?;
        refused(&mut found, context, "a volume larger than an allocation", whole, ["image", &bytes.to_string()]);
    }
    let picture = scene(block([2; 3]), BYTES, &format!("mode = 'vr'\npicture = {{ size = [{}, 4] }}", MAX_PICTURE + 1));
    let said = picture.map_or_else(|said| said, |_| "nothing".into());
    found.expect(said.contains("picture.size") && said.contains(&MAX_PICTURE.to_string()), || {
        format!("a picture of {} pixels: expected picture.size and its limit, the error says: {said}", MAX_PICTURE + 1)
    });
    // As if the device had less.
    let lesser = IsolatedContext::lacking(bench, |context| {
        context.limits.max_image_dimension2_d = 64;
        context.candidate.max_bytes = 1 << 20;
    })?;
    let wide = of([4; 3], "mode = 'vr'\npicture = { size = [65, 8] }")?;
    refused(&mut found, &lesser.context, "a picture wider than a device's images", wide, ["image", "64"]);
    let deep = of([128, 128, 65], "mode = 'vr'\npicture = { size = [8, 8] }\nslices = { format = 'r8' }")?;
    refused(&mut found, &lesser.context, "a volume of more than a device's bytes", deep, ["image", "1048576"]);
    lesser.tell(&mut found);
    found.notes.push(format!(
        "images to {0} x {0} and {three} x {three} x {three} texels, allocations to {1} MiB",
        context.limits.max_image_dimension2_d,
        bytes >> 20
    ));
    Ok(found)
}

/// More volume images than the device has memory for.
fn beyond_memory(bench: &mut Bench) -> Result<Found, GpuError> {
    if bench.context.candidate.has_unified_memory() {
        return Ok(Found::left_out(
            "a device in the machine's memory is handed out more than there is, and killed for it",
        ));
    }
    let (mut found, aside) = (Found::default(), IsolatedContext::new(bench)?);
    let context = &aside.context;
    let edge = (context.limits.max_image_dimension3_d as usize).min(1024);
    let toml = "mode = 'mip'\npicture = { size = [4, 4] }\nslices = { format = 'r8' }\nray = { sampling = 'exact' }";
    let scene = of([edge; 3], toml)?;
    let images = context.memory() / (edge as u64).pow(3) + 2;
    let before = context.allocated();
    let options = RendererOptions { volume_images: images as u32, ..RendererOptions::default() };
    match Renderer::new(context, scene, &options) {
        Ok(_) => found.expect(false, || format!("{images} volumes of {edge}^3 bytes were not refused")),
        Err(error) => {
            let text = error.to_string();
            found.expect(text.contains("image 'volume'"), || format!("{images} volumes: the error says: {text}"));
        }
    }
    super::failing::returned(&mut found, context, before, "more volumes than the memory holds");
    let small = of([16; 3], "mode = 'mip'\npicture = { size = [8, 8] }")?;
    let seen = drawn::picture(context, &small, &frames(&small, |_| 0.5))?;
    found.expect(seen.rgba[4 * 36].abs_diff(128) <= 1, || "the first picture after that is not what was sent".into());
    found.figures.push(count("volume images asked for", images as usize));
    aside.tell(&mut found);
    Ok(found)
}

/// Waves of 32 voxels along an axis of a needle: 2 pixels a level in the longest picture.
fn wave(at: f64) -> f64 {
    let phase = (at / 32.0).rem_euclid(1.0);
    1.0 - (2.0 * phase - 1.0).abs()
}

fn largest(bench: &mut Bench) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let limit = bench.context.limits.max_image_dimension2_d.min(MAX_PICTURE);
    let other = if bench.level == Level::Quick { 16 } else { limit / 8 };
    let mut largest = 0.0f64;
    let mut pixels = 0;
    for (size, axis) in [([limit, other], 0), ([other, limit], 1)] {
        let (mut voxels, mut spacing) = ([4, 4, 3], [1.0; 3]);
        (voxels[axis], spacing[axis]) = (512, 8.0);
        let grid = Geometry::Cartesian(Grid { size: voxels, spacing, origin: [0.0; 3] });
        let toml = format!(
            "mode = 'plane'\npicture = {{ size = {size:?} }}\nplanes = {{ plane = 'a', lines = false }}\n\
             slices = {{ format = 'r32f' }}\nray = {{ sampling = 'exact' }}"
        );
        let scene = scene(grid, FLOATS, &toml).map_err(GpuError::Broken)?;
        let picture = drawn::picture(&bench.context, &scene, &frames(&scene, |at| wave(at[axis] as f64)))?;
        let sheet = scene.sheet();
        let [tile] = &sheet.tiles[..] else { return Err(GpuError::Broken("a plane has one tile".into())) };
        let from_middle = |at: u32, axis: usize| (f64::from(at) + 0.5 - f64::from(size[axis]) / 2.0) * sheet.pixel;
        for spot in 0..257 {
            // Along the needle, from end to end.
            let mut at = size.map(|n| n / 2);
            at[axis] = (u64::from(size[axis] - 1) * spot / 256) as u32;
            let p = tile.plane.at + tile.plane.right * from_middle(at[0], 0) + tile.plane.down * from_middle(at[1], 1);
            let along = p[axis] / 8.0;
            // Beyond the middles of the outer voxels black is mixed in.
            if !(0.5..510.5).contains(&along) {
                continue;
            }
            let (low, share) = (along.floor(), along.fract());
            let expected = 255.0 * (wave(low) * (1.0 - share) + wave(low + 1.0) * share);
            let index = 4 * (at[1] as usize * size[0] as usize + at[0] as usize);
            let got = f64::from(picture.rgba.get(index).copied().unwrap_or(0));
            let error = (got - expected).abs();
            (largest, pixels) = (largest.max(error), pixels + 1);
            if error > 1.0 && found.faults.len() < 4 {
                let at = [at[0] as usize, at[1] as usize, 0];
                let worst = Worst { output: "screen".into(), at, channel: 0, expected, got, beyond: 1, texels: 257 };
                let what = format!("a picture of {} x {} shows something else", size[0], size[1]);
                found.faults.push(Fault { worst: Some(worst), ..Fault::new(what) });
            }
        }
    }
    found.expect(pixels > 400, || format!("only {pixels} spots lie in the pictures"));
    found.figures.push(Figure::error("largest error", largest, 1.0, Unit::Levels));
    found.figures.push(count("spots", pixels));
    found.notes.push(format!("pictures of {limit} x {other} pixels and the other way round"));
    Ok(found)
}
