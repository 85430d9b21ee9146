//! `echolume devices` and `echolume support-bundle`: a description of this machine.

use crate::args::{SourceArgs, device_failure};
use crate::gpu::{DeviceChoice, context, device_selection};
use crate::kiosk::bundle::Bundle;
use crate::kiosk::config::{Config, DEFAULT_PATH};
use crate::picture;
use crate::terminal::{Failure, failed, input, remark, say};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

#[derive(clap::Args)]
pub struct Devices {
    /// Print also the capabilities of each device: queues and every Vulkan limit
    #[arg(long)]
    limits: bool,
}

impl Devices {
    pub fn run(&self) -> Result<(), Failure> {
        let variable = |name: &str| std::env::var(name).ok();
        let has_nvidia = Path::new("/proc/driver/nvidia/version").exists() || Path::new("/dev/nvidiactl").exists();
        let hint = missing_capability(has_nvidia, variable);
        let devices =
            context::list().inspect_err(|_| hint.iter().for_each(|line| remark(line))).map_err(device_failure)?;
        if let Some(line) = hint.filter(|_| devices.iter().all(|device| device.is_software())) {
            remark(&line);
        }
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
            if let Some(budget) = &device.budget {
                say!("    memory budget: {}", budget.line());
            }
            for without in &device.missing_optional {
                say!("    works without {without}");
            }
            match &picked {
                Ok(n) if *n == i && device.is_software() => {
                    say!(
                        "    picked: no other device fits. It is a software device, which draws the same pictures slowly"
                    );
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
                say!(
                    "    largest allocation: {} MiB, buffer: {} MiB",
                    device.max_allocation >> 20,
                    device.max_buffer >> 20
                );
                format!("{:#?}", device.limits).lines().for_each(|line| say!("    {line}"));
            }
        }
        picked.map(drop).map_err(device_failure)
    }
}

/// What a container lacks whose GPU has no Vulkan driver: NVIDIA's toolkit mounts it only for the capability `graphics`.
fn missing_capability(has_nvidia: bool, variable: impl Fn(&str) -> Option<String>) -> Option<String> {
    let visible = variable("NVIDIA_VISIBLE_DEVICES").filter(|gpus| !["", "void", "none"].contains(&gpus.as_str()));
    let given = variable("NVIDIA_DRIVER_CAPABILITIES").unwrap_or_default();
    let is_given = given.split(',').any(|capability| ["graphics", "all"].contains(&capability.trim()));
    (has_nvidia && visible.is_some() && !is_given).then(|| {
        format!(
            "this container has an NVIDIA GPU without its Vulkan driver: NVIDIA_DRIVER_CAPABILITIES is '{given}'; start it with compute,utility,graphics"
        )
    })
}

/// Time-out for listing the devices. A driver that takes longer is itself a finding.
const PATIENCE: Duration = Duration::from_secs(20);
/// Longest text about devices, bytes.
const MAX_BYTES: u64 = 1 << 20;

#[derive(clap::Args)]
#[command(
    after_help = "Text only: versions, devices, configuration, and the end of the logs (20 MiB at most). No recordings, no pictures, and no \
                        names of either: stand-ins such as <file-1>.mha are put for them. Its README.txt lists what is in it and what is not.\n\n\
                        Example:\n  echolume support-bundle --config /etc/echolume/echolume.toml -o /media/stick/cart.tar.gz"
)]
pub struct SupportBundle {
    /// Archive to write (.tar.gz); an existing file is not replaced [default: echolume-support-TIME.tar.gz in this folder]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Configuration of the kiosk, which names the log file [default: /etc/echolume/echolume.toml]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

impl SupportBundle {
    pub fn run(&self) -> Result<(), Failure> {
        let output = match &self.output {
            Some(output) => output.clone(),
            None => {
                let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
                PathBuf::from(format!("echolume-support-{}.tar.gz", now.replace(['-', ':'], "")))
            }
        };
        let shown = output.display();
        let name = output.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        if ![".tar.gz", ".tgz"].iter().any(|ending| name.ends_with(ending)) {
            return Err(input(format!("--output {shown}: must end in .tar.gz")));
        }
        let check_free = || match std::fs::symlink_metadata(&output) {
            Ok(_) => Err(input(format!("--output {shown}: exists already and is not replaced; give another name"))),
            Err(_) => Ok(()),
        };
        check_free()?;
        picture::check_target(&output).map_err(failed)?;
        // A missing file is an error. Faults inside the file are noted in the bundle.
        if let Some(config) = self.config.as_ref().filter(|config| !config.is_file()) {
            return Err(input(format!("--config {}: is not a file", config.display())));
        }
        let mut bundle = Bundle::new(self.config.as_deref());
        let config = self.config.as_deref().unwrap_or(Path::new(DEFAULT_PATH));
        if let Some(Err(Failure::Input(fault))) =
            Config::read(config).ok().map(|config| SourceArgs::from_config(&config))
        {
            bundle.note(&format!("configuration: {fault}"));
        }
        bundle.add("devices.txt", "what `echolume devices --limits` says here", &devices());
        let bytes = bundle.pack().map_err(|e| failed(format!("{shown}: {e}")))?;
        check_free()?;
        picture::replace(&output, &bytes).map_err(failed)?;
        say!("{shown}: {} KiB; review it before you pass it on", bytes.len().div_ceil(1024));
        Ok(())
    }
}

/// Lists the devices in a child process: a driver that crashes or hangs must not end this one.
fn devices() -> String {
    let asked = std::env::current_exe().and_then(|program| {
        let mut command = Command::new(program);
        command.args(["devices", "--limits"]).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn()
    });
    match asked {
        Ok(child) => answer(child),
        Err(error) => format!("`echolume devices` cannot be started: {error}\n"),
    }
}

fn answer(mut child: Child) -> String {
    // Read in threads: a full pipe would block the child.
    fn read(stream: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            let _ = stream.map(|stream| stream.take(MAX_BYTES).read_to_end(&mut bytes));
            String::from_utf8_lossy(&bytes).into_owned()
        })
    }
    let (out, err) = (read(child.stdout.take()), read(child.stderr.take()));
    let began = Instant::now();
    let end = loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => break String::new(),
            Ok(Some(status)) => break format!("it ended with {status}\n"),
            Ok(None) if began.elapsed() < PATIENCE => std::thread::sleep(Duration::from_millis(20)),
            Ok(None) => break format!("it did not end within {} s and was stopped\n", PATIENCE.as_secs()),
            Err(error) => break format!("it cannot be waited for: {error}\n"),
        }
    };
    let _ = child.kill();
    let _ = child.wait();
    let said = |thread: std::thread::JoinHandle<String>| thread.join().unwrap_or_default();
    format!("{}{}{end}", said(out), said(err))
}

#[cfg(test)]
mod capability {
    use super::missing_capability;

    #[test]
    fn a_container_without_graphics_is_told_and_no_other() {
        let of = |has_nvidia, visible: Option<&str>, given: Option<&str>| {
            missing_capability(has_nvidia, |name| {
                let value = if name == "NVIDIA_VISIBLE_DEVICES" { visible } else { given };
                value.map(str::to_string)
            })
        };
        assert!(of(true, Some("all"), Some("compute,utility")).is_some_and(|line| line.contains("graphics")));
        assert!(of(true, Some("all"), None).is_some());
        for (has_nvidia, visible, given) in [
            (true, Some("all"), Some("compute, graphics")),
            (true, Some("0"), Some("all")),
            (true, Some("void"), None),
            (true, None, None),
            (false, Some("all"), None),
        ] {
            assert_eq!(of(has_nvidia, visible, given), None);
        }
    }
}
