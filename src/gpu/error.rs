//! Errors of the GPU, each with the name of the failed operation.

use ash::vk;

/// An error of Vulkan, a violated limit of the device, or wrong use of a renderer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    #[error("no Vulkan loader: {0}; install one (Debian: apt-get install libvulkan1 mesa-vulkan-drivers)")]
    NoLoader(String),
    #[error(
        "no Vulkan device; install a driver (Debian, software: apt-get install mesa-vulkan-drivers), \
         and check that VK_DRIVER_FILES and VK_ICD_FILENAMES, if set, name an existing one"
    )]
    NoDevice,
    #[error("no usable device: {0}")]
    NoneFits(String),
    #[error("no device {wanted:?}; available: {there}")]
    NoSuchDevice { wanted: String, there: String },
    #[error(
        "validation was requested, but the layer VK_LAYER_KHRONOS_validation is not installed (Debian: vulkan-validationlayers)"
    )]
    NoValidation,
    #[error("{operation}: {}", describe(*.result))]
    Vulkan { operation: String, result: vk::Result },
    #[error("{operation}: the device was lost; its driver reports: {report}")]
    Lost { operation: String, report: String },
    #[error(
        "{what}: needs {} MiB, the budget of this device's memory is {} MiB, of which {} MiB are used",
        needed.div_ceil(1 << 20), budget >> 20, used >> 20
    )]
    Budget { what: String, needed: u64, budget: u64, used: u64 },
    #[error("{operation}: {fault}")]
    Memory { operation: String, fault: String },
    #[error("{what}: needs {needed}, the device allows {allowed}")]
    Limit { what: String, needed: u64, allowed: u64 },
    #[error("{what}: the device cannot use {format} as {usage}")]
    Format { what: String, format: String, usage: String },
    #[error("{shader}: {fault}")]
    Shader { shader: String, fault: String },
    #[error("frame: {got} bytes arrived, the scene's frames have {expected}")]
    FrameSize { got: usize, expected: usize },
    #[error("frame for slice {slice}: the volume has {slices} slices")]
    FrameSlice { slice: usize, slices: u32 },
    #[error("volume image {image}: there are only {images}")]
    VolumeImage { image: u32, images: u32 },
    #[error("the last change of scene failed ({0}); the next one rebuilds everything")]
    Broken(String),
    #[error("no window: {0}")]
    Window(String),
    #[error("the device did not finish within {seconds} s; last submitted: {operation}")]
    TimedOut { seconds: f64, operation: String },
    #[error("a signal ended the wait for the device; last submitted: {operation}")]
    Stopped { operation: String },
}

impl GpuError {
    /// True if the device was lost or given up ([`GpuError::is_given_up`]). Everything must then be made again from a new context.
    pub fn is_device_lost(&self) -> bool {
        matches!(self, GpuError::Vulkan { result: vk::Result::ERROR_DEVICE_LOST, .. } | GpuError::Lost { .. })
            || self.is_given_up()
    }

    /// True if the wait for the device was given up, after a time-out or at a signal.
    pub fn is_given_up(&self) -> bool {
        matches!(self, GpuError::TimedOut { .. } | GpuError::Stopped { .. })
    }
}

/// Converts a Vulkan result to a [`GpuError`] that names the operation that failed.
pub(crate) trait ErrorContext<T> {
    fn context(self, operation: impl FnOnce() -> String) -> Result<T, GpuError>;
}

impl<T> ErrorContext<T> for Result<T, vk::Result> {
    fn context(self, operation: impl FnOnce() -> String) -> Result<T, GpuError> {
        self.map_err(|result| GpuError::Vulkan { operation: operation(), result })
    }
}

fn describe(result: vk::Result) -> String {
    match result {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => "out of device memory".into(),
        vk::Result::ERROR_OUT_OF_HOST_MEMORY => "out of host memory".into(),
        vk::Result::ERROR_DEVICE_LOST => "the device was lost".into(),
        other => format!("{other:?}"),
    }
}
