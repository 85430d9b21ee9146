//! Timeline semaphores, one for each queue. Their values tell which submissions are done.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::faults::InjectionPoint;
use super::paced::Paced;
use super::watchdog::Progress;
use crate::sync::locked;
use ash::vk;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The timeline semaphore of a queue. A submission is done when the timeline has reached the submission's value.
pub(crate) struct Timeline {
    context: Arc<Context>,
    pub(super) semaphore: vk::Semaphore,
    /// The timeline value of the last submission.
    pub submitted: u64,
    /// Name of the last submission.
    label: String,
    progress: Mutex<Progress>,
    /// What is held back, if submissions are.
    paced: Option<Mutex<Paced<(u64, Submission)>>>,
}

/// A recorded command buffer to submit, and what it waits for.
pub(super) struct Submission {
    pub queue: usize,
    pub commands: vk::CommandBuffer,
    /// Timeline semaphores of other queues, with the values to wait for.
    pub waits: Vec<(vk::Semaphore, u64)>,
    pub label: &'static str,
    /// Expected GPU time, ns; 0 if it is short or not known.
    pub expected: f64,
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
        Ok(Timeline { context, semaphore, submitted: 0, label, progress, paced: None })
    }

    /// Counts a submission that was made elsewhere and signals `submitted + 1`. Nothing may be held back.
    #[cfg(feature = "view")]
    pub(super) fn advance(&mut self, label: &str) {
        self.submitted += 1;
        label.clone_into(&mut self.label);
        self.progress(|progress| progress.submitted(self.submitted, Instant::now()));
    }

    /// Submits the work, or holds it back while the device has enough to do. Returns the timeline value at which it is done.
    ///
    /// # Errors
    /// The device fails. The work then counts as not submitted.
    pub(super) fn submit(&mut self, work: Submission) -> Result<u64, GpuError> {
        let (value, label) = (self.submitted + 1, work.label);
        match &self.paced {
            None => self.send(&work, value)?,
            Some(paced) => {
                let mut paced = locked(paced);
                let expected = work.expected;
                paced.push(value, expected, (value, work));
                self.send_due(&mut paced).inspect_err(|_| paced.pop_back())?;
            }
        }
        self.submitted = value;
        label.clone_into(&mut self.label);
        Ok(value)
    }

    /// Submits at once. The timeline gets `value` when it is done.
    fn send(&self, work: &Submission, value: u64) -> Result<(), GpuError> {
        let everything = vk::PipelineStageFlags2::ALL_COMMANDS;
        let semaphore = |(handle, value): (vk::Semaphore, u64)| {
            vk::SemaphoreSubmitInfo::default().semaphore(handle).value(value).stage_mask(everything)
        };
        let waits: Vec<_> = work.waits.iter().map(|wait| semaphore(*wait)).collect();
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(work.commands)];
        let signal = [semaphore((self.semaphore, value))];
        let submit = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signal);
        self.context.submit(work.queue, &submit, vk::Fence::null(), || format!("submit '{}'", work.label))?;
        self.progress(|progress| progress.submitted(value, Instant::now()));
        Ok(())
    }

    fn send_due(&self, paced: &mut Paced<(u64, Submission)>) -> Result<(), GpuError> {
        while let Some((value, work)) = paced.due() {
            self.send(work, *value)?;
            paced.sent();
        }
        Ok(())
    }

    /// Submits everything that is held back up to this timeline value.
    ///
    /// # Errors
    /// The device fails. What was not submitted stays held back.
    pub(super) fn release(&self, value: u64) -> Result<(), GpuError> {
        let Some(paced) = &self.paced else { return Ok(()) };
        let mut paced = locked(paced);
        while let Some((value, work)) = paced.up_to(value) {
            self.send(work, *value)?;
            paced.sent();
        }
        Ok(())
    }

    /// Number of submissions that are held back.
    fn held(&self) -> usize {
        self.paced.as_ref().map_or(0, |paced| locked(paced).held())
    }

    fn progress<T>(&self, with: impl FnOnce(&mut Progress) -> T) -> T {
        with(&mut locked(&self.progress))
    }

    fn operation(&self) -> String {
        format!("run {}", self.label)
    }

    /// The value that the device has reached.
    fn reached(&self) -> Result<u64, vk::Result> {
        // SAFETY: the semaphore is alive.
        let reached = unsafe { self.context.device.get_semaphore_counter_value(self.semaphore) }?;
        self.progress(|progress| progress.reached(reached, Instant::now()));
        if let Some(paced) = &self.paced {
            locked(paced).reached(reached);
        }
        Ok(reached)
    }

    /// Since when the device has been busy without finishing a submission of this queue; now if it is not.
    fn busy_since(&self) -> Instant {
        // Progress that was made but not looked at counts. If the device cannot be asked, the wait fails by itself.
        let _ = self.reached();
        self.progress(|progress| progress.busy_since()).unwrap_or_else(Instant::now)
    }

    /// Blocks until the submission with this timeline value is done.
    ///
    /// # Errors
    /// The device fails, or is given up because it does not finish.
    pub fn wait(&self, value: u64) -> Result<(), GpuError> {
        let operation = || self.operation();
        self.release(value)?;
        match self.context.faults.check(InjectionPoint::Wait) {
            Err(vk::Result::TIMEOUT) => return Err(self.context.watchdog.inject_lateness(operation)),
            other => other.context(operation).map_err(|error| self.context.explain(error))?,
        }
        let (semaphores, values) = ([self.semaphore], [value]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        super::calls::begins("vkWaitSemaphores", "");
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

    pub(crate) fn wait_all(&self) -> Result<(), GpuError> {
        self.wait(self.submitted)
    }

    /// True if the submission with this timeline value is done; does not wait. If it is not done, this submits what is held back and due.
    ///
    /// # Errors
    /// The device fails, or is given up because it does not finish.
    pub fn is_done(&self, value: u64) -> Result<bool, GpuError> {
        self.context.watchdog.check(|| self.operation())?;
        let reached = self.reached().context(|| self.operation()).map_err(|error| self.context.explain(error))?;
        if reached >= value {
            return Ok(true);
        }
        if let Some(paced) = &self.paced {
            self.send_due(&mut locked(paced))?;
        }
        self.context.watchdog.check_deadline(self.busy_since(), || self.operation())?;
        Ok(false)
    }

    /// Waits for all submissions, or, if that fails, for an idle device. Call it before resources in flight are destroyed. If the device was lost or
    /// given up, it returns at once; after giving up, nothing is destroyed.
    pub fn drain(&self) {
        if self.wait_all().is_err() {
            let _ = self.context.wait_idle();
        }
    }
}

/// The timelines of all queues that a renderer uses, by queue.
pub(crate) struct Timelines(pub(super) Vec<Timeline>);

impl Timelines {
    pub fn new(context: &Arc<Context>, queues: usize) -> Result<Timelines, GpuError> {
        (0..queues).map(|_| Timeline::new(context)).collect::<Result<_, _>>().map(Timelines)
    }

    /// From now on, submissions are held back while the device has work of this expected time. With several queues, which wait for each other,
    /// nothing is held back.
    pub(super) fn pace(&mut self, most: Duration) {
        if let [only] = &mut self.0[..] {
            only.paced = Some(Mutex::new(Paced::new(most)));
        }
    }

    /// Submits everything that is held back.
    ///
    /// # Errors
    /// The device fails.
    #[cfg(feature = "view")]
    pub(super) fn release(&self) -> Result<(), GpuError> {
        self.0.iter().try_for_each(|timeline| timeline.release(timeline.submitted))
    }

    /// True if submissions are held back when there is enough work: [`Timelines::pace`] was called, and there is one queue.
    pub(super) fn is_paced(&self) -> bool {
        self.0.iter().any(|timeline| timeline.paced.is_some())
    }

    /// Number of submissions that are held back.
    pub(super) fn held(&self) -> usize {
        self.0.iter().map(Timeline::held).sum()
    }

    /// Blocks until everything that was submitted to these queues is done.
    pub(crate) fn wait_all(&self) -> Result<(), GpuError> {
        self.0.iter().try_for_each(Timeline::wait_all)
    }

    /// How long a queue of the device has been busy without finishing a submission, the longest of all queues; zero if all are idle.
    pub fn busy_for(&self) -> Duration {
        self.0.iter().map(|timeline| timeline.busy_since().elapsed()).max().unwrap_or_default()
    }

    /// Waits for all submissions to all queues, or, if that fails, for an idle device. Call it before resources in flight are destroyed.
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
        // SAFETY: the owner waited for the device before it drops its timeline.
        self.context.destroy(|device| unsafe { device.destroy_semaphore(self.semaphore, None) });
    }
}
