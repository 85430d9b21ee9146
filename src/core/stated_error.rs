//! The errors that a picture with `ray.tolerance` states.

use crate::passes::raycast::tolerance::LEVELS;
use crate::passes::{Slot, Texels};
use std::fmt::{self, Display};

/// Share of the pixels with an estimate under the tolerance whose error is above it, in the worst of the scenes of tests/gpu/tolerance.rs: an estimate from
/// samples cannot know what none of them meets. So many are not counted.
const MISSED: f64 = 0.006;

/// Bits of a word of marks, four rows of eight pixels, whose pixels are those of the lattice.
const OF_LATTICE: u32 = 0x0055_0055;

/// Statistics of the errors that the renderer estimates for each pixel of a picture with `ray.tolerance`. Shares are 0..1 of all pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Stated {
    /// The tolerance of each pixel, levels of 8 bits.
    pub tolerance: f64,
    /// Share of the pixels whose error is 0 for certain: a ray of their own meets only empty bricks, ends at a cut face, or misses the region.
    /// Interpolated pixels do not count.
    pub certain: f64,
    /// Share of the pixels whose estimated error is above 0 and at most the tolerance, less 0.6 % of these, whose true error is above it in tests.
    pub estimated: f64,
    /// Share of the pixels that have a ray of their own. The others are interpolated from neighbouring rays.
    pub with_rays: f64,
    /// The largest estimated error of a pixel, levels of 8 bits.
    pub largest: f64,
}

impl Stated {
    /// The slots that the statistics are computed from, in the order of the arguments of [`Stated::new`].
    pub const SLOTS: [Slot; 2] = [Slot::PixelErrors, Slot::ErrorMarks];

    /// `errors` and `marks`: texels of [`Stated::SLOTS`]. `tolerance`: levels of 8 bits.
    pub fn new(errors: &Texels, marks: &Texels, tolerance: f64) -> Stated {
        let count = errors.values.len().max(1) as f64;
        let share = |is_counted: &dyn Fn(f64) -> bool| {
            errors.values.iter().filter(|error| is_counted(**error)).count() as f64 / count
        };
        // As the shader compares them.
        let allowed = f64::from((tolerance / LEVELS) as f32);
        let [width, height, _] = errors.size;
        let between: u32 = marks.values.iter().map(|word| (*word as u32 & !OF_LATTICE).count_ones()).sum();
        let of_lattice = width.div_ceil(2) * height.div_ceil(2);
        Stated {
            tolerance,
            certain: share(&|error| error == 0.0),
            estimated: share(&|error| error > 0.0 && error <= allowed) * (1.0 - MISSED),
            with_rays: (f64::from(between) + of_lattice as f64) / count,
            largest: errors.values.iter().copied().fold(0.0, f64::max) * LEVELS,
        }
    }

    /// Share of the pixels that keep the tolerance: `certain` and `estimated` together.
    pub fn kept(&self) -> f64 {
        self.certain + self.estimated
    }
}

impl Display for Stated {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Stated { tolerance, certain, estimated, with_rays, largest } = self;
        let levels = if *tolerance == 1.0 { "level" } else { "levels" };
        write!(
            f,
            "at most {tolerance} {levels} of 255: {:.1} % of the pixels by proof, {:.1} % by estimate; {:.1} % may have more, {largest:.1} is \
             the largest stated; {:.1} % have rays of their own",
            100.0 * certain,
            100.0 * estimated,
            100.0 * (1.0 - self.kept()).max(0.0),
            100.0 * with_rays
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_all_pixels() {
        let errors = Texels { size: [5, 1, 1], channels: 1, values: vec![0.0, 1e-6, 1.0 / 255.0, 2.5 / 255.0, 0.0] };
        let marks = Texels { size: [1, 1, 1], channels: 2, values: vec![f64::from(0b11000_u32), 0.0] };
        // Texels hold what was stored in 32 bits.
        let errors = Texels { values: errors.values.iter().map(|v| f64::from(*v as f32)).collect(), ..errors };
        let stated = Stated::new(&errors, &marks, 1.0);
        assert_eq!([stated.certain, stated.estimated, stated.with_rays], [0.4, 0.4 * (1.0 - MISSED), 0.8]);
        assert_eq!(
            stated.to_string(),
            "at most 1 level of 255: 40.0 % of the pixels by proof, 39.8 % by estimate; 20.2 % may have more, 2.5 is the largest stated; \
             80.0 % have rays of their own"
        );
    }
}
