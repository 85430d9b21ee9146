//! AOS with Richardson's extrapolation: the error of a step of the first order is halved by two half steps, so that twice their result less that
//! of one complete step is of second order in time. It stays stable, but a value may leave the range of its neighbours. Three steps
//! of AOS, whose shaders and reference these are; the last dispatch also extrapolates.

use super::aos::{self, SLICE_SLOTS, Sweep, turn_of};
use super::perona_malik::need;
use crate::passes::pass::*;
use crate::scene::{PeronaMalik, Scene, Scheme};

/// Steps of AOS in one step: a complete one and two halves.
const STEPS: u32 = 3;
const DISPATCHES: u32 = STEPS * aos::DISPATCHES;

pub const SLICE: Pass = Pass {
    name: "aos_richardson_slice",
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    link: Link::Filter(Filter { dispatches: |_| DISPATCHES, ..Filter::of_slices(|_| None) }),
    shader: |_, t| match (turn_of(t), is_last(t), t.writes_volume()) {
        ((_, Sweep::Forward), _, _) => "filter/aos_forward.plane",
        ((0, Sweep::Backward), _, _) => "filter/aos_backward.rows",
        (_, false, _) => "filter/aos_backward.plane",
        (_, true, false) => "filter/aos_backward.richardson_plane",
        (_, true, true) => "filter/aos_backward.richardson_slice",
    },
    needed: |s| need(s.settings.slices.perona_malik, Scheme::AosRichardson),
    reads: |_, t| {
        let source = if part(t) == Part::SecondHalf { Slot::SliceHalfStep } else { t.source() };
        let mut reads = SLICE_SLOTS.reads(source, t);
        reads.extend(is_last(t).then_some(whole("step_result", Slot::SliceStep)));
        reads
    },
    writes: |_, t| {
        let target = match part(t) {
            Part::Complete => whole("target", Slot::SliceStep),
            Part::FirstHalf => whole("target", Slot::SliceHalfStep),
            Part::SecondHalf => slice("target", t.target()),
        };
        SLICE_SLOTS.writes(target, t)
    },
    extent: |s, t| aos::lines(s.grid.size, t),
    repeat: |s| DISPATCHES * s.settings.slices.perona_malik.unwrap_or_default().repeat,
    params: |s, t| aos::params(step_of(s, t), t),
    constants: |s, t| aos::constants(s.settings.slices.perona_malik, t),
    tolerance: Tolerance { absolute: 6e-5, ..aos::TOLERANCE },
    reference: |s, t, reads, writes| {
        aos::reference(step_of(s, t), t, reads, writes);
        if is_last(t) {
            let complete = reads.get("step_result");
            let target = writes.get_mut("target");
            let z = if target.size[2] > 1 { t.slice as usize } else { 0 };
            for (x, y) in (0..complete.size[1]).flat_map(|y| (0..complete.size[0]).map(move |x| (x, y))) {
                let extrapolated = 2.0 * target.one(x, y, z) - complete.one(x, y, 0);
                target.set([x, y, z], &[extrapolated]);
            }
        }
    },
};

/// The step of AOS that a dispatch belongs to.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Complete,
    FirstHalf,
    SecondHalf,
}

fn part(args: &DispatchArgs) -> Part {
    [Part::Complete, Part::FirstHalf, Part::SecondHalf][(args.iteration / aos::DISPATCHES % STEPS) as usize]
}

/// The dispatch that ends both half steps.
fn is_last(args: &DispatchArgs) -> bool {
    args.iteration % DISPATCHES == DISPATCHES - 1
}

/// The settings with the time of the step of AOS that a dispatch belongs to.
fn step_of(scene: &Scene, args: &DispatchArgs) -> Option<PeronaMalik> {
    let share = if part(args) == Part::Complete { 1.0 } else { 0.5 };
    scene.settings.slices.perona_malik.map(|p| PeronaMalik { step: share * p.step, ..p })
}
