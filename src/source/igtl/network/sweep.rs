//! A freehand sweep that comes over the network.

use super::faults::{Faults, Kind};
use super::samples::{samples, stored};
use super::{NetworkOptions, Poses};
use crate::probe::Geometry;
use crate::source::StoredType;
use crate::source::freehand::{Compounder, Lattice, Pose, TrackedFrame};
use crate::source::igtl::image::Image;
use crate::source::igtl::message::Message;
use crate::source::igtl::pairing::Pairing;
use crate::source::recorder::Header;
use crate::source::samples::{not_empty, widen};
use glam::DAffine3;
use std::time::{Duration, Instant};

/// How long the first frames are waited for, and how many bytes of them.
const FIRST: Duration = Duration::from_secs(10);
const FIRST_BYTES: usize = 256 << 20;

/// A frame that came before there was a volume for it.
struct Early {
    pose: Pose,
    bytes: Vec<u8>,
}

pub(super) struct Sweep {
    options: NetworkOptions,
    pairing: Pairing,
    /// Of all frames; another one begins another sweep.
    stored: StoredType,
    range: [f64; 2],
    early: Vec<Early>,
    early_bytes: usize,
    compounder: Option<Compounder>,
    /// When the first frame came that was not given out yet.
    since: Option<Instant>,
    frames: usize,
    /// Of the last frame.
    time: Option<f64>,
}

impl Sweep {
    pub fn new(options: NetworkOptions) -> Sweep {
        let pairing = match options.poses.clone() {
            Poses::Messages { device, tolerance, patience } => Pairing::new(device, tolerance, patience),
            Poses::Image => Pairing::new(None, 0.0, 0.0),
        };
        Sweep {
            options,
            pairing,
            stored: StoredType::U8,
            range: [0.0, 255.0],
            early: Vec::new(),
            early_bytes: 0,
            compounder: None,
            since: None,
            frames: 0,
            time: None,
        }
    }

    /// Takes what is of a sweep; other messages are passed over.
    pub fn take(&mut self, message: Message, faults: &mut Faults) {
        match (message, &self.options.poses) {
            (Message::Image(image), Poses::Image) => self.frame(image, DAffine3::IDENTITY, faults),
            (message, _) => {
                let before = self.pairing.counts().dropped;
                for paired in self.pairing.push(message) {
                    self.frame(paired.image, paired.pose, faults);
                }
                let dropped = self.pairing.counts().dropped - before;
                faults.note(Kind::Unpaired, dropped, "no pose came near their time");
            }
        }
    }

    fn frame(&mut self, image: Image, pose: DAffine3, faults: &mut Faults) {
        let ([columns, rows, _], [i, j, _]) = (image.region.size, image.size);
        if [columns, rows] != [i, j] {
            let why = format!("a part of {columns} x {rows} of {i} x {j} pixels; whole frames are taken only");
            return faults.note(Kind::Image, 1, &why);
        }
        let own = DAffine3::from_mat4(image.index_to_mm(image.coordinates));
        let pose = Pose { to_space: pose * own, size: [usize::from(columns), usize::from(rows)] };
        let (stored, time) = (stored(image.scalar), (image.time > 0.0).then_some(image.time));
        let bytes = match samples(image) {
            Ok((bytes, replaced)) => {
                faults.note(Kind::Samples, replaced, "they read as 0");
                bytes
            }
            Err(fault) => return faults.note(Kind::Image, 1, &fault),
        };
        if stored != self.stored {
            // Values of two types do not mix.
            (self.stored, self.compounder, self.early_bytes) = (stored, None, 0);
            self.early.clear();
        }
        self.time = time;
        self.since.get_or_insert_with(Instant::now);
        self.frames += 1;
        match &mut self.compounder {
            Some(compounder) => push(compounder, pose, &bytes, faults),
            None => {
                self.early_bytes += bytes.len();
                self.early.push(Early { pose, bytes });
            }
        }
    }

    /// Brings the volume up to date if that is due; then the time of its last frame.
    pub fn update(&mut self, faults: &mut Faults) -> Option<Option<f64>> {
        let waited = self.since?.elapsed();
        if self.compounder.is_none() {
            let enough = self.early.len() >= self.options.first.max(1) || self.early_bytes >= FIRST_BYTES;
            if !enough && waited < FIRST {
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

    /// Lays the volume around the first frames and compounds them.
    fn begin(&mut self, faults: &mut Faults) {
        let early = std::mem::take(&mut self.early);
        self.early_bytes = 0;
        let poses: Vec<Pose> = early.iter().map(|frame| frame.pose).collect();
        let options = &self.options.freehand;
        let made =
            Lattice::around(&poses, options).and_then(|lattice| Compounder::new(lattice, self.stored, options.clone()));
        let mut compounder = match made {
            Ok(compounder) => compounder,
            Err(fault) => return faults.note(Kind::Volume, 1, &fault),
        };
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for Early { pose, bytes } in &early {
            widen(&mut range, self.stored, bytes);
            push(&mut compounder, *pose, bytes, faults);
        }
        self.range = if self.stored == StoredType::U8 { [0.0, 255.0] } else { not_empty(range) };
        self.compounder = Some(compounder);
    }

    /// None before there is a volume.
    pub fn header(&self) -> Option<Header> {
        let geometry = Geometry::Cartesian(self.compounder.as_ref()?.lattice().grid);
        Some(Header { forward: geometry.clone(), backward: geometry, stored: self.stored, range: self.range })
    }

    /// None beyond the last.
    pub fn slice(&self, k: usize) -> Option<&[u8]> {
        self.compounder.as_ref()?.slice(k)
    }
}

fn push(compounder: &mut Compounder, pose: Pose, bytes: &[u8], faults: &mut Faults) {
    match compounder.push(&TrackedFrame { pose, stored: compounder.stored(), bytes }) {
        Ok(0) => faults.note(Kind::Outside, 1, "the volume was laid around the first frames of the sweep"),
        Ok(_) => {}
        Err(fault) => faults.note(Kind::Pose, 1, &fault),
    }
}
