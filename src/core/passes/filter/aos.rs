//! Anisotropic diffusion in semi-implicit steps by additive operator splitting (Weickert, ter Haar Romeny and Viergever 1998):
//! u' = 1/2 sum over both axes of (I - 2 tau A(u))^-1 u, with Perona and Malik's conductance between neighbours. Stable at any
//! tau, and within the range of what was there. Each axis is solved by one of two methods (`Images::is_hybrid`).

use super::estimator::storable_edge;
use super::perona_malik::{conductance, constant, need};
use crate::passes::pass::*;
use crate::scene::{PeronaMalik, Scene, Scheme};

pub(super) const TOLERANCE: Tolerance = Tolerance::absolute(3e-5).relative(3e-6).because(
    "every term of the solvers is positive, so that a row of n pixels is off by about n ulp; noise in place of shares \
     of at most 1 sums to tens; then what the target's format stores",
);

pub const SLICE: Pass = pass::<0>("aos_slice", Filter::of_slices(|_| None), Pass::OF_SLICES);
pub const PICTURE: Pass = pass::<1>("aos_picture", Filter::of(Chain::Pictures), Pass::OF_PICTURES);

/// What the passes filter. A pass refers to its images by number, because its functions can capture nothing but constants.
const IMAGES: [Images; 2] = [SLICES, PICTURES];

const fn pass<const OF: usize>(name: &'static str, filter: Filter, defaults: Pass) -> Pass {
    Pass {
        name,
        link: Link::Filter(Filter { dispatches: |s| IMAGES[OF].dispatches(s), ..filter }),
        shader: |s, t| IMAGES[OF].shader(s, t),
        needed: |s| need((IMAGES[OF].settings)(s), Scheme::Aos),
        reads: |s, t| IMAGES[OF].reads(s, t.source(), t),
        writes: |s, t| IMAGES[OF].writes(s, slices("target", t.target()), t),
        extent: |s, t| IMAGES[OF].extent(s, t),
        repeat: |s| IMAGES[OF].dispatches(s) * (IMAGES[OF].settings)(s).unwrap_or_default().repeat,
        params: |s, t| IMAGES[OF].params(s, (IMAGES[OF].settings)(s), t),
        constants: |s, t| IMAGES[OF].constants(s, t, false),
        tolerance: TOLERANCE,
        reference: |s, t, reads, writes| IMAGES[OF].reference(s, (IMAGES[OF].settings)(s), t, reads, writes),
        ..defaults
    }
}

/// Invocations of a workgroup of the hybrid solver: THREADS of aos_solve.comp.
const THREADS: u32 = 128;

/// Most unknowns that an invocation of the hybrid solver keeps in registers.
const MAX_CHUNK: u32 = 16;

/// What differs between AOS on slices, distance maps and pictures: settings, shaders, the slots for intermediate results, size and
/// number of channels.
pub(super) struct Images {
    /// As the scene has them. Richardson's extrapolation passes other steps to `params` and `reference`.
    settings: fn(&Scene) -> Option<PeronaMalik>,
    /// The shaders that eliminate, substitute back, and do both.
    shaders: [&'static str; 3],
    shares: Slot,
    forward: Slot,
    rows: Slot,
    size: fn(&Scene) -> [u32; 2],
    channels: u32,
    /// Images that a dispatch solves: the slices of a batch, or the picture.
    images: fn(&DispatchArgs) -> u32,
}

pub(super) const SLICES: Images = Images {
    settings: |s| s.slice_filters.perona_malik,
    shaders: ["filter/aos_forward.slice", "filter/aos_backward.slice", "filter/aos_solve.slice"],
    shares: Slot::SliceShares,
    forward: Slot::SliceForward,
    rows: Slot::SliceRows,
    size: |s| s.grid.size,
    channels: 1,
    images: |t| t.slices,
};
const PICTURES: Images = Images {
    settings: |s| s.settings.post.perona_malik,
    shaders: ["filter/aos_forward.picture", "filter/aos_backward.picture", "filter/aos_solve.picture"],
    shares: Slot::PictureShares,
    forward: Slot::PictureForward,
    rows: Slot::PictureRows,
    size: Scene::picture_size,
    channels: 4,
    images: |_| 1,
};

#[derive(Clone, Copy, PartialEq)]
enum Sweep {
    Forward,
    Backward,
    Both,
}

impl Images {
    /// Number of dispatches of one time step; half of them work on rows, half on columns.
    pub(super) fn dispatches(&self, scene: &Scene) -> u32 {
        if self.is_hybrid(scene) { 2 } else { 4 }
    }

    /// True if one workgroup solves a row or a column in a single dispatch: parallel cyclic reduction splits it into as many systems as the workgroup
    /// has invocations. Only so does a GPU have work for all its processors. It is done wherever a workgroup's shared memory holds the longest row or
    /// column. Otherwise, by Thomas' algorithm, one invocation solves a row or a column: one dispatch eliminates forwards, another substitutes back.
    /// That is the least work, and fastest on a CPU.
    fn is_hybrid(&self, scene: &Scene) -> bool {
        let chunk = (0..2).map(|axis| self.chunk(scene, axis)).max().unwrap_or(0);
        // An equation has three coefficients and a right side.
        let bytes = 4 * (3 + self.channels) * THREADS * chunk;
        chunk <= MAX_CHUNK && bytes <= scene.device.shared_memory
    }

    /// Unknowns of each invocation of the hybrid solver.
    fn chunk(&self, scene: &Scene, axis: usize) -> u32 {
        (self.size)(scene)[axis].div_ceil(THREADS)
    }

    /// The axis (0 along rows, 1 along columns) of a dispatch, and which sweeps it makes.
    fn turn_of(&self, scene: &Scene, args: &DispatchArgs) -> (usize, Sweep) {
        if self.is_hybrid(scene) {
            return ((args.iteration % 2) as usize, Sweep::Both);
        }
        let sweep = if args.iteration.is_multiple_of(2) { Sweep::Forward } else { Sweep::Backward };
        ((args.iteration % 4 / 2) as usize, sweep)
    }

    pub(super) fn shader(&self, scene: &Scene, args: &DispatchArgs) -> &'static str {
        self.shaders[self.turn_of(scene, args).1 as usize]
    }

    pub(super) fn reads(&self, scene: &Scene, source: Slot, args: &DispatchArgs) -> Vec<Bind> {
        let (axis, sweep) = self.turn_of(scene, args);
        let mut reads = match sweep {
            Sweep::Forward | Sweep::Both => vec![chain_slot("source", source)],
            Sweep::Backward => vec![slices("shares", self.shares), slices("forward", self.forward)],
        };
        reads.extend((axis == 1 && sweep != Sweep::Forward).then_some(slices("rows", self.rows)));
        reads
    }

    pub(super) fn writes(&self, scene: &Scene, target: Bind, args: &DispatchArgs) -> Vec<Bind> {
        match self.turn_of(scene, args) {
            (_, Sweep::Forward) => vec![slices("shares", self.shares), slices("forward", self.forward)],
            (0, _) => vec![slices("target", self.rows)],
            _ => vec![target],
        }
    }

    pub(super) fn extent(&self, scene: &Scene, args: &DispatchArgs) -> [u32; 3] {
        let (axis, sweep) = self.turn_of(scene, args);
        let each = if sweep == Sweep::Both { THREADS } else { 1 };
        [each * (self.size)(scene)[1 - axis], 1, (self.images)(args)]
    }

    pub(super) fn params(&self, scene: &Scene, settings: Option<PeronaMalik>, args: &DispatchArgs) -> Params {
        let p = settings.unwrap_or_default();
        let of_system = || Params::default().f32("edge", storable_edge(p.edge)).f32("tau", p.step);
        match self.turn_of(scene, args).1 {
            Sweep::Forward => of_system(),
            Sweep::Backward => Params::default().i32("slice", args.slice),
            Sweep::Both => of_system().i32("slice", args.slice),
        }
    }

    /// Specialization constants. `extrapolates`: true for the dispatch that ends the two half steps of Richardson's extrapolation, and combines them
    /// with the full step.
    pub(super) fn constants(&self, scene: &Scene, args: &DispatchArgs, extrapolates: bool) -> Vec<(&'static str, i32)> {
        let (axis, sweep) = self.turn_of(scene, args);
        let mut constants = vec![("AXIS", axis as i32)];
        constants.extend((sweep != Sweep::Backward).then(|| constant((self.settings)(scene))));
        constants.extend((sweep != Sweep::Forward).then_some(("RICHARDSON", extrapolates as i32)));
        constants.extend((sweep == Sweep::Both).then(|| ("CHUNK", self.chunk(scene, axis) as i32)));
        constants
    }

    pub(super) fn reference(
        &self,
        scene: &Scene,
        settings: Option<PeronaMalik>,
        args: &DispatchArgs,
        reads: &Arrays,
        writes: &mut Arrays,
    ) {
        let p = settings.unwrap_or_default();
        let (axis, sweep) = self.turn_of(scene, args);
        let size = reads.get(if sweep == Sweep::Backward { "shares" } else { "source" }).size;
        for line in 0..size[1 - axis] {
            let texel = |i: usize| if axis == 0 { [i, line, 0] } else { [line, i, 0] };
            let eliminations: Vec<(f64, Vec<f64>)> = match sweep {
                Sweep::Backward => {
                    let (shares, forward) = (reads.get("shares"), reads.get("forward"));
                    (0..size[axis]).map(|i| (shares.get(texel(i))[0], forward.get(texel(i)).to_vec())).collect()
                }
                Sweep::Forward | Sweep::Both => {
                    let source = reads.get("source");
                    let values: Vec<&[f64]> = (0..size[axis]).map(|i| source.get(texel(i))).collect();
                    let weights: Vec<f64> =
                        values.windows(2).map(|w| 2.0 * p.step * conductance(&p, w[0], w[1])).collect();
                    (0..size[axis]).map(|i| eliminated(&weights, &values, i)).collect()
                }
            };
            if sweep == Sweep::Forward {
                for (i, (share, forward)) in eliminations.iter().enumerate() {
                    writes.get_mut("shares").set(texel(i), &[*share]);
                    writes.get_mut("forward").set(texel(i), forward);
                }
                continue;
            }
            let target = writes.get_mut("target");
            for i in 0..size[axis] {
                // All that later pixels pass on, each through the shares of those between.
                let mut u = vec![0.0; eliminations[i].1.len()];
                let mut through = 1.0;
                for (share, forward) in &eliminations[i..] {
                    u.iter_mut().zip(forward).for_each(|(u, f)| *u += through * f);
                    through *= share;
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
