//! Pictures that each carry a pose, as a freehand volume: while they arrive ([`Posed`]), and from a file ([`Opened`]).

use super::frame::{Header, Source, file_bytes};
use super::freehand::{
    AT_ITS_LIMIT, CompoundingOptions, FreehandArguments, FreehandFile, PlacedPicture, PlacedPictures, Pose, Refusal,
    Schedule, Sweep,
};
use super::live::Event;
use crate::Frame;
use crate::files::{InputError, progress};
use crate::probe::{Geometry, Grid};
use glam::{DAffine3, DMat3, DVec3};
use std::path::Path;
use std::time::{Duration, Instant};

/// What is left out is reported at most so often.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);

/// True if the frames are single pictures that have poses.
pub(crate) fn is_posed(header: &Header) -> bool {
    header.posed && matches!(&header.forward, Geometry::Cartesian(grid) if grid.size[2] == 1)
}

/// Where the pixels of a picture are. `grid`: its own lattice, mm; `pose`: from there to the tracker.
fn placed(grid: &Grid, pose: &DAffine3) -> Pose {
    let [x, y, _] = grid.spacing;
    let own = DMat3::from_diagonal(DVec3::new(x, y, 1.0));
    let own = DAffine3::from_mat3_translation(own, grid.origin.into());
    Pose { to_space: *pose * own, size: [grid.size[0], grid.size[1]] }
}

/// Compounds pictures with poses into volumes as they arrive. Events of other frames pass unchanged.
///
/// Memory: that of a [`Sweep`], and a copy of its samples while a volume is emitted.
pub struct Posed {
    options: CompoundingOptions,
    /// Of the pictures, and their volume; None: the present frames are not posed pictures.
    sweep: Option<(Header, Sweep)>,
    time: Option<f64>,
    volumes: u32,
    /// The grid of the header that was emitted last.
    begun: Option<Grid>,
    left_out: LeftOut,
    /// Pictures without a pose, and all that are in no volume of an earlier header.
    lost: u64,
}

/// Pictures that were left out since the last report.
#[derive(Default)]
struct LeftOut {
    /// When the first of them was.
    since: Option<Instant>,
    without: u64,
    outside: u64,
    refused: u64,
    /// Why the last picture was refused.
    why: String,
    /// Why no volume could be placed.
    unplaced: Option<String>,
}

impl LeftOut {
    fn without_pose(&mut self) {
        self.since.get_or_insert_with(Instant::now);
        self.without += 1;
    }

    fn refused(&mut self, refusal: Refusal) {
        self.since.get_or_insert_with(Instant::now);
        match refusal {
            Refusal::Outside => self.outside += 1,
            Refusal::Picture(why) => (self.refused, self.why) = (self.refused + 1, why),
            Refusal::Volume(why) => self.unplaced = Some(why),
        }
    }

    /// Reports them if that is due. `at_once`: no more pictures come.
    fn report(&mut self, at_once: bool, events: &mut Vec<Event>) {
        if !self.since.is_some_and(|since| at_once || since.elapsed() >= REPORT_INTERVAL) {
            return;
        }
        let LeftOut { without, outside, refused, why, unplaced, .. } = std::mem::take(self);
        for (count, what) in [
            (without, "pictures without a valid pose are left out".to_string()),
            (outside, format!("pictures do not lie wholly in the volume; {AT_ITS_LIMIT}")),
            (refused, format!("pictures are refused, the last: {why}")),
        ] {
            if count > 0 {
                events.push(Event::Fault(format!("{count} {what}")));
            }
        }
        events.extend(unplaced.map(|why| Event::Fault(format!("no volume for the pictures: {why}"))));
    }
}

impl Posed {
    pub fn new(options: CompoundingOptions) -> Posed {
        Posed { options, sweep: None, time: None, volumes: 0, begun: None, left_out: LeftOut::default(), lost: 0 }
    }

    /// Processes an event of the source; returns the events that take its place. The header and the frames of posed pictures are taken into the
    /// volume. Any other event is returned, after those of the volume. The volume is emitted if it has changed and is due by its [`Schedule`], or at
    /// once before another header and before the end. Its events are a header if its grid is new, and a frame for each slice. What was left out is
    /// returned as faults, at most once a second, before another header and at the end.
    pub fn take(&mut self, event: Event) -> Vec<Event> {
        let mut events = Vec::new();
        match event {
            Event::Begin(header) => {
                self.emit(true, &mut events);
                *self = Posed { volumes: self.volumes, lost: self.lost(), ..Posed::new(self.options.clone()) };
                if !is_posed(&header) {
                    events.push(Event::Begin(header));
                    return events;
                }
                let sweep = Sweep::new(self.options.clone(), Schedule::default(), header.stored);
                self.sweep = Some((*header, sweep));
            }
            Event::Frame(frame) if self.sweep.is_some() => {
                self.picture(frame);
                self.emit(false, &mut events);
            }
            other => {
                self.emit(matches!(other, Event::End(_)), &mut events);
                events.push(other);
            }
        }
        events
    }

    /// Number of pictures so far that are not, or not wholly, in a volume.
    pub fn lost(&self) -> u64 {
        self.lost + self.sweep.as_ref().map_or(0, |(_, sweep)| sweep.left_out())
    }

    fn picture(&mut self, frame: Frame) {
        let Some((Header { forward: Geometry::Cartesian(grid), .. }, sweep)) = &mut self.sweep else { return };
        let Some(pose) = frame.pose else {
            self.lost += 1;
            return self.left_out.without_pose();
        };
        self.time = frame.time;
        if let Err(refusal) = sweep.push(placed(grid, &pose), frame.bytes) {
            self.left_out.refused(refusal);
        }
    }

    /// Emits the volume if that is due. `at_once`: no more pictures come.
    fn emit(&mut self, at_once: bool, events: &mut Vec<Event>) {
        let Some((pictures, sweep)) = &mut self.sweep else { return };
        let changed = sweep.update(at_once, |refusal| self.left_out.refused(refusal));
        self.left_out.report(at_once, events);
        let Some(lattice) = sweep.lattice().filter(|_| changed == Some(true)) else { return };
        if self.begun.replace(lattice.grid) != Some(lattice.grid) {
            let geometry = Geometry::Cartesian(lattice.grid);
            let (forward, backward) = (geometry.clone(), geometry);
            events.push(Event::Begin(Box::new(Header { forward, backward, ..pictures.clone() })));
        }
        let pose = Some(lattice.to_volume.inverse());
        let (volume, time) = (self.volumes, self.time);
        self.volumes = self.volumes.wrapping_add(1);
        for slice in 0..lattice.grid.size[2] {
            let bytes = sweep.slice(slice).unwrap_or_default().to_vec();
            events.push(Event::Frame(Frame { time, pose, ..Frame::of_slice(volume, slice, bytes) }));
        }
    }
}

/// The pictures of a file whose frames state their poses.
pub(super) struct PosedPictures {
    pictures: Box<dyn Source>,
    grid: Grid,
}

impl PlacedPictures for PosedPictures {
    fn pictures(&self) -> &dyn Source {
        &*self.pictures
    }

    fn rewind(&mut self) -> Result<(), InputError> {
        self.pictures.skip_to_volume(0)
    }

    fn next(&mut self) -> Result<Option<PlacedPicture>, InputError> {
        let frame = self.pictures.next_frame()?;
        Ok(frame.map(|frame| (frame.pose.map(|pose| placed(&self.grid, &pose)), frame.bytes)))
    }
}

/// A freehand volume from pictures that state their poses.
pub(super) type PosedVolume = FreehandFile<PosedPictures>;

/// The frames of an opened file: as stored, or compounded into a freehand volume.
pub(super) enum Opened {
    Volume(Box<PosedVolume>),
    Frames(Box<dyn Source>),
}

impl Opened {
    /// Makes one freehand volume of the 2D pictures of a file that announces poses; pictures without a valid one are left out. Frames of other
    /// files stay unchanged, and so do pictures that all have the same pose, as a series in time. All pictures are read once for their poses.
    ///
    /// # Errors
    /// The file cannot be read, it announces poses but no picture has a valid one, the volume is too large, an argument is out of its range, or
    /// arguments for a freehand volume are given where there is none.
    pub fn new(path: &Path, mut frames: Box<dyn Source>, said: FreehandArguments) -> Result<Opened, InputError> {
        let header = frames.header();
        let grid = match &header.forward {
            Geometry::Cartesian(grid) if is_posed(&header) => *grid,
            _ => return Opened::unchanged(path, frames, said),
        };
        let (mut poses, mut first, mut is_moved) = (Vec::new(), None, false);
        // For their poses, and again to be compounded.
        progress::expect_bytes(2 * file_bytes(&*frames));
        while let Some(frame) = frames.next_frame()? {
            is_moved |= frame.pose.is_some_and(|pose| *first.get_or_insert(pose) != pose);
            poses.push(frame.pose.map(|pose| placed(&grid, &pose)));
        }
        if first.is_some() && !is_moved {
            frames.skip_to_volume(0)?;
            return Opened::unchanged(path, frames, said);
        }
        let options = said.over(CompoundingOptions { margin: 0.0, ..CompoundingOptions::default() });
        let pictures = PosedPictures { pictures: frames, grid };
        Ok(Opened::Volume(Box::new(FreehandFile::around(path, pictures, &poses, options)?)))
    }

    fn unchanged(path: &Path, frames: Box<dyn Source>, said: FreehandArguments) -> Result<Opened, InputError> {
        said.refused(path)?;
        Ok(Opened::Frames(frames))
    }

    pub fn source(self) -> Box<dyn Source> {
        match self {
            Opened::Volume(volume) => volume,
            Opened::Frames(frames) => frames,
        }
    }

    /// A description for users. `of_frames`: the description of the stored frames.
    pub fn description(&self, of_frames: Vec<(String, String)>) -> Vec<(String, String)> {
        let Opened::Volume(volume) = self else { return of_frames };
        let format = of_frames.iter().find(|(title, _)| title == "format").map_or("frames", |(_, format)| format);
        let placed = vec![("placed".into(), "by the pose of each picture, in the tracker's space".into())];
        let mut rows = volume.describe(format, placed, "the tracker's space");
        // What the volume has too is that of the volume.
        let of_pictures = ["frame", "frames", "volumes"];
        let is_of_file = |title: &str| !of_pictures.contains(&title) && rows.iter().all(|(there, _)| there != title);
        let of_file: Vec<_> = of_frames.into_iter().filter(|(title, _)| is_of_file(title)).collect();
        rows.extend(of_file);
        rows
    }
}
