//! Assigns work to queues and derives the semaphore waits between them. Within a queue, barriers order operations
//! ([`crate::barriers`]). Between queues only semaphores do; a submission waits for the submissions that it conflicts with and no
//! others. The logic is the same for one, two and three queues, and is tested without a GPU.

pub mod oracle;

use crate::barriers::{Access, Barrier, BarrierTracker};

/// The largest number of queues: one for copies, one for passes over frames, and one for all other passes.
pub const MAX_QUEUES: usize = 3;

/// What a queue is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QueueRole {
    /// All passes with the frequency volume or picture.
    Render,
    /// All passes with the frequency frame.
    Ingest,
    /// Uploads of frames.
    Copy,
}

impl QueueRole {
    /// Index of the queue for this work, on a device with `queues` queues. Of three queues, 0 renders, 1 converts frames and 2 copies them. With two
    /// queues, copies share queue 1; with one, all work shares queue 0.
    pub fn queue(self, queues: usize) -> usize {
        (self as usize).min(queues.clamp(1, MAX_QUEUES) - 1)
    }
}

/// A vector clock: by queue, the timeline value of the last submission that is known to be complete.
type Clock = [u64; MAX_QUEUES];

/// Tracks the accesses of all queues to the same slots, and derives the semaphore waits between queues.
#[derive(Clone, Debug)]
pub struct QueueTracker {
    each: Vec<Queue>,
}

#[derive(Clone, Debug, Default)]
struct Queue {
    tracker: BarrierTracker,
    /// A submission is being recorded.
    recording: bool,
    /// The accesses of the submission that is being recorded.
    open: Vec<Access>,
    /// The last submitted accesses, with the timeline value at which they are complete, and what that submission had waited for.
    done: Vec<(Access, u64, Clock)>,
    /// What its next submission is ordered after anyway.
    after: Clock,
}

/// A semaphore wait until the timeline of `queue` reaches `value`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wait {
    pub queue: usize,
    pub value: u64,
}

impl Default for QueueTracker {
    /// A single queue.
    fn default() -> QueueTracker {
        QueueTracker::new(1)
    }
}

impl QueueTracker {
    /// `count`: number of queues; it is clamped to 1..=3.
    pub fn new(count: usize) -> QueueTracker {
        QueueTracker { each: vec![Queue::default(); count.clamp(1, MAX_QUEUES)] }
    }

    pub fn count(&self) -> usize {
        self.each.len()
    }

    /// Records an operation on a queue. Returns the barrier that has to precede it; None if it needs none.
    pub fn record(&mut self, queue: usize, accesses: &[Access]) -> Option<Barrier> {
        let alone = self.count() == 1;
        let me = &mut self.each[queue];
        for access in accesses.iter().filter(|_| !alone) {
            if !me.open.contains(access) {
                me.open.push(access.clone());
            }
        }
        me.tracker.record(accesses)
    }

    /// Begins the recording of a submission to this queue. If the last recording was not submitted, the next operation gets a barrier that waits for
    /// everything before it on the queue.
    pub fn begin(&mut self, queue: usize) {
        let me = &mut self.each[queue];
        if std::mem::replace(&mut me.recording, true) {
            me.open.clear();
            me.tracker.invalidate();
        }
    }

    /// The semaphore waits that the submission that is being recorded for this queue needs, without those that other waits imply.
    pub fn waits(&self, queue: usize) -> Vec<Wait> {
        let me = &self.each[queue];
        let mut needed = Vec::new();
        for (other, them) in self.each.iter().enumerate().filter(|(other, _)| *other != queue) {
            let conflicts = them.done.iter().filter(|(earlier, value, _)| {
                *value > me.after[other] && me.open.iter().any(|later| earlier.conflicts(later))
            });
            if let Some((_, value, clock)) = conflicts.max_by_key(|(_, value, _)| *value) {
                needed.push((Wait { queue: other, value: *value }, *clock));
            }
        }
        let implied =
            |wait: &Wait| needed.iter().any(|(other, clock)| other != wait && clock[wait.queue] >= wait.value);
        needed.iter().map(|(wait, _)| *wait).filter(|wait| !implied(wait)).collect()
    }

    /// Notes that the recording of this queue was submitted with these waits. The submission signals `value` on the queue's timeline when it is
    /// complete.
    pub fn submitted(&mut self, queue: usize, waits: &[Wait], value: u64) {
        self.each[queue].recording = false;
        if self.count() == 1 {
            return;
        }
        let mut after = self.each[queue].after;
        for wait in waits {
            let there = self.each[wait.queue].done.iter().find(|(_, value, _)| *value == wait.value);
            let clock = there.map_or([0; MAX_QUEUES], |(_, _, clock)| *clock);
            after = std::array::from_fn(|q| after[q].max(clock[q]));
            after[wait.queue] = after[wait.queue].max(wait.value);
        }
        let me = &mut self.each[queue];
        me.after = after;
        for access in std::mem::take(&mut me.open) {
            me.done.retain(|(earlier, ..)| *earlier != access);
            me.done.push((access, value, after));
        }
        // Accesses that all other queues are ordered after anyway can be forgotten.
        for q in 0..self.count() {
            let others = self.each.iter().enumerate().filter(|(other, _)| *other != q);
            let reached = others.map(|(_, other)| other.after[q]).min().unwrap_or(0);
            self.each[q].done.retain(|(_, value, _)| *value > reached);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::barriers::PipelineStage;
    use crate::passes::{DispatchArgs, Frequency, PASSES, Slot};
    use proptest::prelude::*;

    /// A submission: its queue, its timeline value, its accesses, and its waits.
    type Submission = (usize, u64, Vec<Access>, Vec<Wait>);

    fn submit(
        queues: &mut QueueTracker,
        values: &mut [u64; MAX_QUEUES],
        queue: usize,
        accesses: Vec<Access>,
    ) -> Submission {
        queues.record(queue, &accesses);
        let waits = queues.waits(queue);
        values[queue] += 1;
        queues.submitted(queue, &waits, values[queue]);
        (queue, values[queue], accesses, waits)
    }

    /// An independent check without clocks: follows waits and queue order transitively. Every pair of conflicting submissions on
    /// different queues must be ordered.
    fn unordered(submissions: &[Submission]) -> Option<(usize, usize)> {
        let n = submissions.len();
        let mut after = vec![vec![false; n]; n];
        for j in 0..n {
            for i in 0..j {
                let ((qi, vi, ..), (qj, _, _, waits)) = (&submissions[i], &submissions[j]);
                let waited = waits.iter().any(|w| w.queue == *qi && w.value >= *vi);
                after[j][i] |= qi == qj || waited;
            }
            for i in (0..j).rev().filter(|i| after[j][*i]).collect::<Vec<_>>() {
                (0..i).for_each(|k| {
                    let more = after[i][k];
                    after[j][k] |= more;
                });
            }
        }
        let conflicts = |i: usize, j: usize| {
            let ((qi, _, a, _), (qj, _, b, _)) = (&submissions[i], &submissions[j]);
            qi != qj && a.iter().any(|a| b.iter().any(|b| a.conflicts(b)))
        };
        (0..n).flat_map(|j| (0..j).map(move |i| (i, j))).find(|(i, j)| conflicts(*i, *j) && !after[*j][*i])
    }

    /// Checks that every conflict is ordered, and that every wait is needed.
    fn check(submissions: &[Submission]) -> Result<(), String> {
        if let Some((i, j)) = unordered(submissions) {
            return Err(format!("submission {j} does not wait for {i}"));
        }
        for (j, n) in (0..submissions.len()).flat_map(|j| (0..submissions[j].3.len()).map(move |n| (j, n))) {
            let mut without = submissions.to_vec();
            without[j].3.remove(n);
            if unordered(&without).is_none() {
                return Err(format!("submission {j} waits for {:?} without need", submissions[j].3[n]));
            }
        }
        Ok(())
    }

    fn access() -> impl Strategy<Value = Access> {
        (0usize..4, 0u32..2, 0u32..4, 1u32..3, any::<bool>()).prop_map(|(slot, image, from, count, write)| {
            let slot = [Slot::Frames, Slot::Volume, Slot::SharpVolume, Slot::Picture][slot];
            Access::of_slot(slot, image, from..from + count, write, PipelineStage::Compute)
        })
    }

    proptest! {
        #[test]
        fn every_conflict_between_queues_is_waited_for_and_nothing_else(
            count in 2usize..=3,
            work in prop::collection::vec((0usize..3, prop::collection::vec(access(), 1..4)), 1..30),
        ) {
            let (mut queues, mut values) = (QueueTracker::new(count), [0; MAX_QUEUES]);
            let work = work.into_iter();
            let all: Vec<_> = work.map(|(q, a)| submit(&mut queues, &mut values, q % count, a)).collect();
            prop_assert_eq!(check(&all), Ok(()));
        }
    }

    /// Volumes that are filled while earlier ones are drawn, as the renderer submits them: `whole` with several volume images, and
    /// `rolling` into the one that is shown.
    #[test]
    fn a_live_stream_is_ordered_on_one_two_and_three_queues() {
        use crate::scene::test_block::block;
        let settings = "slices = { median = true, smooth = { elevation = 1.0 } }\nlight = { shadow = {} }";
        let scene = block(&settings.lines().map(str::trim).collect::<Vec<_>>(), [8, 8, 6]);
        let of = |frequency: Frequency, args: DispatchArgs| -> Vec<Access> {
            let passes = PASSES.iter().filter(|p| p.frequency == frequency && p.is_needed(&scene));
            passes.flat_map(|pass| crate::barriers::accesses(&scene, pass, &args)).collect()
        };
        for (count, images) in (1..=3).flat_map(|count| [(count, 1), (count, 2), (count, 3)]) {
            let (mut queues, mut values, mut all) = (QueueTracker::new(count), [0; MAX_QUEUES], Vec::new());
            let mut run = |work: QueueRole, accesses| {
                let submission = submit(&mut queues, &mut values, work.queue(count), accesses);
                all.push(submission);
            };
            for (n, image) in (0..6u32).map(|n| (n, n % images)) {
                // Frames alone and two at once.
                for (batch, (slice, slices)) in [(0, 1), (1, 1), (2, 2), (4, 1), (5, 1)].into_iter().enumerate() {
                    let layer = (n * 5 + batch as u32) % 4 * 6;
                    let args = DispatchArgs { layer, slice, image, slices, ..DispatchArgs::default() };
                    let copied = Access::of_slot(Slot::Frames, 0, layer..layer + slices, true, PipelineStage::Copy);
                    // Without a queue for copies, the copy is part of the frame's submission.
                    match count {
                        3 => {
                            run(QueueRole::Copy, vec![copied]);
                            run(QueueRole::Ingest, of(Frequency::Frame, args));
                        }
                        _ => run(QueueRole::Ingest, [vec![copied], of(Frequency::Frame, args)].concat()),
                    }
                    let rolls = images == 1 && slice % 2 == 1;
                    if rolls || slice == 5 {
                        let args = DispatchArgs { image, slices: scene.slices(), ..DispatchArgs::default() };
                        run(QueueRole::Render, [of(Frequency::Volume, args), of(Frequency::Picture, args)].concat());
                    }
                }
            }
            assert_eq!(check(&all), Ok(()), "{count} queues, {images} images");
            let waits: usize = all.iter().map(|s| s.3.len()).sum();
            assert_eq!(waits == 0, count == 1, "{count} queues, {images} images: {waits} waits");
            // Accesses that every queue has waited for are forgotten.
            assert!(queues.each.iter().all(|q| q.done.len() < 100), "{count} queues");
        }
    }

    /// Filling one volume image must not wait for a picture of the other.
    #[test]
    fn frames_of_one_volume_image_do_not_wait_for_a_picture_of_the_other() {
        let (mut queues, mut values) = (QueueTracker::new(2), [0; MAX_QUEUES]);
        let on = |image, write| vec![Access::of_slot(Slot::Volume, image, 0..1, write, PipelineStage::Compute)];
        submit(&mut queues, &mut values, 1, on(0, true));
        let picture = submit(&mut queues, &mut values, 0, on(0, false));
        assert_eq!(picture.3, [Wait { queue: 1, value: 1 }]);
        assert!(queues.each[1].done.is_empty(), "accesses that all others have waited for are forgotten");
        assert_eq!(submit(&mut queues, &mut values, 1, on(1, true)).3, []);
        assert_eq!(submit(&mut queues, &mut values, 1, on(0, true)).3, [Wait { queue: 0, value: 1 }]);
    }

    #[test]
    fn what_was_not_submitted_is_not_waited_for() {
        let (mut queues, mut values) = (QueueTracker::new(2), [0; MAX_QUEUES]);
        let access = |slot| vec![Access::of_slot(slot, 0, 0..1, true, PipelineStage::Compute)];
        queues.begin(1);
        assert_eq!(queues.record(1, &access(Slot::Volume)), None);
        queues.begin(1);
        assert!(queues.record(1, &access(Slot::SharpVolume)).is_some(), "a dropped recording may have run in part");
        submit(&mut queues, &mut values, 1, access(Slot::SharpVolume));
        assert_eq!(submit(&mut queues, &mut values, 0, access(Slot::Volume)).3, []);
        assert_eq!(submit(&mut queues, &mut values, 0, access(Slot::SharpVolume)).3, [Wait { queue: 1, value: 1 }]);
    }

    #[test]
    fn there_are_one_to_three_queues() {
        assert_eq!([0, 1, 2, 3, 9].map(|count| QueueTracker::new(count).count()), [1, 1, 2, 3, 3]);
        assert_eq!(QueueTracker::default().count(), 1);
    }
}
