//! Execution of commands in the console, apart from changes of settings.

use super::Console;
use crate::cine_player::Loop;
use crate::command::{Command, LabelCommand, Tool};
use crate::controls::{Change, Controls};
use crate::live::Stream;
use crate::plan::Work;
use crate::scene::{Scene, Settings};
use crate::texts::{self, Unsaved};
use std::time::{Duration, Instant};

/// Escape leaves the program no sooner after another recording came: it was meant for the reading of it.
const ESCAPE_PAUSE: Duration = Duration::from_secs(1);

impl Console {
    /// Executes a command of the user.
    pub fn execute(&mut self, command: &Command, now: Instant) {
        tracing::debug!("{command:?}");
        self.user_acts(now);
        if self.start.first_steps.end(command) {
            return self.presentation.redraw();
        }
        let stops = self.hands.turntable.stop_for(command);
        self.presentation.redraw_if(stops);
        let before = is_of_tone(command).then(|| self.controls.settings().clone());
        // A drag by keyboard is one step, however long it rests.
        if self.activity.has_paused(now) && !self.hands.pointer.is_held() {
            self.controls.seal();
        }
        self.note_what_is_measured_on(command);
        let tool = self.controls.tool();
        let change = self.controls.apply(command, self.stream.scene());
        if self.controls.tool() != tool {
            self.visible.inspector.follow(self.controls.tool());
            if self.controls.tool() == Tool::Labels {
                self.begin_labels();
            }
        }
        match change {
            Change::Nothing => return,
            Change::Tool => self.survey.first_end = None,
            Change::Marks => self.activity.changes(now),
            Change::Refused(why) => self.notify(why, true),
            Change::Settings => {
                self.activity.changes_settings(now);
                if command.is_continuous() {
                    if before.as_ref().is_some_and(|before| before.light != self.controls.settings().light) {
                        self.quality.light_moved = Some(now);
                    }
                    let work = before.map_or(Work::Rays, |before| self.work_since(before));
                    self.quality.pace.moved(work, now);
                } else {
                    // Another scene takes another time.
                    self.quality.pace.forget();
                }
            }
            Change::Caller(command) => self.execute_own(&command, now),
        }
        self.presentation.redraw();
    }

    /// How much of the picture a change from these settings draws again.
    fn work_since(&self, before: Settings) -> Work {
        let Some(shown) = self.stream.scene() else { return Work::Rays };
        let scene = |settings: Settings| Scene::new(shown.geometry.clone(), shown.input, settings);
        match (scene(before), scene(self.controls.settings().clone())) {
            (Ok(before), Ok(after)) => Work::between(&before, &after),
            _ => Work::Rays,
        }
    }

    /// Executes a command that does not concern settings.
    fn execute_own(&mut self, command: &Command, now: Instant) {
        let count = self.stream.cine().volumes().len();
        if matches!(*command, Command::Freeze | Command::StepCine(_) | Command::SeekCine(_) | Command::PlayCine) {
            self.replay.frozen = None;
        }
        match *command {
            Command::Freeze => {
                self.replay.player.stop();
                self.stream.freeze(!self.stream.is_frozen());
            }
            Command::StepCine(by) => {
                let at = self.stream.cine_position().unwrap_or(count.saturating_sub(1)) as i64 + i64::from(by);
                self.show_cine_volume(at.clamp(0, count.saturating_sub(1) as i64) as usize);
                self.activity.awaits_picture(now);
            }
            Command::SeekCine(index) => {
                self.show_cine_volume(index.min(count.saturating_sub(1)));
                self.activity.awaits_picture(now);
            }
            Command::PlayCine => {
                self.stream.freeze(true);
                self.replay.player.toggle(loop_of(&self.controls, &self.stream), now);
            }
            Command::MarkCine(end) => {
                self.mark_cine(self.stream.cine_position().unwrap_or(count.saturating_sub(1)), end, now);
            }
            Command::TrimCine(index, end) => self.mark_cine(index, end, now),
            Command::SavePicture => self.save_picture(),
            Command::SaveLoop => _ = self.save_loop(),
            Command::TogglePanels => {
                self.visible.panels = !self.visible.panels && self.fixed.overlay;
                self.resize_picture();
            }
            Command::FocusPanels if self.fixed.overlay => {
                self.visible.panels = true;
                self.resize_picture();
                self.panels.toggle_focus();
            }
            Command::KeyboardPointer => self.toggle_keyboard_pointer(now),
            Command::ToggleFullScreen => self.request.toggle_full_screen |= !self.fixed.is_kiosk,
            Command::EndCut => self.end_stroke(now),
            Command::Labels(LabelCommand::Stroke(pixel, tile, erases)) => self.brush_labels(pixel, tile, erases),
            Command::Labels(LabelCommand::EndStroke) => self.end_stroke_of_labels(now),
            Command::Labels(LabelCommand::Fill(n)) => self.fill_labels(n),
            Command::PickSurface(at) => self.pick_surface(at),
            Command::MeasureBody => self.measure_body(),
            Command::CopyMeasures => self.copy_measures(),
            Command::SaveMeasures => self.save_measures(),
            Command::SaveWorkspace => _ = self.save_workspace(),
            Command::OpenFiles => self.toggle_files(),
            Command::OpenFile(n) => self.open_entry(n),
            Command::Turntable => self.toggle_turning(now),
            Command::ShowRecording(n) => self.show_recording(n),
            Command::StepRecording(by) => self.step_recording(by),
            Command::CloseRecording(n) => self.close_recording(n, now),
            Command::Compare => self.toggle_comparison(),
            Command::CompareView(view) => {
                self.comparison.iter_mut().for_each(|comparison| comparison.set_view(view));
                self.resize_picture();
            }
            Command::MoveWipe(share) => self.comparison.iter_mut().for_each(|comparison| comparison.set_wipe(share)),
            Command::ToggleLink(link) => self.comparison.iter_mut().for_each(|comparison| comparison.toggle_link(link)),
            Command::Align => self.align_compared(),
            Command::CompareFurther => self.compare_further(),
            Command::MoveCompared(n, pixels, turns) => self.move_compared(n, pixels, turns),
            Command::CancelReading => _ = self.cancel_reading(),
            Command::Export(n) => self.export_volume(n),
            Command::CancelExport => self.exporter.cancel_export(),
            Command::Presets => self.toggle_presets(),
            Command::Preset(n) => self.take_preset(n, now),
            Command::NamePreset => self.begin_naming(None),
            Command::RenamePreset(n) => self.begin_naming(Some(n)),
            Command::EndNaming => self.change_presets(|presets, settings| presets.end_naming(settings)),
            Command::DeletePreset(n) => self.change_presets(|presets, _| presets.delete(n)),
            Command::RestorePresets => self.change_presets(|presets, _| presets.restore()),
            Command::Back => self.go_back(),
            // A kiosk ends only with its exit keys: a sleeve may press Escape.
            Command::Exit if self.fixed.is_kiosk => {}
            Command::Exit if self.asks_before_leaving() => {}
            Command::Exit | Command::Discard => self.request.exit |= !self.fixed.is_kiosk,
            Command::SaveAndExit => self.save_and_leave(),
            Command::ShowControl(_) => {
                self.visible.panels = self.fixed.overlay;
                self.resize_picture();
                let room = self.room();
                self.visible.apply(command, &room);
            }
            _ => {
                let room = self.room();
                self.visible.apply(command, &room);
            }
        }
    }

    /// The loop begins or ends with the volume at this index.
    fn mark_cine(&mut self, index: usize, end: bool, now: Instant) {
        let volume = self.stream.cine().volumes().get(index).map(|kept| kept.volume);
        if volume.is_some_and(|volume| self.controls.mark_cine(volume, end) == Change::Marks) {
            self.activity.changes(now);
        }
    }

    pub(super) fn show_cine_volume(&mut self, index: usize) {
        self.replay.player.stop();
        self.stream.freeze(true);
        self.stream.show_cine_volume(index);
    }

    /// Begins to turn, or ends it.
    fn toggle_turning(&mut self, now: Instant) {
        let turns = self.stream.scene().is_some_and(|scene| !scene.is_flat());
        match (self.hands.turntable.stop(), turns) {
            (true, _) => {}
            (false, true) => self.hands.turntable.begin(now),
            (false, false) => self.notify(texts::NOTHING_TURNS, true),
        }
    }

    /// Rotates the view by the next step, if the turntable runs.
    pub(super) fn turn(&mut self, now: Instant) {
        let can_draw = !self.stream.is_drawing() && self.stream.is_idle();
        let Some(by) = self.hands.turntable.step(can_draw, now) else { return };
        let is_flat = self.stream.scene().is_none_or(|scene| scene.is_flat());
        match self.controls.apply(&Command::Rotate([by, 0.0]), self.stream.scene()) {
            Change::Settings => {
                self.activity.changes(now);
                self.quality.pace.moved(Work::Rays, now);
            }
            // The mode has nothing that turns.
            _ if is_flat => {
                self.hands.turntable.stop();
                self.presentation.redraw();
            }
            _ => {}
        }
    }

    /// The volumes of the cine loop with its playback settings.
    pub(super) fn cine_loop(&self) -> Loop<'_> {
        loop_of(&self.controls, &self.stream)
    }

    /// Shows the next volume of the cine loop when it is due.
    pub(super) fn advance_cine(&mut self, now: Instant) {
        if self.stream.is_replaying() {
            return;
        }
        let shown = self.stream.cine_position();
        if let Some(next) = self.replay.player.advance(loop_of(&self.controls, &self.stream), shown, now) {
            self.stream.show_cine_volume(next);
        }
    }

    /// Closes the uppermost of what is open; else leaves full screen; else leaves the program.
    fn go_back(&mut self) {
        let room = self.room();
        let is_closed = self.leaving.dismiss()
            || self.opening.stop_typing()
            || self.opening.close_list()
            || self.visible.close_exports()
            || self.presets.leave()
            || self.visible.close_help()
            || self.cancel_reading()
            || self.visible.close_times()
            || self.visible.close_drawer(&room);
        if is_closed {
            return;
        }
        if self.hands.pointer.is_on && self.controls.work().is_none() && self.controls.line().is_none() {
            self.toggle_keyboard_pointer(Instant::now());
        } else if self.leave_measuring() || self.hands.turntable.stop() {
            // The view shows it.
        } else if self.presentation.is_full_screen && !self.fixed.is_kiosk {
            self.request.toggle_full_screen = true;
        } else if !self.fixed.follows_another || self.fixed.started.elapsed() >= ESCAPE_PAUSE {
            self.execute_own(&Command::Exit, Instant::now());
        }
    }

    /// Saves what would be lost, and leaves once all of it is saved.
    fn save_and_leave(&mut self) {
        self.leaving.dismiss();
        let mut saved = Vec::new();
        if self.has_unsaved_loop() {
            // The question names all volumes.
            self.controls.apply(&Command::WholeCine, None);
            saved.push(self.save_loop());
        }
        if self.controls.is_unsaved() {
            saved.push(self.save_workspace());
        }
        for (path, kept) in self.opening.unsaved() {
            saved.push(self.save_kept(path, &kept));
        }
        let files = if saved.iter().all(|is_saved| *is_saved) { saved.len() } else { 0 };
        self.leaving.after(files);
    }

    /// What leaving would lose.
    fn unsaved(&self) -> Option<&'static Unsaved> {
        let has_work = self.controls.is_unsaved() || !self.opening.unsaved().is_empty();
        match (self.has_unsaved_loop(), has_work) {
            (true, false) => Some(&texts::UNSAVED_LOOP),
            (false, true) => Some(&texts::UNSAVED_WORK),
            (true, true) => Some(&texts::UNSAVED_LOOP_AND_WORK),
            (false, false) => None,
        }
    }

    /// Asks, if leaving loses anything. Without panels nobody sees a question.
    fn asks_before_leaving(&mut self) -> bool {
        let question = self.unsaved().filter(|_| self.fixed.overlay);
        self.leaving.question = question.or(self.leaving.question);
        question.is_some()
    }

    /// True if volumes of the cine loop are in no file: neither in the recording that they were read from, nor in one that is being made, nor in
    /// a saved loop.
    pub(super) fn has_unsaved_loop(&self) -> bool {
        let newest = self.stream.cine().volumes().back().map(|kept| kept.volume);
        self.leaving.loses(newest, self.stream.feed_counts().unrecorded)
    }

    /// Handles a request of the window system to close the window. Returns true if the user is asked first, because something would be lost.
    pub(crate) fn asks_before_closing(&mut self) -> bool {
        let asks = !self.leaving.asks() && self.asks_before_leaving();
        self.presentation.redraw_if(asks);
        asks
    }

    /// Sets whether the window fills the screen. If it does, [`Command::Back`] leaves full screen before it leaves the program.
    pub fn set_full_screen(&mut self, is_full_screen: bool) {
        self.presentation.is_full_screen = is_full_screen;
    }

    /// True while the user is asked whether to save before the program ends.
    pub fn asks_to_leave(&self) -> bool {
        self.leaving.asks()
    }
}

/// The cine loop as it is played.
fn loop_of<'a>(controls: &'a Controls, stream: &'a Stream) -> Loop<'a> {
    Loop { cine: &controls.settings().drawn.cine, volumes: stream.cine().volumes() }
}

/// True for continuous commands that may leave the rays as they are.
fn is_of_tone(command: &Command) -> bool {
    use Command::{MoveCrossing, MoveCurvePoint, MoveLight, RotatePlanes, SetSlider, StepPlane, StepSlider};
    matches!(
        command,
        MoveCurvePoint(..)
            | MoveLight(_)
            | StepPlane(_)
            | MoveCrossing(_)
            | RotatePlanes(_)
            | SetSlider(..)
            | StepSlider(..)
    )
}
