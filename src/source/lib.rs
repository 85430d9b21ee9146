//! Sources of frames: files, the phantom, a pipe, and OpenIGTLink, whose tracked frames are compounded. Frames of a free-running probe are
//! placed by the motor's position.
//!
//! Every reader is total: any bytes give frames or an [`InputError`], never a panic. No reader takes more memory than the bytes of its
//! file account for, or than a live source documents. A volume that is larger than half of the memory of this machine is refused
//! ([`memory`]).

#![forbid(unsafe_code)]

/// Methods of a trait that do nothing but call the same method of another value.
macro_rules! passed_on {
    ($self:ident to $to:expr; $($name:ident($($given:ident: $kind:ty)?) -> $result:ty;)+) => {
        $(fn $name(&$self $(, $given: $kind)?) -> $result {
            $to.$name($($given)?)
        })+
    };
}

pub mod cardiac;
pub mod coarse;
pub mod convert;
mod data_files;
pub mod describe;
mod dicom;
mod drawn;
pub mod formats;
mod frame;
pub mod freehand;
mod gathered;
pub mod igtl;
pub mod keys;
mod kretz;
mod layout;
pub mod live;
mod metaimage;
pub mod motor_tracking;
mod nifti;
mod nrrd;
mod packed;
pub mod parts;
pub mod phantom;
mod pictures;
pub mod piped;
mod piped_file;
mod piped_record;
mod pixel;
mod plus;
mod plus_config;
pub mod posed;
pub mod recorder;
pub mod recording;
mod samples;
pub mod segmentation;
pub mod sequence;
mod stack;
pub mod standard_input;
mod tracked;
mod transforms;
#[cfg(feature = "uff")]
mod uff;
mod units;
mod value_range;
pub mod volume_file;
pub mod volume_sequence;

use echolume_base::{files, memory, statistics, sync, text, tree};
use echolume_probe as probe;

pub use crate::files::InputError;
pub use crate::probe::{DepthAxis, Frame, Geometry, Grid, SampleType, StoredType};
pub use frame::{DEMO_DATA, Header, Source, VolumeFrames};
pub use recording::Recording;
pub use transforms::Calibration;

use formats::Reads;
use keys::Unused;
use std::path::Path;

/// Options that a user gives for opening a recording.
#[derive(Clone, Copy, Debug, Default)]
pub struct OpenOptions<'a> {
    /// Path of the probe file. None: the probe file that belongs to the recording, if there is one.
    pub probe: Option<&'a Path>,
    /// The axis of a Cartesian volume that is drawn as depth. Axes count in the order that the file states for drawing, otherwise as they are stored.
    /// None: y, the second of them.
    pub depth_axis: Option<DepthAxis>,
    /// Distance between the voxels of pictures (a stack, or DICOM) that do not state it, mm: from column to column, row to row, picture to picture.
    /// It is an error for other recordings. None: that of the files.
    pub voxel_spacing: Option<[f64; 3]>,
    /// Path of a configuration of the PLUS toolkit (XML), by which tracked pictures become a freehand volume.
    pub plus_config: Option<&'a Path>,
    /// Constant transforms for tracked pictures. They take precedence over those of the PLUS configuration.
    pub calibration: &'a [Calibration],
    /// Name of the coordinate frame in which tracked pictures become a volume. None: that of the PLUS configuration, otherwise the first of
    /// Reference, Tracker and World to which transforms lead.
    pub reference: Option<&'a str>,
    /// Options for pictures with poses, which become a freehand volume.
    pub freehand: freehand::FreehandArguments,
}

/// Opens a recording of any format with default options ([`open_with`]). `probe`: path of the probe file; None: the one that belongs to the
/// recording, if there is one.
///
/// # Errors
/// One line that names the file: that of [`open_with`].
pub fn open(path: &Path, probe: Option<&Path>) -> Result<Box<dyn Source>, InputError> {
    open_with(path, OpenOptions { probe, ..OpenOptions::default() })
}

/// True if a file is DICOM, whatever its name. Reads its first 132 bytes.
pub fn is_dicom(path: &Path) -> bool {
    dicom::is_dicom(path)
}

/// Opens a recording of any format, among them `.frames` files and saved streams of frames. The content of a file decides its format. The path `-` is
/// standard input.
///
/// # Errors
/// One line that names the file: it cannot be read, is of no known format, is damaged, its volume is too large, or an option does not fit it.
pub fn open_with(path: &Path, options: OpenOptions) -> Result<Box<dyn Source>, InputError> {
    if standard_input::is_meant(path) {
        let source = open_file(&standard_input::file()?, options).map_err(standard_input::renamed)?;
        return Ok(Box::new(standard_input::FromInput(source)));
    }
    open_file(path, options)
}

fn open_file(path: &Path, options: OpenOptions) -> Result<Box<dyn Source>, InputError> {
    Ok(match formats::reads(path) {
        Some(Reads::Frames) => posed::Opened::new(path, Box::new(frames(path, options)?), options.freehand)?.source(),
        Some(Reads::Stream) => posed::Opened::new(path, Box::new(stream(path, options)?), options.freehand)?.source(),
        Some(Reads::Uff) => uff(path, options)?.0,
        _ if tracked::is_asked_for(&options) => Box::new(tracked_volume(path, options)?),
        _ => {
            let recording = recording(path, options)?;
            recording.warn_of_tracking();
            Box::new(recording)
        }
    })
}

/// Describes a recording for users, without the name or number of a patient.
///
/// # Errors
/// One line that names the file: the recording cannot be opened ([`open_with`]). A `.frames` file is read completely, which may fail, too.
pub fn description(path: &Path, options: OpenOptions) -> Result<Description, InputError> {
    if standard_input::is_meant(path) {
        return file_description(&standard_input::file()?, options).map_err(standard_input::renamed);
    }
    file_description(path, options)
}

/// A description of a recording for users.
#[derive(Clone, Debug)]
pub struct Description {
    /// Pairs of title and value. They never contain a patient's name or number.
    pub rows: Vec<(String, String)>,
    /// Names of keys that the file states and that were not used.
    pub unused: Unused,
}

fn file_description(path: &Path, options: OpenOptions) -> Result<Description, InputError> {
    let (rows, unused) = match formats::reads(path) {
        Some(Reads::Frames) => {
            let opened = posed::Opened::new(path, Box::new(frames(path, options)?), options.freehand)?;
            (opened.description(frames(path, options)?.description()?), Unused::default())
        }
        Some(Reads::Stream) => {
            let opened = posed::Opened::new(path, Box::new(stream(path, options)?), options.freehand)?;
            (opened.description(stream(path, options)?.description()), Unused::default())
        }
        Some(Reads::Uff) => {
            let (_, description) = uff(path, options)?;
            return Ok(description);
        }
        _ if tracked::is_asked_for(&options) => {
            let volume = tracked_volume(path, options)?;
            (volume.description(), volume.unused().clone())
        }
        _ => {
            let recording = recording(path, options)?;
            (recording.description(), recording.unused().clone())
        }
    };
    Ok(Description { rows, unused })
}

fn recording(path: &Path, options: OpenOptions) -> Result<Recording, InputError> {
    options.freehand.refused(path)?;
    Recording::open_with(path, options)
}

fn tracked_volume(path: &Path, options: OpenOptions) -> Result<tracked::TrackedVolume, InputError> {
    // The folder's probe file is for scan lines; what was given with it is refused by the volume.
    let pictures = Recording::open_with(path, OpenOptions { probe: None, depth_axis: None, ..options })?;
    tracked::TrackedVolume::new(path, pictures, &options)
}

fn frames(path: &Path, options: OpenOptions) -> Result<recorder::Reader, InputError> {
    only_probe(path, options)?;
    recorder::Reader::open(path)
}

fn stream(path: &Path, options: OpenOptions) -> Result<piped_file::PipedFile, InputError> {
    only_probe(path, options)?;
    piped_file::PipedFile::open(path, options.probe)
}

/// The source of a UFF file, and its description.
fn uff(path: &Path, options: OpenOptions) -> Result<(Box<dyn Source>, Description), InputError> {
    let fault = |flag: &str| Err(InputError::new(path, flag, "is not for UFF, which states its own geometry"));
    match options {
        OpenOptions { probe: Some(_), .. } => fault("--probe"),
        OpenOptions { depth_axis: Some(_), .. } => fault("--depth-axis"),
        OpenOptions { voxel_spacing: Some(_), .. } => fault("--voxel-spacing"),
        _ if tracked::is_asked_for(&options) => fault("--plus-config"),
        _ => {
            options.freehand.refused(path)?;
            #[cfg(feature = "uff")]
            return uff::Beamformed::open(path).and_then(|file| {
                frame::check_memory(path, &file.geometry(0), file.stored_type())?;
                let description = Description { rows: file.description(), unused: file.unused().clone() };
                Ok((Box::new(file) as Box<dyn Source>, description))
            });
            #[cfg(not(feature = "uff"))]
            Err(InputError::new(path, "file", left_out("UFF (HDF5)", "uff")))
        }
    }
}

/// Refuses what does not apply to frames as they arrived.
fn only_probe(path: &Path, options: OpenOptions) -> Result<(), InputError> {
    let fault = "is not for frames as they arrived";
    match (options.depth_axis, options.voxel_spacing) {
        (Some(_), _) => Err(InputError::new(path, "--depth-axis", fault)),
        (_, Some(_)) => Err(InputError::new(path, "--voxel-spacing", fault)),
        _ if tracked::is_asked_for(&options) => {
            Err(InputError::new(path, "--plus-config", "is for tracked pictures, not for frames as they arrived"))
        }
        (None, None) => Ok(()),
    }
}

/// Says of a format how to have it in a build without it.
#[cfg(not(all(feature = "jpeg2000", feature = "uff")))]
fn left_out(format: &str, feature: &str) -> String {
    format!(
        "is {format}, and this program was built without the feature `{feature}`; build it with `cargo build --release`"
    )
}
