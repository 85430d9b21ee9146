//! Settings of measurements and annotations: calipers, contours, texts and arrows in the space of the volume. No pass reads them: the viewer
//! draws them over the picture, and `render` into the picture that it writes.

use crate::scene::number::Allowed::Range;
use crate::scene::number::{Number, SHARE, number};
use crate::tree::{All, FromNode, ToNode};

/// Largest number of measurements and annotations of a scene.
pub const MAX_MEASURES: usize = 64;
/// Largest number of points of a measurement, or of one of its contours.
pub const MAX_POINTS: usize = 512;
/// Largest number of points of all measurements of a scene together.
pub const MAX_ALL_POINTS: usize = 20_000;
/// Largest number of contours of a volume measurement.
pub const MAX_CONTOURS: usize = 64;
/// Longest text of a measurement, characters.
pub const MAX_TEXT: usize = 80;
/// Longest description of what a measurement was made on, characters.
pub(crate) const MAX_MADE: usize = 200;

/// A measurement or an annotation. It keeps its place in the volume whatever the view.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Measurement {
    /// What is measured.
    pub kind: MeasureKind,
    /// Its points in mm: lateral, depth (from the probe's face), elevation. A text has 1; a distance and an arrow (tip first) have 2, and an
    /// automatic volume has 2 corners of its box. An angle has 3 (its vertex is the second), and so has an ellipse (the ends of one axis and one of
    /// the other). A trace has 3 to 512, a distance on the surface 2 to 512, a volume by contours none.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 3]>,
    /// Of a volume: its 2 to 64 contours, each of 3 to 512 points in mm, in parallel planes or in planes through one axis.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub contours: Vec<Vec<[f64; 3]>>,
    /// Text beside it, at most 80 characters.
    #[tree(default, skip_serializing_if = "String::is_empty")]
    pub text: String,
    /// Of an automatic volume: the echo at the surface of the body, as a share of the sample range.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub threshold: Option<f64>,
    /// Of an automatic volume: its result, mm^3. It belongs to the volume of the recording that was shown then.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub counted: Option<f64>,
    /// Of an automatic volume: both ends of its interval of 95 %, mm^3. Absent: the result is the volume of all voxels of the box whose echo reaches
    /// the threshold, and has no interval.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// Its points were picked on the rendered surface: it is drawn on renderings. Others are drawn on the planes that they lie in.
    #[tree(default, skip_serializing_if = "std::ops::Not::not")]
    pub on_surface: bool,
    /// What it was made on. Absent: nothing in particular. While another volume than that in `made` is shown, the measurement is drawn dimmed.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub made: Option<Made>,
}

/// What a measurement was made on: the volume, the plane or view, and the settings. The viewer writes it.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Made {
    /// The number of its volume in the recording, or since the start of a live source, from 0.
    pub volume: u32,
    /// The time stamp of that volume, s. Absent: the source states none.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// The plane or the view, in words with its place in mm and its directions, at most 200 characters.
    #[tree(default, skip_serializing_if = "String::is_empty")]
    pub plane: String,
    /// The mode, and a digest of all settings but `picture`, `measure`, `body_marks`, `marks` and `cine`. At most 200 characters.
    #[tree(default, skip_serializing_if = "String::is_empty")]
    pub settings: String,
}

/// What is measured or marked.
// In the order of their buttons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, All, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum MeasureKind {
    /// Caliper: the straight distance of two points.
    #[default]
    Distance,
    /// The angle between two legs.
    Angle,
    /// Area and circumference of an ellipse.
    Ellipse,
    /// Area and circumference of a closed contour.
    Trace,
    /// Length along the rendered surface; without `on_surface` along a line in space, such as on a curved plane.
    Surface,
    /// Volume by contours: area times distance, or turned about an axis.
    Volume,
    /// Automatic volume: of the largest body in a box that is brighter than what is around it.
    Threshold,
    /// A text at a point.
    Text,
    /// An arrow with a text at its tail.
    Arrow,
}

impl Measurement {
    /// The number of the volume that the measurement was made on, if that is known and differs from the volume `shown`. None otherwise, and if
    /// `shown` is None.
    pub fn other_volume(&self, shown: Option<u32>) -> Option<u32> {
        self.made.as_ref().map(|made| made.volume).filter(|volume| shown.is_some_and(|shown| shown != *volume))
    }

    /// Number of points, those of contours included.
    pub fn count(&self) -> usize {
        self.points.len() + self.contours.iter().map(Vec::len).sum::<usize>()
    }

    /// Along what a length of this measurement is measured, as the user reads it.
    pub fn way(&self) -> &'static str {
        if self.on_surface { "along the surface" } else { "along the line" }
    }

    /// Name of the measurement that the user reads.
    pub fn title(&self) -> &'static str {
        match (self.kind, self.on_surface) {
            (MeasureKind::Surface, false) => "Along a line",
            (MeasureKind::Threshold, _) if self.interval.is_none() => "Threshold volume",
            (kind, _) => kind.title(),
        }
    }
}

impl MeasureKind {
    /// Name of the kind that the user reads.
    pub fn title(self) -> &'static str {
        match self {
            MeasureKind::Distance => "Caliper",
            MeasureKind::Angle => "Angle",
            MeasureKind::Ellipse => "Ellipse",
            MeasureKind::Trace => "Trace",
            MeasureKind::Surface => "Surface",
            MeasureKind::Volume => "Volume",
            MeasureKind::Threshold => "Automatic volume",
            MeasureKind::Text => "Text",
            MeasureKind::Arrow => "Arrow",
        }
    }

    /// Number of points at which a measurement of this kind is complete. None for kinds that the user ends.
    pub fn complete_at(self) -> Option<usize> {
        match self {
            MeasureKind::Text => Some(1),
            MeasureKind::Distance | MeasureKind::Arrow | MeasureKind::Threshold => Some(2),
            MeasureKind::Angle | MeasureKind::Ellipse => Some(3),
            MeasureKind::Trace | MeasureKind::Surface | MeasureKind::Volume => None,
        }
    }
}

pub(super) const NUMBERS: &[Number] = &[
    number!([drawn] measure => points, "mm", Range(-1e6, 1e6)),
    number!([drawn] measure => contours, "mm", Range(-1e6, 1e6)),
    number!([drawn] measure => threshold, "", SHARE),
    number!([drawn] measure => made => time, "s", Range(-1e15, 1e15)),
    number!([drawn] measure => counted, "mm^3", Range(0.0, 1e18)),
    number!([drawn] measure => interval, "mm^3", Range(0.0, 1e18)),
];
