//! Poses for 2D frames: an IMAGE says where its pixels lie within the frame, a TRANSFORM where the frame was at a time.

use super::message::{Image, Message};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::collections::VecDeque;

/// Poses that are kept to choose from.
const MAX_POSES: usize = 1024;
/// Frames that wait for a later pose, and their bytes.
const MAX_FRAMES: usize = 64;
const MAX_FRAME_BYTES: usize = 256 << 20;
/// How far from a rotation (largest entry of R^T R - 1) a matrix may be to be turned by angles.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// Gives every 2D frame (IMAGE of depth 1) a pose, in the order in which the frames came. Pure: its clock is the stamps.
///
/// With poses on both sides within the tolerance, the translation is interpolated linearly and the rotation along the
/// shorter arc; across different devices, or where a matrix is no rotation, the nearer one is taken. A frame waits for a
/// pose behind it until a later one has come, or frames have gone on for `patience`, or 64 frames or 256 MiB wait.
pub struct Pairing {
    device: Option<String>,
    tolerance: f64,
    patience: f64,
    poses: VecDeque<Pose>,
    frames: VecDeque<Image>,
    frame_bytes: usize,
    counts: PairingCounts,
}

/// A frame and where it was.
#[derive(Clone, Debug, PartialEq)]
pub struct PairedFrame {
    pub image: Image,
    /// The TRANSFORM at the frame's time, mm: from the space that the image's own matrix leads to.
    pub pose: DAffine3,
    /// Of the nearest pose.
    pub device: String,
    /// Time of the frame less that of the nearest pose, s.
    pub lag: f64,
    /// Between two poses.
    pub interpolated: bool,
}

/// What became of the images.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PairingCounts {
    pub paired: u64,
    /// Frames without a pose within the tolerance.
    pub dropped: u64,
    /// Images that are no 2D frames: passed over.
    pub volumes: u64,
}

#[derive(Clone)]
struct Pose {
    device: String,
    time: f64,
    matrix: DAffine3,
}

impl Pairing {
    /// `device`: whose TRANSFORM, or which tool of TDATA; `None`: whichever TRANSFORM is nearest, of several the last to
    /// come. `tolerance`: between a frame's and its pose's stamps, s. `patience`: how far frames may run ahead of the
    /// poses, s. Negative ones and NaN are taken as 0.
    pub fn new(device: Option<String>, tolerance: f64, patience: f64) -> Pairing {
        Pairing {
            device,
            tolerance: tolerance.max(0.0),
            patience: patience.max(0.0),
            poses: VecDeque::new(),
            frames: VecDeque::new(),
            frame_bytes: 0,
            counts: PairingCounts::default(),
        }
    }

    /// The frames that this message settles, which may be none; messages of other types settle nothing.
    pub fn push(&mut self, message: Message) -> Vec<PairedFrame> {
        let wanted = self.device.clone();
        match message {
            Message::Transform(m) if wanted.as_ref().is_none_or(|w| *w == m.device) => {
                self.pose(m.device, m.time, &m.matrix)
            }
            Message::TrackingData(m) => match m.tools.into_iter().find(|t| wanted.as_ref() == Some(&t.name)) {
                Some(tool) => self.pose(tool.name, m.time, &tool.matrix),
                None => return Vec::new(),
            },
            Message::Image(image) if image.size[2] == 1 => {
                self.frame_bytes += image.bytes.len();
                self.frames.push_back(image);
            }
            Message::Image(_) => self.counts.volumes += 1,
            _ => return Vec::new(),
        }
        self.settle(false)
    }

    /// The frames that still wait, with the poses that there are.
    pub fn finish(&mut self) -> Vec<PairedFrame> {
        self.settle(true)
    }

    pub fn counts(&self) -> PairingCounts {
        self.counts.clone()
    }

    fn pose(&mut self, device: String, time: f64, rows: &[[f32; 4]; 3]) {
        let column = |c: usize| DVec3::from(rows.map(|row| f64::from(row[c])));
        let matrix = DAffine3::from_cols(column(0), column(1), column(2), column(3));
        if self.poses.len() == MAX_POSES {
            self.poses.pop_front();
        }
        self.poses.push_back(Pose { device, time, matrix });
    }

    /// In order: a frame that waits holds up those behind it.
    fn settle(&mut self, at_once: bool) -> Vec<PairedFrame> {
        let mut settled = Vec::new();
        while let Some(frame) = self.frames.front() {
            let full = self.frames.len() > MAX_FRAMES || self.frame_bytes > MAX_FRAME_BYTES;
            let newest = self.frames.back().map_or(frame.time, |f| f.time);
            let poses_past = self.poses.back().is_some_and(|p| p.time > frame.time + self.tolerance);
            let over = at_once || full || poses_past || newest > frame.time + self.patience;
            let found = self.find(frame.time, over);
            if found.is_none() && !over {
                break;
            }
            let Some(image) = self.frames.pop_front() else { break };
            self.frame_bytes -= image.bytes.len();
            match found {
                Some((nearest, pose, interpolated)) => {
                    self.counts.paired += 1;
                    let (device, lag) = (nearest.device, image.time - nearest.time);
                    settled.push(PairedFrame { image, pose, device, lag, interpolated });
                }
                None => self.counts.dropped += 1,
            }
        }
        settled
    }

    /// The nearest pose, and the one at `time`. `over`: no later pose will come.
    fn find(&self, time: f64, over: bool) -> Option<(Pose, DAffine3, bool)> {
        let near = || self.poses.iter().filter(|p| (p.time - time).abs() <= self.tolerance);
        // Of equals, max_by takes the last, and min_by the first: both the one that came last.
        let before = near().filter(|p| p.time <= time).max_by(|a, b| a.time.total_cmp(&b.time));
        let after = near().rev().filter(|p| p.time > time).min_by(|a, b| a.time.total_cmp(&b.time));
        let alone = |pose: &Pose| Some((pose.clone(), pose.matrix, false));
        match (before, after) {
            (Some(exact), _) if exact.time == time => alone(exact),
            (Some(a), Some(b)) => {
                let part = (time - a.time) / (b.time - a.time);
                let nearest = if part <= 0.5 { a } else { b };
                match between(&a.matrix, &b.matrix, part).filter(|_| a.device == b.device) {
                    Some(pose) => Some((nearest.clone(), pose, true)),
                    None => alone(nearest),
                }
            }
            (None, Some(b)) => alone(b),
            (Some(a), None) if over => alone(a),
            _ => None,
        }
    }
}

/// The pose a `part` of the way from `a` to `b`, if both are rotations and translations.
fn between(a: &DAffine3, b: &DAffine3, part: f64) -> Option<DAffine3> {
    let rotation = |m: DMat3| {
        let off = (m.transpose() * m - DMat3::IDENTITY).to_cols_array();
        let rigid = m.determinant() > 0.0 && off.iter().all(|v| v.abs() <= ROTATION_TOLERANCE);
        rigid.then(|| DQuat::from_mat3(&m).normalize())
    };
    let turned = rotation(a.matrix3)?.slerp(rotation(b.matrix3)?, part);
    Some(DAffine3::from_rotation_translation(turned, a.translation.lerp(b.translation, part)))
}
