//! Device memory from the context's allocator, within the budget that the device reports.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::faults::InjectionPoint;
use crate::sync::locked;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::atomic::Ordering;

/// The device memory that an image or a buffer needs.
pub(super) struct Reserve<'a> {
    pub name: &'a str,
    pub requirements: vk::MemoryRequirements,
    pub location: MemoryLocation,
    /// True for a buffer, false for an image.
    pub linear: bool,
}

/// Allocates device memory. `operation`: what it is for, in an error.
///
/// # Errors
/// Memory is exhausted.
pub(super) fn reserve(
    context: &Context,
    wanted: Reserve,
    operation: &dyn Fn() -> String,
) -> Result<Allocation, GpuError> {
    context.faults.check(InjectionPoint::Allocate).context(operation)?;
    context.counts.allocations.fetch_add(1, Ordering::Relaxed);
    let mut allocator = locked(&context.allocator);
    let Some(allocator) = allocator.as_mut() else {
        return Err(GpuError::Memory { operation: operation(), fault: "the context is shutting down".into() });
    };
    let Reserve { name, requirements, location, linear } = wanted;
    if let Some(budget) = context.memory_budget() {
        let required = match location {
            MemoryLocation::GpuOnly => vk::MemoryPropertyFlags::DEVICE_LOCAL,
            _ => vk::MemoryPropertyFlags::HOST_VISIBLE,
        };
        let check =
            |reserve| budget.check(operation, requirements.size, requirements.memory_type_bits, required, reserve);
        // What is allocated and free is only added up where it decides.
        if check(0).is_err() {
            let report = allocator.generate_report();
            check(report.total_capacity_bytes.saturating_sub(report.total_allocated_bytes))?;
        }
    }
    allocator
        .allocate(&AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        })
        .map_err(|e| GpuError::Memory { operation: operation(), fault: e.to_string() })
}

/// Frees device memory that [`reserve`] allocated.
pub(super) fn free(context: &Context, allocation: Option<Allocation>) {
    let mut allocator = locked(&context.allocator);
    if let (Some(allocator), Some(allocation)) = (allocator.as_mut(), allocation) {
        // Freeing an allocation of this allocator cannot fail, and a Drop could not report it.
        let _ = allocator.free(allocation);
    }
}
