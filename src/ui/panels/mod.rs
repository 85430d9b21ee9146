//! Panels around and over the picture, laid out by egui: what they show comes in as [`Facts`], what is asked of them goes out as
//! commands. Their places follow from the size of the window alone, so that the picture's size is known before anything is drawn.

mod arrow;
mod bar;
mod column;
mod hands;
mod help;
mod hud;
mod marks;
mod notes;
mod rail;
mod theme;

pub use notes::{Banner, Note};

use super::command::Command;
use super::controls::Controls;
use super::input::Input;
use super::times::Times;
use crate::gpu;
use crate::scene::Scene;
use egui::{Rect, pos2, vec2};
use std::time::Duration;

/// Points: of the buttons on the left, the sliders on the right, the cine loop below.
const RAIL: f32 = 208.0;
const COLUMN: f32 = 330.0;
const BAR: f32 = 76.0;
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

/// What became of laying them out.
pub struct Laid {
    pub panels: gpu::window::Panels,
    pub commands: Vec<Command>,
    /// When they look different again without anything happening.
    pub again: Duration,
}

/// The panels of one window.
pub struct Panels {
    context: egui::Context,
    hands: hands::Hands,
    /// Pixels a point.
    scale: f32,
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

impl Panels {
    /// `scale`: pixels a point; above 1 everything is larger.
    pub fn new(scale: f32) -> Panels {
        let context = egui::Context::default();
        theme::dress(&context);
        Panels { context, hands: hands::Hands::default(), scale: scale.clamp(0.5, 4.0) }
    }

    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// The device that held their images is gone: everything will be told again.
    pub fn renew(&mut self) {
        *self = Panels::new(self.scale);
    }

    pub fn input(&mut self, input: &Input) {
        self.hands.input(input, self.scale);
    }

    /// Whether a press there is theirs: something of them lies over the picture.
    pub fn covers(&self, at: [f64; 2]) -> bool {
        let point = pos2(at[0] as f32 / self.scale, at[1] as f32 / self.scale);
        self.context.layer_id_at(point).is_some_and(|layer| layer.order != egui::Order::Background)
    }

    /// Whether they have been told of something that they did not show yet.
    pub fn is_waiting(&self) -> bool {
        self.hands.is_waiting()
    }

    /// Lays them out on a window of this size, pixels, at a time, s.
    pub fn lay_out(&mut self, facts: &Facts, size: [u32; 2], time: f64) -> Laid {
        let (events, modifiers) = self.hands.take();
        let points = vec2(size[0] as f32, size[1] as f32) / self.scale;
        let mut input = egui::RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), points)),
            time: Some(time),
            events,
            ..Default::default()
        };
        // An event of any kind has egui lay out once more.
        if !input.events.is_empty() {
            input.events.insert(0, egui::Event::ModifiersChanged(modifiers));
        }
        if let Some(viewport) = input.viewports.get_mut(&egui::ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(self.scale);
        }
        let mut commands = Vec::new();
        let output = self.context.run_ui(input, |ui| {
            commands.clear();
            let ask = &mut |command| commands.push(command);
            let is_panelled = facts.is_panelled && facts.picture.1 != size;
            if is_panelled {
                bar::show(ui, facts, ask);
                rail::show(ui, facts, ask);
                column::show(ui, facts, ask);
            }
            if facts.is_drawn && facts.is_panelled {
                marks::paint(ui, facts, self.scale);
            }
            if facts.hud {
                hud::show(ui, facts, self.scale);
            }
            notes::show(ui, facts, self.scale);
            if facts.help {
                help::show(ui, facts, ask);
            }
            arrow::paint(ui, facts, self.scale);
        });
        let again = output.viewport_output.values().map(|v| v.repaint_delay).min().unwrap_or(Duration::MAX);
        let shapes = self.context.tessellate(output.shapes, output.pixels_per_point);
        let panels = gpu::window::Panels { shapes, textures: output.textures_delta, scale: output.pixels_per_point };
        Laid { panels, commands, again }
    }
}

/// The picture's place in points.
fn rect(facts: &Facts, scale: f32) -> Rect {
    let ([x, y], [w, h]) = facts.picture;
    let [x, y, w, h] = [x, y, w, h].map(|n| n as f32 / scale);
    Rect::from_min_size(pos2(x, y), vec2(w, h))
}
