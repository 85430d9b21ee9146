//! The budget of device memory (VK_EXT_memory_budget): how much this process can use now, beside all others. Beyond it a driver moves
//! memory of this or another program out of the device. Everything then becomes slow, or an allocation fails later.

use super::error::GpuError;
use ash::vk;

/// A memory heap. All sizes are in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct HeapBudget {
    pub size: u64,
    /// The most that this process can use of the heap at present, bytes, including what it uses already.
    pub budget: u64,
    /// What this process uses of the heap now, bytes.
    pub used: u64,
    pub is_device_local: bool,
}

/// The memory heaps of a device by VK_EXT_memory_budget, and the heap of each memory type.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MemoryBudget {
    pub(crate) heaps: Vec<HeapBudget>,
    /// For each memory type the index of its heap and its properties.
    pub types: Vec<(usize, vk::MemoryPropertyFlags)>,
}

impl MemoryBudget {
    /// Reads the current budget of a device, which must have VK_EXT_memory_budget.
    pub fn read(instance: &ash::Instance, device: vk::PhysicalDevice) -> MemoryBudget {
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut properties = vk::PhysicalDeviceMemoryProperties2::default().push_next(&mut budget);
        // SAFETY: the handle belongs to this instance; the chain outlives the call, which only reads.
        unsafe { instance.get_physical_device_memory_properties2(device, &mut properties) };
        let there = properties.memory_properties;
        let heap = |(n, heap): (usize, &vk::MemoryHeap)| HeapBudget {
            size: heap.size,
            budget: budget.heap_budget[n],
            used: budget.heap_usage[n],
            is_device_local: heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL),
        };
        MemoryBudget {
            heaps: there.memory_heaps_as_slice().iter().enumerate().map(heap).collect(),
            types: there.memory_types_as_slice().iter().map(|t| (t.heap_index as usize, t.property_flags)).collect(),
        }
    }

    /// Refuses an allocation that fits into the budget of no heap that it could use. Heaps without a stated budget do not count; if no heap is left,
    /// nothing is refused. `what`: name of the allocation for the message; `needed`: its bytes; `types`: bits of the allowed memory types;
    /// `required`: properties that the type must have; `reserve`: bytes that this process has allocated but does not use.
    ///
    /// # Errors
    /// One line with the needed size, the budget, and the used part of it.
    pub fn check(
        &self,
        what: impl FnOnce() -> String,
        needed: u64,
        types: u32,
        required: vk::MemoryPropertyFlags,
        reserve: u64,
    ) -> Result<(), GpuError> {
        let fits = |heap: &HeapBudget| heap.used.saturating_sub(reserve).saturating_add(needed) <= heap.budget;
        let allowed = self.types.iter().enumerate().filter(|(n, _)| types & (1 << n) != 0);
        let heaps: Vec<&HeapBudget> = allowed
            .filter(|(_, (_, properties))| properties.contains(required))
            .filter_map(|(_, (heap, _))| self.heaps.get(*heap))
            // A driver that reports no budget for a heap has none.
            .filter(|heap| heap.budget > 0)
            .collect();
        match heaps.iter().max_by_key(|heap| heap.budget.saturating_sub(heap.used)) {
            Some(best) if !heaps.iter().any(|heap| fits(heap)) => {
                Err(GpuError::Budget { what: what(), needed, budget: best.budget, used: best.used })
            }
            _ => Ok(()),
        }
    }

    /// Describes the budgets of the device's own heaps in one line for users, or of all heaps if the device has none of its own.
    pub fn line(&self) -> String {
        let own = self.heaps.iter().any(|heap| heap.is_device_local);
        let heaps = self.heaps.iter().filter(|heap| heap.is_device_local || !own);
        let words = |h: &HeapBudget| {
            format!("{} MiB of {} MiB, {} MiB used by this process", h.budget >> 20, h.size >> 20, h.used >> 20)
        };
        heaps.map(words).collect::<Vec<_>>().join("; ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OWN: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::DEVICE_LOCAL;
    const HOST: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::HOST_VISIBLE;

    fn budget() -> MemoryBudget {
        let heap = |size, budget, used, is_device_local| HeapBudget { size, budget, used, is_device_local };
        MemoryBudget {
            heaps: vec![heap(8 << 30, 4 << 30, 3 << 30, true), heap(32 << 30, 16 << 30, 1 << 30, false)],
            types: vec![(0, OWN), (1, HOST), (0, OWN | HOST)],
        }
    }

    #[test]
    fn an_allocation_over_the_budget_of_each_of_its_heaps_is_refused_with_the_numbers() {
        let check = |needed: u64, types, required, reserve| {
            budget().check(|| "volume".into(), needed, types, required, reserve)
        };
        assert!(check(1 << 30, 0b001, OWN, 0).is_ok());
        let line = check((1 << 30) + 1, 0b001, OWN, 0).unwrap_err().to_string();
        assert_eq!(
            line,
            "volume: needs 1025 MiB, the budget of this device's memory is 4096 MiB, of which 3072 MiB are used"
        );
        assert!(check((1 << 30) + 1, 0b001, OWN, 1).is_ok(), "it fits into what is allocated already");
        assert!(check(5 << 30, 0b011, vk::MemoryPropertyFlags::empty(), 0).is_ok(), "the other heap has room");
        assert!(check(5 << 30, 0b101, HOST, 0).is_err());
        assert!(check(u64::MAX, 0, OWN, 0).is_ok(), "the driver says what is wrong with no memory type");
        let mut unknown = budget();
        unknown.heaps[0].budget = 0;
        assert!(unknown.check(|| "volume".into(), 1 << 40, 0b001, OWN, 0).is_ok());
    }

    #[test]
    fn the_line_has_the_heaps_of_the_device() {
        assert_eq!(budget().line(), "4096 MiB of 8192 MiB, 3072 MiB used by this process");
        let mut shared = budget();
        shared.heaps.remove(0);
        assert!(shared.line().starts_with("16384 MiB of 32768 MiB"));
    }
}
