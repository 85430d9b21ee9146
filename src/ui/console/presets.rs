//! The list of presets: built-in ones with thumbnails of the present volume, and the user's, which are saved, renamed and deleted here.

use crate::command::Command;
use crate::controls::{Controls, EXAMS};
use crate::input::Key;
use crate::panels::{PresetTile, PresetsShown};
use crate::scene::{Scene, Settings};
use crate::texts;
use crate::thumbnails::{Job, Thumbnails};
use crate::user_presets::{self, MAX_NAME, MAX_PRESETS, UserPreset, checked_name};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Least time between two rounds of thumbnails of volumes that go on coming.
const LIVE_INTERVAL: Duration = Duration::from_secs(5);
/// Time without an input after which thumbnails for the list on display are drawn.
pub(super) const REST: Duration = Duration::from_millis(300);
/// Time without an input after which thumbnails are drawn although no list is on display.
pub(super) const LONG_REST: Duration = Duration::from_secs(2);
/// The view changed much: it turned by so many degrees, or zoom or an edge of the region changed by this share.
const MUCH_DEGREES: f64 = 15.0;
const MUCH: f64 = 0.1;

/// The list of presets: the built-in ones and the user's, with their thumbnails.
#[derive(Default)]
pub(super) struct Presets {
    /// The file with the user's presets; `None`: there are none.
    file: Option<PathBuf>,
    pub(super) is_shown: bool,
    own: Vec<UserPreset>,
    /// Why the user's presets cannot be read.
    fault: Option<String>,
    naming: Option<Naming>,
    /// The user's presets before the last change.
    before: Option<Vec<UserPreset>>,
    keeps_pictures: bool,
    pub(super) thumbnails: Thumbnails,
    /// The volume and view of the thumbnails.
    made_of: Option<MadeOf>,
}

/// A name that is being typed.
struct Naming {
    text: String,
    /// The name of the preset that is renamed; `None`: a new preset.
    of: Option<String>,
}

struct MadeOf {
    volume: u32,
    settings: Settings,
    own: Vec<UserPreset>,
    at: Instant,
}

impl Presets {
    /// `file`: path of the user's presets. `keeps_pictures`: the inspector shows the thumbnails, too.
    pub(super) fn new(file: Option<PathBuf>, keeps_pictures: bool) -> Presets {
        let mut presets = Presets { file, keeps_pictures, ..Presets::default() };
        if keeps_pictures {
            presets.read();
        }
        presets
    }

    pub(super) fn is_naming(&self) -> bool {
        self.naming.is_some()
    }

    /// Discards the thumbnails, because the device that drew them is lost.
    pub(super) fn device_lost(&mut self) {
        self.thumbnails.stop();
        self.made_of = None;
    }

    pub(super) fn close(&mut self) {
        (self.is_shown, self.naming, self.before) = (false, None, None);
        if !self.keeps_pictures {
            self.made_of = None;
            self.thumbnails.keep_first(0);
        }
    }

    fn read(&mut self) {
        let read = self.file.as_deref().map_or(Ok(Vec::new()), user_presets::read);
        self.fault = read.as_ref().err().cloned();
        self.own = read.unwrap_or_default();
    }

    /// The list of presets as the panels show it; None while it is not shown.
    pub(super) fn shown(&self) -> Option<PresetsShown<'_>> {
        self.is_shown.then(|| PresetsShown {
            tiles: self.tiles(),
            can_save: self.file.is_some() && self.fault.is_none(),
            fault: self.fault.as_deref(),
            naming: self.naming.as_ref().map(|naming| (naming.text.as_str(), naming.of.is_some())),
            can_restore: self.before.is_some(),
        })
    }

    /// All presets, with their thumbnails as far as they are drawn.
    pub(super) fn tiles(&self) -> Vec<PresetTile<'_>> {
        let pictures = &self.thumbnails.pictures;
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
        built_in.chain(own).collect()
    }

    /// Shows or closes the list of presets. Returns the reason if the user's presets cannot be read.
    pub(super) fn toggle(&mut self) -> Option<&str> {
        if self.is_shown {
            self.close();
            return None;
        }
        self.read();
        self.is_shown = true;
        self.fault.as_deref()
    }

    /// Number of all presets, the built-in ones and the user's.
    pub(super) fn count(&self) -> usize {
        EXAMS.len() + self.own.len()
    }

    /// The settings of the n-th preset; what a preset does not contain is as in `controls`. `is_phantom`: the view of built-in presets fits the
    /// phantom and is applied, too.
    ///
    /// # Errors
    /// One line: there is no such preset, or the volume cannot be drawn with it.
    pub(super) fn settings(
        &self,
        n: usize,
        controls: &Controls,
        scene: &Scene,
        is_phantom: bool,
    ) -> Result<Settings, String> {
        if n < EXAMS.len() {
            return controls.with_exam(n, scene, is_phantom).map_err(str::to_string);
        }
        let own = self.own.get(n - EXAMS.len()).ok_or_else(|| texts::NO_SUCH_PRESET.to_string())?;
        controls.with_look(&own.look()?, scene).map_err(str::to_string)
    }

    /// Starts to type the name of a new preset (None), or a new name of the user's preset with this index. Returns false if there is no such
    /// preset.
    ///
    /// # Errors
    /// One line: the user has as many presets as are allowed.
    pub(super) fn begin_naming(&mut self, of: Option<usize>) -> Result<bool, String> {
        if !self.is_shown || self.file.is_none() || self.fault.is_some() {
            return Ok(false);
        }
        let of = match of {
            None if self.own.len() >= MAX_PRESETS => return Err(texts::too_many_presets(MAX_PRESETS)),
            None => None,
            Some(n) => match self.own.get(n) {
                Some(preset) => Some(preset.name.clone()),
                None => return Ok(false),
            },
        };
        self.naming = Some(Naming { text: of.clone().unwrap_or_default(), of });
        Ok(true)
    }

    /// Saves these settings as a preset of the typed name, or renames a preset. Returns a message for the user; None if no name is being typed.
    ///
    /// # Errors
    /// One line: the preset cannot be saved. The name can be corrected.
    pub(super) fn end_naming(&mut self, settings: &Settings) -> Result<Option<String>, String> {
        let Some(naming) = self.naming.take() else { return Ok(None) };
        let kept = self.keep_named(&naming, settings);
        if kept.is_err() {
            self.naming = Some(naming);
        }
        kept.map(Some)
    }

    fn keep_named(&mut self, naming: &Naming, settings: &Settings) -> Result<String, String> {
        let name = checked_name(&naming.text)?;
        // Another window may have changed them.
        self.read();
        let mut own = self.own.clone();
        let same = own.iter().position(|preset| preset.name == name);
        let said = match (&naming.of, same) {
            (Some(of), Some(_)) if *of != name => return Err(texts::name_is_taken(name)),
            (Some(of), _) => {
                let preset = own.iter_mut().find(|preset| preset.name == *of).ok_or(texts::WHY_PRESET_IS_GONE)?;
                preset.name.clone_from(&name);
                texts::preset_is_called(name)
            }
            (None, Some(n)) => {
                own[n] = UserPreset::new(&name, settings)?;
                texts::preset_is_replaced(name)
            }
            (None, None) => {
                own.push(UserPreset::new(&name, settings)?);
                texts::preset_is_kept(name)
            }
        };
        self.keep(own)?;
        Ok(said)
    }

    /// Writes the presets of the user; the earlier ones can be brought back.
    fn keep(&mut self, own: Vec<UserPreset>) -> Result<(), String> {
        let file = self.file.as_deref().ok_or(texts::WHY_NO_PRESETS)?;
        user_presets::write(file, &own)?;
        self.before = Some(std::mem::replace(&mut self.own, own));
        // Pictures belong to places in the list, and it has others now.
        self.thumbnails.keep_first(EXAMS.len());
        self.made_of = None;
        Ok(())
    }

    /// Deletes the user's preset with this index. Returns a message for the user; None if there is no such preset.
    ///
    /// # Errors
    /// One line: the file of presets cannot be written.
    pub(super) fn delete(&mut self, n: usize) -> Result<Option<String>, String> {
        let Some(name) = self.own.get(n).map(|preset| preset.name.clone()) else { return Ok(None) };
        self.read();
        let mut own = self.own.clone();
        own.retain(|preset| preset.name != name);
        self.keep(own)?;
        Ok(Some(texts::preset_is_deleted(name)))
    }

    /// Restores the user's presets as they were before the last change. Returns a message for the user; None if there was no change.
    ///
    /// # Errors
    /// One line: another window changed them since, or they cannot be written.
    pub(super) fn restore(&mut self) -> Result<Option<String>, String> {
        let Some(before) = self.before.clone() else { return Ok(None) };
        let known = self.own.clone();
        self.read();
        if self.own != known {
            self.before = None;
            return Err(texts::PRESETS_CHANGED_ELSEWHERE.into());
        }
        self.keep(before)?;
        Ok(Some(texts::PRESETS_RESTORED.into()))
    }

    /// Discards the name that is being typed or, if there is none, closes the list. Returns false if the list is not shown.
    pub(super) fn leave(&mut self) -> bool {
        if self.naming.take().is_none() && self.is_shown {
            self.close();
            return true;
        }
        self.is_shown
    }

    /// The commands of a key while the list of presets is shown. None for Escape, which the list does not handle. `is_upper`: Shift is held.
    pub(super) fn key(&mut self, key: Key, is_upper: bool) -> Option<Vec<Command>> {
        let Some(naming) = &mut self.naming else {
            return match key {
                Key::Char(digit @ '1'..='9') => Some(vec![Command::Preset(digit as usize - '1' as usize)]),
                Key::Char('s') => Some(vec![Command::NamePreset]),
                Key::Char('z') => Some(vec![Command::RestorePresets]),
                Key::Escape => None,
                _ => Some(Vec::new()),
            };
        };
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
        Some(Vec::new())
    }

    /// Collects thumbnails that are finished. `acted`: time of the user's last action. Returns true if there are new ones.
    pub(super) fn poll(&mut self, acted: Instant, is_drawing: bool, now: Instant) -> bool {
        self.thumbnails.poll(now >= acted + REST && !is_drawing)
    }

    /// True if thumbnails have to be drawn, because there is another volume, another view, or other presets. The list on display has them drawn
    /// less often for arriving volumes than for one that stays (`rests`). The inspector has them drawn for the first volume and for one that
    /// stays, after a longer pause.
    pub(super) fn wants_thumbnails(
        &self,
        (volume, settings): (u32, &Settings),
        (in_inspector, rests): (bool, bool),
        acted: Instant,
        now: Instant,
    ) -> bool {
        let may_be = self.is_shown || (in_inspector && now >= acted + LONG_REST);
        if !may_be || self.thumbnails.is_working() {
            return false;
        }
        self.made_of.as_ref().is_none_or(|made| {
            let is_rare = rests || (self.is_shown && now.saturating_duration_since(made.at) >= LIVE_INTERVAL);
            let is_other_volume = made.volume != volume && is_rare;
            let is_other_view = (self.is_shown || rests) && differs_much(&made.settings, settings);
            made.own != self.own || is_other_volume || is_other_view
        })
    }

    /// Starts to draw thumbnails of a volume with each preset.
    pub(super) fn make_thumbnails(&mut self, job: Job, volume: u32, settings: &Settings, now: Instant) {
        self.made_of = Some(MadeOf { volume, settings: settings.clone(), own: self.own.clone(), at: now });
        self.thumbnails.begin(job);
    }

    /// Time at which thumbnails have to be checked again, because they are being drawn or the user will then have paused; None if none is due.
    pub(super) fn due(&self, acted: Instant, now: Instant) -> Option<Instant> {
        let at = if self.thumbnails.is_working() { Duration::from_millis(50) } else { REST };
        let is_waiting = self.thumbnails.is_working() || (self.is_shown && self.made_of.is_none());
        let rested = acted + LONG_REST;
        let of_inspector = (self.keeps_pictures && rested > now).then_some(rested);
        is_waiting.then_some(now + at).or(of_inspector)
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

    /// Prevents a preset of the user that is lost by a key, a name that is taken twice, and a list that Escape does not leave.
    #[test]
    fn presets_are_named_deleted_and_brought_back() {
        let folder = crate::files::WorkFolder::new(&std::env::temp_dir(), "echolume-test-").expect("a folder");
        let mut presets = Presets::new(Some(folder.path().join("presets.toml")), false);
        let settings = Settings::default();
        assert_eq!(presets.begin_naming(None), Ok(false), "the list is not shown");
        assert_eq!(presets.toggle(), None);
        assert_eq!(presets.count(), EXAMS.len());
        for name in ["b", "A"] {
            assert_eq!(presets.begin_naming(None), Ok(true));
            let letter = name.to_lowercase().chars().next().expect("a letter");
            assert_eq!(presets.key(Key::Char(letter), name == "A"), Some(Vec::new()));
            assert_eq!(presets.key(Key::Enter, false), Some(vec![Command::EndNaming]));
            assert!(presets.end_naming(&settings).is_ok_and(|said| said.is_some()), "{name}");
        }
        assert_eq!(presets.count(), EXAMS.len() + 2);
        assert_eq!(presets.begin_naming(Some(1)), Ok(true));
        presets.key(Key::Backspace, false);
        presets.key(Key::Char('b'), false);
        assert!(presets.end_naming(&settings).is_err() && presets.is_naming(), "taken; it can be corrected");
        assert!(presets.leave() && !presets.is_naming() && presets.is_shown);
        assert!(presets.delete(9).is_ok_and(|said| said.is_none()));
        assert!(presets.delete(0).is_ok_and(|said| said.is_some()));
        assert_eq!(presets.count(), EXAMS.len() + 1);
        assert!(presets.restore().is_ok_and(|said| said.is_some()));
        assert_eq!(presets.count(), EXAMS.len() + 2);
        let now = Instant::now();
        let wants = |presets: &Presets, in_inspector, rests, at| {
            presets.wants_thumbnails((3, &settings), (in_inspector, rests), now, at)
        };
        assert!(wants(&presets, false, false, now) && presets.due(now, now) == Some(now + REST));
        assert!(presets.leave() && !presets.is_shown && !presets.leave());
        assert!(!wants(&presets, false, true, now) && presets.due(now, now).is_none());
        // In the inspector after a longer rest.
        assert!(!wants(&presets, true, true, now) && wants(&presets, true, true, now + LONG_REST));
    }
}
