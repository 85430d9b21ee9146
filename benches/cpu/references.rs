//! The f64 references that tests and goldens spend their time in, one of each kind of work, on what a rendering of the phantom
//! by references leaves in the slots.

use crate::common::{self, BYTES};
use criterion::{Criterion, Throughput};
use echolume::low_level::passes::{Arrays, DispatchArgs, Frequency, Slot, Texels, by_name};
use echolume::low_level::probe::Geometry;
use echolume::low_level::reference;
use echolume::low_level::scene::Scene;
use std::collections::BTreeMap;

/// Small: a reference takes microseconds a texel.
const FRAMES: [usize; 3] = [17, 32, 96];

pub fn bench(criterion: &mut Criterion) -> Result<(), String> {
    let [frames, lines, samples] = FRAMES;
    let phantom = common::phantom(frames, lines, samples)?;
    let set = ["slices.pixels=48", "picture.size=[48, 48]"].map(String::from);
    let scene = common::scene(Geometry::Sweep(phantom.probe(0)), &set)?;
    let [width, height] = scene.frame_size().map(|n| n as usize);
    let texels = |bytes: &[u8]| Texels {
        size: [width, height, 1],
        channels: 1,
        values: bytes.iter().map(|b| f64::from(*b) / BYTES.range[1]).collect(),
    };
    let slots = std::cell::LazyCell::new(|| {
        let mut volume = phantom.volume(0);
        volume.sort_by_key(|f| f.slice);
        let frames: Vec<Texels> = volume.iter().map(|f| texels(&f.bytes)).collect();
        reference::render(&scene, &frames)
    });
    let mut group = criterion.benchmark_group("references");
    for name in
        ["scan_convert", "median_slice", "sigma_slice", "gaussian_lateral", "raycast_surface", "shadow", "light"]
    {
        one(&mut group, &scene, name, &slots)?;
    }
    group.finish();
    Ok(())
}

fn one(
    group: &mut criterion::BenchmarkGroup<criterion::measurement::WallTime>,
    scene: &Scene,
    name: &str,
    slots: &std::cell::LazyCell<BTreeMap<Slot, Texels>, impl FnOnce() -> BTreeMap<Slot, Texels>>,
) -> Result<(), String> {
    let pass = by_name(name).ok_or_else(|| format!("references: there is no pass '{name}'"))?;
    pass.needed(scene).map_err(|why| format!("references: the scene does not need '{name}': {why}"))?;
    let args = match pass.frequency {
        Frequency::Frame => DispatchArgs { slice: scene.slices() / 2, slices: 1, ..DispatchArgs::default() },
        _ => DispatchArgs { slices: scene.slices(), ..DispatchArgs::default() },
    };
    group.throughput(Throughput::Elements((pass.extent)(scene, &args).map(u64::from).iter().product()));
    let mut prepared = None;
    group.bench_function(name, |b| {
        let (reads, writes) = prepared.get_or_insert_with(|| {
            let taken = |binds: Vec<echolume::low_level::passes::Bind>| {
                let mut arrays = Arrays::default();
                binds.iter().for_each(|b| arrays.insert(b.name, slots[&b.slot].clone()));
                arrays
            };
            (taken(pass.reads(scene, &args)), taken(pass.writes(scene, &args)))
        });
        b.iter(|| pass.reference(scene, &args, reads, writes));
    });
    Ok(())
}
