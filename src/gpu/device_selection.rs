//! Device selection: the properties of each device, the features that it lacks, and the choice of one.

use super::budget::MemoryBudget;
use super::calls;
use super::error::GpuError;
use super::pipeline_cache::DriverIdentity;
use ash::vk;
use std::borrow::Cow;
use std::ffi::CStr;

/// The device that a user asks for.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub enum DeviceChoice {
    /// The best device that lacks no required feature.
    #[default]
    Best,
    /// By its number, from 0, in the list of `echolume devices`.
    Number(usize),
    /// The first device whose name contains this text, ignoring case. An empty text selects none.
    Name(String),
}

impl std::str::FromStr for DeviceChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<DeviceChoice, Self::Err> {
        Ok(text.parse().map_or_else(|_| DeviceChoice::Name(text.to_string()), DeviceChoice::Number))
    }
}

/// The kinds of devices with their names, the best first.
const KINDS: [(vk::PhysicalDeviceType, &str); 5] = [
    (vk::PhysicalDeviceType::DISCRETE_GPU, "discrete GPU"),
    (vk::PhysicalDeviceType::INTEGRATED_GPU, "integrated GPU"),
    (vk::PhysicalDeviceType::VIRTUAL_GPU, "virtual GPU"),
    (vk::PhysicalDeviceType::OTHER, "other"),
    (vk::PhysicalDeviceType::CPU, "software"),
];
/// Index in [`KINDS`] of the entry for kinds that are not listed.
const OTHER: usize = 3;

/// A physical device, with what it lacks and supports.
#[derive(Clone, Debug)]
pub struct Candidate {
    pub handle: vk::PhysicalDevice,
    pub name: String,
    pub kind: vk::PhysicalDeviceType,
    pub driver: String,
    /// The Vulkan version that the device supports, packed as by VK_MAKE_API_VERSION.
    pub version: u32,
    /// Required features that the device lacks.
    pub missing: Vec<Cow<'static, str>>,
    /// Optional features that the device lacks, each with the consequence.
    pub missing_optional: Vec<&'static str>,
    /// The queues to use: the first renders, the second (if any) converts frames, and the third (if any) copies them.
    pub queues: Vec<QueueInfo>,
    /// True if time stamps can be converted to the host's clock (VK_EXT_calibrated_timestamps).
    pub calibrated_timestamps: bool,
    /// True if the host's monotonic clock can be read in the same call as the device's.
    pub(crate) reads_monotonic: bool,
    /// True if it supports push descriptors.
    pub(crate) push_descriptors: bool,
    /// True if it can count shader invocations.
    pub pipeline_statistics: bool,
    /// True if it can report statistics on the compilation of pipelines.
    pub compile_statistics: bool,
    /// True if it can present pictures with panels drawn over them.
    pub can_present: bool,
    /// Identity of the device and driver that stored pipelines must match.
    pub(crate) driver_identity: DriverIdentity,
    /// True if it can report when a picture is on the monitor (VK_KHR_present_wait).
    pub(crate) present_wait: bool,
    /// True if it can report why it was lost (VK_EXT_device_fault).
    pub(crate) device_fault: bool,
    /// True if it can report, after it was lost, which passes its queues had reached (VK_NV_device_diagnostic_checkpoints).
    pub checkpoints: bool,
    /// The memory budget when the devices were listed; None if the device reports none.
    pub budget: Option<MemoryBudget>,
    pub limits: vk::PhysicalDeviceLimits,
    /// Largest allocation of device memory, bytes; it limits images.
    pub max_allocation: u64,
    /// Largest buffer, bytes. Several drivers allow only 2 GiB, but far larger images.
    pub max_buffer: u64,
}

/// A queue of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueueInfo {
    pub family: u32,
    /// Index of the queue within its family.
    pub index: u32,
    /// Number of valid bits of time stamps on the queue; 0 if it has none.
    pub valid_bits: u32,
    pub computes: bool,
    pub draws: bool,
    /// True if the queue can copy single slices of a 3D image; otherwise it copies only complete images.
    pub(crate) copies_slices: bool,
}

impl Candidate {
    pub fn is_software(&self) -> bool {
        self.kind == vk::PhysicalDeviceType::CPU
    }

    /// True if half-precision floats are truncated when shaders store them. Vulkan allows that. llvmpipe does it in every version
    /// (`lp_build_float_to_half` of Mesa), and a test measures it. GPUs round.
    pub fn truncates_halves(&self) -> bool {
        self.is_software() && self.name.contains("llvmpipe")
    }

    /// True if the device uses the machine's memory and has none of its own.
    pub fn has_unified_memory(&self) -> bool {
        self.is_software() || self.kind == vk::PhysicalDeviceType::INTEGRATED_GPU
    }

    /// Number of valid bits of the time stamps of the rendering queue; 0 if it has none.
    pub fn valid_bits(&self) -> u32 {
        self.queues.first().map_or(0, |q| q.valid_bits)
    }

    pub fn kind_name(&self) -> &'static str {
        KINDS[self.rank()].1
    }

    /// The index of its kind in [`KINDS`].
    fn rank(&self) -> usize {
        KINDS.iter().position(|(kind, _)| *kind == self.kind).unwrap_or(OTHER)
    }

    pub fn api_version(&self) -> String {
        let v = self.version;
        format!("{}.{}.{}", vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v))
    }
}

/// Lists every device of an instance, also those that lack a required feature, in the driver's order.
///
/// # Errors
/// The driver cannot list its devices.
pub fn candidates(entry: &ash::Entry, instance: &ash::Instance) -> Result<Vec<Candidate>, GpuError> {
    calls::begins("vkEnumeratePhysicalDevices", "");
    // SAFETY: the instance is alive; the call only reads.
    let handles = unsafe { instance.enumerate_physical_devices() }
        .map_err(|result| GpuError::Vulkan { operation: "list devices".into(), result })?;
    Ok(handles.into_iter().map(|handle| candidate(entry, instance, handle)).collect())
}

fn candidate(entry: &ash::Entry, instance: &ash::Instance, handle: vk::PhysicalDevice) -> Candidate {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut v13 = vk::PhysicalDeviceVulkan13Properties::default();
    let mut properties =
        vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut v11).push_next(&mut v13);
    // SAFETY: `handle` comes from this instance; the chain is on the stack and outlives the call.
    unsafe { instance.get_physical_device_properties2(handle, &mut properties) };
    let properties = properties.properties;
    let text = |c: Result<&CStr, _>| c.map(|c| c.to_string_lossy().into_owned()).unwrap_or_default();

    // SAFETY: as above; both calls only read.
    let families = unsafe { instance.get_physical_device_queue_family_properties(handle) };
    // SAFETY: as above.
    let extensions = unsafe { instance.enumerate_device_extension_properties(handle) }.unwrap_or_default();
    let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));

    let mut can_present = has(ash::khr::swapchain::NAME);
    let mut missing = Vec::new();
    let mut need = |there: bool, name: &'static str| (!there).then(|| missing.push(name.into()));
    need(properties.api_version >= vk::API_VERSION_1_3, "Vulkan 1.3");
    if properties.api_version >= vk::API_VERSION_1_3 {
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
        // SAFETY: as above.
        unsafe { instance.get_physical_device_features2(handle, &mut features) };
        let core = features.features;
        need(core.shader_storage_image_extended_formats == vk::TRUE, "shaderStorageImageExtendedFormats");
        need(core.shader_storage_image_write_without_format == vk::TRUE, "shaderStorageImageWriteWithoutFormat");
        need(v12.scalar_block_layout == vk::TRUE, "scalarBlockLayout");
        need(v12.timeline_semaphore == vk::TRUE, "timelineSemaphore");
        need(v12.host_query_reset == vk::TRUE, "hostQueryReset");
        need(v13.synchronization2 == vk::TRUE, "synchronization2");
        need(v13.maintenance4 == vk::TRUE, "maintenance4");
        let votes = v11.subgroup_supported_operations.contains(vk::SubgroupFeatureFlags::VOTE)
            && v11.subgroup_supported_stages.contains(vk::ShaderStageFlags::COMPUTE);
        need(votes, "subgroup votes in compute shaders");
        can_present &= v13.dynamic_rendering == vk::TRUE;
    }
    let queues = queues(&families);
    need(!queues.is_empty(), "a compute queue");
    let valid_bits = queues.first().map_or(0, |q| q.valid_bits);
    let mut missing_optional = Vec::new();
    let mut lack = |there: bool, what: &'static str| (!there).then(|| missing_optional.push(what));
    let no_compute = "an asynchronous compute queue: frames are converted between pictures, not in parallel with them";
    let no_transfer = "a transfer queue: frames are copied on the queue that converts them";
    lack(queues.len() > 2, if queues.len() == 2 { no_transfer } else { no_compute });
    lack(valid_bits > 0, "time stamps: no times are printed");
    let calibrated_timestamps = valid_bits > 0 && has(ash::ext::calibrated_timestamps::NAME);
    let uncalibrated = "VK_EXT_calibrated_timestamps: a trace aligns the device's times with the host's by estimate";
    lack(calibrated_timestamps, uncalibrated);
    let reads_monotonic = calibrated_timestamps && reads_monotonic(entry, instance, handle);
    let in_turn = "CLOCK_MONOTONIC among the calibrated clocks: a trace's clocks are read one after the other";
    lack(!calibrated_timestamps || reads_monotonic, in_turn);
    let push_descriptors = has(ash::khr::push_descriptor::NAME);
    lack(push_descriptors, "VK_KHR_push_descriptor: descriptors are sets of a pool");
    let mut executables = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default();
    let mut id = vk::PhysicalDevicePresentIdFeaturesKHR::default();
    let mut wait = vk::PhysicalDevicePresentWaitFeaturesKHR::default();
    let mut fault = vk::PhysicalDeviceFaultFeaturesEXT::default();
    let mut features = vk::PhysicalDeviceFeatures2::default()
        .push_next(&mut executables)
        .push_next(&mut id)
        .push_next(&mut wait)
        .push_next(&mut fault);
    // SAFETY: as above. A driver ignores structures of extensions that it does not have.
    unsafe { instance.get_physical_device_features2(handle, &mut features) };
    let pipeline_statistics = features.features.pipeline_statistics_query == vk::TRUE;
    let compile_statistics =
        has(ash::khr::pipeline_executable_properties::NAME) && executables.pipeline_executable_info == vk::TRUE;
    lack(pipeline_statistics, "pipelineStatisticsQuery: invocations are not counted");
    lack(can_present, "VK_KHR_swapchain and dynamicRendering: no presentation");
    let budget = has(ash::ext::memory_budget::NAME).then(|| MemoryBudget::read(instance, handle));
    lack(budget.is_some(), "VK_EXT_memory_budget: memory is allocated until the driver refuses");
    let is_current = properties.api_version >= vk::API_VERSION_1_3;
    let has_extensions = has(ash::khr::present_id::NAME) && has(ash::khr::present_wait::NAME);
    let can_wait = id.present_id == vk::TRUE && wait.present_wait == vk::TRUE;
    let present_wait = is_current && can_present && has_extensions && can_wait;
    let device_fault = is_current && has(ash::ext::device_fault::NAME) && fault.device_fault == vk::TRUE;
    lack(present_wait, "VK_KHR_present_wait: the time from a picture to the monitor is not known");
    lack(device_fault, "VK_EXT_device_fault: the driver does not report why a device was lost");
    let checkpoints = has(ash::nv::device_diagnostic_checkpoints::NAME);
    let unknown_pass = "VK_NV_device_diagnostic_checkpoints: no report of the pass in which a device was lost";
    lack(checkpoints, unknown_pass);
    Candidate {
        handle,
        name: text(properties.device_name_as_c_str()),
        kind: properties.device_type,
        driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
        version: properties.api_version,
        missing,
        missing_optional,
        queues,
        calibrated_timestamps,
        reads_monotonic,
        push_descriptors,
        pipeline_statistics,
        compile_statistics,
        can_present,
        driver_identity: DriverIdentity {
            vendor: properties.vendor_id,
            device: properties.device_id,
            driver_version: properties.driver_version,
            uuid: properties.pipeline_cache_uuid,
        },
        present_wait,
        device_fault,
        checkpoints,
        budget,
        limits: properties.limits,
        // A driver older than Vulkan 1.3 leaves this 0; it is rejected anyway.
        max_allocation: v11.max_memory_allocation_size,
        max_buffer: v11.max_memory_allocation_size.min(v13.max_buffer_size),
    }
}

/// True if the device's clock and the host's monotonic clock can be read in one call.
fn reads_monotonic(entry: &ash::Entry, instance: &ash::Instance, handle: vk::PhysicalDevice) -> bool {
    let clocks = ash::ext::calibrated_timestamps::Instance::new(entry, instance);
    // SAFETY: `handle` comes from this instance and has the extension; the call only reads.
    let there = unsafe { clocks.get_physical_device_calibrateable_time_domains(handle) }.unwrap_or_default();
    there.contains(&vk::TimeDomainEXT::CLOCK_MONOTONIC)
}

/// The granularity of copies of a queue that can copy any part of an image.
const SINGLE_TEXELS: vk::Extent3D = vk::Extent3D { width: 1, height: 1, depth: 1 };

/// The queues to use: one for compute, preferably with graphics, since that one may present pictures; another for compute, preferably
/// without graphics; and one for transfers only.
fn queues(families: &[vk::QueueFamilyProperties]) -> Vec<QueueInfo> {
    let (graphics, compute) = (vk::QueueFlags::GRAPHICS, vk::QueueFlags::COMPUTE);
    let of = |family: usize, index: u32| QueueInfo {
        family: family as u32,
        index,
        valid_bits: families[family].timestamp_valid_bits,
        computes: families[family].queue_flags.contains(compute),
        draws: families[family].queue_flags.contains(graphics),
        copies_slices: families[family].min_image_transfer_granularity == SINGLE_TEXELS,
    };
    let find =
        |fits: &dyn Fn(&vk::QueueFamilyProperties) -> bool| families.iter().position(|f| f.queue_count > 0 && fits(f));
    let first = find(&|f| f.queue_flags.contains(graphics | compute)).or(find(&|f| f.queue_flags.contains(compute)));
    let Some(first) = first else { return Vec::new() };
    let mut queues = vec![of(first, 0)];
    let only_computes =
        |f: &vk::QueueFamilyProperties| f.queue_flags.contains(compute) && !f.queue_flags.contains(graphics);
    match find(&only_computes).filter(|f| *f != first) {
        Some(family) => queues.push(of(family, 0)),
        None if families[first].queue_count > 1 => queues.push(of(first, 1)),
        None => return queues,
    }
    let only_copies = |f: &vk::QueueFamilyProperties| {
        f.queue_flags.contains(vk::QueueFlags::TRANSFER) && !f.queue_flags.intersects(graphics | compute)
    };
    queues.extend(find(&only_copies).map(|family| of(family, 0)));
    queues
}

/// The index in `candidates` of the chosen device.
///
/// # Errors
/// There is no such device, or it lacks a required feature.
pub fn choose(candidates: &[Candidate], choice: &DeviceChoice) -> Result<usize, GpuError> {
    let names = || candidates.iter().enumerate().map(|(i, c)| format!("{i} {}", c.name)).collect::<Vec<_>>().join(", ");
    if candidates.is_empty() {
        return Err(GpuError::NoDevice);
    }
    let missing = |wanted: String| GpuError::NoSuchDevice { wanted, there: names() };
    let index = match choice {
        DeviceChoice::Number(n) => (*n < candidates.len()).then_some(*n).ok_or_else(|| missing(n.to_string()))?,
        DeviceChoice::Name(name) => {
            let part = name.to_lowercase();
            let found = candidates.iter().position(|c| !part.is_empty() && c.name.to_lowercase().contains(&part));
            found.ok_or_else(|| missing(name.clone()))?
        }
        DeviceChoice::Best => {
            let fitting = candidates.iter().enumerate().filter(|(_, c)| c.missing.is_empty());
            let best = fitting.min_by_key(|(_, c)| c.rank()).map(|(i, _)| i);
            best.ok_or_else(|| GpuError::NoneFits(all_lacks(candidates)))?
        }
    };
    match candidates[index].missing.is_empty() {
        true => Ok(index),
        false => Err(GpuError::NoneFits(all_lacks(&candidates[index..=index]))),
    }
}

fn all_lacks(candidates: &[Candidate]) -> String {
    candidates.iter().map(|c| format!("{} lacks {}", c.name, c.missing.join(", "))).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(name: &str, kind: vk::PhysicalDeviceType, lacks: Vec<&'static str>) -> Candidate {
        Candidate {
            handle: vk::PhysicalDevice::null(),
            name: name.into(),
            kind,
            driver: String::new(),
            version: vk::API_VERSION_1_3,
            missing: lacks.into_iter().map(Cow::from).collect(),
            missing_optional: vec![],
            queues: vec![],
            calibrated_timestamps: true,
            reads_monotonic: true,
            push_descriptors: true,
            pipeline_statistics: true,
            compile_statistics: true,
            can_present: true,
            driver_identity: DriverIdentity::default(),
            present_wait: true,
            device_fault: true,
            checkpoints: true,
            budget: None,
            limits: vk::PhysicalDeviceLimits::default(),
            max_allocation: u64::MAX,
            max_buffer: u64::MAX,
        }
    }

    #[test]
    fn the_best_device_is_a_complete_gpu_and_software_comes_last() {
        let devices = [
            device("llvmpipe", vk::PhysicalDeviceType::CPU, vec![]),
            device("Old", vk::PhysicalDeviceType::DISCRETE_GPU, vec!["maintenance4"]),
            device("Small", vk::PhysicalDeviceType::INTEGRATED_GPU, vec![]),
        ];
        assert_eq!(choose(&devices, &DeviceChoice::Best).ok(), Some(2));
        assert_eq!(choose(&devices[..2], &DeviceChoice::Best).ok(), Some(0));
        assert_eq!(choose(&devices, &DeviceChoice::Name("PIPE".into())).ok(), Some(0));
    }

    fn family(flags: vk::QueueFlags, queue_count: u32, depth: u32) -> vk::QueueFamilyProperties {
        let min_image_transfer_granularity = vk::Extent3D { width: depth, height: depth, depth };
        vk::QueueFamilyProperties {
            queue_flags: flags,
            queue_count,
            timestamp_valid_bits: 64,
            min_image_transfer_granularity,
        }
    }

    /// A single queue (lavapipe); several queues in one family (Intel); separate families (NVIDIA, AMD), where the transfer family
    /// may only copy complete images.
    #[test]
    fn one_queue_is_used_for_each_role_that_the_device_has_a_queue_for() {
        use vk::QueueFlags as Q;
        let all = Q::GRAPHICS | Q::COMPUTE | Q::TRANSFER;
        let families = |list: &[vk::QueueFamilyProperties]| -> Vec<(u32, u32)> {
            queues(list).iter().map(|q| (q.family, q.index)).collect()
        };
        assert_eq!(families(&[family(all, 1, 1)]), [(0, 0)]);
        assert_eq!(families(&[family(all, 2, 1)]), [(0, 0), (0, 1)]);
        let own = [family(all, 16, 1), family(Q::TRANSFER, 2, 0), family(Q::COMPUTE | Q::TRANSFER, 8, 1)];
        assert_eq!(families(&own), [(0, 0), (2, 0), (1, 0)]);
        assert_eq!(queues(&own).iter().map(|q| q.copies_slices).collect::<Vec<_>>(), [true, true, false]);
        assert_eq!(families(&[family(Q::TRANSFER, 1, 1), family(Q::COMPUTE, 1, 1)]), [(1, 0)]);
        assert_eq!(families(&[family(Q::TRANSFER, 1, 1)]), []);
    }

    #[test]
    fn an_error_names_the_missing_feature_or_the_devices() {
        let devices = [device("Old", vk::PhysicalDeviceType::DISCRETE_GPU, vec!["maintenance4"])];
        assert!(choose(&devices, &DeviceChoice::Best).unwrap_err().to_string().contains("maintenance4"));
        assert!(choose(&devices, &DeviceChoice::Number(0)).unwrap_err().to_string().contains("maintenance4"));
        assert!(choose(&devices, &DeviceChoice::Number(7)).unwrap_err().to_string().contains("0 Old"));
        assert!(matches!(choose(&[], &DeviceChoice::Best), Err(GpuError::NoDevice)));
    }
}
