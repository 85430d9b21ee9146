//! Presets that a user saved: `--preset` takes them by name, after the built-in ones.

use crate::common::files::{Folder, SWEEP};
use crate::common::program::*;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::user_presets::{UserPreset, write};
use std::path::Path;
use std::process::Command;

#[test]
fn a_preset_of_the_user_is_taken_by_its_name() {
    let folder = Folder::new("user-presets");
    let file = folder.path("presets.toml");
    let mut layers = Layers::default();
    ["mode=mip", "post.gamma=1.7", "projection.window=[0.1,0.8]"].iter().for_each(|line| layers.set(line).expect(line));
    let preset = UserPreset::new("12 weeks", &layers.finish().expect("settings")).expect("a preset");
    write(Path::new(&file), &[preset]).expect("written");
    let by = |presets: &str, more: &[&str]| {
        let mut command = Command::new(PROGRAM);
        command.args(["render", SWEEP, "--size", "64x48", "--explain"]).args(more).env("ECHOLUME_PRESETS", presets);
        finish(&mut command)
    };
    let (code, own, err) = by(&file, &["--preset", "12 weeks"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(own.contains("raycast_projection"), "{own}");
    let (code, out, err) = by(&file, &["--preset", "13 weeks"]);
    assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
    assert!(err.contains("13 weeks") && err.contains("bone") && err.contains("of your own: 12 weeks"), "{err}");
    let (code, _, err) = by("none", &["--preset", "12 weeks"]);
    assert!(code == Some(2) && !err.contains("of your own"), "{err}");
    // A damaged file is in the way of the presets in it alone.
    std::fs::write(&file, "version = 1\n[[preset]\n").expect("write");
    let (code, _, err) = by(&file, &["--preset", "12 weeks"]);
    assert!(code == Some(2) && err.contains("presets.toml: line 2") && err.trim().lines().count() == 1, "{err}");
    assert_eq!(by(&file, &["--preset", "bone"]).0, Some(0));
}
