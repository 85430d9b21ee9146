//! AOS with Richardson's extrapolation: the error of a step of the first order is halved by two half steps, so that twice their result less that
//! of one complete step is of second order in time, in the limit of short steps (docs/numerics.md has the orders at longer ones). It stays
//! stable, but a value may leave the range of its neighbours. Three steps of AOS, whose shaders and reference these are; the last dispatch
//! also extrapolates.

use super::aos::{self, SLICES};
use super::perona_malik::need;
use crate::passes::pass::*;
use crate::scene::{PeronaMalik, Scene, Scheme};

/// Steps of AOS in one step: a complete one and two halves.
const STEPS: u32 = 3;

pub const SLICE: Pass = Pass {
    name: "aos_richardson_slice",
    link: Link::Filter(Filter { dispatches, ..Filter::of_slices(|_| None) }),
    shader: |s, t| SLICES.shader(s, t),
    needed: |s| need(s.slice_filters.perona_malik, Scheme::AosRichardson),
    reads: |s, t| {
        let source = if part(s, t) == Part::SecondHalf { Slot::SliceHalfStep } else { t.source() };
        let mut reads = SLICES.reads(s, source, t);
        reads.extend(is_last(s, t).then_some(slices("step_result", Slot::SliceStep)));
        reads
    },
    writes: |s, t| {
        let target = match part(s, t) {
            Part::Complete => slices("target", Slot::SliceStep),
            Part::FirstHalf => slices("target", Slot::SliceHalfStep),
            Part::SecondHalf => slices("target", t.target()),
        };
        SLICES.writes(s, target, t)
    },
    extent: |s, t| SLICES.extent(s, t),
    repeat: |s| dispatches(s) * s.slice_filters.perona_malik.unwrap_or_default().repeat,
    params: |s, t| SLICES.params(s, step_of(s, t), t),
    constants: |s, t| SLICES.constants(s, t, is_last(s, t)),
    tolerance: Tolerance { absolute: 6e-5, ..aos::TOLERANCE },
    reference: |s, t, reads, writes| {
        SLICES.reference(s, step_of(s, t), t, reads, writes);
        if is_last(s, t) {
            let complete = reads.get("step_result");
            let (target, z) = target_of(writes, t);
            for (x, y) in complete.pixels() {
                let extrapolated = 2.0 * target.one(x, y, z) - complete.one(x, y, 0);
                target.set([x, y, z], &[extrapolated]);
            }
        }
    },
    ..Pass::OF_SLICES
};

fn dispatches(scene: &Scene) -> u32 {
    STEPS * SLICES.dispatches(scene)
}

/// The step of AOS that a dispatch belongs to.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Complete,
    FirstHalf,
    SecondHalf,
}

fn part(scene: &Scene, args: &DispatchArgs) -> Part {
    [Part::Complete, Part::FirstHalf, Part::SecondHalf][(args.iteration / SLICES.dispatches(scene) % STEPS) as usize]
}

/// The dispatch that ends both half steps.
fn is_last(scene: &Scene, args: &DispatchArgs) -> bool {
    let dispatches = dispatches(scene);
    args.iteration % dispatches == dispatches - 1
}

/// The settings with the time of the step of AOS that a dispatch belongs to.
fn step_of(scene: &Scene, args: &DispatchArgs) -> Option<PeronaMalik> {
    let share = if part(scene, args) == Part::Complete { 1.0 } else { 0.5 };
    scene.slice_filters.perona_malik.map(|p| PeronaMalik { step: share * p.step, ..p })
}
