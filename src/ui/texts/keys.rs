//! What the keys do, for the help.

// Keys; those that are not here are called by their names in English.
pub const CTRL: &str = "Ctrl+";
pub const ALT: &str = "Alt+";
pub const SHIFT: &str = "Shift+";
pub const PAGE_UP: &str = "Page up";
pub const PAGE_DOWN: &str = "Page down";

// What they do.
pub const SURFACE: &str = "surface";
pub const VOLUME: &str = "volume";
pub const MIXED: &str = "surface behind a volume layer";
pub const MIP: &str = "largest echoes (MIP)";
pub const MINIP: &str = "smallest echoes (MinIP)";
pub const X_RAY: &str = "X-ray";
pub const ONE_PLANE: &str = "one plane";
pub const THREE_PLANES: &str = "three planes";
pub const TOMOGRAPHY: &str = "tomography";
pub const BLOCK: &str = "block";
pub const LAYOUT_FOUR: &str = "three planes and the rendering";
pub const LAYOUT_PAIR: &str = "volume and surface side by side";
pub const LAYOUT_SINGLE: &str = "one picture";
pub const DRAG_ROTATES: &str = "drag rotates";
pub const DRAG_MOVES_LIGHT: &str = "drag moves the light";
pub const DRAG_MOVES_REGION: &str = "drag moves the region's faces";
pub const BEND_START_LINE: &str = "bend the start line, or straighten it";
pub const DRAG_CLIPS: &str = "drag cuts from the front";
pub const DRAG_MOVES_PLANES: &str = "drag moves the planes (sections)";
pub const DRAG_CUTS: &str = "drag round it cuts it away (freehand)";
pub const DRAG_BRUSHES: &str = "drag over it brushes it away";
pub const REMOVE_ALL_CUTS: &str = "remove all cuts";
pub const NO_CLIP: &str = "nothing cut from the front";
pub const ROTATE: &str = "rotate";
pub const FROM_THE_FRONT: &str = "from the front";
pub const FROM_THE_LEFT: &str = "from the left";
pub const FROM_THE_RIGHT: &str = "from the right";
pub const FROM_THE_TOP: &str = "from the top";
pub const TURNTABLE: &str = "turntable: the view turns by itself";
pub const ROLL: &str = "roll";
pub const CLOSER: &str = "closer";
pub const FARTHER: &str = "farther";
pub const RESET_ALL_SETTINGS: &str = "reset all settings";
pub const UNDO: &str = "undo";
pub const REDO: &str = "redo";
pub const PLANE_A: &str = "plane A: the scan plane";
pub const PLANE_B: &str = "plane B: across the frames";
pub const PLANE_C: &str = "plane C: at one depth";
pub const STEP_PLANE: &str = "plane by 1 mm";
pub const STEP_PLANE_FAR: &str = "plane by 5 mm";
pub const RECENTRE: &str = "planes to the middle";
pub const CURVED_PLANE: &str = "curved plane: draw its line";
pub const REMOVE_CURVED_PLANE: &str = "remove the curved plane";
pub const CALIPER: &str = "caliper: distance";
pub const ANGLE: &str = "angle";
pub const ELLIPSE: &str = "ellipse";
pub const TRACE: &str = "trace: area";
pub const DISTANCE_ON_THE_SURFACE: &str = "distance on the surface";
pub const VOLUME_BY_CONTOURS: &str = "volume by contours";
pub const VOLUME_BY_THRESHOLD: &str = "volume by threshold, in the region";
pub const TEXT: &str = "text";
pub const ARROW: &str = "arrow";
pub const BODY_MARK: &str = "body mark";
pub const DELETE_LAST_MEASUREMENT: &str = "delete the last measurement";
pub const COPY_RESULTS: &str = "copy the results (CSV)";
pub const THRESHOLD: &str = "threshold";
pub const GAIN: &str = "gain";
pub const SHADOW: &str = "shadow (darker)";
pub const NO_SHADOW: &str = "no shadow";
pub const VOLUME_IN_GREY: &str = "volume in grey";
pub const VOLUME_IN_SEPIA: &str = "volume in sepia";
pub const VOLUME_AS_SKIN: &str = "volume as skin";
pub const VOLUME_AS_BONE: &str = "volume as bone";
pub const VOLUME_IN_BLUE: &str = "volume in blue";
pub const VOLUME_IN_RED: &str = "volume in red";
pub const PICTURE_IN_GREY: &str = "picture in grey";
pub const PICTURE_IN_SEPIA: &str = "picture in sepia";
pub const PICTURE_AS_SKIN: &str = "picture as skin";
pub const PICTURE_IN_ICE: &str = "picture in ice";
pub const PICTURE_AS_IS: &str = "picture in its own colours";
pub const FREEZE: &str = "freeze, unfreeze";
pub const STEP_LOOP: &str = "one volume back, forth";
pub const OLDEST_VOLUME: &str = "oldest volume";
pub const NEWEST_VOLUME: &str = "newest volume";
pub const PLAY_THE_CINE_LOOP: &str = "play the cine loop";
pub const MARK_LOOP: &str = "the loop begins, ends here";
pub const THE_COMPLETE_LOOP: &str = "the complete loop";
pub const LOOP_SPEED: &str = "loop slower, faster";
pub const LOOP_BACK_AND_FORTH: &str = "loop back and forth";
pub const LOOP_FORWARDS: &str = "loop forwards";
pub const SAVE_THE_PICTURE: &str = "save the picture";
pub const SAVE_THE_RECORDING: &str = "save the recording";
pub const SAVE_WORKSPACE: &str = "save the workspace";
pub const OPEN: &str = "open a recording or a workspace";
pub const STEP_RECORDING: &str = "previous, next open recording";
pub const CLOSE_RECORDING: &str = "close the recording";
pub const EXPORT_THE_VOLUME: &str = "export the volume";
pub const PRESETS: &str = "presets";
pub const THIS_HELP: &str = "this help";
pub const TIMES_OF_THE_PASSES: &str = "times of the passes";
pub const SLIDERS: &str = "sliders";
pub const SWITCH_RAIL: &str = "tools or controls, where a window has not both";
pub const FOCUS_PANELS: &str = "keyboard to the buttons and sliders, and back";
pub const KEYBOARD_POINTER: &str = "pointer by keyboard, on and off";
pub const FULL_SCREEN: &str = "full screen";
pub const BACK: &str = "close what is open, leave full screen, quit";
pub const QUIT: &str = "quit";

// The pointer by keyboard: its keys, and what they do while it is on.
pub const BY_KEYBOARD: &str = "Pointer by keyboard";
pub const POINTER_IS_ON: &str =
    "Pointer by keyboard: the arrows move it (Shift: one pixel), Enter clicks, Space holds and releases, Esc leaves";
pub const POINTER_IS_OFF: &str = "Pointer by keyboard: off";
pub const POINTER_KEYS: [(&str, &str); 8] = [
    ("Left, Right, Up, Down", "move the pointer; two at once: aslant"),
    ("Shift + arrows", "one pixel"),
    ("Enter", "click"),
    ("Shift+Enter", "double click"),
    ("Ctrl+Enter", "end the contour, the volume or the line"),
    ("Space", "hold the button, and release it: arrows drag meanwhile"),
    ("Shift+Space, Ctrl+Space", "the same as Shift + drag, Ctrl + drag"),
    ("Esc", "give the drag up; else leave the pointer"),
];
