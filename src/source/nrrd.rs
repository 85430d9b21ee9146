//! NRRD (`.nrrd`, and `.nhdr` with the samples in another file): lines of `field: value` up to an empty line, then samples that are raw or
//! compressed. Its space becomes LPS in mm.

use super::layout::{Cartesian, Layout, LineOrder, StoredGeometry, extent};
use super::packed::{Encoding, InputFile, Pixels};
use super::pixel::{Number, PixelFormat};
use super::transforms::Poses;
use crate::files::{InputError, quoted};
use crate::probe::{AxisOrder, World};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longest header, bytes and lines.
const MAX_HEADER_BYTES: u64 = 1 << 20;
const MAX_HEADER_LINES: usize = 100_000;
/// Most frames of all volumes.
const MAX_FRAMES: u64 = 1 << 20;

/// The fields that are read. All others are skipped.
const FIELDS: [&str; 18] = [
    "type",
    "dimension",
    "space",
    "space dimension",
    "sizes",
    "space directions",
    "spacings",
    "kinds",
    "space units",
    "units",
    "space origin",
    "encoding",
    "endian",
    "line skip",
    "byte skip",
    "data file",
    "axis mins",
    "centerings",
];
/// Other spellings of fields.
const SPELLINGS: [(&str, &str); 5] = [
    ("datafile", "data file"),
    ("lineskip", "line skip"),
    ("byteskip", "byte skip"),
    ("axismins", "axis mins"),
    ("centers", "centerings"),
];

/// The number types by their names.
const NUMBERS: [(&[&str], Number); 10] = [
    (&["uchar", "unsigned char", "uint8", "uint8_t"], Number::U8),
    (&["signed char", "int8", "int8_t"], Number::I8),
    (&["ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"], Number::U16),
    (&["short", "short int", "signed short", "signed short int", "int16", "int16_t"], Number::I16),
    (&["uint", "unsigned int", "uint32", "uint32_t"], Number::U32),
    (&["int", "signed int", "int32", "int32_t"], Number::I32),
    (&["ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"], Number::U64),
    (
        &["longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"],
        Number::I64,
    ),
    (&["float"], Number::F32),
    (&["double"], Number::F64),
];

/// True if a file begins like this.
pub(super) fn is_one(start: &[u8]) -> bool {
    start.starts_with(b"NRRD000")
}

pub(super) fn read(file: &InputFile) -> Result<Layout, InputError> {
    let header = Header::read(file)?;
    let word = header.need("type")?.to_ascii_lowercase();
    let Some((_, number)) = NUMBERS.iter().find(|(names, _)| names.contains(&&*word)) else {
        return header.fault("type", format!("{} is not read: only numbers of 8 to 64 bits are", quoted(&word)));
    };
    let axes = Axes::of(&header)?;
    let big_endian = match header.get("endian").map(str::to_ascii_lowercase).as_deref() {
        None | Some("little") => false,
        Some("big") => true,
        Some(other) => return header.fault("endian", format!("{} is neither little nor big", quoted(other))),
    };
    let pixel = PixelFormat { number: *number, channels: axes.channels, big_endian, scale: None };
    let [width, height, depth] = axes.size;
    let frames = depth as u64 * axes.volumes as u64;
    if frames > MAX_FRAMES {
        return header.fault("sizes", format!("make {frames} frames, at most {MAX_FRAMES} are read"));
    }
    let world = axes.world(&header)?;
    let states_geometry = header.get("space directions").or(header.get("spacings")).is_some();
    let mut layout = Layout {
        format: "NRRD",
        pixel,
        frame_size: [width, height],
        frames: frames as usize,
        pixels: file.pixels(header.length),
        line_order: LineOrder::InOrder,
        geometry: StoredGeometry::Cartesian(Cartesian {
            size: axes.size,
            volumes: axes.volumes,
            world,
            order: AxisOrder::STORED,
        }),
        backward: false,
        volumes: 1,
        states_geometry,
        poses: Poses::default(),
        times: header.times.range(..frames as usize).map(|(k, t)| (*k, *t)).collect(),
        synthetic: false,
        remarks: Vec::new(),
    };
    find_pixels(file, &header, &mut layout)?;
    layout.check(file.path, "sizes")?;
    Ok(layout)
}

/// What the axes of a file are.
struct Axes {
    channels: usize,
    size: [usize; 3],
    volumes: usize,
    /// Place of the first spatial axis among all.
    first: usize,
    /// Spatial axes, 2 or 3.
    spatial: usize,
}

impl Axes {
    fn of(header: &Header) -> Result<Axes, InputError> {
        let count = match header.need("dimension")?.parse::<usize>() {
            Ok(count @ 2..=5) => count,
            Ok(other) => return header.fault("dimension", format!("is {other}, must be 2 to 5")),
            Err(_) => return header.fault("dimension", "is not a whole number"),
        };
        let words: Vec<&str> = header.need("sizes")?.split_whitespace().collect();
        if words.len() != count {
            return header.fault("sizes", format!("has {} entries, but dimension is {count}", words.len()));
        }
        let mut sizes = Vec::new();
        for word in words {
            let Ok(value) = word.parse() else {
                return header.fault("sizes", format!("{} is not a whole number", quoted(word)));
            };
            sizes.push(extent(header.path, "sizes", "an entry ", value)?);
        }
        let kinds: Vec<String> =
            header.get("kinds").unwrap_or("").split_whitespace().map(str::to_ascii_lowercase).collect();
        let kind = |n: usize| kinds.get(n).map_or("", String::as_str);
        let vectors = header.vectors("space directions")?;
        let is_spatial = |n: usize| vectors.as_ref().is_none_or(|v| v.get(n).is_none_or(Option::is_some));
        let is_colour = |word: &str| word.ends_with("color") || word.ends_with("vector") || word == "list";
        let mut first = 0;
        if (is_colour(kind(0)) || !is_spatial(0)) && count > 2 {
            first = 1;
            if ![1, 3, 4].contains(&sizes[0]) {
                let fault = format!("has {} numbers for each voxel, must be 1, 3 or 4", sizes[0]);
                return header.fault("sizes", fault);
            }
        }
        let mut spatial = count - first;
        // A third axis is time if it says so; "list" alone is what PLUS writes into volumes, too.
        let is_time = |n: usize| kind(n) == "time" || !is_spatial(n) || (kind(n) == "list" && header.sequence);
        let has_time = spatial == 4 || (spatial == 3 && is_time(count - 1));
        if has_time {
            spatial -= 1;
        }
        if !(2..=3).contains(&spatial) {
            return header.fault("dimension", format!("leaves {spatial} axes in space, must leave 2 or 3"));
        }
        let mut size = [1; 3];
        size[..spatial].copy_from_slice(&sizes[first..first + spatial]);
        let volumes = if has_time { sizes[count - 1] } else { 1 };
        let channels = if first == 1 { sizes[0] } else { 1 };
        Ok(Axes { channels, size, volumes, first, spatial })
    }

    fn world(&self, header: &Header) -> Result<World, InputError> {
        let sign = match header.get("space").map(str::to_ascii_lowercase).as_deref() {
            None | Some("left-posterior-superior" | "lps" | "scanner-xyz" | "3d-right-handed") => DVec3::ONE,
            Some("right-anterior-superior" | "ras") => DVec3::new(-1.0, -1.0, 1.0),
            Some("left-anterior-superior" | "las") => DVec3::new(1.0, -1.0, 1.0),
            Some("3d-left-handed") => DVec3::new(1.0, 1.0, -1.0),
            Some(other) => return header.fault("space", format!("{} is not read, only 3D spaces are", quoted(other))),
        };
        let units: Vec<&str> =
            header.get("space units").or(header.get("units")).unwrap_or("").split('"').skip(1).step_by(2).collect();
        let unit = units.iter().rev().find(|word| !word.is_empty());
        let scale = match unit.copied() {
            Some("m") => 1e3,
            Some("cm") => 10.0,
            Some("um" | "\u{b5}m" | "\u{3bc}m") => 1e-3,
            Some("nm") => 1e-6,
            // Others are taken as mm, which nearly all files mean.
            _ => 1.0,
        };
        let mut axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let mut named = "sizes";
        if let Some(vectors) = header.vectors("space directions")? {
            named = "space directions";
            for (axis, vector) in axes.iter_mut().zip(vectors.into_iter().skip(self.first)).take(self.spatial) {
                let Some(vector) = vector else {
                    return header.fault(named, "is none for an axis in space");
                };
                *axis = vector * sign * scale;
            }
            if self.spatial == 2 {
                axes[2] = axes[0].cross(axes[1]).normalize_or_zero();
            }
        } else if let Some(spacings) = header.get("spacings") {
            named = "spacings";
            for (axis, word) in axes.iter_mut().zip(spacings.split_whitespace().skip(self.first)).take(self.spatial) {
                match word.parse::<f64>() {
                    Ok(value) if value > 0.0 && value.is_finite() => *axis *= value * scale,
                    Ok(value) if value.is_nan() => {}
                    _ => return header.fault(named, format!("{} must be above 0", quoted(word))),
                }
            }
        }
        let origin = match header.vectors("space origin")?.as_deref() {
            None => DVec3::ZERO,
            Some([Some(origin)]) => *origin * sign * scale,
            Some(_) => return header.fault("space origin", "is not one vector"),
        };
        World::new(axes, origin).map_err(|why| InputError::new(header.path, named, why))
    }
}

/// Finds the location and the encoding of the samples.
fn find_pixels(file: &InputFile, header: &Header, layout: &mut Layout) -> Result<(), InputError> {
    if let Some(name) = header.get("data file") {
        let name = name.trim_start_matches("./");
        let is_list = name.starts_with("LIST") || name.contains('%');
        if is_list {
            return header.fault("data file", "a list of files is not read, only one file name");
        }
        layout.pixels = match Pixels::beside(file.path, name) {
            Ok(pixels) => pixels,
            Err(fault) => return header.fault("data file", fault),
        };
    }
    let encoding = match header.need("encoding")?.to_ascii_lowercase().as_str() {
        "raw" => Encoding::Raw,
        "gzip" | "gz" => Encoding::Gzip,
        "bzip2" | "bz2" => Encoding::Bzip2,
        other => return header.fault("encoding", format!("{} is not read: raw, gzip and bzip2 are", quoted(other))),
    };
    if header.get("line skip").is_some_and(|lines| lines != "0") {
        return header.fault("line skip", "is not 0: lines before the samples are not skipped");
    }
    let claimed = layout.frame_bytes() * layout.frames as u64;
    let pixels = &mut layout.pixels;
    let is_packed = pixels.is_compressed();
    if encoding != Encoding::Raw {
        if is_packed {
            return header
                .fault("encoding", "is compressed in a .gz file: data that are compressed twice are not read");
        }
        pixels.encoding = encoding;
    }
    let skip = header.get("byte skip").unwrap_or("0");
    match skip.parse::<i64>() {
        Ok(-1) if !pixels.is_compressed() => {
            let end = pixels.offset + pixels.length;
            pixels.offset = end.saturating_sub(claimed).max(pixels.offset);
            pixels.length = end - pixels.offset;
        }
        Ok(bytes @ 0..) if pixels.is_compressed() => pixels.inside = pixels.inside.saturating_add(bytes as u64),
        Ok(bytes @ 0..) => {
            let bytes = (bytes as u64).min(pixels.length);
            (pixels.offset, pixels.length) = (pixels.offset + bytes, pixels.length - bytes);
        }
        _ => return header.fault("byte skip", format!("{} is not possible here", quoted(skip))),
    }
    if !pixels.is_compressed() && pixels.length > claimed {
        layout
            .remarks
            .push(("more data".into(), format!("{} bytes behind the samples; not read", pixels.length - claimed)));
        pixels.length = claimed;
    }
    Ok(())
}

struct Header<'a> {
    path: &'a Path,
    fields: HashMap<&'static str, String>,
    /// Time stamps by frame, s: `Seq_FrameNNNN_Timestamp`.
    times: BTreeMap<usize, f64>,
    /// There are `Seq_` fields: frames in time.
    sequence: bool,
    /// Length up to and including the empty line, bytes.
    length: u64,
}

impl<'a> Header<'a> {
    fn read(file: &InputFile<'a>) -> Result<Header<'a>, InputError> {
        let path = file.path;
        let unreadable = |e| InputError::unreadable(path, &e);
        let mut input = BufReader::new(file.open().map_err(unreadable)?.take(MAX_HEADER_BYTES));
        let mut header = Header { path, fields: HashMap::new(), times: BTreeMap::new(), sequence: false, length: 0 };
        let mut line = Vec::new();
        for number in 1..=MAX_HEADER_LINES {
            line.clear();
            header.length += input.read_until(b'\n', &mut line).map_err(unreadable)? as u64;
            if header.length >= MAX_HEADER_BYTES {
                break;
            }
            let text = String::from_utf8_lossy(&line);
            let text = text.trim();
            // A detached header may end with the file.
            if text.is_empty() {
                let is_detached = header.fields.contains_key("data file");
                return match line.is_empty() && !is_detached {
                    true => header.fault("header", "is cut short: there is no empty line before the samples"),
                    false => Ok(header),
                };
            }
            if number == 1 || text.starts_with('#') {
                continue;
            }
            if let Some((key, value)) = text.split_once(":=") {
                header.value(key.trim(), value.trim());
                continue;
            }
            // The text itself is not quoted: it may contain anything.
            let Some((key, value)) = text.split_once(':') else {
                return Err(InputError::new(path, format!("line {number}"), "is not 'field: value'"));
            };
            let key = key.trim().to_ascii_lowercase();
            let key = SPELLINGS.iter().find(|(other, _)| *other == key).map_or(&*key, |(_, name)| name);
            if let Some(known) = FIELDS.iter().find(|field| **field == key)
                && header.fields.insert(known, value.trim().to_string()).is_some()
            {
                return header.fault(known, "is given twice");
            }
        }
        header.fault("header", "is longer than 1 MiB or 100000 lines")
    }

    /// A key with a value, which programs add: the time stamps of a PLUS sequence are read.
    fn value(&mut self, key: &str, value: &str) {
        let Some(of_frame) = key.strip_prefix("Seq_Frame") else { return };
        self.sequence = true;
        let Some((number, "Timestamp")) = of_frame.split_once('_') else { return };
        if let (Ok(number), Ok(time)) = (number.parse::<usize>(), value.parse::<f64>())
            && time.is_finite()
        {
            self.times.insert(number, time);
        }
    }

    fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.path, field, fault))
    }

    fn get(&self, field: &str) -> Option<&str> {
        self.fields.get(field).map(String::as_str)
    }

    fn need(&self, field: &str) -> Result<&str, InputError> {
        self.get(field).map_or_else(|| self.fault(field, "is missing"), Ok)
    }

    /// Vectors in brackets, or None for `none`; None if the field is absent. A vector of two numbers has a third of 0.
    fn vectors(&self, field: &str) -> Result<Option<Vec<Option<DVec3>>>, InputError> {
        let Some(mut rest) = self.get(field) else { return Ok(None) };
        let mut vectors = Vec::new();
        while !rest.trim_start().is_empty() && vectors.len() < 8 {
            rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix("none") {
                vectors.push(None);
                rest = after;
                continue;
            }
            let Some((inside, after)) = rest.strip_prefix('(').and_then(|text| text.split_once(')')) else {
                return self.fault(field, "is not a list of vectors in brackets");
            };
            let numbers: Vec<f64> = inside.split(',').filter_map(|word| word.trim().parse().ok()).collect();
            let vector = match numbers[..] {
                [x, y] => DVec3::new(x, y, 0.0),
                [x, y, z] => DVec3::new(x, y, z),
                _ => return self.fault(field, format!("{} is not a vector of 2 or 3 numbers", quoted(inside))),
            };
            // Three times nan is how some programs write none.
            vectors.push(Some(vector).filter(|v| !v.is_nan()));
            rest = after;
        }
        Ok(Some(vectors))
    }
}
