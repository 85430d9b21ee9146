//! Inputs that are part of the program: probes, scenes, bodies and noise, the same on every machine. Tests use them too.

mod modes;
mod planes;
mod scenes;

pub use modes::{modes, wall};
pub use planes::{TURNED, geometries};
pub use scenes::ALL_FILTERS;

use crate::passes::Texels;
use crate::probe::{Advance, Array, Axis, Geometry, Grid, Indices, Motion, Probe};
use crate::scene::{Input, Scene, Settings};
use crate::source::StoredType;
use glam::DVec3;

/// A scene that is not made yet.
#[derive(Clone)]
pub struct Asked {
    pub name: String,
    geometry: Geometry,
    input: Input,
    /// Settings.
    toml: String,
    /// With pictures of floats, whatever the settings say.
    floats: bool,
}

impl Asked {
    fn new(name: &str, geometry: &Geometry, input: Input, toml: String) -> Asked {
        Asked { name: name.into(), geometry: geometry.clone(), input, toml, floats: false }
    }

    /// # Errors
    /// Settings and program disagree.
    pub fn make(&self) -> Result<Scene, String> {
        let mut scene =
            scene(self.geometry.clone(), self.input, &self.toml).map_err(|e| format!("{}: {e}", self.name))?;
        scene.settings.post.floats |= self.floats;
        Ok(scene)
    }
}

/// Scenes that among them need every pass, in every variant of the geometry.
pub fn scenes() -> Vec<Asked> {
    let planes = planes::scenes();
    // Planes that are cut straight to 8 bits also the other way.
    let straight = planes.iter().filter(|asked| asked.make().is_ok_and(|scene| scene.tones_planes()));
    let in_floats =
        straight.map(|asked| Asked { name: format!("{}, in floats", asked.name), floats: true, ..asked.clone() });
    let in_floats: Vec<Asked> = in_floats.collect();
    scenes::scenes().into_iter().chain(planes).chain(in_floats).collect()
}

/// A scene from TOML.
///
/// # Errors
/// Settings that make no scene.
pub fn scene(geometry: Geometry, input: Input, toml: &str) -> Result<Scene, String> {
    let settings: Settings = toml::from_str(toml).map_err(|e| format!("settings: {}", e.message()))?;
    Scene::new(geometry, input, settings).map_err(|e| e.to_string())
}

/// Numbers in 0..1 that are the same on every machine (SplitMix64).
pub struct Noise(pub u64);

impl Noise {
    // No iterator: it has no end.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A small abdominal wobbler: 24 lines over 66 deg, 9 frames over 27 deg, 64 samples.
pub fn wobbler() -> Probe {
    Probe {
        array: Array::Curved { radius: 20.0 },
        lines: Axis::centred(0.05, 24),
        start_depth: 2.0,
        sample_pitch: 0.8,
        samples: 64,
        motion: Motion::Fan { wobble_radius: 12.0 },
        slices: Axis::centred(0.06, 9),
        advance: Advance::None,
        sound_speed: 1540.0,
    }
}

/// The same with frames at uneven angles.
pub fn uneven(mut probe: Probe) -> Probe {
    let at = |k: usize| probe.slices.at(k as f64) + 0.012 * (1.7 * k as f64).sin();
    probe.slices = Axis::from_table((0..probe.slices.len()).map(at).collect());
    probe
}

/// A linear array moved sideways.
pub fn linear() -> Probe {
    Probe {
        array: Array::Linear,
        lines: Axis::centred(1.1, 20),
        motion: Motion::Translated,
        slices: Axis::centred(1.5, 7),
        samples: 48,
        ..wobbler()
    }
}

pub fn still() -> Probe {
    Probe { motion: Motion::Still { thickness: 3.0 }, slices: Axis::centred(1.0, 1), ..wobbler() }
}

pub fn cartesian(size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { size, spacing: [0.5, 0.4, 0.9], origin: [-4.0, 1.0, -3.0] })
}

pub const BYTES: Input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
pub const FLOATS: Input = Input { stored: StoredType::F32, range: [0.0, 1.0] };

/// Frames of a volume as their textures yield them, from a function of the frame's texel and slice.
pub fn frames(scene: &Scene, f: impl Fn([usize; 3]) -> f64) -> Vec<Texels> {
    let [width, height] = scene.frame_size().map(|n| n as usize);
    let one = |k| Texels::from_fn([width, height, 1], 1, |[x, y, _], _| f([x, y, k]));
    (0..scene.slices() as usize).map(one).collect()
}

/// Frames of a sweep that show a body: a function of space.
pub fn body_frames(scene: &Scene, body: impl Fn(DVec3) -> f64) -> Vec<Texels> {
    let place = |[i, j, k]: [usize; 3]| match &scene.geometry {
        Geometry::Sweep(probe) => probe.to_space(Indices { sample: i as f64, line: j as f64, slice: k as f64 }),
        Geometry::Cartesian(grid) => {
            let at = [i, j, k];
            DVec3::from_array(std::array::from_fn(|a| grid.origin[a] + grid.spacing[a] * at[a] as f64))
        }
    };
    frames(scene, |at| body(place(at)))
}
