//! The program as a user sees it: its answers to correct and wrong commands, and the files that it leaves.

mod batch;
mod bounds;
mod budget;
#[path = "../common/mod.rs"]
mod common;
mod compare;
mod demo_data;
mod devices;
#[cfg(feature = "view")]
mod direct;
mod docs;
mod drivers;
mod features;
mod filter;
mod frames;
mod inputs;
mod labels;
mod locks;
mod memory;
mod mesh;
mod one_colour;
mod oracle;
mod outputs;
mod pipelines;
mod presets;
mod privacy;
mod segment;
mod series;
mod service;
mod shaders;
mod signals;
mod snakemake;
mod standard_streams;
mod stic;
mod stream;
mod support_bundle;
mod tutorial;
mod verify;
mod verify_gtest;
mod verify_isolated;
#[cfg(feature = "view")]
mod view;
mod watchdog;
mod worksheet;

use common::program::*;
use std::collections::BTreeSet;
use std::fs;
use std::process::{Command, Stdio};

#[test]
fn a_wrong_command_line_is_not_left_without_its_usage_nor_a_command_without_help() {
    let wrong = "/phantom/info/bogus/--bogus/devices extra/info a.mha b.mha/render a.mha --bogus/\
                 render a.mha --volume x/render a.mha --volume -1/render a.mha --size/render a.mha --mode vr --mode sr";
    for arguments in wrong.split('/').map(|w| w.split_whitespace().collect::<Vec<_>>()) {
        let (code, out, err) = run(&arguments);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments:?}: {err}");
        assert!(err.contains("--help") && !err.contains("panicked"), "{arguments:?}: {err}");
    }
    for (command, named) in [
        ("render", "--explain"),
        ("phantom", "--seed"),
        ("verify", "--self-test"),
        ("info", "--probe"),
        ("devices", "--verbose"),
        ("support-bundle", "--config"),
    ] {
        assert!(done(&["--help"]).contains(command) && done(&[command, "--help"]).contains(named), "{command}");
    }
}

#[test]
fn wrong_recordings_cause_neither_a_panic_nor_a_picture() {
    let folder = Folder::new("recordings");
    let sweep = fs::read(SWEEP).expect("read the sweep");
    let split = sweep.windows(6).position(|w| w == b"LOCAL\n").expect("the header ends") + 6;
    let header = String::from_utf8(sweep[..split].to_vec()).expect("the header is text");
    let changed = |from: &str, to: &str| {
        assert!(header.contains(from), "{from}");
        folder.write(&to.replace('/', ""), [header.replace(from, to).as_bytes(), &sweep[split..]].concat())
    };
    let cut = |from: &str, keep: usize| {
        let whole = fs::read(from).expect("read a recording");
        folder.write(&format!("{keep}{}", &from[from.len() - 4..]), &whole[..keep])
    };
    for (file, named) in [
        (&folder.path("none.mha"), "cannot be read"),
        (&folder.path(""), "differ in more than a number"),
        (&folder.write("p.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"), "is a PNG picture"),
        (&cut(SWEEP, 0), "0.mha"),
        (&cut(SWEEP, sweep.len() - 1), "cut short"),
        (&cut(BONE, 300_000), "cut short"),
        (&cut(KRETZ, 800_000), "cut short"),
        (&changed("400 128 31", "65536 65536 65536"), "DimSize"),
        (&changed("Pitch = 0.0", "Pitch = nan"), "Pitch"),
        (&changed("= LOCAL", "= /etc/passwd"), "same folder"),
    ] {
        folder.refuses(&[file], &[named]);
        refuses(&["info", file], &run(&["info", file]), 2, &[named]);
    }
    folder.refuses(&[&changed("CompressedData = False", "CompressedData = True"), "--size", "4x4"], &["data"]);
}

#[test]
fn no_wrong_probe_or_scene_file_is_taken_for_a_default() {
    let folder = Folder::new("toml");
    let probe = fs::read_to_string(SWEEP.replace("sweep.mha", "probe.toml")).expect("read the probe file");
    let wrong = "radius_mm = 39.8 | radius_mm = nan | array.radius_mm\nradius_mm = 39.8 | radus_mm = 39.8 | radus_mm\n\
                 fan_angle_deg = 43 | fan_angle_deg = inf # | fan_angle_deg\n[array] | [array | line\n\
                 sample_pitch_mm = 0.25 | sample_pitch_mm = 1e300 | pitch\n\
                 frames_per_volume = 0 | frames_per_volume = 100 | frames_per_volume";
    for case in wrong.lines().map(|l| l.split(" | ").collect::<Vec<_>>()) {
        assert!(probe.contains(case[0]), "{case:?}");
        let file = folder.write("wrong.toml", probe.replace(case[0], case[1]));
        folder.refuses(&[SWEEP, "--probe", &file], &["wrong.toml", case[2]]);
    }
    let wrong = "[surface]\ntreshold = 0.1 | treshold;[surface]\nthreshold = nan | surface.threshold;\
                 [surface | unclosed;mode = 'sideways' | sideways;\"a\\nb\" = 1 | unknown field";
    for (text, named) in wrong.split(';').map(|w| w.split_once(" | ").expect("a file and what is said of it")) {
        folder.refuses(&[SWEEP, "--scene", &folder.write("scene.toml", text)], &[named]);
    }
    for flag in ["--probe", "--scene"] {
        folder.refuses(&[SWEEP, flag, &folder.path("none.toml")], &["none.toml", "cannot be read"]);
        folder.refuses(&[SWEEP, flag, &folder.path("")], &[]);
        folder.refuses(&[SWEEP, flag, BONE], &["bone.mha"]);
    }
}

#[test]
fn no_wrong_setting_is_refused_without_its_flag_or_name() {
    let folder = Folder::new("settings");
    let wrong = "--device 4096 | available: 0 ;--device no such card | available: 0 ;--preset foetal | bone, face;\
                 --mode sideways | --mode;--volume 1 | --volume 1;--size 64 | --size;--size 64x | --size;\
                 --size 64x48x2 | --size;--size 1.5x2 | --size;--size 0x0 | picture.size: is 0;--size 16385x1 | 16384;\
                 --camera azimuth | --camera;--camera azimuth=east | --camera;--camera azimut=1 | --camera;\
                 --camera target=1:2 | --camera;--camera azimuth=nan | camera.azimuth;--camera zoom=0 | camera.zoom;\
                 --camera a\nb | --camera;--roi depth=5 | --roi;--roi width=1:2 | --roi;\
                 --roi depth=50:20 | region.depth;--roi depth=500:600 | misses the volume;\
                 --roi lateral=nan:600 | region.lateral;--set threshold | key.path=value;--set a\nb=1 | unknown field;\
                 --set surface.treshold=0.1 | treshold;--set surface.threshold=nan | surface.threshold;\
                 --set surface.noise=11 | surface.noise;--set surface.detector=sharp | detector;\
                 --set slices.pixels=100000 | 4096";
    for (setting, named) in wrong.split(';').map(|w| w.split_once(" | ").expect("a setting and what is said of it")) {
        let (flag, value) = setting.split_once(' ').expect("a flag and its value");
        folder.refuses_with(if flag == "--device" { 3 } else { 2 }, &[SWEEP, flag, value], &[named]);
    }
    folder.refuses(&[SWEEP, "--mode", "sr", "--set", "surface.start_depth=500"], &["start_depth"]);
}

/// The phantom is shown under light in the volume unless somebody chooses another look.
#[test]
fn the_default_look_of_the_phantom_gives_way_to_any_other() {
    let plan = |flags: &[&str]| done(&[&["render", "--explain", "--size", "64x48"], flags].concat());
    for (flags, pass) in [
        (&[][..], "light_propagate"),
        (&["--layout", "4up"], "light_propagate"),
        (&["--mode", "sr"], "raycast_surface"),
        (&["--layout", "pair"], "raycast_surface_and_volume"),
        (&["--preset", "thesis"], "raycast_surface_and_volume"),
    ] {
        let text = plan(flags);
        assert!(text.contains(&format!("+ {pass} ")), "{flags:?}: {text}");
        assert_eq!(text.contains("+ light_propagate "), pass == "light_propagate", "{flags:?}: {text}");
    }
}

#[test]
fn later_layers_are_not_overridden_by_earlier_ones() {
    let folder = Folder::new("layers");
    let scene = folder.write("scene.toml", "mode = 'vr'\n[picture]\nsize = [40, 30]\n[distance]\nmedian = 0\n");
    let preset = ["--preset", "bone", "--mode", "sr"];
    assert!(explain(BONE, &preset).contains("+ median_distance     512 x 128 x 1"));
    let over_preset = explain(BONE, &[&preset[..], &["--scene", &scene]].concat());
    assert!(over_preset.contains("- median_distance") && over_preset.contains("40 x 30 x 1"), "{over_preset}");
    assert!(explain(BONE, &["--scene", &scene]).contains("+ raycast_volume      40 x 30 x 1"));
    let flags = ["--scene", &scene, "--mode", "sr", "--size", "64x48"];
    assert!(explain(BONE, &flags).contains("+ raycast_surface     64 x 48 x 1"));
    assert!(explain(BONE, &[&flags[..], &["--set", "picture.size=[20, 10]"]].concat()).contains("20 x 10 x 1"));
}

#[test]
fn without_a_device_the_plan_is_still_explained_and_the_rest_says_what_is_missing() {
    let folder = Folder::new("blind");
    let blind =
        |arguments: &[&str]| finish(without_device(Command::new(PROGRAM).args(arguments).current_dir(&folder.0)));
    for arguments in [&["devices"][..], &["render", BONE]] {
        refuses(arguments, &blind(arguments), 3, &["no Vulkan device", "install"]);
    }
    let (code, plan, err) = blind(&["render", BONE, "--size", "16384x16384", "--explain"]);
    let lines = ["- scan_convert        the volume is Cartesian already", "16384 x 16384 x 1", "total"];
    assert!(code == Some(0) && err.is_empty() && lines.iter().all(|l| plan.contains(l)), "{plan}{err}");
    assert!(folder.names().is_empty());
}

#[test]
fn info_does_not_hide_the_facts_and_devices_not_the_software() {
    for (file, facts) in [
        (SWEEP, ["pre-scan sweep", "128 lines of 400 samples", "1 of 31 frames", "39.8 mm"]),
        (KRETZ, ["Kretz volume", "128 lines of 400 samples", "1 of 31 frames", "39.8 mm"]),
        (BONE, ["zlib", "160 x 216 pixels", "33", "0.25 x 0.25 x 0.35 mm"]),
    ] {
        let said = done(&["info", file]);
        assert!(facts.iter().all(|f| said.contains(f)), "{file}: {said}");
    }
    let devices = done(&["devices"]);
    let (before, after) = devices.split_once("    picked:").expect("one is picked");
    let head = before.lines().rfind(|l| !l.starts_with(' ')).expect("it has a name");
    let software = head.contains("(software,");
    assert_eq!(after.lines().next().is_some_and(|l| l.contains("It is a software device")), software, "{devices}");
    let folder = Folder::new("devices");
    let said = render(BONE, &folder.path("p.png"), &[]);
    assert!(said.starts_with("device: ") && said.contains("(software: no GPU is used)") == software, "{said}");
}

#[test]
fn presets_pass_validation_and_do_not_differ_between_formats() {
    let folder = Folder::new("presets");
    let [_, mha, vol] =
        [(BONE, "bone", "a"), (SWEEP, "fetal", "b"), (KRETZ, "fetal", "c")].map(|(file, preset, name)| {
            render(file, &folder.path(name), &["--preset", preset, "--validate"]);
            assert_eq!(png_size(&folder.path(name)), [64, 48]);
            fs::read(folder.path(name)).expect("read the picture")
        });
    assert!(mha == vol, "the same sweep in two formats differs");
    done(&["render", SWEEP, "-o", &folder.path("dot"), "--size", "1x1", "--mode", "vr", "--validate"]);
    assert_eq!((png_size(&folder.path("dot")), folder.names().len()), ([1, 1], 4));
}

#[test]
fn no_slot_is_missing_from_the_dump_and_no_pass_from_the_times() {
    let folder = Folder::new("dump");
    let plan = explain(SWEEP, &["--size", "64x48", "--preset", "fetal"]);
    let (passes, slots) = plan.split_once("\nslots\n").expect("slots are listed");
    let mut slots = first_words(slots, "    ");
    assert_eq!(slots.pop().as_deref(), Some("total"), "the sum comes last");
    let dump = Folder(folder.0.join("new/dump"));
    let said = render(SWEEP, &folder.path("p.png"), &["--preset", "fetal", "--timings", "--dump", &dump.path("")]);
    let slots: BTreeSet<String> = slots.iter().map(|s| format!("{s}.png")).collect();
    assert_eq!(dump.names(), slots);
    slots.iter().for_each(|s| assert!(png_size(&dump.path(s))[0] > 0));
    // Volumes of colours are drawn too.
    let lit = ["--mode", "vr", "--set", "light.volume={cell=6}", "--dump", &dump.path("")];
    render(SWEEP, &folder.path("p.png"), &lit);
    assert!(png_size(&dump.path("light_shade.png"))[0] > 0);
    for pass in first_words(passes, "  + ") {
        assert_eq!(said.lines().filter(|l| l.split_whitespace().nth(1) == Some(&pass)).count(), 1, "{pass}: {said}");
    }
}

/// The dump is for other programs: it must hold every slot as numbers, and the distances must be those of the reference surface in mm.
#[test]
fn a_raw_dump_holds_every_slot_as_an_array_with_axes_and_units() {
    let folder = Folder::new("raw");
    let dump = Folder(folder.0.join("dump"));
    let more = ["--preset", "bone", "--dump", &dump.path(""), "--raw"];
    render(BONE, &folder.path("p.png"), &more);
    let json = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(dump.path(name)).expect("written")).expect("JSON")
    };
    let scene = json("scene.json");
    assert_eq!(
        (scene["rays"]["size"].clone(), scene["detector"]["step_mm"].clone()),
        (serde_json::json!([64, 48]), 0.25.into())
    );
    let mut arrays = 0;
    for name in dump.names().iter().filter_map(|n| n.strip_suffix(".npy")) {
        let bytes = fs::read(dump.path(&format!("{name}.npy"))).expect("written");
        let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let text = std::str::from_utf8(&bytes[10..header]).expect("ASCII");
        let shape = text.split(['(', ')']).nth(1).expect("a shape");
        let shape: Vec<usize> = shape.split(',').filter_map(|n| n.trim().parse().ok()).collect();
        let size = if text.contains("<f8") { 8 } else { 4 };
        let count = shape.iter().product::<usize>();
        let about = json(&format!("{name}.json"));
        assert_eq!(about["axes"].as_array().map(Vec::len), Some(shape.len()), "{name}");
        // Frames are kept for a moment only, and are not read back.
        assert!(bytes.len() == header + size * count && (count > 0 || name == "frames"), "{name}: {text}");
        let values: Vec<f64> =
            bytes[header..].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("4")).into()).collect();
        match name {
            "volume" => {
                assert!(about["unit"].as_str().is_some_and(|u| u.contains("before the grey window")) && shape[0] == 33)
            }
            "distance_map" => {
                assert_eq!((shape, about["unit"].as_str().map(|u| &u[..2])), (vec![48, 64], Some("mm")));
                let none = about["no_surface"].as_f64().expect("a number");
                let hits = values.iter().filter(|v| **v < none);
                assert!(hits.clone().count() > 100 && hits.clone().all(|v| (1.0..200.0).contains(v)));
            }
            _ => {}
        }
        arrays += 1;
    }
    assert_eq!(arrays, dump.names().iter().filter(|n| n.ends_with(".png")).count(), "one for every slot");
    assert_eq!(run(&["render", BONE, "--raw"]).0, Some(2), "--raw without --dump");
}

#[test]
fn unwritable_outputs_are_reported_and_nothing_is_destroyed() {
    let folder = Folder::new("outputs");
    let (file, copy) = (folder.write("file", "mine"), folder.path("copy.mha"));
    fs::copy(BONE, &copy).expect("copy the recording");
    let [none, here, below, log, p] = ["none/p.png", "", "file/p.png", "none/log", "p.png"].map(|n| folder.path(n));
    for (arguments, code, named) in [
        (&["render", BONE, "-o", &none][..], 1, "none/p.png"),
        (&["render", BONE, "-o", &here], 1, "cannot be written"),
        (&["render", BONE, "-o", &below], 1, "file/p.png"),
        (&["render", BONE, "-o", &p, "--dump", &file], 1, "file"),
        (&["render", &copy, "-o", &copy], 2, "copy.mha"),
        (&["info", BONE, "--log-file", &log], 2, "none/log"),
    ] {
        refuses(arguments, &run(arguments), code, &[named]);
    }
    assert!(fs::read(&copy).expect("read the copy") == fs::read(BONE).expect("read the original"));
    assert_eq!(fs::read(&file).expect("the file is still there"), b"mine");
    assert!(!folder.names().iter().any(|n| n.ends_with(".part")), "{:?}", folder.names());
}

#[cfg(unix)]
#[test]
fn a_full_disk_does_not_cost_the_old_picture_and_a_socket_is_not_replaced() {
    use std::os::unix::fs::FileTypeExt;
    let folder = Folder::new("full");
    let old = folder.write("old.png", "old");
    // No file may grow: what a full disk does, without needing one.
    let no_room = ["-c", "trap '' XFSZ; ulimit -f 0; exec \"$@\"", "sh", PROGRAM];
    let ran = finish(Command::new("sh").args(no_room).args(["render", BONE, "-o", &old, "--size", "64x48"]));
    refuses(&["full disk"], &ran, 1, &["old.png: cannot be written"]);
    assert!(fs::read(&old).expect("read the old picture") == b"old" && folder.names().len() == 1);
    let socket = folder.path("s");
    let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("make a socket");
    assert_ne!(run(&["render", BONE, "-o", &socket, "--size", "4x4"]).0, Some(0));
    assert!(fs::symlink_metadata(&socket).expect("the socket is still there").file_type().is_socket());
}

#[test]
fn a_reader_that_goes_away_is_no_panic_and_a_full_disk_no_success() {
    for arguments in [&["info", SWEEP][..], &["render", SWEEP, "--explain"], &["devices"]] {
        let mut command = Command::new(PROGRAM);
        let mut child = command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("start");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("wait for the program");
        assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]), "{arguments:?}");
        if let Ok(full) = fs::File::options().write(true).open("/dev/full") {
            let output = Command::new(PROGRAM).args(arguments).stdout(full).output().expect("start the program");
            assert_eq!(output.status.code(), Some(1), "{arguments:?} > /dev/full");
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_pipe_as_any_input_does_not_wait_for_ever() {
    let folder = Folder::new("pipe");
    let pipe = folder.path("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("run mkfifo").success());
    for arguments in [&["info", &pipe][..], &["info", SWEEP, "--probe", &pipe], &["render", SWEEP, "--scene", &pipe]] {
        refuses(arguments, &finish(Command::new("timeout").args(["20", PROGRAM]).args(arguments)), 2, &["pipe"]);
    }
}

#[test]
fn no_file_is_needed_to_see_a_face_and_a_phantom_is_a_recording_like_any_other() {
    let folder = Folder::new("phantom");
    let (face, sweep, again) = (folder.path("face.png"), folder.path("head.mha"), folder.path("again.png"));
    done(&["render", "-o", &face, "--size", "64x48", "--validate"]);
    done(&["phantom", "-o", &sweep, "--volumes", "2", "--both-ways", "--speed-ratio", "0"]);
    assert!(done(&["info", &sweep]).contains("2 of 37 frames"));
    render(&sweep, &again, &["--preset", "face"]);
    assert_eq!(fs::read(&face).expect("the face"), fs::read(&again).expect("the same from a file"));
    let output = folder.path("x.mha");
    for (arguments, named) in [
        (["--body", "tail"], "head, sphere"),
        (["--volumes", "0"], "volumes"),
        (["--sampling", "fast"], "live, gallery"),
        (["--psf-elevation", "11"], "psf_elevation"),
        (["--fan", "200"], "fan_angle"),
        (["--truth", &output], "is written by"),
    ] {
        let all = [&["phantom", "-o", &output], &arguments[..]].concat();
        refuses(&all, &run(&all), 2, &[named]);
    }
    assert!(!folder.names().iter().any(|n| n.starts_with('x')), "{:?}", folder.names());
}

#[test]
fn a_phantom_has_the_sampling_and_the_truth_that_are_asked_for() {
    let folder = Folder::new("truth");
    let (sweep, truth) = (folder.path("sweep.mha"), folder.path("truth.mha"));
    let sampling = ["--sampling", "gallery", "--frames", "7", "--lines", "40", "--fan", "50", "--psf-lateral", "0"];
    let made = [&["phantom", "-o", &sweep, "--truth", &truth, "--truth-spacing", "4"][..], &sampling].concat();
    let said = done(&made);
    assert!(said.contains("6 choroid plexus") && said.contains("truth.distance.mha"), "{said}");
    assert!(done(&["info", &sweep]).contains("1 of 7 frames"));
    let probe = fs::read_to_string(folder.path("sweep.probe.toml")).expect("the probe file");
    assert!(probe.contains("fan_angle_deg = 50.0"), "{probe}");
    // The same grid as that of the converted sweep.
    done(&["convert", &sweep, &folder.path("volume.mha"), "--spacing", "4"]);
    let size = |name: &str| {
        let text = done(&["info", &folder.path(name)]);
        let line = text.lines().find(|l| l.contains(" x ")).expect("a size");
        line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(size("volume.mha"), size("truth.mha"));
    assert_eq!(size("volume.mha"), size("truth.distance.mha"));
}

#[cfg(unix)]
#[test]
fn the_program_needs_no_source_tree_no_path_and_no_place() {
    let folder = Folder::new("moved");
    // Copied by another process: a file that this one has open for writing could not be executed.
    assert!(Command::new("cp").args([PROGRAM, &folder.path("moved")]).status().expect("run cp").success());
    let mut command = Command::new(folder.path("moved"));
    command.args(["render", BONE, "-o", "p.png", "--size", "64x48"]).env("PATH", "").current_dir(&folder.0);
    let (code, _, err) = finish(&mut command);
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert_eq!(png_size(&folder.path("p.png")), [64, 48]);
}

#[cfg(not(feature = "view"))]
#[test]
fn without_the_feature_view_the_command_says_how_to_have_it() {
    for arguments in [&["view"][..], &["view", "--help"], &["view", "--source", "sweep.frames", "--full-screen"]] {
        refuses(arguments, &run(arguments), 2, &["without the feature `view`", "cargo build --release"]);
    }
    assert!(!done(&["--help"]).contains("  view"), "help names a command that is not there");
}
