//! Labels that the user edits.

use crate::segment::bodies::Body;
use crate::segment::volume::Measured;

pub(crate) const LABELS: &str = "Labels";
text!(label(number) = "Label {number}");
pub(crate) const PAINT: [&str; 2] =
    ["Paint", "Drag over a plane or over the surface: the label is painted. Ctrl erases."];
pub(crate) const ERASE: [&str; 2] =
    ["Erase", "Drag over a plane or over the surface: the chosen label is erased, others stay."];
pub(crate) const GROW_DARK: [&str; 2] =
    ["Grow dark", "Click in a body that is darker than what is around it, such as a cyst: all of it gets the label."];
pub(crate) const GROW_BRIGHT: [&str; 2] =
    ["Grow bright", "Click in a body that is brighter than what is around it: all of it gets the label."];
pub(crate) const SPHERE_BRUSH: &str = "Sphere brush";
pub(crate) const SPHERE_BRUSH_HINT: &str =
    "On: a ball also on planes. Off: a disc that is one voxel thick, in the plane alone. On the surface it is a ball.";
pub(crate) const CHOOSE_LABEL_HINT: &str =
    "Click: this label is painted. Its volume is that of its voxels; growing also says what the echoes measure.";
pub(crate) const ADD_LABEL: [&str; 2] = ["Add a label", "The new label is then painted."];
text!(label_measured(number) = "Label volume {number}");
pub(crate) const LABEL_MEASURED_HINT: &str =
    "The body between the contours of this measurement gets the label. Beyond the outermost contours it is closed.";
pub(crate) const FILLING: &str = "Filling the body between the contours";
pub(crate) const WHY_NOTHING_TO_FILL: &str = "the contours lie beside the labels";
pub(crate) fn filled(number: usize, cm3: f64) -> String {
    format!("Volume {number} is labelled: {} in voxels", volume_of_label(cm3))
}
pub(crate) const NO_LABELS_YET: &str = "The labels are being prepared: wait a moment";
pub(crate) const TOO_MANY_LABELS: &str = "There are 255 labels, which is as many as a voxel can tell apart.";
pub(crate) const LABELS_NEED_SURFACE: &str =
    "Labels need planes or a surface: choose planes, or the mode Surface or Mixed";
pub(crate) const GROWING: &str = "Growing from the place of the click";
pub(crate) const STILL_AT_WORK: &str =
    "Labels are still being prepared, or a body is being searched for: wait a moment";
pub(crate) const WHY_NO_LABELS: &str = "nothing is labelled with the tool Labels (Shift+L)";
pub(crate) const WHY_THREAD_ENDED: &str = "the search ended early";
text!(no_labels(why) = "Labels cannot be edited: {why}");
text!(too_many_voxels(most) = "their lattice has more than {most} voxels");
text!(not_grown(why) = "Nothing is labelled: {why}");
text!(volume_of_label(volume) = "{volume:.2} cm\u{b3}");
pub(crate) fn grown(body: &Body) -> String {
    let cm3 = |mm3: f64| mm3 / 1000.0;
    let by_echoes = match body.measured {
        Ok(Measured { volume, low, high }) => {
            let volume = volume_of_label(cm3(volume));
            format!("{volume} by the echoes (95 %: {:.2} to {:.2})", cm3(low), cm3(high))
        }
        Err(why) => format!("not measured by the echoes: {why}"),
    };
    let cut = if body.is_cut { "; it reaches the border, so that a part may be missing" } else { "" };
    format!("Grown: {by_echoes}; {} in voxels{cut}", volume_of_label(cm3(body.labelled)))
}
