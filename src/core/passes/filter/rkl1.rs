//! Anisotropic diffusion of slices in super time steps, by the Runge-Kutta-Legendre method of first order (RKL1; Meyer, Balsara and
//! Aslam 2014): s explicit stages make a step that is (s^2 + s)/2 times as long as the longest stable explicit one. Every stage evaluates
//! the conductance anew. A dispatch a stage.
//!
//! The method of second order (RKL2) is not offered: on Perona and Malik's equation, whose flow falls again beyond an edge's height,
//! checkerboards grew at steps from 5 on. RKL1 grew on nothing up to steps of 400, and is the more accurate in up to 150 stages over a
//! time of 100.

use super::estimator::storable_edge;
use super::perona_malik::{constant, flows, need};
use crate::passes::pass::*;
use crate::scene::{PeronaMalik, Scene, Scheme};

pub const SLICE: Pass = Pass {
    name: "rkl1_slice",
    link: Link::Filter(Filter { dispatches: stages, ..Filter::of_slices(|_| None) }),
    shader: |_, _| "filter/rkl1",
    needed: |s| need(s.slice_filters.perona_malik, Scheme::Rkl1),
    reads: |s, t| {
        // After no stage: the step's beginning.
        let after = |n: u32| if n == 0 { t.source() } else { kept(n) };
        let stage = stage_of(s, t);
        let mut reads = vec![chain_slot("last", after(stage - 1))];
        reads.extend((stage > 1).then(|| chain_slot("before", after(stage - 2))));
        reads
    },
    writes: |s, t| match stage_of(s, t) {
        stage if stage == stages(s) => vec![slices("target", t.target())],
        stage => vec![slices("target", kept(stage))],
    },
    repeat: |s| stages(s) * settings(s).repeat,
    params: |s, t| {
        let p = settings(s);
        let c = Coefficients::of(stages(s), stage_of(s, t));
        Params::default()
            .f32("edge", storable_edge(p.edge))
            .f32("mu", c.mu)
            .f32("nu", c.nu)
            .f32("share", c.share * p.step)
            .i32("slice", t.slice)
    },
    constants: |s, t| vec![constant(s.slice_filters.perona_malik), ("FIRST", i32::from(stage_of(s, t) == 1))],
    tolerance: Tolerance::absolute(3e-6).relative(3e-6).because(
        "mu and nu are below 2 and cancel to 1, and the share of a stage is at most 1/2 of four flows in f32; then \
         what the target's format stores",
    ),
    reference,
    ..Pass::OF_SLICES
};

fn settings(scene: &Scene) -> PeronaMalik {
    scene.slice_filters.perona_malik.unwrap_or_default()
}

fn stages(scene: &Scene) -> u32 {
    settings(scene).stages()
}

/// The stage of a dispatch, counted from 1.
fn stage_of(scene: &Scene, args: &DispatchArgs) -> u32 {
    args.iteration % stages(scene) + 1
}

/// The slot that keeps the result of a stage.
fn kept(stage: u32) -> Slot {
    [Slot::SliceStageA, Slot::SliceStageB, Slot::SliceStageC][(stage - 1) as usize % 3]
}

/// Coefficients of a stage; `share` for a step of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Coefficients {
    mu: f64,
    nu: f64,
    share: f64,
}

impl Coefficients {
    /// Of stage `stage`, 1..=`stages`: Legendre's three-term recurrence (Meyer, Balsara and Aslam 2014, section 2).
    fn of(stages: u32, stage: u32) -> Coefficients {
        let (s, j) = (f64::from(stages), f64::from(stage));
        let mu = (2.0 * j - 1.0) / j;
        Coefficients { mu, nu: (1.0 - j) / j, share: mu * 2.0 / (s * s + s) }
    }
}

fn reference(scene: &Scene, dispatch: &Dispatch, reads: &Arrays, writes: &mut Arrays) {
    let p = settings(scene);
    let stage = stage_of(scene, dispatch);
    let c = Coefficients::of(stages(scene), stage);
    let last = reads.get("last");
    let flows = flows(&p, last, |_| true);
    let (target, z) = target_of(writes, dispatch);
    let width = last.size[0];
    for (n, flow) in flows.values.iter().enumerate() {
        let before = if stage > 1 { c.nu * reads.get("before").values[n] } else { 0.0 };
        let value = c.mu * last.values[n] + before + p.step * c.share * flow;
        target.set([n % width, n / width, z], &[value]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step of z on u' = -u: 1 - z to first order, and within 1 in size up to the limit.
    #[test]
    fn a_step_is_of_first_order_and_stable_up_to_its_limit() {
        for stages in [3, 5, 9, 41, 57] {
            let step = |z: f64| {
                let (mut before, mut last) = (0.0, 1.0);
                for stage in 1..=stages {
                    let c = Coefficients::of(stages, stage);
                    (before, last) = (last, c.mu * last + c.nu * before - z * c.share * last);
                }
                last
            };
            let small = 1e-3;
            assert!((step(small) - (1.0 - small)).abs() < small * small, "{stages}");
            let limit = f64::from(stages * stages + stages);
            for n in 0..=400 {
                let amplified = step(limit * f64::from(n) / 400.0);
                assert!(amplified.abs() <= 1.0 + 1e-12, "{stages} stages, {n}/400 of the limit: {amplified}");
            }
            assert!(step(1.05 * limit).abs() > 1.0, "{stages}: the limit is the limit");
        }
    }
}
