//! Descriptions of the keys in the help.

// Keys; those that are not here are called by their names in English.
pub(crate) const CTRL: &str = "Ctrl+";
pub const ALT: &str = "Alt+";
pub const SHIFT: &str = "Shift+";
pub const PAGE_UP: &str = "Page up";
pub const PAGE_DOWN: &str = "Page down";

// What they do.
pub const SURFACE: &str = "surface";
pub const VOLUME: &str = "volume";
pub(crate) const MIXED: &str = "surface behind a volume layer";
pub const MIP: &str = "largest echoes (MIP)";
pub(crate) const MINIP: &str = "smallest echoes (MinIP)";
pub(crate) const X_RAY: &str = "X-ray";
pub(crate) const ONE_PLANE: &str = "one plane";
pub(crate) const THREE_PLANES: &str = "three planes";
pub(crate) const TOMOGRAPHY: &str = "slices";
pub(crate) const CUBE: &str = "cube";
pub(crate) const LAYOUT_FOUR: &str = "three planes and the rendering, of one size";
pub(crate) const LAYOUT_BESIDE: &str = "the rendering, and three planes beside it";
pub(crate) const LAYOUT_PAIR: &str = "volume and surface side by side";
pub(crate) const LAYOUT_SINGLE: &str = "one picture";
pub(crate) const DRAG_ROTATES: &str = "drag rotates";
pub(crate) const DRAG_MOVES_LIGHT: &str = "drag moves the light";
pub(crate) const DRAG_MOVES_REGION: &str = "drag moves the region's faces";
pub(crate) const BEND_START_LINE: &str = "bend the start line, or straighten it";
pub(crate) const DRAG_CLIPS: &str = "drag cuts from the front";
pub(crate) const DRAG_MOVES_PLANES: &str = "crosshair: drag moves the planes";
pub(crate) const DRAG_CUTS: &str = "drag round it cuts it away (freehand)";
pub(crate) const DRAG_BRUSHES: &str = "drag over it brushes it away";
pub(crate) const REMOVE_ALL_CUTS: &str = "remove all cuts";
pub(crate) const NO_CLIP: &str = "nothing cut from the front";
pub(crate) const ROTATE: &str = "rotate";
pub(crate) const FROM_THE_FRONT: &str = "from the front";
pub(crate) const FROM_THE_LEFT: &str = "from the left";
pub(crate) const FROM_THE_RIGHT: &str = "from the right";
pub(crate) const FROM_THE_TOP: &str = "from the top";
pub(crate) const TURNTABLE: &str = "turntable: the view turns by itself";
pub(crate) const ROLL: &str = "roll";
pub(crate) const CLOSER: &str = "closer";
pub(crate) const FARTHER: &str = "farther";
pub(crate) const RESET_ALL_SETTINGS: &str = "reset all settings";
pub(crate) const UNDO: &str = "undo";
pub(crate) const UNDO_ALL: &str = "undo all changes";
pub(crate) const REDO: &str = "redo";
pub(crate) const PLANE_A: &str = "plane A: the scan plane";
pub(crate) const PLANE_B: &str = "plane B: across the frames";
pub(crate) const PLANE_C: &str = "plane C: at one depth";
pub(crate) const STEP_PLANE: &str = "plane by 1 mm";
pub(crate) const STEP_PLANE_FAR: &str = "plane by 5 mm";
pub(crate) const RECENTRE: &str = "planes to the middle";
pub(crate) const CURVED_PLANE: &str = "curved plane: draw its line";
pub(crate) const REMOVE_CURVED_PLANE: &str = "remove the curved plane";
pub(crate) const CALIPER: &str = "measure: caliper, distance";
pub(crate) const ANGLE: &str = "measure: angle";
pub(crate) const ELLIPSE: &str = "measure: ellipse";
pub const TRACE: &str = "measure: trace, area";
pub(crate) const DISTANCE_ON_THE_SURFACE: &str = "measure: distance on the surface";
pub(crate) const VOLUME_BY_CONTOURS: &str = "measure: volume by contours";
pub(crate) const AUTOMATIC_VOLUME: &str = "measure: automatic volume, of the largest bright body in the region";
pub const TEXT: &str = "text";
pub(crate) const ARROW: &str = "arrow";
pub(crate) const LABELS: &str = "labels: paint, erase, grow from a click";
pub(crate) const BODY_MARK: &str = "body mark";
pub(crate) const DELETE_LAST_MEASUREMENT: &str = "delete the last measurement";
pub(crate) const COPY_RESULTS: &str = "copy the results (CSV)";
pub const THRESHOLD: &str = "threshold";
pub const GAIN: &str = "gain";
pub const SHADOW: &str = "shadow (darker)";
pub(crate) const NO_SHADOW: &str = "no shadow";
pub(crate) const VOLUME_IN_GREY: &str = "volume: grey";
pub(crate) const VOLUME_IN_SEPIA: &str = "volume: sepia";
pub(crate) const VOLUME_AS_SKIN: &str = "volume: skin";
pub(crate) const VOLUME_AS_BONE: &str = "volume: bone";
pub(crate) const VOLUME_COOL: &str = "volume: cool";
pub(crate) const VOLUME_WARM: &str = "volume: warm";
pub(crate) const PICTURE_IN_GREY: &str = "picture: grey";
pub(crate) const PICTURE_IN_SEPIA: &str = "picture: sepia";
pub(crate) const PICTURE_AS_SKIN: &str = "picture: skin";
pub(crate) const PICTURE_IN_ICE: &str = "picture: ice";
pub(crate) const PICTURE_AS_IS: &str = "picture: as is";
pub(crate) const FREEZE: &str = "freeze, unfreeze";
pub(crate) const STEP_LOOP: &str = "previous, next volume";
pub(crate) const OLDEST_VOLUME: &str = "oldest volume";
pub(crate) const NEWEST_VOLUME: &str = "newest volume";
pub(crate) const PLAY_THE_CINE_LOOP: &str = "play the cine loop";
pub(crate) const MARK_LOOP: &str = "the loop begins, ends here";
pub(crate) const THE_COMPLETE_LOOP: &str = "the complete loop";
pub(crate) const LOOP_SPEED: &str = "loop slower, faster";
pub(crate) const LOOP_BACK_AND_FORTH: &str = "loop back and forth";
pub(crate) const LOOP_FORWARDS: &str = "loop forwards";
pub(crate) const SAVE_THE_PICTURE: &str = "save the picture";
pub(crate) const SAVE_THE_RECORDING: &str = "save the loop";
pub(crate) const SAVE_WORKSPACE: &str = "save the workspace";
pub(crate) const OPEN: &str = "open a recording or a workspace";
pub(crate) const COMPARE: &str = "compare with the next open recording or with this picture; end it";
pub(crate) const STEP_RECORDING: &str = "previous, next open recording";
pub(crate) const CLOSE_RECORDING: &str = "close the recording";
pub(crate) const EXPORT_THE_VOLUME: &str = "export the volume";
pub const PRESETS: &str = "presets";
pub(crate) const THIS_HELP: &str = "this help";
pub(crate) const TIMES_OF_THE_PASSES: &str = "times of the passes";
pub const SLIDERS: &str = "bars and inspector, on and off";
pub(crate) const FIND: &str = "find a command or a control";
pub(crate) const NEXT_TAB: &str = "next part of the inspector";
pub(crate) const FOCUS_PANELS: &str = "keyboard to the buttons and sliders, and back";
pub(crate) const KEYBOARD_POINTER: &str = "pointer by keyboard, on and off";
pub(crate) const FULL_SCREEN: &str = "full screen";
pub const BACK: &str = "close what is open, leave full screen, quit";
pub(crate) const QUIT: &str = "quit";

// The pointer by keyboard: its keys, and what they do while it is on.
pub(crate) const BY_KEYBOARD: &str = "Pointer by keyboard";
pub(crate) const POINTER_IS_ON: &str =
    "Pointer by keyboard: the arrows move it (Shift: one pixel), Enter clicks, Space holds and releases, Esc leaves";
pub(crate) const POINTER_IS_OFF: &str = "Pointer by keyboard: off";
pub(crate) const POINTER_KEYS: [(&str, &str); 8] = [
    ("Left, Right, Up, Down", "move the pointer; two at once: aslant"),
    ("Shift + arrows", "one pixel"),
    ("Enter", "click"),
    ("Shift+Enter", "double click"),
    ("Ctrl+Enter", "end the contour, the volume or the line"),
    ("Space", "hold the button, and release it: arrows drag meanwhile"),
    ("Shift+Space, Ctrl+Space", "the same as Shift + drag, Ctrl + drag"),
    ("Esc", "give the drag up; else leave the pointer"),
];
