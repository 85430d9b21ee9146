//! What a context is made of: the loader, an instance, a device with what it is asked for, and the messenger of validation.

use super::{Candidate, VALIDATION};
use crate::gpu::GpuError;
use crate::gpu::error::Doing;
use crate::gpu::window::Target;
use ash::vk;
use std::collections::BTreeSet;
use std::ffi::c_void;
use std::sync::Mutex;

pub fn load() -> Result<ash::Entry, GpuError> {
    // SAFETY: loading libvulkan runs its initialisers; it is the system's own Vulkan loader.
    unsafe { ash::Entry::load() }.map_err(|e| GpuError::NoLoader(e.to_string()))
}

/// `target`: what its pictures will be shown on, if on anything.
pub fn create_instance(
    entry: &ash::Entry,
    validation: bool,
    debug_utils: bool,
    target: Option<&Target>,
) -> Result<ash::Instance, GpuError> {
    let application = vk::ApplicationInfo::default()
        .application_name(c"echolume")
        .engine_name(c"echolume")
        .api_version(vk::API_VERSION_1_3);
    let layers: Vec<_> = validation.then_some(VALIDATION.as_ptr()).into_iter().collect();
    let mut extensions: Vec<_> = debug_utils.then_some(ash::ext::debug_utils::NAME.as_ptr()).into_iter().collect();
    // The layer itself brings this one.
    extensions.extend(validation.then_some(ash::ext::validation_features::NAME.as_ptr()));
    if let Some(target) = target {
        extensions.extend(target.extensions(entry)?.iter().map(|name| name.as_ptr()));
    }
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut create = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    if validation {
        create = create.push_next(&mut features);
    }
    // SAFETY: every pointer in `create` outlives the call.
    let instance = unsafe { entry.create_instance(&create, None) };
    match instance {
        // The loader says so when no driver is installed at all.
        Err(vk::Result::ERROR_INCOMPATIBLE_DRIVER) => Err(GpuError::NoDevice),
        other => other.doing(|| "create instance".into()),
    }
}

/// `shows`: its pictures will be shown, with panels drawn over them.
pub fn create_device(instance: &ash::Instance, candidate: &Candidate, shows: bool) -> Result<ash::Device, GpuError> {
    let priorities = [1.0; crate::queues::MAX_QUEUES];
    let families: BTreeSet<u32> = candidate.queues.iter().map(|q| q.family).collect();
    let queues: Vec<_> = families
        .into_iter()
        .map(|family| {
            let count = candidate.queues.iter().filter(|q| q.family == family).count();
            vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&priorities[..count])
        })
        .collect();
    let mut extensions = Vec::new();
    extensions.extend(candidate.pushes.then_some(ash::khr::push_descriptor::NAME.as_ptr()));
    extensions.extend(candidate.calibrated.then_some(ash::ext::calibrated_timestamps::NAME.as_ptr()));
    extensions.extend(shows.then_some(ash::khr::swapchain::NAME.as_ptr()));
    let core = vk::PhysicalDeviceFeatures::default()
        .pipeline_statistics_query(candidate.statistics)
        .shader_storage_image_extended_formats(true)
        .shader_storage_image_write_without_format(true);
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
        .scalar_block_layout(true)
        .timeline_semaphore(true)
        .host_query_reset(true);
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .synchronization2(true)
        .maintenance4(true)
        .dynamic_rendering(shows);
    let create = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&core)
        .push_next(&mut v12)
        .push_next(&mut v13);
    // SAFETY: `choose` made sure that everything asked for is there; every pointer outlives the call.
    unsafe { instance.create_device(candidate.handle, &create, None) }
        .doing(|| format!("create device '{}'", candidate.name))
}

pub fn create_messenger(
    entry: &ash::Entry,
    instance: &ash::Instance,
    messages: &Mutex<Vec<String>>,
) -> Result<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT), GpuError> {
    let debug = ash::ext::debug_utils::Instance::new(entry, instance);
    let create = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        // Not PERFORMANCE: it asks for transfer layouts, and images stay in GENERAL by design.
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
        .pfn_user_callback(Some(on_message))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast());
    // SAFETY: `messages` is boxed in the context and dropped after the messenger.
    let messenger = unsafe { debug.create_debug_utils_messenger(&create, None) };
    messenger.map(|m| (debug, m)).doing(|| "create messenger".into())
}

unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    if data.is_null() || messages.is_null() {
        return vk::FALSE;
    }
    // SAFETY: Vulkan hands over valid data, and `messages` is the context's boxed mutex, which outlives the messenger.
    let (data, messages) = unsafe { (&*data, &*messages.cast::<Mutex<Vec<String>>>()) };
    // SAFETY: a message is null or a terminated string.
    let text = unsafe { data.message_as_c_str() }.map_or(String::new(), |m| m.to_string_lossy().into_owned());
    tracing::error!(target: "validation", "{text}");
    messages.lock().unwrap_or_else(|e| e.into_inner()).push(text);
    vk::FALSE
}
