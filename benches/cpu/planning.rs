//! What a live view does on the CPU for every change of scene, frame and picture, before the device has anything to do.

use crate::common;
use criterion::{Criterion, Throughput};
use echolume::low_level::barriers::{Barrier, BarrierTracker, accesses};
use echolume::low_level::passes::{DispatchArgs, Frequency};
use echolume::low_level::plan::{Plan, Rerun};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::Scene;
use std::hint::black_box;

/// Barriers of a volume's frames, its passes, and one picture.
fn barriers(scene: &Scene, plan: &Plan) -> Vec<Barrier> {
    let mut tracker = BarrierTracker::default();
    let mut found = Vec::new();
    for slice in 0..scene.slices() {
        for (_, step) in plan.steps_of(Frequency::Frame) {
            let args = DispatchArgs { layer: slice % 4, slice, slices: 1, ..step.args() };
            found.extend(tracker.record(&accesses(scene, step.pass, &args)));
        }
    }
    for (_, step) in plan.steps_of(Frequency::Volume).chain(plan.steps_of(Frequency::Picture)) {
        let args = DispatchArgs { slices: scene.slices(), ..step.args() };
        found.extend(tracker.record(&accesses(scene, step.pass, &args)));
    }
    found
}

pub fn bench(criterion: &mut Criterion) -> Result<(), String> {
    let geometry = Geometry::Sweep(common::phantom(37, 128, 512)?.probe(0));
    let scene = |set: &[&str]| common::scene(geometry.clone(), &set.iter().map(|s| s.to_string()).collect::<Vec<_>>());
    let old = scene(&[])?;
    let plan = Plan::new(&old);
    let mut group = criterion.benchmark_group("planning");
    group.bench_function("scene", |b| b.iter(|| scene(black_box(&[]))));
    group.bench_function("plan", |b| b.iter(|| Plan::new(black_box(&old))));
    for (name, set) in [
        ("a light moved", "light.direction=[0.3, 0.75, 0.75]"),
        ("the camera turned", "camera.azimuth=10"),
        ("another transfer function", "volume.transfer=cool"),
        ("a filter's sigma", "slices.sigma={ window = 9, sigma = 0.16 }"),
        ("another geometry", "slices.pixels=500"),
    ] {
        let new = scene(&[set])?;
        let plan = Plan::new(&new);
        let everything = plan.rerun(&old, &new) == Rerun::Everything;
        if everything != (name == "another geometry") {
            return Err(format!("rerun, {name}: does not re-run what its name says"));
        }
        group.bench_function(format!("rerun, {name}"), |b| b.iter(|| plan.rerun(black_box(&old), black_box(&new))));
    }
    let found = barriers(&old, &plan);
    if found.is_empty() {
        return Err("barriers: none were derived".into());
    }
    // Of one operation each.
    let frames = plan.steps_of(Frequency::Frame).count() * old.slices() as usize;
    let rest = plan.steps.iter().filter(|s| s.pass.frequency != Frequency::Frame).count();
    group.throughput(Throughput::Elements((frames + rest) as u64));
    group.bench_function("barriers of a volume and a picture", |b| b.iter(|| barriers(black_box(&old), &plan)));
    group.finish();
    Ok(())
}
