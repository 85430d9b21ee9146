//! SHA-256 digests of bytes, files and recordings.

use sha2::{Digest, Sha256};
use std::collections::HashSet;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Bytes as lower-case hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// SHA-256 of bytes, as `sha256sum` prints it.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// SHA-256 and length of a file, in bounded memory.
///
/// # Errors
/// The file cannot be read.
pub fn sha256_of_file(path: &Path) -> io::Result<(String, u64)> {
    let (mut file, mut digest, mut length) = (File::open(path)?, Sha256::new(), 0);
    let mut part = vec![0; 1 << 16];
    loop {
        let read = match file.read(&mut part) {
            Ok(0) => return Ok((hex(&digest.finalize()), length)),
            Ok(read) => read,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
            Err(e) => return Err(e),
        };
        digest.update(&part[..read]);
        length += read as u64;
    }
}

/// SHA-256 of a recording, and the length of its files in bytes. For a recording of several files (samples apart from the header, a probe file) it
/// is the SHA-256 of their digests in hexadecimal, one a line, in the order of `files`. A path that is listed twice counts once.
///
/// # Errors
/// One line that names the file.
pub fn digest_of(files: &[PathBuf]) -> Result<(String, u64), String> {
    let mut seen = HashSet::new();
    let (mut digests, mut bytes) = (Vec::new(), 0);
    for file in files.iter().filter(|file| seen.insert(*file)) {
        let (digest, length) = sha256_of_file(file).map_err(|e| format!("{}: cannot be read: {e}", file.display()))?;
        digests.push(digest);
        bytes += length;
    }
    match digests.as_slice() {
        [one] => Ok((one.clone(), bytes)),
        several => {
            let lines: String = several.iter().map(|digest| format!("{digest}\n")).collect();
            Ok((sha256(lines.as_bytes()), bytes))
        }
    }
}
