//! The picture, volume and plane on which the next point of a measurement is set.

use super::Console;
use crate::command::{Command, Tool};
use crate::measure::made;
use crate::scene::Made;

impl Console {
    /// If a command sets a point of a measurement, tells the controls on which volume and plane.
    pub(super) fn note_what_is_measured_on(&mut self, command: &Command) {
        let (point, on_surface) = match *command {
            Command::Point(point, on_surface) => (point, on_surface),
            Command::PointOnCurve(point) => (point, false),
            _ => return,
        };
        if matches!(self.controls.tool(), Tool::Measure(_)) {
            let made = self.made(point, on_surface);
            self.controls.measure_on(made);
        }
    }

    fn made(&self, point: [f64; 3], on_surface: bool) -> Option<Made> {
        let shown = self.presentation.shown()?;
        let work = self.controls.work().filter(|work| work.on_surface == on_surface);
        let points: Vec<_> = work.into_iter().flat_map(|work| &work.points).copied().chain([point]).collect();
        let begun = work.and_then(|work| work.made.clone());
        Some(Made {
            plane: made::plane(&shown.scene, &points, on_surface),
            // A contour has hundreds of points: what cannot change within it is found once.
            ..begun.unwrap_or_else(|| self.made_on(shown.volume))
        })
    }

    /// The conditions of a measurement on the whole volume of this number, as far as they are known.
    pub(super) fn made_on(&self, volume: u32) -> Made {
        let kept = self.stream.cine().volumes().iter().find(|kept| kept.volume == volume);
        let time = kept.and_then(|kept| kept.frames.first()?.time).filter(|time| time.is_finite());
        let settings = self.presentation.shown().map(|shown| made::settings(&shown.scene.settings));
        Made { volume, time, plane: String::new(), settings: settings.unwrap_or_default() }
    }

    /// The name of the recording that results contain: that of its file or folder; empty for live volumes.
    pub(super) fn recording_name(&self) -> String {
        let recording = self.fixed.origin.as_ref().and_then(|origin| origin.recording.as_ref());
        let name = recording.and_then(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned());
        name.unwrap_or_default()
    }
}
