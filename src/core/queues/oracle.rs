//! An independent check of the order of recorded work (a test oracle). It shares no code with the derivation of barriers and waits:
//! for every pair of conflicting accesses it decides by brute force whether the barriers and semaphores between them order them. It
//! finds a missing barrier even if no picture shows it.

use super::{MAX_QUEUES, Wait};
use crate::barriers::{Access, Barrier, PipelineStage, PipelineStages, Resource};
use crate::passes::Slot;
use crate::passes::slots::Shape;
use crate::scene::Scene;
use std::collections::BTreeMap;

/// An entry in the recording of a submission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    Barrier(Barrier),
    /// An operation, described by its memory accesses.
    Operation(Vec<Access>),
    /// A time stamp.
    Stamp,
    /// An execution barrier around a time stamp. It makes no memory visible, so the oracle derives no order from it.
    Serialize,
}

/// One submission to a queue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submission {
    pub queue: usize,
    /// The value that the timeline of the queue has when the submission is complete.
    pub value: u64,
    pub waits: Vec<Wait>,
    pub events: Vec<Event>,
}

/// All submissions in the order in which they were submitted. It also holds the recordings that are not submitted yet.
#[derive(Clone, Debug, Default)]
pub struct SubmissionLog {
    pub submissions: Vec<Submission>,
    /// By queue.
    open: BTreeMap<usize, Vec<Event>>,
}

/// Two conflicting accesses to a resource without an order between them. Each is given by its index in [`SubmissionLog::submissions`] and that of its
/// event there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hazard {
    pub earlier: (usize, usize),
    pub later: (usize, usize),
    pub resource: Resource,
}

impl SubmissionLog {
    /// Begins the recording of a submission. A recording of the same queue that was not submitted is dropped.
    pub fn begin(&mut self, queue: usize) {
        self.open.insert(queue, Vec::new());
    }

    /// Records an operation on a queue, after its barrier if it has one. Nothing happens if no recording of the queue has begun.
    pub fn record(&mut self, queue: usize, barrier: Option<Barrier>, accesses: &[Access]) {
        let Some(events) = self.open.get_mut(&queue) else { return };
        events.extend(barrier.map(Event::Barrier));
        events.push(Event::Operation(accesses.to_vec()));
    }

    /// Records an event of a queue that touches no memory.
    pub fn event(&mut self, queue: usize, event: Event) {
        if let Some(events) = self.open.get_mut(&queue) {
            events.push(event);
        }
    }

    /// Submits the recording of a queue, which waits for `waits` and signals `value`.
    pub fn submit(&mut self, queue: usize, waits: &[Wait], value: u64) {
        let Some(events) = self.open.remove(&queue) else { return };
        self.submissions.push(Submission { queue, value, waits: waits.to_vec(), events });
    }

    /// The positions of all barriers: index of the submission and of the event in it.
    pub fn barriers(&self) -> Vec<(usize, usize)> {
        let of = |(n, submission): (usize, &Submission)| {
            let events = submission.events.iter().enumerate();
            let barriers = events.filter(|(_, event)| matches!(event, Event::Barrier(_)));
            barriers.map(|(e, _)| (n, e)).collect::<Vec<_>>()
        };
        self.submissions.iter().enumerate().flat_map(of).collect()
    }

    /// The positions of all semaphore waits: index of the submission and of the wait in it.
    pub fn waits(&self) -> Vec<(usize, usize)> {
        let of = |(n, submission): (usize, &Submission)| (0..submission.waits.len()).map(move |w| (n, w));
        self.submissions.iter().enumerate().flat_map(of).collect()
    }

    /// A copy of the log without one barrier.
    pub fn without_barrier(&self, (submission, event): (usize, usize)) -> SubmissionLog {
        let mut log = self.clone();
        log.submissions[submission].events.remove(event);
        log
    }

    /// A copy of the log without one wait.
    pub fn without_wait(&self, (submission, wait): (usize, usize)) -> SubmissionLog {
        let mut log = self.clone();
        log.submissions[submission].waits.remove(wait);
        log
    }

    /// Finds the first two conflicting accesses without an order between them; None if all are ordered. The scene tells which slots are 3D images.
    pub fn find_hazard(&self, scene: &Scene) -> Option<Hazard> {
        let is_volume = |slot: Slot| matches!(slot.shape(scene), Shape::Three(_));
        (0..self.submissions.len()).find_map(|s| {
            let events = self.submissions[s].events.iter().enumerate();
            let operations = events.filter_map(|(e, event)| match event {
                Event::Operation(accesses) => Some((e, accesses)),
                Event::Barrier(_) | Event::Stamp | Event::Serialize => None,
            });
            operations.flat_map(|(e, accesses)| accesses.iter().map(move |a| (e, a))).find_map(|(e, access)| {
                let (later, resource) = self.first_conflict_after((s, e), access, &is_volume)?;
                Some(Hazard { earlier: (s, e), later, resource })
            })
        })
    }

    /// Walks over everything that was submitted after one access, and tracks by queue which stages are ordered after it.
    fn first_conflict_after(
        &self,
        (first, event): (usize, usize),
        access: &Access,
        is_volume: &impl Fn(Slot) -> bool,
    ) -> Option<((usize, usize), Resource)> {
        let queue = self.submissions[first].queue;
        let mut ordered = [PipelineStages::default(); MAX_QUEUES];
        // By submission: its end is ordered after the access.
        let mut reached = vec![false; self.submissions.len()];
        for (s, submission) in self.submissions.iter().enumerate().skip(first) {
            let here = submission.queue;
            for wait in &submission.waits {
                // The value of a semaphore covers everything on its queue up to there.
                let signalled = |(n, of): (usize, &Submission)| {
                    of.queue == wait.queue && of.value <= wait.value && n >= first && reached[n]
                };
                if self.submissions[..s].iter().enumerate().any(signalled) {
                    ordered[here] = ordered[here].with(PipelineStages::DEVICE);
                }
            }
            let from = if s == first { event + 1 } else { 0 };
            for (e, event) in submission.events.iter().enumerate().skip(from) {
                match event {
                    Event::Barrier(Barrier { from, to }) => {
                        let held = here == queue && from.has(access.stage);
                        let chained = [PipelineStage::Compute, PipelineStage::Copy, PipelineStage::Host]
                            .iter()
                            .any(|w| from.has(*w) && ordered[here].has(*w));
                        if held || chained {
                            ordered[here] = ordered[here].with(*to);
                        }
                    }
                    Event::Stamp | Event::Serialize => {}
                    Event::Operation(later) => {
                        let conflict =
                            later.iter().find(|l| !ordered[here].has(l.stage) && must_order(access, l, is_volume));
                        if let Some(conflict) = conflict {
                            return Some(((s, e), conflict.resource));
                        }
                    }
                }
            }
            // The signal of a submission is ordered after everything on its queue.
            reached[s] = here == queue || ordered[here] != PipelineStages::default();
        }
        None
    }
}

/// True if the order of two accesses matters. Layers of an array are separate; slices of a 3D image are not, except that writers of
/// different slices never conflict.
fn must_order(a: &Access, b: &Access, is_volume: &impl Fn(Slot) -> bool) -> bool {
    if a.resource != b.resource || !(a.write || b.write) {
        return false;
    }
    let shared = a.parts.clone().any(|part| b.parts.contains(&part));
    let mixed = a.write != b.write && matches!(a.resource, Resource::Slot(slot, _) if is_volume(slot));
    shared || mixed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::test_block::block;

    fn touch(slot: Slot, part: u32, write: bool) -> Event {
        Event::Operation(vec![Access::of_slot(slot, 0, part..part + 1, write, PipelineStage::Compute)])
    }

    fn barrier(from: PipelineStage, to: PipelineStage) -> Event {
        Event::Barrier(Barrier { from: from.into(), to: to.into() })
    }

    fn submitted(queue: usize, value: u64, waits: &[Wait], events: Vec<Event>) -> Submission {
        Submission { queue, value, waits: waits.to_vec(), events }
    }

    fn finds(submissions: Vec<Submission>) -> Option<Hazard> {
        SubmissionLog { submissions, ..SubmissionLog::default() }.find_hazard(&block(&["mode=sr"], [8, 8, 6]))
    }

    #[test]
    fn a_write_and_a_read_need_a_barrier_between_their_stages() {
        let [write, read] = [touch(Slot::Picture, 0, true), touch(Slot::Picture, 0, false)];
        let one = |events: Vec<Event>| finds(vec![submitted(0, 1, &[], events)]);
        let found = one(vec![write.clone(), read.clone()]).expect("unordered");
        assert_eq!((found.earlier, found.later), ((0, 0), (0, 1)));
        assert_eq!(
            one(vec![write.clone(), barrier(PipelineStage::Compute, PipelineStage::Compute), read.clone()]),
            None
        );
        assert!(one(vec![write.clone(), barrier(PipelineStage::Compute, PipelineStage::Copy), read.clone()]).is_some());
        assert!(
            one(vec![barrier(PipelineStage::Compute, PipelineStage::Compute), write.clone(), read.clone()]).is_some()
        );
        // Two barriers form a chain if the second begins with the stage that the first ends with.
        let [there, back] = [
            barrier(PipelineStage::Compute, PipelineStage::Copy),
            barrier(PipelineStage::Copy, PipelineStage::Compute),
        ];
        assert_eq!(one(vec![write.clone(), there.clone(), back.clone(), read.clone()]), None);
        assert!(one(vec![write, back, there, read]).is_some());
    }

    #[test]
    fn layers_of_an_array_are_independent_and_slices_of_a_volume_are_not() {
        let one = |a: Event, b: Event| finds(vec![submitted(0, 1, &[], vec![a, b])]).is_some();
        assert!(!one(touch(Slot::Frames, 0, true), touch(Slot::Frames, 1, false)));
        assert!(one(touch(Slot::Frames, 1, true), touch(Slot::Frames, 1, false)));
        assert!(one(touch(Slot::Volume, 0, true), touch(Slot::Volume, 1, false)));
        assert!(!one(touch(Slot::Volume, 0, true), touch(Slot::Volume, 1, true)));
        assert!(!one(touch(Slot::Volume, 0, false), touch(Slot::Volume, 0, false)));
    }

    #[test]
    fn between_queues_only_waits_order_and_they_are_transitive() {
        let write = || vec![touch(Slot::Volume, 0, true)];
        let read = || vec![touch(Slot::Volume, 0, false)];
        let wait = |queue, value| Wait { queue, value };
        assert!(finds(vec![submitted(1, 1, &[], write()), submitted(0, 1, &[], read())]).is_some());
        assert_eq!(finds(vec![submitted(1, 1, &[], write()), submitted(0, 1, &[wait(1, 1)], read())]), None);
        // A wait for an earlier submission does not help.
        let late =
            vec![submitted(1, 1, &[], vec![]), submitted(1, 2, &[], write()), submitted(0, 1, &[wait(1, 1)], read())];
        assert!(finds(late).is_some());
        // From queue to queue to queue.
        let chain = vec![
            submitted(2, 1, &[], write()),
            submitted(1, 1, &[wait(2, 1)], vec![]),
            submitted(0, 1, &[wait(1, 1)], read()),
        ];
        let log = SubmissionLog { submissions: chain, ..SubmissionLog::default() };
        assert_eq!(log.find_hazard(&block(&["mode=sr"], [8, 8, 6])), None);
        assert_eq!(log.waits(), [(1, 0), (2, 0)]);
        assert!(
            log.waits().into_iter().all(|w| log.without_wait(w).find_hazard(&block(&["mode=sr"], [8, 8, 6])).is_some())
        );
    }

    #[test]
    fn recordings_that_were_not_submitted_are_ignored() {
        let mut log = SubmissionLog::default();
        let access = [Access::of_slot(Slot::Picture, 0, 0..1, true, PipelineStage::Compute)];
        log.begin(0);
        log.record(0, None, &access);
        log.begin(0);
        log.record(0, None, &access);
        log.submit(0, &[], 1);
        assert_eq!(log.submissions.len(), 1);
        assert_eq!(log.find_hazard(&block(&["mode=sr"], [8, 8, 6])), None);
    }
}
