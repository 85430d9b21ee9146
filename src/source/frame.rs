//! The header of a sequence of frames, and the trait of sources that are read on demand.

use crate::files::InputError;
use crate::memory;
pub use crate::probe::{Advance, Frame, Geometry, SampleType, StoredType, World, is_rigid};
use crate::tree::{FromNode, ToNode};
use glam::{DAffine3, DMat4, DVec3};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Most frames a volume, for every reader.
const MAX_SLICES: usize = 1 << 16;
/// Largest frame, bytes.
const MAX_FRAME_BYTES: u64 = 1 << 30;

/// Checks that a volume is within the memory limit.
///
/// # Errors
/// One line that names the file, the size and the limit.
pub(super) fn check_memory(path: &Path, geometry: &Geometry, stored: StoredType) -> Result<(), InputError> {
    memory_fault(geometry, stored).map_or(Ok(()), |fault| Err(InputError::new(path, "volume", fault)))
}

fn memory_fault(geometry: &Geometry, stored: StoredType) -> Option<String> {
    let [width, height] = geometry.frame_size();
    let edges = [width, height, geometry.slices()];
    let bytes = edges.iter().fold(stored.bytes() as u64, |bytes, edge| bytes.saturating_mul(*edge as u64));
    let [x, y, z] = edges;
    memory::check(bytes).err().map(|fault| format!("of {x} x {y} x {z} samples {fault}"))
}

/// The properties that all frames of a file or of a live source have in common.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Header {
    /// Geometry of a volume that is swept forwards.
    pub forward: Geometry,
    /// Geometry of a volume that is swept backwards; equal to `forward` if the motor stops for each frame.
    pub backward: Geometry,
    pub stored: StoredType,
    /// Stored values that are displayed as 0 and 1; both finite, the second larger than the first.
    pub range: [f64; 2],
    /// True if frames may have poses.
    #[tree(default, skip_serializing_if = "std::ops::Not::not")]
    pub posed: bool,
    /// True if the frames are of the phantom, not of a patient.
    #[tree(skip)]
    pub synthetic: bool,
}

/// Text on pictures of the phantom, and in recordings of it whose format has a comment.
pub const DEMO_DATA: &str = "Demo data (phantom)";

/// Size of a pose in files, bytes: the upper three rows of a 4 x 4 matrix, row by row, f64.
pub(super) const POSE_BYTES: usize = 96;

/// Decodes a stored pose. None if it is not finite or not rigid.
pub(super) fn read_pose(bytes: &[u8; POSE_BYTES]) -> Option<DAffine3> {
    let words = bytes.as_chunks::<8>().0;
    let column = |c: usize| DVec3::from([0, 4, 8].map(|row| f64::from_le_bytes(words[row + c])));
    let pose = DAffine3::from_cols(column(0), column(1), column(2), column(3));
    is_rigid(&pose).then_some(pose)
}

/// Encodes a pose for a file; None becomes NaN.
pub(super) fn stored_pose(pose: Option<&DAffine3>) -> [u8; POSE_BYTES] {
    let matrix = DMat4::from(pose.copied().unwrap_or(DAffine3::NAN)).transpose().to_cols_array();
    let mut bytes = [0; POSE_BYTES];
    for (word, value) in bytes.as_chunks_mut::<8>().0.iter_mut().zip(matrix) {
        *word = value.to_le_bytes();
    }
    bytes
}

impl Header {
    /// Of frames without poses and of no phantom, whose geometry is the same both ways.
    pub(super) fn of(geometry: Geometry, stored: StoredType, range: [f64; 2]) -> Header {
        Header { forward: geometry.clone(), backward: geometry, stored, range, posed: false, synthetic: false }
    }

    /// Size of a frame, bytes. None if it is 0 or above 1 GiB.
    pub fn frame_bytes(&self) -> Option<u64> {
        let [width, height] = self.forward.frame_size();
        let samples = (width as u64).checked_mul(height as u64)?;
        samples.checked_mul(self.stored.bytes() as u64).filter(|n| *n > 0 && *n <= MAX_FRAME_BYTES)
    }

    /// Size of a scan line and of a frame, bytes; both 0 if [`Header::frame_bytes`] is None.
    pub(crate) fn line_and_frame(&self) -> (usize, usize) {
        let frame = self.frame_bytes().unwrap_or(0) as usize;
        (frame / self.forward.frame_size()[1].max(1), frame)
    }

    /// Checks that there can be frames with this header.
    ///
    /// # Errors
    /// The name of the faulty field, and what is wrong with it.
    pub(super) fn check(&self) -> Result<(), (&'static str, String)> {
        for geometry in [&self.forward, &self.backward] {
            // Checked first: the other checks visit each slice.
            if geometry.slices() > MAX_SLICES {
                return Err(("slices", format!("are {}, at most {MAX_SLICES} a volume", geometry.slices())));
            }
            let checked = match geometry {
                Geometry::Sweep(probe) => probe.check(),
                Geometry::Cartesian(grid) => grid.check(),
            };
            checked.map_err(|e| (e.field, e.fault))?;
        }
        let of = |geometry: &Geometry| (geometry.frame_size(), geometry.slices());
        if of(&self.forward) != of(&self.backward) {
            return Err(("backward", "has frames of another size or number than forward".into()));
        }
        if !self.forward.equals_except_travel(&self.backward) {
            return Err(("backward", "differs from forward in more than the motor's travel during a frame".into()));
        }
        if self.frame_bytes().is_none() {
            return Err(("forward", format!("makes frames of more than {MAX_FRAME_BYTES} bytes")));
        }
        if let Some(fault) = memory_fault(&self.forward, self.stored) {
            return Err(("volume", fault));
        }
        let [low, high] = self.range;
        match low.is_finite() && high.is_finite() && low < high {
            true => Ok(()),
            false => Err(("range", format!("[{low}, {high}] must be finite and rise"))),
        }
    }
}

/// A source of frames that are read on demand, in order of acquisition. For sources with their own clock see [`Live`](super::live::Live).
pub trait Source: Send {
    /// Geometry of the volume with this index, including the motor's travel during its frames.
    fn geometry(&self, volume: usize) -> Geometry;
    /// Type of the samples in [`Frame::bytes`].
    fn stored_type(&self) -> StoredType;
    /// Type of the samples in the file, or of the stored ones for a source without a file.
    fn sample_type(&self) -> SampleType {
        self.stored_type().into()
    }
    /// Stored values that are displayed as 0 and 1.
    fn range(&self) -> [f64; 2];
    /// Number of volumes. All are complete, except that volumes of a `.frames` file may lack frames.
    fn volumes(&self) -> usize;
    fn frames_per_volume(&self) -> usize;
    /// Moves forwards or back, so that the next frame is the first of this volume.
    ///
    /// # Errors
    /// The data cannot be read, or the volume does not exist.
    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError>;
    /// The number of the frames ([`Frame::volume`]) of the volume with this index. None if only the frames tell it.
    fn number_of(&self, _volume: usize) -> Option<u32> {
        None
    }
    /// The next frame; None after the last.
    ///
    /// # Errors
    /// Data that cannot be read.
    fn next_frame(&mut self) -> Result<Option<Frame>, InputError>;
    /// Does in advance any long computation or reading that the first frame needs, such as compounding a volume.
    ///
    /// # Errors
    /// Data that cannot be read.
    fn prepare(&mut self) -> Result<(), InputError> {
        Ok(())
    }
    /// True if the first volume is swept backwards. Unless a source states it, this is told by the motor's travel: true if the motor travels back
    /// during a frame of that volume.
    fn goes_back(&self) -> bool {
        let Geometry::Sweep(probe) = self.geometry(0) else { return false };
        match &probe.advance {
            Advance::None => false,
            Advance::Same(a) => *a < 0.0,
            Advance::Each(table) => table.iter().any(|a| *a < 0.0),
        }
    }
    /// The properties that all frames have in common. If all volumes are swept in one direction, both geometries are the same.
    fn header(&self) -> Header {
        let forward = self.geometry(0);
        let second = if self.volumes() > 1 { self.geometry(1) } else { forward.clone() };
        let (forward, backward) = if self.goes_back() { (second, forward) } else { (forward, second) };
        let (posed, synthetic) = (self.pose().is_some(), self.is_synthetic());
        Header { forward, backward, stored: self.stored_type(), range: self.range(), posed, synthetic }
    }
    /// All files that are read; empty for a source that is computed.
    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }
    /// Map from the voxels of Cartesian volumes to the world. None for sweeps, and if the source does not state it. If volumes have different
    /// poses, that of the first that has one.
    fn world(&self) -> Option<World> {
        None
    }
    /// Map from the voxels of the Cartesian volume with this index to the world: [`Source::world`], unless volumes have poses of their own.
    fn world_of(&self, _volume: usize) -> Option<World> {
        self.world()
    }
    /// The pose of all frames that have none of their own. None for sweeps, if [`Source::world`] is None or its axes are those of the volume, and if
    /// each frame states its own pose or that it has none.
    fn pose(&self) -> Option<DAffine3> {
        let Geometry::Cartesian(grid) = self.geometry(0) else { return None };
        let world = self.world().filter(|world| *world != World::of(&grid))?;
        Some(world.pose(&grid))
    }
    /// Path of the probe file that the geometry comes from; None if the source states the geometry itself.
    fn probe_file(&self) -> Option<&Path> {
        None
    }
    /// True if the frames are of the phantom, not of a patient.
    fn is_synthetic(&self) -> bool {
        false
    }
    /// Time of arrival of the last frame that was returned, s on the recorder's clock; None if it was not recorded.
    fn arrival(&self) -> Option<f64> {
        None
    }
}

/// The frames of one volume of a source, in the order of the recording. A volume of a `.frames` file may lack some.
pub struct VolumeFrames<'a> {
    source: &'a mut dyn Source,
    volume: usize,
    number: Option<u32>,
    /// Frames that were read, and the most that may follow.
    there: usize,
    left: usize,
}

impl<'a> VolumeFrames<'a> {
    /// Moves the source to the volume with this index.
    ///
    /// # Errors
    /// The data cannot be read, or the volume does not exist.
    pub fn of(source: &'a mut dyn Source, volume: usize) -> Result<VolumeFrames<'a>, InputError> {
        source.skip_to_volume(volume)?;
        let (number, left) = (source.number_of(volume), source.frames_per_volume());
        Ok(VolumeFrames { source, volume, number, there: 0, left })
    }

    /// The next frame; None after the last one that is there.
    ///
    /// # Errors
    /// Data that cannot be read.
    pub fn read(&mut self) -> Result<Option<Frame>, InputError> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        self.left = left;
        // After an incomplete volume the next frame belongs to another one.
        let next = self.source.next_frame()?;
        let next = next.filter(|frame| *self.number.get_or_insert(frame.volume) == frame.volume);
        match next {
            Some(_) => self.there += 1,
            None => self.left = 0,
        }
        Ok(next)
    }

    /// The number of frames that were read.
    ///
    /// # Errors
    /// There was none: all frames of the volume are damaged.
    pub fn count(&self) -> Result<usize, InputError> {
        let files = self.source.files();
        let file = files.first().map_or(Path::new("recording"), PathBuf::as_path);
        let fault = || InputError::new(file, format!("volume {}", self.volume), "all of its frames are damaged");
        (self.there > 0).then_some(self.there).ok_or_else(fault)
    }
}

/// Checks that a file of `count` volumes has one with the index `volume`.
///
/// # Errors
/// One line that names the file and both numbers.
pub(super) fn check_volume(path: &Path, volume: usize, count: usize) -> Result<(), InputError> {
    if volume < count {
        return Ok(());
    }
    let fault = match count {
        0 => "the recording has none".into(),
        _ => format!("there is no {volume}, the last is {}", count - 1),
    };
    Err(InputError::new(path, "volume", fault))
}

/// Total size of all files of a source, bytes.
pub(super) fn file_bytes(source: &dyn Source) -> u64 {
    let files: BTreeSet<PathBuf> = source.files().into_iter().collect();
    files.iter().filter_map(|file| file.metadata().ok()).filter(|about| about.is_file()).map(|about| about.len()).sum()
}
