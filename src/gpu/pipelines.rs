//! Compute pipelines: a layout from the reflected bindings, and a pipeline for each set of specialization constants; a thread that
//! compiles them in the background, so that drawing goes on meanwhile; and their descriptor sets.

use super::bands::InvocationTime;
use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::formats::{self, TexelAccess};
use super::resources::has_texels;
use crate::passes::slots::{Format, Shape};
use crate::passes::{DispatchArgs, Pass, Slot, interface_check};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::spirv::{self, Kind, Module};
use ash::vk;
use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

/// A compute pipeline and its layout.
pub struct Pipeline {
    context: Arc<Context>,
    pub module: Module,
    /// Of its filtered textures. [`Pipelines`] owns it.
    pub sampler: vk::Sampler,
    pub set_layout: vk::DescriptorSetLayout,
    pub layout: vk::PipelineLayout,
    pub handle: vk::Pipeline,
    /// The time of an invocation, as its last dispatches took.
    pub time: Arc<InvocationTime>,
}

/// Shader, constants, and the formats of the inputs, because the formats of storage images are part of the module.
type Key = (&'static str, Vec<(&'static str, i32)>, Vec<Format>);

/// Returns the SPIR-V words of a shader by name.
pub type Shaders = dyn Fn(&str) -> Result<Vec<u32>, String> + Send + Sync;

/// A shader as the driver gets it.
pub struct Shader {
    pub(super) name: &'static str,
    pub words: Vec<u32>,
    /// Specialization constants by name.
    pub constants: Vec<(&'static str, i32)>,
    pub module: Module,
}

/// A cache of all pipelines made so far: going back to an earlier setting compiles nothing.
pub struct Pipelines {
    context: Arc<Context>,
    made: Mutex<HashMap<Key, Arc<Pipeline>>>,
    shaders: Arc<Shaders>,
    texel_access: TexelAccess,
    sampler: vk::Sampler,
}

/// The embedded shaders.
pub fn embedded() -> Arc<Shaders> {
    Arc::new(|name| {
        spirv::embedded(name).map(spirv::words).ok_or_else(|| "is not embedded; run tools/shaders".to_string())
    })
}

pub fn descriptor_type(kind: Kind) -> vk::DescriptorType {
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
    pub fn new(
        context: &Arc<Context>,
        shaders: Arc<Shaders>,
        texel_access: TexelAccess,
    ) -> Result<Pipelines, GpuError> {
        let create = vk::SamplerCreateInfo::default()
            .mag_filter(context.faults.filter())
            .min_filter(context.faults.filter())
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE);
        // SAFETY: the create structure is complete.
        let sampler = unsafe { context.device.create_sampler(&create, None) }.context(|| "create sampler".into())?;
        context.name(sampler, "trilinear");
        Ok(Pipelines { context: context.clone(), made: Mutex::default(), shaders, texel_access, sampler })
    }

    fn key(pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Key {
        let formats = pass.reads(scene, args).iter().map(|b| b.slot.format(scene)).collect();
        (pass.shader(scene, args), (pass.constants)(scene, args), formats)
    }

    fn cached(&self, key: &Key) -> Option<Arc<Pipeline>> {
        self.made.lock().unwrap_or_else(|e| e.into_inner()).get(key).cloned()
    }

    /// The pipeline of a pass in a scene, compiled at its first use.
    ///
    /// # Errors
    /// A shader that does not exist, or that disagrees with the declaration of the pass.
    pub fn get(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Result<Arc<Pipeline>, GpuError> {
        let key = Pipelines::key(pass, scene, args);
        if let Some(pipeline) = self.cached(&key) {
            return Ok(pipeline);
        }
        let pipeline = self.make(pass, scene, args)?;
        // Another thread may have made the same pipeline meanwhile; either can be used.
        self.made.lock().unwrap_or_else(|e| e.into_inner()).insert(key, pipeline.clone());
        Ok(pipeline)
    }

    /// Compiles the pipelines of a plan again that use `shaders`, and forgets all others that do. Returns the pipelines of the plan, by
    /// step. The device must have finished with the previous pipelines, and no other thread may compile any.
    ///
    /// # Errors
    /// As of [`Pipelines::get`]; the previous pipelines stay.
    pub(super) fn recompile(
        &self,
        shaders: &HashSet<String>,
        plan: &Plan,
        scene: &Scene,
    ) -> Result<Vec<Arc<Pipeline>>, GpuError> {
        let mut made = self.made.lock().unwrap_or_else(|e| e.into_inner()).clone();
        made.retain(|key, _| !shaders.contains(key.0));
        let mut steps = Vec::with_capacity(plan.steps.len());
        for step in &plan.steps {
            let args = step.args();
            let key = Pipelines::key(step.pass, scene, &args);
            let pipeline = match made.get(&key) {
                Some(pipeline) => pipeline.clone(),
                None => self.make(step.pass, scene, &args)?,
            };
            made.insert(key, pipeline.clone());
            steps.push(pipeline);
        }
        *self.made.lock().unwrap_or_else(|e| e.into_inner()) = made;
        Ok(steps)
    }

    /// The shader of a pass as the driver gets it, with its specialization constants.
    ///
    /// # Errors
    /// As of [`Pipelines::get`].
    pub(super) fn shader(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Result<Shader, GpuError> {
        let key = Pipelines::key(pass, scene, args);
        let at_fault = |fault: String| GpuError::Shader { shader: key.0.to_string(), fault };
        let words = (self.shaders)(key.0).map_err(at_fault)?;
        let mut words = interface_check::for_scene(pass, scene, args, &words).map_err(at_fault)?;
        if self.texel_access == TexelAccess::Storage {
            let stores = |slot: Slot| match slot.shape(scene) {
                Shape::Buffer(bytes) => has_texels(&self.context, bytes.into()),
                _ => formats::usage(&self.context, slot).contains(vk::ImageUsageFlags::STORAGE),
            };
            words = interface_check::for_cpu(pass, scene, args, &words, stores).map_err(at_fault)?;
        }
        self.context.faults.words(pass.name, &mut words).map_err(at_fault)?;
        let module = spirv::reflect(&words).map_err(|e| at_fault(e.to_string()))?;
        interface_check::check(pass, scene, args, &module).map_err(|e| at_fault(format!("{}: {e}", pass.name)))?;
        let constants = self.context.faults.constants(pass.name, &key.1);
        Ok(Shader { name: key.0, words, constants, module })
    }

    fn make(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Result<Arc<Pipeline>, GpuError> {
        Pipeline::new(&self.context, self.sampler, self.shader(pass, scene, args)?).map(Arc::new)
    }
}

impl Drop for Pipelines {
    fn drop(&mut self) {
        self.made.lock().unwrap_or_else(|e| e.into_inner()).clear();
        // SAFETY: pipelines that use the sampler are dropped by whoever holds them only after the device is done.
        unsafe { self.context.device.destroy_sampler(self.sampler, None) };
    }
}

impl Pipeline {
    fn new(context: &Arc<Context>, sampler: vk::Sampler, shader: Shader) -> Result<Pipeline, GpuError> {
        let Shader { name, words, constants, module } = shader;
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
            sampler,
            set_layout,
            layout: vk::PipelineLayout::null(),
            handle: vk::Pipeline::null(),
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
        let values: Vec<(u32, i32)> = (pipeline.module.constants.iter())
            .filter_map(|c| constants.iter().find(|(name, _)| *name == c.name).map(|(_, value)| (c.id, *value)))
            .collect();
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
        let create = vk::ComputePipelineCreateInfo::default()
            // Dispatches in bands begin at another workgroup than the first.
            .flags(vk::PipelineCreateFlags::DISPATCH_BASE)
            .stage(stage)
            .layout(pipeline.layout);
        // SAFETY: as above; the shader module is alive until after the call.
        let made = unsafe { device.create_compute_pipelines(vk::PipelineCache::null(), &[create], None) };
        context.counts.pipelines.fetch_add(1, Ordering::Relaxed);
        // SAFETY: a shader module may be destroyed once its pipelines are made.
        unsafe { device.destroy_shader_module(shader, None) };
        pipeline.handle = made.map_err(|(_, result)| result).context(operation)?[0];
        context.name(pipeline.handle, name);
        tracing::debug!("pipeline '{name}' {constants:?}");
        Ok(pipeline)
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: whoever drops the last reference has waited for the device; null handles are allowed.
        unsafe {
            self.context.device.destroy_pipeline(self.handle, None);
            self.context.device.destroy_pipeline_layout(self.layout, None);
            self.context.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// Wakes the event loop of a view.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

struct Job {
    key: Key,
    pass: &'static Pass,
    scene: Arc<Scene>,
    args: DispatchArgs,
}

/// A thread that compiles pipelines, and its requests.
pub struct AsyncPipelineCompiler {
    jobs: Option<Sender<Job>>,
    thread: Option<JoinHandle<()>>,
    asked: HashSet<Key>,
    stop: Arc<AtomicBool>,
    faults: Arc<Mutex<HashMap<Key, String>>>,
}

impl AsyncPipelineCompiler {
    /// `wake` is called after each pipeline.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn new(pipelines: &Arc<Pipelines>, wake: Option<Wake>) -> Result<AsyncPipelineCompiler, GpuError> {
        let (jobs, asked_for) = channel::<Job>();
        let faults = Arc::new(Mutex::new(HashMap::new()));
        let stop = Arc::new(AtomicBool::new(false));
        let (theirs, pipelines, over) = (faults.clone(), pipelines.clone(), stop.clone());
        let work = move || {
            for Job { key, pass, scene, args } in asked_for {
                if over.load(Ordering::Relaxed) {
                    break;
                }
                let is_new = pipelines.cached(&key).is_none();
                match pipelines.get(pass, &scene, &args) {
                    Ok(_) => drop(pipelines.context.counts.async_pipelines.fetch_add(is_new.into(), Ordering::Relaxed)),
                    Err(fault) => drop(theirs.lock().unwrap_or_else(|e| e.into_inner()).insert(key, fault.to_string())),
                }
                if let Some(wake) = &wake {
                    wake();
                }
            }
        };
        let thread = std::thread::Builder::new().name("pipelines".into()).spawn(work);
        let thread =
            thread.map_err(|e| GpuError::Memory { operation: "start a thread".into(), fault: e.to_string() })?;
        Ok(AsyncPipelineCompiler { jobs: Some(jobs), thread: Some(thread), asked: HashSet::new(), stop, faults })
    }

    /// True if every pipeline of a plan is compiled; requests those that are not.
    ///
    /// # Errors
    /// A pipeline that could not be compiled.
    pub fn prepare(&mut self, pipelines: &Pipelines, plan: &Plan, scene: &Scene) -> Result<bool, GpuError> {
        let mut shared = None;
        let mut is_ready = true;
        for step in &plan.steps {
            let args = step.args();
            let key = Pipelines::key(step.pass, scene, &args);
            if pipelines.cached(&key).is_some() {
                continue;
            }
            if let Some(fault) = self.faults.lock().unwrap_or_else(|e| e.into_inner()).get(&key) {
                return Err(GpuError::Shader { shader: key.0.into(), fault: fault.clone() });
            }
            is_ready = false;
            if self.asked.insert(key.clone()) {
                let scene = shared.get_or_insert_with(|| Arc::new(scene.clone())).clone();
                // If the thread has died, pipelines are compiled at their first use.
                let sent =
                    self.jobs.as_ref().is_some_and(|j| j.send(Job { key, pass: step.pass, scene, args }).is_ok());
                is_ready |= !sent;
            }
        }
        Ok(is_ready)
    }
}

impl Drop for AsyncPipelineCompiler {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Number of sets in a pool; few pictures need more dispatches.
const SETS: u32 = 64;
/// Number of descriptors of each type in a pool.
const DESCRIPTORS: u32 = 4 * SETS;
const KINDS: [Kind; 6] = [Kind::Params, Kind::Sampled, Kind::Filtered, Kind::Storage, Kind::Buffer, Kind::Texels(1)];

/// What is left in a pool. It is counted here, because drivers differ in whether they allocate beyond the size of a pool.
#[derive(Clone, Copy)]
struct PoolSpace {
    sets: u32,
    /// Descriptors, in the order of [`KINDS`].
    descriptors: [u32; KINDS.len()],
}

const FULL: PoolSpace = PoolSpace { sets: SETS, descriptors: [DESCRIPTORS; KINDS.len()] };

impl PoolSpace {
    /// What is left after a set with these descriptors is allocated; `None` if there is not enough.
    fn after(mut self, kinds: impl Iterator<Item = Kind>) -> Option<PoolSpace> {
        self.sets = self.sets.checked_sub(1)?;
        for kind in kinds {
            let of = KINDS.iter().position(|k| descriptor_type(*k) == descriptor_type(kind))?;
            self.descriptors[of] = self.descriptors[of].checked_sub(1)?;
        }
        Some(self)
    }
}

/// Descriptor sets of one command buffer, for a device without push descriptors. They are allocated from pools and freed all at once.
pub struct DescriptorSets {
    context: Arc<Context>,
    pools: Vec<vk::DescriptorPool>,
    /// What is left in the current pool.
    left: PoolSpace,
    current: usize,
}

impl DescriptorSets {
    /// Allocates no pool yet: push descriptors need none.
    pub fn new(context: &Arc<Context>) -> DescriptorSets {
        DescriptorSets { context: context.clone(), pools: Vec::new(), left: FULL, current: 0 }
    }

    /// Frees all sets. The device must be done with the command buffer.
    pub fn begin(&mut self) -> Result<(), GpuError> {
        for pool in &self.pools {
            // SAFETY: the pool is alive, and the device is done with what was taken from it.
            unsafe { self.context.device.reset_descriptor_pool(*pool, vk::DescriptorPoolResetFlags::empty()) }
                .context(|| "reset a descriptor pool".into())?;
        }
        (self.left, self.current) = (FULL, 0);
        Ok(())
    }

    /// Allocates a set for a pipeline; it is valid until [`DescriptorSets::begin`].
    pub fn take(&mut self, pipeline: &Pipeline) -> Result<vk::DescriptorSet, GpuError> {
        let kinds = || pipeline.module.bindings.iter().map(|binding| binding.kind);
        let (current, left) = match self.left.after(kinds()) {
            Some(left) => (self.current, left),
            None => {
                let left = FULL.after(kinds()).ok_or_else(|| GpuError::Limit {
                    what: "descriptors of one type in one dispatch".into(),
                    needed: kinds().count() as u64,
                    allowed: u64::from(DESCRIPTORS),
                })?;
                (self.current + 1, left)
            }
        };
        if current == self.pools.len() {
            self.pools.push(self.pool()?);
        }
        let layouts = [pipeline.set_layout];
        let allocate =
            vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pools[current]).set_layouts(&layouts);
        // SAFETY: pool and layout are alive, and there is room for one set more.
        let sets = unsafe { self.context.device.allocate_descriptor_sets(&allocate) };
        let set = sets.context(|| "allocate a descriptor set".into())?[0];
        (self.current, self.left) = (current, left);
        Ok(set)
    }

    fn pool(&self) -> Result<vk::DescriptorPool, GpuError> {
        let sizes =
            KINDS.map(|kind| vk::DescriptorPoolSize { ty: descriptor_type(kind), descriptor_count: DESCRIPTORS });
        let create = vk::DescriptorPoolCreateInfo::default().max_sets(SETS).pool_sizes(&sizes);
        // SAFETY: the structure is complete and outlives the call.
        let pool = unsafe { self.context.device.create_descriptor_pool(&create, None) };
        let pool = pool.context(|| "create a descriptor pool".into())?;
        self.context.name(pool, "descriptor sets");
        Ok(pool)
    }
}

impl Drop for DescriptorSets {
    fn drop(&mut self) {
        for pool in &self.pools {
            // SAFETY: whoever drops this has waited for the device; a pool frees its sets.
            unsafe { self.context.device.destroy_descriptor_pool(*pool, None) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pool_is_full_when_its_sets_or_the_descriptors_of_one_type_run_out() {
        let images = |count| std::iter::repeat_n(Kind::Storage, count);
        let mut left = FULL;
        for _ in 0..SETS {
            left = left.after(images(1).chain([Kind::Texels(2), Kind::Texels(4)])).expect("room");
        }
        assert!(left.after(images(0)).is_none(), "{} sets are left", left.sets);
        assert!(FULL.after(images(DESCRIPTORS as usize)).is_some());
        assert!(FULL.after(images(DESCRIPTORS as usize + 1)).is_none());
        let rest = FULL.after(images(200)).expect("room");
        assert!(rest.after(images(57)).is_none() && rest.after(images(56)).is_some());
    }
}
