//! Tracked pictures of a file as a freehand volume: each gets its pose by a chain of transforms, and they are compounded into a lattice.

use super::OpenOptions;
use super::frame::Source;
use super::freehand::{CompoundingOptions, FreehandFile, PlacedPicture, PlacedPictures, Pose};
use super::keys::Unused;
use super::plus_config::PlusConfig;
use super::recording::Recording;
use super::transforms::{Calibration, Chain, HOW};
use crate::files::InputError;
use crate::probe::Geometry;
use glam::DAffine3;
use std::path::{Path, PathBuf};

/// The frame of pictures where nothing else is said, and the frames that a volume is placed in, the first that there is.
const IMAGE: &str = "Image";
const REFERENCES: [&str; 3] = ["Reference", "Tracker", "World"];

/// True if the options say how tracked pictures become a volume.
pub(super) fn is_asked_for(options: &OpenOptions) -> bool {
    options.plus_config.is_some() || !options.calibration.is_empty() || options.reference.is_some()
}

/// Tracked pictures with the poses that a chain of transforms gives them.
pub(super) struct Tracked {
    pictures: Recording,
    config: Option<PathBuf>,
    /// By picture; None without a valid pose.
    poses: Vec<Option<Pose>>,
    /// From which frame to which, for users.
    between: [String; 2],
}

/// A freehand volume of tracked pictures.
pub(super) type TrackedVolume = FreehandFile<Tracked>;

impl TrackedVolume {
    /// Computes the poses of all pictures of a recording. No picture is read yet.
    ///
    /// # Errors
    /// The recording has no tracked pictures, an option does not apply to these or is out of its range, or the configuration cannot be read. There is
    /// no chain of transforms, no picture has a valid pose, or the volume is too large.
    pub fn new(path: &Path, pictures: Recording, options: &OpenOptions) -> Result<TrackedVolume, InputError> {
        let fault = |field: &str, fault: String| InputError::new(path, field, fault);
        let flag = match (options.plus_config, options.calibration) {
            (Some(_), _) => "--plus-config",
            (None, []) => "--reference",
            _ => "--calibration",
        };
        if options.probe.is_some() || options.depth_axis.is_some() {
            return Err(fault(flag, "is for tracked pictures; --probe and --depth-axis are not".into()));
        }
        let Geometry::Cartesian(grid) = pictures.geometry(0) else {
            return Err(fault(flag, "is for tracked pictures; these are scan lines".into()));
        };
        if pictures.poses().by_name.is_empty() || grid.size[2] != 1 {
            return Err(fault(flag, "is for tracked pictures; this recording has no poses".into()));
        }
        let config = options.plus_config.map(PlusConfig::read).transpose()?.unwrap_or_default();
        // What a user says comes before the file.
        let is_new = |of_file: &Calibration| options.calibration.iter().all(|given| given.name != of_file.name);
        let of_file = config.fixed.into_iter().filter(is_new);
        let fixed: Vec<Calibration> = options.calibration.iter().cloned().chain(of_file).collect();
        let image = config.image.as_deref().unwrap_or(IMAGE);
        let asked = options.reference.or(config.reference.as_deref());
        let candidates = asked.map_or(REFERENCES.to_vec(), |asked| vec![asked]);
        let found = candidates.iter().find_map(|to| Some((*to, Chain::find(pictures.poses(), &fixed, image, to)?)));
        let Some((reference, chain)) = found else {
            let there = pictures.poses().names();
            let to = candidates.join(" or ");
            let why = format!("no chain leads from {image} to {to}; the pictures have {there}; {HOW}");
            return Err(fault("transforms", why));
        };
        let size = [grid.size[0], grid.size[1]];
        let poses: Vec<Option<Pose>> = (0..pictures.volumes())
            .map(|n| chain.of(n).map(|matrix| Pose { to_space: DAffine3::from_mat4(matrix), size }))
            .map(|pose| pose.filter(|pose| pose.check().is_ok()))
            .collect();
        let of_file = CompoundingOptions {
            clip: config.clip,
            spacing: config.spacing,
            margin: 0.0,
            ..CompoundingOptions::default()
        };
        let between = [image.to_string(), reference.to_string()];
        let config = options.plus_config.map(Path::to_path_buf);
        let tracked = Tracked { pictures, config, poses: poses.clone(), between };
        FreehandFile::around(path, tracked, &poses, options.freehand.over(of_file))
    }

    /// A description for users: pairs of title and value.
    pub fn description(&self) -> Vec<(String, String)> {
        let Tracked { pictures, between: [from, to], .. } = self.placed();
        let placed = [("tracking", pictures.poses().names()), ("placed", format!("from {from} to {to}"))];
        let placed = placed.map(|(title, value)| (title.to_string(), value)).to_vec();
        self.describe(pictures.format(), placed, to)
    }

    /// Names of keys that the file states and that were not used.
    pub fn unused(&self) -> &Unused {
        self.placed().pictures.unused()
    }
}

impl PlacedPictures for Tracked {
    fn pictures(&self) -> &dyn Source {
        &self.pictures
    }

    fn rewind(&mut self) -> Result<(), InputError> {
        self.pictures.rewind();
        Ok(())
    }

    fn next(&mut self) -> Result<Option<PlacedPicture>, InputError> {
        let frame = self.pictures.next_frame()?;
        Ok(frame.map(|frame| (self.poses.get(frame.volume as usize).copied().flatten(), frame.bytes)))
    }

    fn files(&self) -> Vec<PathBuf> {
        self.pictures.files().into_iter().chain(self.config.clone()).collect()
    }
}
