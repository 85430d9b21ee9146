//! Measures the compilation of the pipelines of scenes: its time without any cache and with one, and the driver's statistics on the result
//! (VK_KHR_pipeline_executable_properties). Nothing is submitted, so a driver is enough and no working device is needed.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::formats::{self, TexelAccess};
use super::pipeline_cache;
use super::pipelines::{Compile, Key, Pipelines, Prepared, Shaders, embedded};
use crate::passes::slots::Format;
use crate::passes::{DispatchArgs, Pass};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::spirv;
use ash::vk;
use std::collections::HashSet;
use std::ffi::CStr;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// A pipeline with measurements of its compilation.
pub struct MeasuredPipeline {
    /// The first pass, in the order of the scenes, that uses it.
    pub pass: &'static str,
    pub shader: &'static str,
    /// Specialization constants by name.
    pub constants: Vec<(&'static str, i32)>,
    /// Formats of the inputs, in the order in which the pass declares them.
    pub formats: Vec<Format>,
    /// The executables that the driver compiled for it. Empty without
    /// [`ContextOptions::compile_statistics`](super::ContextOptions::compile_statistics), and if the device does not list them.
    pub executables: Vec<Executable>,
    /// Compile time if neither a pipeline cache nor the driver's own cache holds the pipeline.
    pub cold: Duration,
    /// Compile time with a pipeline cache that holds the pipeline.
    pub warm: Duration,
    /// True if the driver took the pipeline from the cache when `warm` was measured. `None` if the driver does not report it.
    pub warm_hit: Option<bool>,
}

/// An executable of a pipeline (VK_KHR_pipeline_executable_properties). A pipeline may have several, of which the driver chooses one for a dispatch.
pub struct Executable {
    pub name: String,
    /// Number of invocations in a subgroup.
    pub subgroup: u32,
    /// The driver's statistics on it, by the driver's names.
    pub statistics: Vec<(String, f64)>,
}

/// A pipeline to measure.
struct Target<'a> {
    key: Key,
    pass: &'static Pass,
    scene: &'a Scene,
    args: DispatchArgs,
}

/// Measures the compilation of every pipeline that these scenes need on a device, in the order of the scenes. Each pipeline has one entry.
///
/// # Errors
/// The device cannot hold a scene, a shader does not compile, or the driver fails.
pub fn measure(
    context: &Arc<Context>,
    scenes: &[Scene],
    shaders: &Arc<Shaders>,
) -> Result<Vec<MeasuredPipeline>, GpuError> {
    let texel_access = TexelAccess::for_device(&context.candidate);
    let pipelines = Pipelines::new(context, shaders.clone(), texel_access)?;
    let scenes: Vec<Scene> =
        scenes.iter().map(|scene| formats::adapt_scene(context, texel_access, scene.clone())).collect();
    let mut known = HashSet::new();
    let mut targets = Vec::new();
    for scene in &scenes {
        let plan = Plan::new(scene);
        formats::check(context, &plan, scene)?;
        for step in &plan.steps {
            let args = step.args();
            let key = pipelines.key(step.pass, scene, &args);
            if known.insert(key.clone()) {
                targets.push(Target { key, pass: step.pass, scene, args });
            }
        }
    }
    measure_targets(context, &pipelines, &targets)
}

/// Sum of the times to compile each pipeline of a pass in a scene once, without any cache.
///
/// # Errors
/// A shader does not compile, or the driver fails.
pub fn compile_time(context: &Arc<Context>, scene: &Scene, pass: &'static Pass) -> Result<Duration, GpuError> {
    let texel_access = TexelAccess::for_device(&context.candidate);
    let pipelines = Pipelines::new(context, embedded(), texel_access)?;
    let scene = formats::adapt_scene(context, texel_access, scene.clone());
    let mut known = HashSet::new();
    let mut sum = Duration::ZERO;
    for iteration in 0..(pass.repeat)(&scene) {
        let args = DispatchArgs { iteration, ..DispatchArgs::default() };
        let key = pipelines.key(pass, &scene, &args);
        if known.insert(key.clone()) {
            let target = Target { key, pass, scene: &scene, args };
            let how = Compile { cache: vk::PipelineCache::null(), flags: vk::PipelineCreateFlags::empty() };
            let pipeline = pipelines.compile(target.key.0, prepare(&pipelines, &target, run_number())?, how)?;
            sum += pipeline.compilation.0;
        }
    }
    Ok(sum)
}

/// A cache that is destroyed with this.
struct OwnCache<'a> {
    context: &'a Context,
    handle: vk::PipelineCache,
}

impl OwnCache<'_> {
    fn new<'a>(context: &'a Context, data: &[u8]) -> Result<OwnCache<'a>, GpuError> {
        let handle = pipeline_cache::create(&context.device, data).context(|| "create a pipeline cache".into())?;
        Ok(OwnCache { context, handle })
    }

    fn data(&self) -> Result<Vec<u8>, GpuError> {
        // SAFETY: the cache is alive, and no other thread uses it.
        unsafe { self.context.device.get_pipeline_cache_data(self.handle) }.context(|| "read a pipeline cache".into())
    }
}

impl Drop for OwnCache<'_> {
    fn drop(&mut self) {
        // SAFETY: only this thread makes pipelines with it, and none is in the making.
        unsafe { self.context.device.destroy_pipeline_cache(self.handle, None) };
    }
}

fn measure_targets(
    context: &Arc<Context>,
    pipelines: &Pipelines,
    targets: &[Target],
) -> Result<Vec<MeasuredPipeline>, GpuError> {
    let flags = match context.executables {
        Some(_) => vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR,
        None => vk::PipelineCreateFlags::empty(),
    };
    let run = run_number();
    let first = OwnCache::new(context, &[])?;
    let mut measured = Vec::with_capacity(targets.len());
    for target in targets {
        let how = Compile { cache: first.handle, flags };
        let pipeline = pipelines.compile(target.key.0, prepare(pipelines, target, run)?, how)?;
        let (shader, constants, formats) = target.key.clone();
        measured.push(MeasuredPipeline {
            pass: target.pass.name,
            shader,
            constants,
            formats: formats.into_iter().map(|(format, _)| format).collect(),
            executables: executables(context, pipeline.handle).context(|| format!("read statistics of '{shader}'"))?,
            cold: pipeline.compilation.0,
            warm: Duration::ZERO,
            warm_hit: None,
        });
    }
    // As the next run of a program would have it: from the bytes.
    let second = OwnCache::new(context, &first.data()?)?;
    for (target, measured) in targets.iter().zip(&mut measured) {
        let how = Compile { cache: second.handle, flags };
        let pipeline = pipelines.compile(target.key.0, prepare(pipelines, target, run)?, how)?;
        (measured.warm, measured.warm_hit) = pipeline.compilation;
    }
    Ok(measured)
}

/// What a target is compiled from: as for drawing, but no driver has it in a cache of its own.
fn prepare(pipelines: &Pipelines, target: &Target, run: u16) -> Result<Prepared, GpuError> {
    let mut prepared = pipelines.prepare(&target.key, target.pass, target.scene, &target.args)?;
    spirv::set_tool_version(&mut prepared.words, run);
    Ok(prepared)
}

/// A number that hardly any other run has: from the clock.
fn run_number() -> u16 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    // Mixed, because clocks tick in round numbers; the upper bits are the best (Knuth's multiplicative hash).
    ((since.as_nanos() as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 49) as u16
}

fn executables(context: &Context, pipeline: vk::Pipeline) -> Result<Vec<Executable>, vk::Result> {
    let Some(device) = &context.executables else { return Ok(Vec::new()) };
    let pipeline_info = vk::PipelineInfoKHR::default().pipeline(pipeline);
    // SAFETY: the pipeline is alive, of this device, and was made with statistics.
    let properties = unsafe { device.get_pipeline_executable_properties(&pipeline_info) }?;
    let one = |(index, properties): (usize, &vk::PipelineExecutablePropertiesKHR)| {
        let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(index as u32);
        // SAFETY: as above; the driver listed this executable.
        let statistics = unsafe { device.get_pipeline_executable_statistics(&executable) }?;
        Ok(Executable {
            name: text(properties.name_as_c_str()),
            subgroup: properties.subgroup_size,
            statistics: statistics.iter().map(|s| (text(s.name_as_c_str()), value(s))).collect(),
        })
    };
    properties.iter().enumerate().map(one).collect()
}

fn text<E>(name: Result<&CStr, E>) -> String {
    name.map_or_else(|_| "?".into(), |name| name.to_string_lossy().into_owned())
}

fn value(statistic: &vk::PipelineExecutableStatisticKHR) -> f64 {
    let value = statistic.value;
    // SAFETY: the driver says which member of the union it wrote; every bit pattern is a value of each.
    unsafe {
        match statistic.format {
            vk::PipelineExecutableStatisticFormatKHR::BOOL32 => f64::from(u8::from(value.b32 != 0)),
            vk::PipelineExecutableStatisticFormatKHR::INT64 => value.i64 as f64,
            vk::PipelineExecutableStatisticFormatKHR::UINT64 => value.u64 as f64,
            _ => value.f64,
        }
    }
}
