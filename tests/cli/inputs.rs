//! Endless inputs, or inputs beyond any limit: each is refused in one line, soon, and without exhausting the machine.
#![cfg(target_os = "linux")]

use crate::common::program::*;
use echolume::low_level::source::formats::FORMATS;
use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::process::Command;

/// A length that files may have here: holes take no space.
const HUGE: u64 = 1 << 40;
/// KiB of address space that a refusal may need.
const ROOM: &str = "3000000";

fn bounded(arguments: &[&str]) -> Ran {
    let mut command = Command::new("bash");
    command.args(["-c", &format!("ulimit -v {ROOM}; exec timeout 20 \"$@\""), "bash", PROGRAM]).args(arguments);
    finish(command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY"))
}

/// A file that begins with these bytes and continues with zeros.
fn huge(folder: &Folder, name: &str, start: &[u8]) -> String {
    let path = folder.write(name, start);
    File::options().write(true).open(&path).expect("opened").set_len(HUGE).expect("a file with a hole");
    path
}

#[test]
fn no_input_may_be_endless() {
    let folder = Folder::new("endless");
    let (out, volume) = (folder.path("out.png"), folder.path("out.mha"));
    let fifo = folder.path("fifo.toml");
    assert!(Command::new("mkfifo").arg(&fifo).status().expect("run mkfifo").success());
    // The arguments (@ is the input); how a file of the kind begins; whether a missing part is reported at once.
    let rows: &[(&[&str], &[u8])] = &[
        (&["info", "@"], b"ObjectType = Image\n"),
        (&["info", "@"], b"KRETZFILE 1.0   "),
        (&["info", "@"], b"ECHOFRMS"),
        (&["info", "@"], b""),
        (&["info", SWEEP, "--probe", "@"], b"# "),
        (&["render", "@", "-o", &out], b"ObjectType = Image\nNDims = 3\nDimSize = "),
        (&["render", SWEEP, "-o", &out, "--scene", "@"], b"mode = 'vr'\n"),
        (&["render", SWEEP, "-o", &out, "--transfer", "@"], b"points = []\n"),
        (&["render", BONE, "-o", &out, "--budget", "9ms", "--report", "@"], b"{"),
        (&["profile", "--compare", "@", "@"], b"{"),
        (&["verify", "--baseline", "@"], b"{"),
        (&["report", "error", "--from", "@"], b"{"),
        (&["report", "tables", "@"], b"\xff\xd8\xff\xe0"),
        (&["filter", "@", "-o", &out, "--filter", "median"], b"BM"),
        (&["convert", "@", &volume], b"KRETZFILE 1.0   "),
        (&["stream", "--null", "--source", "@"], b"ObjectType = Image\n"),
        (&["stream", "--null", "--source", SWEEP, "--probe", "@"], b"# "),
        (&["view", "--config", "@"], b"source = 'phantom'\n"),
        (&["view", "--report", "@"], b"{"),
        (&["probe", "status", "--port", "/dev/null", "--probe", "@"], b"[motor]\n"),
    ];
    let here = folder.path("");
    for (row, start) in rows {
        let long = huge(&folder, "long.toml", start);
        for file in [&long, &fifo, &here, "/dev/zero"] {
            // A transfer function is read as a file if its name has the ending.
            if row.contains(&"--transfer") && !file.ends_with(".toml") {
                continue;
            }
            let all: Vec<&str> = row.iter().map(|word| if *word == "@" { file } else { *word }).collect();
            refuses(&all, &bounded(&all), 2, &[file]);
        }
    }
    assert!(!fs::exists(&out).expect("look") && !fs::exists(&volume).expect("look"), "something was written");
}

#[test]
fn standard_input_without_an_end_or_a_line_is_refused() {
    let zero = File::open("/dev/zero").expect("zeros");
    let output =
        Command::new("timeout").args(["20", PROGRAM, "stream", "--null", "--source", "-"]).stdin(zero).output();
    let output = output.expect("start the program");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("header: is longer than"), "{said}");
}

/// A file with a hole has space for any index, and for missing frames.
#[test]
fn a_recording_that_goes_on_in_a_hole_is_read_as_far_as_it_goes() {
    let folder = Folder::new("hole");
    let tape = folder.path("tape.frames");
    done(&["convert", SWEEP, &tape]);
    let bytes = fs::read(&tape).expect("read");
    let index = &bytes[bytes.len() - 12..bytes.len() - 4];
    let mut file = File::options().write(true).open(&tape).expect("opened");
    file.set_len(u64::from_le_bytes(index.try_into().expect("eight bytes"))).expect("without its index");
    file.set_len(HUGE).expect("a hole");
    // A trailer that declares all of the hole to be an index.
    file.seek(SeekFrom::End(-16)).expect("its end");
    file.write_all(&[&[0; 4][..], index, b"XEND"].concat()).expect("written");
    drop(file);
    let (code, said, err) = bounded(&["info", &tape]);
    assert_eq!(code, Some(0), "{said} {err}");
    let has = |title: &str, value: &str| said.lines().any(|l| l.starts_with(title) && l.ends_with(value));
    assert!(has("frames", " 31") && has("index", "made anew") && has("lost", "bytes at the end"), "{said}");
}

/// Modes, layouts and sizes are taken in any case, and modes by their other names.
#[test]
fn modes_have_other_names_and_no_case() {
    let plan = |flags: &[&str]| {
        let (code, out, err) = run(&[&["render", "--explain"], flags].concat());
        assert_eq!(code, Some(0), "{flags:?}: {err}");
        out
    };
    for (typed, meant) in [
        (&["--mode", "ORTHO"], &["--mode", "orthogonal"]),
        (&["--mode", "slices"], &["--mode", "orthogonal"]),
        (&["--mode", "X-Ray"], &["--mode", "xray"]),
        (&["--mode", "4up"], &["--layout", "4up"]),
        (&["--layout", "4UP"], &["--layout", "4up"]),
        (&["--size", "64X48"], &["--size", "64x48"]),
    ] {
        assert_eq!(plan(typed), plan(meant), "{typed:?}");
    }
    assert_ne!(plan(&["--mode", "mip"]), plan(&["--mode", "vr"]));
    assert!(run(&["render", "--explain", "--mode", "sideways"]).2.contains("sideways"));
}

/// Requirement: the table of formats is what every command goes by: a folder's files of each are taken, and a command that cannot read one says so in a line.
#[test]
fn every_format_is_taken_from_a_folder_and_refused_by_what_reads_pictures() {
    let folder = Folder::new("formats");
    let endings: Vec<_> = FORMATS.iter().flat_map(|format| format.endings).collect();
    fs::create_dir(folder.join("archive")).expect("a folder");
    for ending in &endings {
        let file = folder.write(&format!("archive/scan.{ending}"), b"neither a recording nor a picture");
        for arguments in [&["filter", &file, "--filter", "median", "-o", &folder.path("out.png")][..], &["info", &file]]
        {
            let (code, out, said) = run(arguments);
            assert_eq!((code, out.as_str(), said.lines().count()), (Some(2), "", 1), "{arguments:?}: {said}");
            assert!(said.contains(&format!("scan.{ending}")), "{said}");
        }
    }
    folder.write("archive/notes.txt", b"no recording");
    let found = echolume::low_level::batch::make::files(&[folder.path("archive")]).expect("files");
    assert_eq!(found.len(), endings.len(), "{found:?}");
    let help = done(&["info", "--help"]);
    let page = fs::read_to_string(repository("docs/formats.md")).expect("the page");
    let table = page.split("\n\n").find(|part| part.starts_with("| format |")).expect("its table");
    for ending in endings {
        assert!(help.contains(&format!(".{ending}")) && table.contains(&format!("`.{ending}`")), "{ending}");
    }
}
