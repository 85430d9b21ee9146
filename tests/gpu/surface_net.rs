//! Meshes made on a device: each pass against its reference, whole meshes against shapes in closed form, and against those of the CPU.

use crate::common::gpu::*;
use echolume::gpu::pass_runner::PassRunner;
use echolume::gpu::surface_net::{NetError, SurfaceNet};
use echolume::mesh::Mesh;
use echolume::mesh::base::Base;
use echolume::mesh::nets::{Surface, surface_net};
use echolume::mesh::smooth::Smoother;
use echolume::passes::net::{self, NETS};
use echolume::passes::{Arrays, DispatchArgs, Slot, Texels};
use echolume::probe::{Geometry, Grid};
use echolume::scene::{Lattice, Scene};
use echolume::source::convert::{Volume, lattice};
use echolume::source::{Frame, StoredType};

use echolume::verify::passes::POISON;
use echolume::verify::{self, ExtraTolerance};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;

fn whole(source: Geometry, stored: StoredType, grid: Grid, threshold: f64) -> Lattice {
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
    let mut volume = Volume::new(lattice.source.clone(), lattice.stored);
    for (slice, bytes) in frames.iter().enumerate() {
        volume.take(Frame::of_slice(0, slice, bytes.clone()));
    }
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

/// Every pass of a mesh, on the outputs of the references before it, in a scene.
fn check_passes(runner: &mut PassRunner, scene: &Scene, name: &str) {
    let lattice = scene.lattice.as_ref().expect("a lattice");
    let mut noise = Noise(7);
    let mut slots: BTreeMap<Slot, Texels> = BTreeMap::new();
    let size = Slot::NetSamples.shape(scene).size();
    let mut samples = Texels::from_fn(size, 1, |_, _| 0.0);
    samples.values.iter_mut().for_each(|v| *v = noise.next());
    slots.insert(Slot::NetSamples, samples);
    for pass in NETS.iter().filter(|pass| pass.name != net::FILL.name || lattice.filled_rows.is_some()) {
        for iteration in 0..(pass.repeat)(scene) {
            let layers = lattice.cells()[2];
            let mut args = DispatchArgs { iteration, ..DispatchArgs::default() };
            if pass.name == net::CELLS.name {
                // Neither the first layer nor the last.
                args = DispatchArgs { slice: 1, slices: (layers - 1).min(layers.max(3) - 2), ..args };
                let counts: Vec<u32> = slots[&Slot::NetCounts].values.iter().map(|n| *n as u32).collect();
                let (firsts, fitting) = net::firsts(scene, &counts, 1);
                assert_eq!(fitting, layers as usize - 1);
                let [rows, layers, _] = Slot::NetFirsts.shape(scene).size();
                slots.insert(
                    Slot::NetFirsts,
                    Texels::from_fn([rows, layers, 1], 1, |[x, y, _], _| f64::from(firsts[y * rows + x])),
                );
            }
            if pass.name == net::VERTICES.name {
                args.slices = 3;
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
            let got = runner.run(scene, pass, &args, &inputs, poison(pass.name)).expect("dispatch");
            let compared = verify::compare_outputs(
                pass,
                scene,
                ExtraTolerance::default(),
                poison(pass.name),
                &expected,
                &got,
                &writes,
            );
            println!("{name}, {} {iteration}: {:.2e}, {:.1e} off", pass.name, compared.largest, compared.outliers);
            assert!(compared.worst.is_none(), "{name}, {}: {:?}", pass.name, compared.worst);
            for bind in &writes {
                let texels = expected.get(bind.name).clone();
                let known = texels.values.iter().map(|v| if v.is_nan() { 0.0 } else { *v }).collect();
                slots.insert(bind.slot, Texels { values: known, ..texels });
            }
        }
    }
}

/// Integers cannot hold every number.
fn poison(pass: &str) -> f64 {
    if pass == net::COUNT.name || pass == net::CELLS.name { 77.0 } else { POISON }
}

/// The crossed edges of listed cells.
fn asked(scene: &Scene, crossed: &Texels) -> Texels {
    let size = Slot::NetAsked.shape(scene).size();
    let mut asked = Texels::from_fn(size, 2, |_, _| 0.0);
    for (n, cell) in crossed.values.chunks_exact(2).enumerate().take(3 * size[0]) {
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

#[test]
fn every_pass_of_a_mesh_matches_its_reference() {
    let device = Device::new();
    let mut runner = PassRunner::new(&device).expect("a runner");
    for (name, geometry) in geometries() {
        let (low, high) = match &geometry {
            Geometry::Sweep(probe) => probe.bounds(),
            Geometry::Cartesian(grid) => {
                let last = DVec3::from_array(grid.size.map(|n| (n - 1) as f64)) * DVec3::from(grid.spacing);
                (DVec3::from(grid.origin), DVec3::from(grid.origin) + last)
            }
        };
        let spacing = (high - low).max_element() / 37.0;
        let grid = lattice(&geometry, spacing).expect("a lattice");
        let all = whole(geometry.clone(), StoredType::F32, grid, 0.5);
        check_passes(&mut runner, &all.clone().scene().expect("a scene"), &format!("{name}, closed"));
        let more = Lattice {
            deviation: 1.3 * spacing,
            closed: false,
            left_out: 3,
            filled_rows: Some(grid.size[1] + 5),
            ..all
        };
        check_passes(&mut runner, &more.clone().scene().expect("a scene"), &format!("{name}, smoothed and filled"));
        // A slab in the middle.
        let slab = more.slab((grid.size[2] / 2 - 1, 3.min(grid.size[2] / 2 + 1)));
        if grid.size[2] > 8 {
            check_passes(&mut runner, &slab.scene().expect("a scene"), &format!("{name}, a slab"));
        }
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
        // As in src/mesh/nets.rs: nothing lies deeper than this below the ball, nor above it. Rounding of floats, twice, is far less.
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

/// Two meshes of values that are about equal. A place at the border of the sector may be known to one alone, and a value at the threshold
/// inside of one alone: few vertices may have no other near, and no share of the surface is missing.
fn near(a: &Mesh, b: &Mesh, name: &str) {
    let bin = |v: DVec3| (v / 0.5).floor().as_i64vec3();
    let mut bins: HashMap<_, Vec<DVec3>> = HashMap::new();
    b.vertices.iter().for_each(|v| bins.entry(bin(*v)).or_default().push(*v));
    let nearest = |v: DVec3| {
        let around = (0..27).map(|n| bin(v) + glam::I64Vec3::new(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
        around.filter_map(|b| bins.get(&b)).flatten().map(|other| other.distance(v)).fold(0.5, f64::min)
    };
    let mut far: Vec<f64> = a.vertices.iter().map(|v| nearest(*v)).collect();
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
