//! Holds submissions back so that a queue is never busy for long with submitted work. Other work, such as drawing the panels of a window,
//! can then be submitted in between. Held submissions keep their order.

use std::collections::VecDeque;
use std::time::Duration;

/// Submissions of one queue, in order, held back until the device has little enough work.
#[derive(Debug)]
pub(super) struct Paced<T> {
    /// The device has less than this to do, expected, ns. A submission that takes longer by itself is alone.
    most: f64,
    held: VecDeque<Submission<T>>,
    /// Submitted and not known to be done.
    running: VecDeque<Submission<()>>,
}

#[derive(Debug)]
struct Submission<T> {
    /// That of the timeline once it is done. It increases.
    value: u64,
    /// Expected time, ns.
    expected: f64,
    work: T,
}

impl<T> Paced<T> {
    /// `most`: expected time of the work that may be submitted at once.
    pub(super) fn new(most: Duration) -> Paced<T> {
        Paced { most: most.as_nanos() as f64, held: VecDeque::new(), running: VecDeque::new() }
    }

    /// Adds a submission at the end. `value`: value of the queue's timeline once it is done; `expected`: its expected time, ns.
    pub(super) fn push(&mut self, value: u64, expected: f64, work: T) {
        self.held.push_back(Submission { value, expected, work });
    }

    /// Removes the last submission, if it is still held.
    pub(super) fn pop_back(&mut self) {
        self.held.pop_back();
    }

    /// Notes that the queue's timeline has this value: the submissions up to it are done.
    pub(super) fn reached(&mut self, value: u64) {
        while self.running.front().is_some_and(|submission| submission.value <= value) {
            self.running.pop_front();
        }
    }

    /// The next submission, if the device has little enough work for it. Call [`Paced::sent`] once it was submitted.
    pub(super) fn due(&self) -> Option<&T> {
        let next = self.held.front()?;
        let busy: f64 = self.running.iter().map(|submission| submission.expected).sum();
        (self.running.is_empty() || busy + next.expected < self.most).then_some(&next.work)
    }

    /// The next submission if its timeline value is at most `value`, however much work the device has.
    pub(super) fn up_to(&self, value: u64) -> Option<&T> {
        self.held.front().filter(|next| next.value <= value).map(|next| &next.work)
    }

    /// Notes that the next submission was submitted.
    pub(super) fn sent(&mut self) {
        if let Some(Submission { value, expected, .. }) = self.held.pop_front() {
            self.running.push_back(Submission { value, expected, work: () });
        }
    }

    /// Number of submissions that are held back.
    pub(super) fn held(&self) -> usize {
        self.held.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The submissions that are due, in order, which then count as submitted.
    fn send(paced: &mut Paced<u64>) -> Vec<u64> {
        let mut sent = Vec::new();
        while let Some(work) = paced.due().copied() {
            paced.sent();
            sent.push(work);
        }
        sent
    }

    #[test]
    fn what_is_submitted_takes_no_longer_than_allowed_and_keeps_its_order() {
        let mut paced = Paced::new(Duration::from_nanos(100));
        for (value, expected) in [(1, 60.0), (2, 30.0), (3, 20.0), (4, 0.0), (5, 500.0), (6, 0.0)] {
            paced.push(value, expected, value);
        }
        assert_eq!((send(&mut paced), paced.held()), (vec![1, 2], 4), "the fourth is short, but waits for the third");
        paced.reached(1);
        assert_eq!(send(&mut paced), [3, 4]);
        paced.reached(3);
        assert!(send(&mut paced).is_empty(), "the fourth runs, and the fifth does not fit beside it");
        paced.reached(4);
        assert_eq!(send(&mut paced), [5], "it never fits, and is alone");
        assert!(send(&mut paced).is_empty());
        paced.reached(5);
        assert_eq!((send(&mut paced), paced.held()), (vec![6], 0));
    }

    #[test]
    fn who_waits_gets_everything_up_to_it_submitted() {
        let mut paced = Paced::new(Duration::from_nanos(100));
        (1..=5).for_each(|value| paced.push(value, 100.0, value));
        let mut sent = Vec::new();
        while let Some(work) = paced.up_to(3).copied() {
            paced.sent();
            sent.push(work);
        }
        assert_eq!((sent, paced.held()), (vec![1, 2, 3], 2));
        paced.pop_back();
        paced.reached(3);
        assert_eq!((send(&mut paced), paced.held()), (vec![4], 0));
    }
}
