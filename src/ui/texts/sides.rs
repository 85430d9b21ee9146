//! Texts about the patient's sides and the probe's marker.

use crate::scene::{ProbeMarker, Sides, VolumeAxis};

pub const SIDES: &str = "Sides";
pub(crate) const SIDES_HINT: &str =
    "The patient's sides as letters on every tile and in saved pictures, and the probe's marker.";
text!(sides_in_short(sides) = "Sides: {sides}");
pub(crate) const EXCHANGE_LEFT_AND_RIGHT: [&str; 2] =
    ["Exchange L and R", "Left and right the other way round, as when the probe is turned. Nothing else changes."];
pub(crate) const NO_SIDES_SHORT: &str = "-";

/// The heading of an axis.
pub fn axis(axis: VolumeAxis) -> &'static str {
    match axis {
        VolumeAxis::Lateral => "Scan lines, first to last",
        VolumeAxis::Elevation => "Slices, first to last",
        VolumeAxis::Depth => "From the probe down",
    }
}

/// Sides along an axis in words, as they are read aloud, and the tooltip.
pub fn sides(axis: VolumeAxis, sides: Sides) -> [String; 2] {
    let (first, last) = match sides {
        Sides::None => return ["no letters".into(), "Not known: no letters.".into()],
        Sides::LeftRight => ("left", "right"),
        Sides::RightLeft => ("right", "left"),
        Sides::HeadFeet => ("head", "feet"),
        Sides::FeetHead => ("feet", "head"),
        Sides::FrontBack => ("front", "back"),
        Sides::BackFront => ("back", "front"),
    };
    let name = format!("{first} to {last}");
    // Only these letters are not those with which the words begin.
    let [first, last] = [first, last].map(|side| match side {
        "front" => "front (A)",
        "back" => "back (P)",
        side => side,
    });
    let hint = match axis {
        VolumeAxis::Lateral => format!("The patient's {first} is at the first scan line, the {last} at the last."),
        VolumeAxis::Elevation => format!("The patient's {first} is at the first slice, the {last} at the last."),
        VolumeAxis::Depth => format!("The patient's {first} is at the probe, the {last} is deep."),
    };
    [name, hint]
}

pub(crate) const PROBE_MARKER: &str = "Probe marker (dot)";

/// The position of the marker, in short, and what it means.
pub(crate) fn probe_marker(marker: ProbeMarker) -> [&'static str; 2] {
    match marker {
        ProbeMarker::First => ["First", "The marker on the probe's housing is at the first scan line."],
        ProbeMarker::Last => ["Last", "The marker on the probe's housing is at the last scan line."],
        ProbeMarker::Hidden => ["Hidden", "No dot is drawn."],
    }
}
