//! Profiles a scene: renders it repeatedly and records where the time goes, pass by pass.

use crate::baselines::Stored;
use crate::gpu::{Context, GpuError, Renderer, RendererOptions, Shaders, TimeStamps, pass_runner};
use crate::machine::{self, CpuTime};
use crate::passes::device_limits as loops;
use crate::passes::slots::Shape;
use crate::passes::{Bind, DispatchArgs, GROUP, Part, Pass, RUN, Slot, Span, chain, filter, layers, slices};
use crate::plan::{Plan, Rerun, Step};
use crate::profile::statistics::Sample;
use crate::profile::{Acquisition, Ceiling, Ceilings, PassProfile, Profile, Sizes, settings_hash};
use crate::scene::Scene;
use crate::source::Frame;
use std::sync::Arc;
use std::time::Instant;

#[derive(Clone, Debug)]
pub struct ProfileOptions {
    /// Number of measured repeats, each of which renders one picture.
    pub repeats: usize,
    /// Number of repeats that are run first and not measured.
    pub warm_up: usize,
    /// True: the frames go through stage 1 in the first repeat only, warm-up included, and again only where a turned view needs them. So only the
    /// later stages are measured if there is a warm-up.
    pub still: bool,
    /// Growth of the view's azimuth from each repeat to the next, also in the warm-up, deg.
    pub angle_step: f64,
    /// Description of the input, for the profile.
    pub input: String,
    /// True: the roofline ceilings of the device are measured as well, before the repeats.
    pub ceilings: bool,
}

/// A profile that is being measured: each call of [`ProfileRun::repeat`] runs the scene once. Calls of two runs can alternate, so that other load on
/// the machine affects both alike.
pub struct ProfileRun {
    context: Arc<Context>,
    renderer: Renderer,
    /// The scene before any rotation of the view.
    scene: Scene,
    options: ProfileOptions,
    began: Instant,
    done: usize,
    repeats: Vec<Repeat>,
    ceilings: Option<Ceilings>,
}

impl ProfileRun {
    /// Measures the ceilings if the options ask for them, and makes the renderer with these shaders. No repeat has run yet.
    ///
    /// # Errors
    /// The device cannot hold the scene, or fails, or a shader does not compile.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        options: &ProfileOptions,
        shaders: &Arc<Shaders>,
    ) -> Result<ProfileRun, GpuError> {
        let ceilings = if options.ceilings { measure_ceilings(context)? } else { None };
        let renderer_options = RendererOptions {
            spans: true,
            cpu_times: true,
            time_stamps: TimeStamps::EachPass,
            shaders: shaders.clone(),
            ..RendererOptions::default()
        };
        Ok(ProfileRun {
            context: context.clone(),
            renderer: Renderer::new(context, scene.clone(), &renderer_options)?,
            scene: scene.clone(),
            options: options.clone(),
            began: Instant::now(),
            done: 0,
            repeats: Vec::new(),
            ceilings,
        })
    }

    /// True until all repeats, warm-up included, have run.
    pub fn needs_more(&self) -> bool {
        self.done < self.options.warm_up + self.options.repeats
    }

    /// Runs the scene once, and records its times unless it is part of the warm-up. `frames`: those of one volume, the same in every call.
    ///
    /// # Errors
    /// The device fails or cannot hold the scene, a frame has the wrong size, or the scene with the rotated view is refused.
    pub fn repeat(&mut self, frames: &[Frame]) -> Result<(), GpuError> {
        let cpu = CpuTime::now();
        let start = self.began.elapsed();
        let turned = self.rotate()?;
        if self.done == 0 || !self.options.still || matches!(turned, Some(Rerun::Frames | Rerun::Everything)) {
            self.renderer.volume(frames)?;
        } else if turned.is_none() {
            // Nothing changed: request the picture again.
            self.renderer.show(0)?;
        }
        self.renderer.picture()?;
        let wall = (self.began.elapsed() - start).as_nanos() as f64;
        let cpu = CpuTime::now().zip(cpu).map(|(now, then)| now.since(&then));
        let (spans, passes) = (self.renderer.take_spans()?, self.renderer.take_cpu_times());
        self.done += 1;
        if self.done > self.options.warm_up {
            self.repeats.push(Repeat { wall, cpu, spans, passes });
        }
        Ok(())
    }

    /// Rotates the view to the next angle and returns what has to run again; None if the view does not rotate.
    fn rotate(&mut self) -> Result<Option<Rerun>, GpuError> {
        if self.options.angle_step == 0.0 {
            return Ok(None);
        }
        let mut settings = self.scene.settings.clone();
        let angle = self.options.angle_step * self.done as f64;
        let turned = |azimuth: f64| (azimuth + angle) % 360.0;
        settings.camera.azimuth = turned(settings.camera.azimuth);
        if self.scene.cuts_planes() {
            settings.planes.azimuth = turned(settings.planes.azimuth);
        }
        let scene = Scene::new(self.scene.geometry.clone(), self.scene.input, settings)
            .map_err(|e| GpuError::Broken(format!("the view turned by {angle} deg: {e}")))?;
        self.renderer.change(scene).map(Some)
    }

    /// The profile of the measured repeats, and their spans, each with the index of its repeat, from 0.
    pub fn finish(self) -> (Profile, Vec<(usize, Span)>) {
        let device = machine::device(&self.context);
        let (scene, plan, repeats) = (&self.scene, self.renderer.plan(), self.repeats);
        // What the device resolves decides what an invocation makes and reads.
        let resolved = self.renderer.scene();
        let stamped = device.valid_bits > 0;
        let profile = Profile {
            format: Profile::FORMAT.into(),
            program: machine::program(),
            date: machine::date(),
            scene: settings(scene),
            settings_hash: settings_hash(&settings(scene)),
            input: self.options.input,
            sizes: Sizes {
                frame: scene.frame_size(),
                slices: scene.slices(),
                volume: scene.volume_size(),
                picture: scene.picture_size(),
            },
            acquisition: scene
                .probe()
                .map(|p| Acquisition { seconds: p.acquisition_time(), sound_speed: p.sound_speed }),
            repeats: repeats.len(),
            warm_up: self.options.warm_up,
            turn: self.options.angle_step,
            passes: passes(plan, resolved, &repeats, stamped),
            host: hosts(&repeats),
            wall_ns: repeats.iter().map(|r| r.wall).collect(),
            cpu_ns: repeats.iter().map(|r| r.cpu).collect::<Option<_>>().unwrap_or_default(),
            device_ns: if stamped { repeats.iter().map(Repeat::on_device).collect() } else { Vec::new() },
            device,
            ceilings: self.ceilings,
            sampling: Some(format!("{}; {}", resolved.sampling.words(), self.renderer.texel_access().describe())),
            clock_deviation_ns: self.renderer.clock_deviation(),
        };
        let spans = repeats.into_iter().enumerate().flat_map(|(n, r)| r.spans.into_iter().map(move |s| (n, s)));
        (profile, spans.collect())
    }
}

struct Repeat {
    /// From the first frame's arrival to the picture, ns.
    wall: f64,
    /// CPU time of the process over the same interval, ns; None if the system does not report it.
    cpu: Option<f64>,
    spans: Vec<Span>,
    /// CPU time of each run of a pass, ns.
    passes: Vec<(&'static str, f64)>,
}

impl Repeat {
    fn of<'a>(&'a self, name: &'a str, on_device: bool) -> impl Iterator<Item = &'a Span> {
        self.spans.iter().filter(move |s| s.name == name && s.on_device == on_device)
    }

    fn sum(&self, name: &str, on_device: bool) -> f64 {
        self.of(name, on_device).map(|s| s.end - s.begin).sum()
    }

    /// CPU time of a pass, ns; None if it was not counted.
    fn cpu_of(&self, pass: &str) -> Option<f64> {
        let runs: Vec<f64> = self.passes.iter().filter(|(name, _)| *name == pass).map(|(_, ns)| *ns).collect();
        (!runs.is_empty()).then(|| runs.iter().sum())
    }

    /// From the begin of the first pass to the end of the last, ns.
    fn on_device(&self) -> f64 {
        let spans = || self.spans.iter().filter(|s| s.on_device);
        let begin = spans().map(|s| s.begin).fold(f64::MAX, f64::min);
        let end = spans().map(|s| s.end).fold(begin, f64::max);
        if end > begin { end - begin } else { 0.0 }
    }
}

fn settings(scene: &Scene) -> String {
    // Settings come from TOML, so writing them cannot fail; if it did, only the description would be lost.
    scene.settings.to_toml().unwrap_or_default()
}

/// Names of spans in order of first appearance.
fn names(repeats: &[Repeat], on_device: bool) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = Vec::new();
    for span in repeats.iter().flat_map(|r| &r.spans).filter(|s| s.on_device == on_device) {
        if !names.contains(&span.name) {
            names.push(span.name);
        }
    }
    names
}

fn passes(plan: &Plan, scene: &Scene, repeats: &[Repeat], stamped: bool) -> Vec<PassProfile> {
    if !stamped {
        return Vec::new();
    }
    let measured = |name: &'static str| {
        let steps: Vec<&Step> = plan.steps.iter().filter(|s| s.pass.name == name).collect();
        let first = repeats.first();
        let runs = first.map_or(0, |r| r.of(name, true).map(|s| s.runs).sum());
        // With `still`, steps of stage 1 run only once.
        let times = if steps.is_empty() { 0 } else { u64::from(runs) / steps.len() as u64 };
        let bytes = |binds: fn(&Step, &Scene) -> Vec<Bind>| -> u64 {
            times
                * steps
                    .iter()
                    .map(|s| binds(s, scene).iter().map(|b| visited(s.pass, b, scene)).sum::<u64>())
                    .sum::<u64>()
        };
        let copied = copied_bytes(name, scene, runs.into());
        PassProfile {
            name: name.into(),
            stage: steps.first().map_or("copies".into(), |s| s.pass.stage.name().into()),
            runs_per_picture: runs,
            samples_ns: repeats.iter().map(|r| r.sum(name, true)).collect(),
            cpu_ns: repeats.iter().map(|r| r.cpu_of(name)).collect::<Option<_>>().unwrap_or_default(),
            bytes_read: bytes(|s, scene| s.pass.reads(scene, &s.args())) + copied,
            bytes_written: bytes(|s, scene| s.pass.writes(scene, &s.args())) + copied,
            fetches: steps.iter().map(|s| fetches(s.pass, scene, s)).sum::<Option<u64>>().map(|n| n * times),
            filtered: None,
            dispatched: (!steps.is_empty()).then(|| times * steps.iter().map(|s| dispatched(s, scene)).sum::<u64>()),
            invocations: first.and_then(|r| r.of(name, true).map(|s| s.invocations).sum()),
        }
    };
    // In running order: the plan's order, uploads first.
    let mut order = names(repeats, true);
    order.sort_by_key(|name| match *name {
        "upload" => -1,
        name => plan.steps.iter().position(|s| s.pass.name == name).map_or(i64::MAX, |n| n as i64),
    });
    order.into_iter().map(measured).collect()
}

fn hosts(repeats: &[Repeat]) -> Vec<PassProfile> {
    let host = |name: &'static str| PassProfile {
        name: name.into(),
        stage: "host".into(),
        runs_per_picture: repeats.first().map_or(0, |r| r.of(name, false).count() as u32),
        samples_ns: repeats.iter().map(|r| r.sum(name, false)).collect(),
        ..PassProfile::default()
    };
    names(repeats, false).into_iter().map(host).collect()
}

/// Bytes that a dispatch can reach through a binding, each texel counted once.
fn touched(bind: &Bind, scene: &Scene) -> u64 {
    let all = bind.slot.bytes(scene);
    match bind.part {
        Part::Slices | Part::Layers => all / u64::from(bind.slot.shape(scene).parts()),
        Part::Whole | Part::Around(_) | Part::Groups => all,
    }
}

/// [`touched`] by one dispatch of a pass. One that is repeated with a flat extent visits one layer of a 3D texture each time.
fn visited(pass: &Pass, bind: &Bind, scene: &Scene) -> u64 {
    let repeats = (pass.repeat)(scene);
    let args = DispatchArgs::default();
    let is_layer = repeats > 1 && bind.part == Part::Whole && (pass.extent)(scene, &args)[2] == 1;
    let layers = match bind.slot.shape(scene) {
        Shape::Three([_, _, layers]) if is_layer && layers > 1 => u64::from(repeats),
        _ => 1,
    };
    touched(bind, scene) / layers
}

/// Bytes that `runs` uploads or readbacks copy in each direction.
fn copied_bytes(name: &str, scene: &Scene, runs: u64) -> u64 {
    let frame = touched(&layers("frames", Slot::Frames), scene);
    match name {
        // One copy uploads several slices, and of each what is stored.
        "upload" if runs > 0 => match chain::copied(scene) {
            Some(slot) => scene.visible_frames().len() as u64 * touched(&slices("volume", slot), scene),
            None => runs * frame,
        },
        "readback" => runs * Slot::Screen.bytes(scene),
        _ => 0,
    }
}

/// Invocations that a step asks for. The filter of a slice runs once a frame; the caller multiplies by the number of frames.
fn dispatched(step: &Step, scene: &Scene) -> u64 {
    let args = DispatchArgs { slices: step.pass.slices(scene), ..step.args() };
    step.pass.invocations(scene, &args).iter().map(|n| u64::from(*n)).product()
}

/// Texels that one step fetches if each pixel has a surface; None unless the pass has a window. Of a window that depends on the data, its least size.
fn fetches(pass: &Pass, scene: &Scene, step: &Step) -> Option<u64> {
    let args = DispatchArgs { slices: pass.slices(scene), ..step.args() };
    let constants = pass.constants(scene, &args);
    let constant = |asked: &str| constants.iter().find(|(name, _)| *name == asked).map(|(_, value)| *value as u64);
    // An invocation filters a run of neighbours and shares their window, a workgroup that of all its invocations where it has shared memory.
    let sharing = if constant("TILED") == Some(1) { u64::from(GROUP) } else { 1 };
    let run = u64::from(RUN);
    let seen = |made: u64| Some(made + 2 * constant("RADIUS")?);
    let window = match pass.name {
        "tile_ranges" => constant("TILE")?.pow(2),
        "light_reduce" => 4_u64.pow(3),
        "median_slice" => (constant("COLUMNS")? + 2) * (run + 2),
        // Eight first thresholds; then the window is read to count values, and again to find the median.
        "median_distance" => 8 + 2 * seen(1)? * seen(run)?,
        "bilateral_distance" => run + seen(1)? * seen(run)?,
        name => match name.split('_').next()? {
            "gaussian" => sharing * seen(sharing * u64::from(filter::gaussian::RUN))?,
            "sigma" => seen(sharing)? * seen(sharing * run)?,
            // The texel itself and its starting window, without the estimate of its centre and what the window grows by.
            "enhanced" => 1 + seen(1)?.pow(2),
            _ => return None,
        },
    };
    Some(dispatched(step, scene) * window / (sharing * sharing))
}

/// Repeats of each ceiling loop; the median is reported.
const CEILING_REPEATS: u32 = 15;

/// Measures the device's roofline ceilings with the passes of [`crate::passes::device_limits`]. None if it has no time stamps.
///
/// # Errors
/// The device cannot hold a volume of 128^3 and pictures of 2048^2, or fails.
pub(crate) fn measure_ceilings(context: &Arc<Context>) -> Result<Option<Ceilings>, GpuError> {
    let broken = |e: crate::scene::SceneError| GpuError::Broken(format!("the scene that measures: {e}"));
    // Larger than the caches of a GPU; on a software device the smallest size with steady times.
    let pixels = if context.candidate.is_software() { 256 } else { 2048 };
    let sampled = loops::scene(128, pixels).map_err(broken)?;
    let copied = loops::scene(2, 2048).map_err(broken)?;
    let rate = |pass: &'static Pass, scene: &Scene, count: f64| -> Result<Option<Ceiling>, GpuError> {
        let rates: Vec<f64> = pass_runner::time_pass(context, scene, pass, CEILING_REPEATS)?
            .iter()
            .filter(|ns| **ns > 0.0)
            .map(|ns| count / ns * 1e9)
            .collect();
        Ok(Sample::new(&rates).ok().map(|s| Ceiling {
            median: s.median(),
            low: s.quantile(0.05),
            high: s.quantile(0.95),
        }))
    };
    let samples = f64::from(pixels) * f64::from(pixels) * f64::from(loops::SAMPLES);
    let bytes = 2.0 * Slot::Picture.bytes(&copied) as f64;
    let copy = rate(&loops::COPY, &copied, bytes)?;
    let sampling = rate(&loops::FILTERED, &sampled, samples)?;
    let exact = rate(&loops::EIGHT_FETCHES, &sampled, samples)?;
    let fetch = rate(&loops::ONE_FETCH, &sampled, samples)?;
    Ok(match (copy, sampling, fetch) {
        (Some(copy), Some(sampling), Some(fetch)) => Some(Ceilings { copy, sampling, exact, fetch }),
        _ => None,
    })
}
