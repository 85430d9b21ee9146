//! Conversion of a sweep to a Cartesian volume file: each voxel is interpolated in the polar frames, trilinearly in sample, line and slice.
//! In f64 on the CPU, one slice of the result at a time, so that only the sweep itself has to fit into memory.

use super::samples::put;
use super::segmentation::{self, Segment};
use super::volume_file::VolumeFile;
use crate::files::InputError;
use crate::probe::{Geometry, Grid, Indices, World};
use crate::{Frame, SampleType, Source, StoredType, VolumeFrames};
use glam::DVec3;
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::Path;

/// Most voxels along an edge, and in total: 32 GiB of floats.
const MAX_EDGE: f64 = 16384.0;
const MAX_VOXELS: f64 = 8_589_934_592.0;

/// How a volume is written to a file: the grid, its position in the world, the type of the samples, and the value outside the insonified region.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    pub grid: Grid,
    /// Map from voxels to the world (LPS).
    pub world: World,
    pub sample: SampleType,
    /// Value that is written for voxels outside the insonified region: in the units of the original file's values, or 0 to 255 for a secondary
    /// capture.
    pub outside: f64,
    /// None: a volume with the values of the original file is written. Some: a DICOM secondary capture of 8 bits, with the stored values that
    /// become 0 and 255.
    pub capture: Option<[f64; 2]>,
}

impl Target {
    /// A target on a grid whose axes are those of the world, with 0 outside the insonified region.
    pub fn new(grid: Grid, sample: SampleType) -> Target {
        Target { grid, world: World::of(&grid), sample, outside: 0.0, capture: None }
    }

    /// The target of the volume with this index of a recording, on the grid of [`target_grid`]. Outside the insonified region it has the value of no
    /// echo.
    ///
    /// # Errors
    /// That of [`target_grid`].
    pub fn of(source: &dyn Source, volume: usize, spacing: Option<f64>) -> Result<Target, String> {
        let geometry = source.geometry(volume);
        let grid = target_grid(&geometry, spacing)?;
        let world = World::resampled(source.world_of(volume), &geometry, &grid);
        Ok(Target { world, outside: no_echo(source), ..Target::new(grid, source.sample_type()) })
    }

    /// The same target as a DICOM secondary capture of 8 bits, black outside the insonified region. `shown`: the stored values that become 0 and 255.
    pub fn captured(self, shown: [f64; 2]) -> Target {
        Target { sample: SampleType::U8, outside: 0.0, capture: Some(shown), ..self }
    }

    /// The format of a file name, with the form that is asked for.
    fn format(&self, path: &Path) -> Result<VolumeFile, InputError> {
        match (VolumeFile::of(path)?, self.capture) {
            (VolumeFile::Dicom { .. }, Some(_)) => Ok(VolumeFile::Dicom { capture: true }),
            (_, Some(_)) => Err(InputError::new(path, "--secondary-capture", "is for .dcm")),
            (format, None) => Ok(format),
        }
    }

    /// Checks, before any work is done, that the file of this name can hold the volume.
    ///
    /// # Errors
    /// The extension is of no format that is written, an axis is too long for the format, or DICOM cannot hold the type of the samples or so many
    /// bytes. Other errors: the type of the samples does not have the value `outside`, or a secondary capture is to be written to another file than
    /// `.dcm`.
    pub fn check(&self, path: &Path) -> Result<(), InputError> {
        self.check_as(self.format(path)?, path)
    }

    /// Checks that a file of the given format, whatever its extension, can hold the volume. The error is that of [`Target::check`].
    pub(super) fn check_as(&self, format: VolumeFile, path: &Path) -> Result<(), InputError> {
        let most = format.most_along_axis();
        if let Some(long) = self.grid.size.iter().find(|n| **n > most) {
            let fault = format!("would have {long} voxels along an axis, the format holds {most}");
            return Err(InputError::new(path, "file", fault));
        }
        format.check(self.grid.size, self.sample).map_err(|why| InputError::new(path, "file", why))?;
        let [low, high] = match self.sample {
            SampleType::U8 => [0.0, 255.0],
            SampleType::U16 => [0.0, 65535.0],
            SampleType::I16 => [-32768.0, 32767.0],
            SampleType::F32 => [f64::from(f32::MIN), f64::from(f32::MAX)],
        };
        let is_whole = self.sample == SampleType::F32 || self.outside.fract() == 0.0;
        if !(low..=high).contains(&self.outside) || !is_whole {
            let fault = format!("{} is no value of {}", self.outside, self.sample);
            return Err(InputError::new(path, "--outside", fault));
        }
        Ok(())
    }
}

/// The grid of a converted volume: with the requested voxel spacing, mm, otherwise that of a Cartesian volume itself, or for a sweep one with the
/// distance of its samples.
///
/// # Errors
/// One line without the file's name: the spacing is not allowed or gives too many voxels.
pub fn target_grid(geometry: &Geometry, spacing: Option<f64>) -> Result<Grid, String> {
    match (geometry, spacing) {
        // Every voxel stays what and where it is.
        (Geometry::Cartesian(grid), None) => Ok(*grid),
        (Geometry::Sweep(probe), None) => {
            lattice(geometry, probe.sample_pitch).map_err(|e| format!("the sample spacing {e}; give --spacing"))
        }
        (_, Some(spacing)) => lattice(geometry, spacing).map_err(|e| format!("--spacing {e}")),
    }
}

/// The grid with a voxel spacing of `spacing` mm over a box that contains the insonified region of a geometry. Its axes are lateral, depth (Y of the
/// probe) and elevation.
///
/// # Errors
/// One line without the file's name: the spacing is no length above 0, or makes too many voxels.
pub fn lattice(geometry: &Geometry, spacing: f64) -> Result<Grid, String> {
    if !(spacing.is_finite() && spacing > 0.0) {
        return Err(format!("{spacing} mm: must be a finite length above 0"));
    }
    let (low, high) = match geometry {
        Geometry::Sweep(probe) => probe.bounds(),
        Geometry::Cartesian(grid) => {
            let (origin, pitch) = (DVec3::from(grid.origin), DVec3::from(grid.spacing));
            let last = DVec3::from_array(grid.size.map(|n| n.saturating_sub(1) as f64));
            (origin, origin + last * pitch)
        }
    };
    // The outermost voxels are within one spacing of the bounds. Tolerates rounding.
    let count = (((high - low) / spacing + 1e-9).floor() + 1.0).to_array();
    if count.iter().any(|n| n.is_nan() || *n > MAX_EDGE) || count.iter().product::<f64>() > MAX_VOXELS {
        let [x, y, z] = count;
        return Err(format!(
            "{spacing} mm: makes {x:.0} x {y:.0} x {z:.0} voxels; at most {MAX_EDGE} along an edge and {MAX_VOXELS:.0} in all are written"
        ));
    }
    Ok(Grid { size: count.map(|n| n as usize), spacing: [spacing; 3], origin: low.to_array() })
}

/// The samples of one volume in memory, with their geometry.
#[derive(Clone)]
pub struct Volume {
    geometry: Geometry,
    stored: StoredType,
    /// Samples of a line, lines of a frame, frames.
    size: [usize; 3],
    /// By slice in geometric order; a missing frame is empty.
    frames: Vec<Vec<u8>>,
}

impl Volume {
    /// A volume whose frames are all still missing.
    pub fn new(geometry: Geometry, stored: StoredType) -> Volume {
        let [samples, lines] = geometry.frame_size();
        let size = [samples, lines, geometry.slices()];
        Volume { geometry, stored, size, frames: vec![Vec::new(); size[2]] }
    }

    /// Reads the volume with this number, from 0, of a recording. Returns it and the number of its frames that are there: a `.frames` file may lack
    /// some. `each` is called with every frame before the volume takes it.
    ///
    /// # Errors
    /// The recording cannot be read, has no volume with this number, or all frames of it are damaged.
    pub fn read(
        source: &mut dyn Source,
        number: usize,
        mut each: impl FnMut(&Frame),
    ) -> Result<(Volume, usize), InputError> {
        let mut volume = Volume::new(source.geometry(number), source.stored_type());
        let mut frames = VolumeFrames::of(source, number)?;
        while let Some(frame) = frames.read()? {
            each(&frame);
            volume.take(frame);
        }
        Ok((volume, frames.count()?))
    }

    /// Stores a frame at its [`Frame::slice`]. A frame of another size, or of a slice that the volume does not have, is ignored.
    pub fn take(&mut self, frame: Frame) {
        let bytes = self.size[0] * self.size[1] * self.stored.bytes();
        if let Some(place) = self.frames.get_mut(frame.slice).filter(|_| frame.bytes.len() == bytes) {
            *place = frame.bytes;
        }
    }

    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The type of the stored samples.
    pub fn stored(&self) -> StoredType {
        self.stored
    }

    /// The bytes of each slice, in geometric order. A missing frame has no bytes; its samples count as 0.
    pub fn frames(&self) -> &[Vec<u8>] {
        &self.frames
    }

    /// True if no frame is missing.
    pub fn is_whole(&self) -> bool {
        self.frames.iter().all(|frame| !frame.is_empty())
    }

    fn sample(&self, at: [usize; 3]) -> f64 {
        let n = (at[1] * self.size[0] + at[0]) * self.stored.bytes();
        self.frames[at[2]].get(n..n + self.stored.bytes()).map_or(0.0, |bytes| self.stored.value(bytes))
    }

    /// The stored value at a position in the coordinates of the geometry, mm, interpolated trilinearly; None outside the insonified region.
    pub fn at(&self, place: DVec3) -> Option<f64> {
        let index = match &self.geometry {
            Geometry::Sweep(probe) => {
                let at = probe.to_indices(place);
                [at.sample, at.line, at.slice]
            }
            Geometry::Cartesian(grid) => ((place - DVec3::from(grid.origin)) / DVec3::from(grid.spacing)).to_array(),
        };
        let mut low = [0; 3];
        let mut share = [0.0; 3];
        for axis in 0..3 {
            let last = (self.size[axis] - 1) as f64;
            // Tolerates rounding at the border.
            if !(index[axis] >= -1e-6 && index[axis] <= last + 1e-6) {
                return None;
            }
            let at = index[axis].clamp(0.0, last);
            low[axis] = (at as usize).min(self.size[axis].saturating_sub(2));
            share[axis] = at - low[axis] as f64;
        }
        let mut sum = 0.0;
        for corner in 0..8usize {
            let weight: f64 = (0..3).map(|a| if corner >> a & 1 == 1 { share[a] } else { 1.0 - share[a] }).product();
            if weight > 0.0 {
                sum += weight * self.sample(std::array::from_fn(|a| low[a] + (corner >> a & 1)));
            }
        }
        Some(sum)
    }

    /// Resamples this volume at the samples of `geometry`, for a body that has moved. `back` maps the position of a sample of `geometry`, mm, to the
    /// position in this volume whose stored value is taken. `outside`: the stored value of samples for which that position is outside the insonified
    /// region of this volume.
    pub fn moved_onto(&self, geometry: &Geometry, back: impl Fn(DVec3) -> DVec3 + Sync, outside: f64) -> Volume {
        let mut moved = Volume::new(geometry.clone(), self.stored);
        let [samples, lines, slices] = moved.size;
        let value = |line: usize, slice: usize, sample: usize| {
            let place = match geometry {
                Geometry::Cartesian(grid) => place_of(grid, [sample, line, slice]),
                Geometry::Sweep(probe) => {
                    let [sample, line, slice] = [sample, line, slice].map(|n| n as f64);
                    probe.to_space(Indices { sample, line, slice })
                }
            };
            self.at(back(place)).unwrap_or(outside)
        };
        let frame = |slice: usize| {
            let mut bytes = Vec::with_capacity(samples * lines * self.stored.bytes());
            (0..lines)
                .for_each(|line| (0..samples).for_each(|n| self.stored.append(value(line, slice, n), &mut bytes)));
            bytes
        };
        moved.frames = (0..slices).into_par_iter().map(frame).collect();
        moved
    }

    /// Fills the slice with index `z` of a grid with stored values, lateral fastest; NaN outside the insonified region. `out` has one value for each
    /// voxel of the slice.
    pub fn slice(&self, grid: &Grid, z: usize, out: &mut [f64]) {
        let target = Target::new(*grid, self.stored.into());
        out.par_chunks_mut(grid.size[0].max(1)).enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                *value = self.value(&target, [x, y, z]).unwrap_or(f64::NAN);
            }
        });
    }

    /// True if any voxel of a grid lies in the insonified region.
    pub fn meets(&self, grid: &Grid) -> bool {
        (0..grid.size[2]).into_par_iter().any(|z| {
            let row = |y: usize| (0..grid.size[0]).any(|x| self.at(place_of(grid, [x, y, z])).is_some());
            (0..grid.size[1]).any(row)
        })
    }

    /// The stored value of a voxel of a target; None outside the insonified region. Voxels of the volume itself are not interpolated.
    fn value(&self, target: &Target, voxel: [usize; 3]) -> Option<f64> {
        match &self.geometry {
            Geometry::Cartesian(own) if *own == target.grid => Some(self.sample(voxel)),
            _ => self.at(place_of(&target.grid, voxel)),
        }
    }

    /// Writes the volume, resampled on the grid of `target`. The values are those of the original file, whose sample type must be `target.sample`, or
    /// 0 to 255 for a secondary capture. `each` is called after every slice.
    ///
    /// # Errors
    /// The file cannot hold the volume ([`Target::check`]) or cannot be written. No incomplete file is left then.
    pub fn write(&self, target: &Target, path: &Path, each: impl Fn()) -> Result<(), InputError> {
        write_voxels(target, path, |voxel| self.value(target, voxel), each)
    }

    /// Writes only the voxels, without a header.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write_samples(&self, target: &Target, file: &mut impl Write) -> io::Result<()> {
        write_slices(target, file, |voxel| self.value(target, voxel), || ())
    }

    /// Writes a mask on the grid of `target`: 1 in voxels inside the insonified region, 0 outside. The file is a segmentation if its name ends in
    /// `.seg.nrrd` or `.seg.dcm`, otherwise a volume.
    ///
    /// # Errors
    /// The file cannot hold the mask or cannot be written.
    pub fn write_mask(&self, target: &Target, path: &Path) -> Result<(), InputError> {
        if segmentation::is_one(path) || segmentation::is_dicom(path) {
            let segment = Segment { label: 1, name: "insonified".into(), colour: [0.4, 0.6, 0.8] };
            let label = |voxel| u8::from(self.value(target, voxel).is_some());
            return segmentation::write(path, &target.grid, &target.world, &[segment], label, || ());
        }
        let mask = Target { sample: SampleType::U8, outside: 0.0, capture: None, ..*target };
        write_voxels(&mask, path, |voxel| self.value(target, voxel).map(|_| 1.0), || ())
    }

    /// Writes a segmentation on the grid of `target`: label 1, "tissue", in voxels with a stored value of at least `threshold`, otherwise 0. It is
    /// DICOM if the file's name ends in `.seg.dcm`, otherwise NRRD. `each` is called once for each slice.
    ///
    /// # Errors
    /// The format cannot hold the segmentation, or the file cannot be written.
    pub fn write_tissue(
        &self,
        target: &Target,
        threshold: f64,
        path: &Path,
        each: impl Fn(),
    ) -> Result<(), InputError> {
        let segment = Segment { label: 1, name: "tissue".into(), colour: [0.88, 0.67, 0.55] };
        let label = |voxel| u8::from(self.value(target, voxel).is_some_and(|value| value >= threshold));
        segmentation::write(path, &target.grid, &target.world, &[segment], label, each)
    }
}

/// The sample value, in the units of the source's file, that stands for no echo: the low end of the displayed range, such as -60 dB.
fn no_echo(source: &dyn Source) -> f64 {
    source.range()[0] - source.sample_type().shift()
}

/// Writes a volume on a grid along the axes of the world. `value` gives the sample at a position, mm; None is written as 0. `each` is called
/// after every slice.
///
/// # Errors
/// The file cannot hold the volume ([`Target::check`]) or cannot be written.
pub(super) fn write_grid(
    grid: &Grid,
    sample: SampleType,
    path: &Path,
    value: impl Fn(DVec3) -> Option<f64> + Sync,
    each: impl Fn(),
) -> Result<(), InputError> {
    write_voxels(&Target::new(*grid, sample), path, |voxel| value(place_of(grid, voxel)), each)
}

fn write_voxels(
    target: &Target,
    path: &Path,
    value: impl Fn([usize; 3]) -> Option<f64> + Sync,
    each: impl Fn(),
) -> Result<(), InputError> {
    target.check(path)?;
    let written = |e| InputError::unwritable(path, &e);
    let mut file =
        target.format(path)?.create(path, target.grid.size, &target.world, target.sample).map_err(written)?;
    write_slices(target, &mut file, value, each).map_err(written)?;
    file.complete().map_err(written)
}

fn write_slices(
    target: &Target,
    file: &mut impl Write,
    value: impl Fn([usize; 3]) -> Option<f64> + Sync,
    each: impl Fn(),
) -> io::Result<()> {
    let Target { grid, sample, outside, .. } = *target;
    let shown = |value: f64| match target.capture {
        Some([low, high]) => (255.0 * (value - low) / (high - low)).clamp(0.0, 255.0),
        None => value - sample.shift(),
    };
    let mut slice = vec![0; grid.size[0] * grid.size[1] * sample.bytes()];
    for z in 0..grid.size[2] {
        slice.par_chunks_mut(grid.size[0] * sample.bytes()).enumerate().for_each(|(y, row)| {
            for (x, voxel) in row.chunks_exact_mut(sample.bytes()).enumerate() {
                put(sample, value([x, y, z]).map_or(outside, shown), voxel);
            }
        });
        file.write_all(&slice)?;
        each();
    }
    Ok(())
}

/// The centre of a voxel, mm.
pub(super) fn place_of(grid: &Grid, voxel: [usize; 3]) -> DVec3 {
    DVec3::from(grid.origin) + DVec3::from(grid.spacing) * DVec3::from_array(voxel.map(|n| n as f64))
}
