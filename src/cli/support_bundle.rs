//! `echolume support-bundle`.

use super::arriving::Arriving;
use super::{Failure, failed, input, say};
use crate::kiosk::bundle::Bundle;
use crate::kiosk::config::Config;
use crate::picture;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// A driver that takes longer than this to say what devices there are is itself the answer.
const PATIENCE: Duration = Duration::from_secs(20);
/// Of what is said about devices, bytes.
const LONGEST: u64 = 1 << 20;

#[derive(clap::Args)]
#[command(
    after_help = "Text only: versions, devices, configuration, and the end of the logs (20 MiB at most). No recordings, no pictures, and no \
                        names of either: stand-ins such as <file-1>.mha are put for them. Its README.txt lists what is in it and what is not.\n\n\
                        Example:\n  echolume support-bundle --config /etc/echolume/echolume.toml -o /media/stick/cart.tar.gz"
)]
pub struct SupportBundle {
    /// The archive to write (.tar.gz); nothing is written over [default: echolume-support-TIME.tar.gz here]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// The configuration of the cart, which also says where the logs are [default: /etc/echolume/echolume.toml]
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
        let is_there = || std::fs::symlink_metadata(&output).is_ok();
        if is_there() {
            return Err(input(format!(
                "--output {shown}: is there already and is not written over; give another name"
            )));
        }
        picture::check_target(&output).map_err(failed)?;
        // What was asked for by name and is not there is a mistake; what is wrong with it is told inside.
        if let Some(config) = self.config.as_ref().filter(|config| !config.is_file()) {
            return Err(input(format!("--config {}: is no file", config.display())));
        }
        let mut bundle = Bundle::new(self.config.as_deref());
        let config = self.config.as_deref().unwrap_or(Path::new(crate::kiosk::config::USUAL));
        if let Some(Err(Failure::Input(fault))) = Config::read(config).ok().map(|config| Arriving::configured(&config))
        {
            bundle.note(&format!("configuration: {fault}"));
        }
        bundle.add("devices.txt", "what `echolume devices --limits` says here", &devices());
        let bytes = bundle.pack().map_err(|e| failed(format!("{shown}: {e}")))?;
        if is_there() {
            return Err(input(format!(
                "--output {shown}: is there already and is not written over; give another name"
            )));
        }
        picture::replace(&output, &bytes).map_err(failed)?;
        say!("{shown}: {} KiB; have a look before you pass it on", bytes.len().div_ceil(1024));
        Ok(())
    }
}

/// By another process: a driver that crashes or hangs must not take the rest with it.
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
    // Read beside it, so that a full pipe does not stop it.
    fn read(stream: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            let mut stream = stream;
            if let Some(stream) = &mut stream {
                let _ = stream.take(LONGEST).read_to_end(&mut bytes);
            }
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
