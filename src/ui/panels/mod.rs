//! Panels around and over the picture, laid out by egui: what they show comes in as [`Facts`], what is asked of them goes out as
//! commands. Their places follow from the size of the window alone, so that the picture's size is known before anything is drawn.

mod annotations;
mod controls;
mod overlays;
mod state;
mod theme;

pub use state::{Banner, Facts, Note, place};

use super::command::Command;
use super::input::{Button, Input, Modifiers, Phase};
use crate::gpu;
use egui::{Event, Modifiers as Held, MouseWheelUnit, PointerButton, Pos2, Rect, TouchPhase, pos2, vec2};
use std::time::Duration;

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
    hands: Hands,
    /// Pixels a point.
    scale: f32,
}

impl Panels {
    /// `scale`: pixels a point; above 1 everything is larger.
    pub fn new(scale: f32) -> Panels {
        let context = egui::Context::default();
        theme::dress(&context);
        Panels { context, hands: Hands::default(), scale: scale.clamp(0.5, 4.0) }
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
            input.events.insert(0, Event::ModifiersChanged(modifiers));
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
                controls::show_cine_bar(ui, facts, ask);
                controls::show_modes(ui, facts, ask);
                controls::show_sliders(ui, facts, ask);
            }
            if facts.is_drawn && facts.is_panelled {
                annotations::paint(ui, facts, self.scale);
            }
            if facts.hud {
                overlays::show_times(ui, facts, self.scale);
            }
            overlays::show_notes(ui, facts, self.scale);
            if facts.help {
                overlays::show_help(ui, facts, ask);
            }
            overlays::paint_pointer(ui, facts, self.scale);
        });
        let again = output.viewport_output.values().map(|v| v.repaint_delay).min().unwrap_or(Duration::MAX);
        let shapes = self.context.tessellate(output.shapes, output.pixels_per_point);
        let panels = gpu::window::Panels { shapes, textures: output.textures_delta, scale: output.pixels_per_point };
        Laid { panels, commands, again }
    }
}

/// Between our inputs and egui's events: places in points, and fingers that press like a pointer.
#[derive(Default)]
struct Hands {
    events: Vec<Event>,
    pointer: Pos2,
    held: Held,
    /// The finger that is taken for the pointer.
    finger: Option<u64>,
}

impl Hands {
    /// `scale`: pixels a point.
    fn input(&mut self, input: &Input, scale: f32) {
        let at = |[x, y]: [f64; 2]| pos2(x as f32 / scale, y as f32 / scale);
        match *input {
            Input::Moved(place) => self.moved(at(place)),
            Input::Button { button, pressed } => self.button(button, pressed),
            Input::Scroll(notches) => self.events.push(Event::MouseWheel {
                unit: MouseWheelUnit::Line,
                delta: vec2(0.0, notches as f32),
                phase: TouchPhase::Move,
                modifiers: self.held,
            }),
            // Keys are the kiosk's own: no panel has a field to type into.
            Input::Key { .. } => {}
            Input::Modifiers(Modifiers { shift, control, alt }) => {
                self.held = Held { alt, ctrl: control, shift, mac_cmd: false, command: control };
            }
            Input::Touch { finger, phase, at: place } => self.touch(finger, phase, at(place)),
            Input::Left => {
                self.finger = None;
                self.events.push(Event::PointerGone);
            }
        }
    }

    fn moved(&mut self, to: Pos2) {
        self.pointer = to;
        self.events.push(Event::PointerMoved(to));
    }

    fn button(&mut self, button: Button, pressed: bool) {
        let button = match button {
            Button::Left => PointerButton::Primary,
            Button::Right => PointerButton::Secondary,
            Button::Middle => PointerButton::Middle,
        };
        self.events.push(Event::PointerButton { pos: self.pointer, button, pressed, modifiers: self.held });
    }

    fn touch(&mut self, finger: u64, phase: Phase, at: Pos2) {
        match phase {
            Phase::Down if self.finger.is_none() => {
                self.finger = Some(finger);
                self.moved(at);
                self.button(Button::Left, true);
            }
            _ if self.finger != Some(finger) => {}
            Phase::Down | Phase::Moved => self.moved(at),
            Phase::Up | Phase::Gone => {
                self.finger = None;
                // A finger that is taken for something else presses nothing.
                if phase == Phase::Up {
                    self.moved(at);
                    self.button(Button::Left, false);
                }
                self.events.push(Event::PointerGone);
            }
        }
    }

    /// Whether egui has not been told of something.
    fn is_waiting(&self) -> bool {
        !self.events.is_empty()
    }

    fn take(&mut self) -> (Vec<Event>, Held) {
        (std::mem::take(&mut self.events), self.held)
    }
}
