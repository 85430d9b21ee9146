//! `echolume stream`: renders frames as they arrive.

use super::one_colour;
use super::serve::{ServeArgs, Serving};
use crate::args::{SceneArgs, SourceArgs, StreamArgs, check_messages, check_outputs, make_folder};
use crate::files::Lock;
use crate::files::signals::Held;
use crate::gpu::{Context, GpuError, Losses};
use crate::live::feed::Observer;
use crate::live::metrics::{LiveMetrics, SourceStatus};
use crate::live::{Feed, FinishedPicture, Statistics, Step, Stream as Live, StreamError, StreamOptions, Update};
use crate::machine::resident_bytes;
use crate::marked::{self, Demo};
use crate::passes::unveil::Unveiled;
use crate::picture;
use crate::scene::Scene;
use crate::terminal::{Failure, failed, input, is_closed, remark, say};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A status line says that the device is stalled if it has finished nothing for so long.
const STALL: Duration = Duration::from_secs(2);
/// Interval of the statistics lines.
const INTERVAL: Duration = Duration::from_secs(1);

#[derive(clap::Args)]
#[command(
    after_help = "One line per second: frames, volumes and pictures per second, dropped volumes, latency from the arrival of a frame to \
                        the pixels that show it. For pictures, for conversions of frames, and for copies on a queue of their own it has \
                        the mean time and the number; with --timings for every pass too.\n\nExamples:\n  \
                        echolume stream --null --volumes 20\n  \
                        echolume stream --source sweep.frames --real-time --out pictures\n  \
                        tools/pipe_frames.py | echolume stream --source - --null\n  \
                        echolume stream --source igtl://localhost:18944 --record exam.frames --null\n  \
                        echolume stream --serve --null    (3D Slicer connects to localhost)\n  \
                        echolume stream --source phantom --rate 5 --update rolling --null --for 10s\n  \
                        echolume stream --motor /dev/ttyUSB0 --sweeps 1 --probe probe.toml --source - --out pictures"
)]
pub struct Stream {
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    stream: StreamArgs,
    /// Write each picture into this folder (PNG, named by volume number; with --update rolling by picture number). Needed without --null
    #[arg(long, value_name = "DIR", conflicts_with = "null", required_unless_present = "null")]
    out: Option<PathBuf>,
    /// Render the pictures without writing them
    #[arg(long)]
    null: bool,
    /// Write every frame that arrives to this file (.frames)
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    #[command(flatten)]
    serve: ServeArgs,
    /// Write metrics in Prometheus' text format every 15 s and at the end, for the textfile collector of its node exporter (name it
    /// *.prom)
    #[arg(long, value_name = "FILE")]
    prometheus: Option<PathBuf>,
    /// End after this number of volumes
    #[arg(long, value_name = "N")]
    volumes: Option<u64>,
    /// End after this time, such as 90s or 10m
    #[arg(long = "for", value_name = "TIME")]
    time: Option<humantime::Duration>,
    /// Run with Vulkan validation; any message is a failure
    #[arg(long)]
    validate: bool,
}

impl Stream {
    pub fn run(&self) -> Result<(), Failure> {
        let update = self.stream.update()?;
        let layers = self.scene.layers(self.source.is_phantom(), &[])?;
        let settings = layers.clone().finish().map_err(input)?;
        self.out.as_deref().map_or(Ok(()), make_folder)?;
        if let Some(file) = &self.record {
            check_record(file, self.source.path())?;
        }
        check_outputs(&[("--prometheus", self.prometheus.as_deref())], [self.source.path()])?;
        let _lock = self.prometheus.as_deref().map(Lock::take).transpose().map_err(failed)?;
        let source = self.source.open()?;
        let mut serving = self.serve.start()?;
        let mut context = self.scene.open_device(self.validate)?;
        let observer = serving.as_ref().map(|serving| Box::new(serving.publisher.listener()) as Observer);
        let feed = Feed::observed(source, self.record.as_deref(), None, observer)
            .map_err(|e| failed(format!("a thread for the source cannot be started: {e}")))?;
        let (images, queues, time_stamps) = (self.stream.images, self.stream.queues(), self.stream.time_stamps());
        let options =
            StreamOptions { update, images, queues, time_stamps, chosen: Some(layers), ..StreamOptions::default() };
        let mut stream = Live::new(&context, feed, settings, options);
        let metrics = self.prometheus.as_deref().map(|file| LiveMetrics::new(file, "stream"));
        let metrics = metrics.transpose().map_err(failed)?;
        let done = self.run_stream(&mut stream, update, &mut context, metrics, &mut serving);
        drop(stream);
        serving.into_iter().for_each(Serving::end);
        done?;
        check_messages(&context)
    }

    /// Runs the stream to its end. `context` is replaced when its device is lost.
    fn run_stream(
        &self,
        stream: &mut Live,
        update: Update,
        context: &mut Arc<Context>,
        mut metrics: Option<LiveMetrics>,
        serving: &mut Option<Serving>,
    ) -> Result<(), Failure> {
        // A signal ends the stream normally, so that the recording gets its index. A second signal ends the process at once.
        let signals = Held::first();
        let began = Instant::now();
        let (mut last_status, mut all, mut memory) = (began, Statistics::default(), None);
        let (mut pictures, mut losses, mut enough_at) = (0, Losses::default(), None);
        // Said of the first picture that is wholly one colour, not of every one.
        let mut explained = false;
        // Said when the fluid is lost, not of every picture without it.
        let mut was_found = true;
        let end = loop {
            let step = match stream.step(Duration::from_millis(50)) {
                // The device is busy, and a signal is not to wait for it.
                Err(StreamError::Gpu(GpuError::Stopped { .. })) => break None,
                // Each time the work is divided into smaller parts. A device that is lost all the same, without a picture in between, is
                // given up.
                Err(StreamError::Gpu(lost)) if lost.is_device_lost() && losses.allow_another() => {
                    match lost.is_given_up() {
                        true => say!("{:>6.1} s  stalled: {lost}; opening it again", began.elapsed().as_secs_f64()),
                        false => {
                            tracing::warn!("{lost}; the device is reopened; rendering continues with the next volume")
                        }
                    }
                    metrics.iter_mut().for_each(|metrics| metrics.device_lost(&lost));
                    *context = self.scene.open_device(self.validate)?;
                    stream.revive(context).map_err(fault)?;
                    continue;
                }
                step => step.map_err(fault)?,
            };
            let drew = matches!(step, Step::Picture(_));
            match step {
                Step::Picture(shown) => {
                    let start = stream.renderer().and_then(|renderer| renderer.unveiled().cloned());
                    let is_found = start.as_ref().is_none_or(|start| start.outcome.is_found());
                    if let Some(start) = start.as_ref().filter(|_| was_found && !is_found) {
                        remark(&format!("unveil: {}", start.outcome));
                    }
                    was_found = is_found;
                    let is_demo = stream.header().is_some_and(|header| header.synthetic);
                    let demo = is_demo.then_some(Demo::WithOthers);
                    let file = self.write_picture(&shown, stream.scene(), start.as_ref(), demo, update, pictures)?;
                    if !explained && let Some(file) = file {
                        explained = explain_one_colour(stream, &shown, &file)?;
                    }
                    if let (Some(serving), Some(picture)) = (&*serving, shown.picture) {
                        serving.publisher.picture([picture.width, picture.height], picture.rgba);
                    }
                    pictures += 1;
                    losses = Losses::default();
                }
                Step::Fault(fault) => tracing::warn!("{fault}"),
                Step::Progress => {}
                Step::End(why) => break why,
            }
            if last_status.elapsed() >= INTERVAL {
                last_status = Instant::now();
                let since = stream.take_statistics().map_err(fault)?;
                say!("{:>6.1} s  {}", began.elapsed().as_secs_f64(), since.line(stream.acquisition_time()));
                if let Some(busy) = stream.device_busy_for().filter(|busy| *busy >= STALL) {
                    let (at, busy) = (began.elapsed().as_secs_f64(), busy.as_secs_f64());
                    say!("{at:>6.1} s  stalled: the device has finished nothing for {busy:.1} s");
                }
                serving.iter_mut().for_each(|serving| serving.say(began));
                all.add(&since);
                metrics.iter_mut().for_each(|metrics| metrics.add(&since));
                // After a few seconds all buffers are allocated.
                if memory.is_none() && began.elapsed() > 5 * INTERVAL {
                    memory = resident();
                }
            }
            let now = Instant::now();
            if let Some(metrics) = metrics.as_mut().filter(|metrics| now >= metrics.due()) {
                let source = SourceStatus { is_connected: stream.is_connected(), ..SourceStatus::default() };
                metrics.write(now, stream, context, source);
            }
            // A volume counts when its picture begins; with rolling updates when its last frame arrived, which the next picture may show.
            if self.volumes.is_some_and(|n| stream.volumes_shown() >= n) {
                enough_at.get_or_insert(pictures);
            }
            let more = if update == Update::Whole { 0 } else { 1 };
            let enough = drew && enough_at.is_some_and(|at| pictures > at + more);
            if enough || self.time.is_some_and(|t| began.elapsed() >= *t) {
                break None;
            }
            // Nobody reads the lines, and nothing else is written.
            let has_no_output = self.null && self.record.is_none() && !self.serve.is_asked_for() && is_closed();
            if has_no_output || signals.signal().is_some() {
                break None;
            }
        };
        let last = match stream.take_final_statistics() {
            // Without the times of the work that is not done.
            Err(StreamError::Gpu(GpuError::Stopped { .. })) => stream.take_statistics().map_err(fault)?,
            taken => taken.map_err(fault)?,
        };
        all.add(&last);
        if let Some(mut metrics) = metrics {
            metrics.add(&last);
            metrics.end(stream, context);
        }
        say!("in all    {}", all.line(stream.acquisition_time()));
        let counts = all.volumes;
        say!(
            "{} frames, {} volumes shown, {} dropped, {} incomplete, {} pictures{}{}",
            all.frames,
            counts.shown,
            counts.dropped,
            counts.incomplete,
            all.pictures,
            match stream.feed_counts().left_out {
                0 => String::new(),
                count => format!("; {count} frames of the sweep left out of the volume"),
            },
            match (memory, resident()) {
                (Some(then), Some(now)) => format!("; memory {then} MiB after 5 s, {now} MiB at the end"),
                _ => String::new(),
            }
        );
        if let (Some(file), lacks @ 1..) = (&self.record, stream.feed_counts().unrecorded) {
            return Err(failed(format!("--record {}: {lacks} frames could not be written", file.display())));
        }
        match end {
            None => Ok(()),
            Some(why) => Err(failed(format!("{}: {why}", self.source.name()))),
        }
    }

    /// Writes a picture as the settings of its scene ask for it, if `--out` is given, and returns its file.
    fn write_picture(
        &self,
        shown: &FinishedPicture,
        scene: Option<&Scene>,
        start: Option<&Unveiled>,
        demo: Option<Demo>,
        update: Update,
        number: u64,
    ) -> Result<Option<PathBuf>, Failure> {
        let Some(folder) = &self.out else { return Ok(None) };
        let name = match update {
            Update::Whole => format!("volume-{:06}.png", shown.volume),
            Update::Rolling => format!("picture-{number:06}.png"),
        };
        let file = folder.join(name);
        if let (Some(picture), Some(scene)) = (&shown.picture, scene) {
            marked::as_set(picture, scene, Some(shown.volume), start, demo)
                .and_then(|picture| picture.save(&file))
                .map_err(failed)?;
        }
        Ok(Some(file))
    }
}

/// Says why a picture is wholly one colour, if it is. True if something was said.
fn explain_one_colour(stream: &mut Live, shown: &FinishedPicture, file: &Path) -> Result<bool, Failure> {
    let (Some(picture), Some(renderer)) = (shown.picture.as_ref(), stream.renderer()) else { return Ok(false) };
    let warning = one_colour::warning(renderer, picture, 0.0, &file.display().to_string()).map_err(failed)?;
    warning.iter().for_each(|line| remark(line));
    Ok(warning.is_some())
}

/// Checks that a recording to be written (`file`) has the ending .frames, can be written, and replaces neither an existing file nor the recording
/// that is played.
pub fn check_record(file: &Path, played: &Path) -> Result<(), Failure> {
    let refuse = |why: &str| Err(input(format!("--record {}: {why}", file.display())));
    if file.extension().is_none_or(|e| e != "frames") {
        return refuse("must end in .frames");
    }
    if played.canonicalize().is_ok_and(|played| file.canonicalize().is_ok_and(|file| file == played)) {
        return refuse("would replace the recording that is played");
    }
    match file.exists() {
        true => refuse("exists already and is not replaced; give another name"),
        false => picture::check_target(file).map_err(failed),
    }
}

fn fault(error: StreamError) -> Failure {
    match error {
        StreamError::Scene(e) => input(e),
        other => failed(other),
    }
}

/// Resident memory of this process, MiB. None if the system does not report it.
fn resident() -> Option<u64> {
    resident_bytes().map(|bytes| bytes >> 20)
}
