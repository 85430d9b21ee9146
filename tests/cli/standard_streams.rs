//! Standard input and output as recording and picture, and what the program says about itself to shells, `man` and scripts.

use crate::common::program::*;
use echolume::low_level::scene::load::PRESETS;
use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};

/// Runs the program with a file as its standard input. Returns its exit code, standard output as bytes, and standard error.
fn fed(file: &str, arguments: &[&str]) -> (Option<i32>, Vec<u8>, String) {
    let input = fs::File::open(file).expect("an input");
    let output = Command::new(PROGRAM).args(arguments).stdin(Stdio::from(input)).output().expect("start the program");
    (output.status.code(), output.stdout, String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn a_picture_goes_to_standard_output_alone_and_a_recording_comes_from_standard_input() {
    let folder = Folder::new("streams");
    let file = folder.path("mip.png");
    let small = ["--size", "8x6", "--mode", "mip"];
    done(&[&["render", BONE, "-o", &file][..], &small].concat());
    let expected = fs::read(&file).expect("a picture");
    let (code, out, err) = fed(BONE, &[&["render", "-", "-o", "-", "--timings"][..], &small].concat());
    assert_eq!(code, Some(0), "{err}");
    assert!(out == expected, "standard output is not the picture, of {} bytes, but {}", expected.len(), out.len());
    assert!(err.contains("device: ") && err.contains("raycast"), "{err}");
    // In another format by the ending.
    let jpeg = folder.path("mip.JPG");
    done(&[&["render", BONE, "-o", &jpeg][..], &small].concat());
    assert!(fs::read(&jpeg).expect("a picture").starts_with(b"\xff\xd8\xff"));
}

#[test]
fn standard_input_is_any_recording_and_said_by_its_name() {
    let folder = Folder::new("input");
    let seed = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fuzz/seeds/piped/lattice");
    let (code, out, err) = fed(seed, &["info", "-"]);
    let said = String::from_utf8(out).expect("text");
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(said.contains("stream of frames") && said.contains("3 x 2 pixels"), "{said}");
    // The same stream as a file, and as a volume.
    assert_eq!(done(&["info", seed]), said);
    let (volume, again) = (folder.path("volume.mha"), folder.path("again.mha"));
    done(&["convert", seed, &volume]);
    assert_eq!(fed(seed, &["convert", "-", &again]).0, Some(0));
    let bytes = fs::read(&volume).expect("a volume");
    assert!(bytes == fs::read(&again).expect("a volume"));
    assert!(bytes.ends_with(&8.0f32.to_le_bytes()), "the last voxel is another");
    let empty = folder.write("empty", "");
    for (file, arguments, named) in [
        (&*empty, &["info", "-"][..], "standard input: "),
        (seed, &["info", "-", "--depth-axis", "x"], "--depth-axis"),
        (SWEEP, &["render", "-", "--volume", "7"], "standard input: --volume 7"),
        (BONE, &["convert", "-", "-"], "a volume is written to a file"),
    ] {
        let (code, out, err) = fed(file, arguments);
        assert!(code == Some(2) && out.is_empty() && err.contains(named), "{arguments:?}: {code:?} {err}");
    }
}

#[test]
fn an_unknown_ending_and_a_stream_that_is_no_picture_are_refused_before_anything_is_drawn() {
    let folder = Folder::new("endings");
    let gif = folder.path("p.gif");
    let grey = folder.write("in.pgm", b"P5 4 4 255\n0123456789abcdef");
    for (arguments, named) in [
        (&["render", BONE, "-o", &gif][..], "-o "),
        (&["render", BONE, "--error-map", &gif], "--error-map "),
        (&["filter", &grey, "--filter", "median", "-o", &gif], "-o "),
    ] {
        // Without a device nothing can be drawn.
        let ran = finish(without_device(Command::new(PROGRAM).args(arguments).current_dir(&folder.0)));
        refuses(arguments, &ran, 2, &[named, "p.gif", ".png, .jpg, .jpeg, .bmp, .ppm"]);
    }
    for arguments in [
        &["render", BONE, "--error-map", "-"][..],
        &["phantom", "--body", "constant", "-o", "-"],
        &["verify", "--json", "-"],
    ] {
        let ran = finish(Command::new(PROGRAM).args(arguments).current_dir(&folder.0));
        refuses(arguments, &ran, 2, &["-: only a picture"]);
    }
    assert_eq!(folder.names().len(), 1, "{:?}", folder.names());
}

#[test]
fn a_pipe_gets_no_colours() {
    let mirrored = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/formats/mirrored.nii.gz");
    for arguments in [&["info", mirrored][..], &["info", "--bogus"], &["--help"]] {
        let (_, out, err) = finish(Command::new(PROGRAM).args(arguments).env_remove("NO_COLOR"));
        assert!(!out.contains('\u{1b}') && !err.contains('\u{1b}'), "{arguments:?}: {out}{err}");
    }
    let (_, _, err) = finish(Command::new(PROGRAM).args(["info", mirrored]).env_remove("NO_COLOR"));
    assert!(err.contains("left-handed"), "the warning is gone: {err}");
}

#[test]
fn shells_and_man_know_every_command() {
    let folder = Folder::new("about");
    let commands = ["render", "convert", "support-bundle", "completions", "man"];
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = done(&["completions", shell]);
        assert!(commands.iter().all(|command| script.contains(command)) && !script.contains("\\t\\t"), "{shell}");
    }
    assert_eq!(run(&["completions", "tcsh"]).0, Some(2));
    done(&["man", "-o", &folder.path("man1")]);
    let pages: Vec<String> = fs::read_dir(folder.0.join("man1"))
        .expect("a folder of pages")
        .map(|page| page.expect("a page").file_name().to_string_lossy().into_owned())
        .collect();
    for page in commands.iter().map(|c| format!("echolume-{c}.1")).chain(["echolume-report-error.1".into()]) {
        assert!(pages.contains(&page), "{page} is not among {pages:?}");
    }
    let page = done(&["man"]);
    assert!(page.contains(".TH echolume 1") && page.contains("Exit codes of every command"), "{page}");
    assert_eq!(page, fs::read_to_string(folder.0.join("man1/echolume.1")).expect("the same page"));
    for command in [&["render", "--version"][..], &["report", "error", "--version"], &["--version"]] {
        assert!(done(command).trim_end().ends_with(env!("CARGO_PKG_VERSION")), "{command:?}");
    }
}

/// The help of `--preset` lists the presets by hand: clap takes no text that is put together.
#[test]
fn the_help_of_preset_names_the_presets_that_there_are() {
    let help = done(&["render", "--help"]);
    let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let list = words.split("Preset of settings: ").nth(1).and_then(|rest| rest.split('.').next()).expect("a list");
    let names: Vec<&str> = PRESETS.iter().map(|(name, _)| *name).collect();
    assert_eq!(list.split(", ").collect::<Vec<_>>(), names);
}

#[test]
fn input_without_end_that_is_no_recording_is_refused_by_its_first_bytes() {
    let mut program = Command::new(PROGRAM);
    program.args(["info", "-"]).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = program.spawn().expect("start the program");
    let mut input = child.stdin.take().expect("a pipe");
    let zeros = vec![0; 64 << 10];
    // The pipe breaks once the program has ended; a gigabyte is what a program takes that reads on.
    let written = (0..16 << 10).take_while(|_| input.write_all(&zeros).is_ok()).count();
    drop(input);
    let output = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && said.lines().count() == 1, "{said}");
    assert!(said.contains("standard input: file: is of no known format"), "{said}");
    assert!(written < 64, "{written} times 64 KiB were read");
}
