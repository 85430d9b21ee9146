//! A second implementation of stage 2 and of the light volume, in numpy, agrees with what the program writes.

use crate::common::files::repository;
use crate::common::program::*;
use std::fs;
use std::process::Command;

/// Whether the oracle agrees, and what it prints.
fn oracle(dump: &Folder) -> (bool, String) {
    let script = repository("tests/oracle/check.py");
    let mut said = String::new();
    // Another Python may come before Debian's, which tools/test installs numpy for.
    for python in ["python3", "/usr/bin/python3"] {
        let Ok(out) = Command::new(python).arg(&script).arg(&dump.0).output() else { continue };
        said = [&out.stdout, &out.stderr].map(|text| String::from_utf8_lossy(text).into_owned()).concat();
        if !said.contains("ModuleNotFoundError") {
            return (out.status.success(), said);
        }
    }
    panic!("python3 with numpy is missing, tools/test installs both: {said}")
}

/// References that share the program's definitions agree with it where both are wrong. This one shares docs/numerics.md.
#[test]
fn numpy_casts_the_same_rays_through_the_same_volume() {
    let folder = Folder::new("oracle");
    for (name, input, more, change) in [
        ("surface", BONE, &["--preset", "bone"][..], ["\"threshold\": 0.08", "\"threshold\": 0.1"]),
        (
            "mip",
            SWEEP,
            &[
                "--mode",
                "mip",
                "--set",
                "ray.elevation=linear",
                "--camera",
                "azimuth=20,elevation=-15,field_of_view=30",
            ],
            ["\"wobble_radius\": 27.25", "\"wobble_radius\": 27.0"],
        ),
        ("volume", BONE, &["--preset", "bone", "--mode", "vr"], ["\"opacity\": 0.4", "\"opacity\": 0.35"]),
        (
            "light",
            SWEEP,
            &[
                "--preset",
                "fetal",
                "--mode",
                "vr",
                "--set",
                "light.volume={cell=0.8,scatter=0,widening=0,warmth=0.7}",
                "--set",
                "light.follows=region",
                "--set",
                "light.direction=[-0.5,0.8,0.6]",
                // A whole number of cells across the layers: what is beyond the box absorbs nothing.
                "--set",
                "region.elevation=[-28,20]",
            ],
            ["\"warmth\": 0.7", "\"warmth\": 0.4"],
        ),
    ] {
        let dump = Folder(folder.0.join(name));
        render(input, &folder.path("p.png"), &[more, &["--dump", &dump.path(""), "--raw"]].concat());
        let (agrees, said) = oracle(&dump);
        println!("{said}");
        assert!(agrees, "{name}: {said}");
        // It notices a difference.
        let scene = fs::read_to_string(dump.path("scene.json")).expect("written");
        assert!(scene.contains(change[0]), "{name}: {scene}");
        fs::write(dump.path("scene.json"), scene.replace(change[0], change[1])).expect("written");
        let (agrees, said) = oracle(&dump);
        assert!(!agrees, "{name} with {}: {said}", change[1]);
    }
}
