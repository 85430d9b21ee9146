//! The anatomy: distances that are safe to skip, and parts that are where they belong.

use super::face::skin;
use super::limbs::{Hand, cord, shoulders};
use super::skull::{Intracranial, bone, intracranial, is_bone};
use glam::{Vec3, vec3};

/// The shapes of a sleeping and of a yawning face.
const MOUTHS: [f32; 2] = [1.7, 6.5];

/// Numbers in 0..1 from a counter (Weyl's sequence): the same points in every run.
fn points(count: usize, low: Vec3, high: Vec3) -> impl Iterator<Item = Vec3> {
    (1..=count).map(move |n| {
        let share = |step: f64| (n as f64 * step).fract() as f32;
        low + (high - low) * vec3(share(0.754_877_666), share(0.569_840_291), share(0.362_437_285))
    })
}

/// What a scan line skips in fluid holds no tissue: 0.6 of the distance, as `head` does it, in many directions.
#[test]
fn a_skipped_distance_holds_no_surface() {
    const SAFE: f32 = 0.6;
    let hand = Hand::new(0.25);
    let yawning = |p| skin(p, MOUTHS[1]);
    let fields: [(&str, &dyn Fn(Vec3) -> f32); 5] = [
        ("skin", &|p| skin(p, MOUTHS[0])),
        ("yawning", &yawning),
        ("hand", &|p| hand.distance(p)),
        ("cord", &cord),
        ("shoulders", &shoulders),
    ];
    for (name, field) in fields {
        let mut seen = 0;
        for p in points(6000, vec3(-80.0, -80.0, -70.0), vec3(80.0, 75.0, 45.0)) {
            let clear = field(p);
            if clear <= 0.0 {
                continue;
            }
            seen += 1;
            // Towards the probe and away from it, and to the sides.
            for direction in [Vec3::Z, Vec3::X, Vec3::Y, vec3(0.6, -0.64, 0.48), vec3(-0.36, 0.48, 0.8)] {
                for share in [-1.0, -0.7, -0.4, 0.4, 0.7, 1.0] {
                    let skipped = p + direction * (SAFE * clear * share);
                    // Skipped samples may touch the skin by less than their own size.
                    assert!(field(skipped) > -0.2, "{name}: {skipped} is inside, {clear} mm from {p}");
                }
            }
        }
        assert!(seen > 1000, "{name}: {seen} points outside");
    }
}

/// Bone is covered by skin, and what is inside the vault is covered by bone.
#[test]
fn bone_lies_under_skin_and_the_brain_under_bone() {
    for mouth in MOUTHS {
        let (mut bones, mut parts) = (0, 0);
        for p in points(40_000, vec3(-45.0, -50.0, -65.0), vec3(45.0, 60.0, 15.0)) {
            if bone(p, mouth) < 0.0 {
                bones += 1;
                assert!(skin(p, mouth) < -0.4, "bone at {p}, skin {}", skin(p, mouth));
            }
            if intracranial(p).is_some() {
                parts += 1;
                assert!(skin(p, mouth) < -3.0, "brain at {p}");
            }
        }
        assert!(bones > 2000 && parts > 2000, "{bones}, {parts}");
    }
}

/// A profile along the midline, by the front of the skin: brow, root of the nose, its tip, the lip, the fold, the chin.
#[test]
fn the_profile_is_that_of_a_face() {
    let front = |x: f32, y: f32| {
        let z = (0..4000).map(|i| 15.0 - 0.01 * i as f32).find(|z| skin(vec3(x, y, *z), 0.0) < 0.0);
        z.unwrap_or(f32::NEG_INFINITY)
    };
    let [brow, root, tip, lip, fold, chin] = [12.0, -1.0, -13.0, -23.8, -33.2, -37.5].map(|y| front(0.0, y));
    assert!(root < brow && root < tip - 6.0, "root of the nose {root}, brow {brow}, tip {tip}");
    assert!(tip > lip + 2.0 && lip > fold + 1.0 && chin > fold + 0.2, "tip {tip}, lip {lip}, fold {fold}, chin {chin}");
    // The philtrum is lower than its ridges, the slit between the lids lower than the lid.
    assert!(front(0.0, -20.5) < front(2.5, -20.5) - 0.15);
    assert!(front(15.8, -5.3) < front(15.8, -3.0) - 1.0);
    // A nostril opens downwards, beside the columella.
    assert!(skin(vec3(2.7, -17.2, 4.2), 0.0) > 0.0 && skin(vec3(0.0, -16.2, 4.2), 0.0) < 0.0);
    // Both ears stand out of the head, and touch it.
    for side in [-1.0, 1.0] {
        assert!(skin(vec3(side * 37.5, -6.0, -46.0), 0.0) < 0.0 || skin(vec3(side * 36.5, -2.0, -47.0), 0.0) < 0.0);
    }
}

#[test]
fn the_brain_has_its_parts_on_both_sides() {
    for side in [-1.0, 1.0] {
        let at = |x: f32, y, z| intracranial(vec3(side * x, y, z));
        assert_eq!(at(13.0, 12.0, -56.0), Some(Intracranial::ChoroidPlexus));
        assert_eq!(at(5.5, 17.0, -30.0), Some(Intracranial::Fluid), "the frontal horn");
        assert_eq!(at(6.4, 6.0, -44.0), Some(Intracranial::Thalamus));
        assert_eq!(at(0.3, 20.0, -8.0), Some(Intracranial::Falx));
        assert_eq!(at(60.0, 6.0, -44.0), None);
    }
    // The frontal suture is open, and no bone crosses the brain behind it.
    let along = |x: f32, y: f32| (0..600).filter(move |i| is_bone(vec3(x, y, 5.0 - 0.1 * *i as f32), 0.0)).count();
    assert!(along(0.0, 30.0) == 0 && (14..40).contains(&along(8.0, 30.0)), "{}", along(8.0, 30.0));
}

/// The fingers bend at their joints without growing.
#[test]
fn fingers_bend_towards_the_palm() {
    let [open, closed] = [0.0, 0.85].map(|curl| {
        let hand = Hand::new(curl);
        let top = (0..600).map(|i| 10.0 - 0.1 * i as f32);
        let reaches = |y: f32| points(400, vec3(30.0, y, -30.0), vec3(50.0, y, 5.0)).any(|p| hand.distance(p) < 0.0);
        top.into_iter().find(|y| reaches(*y)).unwrap_or(f32::NEG_INFINITY)
    });
    assert!(open > closed + 6.0, "open up to {open}, closed up to {closed}");
}

/// The rope is as thick as its strands make it, and has a furrow between them.
#[test]
fn the_cord_is_twisted() {
    let across = |y: f32| {
        let inside = points(4000, vec3(-60.0, y, -25.0), vec3(-35.0, y, 5.0)).filter(|p| cord(*p) < 0.0);
        let (low, high) = inside.fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(p.x), high.max(p.x)));
        high - low
    };
    let widths: Vec<f32> = (0..26).map(|i| across(-22.0 + i as f32)).collect();
    let (thin, thick) = widths.iter().fold((f32::MAX, f32::MIN), |(a, b), w| (a.min(*w), b.max(*w)));
    assert!(thick < 13.5 && thin > 7.0 && thick - thin > 0.8, "{thin} to {thick} mm");
}
