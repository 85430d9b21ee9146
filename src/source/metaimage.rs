//! MetaImage (`.mha`, `.mhd`): plain volumes, the sequences of the PLUS toolkit, and UsTK's pre-scan sweeps.

use super::data_files::{self, Pattern};
use super::frame::DEMO_DATA;
use super::keys::{Aspect, Keys, Stated, Use, keys};
use super::layout::{Layout, Remarks, StoredGeometry, extent, frames, warned};
use super::packed::{Encoding, GZIP, InputFile, Pixels};
use super::pixel::{Number, PixelFormat};
use super::plus::{PlusFrames, PlusWords, spread};
use super::sequence::COMMENT;
use super::units::millimetres;
use crate::files::{InputError, quoted};
use crate::probe::file::SLAB;
use crate::probe::{Advance, Array, Axis, Motion, Probe, World};
use glam::DVec3;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// File name endings: `mha` for header and samples in one file, `mhd` for a header with its samples in another file.
pub(super) const ENDINGS: [&str; 2] = ["mha", "mhd"];

/// The number types that are read, by their names.
const NUMBERS: [(&str, Number); 10] = [
    ("MET_UCHAR", Number::U8),
    ("MET_CHAR", Number::I8),
    ("MET_USHORT", Number::U16),
    ("MET_SHORT", Number::I16),
    ("MET_UINT", Number::U32),
    ("MET_INT", Number::I32),
    ("MET_ULONG_LONG", Number::U64),
    ("MET_LONG_LONG", Number::I64),
    ("MET_FLOAT", Number::F32),
    ("MET_DOUBLE", Number::F64),
];

pub(super) fn read(file: &InputFile) -> Result<Layout, InputError> {
    let path = file.path;
    let mut header = Header::read(file)?;
    if let Some(other) = header.get("ObjectType").filter(|t| *t != "Image") {
        return header.fault("ObjectType", format!("{} is not read, only Image is", quoted(other)));
    }
    let channels = match header.integer("ElementNumberOfChannels")? {
        None | Some(1) => 1,
        Some(colours @ (3 | 4)) => colours as usize,
        Some(other) => return header.fault("ElementNumberOfChannels", format!("is {other}, must be 1, 3 or 4")),
    };
    let word = header.need("ElementType")?;
    let Some((_, number)) = NUMBERS.iter().find(|(name, _)| *name == word) else {
        let names = NUMBERS.map(|(name, _)| name).join(", ");
        return header.fault("ElementType", format!("{} is not read, only {names} are", quoted(word)));
    };
    let mut remarks = Vec::new();
    let mut pixel = PixelFormat::grey(*number);
    pixel.big_endian = is_big_endian(&header, pixel.bytes(), &mut remarks)?;
    pixel.channels = channels;
    let ([width, height, depth], volumes) = dimensions(path, &header)?;
    let frames = frames(path, "DimSize", "makes", depth, volumes)?;
    let is_sequence = is_sequence(&header, &mut remarks)?;
    let world = world(&header, &mut remarks)?;
    let words = PlusWords {
        path,
        orientation: ("UltrasoundImageOrientation", header.get("UltrasoundImageOrientation")),
        kind: ("UltrasoundImageType", header.get("UltrasoundImageType")),
    };
    let lines = words.line_order()?;
    let pre_scan = prescan_probe(&header, [width, height], depth)?;
    let format = match &pre_scan {
        Some(_) => "MetaImage pre-scan sweep",
        None if header.frames.is_sequence || words.kind.1.is_some() => "PLUS sequence",
        None => "MetaImage",
    };
    // Frames in time are not neighbours in space: each is a volume of one slice.
    let is_pictures = is_sequence && header.dimensions() < 4;
    let slices = if is_pictures { 1 } else { depth };
    let geometry = match pre_scan {
        Some(probe) => StoredGeometry::Sweep(Box::new(probe)),
        None => words.pictures([width, height, slices], frames / slices, world, &lines, &mut remarks)?,
    };
    let states_geometry = match &geometry {
        StoredGeometry::Sweep(_) => true,
        StoredGeometry::Cartesian(_) => {
            !words.has_scan_lines()
                && [&SPACING[..], &ORIGIN, &MATRIX].concat().iter().any(|key| header.stated.has(key))
        }
        StoredGeometry::Missing(_) => false,
    };
    if let Some(orientation) = words.orientation.1 {
        remarks.push(("orientation".into(), quoted(orientation)));
    }
    let of_volume = if header.dimensions() < 4 { 1 } else { depth };
    let times = spread(&header.frames.times, of_volume, frames);
    let poses = header.frames.poses(path, of_volume, &mut remarks);
    let pixels = file.pixels(header.length);
    let stated = Layout::new(format, pixel, [width, height], frames, pixels, geometry);
    let (line_order, synthetic) = (lines, header.synthetic);
    let mut layout = Layout { line_order, volumes, states_geometry, poses, times, synthetic, remarks, ..stated };
    find_pixels(file, &header, &mut layout)?;
    layout.check(path, "DimSize")?;
    layout.unused = header.stated.finish(path, &mut layout.remarks)?;
    Ok(layout)
}

/// The byte order of numbers; MetaIO takes that of the machine where a file does not say it.
fn is_big_endian(header: &Header, bytes: usize, remarks: &mut Remarks) -> Result<bool, InputError> {
    let stated = header.flag("BinaryDataByteOrderMSB")?.or(header.flag("ElementByteOrderMSB")?);
    if stated.is_none() && bytes > 1 {
        let text = "BinaryDataByteOrderMSB is missing: the byte order is taken as little-endian";
        remarks.push(warned(header.path, "byte order", text.into()));
    }
    Ok(stated.unwrap_or(false))
}

/// Voxels of a volume, and the number of volumes: two to four dimensions; the fourth is volumes one after another.
fn dimensions(path: &Path, header: &Header) -> Result<([usize; 3], usize), InputError> {
    let count = match header.integer("NDims")? {
        Some(count @ (2..=4)) => count as usize,
        Some(other) => return header.fault("NDims", format!("is {other}, must be 2 to 4")),
        None => return header.fault("NDims", "is missing"),
    };
    let words: Vec<&str> = header.need("DimSize")?.split_whitespace().collect();
    if words.len() != count {
        return header.fault("DimSize", format!("has {} entries, but NDims is {count}", words.len()));
    }
    let mut all = [1; 4];
    for (i, word) in words.iter().enumerate() {
        let Ok(value) = word.parse() else {
            return header.fault("DimSize", format!("{}{} is not a whole number", which(i, count), quoted(word)));
        };
        all[i] = extent(path, "DimSize", &which(i, count), value)?;
    }
    let [x, y, z, volumes] = all;
    Ok(([x, y, z], volumes))
}

/// Whether the last axis is time. `Kinds = domain domain list` alone does not say so of pictures: the PLUS toolkit writes it into its
/// volumes, too. An axis of time or a list is read in the last place only.
fn is_sequence(header: &Header, remarks: &mut Remarks) -> Result<bool, InputError> {
    let count = header.dimensions();
    let kinds: Vec<String> =
        header.get("Kinds").unwrap_or("").split_whitespace().map(str::to_ascii_lowercase).collect();
    if !kinds.is_empty() && kinds.len() != count {
        let text = format!("Kinds has {} entries, but NDims is {count}: they are not used", kinds.len());
        remarks.push(warned(header.path, "kinds", text));
    }
    if kinds.len() != count {
        let text = "of no stated kind, taken as volumes in time".to_string();
        remarks.extend((count == 4).then(|| ("fourth axis".into(), text)));
        return Ok(header.frames.is_sequence);
    }
    for (i, kind) in kinds.iter().enumerate() {
        let is_last = i + 1 == count;
        match kind.as_str() {
            "domain" | "space" | "none" | "???" => {}
            "list" | "time" if is_last && count > 2 => {}
            other => {
                let fault = format!(
                    "{}{} is not read there: axes in space, then a list or time, are",
                    which(i, count),
                    quoted(other)
                );
                return header.fault("Kinds", fault);
            }
        }
    }
    let last = kinds.last().map_or("", String::as_str);
    if count == 4 && !matches!(last, "list" | "time") {
        remarks.push(("fourth axis".into(), "is no list or time by its kind, taken as volumes in time".into()));
    }
    Ok(header.frames.is_sequence || (count == 3 && last == "time"))
}

/// Where the voxels lie. MetaImage has the directions of the axes one after another, in LPS. A fourth axis must be independent of space.
fn world(header: &Header, remarks: &mut Remarks) -> Result<World, InputError> {
    let count = header.dimensions();
    let unit = unit(header, remarks);
    let mut spacing = [unit, unit, unit, 1.0];
    let mut named = "TransformMatrix";
    if let Some((field, _)) = header.first_of(&SPACING) {
        named = field;
        for (i, value) in header.numbers(field, count)?.into_iter().enumerate() {
            if value <= 0.0 {
                return header.fault(field, format!("{}is {value}, must be above 0", which(i, count)));
            }
            spacing[i] = if i < 3 { value * unit } else { value };
        }
    }
    let mut origin = [0.0; 4];
    if let Some((field, _)) = header.first_of(&ORIGIN) {
        origin[..count].copy_from_slice(&header.numbers(field, count)?);
    }
    if spacing[3] != 1.0 || origin[3] != 0.0 {
        let text = format!(
            "{} from {} on along the fourth axis have no unit: they make no time stamps",
            spacing[3], origin[3]
        );
        remarks.push(("time steps".into(), text));
    }
    let mut axes = [DVec3::X, DVec3::Y, DVec3::Z];
    if let Some((field, _)) = header.first_of(&MATRIX) {
        named = field;
        // It names what the matrix states.
        header.get("AnatomicalOrientation");
        for (i, direction) in header.numbers(field, count * count)?.chunks_exact(count).enumerate() {
            let mut whole = [0.0; 4];
            whole[..count].copy_from_slice(direction);
            let [x, y, z, t] = whole;
            let mixes = if i < 3 { t != 0.0 } else { [x, y, z] != [0.0; 3] };
            if mixes {
                return header.fault(field, "turns the fourth axis, time, into space");
            }
            if let Some(axis) = axes.get_mut(i) {
                *axis = DVec3::new(x, y, z).normalize_or_zero();
            }
        }
    }
    let [x, y, z, _] = spacing;
    let [x, y, z] = header.frames.spacing(header.path, [x, y, z], remarks).unwrap_or([x, y, z]);
    let axes = [axes[0] * x, axes[1] * y, axes[2] * z];
    let origin = DVec3::new(origin[0], origin[1], origin[2]) * unit;
    World::new(axes, origin).map_err(|why| InputError::new(header.path, named, why))
}

/// What the unit of lengths is, mm. Without `DistanceUnits` it is mm.
fn unit(header: &Header, remarks: &mut Remarks) -> f64 {
    let Some(word) = header.get("DistanceUnits").filter(|word| *word != "?") else { return 1.0 };
    millimetres(word).unwrap_or_else(|| {
        let text = format!("DistanceUnits, the unit {}, is not known, taken as mm", quoted(word));
        remarks.push(warned(header.path, "units", text));
        1.0
    })
}

/// Finds the location and the length of the samples.
fn find_pixels(file: &InputFile, header: &Header, layout: &mut Layout) -> Result<(), InputError> {
    let field = "ElementDataFile";
    let parts = data_files(file, header, layout).map_err(|fault| InputError::new(file.path, field, fault))?;
    data_files::divide(file.path, field, parts, layout, |part, bytes| place(header, part, bytes))
}

/// The files of the samples: this one (`LOCAL`), a list of names behind the header (`LIST`, `LIST 2D`), numbered ones (`FORMAT`, and the
/// first number, the last and the step, as far as they are stated), or one.
fn data_files(file: &InputFile, header: &Header, layout: &Layout) -> Result<Vec<Pixels>, String> {
    let name = header.get("ElementDataFile").unwrap_or("");
    let sizes: Vec<u64> =
        header.get("DimSize").unwrap_or("").split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let mut words = name.split_whitespace();
    if name.eq_ignore_ascii_case("LOCAL") {
        return Ok(vec![layout.pixels.clone()]);
    }
    if words.next() == Some("LIST") {
        let axes = match words.next() {
            None => sizes.len().saturating_sub(1),
            Some(word) => {
                word.trim_end_matches(['D', 'd']).parse().map_err(|_| format!("{} is no list", quoted(name)))?
            }
        };
        if !(1..=sizes.len()).contains(&axes) {
            return Err(format!("states {axes} axes of a file, there are {}", sizes.len()));
        }
        let count = sizes.iter().skip(axes).product::<u64>();
        if header.list.len() as u64 != count {
            return Err(format!("lists {} files, {count} make up the sizes", header.list.len()));
        }
        return data_files::all(file.path, &header.list);
    }
    if !name.contains('%') || data_files::is_there(file.path, name) {
        return Ok(vec![data_files::beside(file.path, name)?]);
    }
    let count = sizes.last().copied().unwrap_or(1) as i64;
    let pattern = Pattern::parse(name, 3)?;
    let (first, last, step) = match pattern.numbers[..] {
        [] => (1, count, 1),
        [first] => (first, first.saturating_add(count - 1), 1),
        // The step that leads there in as many files as there are slices.
        [first, last] => (first, last, (last.saturating_sub(first) / (count - 1).max(1)).max(1)),
        [first, last, step, ..] => (first, last, step),
    };
    let names = pattern.names(first, last, step)?;
    match names.len() as i64 == count {
        true => data_files::all(file.path, &names),
        false => Err(format!("names {} files, {count} make up the sizes", names.len())),
    }
}

/// Finds `claimed` bytes of samples in one file. Returns how many bytes follow them.
fn place(header: &Header, pixels: &mut Pixels, claimed: u64) -> Result<u64, InputError> {
    let is_packed = pixels.is_compressed();
    let is_compressed = header.flag("CompressedData")?.unwrap_or(false);
    if is_compressed && is_packed {
        return header.fault("CompressedData", "is True in a .gz file: data that are compressed twice are not read");
    }
    if !is_compressed && header.flag("BinaryData")? == Some(false) {
        return header.fault("BinaryData", "numbers written as text are not read");
    }
    let end = pixels.offset + pixels.length;
    match header.integer("HeaderSize")? {
        None | Some(0) => {}
        Some(bytes @ 1..) if is_packed => pixels.inside = bytes as u64,
        Some(bytes @ 1..) => pixels.offset = bytes as u64,
        // In MetaIO this means that the samples are the last bytes of the file.
        Some(-1) if !is_compressed && !is_packed => {
            pixels.offset = end.saturating_sub(claimed).max(pixels.offset);
        }
        Some(other) => return header.fault("HeaderSize", format!("{other} is not possible here")),
    }
    if is_packed {
        return Ok(0);
    }
    pixels.length = end.saturating_sub(pixels.offset);
    if is_compressed {
        pixels.encoding = deflated(pixels)?;
    }
    let known = match (is_compressed, header.integer("CompressedDataSize")?) {
        (false, _) => claimed,
        (true, None | Some(0)) => pixels.length,
        (true, Some(bytes @ 1..)) if bytes as u64 > pixels.length => {
            let there = pixels.length;
            let fault = format!("cut short, {there} of {bytes} compressed bytes are there");
            return Err(InputError::new(&pixels.path, "data", fault));
        }
        (true, Some(bytes @ 1..)) => bytes as u64,
        (true, Some(other)) => return header.fault("CompressedDataSize", format!("is {other}, must be above 0")),
    };
    let more = pixels.length.saturating_sub(known);
    pixels.length -= more;
    Ok(more)
}

/// Whether compressed samples are a zlib stream or a gzip file, by their first bytes: a zlib stream cannot begin so. MetaIO reads both.
fn deflated(pixels: &Pixels) -> Result<Encoding, InputError> {
    let mut start = Vec::new();
    pixels
        .open(0)
        .and_then(|mut data| data.fill(2, &mut start))
        .map_err(|e| InputError::unreadable(&pixels.path, &e))?;
    Ok(if start == GZIP { Encoding::Gzip } else { Encoding::Zlib })
}

/// Longest header, bytes and lines: those of tracked sequences have some ten lines for every frame.
const MAX_HEADER_BYTES: u64 = 32 << 20;
const MAX_HEADER_LINES: usize = 500_000;

/// The fields of a header that are read, and those of MetaIO that are not. The values of all others are skipped, so that no patient's name gets
/// into a message.
pub(super) static KEYS: Keys = Keys::new(|| {
    keys(&[
        ("ObjectType", Aspect::Storage, Use::Used),
        ("NDims|DimSize", Aspect::Geometry, Use::Used),
        ("ElementType", Aspect::Storage, Use::Used),
        ("ElementNumberOfChannels", Aspect::Value, Use::Used),
        ("ElementSpacing", Aspect::Geometry, Use::Used),
        ("ElementSize", Aspect::Geometry, Use::Optional),
        ("DistanceUnits", Aspect::Geometry, Use::Used),
        ("Kinds", Aspect::Time, Use::Used),
        ("Offset|Position|Origin", Aspect::Geometry, Use::Used),
        ("TransformMatrix|Rotation|Orientation", Aspect::Orientation, Use::Used),
        ("AnatomicalOrientation", Aspect::Orientation, Use::Warned(&["RAI", "???"])),
        ("CenterOfRotation", Aspect::Geometry, Use::Warned(&["0"])),
        ("ElementToIntensityFunctionSlope", Aspect::Value, Use::Warned(&["1"])),
        ("ElementToIntensityFunctionOffset", Aspect::Value, Use::Warned(&["0"])),
        ("BinaryData|BinaryDataByteOrderMSB|ElementByteOrderMSB|CompressedData", Aspect::Storage, Use::Used),
        ("CompressedDataSize|HeaderSize", Aspect::Storage, Use::Used),
        ("HeaderSizePerSlice", Aspect::Storage, Use::Refused(&["0"])),
        ("ElementDataFile", Aspect::Storage, Use::Used),
        ("UltrasoundImageOrientation", Aspect::Orientation, Use::Used),
        ("UltrasoundImageType", Aspect::Value, Use::Used),
        ("IsTransducerConvex|TransducerRadius|ScanLinePitch|MotorType|MotorRadius", Aspect::Geometry, Use::Optional),
        ("FramePitch|AxialResolution", Aspect::Geometry, Use::Optional),
        (COMMENT, Aspect::About, Use::Used),
        ("ObjectSubType|Name|ID|ParentID|AcquisitionDate|Color|Modality|SequenceID", Aspect::About, Use::Listed),
        ("ElementMin|ElementMax|ElementNBits|CompressionLevel", Aspect::About, Use::Listed),
    ])
});

const SPACING: [&str; 2] = ["ElementSpacing", "ElementSize"];
const ORIGIN: [&str; 3] = ["Offset", "Position", "Origin"];
const MATRIX: [&str; 3] = ["TransformMatrix", "Rotation", "Orientation"];

struct Header<'a> {
    path: &'a Path,
    stated: Stated,
    /// What PLUS says of the frames.
    frames: PlusFrames,
    /// The lines behind `ElementDataFile = LIST`.
    list: Vec<String>,
    /// A comment says that the file is of the phantom. Other comments are skipped.
    synthetic: bool,
    /// Length up to and including the line of `ElementDataFile`, bytes.
    length: u64,
}

impl<'a> Header<'a> {
    fn read(file: &InputFile<'a>) -> Result<Header<'a>, InputError> {
        let path = file.path;
        let stream = file.open().map_err(|e| InputError::unreadable(path, &e))?;
        let mut input = BufReader::new(stream.take(MAX_HEADER_BYTES));
        let mut header = Header {
            path,
            stated: Stated::new(&KEYS),
            frames: PlusFrames::default(),
            list: Vec::new(),
            synthetic: false,
            length: 0,
        };
        let mut line = Vec::new();
        for number in 1..=MAX_HEADER_LINES {
            line.clear();
            header.length += input.read_until(b'\n', &mut line).map_err(|e| InputError::unreadable(path, &e))? as u64;
            if header.length >= MAX_HEADER_BYTES {
                break;
            }
            let is_list = header.is_list();
            if line.is_empty() {
                // A list ends with the file.
                if is_list {
                    return Ok(header);
                }
                break;
            }
            let text = String::from_utf8_lossy(&line);
            let text = text.trim();
            if text.is_empty() {
                continue;
            }
            if is_list {
                header.list.push(text.to_string());
                continue;
            }
            // The text itself is not quoted: it may contain anything.
            let Some((key, value)) = text.split_once('=') else {
                return Err(InputError::new(path, format!("line {number}"), "is not 'Key = Value'"));
            };
            let (key, value) = (key.trim(), value.trim());
            if key == COMMENT {
                header.synthetic |= value == DEMO_DATA;
            } else if let Some(of_frame) = key.strip_prefix("Seq_Frame") {
                if !header.frames.field(path, of_frame, value)? {
                    header.stated.note(key);
                }
            } else if let Err(twice) = header.stated.put(key, value) {
                return header.fault(twice, "is given twice");
            }
            // The data begin after this line.
            if key == "ElementDataFile" && !header.is_list() {
                return Ok(header);
            }
        }
        header.fault("ElementDataFile", "is missing, or not within the first 32 MiB and 500000 lines")
    }

    /// True once `ElementDataFile = LIST` was read: names of files follow.
    fn is_list(&self) -> bool {
        self.get("ElementDataFile").is_some_and(|name| name.split_whitespace().next() == Some("LIST"))
    }

    /// What `NDims` says, where it is known to be 2 to 4.
    fn dimensions(&self) -> usize {
        self.get("NDims").and_then(|word| word.parse().ok()).unwrap_or(3)
    }

    fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.path, field, fault))
    }

    fn get(&self, field: &str) -> Option<&str> {
        self.stated.get(field)
    }

    /// The first existing field of several spellings, with its value. Others that say the same count as used.
    fn first_of<'n>(&self, names: &[&'n str]) -> Option<(&'n str, &str)> {
        let name = names.iter().find(|name| self.stated.has(name))?;
        let value = self.get(name)?;
        for other in names.iter().filter(|other| self.stated.is(other, value)) {
            self.get(other);
        }
        Some((*name, value))
    }

    fn need(&self, field: &str) -> Result<&str, InputError> {
        self.get(field).map_or_else(|| self.fault(field, "is missing"), Ok)
    }

    /// True, False, 1 or 0, as MetaIO writes and reads them; `None` if absent.
    fn flag(&self, field: &str) -> Result<Option<bool>, InputError> {
        match self.get(field) {
            None => Ok(None),
            Some("True" | "true" | "TRUE" | "T" | "1") => Ok(Some(true)),
            Some("False" | "false" | "FALSE" | "F" | "0") => Ok(Some(false)),
            Some(other) => self.fault(field, format!("{} is neither True nor False", quoted(other))),
        }
    }

    fn integer(&self, field: &str) -> Result<Option<i64>, InputError> {
        let Some(value) = self.get(field) else { return Ok(None) };
        match value.parse() {
            Ok(value) => Ok(Some(value)),
            Err(_) => self.fault(field, format!("{} is not a whole number", quoted(value))),
        }
    }

    /// Exactly `count` finite numbers.
    fn numbers(&self, field: &str, count: usize) -> Result<Vec<f64>, InputError> {
        let words: Vec<&str> = self.need(field)?.split_whitespace().collect();
        if words.len() != count {
            return self.fault(field, format!("has {} entries, must have {count}", words.len()));
        }
        let number = |(i, word): (usize, &&str)| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => self.fault(field, format!("{}{} is not a finite number", which(i, count), quoted(word))),
        };
        words.iter().enumerate().map(number).collect()
    }

    /// One number above 0, or at least 0.
    fn size(&self, field: &str, may_be_zero: bool) -> Result<f64, InputError> {
        let value = self.numbers(field, 1)?[0];
        match value > 0.0 || (may_be_zero && value == 0.0) {
            true => Ok(value),
            false if may_be_zero => self.fault(field, format!("is {value}, must be at least 0")),
            false => self.fault(field, format!("is {value}, must be above 0")),
        }
    }
}

/// "3rd entry " of a list, empty for a single value.
fn which(index: usize, count: usize) -> String {
    match (index, count) {
        (_, 1) => String::new(),
        (0, _) => "1st entry ".into(),
        (1, _) => "2nd entry ".into(),
        (2, _) => "3rd entry ".into(),
        _ => format!("{}th entry ", index + 1),
    }
}

/// The keys of a pre-scan sweep, as the UsTK library writes them, in metres and radians. If a file has any of them it must have all.
const PRESCAN_KEYS: [&str; 7] = [
    "IsTransducerConvex",
    "TransducerRadius",
    "ScanLinePitch",
    "MotorType",
    "MotorRadius",
    "FramePitch",
    "AxialResolution",
];
/// Speed of sound, which UsTK omits: the usual value for soft tissue, m/s.
const SOUND_SPEED: f64 = 1540.0;
const MM: f64 = 1e3;

/// The probe of a pre-scan sweep; `None` if the file has none of the keys.
fn prescan_probe(header: &Header, [samples, lines]: [usize; 2], frames: usize) -> Result<Option<Probe>, InputError> {
    let kind = header.get("UltrasoundImageType").unwrap_or("");
    // UsTK keeps the keys in files that it has scan-converted.
    if kind.starts_with("POSTSCAN") || (!kind.starts_with("PRESCAN") && header.first_of(&PRESCAN_KEYS).is_none()) {
        return Ok(None);
    }
    if !matches!(kind, "" | "BRIGHTNESS") && !kind.starts_with("PRESCAN") {
        let fault = format!("{} is not read: only detected and compressed frames are", quoted(kind));
        return header.fault("UltrasoundImageType", fault);
    }
    let line_pitch = header.size("ScanLinePitch", false)?;
    let (array, lines) = match header.flag("IsTransducerConvex")? {
        Some(true) => {
            let radius = header.size("TransducerRadius", true)? * MM;
            (Array::Curved { radius }, Axis::centred(line_pitch, lines))
        }
        Some(false) => (Array::Linear, Axis::centred(line_pitch * MM, lines)),
        None => return header.fault("IsTransducerConvex", "is missing"),
    };
    let sample_pitch = header.size("AxialResolution", false)? * MM;
    let (motion, slices) = if frames == 1 {
        (Motion::Still { thickness: SLAB }, Axis::centred(1.0, 1))
    } else {
        let frame_pitch = header.size("FramePitch", false)?;
        match header.need("MotorType")? {
            "TiltingMotor" => {
                let wobble_radius = header.size("MotorRadius", true)? * MM;
                (Motion::Fan { wobble_radius }, Axis::centred(frame_pitch, frames))
            }
            "LinearMotor" => (Motion::Translated, Axis::centred(frame_pitch * MM, frames)),
            other => {
                let why = format!("{} is not read, only TiltingMotor and LinearMotor are", quoted(other));
                return header.fault("MotorType", why);
            }
        }
    };
    Ok(Some(Probe {
        array,
        lines,
        start_depth: 0.0,
        sample_pitch,
        samples,
        motion,
        slices,
        advance: Advance::None,
        sound_speed: SOUND_SPEED,
    }))
}
