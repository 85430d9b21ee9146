//! Compiled pipelines: what `profile --pipelines` tells of them, and the file that keeps them between runs.

use crate::common::layer::{on_drivers_of_other_vendors, reports, under_layer};
use crate::common::program::*;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const PROFILE: [&str; 4] = ["profile", "--pipelines", "--size", "64x64"];

fn json(path: &str) -> Value {
    serde_json::from_slice(&fs::read(path).expect("written")).expect("JSON")
}

/// Every pipeline of a scene is compiled, and the device gets no work: that is what makes it possible on a device that does nothing.
#[test]
fn pipelines_are_measured_without_any_work_for_the_device() {
    let folder = Folder::new("measured");
    let (file, report) = (folder.path("p.json"), folder.path("report.json"));
    let mut command = Command::new(PROGRAM);
    command.args(PROFILE).args(["--mode", "vr", "--json", &file]);
    let (code, out, err) = finish(under_layer(&mut command, &[("REPORT", &report)]));
    assert_eq!(code, Some(0), "{err}");
    let measured = json(&file);
    let pipelines = measured["pipelines"].as_array().expect("a list");
    let shaders: Vec<&str> = pipelines.iter().filter_map(|p| p["shader"].as_str()).collect();
    for wanted in ["raycast/volume", "postprocess/tone", "preprocess/scan_convert"] {
        assert!(shaders.contains(&wanted), "no {wanted}: {shaders:?}");
    }
    assert!(!shaders.iter().any(|shader| shader.starts_with("raycast/surface")), "{shaders:?}");
    assert!(out.contains(&format!("{} pipelines: compiled in", pipelines.len())), "{out}");
    let report = &reports(&report)[0];
    for nothing in ["submissions", "dispatches"] {
        assert_eq!(report[nothing].as_u64(), Some(0), "{nothing}: {report}");
    }
    // Of every mode, preset and filter: each pipeline once, and many more.
    let all = folder.path("all.json");
    done(&[&PROFILE[..], &["--all", "--json", &all]].concat());
    let all = json(&all);
    let all = all["pipelines"].as_array().expect("a list");
    assert!(all.len() > 4 * pipelines.len(), "{} of all, {} of one mode", all.len(), pipelines.len());
    let key = |p: &Value| format!("{} {} {}", p["shader"], p["constants"], p["formats"]);
    assert_eq!(all.iter().map(key).collect::<BTreeSet<_>>().len(), all.len(), "one is listed twice");
}

/// Prevents a profile that counts what other devices would do: on a CPU an invocation makes eight pixels of a plane, and samples are no device's filter.
#[test]
fn a_profile_counts_what_this_device_does() {
    let folder = Folder::new("counts");
    let file = folder.path("p.json");
    let arguments = ["profile", "--mode", "mpr", "--size", "64x60", "--repeat", "1", "--warm-up", "1", "--no-ceilings"];
    done(&[&arguments[..], &["--json", &file]].concat());
    let measured = json(&file);
    let passes = measured["passes"].as_array().expect("a list");
    let planes = passes.iter().find(|p| p["name"] == "raycast_planes_toned").expect("planes are cut");
    let on_cpu = measured["device"]["is_software"].as_bool().expect("told");
    assert_eq!(planes["dispatched"], if on_cpu { 64 * 8 } else { 64 * 60 });
    let sampling = measured["sampling"].as_str().expect("told");
    assert!(!sampling.contains("the fastest"), "{sampling}");
    assert_eq!(sampling.contains("filter"), !on_cpu, "{sampling}");
}

/// A device without statistics says so in a line; comparing what it has not is refused.
#[test]
fn what_cannot_be_compared_is_refused_and_files_are_checked() {
    let folder = Folder::new("compared");
    let file = folder.path("p.json");
    let (_, _, err) = run(&[&PROFILE[..], &["--json", &file]].concat());
    let mut measured = json(&file);
    if measured["has_statistics"] == false {
        assert!(err.contains("VK_KHR_pipeline_executable_properties") && err.lines().count() == 1, "{err}");
        let arguments = ["profile", "--pipelines", "--compare", &file, &file];
        refuses(&arguments, &run(&arguments), 2, &["reported none"]);
    }
    // Statistics as a driver with this extension tells them: the same in both, then with a spill.
    measured["has_statistics"] = true.into();
    measured["statistics"] = serde_json::json!(["VGPRs", "Subgroups per SIMD", "Spilled VGPRs"]);
    let told = |measured: &mut Value, spilled: f64| {
        for pipeline in measured["pipelines"].as_array_mut().expect("a list") {
            let executable = serde_json::json!({ "name": "main", "subgroup": 32, "values": [48.0, 16.0, spilled] });
            pipeline["executables"] = serde_json::json!([executable]);
        }
        measured.to_string()
    };
    let (plain, spills) = (folder.write("plain.json", told(&mut measured, 0.0)), told(&mut measured, 3.0));
    let spills = folder.write("spills.json", spills);
    let same = done(&["profile", "--pipelines", "--compare", &plain, &plain]);
    assert!(same.contains(" 0 worse"), "{same}");
    let arguments = ["profile", "--pipelines", "--compare", &plain, &spills];
    refuses(&arguments, &run(&arguments), 1, &["worse than before, first: "]);
    done(&["profile", "--pipelines", "--compare", &spills, &plain]);
    for (bad, named) in [("{", "not statistics"), ("{\"format\":\"echolume-profile-2\"}", "format is")] {
        let bad = folder.write("bad.json", bad);
        let arguments = ["profile", "--pipelines", "--compare", &bad];
        refuses(&arguments, &run(&arguments), 2, &[named]);
    }
    let arguments = ["profile", "--compare", &plain];
    refuses(&arguments, &run(&arguments), 2, &["--pipelines"]);
}

/// The statistics of the drivers that other machines have, with the baselines that are kept: as `tools/drivers check` does it.
#[test]
fn drivers_of_other_vendors_tell_registers_occupancy_and_spills() {
    let folder = Folder::new("vendors");
    let file = folder.path("p.json");
    let arguments = ["profile", "--pipelines", "--preset", "face-classic", "--size", "64x64", "--json", &file];
    on_drivers_of_other_vendors(&arguments, |driver, out| {
        assert_eq!(json(&file)["has_statistics"], true, "{driver}");
        let rows: Vec<Vec<&str>> = out.lines().map(|line| line.split_whitespace().collect()).collect();
        let row = rows.iter().find(|row| row.iter().any(|cell| cell.starts_with("raycast/surface")));
        let row = row.unwrap_or_else(|| panic!("{driver}: {out}"));
        // Registers, waves, spills, instructions.
        for (cell, least) in row.iter().zip([1.0, 1.0, 0.0, 100.0]) {
            let value: f64 = cell.parse().unwrap_or_else(|_| panic!("{driver}: {cell} in {row:?}"));
            assert!(value >= least, "{driver}: {row:?}");
        }
    });
}

/// A run of the program with a pipeline cache, into a picture of its own.
fn render_with(cache: &Path, picture: &str) -> Ran {
    let mut command = Command::new(PROGRAM);
    command.args(["render", "--size", "64x48", "--mode", "mip", "-vv", "-o", picture]);
    finish(command.env("ECHOLUME_PIPELINE_CACHE", cache))
}

fn caches(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> = entries.collect();
    files.sort();
    files
}

/// Prevents a program that crashes, or draws something else, because of the file of an earlier run.
#[test]
fn a_cache_is_written_used_and_replaced_where_it_is_damaged() {
    let folder = Folder::new("cache");
    let cache = PathBuf::from(folder.path("deep/er"));
    let first = folder.path("first.png");
    let (code, _, err) = render_with(&cache, &first);
    assert!(code == Some(0) && err.contains("stored"), "{err}");
    let [file] = &caches(&cache)[..] else { panic!("{:?}", caches(&cache)) };
    let good = fs::read(file).expect("the cache");
    assert!(good.starts_with(b"echopipe") && file.extension().is_some_and(|e| e == "pipelines"), "{file:?}");

    let (code, _, err) = render_with(&cache, &folder.path("again.png"));
    assert!(code == Some(0) && !err.contains("it is replaced"), "{err}");
    assert_eq!(fs::read(folder.path("again.png")).expect("drawn"), fs::read(&first).expect("drawn"));

    let mut damaged = good.clone();
    let last = damaged.len() - 1;
    damaged[last] ^= 1;
    for (bad, named) in [
        (damaged, "damaged"),
        (good[..20].to_vec(), "cut off"),
        (
            b"something else that is long enough to have a header, with more and more text after it".to_vec(),
            "not a pipeline cache",
        ),
        (vec![], "cut off"),
    ] {
        fs::write(file, bad).expect("written");
        let picture = folder.path("damaged.png");
        let (code, _, err) = render_with(&cache, &picture);
        assert!(code == Some(0) && err.contains(named), "{named}: {err}");
        assert_eq!(fs::read(&picture).expect("drawn"), fs::read(&first).expect("drawn"), "{named}");
        assert!(fs::read(file).expect("replaced").starts_with(b"echopipe"), "{named}: not replaced");
        let (_, _, err) = render_with(&cache, &picture);
        assert!(!err.contains("it is replaced"), "{named}: {err}");
    }
}

/// Prevents a program that fails on a read-only disk, or fills the terminal because of it.
#[test]
fn a_folder_that_cannot_be_written_is_said_once_at_debug_level_and_ignored() {
    let folder = Folder::new("blocked");
    let blocked = PathBuf::from(folder.write("file", "x")).join("below");
    let picture = folder.path("x.png");
    let (code, _, err) = render_with(&blocked, &picture);
    let said = err.lines().filter(|line| line.contains("not stored")).count();
    assert!(code == Some(0) && said == 1, "{said} times: {err}");
    let quiet = finish(
        Command::new(PROGRAM)
            .args(["render", "--size", "64x48", "-o", &picture])
            .env("ECHOLUME_PIPELINE_CACHE", &blocked),
    );
    assert!(quiet.0 == Some(0) && !quiet.2.contains("pipeline"), "{}", quiet.2);
}

/// Prevents two programs that spoil each other's file.
#[test]
fn programs_at_the_same_time_leave_one_good_file() {
    let folder = Folder::new("together");
    let cache = PathBuf::from(folder.path("cache"));
    std::thread::scope(|scope| {
        for n in 0..4 {
            let (picture, cache) = (folder.path(&format!("{n}.png")), &cache);
            scope.spawn(move || {
                let (code, _, err) = render_with(cache, &picture);
                assert!(code == Some(0) && !err.contains("not stored"), "{n}: {err}");
            });
        }
    });
    assert_eq!(caches(&cache).len(), 1, "{:?}", caches(&cache));
    let (_, _, err) = render_with(&cache, &folder.path("after.png"));
    assert!(!err.contains("it is replaced"), "{err}");
}

/// Without the variable the file is in the user's cache folder, and `none` keeps none.
#[test]
fn the_users_cache_folder_is_the_default_and_none_keeps_nothing() {
    let folder = Folder::new("default");
    let (home, picture) = (folder.path("home"), folder.path("x.png"));
    let render = |chosen: Option<&str>| {
        let mut command = Command::new(PROGRAM);
        command.args(["render", "--size", "64x48", "-o", &picture]);
        command.env("XDG_CACHE_HOME", &home).env_remove("ECHOLUME_PIPELINE_CACHE");
        if let Some(chosen) = chosen {
            command.env("ECHOLUME_PIPELINE_CACHE", chosen);
        }
        let (code, _, err) = finish(&mut command);
        assert_eq!(code, Some(0), "{err}");
        caches(&Path::new(&home).join("echolume/pipelines")).len()
    };
    assert_eq!(render(Some("none")), 0);
    assert_eq!(render(None), 1);
}
