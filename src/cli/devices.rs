//! `echolume devices`.

use crate::gpu::{DeviceChoice, context, device_selection};
use crate::terminal::{Failure, failed, say};

#[derive(clap::Args)]
pub struct Devices {
    /// Print also the capabilities of each device: queues and every Vulkan limit
    #[arg(long)]
    limits: bool,
}

impl Devices {
    pub fn run(&self) -> Result<(), Failure> {
        let devices = context::list().map_err(failed)?;
        let picked = device_selection::choose(&devices, &DeviceChoice::Best);
        for (i, device) in devices.iter().enumerate() {
            say!(
                "{i} {} ({}, Vulkan {}, {})",
                device.name,
                device.kind_name(),
                device.api_version(),
                device.driver.trim()
            );
            if !device.missing.is_empty() {
                say!("    cannot be used: lacks {}", device.missing.join(", "));
            }
            for without in &device.missing_optional {
                say!("    works without {without}");
            }
            match &picked {
                Ok(n) if *n == i && device.is_software() => {
                    say!("    picked: no other device fits. It is a software device: the same pictures, slowly");
                }
                Ok(n) if *n == i => say!("    picked: the best device that lacks nothing"),
                _ if !device.missing.is_empty() => {}
                _ if device.is_software() => {
                    say!("    not picked: a software device is the last choice; --device {i} selects it")
                }
                _ => say!("    not picked: another device is preferred; --device {i} selects it"),
            }
            if self.limits {
                for queue in &device.queues {
                    say!("    {queue:?}");
                }
                say!("    largest allocation and buffer: {} MiB", device.max_bytes >> 20);
                format!("{:#?}", device.limits).lines().for_each(|line| say!("    {line}"));
            }
        }
        picked.map(drop).map_err(failed)
    }
}
