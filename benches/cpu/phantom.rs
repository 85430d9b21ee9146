//! The phantom: what a live view without a probe waits for.

use criterion::{Criterion, SamplingMode, Throughput};
use echolume::low_level::source::phantom::{Body, Phantom, PhantomOptions, Speckle};

pub fn bench(criterion: &mut Criterion) -> Result<(), String> {
    let mut group = criterion.benchmark_group("phantom");
    // Of the slowest a sample is one run.
    group.sampling_mode(SamplingMode::Flat);
    for (name, options) in [
        ("head, two frames", PhantomOptions { frames: 2, ..PhantomOptions::default() }),
        ("head, a volume of 37 frames", PhantomOptions::default()),
        ("head without speckle", PhantomOptions { speckle: Speckle::None, ..PhantomOptions::default() }),
        ("wires", PhantomOptions { body: Body::Wires, ..PhantomOptions::default() }),
    ] {
        let samples = options.frames * options.lines * options.samples;
        let phantom = Phantom::new(options).map_err(|e| e.to_string())?;
        group.throughput(Throughput::Elements(samples as u64));
        group.bench_function(name, |b| b.iter(|| phantom.volume(0)));
    }
    group.finish();
    Ok(())
}
