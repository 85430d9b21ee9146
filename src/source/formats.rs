//! The formats of recordings, in one table, and the choice of the reader for a file: by its content, then by its name. A file that is not
//! read is refused with one line.

use super::keys::{self, Row};
use super::layout::Layout;
use super::packed::{GZIP, InputFile};
use super::{OpenOptions, dicom, kretz, metaimage, nifti, nrrd, plus, recorder, stack};
use crate::files::InputError;
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

pub use super::dicom::ENDINGS as DICOM;
pub use super::pictures::ENDINGS as PICTURES;

/// Number of bytes at the start of a file by which its format is recognised.
pub(super) const START: u64 = 1024;
/// The ending of a file that is packed as a whole.
const PACKED: &str = "gz";

/// A file format of recordings that can be read.
pub struct Format {
    /// Name of the format in help texts and messages.
    pub name: &'static str,
    /// File name endings of the format, in lower case without the dot. Empty if its files have none of their own.
    pub endings: &'static [&'static str],
    /// Endings of files that hold only the samples, beside a header file; empty if the format has no such files.
    pub data: &'static [&'static str],
    /// True if a file begins with these bytes: its first 1024, or all that it has.
    is_one: fn(&[u8]) -> bool,
    reads: Reads,
    /// What is done with each key of its files; none if all that they state is read.
    keys: fn() -> Vec<Row>,
}

/// The way in which files of a format are read.
pub(super) enum Reads {
    /// A reader of layouts: whole volumes, whose frames can be read at random. The file may be packed by gzip.
    Layout(fn(&InputFile) -> Result<Layout, InputError>),
    /// A reader of layouts, as in `Layout`, that also needs the user's options.
    Stated(fn(&InputFile, &OpenOptions) -> Result<Layout, InputError>),
    /// A `.frames` file: frames in the order in which they arrived.
    Frames,
    /// A stream of frames, as from standard input, that was saved in a file.
    Stream,
    Uff,
}

/// Every file format of recordings that can be read, in the order in which a file is tested for them. Stacks of pictures are not listed.
pub static FORMATS: [Format; 8] = [
    // First: 128 bytes of anything come before its mark.
    Format {
        name: "DICOM",
        endings: &dicom::ENDINGS,
        data: &[],
        is_one: dicom::is_one,
        reads: Reads::Stated(dicom::read),
        keys: dicom::rows,
    },
    Format {
        name: "MetaImage",
        endings: &metaimage::ENDINGS,
        data: &["raw", "zraw"],
        is_one: |start| start.starts_with(b"ObjectType") || start.starts_with(b"NDims"),
        reads: Reads::Layout(metaimage::read),
        keys: || keys::rows(&[&metaimage::KEYS, &plus::FRAME_KEYS]),
    },
    Format {
        name: "NRRD",
        endings: &["nrrd", "nhdr"],
        data: &["raw"],
        is_one: nrrd::is_one,
        reads: Reads::Layout(nrrd::read),
        keys: || keys::rows(&[&nrrd::KEYS, &plus::FRAME_KEYS]),
    },
    Format {
        name: "NIfTI",
        endings: &["nii", "hdr"],
        data: &["img"],
        is_one: nifti::is_one,
        reads: Reads::Layout(nifti::read),
        keys: || keys::rows(&[&nifti::KEYS]),
    },
    Format {
        name: "Kretz",
        endings: &["vol"],
        data: &[],
        is_one: |start| start.starts_with(b"KRETZFILE"),
        reads: Reads::Layout(kretz::read),
        keys: || keys::rows(&[&kretz::KEYS]),
    },
    Format {
        name: "UFF",
        endings: &["uff"],
        data: &[],
        // The mark of HDF5: every UFF file is one.
        is_one: |start| start.starts_with(b"\x89HDF\r\n\x1a\n"),
        reads: Reads::Uff,
        keys: uff_keys,
    },
    Format {
        name: "frames",
        endings: &["frames"],
        data: &[],
        is_one: recorder::Reader::is_one,
        reads: Reads::Frames,
        keys: Vec::new,
    },
    Format {
        name: "stream of frames",
        endings: &[],
        data: &[],
        is_one: |start| start.starts_with(b"{"),
        reads: Reads::Stream,
        keys: Vec::new,
    },
];

impl Format {
    /// How the reader treats each key of the format. Empty if the reader uses everything that a file can state, or if this build lacks the reader.
    #[must_use]
    pub fn keys(&self) -> Vec<Row> {
        (self.keys)()
    }

    /// True if its files may be packed as a whole by gzip.
    fn may_be_packed(&self) -> bool {
        matches!(self.reads, Reads::Layout(_) | Reads::Stated(_))
    }

    /// Name and endings: "NRRD (.nrrd, .nhdr)".
    fn described(&self) -> String {
        let endings: Vec<_> = self.endings.iter().map(|ending| format!(".{ending}")).collect();
        format!("{} ({})", self.name, endings.join(", "))
    }
}

fn uff_keys() -> Vec<Row> {
    #[cfg(feature = "uff")]
    return keys::rows(&[&super::uff::KEYS]);
    #[cfg(not(feature = "uff"))]
    Vec::new()
}

/// A sentence fragment with the readable formats and their endings, for help texts and messages.
pub fn described() -> String {
    let of = |packed: bool| {
        let named = FORMATS.iter().filter(|format| !format.endings.is_empty() && format.may_be_packed() == packed);
        named.map(Format::described).collect::<Vec<_>>().join(", ")
    };
    format!("{}, each also as .{PACKED}, {}", of(true), of(false))
}

/// The names of the formats that have file name endings, separated by commas. A name that is also the ending has a dot before it, as `.frames`.
pub fn names() -> String {
    let named = FORMATS.iter().filter(|format| !format.endings.is_empty());
    let dot = |format: &Format| if format.endings.contains(&format.name) { "." } else { "" };
    named.map(|format| format!("{}{}", dot(format), format.name)).collect::<Vec<_>>().join(", ")
}

/// True if an ending, in lower case without the dot, is one of [`Format::endings`], or `gz`, as files may be packed. The endings of
/// [`Format::data`] and of pictures do not count.
pub fn is_ending(ending: &str) -> bool {
    ending == PACKED || FORMATS.iter().any(|format| format.endings.contains(&ending))
}

/// How to read a file, recognised by its first bytes. None if they are of no known format, or the file is packed.
pub(super) fn reads(path: &Path) -> Option<&'static Reads> {
    let mut start = Vec::new();
    // A file that cannot be read is reported by the reader. Opening a pipe may block for ever.
    if fs::metadata(path).is_ok_and(|m| m.is_file()) {
        let _ = File::open(path).and_then(|file| file.take(START).read_to_end(&mut start));
    }
    of_start(&start)
}

fn of_start(start: &[u8]) -> Option<&'static Reads> {
    FORMATS.iter().find(|format| (format.is_one)(start)).map(|format| &format.reads)
}

/// Reads the layout of a recording with the reader that the first bytes select, or for MetaImage the ending. The path may also be a folder of
/// DICOM files or a stack of pictures.
///
/// # Errors
/// The file cannot be read, is of another kind, or is damaged; or a voxel spacing is given for something else than pictures.
pub(super) fn read_layout(path: &Path, options: &OpenOptions) -> Result<Layout, InputError> {
    if path.is_dir() && dicom::is_series(path) {
        return dicom::read_series(path, options);
    }
    if stack::is_meant(path) {
        return stack::read(path, options);
    }
    let file = InputFile::new(path)?;
    let start = file.start(START)?;
    let reads = of_start(&start);
    if let Some(Reads::Stated(read)) = reads {
        return read(&file, options);
    }
    if options.voxel_spacing.is_some() {
        let fault = "is for pictures; other recordings state their own";
        return Err(InputError::new(path, "--voxel-spacing", fault));
    }
    let fault = |fault: String| Err(InputError::new(path, "file", fault));
    let name = if file.is_packed() { path.with_extension("") } else { path.to_path_buf() };
    let ending = name.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match reads {
        Some(Reads::Layout(read)) => read(&file),
        Some(Reads::Frames) => fault("holds frames as they arrived, not a recording".into()),
        // Its keys may stand in any order.
        _ if other_kind(&start).is_none() && metaimage::ENDINGS.contains(&&*ending) => metaimage::read(&file),
        _ => fault(unknown(&start)),
    }
}

/// What is said of bytes that are of no format.
fn unknown(start: &[u8]) -> String {
    let kind = other_kind(start).unwrap_or_else(|| "of no known format".into());
    format!("is {kind}; {}, and folders of DICOM files or numbered pictures, are read", described())
}

/// The reason why a file that begins with these bytes is no recording. None if it may be one: it is of a known format, is packed, or there are
/// too few bytes.
pub(super) fn no_format(start: &[u8]) -> Option<String> {
    let is_certain = start.len() as u64 >= START && !start.starts_with(&GZIP) && of_start(start).is_none();
    is_certain.then(|| unknown(start))
}

/// Kinds of files that users have at hand: where their mark is, the mark, and their name.
const OTHER_KINDS: [(usize, &[u8], &str); 23] = [
    (0, b"\x89PNG", "a PNG picture"),
    (0, b"\xff\xd8\xff", "a JPEG picture"),
    (0, b"GIF8", "a GIF picture"),
    (0, b"II*\0", "a TIFF picture"),
    (0, b"MM\0*", "a TIFF picture"),
    (0, b"%PDF", "a PDF document"),
    (0, b"\x89HDF", "an HDF5 file"),
    (0, b"CDF\x01", "a NetCDF file"),
    (0, b"PK\x03\x04", "a zip archive"),
    (0, b"BZh", "a bzip2 file"),
    (0, b"\xfd7zXZ", "an xz file"),
    (0, b"\x28\xb5\x2f\xfd", "a Zstandard file"),
    (0, b"\x1f\x8b", "a gzip file in a gzip file"),
    (0, b"7z\xbc\xaf", "a 7-Zip archive"),
    (8, b"AVI ", "an AVI video"),
    (4, b"ftyp", "an MP4 video"),
    (0, b"\x1aE\xdf\xa3", "a Matroska video"),
    (0, b"# vtk DataFile", "a VTK file"),
    (0, b"<?xml", "an XML file"),
    (0, b"MATLAB 5.0", "a MATLAB file"),
    (0, b"\x93NUMPY", "an array of numpy"),
    (257, b"ustar", "a tar archive"),
    (0, b"solid ", "an STL mesh"),
];

/// The kind of a file that is not read, by its first bytes.
fn other_kind(start: &[u8]) -> Option<String> {
    let is_there = |(at, mark, _): &&(usize, &[u8], &str)| start.get(*at..).is_some_and(|rest| rest.starts_with(mark));
    OTHER_KINDS.iter().find(is_there).map(|(_, _, name)| (*name).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_apart_and_described() {
        for (n, format) in FORMATS.iter().enumerate() {
            assert!(!(format.is_one)(b"") && !(format.is_one)(&[0; 1024]), "{}", format.name);
            for ending in format.endings {
                assert!(is_ending(ending) && *ending == ending.to_lowercase(), "{ending}");
                assert!(FORMATS[..n].iter().all(|other| !other.endings.contains(ending)), "{ending} has two formats");
            }
        }
        assert_eq!(names(), "DICOM, MetaImage, NRRD, NIfTI, Kretz, UFF, .frames");
        assert!(is_ending("gz") && !is_ending("png") && !is_ending(""));
        assert_eq!(
            described(),
            "DICOM (.dcm, .dicom, .ima), MetaImage (.mha, .mhd), NRRD (.nrrd, .nhdr), NIfTI (.nii, .hdr), Kretz (.vol), each also as .gz, UFF (.uff), frames (.frames)"
        );
    }

    #[test]
    fn files_of_other_kinds_are_named() {
        assert_eq!(other_kind(b"RIFF\0\0\0\0AVI LIST").as_deref(), Some("an AVI video"));
        assert_eq!(other_kind(b""), None);
        assert_eq!(other_kind(b"ObjectType = Image"), None);
    }
}
