//! Group "stress": random work on one device for some time. Scenes, sizes and modes change, frames arrive, and renderers are created and
//! dropped. Some pictures are compared with those of a new renderer, and at the end no memory may have leaked.

use super::built_in::{self, Noise};
use super::compare::{add_picture_counts, count_figure, expect_same_picture};
use super::failures::expect_memory_returned;
use super::{Check, DeviceUnderTest, Findings, IsolatedContext, render};
use crate::files::signals;
use crate::gpu::{Context, GpuError, Renderer, RendererOptions, TexelAccess};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::plan::{Plan, Rerun};
use crate::report::{Figure, Level};
use crate::scene::Scene;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Duration of a quick and a full run, s.
const SECONDS: [f64; 2] = [3.0, 180.0];

/// Maximum number of renderers at the same time.
const MAX_RENDERERS: usize = 3;

/// Minimum number of pictures compared.
const MIN_COMPARED: usize = 4;

/// Number of different volumes.
const VOLUMES: u32 = 4;

pub fn checks(level: Level) -> Vec<Check> {
    vec![check(SECONDS[usize::from(level == Level::Full)])]
}

/// The check that runs a stress test of `seconds` s. It runs longer until at least four pictures have been compared.
pub fn check(seconds: f64) -> Check {
    Check::new("stress", "everything at once", move |dut: &mut DeviceUnderTest| stress(dut, seconds, &|_, _| Ok(())))
}

/// A function that is called with the renderer and the index of the volume image before each picture; tests use it to cause errors.
pub(crate) type BeforePicture = dyn Fn(&mut Renderer, u32) -> Result<(), GpuError>;

/// Every mode in several sizes, with all filters and with few. All take the same frames.
fn scenes() -> Result<Vec<Scene>, String> {
    let mut scenes = Vec::new();
    for (n, spec) in built_in::modes().iter().enumerate() {
        let scene = spec.build()?;
        for (m, size) in [[37, 29], [8, 61], [96, 80]].into_iter().enumerate() {
            let mut settings = scene.settings.clone();
            settings.picture.size = size;
            if (n + m) % 2 == 1 {
                settings.slices.median = false;
                settings.slices.smooth = None;
                settings.post.sigma = None;
                settings.slices.pixels = 24;
            }
            scenes.push(Scene::new(scene.geometry.clone(), scene.input, settings).map_err(|e| e.to_string())?);
        }
    }
    Ok(scenes)
}

/// A renderer with its expected state.
struct RunningRenderer {
    renderer: Renderer,
    scene: usize,
    /// The volume in each image; None if incomplete.
    holds: Vec<Option<u32>>,
    compiled: BTreeSet<usize>,
}

/// State of the stress test.
struct Stress<'a> {
    context: &'a Arc<Context>,
    before_picture: &'a BeforePicture,
    scenes: Vec<Scene>,
    volumes: Vec<Vec<Texels>>,
    noise: Noise,
    running: Vec<RunningRenderer>,
    made: usize,
    pictures: usize,
    /// Upper bound of the pipelines created.
    pipelines: usize,
}

/// Runs the stress test for `seconds` s, or longer until at least four pictures have been compared. Eight faults or a signal end it early.
/// `before_picture` is called with the renderer and the index of the volume image before each picture.
///
/// # Errors
/// The device fails.
pub fn stress(dut: &mut DeviceUnderTest, seconds: f64, before_picture: &BeforePicture) -> Result<Findings, GpuError> {
    let (mut findings, isolated) = (Findings::default(), IsolatedContext::of_changes(dut)?);
    let context = &isolated.context;
    let (held, pipelines) = (context.allocated(), || context.counts.pipelines.load(Ordering::Relaxed));
    let (before, begun) = (pipelines(), Instant::now());
    let scenes = scenes().map_err(GpuError::Broken)?;
    let volumes = scenes.first().map(|scene| (0..VOLUMES).map(|n| built_in::wall(scene, n)).collect());
    let mut stress = Stress {
        context,
        before_picture,
        scenes,
        volumes: volumes.unwrap_or_default(),
        noise: Noise(41),
        running: Vec::new(),
        made: 0,
        pictures: 0,
        pipelines: 0,
    };
    let goes_on = |found: &Findings| begun.elapsed().as_secs_f64() < seconds || found.compared < MIN_COMPARED;
    // A signal ends it early.
    while goes_on(&findings) && findings.faults.len() < 8 && signals::received().is_none() {
        stress.step(&mut findings)?;
    }
    findings.interrupted = signals::received();
    let (made, most) = ((pipelines() - before) as usize, stress.pipelines);
    findings.expect(made <= most, || format!("{made} pipelines were made, {most} different ones were needed"));
    let done = [("pictures", stress.pictures), ("renderers", stress.made), ("pipelines", made)];
    findings.figures.extend(done.map(|(what, n)| Figure { fleeting: true, ..count_figure(what, n) }));
    add_picture_counts(&mut findings);
    drop(stress);
    expect_memory_returned(&mut findings, context, held, "all renderers are gone");
    isolated.report_validation(&mut findings);
    Ok(findings)
}

impl Stress<'_> {
    fn pick(&mut self, n: usize) -> usize {
        ((self.noise.next() * n as f64) as usize).min(n.saturating_sub(1))
    }

    fn step(&mut self, findings: &mut Findings) -> Result<(), GpuError> {
        if self.running.is_empty() || self.noise.next() < 0.06 {
            self.renew()?;
        }
        let at = self.pick(self.running.len());
        match self.pick(8) {
            0 | 1 => self.change(at),
            2 => self.send_some(at),
            _ => self.draw(at, findings),
        }
    }

    /// Creates a renderer; replaces one if there are enough.
    fn renew(&mut self) -> Result<(), GpuError> {
        if self.running.len() >= MAX_RENDERERS {
            let gone = self.pick(MAX_RENDERERS);
            self.running.swap_remove(gone);
        }
        let (images, scene) = (1 + self.pick(3), self.pick(self.scenes.len()));
        let fetch = [None, Some(TexelAccess::Textures), Some(TexelAccess::Storage)][self.pick(3)];
        let options =
            RendererOptions { volume_images: images as u32, texel_access: fetch, ..RendererOptions::default() };
        let renderer = Renderer::new(self.context, self.scenes[scene].clone(), &options)?;
        let running = RunningRenderer { renderer, scene, holds: vec![None; images], compiled: BTreeSet::new() };
        self.made += 1;
        self.running.push(running);
        self.counts(self.running.len() - 1);
        Ok(())
    }

    /// Counts the pipelines that its scene may compile, once per scene.
    fn counts(&mut self, at: usize) {
        let scene = self.running[at].scene;
        if self.running[at].compiled.insert(scene) {
            self.pipelines += Plan::new(self.running[at].renderer.scene()).steps.len();
        }
    }

    fn change(&mut self, at: usize) -> Result<(), GpuError> {
        let scene = self.pick(self.scenes.len());
        let running = &mut self.running[at];
        let rerun = running.renderer.change(self.scenes[scene].clone())?;
        if !matches!(rerun, Rerun::Steps { .. }) {
            running.holds.fill(None);
        }
        running.scene = scene;
        self.counts(at);
        Ok(())
    }

    /// Sends a part of a volume; its image is not shown until it is complete.
    fn send_some(&mut self, at: usize) -> Result<(), GpuError> {
        let (volume, image) = (self.pick(self.volumes.len()), self.pick(self.running[at].holds.len()));
        self.running[at].holds[image] = None;
        // How many frames are left out follows from the number of the volume.
        self.send_from(volume, at, volume, image)
    }

    fn send(&mut self, at: usize, image: usize) -> Result<u32, GpuError> {
        let volume = self.pick(self.volumes.len());
        self.send_from(0, at, volume, image)?;
        self.running[at].holds[image] = Some(volume as u32);
        Ok(volume as u32)
    }

    /// Sends the frames of a volume, from number `first` on, to an image of renderer `at`.
    fn send_from(&mut self, first: usize, at: usize, volume: usize, image: usize) -> Result<(), GpuError> {
        let renderer = &mut self.running[at].renderer;
        let format = Slot::Frames.format(renderer.scene());
        for (k, frame) in self.volumes[volume].iter().enumerate().skip(first) {
            renderer.frame(k as u32, &frame.encode(format), image as u32)?;
        }
        Ok(())
    }

    fn draw(&mut self, at: usize, findings: &mut Findings) -> Result<(), GpuError> {
        let images = self.running[at].holds.len();
        let image = self.pick(images);
        let volume = match self.running[at].holds[image] {
            Some(volume) => volume,
            None => self.send(at, image)?,
        };
        (self.before_picture)(&mut self.running[at].renderer, image as u32)?;
        self.running[at].renderer.show(image as u32)?;
        self.running[at].renderer.begin_picture()?;
        // Send the next volume while the picture is rendered.
        if images > 1 && self.noise.next() < 0.5 {
            self.send(at, (image + 1) % images)?;
        }
        let picture = self.running[at].renderer.end_picture()?;
        self.pictures += 1;
        if self.pictures.is_multiple_of(4) {
            self.compare(findings, at, volume, &picture)?;
        }
        Ok(())
    }

    fn compare(&mut self, findings: &mut Findings, at: usize, volume: u32, picture: &Picture) -> Result<(), GpuError> {
        let scene = &self.scenes[self.running[at].scene];
        let fresh = render::picture(self.context, scene, &self.volumes[volume as usize])?;
        self.made += 1;
        self.pipelines += Plan::new(scene).steps.len();
        let what = format!("picture {}, mode {:?}", self.pictures, scene.settings.mode);
        expect_same_picture(findings, &what, &fresh, picture);
        Ok(())
    }
}
