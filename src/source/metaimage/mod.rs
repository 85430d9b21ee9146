//! MetaImage (`.mha`, `.mhd`): plain volumes, the sequences of the PLUS toolkit, and UsTK's pre-scan sweeps.

mod header;
mod prescan;

use super::contents::{Contents, Lines, Own, extent};
use super::error::quoted;
use super::pixels::Pixels;
use super::{InputError, SampleType};
use crate::probe::Grid;
use header::{Header, which};
use std::fs;
use std::path::Path;

pub(super) fn read(path: &Path) -> Result<Contents, InputError> {
    let header = Header::read(path)?;
    if let Some(other) = header.get("ObjectType").filter(|t| *t != "Image") {
        return header.fault("ObjectType", format!("{} is not read, only Image is", quoted(other)));
    }
    if header.integer("ElementNumberOfChannels")?.is_some_and(|n| n != 1) {
        return header.fault("ElementNumberOfChannels", "must be 1: colour is not read");
    }
    let sample = match header.need("ElementType")? {
        "MET_UCHAR" => SampleType::U8,
        "MET_USHORT" => SampleType::U16,
        "MET_SHORT" => SampleType::I16,
        "MET_FLOAT" => SampleType::F32,
        other => {
            let read = "MET_UCHAR, MET_USHORT, MET_SHORT and MET_FLOAT are";
            return header.fault("ElementType", format!("{} is not read, only {read}", quoted(other)));
        }
    };
    let [width, height, frames] = dimensions(path, &header)?;
    let mut facts = Vec::new();
    let grid = lattice(&header, [width, height, frames], &mut facts)?;
    let lines = line_order(&header)?;
    let pre_scan = prescan::probe(&header, [width, height], frames)?;
    let format = match &pre_scan {
        Some(_) => "MetaImage pre-scan sweep",
        None if header.sequence || header.get("UltrasoundImageType").is_some() => "PLUS sequence",
        None => "MetaImage",
    };
    let own = match pre_scan {
        Some(probe) => Own::Sweep(Box::new(probe)),
        None => own_pictures(path, &header, grid, &lines)?,
    };
    if let Some(orientation) = header.get("UltrasoundImageOrientation") {
        facts.push(("orientation".into(), quoted(orientation)));
    }
    if header.not_ok > 0 {
        facts.push(("frames not OK".into(), format!("{} by their ImageStatus; read all the same", header.not_ok)));
    }
    let mut contents = Contents {
        format,
        sample,
        big_endian: header.flag("BinaryDataByteOrderMSB")?.or(header.flag("ElementByteOrderMSB")?).unwrap_or(false),
        frame_size: [width, height],
        frames,
        pixels: Pixels { path: path.into(), offset: header.length, length: 0, compressed: false },
        lines,
        own,
        times: header.times.range(..frames).map(|(k, t)| (*k, *t)).collect(),
        facts,
    };
    find_pixels(path, &header, &mut contents)?;
    contents.check(path, "DimSize")?;
    Ok(contents)
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

/// The lattice of the voxels. A rotation in space is not applied: the volume is shown as it lies in the file.
fn lattice(header: &Header, size: [usize; 3], facts: &mut Vec<(String, String)>) -> Result<Grid, InputError> {
    let count = if header.get("NDims") == Some("2") { 2 } else { 3 };
    let mut grid = Grid { size, spacing: [1.0; 3], origin: [0.0; 3] };
    if let Some((field, _)) = header.first_of(&["ElementSpacing", "ElementSize"]) {
        for (i, value) in header.numbers(field, count)?.into_iter().enumerate() {
            if value <= 0.0 {
                return header.fault(field, format!("{}is {value}, must be above 0", which(i, count)));
            }
            grid.spacing[i] = value;
        }
    }
    if let Some((field, _)) = header.first_of(&["Offset", "Position", "Origin"]) {
        grid.origin[..count].copy_from_slice(&header.numbers(field, count)?);
    }
    if let Some((field, _)) = header.first_of(&["TransformMatrix", "Rotation", "Orientation"]) {
        let matrix = header.numbers(field, count * count)?;
        let identity = |i: usize| if i.is_multiple_of(count + 1) { 1.0 } else { 0.0 };
        if matrix.iter().enumerate().any(|(i, v)| (v - identity(i)).abs() > 1e-9) {
            facts.push(("rotation".into(), format!("{field} is not the identity; not applied")));
        }
    }
    Ok(grid)
}

/// PLUS names the axes of a frame by the way they run on the transducer: the first letter is the fastest. F is far from it,
/// so FM is scan lines in order, FU scan lines from the last to the first; M and U first are rows of pictures.
fn line_order(header: &Header) -> Result<Lines, InputError> {
    match header.get("UltrasoundImageOrientation") {
        None | Some("FM" | "FMA") => Ok(Lines::InOrder),
        Some("FU" | "FUA") => Ok(Lines::Reversed),
        Some(word) if word.starts_with(['M', 'U']) => Ok(Lines::Pictures(quoted(word))),
        Some(other) => header.fault(
            "UltrasoundImageOrientation",
            format!("{} is not read: scan lines must be FM or FU, pictures begin with M or U", quoted(other)),
        ),
    }
}

/// A file without pre-scan keys holds pictures, unless it says that its frames are scan lines.
fn own_pictures(path: &Path, header: &Header, mut grid: Grid, lines: &Lines) -> Result<Own, InputError> {
    match (header.get("UltrasoundImageType"), lines) {
        (None | Some("US_IMG_TYPE_XX"), _) | (Some("BRIGHTNESS"), Lines::Pictures(_)) => {}
        (Some(converted), _) if converted.starts_with("POSTSCAN") => {}
        (Some("BRIGHTNESS"), _) => {
            let fault = "BRIGHTNESS frames of scan lines need a probe geometry: give --probe FILE.toml, or put a \
                         probe.toml beside the recording";
            return Ok(Own::Missing(InputError::new(path, "UltrasoundImageType", fault)));
        }
        (Some(other), _) => {
            let fault = format!("{} is not read: only BRIGHTNESS is detected and compressed", quoted(other));
            return header.fault("UltrasoundImageType", fault);
        }
    }
    // Frames in time are no neighbours in space: each is a volume of one slice.
    let in_time = header.sequence || header.get("Kinds").is_some_and(|k| k.split_whitespace().nth(2) == Some("list"));
    let volumes = if in_time { std::mem::replace(&mut grid.size[2], 1) } else { 1 };
    Ok(Own::Pictures(grid, volumes))
}

/// Finds where the samples lie, and how many bytes of them there are.
fn find_pixels(path: &Path, header: &Header, contents: &mut Contents) -> Result<(), InputError> {
    let name = header.need("ElementDataFile")?;
    let pixels = &mut contents.pixels;
    if name != "LOCAL" {
        let plain = Path::new(name).file_name().is_some_and(|n| n == name) && !name.contains('\\');
        if name.starts_with("LIST") || name.contains('%') {
            return header.fault("ElementDataFile", "a list of files is not read, only LOCAL or one file name");
        }
        if !plain {
            let fault = format!("{} must be LOCAL or the name of a file in the same folder", quoted(name));
            return header.fault("ElementDataFile", fault);
        }
        pixels.path = path.with_file_name(name);
        pixels.offset = 0;
    }
    let metadata = match fs::metadata(&pixels.path) {
        Ok(metadata) if metadata.is_file() => metadata,
        Ok(_) => return header.fault("ElementDataFile", format!("{} is not a regular file", quoted(name))),
        Err(error) => return header.fault("ElementDataFile", format!("{} cannot be read: {error}", quoted(name))),
    };
    pixels.compressed = header.flag("CompressedData")?.unwrap_or(false);
    if !pixels.compressed && header.flag("BinaryData")? == Some(false) {
        return header.fault("BinaryData", "numbers written as text are not read");
    }
    let claimed = contents.frame_bytes() * contents.frames as u64;
    let pixels = &mut contents.pixels;
    match header.integer("HeaderSize")? {
        None | Some(0) => {}
        Some(bytes @ 1..) => pixels.offset = bytes as u64,
        // MetaIO's way to say that the samples are the last bytes of the file.
        Some(-1) if !pixels.compressed => {
            pixels.offset = metadata.len().saturating_sub(claimed).max(pixels.offset);
        }
        Some(other) => return header.fault("HeaderSize", format!("{other} is not possible here")),
    }
    pixels.length = metadata.len().saturating_sub(pixels.offset);
    let known = match (pixels.compressed, header.integer("CompressedDataSize")?) {
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
        contents.facts.push(("more data".into(), more));
        pixels.length = known;
    }
    Ok(())
}
