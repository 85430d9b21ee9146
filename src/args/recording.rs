//! Recordings as commands open them: the probe file that was taken is said on one line.

use crate::source::{self, DepthAxis, OpenOptions, Source};
use crate::terminal::{Failure, input, say};
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
}

impl GeometryArgs {
    /// The same for the library.
    pub fn options(&self) -> OpenOptions<'_> {
        OpenOptions { probe: self.probe.as_deref(), depth_axis: self.depth_axis }
    }
}

/// Opens a recording and says which probe file its geometry is from, if any.
pub fn open_recording(path: &Path, options: OpenOptions) -> Result<Box<dyn Source>, Failure> {
    let source = source::open_with(path, options).map_err(input)?;
    say_probe_file(source.probe_file());
    Ok(source)
}

/// Says on one line which probe file is used.
pub fn say_probe_file(file: Option<&Path>) {
    let mut said = SAID.lock().unwrap_or_else(|e| e.into_inner());
    if let Some(file) = file.filter(|file| said.as_deref() != Some(*file)) {
        say!("probe: {}", file.display());
        *said = Some(file.into());
    }
}
