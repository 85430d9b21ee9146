//! Limits waits for the device. A driver can leave a submission unfinished for ever: a hung GPU, a lost interrupt, a virtual machine that
//! was suspended. So a wait is divided into short ones. Between them the deadline and a request to stop are checked. A device that does not
//! finish in time is *given up*: nothing waits for it again, and the objects of its context are leaked instead of destroyed. Vulkan forbids
//! destroying what a submission still uses, and some drivers block in such a call or free memory that the device still writes.

use super::error::{ErrorContext, GpuError};
use crate::sync::locked;
use ash::vk;
use std::collections::VecDeque;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Longest time without a check of the deadline and of the request to stop. A signal is answered within two of them and [`STOP_GRACE`].
const SLICE: Duration = Duration::from_millis(50);
/// Time that a wait goes on after a request to stop. Most work is done by then, and a command ends as usual.
const STOP_GRACE: Duration = Duration::from_millis(400);
/// The deadline of a GPU. A picture takes milliseconds there, a very large one less than a second.
const GPU_DEADLINE: Duration = Duration::from_secs(5);

/// Longest time that a device may take for a submission before it is given up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Deadline {
    /// 5 s on a GPU; no limit on a software device, which may need minutes for a picture.
    #[default]
    ByDevice,
    Never,
    After(Duration),
}

impl Deadline {
    /// The longest time on this kind of device. None: no limit.
    pub(super) fn on_device(self, is_software: bool) -> Option<Duration> {
        match self {
            Deadline::ByDevice => (!is_software).then_some(GPU_DEADLINE),
            Deadline::Never => None,
            Deadline::After(time) => Some(time),
        }
    }
}

/// A busy device is looked at every few milliseconds. If nothing looked for so long, the program or its machine was stopped, and with it the
/// threads of a software device.
const PAUSE: Duration = Duration::from_secs(1);

/// When the deadline was looked at, and from when it counts.
#[derive(Debug, Default)]
struct Looks {
    last: Option<Instant>,
    /// After a pause: since when the device had been busy, and when the program ran again.
    resumed: Option<(Instant, Instant)>,
}

impl Looks {
    /// True if a device that has been busy since `since` is late. After a pause it gets the full time again, once.
    fn is_late(&mut self, since: Instant, now: Instant, deadline: Duration) -> bool {
        let pause = self.last.replace(now).map_or(Duration::ZERO, |last| now.saturating_duration_since(last));
        let resumed = self.resumed.filter(|(of, _)| *of == since).map(|(_, at)| at);
        if now.saturating_duration_since(resumed.unwrap_or(since)) <= deadline {
            return false;
        }
        let is_forgiven = pause > PAUSE && resumed.is_none();
        if is_forgiven {
            self.resumed = Some((since, now));
        }
        !is_forgiven
    }
}

/// Why a device was given up.
#[derive(Clone, Copy, Debug)]
enum GivenUp {
    /// It did not finish in this time.
    Late(Duration),
    /// A stop was requested while it was busy.
    Stopped,
}

impl GivenUp {
    fn error(self, operation: String) -> GpuError {
        match self {
            GivenUp::Late(time) => GpuError::TimedOut { seconds: time.as_secs_f64(), operation },
            GivenUp::Stopped => GpuError::Stopped { operation },
        }
    }
}

/// Gives up a device that does not finish in time, for all waits of a context.
pub(crate) struct Watchdog {
    deadline: Option<Duration>,
    /// True once the program is to end.
    stop: Option<fn() -> bool>,
    given_up: Mutex<Option<GivenUp>>,
    looks: Mutex<Looks>,
}

impl Watchdog {
    pub fn new(deadline: Option<Duration>, stop: Option<fn() -> bool>) -> Watchdog {
        Watchdog { deadline, stop, given_up: Mutex::default(), looks: Mutex::default() }
    }

    /// True once the device was given up.
    pub(crate) fn has_given_up(&self) -> bool {
        self.given_up().is_some()
    }

    fn given_up(&self) -> Option<GivenUp> {
        *locked(&self.given_up)
    }

    fn give_up(&self, why: GivenUp, operation: impl FnOnce() -> String) -> GpuError {
        let why = *locked(&self.given_up).get_or_insert(why);
        why.error(operation())
    }

    /// Checks that the device was not given up. `operation`: what is about to be done, for the error.
    ///
    /// # Errors
    /// The device was given up before.
    pub fn check(&self, operation: impl FnOnce() -> String) -> Result<(), GpuError> {
        self.given_up().map_or(Ok(()), |why| Err(why.error(operation())))
    }

    /// Gives the device up if it has been busy since `since` for longer than the deadline. If the program or its machine was suspended meanwhile, the
    /// time starts again when it goes on, but only once.
    ///
    /// # Errors
    /// The device is given up.
    pub(crate) fn check_deadline(&self, since: Instant, operation: impl FnOnce() -> String) -> Result<(), GpuError> {
        let mut looks = locked(&self.looks);
        match self.deadline.filter(|deadline| looks.is_late(since, Instant::now(), *deadline)) {
            Some(deadline) => Err(self.give_up(GivenUp::Late(deadline), operation)),
            None => Ok(()),
        }
    }

    /// Waits by calling `attempt` repeatedly. `attempt` gets a time-out in ns, and returns [`vk::Result::TIMEOUT`] if that passes. `since` returns
    /// since when the device has been busy without any progress.
    ///
    /// # Errors
    /// The device is given up, because it is late or a stop was requested, or `attempt` fails.
    pub fn wait(
        &self,
        operation: &dyn Fn() -> String,
        since: impl Fn() -> Instant,
        mut attempt: impl FnMut(u64) -> Result<(), vk::Result>,
    ) -> Result<(), GpuError> {
        let mut stop_seen: Option<Instant> = None;
        loop {
            self.check(operation)?;
            match attempt(SLICE.as_nanos() as u64) {
                Err(vk::Result::TIMEOUT) => self.check_deadline(since(), operation)?,
                other => return other.context(operation),
            }
            if self.stop.is_some_and(|is_requested| is_requested())
                && stop_seen.get_or_insert_with(Instant::now).elapsed() >= STOP_GRACE
            {
                return Err(self.give_up(GivenUp::Stopped, operation));
            }
        }
    }

    /// Fault injection: gives the device up as if it had not finished in time, and returns that error.
    pub(crate) fn inject_lateness(&self, operation: impl FnOnce() -> String) -> GpuError {
        self.give_up(GivenUp::Late(self.deadline.unwrap_or_default()), operation)
    }
}

/// Tracks since when a queue has been busy without progress. Submissions have ascending numbers and finish in that order.
#[derive(Debug, Default)]
pub struct Progress {
    /// The number of each submission that was not seen done, and when it was made.
    pending: VecDeque<(u64, Instant)>,
    /// When a submission was last seen done.
    advanced: Option<Instant>,
}

impl Progress {
    /// Notes that submission `number` was made.
    pub fn submitted(&mut self, number: u64, now: Instant) {
        self.pending.push_back((number, now));
    }

    /// Notes that all submissions up to `number` are done.
    pub fn reached(&mut self, number: u64, now: Instant) {
        let before = self.pending.len();
        self.pending.retain(|(pending, _)| *pending > number);
        if self.pending.len() < before {
            self.advanced = Some(now);
        }
    }

    /// The time when the oldest unfinished work was submitted, or when the last submission finished if that was later: work that was
    /// submitted behind other work gets its full time. None without unfinished work.
    pub fn busy_since(&self) -> Option<Instant> {
        self.pending.front().map(|(_, made)| self.advanced.map_or(*made, |advanced| advanced.max(*made)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deadline_counts_from_a_submission_or_from_the_end_of_the_one_before() {
        let (start, second) = (Instant::now(), Duration::from_secs(1));
        let mut queue = Progress::default();
        assert_eq!(queue.busy_since(), None);
        queue.submitted(1, start);
        queue.submitted(2, start + second);
        assert_eq!(queue.busy_since(), Some(start));
        queue.reached(0, start + 2 * second);
        assert_eq!(queue.busy_since(), Some(start), "nothing was done");
        queue.reached(1, start + 3 * second);
        assert_eq!(queue.busy_since(), Some(start + 3 * second), "the second had to wait for the first");
        queue.submitted(3, start + 4 * second);
        queue.reached(2, start + 5 * second);
        queue.reached(3, start + 6 * second);
        assert_eq!(queue.busy_since(), None);
        queue.submitted(4, start + 9 * second);
        assert_eq!(queue.busy_since(), Some(start + 9 * second), "an idle queue is not late");
    }

    /// Prevents a working software device that is given up, with its memory and its threads, because the program was stopped by a signal.
    #[test]
    fn time_for_which_the_program_was_stopped_does_not_count_once() {
        let (start, second) = (Instant::now(), Duration::from_secs(1));
        let at = |n: u32| start + n * second / 10;
        let is_late = |looks: &mut Looks, n: u32| looks.is_late(start, at(n), 5 * second);
        let mut looks = Looks::default();
        assert!((0..=50).all(|n| !is_late(&mut looks, n)));
        assert!(is_late(&mut looks, 51), "it was looked at all the time");
        let mut looks = Looks::default();
        assert!((0..=10).all(|n| !is_late(&mut looks, n)));
        assert!((700..=750).all(|n| !is_late(&mut looks, n)), "the full time after a pause of a minute");
        assert!(is_late(&mut looks, 751));
        // Looked at every two seconds.
        let mut looks = Looks::default();
        assert_eq!((0..).find(|n| is_late(&mut looks, 20 * n)), Some(6), "a device that hangs is found nevertheless");
    }

    #[test]
    fn a_late_device_is_given_up_for_good_and_a_punctual_one_is_not() {
        let operation = || "draw".to_string();
        let watchdog = Watchdog::new(Some(Duration::from_millis(120)), None);
        let (begun, mut attempts) = (Instant::now(), 0);
        let punctual = watchdog.wait(
            &operation,
            || begun,
            |_| {
                attempts += 1;
                if attempts < 2 { Err(vk::Result::TIMEOUT) } else { Ok(()) }
            },
        );
        assert!(punctual.is_ok() && attempts == 2 && !watchdog.has_given_up());
        let never = |ns| {
            std::thread::sleep(Duration::from_nanos(ns));
            Err(vk::Result::TIMEOUT)
        };
        let late = watchdog.wait(&operation, || begun, never).expect_err("late");
        assert!(matches!(&late, GpuError::TimedOut { seconds, operation } if *seconds == 0.12 && operation == "draw"));
        assert!(late.is_device_lost() && watchdog.has_given_up());
        let again = watchdog.wait(&operation, Instant::now, |_| panic!("nothing waits for it again"));
        assert!(matches!(again, Err(GpuError::TimedOut { .. })));
    }

    #[test]
    fn a_request_to_stop_ends_a_wait_that_has_no_deadline() {
        let watchdog = Watchdog::new(None, Some(|| true));
        let (begun, mut attempts) = (Instant::now(), 0);
        let never = |ns| {
            attempts += 1;
            std::thread::sleep(Duration::from_nanos(ns));
            Err(vk::Result::TIMEOUT)
        };
        let stopped = watchdog.wait(&|| "draw".into(), || begun, never).expect_err("stopped");
        assert!(matches!(stopped, GpuError::Stopped { .. }), "{stopped}");
        assert!(attempts > 1, "work that is nearly done is waited for");
    }

    #[test]
    fn a_gpu_has_a_deadline_and_a_software_device_has_none() {
        assert_eq!(Deadline::default().on_device(false), Some(Duration::from_secs(5)));
        assert_eq!(Deadline::default().on_device(true), None);
        assert_eq!(Deadline::Never.on_device(false), None);
        let given = Duration::from_millis(300);
        assert_eq!(Deadline::After(given).on_device(true), Some(given));
    }
}
