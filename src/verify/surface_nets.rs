//! Group "surface nets": the passes that make meshes, which no picture needs. Each pass alone against its f64 reference, on noise, in every
//! geometry, closed, open, smoothed, filled and in slabs; and the mesh of a ball against formulas and against that of the CPU.
//!
//! The inputs of a pass are the outputs of the references before it, so that errors do not accumulate.

use super::built_in::{Noise, geometries};
use super::compare::{ExtraTolerance, compare_outputs, count_figure};
use super::each_pass::{DispatchComparison, POISON, PassSummary};
use super::report::{Figure, Level, Unit};
use super::{Check, DeviceUnderTest, Findings};
use crate::gpu::GpuError;
use crate::gpu::pass_runner::PassRunner;
use crate::gpu::surface_net::{NetError, SurfaceNet};
use crate::mesh::Mesh;
use crate::mesh::nets::{Surface, surface_net};
use crate::passes::net::{self, NETS};
use crate::passes::{Arrays, DispatchArgs, Pass, Slot, Texels};
use crate::probe::{Geometry, Grid};
use crate::scene::{Lattice, Scene};
use crate::source::StoredType;
use crate::source::convert::lattice;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::f64::consts::PI;

/// Rows of a list that the dispatch of vertices fills.
const LIST_ROWS: u32 = 48;

/// One check per pass, and a ball.
pub fn checks(_: Level) -> Vec<Check> {
    let passes = NETS.iter().map(|pass| Check::new("surface nets", pass.name, move |dut| check(dut, pass)));
    passes.chain([Check::new("surface nets", "a ball", ball)]).collect()
}

/// All of a lattice of voxels of a geometry's samples: closed, not smoothed, not filled.
pub fn whole(source: Geometry, stored: StoredType, grid: Grid, threshold: f64) -> Lattice {
    Lattice {
        source,
        stored,
        grid,
        deviation: 0.0,
        threshold,
        closed: true,
        left_out: 0,
        filled_rows: None,
        most: Lattice::MOST,
        first: 0,
        count: grid.size[2],
    }
}

/// Lattices by name that together need every pipeline of the passes.
///
/// # Errors
/// A lattice that is refused.
fn scenes() -> Result<Vec<(String, Scene)>, String> {
    let mut scenes = Vec::new();
    let mut add = |name: String, lattice: Lattice| {
        let scene = lattice.scene().map_err(|error| format!("{name}: {error}"))?;
        scenes.push((name, scene));
        Ok::<(), String>(())
    };
    for (name, geometry) in geometries() {
        let (low, high) = match &geometry {
            Geometry::Sweep(probe) => probe.bounds(),
            Geometry::Cartesian(grid) => {
                let last = DVec3::from_array(grid.size.map(|n| (n - 1) as f64)) * DVec3::from(grid.spacing);
                (DVec3::from(grid.origin), DVec3::from(grid.origin) + last)
            }
        };
        let spacing = (high - low).max_element() / 37.0;
        let grid = lattice(&geometry, spacing)?;
        let all = whole(geometry, StoredType::F32, grid, 0.5);
        add(format!("{name}, closed"), all.clone())?;
        let more = Lattice {
            deviation: 1.3 * spacing,
            closed: false,
            left_out: 3,
            filled_rows: Some(grid.size[1] + 5),
            ..all
        };
        add(format!("{name}, smoothed and filled"), more.clone())?;
        if grid.size[2] > 8 {
            add(format!("{name}, a slab"), more.slab((grid.size[2] / 2 - 1, 3)))?;
        }
    }
    Ok(scenes)
}

fn check(dut: &mut DeviceUnderTest, pass: &'static Pass) -> Result<Findings, GpuError> {
    let (mut sum, mut variants) = (PassSummary::default(), HashSet::new());
    for (name, scene) in scenes().map_err(GpuError::Broken)? {
        if (pass.repeat)(&scene) == 0 || !is_needed(pass, &scene) {
            continue;
        }
        // At the quick level every pipeline once.
        let is_new = variants.insert(variant(&scene, pass));
        if dut.level == Level::Quick && !is_new {
            continue;
        }
        for (iteration, result) in compare(dut.pass_runner(), &scene, pass)? {
            sum.record(pass, &name, iteration, "noise", &result);
        }
    }
    Ok(sum.into_findings(pass))
}

fn is_needed(pass: &Pass, scene: &Scene) -> bool {
    pass.name != net::FILL.name || scene.lattice.as_ref().is_some_and(|lattice| lattice.filled_rows.is_some())
}

fn variant(scene: &Scene, pass: &Pass) -> (Vec<(&'static str, i32)>, Vec<&'static str>) {
    let args = DispatchArgs::default();
    (pass.constants(scene, &args), pass.reads(scene, &args).iter().map(|bind| bind.name).collect())
}

/// Every iteration of a pass in a scene, on the outputs of the references before it, next to its own reference.
///
/// # Errors
/// A device that fails.
pub fn compare(
    runner: &mut PassRunner,
    scene: &Scene,
    wanted: &'static Pass,
) -> Result<Vec<(u32, DispatchComparison)>, GpuError> {
    let layers = scene.lattice.as_ref().map_or(1, |lattice| lattice.cells()[2]);
    let (mut noise, mut compared) = (Noise(7), Vec::new());
    let mut samples = Texels::from_fn(Slot::NetSamples.shape(scene).size(), 1, |_, _| 0.0);
    samples.values.fill_with(|| noise.next());
    let mut slots = BTreeMap::from([(Slot::NetSamples, samples)]);
    for pass in NETS.iter().filter(|pass| is_needed(pass, scene)) {
        for iteration in 0..(pass.repeat)(scene) {
            let mut args = DispatchArgs { iteration, ..DispatchArgs::default() };
            if pass.name == net::CELLS.name {
                // Neither the first layer nor the last.
                args = DispatchArgs { slice: 1, slices: (layers - 1).min(layers.max(3) - 2), ..args };
                slots.insert(Slot::NetFirsts, firsts(scene, &slots[&Slot::NetCounts]));
            }
            if pass.name == net::VERTICES.name {
                args.slices = LIST_ROWS;
                slots.insert(Slot::NetAsked, asked(scene, &slots[&Slot::NetCrossed]));
            }
            let mut inputs = Arrays::default();
            for bind in pass.reads(scene, &args) {
                if let Some(texels) = slots.get(&bind.slot) {
                    // What the format stores, for both.
                    let format = bind.slot.format(scene);
                    inputs.insert(bind.name, Texels::decode(texels.size, format, &texels.encode(format)));
                }
            }
            let writes = pass.writes(scene, &args);
            let mut expected = Arrays::default();
            for bind in &writes {
                let channels = bind.slot.format(scene).channels();
                expected.insert(bind.name, Texels::untouched(bind.slot.array_size(scene), channels));
            }
            pass.reference(scene, &args, &inputs, &mut expected);
            for bind in &writes {
                let texels = expected.get(bind.name).clone();
                let known = texels.values.iter().map(|v| if v.is_nan() { 0.0 } else { *v }).collect();
                slots.insert(bind.slot, Texels { values: known, ..texels });
            }
            if pass.name == wanted.name {
                let got = runner.run(scene, pass, &args, &inputs, poison(pass))?;
                let extra = ExtraTolerance::default();
                let comparison = compare_outputs(pass, scene, extra, poison(pass), &expected, &got, &writes);
                compared.push((iteration, DispatchComparison { inputs, expected, got, writes, comparison }));
            }
        }
        if pass.name == wanted.name {
            break;
        }
    }
    Ok(compared)
}

/// Integers cannot hold every number.
fn poison(pass: &Pass) -> f64 {
    if [net::COUNT.name, net::CELLS.name].contains(&pass.name) { 77.0 } else { POISON }
}

/// Where the cells of each row begin, from the second layer on.
fn firsts(scene: &Scene, counts: &Texels) -> Texels {
    let counts: Vec<u32> = counts.values.iter().map(|n| *n as u32).collect();
    let (firsts, _) = net::firsts(scene, &counts, 1);
    let size = Slot::NetFirsts.shape(scene).size();
    Texels::from_fn(size, 1, |[x, y, _], _| f64::from(firsts[y * size[0] + x]))
}

/// The crossed edges of listed cells.
fn asked(scene: &Scene, crossed: &Texels) -> Texels {
    let size = Slot::NetAsked.shape(scene).size();
    let mut asked = Texels::from_fn(size, 2, |_, _| 0.0);
    for (n, cell) in crossed.values.chunks_exact(2).enumerate().take(LIST_ROWS as usize * size[0]) {
        let (column, inside) = (cell[0] as u32 & 0xffff, cell[0] as u32 >> 16 & 0xff);
        let corner = |edge: u32| {
            let axis = edge / 4;
            (edge & 1) << ((axis + 1) % 3) | (edge >> 1 & 1) << ((axis + 2) % 3)
        };
        let is_crossed = |edge: &u32| {
            let low = corner(*edge);
            (inside >> low ^ inside >> (low | 1 << (edge / 4))) & 1 == 1
        };
        let edges = (0..12).filter(is_crossed).fold(0, |bits, edge| bits | 1 << edge);
        asked.values[2 * n] = f64::from(column | edges << 16);
        asked.values[2 * n + 1] = cell[1];
    }
    asked
}

/// A ball whose values are distances from its surface. Bounds in closed form, and the mesh of the CPU.
fn ball(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    const VOXELS: usize = 25;
    const RADIUS: f64 = 0.8;
    let h = 2.0 / (VOXELS - 1) as f64;
    let centre = DVec3::new(0.97, 1.02, 1.01);
    let grid = Grid { size: [VOXELS; 3], spacing: [h; 3], origin: [0.0; 3] };
    let value = |at: DVec3| f64::from((RADIUS - (at * h).distance(centre)) as f32);
    let place = |n: usize, z: usize| DVec3::new((n % VOXELS) as f64, (n / VOXELS) as f64, z as f64);
    let slice = |z: usize| (0..VOXELS * VOXELS).map(move |n| value(place(n, z)));
    let frames: Vec<Vec<u8>> =
        (0..VOXELS).map(|z| slice(z).flat_map(|value| (value as f32).to_le_bytes()).collect()).collect();
    let lattice = whole(Geometry::Cartesian(grid), StoredType::F32, grid, 0.0);
    let made = SurfaceNet::new(&dut.context, lattice, &frames)
        .and_then(|mut net| net.mesh(None, |at| at * h, || ()))
        .map_err(|error| match error {
        NetError::Device(error) => error,
        NetError::Mesh(fault) => GpuError::Broken(fault),
    })?;
    let surface = Surface { threshold: 0.0, closed: true };
    let fill = |z: usize, out: &mut [f64]| {
        out.iter_mut().zip(slice(z)).for_each(|(out, value)| *out = value);
        Ok::<(), String>(())
    };
    let expected = surface_net([VOXELS; 3], surface, fill, |at| at * h).map_err(GpuError::Broken)?;

    let mut findings = Findings::default();
    // Nothing of the mesh lies deeper below the ball: src/core/mesh/nets.rs has the derivation.
    let share = 2.0 * h * h / (RADIUS * RADIUS);
    let (volume, area) = (4.0 / 3.0 * PI * RADIUS.powi(3), 4.0 * PI * RADIUS * RADIUS);
    let open = open_edges(&made);
    findings.figures.push(count_figure("open edges", open));
    findings
        .expect(open == 0, || format!("{open} edges without two triangles that run along them in opposite directions"));
    let missing = (1.0 - made.volume() / volume).abs();
    findings.error(Figure::error("missing volume", missing, 3.0 * share, Unit::Share), || {
        format!("the volume is {:.6} of {volume:.6}", made.volume())
    });
    let missing = (1.0 - made.area() / area).abs();
    findings.error(Figure::error("missing area", missing, 2.0 * share, Unit::Share), || {
        format!("the area is {:.6} of {area:.6}", made.area())
    });
    let is_same = made.vertices.len() == expected.vertices.len() && made.triangles.len() == expected.triangles.len();
    findings.expect(is_same, || {
        let [made, expected] = [&made, &expected].map(|m| [m.vertices.len(), m.triangles.len()]);
        format!("{made:?} vertices and triangles, the CPU makes {expected:?}")
    });
    let apart = made.vertices.iter().zip(&expected.vertices).map(|(a, b)| a.distance(*b) / h).fold(0.0, f64::max);
    findings.error(Figure::error("from the CPU's vertices, voxels", apart, 1e-5, Unit::Value), || {
        format!("a vertex is {apart:.2e} voxels from where the CPU puts it")
    });
    Ok(findings)
}

/// Edges that do not belong to two triangles that run along them in opposite directions.
fn open_edges(mesh: &Mesh) -> usize {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for [a, b, c] in mesh.triangles.iter().copied() {
        [(a, b), (b, c), (c, a)].into_iter().for_each(|edge| *edges.entry(edge).or_default() += 1);
    }
    edges.iter().filter(|((a, b), n)| **n != 1 || edges.get(&(*b, *a)) != Some(&1)).count()
}
