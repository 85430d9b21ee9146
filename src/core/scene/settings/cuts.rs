//! Settings of cuts: contours drawn on a rendering, along whose view the volume is removed from renderings, and what a brush went over.

use crate::scene::number::Allowed::Range;
use crate::scene::number::{LARGEST, LENGTH, LENGTH_OR_0, Number, PLACE, number};
use crate::tree::{Defaults, FromNode, ToNode};

/// Most cuts of a scene.
pub const MAX_CUTS: usize = 32;
/// Most corners of the contour of a cut.
pub const MAX_CUT_POINTS: usize = 512;

/// Most points of a brush, those of all its strokes together.
pub const MAX_BRUSH_POINTS: usize = 512;

/// A cut. What lies within its contour, seen from where that was drawn, is removed from renderings; with `keep = 'inside'` it is what lies outside.
/// The cut keeps its place in the volume whatever the view: a prism of a parallel view, a cone of one in perspective. With `brush`, what lies near
/// its strokes is removed instead.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Cut {
    /// Corners of the closed contour, 3 to 512: mm to the right of `view.at` and up, in the plane through it that faces the view. What the contour
    /// winds about is inside, also where it crosses itself. Required without `brush`, absent with it.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub contour: Vec<[f64; 2]>,
    /// The view at which the contour was drawn. Absent: from the point 0, 0, 0 down, with +elevation up.
    #[tree(default)]
    pub view: CutView,
    /// The side of the contour that stays.
    #[tree(default)]
    pub keep: KeptSide,
    /// How deep the cut is: nothing is removed more than so many mm behind the contour's plane. Absent: it goes through everything.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<f64>,
    /// A brush in place of a contour; `contour`, `view`, `keep` and `depth` are then absent.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub brush: Option<Brush>,
}

/// A brush: what lies within a radius of its strokes is removed from renderings.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Brush {
    /// Distance from its strokes, mm, within which it removes.
    pub radius: f64,
    /// Points that straight lines join, mm: lateral, depth (from the probe's face), elevation. A stroke of one point is a ball. A stroke has
    /// at least 1 point, and all strokes together at most 512.
    pub strokes: Vec<Vec<[f64; 3]>>,
}

impl Brush {
    /// Number of points of all strokes.
    pub fn points(&self) -> usize {
        self.strokes.iter().map(Vec::len).sum()
    }
}

/// The view at which the contour of a cut was drawn.
// The default is from the probe down, as a camera without angles looks.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct CutView {
    /// A point of the contour's plane, its origin, in mm: lateral, depth (from the probe's face), elevation.
    pub at: [f64; 3],
    /// Direction of the view, away from the viewer, of any length but 0: the normal of the contour's plane.
    #[value([0.0, 1.0, 0.0])]
    pub direction: [f64; 3],
    /// The upward direction of the view, not parallel to `direction`; only its part in the contour's plane counts.
    #[value([0.0, 0.0, 1.0])]
    pub up: [f64; 3],
    /// Perspective: distance of the viewer's eye from the contour's plane, mm, in front of its origin. Absent: a parallel view.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub eye: Option<f64>,
}

/// The side of a cut's contour that stays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum KeptSide {
    /// What is within the contour is removed.
    #[default]
    Outside,
    /// What is outside of the contour is removed.
    Inside,
}

pub(super) const NUMBERS: &[Number] = &[
    number!(cuts => contour, "mm", Range(-LARGEST, LARGEST)),
    number!(cuts => view.at, "mm", PLACE),
    number!(cuts => view.eye, "mm", LENGTH),
    number!(cuts => depth, "mm", LENGTH_OR_0),
    number!(cuts => brush => radius, "mm", LENGTH),
    number!(cuts => brush => strokes, "mm", Range(-LARGEST, LARGEST)),
];
