//! What is amiss, said at most once a second each, with how often it was.

use crate::source::error::escaped;
use std::time::{Duration, Instant};

const APART: Duration = Duration::from_secs(1);
/// Longest reason, in characters.
const LONGEST: usize = 400;

/// What may be amiss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Unreachable,
    Lost,
    Again,
    Checksum,
    Malformed,
    Dropped,
    /// An image that is no volume and no frame.
    Image,
    Samples,
    /// A frame without a pose.
    Unpaired,
    Pose,
    Outside,
    Volume,
}

const KINDS: [(Kind, &str); 12] = [
    (Kind::Unreachable, "not connected"),
    (Kind::Lost, "connection lost"),
    (Kind::Again, "connected again"),
    (Kind::Checksum, "messages with a wrong checksum passed over"),
    (Kind::Malformed, "malformed messages passed over"),
    (Kind::Dropped, "messages dropped"),
    (Kind::Image, "images passed over"),
    (Kind::Samples, "samples that are not finite or are denormal"),
    (Kind::Unpaired, "frames without a pose left out"),
    (Kind::Pose, "frames refused"),
    (Kind::Outside, "frames outside of the volume"),
    (Kind::Volume, "no volume for the sweep"),
];

#[derive(Clone, Default)]
struct Fault {
    count: u64,
    /// The last one's.
    why: String,
    said: Option<Instant>,
}

pub(super) struct Faults {
    address: String,
    faults: [Fault; KINDS.len()],
}

impl Faults {
    pub fn new(address: &str) -> Faults {
        Faults { address: escaped(address, LONGEST), faults: Default::default() }
    }

    pub fn note(&mut self, kind: Kind, count: u64, why: &str) {
        let place = KINDS.iter().position(|(k, _)| *k == kind).and_then(|n| self.faults.get_mut(n));
        if let Some(fault) = place.filter(|_| count > 0) {
            fault.count = fault.count.saturating_add(count);
            fault.why = escaped(why, LONGEST);
        }
    }

    /// One that has not been said for a second.
    pub fn due(&mut self) -> Option<String> {
        let waited = |fault: &Fault| fault.said.is_none_or(|said| said.elapsed() >= APART);
        let mut faults = self.faults.iter_mut().zip(KINDS);
        let (fault, (_, what)) = faults.find(|(fault, _)| fault.count > 0 && waited(fault))?;
        let count = std::mem::take(&mut fault.count);
        fault.said = Some(Instant::now());
        let times = if count == 1 { String::new() } else { format!(" ({count})") };
        let why = if fault.why.is_empty() { String::new() } else { format!(": {}", fault.why) };
        Some(format!("OpenIGTLink from {}: {what}{times}{why}", self.address))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_faults_is_one_line_a_second_and_none_is_forgotten() {
        let mut faults = Faults::new("host\n:1");
        assert_eq!(faults.due(), None);
        faults.note(Kind::Lost, 1, "gone");
        faults.note(Kind::Dropped, 3, "");
        faults.note(Kind::Image, 0, "never");
        assert_eq!(faults.due().as_deref(), Some("OpenIGTLink from host\\n:1: connection lost: gone"));
        assert_eq!(faults.due().as_deref(), Some("OpenIGTLink from host\\n:1: messages dropped (3)"));
        for n in 0..1000 {
            faults.note(Kind::Dropped, 2, &format!("the {n}th\u{1b}[2J"));
            assert_eq!(faults.due(), None);
        }
        for fault in &mut faults.faults {
            fault.said = fault.said.and_then(|said| said.checked_sub(APART));
        }
        let said = faults.due().unwrap();
        assert!(said.contains("messages dropped (2000): the 999th") && !said.contains('\u{1b}'), "{said}");
    }

    #[test]
    fn every_kind_has_its_words() {
        for kind in [Kind::Unreachable, Kind::Again, Kind::Checksum, Kind::Samples, Kind::Unpaired, Kind::Volume] {
            let mut faults = Faults::new("host");
            faults.note(kind, 1, "");
            assert!(faults.due().is_some(), "{kind:?}");
        }
    }
}
