//! Random scenes: each is refused in one line or drawn, and validation is silent.

use crate::common::gpu::*;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::probe::{Advance, Geometry};
use echolume::low_level::scene::Scene;
use echolume::low_level::scene::load::{Layers, PRESETS};
use std::time::Instant;

/// Number of scenes within the tests.
const SCENES: u64 = 40;

/// Settings and their values, of sizes that a software device draws in milliseconds.
const SETTINGS: &[(&str, &[&str])] = &[
    ("mode", &["vr", "sr", "mixed", "mip", "minip", "xray", "mpr", "orthogonal", "tomography", "cube"]),
    ("layout", &["single", "four", "pair"]),
    ("volume.shading", &["none", "depth-coded", "first-hit"]),
    ("volume.compositing", &["riemann", "corrected", "pre-integrated", "exponential"]),
    ("volume.transfer", &["grey", "bone", "warm", "[{at=0,colour=[0,0,0],opacity=0},{at=1,colour=[1,0,2],opacity=1}]"]),
    ("volume.colour", &["warm", "skin"]),
    ("volume.opacity", &["bone", "sepia"]),
    ("volume.threshold", &["0", "0.3", "1"]),
    ("volume.window", &["[0,1]", "[-3,0.2]", "[0.9,0.1]"]),
    ("volume.veil", &["0", "0.5"]),
    ("surface.detector", &["threshold", "adaptive", "lasting", "consistent"]),
    ("surface.threshold", &["1e-6", "0.1", "1"]),
    ("surface.rough", &["1", "3", "8"]),
    ("surface.number", &["1", "2", "8"]),
    ("surface.sign", &["bright", "dark", "any"]),
    ("surface.place", &["peak", "middle", "first-crossing"]),
    ("surface.edge", &["0.5", "3", "40", "samples"]),
    ("surface.colour", &["rendered", "behind"]),
    ("surface.colour_depth", &["0.01", "1000"]),
    ("light.volume", &["{cell=5}", "{cell=3,back=0,scatter=0,ground={}}", "{cell=9,taps=4,widening=2}", "{cell=0}"]),
    ("light.follows", &["region"]),
    ("region.fade", &["6", "100"]),
    ("volume.extinction", &["0.5", "1000"]),
    ("light.shadow", &["{}", "{dims='pixel'}"]),
    ("surface.start_depth", &["0", "10", "400"]),
    ("volume.start_depth", &["0", "10"]),
    ("projection.start_depth", &["5"]),
    ("slices.median", &["true"]),
    ("slices.blur", &["true"]),
    ("slices.still", &["true"]),
    ("slices.everything", &["true"]),
    ("slices.estimator", &["median", "perona-malik", "gradient-inverse", "nagao-matsuyama"]),
    ("slices.sigma", &["{}", "{window=9,sigma=inf}", "{noise='multiplicative'}", "{window=4}"]),
    ("slices.enhanced_sigma", &["{window=3,largest=7}", "{window=3,largest=7,growth=true}", "{centre='median'}"]),
    ("slices.perona_malik", &["{}", "{scheme='aos',step=1e6}", "{repeat=3,edge=0}", "{step=0.3}"]),
    ("slices.smooth", &["{lateral=1}", "{kernel=5}", "{elevation=2,depth=1}", "{lateral=900}"]),
    ("slices.smooth.elevation_mm", &["0", "1.5", "900"]),
    ("slices.sigma.window_mm", &["0.01", "2", "500"]),
    ("slices.perona_malik.width_mm", &["0.01", "1"]),
    ("conditioning.low_pass_mm", &["0", "1.5", "500"]),
    ("distance.median_mm", &["0.01", "3", "500"]),
    ("distance.bilateral.mm", &["0.01", "1", "500"]),
    ("distance.enhanced_sigma.largest_mm", &["0.01", "4"]),
    ("slices.format", &["r8", "r16", "r16f", "r32f"]),
    ("conditioning", &["{samples=16}", "{dynamic_range=60,low_pass=2}", "{tgc=[{depth=5,gain=-3}]}"]),
    ("region.depth", &["[5,20]", "[20,5]", "[1e5,2e5]"]),
    ("region.lateral", &["[-2,2]", "[0,1e-9]"]),
    ("clip", &["[{at=[0,20,0],normal=[0,0,1]}]", "[{at=[1e6,0,0],normal=[1,1,0]}]", "[{at=[0,0,0],normal=[0,0,0]}]"]),
    ("camera.azimuth", &["90", "-33"]),
    ("camera.elevation", &["90", "12"]),
    ("camera.field_of_view", &["0.5", "1", "30", "150"]),
    ("camera.zoom", &["1e-3", "0.5", "1e3"]),
    ("camera.target", &["[0,20,0]", "[1e6,0,-1e6]"]),
    ("ray.step", &["0.5", "2", "1e3"]),
    ("ray.sampling", &["auto", "hardware", "exact", "quads"]),
    ("ray.elevation", &["linear", "bspline", "bspline-sharp"]),
    ("ray.rays", &["2", "3"]),
    ("ray.adaptive", &["true"]),
    ("ray.tolerance", &["0.01", "1", "64"]),
    ("ray.subsampling", &["2", "4", "8"]),
    ("ray.spread", &["0.5", "1"]),
    ("ray.sliding", &["3", "5"]),
    ("ray.entries", &["2", "65536"]),
    ("ray.slice_index", &["auto", "table"]),
    ("ray.brick", &["0", "4", "8", "64"]),
    ("ray.early_end", &["0", "1"]),
    ("planes.plane", &["a", "b", "c"]),
    ("planes.slab", &["mean", "max", "min"]),
    ("planes.thickness", &["0", "3", "1e3"]),
    ("planes.position", &["[0,20,0]", "[0,1e6,0]"]),
    ("planes.columns", &["1", "8", "64"]),
    ("planes.rows", &["1", "8"]),
    ("planes.spacing", &["1e-3", "2"]),
    ("planes.tilt", &["12", "90"]),
    ("planes.zoom", &["0.1", "30"]),
    ("cube.inset.bottom", &["3", "1e3"]),
    ("cube.tilt.near", &["[0,12]", "[80,80]"]),
    ("cube.edges", &["true", "false"]),
    (
        "distance",
        &[
            "{median=3}",
            "{sigma={},enhanced_sigma={window=3,largest=5}}",
            "{bilateral={mm=1,distance=2},perona_malik={}}",
        ],
    ),
    ("light.position", &["[0,0,0]", "[5,-10,45]"]),
    ("light.direction", &["[0,0,-1]", "[1,0,0]"]),
    ("light.shadow", &["{}", "{softness=0,reach=1e4}"]),
    ("light.occlusion", &["{}", "{radius=1e3,strength=4}"]),
    ("light.skin", &["{}", "{wrap=1,depth=100}"]),
    ("light.shininess", &["0", "1e6"]),
    (
        "post",
        &["{sigma={}}", "{enhanced_sigma={window=3,largest=5}}", "{perona_malik={scheme='aos'}}", "{floats=true}"],
    ),
    ("post.colour_map", &["grey", "ice"]),
    ("post.gamma", &["0.1", "10"]),
    ("post.contrast", &["0", "10"]),
];
/// Values for any setting: almost all of them are invalid.
const WRONG: [&str; 10] = ["nan", "-1", "0", "1e308", "inf", "true", "nonsense", "[]", "{}", "[-1e308,1e308,nan]"];
const SIZES: [&str; 5] = ["[1,1]", "[7,3]", "[24,24]", "[33,40]", "[64,48]"];

fn of_environment(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|value| value.parse().expect(name))
}

fn one_of<'a, T: ?Sized>(noise: &mut Noise, all: &[&'a T]) -> &'a T {
    all[noise.range(0.0, all.len() as f64) as usize]
}

fn geometries() -> Vec<Geometry> {
    let mut moving = wobbler();
    moving.advance = Advance::Same(0.02);
    let sweeps = [wobbler(), moving, uneven(wobbler()), linear(), still(), radial()];
    sweeps.into_iter().map(Geometry::Sweep).chain([cartesian([20, 22, 18])]).collect()
}

/// Random settings, and how many of them were refused.
fn settings(noise: &mut Noise) -> (Layers, u32) {
    let (mut layers, mut refused) = (Layers::default(), 0);
    if noise.next() < 0.25 {
        let names: Vec<&str> = PRESETS.iter().map(|preset| preset.0).collect();
        layers.preset(one_of(noise, &names)).expect("a preset");
    }
    for _ in 0..noise.range(0.0, 12.0) as u32 {
        let (key, values) = SETTINGS[noise.range(0.0, SETTINGS.len() as f64) as usize];
        let value = if noise.next() < 0.1 { one_of(noise, &WRONG) } else { one_of(noise, values) };
        // A refused setting may have changed the layers: the command line ends there, too.
        let mut next = layers.clone();
        match next.set(&format!("{key}={value}")) {
            Ok(()) => layers = next,
            Err(error) => {
                refused += 1;
                assert_eq!(error.to_string().lines().count(), 1, "{key}={value}: {error}");
            }
        }
    }
    let small = [format!("picture.size={}", one_of(noise, &SIZES)), "slices.pixels=32".into()];
    small.iter().for_each(|set| layers.set(set).expect("a size"));
    (layers, refused)
}

/// The layers of 1.3.239 ignore timeline semaphores: where a buffer reuses the memory of another, they do not see that the host
/// has waited for its writer. Hazards within one submission are reported correctly.
fn is_blind(message: &str, is_changed: bool) -> bool {
    let is_over = is_changed || message.contains("(destroyed)");
    is_over && message.contains("SYNC-HAZARD") && message.contains("vkQueueSubmit2")
}

/// Says what to do again when a test fails.
struct Told(u64, u64, String);

impl Drop for Told {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("SCENE_SEED={} failed at scene {}:\n{}", self.0, self.1, self.2);
        }
    }
}

/// Prevents panics, validation messages and invalid pictures, whatever the settings. SCENE_SECONDS continues for longer,
/// SCENE_SEED chooses other scenes.
#[test]
fn any_scene_is_drawn_or_refused_in_one_line_and_validation_is_silent() {
    let (seed, seconds) = (of_environment("SCENE_SEED").unwrap_or(1), of_environment("SCENE_SECONDS"));
    let (mut noise, mut device, geometries, began) = (Noise(seed), Device::alone(), geometries(), Instant::now());
    // Messages are checked below, scene by scene.
    device.provoked = true;
    let mut told_by_validation = 0;
    let mut told = Told(seed, 0, String::new());
    let (mut renderer, mut drawn, mut refused, mut changed): (Option<Renderer>, _, _, _) = (None, 0u32, 0u32, 0u32);
    while seconds.map_or(told.1 < SCENES, |most| began.elapsed().as_secs() < most) {
        told.1 += 1;
        let (layers, wrong) = settings(&mut noise);
        refused += wrong;
        let settings = layers.finish().expect("every layer was checked");
        told.2 = format!("{settings:?}");
        // Often the same volume: the existing renderer changes its scene then.
        let there = renderer.take().filter(|_| noise.next() < 0.6);
        let (geometry, input) = match &there {
            Some(renderer) => (renderer.scene().geometry.clone(), renderer.scene().input),
            None => {
                let geometry = &geometries[noise.range(0.0, geometries.len() as f64) as usize];
                (geometry.clone(), if noise.next() < 0.5 { BYTES } else { FLOATS })
            }
        };
        let scene = match Scene::new(geometry, input, settings) {
            Ok(scene) => scene,
            Err(error) => {
                refused += 1;
                assert_eq!(error.to_string().lines().count(), 1, "{error}");
                renderer = there;
                continue;
            }
        };
        let [width, height] = scene.settings.picture.size;
        let is_changed = there.is_some();
        let mut now = match there {
            Some(mut there) => {
                changed += 1;
                there.change(scene).expect("a scene that was checked");
                there
            }
            None => Renderer::new(&device, scene, &RendererOptions::default()).expect("a scene that was checked"),
        };
        let frames =
            frames(now.scene(), |[x, y, k]| 0.5 + 0.5 * (0.7 * (x + 2 * k) as f64).sin() * (0.2 * y as f64).cos());
        send(&mut now, &frames, 0);
        let picture = now.picture().expect("a picture");
        assert_eq!((picture.width, picture.height), (width, height));
        drawn += 1;
        let messages = device.messages();
        let said = messages.iter().skip(told_by_validation).find(|message| !is_blind(message, is_changed));
        assert_eq!(said, None, "validation");
        told_by_validation = messages.len();
        renderer = Some(now);
    }
    println!(
        "{drawn} drawn, {changed} of them after another, {refused} refusals, {:.1} s",
        began.elapsed().as_secs_f64()
    );
    assert!(seconds.is_some() || (drawn > 15 && changed > 5 && refused > 8), "{drawn}, {changed}, {refused}");
}
