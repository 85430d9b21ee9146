//! Crashes on purpose: a check that ends its process as a faulty driver does, to show that the rest of a run goes on, and that a CI which
//! reads the reports sees it.

use crate::files::signals;
use crate::{Check, Findings};
use std::str::FromStr;
use std::time::Duration;

/// How a check crashes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// An access to memory that is not there.
    SegmentationFault,
    /// A failed assertion of the driver.
    Abort,
    /// A wait that never ends.
    Hang,
    /// The driver ends the process.
    Exit,
}

/// A check that is to crash: `segv:GROUP / NAME`, or `abort`, `hang` and `exit` instead of `segv`.
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
        let kind = match kind {
            "segv" => Kind::SegmentationFault,
            "abort" => Kind::Abort,
            "hang" => Kind::Hang,
            "exit" => Kind::Exit,
            _ => return Err(format!("'{kind}' is none of segv, abort, hang, exit")),
        };
        Ok(InjectedCrash { kind, check: check.trim().into(), text: text.into() })
    }
}

impl InjectedCrash {
    /// The text that it was parsed from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Replaces the work of the check with the crash. Returns whether there is such a check.
    pub fn inject(&self, checks: &mut [Check]) -> bool {
        let is_named = |check: &&mut Check| format!("{} / {}", check.group, check.name) == self.check;
        let Some(check) = checks.iter_mut().find(is_named) else { return false };
        let kind = self.kind;
        *check = Check::new(check.group, check.name.clone(), move |_| {
            crash(kind);
            Ok(Findings::default())
        });
        true
    }
}

fn crash(kind: Kind) {
    match kind {
        Kind::SegmentationFault => signals::raise_segmentation_fault(),
        Kind::Abort => std::process::abort(),
        Kind::Exit => std::process::exit(7),
        Kind::Hang => loop {
            std::thread::sleep(Duration::from_secs(1));
        },
    }
}
