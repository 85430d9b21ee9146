//! Divides a long dispatch into parts (bands), each in a submission of its own. The watchdog of a driver ends a submission that takes too
//! long, and the device is lost: after 2 s (Windows), 7.5 s (i915) or 10 s (amdgpu). The size of a band follows from the measured time of
//! the pass on this device.
//!
//! The workgroups of every pass are independent: only invocations of one workgroup share memory, and atomic operations are on that memory
//! alone. So any division between workgroups gives the same texels. A software device has no watchdog and gets no bands until it is lost.

use crate::passes::{Pass, Stage};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Longest expected time of a submission, ns. It is far below the limit of every watchdog, since the next picture may be slower than the
/// last.
const TARGET_NS: f64 = 100e6;
/// Longest expected time of a submission on a software device that draws the panels of a window between the bands, ns.
const PACED_TARGET_NS: f64 = 20e6;
/// How often the first bands of a software device are halved, because a ray takes some microseconds there.
const SOFTWARE_HALVINGS: u32 = 2;
/// Lower limit of the time of a submission after losses of the device, ns.
const LEAST_NS: f64 = 1e6;
/// Invocations in the first band of a pass that casts rays, on a device where its time is not known.
const FIRST_RAYS: u64 = 1 << 18;
/// Invocations in the first band of any other pass.
const FIRST_TEXELS: u64 = 1 << 21;
/// Least ratio of a new measured time to the previous one: a faster measurement lowers the time at most by this factor, so that one fast
/// picture does not make the next bands too long.
const DECAY: f64 = 0.75;

/// By which rule dispatches are divided into bands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bands {
    /// By measured time. `losses`: how often the device was lost so far; each loss halves the time that a submission may take. With 0, dispatches on
    /// a software device stay whole, except for a renderer that is paced (`RendererOptions::paced`).
    Measured { losses: u32 },
    /// Into bands of about this many invocations, for tests. The number is rounded up to whole slabs, which are one workgroup thick along the axis
    /// with the most workgroups.
    Fixed(u64),
}

impl Default for Bands {
    fn default() -> Bands {
        Bands::Measured { losses: 0 }
    }
}

/// The measured time of one invocation of a pipeline, ns. 0 until it is measured.
#[derive(Debug, Default)]
pub(crate) struct InvocationTime(AtomicU64);

impl InvocationTime {
    fn measured(&self) -> Option<f64> {
        Some(f64::from_bits(self.0.load(Ordering::Relaxed))).filter(|ns| *ns > 0.0)
    }

    fn measure(&self, ns: f64) {
        let least = self.measured().map_or(0.0, |before| DECAY * before);
        if ns.is_finite() && ns > 0.0 {
            self.0.store(ns.max(least).to_bits(), Ordering::Relaxed);
        }
    }

    /// From now on each invocation is expected to take `factor` times as long. A factor of at most 1 changes nothing.
    pub(crate) fn lengthen(&self, factor: f64) {
        if let Some(ns) = self.measured().filter(|_| factor.is_finite() && factor > 1.0) {
            self.0.store((factor * ns).to_bits(), Ordering::Relaxed);
        }
    }
}

/// A part of a dispatch: first workgroup (`base`) and number of workgroups along x, y and z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Band {
    pub base: [u32; 3],
    pub groups: [u32; 3],
}

/// How much work one submission may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum BandLimit {
    /// `target`: expected time, ns. `halvings`: how often the first bands, whose time is not known, are halved.
    Time { target: f64, halvings: u32 },
    /// Number of invocations of a band.
    Invocations(u64),
}

impl BandLimit {
    /// The limit for the submissions to a device; `None` if no dispatch is divided.
    pub fn new(bands: Bands, is_software: bool) -> Option<BandLimit> {
        match bands {
            Bands::Measured { losses: 0 } if is_software => None,
            Bands::Measured { losses } => {
                Some(BandLimit::Time { target: after_losses(TARGET_NS, losses), halvings: losses })
            }
            Bands::Fixed(invocations) => Some(BandLimit::Invocations(invocations.max(1))),
        }
    }

    /// The limit for a device whose queue also draws a window's panels, between the bands. Unlike with [`BandLimit::new`], a software device gets
    /// bands also before a loss, and shorter ones. The result is never None.
    pub fn paced(bands: Bands, is_software: bool) -> Option<BandLimit> {
        match bands {
            Bands::Measured { losses } if is_software => Some(BandLimit::Time {
                target: after_losses(PACED_TARGET_NS, losses),
                halvings: losses.saturating_add(SOFTWARE_HALVINGS),
            }),
            _ => BandLimit::new(bands, is_software),
        }
    }

    /// Expected time of the work that is submitted ahead, so that the device does not wait for the host between two bands. Zero: one band at a time.
    pub(crate) fn in_flight(&self) -> Duration {
        match *self {
            BandLimit::Time { target, .. } => Duration::from_nanos((2.0 * target) as u64),
            // Their time is not known: one is in flight.
            BandLimit::Invocations(_) => Duration::ZERO,
        }
    }

    /// Expected time of a dispatch, ns. 0 if the limit is a number of invocations.
    pub fn expected(&self, pass: &Pass, time: &InvocationTime, invocations: u64) -> f64 {
        let BandLimit::Time { target, halvings } = *self else { return 0.0 };
        let each = time.measured().unwrap_or_else(|| {
            let first = match pass.stage {
                Stage::Raycast | Stage::Shade => FIRST_RAYS,
                _ => FIRST_TEXELS,
            };
            // Halved after a loss, as the time is: unless that is at its least.
            target / (first >> halvings.min(12)).max(1) as f64
        });
        each * invocations as f64
    }

    /// True if a dispatch of `expected` ns does not fit into a submission that already has work of `open` ns.
    pub fn is_full(&self, open: f64, expected: f64) -> bool {
        match *self {
            BandLimit::Time { target, .. } => open > 0.0 && open + expected > target,
            BandLimit::Invocations(_) => false,
        }
    }

    /// Divides a dispatch of `groups` workgroups and `invocations` invocations, which is expected to take `expected` ns. The bands are slabs along
    /// the axis with the most workgroups.
    pub fn bands(&self, groups: [u32; 3], invocations: u64, expected: f64) -> Vec<Band> {
        let count = match *self {
            BandLimit::Time { target, .. } => (expected / target).ceil() as u64,
            BandLimit::Invocations(most) => invocations.div_ceil(most),
        };
        // Of equally many, the rows before the columns: a row of texels is contiguous in memory.
        let axis = (0..3).rev().max_by_key(|axis| (groups[*axis], *axis)).unwrap_or(0);
        let all = groups[axis];
        let each = u64::from(all).div_ceil(count.max(1)).max(1) as u32;
        let band = |first: u32| {
            let (mut base, mut size) = ([0; 3], groups);
            (base[axis], size[axis]) = (first, each.min(all - first));
            Band { base, groups: size }
        };
        match all {
            0 => vec![Band { base: [0; 3], groups }],
            _ => (0..all).step_by(each as usize).map(band).collect(),
        }
    }
}

/// Each loss of the device halves the time that a submission may take.
fn after_losses(target: f64, losses: u32) -> f64 {
    (target / 2f64.powi(losses.min(64) as i32)).max(LEAST_NS)
}

/// A dispatch in a submission whose time is measured.
#[derive(Clone, Debug)]
pub struct Work {
    pub time: std::sync::Arc<InvocationTime>,
    /// Expected time of the dispatch, ns.
    pub expected: f64,
    pub invocations: u64,
}

/// Stores the measured time, ns, of a submission with this work. Several dispatches share the time in proportion to their expected times.
pub fn measured(work: &[Work], ns: f64) {
    let expected: f64 = work.iter().map(|w| w.expected).sum();
    for w in work.iter().filter(|w| w.invocations > 0) {
        let share = if work.len() == 1 { 1.0 } else { w.expected / expected };
        w.time.measure(share * ns / w.invocations as f64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::by_name;
    use std::sync::Arc;

    fn limit(losses: u32) -> BandLimit {
        BandLimit::new(Bands::Measured { losses }, false).expect("a limit")
    }

    fn covers(bands: &[Band], groups: [u32; 3]) {
        let volume = |g: [u32; 3]| g.iter().map(|n| u64::from(*n)).product::<u64>();
        assert_eq!(bands.iter().map(|b| volume(b.groups)).sum::<u64>(), volume(groups));
        let axis = (0..3).find(|a| bands.iter().any(|b| b.base[*a] > 0)).unwrap_or(0);
        for pair in bands.windows(2) {
            assert_eq!(pair[0].base[axis] + pair[0].groups[axis], pair[1].base[axis], "{bands:?}");
        }
    }

    #[test]
    fn bands_cover_every_workgroup_once() {
        for groups in [[1, 1, 1], [64, 48, 1], [7, 513, 1], [16, 16, 300], [900, 1, 1], [5, 0, 1]] {
            for most in [1, 1000, 1 << 14, u64::MAX] {
                let invocations = 64 * groups.iter().map(|n| u64::from(*n)).product::<u64>();
                let bands = BandLimit::Invocations(most).bands(groups, invocations, 0.0);
                covers(&bands, groups);
                assert!(bands.len() == 1 || most < invocations, "{groups:?} {most}");
            }
        }
        let rows = BandLimit::Invocations(64 * 512 * 128).bands([512, 512, 1], 64 * 512 * 512, 0.0);
        assert_eq!(rows.len(), 4);
        assert_eq!(rows[1], Band { base: [0, 128, 0], groups: [512, 128, 1] });
    }

    #[test]
    fn an_unknown_pass_begins_with_small_bands_and_measured_ones_take_the_target() {
        let (rays, tone) = (by_name("raycast_surface").expect("pass"), by_name("tone").expect("pass"));
        let time = InvocationTime::default();
        let bands = |losses: u32, time: &InvocationTime| {
            let expected = limit(losses).expected(rays, time, 1 << 24);
            limit(losses).bands([512, 512, 1], 1 << 24, expected).len()
        };
        assert_eq!((bands(0, &time), bands(1, &time), bands(2, &time)), (64, 128, 256));
        assert!(limit(0).expected(tone, &time, 1 << 18) < limit(0).expected(rays, &time, 1 << 18));
        // A second for the picture: ten bands.
        time.measure(1e9 / f64::from(1 << 24));
        assert!((10..=11).contains(&bands(0, &time)), "{}", bands(0, &time));
        assert!((20..=22).contains(&bands(1, &time)), "{}", bands(1, &time));
        // One fast picture does not make them much longer; a slow one makes them shorter at once.
        time.measure(1e-3);
        assert!((7..=9).contains(&bands(0, &time)), "{}", bands(0, &time));
        time.measure(4e9 / f64::from(1 << 24));
        assert!((40..=42).contains(&bands(0, &time)), "{}", bands(0, &time));
        time.lengthen(2.0);
        time.lengthen(0.1);
        // Whole rows of workgroups: 74 of 7 and less.
        assert_eq!(bands(0, &time), 74);
    }

    #[test]
    fn a_software_device_gets_bands_after_it_was_lost() {
        assert_eq!(BandLimit::new(Bands::default(), true), None);
        assert!(BandLimit::new(Bands::Measured { losses: 1 }, true).is_some());
        assert_eq!(
            BandLimit::new(Bands::Measured { losses: 99 }, true),
            Some(BandLimit::Time { target: LEAST_NS, halvings: 99 })
        );
    }

    #[test]
    fn a_submission_of_several_passes_is_measured_by_their_expected_shares() {
        let times: [Arc<InvocationTime>; 2] = Default::default();
        let of = |n: usize, expected| Work { time: times[n].clone(), expected, invocations: 100 };
        measured(&[of(0, 3.0), of(1, 1.0)], 400.0);
        assert_eq!([times[0].measured(), times[1].measured()], [Some(3.0), Some(1.0)]);
        measured(&[of(0, 0.0)], 800.0);
        assert_eq!(times[0].measured(), Some(8.0));
        measured(&[of(1, 0.0)], 0.0);
        assert_eq!(times[1].measured(), Some(1.0), "no time is no measurement");
    }

    #[test]
    fn submissions_are_filled_up_to_the_target() {
        assert!(!limit(0).is_full(0.0, 1e12), "an empty one takes anything");
        assert!(!limit(0).is_full(40e6, 60e6) && limit(0).is_full(40e6, 61e6));
        assert!(!BandLimit::Invocations(1).is_full(40e6, 61e6));
    }
}
