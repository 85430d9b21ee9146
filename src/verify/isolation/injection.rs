//! Deliberate crashes: a check that ends its process as a faulty driver does, or that fails sometimes. They show that the rest of a run
//! continues, and that a CI system which reads the reports reports the crash.

use crate::files::signals;
use crate::report::Fault;
use crate::tree::{All, Name};
use crate::{Check, Findings};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How a check crashes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, All, Name)]
#[tree(rename_all = "lowercase")]
enum Kind {
    /// An access to memory that is not there.
    Segv,
    /// A failed assertion of the driver.
    Abort,
    /// A wait that never ends.
    Hang,
    /// The driver ends the process.
    Exit,
    /// It fails once, and passes from then on.
    Flake,
    /// It fails unless the host waits for each submission.
    Unsynchronized,
}

/// A crash to inject into a worker process, as text: `segv:GROUP / NAME` for the check that crashes, or instead of `segv` `abort`, `hang`, `exit`
/// (the process ends), `flake` (the check fails once) or `unsynchronized` (it fails unless the host waits for each submission). With `start` instead
/// of a check the process crashes before it opens the device.
#[derive(Clone, Debug)]
pub struct InjectedCrash {
    kind: Kind,
    /// Group and name.
    check: String,
    text: String,
}

impl FromStr for InjectedCrash {
    type Err = String;

    fn from_str(text: &str) -> Result<InjectedCrash, String> {
        let (kind, check) = text.split_once(':').ok_or("must be KIND:GROUP / NAME")?;
        let known = Kind::ALL.into_iter().find(|known| known.name() == kind);
        let kind = known.ok_or_else(|| format!("'{kind}' is not one of {}", Kind::ALL.map(Kind::name).join(", ")))?;
        Ok(InjectedCrash { kind, check: check.trim().into(), text: text.into() })
    }
}

impl InjectedCrash {
    /// The text that this was parsed from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Crashes the process if the crash is to come before the device is opened.
    pub fn at_start(&self) {
        if self.check == START {
            crash(self.kind);
        }
    }

    /// Replaces the work of the named check with the crash, or with the failure that `flake` and `unsynchronized` stand for. Returns false if no
    /// check has that name. A crash at `start` changes no check, and true is returned ([`InjectedCrash::at_start`]).
    pub fn inject(&self, checks: &mut [Check]) -> bool {
        if self.check == START {
            return true;
        }
        let is_named = |check: &&mut Check| format!("{} / {}", check.group, check.name) == self.check;
        let Some(check) = checks.iter_mut().find(is_named) else { return false };
        let (kind, has_failed) = (self.kind, AtomicBool::new(false));
        *check = Check::new(check.group, check.name.clone(), move |dut| {
            crash(kind);
            let fails = match kind {
                Kind::Flake => !has_failed.swap(true, Ordering::Relaxed),
                Kind::Unsynchronized => !dut.waits,
                Kind::Segv | Kind::Abort | Kind::Hang | Kind::Exit => false,
            };
            let faults = if fails { vec![Fault::new("injected".to_string())] } else { Vec::new() };
            Ok(Findings { faults, ..Findings::default() })
        });
        true
    }
}

/// In place of a check.
const START: &str = "start";

/// Returns for kinds that do not end the process.
fn crash(kind: Kind) {
    match kind {
        Kind::Segv => signals::raise_segmentation_fault(),
        Kind::Abort => std::process::abort(),
        Kind::Exit => std::process::exit(7),
        Kind::Hang => loop {
            std::thread::sleep(Duration::from_secs(1));
        },
        Kind::Flake | Kind::Unsynchronized => {}
    }
}
