//! Pictures of a file with places in space, as one freehand volume.

use super::{Compounder, CompoundingOptions, Lattice, Pose, TrackedFrame};
use crate::describe::{self, Rows};
use crate::files::{InputError, progress};
use crate::frame::{Source, check_volume, file_bytes};
use crate::probe::{Geometry, World};
use crate::{Frame, SampleType, StoredType};
use std::path::{Path, PathBuf};

/// A picture's pose, None if it is not known, and its samples.
pub(crate) type PlacedPicture = (Option<Pose>, Vec<u8>);

/// A sequence of pictures with poses that can be read again from the start.
pub(crate) trait PlacedPictures: Send {
    /// The source that the pictures are read from.
    fn pictures(&self) -> &dyn Source;
    /// Moves back to the first picture.
    ///
    /// # Errors
    /// Data that cannot be read.
    fn rewind(&mut self) -> Result<(), InputError>;
    /// The next picture and its pose, if that is known. None after the last picture.
    ///
    /// # Errors
    /// Data that cannot be read.
    fn next(&mut self) -> Result<Option<PlacedPicture>, InputError>;
    /// Every file that is read.
    fn files(&self) -> Vec<PathBuf> {
        self.pictures().files()
    }
}

/// A source of one volume, compounded from freehand pictures when the first slice is read.
///
/// Memory: that of a [`Compounder`], from the first slice on.
pub(crate) struct FreehandFile<P> {
    path: PathBuf,
    placed: P,
    lattice: Lattice,
    world: World,
    options: CompoundingOptions,
    compounder: Option<Compounder>,
    next: usize,
    /// All pictures, and those with a valid pose.
    counts: [usize; 2],
}

impl<P: PlacedPictures> FreehandFile<P> {
    /// A volume whose lattice contains the pictures. `poses`: the pose of each picture in their order; None if it is not known. Logs how many
    /// pictures have no valid pose.
    ///
    /// # Errors
    /// No picture has a valid pose, an option is out of its range, or the volume is too large.
    pub fn around(
        path: &Path,
        placed: P,
        poses: &[Option<Pose>],
        options: CompoundingOptions,
    ) -> Result<FreehandFile<P>, InputError> {
        let fault = |fault: String| InputError::new(path, "poses", fault);
        let known: Vec<Pose> = poses.iter().flatten().filter(|pose| pose.check().is_ok()).copied().collect();
        let (all, without) = (poses.len(), poses.len() - known.len());
        if known.is_empty() {
            return Err(fault(format!("none of {all} pictures has a valid one")));
        }
        let lattice = Lattice::around(&known, &options).map_err(fault)?;
        let world = lattice.world().map_err(fault)?;
        if without > 0 {
            let file = describe::path(path);
            tracing::warn!(%file, "{without} of {all} pictures have no valid pose; left out");
        }
        Ok(FreehandFile {
            path: path.into(),
            placed,
            lattice,
            world,
            options,
            compounder: None,
            next: 0,
            counts: [all, known.len()],
        })
    }

    pub fn placed(&self) -> &P {
        &self.placed
    }

    /// A description for users: pairs of title and value. `format`: name of the format of the pictures. `placed`: rows that say where their poses
    /// come from. `space`: name of the coordinate frame in which the volume lies.
    pub fn describe(&self, format: &str, placed: Vec<(String, String)>, space: &str) -> Vec<(String, String)> {
        let [all, valid] = self.counts;
        let mut rows = Vec::new();
        rows.add("format", format!("{format}, freehand"));
        rows.add("samples", self.sample_type().to_string());
        rows.add("pictures", format!("{all}, {valid} with a valid pose"));
        rows.extend(placed);
        rows.extend(describe::grid(&self.lattice.grid));
        let [u, v, w] = self.world.origin().to_array().map(describe::number);
        rows.add("position", format!("the first voxel is at {u}, {v}, {w} mm in {space}"));
        rows
    }

    fn compound(&mut self) -> Result<Compounder, InputError> {
        let fault = |fault: String| InputError::new(&self.path, "frames", fault);
        let stored = self.placed.pictures().stored_type();
        let mut compounder = Compounder::new(self.lattice, stored, self.options.clone()).map_err(fault)?;
        self.placed.rewind()?;
        let mut refused = None;
        while let Some((pose, bytes)) = self.placed.next()? {
            let Some(pose) = pose.filter(|pose| pose.check().is_ok()) else { continue };
            refused = compounder.push(&TrackedFrame { pose, stored, bytes: &bytes }).err().or(refused);
        }
        if let Some(why) = refused {
            let (file, count) = (describe::path(&self.path), compounder.counts().refused);
            tracing::warn!(%file, "{count} of {} pictures are refused, the last: {why}; left out", self.counts[0]);
        }
        compounder.changed_slices();
        Ok(compounder)
    }
}

impl<P: PlacedPictures> Source for FreehandFile<P> {
    fn geometry(&self, _: usize) -> Geometry {
        Geometry::Cartesian(self.lattice.grid)
    }

    passed_on! { self to self.placed.pictures();
        stored_type() -> StoredType;
        sample_type() -> SampleType;
        range() -> [f64; 2];
    }

    fn volumes(&self) -> usize {
        1
    }

    fn frames_per_volume(&self) -> usize {
        self.lattice.grid.size[2]
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        check_volume(&self.path, volume, 1)?;
        self.next = 0;
        Ok(())
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        self.prepare()?;
        let slice = self.next;
        let bytes = self.compounder.as_ref().and_then(|compounder| compounder.slice(slice));
        let frame = bytes.map(|bytes| Frame::of_slice(0, slice, bytes.to_vec()));
        self.next += usize::from(frame.is_some());
        Ok(frame)
    }

    fn prepare(&mut self) -> Result<(), InputError> {
        if self.compounder.is_none() {
            progress::expect_bytes(file_bytes(self.placed.pictures()));
            self.compounder = Some(self.compound()?);
        }
        Ok(())
    }

    fn files(&self) -> Vec<PathBuf> {
        self.placed.files()
    }

    fn world(&self) -> Option<World> {
        Some(self.world)
    }
}
