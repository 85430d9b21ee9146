//! MetaImage (`.mha`, `.mhd`): plain volumes, the sequences of the PLUS toolkit, and UsTK's pre-scan sweeps.

use super::frame::DEMO_DATA;
use super::layout::{Cartesian, Layout, LineOrder, StoredGeometry, extent};
use super::packed::{Encoding, InputFile, Pixels};
use super::pixel::{Number, PixelFormat};
use super::sequence::COMMENT;
use super::transforms::{Poses, TransformName, matrix};
use crate::files::{InputError, quoted};
use crate::probe::file::SLAB;
use crate::probe::{Advance, Array, Axis, AxisOrder, Motion, Probe, World};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Endings of its files: header and samples in one, or in two.
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
    let big_endian = header.flag("BinaryDataByteOrderMSB")?.or(header.flag("ElementByteOrderMSB")?).unwrap_or(false);
    let pixel = PixelFormat { number: *number, channels, big_endian, scale: None };
    let [width, height, frames] = dimensions(path, &header)?;
    let mut remarks = Vec::new();
    let world = world(&header)?;
    let lines = line_order(&header)?;
    let pre_scan = prescan_probe(&header, [width, height], frames)?;
    let format = match &pre_scan {
        Some(_) => "MetaImage pre-scan sweep",
        None if header.sequence || header.get("UltrasoundImageType").is_some() => "PLUS sequence",
        None => "MetaImage",
    };
    let geometry = match pre_scan {
        Some(probe) => StoredGeometry::Sweep(Box::new(probe)),
        None => own_pictures(path, &header, ([width, height, frames], world), &lines)?,
    };
    let states_geometry = match &geometry {
        StoredGeometry::Sweep(_) => true,
        StoredGeometry::Cartesian(_) => !header.has_scan_lines() && header.first_of(&PLACEMENT_KEYS).is_some(),
        StoredGeometry::Missing(_) => false,
    };
    if let Some(orientation) = header.get("UltrasoundImageOrientation") {
        remarks.push(("orientation".into(), quoted(orientation)));
    }
    remarks.extend(header.poses.remark());
    if header.not_ok > 0 {
        remarks.push(("frames not OK".into(), format!("{} by their ImageStatus; read all the same", header.not_ok)));
    }
    let mut layout = Layout {
        format,
        pixel,
        frame_size: [width, height],
        frames,
        pixels: file.pixels(header.length),
        line_order: lines,
        geometry,
        backward: false,
        volumes: 1,
        states_geometry,
        poses: std::mem::take(&mut header.poses),
        times: header.times.range(..frames).map(|(k, t)| (*k, *t)).collect(),
        synthetic: header.synthetic,
        remarks,
    };
    find_pixels(file, &header, &mut layout)?;
    layout.check(path, "DimSize")?;
    Ok(layout)
}

/// Width, height and frames; a single frame when there are two dimensions.
fn dimensions(path: &Path, header: &Header) -> Result<[usize; 3], InputError> {
    let count = match header.integer("NDims")? {
        Some(count @ (2 | 3)) => count as usize,
        Some(other) => return header.fault("NDims", format!("is {other}, must be 2 or 3")),
        None => return header.fault("NDims", "is missing"),
    };
    let words: Vec<&str> = header.need("DimSize")?.split_whitespace().collect();
    if words.len() != count {
        return header.fault("DimSize", format!("has {} entries, but NDims is {count}", words.len()));
    }
    let mut size = [1; 3];
    for (i, word) in words.iter().enumerate() {
        let Ok(value) = word.parse() else {
            return header.fault("DimSize", format!("{}{} is not a whole number", which(i, count), quoted(word)));
        };
        size[i] = extent(path, "DimSize", &which(i, count), value)?;
    }
    Ok(size)
}

/// Where the voxels lie. MetaImage has the directions of the axes one after another, in LPS.
fn world(header: &Header) -> Result<World, InputError> {
    let count = if header.get("NDims") == Some("2") { 2 } else { 3 };
    let mut spacing = [1.0; 3];
    let mut named = "TransformMatrix";
    if let Some((field, _)) = header.first_of(&["ElementSpacing", "ElementSize"]) {
        named = field;
        for (i, value) in header.numbers(field, count)?.into_iter().enumerate() {
            if value <= 0.0 {
                return header.fault(field, format!("{}is {value}, must be above 0", which(i, count)));
            }
            spacing[i] = value;
        }
    }
    let mut origin = [0.0; 3];
    if let Some((field, _)) = header.first_of(&["Offset", "Position", "Origin"]) {
        origin[..count].copy_from_slice(&header.numbers(field, count)?);
    }
    let mut axes = [DVec3::X, DVec3::Y, DVec3::Z];
    if let Some((field, _)) = header.first_of(&["TransformMatrix", "Rotation", "Orientation"]) {
        named = field;
        for (axis, direction) in axes.iter_mut().zip(header.numbers(field, count * count)?.chunks_exact(count)) {
            let mut whole = [0.0; 3];
            whole[..count].copy_from_slice(direction);
            *axis = DVec3::from(whole).normalize_or_zero();
        }
    }
    let axes = [0, 1, 2].map(|n| axes[n] * spacing[n]);
    World::new(axes, DVec3::from(origin)).map_err(|why| InputError::new(header.path, named, why))
}

/// PLUS names the axes of a frame by their direction on the transducer, the fastest one first. F is away from it, so FM is scan lines in
/// order and FU is scan lines from last to first. M or U as the first letter means rows of pictures.
fn line_order(header: &Header) -> Result<LineOrder, InputError> {
    match header.get("UltrasoundImageOrientation") {
        None | Some("FM" | "FMA") => Ok(LineOrder::InOrder),
        Some("FU" | "FUA") => Ok(LineOrder::Reversed),
        Some(word) if word.starts_with(['M', 'U', 'A', 'D']) => Ok(LineOrder::Pictures(quoted(word))),
        Some(other) => header.fault(
            "UltrasoundImageOrientation",
            format!("{} is not read: scan lines must be FM or FU, pictures begin with M, U, A or D", quoted(other)),
        ),
    }
}

/// A file without pre-scan keys holds pictures, unless it says that its frames are scan lines.
fn own_pictures(
    path: &Path,
    header: &Header,
    (mut size, world): ([usize; 3], World),
    lines: &LineOrder,
) -> Result<StoredGeometry, InputError> {
    match (header.get("UltrasoundImageType"), lines) {
        (None | Some("US_IMG_TYPE_XX"), _) | (Some("BRIGHTNESS"), LineOrder::Pictures(_)) => {}
        (Some(converted), _) if converted.starts_with("POSTSCAN") => {}
        (Some("BRIGHTNESS"), _) => {
            let fault = "BRIGHTNESS frames of scan lines need a probe geometry: give --probe FILE.toml, or put a \
                         probe.toml beside the recording";
            return Ok(StoredGeometry::Missing(InputError::new(path, "UltrasoundImageType", fault)));
        }
        (Some(other), _) => {
            let fault = format!("{} is not read: only BRIGHTNESS is detected and compressed", quoted(other));
            return header.fault("UltrasoundImageType", fault);
        }
    }
    // Frames in time are not neighbours in space: each is a volume of one slice. `Kinds = domain domain list` alone does not make them
    // so: the PLUS toolkit writes it into its volumes, too.
    let volumes = if header.sequence { std::mem::replace(&mut size[2], 1) } else { 1 };
    let order = header.get("UltrasoundImageOrientation").and_then(AxisOrder::of_plus);
    let order = order.filter(|order| volumes == 1 || order.keeps_frames()).filter(|_| !header.has_scan_lines());
    let order = order.unwrap_or(AxisOrder::STORED);
    // The matrix is that of the axes as PLUS draws them, the spacing that of the stored ones.
    let directions = world.directions();
    let axes = [0, 1, 2].map(|n| directions.col(n) * world.axis(order.stored[n]).length());
    let world = World::new(axes, world.origin()).map_err(|why| InputError::new(path, "TransformMatrix", why))?;
    Ok(StoredGeometry::Cartesian(Cartesian { size, volumes, world, order }))
}

/// Finds the location and the length of the samples.
fn find_pixels(file: &InputFile, header: &Header, layout: &mut Layout) -> Result<(), InputError> {
    let name = header.need("ElementDataFile")?;
    if name != "LOCAL" {
        if name.starts_with("LIST") || name.contains('%') {
            return header.fault("ElementDataFile", "a list of files is not read, only LOCAL or one file name");
        }
        layout.pixels = match Pixels::beside(file.path, name) {
            Ok(pixels) => pixels,
            Err(fault) => return header.fault("ElementDataFile", fault),
        };
    }
    let is_packed = layout.pixels.is_compressed();
    let is_compressed = header.flag("CompressedData")?.unwrap_or(false);
    if is_compressed && is_packed {
        return header.fault("CompressedData", "is True in a .gz file: data that are compressed twice are not read");
    }
    if !is_compressed && header.flag("BinaryData")? == Some(false) {
        return header.fault("BinaryData", "numbers written as text are not read");
    }
    let claimed = layout.frame_bytes() * layout.frames as u64;
    let pixels = &mut layout.pixels;
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
        return Ok(());
    }
    if is_compressed {
        pixels.encoding = Encoding::Zlib;
    }
    pixels.length = end.saturating_sub(pixels.offset);
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
    if known < pixels.length {
        let more = format!("{} bytes behind the samples; not read", pixels.length - known);
        layout.remarks.push(("more data".into(), more));
        pixels.length = known;
    }
    Ok(())
}

/// Longest header, bytes and lines: those of tracked sequences have some ten lines for every frame.
const MAX_HEADER_BYTES: u64 = 32 << 20;
const MAX_HEADER_LINES: usize = 500_000;

/// The fields that are read. All others are skipped, so that no patient's name gets into a message.
const KEYS: &[&str] = &[
    "ObjectType",
    "NDims",
    "DimSize",
    "ElementType",
    "ElementSpacing",
    "ElementSize",
    "Offset",
    "Position",
    "Origin",
    "TransformMatrix",
    "Rotation",
    "Orientation",
    "BinaryData",
    "BinaryDataByteOrderMSB",
    "ElementByteOrderMSB",
    "CompressedData",
    "CompressedDataSize",
    "ElementNumberOfChannels",
    "HeaderSize",
    "ElementDataFile",
    "UltrasoundImageOrientation",
    "UltrasoundImageType",
    "IsTransducerConvex",
    "TransducerRadius",
    "ScanLinePitch",
    "MotorType",
    "MotorRadius",
    "FramePitch",
    "AxialResolution",
];

/// The fields that place the samples in space.
const PLACEMENT_KEYS: [&str; 8] =
    ["ElementSpacing", "ElementSize", "Offset", "Position", "Origin", "TransformMatrix", "Rotation", "Orientation"];

struct Header<'a> {
    path: &'a Path,
    fields: HashMap<&'static str, String>,
    /// Time stamps by frame, s: `Seq_FrameNNNN_Timestamp`.
    times: BTreeMap<usize, f64>,
    /// Transforms by frame: `Seq_FrameNNNN_ProbeToTrackerTransform`, those whose status is OK.
    poses: Poses,
    /// Frames whose `Seq_FrameNNNN_ImageStatus` is not OK.
    not_ok: usize,
    /// There are `Seq_` fields: frames in time.
    sequence: bool,
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
            fields: HashMap::new(),
            times: BTreeMap::new(),
            poses: Poses::default(),
            not_ok: 0,
            sequence: false,
            synthetic: false,
            length: 0,
        };
        // Transforms whose status is not OK: the status may stand before its transform.
        let mut invalid = Vec::new();
        let mut line = Vec::new();
        for number in 1..=MAX_HEADER_LINES {
            line.clear();
            header.length += input.read_until(b'\n', &mut line).map_err(|e| InputError::unreadable(path, &e))? as u64;
            if line.is_empty() || header.length >= MAX_HEADER_BYTES {
                break;
            }
            let text = String::from_utf8_lossy(&line);
            let text = text.trim();
            if text.is_empty() {
                continue;
            }
            // The text itself is not quoted: it may contain anything.
            let Some((key, value)) = text.split_once('=') else {
                return Err(InputError::new(path, format!("line {number}"), "is not 'Key = Value'"));
            };
            let (key, value) = (key.trim(), value.trim());
            if let Some(known) = KEYS.iter().find(|k| **k == key) {
                if header.fields.insert(known, value.to_string()).is_some() {
                    return header.fault(known, "is given twice");
                }
            } else if key == COMMENT {
                header.synthetic |= value == DEMO_DATA;
            } else if let Some(of_frame) = key.strip_prefix("Seq_Frame") {
                header.sequence = true;
                header.frame_field(of_frame, value, &mut invalid)?;
            }
            // The data begin after this line.
            if key == "ElementDataFile" {
                invalid.iter().for_each(|(name, frame)| header.poses.remove(name, *frame));
                return Ok(header);
            }
        }
        header.fault("ElementDataFile", "is missing, or not within the first 32 MiB and 500000 lines")
    }

    /// `0012_Timestamp`, `0012_ImageStatus`, `0012_ProbeToTrackerTransform` and its `...Status`; other fields of frames are skipped.
    fn frame_field(
        &mut self,
        key: &str,
        value: &str,
        invalid: &mut Vec<(TransformName, usize)>,
    ) -> Result<(), InputError> {
        let Some((number, field)) = key.split_once('_') else { return Ok(()) };
        let Ok(number) = number.parse::<usize>() else { return Ok(()) };
        match field {
            "Timestamp" => match value.parse::<f64>() {
                Ok(time) if time.is_finite() => drop(self.times.insert(number, time)),
                _ => {
                    let field = format!("Seq_Frame{number:04}_Timestamp");
                    return self.fault(&field, format!("{} is not a finite number", quoted(value)));
                }
            },
            "ImageStatus" if value != "OK" => self.not_ok += 1,
            _ => {
                if let Some(name) = field.strip_suffix("TransformStatus").and_then(|name| name.parse().ok()) {
                    if value != "OK" {
                        invalid.push((name, number));
                    }
                } else if let Some(name) = field.strip_suffix("Transform").and_then(|name| name.parse().ok()) {
                    match matrix(value) {
                        Ok(matrix) => self.poses.add(name, number, matrix),
                        // As programs write what was not tracked: no inverse, not finite.
                        Err(_) => invalid.push((name, number)),
                    }
                }
            }
        }
        Ok(())
    }

    fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.path, field, fault))
    }

    fn get(&self, field: &str) -> Option<&str> {
        self.fields.get(field).map(String::as_str)
    }

    /// True if the header says that the rows of a frame are scan lines.
    fn has_scan_lines(&self) -> bool {
        self.get("UltrasoundImageOrientation").is_some_and(|word| word.starts_with('F'))
    }

    /// The first existing field of several spellings, with its value.
    fn first_of<'n>(&self, names: &[&'n str]) -> Option<(&'n str, &str)> {
        names.iter().find_map(|name| self.get(name).map(|value| (*name, value)))
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
        let mut numbers = Vec::new();
        for (i, word) in words.iter().enumerate() {
            match word.parse::<f64>() {
                Ok(number) if number.is_finite() => numbers.push(number),
                _ => return self.fault(field, format!("{}{} is not a finite number", which(i, count), quoted(word))),
            }
        }
        Ok(numbers)
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
                return header.fault(
                    "MotorType",
                    format!("{} is not read, only TiltingMotor and LinearMotor are", quoted(other)),
                );
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
