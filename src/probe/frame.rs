//! A frame of samples.

use glam::DAffine3;

/// One polar 2D acquisition, or one slice of a Cartesian volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Number of the volume that the frame belongs to, from 0.
    pub volume: u32,
    /// Index in its volume in order of acquisition, from 0.
    pub number: u32,
    /// Index in its volume in geometric order, from 0: it equals `number`, but is K - 1 - `number` in a volume of K frames that was swept backwards.
    pub slice: usize,
    /// True if the volume was swept backwards.
    pub backward: bool,
    /// Time stamp, s, on the clock of the device that acquired it; None if it has none.
    pub time: Option<f64>,
    /// Rigid map from the volume's coordinates, mm, to the world (LPS) or to the space of a tracker; None if it is not known. The pose of a
    /// volume is that of its first frame that has one.
    pub pose: Option<DAffine3>,
    /// Samples of the stored type (`Header::stored` of the source), little-endian, line by line (samples fastest). A Cartesian slice is stored row
    /// by row (lateral fastest).
    pub bytes: Vec<u8>,
}

impl Frame {
    /// A frame of a volume that was swept forwards, without time stamp and pose. Its [`Frame::number`] is `slice`.
    pub fn of_slice(volume: u32, slice: usize, bytes: Vec<u8>) -> Frame {
        Frame { volume, number: slice as u32, slice, backward: false, time: None, pose: None, bytes }
    }
}
