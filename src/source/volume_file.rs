//! Volume files that are written: MetaImage, NRRD, NIfTI-1 and DICOM, each with its voxel-to-world matrix. A file is complete or absent.

use super::dicom::{DicomWriter, MOST_BYTES};
use crate::files::{InputError, Unfinished};
use crate::probe::{SampleType, World};
use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{DMat3, DQuat, DVec3};
use std::io::{self, Write};
use std::path::Path;

/// Formats of volume files that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeFile {
    /// MetaImage with header and samples in one file (.mha).
    MetaImage,
    /// NRRD 4 with header and raw samples in one file (.nrrd).
    Nrrd,
    /// NIfTI-1 with header and samples in one file (.nii), or the same packed by gzip (.nii.gz).
    Nifti { packed: bool },
    /// DICOM (.dcm): an Enhanced US Volume, or with `capture` a secondary capture of slices of 8 bits.
    Dicom { capture: bool },
}

/// Bytes before the samples of a NIfTI-1 file: the header, and four zeros for "no extension".
const NIFTI_OFFSET: usize = 352;

impl VolumeFile {
    /// The format that the extension of a file name stands for.
    ///
    /// # Errors
    /// The extension belongs to no format, or the name ends in `.seq.nrrd`, which is a sequence of volumes.
    pub fn of(path: &Path) -> Result<VolumeFile, InputError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let formats = [
            (".mha", VolumeFile::MetaImage),
            (".nrrd", VolumeFile::Nrrd),
            (".nii", VolumeFile::Nifti { packed: false }),
            (".nii.gz", VolumeFile::Nifti { packed: true }),
            (".dcm", VolumeFile::Dicom { capture: false }),
        ];
        if stem(path, SEQUENCE).is_some() {
            let why = "is a sequence of volumes by its name, but one volume is written";
            return Err(InputError::new(path, "file", why));
        }
        match formats.iter().find(|(ending, _)| name.ends_with(ending)) {
            Some((_, format)) => Ok(*format),
            None if [".stl", ".ply", ".glb"].iter().any(|ending| name.ends_with(ending)) => {
                Err(InputError::new(path, "file", "is a surface by its name, which `echolume mesh` writes"))
            }
            None => Err(InputError::new(path, "file", "must end in .mha, .nrrd, .nii, .nii.gz or .dcm")),
        }
    }

    /// Largest number of voxels along an axis that the format can hold.
    pub(super) fn most_along_axis(self) -> usize {
        match self {
            VolumeFile::Nifti { .. } => i16::MAX as usize,
            VolumeFile::Dicom { .. } => u16::MAX as usize,
            _ => 65_536,
        }
    }

    /// Checks that the format can hold a volume of `size` voxels with samples of this type.
    ///
    /// # Errors
    /// One line: DICOM cannot hold samples of this type, or so many bytes.
    pub(super) fn check(self, size: [usize; 3], sample: SampleType) -> Result<(), String> {
        let VolumeFile::Dicom { capture } = self else { return Ok(()) };
        let bytes = size.iter().fold(sample.bytes() as u64, |all, n| all.saturating_mul(*n as u64));
        if sample != SampleType::U8 && (capture || sample != SampleType::U16) {
            return Err(format!(
                "DICOM volumes hold u8 and u16, these are {sample}: write .nrrd, or 8 bits with --secondary-capture"
            ));
        }
        if bytes > MOST_BYTES {
            return Err(format!("would have {bytes} bytes of samples, DICOM holds {MOST_BYTES}"));
        }
        Ok(())
    }

    /// Creates a file and writes its header. `world`: map from the voxels to the world.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn create(
        self,
        path: &Path,
        size: [usize; 3],
        world: &World,
        sample: SampleType,
    ) -> io::Result<Box<dyn VolumeWriter>> {
        let file = Unfinished::create(path)?;
        let header = match self {
            VolumeFile::MetaImage => metaimage(size, world, sample).into_bytes(),
            VolumeFile::Nrrd => (nrrd_start(size, world, sample, None) + "encoding: raw\n\n").into_bytes(),
            VolumeFile::Nifti { .. } => nifti(size, world, sample),
            VolumeFile::Dicom { capture } => {
                return Ok(Box::new(DicomWriter::create(file, size, world, capture, sample.bytes())?));
            }
        };
        let mut writer: Box<dyn VolumeWriter> = match self {
            VolumeFile::Nifti { packed: true } => Box::new(GzEncoder::new(file, Compression::default())),
            _ => Box::new(file),
        };
        writer.write_all(&header)?;
        Ok(writer)
    }
}

/// File name ending of a sequence of volumes.
pub(super) const SEQUENCE: &str = ".seq.nrrd";

/// The file name without `ending`, which may be in upper or lower case. None if the name has another ending.
pub(super) fn stem(path: &Path, ending: &str) -> Option<String> {
    let name = path.file_name()?.to_string_lossy();
    let at = name.len().checked_sub(ending.len())?;
    name.get(at..)?.eq_ignore_ascii_case(ending).then(|| name[..at].into())
}

/// Three numbers as text, separated by `between`; negative zeros become 0.
pub(super) fn three(v: DVec3, between: &str) -> String {
    v.to_array().map(|n| (n + 0.0).to_string()).join(between)
}

fn metaimage([x, y, z]: [usize; 3], world: &World, sample: SampleType) -> String {
    let kind = sample.metaimage();
    let directions = world.directions();
    let matrix = [0, 1, 2].map(|n| three(directions.col(n), " ")).join(" ");
    let spacing = three(DVec3::from([0, 1, 2].map(|n| world.axis(n).length())), " ");
    let origin = three(world.origin(), " ");
    format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n\
         TransformMatrix = {matrix}\nOffset = {origin}\nElementSpacing = {spacing}\n\
         DimSize = {x} {y} {z}\nElementType = {kind}\nElementDataFile = LOCAL\n"
    )
}

/// The beginning of an NRRD header, up to its encoding. `volumes`: number of volumes of a sequence, which are the slowest axis; None for a
/// single volume.
pub(super) fn nrrd_start(size: [usize; 3], world: &World, sample: SampleType, volumes: Option<usize>) -> String {
    let kind = match sample {
        SampleType::U8 => "uint8",
        SampleType::U16 => "uint16",
        SampleType::I16 => "int16",
        SampleType::F32 => "float",
    };
    let dimension = if volumes.is_some() { 4 } else { 3 };
    let axes = nrrd_axes(size, world, volumes);
    format!(
        "NRRD0004\n# The axes are lateral, depth and elevation of an ultrasound probe.\ntype: {kind}\ndimension: {dimension}\n{axes}\
         endian: little\n"
    )
}

/// The fields of an NRRD header that state the axes and the origin of the voxels in the world. `volumes`: number of volumes of a sequence; None for
/// a single volume.
pub(super) fn nrrd_axes([x, y, z]: [usize; 3], world: &World, volumes: Option<usize>) -> String {
    let [size, direction, kind] = match volumes {
        Some(count) => [format!(" {count}"), " none".into(), " list".into()],
        None => [const { String::new() }; 3],
    };
    let directions = [0, 1, 2].map(|n| format!("({})", three(world.axis(n), ","))).join(" ");
    let origin = three(world.origin(), ",");
    format!(
        "space: left-posterior-superior\nsizes: {x} {y} {z}{size}\nspace directions: {directions}{direction}\n\
         kinds: domain domain domain{kind}\nspace units: \"mm\" \"mm\" \"mm\"\nspace origin: ({origin})\n"
    )
}

/// A header of 348 bytes with sform and qform, both of the scanner, and no extension.
fn nifti(size: [usize; 3], world: &World, sample: SampleType) -> Vec<u8> {
    let (datatype, bits) = match sample {
        SampleType::U8 => (2i16, 8i16),
        SampleType::I16 => (4, 16),
        SampleType::U16 => (512, 16),
        SampleType::F32 => (16, 32),
    };
    let mut bytes = vec![0; NIFTI_OFFSET];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, &348i32.to_le_bytes());
    // The sizes were checked against the format.
    let dim = [3, size[0] as i16, size[1] as i16, size[2] as i16, 1, 1, 1, 1];
    put(40, &dim.map(i16::to_le_bytes).concat());
    put(70, &[datatype, bits].map(i16::to_le_bytes).concat());
    // From LPS to RAS.
    let ras = |v: DVec3| DVec3::new(-v.x, -v.y, v.z) + DVec3::ZERO;
    let axes = [0, 1, 2].map(|n| ras(world.axis(n)));
    let origin = ras(world.origin());
    let hand = if world.is_left_handed() { -1.0 } else { 1.0 };
    let spacing = axes.map(DVec3::length);
    let pixdim = [hand, spacing[0], spacing[1], spacing[2], 0.0, 0.0, 0.0, 0.0];
    put(76, &pixdim.map(|v| (v as f32).to_le_bytes()).concat());
    put(108, &(NIFTI_OFFSET as f32).to_le_bytes());
    put(112, &1.0f32.to_le_bytes());
    // mm.
    put(123, &[2]);
    put(252, &[1i16, 1].map(i16::to_le_bytes).concat());
    let rotation = DMat3::from_cols(axes[0] / spacing[0], axes[1] / spacing[1], axes[2] / spacing[2] * hand);
    let turn = DQuat::from_mat3(&rotation).normalize();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let place = [turn.x, turn.y, turn.z, origin.x, origin.y, origin.z];
    put(256, &place.map(|v| (v as f32).to_le_bytes()).concat());
    for row in 0..3 {
        let values = [axes[0][row], axes[1][row], axes[2][row], origin[row]];
        put(280 + 16 * row, &values.map(|v| (v as f32).to_le_bytes()).concat());
    }
    put(344, b"n+1\0");
    bytes
}

/// A volume file that is being written.
pub(super) trait VolumeWriter: Write {
    /// Renames the complete file to its target.
    ///
    /// # Errors
    /// The file cannot be written.
    fn complete(self: Box<Self>) -> io::Result<()>;
}

impl VolumeWriter for Unfinished {
    fn complete(self: Box<Self>) -> io::Result<()> {
        Unfinished::complete(*self)
    }
}

impl VolumeWriter for GzEncoder<Unfinished> {
    fn complete(self: Box<Self>) -> io::Result<()> {
        self.finish()?.complete()
    }
}

impl VolumeWriter for DicomWriter {
    fn complete(self: Box<Self>) -> io::Result<()> {
        self.finish()
    }
}
