//! Texts about the patient's sides and the probe's marker.

use crate::scene::{ProbeMarker, Sides, VolumeAxis};

pub const SIDES: &str = "Sides";
pub(crate) const SIDES_HINT: &str =
    "The patient's sides as letters on every tile and in saved pictures, and the probe's marker.";
text!(sides_in_short(sides) = "Sides: {sides}");
pub(crate) const EXCHANGE_LEFT_AND_RIGHT: &str = "Exchange L and R";
pub(crate) const EXCHANGE_LEFT_AND_RIGHT_HINT: &str =
    "Left and right the other way round, as when the probe is turned. Nothing else changes.";
pub(crate) const NO_SIDES_SHORT: &str = "-";

/// The heading of an axis.
pub fn axis(axis: VolumeAxis) -> &'static str {
    match axis {
        VolumeAxis::Lateral => "Scan lines, first to last",
        VolumeAxis::Elevation => "Slices, first to last",
        VolumeAxis::Depth => "From the probe down",
    }
}

/// Sides in words, as they are read aloud.
pub fn sides(sides: Sides) -> &'static str {
    match sides {
        Sides::None => "no letters",
        Sides::LeftRight => "left to right",
        Sides::RightLeft => "right to left",
        Sides::HeadFeet => "head to feet",
        Sides::FeetHead => "feet to head",
        Sides::FrontBack => "front to back",
        Sides::BackFront => "back to front",
    }
}

/// The tooltip for sides along an axis.
pub(crate) fn sides_hint(axis: VolumeAxis, sides: Sides) -> String {
    let (first, last) = match sides {
        Sides::None => return "Not known: no letters.".into(),
        Sides::LeftRight => ("left", "right"),
        Sides::RightLeft => ("right", "left"),
        Sides::HeadFeet => ("head", "feet"),
        Sides::FeetHead => ("feet", "head"),
        Sides::FrontBack => ("front (A)", "back (P)"),
        Sides::BackFront => ("back (P)", "front (A)"),
    };
    match axis {
        VolumeAxis::Lateral => format!("The patient's {first} is at the first scan line, the {last} at the last."),
        VolumeAxis::Elevation => format!("The patient's {first} is at the first slice, the {last} at the last."),
        VolumeAxis::Depth => format!("The patient's {first} is at the probe, the {last} is deep."),
    }
}

pub(crate) const PROBE_MARKER: &str = "Probe marker (dot)";

/// The position of the marker, in short.
pub(crate) fn probe_marker(marker: ProbeMarker) -> &'static str {
    match marker {
        ProbeMarker::First => "First",
        ProbeMarker::Last => "Last",
        ProbeMarker::Hidden => "Hidden",
    }
}

/// What the position of the marker means.
pub(crate) fn probe_marker_hint(marker: ProbeMarker) -> &'static str {
    match marker {
        ProbeMarker::First => "The marker on the probe's housing is at the first scan line.",
        ProbeMarker::Last => "The marker on the probe's housing is at the last scan line.",
        ProbeMarker::Hidden => "No dot is drawn.",
    }
}
