//! The self-test of `echolume verify` can fail. The tests of `cli` check that its injected faults are caught.

use crate::common::gpu::chosen;
use echolume::low_level::gpu::ContextOptions;
use echolume::low_level::passes::fault_injection::{Change, InjectedFault};
use echolume::low_level::verify::report::Verdict;
use echolume::low_level::verify::self_test::{self, Detection};

fn options() -> ContextOptions {
    ContextOptions { device: chosen(), specialize: Some(true), ..ContextOptions::default() }
}

/// For output with `--nocapture`: which check caught which fault.
fn told(detection: &Detection) {
    println!(
        "{:5.2} s  {:36} {}: {}",
        detection.seconds,
        detection.fault,
        detection.by.as_deref().unwrap_or("-"),
        detection.message
    );
}

/// Prevents a self-test that reports everything as caught.
#[test]
fn an_injected_fault_without_effect_is_reported_as_uncaught() {
    let faults = [
        InjectedFault {
            name: "nowhere",
            what: "a pass that is not there",
            change: Change::Extent { pass: "no such pass", by: |extent| extent[0] = 0 },
        },
        InjectedFault {
            name: "unseen",
            what: "a colour that nothing is drawn in",
            change: Change::Constant { pass: "light", name: "SKIN", by: |skin| skin },
        },
    ];
    let all = self_test::run_faults(&options(), faults.iter(), told).expect("a device");
    assert_eq!(all.len(), 3);
    for detection in &all[..2] {
        assert_eq!(detection.by, None, "{detection:?}");
        assert!(detection.message.contains("nothing that a check runs is changed"), "{detection:?}");
        let outcome = detection.outcome();
        assert_eq!((outcome.verdict, outcome.faults.len()), (Verdict::Failed, 1));
    }
    assert!(all[2].by.is_some(), "no check failed without a fault: {:?}", all[2]);
}
