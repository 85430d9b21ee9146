//! One dispatch of a pass as files for a bug report, which need nothing of this program: the shader as the driver receives it, the inputs,
//! the numbers, the expected values with their tolerance, and a script for Amber if it can express the dispatch.

mod amber;

use super::DeviceUnderTest;
use super::compare::{ExtraTolerance, tolerance_of};
use super::each_pass::{KINDS, POISON, dispatch_args_of, inputs_of, run_with_reference, seed_of, untouched};
use crate::files;
use crate::gpu::GpuError;
use crate::gpu::pass_runner::PassRunner;
use crate::machine;
use crate::passes::slots::Format;
use crate::passes::{Arrays, Bind, DispatchArgs, Frequency, PASSES, Pass, Texels, interface_check};
use crate::scene::Scene;
use crate::spirv::one_layer::one_layer;
use crate::spirv::{Access, Dimension, Kind};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

/// Names of files in the folder of a reproduction: the shader, and the same for a single layer.
const SHADER: &str = "shader.spv";
const LAYER_SHADER: &str = "shader.layer.spv";
/// The uniform block.
const PARAMS: &str = "params.raw";

/// Minimum number of texels of the outputs of a dispatch that does not fail: fewer say little.
const MIN_TEXELS: u64 = 64;

/// A dispatch with everything that it depends on.
struct Case {
    /// One line: pass, scene and input.
    title: String,
    pass: &'static str,
    scene: String,
    iteration: u32,
    words: Vec<u32>,
    /// Specialization constants by id, and their names.
    constants: Vec<(u32, i32)>,
    constant_names: Vec<String>,
    /// The uniform block.
    params: Vec<u8>,
    params_binding: Option<u32>,
    groups: [u32; 3],
    arrays: Vec<Array>,
    /// Where images have layers, each of which an invocation keeps to: the same a layer, with single images. Otherwise nothing, or why not.
    layers: Result<Vec<Case>, String>,
    /// Share of the texels of an output that may be beyond their tolerance.
    outliers: f64,
    why: &'static str,
}

/// What is bound to the shader under one name.
struct Array {
    name: String,
    binding: u32,
    kind: Kind,
    access: Access,
    dimension: Dimension,
    format: Format,
    /// Texels along x, y and z; of a buffer, floats.
    size: [usize; 3],
    /// Before the dispatch; also the content of the file of this name.
    bytes: Vec<u8>,
    file: String,
    /// Of an output.
    expected: Option<Expected>,
}

/// What an output must hold, value by value.
struct Expected {
    /// By the f64 reference; NaN where the pass writes nothing.
    values: Vec<f64>,
    tolerances: Vec<f64>,
    /// What this device wrote.
    got: Vec<f64>,
}

impl Array {
    /// The bytes as values.
    fn stored(&self) -> Texels {
        Texels::decode(self.size, self.format, &self.bytes)
    }

    /// Keeps the first layer, as an image of its own.
    fn keep_layer(&mut self, file: String) {
        let texels = self.size[0] * self.size[1];
        self.bytes.truncate(self.bytes.len() / self.size[2]);
        for values in self.expected.iter_mut().flat_map(|e| [&mut e.values, &mut e.tolerances]) {
            values.truncate(texels * self.format.channels());
        }
        self.size[2] = 1;
        (self.dimension, self.file) = (Dimension::Two, file);
    }
}

/// What [`reproduce`] has written.
pub struct Reproduction {
    /// One line: pass, scene, iteration and kind of input.
    pub title: String,
    /// True if the dispatch that was written differs from its reference on this device by more than the tolerance.
    pub fails: bool,
    /// Why there is no script for Amber. None if there is one.
    pub without_script: Option<String>,
    /// Names of the files in the folder.
    pub files: Vec<String>,
}

/// Writes a dispatch of a pass with its data into a folder, which is made if needed: the smallest dispatch that fails, otherwise the smallest that
/// writes at least 64 texels. `check`: name of the pass's check, with or without its group (`passes / NAME`).
///
/// # Errors
/// No pass has this name, the device fails, or a file cannot be written.
pub fn reproduce(dut: &mut DeviceUnderTest, check: &str, folder: &Path) -> Result<Reproduction, ReproduceError> {
    let name = check.rsplit(" / ").next().unwrap_or(check).trim();
    let pass = PASSES.iter().find(|pass| pass.name == name).ok_or_else(|| ReproduceError::NoPass(check.into()))?;
    let (case, fails) = find(dut, pass)?;
    let (written, without_script) =
        write(&case, &machine::device(&dut.context), folder).map_err(ReproduceError::File)?;
    Ok(Reproduction { title: case.title, fails, without_script, files: written })
}

/// Why nothing was reproduced.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    #[error("'{0}' compares no pass with its reference; those of the group 'passes' do (--list)")]
    NoPass(String),
    #[error(transparent)]
    Device(#[from] GpuError),
    #[error("{0}")]
    File(String),
}

/// The smallest dispatch of the pass that fails, otherwise the smallest that tells something; and whether it fails.
fn find(dut: &mut DeviceUnderTest, pass: &'static Pass) -> Result<(Case, bool), ReproduceError> {
    let scenes = dut.scenes();
    let size = |scene: &Scene| -> u64 {
        let args = dispatch_args_of(scene, pass, 0);
        pass.reads(scene, &args).iter().chain(&pass.writes(scene, &args)).map(|bind| bind.slot.bytes(scene)).sum()
    };
    let mut needed: Vec<&(String, Scene)> = scenes.iter().filter(|(_, scene)| pass.is_needed(scene)).collect();
    needed.sort_by_key(|(_, scene)| size(scene));
    let mut tried = Vec::new();
    for (name, scene) in &needed {
        for (k, kind) in KINDS.iter().enumerate() {
            for iteration in 0..(pass.repeat)(scene) {
                tried.push(Choice { name, scene, kind, iteration, seed: seed_of(pass, k) });
            }
        }
    }
    for choice in &tried {
        let Choice { scene, kind, iteration, seed, .. } = *choice;
        let worst = run_with_reference(dut.pass_runner(), scene, pass, iteration, kind, seed)?.comparison.worst;
        if worst.is_some() {
            return Ok((case(dut, pass, choice)?, true));
        }
    }
    let is_telling = |choice: &&Choice| {
        let writes = pass.writes(choice.scene, &dispatch_args_of(choice.scene, pass, choice.iteration));
        writes.iter().map(|bind| bind.slot.shape(choice.scene).texels()).sum::<u64>() >= MIN_TEXELS
    };
    let first = tried.iter().find(is_telling).or(tried.first());
    let first = first.ok_or_else(|| ReproduceError::NoPass(pass.name.into()))?;
    Ok((case(dut, pass, first)?, false))
}

/// The input of a dispatch.
struct Choice<'a> {
    name: &'a str,
    scene: &'a Scene,
    kind: &'static str,
    iteration: u32,
    seed: u64,
}

fn case(dut: &mut DeviceUnderTest, pass: &'static Pass, choice: &Choice) -> Result<Case, GpuError> {
    let runner = dut.pass_runner();
    // Of the frame array there are the layers of the dispatch.
    let args = DispatchArgs { layer: 0, ..dispatch_args_of(&runner.adapted(choice.scene), pass, choice.iteration) };
    // The inputs of the check, which come from the scene before it is adapted.
    let inputs = inputs_of(choice.scene, pass, &args, choice.kind, choice.seed);
    let mut case = case_of(runner, pass, choice, &args, &inputs)?;
    let Some(layered) = case.arrays.iter().find(|array| array.dimension == Dimension::Layers) else { return Ok(case) };
    case.layers = match pass.frequency {
        Frequency::Frame => {
            (0..args.slices).map(|n| layer(runner, pass, choice, (&args, n), &inputs)).collect::<Result<_, _>>()?
        }
        _ => {
            Err(format!("an invocation reads several layers of '{}', and Amber has no arrays of images", layered.name))
        }
    };
    Ok(case)
}

/// The dispatch of one frame of those of `args`, on single images.
fn layer(
    runner: &mut PassRunner,
    pass: &'static Pass,
    choice: &Choice,
    (args, n): (&DispatchArgs, u32),
    inputs: &Arrays,
) -> Result<Result<Case, String>, GpuError> {
    let scene = &runner.adapted(choice.scene);
    let args = DispatchArgs { slice: args.slice + n, slices: 1, ..*args };
    let mut own = inputs.clone();
    for bind in pass.reads(scene, &args).iter().filter(|bind| bind.slot.is_layered(scene)) {
        let all = inputs.get(bind.name);
        let [width, height, depth] = all.size;
        let at = depth.saturating_sub(1).min(n as usize);
        own.insert(bind.name, Texels::from_fn([width, height, 1], all.channels, |[x, y, _], c| all.get([x, y, at])[c]));
    }
    let mut case = case_of(runner, pass, choice, &args, &own)?;
    for array in case.arrays.iter_mut().filter(|array| array.dimension == Dimension::Layers) {
        array.keep_layer(format!("{}.layer{n}.raw", array.name));
    }
    case.title += &format!(", layer {n}");
    Ok(match one_layer(&case.words) {
        Ok(words) => Ok(Case { words, ..case }),
        Err(why) => Err(why.to_string()),
    })
}

fn case_of(
    runner: &mut PassRunner,
    pass: &'static Pass,
    choice: &Choice,
    args: &DispatchArgs,
    inputs: &Arrays,
) -> Result<Case, GpuError> {
    let scene = &runner.adapted(choice.scene);
    let (mut expected, writes) = (untouched(scene, pass, args), pass.writes(scene, args));
    pass.expected(choice.scene, args, inputs, &mut expected);
    let shader = runner.shader(scene, pass, args)?;
    let extra = ExtraTolerance::of(pass, scene, args, runner.filter_bits());
    let got = runner.run(choice.scene, pass, args, inputs, POISON)?;
    let (mut arrays, mut params_binding) = (Vec::new(), None);
    for binding in &shader.module.bindings {
        if binding.kind == Kind::Params {
            params_binding = Some(binding.binding);
            continue;
        }
        let reads = pass.reads(scene, args);
        let is_output = writes.iter().find(|bind| bind.name == binding.name);
        let Some(bind) = is_output.or_else(|| reads.iter().find(|bind| bind.name == binding.name)) else { continue };
        let (bytes, size) = before(scene, bind, inputs, is_output.is_some());
        let format = bind.slot.format(scene);
        let expected = is_output.map(|bind| {
            let values = expected.get(bind.name).stored_part(bind.slot, scene).values;
            let tolerances = values.iter().map(|e| tolerance_of(pass, extra, bind.slot, format, *e)).collect();
            Expected { values, tolerances, got: got.get(bind.name).stored_part(bind.slot, scene).values }
        });
        arrays.push(Array {
            name: binding.name.clone(),
            binding: binding.binding,
            kind: binding.kind,
            access: binding.access,
            dimension: binding.dimension,
            format,
            size,
            bytes,
            file: format!("{}.raw", binding.name),
            expected,
        });
    }
    let params = interface_check::pack(&shader.module, &pass.numbers(scene, args));
    let extent = pass.invocations(scene, args);
    let groups = std::array::from_fn(|axis| extent[axis].div_ceil(shader.module.local_size[axis]));
    let ids = shader.module.constants.iter().filter_map(|constant| {
        let (_, value) = shader.constants.iter().find(|(name, _)| *name == constant.name)?;
        Some(((constant.id, *value), constant.name.clone()))
    });
    let (constants, constant_names) = ids.unzip();
    Ok(Case {
        pass: pass.name,
        scene: choice.name.to_string(),
        iteration: choice.iteration,
        title: format!("pass {}, scene '{}', iteration {}, {}", pass.name, choice.name, choice.iteration, choice.kind),
        words: shader.words,
        constants,
        constant_names,
        params,
        params_binding,
        groups,
        arrays,
        layers: Ok(Vec::new()),
        outliers: pass.tolerance.outliers + extra.outliers,
        why: pass.tolerance.why,
    })
}

/// What a slot holds before the dispatch, and its size in texels.
fn before(scene: &Scene, bind: &Bind, inputs: &Arrays, is_output: bool) -> (Vec<u8>, [usize; 3]) {
    let format = bind.slot.format(scene);
    let given = inputs.iter().find(|(name, _)| *name == bind.name).filter(|_| !is_output);
    let texels = match given {
        Some((_, texels)) => texels.stored_part(bind.slot, scene),
        None => {
            let filler = if is_output { POISON } else { 0.0 };
            Texels::from_fn(bind.slot.shape(scene).size(), format.channels(), |_, _| filler)
        }
    };
    (texels.encode(format), texels.size)
}

/// Writes the files. Returns their names, and why there is no script.
fn write(case: &Case, device: &machine::Device, folder: &Path) -> Result<(Vec<String>, Option<String>), String> {
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: cannot be made: {e}", folder.display()))?;
    let mut written = Vec::new();
    let mut put = |name: &str, bytes: &[u8]| {
        written.push(name.to_string());
        files::replace(&folder.join(name), bytes)
    };
    let of_words = |words: &[u32]| words.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>();
    let of_f64 = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    put(SHADER, &of_words(&case.words))?;
    put(PARAMS, &case.params)?;
    for array in &case.arrays {
        put(&array.file, &array.bytes)?;
        if let Some(expected) = &array.expected {
            put(&format!("{}.expected.f64", array.name), &of_f64(&expected.values))?;
            put(&format!("{}.tolerance.f64", array.name), &of_f64(&expected.tolerances))?;
            put(&format!("{}.got.f64", array.name), &of_f64(&expected.got))?;
        }
    }
    let scripts = amber::scripts(case);
    for script in scripts.iter().flatten() {
        put(&script.name, script.text.as_bytes())?;
        if script.is_of_layer {
            put(&script.params, &script.case.params)?;
            for array in script.case.arrays.iter().filter(|array| array.file != format!("{}.raw", array.name)) {
                put(&array.file, &array.bytes)?;
            }
        }
    }
    if let Some(script) = scripts.iter().flatten().find(|script| script.is_of_layer) {
        put(LAYER_SHADER, &of_words(&script.case.words))?;
    }
    put("dispatch.json", (described(case, device) + "\n").as_bytes())?;
    put("README.md", readme(case, device, &scripts).as_bytes())?;
    Ok((written, scripts.err()))
}

/// The dispatch for programs: what is bound where, in which file.
fn described(case: &Case, device: &machine::Device) -> String {
    let array = |array: &Array| {
        json!({
            "name": array.name,
            "binding": array.binding,
            "kind": format!("{:?}", array.kind),
            "format": format!("{:?}", array.format),
            "dimension": format!("{:?}", array.dimension),
            "size": array.size,
            "is_output": array.expected.is_some(),
            "file": array.file,
            "bytes": array.bytes.len(),
        })
    };
    let constants = case.constants.iter().zip(&case.constant_names);
    let constants: Vec<_> =
        constants.map(|((id, value), name)| json!({ "id": id, "name": name, "value": value })).collect();
    let all = json!({
        "format": "echolume-dispatch-1",
        "title": case.title,
        "pass": case.pass,
        "scene": case.scene,
        "iteration": case.iteration,
        "device": device.name,
        "driver": device.driver,
        "vulkan": device.api,
        "workgroups": case.groups,
        "constants": constants,
        "params_binding": case.params_binding,
        "arrays": case.arrays.iter().map(array).collect::<Vec<_>>(),
        "outliers": case.outliers,
    });
    format!("{all:#}")
}

fn readme(case: &Case, device: &machine::Device, scripts: &Result<Vec<amber::Script>, String>) -> String {
    let mut text = format!(
        "# One compute dispatch and its expected result\n\n{}. Written by {} on {}, {}, Vulkan {}.\n\n",
        case.title,
        machine::program(),
        device.name,
        device.driver,
        device.api
    );
    let [x, y, z] = case.groups;
    let _ = writeln!(
        text,
        "`shader.spv` (entry point `main`) runs once with {x} x {y} x {z} workgroups, descriptor set 0 and the specialization constants of \
         `dispatch.json`, which also lists all bindings. `params.raw` is the uniform block, `NAME.raw` the content of each binding before the \
         dispatch, rows from the top, without padding. `NAME.expected.f64` holds what an output must hold after it (little-endian doubles; NaN \
         where nothing is written), `NAME.tolerance.f64` the largest error of each value ({}). \
         `NAME.got.f64` holds what this device wrote.",
        case.why
    );
    if case.outliers > 0.0 {
        let _ = writeln!(text, "At most {} % of the texels may be further off.", 100.0 * case.outliers);
    }
    text.push('\n');
    match scripts {
        Ok(scripts) => text + &amber::about(case, scripts),
        Err(why) => text + &format!("There is no Amber script: {why}.\n"),
    }
}
