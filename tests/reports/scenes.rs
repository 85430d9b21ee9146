//! A small sweep of a wall, as a recording would give it.

use echolume::gpu::{Choice, Context, ContextOptions};
use echolume::probe::{Advance, Array, Axis, Geometry, Indices, Motion, Probe};
use echolume::scene::{Input, Scene, Settings};
use echolume::source::{Frame, StoredType};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What is timed here shares the machine with nothing else of this binary: every test holds this while it runs.
pub fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

pub fn device() -> Arc<Context> {
    Context::new(&ContextOptions { device: Choice::Best, validation: false }).expect("a device")
}

pub fn probe() -> Probe {
    Probe {
        array: Array::Curved { radius: 20.0 },
        lines: Axis::centred(0.02, 60),
        start_depth: 2.0,
        sample_pitch: 0.4,
        samples: 128,
        motion: Motion::Fan { wobble_radius: 12.0 },
        slices: Axis::centred(0.04, 15),
        advance: Advance::None,
        sound_speed: 1540.0,
    }
}

pub fn scene(toml: &str) -> Scene {
    scene_of(toml::from_str(toml).expect("settings"))
}

pub fn scene_of(settings: Settings) -> Scene {
    let input = Input { stored: StoredType::F32, range: [0.0, 1.0] };
    Scene::new(Geometry::Sweep(probe()), input, settings).expect("scene")
}

/// A bumpy wall behind fluid.
pub fn frames() -> Vec<Frame> {
    let probe = probe();
    let body = |p: glam::DVec3| {
        let wall = 48.0 + 1.5 * (0.3 * p.x).sin() * (0.25 * p.z).cos();
        0.1 + 0.7 * ((p.y - wall) / 3.0 + 0.5).clamp(0.0, 1.0)
    };
    let value = |sample: usize, line: usize, slice: usize| {
        let at = Indices { sample: sample as f64, line: line as f64, slice: slice as f64 };
        body(probe.to_space(at)) as f32
    };
    (0..15)
        .map(|slice| {
            let lines = (0..60).flat_map(|line| (0..128).map(move |sample| (sample, line)));
            let bytes = lines.flat_map(|(sample, line)| value(sample, line, slice).to_le_bytes()).collect();
            Frame { volume: 0, number: slice as u32, slice, backward: false, time: None, bytes }
        })
        .collect()
}
