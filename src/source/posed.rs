//! Pictures that each carry a pose, as a freehand volume: while they arrive ([`Posed`]), and from a file ([`PosedVolume`]).

use super::frame::{Frame, Header, Source};
use super::freehand::{Compounder, CompoundingOptions, Lattice, Pose, TrackedFrame};
use super::live::Event;
use super::samples::{SampleType, StoredType};
use super::tracked::world_of;
use crate::files::InputError;
use crate::probe::{Geometry, Grid, World};
use glam::{DAffine3, DMat3, DVec3};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The volume is placed around so many first pictures, or those of ten seconds or of 256 MiB.
const FIRST: usize = 100;
const MAX_FIRST_WAIT: Duration = Duration::from_secs(10);
const MAX_FIRST_BYTES: usize = 256 << 20;
/// The volume is emitted at this interval while pictures arrive, or after this number of them.
const UPDATE: Duration = Duration::from_millis(500);
const PICTURES: usize = 64;

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
/// Memory: the first pictures (256 MiB), that of a [`Compounder`], and a copy of its samples while a volume is emitted.
pub struct Posed {
    options: CompoundingOptions,
    /// Of the pictures; None: the present frames are not posed pictures.
    header: Option<Header>,
    buffered: Vec<(Pose, Vec<u8>)>,
    buffered_bytes: usize,
    compounder: Option<Compounder>,
    /// When the first picture arrived that was not emitted yet, and how many have since.
    since: Option<Instant>,
    pictures: usize,
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
        Posed {
            options,
            header: None,
            buffered: Vec::new(),
            buffered_bytes: 0,
            compounder: None,
            since: None,
            pictures: 0,
            time: None,
            volumes: 0,
            begun: false,
            without: 0,
            outside: 0,
        }
    }

    /// What becomes of an event: itself, or volumes of the pictures so far. A volume is emitted by an event after its interval, of any kind.
    pub fn take(&mut self, event: Event) -> Vec<Event> {
        let mut events = Vec::new();
        match event {
            Event::Begin(header) => {
                self.emit(true, &mut events);
                *self = Posed { volumes: self.volumes, ..Posed::new(self.options.clone()) };
                match is_posed(&header) {
                    true => self.header = Some(*header),
                    false => events.push(Event::Begin(header)),
                }
            }
            Event::Frame(frame) if self.header.is_some() => {
                self.picture(frame, &mut events);
                self.emit(false, &mut events);
            }
            Event::Lines { .. } if self.header.is_some() => {
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
        let Some(Header { forward: Geometry::Cartesian(grid), stored, .. }) = &self.header else { return };
        let Some(pose) = frame.pose else {
            self.without += 1;
            return;
        };
        let pose = placed(grid, &pose);
        self.time = frame.time;
        self.since.get_or_insert_with(Instant::now);
        self.pictures += 1;
        match &mut self.compounder {
            Some(compounder) => push(compounder, pose, &frame.bytes, &mut self.outside, events),
            None if frame.bytes.len() == pose.size[0] * pose.size[1] * stored.bytes() => {
                self.buffered_bytes += frame.bytes.len();
                self.buffered.push((pose, frame.bytes));
            }
            None => events.push(Event::Fault("a picture has another number of samples than was announced".into())),
        }
    }

    /// Emits the volume if that is due. `at_once`: no more pictures come.
    fn emit(&mut self, at_once: bool, events: &mut Vec<Event>) {
        let Some(waited) = self.since.map(|since| since.elapsed()) else { return };
        let is_first = self.compounder.is_none();
        let is_due = match is_first {
            true => self.buffered.len() >= FIRST || self.buffered_bytes >= MAX_FIRST_BYTES || waited >= MAX_FIRST_WAIT,
            false => self.pictures >= PICTURES || waited >= UPDATE,
        };
        if !is_due && !at_once {
            return;
        }
        if is_first {
            self.begin(events);
        }
        (self.since, self.pictures) = (None, 0);
        for (count, why) in [
            (std::mem::take(&mut self.without), "pictures without a valid pose are left out"),
            (std::mem::take(&mut self.outside), "pictures lie outside of the volume, which is around the first ones"),
        ] {
            if count > 0 {
                events.push(Event::Fault(format!("{count} {why}")));
            }
        }
        let (Some(compounder), Some(pictures)) = (&mut self.compounder, &self.header) else { return };
        if compounder.changed_slices().is_empty() {
            return;
        }
        let lattice = compounder.lattice();
        if !std::mem::replace(&mut self.begun, true) {
            let geometry = Geometry::Cartesian(lattice.grid);
            let (forward, backward) = (geometry.clone(), geometry);
            events.push(Event::Begin(Box::new(Header { forward, backward, ..pictures.clone() })));
        }
        let pose = Some(lattice.to_volume.inverse());
        let (volume, time) = (self.volumes, self.time);
        self.volumes = self.volumes.wrapping_add(1);
        for slice in 0..lattice.grid.size[2] {
            let bytes = compounder.slice(slice).unwrap_or_default().to_vec();
            events.push(Event::Frame(Frame {
                volume,
                number: slice as u32,
                slice,
                backward: false,
                time,
                pose,
                bytes,
            }));
        }
    }

    /// Places the volume around the first pictures and compounds them.
    fn begin(&mut self, events: &mut Vec<Event>) {
        let Some(stored) = self.header.as_ref().map(|header| header.stored) else { return };
        let buffered = std::mem::take(&mut self.buffered);
        self.buffered_bytes = 0;
        let poses: Vec<Pose> = buffered.iter().map(|(pose, _)| *pose).collect();
        let made = Lattice::around(&poses, &self.options)
            .and_then(|lattice| Compounder::new(lattice, stored, self.options.clone()));
        match made {
            Ok(mut compounder) => {
                for (pose, bytes) in &buffered {
                    push(&mut compounder, *pose, bytes, &mut self.outside, events);
                }
                self.compounder = Some(compounder);
            }
            Err(fault) => events.push(Event::Fault(format!("no volume for the pictures: {fault}"))),
        }
    }
}

fn push(compounder: &mut Compounder, pose: Pose, bytes: &[u8], outside: &mut u64, events: &mut Vec<Event>) {
    match compounder.push(&TrackedFrame { pose, stored: compounder.stored(), bytes }) {
        Ok(0) => *outside += 1,
        Ok(_) => {}
        Err(fault) => events.push(Event::Fault(format!("a picture is refused: {fault}"))),
    }
}

/// Posed pictures of a file as one freehand volume.
///
/// Memory: the poses, and that of a [`Compounder`] from the first slice on.
pub(super) struct PosedVolume {
    path: PathBuf,
    pictures: Box<dyn Source>,
    grid: Grid,
    lattice: Lattice,
    world: World,
    options: CompoundingOptions,
    compounder: Option<Compounder>,
    next: usize,
}

impl PosedVolume {
    /// The pictures as a volume; unchanged if they are none. All of them are read once for their poses.
    ///
    /// # Errors
    /// A file that cannot be read, no picture with a pose.
    pub fn of(path: &Path, mut pictures: Box<dyn Source>) -> Result<Box<dyn Source>, InputError> {
        let header = pictures.header();
        let grid = match &header.forward {
            Geometry::Cartesian(grid) if is_posed(&header) => *grid,
            _ => return Ok(pictures),
        };
        let (mut poses, mut all) = (Vec::new(), 0);
        while let Some(frame) = pictures.next_frame()? {
            all += 1;
            poses.extend(frame.pose.map(|pose| placed(&grid, &pose)));
        }
        let fault = |fault: String| InputError::new(path, "poses", fault);
        let options = CompoundingOptions { margin: 0.0, ..CompoundingOptions::default() };
        let lattice = Lattice::around(&poses, &options).map_err(fault)?;
        let world = world_of(&lattice).map_err(fault)?;
        let without = all - poses.len();
        if without > 0 {
            tracing::warn!(file = %super::describe::path(path), "{without} of {all} pictures have no valid pose; left out");
        }
        pictures.skip_to_volume(0)?;
        let path = path.to_path_buf();
        Ok(Box::new(PosedVolume { path, pictures, grid, lattice, world, options, compounder: None, next: 0 }))
    }

    fn compound(&mut self) -> Result<Compounder, InputError> {
        let fault = |fault: String| InputError::new(&self.path, "frames", fault);
        let stored = self.pictures.stored_type();
        let mut compounder = Compounder::new(self.lattice, stored, self.options.clone()).map_err(fault)?;
        self.pictures.skip_to_volume(0)?;
        while let Some(frame) = self.pictures.next_frame()? {
            let Some(pose) = frame.pose.map(|pose| placed(&self.grid, &pose)) else { continue };
            compounder.push(&TrackedFrame { pose, stored, bytes: &frame.bytes }).map_err(fault)?;
        }
        compounder.changed_slices();
        Ok(compounder)
    }
}

impl Source for PosedVolume {
    fn geometry(&self, _: usize) -> Geometry {
        Geometry::Cartesian(self.lattice.grid)
    }

    fn stored_type(&self) -> StoredType {
        self.pictures.stored_type()
    }

    fn sample_type(&self) -> SampleType {
        self.pictures.sample_type()
    }

    fn range(&self) -> [f64; 2] {
        self.pictures.range()
    }

    fn volumes(&self) -> usize {
        1
    }

    fn frames_per_volume(&self) -> usize {
        self.lattice.grid.size[2]
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        if volume > 0 {
            return Err(InputError::new(&self.path, "volume", format!("there is no {volume}, the last is 0")));
        }
        self.next = 0;
        Ok(())
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        if self.compounder.is_none() {
            self.compounder = Some(self.compound()?);
        }
        let slice = self.next;
        let Some(bytes) = self.compounder.as_ref().and_then(|compounder| compounder.slice(slice)) else {
            return Ok(None);
        };
        let (number, bytes) = (slice as u32, bytes.to_vec());
        self.next += 1;
        Ok(Some(Frame { volume: 0, number, slice, backward: false, time: None, pose: None, bytes }))
    }

    fn files(&self) -> Vec<PathBuf> {
        self.pictures.files()
    }

    fn world(&self) -> Option<World> {
        Some(self.world)
    }
}
