//! Presets in the console: applying one, saving the present look, and the pictures of the list.

use super::{Console, Presets};
use crate::command::{Command, InspectorTab};
use crate::controls::Change;
use crate::live::cine::CineVolume;
use crate::picture::Picture;
use crate::scene::{Scene, Settings};
use crate::source::live::SourceKind;
use crate::texts;
use crate::thumbnails::{Job, Wanted};
use std::sync::Arc;
use std::time::Instant;

impl Console {
    /// The thumbnails of the presets, in the order of their list; None for one that is not drawn yet. Empty if none was requested.
    pub fn thumbnails(&self) -> &[Option<Arc<Picture>>] {
        &self.presets.thumbnails.pictures
    }

    pub(super) fn toggle_presets(&mut self) {
        if let Some(fault) = self.presets.toggle().map(str::to_string) {
            self.notify(&fault, true);
        }
        self.presentation.redraw();
    }

    fn with_preset(&self, n: usize, scene: &Scene) -> Result<Settings, String> {
        self.presets.settings(n, &self.controls, scene, self.connection.kind == SourceKind::Demo)
    }

    /// Applies the n-th preset of the list, and closes the list.
    pub(super) fn take_preset(&mut self, n: usize, now: Instant) {
        if n >= self.presets.count() {
            return;
        }
        let settings = match self.stream.scene() {
            Some(scene) => self.with_preset(n, scene),
            None => Err(texts::NO_VOLUME_YET.into()),
        };
        match settings {
            Ok(settings) => {
                self.presets.close();
                if self.controls.take(settings, &Command::Preset(n)) == Change::Settings {
                    self.activity.changes_settings(now);
                    self.quality.pace.forget();
                }
            }
            Err(why) => self.notify(&why, true),
        }
    }

    /// Starts to type the name of a new preset (None), or a new name of the user's preset with this index.
    pub(super) fn begin_naming(&mut self, of: Option<usize>) {
        match self.presets.begin_naming(of) {
            // Space and Enter are the name's.
            Ok(true) => self.panels.drop_focus(),
            Ok(false) => {}
            Err(why) => self.notify(&why, true),
        }
    }

    /// Changes the user's presets, and says what became of them.
    pub(super) fn change_presets(
        &mut self,
        change: impl FnOnce(&mut Presets, &Settings) -> Result<Option<String>, String>,
    ) {
        match change(&mut self.presets, self.controls.settings()) {
            Ok(None) => {}
            Ok(Some(said)) => self.notify(&said, false),
            Err(why) => self.notify(&why, true),
        }
    }

    /// Updates the thumbnails: of the present volume with each preset, if volume or view have changed much, and of the volumes of the cine loop.
    pub(super) fn poll_thumbnails(&mut self, now: Instant) {
        let (acted, is_drawing) = (self.activity.acted, self.stream.is_drawing());
        let has_new = self.presets.poll(acted, is_drawing, now) | self.replay.reel.poll(acted, is_drawing, now);
        self.presentation.redraw_if(has_new);
        let in_panels = self.fixed.small_pictures && self.visible.panels && self.start.is_over;
        let rests = self.stream.is_frozen() || !self.is_followed();
        let (volumes, shown) = (self.stream.cine().volumes(), self.shown_in_loop());
        let (Some(shown), Some(scene), Some(header)) = (shown, self.stream.scene(), self.stream.header()) else {
            return;
        };
        let settings = self.controls.settings();
        let wanted = |of: &CineVolume, settings: Settings| {
            let is_backward = of.frames.first().is_some_and(|frame| frame.backward);
            let geometry = if is_backward { header.backward.clone() } else { header.forward.clone() };
            Wanted { geometry, frames: of.frames.clone(), settings }
        };
        let job = |pictures| Job {
            context: self.context.clone(),
            input: scene.input,
            pictures,
            wake: self.fixed.wake.clone(),
        };
        let of_inspector = in_panels && self.visible.inspector.tab(&self.room()) == InspectorTab::Look;
        let volume = shown.volume;
        if self.presets.wants_thumbnails((volume, settings), (of_inspector, rests), acted, now) {
            let looks = (0..self.presets.count()).map(|n| Some(wanted(shown, self.with_preset(n, scene).ok()?)));
            let job = job(looks.collect());
            return self.presets.make_thumbnails(job, volume, settings, now);
        }
        if in_panels && rests && self.replay.reel.wants(volumes, settings, acted, now) {
            let missing = self.replay.reel.missing(volumes, settings);
            let of_loop = volumes.iter().zip(missing);
            let job = job(of_loop.map(|(of, is_missing)| is_missing.then(|| wanted(of, settings.clone()))).collect());
            self.replay.reel.make(job, volumes, settings);
        }
    }
}
