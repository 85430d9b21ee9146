//! Measuring the phantom: its ball has the volume that its formula says.

use echolume::low_level::measure::voxels;
use echolume::low_level::probe::Geometry;
use echolume::low_level::source::StoredType;
use echolume::low_level::source::convert::Volume;
use echolume::low_level::source::phantom::{Body, Phantom, PhantomOptions, Speckle, Truth};
use glam::DVec3;

/// Requirement: 1 %, in the polar frames of a wobbler, for the whole ball and for the half of it that a box holds.
#[test]
fn the_balls_volume_by_threshold_is_right_to_one_percent() {
    let options = PhantomOptions {
        body: Body::Sphere,
        speckle: Speckle::None,
        frames: 61,
        lines: 96,
        samples: 256,
        ..PhantomOptions::default()
    };
    let phantom = Phantom::new(options).expect("a phantom");
    let Truth::Sphere { centre, radius, inside, outside } = phantom.truth() else { panic!("a ball") };
    let mut volume = Volume::new(Geometry::Sweep(phantom.probe(0).clone()), StoredType::U8);
    phantom.volume(0).into_iter().for_each(|frame| volume.take(frame));
    let truth = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let reach = DVec3::splat(radius + 3.0);
    for (share, high) in [(1.0, centre + reach), (0.5, (centre + reach).with_x(centre.x))] {
        let counted = voxels::count(&volume, [centre - reach, high], 1.0, (inside + outside) / 2.0).expect("a box");
        let found = counted.volume / (share * truth);
        assert!((found - 1.0).abs() < 0.01, "{found} of {share} of the ball");
    }
}
