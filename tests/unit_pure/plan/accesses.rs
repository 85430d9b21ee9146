//! The accesses of a dispatch, from its pass, its arguments and the part of each slot that it binds.

use super::{FILTERED, scene};
use crate::common::probes::voxels;
use echolume::low_level::barriers::{Access, PipelineStage, PipelineStages, Resource, accesses};
use echolume::low_level::passes::slots::frames_per_batch;
use echolume::low_level::passes::{DispatchArgs, Slot, by_name};
use std::ops::Range;

/// Slot, volume image, and parts.
type Touched = Vec<(Slot, u32, Range<u32>)>;

/// Its reads and its writes.
fn touched(name: &str, args: DispatchArgs) -> (Touched, Touched) {
    let scene = scene(voxels([6, 8, 5]), FILTERED);
    let all = accesses(&scene, by_name(name).expect("pass"), &args);
    let of = |write| {
        let part = |a: &Access| match a.resource {
            Resource::Slot(slot, image) => (slot, image, a.parts.clone()),
            Resource::Readback => panic!("no pass reads back"),
        };
        assert!(all.iter().all(|a| a.stage == PipelineStage::Compute));
        all.iter().filter(|a| a.write == write).map(part).collect()
    };
    (of(false), of(true))
}

#[test]
fn a_pass_over_frames_touches_its_layer_and_one_over_slices_its_slice() {
    let args = DispatchArgs { layer: 2, slice: 3, image: 1, ..DispatchArgs::default() };
    let (reads, writes) = touched("load_slice", args);
    assert_eq!(reads, [(Slot::Frames, 0, 2..3)]);
    assert_eq!(writes, [(Slot::SliceA, 0, 0..1)]);
    let (reads, writes) = touched("aos_slice", DispatchArgs { iteration: 7, ..args });
    let whole = |slot| (slot, 0, 0..1);
    assert_eq!(reads, [whole(Slot::SliceShares), whole(Slot::SliceForward), whole(Slot::SliceRows)]);
    assert_eq!(writes, [(Slot::SharpVolume, 1, 3..4)]);
    // A batch of two.
    let two = DispatchArgs { slices: 2, ..args };
    assert_eq!(touched("load_slice", two), (vec![(Slot::Frames, 0, 2..4)], vec![(Slot::SliceA, 0, 0..2)]));
    let (reads, writes) = touched("aos_slice", DispatchArgs { iteration: 7, ..two });
    assert!(reads.iter().all(|(_, _, parts)| *parts == (0..2)), "{reads:?}");
    assert_eq!(writes, [(Slot::SharpVolume, 1, 3..5)]);
}

/// A layer for each frame of a batch, as many as 4 MiB hold, at most 16; the frame array holds four batches.
#[test]
fn a_batch_is_as_large_as_its_frames_are_small() {
    for (size, frames) in
        [([6, 8, 5], 5), ([6, 8, 500], 16), ([512, 512, 40], 4), ([1024, 600, 40], 1), ([2000, 2000, 3], 1)]
    {
        let scene = scene(voxels(size), FILTERED);
        assert_eq!(frames_per_batch(&scene), frames, "{size:?}");
        for (slot, batches) in [(Slot::Frames, 4), (Slot::SliceA, 1), (Slot::SliceShares, 1)] {
            assert_eq!(slot.shape(&scene).parts(), batches * frames, "{slot:?} of {size:?}");
            assert!(frames == 1 || slot.bytes(&scene) <= u64::from(batches) << 22);
        }
    }
}

#[test]
fn a_pass_over_the_volume_reads_as_far_around_its_slices_as_there_are_any() {
    let around = |slice, slices| {
        touched("gaussian_elevation", DispatchArgs { slice, slices, image: 1, ..DispatchArgs::default() })
    };
    assert_eq!(around(0, 1), (vec![(Slot::SharpVolume, 1, 0..4)], vec![(Slot::Volume, 1, 0..1)]));
    assert_eq!(around(4, 1), (vec![(Slot::SharpVolume, 1, 1..5)], vec![(Slot::Volume, 1, 4..5)]));
    assert_eq!(around(1, 2), (vec![(Slot::SharpVolume, 1, 0..5)], vec![(Slot::Volume, 1, 1..3)]));
    let (reads, writes) = touched("raycast_projection", DispatchArgs { image: 1, ..DispatchArgs::default() });
    assert_eq!((&reads[0], &writes[0]), (&(Slot::Volume, 1, 0..5), &(Slot::Picture, 0, 0..1)));
}

#[test]
fn a_set_of_stages_lacks_what_was_removed() {
    assert!(PipelineStages::DEVICE.has(PipelineStage::Compute) && PipelineStages::DEVICE.has(PipelineStage::Copy));
    assert!(!PipelineStages::DEVICE.has(PipelineStage::Host));
    let copies = PipelineStages::DEVICE.without(PipelineStage::Compute);
    assert_eq!(copies, PipelineStages::from(PipelineStage::Copy));
    assert_eq!(copies.without(PipelineStage::Host), copies, "what is not there cannot be taken out");
    assert_eq!(copies.without(PipelineStage::Copy), PipelineStages::default());
}

/// Tiles of a volume's slices are texels of one 3D image too.
#[test]
fn a_reader_and_a_writer_of_a_volume_conflict_wherever_they_are_and_of_other_slots_where_they_meet() {
    let access = |slot, parts: Range<u32>, write| Access::of_slot(slot, 0, parts, write, PipelineStage::Compute);
    for slot in [Slot::Volume, Slot::SharpVolume, Slot::TileRanges] {
        assert!(access(slot, 0..1, true).conflicts(&access(slot, 3..4, false)), "{slot:?}");
        assert!(access(slot, 0..1, false).conflicts(&access(slot, 3..4, true)), "{slot:?}");
        assert!(!access(slot, 0..1, true).conflicts(&access(slot, 1..2, true)), "{slot:?}");
        assert!(!access(slot, 0..1, false).conflicts(&access(slot, 0..1, false)), "{slot:?}");
    }
    let frames = |parts, write| access(Slot::Frames, parts, write);
    assert!(frames(0..2, true).conflicts(&frames(1..3, false)) && frames(1..3, true).conflicts(&frames(0..2, true)));
    assert!(!frames(0..2, true).conflicts(&frames(2..3, false)) && !frames(2..3, true).conflicts(&frames(0..2, false)));
    let other = Access::of_slot(Slot::Frames, 1, 0..2, true, PipelineStage::Compute);
    assert!(!frames(0..2, true).conflicts(&other), "another image");
}
