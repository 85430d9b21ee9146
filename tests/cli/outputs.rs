//! Every option that writes a file: to places that cannot be written, on a full disk, over an input. One line, an unchanged old file,
//! and no other file left.
#![cfg(unix)]

use crate::common::program::*;
use echolume::low_level::scene::Settings;
use echolume::low_level::user_presets::{UserPreset, write};
use std::fs;
use std::path::Path;
use std::process::Command;

const SMALL: [&str; 4] = ["--size", "8x8", "--mode", "mip"];

/// The kind of an output.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// A file that replaces an old one.
    File,
    /// A file that must not exist.
    New,
    Folder,
}
use Kind::{File, Folder as Dir, New};

struct Row {
    /// @ is the output.
    arguments: Vec<String>,
    /// The ending of its name.
    ending: &'static str,
    kind: Kind,
    /// Too slow, or useless, on a full disk.
    early: bool,
}

/// What settings are read from is an input too, although a file of settings or the environment names it.
#[test]
fn files_that_settings_name_are_not_replaced() {
    let folder = Folder::new("settings-named");
    let points = "points = [{ at = 0, colour = [1, 1, 1], opacity = 0 }, { at = 1, colour = [1, 1, 1], opacity = 1 }]";
    let transfer = folder.write("fire.toml", points);
    let scene = folder.write("scene.toml", "[volume]\ntransfer = 'fire.toml'");
    let presets = folder.path("presets.toml");
    let mine = UserPreset::new("Mine", &Settings::default()).expect("a preset");
    write(Path::new(&presets), &[mine]).expect("written");
    for (named, output) in [(["--scene", &scene], &transfer), (["--preset", "Mine"], &presets)] {
        let mut command = Command::new(PROGRAM);
        command.args(["profile", BONE, "--json", output]).args(named).env("ECHOLUME_PRESETS", &presets);
        let before = fs::read(output).expect("a file");
        refuses(&named, &finish(&mut command), 2, &[output, "would replace an input"]);
        assert_eq!(fs::read(output).expect("a file"), before);
    }
}

fn rows(folder: &Folder) -> Vec<Row> {
    let picture = folder.write("in.pgm", b"P5 4 4 255\n0123456789abcdef");
    let report = folder.write("error.json", crate::budget::error_report("[160, 216, 33]"));
    let tape = folder.path("in.frames");
    done(&["convert", SWEEP, &tape]);
    let waves = folder.write("waves.txt", "0\n0.5\n1\n1.5\n2\n2.5\n3\n");
    let row = |ending, kind, early, words: &[&str], more: &[&str]| {
        let arguments = words.iter().chain(more).map(|w| w.to_string()).collect();
        Row { arguments, ending, kind, early }
    };
    let profile = |flag: &str, ending| {
        let words = ["profile", BONE, "--repeat", "1", "--warm-up", "1", "--no-ceilings", flag, "@"];
        row(ending, File, flag != "--trace", &words, &SMALL)
    };
    let verify = ["verify", "--only", "every level of a picture"];
    vec![
        row("png", File, false, &["render", BONE, "-o", "@"], &SMALL),
        row("", Dir, false, &["render", BONE, "-o", "/dev/null", "--dump", "@"], &SMALL),
        row("png", File, false, &["render", BONE, "-o", "/dev/null", "--error-map", "@"], &SMALL),
        row("", Dir, false, &["render", BONE, "--turntable", "2", "-o", "@"], &SMALL),
        row(
            "",
            Dir,
            false,
            &["report", "bounds", BONE, "-o", "@"],
            &["--size", "8x8", "--mode", "vr", "--preset", "bone"],
        ),
        row("png", File, false, &["filter", &picture, "--filter", "median", "-o", "@"], &[]),
        row(
            "csv",
            File,
            false,
            &["filter", &picture, "--growth-table", "--filter", "enhanced-sigma:sigma=0.1,window=3,largest=5"],
            &["--csv", "@"],
        ),
        profile("--json", "json"),
        profile("--csv", "csv"),
        profile("--csv-samples", "csv"),
        profile("--trace", "json"),
        row("", Dir, false, &["report", "error", "--from", &report, "-o", "@"], &[]),
        row("", Dir, true, &["report", "error", BONE, "--dial", "step", "-o", "@"], &SMALL),
        row("md", File, true, &["report", "tables", "--quick", "--markdown", "@"], &[]),
        row("csv", File, true, &["report", "tables", &picture, "--quick", "--csv", "@"], &[]),
        row("json", File, false, &verify, &["--json", "@"]),
        row("xml", File, false, &verify, &["--junit", "@"]),
        row("html", File, false, &verify, &["--html", "@"]),
        row("mha", File, false, &["phantom", "--body", "constant", "-o", "@"], &[]),
        row("mha", File, false, &["convert", BONE, "@", "--spacing", "4"], &[]),
        row("nrrd", File, false, &["convert", BONE, "@", "--spacing", "4"], &[]),
        row("mha", File, false, &["convert", &tape, "@", "--sequence"], &[]),
        row("stl", File, false, &["mesh", BONE, "@", "--spacing", "4"], &[]),
        row("frames", New, false, &["convert", SWEEP, "@"], &[]),
        row("frames", New, false, &["stic", SWEEP, "@", "--frame-rate", "10", "--r-waves", &waves], &[]),
        row("", Dir, false, &["stream", "--source", BONE, "--out", "@"], &SMALL),
        row("frames", New, false, &["stream", "--source", BONE, "--null", "--record", "@"], &SMALL),
        row(
            "csv",
            File,
            true,
            &["probe", "sweep", "--port", "/dev/null", "--angle", "20", "--rate", "1", "--probe"],
            &[MOTOR_PROBE, "--positions", "@"],
        ),
        row("tar.gz", New, false, &["support-bundle", "-o", "@"], &[]),
        row("log", File, true, &["info", BONE, "--log-file", "@"], &[]),
    ]
}

fn filled<'a>(row: &'a Row, output: &'a str) -> Vec<&'a str> {
    row.arguments.iter().map(|word| if word == "@" { output } else { word }).collect()
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_any_work() {
    let folder = Folder::new("readonly");
    let rows = rows(&folder);
    let file = folder.write("file", "mine");
    let before = folder.names();
    for row in &rows {
        let name = format!("echolume.{}", row.ending);
        // A file is no folder, and /proc takes no files.
        for output in [format!("{file}/{name}"), format!("/proc/{name}")] {
            let all = filled(row, &output);
            let ran = run(&all);
            refuses(&all, &ran, if ran.0 == Some(2) { 2 } else { 1 }, &["echolume."]);
        }
        assert_eq!(folder.names(), before, "{:?}", row.arguments);
    }
    assert_eq!(fs::read(&file).expect("it is still there"), b"mine");
}

#[test]
fn a_full_disk_costs_no_old_file_and_leaves_nothing() {
    let folder = Folder::new("no-room");
    let rows = rows(&folder);
    for row in rows.iter().filter(|row| !row.early) {
        let place = Folder(folder.0.join("place"));
        fs::create_dir_all(&place.0).expect("a folder");
        let output = match row.kind {
            File => place.write(&format!("out.{}", row.ending), "old"),
            New => place.path(&format!("out.{}", row.ending)),
            Dir => place.path("out"),
        };
        let all = filled(row, &output);
        // No file may grow: the same as a full disk.
        let mut command = Command::new("sh");
        command.args(["-c", "trap '' XFSZ; ulimit -f 0; exec \"$@\"", "sh", PROGRAM]).args(&all);
        let (code, _, err) = finish(&mut command);
        assert_eq!(code, Some(1), "{all:?}: {err}");
        let last = err.lines().last().unwrap_or_default();
        assert!(last.starts_with("echolume: ") && !err.contains("panicked"), "{all:?}: {err}");
        let written = last.contains("cannot be written") || last.contains("could not be written");
        assert!(written && last.contains("out"), "{all:?}: {err}");
        match row.kind {
            File => {
                assert_eq!(fs::read(&output).expect("the old file"), b"old", "{all:?}");
                assert_eq!(place.names().len(), 1, "{all:?}: {:?}", place.names());
            }
            New => assert!(place.names().is_empty(), "{all:?}: {:?}", place.names()),
            Dir => assert!(Folder(output.clone().into()).names().is_empty(), "{all:?}"),
        }
    }
}

#[test]
fn inputs_are_not_overwritten_and_no_file_is_written_twice() {
    let folder = Folder::new("inputs");
    let copy = |from: &str, name: &str| folder.write(name, fs::read(from).expect("read"));
    let probe = copy(MOTOR_PROBE, "p.toml");
    let report = folder.write("error.json", crate::budget::error_report("[160, 216, 33]"));
    let scene = folder.write("scene.toml", "mode = 'mip'\n");
    let picture = folder.write("in.pgm", b"P5 4 4 255\n0123456789abcdef");
    // Samples in a separate file.
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementType = MET_UCHAR\nElementDataFile = own.raw\n";
    let (split, raw) = (folder.write("own.mhd", header), folder.write("own.raw", [7; 64]));
    let points = folder.write("fire.toml", "points = [{ at = 0, colour = [0, 0, 0] }, { at = 1, colour = [1, 1, 1] }]");
    let (out, sweep) = (folder.path("out.png"), folder.path("out.csv"));
    let profile = ["profile", BONE, "--repeat", "1"];
    let names = folder.names();
    let before: Vec<_> = names.iter().map(|name| fs::read(folder.path(name)).expect("read")).collect();
    let rows: Vec<Vec<&str>> = vec![
        vec!["render", &split, "-o", &raw],
        vec!["render", &split, "-o", &split],
        vec!["render", BONE, "--scene", &scene, "-o", &scene],
        vec!["render", BONE, "--transfer", &points, "-o", &points],
        vec!["render", BONE, "--budget", "9ms", "--report", &report, "-o", &report],
        vec!["filter", &picture, "--filter", "median", "-o", &picture],
        [&profile[..], &["--scene", &scene, "--json", &scene]].concat(),
        [&profile[..], &["--csv", &out, "--trace", &out]].concat(),
        vec!["profile", "--compare", &report, &report, "--json", &report],
        vec!["verify", "--baseline", &report, "--json", &report],
        vec!["verify", "--junit", &out, "--html", &out],
        vec!["report", "tables", &picture, "--csv", &picture],
        vec!["report", "tables", "--csv", &sweep, "--markdown", &sweep],
        vec!["convert", &split, &split],
        vec!["probe", "sweep", "--port", "x", "--angle", "9", "--rate", "1", "--probe", &probe, "--positions", &probe],
        vec!["stream", "--source", &split, "--null", "--record", &split],
    ];
    for row in &rows {
        refuses(row, &run(row), 2, &[]);
    }
    assert_eq!(folder.names(), names);
    for (name, bytes) in names.iter().zip(&before) {
        assert!(fs::read(folder.path(name)).expect("read") == *bytes, "{name} is another");
    }
}
