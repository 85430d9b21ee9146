//! The elements of a DICOM file (PS3.5, PS3.10): preamble, file meta information, then tags with values and nested items.
//!
//! Only the elements of [`WANTED`] are kept: all others, and so everything that tells who the patient is, are skipped. Their tags are noted. The place of
//! pixel data is kept, not the data. A false length is an error before anything is allocated for it.

use super::super::keys::{Key, Unused, Use, not_used};
use super::super::packed::{InputFile, PixelStream};
use super::jpeg::has_end;
use super::tags::{
    ITEM, ITEM_END, KRETZ_CREATOR, KRETZ_GROUP, Kind, META_CLASS, META_LENGTH, META_SYNTAX, NOT_READ, PIXEL_DATA,
    SEQUENCE_END, Tag, WANTED, name, shown_name,
};
use crate::files::InputError;
use std::cell::Cell;
use std::io::Read;
use std::path::Path;

/// Longest value of an element that is not read, bytes, which is looked at for whether it changes anything.
const MAX_LOOKED_AT: u64 = 64;
/// Longest value that is kept: a palette of 65536 words, or a time for each of as many frames.
const MAX_VALUE: u64 = 1 << 20;
/// Most elements: some thirty for each of 65536 frames.
const MAX_ELEMENTS: usize = 1 << 22;
/// Most items within items. Real files have about five.
const MAX_DEPTH: usize = 16;
/// The pixels, for messages.
const FIELD: &str = "pixel data (7FE0,0010)";
/// Bytes at the end of a fragment in which an end mark is looked for.
const TAIL: u64 = 32;
/// A length that is not stated: the end has a mark.
const UNDEFINED: u32 = u32::MAX;

/// A list of data elements: those of a file, or of an item of a sequence.
#[derive(Debug, Default)]
pub(super) struct Item {
    elements: Vec<Element>,
}

#[derive(Debug)]
struct Element {
    tag: Tag,
    value: Value,
    /// Its value was asked for.
    asked: Cell<bool>,
}

#[derive(Debug)]
enum Value {
    /// Numbers are little-endian.
    Bytes(Vec<u8>),
    Items(Vec<Item>),
}

impl Item {
    fn value(&self, tag: Tag) -> Option<&Value> {
        let element = self.elements.iter().find(|element| element.tag == tag)?;
        element.asked.set(true);
        Some(&element.value)
    }

    fn bytes(&self, tag: Tag) -> Option<&[u8]> {
        match self.value(tag)? {
            Value::Bytes(bytes) => Some(bytes),
            Value::Items(_) => None,
        }
    }

    /// The items of the sequence with this tag; empty if it is absent.
    pub fn items(&self, tag: Tag) -> &[Item] {
        match self.value(tag) {
            Some(Value::Items(items)) => items,
            _ => &[],
        }
    }

    /// The value of an element as text, without the white space and NUL characters around it; empty if it is absent.
    pub fn text(&self, tag: Tag) -> String {
        let text = String::from_utf8_lossy(self.bytes(tag).unwrap_or_default());
        text.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_string()
    }

    /// The value of an element of decimal text (DS, IS); empty if it is absent or one of its parts is no number.
    pub fn decimals(&self, tag: Tag) -> Vec<f64> {
        let text = self.text(tag);
        let words = text.split('\\').filter(|word| !word.trim().is_empty());
        words.map(|word| word.trim().parse().ok()).collect::<Option<Vec<f64>>>().unwrap_or_default()
    }

    pub fn decimal(&self, tag: Tag) -> Option<f64> {
        self.decimals(tag).first().copied().filter(|value| value.is_finite())
    }

    pub fn words(&self, tag: Tag) -> Vec<u16> {
        self.bytes(tag).unwrap_or_default().as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect()
    }

    pub fn word(&self, tag: Tag) -> Option<u16> {
        self.words(tag).first().copied()
    }

    pub fn long(&self, tag: Tag) -> Option<u32> {
        self.bytes(tag)?.first_chunk().map(|b| u32::from_le_bytes(*b))
    }

    pub(crate) fn reals(&self, tag: Tag) -> Vec<f64> {
        self.bytes(tag).unwrap_or_default().as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect()
    }

    pub fn real(&self, tag: Tag) -> Option<f64> {
        self.reals(tag).first().copied().filter(|value| value.is_finite())
    }

    /// The value of an element as integers of 64 bits; empty if it is absent.
    pub(crate) fn offsets(&self, tag: Tag) -> Vec<u64> {
        self.bytes(tag).unwrap_or_default().as_chunks::<8>().0.iter().map(|b| u64::from_le_bytes(*b)).collect()
    }
}

/// Location of the pixel data in the file.
#[derive(Debug)]
pub(super) enum PixelData {
    /// Uncompressed: offset and length in bytes, and true if the value representation is OW (words of 16 bits).
    Native(u64, u64, bool),
    /// Compressed: the offsets of frames from the first item (the basic offset table), and the fragments after it.
    Encapsulated(Vec<u32>, Vec<Fragment>),
}

/// A piece of compressed pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fragment {
    /// Offset in the file of the first compressed byte, bytes.
    pub at: u64,
    pub length: u64,
    /// The first bytes of the fragment, zeros after its end.
    pub head: [u8; 8],
    /// True if the fragment may end a frame. Its last bytes are then, padding apart, the end mark of JPEG or JPEG 2000, or they are padding alone, or
    /// the whole fragment is the second byte of that mark.
    pub ends: bool,
}

/// The data elements that were read from a file.
#[derive(Debug)]
pub(super) struct Elements {
    /// UID of the transfer syntax.
    pub syntax: String,
    /// UID of the SOP class, from the file meta information.
    pub class: String,
    pub big_endian: bool,
    pub root: Item,
    pub pixels: Option<PixelData>,
    /// Offset and length, bytes, of a Kretz file that is embedded in this one; None if there is none.
    pub kretz: Option<(u64, u64)>,
    skipped: Skipped,
}

/// Elements of the data set that were not kept.
#[derive(Debug, Default)]
struct Skipped {
    names: Unused,
    /// Those of [`NOT_READ`], with what is said of their values.
    known: Vec<(&'static Key, String)>,
}

/// True if a file that begins with these bytes is DICOM.
pub(in super::super) fn is_one(start: &[u8]) -> bool {
    start.get(128..132) == Some(b"DICM")
}

impl Elements {
    /// Reads the data elements of [`WANTED`] from a file, and finds where its pixels are without reading them.
    ///
    /// # Errors
    /// The file cannot be read or is cut short, its elements contradict each other or exceed a limit, it states no transfer syntax, or its
    /// data set is compressed.
    pub fn read(file: &InputFile) -> Result<Elements, InputError> {
        let input = file.open().map_err(|e| InputError::unreadable(file.path, &e))?;
        let mut walk = Walk {
            file,
            input,
            at: 0,
            end: file.most_bytes(),
            explicit: true,
            big_endian: false,
            count: 0,
            pixels: None,
            creators: Vec::new(),
            kretz: None,
            skipped: Skipped::default(),
        };
        walk.skip(132, "preamble")?;
        let meta = walk.meta()?;
        let syntax = meta.text(META_SYNTAX);
        match syntax.as_str() {
            "1.2.840.10008.1.2" => walk.explicit = false,
            "1.2.840.10008.1.2.2" => walk.big_endian = true,
            "1.2.840.10008.1.2.1.99" => {
                return walk.fault("transfer syntax", "is deflated (1.2.840.10008.1.2.1.99), which is not read");
            }
            "" => return walk.fault("transfer syntax", "(0002,0010) is missing"),
            _ => {}
        }
        let mut root = Item::default();
        match walk.elements(None, 0, true, &mut root) {
            // What follows the pixels is padding, unless a volume may be in it.
            Err(_) if walk.pixels.is_some() && walk.creators.is_empty() => {}
            other => other?,
        }
        let Walk { pixels, kretz, big_endian, skipped, .. } = walk;
        Ok(Elements { syntax, class: meta.text(META_CLASS), big_endian, root, pixels, kretz, skipped })
    }

    /// The names of the elements that no reader used; call it when everything was read. Elements that could change a picture are added to
    /// `remarks` as warnings (title and text). `path`: the file or folder that the log names.
    pub fn unused(self, path: &Path, remarks: &mut Vec<(String, String)>) -> Unused {
        let Skipped { mut names, known } = self.skipped;
        for element in self.root.elements.iter().filter(|element| !element.asked.get()) {
            names.note_as_it_is(&shown_name(element.tag));
        }
        for (key, value) in &known {
            // None of them is refused.
            let _ = not_used(path, key, value, remarks);
        }
        names
    }
}

/// The head of an element.
struct Head {
    tag: Tag,
    vr: [u8; 2],
    length: u32,
}

struct Walk<'a> {
    file: &'a InputFile<'a>,
    input: PixelStream,
    /// Offset of the next byte.
    at: u64,
    /// Length of the file; the most that it can be for one that is packed.
    end: u64,
    explicit: bool,
    big_endian: bool,
    count: usize,
    pixels: Option<PixelData>,
    /// Blocks of private elements that hold Kretz files.
    creators: Vec<u32>,
    kretz: Option<(u64, u64)>,
    skipped: Skipped,
}

impl Walk<'_> {
    fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.file.path, field, fault))
    }

    fn cut<T>(&self, field: &str) -> Result<T, InputError> {
        self.fault(field, format!("cut short after {} bytes", self.at))
    }

    /// Exactly so many bytes; None at the end of the file if there is not even one.
    fn take<const N: usize>(&mut self, field: &str) -> Result<Option<[u8; N]>, InputError> {
        let mut bytes = [0; N];
        let mut got = 0;
        while got < N {
            match self.input.read(&mut bytes[got..]) {
                Ok(0) => break,
                Ok(n) => got += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => break,
                Err(e) => return Err(InputError::unreadable(self.file.path, &e)),
            }
        }
        self.at += got as u64;
        match got {
            0 => Ok(None),
            _ if got == N => Ok(Some(bytes)),
            _ => self.cut(field),
        }
    }

    fn need<const N: usize>(&mut self, field: &str) -> Result<[u8; N], InputError> {
        self.take(field)?.map_or_else(|| self.cut(field), Ok)
    }

    /// Checks that a value lies in the file.
    fn check(&self, length: u64, field: &str) -> Result<(), InputError> {
        let there = self.end.saturating_sub(self.at);
        match length > there {
            true => self.fault(field, format!("cut short, {there} of {length} bytes are there")),
            false => Ok(()),
        }
    }

    /// The end of a value of this length, which lies in the file; None if the length is not stated.
    fn end_of(&self, length: u32, field: &str) -> Result<Option<u64>, InputError> {
        if length == UNDEFINED {
            return Ok(None);
        }
        self.check(length.into(), field)?;
        Ok(Some(self.at + u64::from(length)))
    }

    fn skip(&mut self, bytes: u64, field: &str) -> Result<(), InputError> {
        self.check(bytes, field)?;
        if self.input.skip(bytes).is_err() {
            return self.fault(field, format!("cut short, {bytes} bytes after {} are not there", self.at));
        }
        self.at += bytes;
        Ok(())
    }

    fn u16(&self, bytes: [u8; 2]) -> u16 {
        if self.big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) }
    }

    fn u32(&self, bytes: [u8; 4]) -> u32 {
        if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    }

    fn head(&mut self) -> Result<Option<Head>, InputError> {
        let Some([g0, g1, e0, e1]) = self.take("elements")? else { return Ok(None) };
        self.count += 1;
        if self.count > MAX_ELEMENTS {
            return self.fault("elements", format!("are more than {MAX_ELEMENTS}"));
        }
        let tag = u32::from(self.u16([g0, g1])) << 16 | u32::from(self.u16([e0, e1]));
        let rest: [u8; 4] = self.need(&name(tag))?;
        // Items and their ends have no type.
        if !self.explicit || tag >> 16 == 0xfffe {
            return Ok(Some(Head { tag, vr: [0; 2], length: self.u32(rest) }));
        }
        let [a, b, c, d] = rest;
        let vr = [a, b];
        if !vr.iter().all(u8::is_ascii_uppercase) {
            return self.fault(&name(tag), "has no type of value, which this transfer syntax demands");
        }
        let is_long = matches!(
            &vr,
            b"OB" | b"OD" | b"OF" | b"OL" | b"OV" | b"OW" | b"SQ" | b"SV" | b"UC" | b"UN" | b"UR" | b"UT" | b"UV"
        );
        let length = match is_long {
            true => {
                let bytes = self.need(&name(tag))?;
                self.u32(bytes)
            }
            false => u32::from(self.u16([c, d])),
        };
        Ok(Some(Head { tag, vr, length }))
    }

    /// The head of the next element, which must be there.
    fn next_head(&mut self, field: &str) -> Result<Head, InputError> {
        self.head()?.map_or_else(|| self.cut(field), Ok)
    }

    /// The file meta information: group 0002, always little-endian with types.
    fn meta(&mut self) -> Result<Item, InputError> {
        let mut meta = Item::default();
        let Some(first) = self.head()? else { return self.fault("elements", "are missing") };
        if first.tag != META_LENGTH || first.length != 4 {
            return self.fault("(0002,0000)", "is not the first element");
        }
        let length = u32::from_le_bytes(self.need("(0002,0000)")?);
        let end = self.at + u64::from(length);
        self.check(length.into(), "file meta information")?;
        self.elements(Some(end), 0, true, &mut meta)?;
        Ok(meta)
    }

    /// The elements up to `end`, or to the end of an item or of the file. Those that are wanted are added to `item`.
    fn elements(&mut self, end: Option<u64>, depth: usize, keep: bool, item: &mut Item) -> Result<(), InputError> {
        if depth > MAX_DEPTH {
            return self.fault("items", format!("are nested more than {MAX_DEPTH} deep"));
        }
        while end.is_none_or(|end| self.at < end) {
            let Some(head) = self.head()? else {
                return if depth == 0 && end.is_none() { Ok(()) } else { self.cut("elements") };
            };
            if head.tag == ITEM_END && end.is_none() && depth > 0 {
                return Ok(());
            }
            let is_known = WANTED.iter().any(|wanted| wanted.tag == head.tag);
            match depth == 0 && keep && !is_known && head.tag != PIXEL_DATA && head.tag & 0xffff != 0 {
                true => self.not_kept(&head)?,
                false => self.value_of(&head, depth, keep, item)?,
            }
        }
        match end.filter(|end| self.at > *end) {
            Some(end) => self.fault("items", format!("end {} bytes after where they should", self.at - end)),
            None => Ok(()),
        }
    }

    /// Skips an element of the data set that is not kept. A short value of one that could change a picture is looked at.
    fn not_kept(&mut self, head: &Head) -> Result<(), InputError> {
        let Head { tag, vr, length } = *head;
        self.skipped.names.note_as_it_is(&shown_name(tag));
        let known = NOT_READ.iter().find(|(other, _)| *other == tag).map(|(_, key)| key);
        let is_short = length != UNDEFINED && u64::from(length) <= MAX_LOOKED_AT;
        if let Some(key) = known.filter(|key| is_short && key.done != Use::Listed && &vr != b"SQ") {
            self.check(length.into(), &name(tag))?;
            let value = self.value(tag, length.into())?;
            let text = String::from_utf8_lossy(&value).trim_matches([' ', '\0']).to_string();
            self.skipped.known.push((key, text));
            return Ok(());
        }
        if let Some(key) = known.filter(|_| length > 0) {
            self.skipped.known.push((key, "stated".into()));
        }
        self.value_of(head, 0, false, &mut Item::default())
    }

    /// Reads or skips the value of an element.
    fn value_of(&mut self, head: &Head, depth: usize, keep: bool, item: &mut Item) -> Result<(), InputError> {
        let Head { tag, vr, length } = *head;
        let kind = WANTED.iter().find(|wanted| wanted.tag == tag).map(|wanted| wanted.kind);
        let wanted = keep && kind.is_some() && !item.elements.iter().any(|there| there.tag == tag);
        if tag == PIXEL_DATA && depth == 0 {
            return self.pixel_data(&vr, length);
        }
        let is_sequence = &vr == b"SQ" || (kind == Some(Kind::Sequence) && !self.explicit) || length == UNDEFINED;
        if is_sequence && (wanted || length == UNDEFINED) {
            // A sequence of unknown type has items without types.
            let explicit = self.explicit;
            self.explicit &= &vr != b"UN";
            let items = self.sequence(tag, length, depth, wanted);
            self.explicit = explicit;
            let items = items?;
            if wanted && kind == Some(Kind::Sequence) {
                item.elements.push(Element { tag, value: Value::Items(items), asked: Cell::new(false) });
            }
            return Ok(());
        }
        let length = u64::from(length);
        self.check(length, &name(tag))?;
        if depth == 0 && tag >> 16 == KRETZ_GROUP {
            return self.kretz_element(tag, length);
        }
        match kind {
            Some(kind) if wanted && kind != Kind::Sequence => {
                if length > MAX_VALUE {
                    return self.fault(&name(tag), format!("has {length} bytes, at most {MAX_VALUE} are read"));
                }
                let mut bytes = self.value(tag, length)?;
                // The bytes of OB stand alone, whatever they are used for.
                if let (Kind::Numbers(width), true) = (kind, self.big_endian && &vr != b"OB") {
                    bytes.chunks_exact_mut(width).for_each(<[u8]>::reverse);
                }
                item.elements.push(Element { tag, value: Value::Bytes(bytes), asked: Cell::new(false) });
                Ok(())
            }
            _ => self.skip(length, &name(tag)),
        }
    }

    /// The bytes of a value, whose length was checked.
    fn value(&mut self, tag: Tag, length: u64) -> Result<Vec<u8>, InputError> {
        let mut bytes = Vec::new();
        let read = (&mut self.input).take(length).read_to_end(&mut bytes);
        self.at += bytes.len() as u64;
        match read.is_ok() && bytes.len() as u64 == length {
            true => Ok(bytes),
            false => self.fault(&name(tag), format!("cut short, {} of {length} bytes are there", bytes.len())),
        }
    }

    fn sequence(&mut self, tag: Tag, length: u32, depth: usize, keep: bool) -> Result<Vec<Item>, InputError> {
        let field = name(tag);
        let end = self.end_of(length, &field)?;
        let mut items = Vec::new();
        while end.is_none_or(|end| self.at < end) {
            let head = self.next_head(&field)?;
            match head.tag {
                SEQUENCE_END => return Ok(items),
                ITEM => {
                    let end = self.end_of(head.length, &field)?;
                    let mut item = Item::default();
                    self.elements(end, depth + 1, keep, &mut item)?;
                    if keep {
                        items.push(item);
                    }
                }
                other => return self.fault(&field, format!("has {} where an item begins", name(other))),
            }
        }
        Ok(items)
    }

    fn pixel_data(&mut self, vr: &[u8; 2], length: u32) -> Result<(), InputError> {
        if length != UNDEFINED {
            let found = PixelData::Native(self.at, length.into(), vr == b"OW");
            self.skip(length.into(), FIELD)?;
            self.pixels = Some(found);
            return Ok(());
        }
        let (mut table, mut fragments) = (None, Vec::new());
        loop {
            let head = self.next_head(FIELD)?;
            let length = u64::from(head.length);
            match head.tag {
                SEQUENCE_END => break,
                ITEM if head.length != UNDEFINED && table.is_some() => fragments.push(self.fragment(length)?),
                ITEM if head.length != UNDEFINED => {
                    self.check(length, FIELD)?;
                    if length > MAX_VALUE {
                        return self.fault(FIELD, format!("has a table of {length} bytes"));
                    }
                    let bytes = self.value(PIXEL_DATA, length)?;
                    table = Some(bytes.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect());
                }
                other => return self.fault(FIELD, format!("has {} where a fragment begins", name(other))),
            }
        }
        self.pixels = Some(PixelData::Encapsulated(table.unwrap_or_default(), fragments));
        Ok(())
    }

    /// A fragment of so many bytes, of which only the first and the last are looked at.
    fn fragment(&mut self, length: u64) -> Result<Fragment, InputError> {
        self.check(length, FIELD)?;
        let at = self.at;
        let mut last = self.value(PIXEL_DATA, length.min(8))?;
        let mut head = [0; 8];
        head[..last.len()].copy_from_slice(&last);
        let rest = length - last.len() as u64;
        if rest > TAIL {
            self.skip(rest - TAIL, FIELD)?;
            last.clear();
        }
        last.extend(self.value(PIXEL_DATA, rest.min(TAIL))?);
        Ok(Fragment { at, length, head, ends: has_end(&last) })
    }

    /// An element of the group that may hold a Kretz file.
    fn kretz_element(&mut self, tag: Tag, length: u64) -> Result<(), InputError> {
        let element = tag & 0xffff;
        if (0x10..=0xff).contains(&element) && length <= 64 {
            let creator = self.value(tag, length)?;
            if String::from_utf8_lossy(&creator).trim_matches([' ', '\0']) == KRETZ_CREATOR {
                self.creators.push(element);
            }
            return Ok(());
        }
        if element & 0xff == 1 && self.creators.contains(&(element >> 8)) && self.kretz.is_none() {
            self.kretz = Some((self.at, length));
        }
        self.skip(length, &name(tag))
    }
}
