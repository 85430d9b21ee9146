//! Many recordings, each a unit of work: rendered, converted, measured or verified. A process does one shard of the manifest; Slurm, Kubernetes or
//! GNU parallel starts the processes.
//!
//! - [`manifest`] is the list of units, [`make`] writes it from files and folders. [`shard`] divides it.
//! - [`unit`] is the command of a unit, and the key of its outputs: a hash of what determines them.
//! - [`reading`] reads a unit's recording, on a thread of its own. [`painter`] draws, with one device and one renderer. [`work`] runs a shard.
//! - [`results`] is what is stored of a unit. [`agreement`] compares pictures of two devices, [`comparisons`] counts them. [`report`] is the page.
//!
//! A unit is done when its record exists, which is written after its outputs. If a process is killed, a later one does what is left. Two processes
//! that do the same unit write the same bytes.

pub mod agreement;
pub mod comparisons;
pub mod make;
pub mod manifest;
pub(crate) mod painter;
mod progress;
pub(crate) mod reading;
pub mod report;
pub mod results;
pub mod shard;
pub mod unit;
pub mod work;

use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Bytes as lower-case hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// SHA-256 of bytes as hexadecimal digits, as `sha256sum` prints it.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// SHA-256 (hexadecimal digits) and length (bytes) of a file, which is read in parts.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn sha256_of_file(path: &Path) -> io::Result<(String, u64)> {
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

/// SHA-256 of a recording, and the length of its files in bytes. For a recording of several files (samples apart from the header, a probe file)
/// it is the hash of their digests, one a line.
///
/// # Errors
/// One line that names the file that cannot be read.
pub(crate) fn digest_of(files: &[PathBuf]) -> Result<(String, u64), String> {
    let mut seen: Vec<&PathBuf> = Vec::new();
    let (mut digests, mut bytes) = (Vec::new(), 0);
    for file in files {
        if seen.contains(&file) {
            continue;
        }
        seen.push(file);
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
