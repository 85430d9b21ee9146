//! The self-test of `echolume verify` can fail. The tests of `cli` check that its injected faults are caught.

use crate::common::gpu::chosen;
use echolume::low_level::gpu::ContextOptions;
use echolume::low_level::passes::fault_injection::{Change, InjectedFault};
use echolume::low_level::passes::{Arrays, PASSES};
use echolume::low_level::spirv::mutants::MUTATIONS;
use echolume::low_level::verify::DeviceUnderTest;
use echolume::low_level::verify::each_pass::{KINDS, run_with_reference};
use echolume::low_level::verify::report::{Level, Verdict};
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

/// Prevents a self-test that reports everything as caught: what nothing meets is not tested, and what changes no result is not caught.
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
        InjectedFault {
            name: "harmless",
            what: "workgroups beyond the picture, which write nothing",
            change: Change::Extent { pass: "tone", by: |extent| extent[0] += 64 },
        },
    ];
    let all = self_test::run_faults(&options(), faults.into_iter(), told).expect("a device");
    assert_eq!(all.len(), 4);
    for detection in &all[..2] {
        assert!(detection.by.is_none() && detection.left_out, "{detection:?}");
        assert!(detection.message.contains("not tested"), "{detection:?}");
        assert_eq!(detection.outcome().verdict, Verdict::LeftOut);
    }
    assert!(all[2].by.is_none() && all[2].message.contains("every check passes"), "{:?}", all[2]);
    let outcome = all[2].outcome();
    assert_eq!((outcome.verdict, outcome.faults.len()), (Verdict::Failed, 1));
    assert!(all[3].by.is_some(), "no check failed without a fault: {:?}", all[3]);
}

/// Places among the instructions of a class, as shares.
const PLACES: [f32; 3] = [0.2, 0.5, 0.8];

/// Dispatches in which each mutant is run, with each kind of input.
const DISPATCHES: usize = 40;

/// Every class of instructions, in three places of the shader of each pass: of the mutants that change any bit of an output, how many the
/// checks of single passes catch with the inputs of `verify --full`. Those that they miss are printed.
#[test]
#[ignore = "takes 20 minutes; docs/verify.md has its figures"]
fn mutants_that_change_a_bit_are_caught() {
    let mut sound = DeviceUnderTest::new(&options(), Level::Quick).expect("a device");
    let (scenes, mut changed, mut caught, mut missed) = (sound.scenes(), 0, 0, Vec::new());
    let bits = |arrays: &Arrays| -> Vec<u64> {
        arrays.iter().flat_map(|(_, texels)| texels.values.iter().map(|v| v.to_bits())).collect()
    };
    for (mutation, place) in MUTATIONS.iter().flat_map(|mutation| PLACES.map(|place| (mutation, place))) {
        let change = Change::Mutant(mutation, place);
        let mut faulty = sound.with_fault(change).expect("a device");
        for pass in PASSES {
            let (mut differs, mut is_caught) = (false, false);
            let concerned = scenes.iter().filter(|(_, scene)| change.concerns(pass, scene));
            let dispatches = concerned.flat_map(|(_, scene)| (0..(pass.repeat)(scene)).map(move |n| (scene, n)));
            'dispatches: for (scene, iteration) in dispatches.take(DISPATCHES) {
                for (seed, kind) in (0..).zip(KINDS) {
                    let run = |dut: &mut DeviceUnderTest| {
                        run_with_reference(dut.pass_runner(), scene, pass, iteration, kind, seed)
                    };
                    let right = run(&mut sound).expect("a dispatch");
                    let Ok(wrong) = run(&mut faulty) else { continue };
                    differs |= bits(&right.got) != bits(&wrong.got);
                    is_caught |= wrong.comparison.worst.is_some() || wrong.comparison.bias > 0.1;
                    if is_caught {
                        break 'dispatches;
                    }
                }
            }
            changed += usize::from(differs || is_caught);
            caught += usize::from(is_caught);
            if differs && !is_caught {
                missed.push(format!("{}: {}, at {place}", pass.name, mutation.class));
                println!("missed: {}", missed[missed.len() - 1]);
            }
        }
        println!("{} at {place}: {caught} of {changed} so far", mutation.class);
    }
    println!("{caught} of {changed} are caught; missed:\n{}", missed.join("\n"));
    assert!(caught as f64 >= 0.9 * changed as f64, "{caught} of {changed}");
}
