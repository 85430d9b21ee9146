//! What the panels show, and where they and the picture are in the window.

use crate::scene::Scene;
use crate::ui::controls::Controls;
use crate::ui::times::Times;
use egui::{Rect, pos2, vec2};
use std::time::Duration;

/// Points: of the buttons on the left, the sliders on the right, the cine loop below.
pub const RAIL: f32 = 208.0;
pub const COLUMN: f32 = 330.0;
pub const BAR: f32 = 76.0;
/// Below this the window shows the picture alone, whatever is asked for.
const LEAST: [f32; 2] = [760.0, 420.0];

/// What panels show.
pub struct Facts<'a> {
    pub controls: &'a Controls,
    pub scene: Option<&'a Scene>,
    pub times: &'a Times,
    /// Upper left corner and size of the picture, pixels.
    pub picture: ([u32; 2], [u32; 2]),
    pub is_panelled: bool,
    pub help: bool,
    pub hud: bool,
    pub is_frozen: bool,
    pub is_playing: bool,
    /// Volumes in the cine loop, and the place of the one that is shown.
    pub cine: (usize, Option<usize>),
    /// A picture has been drawn.
    pub is_drawn: bool,
    /// The dials that the view stands on, and its budget.
    pub quality: &'a str,
    pub budget: Option<Duration>,
    pub banner: Option<Banner>,
    pub notes: &'a [Note],
    /// Keys that are said in the help besides those of the table.
    pub exit_key: &'a str,
    /// Where a pointer is drawn, pixels of the window: none where a windowing system has its own.
    pub pointer: Option<[f64; 2]>,
}

/// Something that lasts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Banner {
    pub title: String,
    pub text: String,
    pub is_fault: bool,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    pub text: String,
    pub is_fault: bool,
}

/// Where the picture lies on a window of this size: its upper left corner and its size, pixels.
pub fn place(size: [u32; 2], scale: f32, is_panelled: bool) -> ([u32; 2], [u32; 2]) {
    let points = size.map(|n| n as f32 / scale);
    if !is_panelled || points[0] < LEAST[0] || points[1] < LEAST[1] {
        return ([0, 0], size.map(|n| n.max(1)));
    }
    let [left, right, below] = [RAIL, COLUMN, BAR].map(|edge| (edge * scale).round() as u32);
    ([left, 0], [(size[0] - left - right).max(1), (size[1] - below).max(1)])
}

/// The picture's place in points.
pub fn rect(facts: &Facts, scale: f32) -> Rect {
    let ([x, y], [w, h]) = facts.picture;
    let [x, y, w, h] = [x, y, w, h].map(|n| n as f32 / scale);
    Rect::from_min_size(pos2(x, y), vec2(w, h))
}
