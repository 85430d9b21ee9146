//! Volumes in time in one file: NRRD sequences (`.seq.nrrd`) as 3D Slicer writes them since version 5.8, packed by gzip. One volume at a
//! time is in memory. A file is complete or absent.

use super::convert::{Target, Volume};
use super::frame::{Frame, Source, VolumeFrames};
use super::volume_file::{SEQUENCE, VolumeFile, nrrd_start, stem};
use crate::files::{InputError, Unfinished};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::Write;
use std::ops::Range;
use std::path::Path;

/// True if a file name has the ending of a sequence, `.seq.nrrd`.
pub fn is_one(path: &Path) -> bool {
    stem(path, SEQUENCE).is_some()
}

/// The complete volumes of a source that are written to a sequence file.
pub struct VolumeSequence {
    kept: Vec<Whole>,
    left_out: usize,
    times: Result<(), &'static str>,
}

/// A volume of which every frame is there.
#[derive(PartialEq)]
struct Whole {
    /// Index in the source, from 0.
    place: usize,
    /// Volume number of its frames.
    number: u32,
    /// The earliest time stamp, s.
    time: Option<f64>,
}

impl VolumeSequence {
    /// Reads these volumes of a source once, to find which are complete and when they were acquired, because the header of the file states that.
    /// `path`: that of the source, for messages.
    ///
    /// # Errors
    /// The source cannot be read, no volume is complete, or volumes have different geometries or poses.
    pub fn of(source: &mut dyn Source, volumes: Range<usize>, path: &Path) -> Result<VolumeSequence, InputError> {
        let fault = |fault: String| InputError::new(path, "volumes", fault);
        let mut kept: Vec<Whole> = Vec::new();
        let count = volumes.len();
        for place in volumes {
            kept.extend(read(source, place, drop)?);
        }
        let Some(first) = kept.first() else { return Err(fault(format!("none of {count} is whole"))) };
        let (world, geometry) = (source.world_of(first.place), source.geometry(first.place));
        for Whole { place, .. } in &kept {
            if source.world_of(*place) != world || !source.geometry(*place).equals_except_travel(&geometry) {
                let why = format!("{place} lies elsewhere than {}, a sequence has one place", first.place);
                return Err(fault(format!("{why}; --volume takes one")));
            }
        }
        let left_out = count - kept.len();
        let times: Vec<f64> = kept.iter().filter_map(|volume| volume.time).collect();
        let times = match times.len() == kept.len() {
            false if times.is_empty() => Err("the volumes have no time stamps"),
            false => Err("some volumes have no time stamp, none is written"),
            // 3D Slicer has one volume for each value.
            true if !times.is_sorted_by(|a, b| a < b) => Err("the time stamps do not rise, none is written"),
            true => Ok(()),
        };
        Ok(VolumeSequence { kept, left_out, times })
    }

    /// Number of complete volumes.
    pub fn volumes(&self) -> usize {
        self.kept.len()
    }

    /// Index in the source of the first complete volume.
    pub fn first(&self) -> usize {
        self.kept.first().map_or(0, |volume| volume.place)
    }

    /// Number of volumes that are left out because frames are missing.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Checks that the file will state the times of the volumes.
    ///
    /// # Errors
    /// The reason why it will not.
    pub fn times(&self) -> Result<(), &'static str> {
        self.times
    }

    /// Checks, before any work is done, that the file can hold volumes on the grid of `target`.
    ///
    /// # Errors
    /// An axis is too long for NRRD, the type of the samples does not have the value outside, or a secondary capture is asked for.
    pub fn check(target: &Target, path: &Path) -> Result<(), InputError> {
        match target.capture {
            Some(_) => Err(InputError::new(path, "--secondary-capture", "is for .dcm")),
            None => target.check_as(VolumeFile::Nrrd, path),
        }
    }

    /// Writes the volumes of the source that was given to [`VolumeSequence::of`], all resampled on the grid of `target`. `each` is called after
    /// every volume.
    ///
    /// # Errors
    /// The file cannot hold the volumes ([`VolumeSequence::check`]), the source can no longer be read or has changed, or the file cannot be written.
    /// No incomplete file is left then.
    pub fn write(
        &self,
        source: &mut dyn Source,
        target: &Target,
        path: &Path,
        each: impl Fn(),
    ) -> Result<(), InputError> {
        VolumeSequence::check(target, path)?;
        let written = |e| InputError::unwritable(path, &e);
        let mut file = Unfinished::create(path).map_err(written)?;
        file.write_all(self.header(target).as_bytes()).map_err(written)?;
        let mut packed = GzEncoder::new(file, Compression::default());
        for whole in &self.kept {
            let mut volume = Volume::new(source.geometry(whole.place), source.stored_type());
            if read(source, whole.place, |frame| volume.take(frame))?.as_ref() != Some(whole) {
                return Err(InputError::new(path, "frames", "the input changed while it was being read"));
            }
            volume.write_samples(target, &mut packed).map_err(written)?;
            each();
        }
        packed.finish().and_then(Unfinished::complete).map_err(written)
    }

    fn header(&self, target: &Target) -> String {
        let start = nrrd_start(target.grid.size, &target.world, target.sample, Some(self.kept.len()));
        let [label, units, values] = match self.times {
            Err(_) => ["frame".into(), String::new(), String::new()],
            Ok(()) => {
                let times: Vec<String> = self.kept.iter().filter_map(|v| v.time).map(|time| time.to_string()).collect();
                let values = format!("axis 3 index type:=numeric\naxis 3 index values:={}\n", times.join(" "));
                ["time".into(), "units: \"\" \"\" \"\" \"s\"\n".into(), values]
            }
        };
        format!(
            "{start}encoding: gzip\nlabels: \"\" \"\" \"\" \"{label}\"\n{units}DataNodeClassName:=vtkMRMLScalarVolumeNode\n{values}\n"
        )
    }
}

/// Reads one volume, if all of its frames are there.
fn read(source: &mut dyn Source, place: usize, mut each: impl FnMut(Frame)) -> Result<Option<Whole>, InputError> {
    let mut missing = vec![true; source.frames_per_volume()];
    let mut whole: Option<Whole> = None;
    let mut frames = VolumeFrames::of(source, place)?;
    while let Some(frame) = frames.read()? {
        let volume = whole.get_or_insert(Whole { place, number: frame.volume, time: None });
        if let Some(time) = frame.time.filter(|time| time.is_finite()) {
            volume.time = Some(volume.time.map_or(time, |before| before.min(time)));
        }
        missing.iter_mut().skip(frame.slice).take(1).for_each(|missing| *missing = false);
        each(frame);
    }
    Ok(whole.filter(|_| !missing.contains(&true)))
}
