//! Every pass alone against its f64 reference: on noise and extremes, at awkward sizes, in every variant of the geometry. Each pass gets
//! its own inputs, so that errors do not add up; outputs are poisoned before, so that what a pass leaves out is seen.

use super::inputs::{KINDS, inputs_of, turn_of};
use super::shown::shown;
use super::{Bench, Check, Comparison, Found, compare};
use crate::gpu::GpuError;
use crate::gpu::renderer::size_of;
use crate::gpu::single::Single;
use crate::passes::slots::Format;
use crate::passes::{Arrays, Bind, PASSES, Pass, Texels};
use crate::report::verify::{Fault, Figure, Level, Unit};
use crate::scene::Scene;
use std::collections::HashSet;

/// What outputs hold before a pass: no pass computes it by chance, and every format stores it (nearly).
pub const POISON: f64 = 0.654_321;

/// Faults of one pass that are told one by one.
const TOLD: usize = 8;

/// One dispatch beside its reference.
pub struct Beside {
    pub inputs: Arrays,
    pub expected: Arrays,
    pub got: Arrays,
    pub writes: Vec<Bind>,
    pub comparison: Comparison,
}

/// Dispatches one pass alone, on inputs of that kind.
///
/// # Errors
/// A device that fails.
pub fn beside(
    single: &mut Single,
    scene: &Scene,
    pass: &'static Pass,
    iteration: u32,
    kind: &str,
    seed: u64,
) -> Result<Beside, GpuError> {
    let turn = turn_of(scene, iteration);
    let inputs = inputs_of(scene, pass, &turn, kind, seed);
    let writes = (pass.writes)(scene, &turn);
    let mut expected = Arrays::default();
    for bind in &writes {
        let channels = bind.slot.format(scene).channels();
        expected.insert(bind.name, Texels::untouched(size_of(bind.slot.shape(scene)), channels));
    }
    pass.expected(scene, &turn, &inputs, &mut expected);
    let got = single.run(scene, pass, &turn, &inputs, POISON)?;
    let comparison = compare(pass, scene, POISON, &expected, &got, &writes);
    Ok(Beside { inputs, expected, got, writes, comparison })
}

/// A check a pass.
pub fn checks(_: Level) -> Vec<Check> {
    PASSES
        .iter()
        .enumerate()
        .map(|(n, pass)| Check::new("passes", pass.name, move |bench| check(bench, n, pass)))
        .collect()
}

type Variant = (&'static str, Vec<(&'static str, i32)>, Vec<Format>);

/// What makes a pipeline: its shader, its constants, and the formats of what it reads and writes.
fn variant(scene: &Scene, pass: &Pass) -> Variant {
    let turn = turn_of(scene, 0);
    let bound = (pass.reads)(scene, &turn).into_iter().chain((pass.writes)(scene, &turn));
    ((pass.shader)(scene, &turn), (pass.constants)(scene, &turn), bound.map(|b| b.slot.format(scene)).collect())
}

fn check(bench: &mut Bench, n: usize, pass: &'static Pass) -> Result<Found, GpuError> {
    let (mut found, mut runs, mut failed) = (Found::default(), 0, 0);
    let (mut largest, mut used, mut outliers) = (0.0f64, 0.0f64, 0.0f64);
    let (scenes, level) = (bench.scenes(), bench.level);
    let mut variants = HashSet::new();
    for (s, (name, scene)) in scenes.iter().enumerate().filter(|(_, (_, scene))| pass.is_needed(scene)) {
        // Quickly: every pipeline once, and of its other scenes some; noise, and one of the extremes by turns.
        let is_new = variants.insert(variant(scene, pass));
        if level == Level::Quick && !is_new && s % 5 != n % 5 {
            continue;
        }
        for (k, kind) in KINDS.iter().enumerate() {
            if level == Level::Quick && k > 0 && (!is_new || 1 + s % (KINDS.len() - 1) != k) {
                continue;
            }
            for iteration in 0..(pass.repeat)(scene) {
                let result = beside(bench.single()?, scene, pass, iteration, kind, (n * 8 + k) as u64)?;
                let of = &result.comparison;
                (largest, used) = (largest.max(of.largest), used.max(of.used));
                (outliers, runs) = (outliers.max(of.outliers), runs + 1);
                let Some(worst) = of.worst.clone() else { continue };
                failed += 1;
                if failed > TOLD {
                    continue;
                }
                let (e, g) = (result.expected.get(&worst.output), result.got.get(&worst.output));
                let mut picture = shown(&format!("{} of '{name}'", worst.output), e, g, worst.at[2]);
                picture.fault = Some(found.faults.len());
                found.pictures.push(picture);
                found.faults.push(Fault {
                    what: format!("{} texels of {} beyond tolerance", worst.beyond, worst.texels),
                    pass: Some(pass.name.into()),
                    input: format!("'{name}', iteration {iteration}, {kind}"),
                    worst: Some(worst),
                    files: Vec::new(),
                });
            }
        }
    }
    found.expect(runs > 0, || format!("no scene needs '{}'", pass.name));
    found.expect(failed <= TOLD, || format!("{} more inputs beyond tolerance", failed - TOLD));
    found.figures.push(Figure {
        what: "largest error".into(),
        value: largest,
        allowed: None,
        unit: Unit::Value,
        samples: Vec::new(),
    });
    found.figures.push(Figure::error("share of the tolerance", used, 1.0, Unit::Share));
    found.figures.push(Figure::error("texels beyond it", outliers, pass.tolerance.outliers, Unit::Share));
    found.notes.push(format!("{runs} dispatches; tolerance: {}", pass.tolerance.why));
    Ok(found)
}
