//! Measuring in the console: points on the rendered surface, a measured body, typed texts, and export of results.

use super::Console;
use super::opening::ListKey;
use super::surface::SurfaceMap;
use crate::command::{Command, Tool};
use crate::controls::Change;
use crate::export::Holds;
use crate::files;
use crate::input::{Input, Key};
use crate::measure::outcome;
use crate::recordings::Kept;
use crate::scene::{MeasureKind, Measurement, insonified_box};
use crate::segment::bodies;
use crate::segment::volume::Measured;
use crate::texts;
use crate::workspace::Origin;
use std::path::PathBuf;
use std::time::Instant;

/// The tool with which letters are a text.
const TEXT: Tool = Tool::Measure(MeasureKind::Text);

impl Console {
    /// Sets a point of the selected tool on the rendered surface under a pixel of the picture.
    pub(super) fn pick_surface(&mut self, pixel: [f64; 2]) {
        let Tool::Measure(kind) = self.controls.tool() else { return };
        match self.picked(kind, pixel) {
            Ok(Some(measured)) => {
                if let Change::Refused(why) = self.controls.add_measure(measured) {
                    self.notify(why, true);
                }
                self.activity.changes(Instant::now());
            }
            Ok(None) => {}
            Err(why) => self.notify(&why, true),
        }
    }

    /// Handles a picked pixel: a complete distance along the surface, or a point of another measurement, which is set at once.
    fn picked(&mut self, kind: MeasureKind, pixel: [f64; 2]) -> Result<Option<Measurement>, String> {
        if matches!(kind, MeasureKind::Trace | MeasureKind::Volume | MeasureKind::Ellipse) {
            return Err(texts::OUTLINE_NEEDS_PLANE.into());
        }
        // Undo may have taken the first end back.
        let is_begun = self.controls.work().is_some_and(|work| work.kind == MeasureKind::Surface);
        let from = self.survey.first_end.filter(|_| is_begun && kind == MeasureKind::Surface);
        let (scene, distances) = self.drawn_surface(texts::POINT_NEEDS_SURFACE)?;
        let map = SurfaceMap::of(&scene, &distances);
        let place = map.at(pixel).ok_or(texts::NO_SURFACE_HERE)?;
        let point = scene.point_of(place);
        let Some(from) = from else {
            if kind == MeasureKind::Surface {
                self.survey.first_end = Some(place);
            }
            self.execute(&Command::Point(point, true), Instant::now());
            return Ok(None);
        };
        let path = map.path(from, place).ok_or(texts::FIRST_END_BEHIND_CAMERA)?;
        let points = path.into_iter().map(|place| scene.point_of(place)).collect();
        self.survey.first_end = None;
        self.controls.leave_work();
        Ok(Some(Measurement { kind, points, on_surface: true, ..Measurement::default() }))
    }

    /// Measures the largest bright body in the region, on a thread.
    pub(super) fn measure_body(&mut self) {
        let shown = self.shown_volume().zip(self.shown_in_loop().map(|kept| kept.volume));
        let Some((((header, volume), number), scene)) = shown.zip(self.stream.scene()) else {
            return self.notify(texts::NO_VOLUME_IN_LOOP, true);
        };
        let (least, most) = insonified_box(&scene.geometry);
        let corners = [scene.low.max(least), scene.high.min(most)];
        let points = corners.map(|corner| scene.point_of(corner)).to_vec();
        let made = Some(self.made_on(number));
        self.work(texts::MEASURING_BODY, move || {
            let found = bodies::largest_within(&volume, header.range, corners);
            let found = found.and_then(|(body, threshold)| Ok((body.measured?, threshold, body.is_cut)));
            Box::new(move |console| match found {
                Ok((Measured { volume, low, high }, threshold, is_cut)) => {
                    let measured = Measurement {
                        kind: MeasureKind::Threshold,
                        points,
                        threshold: Some(threshold),
                        counted: Some(volume),
                        interval: Some([low, high]),
                        made,
                        ..Measurement::default()
                    };
                    if let Change::Refused(why) = console.controls.add_measure(measured) {
                        return console.notify(why, true);
                    }
                    console.activity.changes(Instant::now());
                    if is_cut {
                        console.notify(texts::BODY_IS_CUT, true);
                    }
                }
                Err(why) => console.notify(&texts::no_body_measured(why), true),
            })
        });
    }

    /// Copies the results of measurements to the clipboard as CSV.
    pub(super) fn copy_measures(&mut self) {
        if self.controls.measures().is_empty() {
            return self.notify(texts::NO_MEASUREMENTS_YET, true);
        }
        match self.survey.clipboard.copy(outcome::csv(self.controls.measures(), &self.recording_name())) {
            Ok(()) => self.notify(texts::RESULTS_COPIED, false),
            Err(fault) => {
                self.notify(&texts::no_clipboard(fault), true);
                self.save_measures();
            }
        }
    }

    /// Saves the results of measurements as a CSV file.
    pub(super) fn save_measures(&mut self) {
        let csv = outcome::csv(self.controls.measures(), &self.recording_name());
        let saved = match self.controls.measures().is_empty() {
            true => Err(texts::WHY_NO_MEASUREMENTS.into()),
            false => self.exporter.written("csv", Holds::Nothing, move |file| files::replace(file, csv.as_bytes())),
        };
        if let Err(fault) = saved {
            self.notify(&texts::results_not_saved(fault), true);
        }
    }

    /// Saves settings, recording and measurements as a workspace. Returns false if that is impossible.
    pub(super) fn save_workspace(&mut self) -> bool {
        let origin = self.numbered_origin().ok_or_else(|| texts::WHY_NO_ORIGIN.to_string());
        let saved = origin.and_then(|origin| {
            let is_live = origin.recording.is_none();
            let mut settings = self.controls.settings().clone();
            // Other numbers of volumes mean nothing in the recording.
            if !self.fixed.plays_once {
                (settings.drawn.cine.first, settings.drawn.cine.last) = (None, None);
            }
            let holds = Holds::Work { kept: None, work: self.controls.handiwork() };
            let labels = self.controls.edited_labels();
            self.exporter.workspace(settings, origin, labels, holds).map(|()| is_live)
        });
        let is_saved = saved.is_ok();
        match saved {
            Ok(false) => {}
            Ok(true) => self.notify(texts::VOLUMES_ARE_LIVE, false),
            Err(fault) => self.notify(&texts::workspace_not_saved(fault), true),
        }
        is_saved
    }

    /// Saves the state that is kept of a recording that is not shown as a workspace. Returns false if that is impossible.
    pub(super) fn save_kept(&mut self, path: PathBuf, kept: &Kept) -> bool {
        let work = kept.controls.handiwork();
        // The flags of the geometry are those of all recordings.
        let mut origin = self.fixed.origin.clone().unwrap_or_else(|| Origin::of(None));
        (origin.recording, origin.volume) = (Some(path.clone()), kept.frozen.unwrap_or(0) as usize);
        origin.labels = None;
        let (settings, labels) = (kept.controls.settings().clone(), kept.controls.edited_labels());
        let saved = self.exporter.workspace(settings, origin, labels, Holds::Work { kept: Some(path), work });
        if let Err(fault) = &saved {
            self.notify(&texts::workspace_not_saved(fault), true);
        }
        saved.is_ok()
    }

    /// Discards the measurement in progress or the text that is being typed, or else leaves the measuring tool. Returns false if there was
    /// nothing to leave.
    pub(super) fn leave_measuring(&mut self) -> bool {
        self.survey.first_end = None;
        if self.controls.work().is_some() || self.controls.typing().is_some() {
            self.execute(&Command::CancelMeasure, Instant::now());
            return true;
        }
        if self.controls.line().is_some() {
            self.execute(&Command::CancelCurve, Instant::now());
            return true;
        }
        let is_measuring =
            matches!(self.controls.tool(), Tool::Measure(_) | Tool::Curve | Tool::BodyMark | Tool::Labels);
        if is_measuring {
            self.execute(&Command::Tool(Tool::default()), Instant::now());
        }
        is_measuring
    }

    /// The commands of a key that belongs to a text being typed, to a contour, or to an open list of files or formats; None if it belongs to the
    /// view.
    pub(super) fn typed(&mut self, input: &Input) -> Option<Vec<Command>> {
        let Input::Key { key, pressed: true } = *input else { return None };
        let modifiers = self.hands.keys.modifiers;
        if modifiers.control || modifiers.alt || self.leaving.asks() {
            return None;
        }
        if self.opening.is_shown() {
            let done = self.opening.key(key, modifiers.shift)?;
            self.presentation.redraw();
            return Some(match done {
                ListKey::Entry(n) => vec![Command::OpenFile(n)],
                ListKey::Open(path) => {
                    self.open_path(&path);
                    Vec::new()
                }
                ListKey::Taken => Vec::new(),
            });
        }
        if self.visible.exports {
            return match key {
                Key::Char(digit @ '1'..='9') => Some(vec![Command::Export(digit as usize - '1' as usize)]),
                Key::Escape => None,
                _ => Some(Vec::new()),
            };
        }
        if self.presets.is_shown {
            let commands = self.presets.key(key, modifiers.shift);
            self.presentation.redraw_if(self.presets.is_naming());
            return commands;
        }
        let letters = |letter: char| match modifiers.shift {
            true => letter.to_uppercase().map(Command::Type).collect(),
            false => vec![Command::Type(letter)],
        };
        if self.controls.typing().is_some() {
            return Some(match key {
                Key::Char(letter) => letters(letter),
                Key::Space => vec![Command::Type(' ')],
                Key::Backspace => vec![Command::Untype],
                Key::Enter | Key::Escape => vec![Command::EndTyping],
                _ => Vec::new(),
            });
        }
        // Whoever chose this tool is about to type: a letter is no command, and nothing is to be taken back yet.
        match key {
            Key::Char(letter) if self.controls.tool() == TEXT && letter.is_alphabetic() => {
                Some(self.place_of_text().into_iter().chain(letters(letter)).collect())
            }
            Key::Backspace if self.controls.tool() == TEXT => Some(Vec::new()),
            Key::Enter => self.what_enter_ends().map(|command| vec![command]),
            _ => None,
        }
    }

    /// The command by which Enter ends the contour or line in progress; None if there is none.
    pub(super) fn what_enter_ends(&self) -> Option<Command> {
        match (self.controls.work(), self.controls.line()) {
            (Some(_), _) => Some(Command::EndMeasure),
            (None, Some(_)) => Some(Command::EndCurve),
            (None, None) => None,
        }
    }

    /// True while a list is open whose entries can be chosen by keys.
    pub(super) fn shows_list(&self) -> bool {
        self.opening.is_shown() || self.visible.exports || self.presets.is_shown
    }
}
