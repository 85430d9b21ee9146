//! Surface nets on a device: the values of a lattice from the stored samples, and of them the crossed cells and the vertices of a mesh. What
//! follows from signs, the polygons, is for the CPU ([`crate::mesh::polygons`]).
//!
//! No picture needs them, so that they are not in [`PASSES`](super::PASSES): a mesh is exported once. Crossed cells are counted row by row
//! first. The CPU adds the counts up, and each row knows where its cells begin in the list. So the list has the order of the lattice on every
//! device, without atomic operations and without being sorted.

use crate::passes::lookup_tables::floats;
use crate::passes::pass::*;
use crate::probe::StoredType;
use crate::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use crate::scene::{Lattice, Scene};
use glam::DVec3;

/// All of them, in the order in which they run.
pub const NETS: &[Pass] = &[SAMPLE, SMOOTH, SURVEY, FILL, COUNT, CELLS, VERTICES];

/// What stands for a value that is not known: the smallest float.
const UNKNOWN: f64 = -(f32::MAX as f64);
/// Columns of a list: cells and vertices are texels of an image, row by row.
pub const LIST_WIDTH: u32 = 1024;
/// Rows of a list, if a layer has not more cells.
const LIST_ROWS: u32 = 1024;

fn is_known(value: f64) -> bool {
    value > -3.4e38
}

/// Values of a slab of the lattice, trilinear between the stored samples.
pub const SAMPLE: Pass = Pass {
    name: "net_sample",
    stage: Stage::Preprocess,
    frequency: Frequency::Volume,
    link: Link::None,
    shader: |_, _| "net/sample",
    needed: |_| Err("makes a mesh, no picture"),
    reads: |s, _| {
        let mut reads = vec![whole("net_samples", Slot::NetSamples)];
        reads.extend(has_line_table(s).then_some(whole("net_lines", Slot::NetLines)));
        reads.extend(has_slice_table(s).then_some(whole("net_slices", Slot::NetSlices)));
        reads
    },
    writes: |_, _| vec![whole("net_values", Slot::NetValues)],
    extent: |s, _| of(s, Lattice::size),
    repeat: once,
    params: sample_params,
    constants: |s, _| {
        let (sweep, array) = match probe(s).map(|probe| (probe.motion, probe.array)) {
            None => (0, 0),
            Some((motion, array)) => {
                let sweep = match motion {
                    Motion::Fan { .. } => 1,
                    Motion::Translated => 2,
                    Motion::Still { .. } => 3,
                };
                (sweep, i32::from(matches!(array, Array::Curved { .. })))
            }
        };
        vec![
            ("SWEEP", sweep),
            ("ARRAY", array),
            ("LINE_TABLE", has_line_table(s) as i32),
            ("SLICE_TABLE", has_slice_table(s) as i32),
        ]
    },
    tolerance: Tolerance {
        absolute: 2e-4,
        relative: 0.0,
        outliers: 2e-3,
        why: "of samples of 0..1: a place is off by 1e-5 mm in f32 and an angle by 2e-7, so an index by up to 1e-4 of a sample; \
              a place at the border of the insonified region may be on either side of it",
    },
    reference: |scene, _, reads, writes| {
        let Some(lattice) = &scene.lattice else { return };
        let (samples, values) = (reads.get("net_samples"), writes.get_mut("net_values"));
        let (first, scale) = (lattice.stored_slices().0, scale(lattice.stored));
        for_each(values.size, |at| {
            let place = DVec3::from(lattice.grid.origin)
                + DVec3::from(lattice.grid.spacing) * DVec3::new(at[0] as f64, at[1] as f64, (at[2] + first) as f64);
            let index = match &lattice.source {
                Geometry::Sweep(probe) => {
                    let index = probe.to_indices(place);
                    [index.sample, index.line, index.slice]
                }
                Geometry::Cartesian(own) => ((place - DVec3::from(own.origin)) / DVec3::from(own.spacing)).to_array(),
            };
            let last = samples.size.map(|n| (n - 1) as f64);
            let is_inside = (0..3).all(|axis| index[axis] >= -1e-6 && index[axis] <= last[axis] + 1e-6);
            let known = is_inside && at[1] >= lattice.left_out;
            values.set(at, &[if known { samples.trilinear(index) * scale } else { UNKNOWN }]);
        });
    },
};

/// A Gaussian along each axis in turn, over the known values: normalized convolution.
pub const SMOOTH: Pass = Pass {
    name: "net_smooth",
    shader: |_, _| "net/smooth",
    reads: |_, t| vec![whole("source", smoothed(t.iteration)[0])],
    writes: |_, t| vec![whole("target", smoothed(t.iteration)[1])],
    extent: |s, t| {
        let [width, height, slices] = of(s, Lattice::size);
        // The slices around those that are wanted are complete in themselves only.
        [width, height, if t.iteration < 2 { slices } else { wanted(s).1 }]
    },
    repeat: |s| if s.lattice.as_ref().is_some_and(Lattice::is_smoothed) { 3 } else { 0 },
    params: |s, t| {
        let axis = t.iteration as usize;
        let (deviation, reach) = s.lattice.as_ref().map_or((0.0, 0), |l| (l.deviations()[axis], l.reach()[axis]));
        Params::default()
            .i32("reach", reach as u32)
            .f32("narrowness", narrowness(deviation))
            .i32("first_slice", if axis < 2 { 0 } else { wanted(s).0 })
    },
    constants: |_, t| vec![("AXIS", t.iteration as i32)],
    tolerance: Tolerance {
        absolute: 1e-5,
        relative: 2e-6,
        outliers: 0.0,
        why: "a mean in f32: weights to 2e-7 of their value, in a sum of at most 200",
    },
    reference: |scene, args, reads, writes| {
        let Some(lattice) = &scene.lattice else { return };
        let (source, target) = (reads.get("source"), writes.get_mut("target"));
        let axis = args.iteration as usize;
        let (reach, narrowness) = (lattice.reach()[axis] as i64, narrowness(lattice.deviations()[axis]));
        let (first, count) = if axis < 2 { (0, source.size[2] as u32) } else { wanted(scene) };
        for_each(source.size, |at| {
            if at[2] < first as usize || at[2] >= (first + count) as usize {
                return;
            }
            let own = source.one(at[0], at[1], at[2]);
            let (mut sum, mut weights) = (0.0, 0.0);
            for n in -reach..=reach {
                let mut there = at;
                let Some(moved) = at[axis].checked_add_signed(n as isize) else { continue };
                there[axis] = moved;
                if moved < source.size[axis] && is_known(source.one(there[0], there[1], there[2])) {
                    let weight = (-narrowness * (n * n) as f64).exp();
                    sum += weight * source.one(there[0], there[1], there[2]);
                    weights += weight;
                }
            }
            target.set(at, &[if is_known(own) { sum / weights } else { own }]);
        });
    },
    ..SAMPLE
};

/// How deep each column is first inside: how deep a base has to lie.
pub const SURVEY: Pass = Pass {
    name: "net_survey",
    shader: |_, _| "net/survey",
    reads: |s, _| vec![whole("net_values", smooth_values(s))],
    writes: |_, _| vec![whole("net_depths", Slot::NetDepths)],
    extent: |s, _| [of(s, Lattice::size)[0], wanted(s).1, 1],
    repeat: once,
    params: |s, _| threshold(s).i32("first_slice", wanted(s).0),
    constants: no_constants,
    tolerance: Tolerance { absolute: 0.0, relative: 0.0, outliers: 0.0, why: "values are only compared" },
    reference: |scene, _, reads, writes| {
        let (values, depths) = (reads.get("net_values"), writes.get_mut("net_depths"));
        let (first, count) = wanted(scene);
        for_each([values.size[0], count as usize, 1], |[x, z, _]| {
            let is_inside = |y: &usize| values.one(x, *y, z + first as usize) >= inside_from(scene);
            let row = (0..values.size[1]).find(is_inside);
            depths.set([x, z, 0], &[row.map_or(-1.0, |row| row as f64)]);
        });
    },
    ..SAMPLE
};

/// Fills each column behind its first value inside.
pub const FILL: Pass = Pass {
    name: "net_fill",
    shader: |_, _| "net/fill",
    reads: |s, _| vec![whole("source", smooth_values(s))],
    writes: |_, _| vec![whole("net_filled", Slot::NetFilled)],
    extent: |s, _| {
        let [width, _, slices] = of(s, Lattice::size);
        [width, slices, 1]
    },
    repeat: once,
    params: |s, _| threshold(s),
    constants: no_constants,
    tolerance: Tolerance { absolute: 0.0, relative: 0.0, outliers: 0.0, why: "values are only compared and copied" },
    reference: |scene, _, reads, writes| {
        let (source, target) = (reads.get("source"), writes.get_mut("net_filled"));
        let rows = source.size[1];
        for_each([source.size[0], 1, source.size[2]], |[x, _, z]| {
            let first = (0..rows).find(|y| source.one(x, *y, z) >= inside_from(scene));
            for y in 0..target.size[1] {
                let behind = first.filter(|first| y >= *first);
                // The largest value so far, from the first inside on.
                let largest =
                    behind.map(|first| (first..=y.min(rows - 1)).map(|y| source.one(x, y, z)).fold(UNKNOWN, f64::max));
                let own = if y < rows { source.one(x, y, z) } else { UNKNOWN };
                target.set([x, y, z], &[largest.unwrap_or(own)]);
            }
        });
    },
    ..SAMPLE
};

/// Crossed cells of each row of cells.
pub const COUNT: Pass = Pass {
    name: "net_count",
    shader: |_, _| "net/count",
    reads: |s, _| vec![whole("net_values", last_values(s))],
    writes: |_, _| vec![whole("net_counts", Slot::NetCounts)],
    extent: |s, _| {
        let [_, rows, layers] = of(s, Lattice::cells);
        [rows, layers, 1]
    },
    repeat: once,
    params: |s, _| cell_params(s, (0, of(s, Lattice::cells)[2])),
    constants: closed,
    tolerance: Tolerance { absolute: 0.0, relative: 0.0, outliers: 0.0, why: "integers" },
    reference: |scene, _, reads, writes| {
        let (values, counts) = (reads.get("net_values"), writes.get_mut("net_counts"));
        for_each(counts.size, |[row, layer, _]| {
            let count = crossed(scene, values, row, layer).len();
            counts.set([row, layer, 0], &[count as f64]);
        });
    },
    ..SAMPLE
};

/// The crossed cells of some layers, in the order of the lattice.
pub const CELLS: Pass = Pass {
    name: "net_cells",
    shader: |_, _| "net/cells",
    reads: |s, _| {
        vec![
            whole("net_values", last_values(s)),
            whole("net_counts", Slot::NetCounts),
            whole("net_firsts", Slot::NetFirsts),
        ]
    },
    writes: |_, _| vec![whole("net_crossed", Slot::NetCrossed)],
    extent: |s, t| [of(s, Lattice::cells)[1], t.slices, 1],
    params: |s, t| cell_params(s, (t.slice, t.slice + t.slices)),
    reference: |scene, args, reads, writes| {
        let (values, firsts) = (reads.get("net_values"), reads.get("net_firsts"));
        let (counts, list) = (reads.get("net_counts"), writes.get_mut("net_crossed"));
        let layers = args.slice as usize..(args.slice + args.slices) as usize;
        for (layer, row) in layers.flat_map(|layer| (0..firsts.size[0]).map(move |row| (layer, row))) {
            let (first, count) = (firsts.one(row, layer, 0) as usize, counts.one(row, layer, 0) as usize);
            for (n, cell) in crossed(scene, values, row, layer).into_iter().take(count).enumerate() {
                let [x, y] = [(first + n) % list.size[0], (first + n) / list.size[0]];
                list.set([x, y, 0], &cell.map(f64::from));
            }
        }
    },
    ..COUNT
};

/// Where vertices are: the mean of the crossings of some edges of a cell.
pub const VERTICES: Pass = Pass {
    name: "net_vertices",
    shader: |_, _| "net/vertices",
    reads: |s, _| vec![whole("net_values", last_values(s)), whole("net_asked", Slot::NetAsked)],
    writes: |_, _| vec![whole("net_offsets", Slot::NetOffsets)],
    extent: |_, t| [LIST_WIDTH, t.slices, 1],
    params: |s, t| threshold(s).signed("first_layer", of(s, Lattice::first_layer)).i32("rows", t.slices),
    tolerance: Tolerance {
        absolute: 1e-5,
        relative: 0.0,
        outliers: 1e-3,
        why: "voxels: a quotient of differences in f32, whose error grows as the difference of two neighbours falls below 1 % of their values",
    },
    reference: |scene, args, reads, writes| {
        let (values, asked) = (reads.get("net_values"), reads.get("net_asked"));
        let offsets = writes.get_mut("net_offsets");
        for_each([asked.size[0], args.slices as usize, 1], |at| {
            let [cell, edges] = [asked.get(at)[0] as u32, asked.get(at)[1] as u32];
            let [x, row, layer] = [cell & 0xffff, edges & 0xffff, edges >> 16].map(|n| n as usize);
            let corners = corners_of(scene, values, [x, row, layer]);
            let offset = mean_crossing(&corners, inside_from(scene), cell >> 16 & 0xfff);
            offsets.set(at, &[offset.x, offset.y, offset.z, 0.0]);
        });
    },
    ..COUNT
};

/// Where the cells of each row begin in a list, by layer and row, for layers from `first` on; and how many layers of them fit into it, at
/// least one. `counts`: of the rows of all layers.
pub fn firsts(scene: &Scene, counts: &[u32], first: usize) -> (Vec<u32>, usize) {
    let rows = of(scene, Lattice::cells)[1] as usize;
    let room = Slot::NetCrossed.shape(scene).texels();
    let (mut firsts, mut next, mut layers) = (vec![0; counts.len()], 0u64, 0);
    for (n, layer) in counts.chunks(rows.max(1)).enumerate().skip(first) {
        let more: u64 = layer.iter().map(|count| u64::from(*count)).sum();
        if next + more > room {
            break;
        }
        for (first, count) in firsts[n * rows..].iter_mut().zip(layer) {
            *first = next as u32;
            next += u64::from(*count);
        }
        layers += 1;
    }
    (firsts, layers)
}

/// The size of a list: as many rows as it takes, and at least all cells of a layer.
pub(super) fn list(scene: &Scene) -> [u32; 2] {
    let [width, rows, _] = of(scene, Lattice::cells);
    let layer = u64::from(width) * u64::from(rows);
    [LIST_WIDTH, (layer.div_ceil(LIST_WIDTH.into()) as u32).max(LIST_ROWS)]
}

/// Voxels of the slab; one without a lattice.
pub(super) fn values(scene: &Scene) -> [u32; 3] {
    of(scene, Lattice::size)
}

pub(super) fn filled(scene: &Scene) -> [u32; 3] {
    let [width, _, slices] = of(scene, Lattice::size);
    [width, of(scene, Lattice::rows) as u32, slices]
}

pub(super) fn samples(scene: &Scene) -> [u32; 3] {
    of(scene, Lattice::samples)
}

pub(super) fn depths(scene: &Scene) -> [u32; 2] {
    [of(scene, Lattice::size)[0], wanted(scene).1]
}

/// Rows of cells, and layers.
pub(super) fn rows(scene: &Scene) -> [u32; 2] {
    let [_, rows, layers] = of(scene, Lattice::cells);
    [rows, layers]
}

/// Position of each line.
pub(super) fn lines(scene: &Scene) -> Vec<f32> {
    let Some(probe) = probe(scene) else { return Vec::new() };
    floats((0..probe.lines.len()).map(|n| probe.lines.at(n as f64)))
}

/// Position of each slice when its line 0 was acquired, and how far the motor travels during its frame.
pub(super) fn slices_of(scene: &Scene) -> Vec<f32> {
    let Some(probe) = probe(scene) else { return Vec::new() };
    let advance = |k: usize| match &probe.advance {
        Advance::None => 0.0,
        Advance::Same(advance) => *advance,
        Advance::Each(table) => table.get(k).copied().unwrap_or(0.0),
    };
    floats((0..probe.slices.len()).flat_map(|k| [probe.slices.at(k as f64), advance(k)]))
}

/// Entries of these tables.
pub(super) fn table_lengths(scene: &Scene) -> [u32; 2] {
    probe(scene).map_or([1; 2], |probe| [probe.lines.len(), probe.slices.len()].map(|n| n.max(1) as u32))
}

/// A number of the lattice; that of nothing where there is none.
fn of<T: Least>(scene: &Scene, what: fn(&Lattice) -> T) -> T {
    scene.lattice.as_ref().map_or(T::LEAST, what)
}

/// What slots have without a lattice.
trait Least {
    const LEAST: Self;
}

impl Least for [u32; 3] {
    const LEAST: [u32; 3] = [1; 3];
}

impl Least for usize {
    const LEAST: usize = 1;
}

impl Least for i64 {
    const LEAST: i64 = 0;
}

fn probe(scene: &Scene) -> Option<&Probe> {
    match scene.lattice.as_ref().map(|lattice| &lattice.source) {
        Some(Geometry::Sweep(probe)) => Some(probe),
        _ => None,
    }
}

fn has_line_table(scene: &Scene) -> bool {
    probe(scene).is_some_and(|probe| matches!(probe.lines, Axis::Table(_)) && probe.lines.len() > 1)
}

fn has_slice_table(scene: &Scene) -> bool {
    let is_uneven = |p: &Probe| matches!(p.slices, Axis::Table(_)) || matches!(p.advance, Advance::Each(_));
    probe(scene).is_some_and(|probe| is_uneven(probe) && probe.slices.len() > 1)
}

/// Stored value of a texel of 1.
fn scale(stored: StoredType) -> f64 {
    match stored {
        StoredType::U8 => 255.0,
        StoredType::U16 => 65535.0,
        StoredType::F32 => 1.0,
    }
}

fn sample_params(scene: &Scene, _: &DispatchArgs) -> Params {
    let Some(lattice) = &scene.lattice else { return Params::default() };
    let (first, step) = lattice.places();
    let params = Params::default().vec3("first", first).vec3("step", step);
    let numbers = match &lattice.source {
        Geometry::Cartesian(_) => [0.0; 8],
        Geometry::Sweep(probe) => [
            probe.axis_depth(),
            probe.first_range(),
            probe.sample_pitch,
            probe.lines.first(),
            pitch(&probe.lines),
            probe.slices.first(),
            pitch(&probe.slices),
            if let Advance::Same(advance) = probe.advance { advance } else { 0.0 },
        ],
    };
    let names = [
        "axis_depth",
        "first_range",
        "sample_pitch",
        "first_line",
        "line_pitch",
        "first_slice",
        "slice_pitch",
        "advance",
    ];
    let params = names.into_iter().zip(numbers).fold(params, |params, (name, number)| params.f32(name, number));
    let params = params.f32("scale", scale(lattice.stored)).i32("left_out", lattice.left_out as u32);
    let slack = slack(lattice);
    params.i32("first_stored", lattice.stored_slices().0 as u32).vec3("slack", slack)
}

/// How far beyond the outermost samples indices may be by rounding alone: some units in the last place of the places that they follow from.
fn slack(lattice: &Lattice) -> [f64; 3] {
    let places = match &lattice.source {
        Geometry::Cartesian(own) => own.size.map(|n| n as f64),
        Geometry::Sweep(probe) => {
            let of_axis = |axis: &Axis| axis.first().abs().max(axis.last().abs()) / axis.pitch().max(1e-9);
            [probe.last_range() / probe.sample_pitch, of_axis(&probe.lines), of_axis(&probe.slices)]
        }
    };
    places.map(|n| 2e-6 + 4e-7 * n)
}

/// Of a single position, by which nothing is divided, 1.
fn pitch(axis: &Axis) -> f64 {
    match axis {
        Axis::Even { pitch, .. } => *pitch,
        Axis::Table(_) => 1.0,
    }
}

fn narrowness(deviation: f64) -> f64 {
    if deviation > 0.0 { 0.5 / (deviation * deviation) } else { 0.0 }
}

/// What a step of the smoothing reads and writes.
fn smoothed(iteration: u32) -> [Slot; 2] {
    let slots = [Slot::NetValues, Slot::NetSmoothed];
    if iteration.is_multiple_of(2) { slots } else { [slots[1], slots[0]] }
}

/// The values after smoothing.
fn smooth_values(scene: &Scene) -> Slot {
    if scene.lattice.as_ref().is_some_and(Lattice::is_smoothed) { Slot::NetSmoothed } else { Slot::NetValues }
}

/// The values that cells are looked for in.
fn last_values(scene: &Scene) -> Slot {
    let is_filled = scene.lattice.as_ref().is_some_and(|lattice| lattice.filled_rows.is_some());
    if is_filled { Slot::NetFilled } else { smooth_values(scene) }
}

/// The first of the slab's own slices among those that are stored, and their number.
fn wanted(scene: &Scene) -> (u32, u32) {
    scene.lattice.as_ref().map_or((0, 1), |l| ((l.first - l.stored_slices().0) as u32, l.count as u32))
}

/// Values from here on are inside: the least float that is not below the threshold, so that comparisons of stored values, which are floats
/// too, have the result that they have in f64.
fn inside_from(scene: &Scene) -> f64 {
    let threshold = scene.lattice.as_ref().map_or(0.0, |lattice| lattice.threshold);
    let rounded = threshold as f32;
    f64::from(if f64::from(rounded) < threshold { rounded.next_up() } else { rounded })
}

fn threshold(scene: &Scene) -> Params {
    Params::default().f32("threshold", inside_from(scene))
}

/// `layers`: the first, and the one behind the last.
fn cell_params(scene: &Scene, layers: (u32, u32)) -> Params {
    threshold(scene)
        .i32("layer", layers.0)
        .i32("layers", layers.1)
        .signed("first_layer", of(scene, Lattice::first_layer))
}

fn closed(scene: &Scene, _: &Dispatch) -> Vec<(&'static str, i32)> {
    vec![("CLOSED", scene.lattice.as_ref().is_some_and(|lattice| lattice.closed) as i32)]
}

/// The values at the corners of a cell of the slab.
fn corners_of(scene: &Scene, values: &Texels, [x, row, layer]: [usize; 3]) -> [f64; 8] {
    let pad = scene.lattice.as_ref().map_or(0, Lattice::pad) as i64;
    let first = [x as i64 - pad, row as i64 - pad, layer as i64 + of(scene, Lattice::first_layer)];
    std::array::from_fn(|corner| {
        let at: [Option<usize>; 3] = std::array::from_fn(|axis| {
            let at = usize::try_from(first[axis] + (corner >> axis & 1) as i64).ok()?;
            (at < values.size[axis]).then_some(at)
        });
        match at {
            [Some(x), Some(y), Some(z)] => values.one(x, y, z),
            _ => UNKNOWN,
        }
    })
}

/// The mean of the points at which the surface crosses some edges of a cell, a bit for each, from its first corner. Edge 4 a + n runs along axis
/// a; bit 0 of n is its place along axis a + 1 (mod 3), bit 1 along axis a + 2.
fn mean_crossing(corners: &[f64; 8], threshold: f64, edges: u32) -> DVec3 {
    let crossing = |edge: usize| {
        let (axis, place) = (edge / 4, edge % 4);
        let low = (place & 1) << ((axis + 1) % 3) | (place >> 1) << ((axis + 2) % 3);
        let [a, b] = [corners[low], corners[low | 1 << axis]];
        // Of the unknown nothing is known but that the border is between.
        let share = if is_known(a) && is_known(b) { ((threshold - a) / (b - a)).clamp(0.0, 1.0) } else { 0.5 };
        let mut at = DVec3::from([0, 1, 2].map(|axis| (low >> axis & 1) as f64));
        at[axis] = share;
        at
    };
    let crossed: Vec<DVec3> = (0..12).filter(|edge| edges >> edge & 1 == 1).map(crossing).collect();
    crossed.iter().sum::<DVec3>() / crossed.len().max(1) as f64
}

/// The crossed cells of a row, as the list has them: column, corners inside and whether all are known; row and layer.
fn crossed(scene: &Scene, values: &Texels, row: usize, layer: usize) -> Vec<[u32; 2]> {
    let closed = scene.lattice.as_ref().is_some_and(|lattice| lattice.closed);
    let cells = of(scene, Lattice::cells)[0] as usize;
    let cell = |x: usize| {
        let corners = corners_of(scene, values, [x, row, layer]);
        let bits = corners.iter().enumerate().filter(|(_, value)| **value >= inside_from(scene));
        let inside = bits.fold(0u32, |bits, (n, _)| bits | 1 << n);
        let known = closed || corners.iter().all(|value| is_known(*value));
        let listed = [x as u32 | inside << 16 | u32::from(known) << 24, row as u32 | (layer as u32) << 16];
        (inside != 0 && inside != 255).then_some(listed)
    };
    (0..cells).filter_map(cell).collect()
}

fn for_each(size: [usize; 3], mut work: impl FnMut([usize; 3])) {
    for z in 0..size[2] {
        for y in 0..size[1] {
            (0..size[0]).for_each(|x| work([x, y, z]));
        }
    }
}
