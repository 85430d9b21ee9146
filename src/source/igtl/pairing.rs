//! Poses of 2D frames: an IMAGE has the positions of its pixels in the frame, a TRANSFORM the pose of the frame at a time.

use super::message::{Image, Message};
use super::names::Names;
use crate::files::quoted;
use crate::probe::is_rotation;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::collections::VecDeque;

/// Most poses that are kept.
const MAX_POSES: usize = 1024;
/// Most frames that wait for a later pose, and their bytes.
const MAX_FRAMES: usize = 64;
const MAX_FRAME_BYTES: usize = 256 << 20;

/// Assigns a pose to every 2D frame (IMAGE of depth 1), in order of arrival. It uses no clock but the time stamps of the messages.
///
/// With poses on both sides within the tolerance, the translation is interpolated linearly and the rotation along the shorter arc; between different
/// devices, or if a matrix is not a rotation, the nearer pose is used. A frame waits for a later pose until one has arrived, until a frame has
/// arrived whose time stamp is more than `patience` later, or until more than 64 frames or 256 MiB wait.
pub struct Pairing {
    device: Option<String>,
    tolerance: f64,
    patience: f64,
    poses: VecDeque<Pose>,
    frames: VecDeque<Image>,
    frame_bytes: usize,
    counts: PairingCounts,
    /// Names of TRANSFORM devices and TDATA tools that came, also those that are not selected.
    seen: Names,
}

/// A 2D frame with the pose that was assigned to it.
#[derive(Clone, Debug, PartialEq)]
pub struct PairedFrame {
    pub image: Image,
    /// The tracked pose at the frame's time, mm. It is applied after the image's own matrix.
    pub pose: DAffine3,
    /// Name of the device, or of the TDATA tool, whose pose is nearest in time.
    pub device: String,
    /// Time of the frame minus time of the nearest pose, s.
    pub lag: f64,
    /// True if the pose was interpolated between two.
    pub interpolated: bool,
}

/// Numbers of images that were and were not paired.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PairingCounts {
    pub paired: u64,
    /// Number of frames that were dropped because no pose was within the tolerance.
    pub dropped: u64,
    /// Number of images that were skipped because they are not 2D frames.
    pub volumes: u64,
}

#[derive(Clone)]
struct Pose {
    device: String,
    time: f64,
    matrix: DAffine3,
}

impl Pairing {
    /// `device`: name of the TRANSFORM's device or of the TDATA's tool whose poses are used. None: any TRANSFORM; the nearest in time is used, and of
    /// several with the same time stamp the one that arrived last. `tolerance`: largest difference between the time stamps of a frame and its pose,
    /// s. `patience`: time by which later frames may be ahead of one that still waits for a later pose, s. Negative values and NaN count as 0.
    pub fn new(device: Option<String>, tolerance: f64, patience: f64) -> Pairing {
        Pairing {
            seen: Names::new(device.clone()),
            device,
            tolerance: tolerance.max(0.0),
            patience: patience.max(0.0),
            poses: VecDeque::new(),
            frames: VecDeque::new(),
            frame_bytes: 0,
            counts: PairingCounts::default(),
        }
    }

    /// Takes a message and returns the frames that can be paired now, possibly none.
    pub fn push(&mut self, message: Message) -> Vec<PairedFrame> {
        let selected = self.device.clone();
        self.note(&message);
        match message {
            Message::Transform(m) if selected.as_ref().is_none_or(|w| *w == m.device) => {
                self.pose(m.device, m.time, &m.matrix)
            }
            Message::TrackingData(m) => match m.tools.into_iter().find(|t| selected.as_ref() == Some(&t.name)) {
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

    /// Pairs the frames that still wait with the poses that have arrived. Frames without a pose within the tolerance are dropped and counted.
    pub fn finish(&mut self) -> Vec<PairedFrame> {
        self.settle(true)
    }

    /// Remembers the names of transforms.
    fn note(&mut self, message: &Message) {
        match message {
            Message::Transform(m) => _ = self.seen.add(&m.device),
            Message::TrackingData(m) => m.tools.iter().for_each(|tool| _ = self.seen.add(&tool.name)),
            _ => {}
        }
    }

    /// True once a TRANSFORM or a tool of a TDATA message has arrived, whether it is selected or not.
    pub(crate) fn has_transforms(&self) -> bool {
        self.seen.count() > 0
    }

    /// The reason for users why frames get no pose, with the names of the transforms that have arrived.
    pub(crate) fn why_unpaired(&self) -> String {
        if self.seen.count() == 0 {
            return "no transform came; --tool image takes the matrix of each image".into();
        }
        let names = self.seen.list();
        match &self.device {
            Some(device) if !self.seen.contains(device) => {
                format!("no transform of {} came; --tool takes one of {names}", quoted(device))
            }
            None if self.poses.is_empty() => format!("no TRANSFORM came; --tool takes one of the tools {names}"),
            _ => {
                let near = self.tolerance;
                format!("no pose came within {near} s of their time; the transforms are {names}")
            }
        }
    }

    /// Numbers of images so far.
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

    /// Pairs frames in order: a frame that waits holds up those after it.
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

    /// The nearest pose, and the pose at `time`. `over`: no later pose is expected.
    fn find(&self, time: f64, over: bool) -> Option<(Pose, DAffine3, bool)> {
        let near = || self.poses.iter().filter(|p| (p.time - time).abs() <= self.tolerance);
        // Of equal elements, max_by returns the last and min_by the first: in both cases the one that arrived last.
        let before = near().filter(|p| p.time <= time).max_by(|a, b| a.time.total_cmp(&b.time));
        let after = near().rev().filter(|p| p.time > time).min_by(|a, b| a.time.total_cmp(&b.time));
        let single = |pose: &Pose| Some((pose.clone(), pose.matrix, false));
        match (before, after) {
            (Some(exact), _) if exact.time == time => single(exact),
            (Some(a), Some(b)) => {
                let part = (time - a.time) / (b.time - a.time);
                let nearest = if part <= 0.5 { a } else { b };
                match between(&a.matrix, &b.matrix, part).filter(|_| a.device == b.device) {
                    Some(pose) => Some((nearest.clone(), pose, true)),
                    None => single(nearest),
                }
            }
            (None, Some(b)) => single(b),
            (Some(a), None) if over => single(a),
            _ => None,
        }
    }
}

/// The pose at the fraction `part` from `a` to `b`, if both are rigid.
fn between(a: &DAffine3, b: &DAffine3, part: f64) -> Option<DAffine3> {
    let rotation = |m: DMat3| is_rotation(&m).then(|| DQuat::from_mat3(&m).normalize());
    let turned = rotation(a.matrix3)?.slerp(rotation(b.matrix3)?, part);
    Some(DAffine3::from_rotation_translation(turned, a.translation.lerp(b.translation, part)))
}
