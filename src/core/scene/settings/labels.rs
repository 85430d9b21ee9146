//! Settings of labels: how a segmentation is laid over the picture.

use crate::scene::Settings;
use crate::scene::labels::SharedLabels;
use crate::scene::number::Allowed::Any;
use crate::scene::number::{Group, Number, SHARE, number};
use crate::tree::{Defaults, FromNode, ToNode};

/// Labels: a segmentation that is shown with the echoes (`render --labels`, `view --labels`). Planes show the boundary of each label and a
/// translucent fill, renderings a translucent shell. They lie over the finished picture, in the colours of the file; without a file nothing of this applies.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Labels {
    /// Opacity of the fill on planes.
    #[value(0.25)]
    pub fill: f64,
    /// Draw the boundaries on planes.
    #[value(true)]
    pub outline: bool,
    /// Opacity of the shell in renderings.
    #[value(0.5)]
    pub shell: f64,
    /// Share of the shell's opacity that is left where it lies at least 1.5 voxels behind a rendered surface. 0 hides it there.
    #[value(0.35)]
    pub behind: f64,
    /// The labels themselves, which are in a file of their own.
    #[tree(skip)]
    pub volume: Option<SharedLabels>,
}

fn has_labels(s: &Settings) -> bool {
    s.labels.volume.is_some()
}

pub(super) const NUMBERS: &[Number] = &[
    number!(labels.fill, "", SHARE;
        Group::Image, "Label fill", [0.0, 1.0], 0.05, has_labels, "How strongly labels tint planes: less shows more of the tissue."),
    number!(labels.outline, "", Any;
        Group::Image, "Label outline", [0.0, 1.0], 1.0, has_labels, "Draws the boundary of each label on planes."),
    number!(labels.shell, "", SHARE;
        Group::Image, "Label shell", [0.0, 1.0], 0.05, has_labels, "How opaque the surface of labels is in 3D."),
    number!(labels.behind, "", SHARE;
        Group::Image, "Labels behind", [0.0, 1.0], 0.05, has_labels,
        "How much of the labels shines through a surface in front of them: 0 hides them there."),
];
