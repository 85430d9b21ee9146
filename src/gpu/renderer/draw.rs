//! Stages 2 to 4: draws pictures from volumes, synchronously or while the host does other work. Only steps whose inputs changed
//! run again.

use super::*;
use crate::passes::pass::Search;
use crate::passes::unveil::Unveiled;
use crate::plan::Work;
#[cfg(feature = "view")]
use crate::window::screen::{Drawn, Panels, PresentOutcome, Screen};

impl Renderer {
    /// The next picture shows volume image `image`. All of its visible frames must have been sent.
    ///
    /// # Errors
    /// An image that does not exist; a device that fails.
    pub fn show(&mut self, image: u32) -> Result<(), GpuError> {
        self.check(image)?;
        self.flush()?;
        self.shown = image;
        self.stale.iter_mut().for_each(|stale| *stale = true);
        Ok(())
    }

    /// Draws a picture and copies it to the host. If nothing changed since the last picture, nothing runs.
    ///
    /// # Errors
    /// A device that fails; a failed change of scene.
    pub fn picture(&mut self) -> Result<Picture, GpuError> {
        self.begin_picture()?;
        self.end_picture()
    }

    /// Submits the steps that have changed since the last picture. Frames may be sent meanwhile; those for slices that the picture
    /// shows wait for it. If a picture is in flight, this waits for it first.
    ///
    /// # Errors
    /// A device that fails; a failed change of scene.
    pub fn begin_picture(&mut self) -> Result<(), GpuError> {
        self.check(self.shown)?;
        if self.drawing {
            self.wait_drawn()?;
        }
        match self.stale.iter().any(|stale| *stale) {
            true => self.draw(),
            false => Ok(()),
        }
    }

    /// True if a picture is in flight. Submits what is held back of it and due.
    ///
    /// # Errors
    /// A device that fails.
    pub fn is_drawing(&self) -> Result<bool, GpuError> {
        Ok(self.drawing && !self.picture.is_done(&self.timelines)?)
    }

    /// Number of submissions that are held back.
    pub fn held_back(&self) -> usize {
        self.timelines.held()
    }

    /// True if what is submitted to the device now begins before the picture in flight is done: its bands are held back.
    pub fn is_paced(&self) -> bool {
        self.timelines.is_paced()
    }

    /// How long the device has been at work without finishing anything; zero if it is idle.
    pub fn busy_for(&self) -> Duration {
        self.timelines.busy_for()
    }

    /// How much of the last picture was drawn again, also if it is in flight.
    pub fn drawn_work(&self) -> Work {
        self.drawn_work
    }

    /// True if there is a picture of the current size, done or in flight.
    pub fn has_drawn(&self) -> bool {
        self.drawn
    }

    /// Waits for the picture in flight and returns it; without one, returns the last picture. With pictures that stay on the
    /// device, copies it to the host now.
    ///
    /// # Errors
    /// A device that fails.
    pub fn end_picture(&mut self) -> Result<Picture, GpuError> {
        self.wait_drawn()?;
        let [width, height] = self.scene.picture_size();
        // A deep picture is rounded here, where a window shows more.
        let in_8_bits = |bytes: &[u8], format| match format {
            Format::Rgba8 => bytes.to_vec(),
            Format::Bgra8 => bytes.chunks_exact(4).flat_map(|c| [c[2], c[1], c[0], c[3]]).collect(),
            _ => Texels::decode([width as usize, height as usize, 1], format, bytes).encode(Format::Rgba8),
        };
        let rgba = match &self.readback {
            Some(readback) => in_8_bits(&readback.bytes()?, Slot::Screen.format(&self.scene)),
            None => match self.bring_back(Slot::Screen)? {
                Some((readback, _, format)) => in_8_bits(&readback.bytes()?, format),
                None => Vec::new(),
            },
        };
        Ok(Picture { width, height, rgba })
    }

    /// Waits for the picture in flight. Returns it, or `None` if pictures stay on the device.
    ///
    /// # Errors
    /// A device that fails.
    pub fn end_drawing(&mut self) -> Result<Option<Picture>, GpuError> {
        match self.readback.is_some() {
            true => self.end_picture().map(Some),
            false => {
                self.wait_drawn()?;
                // So that the times are those of this picture, not of the one before.
                self.picture.collect(&self.timelines, &mut self.timings).map(|()| None)
            }
        }
    }

    /// Waits for the picture in flight.
    pub(super) fn wait_drawn(&mut self) -> Result<(), GpuError> {
        if !self.drawing {
            return Ok(());
        }
        let (picture, timelines) = (&self.picture, &self.timelines);
        let done = self.timings.host("wait", || picture.wait(timelines));
        match done.is_ok() {
            true => self.drawing = false,
            false => {
                self.stale.iter_mut().for_each(|stale| *stale = true);
                self.found.clear();
            }
        }
        done
    }

    fn draw(&mut self) -> Result<(), GpuError> {
        self.flush()?;
        self.plan.complete(&self.scene, &mut self.stale, &self.contents);
        let stale =
            self.plan.steps.iter().enumerate().filter(|(i, s)| self.stale[*i] && s.pass.frequency != Frequency::Frame);
        self.drawn_work = self.plan.work(&self.scene, stale.map(|(i, _)| i));
        self.picture.collect(&self.timelines, &mut self.timings)?;
        self.picture.begin(&mut self.barriers, &self.timelines)?;
        // Those of the last picture, which is done.
        self.uploads.clear();
        let steps = self.plan.steps_of(Frequency::Volume).chain(self.plan.steps_of(Frequency::Picture));
        let stale: Vec<_> = steps.filter(|(i, _)| self.stale[*i]).map(|(i, step)| (i, *step)).collect();
        let mut searched = Vec::new();
        for (i, step) in stale {
            let unprocessed = &self.unprocessed[self.shown as usize];
            let scene = &self.scene;
            let runs: Vec<_> = match step.pass.frequency {
                Frequency::Volume => {
                    let (low, high) = (scene.visible_bounds.low[2], scene.visible_bounds.high[2]);
                    let runs = affected(unprocessed, step.reach(scene)).into_iter();
                    runs.map(|run| run.start.max(low)..run.end.min(high)).filter(|run| !run.is_empty()).collect()
                }
                _ => std::iter::once(0..1).collect(),
            };
            if step.pass.frequency == Frequency::Volume && !runs.is_empty() {
                self.filtered_bounds = scene.visible_bounds;
                let (reads, writes) = (step.reads(scene), step.writes(scene));
                let due = reads.iter().filter_map(|slot| Some((*slot, slot.search()?)));
                let due: Vec<_> = due.filter(|(slot, _)| !self.found.contains(&(*slot, self.shown))).collect();
                // Nothing is known of what is about to be replaced, should this picture fail.
                let is_replaced = |slot: Slot, image: u32| {
                    let is_due = due.iter().any(|(due, _)| *due == slot);
                    is_due && (image == self.shown || !slot.is_multibuffered())
                };
                let found = std::mem::take(&mut self.found);
                self.found = found.into_iter().filter(|(slot, image)| !is_replaced(*slot, *image)).collect();
                for (slot, search) in due {
                    searched.push(slot);
                    self.find(slot, &search)?;
                }
                // In a volume that changes it is looked for again.
                let changes = |slot: &Slot| slot.search().is_some_and(|search| writes.contains(&search.within));
                self.found.retain(|(slot, image)| *image != self.shown || !changes(slot));
            }
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            for slices in runs {
                let (slice, slices) = (slices.start, slices.end - slices.start);
                let args = DispatchArgs { image: self.shown, slice, slices, ..step.args() };
                let dispatch = Dispatch { slots, pipeline, scene, pass: step.pass, args: &args };
                let (barriers, timelines) = (&mut self.barriers, &mut self.timelines);
                match &self.limit {
                    Some(limit) => self.picture.dispatch_in_bands(barriers, timelines, &dispatch, limit)?,
                    None => self.picture.dispatch(barriers, &dispatch)?,
                }
            }
            // The slots count as written from here on. If the submission fails, all steps stay stale.
            self.contents.extend(step.writes(scene).into_iter().map(|slot| (slot, step.id())));
        }
        if let (Some(screen), Some(readback)) = (self.slots.image(Slot::Screen, 0), &self.readback) {
            self.picture.copy_out(&mut self.barriers, screen, Slot::Screen, 0, readback);
            self.picture.stamp(&mut self.barriers, "readback");
        }
        let (picture, barriers, timelines) = (&mut self.picture, &mut self.barriers, &mut self.timelines);
        self.timings.host("submit", || picture.submit(barriers, timelines))?;
        (self.drawing, self.drawn) = (true, true);
        self.found.retain(|(slot, _)| slot.is_multibuffered() || !searched.contains(slot));
        self.found.extend(searched.into_iter().map(|slot| (slot, self.shown)));
        // Frames that arrive from here on are processed with the next picture.
        if self.plan.steps_of(Frequency::Volume).all(|(i, _)| self.stale[i]) {
            self.unprocessed[self.shown as usize].iter_mut().for_each(|unprocessed| *unprocessed = false);
        }
        self.stale.iter_mut().for_each(|stale| *stale = false);
        Ok(())
    }
}

impl Renderer {
    /// What the CPU last found of the volume that is shown, where the render start follows the fluid.
    pub fn unveiled(&self) -> Option<&Unveiled> {
        let found = self.unveiled.get(self.shown as usize)?.as_ref();
        found.filter(|_| self.scene.unveils())
    }

    /// Finds something in the volume that is shown, and uploads it to `target`. What was recorded before is done first; the recording goes on afterwards.
    fn find(&mut self, target: Slot, search: &Search) -> Result<(), GpuError> {
        let (name, source) = (search.name, search.within);
        let Some(volume) = self.slots.image(source, self.shown) else { return Ok(()) };
        let readback = Readback::new(&self.context, name, volume.shape, volume.format.texel_bytes())?;
        self.picture.copy_out(&mut self.barriers, volume, source, self.shown, &readback);
        let done = self.picture.cut(&mut self.barriers, &mut self.timelines).and_then(|()| self.timelines.wait_all());
        if done.is_err() {
            // The copy may still be running: the buffer must outlive it.
            self.unread.push(readback);
            return done;
        }
        self.unveiled.resize(self.volume_images as usize, None);
        let (scene, bytes) = (&self.scene, readback.bytes()?);
        let Some(unveiled) = self.unveiled.get_mut(self.shown as usize) else { return Ok(()) };
        let found = self.timings.host(name, || (search.find)(scene, &bytes));
        *unveiled = found.unveiled.or(unveiled.take());
        let copy = if target.is_multibuffered() { self.shown } else { 0 };
        let Some(image) = self.slots.image(target, copy) else { return Ok(()) };
        let place = SlotParts { slot: target, copy, parts: 0..image.shape.parts() };
        let upload = Upload::new(&self.context, name, image.layout(), place.parts.clone(), &found.texels)?;
        self.picture.upload(&mut self.barriers, &upload, image, place);
        self.uploads.push(upload);
        Ok(())
    }
}

#[cfg(feature = "view")]
impl Renderer {
    /// Presents the last picture, with its upper left corner at pixel `at` of the window, and panels over it. A picture in flight is
    /// waited for on the device and presented.
    ///
    /// # Errors
    /// A device that fails, or a lost surface that cannot be recreated.
    pub fn present(
        &mut self,
        screen: &mut Screen,
        at: [u32; 2],
        panels: Option<Panels>,
    ) -> Result<PresentOutcome, GpuError> {
        self.check(self.shown)?;
        let is_kept = self.timelines.is_paced();
        let Some(image) = self.slots.image(Slot::Screen, 0) else { return screen.show(panels) };
        let (barriers, timelines) = (&mut self.barriers, &mut self.timelines);
        let outcome = screen.show_picture(Drawn { image, barriers, timelines, at, is_kept }, panels);
        self.presented = self.timelines.of(0).submitted;
        outcome
    }
}
