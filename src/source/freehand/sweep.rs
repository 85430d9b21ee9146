//! A freehand volume of pictures that arrive. The first pictures are kept until the volume can be placed around them; later ones are
//! compounded as they arrive, and the volume grows around them.

use super::{Compounder, CompoundingOptions, Lattice, Pose, TrackedFrame};
use crate::probe::StoredType;
use std::time::{Duration, Instant};

/// Longest wait for the first pictures, and most bytes of them.
const MAX_FIRST_WAIT: Duration = Duration::from_secs(10);
const MAX_FIRST_BYTES: usize = 256 << 20;

/// When the volume of a [`Sweep`] is placed, which is when its lattice is laid around the first pictures, and when it is emitted by
/// [`Sweep::update`].
#[derive(Clone, Debug)]
pub struct Schedule {
    /// Number of pictures after which the volume is placed around them. It is placed earlier after ten seconds, 256 MiB or `silence`.
    pub first: usize,
    /// Time without a new picture after which the volume is placed around those that arrived.
    pub silence: Duration,
    /// Longest time from a new picture until the volume is emitted.
    pub interval: Duration,
    /// Number of new pictures after which the volume is emitted, even before `interval` is over.
    pub pictures: usize,
}

impl Default for Schedule {
    fn default() -> Schedule {
        Schedule { first: 100, silence: Duration::from_secs(1), interval: Duration::from_millis(500), pictures: 64 }
    }
}

/// Why one picture, or all pictures, are not in the volume.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// The picture is not wholly inside the volume, which may not grow further. The part that is inside is compounded.
    Outside,
    /// The picture cannot be compounded, for the given reason.
    Picture(String),
    /// No volume can be placed around the first pictures, for the given reason.
    Volume(String),
}

/// Compounds freehand pictures into a volume as they arrive.
///
/// Memory: the first pictures (256 MiB), then that of a [`Compounder`].
pub struct Sweep {
    options: CompoundingOptions,
    schedule: Schedule,
    stored: StoredType,
    buffered: Vec<(Pose, Vec<u8>)>,
    buffered_bytes: usize,
    compounder: Option<Compounder>,
    /// When the first picture arrived that was not emitted yet, and how many have since.
    since: Option<Instant>,
    pictures: usize,
    /// When the last picture arrived.
    last: Option<Instant>,
    left_out: u64,
}

impl Sweep {
    /// A sweep without pictures. `stored`: type of the samples of all pictures.
    pub fn new(options: CompoundingOptions, schedule: Schedule, stored: StoredType) -> Sweep {
        Sweep {
            options,
            schedule,
            stored,
            buffered: Vec::new(),
            buffered_bytes: 0,
            compounder: None,
            since: None,
            pictures: 0,
            last: None,
            left_out: 0,
        }
    }

    pub fn stored(&self) -> StoredType {
        self.stored
    }

    /// True once the volume was placed around the first pictures.
    pub(crate) fn is_placed(&self) -> bool {
        self.compounder.is_some()
    }

    /// Adds a picture of one sample a pixel, column fastest.
    ///
    /// # Errors
    /// The reason why the picture is not, or not wholly, in the volume. Until the volume is placed, only a wrong number of samples is an error.
    pub fn push(&mut self, pose: Pose, bytes: Vec<u8>) -> Result<(), Refusal> {
        self.last = Some(Instant::now());
        if bytes.len() != pose.size[0] * pose.size[1] * self.stored.bytes() {
            self.left_out += 1;
            return Err(Refusal::Picture("it has another number of samples than its size".into()));
        }
        self.since.get_or_insert_with(Instant::now);
        self.pictures += 1;
        match &mut self.compounder {
            Some(compounder) => add(compounder, pose, &bytes).inspect_err(|_| self.left_out += 1),
            None => {
                self.buffered_bytes += bytes.len();
                self.buffered.push((pose, bytes));
                Ok(())
            }
        }
    }

    /// Brings the volume up to date if its [`Schedule`] says that it is to be emitted, or if `at_once` is true, because no more pictures follow.
    /// Returns None if neither holds or no picture came since the last update, otherwise true if a slice changed. A volume that was not placed yet is
    /// placed around the first pictures. `refuse` is called for each of these that is not, or not wholly, in the volume, or once with
    /// [`Refusal::Volume`] if the volume cannot be placed.
    pub fn update(&mut self, at_once: bool, mut refuse: impl FnMut(Refusal)) -> Option<bool> {
        let waited = self.since?.elapsed();
        let is_placed = self.is_placed();
        let is_time = match is_placed {
            true => self.pictures >= self.schedule.pictures || waited >= self.schedule.interval,
            false => {
                let is_full = self.buffered_bytes >= MAX_FIRST_BYTES || waited >= MAX_FIRST_WAIT;
                let is_silent = self.last.is_some_and(|last| last.elapsed() >= self.schedule.silence);
                is_full || is_silent || self.buffered.len() >= self.schedule.first.max(1)
            }
        };
        if !is_time && !at_once {
            return None;
        }
        (self.since, self.pictures) = (None, 0);
        if !is_placed && let Err(fault) = self.place(&mut refuse) {
            refuse(Refusal::Volume(fault));
        }
        Some(self.compounder.as_mut().is_some_and(|compounder| !compounder.changed_slices().is_empty()))
    }

    /// Places the volume around the first pictures and compounds them.
    fn place(&mut self, refuse: &mut impl FnMut(Refusal)) -> Result<(), String> {
        let buffered = std::mem::take(&mut self.buffered);
        self.buffered_bytes = 0;
        let poses: Vec<Pose> = buffered.iter().map(|(pose, _)| *pose).collect();
        let placed = Lattice::around(&poses, &self.options)
            .and_then(|lattice| Compounder::new(lattice, self.stored, self.options.clone()));
        let mut compounder = placed.inspect_err(|_| self.left_out += buffered.len() as u64)?;
        for (pose, bytes) in &buffered {
            if let Err(refusal) = add(&mut compounder, *pose, bytes) {
                self.left_out += 1;
                refuse(refusal);
            }
        }
        self.compounder = Some(compounder);
        Ok(())
    }

    /// Number of pictures so far that are not, or not wholly, in the volume.
    pub(crate) fn left_out(&self) -> u64 {
        self.left_out
    }

    /// The lattice of the volume, which changes when the volume grows. None before the volume was placed.
    pub fn lattice(&self) -> Option<&Lattice> {
        Some(self.compounder.as_ref()?.lattice())
    }

    /// Samples of slice `k` of the volume, as [`Compounder::slice`] returns them: lateral fastest, little-endian. None beyond the last slice, and
    /// before the volume was placed.
    pub fn slice(&self, k: usize) -> Option<&[u8]> {
        self.compounder.as_ref()?.slice(k)
    }
}

fn add(compounder: &mut Compounder, pose: Pose, bytes: &[u8]) -> Result<(), Refusal> {
    let is_inside = compounder.grow_around(&pose);
    match compounder.push(&TrackedFrame { pose, stored: compounder.stored(), bytes }) {
        Ok(_) if !is_inside => Err(Refusal::Outside),
        Ok(_) => Ok(()),
        Err(fault) => Err(Refusal::Picture(fault)),
    }
}
