//! The Khronos validation layer: the checks that are requested of it, and its messages.

use super::error::{ErrorContext, GpuError};
use crate::sync::locked;
use ash::vk;
use std::ffi::{CStr, c_void};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// The first version whose synchronization validation handles timeline semaphores (Vulkan-ValidationLayers #8559, September 2024).
const KNOWS_TIMELINES: u32 = vk::make_api_version(0, 1, 3, 297);

/// The validation layer that is installed.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    version: u32,
    /// True if the layer gets [`settings`] (VK_EXT_layer_settings) instead of [`FEATURES`]: it takes settings and is at least version 1.3.297, since
    /// earlier ones do not know every setting.
    pub(crate) has_settings: bool,
}

impl Layer {
    pub const NAME: &CStr = c"VK_LAYER_KHRONOS_validation";

    pub fn find(entry: &ash::Entry) -> Option<Layer> {
        // SAFETY: only reads the list of layers.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
        let version = layers.iter().find(|l| l.layer_name_as_c_str() == Ok(Layer::NAME))?.spec_version;
        // SAFETY: only reads the list of the layer's extensions.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(Some(Layer::NAME)) };
        let is_settings =
            |e: &vk::ExtensionProperties| e.extension_name_as_c_str() == Ok(ash::ext::layer_settings::NAME);
        // Layers between the two do not know every setting, and say so in a message.
        let has_settings = version >= KNOWS_TIMELINES && extensions.unwrap_or_default().iter().any(is_settings);
        Some(Layer { version, has_settings })
    }

    fn knows_timelines(self) -> bool {
        self.version >= KNOWS_TIMELINES
    }

    /// The extension of the layer through which the instance enables synchronization validation.
    pub fn extension(self) -> &'static CStr {
        if self.has_settings { ash::ext::layer_settings::NAME } else { ash::ext::validation_features::NAME }
    }
}

/// The settings for a layer that takes settings. Since 2024 synchronization validation ignores the accesses of shaders unless the second setting is
/// on. It then assumes that a shader accesses every descriptor that it names, which all shaders here do.
pub fn settings() -> [vk::LayerSettingEXT<'static>; 2] {
    const ON: &vk::Bool32 = &vk::TRUE;
    [c"validate_sync", c"syncval_shader_accesses_heuristic"].map(|name| {
        let mut setting = vk::LayerSettingEXT::default()
            .layer_name(Layer::NAME)
            .setting_name(name)
            .ty(vk::LayerSettingTypeEXT::BOOL32)
            .values(bytemuck::bytes_of(ON));
        // ash 0.38 counts bytes.
        setting.value_count = 1;
        setting
    })
}

/// The features that are enabled in a layer that takes no settings.
pub(crate) const FEATURES: &[vk::ValidationFeatureEnableEXT] =
    &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];

/// Waits for timelines between two idle queues that an older layer is shown: showing it one after each wait took four times the CPU time.
const UNSEEN_WAITS: u64 = 512;

/// Collects the messages of the layer. It must be dropped before its instance is destroyed.
pub(crate) struct Messenger {
    layer: Layer,
    /// Waits for timelines that the layer did not see.
    unseen_waits: AtomicU64,
    debug: ash::ext::debug_utils::Instance,
    handle: vk::DebugUtilsMessengerEXT,
    messages: Box<Mutex<Vec<String>>>,
}

impl Messenger {
    /// Begins to collect messages.
    ///
    /// # Errors
    /// The instance runs out of memory.
    pub fn new(entry: &ash::Entry, instance: &ash::Instance, layer: Layer) -> Result<Messenger, GpuError> {
        let messages = Box::new(Mutex::new(Vec::new()));
        let debug = ash::ext::debug_utils::Instance::new(entry, instance);
        let create = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            // Not PERFORMANCE: it recommends transfer layouts, but images stay in GENERAL by design.
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(on_message))
            .user_data(std::ptr::from_ref::<Mutex<Vec<String>>>(&messages).cast_mut().cast());
        // SAFETY: `messages` is boxed, and is dropped after the messenger is destroyed.
        let handle = unsafe { debug.create_debug_utils_messenger(&create, None) };
        let handle = handle.context(|| "create messenger".into())?;
        Ok(Messenger { layer, unseen_waits: AtomicU64::new(1), debug, handle, messages })
    }

    /// All warnings and errors so far, without known false positives.
    pub fn messages(&self) -> Vec<String> {
        locked(&self.messages).clone()
    }

    /// True if the layer is one of those that do not see waits for timelines.
    pub(super) fn misses_waits(&self) -> bool {
        !self.layer.knows_timelines()
    }

    /// True if the layer, which does not see waits for timelines, should be shown an idle queue now. Call it after such a wait.
    pub(super) fn needs_an_idle_queue(&self) -> bool {
        self.misses_waits() && self.unseen_waits.fetch_add(1, Ordering::Relaxed).is_multiple_of(UNSEEN_WAITS)
    }
}

impl Drop for Messenger {
    fn drop(&mut self) {
        // SAFETY: the instance is still there, as the type's description demands, and nothing calls back once this returns.
        unsafe { self.debug.destroy_debug_utils_messenger(self.handle, None) };
    }
}

/// Passes that write the slices near new frames with one dispatch for each run of slices, and their shaders. The layer reports a write after a write
/// for them: since 2024 it assumes that every access through a view is to the whole image. The dispatches write different slices of one 3D image, so
/// no barrier is needed between them. Where two of them do write the same slice, the barrier oracle of the tests notices a missing barrier.
pub const WRITERS_OF_RUNS: [(&str, &str); 6] = [
    ("tile_ranges", "empty_space/tile_ranges"),
    ("gaussian_elevation", "filter/gaussian"),
    ("section_elevation", "filter/gaussian"),
    ("drop_floating", "preprocess/drop_floating"),
    ("cut", "preprocess/cut"),
    ("packed_neighbours", "preprocess/packed_neighbours"),
];

fn is_known_false_positive(message: &str) -> bool {
    message.contains("WRITE_AFTER_WRITE hazard detected")
        && WRITERS_OF_RUNS.iter().any(|(pass, shader)| {
            message.contains(&format!("previously written by another vkCmdDispatch[{pass}] command"))
                && message.contains(&format!("[{shader}], image layout"))
        })
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
    // SAFETY: Vulkan hands over valid data, and `messages` is the messenger's boxed mutex, which outlives its handle.
    let (data, messages) = unsafe { (&*data, &*messages.cast::<Mutex<Vec<String>>>()) };
    // SAFETY: a message and its name are null or terminated strings.
    let [text, name] = unsafe { [data.message_as_c_str(), data.message_id_name_as_c_str()] }
        .map(|text| text.map_or(String::new(), |t| t.to_string_lossy().into_owned()));
    if is_known_false_positive(&text) {
        tracing::debug!(target: "validation", "ignored: {text}");
        return vk::FALSE;
    }
    // Older layers repeat the name in the message.
    let text = if text.contains(&name) { text } else { format!("{name}: {text}") };
    tracing::error!(target: "validation", "{text}");
    locked(messages).push(text);
    vk::FALSE
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the layer 1.4.363 words them.
    #[test]
    fn only_writes_of_one_pass_to_slices_of_its_image_are_ignored() {
        let message = |hazard: &str, shader: &str, by: &str| {
            format!(
                "vkCmdDispatch(): {hazard} hazard detected. Shader stage VK_SHADER_STAGE_COMPUTE_BIT writes to VkImageView \
                 0xa510000000a51[volume], which was previously written by another vkCmdDispatch[{by}] command. \nThe image is \
                 referenced by descriptor binding 2 (VK_DESCRIPTOR_TYPE_STORAGE_IMAGE) from descriptor set 0 (VkDescriptorSet 0x0), \
                 VkPipeline 0x1c000000001c[{shader}], image layout VK_IMAGE_LAYOUT_GENERAL."
            )
        };
        let tiles = "empty_space/tile_ranges";
        assert!(is_known_false_positive(&message("WRITE_AFTER_WRITE", tiles, "tile_ranges")));
        assert!(is_known_false_positive(&message("WRITE_AFTER_WRITE", "filter/gaussian", "gaussian_elevation")));
        for (hazard, shader, by) in [
            ("READ_AFTER_WRITE", tiles, "tile_ranges"),
            ("WRITE_AFTER_READ", tiles, "tile_ranges"),
            ("WRITE_AFTER_WRITE", "filter/gaussian", "gaussian_depth"),
            ("WRITE_AFTER_WRITE", "preprocess/cut", "gaussian_elevation"),
            ("WRITE_AFTER_WRITE", tiles, "clear"),
        ] {
            assert!(!is_known_false_positive(&message(hazard, shader, by)), "{hazard} {shader} {by}");
        }
    }
}
