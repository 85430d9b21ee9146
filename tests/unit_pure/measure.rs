//! Measuring the phantom: its ball has the volume that its formula says.

use echolume::low_level::probe::Geometry;
use echolume::low_level::segment::bodies;
use echolume::low_level::source::StoredType;
use echolume::low_level::source::convert::Volume;
use echolume::low_level::source::phantom::{Body, Phantom, PhantomOptions, Speckle, Truth};
use glam::DVec3;

/// In the polar frames of a wobbler. Requirement: 1 % without speckle; with it the limit of segmentations, 3 %.
#[test]
fn the_balls_automatic_volume_is_right_to_one_percent() {
    for (speckle, allowed) in [(Speckle::None, 0.01), (PhantomOptions::default().speckle, 0.03)] {
        let options =
            PhantomOptions { body: Body::Sphere, speckle, frames: 61, lines: 96, samples: 256, ..Default::default() };
        let phantom = Phantom::new(options).expect("a phantom");
        let Truth::Sphere { centre, radius, .. } = phantom.truth() else { panic!("a ball") };
        let mut volume = Volume::new(Geometry::Sweep(phantom.probe(0).clone()), StoredType::U8);
        phantom.volume(0).into_iter().for_each(|frame| volume.take(frame));
        let truth = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let reach = DVec3::splat(radius + 6.0);
        let within = |high| bodies::largest_within(&volume, [0.0, 255.0], [centre - reach, high]);
        let (body, threshold) = within(centre + reach).expect("a body");
        let found = body.measured.expect("a volume");
        assert!((found.volume / truth - 1.0).abs() < allowed, "{speckle:?}: {found:?} for {truth}");
        assert!(found.low < found.volume && found.volume < found.high && !body.is_cut, "{found:?}");
        assert!((0.2..0.9).contains(&threshold), "{threshold}");
        // A box with half of the ball says that the body goes on.
        assert!(within((centre + reach).with_x(centre.x)).is_ok_and(|(body, _)| body.is_cut));
        assert!(within(centre - 2.0 * reach).is_err_and(|why| why.contains("empty")));
    }
}
