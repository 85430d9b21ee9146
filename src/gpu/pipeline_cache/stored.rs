//! The file of a pipeline cache: a header that identifies its device, driver and shaders, and the driver's data. Drivers trust the data
//! that they are given, so a file is used only if it is complete, unchanged, and of the same device, driver and shaders. Any other file is
//! ignored, and replaced when the program ends.

use crate::files;
use crate::spirv;
use crc::{CRC_64_ECMA_182, Crc, Table};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Largest file, bytes. Constants such as window sizes make pipelines of their own, so that a cache may grow for as long as it is used.
const MAX_BYTES: u64 = 64 << 20;
/// Files that a folder keeps. A driver that is updated begins another one.
const MAX_FILES: usize = 8;
/// An unfinished file of this age belongs to a program that was killed.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);
const EXTENSION: &str = "pipelines";
const MAGIC: [u8; 8] = *b"echopipe";
const VERSION: u32 = 1;
/// Bytes before the data.
const HEADER: usize = 8 + 4 * 4 + 16 + 8 + 8 + 8;
/// Bytes of the header that Vulkan requires of the data itself: its length, its version, vendor, device, UUID.
const VULKAN_HEADER: usize = 4 * 4 + 16;
/// VK_PIPELINE_CACHE_HEADER_VERSION_ONE.
const VULKAN_VERSION: u32 = 1;

static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_ECMA_182);

/// The CRC-64 (ECMA-182) of some bytes.
pub fn checksum(data: &[u8]) -> u64 {
    CRC.checksum(data)
}

/// Identity of the device and driver that a stored cache belongs to; others cannot use it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DriverIdentity {
    pub vendor: u32,
    pub device: u32,
    pub(crate) driver_version: u32,
    /// pipelineCacheUUID of the driver. It changes when the format of the stored data changes.
    pub(crate) uuid: [u8; 16],
}

impl DriverIdentity {
    fn file_name(&self) -> String {
        let uuid: String = self.uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        format!("{:04x}-{:04x}-{:08x}-{uuid}.{EXTENSION}", self.vendor, self.device, self.driver_version)
    }
}

/// The file of a driver's pipeline cache, in a folder that need not exist.
#[derive(Clone, Debug)]
pub(crate) struct CacheFile {
    pub path: PathBuf,
    identity: DriverIdentity,
    /// Of the embedded shaders. The pipelines of other ones would stay in the file for ever.
    shaders: u64,
}

impl CacheFile {
    pub fn new(folder: &Path, identity: &DriverIdentity) -> CacheFile {
        let shaders = checksum(spirv::SOURCES.as_bytes());
        CacheFile { path: folder.join(identity.file_name()), identity: identity.clone(), shaders }
    }

    /// Reads the driver's data from the file. `None` if there is no file.
    ///
    /// # Errors
    /// Why the file cannot be used, in one line.
    pub fn read(&self) -> Result<Option<Vec<u8>>, String> {
        if !self.path.exists() {
            return Ok(None);
        }
        let bytes = files::read(&self.path, MAX_BYTES + HEADER as u64, "pipeline cache")?;
        self.decode(&bytes).map(|data| Some(data.to_vec()))
    }

    /// Replaces the file, and removes the oldest files if the folder has too many. Data that is too large removes the file instead, and the next
    /// program begins with an empty cache.
    ///
    /// # Errors
    /// The folder or the disk cannot be written, or the data is too large.
    pub fn write(&self, data: &[u8]) -> Result<(), String> {
        if data.len() as u64 > MAX_BYTES {
            let _ = std::fs::remove_file(&self.path);
            return Err(format!("{} bytes are more than {MAX_BYTES}: it begins anew", data.len()));
        }
        let folder = self.path.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: cannot be made: {e}", folder.display()))?;
        files::replace(&self.path, &self.encode(data))?;
        self.tidy(folder);
        Ok(())
    }

    fn encode(&self, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + data.len());
        bytes.extend(MAGIC);
        for number in [VERSION, self.identity.vendor, self.identity.device, self.identity.driver_version] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(self.identity.uuid);
        for number in [self.shaders, data.len() as u64, checksum(data)] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(data);
        bytes
    }

    fn decode<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], String> {
        let (header, data) = bytes.split_at_checked(HEADER).ok_or("is cut off in its header")?;
        // The data is last, so that all before it is the header of this device, driver, program and data.
        let expected = self.encode(data);
        let parts = [
            (0..12, "is not a pipeline cache of this format"),
            (12..40, "is of another device or driver"),
            (40..48, "is of other shaders"),
            (48..HEADER, "is damaged: its length or its checksum is wrong"),
        ];
        match parts.into_iter().find(|(range, _)| header[range.clone()] != expected[range.clone()]) {
            Some((_, why)) => Err(why.into()),
            None if !self.is_for_driver(data) => Err("has data of another device or driver".into()),
            None => Ok(data),
        }
    }

    /// True if data begins with Vulkan's own header, and that is of this device and driver.
    fn is_for_driver(&self, data: &[u8]) -> bool {
        let Some(header) = data.get(..VULKAN_HEADER) else { return false };
        let (numbers, uuid) = header.split_at(16);
        let numbers: Vec<u32> = numbers.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let is_long_enough = numbers[0] as usize >= VULKAN_HEADER && numbers[0] as usize <= data.len();
        is_long_enough
            && numbers[1..] == [VULKAN_VERSION, self.identity.vendor, self.identity.device]
            && uuid == self.identity.uuid
    }

    /// Removes the oldest caches beyond [`MAX_FILES`], and files that a killed program left.
    fn tidy(&self, folder: &Path) {
        let mut caches: Vec<(SystemTime, PathBuf)> = Vec::new();
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            let Ok(written) = entry.metadata().and_then(|about| about.modified()) else { continue };
            if name.starts_with(".echolume-") && name.ends_with(".part") {
                if written.elapsed().is_ok_and(|age| age > ABANDONED) {
                    let _ = std::fs::remove_file(path);
                }
            } else if path.extension().is_some_and(|e| e == EXTENSION) && path != self.path {
                caches.push((written, path));
            }
        }
        caches.sort();
        // This one stays.
        let surplus = (caches.len() + 1).saturating_sub(MAX_FILES);
        for (_, path) in caches.iter().take(surplus) {
            let _ = std::fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::WorkFolder;

    fn folder() -> WorkFolder {
        WorkFolder::new(&std::env::temp_dir(), "echolume-caches-").unwrap()
    }

    fn identity() -> DriverIdentity {
        DriverIdentity { vendor: 0x10de, device: 0x2684, driver_version: 0x0640_0007, uuid: *b"0123456789abcdef" }
    }

    /// What a driver hands out: Vulkan's header, then its own bytes.
    fn data(of: &DriverIdentity, more: &[u8]) -> Vec<u8> {
        let numbers = [VULKAN_HEADER as u32, VULKAN_VERSION, of.vendor, of.device];
        let header: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).chain(of.uuid).collect();
        [&header, more].concat()
    }

    #[test]
    fn what_was_written_is_read_back() {
        let folder = folder();
        let file = CacheFile::new(&folder.path().join("a/b"), &identity());
        assert_eq!(file.read(), Ok(None));
        for more in [vec![], vec![7; 100_000]] {
            file.write(&data(&identity(), &more)).unwrap();
            assert_eq!(file.read(), Ok(Some(data(&identity(), &more))));
        }
        let name = file.path.file_name().unwrap().to_string_lossy().into_owned();
        assert_eq!(name, "10de-2684-06400007-30313233343536373839616263646566.pipelines");
    }

    /// Any byte that is another, and any length that is shorter or longer: no driver is ever given such data.
    #[test]
    fn a_damaged_file_is_refused_wherever_the_damage_is() {
        let folder = folder();
        let file = CacheFile::new(folder.path(), &identity());
        file.write(&data(&identity(), &[1, 2, 3, 4, 5])).unwrap();
        let good = std::fs::read(&file.path).unwrap();
        assert_eq!(good.len(), HEADER + VULKAN_HEADER + 5);
        for at in 0..good.len() {
            for flipped in [1, 0x80, 0xff] {
                let mut bad = good.clone();
                bad[at] ^= flipped;
                std::fs::write(&file.path, bad).unwrap();
                assert!(file.read().is_err(), "byte {at} ^ {flipped:#x}");
            }
            std::fs::write(&file.path, &good[..at]).unwrap();
            assert!(file.read().is_err(), "{at} bytes");
        }
        std::fs::write(&file.path, [&good[..], &[0]].concat()).unwrap();
        assert!(file.read().is_err(), "one byte more");
        file.write(&data(&identity(), &[9])).unwrap();
        assert_eq!(file.read(), Ok(Some(data(&identity(), &[9]))));
    }

    /// A file that was copied or renamed, and data of another driver in a file that is complete.
    #[test]
    fn a_file_of_another_device_driver_or_program_is_refused() {
        let folder = folder();
        let ours = identity();
        let others = [
            DriverIdentity { vendor: 1, ..identity() },
            DriverIdentity { device: 1, ..identity() },
            DriverIdentity { driver_version: 1, ..identity() },
            DriverIdentity { uuid: [1; 16], ..identity() },
        ];
        let file = CacheFile::new(folder.path(), &ours);
        for other in &others {
            let theirs = CacheFile::new(folder.path(), other);
            assert_ne!(file.path, theirs.path);
            theirs.write(&data(other, &[1])).unwrap();
            std::fs::copy(&theirs.path, &file.path).unwrap();
            assert!(file.read().unwrap_err().contains("another device or driver"), "{other:?}");
            if other.driver_version == ours.driver_version {
                // The version is not in Vulkan's header.
                file.write(&data(other, &[1])).unwrap();
                assert!(file.read().unwrap_err().contains("data of another"), "{other:?}");
            }
        }
        let before = CacheFile { shaders: file.shaders ^ 1, ..file.clone() };
        before.write(&data(&ours, &[1])).unwrap();
        assert!(file.read().unwrap_err().contains("other shaders"));
        let long = [&[200, 0, 0, 0], &data(&ours, &[])[4..]].concat();
        file.write(&long).unwrap();
        assert!(file.read().is_err(), "a header longer than the data");
    }

    #[test]
    fn a_folder_keeps_the_newest_files_and_no_rubbish() {
        let folder = folder();
        let old = |path: &Path, days: u64| {
            let at = SystemTime::now() - Duration::from_secs(days * 24 * 3600);
            std::fs::File::options().write(true).open(path).unwrap().set_modified(at).unwrap();
        };
        let of = |version| {
            let identity = DriverIdentity { driver_version: version, ..identity() };
            CacheFile::new(folder.path(), &identity)
        };
        for version in 0..12 {
            let file = of(version);
            file.write(&data(&file.identity, &[])).unwrap();
            old(&file.path, u64::from(100 - version));
        }
        let parts = [".echolume-old.part", ".echolume-new.part", "foreign.txt"].map(|name| folder.path().join(name));
        for part in &parts {
            std::fs::write(part, "x").unwrap();
        }
        old(&parts[0], 2);
        let last = of(99);
        last.write(&data(&last.identity, &[])).unwrap();
        let left: Vec<bool> = (0..12).map(|version| of(version).path.exists()).collect();
        assert_eq!(left, (0..12).map(|version| version >= 12 - (MAX_FILES as u32 - 1)).collect::<Vec<_>>());
        assert!(last.path.exists());
        assert_eq!(parts.each_ref().map(|part| part.exists()), [false, true, true]);
    }

    #[test]
    fn a_cache_beyond_the_limit_begins_anew() {
        let folder = folder();
        let file = CacheFile::new(folder.path(), &identity());
        file.write(&data(&identity(), &[1])).unwrap();
        let large = data(&identity(), &vec![0; MAX_BYTES as usize]);
        assert!(file.write(&large).unwrap_err().contains("anew"));
        assert_eq!(file.read(), Ok(None));
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_an_error_and_no_panic() {
        let folder = folder();
        let blocked = folder.path().join("file");
        std::fs::write(&blocked, "x").unwrap();
        let file = CacheFile::new(&blocked.join("below"), &identity());
        assert_eq!(file.read(), Ok(None));
        assert!(file.write(&data(&identity(), &[])).is_err());
    }
}
