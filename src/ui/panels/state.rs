//! What the panels show, and where they and the picture are in the window.

use crate::scene::Scene;
use crate::ui::controls::Controls;
use crate::ui::times::Times;
use egui::{Rect, pos2, vec2};
use std::time::Duration;

/// Sizes of the panels, points: buttons on the left, sliders on the right, cine loop below.
pub const MODES_WIDTH: f32 = 208.0;
pub const SLIDERS_WIDTH: f32 = 330.0;
pub const CINE_BAR_HEIGHT: f32 = 76.0;
/// A smaller window shows the picture without panels, points.
const MIN_WINDOW: [f32; 2] = [760.0, 420.0];

/// What the panels show.
pub struct PanelState<'a> {
    pub controls: &'a Controls,
    pub scene: Option<&'a Scene>,
    pub times: &'a Times,
    /// Upper left corner and size of the picture, pixels.
    pub picture: ([u32; 2], [u32; 2]),
    pub shows_panels: bool,
    pub shows_help: bool,
    pub shows_times: bool,
    pub is_frozen: bool,
    pub is_playing: bool,
    /// Number of volumes in the cine loop, and the index of the one that is shown.
    pub cine: (usize, Option<usize>),
    /// True after the first picture.
    pub has_drawn: bool,
    /// The current rung of the quality ladder, and the frame budget.
    pub quality: &'a str,
    pub budget: Option<Duration>,
    pub banner: Option<Banner>,
    pub notes: &'a [Note],
    /// The keys that end the program, for the help.
    pub exit_key: &'a str,
    /// Where to draw a pointer, pixels of the window. None if the windowing system draws it.
    pub pointer: Option<[f64; 2]>,
}

/// A message that lasts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Banner {
    pub title: String,
    pub text: String,
    pub is_fault: bool,
}

/// A message about an event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    pub text: String,
    pub is_fault: bool,
}

/// The area that the panels leave for the picture in a window of this size: upper left corner and size, pixels.
pub fn picture_area(size: [u32; 2], scale: f32, shows_panels: bool) -> ([u32; 2], [u32; 2]) {
    let points = size.map(|n| n as f32 / scale);
    if !shows_panels || points[0] < MIN_WINDOW[0] || points[1] < MIN_WINDOW[1] {
        return ([0, 0], size.map(|n| n.max(1)));
    }
    let [left, right, below] = [MODES_WIDTH, SLIDERS_WIDTH, CINE_BAR_HEIGHT].map(|edge| (edge * scale).round() as u32);
    ([left, 0], [(size[0] - left - right).max(1), (size[1] - below).max(1)])
}

/// The area of the picture in points.
pub fn picture_rect(state: &PanelState, scale: f32) -> Rect {
    let ([x, y], [w, h]) = state.picture;
    let [x, y, w, h] = [x, y, w, h].map(|n| n as f32 / scale);
    Rect::from_min_size(pos2(x, y), vec2(w, h))
}
