//! Group "speed": the time of each pass alone, by the clock of the device, and the time to compile its pipelines. These checks never fail
//! by themselves; a baseline has the earlier times.

use super::built_in::{ALL_FILTERS, BYTES, cartesian, scene, wobbler};
use super::{Check, DeviceUnderTest, Findings};
use crate::gpu::{Context, ContextOptions, GpuError, pass_runner, pipeline_measure};
use crate::passes::{PASSES, Pass};
use crate::probe::{Axis, Geometry, Probe};
use crate::report::{Figure, Level};
use crate::scene::{Sampling, Scene};

/// Scenes that together need every pass, with pictures as large as a tile of a small display. A pass is timed in the first scene that
/// needs it.
const SCENES: [&str; 24] = [
    "mode = 'sr'",
    "mode = 'vr'",
    "mode = 'vr'\nlight = { volume = {} }",
    "mode = 'vr'\nstill = { samples = 2, events = 16 }",
    "mode = 'vr'\nray = { rays = 2, adaptive = true }",
    // Alone, the pass over the list has an empty one.
    "mode = 'vr'\nray = { tolerance = 1 }",
    "mode = 'mip'",
    "mode = 'orthogonal'",
    "mode = 'orthogonal'\npost = { floats = true }",
    "mode = 'cube'",
    "mode = 'mixed'\nlayout = 'four'\nplanes = { smooth = { lateral = 1.0, depth = 1.0, elevation = 1.0 } }",
    "mode = 'vr'\nfloating = 50",
    "mode = 'vr'\ncuts = [{ contour = [[-8, -6], [9, -5], [3, 2], [2, 9]], view = { at = [0, 20, 0], direction = [0.2, 1, 0], up = [0, 0, 1] } }]",
    "mode = 'sr'\nsurface = { detector = 'consistent', rough = 1 }",
    "mode = 'sr'\nlayout = 'pair'",
    "mode = 'sr'\nlight = { shadow = {}, occlusion = {}, skin = {} }\nslices = { blur = true, smooth = { lateral = 1.0, depth = 1.0, elevation = 1.0 } }\nray = { sampling = 'quads' }",
    "mode = 'vr'\nconditioning = { samples = 120, low_pass = 1.0, dynamic_range = 50 }\nslices = { estimator = 'median' }",
    "mode = 'sr'\nslices = { enhanced_sigma = { window = 5, largest = 9, sigma = 0.1, growth = true }, perona_malik = { repeat = 2 } }\n\
     distance = { enhanced_sigma = {}, perona_malik = { repeat = 2 } }\npost = { enhanced_sigma = {}, perona_malik = { repeat = 2 } }",
    "mode = 'sr'\nslices = { perona_malik = { scheme = 'aos', step = 2.0, repeat = 1 } }\npost = { perona_malik = { scheme = 'aos', step = 2.0, repeat = 1 } }",
    "mode = 'sr'\nslices = { perona_malik = { scheme = 'aos-richardson', step = 2.0, repeat = 1 } }",
    "mode = 'sr'\nslices = { perona_malik = { scheme = 'rkl1', step = 2.0, repeat = 1 } }",
    ALL_FILTERS,
    "mode = 'vr'\nclip = [{ at = [0, 30, 0], normal = [0.3, -1, 0.2] }]",
    "mode = 'sr'\nlayout = 'four'\nlabels = { shell = 0.5 }",
];

fn probe() -> Probe {
    let (lines, slices) = (Axis::centred(1.1 / 95.0, 96), Axis::centred(0.8 / 32.0, 33));
    Probe { lines, slices, sample_pitch: 0.25, samples: 240, ..wobbler() }
}

fn scenes() -> Result<Vec<Scene>, String> {
    let sweeps = SCENES.iter().map(|toml| (Geometry::Sweep(probe()), *toml));
    // A Cartesian volume needs passes of its own.
    let voxels = ["mode = 'mip'", "mode = 'vr'\nlayout = 'four'\nplanes = { smooth = {} }"];
    let all = sweeps.chain(voxels.map(|toml| (cartesian([96, 96, 33]), toml)));
    let one = |(geometry, toml)| {
        let mut scene = scene(geometry, BYTES, toml)?;
        scene.settings.picture.size = [192, 192];
        let settings = scene.settings.clone();
        Scene::new(scene.geometry, scene.input, settings).map_err(|e| e.to_string())
    };
    all.map(one).collect()
}

/// The scene in which a pass is timed.
fn scene_of<'a>(scenes: &'a [Scene], pass: &Pass) -> Option<&'a Scene> {
    scenes.iter().find(|scene| {
        let quads = pass.name != "packed_neighbours" || scene.settings.ray.sampling == Sampling::PackedNeighbours;
        quads && pass.is_needed(scene)
    })
}

pub fn checks(_: Level) -> Vec<Check> {
    let check = |pass: &'static Pass| Check::new("speed", pass.name, move |dut| time(dut, pass));
    PASSES.iter().map(check).collect()
}

fn time(dut: &mut DeviceUnderTest, pass: &'static Pass) -> Result<Findings, GpuError> {
    // The minimum for a comparison of this many passes.
    let repeats = if dut.level == Level::Full { 30 } else { 8 };
    let scenes = scenes().map_err(GpuError::Broken)?;
    let Some(scene) = scene_of(&scenes, pass) else {
        return Ok(Findings::left_out("no scene that is timed needs it"));
    };
    // Validation slows down commands and submissions, so times are measured without it.
    let own =
        dut.options().validation.then(|| Context::new(&ContextOptions { validation: false, ..dut.options().clone() }));
    let context = own.transpose()?.unwrap_or_else(|| dut.context.clone());
    // First: later the driver may have parts of it ready.
    let compiled = pipeline_measure::compile_time(&context, scene, pass)?;
    let samples = pass_runner::time_pass(&context, scene, pass, repeats)?;
    let mut findings = Findings::default();
    if samples.is_empty() {
        findings.left_out = Some("the device has no time stamps".into());
    } else {
        let figure = Figure::times("time on the device", samples);
        findings.figures.push(figure.map_err(|e| GpuError::Broken(format!("times of '{}': {e}", pass.name)))?);
    }
    findings.figures.push(Figure::single_time("time to compile without a cache", compiled));
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pass_has_a_scene_that_it_is_timed_in() {
        let scenes = scenes().unwrap();
        let without = PASSES.iter().filter(|pass| scene_of(&scenes, pass).is_none()).map(|p| p.name);
        assert_eq!(without.collect::<Vec<_>>(), [""; 0]);
    }
}
