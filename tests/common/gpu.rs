//! A device with validation on, scenes, and noise that is the same everywhere.

use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::gpu::{Context, ContextOptions, Deadline, DeviceChoice, Renderer, RendererOptions};
use echolume::low_level::passes::slots::Format;
use echolume::low_level::passes::{Slot, Texels, is_hit};
use echolume::low_level::picture::Picture;
use echolume::low_level::scene::{Scene, WindowTexels, insonified_box};
use echolume::low_level::verify::built_in;
use glam::DVec3;
use std::ops::Deref;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::figures::figure;
pub use super::files::*;
pub use super::probes::wobbler;
pub use super::scenes::{BYTES, FLOATS, scene};
pub use echolume::low_level::verify::built_in::{
    ALL_FILTERS, Noise, TURNED, body_frames, cartesian, frames, geometries, linear, radial, still, uneven,
};

/// A context that fails its test if validation reported anything.
pub struct Device {
    context: Arc<Context>,
    /// The test expects messages.
    pub provoked: bool,
    /// Holds the pipelines of all renderers of this context; `None` if no other test is to have it.
    runner: Option<PassRunner>,
}

/// Contexts that no test uses now, with the pipelines that earlier tests needed: most of the time of a test was spent on compiling them.
static IDLE: Mutex<Vec<(Arc<Context>, PassRunner)>> = Mutex::new(Vec::new());

/// ECHOLUME_DEVICE picks another device than the first that fits.
pub fn chosen() -> DeviceChoice {
    std::env::var("ECHOLUME_DEVICE").map_or(DeviceChoice::Best, |name| name.parse().expect("a device"))
}

impl Device {
    /// One that an earlier test may have used: for tests that only draw.
    pub fn new() -> Device {
        let idle = IDLE.lock().unwrap_or_else(|e| e.into_inner()).pop();
        if let Some((context, runner)) = idle {
            return Device { context, provoked: false, runner: Some(runner) };
        }
        // A pipeline takes 5 MiB on lavapipe with validation: those of all tests took 10 GiB.
        let shared =
            ContextOptions { specialize: Some(true), max_unused_pipelines: Some(64), ..ContextOptions::default() };
        let mut device = Device::watched_with(shared);
        device.runner = Some(PassRunner::new(&device).expect("a runner of passes"));
        device
    }

    /// One of its own: for tests that inject faults, expect messages, or count.
    pub fn alone() -> Device {
        Device::watched(true)
    }

    /// `validation` false switches the layers off: they keep some memory for every object ever created.
    pub fn watched(validation: bool) -> Device {
        Device::opened(ContextOptions {
            validation,
            specialize: validation.then_some(true),
            ..ContextOptions::default()
        })
    }

    /// One of its own with options of its own, and validation.
    pub fn watched_with(options: ContextOptions) -> Device {
        Device::opened(ContextOptions { validation: true, ..options })
    }

    /// One of its own, with these options.
    pub fn opened(options: ContextOptions) -> Device {
        let context = Context::new(&ContextOptions { device: chosen(), ..options }).expect("a Vulkan device");
        Device { context, provoked: false, runner: None }
    }

    /// One that is given up if it does not finish within two seconds, also in software. That is far more than a small picture takes.
    pub fn impatient() -> Device {
        let deadline = Deadline::After(Duration::from_secs(2));
        Device::watched_with(ContextOptions { deadline, ..ContextOptions::default() })
    }

    /// States a figure of docs/validation.md ([`figure`]). The page has those of a software device: on others nothing is compared.
    pub fn figure(&self, name: &str, measured: &str) {
        if self.context.candidate.is_software() {
            figure(name, measured);
        }
    }

    /// The device and driver, for output with `--nocapture`.
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
            // One message is enough; many of the same would hide it.
            assert!(messages.is_empty(), "{} messages of validation, first: {}", messages.len(), messages[0]);
        }
        if let Some(runner) = self.runner.take().filter(|_| !std::thread::panicking()) {
            assert!(!self.provoked, "a test that expects messages needs a device alone");
            let window = *self.context.window_texels.lock().unwrap_or_else(|e| e.into_inner());
            assert_eq!(window, WindowTexels::Rgba8, "a test that changes its device needs one alone");
            IDLE.lock().unwrap_or_else(|e| e.into_inner()).push((self.context.clone(), runner));
        }
    }
}

/// True if values are the same bit for bit on a software device, where each operation is rounded by itself. The compiler of a GPU makes one operation of
/// a product and a sum in one shader and not in another, and its filter rounds weights to 8 bits: there all but 1 % may differ by `tolerance` at
/// most, and the others by anything, as a threshold then decides otherwise now and then.
pub fn same_values<T: Copy + Into<f64>>(device: &Device, a: &[T], b: &[T], tolerance: f64) -> bool {
    let pairs = || a.iter().zip(b).map(|(a, b)| ((*a).into(), (*b).into()));
    let is_same = |a: f64, b: f64| a.to_bits() == b.to_bits();
    if a.len() != b.len() || device.candidate.is_software() {
        return a.len() == b.len() && pairs().all(|(a, b)| is_same(a, b));
    }
    let is_near = |a: f64, b: f64| is_same(a, b) || (a - b).abs() <= tolerance;
    let far = pairs().filter(|(a, b)| !is_near(*a, *b)).count();
    if far > 0 {
        println!("{far} of {} values differ by more than {tolerance}", a.len());
    }
    far * 100 <= a.len().max(200)
}

/// Levels of 255 that pictures, and mm that distances on GPUs may differ by.
pub const GPU_LEVELS: f64 = 1.0;
pub const GPU_MM: f64 = 1e-3;

/// The same for pictures.
pub fn same_picture(device: &Device, a: &Picture, b: &Picture) -> bool {
    [a.width, a.height] == [b.width, b.height] && same_values(device, &a.rgba, &b.rgba, GPU_LEVELS)
}

/// The same for slots, which both pictures have or both lack.
pub fn same_slot(device: &Device, a: &Option<Texels>, b: &Option<Texels>, tolerance: f64) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.size == b.size && same_values(device, &a.values, &b.values, tolerance),
        (a, b) => a.is_none() && b.is_none(),
    }
}

/// Scenes by name that together need every pass.
pub fn scenes() -> Vec<(String, Scene)> {
    built_in::scenes(built_in::gpu()).expect("scenes")
}

pub fn frame_format(scene: &Scene) -> Format {
    Slot::Frames.format(scene)
}

/// A renderer that has received these frames.
pub fn rendered(device: &Device, scene: Scene, frames: &[Texels]) -> Renderer {
    let mut renderer = Renderer::new(device, scene, &RendererOptions::default()).expect("renderer");
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

/// A wall, fluid and tissue, by the share of the depth.
pub fn layers(scene: &Scene) -> impl Fn(DVec3) -> f64 + use<> {
    let (low, high) = insonified_box(&scene.geometry);
    move |p| match (p.y - low.y) / (high.y - low.y) + 0.05 * (0.3 * p.x).sin() {
        share if share < 0.35 => 0.6,
        share if share < 0.65 => 0.1,
        _ => 0.8,
    }
}
