//! Notes and banners over the picture. Texts whose names begin with `WHY_` are reasons within other sentences, so they begin in lower case.

use std::fmt::Display;
use std::path::Path;

// What was saved, what a start is at.
/// The message about a saved file: its name and folder.
pub fn saved(file: &Path) -> String {
    format!("Saved {}", std::path::absolute(file).unwrap_or_else(|_| file.into()).display())
}
text!(not_saved(fault) = "Not saved: {fault}");
pub(crate) const SHADER_ERROR: &str = "Shader error: the last good shader is shown";
pub(crate) const DEVICE_STALLED_ABOUT: &str =
    "It did not finish in time and was opened again. The volumes that arrived in between are not shown.";
pub(crate) const DEVICE_STALLED: &str = "The graphics device stalled";
pub(crate) const PREPARING_THE_DEVICE: &str = "Preparing the device";
text!(shaders_compiled(done, count) = "{done} of {count} shaders are compiled");
pub(crate) const WAITING_FOR_FRAME: &str = "Waiting for the first frame";
text!(frames_of_first_volume(done, count) = "{done} of {count} frames of the first volume");
pub(crate) const DRAWING_FIRST_PICTURE: &str = "Drawing the first picture";

// The device.
pub(crate) const DEVICE_OPENED_AGAIN: &str = "The device was lost and opened again";

// Opening files.
pub(crate) const FOLDER_ABOVE: &str = "..  (the folder above)";
text!(is_not_there(path) = "There is no file and no folder {path}");
text!(files_as_series(count) = "all {count} DICOM files of this folder as one recording");
pub(crate) const OPENS_NO_OTHER_FILES: &str = "This view opens no other files";
pub(crate) const SAVE_THE_WORKSPACE_FIRST: &str =
    "Measurements, cuts or labels are not saved: save the workspace first (Ctrl+S)";
text!(
    loses_work(name) = "Measurements, cuts or labels of {name} are not saved: save the workspace first (Ctrl+S), or close it again to lose them"
);
pub(crate) const SAVE_THE_LOOP_FIRST: &str = "The loop is not saved: save it first (Ctrl+R)";
text!(reading(name) = "Reading {name}");
text!(percent(share) = "{share} %");
text!(files_of_folder(done, count) = "{done} of {count} files");
pub(crate) const READING_SHARE: &str = "Read so far";
pub(crate) const CANCEL_READING: [&str; 2] = ["Cancel", "Reads no further; what is shown stays (Esc)."];
text!(not_read_further(name) = "{name} is not read further");
pub(crate) const READING_CANCELLED: &str = "Reading was cancelled";
pub(crate) const READING_CANCELLED_ABOUT: &str = "Ctrl+O opens a recording.";
text!(too_many_recordings(most) = "{most} recordings are open: close one first");
text!(is_closed(name) = "{name} is closed");
pub(crate) const ONLY_RECORDING: &str = "No other recording is open";
pub(crate) const STANDARD_INPUT: &str = "Standard input";
text!(cannot_be_opened(name, e) = "{name} cannot be opened: {e}");
pub(crate) const WHY_FILE_NOT_READ: &str = "it ended before the file was read";
text!(not_opened(fault) = "Not opened: {fault}");

// Presets of the user.
pub(crate) const OWN_PRESET_HINT: &str = "A preset of your own.";
pub(crate) const PRESET_DOES_NOT_FIT: &str = "This preset does not fit the volume";
text!(too_many_presets(max_presets) = "{max_presets} presets are kept: delete one first");
text!(name_is_taken(name) = "{name} is the name of another preset");
pub(crate) const WHY_PRESET_IS_GONE: &str = "this preset is gone";
text!(preset_is_called(name) = "The preset is called {name}");
text!(preset_is_replaced(name) = "{name} has the present look. Undo in the list brings the earlier one back");
text!(preset_is_kept(name) = "{name} is kept");
pub(crate) const WHY_NO_PRESETS: &str = "this view keeps no presets";
text!(preset_is_deleted(name) = "{name} is deleted. Undo in the list brings it back");
pub(crate) const PRESETS_CHANGED_ELSEWHERE: &str = "The presets were changed elsewhere: nothing is taken back";
pub(crate) const PRESETS_RESTORED: &str = "The presets are as they were";

// What cannot be saved.
pub(crate) const WHY_NO_PICTURE: &str = "there is no picture yet";
text!(picture_not_saved(fault) = "The picture was not saved: {fault}");
pub(crate) const WHY_NO_VOLUMES: &str = "there are no volumes yet";
text!(loop_not_saved(fault) = "The loop was not saved: {fault}");
pub(crate) const WHY_NO_VOLUME: &str = "there is no volume yet";
text!(exporting(name) = "Exporting: {name}");
text!(not_exported(fault) = "Not exported: {fault}");

// The brush.
pub(crate) const BRUSH_NEEDS_SURFACE: &str = "The brush needs a surface: choose the mode Surface or Mixed";

// Cuts.
pub(crate) const CUTS_IN_THE_WAY: &str =
    "That draws both what is dark and what is bright, of which nothing can be cut: remove the cuts first (Shift+F).";
pub(crate) const TOO_MANY_CUTS: &str = "There are as many cuts as a scene can have: remove them, or take one back.";
pub(crate) const CUTS_NEED_RENDERING: &str = "Cuts are made on a rendering: the cube shows all of the volume.";
pub(crate) const CONTOUR_TOO_SMALL: &str = "The contour is too small, or beside the volume.";
pub(crate) const CANNOT_CUT_BOTH: &str = "Nothing can be cut where both what is dark and what is bright is drawn.";

// The automatic render start.
pub(crate) const CURVE_IN_THE_WAY: &str = "That draws both what is dark and what is bright, of which nothing can be removed: the start line has to be straight (Shift+G).";
pub(crate) const SEVERAL_IN_THE_WAY: &str = "That draws both what is dark and what is bright, of which nothing can be removed: no cuts (Shift+F), a straight start line (Shift+G) and no automatic render start go with it.";
pub(crate) const NO_SUCH_PRESET: &str = "There is no such preset";
pub(crate) const UNVEILING_IN_THE_WAY: &str = "That draws both what is dark and what is bright, of which nothing can be removed: rendering cannot start at the fluid.";

// The source: title and explanation.
pub const DEMO_DATA: &str = crate::source::DEMO_DATA;
pub(crate) const COMPUTING_DEMO_DATA: &str = "Computing the demo data";
pub(crate) const READING_RECORDING: &str = "Reading the recording";
pub(crate) const WAITING_FOR_STANDARD_INPUT: &str = "Waiting for frames on standard input";
pub(crate) const CONNECTING_TO_PROBE: &str = "Connecting to the probe";
pub(crate) const NO_DEMO_DATA: &str = "No demo data: trying again";
pub(crate) const RECORDING_NOT_OPENED: &str = "The recording cannot be opened: trying again";
pub(crate) const STANDARD_INPUT_NOT_READ: &str = "Standard input cannot be read: trying again";
pub(crate) const NO_PROBE: &str = "No probe: trying again";
pub(crate) const SOURCE_ENDED: &str = "The source ended";
pub(crate) const NOT_CONNECTED: &str = "Not connected: trying again";
pub(crate) const NO_FRAMES_ON_STANDARD_INPUT: &str = "No frames on standard input";
pub(crate) const NO_FRAMES_ON_STANDARD_INPUT_ABOUT: &str = "It is open but nothing comes.";
pub(crate) const NO_FRAMES_FROM_THE_PROBE: &str = "No frames from the probe";
pub(crate) const NO_FRAMES_FROM_THE_PROBE_ABOUT: &str = "It is connected but sends nothing.";
pub(crate) const WHY_SOURCE_PANICKED: &str = "the thread that opens the source panicked";
text!(why_no_thread_for_source(e) = "a thread for the source cannot be started: {e}");
pub(crate) const WHY_SOURCE_ENDED: &str = "the source ended";
text!(why_no_thread(e) = "a thread cannot be started: {e}");

// Saving in the background.
text!(still_exporting(name) = "{name} is still being exported");
text!(still_saving(max_pending) = "{max_pending} files are still being saved: wait a moment");
text!(why_no_folder(folder, e) = "{folder}: cannot be created: {e}");

// The ladder of quality, for the times.
pub(crate) const FULL_QUALITY: &str = "full quality";
pub(crate) const NO_OCCLUSION: &str = "no occlusion";
pub(crate) const NO_OCCLUSION_NO_SHADOW: &str = "no occlusion, no shadow";
pub(crate) const HALF_RAYS: &str = "half the rays each way";
pub(crate) const QUARTER_RAYS: &str = "a quarter of the rays each way";
pub(crate) const EIGHTH_RAYS: &str = "an eighth of the rays each way";

pub fn render_start(outcome: impl Display) -> String {
    format!("{}: {outcome}.", super::AUTO_RENDER_START)
}

// Input devices, where there is no desktop.
pub(crate) const WHY_DEVICES_LOST: &str = "the reader panicked";
text!(devices_lost(why) = "input devices: {why}");
text!(
    devices_not_read(count) =
        "{count} input devices cannot be read: this user is not in the group input (as root: usermod -aG input USER)"
);
text!(device_not_grabbed(name, path, fault) = "{name} ({path}) cannot be grabbed: {fault}");
