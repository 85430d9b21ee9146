//! The parts that all messages have in common: the header of 58 bytes, big-endian fields, the checksum, and their errors.

use crate::files::{escaped, quoted};
use crc::{CRC_64_ECMA_182, Crc, Table};

/// Length of a header, bytes: version, type, device, time stamp, body size, checksum (header.md).
pub const HEADER: usize = 58;
/// Length of an extended header as the reference library writes it, bytes. Later versions may have a longer one.
pub(super) const EXTENDED: usize = 12;
/// Time stamps are fixed-point: u32 seconds since 1970, and this many ticks in a second (timestamp.md).
const TICKS: f64 = 4_294_967_296.0;

pub(super) struct Header {
    pub version: u16,
    pub kind: String,
    pub device: String,
    /// Since 1970-01-01 00:00 UTC, s; 0: not stamped.
    pub time: f64,
    /// Bytes.
    pub body: u64,
    pub crc: u64,
}

impl Header {
    pub fn read(bytes: &[u8; HEADER]) -> Result<Header, Fault> {
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
    pub fn accepted(&self, limit: usize) -> Result<usize, Fault> {
        if !(1..=3).contains(&self.version) {
            return Err(Fault::new("version", format!("is {}, must be 1 to 3", self.version)));
        }
        match usize::try_from(self.body) {
            Ok(body) if body <= limit => Ok(body),
            _ => Err(Fault::new("body size", format!("is {} bytes, must be at most {limit}", self.body))),
        }
    }

    /// The content: the body without what versions 2 and 3 add, an extended header before it and metadata after it.
    pub fn content<'a>(&self, body: &'a [u8]) -> Result<&'a [u8], Fault> {
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
pub(super) fn seconds(whole: u32, fraction: u32) -> f64 {
    // The largest stamp would round up to 2^32.
    (f64::from(whole) + f64::from(fraction) / TICKS).min(TICKS.next_down())
}

/// Seconds as a time stamp, if it can represent them; the inverse of [`seconds`].
pub(super) fn stamp(time: f64) -> Option<(u32, u32)> {
    (0.0..TICKS).contains(&time).then(|| (time as u32, (time.fract() * TICKS) as u32))
}

pub(super) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    pub fn array<const N: usize>(&mut self, field: &'static str) -> Result<[u8; N], Fault> {
        let Some((head, rest)) = self.0.split_first_chunk() else {
            return Err(Fault::new(field, format!("is cut short: {} of {N} bytes are there", self.0.len())));
        };
        self.0 = rest;
        Ok(*head)
    }

    pub fn u8(&mut self, field: &'static str) -> Result<u8, Fault> {
        self.array(field).map(u8::from_be_bytes)
    }

    pub fn u16(&mut self, field: &'static str) -> Result<u16, Fault> {
        self.array(field).map(u16::from_be_bytes)
    }

    pub fn u32(&mut self, field: &'static str) -> Result<u32, Fault> {
        self.array(field).map(u32::from_be_bytes)
    }

    pub fn u64(&mut self, field: &'static str) -> Result<u64, Fault> {
        self.array(field).map(u64::from_be_bytes)
    }

    pub fn three(&mut self, field: &'static str) -> Result<[u16; 3], Fault> {
        Ok([self.u16(field)?, self.u16(field)?, self.u16(field)?])
    }

    /// A finite number.
    pub fn f32(&mut self, field: &'static str) -> Result<f32, Fault> {
        match self.array(field).map(f32::from_be_bytes)? {
            value if value.is_finite() => Ok(value),
            value => Err(Fault::new(field, format!("is {value}, must be finite"))),
        }
    }

    pub(crate) fn vector(&mut self, field: &'static str) -> Result<[f32; 3], Fault> {
        Ok([self.f32(field)?, self.f32(field)?, self.f32(field)?])
    }

    /// The upper three rows of a 4 x 4 matrix, which is stored column by column (transform.md).
    pub fn matrix(&mut self) -> Result<[[f32; 4]; 3], Fault> {
        let mut rows = [[0.0; 4]; 3];
        for column in 0..4 {
            for (row, value) in rows.iter_mut().zip(self.vector("matrix")?) {
                row[column] = value;
            }
        }
        Ok(rows)
    }

    pub fn name<const N: usize>(&mut self, field: &'static str) -> Result<String, Fault> {
        self.array::<N>(field).map(|bytes| until_nul(&bytes))
    }
}

/// Text up to the first zero byte. The format requires ASCII; bytes that are not UTF-8 become U+FFFD.
pub(super) fn until_nul(bytes: &[u8]) -> String {
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

/// An error of a message: one line with the message, the field, its value and what is allowed.
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
    pub(super) fn new(kind: &str, device: &str, fault: Fault) -> MessageError {
        let message = format!("{} from {}", escaped(kind, MAX_PART), quoted(device));
        MessageError { message, field: fault.field, fault: escaped(&fault.fault, MAX_PART) }
    }

    pub fn field(&self) -> &str {
        self.field
    }

    pub fn fault(&self) -> &str {
        &self.fault
    }
}

/// Why bytes are not a message, and where the next message begins.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The checksum of the body is wrong. The next message begins after `length` bytes.
    #[error("{error}")]
    Checksum { length: usize, error: MessageError },
    /// The body is invalid for its type. The next message begins after `length` bytes.
    #[error("{error}")]
    Content { length: usize, error: MessageError },
    /// These bytes are no header. The format has no marks of message boundaries, so the stream cannot be re-synchronised and the
    /// connection has to be renewed.
    #[error("{error}; the stream cannot be re-synchronised")]
    Framing { error: MessageError },
}

impl DecodeError {
    pub fn error(&self) -> &MessageError {
        match self {
            DecodeError::Checksum { error, .. }
            | DecodeError::Content { error, .. }
            | DecodeError::Framing { error } => error,
        }
    }
}

/// An error of a field, before its message is known.
pub(super) struct Fault {
    pub field: &'static str,
    pub fault: String,
}

impl Fault {
    pub fn new(field: &'static str, fault: impl Into<String>) -> Fault {
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
}

#[cfg(test)]
mod crc_tests {
    #[test]
    fn the_catalogue_s_check_value_comes_out() {
        assert_eq!(super::crc64(b"123456789"), 0x6c40_df5f_0b49_7347);
        assert_eq!(super::crc64(b""), 0);
    }
}
