//! Frames on their way in, as many a second as the device takes, beside copying their bytes and nothing else: the limit of every
//! ingestion. Wall time of a volume, until the device is done with it.

use crate::common::{BYTES, Run};
use criterion::{Criterion, SamplingMode, Throughput};
use echolume::low_level::gpu::{Context, GpuError, Renderer, RendererOptions};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::source::phantom::Phantom;
use std::hint::black_box;
use std::sync::Arc;

/// Name, settings, and whether the frames are slices of a Cartesian volume already.
const CASES: [(&str, &[&str], bool); 3] = [
    ("slices as they are", &["slices.format=r8"], true),
    ("scan conversion", &["slices.format=r8"], false),
    ("scan conversion and sigma filter", &["slices.format=r8", "slices.sigma={ window = 5 }"], false),
];

pub fn bench(criterion: &mut Criterion, context: &Arc<Context>, phantom: &Phantom, run: Run) -> Result<(), String> {
    let probe = phantom.probe(0);
    let (frames, bytes) = (probe.slices.len(), probe.lines.len() * probe.samples);
    // What is in the frames does not matter here.
    let noise = |k: usize, i: usize| (((k * bytes + i) as u32).wrapping_mul(2_654_435_761) >> 24) as u8;
    let sent: Vec<Vec<u8>> = (0..frames).map(|k| (0..bytes).map(|i| noise(k, i)).collect()).collect();
    let mut group = criterion.benchmark_group("ingestion");
    group.sampling_mode(SamplingMode::Flat).throughput(Throughput::Elements(frames as u64));
    let mut staging = vec![0u8; bytes];
    group.bench_function("copying the bytes", |bencher| {
        bencher.iter(|| sent.iter().for_each(|frame| black_box(&mut staging).copy_from_slice(frame)));
    });
    for (name, set, is_cartesian) in CASES {
        let geometry = match is_cartesian {
            true => Geometry::Cartesian(Grid {
                size: [probe.samples, probe.lines.len(), frames],
                spacing: [0.3; 3],
                origin: [0.0; 3],
            }),
            false => Geometry::Sweep(probe.clone()),
        };
        let mut layers = Layers::default();
        let all = ["mode=mip", "slices.everything=true"];
        all.iter().chain(set).try_for_each(|s| layers.set(s)).map_err(|e| e.to_string())?;
        let settings = layers.finish().map_err(|e| e.to_string())?;
        let scene = Scene::new(geometry, BYTES, settings).map_err(|e| e.to_string())?;
        let options = RendererOptions { volume_images: 2, ..RendererOptions::default() };
        let mut renderer = Renderer::new(context, scene, &options).map_err(|e| e.to_string())?;
        let mut image = 0;
        let mut volume = || -> Result<(), GpuError> {
            image = 1 - image;
            for (slice, frame) in sent.iter().enumerate() {
                renderer.frame(slice as u32, frame, image)?;
            }
            renderer.take_times().map(|_| ())
        };
        if run != Run::List {
            // Once to compile.
            volume().map_err(|e| e.to_string())?;
        }
        group.bench_function(name, |bencher| bencher.iter(|| crate::or_end(name, volume())));
    }
    group.finish();
    Ok(())
}
