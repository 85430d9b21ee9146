//! Gestures on the picture: a mouse with three buttons and a wheel, or fingers. Known by nothing but what was done before.

use super::command::{Command, Tool};
use super::drag::Press;
use super::input::{Button, Input, Modifiers, Phase};
use super::picture::{Picture, Spot};
use super::sliders::PLANES_ZOOM;
use super::{touch, view};
use crate::scene::{Layout, Mode};
use std::time::Duration;

/// A press that moves less is a click, pixels of the window: of a mouse, and of a finger, which may wear a glove.
const SLOP: f64 = 6.0;
const FINGER_SLOP: f64 = 12.0;
/// Between the clicks of a double one.
const SOON: Duration = Duration::from_millis(400);
/// A notch of the wheel comes so many times closer, or goes so many mm deeper.
const NOTCH: f64 = 1.1;
const NOTCH_MM: f64 = 1.0;
/// Hands have fewer fingers.
const MOST_FINGERS: usize = 10;

#[derive(Clone, Debug, Default)]
pub struct Gestures {
    pointer: Option<[f64; 2]>,
    mouse: Option<(Button, Press)>,
    /// In the order in which they came down on the picture. The first two are a pair.
    fingers: Vec<Finger>,
    /// That of the only finger.
    finger: Option<Press>,
    /// Fingers that were several are no tap, up to the last of them.
    were_several: bool,
    clicked: Option<Click>,
    /// What leads back from a tile that is shown alone.
    back: Option<Command>,
}

#[derive(Clone, Copy, Debug)]
struct Finger {
    id: u64,
    at: [f64; 2],
    spot: Spot,
}

#[derive(Clone, Copy, Debug)]
struct Click {
    at: [f64; 2],
    when: Duration,
}

impl Gestures {
    /// What is asked for by what was done, in the order in which it is to be done. Keys are none of the hand's.
    pub fn input(&mut self, input: &Input, on: &Picture, tool: Tool, modifiers: Modifiers) -> Vec<Command> {
        let Some(input) = input.believed() else { return Vec::new() };
        match input {
            Input::Moved(at) => {
                self.pointer = Some(at);
                self.mouse.as_mut().and_then(|(_, press)| press.moved(at, on)).into_iter().collect()
            }
            Input::Button { button, pressed } => self.button(button, pressed, on, tool, modifiers),
            Input::Scroll(notches) => self.scrolled(notches, on, tool, modifiers),
            Input::Touch { finger, phase, at } => self.touched(finger, phase, at, on, tool),
            Input::Left => {
                // Which tile was left alone is no matter of what is held.
                *self = Gestures { back: self.back, ..Gestures::default() };
                Vec::new()
            }
            _ => Vec::new(),
        }
    }

    /// Where the pointer was last.
    pub fn pointer(&self) -> Option<[f64; 2]> {
        self.pointer
    }

    /// Whether something is being dragged: the view moves.
    pub fn is_busy(&self) -> bool {
        self.mouse.is_some() || !self.fingers.is_empty()
    }

    fn button(
        &mut self,
        button: Button,
        pressed: bool,
        on: &Picture,
        tool: Tool,
        modifiers: Modifiers,
    ) -> Vec<Command> {
        let holds = self.mouse.as_ref().map(|(holds, _)| *holds);
        match (pressed, self.pointer) {
            // A button that goes down twice was let go where nobody saw it.
            (true, Some(at)) if holds.is_none_or(|holds| holds == button) => {
                let press = if on.taken { None } else { Press::new(button, tool, modifiers, SLOP, at, on) };
                self.mouse = press.map(|press| (button, press));
                Vec::new()
            }
            (false, _) if holds == Some(button) => match self.mouse.take() {
                Some((Button::Left, press)) => self.let_go(&press, on, tool, SLOP),
                _ => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    fn scrolled(&mut self, notches: f64, on: &Picture, tool: Tool, modifiers: Modifiers) -> Vec<Command> {
        let (Some(at), Some(scene), false) = (self.pointer, on.scene, on.taken) else { return Vec::new() };
        let Some(spot) = on.spot(at) else { return Vec::new() };
        let times = NOTCH.powf(notches);
        match spot {
            Spot::Rendering if tool != Tool::Plane || modifiers.control || !scene.cuts_planes() => {
                vec![Command::Zoom(times)]
            }
            Spot::Plane(_) if modifiers.control && scene.is_flat() => vec![Command::Zoom(times)],
            Spot::Plane(_) if modifiers.control => {
                vec![Command::Slide(PLANES_ZOOM, scene.settings.planes.zoom * times)]
            }
            Spot::Plane(n) => on
                .name(n)
                .filter(|name| *name != scene.settings.planes.plane)
                .map(Command::Plane)
                .into_iter()
                .chain([Command::PlaneBy(notches * NOTCH_MM)])
                .collect(),
            Spot::Rendering => vec![Command::PlaneBy(notches * NOTCH_MM)],
        }
    }

    fn touched(&mut self, id: u64, phase: Phase, at: [f64; 2], on: &Picture, tool: Tool) -> Vec<Command> {
        let known = self.fingers.iter().position(|finger| finger.id == id);
        match (phase, known) {
            (Phase::Down, None) => {
                if let (Some(spot), false) = (on.spot(at), on.taken || self.fingers.len() >= MOST_FINGERS) {
                    self.fingers.push(Finger { id, at, spot });
                    self.hold(on, tool);
                }
                Vec::new()
            }
            (Phase::Moved | Phase::Down, Some(n)) => self.finger_moved(n, at, on),
            (Phase::Up | Phase::Gone, Some(n)) => {
                // Where it is lifted tells more of the finger's tip than of where it was.
                self.fingers.remove(n);
                let press = self.finger.take();
                let is_tap = self.fingers.is_empty() && phase == Phase::Up && !self.were_several;
                self.hold(on, tool);
                press.filter(|_| is_tap).map_or(Vec::new(), |press| self.let_go(&press, on, tool, FINGER_SLOP))
            }
            (_, None) => Vec::new(),
        }
    }

    /// The only finger holds as a left button does, from where it is now; several hold nothing but one another.
    fn hold(&mut self, on: &Picture, tool: Tool) {
        self.finger = match self.fingers[..] {
            [finger] => Press::new(Button::Left, tool, Modifiers::default(), FINGER_SLOP, finger.at, on),
            _ => None,
        };
        self.were_several = self.fingers.len() > 1 || (self.were_several && !self.fingers.is_empty());
        if self.were_several {
            self.clicked = None;
        }
    }

    fn finger_moved(&mut self, n: usize, at: [f64; 2], on: &Picture) -> Vec<Command> {
        let old: Vec<[f64; 2]> = self.fingers.iter().map(|finger| finger.at).collect();
        self.fingers[n].at = at;
        match (&old[..], &self.fingers[..]) {
            // A third finger rests.
            ([a, b, ..], [first, second, ..]) if n < 2 => touch::pair([*a, *b], [first.at, second.at], first.spot, on),
            ([_], _) => self.finger.as_mut().and_then(|press| press.moved(at, on)).into_iter().collect(),
            _ => Vec::new(),
        }
    }

    /// The end of a press: a click, if it did not move.
    fn let_go(&mut self, press: &Press, on: &Picture, tool: Tool, slop: f64) -> Vec<Command> {
        let Some((at, spot)) = press.click() else { return Vec::new() };
        let is_second = self.clicked.take().is_some_and(|first| {
            (at[0] - first.at[0]).hypot(at[1] - first.at[1]) < 2.0 * slop && on.now.saturating_sub(first.when) <= SOON
        });
        if is_second {
            return self.alone_or_back(spot, on);
        }
        self.clicked = Some(Click { at, when: on.now });
        match (spot, on.scene) {
            (Spot::Plane(tile), Some(scene)) if tool == Tool::Plane => {
                let place = on.on_plane(tile, at).map(|(place, _)| view::below_face(scene, place).to_array());
                place.map(Command::Meet).into_iter().collect()
            }
            _ => Vec::new(),
        }
    }

    /// A double click: the tile alone, or all of them again.
    fn alone_or_back(&mut self, spot: Spot, on: &Picture) -> Vec<Command> {
        let Some(scene) = on.scene else { return Vec::new() };
        if !scene.shows_three() {
            return self.back.take().into_iter().collect();
        }
        let is_four = scene.settings.layout == Layout::Four;
        self.back = Some(if is_four { Command::Layout(Layout::Four) } else { Command::Mode(Mode::Orthogonal) });
        match spot {
            Spot::Rendering => vec![Command::Layout(Layout::Single)],
            Spot::Plane(n) => on.name(n).map(Command::Plane).into_iter().chain([Command::Mode(Mode::Plane)]).collect(),
        }
    }
}
