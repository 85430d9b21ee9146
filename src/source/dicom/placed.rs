//! Where the frames of DICOM files lie, and the layout that follows from it.

use super::super::describe;
use super::super::layout::{Layout, StoredGeometry};
use super::super::packed::{Encoding, Pixels};
use super::frames::Frames;
use super::image::{Arrangement, Image};
use crate::files::InputError;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The geometry and the times of the frames of a file, and the order in which they are read.
pub(super) struct Placed {
    pub format: &'static str,
    pub geometry: StoredGeometry,
    /// Indices of the frames in the file, in the order in which they are read.
    pub order: Vec<usize>,
    /// The part of each picture that is read: first column, first row, columns and rows.
    pub part: [usize; 4],
    /// True if the file states the distance between its pixels, so that `--voxel-spacing` is refused.
    pub has_spacing: bool,
    /// Time stamp of each frame, s, by its index in `order`; no entry if it has none.
    pub times: BTreeMap<usize, f64>,
    pub remarks: Vec<(String, String)>,
    /// One line for each statement of the file that is wrong or missing.
    pub warnings: BTreeSet<String>,
}

/// The layout of a recording of these frames. `path`: as the user named it. `direct`: the location of the samples if they can be read from the
/// file without decoding.
pub(super) fn layout(
    files: Vec<PathBuf>,
    path: PathBuf,
    mut image: Image,
    placed: Placed,
    direct: Option<Pixels>,
) -> Result<Layout, InputError> {
    let Placed { format, geometry, order, part, has_spacing, times, mut remarks, warnings } = placed;
    warn(&path, &image.warnings | &warnings, &mut remarks);
    // A decoder that turns colours into luminance leaves one channel, of which the remark on channels does not say that the file has colours.
    if !matches!(image.arrangement, Arrangement::Plain | Arrangement::Planes) {
        remarks.push(("colours".into(), "read as their luminance".into()));
    }
    let [_, _, columns, rows] = part;
    image.places = order.iter().filter_map(|n| image.places.get(*n).copied()).collect();
    let length = image.parts.iter().fold(0u64, |all, (_, length)| all.saturating_add(*length));
    let (pixel, encoding) = (image.pixel, Encoding::Dicom(image.coding));
    let pixels = Pixels::gathered(&path, encoding, length, Frames { files, image, part });
    let stated = Layout::new(format, pixel, [columns, rows], order.len(), pixels, geometry);
    let mut layout = Layout { states_geometry: has_spacing, times, remarks, ..stated };
    if let Some(direct) = direct {
        layout.pixels = direct;
        if !layout.pixels.is_compressed() {
            layout.pixels.length = layout.pixels.length.min(layout.frame_bytes() * layout.frames as u64);
        }
    }
    layout.check(&path, "frames (0028,0008)")?;
    Ok(layout)
}

/// Most warnings of the files of a folder.
const MOST_WARNINGS: usize = 16;

/// Says what is not as a file states, at once and in its description.
fn warn(path: &Path, warnings: BTreeSet<String>, remarks: &mut Vec<(String, String)>) {
    for text in warnings.into_iter().take(MOST_WARNINGS) {
        tracing::warn!(file = %describe::path(path), "{text}");
        remarks.push(("warning".into(), text));
    }
}

/// Indices of all frames of a file, in its order.
pub(super) fn in_order(image: &Image) -> Vec<usize> {
    (0..image.places.len()).collect()
}
