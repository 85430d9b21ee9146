//! Settings of body marks: small outlines of a part of the body with the position and the direction of the probe. No pass reads them: the
//! viewer draws them over the picture, and `render` into the picture that it writes.

use crate::scene::number::Allowed::Range;
use crate::scene::number::{ANGLE, Number, SHARE, number};
use crate::tree::{All, Defaults, FromNode, ToNode};

/// Most body marks of a scene.
pub const MAX_BODY_MARKS: usize = 4;
/// Smallest and largest edge of a body mark, as a share of the picture's shorter edge.
pub const BODY_MARK_SIZES: [f64; 2] = [0.06, 0.5];

/// A body mark. It keeps its place on the picture whatever the view.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct BodyMark {
    /// The part of the body.
    pub body: Body,
    /// Exchanges left and right of the outline, for example for the left breast, or for a fetus whose back is on the other side. `probe` and `angle`
    /// stay as they are.
    #[tree(skip_serializing_if = "std::ops::Not::not")]
    pub mirrored: bool,
    /// Its centre, as shares of the picture's width and height from the upper left corner. Near an edge of the picture the mark is drawn further
    /// inside, so that all of it is on the picture. Absent: 0.12, 0.8.
    #[value([0.12, 0.8])]
    pub at: [f64; 2],
    /// The edge of its square, as a share of the picture's shorter edge, 0.06..=0.5. Absent: 0.18.
    #[value(0.18)]
    pub size: f64,
    /// Where on the body the probe is: right and down from the centre of the mark; its edges are at -1 and 1. Absent: the centre.
    pub probe: [f64; 2],
    /// Where the marker of the probe points, degrees clockwise from up. -90 is the right side of a body that is seen from the front, and the left side of the
    /// head, which is seen from above. Absent: -90.
    // Transverse, as most examinations begin.
    #[value(-90.0)]
    pub angle: f64,
}

/// The part of the body that a body mark shows; all but the head are seen from the front.
// In the order of their buttons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, All, FromNode, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Body {
    /// The trunk from the ribs to the groins.
    #[default]
    Abdomen,
    /// A pregnant abdomen, the fetus with its head down.
    FetusCephalic,
    /// A pregnant abdomen, the fetus with its head up.
    FetusBreech,
    /// A pregnant abdomen, the fetus across.
    FetusTransverse,
    /// Uterus, tubes and ovaries.
    Uterus,
    /// The head of an infant from above, with the great fontanelle; the nose is up.
    Head,
    /// Neck and thyroid.
    Neck,
    /// The right breast.
    Breast,
}

impl Body {
    /// Name of the part of the body that the user reads.
    pub fn title(self) -> &'static str {
        match self {
            Body::Abdomen => "Abdomen",
            Body::FetusCephalic => "Fetus, cephalic",
            Body::FetusBreech => "Fetus, breech",
            Body::FetusTransverse => "Fetus, transverse",
            Body::Uterus => "Uterus",
            Body::Head => "Infant head",
            Body::Neck => "Neck",
            Body::Breast => "Breast",
        }
    }
}

pub(super) const NUMBERS: &[Number] = &[
    number!([drawn] body_marks => at, "", SHARE),
    number!([drawn] body_marks => size, "", Range(BODY_MARK_SIZES[0], BODY_MARK_SIZES[1])),
    number!([drawn] body_marks => probe, "", Range(-1.0, 1.0)),
    number!([drawn] body_marks => angle, "°", ANGLE),
];
