//! Volumes in DICOM files: Enhanced US Volumes (PS3.3 A.59), whose planes stand in functional groups, and the Cartesian volumes of Philips.

use super::super::describe::number;
use super::super::layout::{Cartesian, StoredGeometry};
use super::elements::{Elements, Item};
use super::image::Image;
use super::placed::{Placed, in_order};
use super::planes::{Plane, sorted};
use super::tags::{self, Tag};
use crate::files::{InputError, escaped};
use crate::probe::file::SLAB;
use crate::probe::{AxisOrder, World};
use glam::{DMat3, DVec3};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Most names of data types in a remark.
const MOST_NAMED: usize = 4;

/// Functional groups: those of a frame, otherwise those of all.
struct Groups<'a> {
    own: Option<&'a Item>,
    shared: Option<&'a Item>,
}

impl<'a> Groups<'a> {
    fn find(&self, sequence: Tag) -> Option<&'a Item> {
        [self.own, self.shared].into_iter().flatten().find_map(|item| item.items(sequence).first())
    }

    fn numbers(&self, sequence: Tag, tag: Tag, is_text: bool) -> Option<Vec<f64>> {
        let item = self.find(sequence)?;
        Some(if is_text { item.decimals(tag) } else { item.reals(tag) })
    }
}

/// Two vectors of three numbers each, scaled to unit length. None without six numbers, or if one has no length.
pub(super) fn directions(numbers: &[f64]) -> Option<[DVec3; 2]> {
    let [a, b, c, d, e, f] = *numbers.first_chunk::<6>()?;
    let unit = [DVec3::new(a, b, c), DVec3::new(d, e, f)].map(DVec3::normalize_or_zero);
    unit.iter().all(|v| v.is_finite() && *v != DVec3::ZERO).then_some(unit)
}

pub(super) fn enhanced(path: &Path, elements: &Elements, image: &Image) -> Result<Placed, InputError> {
    let fault = |field: &str, fault: String| InputError::new(path, field, fault);
    let root = &elements.root;
    let shared = root.items(tags::SHARED_GROUPS).first();
    let own = root.items(tags::FRAME_GROUPS);
    let count = image.places.len();
    if !own.is_empty() && own.len() < count {
        let why = format!("are {}, but there are {count} frames", own.len());
        return Err(fault("per-frame functional groups (5200,9230)", why));
    }
    let groups: Vec<Groups> = (0..count).map(|n| Groups { own: own.get(n), shared }).collect();
    let (chosen, mut remarks) = chosen_type(&groups);
    // The patient's space if all planes are placed in it, otherwise that of the volume.
    let in_patient = planes(&groups, &chosen, true);
    let is_patient = in_patient.is_some();
    let Some(all) = in_patient.or_else(|| planes(&groups, &chosen, false)) else {
        return Err(fault("plane position (volume) (0020,930E)", "or its orientation is missing for a frame".into()));
    };
    let found = sorted(&all).map_err(|why| fault("planes", why))?;
    let measures = groups.first().and_then(|g| g.find(tags::PIXEL_MEASURES));
    let spacing = measures.map(|item| item.decimals(tags::PIXEL_SPACING)).unwrap_or_default();
    let (Some(first), Some([rows, columns])) = (found.order.first(), spacing.first_chunk::<2>()) else {
        return Err(fault("pixel measures (0028,9110)", "do not state the pixel spacing".into()));
    };
    let spacing_of = |g: &Groups| g.numbers(tags::PIXEL_MEASURES, tags::PIXEL_SPACING, true);
    if groups.iter().any(|g| spacing_of(g).as_ref() != Some(&spacing)) {
        return Err(fault("pixel measures (0028,9110)", "differ from frame to frame".into()));
    }
    let plane = all[*first];
    let normal = plane.row.cross(plane.column).normalize_or_zero();
    let thickness = measures.and_then(|item| {
        item.decimal(tags::SPACING_BETWEEN_SLICES).or(item.decimal(tags::SLICE_THICKNESS)).filter(|mm| *mm > 0.0)
    });
    let step = found.step.unwrap_or(normal * thickness.unwrap_or(SLAB));
    let axes = [plane.row * *columns, plane.column * *rows, step];
    let world = World::new(axes, plane.position).map_err(|why| fault("planes", why))?;
    let size = [image.size[0], image.size[1], found.slices];
    let stated = |g: &Groups| g.numbers(tags::PLANE_ORIENTATION_VOLUME, tags::ORIENTATION_VOLUME, false);
    let in_volume = groups.first().and_then(stated).and_then(|numbers| directions(&numbers));
    let drawn = transducer_order(&root.reals(tags::TO_TRANSDUCER), in_volume);
    let world = world.reordered(&drawn, size);
    let space = if is_patient { "the patient's (LPS)" } else { "the volume's own frame of reference" };
    remarks.push(("space".into(), space.into()));
    if let Some([x, y, z]) = root.reals(tags::APEX).first_chunk::<3>().map(|apex| apex.map(number)) {
        remarks.push(("apex".into(), format!("{x}, {y}, {z} mm in the volume's frame of reference")));
    }
    let geometry = StoredGeometry::Cartesian(Cartesian { size, volumes: found.volumes, world, order: drawn });
    let order = found.order.iter().filter_map(|n| chosen.get(*n).copied()).collect();
    let (part, has_spacing) = ([0, 0, image.size[0], image.size[1]], true);
    let (times, warnings) = (found.times, BTreeSet::new());
    Ok(Placed { format: "DICOM Enhanced US Volume", geometry, order, part, has_spacing, times, remarks, warnings })
}

/// The frames of one type of data: of tissue if there are such, otherwise the first. The others are named.
fn chosen_type(groups: &[Groups]) -> (Vec<usize>, Vec<(String, String)>) {
    let of = |g: &Groups| g.find(tags::DATA_TYPES).map(|item| item.text(tags::DATA_TYPE)).unwrap_or_default();
    let types: Vec<String> = groups.iter().map(of).collect();
    let first = types.iter().find(|t| t.starts_with("TISSUE_INTENSITY")).or(types.first()).cloned().unwrap_or_default();
    let chosen = (0..types.len()).filter(|n| types[*n] == first).collect();
    let others: BTreeSet<&String> = types.iter().filter(|t| **t != first).collect();
    let mut remarks = Vec::new();
    if !others.is_empty() {
        let named: Vec<String> = others.iter().take(MOST_NAMED).map(|t| escaped(t, 32)).collect();
        remarks.push(("more data".into(), format!("frames of {}; not read", named.join(", "))));
    }
    (chosen, remarks)
}

/// The planes of the chosen frames, in the space of the patient or of the volume; None if one is not placed there.
fn planes(groups: &[Groups], chosen: &[usize], patient: bool) -> Option<Vec<Plane>> {
    let (position, orientation) = match patient {
        true => ((tags::PLANE_POSITION, tags::POSITION_PATIENT), (tags::PLANE_ORIENTATION, tags::ORIENTATION_PATIENT)),
        false => (
            (tags::PLANE_POSITION_VOLUME, tags::POSITION_VOLUME),
            (tags::PLANE_ORIENTATION_VOLUME, tags::ORIENTATION_VOLUME),
        ),
    };
    let plane = |n: &usize| {
        let group = groups.get(*n)?;
        let at = *group.numbers(position.0, position.1, patient)?.first_chunk::<3>()?;
        let [row, column] = directions(&group.numbers(orientation.0, orientation.1, patient)?)?;
        let index = group.find(tags::FRAME_CONTENT).and_then(|item| item.long(tags::TEMPORAL_INDEX));
        let time = group.find(tags::TEMPORAL_POSITION).and_then(|item| item.real(tags::TIME_OFFSET));
        Some(Plane { position: DVec3::from(at), row, column, index, time })
    };
    chosen.iter().map(plane).collect()
}

/// The order that draws the axes as those of the transducer: x to its marker, y into the body. The stored one without a matrix.
fn transducer_order(matrix: &[f64], in_volume: Option<[DVec3; 2]>) -> AxisOrder {
    let (Some(m), Some([row, column])) = (matrix.first_chunk::<16>(), in_volume) else { return AxisOrder::STORED };
    // Row by row.
    let turn =
        DMat3::from_cols(DVec3::new(m[0], m[4], m[8]), DVec3::new(m[1], m[5], m[9]), DVec3::new(m[2], m[6], m[10]));
    let axes = [row, column, row.cross(column)].map(|axis| turn * axis);
    if !axes.iter().all(|a| a.is_finite()) {
        return AxisOrder::STORED;
    }
    let main = [0, 1, 2].map(|drawn: usize| {
        let size = |stored: &usize| axes[*stored][drawn].abs();
        (0..3).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(drawn)
    });
    let order = AxisOrder { stored: main, reversed: [0, 1, 2].map(|drawn| axes[main[drawn]][drawn] < 0.0) };
    let mut each = order.stored;
    each.sort_unstable();
    if each == [0, 1, 2] { order } else { AxisOrder::STORED }
}

/// Geometry and times of volumes as Philips' QLAB exports them: each frame is one volume with its slices one after another, and private elements
/// state the third axis.
///
/// # Errors
/// One line that names the file: an element is missing or impossible.
pub(super) fn philips(path: &Path, elements: &Elements, image: &Image) -> Result<Placed, InputError> {
    let fault = |field: &str, fault: &str| InputError::new(path, field, fault);
    let root = &elements.root;
    let slices = root.long(tags::PHILIPS_SLICES).unwrap_or(0);
    let units =
        [tags::UNITS[0], tags::UNITS[1], tags::PHILIPS_UNIT].map(|tag| root.word(tag).unwrap_or(tags::CENTIMETRES));
    if units != [tags::CENTIMETRES; 3] {
        return Err(fault("units (0018,6024)", "are not centimetres"));
    }
    let deltas = [tags::DELTA[0], tags::DELTA[1], tags::PHILIPS_DELTA].map(|tag| root.real(tag));
    let [Some(x), Some(y), Some(z)] = deltas else {
        return Err(fault("physical delta (0018,602C)", "or that of y or of the slices (3001,1003) is missing"));
    };
    let axes = [DVec3::X * x.abs() * 10.0, DVec3::Y * y.abs() * 10.0, DVec3::Z * z.abs() * 10.0];
    let world = World::new(axes, DVec3::ZERO).map_err(|why| fault("physical delta (0018,602C)", &why))?;
    let frames = image.places.len();
    let slices = match usize::try_from(slices) {
        Ok(n) if n > 0 && frames.is_multiple_of(n) => n,
        _ => return Err(fault("slices (3001,1001)", "do not divide the frames")),
    };
    let size = [image.size[0], image.size[1], slices];
    let volumes = frames / slices;
    let seconds = root.decimal(tags::FRAME_TIME).filter(|ms| *ms > 0.0).map(|ms| ms / 1e3);
    let time = |n: usize| Some((n, seconds? * (n / slices) as f64));
    let times = if volumes > 1 { (0..frames).filter_map(time).collect() } else { BTreeMap::new() };
    let geometry = StoredGeometry::Cartesian(Cartesian { size, volumes, world, order: AxisOrder::STORED });
    let (order, part) = (in_order(image), [0, 0, image.size[0], image.size[1]]);
    let (remarks, warnings) = (Vec::new(), BTreeSet::new());
    Ok(Placed { format: "DICOM volume of Philips", geometry, order, part, has_spacing: true, times, remarks, warnings })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_of_the_transducer_are_drawn() {
        let volume = Some([DVec3::X, DVec3::Y]);
        let order = |rows: [f64; 16]| transducer_order(&rows, volume).names();
        let one = [1.0, 0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 6.0, 0.0, 0.0, 1.0, 7.0, 0.0, 0.0, 0.0, 1.0];
        assert_eq!(order(one), "x, y, z");
        // Depth is the third axis of the volume: y of the transducer is z of the volume, z is -y.
        let turned = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        assert_eq!(order(turned), "x, z, -y");
        let oblique = [0.9, 0.1, 0.0, 0.0, 0.9, 0.2, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        assert_eq!(order(oblique), "x, y, z", "no permutation: as stored");
        assert_eq!(transducer_order(&[f64::NAN; 16], volume), AxisOrder::STORED);
        assert_eq!(transducer_order(&[], volume), AxisOrder::STORED);
    }
}
