//! The one seam at which failures are injected, so that the paths for out of memory, a lost device and a time-out are tested;
//! and slowness, so that what finds it is.

use ash::vk;
use std::sync::Mutex;

/// Where a call into the driver can be made to fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seam {
    Allocate,
    Submit,
    Wait,
    /// An image of a window.
    Acquire,
}

/// At most one planned failure, and one slow pass.
#[derive(Default)]
pub struct Faults {
    planned: Mutex<Option<(Seam, u32, vk::Result)>>,
    slow: Mutex<Option<(&'static str, u32)>>,
}

impl Faults {
    /// The `after`-th call from now (0: the next) at this seam returns `result` instead of reaching the driver.
    pub fn inject(&self, seam: Seam, after: u32, result: vk::Result) {
        *self.planned.lock().unwrap_or_else(|e| e.into_inner()) = Some((seam, after, result));
    }

    pub(super) fn pass(&self, seam: Seam) -> Result<(), vk::Result> {
        let mut planned = self.planned.lock().unwrap_or_else(|e| e.into_inner());
        match planned.as_mut() {
            Some((at, 0, result)) if *at == seam => {
                let result = *result;
                *planned = None;
                Err(result)
            }
            Some((at, left, _)) if *at == seam => {
                *left -= 1;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// From now on the pass is dispatched so many times instead of once. It writes the same each time: only time passes.
    pub fn slow_down(&self, pass: &'static str, times: u32) {
        *self.slow.lock().unwrap_or_else(|e| e.into_inner()) = Some((pass, times));
    }

    pub(super) fn times(&self, pass: &str) -> u32 {
        match *self.slow.lock().unwrap_or_else(|e| e.into_inner()) {
            Some((slow, times)) if slow == pass => times,
            _ => 1,
        }
    }
}
