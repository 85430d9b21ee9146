//! A scene on the device: rendered, timed and read back.

use super::{Time, Times};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions, TimeStamps};
use crate::passes::chain::distance_end;
use crate::passes::postprocess::toned;
use crate::passes::{Frequency, PASSES, PassTime, Slot, Texels};
use crate::reference;
use crate::scene::Scene;
use crate::source::Frame;
use std::sync::Arc;

/// What a scene renders: the picture before the toning of stage 4, and the distance map after its filters (None without one).
pub(super) struct Rendering {
    pub scene: Scene,
    pub picture: Texels,
    pub distance: Option<Texels>,
}

impl Rendering {
    /// Renders a scene by the references of its passes; `replace` may compute some of them instead.
    pub(crate) fn in_f64(scene: &Scene, frames: &[Frame], replace: &mut reference::Replacement) -> Rendering {
        let scene = in_floats(scene);
        let frames = reference::decoded(&scene, frames);
        let mut slots = reference::render_with(&scene, &frames, replace);
        let distance = if scene.has_distance() { slots.remove(&distance_end(&scene)) } else { None };
        let picture = slots.remove(&Slot::Picture).unwrap_or_else(|| Texels::untouched([0; 3], 4));
        Rendering { scene, picture, distance }
    }

    /// A picture after the toning of stage 4, as the screen shows it: values in 0..1, not rounded.
    pub fn toned(&self, picture: &Texels) -> Texels {
        let channels = picture.channels;
        let pixel = |p: &[f64]| match p {
            // Black where there is nothing.
            [_, _, _, alpha] if *alpha <= 0.0 => [0.0; 3],
            [r, g, b, ..] => toned(&self.scene, [*r, *g, *b]),
            _ => [0.0; 3],
        };
        let values = picture.values.chunks_exact(channels.max(1)).flat_map(pixel).collect();
        Texels { size: picture.size, channels: 3, values }
    }
}

/// A scene that runs on a device.
pub(super) struct Running<'a> {
    renderer: Renderer,
    frames: &'a [Frame],
    /// True for a device that can tell times.
    has_times: bool,
}

impl<'a> Running<'a> {
    /// Makes the renderer, and runs it once, so that its shaders are compiled.
    ///
    /// # Errors
    /// The device cannot hold the scene, or fails, or it has time stamps and the time of the volume or of the picture is missing.
    pub fn new(context: &Arc<Context>, frames: &'a [Frame], scene: &Scene) -> Result<Running<'a>, GpuError> {
        // A stamp at every pass: only so are the times of the volume and of the picture told apart.
        let options = RendererOptions { time_stamps: TimeStamps::EachPass, ..RendererOptions::default() };
        let renderer = Renderer::new(context, in_floats(scene), &options)?;
        let has_times = context.candidate.valid_bits() > 0;
        let mut running = Running { renderer, frames, has_times };
        running.run()?;
        Ok(running)
    }

    /// Sends the frames through stage 1 and renders a picture. Returns the GPU times [volume, picture], ns. None if the device has no time stamps.
    ///
    /// # Errors
    /// The device fails, or it has time stamps and the time of the volume or of the picture is missing.
    pub fn run(&mut self) -> Result<Option<[f64; 2]>, GpuError> {
        self.renderer.volume(self.frames)?;
        self.renderer.picture()?;
        let taken = self.renderer.take_times()?;
        if !self.has_times {
            return Ok(None);
        }
        let times = split(&taken);
        match times.iter().all(|time| time.is_finite() && *time > 0.0) {
            true => Ok(Some(times)),
            false => Err(GpuError::Broken(format!(
                "the times of volume and picture are {} and {} ns, of {} passes",
                times[0],
                times[1],
                taken.len()
            ))),
        }
    }

    pub fn read(&mut self) -> Result<Rendering, GpuError> {
        let scene = self.renderer.scene().clone();
        let missing = || GpuError::Broken("the plan has no picture".into());
        let picture = self.renderer.read(Slot::Picture)?.ok_or_else(missing)?;
        let distance = match scene.has_distance() {
            true => self.renderer.read(distance_end(&scene))?,
            false => None,
        };
        Ok(Rendering { scene, picture, distance })
    }
}

/// The times of the volume and of the picture: of passes that run for each frame or volume, and for each picture.
fn split(taken: &[PassTime]) -> [f64; 2] {
    let is_of_picture = |name: &str| {
        let pass = PASSES.iter().find(|pass| pass.name == name);
        name == "readback" || pass.is_some_and(|pass| pass.frequency == Frequency::Picture)
    };
    let sum = |of_picture: bool| {
        let times = taken.iter().filter(|time| is_of_picture(time.name) == of_picture);
        // Not `sum`, whose value of nothing is -0.
        times.fold(0.0, |sum, time| sum + time.total)
    };
    [sum(false), sum(true)]
}

/// Times of alternate runs of a scene (`own`) and of the scene's own settings (`default`): [volume, picture], ns.
#[derive(Default)]
pub(super) struct Runs {
    pub own: Vec<[f64; 2]>,
    pub default: Vec<[f64; 2]>,
}

impl Runs {
    /// Runs both scenes alternately, `count` times. The default goes first in every other pair, so that what slows the machine down slows both.
    ///
    /// # Errors
    /// The device fails, or it has time stamps and the time of the volume or of the picture is missing.
    pub fn in_turn(own: &mut Running, default: &mut Running, count: u32) -> Result<Runs, GpuError> {
        let mut all = Runs::default();
        for n in 0..count {
            let first = if n % 2 == 0 { default.run()? } else { None };
            let mine = own.run()?;
            let last = if n % 2 == 1 { default.run()? } else { None };
            if let (Some(mine), Some(default)) = (mine, first.or(last)) {
                all.own.push(mine);
                all.default.push(default);
            }
        }
        Ok(all)
    }

    /// Times of each run divided by those of the default next to it. None without times.
    pub fn ratios(&self) -> Option<Times> {
        let of = |part: fn(&[f64; 2]) -> f64| {
            let ratios = self.own.iter().zip(&self.default).map(|(own, default)| part(own) / part(default));
            Time::of(&ratios.filter(|r| r.is_finite()).collect::<Vec<_>>())
        };
        Some(Times { volume: of(|r| r[0])?, picture: of(|r| r[1])?, total: of(|r| r[0] + r[1])? })
    }
}

/// The scene with a picture of floats: steps of 8 bits would be as large as many errors.
pub(super) fn in_floats(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.settings.post.floats = true;
    scene
}
