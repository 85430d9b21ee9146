//! The division of a batch: no unit is lost or done twice, no shard costs much more than another; lines that a killed process left; names of outputs.

use crate::common::files::Folder;
use echolume::low_level::batch::agreement::{Agreement, Class, Drawer};
use echolume::low_level::batch::comparisons::pairs;
use echolume::low_level::batch::manifest::{self, Unit};
use echolume::low_level::batch::report::{Merged, html};
use echolume::low_level::batch::results::{self, Asked, Earlier, OutputFile, Record, Results, Seconds, Status};
use echolume::low_level::batch::shard::{Shard, assign};
use echolume::low_level::batch::unit::{Kind, Work};
use echolume::low_level::picture::Picture;
use echolume::low_level::tree::{FromNode, ToNode};
use proptest::prelude::*;
use serde_json::{Map, json};
use std::collections::BTreeMap;
use std::io::Write;

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// The last unit that a shard gets finds it the cheapest of all: no shard exceeds the mean by more than one unit.
    #[test]
    fn every_unit_is_in_one_shard_and_none_costs_more_than_the_mean_and_a_unit(
        costs in prop::collection::vec(0.0..1e3f64, 1..400), count in 1u32..40,
    ) {
        let shards = assign(&costs, count);
        prop_assert_eq!(shards.len(), costs.len());
        prop_assert!(shards.iter().all(|shard| *shard < count));
        let mut loads = vec![0.0; count as usize];
        shards.iter().zip(&costs).for_each(|(shard, cost)| loads[*shard as usize] += cost);
        let mean = costs.iter().sum::<f64>() / f64::from(count);
        let dearest = costs.iter().copied().fold(0.0, f64::max);
        prop_assert!(loads.iter().all(|load| *load <= mean + dearest + 1e-6), "{:?}", loads);
        prop_assert_eq!(shards, assign(&costs, count));
    }
}

/// Where all cost nothing or the same, the number of units is what counts.
#[test]
fn units_of_equal_cost_are_dealt_evenly() {
    for cost in [0.0, 1.0] {
        let mut counts = [0; 7];
        assign(&[cost; 1000], 7).iter().for_each(|shard| counts[*shard as usize] += 1);
        assert!(counts.iter().all(|n| (142..=143).contains(n)), "{counts:?}");
    }
}

#[test]
fn the_shard_follows_from_what_slurm_and_kubernetes_say() {
    let of = |count: Option<u32>, set: &[(&str, &str)]| {
        Shard::from_environment(count, |name| set.iter().find(|(n, _)| *n == name).map(|(_, value)| value.to_string()))
            .map(|shard| shard.to_string())
    };
    let array = |id: &'static str, count: &'static str, min: &'static str, max: &'static str, step: &'static str| {
        [
            ("SLURM_ARRAY_TASK_ID", id),
            ("SLURM_ARRAY_TASK_COUNT", count),
            ("SLURM_ARRAY_TASK_MIN", min),
            ("SLURM_ARRAY_TASK_MAX", max),
            ("SLURM_ARRAY_TASK_STEP", step),
        ]
    };
    assert_eq!(of(None, &[]), Ok("0/1".into()));
    assert_eq!(of(None, &array("3", "8", "0", "7", "1")), Ok("3/8".into()));
    assert_eq!(of(None, &array("8", "8", "1", "8", "1")), Ok("7/8".into()));
    assert_eq!(of(None, &array("10", "4", "4", "10", "2")), Ok("3/4".into()));
    // A part of an array that is submitted again: its tasks are other shards than before, unless their number is given.
    let part = array("7", "2", "3", "7", "1");
    assert!(of(None, &part).is_err_and(|e| e.contains("gaps") && e.contains("--shards")));
    assert_eq!(of(Some(8), &part), Ok("7/8".into()));
    assert_eq!(of(Some(5), &[("JOB_COMPLETION_INDEX", "4")]), Ok("4/5".into()));
    for (count, set, named) in [
        (None, &[("JOB_COMPLETION_INDEX", "4")][..], "--shards"),
        (Some(4), &[("JOB_COMPLETION_INDEX", "4")], "0 to 3"),
        (Some(8), &[], "--shard I/8"),
        (None, &[("SLURM_ARRAY_TASK_ID", "x")], "no number"),
        (None, &[("SLURM_ARRAY_TASK_ID", "1")], "SLURM_ARRAY_TASK_COUNT"),
    ] {
        let refused = of(count, set).expect_err("no shard");
        assert!(refused.contains(named), "{refused}");
    }
    assert!(
        ["", "1", "1/", "/2", "2/2", "-1/2", "0/0", "1.0/2", "0/99999999"].iter().all(|t| t.parse::<Shard>().is_err())
    );
}

#[test]
fn a_wrong_line_of_a_manifest_is_named_and_no_name_leaves_the_folder() {
    let folder = Folder::new("manifest");
    let digest = "0".repeat(64);
    for (line, named) in [
        ("not json", "is no unit"),
        ("{\"input\":\"a\",\"cost\":-1}", "cost"),
        ("{\"input\":\"a\",\"cots\":1}", "cots"),
        ("{\"input\":\"\"}", "input"),
        ("{\"input\":\"a\",\"digest\":\"12\"}", "digest"),
        ("{\"input\":\"a\",\"scene\":{},\"command\":[]}", "only one"),
        ("{\"input\":\"a\",\"outputs\":[\"../b.png\"]}", "no folder"),
        ("{\"input\":\"a\",\"outputs\":[\".png\"]}", "no folder"),
    ] {
        let file = folder.write("units.ndjson", format!("{{\"input\":\"a\",\"digest\":\"{digest}\"}}\n\n{line}\n"));
        let read = manifest::costs(file.as_ref()).and_then(|_| manifest::units(file.as_ref(), |_| true));
        let fault = read.expect_err(line);
        assert!(fault.contains("units.ndjson:3: ") && fault.contains(named), "{fault}");
    }
    let file = folder.write("units.ndjson", "{\"input\":\"a\"}\n\n{\"input\":\"b\",\"cost\":7}");
    assert_eq!(manifest::costs(file.as_ref()), Ok(vec![1.0, 7.0]));
    let second = manifest::units(file.as_ref(), |place| place == 1).expect("units");
    assert_eq!((second.len(), second[0].line, second[0].unit.input.as_str()), (1, 3, "b"));
    assert!(manifest::costs(folder.write("empty", "\n").as_ref()).is_err_and(|e| e.contains("no unit")));
    let long = folder.write("long", format!("{{\"input\":\"{}\"}}", "a".repeat(2 << 20)));
    assert!(manifest::costs(long.as_ref()).is_err_and(|e| e.contains("longer")));
}

fn unit(text: serde_json::Value) -> Unit {
    FromNode::from_node(text.to_node()).expect("a unit")
}

#[test]
fn every_setting_changes_the_name_of_the_output_and_wrong_commands_are_refused() {
    let folder = Folder::new("keys");
    let scene = folder.write("scene.toml", "mode = 'vr'\n");
    let (digest, other) = ("0".repeat(64), "1".repeat(64));
    let key = |value: serde_json::Value, digest: &str| {
        let work = Work::of(&unit(value)).unwrap_or_else(|e| panic!("{}", e.message()));
        work.key(digest).text().to_string()
    };
    let with_file = json!({"input": "a", "command": ["render", "--scene", scene]});
    let mut keys = vec![
        key(json!({"input": "a"}), &digest),
        key(json!({"input": "a"}), &other),
        key(json!({"input": "a", "scene": {"mode": "vr"}}), &digest),
        key(json!({"input": "a", "scene": {"mode": "mip"}}), &digest),
        key(json!({"input": "a", "command": ["render", "--mode", "mip"]}), &digest),
        key(json!({"input": "a", "command": ["render", "--volume", "1"]}), &digest),
        key(json!({"input": "a", "command": ["verify"]}), &digest),
        key(json!({"input": "a", "command": ["convert"]}), &digest),
        key(json!({"input": "a", "command": ["convert", "--spacing", "0.5"]}), &digest),
        key(json!({"input": "a", "command": ["convert"], "outputs": ["a.mha"]}), &digest),
        key(json!({"input": "a", "command": ["measure"]}), &digest),
        key(with_file.clone(), &digest),
    ];
    folder.write("scene.toml", "mode = 'mip'\n");
    keys.push(key(with_file, &digest));
    let count = keys.len();
    assert!(keys.iter().all(|k| k.len() == 32 && k.bytes().all(|b| b.is_ascii_hexdigit())), "{keys:?}");
    assert_eq!(key(json!({"input": "b"}), &digest), keys[0], "where a recording lies does not matter");
    keys.sort();
    keys.dedup();
    assert_eq!(keys.len(), count);
    for (value, named) in [
        (json!({"input": "a", "command": ["erase"]}), "render, convert, measure or verify"),
        (json!({"input": "a", "command": ["render", "--device", "1"]}), "--device"),
        (json!({"input": "a", "command": ["render", "--mode", "sideways"]}), "sideways"),
        (json!({"input": "a", "scene": {"mod": "vr"}}), "mod"),
        (json!({"input": "a", "outputs": ["a.mha"]}), ".png"),
        (json!({"input": "a", "outputs": ["a.png", "b.png"]}), "one file"),
        (json!({"input": "a", "command": ["convert"], "outputs": ["a.png"]}), ".mha"),
    ] {
        let fault = Work::of(&unit(value)).err().expect("refused").message();
        assert!(fault.contains(named), "{fault}");
    }
    assert!(Kind::Verify.needs_device() && !Kind::Convert.needs_device());
}

fn drawer(driver: &str) -> Drawer {
    Drawer { device: "A".into(), driver: driver.into(), vulkan: "1.3".into(), is_software: true }
}

fn record(input: &str, status: Status, driver: &str, sha256: &str) -> Record {
    Record {
        format: results::FORMAT.into(),
        key: format!("key of {input}"),
        line: 1,
        input: input.into(),
        work: "render".into(),
        status,
        error: (status != Status::Done).then(|| format!("<b>{input}</b>\u{1b}[2J")),
        outputs: vec![OutputFile { file: format!("{input}.png"), bytes: 1, sha256: sha256.into() }],
        seconds: Seconds::default(),
        drawer: Some(drawer(driver)),
        program: "echolume".into(),
        host: "h".into(),
        date: "2026-01-01T00:00:00Z".into(),
        figures: Map::new(),
        agreement: None,
    }
}

fn open(folder: &Folder, shard: Shard) -> Result<Results, String> {
    Results::open(folder, shard, Earlier::read(folder, shard, None)?)
}

/// Prevents a batch that goes on in a folder of other units, and units of another division or version that are counted wrongly.
#[test]
fn earlier_results_are_those_of_the_units_that_are_asked_for_in_any_shard() {
    let folder = Folder::new("earlier");
    let [own, other] = [1, 0].map(|n| Shard::new(n, 2).expect("a shard"));
    let mut asked = Asked::default();
    ["a", "b", "c", "d"].iter().for_each(|input| asked.add(input, "render"));
    let read = || Earlier::read(&folder, own, Some(&asked)).expect("read");
    assert!(!read().is_begun && !folder.0.join("results").exists(), "a folder that is only read stays as it is");
    let mut results = open(&folder, other).expect("opened");
    assert!(read().is_begun && !read().has_lines);
    let add = |results: &mut Results, input: &str, status| {
        let program = echolume::low_level::machine::program();
        results.add(&Record { program, ..record(input, status, "x", "1") }).expect("added");
    };
    add(&mut results, "z", Status::Done);
    assert!(read().has_lines && !read().is_of_these, "results of other units");
    add(&mut results, "a", Status::Done);
    add(&mut results, "b", Status::Failed);
    // Of an earlier version of the program: its outputs have other names, so that the unit is done again.
    results.add(&record("c", Status::Done, "x", "1")).expect("added");
    add(&mut open(&folder, own).expect("opened"), "d", Status::Done);
    let earlier = read();
    let done = |input: &str| earlier.says_done(input, "render");
    assert!(earlier.is_of_these);
    assert_eq!(["a", "b", "c", "d", "z"].map(done), [true, false, false, true, false]);
    assert!(!earlier.says_done("a", "measure"));
    // Lines of a shard are those of its own file.
    let results = Results::open(&folder, own, earlier).expect("opened");
    assert!(results.has(&record("d", Status::Done, "x", "1")) && !results.has(&record("a", Status::Done, "x", "1")));
}

#[test]
fn a_line_that_a_killed_process_left_spoils_no_other() {
    let folder = Folder::new("torn");
    let shard = Shard::new(2, 5).expect("a shard");
    let (mut first, second) = (record("a", Status::Done, "x", "1"), record("b", Status::Lost, "x", "1"));
    first.figures.insert("count".into(), 3.into());
    open(&folder, shard).expect("opened").add(&first).expect("added");
    let file = folder.0.join("results/shard-0002-of-0005.ndjson");
    let mut torn = std::fs::OpenOptions::new().append(true).open(&file).expect("the results");
    torn.write_all(b"{\"format\":\"echolume-batch-1\",\"key\":\"f").expect("written");
    let mut again = open(&folder, shard).expect("opened");
    assert!(again.has(&first) && !again.has(&second) && again.losses("b", "render") == 0);
    again.add(&second).expect("added");
    let (records, broken) = results::read_all(&folder).expect("read");
    first.figures.clear();
    assert_eq!((records, broken), (vec![first, second.clone()], 1), "all but the figures");
    let mut again = open(&folder, shard).expect("opened");
    assert_eq!((again.losses("b", "render"), again.losses("a", "render")), (1, 0));
    again.add(&second).expect("added");
    assert_eq!(open(&folder, shard).expect("opened").losses("b", "render"), 2);
}

#[test]
fn the_report_has_failures_first_and_one_result_a_unit() {
    let mut later = record("a", Status::Failed, "x", "1");
    later.date = "2026-02-01T00:00:00Z".into();
    let records = [
        record("a", Status::Done, "x", "1"),
        later,
        record("b", Status::Bad, "x", "1"),
        record("c", Status::Done, "y", "1"),
    ];
    let merged = Merged::of(&records);
    assert_eq!(merged.failures().map(|r| r.input.as_str()).collect::<Vec<_>>(), ["b"], "a was done once");
    let page = html(&records, 3, "/nowhere".as_ref());
    assert!(page.contains("1 of 3 units failed") && page.contains("3</strong> lines cut short"));
    assert!(page.find("id=\"failures\"") < page.find("id=\"devices\"") && page.contains("A, y"));
    assert!(!page.contains("<b>b") && !page.contains('\u{1b}'), "text from outside is escaped");
    let parsed = scraper::Html::parse_document(&page);
    assert!(parsed.errors.is_empty(), "{:?}", parsed.errors);
}

/// Bit for bit on the same driver, within the tolerance of `verify` on another.
#[test]
fn pictures_of_two_devices_are_held_to_the_tolerance_of_their_class() {
    let kept = Picture { width: 32, height: 32, rgba: [90, 120, 150, 255].repeat(1024) };
    let changed = |change: &dyn Fn(usize, u8) -> u8| {
        let rgba = kept.rgba.iter().enumerate().map(|(i, v)| if i % 4 == 3 { *v } else { change(i, *v) }).collect();
        Picture { rgba, ..kept.clone() }
    };
    let near = changed(&|i, v| if i % 64 == 0 { v + 1 } else { v });
    let far = changed(&|_, v| v + 40);
    let (x, y) = (drawer("x"), drawer("y"));
    let of = |picture: &Picture, other: &Drawer| Agreement::of(&kept, Some(&x), picture, Some(other));
    assert!(of(&kept, &x).same_bytes && of(&kept, &y).agrees);
    assert!(!of(&near, &x).agrees && of(&near, &x).class == Class::SameDriver);
    assert!(of(&near, &y).agrees && !of(&near, &y).same_bytes && !of(&near, &y).figures.is_empty());
    assert!(!of(&far, &y).agrees && of(&far, &y).fault.is_some());
    // Two processes that did the same unit: digests tell, and only within a class.
    let tries = [
        record("a", Status::Done, "x", "1"),
        record("a", Status::Done, "x", "2"),
        record("b", Status::Done, "x", "1"),
        record("b", Status::Done, "y", "1"),
        record("c", Status::Done, "x", "1"),
        record("c", Status::Done, "y", "2"),
        Record { agreement: Some(of(&far, &y)), ..record("c", Status::Failed, "y", "2") },
    ];
    let found: BTreeMap<_, _> = pairs(&tries)
        .into_iter()
        .map(|((class, _, _), pair)| (class, (pair.compared, pair.same_bytes, pair.faults.len())))
        .collect();
    assert_eq!(found[&Class::SameDriver], (1, 0, 1));
    assert_eq!(found[&Class::OtherDriver], (2, 1, 1));
}
