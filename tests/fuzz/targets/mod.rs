//! All parsers of external input, as functions of any bytes. Each must terminate without a panic. It returns a text that classifies
//! the outcome, so that the fuzzer recognises inputs with a new outcome.
//!
//! `tests/fuzz` runs them with mutated seeds, `tools/fuzz` under libFuzzer.

mod files;
mod kiosk;
mod motor;
mod network;
// Not the whole of `common`: tools/fuzz has this folder without the rest of the tests.
#[allow(dead_code)]
#[path = "../../common/probes.rs"]
mod probes;
mod reports;
mod scenes;
mod voxels;

use std::path::{Path, PathBuf};

pub struct Target {
    pub name: &'static str,
    pub run: fn(&[u8]) -> String,
    /// Seeds are lines of text: numbers and words are exchanged too.
    pub text: bool,
    /// Memory that it may use in addition to its input, bytes.
    pub memory: usize,
    /// Number of inputs if `FUZZ_SECONDS` is not set: about 0.3 s.
    pub rounds: u32,
    /// More seeds than those in `tests/fuzz/seeds/<name>`: files and folders from the top of the repository.
    pub also: &'static [&'static str],
}

const MIB: usize = 1 << 20;

pub const TARGETS: &[Target] = &[
    Target {
        name: "igtl",
        run: network::messages,
        text: false,
        memory: 16 * MIB,
        rounds: 18_750,
        also: &["tests/data/openigtlink"],
    },
    Target { name: "pairing", run: network::pairing, text: false, memory: 16 * MIB, rounds: 18_750, also: &[] },
    Target { name: "piped", run: network::piped, text: true, memory: 64 * MIB, rounds: 750, also: &[] },
    Target {
        name: "stream",
        run: files::stream,
        text: true,
        memory: 64 * MIB,
        rounds: 750,
        also: &["tests/fuzz/seeds/piped"],
    },
    Target { name: "frames", run: files::frames, text: true, memory: 64 * MIB, rounds: 5_000, also: &[] },
    Target {
        name: "metaimage",
        run: files::metaimage,
        text: true,
        memory: 64 * MIB,
        rounds: 6_250,
        also: &[
            "tests/data/wobbler-4dc7/sweep.mha",
            "tests/data/bone-l14/bone.mha",
            "tests/data/ultrasonix-curvilinear/brightness.mha",
        ],
    },
    Target { name: "tracked", run: files::tracked, text: true, memory: 64 * MIB, rounds: 750, also: &[] },
    Target {
        name: "kretz",
        run: files::kretz,
        text: false,
        memory: 64 * MIB,
        rounds: 12_500,
        also: &["tests/data/wobbler-4dc7/sweep.vol"],
    },
    // A chunk may be deflated a thousand times.
    Target { name: "uff", run: files::uff, text: false, memory: 512 * MIB, rounds: 1_500, also: &[] },
    Target {
        name: "dicom",
        run: files::dicom,
        text: false,
        memory: 64 * MIB,
        rounds: 2_000,
        also: &[
            "tests/data/dicom/enhanced.dcm",
            "tests/data/dicom/enhanced-big.dcm",
            "tests/data/dicom/enhanced-depth-z.dcm",
            "tests/data/dicom/enhanced-flow.dcm",
            "tests/data/dicom/enhanced-rle.dcm",
            "tests/data/dicom/image.dcm",
            "tests/data/dicom/image-j2k.dcm",
            "tests/data/dicom/image-lossless.dcm",
            "tests/data/dicom/colours-j2k.dcm",
            "tests/data/dicom/kretz.dcm",
            "tests/data/dicom/multiframe-fragments.dcm",
            "tests/data/dicom/multiframe-j2k-lossy.dcm",
            "tests/data/dicom/multiframe-jpeg.dcm",
            "tests/data/dicom/multiframe-lossless.dcm",
            "tests/data/dicom/palette.dcm",
            "tests/data/dicom/philips.dcm",
            "tests/data/dicom/planes.dcm",
            "tests/data/dicom/ybr-422.dcm",
            "tests/data/dicom/series",
        ],
    },
    Target {
        name: "nrrd",
        run: files::nrrd,
        text: true,
        memory: 64 * MIB,
        rounds: 6_250,
        also: &[
            "tests/data/formats/raw-ras.nrrd",
            "tests/data/formats/gzip-lps.nrrd",
            "tests/data/formats/bzip2-las.nrrd",
            "tests/data/formats/detached.nhdr",
        ],
    },
    Target {
        name: "nifti",
        run: files::nifti,
        text: false,
        memory: 64 * MIB,
        rounds: 6_250,
        also: &[
            "tests/data/formats/oblique.nii",
            "tests/data/formats/both.nii",
            "tests/data/formats/mirrored.nii.gz",
            "tests/data/formats/big-endian-4d.nii",
            "tests/data/formats/rgb.nii",
        ],
    },
    Target {
        name: "probe",
        run: motor::probe_file,
        text: true,
        memory: 64 * MIB,
        rounds: 10_000,
        also: &[
            "tests/data/motor/probe.toml",
            "tests/data/wobbler-4dc7/probe.toml",
            "tests/data/ultrasonix-curvilinear/probe.toml",
        ],
    },
    Target { name: "motor", run: motor::motor_table, text: true, memory: 64 * MIB, rounds: 8_750, also: &[] },
    Target { name: "tmcl", run: motor::replies, text: false, memory: MIB, rounds: 12_500, also: &[] },
    Target {
        name: "scene",
        run: scenes::scene_file,
        text: true,
        memory: 64 * MIB,
        rounds: 3_750,
        also: &["src/core/scene/presets"],
    },
    Target { name: "set", run: scenes::assignments, text: true, memory: 64 * MIB, rounds: 500, also: &[] },
    Target { name: "transfer", run: scenes::transfer_file, text: true, memory: 64 * MIB, rounds: 12_500, also: &[] },
    Target {
        name: "configuration",
        run: kiosk::configuration,
        text: true,
        memory: 64 * MIB,
        rounds: 3_750,
        also: &["tools/kiosk/echolume.toml"],
    },
    Target { name: "redacted", run: kiosk::redacted, text: true, memory: 64 * MIB, rounds: 7_500, also: &[] },
    Target { name: "verification", run: reports::verification, text: true, memory: 64 * MIB, rounds: 7_500, also: &[] },
    Target { name: "report", run: reports::error_report, text: true, memory: 64 * MIB, rounds: 7_500, also: &[] },
    Target { name: "worksheet", run: reports::worksheet, text: true, memory: 64 * MIB, rounds: 12_500, also: &[] },
    Target { name: "profile", run: reports::profile, text: true, memory: 64 * MIB, rounds: 12_500, also: &[] },
    // A header of some bytes may claim 512 MiB, which the system provides when they are written.
    // The pictures of a stack may be as large as others.
    Target {
        name: "stack",
        run: files::stack,
        text: true,
        memory: 2048 * MIB,
        rounds: 500,
        also: &["tests/fuzz/seeds/picture", "tests/fuzz/seeds/probe"],
    },
    Target { name: "picture", run: reports::picture, text: false, memory: 2048 * MIB, rounds: 625, also: &[] },
    Target { name: "compounder", run: voxels::compounder, text: false, memory: 64 * MIB, rounds: 1_500, also: &[] },
];

/// Writes bytes to a file and returns its path, in a folder of this process; the same for every input.
fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = folder();
    std::fs::create_dir_all(&folder).expect("a folder for inputs");
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("an input is written");
    path
}

/// The folder for inputs that must be files: FUZZ_FOLDER, or a folder of this process in memory if the system has one.
pub fn folder() -> PathBuf {
    if let Some(folder) = std::env::var_os("FUZZ_FOLDER") {
        return folder.into();
    }
    let memory = Path::new("/dev/shm");
    let under = if memory.is_dir() { memory.to_path_buf() } else { std::env::temp_dir() };
    under.join(format!("echolume-fuzz-{}", std::process::id()))
}

/// An error must be one line of bounded length without control characters.
fn told(error: impl std::fmt::Display) -> String {
    let line = error.to_string();
    assert!(!line.chars().any(char::is_control), "{line:?}");
    assert!(line.len() < 4000, "{} bytes: {line}", line.len());
    line
}

/// Bytes consumed in order as values of any type; 0 after the last.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn u8(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// At most this many: none after the last.
    fn take(&mut self, count: usize) -> &[u8] {
        let (taken, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        taken
    }

    /// Mostly a realistic number, sometimes an extreme one.
    fn number(&mut self) -> f64 {
        const EXTREME: [f64; 12] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            1e-9,
            1e6,
            -1e6,
            1e300,
            f64::MIN_POSITIVE,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
        ];
        match self.u8() {
            n @ 0..200 => (f64::from(n) - 100.0) / 16.0 + f64::from(self.u8()) / 4096.0,
            n @ 200..250 => EXTREME[usize::from(n) % EXTREME.len()],
            _ => f64::from_le_bytes(std::array::from_fn(|_| self.u8())),
        }
    }
}
