//! Whether the checks of `echolume verify` notice anything: what is planted is caught, and what is not planted is not.

use crate::common::chosen;
use echolume::gpu::ContextOptions;
use echolume::passes::planted::{Change, Planted};
use echolume::report::verify::Verdict;
use echolume::verify::self_test::{self, Caught};
use std::collections::HashSet;

fn options() -> ContextOptions {
    ContextOptions { device: chosen(), validation: false }
}

/// Looked at with `--nocapture`: which check caught what.
fn told(caught: &Caught) {
    println!("{:5.2} s  {:36} {}: {}", caught.seconds, caught.fault, caught.by.as_deref().unwrap_or("-"), caught.found);
}

#[test]
fn every_planted_fault_and_every_dropped_barrier_is_caught() {
    let all = self_test::run(&options(), told).expect("a device");
    let planted = self_test::faults().count();
    assert!(planted >= 24 && all.len() == planted + 3, "{planted} of {}", all.len());
    let names: HashSet<_> = all.iter().map(|caught| &caught.fault).collect();
    assert_eq!(names.len(), all.len(), "a name stands for one fault");
    let uncaught: Vec<_> = all.iter().filter(|caught| caught.by.is_none()).map(|c| (&c.fault, &c.found)).collect();
    assert!(uncaught.is_empty(), "{uncaught:?}");
    assert!(all.iter().all(|caught| caught.outcome().verdict == Verdict::Passed));
    // More than one kind of check is needed.
    let by = |group: &str| all.iter().filter(|c| c.by.as_ref().is_some_and(|by| by.starts_with(group))).count();
    assert!(by("passes") > 10 && by("known answers") > 3, "{all:?}");
}

/// Prevents that everything is called caught.
#[test]
fn a_fault_without_effect_is_reported_as_uncaught() {
    let faults = [
        Planted {
            name: "nowhere",
            what: "a pass that is not there",
            change: Change::Extent { pass: "no such pass", by: |extent| extent[0] = 0 },
        },
        Planted {
            name: "unseen",
            what: "a colour that nothing is drawn in",
            change: Change::Constant { pass: "light", name: "SKIN", by: |skin| skin },
        },
    ];
    let all = self_test::planted(&options(), faults.iter(), told).expect("a device");
    assert_eq!(all.len(), 3);
    for caught in &all[..2] {
        assert_eq!(caught.by, None, "{caught:?}");
        assert!(caught.found.contains("nothing that a check runs is changed"), "{caught:?}");
        let outcome = caught.outcome();
        assert_eq!((outcome.verdict, outcome.faults.len()), (Verdict::Failed, 1));
    }
    assert!(all[2].by.is_some(), "no check failed without a fault: {:?}", all[2]);
}
