//! `echolume render --turntable` and `--volumes`: several pictures of one recording, drawn on one device.

use super::drawing::{DrawFault, Job, send_volume};
use super::one_colour;
use crate::args::{PictureSeries, SeriesTarget, check_messages, check_volume};
use crate::files::signals::Writing;
use crate::gpu::{Context, Renderer, RendererOptions};
use crate::marked::{self, Demo};
use crate::passes::times::pass_time_table;
use crate::picture::film::encoder;
use crate::plan::Rerun;
use crate::probe::Probe;
use crate::scene::{Scene, Settings};
use crate::source::Source;
use crate::terminal::{Failure, failed, input, progress_bar, remark, say};
use indicatif::ProgressBar;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::str::FromStr;
use std::sync::Arc;

/// The flags that ask for several pictures.
#[derive(clap::Args)]
pub struct SeriesArgs {
    /// Draw N pictures of one turn about the vertical axis of the view, at one scale; the last is followed by the first. -o is a folder
    /// (face/), a pattern (face-%03d.png) or a film (face.mp4)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=3600), conflicts_with = "volumes")]
    turntable: Option<u32>,
    /// Draw a picture of each of these volumes in time: FIRST:LAST, counted from 0, all, or loop: those between the marks of the cine loop in the
    /// settings (cine.first, cine.last), in a film back as well if cine.back_and_forth says so. -o as with --turntable
    #[arg(long, value_name = "FIRST:LAST")]
    volumes: Option<Volumes>,
    /// Pictures of a film in a second, 0.1..=240 [default: 25]
    #[arg(long, value_name = "N", value_parser = rate)]
    rate: Option<f64>,
}

/// Pictures of a film in a second, if `--rate` does not say it.
const RATE: f64 = 25.0;

/// The volumes that are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Volumes {
    All,
    Loop,
    Range(usize, usize),
}

impl FromStr for Volumes {
    type Err = String;

    fn from_str(text: &str) -> Result<Volumes, String> {
        if text.eq_ignore_ascii_case("all") {
            return Ok(Volumes::All);
        }
        if text.eq_ignore_ascii_case("loop") {
            return Ok(Volumes::Loop);
        }
        let ends = text.split_once(':').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
        match ends {
            Some((first, last)) if first <= last => Ok(Volumes::Range(first, last)),
            _ => Err("must read FIRST:LAST, such as 0:9, all or loop".into()),
        }
    }
}

fn rate(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|rate| (0.1..=240.0).contains(rate));
    number.ok_or_else(|| "must lie in 0.1..=240 pictures a second".into())
}

/// What differs from picture to picture.
enum Views {
    /// Settings of each picture of one volume.
    Turn(Vec<Settings>),
    /// The same settings for each of these volumes. In a film a volume may come twice.
    Time(Vec<usize>),
}

impl Views {
    fn count(&self) -> usize {
        match self {
            Views::Turn(settings) => settings.len(),
            Views::Time(volumes) => volumes.len(),
        }
    }

    /// The volume of a picture. None in a turn: all its pictures are of the same volume.
    fn volume(&self, n: usize) -> Option<usize> {
        match self {
            Views::Turn(_) => None,
            Views::Time(volumes) => Some(volumes[n]),
        }
    }

    /// The number of a picture in the name of its file.
    fn number(&self, n: usize) -> usize {
        self.volume(n).unwrap_or(n)
    }
}

impl SeriesArgs {
    /// True if the flags request several pictures.
    pub fn is_given(&self) -> bool {
        self.turntable.is_some() || self.volumes.is_some()
    }

    /// Checks that no flag of a series is given if no series is requested.
    pub fn check(&self) -> Result<(), Failure> {
        match self.rate {
            Some(_) if !self.is_given() => {
                Err(input("--rate: is for a film of several pictures; add --turntable or --volumes"))
            }
            _ => Ok(()),
        }
    }

    /// Draws and writes the pictures. A signal ends the process after the picture that is being written is complete. Pictures in files that were
    /// written before a failure or a signal stay; an incomplete film is not kept.
    pub fn run(&self, job: &Job) -> Result<(), Failure> {
        let name = if self.volumes.is_some() { "volume" } else { "picture" };
        let target = SeriesTarget::of(job.output, name)?;
        if let (Some(_), SeriesTarget::Files { .. }) = (self.rate, &target) {
            return Err(input("--rate: is for a film (-o face.mp4); pictures in files have no rate"));
        }
        match self.volumes {
            Some(Volumes::All) => job.input.check_volumes("--volumes all", |_| true)?,
            Some(Volumes::Loop) => job.input.check_volumes("--volumes loop", |_| true)?,
            Some(Volumes::Range(first, last)) => {
                job.input
                    .check_volumes(&format!("--volumes {first}:{last}"), |volume| (first..=last).contains(&volume))?;
            }
            None => {}
        }
        // Dropped last: after everything is in order, a signal that arrived ends the process.
        let signals = Writing::begin();
        self.draw_all(job, &target, &signals)
    }

    fn draw_all(&self, job: &Job, target: &SeriesTarget, signals: &Writing) -> Result<(), Failure> {
        let (mut source, scene) = self.open(job)?;
        let views = self.views(&*source, &scene, job, target)?;
        let numbers = (0..views.count()).map(|n| views.number(n));
        target.check(numbers, &job.input.read_files(&*source))?;
        if let Some(cut) = scene.probe().and_then(Probe::folded) {
            remark(&cut);
        }
        let mut device = job.open_device()?;
        let bar = progress_bar(views.count() as u64).with_message("pictures");
        let (chosen, rate) = (job.input.volume()?, self.rate.unwrap_or(RATE));
        let written = PictureSeries::new(target, rate);
        let demo = job.input.demo(&*source);
        let mut series = Series { views, scene, demo, chosen, signals, bar, written, times: None };
        let progress = Cell::new(0);
        let draw = |context: &Arc<Context>, options: &RendererOptions, is_again: bool| {
            if is_again {
                source = self.open(job)?.0;
            }
            let done = series.draw(context, &mut *source, options);
            progress.set(series.written.count());
            let Some(signal) = signals.signal() else { return done };
            series.bar.finish_and_clear();
            let (written, count) = (series.written.count(), series.views.count());
            let kept = if matches!(target, SeriesTarget::Film(_)) { "; the film is not kept" } else { "" };
            remark(&format!("stopped by {signal} after {written} of {count} pictures{kept}"));
            Err(failed(format!("stopped by {signal}")).into())
        };
        device.draw(|| progress.get(), draw)?;
        let Series { views, bar, written, times, .. } = series;
        written.finish()?;
        bar.finish_and_clear();
        let count = views.count();
        match target {
            SeriesTarget::Film(file) => {
                let by = encoder().ok().filter(|program| !program.as_os_str().is_empty());
                let by = by.map_or(String::new(), |program| format!(", by {}", program.display()));
                say!("film: {}, {count} pictures, {rate} a second{by}", file.display());
            }
            SeriesTarget::Files { .. } => {
                let [first, last] = [0, count - 1].map(|n| target.file(views.number(n)).display().to_string());
                say!("pictures: {first} to {last}, {count}");
            }
        }
        match times {
            Some(times) if job.timings => say!("{}", times.trim_end()),
            None if job.timings => say!("no times: the device was lost before they were read"),
            _ => {}
        }
        check_messages(&device.context)
    }

    /// The recording, and the scene of its first picture.
    fn open(&self, job: &Job) -> Result<(Box<dyn Source>, Scene), Failure> {
        match self.volumes {
            Some(Volumes::Range(first, _)) => job.input.open_volumes(first),
            Some(Volumes::All | Volumes::Loop) => job.input.open_volumes(0),
            None => job.input.open(),
        }
    }

    fn views(&self, source: &dyn Source, scene: &Scene, job: &Job, target: &SeriesTarget) -> Result<Views, Failure> {
        match (self.turntable, self.volumes) {
            (Some(count), _) => {
                let cameras =
                    scene.turntable(count).map_err(|e| input(format!("--turntable: {}: {}", e.field, e.fault)))?;
                let with = |camera| Settings { camera, ..scene.settings.clone() };
                Ok(Views::Turn(cameras.into_iter().map(with).collect()))
            }
            (None, Some(Volumes::Range(first, end))) => {
                check_volume(source, "--volumes", end, job.input.name())?;
                Ok(Views::Time((first..=end).collect()))
            }
            (None, Some(Volumes::Loop)) => {
                let (cine, count) = (scene.settings.drawn.cine, source.volumes());
                let first = cine.first.unwrap_or_default();
                let volumes = match target {
                    SeriesTarget::Film(_) => cine.film(count),
                    SeriesTarget::Files { .. } => cine.volumes(count),
                };
                let beyond =
                    || format!("--volumes loop: cine.first is {first}, {} has {count} volumes", job.input.name());
                if volumes.is_empty() { Err(input(beyond())) } else { Ok(Views::Time(volumes)) }
            }
            (None, _) => Ok(Views::Time((0..source.volumes().max(1)).collect())),
        }
    }
}

/// A series as it is drawn.
struct Series<'a> {
    views: Views,
    /// Of the first picture.
    scene: Scene,
    /// If the volumes are of the phantom: when pictures say so.
    demo: Option<Demo>,
    /// The volume of a turn.
    chosen: usize,
    signals: &'a Writing,
    bar: ProgressBar,
    /// The pictures so far. The next one is drawn; what is written is never drawn again, whatever is lost in between.
    written: PictureSeries<'a>,
    /// The table of times of the pictures since the last loss. None until all are written.
    times: Option<String>,
}

impl Series<'_> {
    /// Draws and writes what is left: nothing, if the device was lost after the last picture.
    fn draw(
        &mut self,
        context: &Arc<Context>,
        source: &mut dyn Source,
        options: &RendererOptions,
    ) -> Result<(), DrawFault> {
        if self.written.count() == self.views.count() {
            return Ok(());
        }
        let mut renderer = Renderer::new(context, self.scene_of(self.written.count(), source)?, options)?;
        let mut is_empty = true;
        // Said when the fluid is lost, not of every picture without it.
        let mut was_found = true;
        while self.written.count() < self.views.count() {
            let n = self.written.count();
            let volume = self.views.volume(n);
            if self.signals.signal().is_some() {
                return Ok(());
            }
            let scene = self.scene_of(n, source)?;
            let rerun = renderer.change(scene.clone())?;
            if is_empty || volume.is_some() || !matches!(rerun, Rerun::Steps { .. }) {
                let is_whole = self.send(&mut renderer, source, volume)?;
                // What is missing of a volume is not to be filled by the one before.
                if !is_whole && !is_empty {
                    renderer = Renderer::new(context, scene, options)?;
                    self.send(&mut renderer, source, volume)?;
                }
                is_empty = false;
                renderer.show(0)?;
            }
            let picture = renderer.picture()?;
            let of = u32::try_from(volume.unwrap_or(self.chosen)).ok();
            let shown =
                marked::as_set(&picture, renderer.scene(), of, renderer.unveiled(), self.demo).map_err(failed)?;
            // Before the picture is written: a device that is lost here draws it again.
            let warning = match n {
                0 => one_colour::warning(&mut renderer, &picture, source.sample_type().shift(), "the first picture")?,
                _ => None,
            };
            self.written.write(self.views.number(n), &shown)?;
            let start = renderer.unveiled().map(|start| start.outcome);
            let is_found = start.is_none_or(|outcome| outcome.is_found());
            if let Some(outcome) = start.filter(|_| was_found && !is_found) {
                remark(&format!("picture {}: unveil: {outcome}", n + 1));
            }
            was_found = is_found;
            warning.iter().for_each(|line| remark(line));
            self.bar.inc(1);
        }
        let times = renderer.take_times()?;
        self.times = Some(pass_time_table(&times, renderer.scene()));
        Ok(())
    }

    fn scene_of(&self, n: usize, source: &dyn Source) -> Result<Scene, DrawFault> {
        let (geometry, settings) = match &self.views {
            Views::Turn(settings) => (self.scene.geometry.clone(), settings[n].clone()),
            Views::Time(volumes) => (source.geometry(volumes[n]), self.scene.settings.clone()),
        };
        Ok(Scene::new(geometry, self.scene.input, settings).map_err(input)?)
    }

    /// Sends the frames of a volume; of the one that the arguments choose, if there is no other. True if none is missing.
    fn send(&self, renderer: &mut Renderer, source: &mut dyn Source, volume: Option<usize>) -> Result<bool, DrawFault> {
        let mut slices = BTreeSet::new();
        send_volume(renderer, source, volume.unwrap_or(self.chosen), |frame| {
            slices.insert(frame.slice);
            match self.signals.signal() {
                Some(signal) => Err(failed(format!("stopped by {signal}"))),
                None => Ok(()),
            }
        })?;
        Ok(slices.len() >= source.frames_per_volume())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_and_rates_are_read_or_refused() {
        assert_eq!(["ALL", "Loop"].map(str::parse), [Ok(Volumes::All), Ok(Volumes::Loop)]);
        assert_eq!("2:5".parse(), Ok(Volumes::Range(2, 5)));
        assert_eq!("3:3".parse(), Ok(Volumes::Range(3, 3)));
        for wrong in ["", "3", "5:2", "-1:2", "a:b", "1:2:3", ":"] {
            assert!(wrong.parse::<Volumes>().is_err(), "{wrong}");
        }
        assert_eq!((rate("25"), rate("0.1")), (Ok(25.0), Ok(0.1)));
        for wrong in ["0", "nan", "-5", "inf", "241", "x"] {
            assert!(rate(wrong).is_err(), "{wrong}");
        }
    }
}
