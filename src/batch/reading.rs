//! Reads the recording of a unit, on a thread of its own: the next one is read while this one is drawn. Two recordings are in memory at most.

use super::manifest::Numbered;
use super::results::{Record, Verified, read_record};
use super::unit::{Key, Kind, Work};
use crate::args::{check_volume, frames_of, recorded};
use crate::digest::digest_of;
use crate::files::escaped;
use crate::scene::Scene;
use crate::source::convert::{Target, Volume};
use crate::source::{self, Frame, Source};
use crate::terminal::{Failure, input};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// A unit, its parsed work and the path of its recording, which is absolute or relative to the working folder.
#[derive(Clone)]
pub struct Task {
    pub numbered: Numbered,
    pub work: Arc<Work>,
    pub input: PathBuf,
}

/// What reading the recording of a task gave.
pub enum Read {
    /// Nothing is to be done: an earlier run did the unit and left this record.
    Finished(Task, Box<Record>),
    /// The unit is to be done. `earlier`: the record of an earlier run if the unit is drawn again only for comparison. `seconds`: time for reading.
    Ready {
        task: Task,
        key: Key,
        contents: Contents,
        seconds: f64,
        earlier: Option<Box<Record>>,
    },
    Failed {
        task: Task,
        key: Option<Key>,
        failure: Failure,
        seconds: f64,
    },
}

/// A recording in the form that its work needs.
pub enum Contents {
    /// Frames to draw, and whether every slice of the volume is among them.
    Frames {
        scene: Box<Scene>,
        frames: Vec<Frame>,
        is_whole: bool,
    },
    Volume {
        volume: Box<Volume>,
        target: Box<Target>,
    },
    Figures(Map<String, Value>),
}

/// Reads what a task needs. Nothing is read of a unit whose digest is given and whose record is in `folder`, unless `again` is true for its key.
/// With `verified`, the digests of the record's outputs have to be correct, too.
pub(super) fn read(task: Task, folder: &Path, verified: Option<&Verified>, again: impl Fn(&Key) -> bool) -> Read {
    let begun = Instant::now();
    let (mut key, mut earlier) = (None, None);
    // The record of a unit that need not be done again. The record of a unit that must be stays in `earlier`.
    let mut finished = |named: &Key| {
        earlier = read_record(folder, named, verified).map(Box::new);
        earlier.take_if(|_| !again(named))
    };
    // A digest that the manifest gives names the outputs before anything is read.
    if let Some(digest) = &task.numbered.unit.digest
        && let Some(record) = finished(key.insert(task.work.key(digest)))
    {
        return Read::Finished(task, record);
    }
    let read = open(&task).and_then(|mut source| {
        let (digest, bytes) = digest_of(&source.files()).map_err(input)?;
        let unit = &task.numbered.unit;
        let differs = unit.digest.as_ref().is_some_and(|d| *d != digest) || unit.bytes.is_some_and(|b| b != bytes);
        if differs {
            let name = task.input.display();
            let fault = format!(
                "{name}: is not what the manifest says: {bytes} bytes, SHA-256 {digest}; make the manifest again"
            );
            return Err(input(fault));
        }
        if key.is_none()
            && let Some(record) = finished(key.insert(task.work.key(&digest)))
        {
            return Ok(Err(record));
        }
        contents(&task, &mut *source).map(Ok)
    });
    let seconds = begun.elapsed().as_secs_f64();
    match (read, key) {
        (Ok(Ok(contents)), Some(key)) => Read::Ready { task, key, contents, seconds, earlier },
        (Ok(Err(record)), _) => Read::Finished(task, record),
        (Err(failure), key) => Read::Failed { task, key, failure, seconds },
        (Ok(Ok(_)), None) => Read::Failed { task, key: None, failure: input("the recording has no digest"), seconds },
    }
}

fn open(task: &Task) -> Result<Box<dyn Source>, Failure> {
    let source = source::open_with(&task.input, task.work.geometry.options()).map_err(input)?;
    check_volume(&*source, "--volume", task.work.volume, task.input.display())?;
    Ok(source)
}

fn contents(task: &Task, source: &mut dyn Source) -> Result<Contents, Failure> {
    let work = &*task.work;
    match work.kind {
        Kind::Render => drawable(work, source),
        Kind::Verify => {
            let intact = check_all(task, source)?;
            let drawn = drawable(work, source)?;
            match intact {
                true => Ok(drawn),
                false => Err(input(format!("{}: frames are missing or damaged", task.input.display()))),
            }
        }
        Kind::Convert => convertible(task, source),
        Kind::Measure => measured(task, source).map(Contents::Figures),
    }
}

/// The frames of the chosen volume, in the order of the recording.
fn frames(work: &Work, source: &mut dyn Source) -> Result<Vec<Frame>, Failure> {
    let mut frames = Vec::new();
    frames_of(source, work.volume, |frame| frames.push(frame))?;
    Ok(frames)
}

fn drawable(work: &Work, source: &mut dyn Source) -> Result<Contents, Failure> {
    let frames = frames(work, source)?;
    let mut recorded = recorded(source, work.volume);
    if recorded.needs_levels(&work.layers) {
        let mut histogram = recorded.histogram(&work.layers).map_err(input)?;
        frames.iter().for_each(|frame| histogram.take(&frame.bytes));
        recorded.levels = histogram.levels();
    }
    let scene = recorded.scene(&work.layers).map_err(input)?;
    let mut is_there = vec![false; scene.geometry.slices()];
    frames.iter().for_each(|frame| is_there.iter_mut().skip(frame.slice).take(1).for_each(|there| *there = true));
    let is_whole = is_there.iter().all(|there| *there);
    Ok(Contents::Frames { scene: Box::new(scene), frames, is_whole })
}

/// Reads every frame of every volume. Returns false if there are fewer than the recording states.
fn check_all(task: &Task, source: &mut dyn Source) -> Result<bool, Failure> {
    // The description of a .frames file counts damaged frames, which are left out otherwise.
    let facts = source::description(&task.input, task.work.geometry.options()).map_err(input)?;
    let is_damaged = facts.rows.iter().any(|(title, value)| title == "damaged" && value != "0 frames");
    source.skip_to_volume(0).map_err(input)?;
    let (expected, mut there) = (source.volumes() * source.frames_per_volume(), 0);
    while there < expected && source.next_frame().map_err(input)?.is_some() {
        there += 1;
    }
    Ok(there == expected && !is_damaged)
}

fn convertible(task: &Task, source: &mut dyn Source) -> Result<Contents, Failure> {
    let work = &*task.work;
    let name = task.input.display();
    let target = Target::of(source, work.volume, work.spacing);
    let mut target = target.map_err(|why| input(format!("{name}: {why}")))?;
    target.outside = work.outside.unwrap_or(target.outside);
    target.check(Path::new(&work.output)).map_err(input)?;
    let mut volume = Volume::new(source.geometry(work.volume), source.stored_type());
    frames(work, source)?.into_iter().for_each(|frame| volume.take(frame));
    Ok(Contents::Volume { volume: Box::new(volume), target: Box::new(target) })
}

/// The output of `info` without patient fields, and statistics of the volume's samples in the file's own units.
fn measured(task: &Task, source: &mut dyn Source) -> Result<Map<String, Value>, Failure> {
    let facts = source::description(&task.input, task.work.geometry.options()).map_err(input)?;
    let mut figures = Map::new();
    // Where a probe file lies differs between machines.
    let facts = facts.rows.into_iter().filter(|(title, _)| title != "geometry from");
    let facts: Map<String, Value> = facts.map(|(title, value)| (title, value.into())).collect();
    figures.insert("recording".into(), facts.into());
    let frames = frames(&task.work, source)?;
    let (shift, stored, range) = (source.sample_type().shift(), source.stored_type(), source.range());
    let mut statistics = Statistics::default();
    frames.iter().for_each(|frame| stored.for_each(&frame.bytes, |value| statistics.take(value, range)));
    figures.insert("frames".into(), frames.len().into());
    figures.insert("samples".into(), statistics.figures(shift));
    Ok(figures)
}

/// Running statistics by Welford's method, which loses no digits where the mean is far from 0.
#[derive(Default)]
struct Statistics {
    count: u64,
    mean: f64,
    squares: f64,
    least: Option<f64>,
    greatest: Option<f64>,
    lowest: u64,
    highest: u64,
}

impl Statistics {
    fn take(&mut self, value: f64, [low, high]: [f64; 2]) {
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
        self.least = Some(self.least.map_or(value, |least| least.min(value)));
        self.greatest = Some(self.greatest.map_or(value, |greatest| greatest.max(value)));
        self.lowest += u64::from(value <= low);
        self.highest += u64::from(value >= high);
    }

    fn figures(&self, shift: f64) -> Value {
        let share = |n: u64| if self.count > 0 { n as f64 / self.count as f64 } else { 0.0 };
        json!({
            "count": self.count,
            "least": self.least.map(|v| v - shift),
            "greatest": self.greatest.map(|v| v - shift),
            "mean": (self.count > 0).then_some(self.mean - shift),
            "standard_deviation": (self.count > 0).then(|| (self.squares / self.count as f64).sqrt()),
            "share_at_lowest": share(self.lowest),
            "share_at_highest": share(self.highest),
        })
    }
}

/// A path as text for messages: its first 300 characters, with invisible ones escaped.
pub fn shown(path: &Path) -> String {
    escaped(&path.display().to_string(), 300)
}
