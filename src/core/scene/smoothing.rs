//! The filters of slices: their deviations and radii, and how far they reach.

use super::{Elevation, EnhancedSigma, Estimator, Scene, Smooth};

impl Scene {
    /// Standard deviations of the 3D Gaussian: along columns and rows in slice pixels, across slices in slices. The last is less than the setting
    /// where interpolation between slices smooths more than linear interpolation does.
    pub fn smoothing(&self) -> [f64; 3] {
        let [lateral, depth, elevation] = self.deviations(self.slice_filters.smooth.unwrap_or_default());
        let blur = binomial_deviation(3);
        if self.blurs() { [blur, blur, elevation] } else { [lateral, depth, elevation] }
    }

    /// Standard deviations of the 3D Gaussian of the section volume: slice pixels, slice pixels and slices.
    pub(crate) fn section_smoothing(&self) -> [f64; 3] {
        self.deviations(self.section_smooth.unwrap_or_default())
    }

    fn deviations(&self, smooth: Smooth) -> [f64; 3] {
        if let Some(taps) = smooth.kernel {
            return [binomial_deviation(taps); 3];
        }
        let elevation = self.left_to_smooth(smooth.elevation);
        [smooth.lateral / self.grid.pitch[0], smooth.depth / self.grid.pitch[1], elevation]
    }

    /// The deviation of the Gaussian across slices, slices, that together with the interpolation between them has the variance of this
    /// deviation and linear interpolation. The weights of two texels at a share t have the variance t (1 - t), 1/6 on average; those of
    /// the cubic B-spline 1/3 everywhere.
    fn left_to_smooth(&self, deviation: f64) -> f64 {
        match self.settings.ray.elevation {
            Elevation::Linear => deviation,
            Elevation::Bspline | Elevation::BsplineSharp => {
                (deviation * deviation - (1.0 / 3.0 - 1.0 / 6.0)).max(0.0).sqrt()
            }
        }
    }

    /// True if samples between slices are interpolated by the cubic B-spline, which reads four slices.
    pub fn takes_bspline(&self) -> bool {
        self.settings.ray.elevation != Elevation::Linear
    }

    /// True if slices are sharpened across elevation, for `ray.elevation = "bspline-sharp"`.
    pub(crate) fn sharpens(&self) -> bool {
        self.settings.ray.elevation == Elevation::BsplineSharp
    }

    /// True if a pass filters across slices.
    pub fn filters_across_slices(&self) -> bool {
        self.smoothing_radius()[2] > 0
    }

    /// Number of taps of the 3D Gaussian on each side of the middle, along columns, rows and slices.
    pub fn smoothing_radius(&self) -> [u32; 3] {
        let [lateral, depth, elevation] = self.radii(self.slice_filters.smooth, self.smoothing());
        if self.blurs() { [1, 1, elevation] } else { [lateral, depth, elevation] }
    }

    /// Number of taps of the 3D Gaussian of the section volume on each side of the middle, along columns, rows and slices.
    pub(crate) fn section_smoothing_radius(&self) -> [u32; 3] {
        self.radii(self.section_smooth, self.section_smoothing())
    }

    fn radii(&self, smooth: Option<Smooth>, deviations: [f64; 3]) -> [u32; 3] {
        if let Some(taps) = smooth.and_then(|s| s.kernel) {
            return [taps / 2; 3];
        }
        let [lateral, depth, elevation] = deviations.map(gaussian_radius);
        [lateral, depth, if self.sharpens() { 1 } else { elevation }]
    }

    /// Number of frames on either side of a slice that can change it in the volume that rays go through: all of them where floating parts are dropped
    /// or the start surface is searched.
    pub(crate) fn reach_to_frames(&self) -> u32 {
        if self.drops_floating() || self.unveils() { self.slices() } else { self.smoothing_radius()[2] }
    }

    /// Number of neighbouring slices on either side that a filtered slice depends on; of the two volumes, the one with more.
    pub fn reach_across_slices(&self) -> u32 {
        let sections = if self.has_sections() { self.section_smoothing_radius()[2] } else { 0 };
        self.smoothing_radius()[2].max(sections)
    }

    /// True if slices get the slight blur against wood grain: it is set, and no smoothing blurs them in their plane.
    fn blurs(&self) -> bool {
        let smooth = self.slice_filters.smooth.unwrap_or_default();
        let blur = self.settings.slices.blur.is_on(self.is_flat());
        blur && smooth.kernel.is_none() && smooth.lateral == 0.0 && smooth.depth == 0.0
    }

    /// The estimator of the centre in an enhanced sigma filter: as set, otherwise Perona-Malik for planes and the median for all other modes (thesis
    /// 5.7).
    pub fn centre(&self, enhanced: EnhancedSigma) -> Estimator {
        let usual = if self.is_flat() { Estimator::PeronaMalik } else { Estimator::Median };
        enhanced.centre.unwrap_or(usual)
    }

    /// Reach of the slice filters, pixels.
    pub(super) fn filter_reach(&self) -> f64 {
        let [lateral, depth, _] = self.smoothing_radius().map(f64::from);
        let median = if self.settings.slices.median { 1.0 } else { 0.0 };
        let slices = &self.slice_filters;
        let sigma = slices.sigma.map_or(0.0, |s| f64::from(s.repeat * (s.window / 2)));
        let enhanced = slices.enhanced_sigma.map_or(0.0, |e| f64::from(e.largest / 2));
        let estimator = match slices.estimator {
            Some(Estimator::NagaoMatsuyama) => 2.0,
            Some(_) => 1.0,
            None => 0.0,
        };
        let diffusion = slices.perona_malik.map_or(0.0, |p| p.reach());
        // The reach of a chain of square windows extends to their corners.
        let gaussian = lateral.hypot(depth);
        let [lateral, depth, _] = self.section_smoothing_radius().map(f64::from);
        let sections = if self.has_sections() { lateral.hypot(depth) } else { 0.0 };
        let slices = std::f64::consts::SQRT_2 * (median + estimator + sigma + enhanced) + diffusion + gaussian;
        slices.max(sections)
    }
}

/// Standard deviation of the binomial kernel of `taps` taps.
fn binomial_deviation(taps: u32) -> f64 {
    f64::from(taps - 1).sqrt() / 2.0
}

/// Number of taps on one side of a Gaussian of `deviation` pixels or slices. It is cut off at three standard deviations, which hold 99.7 %.
pub(crate) fn gaussian_radius(deviation: f64) -> u32 {
    if deviation > 0.0 { ((3.0 * deviation).ceil() as u32).max(1) } else { 0 }
}
