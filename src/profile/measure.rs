//! One scene rendered again and again: where the time goes.

use super::machine::CpuTime;
use super::{ceilings, machine};
use crate::gpu::{Context, GpuError, Options, Renderer};
use crate::passes::{Bind, Frequency, Part, Pass, Span};
use crate::plan::{Plan, Rerun, Step};
use crate::profile::trace::{self, Track};
use crate::profile::{Acquisition, Ceilings, FORMAT, PassProfile, Profile, Sizes, settings_hash};
use crate::scene::Scene;
use crate::source::Frame;
use std::sync::Arc;
use std::time::Instant;

#[derive(Clone, Debug)]
pub struct Asked {
    /// Pictures measured, and rendered before that.
    pub repeats: usize,
    pub warm_up: usize,
    /// The frames go through stage 1 once: only what follows is measured.
    pub still: bool,
    /// The view turns by this much before each repeat, warm-up included, deg.
    pub turn: f64,
    /// What the frames came from, in words.
    pub input: String,
    /// Measure what bounds the device, too.
    pub ceilings: bool,
}

/// A scene on a device, rendered once with every call of [`Run::repeat`]. Two of them may take turns, so that whatever else the
/// machine does falls on both.
pub struct Run {
    context: Arc<Context>,
    renderer: Renderer,
    /// As it was asked for, before the view turned.
    scene: Scene,
    asked: Asked,
    began: Instant,
    done: usize,
    repeats: Vec<Repeat>,
    ceilings: Option<Ceilings>,
}

/// The profile, and every span of its repeats on one clock.
///
/// # Errors
/// What the device cannot hold or do.
pub fn run(
    context: &Arc<Context>,
    scene: &Scene,
    frames: &[Frame],
    asked: &Asked,
) -> Result<(Profile, Vec<trace::Span>), GpuError> {
    let mut run = Run::new(context, scene, asked)?;
    while run.wants_more() {
        run.repeat(frames)?;
    }
    Ok(run.finish())
}

impl Run {
    pub fn new(context: &Arc<Context>, scene: &Scene, asked: &Asked) -> Result<Run, GpuError> {
        let ceilings = if asked.ceilings { ceilings::measure(context)? } else { None };
        let options = Options { spans: true, ..Options::default() };
        Ok(Run {
            context: context.clone(),
            renderer: Renderer::new(context, scene.clone(), &options)?,
            scene: scene.clone(),
            asked: asked.clone(),
            began: Instant::now(),
            done: 0,
            repeats: Vec::new(),
            ceilings,
        })
    }

    pub fn wants_more(&self) -> bool {
        self.done < self.asked.warm_up + self.asked.repeats
    }

    /// The volume once more.
    pub fn repeat(&mut self, frames: &[Frame]) -> Result<(), GpuError> {
        let cpu = CpuTime::now();
        let start = self.began.elapsed();
        let turned = self.rotate()?;
        if self.done == 0 || !self.asked.still || matches!(turned, Some(Rerun::Frames | Rerun::Everything)) {
            for frame in frames {
                self.renderer.frame(frame.slice as u32, &frame.bytes, 0)?;
            }
            self.renderer.show(0)?;
        } else if turned.is_none() {
            // Nothing has changed: the picture is asked for anew.
            self.renderer.show(0)?;
        }
        self.renderer.picture()?;
        let wall = (self.began.elapsed() - start).as_nanos() as f64;
        let cpu = CpuTime::now().zip(cpu).map(|(now, then)| now.since(&then));
        let spans = self.renderer.take_spans()?;
        self.done += 1;
        if self.done > self.asked.warm_up {
            self.repeats.push(Repeat { wall, cpu, spans });
        }
        Ok(())
    }

    /// The scene from the next angle, and what that runs again; None where nothing turns.
    fn rotate(&mut self) -> Result<Option<Rerun>, GpuError> {
        if self.asked.turn == 0.0 {
            return Ok(None);
        }
        let mut settings = self.scene.settings.clone();
        let angle = self.asked.turn * self.done as f64;
        // As many turns as it takes.
        let turned = |azimuth: f64| (azimuth + angle) % 360.0;
        settings.camera.azimuth = turned(settings.camera.azimuth);
        if self.scene.cuts_planes() {
            settings.planes.azimuth = turned(settings.planes.azimuth);
        }
        let scene = Scene::new(self.scene.geometry.clone(), self.scene.input, settings)
            .map_err(|e| GpuError::Broken(format!("the view turned by {angle} deg: {e}")))?;
        self.renderer.change(scene).map(Some)
    }

    pub fn finish(self) -> (Profile, Vec<trace::Span>) {
        let device = machine::device(&self.context);
        let (scene, plan, repeats) = (&self.scene, self.renderer.plan(), self.repeats);
        let stamped = device.valid_bits > 0;
        let profile = Profile {
            format: FORMAT.into(),
            program: machine::program(),
            date: machine::date(),
            scene: settings(scene),
            settings_hash: settings_hash(&settings(scene)),
            input: self.asked.input,
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
            warm_up: self.asked.warm_up,
            turn: self.asked.turn,
            passes: passes(plan, scene, &repeats, stamped),
            host: hosts(&repeats),
            wall_ns: repeats.iter().map(|r| r.wall).collect(),
            cpu_ns: repeats.iter().map(|r| r.cpu).collect::<Option<_>>().unwrap_or_default(),
            device_ns: if stamped { repeats.iter().map(Repeat::on_device).collect() } else { Vec::new() },
            device,
            ceilings: self.ceilings,
            sampling: Some(format!("{}; {}", scene.sampling.words(), self.renderer.fetch().words())),
        };
        let spans = repeats.into_iter().enumerate().flat_map(|(n, r)| r.spans.into_iter().map(move |s| traced(n, s)));
        (profile, spans.collect())
    }
}

struct Repeat {
    /// From the first frame's arrival to the picture, ns.
    wall: f64,
    /// CPU time of the process over it, ns; None where the system does not tell.
    cpu: Option<f64>,
    spans: Vec<Span>,
}

impl Repeat {
    fn of<'a>(&'a self, name: &'a str, on_device: bool) -> impl Iterator<Item = &'a Span> {
        self.spans.iter().filter(move |s| s.name == name && s.on_device == on_device)
    }

    fn sum(&self, name: &str, on_device: bool) -> f64 {
        self.of(name, on_device).map(|s| s.end - s.begin).sum()
    }

    /// From the first pass' begin to the last one's end.
    fn on_device(&self) -> f64 {
        let spans = || self.spans.iter().filter(|s| s.on_device);
        let begin = spans().map(|s| s.begin).fold(f64::MAX, f64::min);
        let end = spans().map(|s| s.end).fold(begin, f64::max);
        if end > begin { end - begin } else { 0.0 }
    }
}

fn settings(scene: &Scene) -> String {
    // Settings come from TOML, so they go back into it; a failure would only lose the words.
    toml::to_string(&scene.settings).unwrap_or_default()
}

fn traced(repeat: usize, span: Span) -> trace::Span {
    trace::Span {
        name: span.name.into(),
        track: if span.on_device { Track::Device } else { Track::Host },
        repeat,
        begin_ns: span.begin,
        end_ns: span.end,
    }
}

/// Names in the order in which they first appear.
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
        let runs = first.map_or(0, |r| r.of(name, true).count() as u32);
        // Frames that were not sent again ran no step of theirs.
        let times = if steps.is_empty() { 0 } else { u64::from(runs) / steps.len() as u64 };
        let bytes = |binds: fn(&Step, &Scene) -> Vec<Bind>| -> u64 {
            times * steps.iter().flat_map(|s| binds(s, scene)).map(|b| touched(&b, scene)).sum::<u64>()
        };
        let copied = copied_bytes(name, scene, runs.into());
        PassProfile {
            name: name.into(),
            stage: steps.first().map_or("copies".into(), |s| s.pass.stage.name().into()),
            runs_per_picture: runs,
            samples_ns: repeats.iter().map(|r| r.sum(name, true)).collect(),
            bytes_read: bytes(|s, scene| (s.pass.reads)(scene, &s.args())) + copied,
            bytes_written: bytes(|s, scene| (s.pass.writes)(scene, &s.args())) + copied,
            fetches: steps.iter().map(|s| fetches(s.pass, scene, s)).sum::<Option<u64>>().map(|n| n * times),
            filtered: None,
            invocations: first.and_then(|r| r.of(name, true).map(|s| s.invocations).sum()),
        }
    };
    // In running order: the plan's, and what is copied where it happens.
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
        bytes_read: 0,
        bytes_written: 0,
        fetches: None,
        filtered: None,
        invocations: None,
    };
    names(repeats, false).into_iter().map(host).collect()
}

/// Bytes of what a dispatch binds, each texel once.
fn touched(bind: &Bind, scene: &Scene) -> u64 {
    let all = bind.slot.bytes(scene);
    match bind.part {
        Part::Slice | Part::Layer => all / u64::from(bind.slot.shape(scene).parts()),
        Part::Whole | Part::Around(_) => all,
    }
}

/// What so many uploads or readbacks move each way.
fn copied_bytes(name: &str, scene: &Scene, runs: u64) -> u64 {
    use crate::passes::{Slot, chain, layer};
    let frame = touched(&layer("frames", Slot::Frames), scene);
    match name {
        // Several slices at once.
        "upload" if chain::copied(scene).is_some() && runs > 0 => scene.frames_seen().len() as u64 * frame,
        "upload" => runs * frame,
        "readback" => runs * Slot::Screen.bytes(scene),
        _ => 0,
    }
}

/// Texels that one step fetches: known of filters whose window does not depend on the data.
fn fetches(pass: &Pass, scene: &Scene, step: &Step) -> Option<u64> {
    let args = crate::passes::DispatchArgs { slices: scene.slices(), ..step.args() };
    let constants = (pass.constants)(scene, &args);
    let radius = constants.iter().find(|(name, _)| *name == "RADIUS").map(|(_, r)| *r as u64)?;
    let edge = 2 * radius + 1;
    let invocations: u64 = pass.invocations(scene, &args).iter().map(|n| u64::from(*n)).product();
    // Of an invocation's run of neighbours.
    let along = edge + u64::from(crate::passes::RUN) - 1;
    let window = match pass.name.split('_').next()? {
        "gaussian" => along,
        "sigma" => edge * along,
        _ => return None,
    };
    // A slice's filter runs once a frame; the caller counts those.
    debug_assert!(pass.frequency != Frequency::Frame || args.slice == 0);
    Some(invocations * window)
}
