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

pub(super) const SOP_CLASS: Tag = 0x0008_0016;
pub(super) const MODALITY: Tag = 0x0008_0060;
pub(super) const MANUFACTURER: Tag = 0x0008_0070;
pub(super) const MODEL: Tag = 0x0008_1090;
pub(super) const SLICE_THICKNESS: Tag = 0x0018_0050;
pub(super) const SPACING_BETWEEN_SLICES: Tag = 0x0018_0088;
pub(super) const FRAME_TIME: Tag = 0x0018_1063;
pub(super) const FRAME_TIME_VECTOR: Tag = 0x0018_1065;
pub(super) const SLICE_LOCATIONS: Tag = 0x0018_2005;
pub(super) const REGIONS: Tag = 0x0018_6011;
pub(super) const REGION_FORMAT: Tag = 0x0018_6012;
pub(super) const REGION_TYPE: Tag = 0x0018_6014;
pub(super) const REGION_BOX: [Tag; 4] = [0x0018_6018, 0x0018_601a, 0x0018_601c, 0x0018_601e];
pub(super) const REFERENCE_PIXEL: [Tag; 2] = [0x0018_6020, 0x0018_6022];
pub(super) const UNITS: [Tag; 2] = [0x0018_6024, 0x0018_6026];
pub(super) const REFERENCE_VALUE: [Tag; 2] = [0x0018_6028, 0x0018_602a];
pub(super) const DELTA: [Tag; 2] = [0x0018_602c, 0x0018_602e];
pub(super) const DATA_TYPES: Tag = 0x0018_9807;
pub(super) const DATA_TYPE: Tag = 0x0018_9808;
pub(super) const SERIES: Tag = 0x0020_000e;
pub(super) const INSTANCE_NUMBER: Tag = 0x0020_0013;
pub(super) const POSITION_PATIENT: Tag = 0x0020_0032;
pub(super) const ORIENTATION_PATIENT: Tag = 0x0020_0037;
pub(super) const FRAME_CONTENT: Tag = 0x0020_9111;
pub(super) const PLANE_POSITION: Tag = 0x0020_9113;
pub(super) const PLANE_ORIENTATION: Tag = 0x0020_9116;
pub(super) const TEMPORAL_INDEX: Tag = 0x0020_9128;
pub(super) const POSITION_VOLUME: Tag = 0x0020_9301;
pub(super) const ORIENTATION_VOLUME: Tag = 0x0020_9302;
pub(super) const APEX: Tag = 0x0020_9308;
pub(super) const TO_TRANSDUCER: Tag = 0x0020_9309;
pub(super) const TIME_OFFSET: Tag = 0x0020_930d;
pub(super) const PLANE_POSITION_VOLUME: Tag = 0x0020_930e;
pub(super) const PLANE_ORIENTATION_VOLUME: Tag = 0x0020_930f;
pub(super) const TEMPORAL_POSITION: Tag = 0x0020_9310;
pub(super) const SAMPLES: Tag = 0x0028_0002;
pub(super) const PHOTOMETRIC: Tag = 0x0028_0004;
pub(super) const PLANAR: Tag = 0x0028_0006;
pub(super) const FRAMES: Tag = 0x0028_0008;
pub(super) const FRAME_POINTER: Tag = 0x0028_0009;
pub(super) const ROWS: Tag = 0x0028_0010;
pub(super) const COLUMNS: Tag = 0x0028_0011;
pub(super) const PIXEL_SPACING: Tag = 0x0028_0030;
pub(super) const BITS_ALLOCATED: Tag = 0x0028_0100;
pub(super) const BITS_STORED: Tag = 0x0028_0101;
pub(super) const HIGH_BIT: Tag = 0x0028_0102;
pub(super) const IS_SIGNED: Tag = 0x0028_0103;
pub(super) const INTERCEPT: Tag = 0x0028_1052;
pub(super) const SLOPE: Tag = 0x0028_1053;
pub(super) const PALETTE_ABOUT: [Tag; 3] = [0x0028_1101, 0x0028_1102, 0x0028_1103];
pub(super) const PALETTE: [Tag; 3] = [0x0028_1201, 0x0028_1202, 0x0028_1203];
pub(super) const SEGMENTED_PALETTE: [Tag; 3] = [0x0028_1221, 0x0028_1222, 0x0028_1223];
pub(super) const PIXEL_MEASURES: Tag = 0x0028_9110;
/// Private element that names the creator of Philips' Cartesian volumes, as public readers know it. The three constants after it are the number of
/// slices, and unit and spacing of the third axis.
pub(super) const PHILIPS: Tag = 0x3001_0010;
pub(super) const PHILIPS_SLICES: Tag = 0x3001_1001;
pub(super) const PHILIPS_UNIT: Tag = 0x3001_1002;
pub(super) const PHILIPS_DELTA: Tag = 0x3001_1003;
pub(super) const SHARED_GROUPS: Tag = 0x5200_9229;
pub(super) const FRAME_GROUPS: Tag = 0x5200_9230;
pub(super) const EXTENDED_TABLE: Tag = 0x7fe0_0001;
pub(super) const PIXEL_DATA: Tag = 0x7fe0_0010;
pub(super) const META_LENGTH: Tag = 0x0002_0000;
pub(super) const META_CLASS: Tag = 0x0002_0002;
pub(super) const META_SYNTAX: Tag = 0x0002_0010;
pub(super) const ITEM: Tag = 0xfffe_e000;
pub(super) const ITEM_END: Tag = 0xfffe_e00d;
pub(super) const SEQUENCE_END: Tag = 0xfffe_e0dd;
/// Group number of GE's private elements that hold a Kretz file. [`KRETZ_CREATOR`] is the name of the creator that reserves a block of it.
pub(super) const KRETZ_GROUP: u32 = 0x7fe1;
pub(super) const KRETZ_CREATOR: &str = "KRETZ_US";

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

const fn used(tag: Tag, kind: Kind, keyword: &'static str, aspect: Aspect) -> Wanted {
    Wanted { tag, kind, key: Key::new(keyword, aspect, Use::Used) }
}

/// The elements that are kept when a file is read.
pub(super) const WANTED: &[Wanted] = &[
    used(META_LENGTH, LONGS, "FileMetaInformationGroupLength", Aspect::Storage),
    used(META_CLASS, Kind::Text, "MediaStorageSOPClassUID", Aspect::Storage),
    used(META_SYNTAX, Kind::Text, "TransferSyntaxUID", Aspect::Storage),
    used(SOP_CLASS, Kind::Text, "SOPClassUID", Aspect::Storage),
    used(MODALITY, Kind::Text, "Modality", Aspect::About),
    used(MANUFACTURER, Kind::Text, "Manufacturer", Aspect::About),
    used(MODEL, Kind::Text, "ManufacturerModelName", Aspect::About),
    used(SLICE_THICKNESS, Kind::Text, "SliceThickness", Aspect::Geometry),
    used(SPACING_BETWEEN_SLICES, Kind::Text, "SpacingBetweenSlices", Aspect::Geometry),
    used(FRAME_TIME, Kind::Text, "FrameTime", Aspect::Time),
    used(FRAME_TIME_VECTOR, Kind::Text, "FrameTimeVector", Aspect::Time),
    used(SLICE_LOCATIONS, Kind::Text, "SliceLocationVector", Aspect::Geometry),
    used(REGIONS, Kind::Sequence, "SequenceOfUltrasoundRegions", Aspect::Geometry),
    used(REGION_FORMAT, WORDS, "RegionSpatialFormat", Aspect::Geometry),
    used(REGION_TYPE, WORDS, "RegionDataType", Aspect::Geometry),
    used(REGION_BOX[0], LONGS, "RegionLocationMinX0", Aspect::Geometry),
    used(REGION_BOX[1], LONGS, "RegionLocationMinY0", Aspect::Geometry),
    used(REGION_BOX[2], LONGS, "RegionLocationMaxX1", Aspect::Geometry),
    used(REGION_BOX[3], LONGS, "RegionLocationMaxY1", Aspect::Geometry),
    used(REFERENCE_PIXEL[0], LONGS, "ReferencePixelX0", Aspect::Geometry),
    used(REFERENCE_PIXEL[1], LONGS, "ReferencePixelY0", Aspect::Geometry),
    used(UNITS[0], WORDS, "PhysicalUnitsXDirection", Aspect::Geometry),
    used(UNITS[1], WORDS, "PhysicalUnitsYDirection", Aspect::Geometry),
    used(REFERENCE_VALUE[0], REALS, "ReferencePixelPhysicalValueX", Aspect::Geometry),
    used(REFERENCE_VALUE[1], REALS, "ReferencePixelPhysicalValueY", Aspect::Geometry),
    used(DELTA[0], REALS, "PhysicalDeltaX", Aspect::Geometry),
    used(DELTA[1], REALS, "PhysicalDeltaY", Aspect::Geometry),
    used(DATA_TYPES, Kind::Sequence, "ImageDataTypeSequence", Aspect::Value),
    used(DATA_TYPE, Kind::Text, "DataType", Aspect::Value),
    used(SERIES, Kind::Text, "SeriesInstanceUID", Aspect::Storage),
    used(INSTANCE_NUMBER, Kind::Text, "InstanceNumber", Aspect::Geometry),
    used(POSITION_PATIENT, Kind::Text, "ImagePositionPatient", Aspect::Geometry),
    used(ORIENTATION_PATIENT, Kind::Text, "ImageOrientationPatient", Aspect::Orientation),
    used(FRAME_CONTENT, Kind::Sequence, "FrameContentSequence", Aspect::Time),
    used(PLANE_POSITION, Kind::Sequence, "PlanePositionSequence", Aspect::Geometry),
    used(PLANE_ORIENTATION, Kind::Sequence, "PlaneOrientationSequence", Aspect::Orientation),
    used(TEMPORAL_INDEX, LONGS, "TemporalPositionIndex", Aspect::Time),
    used(POSITION_VOLUME, REALS, "ImagePositionVolume", Aspect::Geometry),
    used(ORIENTATION_VOLUME, REALS, "ImageOrientationVolume", Aspect::Orientation),
    used(APEX, REALS, "ApexPosition", Aspect::Geometry),
    used(TO_TRANSDUCER, REALS, "VolumeToTransducerMappingMatrix", Aspect::Orientation),
    used(TIME_OFFSET, REALS, "TemporalPositionTimeOffset", Aspect::Time),
    used(PLANE_POSITION_VOLUME, Kind::Sequence, "PlanePositionVolumeSequence", Aspect::Geometry),
    used(PLANE_ORIENTATION_VOLUME, Kind::Sequence, "PlaneOrientationVolumeSequence", Aspect::Orientation),
    used(TEMPORAL_POSITION, Kind::Sequence, "TemporalPositionSequence", Aspect::Time),
    used(SAMPLES, WORDS, "SamplesPerPixel", Aspect::Storage),
    used(PHOTOMETRIC, Kind::Text, "PhotometricInterpretation", Aspect::Value),
    used(PLANAR, WORDS, "PlanarConfiguration", Aspect::Storage),
    used(FRAMES, Kind::Text, "NumberOfFrames", Aspect::Geometry),
    used(FRAME_POINTER, WORDS, "FrameIncrementPointer", Aspect::Time),
    used(ROWS, WORDS, "Rows", Aspect::Geometry),
    used(COLUMNS, WORDS, "Columns", Aspect::Geometry),
    used(PIXEL_SPACING, Kind::Text, "PixelSpacing", Aspect::Geometry),
    used(BITS_ALLOCATED, WORDS, "BitsAllocated", Aspect::Storage),
    used(BITS_STORED, WORDS, "BitsStored", Aspect::Storage),
    used(HIGH_BIT, WORDS, "HighBit", Aspect::Storage),
    used(IS_SIGNED, WORDS, "PixelRepresentation", Aspect::Value),
    used(INTERCEPT, Kind::Text, "RescaleIntercept", Aspect::Value),
    used(SLOPE, Kind::Text, "RescaleSlope", Aspect::Value),
    used(PALETTE_ABOUT[0], WORDS, "RedPaletteColorLookupTableDescriptor", Aspect::Value),
    used(PALETTE_ABOUT[1], WORDS, "GreenPaletteColorLookupTableDescriptor", Aspect::Value),
    used(PALETTE_ABOUT[2], WORDS, "BluePaletteColorLookupTableDescriptor", Aspect::Value),
    used(PALETTE[0], WORDS, "RedPaletteColorLookupTableData", Aspect::Value),
    used(PALETTE[1], WORDS, "GreenPaletteColorLookupTableData", Aspect::Value),
    used(PALETTE[2], WORDS, "BluePaletteColorLookupTableData", Aspect::Value),
    used(SEGMENTED_PALETTE[0], WORDS, "SegmentedRedPaletteColorLookupTableData", Aspect::Value),
    used(SEGMENTED_PALETTE[1], WORDS, "SegmentedGreenPaletteColorLookupTableData", Aspect::Value),
    used(SEGMENTED_PALETTE[2], WORDS, "SegmentedBluePaletteColorLookupTableData", Aspect::Value),
    used(PIXEL_MEASURES, Kind::Sequence, "PixelMeasuresSequence", Aspect::Geometry),
    used(PHILIPS, Kind::Text, "private creator of Philips", Aspect::Storage),
    used(PHILIPS_SLICES, LONGS, "slices of Philips", Aspect::Geometry),
    used(PHILIPS_UNIT, WORDS, "unit of Philips", Aspect::Geometry),
    used(PHILIPS_DELTA, REALS, "spacing of Philips", Aspect::Geometry),
    used(SHARED_GROUPS, Kind::Sequence, "SharedFunctionalGroupsSequence", Aspect::Geometry),
    used(FRAME_GROUPS, Kind::Sequence, "PerFrameFunctionalGroupsSequence", Aspect::Geometry),
    used(EXTENDED_TABLE, REALS, "ExtendedOffsetTable", Aspect::Storage),
];

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
