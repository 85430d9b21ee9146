//! The program as a user meets it: what it answers to right and wrong commands, and what it leaves behind.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

const PROGRAM: &str = env!("CARGO_BIN_EXE_echolume");
const SWEEP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/wobbler-4dc7/sweep.mha");
const KRETZ: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/wobbler-4dc7/sweep.vol");
const BONE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bone-l14/bone.mha");

/// A folder of one test, gone at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("echolume-cli-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("make a folder for the test");
        Folder(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("the temporary folder has a plain name").to_string()
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        let path = self.path(name);
        fs::write(&path, bytes).expect("write a file of the test");
        path
    }

    fn names(&self) -> BTreeSet<String> {
        let entries = fs::read_dir(&self.0).expect("list the test's folder").map(|e| e.expect("read an entry"));
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect()
    }

    /// A refused rendering leaves the picture that was there, and nothing beside it.
    fn refuses(&self, arguments: &[&str], named: &[&str]) {
        let old = self.write("old.png", "old");
        let (all, before) = ([&["render"], arguments, &["-o", &old]].concat(), self.names());
        refuses(&all, &run(&all), 2, named);
        assert_eq!(fs::read(&old).expect("the old picture is still there"), b"old", "{all:?}");
        assert_eq!(self.names(), before, "{all:?}");
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Exit code, standard output and standard error.
type Ran = (Option<i32>, String, String);

fn finish(command: &mut Command) -> Ran {
    let output = command.stdin(Stdio::null()).output().expect("start the program");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn run(arguments: &[&str]) -> Ran {
    finish(Command::new(PROGRAM).args(arguments))
}

/// Runs what has to work, and gives what it prints.
fn done(arguments: &[&str]) -> String {
    let (code, out, err) = run(arguments);
    assert_eq!(code, Some(0), "{arguments:?}: {err}");
    out
}

fn render(input: &str, output: &str, more: &[&str]) -> String {
    done(&[&["render", input, "-o", output, "--size", "64x48"], more].concat())
}

fn explain(input: &str, more: &[&str]) -> String {
    done(&[&["render", input, "--explain"], more].concat())
}

fn refuses(what: &[&str], (code, _, err): &Ran, wanted: i32, named: &[&str]) {
    let said = format!("{what:?} ended with {code:?} and said {err:?}, not {wanted} and {named:?}");
    let line = err.strip_suffix('\n').unwrap_or(err);
    assert!(*code == Some(wanted) && named.iter().all(|n| line.contains(n)), "{said}");
    let plain = !line.chars().any(char::is_control) && line.len() < 1000;
    assert!(plain && line.starts_with("echolume: "), "not one plain line: {said}");
}

fn png_size(path: &str) -> [u32; 2] {
    let bytes = fs::read(path).expect("read the picture");
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{path} is no PNG");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")))
}

/// Words of the lines that begin so, each line's first word after it.
fn first_words(text: &str, start: &str) -> Vec<String> {
    let lines = text.lines().filter_map(|l| l.strip_prefix(start));
    lines.filter_map(|l| l.split_whitespace().next()).map(str::to_string).collect()
}

#[test]
fn a_wrong_command_line_is_not_left_without_its_usage_nor_a_command_without_help() {
    let wrong = "/phantom/info/bogus/--bogus/devices extra/info a.mha b.mha/render a.mha --bogus/\
                 render a.mha --volume x/render a.mha --volume -1/render a.mha --size/render a.mha --mode vr --mode sr";
    for arguments in wrong.split('/').map(|w| w.split_whitespace().collect::<Vec<_>>()) {
        let (code, out, err) = run(&arguments);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments:?}: {err}");
        assert!(err.contains("--help") && !err.contains("panicked"), "{arguments:?}: {err}");
    }
    for (command, named) in
        [("render", "--explain"), ("phantom", "--seed"), ("info", "--probe"), ("devices", "--verbose")]
    {
        assert!(done(&["--help"]).contains(command) && done(&[command, "--help"]).contains(named), "{command}");
    }
}

#[test]
fn no_wrong_recording_is_met_with_a_panic_or_a_picture() {
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
        (&folder.path(""), "not a regular file"),
        (&folder.write("p.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"), "no known format"),
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
    let wrong = "--device 4096 | there are: 0 ;--device no such card | there are: 0 ;--preset foetal | bone, fetal;\
                 --mode sideways | --mode;--volume 1 | --volume 1;--size 64 | --size;--size 64x | --size;\
                 --size 64x48x2 | --size;--size 1.5x2 | --size;--size 0x0 | 0x0;--size 16385x1 | 16384;\
                 --camera azimuth | --camera;--camera azimuth=east | --camera;--camera azimut=1 | --camera;\
                 --camera target=1:2 | --camera;--camera azimuth=nan | camera.azimuth;--camera zoom=0 | camera.zoom;\
                 --camera a\nb | --camera;--roi depth=5 | --roi;--roi width=1:2 | --roi;\
                 --roi depth=50:20 | region.depth;--roi depth=500:600 | misses the volume;\
                 --roi lateral=nan:600 | region.lateral;--set threshold | key.path=value;--set a\nb=1 | unknown field;\
                 --set surface.treshold=0.1 | treshold;--set surface.threshold=nan | surface.threshold;\
                 --set surface.noise=11 | surface.noise;--set surface.detector=sharp | detector;\
                 --set slices.pixels=100000 | 4096;--set surface.start_depth=500 | start_depth";
    for (setting, named) in wrong.split(';').map(|w| w.split_once(" | ").expect("a setting and what is said of it")) {
        let (flag, value) = setting.split_once(' ').expect("a flag and its value");
        folder.refuses(&[SWEEP, flag, value], &[named]);
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
    let blind = |arguments: &[&str]| {
        let hidden = [("VK_DRIVER_FILES", "/nonexistent"), ("VK_ICD_FILENAMES", "/nonexistent")];
        let mut command = Command::new(PROGRAM);
        finish(command.args(arguments).envs(hidden).env_remove("VK_ADD_DRIVER_FILES").current_dir(&folder.0))
    };
    for arguments in [&["devices"][..], &["render", BONE]] {
        refuses(arguments, &blind(arguments), 1, &["no Vulkan device", "install"]);
    }
    let (code, plan, err) = blind(&["render", BONE, "--size", "16384x16384", "--explain"]);
    let lines = ["- scan_convert        the volume is Cartesian already", "16384 x 16384 x 1", "in all"];
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
    assert_eq!(after.lines().next().is_some_and(|l| l.contains("It is software")), software, "{devices}");
    let folder = Folder::new("devices");
    let said = render(BONE, &folder.path("p.png"), &[]);
    assert!(said.starts_with("device: ") && said.contains("(software: no GPU is used)") == software, "{said}");
}

#[test]
fn presets_do_not_break_the_rules_of_vulkan_nor_differ_between_formats() {
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
    assert_eq!(slots.pop().as_deref(), Some("in"), "the sum comes last");
    let dump = Folder(folder.0.join("new/dump"));
    let said = render(SWEEP, &folder.path("p.png"), &["--preset", "fetal", "--timings", "--dump", &dump.path("")]);
    let slots: BTreeSet<String> = slots.iter().map(|s| format!("{s}.png")).collect();
    assert_eq!(dump.names(), slots);
    slots.iter().for_each(|s| assert!(png_size(&dump.path(s))[0] > 0));
    for pass in first_words(passes, "  + ") {
        assert_eq!(said.lines().filter(|l| l.split_whitespace().nth(1) == Some(&pass)).count(), 1, "{pass}: {said}");
    }
}

#[test]
fn what_cannot_be_written_is_said_and_nothing_is_destroyed() {
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
    render(&sweep, &again, &["--preset", "phantom"]);
    assert_eq!(fs::read(&face).expect("the face"), fs::read(&again).expect("the same from a file"));
    for (arguments, named) in [(["--body", "tail"], "head, sphere"), (["--volumes", "0"], "volumes")] {
        let output = folder.path("x.mha");
        let all = [&["phantom", "-o", &output], &arguments[..]].concat();
        refuses(&all, &run(&all), 2, &[named]);
    }
    assert!(!folder.names().iter().any(|n| n.starts_with('x')), "{:?}", folder.names());
}

#[cfg(unix)]
#[test]
fn the_program_needs_no_source_tree_no_path_and_no_place() {
    let folder = Folder::new("moved");
    // By another process: a file that this one has open for writing could not be started.
    assert!(Command::new("cp").args([PROGRAM, &folder.path("moved")]).status().expect("run cp").success());
    let mut command = Command::new(folder.path("moved"));
    command.args(["render", BONE, "-o", "p.png", "--size", "64x48"]).env("PATH", "").current_dir(&folder.0);
    let (code, _, err) = finish(&mut command);
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert_eq!(png_size(&folder.path("p.png")), [64, 48]);
}

/// An error report of the bone's volume with one dial: as it is 20 ms, with longer steps 8 ms.
fn error_report(volume: &str) -> String {
    let point = |label: &str, set: &str, value: f64, rmse: f64, ms: f64, is_default: bool| {
        let time = ms * 1e6;
        format!(
            "{{\"label\": \"{label}\", \"set\": [{set}], \"value\": {value}, \"errors\": {{\"rmse\": {rmse}, \"max\": 0.1}}, \
             \"time\": {{\"median\": {time}, \"low\": {time}, \"high\": {time}}}, \"is_default\": {is_default}}}"
        )
    };
    format!(
        "{{\"format\": \"echolume error report 1\", \"device\": \"a card\", \"driver\": \"1\", \"date\": \"2026-11-21\", \
         \"scene\": \"bone\", \"sizes\": {{\"volume\": {volume}, \"picture\": [64, 48]}}, \"repeats\": 3, \"dials\": [{{\
         \"name\": \"step\", \"unit\": \"mm\", \"reference\": {{\"kind\": \"f64\"}}, \"points\": [{}, {}]}}]}}",
        point("0.5 mm", "", 0.5, 0.001, 20.0, true),
        point("1.25 mm", "\"ray.step=1.25\"", 1.25, 0.004, 8.0, false)
    )
}

#[test]
fn a_budget_of_time_takes_what_a_report_measured_and_no_setting_of_the_users() {
    let folder = Folder::new("budget");
    let report = folder.write("error.json", error_report("[160, 216, 33]"));
    let picture = |name: &str, more: &[&str]| {
        let said = render(BONE, &folder.path(name), more);
        (said, fs::read(folder.path(name)).expect("the picture"))
    };
    let (_, plain) = picture("plain.png", &["--set", "ray.step=0.5"]);
    let (_, coarse) = picture("coarse.png", &["--set", "ray.step=1.25"]);
    assert_ne!(plain, coarse);
    let (said, chosen) = picture("chosen.png", &["--budget", "10ms", "--report", &report]);
    assert!(
        said.contains("budget 10ms: (ray.step=1.25) has RMSE 4.000e-3 and takes 8.000 ms, measured on a card"),
        "{said}"
    );
    assert_eq!(chosen, coarse);
    let (said, ample) = picture("ample.png", &["--budget", "0.1s", "--report", &report]);
    assert!(said.contains("(the default)"), "{said}");
    assert_eq!(ample, picture("default.png", &[]).1);
    let (_, mine) = picture("mine.png", &["--budget", "10ms", "--report", &report, "--set", "ray.step=0.5"]);
    assert_eq!(mine, plain, "what the user sets is above it");

    let other = folder.write("other.json", error_report("[1, 2, 3]"));
    let foreign = folder.write("foreign.json", "{\"format\": \"somebody else's\"}");
    let text = folder.write("text.json", "not a report");
    for (budget, file, named) in [
        ("10ms", &folder.path("missing.json"), "missing.json: cannot be read"),
        ("10ms", &foreign, "somebody else's"),
        ("10ms", &text, "text.json: error report: cannot be read"),
        ("10ms", &other, "1x2x3"),
        ("soon", &report, "--budget soon"),
    ] {
        folder.refuses(&[BONE, "--budget", budget, "--report", file], &[named]);
    }
    let all = ["render", BONE, "--budget", "1ms", "--report", &report, "-o", &folder.path("never.png")];
    refuses(&all, &run(&all), 1, &["--budget 1ms", "no setting takes", "8.000 ms"]);
    for alone in [["--budget", "10ms"], ["--report", &report]] {
        assert_eq!(run(&[&["render", BONE][..], &alone].concat()).0, Some(2), "{alone:?}");
    }
}
