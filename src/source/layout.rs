//! The layout of a recorded file: what a reader finds out before any sample is read.

pub(super) use super::describe::warned;
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
/// Largest frame, bytes.
const MAX_FRAME_BYTES: u64 = 1 << 30;

/// The layout of a recorded file, and the geometry that is stored in it.
pub(super) struct Layout {
    pub format: &'static str,
    pub pixel: PixelFormat,
    /// Samples and lines, or width and height; the first index is the fastest.
    pub frame_size: [usize; 2],
    pub frames: usize,
    pub pixels: Pixels,
    pub line_order: LineOrder,
    pub geometry: StoredGeometry,
    /// The frames of a sweep come from the last slice to the first.
    pub backward: bool,
    /// Number of volumes of a sweep, one after another.
    pub volumes: usize,
    /// The file states where its samples lie. If not, a `probe.toml` of the folder applies.
    pub states_geometry: bool,
    /// Transforms of tracked frames.
    pub poses: Poses,
    /// Time stamps by frame, s.
    pub times: BTreeMap<usize, f64>,
    /// The file says that its samples are of the phantom.
    pub synthetic: bool,
    /// Remarks for users: title and text. Never a patient field.
    pub remarks: Vec<(String, String)>,
    /// Keys that the file states and that were not used.
    pub unused: Unused,
}

/// How the rows of a frame relate to scan lines.
pub(super) enum LineOrder {
    InOrder,
    /// The last line comes first.
    Reversed,
    /// They are not scan lines: the frames are pictures. Holds the value in the file that says so.
    Pictures(String),
}

/// The geometry that is stored in a file.
pub(super) enum StoredGeometry {
    /// One polar volume.
    Sweep(Box<Probe>),
    /// Cartesian volumes.
    Cartesian(Cartesian),
    /// None, although the file needs one.
    Missing(InputError),
}

/// Cartesian volumes of a file: slices one after another, volumes one after another.
pub(super) struct Cartesian {
    /// Voxels of a volume along the stored axes, fastest first.
    pub size: [usize; 3],
    /// Number of volumes.
    pub volumes: usize,
    /// Where the voxels are after `order`.
    pub world: World,
    /// The order in which the file says that its axes are to be drawn.
    pub order: AxisOrder,
}

impl Layout {
    /// Size of a frame in the file, bytes.
    pub fn frame_bytes(&self) -> u64 {
        self.frame_size[0] as u64 * self.frame_size[1] as u64 * self.pixel.bytes() as u64
    }

    /// Refuses sizes that are impossible for a file of this length, so that a false header never causes a large allocation.
    pub fn check(&self, file: &Path, size_field: &str) -> Result<(), InputError> {
        let fault = |field: &str, fault: String| Err(InputError::new(file, field, fault));
        if self.frame_bytes() > MAX_FRAME_BYTES {
            return fault(size_field, format!("one frame has {} bytes, at most 1 GiB is read", self.frame_bytes()));
        }
        // Cannot overflow: at most 2^16 frames of at most 2^30 bytes.
        let claimed = self.frame_bytes() * self.frames as u64;
        let there = self.pixels.length;
        if !self.pixels.is_compressed() && claimed > there {
            return fault("data", format!("cut short, {there} of {claimed} bytes are there"));
        }
        let most = there.saturating_mul(self.pixels.encoding.most()).saturating_add(1024);
        if self.pixels.is_compressed() && claimed > most {
            return fault("data", format!("{there} compressed bytes cannot hold the {claimed} bytes of {size_field}"));
        }
        Ok(())
    }
}

/// Checks a number of samples, lines or frames.
pub(super) fn extent(file: &Path, field: &str, which: &str, value: u64) -> Result<usize, InputError> {
    match value {
        0 => Err(InputError::new(file, field, format!("{which}is 0, must be at least 1"))),
        1..=MAX_EXTENT => Ok(value as usize),
        _ => Err(InputError::new(file, field, format!("{which}is {value}, must be at most {MAX_EXTENT}"))),
    }
}
