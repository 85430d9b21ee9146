//! Groups "modes" and "against": pictures of known bodies in every mode, compared with the f64 reference, or with another device.

use super::built_in::{BYTES, FLOATS, body_frames, cartesian, linear, moved, scene, still, uneven, wobbler};
use super::compare::{MAX_FAR_SHARE, compare_picture, picture_comparison, picture_difference};
use super::render::reference_picture;
use super::{Check, DeviceUnderTest, Findings, IsolatedContext, render};
use crate::gpu::Context;
use crate::gpu::GpuError;
use crate::passes::Texels;
use crate::passes::slots::Format;
use crate::probe::Geometry;
use crate::report::{Fault, Figure, Level, PictureComparison, Unit};
use crate::scene::{Input, Scene};
use crate::source::phantom::{Phantom, PhantomOptions};
use glam::DVec3;
use std::sync::Arc;

/// Maximum mean difference of scenes that were not chosen for their pictures: a flat colour half-way between two levels may be rounded to
/// the other one everywhere, except its alpha.
const MAX_MEAN_ANY_SCENE: f64 = 0.75;

/// A scene to render, with its frames.
pub struct View {
    pub name: String,
    pub scene: Scene,
    /// The frames, one for each slice in geometric order, with the values that a shader reads (0..1).
    pub frames: Vec<Texels>,
}

/// The subject of a view.
enum Subject {
    /// A ball with a knob and a hollow.
    Ball(Geometry),
    /// The synthetic fetal head, with speckle, as a probe sees it.
    Head,
}

fn views() -> Vec<(&'static str, Subject, &'static str)> {
    let fan = || Subject::Ball(Geometry::Sweep(moved(wobbler(), 0.5)));
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
        ("surface, consistent detector", fan(), "mode = 'sr'\nsurface = { detector = 'consistent', threshold = 0.1 }"),
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
        ("3D + planes", fan(), "mode = 'mixed'\nlayout = 'beside'\nsurface = { threshold = 0.15 }"),
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
        ("volume, frames at uneven angles", Subject::Ball(Geometry::Sweep(uneven(wobbler()))), "mode = 'vr'"),
        ("largest, linear array", Subject::Ball(Geometry::Sweep(linear())), "mode = 'mip'"),
        ("plane of a single frame", Subject::Ball(Geometry::Sweep(still())), "mode = 'plane'"),
        (
            "surface, Cartesian",
            Subject::Ball(cartesian([32, 40, 16])),
            "mode = 'sr'\nsurface = { threshold = 0.15 }\ncamera = { azimuth = 15, elevation = 10 }",
        ),
        (
            "a head, surface",
            Subject::Head,
            "mode = 'sr'\nslices.smooth = { lateral = 1.2, depth = 0.8, elevation = 0.7 }\nsurface = { threshold = 0.1, rough = 2 }\ndistance = { median = 5 }",
        ),
        (
            "a head, volume",
            Subject::Head,
            "mode = 'vr'\nslices.smooth = { lateral = 1.0, depth = 0.8, elevation = 0.6 }\nvolume = { transfer = 'skin', shading = 'first-hit' }",
        ),
        ("a head, three planes", Subject::Head, "mode = 'orthogonal'"),
    ]
}

/// The views of this group: bodies, lights and filters of all modes.
///
/// # Errors
/// One line: a built-in scene is invalid.
fn mode_views() -> Result<Vec<View>, String> {
    views().into_iter().map(|(name, of, toml)| view(name, of, toml)).collect()
}

fn view(name: &str, of: Subject, toml: &str) -> Result<View, String> {
    let near = "camera = { azimuth = 15, elevation = 10, field_of_view = 25, zoom = 4.8, target = [1.0, 32.0, 0.0] }";
    let camera = match of {
        Subject::Ball(Geometry::Sweep(_)) if !toml.contains("camera") => near,
        _ => "",
    };
    let toml = format!(
        "{toml}\n{camera}\npicture.size = [80, 64]\nslices.pixels = 72\nray = {{ step = 0.5, sampling = 'exact' }}"
    );
    let name = name.to_string();
    let named = |e: String| format!("{name}: {e}");
    let (scene, frames) = match of {
        Subject::Ball(geometry) => {
            let is_sweep = matches!(geometry, Geometry::Sweep(_));
            let scene = scene(geometry, FLOATS, &toml).map_err(named)?;
            // The Cartesian volume is small and at another position.
            let place = |p: DVec3| if is_sweep { p } else { p * 2.0 + DVec3::new(-3.0, 36.0, 0.0) };
            let frames = body_frames(&scene, |p| ball(place(p)));
            (scene, frames)
        }
        Subject::Head => head(&toml).map_err(named)?,
    };
    Ok(View { name, scene, frames })
}

fn ball(p: DVec3) -> f64 {
    let bump = |radius: f64, x, y, z| ((radius - p.distance(DVec3::new(x, y, z))) / 2.0 + 0.5).clamp(0.0, 1.0);
    let tissue = bump(9.0, 1.0, 52.0, 0.0).max(bump(2.5, 3.0, 43.5, 2.0));
    // No value is half-way between two levels; the hollow is for minimum projections.
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
    let mode = |(name, ..): (&'static str, Subject, &str)| Check::new("modes", name, move |dut| mode(dut, name));
    let mut checks: Vec<_> = views().into_iter().map(mode).collect();
    checks.push(Check::new("modes", "every scene of the passes", every_scene));
    checks
}

fn mode(dut: &mut DeviceUnderTest, name: &str) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let Some((_, of, toml)) = views().into_iter().find(|(of, ..)| *of == name) else { return Ok(findings) };
    let view = view(name, of, toml).map_err(GpuError::Broken)?;
    let expected = reference_picture(&view.scene, &view.frames);
    let got = render::picture(&dut.context, &view.scene, &view.frames)?;
    compare_picture(&mut findings, name, &expected, &got);
    // A picture of one colour proves nothing.
    let darkest = expected.rgba.chunks_exact(4).map(|p| p[1]).min();
    findings.expect(darkest != expected.rgba.chunks_exact(4).map(|p| p[1]).max(), || "there is nothing to see".into());
    let fault = (!findings.faults.is_empty()).then_some(0);
    findings.pictures.push(PictureComparison { fault, ..picture_comparison("picture", &expected, &got) });
    Ok(findings)
}

/// Pictures of all built-in scenes, which have extremes of every setting.
fn every_scene(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut drawn_ones, mut mean, mut far) = (Findings::default(), 0, 0.0f64, 0.0f64);
    let (scenes, step) = (dut.scenes(), if dut.level == Level::Full { 1 } else { 11 });
    // One renderer after another on one context.
    let isolated = IsolatedContext::of_changes(dut)?;
    // A path of a still that takes another turn is another path: its pass is checked alone, and its mean by known answers.
    for (name, scene) in scenes.iter().step_by(step).filter(|(_, scene)| scene.still().is_none()) {
        let frames = body_frames(scene, ball);
        let expected = reference_picture(scene, &frames);
        let got = render::picture(&isolated.context, scene, &frames)?;
        let apart = picture_difference(&expected, &got);
        drawn_ones += 1;
        (mean, far) = (mean.max(apart.mean), far.max(apart.far));
        if (apart.mean > MAX_MEAN_ANY_SCENE || apart.far > MAX_FAR_SHARE) && findings.faults.len() < 8 {
            let what = format!("mean difference {:.3} levels, {:.2} % far off", apart.mean, 100.0 * apart.far);
            let fault = Fault { input: name.clone(), worst: Some(apart.worst), ..Fault::new(what) };
            findings.add_shown(fault, picture_comparison(name, &expected, &got));
        }
    }
    isolated.report_validation(&mut findings);
    findings.notes.push(format!("{drawn_ones} pictures"));
    findings.figures.push(Figure::error("largest mean difference", mean, MAX_MEAN_ANY_SCENE, Unit::Levels));
    findings.figures.push(Figure::error("values further off than 8 levels", far, MAX_FAR_SHARE, Unit::Share));
    Ok(findings)
}

/// Checks, one for each view, that render it on the device under test and on the device of `other`, and compare the pictures by [`compare_picture`].
/// The picture of `other` is the expected one.
///
/// # Errors
/// One line: a built-in scene is invalid.
pub fn against(_: Level, other: &Arc<Context>) -> Result<Vec<Check>, String> {
    let check = |view: View| {
        let other = other.clone();
        Check::new("against", view.name.clone(), move |dut| {
            let mut findings = Findings::default();
            // An error of the other device is a fault of this check, not of the device under test.
            let theirs = match render::picture(&other, &view.scene, &view.frames) {
                Ok(picture) => picture,
                Err(error) => {
                    findings.faults.push(Fault::new(format!("'{}': {error}", other.candidate.name)));
                    return Ok(findings);
                }
            };
            let ours = render::picture(&dut.context, &view.scene, &view.frames)?;
            compare_picture(&mut findings, &view.name, &theirs, &ours);
            let what = format!("'{}' beside '{}'", dut.context.candidate.name, other.candidate.name);
            let fault = (!findings.faults.is_empty()).then_some(0);
            findings.pictures.push(PictureComparison { fault, ..picture_comparison(&what, &theirs, &ours) });
            Ok(findings)
        })
    };
    Ok(mode_views()?.into_iter().map(check).collect())
}
