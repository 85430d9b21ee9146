//! NRRD (`.nrrd`, and `.nhdr` with the samples in another file): lines of `field: value` up to an empty line, then samples that are raw or
//! compressed. Its space becomes LPS in mm.

mod axes;
mod header;

use super::data_files::{self, Pattern};
use super::layout::{Layout, Remarks, frames};
use super::packed::{Encoding, InputFile, Pixels};
use super::pixel::{Number, PixelFormat};
use super::plus::{PlusWords, spread};
use crate::files::{InputError, quoted};
use crate::probe::World;
use axes::Axes;
use header::{Header, IMAGE_TYPE, ORIENTATION};

pub(super) use header::KEYS;
use std::io::{BufReader, Read};
use std::path::Path;

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

/// True if a file that begins with these bytes is NRRD.
pub(super) fn is_one(start: &[u8]) -> bool {
    start.starts_with(b"NRRD000")
}

pub(super) fn read(file: &InputFile) -> Result<Layout, InputError> {
    let mut header = Header::read(file)?;
    let word = header.need("type")?.to_ascii_lowercase();
    let Some((_, number)) = NUMBERS.iter().find(|(names, _)| names.contains(&&*word)) else {
        return header.fault("type", format!("{} is not read: only numbers of 8 to 64 bits are", quoted(&word)));
    };
    let mut remarks = Vec::new();
    let axes = Axes::of(&header, &mut remarks)?;
    let pixel = PixelFormat::grey(*number);
    let pixel = PixelFormat { channels: axes.channels, big_endian: is_big_endian(&header, pixel.bytes())?, ..pixel };
    let [width, height, depth] = axes.size;
    let frames = frames(file.path, "sizes", "make", depth, axes.volumes)?;
    let world = axes.world(&header, &mut remarks)?;
    let world = of_frames(&header, world, &mut remarks)?;
    let times = match header.frames.times.is_empty() {
        true => axes.times(&header, &mut remarks)?,
        false => spread(&header.frames.times, depth, frames),
    };
    let words = PlusWords {
        path: file.path,
        orientation: (ORIENTATION, header.value(ORIENTATION)),
        kind: (IMAGE_TYPE, header.value(IMAGE_TYPE)),
    };
    let line_order = words.line_order()?;
    let geometry = words.pictures(axes.size, axes.volumes, world, &line_order, &mut remarks)?;
    let is_placed = ["space directions", "spacings", "axis mins"].iter().any(|field| header.has(field));
    let states_geometry = is_placed && !words.has_scan_lines();
    if let Some(orientation) = words.orientation.1 {
        remarks.push(("orientation".into(), quoted(orientation)));
    }
    let poses = header.frames.poses(file.path, depth, &mut remarks);
    let stated = Layout::new("NRRD", pixel, [width, height], frames, file.pixels(header.length), geometry);
    let mut layout = Layout { line_order, states_geometry, poses, times, remarks, ..stated };
    find_pixels(file, &header, &mut layout)?;
    layout.check(file.path, "sizes")?;
    layout.unused = header.unused(&mut layout.remarks)?;
    if let Some(stored) = axes.reorder {
        data_files::reorder(&mut layout, file.path, "sizes", stored)?;
    }
    Ok(layout)
}

/// Label, name and colour (red, green, blue, 0..=1) of each segment of a segmentation, in their order; none if the header states no segments.
///
/// # Errors
/// The file cannot be read, is not NRRD, or states a label that is no number of 8 bits.
pub(super) fn segments(path: &Path) -> Result<Vec<(u8, String, [f64; 3])>, InputError> {
    let file = InputFile::new(path)?;
    if !is_one(&file.start(8)?) {
        return Err(InputError::new(path, "labels", "are not there: it is no segmentation (.seg.nrrd)"));
    }
    let header = Header::read(&file)?;
    let one = |n: usize| {
        let stated = header.of_segment(n, "labelvalue").unwrap_or("1");
        let Ok(label) = stated.parse() else {
            return header
                .fault(&format!("Segment{n}_LabelValue"), format!("{} is not a label of 0..=255", quoted(stated)));
        };
        let numbers = header.of_segment(n, "color").unwrap_or("").split_whitespace().map(str::parse);
        let colour = numbers.collect::<Result<Vec<f64>, _>>().ok().and_then(|numbers| numbers.try_into().ok());
        Ok((label, header.of_segment(n, "name").unwrap_or("").to_string(), colour.unwrap_or([0.5; 3])))
    };
    // The keys of a segment are its identifier and others.
    (0..).take_while(|n| header.of_segment(*n, "id").is_some()).map(one).collect()
}

/// The byte order of numbers of more than a byte must be stated, as Teem and pynrrd demand.
fn is_big_endian(header: &Header, bytes: usize) -> Result<bool, InputError> {
    match header.get("endian").map(str::to_ascii_lowercase).as_deref() {
        None if bytes > 1 => header.fault("endian", format!("is missing: numbers of {bytes} bytes need a byte order")),
        None | Some("little") => Ok(false),
        Some("big") => Ok(true),
        Some(other) => header.fault("endian", format!("{} is neither little nor big", quoted(other))),
    }
}

/// The world with the spacing that the frames of PLUS state, if they do.
fn of_frames(header: &Header, world: World, remarks: &mut Remarks) -> Result<World, InputError> {
    let stated = [0, 1, 2].map(|n| world.axis(n).length());
    let Some(spacing) = header.frames.spacing(header.path, stated, remarks) else { return Ok(world) };
    let axes = [0, 1, 2].map(|n| world.directions().col(n) * spacing[n]);
    World::new(axes, world.origin()).map_err(|why| InputError::new(header.path, "ElementSpacing", why))
}

/// Finds the location and the encoding of the samples.
fn find_pixels(file: &InputFile, header: &Header, layout: &mut Layout) -> Result<(), InputError> {
    let field = "data file";
    let parts = match header.get(field) {
        None => vec![layout.pixels.clone()],
        Some(name) => data_files(file.path, header, name).map_err(|fault| InputError::new(file.path, field, fault))?,
    };
    data_files::divide(file.path, field, parts, layout, |part, bytes| place(header, part, bytes))
}

/// The files that `data file` names: one, those of a list, or `FORMAT FIRST LAST STEP`. The last two may end in the number of axes of a file;
/// in any case each file has as many samples as the others, and no axis but the slowest may be divided.
fn data_files(path: &Path, header: &Header, name: &str) -> Result<Vec<Pixels>, String> {
    let mut words = name.split_whitespace();
    let (names, axes) = if words.next() == Some("LIST") {
        let axes = words.next().map(|word| word.parse::<i64>().map_err(|_| format!("{} is no list", quoted(name))));
        (header.list.clone(), axes.transpose()?)
    } else if name.contains('%') && !data_files::is_there(path, name) {
        let pattern = Pattern::parse(name, 4)?;
        match pattern.numbers[..] {
            [first, last, step] => (pattern.names(first, last, step)?, None),
            [first, last, step, axes] => (pattern.names(first, last, step)?, Some(axes)),
            _ => return Err(format!("{} must have a first and a last number and a step", quoted(name))),
        }
    } else {
        return Ok(vec![data_files::beside(path, name)?]);
    };
    let sizes: Vec<u64> =
        header.get("sizes").unwrap_or("").split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let axes = axes.unwrap_or(sizes.len() as i64 - 1);
    let whole = usize::try_from(axes).ok().filter(|axes| (1..=sizes.len()).contains(axes));
    let Some(whole) = whole else { return Err(format!("states {axes} axes of a file, there are {}", sizes.len())) };
    let count = names.len() as u64;
    // Slabs of the slowest axis, or one file for each place along the slower axes.
    let fits = match sizes.get(whole..) {
        Some([]) | None => count > 0 && sizes.last().is_some_and(|last| last % count == 0),
        Some(slower) => slower.iter().product::<u64>() == count,
    };
    if !fits {
        return Err(format!("names {count} files of {whole} axes, which do not make up the sizes"));
    }
    data_files::all(path, &names)
}

/// Finds `bytes` bytes of samples in one file, behind the lines and bytes that are skipped. Returns how many bytes follow them.
fn place(header: &Header, pixels: &mut Pixels, bytes: u64) -> Result<u64, InputError> {
    let encoding = match header.need("encoding")?.to_ascii_lowercase().as_str() {
        "raw" => Encoding::Raw,
        "gzip" | "gz" => Encoding::Gzip,
        "bzip2" | "bz2" => Encoding::Bzip2,
        other => return header.fault("encoding", format!("{} is not read: raw, gzip and bzip2 are", quoted(other))),
    };
    // Lines are skipped before anything is decompressed, bytes after that.
    skip_lines(header, pixels)?;
    if encoding != Encoding::Raw {
        if pixels.is_compressed() {
            return header
                .fault("encoding", "is compressed in a .gz file: data that are compressed twice are not read");
        }
        pixels.encoding = encoding;
    }
    let skip = header.get("byte skip").unwrap_or("0");
    match skip.parse::<i64>() {
        Ok(-1) if !pixels.is_compressed() => {
            let end = pixels.offset + pixels.length;
            pixels.offset = end.saturating_sub(bytes).max(pixels.offset);
            pixels.length = end - pixels.offset;
        }
        Ok(skip @ 0..) => pixels.leave_out(skip as u64),
        _ => return header.fault("byte skip", format!("{} is not possible here", quoted(skip))),
    }
    if pixels.is_compressed() || pixels.length <= bytes {
        return Ok(0);
    }
    let more = pixels.length - bytes;
    pixels.length = bytes;
    Ok(more)
}

/// Moves behind as many lines as `line skip` says, of any length.
fn skip_lines(header: &Header, pixels: &mut Pixels) -> Result<(), InputError> {
    let Some(stated) = header.get("line skip") else { return Ok(()) };
    let Ok(lines) = stated.parse::<u64>() else {
        return header.fault("line skip", format!("{} is not a number of lines", quoted(stated)));
    };
    if lines == 0 {
        return Ok(());
    }
    let unreadable = |e: std::io::Error| InputError::unreadable(&pixels.path, &e);
    let (mut skipped, mut there) = (0, 0);
    // No line is kept: without an end it is as long as the file.
    for byte in BufReader::new(pixels.open(0).map_err(unreadable)?).bytes() {
        skipped += 1;
        there += u64::from(byte.map_err(unreadable)? == b'\n');
        if there == lines {
            pixels.leave_out(skipped);
            return Ok(());
        }
    }
    header.fault("line skip", format!("is {lines}, but {there} lines are there"))
}
