//! Applies presets to the present settings: the look changes; region, view, cuts and measurements are kept.

use super::cutting::in_the_way;
use super::{Change, Controls, drawable};
use crate::command::Command;
use crate::scene::load::Layers;
use crate::scene::{Layout, Region, Scene, Settings};
use crate::texts;

/// A built-in preset in the list of presets.
pub(crate) struct Exam {
    pub title: &'static str,
    pub hint: &'static str,
    preset: &'static str,
    /// Whether its region and camera are made for the head of the phantom.
    is_framed: bool,
}

const fn exam([title, hint]: [&'static str; 2], preset: &'static str, is_framed: bool) -> Exam {
    Exam { title, hint, preset, is_framed }
}

/// The built-in presets, in the order of the list of presets.
pub(crate) const EXAMS: [Exam; 6] = [
    exam(texts::FACE, "face", true),
    exam(texts::SKELETON, "skeleton", true),
    exam(texts::GLASS, "glass", true),
    exam(texts::VESSELS, "vessel", true),
    exam([texts::BONE, texts::BONE_HINT], "bone", false),
    exam(texts::B_MODE, "bmode", false),
];

/// The base of what the phantom is drawn with.
const PHANTOM: &str = "face-classic";

impl Controls {
    /// The present settings with the n-th built-in preset applied. With `is_phantom`, region and camera change too, because most presets are
    /// framed for the phantom.
    ///
    /// # Errors
    /// The reason why the volume cannot be drawn with it.
    pub(crate) fn with_exam(&self, n: usize, scene: &Scene, is_phantom: bool) -> Result<Settings, &'static str> {
        self.drawn_by(self.examined(n, scene, is_phantom).ok_or(texts::PRESET_DOES_NOT_FIT)?, scene)
    }

    fn examined(&self, n: usize, scene: &Scene, is_phantom: bool) -> Option<Settings> {
        let exam = EXAMS.get(n)?;
        let mut layers = Layers::default();
        if is_phantom {
            layers.preset(PHANTOM).ok()?;
        }
        layers.preset(exam.preset).ok()?;
        let mode = layers.clone().finish().ok()?.mode;
        let keeps_planes = self.settings.layout.has_planes() && !mode.is_flat();
        let layers = layers.in_mode(mode, if keeps_planes { self.settings.layout } else { Layout::Single })?;
        let look = layers.completed(&scene.geometry, None).ok()?.settings;
        let mut settings = look.look_over(&self.in_mode_of_look(&look));
        if is_phantom && exam.is_framed {
            let start_curve = settings.region.start_curve.take();
            (settings.region, settings.camera) = (Region { start_curve, ..look.region }, look.camera);
        }
        Some(settings)
    }

    /// The present settings with `look`, those of a user's preset, applied.
    ///
    /// # Errors
    /// The reason why the volume cannot be drawn with it.
    pub(crate) fn with_look(&self, look: &Settings, scene: &Scene) -> Result<Settings, &'static str> {
        self.drawn_by(look.look_over(&self.in_mode_of_look(look)), scene)
    }

    /// The present settings in the mode of a look, with what follows from it.
    fn in_mode_of_look(&self, look: &Settings) -> Settings {
        self.switched(Settings { mode: look.mode, layout: look.layout, ..self.settings.clone() })
    }

    fn drawn_by(&self, settings: Settings, scene: &Scene) -> Result<Settings, &'static str> {
        let now = self.current(scene).ok_or(texts::PRESET_DOES_NOT_FIT)?;
        drawable(&now, settings.clone())
            .ok_or_else(|| in_the_way(&now, &settings).unwrap_or(texts::PRESET_DOES_NOT_FIT))
    }

    /// Applies the settings of a preset, as one step of undo.
    pub(crate) fn take(&mut self, settings: Settings, command: &Command) -> Change {
        if settings == self.settings {
            return Change::Nothing;
        }
        self.history.seal();
        self.put(settings, command)
    }
}
