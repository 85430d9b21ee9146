//! What a sonographer may ask for, however: by hand on the picture, a key, or a panel.

use crate::scene::{ColourMap, Layout, Mode, PlaneName, TransferName};

/// One wish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    Mode(Mode),
    Layout(Layout),
    /// What a drag on the picture does from here on.
    Tool(Tool),
    /// Turns the view, deg: towards +lateral, towards +elevation.
    Turn([f64; 2]),
    /// Turns the picture clockwise, deg.
    Roll(f64),
    /// Times this close; above 1 is closer.
    Zoom(f64),
    /// Moves what is seen, shares of the picture's height: right, down.
    Pan([f64; 2]),
    /// Moves the light as if it hung on a dome over the surface, shares of the picture's height: right, down.
    Light([f64; 2]),
    /// Moves a face of the region, mm outwards.
    Face(Face, f64),
    /// Cuts away what is nearer to the viewer: mm further into the volume; less than nothing takes the plane back.
    Clip(f64),
    /// The plane that is shown alone, stepped, and moved.
    Plane(PlaneName),
    /// Moves that plane along its normal, mm.
    PlaneBy(f64),
    /// The place where the three planes meet: lateral, depth, elevation, mm.
    Meet([f64; 3]),
    /// Turns the planes, deg: azimuth, tilt.
    PlaneTurn([f64; 2]),
    /// A slider, by its place in [`super::sliders::SLIDERS`], to a value.
    Slide(usize, f64),
    /// The same by so many of its steps.
    Nudge(usize, i32),
    Transfer(TransferName),
    ColourMap(ColourMap),
    Shadow(bool),
    /// Everything as it was at the start, but for what is frozen.
    Reset,
    /// Stops and goes on.
    Freeze,
    /// So many volumes back (less than 0) or forth; freezes.
    Cine(i32),
    /// The volume that was kept at this place, 0 the oldest; freezes.
    CineAt(usize),
    /// Plays what is kept over and over.
    CinePlay,
    SavePicture,
    /// The volumes that are kept, as a recording.
    SaveLoop,
    Help,
    /// The times of every pass.
    Hud,
    /// Sliders and buttons.
    Panels,
    FullScreen,
    Exit,
}

/// What a drag on the picture does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    #[default]
    Turn,
    Light,
    /// The faces of the region.
    Region,
    /// A plane across the view that cuts away what is nearer.
    Clip,
    /// The planes of sections.
    Plane,
}

/// A face of the region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// 0 lateral, 1 depth, 2 elevation.
    pub axis: usize,
    /// The one at the higher end.
    pub high: bool,
}
