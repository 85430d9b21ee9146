//! Files of frames: their contents, and the conversion back.

use crate::common::program::*;
use std::fs;

/// The samples after the header of a MetaImage.
fn samples(path: &str) -> Vec<u8> {
    let bytes = fs::read(path).expect("read a MetaImage");
    let end = bytes.windows(6).position(|w| w == b"LOCAL\n").expect("the header ends") + 6;
    bytes[end..].to_vec()
}

/// Facts that both files state, without those of the file format.
fn geometry(path: &str) -> Vec<String> {
    let same = ["array", "scan lines", "depth", "motion", "slices", "speed of sound", "frame ", "value range"];
    done(&["info", path]).lines().filter(|l| same.iter().any(|s| l.starts_with(s))).map(str::to_string).collect()
}

#[test]
fn a_sweep_goes_into_frames_and_back_without_a_change() {
    let folder = Folder::new("frames");
    let [head, frames, back, a, b] =
        ["head.mha", "head.frames", "back.mha", "a.nrrd", "b.nrrd"].map(|n| folder.path(n));
    done(&["phantom", "-o", &head, "--volumes", "3", "--both-ways", "--no-speckle"]);
    done(&["convert", &head, &frames]);
    let said = done(&["info", &frames]);
    for fact in [
        "frames as they arrived",
        "u8",
        "111",
        "3 of 37 frames, 3 whole, 1 swept backwards",
        "fan about an axis",
        "0 frames",
        "0 bytes",
        "as it was written",
    ] {
        assert!(said.contains(fact), "{fact}: {said}");
    }
    let rate = said.lines().find(|l| l.starts_with("arrival")).expect("a line of arrivals");
    assert!(rate.contains("frames a second, at most"), "{rate}");
    // A volume is the same in both.
    for (from, to) in [(&head, &a), (&frames, &b)] {
        done(&["convert", from, to, "--spacing", "3", "--volume", "1"]);
    }
    assert!(fs::read(&a).expect("a volume") == fs::read(&b).expect("a volume"));
    // So are all frames.
    let said = done(&["convert", &frames, &back, "--sequence"]);
    assert!(said.ends_with("back.mha, 111 frames of 3 volumes\n"), "{said}");
    assert!(samples(&head) == samples(&back));
    assert_eq!(geometry(&head), geometry(&back));
    assert_eq!(geometry(&frames), geometry(&back));
    assert!(
        done(&["info", &back]).contains("3 of 37 frames, swept forwards and backwards in turn, motor moving for 0.5")
    );
    let again = folder.path("again.frames");
    done(&["convert", &back, &again]);
    assert!(fs::read(&frames).expect("frames").len() == fs::read(&again).expect("frames").len());
}

#[test]
fn damaged_and_missing_frames_are_reported_and_make_no_sequence() {
    let folder = Folder::new("damaged");
    let [head, frames, back, volume] = ["head.mha", "head.frames", "back.mha", "v.mha"].map(|n| folder.path(n));
    done(&["phantom", "-o", &head, "--volumes", "3", "--both-ways", "--no-speckle", "--speed-ratio", "0"]);
    done(&["convert", &head, &frames]);
    let mut bytes = fs::read(&frames).expect("frames");
    let record = (bytes.len() - 2000) / 111;
    // A sample of a frame in the middle volume, and the end.
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    bytes.truncate(bytes.len() - record / 2);
    fs::write(&frames, &bytes).expect("write the frames");
    let said = done(&["info", &frames]);
    for fact in ["109", "3 of 37 frames, 1 whole, 1 swept backwards", "1 frames", "missing or wrong; made anew"] {
        assert!(said.contains(fact), "{fact}: {said}");
    }
    let said = done(&["convert", &frames, &volume, "--spacing", "5", "--volume", "1"]);
    assert!(said.contains(", 36 of 37 frames are there"), "{said}");
    let said = done(&["convert", &frames, &back, "--sequence"]);
    assert!(said.contains("37 frames of 1 volumes; 2 volumes are left out"), "{said}");
    assert!(samples(&back) == samples(&head)[..samples(&head).len() / 3]);
}

#[test]
fn no_sequence_is_made_of_other_files() {
    let folder = Folder::new("sequence");
    let [out, nrrd, frames] = ["out.mha", "out.nrrd", "out.frames"].map(|n| folder.path(n));
    for (arguments, named) in [
        (&["convert", BONE, &out, "--sequence"][..], "bone.mha: geometry: the frames are pictures"),
        (&["convert", SWEEP, &nrrd, "--sequence"], "must end in .mha"),
        (&["convert", SWEEP, &frames, "--sequence"], "--sequence"),
        (&["convert", "none.frames", &out, "--sequence"], "none.frames"),
        (&["info", &folder.write("x.frames", "ECHOFRMS and nothing more")], "x.frames"),
    ] {
        refuses(arguments, &run(arguments), 2, &[named]);
    }
    assert_eq!(run(&["convert", SWEEP, &out, "--sequence", "--volume", "1"]).0, Some(2));
    let here = folder.write("here.mha", fs::read(SWEEP).expect("the sweep"));
    let probe = folder.write("out.probe.toml", fs::read(SWEEP.replace("sweep.mha", "probe.toml")).expect("its probe"));
    let arguments = ["convert", &here, &out, "--sequence", "--probe", &probe];
    refuses(&arguments, &run(&arguments), 2, &["would replace an input"]);
    let arguments = ["convert", &here, &here, "--sequence"];
    refuses(&arguments, &run(&arguments), 2, &["would replace an input"]);
    assert_eq!(folder.names().len(), 3, "{:?}", folder.names());
}
