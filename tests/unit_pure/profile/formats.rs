//! Tables, CSV and JSON of a profile.

use super::simulated::{Noise, Random, pass, profile, run};
use echolume::low_level::baselines::Stored;
use echolume::low_level::profile::export::{csv, csv_samples, profile_table};
use echolume::low_level::profile::{Profile, settings_hash};

fn measured() -> Profile {
    let mut profile = run(&mut Random(81), 4, 30, Noise { spread: 0.03, ..Noise::default() });
    profile.host.push(pass("submit", vec![20_000.0; 30]));
    profile
}

fn without_stamps() -> Profile {
    let mut profile = measured();
    profile.device.valid_bits = 0;
    profile.device_ns.clear();
    profile.passes.iter_mut().for_each(|p| p.samples_ns.clear());
    profile
}

#[test]
fn json_round_trips_without_a_change() {
    let mut random = Random(82);
    let mut odd = measured();
    // Fractions that are off by one bit if a reader rounds carelessly.
    odd.passes[0].samples_ns.iter_mut().for_each(|ns| *ns = random.between(0.0, 1e7));
    odd.passes[1].filtered = None;
    odd.cpu_ns = Vec::new();
    odd.turn = -2.5;
    odd.ceilings = None;
    odd.acquisition = None;
    odd.device.clocks = None;
    odd.passes[2].name = "quote \" comma , break \n".into();
    for profile in [measured(), odd, without_stamps()] {
        let text = profile.to_json().expect("JSON");
        assert_eq!(Profile::from_json(&text).expect("profile"), profile);
    }
}

#[test]
fn other_versions_other_files_and_contradictions_are_refused() {
    let good = measured().to_json().expect("JSON");
    let error = |text: &str| Profile::from_json(text).expect_err("refused").to_string();
    let other = good.replace("echolume-profile-3", "echolume-profile-9");
    assert_eq!(
        error(&other),
        "format is \"echolume-profile-9\", this program reads \"echolume-profile-3\"; profile again with it"
    );
    for text in
        ["", "[]", "{}", "{\"format\": 3}", "nonsense", &good[..good.len() / 2], &good.replace("warm_up", "warm")]
    {
        assert!(error(text).starts_with("not a profile: "), "{}", error(text));
    }
    let broken = |change: fn(&mut Profile)| {
        let mut profile = measured();
        change(&mut profile);
        profile.to_json().expect_err("refused").to_string()
    };
    assert_eq!(broken(|p| p.passes[1].samples_ns.truncate(7)), "pass 1: has 7 times for 30 repeats");
    assert_eq!(broken(|p| p.repeats = 0), "repeats: is 0; at least one picture must be measured");
    assert_eq!(broken(|p| p.passes[1].name = "pass 0".into()), "passes: \"pass 0\" is there twice");
    assert!(broken(|p| p.device.valid_bits = 0).contains("the device has no time stamps"));
    assert!(broken(|p| p.passes[0].samples_ns[2] = -1.0).starts_with("pass 0: time 2 is -1 ns"));
    assert!(broken(|p| p.device.timestamp_period_ns = f64::NAN).contains("NaN is not finite"));
    assert!(broken(|p| p.ceilings.as_mut().unwrap().fetch.low = f64::INFINITY).starts_with("fetch: ceiling"));
}

/// A file of the first version has neither CPU time nor a rotating camera, one of the second no CPU time of passes.
#[test]
fn profiles_of_earlier_versions_are_read() {
    let mut before = measured();
    before.cpu_ns.clear();
    let text = before.to_json().expect("JSON");
    let lists = text.lines().filter(|l| l.contains("\"cpu_ns\"")).count();
    assert_eq!(lists, 1 + before.passes.len() + before.host.len());
    for version in [1, 2] {
        let is_kept = |line: &&str| !(line.contains("\"cpu_ns\"") || version == 1 && line.contains("\"turn\""));
        let lines: Vec<&str> = text.lines().filter(is_kept).collect();
        let text = lines.join("\n").replace("echolume-profile-3", &format!("echolume-profile-{version}"));
        assert_eq!(Profile::from_json(&text).expect("profile"), before, "version {version}");
    }
}

#[test]
fn cpu_time_is_shown_and_written_where_it_is_known() {
    let known = measured();
    assert!(profile_table(&known).contains("CPU, all threads"));
    assert!(csv(&known).lines().any(|l| l.starts_with("cpu,,cpu,1,30,3000000,")), "{}", csv(&known));
    let unknown = Profile { cpu_ns: Vec::new(), ..measured() };
    assert!(!profile_table(&unknown).contains("CPU, all threads") && !csv(&unknown).contains("cpu,"));
    let short = Profile { cpu_ns: vec![1.0; 29], ..measured() };
    assert_eq!(short.to_json().expect_err("refused").to_string(), "cpu_ns: has 29 times for 30 repeats");
    let mut short = measured();
    short.passes[1].cpu_ns = vec![1.0; 29];
    assert_eq!(short.to_json().expect_err("refused").to_string(), "pass 1: has 29 times for 30 repeats");
}

#[test]
fn the_table_holds_every_pass_and_its_numbers() {
    let mut profile = profile(30);
    let times: Vec<f64> = (1..=30).map(|i| 1e6 * f64::from(i)).collect();
    profile.passes = vec![pass("volume", times.clone()), pass("tone", times.iter().rev().copied().collect())];
    profile.device_ns = vec![35e6; 30];
    profile.wall_ns = vec![40e6; 30];
    let text = profile_table(&profile);
    println!("{text}");
    let row = |start: &str| text.lines().find(|l| l.starts_with(start)).unwrap_or_else(|| panic!("{start}: {text}"));
    // Median 15.5 ms; order statistics 10 and 21; 4 MB in 15.5 ms; 8 M filtered samples of 1e11 a second are the nearer roof.
    let cells: Vec<&str> = row("raycast  volume").split_whitespace().collect();
    let numbers =
        ["15.5000", "2.4500", "28.5500", "10.0000..21.0000", "+187.5", "0.26", "0.5", "sampling", "0.262", "50.0"];
    assert_eq!(cells[2..], [&["1"], &numbers[..]].concat());
    // 1 + 30 = 2 + 29 = ... ms: every repeat's passes take 31 ms of 40, and the device idles 4 of its 35.
    assert!(row("passes, sum").contains("31.0000") && row("passes, sum").ends_with("77.5"), "{text}");
    assert!(row("idle between passes").contains("4.0000") && row("idle between passes").ends_with("10.0"));
    assert!(row("device, first to last").ends_with("87.5") && row("wall, submit to idle").ends_with("100.0"));
    assert!(text.contains("not steady, halves of the run differ by more than 5 %: volume, tone"));
    assert!(text.contains("sound itself needs 800.0 ms for this volume (1540 m/s): no display is faster"));
    assert!(text.contains("clocks       graphics 1.5 GHz"), "{text}");
    // Columns line up: every row of passes ends in the same place.
    let ends: Vec<usize> =
        text.lines().filter(|l| l.starts_with("stage") || l.starts_with("raycast")).map(str::len).collect();
    assert!(ends.len() == 3 && ends.iter().all(|e| *e == ends[0]), "{text}");
}

#[test]
fn without_time_stamps_no_pass_has_a_time_and_the_host_still_has() {
    let text = profile_table(&without_stamps());
    assert!(text.contains("this device has no time stamps"), "{text}");
    assert!(!text.contains("pass 0") && !text.contains("passes, sum") && !text.contains("idle between"), "{text}");
    assert!(text.contains("host: submit") && text.contains("wall, submit to idle"), "{text}");
    let csv = csv(&without_stamps());
    let line = csv.lines().find(|l| l.contains("pass 0")).expect("pass");
    assert!(line.starts_with("pass,raycast,pass 0,1,0,,,,,,,,,,3000000,1000000,,"), "{line}");
}

#[test]
fn unknown_values_and_too_few_repeats_are_reported() {
    let mut profile = run(&mut Random(83), 2, 3, Noise { spread: 0.01, ..Noise::default() });
    profile.device.clocks = None;
    profile.device.is_software = true;
    profile.device.calibrated = false;
    profile.ceilings = None;
    let text = profile_table(&profile);
    for part in [
        "* 3 repeats are too few for 95 %: the whole range covers 75.0 %",
        "clocks       not known: runs at other clocks",
        "(software: computes on the CPU)",
        "not tied to the host's clock",
        "a software device stamps times by the CPU's clock",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("ceiling"), "{text}");
}

/// Fields of a line by RFC 4180.
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            c => fields.last_mut().expect("field").push(c),
        }
    }
    fields
}

#[test]
fn csv_has_as_many_fields_as_its_head_and_the_tables_numbers() {
    let mut profile = measured();
    profile.passes[3].stage = "ray, cast".into();
    let text = csv(&profile);
    let rows: Vec<Vec<String>> = text.lines().map(fields).collect();
    assert_eq!(rows.len(), 1 + 4 + 1 + 3);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{text}");
    let column = |name: &str| rows[0].iter().position(|c| c == name).expect("column");
    let sample = profile.passes[3].sample().expect("times");
    assert_eq!(rows[4][column("stage")], "ray, cast");
    assert_eq!(rows[4][column("median_ns")].parse(), Ok(sample.median()));
    assert_eq!(rows[4][column("ci_high_ns")].parse(), Ok(sample.sorted()[20]));
    assert_eq!(rows[4][column("ceiling")], "sampling");
    let share = |row: &Vec<String>| row[column("share_of_passes")].parse::<f64>().expect("share");
    assert!((rows[1..5].iter().map(share).sum::<f64>() - 1.0).abs() < 1e-12);
    assert_eq!(rows[5][column("share_of_passes")], "", "a host span has no share of the passes");

    let long = csv_samples(&profile);
    assert_eq!(long.lines().count(), 1 + 30 * (4 + 1 + 3));
    let line = long.lines().find(|l| l.starts_with("pass,raycast,pass 2,17,")).expect("line");
    assert_eq!(line.rsplit(',').next().map(str::parse), Some(Ok(profile.passes[2].samples_ns[17])));
}

#[test]
fn the_nearest_roofline_limits_a_pass() {
    let ceilings = profile(1).ceilings.expect("ceilings");
    // In 1 ms: 4 MB are 1 % of 4e11 B/s.
    let mut pass = pass("a", vec![1e6]);
    pass.filtered = None;
    let roof = pass.roof(&ceilings).expect("roof");
    assert!(roof.bound == "copy" && (roof.share - 0.01).abs() < 1e-12, "{roof:?}");
    // 100 M fetches are half of 2e11 a second.
    pass.fetches = Some(100_000_000);
    let roof = pass.roof(&ceilings).expect("roof");
    assert!(roof.bound == "fetch" && (roof.share - 0.5).abs() < 1e-12, "{roof:?}");
    pass.samples_ns = vec![0.0];
    assert_eq!(pass.roof(&ceilings), None);
    assert_eq!(pass.bytes_per_second(), None);
}

#[test]
fn the_hash_of_settings_is_fnv_1a() {
    // The test values of its authors (http://www.isthe.com/chongo/tech/comp/fnv/).
    assert_eq!(settings_hash(""), "cbf29ce484222325");
    assert_eq!(settings_hash("a"), "af63dc4c8601ec8c");
    assert_eq!(settings_hash("foobar"), "85944171f73967e8");
}
