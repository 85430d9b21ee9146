//! Reading recordings: all their frames, from files that the system has in memory after the first round.

use criterion::{Criterion, Throughput};
use echolume::Source;
use echolume::low_level::probe::file::ProbeFile;
use echolume::low_level::source::{InputError, Recording};
use std::path::{Path, PathBuf};

fn stored(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Bytes of all frames.
fn read(path: &Path) -> Result<u64, InputError> {
    let mut recording = Recording::open(path, None)?;
    let mut bytes = 0;
    while let Some(frame) = recording.next_frame()? {
        bytes += frame.bytes.len() as u64;
    }
    Ok(bytes)
}

pub fn bench(criterion: &mut Criterion) -> Result<(), String> {
    let mut group = criterion.benchmark_group("parsing");
    for (name, file) in [
        ("MetaImage", "wobbler-4dc7/sweep.mha"),
        ("Kretz", "wobbler-4dc7/sweep.vol"),
        ("PLUS sequence, zlib", "ultrasonix-curvilinear/brightness.mha"),
    ] {
        let path = stored(file);
        // Once outside: a file that cannot be read would be timed as an error.
        let bytes = read(&path).map_err(|e| e.to_string())?;
        group.throughput(Throughput::Bytes(bytes));
        group.bench_function(name, |b| b.iter(|| read(&path)));
    }
    let path = stored("wobbler-4dc7/probe.toml");
    let length = path.metadata().map_err(|e| format!("{}: {e}", path.display()))?.len();
    ProbeFile::read(&path).map_err(|e| e.to_string())?;
    group.throughput(Throughput::Bytes(length));
    group.bench_function("probe file", |b| b.iter(|| ProbeFile::read(&path)));
    group.finish();
    Ok(())
}
