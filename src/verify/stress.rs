//! Minutes of everything at once on one device: scenes, sizes and modes change, frames arrive, renderers are made and dropped. Pictures
//! are held against a fresh renderer's now and then, and at the end nothing is left.

use super::built_in::{self, Noise};
use super::failing::{count, returned};
use super::isolated_context::IsolatedContext;
use super::repeats::{counted, same};
use super::{Bench, Check, Found, drawn};
use crate::files::signals;
use crate::gpu::{Context, GpuError, Renderer, RendererOptions, TexelAccess};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::plan::{Plan, Rerun};
use crate::scene::Scene;
use crate::verify::report::{Figure, Level};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// s of a quick run, and of a full one unless another time is asked for.
const SECONDS: [f64; 2] = [3.0, 180.0];

/// Most renderers at once.
const MOST: usize = 3;

/// Pictures that are compared at least, however short the time is.
const COMPARED: usize = 4;

/// Volumes that are sent.
const VOLUMES: u32 = 4;

pub fn checks(level: Level) -> Vec<Check> {
    vec![check(SECONDS[usize::from(level == Level::Full)])]
}

/// A stress of so many seconds.
pub fn check(seconds: f64) -> Check {
    Check::new("stress", "everything at once", move |bench: &mut Bench| stress(bench, seconds, &|_, _| Ok(())))
}

/// Done to a renderer and its volume image before each picture.
pub type Spoil = dyn Fn(&mut Renderer, u32) -> Result<(), GpuError>;

/// Every mode in several sizes, with all filters and with few; all take the same frames.
fn scenes() -> Result<Vec<Scene>, String> {
    let mut scenes = Vec::new();
    for (n, asked) in built_in::modes().iter().enumerate() {
        let scene = asked.make()?;
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

/// A renderer, and what it should show.
struct Lived {
    renderer: Renderer,
    scene: usize,
    /// The volume that each image holds.
    holds: Vec<Option<u32>>,
    been: BTreeSet<usize>,
}

/// All that is sent and drawn, and what was counted of it.
struct Stress<'a> {
    context: &'a Arc<Context>,
    spoil: &'a Spoil,
    scenes: Vec<Scene>,
    volumes: Vec<Vec<Texels>>,
    noise: Noise,
    lived: Vec<Lived>,
    made: usize,
    pictures: usize,
    compared: usize,
    wrong: usize,
    /// Pipelines that may have been made.
    pipelines: usize,
}

/// # Errors
/// A device that fails.
pub fn stress(bench: &mut Bench, seconds: f64, spoil: &Spoil) -> Result<Found, GpuError> {
    let (mut found, aside) = (Found::default(), IsolatedContext::of_changes(bench)?);
    let context = &aside.context;
    let (held, pipelines) = (context.allocated(), || context.counts.pipelines.load(Ordering::Relaxed));
    let (before, begun) = (pipelines(), Instant::now());
    let scenes = scenes().map_err(GpuError::Broken)?;
    let volumes = scenes.first().map(|scene| (0..VOLUMES).map(|n| built_in::wall(scene, n)).collect());
    let mut stress = Stress {
        context,
        spoil,
        scenes,
        volumes: volumes.unwrap_or_default(),
        noise: Noise(41),
        lived: Vec::new(),
        made: 0,
        pictures: 0,
        compared: 0,
        wrong: 0,
        pipelines: 0,
    };
    let goes_on = |stress: &Stress| begun.elapsed().as_secs_f64() < seconds || stress.compared < COMPARED;
    // Minutes are too long for whoever waits for its end.
    while goes_on(&stress) && found.faults.len() < 8 && signals::received().is_none() {
        stress.step(&mut found)?;
    }
    found.left_out = signals::received().map(|signal| format!("not to its end: {signal}"));
    let (made, most) = ((pipelines() - before) as usize, stress.pipelines);
    found.expect(made <= most, || format!("{made} pipelines were made, {most} different ones were needed"));
    let done = [("pictures", stress.pictures), ("renderers", stress.made), ("pipelines", made)];
    found.figures.extend(done.map(|(what, n)| Figure { fleeting: true, ..count(what, n) }));
    counted(&mut found, stress.compared, stress.wrong);
    drop(stress);
    returned(&mut found, context, held, "all renderers are gone");
    aside.tell(&mut found);
    Ok(found)
}

impl Stress<'_> {
    fn pick(&mut self, n: usize) -> usize {
        ((self.noise.next() * n as f64) as usize).min(n.saturating_sub(1))
    }

    fn step(&mut self, found: &mut Found) -> Result<(), GpuError> {
        if self.lived.is_empty() || self.noise.next() < 0.06 {
            self.renew()?;
        }
        let at = self.pick(self.lived.len());
        match self.pick(8) {
            0 | 1 => self.change(at),
            2 => self.send_some(at),
            _ => self.draw(at, found),
        }
    }

    /// Another renderer, instead of one of the old where there are enough.
    fn renew(&mut self) -> Result<(), GpuError> {
        if self.lived.len() >= MOST {
            let gone = self.pick(MOST);
            self.lived.swap_remove(gone);
        }
        let (images, scene) = (1 + self.pick(3), self.pick(self.scenes.len()));
        let fetch = [None, Some(TexelAccess::Textures), Some(TexelAccess::Storage)][self.pick(3)];
        let options =
            RendererOptions { volume_images: images as u32, texel_access: fetch, ..RendererOptions::default() };
        let renderer = Renderer::new(self.context, self.scenes[scene].clone(), &options)?;
        let lived = Lived { renderer, scene, holds: vec![None; images], been: BTreeSet::new() };
        self.made += 1;
        self.lived.push(lived);
        self.counts(self.lived.len() - 1);
        Ok(())
    }

    /// What its scene may make it compile, once.
    fn counts(&mut self, at: usize) {
        let scene = self.lived[at].scene;
        if self.lived[at].been.insert(scene) {
            self.pipelines += Plan::new(self.lived[at].renderer.scene()).steps.len();
        }
    }

    fn change(&mut self, at: usize) -> Result<(), GpuError> {
        let scene = self.pick(self.scenes.len());
        let lived = &mut self.lived[at];
        let rerun = lived.renderer.change(self.scenes[scene].clone())?;
        if !matches!(rerun, Rerun::Steps { .. }) {
            lived.holds.fill(None);
        }
        lived.scene = scene;
        self.counts(at);
        Ok(())
    }

    /// A part of a volume, of which nothing is shown before the rest has come.
    fn send_some(&mut self, at: usize) -> Result<(), GpuError> {
        let (volume, image) = (self.pick(self.volumes.len()), self.pick(self.lived[at].holds.len()));
        let (lived, frames) = (&mut self.lived[at], &self.volumes[volume]);
        let format = Slot::Frames.format(lived.renderer.scene());
        lived.holds[image] = None;
        for (k, frame) in frames.iter().enumerate().skip(volume) {
            lived.renderer.frame(k as u32, &frame.encode(format), image as u32)?;
        }
        Ok(())
    }

    fn send(&mut self, at: usize, image: usize) -> Result<u32, GpuError> {
        let volume = self.pick(self.volumes.len());
        let (lived, frames) = (&mut self.lived[at], &self.volumes[volume]);
        let format = Slot::Frames.format(lived.renderer.scene());
        for (k, frame) in frames.iter().enumerate() {
            lived.renderer.frame(k as u32, &frame.encode(format), image as u32)?;
        }
        lived.holds[image] = Some(volume as u32);
        Ok(volume as u32)
    }

    fn draw(&mut self, at: usize, found: &mut Found) -> Result<(), GpuError> {
        let images = self.lived[at].holds.len();
        let image = self.pick(images);
        let volume = match self.lived[at].holds[image] {
            Some(volume) => volume,
            None => self.send(at, image)?,
        };
        (self.spoil)(&mut self.lived[at].renderer, image as u32)?;
        self.lived[at].renderer.show(image as u32)?;
        self.lived[at].renderer.begin_picture()?;
        // The next volume, beside the picture.
        if images > 1 && self.noise.next() < 0.5 {
            self.send(at, (image + 1) % images)?;
        }
        let picture = self.lived[at].renderer.end_picture()?;
        self.pictures += 1;
        if self.pictures.is_multiple_of(4) {
            self.compare(found, at, volume, &picture)?;
        }
        Ok(())
    }

    fn compare(&mut self, found: &mut Found, at: usize, volume: u32, picture: &Picture) -> Result<(), GpuError> {
        let scene = &self.scenes[self.lived[at].scene];
        let fresh = drawn::picture(self.context, scene, &self.volumes[volume as usize])?;
        self.made += 1;
        self.pipelines += Plan::new(scene).steps.len();
        self.compared += 1;
        let what = format!("picture {}, mode {:?}", self.pictures, scene.settings.mode);
        self.wrong += usize::from(!same(found, &what, &fresh, picture));
        Ok(())
    }
}
