//! Counts how often the same work loses a device, until it is given up. The cause may have been a watchdog, so each further try divides the
//! work into parts that take half as long.

use super::{Bands, GpuError};

/// Most losses in a row after which the work is tried again. By then a band has a 64th of its time, and smaller bands have not helped.
const MAX_LOSSES: u32 = 6;

/// Counts consecutive losses of the device by the same work.
#[derive(Clone, Copy, Debug, Default)]
pub struct Losses(u32);

impl Losses {
    /// Counts a loss. False if there were too many, and the work must be given up.
    pub fn allow_another(&mut self) -> bool {
        self.0 += 1;
        self.0 <= MAX_LOSSES
    }

    /// Counts the loss of the device that `error` reports. True if the work may be tried again; the error is then logged. False if the error is no
    /// loss, the device did not finish (as it would not the next time), or it was lost too often.
    pub fn allow_after(&mut self, error: &GpuError) -> bool {
        let allowed = error.is_device_lost() && !error.is_given_up() && self.allow_another();
        if allowed {
            tracing::warn!("{error}; the device is reopened, and its work is divided into smaller parts");
        }
        allowed
    }

    /// True if the device was lost at least once since the work began.
    pub fn any(self) -> bool {
        self.0 > 0
    }

    /// How the next try of the work divides its dispatches: into smaller bands after each loss.
    pub fn bands(self) -> Bands {
        Bands::Measured { losses: self.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ash::vk;

    #[test]
    fn six_losses_are_forgiven_each_with_smaller_bands_and_a_hang_is_not() {
        let of = |result| GpuError::Vulkan { operation: "wait".into(), result };
        let lost = of(vk::Result::ERROR_DEVICE_LOST);
        let mut losses = Losses::default();
        assert!(!losses.any() && losses.bands() == Bands::default());
        assert!(!losses.allow_after(&of(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)));
        assert!(!losses.allow_after(&GpuError::TimedOut { seconds: 5.0, operation: "wait".into() }));
        assert!(!losses.any(), "neither is a loss that smaller parts would avoid");
        for n in 1..=6 {
            assert!(losses.allow_after(&lost) && losses.bands() == Bands::Measured { losses: n }, "loss {n}");
        }
        assert!(!losses.allow_after(&lost));
    }
}
