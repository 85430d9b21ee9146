//! The panels around and over the picture, laid out by egui. They show a [`PanelState`] and return commands. Their positions depend only on
//! the size of the window, so that the size of the picture is known before anything is drawn.

mod annotations;
mod controls;
mod overlays;
mod state;
mod theme;

pub use state::picture_area;
pub(super) use state::{Banner, Note, PanelState};

use super::command::Command;
use super::input::{Button, Input, Modifiers, Phase};
use crate::gpu;
use egui::{Event, Modifiers as EguiModifiers, MouseWheelUnit, PointerButton, Pos2, Rect, TouchPhase, pos2, vec2};
use std::time::Duration;

/// The result of a layout.
pub(super) struct PanelOutput {
    pub(super) panels: gpu::window::Panels,
    pub(super) commands: Vec<Command>,
    /// When the panels need another layout without an event.
    pub(super) repaint_after: Duration,
}

/// The panels of one window.
pub(super) struct Panels {
    context: egui::Context,
    egui_input: EguiInput,
    /// Pixels per point.
    scale: f32,
}

impl Panels {
    /// `scale`: pixels per point, limited to 0.5..=4; above 1 everything is larger.
    pub(super) fn new(scale: f32) -> Panels {
        let context = egui::Context::default();
        theme::apply(&context);
        Panels { context, egui_input: EguiInput::default(), scale: scale.clamp(0.5, 4.0) }
    }

    pub(super) fn scale(&self) -> f32 {
        self.scale
    }

    /// Starts again after the device with the textures was lost: all textures are sent again.
    pub(super) fn reset(&mut self) {
        *self = Panels::new(self.scale);
    }

    pub(super) fn input(&mut self, input: &Input) {
        self.egui_input.input(input, self.scale);
    }

    /// True if a panel covers this position, pixels: a press there belongs to the panel.
    pub(super) fn covers(&self, at: [f64; 2]) -> bool {
        let point = pos2(at[0] as f32 / self.scale, at[1] as f32 / self.scale);
        self.context.layer_id_at(point).is_some_and(|layer| layer.order != egui::Order::Background)
    }

    /// True if there is input that no layout has handled yet.
    pub(super) fn has_pending_input(&self) -> bool {
        self.egui_input.has_pending_input()
    }

    /// Lays out the panels in a window of this size, pixels, at a time in s.
    pub(super) fn lay_out(&mut self, state: &PanelState, size: [u32; 2], time: f64) -> PanelOutput {
        let (events, modifiers) = self.egui_input.take();
        let points = vec2(size[0] as f32, size[1] as f32) / self.scale;
        let mut input = egui::RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), points)),
            time: Some(time),
            events,
            ..Default::default()
        };
        // Any event makes egui lay out twice, so the modifiers are sent only with other events.
        if !input.events.is_empty() {
            input.events.insert(0, Event::ModifiersChanged(modifiers));
        }
        if let Some(viewport) = input.viewports.get_mut(&egui::ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(self.scale);
        }
        let mut commands = Vec::new();
        let output = self.context.run_ui(input, |ui| {
            commands.clear();
            let execute = &mut |command| commands.push(command);
            let shows_panels = state.shows_panels && state.picture.1 != size;
            if shows_panels {
                controls::show_cine_bar(ui, state, execute);
                controls::show_modes(ui, state, execute);
                controls::show_sliders(ui, state, execute);
            }
            if state.has_drawn && state.shows_panels {
                annotations::paint(ui, state, self.scale);
            }
            if state.shows_times {
                overlays::show_times(ui, state, self.scale);
            }
            overlays::show_notes(ui, state, self.scale);
            if state.shows_help {
                overlays::show_help(ui, state, execute);
            }
            overlays::paint_pointer(ui, state, self.scale);
        });
        let repaint_after = output.viewport_output.values().map(|v| v.repaint_delay).min().unwrap_or(Duration::MAX);
        let shapes = self.context.tessellate(output.shapes, output.pixels_per_point);
        let panels = gpu::window::Panels { shapes, textures: output.textures_delta, scale: output.pixels_per_point };
        PanelOutput { panels, commands, repaint_after }
    }
}

/// Converts inputs to egui's events: positions in points, and one finger as the pointer.
#[derive(Default)]
struct EguiInput {
    events: Vec<Event>,
    pointer: Pos2,
    modifiers: EguiModifiers,
    /// The finger that acts as the pointer.
    finger: Option<u64>,
}

impl EguiInput {
    /// `scale`: pixels per point.
    fn input(&mut self, input: &Input, scale: f32) {
        let at = |[x, y]: [f64; 2]| pos2(x as f32 / scale, y as f32 / scale);
        match *input {
            Input::Moved(place) => self.moved(at(place)),
            Input::Button { button, pressed } => self.button(button, pressed),
            Input::Scroll(notches) => self.events.push(Event::MouseWheel {
                unit: MouseWheelUnit::Line,
                delta: vec2(0.0, notches as f32),
                phase: TouchPhase::Move,
                modifiers: self.modifiers,
            }),
            // Keys have their own bindings: no panel has a text field.
            Input::Key { .. } => {}
            Input::Modifiers(Modifiers { shift, control, alt }) => {
                self.modifiers = EguiModifiers { alt, ctrl: control, shift, mac_cmd: false, command: control };
            }
            Input::Touch { finger, phase, at: place } => self.touch(finger, phase, at(place)),
            Input::FocusLost => {
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
        self.events.push(Event::PointerButton { pos: self.pointer, button, pressed, modifiers: self.modifiers });
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
            Phase::Up | Phase::Cancelled => {
                self.finger = None;
                // A cancelled touch clicks nothing.
                if phase == Phase::Up {
                    self.moved(at);
                    self.button(Button::Left, false);
                }
                self.events.push(Event::PointerGone);
            }
        }
    }

    /// True if egui has not received all events.
    fn has_pending_input(&self) -> bool {
        !self.events.is_empty()
    }

    fn take(&mut self) -> (Vec<Event>, EguiModifiers) {
        (std::mem::take(&mut self.events), self.modifiers)
    }
}
