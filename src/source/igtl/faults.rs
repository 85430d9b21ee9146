//! What goes wrong with a live source, one line a second for each kind, with its count.

use crate::files::escaped;
use crate::tree::{All, Name};
use std::time::{Duration, Instant};

/// Shortest time between two reports of one kind.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);
/// Longest reason, characters.
const MAX_REASON: usize = 400;

/// The kinds of faults of an OpenIGTLink source, which are counted and reported separately, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, All, Name)]
pub(super) enum FaultKind {
    #[tree(rename = "not connected")]
    Unreachable,
    #[tree(rename = "connection lost")]
    Lost,
    #[tree(rename = "connected again")]
    Again,
    #[tree(rename = "messages with a wrong checksum passed over")]
    Checksum,
    #[tree(rename = "malformed messages passed over")]
    Malformed,
    #[tree(rename = "messages dropped")]
    Dropped,
    /// An image is neither a volume nor a frame.
    #[tree(rename = "images passed over")]
    Image,
    /// Images come from several devices, which show different things.
    #[tree(rename = "images of several devices")]
    Devices,
    #[tree(rename = "samples that are not finite or are denormal")]
    Samples,
    /// A frame has no pose.
    #[tree(rename = "frames without a pose left out")]
    Unpaired,
    /// 2D images have no pose, or all the same one.
    #[tree(rename = "images of one slice have no place")]
    Untracked,
    #[tree(rename = "frames refused")]
    Pose,
    #[tree(rename = "frames outside of the volume")]
    Outside,
    #[tree(rename = "no volume for the sweep")]
    Volume,
    /// A volume that is sent in parts was incomplete when one of its slices arrived again.
    #[tree(rename = "incomplete volumes left out")]
    Incomplete,
}

#[derive(Clone, Default)]
struct Fault {
    count: u64,
    /// Reason of the last one.
    why: String,
    reported: Option<Instant>,
}

/// The faults of the source. Each kind is reported at most once a second, with its count.
pub(super) struct Faults {
    address: String,
    faults: [Fault; FaultKind::ALL.len()],
}

impl Faults {
    pub(super) fn new(address: &str) -> Faults {
        Faults { address: escaped(address, MAX_REASON), faults: Default::default() }
    }

    pub(super) fn note(&mut self, kind: FaultKind, count: u64, why: &str) {
        let fault = &mut self.faults[kind as usize];
        if count > 0 {
            fault.count = fault.count.saturating_add(count);
            fault.why = escaped(why, MAX_REASON);
        }
    }

    /// Takes a fault that is due for a report: one line with its count since the last report. None if each kind has no new fault or was reported
    /// within the last second.
    pub(super) fn due(&mut self) -> Option<String> {
        let waited = |fault: &Fault| fault.reported.is_none_or(|reported| reported.elapsed() >= REPORT_INTERVAL);
        let mut faults = self.faults.iter_mut().zip(FaultKind::ALL);
        let (fault, kind) = faults.find(|(fault, _)| fault.count > 0 && waited(fault))?;
        let count = std::mem::take(&mut fault.count);
        fault.reported = Some(Instant::now());
        let times = if count == 1 { String::new() } else { format!(" ({count})") };
        let why = if fault.why.is_empty() { String::new() } else { format!(": {}", fault.why) };
        Some(format!("OpenIGTLink from {}: {}{times}{why}", self.address, kind.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_faults_is_one_line_a_second_and_none_is_forgotten() {
        let mut faults = Faults::new("host\n:1");
        assert_eq!(faults.due(), None);
        faults.note(FaultKind::Lost, 1, "gone");
        faults.note(FaultKind::Dropped, 3, "");
        faults.note(FaultKind::Image, 0, "never");
        assert_eq!(faults.due().as_deref(), Some("OpenIGTLink from host\\n:1: connection lost: gone"));
        assert_eq!(faults.due().as_deref(), Some("OpenIGTLink from host\\n:1: messages dropped (3)"));
        for n in 0..1000 {
            faults.note(FaultKind::Dropped, 2, &format!("the {n}th\u{1b}[2J"));
            assert_eq!(faults.due(), None);
        }
        for fault in &mut faults.faults {
            fault.reported = fault.reported.and_then(|reported| reported.checked_sub(REPORT_INTERVAL));
        }
        let reported = faults.due().unwrap();
        assert!(reported.contains("messages dropped (2000): the 999th") && !reported.contains('\u{1b}'), "{reported}");
    }

    #[test]
    fn every_kind_has_its_words() {
        for kind in [
            FaultKind::Unreachable,
            FaultKind::Again,
            FaultKind::Checksum,
            FaultKind::Samples,
            FaultKind::Unpaired,
            FaultKind::Untracked,
            FaultKind::Volume,
        ] {
            let mut faults = Faults::new("host");
            faults.note(kind, 1, "");
            assert!(faults.due().is_some(), "{kind:?}");
        }
    }
}
