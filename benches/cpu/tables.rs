//! Tables that are made from the scene when it changes: a slider that rebuilds one must stay within a picture's time.

use crate::common;
use criterion::{Criterion, Throughput};
use echolume::low_level::passes::lookup_tables;
use echolume::low_level::probe::{Axis, Geometry, Probe};
use std::hint::black_box;

pub fn bench(criterion: &mut Criterion) -> Result<(), String> {
    let probe = common::phantom(37, 128, 512)?.probe(0);
    // Angles from a table, as recordings have them: an index is searched, not divided.
    let table =
        |axis: &Axis| Axis::from_table((0..axis.len()).map(|i| axis.at(i as f64) + 1e-4 * (i as f64).sin()).collect());
    let uneven = Probe { lines: table(&probe.lines), slices: table(&probe.slices), ..probe.clone() };
    let mut group = criterion.benchmark_group("tables");
    for (name, probe) in [("even", probe), ("uneven", uneven)] {
        // As `echolume render` has it: slices of 512 pixels along their longer edge.
        let scene = common::scene(Geometry::Sweep(probe), &[])?;
        let pixels = scene.grid.size.map(u64::from).iter().product();
        group.throughput(Throughput::Elements(pixels));
        group.bench_function(format!("scan_lut, {name}"), |b| b.iter(|| lookup_tables::scan_lut(black_box(&scene))));
        group.throughput(Throughput::Elements(u64::from(scene.settings.ray.entries)));
        group.bench_function(format!("sweep_lut, {name}"), |b| b.iter(|| lookup_tables::sweep_lut(black_box(&scene))));
        group.bench_function(format!("line_lut, {name}"), |b| b.iter(|| lookup_tables::line_lut(black_box(&scene))));
        group.throughput(Throughput::Elements(u64::from(scene.slices())));
        group.bench_function(format!("slice_table, {name}"), |b| {
            b.iter(|| lookup_tables::slice_table(black_box(&scene)))
        });
        if name == "even" {
            let entries = lookup_tables::transfer_table(&scene).len() as u64 / 4;
            group.throughput(Throughput::Elements(entries));
            group.bench_function("transfer", |b| b.iter(|| lookup_tables::transfer_table(black_box(&scene))));
            group.throughput(Throughput::Elements(entries * entries));
            group.bench_function("pre-integrated", |b| {
                b.iter(|| lookup_tables::pre_integrated_table(black_box(&scene)))
            });
        }
    }
    group.finish();
    Ok(())
}
