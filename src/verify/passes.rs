//! Every pass alone against its f64 reference: on noise and extremes, at awkward sizes, in every variant of the geometry. Each pass gets
//! its own inputs, so that errors do not add up; outputs are poisoned before, so that what a pass leaves out is seen.

use super::compared::Slack;
use super::inputs::{KINDS, inputs_of, turn_of};
use super::shown::shown;
use super::{Bench, Check, Comparison, Found, compare};
use crate::gpu::GpuError;
use crate::gpu::pass_runner::PassRunner;
use crate::gpu::resources::shape_size;
use crate::passes::slots::Format;
use crate::passes::{Arrays, Bind, PASSES, Pass, Texels};
use crate::scene::Scene;
use crate::verify::report::{Fault, Figure, Level, Unit};
use std::collections::HashSet;

/// What outputs hold before a pass: no pass computes it by chance, and every format stores it (nearly).
pub const POISON: f64 = 0.654_321;

/// Largest mean error of a dispatch, with its sign, as a share of what is allowed of each texel. Rounding errs both ways.
pub const BIAS: f64 = 0.1;

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
    single: &mut PassRunner,
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
        expected.insert(bind.name, Texels::untouched(shape_size(bind.slot.shape(scene)), channels));
    }
    pass.expected(scene, &turn, &inputs, &mut expected);
    let slack = Slack::of(pass, scene, &turn, single.filter_bits());
    let got = single.run(scene, pass, &turn, &inputs, POISON)?;
    let comparison = compare(pass, scene, slack, POISON, &expected, &got, &writes);
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
    let (mut sum, scenes) = (Sum::default(), bench.scenes());
    let mut variants = HashSet::new();
    for s in (0..scenes.len()).filter(|s| pass.is_needed(&scenes[*s].1)) {
        // Quickly: every pipeline once, and of its other scenes some.
        let is_new = variants.insert(variant(&scenes[s].1, pass));
        if bench.level == Level::Full || is_new || s % 5 == n % 5 {
            sum.add(bench, n, pass, s, is_new)?;
        }
    }
    Ok(sum.found(pass))
}

/// What one pass does in one of the bench's scenes, by their places in [`PASSES`] and [`Bench::scenes`].
///
/// # Errors
/// A device that fails.
pub fn in_scene(bench: &mut Bench, n: usize, scene: usize) -> Result<Found, GpuError> {
    let mut sum = Sum::default();
    sum.add(bench, n, &PASSES[n], scene, true)?;
    Ok(sum.found(&PASSES[n]))
}

/// What came of many dispatches of a pass.
#[derive(Default)]
struct Sum {
    found: Found,
    runs: u32,
    failed: usize,
    largest: f64,
    used: f64,
    outliers: f64,
    bias: f64,
}

impl Sum {
    /// `is_new`: no scene before had its pipeline.
    fn add(
        &mut self,
        bench: &mut Bench,
        n: usize,
        pass: &'static Pass,
        s: usize,
        is_new: bool,
    ) -> Result<(), GpuError> {
        let (scenes, level) = (bench.scenes(), bench.level);
        let (name, scene) = &scenes[s];
        for (k, kind) in KINDS.iter().enumerate() {
            // Noise always, and quickly one of the extremes by turns.
            if level == Level::Quick && k > 0 && (!is_new || 1 + s % (KINDS.len() - 1) != k) {
                continue;
            }
            for iteration in 0..(pass.repeat)(scene) {
                let result = beside(bench.single()?, scene, pass, iteration, kind, (n * 8 + k) as u64)?;
                let of = &result.comparison;
                (self.largest, self.used) = (self.largest.max(of.largest), self.used.max(of.used));
                (self.outliers, self.runs) = (self.outliers.max(of.outliers), self.runs + 1);
                self.bias = self.bias.max(of.bias);
                let is_biased = of.bias > BIAS;
                if of.worst.is_none() && !is_biased {
                    continue;
                }
                self.failed += 1;
                if self.failed > TOLD {
                    continue;
                }
                let what = match &of.worst {
                    Some(worst) => format!("{} texels of {} beyond tolerance", worst.beyond, worst.texels),
                    None => format!("errors go one way: their mean is {:.2} of what is allowed of each", of.bias),
                };
                if let Some(worst) = &of.worst {
                    let (e, g) = (result.expected.get(&worst.output), result.got.get(&worst.output));
                    let mut picture = shown(&format!("{} of '{name}'", worst.output), e, g, worst.at[2]);
                    picture.fault = Some(self.found.faults.len());
                    self.found.pictures.push(picture);
                }
                self.found.faults.push(Fault {
                    what,
                    pass: Some(pass.name.into()),
                    input: format!("'{name}', iteration {iteration}, {kind}"),
                    worst: of.worst.clone(),
                    files: Vec::new(),
                });
            }
        }
        Ok(())
    }

    fn found(self, pass: &Pass) -> Found {
        let Sum { mut found, runs, failed, largest, used, outliers, bias } = self;
        found.expect(runs > 0, || format!("no scene needs '{}'", pass.name));
        found.expect(failed <= TOLD, || format!("{} more inputs beyond tolerance", failed - TOLD));
        found.figures.push(Figure {
            what: "largest error".into(),
            value: largest,
            allowed: None,
            unit: Unit::Value,
            samples: Vec::new(),
            fleeting: false,
        });
        found.figures.push(Figure::error("share of the tolerance", used, 1.0, Unit::Share));
        found.figures.push(Figure::error("texels beyond it", outliers, pass.tolerance.outliers, Unit::Share));
        found.figures.push(Figure::error("mean error, share of the tolerance", bias, BIAS, Unit::Share));
        found.notes.push(format!("{runs} dispatches; tolerance: {}", pass.tolerance.why));
        found
    }
}
