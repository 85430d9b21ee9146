//! The volume around tracked frames: which way its axes point, and how far it goes.

use super::CompoundingOptions;
use super::pose::{Part, Pose};
use crate::probe::Grid;
use glam::{DAffine3, DMat3, DVec3};

/// Most voxels along an edge: what 3D textures have on most devices.
const MOST_ALONG: f64 = 2048.0;
/// Steps in which the spacing is made coarser; each takes most of what is too much.
const STEPS: usize = 64;

/// Where the voxels of a volume lie in the tracker's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    pub grid: Grid,
    /// From the tracker's space to the volume's, mm: a turn and a shift.
    pub to_volume: DAffine3,
}

impl Lattice {
    /// A lattice in the tracker's own axes.
    pub fn straight(grid: Grid) -> Lattice {
        Lattice { grid, to_volume: DAffine3::IDENTITY }
    }

    /// The lattice that holds some frames, `options.margin` around them.
    ///
    /// Its axes are the mean of theirs: lateral along the rows, depth down the columns and at a right angle to it, elevation along the
    /// normal (lateral x depth). The origin is the mean of the middles of their first rows, as if the probe's face were there. What the clip
    /// leaves out does not count. The distance of voxels is what was asked for, otherwise that of pixels along rows and columns and the
    /// larger of both along the normal; all three are made coarser until there are no more than `options.most_voxels`, and 2048 along
    /// an edge. Poses that place no frame are left out.
    ///
    /// # Errors
    /// No pose is left, or no length, or nothing coarse enough; in words.
    pub fn around(poses: &[Pose], options: &CompoundingOptions) -> Result<Lattice, String> {
        let length = |what, mm: f64, least: f64| match (least..=1e6).contains(&mm) {
            true => Ok(()),
            false => Err(format!("{what} {mm} mm: must be a length of at most 1e6 mm")),
        };
        length("margin", options.margin, 0.0)?;
        options.spacing.map_or(Ok(()), |mm| length("spacing", mm, 1e-6))?;
        let placed: Vec<_> = poses
            .iter()
            .filter(|pose| pose.check().is_ok())
            .filter_map(|pose| pose.clipped(options.clip).ok().map(|clip| (pose, clip)))
            .collect();
        let Some((first, _)) = placed.first() else {
            return Err(format!("none of {} poses places a frame", poses.len()));
        };
        let mean = |of: &dyn Fn(&Pose, Part) -> DVec3| {
            placed.iter().map(|(pose, clip)| of(pose, *clip)).sum::<DVec3>() / placed.len() as f64
        };
        let [right, down] = [|pose: &Pose| pose.to_space.matrix3.x_axis, |pose: &Pose| pose.to_space.matrix3.y_axis];
        let turned = axes(mean(&|p, _| right(p).normalize()), mean(&|p, _| down(p).normalize()))
            .or_else(|| axes(right(first).normalize(), down(first).normalize()))
            .unwrap_or(DMat3::IDENTITY);
        let origin = mean(&|pose, [columns, rows]| pose.place((columns.0 + columns.1 - 1) as f64 / 2.0, rows.0 as f64));
        let to_volume = DAffine3::from_mat3(turned.transpose()) * DAffine3::from_translation(-origin);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (pose, [columns, rows]) in &placed {
            for (column, row) in
                [(columns.0, rows.0), (columns.1 - 1, rows.0), (columns.0, rows.1 - 1), (columns.1 - 1, rows.1 - 1)]
            {
                let corner = to_volume.transform_point3(pose.place(column as f64, row as f64));
                (low, high) = (low.min(corner), high.max(corner));
            }
        }
        let pitch = [mean(&|p, _| DVec3::splat(right(p).length())).x, mean(&|p, _| DVec3::splat(down(p).length())).x];
        let spacing = match options.spacing {
            Some(mm) => DVec3::splat(mm),
            None => DVec3::new(pitch[0], pitch[1], pitch[0].max(pitch[1])),
        };
        let grid = grid(low - options.margin, high + options.margin, spacing, options.most_voxels)?;
        grid.check().map_err(|e| format!("{} {}", e.field, e.fault))?;
        Ok(Lattice { grid, to_volume })
    }
}

/// Axes at right angles, as columns: the first kept, the second as near to what is given as that allows. None where there is hardly a
/// direction: frames that point every way have no mean.
fn axes(right: DVec3, down: DVec3) -> Option<DMat3> {
    const LEAST: f64 = 5e-4;
    let x = right.try_normalize().filter(|_| right.length() > LEAST)?;
    let y = down - x * down.dot(x);
    let y = y.try_normalize().filter(|_| y.length() > LEAST)?;
    Some(DMat3::from_cols(x, y, x.cross(y)))
}

/// The lattice from `low` to `high`, its spacing as little coarser as `most` voxels allow.
fn grid(low: DVec3, high: DVec3, mut spacing: DVec3, most: usize) -> Result<Grid, String> {
    let most = most.max(1) as f64;
    for _ in 0..STEPS {
        // Of the outermost voxels, each end is within a quarter of the spacing.
        let count = ((high - low) / spacing).round() + 1.0;
        let (all, along) = (count.element_product(), count.max_element());
        if all <= most && along <= MOST_ALONG {
            let size = count.to_array().map(|n| n as usize);
            let origin = (low + high - (count - 1.0) * spacing) / 2.0;
            return Ok(Grid { size, spacing: spacing.to_array(), origin: origin.to_array() });
        }
        spacing *= (all / most).cbrt().max(along / MOST_ALONG).max(1.001);
    }
    Err(format!("no spacing makes {most} voxels or fewer of {:.1} mm", high - low))
}
