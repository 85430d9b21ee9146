//! A second opinion on the order of what was recorded, with nothing in common with the derivation: every pair of accesses is looked
//! at, and whether the later one comes after the earlier one follows from the barriers and semaphores that lie between, by brute
//! force. It notices a barrier that was left out, which no picture need show.

use super::{Access, Barrier, Resource, Worker, Workers};
use crate::passes::Slot;
use crate::passes::slots::Shape;
use crate::queues::Wait;
use crate::scene::Scene;

/// What was recorded on a queue, in recording order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A barrier, then.
    Barrier(Barrier),
    /// An operation, by what it touches.
    Operation(Vec<Access>),
}

/// One submission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submission {
    pub queue: usize,
    /// Of its queue's timeline, when it is done.
    pub value: u64,
    pub waits: Vec<Wait>,
    pub events: Vec<Event>,
}

/// Everything that was submitted, in the order of submission, and what is recorded but not submitted yet.
#[derive(Clone, Debug, Default)]
pub struct Log {
    pub submissions: Vec<Submission>,
    open: Vec<(usize, Vec<Event>)>,
}

/// Two accesses of one resource that nothing orders, by submission and event in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unordered {
    pub earlier: (usize, usize),
    pub later: (usize, usize),
    pub resource: Resource,
}

impl Log {
    /// A submission of a queue is recorded from here on: what was recorded and not submitted never runs.
    pub fn begin(&mut self, queue: usize) {
        self.open.retain(|(of, _)| *of != queue);
        self.open.push((queue, Vec::new()));
    }

    /// What was recorded on a queue.
    pub fn record(&mut self, queue: usize, barrier: Option<Barrier>, accesses: &[Access]) {
        let Some((_, events)) = self.open.iter_mut().find(|(of, _)| *of == queue) else { return };
        events.extend(barrier.map(Event::Barrier));
        events.push(Event::Operation(accesses.to_vec()));
    }

    pub fn submit(&mut self, queue: usize, waits: &[Wait], value: u64) {
        let Some(at) = self.open.iter().position(|(of, _)| *of == queue) else { return };
        let (_, events) = self.open.swap_remove(at);
        self.submissions.push(Submission { queue, value, waits: waits.to_vec(), events });
    }

    /// Where barriers are: submission and event.
    pub fn barriers(&self) -> Vec<(usize, usize)> {
        let of = |(n, submission): (usize, &Submission)| {
            let events = submission.events.iter().enumerate();
            let barriers = events.filter(|(_, event)| matches!(event, Event::Barrier(_)));
            barriers.map(|(e, _)| (n, e)).collect::<Vec<_>>()
        };
        self.submissions.iter().enumerate().flat_map(of).collect()
    }

    /// Semaphores that are waited for: submission and wait.
    pub fn waits(&self) -> Vec<(usize, usize)> {
        let of = |(n, submission): (usize, &Submission)| (0..submission.waits.len()).map(move |w| (n, w));
        self.submissions.iter().enumerate().flat_map(of).collect()
    }

    /// The same without one barrier.
    pub fn without_barrier(&self, (submission, event): (usize, usize)) -> Log {
        let mut log = self.clone();
        log.submissions[submission].events.remove(event);
        log
    }

    /// The same without one wait.
    pub fn without_wait(&self, (submission, wait): (usize, usize)) -> Log {
        let mut log = self.clone();
        log.submissions[submission].waits.remove(wait);
        log
    }

    /// The first two accesses that conflict and that nothing orders. The scene says which slots are 3D images.
    pub fn unordered(&self, scene: &Scene) -> Option<Unordered> {
        let is_volume = |slot: Slot| matches!(slot.shape(scene), Shape::Three(_));
        (0..self.submissions.len()).find_map(|s| {
            let events = self.submissions[s].events.iter().enumerate();
            let operations = events.filter_map(|(e, event)| match event {
                Event::Operation(accesses) => Some((e, accesses)),
                Event::Barrier(_) => None,
            });
            operations.flat_map(|(e, accesses)| accesses.iter().map(move |a| (e, a))).find_map(|(e, access)| {
                let (later, resource) = self.unordered_after((s, e), access, &is_volume)?;
                Some(Unordered { earlier: (s, e), later, resource })
            })
        })
    }

    /// Walks over all that comes later than one access, and keeps for every queue which workers are ordered behind it there.
    fn unordered_after(
        &self,
        (first, event): (usize, usize),
        access: &Access,
        is_volume: &impl Fn(Slot) -> bool,
    ) -> Option<((usize, usize), Resource)> {
        let queue = self.submissions[first].queue;
        let mut behind = [Workers::default(); crate::queues::MOST];
        // By submission: whether its end comes after the access.
        let mut reached = vec![false; self.submissions.len()];
        for (s, submission) in self.submissions.iter().enumerate().skip(first) {
            let here = submission.queue;
            for wait in &submission.waits {
                // The semaphore's value stands for everything on its queue up to there.
                let signalled = |(n, of): (usize, &Submission)| {
                    of.queue == wait.queue && of.value <= wait.value && n >= first && reached[n]
                };
                if self.submissions[..s].iter().enumerate().any(signalled) {
                    behind[here] = behind[here].with(Workers::DEVICE);
                }
            }
            let from = if s == first { event + 1 } else { 0 };
            for (e, event) in submission.events.iter().enumerate().skip(from) {
                match event {
                    Event::Barrier(Barrier { from, to }) => {
                        let held = here == queue && from.has(access.by);
                        let chained = [Worker::Compute, Worker::Copy, Worker::Host]
                            .iter()
                            .any(|w| from.has(*w) && behind[here].has(*w));
                        if held || chained {
                            behind[here] = behind[here].with(*to);
                        }
                    }
                    Event::Operation(later) => {
                        let conflict =
                            later.iter().find(|l| !behind[here].has(l.by) && must_order(access, l, is_volume));
                        if let Some(conflict) = conflict {
                            return Some(((s, e), conflict.resource));
                        }
                    }
                }
            }
            // A submission's signal comes after everything on its queue.
            reached[s] = here == queue || behind[here] != Workers::default();
        }
        None
    }
}

/// Whether the order of two accesses matters. Parts of an array are ranges of their own; slices of a 3D image are not, but writers
/// of different ones never meet.
fn must_order(a: &Access, b: &Access, is_volume: &impl Fn(Slot) -> bool) -> bool {
    if a.resource != b.resource || !(a.write || b.write) {
        return false;
    }
    let shared = a.parts.clone().any(|part| b.parts.contains(&part));
    let mixed = a.write != b.write && matches!(a.resource, Resource::Slot(slot, _) if is_volume(slot));
    shared || mixed
}

#[cfg(test)]
mod tests;
