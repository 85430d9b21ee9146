//! The settings that a stream was asked to draw with.

use crate::scene::Settings;

/// The settings of a stream. Scenes are made of them ([`Views`](super::session::Views)); those that wait for their pipelines and those that are on display keep
/// the settings that they were made of.
#[derive(Clone, PartialEq)]
pub(super) struct Asked {
    /// The settings at full quality.
    pub(super) full: Settings,
    /// Settings of lower quality that temporarily replace `full`.
    pub(super) lowered: Option<Settings>,
    /// The next picture is the first one, for which a 16th of the rays is cast.
    pub(super) is_coarse: bool,
}

impl Asked {
    fn now(&self) -> &Settings {
        self.lowered.as_ref().unwrap_or(&self.full)
    }

    /// The settings that the next picture is drawn with.
    pub(super) fn drawn(&self) -> Settings {
        let mut drawn = self.now().clone();
        if self.is_coarse && !drawn.mode.is_flat() {
            (drawn.ray.subsampling, drawn.ray.rays) = (4, 1);
        }
        drawn
    }

    /// Other settings, derived from a recording, for a picture of the same size.
    pub(super) fn with_look(&self, settings: Settings) -> Asked {
        let picture = self.now().picture.clone();
        Asked { full: Settings { picture, ..settings }, lowered: None, is_coarse: self.is_coarse }
    }

    /// Returns to the settings on display, because the device refused these: another geometry or device does not try them again.
    pub(super) fn go_back_to(&mut self, shown: &Settings) {
        let ray = if self.is_coarse { self.now().ray.clone() } else { shown.ray.clone() };
        (self.full, self.lowered) = (Settings { ray, ..shown.clone() }, None);
    }
}
