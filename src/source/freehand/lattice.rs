//! The grid of a freehand volume, and where it is.

use super::{CompoundingOptions, PixelRange, Pose};
use crate::probe::{Grid, World};
use glam::{DAffine3, DMat3, DVec3};

/// Largest number of voxels along an edge: the limit of 3D textures on most devices.
pub(super) const MAX_EDGE: f64 = 2048.0;
/// Most steps of making the spacing coarser. Each step removes most of the excess.
const COARSENING_STEPS: usize = 64;

/// The grid of a freehand volume, and its pose in the space of the tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    pub grid: Grid,
    /// Map from the tracker's space to the volume's coordinates, mm: a rotation and a translation.
    pub to_volume: DAffine3,
}

impl Lattice {
    /// Map from the voxels to the tracker's space.
    ///
    /// # Errors
    /// One line: the axes or the origin of the voxels in the tracker's space are such that [`World::new`] refuses them.
    pub fn world(&self) -> Result<World, String> {
        let back = self.to_volume.inverse();
        let (spacing, origin) = (self.grid.spacing, self.grid.origin.into());
        let axes = [0, 1, 2].map(|n| back.matrix3.col(n) * spacing[n]);
        World::new(axes, back.transform_point3(origin))
    }

    /// The lattice that contains the clipped part of the frames with these poses, and a margin of `options.margin`. Invalid poses are ignored.
    ///
    /// Its axes are the mean of the frames' axes: lateral along the rows, depth along the columns and perpendicular to lateral, elevation along the
    /// normal (lateral x depth). Along the normal it is at least `options.extent` long, without the margin. The origin of the volume's coordinates is
    /// the mean of the centres of the frames' first clipped rows, as if that were the face of the probe. The spacing is that of the options,
    /// otherwise the distance of pixels along rows and columns, and the larger of both along the normal. It is made coarser until there are at most
    /// `options.max_voxels` voxels, and at most 2048 along an edge.
    ///
    /// # Errors
    /// One line: no valid pose, an option out of its range, or no spacing that is coarse enough.
    pub fn around(poses: &[Pose], options: &CompoundingOptions) -> Result<Lattice, String> {
        let length = |what, mm: f64, least: f64| match (least..=1e6).contains(&mm) {
            true => Ok(()),
            false => Err(format!("{what} {mm} mm: must be a length of at most 1e6 mm")),
        };
        length("margin", options.margin, 0.0)?;
        options.spacing.map_or(Ok(()), |mm| length("spacing", mm, 1e-6))?;
        options.extent.map_or(Ok(()), |mm| length("extent", mm, 0.0))?;
        let placed: Vec<_> = poses
            .iter()
            .filter(|pose| pose.check().is_ok())
            .filter_map(|pose| pose.clipped(options.clip).ok().map(|clip| (pose, clip)))
            .collect();
        let Some((first, _)) = placed.first() else {
            let why = |pose: &Pose| pose.check().err().or_else(|| pose.clipped(options.clip).err());
            let why = poses.first().and_then(why).map_or(String::new(), |why| format!(", the first: {why}"));
            return Err(format!("none of {} poses places a frame{why}", poses.len()));
        };
        let mean = |of: &dyn Fn(&Pose, PixelRange) -> DVec3| {
            placed.iter().map(|(pose, clip)| of(pose, *clip)).sum::<DVec3>() / placed.len() as f64
        };
        let [right, down] = [|pose: &Pose| pose.to_space.matrix3.x_axis, |pose: &Pose| pose.to_space.matrix3.y_axis];
        let rotation = axes(mean(&|p, _| right(p).normalize()), mean(&|p, _| down(p).normalize()))
            .or_else(|| axes(right(first).normalize(), down(first).normalize()))
            .unwrap_or(DMat3::IDENTITY);
        let origin = mean(&|pose, [columns, rows]| pose.place((columns.0 + columns.1 - 1) as f64 / 2.0, rows.0 as f64));
        let to_volume = DAffine3::from_mat3(rotation.transpose()) * DAffine3::from_translation(-origin);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in placed.iter().flat_map(|(pose, clip)| pose.corners(*clip)) {
            let corner = to_volume.transform_point3(corner);
            (low, high) = (low.min(corner), high.max(corner));
        }
        if let Some(beyond) = options.extent.map(|extent| extent - (high.z - low.z)).filter(|beyond| *beyond > 0.0) {
            let height = |(pose, _): &(&Pose, PixelRange)| to_volume.transform_point3(pose.place(0.0, 0.0)).z;
            // Pictures that do not move do not say whereto they will: to either side.
            match placed.first().map(height).zip(placed.last().map(height)).map_or(0.0, |(from, to)| to - from) {
                0.0 => (low.z, high.z) = (low.z - beyond / 2.0, high.z + beyond / 2.0),
                up if up > 0.0 => high.z += beyond,
                _ => low.z -= beyond,
            }
        }
        let pitch = [mean(&|p, _| DVec3::splat(right(p).length())).x, mean(&|p, _| DVec3::splat(down(p).length())).x];
        let spacing = match options.spacing {
            Some(mm) => DVec3::splat(mm),
            None => DVec3::new(pitch[0], pitch[1], pitch[0].max(pitch[1])),
        };
        let grid = grid(low - options.margin, high + options.margin, spacing, options.max_voxels)?;
        grid.check().map_err(|e| format!("{} {}", e.field, e.fault))?;
        Ok(Lattice { grid, to_volume })
    }
}

/// Orthogonal axes, as columns: the first one is kept, the second is as near to `down` as possible. None if a vector is almost zero, as the
/// mean of frames that point in all directions.
fn axes(right: DVec3, down: DVec3) -> Option<DMat3> {
    const LEAST: f64 = 5e-4;
    let x = right.try_normalize().filter(|_| right.length() > LEAST)?;
    let y = down - x * down.dot(x);
    let y = y.try_normalize().filter(|_| y.length() > LEAST)?;
    Some(DMat3::from_cols(x, y, x.cross(y)))
}

/// The grid from corner `low` to corner `high`, mm, with `spacing` (mm) made coarser until there are at most `most` voxels, and at most 2048 along
/// an edge.
///
/// # Errors
/// One line: no spacing is coarse enough.
pub(super) fn grid(low: DVec3, high: DVec3, mut spacing: DVec3, most: usize) -> Result<Grid, String> {
    let most = most.max(1) as f64;
    for _ in 0..COARSENING_STEPS {
        // The outermost voxels are within a quarter of the spacing of the ends.
        let count = ((high - low) / spacing).round() + 1.0;
        let (all, along) = (count.element_product(), count.max_element());
        if all <= most && along <= MAX_EDGE {
            let size = count.to_array().map(|n| n as usize);
            let origin = (low + high - (count - 1.0) * spacing) / 2.0;
            return Ok(Grid { size, spacing: spacing.to_array(), origin: origin.to_array() });
        }
        spacing *= (all / most).cbrt().max(along / MAX_EDGE).max(1.001);
    }
    Err(format!("no spacing makes {most} voxels or fewer of {:.1} mm", high - low))
}
