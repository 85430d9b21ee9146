//! Lasting faults: an invalid configuration, shaders that do not compile, a device that fails or hung.

use super::options::StartupFault;
use crate::gpu::Wake;
use crate::gpu::shader_reload::{ShaderFolder, Watch};
use crate::panels::Banner;
use crate::texts;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the banner of a device that did not finish is shown.
const STALL_TIME: Duration = Duration::from_secs(10);
/// Interval of the checks whether a startup fault is resolved.
const FAULT_CHECK_INTERVAL: Duration = Duration::from_secs(2);
/// The device is opened again after so many faults without a picture in between.
const MAX_DEVICE_FAULTS: u32 = 5;
/// Lines of a shader compiler's message that are shown.
const MAX_SHADER_LINES: usize = 12;

/// The faults that persist: of the start, the device and the shaders.
#[derive(Default)]
pub(super) struct Faults {
    /// The fault of the start, and when to check it next.
    startup: Option<(StartupFault, Instant)>,
    /// Number of faults of the device since the last picture.
    of_device: u32,
    /// End of the banner that the device hung and was opened again.
    stall_shown_until: Option<Instant>,
    shaders: Option<Arc<ShaderFolder>>,
    /// Why the picture is not drawn with the present shaders of their folder.
    pub(super) of_shaders: Option<String>,
    /// Watches the folder of shaders and reloads them.
    _watch: Option<Watch>,
}

impl Faults {
    pub(super) fn new(startup: Option<StartupFault>, now: Instant) -> Faults {
        Faults { startup: startup.map(|fault| (fault, now + FAULT_CHECK_INTERVAL)), ..Faults::default() }
    }

    /// Starts to watch a folder of shaders.
    ///
    /// # Errors
    /// One line: it cannot be watched.
    pub(super) fn watch(&mut self, shaders: &Arc<ShaderFolder>, wake: Wake) -> Result<(), String> {
        self.shaders = Some(shaders.clone());
        self._watch = Some(Watch::new(shaders, wake)?);
        Ok(())
    }

    /// True if a fault of the start, such as a wrong configuration, prevents the view. Then no source is opened.
    pub(super) fn prevents_view(&self) -> bool {
        self.startup.is_some()
    }

    /// Checks, if that is due, whether the fault of the start is resolved. Returns true if it is.
    pub(super) fn is_resolved(&mut self, now: Instant) -> bool {
        let Some((fault, at)) = self.startup.as_mut().filter(|(_, at)| now >= *at) else { return false };
        *at = now + FAULT_CHECK_INTERVAL;
        (fault.is_resolved)()
    }

    /// Notes that the device finished a picture.
    pub(super) fn picture_finished(&mut self) {
        self.of_device = 0;
    }

    /// Notes that the device failed. Returns true if it failed so often without a picture that it counts as lost.
    pub(super) fn device_failed(&mut self) -> bool {
        let is_lost = self.of_device >= MAX_DEVICE_FAULTS;
        self.of_device = if is_lost { 0 } else { self.of_device + 1 };
        is_lost
    }

    /// Shows the banner that says that the device hung and was opened again, for a while from `now`.
    pub(super) fn show_stall(&mut self, now: Instant) {
        self.stall_shown_until = Some(now + STALL_TIME);
    }

    /// True once, when the banner of [`Faults::show_stall`] has to disappear.
    pub(super) fn stall_ends(&mut self, now: Instant) -> bool {
        self.stall_shown_until.take_if(|until| *until <= now).is_some()
    }

    /// Checks the watched folder of shaders. Returns true if its fault changed.
    pub(super) fn poll_shaders(&mut self) -> bool {
        let fault = self.shaders.as_ref().and_then(|folder| folder.fault());
        let is_other = fault != self.of_shaders;
        self.of_shaders = fault;
        is_other
    }

    /// Times at which the faults have to be checked again.
    pub(super) fn due(&self) -> impl Iterator<Item = Instant> {
        self.startup.as_ref().map(|(_, at)| *at).into_iter().chain(self.stall_shown_until)
    }

    /// The banner for the most important fault; None if there is none.
    pub(super) fn banner(&self) -> Option<Banner> {
        let banner = |title: &str, text: &str| Some(Banner { title: title.into(), text: text.into(), is_fault: true });
        if let Some((fault, _)) = &self.startup {
            return banner(&fault.title, &fault.why);
        }
        if let Some(fault) = &self.of_shaders {
            let lines: Vec<&str> = fault.lines().take(MAX_SHADER_LINES).collect();
            return banner(texts::SHADER_ERROR, &lines.join("\n"));
        }
        self.stall_shown_until.and_then(|_| banner(texts::DEVICE_STALLED, texts::DEVICE_STALLED_ABOUT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Prevents a configuration that is read at every update, and one that is never read again.
    #[test]
    fn a_startup_fault_is_checked_every_two_seconds_and_shown_first() {
        let begin = Instant::now();
        let at = |seconds: u64| begin + Duration::from_secs(seconds);
        let checks = Arc::new(AtomicUsize::new(0));
        let counted = checks.clone();
        let is_resolved = Box::new(move || counted.fetch_add(1, Ordering::Relaxed) == 1);
        let fault = StartupFault { title: "Wrong".into(), why: "a reason".into(), is_resolved };
        let mut faults = Faults::new(Some(fault), begin);
        faults.show_stall(begin);
        assert!(faults.prevents_view());
        assert_eq!(faults.banner().map(|banner| banner.title).as_deref(), Some("Wrong"));
        assert_eq!(faults.due().collect::<Vec<_>>(), [at(2), at(10)]);
        assert!(!faults.is_resolved(at(1)) && !faults.is_resolved(at(2)) && !faults.is_resolved(at(3)));
        assert!(faults.is_resolved(at(4)));
        assert_eq!(checks.load(Ordering::Relaxed), 2);
    }

    #[test]
    fn a_device_that_fails_six_times_without_a_picture_is_lost_and_a_stall_is_shown_for_ten_seconds() {
        let begin = Instant::now();
        let mut faults = Faults::new(None, begin);
        assert!((0..5).all(|_| !faults.device_failed()));
        faults.picture_finished();
        assert!((0..5).all(|_| !faults.device_failed()) && faults.device_failed());
        assert!(!faults.device_failed(), "counted anew on the next device");
        assert!(faults.banner().is_none());
        faults.show_stall(begin);
        assert!(faults.banner().is_some_and(|banner| banner.is_fault));
        let [before, end] = [9_999, 10_000].map(|ms| begin + Duration::from_millis(ms));
        assert!(!faults.stall_ends(before) && faults.stall_ends(end) && !faults.stall_ends(end));
        assert!(faults.banner().is_none());
    }
}
