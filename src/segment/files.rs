//! Labels in files: segmentations of 3D Slicer (`.seg.nrrd`), segmentations in DICOM (`.seg.dcm`, written only), and meshes of labels.

use crate::base_files::InputError;
use crate::labels::Labels;
use crate::lattice;
use crate::memory;
use crate::mesh::Mesh;
use crate::mesh::nets::{Surface, surface_net};
use crate::mesh::smooth::Smoother;
use crate::probe::{Geometry, World};
use crate::scene::LabelVolume;
use crate::source::segmentation::{self, Segment};
use crate::source::{self, OpenOptions};
use glam::DAffine3;
use std::collections::BTreeSet;
use std::path::Path;

/// Colours that neighbouring labels are told apart by: red, green, blue, 0..=1.
const COLOURS: [[f64; 3]; 6] =
    [[0.9, 0.6, 0.2], [0.3, 0.7, 0.9], [0.3, 0.7, 0.4], [0.9, 0.85, 0.3], [0.8, 0.4, 0.3], [0.75, 0.5, 0.75]];

/// Bins of the histogram by which the level of a surface is found.
const BINS: usize = 1024;

/// Writes labels as a segmentation: in DICOM if the name of the file ends in `.seg.dcm`, otherwise in the NRRD format of 3D Slicer. Each label that a
/// voxel has becomes a segment with a colour and the name that `name` gives.
///
/// # Errors
/// The file cannot be written, or DICOM cannot hold the labels: too many voxels, or none with a label. No incomplete file is left.
pub fn write(labels: &Labels, path: &Path, name: impl Fn(u8) -> String) -> Result<(), InputError> {
    let there: BTreeSet<u8> = labels.voxels().iter().copied().filter(|label| *label > 0).collect();
    let segments: Vec<Segment> = there.into_iter().map(|label| segment(label, name(label))).collect();
    write_segments(labels, path, &segments)
}

/// A segment with this name and the colour that its label has in [`write`].
pub fn segment(label: u8, name: String) -> Segment {
    Segment { label, name: name.into(), colour: COLOURS[(usize::from(label) + COLOURS.len() - 1) % COLOURS.len()] }
}

/// Writes labels as a segmentation in the formats of [`write`], with these segments.
///
/// # Errors
/// As for [`write`].
pub fn write_segments(labels: &Labels, path: &Path, segments: &[Segment]) -> Result<(), InputError> {
    let [width, height, _] = labels.grid().size;
    let label = |[x, y, z]: [usize; 3]| labels.voxels()[(z * height + y) * width + x];
    segmentation::write(path, labels.grid(), labels.world(), segments, label, || ())
}

/// Reads an NRRD segmentation: its labels and its segments. The axes of the grid are chosen by the orientation of the file and by `options`, as those
/// of a recording are.
///
/// # Errors
/// The file is no segmentation, is no volume of one layer of bytes, takes too much memory, or cannot be read.
pub fn read(path: &Path, options: OpenOptions) -> Result<(Labels, Vec<Segment>), InputError> {
    let segments = segmentation::segments(path)?;
    let fault = |why: String| InputError::new(path, "labels", why);
    if segments.is_empty() {
        return Err(fault("are not there: it is no segmentation, of which a header states Segment0_ID".into()));
    }
    let mut recording = source::open_with(path, options)?;
    let (geometry, bytes) = (recording.geometry(0), recording.stored_type().bytes());
    let Geometry::Cartesian(grid) = geometry else { return Err(fault("are not on a lattice".into())) };
    if bytes != 1 {
        return Err(fault(format!("are numbers of {bytes} bytes, must be bytes")));
    }
    let world = recording.world_of(0).unwrap_or(World::of(&grid));
    let count = lattice::voxels(&grid).map_err(fault)?;
    memory::check(count as u64).map_err(|why| fault(format!("take memory: a label volume {why}")))?;
    let mut voxels = Vec::with_capacity(count);
    for _ in 0..grid.size[2] {
        let Some(frame) = recording.next_frame()? else { break };
        voxels.extend(frame.bytes);
    }
    Ok((Labels::of(grid, world, voxels).map_err(fault)?, segments))
}

/// The labels as a scene of a volume shows them, in the colours of their segments. `geometry`, `world`: those of the volume. If `world` is None or
/// the volume is a sweep, world coordinates of the labels are taken as coordinates of the volume.
///
/// # Errors
/// One line: there are none, too many, or all of them are beside the volume.
pub fn shown(
    labels: &Labels,
    segments: &[Segment],
    geometry: &Geometry,
    world: Option<World>,
) -> Result<LabelVolume, String> {
    let colour = |label: u8| segments.iter().find(|segment| segment.label == label).map(|segment| segment.colour);
    let to_space = to_space(labels, geometry, world);
    let volume = LabelVolume::new(labels.grid().size, labels.voxels(), to_space, colour)?;
    match volume.overlaps(geometry) {
        true => Ok(volume),
        false => Err("are beside the volume: they belong to another recording, or to other coordinates".into()),
    }
}

/// The map from the index of a voxel of the labels to its place in a volume, mm. `world`: as for [`shown`].
pub fn to_space(labels: &Labels, geometry: &Geometry, world: Option<World>) -> DAffine3 {
    let own = labels.world();
    let to_world = DAffine3::from_cols(own.axis(0), own.axis(1), own.axis(2), own.origin());
    match (geometry, world) {
        (Geometry::Cartesian(grid), Some(world)) => world.pose(grid).inverse() * to_world,
        _ => to_world,
    }
}

/// The closed surface around the voxels of a label, in world coordinates, mm. A Gaussian of one voxel smooths the steps; the surface encloses as many
/// voxels as have the label, so that small bodies do not shrink.
///
/// # Errors
/// One line: there would be too many triangles.
pub fn surface(labels: &Labels, label: u8) -> Result<Mesh, String> {
    let (grid, world) = (labels.grid(), labels.world());
    let each = grid.size[0] * grid.size[1];
    let reader = || {
        // In voxels, so that it is one along every axis.
        let mut smoother = Smoother::new(grid.size, [1.0; 3], 1.0);
        move |z: usize, out: &mut [f64]| {
            smoother.slice(z, out, |z, out| {
                let from = &labels.voxels()[z * each..][..each];
                out.iter_mut().zip(from).for_each(|(out, voxel)| *out = f64::from(u8::from(*voxel == label)));
            });
            Ok::<(), String>(())
        }
    };
    let (mut bins, mut read, mut smoothed) = (vec![0usize; BINS + 1], reader(), vec![0.0; each]);
    for z in 0..grid.size[2] {
        read(z, &mut smoothed)?;
        smoothed.iter().for_each(|value| bins[(value * BINS as f64) as usize] += 1);
    }
    let mut left = labels.voxels().iter().filter(|voxel| **voxel == label).count();
    let is_reached = |count: usize| {
        left = left.saturating_sub(count);
        left == 0
    };
    let bin = bins.iter().rev().copied().position(is_reached).map_or(BINS / 2, |n| BINS - n);
    let surface = Surface { threshold: bin.max(1) as f64 / BINS as f64, closed: true };
    surface_net(grid.size, surface, reader(), |at| world.at(at))
}
