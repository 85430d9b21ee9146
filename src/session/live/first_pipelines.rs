//! The pipelines that the first geometry of a stream needs. They are compiled on a thread while the window stays responsive, and again for
//! settings that the user changes meanwhile.

use super::asked::Asked;
use crate::gpu::{GpuError, Preparation, Prepared};

/// Limit of the changes of settings that are followed while pipelines are compiled, before the geometry begins.
const MOST_CHANGES: u32 = 2;

/// The pipelines of the first geometry: being compiled, compiled, or cancelled.
#[derive(Default)]
pub(super) struct FirstPipelines {
    making: Option<Making>,
    /// Held so that they are not forgotten before the geometry begins.
    made: Option<Prepared>,
    /// Cancelled ones that have not ended yet. What they return does not matter.
    cancelled: Vec<Preparation>,
}

struct Making {
    preparation: Preparation,
    /// The settings that it was begun for.
    asked: Asked,
    /// How many were begun before, for settings that have changed since.
    changes: u32,
}

impl FirstPipelines {
    /// Forgets cancelled compilations that have ended.
    pub(crate) fn forget_ended(&mut self) {
        self.cancelled.retain(|preparation| !preparation.is_finished());
    }

    /// Progress of the current compilation: number of compiled pipelines and of all. None if there is none.
    pub fn progress(&self) -> Option<[usize; 2]> {
        self.making.as_ref().map(|making| making.preparation.progress())
    }

    /// True while a thread compiles, false once it has ended, None if no compilation was begun.
    pub fn is_working(&self) -> Option<bool> {
        self.making.as_ref().map(|making| !making.preparation.is_finished())
    }

    /// True if the pipelines of these settings are compiled, or will be when the geometry begins. Otherwise they are being compiled: `begin` starts
    /// that unless a compilation still runs. `begin` returns None if there is nothing to compile in
    /// advance; then the result is true.
    ///
    /// # Errors
    /// The error with which a renderer of the settings would fail, a lost device, or the error of `begin`.
    pub fn advance<E: From<GpuError>>(
        &mut self,
        asked: Asked,
        begin: impl FnOnce(&Asked) -> Result<Option<Preparation>, E>,
    ) -> Result<bool, E> {
        if self.is_working() == Some(true) {
            return Ok(false);
        }
        let mut changes = 0;
        if let Some(done) = self.making.take() {
            let is_current = done.asked == asked || done.changes == MOST_CHANGES;
            match done.preparation.finish() {
                // None after a panic: what is missing is compiled when the geometry begins, and what was compiled before is kept.
                Ok(made) => self.made = made.or(self.made.take()),
                Err(error) if is_current || error.is_device_lost() => return Err(error.into()),
                Err(error) => tracing::debug!("settings that were changed meanwhile: {error}"),
            }
            if is_current {
                return Ok(true);
            }
            changes = done.changes + 1;
        }
        self.making = begin(&asked)?.map(|preparation| Making { preparation, asked, changes });
        Ok(self.making.is_none())
    }

    /// Releases the compiled pipelines, because a geometry has begun and its renderer holds them, or because nothing is to be prepared for the
    /// next one.
    pub fn release(&mut self) {
        self.made = None;
        self.making.take_if(|making| making.preparation.is_finished());
    }

    /// Cancels the compilation without waiting for its end. Returns false if nothing was being compiled.
    pub fn cancel(&mut self) -> bool {
        self.made = None;
        let Some(Making { preparation, .. }) = self.making.take() else { return false };
        preparation.cancel();
        self.cancelled.push(preparation);
        true
    }
}
