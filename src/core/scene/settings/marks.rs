//! Settings of marks: the sides of the patient on every tile, and the bar of a written picture. No pass reads them.

use crate::tree::{FromNode, ToNode};
use glam::DVec3;

/// Marks beside and on the picture. The viewer shows the sides and the dot of the probe's marker on every tile; `render` draws them only with `bar`.
#[derive(Clone, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Marks {
    /// The scan line at which the marker on the probe's housing is. A dot on each tile shows its side.
    pub probe: ProbeMarker,
    /// The patient's sides from the first scan line (-lateral) to the last (+lateral). Two axes determine the third: sides that fit only a mirrored
    /// patient are refused.
    pub lateral: Sides,
    /// The patient's sides from the probe's face down.
    pub depth: Sides,
    /// The patient's sides from the first slice (-elevation) to the last (+elevation).
    pub elevation: Sides,
    /// `render` draws the sides and the dot on the tiles, and a bar below the picture: scale, depth, mode, time and "not a medical device". The picture becomes
    /// higher by the bar. The viewer has a switch of its own for saved pictures.
    pub bar: bool,
}

/// Where the marker of the probe is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum ProbeMarker {
    /// At the first scan line.
    #[default]
    First,
    /// At the last scan line.
    Last,
    /// It is not shown.
    Hidden,
}

/// The sides of the patient at the two ends of an axis, from the low end to the high one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Sides {
    /// Not known: no letters.
    #[default]
    None,
    /// L to R.
    LeftRight,
    /// R to L.
    RightLeft,
    /// H to F.
    HeadFeet,
    /// F to H.
    FeetHead,
    /// A (anterior) to P (posterior).
    FrontBack,
    /// P (posterior) to A (anterior).
    BackFront,
}

impl Sides {
    /// The same sides, each at the other end.
    pub fn exchanged(self) -> Sides {
        match self {
            Sides::None => Sides::None,
            Sides::LeftRight => Sides::RightLeft,
            Sides::RightLeft => Sides::LeftRight,
            Sides::HeadFeet => Sides::FeetHead,
            Sides::FeetHead => Sides::HeadFeet,
            Sides::FrontBack => Sides::BackFront,
            Sides::BackFront => Sides::FrontBack,
        }
    }

    /// Unit vector from the axis's first end to its last, in the patient's axes: to the left, to the back, to the head. Zero if the sides are not
    /// known.
    pub(crate) fn direction(self) -> DVec3 {
        match self {
            Sides::None => DVec3::ZERO,
            Sides::RightLeft => DVec3::X,
            Sides::FrontBack => DVec3::Y,
            Sides::FeetHead => DVec3::Z,
            other => -other.exchanged().direction(),
        }
    }

    /// The sides along an axis that runs in this direction of the patient, in the axes to the left, to the back and to the head: those that are
    /// nearest to it.
    pub(crate) fn along(direction: DVec3) -> Sides {
        let all = [Sides::RightLeft, Sides::FrontBack, Sides::FeetHead];
        let all = all.into_iter().flat_map(|sides| [sides, sides.exchanged()]);
        all.max_by(|a, b| a.direction().dot(direction).total_cmp(&b.direction().dot(direction))).unwrap_or_default()
    }

    /// The letters of the patient's sides (L, R, A, P, H, F) at the low and the high end of the axis. None if the sides are not known.
    pub fn letters(self) -> Option<[&'static str; 2]> {
        Some(match self {
            Sides::None => return None,
            Sides::LeftRight => ["L", "R"],
            Sides::RightLeft => ["R", "L"],
            Sides::HeadFeet => ["H", "F"],
            Sides::FeetHead => ["F", "H"],
            Sides::FrontBack => ["A", "P"],
            Sides::BackFront => ["P", "A"],
        })
    }
}
