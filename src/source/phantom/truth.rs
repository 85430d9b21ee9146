//! The truth of head and vessels as volume files: a label at each voxel, and the signed distance from the skin, or from the blood.

use super::Phantom;
use super::body::{Scatterers, Truth, refusal};
use super::head::Head;
use super::labels::Label;
use super::vessels::VesselTree;
use crate::convert::{lattice, place_of, write_grid};
use crate::files::InputError;
use crate::probe::{Geometry, Grid, SampleType, World};
use crate::segmentation::{self, Segment};
use crate::volume_file::VolumeFile;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Path of the file of signed distances beside a label volume: `truth.distance.mha` for both `truth.mha` and `truth.seg.nrrd`.
pub fn distance_path(labels: &Path) -> PathBuf {
    match segmentation::stem(labels) {
        Some(stem) => labels.with_file_name(format!("{stem}.distance.mha")),
        None => labels.with_extension("distance.mha"),
    }
}

/// A body that has labels.
enum Labelled<'a> {
    Head(&'a Head),
    Vessels(&'a VesselTree),
}

impl Phantom {
    /// The label at a position in the coordinates of [`crate::probe::Probe`], mm, at the time at which the beam passes there in the volume of
    /// this index.
    ///
    /// # Errors
    /// The body is neither head nor vessels; [`Phantom::truth`] has its formula.
    pub fn label(&self, volume: usize, place: DVec3) -> Result<Label, InputError> {
        Ok(match self.labelled()? {
            Labelled::Head(head) => head.label(self.own(place).as_vec3(), self.time_at(volume, place)),
            Labelled::Vessels(tree) => match tree.distance(self.own(place)) {
                away if away <= 0.0 => Label::Blood,
                away if away <= tree.wall => Label::VesselWall,
                _ => Label::Liver,
            },
        })
    }

    /// Distance of a position, given as for [`Phantom::label`], from the skin of head, trunk, hand or cord (not of the uterus), or for vessels
    /// from the blood; mm, negative inside. It is exact on the surface, and for the head correct to first order near it.
    ///
    /// # Errors
    /// The body is neither head nor vessels; [`Phantom::truth`] has its formula.
    pub fn distance(&self, volume: usize, place: DVec3) -> Result<f64, InputError> {
        Ok(match self.labelled()? {
            Labelled::Head(head) => f64::from(head.distance(self.own(place).as_vec3(), self.time_at(volume, place))),
            Labelled::Vessels(tree) => tree.distance(self.own(place)),
        })
    }

    /// The grid for writing the ground truth: `spacing` mm apart over the insonified region, as [`lattice`] makes it.
    ///
    /// # Errors
    /// The body is neither head nor vessels, or the spacing is no length or makes too many voxels.
    pub fn truth_grid(&self, spacing: f64) -> Result<Grid, InputError> {
        self.labelled()?;
        lattice(&Geometry::Sweep(self.probe(0)), spacing).map_err(|fault| refusal("truth_spacing", fault))
    }

    /// Writes the ground truth of the first volume on a grid. Labels (u8, [`Label`]) go to `path`, a MetaImage or a segmentation with their
    /// names. Distances (f32, mm, see [`Phantom::distance`]) go to [`distance_path`], a MetaImage. Both have values outside the sector, too.
    ///
    /// # Errors
    /// The body is neither head nor vessels, the path does not end in .mha or .seg.nrrd, or a file cannot be written: the labels may then exist
    /// without the distances, but neither file is incomplete.
    pub fn write_truth(&self, path: &Path, grid: &Grid) -> Result<(), InputError> {
        self.labelled()?;
        let label = |place| self.label(0, place).ok().map(|label| label as u8);
        if segmentation::is_one(path) {
            // Fluid is 0: no segment.
            let segments = self.options.body.labels().iter().filter(|label| **label as u8 > 0);
            let segments = segments.map(|l| Segment { label: *l as u8, name: l.name().into(), colour: l.colour() });
            let label = |voxel| label(place_of(grid, voxel)).unwrap_or(0);
            segmentation::write(path, grid, &World::of(grid), &segments.collect::<Vec<_>>(), label, || ())?;
        } else if VolumeFile::of(path).is_ok_and(|format| format == VolumeFile::MetaImage) {
            write_grid(grid, SampleType::U8, path, |place| label(place).map(f64::from), || ())?;
        } else {
            return Err(InputError::new(path, "file", "must end in .mha or .seg.nrrd"));
        }
        write_grid(grid, SampleType::F32, &distance_path(path), |place| self.distance(0, place).ok(), || ())
    }

    /// The place in the body that was not moved.
    fn own(&self, place: DVec3) -> DVec3 {
        self.options.moved.map().inverse().transform_point3(place)
    }

    fn labelled(&self) -> Result<Labelled<'_>, InputError> {
        match &self.scatterers {
            Scatterers::Head(head) => Ok(Labelled::Head(head)),
            Scatterers::Exact { truth: Truth::Vessels(tree), .. } => Ok(Labelled::Vessels(tree)),
            Scatterers::Exact { .. } => Err(refusal("body", "has no labels: only the head and the vessels do")),
        }
    }

    /// When the beam passes a place, s; outside the sector, when it is nearest in line and frame.
    fn time_at(&self, volume: usize, place: DVec3) -> f64 {
        let at = self.probe(volume).to_indices(place);
        let nearest = |index: f64, count: usize| index.round().clamp(0.0, (count - 1) as f64) as usize;
        self.line_time(volume, nearest(at.slice, self.options.frames), nearest(at.line, self.options.lines))
    }
}
