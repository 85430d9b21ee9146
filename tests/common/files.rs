//! Stored test data, and temporary folders.

use std::collections::BTreeSet;
use std::fs;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

pub const SWEEP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/wobbler-4dc7/sweep.mha");
/// The same sweep as a Kretz volume.
pub const KRETZ: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/wobbler-4dc7/sweep.vol");
pub const BONE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bone-l14/bone.mha");
/// A probe file with a `[motor]` table.
pub const MOTOR_PROBE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/motor/probe.toml");

/// A file or folder, named from the top of the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A file below tests/data.
pub fn data(name: &str) -> PathBuf {
    repository("tests/data").join(name)
}

/// A temporary folder; it is removed when dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Folder {
        // Two tests may choose the same name.
        static CREATED: AtomicU32 = AtomicU32::new(0);
        let n = CREATED.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("echolume-{}-{n}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("create the temporary folder");
        Folder(path)
    }

    /// The path of a file in it, as an argument of the program.
    pub fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("the temporary folder has a plain name").to_string()
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        fs::write(self.0.join(name), bytes).expect("write a file of the test");
        self.path(name)
    }

    /// The names of the files and folders in it.
    pub fn names(&self) -> BTreeSet<String> {
        let entries = fs::read_dir(&self.0).expect("list the test's folder").map(|e| e.expect("read an entry"));
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect()
    }
}

impl Deref for Folder {
    type Target = Path;
    fn deref(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
