//! The scenes of a stream: one for each way that a volume may have been swept, and where slices of both lie side by side a mixture.
//! All of them look at the same texels, so that frames need not wait for the scene that they will be seen in.

use super::volume_pool::Update;
use crate::probe::Geometry;
use crate::scene::{Input, Scene, SceneError, Settings};
use crate::source::recorder::Header;
use std::borrow::Cow;

pub struct Views {
    forward: Scene,
    backward: Scene,
    /// The ways differ.
    turns: bool,
    /// Slices of both may lie side by side at any time: then all scenes are mixtures, whose passes and slots stay the same.
    mixes: bool,
}

impl Views {
    /// # Errors
    /// Settings that cannot be drawn of this geometry.
    pub fn new(header: &Header, settings: &Settings, update: Update) -> Result<Views, SceneError> {
        let input = Input { stored: header.stored, range: header.range };
        let scene = |geometry: &Geometry| Scene::new(geometry.clone(), input, settings.clone());
        let (mut forward, mut backward) = (scene(&header.forward)?, scene(&header.backward)?);
        forward.seen = forward.seen.with(backward.seen);
        backward.seen = forward.seen;
        let turns = header.forward != header.backward;
        Ok(Views { forward, backward, turns, mixes: turns && update == Update::Rolling })
    }

    /// What the first frames are filtered for; of all ways, since they look at the same.
    pub fn first(&self) -> &Scene {
        &self.forward
    }

    /// Of a volume whose slices were swept so. Where slices that lie side by side would cross, the way of the most of them is taken.
    pub fn of(&self, backward: &[bool]) -> Cow<'_, Scene> {
        let back = backward.iter().filter(|b| **b).count();
        let most = 2 * back > backward.len();
        let mix = |marked: &[bool]| self.forward.geometry.with_mixed_directions(&self.backward.geometry, marked);
        let mixed = self.mixes.then(|| mix(backward).or_else(|| mix(&vec![most; backward.len()]))).flatten();
        match mixed {
            Some(geometry) => Cow::Owned(Scene { geometry, ..self.forward.clone() }),
            None if self.turns && most => Cow::Borrowed(&self.backward),
            None => Cow::Borrowed(&self.forward),
        }
    }
}
