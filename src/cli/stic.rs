//! `echolume stic`: one slow sweep over a beating heart becomes volumes of one cycle.

use super::recordings::OUTPUT;
use crate::args::{GeometryArgs, check_outputs, check_volume, frames_of, open_recording};
use crate::files::signals::Writing;
use crate::files::{quoted, read_text};
use crate::probe::Geometry;
use crate::source::cardiac::{Cycle, CycleOptions, Motion, Rhythm};
use crate::source::recorder::{Header, Writer};
use crate::source::{Frame, Source};
use crate::terminal::{Failure, failed, input, progress_bar, say};
use std::path::{Path, PathBuf};

/// Most bytes of a sweep that are held in memory.
const MOST_BYTES: u64 = 8 << 30;
/// Most bytes of a file of R waves.
const MOST_TRIGGERS: u64 = 1 << 20;

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  echolume stic sweep.mha heart.frames\n  \
                        echolume view --source heart.frames    (Enter plays the loop)\n  \
                        echolume stic sweep.mha heart.frames --r-waves ecg.txt --phases 40\n  \
                        echolume phantom -o sweep.mha --body heart --frames 640 --lines 64 --fan 30    (a sweep to try it with)")]
pub struct Stic {
    /// A recording of a slow sweep, of the formats that `convert` reads
    recording: PathBuf,
    /// The volumes of one cycle (.frames); a file that is there is not replaced
    output: PathBuf,
    /// Volumes of the cycle, 2..=1024 [default: as many as a cycle has frames, at most 20: the cine loop of `view`]
    #[arg(long, value_name = "N")]
    phases: Option<usize>,
    /// Slices of a volume, 2..=1024 [default: one less than there are cycles]
    #[arg(long, value_name = "N")]
    slices: Option<usize>,
    /// Least and largest heart rate that is looked for, cycles a minute
    #[arg(long, value_name = "LOW:HIGH", default_value = "90:220")]
    heart_rate: String,
    /// Frames a second, where time stamps are missing or wrong [default: from the time stamps of the frames]
    #[arg(long, value_name = "RATE")]
    frame_rate: Option<f64>,
    /// Text file with the times of an ECG's R waves, s, one a line, on the clock of the frames. Without it the frames tell the rhythm
    #[arg(long, value_name = "FILE")]
    r_waves: Option<PathBuf>,
    /// Sweep of the recording to use, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    volume: usize,
    #[command(flatten)]
    geometry: GeometryArgs,
}

impl Stic {
    /// Least and largest heart rate, cycles a minute.
    fn heart_rate(&self) -> Result<[f64; 2], Failure> {
        let parts: Vec<f64> = self.heart_rate.split(':').filter_map(|part| part.trim().parse().ok()).collect();
        match parts[..] {
            [low, high] if low >= 10.0 && low < high && high <= 1000.0 && self.heart_rate.split(':').count() == 2 => {
                Ok([low, high])
            }
            _ => {
                let allowed = "must be LOW:HIGH with 10 <= LOW < HIGH <= 1000, such as 110:180";
                Err(input(format!("--heart-rate {}: {allowed}", quoted(&self.heart_rate))))
            }
        }
    }

    pub fn run(&self) -> Result<(), Failure> {
        if !self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("frames")) {
            return Err(input(format!("{}: volumes in time are written to a .frames file", self.output.display())));
        }
        let heart_rate = self.heart_rate()?;
        let triggers = self.r_waves.as_deref().map(read_times).transpose()?;
        let mut recording = open_recording(&self.recording, self.geometry.options())?;
        let read = recording.files();
        let read = read.iter().chain(&self.geometry.probe).chain(&self.r_waves).map(PathBuf::as_path);
        check_outputs(&[(OUTPUT, Some(&self.output))], read)?;
        let fault_of = |file: &Path, fault: String| input(format!("{}: {fault}", file.display()));
        let at_fault = |fault: String| fault_of(&self.recording, fault);
        let Geometry::Sweep(probe) = recording.geometry(self.volume) else {
            return Err(at_fault("is a Cartesian volume, whose slices are of one time".into()));
        };
        let (frames, motion) = self.read(&mut *recording)?;
        let (rate, times) = self.times(&frames).map_err(at_fault)?;
        let rhythm = match (&triggers, &self.r_waves) {
            (Some(triggers), Some(file)) => {
                Rhythm::of_triggers(&times, triggers).map_err(|fault| fault_of(file, fault))?
            }
            _ => {
                let longest = times.windows(2).map(|t| t[1] - t[0]).fold(0.0, f64::max);
                // Where frames are missing the phase would jump.
                if longest > 15.0 / heart_rate[1] {
                    return Err(at_fault(format!("its time stamps have a gap of {longest:.3} s: frames are missing")));
                }
                Rhythm::find(&motion, rate, heart_rate).map_err(at_fault)?
            }
        };
        let (count, cycles, height) = (frames.len(), rhythm.cycles(), rhythm.height);
        let options = CycleOptions { phases: self.phases, slices: self.slices };
        let cycle = Cycle::new(&probe, recording.stored_type(), frames, rhythm, rate, options).map_err(at_fault)?;
        self.write(&cycle, Header { synthetic: recording.is_synthetic(), ..cycle.header(recording.range()) })?;
        let from = height.map_or("from the R waves".into(), |h| format!("{h:.0} dB above its surroundings"));
        say!("heart rate: {:.1} a minute, {cycles:.1} cycles in {count} frames; {from}", 60.0 / cycle.seconds);
        let (phases, slices) = (cycle.phases, cycle.probe.slices.len());
        say!("cycle: {}, {phases} volumes of {slices} slices in {:.3} s", self.output.display(), cycle.seconds);
        Ok(())
    }

    /// The frames of the sweep in order of acquisition, and what moves in them.
    fn read(&self, recording: &mut dyn Source) -> Result<(Vec<Frame>, Motion), Failure> {
        let file = self.recording.display();
        check_volume(recording, "--volume", self.volume, &file)?;
        let header = recording.header();
        let bytes = header.frame_bytes().unwrap_or(0).saturating_mul(recording.frames_per_volume() as u64);
        if bytes > MOST_BYTES {
            return Err(input(format!("{file}: a sweep of {bytes} bytes; at most {MOST_BYTES} are held in memory")));
        }
        let mut motion = Motion::new(header.forward.frame_size(), header.stored);
        let mut frames: Vec<Frame> = Vec::new();
        frames_of(recording, self.volume, |frame| {
            motion.take(&frame);
            frames.push(frame);
        })?;
        if frames.len() < 2 {
            return Err(input(format!("{file}: a sweep of one frame; STIC needs the frames of several cycles")));
        }
        Ok((frames, motion))
    }

    /// Frames a second, and when each was acquired.
    fn times(&self, frames: &[Frame]) -> Result<(f64, Vec<f64>), String> {
        if let Some(rate) = self.frame_rate {
            if !(rate.is_finite() && rate > 0.0) {
                return Err(format!("--frame-rate {rate}: must be above 0"));
            }
            let first = frames[0].time.filter(|time| time.is_finite()).unwrap_or(0.0);
            return Ok((rate, (0..frames.len()).map(|n| first + n as f64 / rate).collect()));
        }
        let times: Option<Vec<f64>> = frames.iter().map(|frame| frame.time).collect();
        let Some(times) = times else { return Err("its frames have no time stamps; give --frame-rate".into()) };
        if let Some(n) = (1..times.len()).find(|n| !(times[*n] > times[n - 1] && times[*n].is_finite())) {
            return Err(format!(
                "its time stamps do not rise: {} s after {} s; give --frame-rate",
                times[n],
                times[n - 1]
            ));
        }
        let span = times[times.len() - 1] - times[0];
        match span.is_finite() && span > 0.0 {
            true => Ok(((times.len() - 1) as f64 / span, times)),
            false => Err(format!("its time stamps span {span} s; give --frame-rate")),
        }
    }

    fn write(&self, cycle: &Cycle, header: Header) -> Result<(), Failure> {
        // A signal ends the process only after the incomplete file is deleted.
        let signals = Writing::begin();
        let mut writer = Writer::create(&self.output, header).map_err(failed)?;
        let bar = progress_bar(cycle.phases as u64).with_message("volumes");
        let mut copy = || {
            for phase in 0..cycle.phases {
                for frame in cycle.volume(phase) {
                    writer.frame(&frame, frame.time.unwrap_or(0.0)).map_err(failed)?;
                }
                if let Some(signal) = signals.signal() {
                    return Err(failed(format!("{}: stopped by {signal}", self.output.display())));
                }
                bar.inc(1);
            }
            Ok(())
        };
        if let Err(failure) = copy() {
            writer.discard();
            return Err(failure);
        }
        bar.finish_and_clear();
        writer.finish().map_err(|fault| {
            // Without its index: completely, or not at all.
            let _ = std::fs::remove_file(&self.output);
            failed(fault)
        })
    }
}

/// Times, s, one a line; empty lines and what follows a # are skipped.
fn read_times(file: &Path) -> Result<Vec<f64>, Failure> {
    let at_fault = |fault: String| input(format!("{}: {fault}", file.display()));
    let text = read_text(file, MOST_TRIGGERS, "list of R waves").map_err(at_fault)?;
    let lines = text.lines().enumerate().map(|(n, line)| (n + 1, line.split('#').next().unwrap_or("").trim()));
    lines
        .filter(|(_, line)| !line.is_empty())
        .map(|(n, line)| match line.parse::<f64>() {
            Ok(time) if time.is_finite() => Ok(time),
            _ => Err(at_fault(format!("line {n}: {} is not a time in seconds", quoted(line)))),
        })
        .collect()
}
