//! Descriptor sets for devices without push descriptors, from pools whose free space is counted.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::pipelines::{Pipeline, descriptor_type};
use crate::spirv::Kind;
use ash::vk;
use std::sync::Arc;

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
pub(crate) struct DescriptorSets {
    context: Arc<Context>,
    pools: Vec<vk::DescriptorPool>,
    /// What is left in the current pool.
    left: PoolSpace,
    current: usize,
}

impl DescriptorSets {
    /// Makes an empty collection. A pool is allocated with the first set, so that a device with push descriptors needs none.
    pub fn new(context: &Arc<Context>) -> DescriptorSets {
        DescriptorSets { context: context.clone(), pools: Vec::new(), left: FULL, current: 0 }
    }

    /// Frees all sets. The device must be done with the command buffer that uses them.
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
        // SAFETY: whoever drops this has waited for the device; a pool frees its sets.
        let destroy = |device: &ash::Device, pool| unsafe { device.destroy_descriptor_pool(pool, None) };
        self.context.destroy(|device| self.pools.iter().for_each(|pool| destroy(device, *pool)));
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
