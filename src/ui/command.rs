//! The commands of a user, given by gestures on the picture, keys and panels.

pub use super::comparison::{CompareView, Link};
pub use super::labelling::{Effect, LabelCommand};
pub use super::texts::keys::{Binding, KEY_BINDINGS};
pub use super::view::{Face, Viewpoint};

use crate::scene::{
    Body, BodyMark, ColourMap, KeptSide, Layout, MeasureKind, Mode, PlaneName, ProbeMarker, Sides, TransferName,
    VolumeAxis,
};

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
