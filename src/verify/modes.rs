//! Whole pictures in every mode, of bodies that are known, against the four stages in f64.

use super::built_in::{BYTES, FLOATS, body_frames, cartesian, linear, scene, still, uneven, wobbler};
use super::isolated_context::IsolatedContext;
use super::{Bench, Check, Found, drawn, shown};
use crate::gpu::GpuError;
use crate::passes::slots::Format;
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::probe::{Advance, Geometry, Probe};
use crate::reference;
use crate::scene::{Input, Scene};
use crate::source::phantom::{Phantom, PhantomOptions};
use crate::verify::report::{Fault, Figure, Level, Shown, Unit, Worst};
use glam::DVec3;

/// Mean difference of a picture from its reference where it is near, levels of 255. Rounding costs some tenths of a level where it
/// costs any.
pub const MEAN: f64 = 0.2;
/// More than this many levels off is far.
pub const FAR: u8 = 8;
/// Share of a picture's values that may be far off: edges that move by a pixel where a detector's or a shadow's threshold is met.
pub const EDGES: f64 = 0.02;

/// Pixels along an edge of a tile: what one workgroup draws.
const TILE: u32 = 8;
/// Share of a tile's pixels that may be far off: an edge that moves by a pixel crosses it once or twice, a workgroup that is lost takes all.
const LOST: f64 = 0.5;

/// The same mean of scenes that were not chosen for their pictures: one flat colour half-way between two levels may be the other one
/// everywhere, but for its alpha.
const FLAT: f64 = 0.75;

/// A picture that is drawn of something.
pub struct View {
    pub name: String,
    pub scene: Scene,
    /// As the frames' texture yields them, in geometric order.
    pub frames: Vec<Texels>,
}

/// What a view is to show.
enum Of {
    /// A ball with a knob and a hollow.
    Ball(Geometry),
    /// The synthetic fetal head, with speckle, as a probe sees it.
    Head,
}

fn moved() -> Probe {
    Probe { advance: Advance::Same(0.03), ..wobbler() }
}

fn views() -> Vec<(&'static str, Of, &'static str)> {
    let fan = || Of::Ball(Geometry::Sweep(moved()));
    vec![
        (
            "surface",
            fan(),
            "mode = 'sr'\nsurface = { threshold = 0.15 }\ndistance = { median = 3, bilateral = { pixels = 1.5, distance = 2.0 } }",
        ),
        (
            "surface, shadow, occlusion and skin",
            fan(),
            "mode = 'sr'\nsurface = { threshold = 0.15 }\nlight = { shadow = { softness = 0.3 }, occlusion = {}, skin = {}, position = [20.0, 10.0, 20.0] }",
        ),
        ("surface, adaptive detector", fan(), "mode = 'sr'\nsurface = { detector = 'adaptive', threshold = 0.1 }"),
        ("surface, lasting detector", fan(), "mode = 'sr'\nsurface = { detector = 'lasting', threshold = 0.1 }"),
        ("volume", fan(), "mode = 'vr'\nvolume = { transfer = 'skin' }"),
        ("volume, lit", fan(), "mode = 'vr'\nvolume = { shading = 'first-hit' }\nlight = { shadow = {} }"),
        ("volume, depth-coded", fan(), "mode = 'vr'\nvolume = { shading = 'depth-coded', transfer = 'warm' }"),
        ("volume, pre-integrated", fan(), "mode = 'vr'\nvolume = { compositing = 'pre-integrated' }"),
        ("volume, clipped", fan(), "mode = 'vr'\nclip = [{ at = [0, 31, 0], normal = [-0.3, 1, -0.2] }]"),
        ("veil over a surface", fan(), "mode = 'mixed'\nvolume = { veil = 0.5 }\nsurface = { threshold = 0.15 }"),
        ("largest", fan(), "mode = 'mip'"),
        ("smallest", fan(), "mode = 'minip'"),
        ("mean", fan(), "mode = 'mean'"),
        ("plane", fan(), "mode = 'plane'\nplanes = { azimuth = 25, tilt = -15, roll = 40, thickness = 2.5 }"),
        ("three planes", fan(), "mode = 'orthogonal'"),
        ("tomography", fan(), "mode = 'tomography'\nplanes = { columns = 3, rows = 2, spacing = 3.5 }"),
        (
            "block",
            fan(),
            "mode = 'cube'\ncamera = { azimuth = 35, elevation = -20 }\ncube = { inset = { left = 9, near = 8 } }",
        ),
        ("4-up", fan(), "mode = 'sr'\nlayout = 'four'\nsurface = { threshold = 0.15 }"),
        (
            "every filter",
            fan(),
            "mode = 'sr'\nslices.median = true\nslices.sigma = { window = 5, sigma = 0.08 }\nslices.perona_malik = { repeat = 2 }\nslices.smooth = { lateral = 0.8, depth = 0.8, elevation = 0.5 }\nsurface = { threshold = 0.12 }\ndistance = { median = 5, sigma = {}, perona_malik = { repeat = 2 } }\npost = { sigma = { window = 3, sigma = 0.05 }, gamma = 1.3, contrast = 1.2, colour_map = 'skin' }",
        ),
        (
            "conditioned lines",
            fan(),
            "mode = 'plane'\nconditioning = { samples = 40, low_pass = 1.3, compressed_range = 45, tgc = [{ depth = 0, gain = 6 }, { depth = 40, gain = -6 }] }",
        ),
        ("volume, frames at uneven angles", Of::Ball(Geometry::Sweep(uneven(wobbler()))), "mode = 'vr'"),
        ("largest, linear array", Of::Ball(Geometry::Sweep(linear())), "mode = 'mip'"),
        ("plane of a single frame", Of::Ball(Geometry::Sweep(still())), "mode = 'plane'"),
        (
            "surface, Cartesian",
            Of::Ball(cartesian([32, 40, 16])),
            "mode = 'sr'\nsurface = { threshold = 0.15 }\ncamera = { azimuth = 15, elevation = 10 }",
        ),
        (
            "a head, surface",
            Of::Head,
            "mode = 'sr'\nslices.smooth = { lateral = 1.2, depth = 0.8, elevation = 0.7 }\nsurface = { threshold = 0.1, rough = 2 }\ndistance = { median = 5 }",
        ),
        (
            "a head, volume",
            Of::Head,
            "mode = 'vr'\nslices.smooth = { lateral = 1.0, depth = 0.8, elevation = 0.6 }\nvolume = { transfer = 'skin', shading = 'first-hit' }",
        ),
        ("a head, three planes", Of::Head, "mode = 'orthogonal'"),
    ]
}

/// Every picture of this group, drawn by formula: bodies, lights and filters of all modes.
///
/// # Errors
/// A built-in scene that is none.
pub fn made() -> Result<Vec<View>, String> {
    views().into_iter().map(|(name, of, toml)| view(name, of, toml)).collect()
}

fn view(name: &str, of: Of, toml: &str) -> Result<View, String> {
    let near = "camera = { azimuth = 15, elevation = 10, field_of_view = 25, zoom = 4.8, target = [1.0, 32.0, 0.0] }";
    let camera = match of {
        Of::Ball(Geometry::Sweep(_)) if !toml.contains("camera") => near,
        _ => "",
    };
    let toml = format!(
        "{toml}\n{camera}\npicture.size = [80, 64]\nslices.pixels = 72\nray = {{ step = 0.5, sampling = 'exact' }}"
    );
    let name = name.to_string();
    let named = |e: String| format!("{name}: {e}");
    let (scene, frames) = match of {
        Of::Ball(geometry) => {
            let is_sweep = matches!(geometry, Geometry::Sweep(_));
            let scene = scene(geometry, FLOATS, &toml).map_err(named)?;
            // The lattice is small and elsewhere.
            let place = |p: DVec3| if is_sweep { p } else { p * 2.0 + DVec3::new(-3.0, 36.0, 0.0) };
            let frames = body_frames(&scene, |p| ball(place(p)));
            (scene, frames)
        }
        Of::Head => head(&toml).map_err(named)?,
    };
    Ok(View { name, scene, frames })
}

fn ball(p: DVec3) -> f64 {
    let bump = |radius: f64, x, y, z| ((radius - p.distance(DVec3::new(x, y, z))) / 2.0 + 0.5).clamp(0.0, 1.0);
    let tissue = bump(9.0, 1.0, 52.0, 0.0).max(bump(2.5, 3.0, 43.5, 2.0));
    // No value that is half-way between two levels, and a hollow for what is darkest.
    (0.12 + 0.8 * tissue) * (1.0 - 0.9 * bump(3.5, -2.0, 54.0, -1.0))
}

fn head(toml: &str) -> Result<(Scene, Vec<Texels>), String> {
    let phantom = Phantom::new(PhantomOptions { frames: 19, lines: 48, samples: 96, ..PhantomOptions::default() });
    let phantom = phantom.map_err(|e| e.to_string())?;
    let scene = scene(Geometry::Sweep(phantom.probe(0)), Input { ..BYTES }, toml)?;
    let [width, height] = scene.frame_size().map(|n| n as usize);
    let mut frames = phantom.volume(0);
    frames.sort_by_key(|frame| frame.slice);
    let decoded = |bytes: &[u8]| Texels::decode([width, height, 1], Format::R8, bytes);
    Ok((scene, frames.iter().map(|frame| decoded(&frame.bytes)).collect()))
}

pub fn checks(_: Level) -> Vec<Check> {
    let mode = |(name, ..): (&'static str, Of, &str)| Check::new("modes", name, move |bench| mode(bench, name));
    let mut checks: Vec<_> = views().into_iter().map(mode).collect();
    checks.push(Check::new("modes", "every scene of the passes", every_scene));
    checks
}

fn mode(bench: &mut Bench, name: &str) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let Some((_, of, toml)) = views().into_iter().find(|(of, ..)| *of == name) else { return Ok(found) };
    let view = view(name, of, toml).map_err(GpuError::Broken)?;
    let expected = reference(&view.scene, &view.frames);
    let got = drawn::picture(&bench.context, &view.scene, &view.frames)?;
    judge(&mut found, name, &expected, &got);
    // A picture of one colour would be right of many wrong devices.
    let darkest = expected.rgba.chunks_exact(4).map(|p| p[1]).min();
    found.expect(darkest != expected.rgba.chunks_exact(4).map(|p| p[1]).max(), || "there is nothing to see".into());
    let fault = (!found.faults.is_empty()).then_some(0);
    found.pictures.push(Shown { fault, ..shown::pictures("picture", &expected, &got) });
    Ok(found)
}

/// The picture by the f64 references.
pub fn reference(scene: &Scene, frames: &[Texels]) -> Picture {
    let mut slots = reference::render(scene, frames);
    let screen = slots.remove(&Slot::Screen).unwrap_or_else(|| Texels::untouched([0; 3], 4));
    Picture { width: screen.size[0] as u32, height: screen.size[1] as u32, rgba: screen.encode(Format::Rgba8) }
}

/// How two pictures differ, levels of 255.
pub struct Apart {
    /// Of the values that are not far off.
    pub mean: f64,
    /// Share of the values that are.
    pub far: f64,
    pub largest: u8,
    /// Largest share of a tile's pixels that are far off.
    pub tile: f64,
    pub worst: Worst,
}

/// Of two pictures of one size.
pub fn apart(expected: &Picture, got: &Picture) -> Apart {
    let (mut sum, mut far, mut largest, mut at) = (0.0, 0, 0, 0);
    for (i, (e, g)) in expected.rgba.iter().zip(&got.rgba).enumerate() {
        let apart = e.abs_diff(*g);
        match apart > FAR {
            true => far += 1,
            false => sum += f64::from(apart),
        }
        if apart > largest {
            (largest, at) = (apart, i);
        }
    }
    let (count, width) = (expected.rgba.len().max(1), expected.width.max(1) as usize);
    let worst = Worst {
        output: "screen".into(),
        at: [at / 4 % width, at / 4 / width, 0],
        channel: at % 4,
        expected: expected.rgba.get(at).copied().map_or(0.0, f64::from),
        got: got.rgba.get(at).copied().map_or(0.0, f64::from),
        beyond: far,
        texels: count,
    };
    let (mean, far) = (sum / (count - far).max(1) as f64, far as f64 / count as f64);
    Apart { mean, far, largest, tile: worst_tile(expected, got), worst }
}

fn worst_tile(expected: &Picture, got: &Picture) -> f64 {
    let across = expected.width.div_ceil(TILE).max(1);
    let mut tiles = vec![[0u32; 2]; (across * expected.height.div_ceil(TILE)) as usize];
    for (i, (e, g)) in expected.rgba.chunks_exact(4).zip(got.rgba.chunks_exact(4)).enumerate() {
        let (x, y) = (i as u32 % expected.width, i as u32 / expected.width);
        let is_far = e.iter().zip(g).any(|(e, g)| e.abs_diff(*g) > FAR);
        let [far, all] = &mut tiles[(y / TILE * across + x / TILE) as usize];
        (*far, *all) = (*far + u32::from(is_far), *all + 1);
    }
    tiles.iter().map(|[far, all]| f64::from(*far) / f64::from((*all).max(1))).fold(0.0, f64::max)
}

/// Keeps how far a picture is from the expected one, and says where it is too far.
pub fn judge(found: &mut Found, input: &str, expected: &Picture, got: &Picture) {
    if (expected.width, expected.height, expected.rgba.len()) != (got.width, got.height, got.rgba.len()) {
        return found.expect(false, || {
            format!("{input}: {}x{} pixels instead of {}x{}", got.width, got.height, expected.width, expected.height)
        });
    }
    let apart = apart(expected, got);
    if apart.mean > MEAN || apart.far > EDGES || apart.tile > LOST {
        let what = format!(
            "mean difference {:.3} levels, {:.2} % of the values off by more than {FAR}, up to {:.0} % of a tile's pixels",
            apart.mean,
            100.0 * apart.far,
            100.0 * apart.tile
        );
        found.faults.push(Fault { input: input.into(), worst: Some(apart.worst), ..Fault::new(what) });
    }
    found.figures.push(Figure::error("mean difference", apart.mean, MEAN, Unit::Levels));
    found.figures.push(Figure::error("values further off than 8 levels", apart.far, EDGES, Unit::Share));
    found.figures.push(Figure::error("pixels of a tile that are", apart.tile, LOST, Unit::Share));
    let largest = Figure::error("largest difference", apart.largest.into(), 0.0, Unit::Levels);
    found.figures.push(Figure { allowed: None, ..largest });
}

/// The scenes that passes are held against their references in, whole: extremes of every setting, one after the other.
fn every_scene(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut drawn_ones, mut mean, mut far) = (Found::default(), 0, 0.0f64, 0.0f64);
    let (scenes, step) = (bench.scenes(), if bench.level == Level::Full { 1 } else { 11 });
    // One renderer after the other on one device.
    let aside = IsolatedContext::of_changes(bench)?;
    for (name, scene) in scenes.iter().step_by(step) {
        let frames = body_frames(scene, ball);
        let expected = reference(scene, &frames);
        let got = drawn::picture(&aside.context, scene, &frames)?;
        let apart = apart(&expected, &got);
        drawn_ones += 1;
        (mean, far) = (mean.max(apart.mean), far.max(apart.far));
        if (apart.mean > FLAT || apart.far > EDGES) && found.faults.len() < 8 {
            let what = format!("mean difference {:.3} levels, {:.2} % far off", apart.mean, 100.0 * apart.far);
            let mut picture = shown::pictures(name, &expected, &got);
            picture.fault = Some(found.faults.len());
            found.pictures.push(picture);
            found.faults.push(Fault { input: name.clone(), worst: Some(apart.worst), ..Fault::new(what) });
        }
    }
    aside.tell(&mut found);
    found.notes.push(format!("{drawn_ones} pictures"));
    found.figures.push(Figure::error("largest mean difference", mean, FLAT, Unit::Levels));
    found.figures.push(Figure::error("values further off than 8 levels", far, EDGES, Unit::Share));
    Ok(found)
}
