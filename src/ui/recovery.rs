//! What is done where a screen or a device is gone: at once again, then twice a second, and not for ever.

use super::console::{Console, ConsoleError};
use crate::gpu::window::{PresentMode, Screen, Target};
use crate::gpu::{Context, ContextOptions, GpuError};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Between two attempts.
const AGAIN: Duration = Duration::from_millis(500);
/// Attempts in a row before it is given up.
const MOST: u32 = 20;
/// What has been shown so often holds.
const HOLDS: u64 = 60;

/// What has to be had anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gone {
    Screen,
    /// And the screen with it.
    Device,
}

/// What there is to do about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// Nothing is gone.
    Nothing,
    /// To try then.
    At(Instant),
    Now(Gone),
}

/// Since when things fail, and when they are tried again.
#[derive(Clone, Debug, Default)]
pub struct Recovery {
    again: Option<(Instant, Gone)>,
    faults: u32,
}

impl Recovery {
    /// Notes that something is gone; false where it is given up.
    pub fn fault(&mut self, gone: Gone, now: Instant) -> bool {
        self.faults += 1;
        let wait = if self.faults == 1 { Duration::ZERO } else { AGAIN };
        self.again = Some((now + wait, gone));
        self.faults <= MOST
    }

    /// What is said to be due now is taken for done: another [`Recovery::fault`] says that it was not.
    pub fn due(&mut self, now: Instant) -> Due {
        match self.again {
            None => Due::Nothing,
            Some((at, _)) if now < at => Due::At(at),
            Some((_, gone)) => {
                self.again = None;
                Due::Now(gone)
            }
        }
    }

    /// `shown`: how often something was shown since the screen was made.
    pub fn shown(&mut self, shown: u64) {
        if shown > HOLDS {
            self.faults = 0;
        }
    }
}

/// What a tick's error says is gone, and why.
pub fn gone(error: ConsoleError) -> (Gone, GpuError) {
    match error {
        ConsoleError::DeviceLost(fault) => (Gone::Device, fault),
        ConsoleError::Screen(fault) => (Gone::Screen, fault),
    }
}

/// What a console is shown on.
pub struct Place<'a> {
    pub device: &'a ContextOptions,
    pub target: Target,
    pub pace: PresentMode,
}

impl Place<'_> {
    /// A screen there once more, on a device opened anew where that was lost. `size`: of the window, pixels, which comes back.
    ///
    /// # Errors
    /// What is gone still, and why.
    pub fn mend(
        &self,
        console: &mut Console,
        context: &mut Arc<Context>,
        size: &dyn Fn(&Context) -> Result<[u32; 2], GpuError>,
        gone: Gone,
    ) -> Result<[u32; 2], (Gone, GpuError)> {
        // A device may be lost while no more than its screen is had again.
        let still = |fault: GpuError| (if fault.is_device_lost() { Gone::Device } else { gone }, fault);
        // The old one goes first: a window has one surface at a time.
        console.set_screen(None);
        if gone == Gone::Device {
            *context = Context::showing(self.device, &self.target).map_err(still)?;
        }
        let size = size(context).map_err(still)?;
        let screen = Screen::new(context, self.target.clone(), size, self.pace).map_err(still)?;
        match gone {
            Gone::Device => {
                console.revive(context, Some(screen)).unwrap_or_else(|e| console.say(&e.to_string(), true));
            }
            Gone::Screen => console.set_screen(Some(screen)),
        }
        Ok(size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_attempt_is_made_at_once_and_the_next_ones_half_a_second_apart() {
        let (mut mending, now) = (Recovery::default(), Instant::now());
        assert_eq!(mending.due(now), Due::Nothing);
        assert!(mending.fault(Gone::Screen, now));
        assert_eq!(mending.due(now), Due::Now(Gone::Screen));
        assert_eq!(mending.due(now), Due::Nothing, "it is done");
        assert!(mending.fault(Gone::Device, now));
        assert_eq!(mending.due(now), Due::At(now + AGAIN));
        assert_eq!(mending.due(now + AGAIN), Due::Now(Gone::Device));
    }

    #[test]
    fn twenty_in_a_row_are_enough_and_what_was_shown_for_a_while_begins_anew() {
        let (mut mending, now) = (Recovery::default(), Instant::now());
        assert!((0..MOST).all(|_| mending.fault(Gone::Device, now)));
        mending.shown(HOLDS);
        assert!(!mending.clone().fault(Gone::Device, now), "a moment is no while");
        mending.shown(HOLDS + 1);
        assert!((0..MOST).all(|_| mending.fault(Gone::Screen, now)));
        assert!(!mending.fault(Gone::Screen, now));
    }
}
