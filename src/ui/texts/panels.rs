//! Buttons, titles and tooltips of the panels and lists, the help and the times.

use std::fmt::Display;

// Modes, tools and controls.
pub const TURN: &str = "Turn";
pub const LIGHT: &str = "Light";
pub const REGION: &str = "Region";
pub const CLIP: &str = "Clip";
pub const CUT: &str = "Cut";
pub const BRUSH: &str = "Brush";
pub const PLANES: &str = "Planes";
pub const CURVE: &str = "Curve";
pub const THRESHOLD: &str = "Threshold";
pub const GAIN: &str = "Gain";
pub const SMOOTH: &str = "Smooth";
pub const SMOOTHING: &str = "Smoothing";
pub const BRIGHTNESS: &str = "Brightness";
pub const EXPOSURE: &str = "Exposure";
pub const GAMMA: &str = "Gamma";
pub const DIFFUSE: &str = "Diffuse";
pub const DEPTH: &str = "Depth";
pub const START_DEPTH: &str = "Start depth";
pub const MODES_AND_TOOLS: &str = "Modes and tools";
pub const PRESETS_HINT: &str =
    "The looks of an examination, with small pictures of this volume, and your own. (Ctrl+P)";
pub const PRESETS: &str = "Presets";
pub const MODE: &str = "Mode";
pub const LAYOUT_SINGLE: &str = "Single";
pub const LAYOUT_FOUR: &str = "4-up";
pub const LAYOUT_PAIR: &str = "VR | SR";
pub const LAYOUT: &str = "Layout";
pub const VIEW_FROM: &str = "View from";
pub const DRAG: &str = "Drag";
pub const PLANE_HINT: &str = "The plane that is shown and moved.";
pub const PLANE: &str = "Plane";
pub const RECENTRE_PLANES_HINT: &str =
    "Moves the point where the planes cross to the middle (J; double click with Planes).";
pub const RECENTRE_PLANES: &str = "Recentre planes";
pub const MEASURE: &str = "Measure";
pub const OPEN: &str = "Open";
pub const OPEN_HINT: &str = "Opens a recording or a workspace (Ctrl+O), or drop a file on the window.";
pub const SAVE: &str = "Save";
pub const SAVE_WORKSPACE_HINT: &str = "Saves settings, recording and measurements together (Ctrl+S).";
pub const EXPORT_HINT: &str =
    "Exports the volume that is shown: as a volume, a surface to print, or a turntable (Ctrl+E).";
pub const WORKSPACE: &str = "Workspace";
pub const RECORDINGS: &str = "Recordings";
pub fn recording_hint(path: impl Display) -> String {
    format!("{path}: shows it as it was left (Ctrl+Page up, Ctrl+Page down).")
}
pub fn close_recording(name: impl Display) -> String {
    format!("Close {name}")
}
pub const CLOSE_RECORDING_HINT: &str = "Takes it from the list; its file stays, its settings and measurements are forgotten (Ctrl+W: the one that is shown).";
pub const CLOSE_RECORDING_BUTTON: &str = "x";
pub const EXPORT: &str = "Export";
pub const DEPTH_OF_CUT: &str = "Depth of cut";
pub const CUTS: &str = "Cuts";
pub const KEEP_INSIDE_HINT: &str = "The next contour takes away what is outside of it, not what is within.";
pub const KEEP_INSIDE: &str = "Keep inside";
pub const REMOVE_ALL_CUTS: &str = "Remove all cuts";
pub const REMOVE_ALL_CUTS_HINT: &str = "Renderings show everything again (Shift+F; undo brings the cuts back).";
pub fn millimetres(length: impl Display) -> String {
    format!("{length:.1} mm")
}
pub fn bar_length(length: impl Display) -> String {
    format!("{length} mm")
}
pub fn whole_millimetres(length: impl Display) -> String {
    format!("{length:.0} mm")
}
pub const RADIUS_OF_BRUSH: &str = "Radius of brush";
pub const RADIUS_OF_BRUSH_HINT: &str = "How far from the surface under the pointer the brush removes.";
pub const UNDO: &str = "Undo";
pub const UNDO_HINT: &str = "Takes the last change back (Ctrl+Z).";
pub const REDO: &str = "Redo";
pub const REDO_HINT: &str = "Does it again (Ctrl+Y).";
pub const GREY: &str = "Grey";
pub const SEPIA: &str = "Sepia";
pub const SKIN: &str = "Skin";
pub const BONE: &str = "Bone";
pub const COOL: &str = "Cool";
pub const WARM: &str = "Warm";
pub const AS_IS: &str = "As is";
pub const ICE: &str = "Ice";
pub const CONTROLS: &str = "Controls";
pub const TABS: &str = "Tools or controls";
pub const TAB_TOOLS: &str = "Tools";
pub const TAB_TOOLS_HINT: &str = "Modes, tools and measurements (Shift+F3).";
pub const TAB_CONTROLS_HINT: &str = "Threshold, gain, light and all other controls (Shift+F3).";
pub const DRAWER_SIGN: &str = "≡";
pub const DRAWER: &str = "Tools and controls";
pub const DRAWER_HINT: &str = "Opens tools and controls over the picture, or closes them (Shift+F3).";
pub const COLOUR_HINT: &str = "Colours of the tissue; they stand for no flow.";
pub const COLOUR: &str = "Colour";
pub const SHADOW: &str = "Shadow";
pub const CAST_SHADOWS: &str = "Cast shadows";
pub const CAST_SHADOWS_HINT: &str = "The lamp casts shadows on the surface.";
pub const REFERENCE_PICTURE_HINT: &str = "The first tile shows the plane across the slices, and where each of them is.";
pub const REFERENCE_PICTURE: &str = "Reference picture";
pub const BAR_ON_SAVED_PICTURES_HINT: &str =
    "Saved pictures carry the patient's sides, and a bar with scale, depth, mode and time.";
pub const BAR_ON_SAVED_PICTURES: &str = "Bar on saved pictures";
pub const ADVANCED: &str = "Advanced";
pub fn advanced_group(name: impl Display) -> String {
    format!("Advanced: {name}")
}
pub fn advanced_hint(name: impl Display) -> String {
    format!("More controls: {name}. A click opens or closes the group.")
}
pub const NO_SUCH_CONTROL: &str = "This mode has no such control.";
pub const AUTOMATIC: &str = "auto";
pub const THROUGH_ALL: &str = "through all";
pub fn slider_hint(hint: impl Display) -> String {
    format!("{hint} Double click: as at the start.")
}
pub const LIGHT_BALL_HINT: &str = "Drag here to move the lamp; on the picture, drag with Ctrl.";
pub const LIGHT_BALL: &str = "Light ball";
/// Degrees from the front.
pub fn lamp_place(right: f64, up: f64) -> String {
    let side = if right < 0.0 { "left" } else { "right" };
    let height = if up < 0.0 { "below" } else { "above" };
    format!("from {}° {side}, {}° {height}", right.abs(), up.abs())
}
pub const CINE_LOOP: &str = "Cine loop";
pub const FROZEN: &str = "FROZEN";
pub const FREEZE: &str = "Freeze";
pub const FREEZE_HINT: &str = "Keeps this volume on the screen (Space).";
pub const UNFREEZE: &str = "Unfreeze";
pub const SAVE_PICTURE: &str = "Save picture";
pub const SAVE_PICTURE_HINT: &str = "Saves the picture (P).";
pub const HELP_HINT: &str = "All keys and gestures (H).";
pub const SAVE_LOOP: &str = "Save loop";
pub const SAVE_LOOP_HINT: &str = "Saves the last volumes as a recording (R).";
pub const RESET: &str = "Reset";
pub const RESET_HINT: &str = "All settings as at the start (Backspace).";
pub const FULL_SCREEN: &str = "Full screen";
pub const FULL_SCREEN_HINT: &str = "Fills the screen, or leaves it (F11).";
pub const TIMES: &str = "Times";
pub const TIMES_HINT: &str = "Times of pictures and frames (F2).";
pub const HELP: &str = "Help";
pub const NO_VOLUMES_YET: &str = "no volumes yet";
pub const STOP: &str = "Stop";
pub const PLAY: &str = "Play";
pub const PLAY_HINT: &str = "Plays the last volumes as a loop (Enter).";
pub const ONE_VOLUME_BACK: &str = "One volume back";
pub const ONE_VOLUME_BACK_HINT: &str = "One volume back (Left).";
pub const ONE_VOLUME_FORTH: &str = "One volume forth";
pub const ONE_VOLUME_FORTH_HINT: &str = "One volume forth (Right).";
pub const SPEED_HINT: &str = "Speed of the loop; 1x is that of the acquisition (Ctrl+Left, Ctrl+Right).";
pub fn speed(speed: impl Display) -> String {
    format!("Speed {speed}")
}
pub const BACK_AND_FORTH: &str = "Back and forth";
pub const BACK_AND_FORTH_HINT: &str = "Back and forth; a click: forwards (Ctrl+Enter).";
pub const FORWARDS: &str = "Forwards";
pub const FORWARDS_HINT: &str = "Forwards; a click: back and forth (Shift+Enter).";
pub const LOOP_BEGINS_HERE_HINT: &str = "The loop begins with this volume (Shift+Home).";
pub const LOOP_BEGINS_HERE: &str = "Loop begins here";
pub const LOOP_ENDS_HERE_HINT: &str = "The loop ends with this volume (Shift+End).";
pub const LOOP_ENDS_HERE: &str = "Loop ends here";
pub const ALL_SHORT: &str = "All";
pub const ALL_VOLUMES_HINT: &str = "The loop is all volumes (Ctrl+Home).";
pub const ALL_VOLUMES: &str = "All volumes";
pub const VOLUME_OF_THE_LOOP_HINT: &str = "The volumes of the loop, oldest first.";
pub const VOLUME_OF_THE_LOOP: &str = "Volume of the loop";
pub fn place_in_loop(place: impl Display, count: impl Display) -> String {
    format!("{place} of {count}")
}
pub fn loop_seconds(seconds: impl Display) -> String {
    format!("  {seconds:.1} s")
}
pub fn loop_rate(rate: impl Display) -> String {
    format!("  {rate:.1}/s")
}

// Lists of files and formats.
pub fn open_file_hint(name: impl Display) -> String {
    format!("Opens {name} in place of what is shown.")
}
pub fn open_folder_hint(name: impl Display) -> String {
    format!("Lists the folder {name}")
}
pub const FOLDER_ABOVE_HINT: &str = "Lists the folder above.";
pub const CLOSE_OPEN_HINT: &str = "Opens nothing.";
pub const NO_RECORDING_HERE: &str = "There is no recording and no workspace here.";
pub const VOLUME_SHOWN: &str = "The volume that is shown";
pub fn is_being_exported(name: impl Display) -> String {
    format!("{name} is being exported")
}
pub fn is_exported_so_far(name: impl Display, done: impl Display, of: impl Display) -> String {
    format!("{name} is being exported: {done} of {of}")
}
pub fn export_so_far(name: impl Display, done: impl Display, of: impl Display) -> String {
    format!("{name}: {done} of {of} (Ctrl+E)")
}
pub const CLOSE_EXPORT_HINT: &str = "Exports nothing more.";
pub const CANCEL_EXPORT_HINT: &str = "Ends the export in work; nothing of it stays.";
pub const CANCEL_EXPORT: &str = "Cancel the export";
pub const CLOSE_BUTTON: &str = "Close  (Esc)";
pub const CLOSE: &str = "Close";

// The list of presets.
pub const LOOKS: &str = "Looks";
pub const NEW_NAME: &str = "New name";
pub const NAME: &str = "Name";
pub const KEEP_PRESET_HINT: &str =
    "Keeps the look under this name: mode, filters, colours and light, without region and view.";
pub const KEEP_BUTTON: &str = "Keep  (Enter)";
pub const KEEP: &str = "Keep";
pub const CANCEL_BUTTON: &str = "Cancel  (Esc)";
pub const CANCEL_NAMING_HINT: &str = "Keeps no name.";
pub const CANCEL: &str = "Cancel";
pub const SAVE_PRESENT_LOOK_HINT: &str =
    "Keeps the present look under a name: mode, filters, colours and light, without region and view.";
pub const SAVE_PRESENT_LOOK_BUTTON: &str = "Save present look  (S)";
pub const SAVE_PRESENT_LOOK: &str = "Save present look";
pub const UNDO_PRESETS_HINT: &str = "Brings your presets back as they were before the last change.";
pub const UNDO_PRESETS_BUTTON: &str = "Undo  (Z)";
pub const CLOSE_PRESETS_HINT: &str = "Changes nothing.";
pub const RENAME: &str = "Rename";
pub const RENAME_HINT: &str = "Gives this preset another name.";
pub const DELETE: &str = "Delete";
pub const DELETE_PRESET_HINT: &str = "Deletes this preset; Undo above brings it back.";

// What a screen reader says of the picture.
pub const VIEW_FRONT: &str = "Front";
pub const VIEW_LEFT: &str = "Left";
pub const VIEW_RIGHT: &str = "Right";
pub const VIEW_TOP: &str = "Top";
pub const NO_PICTURE_YET: &str = "No picture yet";
pub const WITH_THREE_PLANES: &str = " with three planes";
pub const BESIDE_THE_VOLUME: &str = " beside the volume";
pub const IS_FROZEN: &str = "frozen";
pub const IS_LIVE: &str = "live";
pub fn volume_of_loop(number: impl Display, count: impl Display) -> String {
    format!("Volume {number} of {count}. ")
}
pub fn count_of_measurements(count: usize) -> String {
    format!("{count} measurement{}.", if count == 1 { "" } else { "s" })
}
pub fn with_curved_plane(plane: impl Display) -> String {
    format!(", with the section along a line on plane {plane}")
}
pub fn of_plane(plane: impl Display) -> String {
    format!(", plane {plane}")
}
pub fn seen_from(side: impl Display) -> String {
    format!(" from the {side}")
}
pub fn turned_to(azimuth: impl Display, elevation: impl Display) -> String {
    format!(", turned to azimuth {azimuth:.0}° and elevation {elevation:.0}°")
}

// Times, gestures, the help, and the question before the end.
pub fn milliseconds(ms: impl Display) -> String {
    format!("{ms:.1} ms")
}
pub fn picture_time(time: impl Display) -> String {
    format!("picture {time}")
}
pub const NO_BUDGET: &str = "no budget";
pub fn budget(ms: impl Display) -> String {
    format!("budget {ms:.0} ms")
}
pub fn picture_times(p50: impl Display, p95: impl Display, budget: impl Display) -> String {
    format!("p50 {p50}  p95 {p95}  {budget}")
}
pub fn rates(volumes: impl Display, frames: impl Display, pictures: impl Display) -> String {
    format!("{volumes:.2} volumes/s   {frames:.0} frames/s   {pictures:.1} pictures/s")
}
pub fn acquisition(ms: impl Display, share: impl Display) -> String {
    format!("acquisition: {ms:.0} ms a volume; {share:.0} % of that rate")
}
pub fn frame_to_picture(p95: impl Display) -> String {
    format!("frame to picture p95 {p95}")
}
pub fn input_to_picture(p50: impl Display, p95: impl Display) -> String {
    format!("input to picture p50 {p50}  p95 {p95}")
}
pub fn presentation_to_monitor(p50: impl Display, p95: impl Display) -> String {
    format!("presentation to monitor p50 {p50}  p95 {p95}")
}
pub fn losses(dropped: impl Display, lost: impl Display) -> String {
    format!("{dropped} volumes dropped, {lost} frames lost")
}
pub const NO_TIMES: &str = "no times: the device has no time stamps, or no pass ran";
pub fn more_passes(more: impl Display) -> String {
    format!("{more} more")
}
pub const TIMES_LEGEND: &str = "ms per run; bars: share of the device time";
pub const DRAG_GESTURE: &str = "drag";
pub const DRAG_DOES: &str = "use the tool: turn, light, region, clip, cut, brush, planes, curve";
pub const SHIFT_DRAG: &str = "Shift + drag, right or middle drag";
pub const SHIFT_DRAG_DOES: &str = "move the picture; over a plane: step it";
pub const CTRL_DRAG: &str = "Ctrl + drag";
pub const CTRL_DRAG_DOES: &str = "move the light";
pub const WHEEL: &str = "wheel";
pub const WHEEL_DOES: &str = "zoom; over a plane: step it";
pub const TWO_FINGERS: &str = "two fingers";
pub const TWO_FINGERS_DO: &str = "pinch to zoom, twist to roll, move to pan";
pub const DOUBLE_CLICK: &str = "double click on a tile";
pub const DOUBLE_CLICK_DOES: &str = "show that tile alone, and back";
pub const REGION_DRAG: &str = "Region, then drag";
pub const REGION_DRAG_DOES: &str = "move the nearest face of the box";
pub const START_LINE_CLICK: &str = "Region, then double click the green line (4-up)";
pub const START_LINE_CLICK_DOES: &str = "bend it; add or remove a handle";
pub const REGION_DRAG_ON_PLANE: &str = "Region, then drag on a plane (4-up)";
pub const REGION_DRAG_ON_PLANE_DOES: &str = "move a side of the box; from within: all of it";
pub const LIGHT_BALL_DRAG: &str = "drag on the light ball (below Light)";
pub const LIGHT_BALL_DRAG_DOES: &str = "move the lamp";
pub const CLIP_DRAG: &str = "Clip, then drag up";
pub const CLIP_DRAG_DOES: &str = "cut away what is nearer to the viewer";
pub const CUT_DRAG: &str = "Cut, then drag round";
pub const CUT_DRAG_DOES: &str = "cut away what is within, along the view";
pub const BRUSH_DRAG: &str = "Brush, then drag over it";
pub const BRUSH_DRAG_DOES: &str = "remove what is near the surface there";
pub const PLANES_CLICK: &str = "Planes, then click";
pub const PLANES_CLICK_DOES: &str = "move the point where the three planes cross";
pub const CURVE_CLICKS: &str = "Curve, then clicks on a plane, Enter";
pub const CURVE_CLICKS_DO: &str = "curved plane along them; a drag: a straight line";
pub const CURVE_DRAG: &str = "Curve, then drag a point of the line";
pub const CURVE_DRAG_DOES: &str = "move it";
pub const BODY_MARK_DRAG: &str = "Body mark, then drag, click or wheel on it";
pub const BODY_MARK_DRAG_DOES: &str = "move it; put the probe there; turn the probe";
pub const QUIT: &str = "quit";
pub const KEYS: &str = "Keys";
pub const GESTURES: &str = "Gestures";
pub const KEYS_AND_GESTURES: &str = "Keys and gestures";
pub fn searching_for(text: impl Display) -> String {
    format!("Search: {text}_")
}
pub const SEARCH_BUTTON: &str = "Search  ( / )";
pub const SEARCH_HINT: &str = "Finds keys, gestures and controls ( / ).";
pub const SEARCH: &str = "Search";
pub const NOTHING_FOUND: &str = "Nothing is found.";
pub const NO_MEDICAL_DEVICE: &str = "Echolume is not a medical device.";
pub const LOOP_NOT_SAVED: &str = "The loop is not saved";
pub const LOOP_NOT_SAVED_ABOUT: &str = "Its volumes are lost when the program ends.";
pub const SAVE_AND_LEAVE: &str = "Save and leave  (Enter)";
pub const LEAVE_WITHOUT_SAVING: &str = "Leave without saving  (L)";
pub const STAY: &str = "Stay  (Esc)";
pub const SAVE_AND_LEAVE_HINT: &str = "Saves all volumes of the loop as a recording, then ends the program.";
pub const LEAVE_WITHOUT_SAVING_HINT: &str = "Ends the program; the volumes are lost.";
pub const STAY_HINT: &str = "Goes on as before.";
pub const CLOSE_HELP_HINT: &str = "Closes the help (H).";

// Presets of examinations.
pub const FACE: &str = "Face";
pub const FACE_HINT: &str = "Skin in fluid, under light that goes into it.";
pub const SKELETON: &str = "Skeleton";
pub const SKELETON_HINT: &str = "What reflects the most shines through a thin veil of soft tissue.";
pub const GLASS: &str = "Glass";
pub const GLASS_HINT: &str = "Only the edges of tissue shine: everything can be seen through.";
pub const VESSELS: &str = "Vessels";
pub const VESSELS_HINT: &str = "Inverted: fluid is opaque, tissue is clear.";
pub const BONE_HINT: &str = "A bright surface under soft tissue.";
pub const B_MODE: &str = "B-mode";
pub const B_MODE_HINT: &str = "The scan plane in grey.";

pub const TURNTABLE: &str = "Turntable";
pub const TURNTABLE_HINT: &str = "The view turns by itself, until you turn it. (Shift+T)";
pub const NOTHING_TURNS: &str = "The turntable turns renderings: choose Surface, Volume or another of them";
// The curved plane.
pub const CURVE_ON_ANOTHER_PLANE: &str =
    "The line was begun on another plane: end it there (Enter), or leave it (Esc).";
pub const CURVE_FULL: &str = "The line has as many points as it can have: end it (Enter).";
pub const CURVE_NEEDS_POINTS: &str = "A line needs two points or more: click the next one.";
pub const CURVE_NOT_DRAWN: &str = "This line cannot be drawn: draw another one.";
pub const CURVED_PLANE: &str = "Curved plane";
pub const CURVE_STEP_SECOND: &str = "Click the next point of the line.";
pub const CURVE_STEP_NEXT: &str = "Click the next point; Enter or a double click ends the line.";
pub const CURVE_STEP_CHANGE: &str = "Drag a point of the line, or draw another line.";
pub const CURVE_STEP_FIRST: &str = "Click the points of a line on A, B or C, or drag a straight line.";
pub const END_CURVE_HINT: &str = "Shows the section along the line (Enter).";
pub const END_CURVE: &str = "End the line";
pub const REMOVE_CURVE_HINT: &str = "Shows the planes without it (Shift+Delete; undo brings it back).";
pub const REMOVE_CURVE: &str = "Remove curved plane";

// The start line.
pub const START_LINE: &str = "Start line";
pub const CURVED_LINE: &str = "Curved line";
pub const CURVED_LINE_HINT: &str =
    "Bends the line at which rendering starts: drag its green handles on plane A of 4-up. Off: straight. (Shift+G)";
pub fn start_handle(number: impl Display) -> String {
    format!("Handle {number}")
}
pub const START_HANDLE_HINT: &str =
    "How deep rendering starts at this handle of the start line, counted from the left.";
pub const ADD: &str = "Add";
pub const ADD_HANDLE: &str = "Add handle";
pub const ADD_HANDLE_HINT: &str =
    "One more handle, in the widest gap; or double click the line where it is wanted. At most five.";
pub const REMOVE: &str = "Remove";
pub const REMOVE_HANDLE: &str = "Remove handle";
pub const REMOVE_HANDLE_HINT: &str =
    "One handle less: the one that bends the line the least; or double click one. At least three.";
pub const START_LINE_FULL: &str = "The start line has five handles, as many as it can have.";
pub const START_LINE_LEAST: &str =
    "The start line has three handles, as few as it can have: Shift+G makes it straight.";
pub const NOTHING_STARTS: &str = "The start line is that of a rendering: planes and the block show everything.";
