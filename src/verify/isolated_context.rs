//! Contexts of a check's own: devices that are to be lost, that stand for lesser ones, or whose one queue plays several.
//!
//! Layers of 1.3.239 do not see that a queue or the host waits for a timeline. Where one queue plays several they call everything between
//! submissions a hazard, and where memory that was read back from is taken anew, that.

use super::{Bench, Found};
use crate::gpu::{Context, GpuError};
use crate::verify::report::Fault;
use std::sync::Arc;

/// Another context on the bench's device; what validation said of it is told at the end.
pub(super) struct IsolatedContext {
    pub context: Arc<Context>,
    /// Hazards between submissions are told.
    hears: bool,
}

impl IsolatedContext {
    /// # Errors
    /// As of [`Bench::another`].
    pub fn new(bench: &Bench) -> Result<IsolatedContext, GpuError> {
        IsolatedContext::of_queues(bench, 1)
    }

    /// One that is used as if it had so many queues.
    ///
    /// # Errors
    /// As of [`Bench::another`].
    pub fn of_queues(bench: &Bench, queues: usize) -> Result<IsolatedContext, GpuError> {
        let context = bench.another()?;
        Ok(IsolatedContext { hears: context.queue_count() >= queues, context })
    }

    /// One whose renderers change often, or are made anew after slots were read back.
    ///
    /// # Errors
    /// As of [`Bench::another`].
    pub fn of_changes(bench: &Bench) -> Result<IsolatedContext, GpuError> {
        Ok(IsolatedContext { hears: false, context: bench.another()? })
    }

    /// One that lacks something, by what `change` does to what is known of it, before anything is made from it.
    ///
    /// # Errors
    /// As of [`Bench::another`].
    pub fn lacking(bench: &Bench, change: impl FnOnce(&mut Context)) -> Result<IsolatedContext, GpuError> {
        let mut aside = IsolatedContext::new(bench)?;
        let own = Arc::get_mut(&mut aside.context);
        own.map(change).ok_or(GpuError::Broken("a context of one's own is somebody else's too".into()))?;
        Ok(aside)
    }

    /// Adds what validation said as faults.
    pub fn tell(&self, found: &mut Found) {
        let told = told(&self.context, self.context.messages(), self.hears);
        found.faults.extend(told.iter().map(|message| Fault::new(format!("validation: {message}"))));
    }
}

/// Messages of validation that are to be believed; those of hazards between submissions only where one hears them.
pub(super) fn told(context: &Context, mut messages: Vec<String>, hears: bool) -> Vec<String> {
    if !hears || !context.validates_timelines() {
        messages.retain(|m| !(m.contains("SYNC-HAZARD") && m.contains("vkQueueSubmit2")));
    }
    messages
}
