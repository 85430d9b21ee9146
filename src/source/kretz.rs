//! GE Kretz volumes (`.vol`): a magic, then items of {u16 group, u16 element, u32 length, bytes}, little-endian, up to
//! FFFF,FFFF. Groups 0110 and 0120 hold the patient's identity: their bytes are skipped, never read.

use super::keys::{Aspect, Key, Unused, Use};
use super::layout::{Cartesian, Layout, LineOrder, Remarks, StoredGeometry, extent};
use super::packed::{InputFile, Pixels};
use super::pixel::{Number, PixelFormat};
use crate::files::InputError;
use crate::probe::file::SLAB;
use crate::probe::{Advance, Array, Axis, AxisOrder, Grid, Motion, Probe, World};
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;
use std::io;
use std::path::Path;

const MAGIC: &[u8; 16] = b"KRETZFILE 1.0   ";
/// Speed of sound, which the format omits, m/s.
const SOUND_SPEED: f64 = 1540.0;
/// Longest item that is read completely: an angle table of 65536 entries.
const MAX_TABLE_BYTES: u64 = 65_536 * 8;
/// Most items. Real files have some hundred; a file of zeros has any number.
const MAX_ITEMS: usize = 100_000;

type Tag = (u16, u16);
const SAMPLES: Tag = (0xc000, 1);
const LINES: Tag = (0xc000, 2);
const FRAMES: Tag = (0xc000, 3);
const RADIAL_STEP: Tag = (0xc100, 1);
const ARRAY_RADIUS: Tag = (0xc200, 1);
const MINUS_AXIS_DEPTH: Tag = (0xc200, 2);
const SWEEP_ANGLES: Tag = (0xc300, 1);
const LINE_ANGLES: Tag = (0xc300, 2);
const VOXELS: Tag = (0xd000, 1);
/// The voxels of all volumes in time, one after another, as the readers that are public find them.
const SEQUENCE: Tag = (0xd600, 1);
/// Further volumes of the same moment.
const OTHER_VOXELS: [(Tag, &str); 2] = [((0xd000, 0x101), "colour flow"), ((0xd000, 0x201), "power Doppler")];
const END: Tag = (0xffff, 0xffff);
const READ_WHOLE: [Tag; 8] =
    [SAMPLES, LINES, FRAMES, RADIAL_STEP, ARRAY_RADIUS, MINUS_AXIS_DEPTH, SWEEP_ANGLES, LINE_ANGLES];
/// Elements of group 0002 that exist if the voxels are wavelet-compressed.
const WAVELET: [Tag; 3] = [(2, 0x1000), (2, 0x1100), (2, 0x1200)];

/// The items of a Kretz file whose meaning public readers know, and how they are treated.
pub(super) static KEYS: [Key; 15] = [
    Key::new("C000,0001 (samples)", Aspect::Geometry, Use::Used),
    Key::new("C000,0002 (lines)", Aspect::Geometry, Use::Used),
    Key::new("C000,0003 (frames)", Aspect::Geometry, Use::Used),
    Key::new("C100,0001 (radial step)", Aspect::Geometry, Use::Used),
    Key::new("C200,0001 (array radius)", Aspect::Geometry, Use::Used),
    Key::new("C200,0002 (minus array radius less motor radius)", Aspect::Geometry, Use::Used),
    Key::new("C300,0001 (sweep angles)", Aspect::Geometry, Use::Used),
    Key::new("C300,0002 (line angles)", Aspect::Geometry, Use::Used),
    Key::new("D000,0001 (voxels)", Aspect::Storage, Use::Used),
    Key::new("D600,0001 (volumes in time)", Aspect::Storage, Use::Used),
    Key::new("D000,0101 (colour flow)", Aspect::Value, Use::Listed),
    Key::new("D000,0201 (power Doppler)", Aspect::Value, Use::Listed),
    Key::new("0002,1000, 0002,1100, 0002,1200 (wavelets)", Aspect::Storage, Use::Refused(&[])),
    Key::new("0110,*, 0120,* (patient)", Aspect::About, Use::Listed),
    Key::new("FFFF,FFFF (end)", Aspect::Storage, Use::Optional),
];

/// The items of a file that are used. Of repeated items the first one counts.
struct Items<'a> {
    path: &'a Path,
    small: HashMap<Tag, Vec<u8>>,
    /// Offset and length.
    voxels: Option<(u64, u64)>,
    wavelet: bool,
    /// Offset and length of the volumes in time.
    sequence: Option<(u64, u64)>,
    /// There are items of further volumes in time (4D).
    four_d: bool,
    /// Volumes of other kinds, by name.
    others: Vec<&'static str>,
    /// The file ends behind a whole item, without the mark.
    no_end: bool,
    unused: Unused,
}

pub(super) fn read(file: &InputFile) -> Result<Layout, InputError> {
    let path = file.path;
    let items = Items::walk(file)?;
    if items.wavelet {
        let why = "are wavelet-compressed, which is not read: export the volume uncompressed";
        return Err(InputError::new(path, "voxels", why));
    }
    let (samples, lines) = (items.count(SAMPLES, "samples")?, items.count(LINES, "lines")?);
    let frames = items.count(FRAMES, "frames")?;
    let mut remarks = Vec::new();
    let each = samples as u64 * lines as u64 * frames as u64;
    let (offset, length, volumes) = items.choose(each, &mut remarks)?;
    if !items.others.is_empty() {
        remarks.push(("more volumes".into(), format!("{}; not read", items.others.join(" and "))));
    }
    let claimed = each * volumes as u64;
    if length > claimed {
        remarks.push(("more data".into(), format!("{} bytes behind the voxels; not read", length - claimed)));
    }
    if items.no_end {
        remarks.push(("end mark".into(), "FFFF,FFFF is missing; the items before it are whole".into()));
    }
    let geometry = items.geometry([samples, lines, frames], volumes)?;
    let falls = |tag, count| items.table(tag, "angles").map(|table| table.len() == count && is_falling(&table));
    let line_order = if falls(LINE_ANGLES, lines)? { LineOrder::Reversed } else { LineOrder::InOrder };
    let backward = frames > 1 && falls(SWEEP_ANGLES, frames)?;
    let pixels = match file.is_packed() {
        true => file.pixels(offset),
        false => Pixels { length, ..file.pixels(offset) },
    };
    let pixel = PixelFormat::grey(Number::U8);
    let stated = Layout::new("Kretz volume", pixel, [samples, lines], frames * volumes, pixels, geometry);
    let layout = Layout { line_order, backward, volumes, remarks, unused: items.unused, ..stated };
    layout.check(path, "C000 (size)")?;
    Ok(layout)
}

impl<'a> Items<'a> {
    fn walk(file: &InputFile<'a>) -> Result<Items<'a>, InputError> {
        let path = file.path;
        let unreadable = |e: io::Error| match e.kind() {
            // Of a packed file, whose length is not known before.
            io::ErrorKind::UnexpectedEof => InputError::new(path, "items", "cut short, before FFFF,FFFF"),
            _ => InputError::unreadable(path, &e),
        };
        let there = file.most_bytes();
        let mut input = file.open().map_err(unreadable)?;
        let mut head = Vec::new();
        input.fill(MAGIC.len() as u64, &mut head).map_err(unreadable)?;
        if head != *MAGIC {
            return Err(InputError::new(path, "magic", "is not 'KRETZFILE 1.0   ', the only version that is read"));
        }
        let mut items = Items {
            path,
            small: HashMap::new(),
            voxels: None,
            wavelet: false,
            sequence: None,
            four_d: false,
            others: Vec::new(),
            no_end: false,
            unused: Unused::default(),
        };
        let mut at = MAGIC.len() as u64;
        for _ in 0..MAX_ITEMS {
            head.clear();
            input.fill(8, &mut head).map_err(unreadable)?;
            if head.is_empty() && items.voxels.or(items.sequence).is_some() {
                items.no_end = true;
                return Ok(items);
            }
            let [g0, g1, e0, e1, l0, l1, l2, l3] = head[..] else {
                return Err(InputError::new(path, "items", format!("cut short after {there} bytes, before FFFF,FFFF")));
            };
            let tag = (u16::from_le_bytes([g0, g1]), u16::from_le_bytes([e0, e1]));
            let length = u64::from(u32::from_le_bytes([l0, l1, l2, l3]));
            at += head.len() as u64;
            if tag == END {
                return Ok(items);
            }
            let left = there.saturating_sub(at);
            if length > left {
                let field = if tag == VOXELS || tag == SEQUENCE { "data".into() } else { name(tag, "item") };
                let fault = format!("cut short, {left} of {length} bytes are there");
                return Err(InputError::new(path, field, fault));
            }
            items.wavelet |= WAVELET.contains(&tag);
            items.four_d |= matches!(tag, (0xd600, 1) | (0xd400, 1 | 2 | 5));
            if tag == VOXELS && items.voxels.is_none() {
                items.voxels = Some((at, length));
            }
            if tag == SEQUENCE && items.sequence.is_none() {
                items.sequence = Some((at, length));
            }
            items.others.extend(OTHER_VOXELS.iter().filter(|(other, _)| *other == tag).map(|(_, name)| name));
            if ![VOXELS, SEQUENCE].contains(&tag) && !READ_WHOLE.contains(&tag) {
                items.unused.note_as_it_is(&format!("{:04X},{:04X}", tag.0, tag.1));
            }
            let mut unread = length;
            if READ_WHOLE.contains(&tag) && !items.small.contains_key(&tag) {
                if length > MAX_TABLE_BYTES {
                    let why = format!("has {length} bytes, which is too long");
                    return Err(InputError::new(path, name(tag, "item"), why));
                }
                let mut bytes = Vec::new();
                input.fill(length, &mut bytes).map_err(unreadable)?;
                unread = length - bytes.len() as u64;
                items.small.insert(tag, bytes);
            }
            input.skip(unread).map_err(unreadable)?;
            at += length;
        }
        Err(InputError::new(path, "items", format!("are more than {MAX_ITEMS}, before FFFF,FFFF")))
    }

    /// Offset and length of the voxels, and the number of volumes: all those in time if their bytes are whole volumes of `each` bytes,
    /// otherwise the still one.
    fn choose(&self, each: u64, remarks: &mut Remarks) -> Result<(u64, u64, usize), InputError> {
        let in_time = self.sequence.filter(|(_, length)| *length >= each && length.is_multiple_of(each));
        match (in_time, self.voxels) {
            (Some((offset, length)), still) => {
                let count = usize::try_from(length / each).unwrap_or(usize::MAX);
                let beside = if still.is_some() { "; the still one beside them is not read" } else { "" };
                remarks.push(("4D".into(), format!("{count} volumes in time{beside}")));
                Ok((offset, length, count))
            }
            (None, Some((offset, length))) => {
                if self.four_d {
                    let text = "holds more volumes in a form that is not read: only the still one is";
                    remarks.push(("4D".into(), text.into()));
                }
                Ok((offset, length, 1))
            }
            (None, None) => match self.sequence {
                Some((_, length)) => self.fault(
                    SEQUENCE,
                    "volumes in time",
                    format!("{length} bytes are no whole number of volumes of {each}: a compressed or unknown form, which is not read"),
                ),
                None if self.four_d => {
                    self.fault(VOXELS, "voxels", "missing, and the volumes in time are in a form that is not read")
                }
                None => self.fault(VOXELS, "voxels", "are missing"),
            },
        }
    }

    fn fault<T>(&self, tag: Tag, title: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.path, name(tag, title), fault))
    }

    fn count(&self, tag: Tag, title: &str) -> Result<usize, InputError> {
        match self.small.get(&tag).map(|b| <[u8; 2]>::try_from(b.as_slice())) {
            None => self.fault(tag, title, "is missing"),
            Some(Ok(bytes)) => extent(self.path, &name(tag, title), "", u16::from_le_bytes(bytes).into()),
            Some(Err(_)) => self.fault(tag, title, "must be 2 bytes long"),
        }
    }

    /// A list of f64; empty if the item is absent.
    fn table(&self, tag: Tag, title: &str) -> Result<Vec<f64>, InputError> {
        let Some(bytes) = self.small.get(&tag) else { return Ok(Vec::new()) };
        let (values, rest) = bytes.as_chunks::<8>();
        let values: Vec<f64> = values.iter().map(|b| f64::from_le_bytes(*b)).collect();
        if !rest.is_empty() {
            return self.fault(tag, title, format!("has {} bytes, not a multiple of 8", bytes.len()));
        }
        if values.iter().any(|v| !v.is_finite()) {
            return self.fault(tag, title, "holds a number that is not finite");
        }
        Ok(values)
    }

    fn number(&self, tag: Tag, title: &str) -> Result<f64, InputError> {
        match self.table(tag, title)?[..] {
            [value] => Ok(value),
            [] => self.fault(tag, title, "is missing"),
            _ => self.fault(tag, title, "must be one number"),
        }
    }

    /// Angles centred on pi/2, one of `count`, in rising order.
    fn angles(&self, tag: Tag, title: &str, count: usize) -> Result<Axis, InputError> {
        let table = self.table(tag, title)?;
        if table.len() != count {
            return self.fault(tag, title, format!("has {} entries, must have {count}", table.len()));
        }
        let mut angles: Vec<f64> = table.iter().map(|a| a - FRAC_PI_2).collect();
        if is_falling(&angles) {
            angles.reverse();
        }
        let axis = Axis::from_table(angles);
        if axis.is_valid() { Ok(axis) } else { self.fault(tag, title, "must rise or fall from each to the next") }
    }

    fn geometry(&self, size: [usize; 3], volumes: usize) -> Result<StoredGeometry, InputError> {
        let [samples, lines, frames] = size;
        let step = self.number(RADIAL_STEP, "radial step")? * 1e3;
        if !(step > 0.0 && step.is_finite()) {
            return self.fault(RADIAL_STEP, "radial step", format!("is {step} mm, must be above 0"));
        }
        let tables = [SWEEP_ANGLES, LINE_ANGLES].map(|tag| self.small.get(&tag).is_some_and(|b| !b.is_empty()));
        if tables == [false, false] {
            let world = World::of(&Grid { size, spacing: [step; 3], origin: [0.0; 3] });
            return Ok(StoredGeometry::Cartesian(Cartesian { size, volumes, world, order: AxisOrder::STORED }));
        }
        let radius = self.number(ARRAY_RADIUS, "array radius")? * step;
        let (motion, slices) = if frames == 1 {
            (Motion::Still { thickness: SLAB }, Axis::centred(1.0, 1))
        } else {
            // Stored is -(Ra - Rw), in samples.
            let axis_depth = -self.number(MINUS_AXIS_DEPTH, "minus array radius less motor radius")? * step;
            (Motion::Fan { wobble_radius: radius - axis_depth }, self.angles(SWEEP_ANGLES, "sweep angles", frames)?)
        };
        Ok(StoredGeometry::Sweep(Box::new(Probe {
            array: Array::Curved { radius },
            lines: self.angles(LINE_ANGLES, "line angles", lines)?,
            start_depth: 0.0,
            sample_pitch: step,
            samples,
            motion,
            slices,
            advance: Advance::None,
            sound_speed: SOUND_SPEED,
        })))
    }
}

/// True if a table falls: its last line or frame comes first in space.
fn is_falling(table: &[f64]) -> bool {
    table.len() > 1 && table[0] > table[table.len() - 1]
}

fn name((group, element): Tag, title: &str) -> String {
    format!("{group:04X},{element:04X} ({title})")
}
