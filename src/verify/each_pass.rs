//! Group "passes": every pass alone against its f64 reference, on noise and extremes, at awkward sizes, in every variant of the geometry.
//! Each pass gets its own inputs, so that errors do not accumulate. Outputs are poisoned first, so that unwritten texels are detected.

use super::built_in::Noise;
use super::compare::{Comparison, ExtraTolerance, compare_outputs, texel_comparison};
use super::{Check, DeviceUnderTest, Findings};
use crate::gpu::GpuError;
use crate::gpu::pass_runner::PassRunner;
use crate::passes::preprocess::PACKED_NEIGHBOURS;
use crate::passes::raycast::tolerance::{self, LEVELS};
use crate::passes::slots::{Format, Initializer, Shape, frames_per_batch};
pub use crate::passes::{Arrays, Bind, DispatchArgs, Frequency, MISS, PASSES, Part, Pass, Slot, Texels};
use crate::plan::Plan;
use crate::report::{Fault, Figure, Level, Unit};
use crate::scene::Scene;
use crate::spirv;
use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};

/// The value of all outputs before a dispatch, to recognise texels that it does not write. No pass computes it by chance, and every format stores it
/// almost exactly.
pub const POISON: f64 = 0.654_321;

/// Maximum mean signed error of a dispatch, as a share of the allowed error of a texel. Rounding errors have both signs.
const MAX_BIAS: f64 = 0.1;

/// Bands into which a dispatch is divided, where it has as many rows of workgroups.
const BANDS: u64 = 3;

/// Maximum number of faults of one pass that are listed.
const MAX_FAULTS: usize = 8;

/// One dispatch with its inputs, its outputs, and the outputs of the reference.
pub struct DispatchComparison {
    pub inputs: Arrays,
    pub expected: Arrays,
    pub got: Arrays,
    pub writes: Vec<Bind>,
    pub comparison: Comparison,
}

/// Dispatches one pass alone on inputs of a kind (one of [`KINDS`]), and computes its reference. `iteration`: which of the
/// pass's dispatches in a row, from 0. `seed`: of the random numbers in the inputs.
///
/// # Errors
/// The device fails.
pub fn run_with_reference(
    runner: &mut PassRunner,
    scene: &Scene,
    pass: &'static Pass,
    iteration: u32,
    kind: &str,
    seed: u64,
) -> Result<DispatchComparison, GpuError> {
    let args = dispatch_args_of(scene, pass, iteration);
    let inputs = inputs_of(scene, pass, &args, kind, seed);
    let writes = pass.writes(scene, &args);
    let mut expected = untouched(scene, pass, &args);
    pass.expected(scene, &args, &inputs, &mut expected);
    let extra = ExtraTolerance::of(pass, scene, &args, runner.filter_bits());
    let got = runner.run(scene, pass, &args, &inputs, POISON)?;
    let comparison = compare_outputs(pass, scene, extra, POISON, &expected, &got, &writes);
    Ok(DispatchComparison { inputs, expected, got, writes, comparison })
}

/// Arrays for all that a pass writes, in which no texel has been written.
pub(super) fn untouched(scene: &Scene, pass: &Pass, args: &DispatchArgs) -> Arrays {
    let mut outputs = Arrays::default();
    for bind in pass.writes(scene, args) {
        let channels = bind.slot.format(scene).channels();
        outputs.insert(bind.name, Texels::untouched(bind.slot.array_size(scene), channels));
    }
    outputs
}

/// What the reference of a pass computes from inputs.
fn made_by_reference(scene: &Scene, pass: &Pass, args: &DispatchArgs, inputs: &Arrays) -> Arrays {
    let mut outputs = untouched(scene, pass, args);
    pass.reference(scene, args, inputs, &mut outputs);
    outputs
}

/// The checks of the group "passes": one for each pass.
pub fn checks(_: Level) -> Vec<Check> {
    PASSES.iter().map(|pass| Check::new("passes", pass.name, move |dut| check(dut, pass))).collect()
}

/// The seed of the inputs of a pass, for the kind with this index in [`KINDS`]. It follows from the pass's name, so that a further pass changes the
/// inputs of no other.
pub(super) fn seed_of(pass: &Pass, kind: usize) -> u64 {
    let hashed =
        pass.name.bytes().fold(0xcbf2_9ce4_8422_2325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3));
    hashed ^ kind as u64
}

pub(super) type Variant = (&'static str, Vec<(&'static str, i32)>, Vec<Format>, [bool; 3]);

/// Invocations along each axis in eight workgroups of most shaders.
const EIGHT_WORKGROUPS: [u32; 3] = [64, 64, 8];

/// What distinguishes a dispatch on inputs of one kind: two that are equal here give the same results, because the device is given nothing else.
fn dispatch_key(scene: &Scene, pass: &Pass) -> u64 {
    let mut hasher = DefaultHasher::new();
    variant(scene, pass).hash(&mut hasher);
    for iteration in 0..(pass.repeat)(scene) {
        let args = dispatch_args_of(scene, pass, iteration);
        format!("{:?} {:?}", (pass.params)(scene, &args), (pass.extent)(scene, &args)).hash(&mut hasher);
        for bind in pass.reads(scene, &args).into_iter().chain(pass.writes(scene, &args)) {
            (bind.name, bind.slot.array_size(scene)).hash(&mut hasher);
            if let Initializer::ByScene(make) = bind.slot.initializer() {
                bytemuck::cast_slice::<f32, u8>(&make(scene)).hash(&mut hasher);
            }
        }
    }
    hasher.finish()
}

/// True if the shader of a pass has invocations of a subgroup vote.
fn votes(scene: &Scene, pass: &Pass) -> bool {
    let name = pass.shader(scene, &dispatch_args_of(scene, pass, 0));
    spirv::embedded(name).is_some_and(|bytes| spirv::has_votes(&spirv::words(bytes)))
}

/// A key of what a dispatch exercises: its shader, its constants, the formats of its bindings, and the axes along which it has more than eight
/// workgroups.
pub fn variant(scene: &Scene, pass: &Pass) -> Variant {
    let args = dispatch_args_of(scene, pass, 0);
    let bound = pass.reads(scene, &args).into_iter().chain(pass.writes(scene, &args));
    let extent = pass.invocations(scene, &args);
    let is_wide = std::array::from_fn(|axis| extent[axis] > EIGHT_WORKGROUPS[axis]);
    (pass.shader(scene, &args), pass.constants(scene, &args), bound.map(|b| b.slot.format(scene)).collect(), is_wide)
}

fn check(dut: &mut DeviceUnderTest, pass: &'static Pass) -> Result<Findings, GpuError> {
    let (mut sum, scenes) = (PassSummary::default(), dut.scenes());
    let (mut variants, mut dispatches) = (HashSet::new(), HashSet::new());
    for s in (0..scenes.len()).filter(|s| pass.is_needed(&scenes[*s].1)) {
        // At the quick level: every pipeline once, and some of the other scenes.
        let is_new = variants.insert(variant(&scenes[s].1, pass));
        if dut.level == Level::Full {
            // Noise in every scene, so that a setting that the shader is not given is noticed; extremes once for each different dispatch.
            sum.add(dut, pass, s, dispatches.insert(dispatch_key(&scenes[s].1, pass)))?;
        } else if is_new || s as u64 % 9 == seed_of(pass, 0) % 9 {
            sum.add(dut, pass, s, is_new)?;
        }
    }
    Ok(sum.into_findings(pass))
}

/// Checks one pass in one scene. `n`: index in [`PASSES`]; `scene`: index in [`DeviceUnderTest::scenes`].
///
/// # Errors
/// The device fails.
pub(crate) fn in_scene(dut: &mut DeviceUnderTest, n: usize, scene: usize) -> Result<Findings, GpuError> {
    let mut sum = PassSummary::default();
    sum.add(dut, &PASSES[n], scene, true)?;
    Ok(sum.into_findings(&PASSES[n]))
}

/// The results of many dispatches of one pass, for the outcome of its check.
#[derive(Default)]
pub(super) struct PassSummary {
    findings: Findings,
    runs: u32,
    failed: usize,
    largest: f64,
    used: f64,
    outliers: f64,
    bias: f64,
}

impl PassSummary {
    /// `is_new`: no earlier scene had this pipeline, or at the full level this dispatch.
    fn add(&mut self, dut: &mut DeviceUnderTest, pass: &'static Pass, s: usize, is_new: bool) -> Result<(), GpuError> {
        let (scenes, level) = (dut.scenes(), dut.level);
        let (name, scene) = &scenes[s];
        for (k, kind) in KINDS.iter().enumerate() {
            // Always noise; at the quick level only one of the extremes, alternating, and what votes decide on.
            let is_decided = *kind == SPLIT && is_new && votes(scene, pass);
            if k > 0 && !is_decided && (!is_new || level == Level::Quick && 1 + s % (KINDS.len() - 1) != k) {
                continue;
            }
            for iteration in 0..(pass.repeat)(scene) {
                let result = run_with_reference(dut.pass_runner(), scene, pass, iteration, kind, seed_of(pass, k))?;
                self.record(pass, name, iteration, kind, &result);
                if is_new && (k, iteration) == (0, 0) {
                    self.divide(dut.pass_runner(), (name, scene), pass, &result)?;
                }
            }
        }
        Ok(())
    }

    /// Runs the first dispatch of a scene once more in bands, and compares it with the undivided one bit for bit: an invocation works alone,
    /// whatever workgroup the dispatch begins with.
    fn divide(
        &mut self,
        runner: &mut PassRunner,
        (name, scene): (&str, &Scene),
        pass: &'static Pass,
        whole: &DispatchComparison,
    ) -> Result<(), GpuError> {
        let args = dispatch_args_of(scene, pass, 0);
        let invocations: u64 = (pass.extent)(&runner.adapted(scene), &args).iter().map(|n| u64::from(*n)).product();
        let got = runner.run_within(scene, pass, &args, &whole.inputs, POISON, invocations.div_ceil(BANDS))?;
        for bind in &whole.writes {
            let pairs = whole.got.get(bind.name).values.iter().zip(&got.get(bind.name).values);
            let apart = pairs.filter(|(a, b)| a.to_bits() != b.to_bits()).count();
            self.findings.expect(apart == 0, || {
                format!(
                    "{}: {apart} values of {} differ if the dispatch is divided into bands, '{name}'",
                    pass.name, bind.name
                )
            });
        }
        Ok(())
    }

    /// Adds the result of one dispatch. `name`: name of its scene; `kind`: kind of its inputs.
    pub(super) fn record(&mut self, pass: &Pass, name: &str, iteration: u32, kind: &str, result: &DispatchComparison) {
        let of = &result.comparison;
        (self.largest, self.used) = (self.largest.max(of.largest), self.used.max(of.used));
        (self.outliers, self.runs) = (self.outliers.max(of.outliers), self.runs + 1);
        self.bias = self.bias.max(of.bias);
        let is_biased = of.bias > MAX_BIAS;
        if of.worst.is_none() && !is_biased {
            return;
        }
        self.failed += 1;
        if self.failed > MAX_FAULTS {
            return;
        }
        let what = match &of.worst {
            Some(worst) => format!("{} of {} values beyond tolerance", worst.beyond, worst.texels),
            None => format!("errors go one way: their mean is {:.2} of what is allowed of each", of.bias),
        };
        let input = format!("'{name}', iteration {iteration}, {kind}");
        let (pass, worst) = (Some(pass.name.into()), of.worst.clone());
        self.findings.faults.push(Fault { pass, input, worst, ..Fault::new(what) });
        if let Some(worst) = &of.worst {
            let (e, g) = (result.expected.get(&worst.output), result.got.get(&worst.output));
            self.findings.show(texel_comparison(&format!("{} of '{name}'", worst.output), e, g, worst.at[2]));
        }
    }

    pub(super) fn into_findings(self, pass: &Pass) -> Findings {
        let PassSummary { mut findings, runs, failed, largest, used, outliers, bias } = self;
        findings.expect(runs > 0, || format!("no scene needs '{}'", pass.name));
        findings.expect(failed <= MAX_FAULTS, || format!("{} more inputs beyond tolerance", failed - MAX_FAULTS));
        findings.figures.push(Figure::informative("largest error", largest, Unit::Value));
        findings.figures.push(Figure::error("share of the tolerance", used, 1.0, Unit::Share));
        findings.figures.push(Figure::error("texels beyond it", outliers, pass.tolerance.outliers, Unit::Share));
        findings.figures.push(Figure::error("mean error, share of the tolerance", bias, MAX_BIAS, Unit::Share));
        findings.notes.push(format!("{runs} dispatches; tolerance: {}", pass.tolerance.why));
        findings
    }
}

/// Kinds of inputs of single passes: noise, all zero, all one, a single bright texel, and noise beside empty texels. For distances, mm, noise is a
/// smooth surface with cliffs and misses, a zero or empty texel is a miss, and each texel of "one" is 42 mm. For volumes noise is blurred, so that it
/// resembles tissue.
pub const KINDS: [&str; 5] = ["noise", "zero", "one", "hot", SPLIT];

/// Noise to one side of a column, and nothing to the other, so that some invocations of a subgroup are done before the others: only then do its
/// votes decide anything.
const SPLIT: &str = "split";

/// `slices`: those of the dispatch.
fn input(scene: &Scene, bind: &Bind, slices: u32, kind: &str, noise: &mut Noise) -> Texels {
    let format = bind.slot.format(scene);
    let mut size = bind.slot.array_size(scene);
    if bind.part == Part::Layers {
        size[2] = slices as usize;
    }
    let mut texels = Texels::from_fn(size, format.channels(), |_, _| 0.0);
    if let Initializer::ByScene(make) = bind.slot.initializer() {
        texels.values = make(scene).into_iter().map(f64::from).collect();
        return texels;
    }
    let count = texels.values.len();
    let is_distance = matches!(bind.slot, Slot::Distance | Slot::DistanceA | Slot::DistanceB);
    let tilt = noise.range(-0.4, 0.4);
    // A single texel: of layers in each.
    let one = if matches!(bind.slot.shape(scene), Shape::Layers(_)) { count / size[2] } else { count };
    for i in 0..count {
        let (x, y) = ((i / format.channels() % size[0]) as f64, (i / format.channels() / size[0]) as f64);
        // No multiple of a subgroup's width.
        let kind = match kind {
            SPLIT if x < (size[0] / 2 + 3) as f64 => "noise",
            SPLIT => "zero",
            _ => kind,
        };
        texels.values[i] = match (kind, is_distance) {
            ("noise", true) => match noise.next() {
                share if share < 0.1 => MISS,
                share if share < 0.2 => noise.range(10.0, 90.0),
                _ => 60.0 + tilt * x - 0.2 * y + if x > 9.0 { 8.0 } else { 0.0 } + noise.range(-0.3, 0.3),
            },
            ("zero", true) => MISS,
            ("one", true) => 42.0,
            ("hot", true) if i % one == one / 2 => 33.0,
            ("hot", true) => MISS,
            ("noise", false) => noise.next(),
            ("one", false) => 1.0,
            ("hot", false) if i % one == one / 2 => 1.0,
            _ => 0.0,
        };
    }
    if bind.slot == Slot::StartSurface {
        // Rows of the volume, and beyond both ends.
        let rows = f64::from(scene.grid.size[1]);
        texels.values.iter_mut().for_each(|v| *v = *v * 1.2 * rows - 0.1 * rows);
    }
    if bind.slot == Slot::Picture || bind.slot == Slot::SmoothPicture {
        // The passes write alpha as 0 or 1.
        texels.values.chunks_exact_mut(4).for_each(|p| p[3] = p[3].round());
    }
    if bind.slot == Slot::LatticeErrors {
        // Some pixels are marked, by their rays or by what is between these.
        let allowed = scene.tolerance().unwrap_or(1.0) / LEVELS;
        texels.values.iter_mut().for_each(|v| *v *= allowed);
    }
    if bind.slot == Slot::ErrorMarks && kind == "noise" {
        texels.values.iter_mut().for_each(|v| *v = (*v * f64::from(u32::MAX)).floor());
    }
    if bind.slot == Slot::EdgeMarks {
        texels.values.iter_mut().for_each(|v| *v = v.round());
    }
    if bind.slot == Slot::Surface || bind.slot == Slot::Cap {
        texels.values.chunks_exact_mut(2).for_each(|p| p[1] = p[1].round());
    }
    if [Slot::Volume, Slot::of_rays(scene), Slot::of_planes(scene)].contains(&bind.slot)
        && (kind == "noise" || kind == SPLIT)
    {
        texels = blurred(&texels);
    }
    // Both the device and the reference get values that the format can store.
    Texels::decode(size, format, &texels.encode(format))
}

/// The mean of 5 x 5 x 5 samples, with more contrast. One axis after another: 15 samples each instead of 125.
fn blurred(noise: &Texels) -> Texels {
    let along = |texels: &Texels, axis: usize| {
        Texels::from_fn(texels.size, 1, |at, _| {
            let near = (-2..=2).map(|by| {
                let mut at = at.map(|n| n as i64);
                at[axis] += by;
                texels.clamped(at[0], at[1], at[2])
            });
            near.sum()
        })
    };
    let sums = (0..3).fold(noise.clone(), |sums, axis| along(&sums, axis));
    Texels::from_fn(noise.size, 1, |[x, y, z], _| {
        (0.5 + 4.0 * (sums.clamped(x as i64, y as i64, z as i64) / 125.0 - 0.5)).clamp(0.0, 1.0)
    })
}

/// The empty-space slots of a volume, computed by the references of their passes.
fn empty_space_of(scene: &Scene, slot: Slot, volume: &Texels) -> Texels {
    let mut slots = std::collections::BTreeMap::from([(Slot::of_rays(scene), volume.clone())]);
    let made = |name: &str| {
        ["tile_ranges", "brick_ranges", "classify_bricks", "brick_distance", "still_majorants"]
            .iter()
            .any(|p| name.starts_with(p))
    };
    for step in Plan::new(scene).steps.iter().filter(|s| made(s.pass.name)) {
        let args = DispatchArgs { slices: scene.slices(), ..step.args() };
        let mut inputs = Arrays::default();
        for bind in step.pass.reads(scene, &args) {
            let there = slots.get(&bind.slot).cloned();
            inputs.insert(bind.name, there.unwrap_or_else(|| input(scene, &bind, args.slices, "zero", &mut Noise(1))));
        }
        let outputs = made_by_reference(scene, step.pass, &args, &inputs);
        for bind in step.pass.writes(scene, &args) {
            slots.insert(bind.slot, outputs.get(bind.name).clone());
        }
        if slots.contains_key(&slot) {
            break;
        }
    }
    // A plan with a pass that reads this slot has the passes that write it.
    slots.remove(&slot).unwrap_or_else(|| Texels::untouched([0; 3], 1))
}

/// Arguments of a dispatch for a part of the visible slices of a scene, from the middle one on. A pass for single frames gets at most a batch.
/// `iteration`: which of the pass's dispatches in a row, from 0.
pub fn dispatch_args_of(scene: &Scene, pass: &Pass, iteration: u32) -> DispatchArgs {
    let visible = scene.visible_bounds.slices();
    let slice = (visible.start + visible.end) / 2;
    let slices = scene.slices().div_ceil(3).min(visible.end - slice);
    // The second entry of the ring.
    let layer = frames_per_batch(scene);
    let slices = if pass.frequency == Frequency::Frame { slices.clamp(1, layer) } else { slices };
    DispatchArgs { layer, slice, slices, iteration, image: 0 }
}

/// Inputs of a dispatch, of a kind in [`KINDS`]. Arrays that an earlier pass computes are derived from the other inputs.
pub fn inputs_of(scene: &Scene, pass: &Pass, args: &DispatchArgs, kind: &str, seed: u64) -> Arrays {
    let mut noise = Noise(seed);
    let mut inputs = Arrays::default();
    let reads = pass.reads(scene, args);
    for (n, bind) in reads.iter().enumerate() {
        // An image bound under two names has the same contents.
        let made = reads[..n].iter().find(|b| b.slot == bind.slot).map(|b| inputs.get(b.name).clone());
        inputs.insert(bind.name, made.unwrap_or_else(|| input(scene, bind, args.slices, kind, &mut noise)));
    }
    for bricks in reads.iter().filter(|b| matches!(b.name, "bricks" | "volume_bricks" | "majorants")) {
        // Empty space must be consistent with the volume.
        let distances = empty_space_of(scene, bricks.slot, inputs.get("volume"));
        inputs.insert(bricks.name, distances);
    }
    if reads.iter().any(|b| b.slot == Slot::RefineGroups) {
        // The list of the pixels whose errors are too large.
        let mut of_lattice = inputs_of(scene, &tolerance::ENLARGE, args, kind, seed);
        for pass in [tolerance::ENLARGE, tolerance::LIST] {
            let outputs = made_by_reference(scene, &pass, args, &of_lattice);
            for bind in pass.writes(scene, args) {
                of_lattice.insert(bind.name, outputs.get(bind.name).clone());
            }
        }
        for name in ["error_marks", "marked_before", "refine_groups"] {
            inputs.insert(name, of_lattice.get(name).clone());
        }
    }
    if reads.iter().any(|b| b.slot == Slot::PackedNeighbours) {
        let all = DispatchArgs { slices: scene.slices(), ..DispatchArgs::default() };
        let packed = made_by_reference(scene, &PACKED_NEIGHBOURS, &all, &inputs);
        inputs.insert("packed_neighbours", packed.get("packed_neighbours").clone());
    }
    inputs
}
