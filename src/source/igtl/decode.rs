//! From bytes to a message. Any bytes give one, a number of bytes that are still missing, or a fault.

use super::crc::crc64;
use super::error::{DecodeError, Fault, MessageError};
use super::fields::{Fields, until_nul};
use super::header::{HEADER, Header};
use super::image::Image;
use super::message::{Message, Other, Status, Text, Tool, ToolKind, TrackingData, Transform};

/// The largest body that is accepted unless asked otherwise, bytes.
pub const BODY_LIMIT: usize = 256 << 20;
/// Bytes of a tool in TDATA.
const TOOL: usize = 70;
/// IANA's number of ISO-8859-1, a STRING's encoding.
const LATIN_1: u16 = 4;

/// What bytes gave.
#[derive(Clone, Debug, PartialEq)]
pub enum Decoded {
    /// At least so many bytes are missing; 1 or more.
    Need(usize),
    /// The next message begins `length` bytes on.
    Message { message: Message, length: usize },
}

/// The message at the start of `bytes`.
///
/// `limit`: the largest body, bytes. A larger claim is refused as soon as its header is there, and nothing is allocated
/// before the whole body is: never more than the bytes that came.
///
/// # Errors
/// [`DecodeError`] says what is wrong in one line, and how many bytes to skip if the next message can be found.
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
            nothing_behind(&fields, content)?;
            Message::Transform(Transform { device, time, matrix })
        }
        "TDATA" => {
            if !content.len().is_multiple_of(TOOL) {
                return Err(Fault::new("tools", format!("are {} bytes, must be {TOOL} each", content.len())));
            }
            let tools = content.chunks_exact(TOOL).map(tool).collect::<Result<_, _>>()?;
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

fn nothing_behind(fields: &Fields, content: &[u8]) -> Result<(), Fault> {
    match fields.0.len() {
        0 => Ok(()),
        more => Err(Fault::new("content", format!("is {} bytes, must be {}", content.len(), content.len() - more))),
    }
}
