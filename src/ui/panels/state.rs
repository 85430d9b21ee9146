//! What the panels show, and where they and the picture are in the window.

use crate::scene::Scene;
use crate::ui::controls::Controls;
use crate::ui::times::Times;
use egui::{Rect, pos2, vec2};
use std::time::Duration;

/// Sizes of the panels, points: buttons on the left, sliders on the right, cine loop below.
pub(crate) const MODES_WIDTH: f32 = 208.0;
pub(crate) const SLIDERS_WIDTH: f32 = 330.0;
pub(crate) const CINE_BAR_HEIGHT: f32 = 76.0;
/// A smaller window shows the picture without panels, points.
const MIN_WINDOW: [f32; 2] = [760.0, 420.0];

/// What the panels show.
pub(crate) struct PanelState<'a> {
    pub(crate) controls: &'a Controls,
    pub(crate) scene: Option<&'a Scene>,
    pub(crate) times: &'a Times,
    /// Upper left corner and size of the picture, pixels.
    pub(crate) picture: ([u32; 2], [u32; 2]),
    pub(crate) shows_panels: bool,
    pub(crate) shows_help: bool,
    pub(crate) shows_times: bool,
    pub(crate) is_frozen: bool,
    pub(crate) is_playing: bool,
    /// Number of volumes in the cine loop, and the index of the one that is shown.
    pub(crate) cine: (usize, Option<usize>),
    /// True after the first picture.
    pub(crate) has_drawn: bool,
    /// The current rung of the quality ladder, and the frame budget.
    pub(crate) quality: &'a str,
    pub(crate) budget: Option<Duration>,
    pub(crate) banner: Option<Banner>,
    pub(crate) notes: &'a [Note],
    /// The keys that end the program, for the help.
    pub(crate) exit_key: &'a str,
    /// Where to draw a pointer, pixels of the window. None if the windowing system draws it.
    pub(crate) pointer: Option<[f64; 2]>,
}

/// A message that lasts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Banner {
    pub(crate) title: String,
    pub(crate) text: String,
    pub(crate) is_fault: bool,
}

/// A message about an event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Note {
    pub(crate) text: String,
    pub(crate) is_fault: bool,
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
pub(crate) fn picture_rect(state: &PanelState, scale: f32) -> Rect {
    let ([x, y], [w, h]) = state.picture;
    let [x, y, w, h] = [x, y, w, h].map(|n| n as f32 / scale);
    Rect::from_min_size(pos2(x, y), vec2(w, h))
}
