//! What hands do, as egui is told of it.

use super::super::input::{Button, Input, Modifiers, Phase};
use egui::{Event, Modifiers as Held, MouseWheelUnit, PointerButton, Pos2, TouchPhase, pos2, vec2};

/// Between our inputs and egui's events: places in points, and fingers that press like a pointer.
#[derive(Default)]
pub struct Hands {
    events: Vec<Event>,
    pointer: Pos2,
    held: Held,
    /// The finger that is taken for the pointer.
    finger: Option<u64>,
}

impl Hands {
    /// `scale`: pixels a point.
    pub fn input(&mut self, input: &Input, scale: f32) {
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
    pub fn is_waiting(&self) -> bool {
        !self.events.is_empty()
    }

    pub fn take(&mut self) -> (Vec<Event>, Held) {
        (std::mem::take(&mut self.events), self.held)
    }
}
