//! Big-endian fields, taken one after the other from bytes that may end anywhere.

use super::error::Fault;

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

    /// A finite number: whatever is reckoned with one that is not places nothing.
    pub fn f32(&mut self, field: &'static str) -> Result<f32, Fault> {
        match self.array(field).map(f32::from_be_bytes)? {
            value if value.is_finite() => Ok(value),
            value => Err(Fault::new(field, format!("is {value}, must be finite"))),
        }
    }

    pub fn vector(&mut self, field: &'static str) -> Result<[f32; 3], Fault> {
        Ok([self.f32(field)?, self.f32(field)?, self.f32(field)?])
    }

    /// The upper three rows of a 4 x 4 matrix, which comes column by column (transform.md).
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

/// Text up to the first zero byte. The format asks for ASCII; what is not even UTF-8 becomes U+FFFD.
pub(super) fn until_nul(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}
