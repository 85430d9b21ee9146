//! Recovery from a lost screen or device: the first attempt at once, the next ones twice a second, with a limit.

use super::console::{Console, ConsoleError};
use crate::gpu::window::{PresentMode, Screen, Target};
use crate::gpu::{Context, ContextOptions, GpuError, host_memory};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two attempts.
const RETRY_INTERVAL: Duration = Duration::from_millis(500);
/// Attempts in a row before recovery gives up.
const MAX_ATTEMPTS: u32 = 20;
/// A screen that presented so often counts as recovered.
const STABLE_FRAMES: u64 = 60;

/// What was lost and has to be created again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lost {
    Screen,
    /// The device, and the screen with it.
    Device,
}

/// What has to be done next for recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RecoveryStep {
    /// Nothing is lost.
    Idle,
    /// Wait until this time.
    WaitUntil(Instant),
    /// Create it again now.
    Restore(Lost),
}

/// Counts losses of the screen or the device, and schedules attempts to create them again.
#[derive(Clone, Debug, Default)]
pub(super) struct Recovery {
    next_attempt: Option<(Instant, Lost)>,
    faults: u32,
}

impl Recovery {
    /// Notes that something was lost, and schedules an attempt. Returns false if there were too many in a row.
    pub(super) fn lost(&mut self, lost: Lost, now: Instant) -> bool {
        self.faults += 1;
        let wait = if self.faults == 1 { Duration::ZERO } else { RETRY_INTERVAL };
        self.next_attempt = Some((now + wait, lost));
        self.faults <= MAX_ATTEMPTS
    }

    /// What has to be done now. [`RecoveryStep::Restore`] is returned once; it counts as successful unless [`Recovery::lost`] follows.
    pub(super) fn poll(&mut self, now: Instant) -> RecoveryStep {
        match self.next_attempt {
            None => RecoveryStep::Idle,
            Some((at, _)) if now < at => RecoveryStep::WaitUntil(at),
            Some((_, lost)) => {
                self.next_attempt = None;
                RecoveryStep::Restore(lost)
            }
        }
    }

    /// Sets the number of losses to 0 once the screen has presented often enough. `count`: number of presentations of the present screen.
    pub(super) fn presented(&mut self, count: u64) {
        if count > STABLE_FRAMES {
            self.faults = 0;
        }
    }
}

/// What an error of the console means to be lost, and its cause.
pub(super) fn lost_by(error: ConsoleError) -> (Lost, GpuError) {
    match error {
        ConsoleError::DeviceLost(fault) => (Lost::Device, fault),
        ConsoleError::Screen(fault) => (Lost::Screen, fault),
    }
}

/// On what a console is shown: a window or a monitor.
pub(super) struct Output<'a> {
    pub(super) device: &'a ContextOptions,
    pub(super) target: Target,
    pub(super) present_mode: PresentMode,
}

impl Output<'_> {
    /// Creates the screen again, on a newly opened device if that was lost. `size`: gives the size of the window, pixels, which is also
    /// returned.
    ///
    /// # Errors
    /// What is still lost, and why.
    pub(super) fn restore(
        &self,
        console: &mut Console,
        context: &mut Arc<Context>,
        size: &dyn Fn(&Context) -> Result<[u32; 2], GpuError>,
        lost: Lost,
    ) -> Result<[u32; 2], (Lost, GpuError)> {
        // The device may be lost while only the screen is restored.
        let still = |fault: GpuError| (if fault.is_device_lost() { Lost::Device } else { lost }, fault);
        // Drop the old one first: a window has one surface at a time.
        console.set_screen(None);
        let has_stalled = lost == Lost::Device && context.is_given_up();
        if lost == Lost::Device {
            *context = Context::for_presentation(self.device, &self.target).map_err(still)?;
        }
        let size = size(context).map_err(still)?;
        let screen = Screen::new(context, self.target.clone(), size, self.present_mode).map_err(still)?;
        match lost {
            Lost::Device => {
                console.revive(context, Some(screen)).unwrap_or_else(|e| console.notify(&e.to_string(), true));
                // All of the old device is gone.
                host_memory::give_back();
                if has_stalled {
                    console.show_stall(Instant::now());
                }
            }
            Lost::Screen => console.set_screen(Some(screen)),
        }
        Ok(size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_attempt_is_immediate_and_the_next_ones_are_half_a_second_apart() {
        let (mut recovery, now) = (Recovery::default(), Instant::now());
        assert_eq!(recovery.poll(now), RecoveryStep::Idle);
        assert!(recovery.lost(Lost::Screen, now));
        assert_eq!(recovery.poll(now), RecoveryStep::Restore(Lost::Screen));
        assert_eq!(recovery.poll(now), RecoveryStep::Idle, "it counts as done");
        assert!(recovery.lost(Lost::Device, now));
        assert_eq!(recovery.poll(now), RecoveryStep::WaitUntil(now + RETRY_INTERVAL));
        assert_eq!(recovery.poll(now + RETRY_INTERVAL), RecoveryStep::Restore(Lost::Device));
    }

    #[test]
    fn recovery_gives_up_after_20_attempts_and_a_stable_screen_resets_the_count() {
        let (mut recovery, now) = (Recovery::default(), Instant::now());
        assert!((0..MAX_ATTEMPTS).all(|_| recovery.lost(Lost::Device, now)));
        recovery.presented(STABLE_FRAMES);
        assert!(!recovery.clone().lost(Lost::Device, now), "not stable yet");
        recovery.presented(STABLE_FRAMES + 1);
        assert!((0..MAX_ATTEMPTS).all(|_| recovery.lost(Lost::Screen, now)));
        assert!(!recovery.lost(Lost::Screen, now));
    }
}
