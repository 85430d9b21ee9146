//! Compute pipelines: a layout from the reflected bindings, and a pipeline for each set of specialization constants. All pipelines that a
//! plan lacks are compiled in parallel, one on each core.

use super::bands::InvocationTime;
use super::buffers::has_texels;
use super::calls;
use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::formats::{self, TexelAccess};
use super::recently_used::RecentlyUsed;
use super::resources;
use crate::passes::fault_injection::Command;
use crate::passes::slots::{Format, Shape};
use crate::passes::{DispatchArgs, Pass, Slot, interface_check};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::spirv::dead_code::remove_dead_code;
use crate::spirv::specialize::specialize;
use crate::spirv::{self, Kind, Module};
use crate::sync::locked;
use ash::vk;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, Weak};
use std::time::{Duration, Instant};

/// A compute pipeline and its layout.
pub struct Pipeline {
    context: Arc<Context>,
    pub module: Module,
    /// The linear sampler of its filtered textures; [`Pipelines`] owns it.
    pub sampler: vk::Sampler,
    pub(crate) set_layout: vk::DescriptorSetLayout,
    pub layout: vk::PipelineLayout,
    pub handle: vk::Pipeline,
    /// Compile time, and whether the pipeline came from a pipeline cache (`None` if the driver does not report it).
    pub compilation: (Duration, Option<bool>),
    /// Time of one invocation, ns, measured on the pipeline's last dispatches.
    pub time: Arc<InvocationTime>,
}

/// What determines a pipeline: shader, specialization constants, and for each input its format, and true if it is read as a storage image or a texel
/// buffer, false if in another way. The last may differ between slots, because a lookup table may be too large for a texel buffer.
pub type Key = (&'static str, Vec<(&'static str, i32)>, Vec<(Format, bool)>);

/// The input of a compilation: SPIR-V as the device gets it, its reflected declarations, and the values of specialization constants by name.
pub struct Prepared {
    pub words: Vec<u32>,
    pub module: Module,
    pub constants: Vec<(&'static str, i32)>,
}

/// The cache and the flags that a pipeline is compiled with.
#[derive(Clone, Copy)]
pub struct Compile {
    pub cache: vk::PipelineCache,
    pub flags: vk::PipelineCreateFlags,
}

/// A function that returns the SPIR-V words of a shader, given its name: its path below glsl/ and its variant, such as `filter/sigma.slice`.
pub type Shaders = dyn Fn(&str) -> Result<Vec<u32>, String> + Send + Sync;

/// A pipeline that was compiled just now.
type Compiled = (Key, Arc<Pipeline>);

/// The pipelines of a plan, one for each step, or the first fault.
pub type PlanPipelines = Result<Vec<Arc<Pipeline>>, GpuError>;

/// Is asked with the number of missing pipelines compiled so far and the number of missing ones; false ends the compilation.
pub type GoesOn<'a> = dyn Fn(usize, usize) -> bool + Sync + 'a;

/// The compiled pipelines, so that returning to an earlier setting compiles nothing. Of the pipelines that no plan uses, the most recently used
/// [`ContextOptions::max_unused_pipelines`](super::ContextOptions::max_unused_pipelines) are kept.
pub struct Pipelines {
    pub(super) context: Arc<Context>,
    made: Mutex<RecentlyUsed<Key, Pipeline>>,
    shaders: Arc<Shaders>,
    texel_access: TexelAccess,
    sampler: vk::Sampler,
}

/// A function that returns the embedded shaders. Every call returns the same `Arc`.
pub fn embedded() -> Arc<Shaders> {
    static EMBEDDED: LazyLock<Arc<Shaders>> = LazyLock::new(|| {
        Arc::new(|name| {
            spirv::embedded(name).map(spirv::words).ok_or_else(|| "is not embedded; run tools/shaders".to_string())
        })
    });
    EMBEDDED.clone()
}

pub(crate) fn descriptor_type(kind: Kind) -> vk::DescriptorType {
    match kind {
        Kind::Params => vk::DescriptorType::UNIFORM_BUFFER,
        Kind::Sampled => vk::DescriptorType::SAMPLED_IMAGE,
        Kind::Filtered => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        Kind::Storage => vk::DescriptorType::STORAGE_IMAGE,
        Kind::Buffer => vk::DescriptorType::STORAGE_BUFFER,
        Kind::Texels(_) => vk::DescriptorType::STORAGE_TEXEL_BUFFER,
    }
}

impl Pipelines {
    /// The pipelines of these shaders. Those of the embedded shaders are shared by all renderers of a context with the same `texel_access`, so that a
    /// second renderer of a scene compiles nothing.
    ///
    /// # Errors
    /// The device fails.
    pub fn shared(
        context: &Arc<Context>,
        shaders: Arc<Shaders>,
        texel_access: TexelAccess,
    ) -> Result<Arc<Pipelines>, GpuError> {
        if !Arc::ptr_eq(&shaders, &embedded()) {
            return Ok(Arc::new(Pipelines::new(context, shaders, texel_access)?));
        }
        let mut shared = locked(&context.shared);
        shared.retain(|held| held.strong_count() > 0);
        let mut held = shared.iter().filter_map(Weak::upgrade).filter_map(|held| held.downcast::<Pipelines>().ok());
        if let Some(found) = held.find(|p| p.texel_access == texel_access) {
            return Ok(found);
        }
        let made = Arc::new(Pipelines::new(context, shaders, texel_access)?);
        let weak: Weak<Pipelines> = Arc::downgrade(&made);
        shared.push(weak);
        Ok(made)
    }

    /// Makes an empty collection of pipelines that no other renderer uses, unlike that of [`Pipelines::shared`].
    ///
    /// # Errors
    /// The device cannot create the sampler.
    pub fn new(
        context: &Arc<Context>,
        shaders: Arc<Shaders>,
        texel_access: TexelAccess,
    ) -> Result<Pipelines, GpuError> {
        let sampler = resources::sampler(context, context.faults.filter())?;
        context.name(sampler, "trilinear");
        let made = Mutex::new(RecentlyUsed::new(context.max_unused_pipelines));
        Ok(Pipelines { context: context.clone(), made, shaders, texel_access, sampler })
    }

    /// The key of the pipeline for a dispatch of a pass in a scene.
    pub fn key(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Key {
        let inputs =
            pass.reads(scene, args).iter().map(|b| (b.slot.format(scene), self.stores(b.slot, scene))).collect();
        (pass.shader(scene, args), pass.constants(scene, args), inputs)
    }

    /// True if passes read this input as a storage image or a texel buffer: they do where texels are read by storage, and the slot allows it.
    fn stores(&self, slot: Slot, scene: &Scene) -> bool {
        self.texel_access == TexelAccess::Storage
            && match slot.shape(scene) {
                Shape::Buffer(bytes) => has_texels(&self.context, bytes.into()),
                _ => formats::usage(&self.context, slot).contains(vk::ImageUsageFlags::STORAGE),
            }
    }

    /// The pipeline of a key. None if it is not compiled.
    pub fn cached(&self, key: &Key) -> Option<Arc<Pipeline>> {
        locked(&self.made).get(key)
    }

    /// Keeps a pipeline. What is forgotten for it is destroyed without the lock: some drivers take their time.
    fn keep(&self, key: Key, pipeline: Arc<Pipeline>) {
        let forgotten = locked(&self.made).insert(key, pipeline);
        drop(forgotten);
    }

    /// The pipeline for a dispatch of a pass in a scene; it is compiled at its first use.
    ///
    /// # Errors
    /// The shader does not exist, disagrees with the declaration of the pass, or is refused by the driver.
    pub fn get(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Result<Arc<Pipeline>, GpuError> {
        let key = self.key(pass, scene, args);
        if let Some(pipeline) = self.cached(&key) {
            return Ok(pipeline);
        }
        let pipeline = self.make(&key, pass, scene, args)?;
        // Another thread may have made the same pipeline meanwhile; either can be used.
        self.keep(key, pipeline.clone());
        Ok(pipeline)
    }

    /// The pipelines of a plan, one for each step. Missing ones are compiled in parallel. Before the first and after each of them `goes_on` is called
    /// with the number of compiled pipelines and the total; if it returns false, the rest is not compiled, and the result lacks the steps whose
    /// pipelines are missing.
    ///
    /// # Errors
    /// A shader does not exist, disagrees with the declaration of its pass, or is refused by the driver: the fault of the first step that has one.
    /// Pipelines that were compiled are kept.
    pub(super) fn of_plan_while(&self, plan: &Plan, scene: &Scene, goes_on: &GoesOn) -> PlanPipelines {
        let (steps, compiled) = self.complete(plan, scene, |key| self.cached(key), goes_on);
        compiled.into_iter().for_each(|(key, pipeline)| self.keep(key, pipeline));
        steps
    }

    /// Compiles those pipelines of a plan again that use `shaders`, and drops all other pipelines that use them. Returns the pipelines of the plan,
    /// one for each step. The device must have finished with the previous pipelines, and no other thread may compile any.
    ///
    /// # Errors
    /// A shader does not exist, disagrees with the declaration of its pass, or is refused by the driver; the previous pipelines stay.
    pub(super) fn recompile(&self, shaders: &HashSet<String>, plan: &Plan, scene: &Scene) -> PlanPipelines {
        let is_current = |key: &Key| !shaders.contains(key.0);
        let current = |key: &Key| is_current(key).then(|| self.cached(key)).flatten();
        let (steps, compiled) = self.complete(plan, scene, current, &|_, _| true);
        let steps = steps?;
        locked(&self.made).retain(is_current);
        compiled.into_iter().for_each(|(key, pipeline)| self.keep(key, pipeline));
        Ok(steps)
    }

    /// The pipelines of a plan by step, or the first fault, and those that `cached` did not have and that were compiled.
    fn complete(
        &self,
        plan: &Plan,
        scene: &Scene,
        cached: impl Fn(&Key) -> Option<Arc<Pipeline>>,
        goes_on: &GoesOn,
    ) -> (PlanPipelines, Vec<Compiled>) {
        let keys: Vec<Key> = plan.steps.iter().map(|step| self.key(step.pass, scene, &step.args())).collect();
        let mut found: HashMap<&Key, Arc<Pipeline>> = HashMap::new();
        let mut missing: Vec<usize> = Vec::new();
        let mut seen = HashSet::new();
        for (i, key) in keys.iter().enumerate().filter(|(_, key)| seen.insert(*key)) {
            match cached(key) {
                Some(pipeline) => drop(found.insert(key, pipeline)),
                None => missing.push(i),
            }
        }
        let (count, done) = (missing.len(), AtomicUsize::new(0));
        let is_stopped = AtomicBool::new(!goes_on(0, count));
        let compile = |&i: &usize| {
            if is_stopped.load(Ordering::Relaxed) {
                return None;
            }
            let made = self.make(&keys[i], plan.steps[i].pass, scene, &plan.steps[i].args());
            if !goes_on(done.fetch_add(1, Ordering::Relaxed) + 1, count) {
                is_stopped.store(true, Ordering::Relaxed);
            }
            Some((i, made))
        };
        let results: Vec<Option<(usize, Result<_, GpuError>)>> = missing.par_iter().map(compile).collect();
        let (mut compiled, mut fault) = (Vec::new(), None);
        for (i, result) in results.into_iter().flatten() {
            match result {
                Ok(pipeline) => {
                    found.insert(&keys[i], pipeline.clone());
                    compiled.push((keys[i].clone(), pipeline));
                }
                Err(error) => drop(fault.get_or_insert(error)),
            }
        }
        let steps = match fault {
            Some(error) => Err(error),
            None => Ok(keys.iter().filter_map(|key| found.get(key).cloned()).collect()),
        };
        (steps, compiled)
    }

    fn make(&self, key: &Key, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Result<Arc<Pipeline>, GpuError> {
        let prepared = self.prepare(key, pass, scene, args)?;
        let cache = &self.context.pipeline_cache;
        let how = Compile { cache: cache.handle, flags: vk::PipelineCreateFlags::empty() };
        let pipeline = self.compile(key.0, prepared, how)?;
        cache.used(pipeline.compilation.1);
        Ok(Arc::new(pipeline))
    }

    /// The input for the compilation of the pipeline of a pass in a scene.
    ///
    /// # Errors
    /// The shader does not exist, or disagrees with the declaration of the pass.
    pub fn prepare(&self, key: &Key, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Result<Prepared, GpuError> {
        let at_fault = |fault: String| GpuError::Shader { shader: key.0.to_string(), fault };
        let words = (self.shaders)(key.0).map_err(at_fault)?;
        let mut words = interface_check::for_scene(pass, scene, args, &words).map_err(at_fault)?;
        if self.texel_access == TexelAccess::Storage {
            let stores = |slot: Slot| self.stores(slot, scene);
            words = interface_check::for_cpu(pass, scene, args, &words, stores).map_err(at_fault)?;
        }
        self.context.faults.words(pass.name, &mut words).map_err(at_fault)?;
        let module = spirv::reflect(&words).map_err(|e| at_fault(e.to_string()))?;
        interface_check::check(pass, scene, args, &module).map_err(|e| at_fault(format!("{}: {e}", pass.name)))?;
        let constants = self.context.faults.constants(pass.name, &key.1);
        if self.context.specializes {
            // The driver ignores values of constants that the module does not have.
            words = specialize(&words, &by_id(&module, &constants))
                .and_then(|words| remove_dead_code(&words))
                .map_err(|e| at_fault(e.to_string()))?;
        }
        Ok(Prepared { words, module, constants })
    }

    /// Compiles a pipeline without keeping it.
    ///
    /// # Errors
    /// The driver refuses the shader, or memory is exhausted.
    pub fn compile(&self, name: &'static str, prepared: Prepared, how: Compile) -> Result<Pipeline, GpuError> {
        let Prepared { words, module, constants } = prepared;
        let context = &self.context;
        let device = &context.device;
        let operation = || format!("create pipeline '{name}'");
        let bindings: Vec<_> = module
            .bindings
            .iter()
            .map(|b| {
                // Without immutable samplers: lavapipe of Mesa 26.2 loses those of pushed descriptors.
                vk::DescriptorSetLayoutBinding::default()
                    .binding(b.binding)
                    .descriptor_type(descriptor_type(b.kind))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let flags = match context.push_descriptor {
            Some(_) => vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR,
            None => vk::DescriptorSetLayoutCreateFlags::empty(),
        };
        let create = vk::DescriptorSetLayoutCreateInfo::default().flags(flags).bindings(&bindings);
        // SAFETY: the structures are complete and outlive the calls; a failure below drops `pipeline`, which frees what is made.
        let set_layout = unsafe { device.create_descriptor_set_layout(&create, None) }.context(operation)?;
        let mut pipeline = Pipeline {
            context: context.clone(),
            module,
            sampler: self.sampler,
            set_layout,
            layout: vk::PipelineLayout::null(),
            handle: vk::Pipeline::null(),
            compilation: (Duration::ZERO, None),
            time: Arc::default(),
        };
        let layouts = [set_layout];
        let create = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
        // SAFETY: as above.
        pipeline.layout = unsafe { device.create_pipeline_layout(&create, None) }.context(operation)?;
        context.name(set_layout, name);
        context.name(pipeline.layout, name);
        // SAFETY: the words were reflected, so they are a module; the driver checks the rest.
        let shader = unsafe { device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None) }
            .context(operation)?;
        context.name(shader, name);
        // A module that is specialized already gets none: a layer would specialize and validate it again for each pipeline.
        let mut values = if context.specializes { Vec::new() } else { by_id(&pipeline.module, &constants) };
        if !values.is_empty() && context.faults.breaks(Command::Specialize) {
            values.clear();
        }
        let entries: Vec<_> = values
            .iter()
            .enumerate()
            .map(|(i, (id, _))| vk::SpecializationMapEntry { constant_id: *id, offset: 4 * i as u32, size: 4 })
            .collect();
        let bytes: Vec<u8> = values.iter().flat_map(|(_, value)| value.to_ne_bytes()).collect();
        let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&bytes);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(shader)
            .name(c"main")
            .specialization_info(&specialization);
        let mut feedback = vk::PipelineCreationFeedback::default();
        let mut feedbacks = vk::PipelineCreationFeedbackCreateInfo::default().pipeline_creation_feedback(&mut feedback);
        let create = vk::ComputePipelineCreateInfo::default()
            // Dispatches in bands begin at another workgroup than the first.
            .flags(how.flags | vk::PipelineCreateFlags::DISPATCH_BASE)
            .stage(stage)
            .layout(pipeline.layout)
            .push_next(&mut feedbacks);
        calls::begins("vkCreateComputePipelines", name);
        let begun = Instant::now();
        // SAFETY: as above; the shader module is alive until after the call, and the cache is of this device.
        let made = unsafe { device.create_compute_pipelines(how.cache, &[create], None) };
        let took = begun.elapsed();
        context.counts.pipelines.fetch_add(1, Ordering::Relaxed);
        // SAFETY: a shader module may be destroyed once its pipelines are made.
        unsafe { device.destroy_shader_module(shader, None) };
        pipeline.handle = made.map_err(|(_, result)| result).context(operation)?[0];
        context.name(pipeline.handle, name);
        let has = |flag| feedback.flags.contains(flag);
        let hit = has(vk::PipelineCreationFeedbackFlags::VALID)
            .then(|| has(vk::PipelineCreationFeedbackFlags::APPLICATION_PIPELINE_CACHE_HIT));
        pipeline.compilation = (took, hit);
        tracing::debug!("pipeline '{name}' {constants:?}: {:.1} ms", took.as_secs_f64() * 1e3);
        Ok(pipeline)
    }
}

/// The values of specialization constants by `SpecId`.
fn by_id(module: &Module, constants: &[(&'static str, i32)]) -> Vec<(u32, i32)> {
    let value = |name: &str| constants.iter().find(|(of, _)| *of == name).map(|(_, value)| *value);
    module.constants.iter().filter_map(|c| Some((c.id, value(&c.name)?))).collect()
}

impl Drop for Pipelines {
    fn drop(&mut self) {
        locked(&self.made).clear();
        // SAFETY: pipelines that use the sampler are dropped by whoever holds them only after the device is done.
        self.context.destroy(|device| unsafe { device.destroy_sampler(self.sampler, None) });
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: whoever drops the last reference has waited for the device; null handles are allowed.
        self.context.destroy(|device| unsafe {
            device.destroy_pipeline(self.handle, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        });
    }
}
