//! The passes of a mesh: of a sweep of the phantom, smoothed, filled down to a base and closed. A run is a whole mesh; each bench counts the time of
//! one pass in it.

use crate::or_end;
use criterion::{Criterion, SamplingMode, Throughput};
use echolume::low_level::gpu::Context;
use echolume::low_level::gpu::surface_net::SurfaceNet;
use echolume::low_level::passes::net::NETS;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::default_look::smoothing;
use echolume::low_level::source::StoredType;
use echolume::low_level::source::convert::lattice;
use echolume::low_level::source::phantom::Phantom;
use echolume::low_level::verify::surface_nets::whole;
use std::sync::Arc;
use std::time::Duration;

/// Stored value of the surface.
const THRESHOLD: f64 = 90.0;

/// `voxels`: along the longest edge of the lattice.
pub fn bench(criterion: &mut Criterion, context: &Arc<Context>, phantom: &Phantom, voxels: u32) -> Result<(), String> {
    let probe = phantom.probe(0);
    let (low, high) = probe.bounds();
    let geometry = Geometry::Sweep(probe);
    let grid = lattice(&geometry, (high - low).max_element() / f64::from(voxels))?;
    let deviation = smoothing(&geometry);
    let mut lattice = whole(geometry, StoredType::U8, grid, THRESHOLD);
    lattice.deviation = deviation;
    let elements: usize = grid.size.iter().product();
    let mut made = None;
    for pass in NETS {
        let mut group = criterion.benchmark_group(pass.name);
        // Every sample of as many runs: they do not depend on what came before.
        group.sampling_mode(SamplingMode::Flat).throughput(Throughput::Elements(elements as u64));
        group.bench_function("phantom", |bencher| {
            let net = made.get_or_insert_with(|| {
                let frames: Vec<Vec<u8>> = phantom.volume(0).into_iter().map(|frame| frame.bytes).collect();
                let mut net = or_end("surface net", SurfaceNet::new(context, lattice.clone(), &frames));
                // Once to compile.
                or_end("surface net", run(&mut net, None));
                net
            });
            bencher.iter_custom(|runs| {
                let one = |_| or_end(pass.name, run(net, Some(pass.name)));
                Duration::from_secs_f64((0..runs).map(one).sum::<f64>() * 1e-9)
            });
        });
        group.finish();
    }
    Ok(())
}

/// Makes a mesh. The time of a pass in it, ns; 0 where the device has no time stamps.
fn run(net: &mut SurfaceNet, pass: Option<&str>) -> Result<f64, String> {
    let deepest = net.deepest(|| ()).map_err(|e| e.to_string())?.ok_or("nothing of the phantom is inside")?;
    net.mesh(Some(deepest + 2), |at| at, || ()).map_err(|e| e.to_string())?;
    let times = net.take_times();
    let time = times.iter().find(|time| Some(time.name) == pass);
    match (pass, time) {
        (Some(pass), None) if !times.is_empty() => Err(format!("no dispatch of {pass}")),
        _ => Ok(time.map_or(0.0, |time| time.total)),
    }
}
