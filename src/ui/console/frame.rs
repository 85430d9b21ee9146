//! One update of the console: polls the source, draws what is due, and presents it. Nothing is presented unless something changed.

use super::presentation::PictureState;
use super::quality::full_settings;
use super::{Console, ConsoleError, LoopRequest};
use crate::gpu::window::PresentOutcome;
use crate::live::metrics::SourceStatus;
use crate::live::{Feed, FinishedPicture, Step, StreamError};
use crate::passes::unveil;
use crate::shown_picture::ShownPicture;
use crate::texts;
use std::time::{Duration, Instant};

/// Time for the stream in one update, so that inputs are handled between.
const STREAM_SLICE: Duration = Duration::from_millis(4);
/// How often it is asked how far an export is.
const EXPORT_POLL: Duration = Duration::from_millis(300);

impl Console {
    /// Does everything that is due, and returns what the event loop has to do next.
    ///
    /// # Errors
    /// The device or the screen is lost; [`ConsoleError`] says how to continue.
    pub fn update(&mut self, now: Instant) -> Result<LoopRequest, ConsoleError> {
        let updated = self.advance(now);
        if let Err(ConsoleError::DeviceLost(why)) = &updated {
            self.measured.device_lost(why);
        }
        updated
    }

    fn advance(&mut self, now: Instant) -> Result<LoopRequest, ConsoleError> {
        let begun = Instant::now();
        self.connection.silence.begin_update(now);
        self.request.restart |= self.faults.is_resolved(now);
        if let Some(feed) = self.connection.poll(!self.faults.prevents_view(), now) {
            self.stream.replace_source(feed);
            self.presentation.redraw();
        }
        self.poll_saved();
        self.poll_opening(now);
        self.poll_labels(now);
        self.poll_thumbnails(now);
        let is_exported_further = self.exporter.look();
        self.presentation.redraw_if(is_exported_further);
        self.turn(now);
        self.advance_cine(now);
        self.send_settings(now);
        self.run_stream(now)?;
        self.advance_comparison()?;
        self.quality.follow_volumes(self.stream.live_volumes(), now);
        let starts = self.start.follow(self.stream.start_step(), now);
        self.refreeze();
        self.warm(now);
        let has_other_fault = self.faults.poll_shaders();
        self.presentation.redraw_if(starts || has_other_fault);
        self.take_statistics(now);
        let (note_ends, stall_ends) = (self.notes.end(now), self.faults.stall_ends(now));
        self.presentation.redraw_if(note_ends || stall_ends);
        self.presentation.repaint(now);
        self.present(now)?;
        self.write_metrics(now);
        let is_busy = self.stream.is_drawing() || !self.stream.is_idle();
        self.connection.silence.end_update(now, begun.elapsed(), is_busy);
        let request = std::mem::take(&mut self.request);
        // The console that replaces this one is updated at once: nothing else may wake it. What this one waits for is not its concern.
        let wake_at = if request.restart { Some(now) } else { self.next_wake(now) };
        Ok(LoopRequest { wake_at, ..request })
    }

    /// Gives the stream the settings that are to be drawn now.
    fn send_settings(&mut self, now: Instant) {
        let Some((quality, settings)) = self.quality.to_send(&self.controls, now) else { return };
        let is_other = self.quality.choose(quality);
        self.presentation.redraw_if(is_other);
        match self.stream.lower(settings.clone(), full_settings(&self.controls)) {
            Ok(()) => {
                self.quality.sent = Some(settings);
                self.activity.settings_sent(Instant::now());
            }
            Err(fault) => {
                self.quality.rejected = Some(settings);
                self.notify(&fault.to_string(), true);
            }
        }
    }

    /// While the user rests, compiles what may be asked for next. Frames that arrive meanwhile are drawn as before.
    fn warm(&mut self, now: Instant) {
        // The first picture in full has the processor for itself.
        let has_drawn = self.start.is_over && self.stream.renderer().is_some_and(|renderer| renderer.has_drawn());
        if !has_drawn {
            return;
        }
        let (acted, has_warmed) = (self.activity.acted, self.stream.has_warmed());
        if let Some(next) = self.quality.warm(&self.controls, acted, has_warmed, now) {
            self.stream.warm(next);
        }
    }

    /// Runs the stream until a picture is finished, it has nothing to do, or its time slice ends.
    fn run_stream(&mut self, now: Instant) -> Result<(), ConsoleError> {
        let begun = Instant::now();
        loop {
            if self.start.tells_first(self.stream.start_step()) {
                break;
            }
            match self.stream.step(Duration::ZERO) {
                Ok(Step::Picture(picture)) => {
                    self.picture_finished(&picture, now);
                    // It is presented before the next picture begins, which would replace it.
                    break;
                }
                Ok(Step::Fault(fault)) => self.notify(&fault, true),
                // What the stream found from its source is taken over; what the user has set stays.
                Ok(Step::Progress) => self.stream.take_found().into_iter().for_each(|found| self.controls.adopt(found)),
                Ok(Step::End(why)) => self.source_ended(why, now),
                Err(StreamError::Gpu(lost)) if lost.is_device_lost() => return Err(ConsoleError::DeviceLost(lost)),
                // A device that fails every time is treated as lost.
                Err(StreamError::Gpu(fault)) if self.faults.device_failed() => {
                    return Err(ConsoleError::DeviceLost(fault));
                }
                // What came cannot be drawn: it is too large, or beyond what the settings allow.
                Err(fault) => {
                    self.source_ended(Some(fault.to_string()), now);
                    break;
                }
            }
            if begun.elapsed() >= STREAM_SLICE || self.stream.is_waiting() || self.stream.is_idle() {
                break;
            }
        }
        let is_other = self.connection.follow(self.stream.frames(), self.stream.disconnected(), now);
        self.presentation.redraw_if(is_other);
        Ok(())
    }

    /// Reacts to the end of the source. `why`: the fault, if that was not expected.
    pub(super) fn source_ended(&mut self, why: Option<String>, now: Instant) {
        self.connection.ended(why, now);
        self.stream.replace_source(Feed::none());
        self.render_start.forget();
        self.presentation.redraw();
    }

    fn picture_finished(&mut self, picture: &FinishedPicture, now: Instant) {
        self.take_picture(picture.volume, now);
        // A coarse one says nothing of what a picture of this quality takes.
        if !picture.is_coarse {
            self.quality.picture_took(picture.work, picture.took);
            self.measured.times.pictures.add(picture.took);
        }
        self.measured.picture_finished(picture.latency, Instant::now());
        self.comparison.iter_mut().for_each(|comparison| comparison.shown.difference = None);
        self.start.picture_finished(picture.is_coarse);
        self.faults.picture_finished();
    }

    /// Takes what a picture was drawn of, of a volume, and says so when the fluid is lost at which it should start.
    fn take_picture(&mut self, volume: u32, now: Instant) {
        let Some(renderer) = self.stream.renderer() else { return };
        let outcome = renderer.unveiled().map(|start| start.outcome);
        let start_lines = unveil::lines(renderer.scene(), renderer.unveiled());
        self.presentation.picture_finished(ShownPicture { scene: renderer.scene().clone(), volume, start_lines });
        if let Some(lost) = self.render_start.take(outcome, now) {
            self.notify(&texts::render_start(lost), false);
        }
    }

    /// Takes the statistics of the last interval.
    fn take_statistics(&mut self, now: Instant) {
        if !self.measured.is_due(now) {
            return;
        }
        let acquisition_time = self.stream.acquisition_time();
        let delay = self.measured.times.delay();
        // Without a picture or a frame they cannot fail; a fault here must not stop the view.
        if let Ok(statistics) = self.stream.take_statistics() {
            let is_active = self.measured.add(&statistics, acquisition_time, || self.stream.totals());
            let is_other = delay.is_some() || self.measured.times.delay().is_some();
            self.presentation.redraw_if(self.visible.times && is_active || self.connection.is_live() && is_other);
        }
    }

    /// True while frames come from a probe or a pipe, or while some that came are not shown yet.
    pub(super) fn is_followed(&self) -> bool {
        let comes = self.measured.times.frames > 0.0 || !self.stream.is_idle();
        comes && self.connection.is_live() && self.stream.is_connected()
    }

    /// Writes the metrics if they are due.
    fn write_metrics(&mut self, now: Instant) {
        let source = SourceStatus {
            is_connected: self.connection.is_open() && self.stream.is_connected(),
            is_frozen: self.stream.is_frozen(),
            not_opened: self.connection.source.not_opened,
        };
        self.measured.write(&self.stream, &self.context, source, now);
    }

    /// Writes the metrics for the last time, when the program ends regularly.
    pub fn end_metrics(&mut self) {
        self.measured.end(&mut self.stream, &self.context);
    }

    /// When to update again without an event.
    fn next_wake(&self, now: Instant) -> Option<Instant> {
        if self.stream.is_waiting() {
            // Poll the picture at intervals: on a CPU device, polling all the time would take a core from the rendering.
            return Some(now + Duration::from_millis(1));
        }
        if !self.stream.is_idle() || self.presentation.waits() {
            return Some(now);
        }
        let tells_delay = self.is_followed() && self.measured.times.delay().is_some();
        [
            self.quality.pace.rests_at(now),
            self.replay.player.next,
            self.quality.warms_at(self.activity.acted, now),
            self.presets.due(self.activity.acted, now),
            self.replay.reel.due(now),
            self.hands.turntable.due(),
            self.exporter.exporting().map(|_| now + EXPORT_POLL),
            self.opening.due(self.reads_source(), now),
            self.comparison.as_ref().and_then(|comparison| comparison.due(now)),
        ]
        .into_iter()
        .flatten()
        .chain(self.presentation.due(now))
        .chain(self.connection.due(self.stream.is_frozen(), now))
        .chain(self.faults.due())
        .chain(self.measured.due(self.visible.times || tells_delay))
        .chain(self.notes.due())
        .min()
    }

    /// Presents the picture and the panels, if either is new.
    fn present(&mut self, now: Instant) -> Result<(), ConsoleError> {
        let renderer = self.stream.renderer().map(|renderer| (renderer.has_drawn(), renderer.is_paced()));
        let (has_drawn, is_paced) = renderer.unwrap_or_default();
        let picture = PictureState {
            has_drawn,
            is_drawing: self.stream.is_drawing(),
            drawn_for: self.stream.last_begun().map(|begun| begun.elapsed()),
            is_paced,
            is_idle: self.stream.is_idle(),
            has_started: self.start.is_over,
        };
        if !self.presentation.is_due(&picture, now) {
            return Ok(());
        }
        let is_drawing = picture.is_drawing;
        // Demo data is named even where there are no panels.
        let is_laid_out = self.fixed.overlay || self.origin().is_some();
        let content = self.presentation.content(&picture);
        let panels = is_laid_out.then(|| self.lay_out_panels(now, content.as_deref()));
        if !self.fixed.overlay && !has_drawn && self.presentation.presentations()[0] > 0 {
            self.presentation.keep_content();
            return Ok(());
        }
        let corner = self.room().picture.0;
        let Some(screen) = &mut self.presentation.screen else {
            self.presentation.up_to_date(content, self.panels.has_pending_input());
            return Ok(());
        };
        let presented = match self.stream.renderer().filter(|_| has_drawn) {
            Some(_) if is_drawing => screen.show_kept(corner, panels),
            Some(renderer) => renderer.present(screen, corner, panels),
            None => screen.show(panels),
        };
        match presented {
            Ok(PresentOutcome::Presented) => {
                screen.take_latencies().into_iter().for_each(|time| self.measured.times.scan_out.add(time));
                self.presentation.presented(content, is_drawing, self.panels.has_pending_input());
                if !has_drawn {
                    self.start.presented();
                }
                if !is_drawing {
                    self.measured.presented(Instant::now());
                }
                if !is_drawing && let Some(input) = self.activity.answered_by(self.stream.last_begun()) {
                    self.measured.times.input_latency.add(input.elapsed());
                }
            }
            // Try again when the window asks for it, or after a moment.
            Ok(PresentOutcome::NotPresentable) => self.presentation.not_presentable(now),
            Err(lost) if lost.is_device_lost() => return Err(ConsoleError::DeviceLost(lost)),
            Err(fault) => return Err(ConsoleError::Screen(fault)),
        }
        Ok(())
    }

    /// The reason why the source could not be opened and is not tried again, so that there was nothing to show; otherwise None.
    pub fn source_fault(&self) -> Option<String> {
        self.connection.fault()
    }

    /// A summary of the whole run in one line.
    pub fn summary(&mut self) -> String {
        let ([shown, between], dispatched) = (self.presentation.presentations(), self.stream.dispatches());
        let still = self.stream.last_begun().map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        format!(
            "{:.1} s: {} volumes, {shown} shown on the window, {between} of them while a picture was drawn, {dispatched} dispatches, none in the last \
             {still:.1} s; {}",
            self.fixed.started.elapsed().as_secs_f64(),
            self.stream.volumes_shown(),
            self.measured.line()
        )
    }
}
