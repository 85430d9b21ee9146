//! Sizes of filters in mm, resolved to what the filters of a scene take: slice pixels, slices, samples and rays.

use super::{
    Bilateral, Conditioning, Distance, EnhancedSigma, MAX_DEVIATION, MAX_WINDOW, PeronaMalik, Rays, Scheme, Sigma,
    SliceGrid, Slices, Smooth,
};
use crate::probe::{Geometry, Motion};
use glam::DVec3;
use std::fmt;

/// Maximum number of steps of a diffusion.
const MAX_STEPS: f64 = 1000.0;

/// A size that a setting gives in mm, and the size in pixels, slices, samples or rays that is used for it.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedSize {
    /// The setting.
    key: &'static str,
    mm: f64,
    /// One pixel, slice, sample or ray, mm.
    pitch: f64,
    unit: &'static str,
    /// In units, as asked for and as taken.
    asked: f64,
    taken: f64,
    /// The asked size is beyond what the filter takes.
    is_cut: bool,
}

impl fmt::Display for ResolvedSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ResolvedSize { key, mm, unit, .. } = self;
        let [pitch, asked, taken] = [self.pitch, self.asked, self.taken].map(|v| (v * 1e4).round() / 1e4);
        write!(f, "{key} = {mm}: {taken} {unit} of {pitch} mm")?;
        if self.is_cut { write!(f, ", the most of this filter ({asked} asked for)") } else { Ok(()) }
    }
}

/// What is one unit of each size at the middle of the region, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pitches {
    /// Distance of neighbouring samples of a line, mm; 0 for a Cartesian volume, which has no lines.
    pub sample: f64,
    /// Distance of neighbouring pixels of a slice, mm: the mean of both axes.
    pub slice_pixel: f64,
    /// Mean distance of neighbouring slices at the middle of the region, mm; 0 for a single frame of a probe.
    pub slice: f64,
    /// Distance of neighbouring rays of a picture with full resolution at the middle of the region, mm.
    pub ray: f64,
}

impl Pitches {
    /// `apart`: the setting `ray.subsampling`, by which the distance of neighbouring `rays` is divided. `middle`: middle of the region, mm in space.
    pub fn new(geometry: &Geometry, grid: &SliceGrid, rays: &Rays, apart: u32, middle: DVec3) -> Pitches {
        let (sample, slice) = match geometry {
            Geometry::Cartesian(volume) => (0.0, volume.spacing[2]),
            Geometry::Sweep(probe) => {
                let slice = match probe.motion {
                    // An arc about the wobble axis.
                    Motion::Fan { .. } => {
                        probe.slices.pitch() * (probe.inverse_sweep_map(middle).1 - probe.axis_depth())
                    }
                    Motion::Translated => probe.slices.pitch(),
                    Motion::Still { .. } => 0.0,
                };
                (probe.sample_pitch, slice)
            }
        };
        let ray = match rays.is_perspective {
            true => rays.direction_dx.length() * (middle - rays.origin).dot(rays.forward).max(0.0),
            false => rays.origin_dx.length(),
        };
        let slice_pixel = (grid.pitch[0] + grid.pitch[1]) / 2.0;
        Pitches { sample, slice_pixel, slice, ray: ray / f64::from(apart) }
    }
}

/// Converts sizes in mm, and records each for [`ResolvedSize`].
pub(super) struct Resolver {
    pub pitches: Pitches,
    pub resolved: Vec<ResolvedSize>,
}

/// A unit by its pitch, mm, and its name.
#[derive(Clone, Copy)]
struct Unit(f64, &'static str);

impl Resolver {
    fn keep(&mut self, key: &'static str, mm: f64, Unit(pitch, unit): Unit, taken: f64, is_cut: bool) {
        self.resolved.push(ResolvedSize { key, mm, pitch, unit, asked: mm / pitch, taken, is_cut });
    }

    /// A length of at most `most` units; 0 without a pitch.
    fn length(&mut self, key: &'static str, mm: f64, unit: Unit, most: f64) -> f64 {
        let asked = if unit.0 > 0.0 { mm / unit.0 } else { 0.0 };
        let taken = asked.min(most);
        self.keep(key, mm, unit, taken, asked > most);
        taken
    }

    /// The odd window that is nearest, at most [`MAX_WINDOW`]; 1 is a window of the pixel alone.
    fn window(&mut self, key: &'static str, mm: f64, unit: Unit) -> u32 {
        let asked = mm / unit.0;
        let nearest = 2.0 * ((asked - 1.0) / 2.0).round().max(0.0) + 1.0;
        let taken = nearest.min(f64::from(MAX_WINDOW));
        self.keep(key, mm, unit, taken, nearest > taken);
        taken as u32
    }

    fn sigma(&mut self, key: &'static str, filter: Option<Sigma>, unit: Unit) -> Option<Sigma> {
        let filter = filter?;
        let Some(mm) = filter.window_mm else { return Some(filter) };
        let window = self.window(key, mm, unit);
        (window > 1).then_some(Sigma { window, window_mm: None, ..filter })
    }

    fn enhanced_sigma(
        &mut self,
        [start_key, largest_key]: [&'static str; 2],
        filter: Option<EnhancedSigma>,
        unit: Unit,
    ) -> Option<EnhancedSigma> {
        let filter = filter?;
        let start = filter.window_mm.map_or(filter.window, |mm| self.window(start_key, mm, unit));
        let largest = filter.largest_mm.map_or(filter.largest, |mm| self.window(largest_key, mm, unit));
        let window = start.max(3);
        let resolved =
            EnhancedSigma { window, largest: largest.max(window), window_mm: None, largest_mm: None, ..filter };
        (largest > 1).then_some(resolved)
    }

    /// Without an edge, diffusion over a time t is a Gaussian of the variance 2 t.
    fn perona_malik(&mut self, key: &'static str, filter: Option<PeronaMalik>, unit: Unit) -> Option<PeronaMalik> {
        let filter = filter?;
        let Some(mm) = filter.width_mm else { return Some(filter) };
        let longest = match filter.scheme {
            Scheme::Explicit => filter.step,
            Scheme::Rkl1 => 200.0,
            Scheme::Aos | Scheme::AosRichardson => 1e9,
        };
        let most = if filter.scheme == Scheme::Explicit { MAX_STEPS } else { f64::from(filter.repeat) };
        let deviation = self.length(key, mm, unit, (2.0 * longest * most).sqrt());
        let time = deviation * deviation / 2.0;
        let repeat = match filter.scheme {
            // The slack is that of rounding.
            Scheme::Explicit => ((time / longest - 1e-9).ceil().max(1.0)) as u32,
            _ => filter.repeat,
        };
        Some(PeronaMalik { step: time / f64::from(repeat), repeat, width_mm: None, ..filter })
    }

    pub fn conditioning(&mut self, c: &Conditioning) -> Conditioning {
        let unit = Unit(self.pitches.sample, "samples");
        let low_pass = match c.low_pass_mm {
            Some(mm) => Some(self.length("conditioning.low_pass_mm", mm, unit, MAX_DEVIATION)),
            None => c.low_pass,
        };
        Conditioning { low_pass, low_pass_mm: None, ..c.clone() }
    }

    /// Converts a Gaussian's standard deviation across slices from mm to slices, if it is given in mm. `key`: path of the setting.
    pub fn smooth(&mut self, key: &'static str, smooth: Smooth) -> Smooth {
        let Some(mm) = smooth.elevation_mm else { return smooth };
        let elevation = self.length(key, mm, Unit(self.pitches.slice, "slices"), MAX_DEVIATION);
        Smooth { elevation, elevation_mm: None, ..smooth }
    }

    pub fn slices(&mut self, s: &Slices) -> Slices {
        let unit = Unit(self.pitches.slice_pixel, "slice pixels");
        let smooth = s.smooth.map(|smooth| self.smooth("slices.smooth.elevation_mm", smooth));
        Slices {
            sigma: self.sigma("slices.sigma.window_mm", s.sigma, unit),
            enhanced_sigma: self.enhanced_sigma(
                ["slices.enhanced_sigma.window_mm", "slices.enhanced_sigma.largest_mm"],
                s.enhanced_sigma,
                unit,
            ),
            perona_malik: self.perona_malik("slices.perona_malik.width_mm", s.perona_malik, unit),
            smooth,
            ..s.clone()
        }
    }

    /// Converts sizes in mm of the filters of the distance map to pixels of that map, one ray each, for a picture with full resolution.
    pub fn distance(&mut self, d: &Distance) -> Distance {
        let unit = Unit(self.pitches.ray, "rays");
        let median = match d.median_mm.map(|mm| self.window("distance.median_mm", mm, unit)) {
            Some(1) => 0,
            Some(window) => window,
            None => d.median,
        };
        let bilateral = d.bilateral.and_then(|b| match b.mm {
            Some(mm) => {
                let pixels = self.length("distance.bilateral.mm", mm, unit, Bilateral::MAX_PIXELS);
                (pixels >= Bilateral::MIN_PIXELS).then_some(Bilateral { pixels, mm: None, ..b })
            }
            None => Some(b),
        });
        Distance {
            median,
            median_mm: None,
            bilateral,
            sigma: self.sigma("distance.sigma.window_mm", d.sigma, unit),
            enhanced_sigma: self.enhanced_sigma(
                ["distance.enhanced_sigma.window_mm", "distance.enhanced_sigma.largest_mm"],
                d.enhanced_sigma,
                unit,
            ),
            perona_malik: self.perona_malik("distance.perona_malik.width_mm", d.perona_malik, unit),
        }
    }
}
