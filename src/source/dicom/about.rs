//! What a DICOM file is: whether it is read, and what users are told of it.

use super::super::describe;
use super::classes::{Class, class, syntax};
use super::elements::Elements;
use super::tags;
use crate::files::{InputError, escaped, quoted};
use std::path::Path;

/// What is read of DICOM, for messages.
const READ: &str = "of DICOM, ultrasound is read: images, enhanced volumes, Kretz and Philips' Cartesian volumes";
/// The fault of Philips' files that state no number of slices.
const PRIVATE: &str = "holds Philips' private 3D data (1.2.840.113543.6.6.1.3.10002), whose form is not public: export Cartesian DICOM from QLAB";
/// Longest name of a scanner, characters.
const MAX_NAME: usize = 64;

/// Finds out which class of objects a DICOM file holds.
///
/// # Errors
/// One line that names what the file is, if it is of no class that can be read.
pub(super) fn accept(path: &Path, elements: &Elements) -> Result<Class, InputError> {
    let uid = class_uid(elements);
    let (class, name) = class(&uid);
    let modality = elements.root.text(tags::MODALITY);
    let is_philips = elements.root.text(tags::PHILIPS) == "Philips3D" || class == Class::Philips;
    if is_philips && elements.root.long(tags::PHILIPS_SLICES).is_some() {
        return Ok(Class::Philips);
    }
    let shown_modality = escaped(&modality, 16);
    let fault = match class {
        Class::Philips => PRIVATE.into(),
        Class::Other => {
            let shown = if name.contains("not known") { format!(" ({})", quoted(&uid)) } else { String::new() };
            let of_modality = if modality.is_empty() { String::new() } else { format!(", modality {shown_modality}") };
            format!("is a DICOM {name}{shown}{of_modality}; {READ}")
        }
        Class::Capture if modality != "US" => format!("is a DICOM {name} of modality '{shown_modality}'; {READ}"),
        other => return Ok(other),
    };
    Err(InputError::new(path, "file", fault))
}

fn class_uid(elements: &Elements) -> String {
    let stated = elements.root.text(tags::SOP_CLASS);
    if stated.is_empty() { elements.class.clone() } else { stated }
}

/// Rows for users: what the object is and which scanner made it. They never say who the patient is.
pub(super) fn about(elements: &Elements) -> Vec<(String, String)> {
    let root = &elements.root;
    let (_, name) = class(&class_uid(elements));
    let mut rows = vec![("object".to_string(), format!("DICOM {name}"))];
    let mut add = |title: &str, text: String| {
        if !text.is_empty() {
            rows.push((title.into(), escaped(&text, MAX_NAME)));
        }
    };
    add("modality", root.text(tags::MODALITY));
    let (maker, model) = (root.text(tags::MANUFACTURER), root.text(tags::MODEL));
    add("scanner", if model.starts_with(&maker) { model } else { format!("{maker} {model}").trim().to_string() });
    add("transfer syntax", syntax(&elements.syntax).0.into());
    let has_vector = root.words(tags::FRAME_POINTER) == [0x0018, 0x1065];
    if let Some(time) = root.decimal(tags::FRAME_TIME).filter(|_| !has_vector) {
        add("frame time", format!("{} ms", describe::number(time)));
    }
    rows
}
