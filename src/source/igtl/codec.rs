//! Decodes and encodes messages. Any bytes decode to a message, the number of missing bytes, or an error. At the end are the parts that
//! all messages have in common: the header of 58 bytes, big-endian fields, the checksum, and their errors.

use super::message::{
    Coordinates, Image, Message, Other, Region, Scalar, Status, Text, Tool, ToolKind, TrackingData, Transform,
};
use crate::files::{escaped, quoted};
use crc::{CRC_64_ECMA_182, Crc, Table};

/// Default of the largest body of a message, bytes.
pub const BODY_LIMIT: usize = 256 << 20;
/// Length of a tool in TDATA, bytes.
const TOOL_BYTES: usize = 70;
/// IANA's number of ISO-8859-1, a STRING's encoding.
const LATIN_1: u16 = 4;

/// What the bytes at the start of a buffer are.
#[derive(Clone, Debug, PartialEq)]
pub enum Decoded {
    /// The beginning of a message, of which at least this number of bytes is missing (1 or more).
    Need(usize),
    /// A complete message of `length` bytes, after which the next one begins.
    Message { message: Message, length: usize },
}

/// Decodes the message at the start of `bytes`.
///
/// `limit`: the largest accepted body, bytes. A larger one is refused as soon as its header is complete. Memory is allocated only when the whole body
/// is available, and at most about three times its bytes.
///
/// # Errors
/// [`DecodeError`]: what is wrong, and how many bytes to skip if the next message can be found.
pub fn decode(bytes: &[u8], limit: usize) -> Result<Decoded, DecodeError> {
    decode_with(bytes, limit, false)
}

/// Decodes the message at the start of `bytes`, see [`decode`]. `takes_zero`: true to accept messages with the checksum 0 without verifying it, as
/// some senders compute none.
pub(super) fn decode_with(bytes: &[u8], limit: usize, takes_zero: bool) -> Result<Decoded, DecodeError> {
    let Some(head) = bytes.first_chunk::<HEADER>() else { return Ok(Decoded::Need(HEADER - bytes.len())) };
    let framing =
        |kind: &str, device: &str, fault| DecodeError::Framing { error: MessageError::new(kind, device, fault) };
    let header = Header::read(head).map_err(|fault| framing("header", "", fault))?;
    let body = header.accepted(limit).map_err(|fault| framing(&header.kind, &header.device, fault))?;
    let rest = &bytes[HEADER..];
    let Some(body) = rest.get(..body) else { return Ok(Decoded::Need(body - rest.len())) };
    let length = HEADER + body.len();
    let error = |fault| MessageError::new(&header.kind, &header.device, fault);
    let crc = crc64(body);
    if crc != header.crc && !(takes_zero && header.crc == 0) {
        let fault = format!("is {:016x}, must be {crc:016x} for these {} bytes", header.crc, body.len());
        return Err(DecodeError::Checksum { length, error: error(Fault::new("checksum", fault)) });
    }
    match read(&header, body) {
        Ok(message) => Ok(Decoded::Message { message, length }),
        Err(fault) => Err(DecodeError::Content { length, error: error(fault) }),
    }
}

fn read(header: &Header, body: &[u8]) -> Result<Message, Fault> {
    let (device, time) = (header.device.clone(), header.time);
    let content = header.content(body)?;
    let mut fields = Fields(content);
    Ok(match header.kind.as_str() {
        "TRANSFORM" => {
            let matrix = fields.matrix()?;
            expect_end(&fields, content)?;
            Message::Transform(Transform { device, time, matrix })
        }
        "TDATA" => {
            if !content.len().is_multiple_of(TOOL_BYTES) {
                return Err(Fault::new("tools", format!("are {} bytes, must be {TOOL_BYTES} each", content.len())));
            }
            let tools = content.chunks_exact(TOOL_BYTES).map(tool).collect::<Result<_, _>>()?;
            Message::TrackingData(TrackingData { device, time, tools })
        }
        "IMAGE" => Message::Image(Image::read(device, time, content)?),
        "STATUS" => {
            let code = fields.u16("code")?;
            let subcode = fields.u64("subcode")?.cast_signed();
            let name = fields.name::<20>("name")?;
            Message::Status(Status { device, time, code, subcode, name, text: until_nul(fields.0) })
        }
        "STRING" => {
            let encoding = fields.u16("encoding")?;
            let length = usize::from(fields.u16("length")?);
            let Some(text) = fields.0.get(..length) else {
                return Err(Fault::new("length", format!("is {length} bytes, must be at most {}", fields.0.len())));
            };
            let text = match encoding {
                LATIN_1 => text.iter().map(|b| char::from(*b)).collect(),
                _ => String::from_utf8_lossy(text).into_owned(),
            };
            Message::Text(Text { device, time, text })
        }
        _ => Message::Other(Other { device, time, kind: header.kind.clone(), bytes: body.len() }),
    })
}

fn tool(bytes: &[u8]) -> Result<Tool, Fault> {
    let mut fields = Fields(bytes);
    let name = fields.name::<20>("tool's name")?;
    let number = fields.u8("tool's type")?;
    let Some(kind) = ToolKind::ALL.into_iter().find(|kind| *kind as u8 == number) else {
        return Err(Fault::new("tool's type", format!("is {number}, must be 1 to 4")));
    };
    fields.u8("reserved")?;
    Ok(Tool { name, kind, matrix: fields.matrix()? })
}

fn expect_end(fields: &Fields, content: &[u8]) -> Result<(), Fault> {
    match fields.0.len() {
        0 => Ok(()),
        more => Err(Fault::new("content", format!("is {} bytes, must be {}", content.len(), content.len() - more))),
    }
}

/// Version of the OpenIGTLink header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// Version 1, which every peer can read.
    V1,
    /// Version 2, with an extended header and empty metadata.
    V2,
}

/// IANA's numbers of a STRING's encodings.
const ASCII: u16 = 3;
const UTF_8: u16 = 106;

/// Encodes a message with its header and checksum.
///
/// # Errors
/// A field that the format cannot represent, or [`Message::Other`], whose body was not kept. Such fields are, for example, a name that is too long
/// or has zero bytes, a STRING of more than 65535 bytes, a time before 1970 or after 2106, and a number that is not finite.
pub fn encode(message: &Message, version: Version) -> Result<Vec<u8>, MessageError> {
    let error = |fault| MessageError::new(message.kind(), message.device(), fault);
    let mut bytes = vec![0; HEADER];
    write(message, version, &mut bytes).map_err(error)?;
    finish(&mut bytes, message.kind(), message.device(), message.time(), version).map_err(error)?;
    Ok(bytes)
}

/// Encodes a message of any type and body, in version 1. `kind`: name of the type; `time`: s since 1970.
///
/// # Errors
/// A name that is too long or has zero bytes, or a time before 1970 or after 2106.
pub(super) fn packed(kind: &str, device: &str, time: f64, body: &[u8]) -> Result<Vec<u8>, MessageError> {
    let mut bytes = vec![0; HEADER];
    bytes.extend_from_slice(body);
    finish(&mut bytes, kind, device, time, Version::V1).map_err(|fault| MessageError::new(kind, device, fault))?;
    Ok(bytes)
}

/// Writes the header of a message before its body, which is there.
fn finish(bytes: &mut [u8], kind: &str, device: &str, time: f64, version: Version) -> Result<(), Fault> {
    let (whole, fraction) = stamp(time)
        .ok_or_else(|| Fault::new("time stamp", format!("is {time} s, must be at least 0 and below 2^32")))?;
    let number: u16 = if version == Version::V1 { 1 } else { 2 };
    let mut head = number.to_be_bytes().to_vec();
    name(&mut head, "type", kind, 12)?;
    name(&mut head, "device", device, 20)?;
    head.extend(whole.to_be_bytes());
    head.extend(fraction.to_be_bytes());
    head.extend(((bytes.len() - HEADER) as u64).to_be_bytes());
    head.extend(crc64(&bytes[HEADER..]).to_be_bytes());
    bytes[..HEADER].copy_from_slice(&head);
    Ok(())
}

fn write(message: &Message, version: Version, body: &mut Vec<u8>) -> Result<(), Fault> {
    // The number of metadata entries is written even if it is 0: the reference library reads it without checking the size.
    let metadata: &[u8] = if version == Version::V1 { &[] } else { &0u16.to_be_bytes() };
    if version == Version::V2 {
        body.extend((EXTENDED as u16).to_be_bytes());
        body.extend((metadata.len() as u16).to_be_bytes());
        body.extend([0; 8]);
    }
    match message {
        Message::Transform(m) => matrix(body, &m.matrix)?,
        Message::TrackingData(m) => {
            for tool in &m.tools {
                name(body, "tool's name", &tool.name, 20)?;
                body.extend([tool.kind as u8, 0]);
                matrix(body, &tool.matrix)?;
            }
        }
        Message::Image(m) => m.write(body)?,
        Message::Status(m) => {
            body.extend(m.code.to_be_bytes());
            body.extend(m.subcode.to_be_bytes());
            name(body, "name", &m.name, 20)?;
            no_zero("text", &m.text)?;
            body.extend(m.text.as_bytes());
            // The reference library overwrites the last byte by a zero.
            body.push(0);
        }
        Message::Text(m) => {
            let Ok(length) = u16::try_from(m.text.len()) else {
                return Err(Fault::new("text", format!("is {} bytes, must be at most 65535", m.text.len())));
            };
            let encoding = if m.text.is_ascii() { ASCII } else { UTF_8 };
            body.extend(encoding.to_be_bytes());
            body.extend(length.to_be_bytes());
            body.extend(m.text.as_bytes());
        }
        Message::Other(_) => return Err(Fault::new("type", "is not one that can be written")),
    }
    body.extend(metadata);
    Ok(())
}

fn matrix(body: &mut Vec<u8>, rows: &[[f32; 4]; 3]) -> Result<(), Fault> {
    for column in 0..4 {
        for value in rows.map(|row| row[column]) {
            if !value.is_finite() {
                return Err(Fault::new("matrix", format!("has {value}, must be finite")));
            }
            body.extend(value.to_be_bytes());
        }
    }
    Ok(())
}

/// Text padded with zeros to `longest` bytes.
fn name(body: &mut Vec<u8>, field: &'static str, text: &str, longest: usize) -> Result<(), Fault> {
    no_zero(field, text)?;
    if text.len() > longest {
        return Err(Fault::new(field, format!("is {} bytes, must be at most {longest}", text.len())));
    }
    body.extend(text.as_bytes());
    body.resize(body.len() + longest - text.len(), 0);
    Ok(())
}

fn no_zero(field: &'static str, text: &str) -> Result<(), Fault> {
    match text.find('\0') {
        None => Ok(()),
        Some(at) => Err(Fault::new(field, format!("has a zero at byte {at}, which would end it"))),
    }
}

const SCALARS: [(u8, Scalar); 8] = [
    (2, Scalar::I8),
    (3, Scalar::U8),
    (4, Scalar::I16),
    (5, Scalar::U16),
    (6, Scalar::I32),
    (7, Scalar::U32),
    (10, Scalar::F32),
    (11, Scalar::F64),
];
/// Version of the image's own header.
const IMAGE_VERSION: u16 = 1;
const BIG: u8 = 1;
const LITTLE: u8 = 2;

impl Image {
    fn read(device: String, time: f64, content: &[u8]) -> Result<Image, Fault> {
        let mut fields = Fields(content);
        let version = fields.u16("image version")?;
        if version != IMAGE_VERSION {
            return Err(Fault::new("image version", format!("is {version}, must be {IMAGE_VERSION}")));
        }
        let components = fields.u8("components")?;
        let scalar = fields.u8("scalar type")?;
        let endian = fields.u8("byte order")?;
        let coordinates = fields.u8("coordinates")?;
        if components == 0 {
            return Err(Fault::new("components", "is 0, must be 1 to 255"));
        }
        let Some((_, scalar)) = SCALARS.into_iter().find(|(number, _)| *number == scalar) else {
            return Err(Fault::new("scalar type", format!("is {scalar}, must be 2 to 7, 10 or 11")));
        };
        if ![BIG, LITTLE].contains(&endian) {
            return Err(Fault::new("byte order", format!("is {endian}, must be 1 (big) or 2 (little)")));
        }
        let coordinates = match coordinates {
            1 => Coordinates::Ras,
            2 => Coordinates::Lps,
            other => return Err(Fault::new("coordinates", format!("is {other}, must be 1 (RAS) or 2 (LPS)"))),
        };
        let size = fields.three("size")?;
        let axes = [fields.vector("axes")?, fields.vector("axes")?, fields.vector("axes")?];
        let centre = fields.vector("position")?;
        let region = Region { offset: fields.three("sub-volume's start")?, size: fields.three("sub-volume's size")? };
        let bytes = fields.0.to_vec();
        let mut image = Image { device, time, size, region, scalar, components, coordinates, axes, centre, bytes };
        image.check()?;
        if endian == BIG && scalar.bytes() > 1 {
            image.bytes.chunks_exact_mut(scalar.bytes()).for_each(<[u8]>::reverse);
        }
        Ok(image)
    }

    /// Checks that the sizes agree with each other and with the samples.
    fn check(&self) -> Result<(), Fault> {
        let Region { offset, size } = self.region;
        if self.size.contains(&0) {
            let [i, j, k] = self.size;
            return Err(Fault::new("size", format!("is {i} x {j} x {k}, each must be 1 to 65535")));
        }
        for axis in 0..3 {
            let (start, count, whole) = (u32::from(offset[axis]), u32::from(size[axis]), u32::from(self.size[axis]));
            let (end, name) = (start + count, ["i", "j", "k"][axis]);
            if count == 0 || end > whole {
                let fault = format!("covers {start} to {end} of {whole} pixels along {name}, must lie within");
                return Err(Fault::new("sub-volume", fault));
            }
        }
        // Cannot overflow: each below 2^16, at most 255 components of 8 bytes.
        let pixels: u64 = size.iter().map(|n| u64::from(*n)).product();
        let bytes = pixels * u64::from(self.components) * self.scalar.bytes() as u64;
        match self.bytes.len() as u64 == bytes {
            true => Ok(()),
            false => Err(Fault::new("samples", format!("are {} bytes, must be {bytes}", self.bytes.len()))),
        }
    }

    fn write(&self, content: &mut Vec<u8>) -> Result<(), Fault> {
        if self.components == 0 {
            return Err(Fault::new("components", "is 0, must be 1 to 255"));
        }
        if let Some(value) = self.axes.iter().flatten().chain(&self.centre).find(|v| !v.is_finite()) {
            return Err(Fault::new("axes and position", format!("have {value}, must be finite")));
        }
        self.check()?;
        let scalar = SCALARS.iter().find(|(_, s)| *s == self.scalar).map_or(0, |(number, _)| *number);
        let coordinates = if self.coordinates == Coordinates::Ras { 1 } else { 2 };
        content.extend(IMAGE_VERSION.to_be_bytes());
        content.extend([self.components, scalar, LITTLE, coordinates]);
        content.extend(self.size.iter().flat_map(|v| v.to_be_bytes()));
        content.extend(self.axes.iter().flatten().chain(&self.centre).flat_map(|v| v.to_be_bytes()));
        content.extend(self.region.offset.iter().chain(&self.region.size).flat_map(|v| v.to_be_bytes()));
        content.extend_from_slice(&self.bytes);
        Ok(())
    }
}

/// Length of a header, bytes: version, type, device, time stamp, body size, checksum (header.md of the protocol's documents).
pub const HEADER: usize = 58;
/// Length of an extended header as the reference library writes it, bytes. Later versions may have a longer one.
const EXTENDED: usize = 12;
/// Time stamps are fixed-point: u32 seconds since 1970, and this many ticks in a second (timestamp.md).
const TICKS: f64 = 4_294_967_296.0;

struct Header {
    version: u16,
    kind: String,
    device: String,
    /// Since 1970-01-01 00:00 UTC, s; 0: not stamped.
    time: f64,
    /// Bytes.
    body: u64,
    crc: u64,
}

impl Header {
    fn read(bytes: &[u8; HEADER]) -> Result<Header, Fault> {
        let mut fields = Fields(bytes);
        Ok(Header {
            version: fields.u16("version")?,
            kind: fields.name::<12>("type")?,
            device: fields.name::<20>("device")?,
            time: seconds(fields.u32("time stamp")?, fields.u32("time stamp")?),
            body: fields.u64("body size")?,
            crc: fields.u64("checksum")?,
        })
    }

    /// Length of the body, if this is a valid header.
    fn accepted(&self, limit: usize) -> Result<usize, Fault> {
        if !(1..=3).contains(&self.version) {
            return Err(Fault::new("version", format!("is {}, must be 1 to 3", self.version)));
        }
        match usize::try_from(self.body) {
            Ok(body) if body <= limit => Ok(body),
            _ => Err(Fault::new("body size", format!("is {} bytes, must be at most {limit}", self.body))),
        }
    }

    /// The content: the body without what versions 2 and 3 add, an extended header before it and metadata after it.
    fn content<'a>(&self, body: &'a [u8]) -> Result<&'a [u8], Fault> {
        if self.version == 1 {
            return Ok(body);
        }
        let mut fields = Fields(body);
        let extended = usize::from(fields.u16("extended header size")?);
        let keys = usize::from(fields.u16("metadata header size")?);
        let values = fields.u32("metadata size")?;
        fields.u32("message ID")?;
        if extended < EXTENDED || extended > body.len() {
            let fault = format!("is {extended} bytes, must be {EXTENDED} to {}", body.len());
            return Err(Fault::new("extended header size", fault));
        }
        let left = body.len() - extended;
        match usize::try_from(values).ok().and_then(|v| v.checked_add(keys)) {
            Some(metadata) if metadata <= left => Ok(&body[extended..body.len() - metadata]),
            _ => {
                let fault = format!("is {keys} + {values} bytes with its header, must be at most {left}");
                Err(Fault::new("metadata size", fault))
            }
        }
    }
}

/// A time stamp in seconds, below 2^32. An f64 of this century keeps 0.24 microseconds.
fn seconds(whole: u32, fraction: u32) -> f64 {
    // The largest stamp would round up to 2^32.
    (f64::from(whole) + f64::from(fraction) / TICKS).min(TICKS.next_down())
}

/// Seconds as a time stamp, if it can represent them; the inverse of [`seconds`].
fn stamp(time: f64) -> Option<(u32, u32)> {
    (0.0..TICKS).contains(&time).then(|| (time as u32, (time.fract() * TICKS) as u32))
}

struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn array<const N: usize>(&mut self, field: &'static str) -> Result<[u8; N], Fault> {
        let Some((head, rest)) = self.0.split_first_chunk() else {
            return Err(Fault::new(field, format!("is cut short: {} of {N} bytes are there", self.0.len())));
        };
        self.0 = rest;
        Ok(*head)
    }

    fn u8(&mut self, field: &'static str) -> Result<u8, Fault> {
        self.array(field).map(u8::from_be_bytes)
    }

    fn u16(&mut self, field: &'static str) -> Result<u16, Fault> {
        self.array(field).map(u16::from_be_bytes)
    }

    fn u32(&mut self, field: &'static str) -> Result<u32, Fault> {
        self.array(field).map(u32::from_be_bytes)
    }

    fn u64(&mut self, field: &'static str) -> Result<u64, Fault> {
        self.array(field).map(u64::from_be_bytes)
    }

    fn three(&mut self, field: &'static str) -> Result<[u16; 3], Fault> {
        Ok([self.u16(field)?, self.u16(field)?, self.u16(field)?])
    }

    /// A finite number.
    fn f32(&mut self, field: &'static str) -> Result<f32, Fault> {
        match self.array(field).map(f32::from_be_bytes)? {
            value if value.is_finite() => Ok(value),
            value => Err(Fault::new(field, format!("is {value}, must be finite"))),
        }
    }

    fn vector(&mut self, field: &'static str) -> Result<[f32; 3], Fault> {
        Ok([self.f32(field)?, self.f32(field)?, self.f32(field)?])
    }

    /// The upper three rows of a 4 x 4 matrix, which is stored column by column (transform.md).
    fn matrix(&mut self) -> Result<[[f32; 4]; 3], Fault> {
        let mut rows = [[0.0; 4]; 3];
        for column in 0..4 {
            for (row, value) in rows.iter_mut().zip(self.vector("matrix")?) {
                row[column] = value;
            }
        }
        Ok(rows)
    }

    fn name<const N: usize>(&mut self, field: &'static str) -> Result<String, Fault> {
        self.array::<N>(field).map(|bytes| until_nul(&bytes))
    }
}

/// Text up to the first zero byte. The format requires ASCII; bytes that are not UTF-8 become U+FFFD.
fn until_nul(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// Polynomial 0x42F0E1EBA9EA3693, initially 0, nothing reflected or inverted: ECMA-182's, which OpenIGTLink's header.md
/// names. Sixteen bytes at a time, because images arrive at tens of megabytes per second.
static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_ECMA_182);

/// CRC-64/ECMA-182 of the body of a message: everything after the 58 bytes of the header.
pub fn crc64(body: &[u8]) -> u64 {
    CRC.checksum(body)
}

/// Longest part of an error, characters.
const MAX_PART: usize = 300;

/// What is wrong with a message, as one line: the message, the field, its value and what is allowed.
///
/// Everything that comes from the peer is escaped and shortened, so that it cannot send control characters to a terminal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}: {field}: {fault}")]
pub struct MessageError {
    message: String,
    field: &'static str,
    fault: String,
}

impl MessageError {
    fn new(kind: &str, device: &str, fault: Fault) -> MessageError {
        let message = format!("{} from {}", escaped(kind, MAX_PART), quoted(device));
        MessageError { message, field: fault.field, fault: escaped(&fault.fault, MAX_PART) }
    }
}

/// Why bytes are not a message, and where the next message begins if that is known.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The checksum of the body is wrong. The next message begins after `length` bytes.
    #[error("{error}")]
    Checksum { length: usize, error: MessageError },
    /// The body is invalid for its type. The next message begins after `length` bytes.
    #[error("{error}")]
    Content { length: usize, error: MessageError },
    /// The bytes are no header, or one of another version or with too large a body. The format has no marks of message boundaries, so that the
    /// stream cannot be resynchronised and the connection has to be renewed.
    #[error("{error}; the stream cannot be re-synchronised")]
    Framing { error: MessageError },
}

/// An error of a field, before its message is known.
struct Fault {
    field: &'static str,
    fault: String,
}

impl Fault {
    fn new(field: &'static str, fault: impl Into<String>) -> Fault {
        Fault { field, fault: fault.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_survive_a_round_trip() {
        for (whole, fraction) in [(0, 0), (0, 1), (1, u32::MAX), (1_700_000_000, 1 << 30), (u32::MAX, u32::MAX)] {
            let time = seconds(whole, fraction);
            let (w, f) = stamp(time).expect("a stamp");
            assert_eq!(seconds(w, f), time, "{whole} {fraction}");
        }
        assert_eq!(seconds(1_700_000_000, 1 << 30), 1_700_000_000.25);
        assert_eq!(stamp(3.5), Some((3, 1 << 31)));
        for none in [-1.0, TICKS, f64::NAN, f64::INFINITY] {
            assert_eq!(stamp(none), None);
        }
    }

    #[test]
    fn the_catalogue_s_check_value_comes_out() {
        assert_eq!(crc64(b"123456789"), 0x6c40_df5f_0b49_7347);
        assert_eq!(crc64(b""), 0);
    }
}
