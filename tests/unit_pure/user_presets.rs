//! Presets of a user: what is saved is the look, is read again exactly, and a damaged file is never replaced.

use crate::common::files::Folder;
use echolume::low_level::scene::Settings;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::user_presets::{MAX_NAME, MAX_PRESETS, UserPreset, checked_name, read, write};
use std::path::PathBuf;

fn settings(preset: &str, lines: &[&str]) -> Settings {
    let mut layers = Layers::default();
    layers.preset(preset).expect("preset");
    lines.iter().for_each(|line| layers.set(line).expect(line));
    layers.finish().expect("settings")
}

#[test]
fn what_is_saved_is_read_again_exactly_and_whole() {
    let folder = Folder::new("presets-exact");
    let file = PathBuf::from(folder.path("config")).join("presets.toml");
    assert_eq!(read(&file).expect("no file is no fault"), []);
    let settings = ["face", "glass", "bone", "bmode", "thesis"].map(|preset| settings(preset, &["camera.azimuth=40"]));
    let presets: Vec<_> = settings
        .iter()
        .enumerate()
        .map(|(n, settings)| UserPreset::new(&format!(" Ärztin {n} \"x\" "), settings).expect("a preset"))
        .collect();
    write(&file, &presets).expect("written");
    let again = read(&file).expect("read");
    assert_eq!(again, presets, "in their order");
    assert_eq!(again[1].name, "Ärztin 1 \"x\"");
    for (preset, settings) in again.iter().zip(&settings) {
        let look = preset.look().expect("a look");
        assert_eq!(look, settings.look());
        assert_eq!(look.camera, Settings::default().camera, "the view stays with the examination");
    }
    let left: Vec<_> = std::fs::read_dir(file.parent().expect("a folder")).expect("a folder").flatten().collect();
    assert_eq!(left.len(), 1, "nothing unfinished stays");
}

#[test]
fn a_look_takes_the_place_of_the_look_before_and_leaves_the_examination() {
    let look = settings("glass", &[]);
    let mut layers = Layers::default();
    layers.preset("face-classic").expect("preset");
    layers.set("camera.azimuth=40").expect("camera");
    let before = layers.clone().finish().expect("settings");
    layers.look("mine", &look.look()).expect("a look");
    layers.set("post.gamma=1.5").expect("over it");
    let found = layers.clone().finish().expect("settings");
    let mut wanted = look.look_over(&before);
    wanted.post.gamma = 1.5;
    assert_eq!(found, wanted);
    assert!(before.light.shadow.is_some() && found.light.shadow.is_none(), "no shadow is left of the look before");
    assert!(layers.gives("volume.transfer") && layers.gives("slices.smooth") && !layers.gives("region.depth"));
}

/// Prevents a file that someone edited from being lost.
#[test]
fn a_damaged_file_is_one_line_and_stays_as_it_is() {
    let folder = Folder::new("presets-damaged");
    let good = UserPreset::new("mine", &settings("glass", &[])).expect("a preset");
    let long = format!("version = 1\n{}", "[[preset]]\nname = 'a'\n[preset.settings]\n".repeat(MAX_PRESETS + 1));
    for (text, part) in [
        ("version = 1\n[[preset]\n", "line 2"),
        ("version = 2\n", "version 2"),
        ("", "version"),
        ("version = 1\n[[preset]]\nname = 'a'\n", "settings"),
        ("version = 1\n[[preset]]\nname = \"a\\nb\"\n[preset.settings]\n", "name"),
        (&format!("version = 1\n{}", "[[preset]]\nname = 'a'\n[preset.settings]\n".repeat(2)), "twice"),
        (&long, "at most"),
    ] {
        let file = PathBuf::from(folder.write("presets.toml", text));
        let said = read(&file).expect_err(text);
        assert!(said.contains("presets.toml") && said.contains(part) && said.lines().count() == 1, "{said}");
        let said = write(&file, std::slice::from_ref(&good)).expect_err(text);
        assert!(said.contains("left as it is") && said.lines().count() == 1, "{said}");
        assert_eq!(std::fs::read_to_string(&file).expect("the file"), text);
    }
    // One preset that another version saved leaves the others usable.
    let text = "version = 1\n[[preset]]\nname = 'a'\n[preset.settings]\ncolour = 3\n[[preset]]\nname = 'b'\n[preset.settings]\nmode = 'mip'\n";
    let presets = read(&PathBuf::from(folder.write("presets.toml", text))).expect("a list");
    let said = presets[0].look().expect_err("an unknown setting");
    assert!(said.contains("\"a\"") && said.contains("colour") && said.lines().count() == 1, "{said}");
    assert_eq!(presets[1].look().expect("a look").mode, echolume::low_level::scene::Mode::Mip);
    // So does one whose name a later version gave to a preset of its own: it can be given another.
    let file =
        PathBuf::from(folder.write("presets.toml", "version = 1\n[[preset]]\nname = 'Face'\n[preset.settings]\n"));
    assert_eq!(read(&file).expect("a list")[0].name, "Face");
    // More than can be read are not written.
    let said = write(&file, &vec![good.clone(); MAX_PRESETS + 1]).expect_err("too many");
    assert!(said.contains("delete one") && read(&file).expect("a list").len() == 1, "{said}");
}

#[test]
fn names_are_short_and_those_of_built_in_presets_are_theirs() {
    assert_eq!(checked_name("  12 weeks "), Ok("12 weeks".into()));
    for wrong in ["", "  ", "bone", "BONE", "a\tb", &"x".repeat(MAX_NAME + 1)] {
        assert!(checked_name(wrong).is_err(), "{wrong:?}");
    }
}
