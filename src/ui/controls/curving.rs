//! The curved plane: the points of its line, set one at a time, and measurements on it.

use super::{Change, Controls, finite, short};
use crate::command::{Command, Tool};
use crate::scene::{Curve, Layout, MAX_CURVE_POINTS, MeasureKind, Measurement, Mode, PlaneName, Scene, Settings};
use crate::texts;

/// Farthest coordinate of a point, mm.
const FARTHEST: f64 = 1e5;

/// Coordinates as they are kept.
fn kept<const N: usize>(point: [f64; N]) -> [f64; N] {
    short(point.map(|mm| mm.clamp(-FARTHEST, FARTHEST)))
}

/// True if a picture has a plane on which a line can be drawn.
fn has_plane(settings: &Settings) -> bool {
    settings.layout.has_planes() || matches!(settings.mode, Mode::Orthogonal | Mode::Plane)
}

impl Controls {
    /// The line of a curved plane that is being drawn; None if none is.
    pub fn line(&self) -> Option<&Curve> {
        self.line.as_ref()
    }

    /// The command that selects a mode in which the tool for curved planes has a plane to draw on; None if a plane is shown.
    pub(super) fn mode_for_line(&self) -> Option<Command> {
        (!has_plane(&self.settings)).then_some(Command::Mode(Mode::Orthogonal))
    }

    /// Removes the last point of the line that is being drawn. Returns false if there is none.
    pub(super) fn undo_line_point(&mut self) -> bool {
        let Some(line) = &mut self.line else { return false };
        line.points.pop();
        if line.points.is_empty() {
            self.line = None;
        }
        true
    }

    /// Applies a command about curved planes. None if the command is about something else.
    pub(super) fn curve(&mut self, command: &Command, scene: Option<&Scene>) -> Option<Change> {
        Some(match *command {
            Command::CurvePoint(plane, point) if finite(&point) => {
                self.add_to_line(plane, point, scene.map_or(0.0, Scene::least_apart))
            }
            Command::CurvePoint(..) => Change::Nothing,
            Command::EndCurve => self.end_line(command, scene?),
            Command::CancelCurve => self.line.take().map_or(Change::Nothing, |_| Change::Marks),
            Command::PointOnCurve(point) => self.point_on_curve(point, scene?),
            _ => return None,
        })
    }

    fn add_to_line(&mut self, plane: PlaneName, point: [f64; 2], least_apart: f64) -> Change {
        let point = kept(point);
        let line = self.line.get_or_insert_with(|| Curve { plane, points: Vec::new() });
        if line.plane != plane {
            return Change::Refused(texts::CURVE_ON_ANOTHER_PLANE);
        }
        if line.points.len() >= MAX_CURVE_POINTS {
            return Change::Refused(texts::CURVE_FULL);
        }
        if line.points.last().is_some_and(|[x, y]| (x - point[0]).hypot(y - point[1]) <= least_apart) {
            return Change::Nothing;
        }
        line.points.push(point);
        Change::Marks
    }

    fn end_line(&mut self, command: &Command, scene: &Scene) -> Change {
        let Some(line) = self.line.take() else { return Change::Nothing };
        if line.points.len() < 2 {
            self.line = Some(line);
            return Change::Refused(texts::CURVE_NEEDS_POINTS);
        }
        let mut new = self.settings.clone();
        new.planes.plane = line.plane;
        new.planes.curve = Some(line);
        if new.layout != Layout::Single || !matches!(new.mode, Mode::Orthogonal | Mode::Plane) {
            new.set_mode(Mode::Orthogonal);
        }
        let new = self.switched(new);
        self.put_if_drawable(new, command, scene, texts::CURVE_NOT_DRAWN)
    }

    /// Sets a point of a measurement on the curved plane. A distance there is that along the line and perpendicular to the plane, as it is on the picture.
    fn point_on_curve(&mut self, point: [f64; 3], scene: &Scene) -> Change {
        let Tool::Measure(kind) = self.tool else { return Change::Nothing };
        let as_any = Command::Point(point, false);
        let begun = self.work.as_ref().filter(|work| work.kind == kind && !work.on_surface);
        let first = begun.and_then(|work| work.points.first().copied());
        match (kind, first) {
            (MeasureKind::Text | MeasureKind::Arrow, _) | (MeasureKind::Distance, None) => {
                self.measure(&as_any).unwrap_or(Change::Nothing)
            }
            (MeasureKind::Distance, Some(first)) if first == kept(point) => Change::Nothing,
            (MeasureKind::Distance, Some(first)) => {
                let Some(way) = scene.way_on_section(scene.place_of(first), scene.place_of(point)) else {
                    return Change::Refused(texts::CURVE_NEEDS_BOTH_ENDS);
                };
                let points = way.into_iter().map(|place| kept(scene.point_of(place))).collect();
                self.leave_work();
                self.add_measure(Measurement { kind: MeasureKind::Surface, points, ..Measurement::default() })
            }
            _ => Change::Refused(texts::CURVE_MEASURES),
        }
    }
}

/// The settings with a point of the curved plane's line moved to `to`, coordinates on its plane, mm. None if there is no point with this index.
pub(super) fn moved(mut settings: Settings, index: usize, to: [f64; 2]) -> Option<Settings> {
    *settings.planes.curve.as_mut()?.points.get_mut(index)? = kept(to);
    Some(settings)
}
