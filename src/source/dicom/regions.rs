//! Ultrasound pictures: the region of each picture that is calibrated (PS3.3 C.8.5.5), and frames in time.
//!
//! Only the region is read. What stands around it are words, scales and sometimes names.

use super::super::OpenOptions;
use super::super::describe::number;
use super::super::layout::{Cartesian, StoredGeometry};
use super::elements::{self as tags, Item};
use super::image::Image;
use super::placed::{Placed, in_order};
use super::volume::directions;
use crate::files::InputError;
use crate::probe::file::SLAB;
use crate::probe::{AxisOrder, World};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::Path;

/// Codes of a region: pictures in two dimensions, of tissue, in centimetres.
const TWO_DIMENSIONS: u16 = 1;
const TISSUE: u16 = 1;
const CENTIMETRES: u16 = 3;
/// What pictures lack that have no geometry.
const NO_SPACING: &str =
    "does not say how large its pixels are: give --voxel-spacing X,Y,Z (mm), or --probe for scan lines";

/// A calibrated part of a picture.
struct Region {
    /// First column and row, columns and rows.
    part: [usize; 4],
    /// mm.
    spacing: [f64; 2],
    /// The place of the first pixel, mm.
    origin: [f64; 2],
    is_tissue: bool,
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
        if !is_picture || units != [Some(CENTIMETRES); 2] || x1 < x0 || y1 < y0 {
            return None;
        }
        let [dx, dy] = tags::DELTA.map(|tag| item.real(tag));
        let (dx, dy) = (dx?.abs() * 10.0, dy?.abs() * 10.0);
        let reference = |n: usize, step: f64| {
            let pixel = item.long(tags::REFERENCE_PIXEL[n]).map_or(0, u32::cast_signed);
            let value = item.real(tags::REFERENCE_VALUE[n]).unwrap_or(0.0) * 10.0;
            value - f64::from(pixel) * step
        };
        Some(Region {
            part: [x0, y0, x1 - x0 + 1, y1 - y0 + 1],
            spacing: [dx, dy],
            origin: [reference(0, dx), reference(1, dy)],
            is_tissue: item.word(tags::REGION_TYPE) == Some(TISSUE),
        })
    }

    /// The largest region of tissue, otherwise the largest, of an image. The number of regions comes with it.
    fn choose(root: &Item, size: [usize; 2]) -> (Option<Region>, usize) {
        let items = root.items(tags::REGIONS);
        let regions = items.iter().filter_map(|item| Region::of(item, size));
        let best = regions.max_by_key(|region| (region.is_tissue, region.part[2] * region.part[3]));
        (best, items.len())
    }
}

/// How the pictures of a file lie in a plane.
pub(super) struct Flat {
    /// The part that is read: first column and row, columns and rows.
    pub part: [usize; 4],
    /// mm; None if nothing states it.
    pub spacing: Option<[f64; 2]>,
    /// The first pixel of the part, mm.
    pub origin: [f64; 2],
    pub remarks: Vec<(String, String)>,
}

/// The region, otherwise the whole picture with its pixel spacing.
pub(super) fn flat(root: &Item, size: [usize; 2]) -> Flat {
    let (region, count) = Region::choose(root, size);
    if let Some(Region { part, spacing, origin, .. }) = region {
        let [x, y, columns, rows] = part;
        let text = format!(
            "columns {x} .. {}, rows {y} .. {} of {} x {} pixels; what is around it is not read",
            x + columns - 1,
            y + rows - 1,
            size[0],
            size[1]
        );
        let text = if count > 1 { format!("one of {count}: {text}") } else { text };
        return Flat { part, spacing: Some(spacing), origin, remarks: vec![("region".into(), text)] };
    }
    let spacing = match root.decimals(tags::PIXEL_SPACING)[..] {
        [rows, columns] => Some([columns, rows]),
        _ => None,
    };
    Flat { part: [0, 0, size[0], size[1]], spacing, origin: [0.0; 2], remarks: Vec::new() }
}

/// The plane of a picture in the patient's space: the first pixel of its part, and the directions of rising column and row.
pub(super) fn in_patient(root: &Item, flat: &Flat) -> Option<(DVec3, [DVec3; 2])> {
    let at = DVec3::from(*root.decimals(tags::POSITION_PATIENT).first_chunk::<3>()?);
    let [row, column] = directions(&root.decimals(tags::ORIENTATION_PATIENT))?;
    let [dx, dy] = flat.spacing?;
    Some((at + row * dx * flat.part[0] as f64 + column * dy * flat.part[1] as f64, [row, column]))
}

/// The frames of a file as pictures in time.
pub(super) fn pictures(path: &Path, root: &Item, image: &Image, options: &OpenOptions) -> Result<Placed, InputError> {
    let flat = flat(root, image.size);
    let frames = image.places.len();
    let geometry = of_pictures(path, root, &flat, frames, options)?;
    let (times, remarks) = (times(root, frames), flat.remarks);
    let (part, has_spacing) = (flat.part, flat.spacing.is_some());
    Ok(Placed {
        format: "DICOM ultrasound pictures",
        geometry,
        order: in_order(image),
        part,
        has_spacing,
        times,
        remarks,
    })
}

/// The distance of slices that a secondary capture states for its frames, mm; None if they are no even stack.
fn slice_step(root: &Item, frames: usize) -> Option<f64> {
    let places = root.decimals(tags::SLICE_LOCATIONS);
    let [first, .., last] = places[..] else { return None };
    let step = (last - first) / (places.len() - 1) as f64;
    let is_even = |(n, place): (usize, &f64)| (place - first - step * n as f64).abs() <= 0.01 * step;
    (places.len() == frames && step > 0.0 && places.iter().enumerate().all(is_even)).then_some(step)
}

/// The geometry of pictures in time, each a volume of one slice; of a secondary capture that states where its slices are, a volume.
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

/// The times of frames, s: at one distance, or each after the one before.
fn times(root: &Item, frames: usize) -> BTreeMap<usize, f64> {
    let each = root.decimals(tags::FRAME_TIME_VECTOR);
    if frames > 1 && each.len() == frames && each.iter().all(|ms| ms.is_finite()) {
        // Each is the time since the frame before.
        let mut now = 0.0;
        let mut times = BTreeMap::new();
        for (n, ms) in each.iter().enumerate() {
            now += ms / 1e3;
            times.insert(n, now);
        }
        return times;
    }
    match root.decimal(tags::FRAME_TIME) {
        Some(ms) if ms > 0.0 && frames > 1 => (0..frames).map(|n| (n, n as f64 * ms / 1e3)).collect(),
        _ => BTreeMap::new(),
    }
}

/// A place in a plane, for users.
pub(super) fn spacing_text(spacing: [f64; 2]) -> String {
    let [x, y] = spacing.map(number);
    format!("{x} x {y} mm")
}
