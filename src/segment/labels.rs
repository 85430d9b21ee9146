//! A label for each voxel of a lattice, and the brush that edits it.

use crate::lattice::{self, Region, nearest, voxel};
use crate::memory;
use crate::probe::{Grid, World};
use glam::{DAffine3, DVec3};

/// The label of each voxel of a grid; 0 is none. A voxel counts as inside a shape if its centre is.
#[derive(Clone, Debug, PartialEq)]
pub struct Labels {
    grid: Grid,
    world: World,
    voxels: Vec<u8>,
}

/// Which voxels around its centre a [`Brush`] paints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// All whose distance is at most the radius.
    Ball,
    /// Those within the radius whose distance from the plane through the centre with this unit normal is at most half of the thickness, mm.
    Disc { normal: DVec3, thickness: f64 },
}

/// A stroke of a brush: a ball or disc whose centre moves along a straight line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brush {
    /// Where the centre starts, and in `to` where it ends, mm, in the coordinates of the grid of [`Labels`].
    pub from: DVec3,
    pub to: DVec3,
    /// Radius of the ball or disc, mm.
    pub radius: f64,
    pub shape: Shape,
}

/// The labels of a box of voxels as they were before a change.
#[derive(Clone, Debug)]
pub struct Patch {
    region: Region,
    voxels: Vec<u8>,
}

impl Patch {
    /// Memory of the patch, bytes: one for each voxel of the box.
    pub fn bytes(&self) -> usize {
        self.voxels.len()
    }
}

impl Labels {
    /// A grid without labels. `world`: map from its voxels to the world.
    ///
    /// # Errors
    /// One line: the grid is not valid, or takes more memory than is allowed.
    pub fn new(grid: Grid, world: World) -> Result<Labels, String> {
        let voxels = lattice::voxels(&grid)?;
        memory::check(voxels as u64).map_err(|why| format!("a label volume {why}"))?;
        Ok(Labels { grid, world, voxels: vec![0; voxels] })
    }

    /// A grid with these labels, one for each voxel; x is the fastest axis. `world`: map from its voxels to the world.
    ///
    /// # Errors
    /// One line: the grid is not valid, or the number of labels is not that of its voxels.
    pub fn of(grid: Grid, world: World, voxels: Vec<u8>) -> Result<Labels, String> {
        match lattice::voxels(&grid)? {
            count if count == voxels.len() => Ok(Labels { grid, world, voxels }),
            count => Err(format!("{} labels do not fill {count} voxels", voxels.len())),
        }
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    pub fn world(&self) -> &World {
        &self.world
    }

    /// The label of each voxel; x is the fastest axis.
    pub fn voxels(&self) -> &[u8] {
        &self.voxels
    }

    /// Sets the label of the voxels of a stroke; 0 removes it. With `only`, only voxels that have this label are changed. Returns how many
    /// changed.
    pub fn paint(&mut self, brush: &Brush, label: u8, only: Option<u8>) -> usize {
        let reach = DVec3::splat(brush.radius);
        let within = [brush.from.min(brush.to) - reach, brush.from.max(brush.to) + reach];
        let Some(region) = Region::within(&self.grid, within) else { return 0 };
        let mut changed = 0;
        for (n, place) in region.places(&self.grid) {
            let voxel = &mut self.voxels[n];
            if *voxel != label && only.is_none_or(|only| *voxel == only) && brush.has(place) {
                *voxel = label;
                changed += 1;
            }
        }
        changed
    }

    /// Sets the label of the voxels with these linear indices; x is the fastest axis.
    pub fn set(&mut self, voxels: &[u32], label: u8) {
        voxels.iter().for_each(|n| self.voxels[*n as usize] = label);
    }

    /// Linear indices (x is the fastest axis) of those voxels of another lattice, of `size` voxels, whose centres lie in a labelled voxel of this
    /// one. `to_place`: map from the index (x, y, z) of a voxel of the other lattice to its place in the coordinates of this grid, mm.
    pub fn sampled(&self, size: [usize; 3], to_place: DAffine3) -> Vec<u32> {
        let Grid { size: own, spacing, origin } = self.grid;
        let to_index =
            DAffine3::from_scale(DVec3::from(spacing).recip()) * DAffine3::from_translation(-DVec3::from(origin));
        let to_own = to_index * to_place;
        let is_labelled = |n: &usize| {
            let at = to_own.transform_point3(DVec3::from(voxel(*n, size).map(|i| i as f64)));
            nearest(own, at).is_some_and(|n| self.voxels[n] > 0)
        };
        (0..size.iter().product()).filter(is_labelled).map(|n| n as u32).collect()
    }

    /// The labels of `self` in the smallest box around all voxels whose label is another one in `after`, which must have the same grid. None if no
    /// label differs.
    pub fn before(&self, after: &Labels) -> Option<Patch> {
        let width = self.grid.size[0];
        let rows = self.voxels.chunks_exact(width).zip(after.voxels.chunks_exact(width)).enumerate();
        let mut ends = Vec::new();
        for (n, (old, new)) in rows.filter(|(_, (old, new))| old != new) {
            let differs = |x: &usize| old[*x] != new[*x];
            let both = [(0..width).find(differs), (0..width).rfind(differs)];
            ends.extend(both.into_iter().flatten().map(|x| (n * width + x) as u32));
        }
        let region = (!ends.is_empty()).then(|| Region::around(&ends, &self.grid, 0.0))?;
        Some(Patch { region, voxels: region.indices(self.grid.size).map(|n| self.voxels[n]).collect() })
    }

    /// Exchanges the labels in the box of a patch with those that the patch holds, so that a second exchange restores the labels.
    pub fn exchange(&mut self, patch: &mut Patch) {
        let there = patch.region.indices(self.grid.size);
        there.zip(&mut patch.voxels).for_each(|(n, voxel)| std::mem::swap(&mut self.voxels[n], voxel));
    }
}

impl Brush {
    fn has(&self, place: DVec3) -> bool {
        let along = self.to - self.from;
        let share = (place - self.from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
        let off = place - (self.from + along * share.clamp(0.0, 1.0));
        let is_near = off.length() <= self.radius;
        match self.shape {
            Shape::Ball => is_near,
            Shape::Disc { normal, thickness } => is_near && off.dot(normal).abs() <= thickness / 2.0,
        }
    }
}
