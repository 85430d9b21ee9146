//! What the commands that draw pictures of a recording share: faults on the way, and marks on what is written.

use crate::gpu::GpuError;
use crate::marked;
use crate::picture::Picture;
use crate::scene::Scene;
use crate::terminal::{Failure, failed};
use std::borrow::Cow;
use std::time::SystemTime;

/// A device that was lost so often is given up: no band can become smaller.
pub const MAX_LOSSES: u32 = 6;

/// The picture as it is written: with its measurements, and its marks if the settings ask for them.
pub fn with_marks<'a>(picture: &'a Picture, scene: &Scene) -> Result<Cow<'a, Picture>, Failure> {
    match scene.settings.marks.bar {
        false if scene.settings.measure.is_empty() && !scene.has_reference() => Ok(Cow::Borrowed(picture)),
        false => marked::measured(picture, scene).map(Cow::Owned).map_err(failed),
        true => {
            let marked = marked::marked(picture, scene, &marked::time_line(SystemTime::now()), None);
            marked.map(Cow::Owned).map_err(failed)
        }
    }
}

/// Why a picture could not be drawn.
pub enum DrawFault {
    Gpu(GpuError),
    Source(Failure),
}

impl From<GpuError> for DrawFault {
    fn from(error: GpuError) -> DrawFault {
        DrawFault::Gpu(error)
    }
}
