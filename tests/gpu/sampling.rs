//! The group "sampling" of verify passes on this device, and notices a sampler that does not filter.

use crate::common::gpu::*;
use echolume::low_level::gpu::ContextOptions;
use echolume::low_level::verify::report::{Level, Verdict};
use echolume::low_level::verify::{DeviceUnderTest, sampling, self_test};

#[test]
fn the_filter_is_within_its_bounds_and_one_that_does_not_filter_is_not() {
    let options = ContextOptions { device: chosen(), validation: true, ..ContextOptions::default() };
    let mut sound = DeviceUnderTest::new(&options, Level::Quick).expect("bench");
    let nearest = self_test::faults().find(|fault| fault.name == "nearest neighbour").expect("the fault");
    let mut faulty = sound.with_fault(nearest.change).expect("bench");
    for check in sampling::checks(Level::Quick) {
        let outcome = check.run(&mut sound);
        assert_eq!(outcome.verdict, Verdict::Passed, "{}: {:?}", check.name, outcome.faults);
        let outcome = check.run(&mut faulty);
        assert_eq!(outcome.verdict, Verdict::Failed, "{}", check.name);
        let fault = &outcome.faults[0];
        assert!(fault.what.contains("samples are not what") && fault.worst.is_some(), "{fault:?}");
        assert!(outcome.pictures.iter().any(|shown| shown.fault == Some(0)), "{}", check.name);
    }
}
