//! The list of presets: built-in ones as they look with the present volume, and those of the user, which are saved, renamed and deleted here.

use super::Console;
use crate::command::Command;
use crate::controls::{Change, EXAMS};
use crate::gpu::Wake;
use crate::input::Key;
use crate::panels::{PresetTile, PresetsShown};
use crate::picture::Picture;
use crate::scene::{Scene, Settings};
use crate::source::live::SourceKind;
use crate::texts;
use crate::thumbnails::{Job, Thumbnails};
use crate::user_presets::{self, MAX_NAME, MAX_PRESETS, UserPreset, checked_name};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Least time between two rounds of thumbnails of volumes that go on coming.
const LIVE_INTERVAL: Duration = Duration::from_secs(5);
/// How long after an input thumbnails are made.
const REST: Duration = Duration::from_millis(300);
/// The view changed much: it turned by so many degrees, or zoom or an edge of the region changed by this share.
const MUCH_DEGREES: f64 = 15.0;
const MUCH: f64 = 0.1;

/// The list while it is shown, and the presets of the user.
pub(super) struct Presets {
    /// The presets of the user. None: there are none.
    file: Option<PathBuf>,
    is_shown: bool,
    own: Vec<UserPreset>,
    /// Why they cannot be read.
    fault: Option<String>,
    naming: Option<Naming>,
    /// Those of the user before the last change.
    before: Option<Vec<UserPreset>>,
    thumbnails: Thumbnails,
    /// What the thumbnails were made of.
    made_of: Option<MadeOf>,
}

/// A name that is being typed.
struct Naming {
    text: String,
    /// The name of the preset that is renamed; none: a new one.
    of: Option<String>,
}

struct MadeOf {
    volume: u32,
    settings: Settings,
    own: Vec<UserPreset>,
    at: Instant,
}

impl Presets {
    pub(super) fn new(file: Option<PathBuf>, wake: Wake) -> Presets {
        Presets {
            file,
            is_shown: false,
            own: Vec::new(),
            fault: None,
            naming: None,
            before: None,
            thumbnails: Thumbnails::new(wake),
            made_of: None,
        }
    }

    pub(super) fn is_shown(&self) -> bool {
        self.is_shown
    }

    pub(super) fn is_naming(&self) -> bool {
        self.naming.is_some()
    }

    /// The thumbnails are made again: their device is gone.
    pub(super) fn device_lost(&mut self) {
        self.thumbnails.stop();
        self.made_of = None;
    }

    fn close(&mut self) {
        (self.is_shown, self.naming, self.before, self.made_of) = (false, None, None, None);
        self.thumbnails.clear();
    }

    fn read(&mut self) {
        let read = self.file.as_deref().map_or(Ok(Vec::new()), user_presets::read);
        (self.own, self.fault) = match read {
            Ok(own) => (own, None),
            Err(fault) => (Vec::new(), Some(fault)),
        };
    }

    /// What the panels show of the list.
    pub(super) fn shown(&self) -> Option<PresetsShown<'_>> {
        if !self.is_shown {
            return None;
        }
        let pictures = self.thumbnails.pictures();
        let picture = |n: usize| pictures.get(n).cloned().flatten();
        let built_in = EXAMS.iter().enumerate().map(|(n, exam)| PresetTile {
            name: exam.title,
            hint: exam.hint,
            picture: picture(n),
            own: None,
        });
        let own = self.own.iter().enumerate().map(|(n, preset)| PresetTile {
            name: &preset.name,
            hint: texts::OWN_PRESET_HINT,
            picture: picture(EXAMS.len() + n),
            own: Some(n),
        });
        Some(PresetsShown {
            tiles: built_in.chain(own).collect(),
            can_save: self.file.is_some() && self.fault.is_none(),
            fault: self.fault.as_deref(),
            naming: self.naming.as_ref().map(|naming| (naming.text.as_str(), naming.of.is_some())),
            can_restore: self.before.is_some(),
        })
    }
}

/// True if a view changed so much that its thumbnails look wrong.
fn differs_much(a: &Settings, b: &Settings) -> bool {
    let turned = |a: f64, b: f64| (a - b + 180.0).rem_euclid(360.0) - 180.0;
    let (from, to) = (&a.camera, &b.camera);
    let angles = [(from.azimuth, to.azimuth), (from.elevation, to.elevation), (from.roll, to.roll)];
    let is_turned = angles.into_iter().any(|(a, b)| turned(a, b).abs() > MUCH_DEGREES);
    let is_zoomed = (from.zoom / to.zoom).ln().abs() > MUCH;
    let sides = |s: &Settings| [s.region.lateral, s.region.depth, s.region.elevation];
    let is_cropped = sides(a).into_iter().zip(sides(b)).any(|sides| match sides {
        (Some([low, high]), Some([other_low, other_high])) => {
            (low - other_low).abs().max((high - other_high).abs()) > MUCH * (high - low)
        }
        (a, b) => a != b,
    });
    is_turned
        || is_zoomed
        || is_cropped
        || a.cuts != b.cuts
        || a.region.start_curve != b.region.start_curve
        || a.clip != b.clip
        || a.planes.position != b.planes.position
        || a.planes.curve != b.planes.curve
}

impl Console {
    /// The small pictures of the list of presets; none while it is not shown.
    pub fn thumbnails(&self) -> &[Option<Arc<Picture>>] {
        self.presets.thumbnails.pictures()
    }

    pub(super) fn toggle_presets(&mut self) {
        match self.presets.is_shown {
            true => self.presets.close(),
            false => {
                self.presets.read();
                self.presets.is_shown = true;
                if let Some(fault) = self.presets.fault.clone() {
                    self.notify(&fault, true);
                }
            }
        }
        self.needs_redraw = true;
    }

    fn with_preset(&self, n: usize, scene: &Scene) -> Result<Settings, String> {
        if n < EXAMS.len() {
            let is_phantom = self.fixed.source == SourceKind::Demo;
            return self.controls.with_exam(n, scene, is_phantom).map_err(str::to_string);
        }
        let own = self.presets.own.get(n - EXAMS.len()).ok_or_else(|| texts::NO_SUCH_PRESET.to_string())?;
        self.controls.with_look(&own.look()?, scene).map_err(str::to_string)
    }

    /// Takes the n-th preset of the list, and closes the list.
    pub(super) fn take_preset(&mut self, n: usize, now: Instant) {
        if n >= EXAMS.len() + self.presets.own.len() {
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
                    self.last_change = now;
                    self.unsent_input.get_or_insert(now);
                    self.pace.forget();
                }
            }
            Err(why) => self.notify(&why, true),
        }
    }

    /// Begins to type a name: of a new preset, or of the n-th of the user.
    pub(super) fn begin_naming(&mut self, of: Option<usize>) {
        if !self.presets.is_shown || self.presets.file.is_none() || self.presets.fault.is_some() {
            return;
        }
        let of = match of {
            None if self.presets.own.len() >= MAX_PRESETS => {
                return self.notify(&texts::too_many_presets(MAX_PRESETS), true);
            }
            None => None,
            Some(n) => match self.presets.own.get(n) {
                Some(preset) => Some(preset.name.clone()),
                None => return,
            },
        };
        // Space and Enter are the name's.
        self.panels.drop_focus();
        self.presets.naming = Some(Naming { text: of.clone().unwrap_or_default(), of });
    }

    /// Keeps the name that was typed: the present look under it, or another name of a preset.
    pub(super) fn end_naming(&mut self) {
        let Some(naming) = self.presets.naming.take() else { return };
        if let Err(why) = self.keep_named(&naming) {
            self.notify(&why, true);
            // It can be corrected.
            self.presets.naming = Some(naming);
        }
    }

    fn keep_named(&mut self, naming: &Naming) -> Result<(), String> {
        let name = checked_name(&naming.text)?;
        // Another window may have changed them.
        self.presets.read();
        let mut own = self.presets.own.clone();
        let same = own.iter().position(|preset| preset.name == name);
        let said = match (&naming.of, same) {
            (Some(of), Some(_)) if *of != name => return Err(texts::name_is_taken(name)),
            (Some(of), _) => {
                let preset = own.iter_mut().find(|preset| preset.name == *of).ok_or(texts::WHY_PRESET_IS_GONE)?;
                preset.name.clone_from(&name);
                texts::preset_is_called(name)
            }
            (None, Some(n)) => {
                own[n] = UserPreset::new(&name, self.controls.settings())?;
                texts::preset_is_replaced(name)
            }
            (None, None) => {
                own.push(UserPreset::new(&name, self.controls.settings())?);
                texts::preset_is_kept(name)
            }
        };
        self.keep_presets(own)?;
        self.notify(&said, false);
        Ok(())
    }

    /// Writes the presets of the user; the earlier ones can be brought back.
    fn keep_presets(&mut self, own: Vec<UserPreset>) -> Result<(), String> {
        let file = self.presets.file.as_deref().ok_or(texts::WHY_NO_PRESETS)?;
        user_presets::write(file, &own)?;
        self.presets.before = Some(std::mem::replace(&mut self.presets.own, own));
        // Pictures belong to places in the list, and it has others now.
        self.presets.thumbnails.keep_first(EXAMS.len());
        self.presets.made_of = None;
        Ok(())
    }

    pub(super) fn delete_preset(&mut self, n: usize) {
        let Some(name) = self.presets.own.get(n).map(|preset| preset.name.clone()) else { return };
        self.presets.read();
        let mut own = self.presets.own.clone();
        own.retain(|preset| preset.name != name);
        match self.keep_presets(own) {
            Ok(()) => {
                self.notify(&texts::preset_is_deleted(name), false);
            }
            Err(why) => self.notify(&why, true),
        }
    }

    /// Brings the presets of the user back as they were before the last change.
    pub(super) fn restore_presets(&mut self) {
        let Some(before) = self.presets.before.clone() else { return };
        let known = self.presets.own.clone();
        self.presets.read();
        if self.presets.own != known {
            self.presets.before = None;
            return self.notify(texts::PRESETS_CHANGED_ELSEWHERE, true);
        }
        match self.keep_presets(before) {
            Ok(()) => self.notify(texts::PRESETS_RESTORED, false),
            Err(why) => self.notify(&why, true),
        }
    }

    /// Leaves the name that is being typed, or the list. False if the list is not shown.
    pub(super) fn leave_presets(&mut self) -> bool {
        if self.presets.naming.take().is_none() && self.presets.is_shown {
            self.presets.close();
            return true;
        }
        self.presets.is_shown
    }

    /// What a key does in the list.
    pub(super) fn key_of_presets(&mut self, key: Key, is_upper: bool) -> Option<Vec<Command>> {
        if let Some(naming) = &mut self.presets.naming {
            let letter = match key {
                Key::Enter => return Some(vec![Command::EndNaming]),
                Key::Escape => return None,
                Key::Backspace => {
                    naming.text.pop();
                    None
                }
                Key::Space => Some(' '),
                Key::Char(letter) if is_upper => letter.to_uppercase().next(),
                Key::Char(letter) => Some(letter),
                _ => None,
            };
            if naming.text.chars().count() < MAX_NAME {
                naming.text.extend(letter);
            }
            self.needs_redraw = true;
            return Some(Vec::new());
        }
        match key {
            Key::Char(digit @ '1'..='9') => Some(vec![Command::Preset(digit as usize - '1' as usize)]),
            Key::Char('s') => Some(vec![Command::NamePreset]),
            Key::Char('z') => Some(vec![Command::RestorePresets]),
            Key::Escape => None,
            _ => Some(Vec::new()),
        }
    }

    /// While the list is shown, makes thumbnails of the present volume, and makes them again when volume or view change much.
    pub(super) fn poll_thumbnails(&mut self, now: Instant) {
        if !self.presets.is_shown {
            return;
        }
        let rests = now >= self.last_input + REST && !self.stream.is_drawing();
        self.needs_redraw |= self.presets.thumbnails.poll(rests);
        if self.presets.thumbnails.is_working() {
            return;
        }
        let volumes = self.stream.cine().volumes();
        let shown = self.stream.cine_position().and_then(|at| volumes.get(at)).or(volumes.back());
        let (Some(shown), Some(scene), Some(header)) = (shown, self.stream.scene(), self.stream.header()) else {
            return;
        };
        let settings = self.controls.settings();
        let is_due = self.presets.made_of.as_ref().is_none_or(|made| {
            let is_other_volume = made.volume != shown.volume
                && (self.stream.is_frozen() || now.saturating_duration_since(made.at) >= LIVE_INTERVAL);
            made.own != self.presets.own || is_other_volume || differs_much(&made.settings, settings)
        });
        if !is_due {
            return;
        }
        let is_backward = shown.frames.first().is_some_and(|frame| frame.backward);
        let geometry = if is_backward { header.backward.clone() } else { header.forward.clone() };
        let count = EXAMS.len() + self.presets.own.len();
        let job = Job {
            context: self.context.clone(),
            geometry,
            input: scene.input,
            frames: shown.frames.clone(),
            settings: (0..count).map(|n| self.with_preset(n, scene).ok()).collect(),
        };
        let made_of =
            MadeOf { volume: shown.volume, settings: settings.clone(), own: self.presets.own.clone(), at: now };
        self.presets.made_of = Some(made_of);
        self.presets.thumbnails.begin(job);
    }

    /// When thumbnails are looked at again, while the list is shown.
    pub(super) fn thumbnails_at(&self, now: Instant) -> Option<Instant> {
        let is_shown = self.presets.is_shown;
        let at = if self.presets.thumbnails.is_working() { Duration::from_millis(50) } else { REST };
        let is_waiting = self.presets.thumbnails.is_working() || self.presets.made_of.is_none();
        (is_shown && is_waiting).then_some(now + at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::Layers;

    #[test]
    fn thumbnails_are_made_again_when_the_view_changes_much() {
        let settings = |lines: &[&str]| {
            let mut layers = Layers::default();
            lines.iter().for_each(|line| layers.set(line).expect(line));
            layers.finish().expect("settings")
        };
        let from = settings(&["region.depth=[30,80]", "camera.azimuth=175"]);
        let changed =
            |line: &str| differs_much(&from, &settings(&["region.depth=[30,80]", "camera.azimuth=175", line]));
        for little in ["post.gamma=2", "camera.azimuth=-178", "camera.zoom=1.05", "region.depth=[31,80]", "mode=mip"] {
            assert!(!changed(little), "{little}");
        }
        for much in ["camera.azimuth=-160", "camera.zoom=2", "region.depth=[40,80]", "region.lateral=[-10,10]"] {
            assert!(changed(much), "{much}");
        }
    }
}
