//! Stages 2 to 4: draws pictures from volumes, synchronously or while the host does other work. Only steps whose inputs changed
//! run again.

use super::*;
use crate::passes::slots::Search;
use crate::passes::unveil::Unveiled;
use crate::picture::Picture;
use crate::plan::Work;
#[cfg(feature = "view")]
use crate::window::screen::{Drawn, Panels, PresentOutcome, Screen};

impl Renderer {
    /// Selects the volume image with index `image`, from 0, for the next picture and later ones. All of its visible frames must have been sent.
    ///
    /// # Errors
    /// The image does not exist, the device fails, or the last change of the scene failed.
    pub fn show(&mut self, image: u32) -> Result<(), GpuError> {
        self.check(image)?;
        self.flush()?;
        self.volumes.shown = image;
        self.stale.fill(true);
        Ok(())
    }

    /// Draws a picture and copies it to the host. If nothing changed since the last picture, no pass runs.
    ///
    /// # Errors
    /// The device fails, or the last change of the scene failed.
    pub fn picture(&mut self) -> Result<Picture, GpuError> {
        self.begin_picture()?;
        self.end_picture()
    }

    /// Submits the steps whose inputs changed since the last picture. Frames may be sent meanwhile; frames for slices that the picture
    /// shows wait for it. If a picture is in flight, this waits for it first.
    ///
    /// # Errors
    /// The device fails, or the last change of the scene failed.
    pub fn begin_picture(&mut self) -> Result<(), GpuError> {
        self.check(self.volumes.shown)?;
        self.wait_drawn()?;
        match self.stale.iter().any(|stale| *stale) {
            true => self.draw(),
            false => Ok(()),
        }
    }

    /// True if a picture is in flight. It also submits the bands of that picture that were held back and are due.
    ///
    /// # Errors
    /// The device fails.
    pub fn is_drawing(&self) -> Result<bool, GpuError> {
        self.drawing.is_drawing(&self.queues)
    }

    /// Number of submissions, such as bands, that are held back at present; 0 unless [`Renderer::is_paced`].
    pub fn held_back(&self) -> usize {
        self.queues.timelines.held()
    }

    /// True if this renderer holds back bands of its pictures ([`RendererOptions::paced`], on a single queue). Other work that is submitted during a
    /// picture then begins before the picture is done. True also while no picture is in flight.
    pub fn is_paced(&self) -> bool {
        self.queues.timelines.is_paced()
    }

    /// How long a queue of the device has been busy without finishing a submission, the longest of all queues; zero if all are idle.
    pub fn busy_for(&self) -> Duration {
        self.queues.timelines.busy_for()
    }

    /// The most expensive part of the rendering that ran for the last picture, which may still be in flight.
    pub fn drawn_work(&self) -> Work {
        self.drawing.work
    }

    /// True if there is a picture of the current size, done or in flight.
    pub fn has_drawn(&self) -> bool {
        self.drawing.has_picture
    }

    /// Waits for the picture in flight and returns it; without one, returns the last picture. If pictures stay on the device, it is copied to the
    /// host now. If [`Renderer::has_drawn`] is false, the colours are undefined.
    ///
    /// # Errors
    /// The device fails, or, if pictures stay on the device, the last change of the scene failed.
    pub fn end_picture(&mut self) -> Result<Picture, GpuError> {
        self.wait_drawn()?;
        let [width, height] = self.program.scene.picture_size();
        // A deep picture is rounded here, where a window shows more.
        let in_8_bits = |readback: &Readback| {
            Ok(match readback.image.1 {
                Format::Rgba8 => readback.bytes()?.into_owned(),
                Format::Bgra8 => readback.bytes()?.chunks_exact(4).flat_map(|c| [c[2], c[1], c[0], c[3]]).collect(),
                _ => readback.texels()?.encode(Format::Rgba8),
            })
        };
        let rgba = match &self.drawing.readback {
            Some(readback) => in_8_bits(readback),
            None => self.bring_back(Slot::Screen)?.as_ref().map_or(Ok(Vec::new()), in_8_bits),
        };
        Ok(Picture { width, height, rgba: rgba? })
    }

    /// Waits for the picture in flight. Returns it, or `None` if pictures stay on the device.
    ///
    /// # Errors
    /// The device fails.
    pub fn end_drawing(&mut self) -> Result<Option<Picture>, GpuError> {
        match self.drawing.readback.is_some() {
            true => self.end_picture().map(Some),
            false => {
                self.wait_drawn()?;
                // So that the times are those of this picture, not of the one before.
                self.drawing.collect(&mut self.queues).map(|()| None)
            }
        }
    }

    /// Waits for the picture in flight. If that fails, all steps and searches run again for the next picture.
    ///
    /// # Errors
    /// The device fails.
    pub(super) fn wait_drawn(&mut self) -> Result<(), GpuError> {
        self.drawing.wait(&mut self.queues).inspect_err(|_| {
            self.stale.fill(true);
            self.volumes.keep_found(|_| false);
        })
    }

    fn draw(&mut self) -> Result<(), GpuError> {
        self.flush()?;
        let Program { scene, plan, .. } = &self.program;
        plan.complete(scene, &mut self.stale, &self.contents);
        let steps = plan.steps_of(Frequency::Volume).chain(plan.steps_of(Frequency::Picture));
        let stale: Vec<_> = steps.filter(|(i, _)| self.stale[*i]).map(|(i, step)| (i, *step)).collect();
        self.drawing.begin(&mut self.queues, plan.work(scene, stale.iter().map(|(i, _)| *i)))?;
        let mut searched = Vec::new();
        for (i, step) in stale {
            let runs = match step.pass.frequency {
                Frequency::Volume => self.volumes.due_slices(&step, &self.program.scene),
                _ => std::iter::once(0..1).collect(),
            };
            if step.pass.frequency == Frequency::Volume && !runs.is_empty() {
                self.volumes.filtered = self.program.scene.visible_bounds;
                for (slot, search) in self.volumes.due_searches(&step, &self.program.scene) {
                    searched.push(slot);
                    self.find(slot, &search)?;
                }
            }
            for slices in runs {
                let (slice, slices) = (slices.start, slices.end - slices.start);
                let args = DispatchArgs { image: self.volumes.shown, slice, slices, ..step.args() };
                self.drawing.dispatch(&mut self.queues, &self.program.dispatch(i, &self.slots, &args))?;
            }
            // The slots count as written from here on. If the submission fails, all steps stay stale.
            self.contents.extend(step.writes(&self.program.scene).into_iter().map(|slot| (slot, step.id())));
        }
        self.drawing.submit(&mut self.queues, &self.slots)?;
        self.volumes.found(&searched);
        // Frames that arrive from here on are processed with the next picture.
        if self.program.plan.steps_of(Frequency::Volume).all(|(i, _)| self.stale[i]) {
            self.volumes.processed();
        }
        self.stale.fill(false);
        Ok(())
    }
}

impl Renderer {
    /// The start surface, at which rendering starts (setting `unveil`), that the CPU last found in the volume that is shown. None if the CPU has not
    /// searched that volume yet, or if the scene asks for no search.
    pub fn unveiled(&self) -> Option<&Unveiled> {
        self.volumes.unveiled().filter(|_| self.program.scene.unveils())
    }

    /// Finds something in the volume that is shown, and uploads it to `target`. What was recorded before is done first; the recording goes on afterwards.
    fn find(&mut self, target: Slot, search: &Search) -> Result<(), GpuError> {
        let (name, shown) = (search.name, self.volumes.shown);
        let volume = self.drawing.fetch(&mut self.queues, &self.slots, name, (search.within, shown))?;
        let Some(volume) = volume else { return Ok(()) };
        let (scene, bytes) = (&self.program.scene, volume.bytes()?);
        let found = self.queues.host(name, |_| (search.find)(scene, &bytes));
        if found.unveiled.is_some() {
            self.volumes.unveiled[shown as usize] = found.unveiled;
        }
        self.drawing.record_upload(&mut self.queues, &self.slots, name, (target, shown), &found.texels)
    }
}

#[cfg(feature = "view")]
impl Renderer {
    /// Presents the last picture, with its upper left corner at pixel `at` of the window, and panels over it. If a picture is in flight,
    /// the device waits for it and presents it.
    ///
    /// # Errors
    /// The device fails, a lost surface cannot be recreated, or the last change of the scene failed.
    pub fn present(
        &mut self,
        screen: &mut Screen,
        at: [u32; 2],
        panels: Option<Panels>,
    ) -> Result<PresentOutcome, GpuError> {
        self.check(self.volumes.shown)?;
        let is_kept = self.queues.timelines.is_paced();
        let Some(image) = self.slots.image(Slot::Screen, 0) else { return screen.show(panels) };
        let outcome = screen.show_picture(Drawn { image, queues: &mut self.queues, at, is_kept }, panels);
        self.drawing.presented(&self.queues);
        outcome
    }
}
