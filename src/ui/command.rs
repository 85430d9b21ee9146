//! The commands of a user. Gestures on the picture, keys and panels give them.

use crate::scene::{ColourMap, Layout, Mode, PlaneName, TransferName};

/// One command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    Mode(Mode),
    Layout(Layout),
    /// Selects what a drag on the picture does.
    Tool(Tool),
    /// Rotates the camera, degrees: azimuth (towards +lateral), elevation (towards +elevation).
    Rotate([f64; 2]),
    /// Rotates the picture clockwise, degrees.
    Roll(f64),
    /// Multiplies the zoom; above 1 is closer.
    Zoom(f64),
    /// Moves what is shown, as fractions of the picture's height: right, down.
    Pan([f64; 2]),
    /// Moves the light over a dome above the surface, as fractions of the picture's height: right, down.
    MoveLight([f64; 2]),
    /// Moves a face of the region outwards, mm.
    MoveFace(Face, f64),
    /// Moves the viewer's clip plane further into the volume, mm; negative values pull it back.
    MoveClip(f64),
    /// Selects the plane that is shown alone, stepped and moved.
    Plane(PlaneName),
    /// Moves the selected plane along its normal, mm.
    StepPlane(f64),
    /// Moves the point where the three planes cross: lateral, depth, elevation, mm.
    MoveCrossing([f64; 3]),
    /// Rotates the planes, degrees: azimuth, tilt.
    RotatePlanes([f64; 2]),
    /// Sets a slider, by its index in [`super::sliders::SLIDERS`], to a value.
    SetSlider(usize, f64),
    /// Moves a slider by a number of its steps.
    StepSlider(usize, i32),
    Transfer(TransferName),
    ColourMap(ColourMap),
    Shadow(bool),
    /// Restores all settings of the start. A frozen picture stays frozen.
    Reset,
    /// Freezes or unfreezes the live picture.
    Freeze,
    /// Steps so many volumes back (negative) or forward, and freezes.
    StepCine(i32),
    /// Shows the volume at this index of the cine loop (0 is the oldest), and freezes.
    SeekCine(usize),
    /// Plays the cine loop repeatedly, or stops it.
    PlayCine,
    SavePicture,
    /// Saves the volumes of the cine loop as a recording.
    SaveLoop,
    ToggleHelp,
    /// Shows or hides the times of the passes.
    ToggleTimes,
    /// Shows or hides sliders and buttons.
    TogglePanels,
    ToggleFullScreen,
    Exit,
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
    /// Moves the planes of sections.
    Plane,
}

/// A face of the region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// 0 lateral, 1 depth, 2 elevation.
    pub axis: usize,
    /// The face at the higher end of the axis.
    pub high: bool,
}
