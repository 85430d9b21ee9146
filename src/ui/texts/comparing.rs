//! The comparison of two volumes.

pub(crate) const COMPARISON: &str = "Comparison";
pub(crate) const COMPARED_TILES: &str = "Tiles";
pub(crate) const COMPARED_TILES_HINT: &str = "All pictures beside each other.";
pub(crate) const COMPARED_DIFFERENCE: &str = "Difference";
pub(crate) const COMPARED_DIFFERENCE_HINT: &str =
    "Also their difference in brightness: orange where A is brighter, blue where B is, in levels of 255.";
pub(crate) const COMPARED_WIPE: &str = "Wipe";
pub(crate) const COMPARED_WIPE_HINT: &str = "One picture over the other: drag the line between them.";
pub(crate) const WIPE_LINE: &str = "Line of the wipe";
pub(crate) const WIPE_LINE_HINT: &str = "Drag: A is on its left, B on its right.";
/// Stands before the names of the links.
pub(crate) const LINKED: &str = "Linked:";
pub(crate) const LINK_VIEW: &str = "View";
pub(crate) const LINK_VIEW_HINT: &str = "B is seen from where A is, with its region.";
pub(crate) const LINK_PLANES: &str = "Planes";
pub(crate) const LINK_PLANES_HINT: &str = "The planes of B are those of A.";
pub(crate) const LINK_LOOK: &str = "Look";
pub(crate) const LINK_LOOK_HINT: &str =
    "B has the windows, filters and light of A. Off: B keeps what it has, to compare two settings.";
pub(crate) const LINK_VOLUME: &str = "Loop";
pub(crate) const LINK_VOLUME_HINT: &str = "B shows the volume at the same position in its loop as A.";
pub(crate) const ALIGN: &str = "Align";
pub(crate) const ALIGN_HINT: &str = "Moves B rigidly onto A, by least squares of the echoes; again: leaves it where it is. A drag over B moves it by hand, with Shift or the right button it turns.";
pub(crate) const ALIGNING: &str = "Aligning";
pub(crate) const ADD_COMPARED: &str = "Add";
pub(crate) const ADD_COMPARED_HINT: &str = "The next open recording beside the others: up to four tiles.";
pub(crate) const WHY_NO_FURTHER: &str = "no further recording is open";
text!(why_no_more_tiles(most) = "there are {most} tiles, which is as many as there can be");
pub(crate) fn moved_by([shift, angle]: [f64; 2]) -> String {
    format!(" \u{b7} moved {shift:.1} mm, {angle:.1}°")
}
pub(crate) const END_COMPARISON: &str = "End the comparison";
pub(crate) const END_COMPARISON_HINT: &str = "Shows A alone (P).";
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
