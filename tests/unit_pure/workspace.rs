//! Workspaces: what is saved is read again exactly, and what is no workspace is refused.

use crate::common::files::Folder;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Brush, Cut, CutView, KeptSide, Made, MeasureKind, Measurement, Mode};
use echolume::low_level::workspace::{Origin, Workspace, is_workspace, text};
use std::path::{Path, PathBuf};

fn kept(name: &str, text: &str) -> (Folder, PathBuf) {
    let folder = Folder::new(name);
    let file = PathBuf::from(folder.path("work.toml"));
    std::fs::write(&file, text).expect("write");
    (folder, file)
}

#[test]
fn what_is_saved_is_read_again_exactly() {
    for preset in ["", "face", "bone", "bmode"] {
        let mut layers = Layers::default();
        if !preset.is_empty() {
            layers.preset(preset).expect("preset");
        }
        layers.set("clip=[{ at = [0.1, 1e-9, 3], normal = [0, 1, 0] }]").expect("clip");
        let mut settings = layers.finish().expect("settings");
        settings.set_mode(Mode::Plane);
        settings.drawn.measure = vec![
            Measurement { points: vec![[0.1, 1.0 / 3.0, -2e-7], [1.0, 2.0, 3.0]], ..Measurement::default() },
            Measurement {
                kind: MeasureKind::Volume,
                contours: vec![vec![[0.0; 3], [1.0; 3], [2.0, 0.0, 0.1]]; 2],
                text: "a \"b\" = [c]\\".into(),
                made: Some(Made {
                    volume: 7,
                    time: Some(1.0 / 3.0),
                    plane: "A, \"x\"".into(),
                    settings: "Plane 0".into(),
                }),
                ..Measurement::default()
            },
        ];
        let view = CutView { at: [0.1, 1e-9, -3.0], eye: Some(1.0 / 3.0), ..CutView::default() };
        let contour = vec![[0.0, 1.0 / 3.0], [1e-9, 2.0], [-3.0, 4.0]];
        settings.cuts = vec![
            Cut { contour: contour.clone(), view, keep: KeptSide::Inside, depth: Some(0.1), brush: None },
            Cut { contour, ..Cut::default() },
            Cut {
                brush: Some(Brush { radius: 0.3, strokes: vec![vec![[0.1, 1.0 / 3.0, -2.0]; 2]] }),
                ..Cut::default()
            },
        ];
        settings.region.start_curve = Some(vec![[-9.0, 1.0 / 3.0], [1e-9, 20.0], [0.1, 1e-9]]);
        let mut origin = Origin::of(Some("sweep.mha".into()));
        origin.volume = 3;
        let (folder, file) = kept("workspace-exact", &text(&settings, &origin).expect("text"));
        let read = Workspace::read(&file).expect("a workspace");
        // Older workspaces do not say of which volume a measurement is: of the one that was shown.
        settings.drawn.measure[0].made = Some(Made { volume: 3, ..Made::default() });
        assert_eq!(read.layers.clone().finish().expect("settings"), settings, "{preset}");
        assert_eq!(read.recording(&file).expect("a recording"), PathBuf::from(folder.path("sweep.mha")));
        assert!(read.origin.volume == 3 && is_workspace(&file));
    }
}

#[test]
fn a_wrong_file_is_refused_in_one_line_that_names_it() {
    for (text, part) in [
        ("mode = 'plane'\n", "--scene"),
        ("[workspace]\nversion = 2\n", "version 2"),
        ("[workspace]\nversion = 1\ncolour = 3\n", "colour"),
        ("mode = 'plan'\n[workspace]\nversion = 1\n", "plan"),
        ("[workspace]\nversion = 1\n[[measure]]\nkind = 'distance'\n", "entry 1"),
        (
            "[workspace]\nversion = 1\n[[cuts]]\ncontour = [[0, 0], [1, 0]]\n[cuts.view]\nat = [0, 0, 0]\ndirection = [0, 1, 0]\nup = [0, 0, 1]\n",
            "entry 1: has 2 corners",
        ),
        ("[workspace]\nversion = 1\n[region]\nstart_curve = [[0, 1], [2, 3]]\n", "region.start_curve: has 2 points"),
        ("[workspace]\nversion = 1\n[planes]\nzom = 1\n", "zom"),
        ("\u{1}", "line 1"),
    ] {
        let (_folder, file) = kept("workspace-wrong", text);
        let fault = Workspace::read(&file).expect_err(text);
        assert!(fault.contains("work.toml") && fault.contains(part), "{text}: {fault}");
        assert!(fault.lines().count() == 1 && !fault.contains('\u{1}'), "{fault}");
    }
    let (_folder, file) = kept("workspace-live", "[workspace]\nversion = 1\n");
    let live = Workspace::read(&file).expect("a workspace");
    assert!(live.recording(&file).is_err_and(|why| why.contains("live")));
    assert!(Workspace::read(Path::new("/nowhere/at.toml")).is_err_and(|why| why.contains("/nowhere/at.toml")));
}
