//! Gestures on the picture: a mouse with three buttons and a wheel, or fingers. They become commands; the only state is what is pressed.

use super::command::{Command, Face, Tool};
use super::input::{Button, Input, Modifiers, Phase};
use super::picking::{Picker, Picture, Spot, along};
use super::sliders::PLANES_ZOOM;
use super::view;
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
            ([a, b, ..], [first, second, ..]) if n < 2 => pinch([*a, *b], [first.at, second.at], first.spot, on),
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

/// How far a drag across what is shown turns it, deg a height. The front of a volume that fills the picture would need 115: this
/// saves going over twice, and is still slow enough for a hand to stop where it means to.
pub const TURN: f64 = 200.0;

/// What is held.
#[derive(Clone, Debug)]
enum Drag {
    /// A place where this tool has nothing to hold.
    Nothing,
    Pan,
    Turn,
    Light,
    Clip,
    /// A face of the region.
    Face(Face),
    TurnPlanes,
    /// The place where three planes meet, on a tile of them.
    Meet(usize),
    /// A stack of planes.
    Step,
}

/// A button or a finger that is down.
#[derive(Clone, Debug)]
pub(super) struct Press {
    grip: Drag,
    spot: Spot,
    begin: [f64; 2],
    last: [f64; 2],
    /// How far it moves before it is a drag, pixels of the window.
    slop: f64,
    is_drag: bool,
    /// A face: where along its axis it was grasped, how far it may go from there, and how far it went, mm.
    along: Option<f64>,
    room: [f64; 2],
    gone: f64,
}

impl Press {
    /// By a button; a finger is a left one.
    pub fn new(button: Button, tool: Tool, held: Modifiers, slop: f64, at: [f64; 2], on: &Picture) -> Option<Press> {
        let spot = on.spot(at)?;
        let (scene, pixel) = on.place(at)?;
        // Only a plain press may be a click: others take hold at once.
        let is_plain = button == Button::Left && !held.shift && !held.control;
        let grip = match (spot, tool) {
            (Spot::Rendering, _) if button != Button::Left || held.shift => Drag::Pan,
            (Spot::Rendering, _) if held.control => Drag::Light,
            (Spot::Rendering, Tool::Turn) => Drag::Turn,
            (Spot::Rendering, Tool::Light) => Drag::Light,
            (Spot::Rendering, Tool::Clip) => Drag::Clip,
            (Spot::Rendering, Tool::Region) => view::nearest_face(scene, pixel).map_or(Drag::Nothing, Drag::Face),
            (Spot::Rendering, Tool::Plane) => {
                if scene.cuts_planes() {
                    Drag::TurnPlanes
                } else {
                    Drag::Turn
                }
            }
            (Spot::Plane(_), _) if !is_plain => Drag::Nothing,
            (Spot::Plane(_), Tool::Turn) => Drag::TurnPlanes,
            (Spot::Plane(n), Tool::Plane) => {
                if scene.shows_three() {
                    Drag::Meet(n)
                } else {
                    Drag::Step
                }
            }
            (Spot::Plane(_), _) => Drag::Nothing,
        };
        let room = if let Drag::Face(face) = grip { view::face_travel(scene, face) } else { [0.0; 2] };
        let slop = if is_plain { slop } else { 0.0 };
        Some(Press { grip, spot, begin: at, last: at, slop, is_drag: !is_plain, along: None, room, gone: 0.0 })
    }

    /// Where it began, if that is all it did.
    pub fn click(&self) -> Option<([f64; 2], Spot)> {
        (!self.is_drag).then_some((self.begin, self.spot))
    }

    pub fn moved(&mut self, to: [f64; 2], on: &Picture) -> Option<Command> {
        if !self.is_drag {
            let [x, y] = [to[0] - self.begin[0], to[1] - self.begin[1]];
            let gone = x.hypot(y);
            if gone < self.slop {
                return None;
            }
            // It holds from where it became a drag: what is held does not jump.
            self.is_drag = true;
            self.last = [self.begin[0] + x / gone * self.slop, self.begin[1] + y / gone * self.slop];
        }
        let from = std::mem::replace(&mut self.last, to);
        if from == to { None } else { self.dragged(from, to, on) }
    }

    fn dragged(&mut self, from: [f64; 2], to: [f64; 2], on: &Picture) -> Option<Command> {
        let (scene, pixel) = on.place(to)?;
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let of_picture = |n: f64| n / on.size[1];
        let turned = |x: f64, y: f64| [x, y].map(|n| n / on.height(self.spot) * TURN);
        let command = match self.grip {
            Drag::Nothing => return None,
            Drag::Pan => Command::Pan([x, y].map(of_picture)),
            Drag::Light => Command::Light([x, y].map(of_picture)),
            Drag::Turn => {
                // The front follows the hand also where the picture is rolled.
                let (sin, cos) = view::upright(&scene.settings.camera, &scene.geometry).roll.to_radians().sin_cos();
                Command::Turn(turned(x * cos + y * sin, x * sin - y * cos))
            }
            Drag::TurnPlanes => Command::PlaneTurn(turned(-x, -y)),
            // Up is away from whoever looks down on a table: further in.
            Drag::Clip => Command::Clip(-y * on.scale() * Picker::of(scene).pixel()),
            Drag::Step => Command::PlaneBy(-y * on.scale() * scene.sheet().pixel),
            Drag::Meet(tile) => Command::Meet(view::below_face(scene, on.on_plane(tile, to)?.0).to_array()),
            Drag::Face(face) => {
                let eye = Picker::of(scene);
                let line = view::face_axis(scene, face);
                // Along the axis from the origin, which stays while the face moves.
                let place = |pixel| along((line.0 - line.1 * line.0.dot(line.1), line.1), eye.ray(pixel));
                if self.along.is_none() {
                    self.along = place(on.place(from)?.1);
                }
                // From where it was grasped, not from the last place: beyond its room the face waits for the hand to come back.
                let gone = (place(pixel)? - self.along?).clamp(self.room[0], self.room[1]);
                let by = gone - std::mem::replace(&mut self.gone, gone);
                if by == 0.0 {
                    return None;
                }
                Command::Face(face, by)
            }
        };
        Some(command)
    }
}

/// Fingers that are nearer to one another only move the picture, pixels: what they say of scale and angle is noise.
const NEAR: f64 = 24.0;

/// What two fingers ask for that went from two places of the window to two others. `spot` is where they came down.
fn pinch(old: [[f64; 2]; 2], new: [[f64; 2]; 2], spot: Spot, on: &Picture) -> Vec<Command> {
    let Some(scene) = on.scene else { return Vec::new() };
    let between = |[a, b]: [[f64; 2]; 2]| [b[0] - a[0], b[1] - a[1]];
    let (was, is) = (between(old), between(new));
    let (length, longer) = (was[0].hypot(was[1]), is[0].hypot(is[1]));
    let settings = &scene.settings;
    let zoom = if spot == Spot::Rendering { settings.camera.zoom } else { settings.planes.zoom };
    let (mut times, mut angle) = (1.0, 0.0);
    if length.min(longer) >= NEAR {
        // Beyond the last zoom the picture only moves and turns.
        times = view::zoomed(zoom, longer / length) / zoom;
        angle = (was[0] * is[1] - was[1] * is[0]).atan2(was[0] * is[0] + was[1] * is[1]);
    }
    let mut commands = Vec::new();
    match spot {
        Spot::Plane(_) if !scene.is_flat() => commands.push(Command::Slide(PLANES_ZOOM, zoom * times)),
        Spot::Plane(_) => commands.extend([Command::Zoom(times), Command::Roll(angle.to_degrees())]),
        Spot::Rendering => {
            // Zoom and roll are about the middle of the rendering; the rest of what leads from one pair to the other is a pan.
            let middle = on.middle();
            let from_middle = |[a, b]: [[f64; 2]; 2]| [0, 1].map(|i| (a[i] + b[i]) / 2.0 - middle[i]);
            let ([x, y], [to_x, to_y]) = (from_middle(old), from_middle(new));
            let (sin, cos) = angle.sin_cos();
            let pan = [to_x - times * (x * cos - y * sin), to_y - times * (x * sin + y * cos)];
            commands.extend([
                Command::Zoom(times),
                Command::Roll(angle.to_degrees()),
                Command::Pan(pan.map(|n| n / on.size[1])),
            ]);
        }
    }
    let does_nothing = [Command::Zoom(1.0), Command::Roll(0.0), Command::Pan([0.0; 2])];
    commands.retain(|command| !does_nothing.contains(command));
    commands
}
