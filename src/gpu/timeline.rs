//! Timeline semaphores, one for each queue: they say which submissions are done.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::faults::InjectionPoint;
use ash::vk;
use std::sync::Arc;

/// A software device may need minutes for a picture 16384 pixels wide.
const TIMEOUT_SECONDS: u64 = 600;

/// A submission is done when its queue's timeline has reached its value.
pub struct Timeline {
    context: Arc<Context>,
    pub(super) semaphore: vk::Semaphore,
    /// The value of the last submission.
    pub submitted: u64,
    /// Name of the last submission.
    pub(super) label: String,
}

impl Timeline {
    pub fn new(context: &Arc<Context>) -> Result<Timeline, GpuError> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let create = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the chain is complete and outlives the call.
        let semaphore =
            unsafe { context.device.create_semaphore(&create, None) }.context(|| "create timeline".into())?;
        context.name(semaphore, "timeline");
        Ok(Timeline { context: context.clone(), semaphore, submitted: 0, label: String::new() })
    }

    /// Blocks until a submission is done.
    ///
    /// # Errors
    /// A time-out; a device that fails.
    pub fn wait(&self, value: u64) -> Result<(), GpuError> {
        let (semaphores, values) = ([self.semaphore], [value]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is alive; the arrays outlive the call.
        let result = self
            .context
            .faults
            .check(InjectionPoint::Wait)
            .and_then(|()| unsafe { self.context.device.wait_semaphores(&wait, TIMEOUT_SECONDS * 1_000_000_000) });
        match result {
            Err(vk::Result::TIMEOUT) => {
                Err(GpuError::TimedOut { seconds: TIMEOUT_SECONDS, operation: self.label.clone() })
            }
            other => other.context(|| format!("run {}", self.label)).map_err(|error| self.context.explain(error)),
        }
    }

    pub fn wait_all(&self) -> Result<(), GpuError> {
        self.wait(self.submitted)
    }

    /// True if a submission is done; does not wait.
    pub fn is_done(&self, value: u64) -> Result<bool, GpuError> {
        // SAFETY: the semaphore is alive.
        let reached = unsafe { self.context.device.get_semaphore_counter_value(self.semaphore) };
        reached
            .map(|reached| reached >= value)
            .context(|| format!("run {}", self.label))
            .map_err(|error| self.context.explain(error))
    }

    /// To be called before resources in flight are destroyed: waits for all submissions, and if that fails for an idle device. A
    /// lost device returns at once.
    pub fn drain(&self) {
        if self.wait_all().is_err() {
            self.context.wait_idle();
        }
    }
}

/// The timelines of all queues that a renderer uses.
pub struct Timelines(Vec<Timeline>);

impl Timelines {
    pub fn new(context: &Arc<Context>, queues: usize) -> Result<Timelines, GpuError> {
        (0..queues).map(|_| Timeline::new(context)).collect::<Result<_, _>>().map(Timelines)
    }

    pub(super) fn of(&self, queue: usize) -> &Timeline {
        &self.0[queue]
    }

    pub(super) fn of_mut(&mut self, queue: usize) -> &mut Timeline {
        &mut self.0[queue]
    }

    pub fn wait_all(&self) -> Result<(), GpuError> {
        self.0.iter().try_for_each(Timeline::wait_all)
    }

    /// See [`Timeline::drain`].
    pub fn drain(&self) {
        self.0.iter().for_each(Timeline::drain);
    }
}

impl Drop for Timelines {
    fn drop(&mut self) {
        // lavapipe (Mesa 22.3, `vk_queue_submit_destroy`) releases the timelines that a submission waited for only after it has signalled
        // its own. A timeline that is destroyed at once may still be locked there.
        if let [first, _, ..] = &self.0[..] {
            first.context.wait_idle();
        }
    }
}

impl Drop for Timeline {
    fn drop(&mut self) {
        // SAFETY: the owner waited for the device before it drops its timeline.
        unsafe { self.context.device.destroy_semaphore(self.semaphore, None) };
    }
}
