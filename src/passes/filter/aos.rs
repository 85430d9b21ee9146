//! Anisotropic diffusion in semi-implicit steps by additive operator splitting (Weickert, ter Haar Romeny and Viergever 1998):
//! u' = 1/2 sum over both axes of (I - 2 tau A(u))^-1 u, with Perona and Malik's conductance between neighbours. Stable at any
//! tau, and within the range of what was there. Each axis is eliminated forwards and substituted backwards, an invocation a
//! row or a column: four dispatches a step.

use super::estimator::storable_edge;
use super::perona_malik::{conductance, constant, need};
use crate::passes::pass::*;
use crate::scene::{PeronaMalik, Scheme};

/// Dispatches of one step: rows forward and backward, columns forward and backward.
pub(super) const DISPATCHES: u32 = 4;

pub(super) const TOLERANCE: Tolerance = Tolerance {
    absolute: 3e-5,
    relative: 3e-6,
    outliers: 0.0,
    why: "every term of the sweeps is positive, so that a row of n pixels is off by about n ulp; noise in place of shares of at \
          most 1 sums to tens; then what the target's format stores",
};

pub const SLICE: Pass = Pass {
    name: "aos_slice",
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    link: Link::Filter(Filter { dispatches: |_| DISPATCHES, ..Filter::of_slices(|_| None) }),
    shader: |_, t| match turn_of(t) {
        (_, Sweep::Forward) => "filter/aos_forward.plane",
        (0, Sweep::Backward) => "filter/aos_backward.rows",
        _ if t.writes_volume() => "filter/aos_backward.slice",
        _ => "filter/aos_backward.plane",
    },
    needed: |s| need(s.settings.slices.perona_malik, Scheme::Aos),
    reads: |_, t| SLICE_SLOTS.reads(t.source(), t),
    writes: |_, t| SLICE_SLOTS.writes(slice("target", t.target()), t),
    extent: |s, t| lines(s.grid.size, t),
    repeat: |s| DISPATCHES * s.settings.slices.perona_malik.unwrap_or_default().repeat,
    params: |s, t| params(s.settings.slices.perona_malik, t),
    constants: |s, t| constants(s.settings.slices.perona_malik, t),
    tolerance: TOLERANCE,
    reference: |s, t, reads, writes| reference(s.settings.slices.perona_malik, t, reads, writes),
};

pub const PICTURE: Pass = Pass {
    name: "aos_picture",
    stage: Stage::Postprocess,
    frequency: Frequency::Picture,
    link: Link::Filter(Filter { dispatches: |_| DISPATCHES, ..Filter::of(Chain::Pictures) }),
    shader: |_, t| match turn_of(t) {
        (_, Sweep::Forward) => "filter/aos_forward.picture",
        (0, Sweep::Backward) => "filter/aos_backward.picture_rows",
        _ => "filter/aos_backward.picture",
    },
    needed: |s| need(s.settings.post.perona_malik, Scheme::Aos),
    reads: |_, t| PICTURE_SLOTS.reads(t.source(), t),
    writes: |_, t| PICTURE_SLOTS.writes(whole("target", t.target()), t),
    extent: |s, t| lines(s.picture_size(), t),
    repeat: |s| DISPATCHES * s.settings.post.perona_malik.unwrap_or_default().repeat,
    params: |s, t| params(s.settings.post.perona_malik, t),
    constants: |s, t| constants(s.settings.post.perona_malik, t),
    tolerance: TOLERANCE,
    reference: |s, t, reads, writes| reference(s.settings.post.perona_malik, t, reads, writes),
};

/// The slots between the sweeps.
pub(super) struct Between {
    shares: Slot,
    forward: Slot,
    rows: Slot,
}

pub(super) const SLICE_SLOTS: Between =
    Between { shares: Slot::SliceShares, forward: Slot::SliceForward, rows: Slot::SliceRows };
const PICTURE_SLOTS: Between =
    Between { shares: Slot::PictureShares, forward: Slot::PictureForward, rows: Slot::PictureRows };

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Sweep {
    Forward,
    Backward,
}

/// The axis (0 along rows, 1 along columns) and the direction of a dispatch.
pub(super) fn turn_of(args: &DispatchArgs) -> (usize, Sweep) {
    let sweep = if args.iteration.is_multiple_of(2) { Sweep::Forward } else { Sweep::Backward };
    ((args.iteration % DISPATCHES / 2) as usize, sweep)
}

impl Between {
    pub(super) fn reads(&self, source: Slot, args: &DispatchArgs) -> Vec<Bind> {
        let swept = || vec![whole("shares", self.shares), whole("forward", self.forward)];
        match turn_of(args) {
            (_, Sweep::Forward) => vec![whole("source", source)],
            (0, Sweep::Backward) => swept(),
            _ => [swept(), vec![whole("rows", self.rows)]].concat(),
        }
    }

    pub(super) fn writes(&self, target: Bind, args: &DispatchArgs) -> Vec<Bind> {
        match turn_of(args) {
            (_, Sweep::Forward) => vec![whole("shares", self.shares), whole("forward", self.forward)],
            (0, Sweep::Backward) => vec![whole("target", self.rows)],
            _ => vec![target],
        }
    }
}

pub(super) fn lines(size: [u32; 2], args: &DispatchArgs) -> [u32; 3] {
    [size[1 - turn_of(args).0], 1, 1]
}

pub(super) fn params(settings: Option<PeronaMalik>, args: &DispatchArgs) -> Params {
    let p = settings.unwrap_or_default();
    match turn_of(args).1 {
        Sweep::Forward => Params::default().f32("edge", storable_edge(p.edge)).f32("tau", p.step),
        Sweep::Backward => Params::default().i32("slice", args.slice),
    }
}

pub(super) fn constants(settings: Option<PeronaMalik>, args: &DispatchArgs) -> Vec<(&'static str, i32)> {
    let (axis, sweep) = turn_of(args);
    let mut constants = vec![("AXIS", axis as i32)];
    constants.extend((sweep == Sweep::Forward).then(|| constant(settings)));
    constants
}

pub(super) fn reference(settings: Option<PeronaMalik>, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
    let p = settings.unwrap_or_default();
    let (axis, sweep) = turn_of(args);
    let size = reads.get(if sweep == Sweep::Forward { "source" } else { "shares" }).size;
    for line in 0..size[1 - axis] {
        let texel = |i: usize| if axis == 0 { [i, line, 0] } else { [line, i, 0] };
        match sweep {
            Sweep::Forward => {
                let source = reads.get("source");
                let values: Vec<&[f64]> = (0..size[axis]).map(|i| source.get(texel(i))).collect();
                let weights: Vec<f64> = values.windows(2).map(|w| 2.0 * p.step * conductance(&p, w[0], w[1])).collect();
                for i in 0..size[axis] {
                    let (share, forward) = eliminated(&weights, &values, i);
                    writes.get_mut("shares").set(texel(i), &[share]);
                    writes.get_mut("forward").set(texel(i), &forward);
                }
            }
            Sweep::Backward => {
                let (shares, forward) = (reads.get("shares"), reads.get("forward"));
                let target = writes.get_mut("target");
                for i in 0..size[axis] {
                    // All that later pixels pass on, each through the shares of those between.
                    let mut u = vec![0.0; forward.channels];
                    let mut through = 1.0;
                    for j in i..size[axis] {
                        u.iter_mut().zip(forward.get(texel(j))).for_each(|(u, f)| *u += through * f);
                        through *= shares.one(texel(j)[0], texel(j)[1], 0);
                    }
                    if axis == 1 {
                        u.iter_mut().zip(reads.get("rows").get(texel(i))).for_each(|(u, r)| *u = 0.5 * (*u + r));
                    }
                    let [x, y, _] = texel(i);
                    target.set([x, y, if target.size[2] > 1 { args.slice as usize } else { 0 }], &u);
                }
            }
        }
    }
}

/// The result of elimination at pixel i, u[i] = forward + share u[i+1], computed without elimination: the last unknown of the
/// first i + 1 equations, whose solution is linear in u[i+1]. `forward` is that solution with u[i+1] = 0, and `share` what a
/// u[i+1] of 1 adds to it.
fn eliminated(weights: &[f64], values: &[&[f64]], i: usize) -> (f64, Vec<f64>) {
    let weight = |j: usize| weights.get(j).copied().unwrap_or(0.0);
    let last = |right: Vec<f64>| {
        let rows = right.into_iter().enumerate().map(|(j, right)| {
            let before = if j > 0 { weight(j - 1) } else { 0.0 };
            Row { before: -before, diagonal: 1.0 + before + weight(j), after: -weight(j), right }
        });
        last_unknown(&rows.collect::<Vec<_>>())
    };
    let channels = values[0].len();
    let forward = (0..channels).map(|c| last(values[..=i].iter().map(|v| v[c]).collect())).collect();
    let share = last((0..=i).map(|j| if j == i { weight(i) } else { 0.0 }).collect());
    (share, forward)
}

/// One equation of a tridiagonal system.
#[derive(Clone, Copy)]
struct Row {
    before: f64,
    diagonal: f64,
    after: f64,
    right: f64,
}

/// The last unknown, by cyclic reduction (Hockney 1965): every other unknown is eliminated until one is left.
fn last_unknown(rows: &[Row]) -> f64 {
    let none = Row { before: 0.0, diagonal: 1.0, after: 0.0, right: 0.0 };
    let last = rows[rows.len() - 1];
    if rows.len() == 1 {
        return last.right / last.diagonal;
    }
    let odd = (1..rows.len()).step_by(2).map(|i| {
        let (low, here, high) = (rows[i - 1], rows[i], rows.get(i + 1).copied().unwrap_or(none));
        let (a, c) = (here.before / low.diagonal, here.after / high.diagonal);
        Row {
            before: -a * low.before,
            diagonal: here.diagonal - a * low.after - c * high.before,
            after: -c * high.after,
            right: here.right - a * low.right - c * high.right,
        }
    });
    let last_odd = last_unknown(&odd.collect::<Vec<_>>());
    if rows.len().is_multiple_of(2) { last_odd } else { (last.right - last.before * last_odd) / last.diagonal }
}
