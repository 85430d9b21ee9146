//! Decodes and encodes messages. Any bytes decode to a message, the number of missing bytes, or an error.

use super::message::{Image, Message, Other, Status, Text, Tool, ToolKind, TrackingData, Transform};
use super::wire::{DecodeError, EXTENDED, Fault, Fields, HEADER, Header, MessageError, crc64, stamp, until_nul};

/// Default limit of the body, bytes.
pub const BODY_LIMIT: usize = 256 << 20;
/// Length of a tool in TDATA, bytes.
const TOOL_BYTES: usize = 70;
/// IANA's number of ISO-8859-1, a STRING's encoding.
const LATIN_1: u16 = 4;

/// The result of decoding.
#[derive(Clone, Debug, PartialEq)]
pub enum Decoded {
    /// At least so many bytes are missing, 1 or more.
    Need(usize),
    /// A message; the next one begins after `length` bytes.
    Message { message: Message, length: usize },
}

/// Decodes the message at the start of `bytes`.
///
/// `limit`: the largest body, bytes. A larger one is refused as soon as its header is complete. Nothing is allocated before the whole
/// body is available, and never more than its bytes.
///
/// # Errors
/// [`DecodeError`]: what is wrong, and how many bytes to skip if the next message can be found.
pub fn decode(bytes: &[u8], limit: usize) -> Result<Decoded, DecodeError> {
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
    if crc != header.crc {
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
    let Some(kind) = ToolKind::read(number) else {
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

/// Version of the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// Every peer reads it.
    V1,
    /// With an extended header and empty metadata.
    V2,
}

/// IANA's numbers of a STRING's encodings.
const ASCII: u16 = 3;
const UTF_8: u16 = 106;

/// Encodes a message. For simulated devices and tests.
///
/// # Errors
/// A field that the format cannot represent (a name that is too long or has zero bytes, a time before 1970 or after 2106, a
/// number that is not finite, sizes that disagree with the samples), or [`Message::Other`], whose body was not kept.
pub fn encode(message: &Message, version: Version) -> Result<Vec<u8>, MessageError> {
    let error = |fault| MessageError::new(message.kind(), message.device(), fault);
    let mut bytes = vec![0; HEADER];
    write(message, version, &mut bytes).map_err(error)?;
    let (whole, fraction) = stamp(message.time()).ok_or_else(|| {
        error(Fault::new("time stamp", format!("is {} s, must be at least 0 and below 2^32", message.time())))
    })?;
    let number: u16 = if version == Version::V1 { 1 } else { 2 };
    let mut head = number.to_be_bytes().to_vec();
    name(&mut head, "type", message.kind(), 12).map_err(error)?;
    name(&mut head, "device", message.device(), 20).map_err(error)?;
    head.extend(whole.to_be_bytes());
    head.extend(fraction.to_be_bytes());
    head.extend(((bytes.len() - HEADER) as u64).to_be_bytes());
    head.extend(crc64(&bytes[HEADER..]).to_be_bytes());
    bytes[..HEADER].copy_from_slice(&head);
    Ok(bytes)
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
                body.extend([tool.kind.number(), 0]);
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
