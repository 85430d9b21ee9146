//! Reads what a driver reports after it lost a device: addresses and codes of the fault (VK_EXT_device_fault), and on NVIDIA the passes
//! that its queues had reached (VK_NV_device_diagnostic_checkpoints).

use crate::passes::PASSES;
use ash::vk;
use std::borrow::Cow;
use std::ffi::{CStr, FromBytesUntilNulError, c_void};
use std::fmt::{self, Display, Formatter};

/// Most addresses, codes or checkpoints that one line reports of each.
const MAX_REPORTED: usize = 4;

/// The driver's report on the loss of a device. Each list may be empty, because drivers report only what they know.
#[derive(Clone, Debug, Default)]
pub struct LossReport {
    pub description: String,
    /// Addresses of failed memory accesses and of instructions.
    pub addresses: Vec<vk::DeviceFaultAddressInfoEXT>,
    /// Codes that only the vendor can interpret.
    pub codes: Vec<vk::DeviceFaultVendorInfoEXT>,
    pub checkpoints: Vec<Checkpoint>,
}

/// A pass that a queue had reached when the device was lost.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// Number of the queue, from 0.
    pub queue: usize,
    pub pass: &'static str,
    /// True if all work before the pass was done; otherwise the pass had begun.
    pub is_done: bool,
}

impl Display for LossReport {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let mut parts = Vec::new();
        // What a driver writes goes to a terminal and a log.
        let plain = |text: &str| crate::text::single_line(text.trim());
        if !self.description.trim().is_empty() {
            parts.push(plain(&self.description));
        }
        let range = |a: &vk::DeviceFaultAddressInfoEXT| {
            let place = format!("{} at {:#x}", kind_of(a.address_type), a.reported_address);
            match a.address_precision {
                0 | 1 => place,
                // The fault lies in the aligned block of this many bytes, a power of two, that contains the address.
                precision => format!("{place} within {precision} bytes"),
            }
        };
        parts.extend(self.addresses.iter().take(MAX_REPORTED).map(range));
        let code = |c: &vk::DeviceFaultVendorInfoEXT| {
            let description = text(c.description_as_c_str());
            format!("{} (code {:#x}, {:#x})", plain(&description), c.vendor_fault_code, c.vendor_fault_data)
        };
        parts.extend(self.codes.iter().take(MAX_REPORTED).map(code));
        let reached = |c: &Checkpoint| {
            format!("queue {} had {} '{}'", c.queue, if c.is_done { "reached" } else { "begun" }, c.pass)
        };
        parts.extend(self.checkpoints.iter().take(MAX_REPORTED).map(reached));
        f.write_str(&parts.join("; "))
    }
}

impl LossReport {
    /// True if the driver reported nothing.
    pub fn is_empty(&self) -> bool {
        self.to_string().is_empty()
    }
}

/// The extensions by which drivers report on a lost device, where they are enabled.
pub(crate) struct LossReporting {
    pub faults: Option<ash::ext::device_fault::Device>,
    pub checkpoints: Option<ash::nv::device_diagnostic_checkpoints::Device>,
}

impl LossReporting {
    /// Reads the report on the device that was just lost. No other thread may use `queues`.
    pub fn read(&self, device: vk::Device, queues: &[vk::Queue]) -> LossReport {
        let mut report = self.faults.as_ref().map_or_else(LossReport::default, |faults| read_faults(faults, device));
        for (queue, handle) in queues.iter().enumerate() {
            let Some(checkpoints) = &self.checkpoints else { break };
            // SAFETY: the extension is enabled, the device is lost, and the caller has the queue to itself.
            let reached = unsafe {
                let count = checkpoints.get_queue_checkpoint_data_len(*handle);
                let mut reached = vec![vk::CheckpointDataNV::default(); count];
                checkpoints.get_queue_checkpoint_data(*handle, &mut reached);
                reached
            };
            report.checkpoints.extend(reached.iter().map(|c| Checkpoint {
                queue,
                pass: pass_of(c.p_checkpoint_marker),
                is_done: c.stage.contains(vk::PipelineStageFlags::BOTTOM_OF_PIPE),
            }));
        }
        report
    }

    /// Records a checkpoint at this pass. After the device is lost, [`LossReporting::read`] lists the checkpoints that each queue reached.
    pub fn mark(&self, commands: vk::CommandBuffer, pass: &str) {
        if let Some(checkpoints) = &self.checkpoints {
            // SAFETY: the command buffer is being recorded; the marker is a number and is never read through.
            unsafe { checkpoints.cmd_set_checkpoint(commands, marker_of(pass)) };
        }
    }
}

/// A number that stands for a pass in place of a pointer. 0 is any pass that only tests and benchmarks run.
fn marker_of(pass: &str) -> *const c_void {
    std::ptr::without_provenance(PASSES.iter().position(|p| p.name == pass).map_or(0, |n| n + 1))
}

fn pass_of(marker: *mut c_void) -> &'static str {
    let number = marker.addr();
    number.checked_sub(1).and_then(|n| PASSES.get(n)).map_or("another pass", |pass| pass.name)
}

/// A text of the driver; empty if it does not end.
fn text(driver: Result<&CStr, FromBytesUntilNulError>) -> Cow<'_, str> {
    driver.map_or(Cow::default(), CStr::to_string_lossy)
}

fn read_faults(faults: &ash::ext::device_fault::Device, device: vk::Device) -> LossReport {
    let get = faults.fp().get_device_fault_info_ext;
    let mut counts = vk::DeviceFaultCountsEXT::default();
    // SAFETY: the extension is enabled and the device is lost; without a place for them only the counts are returned.
    if unsafe { get(device, &mut counts, std::ptr::null_mut()) } != vk::Result::SUCCESS {
        return LossReport::default();
    }
    let mut addresses = vec![vk::DeviceFaultAddressInfoEXT::default(); counts.address_info_count as usize];
    let mut codes = vec![vk::DeviceFaultVendorInfoEXT::default(); counts.vendor_info_count as usize];
    // The vendor's binary dump is not asked for: its feature is not enabled.
    counts.vendor_binary_size = 0;
    let mut info = vk::DeviceFaultInfoEXT {
        p_address_infos: addresses.as_mut_ptr(),
        p_vendor_infos: codes.as_mut_ptr(),
        ..Default::default()
    };
    // SAFETY: both arrays have room for as many as counted.
    let result = unsafe { get(device, &mut counts, &mut info) };
    if result != vk::Result::SUCCESS && result != vk::Result::INCOMPLETE {
        return LossReport::default();
    }
    addresses.truncate(counts.address_info_count as usize);
    codes.truncate(counts.vendor_info_count as usize);
    let description = text(info.description_as_c_str()).into_owned();
    LossReport { description, addresses, codes, checkpoints: Vec::new() }
}

fn kind_of(kind: vk::DeviceFaultAddressTypeEXT) -> &'static str {
    match kind {
        vk::DeviceFaultAddressTypeEXT::READ_INVALID => "invalid read",
        vk::DeviceFaultAddressTypeEXT::WRITE_INVALID => "invalid write",
        vk::DeviceFaultAddressTypeEXT::EXECUTE_INVALID => "invalid instruction fetch",
        vk::DeviceFaultAddressTypeEXT::INSTRUCTION_POINTER_UNKNOWN => "instruction",
        vk::DeviceFaultAddressTypeEXT::INSTRUCTION_POINTER_INVALID => "invalid instruction",
        vk::DeviceFaultAddressTypeEXT::INSTRUCTION_POINTER_FAULT => "failing instruction",
        _ => "address",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_one_line_of_what_the_driver_knows() {
        assert!(LossReport::default().is_empty());
        let address = |address_type, reported_address, address_precision| vk::DeviceFaultAddressInfoEXT {
            address_type,
            reported_address,
            address_precision,
        };
        let code = vk::DeviceFaultVendorInfoEXT::default();
        let report = LossReport {
            description: "GPU hang\n\u{1b}[31mred".into(),
            addresses: vec![
                address(vk::DeviceFaultAddressTypeEXT::READ_INVALID, 0x1000, 4096),
                address(vk::DeviceFaultAddressTypeEXT::INSTRUCTION_POINTER_FAULT, 0x20, 1),
            ],
            codes: vec![code.description(c"MMU fault").expect("short").vendor_fault_code(13).vendor_fault_data(7)],
            checkpoints: vec![
                Checkpoint { queue: 0, pass: "shadow", is_done: true },
                Checkpoint { queue: 1, pass: "scan_convert", is_done: false },
            ],
        };
        let line = report.to_string();
        assert!(!line.chars().any(char::is_control), "{line:?}");
        for part in [
            "invalid read at 0x1000 within 4096 bytes; failing instruction at 0x20;",
            "MMU fault (code 0xd, 0x7)",
            "queue 0 had reached 'shadow'; queue 1 had begun 'scan_convert'",
        ] {
            assert!(line.contains(part), "{part}: {line}");
        }
        let many = LossReport { codes: vec![report.codes[0]; 100], ..LossReport::default() };
        assert_eq!(many.to_string().matches("MMU fault").count(), MAX_REPORTED);
    }

    #[test]
    fn a_marker_stands_for_its_pass() {
        for pass in PASSES {
            assert_eq!(pass_of(marker_of(pass.name).cast_mut()), pass.name);
        }
        assert_eq!(pass_of(marker_of("copy").cast_mut()), "another pass");
        assert_eq!(pass_of(std::ptr::without_provenance_mut(usize::MAX)), "another pass");
    }
}
