//! A device with validation on, scenes, and noise that is the same everywhere.

use echolume::gpu::{Choice, Context, ContextOptions, Options, Renderer};
use echolume::passes::slots::Format;
use echolume::passes::{Slot, Texels, is_hit};
use echolume::picture::Picture;
use echolume::probe::{Advance, Array, Axis, Geometry, Grid, Motion, Probe};
use echolume::scene::{Input, Scene, Settings};
use echolume::source::StoredType;
use std::ops::Deref;
use std::path::PathBuf;
use std::sync::Arc;

/// A context that fails its test if validation said anything.
pub struct Device {
    context: Arc<Context>,
    /// Messages were asked for.
    pub provoked: bool,
}

impl Device {
    pub fn new() -> Device {
        Device::watched(true)
    }

    /// Without validation where not watched: its layers keep something of all that was ever made.
    pub fn watched(validation: bool) -> Device {
        // ECHOLUME_DEVICE picks another device than the first that fits.
        let device = std::env::var("ECHOLUME_DEVICE").map_or(Choice::Best, |name| name.parse().unwrap());
        let context = Context::new(&ContextOptions { device, validation }).expect("a Vulkan device");
        Device { context, provoked: false }
    }

    /// Looked at with `--nocapture`: which device and driver the tests ran on.
    pub fn describe(&self) -> String {
        format!("{}, {}", self.context.candidate.name, self.context.candidate.driver.trim())
    }
}

impl Deref for Device {
    type Target = Arc<Context>;
    fn deref(&self) -> &Arc<Context> {
        &self.context
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let messages = self.context.messages();
        if !std::thread::panicking() && !self.provoked {
            // The first says it; a flood of the same hides it.
            assert!(messages.is_empty(), "{} messages of validation, first: {}", messages.len(), messages[0]);
        }
    }
}

/// Numbers in 0..1 that are the same on every machine (SplitMix64).
pub struct Noise(pub u64);

impl Noise {
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

pub fn data(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(file)
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

/// A scene from TOML.
pub fn scene(geometry: Geometry, input: Input, toml: &str) -> Scene {
    let settings: Settings = toml::from_str(toml).expect("settings");
    Scene::new(geometry, input, settings).expect("scene")
}

/// Frames of a volume as their textures yield them, from a function of the frame's texel and slice.
pub fn frames(scene: &Scene, f: impl Fn([usize; 3]) -> f64) -> Vec<Texels> {
    let [width, height] = scene.frame_size().map(|n| n as usize);
    let one = |k| Texels::from_fn([width, height, 1], 1, |[x, y, _], _| f([x, y, k]));
    (0..scene.slices() as usize).map(one).collect()
}

/// Frames of a sweep that show a body: a function of space.
pub fn body_frames(scene: &Scene, body: impl Fn(glam::DVec3) -> f64) -> Vec<Texels> {
    let place = |[i, j, k]: [usize; 3]| match &scene.geometry {
        Geometry::Sweep(probe) => {
            probe.to_space(echolume::probe::Indices { sample: i as f64, line: j as f64, slice: k as f64 })
        }
        Geometry::Cartesian(grid) => {
            let at = [i, j, k];
            glam::DVec3::from_array(std::array::from_fn(|a| grid.origin[a] + grid.spacing[a] * at[a] as f64))
        }
    };
    frames(scene, |at| body(place(at)))
}

pub fn frame_format(scene: &Scene) -> Format {
    Slot::Frames.format(scene)
}

/// A renderer with the frames sent.
pub fn rendered(device: &Device, scene: Scene, frames: &[Texels]) -> Renderer {
    let mut renderer = Renderer::new(device, scene, &Options::default()).expect("renderer");
    send(&mut renderer, frames, 0);
    renderer
}

pub fn send(renderer: &mut Renderer, frames: &[Texels], image: u32) {
    let format = frame_format(renderer.scene());
    for (k, frame) in frames.iter().enumerate() {
        renderer.frame(k as u32, &frame.encode(format), image).expect("frame");
    }
    renderer.show(image).expect("show");
}

/// Mean and largest difference of two pictures, levels of 255.
pub fn difference(a: &Picture, b: &Picture) -> (f64, f64) {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let differences = a.rgba.iter().zip(&b.rgba).map(|(a, b)| f64::from(a.abs_diff(*b)));
    let (sum, largest) = differences.fold((0.0, 0.0f64), |(sum, largest), d| (sum + d, largest.max(d)));
    (sum / a.rgba.len() as f64, largest)
}

/// A slot of the f64 render as a picture.
pub fn as_picture(texels: &Texels) -> Picture {
    let rgba = texels.encode(Format::Rgba8);
    Picture { width: texels.size[0] as u32, height: texels.size[1] as u32, rgba }
}

/// Rays that meet a sphere within 0.8 of its radius (further out the chord is shorter than the detector's ring), and the
/// largest error of their distances, mm. A hole fails.
pub fn sphere_error(scene: &Scene, distances: &Texels, centre: glam::DVec3, radius: f64) -> (u32, f64) {
    let (mut hits, mut worst) = (0, 0.0f64);
    for y in 0..distances.size[1] {
        for x in 0..distances.size[0] {
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let along = (centre - origin).dot(direction);
            let offset = (origin + direction * along).distance(centre);
            if offset > 0.8 * radius {
                continue;
            }
            let got = distances.one(x, y, 0);
            assert!(is_hit(got), "a hole at {x}, {y}");
            worst = worst.max((got - along + (radius * radius - offset * offset).sqrt()).abs());
            hits += 1;
        }
    }
    (hits, worst)
}
