//! One update of the console: polls the source, draws what is due, and presents it. Nothing is presented unless something changed.

use super::{Console, ConsoleError, FAULT_CHECK_INTERVAL, LoopRequest};
use crate::frame_budget;
use crate::gpu;
use crate::gpu::window::PresentOutcome;
use crate::live::metrics::{LiveMetrics, SourceStatus};
use crate::live::volume_pool::VolumeCounts;
use crate::live::{Feed, FinishedPicture, StartStep, Step, StreamError};
use crate::panels::{self, Banner, PanelState};
use crate::passes::unveil;
use crate::source_supervisor::SourceState;
use crate::texts;
use crate::times::RecentTimes;
use std::time::{Duration, Instant};

/// Time for the stream in one update, so that inputs are handled between.
const STREAM_SLICE: Duration = Duration::from_millis(4);
/// The device is opened again after so many faults without a picture in between.
const MAX_DEVICE_FAULTS: u32 = 5;
/// While the next picture is not ready, the window keeps the old content for so long: less disturbing than a black moment.
const BLANK_DELAY: Duration = Duration::from_millis(400);
/// Panels that changed wait so long for the picture that is being drawn: presented on their own they take the device from it, and a picture of a view that
/// moves is done sooner.
const PICTURE_PATIENCE: Duration = Duration::from_millis(100);
/// Interval of the attempts to present while there is no surface.
const PRESENT_RETRY: Duration = Duration::from_millis(100);
/// Interval of the updates while there is no picture to show.
const BLANK_INTERVAL: Duration = Duration::from_millis(20);
/// Longest that the screen says less of the start than is known: each drawing of it takes the processor from what it tells of.
const START_INTERVAL: Duration = Duration::from_millis(100);
/// That fluid is lost is said at most so often: it may come and go with each live volume.
const LOST_INTERVAL: Duration = Duration::from_secs(20);
/// How often it is asked how far an export is.
const EXPORT_POLL: Duration = Duration::from_millis(300);
/// The help needs a window of this height, points.
const MIN_HELP_HEIGHT: f32 = 200.0;
/// Lines of a shader compiler's message that are shown.
const MAX_SHADER_LINES: usize = 12;

/// When it is said that the fluid at which rendering should start is lost: once each time, and not more often than every [`LOST_INTERVAL`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LostFluid {
    /// It is lost, and this was said.
    is_told: bool,
    told_at: Option<Instant>,
}

impl LostFluid {
    /// True if it is to be said now, at a picture whose fluid is lost or found.
    fn is_due(&mut self, is_lost: bool, now: Instant) -> bool {
        self.is_told &= is_lost;
        let is_rare = self.told_at.is_none_or(|at| now.saturating_duration_since(at) >= LOST_INTERVAL);
        let is_due = is_lost && !self.is_told && is_rare;
        if is_due {
            (self.is_told, self.told_at) = (true, Some(now));
        }
        is_due
    }
}

impl Console {
    /// Does what is due and returns what the event loop does next.
    ///
    /// # Errors
    /// The device or the screen is lost.
    pub fn update(&mut self, now: Instant) -> Result<LoopRequest, ConsoleError> {
        let updated = self.advance(now);
        if let (Err(ConsoleError::DeviceLost(why)), Some(metrics)) = (&updated, &mut self.metrics) {
            metrics.device_lost(why);
        }
        updated
    }

    fn advance(&mut self, now: Instant) -> Result<LoopRequest, ConsoleError> {
        let begun = Instant::now();
        self.silence.begin_update(now);
        if let Some((fault, at)) = &mut self.startup_fault
            && now >= *at
        {
            *at = now + FAULT_CHECK_INTERVAL;
            self.request.restart |= (fault.is_resolved)();
        }
        if let Some(feed) = self.source.poll(now).filter(|_| self.startup_fault.is_none()) {
            self.stream.replace_source(feed);
            self.silence.frames_came(now);
            self.needs_redraw = true;
        }
        while let Some(saved) = self.exporter.poll() {
            let ends = saved.complete_to.is_some() && saved.complete_to == self.leaves_when_saved;
            match saved.file {
                Ok(file) => {
                    self.saved_volume = self.saved_volume.max(saved.complete_to);
                    self.request.exit |= ends;
                    if file.extension().is_some_and(|end| end == "toml") {
                        self.opening.remember(&file);
                    }
                    self.notify(&texts::saved(file.display()), false);
                }
                Err(fault) => {
                    self.leaves_when_saved = self.leaves_when_saved.filter(|_| !ends);
                    self.notify(&texts::not_saved(fault), true);
                }
            }
        }
        self.poll_opening(now);
        self.poll_counting();
        self.poll_thumbnails(now);
        self.poll_export();
        self.turn(now);
        self.advance_cine(now);
        self.send_settings(now);
        self.run_stream(now)?;
        self.follow_volumes(now);
        self.follow_start(now);
        self.refreeze();
        self.warm(now);
        let shader_fault = self.shaders.as_ref().and_then(|folder| folder.fault());
        self.needs_redraw |= shader_fault != self.shader_fault;
        self.shader_fault = shader_fault;
        self.take_statistics(now);
        let before = self.notes.len();
        self.notes.retain(|(until, _)| *until > now);
        let stall_ends = self.stall_shown_until.take_if(|until| *until <= now).is_some();
        self.needs_redraw |= self.notes.len() != before || stall_ends || self.repaint_at.is_some_and(|at| at <= now);
        self.present(now)?;
        self.write_metrics(now);
        let is_busy = self.stream.is_drawing() || !self.stream.is_idle();
        self.silence.end_update(now, begun.elapsed(), is_busy);
        let request = std::mem::take(&mut self.request);
        // The console that replaces this one is updated at once: nothing else may wake it. What this one waits for is not its concern.
        let wake_at = if request.restart { Some(now) } else { self.next_wake(now) };
        Ok(LoopRequest { wake_at, ..request })
    }

    /// Gives the stream the settings that are to be drawn now.
    fn send_settings(&mut self, now: Instant) {
        let (quality, settings) = self.effective_settings(now);
        if self.sent_settings.as_ref() == Some(&settings) || self.rejected_settings.as_ref() == Some(&settings) {
            return;
        }
        self.needs_redraw |= quality != self.quality;
        self.quality = quality;
        match self.stream.lower(settings.clone(), self.full_settings()) {
            Ok(()) => {
                self.sent_settings = Some(settings);
                let first_input = self.unsent_input.take().or(self.unshown_input.map(|(input, _)| input));
                self.unshown_input = first_input.map(|input| (input, Instant::now()));
            }
            Err(fault) => {
                self.rejected_settings = Some(settings);
                self.notify(&fault.to_string(), true);
            }
        }
    }

    /// Takes over what the stream found from its source. What the user has set stays.
    fn adopt_found(&mut self) {
        if let Some(found) = self.stream.take_found() {
            self.controls.adopt(found);
        }
    }

    /// Measures how often volumes come.
    fn follow_volumes(&mut self, now: Instant) {
        match self.stream.live_volumes() {
            Some(count) if count > self.live_volumes => self.pace.volumes_came(count - self.live_volumes, now),
            Some(_) => {}
            None => self.pace.volumes_stopped(),
        }
        self.live_volumes = self.stream.live_volumes().unwrap_or(self.live_volumes);
    }

    /// Draws the panels again where the start goes on.
    fn follow_start(&mut self, now: Instant) {
        let step = self.stream.start_step();
        let is_other =
            step.map(|step| std::mem::discriminant(&step)) != self.start_step.map(|step| std::mem::discriminant(&step));
        let is_due = now.saturating_duration_since(self.start_step_at) >= START_INTERVAL;
        if is_other || (step != self.start_step && is_due) {
            (self.start_step, self.start_step_at, self.needs_redraw) = (step, now, true);
        }
    }

    /// Runs the stream until a picture is finished, it has nothing to do, or its time slice ends.
    fn run_stream(&mut self, now: Instant) -> Result<(), ConsoleError> {
        let begun = Instant::now();
        loop {
            // No panels may be presented while the device draws: the screen says before what it is about to do.
            if !self.tells_of_picture && self.stream.start_step() == Some(StartStep::Picture) {
                self.tells_of_picture = true;
                break;
            }
            match self.stream.step(Duration::ZERO) {
                Ok(Step::Picture(picture)) => {
                    self.picture_finished(&picture, now);
                    self.device_faults = 0;
                    // It is presented before the next picture begins, which would replace it.
                    break;
                }
                Ok(Step::Fault(fault)) => self.notify(&fault, true),
                Ok(Step::Progress) => self.adopt_found(),
                Ok(Step::End(why)) => self.source_ended(why, now),
                Err(StreamError::Gpu(lost)) if lost.is_device_lost() => return Err(ConsoleError::DeviceLost(lost)),
                // A device that fails every time is treated as lost.
                Err(StreamError::Gpu(fault)) if self.device_faults >= MAX_DEVICE_FAULTS => {
                    self.device_faults = 0;
                    return Err(ConsoleError::DeviceLost(fault));
                }
                // What came cannot be drawn: it is too large, or beyond what the settings allow.
                Err(fault) => {
                    self.device_faults += u32::from(matches!(fault, StreamError::Gpu(_)));
                    self.source_ended(Some(fault.to_string()), now);
                    break;
                }
            }
            if begun.elapsed() >= STREAM_SLICE || self.stream.is_waiting() || self.stream.is_idle() {
                break;
            }
        }
        let frames = self.stream.frames();
        let gone = self.stream.disconnected();
        self.needs_redraw |= gone != self.disconnected;
        self.disconnected = gone;
        if frames != self.frames {
            self.frames = frames;
            self.silence.frames_came(now);
        }
        Ok(())
    }

    /// Handles the end of the source. `why`: the fault, if it ended unexpectedly.
    pub(super) fn source_ended(&mut self, why: Option<String>, now: Instant) {
        if let Some(why) = &why {
            tracing::warn!("source: {why}");
        }
        self.source.ended(why, now);
        self.stream.replace_source(Feed::none());
        self.fluid = LostFluid::default();
        self.needs_redraw = true;
    }

    fn picture_finished(&mut self, picture: &FinishedPicture, now: Instant) {
        self.has_new_picture = true;
        self.take_start(now);
        // A coarse one says nothing of what a picture of this quality takes.
        if !picture.is_coarse {
            self.pace.picture_took(picture.work, self.quality, picture.took);
            self.times.pictures.add(picture.took);
        }
        if !self.has_started {
            tracing::debug!("start: a picture {}", if picture.is_coarse { "with few rays" } else { "in full" });
        }
        self.has_started |= !picture.is_coarse;
    }

    /// Takes where the rendering of the picture starts, and says so when the fluid is lost.
    fn take_start(&mut self, now: Instant) {
        let renderer = self.stream.renderer();
        let outcome = renderer.as_ref().and_then(|renderer| renderer.unveiled()).map(|start| start.outcome);
        self.start_lines = renderer.map_or(Vec::new(), |renderer| unveil::lines(renderer.scene(), renderer.unveiled()));
        if outcome.is_none() {
            // Switched off: the next time is another one.
            self.fluid = LostFluid::default();
        }
        let lost = outcome.filter(|outcome| !outcome.is_found());
        let is_due = self.fluid.is_due(lost.is_some(), now);
        if let Some(outcome) = lost.filter(|_| is_due) {
            self.notify(&texts::render_start(outcome), false);
        }
    }

    /// Takes the statistics of the last interval.
    fn take_statistics(&mut self, now: Instant) {
        if now.saturating_duration_since(self.statistics_at) < self.statistics_interval {
            return;
        }
        self.statistics_at = now;
        let acquisition_time = self.stream.acquisition_time();
        // Without a picture or a frame they cannot fail; a fault here must not stop the view.
        if let Ok(statistics) = self.stream.take_statistics() {
            let is_active = statistics.pictures > 0 || statistics.frames > 0;
            self.needs_redraw |= self.shows_times && is_active;
            // A volume may also end while nothing arrives.
            if is_active || statistics.volumes != VolumeCounts::default() {
                tracing::debug!("{}; {}", statistics.line(acquisition_time), self.stream.totals());
            }
            self.times.add(&statistics, acquisition_time);
            self.metrics.iter_mut().for_each(|metrics| metrics.add(&statistics));
        }
    }

    /// Writes the metrics if they are due.
    fn write_metrics(&mut self, now: Instant) {
        let Some(metrics) = self.metrics.as_mut().filter(|metrics| now >= metrics.due()) else { return };
        let source = SourceStatus {
            is_connected: matches!(self.source.state(), SourceState::Open) && self.stream.is_connected(),
            is_frozen: self.stream.is_frozen(),
            not_opened: self.source.not_opened(),
        };
        metrics.write(now, &self.stream, &self.context, source);
    }

    /// Writes the metrics for the last time: the program ends in order.
    pub fn end_metrics(&mut self) {
        let Some(mut metrics) = self.metrics.take() else { return };
        if let Ok(statistics) = self.stream.take_statistics() {
            metrics.add(&statistics);
        }
        metrics.end(&self.stream, &self.context);
    }

    /// When to update again without an event.
    fn next_wake(&self, now: Instant) -> Option<Instant> {
        if self.stream.is_waiting() {
            // Poll the picture at intervals: on a CPU device, polling all the time would take a core from the rendering.
            return Some(now + Duration::from_millis(1));
        }
        let can_present = self.screen.is_some() && self.blank_since.is_none() && self.present_retry_at.is_none();
        if !self.stream.is_idle() || (self.needs_redraw && can_present) {
            return Some(now);
        }
        let notes = self.notes.iter().map(|(until, _)| *until);
        let is_listening = matches!(self.source.state(), SourceState::Open) && !self.stream.is_frozen();
        let silence = Some(self.silence.due()).filter(|at| is_listening && *at > now);
        let has_pictures = self.times.pictures.newest().is_some();
        let statistics =
            self.shows_times.then_some(self.statistics_at + self.statistics_interval).filter(|_| has_pictures);
        let fault_check = self.startup_fault.as_ref().map(|(_, at)| *at);
        [
            fault_check,
            self.present_retry_at,
            self.source.wakes_at(),
            self.pace.rests_at(now),
            self.repaint_at,
            self.player.due(),
            self.stall_shown_until,
            self.metrics.as_ref().map(LiveMetrics::due),
            self.warms_at(now),
            self.thumbnails_at(now),
            self.turns_at(),
            self.exporter.exporting().map(|_| now + EXPORT_POLL),
            self.reading_wakes_at(now),
            silence,
            statistics,
        ]
        .into_iter()
        .flatten()
        .chain(notes)
        .chain(self.blank_since.map(|_| now + BLANK_INTERVAL))
        .min()
    }

    /// Presents the picture and the panels, if either is new.
    fn present(&mut self, now: Instant) -> Result<(), ConsoleError> {
        let is_new = self.has_new_picture || self.needs_redraw;
        // While a picture is being drawn, its image is the device's: panels get the last one, of which the screen has a copy, if they can be
        // drawn before the picture is done, and if that takes long. Otherwise both are presented together.
        let is_between = self.stream.is_drawing();
        let is_paced = self.stream.renderer().is_some_and(|renderer| renderer.is_paced());
        let takes_long = self.stream.last_begun().is_some_and(|begun| begun.elapsed() >= PICTURE_PATIENCE);
        let gets_between = self.has_started && is_paced && takes_long;
        let is_late = is_between && !gets_between;
        if !is_new || is_late || self.present_retry_at.is_some_and(|until| now < until) {
            return Ok(());
        }
        let has_drawn = self.stream.renderer().is_some_and(|renderer| renderer.has_drawn());
        // At the start there is no old content to keep.
        if !has_drawn && !self.stream.is_idle() && self.has_started {
            let since = *self.blank_since.get_or_insert(now);
            if now.saturating_duration_since(since) < BLANK_DELAY {
                return Ok(());
            }
        }
        self.blank_since = None;
        // Demo data is named even where there are no panels.
        let is_laid_out = self.fixed.overlay || self.origin().is_some();
        let panels = is_laid_out.then(|| self.lay_out_panels(now, has_drawn));
        if !self.fixed.overlay && !has_drawn && self.screen.as_ref().is_some_and(|s| s.shown() > 0) {
            self.needs_redraw = false;
            return Ok(());
        }
        let corner = self.picture_area().0;
        let Some(screen) = &mut self.screen else {
            (self.has_new_picture, self.needs_redraw) = (false, self.panels.has_pending_input());
            return Ok(());
        };
        let presented = match self.stream.renderer().filter(|_| has_drawn) {
            Some(_) if is_between => screen.show_kept(corner, panels),
            Some(renderer) => renderer.present(screen, corner, panels),
            None => screen.show(panels),
        };
        match presented {
            Ok(PresentOutcome::Presented) => {
                (self.has_new_picture, self.needs_redraw) = (false, self.panels.has_pending_input());
                self.shown_between += u64::from(is_between);
                self.present_retry_at = None;
                if let Some(step) = self.start_step.filter(|_| !has_drawn && !self.has_started) {
                    tracing::debug!("start: the screen says {step:?}");
                }
                if !is_between {
                    self.measure_input_latency();
                }
                let shown = self.screen.as_mut().map(|screen| screen.take_latencies()).unwrap_or_default();
                shown.into_iter().for_each(|time| self.times.scan_out.add(time));
            }
            // Try again when the window asks for it, or after a moment.
            Ok(PresentOutcome::NotPresentable) => self.present_retry_at = Some(now + PRESENT_RETRY),
            Err(lost) if lost.is_device_lost() => return Err(ConsoleError::DeviceLost(lost)),
            Err(fault) => return Err(ConsoleError::Screen(fault)),
        }
        Ok(())
    }

    /// Records the input latency if the presented picture was begun after the settings of the input were sent.
    fn measure_input_latency(&mut self) {
        let last_begun = self.stream.last_begun();
        let answered = self.unshown_input.take_if(|(_, sent)| last_begun.is_some_and(|begun| begun >= *sent));
        if let Some((input, _)) = answered {
            self.times.input_latency.add(input.elapsed());
        }
    }

    /// Why there was nothing to show: the source could not be opened.
    pub fn source_fault(&self) -> Option<String> {
        match self.source.state() {
            SourceState::Ended(why) if self.source.not_opened() > 0 => why.clone(),
            _ => None,
        }
    }

    /// A summary of the run in one line.
    pub fn summary(&mut self) -> String {
        let ms = |value: Option<f64>| value.map_or("-".into(), |ms| format!("{ms:.1}"));
        let percentiles =
            |times: &RecentTimes| format!("p50 {} p95 {}", ms(times.percentile(0.5)), ms(times.percentile(0.95)));
        let (shown, dispatched) = (self.screen.as_ref().map_or(0, |s| s.shown()), self.stream.dispatches());
        let still = self.stream.last_begun().map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        format!(
            "{:.1} s: {} volumes, {} shown on the window, {} of them while a picture was drawn, {dispatched} dispatches, none in the last {still:.1} s; ms: picture {}, \
             input to picture {}{}",
            self.started.elapsed().as_secs_f64(),
            self.stream.volumes_shown(),
            shown,
            self.shown_between,
            percentiles(&self.times.pictures),
            percentiles(&self.times.input_latency),
            match self.times.scan_out.newest() {
                Some(_) => format!(", presentation to monitor {}", percentiles(&self.times.scan_out)),
                None => String::new(),
            }
        )
    }

    /// Lays out the panels and executes the commands that they give.
    fn lay_out_panels(&mut self, now: Instant, has_drawn: bool) -> gpu::window::Panels {
        let banner = self.banner(now);
        let shows_first_steps = self.shows_first_steps(has_drawn && banner.is_none());
        let notes: Vec<_> =
            self.export_note().into_iter().chain(self.notes.iter().map(|(_, note)| note.clone())).collect();
        let recordings = self.opening.named();
        let quality = frame_budget::label(self.quality, &self.rungs);
        let exit_key = match (&self.fixed.exit, self.fixed.is_kiosk) {
            (Some(chord), true) => chord.to_string(),
            (None, true) => String::new(),
            (_, false) => String::new(),
        };
        let state = PanelState {
            shows_first_steps,
            controls: &self.controls,
            scene: self.stream.scene(),
            times: &self.times,
            picture: self.picture_area(),
            shows_panels: self.shows_panels,
            has_column: panels::has_column(self.size, self.panels.scale(), self.shows_panels),
            has_drawer: self.has_drawer(),
            rail: self.rail,
            files: self.opening.shown(),
            recordings: &recordings,
            reading: self.opening.told(),
            shows_exports: self.shows_exports,
            is_turning: self.turning.is_some(),
            exporting: self.exporter.exporting(),
            export_progress: self.export_progress,
            presets: self.presets.shown(),
            // egui panics if a list has a negative height.
            shows_help: self.shows_help && self.size[1] as f32 > MIN_HELP_HEIGHT * self.panels.scale(),
            shows_times: self.shows_times,
            help_search: self.help_search.as_deref(),
            origin: self.origin(),
            shows_only_origin: !self.fixed.overlay,
            asks_to_leave: self.asks_to_leave,
            is_frozen: self.stream.is_frozen(),
            cine: self.player.state(self.cine_loop(), self.stream.cine_position()),
            has_drawn,
            quality,
            budget: self.pace.budget(),
            banner,
            notes: &notes,
            exit_key: &exit_key,
            start_lines: &self.start_lines,
            pointer: self.pointer,
            keyboard_pointer: self.keyboard_pointer.mark(self.picture_area()),
        };
        let time = now.saturating_duration_since(self.started).as_secs_f64();
        let output = self.panels.lay_out(&state, self.size, time);
        self.repaint_at = (output.repaint_after < Duration::from_secs(3600)).then(|| now + output.repaint_after);
        self.tree = output.tree.or(self.tree.take());
        for command in output.commands {
            self.execute(&command, now);
        }
        output.panels
    }

    /// The message for a lasting fault.
    fn banner(&self, now: Instant) -> Option<Banner> {
        let banner = |title: &str, text: &str, is_fault| Banner { title: title.into(), text: text.into(), is_fault };
        if let Some((fault, _)) = &self.startup_fault {
            return Some(banner(&fault.title, &fault.why, true));
        }
        if let Some(fault) = &self.shader_fault {
            let lines: Vec<&str> = fault.lines().take(MAX_SHADER_LINES).collect();
            return Some(banner(texts::SHADER_ERROR, &lines.join("\n"), true));
        }
        if self.stall_shown_until.is_some() {
            let text = texts::DEVICE_STALLED_ABOUT;
            return Some(banner(texts::DEVICE_STALLED, text, true));
        }
        let is_silent = self.silence.is_silent(now) && !self.stream.is_frozen();
        let (state, gone) = (self.source.state(), self.stream.disconnected());
        let has_shown = self.stream.volumes_shown() > 0;
        // What is being read says it itself.
        if *state == SourceState::Opening && self.opening.told().is_some() {
            return None;
        }
        let (title, text, is_fault) = state.notice(self.fixed.source, gone.as_deref(), is_silent, has_shown)?;
        let is_start = !is_fault && text.is_empty() && matches!(state, SourceState::Open);
        match self.start_step.filter(|_| is_start) {
            Some(StartStep::Compiling { count: 0, .. }) => Some(banner(texts::PREPARING_THE_DEVICE, "", false)),
            Some(StartStep::Compiling { done, count }) => {
                Some(banner(texts::PREPARING_THE_DEVICE, &texts::shaders_compiled(done, count), false))
            }
            Some(StartStep::Frames { done: 0, .. }) => Some(banner(title, texts::WAITING_FOR_FRAME, false)),
            Some(StartStep::Frames { done, count }) => {
                Some(banner(title, &texts::frames_of_first_volume(done, count), false))
            }
            Some(StartStep::Picture) => Some(banner(texts::DRAWING_FIRST_PICTURE, "", false)),
            Some(StartStep::Source) | None => Some(banner(title, &text, is_fault)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a message at every other live volume, and that a loss during the pause is never said.
    #[test]
    fn lost_fluid_is_said_once_and_not_too_often() {
        let begin = Instant::now();
        let mut fluid = LostFluid::default();
        let mut said = |seconds: u64, is_lost: bool| fluid.is_due(is_lost, begin + Duration::from_secs(seconds));
        assert!(!said(0, false) && said(1, true) && !said(2, true) && !said(60, true), "once");
        assert!(!said(61, false) && said(62, true), "each time");
        assert!((63..81).all(|second| !said(second, second % 2 == 0)), "not at every change");
        assert!(!said(81, true) && said(82, true) && !said(83, true), "later, if it is still lost then");
    }
}
