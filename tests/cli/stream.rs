//! `echolume stream`: sources that appear, disappear, and send wrong data.

use crate::common::program::*;
use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};

const SMALL: [&str; 6] = ["--mode", "mip", "--size", "48x40", "--set", "slices.pixels=64"];

/// A pipe of so many frames of two slices' volumes, 4 lines of 16 samples.
fn piped(frames: usize, cut: usize) -> Vec<u8> {
    let head = r#"{"echolume": 1, "type": "u8", "cartesian": {"size": [16, 4, 2], "spacing": [1, 1, 1], "origin": [0, 0, 0]}}"#;
    let samples = (0..frames * 64).map(|i| (i / 64 * 20) as u8);
    let mut bytes: Vec<u8> = head.bytes().chain([b'\n']).chain(samples).collect();
    bytes.truncate(bytes.len() - cut);
    bytes
}

fn fed(arguments: &[&str], input: &[u8]) -> Ran {
    let mut command = Command::new(PROGRAM);
    let child = command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = child.expect("start the program");
    // A program that refuses the first line reads no further.
    let _ = child.stdin.take().expect("a pipe").write_all(input);
    let output = child.wait_with_output().expect("the program ends");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_recording_of_a_stream_is_replayed_to_the_same_pictures_bit_for_bit() {
    let folder = Folder::new("stream");
    let (first, tape, second) = (folder.path("first"), folder.path("tape.frames"), folder.path("second"));
    let said = done(
        &[&["stream", "--source", SWEEP, "--rounds", "3", "--out", &first, "--record", &tape], &SMALL[..]].concat(),
    );
    assert!(said.contains("93 frames, 3 volumes shown, 0 dropped, 0 incomplete, 3 pictures"), "{said}");
    for how in [&["--rounds", "1"][..], &["--rate", "20"], &["--real-time", "--update", "rolling"]] {
        done(&[&["stream", "--source", &tape, "--out", &second, "--validate"], how, &SMALL[..]].concat());
        // The last picture always shows all frames.
        let last = |folder: &str| {
            let names = fs::read_dir(folder).expect("list the pictures").map(|e| e.expect("an entry").path());
            fs::read(names.max().expect("a picture")).expect("read a picture")
        };
        assert!(last(&first) == last(&second), "{how:?}");
        fs::remove_dir_all(&second).expect("remove the pictures");
    }
    // A picture of the recording is that of its source.
    let rendered = folder.path("rendered.png");
    done(&[&["render", SWEEP, "-o", &rendered], &SMALL[..]].concat());
    let pixels = |file: &str| image::open(file).expect("a picture").to_rgba8();
    let streamed = pixels(&format!("{first}/volume-000000.png"));
    assert!(pixels(&rendered) == streamed);
    // With its bar, if that is asked for: the pixels above it are the same.
    let bar = ["stream", "--source", &tape, "--out", &second, "--rounds", "1", "--set", "marks.bar=true"];
    done(&[&bar, &SMALL[..]].concat());
    let marked = pixels(&format!("{second}/volume-000000.png"));
    let (width, height) = streamed.dimensions();
    assert!(marked.width() == width && marked.height() > height);
    let middle = |picture: &image::RgbaImage| {
        image::imageops::crop_imm(picture, width / 4, height / 4, width / 2, height / 2).to_image()
    };
    assert!(middle(&marked) == middle(&streamed));
}

#[test]
fn a_pipe_is_drawn_to_its_last_complete_volume_and_its_faults_are_reported() {
    let folder = Folder::new("pipe");
    let out = folder.path("out");
    let stream = ["stream", "--source", "-", "--mode", "mip", "--size", "24x24", "--out", &out];
    let file = folder.path("stream.prom");
    let (code, said, err) = fed(&[&stream[..], &["--prometheus", &file]].concat(), &piped(7, 0));
    let metrics = fs::read_to_string(&file).expect("metrics");
    for line in [
        "echolume_running 0",
        "echolume_frames_total 7",
        "echolume_volumes_total{result=\"shown\"} 3",
        "echolume_volumes_total{result=\"incomplete\"} 1",
        "echolume_pictures_total 3",
        "echolume_latency_seconds_count 6",
        "echolume_pass_seconds_count{pass=\"frame\"} 7",
        "echolume_source_faults_total{kind=\"ended\"} 0",
    ] {
        assert!(metrics.lines().any(|told| told == line), "{line}: {metrics}");
    }
    assert!(metrics.contains("echolume_info{command=\"stream\",version=\""), "{metrics}");
    assert_eq!((code, err.as_str()), (Some(0), ""), "{said}");
    assert!(said.contains("7 frames, 3 volumes shown, 0 dropped, 1 incomplete, 3 pictures"), "{said}");
    assert!(fs::exists(format!("{out}/volume-000002.png")).expect("look"));
    for (input, named) in [
        (piped(7, 30), "cut short"),
        (b"hello\n".to_vec(), "pipe_frames.py"),
        (piped(0, 1), "header"),
        (Vec::new(), "header"),
        (
            b"{\"echolume\": 1, \"samples\": 1152921504606846976, \"lines\": 2, \"frames\": 2, \"type\": \"u8\"}\n"
                .to_vec(),
            "samples",
        ),
        (vec![b'x'; 1 << 20], "header"),
    ] {
        let (code, _, err) = fed(&stream, &input);
        assert_eq!((code, err.lines().count()), (Some(1), 1), "{named}: {err}");
        assert!(err.contains(named) && err.contains("standard input"), "{named}: {err}");
    }
}

#[test]
fn a_stream_that_cannot_begin_says_why_and_writes_nothing() {
    let folder = Folder::new("refused");
    for (arguments, named) in [
        (&["--null", "--source", "none.mha"][..], "none.mha"),
        (&["--null", "--update", "sideways"], "--update sideways"),
        (&["--null", "--rate", "0"], "--rate 0"),
        (&["--null", "--rate", "nan"], "--rate"),
        (&["--null", "--images", "4"], "--images"),
        (&["--null", "--queues", "0"], "--queues"),
        (&["--null", "--record", "tape.mha"], ".frames"),
        (&["--null", "--record", "none/tape.frames"], "none/tape.frames"),
        (&["--null", "--prometheus", "none/a.prom"], "none/a.prom"),
        (&["--null", "--source", "igtl://"], "igtl://HOST"),
        (&["--null", "--source", "igtl://localhost", "--clip", "1,2"], "--clip 1,2"),
        (&["--null", "--source", "igtl://localhost", "--spacing", "0"], "--spacing"),
        (&["--null", "--clip", "1,2,3,4"], "--clip: is for frames with poses"),
        (&["--null", "--mode", "sideways"], "sideways"),
        (&["--null", "--serve", "localhost"], "igtl://HOST"),
        (&["--null", "--serve", "--serve-spacing", "0"], "--serve-spacing 0"),
        (&["--null", "--serve-spacing", "1"], "--serve"),
        (&["--null", "--for", "tomorrow"], "--for"),
        (&[], "--out"),
        (&["--null", "--out", "x"], "--null"),
    ] {
        let all = [&["stream"], arguments].concat();
        let (code, _, err) = finish(Command::new(PROGRAM).args(&all).current_dir(&folder.0));
        assert!(code == Some(2) || (code == Some(1) && named.contains("none/")), "{all:?}: {code:?} {err}");
        assert!(err.contains(named) && !err.contains("panicked"), "{all:?}: {err}");
    }
    assert!(folder.names().is_empty(), "{:?}", folder.names());
}

#[test]
fn the_phantom_streams_until_it_is_stopped() {
    let said = done(&[&["stream", "--null", "--rate", "4", "--volumes", "3", "--validate"], &SMALL[..]].concat());
    let last = said.lines().last().expect("a line");
    assert!(last.contains(" 3 volumes shown") || last.contains(" 4 volumes shown"), "{said}");
    // A busy machine draws no picture in so short a time.
    let for_a_while =
        |time| done(&[&["stream", "--null", "--rate", "4", "--for", time, "--update", "rolling"], &SMALL[..]].concat());
    let mut tries = ["2500ms", "10s", "60s"].into_iter().map(for_a_while);
    let said = tries.find(|said| said.contains("latency ms p50")).expect("a picture in a minute");
    assert!(said.lines().filter(|l| l.contains(" s  frames ")).count() >= 1, "{said}");
    assert!(said.contains("what sound allows"), "{said}");
}

/// As in two terminals: a simulated motor in one, a stream swept by it in the other, until SIGINT.
#[cfg(target_os = "linux")]
#[test]
fn a_motor_sweeps_the_phantom_until_a_signal_stops_both() {
    use crate::common::motor::{simulated, stopped_at_last};
    use rustix::process::{Pid, Signal, kill_process};
    use std::io::{BufRead, BufReader};

    let folder = Folder::new("motor");
    let tape = folder.path("exam.frames");
    let simulator = simulated(None);
    let mut child = start(
        with_default_signals()
            .args(["stream", "--null", "--probe", MOTOR_PROBE, "--sweeps", "1", "--timeout", "2000", "--record", &tape])
            .args(SMALL)
            .arg("--motor")
            .arg(simulator.path()),
    );
    let mut lines = BufReader::new(child.stdout.take().expect("its output")).lines().map_while(Result::ok);
    let shown = lines.find(|line| line.contains(" s  frames ") && !line.contains("volumes 0.00/s"));
    assert!(shown.is_some(), "no volume was shown");
    kill_process(Pid::from_child(&child), Signal::INT).expect("send a signal");
    let last = lines.last().expect("a last line");
    assert!(last.contains("volumes shown"), "{last}");
    let output = child.wait_with_output().expect("the program ends");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(stopped_at_last(&simulator.received()), "the motor was told to stop last");
    let said = done(&["info", &tape]);
    assert!(said.contains("index") && said.contains("as it was written"), "{said}");
}

/// Prevents an exam that seems to be recorded and is not: on a full disk, or with an existing file.
#[test]
fn a_recording_that_cannot_be_made_is_a_failure() {
    let folder = Folder::new("full");
    let there = folder.write("there.frames", "an exam");
    let (code, _, err) = run(&[&["stream", "--source", SWEEP, "--null", "--record", &there], &SMALL[..]].concat());
    assert!(code == Some(2) && err.contains("exists already"), "{code:?} {err}");
    assert_eq!(fs::read_to_string(&there).expect("read"), "an exam");
    // A file may hold 200 kB, four of the sweep's frames.
    let limited = format!(
        "ulimit -f 200; trap '' XFSZ; exec {PROGRAM} stream --source {SWEEP} --null --record {} {}",
        folder.path("full.frames"),
        SMALL.join(" ")
    );
    let (code, said, err) = finish(Command::new("bash").args(["-c", &limited]));
    assert!(code == Some(1) && err.contains("could not be written"), "{code:?} {said} {err}");
    assert!(said.contains("31 frames, 1 volumes shown"), "what cannot be recorded is shown all the same: {said}");
}

/// A client of the program's server gets its pictures and its volumes, and the server ends with the stream.
#[test]
fn clients_of_the_server_get_pictures_and_volumes() {
    use echolume::low_level::source::igtl::{Client, ClientOptions, Message, PICTURE, VOLUME};
    use std::io::{BufRead, BufReader};
    use std::time::Duration;

    let mut child = start(
        with_default_signals()
            .args(["stream", "--null", "--rate", "4", "--serve", "igtl://127.0.0.1:0", "--serve-spacing", "3"])
            .args(SMALL),
    );
    let mut lines = BufReader::new(child.stdout.take().expect("its output")).lines().map_while(Result::ok);
    let served = lines.find_map(|line| line.strip_prefix("serving: igtl://").map(str::to_string)).expect("an address");
    assert!(served.starts_with("127.0.0.1:"), "{served}");
    let (code, _, err) = run(&["stream", "--null", "--serve", &format!("igtl://{served}")]);
    assert!(code == Some(1) && err.lines().count() == 1 && err.contains("the port is in use"), "{code:?} {err}");
    let client = Client::connect(&served, ClientOptions::default()).expect("a thread");
    let (mut picture, mut volume) = (None, None);
    while picture.is_none() || volume.is_none() {
        match client.next(Duration::from_secs(60)).expect("a message").message {
            Message::Image(image) if image.device == PICTURE => picture = Some(image),
            Message::Image(image) if image.device == VOLUME => volume = Some(image),
            other => panic!("{other:?}"),
        }
    }
    let (picture, volume) = (picture.expect("a picture"), volume.expect("a volume"));
    assert_eq!((picture.size, picture.components), ([48, 40, 1], 3));
    assert!(picture.bytes.iter().any(|v| *v > 40), "it shows something");
    assert!(volume.spacing().iter().all(|mm| (mm - 3.0).abs() < 1e-5), "{:?}", volume.spacing());
    assert!(volume.bytes.iter().any(|v| *v > 40), "it holds something");
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Pid, Signal, kill_process};
        kill_process(Pid::from_child(&child), Signal::INT).expect("send a signal");
    }
    let rest: Vec<String> = lines.collect();
    assert!(rest.iter().any(|line| line.starts_with("served    ") && line.contains(" of 1, ")), "{rest:?}");
    assert_eq!(child.wait().expect("the program ends").code(), Some(0));
}
