//! Shows the labels of a segmentation with a recording.

use crate::files::InputError;
use crate::probe::{Geometry, World};
use crate::scene::load::Layers;
use crate::segment::files;
use crate::source::OpenOptions;
use crate::terminal::{Failure, input};
use std::path::Path;

/// Adds the labels of a file to the settings for a volume. `geometry`: that of the volume. `world`: map from its voxels to world coordinates; None if
/// that is not known.
///
/// # Errors
/// The file cannot be read as a segmentation, it has no labels or too many, or all of them lie beside the volume.
pub fn show_labels(layers: &mut Layers, file: &Path, geometry: &Geometry, world: Option<World>) -> Result<(), Failure> {
    let (labels, segments) = files::read(file, OpenOptions::default()).map_err(input)?;
    let fault = |why: String| input(InputError::new(file, "labels", why));
    let shown = files::shown(&labels, &segments, geometry, world).map_err(fault)?;
    layers.show_labels(shown.into());
    Ok(())
}
