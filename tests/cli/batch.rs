//! `echolume batch`: whatever ends its processes, every output is there once, whole, and the one that a single process makes; exit codes.
#![cfg(unix)]

use crate::common::layer::under_layer;
use crate::common::program::*;
use crate::common::wait::until;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

const SMALL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/formats/raw-ras.nrrd");

/// All files below a folder, with their contents.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fn walk(top: &Path, folder: &Path, found: &mut BTreeMap<PathBuf, Vec<u8>>) {
        for entry in fs::read_dir(folder).into_iter().flatten().map(|e| e.expect("an entry").path()) {
            match entry.is_dir() {
                true => walk(top, &entry, found),
                // A file may be renamed meanwhile.
                false => {
                    let below = entry.strip_prefix(top).expect("below").to_path_buf();
                    found.extend(fs::read(&entry).ok().map(|bytes| (below, bytes)));
                }
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(folder, folder, &mut found);
    found
}

/// Outputs, without records, and without what a killed process was writing aside.
fn outputs(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let is_output =
        |path: &PathBuf| path.file_name().is_some_and(|n| n.to_string_lossy().contains('-') && !is_part(path));
    tree(&folder.join("units")).into_iter().filter(|(path, _)| is_output(path)).collect()
}

fn is_part(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "part")
}

fn records(folder: &Path) -> usize {
    let found = tree(&folder.join("units"));
    found
        .keys()
        .filter(|path| !path.to_string_lossy().contains('-') && path.extension().is_some_and(|e| e == "json"))
        .count()
}

fn lines(folder: &Path) -> Vec<Value> {
    let files = tree(&folder.join("results"));
    let text = files.values().flat_map(|bytes| bytes.split(|b| *b == b'\n')).filter(|line| !line.is_empty());
    text.map(|line| serde_json::from_slice(line).expect("a whole line")).collect()
}

fn start(arguments: &[&str]) -> Child {
    let mut program = with_default_signals();
    program
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("start the program")
}

/// Sends a signal once the folder has more records than before, and returns the exit code.
fn end(mut child: Child, folder: &Path, signal: Signal) -> Option<i32> {
    let before = records(folder);
    until("a record", || (records(folder) > before).then_some(()));
    kill_process(Pid::from_child(&child), signal).expect("send a signal");
    child.wait().expect("it ends").code()
}

#[test]
fn no_unit_is_lost_or_half_written_whatever_ends_the_processes() {
    let folder = Folder::new("batch");
    let whole = fs::read(SMALL).expect("a recording");
    folder.write("cut.nrrd", &whole[..whole.len() - 7]);
    let render = |mode: &str| json!({"input": SWEEP, "command": ["render", "--mode", mode, "--size", "24x16"]});
    let units = [
        json!({"input": SMALL, "command": ["measure"]}),
        render("mip"),
        json!({"input": "cut.nrrd", "cost": 3.5}),
        json!({"input": SMALL, "command": ["verify", "--mode", "mip", "--size", "16x12"]}),
        json!({"input": SWEEP, "command": ["convert", "--spacing", "1.5"], "outputs": ["sweep.mha"]}),
        json!({"input": SWEEP, "scene": {"mode": "plane", "picture": {"size": [24, 16]}}}),
    ];
    let text = text_without_line(&units, usize::MAX);
    let manifest = folder.write("units.ndjson", text);
    let (one, many, page) = (folder.path("one"), folder.path("many"), folder.path("page.html"));

    // A single process: the broken recording is one line, and the rest is done.
    let (code, said, err) = run(&["batch", &manifest, "-o", &one]);
    refuses(
        &["batch"],
        &(code, said.clone(), err.lines().last().unwrap_or_default().into()),
        4,
        &["1 of 6 units failed"],
    );
    assert!(
        err.lines().count() == 2
            && err.contains("unit 3: cut.nrrd: ")
            && err.matches("cut.nrrd").count() == 1
            && err.contains("cut short"),
        "{err}"
    );
    let expected = outputs(one.as_ref());
    assert_eq!((expected.len(), records(one.as_ref()), lines(one.as_ref()).len()), (5, 5, 6));
    assert!(said.contains("5 done"), "{said}");
    let picture = folder.path("p.png");
    done(&["render", SWEEP, "--mode", "mip", "--size", "24x16", "-o", &picture]);
    let picture = fs::read(picture).expect("a picture");
    assert!(expected.values().any(|bytes| *bytes == picture), "a unit is what `render` draws");
    for (path, bytes) in &expected {
        let in_record = path.to_string_lossy()[..38].to_string() + ".json";
        let record: Value =
            serde_json::from_slice(&tree(&PathBuf::from(&one).join("units"))[Path::new(&in_record)]).expect("JSON");
        assert_eq!(record["outputs"][0]["bytes"], bytes.len(), "{}", path.display());
    }

    // Killed and ended by SIGTERM with work left, then finished by two processes that do the same shard.
    let batch = ["batch", &manifest, "-o", &many];
    assert_eq!(end(start(&batch), many.as_ref(), Signal::KILL), None);
    let so_far = outputs(many.as_ref());
    assert!(records(many.as_ref()) < 5, "nothing is left to do");
    assert!(so_far.iter().all(|(path, bytes)| expected.get(path) == Some(bytes)), "half-written");
    assert_eq!(end(start(&batch), many.as_ref(), Signal::TERM), Some(1), "after SIGTERM: try again");
    assert!(
        tree(many.as_ref()).keys().filter(|path| is_part(path)).count() <= 1,
        "only SIGKILL leaves what was written"
    );
    let both = [start(&batch), start(&batch)].map(|mut child| child.wait().expect("it ends").code());
    assert_eq!(both, [Some(4); 2]);
    assert!(outputs(many.as_ref()) == expected, "other outputs than those of one process");

    // All that is done is skipped, without a device; every shard is a part of it.
    let good = text_without_line(&units, 2);
    let good = folder.write("good.ndjson", good);
    let blind = |arguments: &[&str]| finish(without_device(Command::new(PROGRAM).args(arguments)));
    let (code, said, err) = blind(&["batch", &good, "-o", &many]);
    assert!(code == Some(0) && said.contains("5 were done before"), "{said}{err}");
    let shard = |shard: &str| done(&["batch", &good, "-o", &many, "--shard", shard]);
    assert!(shard("0/2").contains("3 of 5 units") && shard("1/2").contains("2 of 5 units"));
    let new = folder.write("new.ndjson", json!({"input": SMALL}).to_string());
    refuses(&["batch"], &blind(&["batch", &new, "-o", &many]), 3, &["no Vulkan device"]);
    // --resume goes on where there is something of this manifest, in any shard, and nowhere else.
    let resume = |manifest: &str, out: &str| blind(&["batch", manifest, "-o", out, "--resume"]);
    let (code, said, err) = resume(&good, &many);
    assert!(code == Some(0) && said.contains("resume: 5 of 5 units were done before"), "{said}{err}");
    assert!(said.contains("5 were done before"), "{said}");
    let digested = folder.path("digested.ndjson");
    done(&["batch", "--make", SMALL, "-o", &digested, "--", "measure", "--volume", "0"]);
    let (code, said, err) = resume(&digested, &many);
    refuses(&["batch"], &(code, said, err), 2, &["--resume: ", "many", "its results are of other units", "digested"]);
    done(&["batch", &digested, "-o", &many]);
    let (code, said, err) = resume(&digested, &many);
    assert!(code == Some(0) && said.contains("resume: 1 of 1 units were done before\n"), "{said}{err}");
    let empty = folder.path("empty");
    refuses(&["batch"], &resume(&good, &empty), 2, &["--resume: ", "empty", "it holds no results of a batch"]);
    assert!(!Path::new(&empty).exists(), "a refused folder is not made");
    // Begun, and ended before any unit ended.
    fs::create_dir_all(Path::new(&empty).join("results")).expect("a folder");
    let (code, said, err) = resume(&digested, &empty);
    assert!(code == Some(0) && said.contains("resume: 0 of 1 units were done before\n"), "{said}{err}");
    // Drawn again: the same driver draws the same bytes.
    let (code, _, err) = run(&["batch", &good, "-o", &one, "--recheck", "1"]);
    let again: Vec<_> =
        lines(one.as_ref()).into_iter().filter(|line| line["agreement"]["same_bytes"] == true).collect();
    assert!(code == Some(0) && again.len() == 2, "{err}: {again:?}");

    // An output that was damaged and kept its length is found by its digest alone, and made again.
    let (code, said, err) = blind(&["batch", &good, "-o", &many, "--verify"]);
    assert!(
        code == Some(0) && err.is_empty() && said.contains("verified: 5 outputs are as their records say, 0 were not"),
        "{said}{err}"
    );
    let (path, bytes) =
        expected.iter().find(|(path, _)| path.extension().is_some_and(|e| e == "json")).expect("figures");
    let file = Path::new(&many).join("units").join(path);
    fs::write(&file, vec![b' '; bytes.len()]).expect("damaged");
    let (code, said, _) = blind(&["batch", &good, "-o", &many]);
    assert!(code == Some(0) && said.contains("5 were done before"), "{said}");
    let (code, said, err) = run(&["batch", &good, "-o", &many, "--verify"]);
    assert!(
        code == Some(0) && said.contains("verified: 4 outputs are as their records say, 1 were not"),
        "{said}{err}"
    );
    assert!(
        err.lines().count() == 1 && err.contains("its record says") && fs::read(&file).expect("made again") == *bytes,
        "{err}"
    );

    let said = done(&["batch", "--report", &one, "-o", &page]);
    assert!(said.contains("6 units: 5 done, 1 failed"), "{said}");
    let html = fs::read_to_string(&page).expect("the page");
    assert!(
        html.contains("cut short")
            && html.contains("<li>on <strong>20")
            && html.matches("data:image/png").count() == 2
            && html.contains("bit for bit")
    );
}

fn text_without_line(units: &[Value], left_out: usize) -> String {
    units.iter().enumerate().filter(|(n, _)| *n != left_out).map(|(_, unit)| format!("{unit}\n")).collect()
}

#[test]
fn a_manifest_is_made_of_what_can_be_read_and_a_wrong_one_is_never_tried_again() {
    let folder = Folder::new("make");
    fs::create_dir_all(folder.0.join("archive/deep")).expect("folders");
    let whole = fs::read(SMALL).expect("a recording");
    folder.write("archive/deep/a.nrrd", &whole);
    folder.write("archive/cut.nrrd", &whole[..whole.len() - 7]);
    folder.write("archive/notes.txt", "no recording");
    let (manifest, out) = (folder.path("units.ndjson"), folder.path("out"));
    let (code, said, err) = run(&["batch", "--make", &folder.path("archive"), "-o", &manifest, "--", "measure"]);
    assert!(code == Some(0) && said.contains("1 units") && said.contains("1 files left out"), "{said}{err}");
    assert!(err.lines().count() == 1 && err.contains("cut.nrrd"), "{err}");
    let unit: Value = serde_json::from_slice(&fs::read(&manifest).expect("the manifest")).expect("one line");
    assert!(unit["input"].as_str().is_some_and(|path| path.ends_with("archive/deep/a.nrrd")));
    assert_eq!((&unit["bytes"], &unit["command"]), (&whole.len().into(), &json!(["measure"])));
    assert!(unit["cost"].as_f64().is_some_and(|cost| cost >= 1.0));
    let pattern = folder.path("archive/**/*.nrrd");
    assert_eq!(run(&["batch", "--make", &pattern, "-o", &manifest]).0, Some(0), "a pattern");
    // The recording changed after the manifest was made.
    folder.write("archive/deep/a.nrrd", [&whole[..whole.len() - 1], b"x"].concat());
    let (code, _, err) = run(&["batch", &manifest, "-o", &out]);
    assert!(code == Some(4) && err.contains("is not what the manifest says"), "{err}");
    let wrong = folder.write("wrong.ndjson", "{\"input\":\"a\",\"command\":[\"erase\"]}\n");
    for (arguments, named) in [
        (&["batch", &wrong, "-o", &out][..], "line 1"),
        (&["batch", "none.ndjson", "-o", &out], "cannot be read"),
        (&["batch", &manifest, "-o", &out, "--shards", "4"], "--shard I/4"),
        (&["batch", &manifest, "-o", &out, "--recheck", "2"], "--recheck"),
        (&["batch", "--report", &folder.path("archive")], "results"),
        (&["batch", "--make", "none*", "-o", &manifest], "none*"),
    ] {
        refuses(arguments, &run(arguments), 2, &[named]);
    }
}

/// A recording that always loses the device must not keep the others of its shard from being done, nor be tried for ever.
#[test]
fn a_unit_that_loses_the_device_comes_last_and_is_given_up() {
    let folder = Folder::new("lost");
    let units = [
        json!({"input": SMALL, "command": ["render", "--mode", "mip", "--size", "16x12"]}),
        json!({"input": SMALL, "command": ["measure"]}),
    ];
    let (manifest, out) = (folder.write("units.ndjson", text_without_line(&units, usize::MAX)), folder.path("out"));
    let batch = || {
        let mut command = Command::new(PROGRAM);
        command.args(["batch", &manifest, "-o", &out]);
        // No dispatch of two workgroups.
        finish(under_layer(&mut command, &[("MAX_GROUPS", "1")]))
    };
    let (code, _, err) = batch();
    let statuses = || lines(out.as_ref()).iter().map(|line| line["status"].clone()).collect::<Vec<_>>();
    assert!(code == Some(3) && statuses() == ["lost"], "{code:?} {err}");
    // As after two more tries.
    let results = PathBuf::from(&out).join("results/shard-0000-of-0001.ndjson");
    let line = fs::read_to_string(&results).expect("the results");
    fs::write(&results, line.repeat(3)).expect("written");
    let (code, _, err) = batch();
    assert!(code == Some(4) && err.contains("is not tried again"), "{code:?} {err}");
    assert_eq!(statuses()[3..], ["done", "failed"]);
}

#[test]
fn a_converted_volume_is_that_of_convert_and_a_segmentation_is_refused() {
    let folder = Folder::new("batch-convert");
    // Decibels, and a sector: outside of it is no echo, -60.
    let sector = data("uff/sector-3d.uff").display().to_string();
    let unit = |output: &str| {
        let unit = json!({"input": sector, "command": ["convert", "--spacing", "2"], "outputs": [output]});
        folder.write("units.ndjson", format!("{unit}\n"))
    };
    let (made, alone) = (folder.path("made"), folder.path("alone.mha"));
    done(&["batch", &unit("volume.mha"), "-o", &made]);
    done(&["convert", &sector, &alone, "--spacing", "2"]);
    let expected = fs::read(&alone).expect("a volume");
    assert!(outputs(made.as_ref()).values().any(|bytes| *bytes == expected), "a unit is what convert writes");
    let manifest = unit("tissue.seg.nrrd");
    refuses(&["batch"], &run(&["batch", &manifest, "-o", &made]), 2, &["outputs", "a segmentation"]);
}
