//! Lays out the panels of the console and executes their commands.

use super::Console;
use crate::gpu;
use crate::panels::{Banner, PanelState, Pointers, SmallPictures, Timeliness, first_steps};
use crate::shown_picture::ShownPicture;
use std::time::{Duration, Instant};

impl Console {
    /// Lays out the panels, executes the commands of their controls, and returns what is to be drawn. `picture`: the one that they are drawn
    /// over.
    pub(super) fn lay_out_panels(&mut self, now: Instant, picture: Option<&ShownPicture>) -> gpu::window::Panels {
        let banner = self.banner(now);
        let shows_first_steps = self.shows_first_steps(picture.is_some() && banner.is_none());
        let notes: Vec<_> =
            self.export_note().into_iter().chain(self.label_work.note()).chain(self.notes.shown()).collect();
        let recordings = self.opening.named();
        let exit_key = self.fixed.exit.as_ref().filter(|_| self.fixed.is_kiosk).map(ToString::to_string);
        let loop_pictures = self.replay.reel.pictures(self.stream.cine().volumes());
        let says_work_at = self.activity.says_it_works_at().filter(|_| !self.stream.is_idle());
        let is_late = says_work_at.is_some_and(|at| at <= now);
        let room = self.room();
        let state = PanelState {
            shows_first_steps,
            controls: &self.controls,
            scene: self.stream.scene(),
            times: &self.measured.times,
            room,
            visible: &self.visible,
            files: self.opening.shown(),
            recordings: &recordings,
            reading: self.opening.told.as_ref(),
            is_turning: self.hands.turntable.is_on(),
            exporting: self.exporter.exporting().map(|name| (name, self.exporter.progress)),
            presets: self.presets.shown(),
            small: SmallPictures {
                are_drawn: self.fixed.small_pictures,
                looks: self.presets.tiles(),
                of_loop: &loop_pictures,
            },
            origin: self.origin(),
            shows_only_origin: !self.fixed.overlay,
            leaving: self.leaving.question,
            timeliness: Timeliness {
                is_frozen: self.stream.is_frozen(),
                is_live: self.is_followed(),
                is_late,
                ended: self.connection.ended_for(now),
            },
            cine: self.replay.player.state(self.cine_loop(), self.stream.cine_position()),
            picture,
            quality: (self.quality.label(), self.quality.pace.budget()),
            banner,
            notes: &notes,
            exit_key: exit_key.as_deref().unwrap_or_default(),
            pointers: Pointers { of_mouse: self.presentation.pointer, of_keys: self.hands.pointer.mark(room.picture) },
            compared: self.comparison.as_ref().map(|comparison| &comparison.shown),
        };
        let time = now.saturating_duration_since(self.fixed.started).as_secs_f64();
        let output = self.panels.lay_out(&state, self.presentation.size, time);
        let to_be_said = says_work_at.map_or(Duration::MAX, |at| at.saturating_duration_since(now));
        let repaint_after = if is_late { output.repaint_after } else { output.repaint_after.min(to_be_said) };
        self.presentation.laid_out(output.tree, repaint_after, now);
        for command in output.commands {
            self.execute(&command, now);
        }
        output.panels
    }

    /// True if the hints of the first start are shown now: over a picture, while nothing else is.
    fn shows_first_steps(&mut self, is_free: bool) -> bool {
        let room = self.room();
        let is_seen = self.fixed.overlay && self.visible.panels && !self.fixed.is_kiosk;
        let is_open =
            self.visible.is_any_open(&room) || self.leaving.asks() || self.opening.is_shown() || self.presets.is_shown;
        let has_room = first_steps::has_room(room.picture.1, self.panels.scale());
        is_free && is_seen && has_room && !is_open && self.notes.is_empty() && self.start.first_steps.show()
    }

    /// The message that lasts: a fault, or what is waited for.
    fn banner(&self, now: Instant) -> Option<Banner> {
        if let Some(banner) = self.faults.banner() {
            return Some(banner);
        }
        let gone = self.stream.disconnected();
        let (is_frozen, has_shown) = (self.stream.is_frozen(), self.stream.volumes_shown() > 0);
        // What is being read says it itself.
        if self.connection.is_opening() && self.opening.told.is_some() {
            return None;
        }
        let (title, text, is_fault) = self.connection.notice(gone.as_deref(), is_frozen, has_shown, now)?;
        let is_start = !is_fault && text.is_empty() && self.connection.is_open();
        let of_start = self.start.banner(title).filter(|_| is_start);
        of_start.or_else(|| Some(Banner { title: title.into(), text, is_fault }))
    }
}
