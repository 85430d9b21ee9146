//! The 58 bytes before every body, and the extended header within the bodies of versions 2 and 3.

use super::error::Fault;
use super::fields::Fields;

/// Bytes of a header: version, type, device, time stamp, body size, checksum (header.md).
pub const HEADER: usize = 58;
/// Bytes of an extended header as the reference library writes it; a longer one may follow in later versions.
pub(super) const EXTENDED: usize = 12;
/// Time stamps are fixed-point: u32 seconds since 1970, and so many parts of a second (timestamp.md).
const PARTS: f64 = 4_294_967_296.0;

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

    /// Bytes of the body, if this can be a header.
    pub fn accepted(&self, limit: usize) -> Result<usize, Fault> {
        if !(1..=3).contains(&self.version) {
            return Err(Fault::new("version", format!("is {}, must be 1 to 3", self.version)));
        }
        match usize::try_from(self.body) {
            Ok(body) if body <= limit => Ok(body),
            _ => Err(Fault::new("body size", format!("is {} bytes, must be at most {limit}", self.body))),
        }
    }

    /// The body less what versions 2 and 3 put around the content: extended header before it, metadata behind it.
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
    // The last of all stamps would round up to what none can hold.
    (f64::from(whole) + f64::from(fraction) / PARTS).min(PARTS.next_down())
}

/// Seconds as a time stamp, if one can hold them; the inverse of [`seconds`].
pub(super) fn stamp(time: f64) -> Option<(u32, u32)> {
    (0.0..PARTS).contains(&time).then(|| (time as u32, (time.fract() * PARTS) as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_survive_the_way_there_and_back() {
        for (whole, fraction) in [(0, 0), (0, 1), (1, u32::MAX), (1_700_000_000, 1 << 30), (u32::MAX, u32::MAX)] {
            let time = seconds(whole, fraction);
            let (w, f) = stamp(time).expect("a stamp");
            assert_eq!(seconds(w, f), time, "{whole} {fraction}");
        }
        assert_eq!(seconds(1_700_000_000, 1 << 30), 1_700_000_000.25);
        assert_eq!(stamp(3.5), Some((3, 1 << 31)));
        for none in [-1.0, PARTS, f64::NAN, f64::INFINITY] {
            assert_eq!(stamp(none), None);
        }
    }
}
