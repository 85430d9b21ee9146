//! From a message to bytes: for simulated devices and tests.

use super::crc::crc64;
use super::error::{Fault, MessageError};
use super::header::{EXTENDED, HEADER, stamp};
use super::message::Message;

/// Version of the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// What every peer reads.
    V1,
    /// With an extended header and empty metadata.
    V2,
}

/// IANA's numbers of a STRING's encodings.
const ASCII: u16 = 3;
const UTF_8: u16 = 106;

/// The bytes of a message, as [`decode`](super::decode) reads them.
///
/// # Errors
/// A field that the format cannot hold (a name that is too long or has zero bytes, a time before 1970 or after 2106, a
/// number that is not finite, sizes that disagree with the samples), or a message of another type, whose body was not kept.
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
    // A count of metadata even if there are none: the reference library reads it without looking at its size.
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
