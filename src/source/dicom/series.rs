//! A folder of DICOM files of one frame each: slices of a volume by their places in the patient or by a stated distance, otherwise pictures
//! in time by their numbers.

use super::super::OpenOptions;
use super::super::layout::{Cartesian, Layout, StoredGeometry};
use super::super::packed::InputFile;
use super::about::{about, accept};
use super::classes::DIRECTORY;
use super::elements::{Elements, is_one};
use super::file::read;
use super::image::{Image, Place};
use super::placed::{Placed, layout};
use super::planes::{Plane, sorted};
use super::regions::{Flat, flat, in_patient, of_pictures, spacing_text};
use super::tags;
use crate::files::{InputError, progress};
use crate::probe::{AxisOrder, World};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Most files of a folder that are looked at.
const MAX_FILES: usize = 1 << 16;

/// True if a folder holds a DICOM file.
pub(in super::super) fn is_series(folder: &Path) -> bool {
    let Ok(entries) = fs::read_dir(folder) else { return false };
    entries.take(MAX_FILES).flatten().any(|entry| is_dicom(&entry.path()))
}

/// True if a path is a DICOM file, whatever its name. Reads its first 132 bytes.
pub(in super::super) fn is_dicom(path: &Path) -> bool {
    let mut start = Vec::new();
    let is_regular = fs::metadata(path).is_ok_and(|about| about.is_file());
    is_regular && File::open(path).and_then(|file| file.take(132).read_to_end(&mut start)).is_ok() && is_one(&start)
}

/// One file of a series.
struct Slice {
    path: PathBuf,
    image: Image,
    elements: Elements,
}

/// Reads the layout of the DICOM files of a folder as one recording.
///
/// # Errors
/// The files are of several series, sizes or kinds, a file cannot be read, or slices are not evenly spaced.
pub(in super::super) fn read_series(folder: &Path, options: &OpenOptions) -> Result<Layout, InputError> {
    let fault = |fault: String| Err(InputError::new(folder, "folder", fault));
    let entries = fs::read_dir(folder).map_err(|e| InputError::unreadable(folder, &e))?;
    let mut paths: Vec<PathBuf> = entries.take(MAX_FILES).flatten().map(|e| e.path()).filter(|p| is_dicom(p)).collect();
    // The order of a folder is any.
    paths.sort();
    let mut slices = Vec::new();
    progress::expect_files(paths.len() as u64);
    for path in paths {
        let elements = Elements::read(&InputFile::new(&path)?)?;
        progress::file_read();
        if elements.class == DIRECTORY {
            continue;
        }
        slices.push((path, elements));
    }
    if let [(path, _)] = &slices[..] {
        return read(&InputFile::new(path)?, options);
    }
    let series: BTreeSet<String> = slices.iter().map(|(_, elements)| elements.root.text(tags::SERIES)).collect();
    if series.len() > 1 {
        return fault(format!(
            "holds files of {} series: put those of one into a folder, or give a file",
            series.len()
        ));
    }
    let mut all = Vec::new();
    for (path, elements) in slices {
        accept(&path, &elements)?;
        let image = Image::of(&path, &elements, 1)?;
        if image.places.len() != 1 || elements.kretz.is_some() {
            return fault(format!("holds {} with several frames, and other files: give that file", name(&path)));
        }
        all.push(Slice { path, image, elements });
    }
    all.sort_by_key(|slice| slice.elements.root.text(tags::INSTANCE_NUMBER).parse::<i64>().unwrap_or(i64::MAX));
    let Some(first) = all.first() else { return fault("holds no image".into()) };
    let plane = flat(&first.elements.root, first.image.size);
    let is_same = |slice: &Slice| {
        let (a, b) = (&slice.image, &first.image);
        let other = flat(&slice.elements.root, a.size);
        (a.size, a.pixel, a.coding, &a.arrangement, a.swapped) == (b.size, b.pixel, b.coding, &b.arrangement, b.swapped)
            && (other.part, other.spacing) == (plane.part, plane.spacing)
    };
    if let Some(other) = all.iter().find(|slice| !is_same(slice)) {
        return fault(format!("{} differs from {} in size, region or pixels", name(&other.path), name(&first.path)));
    }
    let placed = placed(folder, &all, plane, options)?;
    if options.voxel_spacing.is_some() && placed.has_spacing {
        let why = "is for pictures without a spacing; these state their own";
        return Err(InputError::new(folder, "--voxel-spacing", why));
    }
    let files = all.iter().map(|slice| slice.path.clone()).collect();
    let Slice { mut image, elements, .. } = all.remove(0);
    for (n, Slice { image: next, .. }) in all.into_iter().enumerate() {
        let before = image.parts.len();
        let moved = |place: &Place| Place { file: n + 1, first: place.first + before, ..*place };
        image.places.extend(next.places.iter().map(moved));
        image.parts.extend(next.parts);
        // What is wrong with many files is said once.
        image.warnings.extend(next.warnings);
    }
    let mut layout = layout(files, folder.into(), image, placed, None)?;
    // Those of the first: the others are of the same series.
    layout.unused = elements.unused(folder, &mut layout.remarks);
    Ok(layout)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn placed(folder: &Path, all: &[Slice], plane: Flat, options: &OpenOptions) -> Result<Placed, InputError> {
    let fault = |field: &str, fault: String| InputError::new(folder, field, fault);
    let root = &all[0].elements.root;
    let mut remarks = about(&all[0].elements);
    remarks.extend(plane.remarks.iter().cloned());
    remarks.push(("files".into(), all.len().to_string()));
    let place = |slice: &Slice| {
        let (position, [row, column]) = in_patient(&slice.elements.root, &plane)?;
        Some(Plane { position, row, column, index: None, time: None })
    };
    let planes: Option<Vec<Plane>> = all.iter().map(place).collect();
    // Of the voxels: the field that is at fault if they are refused, the vectors of a column, a row and a slice, the first place, and the numbers of
    // slices and volumes. With it the order of the files.
    let mut order = (0..all.len()).collect();
    let lattice = if let (Some(planes), Some([dx, dy])) = (planes, plane.spacing) {
        let found = sorted(&planes).map_err(|why| fault("slices", why))?;
        let first = found.order.first().map(|n| planes[*n]);
        first.zip(found.step).map(|(first, step)| {
            order = found.order;
            let axes = [first.row * dx, first.column * dy, step];
            ("slices", axes, first.position, [found.slices, found.volumes])
        })
    } else {
        let distance = root.decimal(tags::SPACING_BETWEEN_SLICES).filter(|mm| *mm > 0.0);
        let spacing = match (plane.spacing, distance) {
            (Some([x, y]), Some(z)) => Some([x, y, z]),
            (None, _) => options.voxel_spacing,
            _ => None,
        };
        spacing.map(|[x, y, z]| {
            remarks.push(("order".into(), "by the numbers of the images; they state no places".into()));
            let origin = DVec3::new(plane.origin[0], plane.origin[1], 0.0);
            ("spacing", [DVec3::X * x, DVec3::Y * y, DVec3::Z * z], origin, [all.len(), 1])
        })
    };
    let geometry = match lattice {
        Some((field, axes, origin, [slices, volumes])) => {
            let world = World::new(axes, origin).map_err(|why| fault(field, why))?;
            let size = [plane.part[2], plane.part[3], slices];
            StoredGeometry::Cartesian(Cartesian { size, volumes, world, order: AxisOrder::STORED })
        }
        // Pictures that have no distance from each other are frames in time.
        None => {
            if let Some(spacing) = plane.spacing.map(spacing_text) {
                let text = format!("pictures of {spacing} in time, by their numbers; they state no distance");
                remarks.push(("order".into(), text));
            }
            of_pictures(folder, root, &plane, all.len(), options)?
        }
    };
    let Flat { part, spacing, warnings, .. } = plane;
    let (has_spacing, times) = (spacing.is_some(), BTreeMap::new());
    Ok(Placed { format: "DICOM series", geometry, order, part, has_spacing, times, remarks, warnings })
}
