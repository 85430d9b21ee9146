//! Palettes (PS3.3 C.7.6.3.1.5, C.7.6.3.1.6 and C.7.9.2): the luminance of the colour that a stored number stands for.

use super::super::pixel::LUMINANCE;
use std::sync::Arc;

/// A colour palette, reduced to the luminance of each entry, and how the pixels that index it are stored.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Palette {
    /// At least one.
    greys: Arc<[u8]>,
    /// The number of the first entry. Lower ones mean the first, those beyond the last mean the last.
    first: i32,
    pub numbers: Indices,
}

/// The DICOM elements of a palette, each for red, green and blue.
pub(super) struct Tables {
    /// Descriptor of each colour's table: number of entries (0 for 65536), pixel value of the first entry, bits of an entry.
    pub about: [Vec<u16>; 3],
    /// The entries of each colour one after another; empty if they are given in `segmented` form.
    pub plain: [Vec<u16>; 3],
    pub segmented: [Vec<u16>; 3],
}

/// How the pixels that index a palette are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Indices {
    /// Bytes of one index, 1 or 2.
    pub width: usize,
    /// Number of its lowest bits that count; the others are ignored.
    pub bits: u32,
    pub signed: bool,
    pub big_endian: bool,
}

impl Indices {
    fn number(&self, bytes: &[u8]) -> i32 {
        let number = match *bytes {
            [a] => u32::from(a),
            [a, b] if self.big_endian => u32::from(u16::from_be_bytes([a, b])),
            [a, b] => u32::from(u16::from_le_bytes([a, b])),
            _ => 0,
        };
        let shift = 32 - self.bits.clamp(1, 16);
        match self.signed {
            true => (number << shift).cast_signed() >> shift,
            false => ((number << shift) >> shift).cast_signed(),
        }
    }
}

impl Palette {
    /// Makes the palette of a picture. The second result has a warning for each statement of the file that is wrong.
    ///
    /// # Errors
    /// One line: the palette is missing, cut short, contradicts itself or has a form that is not read.
    pub fn of(tables: &Tables, numbers: Indices) -> Result<(Palette, Vec<String>), String> {
        let Tables { about, plain, segmented } = tables;
        let [count, first, bits] = about[0][..] else { return Err("is missing, or has not three numbers".into()) };
        if about[1..].iter().any(|other| *other != about[0]) {
            return Err("differs from that of green or blue".into());
        }
        // 0 stands for 65536.
        let count = if count == 0 { 65536 } else { usize::from(count) };
        let first = if numbers.signed { i32::from(first.cast_signed()) } else { i32::from(first) };
        let mut warnings = Vec::new();
        let mut colours = Vec::new();
        for (plain, segmented) in plain.iter().zip(segmented) {
            let entries = match plain.is_empty() && !segmented.is_empty() {
                true => expanded(segmented, bits)?,
                false => plain_entries(plain, count, bits, &mut warnings)?,
            };
            if entries.len() < count {
                return Err(format!("is not whole: {} of {count} entries are there", entries.len()));
            }
            if entries.len() > count {
                let text = format!("palette has {} entries, more than the {count} of (0028,1101)", entries.len());
                warnings.push(format!("{text}; the rest is not read"));
            }
            colours.push(entries);
        }
        warnings.dedup();
        let mut greys = vec![0.0; count];
        for (entries, share) in colours.iter().zip(LUMINANCE) {
            greys.iter_mut().zip(entries).for_each(|(grey, entry)| *grey += share * entry);
        }
        let greys = greys.iter().map(|grey: &f64| grey.round() as u8).collect();
        Ok((Palette { greys, first, numbers }, warnings))
    }

    /// The luminance, 0..=255, of each pixel. `numbers`: bytes of the stored indices.
    pub(crate) fn greys(&self, numbers: &[u8]) -> Vec<u8> {
        let last = self.greys.len() as i32 - 1;
        let grey = |bytes| {
            let at = (self.numbers.number(bytes) - self.first).clamp(0, last.max(0));
            self.greys.get(at as usize).copied().unwrap_or(0)
        };
        numbers.chunks_exact(self.numbers.width.max(1)).map(grey).collect()
    }
}

/// Entries as shares of the largest one that so many bits hold, 0 .. 255.
///
/// # Errors
/// One line: entries of a width that is not read.
fn shares(entries: impl Iterator<Item = u16>, bits: u16) -> Result<Vec<f64>, String> {
    match bits {
        8..=16 => {
            let most = f64::from(bits).exp2() - 1.0;
            Ok(entries.map(|entry| (f64::from(entry) * 255.0 / most).min(255.0)).collect())
        }
        _ => Err(format!("states entries of {bits} bits; 8 to 16 are read")),
    }
}

/// The entries of a table: words, or bytes that are packed two in a word, the first one in the low half.
fn plain_entries(words: &[u16], count: usize, bits: u16, warnings: &mut Vec<String>) -> Result<Vec<f64>, String> {
    // Behind an odd number of bytes there is one that makes the length even.
    let bytes = || words.iter().flat_map(|word| word.to_le_bytes()).map(u16::from).take(count);
    let is_packed = words.len() == count.div_ceil(2) && count > 1;
    match bits {
        8 if is_packed => shares(bytes(), 8),
        8 if words.iter().any(|word| *word > 255) => Err("states entries of 8 bits, but has larger ones".into()),
        9..=16 if is_packed => {
            let text = format!("palette (0028,1101) states entries of {bits} bits, but has one byte for each");
            warnings.push(format!("{text}; read as 8 bits"));
            shares(bytes(), 8)
        }
        _ => shares(words.iter().copied(), bits),
    }
}

/// Most entries of a palette.
const MOST: usize = 65536;

/// The entries of a segmented table. Its numbers are bytes where entries have 8 bits, otherwise words.
///
/// # Errors
/// One line: a segment that is cut short or not known.
fn expanded(words: &[u16], bits: u16) -> Result<Vec<f64>, String> {
    let (numbers, width): (Vec<u16>, usize) = match bits {
        8 => (words.iter().flat_map(|word| word.to_le_bytes()).map(u16::from).collect(), 1),
        _ => (words.to_vec(), 2),
    };
    let mut segments = Segments { numbers: &numbers, width, entries: Vec::new() };
    let mut at = 0;
    // Behind the last segment there may be one byte that makes the length even, but no word.
    let padding = 2 - width;
    while at + padding < numbers.len() {
        at = segments.segment(at, true)?;
    }
    shares(segments.entries.into_iter(), bits)
}

struct Segments<'a> {
    numbers: &'a [u16],
    /// Bytes of a number.
    width: usize,
    entries: Vec<u16>,
}

impl<'a> Segments<'a> {
    fn get(&self, at: usize, count: usize) -> Result<&'a [u16], String> {
        let there = at.checked_add(count).and_then(|end| self.numbers.get(at..end));
        there.ok_or_else(|| "has a segment that is cut short".to_string())
    }

    /// Adds the entries of the segment at `at`. Returns where the next one is.
    fn segment(&mut self, at: usize, may_point: bool) -> Result<usize, String> {
        let [kind, length] = *self.get(at, 2)? else { return Err("has no segment".into()) };
        let (count, at) = (usize::from(length), at + 2);
        if count == 0 {
            return Err("has a segment of no entries".into());
        }
        let next = match kind {
            0 => {
                self.entries.extend(self.get(at, count)?);
                at + count
            }
            // On a straight line from the last entry, without it, up to the number.
            1 => {
                let end = f64::from(self.get(at, 1)?[0]);
                let begin = self.entries.last().copied().map(f64::from).ok_or("begins with a linear segment")?;
                let step = (end - begin) / count as f64;
                self.entries.extend((1..=count).map(|n| (begin + step * n as f64).round_ties_even() as u16));
                at + 1
            }
            2 if may_point => {
                // Four bytes, the lowest first.
                let parts = self.get(at, 4 / self.width)?;
                let shift = 8 * self.width;
                let offset = parts.iter().rev().fold(0, |all, part| all << shift | usize::from(*part));
                if !offset.is_multiple_of(self.width) {
                    return Err(format!("has a segment that points to byte {offset}, where none begins"));
                }
                let after = at + parts.len();
                let mut there = offset / self.width;
                for _ in 0..count {
                    there = self.segment(there, false)?;
                }
                after
            }
            2 => return Err("has an indirect segment that points to another one".into()),
            other => return Err(format!("has a segment of type {other}; 0, 1 and 2 are known")),
        };
        match self.entries.len() > MOST {
            true => Err(format!("has more than {MOST} entries")),
            false => Ok(next),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packed(bytes: &[u8]) -> Vec<u16> {
        bytes.chunks(2).map(|pair| u16::from_le_bytes([pair[0], pair.get(1).copied().unwrap_or(0)])).collect()
    }

    #[test]
    fn segments_are_expanded() {
        // Two entries, a line of 4, and both again; then the line alone from its last entry on.
        let words = [0, 2, 0, 257, 1, 4, 5 * 257, 2, 2, 0, 0, 2, 1, 8, 0];
        let once = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!(expanded(&words, 16), Ok([&once[..], &once, &[5.0; 4]].concat()));
        let bytes = [0, 2, 0, 100, 1, 5, 0, 2, 1, 4, 0, 0, 0];
        assert_eq!(expanded(&packed(&bytes), 8), Ok([0, 100, 80, 60, 40, 20, 0, 0, 0, 0, 0, 0].map(f64::from).into()));
    }

    #[test]
    fn damaged_segments_are_refused() {
        for (words, why) in [
            (&[1, 4, 7][..], "begins with a linear"),
            (&[0, 4, 7], "cut short"),
            (&[0, 1, 7, 1, 2], "cut short"),
            (&[0, 0], "no entries"),
            (&[0, 1, 7, 3, 1, 1], "type 3"),
            (&[0, 1, 7, 2, 1, 3, 0], "points to byte 3"),
            (&[0, 1, 7, 2, 1, 6, 0], "points to another"),
            (&[0, 1, 7, 2, 1, 0, 0xffff], "cut short"),
            (&[0, 1, 7, 1, 0xffff, 9, 1, 1, 9], "more than 65536"),
        ] {
            assert!(expanded(words, 16).is_err_and(|fault| fault.contains(why)), "{words:?}");
        }
        assert!(expanded(&[0, 1, 7], 4).is_err());
    }

    #[test]
    fn entries_are_words_or_bytes() {
        let mut said = Vec::new();
        assert_eq!(plain_entries(&[0x0201, 0x0003], 3, 8, &mut said), Ok(vec![1.0, 2.0, 3.0]));
        assert_eq!(plain_entries(&[1, 2, 3], 3, 8, &mut said), Ok(vec![1.0, 2.0, 3.0]));
        assert_eq!(plain_entries(&[819, 0xffff], 2, 12, &mut said), Ok(vec![51.0, 255.0]));
        assert!(said.is_empty());
        assert_eq!(plain_entries(&[0x0201, 0x0403], 4, 16, &mut said), Ok(vec![1.0, 2.0, 3.0, 4.0]));
        assert!(said.len() == 1 && said[0].contains("one byte for each"), "{said:?}");
        assert!(plain_entries(&[256, 1], 2, 8, &mut said).is_err() && plain_entries(&[1], 1, 7, &mut said).is_err());
    }

    #[test]
    fn numbers_outside_of_a_palette_mean_its_ends() {
        let palette = |first, numbers| Palette { greys: Arc::new([10, 20, 30]), first, numbers };
        let bytes = Indices { width: 1, bits: 8, signed: false, big_endian: false };
        assert_eq!(palette(50, bytes).greys(&[0, 50, 51, 52, 53, 255]), [10, 10, 20, 30, 30, 30]);
        let signed = Indices { signed: true, ..bytes };
        assert_eq!(palette(-1, signed).greys(&[0x80, 0xff, 0, 1, 2]), [10, 10, 20, 30, 30]);
        // The four highest bits of 16 do not count, but the sign is the highest of the others.
        let words = Indices { width: 2, bits: 12, signed: true, big_endian: true };
        assert_eq!(palette(-1, words).greys(&[0x0f, 0xff, 0xf0, 0, 0x30, 1]), [10, 20, 30]);
    }
}
