//! Instance, device, queues and memory allocator. Every object that is made from a context holds an `Arc` of it. The `Drop` of a context
//! destroys its parts in order.

use super::budget::MemoryBudget;
use super::calls;
use super::device_selection::{self, Candidate, DeviceChoice, QueueInfo};
use super::error::{ErrorContext, GpuError};
use super::faults::{Faults, InjectionPoint};
use super::lost_device::{LossReport, LossReporting};
use super::pipeline_cache::PipelineCache;
use super::validation::{self, Layer, Messenger};
use super::watchdog::{Deadline, Watchdog};
use super::window::target::Target;
use crate::queues::MAX_QUEUES;
use crate::scene::WindowTexels;
use crate::sync::locked;
use ash::vk;
use gpu_allocator::AllocationSizes;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::any::Any;
use std::collections::{BTreeSet, HashMap};
use std::ffi::{CStr, CString};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::time::Instant;

/// Limit of unused pipelines. They take 64 MiB with a driver that keeps 256 KiB for a pipeline, and 0.8 GiB with lavapipe, which keeps 3
/// MiB.
const MAX_UNUSED_PIPELINES: usize = 256;

/// Size of a block of memory on a software device, bytes.
const SOFTWARE_BLOCK: u64 = 8 << 20;

/// Which device a [`Context`] opens, and with which options. The default: the best device, without validation and without stored pipelines.
#[derive(Clone, Debug, Default)]
pub struct ContextOptions {
    /// The device. The default is the best one.
    pub device: DeviceChoice,
    /// Enables core and synchronization validation, whose messages [`Context::messages`] returns.
    pub validation: bool,
    /// Time after which a device that does not finish a submission is given up.
    pub deadline: Deadline,
    /// This function is called during every wait for the device. Once it returns true, the wait ends within a second, and the device is given up if
    /// it is still busy. `None`: nothing stops a wait.
    pub stop: Option<fn() -> bool>,
    /// The folder in which compiled pipelines are stored for the next run. `None`: they are not stored.
    pub pipeline_cache: Option<PathBuf>,
    /// If true, the driver's statistics on the compilation of pipelines can be read, if the device has
    /// VK_KHR_pipeline_executable_properties.
    pub compile_statistics: bool,
    /// Gives the driver shader modules without specialization constants and without the branches that their values never take. Validation
    /// layers then validate each module once instead of each pipeline. `None`: only on a software device. lavapipe processes every
    /// instruction of each pipeline, so that the first picture takes less than half of the time; the compilers of some GPUs then use more
    /// registers.
    pub specialize: Option<bool>,
    /// Largest number of compiled pipelines that are kept although no renderer's plan uses them, at least 1. A pipeline beyond that is compiled again
    /// when it is needed again. `None`: 256.
    pub max_unused_pipelines: Option<usize>,
}

/// An open Vulkan device. Every object on the device holds an `Arc` of its context.
pub struct Context {
    /// The Vulkan loader, which stays loaded as long as the context lives.
    pub(super) entry: ash::Entry,
    pub(super) instance: ash::Instance,
    /// Extensions for presentation; `None` in a context that presents no pictures.
    pub(super) presentation: Option<Presentation>,
    /// With validation.
    messenger: Option<Messenger>,
    pub candidate: Candidate,
    pub device: ash::Device,
    /// Push descriptors; `None` if the device has none, so that descriptor sets of a pool are used.
    pub push_descriptor: Option<ash::khr::push_descriptor::Device>,
    /// Reads the device's clock, if the device can.
    clock: Option<ash::ext::calibrated_timestamps::Device>,
    names: Option<ash::ext::debug_utils::Device>,
    /// Statistics on the compilation of pipelines; `None` without [`ContextOptions::compile_statistics`] or if the device has none.
    pub(super) executables: Option<ash::khr::pipeline_executable_properties::Device>,
    /// True if shader modules have the values of their constants before the driver gets them ([`ContextOptions::specialize`]).
    pub(super) specializes: bool,
    /// Largest number of compiled pipelines that are kept although no renderer's plan uses them.
    pub(super) max_unused_pipelines: usize,
    pub(super) pipeline_cache: PipelineCache,
    /// The pipelines that the renderers of the device share, as long as one of them holds them. Their type is [`super::pipelines::Pipelines`], whose
    /// module depends on this one.
    pub(super) shared: Mutex<Vec<Weak<dyn Any + Send + Sync>>>,
    /// The extensions that report why the device was lost.
    pub(super) loss: LossReporting,
    /// In the order of `candidate.queues`: rendering, ingestion, copies.
    queues: Vec<Mutex<vk::Queue>>,
    /// The queue families of slots that several queues use (VK_SHARING_MODE_CONCURRENT).
    pub(crate) queue_families: Vec<u32>,
    /// Allocator of device memory; None once `drop` has taken it, before the device is destroyed.
    pub(super) allocator: Mutex<Option<Allocator>>,
    formats: Mutex<HashMap<vk::Format, vk::FormatFeatureFlags>>,
    pub(super) watchdog: Watchdog,
    /// The pixel format of the window; a picture in it is copied there without a conversion.
    pub window_texels: Mutex<WindowTexels>,
    pub faults: Faults,
    pub counts: Counts,
}

/// The extensions for presenting pictures.
#[cfg_attr(not(feature = "view"), expect(dead_code, reason = "only a window reads it"))]
pub(crate) struct Presentation {
    pub surfaces: ash::khr::surface::Instance,
    pub swapchains: ash::khr::swapchain::Device,
    /// VK_KHR_display, if the target is a monitor without a window system.
    pub displays: Option<ash::khr::display::Instance>,
    /// VK_KHR_present_wait, which waits until a picture is on the monitor, if the device has it.
    pub waits: Option<ash::khr::present_wait::Device>,
}

/// A simultaneous reading of the device's clock (`ticks`) and the host's.
pub(super) struct ClockReading {
    pub ticks: u64,
    /// The host's monotonic clock, ns, as the driver read it together with `ticks`; None if it reads only the device's clock.
    pub monotonic: Option<u64>,
    /// The host's clock in the middle of the call that read `ticks`.
    pub at: Instant,
    /// Largest time between the reading of `ticks` and that of the host's clock, ns.
    pub deviation: u64,
}

/// Counts of operations since the context was opened. All except dispatches are costly and must not happen for every frame.
#[derive(Debug, Default)]
pub struct Counts {
    /// Number of allocations of device memory.
    pub allocations: AtomicU64,
    pub pipelines: AtomicU64,
    /// Number of pipelines that were compiled in the background.
    pub async_pipelines: AtomicU64,
    pub dispatches: AtomicU64,
    /// Number of waits for an idle device.
    pub waits_idle: AtomicU64,
    /// Bytes of frames that the host copied into staging memory, from which the device takes them.
    pub staged: AtomicU64,
}

/// Loads Vulkan and lists the devices, for `echolume devices`, also those that lack a required feature.
///
/// # Errors
/// No Vulkan loader, no driver, or a driver that fails.
pub fn list() -> Result<Vec<Candidate>, GpuError> {
    let entry = load()?;
    let instance = create_instance(&entry, None, false, None)?;
    let candidates = device_selection::candidates(&entry, &instance);
    // SAFETY: nothing made from the instance is left.
    unsafe { end_instance(&entry, &instance) };
    candidates
}

/// Sizes of the blocks of device memory. An allocation larger than a block has a block of its own, which is freed at once. On a GPU that
/// takes time. On a software device the blocks are memory of the machine: large ones would, after a resize, keep the pages that the larger
/// window used.
fn block_sizes(candidate: &Candidate) -> AllocationSizes {
    match candidate.is_software() {
        true => AllocationSizes::new(SOFTWARE_BLOCK, SOFTWARE_BLOCK),
        false => AllocationSizes::default(),
    }
}

impl Context {
    /// Opens a device.
    ///
    /// # Errors
    /// No Vulkan loader, no such device, a device that lacks a required feature, no validation layer although validation is requested, or a driver
    /// that fails.
    pub fn new(options: &ContextOptions) -> Result<Arc<Context>, GpuError> {
        Context::create(options, None)
    }

    /// Opens a device that can present on `target`.
    ///
    /// # Errors
    /// No Vulkan loader, no such device or none that can present there, a device that lacks a required feature, no validation layer although
    /// validation is requested, or a driver that fails.
    #[cfg(feature = "view")]
    pub fn for_presentation(options: &ContextOptions, target: &Target) -> Result<Arc<Context>, GpuError> {
        Context::create(options, Some(target))
    }

    fn create(options: &ContextOptions, target: Option<&Target>) -> Result<Arc<Context>, GpuError> {
        let entry = load()?;
        let layer = match options.validation {
            true => Some(Layer::find(&entry).ok_or(GpuError::NoValidation)?),
            false => None,
        };
        // SAFETY: only reads the list of extensions.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
        let debug_utils = layer.is_some()
            || extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ash::ext::debug_utils::NAME));
        let instance = create_instance(&entry, layer, debug_utils, target)?;
        // Also on failure, the loader stays loaded until the instance is destroyed.
        let made = Context::on_instance(entry.clone(), &instance, options, debug_utils, layer, target);
        if made.is_err() {
            // SAFETY: `on_instance` leaves nothing alive when it fails.
            unsafe { end_instance(&entry, &instance) };
        }
        made
    }

    fn on_instance(
        entry: ash::Entry,
        instance: &ash::Instance,
        options: &ContextOptions,
        debug_utils: bool,
        layer: Option<Layer>,
        target: Option<&Target>,
    ) -> Result<Arc<Context>, GpuError> {
        let mut candidates = device_selection::candidates(&entry, instance)?;
        if let Some(target) = target {
            candidates.iter_mut().for_each(|candidate| target.check_support(&entry, instance, candidate));
        }
        let candidate = candidates[device_selection::choose(&candidates, &options.device)?].clone();
        let has_statistics = options.compile_statistics && candidate.compile_statistics;
        let device = create_device(instance, &candidate, target.is_some(), has_statistics)?;
        let made = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: candidate.handle,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: block_sizes(&candidate),
        });
        let made = made.map_err(|e| GpuError::Memory { operation: "create allocator".into(), fault: e.to_string() });
        let made = made.and_then(|allocator| {
            let messenger = layer.map(|layer| Messenger::new(&entry, instance, layer)).transpose()?;
            Ok((allocator, messenger))
        });
        // SAFETY: nothing made from the device is left after a failure.
        let (allocator, messenger) = made.inspect_err(|_| unsafe { device.destroy_device(None) })?;
        let watchdog = Watchdog::new(options.deadline.on_device(candidate.is_software()), options.stop);
        let context = Arc::new(Context {
            push_descriptor: (candidate.push_descriptors)
                .then(|| ash::khr::push_descriptor::Device::new(instance, &device)),
            clock: (candidate.calibrated_timestamps)
                .then(|| ash::ext::calibrated_timestamps::Device::new(instance, &device)),
            names: debug_utils.then(|| ash::ext::debug_utils::Device::new(instance, &device)),
            executables: has_statistics
                .then(|| ash::khr::pipeline_executable_properties::Device::new(instance, &device)),
            shared: Mutex::default(),
            specializes: options.specialize.unwrap_or(candidate.is_software()),
            max_unused_pipelines: options.max_unused_pipelines.unwrap_or(MAX_UNUSED_PIPELINES),
            pipeline_cache: PipelineCache::open(&device, &candidate.driver_identity, options.pipeline_cache.as_deref()),
            loss: LossReporting {
                faults: candidate.device_fault.then(|| ash::ext::device_fault::Device::new(instance, &device)),
                checkpoints: (candidate.checkpoints)
                    .then(|| ash::nv::device_diagnostic_checkpoints::Device::new(instance, &device)),
            },
            queues: {
                // SAFETY: the device was created with these queues.
                let get = |q: &QueueInfo| unsafe { device.get_device_queue(q.family, q.index) };
                candidate.queues.iter().map(|q| Mutex::new(get(q))).collect()
            },
            queue_families: candidate.queues.iter().map(|q| q.family).collect::<BTreeSet<_>>().into_iter().collect(),
            presentation: target.map(|target| Presentation {
                surfaces: ash::khr::surface::Instance::new(&entry, instance),
                swapchains: ash::khr::swapchain::Device::new(instance, &device),
                displays: target.is_monitor().then(|| ash::khr::display::Instance::new(&entry, instance)),
                waits: candidate.present_wait.then(|| ash::khr::present_wait::Device::new(instance, &device)),
            }),
            instance: instance.clone(),
            entry,
            messenger,
            candidate,
            device,
            allocator: Mutex::new(Some(allocator)),
            formats: Mutex::default(),
            watchdog,
            window_texels: Mutex::default(),
            faults: Faults::default(),
            counts: Counts::default(),
        });
        context.name(context.device.handle(), "device");
        for (queue, name) in context.queues.iter().zip(["queue", "ingest queue", "transfer queue"]) {
            context.name(*locked(queue), name);
        }
        tracing::info!("device '{}', driver {}", context.candidate.name, context.candidate.driver.trim());
        Ok(context)
    }

    /// All warnings and errors of the validation layer so far, without known false positives; empty without validation. A correct program has none.
    pub fn messages(&self) -> Vec<String> {
        self.messenger.as_ref().map(Messenger::messages).unwrap_or_default()
    }

    /// True if hazards between submissions that the validation layer reports are real. Older layers ignore that a queue waits for the timeline of
    /// another queue; with a single queue that does not matter.
    pub fn validates_timelines(&self) -> bool {
        !self.layer_misses_waits() || self.queue_count() == 1
    }

    /// Bytes of device memory that this context's buffers and images hold now.
    pub fn allocated(&self) -> u64 {
        let allocator = locked(&self.allocator);
        allocator.as_ref().map_or(0, |allocator| allocator.generate_report().total_allocated_bytes)
    }

    /// Total size of the device's own memory heaps, bytes.
    pub fn memory(&self) -> u64 {
        // SAFETY: the handle belongs to this instance; the call only reads.
        let there = unsafe { self.instance.get_physical_device_memory_properties(self.candidate.handle) };
        let own = there.memory_heaps_as_slice().iter().filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
        own.map(|heap| heap.size).sum()
    }

    /// Reads the clock of the device and that of the host in one call. `None` if the device's clock cannot be read.
    pub(super) fn device_ticks(&self) -> Option<ClockReading> {
        let clock = self.clock.as_ref()?;
        let domain = |domain| vk::CalibratedTimestampInfoEXT::default().time_domain(domain);
        let both = [domain(vk::TimeDomainEXT::DEVICE), domain(vk::TimeDomainEXT::CLOCK_MONOTONIC)];
        let asked = if self.candidate.reads_monotonic { &both[..] } else { &both[..1] };
        let before = Instant::now();
        // SAFETY: the extension is enabled; the device's own domain is always among its domains, the other one was listed.
        let (read, deviation) = unsafe { clock.get_calibrated_timestamps(asked) }.ok()?;
        let took = before.elapsed();
        // Without the host's clock in the same call, the device's was read at some time during it.
        let around = if self.candidate.reads_monotonic { 0 } else { took.as_nanos() as u64 / 2 };
        Some(ClockReading {
            ticks: *read.first()?,
            monotonic: read.get(1).copied(),
            at: before + took / 2,
            deviation: deviation.saturating_add(around),
        })
    }

    /// Now by the host's clock, and by the monotonic clock that the driver reads, ns. The second is None if the driver does not read that clock.
    pub(super) fn clocks_now(&self) -> (Instant, Option<u64>) {
        let asked = [vk::CalibratedTimestampInfoEXT::default().time_domain(vk::TimeDomainEXT::CLOCK_MONOTONIC)];
        let read = || {
            let clock = self.clock.as_ref().filter(|_| self.candidate.reads_monotonic)?;
            let before = Instant::now();
            // SAFETY: the extension is enabled and the domain was listed.
            let (read, _) = unsafe { clock.get_calibrated_timestamps(&asked) }.ok()?;
            let took = before.elapsed();
            Some((took, before + took / 2, *read.first()?))
        };
        // The shortest of a few calls relates both best.
        match (0..8).filter_map(|_| read()).min_by_key(|(took, ..)| *took) {
            Some((_, at, monotonic)) => (at, Some(monotonic)),
            None => (Instant::now(), None),
        }
    }

    /// Features of images of a format with optimal tiling.
    pub(crate) fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        let mut known = locked(&self.formats);
        // SAFETY: the handle belongs to this instance; the call only reads.
        let query = || unsafe { self.instance.get_physical_device_format_properties(self.candidate.handle, format) };
        *known.entry(format).or_insert_with(|| query().optimal_tiling_features)
    }

    /// True if shaders that declare no image format may store texels of this format.
    pub(super) fn writes_without_format(&self, format: vk::Format) -> bool {
        let mut features = vk::FormatProperties3::default();
        let mut properties = vk::FormatProperties2::default().push_next(&mut features);
        let device = self.candidate.handle;
        // SAFETY: the handle belongs to this instance; the structures are complete, and the call only writes into them.
        unsafe { self.instance.get_physical_device_format_properties2(device, format, &mut properties) };
        features.optimal_tiling_features.contains(vk::FormatFeatureFlags2::STORAGE_WRITE_WITHOUT_FORMAT)
    }

    /// Fault injection: from now on the device appears to have these features for images of a format.
    pub(super) fn override_features(&mut self, format: vk::Format, features: vk::FormatFeatureFlags) {
        locked(&self.formats).insert(format, features);
    }

    /// Names an object in captures and validation messages.
    pub(super) fn name<T: vk::Handle>(&self, object: T, name: &str) {
        let Some(names) = &self.names else { return };
        let Ok(name) = CString::new(name) else { return };
        let naming = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
        // SAFETY: the object is alive and the name outlives the call. A name that cannot be set is not worth an error.
        let _ = unsafe { names.set_debug_utils_object_name(&naming) };
    }

    pub(super) fn begin_label(&self, commands: vk::CommandBuffer, label: &str) {
        let Some(names) = &self.names else { return };
        let Ok(label) = CString::new(label) else { return };
        // SAFETY: the command buffer is being recorded; the label outlives the call.
        unsafe { names.cmd_begin_debug_utils_label(commands, &vk::DebugUtilsLabelEXT::default().label_name(&label)) };
    }

    pub(super) fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(names) = &self.names {
            // SAFETY: ends the label that `begin_label` began on the same command buffer.
            unsafe { names.cmd_end_debug_utils_label(commands) };
        }
    }

    /// The queue for a role: 0 renders, 1 ingests frames, 2 copies them. If the device has fewer queues than that, several roles share the last one.
    pub fn queue(&self, number: usize) -> QueueInfo {
        self.candidate.queues[number.min(self.queues.len() - 1)]
    }

    /// Number of queues in use: 1..=3.
    pub fn queue_count(&self) -> usize {
        self.queues.len()
    }

    /// Submits to the queue with this number. `done`: a fence to signal at completion, or null; `operation`: its name for an error.
    ///
    /// # Errors
    /// The device fails, or was given up before.
    pub(super) fn submit(
        &self,
        queue: usize,
        submit: &vk::SubmitInfo2,
        done: vk::Fence,
        operation: impl Fn() -> String,
    ) -> Result<(), GpuError> {
        self.watchdog.check(&operation)?;
        let sent = self.faults.check(InjectionPoint::Submit).and_then(|()| self.send(queue, &[*submit], done));
        sent.context(operation).map_err(|error| self.explain(error))
    }

    fn send(&self, queue: usize, submits: &[vk::SubmitInfo2], done: vk::Fence) -> Result<(), vk::Result> {
        if self.faults.keeps_submission() {
            return Ok(());
        }
        let queue = &self.queues[queue.min(self.queues.len() - 1)];
        let queue = locked(queue);
        calls::begins("vkQueueSubmit2", "");
        // SAFETY: the lock keeps the queue to one thread; the command buffers submitted are recorded and what they name is alive until
        // the timeline says it is done.
        unsafe { self.device.queue_submit2(*queue, submits, done) }?;
        match self.faults.waits.load(Ordering::Relaxed) {
            // SAFETY: the lock keeps the queue to this thread.
            true => unsafe { self.device.queue_wait_idle(*queue) },
            false => Ok(()),
        }
    }

    /// Waits for the fence of a submission that was made at the time `since`.
    ///
    /// # Errors
    /// The device fails or is given up.
    pub(super) fn wait_fence(&self, fence: vk::Fence, since: Instant, operation: &str) -> Result<(), GpuError> {
        // SAFETY: the fence is alive; it is signalled, or a submission in flight will signal it.
        let attempt = |ns| unsafe { self.device.wait_for_fences(&[fence], true, ns) };
        self.watchdog.wait(&|| operation.into(), || since, attempt)
    }

    /// True once the device was given up: it did not finish in time, or was busy when the program had to end. Objects of the context and the context
    /// itself are then leaked instead of destroyed, because the device may still use them.
    pub fn is_given_up(&self) -> bool {
        self.watchdog.has_given_up()
    }

    /// Destroys an object of the device. If the device was given up, it may still use the object, which stays.
    pub(super) fn destroy(&self, work: impl FnOnce(&ash::Device)) {
        if !self.is_given_up() {
            work(&self.device);
        }
    }

    /// Adds the driver's report to an error, if the error is the loss of the device and the driver reports anything.
    pub(super) fn explain(&self, error: GpuError) -> GpuError {
        let GpuError::Vulkan { operation, result: vk::Result::ERROR_DEVICE_LOST } = error else { return error };
        let pretended = locked(&self.faults.loss).clone();
        let report = pretended.unwrap_or_else(|| {
            // A driver may only be asked about a device that it has lost itself.
            if self.faults.has_lost.load(Ordering::Relaxed) || self.is_given_up() {
                return LossReport::default();
            }
            let queues: Vec<_> = self.queues.iter().map(locked).collect();
            self.loss.read(self.device.handle(), &queues.iter().map(|q| **q).collect::<Vec<_>>())
        });
        match report.is_empty() {
            true => GpuError::Vulkan { operation, result: vk::Result::ERROR_DEVICE_LOST },
            false => GpuError::Lost { operation, report: report.to_string() },
        }
    }

    /// The current budget of the device's memory; `None` if the device reports none.
    pub(super) fn memory_budget(&self) -> Option<MemoryBudget> {
        let read = || self.candidate.budget.as_ref().map(|_| MemoryBudget::read(&self.instance, self.candidate.handle));
        // The lock ends before the driver is asked.
        let pretended = locked(&self.faults.budget).clone();
        pretended.or_else(read)
    }

    /// Runs `work` with exclusive access to the rendering queue, for uses other than [`Context::submit`].
    #[cfg(feature = "view")]
    pub(super) fn on_queue<T>(&self, work: impl FnOnce(vk::Queue) -> T) -> T {
        work(*locked(&self.queues[0]))
    }

    /// Waits for an idle queue if an older validation layer needs it. Such a layer does not see waits for timelines: it keeps what every submission
    /// read and wrote until it sees an idle queue, which took 1 GiB after some minutes of verification. Call it after a wait for the last submission
    /// of a timeline.
    ///
    /// # Errors
    /// The device fails or is given up.
    pub(super) fn show_layer_an_idle_queue(&self) -> Result<(), GpuError> {
        let is_due = self.queues.len() == 1 && self.messenger.as_ref().is_some_and(Messenger::needs_an_idle_queue);
        if is_due { self.wait_queue(0) } else { Ok(()) }
    }

    /// Waits until the first queue is idle, if the validation layer does not see waits for timelines: each time, and with any number of queues,
    /// unlike [`Context::show_layer_an_idle_queue`]. Call it before another timeline uses what the first queue wrote: an older layer would report a
    /// hazard.
    ///
    /// # Errors
    /// The device fails or is given up.
    pub(super) fn show_layer_the_wait(&self) -> Result<(), GpuError> {
        if self.layer_misses_waits() { self.wait_queue(0) } else { Ok(()) }
    }

    /// True if validation is on and its layer does not see waits for timelines.
    pub(super) fn layer_misses_waits(&self) -> bool {
        self.messenger.as_ref().is_some_and(Messenger::misses_waits)
    }

    /// Waits until a queue has done what was submitted to it so far.
    ///
    /// # Errors
    /// The device fails or is given up.
    fn wait_queue(&self, queue: usize) -> Result<(), GpuError> {
        let (begun, operation) = (Instant::now(), || "wait for an idle queue".to_string());
        // vkQueueWaitIdle has no time-out; a fence behind everything that was submitted has one.
        // SAFETY: the create structure is complete.
        let fence = unsafe { self.device.create_fence(&vk::FenceCreateInfo::default(), None) }.context(operation)?;
        let done = match self.send(queue, &[], fence) {
            Ok(()) => self.wait_fence(fence, begun, "wait for an idle queue"),
            failed => failed.context(operation),
        };
        // SAFETY: it was not submitted, or the device is done with it or lost.
        self.destroy(|device| unsafe { device.destroy_fence(fence, None) });
        done
    }

    /// Waits until the device is idle.
    ///
    /// # Errors
    /// The device fails (and is then idle), or is given up.
    pub(super) fn wait_idle(&self) -> Result<(), GpuError> {
        self.counts.waits_idle.fetch_add(1, Ordering::Relaxed);
        let operation = || "wait for an idle device".to_string();
        self.watchdog.check(operation)?;
        (0..self.queues.len()).try_for_each(|queue| self.wait_queue(queue))?;
        let _queues: Vec<_> = self.queues.iter().map(locked).collect();
        // What presents pictures signals no fence. The queues are empty, so that this does not block.
        // SAFETY: the locks keep every queue of the device to this thread.
        unsafe { self.device.device_wait_idle() }.context(operation)
    }

    /// The limits of images of this format, type and usage.
    ///
    /// # Errors
    /// The device does not support the combination.
    pub(crate) fn image_limits(
        &self,
        format: vk::Format,
        kind: vk::ImageType,
        usage: vk::ImageUsageFlags,
    ) -> Result<vk::ImageFormatProperties, GpuError> {
        let (device, tiling) = (self.candidate.handle, vk::ImageTiling::OPTIMAL);
        let none = vk::ImageCreateFlags::empty();
        // SAFETY: the handle belongs to this instance; the call only reads.
        unsafe { self.instance.get_physical_device_image_format_properties(device, format, kind, tiling, usage, none) }
            .context(|| format!("use {format:?} as {usage:?}"))
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // A device that fails is idle.
        let _ = self.wait_idle();
        if self.is_given_up() {
            // The device may still be at work: its memory is not freed, and the driver stays loaded.
            std::mem::forget((self.entry.clone(), self.messenger.take()));
            std::mem::forget(locked(&self.allocator).take());
            return;
        }
        self.pipeline_cache.store(&self.device);
        self.pipeline_cache.destroy(&self.device);
        // SAFETY: everything made from this context held an `Arc` of it and is gone. The order is the one of creation reversed.
        unsafe {
            drop(locked(&self.allocator).take());
            self.device.destroy_device(None);
            drop(self.messenger.take());
            end_instance(&self.entry, &self.instance);
        }
    }
}

fn load() -> Result<ash::Entry, GpuError> {
    // SAFETY: loading libvulkan runs its initialisers; it is the system's own Vulkan loader.
    unsafe { ash::Entry::load() }.map_err(|e| GpuError::NoLoader(e.to_string()))
}

/// Destroys an instance, but keeps the first one of the process. The loader unloads the drivers with the last instance and loads them again
/// for the next. Each time NVIDIA's driver 580 loses the memory that it takes for thread-local variables: after some 40 contexts, one after
/// the other, no device was left. A kiosk that lost its device as often would end.
///
/// # Safety
/// No object of the instance may be left.
unsafe fn end_instance(entry: &ash::Entry, instance: &ash::Instance) {
    static HAS_KEPT_ONE: AtomicBool = AtomicBool::new(false);
    if HAS_KEPT_ONE.swap(true, Ordering::Relaxed) {
        // SAFETY: as the function demands.
        unsafe { instance.destroy_instance(None) };
    } else {
        std::mem::forget(entry.clone());
    }
}

/// `target`: where pictures will be presented, if anywhere.
fn create_instance(
    entry: &ash::Entry,
    layer: Option<Layer>,
    debug_utils: bool,
    target: Option<&Target>,
) -> Result<ash::Instance, GpuError> {
    let application = vk::ApplicationInfo::default()
        .application_name(c"echolume")
        .engine_name(c"echolume")
        .api_version(vk::API_VERSION_1_3);
    let layers: Vec<_> = layer.iter().map(|_| Layer::NAME.as_ptr()).collect();
    let mut extensions: Vec<_> = debug_utils.then_some(ash::ext::debug_utils::NAME.as_ptr()).into_iter().collect();
    extensions.extend(layer.map(|layer| layer.extension().as_ptr()));
    if let Some(target) = target {
        extensions.extend(target.extensions(entry)?.iter().map(|name| name.as_ptr()));
    }
    let settings = validation::settings();
    let mut by_settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
    let mut by_features = vk::ValidationFeaturesEXT::default().enabled_validation_features(validation::FEATURES);
    let mut create = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    create = match layer {
        Some(layer) if layer.has_settings => create.push_next(&mut by_settings),
        Some(_) => create.push_next(&mut by_features),
        None => create,
    };
    calls::begins("vkCreateInstance", "");
    // SAFETY: every pointer in `create` outlives the call.
    let instance = unsafe { entry.create_instance(&create, None) };
    match instance {
        // The loader returns this if no driver is installed.
        Err(vk::Result::ERROR_INCOMPATIBLE_DRIVER) => Err(GpuError::NoDevice),
        other => other.context(|| {
            // SAFETY: names of extensions, which end with a zero.
            let names = extensions.iter().map(|name| unsafe { CStr::from_ptr(*name) }.to_string_lossy());
            format!("create instance with {}", names.collect::<Vec<_>>().join(", "))
        }),
    }
}

/// `presents`: the device will present pictures with panels drawn over them. `has_statistics`: pipelines will be asked for statistics of
/// their compilation.
fn create_device(
    instance: &ash::Instance,
    candidate: &Candidate,
    presents: bool,
    has_statistics: bool,
) -> Result<ash::Device, GpuError> {
    let priorities = [1.0; MAX_QUEUES];
    let families: BTreeSet<u32> = candidate.queues.iter().map(|q| q.family).collect();
    let queues: Vec<_> = families
        .into_iter()
        .map(|family| {
            let count = candidate.queues.iter().filter(|q| q.family == family).count();
            vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&priorities[..count])
        })
        .collect();
    let mut extensions = Vec::new();
    extensions.extend(candidate.push_descriptors.then_some(ash::khr::push_descriptor::NAME.as_ptr()));
    extensions.extend(candidate.calibrated_timestamps.then_some(ash::ext::calibrated_timestamps::NAME.as_ptr()));
    extensions.extend(presents.then_some(ash::khr::swapchain::NAME.as_ptr()));
    extensions.extend(has_statistics.then_some(ash::khr::pipeline_executable_properties::NAME.as_ptr()));
    extensions.extend(candidate.budget.is_some().then_some(ash::ext::memory_budget::NAME.as_ptr()));
    extensions.extend(candidate.device_fault.then_some(ash::ext::device_fault::NAME.as_ptr()));
    extensions.extend(candidate.checkpoints.then_some(ash::nv::device_diagnostic_checkpoints::NAME.as_ptr()));
    let waits = presents && candidate.present_wait;
    if waits {
        extensions.extend([ash::khr::present_id::NAME.as_ptr(), ash::khr::present_wait::NAME.as_ptr()]);
    }
    let core = vk::PhysicalDeviceFeatures::default()
        .pipeline_statistics_query(candidate.pipeline_statistics)
        .shader_storage_image_extended_formats(true)
        .shader_storage_image_write_without_format(true);
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
        .scalar_block_layout(true)
        .timeline_semaphore(true)
        .host_query_reset(true);
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .synchronization2(true)
        .maintenance4(true)
        .dynamic_rendering(presents);
    let mut executables =
        vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
    let mut fault = vk::PhysicalDeviceFaultFeaturesEXT::default().device_fault(true);
    let mut present_id = vk::PhysicalDevicePresentIdFeaturesKHR::default().present_id(true);
    let mut present_wait = vk::PhysicalDevicePresentWaitFeaturesKHR::default().present_wait(true);
    let mut create = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&core)
        .push_next(&mut v12)
        .push_next(&mut v13);
    if has_statistics {
        create = create.push_next(&mut executables);
    }
    if candidate.device_fault {
        create = create.push_next(&mut fault);
    }
    if waits {
        create = create.push_next(&mut present_id).push_next(&mut present_wait);
    }
    calls::begins("vkCreateDevice", &candidate.name);
    // SAFETY: `choose` checked that every requested feature is supported; every pointer outlives the call.
    unsafe { instance.create_device(candidate.handle, &create, None) }
        .context(|| format!("create device '{}'", candidate.name))
}
