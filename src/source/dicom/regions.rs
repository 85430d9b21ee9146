//! Ultrasound pictures: the region of each picture that is calibrated (PS3.3 C.8.5.5), and frames in time.
//!
//! Only the region is read. What stands around it are words, scales and sometimes names.

use super::super::OpenOptions;
use super::super::describe::number;
use super::super::layout::{Cartesian, StoredGeometry};
use super::elements::Item;
use super::image::Image;
use super::placed::{Placed, in_order};
use super::tags::{self, Tag};
use super::volume::directions;
use crate::files::InputError;
use crate::probe::file::SLAB;
use crate::probe::{AxisOrder, World};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Codes of a region: pictures in two dimensions, of tissue.
const TWO_DIMENSIONS: u16 = 1;
const TISSUE: u16 = 1;
/// Largest difference of two scales that are the same, as a share.
const MAX_APART: f64 = 0.01;
/// What pictures lack that have no geometry.
const NO_SPACING: &str =
    "does not say how large its pixels are: give --voxel-spacing X,Y,Z (mm), or --probe for scan lines";

/// A calibrated part of a picture.
struct Region {
    /// First column and row, columns and rows.
    part: [usize; 4],
    /// mm; None if the region states no scale.
    spacing: Option<[f64; 2]>,
    /// The place of the first pixel, mm.
    origin: [f64; 2],
    is_tissue: bool,
    /// A delta is below 0: the value falls where the pixel rises.
    is_backward: bool,
}

impl Region {
    /// None for one that is no picture, or is not in the image.
    fn of(item: &Item, size: [usize; 2]) -> Option<Region> {
        let [x0, y0, x1, y1] = tags::REGION_BOX.map(|tag| item.long(tag));
        let (x0, y0) = (x0? as usize, y0? as usize);
        // Some scanners state the first pixel behind the region.
        let (x1, y1) = ((x1? as usize).min(size[0] - 1), (y1? as usize).min(size[1] - 1));
        let is_picture = item.word(tags::REGION_FORMAT) == Some(TWO_DIMENSIONS);
        let units = tags::UNITS.map(|tag| item.word(tag));
        if !is_picture || units != [Some(tags::CENTIMETRES); 2] || x1 < x0 || y1 < y0 {
            return None;
        }
        let spacing = match tags::DELTA.map(|tag| item.real(tag).map(|cm| cm.abs() * 10.0)) {
            [Some(dx), Some(dy)] if dx > 0.0 && dy > 0.0 => Some([dx, dy]),
            _ => None,
        };
        let reference = |n: usize| {
            let Some(spacing) = spacing else { return 0.0 };
            let pixel = item.long(tags::REFERENCE_PIXEL[n]).map_or(0, u32::cast_signed);
            let value = item.real(tags::REFERENCE_VALUE[n]).unwrap_or(0.0) * 10.0;
            value - f64::from(pixel) * spacing[n]
        };
        Some(Region {
            part: [x0, y0, x1 - x0 + 1, y1 - y0 + 1],
            spacing,
            origin: [reference(0), reference(1)],
            is_tissue: item.word(tags::REGION_TYPE) == Some(TISSUE),
            is_backward: tags::DELTA.into_iter().any(|tag| item.real(tag).is_some_and(|cm| cm < 0.0)),
        })
    }

    /// The largest region of tissue, otherwise the largest, of an image; one with a scale before others. The number of regions comes with it.
    fn choose(root: &Item, size: [usize; 2]) -> (Option<Region>, usize) {
        let items = root.items(tags::REGIONS);
        let regions = items.iter().filter_map(|item| Region::of(item, size));
        let best =
            regions.max_by_key(|region| (region.is_tissue, region.spacing.is_some(), region.part[2] * region.part[3]));
        (best, items.len())
    }
}

/// The part of a file's pictures that is read, and its position in their plane.
pub(super) struct Flat {
    /// The part of each picture that is read: first column, first row, columns and rows.
    pub part: [usize; 4],
    /// Distance between pixels (x, y), mm. None if nothing states it.
    pub spacing: Option<[f64; 2]>,
    /// Position (x, y) of the first pixel of the part, mm from the origin that the region states; 0 without a region with a scale.
    pub origin: [f64; 2],
    pub remarks: Vec<(String, String)>,
    /// One line for each statement of the file that is wrong or missing.
    pub warnings: BTreeSet<String>,
}

/// The ultrasound region of a picture of `size` pixels, with its scale; the whole picture with its pixel spacing if there is no usable region.
pub(super) fn flat(root: &Item, size: [usize; 2]) -> Flat {
    let (region, count) = Region::choose(root, size);
    let mut warnings = BTreeSet::new();
    let stated = pixel_spacing(root, &mut warnings);
    let Some(Region { part, spacing, origin, is_backward, .. }) = region else {
        if count > 0 {
            let text = format!("none of {count} regions (0018,6011) is a picture in centimetres");
            warnings.insert(format!("{text}, so the whole picture is read; {}", instead(stated)));
        }
        let part = [0, 0, size[0], size[1]];
        return Flat { part, spacing: stated, origin: [0.0; 2], remarks: Vec::new(), warnings };
    };
    let [x, y, columns, rows] = part;
    let (right, bottom) = (x + columns - 1, y + rows - 1);
    let place = format!("columns {x} .. {right}, rows {y} .. {bottom} of {} x {} pixels", size[0], size[1]);
    let place = if count > 1 { format!("one of {count}: {place}") } else { place };
    let mut remarks = vec![("region".into(), format!("{place}; what is around it is not read"))];
    if is_backward {
        warnings
            .insert("physical delta (0018,602C) or (0018,602E) is below 0; its size counts, not its direction".into());
    }
    match (spacing, stated) {
        (None, _) => {
            let text = "physical delta (0018,602C) or (0018,602E) of the region is 0 or missing";
            warnings.insert(format!("{text}; {}", instead(stated)));
        }
        (Some(a), Some(b)) if (0..2).any(|n| (a[n] - b[n]).abs() > MAX_APART * a[n]) => {
            let text = format!("{} of the region; pixel spacing (0028,0030) says {}", spacing_text(a), spacing_text(b));
            remarks.push(("scale".into(), text));
        }
        _ => {}
    }
    Flat { part, spacing: spacing.or(stated), origin, remarks, warnings }
}

/// What counts where the regions have no scale.
fn instead(stated: Option<[f64; 2]>) -> &'static str {
    match stated {
        Some(_) => "pixel spacing (0028,0030) counts instead",
        None => "nor is there a pixel spacing (0028,0030), so the picture has no scale",
    }
}

/// Columns and rows of the pixel spacing, mm; None if there is none that can be one.
fn pixel_spacing(root: &Item, warnings: &mut BTreeSet<String>) -> Option<[f64; 2]> {
    match root.decimals(tags::PIXEL_SPACING)[..] {
        [rows, columns] if [rows, columns].iter().all(|mm| mm.is_finite() && *mm > 0.0) => Some([columns, rows]),
        _ if root.text(tags::PIXEL_SPACING).is_empty() => None,
        _ => {
            warnings.insert("pixel spacing (0028,0030) is not two lengths above 0; it is not used".into());
            None
        }
    }
}

/// Position (mm) of the first pixel of the part, and unit vectors towards larger columns and larger rows, in the patient's space. None if the
/// file does not state them.
pub(super) fn in_patient(root: &Item, flat: &Flat) -> Option<(DVec3, [DVec3; 2])> {
    let at = DVec3::from(*root.decimals(tags::POSITION_PATIENT).first_chunk::<3>()?);
    let [row, column] = directions(&root.decimals(tags::ORIENTATION_PATIENT))?;
    let [dx, dy] = flat.spacing?;
    Some((at + row * dx * flat.part[0] as f64 + column * dy * flat.part[1] as f64, [row, column]))
}

/// The frames of a file of 2D pictures as a series in time.
///
/// # Errors
/// One line that names the file: the geometry that it states is impossible.
pub(super) fn pictures(path: &Path, root: &Item, image: &Image, options: &OpenOptions) -> Result<Placed, InputError> {
    let flat = flat(root, image.size);
    let frames = image.places.len();
    let geometry = of_pictures(path, root, &flat, frames, options)?;
    let (remarks, mut warnings) = (flat.remarks, flat.warnings);
    let times = times(root, frames, &mut warnings);
    let (order, part, has_spacing) = (in_order(image), flat.part, flat.spacing.is_some());
    Ok(Placed { format: "DICOM ultrasound pictures", geometry, order, part, has_spacing, times, remarks, warnings })
}

/// The distance of slices that a secondary capture states for its frames, mm; None if they are no even stack.
fn slice_step(root: &Item, frames: usize) -> Option<f64> {
    let places = root.decimals(tags::SLICE_LOCATIONS);
    let [first, .., last] = places[..] else { return None };
    let step = (last - first) / (places.len() - 1) as f64;
    let is_even = |(n, place): (usize, &f64)| (place - first - step * n as f64).abs() <= 0.01 * step;
    (places.len() == frames && step > 0.0 && places.iter().enumerate().all(is_even)).then_some(step)
}

/// The geometry of a file of pictures: each is a volume of one slice. A secondary capture that states evenly spaced positions of its slices is
/// one volume. [`StoredGeometry::Missing`] if neither the file nor `options.voxel_spacing` states a distance between pixels.
///
/// # Errors
/// One line that names the file: the geometry that it states is impossible.
pub(super) fn of_pictures(
    path: &Path,
    root: &Item,
    flat: &Flat,
    frames: usize,
    options: &OpenOptions,
) -> Result<StoredGeometry, InputError> {
    let step = slice_step(root, frames);
    let thickness = step.or(root.decimal(tags::SLICE_THICKNESS).filter(|mm| *mm > 0.0)).unwrap_or(SLAB);
    let (spacing, field) = match (flat.spacing, options.voxel_spacing) {
        (Some([x, y]), _) => ([x, y, thickness], "pixel spacing"),
        (None, Some(spacing)) => (spacing, "--voxel-spacing"),
        (None, None) => return Ok(StoredGeometry::Missing(InputError::new(path, "pixel spacing", NO_SPACING))),
    };
    let (origin, [row, column]) =
        in_patient(root, flat).unwrap_or((DVec3::new(flat.origin[0], flat.origin[1], 0.0), [DVec3::X, DVec3::Y]));
    let axes = [row * spacing[0], column * spacing[1], row.cross(column) * spacing[2]];
    let world = World::new(axes, origin).map_err(|why| InputError::new(path, field, why))?;
    let [slices, volumes] = if step.is_some() { [frames, 1] } else { [1, frames] };
    let size = [flat.part[2], flat.part[3], slices];
    Ok(StoredGeometry::Cartesian(Cartesian { size, volumes, world, order: AxisOrder::STORED }))
}

/// The times of frames, s. The frame increment pointer says whether they have one distance, or each its own. Without it, or if what it
/// names is of no use, the other one counts.
fn times(root: &Item, frames: usize, warnings: &mut BTreeSet<String>) -> BTreeMap<usize, f64> {
    if frames < 2 {
        return BTreeMap::new();
    }
    let pointer = root.words(tags::FRAME_POINTER);
    let names: Vec<Tag> = pointer.as_chunks::<2>().0.iter().map(|[g, e]| Tag::from(*g) << 16 | Tag::from(*e)).collect();
    let (vector, single) = (vector_times(root, frames), single_times(root, frames));
    let is_there = |tag| !root.text(tag).is_empty();
    let order = match names.contains(&tags::FRAME_TIME) {
        true => [(tags::FRAME_TIME, single), (tags::FRAME_TIME_VECTOR, vector)],
        false => [(tags::FRAME_TIME_VECTOR, vector), (tags::FRAME_TIME, single)],
    };
    let name = |tag| if tag == tags::FRAME_TIME { "frame time (0018,1063)" } else { "frame time vector (0018,1065)" };
    let is_named = names.contains(&order[0].0);
    let is_both = is_there(tags::FRAME_TIME) && is_there(tags::FRAME_TIME_VECTOR);
    let chosen = order.iter().find(|(_, times)| times.is_some()).map(|(tag, _)| *tag);
    let counts = chosen.map_or("the frames have no times".into(), |tag| format!("{} counts", name(tag)));
    if chosen != Some(order[0].0) && (is_named || is_there(order[0].0)) {
        warnings.insert(format!("{} is missing, or gives no times for {frames} frames; {counts}", name(order[0].0)));
    } else if !is_named && (is_both || (chosen.is_some() && !names.is_empty())) {
        warnings.insert(format!("frame increment pointer (0028,0009) is missing, or names no times; {counts}"));
    }
    order.into_iter().find_map(|(_, times)| times).unwrap_or_default()
}

/// By the frame time vector, each the time since the frame before; None if it is not one for each frame.
fn vector_times(root: &Item, frames: usize) -> Option<BTreeMap<usize, f64>> {
    let each = root.decimals(tags::FRAME_TIME_VECTOR);
    let is_whole = each.len() == frames && each.iter().all(|ms| ms.is_finite() && *ms >= 0.0);
    let mut now = 0.0;
    let next = |(n, ms): (usize, &f64)| {
        now += ms / 1e3;
        (n, now)
    };
    is_whole.then(|| each.iter().enumerate().map(next).collect())
}

/// By the frame time, which is the same between all frames.
fn single_times(root: &Item, frames: usize) -> Option<BTreeMap<usize, f64>> {
    let ms = root.decimal(tags::FRAME_TIME).filter(|ms| *ms > 0.0)?;
    Some((0..frames).map(|n| (n, n as f64 * ms / 1e3)).collect())
}

/// Two lengths in mm as text for users, such as `0.2 x 0.2 mm`.
pub(super) fn spacing_text(spacing: [f64; 2]) -> String {
    let [x, y] = spacing.map(number);
    format!("{x} x {y} mm")
}
