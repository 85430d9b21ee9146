//! Commands done: on the settings by the controls, on everything else here.

use super::Console;
use crate::scene::Settings;
use crate::ui::command::{Command, Tool};
use crate::ui::controls::Change;
use std::time::{Duration, Instant};

/// Between two volumes of a loop that is played.
pub(super) const LOOP: Duration = Duration::from_millis(200);

impl Console {
    pub(super) fn act(&mut self, command: &Command, now: Instant) {
        match self.controls.apply(command, self.stream.scene()) {
            Change::Nothing => return,
            Change::Tool => {}
            Change::Settings => {
                self.touched.get_or_insert(now);
                if is_move(command) {
                    self.pace.moves(now);
                } else {
                    // Another scene takes another time.
                    self.pace.forget();
                }
            }
            Change::Screen(command) => self.on_screen(&command, now),
        }
        self.stale = true;
    }

    fn on_screen(&mut self, command: &Command, now: Instant) {
        let count = self.stream.cine().volumes().len();
        match *command {
            Command::Freeze => {
                self.playing = None;
                self.stream.freeze(!self.stream.is_frozen());
            }
            Command::Cine(by) => {
                let at = self.stream.cine_position().unwrap_or(count.saturating_sub(1)) as i64 + i64::from(by);
                self.look_back(at.clamp(0, count.saturating_sub(1) as i64) as usize);
                self.touched.get_or_insert(now);
            }
            Command::CineAt(place) => {
                self.look_back(place.min(count.saturating_sub(1)));
                self.touched.get_or_insert(now);
            }
            Command::CinePlay => {
                self.stream.freeze(true);
                self.playing = match self.playing {
                    None if count > 1 => Some(now),
                    _ => None,
                };
            }
            Command::SavePicture => self.save_picture(),
            Command::SaveLoop => self.save_loop(),
            Command::Help => self.help = !self.help,
            Command::Hud => self.hud = !self.hud,
            Command::Panels => {
                self.is_panelled = !self.is_panelled && self.options.overlay;
                self.fit();
            }
            Command::FullScreen => self.next.toggles_full_screen |= !self.options.is_kiosk,
            // A kiosk has one way out, and it is not a key that a sleeve may press.
            Command::Exit => self.next.exit |= !self.options.is_kiosk,
            _ => {}
        }
    }

    fn look_back(&mut self, place: usize) {
        self.playing = None;
        self.stream.freeze(true);
        self.stream.show_cine_volume(place);
    }

    /// The next volume of a loop that is played, when it is due.
    pub(super) fn play(&mut self, now: Instant) {
        let (Some(due), count) = (self.playing, self.stream.cine().volumes().len()) else { return };
        if count < 2 {
            self.playing = None;
        } else if now >= due && !self.stream.is_replaying() {
            let next = self.stream.cine_position().map_or(0, |place| (place + 1) % count);
            self.stream.show_cine_volume(next);
            self.playing = Some((due + LOOP).max(now));
        }
    }

    fn save_picture(&mut self) {
        let picture = match self.stream.renderer().filter(|renderer| renderer.has_drawn()) {
            Some(renderer) => renderer.end_picture().map_err(|e| e.to_string()),
            None => Err("there is no picture yet".into()),
        };
        if let Err(fault) = picture.and_then(|picture| self.keep.picture(picture)) {
            self.say(&format!("the picture was not saved: {fault}"), true);
        }
    }

    fn save_loop(&mut self) {
        let kept: Vec<_> = self.stream.cine().volumes().iter().cloned().collect();
        let saved = match self.stream.header() {
            Some(header) if !kept.is_empty() => {
                let header = header.clone();
                self.keep.volumes(header, kept)
            }
            _ => Err("there are no volumes yet".into()),
        };
        if let Err(fault) = saved {
            self.say(&format!("the loop was not saved: {fault}"), true);
        }
    }

    /// The settings as they are to be drawn now: the hand's, on the rung that holds the budget.
    pub(super) fn wanted(&self, now: Instant) -> (usize, Settings) {
        let rung = self.pace.rung(now).min(self.rungs.len().saturating_sub(1));
        let voxel = self.stream.scene().map_or(0.5, |scene| scene.grid.pitch[0].min(scene.grid.pitch[1]));
        let settings = self.controls.settings();
        let mut wanted = match self.rungs.get(rung) {
            Some(stands) => stands.apply(settings, voxel),
            None => settings.clone(),
        };
        // A region that grows shows what was left out: with all of it made, dragging a face needs no frame again.
        wanted.slices.everything |= matches!(self.controls.tool(), Tool::Region | Tool::Clip);
        (rung, wanted)
    }
}

/// Whether a command is one of many, as those of a drag are.
fn is_move(command: &Command) -> bool {
    matches!(
        command,
        Command::Turn(_)
            | Command::Roll(_)
            | Command::Zoom(_)
            | Command::Pan(_)
            | Command::Light(_)
            | Command::Face(..)
            | Command::Clip(_)
            | Command::PlaneBy(_)
            | Command::Meet(_)
            | Command::PlaneTurn(_)
            | Command::Slide(..)
            | Command::Nudge(..)
    )
}
