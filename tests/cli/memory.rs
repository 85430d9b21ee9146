//! A volume that takes more memory than may be is refused in one line before anything is allocated for it, whatever its format is.
#![cfg(target_os = "linux")]

use crate::common::program::*;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::fs::{self, File};
use std::io::Write;
use std::process::{Command, Stdio};

/// A file of each format, of some kilobytes each. `frames`: one of frames; `stream`: one of a stream.
fn one_of_each(folder: &Folder) -> Vec<String> {
    let frames = folder.path("a.frames");
    done(&["convert", SWEEP, &frames]);
    let lattice = r#"{"echolume": 1, "type": "u8", "cartesian": {"size": [16, 16, 16], "spacing": [1, 1, 1]}}"#;
    let stream = folder.write("a.stream", [lattice.as_bytes(), b"\n", &[7; 16 * 16 * 16]].concat());
    let stored = ["dicom/multiframe.dcm", "formats/short.mha", "formats/raw-ras.nrrd", "formats/oblique.nii"];
    let mut files: Vec<String> = stored.map(|name| data(name).to_str().expect("a plain name").to_string()).into();
    files.extend([KRETZ.into(), frames, stream]);
    #[cfg(feature = "uff")]
    files.push(data("uff/chunked.uff").to_str().expect("a plain name").to_string());
    files
}

#[test]
fn every_format_is_refused_by_the_memory_of_its_volume() {
    let folder = Folder::new("memory");
    let (out, picture) = (folder.path("out.mha"), folder.path("out.png"));
    for file in one_of_each(&folder) {
        for arguments in [&["render", &file, "-o", &picture][..], &["convert", &file, &out]] {
            let all = [arguments, &["--max-memory", "60"]].concat();
            refuses(&all, &run(&all), 2, &["volume: of ", " samples takes ", "at most 60 bytes", "--max-memory"]);
        }
        done(&["info", &file]);
        done(&["render", &file, "-o", &picture, "--explain", "--max-memory", "none"]);
    }
    assert!(!fs::exists(&out).expect("look") && !fs::exists(&picture).expect("look"));
    assert!(run(&["info", SWEEP, "--max-memory", "much"]).2.contains("must be a size such as 8G"));
}

/// A packed file of 10 MB that states 10 GiB, as its header alone can; and the same as a stream. Behind the header is a hole.
#[test]
fn a_small_file_that_states_a_huge_volume_is_refused_within_its_address_space() {
    let folder = Folder::new("huge");
    let header =
        "ObjectType = Image\nNDims = 3\nDimSize = 2048 2048 2560\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(&[header.as_bytes(), &[0; 1 << 20]].concat()).expect("packed");
    let path = folder.write("huge.mha.gz", packed.finish().expect("packed"));
    File::options().write(true).open(&path).expect("opened").set_len(11 << 20).expect("a file with a hole");
    let out = folder.path("out.png");
    let within = |arguments: &[&str], input: Stdio| {
        let mut command = Command::new("bash");
        command.args(["-c", "ulimit -v 3000000; exec timeout 20 \"$@\"", "bash", PROGRAM]).args(arguments);
        let ended = command.stdin(input).output().expect("run");
        (ended.status.code(), String::new(), String::from_utf8_lossy(&ended.stderr).into_owned())
    };
    let named = ["huge.mha.gz: volume: of 2048 x 2048 x 2560 samples takes 10.0 GiB", "at most 1.4 GiB"];
    for arguments in [&["render", &path, "-o", &out][..], &["stream", "--null", "--source", &path]] {
        refuses(arguments, &within(arguments, Stdio::null()), 2, &named);
    }
    let (code, _, said) = within(&["info", &path], Stdio::null());
    assert_eq!((code, said.as_str()), (Some(0), ""), "a description takes no memory");
    let lattice = r#"{"echolume": 1, "type": "u8", "cartesian": {"size": [2048, 2048, 2560], "spacing": [1, 1, 1]}}"#;
    let stream = folder.write("stream", [lattice, "\n"].concat());
    let arguments = ["stream", "--null", "--source", "-"];
    let input = File::open(stream).expect("opened");
    refuses(&arguments, &within(&arguments, input.into()), 1, &["pipe: volume: of 2048 x 2048 x 2560 samples"]);
}
