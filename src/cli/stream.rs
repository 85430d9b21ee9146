//! `echolume stream`.

use super::arriving::Arriving;
use super::look::Look;
use super::turns::Turns;
use super::{Failure, failed, input, say, unheard};
use crate::files::signals::Held;
use crate::gpu::Context;
use crate::live::{Feed, Options, Shown, Statistics, Step, Stream as Live, StreamError, Update};
use crate::picture;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two lines of statistics.
const EVERY: Duration = Duration::from_secs(1);

#[derive(clap::Args)]
#[command(
    after_help = "Each second one line: frames, volumes and pictures a second, volumes dropped, latency from the arrival of a frame to \
                        the pixels that show it, and the mean time and runs of every pass.\n\nExamples:\n  \
                        echolume stream --null --volumes 20\n  \
                        echolume stream --source sweep.frames --real-time --out pictures\n  \
                        tools/pipe_frames.py | echolume stream --source - --null\n  \
                        echolume stream --source igtl://localhost:18944 --record exam.frames --null\n  \
                        echolume stream --source phantom --rate 5 --update rolling --null --for 10s\n  \
                        echolume stream --motor /dev/ttyUSB0 --sweeps 1 --probe probe.toml --source - --out pictures"
)]
pub struct Stream {
    #[command(flatten)]
    source: Arriving,
    #[command(flatten)]
    look: Look,
    #[command(flatten)]
    turns: Turns,
    /// Write each picture into this folder (PNG, named by its volume; rolling: by its number)
    #[arg(long, value_name = "DIR", conflicts_with = "null", required_unless_present = "null")]
    out: Option<PathBuf>,
    /// Draw the pictures and keep none
    #[arg(long)]
    null: bool,
    /// Write every frame that arrives to this file (.frames)
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// End after so many volumes
    #[arg(long, value_name = "N")]
    volumes: Option<u64>,
    /// End after so long, such as 90s or 10m
    #[arg(long = "for", value_name = "TIME")]
    time: Option<humantime::Duration>,
    /// Run with Vulkan validation; any message is a failure
    #[arg(long)]
    validate: bool,
}

impl Stream {
    pub fn run(&self) -> Result<(), Failure> {
        let update = self.turns.update()?;
        let settings = self.look.layers(self.source.is_phantom(), &[])?.finish().map_err(input)?;
        if let Some(folder) = &self.out {
            std::fs::create_dir_all(folder)
                .map_err(|e| failed(format!("{}: cannot be written: {e}", folder.display())))?;
        }
        if let Some(file) = &self.record {
            check_record(file, self.source.path())?;
        }
        let source = self.source.open()?;
        let mut context = self.look.device(self.validate)?;
        let feed = Feed::new(source, self.record.as_deref())
            .map_err(|e| failed(format!("a thread for the source cannot be started: {e}")))?;
        let (images, queues) = (self.turns.images, self.turns.queues());
        let options = Options { update, images, queues, ..Options::default() };
        let mut stream = Live::new(&context, feed, settings, options);
        let done = self.go(&mut stream, update, &mut context);
        drop(stream);
        done?;
        match context.messages().first() {
            None => Ok(()),
            Some(first) => Err(failed(format!("validation: {first}"))),
        }
    }

    /// `context`: another one after its device was lost.
    fn go(&self, stream: &mut Live, update: Update, context: &mut Arc<Context>) -> Result<(), Failure> {
        // The end of a stream like any other: the recording gets its index. A second signal does not wait for it.
        let signals = Held::first();
        let began = Instant::now();
        let (mut told, mut all, mut memory) = (began, Statistics::default(), None);
        let (mut pictures, mut lost_at, mut enough_at) = (0, None, None);
        let end = loop {
            let step = match stream.step(Duration::from_millis(50)) {
                // A device that is lost again before it drew anything is not the device's fault.
                Err(StreamError::Gpu(lost)) if lost.is_device_lost() && lost_at != Some(pictures) => {
                    tracing::warn!("{lost}; going on with the next volume on the device opened anew");
                    lost_at = Some(pictures);
                    *context = self.look.device(self.validate)?;
                    stream.revive(context).map_err(fault)?;
                    continue;
                }
                step => step.map_err(fault)?,
            };
            let drew = matches!(step, Step::Picture(_));
            match step {
                Step::Picture(shown) => {
                    self.keep(&shown, update, pictures)?;
                    pictures += 1;
                }
                Step::Fault(fault) => tracing::warn!("{fault}"),
                Step::Went => {}
                Step::End(why) => break why,
            }
            if told.elapsed() >= EVERY {
                told = Instant::now();
                let since = stream.take_statistics().map_err(fault)?;
                say!("{:>6.1} s  {}", began.elapsed().as_secs_f64(), since.line(stream.acquisition_time()));
                all.add(&since);
                // After the first seconds everything that is kept is there.
                if memory.is_none() && began.elapsed() > 5 * EVERY {
                    memory = resident();
                }
            }
            // A volume counts when its picture begins; rolling when its last frame has come, which the picture after may show.
            if self.volumes.is_some_and(|n| stream.volumes_shown() >= n) {
                enough_at.get_or_insert(pictures);
            }
            let more = if update == Update::Whole { 0 } else { 1 };
            let enough = drew && enough_at.is_some_and(|at| pictures > at + more);
            if enough || self.time.is_some_and(|t| began.elapsed() >= *t) {
                break None;
            }
            // Whoever read the lines has gone, and nothing else is kept.
            let is_for_nobody = self.null && self.record.is_none() && unheard();
            if is_for_nobody || signals.signal().is_some() {
                break None;
            }
        };
        all.add(&stream.take_statistics().map_err(fault)?);
        say!("in all    {}", all.line(stream.acquisition_time()));
        let counts = all.volumes;
        say!(
            "{} frames, {} volumes shown, {} dropped, {} incomplete, {} pictures{}",
            all.frames,
            counts.shown,
            counts.dropped,
            counts.incomplete,
            all.pictures,
            match (memory, resident()) {
                (Some(then), Some(now)) => format!("; memory {then} MiB after 5 s, {now} MiB at the end"),
                _ => String::new(),
            }
        );
        if let (Some(file), lacks @ 1..) = (&self.record, stream.unrecorded()) {
            return Err(failed(format!("--record {}: {lacks} frames could not be written", file.display())));
        }
        match end {
            None => Ok(()),
            Some(why) => Err(failed(format!("{}: {why}", self.source.shown()))),
        }
    }

    fn keep(&self, shown: &Shown, update: Update, number: u64) -> Result<(), Failure> {
        let Some(folder) = &self.out else { return Ok(()) };
        let name = match update {
            Update::Whole => format!("volume-{:06}.png", shown.volume),
            Update::Rolling => format!("picture-{number:06}.png"),
        };
        let file = folder.join(name);
        shown.picture.as_ref().map_or(Ok(()), |picture| picture.save(&file)).map_err(failed)
    }
}

/// Refuses to write over anything that is there, or that is being played.
pub fn check_record(file: &Path, played: &Path) -> Result<(), Failure> {
    let refuse = |why: &str| Err(input(format!("--record {}: {why}", file.display())));
    if file.extension().is_none_or(|e| e != "frames") {
        return refuse("must end in .frames");
    }
    let same = |other: &Path| other.canonicalize().is_ok_and(|o| file.canonicalize().is_ok_and(|f| f == o));
    if same(played) {
        return refuse("would replace what is played");
    }
    match file.exists() {
        true => refuse("is there already and is not written over; give another name"),
        false => picture::check_target(file).map_err(failed),
    }
}

fn fault(error: StreamError) -> Failure {
    match error {
        StreamError::Scene(e) => input(e),
        StreamError::Gpu(e) => failed(e),
    }
}

/// Memory of this process that is in use, MiB; none where the system does not say.
fn resident() -> Option<u64> {
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = statm.split_whitespace().nth(1)?.parse().ok()?;
    // Of 4 KiB on every system that has this file and that this runs on.
    Some((pages * 4096) >> 20)
}
