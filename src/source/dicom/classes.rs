//! Names of what DICOM files are: the classes of objects, and the transfer syntaxes.

/// The kind of object that a DICOM file holds, as far as its reader distinguishes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    /// 2D pictures with ultrasound regions.
    Pictures,
    /// Enhanced US Volume: slices of volumes, each with its position and orientation.
    EnhancedVolume,
    /// Cartesian volumes of Philips in the form that QLAB exports.
    Philips,
    /// Secondary captures, which are ultrasound only if the modality says so.
    Capture,
    Other,
}

const STORAGE: &str = "1.2.840.10008.5.1.4.1.1.";
/// Endings after [`STORAGE`].
const CLASSES: [(&str, Class, &str); 30] = [
    ("6.1", Class::Pictures, "ultrasound image"),
    ("6", Class::Pictures, "ultrasound image (retired class)"),
    ("3.1", Class::Pictures, "ultrasound multi-frame image"),
    ("3", Class::Pictures, "ultrasound multi-frame image (retired class)"),
    ("6.2", Class::EnhancedVolume, "enhanced ultrasound volume"),
    ("7", Class::Capture, "secondary capture image"),
    ("7.2", Class::Capture, "multi-frame grayscale byte secondary capture image"),
    ("7.3", Class::Capture, "multi-frame grayscale word secondary capture image"),
    ("7.4", Class::Capture, "multi-frame true color secondary capture image"),
    ("1", Class::Other, "computed radiography image"),
    ("1.1", Class::Other, "digital X-ray image"),
    ("1.2", Class::Other, "mammography image"),
    ("2", Class::Other, "CT image"),
    ("2.1", Class::Other, "enhanced CT image"),
    ("4", Class::Other, "MR image"),
    ("4.1", Class::Other, "enhanced MR image"),
    ("7.1", Class::Other, "multi-frame single bit secondary capture image"),
    ("9.1.1", Class::Other, "12-lead ECG"),
    ("11.1", Class::Other, "presentation state"),
    ("12.1", Class::Other, "X-ray angiographic image"),
    ("12.2", Class::Other, "X-ray radiofluoroscopic image"),
    ("20", Class::Other, "nuclear medicine image"),
    ("66.4", Class::Other, "segmentation"),
    ("77.1.4.1", Class::Other, "video photographic image"),
    ("88.11", Class::Other, "structured report"),
    ("88.33", Class::Other, "structured report"),
    ("104.1", Class::Other, "encapsulated PDF"),
    ("128", Class::Other, "PET image"),
    ("481.1", Class::Other, "RT image"),
    ("481.3", Class::Other, "RT structure set"),
];
/// A file that lists others, in the folders of exported discs.
pub(super) const DIRECTORY: &str = "1.2.840.10008.1.3.10";
const PHILIPS: &str = "1.2.840.113543.6.6.1.3.10002";

/// The kind of object that the UID of a SOP class stands for, and its name for users.
pub(super) fn class(uid: &str) -> (Class, &'static str) {
    let known = uid.strip_prefix(STORAGE).and_then(|end| CLASSES.iter().find(|(ending, ..)| *ending == end));
    match (known, uid) {
        (Some((_, class, name)), _) => (*class, name),
        (None, PHILIPS) => (Class::Philips, "Philips private 3D volume"),
        (None, DIRECTORY) => (Class::Other, "directory (DICOMDIR)"),
        (None, _) => (Class::Other, "object of a class that is not known"),
    }
}

/// How the frames of a DICOM file are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Coding {
    Native,
    Rle,
    /// Baseline or extended, 8 bits.
    Jpeg,
    JpegLossless,
    Jpeg2000,
}

/// Transfer syntaxes below 1.2.840.10008.1.2 that are known by name, and how they compress pixels; None if they are not read.
const SYNTAXES: [(&str, &str, Option<Coding>); 24] = [
    ("", "implicit little-endian", Some(Coding::Native)),
    (".1", "explicit little-endian", Some(Coding::Native)),
    (".2", "explicit big-endian", Some(Coding::Native)),
    (".5", "RLE", Some(Coding::Rle)),
    (".4.50", "JPEG baseline", Some(Coding::Jpeg)),
    (".4.51", "JPEG extended", Some(Coding::Jpeg)),
    (".4.57", "JPEG lossless", Some(Coding::JpegLossless)),
    (".4.70", "JPEG lossless", Some(Coding::JpegLossless)),
    (".4.80", "JPEG-LS lossless", None),
    (".4.81", "JPEG-LS near-lossless", None),
    (".4.90", "JPEG 2000 lossless", Some(Coding::Jpeg2000)),
    (".4.91", "JPEG 2000", Some(Coding::Jpeg2000)),
    (".4.92", "JPEG 2000 part 2 lossless", None),
    (".4.93", "JPEG 2000 part 2", None),
    (".4.100", "MPEG-2 video", None),
    (".4.101", "MPEG-2 video", None),
    (".4.102", "H.264 video", None),
    (".4.103", "H.264 video", None),
    (".4.104", "H.264 video", None),
    (".4.107", "H.265 video", None),
    (".4.108", "H.265 video", None),
    (".4.201", "High-Throughput JPEG 2000 lossless", None),
    (".4.202", "High-Throughput JPEG 2000 lossless", None),
    (".4.203", "High-Throughput JPEG 2000", None),
];

/// The name of the transfer syntax with this UID, and how it compresses pixels; None if they cannot be read.
pub(super) fn syntax(uid: &str) -> (&'static str, Option<Coding>) {
    let known = uid.strip_prefix("1.2.840.10008.1.2").and_then(|end| SYNTAXES.iter().find(|(known, ..)| *known == end));
    known.map_or(("unknown", None), |(_, name, coding)| (name, *coding))
}
