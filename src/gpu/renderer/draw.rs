//! From volumes to pictures: what changed is run again, here and now or while the host does something else.

use super::*;

impl Renderer {
    /// All frames of volume image `image` that are to be seen have been sent: the next picture shows it.
    pub fn show(&mut self, image: u32) -> Result<(), GpuError> {
        self.check(image)?;
        self.flush()?;
        self.shown = image;
        self.stale.iter_mut().for_each(|stale| *stale = true);
        Ok(())
    }

    /// Runs what changed since the last picture and brings the result back; where nothing changed, nothing runs.
    pub fn picture(&mut self) -> Result<Picture, GpuError> {
        self.begin_picture()?;
        self.end_picture()
    }

    /// Sends off what changed since the last picture. Frames may be sent meanwhile, but not into the slices that it shows unless they
    /// may wait for it. One picture is on its way at a time: another is waited for.
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

    /// Whether a picture is on its way and not done.
    pub fn is_drawing(&self) -> Result<bool, GpuError> {
        Ok(self.drawing && !self.picture.is_done(&self.timelines)?)
    }

    /// Whether there is a picture of this size, done or on its way.
    pub fn has_drawn(&self) -> bool {
        self.drawn
    }

    /// Waits for the picture that is on its way; the last one, where there is none. Where pictures stay on the device this one is brought
    /// back now.
    pub fn end_picture(&mut self) -> Result<Picture, GpuError> {
        self.wait_drawn()?;
        let [width, height] = self.scene.picture_size();
        let rgba = match &self.readback {
            Some(buffer) => buffer.bytes().to_vec(),
            None => self.bring_back(Slot::Screen)?.map_or(Vec::new(), |(buffer, ..)| buffer.bytes().to_vec()),
        };
        Ok(Picture { width, height, rgba })
    }

    /// The same without bringing it back, where pictures stay on the device.
    pub fn end_drawing(&mut self) -> Result<Option<Picture>, GpuError> {
        match self.readback.is_some() {
            true => self.end_picture().map(Some),
            false => {
                self.wait_drawn()?;
                // Whoever watches wants the times of what is shown, not of what was shown before.
                self.picture.collect(&self.timelines, &mut self.measured).map(|()| None)
            }
        }
    }

    /// Waits for the picture that is on its way.
    pub(super) fn wait_drawn(&mut self) -> Result<(), GpuError> {
        if !self.drawing {
            return Ok(());
        }
        let (picture, timelines) = (&self.picture, &self.timelines);
        let done = self.measured.host("wait", || picture.wait(timelines));
        match done.is_ok() {
            true => self.drawing = false,
            false => self.stale.iter_mut().for_each(|stale| *stale = true),
        }
        done
    }

    fn draw(&mut self) -> Result<(), GpuError> {
        self.flush()?;
        self.plan.complete(&self.scene, &mut self.stale, &self.contents);
        self.picture.collect(&self.timelines, &mut self.measured)?;
        self.picture.begin(&mut self.order, &self.timelines)?;
        let unseen = &self.unseen[self.shown as usize];
        let steps = self.plan.steps_of(Frequency::Volume).chain(self.plan.steps_of(Frequency::Picture));
        for (i, step) in steps.filter(|(i, _)| self.stale[*i]) {
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            let runs: Vec<_> = match step.pass.frequency {
                Frequency::Volume => {
                    let (low, high) = (scene.seen.low[2], scene.seen.high[2]);
                    let runs = affected(unseen, step.reach(scene)).into_iter();
                    runs.map(|run| run.start.max(low)..run.end.min(high)).filter(|run| !run.is_empty()).collect()
                }
                _ => std::iter::once(0..0).collect(),
            };
            if step.pass.frequency == Frequency::Volume && !runs.is_empty() {
                self.filtered = scene.seen;
            }
            for slices in runs {
                let (slice, slices) = (slices.start, slices.end - slices.start);
                let args = DispatchArgs { image: self.shown, slice, slices, ..step.args() };
                let work = Work { slots, pipeline, scene, pass: step.pass, args: &args };
                self.picture.dispatch(&mut self.order, &work)?;
            }
            // Taken as written from here on: if the submission fails, all of it is stale still.
            self.contents.extend(step.writes(scene).into_iter().map(|slot| (slot, step.id())));
        }
        if let (Some(screen), Some(readback)) = (self.slots.image(Slot::Screen, 0), &self.readback) {
            self.picture.copy_out(&mut self.order, screen, Slot::Screen, 0, readback);
            self.picture.stamp("readback");
        }
        let (picture, order, timelines) = (&mut self.picture, &mut self.order, &mut self.timelines);
        self.measured.host("submit", || picture.submit(order, timelines))?;
        (self.drawing, self.drawn) = (true, true);
        // A frame that arrives from here on is seen the next time, and so is one whose volume was not shown.
        if self.plan.steps_of(Frequency::Volume).all(|(i, _)| self.stale[i]) {
            self.unseen[self.shown as usize].iter_mut().for_each(|unseen| *unseen = false);
        }
        self.stale.iter_mut().for_each(|stale| *stale = false);
        Ok(())
    }
}
