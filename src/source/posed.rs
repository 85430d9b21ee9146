//! Pictures that each carry a pose, as a freehand volume: while they arrive ([`Posed`]), and from a file ([`as_volume`]).

use super::frame::{Frame, Header, Source};
use super::freehand::{
    CompoundingOptions, FreehandFile, PlacedPicture, PlacedPictures, Pose, Refusal, Schedule, Sweep,
};
use super::live::Event;
use crate::files::InputError;
use crate::probe::{Geometry, Grid};
use glam::{DAffine3, DMat3, DVec3};
use std::path::Path;

/// True if the frames are single pictures with poses.
pub fn is_posed(header: &Header) -> bool {
    header.posed && matches!(&header.forward, Geometry::Cartesian(grid) if grid.size[2] == 1)
}

/// Where the pixels of a picture are. `grid`: its own lattice, mm; `pose`: from there to the tracker.
fn placed(grid: &Grid, pose: &DAffine3) -> Pose {
    let [x, y, _] = grid.spacing;
    let own = DMat3::from_diagonal(DVec3::new(x, y, 1.0));
    let own = DAffine3::from_mat3_translation(own, grid.origin.into());
    Pose { to_space: *pose * own, size: [grid.size[0], grid.size[1]] }
}

/// Compounds posed pictures as they arrive. Events of other frames pass unchanged.
///
/// Memory: that of a [`Sweep`], and a copy of its samples while a volume is emitted.
pub struct Posed {
    options: CompoundingOptions,
    /// Of the pictures, and their volume; None: the present frames are not posed pictures.
    sweep: Option<(Header, Sweep)>,
    time: Option<f64>,
    volumes: u32,
    /// The header of the volume was emitted.
    begun: bool,
    /// Pictures left out since the last report: without a pose, and outside of the volume.
    without: u64,
    outside: u64,
}

impl Posed {
    pub fn new(options: CompoundingOptions) -> Posed {
        Posed { options, sweep: None, time: None, volumes: 0, begun: false, without: 0, outside: 0 }
    }

    /// What becomes of an event: itself, or volumes of the pictures so far. A volume is emitted by an event after its interval, of any kind.
    pub fn take(&mut self, event: Event) -> Vec<Event> {
        let mut events = Vec::new();
        match event {
            Event::Begin(header) => {
                self.emit(true, &mut events);
                *self = Posed { volumes: self.volumes, ..Posed::new(self.options.clone()) };
                match is_posed(&header) {
                    true => {
                        let sweep = Sweep::new(self.options.clone(), Schedule::default(), header.stored);
                        self.sweep = Some((*header, sweep));
                    }
                    false => events.push(Event::Begin(header)),
                }
            }
            Event::Frame(frame) if self.sweep.is_some() => {
                self.picture(frame, &mut events);
                self.emit(false, &mut events);
            }
            Event::Lines { .. } if self.sweep.is_some() => {
                events.push(Event::Fault("posed pictures must come whole, not in parts of lines".into()));
            }
            Event::End(why) => {
                self.emit(true, &mut events);
                events.push(Event::End(why));
            }
            other => {
                self.emit(false, &mut events);
                events.push(other);
            }
        }
        events
    }

    fn picture(&mut self, frame: Frame, events: &mut Vec<Event>) {
        let Some((Header { forward: Geometry::Cartesian(grid), .. }, sweep)) = &mut self.sweep else { return };
        let Some(pose) = frame.pose else {
            self.without += 1;
            return;
        };
        self.time = frame.time;
        if let Err(refusal) = sweep.push(placed(grid, &pose), frame.bytes) {
            note(refusal, &mut self.outside, events);
        }
    }

    /// Emits the volume if that is due. `at_once`: no more pictures come.
    fn emit(&mut self, at_once: bool, events: &mut Vec<Event>) {
        let Some((pictures, sweep)) = &mut self.sweep else { return };
        let changed = sweep.update(at_once, |refusal| note(refusal, &mut self.outside, events));
        if changed.is_none() && !at_once {
            return;
        }
        for (count, why) in [
            (std::mem::take(&mut self.without), "pictures without a valid pose are left out"),
            (std::mem::take(&mut self.outside), "pictures lie outside of the volume, which is around the first ones"),
        ] {
            if count > 0 {
                events.push(Event::Fault(format!("{count} {why}")));
            }
        }
        let Some(lattice) = sweep.lattice().filter(|_| changed == Some(true)) else { return };
        if !std::mem::replace(&mut self.begun, true) {
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

/// Counts a picture outside of the volume, and reports every other one that is refused.
fn note(refusal: Refusal, outside: &mut u64, events: &mut Vec<Event>) {
    match refusal {
        Refusal::Outside => *outside += 1,
        Refusal::Picture(fault) => events.push(Event::Fault(format!("a picture is refused: {fault}"))),
        Refusal::Volume(fault) => events.push(Event::Fault(format!("no volume for the pictures: {fault}"))),
    }
}

/// Posed pictures of a file.
struct PosedPictures {
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

/// Posed pictures of a file as one freehand volume; other frames unchanged. Pictures of one place are no sweep but a series in time, and stay
/// what they are. All pictures are read once for their poses.
///
/// # Errors
/// A file that cannot be read, no picture with a pose.
pub(super) fn as_volume(path: &Path, mut pictures: Box<dyn Source>) -> Result<Box<dyn Source>, InputError> {
    let header = pictures.header();
    let grid = match &header.forward {
        Geometry::Cartesian(grid) if is_posed(&header) => *grid,
        _ => return Ok(pictures),
    };
    let (mut poses, mut first, mut is_moved) = (Vec::new(), None, false);
    while let Some(frame) = pictures.next_frame()? {
        is_moved |= frame.pose.is_some_and(|pose| *first.get_or_insert(pose) != pose);
        poses.push(frame.pose.map(|pose| placed(&grid, &pose)));
    }
    if first.is_some() && !is_moved {
        pictures.skip_to_volume(0)?;
        return Ok(pictures);
    }
    let options = CompoundingOptions { margin: 0.0, ..CompoundingOptions::default() };
    Ok(Box::new(FreehandFile::around(path, PosedPictures { pictures, grid }, &poses, options)?))
}
