//! Labels: what the brush paints has as many voxels as number theory says, undo takes it back among other changes, and keeps a bounded memory.

use super::*;
use crate::command::{Effect, LabelCommand};
use crate::labelling::Labelling;
use crate::probe::World;
use crate::segment::{Labels, files};
use glam::{DAffine3, DQuat};

/// Points of the integer lattice within a circle (OEIS A000328) and within a ball (A000605) around one of them, by radius.
const IN_CIRCLE: [usize; 7] = [1, 5, 13, 29, 49, 81, 113];
const IN_BALL: [usize; 7] = [1, 7, 33, 123, 257, 515, 925];
/// Edge of a voxel, mm.
const EDGE: f64 = 0.5;

fn lattice(edge: usize) -> Labels {
    let grid = Grid { size: [edge; 3], spacing: [EDGE; 3], origin: [-3.0, 40.0, 5.0] };
    Labels::new(grid, World::of(&grid)).unwrap()
}

/// Controls with empty labels on a lattice that lies anyhow in space, and the place of one of its voxels.
fn controls(edge: usize) -> (Controls, impl Fn([f64; 3]) -> DVec3, DAffine3) {
    let labels = lattice(edge);
    let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.6), DVec3::new(7.0, -2.0, 1.0));
    let to_space = turn * files::to_space(&labels, &Geometry::Cartesian(*labels.grid()), None);
    let mut controls = Controls::new(settings("", ""));
    controls.begin_labels(Labelling::new(labels, Vec::new(), to_space));
    (controls, move |index| to_space.transform_point3(index.into()), turn)
}

/// The number of voxels of a label.
fn count(controls: &Controls, label: u8) -> usize {
    let each = EDGE.powi(3) / 1000.0;
    let of_label = |(segment, volume): (&crate::source::segmentation::Segment, f64)| {
        (segment.label == label).then_some((volume / each).round() as usize)
    };
    controls.labelling().unwrap().volumes().find_map(of_label).unwrap()
}

/// Paints or erases a stroke as a step of its own.
fn stroke(controls: &mut Controls, ends: [DVec3; 2], radius: f64, plane: Option<DVec3>, erases: bool) -> bool {
    controls.edit_labels(|labels| labels.paint(ends, (radius + 1e-3) * EDGE, plane, erases));
    controls.end_edit_of_labels()
}

fn labels(controls: &mut Controls, command: LabelCommand) -> Change {
    controls.apply(&Command::Labels(command), None)
}

#[test]
fn a_brush_paints_as_many_voxels_as_a_ball_a_disc_and_a_stroke_hold() {
    for radius in 0..IN_BALL.len() {
        let (mut controls, place, turn) = controls(32);
        let (from, to) = (place([15.0, 14.0, 16.0]), place([15.0, 14.0, 21.0]));
        let r = radius as f64;
        assert!(stroke(&mut controls, [from, from], r, None, false));
        assert_eq!(count(&controls, 1), IN_BALL[radius]);
        assert!(!stroke(&mut controls, [from, from], r, None, false), "nothing changed");
        // Each step of a stroke along an axis adds a disc.
        assert!(stroke(&mut controls, [from, to], r, None, false));
        assert_eq!(count(&controls, 1), IN_BALL[radius] + 5 * IN_CIRCLE[radius]);
        // On a plane that a disc was chosen for, one layer of voxels; beside planes a ball.
        labels(&mut controls, LabelCommand::Add);
        labels(&mut controls, LabelCommand::Ball(false));
        let far = place([15.0, 14.0, 7.0]);
        let normal = turn.transform_vector3(DVec3::Z);
        assert!(stroke(&mut controls, [far, far], r, Some(normal), false));
        assert_eq!(count(&controls, 2), IN_CIRCLE[radius]);
        // Label 2 over label 1; erased again, label 1 stays as it is.
        assert!(stroke(&mut controls, [from, from], r, None, false));
        assert_eq!(count(&controls, 1), 5 * IN_CIRCLE[radius]);
        assert!(stroke(&mut controls, [from, to], r, None, true));
        let kept = [count(&controls, 1), count(&controls, 2)];
        assert_eq!(kept, [5 * IN_CIRCLE[radius], IN_CIRCLE[radius]], "only the chosen label is erased");
    }
}

#[test]
fn edits_of_labels_are_undone_in_order_with_other_changes() {
    let (mut controls, place, _) = controls(32);
    let (fan, middle) = (Geometry::Sweep(wobbler()), place([16.0; 3]));
    let scene = |controls: &Controls| scene(&fan, controls.settings());
    assert!(!controls.is_unsaved());
    assert!(stroke(&mut controls, [middle; 2], 3.0, None, false));
    let saved = controls.handiwork();
    assert!(controls.is_unsaved() && controls.settings().labels.volume.is_some());
    controls.saved(saved);
    assert!(!controls.is_unsaved());
    let before = scene(&controls);
    assert_eq!(controls.apply(&Command::Rotate([20.0, 0.0]), Some(&before)), Change::Settings);
    let turned = controls.settings().camera.clone();
    assert!(stroke(&mut controls, [middle; 2], 5.0, None, false) && controls.is_unsaved());
    assert!(stroke(&mut controls, [middle; 2], 9.0, None, true));
    assert!(controls.settings().labels.volume.is_none() && count(&controls, 1) == 0);
    let counts = [IN_BALL[5], IN_BALL[3], IN_BALL[3], 0];
    for (n, expected) in counts.into_iter().enumerate() {
        let now = scene(&controls);
        assert_eq!(controls.apply(&Command::Undo, Some(&now)), Change::Settings, "step {n}");
        assert_eq!(count(&controls, 1), expected, "step {n}");
        assert_eq!(controls.settings().labels.volume.is_some(), expected > 0);
        assert_eq!(controls.settings().camera == turned, n < 2, "step {n}");
    }
    assert_eq!(controls.can_undo(), [false, true]);
    for expected in [IN_BALL[3], IN_BALL[3], IN_BALL[5], 0] {
        let now = scene(&controls);
        assert_eq!(controls.apply(&Command::Redo, Some(&now)), Change::Settings);
        assert_eq!(count(&controls, 1), expected);
    }
    // A reset of the settings keeps the labels, as it keeps measurements.
    controls.apply(&Command::Undo, None);
    controls.reset();
    assert!(count(&controls, 1) == IN_BALL[5] && controls.settings().labels.volume.is_some());
    // A stroke that is not over is taken back as a whole.
    controls.edit_labels(|labels| labels.paint([place([4.0; 3]); 2], 1.01 * EDGE, None, false));
    controls.apply(&Command::Undo, None);
    assert_eq!(count(&controls, 1), IN_BALL[5]);
}

/// Each edit changes two opposite corners of the lattice, so that its box is all of it.
#[test]
fn the_memory_of_undone_labels_is_bounded_and_what_is_left_is_right() {
    let (mut controls, place, _) = controls(128);
    let corners = [place([0.0; 3]), place([127.0; 3])];
    for n in 0..40 {
        for at in corners {
            controls.edit_labels(|labels| labels.paint([at; 2], 0.1, None, n % 2 == 1));
        }
        assert!(controls.end_edit_of_labels());
    }
    let mut undone = 0;
    while controls.can_undo()[0] {
        assert_eq!(count(&controls, 1), if undone % 2 == 0 { 0 } else { 2 });
        assert_eq!(controls.apply(&Command::Undo, None), Change::Settings);
        undone += 1;
    }
    assert_eq!(undone, (64 << 20) / 128_usize.pow(3));
}

#[test]
fn a_press_paints_on_its_tile_or_on_the_surface_and_the_wheel_sets_the_brush() {
    use LabelCommand::{EndStroke, Stroke};
    let mut window = TestWindow::new("mode='surface'\nlayout='four'");
    window.tool(Tool::Labels);
    let middle =
        |tile: &crate::scene::planes::Tile| [0, 1].map(|a| f64::from(tile.corner[a]) + f64::from(tile.size[a]) / 2.0);
    let on_plane = middle(&window.scene().tiling().tiles[1]);
    let on_surface = super::super::picking::Picker::of(&window.scene()).centre();
    let of = |commands: Vec<Command>| -> Vec<LabelCommand> {
        let of_labels =
            |command| if let Command::Labels(of_labels) = command { of_labels } else { panic!("{command:?}") };
        commands.into_iter().map(of_labels).collect()
    };
    for (at, tile) in [(on_plane, Some(1)), (on_surface, None)] {
        assert_eq!(of(window.click(at)), [Stroke(at, tile, false), EndStroke]);
        assert_eq!(of(window.click(at)), [Stroke(at, tile, false), EndStroke], "no double click");
        window.held.control = true;
        assert_eq!(of(window.click(at)), [Stroke(at, tile, true), EndStroke]);
        window.held = Modifiers::default();
        window.input(Input::Button { button: Button::Left, pressed: true });
        let first = of(window.input(Input::Moved(window.at([at[0] + 10.0, at[1]]))));
        assert_eq!(first, [Stroke(at, tile, false)], "from where it was pressed");
        let to = [at[0] + 14.0, at[1]];
        assert_eq!(of(window.input(Input::Moved(window.at(to)))), [Stroke(to, tile, false)]);
        // The window loses the focus.
        assert_eq!(of(window.input(Input::FocusLost)), [EndStroke]);
        window.input(Input::Moved(window.at(at)));
        let before = window.controls.brush_radius();
        window.held.shift = true;
        window.input(Input::Scroll(2.0));
        assert!((window.controls.brush_radius() / before - 1.21).abs() < 1e-9);
        window.held.shift = false;
    }
    let effect = LabelCommand::Effect(Effect::Erase);
    assert_eq!(labels(&mut window.controls, effect), Change::Refused(crate::texts::NO_LABELS_YET));
}

/// Prevents a label that cannot be told apart from another one, and labels of a file that cannot be chosen.
#[test]
fn labels_of_a_file_are_all_there_and_there_are_at_most_255() {
    let mut of_file = lattice(8);
    of_file.set(&[5, 6], 3);
    of_file.set(&[7], 9);
    let named = files::segment(3, "cyst".into());
    let mut labelling = Labelling::new(of_file, vec![named], DAffine3::IDENTITY);
    let there = |labelling: &Labelling| -> Vec<(String, f64)> {
        labelling.volumes().map(|(segment, volume)| (segment.name.to_string(), 1000.0 * volume)).collect()
    };
    assert_eq!(there(&labelling), [("cyst".into(), 2.0), ("Label 9".into(), 1.0)]);
    assert_eq!(labelling.chosen, 3);
    assert!(labelling.take_shown().is_none());
    for n in 0..253 {
        assert!(labelling.add(), "{n}");
    }
    assert!(!labelling.add() && labelling.volumes().count() == 255 && labelling.chosen == 255);
}
