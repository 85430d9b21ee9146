//! Which reader a file is for: its content decides, then its name. What is not read is named in one line.

use super::layout::Layout;
use super::packed::InputFile;
use super::{OpenOptions, dicom, kretz, metaimage, nifti, nrrd, recorder, stack};
use crate::files::InputError;
use std::path::Path;

/// Bytes that are looked at.
const START: u64 = 1024;
/// What is read, for messages.
const READ: &str = "MetaImage (.mha, .mhd), NRRD (.nrrd, .nhdr), NIfTI (.nii), DICOM (.dcm) and Kretz (.vol) are read, each also as .gz, \
                    USTB's UFF (.uff), .frames, and folders of DICOM files or numbered pictures";

/// Reads the layout of a file with the reader for its content, or else for the extension of its name; or of a stack of pictures.
///
/// # Errors
/// A file that cannot be read, is of another kind, or is damaged. A voxel spacing for anything but pictures.
pub(super) fn read_layout(path: &Path, options: &OpenOptions) -> Result<Layout, InputError> {
    if path.is_dir() && dicom::is_series(path) {
        return dicom::read_series(path, options);
    }
    if stack::is_meant(path) {
        return stack::read(path, options);
    }
    let file = InputFile::new(path)?;
    let start = file.start(START)?;
    if dicom::is_one(&start) {
        return dicom::read(&file, options);
    }
    if options.voxel_spacing.is_some() {
        let fault = "is for pictures; other recordings state their own";
        return Err(InputError::new(path, "--voxel-spacing", fault));
    }
    let name = if file.is_packed() { path.with_extension("") } else { path.to_path_buf() };
    let ending = name.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    if start.starts_with(b"KRETZFILE") {
        kretz::read(&file)
    } else if nrrd::is_one(&start) {
        nrrd::read(&file)
    } else if nifti::is_one(&start) {
        nifti::read(&file)
    } else if start.starts_with(b"ObjectType") || start.starts_with(b"NDims") {
        metaimage::read(&file)
    } else if recorder::Reader::is_one(&start) {
        Err(InputError::new(path, "file", "holds frames as they arrived, not a recording"))
    } else if let Some(kind) = other_kind(&start) {
        Err(InputError::new(path, "file", format!("is {kind}; {READ}")))
    } else if ["mha", "mhd"].contains(&&*ending) {
        metaimage::read(&file)
    } else {
        Err(InputError::new(path, "file", format!("is of no known format; {READ}")))
    }
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
    fn files_of_other_kinds_are_named() {
        assert_eq!(other_kind(b"RIFF\0\0\0\0AVI LIST").as_deref(), Some("an AVI video"));
        assert_eq!(other_kind(b""), None);
        assert_eq!(other_kind(b"ObjectType = Image"), None);
    }
}
