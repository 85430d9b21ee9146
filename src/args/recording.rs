//! Opens the recordings of commands, and prints on one line which probe file was used.

use crate::source::formats::described;
use crate::source::phantom::{Phantom, PhantomOptions, PhantomSource};
use crate::source::{self, Calibration, DepthAxis, OpenOptions, Source};
use crate::sync::locked;
use crate::terminal::{Failure, input, say};
use crate::workspace::Origin;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The probe file that was said last: a recording that is opened again says nothing new.
static SAID: Mutex<Option<PathBuf>> = Mutex::new(None);

/// How the geometry of a recording is found.
#[derive(Clone, Default, clap::Args)]
pub struct GeometryArgs {
    /// Geometry of the probe (TOML) [default: NAME.probe.toml next to the recording, or probe.toml there if the recording does not state
    /// its own]
    #[arg(long, value_name = "FILE")]
    pub probe: Option<PathBuf>,
    /// Stored axis of a Cartesian volume that is drawn as depth: x, y, z, -x, -y or -z [default: by the file's orientation, otherwise y]
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    pub depth_axis: Option<DepthAxis>,
    /// Distance between the columns, rows and pictures of a folder or pattern of pictures, or of DICOM pictures that state none, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = three)]
    pub voxel_spacing: Option<[f64; 3]>,
    /// Configuration of the PLUS toolkit (XML) with the calibration of a tracked recording, which becomes a freehand volume
    #[arg(long, value_name = "FILE")]
    pub plus_config: Option<PathBuf>,
    /// A constant transform of a tracked recording, such as 'ImageToProbe=0.1 0 0 0  0 0.1 0 0  0 0 0.1 0  0 0 0 1'; may be repeated
    #[arg(long, value_name = "NAME=MATRIX")]
    pub calibration: Vec<Calibration>,
    /// Coordinate frame that a tracked recording is placed in [default: of the configuration; Reference, Tracker or World]
    #[arg(long, value_name = "NAME")]
    pub reference: Option<String>,
}

/// Three numbers with commas between them.
fn three(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    let three = numbers.and_then(|n| <[f64; 3]>::try_from(n).ok());
    three.ok_or_else(|| "must read X,Y,Z in mm, as 0.2,0.2,0.5".into())
}

impl GeometryArgs {
    /// Name of the first of these flags, `--probe` excepted, that was given; they apply only to recorded files. None if none was given.
    pub fn for_files(&self) -> Option<&'static str> {
        let given = [
            ("--depth-axis", self.depth_axis.is_some()),
            ("--voxel-spacing", self.voxel_spacing.is_some()),
            ("--plus-config", self.plus_config.is_some()),
            ("--calibration", !self.calibration.is_empty()),
            ("--reference", self.reference.is_some()),
        ];
        given.iter().find(|(_, is_given)| *is_given).map(|(flag, _)| *flag)
    }

    /// The description of a recording with this geometry that a workspace stores. Paths become absolute. The flags of tracked recordings are not
    /// stored.
    pub fn origin(&self, recording: Option<PathBuf>) -> Origin {
        let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
        let mut origin = Origin::of(recording.as_ref().map(absolute));
        origin.probe = self.probe.as_ref().map(absolute);
        origin.depth_axis = self.depth_axis.map(|axis| axis.to_string());
        origin.voxel_spacing = self.voxel_spacing;
        origin
    }

    /// These arguments; probe file, depth axis and voxel spacing are those of a workspace (`origin`) where the arguments do not state them.
    ///
    /// # Errors
    /// The depth axis of the workspace is not valid, even if the arguments state one.
    pub fn or(&self, origin: &Origin) -> Result<GeometryArgs, Failure> {
        let kept = origin.depth_axis.as_deref().map(str::parse).transpose();
        let kept = kept.map_err(|e: String| input(format!("workspace.depth_axis: {e}")))?;
        Ok(GeometryArgs {
            probe: self.probe.clone().or_else(|| origin.probe.clone()),
            depth_axis: self.depth_axis.or(kept),
            voxel_spacing: self.voxel_spacing.or(origin.voxel_spacing),
            ..self.clone()
        })
    }

    /// These arguments as options for opening a recording.
    pub fn options(&self) -> OpenOptions<'_> {
        OpenOptions {
            probe: self.probe.as_deref(),
            depth_axis: self.depth_axis,
            voxel_spacing: self.voxel_spacing,
            plus_config: self.plus_config.as_deref(),
            calibration: &self.calibration,
            reference: self.reference.as_deref(),
            ..OpenOptions::default()
        }
    }
}

/// Opens a recording, and tells which probe file its geometry comes from, as [`say_probe_file`] does.
///
/// # Errors
/// The file cannot be read as a recording with these options.
pub fn open_recording(path: &Path, options: OpenOptions) -> Result<Box<dyn Source>, Failure> {
    let source = source::open_with(path, options).map_err(input)?;
    say_probe_file(source.probe_file());
    Ok(source)
}

/// The phantom as a recording.
///
/// # Errors
/// None: its options are the default ones.
pub fn open_phantom() -> Result<Box<dyn Source>, Failure> {
    Ok(Box::new(PhantomSource::new(Phantom::new(PhantomOptions::default()).map_err(input)?)))
}

/// Prints on one line which probe file is used. Prints nothing for None, or if the last call that printed named the same file.
pub fn say_probe_file(file: Option<&Path>) {
    let mut said = locked(&SAID);
    if let Some(file) = file.filter(|file| said.as_deref() != Some(*file)) {
        say!("probe: {}", file.display());
        *said = Some(file.into());
    }
}

/// Help text of an argument that is a recording: the formats that can be read.
pub fn recording_help() -> String {
    format!("{}; a folder or a 'pattern*.png' of numbered pictures; - for standard input", described())
}
