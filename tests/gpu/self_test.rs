//! Whether the self-test of `echolume verify` can fail. That what it plants is caught is `cli`'s to say.

use crate::common::gpu::chosen;
use echolume::gpu::ContextOptions;
use echolume::passes::fault_injection::{Change, InjectedFault};
use echolume::verify::report::Verdict;
use echolume::verify::self_test::{self, Caught};

fn options() -> ContextOptions {
    ContextOptions { device: chosen(), validation: false }
}

/// Looked at with `--nocapture`: which check caught what.
fn told(caught: &Caught) {
    println!("{:5.2} s  {:36} {}: {}", caught.seconds, caught.fault, caught.by.as_deref().unwrap_or("-"), caught.found);
}

/// Prevents that everything is called caught.
#[test]
fn a_fault_without_effect_is_reported_as_uncaught() {
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
