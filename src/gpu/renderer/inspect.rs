//! What a renderer holds, did, and how long it took.

use super::*;

impl Renderer {
    /// A slot's content now; none for a slot that the plan does not have, or one made by the CPU as a table.
    pub fn read(&mut self, slot: Slot) -> Result<Option<Texels>, GpuError> {
        let there = self.bring_back(slot)?;
        Ok(there.map(|(buffer, size, format)| Texels::decode(size, format, buffer.bytes())))
    }

    /// A slot's bytes now, its texels along each axis, and their format.
    pub(super) fn bring_back(&mut self, slot: Slot) -> Result<Option<(Buffer, [usize; 3], Format)>, GpuError> {
        self.check(self.shown)?;
        self.flush()?;
        let Some(image) = self.slots.image(slot, self.shown) else { return Ok(None) };
        let buffer = Buffer::new(&self.context, "read", slot.bytes(&self.scene), Purpose::Readback)?;
        let (format, size) = (image.format, size_of(image.shape));
        let copy = if slot.is_multibuffered() { self.shown } else { 0 };
        self.picture.collect(&self.timelines, &mut self.measured)?;
        self.picture.begin(&mut self.order, &self.timelines)?;
        self.picture.copy_out(&mut self.order, image, slot, copy, &buffer);
        self.picture.submit(&mut self.order, &mut self.timelines)?;
        let done = self.timelines.wait_all();
        if done.is_err() {
            // The copy may still be running.
            self.uploads.push(buffer);
            return done.map(|()| None);
        }
        Ok(Some((buffer, size, format)))
    }

    /// Times of every pass since the last call, and of what was copied. Empty where the device has no time stamps.
    pub fn take_times(&mut self) -> Result<Vec<PassTime>, GpuError> {
        self.collect()?;
        Ok(self.measured.take_times())
    }

    /// The same of what is done already, without waiting for the rest.
    pub fn times_so_far(&mut self) -> Vec<PassTime> {
        self.measured.take_times()
    }

    /// Every span since the last call, if they are kept, on the host's clock.
    pub fn take_spans(&mut self) -> Result<Vec<Span>, GpuError> {
        self.collect()?;
        Ok(self.measured.take_spans())
    }

    /// Names of the passes that `work` dispatched, in order.
    pub fn dispatched<T>(
        &mut self,
        work: impl FnOnce(&mut Renderer) -> Result<T, GpuError>,
    ) -> Result<Vec<&'static str>, GpuError> {
        Ok(self.recorded(work)?.into_iter().map(|(name, _)| name).collect())
    }

    /// The same, with how many invocations each had along each axis.
    pub fn recorded<T>(
        &mut self,
        work: impl FnOnce(&mut Renderer) -> Result<T, GpuError>,
    ) -> Result<Vec<(&'static str, [u32; 3])>, GpuError> {
        self.order.dispatched = Some(Vec::new());
        let done = work(self);
        let dispatched = self.order.dispatched.take().unwrap_or_default();
        done.map(|_| dispatched)
    }

    /// Frames so far that nothing of their scene could see, and that were not uploaded.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Barriers recorded so far.
    pub fn barriers(&self) -> u32 {
        self.order.barriers
    }

    /// All that was recorded and submitted so far, where [`Options::log`] asked for it.
    pub fn log(&self) -> Option<&Log> {
        self.order.log.as_ref()
    }

    /// Leaves out the n-th barrier from here on (1: the first ever recorded), to show that validation notices.
    pub fn drop_barrier(&mut self, n: u32) {
        self.order.drop_barrier = Some(n);
    }
}
