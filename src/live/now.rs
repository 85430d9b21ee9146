//! What follows from a geometry: the renderer, whose volume images are filled and shown in turns, and the picture on its way.

use super::statistics::Statistics;
use super::stream::Shown;
use super::turns::Turns;
use super::views::Views;
use crate::gpu::{GpuError, Renderer};
use crate::plan::Rerun;
use std::time::{Duration, Instant};

/// What follows from a geometry.
pub struct Now {
    pub views: Views,
    pub renderer: Renderer,
    pub turns: Turns,
    /// By volume image: the volume whose frames came last, and when those arrived that no picture has shown yet.
    pub arrived: Vec<(u32, Vec<Instant>)>,
    /// The frames that the picture on its way shows for the first time, and its volume.
    pub drawing: Option<(u32, Vec<Instant>)>,
    /// The settings are others than the renderer's.
    pub changed: bool,
    /// What is shown has to be drawn again.
    pub redraw: bool,
    /// By slice, the way of what is shown.
    pub backward: Vec<bool>,
    /// The last volume that was shown.
    pub volume: Option<u32>,
    /// Frames that waited when the last picture was done, and that the next one shows: beginning it after the first of them would
    /// fall ever further behind.
    pub behind: usize,
}

impl Now {
    /// A frame of this volume is in this image.
    pub fn came(&mut self, image: u32, volume: u32, at: Instant) {
        let (of, arrived) = &mut self.arrived[image as usize];
        // Those of a volume that was never shown are of no use; rolling there is one that all of them go into.
        if *of != volume && !self.turns.is_rolling() {
            arrived.clear();
        }
        *of = volume;
        arrived.push(at);
    }

    /// Takes the new settings. What they make of volumes that are there already is gone where frames have to come again, since slices of
    /// both would be mixed; a rolling volume fills again by itself.
    fn apply(&mut self) -> Result<(), GpuError> {
        let scene = self.views.of(&self.backward);
        let rerun = match self.renderer.is_other(&scene) {
            true => self.renderer.change(scene.into_owned())?,
            false => Rerun::Steps { steps: Vec::new(), slots: Vec::new() },
        };
        self.changed = false;
        if !matches!(rerun, Rerun::Steps { .. }) && !self.turns.is_rolling() {
            self.turns.forget();
            self.arrived.iter_mut().for_each(|(_, arrived)| arrived.clear());
            self.volume = None;
        }
        self.redraw = self.volume.is_some();
        Ok(())
    }

    /// Begins a picture if there is anything new to show.
    pub fn begin(&mut self) -> Result<bool, GpuError> {
        if self.changed {
            self.apply()?;
        }
        let mut arrived = Vec::new();
        if let Some(ready) = self.turns.take() {
            self.renderer.show(ready.image)?;
            (self.backward, self.volume, self.redraw) = (ready.backward, Some(ready.volume), true);
            arrived = std::mem::take(&mut self.arrived[ready.image as usize].1);
        }
        let Some(volume) = self.volume.filter(|_| self.redraw) else { return Ok(false) };
        let scene = self.views.of(&self.backward);
        if self.renderer.is_other(&scene) {
            self.renderer.change(scene.into_owned())?;
        }
        self.renderer.begin_picture()?;
        (self.drawing, self.redraw) = (Some((volume, arrived)), false);
        Ok(true)
    }

    pub fn finish(&mut self, statistics: &mut Statistics) -> Result<Shown, GpuError> {
        let picture = self.renderer.end_picture()?;
        let (volume, arrived) = self.drawing.take().unwrap_or_default();
        let now = Instant::now();
        arrived.iter().for_each(|at| statistics.seen_after(now.saturating_duration_since(*at)));
        statistics.pictures += 1;
        let latency = arrived.iter().max().map_or(Duration::ZERO, |at| now.saturating_duration_since(*at));
        Ok(Shown { volume, picture, latency })
    }
}
