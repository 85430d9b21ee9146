//! The files that hold the samples of a recording, as headers name them: one file, a list, or numbered files. Also samples whose axes are
//! stored in another order than frames have.

use super::gathered::Gathered;
use super::layout::Layout;
use super::packed::{Encoding, PixelStream, Pixels};
use crate::files::{InputError, quoted};
use std::fs;
use std::io::{self, Cursor, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Most files of a recording.
const MAX_FILES: u64 = 65_536;
/// Most bytes that are put in another order, in memory.
const MAX_REORDERED_BYTES: u64 = 1 << 31;
/// Most digits of the number of a file.
const MAX_DIGITS: usize = 20;

/// Locates the samples in a data file that a header names: the whole file. It must lie in the folder of the header or below it.
///
/// # Errors
/// What is wrong with the name or with the file.
pub(super) fn beside(header: &Path, name: &str) -> Result<Pixels, String> {
    let path = below(header, name)?;
    match fs::metadata(&path) {
        Ok(metadata) if metadata.is_file() => {
            Ok(Pixels { path, offset: 0, length: metadata.len(), encoding: Encoding::Raw, inside: 0, gathered: None })
        }
        Ok(_) => Err(format!("{} is not a regular file", quoted(name))),
        Err(error) => Err(format!("{} cannot be read: {error}", quoted(name))),
    }
}

/// True if a file of exactly this name exists beside the header: a name may look like a pattern or a list.
pub(super) fn is_there(header: &Path, name: &str) -> bool {
    below(header, name).is_ok_and(|path| path.is_file())
}

/// The path of a file in the folder of a header or below it. Programs for Windows write `\` between folders.
fn below(header: &Path, name: &str) -> Result<PathBuf, String> {
    let folder = header.parent().unwrap_or(Path::new(""));
    let stated = folder.join(name);
    let slashed = name.replace('\\', "/");
    let is_below = |name: &str| {
        let is_plain = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
        Path::new(name).file_name().is_some() && Path::new(name).components().all(is_plain)
    };
    if !is_below(name) || !is_below(&slashed) {
        return Err(format!("{} must be the name of a file in the same folder or below it", quoted(name)));
    }
    Ok(if stated.exists() { stated } else { folder.join(slashed) })
}

/// A printf pattern of file names, such as `slice%03d.raw`, and the whole numbers that follow it in a header.
pub(super) struct Pattern {
    before: String,
    after: String,
    /// Least number of characters, and of digits.
    width: usize,
    digits: usize,
    /// The whole numbers that follow the pattern in the header, in their order: first file number, last one and step, as far as stated. What more
    /// follows depends on the format.
    pub numbers: Vec<i64>,
}

impl Pattern {
    /// Parses a pattern and at most `most` whole numbers after it. The pattern may contain spaces.
    ///
    /// # Errors
    /// What is wrong with a text that is no pattern with exactly one number.
    pub(super) fn parse(text: &str, most: usize) -> Result<Pattern, String> {
        let mut format = text.trim();
        let mut numbers = Vec::new();
        while let Some((rest, word)) = format.rsplit_once(char::is_whitespace)
            && let Ok(number) = word.parse()
            && numbers.len() < most
        {
            numbers.insert(0, number);
            format = rest.trim_end();
        }
        let wrong = || format!("{} is no pattern of file names with one %d", quoted(format));
        let (mut before, mut after, mut form) = (String::new(), String::new(), None);
        let mut rest = format;
        while let Some((text, behind)) = rest.split_once('%') {
            let part = if form.is_none() { &mut before } else { &mut after };
            part.push_str(text);
            if let Some(behind) = behind.strip_prefix('%') {
                part.push('%');
                rest = behind;
                continue;
            }
            let at = behind.find(['d', 'i', 'u']).ok_or_else(wrong)?;
            if form.replace(conversion(&behind[..at]).ok_or_else(wrong)?).is_some() {
                return Err(wrong());
            }
            rest = &behind[at + 1..];
        }
        let (width, digits) = form.ok_or_else(wrong)?;
        after.push_str(rest);
        Ok(Pattern { before, after, width, digits, numbers })
    }

    fn name(&self, number: i64) -> String {
        let sign = if number < 0 { "-" } else { "" };
        let digits = self.digits.saturating_sub(if self.digits == self.width { sign.len() } else { 0 });
        let text = format!("{sign}{:0digits$}", number.unsigned_abs());
        format!("{}{text:>width$}{}", self.before, self.after, width = self.width)
    }

    /// The file names for the numbers `first`, `first + step` ... up to and including `last`, if it is one of them.
    ///
    /// # Errors
    /// In words: the step is 0 or leads away from `last`, or there are too many files.
    pub(super) fn names(&self, first: i64, last: i64, step: i64) -> Result<Vec<String>, String> {
        let span = i128::from(last) - i128::from(first);
        if step == 0 || span.signum() * i128::from(step.signum()) < 0 {
            return Err(format!("does not lead from {first} to {last} by steps of {step}"));
        }
        let count = span / i128::from(step) + 1;
        if count > i128::from(MAX_FILES) {
            return Err(format!("names {count} files, at most {MAX_FILES} are read"));
        }
        // Within first..=last, so that nothing overflows.
        Ok((0..count as i64).map(|n| self.name(first + n * step)).collect())
    }
}

/// Width and digits of a conversion, what stands between `%` and `d`: `03`, `.3`, `3` or nothing.
fn conversion(form: &str) -> Option<(usize, usize)> {
    let number = |text: &str| if text.is_empty() { Some(0) } else { text.parse::<usize>().ok() };
    let (width, digits) = match form.split_once('.') {
        Some((width, digits)) => (number(width)?, number(digits)?),
        None if form.starts_with('0') => (number(form)?, number(form)?),
        None => (number(form)?, 0),
    };
    (width <= MAX_DIGITS && digits <= MAX_DIGITS && !form.starts_with(['+', '-'])).then_some((width, digits))
}

/// Locates the samples in each file of a list: whole files in the folder of the header or below it.
///
/// # Errors
/// No file, too many of them, or what is wrong with a name or with a file.
pub(super) fn all(header: &Path, names: &[String]) -> Result<Vec<Pixels>, String> {
    match names.len() as u64 {
        0 => Err("names no file".into()),
        1..=MAX_FILES => names.iter().map(|name| beside(header, name)).collect(),
        count => Err(format!("names {count} files, at most {MAX_FILES} are read")),
    }
}

/// Makes `layout` read its samples from several files with the same share of them each. `place` locates the samples in a file, given their
/// number of bytes, and returns how many bytes of the file follow them.
///
/// # Errors
/// The samples cannot be divided evenly among the files, or `place` or [`joined`] fails.
pub(super) fn divide(
    header: &Path,
    field: &str,
    mut parts: Vec<Pixels>,
    layout: &mut Layout,
    place: impl Fn(&mut Pixels, u64) -> Result<u64, InputError>,
) -> Result<(), InputError> {
    let claimed = layout.frame_bytes() * layout.frames as u64;
    let count = parts.len().max(1) as u64;
    if !claimed.is_multiple_of(count) {
        let fault = format!("names {count} files, which cannot share {claimed} bytes evenly");
        return Err(InputError::new(header, field, fault));
    }
    let mut more = 0;
    for part in &mut parts {
        more += place(part, claimed / count)?;
    }
    if more > 0 {
        layout.remarks.push(("more data".into(), format!("{more} bytes behind the samples; not read")));
    }
    layout.pixels = joined(header, parts, claimed / count)?;
    Ok(())
}

/// Samples of several files, one after another; of one file, these.
///
/// # Errors
/// A file that cannot hold its share of the samples.
fn joined(header: &Path, mut parts: Vec<Pixels>, part_bytes: u64) -> Result<Pixels, InputError> {
    if parts.len() == 1
        && let Some(only) = parts.pop()
    {
        return Ok(only);
    }
    for part in &parts {
        if part.most_bytes() < part_bytes {
            let fault = format!("cut short, {} bytes cannot hold {part_bytes} bytes of samples", part.length);
            return Err(InputError::new(&part.path, "data", fault));
        }
    }
    let length = parts.iter().fold(0, |sum: u64, part| sum.saturating_add(part.length));
    let encoding = parts.first().map_or(Encoding::Raw, |part| part.encoding);
    Ok(Pixels::gathered(header, encoding, length, Parts { parts: parts.into(), part_bytes }))
}

/// Files with the same number of bytes of samples each.
struct Parts {
    parts: Arc<[Pixels]>,
    part_bytes: u64,
}

impl Gathered for Parts {
    fn open(self: Arc<Self>, skip: u64) -> io::Result<Box<dyn Read + Send>> {
        let part_bytes = self.part_bytes.max(1);
        let (parts, next) = (self.parts.clone(), (skip / part_bytes) as usize);
        Ok(Box::new(PartStream { parts, part_bytes, next, inside: skip % part_bytes, now: None }))
    }

    fn files(&self) -> Vec<PathBuf> {
        self.parts.iter().map(|part| part.path.clone()).collect()
    }
}

/// The samples of several files as a stream.
struct PartStream {
    parts: Arc<[Pixels]>,
    part_bytes: u64,
    next: usize,
    /// Bytes of the next file that are skipped.
    inside: u64,
    /// The open file, and the bytes of it that are left.
    now: Option<(PixelStream, u64)>,
}

impl Read for PartStream {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while !out.is_empty() {
            let Some((mut stream, left)) = self.now.take() else {
                let Some(part) = self.parts.get(self.next) else { return Ok(0) };
                self.now = Some((part.open(self.inside)?, self.part_bytes - self.inside));
                (self.next, self.inside) = (self.next + 1, 0);
                continue;
            };
            if left == 0 {
                // Where the checksum of a compressed file is.
                stream.finish()?;
                continue;
            }
            let got = stream.by_ref().take(left).read(out)?;
            if got == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            self.now = Some((stream, left - got as u64));
            return Ok(got);
        }
        Ok(0)
    }
}

/// How the axes of a file are stored, if not in the order of frames.
pub(super) struct StoredOrder {
    /// Number of samples along each stored axis, fastest first.
    pub sizes: Vec<usize>,
    /// Indices of the stored axes in the order that frames need, fastest first.
    pub order: Vec<usize>,
}

/// Makes `layout` bring its samples into the order of frames when they are read.
///
/// # Errors
/// There are more than 2 GiB of samples.
pub(super) fn reorder(layout: &mut Layout, header: &Path, field: &str, stored: StoredOrder) -> Result<(), InputError> {
    let bytes = layout.frame_bytes().saturating_mul(layout.frames as u64);
    if bytes > MAX_REORDERED_BYTES {
        let fault = format!("the order of axes needs {bytes} bytes in memory, at most 2 GiB are put in another order");
        return Err(InputError::new(header, field, fault));
    }
    let sample = layout.pixel.bytes() / layout.pixel.channels.max(1);
    let inner = layout.pixels.clone();
    let (length, encoding, path) = (inner.length, inner.encoding, inner.path.clone());
    let reordered = Reordered { inner, stored, sample, bytes, all: OnceLock::new() };
    layout.pixels = Pixels::gathered(&path, encoding, length, reordered);
    Ok(())
}

struct Reordered {
    inner: Pixels,
    stored: StoredOrder,
    /// Bytes of a number, and of all.
    sample: usize,
    bytes: u64,
    /// All samples in the order of frames, once they were read.
    all: OnceLock<Arc<[u8]>>,
}

impl Gathered for Reordered {
    fn open(self: Arc<Self>, skip: u64) -> io::Result<Box<dyn Read + Send>> {
        let all = match self.all.get() {
            Some(all) => all.clone(),
            None => {
                let all = self.read()?;
                self.all.get_or_init(|| all).clone()
            }
        };
        let mut stream = Cursor::new(all);
        stream.set_position(skip);
        Ok(Box::new(stream))
    }

    fn files(&self) -> Vec<PathBuf> {
        self.inner.files()
    }
}

impl Reordered {
    fn read(&self) -> io::Result<Arc<[u8]>> {
        let mut stream = self.inner.open(0)?;
        let mut stored = Vec::new();
        stream.fill_whole(self.bytes, &mut stored)?;
        let more = stream.finish()?;
        if more > 0 {
            tracing::warn!(bytes = more, "more samples than the sizes of the header; not read");
        }
        Ok(self.stored.apply(&stored, self.sample).into())
    }
}

impl StoredOrder {
    /// Numbers of `width` bytes in the order of frames.
    fn apply(&self, stored: &[u8], width: usize) -> Vec<u8> {
        let mut stride = width;
        let mut strides = Vec::new();
        for size in &self.sizes {
            strides.push(stride);
            stride *= size;
        }
        let axes: Vec<(usize, usize)> = self.order.iter().map(|n| (self.sizes[*n], strides[*n])).collect();
        let mut out = Vec::with_capacity(stored.len());
        copy(stored, width, &axes, 0, &mut out);
        out
    }
}

/// Appends all numbers from a place on. `axes`: size and stride of each, fastest first.
fn copy(stored: &[u8], width: usize, axes: &[(usize, usize)], at: usize, out: &mut Vec<u8>) {
    match axes {
        [] => out.extend_from_slice(stored.get(at..at + width).unwrap_or_default()),
        [(size, stride)] => {
            (0..*size).for_each(|n| {
                out.extend_from_slice(stored.get(at + n * stride..at + n * stride + width).unwrap_or_default());
            });
        }
        [rest @ .., (size, stride)] => (0..*size).for_each(|n| copy(stored, width, rest, at + n * stride, out)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str, [first, last, step]: [i64; 3]) -> Vec<String> {
        Pattern::parse(text, 3).unwrap().names(first, last, step).unwrap()
    }

    #[test]
    fn patterns_are_those_of_printf() {
        assert_eq!(names("a%d.raw", [9, 11, 1]), ["a9.raw", "a10.raw", "a11.raw"]);
        assert_eq!(names("a %03d.raw", [7, 3, -2]), ["a 007.raw", "a 005.raw", "a 003.raw"]);
        assert_eq!(names("50%%_%.2i", [1, 2, 1]), ["50%_01", "50%_02"]);
        assert_eq!(names("%3u", [8, 10, 2]), ["  8", " 10"]);
        assert_eq!(names("%04d", [-5, -5, 1]), ["-005"]);
        let parsed = Pattern::parse("my 5 slices %d.raw 1 9 2", 3).unwrap();
        assert_eq!((parsed.before.as_str(), &parsed.numbers[..]), ("my 5 slices ", &[1, 9, 2][..]));
        for wrong in ["a.raw 1 2 1", "%d%d", "%s.raw", "%-3d", "%99d", "100%", "%ld"] {
            assert!(Pattern::parse(wrong, 3).is_err(), "{wrong}");
        }
        let one = Pattern::parse("%d", 3).unwrap();
        for [first, last, step] in [[1, 5, 0], [1, 5, -1], [5, 1, 1], [i64::MIN, i64::MAX, 1]] {
            assert!(one.names(first, last, step).is_err());
        }
    }

    #[test]
    fn names_lead_nowhere_else() {
        let header = Path::new("/folder/a.nhdr");
        for name in ["d.raw", "./d.raw", "sub/d.raw", "sub\\d.raw", "50 % .raw"] {
            assert!(below(header, name).unwrap().starts_with("/folder"), "{name}");
        }
        for name in ["../d.raw", "/etc/passwd", "sub/../../d.raw", "..\\d.raw", "", ".", ".."] {
            assert!(below(header, name).is_err(), "{name}");
        }
    }

    #[test]
    fn axes_are_put_in_order() {
        // Sizes 2 (time), 3, 2; wanted 3, 2, time.
        let stored = StoredOrder { sizes: vec![2, 3, 2], order: vec![1, 2, 0] };
        assert_eq!(stored.apply(&(0..12).collect::<Vec<u8>>(), 1), [0, 2, 4, 6, 8, 10, 1, 3, 5, 7, 9, 11]);
        let stored = StoredOrder { sizes: vec![2, 2], order: vec![1, 0] };
        assert_eq!(stored.apply(&[0, 1, 2, 3, 4, 5, 6, 7], 2), [0, 1, 4, 5, 2, 3, 6, 7]);
    }
}
