//! The tables of a probe file, one struct each. Unknown keys are errors, so that a typing error is not silently a default.

use crate::probe::motor::MotorTable;
use serde::Deserialize;

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tables {
    pub array: ArrayTable,
    pub lines: LinesTable,
    pub depth: DepthTable,
    pub motion: MotionTable,
    #[serde(default)]
    pub sound: SoundTable,
    #[serde(default)]
    pub samples: SamplesTable,
    pub motor: Option<MotorTable>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ArrayKind {
    Curved,
    Linear,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ArrayTable {
    pub kind: ArrayKind,
    pub radius_mm: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LinesTable {
    pub sector_angle_deg: Option<f64>,
    pub width_mm: Option<f64>,
    pub angles_deg: Option<Vec<f64>>,
    pub positions_mm: Option<Vec<f64>>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DepthTable {
    #[serde(default)]
    pub start_mm: f64,
    /// Distance between samples.
    pub sample_pitch_mm: Option<f64>,
    /// Depth of the last sample: dr = (d1 - d0) / (S - 1).
    pub end_mm: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum MotionKind {
    Fan,
    Translated,
    Still,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Direction {
    #[default]
    Forward,
    Backward,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MotionTable {
    pub kind: MotionKind,
    pub wobble_radius_mm: Option<f64>,
    pub fan_angle_deg: Option<f64>,
    pub frame_angles_deg: Option<Vec<f64>>,
    pub pitch_mm: Option<f64>,
    pub frame_positions_mm: Option<Vec<f64>>,
    pub thickness_mm: Option<f64>,
    /// 0: all frames of the recording are one volume.
    #[serde(default)]
    pub frames_per_volume: usize,
    /// Every second volume was swept backwards.
    #[serde(default)]
    pub both_ways: bool,
    #[serde(default)]
    pub first_direction: Direction,
    #[serde(default)]
    pub speed_ratio: f64,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SoundTable {
    pub speed_m_per_s: f64,
}

impl Default for SoundTable {
    fn default() -> SoundTable {
        SoundTable { speed_m_per_s: 1540.0 }
    }
}

#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SamplesTable {
    pub range: Option<[f64; 2]>,
}
