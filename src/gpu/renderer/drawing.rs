//! What is recorded for the queue that draws: pictures, and copies between slots and the host.

use super::RendererOptions;
use crate::bands::BandLimit;
use crate::buffers::{Readback, Upload};
use crate::command_recorder::{CommandRecorder, Dispatch};
use crate::context::Context;
use crate::device_queues::DeviceQueues;
use crate::error::GpuError;
use crate::passes::Slot;
use crate::passes::slots::{Format, Shape};
use crate::plan::Work;
use crate::resources::{Image, SlotResources};
use crate::scene::Scene;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// The picture that is being drawn or was drawn last, and the buffers of its copies. Every method that returns a [`GpuError`] does so if the device
/// fails.
pub(super) struct Drawing {
    // Dropped first.
    recorder: CommandRecorder,
    /// The buffers with the last picture on the host, once it was waited for. `None` if pictures stay on the device.
    pub readback: Option<Readback>,
    /// Buffers of a single copy, kept until the device is done with them.
    uploads: Vec<Upload>,
    unread: Vec<Readback>,
    context: Arc<Context>,
    /// `None` if no dispatch is divided.
    limit: Option<BandLimit>,
    /// A picture has been submitted and not waited for.
    pub is_in_flight: bool,
    /// The picture's image holds a picture of the current size, or will when the device is done.
    pub has_picture: bool,
    /// The most expensive part of the rendering that ran for the last picture.
    pub work: Work,
    /// The value of queue 0's timeline at which the last presentation is done.
    presented: u64,
}

impl Drawing {
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        options: &RendererOptions,
        queues: &mut DeviceQueues,
    ) -> Result<Drawing, GpuError> {
        let is_software = context.candidate.is_software();
        let limit = match options.paced && queues.tracker.count() == 1 {
            true => BandLimit::paced(options.bands, is_software),
            false => BandLimit::new(options.bands, is_software),
        };
        if let Some(limit) = limit.filter(|_| options.paced) {
            queues.timelines.pace(limit.in_flight());
        }
        Ok(Drawing {
            recorder: CommandRecorder::new(context, 0, "picture", options.time_stamps, options.spans)?,
            readback: options.readback.then(|| Readback::new(context, "readback", picture_image(scene))).transpose()?,
            uploads: Vec::new(),
            unread: Vec::new(),
            context: context.clone(),
            limit,
            is_in_flight: false,
            has_picture: false,
            work: Work::Rays,
            presented: 0,
        })
    }

    /// Makes the readback buffer that of the scene's picture.
    pub fn fit(&mut self, scene: &Scene) -> Result<(), GpuError> {
        let image = picture_image(scene);
        if self.readback.as_ref().is_some_and(|readback| readback.image != image) {
            self.readback = Some(Readback::new(&self.context, "readback", image)?);
        }
        Ok(())
    }

    /// Clears new images of slots. If the picture's image is among them, there is no picture any more.
    pub fn clear(
        &mut self,
        queues: &mut DeviceQueues,
        slots: &SlotResources,
        new: &[(Slot, u32)],
    ) -> Result<(), GpuError> {
        self.has_picture &= !new.iter().any(|(slot, _)| *slot == Slot::Screen);
        if new.is_empty() {
            return Ok(());
        }
        self.recorder.begin(queues)?;
        self.recorder.clear_new(queues, slots, new);
        self.recorder.submit(queues)
    }

    /// Uploads the texels of a slot, and waits. Nothing in flight may read the slot.
    pub fn upload(
        &mut self,
        queues: &mut DeviceQueues,
        slots: &SlotResources,
        slot: Slot,
        bytes: &[u8],
    ) -> Result<(), GpuError> {
        let Some(there) = slots.image(slot, 0) else { return Ok(()) };
        // Before the recording: what was begun has to be submitted.
        let upload = Upload::new(&self.context, "upload", there.layout(), there.all_parts((slot, 0)), bytes)?;
        self.recorder.begin(queues)?;
        // A layer that tracks submissions of two threads forgets what was between this upload and the last one.
        self.recorder.show_layer_the_wait();
        self.recorder.upload(queues, &upload, there);
        self.uploads.push(upload);
        self.recorder.submit(queues)?;
        queues.timelines.wait_all()?;
        self.uploads.clear();
        Ok(())
    }

    /// Reads back an image slot; for a multibuffered slot, the copy of the volume image of `place`. None for a slot that is no image.
    pub(crate) fn bring_back(
        &mut self,
        queues: &mut DeviceQueues,
        slots: &SlotResources,
        place: (Slot, u32),
    ) -> Result<Option<Readback>, GpuError> {
        let Some(there) = slots.image(place.0, place.1) else { return Ok(None) };
        // Before the recording: what was begun has to be submitted.
        let buffer = Readback::new(&self.context, "read", there.layout())?;
        self.recorder.collect(queues)?;
        self.recorder.begin(queues)?;
        self.copy_out(queues, there, place, buffer, CommandRecorder::submit).map(Some)
    }

    /// Begins the recording of a picture. `work`: the most expensive part of the rendering that it will run.
    pub fn begin(&mut self, queues: &mut DeviceQueues, work: Work) -> Result<(), GpuError> {
        self.work = work;
        self.recorder.collect(queues)?;
        self.recorder.begin(queues)?;
        // Those of the last picture, which is done.
        self.uploads.clear();
        Ok(())
    }

    /// Records a dispatch that belongs to the picture.
    pub fn dispatch(&mut self, queues: &mut DeviceQueues, dispatch: &Dispatch) -> Result<(), GpuError> {
        self.recorder.dispatch(queues, dispatch, self.limit.as_ref())
    }

    /// Submits what was recorded of the picture so far, waits for it, and copies an image slot to the host. The recording goes on afterwards.
    /// `name`: of the buffer, for messages. `place`: slot and volume image. None for a slot that is no image.
    pub fn fetch(
        &mut self,
        queues: &mut DeviceQueues,
        slots: &SlotResources,
        name: &'static str,
        place: (Slot, u32),
    ) -> Result<Option<Readback>, GpuError> {
        let Some(there) = slots.image(place.0, place.1) else { return Ok(None) };
        let buffer = Readback::new(&self.context, name, there.layout())?;
        self.copy_out(queues, there, place, buffer, CommandRecorder::cut).map(Some)
    }

    /// Records a copy of a slot, of this volume image where there are several, `submit`s and waits.
    fn copy_out(
        &mut self,
        queues: &mut DeviceQueues,
        there: &Image,
        place: (Slot, u32),
        buffer: Readback,
        submit: fn(&mut CommandRecorder, &mut DeviceQueues) -> Result<(), GpuError>,
    ) -> Result<Readback, GpuError> {
        self.recorder.copy_out(queues, there, place, &buffer);
        match submit(&mut self.recorder, queues).and_then(|()| queues.timelines.wait_all()) {
            Ok(()) => Ok(buffer),
            Err(error) => {
                // The copy may still be running: the buffer must outlive it.
                self.unread.push(buffer);
                Err(error)
            }
        }
    }

    /// Records, as part of the picture, the upload of a slot; for a multibuffered slot, of the copy of the volume image of `place`.
    pub(crate) fn record_upload(
        &mut self,
        queues: &mut DeviceQueues,
        slots: &SlotResources,
        name: &'static str,
        place: (Slot, u32),
        texels: &[u8],
    ) -> Result<(), GpuError> {
        let Some(there) = slots.image(place.0, place.1) else { return Ok(()) };
        let upload = Upload::new(&self.context, name, there.layout(), there.all_parts(place), texels)?;
        self.recorder.upload(queues, &upload, there);
        self.uploads.push(upload);
        Ok(())
    }

    /// Submits what was recorded of the picture since [`Drawing::begin`], and its readback if there is one, without waiting for it.
    pub fn submit(&mut self, queues: &mut DeviceQueues, slots: &SlotResources) -> Result<(), GpuError> {
        if let (Some(screen), Some(readback)) = (slots.image(Slot::Screen, 0), &self.readback) {
            self.recorder.copy_out(queues, screen, (Slot::Screen, 0), readback);
            self.recorder.stamp(queues, "readback")?;
        }
        queues.host("submit", |queues| self.recorder.submit(queues))?;
        (self.is_in_flight, self.has_picture) = (true, true);
        Ok(())
    }

    /// True if the device is at work on a picture. It also submits what is held back of the picture and due.
    pub fn is_drawing(&self, queues: &DeviceQueues) -> Result<bool, GpuError> {
        let is_held = self.context.faults.holds_pictures.load(Ordering::Relaxed);
        Ok(self.is_in_flight && (!self.recorder.is_done(queues)? || is_held))
    }

    /// Waits for the picture in flight.
    pub fn wait(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        if self.is_in_flight {
            queues.host("wait", |queues| self.recorder.wait(queues))?;
            self.is_in_flight = false;
        }
        Ok(())
    }

    /// Waits for the last picture, and adds its times to the queues' timings.
    pub fn collect(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        self.recorder.collect(queues)
    }

    /// Notes that the last submission to queue 0 presents the picture.
    #[cfg(feature = "view")]
    pub fn presented(&mut self, queues: &DeviceQueues) {
        self.presented = queues.timelines.0[0].submitted;
    }

    /// Waits until the last presentation has read the picture's image.
    pub(crate) fn wait_presented(&self, queues: &DeviceQueues) -> Result<(), GpuError> {
        queues.timelines.0[0].wait(self.presented)
    }
}

/// Shape and format of the picture's image.
fn picture_image(scene: &Scene) -> (Shape, Format) {
    (Slot::Screen.shape(scene), Slot::Screen.format(scene))
}
