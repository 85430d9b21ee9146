use super::*;
use std::collections::BTreeSet;

const EXAMPLE: &str = include_str!("../../../../tools/kiosk/echolume.toml");

fn parse(text: &str) -> Result<Config, ConfigError> {
    Config::parse(text, Path::new("/etc/e/echolume.toml"))
}

fn parse_error(text: &str) -> String {
    let error = parse(text).expect_err(text).to_string();
    assert!(error.starts_with("/etc/e/echolume.toml: ") && error.lines().count() == 1, "{error}");
    error
}

/// All keys of a table and of its tables, without those of the scene.
fn keys(above: &str, table: &toml::Table) -> BTreeSet<String> {
    let named = table.iter().flat_map(|(name, value)| {
        let key = if above.is_empty() { name.clone() } else { format!("{above}.{name}") };
        let inner = value.as_table().filter(|_| key != "scene").map(|inner| keys(&key, inner)).unwrap_or_default();
        inner.into_iter().chain([key])
    });
    named.collect()
}

/// The keys of [`Config`], as the error lists them for an unknown key.
fn keys_of_the_type() -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    for (above, text) in ["", "motor", "display", "keys", "live", "files"].map(|t| (t, format!("[{t}]\nzz = 1"))) {
        let text = if above.is_empty() { "zz = 1" } else { &text };
        let message = tree::from_toml::<Config>(text).expect_err("zz is unknown").message().to_string();
        let names = message.split('`').skip(3).step_by(2);
        all.extend(names.map(|name| if above.is_empty() { name.into() } else { format!("{above}.{name}") }));
    }
    all
}

#[test]
fn the_example_has_every_key_and_marks_values_that_are_not_the_default() {
    let all: BTreeSet<String> = ALLOWED.iter().map(|(key, _)| key.to_string()).collect();
    assert_eq!(all, keys_of_the_type());
    let off: String = EXAMPLE
        .lines()
        .map(|l| l.strip_prefix('#').filter(|l| !l.starts_with(' ')).unwrap_or(l).to_string() + "\n")
        .collect();
    assert_eq!(keys("", &toml::from_str(&off).expect("TOML")), all);
    // All keys together are valid, except for those that exclude each other.
    parse(&off.replace("rounds = 3", "").replace("stamps = true", "")).expect("all of it");

    let example = parse(EXAMPLE).expect("the example");
    let shown = toml::Table::from_node(example.to_node()).expect("tables");
    let defaults = toml::Table::from_node(Config::default().to_node()).expect("tables");
    for (name, value) in keys("", &shown).iter().map(|key| (key, at(&shown, key))) {
        let line =
            EXAMPLE.lines().position(|l| l.starts_with(&format!("{} =", name.rsplit('.').next().expect("a name"))));
        let mentions_default = |line: usize| {
            let comment = EXAMPLE.lines().take(line).collect::<Vec<_>>();
            comment.iter().rev().take_while(|l| l.starts_with("# ")).any(|l| l.contains("Default:"))
        };
        let differs = !value.is_table() && value != at(&defaults, name);
        assert!(
            !differs || line.is_some_and(mentions_default),
            "{name} = {value} is not the default, and its comment does not say so"
        );
    }
}

fn at(table: &toml::Table, key: &str) -> toml::Value {
    let mut value = toml::Value::Table(table.clone());
    for name in key.split('.') {
        value = value.get(name).cloned().unwrap_or(toml::Value::Boolean(false));
    }
    value
}

#[test]
fn values_are_read_and_missing_ones_have_the_documented_defaults() {
    assert_eq!(parse("").expect("an empty file").display, Config::default().display);
    let text = "source = 'sweeps/a b.mha'\nprobe = '/p.toml'\nreal_time = true\nclip = [1, 2, 3, 4]\npreset = ['bone']\n\
                [scene]\nmode = 'volume'\n[scene.surface]\nthreshold = 0.3\n\
                [display]\nbudget = '33ms'\nreport = 'error.json'\npresent = 'mailbox'\n\
                [keys]\nexit = 'Shift+F4'\n[live]\nupdate = 'rolling'\nretry = '1min 30s'\n[files]\npictures = 'p'";
    let config = parse(text).expect("right");
    assert_eq!(
        (config.source.as_str(), config.probe.as_deref()),
        ("/etc/e/sweeps/a b.mha", Some(Path::new("/p.toml")))
    );
    assert_eq!(config.display.budget, Some(Duration::from_millis(33)));
    assert_eq!(config.display.report.as_deref(), Some(Path::new("/etc/e/error.json")));
    assert_eq!(config.keys.exit, Chord::parse("shift+f4").ok());
    assert_eq!((config.live.update, config.live.retry), (Update::Rolling, Duration::from_secs(90)));
    assert_eq!(config.files.pictures.as_deref(), Some(Path::new("/etc/e/p")));
    let settings = config.layers().expect("layers").finish().expect("settings");
    assert_eq!((settings.mode, settings.surface.threshold), (crate::scene::Mode::Volume, 0.3));
    assert_eq!(parse("[keys]\nexit = 'none'").expect("right").keys.exit, None);
    let arguments = ["--source=/etc/e/sweeps/a b.mha", "--probe=/p.toml", "--clip=1,2,3,4", "--real-time"];
    assert_eq!(config.source_arguments(), arguments);
    let motor =
        parse("loop = true\n[motor]\nport = '/dev/ttyUSB0'\nsweeps = 2\nstop_bits = 2\nstamps = true").expect("right");
    let arguments =
        ["--source=phantom", "--rounds=4294967295", "--motor=/dev/ttyUSB0", "--sweeps=2", "--stop-bits=2", "--stamps"];
    assert_eq!(motor.source_arguments(), arguments);
}

#[test]
fn a_written_configuration_is_read_back() {
    let text = "source = 'igtl://u:p@h:1'\n[scene]\nclip = [{ at = [0, 0, 0], normal = [1, 0, 0] }]\n[display]\nbudget = '1s'\n\
                report = '/r'\n[motor]\nport = 'p'\nsweeps = 0.5";
    for text in ["", text] {
        let config = parse(text).expect("right");
        let written = config.to_toml().expect("TOML");
        let again = parse(&written).expect("the same");
        assert_eq!(again.to_toml().expect("TOML"), written);
    }
}

#[test]
fn errors_name_the_line_the_key_and_the_allowed_values() {
    for (text, named) in [
        ("\n\nsorce = 'x'", &["line 3: sorce: unknown field `sorce`", "`source`"][..]),
        ("[display]\n\nscal = 2", &["line 3: display.scal: unknown", "`scale`"]),
        ("display.scale = 9", &["line 1: display.scale: must be 0.5 to 4"]),
        ("[display]\nscale = nan", &["line 2: display.scale: must be 0.5 to 4"]),
        ("[display]\nscale = 'big'", &["line 2: display.scale: invalid type", "must be 0.5 to 4"]),
        ("[display]\nsize = [0, 5]", &["line 2: display.size", "each 64 to 16384"]),
        ("[display]\nsize = [-1, 500]", &["line 2: display.size", "each 64 to 16384"]),
        ("[display]\nsize = 5", &["line 2: display.size", "each 64 to 16384"]),
        ("[display]\npresent = 'vsync'", &["line 2: display.present", "mailbox"]),
        ("[display]\nbudget = '33 parsecs'", &["line 2: display.budget", "33 parsecs", "1ms to 10s"]),
        ("[display]\nbudget = 'none'\nreport = 'a.json'", &["line 3: display.report", "needs display.budget"]),
        ("[keys]\nexit = 'hyper+q'", &["line 2: keys.exit", "hyper", "ctrl+alt+q"]),
        ("[live]\nupdate = 'often'", &["line 2: live.update", "rolling"]),
        ("[live]\ncine_volumes = 0", &["line 2: live.cine_volumes: must be 1 to 1000"]),
        ("[live]\ncine_memory_mb = 1e9", &["line 2: live.cine_memory_mb", "16 to 65536"]),
        ("[live]\nretry = '1ms'", &["line 2: live.retry: must be a time from 100ms"]),
        ("[files]\nlog_files = 101", &["line 2: files.log_files: must be 1 to 100"]),
        ("[files]\nlog_size_mb = 2000", &["line 2: files.log_size_mb: must be 1 to 1024"]),
        ("source = '-'", &["line 1: source: must be \"phantom\", the file of a recording"]),
        ("source = ''", &["line 1: source: must be"]),
        ("source = 'http://x'", &["line 1: source: must be"]),
        ("source = 'igtl://'", &["line 1: source: must be"]),
        ("source = 5", &["line 1: source", "igtl://HOST"]),
        ("loop = true\nrounds = 2", &["line 1: loop", "rounds"]),
        ("rounds = -2", &["line 1: rounds", "whole number"]),
        ("clip = [1, 2]", &["line 1: clip", "[x, y, width, height]"]),
        ("[motor]\nport = 'p'", &["line 1: motor: must be a table with port and sweeps"]),
        ("preset = ['foetal']", &["line 1: preset: preset \"foetal\" is unknown", "fetal"]),
        ("[scene]\n[scene.surface]\ntreshold = 1", &["line 3: scene.surface.treshold: unknown", "`threshold`"]),
        ("[scene]\nmode = 'sideways'", &["line 2: scene.mode", "sideways"]),
        ("[scene]\nsurface.threshold = nan", &["line 2: scene.surface.threshold"]),
        ("[scene]\nvolume.transfer = 'none.toml'", &["line 1: scene: /etc/e/none.toml: cannot be read"]),
        ("[display", &["line 1: "]),
        ("a = \"\\u0007\u{7f}", &["line 1: "]),
        ("\"a\\nb\" = 1", &["line 1: a b: unknown field"]),
        ("a = 1\na = 2", &["line 2: "]),
        ("display = 5", &["line 1: display", "must be a table"]),
    ] {
        let error = parse_error(text);
        assert!(named.iter().all(|n| error.contains(n)), "{text:?}: {error}");
    }
    assert!(parse_error(&format!("source = ['{}']", "x".repeat(100_000))).len() < 1000);
    assert!(parse_error(&"[a.".repeat(100_000)).len() < 1000);
    assert!(parse_error(&format!("a = {}", "[".repeat(100_000))).len() < 1000);
}

#[test]
fn messages_about_flags_become_messages_about_keys() {
    let config =
        parse("source = 'a.mha'\nrate = 0\n[motor]\nport = 'p'\nsweeps = 1\nstop_bits = 3").expect("right so far");
    for (message, expected) in [
        ("--rate 0: must be above 0, at most 1e6", "line 2: rate: 0: must be above 0, at most 1e6"),
        (
            "invalid value '3' for '--stop-bits <N>': 3 is not",
            "line 6: motor.stop_bits: invalid value '3' for 'motor.stop_bits': 3",
        ),
        (
            "the argument '--rate <N>' cannot be used with '--real-time'",
            "line 2: rate: the argument 'rate' cannot be used with 'real_time'",
        ),
        ("--motor needs --probe FILE", "line 4: motor.port: needs probe FILE"),
        ("--tool x", "echolume.toml: tool: x"),
        ("something else --rates", "echolume.toml: something else --rates"),
    ] {
        let error = config.flag_error(message).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_file_that_is_no_small_text_is_refused_in_one_line() {
    let work = crate::files::WorkFolder::new(&std::env::temp_dir(), "echolume-config-").expect("make a folder");
    let folder = work.path();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("write");
    write("long.toml", "#".repeat((1 << 20) + 1).as_bytes());
    write("latin.toml", b"source = '\xe4'");
    write("right.toml", b"[files]\nlog = 'a.log'");
    for (name, named) in [
        ("none.toml", "cannot be read"),
        ("", "not a regular file"),
        ("long.toml", "longer than 1 MiB, which no configuration is"),
        ("latin.toml", "UTF-8"),
    ] {
        let error = Config::read(&folder.join(name)).expect_err(name).to_string();
        assert!(error.contains(named) && error.contains(name) && error.lines().count() == 1, "{error}");
    }
    assert_eq!(Config::read(&folder.join("right.toml")).expect("right").files.log, Some(folder.join("a.log")));
}
