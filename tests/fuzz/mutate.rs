//! Nearly valid bytes, the same for the same seed.

use echolume::low_level::statistics::mix;

/// Longest input, bytes.
const LONGEST: usize = 1 << 16;

/// Numbers that replace those of a text.
const TOKENS: [&str; 26] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "255",
    "256",
    "1000",
    "16384",
    "65535",
    "65536",
    "65537",
    "2147483648",
    "4294967295",
    "4294967296",
    "18446744073709551616",
    "1e-320",
    "1e-9",
    "1e9",
    "1e308",
    "-1e308",
    "1e400",
    "nan",
    "inf",
];
/// Words that replace those of a text.
const WORDS: [&str; 12] =
    ["true", "false", "none", "[]", "{}", "''", "\"\\u0000\"", "[0,0,0]", "[1e308,-1e308]", "auto", "é", "\u{1b}[2J"];
/// Words of two, four and eight bytes, in either byte order.
const LENGTHS: [u64; 14] =
    [0, 1, 2, 7, 0x7f, 0xff, 0x100, 0x7fff, 0xffff, 0x1_0000, 0x7fff_ffff, 0xffff_ffff, 1 << 60, u64::MAX];

/// splitmix64 (Steele, Lea and Flood, 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// 0 to `count` - 1; 0 for none.
    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }

    /// A range within `length`, mostly short.
    fn range(&mut self, length: usize) -> std::ops::Range<usize> {
        let start = self.below(length + 1);
        let longest = if self.below(4) == 0 { length } else { 16 };
        start..(start + self.below(longest + 1)).min(length)
    }
}

/// One of the corpus, changed one to eight times.
pub fn mutated(corpus: &[Vec<u8>], text: bool, random: &mut Random) -> Vec<u8> {
    let mut bytes = random.of(corpus).clone();
    for _ in 0..1 + random.below(4) * random.below(3) {
        if text && random.below(3) > 0 {
            change_text(&mut bytes, corpus, random)
        } else {
            change(&mut bytes, corpus, random)
        }
    }
    bytes.truncate(LONGEST);
    bytes
}

fn change(bytes: &mut Vec<u8>, corpus: &[Vec<u8>], random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(9) {
        0 | 1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
        2 if !bytes.is_empty() => bytes[at] = random.next() as u8,
        3 | 4 => {
            let width = *random.of(&[1, 2, 4, 8]);
            let near = (bytes.len() as u64).wrapping_add(random.below(3) as u64).wrapping_sub(1);
            let word = if random.below(4) == 0 { near } else { *random.of(&LENGTHS) };
            let (little, big) = (word.to_le_bytes(), word.to_be_bytes());
            let word = if random.below(2) == 0 { &little[..width] } else { &big[8 - width..] };
            if let Some(there) = bytes.get_mut(at..at + width) {
                there.copy_from_slice(word);
            }
        }
        5 => bytes.truncate(at),
        6 => drop(bytes.drain(random.range(bytes.len()))),
        7 => {
            let again = bytes[random.range(bytes.len())].to_vec();
            bytes.splice(at..at, again);
        }
        _ => {
            // A part of another input replaces a part of this one.
            let other = random.of(corpus);
            let part = other[random.range(other.len())].to_vec();
            bytes.splice(random.range(bytes.len()), part);
        }
    }
}

fn change_text(bytes: &mut Vec<u8>, corpus: &[Vec<u8>], random: &mut Random) {
    let number = |b: u8| b.is_ascii_digit() || b"+-.e_".contains(&b);
    let word = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
    match random.below(8) {
        0..3 => {
            if let Some(there) = token(bytes, random, |b| b.is_ascii_digit(), number) {
                bytes.splice(there, random.of(&TOKENS).bytes());
            }
        }
        3 => {
            if let Some(there) = token(bytes, random, word, word) {
                bytes.splice(there, random.of(&WORDS).bytes());
            }
        }
        4 => {
            let other = random.of(corpus);
            if let Some(part) = token(other, random, word, word)
                && let Some(there) = token(bytes, random, word, word)
            {
                bytes.splice(there, other[part].iter().copied());
            }
        }
        5 => {
            let there = line(bytes, random);
            bytes.drain(there);
        }
        _ => {
            let other = random.of(corpus);
            let part = other[line(other, random)].to_vec();
            let at = line(bytes, random).start;
            bytes.splice(at..at, part);
        }
    }
}

/// A run of bytes that form one token, at or after a random position in the first 4 KiB: headers come first.
fn token(
    bytes: &[u8],
    random: &mut Random,
    begins: impl Fn(u8) -> bool,
    goes_on: impl Fn(u8) -> bool,
) -> Option<std::ops::Range<usize>> {
    let from = random.below(bytes.len().min(4096));
    let found = bytes[from..].iter().position(|b| begins(*b))? + from;
    let start = bytes[..found].iter().rposition(|b| !goes_on(*b)).map_or(0, |before| before + 1);
    let end = bytes[found..].iter().position(|b| !goes_on(*b)).map_or(bytes.len(), |behind| found + behind);
    Some(start..end)
}

fn line(bytes: &[u8], random: &mut Random) -> std::ops::Range<usize> {
    let from = random.below(bytes.len().min(4096));
    let start = bytes[..from].iter().rposition(|b| *b == b'\n').map_or(0, |before| before + 1);
    let end = bytes[start..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |behind| start + behind + 1);
    start..end
}
