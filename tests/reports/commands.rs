//! `echolume profile` and `echolume report error` as a user sees them.

use crate::common::program::*;
use crate::scenes::alone;
use std::fs;

/// Small and quick.
const SMALL: [&str; 6] = [BONE, "--preset", "bone", "--size", "48x32", "--set=distance.median=3"];

/// Refused with this code, and a last line of at most two that names the fault.
fn refused(arguments: &[&str], code: i32, named: &[&str]) {
    let (got, _, err) = run(arguments);
    assert_eq!(got, Some(code), "{arguments:?}: {err}");
    let last = err.lines().last().unwrap_or_default();
    assert!(err.lines().count() <= 2, "{arguments:?}: {err}");
    named.iter().for_each(|word| assert!(last.contains(word), "{arguments:?} does not name {word}: {err}"));
}

#[test]
fn a_profile_is_written_compared_with_itself_and_refused_where_it_cannot_be() {
    let _alone = alone();
    let folder = Folder::new("profile");
    let (json, csv, trace) = (folder.path("a.json"), folder.path("a.csv"), folder.path("trace.json"));
    let files = ["--json", &json, "--csv", &csv, "--trace", &trace];
    let out =
        done(&[&["profile"], &SMALL[..], &["--repeat", "8", "--warm-up", "1", "--no-ceilings"], &files[..]].concat());
    for word in ["raycast_surface", "median_distance", "wall", "time stamps"] {
        assert!(out.contains(word), "{word} is missing from\n{out}");
    }
    let same = done(&["profile", "--compare", &json, &json]);
    assert!(same.contains("Mann-Whitney") && same.contains("nothing is slower"), "{same}");
    assert!(fs::read_to_string(&csv).expect("csv").lines().count() > 8);
    let traced: serde_json::Value = serde_json::from_str(&fs::read_to_string(&trace).expect("trace")).expect("json");
    assert!(traced["traceEvents"].as_array().is_some_and(|e| e.len() > 50));

    // Another scene is different work; a slower copy is a regression.
    let other = folder.path("b.json");
    let ask = ["--repeat", "8", "--no-ceilings", "--set=distance.median=5", "--json", &other];
    done(&[&["profile"], &SMALL[..], &ask[..]].concat());
    refused(&["profile", "--compare", &json, &other], 2, &["distance.median"]);
    let mut slower: serde_json::Value = serde_json::from_str(&fs::read_to_string(&json).expect("json")).expect("json");
    for pass in slower["passes"].as_array_mut().expect("passes") {
        let factor = if pass["name"] == "median_distance" { 1e6 } else { 1.0 };
        let times = pass["samples_ns"].as_array_mut().expect("times");
        times.iter_mut().for_each(|t| *t = serde_json::json!(t.as_f64().expect("number") * factor));
    }
    let slow = folder.path("slow.json");
    fs::write(&slow, slower.to_string()).expect("written");
    refused(&["profile", "--compare", &json, &slow], 1, &["median_distance"]);

    fs::write(&other, "{").expect("written");
    refused(&["profile", "--compare", &json, &other], 2, &["b.json"]);
    refused(&["profile", "--compare", &json, &folder.path("none.json")], 2, &["none.json", "cannot be read"]);
    refused(&["profile", "--compare", &json, &json, "--threshold", "0.5"], 2, &["0.5"]);
    refused(&[&["profile"], &SMALL[..], &["--json", "/no/such/folder/a.json"]].concat(), 1, &["/no/such/folder"]);
}

#[test]
fn a_report_is_written_plotted_and_advises() {
    let _alone = alone();
    let folder = Folder::new("report");
    let (dir, json) = (folder.path("out"), folder.path("out/error.json"));
    let dials = ["--dial", "step", "--dial", "format", "--repeat", "2", "--mode", "vr", "--set=ray.step=0.5"];
    let out = done(&[&["report", "error"], &SMALL[..], &dials[..], &["-o", &dir, "--under-error", "0.05"]].concat());
    for word in
        ["f64 reference", "r16f", "floor", "* the scene as it is", "holds RMSE 5.000e-2", "error budget", "p95 lv"]
    {
        assert!(out.contains(word), "{word} is missing from\n{out}");
    }
    assert!(!out.contains("no stamps"), "{out}");
    for file in ["error.json", "error.csv", "error.svg", "error.png"] {
        assert!(fs::metadata(folder.join("out").join(file)).is_ok_and(|m| m.len() > 500), "{file}");
    }
    // The format that the device stores best has its own name: a report of llvmpipe called its r16 r16f.
    let explained = done(&[&["render"], &SMALL[..], &["--mode", "vr", "--set=ray.step=0.5", "--explain"]].concat());
    let volume =
        explained.lines().find(|line| line.trim_start().starts_with("volume ")).expect("the slot of the volume");
    let report: serde_json::Value = serde_json::from_slice(&fs::read(&json).expect("a report")).expect("JSON");
    let dials = report["dials"].as_array().expect("dials");
    let format = dials.iter().find(|dial| dial["name"] == "format").expect("the dial of formats");
    let points = format["points"].as_array().expect("points");
    let own = points.iter().find(|point| point["is_default"] == true).expect("the scene itself");
    let name = own["label"].as_str().expect("a name");
    assert!(volume.to_lowercase().ends_with(&format!(" {name}")), "{name}: {volume}");
    assert_eq!(points.iter().filter(|point| point["label"] == name).count(), 1, "{name} stands twice");
    // The scene of the report is the one that is rendered, with a preset and without.
    let picture = folder.path("picture.png");
    for preset in [&["--preset", "bone"][..], &[]] {
        let scene = [&[BONE, "--size", "48x32", "--mode", "vr"][..], preset].concat();
        let dir = folder.path("same");
        done(&[&["report", "error"], &scene[..], &["--dial", "termination", "--repeat", "1", "-o", &dir]].concat());
        let report = format!("{dir}/error.json");
        let said =
            done(&[&["render"], &scene[..], &["--budget", "100s", "--report", &report, "-o", &picture]].concat());
        assert!(said.contains("with this scene"), "{preset:?}: {said}");
    }
    // The same again without measuring.
    let again = done(&["report", "error", "--from", &json, "--under-time", "10s"]);
    assert!(again.contains("r16f") && again.contains("and not again"), "{again}");
    refused(&["report", "error", "--from", &json, "--under-error", "1e-12"], 1, &["1"]);
    refused(&["report", "error", "--from", &json, "--under-time", "fast"], 2, &["fast", "16ms"]);
    refused(&[&["report", "error"], &SMALL[..], &["--dial", "colour"]].concat(), 2, &["colour", "step"]);
    refused(
        &[&["report", "error"], &SMALL[..], &["--dial", "compositing"]].concat(),
        2,
        &["compositing", "composites nothing"],
    );
    refused(&["report", "error", "--from", BONE], 2, &["bone.mha"]);
}
