//! Which queue does what, and what a submission waits for of other queues. Within a queue barriers order operations
//! ([`crate::barriers`]); between queues only semaphores do, and a submission waits for as much as it conflicts with and no more.
//! Pure: the same for one, two and three queues, and tested without a GPU.

pub mod oracle;

use crate::barriers::{Access, Barrier, BarrierTracker};

/// Most queues that are of use: copies, stage 1, and everything after it.
pub const MAX_QUEUES: usize = 3;

/// What is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QueueRole {
    /// What follows from volumes and pictures.
    Render,
    /// Stage 1 of a frame.
    Ingest,
    /// Samples on their way in.
    Copy,
}

impl QueueRole {
    /// The queue that does it where there are so many: number 0 renders, 1 takes frames in, 2 copies them.
    pub fn queue(self, queues: usize) -> usize {
        (self as usize).min(queues.clamp(1, MAX_QUEUES) - 1)
    }
}

/// By queue, the last submission that is known to be done: the values of their timelines.
type Clock = [u64; MAX_QUEUES];

/// Everything that queues do to the same slots.
#[derive(Clone, Debug)]
pub struct QueueTracker {
    each: Vec<Queue>,
}

#[derive(Clone, Debug, Default)]
struct Queue {
    tracker: BarrierTracker,
    /// A submission is being recorded.
    recording: bool,
    /// What the submission that is being recorded touches.
    open: Vec<Access>,
    /// What its submissions touched last, with the value at which it is done, and what that submission had waited for.
    done: Vec<(Access, u64, Clock)>,
    /// What its next submission comes after in any case.
    after: Clock,
}

/// A wait for another queue's timeline to reach a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wait {
    pub queue: usize,
    pub value: u64,
}

impl Default for QueueTracker {
    /// One for everything.
    fn default() -> QueueTracker {
        QueueTracker::new(1)
    }
}

impl QueueTracker {
    /// `count`: 1..=3.
    pub fn new(count: usize) -> QueueTracker {
        QueueTracker { each: vec![Queue::default(); count.clamp(1, MAX_QUEUES)] }
    }

    pub fn count(&self) -> usize {
        self.each.len()
    }

    /// The barrier that an operation of this queue needs in front of it, if any; the operation is then taken as recorded.
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

    /// A submission of this queue is recorded from here on. If the one before was not submitted, the next operation waits for everything
    /// before it.
    pub fn begin(&mut self, queue: usize) {
        let me = &mut self.each[queue];
        if std::mem::replace(&mut me.recording, true) {
            me.open.clear();
            me.tracker.invalidate();
        }
    }

    /// What the submission that is being recorded on this queue has to wait for, and nothing that another of these waits implies.
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

    /// The submission that was recorded on this queue is on its way, behind these waits, and done at this value of its timeline.
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
            me.done.retain(|(known, ..)| *known != access);
            me.done.push((access, value, after));
        }
        // What all others come after in any case needs no remembering.
        for q in 0..self.count() {
            let others = self.each.iter().enumerate().filter(|(other, _)| *other != q);
            let seen = others.map(|(_, other)| other.after[q]).min().unwrap_or(0);
            self.each[q].done.retain(|(_, value, _)| *value > seen);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::barriers::PipelineStage;
    use crate::passes::{DispatchArgs, Frequency, PASSES, Slot};
    use crate::scene::Scene;
    use proptest::prelude::*;

    /// What was submitted: by which queue, at which value of its timeline, what it touches, and what it waited for.
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

    /// A second opinion, with nothing in common with the clocks: what comes after what, by reaching it from wait to wait and along
    /// each queue; then every pair of different queues that conflicts must be reached.
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

    /// Every conflict is ordered; and without any one of the waits one is not.
    fn hold(submissions: &[Submission]) -> Result<(), String> {
        if let Some((i, j)) = unordered(submissions) {
            return Err(format!("submission {j} does not wait for {i}"));
        }
        for (j, n) in (0..submissions.len()).flat_map(|j| (0..submissions[j].3.len()).map(move |n| (j, n))) {
            let mut without = submissions.to_vec();
            without[j].3.remove(n);
            if unordered(&without).is_none() {
                return Err(format!("submission {j} waits for {:?} and need not", submissions[j].3[n]));
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
            prop_assert_eq!(hold(&all), Ok(()));
        }
    }

    /// Volumes that are filled while those before them are drawn, as the renderer submits them: `whole` with turns, and `rolling`
    /// into the one that is shown.
    #[test]
    fn a_live_stream_is_ordered_on_one_two_and_three_queues() {
        use crate::probe::{Geometry, Grid};
        let settings = "slices = { median = true, smooth = { elevation = 1.0 } }\nlight = { shadow = {} }";
        let grid = Grid { size: [8, 8, 6], spacing: [1.0; 3], origin: [0.0; 3] };
        let input = crate::scene::Input { stored: crate::source::StoredType::U8, range: [0.0, 255.0] };
        let scene = Scene::new(Geometry::Cartesian(grid), input, toml::from_str(settings).unwrap()).unwrap();
        let of = |frequency: Frequency, args: DispatchArgs| -> Vec<Access> {
            let passes = PASSES.iter().filter(|p| p.frequency == frequency && p.is_needed(&scene));
            passes.flat_map(|pass| crate::barriers::accesses(&scene, pass, &args)).collect()
        };
        for (count, images) in (1..=3).flat_map(|count| [(count, 1), (count, 2), (count, 3)]) {
            let (mut queues, mut values, mut all) = (QueueTracker::new(count), [0; MAX_QUEUES], Vec::new());
            let mut do_it = |work: QueueRole, accesses| {
                let submission = submit(&mut queues, &mut values, work.queue(count), accesses);
                // More than one queue's work is never waited for but for a reason.
                all.push(submission);
            };
            for (n, image) in (0..6u32).map(|n| (n, n % images)) {
                for slice in 0..6 {
                    let args =
                        DispatchArgs { layer: (n * 6 + slice) % 4, slice, image, slices: 1, ..DispatchArgs::default() };
                    let layer = args.layer..args.layer + 1;
                    let copied = Access::of_slot(Slot::Frames, 0, layer, true, PipelineStage::Copy);
                    // Without a queue of its own the copy goes with the frame.
                    match count {
                        3 => {
                            do_it(QueueRole::Copy, vec![copied]);
                            do_it(QueueRole::Ingest, of(Frequency::Frame, args));
                        }
                        _ => do_it(QueueRole::Ingest, [vec![copied], of(Frequency::Frame, args)].concat()),
                    }
                    let rolls = images == 1 && slice % 2 == 1;
                    if rolls || slice == 5 {
                        let args = DispatchArgs { image, slices: scene.slices(), ..DispatchArgs::default() };
                        do_it(QueueRole::Render, [of(Frequency::Volume, args), of(Frequency::Picture, args)].concat());
                    }
                }
            }
            assert_eq!(hold(&all), Ok(()), "{count} queues, {images} images");
            let waits: usize = all.iter().map(|s| s.3.len()).sum();
            assert_eq!(waits == 0, count == 1, "{count} queues, {images} images: {waits} waits");
            // The ledger forgets what everyone has waited for.
            assert!(queues.each.iter().all(|q| q.done.len() < 100), "{count} queues");
        }
    }

    /// Prevents that a volume that is filled waits for the picture of another.
    #[test]
    fn frames_of_one_volume_image_do_not_wait_for_a_picture_of_the_other() {
        let (mut queues, mut values) = (QueueTracker::new(2), [0; MAX_QUEUES]);
        let on = |image, write| vec![Access::of_slot(Slot::Volume, image, 0..1, write, PipelineStage::Compute)];
        submit(&mut queues, &mut values, 1, on(0, true));
        let picture = submit(&mut queues, &mut values, 0, on(0, false));
        assert_eq!(picture.3, [Wait { queue: 1, value: 1 }]);
        assert!(queues.each[1].done.is_empty(), "what all others have waited for is forgotten");
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
        assert!(queues.record(1, &access(Slot::SharpVolume)).is_some(), "what was given up may have run in part");
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
