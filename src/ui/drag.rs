//! What a hand has hold of while it drags, and what it asks for as it moves.

use super::command::{Command, Face, Tool};
use super::input::{Button, Modifiers};
use super::picking::{Picker, along};
use super::picture::{Picture, Spot};
use super::{region, view};

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
            (Spot::Rendering, Tool::Region) => region::nearest(scene, pixel).map_or(Drag::Nothing, Drag::Face),
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
        let room = if let Drag::Face(face) = grip { region::room(scene, face) } else { [0.0; 2] };
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
