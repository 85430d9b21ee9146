//! NIfTI-1 and NIfTI-2 (`.nii`, and `.hdr` with `.img`): a header of fixed size in either byte order, then samples. Its world is RAS; it
//! becomes LPS.

use super::keys::{Aspect, Keys, Unused, Use, keys, not_used};
use super::layout::{Cartesian, Layout, Remarks, StoredGeometry, extent, frames, warned};
use super::packed::{Encoding, InputFile, Pixels};
use super::pixel::{Number, PixelFormat};
use crate::files::InputError;
use crate::probe::{AxisOrder, World};
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;

/// Sizes of the two headers, bytes.
const SIZE_1: usize = 348;
const SIZE_2: usize = 540;
/// From RAS to LPS.
const TO_LPS: DVec3 = DVec3::new(-1.0, -1.0, 1.0);

/// The fields of a NIfTI header and how they are treated. Text fields may hold a patient's name: none of their values is shown.
pub(super) static KEYS: Keys = Keys::new(|| {
    keys(&[
        ("sizeof_hdr|magic", Aspect::Storage, Use::Used),
        ("dim", Aspect::Geometry, Use::Used),
        ("datatype|bitpix|vox_offset", Aspect::Storage, Use::Used),
        ("pixdim|xyzt_units", Aspect::Geometry, Use::Used),
        ("sform_code|srow_*|qform_code", Aspect::Orientation, Use::Used),
        ("quatern_*", Aspect::Orientation, Use::Optional),
        ("qoffset_*", Aspect::Geometry, Use::Optional),
        ("scl_slope|scl_inter", Aspect::Value, Use::Used),
        ("toffset", Aspect::Time, Use::Used),
        ("slice_start|slice_end|slice_code", Aspect::Time, Use::Listed),
        ("slice_duration", Aspect::Time, Use::Warned(&["0"])),
        ("dim_info|intent_code|intent_p1|intent_p2|intent_p3|intent_name|cal_max|cal_min", Aspect::About, Use::Listed),
        ("descrip|aux_file|extension|data_type|db_name|extents|session_error|regular", Aspect::About, Use::Listed),
        ("glmax|glmin|unused_str", Aspect::About, Use::Listed),
    ])
});

/// Where the fields are that are not read: name, and offset and bytes in version 1 and in version 2, if they are there.
const NOT_READ: [(&str, Place, Place); 23] = [
    ("slice_start", Some((74, 2)), Some((224, 8))),
    ("slice_end", Some((120, 2)), Some((232, 8))),
    ("slice_code", Some((122, 1)), Some((496, 4))),
    ("slice_duration", Some((132, 4)), Some((208, 8))),
    ("dim_info", Some((39, 1)), Some((524, 1))),
    ("intent_code", Some((68, 2)), Some((504, 4))),
    ("intent_p1", Some((56, 4)), Some((80, 8))),
    ("intent_p2", Some((60, 4)), Some((88, 8))),
    ("intent_p3", Some((64, 4)), Some((96, 8))),
    ("intent_name", Some((328, 16)), Some((508, 16))),
    ("cal_max", Some((124, 4)), Some((192, 8))),
    ("cal_min", Some((128, 4)), Some((200, 8))),
    ("descrip", Some((148, 80)), Some((240, 80))),
    ("aux_file", Some((228, 24)), Some((320, 24))),
    ("data_type", Some((4, 10)), None),
    ("db_name", Some((14, 18)), None),
    ("extents", Some((32, 4)), None),
    ("session_error", Some((36, 2)), None),
    ("regular", Some((38, 1)), None),
    ("glmax", Some((140, 4)), None),
    ("glmin", Some((144, 4)), None),
    ("extension", Some((348, 1)), Some((540, 1))),
    ("unused_str", None, Some((525, 15))),
];
/// Offset and bytes.
type Place = Option<(usize, usize)>;

/// Version 1 or 2, and the byte order, of a file that begins like this.
fn version(start: &[u8]) -> Option<(u8, bool)> {
    let size: [u8; 4] = start.get(..4)?.try_into().ok()?;
    let magic_1 = start.get(344..347);
    let magic_2 = start.get(4..7);
    for (big_endian, size) in [(false, u32::from_le_bytes(size)), (true, u32::from_be_bytes(size))] {
        if size as usize == SIZE_1 && matches!(magic_1, Some(b"n+1" | b"ni1")) {
            return Some((1, big_endian));
        }
        if size as usize == SIZE_2 && matches!(magic_2, Some(b"n+2" | b"ni2")) {
            return Some((2, big_endian));
        }
    }
    None
}

/// True if a file that begins with these bytes is NIfTI.
pub(super) fn is_one(start: &[u8]) -> bool {
    version(start).is_some()
}

/// The bytes of a header, and where its numbers are.
struct Bytes {
    bytes: Vec<u8>,
    version: u8,
    big_endian: bool,
}

impl Bytes {
    fn take<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut taken: [u8; N] = self.bytes.get(at..at + N).and_then(|b| b.try_into().ok()).unwrap_or([0; N]);
        if self.big_endian {
            taken.reverse();
        }
        taken
    }

    /// The number of either version: `one` is its offset and size in bytes in version 1, `two` in version 2.
    fn integer(&self, one: (usize, usize), two: (usize, usize)) -> i64 {
        let (at, size) = if self.version == 1 { one } else { two };
        match size {
            1 => self.bytes.get(at).map_or(0, |b| i64::from(*b)),
            2 => i64::from(i16::from_le_bytes(self.take(at))),
            4 => i64::from(i32::from_le_bytes(self.take(at))),
            _ => i64::from_le_bytes(self.take(at)),
        }
    }

    /// f32 of version 1, f64 of version 2; the `n`th from these offsets on.
    fn real(&self, one: usize, two: usize, n: usize) -> f64 {
        match self.version {
            1 => f64::from(f32::from_le_bytes(self.take(one + 4 * n))),
            _ => f64::from_le_bytes(self.take(two + 8 * n)),
        }
    }

    fn dim(&self, n: usize) -> i64 {
        self.integer((40 + 2 * n, 2), (16 + 8 * n, 8))
    }

    fn pixdim(&self, n: usize) -> f64 {
        self.real(76, 104, n)
    }
}

pub(super) fn read(file: &InputFile) -> Result<Layout, InputError> {
    let path = file.path;
    let fault = |field: &str, fault: String| Err(InputError::new(path, field, fault));
    let mut bytes = Vec::new();
    let opened = file.open().map_err(|e| InputError::unreadable(path, &e))?;
    // With the first byte after the header, which says whether there is an extension.
    opened.take(SIZE_2 as u64 + 1).read_to_end(&mut bytes).map_err(|e| InputError::unreadable(path, &e))?;
    let Some((version, big_endian)) = version(&bytes) else {
        return fault("magic", "is not that of NIfTI".into());
    };
    let header = Bytes { bytes, version, big_endian };
    let needed = if version == 1 { SIZE_1 } else { SIZE_2 };
    if header.bytes.len() < needed {
        return fault("header", format!("cut short, {} of {needed} bytes are there", header.bytes.len()));
    }
    let (size, volumes) = sizes(file, &header)?;
    let frames = frames(path, "dim", "makes", size[2], volumes)?;
    let (number, channels) = match header.integer((70, 2), (12, 2)) {
        2 => (Number::U8, 1),
        4 => (Number::I16, 1),
        8 => (Number::I32, 1),
        16 => (Number::F32, 1),
        64 => (Number::F64, 1),
        128 => (Number::U8, 3),
        256 => (Number::I8, 1),
        512 => (Number::U16, 1),
        768 => (Number::U32, 1),
        1024 => (Number::I64, 1),
        1280 => (Number::U64, 1),
        2304 => (Number::U8, 4),
        other => {
            return fault("datatype", format!("is {other}, which is not read: numbers of 8 to 64 bits and RGB are"));
        }
    };
    let [slope, intercept] = [0, 1].map(|n| header.real(112, 176, n));
    let is_scaled = slope != 0.0 && slope.is_finite() && intercept.is_finite() && (slope, intercept) != (1.0, 0.0);
    let pixel = PixelFormat { number, channels, big_endian, scale: is_scaled.then_some([slope, intercept]) };
    let mut remarks = Vec::new();
    let bits = header.integer((72, 2), (14, 2));
    if bits != 0 && bits != 8 * pixel.bytes() as i64 {
        let text = format!("bitpix is {bits}, but datatype has {} bits and counts", 8 * pixel.bytes());
        remarks.push(warned(path, "not used", text));
    }
    let world = world(file, &header, &mut remarks)?;
    let format = if version == 1 { "NIfTI-1" } else { "NIfTI-2" };
    let geometry = StoredGeometry::Cartesian(Cartesian { size, volumes, world, order: AxisOrder::STORED });
    let stated = Layout::new(format, pixel, [size[0], size[1]], frames, pixels(file, &header)?, geometry);
    let times = times(file, &header, size[2], volumes, &mut remarks);
    let unused = unused(file, &header, &mut remarks);
    let mut layout = Layout { times, unused, remarks, ..stated };
    let claimed = layout.frame_bytes() * frames as u64;
    if !layout.pixels.is_compressed() && layout.pixels.length > claimed {
        let more = layout.pixels.length - claimed;
        layout.remarks.push(("more data".into(), format!("{more} bytes behind the samples; not read")));
        layout.pixels.length = claimed;
    }
    layout.check(path, "dim")?;
    Ok(layout)
}

/// The fields that are not 0 and not read.
fn unused(file: &InputFile, header: &Bytes, remarks: &mut Remarks) -> Unused {
    let mut unused = Unused::default();
    for (name, one, two) in NOT_READ {
        let Some((at, length)) = (if header.version == 1 { one } else { two }) else { continue };
        let is_stated = header.bytes.get(at..at + length).is_some_and(|bytes| bytes.iter().any(|byte| *byte != 0));
        let Some(key) = KEYS.iter().find(|key| key.name == name).filter(|_| is_stated) else { continue };
        unused.note(name);
        // None of them is refused.
        let _ = not_used(file.path, key, "not 0", remarks);
    }
    unused
}

/// Voxels of a volume, and the number of volumes.
fn sizes(file: &InputFile, header: &Bytes) -> Result<([usize; 3], usize), InputError> {
    let count = header.dim(0);
    if !(1..=7).contains(&count) {
        return Err(InputError::new(file.path, "dim", format!("has {count} axes, must have 1 to 7")));
    }
    let mut size = [1; 4];
    for axis in 1..=count as usize {
        let entry = u64::try_from(header.dim(axis)).unwrap_or(0);
        match size.get_mut(axis - 1) {
            Some(place) => *place = extent(file.path, "dim", &format!("axis {axis} "), entry)?,
            None if entry > 1 => {
                let fault = format!("axis {axis} is {entry}: only x, y, z and time are read");
                return Err(InputError::new(file.path, "dim", fault));
            }
            None => {}
        }
    }
    let [x, y, z, volumes] = size;
    Ok(([x, y, z], volumes))
}

/// The location of the samples: in the file, or in the `.img` beside a `.hdr`.
fn pixels(file: &InputFile, header: &Bytes) -> Result<Pixels, InputError> {
    let fault = |field: &str, fault: String| Err(InputError::new(file.path, field, fault));
    let offset = match header.version {
        1 => f64::from(f32::from_le_bytes(header.take(108))),
        _ => header.integer((0, 8), (168, 8)) as f64,
    };
    if !(0.0..=1e15).contains(&offset) {
        return fault("vox_offset", format!("is {offset}, which is not a place in a file"));
    }
    let magic = if header.version == 1 { header.bytes.get(344..346) } else { header.bytes.get(4..6) };
    if magic == Some(b"n+") {
        let least = if header.version == 1 { SIZE_1 } else { SIZE_2 };
        return Ok(file.pixels((offset as u64).max(least as u64)));
    }
    if file.is_packed() {
        return fault("magic", "is that of a .hdr with an .img, which is not read as .gz".into());
    }
    let path = file.path.with_extension("img");
    let length = match fs::metadata(&path) {
        Ok(metadata) if metadata.is_file() => metadata.len(),
        _ => return fault("magic", "is that of a .hdr, and there is no .img beside it".into()),
    };
    let offset = offset as u64;
    let length = length.saturating_sub(offset);
    Ok(Pixels { path, offset, length, encoding: Encoding::Raw, ..file.pixels(0) })
}

/// The world: that of the sform, otherwise of the qform, otherwise the spacing alone.
fn world(file: &InputFile, header: &Bytes, remarks: &mut Remarks) -> Result<World, InputError> {
    let unit = match header.integer((123, 1), (500, 4)) & 7 {
        0 => {
            remarks.push(("units".into(), "not stated, taken as mm".into()));
            1.0
        }
        1 => 1e3,
        2 => 1.0,
        3 => 1e-3,
        other => {
            let text = format!("the unit of lengths has the code {other}, which is not known; taken as mm");
            remarks.push(warned(file.path, "units", text));
            1.0
        }
    };
    let made = |axes: [DVec3; 3], origin: DVec3| World::new(axes.map(|a| a * unit), origin * unit);
    let fault = |field: &str, why: String| InputError::new(file.path, field, why);
    let [has_qform, has_sform] = [header.integer((252, 2), (344, 4)) > 0, header.integer((254, 2), (348, 4)) > 0];
    let spacing = [1, 2, 3].map(|n| match header.pixdim(n) {
        // An axis of one voxel may have none.
        0.0 => 1.0,
        length => length.abs(),
    });
    let by_quaternion = || {
        let [b, c, d] = [0, 1, 2].map(|n| header.real(256, 352, n));
        let origin = DVec3::from([0, 1, 2].map(|n| header.real(268, 376, n))) * TO_LPS;
        let rotation = quaternion(b, c, d);
        let hand = if header.pixdim(0) < 0.0 { -1.0 } else { 1.0 };
        made([0, 1, 2].map(|n| rotation.col(n) * TO_LPS * spacing[n] * [1.0, 1.0, hand][n]), origin)
    };
    if has_sform {
        let column = |n: usize| {
            let row = |row: usize| header.real(280, 400, 4 * row + n);
            DVec3::new(row(0), row(1), row(2)) * TO_LPS
        };
        match made([column(0), column(1), column(2)], column(3)) {
            Ok(world) => {
                let other = by_quaternion().ok().filter(|other| has_qform && !is_same(&world, other));
                let text = "the qform states another place; the sform counts, as the standard says";
                remarks.extend(other.map(|_| ("sform".into(), text.into())));
                return Ok(world);
            }
            Err(why) if !has_qform => return Err(fault("sform", why)),
            Err(why) => remarks.push(("sform".into(), format!("{why}; the qform is used"))),
        }
    }
    if !has_qform {
        let axes = [DVec3::X * spacing[0], DVec3::Y * spacing[1], DVec3::Z * spacing[2]];
        return made(axes, DVec3::ZERO).map_err(|why| fault("pixdim", why));
    }
    by_quaternion().map_err(|why| fault("qform", why))
}

/// Whether two places differ by no more than rounding to f32: a thousandth of a voxel.
fn is_same(a: &World, b: &World) -> bool {
    let voxel = a.axis(0).length().min(a.axis(1).length()).min(a.axis(2).length());
    let near = |a: DVec3, b: DVec3| (a - b).length() <= 1e-3 * voxel.max(1e-3 * a.length());
    near(a.origin(), b.origin()) && (0..3).all(|n| near(a.axis(n), b.axis(n)))
}

/// The rotation of a unit quaternion by its last three components.
fn quaternion(b: f64, c: f64, d: f64) -> DMat3 {
    let rest = 1.0 - (b * b + c * c + d * d);
    // Rounded to f32, the three may be longer than 1: then it is a half turn.
    let (a, scale) = if rest < 1e-7 { (0.0, (b * b + c * c + d * d).sqrt().recip()) } else { (rest.sqrt(), 1.0) };
    let (b, c, d) = (b * scale, c * scale, d * scale);
    DMat3::from_cols(
        DVec3::new(a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)),
        DVec3::new(2.0 * (b * c - a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d + a * b)),
        DVec3::new(2.0 * (b * d + a * c), 2.0 * (c * d - a * b), a * a + d * d - b * b - c * c),
    )
}

/// Time stamps of all frames, if there are several volumes and a time between them.
fn times(
    file: &InputFile,
    header: &Bytes,
    slices: usize,
    volumes: usize,
    remarks: &mut Remarks,
) -> BTreeMap<usize, f64> {
    let (step, first) = (header.pixdim(4), header.real(136, 216, 0));
    if volumes < 2 || !(step > 0.0 && step.is_finite() && first.is_finite()) {
        return BTreeMap::new();
    }
    let unit = match header.integer((123, 1), (500, 4)) & 0x38 {
        0 => {
            remarks.push(("unit of time".into(), "not stated, taken as s".into()));
            1.0
        }
        8 => 1.0,
        16 => 1e-3,
        24 => 1e-6,
        _ => {
            let text = "the fourth axis has no unit of time: there are no time stamps";
            remarks.push(warned(file.path, "times", text.into()));
            return BTreeMap::new();
        }
    };
    (0..slices * volumes).map(|frame| (frame, (first + step * (frame / slices) as f64) * unit)).collect()
}
