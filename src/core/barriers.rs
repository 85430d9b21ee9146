//! Derives pipeline barriers from the memory accesses of each operation. There is one rule: if an operation conflicts with an earlier
//! one and no barrier separates them, a global memory barrier is placed before it. A tracker lives as long as its slots, so the
//! accesses of one picture also count for the next.

use crate::passes::slots::Shape;
use crate::passes::{DispatchArgs, Part, Pass, Slot};
use crate::scene::Scene;
use std::ops::Range;

/// A GPU resource whose accesses are ordered by barriers. `Slot(slot, image)` is one image of a slot. `image` is 0 unless the slot has one for each
/// volume image ([`Slot::is_multibuffered`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Resource {
    Slot(Slot, u32),
    /// The buffer into which the device copies results for the host.
    Readback,
}

/// The Vulkan pipeline stage, or the host, that makes an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PipelineStage {
    Compute,
    Copy,
    Host,
}

/// A set of [`PipelineStage`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PipelineStages(u8);

impl PipelineStages {
    /// All stages on the device, without the host. Only the barrier before an access by the host includes the host, because making memory visible to
    /// it can cost a cache flush.
    pub const DEVICE: PipelineStages = PipelineStages(0b011);

    pub fn has(self, worker: PipelineStage) -> bool {
        self.0 & PipelineStages::from(worker).0 != 0
    }

    pub fn without(self, worker: PipelineStage) -> PipelineStages {
        PipelineStages(self.0 & !PipelineStages::from(worker).0)
    }

    pub fn with(self, other: PipelineStages) -> PipelineStages {
        PipelineStages(self.0 | other.0)
    }
}

impl From<PipelineStage> for PipelineStages {
    fn from(worker: PipelineStage) -> PipelineStages {
        PipelineStages(1 << worker as u8)
    }
}

/// One memory access of an operation (a dispatch, copy or clear). `parts` are slices of a 3D image or layers of an array, from 0; any other resource
/// has the single part 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Access {
    pub resource: Resource,
    pub parts: Range<u32>,
    pub write: bool,
    pub stage: PipelineStage,
}

/// A global memory barrier: all earlier accesses of the stages `from` are complete and visible to all later ones of the stages `to`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Barrier {
    pub from: PipelineStages,
    pub to: PipelineStages,
}

impl Access {
    pub fn of_slot(slot: Slot, image: u32, parts: Range<u32>, write: bool, stage: PipelineStage) -> Access {
        Access { resource: Resource::Slot(slot, image), parts, write, stage }
    }

    /// True if the operation of `later` must wait for that of this access: both use the same resource, at least one writes, and their parts overlap.
    /// Slices of a 3D image are not subresources in Vulkan, and a reader may filter across slices. Therefore a reader and a writer of a volume, or of
    /// the slot `TileRanges`, conflict whatever their parts are.
    pub fn conflicts(&self, later: &Access) -> bool {
        if self.resource != later.resource || !(self.write || later.write) {
            return false;
        }
        let overlap = self.parts.start < later.parts.end && later.parts.start < self.parts.end;
        let is_volume =
            matches!(self.resource, Resource::Slot(slot, _) if slot.is_volume() || slot == Slot::TileRanges);
        overlap || (is_volume && self.write != later.write)
    }
}

/// The memory accesses of a dispatch: those of the slots that it reads, then those of the slots that it writes.
pub fn accesses(scene: &Scene, pass: &Pass, args: &DispatchArgs) -> Vec<Access> {
    let access = |bind: crate::passes::Bind, write| {
        let all = bind.slot.shape(scene).parts();
        // An image may begin with a later slice than the first.
        let part = |slice: u32| slice.saturating_sub(bind.slot.first_texel(scene)[2]).min(all);
        let parts = match bind.part {
            Part::Whole | Part::Groups => 0..all,
            Part::Slices => match bind.slot.shape(scene) {
                Shape::Three(_) => part(args.slice)..part(args.slice + args.slices),
                Shape::Layers(_) => 0..args.slices,
                Shape::Two(_) | Shape::Buffer(_) => 0..all,
            },
            Part::Layers => args.layer..args.layer + args.slices,
            Part::Around(more) => part(args.slice.saturating_sub(more))..part(args.slice + args.slices + more),
        };
        let image = if bind.slot.is_multibuffered() { args.image } else { 0 };
        Access::of_slot(bind.slot, image, parts, write, PipelineStage::Compute)
    };
    let reads = pass.reads(scene, args).into_iter().map(|b| access(b, false));
    let writes = pass.writes(scene, args).into_iter().map(|b| access(b, true));
    reads.chain(writes).collect()
}

/// Tracks the accesses that no barrier has covered yet.
#[derive(Clone, Debug, Default)]
pub struct BarrierTracker {
    pending: Vec<(Access, PipelineStages)>,
    /// Some recorded operations may never have run.
    is_invalid: bool,
}

impl BarrierTracker {
    /// Records an operation with these accesses, which follows all operations recorded before. Returns the barrier that has to precede it; None if it
    /// needs none.
    pub fn record(&mut self, accesses: &[Access]) -> Option<Barrier> {
        let hazard = accesses.iter().any(|later| {
            self.pending.iter().any(|(earlier, covered)| !covered.has(later.stage) && earlier.conflicts(later))
        });
        let barrier = (hazard || self.is_invalid).then(|| self.barrier(accesses));
        for access in accesses {
            self.add(access);
        }
        barrier
    }

    /// Has to be called when the last recording was not submitted. Barriers of that recording then do not count: the next operation gets a barrier
    /// that waits for all earlier operations.
    pub fn invalidate(&mut self) {
        self.is_invalid = true;
    }

    fn barrier(&mut self, accesses: &[Access]) -> Barrier {
        let to = accesses.iter().fold(PipelineStages::DEVICE, |to, a| to.with(a.stage.into()));
        let before = if self.is_invalid { PipelineStages::DEVICE } else { PipelineStages::default() };
        let from = self.pending.iter().fold(before, |from, (a, _)| from.with(a.stage.into()));
        self.is_invalid = false;
        for (_, covered) in &mut self.pending {
            *covered = covered.with(to);
        }
        // The host only accesses the readback buffer while the device runs.
        self.pending.retain(|(access, covered)| match access.resource {
            Resource::Readback => !covered.has(PipelineStage::Host),
            Resource::Slot(..) => false,
        });
        Barrier { from, to }
    }

    fn add(&mut self, access: &Access) {
        let is_pending = self.pending.iter().any(|(a, covered)| a == access && *covered == PipelineStages::default());
        if !is_pending {
            self.pending.push((access.clone(), PipelineStages::default()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Operation = Vec<Access>;

    /// An independent check: every pair of conflicting operations must be separated by a barrier from the stage of the first to the stage
    /// of the second.
    fn uncovered(operations: &[Operation], barriers: &[Option<Barrier>]) -> Option<(usize, usize)> {
        for (j, later) in operations.iter().enumerate() {
            for (i, earlier) in operations[..j].iter().enumerate() {
                for a in earlier {
                    for b in later.iter().filter(|b| needs_order(a, b)) {
                        let between = &barriers[i + 1..=j];
                        if !between.iter().flatten().any(|barrier| barrier.from.has(a.stage) && barrier.to.has(b.stage))
                        {
                            return Some((i, j));
                        }
                    }
                }
            }
        }
        None
    }

    fn needs_order(a: &Access, b: &Access) -> bool {
        let shared = (0..64).any(|part| a.parts.contains(&part) && b.parts.contains(&part));
        let is_volume = matches!(a.resource, Resource::Slot(Slot::Volume | Slot::SharpVolume, _));
        let mixed = is_volume && a.write != b.write;
        a.resource == b.resource && (a.write || b.write) && (shared || mixed)
    }

    fn derive(operations: &[Operation]) -> Vec<Option<Barrier>> {
        let mut tracker = BarrierTracker::default();
        operations.iter().map(|o| tracker.record(o)).collect()
    }

    fn operation() -> impl Strategy<Value = Operation> {
        let device = (0usize..5, 0u32..2, 0u32..4, 1u32..3, any::<bool>());
        let accesses = prop::collection::vec(device, 1..4);
        (accesses, 0u8..8).prop_map(|(accesses, kind)| {
            if kind == 0 {
                return vec![Access {
                    resource: Resource::Readback,
                    parts: 0..1,
                    write: false,
                    stage: PipelineStage::Host,
                }];
            }
            let stage = if kind < 3 { PipelineStage::Copy } else { PipelineStage::Compute };
            accesses
                .into_iter()
                .map(|(slot, image, from, count, write)| {
                    let resource = match slot {
                        0 => Resource::Slot(Slot::Frames, 0),
                        1 => Resource::Slot(Slot::Volume, image),
                        2 => Resource::Slot(Slot::Picture, 0),
                        3 => Resource::Slot(Slot::Distance, 0),
                        _ => Resource::Readback,
                    };
                    let parts = if slot < 2 { from..from + count } else { 0..1 };
                    Access { resource, parts, write: write || slot == 4, stage }
                })
                .collect()
        })
    }

    proptest! {
        #[test]
        fn every_conflict_is_covered_and_every_barrier_covers_one(operations in prop::collection::vec(operation(), 1..24)) {
            let barriers = derive(&operations);
            prop_assert_eq!(uncovered(&operations, &barriers), None);
            for dropped in 0..barriers.len() {
                if barriers[dropped].is_some() {
                    let mut without = barriers.clone();
                    without[dropped] = None;
                    prop_assert!(uncovered(&operations, &without).is_some(), "barrier {} is not needed", dropped);
                }
            }
        }
    }

    /// Two volumes of frames and two pictures of a scene with every filter, as the renderer records them.
    #[test]
    fn every_barrier_of_a_real_plan_is_needed_and_none_is_missing() {
        use crate::passes::{Frequency, PASSES};
        use crate::scene::test_block::block;
        let settings = "slices.median = true
            slices.sigma = {}
            slices.enhanced_sigma = { growth = true }
            slices.perona_malik = { scheme = 'aos', repeat = 2 }
            slices.smooth = { lateral = 1.0, depth = 1.0, elevation = 1.0 }
            distance = { median = 3, bilateral = { pixels = 1.0, distance = 1.0, repeat = 3 }, sigma = {} }
            light = { shadow = {}, occlusion = {} }
            post = { sigma = {}, enhanced_sigma = {}, perona_malik = { scheme = 'aos' } }";
        let scene = block(&settings.lines().map(str::trim).collect::<Vec<_>>(), [8, 8, 6]);
        let mut operations: Vec<Operation> = Vec::new();
        let run = |frequency: Frequency, args: DispatchArgs, operations: &mut Vec<Operation>| {
            for pass in PASSES.iter().filter(|p| p.frequency == frequency && p.is_needed(&scene)) {
                for iteration in 0..(pass.repeat)(&scene) {
                    operations.push(accesses(&scene, pass, &DispatchArgs { iteration, ..args }));
                }
            }
        };
        for image in 0..2 {
            // Frames alone, two and three at once.
            for (n, (slice, slices)) in [(0, 1), (1, 2), (3, 3)].into_iter().enumerate() {
                let args = DispatchArgs { layer: 6 * n as u32, slice, slices, image, ..DispatchArgs::default() };
                let layers = args.layer..args.layer + slices;
                operations.push(vec![Access::of_slot(Slot::Frames, 0, layers, true, PipelineStage::Copy)]);
                run(Frequency::Frame, args, &mut operations);
            }
            run(
                Frequency::Volume,
                DispatchArgs { image, slices: scene.slices(), ..DispatchArgs::default() },
                &mut operations,
            );
            run(Frequency::Picture, DispatchArgs { image, ..DispatchArgs::default() }, &mut operations);
        }
        let barriers = derive(&operations);
        assert!(barriers.iter().flatten().count() > 40);
        assert_eq!(uncovered(&operations, &barriers), None);
        for dropped in (0..barriers.len()).filter(|n| barriers[*n].is_some()) {
            let mut without = barriers.clone();
            without[dropped] = None;
            assert!(uncovered(&operations, &without).is_some(), "barrier {dropped} is not needed");
        }
    }

    fn touch(slot: Slot, parts: Range<u32>, write: bool) -> Access {
        Access::of_slot(slot, 0, parts, write, PipelineStage::Compute)
    }

    #[test]
    fn two_slices_may_be_written_at_once_but_not_read_while_one_is_written() {
        let mut tracker = BarrierTracker::default();
        assert!(tracker.record(&[touch(Slot::Volume, 0..1, true)]).is_none());
        assert!(tracker.record(&[touch(Slot::Volume, 1..2, true)]).is_none());
        assert!(tracker.record(&[touch(Slot::Volume, 1..2, true)]).is_some(), "write after write, which layers miss");
        assert!(tracker.record(&[touch(Slot::Volume, 3..4, false)]).is_some());
    }

    #[test]
    fn after_a_failed_submission_the_next_operation_waits_for_everything() {
        let mut tracker = BarrierTracker::default();
        assert!(tracker.record(&[touch(Slot::Picture, 0..1, true)]).is_none());
        tracker.invalidate();
        let barrier = tracker.record(&[touch(Slot::Distance, 0..1, false)]).expect("a barrier");
        assert_eq!((barrier.from, barrier.to), (PipelineStages::DEVICE, PipelineStages::DEVICE));
        assert!(tracker.record(&[touch(Slot::Distance, 0..1, false)]).is_none());
    }

    #[test]
    fn layers_of_an_array_do_not_wait_for_one_another() {
        let mut tracker = BarrierTracker::default();
        let copy = |layer: u32| Access::of_slot(Slot::Frames, 0, layer..layer + 1, true, PipelineStage::Copy);
        assert!(tracker.record(&[copy(0)]).is_none());
        assert!(tracker.record(&[copy(1)]).is_none());
        assert!(tracker.record(&[touch(Slot::Frames, 0..1, false)]).is_some());
        assert!(tracker.record(&[copy(2)]).is_none());
        assert!(tracker.record(&[copy(0)]).is_some(), "write after read");
    }

    #[test]
    fn multibuffered_volume_images_are_independent() {
        let mut tracker = BarrierTracker::default();
        let on = |image, write| Access::of_slot(Slot::Volume, image, 0..4, write, PipelineStage::Compute);
        assert!(tracker.record(&[on(0, true)]).is_none());
        assert!(tracker.record(&[on(1, true)]).is_none());
        assert!(tracker.record(&[on(0, false)]).is_some());
        assert!(tracker.record(&[on(1, false)]).is_none(), "the barrier before covered both");
    }
}
