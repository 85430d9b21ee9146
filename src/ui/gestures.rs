//! Gestures on the picture, by a mouse with three buttons and a wheel or by fingers. Inputs go in, commands come out; the only state is what is
//! pressed and the last click.

use super::command::{Command, Face, LabelCommand, Tool};
use super::input::{Button, Input, Modifiers, Phase};
use super::picking::{Pane, Picker, Viewport, closest_along};
use super::region_box::{self, Part, StartPart};
use super::sliders::PLANES_ZOOM;
use super::view;
use crate::measure::body_marks::{self, Part as MarkPart};
use crate::scene::{BodyMark, Layout, MeasureKind, Mode, PlaneName, Scene};
use glam::DVec3;
use std::time::Duration;

/// A press that moves less than this is a click, pixels of the window. A finger needs more: it may wear a glove.
const MOUSE_SLOP: f64 = 6.0;
const FINGER_SLOP: f64 = 12.0;
/// Longest time between the clicks of a double click.
const DOUBLE_CLICK: Duration = Duration::from_millis(400);
/// Zoom factor of one notch of the wheel.
const NOTCH_ZOOM: f64 = 1.1;
/// Turn of the probe on a body mark for one notch of the wheel, degrees.
const NOTCH_TURN: f64 = 15.0;
/// Step of a plane for one notch of the wheel, mm.
const NOTCH_MM: f64 = 1.0;
/// Fingers beyond these are ignored.
const MAX_FINGERS: usize = 10;
/// Angle by which a drag across the height of the picture rotates the view, degrees. 115 would keep the front of a volume that fills the picture
/// under the pointer; 200 needs fewer strokes and is still slow enough to stop where intended.
pub(super) const DEGREES_PER_HEIGHT: f64 = 200.0;
/// A point of a measurement and the centre of the cross-lines are grabbed from so far, and a cross-line, pixels of the window.
const GRAB: f64 = 12.0;
const GRAB_LINE: f64 = 7.0;
/// Distance between two points of a contour that is drawn by a drag, pixels of the window.
const TRACE_STEP: f64 = 4.0;
/// Fingers that are closer to each other only pan, pixels: their scale and angle are noise.
const MIN_PINCH: f64 = 24.0;

/// Recognises gestures of mouse and fingers on the picture.
#[derive(Clone, Debug, Default)]
pub(super) struct Gestures {
    /// The last position of the pointer, pixels of the window; None if it is not known.
    pub(super) pointer: Option<[f64; 2]>,
    mouse: Option<(Button, Press)>,
    /// The fingers in the order in which they touched the picture. The first two form a pair.
    fingers: Vec<Finger>,
    /// The press of the first finger while it is alone.
    finger_press: Option<Press>,
    /// Whether several fingers touched since all were up: lifting the last one is then no tap.
    had_several: bool,
    /// Position and time of the last click.
    last_click: Option<([f64; 2], Duration)>,
    /// The command that returns from a tile shown alone.
    back: Option<Command>,
}

#[derive(Clone, Copy, Debug)]
struct Finger {
    id: u64,
    at: [f64; 2],
    pane: Pane,
}

impl Gestures {
    /// The commands that an input gives as part of a gesture, in the order of execution. Keys give none.
    pub(super) fn input(
        &mut self,
        input: &Input,
        viewport: &Viewport,
        tool: Tool,
        modifiers: Modifiers,
    ) -> Vec<Command> {
        let Some(input) = input.sanitized() else { return Vec::new() };
        match input {
            Input::Moved(at) => {
                self.pointer = Some(at);
                self.mouse.as_mut().and_then(|(_, press)| press.moved(at, viewport)).into_iter().collect()
            }
            Input::Button { button, pressed } => self.button(button, pressed, viewport, tool, modifiers),
            Input::Scroll(notches) => self.scroll(notches, viewport, tool, modifiers),
            Input::Touch { finger, phase, at } => self.touch(finger, phase, at, viewport, tool),
            Input::PointerLeft => {
                self.pointer = self.pointer.filter(|_| self.presses().next().is_some());
                Vec::new()
            }
            Input::FocusLost => {
                // The tile that is shown alone does not depend on what is pressed.
                let given_up = self.presses().flat_map(given_up).collect();
                *self = Gestures { back: self.back, ..Gestures::default() };
                given_up
            }
            _ => Vec::new(),
        }
    }

    fn presses(&self) -> impl Iterator<Item = &Press> {
        self.mouse.iter().map(|(_, press)| press).chain(&self.finger_press)
    }

    /// True while a button or a finger is down on the picture.
    #[cfg(test)]
    pub(super) fn is_pressed(&self) -> bool {
        self.mouse.is_some() || !self.fingers.is_empty()
    }

    fn button(
        &mut self,
        button: Button,
        pressed: bool,
        viewport: &Viewport,
        tool: Tool,
        modifiers: Modifiers,
    ) -> Vec<Command> {
        let held = self.mouse.as_ref().map(|(held, _)| *held);
        match (pressed, self.pointer) {
            // A button that goes down twice was released outside of the window.
            (true, Some(at)) if held.is_none_or(|held| held == button) => {
                let press = if viewport.is_covered {
                    None
                } else {
                    Press::new(button, tool, modifiers, MOUSE_SLOP, at, viewport)
                };
                self.mouse = press.map(|press| (button, press));
                Vec::new()
            }
            (false, _) if held == Some(button) => match self.mouse.take() {
                Some((Button::Left, press)) => self.release(&press, viewport, tool, MOUSE_SLOP),
                _ => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    fn scroll(&mut self, notches: f64, viewport: &Viewport, tool: Tool, modifiers: Modifiers) -> Vec<Command> {
        let (Some(at), Some(scene), false) = (self.pointer, viewport.scene, viewport.is_covered) else {
            return Vec::new();
        };
        let mark = viewport.body_mark_at(at, GRAB).filter(|_| tool == Tool::BodyMark);
        if let Some((index, mark)) = mark.and_then(|(index, _)| Some((index, *viewport.body_marks.get(index)?))) {
            let turned = BodyMark { angle: mark.angle + notches * NOTCH_TURN, ..mark };
            return vec![Command::ChangeBodyMark(index, turned)];
        }
        let Some(pane) = viewport.pane_at(at) else { return Vec::new() };
        let factor = NOTCH_ZOOM.powf(notches);
        if modifiers.shift && matches!(tool, Tool::Brush | Tool::Labels) {
            return vec![Command::ScaleBrush(factor)];
        }
        match pane {
            Pane::Rendering if tool != Tool::Plane || modifiers.control || !scene.cuts_planes() => {
                vec![Command::Zoom(factor)]
            }
            Pane::Plane(_) if modifiers.control && scene.is_flat() => vec![Command::Zoom(factor)],
            Pane::Plane(_) if modifiers.control => {
                vec![Command::SetSlider(PLANES_ZOOM, scene.settings.planes.zoom * factor)]
            }
            Pane::Plane(n) => viewport
                .plane_name(n)
                .filter(|name| *name != scene.settings.planes.plane)
                .map(Command::Plane)
                .into_iter()
                .chain([Command::StepPlane(notches * NOTCH_MM)])
                .collect(),
            Pane::Rendering => vec![Command::StepPlane(notches * NOTCH_MM)],
        }
    }

    fn touch(&mut self, id: u64, phase: Phase, at: [f64; 2], viewport: &Viewport, tool: Tool) -> Vec<Command> {
        let known = self.fingers.iter().position(|finger| finger.id == id);
        match (phase, known) {
            (Phase::Down, None) => {
                let is_ignored = viewport.is_covered || self.fingers.len() >= MAX_FINGERS;
                let Some(pane) = viewport.pane_at(at).filter(|_| !is_ignored) else { return Vec::new() };
                self.fingers.push(Finger { id, at, pane });
                let press = self.finger_press.take();
                self.restart_press(viewport, tool);
                press.as_ref().and_then(given_up).into_iter().collect()
            }
            (Phase::Moved | Phase::Down, Some(n)) => self.finger_moved(n, at, viewport),
            (Phase::Up | Phase::Cancelled, Some(n)) => {
                // The position of the release is ignored: it depends on how the fingertip leaves the screen.
                self.fingers.remove(n);
                let press = self.finger_press.take();
                let is_tap = self.fingers.is_empty() && phase == Phase::Up && !self.had_several;
                self.restart_press(viewport, tool);
                match press {
                    Some(press) if is_tap => self.release(&press, viewport, tool, FINGER_SLOP),
                    press => press.as_ref().and_then(given_up).into_iter().collect(),
                }
            }
            (_, None) => Vec::new(),
        }
    }

    /// A single finger acts as the left button, from its current position. Several fingers form a pair instead.
    fn restart_press(&mut self, viewport: &Viewport, tool: Tool) {
        self.finger_press = match self.fingers[..] {
            [finger] => Press::new(Button::Left, tool, Modifiers::default(), FINGER_SLOP, finger.at, viewport),
            _ => None,
        };
        self.had_several = self.fingers.len() > 1 || (self.had_several && !self.fingers.is_empty());
        if self.had_several {
            self.last_click = None;
            // The finger that is left of two moved the view: it draws no contour.
            self.finger_press.take_if(|press| matches!(press.drag, Drag::Cut | Drag::Labels { .. }));
        }
    }

    fn finger_moved(&mut self, n: usize, at: [f64; 2], viewport: &Viewport) -> Vec<Command> {
        let old: Vec<[f64; 2]> = self.fingers.iter().map(|finger| finger.at).collect();
        self.fingers[n].at = at;
        match (&old[..], &self.fingers[..]) {
            // A third finger is ignored.
            ([a, b, ..], [first, second, ..]) if n < 2 => pinch([*a, *b], [first.at, second.at], first.pane, viewport),
            ([_], _) => self.finger_press.as_mut().and_then(|press| press.moved(at, viewport)).into_iter().collect(),
            _ => Vec::new(),
        }
    }

    /// Ends a press. It was a click if it did not move.
    fn release(&mut self, press: &Press, viewport: &Viewport, tool: Tool, slop: f64) -> Vec<Command> {
        let Some((at, pane)) = press.click() else { return press.end(viewport) };
        if let Drag::BodyMark { index, .. } = press.drag {
            let pixel = viewport.pixel_at(at).map(|(_, pixel)| pixel);
            let moved = pixel.and_then(|pixel| mark_moved(viewport, index, MarkPart::Probe, pixel));
            return moved.into_iter().collect();
        }
        let is_second = self.last_click.take().is_some_and(|([x, y], time)| {
            (at[0] - x).hypot(at[1] - y) < 2.0 * slop && viewport.now.saturating_sub(time) <= DOUBLE_CLICK
        });
        // A brush goes over the same place again.
        if is_second && (pane, tool) != (Pane::Rendering, Tool::Brush) && tool != Tool::Labels {
            match (tool, viewport.scene) {
                (Tool::Measure(_), _) => return vec![Command::EndMeasure],
                (Tool::Curve, _) => return vec![Command::EndCurve],
                (Tool::Plane, Some(scene)) if scene.shows_three() => return vec![Command::Recentre],
                (Tool::Region, Some(scene)) => match start_at(scene, pane, at, viewport) {
                    Some(StartPart::Handle(index)) => return vec![Command::RemoveStartHandle(Some(index))],
                    Some(StartPart::Line(_)) if viewport.start_line.is_empty() => {
                        return vec![Command::ToggleStartCurve];
                    }
                    Some(StartPart::Line(lateral)) => return vec![Command::AddStartHandle(Some(lateral))],
                    None => {}
                },
                _ => {}
            }
            return self.double_click(pane, viewport);
        }
        self.last_click = Some((at, viewport.now));
        if matches!(press.drag, Drag::Labels { .. }) {
            return press.end(viewport);
        }
        if (pane, tool) == (Pane::Rendering, Tool::Brush) {
            let pixel = viewport.pixel_at(at).map(|(_, pixel)| press.to_surface(pixel));
            return pixel.map_or(Vec::new(), |pixel| vec![Command::BeginCut(pixel), Command::EndCut]);
        }
        match (pane, viewport.scene) {
            (Pane::Plane(tile), Some(scene)) if tool == Tool::Plane => {
                let point = viewport.point_on_plane(tile, at).map(|point| view::below_face(scene, point).to_array());
                point.map(Command::MoveCrossing).into_iter().collect()
            }
            (pane, _) if matches!(tool, Tool::Measure(_)) => point_at(viewport, pane, at).into_iter().collect(),
            (Pane::Plane(_), _) if tool == Tool::Curve && matches!(press.drag, Drag::Handle { .. }) => Vec::new(),
            (Pane::Plane(tile), _) if tool == Tool::Curve => line_point(viewport, tile, at).into_iter().collect(),
            _ => Vec::new(),
        }
    }

    /// A double click shows a tile alone, or all tiles again.
    fn double_click(&mut self, pane: Pane, viewport: &Viewport) -> Vec<Command> {
        let Some(scene) = viewport.scene else { return Vec::new() };
        if !scene.shows_three() {
            return self.back.take().into_iter().collect();
        }
        let layout = scene.settings.layout;
        self.back = Some(if layout.has_planes() { Command::Layout(layout) } else { Command::Mode(Mode::Orthogonal) });
        match pane {
            Pane::Rendering => vec![Command::Layout(Layout::Single)],
            Pane::Plane(n) => {
                viewport.plane_name(n).map(Command::Plane).into_iter().chain([Command::Mode(Mode::Plane)]).collect()
            }
        }
    }
}

/// What a drag moves.
#[derive(Clone, Debug)]
enum Drag {
    /// Nothing: the tool has no effect here.
    Nothing,
    Pan,
    Rotate,
    Light,
    Clip,
    /// A face of the region, dragged by its line on a tile of planes; on the rendering `tile` is None. Along its axis, mm: `grabbed` is the coordinate
    /// where it was grabbed, `travel` how far it can move from there, `moved` how far it has moved.
    Face {
        face: Face,
        tile: Option<usize>,
        travel: [f64; 2],
        grabbed: Option<f64>,
        moved: f64,
    },
    /// The region, dragged on a tile: where it was grabbed, how far it can move, and how far it has moved, mm.
    Region {
        tile: usize,
        from: DVec3,
        travel: [DVec3; 2],
        moved: DVec3,
    },
    /// A handle of the start line, with the offset of the handle from the pointer: lateral and depth, mm.
    StartHandle {
        tile: usize,
        index: usize,
        way: [f64; 2],
    },
    RotatePlanes,
    /// The point where three planes cross, dragged on one of their tiles. `way`: offset from the pointer; `along`: the normal of the plane whose line
    /// was grabbed, along which alone it moves.
    Crossing {
        tile: usize,
        way: DVec3,
        along: Option<DVec3>,
    },
    /// The plane of a tile, or a stack of planes.
    Step(usize),
    /// A point of a measurement on a tile: index of the measurement, index of the point.
    Point {
        tile: usize,
        index: usize,
        point: usize,
    },
    /// A new distance on a tile, from the press to the release; whether its first point is already set.
    Caliper {
        tile: usize,
        has_first: bool,
    },
    /// A contour along the drag, on a tile.
    Trace(usize),
    /// A drag on the tile of a curved plane with a tool that cannot draw there: the command for its first point reports that.
    OnCurve(usize),
    /// A straight line on a tile from the press to the release, or the next point of the line in progress.
    Line {
        tile: usize,
        is_next: bool,
    },
    /// A point of the curved plane's line, on its tile.
    Handle {
        tile: usize,
        index: usize,
    },
    /// The contour of a cut along the drag, on the rendering.
    Cut,
    /// The brush of labels, on a tile or on the rendering.
    Labels {
        tile: Option<usize>,
        erases: bool,
    },
    /// A body mark or the probe on it. `way`: offset from the pointer, pixels of the picture.
    BodyMark {
        index: usize,
        part: MarkPart,
        way: [f64; 2],
    },
}

/// A button or a finger that is down.
#[derive(Clone, Debug)]
struct Press {
    drag: Drag,
    pane: Pane,
    start: [f64; 2],
    last: [f64; 2],
    /// See [`Viewport::columns_to_surface`]; a drag that leaves its half stays on the same rays.
    columns_to_surface: f64,
    /// Distance in pixels of the window after which the press becomes a drag.
    slop: f64,
    is_drag: bool,
}

impl Press {
    /// A press of a button; a finger is the left one.
    fn new(button: Button, tool: Tool, held: Modifiers, slop: f64, at: [f64; 2], viewport: &Viewport) -> Option<Press> {
        let (scene, mut pixel) = viewport.pixel_at(at)?;
        let mark = viewport.body_mark_at(at, GRAB).filter(|_| tool == Tool::BodyMark && button == Button::Left);
        let mark = mark.and_then(|(index, part)| {
            let (mark, size) = (viewport.body_marks.get(index)?, scene.picture_size().map(f64::from));
            let [x, y] = match part {
                MarkPart::Probe => body_marks::probe_of(mark, size),
                MarkPart::Body => body_marks::centre_of(mark, size),
            };
            Some(Drag::BodyMark { index, part, way: [x - pixel[0], y - pixel[1]] })
        });
        // A mark may lie where no tile is. Beside marks their tool turns the view.
        let pane = viewport.pane_at(at).or(mark.as_ref().map(|_| Pane::Rendering))?;
        let tool = if tool == Tool::BodyMark { Tool::Rotate } else { tool };
        let columns_to_surface = viewport.columns_to_surface(at);
        pixel[0] += columns_to_surface;
        // Only a plain press can be a click: any other one drags at once.
        let is_plain = button == Button::Left && !held.shift && (!held.control || tool == Tool::Labels);
        let of_face = |face, tile| {
            let travel = view::face_travel(scene, face);
            Drag::Face { face, tile, travel, grabbed: None, moved: 0.0 }
        };
        let drag = match (pane, tool) {
            _ if mark.is_some() => mark?,
            (Pane::Rendering, _) if button != Button::Left || held.shift => Drag::Pan,
            (_, Tool::Labels) if is_plain => {
                let tile = if let Pane::Plane(tile) = pane { Some(tile) } else { None };
                Drag::Labels { tile, erases: held.control }
            }
            (Pane::Rendering, _) if held.control => Drag::Light,
            (Pane::Rendering, Tool::Rotate | Tool::BodyMark) => Drag::Rotate,
            (Pane::Rendering, Tool::Light) => Drag::Light,
            (Pane::Rendering, Tool::Clip) => Drag::Clip,
            (Pane::Rendering, Tool::Cut | Tool::Brush) => Drag::Cut,
            (Pane::Rendering, Tool::Region) => {
                view::nearest_face(scene, pixel).map_or(Drag::Nothing, |face| of_face(face, None))
            }
            (Pane::Rendering, Tool::Plane) => {
                if scene.cuts_planes() {
                    Drag::RotatePlanes
                } else {
                    Drag::Rotate
                }
            }
            (Pane::Rendering, Tool::Measure(_) | Tool::Curve | Tool::Labels) => Drag::Rotate,
            // What the wheel does.
            (Pane::Plane(tile), _) if button != Button::Left => Drag::Step(tile),
            (Pane::Plane(_), _) if !is_plain => Drag::Nothing,
            (Pane::Plane(tile), Tool::Region) => {
                let reach = [GRAB_LINE, GRAB].map(|reach| reach * viewport.scale());
                let start = start_at(scene, pane, at, viewport);
                match (start, region_box::part_at(scene, tile, pixel, reach)) {
                    (Some(StartPart::Handle(index)), _) => {
                        let [lateral, depth] = *viewport.start_line.get(index)?;
                        let [x, y, _] = point_on(viewport, tile, at)?;
                        Drag::StartHandle { tile, index, way: [lateral - x, depth - y] }
                    }
                    (_, Some(Part::Face(face))) => of_face(face, Some(tile)),
                    (_, Some(Part::Inside)) => {
                        let from = viewport.point_on_plane(tile, at)?;
                        Drag::Region { tile, from, travel: view::region_travel(scene), moved: DVec3::ZERO }
                    }
                    (_, None) => Drag::Nothing,
                }
            }
            (Pane::Plane(tile), Tool::Measure(kind)) => match (viewport.measure_point_at(tile, at, GRAB), kind) {
                (Some((index, point)), _) => Drag::Point { tile, index, point },
                (None, MeasureKind::Distance | MeasureKind::Arrow) => {
                    Drag::Caliper { tile, has_first: viewport.has_work }
                }
                (None, kind) if viewport.is_curved(tile) && kind != MeasureKind::Text => Drag::OnCurve(tile),
                (None, MeasureKind::Trace | MeasureKind::Volume) => Drag::Trace(tile),
                (None, _) => Drag::Nothing,
            },
            (Pane::Plane(tile), Tool::Curve) => match viewport.curve_point_at(tile, at, GRAB) {
                Some(index) if !viewport.has_work => Drag::Handle { tile, index },
                _ => Drag::Line { tile, is_next: viewport.has_work },
            },
            (Pane::Plane(tile), _) if tool == Tool::Plane || tool == Tool::Rotate => {
                match (viewport.cross_at(tile, at, [GRAB_LINE, GRAB]), tool) {
                    (Some((way, along)), _) => Drag::Crossing { tile, way, along },
                    (None, Tool::Rotate) => Drag::RotatePlanes,
                    (None, _) if scene.shows_three() => Drag::Crossing { tile, way: DVec3::ZERO, along: None },
                    (None, _) => Drag::Step(tile),
                }
            }
            (Pane::Plane(_), _) => Drag::Nothing,
        };
        let slop = if is_plain { slop } else { 0.0 };
        Some(Press { drag, pane, start: at, last: at, columns_to_surface, slop, is_drag: !is_plain })
    }

    /// Position and pane of the press, if it did not become a drag.
    fn click(&self) -> Option<([f64; 2], Pane)> {
        (!self.is_drag).then_some((self.start, self.pane))
    }

    fn moved(&mut self, to: [f64; 2], viewport: &Viewport) -> Option<Command> {
        if !self.is_drag {
            let [x, y] = [to[0] - self.start[0], to[1] - self.start[1]];
            let distance = x.hypot(y);
            if distance < self.slop {
                return None;
            }
            // The drag starts where the slop ends, so that nothing jumps.
            self.is_drag = true;
            self.last = [self.start[0] + x / distance * self.slop, self.start[1] + y / distance * self.slop];
            let first = match self.drag {
                Drag::Caliper { tile, has_first: false } | Drag::Trace(tile) | Drag::OnCurve(tile) => {
                    Some(measured_at(viewport, tile, self.start))
                }
                Drag::Line { tile, is_next: false } => Some(line_point(viewport, tile, self.start)),
                Drag::Labels { .. } => Some(self.brushed(self.start, viewport)),
                Drag::Cut => {
                    let pixel = viewport.pixel_at(self.start).map(|(_, pixel)| self.to_surface(pixel));
                    Some(pixel.map(Command::BeginCut))
                }
                _ => None,
            };
            // What is drawn begins where the press was.
            if let Some(first) = first {
                self.last = self.start;
                return first;
            }
        }
        if let Drag::Trace(_) | Drag::Cut | Drag::Labels { .. } = self.drag
            && (to[0] - self.last[0]).hypot(to[1] - self.last[1]) < TRACE_STEP
        {
            return None;
        }
        let from = std::mem::replace(&mut self.last, to);
        if from == to { None } else { self.dragged(from, to, viewport) }
    }

    /// The commands at the end of a drag.
    fn end(&self, viewport: &Viewport) -> Vec<Command> {
        match self.drag {
            Drag::Caliper { tile, .. } => measured_at(viewport, tile, self.last).into_iter().collect(),
            Drag::Line { tile, is_next } => {
                let Some(point) = line_point(viewport, tile, self.last) else { return Vec::new() };
                [point].into_iter().chain((!is_next).then_some(Command::EndCurve)).collect()
            }
            Drag::Trace(_) => vec![Command::EndMeasure],
            Drag::Cut => vec![Command::EndCut],
            Drag::Labels { .. } => {
                let ends = Command::Labels(LabelCommand::EndStroke);
                self.brushed(self.last, viewport).into_iter().chain([ends]).collect()
            }
            _ => Vec::new(),
        }
    }

    /// The command that moves the brush of labels to a position in the window.
    fn brushed(&self, to: [f64; 2], viewport: &Viewport) -> Option<Command> {
        let Drag::Labels { tile, erases } = self.drag else { return None };
        let pixel = self.to_surface(viewport.pixel_at(to)?.1);
        Some(Command::Labels(LabelCommand::Stroke(pixel, tile, erases)))
    }

    /// A pixel of the picture on the half of a pair that shows the surface.
    fn to_surface(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x + self.columns_to_surface, y]
    }

    fn dragged(&mut self, from: [f64; 2], to: [f64; 2], viewport: &Viewport) -> Option<Command> {
        if let Drag::BodyMark { index, part, way } = self.drag {
            let (_, [x, y]) = viewport.pixel_at(to)?;
            return mark_moved(viewport, index, part, [x + way[0], y + way[1]]);
        }
        let (scene, pixel) = viewport.pixel_at(to).map(|(scene, pixel)| (scene, self.to_surface(pixel)))?;
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let of_picture = |n: f64| n / viewport.size[1];
        let degrees = |x: f64, y: f64| [x, y].map(|n| n / viewport.pane_height(self.pane) * DEGREES_PER_HEIGHT);
        let command = match self.drag {
            Drag::Nothing | Drag::BodyMark { .. } => return None,
            Drag::Pan => Command::Pan([x, y].map(of_picture)),
            Drag::Light => Command::MoveLight([x, y].map(of_picture)),
            Drag::Rotate => {
                // The front of the volume follows the pointer even if the picture is rolled.
                let (sin, cos) = view::upright(&scene.settings.camera, &scene.geometry).roll.to_radians().sin_cos();
                Command::Rotate(degrees(x * cos + y * sin, x * sin - y * cos))
            }
            Drag::RotatePlanes => Command::RotatePlanes(degrees(-x, -y)),
            // Dragging up moves away from the viewer, further into the volume.
            Drag::Clip => Command::MoveClip(-y * viewport.scale() * Picker::of(scene).mm_per_pixel()),
            Drag::Step(tile) => {
                match viewport.plane_name(tile).filter(|name| *name != scene.settings.planes.plane) {
                    // It is moved when it is the one that is moved.
                    Some(name) => {
                        self.last = from;
                        Command::Plane(name)
                    }
                    None => {
                        let tiling = scene.tiling();
                        let pixel = tiling.tiles.get(tile).map_or(tiling.pixel, |tile| tile.pixel);
                        Command::StepPlane(-y * viewport.scale() * pixel)
                    }
                }
            }
            Drag::Crossing { tile, way, along } => {
                let to = viewport.point_on_plane(tile, to)? + way;
                let common = scene.plane(PlaneName::A).at;
                let to = along.map_or(to, |normal| common + normal * (to - common).dot(normal));
                Command::MoveCrossing(view::below_face(scene, to).to_array())
            }
            Drag::Point { tile, index, point } => Command::MovePoint(index, point, point_on(viewport, tile, to)?),
            Drag::Region { tile, from, travel: [least, most], ref mut moved } => {
                let wanted = (viewport.point_on_plane(tile, to)? - from).clamp(least, most);
                let by = wanted - *moved;
                *moved = wanted;
                if by == DVec3::ZERO {
                    return None;
                }
                Command::MoveRegion(by.to_array())
            }
            Drag::StartHandle { tile, index, way } => {
                let [x, y, _] = point_on(viewport, tile, to)?;
                Command::MoveStartHandle(index, [x + way[0], y + way[1]])
            }
            Drag::Caliper { .. } | Drag::OnCurve(_) | Drag::Line { .. } => return None,
            Drag::Handle { tile, index } => Command::MoveCurvePoint(index, viewport.coordinates(tile, to)?.1),
            Drag::Cut => Command::CutAlong(pixel),
            Drag::Labels { .. } => return self.brushed(to, viewport),
            Drag::Trace(tile) => Command::Point(point_on(viewport, tile, to)?, false),
            Drag::Face { face, tile, travel: [least, most], ref mut grabbed, ref mut moved } => {
                let (middle, out) = view::face_axis(scene, face);
                // Positions count along the axis from the origin, which does not move with the face.
                let axis = (middle - out * middle.dot(out), out);
                let columns = self.columns_to_surface;
                let position = |at| match tile {
                    Some(tile) => Some(viewport.point_on_plane(tile, at)?.dot(out)),
                    None => {
                        let (_, [x, y]) = viewport.pixel_at(at)?;
                        closest_along(axis, Picker::of(scene).ray([x + columns, y]))
                    }
                };
                *grabbed = grabbed.or_else(|| position(from));
                // It moves from where it was grabbed: beyond its range it waits for the pointer to come back.
                let wanted = (position(to)? - (*grabbed)?).clamp(least, most);
                let by = wanted - std::mem::replace(moved, wanted);
                if by == 0.0 {
                    return None;
                }
                Command::MoveFace(face, by)
            }
        };
        Some(command)
    }
}

/// What of the start line of the region is at a position in the window.
fn start_at(scene: &Scene, pane: Pane, at: [f64; 2], viewport: &Viewport) -> Option<StartPart> {
    let Pane::Plane(tile) = pane else { return None };
    let reach = [GRAB_LINE, GRAB].map(|reach| reach * viewport.scale());
    region_box::start_at(scene, tile, viewport.start_line, viewport.pixel_at(at)?.1, reach)
}

/// The point of the settings that a tile shows at a position in the window, mm.
fn point_on(viewport: &Viewport, tile: usize, at: [f64; 2]) -> Option<[f64; 3]> {
    Some(view::below_face(viewport.scene?, viewport.point_on_plane(tile, at)?).to_array())
}

/// The command that puts a part of a body mark at a place on the picture, pixels.
fn mark_moved(viewport: &Viewport, index: usize, part: MarkPart, place: [f64; 2]) -> Option<Command> {
    let (mark, size) = (viewport.body_marks.get(index)?, viewport.scene?.picture_size().map(f64::from));
    let moved = match part {
        MarkPart::Probe => body_marks::with_probe_at(mark, size, place),
        MarkPart::Body => body_marks::moved_to(mark, size, place),
    };
    Some(Command::ChangeBodyMark(index, moved))
}

/// The command that sets the position of a text that the user starts by typing: at the pointer (pixels of the window), or else in the middle of
/// the picture.
pub(super) fn place_of_text(viewport: &Viewport, pointer: Option<[f64; 2]>) -> Option<Command> {
    let pointer = pointer.filter(|at| !viewport.is_covered && viewport.pane_at(*at).is_some());
    let at = pointer.or_else(|| viewport.middle())?;
    point_at(viewport, viewport.pane_at(at)?, at)
}

/// The command that sets a point of a measurement at a position in the window.
fn point_at(viewport: &Viewport, pane: Pane, at: [f64; 2]) -> Option<Command> {
    let Pane::Plane(tile) = pane else {
        let (_, [x, y]) = viewport.pixel_at(at)?;
        return Some(Command::PickSurface([x + viewport.columns_to_surface(at), y]));
    };
    measured_at(viewport, tile, at)
}

/// The command that sets a point of a measurement at a position on a tile.
fn measured_at(viewport: &Viewport, tile: usize, at: [f64; 2]) -> Option<Command> {
    let point = point_on(viewport, tile, at)?;
    Some(if viewport.is_curved(tile) { Command::PointOnCurve(point) } else { Command::Point(point, false) })
}

/// The command that sets a point of a line at a position on a tile; none on tiles that show none of the three planes.
fn line_point(viewport: &Viewport, tile: usize, at: [f64; 2]) -> Option<Command> {
    viewport.coordinates(tile, at).map(|(plane, point)| Command::CurvePoint(plane, point))
}

/// What a press leaves behind that ends without a release: the contour that it drew, the line or the caliper that it began.
fn given_up(press: &Press) -> Option<Command> {
    match press.drag {
        Drag::Cut => Some(Command::CancelCut),
        Drag::Labels { .. } if press.is_drag => Some(Command::Labels(LabelCommand::EndStroke)),
        Drag::Line { is_next: false, .. } if press.is_drag => Some(Command::CancelCurve),
        _ => None,
    }
}

/// The commands for two fingers that moved from `old` to `new` positions in the window: what is under them stays under them. `pane` is
/// where they touched first.
fn pinch(old: [[f64; 2]; 2], new: [[f64; 2]; 2], pane: Pane, viewport: &Viewport) -> Vec<Command> {
    let Some(scene) = viewport.scene else { return Vec::new() };
    let between = |[a, b]: [[f64; 2]; 2]| [b[0] - a[0], b[1] - a[1]];
    let (was, is) = (between(old), between(new));
    let (old_length, new_length) = (was[0].hypot(was[1]), is[0].hypot(is[1]));
    let settings = &scene.settings;
    let zoom = if pane == Pane::Rendering { settings.camera.zoom } else { settings.planes.zoom };
    let (mut factor, mut angle) = (1.0, 0.0);
    if old_length.min(new_length) >= MIN_PINCH {
        // Beyond the limits of the zoom the picture only pans and rolls.
        factor = view::scale_zoom(zoom, new_length / old_length) / zoom;
        angle = (was[0] * is[1] - was[1] * is[0]).atan2(was[0] * is[0] + was[1] * is[1]);
    }
    let mut commands = Vec::new();
    match pane {
        Pane::Plane(_) if !scene.is_flat() => commands.push(Command::SetSlider(PLANES_ZOOM, zoom * factor)),
        Pane::Plane(_) => commands.extend([Command::Zoom(factor), Command::Roll(angle.to_degrees())]),
        Pane::Rendering => {
            // Zoom and roll are about the centre of the rendering; the pan makes up for the rest.
            let centre = viewport.rendering_centre(old[0]);
            let from_centre = |[a, b]: [[f64; 2]; 2]| [0, 1].map(|i| (a[i] + b[i]) / 2.0 - centre[i]);
            let ([x, y], [to_x, to_y]) = (from_centre(old), from_centre(new));
            let (sin, cos) = angle.sin_cos();
            let pan = [to_x - factor * (x * cos - y * sin), to_y - factor * (x * sin + y * cos)];
            commands.extend([
                Command::Zoom(factor),
                Command::Roll(angle.to_degrees()),
                Command::Pan(pan.map(|n| n / viewport.size[1])),
            ]);
        }
    }
    let no_change = [Command::Zoom(1.0), Command::Roll(0.0), Command::Pan([0.0; 2])];
    commands.retain(|command| !no_change.contains(command));
    commands
}
