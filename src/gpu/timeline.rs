//! Timeline semaphores, one for each queue: they say which submissions are done.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::faults::InjectionPoint;
use super::watchdog::Progress;
use ash::vk;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// A submission is done when its queue's timeline has reached its value.
pub struct Timeline {
    context: Arc<Context>,
    pub(super) semaphore: vk::Semaphore,
    /// The value of the last submission.
    pub submitted: u64,
    /// Name of the last submission.
    label: String,
    progress: Mutex<Progress>,
}

impl Timeline {
    pub fn new(context: &Arc<Context>) -> Result<Timeline, GpuError> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let create = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the chain is complete and outlives the call.
        let semaphore =
            unsafe { context.device.create_semaphore(&create, None) }.context(|| "create timeline".into())?;
        context.name(semaphore, "timeline");
        let (context, label, progress) = (context.clone(), String::new(), Mutex::default());
        Ok(Timeline { context, semaphore, submitted: 0, label, progress })
    }

    /// Counts a submission that signals `submitted + 1`.
    pub(super) fn advance(&mut self, label: &str) {
        self.submitted += 1;
        label.clone_into(&mut self.label);
        self.progress(|progress| progress.submitted(self.submitted, Instant::now()));
    }

    fn progress<T>(&self, with: impl FnOnce(&mut Progress) -> T) -> T {
        with(&mut self.progress.lock().unwrap_or_else(|e| e.into_inner()))
    }

    fn operation(&self) -> String {
        format!("run {}", self.label)
    }

    /// The value that the device has reached.
    fn reached(&self) -> Result<u64, vk::Result> {
        // SAFETY: the semaphore is alive.
        let reached = unsafe { self.context.device.get_semaphore_counter_value(self.semaphore) }?;
        self.progress(|progress| progress.reached(reached, Instant::now()));
        Ok(reached)
    }

    /// Since when the device has been busy without finishing a submission of this queue; now if it is not.
    fn busy_since(&self) -> Instant {
        // Progress that was made but not looked at counts. If the device cannot be asked, the wait fails by itself.
        let _ = self.reached();
        self.progress(|progress| progress.busy_since()).unwrap_or_else(Instant::now)
    }

    /// How long the device has been busy without finishing a submission of this queue; zero if it is idle.
    pub(super) fn busy_for(&self) -> Duration {
        self.busy_since().elapsed()
    }

    /// Blocks until a submission is done.
    ///
    /// # Errors
    /// A device that fails, or is given up because it does not finish.
    pub fn wait(&self, value: u64) -> Result<(), GpuError> {
        let operation = || self.operation();
        match self.context.faults.check(InjectionPoint::Wait) {
            Err(vk::Result::TIMEOUT) => return Err(self.context.watchdog.inject_lateness(operation)),
            other => other.context(operation).map_err(|error| self.context.explain(error))?,
        }
        let (semaphores, values) = ([self.semaphore], [value]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is alive; the arrays outlive the call.
        let attempt = |ns| unsafe { self.context.device.wait_semaphores(&wait, ns) };
        let done = self.context.watchdog.wait(&operation, || self.busy_since(), attempt);
        done.map_err(|error| self.context.explain(error))?;
        self.progress(|progress| progress.reached(value, Instant::now()));
        if value == self.submitted {
            self.context.show_layer_an_idle_queue()?;
        }
        Ok(())
    }

    pub fn wait_all(&self) -> Result<(), GpuError> {
        self.wait(self.submitted)
    }

    /// True if a submission is done; does not wait.
    ///
    /// # Errors
    /// A device that fails, or is given up because it does not finish.
    pub fn is_done(&self, value: u64) -> Result<bool, GpuError> {
        self.context.watchdog.check(|| self.operation())?;
        let reached = self.reached().context(|| self.operation()).map_err(|error| self.context.explain(error))?;
        if reached >= value {
            return Ok(true);
        }
        self.context.watchdog.check_deadline(self.busy_since(), || self.operation())?;
        Ok(false)
    }

    /// To be called before resources in flight are destroyed: waits for all submissions, and if that fails for an idle device. A
    /// device that was lost or given up returns at once; of one that was given up, nothing is destroyed.
    pub fn drain(&self) {
        if self.wait_all().is_err() {
            let _ = self.context.wait_idle();
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

    /// How long the device has been busy without finishing a submission of some queue; zero if it is idle.
    pub fn busy_for(&self) -> Duration {
        self.0.iter().map(Timeline::busy_for).max().unwrap_or_default()
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
            // A device that is given up keeps its timelines.
            let _ = first.context.wait_idle();
        }
    }
}

impl Drop for Timeline {
    fn drop(&mut self) {
        if self.context.is_given_up() {
            return;
        }
        // SAFETY: the owner waited for the device before it drops its timeline.
        unsafe { self.context.device.destroy_semaphore(self.semaphore, None) };
    }
}
