//! Cuts resolved to space: where a texel of the volume is, and whether a cut removes it.
//!
//! A cut is decided texel by texel, at the texel's centre. Its edge in the volume is therefore as fine as the lattice of the volume: between a texel
//! that is removed and one that stays, samples are interpolated, and the edge lies up to half a texel beside the contour.

use super::picker::Picker;
use super::{
    Brush, Cut, CutView, KeptSide, MAX_BRUSH_POINTS, MAX_CUT_POINTS, MAX_CUTS, Mode, Scene, SceneError, Sign, refuse,
    region, transfer,
};
use crate::probe::{Geometry, Motion};
use glam::{DVec2, DVec3};

/// A cut, placed in space. Seen from where it was drawn, it removes what is within a contour (a prism, or in perspective a cone) or what is outside;
/// or it removes what is near the strokes of a brush.
#[derive(Clone, Debug, PartialEq)]
pub struct CutShape {
    /// Origin of the contour's plane, mm in space.
    pub at: DVec3,
    /// Unit vectors: `right` and `up` lie in the contour's plane, `forward` is its normal, away from the viewer.
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Distance of the eye from the contour's plane, mm. None in parallel projection.
    pub eye: Option<f64>,
    /// Corners of the contour in its plane, along `right` and `up`, mm.
    pub contour: Vec<DVec2>,
    /// True if the cut removes what is within the contour, false if it removes what is outside.
    pub(crate) removes_inside: bool,
    /// Largest distance behind the contour's plane at which matter is removed, mm. None: any distance. It does not limit the removal in front of the
    /// plane.
    pub depth: Option<f64>,
    /// The brush of a cut that was made by strokes; the contour is then empty. None for a cut by a contour.
    pub brush: Option<BrushShape>,
}

/// Strokes of a brush in space, mm: matter within `radius` of them is removed.
#[derive(Clone, Debug, PartialEq)]
pub struct BrushShape {
    pub radius: f64,
    pub strokes: Vec<Vec<DVec3>>,
}

impl BrushShape {
    /// True if a place is within the radius of a stroke: in a ball about one of its points, or in a cylinder about the line between two consecutive
    /// ones.
    pub fn holds(&self, place: DVec3) -> bool {
        let is_near = |from: DVec3, to: DVec3| {
            let (along, off) = (to - from, place - from);
            let square = along.length_squared();
            let share = if square > 0.0 { (off.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
            (off - along * share).length_squared() <= self.radius * self.radius
        };
        self.strokes.iter().any(|stroke| {
            let first = stroke.first().is_some_and(|point| is_near(*point, *point));
            first || stroke.windows(2).any(|ends| is_near(ends[0], ends[1]))
        })
    }

    /// Lower and upper corner of the box that holds all that the brush removes, mm.
    pub fn bounds(&self) -> [DVec3; 2] {
        let ends = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] =
            self.strokes.iter().flatten().fold(ends, |[low, high], point| [low.min(*point), high.max(*point)]);
        [low - self.radius, high + self.radius]
    }
}

impl CutShape {
    fn new(cut: &Cut, at: DVec3) -> CutShape {
        let forward = DVec3::from(cut.view.direction).normalize();
        let right = forward.cross(DVec3::from(cut.view.up)).normalize();
        CutShape {
            at,
            right,
            up: right.cross(forward),
            forward,
            eye: cut.view.eye,
            contour: cut.contour.iter().map(|corner| DVec2::from(*corner)).collect(),
            removes_inside: cut.keep == KeptSide::Outside,
            depth: cut.depth,
            brush: None,
        }
    }

    /// The point at which the line of sight through `place` crosses the contour's plane, mm along `right` and `up`, and the distance of `place`
    /// behind the plane, mm, negative in front of it. The point is None if `place` is not in front of the eye.
    pub fn project(&self, place: DVec3) -> (Option<DVec2>, f64) {
        let from = place - self.at;
        let behind = from.dot(self.forward);
        let across = DVec2::new(from.dot(self.right), from.dot(self.up));
        match self.eye {
            None => (Some(across), behind),
            Some(eye) => ((behind + eye > 0.0).then(|| across * eye / (behind + eye)), behind),
        }
    }

    /// True if the contour winds about a point of its plane (Sunday 2001, "Inclusion of a point in a polygon").
    pub fn winds_about(&self, point: DVec2) -> bool {
        let next = self.contour.iter().cycle().skip(1);
        let turns = self.contour.iter().zip(next).map(|(from, to)| {
            let side = (*to - *from).perp_dot(point - *from);
            match (from.y > point.y, to.y > point.y) {
                (false, true) if side > 0.0 => 1,
                (true, false) if side < 0.0 => -1,
                _ => 0,
            }
        });
        turns.sum::<i32>() != 0
    }

    /// True if the cut removes what is at a place in space.
    pub fn removes(&self, place: DVec3) -> bool {
        if let Some(brush) = &self.brush {
            return brush.holds(place);
        }
        let (point, behind) = self.project(place);
        self.depth.is_none_or(|depth| behind <= depth)
            && point.is_some_and(|point| self.winds_about(point)) == self.removes_inside
    }

    /// Lower and upper corner of the bounds of the contour in its plane, mm along `right` and `up`. For an empty contour the lower corner is infinite
    /// and the upper one minus infinite.
    pub fn bounds(&self) -> [DVec2; 2] {
        let ends = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        self.contour.iter().fold(ends, |[low, high], corner| [low.min(*corner), high.max(*corner)])
    }
}

impl Scene {
    /// True if the scene has cuts and renders through a volume from which they have removed matter. Planes and the block of mode cube show the volume
    /// without cuts.
    pub(crate) fn has_cuts(&self) -> bool {
        !self.settings.cuts.is_empty() && self.renders()
    }

    /// True if rays render the volume. False for planes and the block of mode cube, which show samples as they are.
    pub fn renders(&self) -> bool {
        self.composites() || self.detects_surface() || self.projects()
    }

    /// True if parts of the volume are removed before rays are cast: by cuts, or in front of the start surface (`unveil`) or the start curve
    /// (`region.start_curve`). A start depth removes nothing: rays begin there.
    pub fn removes(&self) -> bool {
        self.has_cuts() || self.unveils() || self.starts_at_curve()
    }

    /// Number of corners of all contours and of points of all brushes.
    pub fn cut_corners(&self) -> usize {
        self.settings.cuts.iter().map(|cut| cut.contour.len() + cut.brush.as_ref().map_or(0, Brush::points)).sum()
    }

    /// The cuts of the settings, placed in space.
    pub fn cuts(&self) -> impl Iterator<Item = CutShape> {
        let in_space = |brush: &Brush| BrushShape {
            radius: brush.radius,
            strokes: brush.strokes.iter().map(|s| s.iter().map(|point| self.place_of(*point)).collect()).collect(),
        };
        self.settings.cuts.iter().map(move |cut| CutShape {
            brush: cut.brush.as_ref().map(in_space),
            ..CutShape::new(cut, self.place_of(cut.view.at))
        })
    }

    /// The cut along a contour that was drawn on the rendering, of any depth. `outline`: the corners of the contour, pixels of the picture; `keep`:
    /// the side that stays. The plane of the cut faces the viewer, at the nearest place where the ray of a corner enters the region. None if the
    /// outline encloses nothing, or if all its corners miss the region.
    pub fn cut_along(&self, outline: &[[f64; 2]], keep: KeptSide) -> Option<Cut> {
        let (picker, rays) = (Picker::of(self), &self.rays);
        let corners = simplified(outline.iter().map(|at| DVec2::from(*at)).collect());
        if corners.len() < 3 {
            return None;
        }
        let low = region::framed_low(&self.geometry, &self.settings, self.low, self.high).unwrap_or(self.low);
        let along: Vec<(DVec3, DVec3)> = corners.iter().map(|at| picker.ray(at.to_array())).collect();
        let behind = |place: DVec3| (place - rays.target).dot(rays.forward);
        let entries = along.iter().filter_map(|(origin, direction)| {
            entry(low, self.high, *origin, *direction).map(|away| behind(*origin + *direction * away))
        });
        let nearest = entries.reduce(f64::min)?;
        let eye = behind(rays.origin);
        // An eye within the region is not on the contour's plane: a share of the region away from it, about a millimetre of a head.
        let diagonal = (self.high - self.low).length();
        let nearest = if rays.is_perspective { nearest.max(eye + diagonal / 128.0) } else { nearest };
        let at = rays.target + rays.forward * nearest;
        // The power of ten next to a millionth of the region, a tenth of a micrometre of a head: files stay short.
        let digit = 10f64.powf((diagonal * 1e-6).log10().floor());
        let short = |mm: f64| (mm / digit).round() * digit;
        let contour = along.iter().map(|(origin, direction)| {
            let away = (nearest - behind(*origin)) / direction.dot(rays.forward);
            let from = *origin + *direction * away - at;
            [short(from.dot(rays.right)), short(from.dot(rays.up))]
        });
        let view = CutView {
            at: self.point_of(at),
            direction: rays.forward.to_array(),
            up: rays.up.to_array(),
            eye: rays.is_perspective.then_some(nearest - eye),
        };
        Some(Cut { contour: contour.collect(), view, keep, depth: None, brush: None })
    }

    /// The value that removed texels get so that the rendering draws nothing of them: 0, or 1 where dark matter is drawn. In mode mean they count as
    /// dark matter. None if the rendering draws something of either value.
    pub fn removed_value(&self) -> Option<f64> {
        let is_drawn = |value: f64| {
            let is_composited = self.composites() && {
                let volume = &self.settings.volume;
                let table = transfer::table_of(volume, self.reference_length(), self.transfer_entries());
                let entry = if value > 0.5 { table.last() } else { table.first() };
                entry.is_some_and(|entry| entry[3] > 0.0)
            };
            let is_detected = self.detects_surface()
                && match self.settings.surface.sign {
                    Sign::Bright => value > 0.5,
                    Sign::Dark => value < 0.5,
                    Sign::Any => true,
                };
            let is_kept = self.settings.mode == Mode::MinIp && value < 0.5;
            is_composited || is_detected || is_kept
        };
        [0.0, 1.0].into_iter().find(|value| !is_drawn(*value))
    }

    /// The place in space of a texel of the volume, mm.
    pub fn texel_place(&self, [column, row, slice]: [u32; 3]) -> DVec3 {
        let (x, y) = self.grid.place(f64::from(column), f64::from(row));
        let slice = f64::from(slice);
        match &self.geometry {
            Geometry::Cartesian(grid) => DVec3::new(x, y, grid.origin[2] + slice * grid.spacing[2]),
            Geometry::Sweep(probe) => {
                let fired = self.share_fired(column, row);
                probe.sweep_map(x, y, probe.slices.at(slice) + probe.advance_at(slice) * fired)
            }
        }
    }

    /// Share (0..1) of a frame's lines that fired before the line through a texel of its slice. Beside the sector the nearest line counts.
    pub(crate) fn share_fired(&self, column: u32, row: u32) -> f64 {
        let Some(probe) = self.probe() else { return 0.0 };
        let (x, y) = self.grid.place(f64::from(column), f64::from(row));
        let count = probe.lines.len() as f64;
        probe.plane_indices(x, y).1.clamp(0.0, count - 1.0) / count
    }

    /// True if slices of a sweep are acquired while the motor moves.
    pub(crate) fn moves_in_frames(&self) -> bool {
        self.probe().is_some_and(|probe| {
            let is_moving = (0..self.slices() as usize).any(|slice| probe.advance_of(slice) != 0.0);
            is_moving && !matches!(probe.motion, Motion::Still { .. })
        })
    }
}

/// Distance at which a ray enters a box, mm; 0 within it, none beside it.
fn entry(low: DVec3, high: DVec3, origin: DVec3, direction: DVec3) -> Option<f64> {
    let (a, b) = ((low - origin) / direction, (high - origin) / direction);
    let (enter, leave) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
    (enter <= leave).then_some(enter)
}

/// Distance that a contour may be moved for fewer corners, pixels.
const TOLERANCE: f64 = 0.4;

/// A closed contour with as few corners as its form needs, at most [`MAX_CUT_POINTS`] (Douglas and Peucker 1973); none if it has no extent.
fn simplified(outline: Vec<DVec2>) -> Vec<DVec2> {
    let Some(first) = outline.first().copied() else { return Vec::new() };
    let farthest = |from: DVec2| {
        let away = outline.iter().map(|at| at.distance(from)).enumerate();
        away.max_by(|a, b| a.1.total_cmp(&b.1)).map_or((0, 0.0), |found| found)
    };
    let (middle, extent) = farthest(first);
    if extent < 2.0 {
        return Vec::new();
    }
    let closed: Vec<DVec2> = outline.iter().copied().chain([first]).collect();
    // What lies farthest from the line between two corners becomes a corner, the farthest of all first.
    let span = |from: usize, to: usize| {
        let away = (from + 1..to).map(|n| (n, distance(closed[n], closed[from], closed[to])));
        away.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(n, away)| (away, from, n, to))
    };
    let mut corners = vec![0, middle];
    let mut spans: Vec<_> = [span(0, middle), span(middle, closed.len() - 1)].into_iter().flatten().collect();
    while corners.len() < MAX_CUT_POINTS {
        let widest = spans.iter().enumerate().max_by(|a, b| a.1.0.total_cmp(&b.1.0)).map(|(at, _)| at);
        let Some((away, from, n, to)) = widest.map(|at| spans.swap_remove(at)) else { break };
        if away <= TOLERANCE {
            break;
        }
        corners.push(n);
        spans.extend([span(from, n), span(n, to)].into_iter().flatten());
    }
    corners.sort_unstable();
    corners.into_iter().map(|n| closed[n]).collect()
}

/// Distance of a point from the line between two others.
fn distance(point: DVec2, from: DVec2, to: DVec2) -> f64 {
    let along = to - from;
    let share = ((point - from).dot(along) / along.length_squared().max(1e-30)).clamp(0.0, 1.0);
    point.distance(from + along * share)
}

/// Checks cuts as far as no geometry is needed.
pub(super) fn check(cuts: &[Cut]) -> Result<(), SceneError> {
    if cuts.len() > MAX_CUTS {
        return refuse("cuts", format!("has {} entries, at most {MAX_CUTS}", cuts.len()));
    }
    for (n, cut) in cuts.iter().enumerate() {
        if let Some(brush) = &cut.brush {
            check_brush(n, cut, brush)?;
            continue;
        }
        let count = cut.contour.len();
        if !(3..=MAX_CUT_POINTS).contains(&count) {
            return refuse(
                "cuts.contour",
                format!("entry {}: has {count} corners, must have 3 to {MAX_CUT_POINTS}", n + 1),
            );
        }
        let (direction, up) = (DVec3::from(cut.view.direction), DVec3::from(cut.view.up));
        for (field, vector) in [("cuts.view.direction", direction), ("cuts.view.up", up)] {
            if !vector.is_finite() || !(1e-9..=1e9).contains(&vector.length()) {
                return refuse(field, "must be finite and not zero");
            }
        }
        if direction.normalize().cross(up.normalize()).length() < 1e-6 {
            return refuse("cuts.view.up", "must not be parallel to cuts.view.direction");
        }
    }
    Ok(())
}

fn check_brush(n: usize, cut: &Cut, brush: &Brush) -> Result<(), SceneError> {
    let has_no_view = cut.view == CutView::default();
    if !cut.contour.is_empty() || cut.depth.is_some() || cut.keep != KeptSide::default() || !has_no_view {
        return refuse("cuts.brush", format!("entry {}: has no contour, view, depth and keep", n + 1));
    }
    let count = brush.points();
    if !(1..=MAX_BRUSH_POINTS).contains(&count) || brush.strokes.iter().any(Vec::is_empty) {
        return refuse(
            "cuts.brush.strokes",
            format!("entry {}: has {count} points, must have 1 to {MAX_BRUSH_POINTS}, and one in each stroke", n + 1),
        );
    }
    Ok(())
}

/// Checks whether the settings that remove parts of a rendering can remove anything.
///
/// # Errors
/// The rendering draws both dark and bright matter, so that no value of a texel is invisible.
pub(super) fn check_drawn(scene: &Scene) -> Result<(), SceneError> {
    let removals = [
        (scene.has_cuts(), "cuts", "remove the cuts"),
        (scene.unveils(), "unveil.enabled", "set unveil.enabled=false"),
        (scene.starts_at_curve(), "region.start_curve", "set region.start_curve=none"),
    ];
    match removals.into_iter().find(|(removes, ..)| *removes) {
        Some((_, setting, remedy)) if scene.removed_value().is_none() => refuse(
            setting,
            format!(
                "the rendering draws both what is dark and what is bright, so nothing can be removed from it (surface.sign=dark or any, or a \
                 transfer function that is opaque at 0 and at 1): {remedy}"
            ),
        ),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Settings;

    fn square() -> Cut {
        Cut { contour: vec![[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]], ..Cut::default() }
    }

    fn fault(change: impl Fn(&mut Cut)) -> String {
        let mut wrong = square();
        change(&mut wrong);
        let settings = Settings { cuts: vec![square(), wrong], ..Settings::default() };
        settings.check().expect_err("refused").to_string()
    }

    #[test]
    fn wrong_cuts_are_refused_in_one_line_that_names_the_key() {
        assert!(Settings { cuts: vec![square(); MAX_CUTS], ..Settings::default() }.check().is_ok());
        let many =
            Settings { cuts: vec![square(); MAX_CUTS + 1], ..Settings::default() }.check().expect_err("too many");
        assert_eq!(many.field, "cuts");
        assert!(fault(|cut| cut.contour.truncate(2)).starts_with("scene: cuts.contour: entry 2: has 2 corners"));
        assert!(fault(|cut| cut.contour = vec![[0.0; 2]; 513]).contains("has 513 corners"));
        assert!(fault(|cut| cut.contour[1][0] = f64::NAN).contains("cuts.contour: is NaN"));
        assert!(fault(|cut| cut.view.at[2] = f64::INFINITY).contains("cuts.view.at: is inf"));
        assert!(fault(|cut| cut.view.direction = [0.0; 3]).contains("cuts.view.direction"));
        assert!(fault(|cut| cut.view.up = [f64::NAN; 3]).contains("cuts.view.up"));
        assert!(fault(|cut| cut.view.up = [0.0, -3.0, 0.0]).contains("cuts.view.up: must not be parallel"));
        assert!(fault(|cut| cut.view.eye = Some(0.0)).contains("cuts.view.eye"));
        assert!(fault(|cut| cut.depth = Some(-1.0)).contains("cuts.depth"));
    }

    #[test]
    fn a_cut_is_a_prism_or_a_cone_whose_axes_are_those_of_its_view() {
        let at =
            |cut: &Cut, place: [f64; 3]| CutShape::new(cut, DVec3::new(0.0, 10.0, 0.0)).removes(DVec3::from(place));
        // A triangle that points to the right and up: lateral and elevation, seen from the probe.
        let corner = Cut { contour: vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]], ..Cut::default() };
        assert!(at(&corner, [3.0, 20.0, 1.0]) && at(&corner, [3.0, -90.0, 1.0]));
        assert!(!at(&corner, [1.0, 20.0, 3.0]) && !at(&corner, [-3.0, 20.0, 1.0]) && !at(&corner, [3.0, 20.0, -1.0]));
        let deep = Cut { depth: Some(5.0), ..corner.clone() };
        assert!(at(&deep, [3.0, 15.0, 1.0]) && !at(&deep, [3.0, 15.1, 1.0]) && at(&deep, [3.0, 2.0, 1.0]));
        let inside = Cut { keep: KeptSide::Inside, ..deep.clone() };
        assert!(!at(&inside, [3.0, 15.0, 1.0]) && at(&inside, [1.0, 15.0, 3.0]) && !at(&inside, [1.0, 15.1, 3.0]));
        // The eye is 8 mm in front: twice as far away, all is twice as large.
        let cone = Cut { view: CutView { eye: Some(8.0), ..CutView::default() }, ..corner.clone() };
        assert!(at(&cone, [7.9, 18.0, 1.0]) && !at(&cone, [8.1, 18.0, 1.0]) && !at(&cone, [7.9, 17.0, 1.0]));
        assert!(!at(&cone, [3.0, 1.9, 1.0]), "behind the eye");
        // Any length of direction and up, and an up that is not level.
        let view = CutView { direction: [0.0, 3.0, 0.0], up: [0.0, 0.7, 0.2], ..CutView::default() };
        assert!(at(&Cut { view, ..corner.clone() }, [3.0, 20.0, 1.0]));
    }

    #[test]
    fn a_brush_removes_what_is_within_its_radius_and_wrong_ones_are_refused() {
        let strokes = vec![vec![DVec3::ZERO, DVec3::new(10.0, 0.0, 0.0)], vec![DVec3::new(0.0, 20.0, 0.0)]];
        let brush = BrushShape { radius: 2.0, strokes };
        let holds = |x: f64, y: f64, z: f64| brush.holds(DVec3::new(x, y, z));
        assert!(holds(5.0, 1.9, 0.0) && holds(-1.9, 0.0, 0.0) && holds(11.9, 0.0, 0.0) && holds(0.0, 20.0, -1.9));
        assert!(!holds(5.0, 1.5, 1.5) && !holds(-1.5, 1.5, 0.0) && !holds(0.0, 10.0, 0.0) && !holds(10.0, 20.0, 0.0));
        assert_eq!(brush.bounds(), [DVec3::new(-2.0, -2.0, -2.0), DVec3::new(12.0, 22.0, 2.0)]);
        let fault = |change: &dyn Fn(&mut Cut)| {
            let brush = Some(Brush { radius: 2.0, strokes: vec![vec![[0.0; 3]]] });
            let mut cut = Cut { brush, ..Cut::default() };
            change(&mut cut);
            Settings { cuts: vec![cut], ..Settings::default() }.check().map_err(|fault| fault.to_string())
        };
        let with = |radius: f64, strokes: Vec<Vec<[f64; 3]>>| {
            fault(&|cut| {
                cut.brush = Some(Brush { radius, strokes: strokes.clone() });
            })
        };
        assert_eq!(fault(&|_| ()), Ok(()));
        assert!(fault(&|cut| cut.depth = Some(3.0)).is_err_and(|fault| fault.contains("cuts.brush: entry 1")));
        assert!(with(0.0, vec![vec![[0.0; 3]]]).is_err_and(|fault| fault.contains("cuts.brush.radius")));
        assert!(with(1.0, vec![vec![[f64::NAN; 3]]]).is_err_and(|fault| fault.contains("cuts.brush.strokes")));
        assert!(with(1.0, vec![vec![[0.0; 3]; 513]]).is_err_and(|fault| fault.contains("513")));
        for empty in [vec![], vec![vec![]], vec![vec![[0.0; 3]], vec![]]] {
            assert!(with(1.0, empty).is_err());
        }
    }

    #[test]
    fn a_contour_that_crosses_itself_has_no_holes() {
        // Twice around, and an eight.
        let star: Vec<[f64; 2]> =
            (0..5).map(|n| (f64::from(n) * 4.0 * std::f64::consts::PI / 5.0).sin_cos()).map(|(x, y)| [x, y]).collect();
        let eight = vec![[-2.0, -1.0], [2.0, 1.0], [2.0, -1.0], [-2.0, 1.0]];
        for (contour, inside) in [(star, [[0.0, 0.0], [0.0, 0.8]]), (eight, [[-1.5, 0.1], [1.5, 0.1]])] {
            let shape = CutShape::new(&Cut { contour, ..Cut::default() }, DVec3::ZERO);
            assert!(inside.iter().all(|point| shape.winds_about(DVec2::from(*point))));
            assert!(!shape.winds_about(DVec2::new(0.0, 1.5)));
        }
    }
}
