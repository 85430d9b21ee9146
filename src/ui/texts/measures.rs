//! Texts about measuring: tools, steps and reasons why something cannot be measured.

// Tools, results and steps.
pub(crate) const CALIPER: &str = "Caliper";
pub(crate) const ANGLE: &str = "Angle";
pub(crate) const ELLIPSE: &str = "Ellipse";
pub const TRACE: &str = "Trace";
pub(crate) const TAPE: &str = "Tape";
pub(crate) const CONTOURS: &str = "Contours";
pub(crate) const AUTOMATIC_VOLUME: &str = "Automatic volume";
pub const TEXT: &str = "Text";
pub(crate) const ARROW: &str = "Arrow";
pub(crate) const MEASUREMENTS: &str = "Measurements";
pub(crate) const END_VOLUME: &str = "End volume";
pub(crate) const CLOSE_CONTOUR: &str = "Close contour";
pub(crate) const END_TRACING_HINT: &str = "Ends what is being traced (Enter).";
pub(crate) const TYPE_TEXT_HINT: &str = "Click to type a text for it.";
pub(crate) const DELETE_MEASUREMENT_HINT: &str = "Deletes it (undo brings it back).";
text!(delete_measurement(number) = "Delete measurement {number}");
pub const COPY: [&str; 2] = ["Copy", "Copies all results as CSV (Ctrl+C)."];
pub(crate) const SAVE_RESULTS_HINT: &str = "Saves all results as a CSV file.";
pub const CLEAR: [&str; 2] = ["Clear", "Deletes all (undo brings them back)."];
pub(crate) const STEP_TYPE: &str = "Type, then Enter.";

// Limits.
pub(crate) const TOO_MANY_MEASUREMENTS: &str = "There are as many measurements as a scene can have: delete one first.";
pub(crate) const CONTOUR_LIMITS: &str = "A contour needs three points or more; a volume has at most 64.";

// What stands in the way, and counting voxels.
pub(crate) const OUTLINE_NEEDS_PLANE: &str =
    "Outlines are traced on a plane: choose Plane, 3 planes, 3D + planes or 4-up";
pub(crate) const POINT_NEEDS_SURFACE: &str = "Points on a rendering need its surface: choose the mode Surface or Mixed";
pub(crate) const NO_PICTURE_TO_USE: &str = "There is no picture yet";
pub(crate) const NO_SURFACE_HERE: &str = "There is no surface at this place";
pub(crate) const FIRST_END_BEHIND_CAMERA: &str = "The first end is behind the camera: turn the view back";
pub(crate) const MEASURING_BODY: &str = "Measuring the largest bright body in the region";
text!(no_body_measured(why) = "No body is measured: {why}");
pub(crate) const BODY_IS_CUT: &str =
    "The measured body reaches the border of the region or of the echoes: a part of it may be missing";
pub(crate) const NO_VOLUME_YET: &str = "There is no volume yet";
pub(crate) const NO_VOLUME_IN_LOOP: &str = "No volume is in the cine loop: --cine keeps some";
pub(crate) const NO_MEASUREMENTS_YET: &str = "There are no measurements yet";
pub(crate) const RESULTS_COPIED: &str = "The results are copied as CSV";
text!(no_clipboard(fault) = "There is no clipboard ({fault}): the results are saved instead");
pub(crate) const WHY_NO_MEASUREMENTS: &str = "there are no measurements yet";
text!(results_not_saved(fault) = "The results were not saved: {fault}");
pub(crate) const WHY_NO_ORIGIN: &str = "this view has none";
pub(crate) const VOLUMES_ARE_LIVE: &str = "The volumes are live and in no file: save the loop too (Ctrl+R)";
text!(workspace_not_saved(fault) = "The workspace was not saved: {fault}");

// Body marks.
pub(crate) const BODY_MARK: &str = "Body mark";
text!(body_mark(number) = "Body mark {number}");
pub(crate) const TOO_MANY_BODY_MARKS: &str = "There are as many body marks as a picture can have: remove one first.";
pub(crate) const BODY_MARK_FIRST_STEP: &str = "Choose a part of the body.";
pub(crate) const BODY_MARK_STEP: &str =
    "Click or drag the probe on it; the wheel turns it. Drag the body to move the mark.";
pub const MIRRORED: [&str; 2] =
    ["Mirrored", "Exchanges left and right: the left breast, the back of the fetus on the other side."];
pub(crate) const TURN_OF_PROBE: &str = "Probe's direction";
pub(crate) const TURN_OF_PROBE_HINT: &str =
    "Where the marker of the probe points: 0° to the head, -90° to the right side of the patient.";
pub(crate) const PROBE_ACROSS: &str = "Probe across";
pub(crate) const PROBE_DOWN: &str = "Probe down";
pub(crate) const PROBE_ON_BODY_HINT: &str = "Where on the body the probe is, from its middle.";
pub(crate) const SIZE_OF_MARK: [&str; 2] = ["Size", "How large the mark is, of the picture's shorter edge."];
pub(crate) const MARK_ACROSS: &str = "Mark across";
pub(crate) const MARK_DOWN: &str = "Mark down";
pub(crate) const PLACE_OF_MARK_HINT: &str = "Where on the picture the mark is.";
pub(crate) const SELECT_BODY_MARK_HINT: &str = "The controls are about this one.";
pub(crate) const ADD_BODY_MARK: [&str; 2] =
    ["Add body mark", "One more mark, in another corner of the picture. At most four."];
pub(crate) const REMOVE_BODY_MARK: [&str; 2] = ["Remove body mark", "Removes this one (undo brings it back)."];

// On the curved plane.
pub(crate) const CURVE_NEEDS_BOTH_ENDS: &str = "A distance on the curved plane needs both of its ends there.";
pub(crate) const CURVE_MEASURES: &str =
    "On the curved plane distances are measured (Caliper), and texts and arrows set; the rest on A, B or C.";
