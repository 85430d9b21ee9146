//! The comparison of two volumes.

pub(crate) const COMPARISON: &str = "Comparison";
pub(crate) const COMPARED_TILES: [&str; 2] = ["Tiles", "All pictures beside each other."];
pub(crate) const COMPARED_DIFFERENCE: [&str; 2] = [
    "Difference",
    "Also their difference in brightness: orange where A is brighter, blue where B is, in levels of 255.",
];
pub(crate) const COMPARED_WIPE: [&str; 2] = ["Wipe", "One picture over the other: drag the line between them."];
pub(crate) const WIPE_LINE: &str = "Line of the wipe";
pub(crate) const WIPE_LINE_HINT: &str = "Drag: A is on its left, B on its right.";
/// Stands before the names of the links.
pub(crate) const LINKED: &str = "Linked:";
pub(crate) const LINK_VIEW: [&str; 2] = ["View", "B is seen from where A is, with its region."];
pub(crate) const LINK_PLANES: [&str; 2] = ["Planes", "The planes of B are those of A."];
pub(crate) const LINK_LOOK: [&str; 2] =
    ["Look", "B has the windows, filters and light of A. Off: B keeps what it has, to compare two settings."];
pub(crate) const LINK_VOLUME: [&str; 2] = ["Loop", "B shows the volume at the same position in its loop as A."];
pub(crate) const ALIGN: &str = "Align";
pub(crate) const ALIGN_HINT: &str = "Moves B rigidly onto A, by least squares of the echoes; again: leaves it where it is. A drag over B moves it by hand, with Shift or the right button it turns.";
pub(crate) const ALIGNING: &str = "Aligning";
pub(crate) const ADD_COMPARED: [&str; 2] = ["Add", "The next open recording beside the others: up to four tiles."];
pub(crate) const WHY_NO_FURTHER: &str = "no further recording is open";
text!(why_no_more_tiles(most) = "there are {most} tiles, which is as many as there can be");
pub(crate) fn moved_by([shift, angle]: [f64; 2]) -> String {
    format!(" \u{b7} moved {shift:.1} mm, {angle:.1}°")
}
pub(crate) const END_COMPARISON: [&str; 2] = ["End the comparison", "Shows A alone (P)."];
pub(crate) const NOT_DRAWN_YET: &str = "Not drawn yet";
pub(crate) const WHY_NOTHING_TO_COMPARE: &str = "there is no whole volume yet";
text!(compared_as_it_was(name) = "{name}, as it was");
text!(not_compared(fault) = "Not compared: {fault}");
pub(crate) fn aligned([shift, angle]: [f64; 2], correlation: f64) -> String {
    format!("Aligned: B is moved by {shift:.1} mm and turned by {angle:.1}°; correlation {correlation:.2}")
}
text!(
    hardly_aligned(correlation) =
        "Aligned, but the volumes are hardly alike (correlation {correlation:.2}): look whether B lies on A"
);
