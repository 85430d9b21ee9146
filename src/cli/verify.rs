//! `echolume verify`.

use super::{Failure, failed, input, say};
use echolume::gpu::{Choice, ContextOptions, GpuError};
use echolume::report::verify::{Level, Verdict};
use echolume::verify::{self, Bench};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Verify {
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    device: Option<Choice>,
    #[arg(long)]
    quick: bool,
    #[arg(long, conflicts_with = "quick")]
    full: bool,
    /// Only checks whose group or name holds this
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
}

impl Verify {
    pub fn run(&self) -> Result<(), Failure> {
        let level = if self.full { Level::Full } else { Level::Quick };
        let options = ContextOptions { device: self.device.clone().unwrap_or(Choice::Best), validation: true };
        let mut bench = Bench::new(&options, level).map_err(failed)?;
        let mut checks = verify::checks(level);
        checks.retain(|c| {
            self.only.is_empty()
                || self.only.iter().any(|o| c.group.contains(o.as_str()) || c.name.contains(o.as_str()))
        });
        let run = verify::run(&mut bench, &checks, |o| {
            let figures: Vec<_> = o.figures.iter().map(|f| format!("{} {:.3}", f.what, f.value)).collect();
            say!("{:?} {} / {}: {:.1} s {}", o.verdict, o.group, o.name, o.seconds, figures.join(", "));
            for fault in &o.faults {
                say!("   {fault:?}");
            }
            true
        });
        let _ = (input("x"), GpuError::NoDevice, PathBuf::new());
        match run.count(Verdict::Failed) {
            0 => Ok(()),
            n => Err(failed(format!("{n} checks failed"))),
        }
    }
}
