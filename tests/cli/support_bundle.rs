//! `echolume support-bundle`: complete data of the machine, no data of a patient.

use crate::common::program::*;
use flate2::read::GzDecoder;
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::Command;

/// A patient name that must not occur anywhere.
const NAME: &str = "Zquigley";

/// Entries by their names, and every byte of the archive.
fn unpacked(file: &str) -> (BTreeMap<String, String>, Vec<u8>) {
    let mut bytes = Vec::new();
    let packed = fs::File::open(file).expect("open the archive");
    GzDecoder::new(packed).read_to_end(&mut bytes).expect("unpack");
    let mut entries = BTreeMap::new();
    for entry in tar::Archive::new(&bytes[..]).entries().expect("an archive") {
        let mut entry = entry.expect("an entry");
        let name = entry.path().expect("a path").to_string_lossy().into_owned();
        let mut text = String::new();
        entry.read_to_string(&mut text).expect("text");
        entries.insert(name.strip_prefix("echolume-support/").expect("one folder").to_string(), text);
    }
    (entries, bytes)
}

fn pack(folder: &Folder, config: &str) -> (BTreeMap<String, String>, Vec<u8>) {
    let archive = folder.path(&format!("{}.tar.gz", folder.names().len()));
    let said = done(&["support-bundle", "--config", config, "-o", &archive]);
    assert!(said.contains(".tar.gz: ") && said.lines().count() == 1, "{said}");
    assert!(!folder.names().iter().any(|n| n.ends_with(".part")), "{:?}", folder.names());
    unpacked(&archive)
}

#[test]
fn the_archive_lists_its_files_and_describes_the_machine() {
    let folder = Folder::new("bundle");
    folder.write("a.log", "2026-11-22T01:00:00.000000Z  WARN newest\n");
    folder.write("a.log.1", "2026-11-22T00:00:00.000000Z  WARN older\n");
    folder.write("a.log.2", "no log at all");
    let config = folder.write("c.toml", "# a comment\n[files]\nlog = 'a.log' # another\n[display]\nscale = 2\n");
    let (entries, _) = pack(&folder, &config);
    let names: Vec<&str> = entries.keys().map(String::as_str).collect();
    let wanted = ["README.txt", "configuration/as-read.toml", "configuration/as-written.toml", "devices.txt"];
    assert_eq!(names, [&wanted[..], &["logs/echolume.log", "logs/echolume.log.1", "system.txt"]].concat());
    for name in &names[1..] {
        assert!(entries["README.txt"].contains(name), "{name}: {}", entries["README.txt"]);
    }
    assert!(["NOT contain", "logs/echolume.log.2: "].iter().all(|w| entries["README.txt"].contains(w)));
    assert!(entries["logs/echolume.log"].contains("newest") && entries["logs/echolume.log.1"].contains("older"));
    let written = &entries["configuration/as-written.toml"];
    assert!(written.contains("scale = 2") && !written.contains("comment") && !written.contains("another"), "{written}");
    let read = &entries["configuration/as-read.toml"];
    assert!(
        ["exit = \"ctrl+alt+q\"", "scale = 2.0", "source = \"phantom\""].iter().all(|w| read.contains(w)),
        "{read}"
    );
    assert!(["program: echolume", "kernel: ", "processor: "].iter().all(|w| entries["system.txt"].contains(w)));
    let devices = &entries["devices.txt"];
    assert!(["picked: ", "Vulkan 1.", "max_image_dimension3_d"].iter().all(|w| devices.contains(w)), "{devices}");
}

#[test]
fn an_injected_patient_name_is_in_no_byte_of_the_archive() {
    let folder = Folder::new("planted");
    let home = folder.0.join(format!("{NAME}, A"));
    fs::create_dir_all(&home).expect("a folder with a name");
    let source = home.join(format!("Anna {NAME} 20w.mha"));
    fs::copy(BONE, &source).expect("a recording with a name");
    let log = home.join(format!("{NAME}.log"));
    let stamp = "2026-11-22T01:00:00.000000Z  WARN";
    let lines = [
        format!("{stamp} {}: cut short", source.display()),
        format!("{stamp} saved {NAME} 3.png beside it"),
        format!("{stamp} file=/media/stick/{NAME}.vol more samples than frames"),
        format!("{stamp} there is no folder {}", home.display()),
        format!("{stamp} anna {} 20w: volume 7 was dropped", NAME.to_lowercase()),
        format!("{stamp} /data/{}/{}", NAME, "x".repeat(400)),
        format!("{stamp} igtl://{NAME}:pass@scanner:18944: gone"),
    ];
    fs::write(&log, lines.join("\n") + "\n").expect("write a log");
    let text =
        |more: &str| format!("source = {source:?} # {NAME}\n{more}\n[files]\nlog = {log:?}\npictures = {home:?}\n");
    let right = folder.write("right.toml", text("rate = 2"));
    // Refused for a key, for a value that contains the name, and completely; the last one does not say where its log is.
    let unknown = folder.write("unknown.toml", text("rat = 2"));
    let value = folder.write("value.toml", text(&format!("rate = '{}'", source.display())));
    let broken = folder.write("broken.toml", text("rate = = 2"));
    for (config, logs) in [(&right, true), (&unknown, true), (&value, true), (&broken, false)] {
        let (entries, bytes) = pack(&folder, config);
        let all = String::from_utf8_lossy(&bytes).to_lowercase();
        let at = all.find(&NAME.to_lowercase());
        assert!(
            at.is_none(),
            "{config}: {:?}",
            at.map(|at| all[at.saturating_sub(100)..].chars().take(200).collect::<String>())
        );
        assert_eq!(entries.contains_key("logs/echolume.log"), logs, "{config}: {:?}", entries.keys());
        let stand_in = if logs { "source = \"<file-" } else { "1: source" };
        let written = &entries["configuration/as-written.toml"];
        assert!(written.contains(stand_in), "{written}");
        assert_eq!(entries.contains_key("configuration/refused.txt"), config != &right);
        if logs {
            let log = &entries["logs/echolume.log"];
            assert_eq!(log.matches(stamp).count(), lines.len(), "{log}");
            assert!(
                ["cut short", "more samples than frames", "volume 7 was dropped", "scanner:18944: gone"]
                    .iter()
                    .all(|w| log.contains(w)),
                "{log}"
            );
        }
    }
}

#[test]
fn nothing_is_overwritten_and_wrong_options_are_refused() {
    let folder = Folder::new("bundle-refused");
    let there = folder.write("there.tar.gz", "mine");
    let config = folder.write("c.toml", "[files]\nlog = 'none.log'");
    let new = folder.path("new.tar.gz");
    for (output, config, code, named) in [
        (&there, &config, 2, "exists already"),
        (&folder.path("new.zip"), &config, 2, "must end in .tar.gz"),
        (&folder.path("none/new.tar.gz"), &config, 1, "no folder"),
        (&new, &folder.path("none.toml"), 2, "none.toml: is not a file"),
        (&new, &folder.path(""), 2, "is not a file"),
    ] {
        let arguments = ["support-bundle", "-o", output, "--config", config];
        refuses(&arguments, &run(&arguments), code, &[named]);
    }
    assert_eq!(fs::read(&there).expect("it is still there"), b"mine");
    assert_eq!(folder.names().len(), 2, "{:?}", folder.names());
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_no_half_an_archive() {
    let folder = Folder::new("bundle-full");
    let (config, archive) = (folder.write("c.toml", ""), folder.path("new.tar.gz"));
    // No file may grow: what a full disk does, without needing one.
    let no_room = ["-c", "trap '' XFSZ; ulimit -f 0; exec \"$@\"", "sh", PROGRAM, "support-bundle"];
    let ran = finish(Command::new("sh").args(no_room).args(["--config", &config, "-o", &archive]));
    refuses(&["full disk"], &ran, 1, &["new.tar.gz: cannot be written"]);
    assert_eq!(folder.names().len(), 1, "{:?}", folder.names());
}

#[test]
fn without_a_device_a_configuration_and_a_log_it_says_so_inside() {
    let folder = Folder::new("bundle-blind");
    let mut command = Command::new(PROGRAM);
    let (code, out, err) = finish(without_device(command.arg("support-bundle").current_dir(&folder.0)));
    assert_eq!((code, err.as_str()), (Some(0), ""), "{out}");
    let names = folder.names();
    let name = names.first().expect("an archive");
    assert!(name.starts_with("echolume-support-2") && name.ends_with("Z.tar.gz"), "{name}");
    let (entries, _) = unpacked(&folder.path(name));
    assert!(entries["devices.txt"].contains("no Vulkan device"), "{}", entries["devices.txt"]);
    assert!(entries["system.txt"].contains("VK_DRIVER_FILES=/") || entries["system.txt"].contains("VK_DRIVER_FILES=<"));
    if !Path::new(echolume::low_level::kiosk::config::DEFAULT_PATH).exists() {
        let about = &entries["README.txt"];
        assert!(about.contains("echolume.toml: cannot be read") && about.contains("logs: none found"), "{about}");
    }
}

#[test]
fn every_key_of_the_source_is_a_flag_that_there_is() {
    let folder = Folder::new("bundle-keys");
    let all = include_str!("../fuzz/seeds/configuration/all.toml");
    assert!(["real_time", "clip", "port", "timeout"].iter().all(|key| all.contains(&format!("\n{key} = "))));
    // Options that exclude each other are given the other way round.
    let other =
        all.replace("rate = 2\nreal_time = false", "real_time = true\nrounds = 2").replace("loop = false\n", "");
    for text in [all, &other.replace("delay = 12", "stamps = true")] {
        let config = folder.write("c.toml", text);
        let (entries, _) = pack(&folder, &config);
        assert!(!entries.contains_key("configuration/refused.txt"), "{:?}", entries.get("configuration/refused.txt"));
        assert!(!entries["README.txt"].contains("configuration: "), "{}", entries["README.txt"]);
    }
}

#[test]
fn the_rules_of_the_command_line_hold_in_a_configuration() {
    let folder = Folder::new("bundle-rules");
    for (text, named) in [
        ("\nrate = 0", "line 2: rate: 0: must be above 0"),
        ("rate = 1\nreal_time = true", "line 1: rate: the argument 'rate' cannot be used with 'real_time'"),
        (
            "[motor]\nport = 'p'\nsweeps = 1\nstop_bits = 3",
            "line 4: motor.stop_bits: invalid value '3' for 'motor.stop_bits'",
        ),
        ("[motor]\nport = 'p'\nsweeps = 1\ndelay = -1", "line 4: motor.delay: -1: must be 0 to 10000 ms"),
        ("source = 'igtl://h'\nspacing = 0", "line 2: spacing: 0: must lie in 0.01..=1000 mm"),
    ] {
        let config = folder.write("c.toml", text);
        let about = &pack(&folder, &config).0["README.txt"];
        let said = about.lines().find(|l| l.contains("configuration: ")).expect("it is wrong");
        assert!(said.contains(named) && !said.contains("--"), "{text}: {said}");
    }
}
