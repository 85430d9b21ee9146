//! Tracked pictures of a file as a freehand volume: each gets its pose by a chain of transforms, and they are compounded into a lattice.

use super::frame::{Frame, Source};
use super::freehand::{Compounder, CompoundingOptions, Lattice, Pose, TrackedFrame};
use super::plus_config::PlusConfig;
use super::recording::Recording;
use super::samples::{SampleType, StoredType};
use super::transforms::{Calibration, Chain, HOW};
use super::{OpenOptions, describe};
use crate::files::InputError;
use crate::probe::{Geometry, World};
use glam::DAffine3;
use std::path::{Path, PathBuf};

/// The frame of pictures where nothing else is said, and the frames that a volume is placed in, the first that there is.
const IMAGE: &str = "Image";
const REFERENCES: [&str; 3] = ["Reference", "Tracker", "World"];

/// True if a user says how pictures are tracked.
pub(super) fn is_asked_for(options: &OpenOptions) -> bool {
    options.plus_config.is_some() || !options.calibration.is_empty() || options.reference.is_some()
}

/// A freehand volume.
///
/// Memory: that of the [`Compounder`], from the first frame on.
pub(super) struct TrackedVolume {
    path: PathBuf,
    config: Option<PathBuf>,
    pictures: Recording,
    /// By picture; None without a valid pose.
    poses: Vec<Option<Pose>>,
    lattice: Lattice,
    world: World,
    options: CompoundingOptions,
    /// From which frame to which, for users.
    between: [String; 2],
    compounder: Option<Compounder>,
    next: usize,
}

impl TrackedVolume {
    /// Places all pictures of a recording. No picture is read yet.
    ///
    /// # Errors
    /// A recording without poses, a configuration that cannot be read, no chain of transforms, no picture with a pose.
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
        let mut fixed: Vec<Calibration> = options.calibration.to_vec();
        let is_new = |of_file: &Calibration| fixed.iter().all(|given| given.name != of_file.name);
        let more: Vec<Calibration> = config.fixed.into_iter().filter(is_new).collect();
        fixed.extend(more);
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
        let compounding = CompoundingOptions {
            clip: config.clip,
            spacing: config.spacing,
            margin: 0.0,
            ..CompoundingOptions::default()
        };
        let placed: Vec<Pose> = poses.iter().flatten().copied().collect();
        let lattice = Lattice::around(&placed, &compounding).map_err(|e| fault("poses", e))?;
        let world = world_of(&lattice).map_err(|e| fault("poses", e))?;
        let without = poses.len() - placed.len();
        if without > 0 {
            tracing::warn!(file = %describe::path(path), "{without} of {} pictures have no valid pose; left out", poses.len());
        }
        let between = [image.to_string(), reference.to_string()];
        Ok(TrackedVolume {
            path: path.into(),
            config: options.plus_config.map(Path::to_path_buf),
            pictures,
            poses,
            lattice,
            world,
            options: compounding,
            between,
            compounder: None,
            next: 0,
        })
    }

    /// A description for users: pairs of title and value.
    pub fn description(&self) -> Vec<(String, String)> {
        let mut rows: Vec<(String, String)> = Vec::new();
        let mut add = |title: &str, value: String| rows.push((title.into(), value));
        add("format", format!("{}, freehand", self.pictures.format()));
        add("samples", self.sample_type().to_string());
        let (all, placed) = (self.poses.len(), self.poses.iter().flatten().count());
        add("pictures", format!("{all}, {placed} with a valid pose"));
        add("tracking", self.pictures.poses().names());
        let [from, to] = &self.between;
        add("placed", format!("from {from} to {to}"));
        rows.extend(describe::grid(&self.lattice.grid));
        let [u, v, w] = self.world.origin().to_array().map(describe::number);
        rows.push(("position".into(), format!("the first voxel is at {u}, {v}, {w} mm in {to}")));
        rows
    }

    /// Reads and compounds all pictures.
    fn compound(&mut self) -> Result<Compounder, InputError> {
        let stored = self.pictures.stored_type();
        let fault = |fault: String| InputError::new(&self.path, "frames", fault);
        let mut compounder = Compounder::new(self.lattice, stored, self.options.clone()).map_err(fault)?;
        self.pictures.rewind();
        while let Some(frame) = self.pictures.next_frame()? {
            let Some(Some(pose)) = self.poses.get(frame.volume as usize) else { continue };
            compounder.push(&TrackedFrame { pose: *pose, stored, bytes: &frame.bytes }).map_err(fault)?;
        }
        compounder.changed_slices();
        Ok(compounder)
    }
}

/// Where the voxels of a lattice are in the space of the tracker.
pub(super) fn world_of(lattice: &Lattice) -> Result<World, String> {
    let back = lattice.to_volume.inverse();
    let (spacing, origin) = (lattice.grid.spacing, lattice.grid.origin.into());
    let axes = [back.matrix3.x_axis * spacing[0], back.matrix3.y_axis * spacing[1], back.matrix3.z_axis * spacing[2]];
    World::new(axes, back.transform_point3(origin))
}

impl Source for TrackedVolume {
    fn geometry(&self, _: usize) -> Geometry {
        Geometry::Cartesian(self.lattice.grid)
    }

    fn stored_type(&self) -> StoredType {
        self.pictures.stored_type()
    }

    fn sample_type(&self) -> SampleType {
        self.pictures.sample_type()
    }

    fn range(&self) -> [f64; 2] {
        self.pictures.range()
    }

    fn volumes(&self) -> usize {
        1
    }

    fn frames_per_volume(&self) -> usize {
        self.lattice.grid.size[2]
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        if volume > 0 {
            return Err(InputError::new(&self.path, "volume", format!("there is no {volume}, the last is 0")));
        }
        self.next = 0;
        Ok(())
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        if self.compounder.is_none() {
            self.compounder = Some(self.compound()?);
        }
        let slice = self.next;
        let Some(bytes) = self.compounder.as_ref().and_then(|compounder| compounder.slice(slice)) else {
            return Ok(None);
        };
        let frame = Frame {
            volume: 0,
            number: slice as u32,
            slice,
            backward: false,
            time: None,
            pose: None,
            bytes: bytes.to_vec(),
        };
        self.next += 1;
        Ok(Some(frame))
    }

    fn files(&self) -> Vec<PathBuf> {
        self.pictures.files().into_iter().chain(self.config.clone()).collect()
    }

    fn world(&self) -> Option<World> {
        Some(self.world)
    }
}
