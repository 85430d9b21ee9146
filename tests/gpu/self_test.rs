//! The self-test of `echolume verify` can fail. The tests of `cli` check that its injected faults are caught.

use crate::common::gpu::chosen;
use echolume::low_level::gpu::ContextOptions;
use echolume::low_level::passes::fault_injection::{Change, InjectedFault};
use echolume::low_level::passes::{Arrays, PASSES, Pass};
use echolume::low_level::picture::Picture;
use echolume::low_level::scene::Scene;
use echolume::low_level::spirv::mutants::MUTATIONS;
use echolume::low_level::verify::built_in::wall;
use echolume::low_level::verify::each_pass::{KINDS, run_with_reference, variant};
use echolume::low_level::verify::render::picture;
use echolume::low_level::verify::report::{Level, Verdict};
use echolume::low_level::verify::self_test::{self, Detection};
use echolume::low_level::verify::{Check, DeviceUnderTest, checks};
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

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

/// Scenes whose pictures are compared for a mutant, but for those that the check of its pass alone misses: all. Fewer pictures leave mutants out that are caught.
const PICTURES: usize = 2;
/// Checks of whole pictures that must find what the checks of single passes do not.
const PICTURE_CHECKS: [&str; 3] = ["modes", "known answers", "sampling"];

/// Every class of instructions, in three places of the shader of each pass: of the mutants that change any bit of an output, how many the
/// checks of single passes catch with the inputs of `verify --full`, and of those that also change a bit of a built-in picture, how many they or the
/// checks of whole pictures catch. What is missed is printed. `MUTANTS_OF` names a pass to look at alone.
#[test]
#[ignore = "takes an hour; docs/verify.md has its figures"]
fn mutants_that_change_a_bit_are_caught() {
    let mut sound = DeviceUnderTest::new(&options(), Level::Quick).expect("a device");
    let mut pictures = BuiltInPictures { scenes: sound.scenes(), sound: HashMap::new() };
    let (mut alone, mut seen) = (Tally::default(), Tally::default());
    let only = std::env::var("MUTANTS_OF").ok();
    let checks: Vec<Check> = checks(Level::Quick).into_iter().filter(|c| PICTURE_CHECKS.contains(&c.group)).collect();
    for (mutation, share) in MUTATIONS.iter().flat_map(|mutation| PLACES.map(|share| (mutation, share))) {
        let mut faulty = sound.with_fault(Change::Mutant { pass: "", mutation, share }).expect("a device");
        for pass in PASSES.iter().filter(|pass| only.as_deref().is_none_or(|name| name == pass.name)) {
            let name = format!("{}: {}, at {share}", pass.name, mutation.class);
            let change = Change::Mutant { pass: pass.name, mutation, share };
            let (differs, is_caught) = in_dispatches(&mut sound, &mut faulty, pass, change);
            alone.count(differs, is_caught, &name);
            if !differs {
                continue;
            }
            let mut faulty = sound.with_fault(change).expect("a device");
            let most = if differs && !is_caught { usize::MAX } else { PICTURES };
            if pictures.differs(&sound, &faulty, pass, change, most) {
                let is_caught = is_caught || checks.iter().any(|c| c.run(&mut faulty).verdict == Verdict::Failed);
                seen.count(true, is_caught, &name);
            }
        }
        println!("{} at {share}: {}; in pictures {}", mutation.class, alone.told(), seen.told());
    }
    for (what, tally) in [("outputs", &alone), ("pictures", &seen)] {
        println!("{what}: {} are caught; missed:\n{}", tally.told(), tally.missed.join("\n"));
        assert!(only.is_some() || tally.caught as f64 >= 0.95 * tally.changed as f64, "{what}: {}", tally.told());
    }
}

/// Mutants that change something, and those of them that a check catches.
#[derive(Default)]
struct Tally {
    changed: usize,
    caught: usize,
    missed: Vec<String>,
}

impl Tally {
    fn count(&mut self, differs: bool, is_caught: bool, name: &str) {
        self.changed += usize::from(differs);
        self.caught += usize::from(is_caught);
        if differs && !is_caught {
            println!("missed: {name}");
            self.missed.push(name.into());
        }
    }

    fn told(&self) -> String {
        format!("{} of {}", self.caught, self.changed)
    }
}

/// Whether a mutant changes a bit in dispatches of a pass alone, and whether its check catches that.
fn in_dispatches(
    sound: &mut DeviceUnderTest,
    faulty: &mut DeviceUnderTest,
    pass: &'static Pass,
    change: Change,
) -> (bool, bool) {
    let bits = |arrays: &Arrays| -> Vec<u64> {
        arrays.iter().flat_map(|(_, texels)| texels.values.iter().map(|v| v.to_bits())).collect()
    };
    let (scenes, mut differs) = (sound.scenes(), false);
    let concerned = scenes.iter().filter(|(_, scene)| change.concerns(pass, scene));
    let dispatches = concerned.flat_map(|(_, scene)| (0..(pass.repeat)(scene)).map(move |n| (scene, n)));
    for (scene, iteration) in dispatches.take(DISPATCHES) {
        for (seed, kind) in (0..).zip(KINDS) {
            let run =
                |dut: &mut DeviceUnderTest| run_with_reference(dut.pass_runner(), scene, pass, iteration, kind, seed);
            let right = run(sound).expect("a dispatch");
            let Ok(wrong) = run(faulty) else { continue };
            if wrong.comparison.worst.is_some() || wrong.comparison.bias > 0.1 {
                return (true, true);
            }
            differs |= bits(&right.got) != bits(&wrong.got);
        }
    }
    (differs, false)
}

/// The pictures of the built-in scenes.
struct BuiltInPictures {
    scenes: Rc<Vec<(String, Scene)>>,
    /// By the scene's place.
    sound: HashMap<usize, Picture>,
}

impl BuiltInPictures {
    /// Whether any of `most` pictures differs. A device that refuses the mutant draws none.
    fn differs(
        &mut self,
        sound: &DeviceUnderTest,
        faulty: &DeviceUnderTest,
        pass: &Pass,
        change: Change,
        most: usize,
    ) -> bool {
        let BuiltInPictures { scenes, sound: known } = self;
        let concerned = (0..scenes.len()).filter(|s| change.concerns(pass, &scenes[*s].1));
        let mut variants = HashSet::new();
        let first = concerned.filter(|s| variants.insert(variant(&scenes[*s].1, pass)));
        first.take(most).any(|s| {
            let scene = &scenes[s].1;
            let frames = wall(scene, 0);
            let right = known.entry(s).or_insert_with(|| picture(&sound.context, scene, &frames).expect("a picture"));
            picture(&faulty.context, scene, &frames).is_ok_and(|wrong| wrong.rgba != right.rgba)
        })
    }
}
