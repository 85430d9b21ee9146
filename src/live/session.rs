//! What follows from a geometry: the renderer, whose volume images are filled and shown in turns, and the picture on its way.

use super::statistics::Statistics;
use super::stream::FinishedPicture;
use super::views::Views;
use super::volume_pool::VolumePool;
use crate::gpu::{GpuError, Renderer};
use crate::plan::Rerun;
use std::collections::HashSet;
use std::time::{Duration, Instant};

/// What follows from a geometry.
pub struct Session {
    pub views: Views,
    pub renderer: Renderer,
    pub turns: VolumePool,
    /// By volume image: the volume whose frames came last, and when those arrived that no picture has shown yet.
    pub arrived: Vec<(u32, Vec<Instant>)>,
    /// The frames that the picture on its way shows for the first time, and its volume.
    pub drawing: Option<(u32, Vec<Instant>)>,
    /// When its drawing began.
    pub begun: Instant,
    /// Views of other settings, not taken yet.
    pub next: Option<Views>,
    /// The next views wait for pipelines that are being made.
    pub waits: bool,
    /// Why the next views were not taken.
    pub fault: Option<String>,
    /// Pipelines of other settings are made beside the drawing, and the settings wait for them.
    pub prepares: bool,
    /// A volume that was shown and has to come again before it can be drawn.
    pub lost: Option<u32>,
    /// Frames have to come again, also those of a volume that is being sent.
    pub anew: bool,
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

impl Session {
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

    /// Takes the next views, when all that they need is made. What they make of volumes that are there already is gone where frames have
    /// to come again, since slices of both would be mixed; a rolling volume fills again by itself.
    fn apply(&mut self) -> Result<(), GpuError> {
        let Some(next) = &self.next else { return Ok(()) };
        let scene = next.of(&self.backward);
        let other = self.renderer.is_other(&scene);
        if other && self.prepares {
            match self.renderer.prepare(&scene) {
                Ok(true) => {}
                Ok(false) => {
                    self.waits = true;
                    return Ok(());
                }
                Err(error) if error.is_device_lost() => return Err(error),
                // What cannot be drawn is told, and what was drawn before stays.
                Err(error) => {
                    (self.next, self.fault) = (None, Some(error.to_string()));
                    return Ok(());
                }
            }
        }
        let rerun = match other {
            true => match self.renderer.change(scene.into_owned()) {
                Ok(rerun) => rerun,
                Err(error) if error.is_device_lost() => return Err(error),
                // Memory may have run out half-way. There was room for what was drawn before.
                Err(error) => {
                    (self.next, self.fault) = (None, Some(error.to_string()));
                    self.renderer.change(self.views.of(&self.backward).into_owned())?
                }
            },
            false => Rerun::Steps { steps: Vec::new(), slots: Vec::new() },
        };
        if let Some(next) = self.next.take() {
            self.views = next;
        }
        self.run_again(&rerun);
        Ok(())
    }

    /// Makes pipelines anew of shaders that are other ones now, and draws with them.
    pub fn renew_shaders(&mut self, shaders: &HashSet<String>) -> Result<(), GpuError> {
        let rerun = self.renderer.renew_shaders(shaders)?;
        self.run_again(&rerun);
        Ok(())
    }

    fn run_again(&mut self, rerun: &Rerun) {
        self.redraw = self.volume.is_some();
        if !matches!(rerun, Rerun::Steps { .. }) {
            (self.lost, self.anew) = (self.seen(), true);
            if !self.turns.is_rolling() {
                self.turns.forget();
                self.arrived.iter_mut().for_each(|(_, arrived)| arrived.clear());
                (self.volume, self.redraw) = (None, false);
            }
        }
    }

    /// The volume that is shown, or will be next.
    pub fn seen(&self) -> Option<u32> {
        self.turns.waiting().or(self.volume).or(self.lost)
    }

    /// Whether there is something to do that no event of the source has to bring.
    pub fn is_busy(&self) -> bool {
        let waits = self.next.is_some() && self.waits;
        let changes = self.next.is_some() && !waits;
        self.drawing.is_some()
            || changes
            || self.fault.is_some()
            || self.lost.is_some()
            || self.behind > 0
            || self.turns.has_new()
            || (self.redraw && self.volume.is_some())
    }

    /// Begins a picture if there is anything new to show.
    pub fn begin(&mut self) -> Result<bool, GpuError> {
        self.waits = false;
        self.apply()?;
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
        (self.drawing, self.redraw, self.begun) = (Some((volume, arrived)), false, Instant::now());
        Ok(true)
    }

    pub fn finish(&mut self, statistics: &mut Statistics) -> Result<FinishedPicture, GpuError> {
        let picture = self.renderer.end_drawing()?;
        let (volume, arrived) = self.drawing.take().unwrap_or_default();
        let now = Instant::now();
        arrived.iter().for_each(|at| statistics.seen_after(now.saturating_duration_since(*at)));
        statistics.pictures += 1;
        let latency = arrived.iter().max().map_or(Duration::ZERO, |at| now.saturating_duration_since(*at));
        Ok(FinishedPicture { volume, picture, latency, took: now.saturating_duration_since(self.begun) })
    }
}
