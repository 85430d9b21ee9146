//! The driver's pipeline cache, stored on disk between runs: a pipeline that was compiled once with this device, driver and version of the
//! shaders is loaded. A failure here costs only the time of compilation: it is logged once.

mod stored;

pub use stored::DriverIdentity;

use crate::sync::locked;
use ash::vk;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use stored::{CacheFile, checksum};

/// The Vulkan pipeline cache of a device. Without a folder the handle is null: pipelines are compiled without a cache.
pub(crate) struct PipelineCache {
    /// The handle for vkCreateComputePipelines; null without a folder, or if the driver could not create a cache. Several threads may use it at the
    /// same time.
    pub handle: vk::PipelineCache,
    file: Option<CacheFile>,
    /// What the file held when it was read or written last: bytes, and their checksum.
    stored: Mutex<(usize, u64)>,
    /// A pipeline was compiled that the cache did not have.
    has_grown: AtomicBool,
}

impl PipelineCache {
    /// Opens a cache with the data that the folder has for this driver, or an empty one. Without a folder there is no cache. Never fails.
    pub fn open(device: &ash::Device, identity: &DriverIdentity, folder: Option<&Path>) -> PipelineCache {
        let file = folder.map(|folder| CacheFile::new(folder, identity));
        let mut cache = PipelineCache {
            handle: vk::PipelineCache::null(),
            file,
            stored: Mutex::default(),
            has_grown: AtomicBool::new(false),
        };
        let Some(file) = &cache.file else { return cache };
        let data = file.read().unwrap_or_else(|fault| {
            tracing::debug!("pipeline cache {}: {fault}; it is replaced", file.path.display());
            None
        });
        let data = data.unwrap_or_default();
        // A driver may refuse data that looks right; it then gets an empty cache.
        let made = create(device, &data).map(|handle| (handle, data.as_slice()));
        match made.or_else(|_| create(device, &[]).map(|handle| (handle, [].as_slice()))) {
            Ok((handle, data)) => {
                tracing::debug!("pipeline cache {}: {} bytes", file.path.display(), data.len());
                cache.handle = handle;
                cache.stored = Mutex::new((data.len(), checksum(data)));
            }
            Err(result) => {
                tracing::debug!("pipeline cache: {result:?}; there is none");
                cache.file = None;
            }
        }
        cache
    }

    /// Notes that a pipeline was made with this cache. `hit`: the driver says that it took the pipeline from the cache; `None` if it does not say.
    pub fn used(&self, hit: Option<bool>) {
        if hit != Some(true) {
            self.has_grown.store(true, Ordering::Relaxed);
        }
    }

    /// Writes the cache to its file, if pipelines were compiled that the file lacks. What another program added since is kept.
    pub fn store(&self, device: &ash::Device) {
        let Some(file) = &self.file else { return };
        let mut stored = locked(&self.stored);
        if !self.has_grown.swap(false, Ordering::Relaxed) {
            return;
        }
        let other = file.read().ok().flatten().filter(|data| (data.len(), checksum(data)) != *stored);
        let data = match other {
            None => self.bytes(device),
            Some(other) => self.merged(device, &other).or_else(|_| self.bytes(device)),
        };
        let data = match data {
            Ok(data) => data,
            Err(result) => return tracing::debug!("pipeline cache: {result:?}; it is not stored"),
        };
        let now = (data.len(), checksum(&data));
        if now == *stored && file.path.exists() {
            return;
        }
        match file.write(&data) {
            Ok(()) => {
                tracing::debug!("pipeline cache {}: {} bytes stored", file.path.display(), data.len());
                *stored = now;
            }
            Err(fault) => tracing::debug!("pipeline cache: {fault}; it is not stored"),
        }
    }

    fn bytes(&self, device: &ash::Device) -> Result<Vec<u8>, vk::Result> {
        // SAFETY: the cache is alive; the driver synchronizes this call with the making of pipelines.
        unsafe { device.get_pipeline_cache_data(self.handle) }
    }

    /// This cache with the data of another, as bytes. Merged apart: nothing else may use the target of a merge meanwhile.
    fn merged(&self, device: &ash::Device, other: &[u8]) -> Result<Vec<u8>, vk::Result> {
        let both = create(device, other)?;
        // SAFETY: both caches are alive, and only this thread knows the target.
        let data = unsafe {
            device.merge_pipeline_caches(both, &[self.handle]).and_then(|()| device.get_pipeline_cache_data(both))
        };
        // SAFETY: nothing uses it any more.
        unsafe { device.destroy_pipeline_cache(both, None) };
        data
    }

    /// Destroys the cache. No pipeline may be being compiled.
    pub fn destroy(&mut self, device: &ash::Device) {
        // SAFETY: the caller owns the cache, so that no thread makes a pipeline with it; null is allowed.
        unsafe { device.destroy_pipeline_cache(self.handle, None) };
        self.handle = vk::PipelineCache::null();
        self.file = None;
    }
}

/// Creates a Vulkan pipeline cache. `data`: what [`CacheFile::read`] accepted, or what this driver has just returned; empty for an empty cache.
pub fn create(device: &ash::Device, data: &[u8]) -> Result<vk::PipelineCache, vk::Result> {
    let create = vk::PipelineCacheCreateInfo::default().initial_data(data);
    // SAFETY: the structure and the data outlive the call; the data is of this driver, complete and unchanged.
    unsafe { device.create_pipeline_cache(&create, None) }
}
