//! Where the voxels of a Cartesian lattice lie in the world, and in which order its axes are drawn.
//!
//! The world is LPS: x to the patient's left, y to posterior, z to superior, in mm. A volume is drawn along its own axes, which [`Grid`]
//! holds: lateral, depth, elevation. [`World`] stands beside it and places it. Both are right-handed, so that a volume whose axes are
//! left-handed in the world (a mirrored one) is drawn with one axis reversed.

use super::grid::{Geometry, Grid};
use glam::{DAffine3, DMat3, DMat4, DVec3};

/// Largest cosine of the angle between two axes that counts as perpendicular: 0.06 degrees, as files round their matrices.
const MAX_COSINE: f64 = 1e-3;
/// Names of the axes of a stored volume.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Letters of the directions of the world: along x, y and z, and against them.
const LETTERS: [[&str; 2]; 3] = [["left", "right"], ["posterior", "anterior"], ["superior", "inferior"]];

/// Affine map from voxel indices of a volume to world coordinates, mm (LPS).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct World {
    voxel_to_world: DMat4,
}

impl World {
    /// The map of a lattice whose neighbouring voxels are `axes` apart (mm, LPS), with the centre of voxel (0, 0, 0) at `origin`.
    ///
    /// # Errors
    /// One line: a number is not finite, an axis has no length, or the axes are not perpendicular to within 0.06 degrees.
    pub fn new(axes: [DVec3; 3], origin: DVec3) -> Result<World, String> {
        if !(origin.is_finite() && axes.iter().all(|a| a.is_finite())) {
            return Err("holds a number that is not finite".into());
        }
        if axes.iter().any(|a| a.length().is_nan() || a.length() <= 0.0 || !a.length().is_finite()) {
            return Err("has an axis of no length".into());
        }
        let unit = axes.map(|a| a / a.length());
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            let cosine = unit[a].dot(unit[b]);
            if cosine.is_nan() || cosine.abs() > MAX_COSINE {
                let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
                return Err(format!(
                    "has axes {angle:.2} degrees apart, which are only drawn where they are perpendicular"
                ));
            }
        }
        let [x, y, z] = axes.map(|a| a.extend(0.0));
        Ok(World { voxel_to_world: DMat4::from_cols(x, y, z, origin.extend(1.0)) })
    }

    /// The map of a grid whose coordinates are world coordinates already.
    pub fn of(grid: &Grid) -> World {
        World { voxel_to_world: lattice(grid) }
    }

    /// The vector in the world from a voxel to the next one along an axis of the lattice (0 to 2), mm.
    pub fn axis(&self, axis: usize) -> DVec3 {
        self.voxel_to_world.col(axis.min(2)).truncate()
    }

    /// The centre of voxel (0, 0, 0) in the world, mm.
    pub fn origin(&self) -> DVec3 {
        self.voxel_to_world.w_axis.truncate()
    }

    /// The position in the world of a fractional voxel index, mm.
    pub fn at(&self, voxel: DVec3) -> DVec3 {
        self.voxel_to_world.transform_point3(voxel)
    }

    /// The unit vectors along the axes of the lattice in the world, as columns.
    pub fn directions(&self) -> DMat3 {
        DMat3::from_cols(self.axis(0).normalize(), self.axis(1).normalize(), self.axis(2).normalize())
    }

    /// True if the axes of the lattice are left-handed in the world, so that a volume that is drawn along them in this order looks mirrored.
    pub fn is_left_handed(&self) -> bool {
        self.directions().determinant() < 0.0
    }

    /// The map of the same voxels after their axes were put in another order, from indices in that order. `size`: number of voxels along the stored
    /// axes.
    pub fn reordered(&self, order: &AxisOrder, size: [usize; 3]) -> World {
        let mut origin = self.origin();
        let axes = [0, 1, 2].map(|drawn| {
            let stored = order.stored[drawn];
            let step = self.axis(stored);
            if !order.reversed[drawn] {
                return step;
            }
            origin += step * size[stored].saturating_sub(1) as f64;
            -step
        });
        let [x, y, z] = axes.map(|a| a.extend(0.0));
        World { voxel_to_world: DMat4::from_cols(x, y, z, origin.extend(1.0)) }
    }

    /// The grid on which the volume is drawn. Its axes are those of the lattice, and its coordinates are the components of world positions along
    /// these axes. If they point along x, y and z of the world in this order, the coordinates are the world's. `size`: number of voxels along the
    /// axes of the lattice.
    pub fn grid(&self, size: [usize; 3]) -> Grid {
        let spacing = [0, 1, 2].map(|n| self.axis(n).length());
        let origin = self.directions().transpose() * self.origin();
        // No negative zero, which would be shown.
        Grid { size, spacing, origin: origin.to_array().map(|v| v + 0.0) }
    }

    /// The map from voxel indices of `other`, a grid in the same drawn coordinates as `of`, to the world. `of`: the grid whose voxels `self` maps.
    pub fn on(&self, of: &Grid, other: &Grid) -> World {
        if of.spacing == other.spacing && of.origin == other.origin {
            return *self;
        }
        World { voxel_to_world: self.voxel_to_world * lattice(of).inverse() * lattice(other) }
    }

    /// The map from voxel indices of `grid`, which is in the coordinates of a volume with this geometry, to the world. `own`: the map of the volume's
    /// own voxels; the coordinates are the world's where there is none, or for a sweep.
    pub fn resampled(own: Option<World>, geometry: &Geometry, grid: &Grid) -> World {
        match (geometry, own) {
            (Geometry::Cartesian(of), Some(world)) => world.on(of, grid),
            _ => World::of(grid),
        }
    }

    /// The rigid map from the coordinates in which a volume is drawn, mm, to the world. `of`: the grid of its voxels.
    pub fn pose(&self, of: &Grid) -> DAffine3 {
        DAffine3::from_mat4(self.voxel_to_world * lattice(of).inverse())
    }

    /// The map of the voxels of a grid whose drawn coordinates have this pose in the world; None if the pose is not rigid ([`is_rigid`]).
    pub fn posed(pose: &DAffine3, of: &Grid) -> Option<World> {
        is_rigid(pose).then(|| World { voxel_to_world: DMat4::from(*pose) * lattice(of) })
    }

    /// For each axis of the lattice the anatomical direction of the world that it points to most, for example `left` or `superior`.
    pub fn nearest(&self) -> [&'static str; 3] {
        [0, 1, 2].map(|n| {
            let step = self.axis(n);
            let main = largest(step);
            LETTERS[main][usize::from(step[main] < 0.0)]
        })
    }
}

/// Largest entry of R^T R - 1 for which a matrix counts as a rotation: poses come as rounded numbers.
const RIGID_TOLERANCE: f64 = 1e-3;
/// Farthest place of a pose, mm.
const MAX_DISTANCE: f64 = 1e6;

/// True if the matrix is a rotation: its axes are perpendicular to within 0.06 degrees and have length 1 to within 0.05 %.
pub fn is_rotation(turn: &DMat3) -> bool {
    let off = (turn.transpose() * *turn - DMat3::IDENTITY).to_cols_array();
    turn.determinant() > 0.0 && off.iter().all(|v| v.abs() <= RIGID_TOLERANCE)
}

/// True if the map is a rotation ([`is_rotation`]) and a translation of at most 1 km along each axis.
pub fn is_rigid(pose: &DAffine3) -> bool {
    let shift = pose.translation;
    is_rotation(&pose.matrix3) && shift.is_finite() && shift.abs().max_element() <= MAX_DISTANCE
}

/// Voxel indices to the drawn space of a grid, mm.
fn lattice(grid: &Grid) -> DMat4 {
    DMat4::from_translation(DVec3::from(grid.origin)) * DMat4::from_scale(DVec3::from(grid.spacing))
}

/// The component of the largest size.
fn largest(step: DVec3) -> usize {
    (1..3).fold(0, |main, n| if step[n].abs() > step[main].abs() { n } else { main })
}

/// Which stored axes of a Cartesian volume are drawn as lateral, depth and elevation, and in which direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisOrder {
    /// The stored axes (0 is the fastest) that are drawn as lateral, depth and elevation, in this order.
    pub stored: [usize; 3],
    /// For lateral, depth and elevation: true if the axis is drawn from the last index of the stored axis to the first.
    pub reversed: [bool; 3],
}

/// The stored axis that is drawn as depth. Its text is x, y or z, with a minus if depth increases from the last index to the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthAxis {
    axis: usize,
    reversed: bool,
}

impl std::fmt::Display for DepthAxis {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let sign = if self.reversed { "-" } else { "" };
        write!(f, "{sign}{}", AXES[self.axis.min(2)])
    }
}

impl std::str::FromStr for DepthAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<DepthAxis, String> {
        let reversed = text.strip_prefix('-');
        let name = reversed.unwrap_or(text);
        let axis =
            AXES.iter().position(|axis| name.eq_ignore_ascii_case(axis)).ok_or("must be x, y, z, -x, -y or -z")?;
        Ok(DepthAxis { axis, reversed: reversed.is_some() })
    }
}

impl AxisOrder {
    /// The order in which axes are drawn as they are stored.
    pub const STORED: AxisOrder = AxisOrder { stored: [0, 1, 2], reversed: [false; 3] };

    /// An order that keeps the handedness and draws the given stored axis as depth. If depth is stored axis x or y, each drawn slice is one stored
    /// frame ([`AxisOrder::keeps_frames`]).
    pub fn with_depth(depth: DepthAxis) -> AxisOrder {
        let (stored, reversed) = match (depth.axis, depth.reversed) {
            (0, false) => ([1, 0, 2], [true, false, false]),
            (0, true) => ([1, 0, 2], [false, true, false]),
            (1, false) => ([0, 1, 2], [false; 3]),
            (1, true) => ([0, 1, 2], [false, true, true]),
            (_, false) => ([0, 2, 1], [false, false, true]),
            (_, true) => ([0, 2, 1], [false, true, false]),
        };
        AxisOrder { stored, reversed }
    }

    /// The order for an image orientation of the PLUS toolkit: two or three letters, one for each stored axis. M(arked) and U(nmarked) are lateral,
    /// F(ar) and N(ear) depth, A(scending) and D(escending) elevation; U, N and D reverse the axis. A missing third letter is A. None for other
    /// words.
    pub fn of_plus(word: &str) -> Option<AxisOrder> {
        let letters: Vec<char> = word.chars().chain("A".chars().filter(|_| word.len() == 2)).collect();
        let mut order = AxisOrder { stored: [3; 3], reversed: [false; 3] };
        for (stored, letter) in letters.iter().enumerate() {
            // For each drawn axis its two letters, the second of which reverses it.
            let (drawn, reversed) = "MUFNAD".find(*letter).map(|n| (n / 2, n % 2 == 1))?;
            (order.stored[drawn], order.reversed[drawn]) = (stored, reversed);
        }
        (letters.len() == 3 && order.stored.iter().all(|n| *n < 3)).then_some(order)
    }

    /// The stored order with either the lateral or the elevation axis reversed, so that a left-handed lattice becomes right-handed. Of these two, the
    /// first that points against an axis of the world is reversed; if neither does, the lateral axis is.
    pub fn with_other_hand(world: &World) -> AxisOrder {
        let is_against = |n: &usize| {
            let step = world.axis(*n);
            step[largest(step)] < 0.0
        };
        let chosen = [0, 2].into_iter().find(is_against).unwrap_or(0);
        AxisOrder { stored: [0, 1, 2], reversed: [0, 1, 2].map(|n| n == chosen) }
    }

    /// The order that has the effect of this order followed by `next`, whose stored axes are the drawn axes of this order.
    pub fn then(&self, next: &AxisOrder) -> AxisOrder {
        AxisOrder {
            stored: next.stored.map(|n| self.stored[n]),
            reversed: [0, 1, 2].map(|n| next.reversed[n] != self.reversed[next.stored[n]]),
        }
    }

    /// True if each drawn slice is one stored frame; only the order of its pixels may differ.
    pub fn keeps_frames(&self) -> bool {
        self.stored[2] == 2
    }

    /// The size of a volume in drawn order, from its size in stored order.
    pub fn size(&self, stored: [usize; 3]) -> [usize; 3] {
        self.stored.map(|axis| stored[axis])
    }

    /// The stored axes in drawn order as text, for example "x, -z, y"; a minus means reversed.
    pub fn names(&self) -> String {
        let name = |n: usize| DepthAxis { axis: self.stored[n], reversed: self.reversed[n] }.to_string();
        [0, 1, 2].map(name).join(", ")
    }

    /// Puts the voxels of a stored block into drawn order. `bytes`: the complete block of `size` voxels in stored order, `width` bytes each.
    pub fn reorder(&self, bytes: &[u8], size: [usize; 3], width: usize) -> Vec<u8> {
        let stride = [1, size[0], size[0] * size[1]];
        let [columns, rows, slices] = self.size(size);
        let step = |n: usize, index: usize, count: usize| {
            stride[self.stored[n]] * if self.reversed[n] { count - 1 - index } else { index }
        };
        let mut out = Vec::with_capacity(bytes.len());
        for k in 0..slices {
            for j in 0..rows {
                let row = step(2, k, slices) + step(1, j, rows);
                for i in 0..columns {
                    let at = (row + step(0, i, columns)) * width;
                    out.extend_from_slice(bytes.get(at..at + width).unwrap_or_default());
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { size: [4, 3, 2], spacing: [0.5, 1.0, 2.0], origin: [-3.0, 7.0, 11.0] };

    #[test]
    fn axes_along_the_world_keep_its_coordinates_exactly() {
        let world = World::of(&GRID);
        assert_eq!((world.grid(GRID.size), world.is_left_handed()), (GRID, false));
        assert_eq!(world.at(DVec3::new(2.0, 1.0, 1.0)), DVec3::new(-2.0, 8.0, 13.0));
        assert_eq!(world.nearest(), ["left", "posterior", "superior"]);
    }

    #[test]
    fn a_reordered_lattice_has_each_voxel_where_it_was() {
        let turned = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
        let axes = [turned.x_axis * 0.5, turned.y_axis, turned.z_axis * -2.0];
        let world = World::new(axes, DVec3::new(-30.0, 7.0, 110.0)).unwrap();
        assert!(world.is_left_handed());
        for text in ["x", "y", "z", "-x", "-y", "-z"] {
            let order = AxisOrder::with_depth(text.parse().unwrap());
            let drawn = world.reordered(&order, GRID.size);
            assert!(drawn.is_left_handed(), "a depth axis does not change the hand: {text}");
            let order = order.then(&AxisOrder::with_other_hand(&drawn));
            let drawn = world.reordered(&order, GRID.size);
            assert!(!drawn.is_left_handed());
            // Each voxel holds its own index.
            let all: Vec<u8> = (0..24).collect();
            let moved = order.reorder(&all, GRID.size, 1);
            let size = order.size(GRID.size);
            for (n, stored) in moved.iter().map(|v| usize::from(*v)).enumerate() {
                let cell = |n: usize, size: [usize; 3]| {
                    DVec3::new((n % size[0]) as f64, (n / size[0] % size[1]) as f64, (n / (size[0] * size[1])) as f64)
                };
                let (there, here) = (world.at(cell(stored, GRID.size)), drawn.at(cell(n, size)));
                assert!(there.distance(here) < 1e-9, "{text}: voxel {n}");
            }
            let grid = drawn.grid(size);
            let back = drawn.directions() * (DVec3::from(grid.origin));
            assert!(back.distance(drawn.origin()) < 1e-9);
        }
    }

    /// The letters of PLUS's igsioCommon.h: the direction of each stored axis.
    #[test]
    fn plus_orientations_are_marked_far_ascending() {
        let order = |word: &str| AxisOrder::of_plus(word).map(|order| order.names());
        let shown = [("MF", "x, y, z"), ("UF", "-x, y, z"), ("MN", "x, -y, z"), ("UN", "-x, -y, z")];
        for (word, names) in shown.into_iter().chain([("UND", "-x, -y, -z"), ("AMF", "y, z, x"), ("FMA", "y, x, z")]) {
            assert_eq!(order(word).as_deref(), Some(names), "{word}");
        }
        for word in ["", "M", "MM", "MFAA", "MUA", "XX", "mf"] {
            assert_eq!(order(word), None, "{word}");
        }
    }

    #[test]
    fn only_perpendicular_axes_of_a_length_are_a_world() {
        let at = |x: DVec3| World::new([x, DVec3::Y, DVec3::Z], DVec3::ZERO);
        assert!(at(DVec3::new(1.0, 5e-4, 0.0)).is_ok());
        for bad in [DVec3::ZERO, DVec3::NAN, DVec3::Y, DVec3::new(1.0, 2e-3, 0.0), DVec3::splat(1e300)] {
            assert!(at(bad).is_err(), "{bad}");
        }
        assert!(World::new([DVec3::X, DVec3::Y, DVec3::Z], DVec3::INFINITY).is_err());
    }

    #[test]
    fn a_pose_is_the_world_without_its_lattice_and_nothing_but_rigid() {
        let turned = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
        let world = World::new([turned.x_axis, turned.y_axis * 0.4, turned.z_axis], DVec3::new(5.0, 6.0, 7.0)).unwrap();
        let grid = Grid { origin: [1.0, -2.0, 30.0], ..world.grid([9, 9, 9]) };
        let pose = world.pose(&grid);
        let back = World::posed(&pose, &grid).expect("rigid");
        for voxel in [DVec3::ZERO, DVec3::new(8.0, 3.0, 5.0)] {
            assert!(back.at(voxel).distance(world.at(voxel)) < 1e-9);
        }
        assert_eq!(World::of(&GRID).pose(&GRID), DAffine3::IDENTITY);
        let scaled = DAffine3::from_scale(DVec3::splat(1.01));
        let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        for wrong in [scaled, mirrored, DAffine3::NAN, DAffine3::from_translation(DVec3::splat(1e9))] {
            assert_eq!(World::posed(&wrong, &grid), None, "{wrong:?}");
        }
    }

    #[test]
    fn another_lattice_in_the_same_space_has_the_same_world() {
        let turned = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
        let world = World::new([turned.x_axis, turned.y_axis * 0.4, turned.z_axis], DVec3::new(5.0, 6.0, 7.0)).unwrap();
        let own = world.grid([9, 9, 9]);
        let finer = Grid { size: [17; 3], spacing: [0.5, 0.2, 0.5], origin: own.origin };
        let there = world.on(&own, &finer);
        assert!(there.at(DVec3::new(4.0, 6.0, 2.0)).distance(world.at(DVec3::new(2.0, 3.0, 1.0))) < 1e-9);
        assert_eq!(world.on(&own, &own), world);
    }
}
