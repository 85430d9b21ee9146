//! OpenIGTLink as a live source: Cartesian volumes, and tracked 2D frames that are compounded into a volume.
//!
//! An IMAGE of several slices is a Cartesian volume; one with only some complete slices of it updates those. An IMAGE of one slice is a
//! frame of a freehand sweep. After a change, all slices of the volume are emitted under a new volume number, so that the receiver
//! always gets complete volumes and need not know their origin.

use super::client::{Client, ClientOptions, ClientStatistics};
use super::codec::BODY_LIMIT;
use super::message::{Coordinates, Image, Message, Scalar};
use super::pairing::Pairing;
use crate::files::{escaped, quoted};
use crate::probe::{AxisOrder, Geometry, Grid, World, is_rigid};
use crate::source::frame::{Frame, Header};
use crate::source::freehand::{self, Compounder, Lattice, Pose, TrackedFrame};
use crate::source::live::{Event, Live};
use crate::source::samples::{Replaced, SampleType, StoredType, store};
use crate::source::value_range::ValueRange;
use glam::{DAffine3, DVec3};
use std::collections::BTreeSet;
use std::io;
use std::time::{Duration, Instant};

/// The origin of the poses of 2D frames.
#[derive(Clone, Debug, PartialEq)]
pub enum Poses {
    /// TRANSFORM and TDATA messages, selected as [`Pairing::new`] documents: device, tolerance and patience in s.
    Messages { device: Option<String>, tolerance: f64, patience: f64 },
    /// The image's own matrix.
    Image,
}

/// Options of a [`Network`].
#[derive(Clone, Debug)]
pub struct NetworkOptions {
    pub client: ClientOptions,
    /// The device whose images are taken; None: all.
    pub device: Option<String>,
    pub poses: Poses,
    pub freehand: freehand::CompoundingOptions,
    /// The volume of a sweep is placed around so many first frames, or those of ten seconds or of 256 MiB.
    pub first: usize,
    /// The volume of a sweep is emitted at this interval, s, while frames arrive ...
    pub update: f64,
    /// ... or after this number of frames.
    pub frames: usize,
    /// Largest Cartesian volume, bytes of stored samples.
    pub volume_bytes: usize,
}

impl Default for NetworkOptions {
    fn default() -> NetworkOptions {
        NetworkOptions {
            client: ClientOptions::default(),
            device: None,
            poses: Poses::Messages { device: None, tolerance: 0.1, patience: 1.0 },
            freehand: freehand::CompoundingOptions { margin: 20.0, ..freehand::CompoundingOptions::default() },
            first: 100,
            update: 0.5,
            frames: 64,
            volume_bytes: BODY_LIMIT,
        }
    }
}

/// Most devices of images that are listed.
const MAX_DEVICES: usize = 16;
/// How often the statistics are checked while nothing arrives.
const POLL: Duration = Duration::from_millis(100);
/// Messages that are processed even if no time is left, so that a caller with zero patience makes progress.
const MAX_AT_ONCE: usize = 256;

/// A live source: the images of an OpenIGTLink server. It reconnects whenever the connection is lost, and never ends by itself.
///
/// No messages are processed while slices are emitted; messages that then exceed the client's queue are dropped and counted. Faults are
/// reported as [`Event::Fault`], each kind at most once a second and with its count.
///
/// Memory: that of the [`Client`], one volume of at most `volume_bytes` and its message, the first frames of a sweep (256 MiB), and that
/// of a [`Compounder`] and a [`Pairing`].
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
    sweep: FreehandSweep,
    volume_bytes: usize,
    device: Option<String>,
    /// Devices of images that came.
    devices: BTreeSet<String>,
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
    /// Starts to connect, as [`Client::connect`].
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
            devices: BTreeSet::new(),
            sweep: FreehandSweep::new(options),
            begun: None,
            output: None,
            volumes: 0,
        })
    }

    /// Statistics of the connection.
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
        let is_new = self.devices.len() < MAX_DEVICES && self.devices.insert(image.device.clone());
        let names = |devices: &BTreeSet<String>| devices.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", ");
        match &self.device {
            None if is_new && self.devices.len() > 1 => {
                let why = format!("{}; --device-name takes one of them", names(&self.devices));
                self.faults.note(FaultKind::Devices, 1, &why);
            }
            Some(device) if image.device != *device => {
                if !self.devices.contains(device) {
                    let why = format!("no image of {} came; there are {}", quoted(device), names(&self.devices));
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
                    Ok(replaced) => {
                        self.faults.note(FaultKind::Samples, replaced, "they read as 0");
                        self.start_output(false, time);
                    }
                    Err(fault) => self.faults.note(FaultKind::Image, 1, &fault),
                }
            }
            other => self.sweep.take(other, &mut self.faults),
        }
    }

    /// Starts to emit a volume.
    fn start_output(&mut self, of_sweep: bool, time: Option<f64>) {
        let (header, pose) = match of_sweep {
            true => (self.sweep.header(), self.sweep.pose()),
            false => {
                (self.whole.as_ref().map(CartesianVolume::header), self.whole.as_ref().and_then(|whole| whole.pose))
            }
        };
        let Some(header) = header else { return };
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
            true => self.sweep.slice(k),
            false => self.whole.as_ref().and_then(|whole| whole.slice(k)),
        };
        let Some(slice) = slice else {
            self.output = None;
            return None;
        };
        let (volume, time, bytes) = (output.volume, output.time, slice.to_vec());
        Some(Event::Frame(Frame {
            volume,
            number: k as u32,
            slice: k,
            backward: false,
            time,
            pose: output.pose,
            bytes,
        }))
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

    fn disconnected(&self) -> Option<String> {
        let is_connected = self.client.statistics().connected;
        (!is_connected).then(|| self.client.last_error().unwrap_or_else(|| "connecting".into()))
    }
}

/// Longest wait for the first frames, and most bytes of them.
const MAX_FIRST_WAIT: Duration = Duration::from_secs(10);
const MAX_FIRST_BYTES: usize = 256 << 20;

/// A frame that arrived before the volume was placed.
struct BufferedFrame {
    pose: Pose,
    bytes: Vec<u8>,
}

/// A freehand sweep: tracked frames that are compounded into a volume.
struct FreehandSweep {
    options: NetworkOptions,
    pairing: Pairing,
    /// Sample type of all frames. A different type begins a new sweep.
    stored: StoredType,
    range: [f64; 2],
    /// The frames are placed in LPS: by matrices of their own that say so.
    is_lps: bool,
    buffered: Vec<BufferedFrame>,
    buffered_bytes: usize,
    compounder: Option<Compounder>,
    /// When the first frame arrived that was not emitted yet.
    since: Option<Instant>,
    frames: usize,
    /// Time stamp of the last frame.
    time: Option<f64>,
}

impl FreehandSweep {
    fn new(options: NetworkOptions) -> FreehandSweep {
        let pairing = match options.poses.clone() {
            Poses::Messages { device, tolerance, patience } => Pairing::new(device, tolerance, patience),
            Poses::Image => Pairing::new(None, 0.0, 0.0),
        };
        FreehandSweep {
            options,
            pairing,
            stored: StoredType::U8,
            range: [0.0, 255.0],
            is_lps: false,
            buffered: Vec::new(),
            buffered_bytes: 0,
            compounder: None,
            since: None,
            frames: 0,
            time: None,
        }
    }

    /// Takes frames and poses; skips other messages.
    fn take(&mut self, message: Message, faults: &mut Faults) {
        match (message, &self.options.poses) {
            (Message::Image(image), Poses::Image) => self.frame(image, DAffine3::IDENTITY, faults),
            (message, _) => {
                let before = self.pairing.counts().dropped;
                for paired in self.pairing.push(message) {
                    self.frame(paired.image, paired.pose, faults);
                }
                let dropped = self.pairing.counts().dropped - before;
                if dropped > 0 {
                    faults.note(FaultKind::Unpaired, dropped, &self.pairing.why_unpaired());
                }
            }
        }
    }

    fn frame(&mut self, image: Image, pose: DAffine3, faults: &mut Faults) {
        let ([columns, rows, _], [i, j, _]) = (image.region.size, image.size);
        if [columns, rows] != [i, j] {
            let why = format!("a part of {columns} x {rows} of {i} x {j} pixels; whole frames are taken only");
            return faults.note(FaultKind::Image, 1, &why);
        }
        self.is_lps = self.options.poses == Poses::Image && image.coordinates == Coordinates::Lps;
        let own = DAffine3::from_mat4(image.index_to_mm(image.coordinates));
        let pose = Pose { to_space: pose * own, size: [usize::from(columns), usize::from(rows)] };
        let (stored, time) = (stored(image.scalar), (image.time > 0.0).then_some(image.time));
        let bytes = match samples(image) {
            Ok((bytes, replaced)) => {
                faults.note(FaultKind::Samples, replaced, "they read as 0");
                bytes
            }
            Err(fault) => return faults.note(FaultKind::Image, 1, &fault),
        };
        if stored != self.stored {
            // Values of two types cannot be mixed.
            (self.stored, self.compounder, self.buffered_bytes) = (stored, None, 0);
            self.buffered.clear();
        }
        self.time = time;
        self.since.get_or_insert_with(Instant::now);
        self.frames += 1;
        match &mut self.compounder {
            Some(compounder) => push(compounder, pose, &bytes, faults),
            None => {
                self.buffered_bytes += bytes.len();
                self.buffered.push(BufferedFrame { pose, bytes });
            }
        }
    }

    /// Updates the volume if that is due. Then returns the time stamp of its last frame.
    fn update(&mut self, faults: &mut Faults) -> Option<Option<f64>> {
        let waited = self.since?.elapsed();
        if self.compounder.is_none() {
            let enough = self.buffered.len() >= self.options.first.max(1) || self.buffered_bytes >= MAX_FIRST_BYTES;
            if !enough && waited < MAX_FIRST_WAIT {
                return None;
            }
            self.begin(faults);
        } else if waited.as_secs_f64() < self.options.update && self.frames < self.options.frames {
            return None;
        }
        (self.since, self.frames) = (None, 0);
        let changed = self.compounder.as_mut()?.changed_slices();
        (!changed.is_empty()).then_some(self.time)
    }

    /// Places the volume around the first frames and compounds them.
    fn begin(&mut self, faults: &mut Faults) {
        let buffered = std::mem::take(&mut self.buffered);
        self.buffered_bytes = 0;
        let poses: Vec<Pose> = buffered.iter().map(|frame| frame.pose).collect();
        let options = &self.options.freehand;
        let made =
            Lattice::around(&poses, options).and_then(|lattice| Compounder::new(lattice, self.stored, options.clone()));
        let mut compounder = match made {
            Ok(compounder) => compounder,
            Err(fault) => return faults.note(FaultKind::Volume, 1, &fault),
        };
        let mut values = ValueRange::new(self.stored);
        for BufferedFrame { pose, bytes } in &buffered {
            values.take(bytes);
            push(&mut compounder, *pose, bytes, faults);
        }
        self.range = range_of(self.stored, values);
        self.compounder = Some(compounder);
    }

    /// None before the volume is placed.
    fn header(&self) -> Option<Header> {
        let geometry = Geometry::Cartesian(self.compounder.as_ref()?.lattice().grid);
        Some(Header {
            forward: geometry.clone(),
            backward: geometry,
            stored: self.stored,
            range: self.range,
            posed: true,
        })
    }

    /// Where the volume lies (LPS). The space of trackers is RAS in this protocol, that of images is stated.
    fn pose(&self) -> Option<DAffine3> {
        let back = self.compounder.as_ref()?.lattice().to_volume.inverse();
        let pose = if self.is_lps { back } else { other_coordinates() * back };
        is_rigid(&pose).then_some(pose)
    }

    /// A slice; None beyond the last.
    fn slice(&self, k: usize) -> Option<&[u8]> {
        self.compounder.as_ref()?.slice(k)
    }
}

fn push(compounder: &mut Compounder, pose: Pose, bytes: &[u8], faults: &mut Faults) {
    match compounder.push(&TrackedFrame { pose, stored: compounder.stored(), bytes }) {
        Ok(0) => faults.note(FaultKind::Outside, 1, "the volume was placed around the first frames of the sweep"),
        Ok(_) => {}
        Err(fault) => faults.note(FaultKind::Pose, 1, &fault),
    }
}

/// Relative difference of spacings that count as equal: the spacing of a rotated volume is computed again in f32.
const SPACING_TOLERANCE: f64 = 1e-5;

/// A Cartesian volume, as of the last message.
struct CartesianVolume {
    scalar: Scalar,
    components: u8,
    stored: StoredType,
    grid: Grid,
    /// The image's axes are left-handed: its rows are read from last pixel to first, so that it is not shown mirrored.
    mirrored: bool,
    /// Where the volume is as of the last message; None if its axes are not perpendicular.
    pose: Option<DAffine3>,
    range: [f64; 2],
    bytes: Vec<u8>,
}

impl CartesianVolume {
    /// Stores the slices of an image. If it does not belong to the present volume, a new one is begun, whose missing slices are 0. Returns
    /// the number of samples that read as 0 because they are not finite or denormal.
    ///
    /// Lateral is the image's i, depth its j, elevation its k. Lateral and elevation are centred, depth begins at 0. Of the matrix the
    /// handedness is used: rows of a left-handed image are reversed. The values shown as 0 and 1 are 0 and 255 for 8 bits, otherwise the smallest and largest of the first message.
    ///
    /// # Errors
    /// In words, an image that cannot be used. The volume is not changed.
    fn take(volume: &mut Option<CartesianVolume>, image: Image, max_bytes: usize) -> Result<u64, String> {
        let [i, j, _] = image.size;
        let ([x, y, first], [columns, rows, slices]) = (image.region.offset, image.region.size);
        if (x, y, columns, rows) != (0, 0, i, j) {
            return Err(format!("a part of {columns} x {rows} of {i} x {j} pixels; whole slices are taken only"));
        }
        let (grid, scalar, components) = (grid(&image), image.scalar, image.components);
        grid.check().map_err(|e| format!("{} {}", e.field, e.fault))?;
        let stored = stored(scalar);
        let slice = usize::from(i) * usize::from(j) * stored.bytes();
        let all = slice.checked_mul(grid.size[2]).filter(|all| *all <= max_bytes);
        let Some(all) = all else {
            let [x, y, z] = grid.size;
            return Err(format!("a volume of {x} x {y} x {z} voxels; at most {max_bytes} bytes are taken"));
        };
        let mirrored = is_left_handed(&image);
        let pose = pose(&image, &grid, mirrored);
        let (mut brought, replaced) = samples(image)?;
        if mirrored {
            let rows = AxisOrder { reversed: [true, false, false], ..AxisOrder::STORED };
            brought = rows.reorder(&brought, [usize::from(i), usize::from(j), usize::from(slices)], stored.bytes());
        }
        let is_same = |w: &&mut CartesianVolume| {
            let is_like = w.scalar == scalar && w.components == components && w.mirrored == mirrored;
            is_like && w.grid.size == grid.size && w.is_at(&grid)
        };
        let whole = match volume.as_mut().filter(is_same) {
            Some(whole) => whole,
            None => {
                let mut values = ValueRange::new(stored);
                values.take(&brought);
                let range = range_of(stored, values);
                if mirrored {
                    tracing::warn!(
                        "the axes of the image are left-handed: its rows are reversed, so that it is not shown mirrored"
                    );
                }
                volume.insert(CartesianVolume {
                    scalar,
                    components,
                    stored,
                    grid,
                    mirrored,
                    pose,
                    range,
                    bytes: vec![0; all],
                })
            }
        };
        whole.pose = pose;
        let at = usize::from(first) * slice;
        match whole.bytes.get_mut(at..at + usize::from(slices) * slice).filter(|part| part.len() == brought.len()) {
            Some(part) => part.copy_from_slice(&brought),
            None => return Err(format!("{slices} slices from {first} on, which are not all there")),
        }
        Ok(replaced)
    }

    fn is_at(&self, grid: &Grid) -> bool {
        self.grid.spacing.iter().zip(grid.spacing).all(|(a, b)| (a - b).abs() <= SPACING_TOLERANCE * a.max(b))
    }

    fn header(&self) -> Header {
        let geometry = Geometry::Cartesian(self.grid);
        Header { forward: geometry.clone(), backward: geometry, stored: self.stored, range: self.range, posed: true }
    }

    /// A slice; None beyond the last.
    fn slice(&self, k: usize) -> Option<&[u8]> {
        let [x, y, _] = self.grid.size;
        self.bytes.chunks_exact(x * y * self.stored.bytes()).nth(k)
    }
}

/// From RAS to LPS, and back.
fn other_coordinates() -> DAffine3 {
    DAffine3::from_scale(DVec3::new(-1.0, -1.0, 1.0))
}

/// The pose of an image whose voxels are drawn on `grid`, with reversed rows if it is mirrored.
fn pose(image: &Image, grid: &Grid, mirrored: bool) -> Option<DAffine3> {
    let to_lps = image.index_to_mm(Coordinates::Lps);
    let axes = [0, 1, 2].map(|n| to_lps.col(n).truncate());
    let mut world = World::new(axes, to_lps.w_axis.truncate()).ok()?;
    if mirrored {
        let rows = AxisOrder { reversed: [true, false, false], ..AxisOrder::STORED };
        world = world.reordered(&rows, grid.size);
    }
    let pose = world.pose(grid);
    is_rigid(&pose).then_some(pose)
}

/// True if i, j and k are left-handed. Both coordinate systems of images are right-handed.
fn is_left_handed(image: &Image) -> bool {
    let [i, j, k] = image.axes.map(|axis| DVec3::from(axis.map(f64::from)));
    i.cross(j).dot(k) < 0.0
}

/// The grid of an image. An axis of one pixel may have any spacing, or none.
fn grid(image: &Image) -> Grid {
    let size = image.size.map(usize::from);
    let mut spacing = image.spacing();
    for axis in 0..3 {
        if size[axis] == 1 && spacing[axis] == 0.0 {
            spacing[axis] = 1.0;
        }
    }
    let half = |axis: usize| -spacing[axis] * (size[axis] as f64 - 1.0) / 2.0;
    Grid { size, spacing, origin: [half(0), 0.0, half(2)] }
}

/// Weights of red, green and blue in luminance (ITU-R BT.601).
const LUMINANCE: [f64; 3] = [0.299, 0.587, 0.114];
/// Added to an i8 to store it as u8.
const I8_SHIFT: f64 = 128.0;

/// The stored type of a scalar: 8 and 16 bits unchanged, signed ones shifted to begin at 0, all others f32.
fn stored(scalar: Scalar) -> StoredType {
    match scalar {
        Scalar::I8 | Scalar::U8 => StoredType::U8,
        Scalar::I16 | Scalar::U16 => StoredType::U16,
        Scalar::I32 | Scalar::U32 | Scalar::F32 | Scalar::F64 => StoredType::F32,
    }
}

/// One sample a pixel, little-endian, in the order of the image, and the number of samples that were replaced by 0.
///
/// Pixels of 3 or 4 components (red, green, blue, and any fourth) become their luminance.
///
/// # Errors
/// Pixels with another number of components.
fn samples(mut image: Image) -> Result<(Vec<u8>, u64), String> {
    let scalar = image.scalar;
    let mut bytes = match (image.components, scalar) {
        (1, Scalar::I8) => {
            // Adding 128 to an i8 flips its top bit.
            image.bytes.iter_mut().for_each(|byte| *byte ^= 0x80);
            image.bytes
        }
        (1, Scalar::U8 | Scalar::U16 | Scalar::I16 | Scalar::F32) => image.bytes,
        (1, _) => {
            let values = image.bytes.chunks_exact(scalar.bytes()).map(|v| value(scalar, v) as f32);
            values.flat_map(f32::to_le_bytes).collect()
        }
        (components @ 3..=4, _) => {
            let mut bytes = Vec::with_capacity(image.bytes.len() / usize::from(components));
            for pixel in image.bytes.chunks_exact(usize::from(components) * scalar.bytes()) {
                let colours = pixel.chunks_exact(scalar.bytes()).zip(LUMINANCE);
                put(&mut bytes, scalar, colours.map(|(colour, share)| share * value(scalar, colour)).sum());
            }
            bytes
        }
        (components, _) => return Err(format!("pixels have {components} components, must have 1, 3 or 4")),
    };
    let sample = match scalar {
        Scalar::I8 | Scalar::U8 => SampleType::U8,
        Scalar::I16 => SampleType::I16,
        Scalar::U16 => SampleType::U16,
        Scalar::I32 | Scalar::U32 | Scalar::F32 | Scalar::F64 => SampleType::F32,
    };
    let Replaced { not_finite, denormal } = store(sample, false, &mut bytes);
    Ok((bytes, not_finite + denormal))
}

/// The value of little-endian bytes. A number beyond f32 becomes infinite later, and then 0.
fn value(scalar: Scalar, bytes: &[u8]) -> f64 {
    match (scalar, bytes) {
        (Scalar::U8, [a]) => f64::from(*a),
        (Scalar::I8, [a]) => f64::from(a.cast_signed()),
        (Scalar::U16, [a, b]) => f64::from(u16::from_le_bytes([*a, *b])),
        (Scalar::I16, [a, b]) => f64::from(i16::from_le_bytes([*a, *b])),
        (Scalar::U32, [a, b, c, d]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
        (Scalar::I32, [a, b, c, d]) => f64::from(i32::from_le_bytes([*a, *b, *c, *d])),
        (Scalar::F32, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
        (Scalar::F64, _) => bytes.first_chunk().map_or(0.0, |b| f64::from_le_bytes(*b)),
        _ => 0.0,
    }
}

/// Stores a luminance in the type of the image. An i16 is shifted later, with all samples.
fn put(bytes: &mut Vec<u8>, scalar: Scalar, value: f64) {
    match scalar {
        Scalar::U8 => bytes.push(value.round() as u8),
        Scalar::I8 => bytes.push((value + I8_SHIFT).round() as u8),
        Scalar::U16 => bytes.extend((value.round() as u16).to_le_bytes()),
        Scalar::I16 => bytes.extend((value.round() as i16).to_le_bytes()),
        Scalar::I32 | Scalar::U32 | Scalar::F32 | Scalar::F64 => bytes.extend((value as f32).to_le_bytes()),
    }
}

/// Shortest time between two reports of one kind.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);
/// Longest reason, characters.
const MAX_REASON: usize = 400;

/// The kinds of faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FaultKind {
    Unreachable,
    Lost,
    Again,
    Checksum,
    Malformed,
    Dropped,
    /// An image that is neither a volume nor a frame.
    Image,
    /// Images of several devices, which show different things.
    Devices,
    Samples,
    /// A frame without a pose.
    Unpaired,
    Pose,
    Outside,
    Volume,
}

const KINDS: [(FaultKind, &str); 13] = [
    (FaultKind::Unreachable, "not connected"),
    (FaultKind::Lost, "connection lost"),
    (FaultKind::Again, "connected again"),
    (FaultKind::Checksum, "messages with a wrong checksum passed over"),
    (FaultKind::Malformed, "malformed messages passed over"),
    (FaultKind::Dropped, "messages dropped"),
    (FaultKind::Image, "images passed over"),
    (FaultKind::Devices, "images of several devices"),
    (FaultKind::Samples, "samples that are not finite or are denormal"),
    (FaultKind::Unpaired, "frames without a pose left out"),
    (FaultKind::Pose, "frames refused"),
    (FaultKind::Outside, "frames outside of the volume"),
    (FaultKind::Volume, "no volume for the sweep"),
];

#[derive(Clone, Default)]
struct Fault {
    count: u64,
    /// Reason of the last one.
    why: String,
    reported: Option<Instant>,
}

/// The faults of the source. Each kind is reported at most once a second, with its count.
struct Faults {
    address: String,
    faults: [Fault; KINDS.len()],
}

impl Faults {
    fn new(address: &str) -> Faults {
        Faults { address: escaped(address, MAX_REASON), faults: Default::default() }
    }

    fn note(&mut self, kind: FaultKind, count: u64, why: &str) {
        let place = KINDS.iter().position(|(k, _)| *k == kind).and_then(|n| self.faults.get_mut(n));
        if let Some(fault) = place.filter(|_| count > 0) {
            fault.count = fault.count.saturating_add(count);
            fault.why = escaped(why, MAX_REASON);
        }
    }

    /// A fault whose kind was not reported within the last second.
    fn due(&mut self) -> Option<String> {
        let waited = |fault: &Fault| fault.reported.is_none_or(|reported| reported.elapsed() >= REPORT_INTERVAL);
        let mut faults = self.faults.iter_mut().zip(KINDS);
        let (fault, (_, what)) = faults.find(|(fault, _)| fault.count > 0 && waited(fault))?;
        let count = std::mem::take(&mut fault.count);
        fault.reported = Some(Instant::now());
        let times = if count == 1 { String::new() } else { format!(" ({count})") };
        let why = if fault.why.is_empty() { String::new() } else { format!(": {}", fault.why) };
        Some(format!("OpenIGTLink from {}: {what}{times}{why}", self.address))
    }
}

/// The values that become 0 and 1: all that 8 bits hold, or those of the first samples that came.
fn range_of(stored: StoredType, values: ValueRange) -> [f64; 2] {
    if stored == StoredType::U8 {
        return [0.0, 255.0];
    }
    let measured = values.measured();
    if let Some(remark) = measured.remark() {
        tracing::warn!("{remark}");
    }
    measured.range
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::igtl::message::Region;

    fn image(scalar: Scalar, components: u8, bytes: Vec<u8>) -> Image {
        Image {
            device: String::new(),
            time: 0.0,
            size: [1; 3],
            region: Region { offset: [0; 3], size: [1; 3] },
            scalar,
            components,
            coordinates: Coordinates::Ras,
            axes: [[1.0; 3]; 3],
            centre: [0.0; 3],
            bytes,
        }
    }

    #[test]
    fn the_order_of_values_survives_every_type() {
        let floats = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let words = |v: &[u16]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        for (scalar, bytes, expected, replaced) in [
            (Scalar::U8, vec![0, 7, 255], vec![0, 7, 255], 0),
            (Scalar::I8, vec![0x80, 0xff, 0, 127], vec![0, 127, 128, 255], 0),
            (Scalar::U16, words(&[0, 500]), words(&[0, 500]), 0),
            (Scalar::I16, words(&[0x8000, 0xffff, 5]), words(&[0, 32767, 32773]), 0),
            (Scalar::I32, (-3i32).to_le_bytes().to_vec(), floats(&[-3.0]), 0),
            (Scalar::U32, 4_000_000_000u32.to_le_bytes().to_vec(), floats(&[4e9]), 0),
            (Scalar::F32, floats(&[1.5, f32::NAN, 1e-40]), floats(&[1.5, 0.0, 0.0]), 2),
            (Scalar::F64, [0.25f64, 1e300].iter().flat_map(|v| v.to_le_bytes()).collect(), floats(&[0.25, 0.0]), 1),
        ] {
            assert_eq!(samples(image(scalar, 1, bytes)), Ok((expected, replaced)), "{scalar:?}");
        }
    }

    #[test]
    fn colours_become_their_luminance_and_nothing_else_passes() {
        for (components, pixel) in [(3, vec![10, 20, 30]), (4, vec![10, 20, 30, 255])] {
            // 2.99 + 11.74 + 3.42.
            assert_eq!(samples(image(Scalar::U8, components, pixel.clone())), Ok((vec![18], 0)));
            let signed: Vec<u8> = pixel.iter().map(|v| v ^ 0x80).collect();
            assert_eq!(samples(image(Scalar::I8, components, signed)), Ok((vec![18], 0)));
            let words: Vec<u8> = pixel.iter().flat_map(|v| (i16::from(*v) * 100).to_le_bytes()).collect();
            let expected = (1815u16 + 32768).to_le_bytes().to_vec();
            assert_eq!(samples(image(Scalar::I16, components, words)), Ok((expected, 0)));
        }
        for components in [2, 5, 255] {
            let refused = samples(image(Scalar::U8, components, vec![0; usize::from(components)])).unwrap_err();
            assert!(refused.contains(&format!("{components} components")), "{refused}");
        }
    }

    #[test]
    fn a_flood_of_faults_is_one_line_a_second_and_none_is_forgotten() {
        let mut faults = Faults::new("host\n:1");
        assert_eq!(faults.due(), None);
        faults.note(FaultKind::Lost, 1, "gone");
        faults.note(FaultKind::Dropped, 3, "");
        faults.note(FaultKind::Image, 0, "never");
        assert_eq!(faults.due().as_deref(), Some("OpenIGTLink from host\\n:1: connection lost: gone"));
        assert_eq!(faults.due().as_deref(), Some("OpenIGTLink from host\\n:1: messages dropped (3)"));
        for n in 0..1000 {
            faults.note(FaultKind::Dropped, 2, &format!("the {n}th\u{1b}[2J"));
            assert_eq!(faults.due(), None);
        }
        for fault in &mut faults.faults {
            fault.reported = fault.reported.and_then(|reported| reported.checked_sub(REPORT_INTERVAL));
        }
        let reported = faults.due().unwrap();
        assert!(reported.contains("messages dropped (2000): the 999th") && !reported.contains('\u{1b}'), "{reported}");
    }

    #[test]
    fn every_kind_has_its_words() {
        for kind in [
            FaultKind::Unreachable,
            FaultKind::Again,
            FaultKind::Checksum,
            FaultKind::Samples,
            FaultKind::Unpaired,
            FaultKind::Volume,
        ] {
            let mut faults = Faults::new("host");
            faults.note(kind, 1, "");
            assert!(faults.due().is_some(), "{kind:?}");
        }
    }
}
