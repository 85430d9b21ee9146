//! Summary of the comparisons between devices that are among the results.

use super::agreement::{Class, Drawer};
use super::results::{Record, Status};
use std::collections::BTreeMap;

/// Summary of the comparisons between two devices, or of one device with itself: how many units were compared, how many of them have the same bytes
/// in all outputs, and which do not agree. Outputs do not agree if they differ by more than the tolerance of `verify` or, with one device and driver,
/// in any byte.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pair {
    pub compared: usize,
    pub same_bytes: usize,
    /// For each unit whose outputs do not agree: its input, its work, and what differs.
    pub faults: Vec<(String, String, String)>,
}

/// All comparisons in the results, by class and the devices of both outputs, that of the stored or earlier output first (None: no device was used).
/// Each attempt that drew a finished unit again is one comparison. So is each success with the key of an earlier success: the digests of their
/// outputs are compared. If they differ between two different drivers, there is no comparison, because digests do not say how far the outputs differ.
pub fn pairs(records: &[Record]) -> BTreeMap<(Class, Option<Drawer>, Option<Drawer>), Pair> {
    let mut pairs: BTreeMap<(Class, Option<Drawer>, Option<Drawer>), Pair> = BTreeMap::new();
    let mut first: BTreeMap<&str, &Record> = BTreeMap::new();
    for record in records.iter().filter(|r| !r.key.is_empty()) {
        if let Some(agreement) = &record.agreement {
            let pair = pairs.entry((agreement.class, agreement.with.clone(), record.drawer.clone())).or_default();
            pair.add(record, agreement.same_bytes, agreement.fault.clone());
            continue;
        }
        if record.status != Status::Done {
            continue;
        }
        let Some(there) = first.get(record.key.as_str()) else {
            first.insert(&record.key, record);
            continue;
        };
        let class = Class::of(there.drawer.as_ref(), record.drawer.as_ref());
        let same = there.outputs == record.outputs;
        // Of another driver only the digest is left, which says nothing about the size of a difference.
        if same || class == Class::SameDriver {
            let fault = (!same).then(|| "two processes with the same device and driver made other bytes".to_string());
            pairs.entry((class, there.drawer.clone(), record.drawer.clone())).or_default().add(record, same, fault);
        }
    }
    pairs
}

impl Pair {
    fn add(&mut self, record: &Record, same_bytes: bool, fault: Option<String>) {
        self.compared += 1;
        self.same_bytes += usize::from(same_bytes);
        self.faults.extend(fault.map(|fault| (record.input.clone(), record.work.clone(), fault)));
    }
}
