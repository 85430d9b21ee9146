//! The commands of a user, given by gestures on the picture, keys and panels; and the key bindings with their descriptions in the help.

pub use super::comparison::{CompareView, Link};
pub use super::labelling::{Effect, LabelCommand};
pub use super::view::{Face, Viewpoint};

use super::input::{Input, Key, Modifiers};
use super::sliders::{GAIN, THRESHOLD};
use crate::scene::{
    Body, BodyMark, ColourMap, KeptSide, Layout, MeasureKind, Mode, PlaneName, ProbeMarker, Sides, TransferName,
    VolumeAxis,
};
use crate::texts::keys;
use Key::{Char, Function};

/// What the user can request by a key, a gesture or a control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    Mode(Mode),
    Layout(Layout),
    /// Shows the rendering alone, in the mode that was rendered last.
    Rendering,
    /// Selects what a drag on the picture does.
    Tool(Tool),
    /// Rotates the camera, degrees: azimuth (towards +lateral), elevation (towards +elevation).
    Rotate([f64; 2]),
    /// Shows a rendering from one side, upright.
    LookFrom(Viewpoint),
    /// Starts to rotate the rendering continuously, or stops it.
    Turntable,
    /// Rotates the picture clockwise, degrees.
    Roll(f64),
    /// Multiplies the zoom; above 1 is closer.
    Zoom(f64),
    /// Moves what the rendering shows to the right and down, by shares of the picture's height. On planes alone it has no effect.
    Pan([f64; 2]),
    /// Moves the light to the right and down over a dome above the surface, by shares of the picture's height.
    MoveLight([f64; 2]),
    /// Moves a face of the region outwards by a distance, mm.
    MoveFace(Face, f64),
    /// Moves the region by distances along lateral, depth and elevation, mm.
    MoveRegion([f64; 3]),
    /// Gives the region a start curve with handles, at which rendering starts, or removes it.
    ToggleStartCurve,
    /// Moves the handle of the start curve with this index to a position: lateral, depth, mm.
    MoveStartHandle(usize, [f64; 2]),
    /// Adds a handle to the start curve at this lateral position, mm; with `None` in the widest gap between handles.
    AddStartHandle(Option<f64>),
    /// Removes the handle of the start curve with this index; with `None` the one that bends the curve the least.
    RemoveStartHandle(Option<usize>),
    /// Moves the viewer's clip plane further into the volume, mm; negative values pull it back.
    MoveClip(f64),
    /// Selects the plane that commands move and that is shown alone. If no plane is shown, also selects [`Mode::Plane`].
    Plane(PlaneName),
    /// Moves the selected plane along its normal, mm.
    StepPlane(f64),
    /// Moves the point where the three planes cross to a position: lateral, depth, elevation, mm.
    MoveCrossing([f64; 3]),
    /// Rotates the planes by angles, degrees: azimuth, tilt.
    RotatePlanes([f64; 2]),
    /// Sets the slider with this index of [`super::sliders::SLIDERS`] to a value in the unit of the setting.
    SetSlider(usize, f64),
    /// Sets the slider with this index to a value in the unit that is displayed.
    SetShown(usize, f64),
    /// Resets the slider with this index to its value at the start.
    ResetSlider(usize),
    /// Moves the slider with this index by a number of its steps.
    StepSlider(usize, i32),
    Transfer(TransferName),
    /// Gives the volume the opacities of the transfer function of this name; `None`: those of its own transfer function.
    Opacity(Option<TransferName>),
    ColourMap(ColourMap),
    Shadow(bool),
    /// Restores the settings of the start. The size of the picture, measurements, body marks, labels, the patient's sides, the probe's marker, the
    /// bar of saved pictures, and the marks, speed and direction of the cine loop are kept. Cuts are not kept. A frozen
    /// picture stays frozen.
    Reset,
    /// Undoes the last change. While a measurement or a line is in progress, removes its last point instead.
    Undo,
    /// Undoes all changes that are kept, at most the last 100. Redo can restore them one by one, but not the points of a measurement or a line in
    /// progress.
    UndoAll,
    /// Redoes the change that was undone last.
    Redo,
    /// Moves the point where the planes cross to the middle of the region.
    Recentre,
    /// Shows or hides the reference plane of a tomography: a plane across the slices, with their lines.
    Reference(bool),
    /// Sets a point of the measurement in progress: lateral, depth, elevation, mm. The flag is true if it was picked on the rendered surface.
    Point([f64; 3], bool),
    /// Sets a point of the measurement in progress on the surface under this pixel of the picture.
    PickSurface([f64; 2]),
    /// Ends the trace or the path that is being measured. Of a volume, closes the contour in progress, or without one ends the volume.
    EndMeasure,
    /// Discards the measurement in progress, and ends the typing of a text.
    CancelMeasure,
    /// Moves a point of a measurement: index of the measurement, index of its point, new position, mm.
    MovePoint(usize, usize, [f64; 3]),
    /// Deletes the measurement with this index; the last one if there is no such index.
    DeleteMeasure(usize),
    ClearMeasures,
    /// Starts to type the text of the measurement with this index.
    LabelMeasure(usize),
    Type(char),
    Untype,
    EndTyping,
    /// Starts the contour of a cut or a stroke of the brush at this pixel of the picture.
    BeginCut([f64; 2]),
    /// Continues the contour of a cut or the stroke of the brush to this pixel of the picture.
    CutAlong([f64; 2]),
    /// Closes the contour of a cut and cuts along it, or ends the stroke of the brush and removes tissue near it.
    EndCut,
    /// Discards the contour of a cut or the stroke of the brush that is being drawn.
    CancelCut,
    /// Chooses which side of the next contour of a cut is kept.
    KeepSide(KeptSide),
    /// Sets the radius of the brush, mm.
    BrushRadius(f64),
    /// Multiplies the radius of the brush.
    ScaleBrush(f64),
    Labels(LabelCommand),
    /// Removes all cuts.
    ClearCuts,
    /// Appends a point to the line of a curved plane that is being drawn, or begins a line: the plane that it is drawn on, and the coordinates there, mm, as
    /// in `planes.curve.points`.
    CurvePoint(PlaneName, [f64; 2]),
    /// Ends the line of a curved plane, and shows the section along it.
    EndCurve,
    /// Discards the line of a curved plane that is being drawn.
    CancelCurve,
    /// Moves the point with this index on the line of the curved plane to coordinates on its plane, mm.
    MoveCurvePoint(usize, [f64; 2]),
    /// Removes the curved plane.
    ClearCurve,
    /// Sets a point of the measurement in progress on the curved plane: lateral, depth, elevation, mm.
    PointOnCurve([f64; 3]),
    /// Adds a body mark of this part of the body in a corner of the picture.
    AddBodyMark(Body),
    /// Replaces the body mark with this index: its position, size, probe, direction or part of the body.
    ChangeBodyMark(usize, BodyMark),
    /// Selects the body mark with this index, to which the controls then refer.
    SelectBodyMark(usize),
    RemoveBodyMark(usize),
    /// Sets which sides of the patient lie at the ends of an axis of the volume.
    Sides(VolumeAxis, Sides),
    /// Exchanges the patient's left and right side.
    ExchangeLeftAndRight,
    /// Sets at which end of the scan lines the probe's marker is, or that it is not drawn.
    ProbeMarker(ProbeMarker),
    /// Measures the volume of the largest bright body in the region.
    MeasureBody,
    /// Copies the results of measurements to the clipboard as CSV.
    CopyMeasures,
    /// Saves the results of measurements as a CSV file.
    SaveMeasures,
    /// Saves settings, measurements and the path of the recording as a workspace file.
    SaveWorkspace,
    /// Shows or hides the list of files to open.
    OpenFiles,
    /// Opens the entry with this index of the list of files.
    OpenFile(usize),
    /// Shows the open recording with this index.
    ShowRecording(usize),
    /// Shows the recording that is this many positions further in the list of open recordings; after the last one comes the first.
    StepRecording(i32),
    /// Closes the open recording with this index; `usize::MAX`: the one that is shown.
    CloseRecording(usize),
    /// Compares the shown volume with the next open recording; if there is none, with itself as it is now. Ends the comparison if there is one.
    Compare,
    /// Chooses how the compared volume is shown.
    CompareView(CompareView),
    /// Moves the line of the wipe to this share of the picture's width.
    MoveWipe(f64),
    /// Compares with a further open recording.
    CompareFurther,
    /// Moves the compared volume with this index as a drag over its picture does, from a pixel of it to another one. The flag is true if it turns.
    MoveCompared(usize, [[f64; 2]; 2], bool),
    /// Cuts or ties a link between the shown and the compared volumes.
    ToggleLink(Link),
    /// Moves the visible compared volumes rigidly onto the shown one. If they are aligned or about to be, moves them back to where their recordings
    /// say.
    Align,
    /// Stops reading the file that is being opened.
    CancelReading,
    /// Shows or hides the menu of export formats.
    Exports,
    /// Exports in the format with this index of the menu of export formats: the shown volume or, if the format is for them, the loop, the labels or a
    /// report.
    Export(usize),
    /// Cancels the export in progress.
    CancelExport,
    /// Shows or hides the list of presets.
    Presets,
    /// Applies the preset with this index of the list: first the built-in ones, then the user's.
    Preset(usize),
    /// Starts to type the name of a new preset with the present settings.
    NamePreset,
    /// Starts to type a new name for the user's preset with this index.
    RenamePreset(usize),
    /// Saves the new preset under the name that was typed, or renames the preset.
    EndNaming,
    /// Deletes the user's preset with this index.
    DeletePreset(usize),
    /// Restores the user's presets as they were before the last change.
    RestorePresets,
    /// Freezes or unfreezes the live picture.
    Freeze,
    /// Steps so many volumes back (negative) or forward in the cine loop, and freezes.
    StepCine(i32),
    /// Shows the volume at this index of the cine loop (0 is the oldest), and freezes.
    SeekCine(usize),
    /// Freezes and starts to play the cine loop repeatedly, or stops it.
    PlayCine,
    /// Marks the shown volume as the first that is played; `true`: as the last.
    MarkCine(bool),
    /// Marks the volume at this index of the cine loop as the first that is played; `true`: as the last.
    TrimCine(usize, bool),
    /// Removes both marks, so that all volumes of the cine loop are played.
    WholeCine,
    /// Changes the speed of the cine loop by this number of steps.
    CineSpeed(i32),
    /// Plays the cine loop back and forth, or forwards only.
    BackAndForth(bool),
    SavePicture,
    /// Saves the volumes of the cine loop as a recording; if marks are set, only those between them.
    SaveLoop,
    ToggleHelp,
    /// Closes the hints of the first start.
    CloseHints,
    /// Shows or hides the search of all commands and controls.
    Find,
    /// Shows the slider with this index of [`super::sliders::SLIDERS`] in the inspector, and gives it the keyboard focus.
    ShowControl(usize),
    /// Starts to type the value of the slider with this index.
    TypeValue(usize),
    /// Chooses whether saved pictures have a bar of text below them with scale, depth, mode, time and origin.
    SavesBar(bool),
    /// Shows or hides the display of the times of passes.
    ToggleTimes,
    /// Shows or hides sliders and buttons.
    TogglePanels,
    /// Gives the keyboard focus to the panels, or back to the picture.
    FocusPanels,
    /// Shows this tab of the inspector.
    InspectorTab(InspectorTab),
    /// Shows the next tab of the inspector. An inspector that is a drawer is opened first, and closed after the last tab.
    NextTab,
    /// Opens or closes the inspector, in a window in which it is a drawer over the picture.
    ToggleDrawer,
    /// Turns moving the pointer by keys on or off.
    KeyboardPointer,
    ToggleFullScreen,
    /// Closes the list, question or panel that is open. If none is, ends what is in progress, or leaves full screen, or otherwise the program.
    Back,
    /// Leaves the program. If volumes or measurements would be lost, a question comes first. It has no effect in a kiosk.
    Exit,
    /// Saves what would be lost, and then leaves the program.
    SaveAndExit,
    /// Leaves the program without saving.
    Discard,
}

/// What a drag on the picture does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    #[default]
    Rotate,
    Light,
    /// Moves the faces of the region.
    Region,
    /// Moves a clip plane that faces the viewer.
    Clip,
    /// Draws the contour of a cut on a rendering.
    Cut,
    /// Removes tissue near the surface along the drag.
    Brush,
    /// Moves the planes on which sections are shown.
    Plane,
    /// Draws the line of a curved plane.
    Curve,
    /// Moves body marks, and the probe on them.
    BodyMark,
    /// Sets the points of a measurement.
    Measure(MeasureKind),
    /// Edits labels.
    Labels,
}

/// The tabs of the inspector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InspectorTab {
    /// Tools and views, if the window has no room for them at its edges.
    Tools,
    #[default]
    Look,
    Planes,
    Measure,
    Marks,
}

impl Command {
    /// True for commands that a drag or a held key sends repeatedly.
    pub(super) fn is_continuous(&self) -> bool {
        matches!(
            self,
            Command::Rotate(_)
                | Command::Roll(_)
                | Command::Zoom(_)
                | Command::Pan(_)
                | Command::MoveLight(_)
                | Command::MoveFace(..)
                | Command::MoveRegion(_)
                | Command::MoveStartHandle(..)
                | Command::MoveClip(_)
                | Command::StepPlane(_)
                | Command::MoveCrossing(_)
                | Command::RotatePlanes(_)
                | Command::MoveCurvePoint(..)
                | Command::SetSlider(..)
                | Command::StepSlider(..)
        )
    }

    /// True if this command continues the change that `last` began, so that one step of undo covers both.
    pub(super) fn continues(&self, last: &Command) -> bool {
        match (self, last) {
            (Command::SetSlider(a, _), Command::SetSlider(b, _)) => a == b,
            (Command::StepSlider(a, _), Command::StepSlider(b, _)) => a == b,
            (Command::MoveFace(a, _), Command::MoveFace(b, _)) => a == b,
            (Command::MoveCurvePoint(a, _), Command::MoveCurvePoint(b, _)) => a == b,
            (Command::MoveStartHandle(a, _), Command::MoveStartHandle(b, _)) => a == b,
            (Command::ChangeBodyMark(a, mark), Command::ChangeBodyMark(b, other)) => {
                (a, mark.body, mark.mirrored) == (b, other.body, other.mirrored)
            }
            (Command::MovePoint(a, point, _), Command::MovePoint(b, other, _)) => (a, point) == (b, other),
            (Command::Type(_) | Command::Untype, Command::Type(_) | Command::Untype) => true,
            // Fingers move, turn and zoom at once.
            (
                Command::Zoom(_) | Command::Roll(_) | Command::Pan(_),
                Command::Zoom(_) | Command::Roll(_) | Command::Pan(_),
            ) => true,
            _ => self.is_continuous() && std::mem::discriminant(self) == std::mem::discriminant(last),
        }
    }
}

/// A key combination, its command and its description.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binding {
    pub key: Key,
    pub modifiers: Modifiers,
    pub(super) description: &'static str,
    pub command: Command,
    /// True if the command repeats while the key is held.
    pub(super) repeats: bool,
}

const NONE: Modifiers = Modifiers { shift: false, control: false, alt: false };
const SHIFT: Modifiers = Modifiers { shift: true, ..NONE };

const fn on(key: Key, description: &'static str, command: Command) -> Binding {
    Binding { key, modifiers: NONE, description, command, repeats: false }
}

/// With control.
const fn control(key: Key, description: &'static str, command: Command) -> Binding {
    Binding { modifiers: Modifiers { control: true, ..NONE }, ..on(key, description, command) }
}

/// With shift.
const fn shift(key: Key, description: &'static str, command: Command) -> Binding {
    Binding { modifiers: SHIFT, ..on(key, description, command) }
}

impl Binding {
    const fn repeating(self) -> Binding {
        Binding { repeats: true, ..self }
    }
}

/// A distance beyond any volume, mm.
const BEYOND_ANY_VOLUME_MM: f64 = 1e5;

/// All key bindings, in groups. Consecutive bindings with the same description share a line of the help.
pub const KEY_BINDINGS: &[Binding] = &[
    on(Char('1'), keys::SURFACE, Command::Mode(Mode::Surface)),
    on(Char('2'), keys::VOLUME, Command::Mode(Mode::Volume)),
    on(Char('3'), keys::MIXED, Command::Mode(Mode::Mixed)),
    on(Char('4'), keys::MIP, Command::Mode(Mode::Mip)),
    on(Char('5'), keys::MINIP, Command::Mode(Mode::MinIp)),
    on(Char('6'), keys::X_RAY, Command::Mode(Mode::Mean)),
    on(Char('7'), keys::ONE_PLANE, Command::Mode(Mode::Plane)),
    on(Char('8'), keys::THREE_PLANES, Command::Mode(Mode::Orthogonal)),
    on(Char('9'), keys::TOMOGRAPHY, Command::Mode(Mode::Tomography)),
    on(Char('0'), keys::CUBE, Command::Mode(Mode::Cube)),
    on(Key::Tab, keys::LAYOUT_FOUR, Command::Layout(Layout::Four)),
    on(Function(4), keys::LAYOUT_FOUR, Command::Layout(Layout::Four)),
    shift(Char('v'), keys::LAYOUT_BESIDE, Command::Layout(Layout::Beside)),
    on(Char('v'), keys::LAYOUT_PAIR, Command::Layout(Layout::Pair)),
    shift(Key::Tab, keys::LAYOUT_SINGLE, Command::Layout(Layout::Single)),
    shift(Function(4), keys::LAYOUT_SINGLE, Command::Layout(Layout::Single)),
    // What a drag does.
    on(Char('t'), keys::DRAG_ROTATES, Command::Tool(Tool::Rotate)),
    on(Char('l'), keys::DRAG_MOVES_LIGHT, Command::Tool(Tool::Light)),
    on(Char('g'), keys::DRAG_MOVES_REGION, Command::Tool(Tool::Region)),
    shift(Char('g'), keys::BEND_START_LINE, Command::ToggleStartCurve),
    on(Char('x'), keys::DRAG_CLIPS, Command::Tool(Tool::Clip)),
    on(Char('s'), keys::DRAG_MOVES_PLANES, Command::Tool(Tool::Plane)),
    on(Char('f'), keys::DRAG_CUTS, Command::Tool(Tool::Cut)),
    on(Char('z'), keys::DRAG_BRUSHES, Command::Tool(Tool::Brush)),
    shift(Char('f'), keys::REMOVE_ALL_CUTS, Command::ClearCuts),
    shift(Char('x'), keys::NO_CLIP, Command::MoveClip(-BEYOND_ANY_VOLUME_MM)),
    // The view.
    shift(Key::Left, keys::ROTATE, Command::Rotate([-5.0, 0.0])).repeating(),
    shift(Key::Right, keys::ROTATE, Command::Rotate([5.0, 0.0])).repeating(),
    shift(Key::Up, keys::ROTATE, Command::Rotate([0.0, 5.0])).repeating(),
    shift(Key::Down, keys::ROTATE, Command::Rotate([0.0, -5.0])).repeating(),
    control(Char('1'), keys::FROM_THE_FRONT, Command::LookFrom(Viewpoint::Front)),
    control(Char('2'), keys::FROM_THE_LEFT, Command::LookFrom(Viewpoint::Left)),
    control(Char('3'), keys::FROM_THE_RIGHT, Command::LookFrom(Viewpoint::Right)),
    control(Char('4'), keys::FROM_THE_TOP, Command::LookFrom(Viewpoint::Top)),
    shift(Char('t'), keys::TURNTABLE, Command::Turntable),
    on(Char(','), keys::ROLL, Command::Roll(-5.0)).repeating(),
    on(Char('.'), keys::ROLL, Command::Roll(5.0)).repeating(),
    on(Char('+'), keys::CLOSER, Command::Zoom(1.1)).repeating(),
    on(Char('='), keys::CLOSER, Command::Zoom(1.1)).repeating(),
    on(Char('-'), keys::FARTHER, Command::Zoom(1.0 / 1.1)).repeating(),
    on(Key::Backspace, keys::RESET_ALL_SETTINGS, Command::Reset),
    control(Char('z'), keys::UNDO, Command::Undo),
    Binding {
        modifiers: Modifiers { control: true, alt: true, shift: false },
        ..on(Char('z'), keys::UNDO_ALL, Command::UndoAll)
    },
    control(Char('y'), keys::REDO, Command::Redo),
    Binding {
        modifiers: Modifiers { control: true, shift: true, alt: false },
        ..on(Char('z'), keys::REDO, Command::Redo)
    },
    // Planes.
    on(Char('a'), keys::PLANE_A, Command::Plane(PlaneName::A)),
    on(Char('b'), keys::PLANE_B, Command::Plane(PlaneName::B)),
    on(Char('c'), keys::PLANE_C, Command::Plane(PlaneName::C)),
    on(Key::PageUp, keys::STEP_PLANE, Command::StepPlane(-1.0)).repeating(),
    on(Key::PageDown, keys::STEP_PLANE, Command::StepPlane(1.0)).repeating(),
    shift(Key::PageUp, keys::STEP_PLANE_FAR, Command::StepPlane(-5.0)).repeating(),
    shift(Key::PageDown, keys::STEP_PLANE_FAR, Command::StepPlane(5.0)).repeating(),
    on(Char('j'), keys::RECENTRE, Command::Recentre),
    shift(Char('c'), keys::CURVED_PLANE, Command::Tool(Tool::Curve)),
    shift(Key::Delete, keys::REMOVE_CURVED_PLANE, Command::ClearCurve),
    // Measuring.
    on(Char('m'), keys::CALIPER, Command::Tool(Tool::Measure(MeasureKind::Distance))),
    on(Char('n'), keys::ANGLE, Command::Tool(Tool::Measure(MeasureKind::Angle))),
    on(Char('e'), keys::ELLIPSE, Command::Tool(Tool::Measure(MeasureKind::Ellipse))),
    on(Char('o'), keys::TRACE, Command::Tool(Tool::Measure(MeasureKind::Trace))),
    on(Char('u'), keys::DISTANCE_ON_THE_SURFACE, Command::Tool(Tool::Measure(MeasureKind::Surface))),
    on(Char('w'), keys::VOLUME_BY_CONTOURS, Command::Tool(Tool::Measure(MeasureKind::Volume))),
    on(Char('k'), keys::AUTOMATIC_VOLUME, Command::MeasureBody),
    on(Char('i'), keys::TEXT, Command::Tool(Tool::Measure(MeasureKind::Text))),
    on(Char('y'), keys::ARROW, Command::Tool(Tool::Measure(MeasureKind::Arrow))),
    shift(Char('l'), keys::LABELS, Command::Tool(Tool::Labels)),
    shift(Char('b'), keys::BODY_MARK, Command::Tool(Tool::BodyMark)),
    on(Key::Delete, keys::DELETE_LAST_MEASUREMENT, Command::DeleteMeasure(usize::MAX)),
    control(Char('c'), keys::COPY_RESULTS, Command::CopyMeasures),
    // The look.
    on(Key::Up, keys::THRESHOLD, Command::StepSlider(THRESHOLD, 1)).repeating(),
    on(Key::Down, keys::THRESHOLD, Command::StepSlider(THRESHOLD, -1)).repeating(),
    on(Char('['), keys::GAIN, Command::StepSlider(GAIN, -1)).repeating(),
    on(Char(']'), keys::GAIN, Command::StepSlider(GAIN, 1)).repeating(),
    on(Char('d'), keys::SHADOW, Command::Shadow(true)),
    shift(Char('d'), keys::NO_SHADOW, Command::Shadow(false)),
    on(Function(5), keys::VOLUME_IN_GREY, Command::Transfer(TransferName::Grey)),
    on(Function(6), keys::VOLUME_IN_SEPIA, Command::Transfer(TransferName::Sepia)),
    on(Function(7), keys::VOLUME_AS_SKIN, Command::Transfer(TransferName::Skin)),
    on(Function(8), keys::VOLUME_AS_BONE, Command::Transfer(TransferName::Bone)),
    on(Function(9), keys::VOLUME_COOL, Command::Transfer(TransferName::Cool)),
    on(Function(10), keys::VOLUME_WARM, Command::Transfer(TransferName::Warm)),
    shift(Function(5), keys::PICTURE_IN_GREY, Command::ColourMap(ColourMap::Grey)),
    shift(Function(6), keys::PICTURE_IN_SEPIA, Command::ColourMap(ColourMap::Sepia)),
    shift(Function(7), keys::PICTURE_AS_SKIN, Command::ColourMap(ColourMap::Skin)),
    shift(Function(8), keys::PICTURE_IN_ICE, Command::ColourMap(ColourMap::Ice)),
    shift(Function(9), keys::PICTURE_AS_IS, Command::ColourMap(ColourMap::None)),
    // Time. The caller limits the index to the volumes that it has.
    on(Key::Space, keys::FREEZE, Command::Freeze),
    on(Key::Left, keys::STEP_LOOP, Command::StepCine(-1)).repeating(),
    on(Key::Right, keys::STEP_LOOP, Command::StepCine(1)).repeating(),
    on(Key::Home, keys::OLDEST_VOLUME, Command::SeekCine(0)),
    on(Key::End, keys::NEWEST_VOLUME, Command::SeekCine(usize::MAX)),
    on(Key::Enter, keys::PLAY_THE_CINE_LOOP, Command::PlayCine),
    shift(Key::Home, keys::MARK_LOOP, Command::MarkCine(false)),
    shift(Key::End, keys::MARK_LOOP, Command::MarkCine(true)),
    control(Key::Home, keys::THE_COMPLETE_LOOP, Command::WholeCine),
    control(Key::Left, keys::LOOP_SPEED, Command::CineSpeed(-1)),
    control(Key::Right, keys::LOOP_SPEED, Command::CineSpeed(1)),
    shift(Key::Enter, keys::LOOP_BACK_AND_FORTH, Command::BackAndForth(true)),
    control(Key::Enter, keys::LOOP_FORWARDS, Command::BackAndForth(false)),
    // What writes a file needs Ctrl: a letter that was meant for a text writes nothing.
    control(Char('i'), keys::SAVE_THE_PICTURE, Command::SavePicture),
    control(Char('r'), keys::SAVE_THE_RECORDING, Command::SaveLoop),
    control(Char('s'), keys::SAVE_WORKSPACE, Command::SaveWorkspace),
    control(Char('o'), keys::OPEN, Command::OpenFiles),
    control(Key::PageUp, keys::STEP_RECORDING, Command::StepRecording(-1)),
    control(Key::PageDown, keys::STEP_RECORDING, Command::StepRecording(1)),
    on(Char('p'), keys::COMPARE, Command::Compare),
    control(Char('w'), keys::CLOSE_RECORDING, Command::CloseRecording(usize::MAX)),
    control(Char('e'), keys::EXPORT_THE_VOLUME, Command::Exports),
    control(Char('p'), keys::PRESETS, Command::Presets),
    // The screen.
    on(Char('h'), keys::THIS_HELP, Command::ToggleHelp),
    on(Function(1), keys::THIS_HELP, Command::ToggleHelp),
    on(Char('/'), keys::FIND, Command::Find),
    control(Char('k'), keys::FIND, Command::Find),
    on(Function(2), keys::TIMES_OF_THE_PASSES, Command::ToggleTimes),
    on(Function(3), keys::SLIDERS, Command::TogglePanels),
    shift(Function(3), keys::NEXT_TAB, Command::NextTab),
    control(Key::Tab, keys::FOCUS_PANELS, Command::FocusPanels),
    shift(Char('m'), keys::KEYBOARD_POINTER, Command::KeyboardPointer),
    on(Function(11), keys::FULL_SCREEN, Command::ToggleFullScreen),
    on(Key::Escape, keys::BACK, Command::Back),
    on(Char('q'), keys::QUIT, Command::Exit),
];

/// The binding of a key pressed with these modifiers; None if there is none.
pub(super) fn binding(key: Key, modifiers: Modifiers) -> Option<&'static Binding> {
    // Whether a sign needs shift depends on the keyboard layout.
    let is_sign = matches!(key, Char(c) if !c.is_alphanumeric());
    let modifiers = Modifiers { shift: modifiers.shift && !is_sign, ..modifiers };
    KEY_BINDINGS.iter().find(|b| b.key == key && b.modifiers == modifiers)
}

/// The command of a key with these modifiers.
#[cfg(test)]
fn command(key: Key, modifiers: Modifiers) -> Option<Command> {
    binding(key, modifiers).map(|b| b.command)
}

/// The lines of the help: key names, such as "Shift+Left, Shift+Right", and the description, in the order of [`KEY_BINDINGS`].
pub(super) fn help() -> impl Iterator<Item = (String, &'static str)> {
    KEY_BINDINGS.chunk_by(|a, b| a.description == b.description).filter_map(|same| {
        let keys: Vec<String> = same.iter().map(key_label).collect();
        Some((keys.join(", "), same.first()?.description))
    })
}

pub(super) fn key_label(binding: &Binding) -> String {
    let Modifiers { shift, control, alt } = binding.modifiers;
    let held = [(control, keys::CTRL), (alt, keys::ALT), (shift, keys::SHIFT)];
    let held: String = held.iter().filter(|(is_held, _)| *is_held).map(|(_, name)| *name).collect();
    let key = match binding.key {
        Char(c) => c.to_uppercase().to_string(),
        Function(n) => format!("F{n}"),
        Key::PageUp => keys::PAGE_UP.into(),
        Key::PageDown => keys::PAGE_DOWN.into(),
        other => format!("{other:?}"),
    };
    held + &key
}

/// The keys that are held down, so that a command that toggles something is not repeated.
#[derive(Clone, Debug, Default)]
pub(super) struct HeldKeys {
    modifiers: Modifiers,
    held: Vec<Key>,
}

impl HeldKeys {
    pub(super) fn modifiers(&self) -> Modifiers {
        self.modifiers
    }

    pub(super) fn is_held(&self, key: Key) -> bool {
        self.held.contains(&key)
    }

    /// The command that an input of the keyboard gives; None if it gives none.
    pub(super) fn input(&mut self, input: &Input) -> Option<Command> {
        match *input {
            Input::Modifiers(modifiers) => self.modifiers = modifiers,
            Input::FocusLost => *self = HeldKeys::default(),
            Input::Key { key, pressed: false } => self.held.retain(|held| *held != key),
            Input::Key { key, pressed: true } => {
                let again = self.held.contains(&key);
                if !again {
                    self.held.push(key);
                }
                return binding(key, self.modifiers).filter(|b| b.repeats || !again).map(|b| b.command);
            }
            _ => {}
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_is_bound_twice() {
        for (i, a) in KEY_BINDINGS.iter().enumerate() {
            assert!(
                !KEY_BINDINGS[..i].iter().any(|b| (b.key, b.modifiers) == (a.key, a.modifiers)),
                "{}",
                key_label(a)
            );
            assert_eq!(command(a.key, a.modifiers), Some(a.command), "{} cannot be reached", key_label(a));
        }
    }

    /// Prevents files that someone writes who meant to type a text.
    #[test]
    fn no_letter_alone_writes_a_file() {
        let writes = [Command::SavePicture, Command::SaveLoop, Command::SaveMeasures, Command::SaveWorkspace];
        let bound: Vec<_> = KEY_BINDINGS.iter().filter(|b| writes.contains(&b.command)).collect();
        assert!(bound.len() >= 3 && bound.iter().all(|b| b.modifiers.control), "{bound:?}");
    }

    #[test]
    fn every_mode_layout_tool_and_plane_has_a_key() {
        use Mode::*;
        let modes = [Volume, Surface, Mixed, Mip, MinIp, Mean, Plane, Orthogonal, Tomography, Cube].map(Command::Mode);
        let tools = [
            Tool::Rotate,
            Tool::Light,
            Tool::Region,
            Tool::Clip,
            Tool::Cut,
            Tool::Brush,
            Tool::Plane,
            Tool::Curve,
            Tool::BodyMark,
            Tool::Labels,
        ]
        .map(Command::Tool);
        let layouts = [Layout::Single, Layout::Four, Layout::Beside, Layout::Pair].map(Command::Layout);
        let planes = [PlaneName::A, PlaneName::B, PlaneName::C].map(Command::Plane);
        for command in modes.iter().chain(&tools).chain(&layouts).chain(&planes) {
            assert!(KEY_BINDINGS.iter().any(|b| b.command == *command), "{command:?}");
        }
    }

    #[test]
    fn the_help_has_a_line_for_every_command() {
        let lines: Vec<_> = help().collect();
        assert!(lines.contains(&("H, F1".into(), "this help")));
        assert!(lines.contains(&("Shift+X".into(), "nothing cut from the front")));
        let mut descriptions: Vec<_> = lines.iter().map(|(_, description)| description).collect();
        descriptions.sort();
        assert!(descriptions.windows(2).all(|w| w[0] != w[1]), "the same description in two places");
    }

    #[test]
    fn a_held_key_repeats_only_if_its_binding_says_so() {
        let mut keys = HeldKeys::default();
        let mut press = |key, pressed| keys.input(&Input::Key { key, pressed });
        assert_eq!(press(Key::Space, true), Some(Command::Freeze));
        assert_eq!(press(Key::Space, true), None);
        assert_eq!(press(Key::Space, false), None);
        assert_eq!(press(Key::Space, true), Some(Command::Freeze));
        assert_eq!(press(Key::Right, true), Some(Command::StepCine(1)));
        assert_eq!(press(Key::Right, true), Some(Command::StepCine(1)));
        keys.input(&Input::Modifiers(Modifiers { shift: true, ..Modifiers::default() }));
        let sign = Input::Key { key: Char('+'), pressed: true };
        assert_eq!(keys.input(&sign), Some(Command::Zoom(1.1)));
    }
}
