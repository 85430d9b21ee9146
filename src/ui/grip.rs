//! What a hand has hold of while it drags, and what it asks for as it moves.

use super::command::{Command, Face, Tool};
use super::eye::{Eye, along};
use super::input::{Button, Modifiers};
use super::picture::{Picture, Spot};
use super::{region, view};

/// How far a drag across what is shown turns it, deg a height. The front of a volume that fills the picture would need 115: this
/// saves going over twice, and is still slow enough for a hand to stop where it means to.
pub const TURN: f64 = 200.0;

/// What is held.
#[derive(Clone, Debug)]
enum Grip {
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
    grip: Grip,
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
            (Spot::Rendering, _) if button != Button::Left || held.shift => Grip::Pan,
            (Spot::Rendering, _) if held.control => Grip::Light,
            (Spot::Rendering, Tool::Turn) => Grip::Turn,
            (Spot::Rendering, Tool::Light) => Grip::Light,
            (Spot::Rendering, Tool::Clip) => Grip::Clip,
            (Spot::Rendering, Tool::Region) => region::nearest(scene, pixel).map_or(Grip::Nothing, Grip::Face),
            (Spot::Rendering, Tool::Plane) => {
                if scene.cuts_planes() {
                    Grip::TurnPlanes
                } else {
                    Grip::Turn
                }
            }
            (Spot::Plane(_), _) if !is_plain => Grip::Nothing,
            (Spot::Plane(_), Tool::Turn) => Grip::TurnPlanes,
            (Spot::Plane(n), Tool::Plane) => {
                if scene.shows_three() {
                    Grip::Meet(n)
                } else {
                    Grip::Step
                }
            }
            (Spot::Plane(_), _) => Grip::Nothing,
        };
        let room = if let Grip::Face(face) = grip { region::room(scene, face) } else { [0.0; 2] };
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
            Grip::Nothing => return None,
            Grip::Pan => Command::Pan([x, y].map(of_picture)),
            Grip::Light => Command::Light([x, y].map(of_picture)),
            Grip::Turn => {
                // The front follows the hand also where the picture is rolled.
                let (sin, cos) = view::upright(&scene.settings.camera, &scene.geometry).roll.to_radians().sin_cos();
                Command::Turn(turned(x * cos + y * sin, x * sin - y * cos))
            }
            Grip::TurnPlanes => Command::PlaneTurn(turned(-x, -y)),
            // Up is away from whoever looks down on a table: further in.
            Grip::Clip => Command::Clip(-y * on.scale() * Eye::of(scene).pixel()),
            Grip::Step => Command::PlaneBy(-y * on.scale() * scene.sheet().pixel),
            Grip::Meet(tile) => Command::Meet(view::below_face(scene, on.on_plane(tile, to)?.0).to_array()),
            Grip::Face(face) => {
                let eye = Eye::of(scene);
                let line = region::axis(scene, face);
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
