//! OpenIGTLink as a live source: Cartesian volumes, and tracked 2D frames that are compounded into a volume.
//!
//! An IMAGE of several slices is a Cartesian volume; one with only some complete slices of it updates those. An IMAGE of one slice is a
//! frame of a freehand sweep. After a change, all slices of the volume are emitted under a new volume number, so that the receiver
//! always gets complete volumes and need not know their origin.

use super::cartesian::{CartesianVolume, Taken, other_coordinates};
use super::client::{Client, ClientOptions, ClientStatistics};
use super::codec::BODY_LIMIT;
use super::faults::{FaultKind, Faults};
use super::message::{Coordinates, Image, Message};
use super::names::Names;
use super::pairing::{PairedFrame, Pairing};
use super::pixels::{range_of, samples, stored};
use crate::files::quoted;
use crate::freehand::{AT_ITS_LIMIT, CompoundingOptions, Pose, Refusal, Schedule, Sweep};
use crate::live::{Event, Live};
use crate::probe::{Geometry, StoredType, is_rigid};
use crate::tree::Defaults;
use crate::value_range::ValueRange;
use crate::{Frame, Header};
use glam::DAffine3;
use std::io;
use std::time::{Duration, Instant};

/// Where the poses of 2D frames come from.
#[derive(Clone, Debug, PartialEq)]
pub enum Poses {
    /// From TRANSFORM and TDATA messages. `device`: name of the TRANSFORM's device or of the TDATA's tool; None: any TRANSFORM. `tolerance`: largest
    /// difference between the time stamps of a frame and its pose, s. `patience`: time by which later frames may be ahead of one that still waits for
    /// a later pose, s.
    Messages { device: Option<String>, tolerance: f64, patience: f64 },
    /// From the matrix of each image.
    Image,
}

/// Options of a [`Network`].
#[derive(Clone, Debug, Defaults)]
pub struct NetworkOptions {
    pub client: ClientOptions,
    /// Name of the device whose images are used; None: images of all devices.
    pub device: Option<String>,
    #[value(Poses::Messages { device: None, tolerance: 0.1, patience: 1.0 })]
    pub poses: Poses,
    #[value(CompoundingOptions { margin: 20.0, ..CompoundingOptions::default() })]
    pub freehand: CompoundingOptions,
    /// When the volume of a freehand sweep is placed, and when it is emitted.
    pub schedule: Schedule,
    /// Largest Cartesian volume that is accepted, bytes of stored samples.
    #[value(BODY_LIMIT)]
    pub volume_bytes: usize,
}

/// How often the statistics are checked while nothing arrives.
const POLL: Duration = Duration::from_millis(100);
/// Messages that are processed even if no time is left, so that a caller with zero patience makes progress.
const MAX_AT_ONCE: usize = 256;
/// 2D images before the first transform from which on they count as untracked: a server may send an image before its transform.
const UNTRACKED: u64 = 2;
/// First 2D images in one place from which on they count as untracked: a tracker is never so still.
const STILL: u64 = 10;
/// What a user can do about that.
const REMEDY: &str = "let the server send the TRANSFORM or TDATA of a tracked probe (--tool NAME), or IMAGEs with its matrix (--tool image); \
                      frames of a probe with a motor come by a pipe (--source -, --motor)";

/// A live source: the images of an OpenIGTLink server. It reconnects whenever the connection is lost, and never ends by itself.
///
/// No messages are processed while slices are emitted; messages that then exceed the client's queue are dropped and counted. Faults are
/// reported as [`Event::Fault`], each kind at most once a second and with its count.
///
/// Memory: that of the [`Client`], one volume of at most `volume_bytes` and its message, the first frames of a sweep (256 MiB), and that
/// of a [`Compounder`](crate::freehand::Compounder) and a [`Pairing`].
pub struct Network {
    client: Client,
    /// Statistics that were reported as faults.
    known: ClientStatistics,
    last_error: Option<String>,
    /// There was at least one connection.
    connected: bool,
    /// Lost connections.
    lost: u64,
    faults: Faults,
    whole: Option<CartesianVolume>,
    sweep: TrackedImages,
    volume_bytes: usize,
    device: Option<String>,
    /// Devices of images that came.
    devices: Names,
    /// Header of the last `Begin`.
    begun: Option<Header>,
    output: Option<VolumeOutput>,
    volumes: u32,
}

/// A volume whose slices are being emitted.
struct VolumeOutput {
    of_sweep: bool,
    begin: bool,
    volume: u32,
    next: usize,
    time: Option<f64>,
    pose: Option<DAffine3>,
}

impl Network {
    /// Starts to connect to a server; `address` is that of [`Client::connect`]. If the server cannot be reached, the source keeps trying.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn connect(address: &str, options: NetworkOptions) -> io::Result<Network> {
        Ok(Network {
            client: Client::connect(address, options.client.clone())?,
            known: ClientStatistics::default(),
            last_error: None,
            connected: false,
            lost: 0,
            faults: Faults::new(address),
            whole: None,
            volume_bytes: options.volume_bytes,
            device: options.device.clone(),
            devices: Names::new(options.device.clone()),
            sweep: TrackedImages::new(options),
            begun: None,
            output: None,
            volumes: 0,
        })
    }

    /// Counts and state of the connection.
    pub fn statistics(&self) -> ClientStatistics {
        self.client.statistics()
    }

    /// Records what happened to the connection since the last call.
    fn check_connection(&mut self) {
        let now = self.client.statistics();
        let error = self.client.last_error();
        let why = error.as_deref().unwrap_or("no reason is known");
        let (known, faults) = (&self.known, &mut self.faults);
        faults.note(FaultKind::Checksum, now.checksum_failures - known.checksum_failures, why);
        faults.note(FaultKind::Malformed, now.malformed - known.malformed, why);
        faults.note(FaultKind::Dropped, now.dropped - known.dropped, "they came faster than they were taken");
        faults.note(FaultKind::Again, now.reconnects - known.reconnects, "");
        // Every connection except the present one was lost.
        self.connected |= now.connected || now.bytes > 0 || now.reconnects > 0;
        let lost = now.reconnects + u64::from(self.connected) - u64::from(now.connected);
        faults.note(FaultKind::Lost, lost.saturating_sub(self.lost), why);
        let is_reported = lost > self.lost || error == self.last_error;
        if !now.connected && !is_reported && error.is_some() {
            faults.note(FaultKind::Unreachable, 1, why);
        }
        (self.known, self.last_error, self.lost) = (now, error, lost);
    }

    /// True if an image is of the device that was chosen. The names of the devices are reported where they decide something.
    fn is_chosen(&mut self, image: &Image) -> bool {
        let is_new = self.devices.add(&image.device);
        match &self.device {
            None if is_new && self.devices.count() > 1 => {
                let why = format!("{}; --device-name takes one of them", self.devices.list());
                self.faults.note(FaultKind::Devices, 1, &why);
            }
            Some(device) if image.device != *device => {
                if !self.devices.contains(device) {
                    let why = format!("no image of {} came; there are {}", quoted(device), self.devices.list());
                    self.faults.note(FaultKind::Image, 1, &why);
                }
                return false;
            }
            _ => {}
        }
        true
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Image(image) if !self.is_chosen(&image) => {}
            Message::Image(image) if image.size[2] > 1 => {
                let time = (image.time > 0.0).then_some(image.time);
                match CartesianVolume::take(&mut self.whole, image, self.volume_bytes) {
                    Ok(Taken { replaced, is_whole, missing }) => {
                        self.faults.note(FaultKind::Samples, replaced, "they read as 0");
                        let why = format!("{missing} of its slices did not come");
                        self.faults.note(FaultKind::Incomplete, u64::from(missing > 0), &why);
                        if is_whole {
                            self.start_output(false, time);
                        }
                    }
                    Err(fault) => self.faults.note(FaultKind::Image, 1, &fault),
                }
            }
            other => self.sweep.take(other, &mut self.faults),
        }
    }

    /// Starts to emit a volume.
    fn start_output(&mut self, of_sweep: bool, time: Option<f64>) {
        let found = match of_sweep {
            true => self.sweep.header().map(|header| (header, self.sweep.pose())),
            false => self.whole.as_ref().map(|whole| (whole.header(), whole.pose)),
        };
        let Some((header, pose)) = found else { return };
        if let Err((field, fault)) = header.check() {
            return self.faults.note(FaultKind::Image, 1, &format!("{field} {fault}"));
        }
        let begin = self.begun.as_ref() != Some(&header);
        self.begun = Some(header);
        self.output = Some(VolumeOutput { of_sweep, begin, volume: self.volumes, next: 0, time, pose });
        self.volumes = self.volumes.wrapping_add(1);
    }

    /// The next event of the volume that is being emitted.
    fn next_output(&mut self) -> Option<Event> {
        let output = self.output.as_mut()?;
        if std::mem::take(&mut output.begin) {
            return self.begun.clone().map(|header| Event::Begin(Box::new(header)));
        }
        let k = output.next;
        output.next += 1;
        let slice = match output.of_sweep {
            true => self.sweep.sweep.slice(k),
            false => self.whole.as_ref().and_then(|whole| whole.slice(k)),
        };
        let Some(slice) = slice else {
            self.output = None;
            return None;
        };
        let (volume, time, bytes) = (output.volume, output.time, slice.to_vec());
        Some(Event::Frame(Frame { time, pose: output.pose, ..Frame::of_slice(volume, k, bytes) }))
    }
}

impl Live for Network {
    fn next(&mut self, patience: Duration) -> Event {
        let started = Instant::now();
        let mut taken = 0;
        loop {
            self.check_connection();
            if let Some(fault) = self.faults.due() {
                return Event::Fault(fault);
            }
            if let Some(event) = self.next_output() {
                return event;
            }
            if let Some(time) = self.sweep.update(&mut self.faults) {
                self.start_output(true, time);
                continue;
            }
            let left = patience.saturating_sub(started.elapsed());
            // Poses alone may arrive without end.
            if left.is_zero() && taken >= MAX_AT_ONCE {
                return Event::Idle;
            }
            match self.client.next(left.min(POLL)) {
                Some(received) => self.take(received.message),
                None if left.is_zero() => return Event::Idle,
                None => {}
            }
            taken += 1;
        }
    }

    fn can_wait(&self) -> bool {
        false
    }

    fn left_out(&self) -> u64 {
        self.sweep.lost + self.sweep.sweep.left_out()
    }

    fn disconnected(&self) -> Option<String> {
        let is_connected = self.client.statistics().connected;
        (!is_connected).then(|| self.client.last_error().unwrap_or_else(|| "connecting".into()))
    }
}

/// Images of one slice and their poses: a freehand sweep.
struct TrackedImages {
    poses: Poses,
    freehand: CompoundingOptions,
    schedule: Schedule,
    pairing: Pairing,
    /// Sample type of all frames. A different type begins a new sweep.
    sweep: Sweep,
    /// The values of the frames that the volume is placed around, and then which of them are 0 and 1.
    values: ValueRange,
    range: [f64; 2],
    /// The frames are placed in LPS: by matrices of their own that say so.
    is_lps: bool,
    /// Time stamp of the last frame.
    time: Option<f64>,
    /// 2D images before the first transform.
    untracked: u64,
    /// Where the first frame lies, and how many do before one lies elsewhere.
    first: Option<DAffine3>,
    still: u64,
    /// When the last message came.
    last: Option<Instant>,
    /// Frames without a pose, and all that are in no volume of an earlier sweep.
    lost: u64,
}

impl TrackedImages {
    fn new(options: NetworkOptions) -> TrackedImages {
        let NetworkOptions { poses, freehand, schedule, .. } = options;
        let pairing = match poses.clone() {
            Poses::Messages { device, tolerance, patience } => Pairing::new(device, tolerance, patience),
            Poses::Image => Pairing::new(None, 0.0, 0.0),
        };
        let sweep = Sweep::new(freehand.clone(), schedule.clone(), StoredType::U8);
        let values = ValueRange::new(StoredType::U8);
        let range = [0.0, 255.0];
        TrackedImages {
            poses,
            freehand,
            schedule,
            pairing,
            sweep,
            values,
            range,
            is_lps: false,
            time: None,
            untracked: 0,
            first: None,
            still: 0,
            last: None,
            lost: 0,
        }
    }

    /// Takes frames and poses; skips other messages.
    fn take(&mut self, message: Message, faults: &mut Faults) {
        self.last = Some(Instant::now());
        let is_image = matches!(message, Message::Image(_));
        if is_image && self.poses != Poses::Image && !self.pairing.has_transforms() {
            self.untracked = self.untracked.saturating_add(1);
            if self.untracked == UNTRACKED {
                faults.note(FaultKind::Untracked, 1, &format!("no transform came with them; {REMEDY}"));
            }
        }
        match (message, &self.poses) {
            (Message::Image(image), Poses::Image) => self.frame(image, DAffine3::IDENTITY, faults),
            (message, _) => self.frames(|pairing| pairing.push(message), faults),
        }
    }

    /// Takes the frames that a function pairs with their poses.
    fn frames(&mut self, paired: impl FnOnce(&mut Pairing) -> Vec<PairedFrame>, faults: &mut Faults) {
        let before = self.pairing.counts().dropped;
        for paired in paired(&mut self.pairing) {
            self.frame(paired.image, paired.pose, faults);
        }
        let dropped = self.pairing.counts().dropped - before;
        if dropped > 0 {
            self.lost += dropped;
            faults.note(FaultKind::Unpaired, dropped, &self.pairing.why_unpaired());
        }
    }

    fn frame(&mut self, image: Image, pose: DAffine3, faults: &mut Faults) {
        let ([columns, rows, _], [i, j, _]) = (image.region.size, image.size);
        if [columns, rows] != [i, j] {
            let why = format!("a part of {columns} x {rows} of {i} x {j} pixels; whole frames are taken only");
            return faults.note(FaultKind::Image, 1, &why);
        }
        self.is_lps = self.poses == Poses::Image && image.coordinates == Coordinates::Lps;
        let own = DAffine3::from_mat4(image.index_to_mm(image.coordinates));
        let pose = Pose { to_space: pose * own, size: [usize::from(columns), usize::from(rows)] };
        let is_first_place = *self.first.get_or_insert(pose.to_space) == pose.to_space;
        self.still = if is_first_place { self.still.saturating_add(1) } else { u64::MAX };
        if self.still == STILL {
            let what = if self.poses == Poses::Image { "matrix" } else { "transform" };
            faults.note(FaultKind::Untracked, 1, &format!("the {what} of the first {STILL} is the same; {REMEDY}"));
        }
        let (stored, time) = (stored(image.scalar), (image.time > 0.0).then_some(image.time));
        let bytes = match samples(image) {
            Ok((bytes, replaced)) => {
                faults.note(FaultKind::Samples, replaced, "they read as 0");
                bytes
            }
            Err(fault) => return faults.note(FaultKind::Image, 1, &fault),
        };
        if stored != self.sweep.stored() {
            // Values of two types cannot be mixed.
            self.lost += self.sweep.left_out();
            self.sweep = Sweep::new(self.freehand.clone(), self.schedule.clone(), stored);
            self.values = ValueRange::new(stored);
        }
        self.time = time;
        if !self.sweep.is_placed() {
            self.values.take(&bytes);
        }
        if let Err(refusal) = self.sweep.push(pose, bytes) {
            note(refusal, faults);
        }
    }

    /// Updates the volume if that is due. Then returns the time stamp of its last frame.
    fn update(&mut self, faults: &mut Faults) -> Option<Option<f64>> {
        // Frames that wait for a later pose get none any more.
        if self.last.is_some_and(|last| last.elapsed() >= self.schedule.silence) {
            self.last = None;
            self.frames(Pairing::finish, faults);
        }
        let was_placed = self.sweep.is_placed();
        let changed = self.sweep.update(false, |refusal| note(refusal, faults));
        if self.sweep.is_placed() && !was_placed {
            let stored = self.sweep.stored();
            self.range = range_of(stored, std::mem::replace(&mut self.values, ValueRange::new(stored)));
        }
        (changed == Some(true)).then_some(self.time)
    }

    /// None before the volume is placed.
    fn header(&self) -> Option<Header> {
        let geometry = Geometry::Cartesian(self.sweep.lattice()?.grid);
        Some(Header { posed: true, ..Header::of(geometry, self.sweep.stored(), self.range) })
    }

    /// Where the volume lies (LPS). The space of trackers is RAS in this protocol, that of images is stated.
    fn pose(&self) -> Option<DAffine3> {
        let back = self.sweep.lattice()?.to_volume.inverse();
        let pose = if self.is_lps { back } else { other_coordinates() * back };
        is_rigid(&pose).then_some(pose)
    }
}

fn note(refusal: Refusal, faults: &mut Faults) {
    match refusal {
        Refusal::Outside => faults.note(FaultKind::Outside, 1, AT_ITS_LIMIT),
        Refusal::Picture(fault) => faults.note(FaultKind::Pose, 1, &fault),
        Refusal::Volume(fault) => faults.note(FaultKind::Volume, 1, &fault),
    }
}
