//! The checksum of a body.

use crc::{CRC_64_ECMA_182, Crc, Table};

/// Polynomial 0x42F0E1EBA9EA3693, initially 0, nothing reflected or inverted: ECMA-182's, which OpenIGTLink's header.md
/// names. Sixteen bytes at a time: images come at tens of megabytes per second.
static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_ECMA_182);

/// CRC-64/ECMA-182 of a message's body: everything behind the 58 bytes of the header.
pub fn crc64(body: &[u8]) -> u64 {
    CRC.checksum(body)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_catalogue_s_check_value_comes_out() {
        assert_eq!(super::crc64(b"123456789"), 0x6c40_df5f_0b49_7347);
        assert_eq!(super::crc64(b""), 0);
    }
}
