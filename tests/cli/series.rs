//! `render --turntable` and `--volumes`: several pictures of one recording, as files and as a film.

use crate::common::program::*;
use echolume::low_level::picture::Picture;
use std::fs;
use std::path::Path;

const LOOK: [&str; 4] = ["--preset", "bone", "--size", "40x30"];

fn picture(folder: &str, n: usize) -> Picture {
    Picture::load(Path::new(&format!("{folder}/picture-{n:06}.png"))).expect("a picture")
}

/// Mean difference of two pictures, levels of 255.
fn difference(a: &Picture, b: &Picture) -> f64 {
    assert_eq!([a.width, a.height], [b.width, b.height]);
    a.rgba.iter().zip(&b.rgba).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.rgba.len() as f64
}

/// Prevents a turn that jumps where it closes, and one that zooms.
#[test]
fn a_turn_that_starts_elsewhere_has_the_same_pictures() {
    let folder = Folder::new("turn");
    let [turn, later] = ["turn", "later"].map(|name| folder.path(name));
    // Level, so that the vertical axis of both views is the same.
    let level = ["--set", "camera.elevation=0"];
    let said = done(&[&["render", BONE, "--turntable", "4", "-o", &format!("{turn}/")][..], &LOOK, &level].concat());
    let last = format!("pictures: {turn}/picture-000000.png to {turn}/picture-000003.png, 4");
    assert!(said.ends_with(&format!("{last}\n")), "{said}");
    let quarter = ["render", BONE, "--turntable", "4", "--camera", "azimuth=90", "-o", &later];
    done(&[&quarter[..], &LOOK, &level].concat());
    let all = |folder: &str| [0, 1, 2, 3].map(|n| picture(folder, n));
    let (turn, later) = (all(&turn), all(&later));
    for n in 0..4 {
        let (same, other) = (difference(&later[n], &turn[(n + 1) % 4]), difference(&later[n], &turn[n]));
        // Angles of 90 degrees are rounded; a pixel on an edge may change.
        assert!(same < 0.5 && other > 4.0 * same.max(0.5), "picture {n}: {same}, {other} from the one before");
    }
}

#[test]
fn volumes_in_time_are_those_that_are_drawn_alone() {
    let folder = Folder::new("loop");
    let sweep = folder.path("sweep.mha");
    done(&["phantom", "-o", &sweep, "--volumes", "3", "--both-ways", "--frames", "9", "--lines", "24"]);
    let look = ["--preset", "face", "--size", "24x20"];
    let pattern = folder.path("loop-%02d.png");
    done(&[&["render", &sweep, "--volumes", "1:2", "-o", &pattern][..], &look].concat());
    for n in [1, 2] {
        let alone = folder.path("alone.png");
        done(&[&["render", &sweep, "--volume", &n.to_string(), "-o", &alone][..], &look].concat());
        let (alone, drawn) = (fs::read(&alone).expect("a picture"), fs::read(folder.path(&format!("loop-0{n}.png"))));
        assert!(drawn.expect("a picture") == alone, "volume {n}");
    }
    assert!(!folder.names().contains("loop-00.png"));
    // Between the marks of a cine loop, each once: pictures in files are not repeated.
    let (marked, marks) = (folder.path("marked-%02d.png"), "cine={first=1,back_and_forth=true}");
    done(&[&["render", &sweep, "--volumes", "loop", "--set", marks, "-o", &marked][..], &look].concat());
    let of_loop = |name: &str| fs::read(folder.path(name)).expect("a picture");
    assert!(of_loop("marked-01.png") == of_loop("loop-01.png") && of_loop("marked-02.png") == of_loop("loop-02.png"));
    assert!(!folder.names().contains("marked-00.png"));
}

#[test]
fn a_series_that_would_be_wrong_is_not_begun() {
    let folder = Folder::new("series-wrong");
    let slices = folder.path("slices");
    fs::create_dir_all(&slices).expect("a folder");
    for n in 0..2 {
        fs::write(format!("{slices}/picture-{n:06}.pgm"), b"P5 4 4 255\n0123456789abcdef").expect("a slice");
    }
    let (one, out, over) = (folder.path("one.png"), folder.path("out"), format!("{slices}/picture-%06d.pgm"));
    let films = folder.path("film-%03d.mp4");
    let stack = format!("{slices}/*.pgm");
    let rows: Vec<(Vec<&str>, &str)> = vec![
        (vec!["--turntable", "3", "-o", &one], "a pattern (face-%03d.png)"),
        (vec!["--turntable", "3", "-o", "-"], "a pattern (face-%03d.png)"),
        (vec!["--turntable", "3", "-o", &out, "--mode", "mpr"], "--turntable: mode: shows planes"),
        (vec!["--volumes", "0:1", "-o", &out], "--volumes 1: there are 1"),
        (vec!["--volumes", "all", "--volume", "1", "-o", &out], "give one of them"),
        (vec!["--volumes", "all", "--volume", "0", "-o", &out], "give one of them"),
        (vec!["--volumes", "loop", "--set", "cine.first=4", "-o", &out], "cine.first is 4"),
        (vec!["--set", "cine={first=4,last=3}", "-o", &one], "cine.last: is 3, must not be below cine.first, 4"),
        (vec!["--set", "cine.speed=9", "-o", &one], "cine.speed: is 9, must lie in 0.1..=8"),
        (vec!["--volumes", "5:6", "-o", &out], "--volumes 5: there are 1"),
        (vec!["--turntable", "3", "-o", &out, "--rate", "8"], "--rate: is for a film (-o face.mp4)"),
        (vec!["-o", &one, "--rate", "8"], "--rate: is for a film of several pictures"),
        (vec!["--turntable", "3", "-o", &films], "leave the % out"),
        (vec!["--turntable", "3", "-o", &out, "--dump", &out], "--dump: is for one picture"),
        (vec!["--turntable", "2", "-o", &over], "would replace an input"),
    ];
    for (more, named) in rows {
        let all = [&["render", &stack, "--voxel-spacing", "1,1,1", "--size", "8x8"][..], &more].concat();
        refuses(&all, &run(&all), 2, &[named]);
    }
    assert_eq!(folder.names().into_iter().collect::<Vec<_>>(), ["slices"]);
    assert_eq!(fs::read(format!("{slices}/picture-000001.pgm")).expect("a slice"), b"P5 4 4 255\n0123456789abcdef");
}

/// Without an encoder of its own the program hands the pixels to the ffmpeg in PATH: here one that counts them.
#[cfg(all(unix, not(feature = "video")))]
#[test]
fn films_are_made_by_the_ffmpeg_that_is_installed() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new("ffmpeg");
    let [film, bin, size] = ["turn.mp4", "bin", "size"].map(|name| folder.path(name));
    fs::create_dir(&bin).expect("a folder");
    let program = format!("{bin}/ffmpeg");
    let turn = |script: Option<&str>| {
        if let Some(script) = script {
            fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("a program");
            fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("executable");
        }
        let mut command = std::process::Command::new(PROGRAM);
        let look = ["--preset", "bone", "--size", "40x30", "--turntable", "4", "--rate", "8", "-o", &film];
        finish(
            command.args(["render", BONE]).args(look).env("PATH", if script.is_some() { &bin } else { "/nonexistent" }),
        )
    };
    let what = ["film.mp4"];
    refuses(&what, &turn(None), 2, &["turn.mp4: a film needs the program ffmpeg", "--features video"]);
    let ended = turn(Some("exec 2>/dev/null; echo no such codec >&2; exec >&2; exit 3"));
    refuses(&what, &ended, 1, &["turn.mp4: cannot be written: ffmpeg: "]);
    let refused = turn(Some("/bin/cat >/dev/null; echo first >&2; echo no such codec >&2; exit 3"));
    refuses(&what, &refused, 1, &["turn.mp4: cannot be written: ffmpeg: no such codec"]);
    assert_eq!(folder.names().into_iter().collect::<Vec<_>>(), ["bin"], "nothing stays");
    let count = format!("for film; do :; done; /usr/bin/wc -c >{size}; echo \"$@\" >\"$film\"");
    let (code, said, err) = turn(Some(&count));
    assert_eq!(code, Some(0), "{err}");
    assert!(said.ends_with(&format!("film: {film}, 4 pictures, 8 a second, by {program}\n")), "{said}");
    let bytes = fs::read_to_string(&size).expect("a count");
    assert_eq!(bytes.trim(), (4 * 4 * 40 * 30).to_string(), "every pixel of every picture");
    let asked = fs::read_to_string(&film).expect("the film");
    assert!(asked.contains("-f rawvideo -pix_fmt rgba -s 40x30 -r 8 -i pipe:0"), "{asked}");
    let mode = fs::metadata(&film).expect("the film").permissions().mode();
    assert_eq!(mode & 0o777, 0o600, "only its owner reads it");
}

/// Prevents a volume of a workspace that is ignored: the measurements of a workspace belong to it.
#[test]
fn a_workspace_has_its_volume_unless_another_one_is_asked_for() {
    let folder = Folder::new("workspace-volume");
    let sweep = folder.path("sweep.mha");
    done(&["phantom", "-o", &sweep, "--volumes", "3", "--frames", "9", "--lines", "24"]);
    let text =
        "mode = 'mip'\n[workspace]\nversion = 1\nrecording = 'sweep.mha'\nvolume = 2\n[picture]\nsize = [24, 20]\n";
    let (workspace, out) = (folder.write("exam.toml", text), folder.path("out"));
    let drawn = |more: &[&str]| {
        let picture = folder.path("p.png");
        done(&[&["render", "-o", &picture], more].concat());
        fs::read(&picture).expect("a picture")
    };
    let alone = |n: &str| drawn(&[&sweep, "--mode", "mip", "--size", "24x20", "--volume", n]);
    // The settings of a workspace are complete: those that follow from the echoes of a recording are not its own.
    let of_workspace = drawn(&[&workspace]);
    assert!(drawn(&[&workspace, "--volume", "2"]) == of_workspace);
    assert!(drawn(&[&workspace, "--volume", "0"]) != of_workspace, "--volume 0 is not the default");
    assert!(alone("0") != alone("2"), "the volumes differ");
    let wrong = ["render", &workspace, "--volumes", "0:1", "-o", &out];
    refuses(&wrong, &run(&wrong), 2, &["--volumes 0:1: leaves out volume 2, which ", "exam.toml is of"]);
    done(&["render", &workspace, "--volumes", "1:2", "-o", &out]);
    assert!(fs::read(format!("{out}/volume-000002.png")).expect("a picture") == of_workspace);
}

/// Runs a program of ffmpeg. A program with films is tested where they can be decoded, or the test fails.
#[cfg(feature = "video")]
fn decoder(program: &str, arguments: &[&str]) -> Vec<u8> {
    let output = std::process::Command::new(program).args(arguments).output();
    let output = output.unwrap_or_else(|e| panic!("{program}: {e}: films are tested by ffmpeg; install it"));
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

/// Prevents a picture that is twice in a film because the device was lost after it was written. Of a first picture of one colour the cause is
/// looked for on the device.
#[cfg(feature = "video")]
#[test]
fn a_film_has_each_picture_once_wherever_the_device_is_lost() {
    use crate::common::layer::{reports, under_layer};
    let folder = Folder::new("film-lost");
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 16 16 16\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let even = folder.write("even.mha", [header.as_bytes(), &[51; 16 * 16 * 16]].concat());
    let (film, report) = (folder.path("turn.mp4"), folder.path("report.json"));
    let drawn = |settings: &[(&str, &str)]| {
        let flags = ["--mode", "mip", "--camera", "zoom=9", "--size", "24x16", "--turntable", "3", "-o", &film];
        let mut command = std::process::Command::new(PROGRAM);
        let (code, _, err) = finish(under_layer(command.arg("render").arg(&even).args(flags), settings));
        assert!(code == Some(0) && err.contains("the first picture"), "{settings:?}: {err}");
        let asked = ["-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames", "-of", "csv=p=0", &film];
        let count = String::from_utf8(decoder("ffprobe", &asked)).expect("text");
        assert_eq!(count.trim().trim_end_matches(','), "3", "{settings:?}: {err}");
        err.contains("the device is reopened")
    };
    assert!(!drawn(&[("REPORT", &report)]));
    let waits = reports(&report)[0]["waits"].as_u64().expect("counted");
    let lost = (1..=waits).filter(|n| drawn(&[("LOSE_WAIT", &n.to_string())])).count();
    assert!(lost > 3, "{lost} losses at {waits} waits");
}

/// The film against the pictures, by a decoder of others.
#[cfg(feature = "video")]
#[test]
fn a_film_has_the_pictures_of_its_series() {
    let folder = Folder::new("film");
    let [pictures, film] = ["pictures", "turn.mp4"].map(|name| folder.path(name));
    // An odd size: its planes of colour are rounded up.
    let look = ["--preset", "bone", "--size", "161x121", "--turntable", "12"];
    done(&[&["render", BONE, "-o", &pictures][..], &look].concat());
    let said = done(&[&["render", BONE, "-o", &film, "--rate", "8"][..], &look].concat());
    assert!(said.ends_with(&format!("film: {film}, 12 pictures, 8 a second\n")), "{said}");
    let asked =
        "stream=codec_name,profile,width,height,r_frame_rate,nb_read_frames,color_space,color_range:format=duration";
    let probe = ["-v", "error", "-count_frames", "-show_entries", asked, "-of", "default=noprint_wrappers=1", &film];
    let said = String::from_utf8(decoder("ffprobe", &probe)).expect("text");
    for line in [
        "codec_name=av1",
        "profile=Main",
        "width=161",
        "height=121",
        "r_frame_rate=8/1",
        "nb_read_frames=12",
        "color_space=bt709",
        "color_range=tv",
        "duration=1.500000",
    ] {
        assert!(said.lines().any(|there| there == line), "no {line} in {said}");
    }
    let decoded = ["-v", "error", "-i", &film, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"];
    let decoded = decoder("ffmpeg", &decoded);
    let size = 161 * 121 * 3;
    assert_eq!(decoded.len(), 12 * size);
    for (n, frame) in decoded.chunks_exact(size).enumerate() {
        let own = picture(&pictures, n);
        let own = own.rgba.chunks_exact(4).flat_map(|p| &p[..3]);
        let squares: f64 = own.zip(frame).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
        let psnr = 10.0 * (255.0f64.powi(2) * size as f64 / squares).log10();
        // 41 to 46 dB, as docs/formats.md and src/base/picture/film.rs say: rounded.
        assert!((40.5..46.5).contains(&psnr), "picture {n}: {psnr:.1} dB");
        eprintln!("picture {n}: {psnr:.1} dB");
    }
}

/// Prevents a film of a loop that is played back and forth which goes forwards only.
#[cfg(feature = "video")]
#[test]
fn a_film_goes_back_where_the_loop_does() {
    let folder = Folder::new("film-loop");
    let (sweep, film) = (folder.path("sweep.mha"), folder.path("loop.mp4"));
    done(&["phantom", "-o", &sweep, "--volumes", "4", "--both-ways", "--frames", "9", "--lines", "24"]);
    let loop_of = |marks: &str| {
        let said = done(&["render", &sweep, "--volumes", "loop", "--set", marks, "--size", "24x20", "-o", &film]);
        let last = said.lines().last().and_then(|last| last.strip_prefix(&format!("film: {film}, ")));
        let count = last.map(str::to_string);
        count.unwrap_or_else(|| panic!("{said}"))
    };
    assert_eq!(loop_of("cine={first=1}"), "3 pictures, 25 a second");
    assert_eq!(loop_of("cine={back_and_forth=true}"), "6 pictures, 25 a second");
    let decoded = decoder("ffmpeg", &["-v", "error", "-i", &film, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]);
    let pictures: Vec<&[u8]> = decoded.chunks_exact(24 * 20 * 3).collect();
    let mean = |a: usize, b: usize| {
        let sum: u32 = pictures[a].iter().zip(pictures[b]).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
        f64::from(sum) / pictures[a].len() as f64
    };
    // The way back shows the volumes of the way there; the loss of the film is all that differs.
    assert_eq!(pictures.len(), 6);
    assert!(mean(4, 2) < 0.5 * mean(4, 3) && mean(5, 1) < 0.5 * mean(5, 4), "{}, {}", mean(4, 2), mean(4, 3));
}
