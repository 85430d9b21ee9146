//! Tables that the CPU computes from the scene in f64, so that shaders need not compute them for every sample.

use crate::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use crate::scene::{Bricks, Reach, Scene, Side, self_attenuation, transfer};
use rayon::prelude::*;

pub(super) fn floats(values: impl IntoIterator<Item = f64>) -> Vec<f32> {
    values.into_iter().map(|v| v as f32).collect()
}

/// The fractional (sample, line) of every slice pixel, row by row, for scan conversion; (-1, -1) where a pixel is left out. Pixels outside the sector
/// are left out unless they are within the apron around it (`Scene::apron`, slice pixels). With an apron of 0 the rule of the PLUS toolkit applies:
/// both neighbours must exist in both directions, so that the last sample and line are left out. Empty for a Cartesian volume.
pub fn scan_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let [width, height] = scene.grid.size;
    let mut lut = Vec::with_capacity(2 * width as usize * height as usize);
    for (column, row) in (0..height).flat_map(|row| (0..width).map(move |column| (column, row))) {
        let (x, y) = scene.grid.place(f64::from(column), f64::from(row));
        let (sample, line) = scan_index(scene, probe, x, y).unwrap_or((-1.0, -1.0));
        lut.extend([sample as f32, line as f32]);
    }
    lut
}

/// Gain of every sample of a line: a factor for linear envelopes, an addend in sample values (0..1 is their full range) for log-compressed samples.
/// Empty for a Cartesian volume.
pub fn tgc(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let c = &scene.settings.conditioning;
    floats((0..probe.samples).map(|i| {
        let gain = c.gain(probe.start_depth + probe.sample_pitch * i as f64);
        if c.dynamic_range.is_some() { 10f64.powf(gain / 20.0) } else { gain / c.compressed_range }
    }))
}

/// Fractional (sample, line) that a slice pixel shows. (x, y) is its place in the coordinates of [`SliceGrid`](crate::scene::SliceGrid), mm. None
/// where [`scan_lut`] leaves the pixel out. Samples are counted after decimation: with the factor M, sample j is sample j M of the frame. With an
/// apron, pixels beyond the last sample take the last.
pub fn scan_index(scene: &Scene, probe: &Probe, x: f64, y: f64) -> Option<(f64, f64)> {
    let (sample, line) = probe.plane_indices(x, y);
    let factor = f64::from(scene.decimation());
    let kept = factor * f64::from(scene.line_lattice()[0] - 1);
    let (last_sample, last_line) = ((probe.samples - 1) as f64, (probe.lines.len() - 1) as f64);
    if scene.apron <= 0.0 {
        let inside = sample >= 0.0 && sample < kept && line >= 0.0 && line < last_line;
        return inside.then_some((sample / factor, line));
    }
    let (near_sample, near_line) = (sample.clamp(0.0, last_sample), line.clamp(0.0, last_line));
    let (near_x, near_y) = probe.plane_point(near_sample, near_line);
    let [px, py] = scene.grid.pitch;
    let away = ((x - near_x) / px).hypot((y - near_y) / py);
    (away <= scene.apron).then_some((near_sample.min(kept) / factor, near_line))
}

/// The abscissa of a look-up table over positions: the tangent of a `parts`-th of an angle (rad), or without `parts` the position itself, mm.
fn abscissa(parts: Option<f64>, position: f64) -> f64 {
    parts.map_or(position, |parts| (position / parts).tan())
}

/// The opposite of [`abscissa`].
fn position(parts: Option<f64>, abscissa: f64) -> f64 {
    parts.map_or(abscissa, |parts| parts * abscissa.atan())
}

/// By what an angle about the wobble axis is divided before its tangent is taken. None where positions are mm: translated or still motion.
fn sweep_parts(probe: &Probe) -> Option<f64> {
    matches!(probe.motion, Motion::Fan { .. }).then_some(2.0)
}

/// By what the in-plane angle of a curved array is divided before its tangent is taken: 2, and 4 for a radial probe, because the tangent of half the
/// angle has no bound towards 180 degrees. None for a linear array, whose positions are mm.
fn line_parts(probe: &Probe) -> Option<f64> {
    let is_curved = matches!(probe.array, Array::Curved { .. });
    is_curved.then(|| if probe.is_radial() { 4.0 } else { 2.0 })
}

/// Lowest and highest abscissa of the line look-up table.
pub(super) fn line_span(probe: &Probe) -> (f64, f64) {
    let of = |position: f64| abscissa(line_parts(probe), position);
    (of(probe.lines.first()), of(probe.lines.last()))
}

/// Lowest and highest abscissa of the sweep look-up table.
pub(super) fn sweep_span(probe: &Probe) -> (f64, f64) {
    let (first, last) = probe.slice_bounds();
    (abscissa(sweep_parts(probe), first), abscissa(sweep_parts(probe), last))
}

/// The interval of the sweep table's abscissa that shaders take as inside the sweep. It is a little wider than the outermost slices, since rounding
/// may move places on them outside.
pub(super) fn sweep_border(probe: &Probe) -> [f64; 2] {
    let ((first, last), margin) = (probe.slice_bounds(), 1e-4 * probe.slices.pitch());
    [first - margin, last + margin].map(|position| abscissa(sweep_parts(probe), position))
}

/// Position in the sweep, in mean slice pitches from slice 0, at `ray.entries` equidistant abscissae between the bounds of the slice positions
/// ([`Probe::slice_bounds`]), both included. The abscissa is the tangent of half the angle of a fan, otherwise mm. If slices are equidistant and the
/// motor stands still during a frame, the position is the fractional slice index. For other slices, [`slice_table`] has the position of each. Empty
/// for a Cartesian volume.
pub fn sweep_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let positions = equidistant(scene, sweep_span(probe)).map(|at| position(sweep_parts(probe), at));
    floats(positions.map(|position| (position - probe.slices.first()) / probe.slices.pitch()))
}

/// `ray.entries` equidistant abscissae, both ends included.
fn equidistant(scene: &Scene, (low, high): (f64, f64)) -> impl Iterator<Item = f64> {
    let entries = scene.settings.ray.entries;
    (0..entries).map(move |i| low + (high - low) * f64::from(i) / f64::from(entries - 1))
}

/// Fractional line index divided by the number of lines, which is the share of the frame that was acquired before the line. It is given at
/// `ray.entries` equidistant abscissae from the first line to the last: the tangent of half the line's angle (of a quarter for a radial probe), or mm
/// for a linear array. Empty for a Cartesian volume.
pub fn line_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let positions = equidistant(scene, line_span(probe)).map(|at| position(line_parts(probe), at));
    floats(positions.map(|position| probe.lines.index_of(position) / probe.lines.len() as f64))
}

/// For every slice two values: its position from slice 0, and the motor's travel during its frame ([`Advance`]), both in mean slice pitches. Empty
/// for a Cartesian volume.
pub fn slice_table(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let pitch = probe.slices.pitch();
    floats(
        (0..probe.slices.len())
            .flat_map(|k| [(probe.slices.at(k as f64) - probe.slices.first()) / pitch, probe.advance_of(k) / pitch]),
    )
}

/// True if slices have non-uniform positions or are swept in mixed directions, so that shaders search for the slice at a position.
pub(super) fn is_non_uniform(geometry: &Geometry) -> bool {
    match geometry {
        Geometry::Sweep(p) => matches!(p.slices, Axis::Table(_)) || matches!(p.advance, Advance::Each(_)),
        Geometry::Cartesian(_) => false,
    }
}

/// The transfer function at [`Scene::transfer_entries`] equidistant windowed sample values from 0 to 1. Each entry has four values: red, green, blue
/// (0..1) and the optical depth (0 or more) of [`Scene::reference_length`].
pub fn transfer_table(scene: &Scene) -> Vec<f32> {
    floats(transfer_of(scene).into_iter().flatten())
}

/// For each entry of the transfer function, the integrals over the sample value from 0 up to it: of absorption times colour (3 channels) and of
/// absorption. Between two entries colour and absorption are linear.
pub(crate) fn transfer_integral(scene: &Scene) -> Vec<f32> {
    let entries = transfer_of(scene);
    let width = 1.0 / (entries.len() - 1) as f64;
    let mut sum = [0.0; 4];
    let mut sums = vec![sum];
    for pair in entries.windows(2) {
        let part = transfer_integral_within(pair[0], pair[1], 1.0);
        sum = std::array::from_fn(|c| sum[c] + width * part[c]);
        sums.push(sum);
    }
    floats(sums.into_iter().flatten())
}

/// The integrals of absorption times colour (3 channels) and of absorption over a `share` (0..1) of the way from entry `low` to the next entry
/// `high`. The distance between two entries counts as 1.
pub(super) fn transfer_integral_within(low: [f64; 4], high: [f64; 4], share: f64) -> [f64; 4] {
    let rise: [f64; 4] = std::array::from_fn(|c| high[c] - low[c]);
    let (t, kappa) = (share, low[3]);
    std::array::from_fn(|c| match c {
        3 => t * (kappa + 0.5 * t * rise[3]),
        _ => t * (kappa * low[c] + 0.5 * t * (kappa * rise[c] + rise[3] * low[c]) + t * t / 3.0 * rise[3] * rise[c]),
    })
}

/// For each entry of the transfer function the number of entries before it that are not transparent. One more value follows at the end: the number of
/// all entries that are not transparent.
pub fn opaque_before(scene: &Scene) -> Vec<f32> {
    let absorption: Vec<f32> = transfer_table(scene).chunks_exact(4).map(|entry| entry[3]).collect();
    let mut before = vec![0.0];
    before.extend(absorption.iter().scan(0.0, |count, a| {
        *count += if *a > 0.0 { 1.0 } else { 0.0 };
        Some(*count)
    }));
    before
}

/// Table over the sample values at the begin and the end of a step, with the value at the end fastest: mean colour and absorption of the step
/// ([`transfer::pre_integrated`]).
pub fn pre_integrated_table(scene: &Scene) -> Vec<f32> {
    floats(transfer::pre_integrated(&transfer_of(scene)).into_iter().flatten())
}

/// Table over the sample values at the begin and the end of a step of the scene's length: premultiplied light and opacity of the step. Behind it
/// follows the transfer function itself.
pub(crate) fn self_attenuated_table(scene: &Scene) -> Vec<f32> {
    let (table, length) = (transfer_of(scene), scene.optical_step());
    let rows = (0..table.len()).into_par_iter().flat_map_iter(|front| self_attenuation::row(&table, front, length));
    let mut steps: Vec<f32> = rows.flatten_iter().map(|v| v as f32).collect();
    steps.extend(floats(table.iter().flatten().copied()));
    steps
}

/// Red, green, blue and absorption at equidistant windowed sample values: [`transfer_table`] in f64.
pub(super) fn transfer_of(scene: &Scene) -> Vec<[f64; 4]> {
    transfer::table_of(&scene.settings.volume, scene.reference_length(), scene.transfer_entries())
}

/// The medium of a still at equidistant windowed sample values: albedo of red, green and blue, and extinction, 1/mm.
pub(super) fn still_medium(scene: &Scene) -> Vec<f32> {
    floats(scene.still_medium(&transfer_of(scene)).into_iter().flatten())
}

/// The tiles of a picture of planes as shaders read them (`Tiling::table`), relative to [`Scene::local_origin`].
pub(super) fn tile_table(scene: &Scene) -> Vec<f32> {
    let mut tiling = scene.tiling();
    for tile in &mut tiling.tiles {
        tile.plane.at = scene.to_local(tile.plane.at);
        tile.crossed_by.iter_mut().for_each(|(plane, _)| plane.at = scene.to_local(plane.at));
    }
    floats(tiling.table(scene.settings.planes.thickness))
}

/// The columns of a curved plane as shaders read them (`Tiling::column_table`), relative to [`Scene::local_origin`].
pub(super) fn curve_table(scene: &Scene) -> Vec<f32> {
    let mut tiling = scene.tiling();
    if let Some(section) = tiling.tiles.last_mut().and_then(|tile| tile.section.as_mut()) {
        section.origin = scene.to_local(section.origin);
    }
    floats(tiling.column_table(scene.settings.planes.thickness))
}

/// The label of each voxel of the box that holds all labels, divided by 255; x fastest.
pub(super) fn label_ids(scene: &Scene) -> Vec<f32> {
    shares(scene.labels().map_or(&[0], |labels| &labels.ids))
}

/// For each voxel of the box that holds all labels, x fastest: the share (0..1) of its surroundings that has a label.
pub(super) fn label_cover(scene: &Scene) -> Vec<f32> {
    shares(scene.labels().map_or(&[0], |labels| &labels.cover))
}

fn shares(bytes: &[u8]) -> Vec<f32> {
    bytes.iter().map(|byte| f32::from(*byte) / 255.0).collect()
}

/// The colour of each of 256 labels: red, green and blue in 0..1, and 1. Labels without a colour have four zeros.
pub(super) fn label_colours(scene: &Scene) -> Vec<f32> {
    let colours = scene.labels().map_or(&[][..], |labels| &labels.colours);
    let entry = |n: usize| colours.get(n).map_or([0.0; 4], |[r, g, b]| [*r as f32, *g as f32, *b as f32, 1.0]);
    (0..256).flat_map(entry).collect()
}

/// True if two scenes show other labels.
pub(super) fn labels_differ(old: &Scene, new: &Scene) -> bool {
    old.labels().is_some() != new.labels().is_some() || old.settings.labels.volume != new.settings.labels.volume
}

/// The half-spaces of the block of mode cube, four floats each: the outward normal n and the limit w of dot(n, p) <= w, for p relative to
/// [`Scene::local_origin`], mm.
pub(super) fn block_table(scene: &Scene) -> Vec<f32> {
    let block = scene.block();
    floats(block.iter().flat_map(|f| f.normal.extend(scene.limit_to_local(f.normal, f.limit)).to_array()))
}

/// For each brick the texels that samples in it may touch; bricks are in the order x fastest, then y.
pub(super) fn brick_reaches(scene: &Scene, bricks: &Bricks) -> Vec<Reach> {
    let [width, height, _] = bricks.count.map(u64::from);
    let cell = |n: u64| [n % width, n / width % height, n / (width * height)].map(|n| n as u32);
    (0..bricks.total()).into_par_iter().map(|n| scene.reach(bricks, cell(n))).collect()
}

fn side_code(side: Side) -> u32 {
    match side {
        Side::Outside => 0,
        Side::Across => 1,
        Side::Inside => 2,
    }
}

/// The table of bricks (cubes in space that rays may skip) for shaders, x fastest, then y. Each brick has four floats: the ranges of tile columns,
/// tile rows and slices that its samples may touch, and its [`Side`] as a number (0 outside, 1 across, 2 inside). A range with both ends included is
/// packed as first * 4096 + last, exact in f32. The slices of a brick outside are 0 to 4095.
pub fn brick_table(scene: &Scene) -> Vec<f32> {
    let packed = |[first, last]: [u32; 2]| (first * 4096 + last) as f32;
    let entry = |reach: &Reach| {
        let [columns, rows] = reach.tiles;
        // Bricks outside depend on no slice, and are written whichever slice is new.
        let slices = if reach.side == Side::Outside { [0, 4095] } else { reach.slices };
        [packed(columns), packed(rows), packed(slices), side_code(reach.side) as f32]
    };
    brick_reaches(scene, &scene.bricks()).iter().flat_map(entry).collect()
}
