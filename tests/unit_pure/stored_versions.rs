//! Files that earlier programs wrote (tests/data/versions): they are read as they were meant, and a version that is not known yet is refused by its
//! number.

use crate::common::files::{Folder, repository};
use echolume::low_level::baselines::Stored;
use echolume::low_level::error_report::Report;
use echolume::low_level::kiosk::config::Config;
use echolume::low_level::profile::Profile;
use echolume::low_level::scene::{Mode, Settings};
use echolume::low_level::source::recorder::Reader;
use echolume::low_level::user_presets;
use echolume::low_level::verify::report::Run;
use echolume::low_level::workspace::Workspace;
use echolume::{Geometry, Layers};
use std::path::{Path, PathBuf};

fn stored(name: &str) -> PathBuf {
    repository("tests/data/versions").join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(stored(name)).expect(name)
}

/// The message about this file as a later version of its kind: `from` is replaced by `to`, and there once.
fn refused<T>(name: &str, from: &[u8], to: &[u8], read: impl Fn(&Path) -> Result<T, String>) -> String {
    let mut bytes = std::fs::read(stored(name)).expect(name);
    let at: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at..].starts_with(from)).collect();
    assert_eq!(at.len(), 1, "{name} states its version once");
    bytes.splice(at[0]..at[0] + from.len(), to.iter().copied());
    let folder = Folder::new("stored-versions");
    let file = PathBuf::from(folder.path(name));
    std::fs::write(&file, bytes).expect("written");
    read(&file).err().unwrap_or_else(|| panic!("{name} is read as a later version"))
}

fn scene(file: &Path) -> Result<Settings, String> {
    let mut layers = Layers::default();
    layers.file(file).map_err(|e| e.to_string())?;
    layers.finish().map_err(|e| e.to_string())
}

/// Settings from before versions were stated, under the names that they had then.
#[test]
fn settings_files_of_version_1_are_read() {
    let settings = scene(&stored("scene-1.toml")).expect("a scene");
    assert_eq!((settings.mode, settings.picture.size), (Mode::Mip, [8, 8]));
    assert_eq!(settings.ray.subsampling, 1, "half = false");
    let workspace = Workspace::read(&stored("workspace-1.toml")).expect("a workspace");
    assert_eq!((workspace.origin.volume, workspace.layers.finish().expect("settings")), (3, settings));
    let presets = user_presets::read(&stored("presets-1.toml")).expect("presets");
    assert_eq!((presets.len(), presets[0].name.as_str()), (1, "dark"));
    assert_eq!(presets[0].look().expect("a look").volume.window, [0.25, 0.75]);
    let file = stored("configuration-1.toml");
    let config = Config::parse(&text("configuration-1.toml"), &file).expect("a configuration");
    assert_eq!((config.source.as_str(), config.rate), ("phantom", Some(2.0)));
    assert!(config.to_toml().expect("text").starts_with("version = 1\n"), "what is written states the version");

    // Stated, it changes nothing; another one is refused in the line where it stands.
    let old = text("scene-1.toml");
    assert_eq!(Settings::from_toml(&format!("version = 1\n{old}")), Settings::from_toml(&old));
    let parsed =
        |file: &Path| Config::parse(&std::fs::read_to_string(file).expect("text"), file).map_err(|e| e.to_string());
    let later = [
        refused("scene-1.toml", b"mode = \"mip\"", b"version = 2\nmode = \"mip\"", scene),
        refused("configuration-1.toml", b"source = \"phantom\"", b"version = 2\nsource = \"phantom\"", parsed),
        refused("workspace-1.toml", b"version = 1", b"version = 2", Workspace::read),
        refused("presets-1.toml", b"version = 1", b"version = 2", user_presets::read),
    ];
    for fault in later {
        assert!(fault.contains("version 2") && fault.contains("this program reads version 1"), "{fault}");
        assert_eq!(fault.lines().count(), 1, "{fault}");
    }
}

#[test]
fn recordings_of_version_1_are_read() {
    for (name, is_posed) in [("frames-1.frames", false), ("frames-1-posed.frames", true)] {
        let reader = Reader::open(&stored(name)).expect(name);
        assert_eq!((reader.frames(), reader.damaged(), reader.lost()), (4, 0, 0), "{name}");
        let is_sweep = matches!(reader.header().forward, Geometry::Sweep(_));
        assert_eq!((reader.rebuilt(), reader.header().posed, is_sweep), (false, is_posed, !is_posed), "{name}");
    }
    let open = |file: &Path| Reader::open(file).map(drop).map_err(|e| e.to_string());
    let fault = refused("frames-1.frames", b"ECHOFRMS\x01", b"ECHOFRMS\x02", open);
    assert!(fault.contains("version: is 2, this program reads 1"), "{fault}");
}

/// What was read is written as the version of today, and is the same then.
fn renewed<T: Stored>(name: &str, later: &str) -> T {
    let read = T::load(&stored(name)).expect(name);
    let written = read.to_json().expect(name);
    assert!(written.contains(T::FORMAT), "{name} is written as {}", T::FORMAT);
    // As text, in which a number that is none is itself.
    assert_eq!(T::from_json(&written).and_then(|again| again.to_json()).expect(name), written);
    let stated = text(name);
    let format = [T::FORMAT].iter().chain(T::EARLIER).find(|format| stated.contains(**format)).expect("a format");
    let fault = refused(name, format.as_bytes(), later.as_bytes(), T::load);
    assert!(fault.contains(later) && fault.contains(T::FORMAT), "{fault}");
    read
}

#[test]
fn reports_of_the_last_versions_are_read() {
    let old: Profile = renewed("profile-2.json", "echolume-profile-4");
    assert_eq!((old.repeats, old.passes.len(), old.passes[4].name.as_str()), (2, 7, "raycast_projection"));
    assert!(old.passes.iter().all(|pass| pass.cpu_ns.is_empty()), "version 2 has no CPU times of passes");
    let new: Profile = renewed("profile-3.json", "echolume-profile-4");
    assert!(new.repeats == 2 && new.passes.iter().any(|pass| pass.name.starts_with("raycast")));
    let run: Run = renewed("verify-1.json", "echolume-verify-2");
    assert_eq!((run.outcomes[0].group.as_str(), run.outcomes[0].name.as_str()), ("passes", "tone"));
    let report = Report::from_json(&text("error-report-3.json")).expect("an error report");
    assert_eq!((report.sizes.picture, report.repeats), ([64, 48], 6));
    let load = |file: &Path| Report::from_json(&std::fs::read_to_string(file).expect("text"));
    let fault = refused("error-report-3.json", b"echolume error report 3", b"echolume error report 4", load);
    assert!(fault.contains("'echolume error report 4', this program reads 'echolume error report 3'"), "{fault}");
}
