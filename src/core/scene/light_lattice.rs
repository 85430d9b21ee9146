//! The light volume: its lattice of cells over the region, and the directions and colours of the lights that go through it.

use super::region::is_still;
use super::{Compositing, Follows, LightVolume, Scene};
use glam::DVec3;

/// Edge of a cell where no setting says another, in standard deviations of the volume's smoothing: docs/experiments/light-volume.md.
const CELL: f64 = 0.5;
/// The least such edge, slice pixels: smaller cells show nothing more.
const LEAST_PIXELS: f64 = 1.0;
/// Most cells along an edge of the lattice.
const MAX_ALONG: f64 = 1024.0;
/// Width of the nearest place of a cone of ambient light, as a share of the reach; each of the others is twice as wide, and twice as far away.
const CONE_WIDTH: f64 = 0.08;
/// Levels of the pyramid, from 0, whose cells the nearest place may have.
const NARROWEST: [f64; 2] = [-4.0, 3.0];

/// The lattice of cubic cells of the light volume, over the rendered box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightLattice {
    /// Lower corner of the first cell, mm in space.
    pub low: DVec3,
    /// Edge of a cell, mm.
    pub cell: f64,
    /// Number of cells along each axis; even.
    pub count: [u32; 3],
    /// Size of the rendered box, mm. On each side of it the cells reach beyond it by the same length, which is less than one cell.
    pub extent: DVec3,
}

impl LightLattice {
    /// The share (0..1) of the outermost of `count` cells of `cell` mm along an axis that lies within the rendered box.
    pub(crate) fn outer_share(&self, axis: usize, count: u32, cell: f64) -> f64 {
        let beyond = f64::from(count) * cell - self.extent[axis];
        let sides = if count == 1 { 1.0 } else { 2.0 };
        (1.0 - beyond / (sides * cell)).clamp(0.0, 1.0)
    }

    /// The place in space, mm, of a position in cells: cell n reaches from n to n + 1.
    pub fn place(&self, cells: [f64; 3]) -> DVec3 {
        self.low + DVec3::from(cells) * self.cell
    }
}

/// The levels of the pyramid of densities in which cones of ambient light are sampled, at four positions along each cone. The cells of the level for
/// a position are as wide as the cone there, so that another lattice has the same cones. Cones narrower or wider than the cells of every level are
/// sampled in the finest or the coarsest one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbientCones {
    /// Level (0 is the finest of the pyramid) for the position nearest to the lit cell. It is negative if the cone is narrower there than the finest
    /// cells; level 0 then takes its place.
    pub narrowest: i32,
    /// Weight (0..1) of the next coarser level in the mixture of a level with it. The mixture has the variance of the cone's width.
    pub wider: f64,
}

impl AmbientCones {
    /// `reach`: length of a cone; `cell`: edge of the lattice's cells, in the same unit. Those of level 0 are twice as long.
    fn new(reach: f64, cell: f64) -> AmbientCones {
        let [least, most] = NARROWEST;
        let level = (CONE_WIDTH * reach / (2.0 * cell)).log2().clamp(least, most);
        // What rounding leaves between two levels is one of them.
        let whole = (level + 1e-9).floor();
        // Variances of widths add up, so that of the mixture is the cone's: (1 - m) w^2 + m (2 w)^2 = (2^f w)^2.
        let wider = if level - whole < 1e-9 { 0.0 } else { (4f64.powf(level - whole) - 1.0) / 3.0 };
        AmbientCones { narrowest: whole as i32, wider }
    }

    /// Level of the pyramid for position `n` along a cone, 0 to 3 from the lit cell on; at least 0, which is the finest.
    pub fn level(&self, n: i32) -> u32 {
        (self.narrowest + n).max(0) as u32
    }

    /// Number of levels that the pyramid needs for all positions, including the next coarser level of the farthest one.
    pub fn levels(&self) -> u32 {
        1 + self.level(4).max(1)
    }
}

/// How light goes through the lattice: from layer to layer of cells along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Propagation {
    /// The axis (0, 1 or 2) whose direction is nearest to that of the light. The layers are perpendicular to it.
    pub axis: usize,
    /// True if the light comes from the upper end of that axis.
    pub(crate) from_high: bool,
    /// Offset along the other two axes, in cells and in the order of the axes, from a place to where its light crosses the neighbouring layer on the
    /// side of the light.
    pub shift: [f64; 2],
    /// Length of the light's path through one layer, cells.
    pub path: f64,
}

impl Propagation {
    /// The propagation of a light in the direction `towards`, a unit vector in space that points from matter to the light.
    pub fn new(towards: DVec3) -> Propagation {
        let sizes = towards.abs();
        // The axis nearest to the direction; of equal ones the last, which `max_by` returns.
        let axis = (0..3).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b])).unwrap_or(2);
        let others = match axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let along = sizes[axis];
        Propagation {
            axis,
            from_high: towards[axis] > 0.0,
            shift: others.map(|other| towards[other] / along),
            path: 1.0 / along,
        }
    }
}

/// Ratios of red and blue light to green in tissue at a warmth of 1: of the extinction, of the extinction of the back light, and of the distance
/// over which it is scattered. Chosen by eye.
const EXTINCTION: [f64; 3] = [0.557, 1.0, 1.286];
const BACK_EXTINCTION: [f64; 3] = [0.2, 0.7, 1.4];
const SCATTER: [f64; 3] = [1.78, 1.0, 0.667];
/// Powers of the share of ambient light that arrives, and the ratio of its extinction to that of green light: it comes from all sides.
const AMBIENT_POWERS: [f64; 3] = [1.0, 1.35, 1.55];
const AMBIENT_EXTINCTION: f64 = 0.7;

impl LightVolume {
    /// Extinction of red, green and blue light in matter of density 1, 1/mm.
    pub fn extinction(&self) -> [f64; 3] {
        EXTINCTION.map(|ratio| ratio.powf(self.warmth) / self.depth)
    }

    /// Extinction of red, green and blue back light in matter of density 1, 1/mm.
    pub(crate) fn back_extinction(&self) -> [f64; 3] {
        let [_, green, _] = BACK_EXTINCTION;
        BACK_EXTINCTION.map(|ratio| green * (ratio / green).powf(self.warmth) / self.depth)
    }

    /// Extinction of ambient light of any colour in matter of density 1, 1/mm.
    pub(crate) fn ambient_extinction(&self) -> f64 {
        AMBIENT_EXTINCTION / self.depth
    }

    /// Exponents for red, green and blue of the share of ambient light that arrives at a cell; they give ambient light its warmth.
    pub(crate) fn ambient_powers(&self) -> [f64; 3] {
        AMBIENT_POWERS.map(|power| 1.0 + self.warmth * (power - 1.0))
    }

    /// Standard deviations over which tissue scatters red, green and blue light, mm.
    pub(crate) fn scatter_deviations(&self) -> [f64; 3] {
        SCATTER.map(|ratio| ratio.powf(self.warmth) * self.scatter)
    }
}

impl Scene {
    /// The settings of the light volume, if it lights something that is composited. None if they are absent, if nothing is composited, or for a still
    /// ([`Scene::still`]), which computes light itself.
    pub fn lit_by_volume(&self) -> Option<LightVolume> {
        self.settings.light.volume.filter(|_| self.composites() && self.still().is_none())
    }

    /// The lattice of the light volume over the rendered box. Cells are larger than requested where there would be too many.
    pub fn light_lattice(&self) -> LightLattice {
        let low = self.volume_view().low;
        let extent = self.high - low;
        let cell = self.wanted_cell().max(self.fitting_cell()).max(extent.max_element() / MAX_ALONG);
        // The slack is that of rounding: 120 mm are 20 cells of 6 mm, in any unit.
        let count: [u32; 3] = std::array::from_fn(|a| 2 * ((extent[a] / cell / 2.0 - 1e-9).ceil().max(1.0) as u32));
        let size = DVec3::from(count.map(f64::from)) * cell;
        LightLattice { low: low - (size - extent) / 2.0, cell, count, extent }
    }

    /// Edge of a cell that is asked for, mm: the setting, or what resolves the volume as it is smoothed.
    fn wanted_cell(&self) -> f64 {
        let light = self.settings.light.volume.unwrap_or_default();
        light.cell.unwrap_or_else(|| (CELL * self.least_smoothing()).max(LEAST_PIXELS * self.reference_length()))
    }

    /// Edge of a cell of the lattice that has as many as it may have, mm. A tenth more, since counts are rounded up.
    fn fitting_cell(&self) -> f64 {
        let extent = self.high - self.volume_view().low;
        let most = self.settings.light.volume.unwrap_or_default().cells;
        (1.1 * extent.x * extent.y * extent.z / f64::from(most)).cbrt()
    }

    /// The smaller of the standard deviations that the volume is smoothed with within slices, mm.
    pub(super) fn least_smoothing(&self) -> f64 {
        let [lateral, depth, _] = self.smoothing();
        (lateral * self.grid.pitch[0]).min(depth * self.grid.pitch[1])
    }

    /// A line on the lattice of the light volume and why it has this size, for `--explain`. None if the scene has no light volume.
    pub(crate) fn light_choice(&self) -> Option<String> {
        let light = self.lit_by_volume()?;
        let (LightLattice { cell, count: [x, y, z], .. }, wanted) = (self.light_lattice(), self.wanted_cell());
        let asked = match light.cell {
            Some(_) => "as set".to_string(),
            None if wanted > LEAST_PIXELS * self.reference_length() => {
                format!("{CELL} of the smoothing's standard deviation, {:.3} mm", self.least_smoothing())
            }
            None => format!("a slice pixel, {:.3} mm", self.reference_length()),
        };
        let why = match (cell > wanted, cell > self.fitting_cell()) {
            (false, _) => asked,
            (true, false) => {
                format!("at most {} (light.volume.cells) force larger ones than {wanted:.3} mm, {asked}", light.cells)
            }
            (true, true) => format!("at most {MAX_ALONG} along an edge force larger ones than {wanted:.3} mm, {asked}"),
        };
        Some(format!("light volume: {x} x {y} x {z} cells of {cell:.3} mm, {}: {why}", x * y * z))
    }

    /// The smallest edge of the lattice's cells, mm, with which the pyramid has cells as narrow as the cones of ambient light need.
    pub(crate) fn least_cell_of_cones(&self) -> f64 {
        CONE_WIDTH * self.settings.light.volume.unwrap_or_default().reach / 2.0 / NARROWEST[1].exp2()
    }

    /// The levels of the pyramid through which ambient light is computed.
    pub fn ambient_cones(&self) -> AmbientCones {
        let light = self.settings.light.volume.unwrap_or_default();
        AmbientCones::new(light.reach, self.light_lattice().cell)
    }

    /// Number of consecutive steps of a ray that share the light of the light volume at their middle. It is 2 if all steps have the same length and
    /// one sample each, and two together are no longer than a cell; otherwise, and without a light volume, it is 1.
    pub fn lit_steps(&self) -> u32 {
        let has_one_sample = matches!(self.settings.volume.compositing, Compositing::Riemann | Compositing::Corrected);
        let is_fine = !self.spreads() && 2.0 * self.step <= self.light_lattice().cell;
        if self.lit_by_volume().is_some() && has_one_sample && is_fine { 2 } else { 1 }
    }

    /// Converts a direction from the axes that `light.follows` names to space; a unit vector.
    pub(crate) fn light_direction(&self, direction: DVec3) -> DVec3 {
        let v = direction.normalize();
        match self.settings.light.follows {
            Follows::Camera => self.rays.out_of_camera(v),
            // A camera that is not turned looks along depth, elevation is up; at a single frame it looks along elevation, depth is down.
            Follows::Region if is_still(&self.geometry) => DVec3::new(v.x, -v.y, -v.z),
            Follows::Region => DVec3::new(v.x, -v.z, v.y),
        }
    }

    /// Length over which matter fades towards the faces of the region, except the one nearest to the probe, mm. None if it does not fade.
    pub fn region_fade(&self) -> Option<f64> {
        Some(self.settings.region.fade).filter(|fade| *fade > 0.0)
    }

    /// Factor (0..1) by which matter at a place in space, mm, fades near the faces of the region, except the one nearest to the probe. It is 1
    /// without a fade.
    pub fn faded(&self, place: DVec3) -> f64 {
        let Some(fade) = self.region_fade() else { return 1.0 };
        let (low, high) = (place - self.volume_view().low, self.high - place);
        // Edges and corners are round.
        let to_faces = DVec3::new(low.x.min(high.x), high.y, low.z.min(high.z));
        let t = (1.0 - (1.0 - to_faces / fade).max(DVec3::ZERO).length()).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_goes_across_the_axis_that_it_is_nearest_to() {
        let towards = DVec3::new(-0.6, -0.48, 0.64);
        let found = Propagation::new(towards);
        assert_eq!((found.axis, found.from_high), (2, true));
        let expected = [-0.6 / 0.64, -0.48 / 0.64];
        assert!((0..2).all(|i| (found.shift[i] - expected[i]).abs() < 1e-12), "{found:?}");
        assert!((found.path - 1.0 / 0.64).abs() < 1e-12);
        let found = Propagation::new(DVec3::NEG_Y);
        assert_eq!((found.axis, found.from_high, found.shift, found.path), (1, false, [0.0, 0.0], 1.0));
    }

    #[test]
    fn red_light_goes_deepest_and_a_warmth_of_0_is_grey() {
        let warm = LightVolume::default();
        for [red, green, blue] in [warm.extinction(), warm.back_extinction()] {
            assert!(red < green && green < blue);
        }
        let grey = LightVolume { warmth: 0.0, ..warm };
        assert_eq!(grey.extinction(), [1.0 / 1.4; 3]);
        assert_eq!(grey.ambient_powers(), [1.0; 3]);
        assert_eq!(grey.scatter_deviations(), [grey.scatter; 3]);
    }
}
