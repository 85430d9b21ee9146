//! The layout of a recorded file: what a reader finds out before any sample is read.

pub(super) use super::describe::{Remarks, warned};
use super::keys::Unused;
use super::packed::Pixels;
use super::pixel::PixelFormat;
use super::transforms::Poses;
use crate::files::InputError;
use crate::probe::{AxisOrder, Probe, World};
use std::collections::BTreeMap;
use std::path::Path;

/// Most samples, lines or frames.
const MAX_EXTENT: u64 = 65_536;
/// Most frames of all volumes.
const MAX_FRAMES: usize = 1 << 20;
/// Largest frame, bytes.
const MAX_FRAME_BYTES: u64 = 1 << 30;

/// Where the samples of a recorded file are and how they are stored, with the geometry that the file states.
pub(super) struct Layout {
    pub format: &'static str,
    pub pixel: PixelFormat,
    /// Samples a line and lines, or width and height of a picture; the first index is the fastest.
    pub frame_size: [usize; 2],
    pub frames: usize,
    pub pixels: Pixels,
    pub line_order: LineOrder,
    pub geometry: StoredGeometry,
    /// True if the frames of a sweep are stored from the last slice to the first.
    pub backward: bool,
    /// Number of volumes of a sweep, stored one after another.
    pub volumes: usize,
    /// True if the file states the positions of its samples. Otherwise a `probe.toml` of the folder applies.
    pub states_geometry: bool,
    /// Transforms of tracked frames, by the name of the transform and the index of the frame.
    pub poses: Poses,
    /// Time stamp of each frame, s, by its index in the order in which frames are read; no entry if it has none.
    pub times: BTreeMap<usize, f64>,
    /// True if the file says that its samples are of the phantom.
    pub synthetic: bool,
    pub remarks: Remarks,
    /// Names of keys that the file states and that were not used.
    pub unused: Unused,
}

/// Whether the rows of a frame are scan lines, and in which order.
pub(super) enum LineOrder {
    InOrder,
    /// Rows are scan lines, and the last line comes first.
    Reversed,
    /// Rows are not scan lines: the frames are pictures. The text is the value in the file that says so.
    Pictures(String),
}

/// The geometry that a file states.
pub(super) enum StoredGeometry {
    /// One polar volume.
    Sweep(Box<Probe>),
    /// Cartesian volumes.
    Cartesian(Cartesian),
    /// The file states none although it needs one; the error says so.
    Missing(InputError),
}

/// The Cartesian volumes of a file, stored slice after slice and volume after volume.
pub(super) struct Cartesian {
    /// Number of voxels of a volume along the stored axes, fastest first.
    pub size: [usize; 3],
    /// Number of volumes.
    pub volumes: usize,
    /// Map from the voxels to the world, after their axes were put in `order`.
    pub world: World,
    /// The order in which the file says its stored axes are to be drawn.
    pub order: AxisOrder,
}

impl Layout {
    /// The layout of one volume, or of several that `geometry` has, whose file states its geometry: without times, poses and remarks.
    pub fn new(
        format: &'static str,
        pixel: PixelFormat,
        frame_size: [usize; 2],
        frames: usize,
        pixels: Pixels,
        geometry: StoredGeometry,
    ) -> Layout {
        Layout {
            format,
            pixel,
            frame_size,
            frames,
            pixels,
            line_order: LineOrder::InOrder,
            geometry,
            backward: false,
            volumes: 1,
            states_geometry: true,
            poses: Poses::default(),
            times: BTreeMap::new(),
            synthetic: false,
            remarks: Vec::new(),
            unused: Unused::default(),
        }
    }

    /// Size of a frame as `pixels` gives it, decompressed and in the type of `pixel`, bytes.
    pub fn frame_bytes(&self) -> u64 {
        self.frame_size[0] as u64 * self.frame_size[1] as u64 * self.pixel.bytes() as u64
    }

    /// Checks that a file of this length can hold the frames, so that a false header never causes a large allocation.
    ///
    /// # Errors
    /// One line that names `size_field`, the field of the file that states the size, or "data": a frame is too large, or the file too short.
    pub fn check(&self, file: &Path, size_field: &str) -> Result<(), InputError> {
        let fault = |field: &str, fault: String| Err(InputError::new(file, field, fault));
        if self.frame_bytes() > MAX_FRAME_BYTES {
            return fault(size_field, format!("one frame has {} bytes, at most 1 GiB is read", self.frame_bytes()));
        }
        // Cannot overflow: at most 2^32 frames of at most 2^30 bytes.
        let claimed = self.frame_bytes() * self.frames as u64;
        let there = self.pixels.length;
        match (claimed > self.pixels.most_bytes(), self.pixels.is_compressed()) {
            (false, _) => Ok(()),
            (true, false) => fault("data", format!("cut short, {there} of {claimed} bytes are there")),
            (true, true) => {
                fault("data", format!("{there} compressed bytes cannot hold the {claimed} bytes of {size_field}"))
            }
        }
    }
}

/// The number of frames of all volumes of a file. `make`: the verb of `field` in the message.
///
/// # Errors
/// One line: there are too many.
pub(super) fn frames(file: &Path, field: &str, make: &str, slices: usize, volumes: usize) -> Result<usize, InputError> {
    let frames = slices.saturating_mul(volumes);
    if frames > MAX_FRAMES {
        return Err(InputError::new(file, field, format!("{make} {frames} frames, at most {MAX_FRAMES} are read")));
    }
    Ok(frames)
}

/// Checks that a number of samples, lines or frames is within its range. `which`: words before it in messages.
///
/// # Errors
/// One line: it is 0 or too large.
pub(super) fn extent(file: &Path, field: &str, which: &str, value: u64) -> Result<usize, InputError> {
    match value {
        0 => Err(InputError::new(file, field, format!("{which}is 0, must be at least 1"))),
        1..=MAX_EXTENT => Ok(value as usize),
        _ => Err(InputError::new(file, field, format!("{which}is {value}, must be at most {MAX_EXTENT}"))),
    }
}
