//! Measurements and annotations: their points are set one at a time; commands move, label and delete them.

use super::{Change, Controls, short};
use crate::command::{Command, Tool};
use crate::measure::outcome;
use crate::scene::{MAX_ALL_POINTS, MAX_CONTOURS, MAX_MEASURES, MAX_POINTS, MAX_TEXT, Made, MeasureKind, Measurement};
use crate::texts;

/// Farthest place of a point, mm.
const FARTHEST: f64 = 1e6;

impl Controls {
    /// The measurements and annotations, in the order of their numbers.
    pub fn measures(&self) -> &[Measurement] {
        &self.settings.drawn.measure
    }

    /// The measurement whose points are being set; None if none is.
    pub fn work(&self) -> Option<&Measurement> {
        self.work.as_ref()
    }

    /// The index of the measurement whose text is being typed; None if none is.
    pub fn typing(&self) -> Option<usize> {
        self.typing
    }

    /// Sets the volume and plane on which the next point of a measurement is set; `None`: they are not known.
    pub(crate) fn measure_on(&mut self, made: Option<Made>) {
        self.made = made;
    }

    /// Adds a complete measurement.
    pub(crate) fn add_measure(&mut self, measured: Measurement) -> Change {
        let measured = Measurement { made: measured.made.clone().or_else(|| self.made.clone()), ..measured };
        if self.is_full(measured.count()) {
            return Change::Refused(texts::TOO_MANY_MEASUREMENTS);
        }
        if let Err(why) = outcome::quantities(&measured) {
            return Change::Refused(why);
        }
        let has_text = matches!(measured.kind, MeasureKind::Text | MeasureKind::Arrow);
        self.mark(&Command::EndMeasure, |settings| settings.drawn.measure.push(measured));
        self.typing = has_text.then(|| self.settings.drawn.measure.len() - 1);
        Change::Marks
    }

    /// Applies a command about measurements. None if the command is about something else.
    pub(super) fn measure(&mut self, command: &Command) -> Option<Change> {
        Some(match *command {
            Command::Point(point, on_surface) => self.add_point(point, on_surface),
            Command::EndMeasure => self.end_work(),
            Command::CancelMeasure => match (self.work.take(), self.typing.take()) {
                (None, None) => Change::Nothing,
                _ => Change::Marks,
            },
            Command::MovePoint(index, point, to) if is_place(to) => {
                let there =
                    self.settings.drawn.measure.get(index).filter(|measured| measured.kind != MeasureKind::Surface);
                match there.and_then(|measured| measured.points.get(point)) {
                    Some(was) if *was != to => {
                        self.mark(command, |settings| settings.drawn.measure[index].points[point] = to)
                    }
                    _ => Change::Nothing,
                }
            }
            Command::DeleteMeasure(index) => {
                let last = self.settings.drawn.measure.len().checked_sub(1)?;
                self.typing = None;
                self.mark(command, |settings| _ = settings.drawn.measure.remove(index.min(last)))
            }
            Command::ClearMeasures if !self.settings.drawn.measure.is_empty() => {
                self.typing = None;
                self.mark(command, |settings| settings.drawn.measure.clear())
            }
            Command::LabelMeasure(index) if index < self.settings.drawn.measure.len() => {
                self.history.seal();
                self.typing = Some(index);
                Change::Marks
            }
            Command::Type(letter) if !letter.is_control() => self.change_text(command, |text| {
                if text.chars().count() < MAX_TEXT {
                    text.push(letter);
                }
            }),
            Command::Untype => self.change_text(command, |text| _ = text.pop()),
            Command::EndTyping => match self.typing.take() {
                // A text that says nothing is none.
                Some(index) if self.settings.drawn.measure.get(index).is_some_and(is_empty_text) => {
                    self.mark(command, |settings| _ = settings.drawn.measure.remove(index))
                }
                Some(_) => Change::Marks,
                None => Change::Nothing,
            },
            Command::MovePoint(..) | Command::ClearMeasures | Command::LabelMeasure(_) | Command::Type(_) => {
                Change::Nothing
            }
            _ => return None,
        })
    }

    /// Discards the measurement in progress.
    pub(crate) fn leave_work(&mut self) {
        self.work = None;
    }

    /// Removes the last point of the measurement in progress. Returns false if there is none.
    pub(super) fn undo_point(&mut self) -> bool {
        let Some(work) = &mut self.work else { return false };
        if work.points.pop().is_none() {
            work.contours.pop();
        }
        if work.points.is_empty() && work.contours.is_empty() {
            self.work = None;
        }
        true
    }

    /// True if so many more points are too many.
    fn is_full(&self, more: usize) -> bool {
        let there: usize = self.settings.drawn.measure.iter().map(Measurement::count).sum();
        self.settings.drawn.measure.len() >= MAX_MEASURES || there + more > MAX_ALL_POINTS
    }

    fn change_text(&mut self, command: &Command, change: impl FnOnce(&mut String)) -> Change {
        match self.typing.filter(|index| *index < self.settings.drawn.measure.len()) {
            Some(index) => self.mark(command, |settings| change(&mut settings.drawn.measure[index].text)),
            None => Change::Nothing,
        }
    }

    fn add_point(&mut self, point: [f64; 3], on_surface: bool) -> Change {
        let Tool::Measure(kind) = self.tool else { return Change::Nothing };
        if !is_place(point) || kind == MeasureKind::Threshold {
            return Change::Nothing;
        }
        if self.work.is_none() && self.is_full(1) {
            return Change::Refused(texts::TOO_MANY_MEASUREMENTS);
        }
        let fits = |work: &Measurement| work.kind == kind && work.on_surface == on_surface;
        let new = || Measurement { kind, on_surface, ..Measurement::default() };
        let mut work = self.work.take().filter(fits).unwrap_or_else(new);
        // It belongs to the volume on which it was begun, and to the plane that holds all of it.
        work.made = self.made.clone();
        self.typing = None;
        let point = short(point);
        if work.points.len() < MAX_POINTS && work.points.last() != Some(&point) {
            work.points.push(point);
        }
        if kind.complete_at() != Some(work.points.len()) {
            self.work = Some(work);
            return Change::Marks;
        }
        match self.add_measure(work.clone()) {
            Change::Refused(why) => {
                // The last point was set where it measures nothing.
                work.points.pop();
                self.work = Some(work);
                Change::Refused(why)
            }
            change => change,
        }
    }

    /// Closes the contour in work; of a volume without one, ends the volume.
    fn end_work(&mut self) -> Change {
        let Some(mut work) = self.work.take() else { return Change::Nothing };
        match work.kind {
            MeasureKind::Trace | MeasureKind::Surface | MeasureKind::Volume => {}
            // Others end by their number of points.
            _ => {
                self.work = Some(work);
                return Change::Nothing;
            }
        }
        if work.kind == MeasureKind::Volume && !work.points.is_empty() {
            if work.points.len() < 3 || work.contours.len() >= MAX_CONTOURS {
                work.points.clear();
                self.work = Some(work).filter(|work| !work.contours.is_empty());
                return Change::Refused(texts::CONTOUR_LIMITS);
            }
            let contour = std::mem::take(&mut work.points);
            work.contours.push(contour);
            self.work = Some(work);
            return Change::Marks;
        }
        match self.add_measure(work.clone()) {
            Change::Refused(why) => {
                // More contours may be added to a volume.
                self.work = Some(work).filter(|work| work.kind == MeasureKind::Volume);
                Change::Refused(why)
            }
            change => change,
        }
    }
}

fn is_place(point: [f64; 3]) -> bool {
    point.iter().all(|mm| mm.abs() <= FARTHEST)
}

fn is_empty_text(measured: &Measurement) -> bool {
    measured.kind == MeasureKind::Text && measured.text.trim().is_empty()
}
