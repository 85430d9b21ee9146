//! The elements of DICOM by their tags: those that are kept, and those that are not read although they could change a picture.

use super::super::keys::{Aspect, Key, Row, Use};

/// A DICOM tag: group number in the upper 16 bits, element number in the lower 16.
pub(super) type Tag = u32;

/// How the value of an element is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Text,
    /// Binary numbers of the given number of bytes each.
    Numbers(usize),
    Sequence,
}

pub(super) const PIXEL_DATA: Tag = 0x7fe0_0010;
pub(super) const ITEM: Tag = 0xfffe_e000;
pub(super) const ITEM_END: Tag = 0xfffe_e00d;
pub(super) const SEQUENCE_END: Tag = 0xfffe_e0dd;
/// Group number of GE's private elements that hold a Kretz file. [`KRETZ_CREATOR`] is the name of the creator that reserves a block of it.
pub(super) const KRETZ_GROUP: u32 = 0x7fe1;
pub(super) const KRETZ_CREATOR: &str = "KRETZ_US";

/// Centimetres, in the units of physical distances.
pub(super) const CENTIMETRES: u16 = 3;

const WORDS: Kind = Kind::Numbers(2);
const LONGS: Kind = Kind::Numbers(4);
const REALS: Kind = Kind::Numbers(8);

/// An element that is kept when a file is read.
pub(super) struct Wanted {
    pub tag: Tag,
    pub kind: Kind,
    /// Name and treatment of the element. The name is the standard's keyword; that of a private element is a description.
    pub key: Key,
}

/// Makes a constant of each tag, and [`WANTED`].
macro_rules! wanted {
    ($($name:ident = $tag:literal, $kind:expr, $keyword:literal, $aspect:ident;)*) => {
        $(pub(super) const $name: Tag = $tag;)*
        /// The elements that are kept when a file is read.
        pub(super) const WANTED: &[Wanted] =
            &[$(Wanted { tag: $name, kind: $kind, key: Key::new($keyword, Aspect::$aspect, Use::Used) }),*];
    };
}

wanted! {
    META_LENGTH = 0x0002_0000, LONGS, "FileMetaInformationGroupLength", Storage;
    META_CLASS = 0x0002_0002, Kind::Text, "MediaStorageSOPClassUID", Storage;
    META_SYNTAX = 0x0002_0010, Kind::Text, "TransferSyntaxUID", Storage;
    SOP_CLASS = 0x0008_0016, Kind::Text, "SOPClassUID", Storage;
    MODALITY = 0x0008_0060, Kind::Text, "Modality", About;
    MANUFACTURER = 0x0008_0070, Kind::Text, "Manufacturer", About;
    MODEL = 0x0008_1090, Kind::Text, "ManufacturerModelName", About;
    SLICE_THICKNESS = 0x0018_0050, Kind::Text, "SliceThickness", Geometry;
    SPACING_BETWEEN_SLICES = 0x0018_0088, Kind::Text, "SpacingBetweenSlices", Geometry;
    FRAME_TIME = 0x0018_1063, Kind::Text, "FrameTime", Time;
    FRAME_TIME_VECTOR = 0x0018_1065, Kind::Text, "FrameTimeVector", Time;
    SLICE_LOCATIONS = 0x0018_2005, Kind::Text, "SliceLocationVector", Geometry;
    REGIONS = 0x0018_6011, Kind::Sequence, "SequenceOfUltrasoundRegions", Geometry;
    REGION_FORMAT = 0x0018_6012, WORDS, "RegionSpatialFormat", Geometry;
    REGION_TYPE = 0x0018_6014, WORDS, "RegionDataType", Geometry;
    REGION_MIN_X = 0x0018_6018, LONGS, "RegionLocationMinX0", Geometry;
    REGION_MIN_Y = 0x0018_601a, LONGS, "RegionLocationMinY0", Geometry;
    REGION_MAX_X = 0x0018_601c, LONGS, "RegionLocationMaxX1", Geometry;
    REGION_MAX_Y = 0x0018_601e, LONGS, "RegionLocationMaxY1", Geometry;
    REFERENCE_PIXEL_X = 0x0018_6020, LONGS, "ReferencePixelX0", Geometry;
    REFERENCE_PIXEL_Y = 0x0018_6022, LONGS, "ReferencePixelY0", Geometry;
    UNIT_X = 0x0018_6024, WORDS, "PhysicalUnitsXDirection", Geometry;
    UNIT_Y = 0x0018_6026, WORDS, "PhysicalUnitsYDirection", Geometry;
    REFERENCE_VALUE_X = 0x0018_6028, REALS, "ReferencePixelPhysicalValueX", Geometry;
    REFERENCE_VALUE_Y = 0x0018_602a, REALS, "ReferencePixelPhysicalValueY", Geometry;
    DELTA_X = 0x0018_602c, REALS, "PhysicalDeltaX", Geometry;
    DELTA_Y = 0x0018_602e, REALS, "PhysicalDeltaY", Geometry;
    DATA_TYPES = 0x0018_9807, Kind::Sequence, "ImageDataTypeSequence", Value;
    DATA_TYPE = 0x0018_9808, Kind::Text, "DataType", Value;
    SERIES = 0x0020_000e, Kind::Text, "SeriesInstanceUID", Storage;
    INSTANCE_NUMBER = 0x0020_0013, Kind::Text, "InstanceNumber", Geometry;
    POSITION_PATIENT = 0x0020_0032, Kind::Text, "ImagePositionPatient", Geometry;
    ORIENTATION_PATIENT = 0x0020_0037, Kind::Text, "ImageOrientationPatient", Orientation;
    FRAME_CONTENT = 0x0020_9111, Kind::Sequence, "FrameContentSequence", Time;
    PLANE_POSITION = 0x0020_9113, Kind::Sequence, "PlanePositionSequence", Geometry;
    PLANE_ORIENTATION = 0x0020_9116, Kind::Sequence, "PlaneOrientationSequence", Orientation;
    TEMPORAL_INDEX = 0x0020_9128, LONGS, "TemporalPositionIndex", Time;
    POSITION_VOLUME = 0x0020_9301, REALS, "ImagePositionVolume", Geometry;
    ORIENTATION_VOLUME = 0x0020_9302, REALS, "ImageOrientationVolume", Orientation;
    APEX = 0x0020_9308, REALS, "ApexPosition", Geometry;
    TO_TRANSDUCER = 0x0020_9309, REALS, "VolumeToTransducerMappingMatrix", Orientation;
    TIME_OFFSET = 0x0020_930d, REALS, "TemporalPositionTimeOffset", Time;
    PLANE_POSITION_VOLUME = 0x0020_930e, Kind::Sequence, "PlanePositionVolumeSequence", Geometry;
    PLANE_ORIENTATION_VOLUME = 0x0020_930f, Kind::Sequence, "PlaneOrientationVolumeSequence", Orientation;
    TEMPORAL_POSITION = 0x0020_9310, Kind::Sequence, "TemporalPositionSequence", Time;
    SAMPLES = 0x0028_0002, WORDS, "SamplesPerPixel", Storage;
    PHOTOMETRIC = 0x0028_0004, Kind::Text, "PhotometricInterpretation", Value;
    PLANAR = 0x0028_0006, WORDS, "PlanarConfiguration", Storage;
    FRAMES = 0x0028_0008, Kind::Text, "NumberOfFrames", Geometry;
    FRAME_POINTER = 0x0028_0009, WORDS, "FrameIncrementPointer", Time;
    ROWS = 0x0028_0010, WORDS, "Rows", Geometry;
    COLUMNS = 0x0028_0011, WORDS, "Columns", Geometry;
    PIXEL_SPACING = 0x0028_0030, Kind::Text, "PixelSpacing", Geometry;
    BITS_ALLOCATED = 0x0028_0100, WORDS, "BitsAllocated", Storage;
    BITS_STORED = 0x0028_0101, WORDS, "BitsStored", Storage;
    HIGH_BIT = 0x0028_0102, WORDS, "HighBit", Storage;
    IS_SIGNED = 0x0028_0103, WORDS, "PixelRepresentation", Value;
    INTERCEPT = 0x0028_1052, Kind::Text, "RescaleIntercept", Value;
    SLOPE = 0x0028_1053, Kind::Text, "RescaleSlope", Value;
    RED_ABOUT = 0x0028_1101, WORDS, "RedPaletteColorLookupTableDescriptor", Value;
    GREEN_ABOUT = 0x0028_1102, WORDS, "GreenPaletteColorLookupTableDescriptor", Value;
    BLUE_ABOUT = 0x0028_1103, WORDS, "BluePaletteColorLookupTableDescriptor", Value;
    RED_PALETTE = 0x0028_1201, WORDS, "RedPaletteColorLookupTableData", Value;
    GREEN_PALETTE = 0x0028_1202, WORDS, "GreenPaletteColorLookupTableData", Value;
    BLUE_PALETTE = 0x0028_1203, WORDS, "BluePaletteColorLookupTableData", Value;
    SEGMENTED_RED = 0x0028_1221, WORDS, "SegmentedRedPaletteColorLookupTableData", Value;
    SEGMENTED_GREEN = 0x0028_1222, WORDS, "SegmentedGreenPaletteColorLookupTableData", Value;
    SEGMENTED_BLUE = 0x0028_1223, WORDS, "SegmentedBluePaletteColorLookupTableData", Value;
    PIXEL_MEASURES = 0x0028_9110, Kind::Sequence, "PixelMeasuresSequence", Geometry;
    // Private element that names the creator of Philips' Cartesian volumes, as public readers know it. The three after it are the number of
    // slices, and unit and spacing of the third axis.
    PHILIPS = 0x3001_0010, Kind::Text, "private creator of Philips", Storage;
    PHILIPS_SLICES = 0x3001_1001, LONGS, "slices of Philips", Geometry;
    PHILIPS_UNIT = 0x3001_1002, WORDS, "unit of Philips", Geometry;
    PHILIPS_DELTA = 0x3001_1003, REALS, "spacing of Philips", Geometry;
    SHARED_GROUPS = 0x5200_9229, Kind::Sequence, "SharedFunctionalGroupsSequence", Geometry;
    FRAME_GROUPS = 0x5200_9230, Kind::Sequence, "PerFrameFunctionalGroupsSequence", Geometry;
    EXTENDED_TABLE = 0x7fe0_0001, REALS, "ExtendedOffsetTable", Storage;
}
pub(super) const REGION_BOX: [Tag; 4] = [REGION_MIN_X, REGION_MIN_Y, REGION_MAX_X, REGION_MAX_Y];
pub(super) const REFERENCE_PIXEL: [Tag; 2] = [REFERENCE_PIXEL_X, REFERENCE_PIXEL_Y];
pub(super) const UNITS: [Tag; 2] = [UNIT_X, UNIT_Y];
pub(super) const REFERENCE_VALUE: [Tag; 2] = [REFERENCE_VALUE_X, REFERENCE_VALUE_Y];
pub(super) const DELTA: [Tag; 2] = [DELTA_X, DELTA_Y];
pub(super) const PALETTE_ABOUT: [Tag; 3] = [RED_ABOUT, GREEN_ABOUT, BLUE_ABOUT];
pub(super) const PALETTE: [Tag; 3] = [RED_PALETTE, GREEN_PALETTE, BLUE_PALETTE];
pub(super) const SEGMENTED_PALETTE: [Tag; 3] = [SEGMENTED_RED, SEGMENTED_GREEN, SEGMENTED_BLUE];

/// Elements that could change a picture and are not read. Elements in neither table are skipped too, and listed by their tags.
pub(super) static NOT_READ: [(Tag, Key); 16] = [
    (0x0018_0040, Key::new("CineRate", Aspect::Time, Use::Listed)),
    (0x0018_1066, Key::new("FrameDelay", Aspect::Time, Use::Listed)),
    (0x0018_1164, Key::new("ImagerPixelSpacing", Aspect::Geometry, Use::Warned(&[]))),
    (0x0018_2010, Key::new("NominalScannedPixelSpacing", Aspect::Geometry, Use::Warned(&[]))),
    (0x0018_7032, Key::new("FieldOfViewRotation", Aspect::Orientation, Use::Warned(&["0"]))),
    (0x0018_7034, Key::new("FieldOfViewHorizontalFlip", Aspect::Orientation, Use::Warned(&["NO"]))),
    (0x0020_0020, Key::new("PatientOrientation", Aspect::Orientation, Use::Listed)),
    (0x0028_0034, Key::new("PixelAspectRatio", Aspect::Geometry, Use::Warned(&["1"]))),
    (0x0028_0120, Key::new("PixelPaddingValue", Aspect::Value, Use::Warned(&[]))),
    (0x0028_1050, Key::new("WindowCenter", Aspect::About, Use::Listed)),
    (0x0028_1051, Key::new("WindowWidth", Aspect::About, Use::Listed)),
    (0x0028_3000, Key::new("ModalityLUTSequence", Aspect::Value, Use::Warned(&[]))),
    (0x0028_3010, Key::new("VOILUTSequence", Aspect::About, Use::Listed)),
    (0x0040_9096, Key::new("RealWorldValueMappingSequence", Aspect::Value, Use::Warned(&[]))),
    (0x2050_0020, Key::new("PresentationLUTShape", Aspect::Value, Use::Warned(&["IDENTITY"]))),
    (0x6000_3000, Key::new("OverlayData", Aspect::About, Use::Listed)),
];
/// The rows of docs/formats.md about DICOM: the elements of both tables and the pixel data, with their tags.
pub(in super::super) fn rows() -> Vec<Row> {
    let shown =
        |tag: Tag, key: &Key| Row { name: format!("{} {}", key.name, name(tag)), aspect: key.aspect, done: key.done };
    let read = WANTED.iter().map(|wanted| shown(wanted.tag, &wanted.key));
    let pixels = Key::new("PixelData", Aspect::Storage, Use::Used);
    read.chain([shown(PIXEL_DATA, &pixels)]).chain(NOT_READ.iter().map(|(tag, key)| shown(*tag, key))).collect()
}

/// A tag as the standard writes it: `(0028,0010)`.
pub(super) fn name(tag: Tag) -> String {
    format!("({:04X},{:04X})", tag >> 16, tag & 0xffff)
}

/// A tag as text, with its keyword if one of the two tables has it.
pub(super) fn shown_name(tag: Tag) -> String {
    let read = WANTED.iter().map(|wanted| (wanted.tag, &wanted.key));
    let known = read.chain(NOT_READ.iter().map(|(tag, key)| (*tag, key))).find(|(other, _)| *other == tag);
    known.map_or_else(|| name(tag), |(_, key)| format!("{} {}", key.name, name(tag)))
}
