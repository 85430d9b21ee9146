//! A small sweep of a wall, as from a recording.

use crate::common::gpu::Device;
use crate::common::probes::wobbler;
use crate::common::scenes::{self, FLOATS};
use echolume::low_level::probe::{Axis, Geometry, Indices, Probe};
use echolume::low_level::scene::{Scene, Settings};
use echolume::low_level::source::Frame;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Serialises the tests of this binary, because they measure time: every test holds this while it runs.
pub fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

pub fn device() -> Device {
    Device::watched(false)
}

pub fn probe() -> Probe {
    Probe {
        lines: Axis::centred(0.02, 60),
        sample_pitch: 0.4,
        samples: 128,
        slices: Axis::centred(0.04, 15),
        ..wobbler()
    }
}

pub fn scene(toml: &str) -> Scene {
    scenes::scene(Geometry::Sweep(probe()), FLOATS, toml)
}

pub fn scene_of(settings: Settings) -> Scene {
    Scene::new(Geometry::Sweep(probe()), FLOATS, settings).expect("scene")
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
            Frame::of_slice(0, slice, bytes)
        })
        .collect()
}
