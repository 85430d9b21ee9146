//! The time from presenting a picture to its first pixel on the monitor (VK_KHR_present_wait), measured on a thread of its own, because
//! the call blocks.

use crate::context::Context;
use ash::vk;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Longest single wait, ns: a window that is covered may never show a picture, and the swapchain has to be destroyed some time.
const PATIENCE_NS: u64 = 50_000_000;
/// A picture that is not shown after this time is not measured.
const GIVE_UP: Duration = Duration::from_secs(2);
/// Pictures that wait to be measured. Newer ones are left out.
const MAX_WAITING: u64 = 4;

/// Measures when the pictures of one swapchain are on the monitor. It must be dropped before the swapchain is destroyed.
pub(super) struct PresentWaiter {
    next: u64,
    measured: u64,
    jobs: Option<Sender<(u64, Instant)>>,
    latencies: Receiver<Option<Duration>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl PresentWaiter {
    /// `None` if the device cannot wait for a picture, or no thread can be started: then nothing is measured.
    pub(super) fn new(context: &Arc<Context>, swapchain: vk::SwapchainKHR) -> Option<PresentWaiter> {
        context.presentation.as_ref()?.waits.as_ref()?;
        let context = context.clone();
        PresentWaiter::waiting_by(move |id| {
            let waits = context.presentation.as_ref().and_then(|p| p.waits.as_ref());
            let waits = waits.ok_or(vk::Result::ERROR_EXTENSION_NOT_PRESENT)?;
            // SAFETY: the swapchain is alive: its owner drops this, which joins the thread, before it destroys the swapchain. Other
            // threads may use it meanwhile.
            unsafe { waits.wait_for_present(swapchain, id, PATIENCE_NS) }
        })
    }

    /// `wait` waits for the picture of this number for a limited time.
    fn waiting_by(wait: impl Fn(u64) -> Result<(), vk::Result> + Send + 'static) -> Option<PresentWaiter> {
        let (jobs, presented) = channel::<(u64, Instant)>();
        let (report, latencies) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let is_over = stop.clone();
        let work = move || {
            for (id, at) in presented {
                let shown = loop {
                    match wait(id) {
                        Ok(()) => break Some(at.elapsed()),
                        Err(vk::Result::TIMEOUT) if !is_over.load(Ordering::Relaxed) && at.elapsed() < GIVE_UP => {}
                        Err(_) => break None,
                    }
                };
                if is_over.load(Ordering::Relaxed) || report.send(shown).is_err() {
                    return;
                }
            }
        };
        let thread = std::thread::Builder::new().name("present".into()).spawn(work).ok()?;
        Some(PresentWaiter { next: 0, measured: 0, jobs: Some(jobs), latencies, stop, thread: Some(thread) })
    }

    /// The present id of the next picture to present.
    pub(super) fn number(&mut self) -> u64 {
        self.next += 1;
        self.next
    }

    /// Notes that the picture with this present id was handed to the presentation at this time.
    pub(super) fn presented(&mut self, id: u64, at: Instant) {
        if self.measured < MAX_WAITING
            && let Some(jobs) = &self.jobs
            && jobs.send((id, at)).is_ok()
        {
            self.measured += 1;
        }
    }

    /// The times from presentation to the monitor that were measured since the last call.
    pub(super) fn take(&mut self) -> Vec<Duration> {
        let done: Vec<Option<Duration>> = self.latencies.try_iter().collect();
        self.measured = self.measured.saturating_sub(done.len() as u64);
        done.into_iter().flatten().collect()
    }
}

impl Drop for PresentWaiter {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::sync_channel;

    /// Waits until so many pictures are measured or given up.
    fn settle(waiter: &mut PresentWaiter, left: u64) -> Vec<Duration> {
        let mut all = Vec::new();
        while waiter.measured > left {
            all.extend(waiter.take());
            std::thread::yield_now();
        }
        all
    }

    #[test]
    fn a_picture_is_measured_from_its_presentation_and_a_lost_surface_is_not() {
        let wait = |id: u64| if id == 2 { Err(vk::Result::ERROR_SURFACE_LOST_KHR) } else { Ok(()) };
        let mut waiter = PresentWaiter::waiting_by(wait).expect("a thread");
        let before = Instant::now().checked_sub(Duration::from_millis(700)).expect("later than the start");
        assert_eq!([waiter.number(), waiter.number()], [1, 2]);
        waiter.presented(1, before);
        waiter.presented(2, before);
        let times = settle(&mut waiter, 0);
        assert_eq!(times.len(), 1);
        assert!(times[0] >= Duration::from_millis(700));
    }

    #[test]
    fn a_picture_that_is_never_shown_blocks_neither_the_next_ones_nor_the_end() {
        let (called, calls) = sync_channel(0);
        let mut waiter = PresentWaiter::waiting_by(move |_| {
            let _ = called.send(());
            Err(vk::Result::TIMEOUT)
        })
        .expect("a thread");
        for id in 1..=20 {
            waiter.presented(id, Instant::now());
        }
        assert_eq!(waiter.measured, MAX_WAITING, "the others are left out");
        calls.recv().expect("it waits");
        drop(calls);
        drop(waiter);
    }
}
