//! Instance, device, queue, allocator and messenger. One `Arc` of it is held by everything made from it, and its one `Drop`
//! is the order of destruction.

mod create;

use super::GpuError;
use super::error::Doing;
use super::faults::{Faults, Seam};
use super::select::{self, Candidate, Choice};
use super::window::Target;
use ash::vk;
use create::{create_device, create_instance, create_messenger, load};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::collections::{BTreeSet, HashMap};
use std::ffi::{CStr, CString};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";
/// The first layers whose synchronization validation surely knows timelines (Vulkan-ValidationLayers #8559, September 2024).
const SEES_TIMELINES: u32 = vk::make_api_version(0, 1, 3, 297);

#[derive(Clone, Debug)]
pub struct ContextOptions {
    pub device: Choice,
    /// Core and synchronization validation; every message is kept in [`Context::messages`].
    pub validation: bool,
}

pub struct Context {
    /// Kept loaded as long as anything made from it lives.
    #[cfg_attr(not(feature = "view"), expect(dead_code))]
    pub(super) entry: ash::Entry,
    pub(super) instance: ash::Instance,
    /// Of a context whose pictures are shown.
    pub(super) shows: Option<Shows>,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Box<Mutex<Vec<String>>>,
    /// The validation layer sees that submissions wait for timelines.
    sees_timelines: bool,
    pub candidate: Candidate,
    pub limits: vk::PhysicalDeviceLimits,
    pub device: ash::Device,
    /// Descriptors are pushed, where the device can; else they are sets of a pool.
    pub push_descriptor: Option<ash::khr::push_descriptor::Device>,
    /// Reads the device's clock, where it can be read.
    clock: Option<ash::ext::calibrated_timestamps::Device>,
    names: Option<ash::ext::debug_utils::Device>,
    /// As of the candidate: renders, takes frames in, copies them.
    queues: Vec<Mutex<vk::Queue>>,
    /// Families that slots which cross queues are shared between.
    pub queue_families: Vec<u32>,
    /// Taken in `drop`, before the device goes.
    pub(super) allocator: Mutex<Option<Allocator>>,
    formats: Mutex<HashMap<vk::Format, vk::FormatFeatureFlags>>,
    pub faults: Faults,
    pub counts: Counts,
}

/// What shows pictures.
pub struct Shows {
    pub surfaces: ash::khr::surface::Instance,
    pub swapchains: ash::khr::swapchain::Device,
    /// Where it is a monitor.
    pub displays: Option<ash::khr::display::Instance>,
}

/// What is costly and must not happen for every frame, counted since the start.
#[derive(Debug, Default)]
pub struct Counts {
    /// Of device memory.
    pub allocations: AtomicU64,
    pub pipelines: AtomicU64,
    /// Those of them that were made beside the drawing.
    pub beside: AtomicU64,
    pub dispatches: AtomicU64,
    /// Waits for the whole device.
    pub waits_idle: AtomicU64,
}

/// Loads Vulkan and lists the devices, for `echolume devices`.
pub fn list() -> Result<Vec<Candidate>, GpuError> {
    let entry = load()?;
    let instance = create_instance(&entry, false, false, None)?;
    let candidates = select::candidates(&instance);
    // SAFETY: nothing made from the instance is left.
    unsafe { instance.destroy_instance(None) };
    candidates
}

impl Context {
    /// # Errors
    /// No loader, no device, a device that lacks what is required, or no validation layer when validation was asked for.
    pub fn new(options: &ContextOptions) -> Result<Arc<Context>, GpuError> {
        Context::make(options, None)
    }

    /// One whose pictures can be shown on `target`: the device is chosen among those that can.
    ///
    /// # Errors
    /// As of [`Context::new`]; no device that can show anything there.
    #[cfg(feature = "view")]
    pub fn showing(options: &ContextOptions, target: &Target) -> Result<Arc<Context>, GpuError> {
        Context::make(options, Some(target))
    }

    fn make(options: &ContextOptions, target: Option<&Target>) -> Result<Arc<Context>, GpuError> {
        let entry = load()?;
        // SAFETY: only reads the list of layers.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
        let layer = layers.iter().find(|l| l.layer_name_as_c_str() == Ok(VALIDATION));
        if options.validation && layer.is_none() {
            return Err(GpuError::NoValidation);
        }
        let sees_timelines = layer.is_some_and(|l| l.spec_version >= SEES_TIMELINES);
        // SAFETY: only reads the list of extensions.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
        let debug_utils = options.validation
            || extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ash::ext::debug_utils::NAME));
        let instance = create_instance(&entry, options.validation, debug_utils, target)?;
        // The loader stays loaded until the instance is gone, also when nothing comes of it.
        let made = Context::on_instance(entry.clone(), &instance, options, debug_utils, sees_timelines, target);
        if made.is_err() {
            // SAFETY: `on_instance` leaves nothing alive when it fails.
            unsafe { instance.destroy_instance(None) };
        }
        made
    }

    fn on_instance(
        entry: ash::Entry,
        instance: &ash::Instance,
        options: &ContextOptions,
        debug_utils: bool,
        sees_timelines: bool,
        target: Option<&Target>,
    ) -> Result<Arc<Context>, GpuError> {
        let mut candidates = select::candidates(instance)?;
        if let Some(target) = target {
            candidates.iter_mut().for_each(|candidate| target.note_lack(&entry, instance, candidate));
        }
        let candidate = candidates[select::choose(&candidates, &options.device)?].clone();
        let device = create_device(instance, &candidate, target.is_some())?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: candidate.handle,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        });
        let allocator = match allocator {
            Ok(allocator) => allocator,
            Err(e) => {
                // SAFETY: nothing made from the device is left.
                unsafe { device.destroy_device(None) };
                return Err(GpuError::Memory { doing: "create allocator".into(), fault: e.to_string() });
            }
        };
        let messages = Box::new(Mutex::new(Vec::new()));
        let messenger = match options.validation {
            false => None,
            true => match create_messenger(&entry, instance, &messages) {
                Ok(messenger) => Some(messenger),
                Err(error) => {
                    drop(allocator);
                    // SAFETY: nothing made from the device is left.
                    unsafe { device.destroy_device(None) };
                    return Err(error);
                }
            },
        };
        let context = Arc::new(Context {
            push_descriptor: (candidate.pushes).then(|| ash::khr::push_descriptor::Device::new(instance, &device)),
            clock: (candidate.calibrated).then(|| ash::ext::calibrated_timestamps::Device::new(instance, &device)),
            names: debug_utils.then(|| ash::ext::debug_utils::Device::new(instance, &device)),
            queues: {
                // SAFETY: the device was created with these queues.
                let get = |q: &select::QueueOf| unsafe { device.get_device_queue(q.family, q.index) };
                candidate.queues.iter().map(|q| Mutex::new(get(q))).collect()
            },
            queue_families: candidate.queues.iter().map(|q| q.family).collect::<BTreeSet<_>>().into_iter().collect(),
            limits: candidate.limits,
            shows: target.map(|target| Shows {
                surfaces: ash::khr::surface::Instance::new(&entry, instance),
                swapchains: ash::khr::swapchain::Device::new(instance, &device),
                displays: target.is_monitor().then(|| ash::khr::display::Instance::new(&entry, instance)),
            }),
            instance: instance.clone(),
            entry,
            messenger,
            messages,
            sees_timelines,
            candidate,
            device,
            allocator: Mutex::new(Some(allocator)),
            formats: Mutex::default(),
            faults: Faults::default(),
            counts: Counts::default(),
        });
        context.name(context.device.handle(), "device");
        for (queue, name) in context.queues.iter().zip(["queue", "ingest queue", "transfer queue"]) {
            context.name(*queue.lock().unwrap_or_else(|e| e.into_inner()), name);
        }
        tracing::info!("device '{}', driver {}", context.candidate.name, context.candidate.driver.trim());
        Ok(context)
    }

    /// Whether the validation layer watches.
    pub fn is_watched(&self) -> bool {
        self.messenger.is_some()
    }

    /// What validation has said so far; silence is the pass mark.
    pub fn messages(&self) -> Vec<String> {
        self.messages.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }

    /// Whether hazards between submissions that validation tells are some: older layers do not see that one queue waits for another's
    /// timeline, and where there is one queue there is nothing to see.
    pub fn hears_queues(&self) -> bool {
        self.sees_timelines || self.queue_count() == 1
    }

    /// Bytes of device memory that something holds now.
    pub fn allocated(&self) -> u64 {
        let allocator = self.allocator.lock().unwrap_or_else(|e| e.into_inner());
        allocator.as_ref().map_or(0, |allocator| allocator.generate_report().total_allocated_bytes)
    }

    /// Bytes of the device's own memory, free or not.
    pub fn memory(&self) -> u64 {
        // SAFETY: the handle belongs to this instance; the call only reads.
        let there = unsafe { self.instance.get_physical_device_memory_properties(self.candidate.handle) };
        let own = there.memory_heaps_as_slice().iter().filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
        own.map(|heap| heap.size).sum()
    }

    /// A time stamp of the device, and when the host read it; none where the device's clock cannot be read.
    pub(super) fn device_ticks(&self) -> Option<(u64, Instant)> {
        let clock = self.clock.as_ref()?;
        let info = [vk::CalibratedTimestampInfoEXT::default().time_domain(vk::TimeDomainEXT::DEVICE)];
        let before = Instant::now();
        // SAFETY: the extension is enabled; the device's own domain is always among its domains.
        let (ticks, _) = unsafe { clock.get_calibrated_timestamps(&info) }.ok()?;
        Some((*ticks.first()?, before + before.elapsed() / 2))
    }

    /// Features of a format in optimal tiling.
    pub fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        let mut known = self.formats.lock().unwrap_or_else(|e| e.into_inner());
        // SAFETY: the handle belongs to this instance; the call only reads.
        let query = || unsafe { self.instance.get_physical_device_format_properties(self.candidate.handle, format) };
        *known.entry(format).or_insert_with(|| query().optimal_tiling_features)
    }

    /// From now on a format has these features.
    pub(super) fn take_features(&mut self, format: vk::Format, features: vk::FormatFeatureFlags) {
        self.formats.lock().unwrap_or_else(|e| e.into_inner()).insert(format, features);
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

    /// The queue that does this one's work: where there are fewer than asked for, several are one.
    pub fn queue(&self, number: usize) -> select::QueueOf {
        self.candidate.queues[number.min(self.queues.len() - 1)]
    }

    /// How many queues there are for different work: 1..=3.
    pub fn queue_count(&self) -> usize {
        self.queues.len()
    }

    /// `done`: a fence that is signalled when it is done, or null.
    pub(super) fn submit(
        &self,
        queue: usize,
        submit: &vk::SubmitInfo2,
        done: vk::Fence,
        doing: impl FnOnce() -> String,
    ) -> Result<(), GpuError> {
        self.faults
            .pass(Seam::Submit)
            .and_then(|()| {
                let queue = &self.queues[queue.min(self.queues.len() - 1)];
                let queue = queue.lock().unwrap_or_else(|e| e.into_inner());
                // SAFETY: the lock keeps the queue to one thread; the command buffer in `submit` is recorded and what it names is
                // alive until the timeline says it is done.
                unsafe { self.device.queue_submit2(*queue, &[*submit], done) }
            })
            .doing(doing)
    }

    /// What is done to the queue that renders by others than [`Context::submit`], one at a time.
    #[cfg(feature = "view")]
    pub(super) fn on_queue<T>(&self, work: impl FnOnce(vk::Queue) -> T) -> T {
        work(*self.queues[0].lock().unwrap_or_else(|e| e.into_inner()))
    }

    pub(super) fn wait_idle(&self) {
        self.counts.waits_idle.fetch_add(1, Ordering::Relaxed);
        let _queues: Vec<_> = self.queues.iter().map(|q| q.lock().unwrap_or_else(|e| e.into_inner())).collect();
        // SAFETY: the locks keep every queue of the device to this thread.
        let _ = unsafe { self.device.device_wait_idle() };
    }

    /// The largest image of this kind, and its bytes.
    pub fn image_limits(
        &self,
        format: vk::Format,
        kind: vk::ImageType,
        usage: vk::ImageUsageFlags,
    ) -> Result<vk::ImageFormatProperties, GpuError> {
        let (device, tiling) = (self.candidate.handle, vk::ImageTiling::OPTIMAL);
        let none = vk::ImageCreateFlags::empty();
        // SAFETY: the handle belongs to this instance; the call only reads.
        unsafe { self.instance.get_physical_device_image_format_properties(device, format, kind, tiling, usage, none) }
            .doing(|| format!("use {format:?} as {usage:?}"))
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: everything made from this context held an `Arc` of it and is gone. The order is the one of creation reversed.
        unsafe {
            let _ = self.device.device_wait_idle();
            drop(self.allocator.lock().unwrap_or_else(|e| e.into_inner()).take());
            self.device.destroy_device(None);
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}
