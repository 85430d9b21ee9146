//! Buttons, titles and tooltips of the panels and lists, the help and the times.

use std::fmt::Display;
use std::time::Duration;

// Modes, tools and controls.
pub const TURN: &str = "Turn";
pub const LIGHT: &str = "Light";
pub const REGION: &str = "Region";
pub(crate) const CLIP: &str = "Clip";
pub(crate) const CUT: &str = "Cut";
pub const BRUSH: &str = "Brush";
pub const PLANES: &str = "Planes";
pub(crate) const CROSSHAIR: &str = "Crosshair";
pub(crate) const LAMP: &str = "Lamp";
pub(crate) const LIGHTING: &str = "Lighting";
pub(crate) const CURVE: &str = "Curve";
pub const THRESHOLD: &str = "Threshold";
pub const GAIN: &str = "Gain";
pub const SMOOTH: &str = "Smooth";
pub const BRIGHTNESS: &str = "Brightness";
pub const DEPTH: &str = "Depth";
pub(crate) const PRESETS_HINT: &str =
    "The looks of an examination, with small pictures of this volume, and your own. (Ctrl+P)";
pub const PRESETS: &str = "Presets";
pub(crate) const LAYOUT_BESIDE: &str = "3D + planes";
pub(crate) const LAYOUT_BESIDE_SHORT: &str = "3D+";
pub(crate) const LAYOUT_FOUR: &str = "4-up";
pub(crate) const LAYOUT_PAIR: &str = "VR | SR";
pub(crate) const LAYOUT_PAIR_SHORT: &str = "VR|SR";
pub(crate) const PROGRAM: &str = "Echolume";
pub(crate) const TOP_BAR: &str = "Files, views and search";
pub(crate) const TOOLS: &str = "Tools";
pub(crate) const INSPECTOR: &str = "Inspector";
pub(crate) const TAB_LOOK: [&str; 2] =
    ["Look", "Looks, modes, threshold, gain, light, colours, and all other controls of the rendering (Shift+F3)."];
pub(crate) const TAB_PLANES_HINT: &str =
    "The planes: which one moves, where they cross, slices, and their look (Shift+F3).";
pub(crate) const TAB_MEASURE_HINT: &str = "Tools that measure, and their results (Shift+F3).";
pub(crate) const TAB_MARKS: [&str; 2] =
    ["Marks", "Texts, arrows, body marks, the patient's sides and the probe's marker (Shift+F3)."];
pub(crate) const DRAWER_HINT: &str = "Opens all controls over the picture, or closes them (Shift+F3).";
pub(crate) const DISTANCE: &str = "Distance";
pub(crate) const AREA: &str = "Area";
pub(crate) const MEASURED_VOLUME: &str = "Contours";
pub(crate) const BODY: &str = "Body";
pub(crate) const VIEW: &str = "View";
pub(crate) const VIEW_3D: [&str; 2] = ["3D", "The rendering alone (Shift+Tab: one picture)."];
pub(crate) const RENDERING: &str = "Rendering";
pub(crate) const RENDER_START: &str = "Where rendering starts";
pub(crate) const NO_PLANES: &str = "3D + planes, 4-up, 3 planes, Plane and Slices show planes.";
pub(crate) const NO_MEASUREMENTS: &str = "Nothing is measured yet.";
pub(crate) const QUICK_LOOKS: &str = "Quick looks";
pub(crate) const MANAGE_LOOKS: &str = "Manage";
pub(crate) const MORE: &str = "...";
pub(crate) const NEXT_RECORDING: &str = "Next recording";
pub(crate) const NEXT_RECORDING_HINT: &str = "Shows the next of the recordings that are open (Ctrl+Page down).";
pub(crate) const SAVE_WORKSPACE: [&str; 2] =
    ["Save workspace", "Saves settings, recording and measurements together (Ctrl+S)."];
pub(crate) const TYPE_VALUE_HINT: &str = "A click types the value; Enter sets it, Esc leaves it.";
text!(value_of(name) = "Value of {name}");
pub(crate) const LIVE: &str = "LIVE";
pub(crate) const WAITING: &str = "WAITING";
pub(crate) const NEWEST: &str = "NEWEST";
pub(crate) const HAS_ENDED_BUTTON: &str = "ENDED";
pub(crate) const TO_FREEZE: &str = "Space: freeze";
pub(crate) const GO_LIVE: &str = "Space: go live";
text!(seconds(seconds) = "{seconds:.1} s");
text!(played_part(first, last) = "loop {first} to {last}");

/// States of the picture, in short.
pub(crate) const STATE_FROZEN: &str = "Frozen";
pub(crate) const STATE_LIVE: &str = "Live";
pub(crate) const STATE_DRAWING: &str = "drawing ...";
pub(crate) const IS_DRAWN: &str = "The next picture is being drawn. ";
pub(crate) const STATE_PLAYING: &str = "Playing";
text!(volume_in_loop(number, count) = "volume {number} of {count}");

// The search.
pub(crate) const FIND: &str = "Find a command";
pub(crate) const FIND_HINT: &str = "Finds every command and control by its name (/ or Ctrl+K).";
pub(crate) const HOW_TO_FIND: &str = "Type a word: measure, threshold, export ...";
pub(crate) const FOUND: &str = "Found";
pub(crate) const CLOSE_SEARCH_HINT: &str = "Closes the search (Esc).";
text!(look(name) = "Look: {name}");
text!(export_as(name) = "Export: {name}");
text!(control_in(group, hint) = "{group}: {hint}");

pub(crate) const VIEW_FROM: &str = "View from";
pub(crate) const PLANE_HINT: &str = "The plane that is shown and moved.";
pub(crate) const PLANE: &str = "Plane";
pub(crate) const RECENTRE_PLANES_HINT: &str =
    "Moves the point where the planes cross to the middle (J; double click with Crosshair).";
pub(crate) const RECENTRE_PLANES: &str = "Recentre planes";
pub(crate) const MEASURE: &str = "Measure";
pub(crate) const OPEN: [&str; 2] = ["Open", "Opens a recording or a workspace (Ctrl+O), or drop a file on the window."];
pub(crate) const SAVE: &str = "Save";
pub(crate) const RECORDINGS: &str = "Recordings";
text!(recording_hint(path) = "{path}: shows it as it was left (Ctrl+Page up, Ctrl+Page down).");
text!(close_recording(name) = "Close {name}");
pub(crate) const CLOSE_RECORDING_HINT: &str = "Takes it from the list; its file stays, its settings and measurements are forgotten (Ctrl+W: the one that is shown).";
pub(crate) const EXPORT: [&str; 2] =
    ["Export", "Exports the volume that is shown: as a volume, a surface to print, or a turntable (Ctrl+E)."];
pub const CUTS: &str = "Cuts";
pub(crate) const KEEP_INSIDE: [&str; 2] =
    ["Keep inside", "The next contour takes away what is outside of it, not what is within."];
pub(crate) const REMOVE_ALL_CUTS: [&str; 2] =
    ["Remove all cuts", "Renderings show everything again (Shift+F; undo brings the cuts back)."];
text!(millimetres(length) = "{length:.1} mm");
text!(bar_length(length) = "{length} mm");
text!(whole_millimetres(length) = "{length:.0} mm");
pub(crate) const RADIUS_OF_BRUSH: [&str; 2] =
    ["Radius of brush", "How far from the surface under the pointer the brush removes."];
pub(crate) const UNDO: [&str; 2] = ["Undo", "Takes the last change back (Ctrl+Z)."];
pub(crate) const REDO: [&str; 2] = ["Redo", "Does it again (Ctrl+Y)."];
pub const GREY: &str = "Grey";
pub(crate) const SEPIA: &str = "Sepia";
pub const SKIN: &str = "Skin";
pub const BONE: &str = "Bone";
pub(crate) const COOL: &str = "Cool";
pub(crate) const WARM: &str = "Warm";
pub(crate) const AS_IS: &str = "As is";
pub(crate) const ICE: &str = "Ice";
pub(crate) const CONTROLS: &str = "Controls";
pub(crate) const TAB_TOOLS: [&str; 2] = ["Tools", "All tools and views (Shift+F3)."];
pub(crate) const COLOUR_HINT: &str = "Colours of the tissue; they stand for no flow.";
pub const COLOUR: &str = "Colour";
pub(crate) const OPACITY_OF: &str = "Opacity of";
pub(crate) const OPACITY_OF_HINT: &str = "Whose opacities the volume has, whatever its colours.";
pub(crate) const SAME_AS_COLOUR: &str = "Own";
pub(crate) const CAST_SHADOWS: [&str; 2] = ["Cast shadows", "The lamp casts shadows on the surface."];
pub(crate) const REFERENCE_PICTURE: [&str; 2] =
    ["Reference picture", "The first tile shows the plane across the slices, and where each of them is."];
pub(crate) const BAR_ON_SAVED_PICTURES: [&str; 2] =
    ["Bar on saved pictures", "Saved pictures carry the patient's sides, and a bar with scale, depth, mode and time."];
pub(crate) const ADVANCED: &str = "Advanced";
text!(advanced_group(name) = "Advanced: {name}");
text!(advanced_hint(name) = "More controls: {name}. A click opens or closes the group.");
pub(crate) const NO_SUCH_CONTROL: &str = "This mode has no such control.";
pub(crate) const AUTOMATIC: &str = "auto";
pub(crate) const THROUGH_ALL: &str = "through all";
text!(slider_hint(hint) = "{hint} Double click: as at the start.");
pub(crate) const LIGHT_BALL_HINT: &str = "Drag here to move the lamp; on the picture, drag with Ctrl.";
pub(crate) const LIGHT_BALL: &str = "Light ball";
/// The position of the light, as degrees from the front.
pub(crate) fn lamp_place(right: f64, up: f64) -> String {
    let side = if right < 0.0 { "left" } else { "right" };
    let height = if up < 0.0 { "below" } else { "above" };
    format!("from {}° {side}, {}° {height}", right.abs(), up.abs())
}
pub(crate) const CINE_LOOP: &str = "Cine loop";
pub const FROZEN: &str = "FROZEN";
pub(crate) const FREEZE: &str = "Freeze";
pub(crate) const FREEZE_HINT: &str = "Keeps this volume on the screen (Space).";
pub(crate) const UNFREEZE: &str = "Unfreeze";
const ENDED: &str = "Ended";
pub(crate) const ENDED_HINT: &str = "The source has ended: no more frames come, and the loop is what came.";
pub(crate) fn ended_for(ago: Duration) -> String {
    match ago.as_secs() {
        seconds @ 0..60 => format!("{ENDED} {seconds} s"),
        seconds @ 60..3600 => format!("{ENDED} {} min", seconds / 60),
        seconds => format!("{ENDED} {} h", seconds / 3600),
    }
}
pub(crate) const SAVE_PICTURE: [&str; 2] = ["Save picture", "Saves the picture (Ctrl+I)."];
pub(crate) const SAVE_LOOP: [&str; 2] = ["Save loop", "Saves the last volumes as a recording (Ctrl+R)."];
pub(crate) const RESET: &str = "Reset";
pub(crate) const RESET_HINT: &str = "All settings as at the start (Backspace).";
pub(crate) const FULL_SCREEN: [&str; 2] = ["Full screen", "Fills the screen, or leaves it (F11)."];
pub const TIMES: [&str; 2] = ["Times", "Times of pictures and frames (F2)."];
pub const HELP: [&str; 2] = ["Help", "All keys and gestures (H)."];
pub(crate) const NO_VOLUMES_YET: &str = "no volumes yet";
pub const STOP: &str = "Stop";
pub(crate) const PLAY: &str = "Play";
pub(crate) const PLAY_HINT: &str = "Plays the last volumes as a loop (Enter).";
pub(crate) const PREVIOUS_VOLUME: [&str; 2] = ["Previous volume", "Shows the previous volume (Left)."];
pub(crate) const NEXT_VOLUME: [&str; 2] = ["Next volume", "Shows the next volume (Right)."];
pub(crate) const SPEED_HINT: &str = "Speed of the loop; 1x is that of the acquisition (Ctrl+Left, Ctrl+Right).";
text!(speed(speed) = "Speed {speed}");
pub(crate) const BACK_AND_FORTH: [&str; 2] =
    ["Back and forth", "The loop plays back and forth. A click: forwards (Ctrl+Enter)."];
pub(crate) const FORWARDS: [&str; 2] = ["Forwards", "The loop plays forwards. A click: back and forth (Shift+Enter)."];
pub(crate) const VOLUME_OF_THE_LOOP_HINT: &str = "The volumes of the loop, oldest first. Drag its ends to play a part of it; a double click plays all (Shift+Home, Shift+End, Ctrl+Home).";
pub(crate) const VOLUME_OF_THE_LOOP: &str = "Volume of the loop";
text!(place_in_loop(place, count) = "{place} of {count}");

// Lists of files and formats.
text!(open_file_hint(name) = "Opens {name}.");
text!(open_folder_hint(name) = "Lists the folder {name}");
pub(crate) const FOLDER_ABOVE_HINT: &str = "Lists the folder above.";
pub(crate) const RECENT: &str = "Recent";
pub(crate) const PATH: &str = "Path";
pub(crate) const HOW_TO_BEGIN_A_PATH: &str = "/ or ~ begins to type a path";
pub(crate) const HOW_TO_TYPE_A_PATH: &str = "Tab completes the path, Enter opens it, Esc takes it back";
pub(crate) const CLOSE_OPEN_HINT: &str = "Closes this list.";
pub(crate) const NO_RECORDING_HERE: &str = "There is no recording and no workspace here.";
pub(crate) const VOLUME_SHOWN: &str = "The volume that is shown";
text!(is_being_exported(name) = "{name} is being exported");
/// How much of it is done, rounded down: 100 % is said of what is complete.
fn per_cent(done: u64, of: u64) -> String {
    format!("{} %", 100 * done.min(of) / of.max(1))
}
pub(crate) fn is_exported_so_far(name: impl Display, done: u64, of: u64) -> String {
    format!("{name} is being exported: {}", per_cent(done, of))
}
pub(crate) fn export_so_far(name: impl Display, done: u64, of: u64) -> String {
    format!("{name}: {} (cancel: Ctrl+E)", per_cent(done, of))
}
pub(crate) const CLOSE_EXPORT_HINT: &str = "Closes this list.";
pub(crate) const CANCEL_EXPORT: [&str; 2] =
    ["Cancel the export", "Cancels the export that is running; no file of it is kept."];
pub(crate) const CLOSE_BUTTON: &str = "Close  (Esc)";
pub(crate) const CLOSE: &str = "Close";

// The list of presets.
pub const LOOKS: &str = "Looks";
pub(crate) const NEW_NAME: &str = "New name";
pub const NAME: &str = "Name";
pub(crate) const KEEP_PRESET_HINT: &str =
    "Keeps the look under this name: mode, filters, colours and light, without region and view.";
pub(crate) const KEEP_BUTTON: &str = "Keep  (Enter)";
pub(crate) const KEEP: &str = "Keep";
pub(crate) const CANCEL_BUTTON: &str = "Cancel  (Esc)";
pub(crate) const CANCEL_NAMING_HINT: &str = "Goes back without a new name.";
pub(crate) const CANCEL: &str = "Cancel";
pub(crate) const SAVE_PRESENT_LOOK_HINT: &str =
    "Keeps the present look under a name: mode, filters, colours and light, without region and view.";
pub(crate) const SAVE_PRESENT_LOOK_BUTTON: &str = "Save present look  (S)";
pub(crate) const SAVE_PRESENT_LOOK: &str = "Save present look";
pub(crate) const UNDO_PRESETS_HINT: &str = "Brings your presets back as they were before the last change.";
pub(crate) const UNDO_PRESETS_BUTTON: &str = "Undo  (Z)";
pub(crate) const CLOSE_PRESETS_HINT: &str = "Closes this list.";
pub(crate) const RENAME: [&str; 2] = ["Rename", "Gives this preset another name."];
pub(crate) const DELETE: &str = "Delete";
pub(crate) const DELETE_PRESET_HINT: &str = "Deletes this preset; Undo above brings it back.";

// What a screen reader says of the picture.
pub(crate) const VIEW_FRONT: &str = "Front";
pub(crate) const VIEW_LEFT: &str = "Left";
pub(crate) const VIEW_RIGHT: &str = "Right";
pub(crate) const VIEW_TOP: &str = "Top";
pub(crate) const NO_PICTURE_YET: &str = "No picture yet";
pub(crate) const WITH_THREE_PLANES: &str = " with three planes";
pub(crate) const BESIDE_THE_VOLUME: &str = " beside the volume";
pub(crate) const IS_FROZEN: &str = "frozen";
pub(crate) const IS_LIVE: &str = "live";
text!(behind(time) = "{time} behind");
pub(crate) const HAS_ENDED: &str = "the source has ended";
text!(volume_of_loop(number, count) = "Volume {number} of {count}. ");
pub(crate) fn count_of_measurements(count: usize) -> String {
    format!("{count} measurement{}.", if count == 1 { "" } else { "s" })
}
text!(with_curved_plane(plane) = ", with the section along a line on plane {plane}");
text!(of_plane(plane) = ", plane {plane}");
text!(seen_from(side) = " from the {side}");
text!(turned_to(azimuth, elevation) = ", turned to azimuth {azimuth:.0}° and elevation {elevation:.0}°");

// Times, gestures, the help, and the question before the end.
text!(milliseconds(ms) = "{ms:.1} ms");
text!(picture_time(time) = "picture {time}");
pub(crate) const NO_BUDGET: &str = "no budget";
text!(budget(ms) = "budget {ms:.0} ms");
text!(picture_times(p50, p95, budget) = "p50 {p50}  p95 {p95}  {budget}");
text!(rates(volumes, frames, pictures) = "{volumes:.2} volumes/s   {frames:.0} frames/s   {pictures:.1} pictures/s");
text!(acquisition(ms, share) = "acquisition: {ms:.0} ms a volume; {share:.0} % of that rate");
text!(frame_to_picture(p95) = "frame to picture p95 {p95}");
text!(input_to_picture(p50, p95) = "input to picture p50 {p50}  p95 {p95}");
text!(presentation_to_monitor(p50, p95) = "presentation to monitor p50 {p50}  p95 {p95}");
text!(losses(dropped, lost) = "{dropped} volumes dropped, {lost} frames lost");
pub(crate) const NO_TIMES: &str = "no times: the device has no time stamps, or no pass ran";
text!(more_passes(more) = "{more} more");
pub(crate) const TIMES_LEGEND: &str = "ms per run; bars: share of the device time";
/// Gestures on the picture, and what they do, in the help.
pub(crate) const GESTURES_OF_HELP: [(&str, &str); 17] = [
    ("drag", "use the tool: turn, light, region, clip, cut, brush, crosshair, curve"),
    ("Shift + drag, right or middle drag", "move the picture; over a plane: step it"),
    ("Ctrl + drag", "move the light"),
    ("wheel", "zoom; over a plane: step it"),
    ("two fingers", "pinch to zoom, twist to roll, move to pan"),
    ("double click on a tile", "show that tile alone, and back"),
    ("Region, then drag", "move the nearest face of the box"),
    ("Region, then double click the green line (3D + planes)", "bend it; add or remove a handle"),
    ("Region, then drag on a plane (3D + planes)", "move a side of the box; from within: all of it"),
    ("drag on the light ball (beside Lamp)", "move the lamp"),
    ("Clip, then drag up", "cut away what is nearer to the viewer"),
    ("Cut, then drag round", "cut away what is within, along the view"),
    ("Brush, then drag over it", "remove what is near the surface there"),
    ("Crosshair, then click", "move the point where the three planes cross"),
    ("Curve, then clicks on a plane, Enter", "curved plane along them; a drag: a straight line"),
    ("Curve, then drag a point of the line", "move it"),
    ("Body mark, then drag, click or wheel on it", "move it; put the probe there; turn the probe"),
];
pub(crate) const QUIT: &str = "quit";
pub const KEYS: &str = "Keys";
pub(crate) const GESTURES: &str = "Gestures";
pub(crate) const KEYS_AND_GESTURES: &str = "Keys and gestures";
pub(crate) const NOTHING_FOUND: &str = "Nothing is found.";
pub(crate) const NO_MEDICAL_DEVICE: &str = "Echolume is not a medical device.";
pub(crate) const SAVE_AND_LEAVE: &str = "Save and leave  (Enter)";
pub(crate) const LEAVE_WITHOUT_SAVING: &str = "Leave without saving  (L)";
pub(crate) const STAY: [&str; 2] = ["Stay  (Esc)", "Goes on as before."];

/// The question before leaving: what is not saved, and the answers.
#[derive(Debug)]
pub(crate) struct Unsaved {
    pub(crate) title: &'static str,
    pub(crate) about: &'static str,
    pub(crate) save: &'static str,
    pub(crate) discard: &'static str,
}
pub(crate) static UNSAVED_LOOP: Unsaved = Unsaved {
    title: "The loop is not saved",
    about: "Its volumes are lost when the program ends.",
    save: "Saves all volumes of the loop as a recording, then ends the program.",
    discard: "Ends the program; the volumes are lost.",
};
pub(crate) static UNSAVED_WORK: Unsaved = Unsaved {
    title: "Measurements, cuts or labels are not saved",
    about: "They are lost when the program ends.",
    save: "Saves a workspace of each recording that has any, then ends the program.",
    discard: "Ends the program; measurements, cuts and labels are lost.",
};
pub(crate) static UNSAVED_LOOP_AND_WORK: Unsaved = Unsaved {
    title: "The loop and measurements are not saved",
    about: "Volumes, measurements, cuts and labels are lost when the program ends.",
    save: "Saves the loop as a recording and measurements as a workspace, then ends the program.",
    discard: "Ends the program; volumes, measurements, cuts and labels are lost.",
};
pub(crate) const CLOSE_HELP_HINT: &str = "Closes the help (H).";

// Presets of examinations.
pub const FACE: [&str; 2] = ["Face", "Skin in fluid, under light that goes into it."];
pub(crate) const SKELETON: [&str; 2] = ["Skeleton", "What reflects the most shines through thin soft tissue."];
pub(crate) const GLASS: [&str; 2] = ["Glass", "Only the edges of tissue shine: everything can be seen through."];
pub(crate) const VESSELS: [&str; 2] = ["Vessels", "Inverted: fluid is opaque, tissue is clear."];
pub(crate) const BONE_HINT: &str = "A bright surface under soft tissue.";
pub(crate) const B_MODE: [&str; 2] = ["B-mode", "The scan plane in grey."];

pub(crate) const TURNTABLE: &str = "Turntable";
pub(crate) const TURNTABLE_HINT: &str = "The view turns by itself, until you turn it. (Shift+T)";
pub(crate) const NOTHING_TURNS: &str = "The turntable turns renderings: choose Surface, Volume or another of them";
// The curved plane.
pub(crate) const CURVE_ON_ANOTHER_PLANE: &str =
    "The line was begun on another plane: end it there (Enter), or leave it (Esc).";
pub(crate) const CURVE_FULL: &str = "The line has as many points as it can have: end it (Enter).";
pub(crate) const CURVE_NEEDS_POINTS: &str = "A line needs two points or more: click the next one.";
pub(crate) const CURVE_NOT_DRAWN: &str = "This line cannot be drawn: draw another one.";
pub(crate) const CURVED_PLANE: &str = "Curved plane";
pub(crate) const CURVE_STEP_SECOND: &str = "Click the next point of the line.";
pub(crate) const CURVE_STEP_NEXT: &str = "Click the next point; Enter or a double click ends the line.";
pub(crate) const CURVE_STEP_CHANGE: &str = "Drag a point of the line, or draw another line.";
pub(crate) const CURVE_STEP_FIRST: &str = "Click the points of a line on A, B or C, or drag a straight line.";
pub(crate) const END_CURVE: [&str; 2] = ["End the line", "Shows the section along the line (Enter)."];
pub(crate) const REMOVE_CURVE: [&str; 2] =
    ["Remove curved plane", "Shows the planes without it (Shift+Delete; undo brings it back)."];

// The start line.
pub(crate) const START_LINE: &str = "Start line";
pub(crate) const CURVED_LINE: &str = "Curved line";
pub(crate) const CURVED_LINE_HINT: &str = "Bends the line at which rendering starts: drag its green handles on plane A beside the rendering. Off: straight. (Shift+G)";
text!(start_handle(number) = "Handle {number}");
pub(crate) const START_HANDLE_HINT: &str =
    "How deep rendering starts at this handle of the start line, counted from the left.";
pub(crate) const ADD: &str = "Add";
pub(crate) const ADD_HANDLE: [&str; 2] =
    ["Add handle", "One more handle, in the widest gap; or double click the line where it is wanted. At most five."];
pub(crate) const REMOVE: &str = "Remove";
pub(crate) const REMOVE_HANDLE: [&str; 2] =
    ["Remove handle", "One handle less: the one that bends the line the least; or double click one. At least three."];
pub(crate) const START_LINE_FULL: &str = "The start line has five handles, as many as it can have.";
pub(crate) const START_LINE_LEAST: &str =
    "The start line has three handles, as few as it can have: Shift+G makes it straight.";
pub(crate) const NOTHING_STARTS: &str = "The start line is that of a rendering: planes and the cube show everything.";
