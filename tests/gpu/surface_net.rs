//! Meshes made on a device: each pass against its reference, whole meshes against shapes in closed form, and against those of the CPU.

use crate::common::gpu::*;
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::gpu::surface_net::{NetError, SurfaceNet};
use echolume::low_level::gpu::{Bands, ContextOptions};
use echolume::low_level::mesh::Mesh;
use echolume::low_level::mesh::base::Base;
use echolume::low_level::mesh::nets::{Surface, surface_net};
use echolume::low_level::mesh::smooth::Smoother;
use echolume::low_level::passes::fault_injection::Change;
use echolume::low_level::passes::net::{self, NETS};
use echolume::low_level::passes::{Arrays, DispatchArgs, Slot, Texels};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::default_look::{block_edge, smoothing};
use echolume::low_level::scene::{EchoHistogram, Lattice};
use echolume::low_level::source::convert::{Volume, lattice};
use echolume::low_level::source::phantom::{Phantom, PhantomOptions};
use echolume::low_level::source::{Frame, StoredType};
use echolume::low_level::verify::report::Level;
use echolume::low_level::verify::surface_nets::whole;
use echolume::low_level::verify::{self, DeviceUnderTest};
use glam::{DVec3, I64Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::atomic::Ordering;

/// A Cartesian volume of a function of the voxel, as floats, on its own lattice. Its frames.
fn volume(size: [usize; 3], h: f64, value: impl Fn(DVec3) -> f64) -> (Lattice, Vec<Vec<u8>>) {
    let grid = Grid { size, spacing: [h; 3], origin: [-3.0, 2.0, 7.0] };
    let frame = |z: usize| -> Vec<u8> {
        let voxels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| DVec3::new(x as f64, y as f64, z as f64)));
        voxels.flat_map(|at| (value(at) as f32).to_le_bytes()).collect()
    };
    (whole(Geometry::Cartesian(grid), StoredType::F32, grid, 0.0), (0..size[2]).map(frame).collect())
}

fn on_device(device: &Device, lattice: &Lattice, frames: &[Vec<u8>], base: Option<usize>) -> Mesh {
    let mut net = SurfaceNet::new(device, lattice.clone(), frames).expect("a device that can");
    let filled = base.map(|rows| net.deepest(|| ()).expect("a survey").expect("something is inside") + 1 + rows);
    net.mesh(filled, |at| place(lattice, at), || ()).expect("a mesh")
}

/// The same on the CPU in f64.
fn on_cpu(lattice: &Lattice, frames: &[Vec<u8>], base: Option<usize>) -> Mesh {
    let volume = volume_of(lattice, frames);
    let grid = &lattice.grid;
    let reader = || {
        let mut smoother = Smoother::new(grid.size, grid.spacing, lattice.deviation);
        let (volume, above) = (&volume, lattice.left_out * grid.size[0]);
        move |z: usize, out: &mut [f64]| {
            smoother.slice(z, out, |z, out| {
                volume.slice(grid, z, out);
                out[..above].fill(f64::NAN);
            });
        }
    };
    let surface = Surface { threshold: lattice.threshold, closed: lattice.closed };
    let mut own = vec![0.0; grid.size[0] * grid.size[1]];
    let (mut size, mut filler) = (grid.size, Base::new(grid.size[0], lattice.threshold));
    if let Some(rows) = base {
        let mut read = reader();
        for z in 0..size[2] {
            read(z, &mut own);
            filler.survey(&own);
        }
        size[1] = filler.deepest().expect("something is inside") + 1 + rows;
    }
    let mut read = reader();
    let slice = |z: usize, out: &mut [f64]| {
        if base.is_some() {
            read(z, &mut own);
            filler.fill(&own, out);
        } else {
            read(z, out);
        }
        Ok::<(), String>(())
    };
    surface_net(size, surface, slice, |at| place(lattice, at)).expect("a mesh")
}

fn volume_of(lattice: &Lattice, frames: &[Vec<u8>]) -> Volume {
    let mut volume = Volume::new(lattice.source.clone(), lattice.stored);
    for (slice, bytes) in frames.iter().enumerate() {
        volume.take(Frame::of_slice(0, slice, bytes.clone()));
    }
    volume
}

fn place(lattice: &Lattice, at: DVec3) -> DVec3 {
    DVec3::from(lattice.grid.origin) + at * DVec3::from(lattice.grid.spacing)
}

/// Checks that every edge belongs to two triangles that run along it in opposite directions. Returns the Euler characteristic.
fn watertight(mesh: &Mesh) -> i64 {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for [a, b, c] in mesh.triangles.iter().copied() {
        [(a, b), (b, c), (c, a)].into_iter().for_each(|edge| *edges.entry(edge).or_default() += 1);
    }
    assert!(edges.iter().all(|((a, b), n)| *n == 1 && edges.get(&(*b, *a)) == Some(&1)), "an open or doubled edge");
    mesh.vertices.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64
}

/// Two meshes with the same triangles, but for the diagonals of quadrangles that are about equal, and vertices at most `far` apart.
fn same(a: &Mesh, b: &Mesh, far: f64, name: &str) {
    assert_eq!(a.vertices.len(), b.vertices.len(), "vertices of {name}");
    assert_eq!((a.triangles.len(), a.open_edges), (b.triangles.len(), b.open_edges), "{name}");
    let worst = a.vertices.iter().zip(&b.vertices).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    let turned = a.triangles.iter().zip(&b.triangles).filter(|(a, b)| a != b).count();
    println!("{name}: {} triangles, {turned} turned, vertices at most {worst:.2e} mm apart", a.triangles.len());
    assert!(worst <= far, "{name}: vertices {worst} mm apart");
    assert!(turned * 100 <= a.triangles.len(), "{name}: {turned} of {} triangles", a.triangles.len());
}

/// The checks of `echolume verify --full`: every pass in every geometry, and a ball.
#[test]
fn every_pass_of_a_mesh_matches_its_reference() {
    let device = Device::new();
    println!("device: {}", device.describe());
    let options =
        ContextOptions { device: chosen(), validation: true, specialize: Some(true), ..ContextOptions::default() };
    let mut bench = DeviceUnderTest::new(&options, Level::Full).expect("bench");
    let checks = verify::surface_nets::checks(Level::Full);
    assert_eq!(checks.len(), NETS.len() + 1);
    let run = verify::run(&mut bench, &checks, || None, |_| ());
    for outcome in &run.outcomes {
        let figures = outcome.figures.iter().map(|figure| format!("{} {:.2e}", figure.what, figure.value));
        println!("{:14} {}; {}", outcome.name, figures.collect::<Vec<_>>().join(", "), outcome.notes.join(" "));
    }
    let failures: Vec<_> = run.failures().map(|o| format!("{}: {:?}", o.name, o.faults)).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Faults of a device that the quick checks notice, each by the pass that it is in.
#[test]
fn a_wrong_pass_of_a_mesh_is_noticed() {
    let options = ContextOptions { device: chosen(), ..ContextOptions::default() };
    let sound = DeviceUnderTest::new(&options, Level::Quick).expect("bench");
    let faults = [
        ("net_sample", Change::Constant { pass: "net_sample", name: "ARRAY", by: |array| 1 - array }),
        ("net_smooth", Change::Constant { pass: "net_smooth", name: "AXIS", by: |axis| (axis + 1) % 3 }),
        ("net_survey", Change::Extent { pass: "net_survey", by: |extent| extent[1] = 1 }),
        ("net_fill", Change::LeftOut { pass: "net_fill", which: |_, _| true }),
        ("net_count", Change::Constant { pass: "net_count", name: "CLOSED", by: |closed| 1 - closed }),
        ("net_cells", Change::DispatchArgs { pass: "net_cells", by: |_, args| args.slices -= 1 }),
        ("net_vertices", Change::LeftOut { pass: "net_vertices", which: |_, _| true }),
    ];
    assert_eq!(faults.each_ref().map(|(pass, _)| *pass).to_vec(), NETS.iter().map(|p| p.name).collect::<Vec<_>>());
    for (pass, change) in faults {
        let mut faulty = sound.with_fault(change).expect("bench");
        let checks = verify::surface_nets::checks(Level::Quick);
        let run = verify::run(&mut faulty, &checks, || None, |_| ());
        let noticed: Vec<_> = run.failures().map(|o| o.name.as_str()).collect();
        assert!(noticed.contains(&pass), "{pass}: {noticed:?}");
        assert!(noticed.iter().all(|name| [pass, "a ball"].contains(name)), "{pass}: {noticed:?}");
    }
}

#[test]
fn a_ball_has_its_volume_and_area_and_is_that_of_the_cpu() {
    let device = Device::new();
    const R: f64 = 0.8;
    for n in [13, 25, 49] {
        let h = 2.0 / (n - 1) as f64;
        let centre = DVec3::new(0.97, 1.02, 1.01);
        let (lattice, frames) = volume([n; 3], h, |at| R - (at * h).distance(centre));
        let mesh = on_device(&device, &lattice, &frames, None);
        assert_eq!((watertight(&mesh), mesh.open_edges), (2, 0));
        // As in src/core/mesh/nets.rs: nothing lies deeper than this below the ball, nor above it. Rounding of floats, twice, is far less.
        let depth = 2.0 * h * h / R;
        let origin = DVec3::from(lattice.grid.origin);
        let below = mesh.vertices.iter().map(|v| R - (*v - origin).distance(centre));
        // Vertices alone lie within the hull of crossings: (1/8 + 3/8) h^2 / R.
        let most = below.fold(f64::MIN, |most, below| {
            assert!(below > -1e-5 * h, "{below} above the ball");
            most.max(below)
        });
        assert!(most <= depth / 4.0, "{most} below the ball");
        let (volume, area) = (4.0 / 3.0 * PI * R.powi(3), 4.0 * PI * R * R);
        assert!((0.0..3.0 * depth / R).contains(&(1.0 - mesh.volume() / volume)));
        assert!((1.0 - mesh.area() / area).abs() < 2.0 * depth / R);
        same(&mesh, &on_cpu(&lattice, &frames, None), 1e-5 * h, &format!("a ball of {n}^3"));
    }
}

#[test]
fn a_torus_has_a_hole_and_a_plane_is_flat() {
    let device = Device::new();
    let torus = |at: DVec3| {
        let p = (at - DVec3::splat(15.6)) / 15.0;
        0.22 - DVec3::new(p.x.hypot(p.y) - 0.6, p.z, 0.0).length()
    };
    let (lattice, frames) = volume([33, 32, 31], 0.5, torus);
    let mesh = on_device(&device, &lattice, &frames, None);
    assert_eq!((watertight(&mesh), mesh.open_edges), (0, 0));
    // 2 pi^2 R r^2, to the order of the coarse net.
    let share = mesh.volume() / (2.0 * PI * PI * 0.6 * 0.22 * 0.22 * 7.5f64.powi(3));
    assert!((0.93..1.0).contains(&share), "{share}");
    same(&mesh, &on_cpu(&lattice, &frames, None), 1e-5, "a torus");
    let (mut lattice, frames) = volume([7, 6, 5], 1.0, |at| at.x + 0.5 * at.y - 2.25);
    lattice.closed = false;
    let mesh = on_device(&device, &lattice, &frames, None);
    assert!(mesh.triangles.len() > 20 && mesh.open_edges > 0);
    let off = |v: &DVec3| {
        let at = *v - DVec3::from(lattice.grid.origin);
        (at.x + 0.5 * at.y - 2.25).abs()
    };
    assert!(mesh.vertices.iter().all(|v| off(v) < 1e-6), "a plane is bent");
    same(&mesh, &on_cpu(&lattice, &frames, None), 1e-6, "a plane");
}

/// More cells and more vertices than a list holds, in several slabs or one: always the same mesh, which is that of the CPU.
#[test]
fn noise_of_more_cells_than_a_list_holds_is_the_mesh_of_the_cpu_in_any_slabs() {
    let device = Device::new();
    let size = [107, 103, 101];
    let mut noise = Noise(11);
    let values: Vec<f64> = (0..size.iter().product()).map(|_| noise.next() - 0.5).collect();
    let at = |v: DVec3| v.x as usize + size[0] * (v.y as usize + size[1] * v.z as usize);
    let (mut lattice, frames) = volume(size, 0.3, |v| values[at(v)]);
    let mesh = on_device(&device, &lattice, &frames, None);
    assert!(mesh.vertices.len() > 1 << 20, "{} vertices", mesh.vertices.len());
    assert_eq!(mesh.open_edges, 0);
    // Where two neighbours differ by 1e-4 of the largest value, a crossing is found to 1e-3 of a voxel.
    same(&mesh, &on_cpu(&lattice, &frames, None), 1e-3, "noise");
    lattice.most = 5 * size[0] * size[1];
    assert_eq!(lattice.slabs().len(), 25);
    let again = on_device(&device, &lattice, &frames, None);
    assert!(again == mesh, "slabs change the mesh");
}

/// Smoothed, without its first rows, filled to a base, closed or open: of a body in the frames of a fan.
#[test]
fn a_body_in_a_sweep_is_the_mesh_of_the_cpu() {
    let device = Device::new();
    let probe = wobbler();
    let geometry = Geometry::Sweep(probe.clone());
    let scene = scene(geometry.clone(), BYTES, "mode = 'vr'");
    // Waves, in part at the border of the sector.
    let body = |p: DVec3| 0.5 + 0.2 * (0.4 * p.x).sin() + 0.2 * (0.31 * p.y).cos() + 0.1 * (0.5 * p.z).sin();
    let frames: Vec<Vec<u8>> =
        body_frames(&scene, body).iter().map(|frame| frame.encode(frame_format(&scene))).collect();
    let grid = lattice(&geometry, 0.9).expect("a lattice");
    for (closed, deviation, base, left_out) in
        [(true, 0.0, None, 0), (true, 1.2, Some(4), 2), (false, 1.2, None, 5), (true, 2.0, None, 0)]
    {
        let mut lattice = whole(geometry.clone(), StoredType::U8, grid, 100.3);
        (lattice.closed, lattice.deviation, lattice.left_out) = (closed, deviation, left_out);
        let (made, expected) = (on_device(&device, &lattice, &frames, base), on_cpu(&lattice, &frames, base));
        let name = format!("closed {closed}, {deviation} mm, base {base:?}");
        if closed {
            watertight(&made);
        }
        // Slabs of few slices, with what smoothing needs around them.
        lattice.most = grid.size[0] * grid.size[1] * 16;
        assert!(lattice.slabs().len() > 1, "{name}: one slab");
        assert!(on_device(&device, &lattice, &frames, base) == made, "{name}: slabs change the mesh");
        near(&made, &expected, &name);
    }
}

/// Vertices by the cube of 0.5 mm that they are in.
type Bins = HashMap<I64Vec3, Vec<DVec3>>;

fn bin(v: DVec3) -> I64Vec3 {
    (v / 0.5).floor().as_i64vec3()
}

fn bins(mesh: &Mesh) -> Bins {
    let mut bins = Bins::new();
    mesh.vertices.iter().for_each(|v| bins.entry(bin(*v)).or_default().push(*v));
    bins
}

/// Distance to the nearest vertex, at most 0.5 mm.
fn nearest(bins: &Bins, v: DVec3) -> f64 {
    let around = (0..27).map(|n| bin(v) + I64Vec3::new(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
    around.filter_map(|b| bins.get(&b)).flatten().map(|other| other.distance(v)).fold(0.5, f64::min)
}

/// Two meshes of values that are about equal. A place at the border of the sector may be known to one alone, and a value at the threshold
/// inside of one alone: few vertices may have no other near, and no share of the surface is missing.
fn near(a: &Mesh, b: &Mesh, name: &str) {
    let bins = bins(b);
    let mut far: Vec<f64> = a.vertices.iter().map(|v| nearest(&bins, *v)).collect();
    far.sort_by(f64::total_cmp);
    let at = |share: f64| far[((far.len() - 1) as f64 * share) as usize];
    let area = a.area() / b.area() - 1.0;
    println!(
        "{name}: {} and {} triangles, {} and {} vertices; half within {:.1e} mm, 98 % within {:.1e}, all within {:.1e}; area {area:.1e}",
        a.triangles.len(),
        b.triangles.len(),
        a.vertices.len(),
        b.vertices.len(),
        at(0.5),
        at(0.98),
        at(1.0)
    );
    let count = a.vertices.len() as f64 / b.vertices.len() as f64 - 1.0;
    assert!(count.abs() < 2e-3 && area.abs() < 2e-3, "{name}: {count}, {area}");
    assert!(at(0.98) < 5e-3, "{name}: {}", at(0.98));
}

/// Every pass in bands of one row of workgroups leaves the mesh of undivided dispatches.
#[test]
fn bands_leave_the_mesh_of_one_dispatch() {
    let device = Device::alone();
    let geometry = Geometry::Sweep(wobbler());
    let scene = scene(geometry.clone(), BYTES, "mode = 'vr'");
    let body = |p: DVec3| 0.5 + 0.2 * (0.4 * p.x).sin() + 0.2 * (0.31 * p.y).cos() + 0.1 * (0.5 * p.z).sin();
    let frames: Vec<Vec<u8>> =
        body_frames(&scene, body).iter().map(|frame| frame.encode(frame_format(&scene))).collect();
    let grid = lattice(&geometry, 1.7).expect("a lattice");
    let lattice = Lattice { deviation: 1.8, ..whole(geometry, StoredType::U8, grid, 100.3) };
    let made = |bands: Bands| {
        let before = device.counts.dispatches.load(Ordering::Relaxed);
        let mut net = SurfaceNet::in_bands(&device, lattice.clone(), &frames, bands).expect("a device that can");
        let rows = net.deepest(|| ()).expect("a survey").expect("something is inside") + 3;
        let mesh = net.mesh(Some(rows), |at| place(&lattice, at), || ()).expect("a mesh");
        let times: Vec<_> = net.take_times().iter().map(|time| (time.name, time.runs)).collect();
        (mesh, times, device.counts.dispatches.load(Ordering::Relaxed) - before)
    };
    let (whole, times, dispatches) = made(Bands::default());
    assert!(whole.triangles.len() > 1000, "{} triangles", whole.triangles.len());
    let (parts, in_bands, more) = made(Bands::Fixed(64));
    println!("{dispatches} and {more} dispatches; {times:?}; {in_bands:?}");
    assert!(whole == parts, "bands change the mesh");
    for pass in NETS {
        let runs = |times: &[(&str, u32)]| times.iter().find(|(name, _)| *name == pass.name).map(|(_, runs)| *runs);
        assert!(runs(&in_bands) > runs(&times), "{} is not divided", pass.name);
    }
}

/// Why vertices of a device and of the CPU lie apart.
#[derive(Debug, Default)]
struct Apart {
    vertices: usize,
    /// Without a vertex of the other within [`FAR`].
    far: usize,
    /// Of them in a cell with a corner whose value depends on whether a place at the border of the sector is known.
    at_border: usize,
    /// Of the others in a cell with a corner whose value is near the threshold.
    at_threshold: usize,
    /// Of neither kind.
    unexplained: usize,
    /// Largest difference of a value that is not at the border, stored units.
    largest: f64,
    /// How near the threshold is near, stored units.
    near: f64,
}

/// Distance of vertices that counts as far, mm.
const FAR: f64 = 0.01;

/// Looks for the reason of every vertex that is far from those of the other mesh.
///
/// Values of a device differ by at most e from those of the CPU, except at the border of the sector. Let two ends of an edge be p below and q
/// above the threshold, both by more than n > e. Then their signs are the same on both, so that the same edges are crossed. A crossing at the
/// share p / (p + q) of the edge moves by at most e / (p + q - 2 e) < e / (2 n - 2 e). With n = e (1 + 1 / (2 s)) that is the share s. A vertex,
/// as a mean of crossings, moves by no more: by at most [`FAR`] with s = FAR / spacing. So a vertex that moves further belongs to a cell with a
/// corner within n of the threshold.
fn apart(device: &Device, lattice: &Lattice, frames: &[Vec<u8>]) -> Apart {
    let [ours, theirs] = [values_on_device(device, lattice, frames), values_on_cpu(lattice, frames)];
    let sharp = Lattice { deviation: 0.0, ..lattice.clone() };
    let [known, expected] = [values_on_device(device, &sharp, frames), values_on_cpu(&sharp, frames)];
    let [width, height, depth] = lattice.grid.size;
    let index = |[x, y, z]: [usize; 3]| x + width * (y + height * z);
    // Known to one alone, and what smoothing makes of that.
    let mut at_border = vec![false; known.len()];
    let reach = lattice.reach();
    for z in 0..depth {
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let at = index([x, y, z]);
            if known[at].is_nan() == expected[at].is_nan() {
                continue;
            }
            assert!(is_at_border(lattice, [x, y, z]), "{:?} is known to one alone", [x, y, z]);
            let range = |n: usize, reach: usize, size: usize| n.saturating_sub(reach)..(n + reach + 1).min(size);
            for k in range(z, reach[2], depth) {
                for j in range(y, reach[1], height) {
                    range(x, reach[0], width).for_each(|i| at_border[index([i, j, k])] = true);
                }
            }
        }
    }
    let differences = ours.iter().zip(&theirs).zip(&at_border).filter(|(_, at_border)| !**at_border);
    let largest = differences.fold(0.0, |most: f64, ((a, b), _)| {
        assert_eq!(a.is_nan(), b.is_nan(), "a voxel that is known to one alone");
        if a.is_nan() { most } else { most.max((a - b).abs()) }
    });
    let spacing = lattice.grid.spacing.into_iter().fold(0.0, f64::max);
    let near = largest * (1.0 + spacing / (2.0 * FAR));

    let meshes = [on_device(device, lattice, frames, None), on_cpu(lattice, frames, None)];
    let mut apart = Apart { largest, near, ..Apart::default() };
    for (mesh, other) in [(&meshes[0], &meshes[1]), (&meshes[1], &meshes[0])] {
        let bins = bins(other);
        for vertex in &mesh.vertices {
            apart.vertices += 1;
            if nearest(&bins, *vertex) <= FAR {
                continue;
            }
            apart.far += 1;
            // The corners of every cell that the vertex may belong to: it may lie on a face.
            let at = (*vertex - DVec3::from(lattice.grid.origin)) / DVec3::from(lattice.grid.spacing);
            let [low, high] = [(at - 1e-4).floor(), (at + 1e-4).floor() + 1.0].map(|v| v.to_array());
            let range = |axis: usize| {
                let last = lattice.grid.size[axis] as f64 - 1.0;
                low[axis].clamp(0.0, last) as usize..=high[axis].clamp(0.0, last) as usize
            };
            let (mut border, mut threshold) = (false, false);
            for z in range(2) {
                for (x, y) in range(1).flat_map(|y| range(0).map(move |x| (x, y))) {
                    let corner = index([x, y, z]);
                    border |= at_border[corner];
                    threshold |= (theirs[corner] - lattice.threshold).abs() <= near;
                }
            }
            match (border, threshold) {
                (true, _) => apart.at_border += 1,
                (false, true) => apart.at_threshold += 1,
                (false, false) => apart.unexplained += 1,
            }
        }
    }
    apart
}

/// True for a voxel whose place is within 1e-3 of a sample of the border of the sector.
fn is_at_border(lattice: &Lattice, at: [usize; 3]) -> bool {
    let Geometry::Sweep(probe) = &lattice.source else { return false };
    let index = probe.to_indices(place(lattice, DVec3::from_array(at.map(|n| n as f64))));
    let last = lattice.samples().map(|n| f64::from(n) - 1.0);
    let near = |index: f64, last: f64| index.abs().min((index - last).abs()) < 1e-3;
    near(index.sample, last[0]) || near(index.line, last[1]) || near(index.slice, last[2])
}

/// The values of a lattice as the passes make them, NaN where they are not known.
fn values_on_device(device: &Device, lattice: &Lattice, frames: &[Vec<u8>]) -> Vec<f64> {
    let mut runner = PassRunner::new(device).expect("a runner");
    let scene = lattice.clone().scene().expect("a scene");
    let (slot, args) = (Slot::NetSamples, DispatchArgs::default());
    let samples = Texels::decode(slot.shape(&scene).size(), slot.format(&scene), &frames.concat());
    let mut inputs = Arrays::default();
    inputs.insert("net_samples", samples);
    let made = runner.run(&scene, &net::SAMPLE, &args, &inputs, 0.0).expect("a dispatch");
    let mut values = made.get("net_values").clone();
    for iteration in 0..(net::SMOOTH.repeat)(&scene) {
        let mut inputs = Arrays::default();
        inputs.insert("source", values);
        let made = runner.run(&scene, &net::SMOOTH, &DispatchArgs { iteration, ..args }, &inputs, 0.0);
        values = made.expect("a dispatch").get("target").clone();
    }
    values.values.into_iter().map(|value| if value < -3e38 { f64::NAN } else { value }).collect()
}

fn values_on_cpu(lattice: &Lattice, frames: &[Vec<u8>]) -> Vec<f64> {
    let volume = volume_of(lattice, frames);
    let grid = &lattice.grid;
    let mut smoother = Smoother::new(grid.size, grid.spacing, lattice.deviation);
    let mut values = vec![0.0; grid.size.iter().product()];
    for (z, out) in values.chunks_exact_mut(grid.size[0] * grid.size[1]).enumerate() {
        smoother.slice(z, out, |z, out| volume.slice(grid, z, out));
    }
    values
}

/// A plateau at the threshold itself, slopes on both sides of it, and the border of the sector.
#[test]
fn a_vertex_far_from_the_cpus_has_a_corner_at_the_threshold_or_at_the_border() {
    let device = Device::new();
    let geometry = Geometry::Sweep(wobbler());
    let scene = scene(geometry.clone(), BYTES, "mode = 'vr'");
    let body = |p: DVec3| {
        let wave = 0.2 * (0.4 * p.x).sin() + 0.2 * (0.31 * p.y).cos() + 0.1 * (0.5 * p.z).sin();
        (100.0 + 255.0 * wave.signum() * (wave.abs() - 0.05).max(0.0)) / 255.0
    };
    let frames: Vec<Vec<u8>> =
        body_frames(&scene, body).iter().map(|frame| frame.encode(frame_format(&scene))).collect();
    let grid = lattice(&geometry, 0.7).expect("a lattice");
    for (deviation, threshold) in [(0.0, 100.0), (0.0, 103.4), (1.2, 100.0), (1.2, 90.0)] {
        let lattice = Lattice { deviation, ..whole(geometry.clone(), StoredType::U8, grid, threshold) };
        let found = apart(&device, &lattice, &frames);
        println!("{deviation} mm, threshold {threshold}: {found:?}");
        assert_eq!(found.unexplained, 0, "{found:?}");
        assert!(found.vertices > 10_000 && found.largest < 2e-4 * 255.0 && found.near < 2.0, "{found:?}");
        assert!(deviation > 0.0 || threshold > 100.0 || found.at_threshold > 100, "{found:?}");
    }
}

/// The mesh of docs/performance.md. It takes minutes: run with --ignored.
#[test]
#[ignore = "takes minutes"]
fn far_vertices_of_the_phantom_are_at_the_threshold_or_at_the_border() {
    let device = Device::watched(false);
    let phantom = Phantom::new(PhantomOptions::default()).expect("a phantom");
    let geometry = Geometry::Sweep(phantom.probe(0));
    let grid = lattice(&geometry, 0.6).expect("a lattice");
    let frames: Vec<Vec<u8>> = phantom.volume(0).into_iter().map(|frame| frame.bytes).collect();
    let mut histogram = EchoHistogram::new(&geometry, BYTES, block_edge(&geometry));
    frames.iter().for_each(|frame| histogram.take(frame));
    let threshold = 255.0 * histogram.levels().expect("two classes").threshold;
    let deviation = smoothing(&geometry);
    let lattice = Lattice { deviation, ..whole(geometry, StoredType::U8, grid, threshold) };
    let found = apart(&device, &lattice, &frames);
    println!("threshold {threshold}, {deviation} mm: {found:?}");
    assert_eq!(found.unexplained, 0, "{found:?}");
}

#[test]
fn a_volume_that_a_device_cannot_hold_is_refused_on_one_line() {
    let device = Device::new();
    let most = device.limits.max_image_dimension3_d as usize;
    let (lattice, frames) = volume([most + 1, 2, 2], 1.0, |at| at.y - 0.5);
    let error = SurfaceNet::new(&device, lattice, &frames).map(drop).expect_err("too wide");
    let text = error.to_string();
    assert!(matches!(error, NetError::Device(_)) && text.contains("'net_samples'"), "{text}");
    assert!(text.contains(&format!("allows {most}")) && text.lines().count() == 1, "{text}");
}
