//! The share of matter that `region.fade` leaves along a line ([`Scene::faded`](crate::scene::Scene::faded)). It is a smooth function of
//! the position between the kinks that are found here.
//!
//! With the distances d of a place from the faces, the matter left is the smooth step of 1 - |b|, b = max(1 - d / fade, 0) for each axis. Each
//! component is linear along the line but where it begins, and where the nearer one of two opposite faces changes. Between these places
//! |b|^2 is a parabola, and nothing is left where it exceeds 1.

use super::coordinates::{Line, crossings_of_a_line, quadratic, sorted};
use glam::DVec3;

/// The factor 0..1 by which `region.fade` scales the absorption of the medium along a line, as a function of s, mm along that line.
#[derive(Clone, Copy, Debug)]
pub struct Fade<'a> {
    line: Line<'a>,
    /// The box towards whose faces matter fades, mm in space.
    low: DVec3,
    high: DVec3,
    /// mm.
    length: f64,
}

impl<'a> Fade<'a> {
    /// The fade of the line's scene along the line. None if the scene has no `region.fade`.
    pub fn of(line: &Line<'a>) -> Option<Fade<'a>> {
        let (low, high) = (line.scene.volume_view().low, line.scene.high);
        line.scene.region_fade().map(|length| Fade { line: *line, low, high, length })
    }

    /// The factor at s, mm: 1 where nothing fades, 0 where all matter has faded.
    pub fn at(&self, s: f64) -> f64 {
        self.line.scene.faded(self.line.place(s))
    }

    /// How far the place at s is beyond the beginning of the fade along each axis, in lengths of the fade.
    fn beyond(&self, s: f64) -> DVec3 {
        let (from_low, from_high) = (self.line.place(s) - self.low, self.high - self.line.place(s));
        // Matter does not fade towards the face that is nearest to the probe.
        let to_faces = DVec3::new(from_low.x.min(from_high.x), from_high.y, from_low.z.min(from_high.z));
        (1.0 - to_faces / self.length).max(DVec3::ZERO)
    }

    /// Returns both ends and every s between them at which the factor has a kink, mm, in rising order.
    pub fn kinks(&self, ends: [f64; 2]) -> Vec<f64> {
        let mut found = Vec::new();
        for axis in 0..3 {
            let (low, high) = (self.low[axis], self.high[axis]);
            let places = [low + self.length, high - self.length, (low + high) / 2.0];
            crossings_of_a_line(self.line.base[axis], self.line.direction[axis], places.into_iter(), &mut found);
        }
        let between = sorted(found, ends);
        let mut found = between.clone();
        for pair in between.windows(2) {
            let (middle, half) = ((pair[0] + pair[1]) / 2.0, (pair[1] - pair[0]) / 2.0);
            let [a, b] = [-0.5, 0.5].map(|x| self.beyond(middle + half * x));
            let (mean, rise) = ((a + b) / 2.0, b - a);
            let roots = quadratic(rise.length_squared(), 2.0 * mean.dot(rise), mean.length_squared() - 1.0);
            found.extend(roots.filter(|x| x.abs() < 1.0).map(|x| middle + half * x));
        }
        sorted(found, ends)
    }
}
