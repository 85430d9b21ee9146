//! `echolume profile` and `echolume report error` as a user sees them.

use crate::common::program::*;
use crate::scenes::alone;
use std::fs;
use std::path::Path;

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
    // Times that do not vary, so that what the noise of this machine hides does not matter.
    let read = |file: &str| -> serde_json::Value {
        serde_json::from_str(&fs::read_to_string(file).expect("a profile")).expect("json")
    };
    let mut still = read(&json);
    for list in ["passes", "host"] {
        for pass in still[list].as_array_mut().expect("passes") {
            pass["samples_ns"] = serde_json::json!(vec![1e6; 8]);
            pass["cpu_ns"] = serde_json::json!(if list == "passes" { vec![1e6; 8] } else { Vec::new() });
        }
    }
    (still["wall_ns"], still["cpu_ns"]) = (serde_json::json!(vec![9e7; 8]), serde_json::json!(vec![9e7; 8]));
    let steady = folder.path("steady.json");
    fs::write(&steady, still.to_string()).expect("written");
    let same = done(&["profile", "--compare", &steady, &steady]);
    assert!(same.contains("Mann-Whitney") && same.contains("nothing is slower"), "{same}");
    // With noise in one pass that would hide a slowdown by the threshold it is no pass.
    still["passes"].as_array_mut().expect("passes").iter_mut().filter(|pass| pass["name"] == "light").for_each(
        |pass| {
            let noise: Vec<f64> = (0..8).map(|n| 1e6 + 3e5 * f64::from(n % 4)).collect();
            (pass["samples_ns"], pass["cpu_ns"]) = (serde_json::json!(noise), serde_json::json!(noise));
        },
    );
    let noisy = folder.path("noisy.json");
    fs::write(&noisy, still.to_string()).expect("written");
    let (code, out, err) = run(&["profile", "--compare", &steady, &noisy, "--json", &folder.path("compared.json")]);
    assert_eq!(code, Some(5), "{out}{err}");
    assert!(
        err.starts_with("echolume: cannot tell below ") && err.contains("light below") && err.lines().count() == 1,
        "{err}"
    );
    assert!(out.contains("cannot tell below") && !out.contains("nothing is slower"), "{out}");
    let compared = read(&folder.path("compared.json"));
    let lines = compared["lines"].as_array().expect("lines");
    let unseen: Vec<_> = lines.iter().filter(|line| line["is_unseen"] == true).map(|line| &line["name"]).collect();
    assert_eq!(unseen, ["light"]);
    // Unless it is excused as a pass of little time, which is said.
    let excused = done(&["profile", "--compare", &steady, &noisy, "--minor", "0.9"]);
    assert!(excused.contains("less than 90 % of the time may hide a slowdown: light below"), "{excused}");
    refused(&["profile", "--compare", &steady, &noisy, "--minor", "2"], 2, &["minor: 2 is not a share"]);
    assert!(fs::read_to_string(&csv).expect("csv").lines().count() > 8);
    let traced: serde_json::Value = serde_json::from_str(&fs::read_to_string(&trace).expect("trace")).expect("json");
    assert!(traced["traceEvents"].as_array().is_some_and(|e| e.len() > 50));

    // Another scene is different work; a slower copy is a regression.
    let other = folder.path("b.json");
    let ask = ["--repeat", "8", "--no-ceilings", "--set=distance.median=5", "--json", &other];
    done(&[&["profile"], &SMALL[..], &ask[..]].concat());
    refused(&["profile", "--compare", &json, &other], 2, &["distance.median"]);
    let mut slower = read(&json);
    for pass in slower["passes"].as_array_mut().expect("passes") {
        let factor = if pass["name"] == "median_distance" { 1e6 } else { 1.0 };
        for list in ["samples_ns", "cpu_ns"] {
            let times = pass[list].as_array_mut().expect("times");
            times.iter_mut().for_each(|t| *t = serde_json::json!(t.as_f64().expect("number") * factor));
        }
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

/// How a comparison in turn is asked for.
const IN_TURN: [&str; 4] = ["--repeat", "10", "--warm-up", "1"];

/// Of the same program nothing is called slower, whatever the noise of this machine lets be said.
#[test]
fn the_same_program_measured_in_turn_is_not_slower() {
    let _alone = alone();
    let folder = Folder::new("same");
    let json = folder.path("compared.json");
    let ask = [&["profile"], &SMALL[..], &IN_TURN].concat();
    let (code, out, err) = run(&[&ask[..], &["--against", PROGRAM, "--threshold", "3", "--json", &json]].concat());
    assert!(matches!(code, Some(0 | 5)), "{out}{err}");
    let compared: serde_json::Value = serde_json::from_str(&fs::read_to_string(&json).expect("json")).expect("json");
    assert_eq!(compared["format"], "echolume-comparison-2");
}

/// `--against` runs a folder of shaders: one that works a hundred times as long is found.
#[test]
fn a_slow_shader_measured_in_turn_is_found() {
    let _alone = alone();
    let folder = Folder::new("against");
    copy_tree(&repository("glsl"), &folder.join("slow"));
    let shader = folder.join("slow/shade/light.comp");
    let text = fs::read_to_string(&shader).expect("a shader");
    let slow = "void main() {\n    float spent = 0.5;\n    for (int n = 0; n < 3000; n++) spent = sin(spent + 0.1);\n    if (spent == 7.0) return;\n";
    assert!(text.contains("void main() {\n"), "the shader has another form: {text}");
    fs::write(&shader, text.replace("void main() {\n", slow)).expect("written");
    let ask = [&["profile"], &SMALL[..], &IN_TURN].concat();
    let (code, out, err) = run(&[&ask[..], &["--against", &folder.path("slow"), "--threshold", "3"]].concat());
    assert_eq!(code, Some(1), "{out}{err}");
    assert_eq!(err.lines().last(), Some("echolume: slower by more than the threshold: light"), "{out}{err}");
    assert!(out.contains("compared: CPU time of each pass") || !cfg!(target_os = "linux"), "{out}");
    assert!(out.contains("Wilcoxon's signed ranks"), "{out}");
}

#[test]
fn what_cannot_be_measured_in_turn_is_refused() {
    let folder = Folder::new("no-turn");
    let ask = [&["profile"], &SMALL[..], &IN_TURN].concat();
    refused(&[&ask[..], &["--against", &folder.path("none")]].concat(), 2, &["/none", "No such file"]);
    refused(&[&ask[..], &["--against", "no such device"]].concat(), 3, &["no such device"]);
    refused(&[&ask[..], &["--against", BONE]].concat(), 2, &["bone.mha"]);
    refused(&["profile", "-", "--against", PROGRAM], 2, &["standard input"]);
    refused(&[&ask[..], &["--against", "/bin/false"]].concat(), 1, &["/bin/false", "exit status: 1"]);
    refused(&[&ask[..], &["--against", "/bin/true"]].concat(), 1, &["profile.json"]);
}

/// Copies a folder with all that is in it.
fn copy_tree(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("created");
    for file in fs::read_dir(from).expect("a list").map(|entry| entry.expect("an entry").path()) {
        let to = to.join(file.file_name().expect("a name"));
        if file.is_dir() { copy_tree(&file, &to) } else { _ = fs::copy(&file, to).expect("copied") }
    }
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
    for (look, dial) in [(&["--mode", "vr", "--preset", "bone"][..], "termination"), (&["--mode", "mip"], "step")] {
        let scene = [&[BONE, "--size", "48x32"][..], look].concat();
        let dir = folder.path("same");
        done(&[&["report", "error"], &scene[..], &["--dial", dial, "--repeat", "1", "-o", &dir]].concat());
        let report = format!("{dir}/error.json");
        let said =
            done(&[&["render"], &scene[..], &["--budget", "100s", "--report", &report, "-o", &picture]].concat());
        assert!(said.contains("with this scene"), "{look:?}: {said}");
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
