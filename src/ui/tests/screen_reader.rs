//! What a screen reader gets: the tree of the panels, with a name for every control, and the way back by its actions and by the keyboard. No
//! screen reader runs here.

use super::shown::{SIZE, Shown};
use super::*;
use crate::command::{InspectorTab, Viewpoint};
use crate::input::Key;
use crate::panels::accesskit::{Action, ActionData, Node, NodeId, Role, Toggled};
use crate::panels::{self, Banner, Note, Reading};
use crate::scene::MeasureKind;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

impl Shown {
    pub(super) fn key(&mut self, key: Key, shift: bool) -> Vec<Command> {
        assert!(self.panels.key(key, Modifiers { shift, ..Modifiers::default() }), "{key:?} is not taken");
        let commands = self.lay_out();
        // The focus moves back with the layout that follows.
        [commands, self.lay_out()].concat()
    }

    /// The control of this role and name in the group of this name.
    pub(super) fn find(&self, group: &str, role: Role, name: &str) -> NodeId {
        let found = self.all(group, role, name);
        assert_eq!(found.len(), 1, "{role:?} {name:?} in {group:?}: {:?}", self.names(group));
        found[0]
    }

    /// The nodes of a group with this role and name.
    pub(super) fn all(&self, group: &str, role: Role, name: &str) -> Vec<NodeId> {
        self.groups().remove(group).into_iter().flatten().filter(|id| is_named(&self.tree[id], role, name)).collect()
    }

    fn names(&self, group: &str) -> Vec<String> {
        let all = self.groups();
        all.get(group).into_iter().flatten().map(|id| self.tree[id].label().unwrap_or_default().to_string()).collect()
    }

    /// The nodes below each node with a role for groups and a name, as far as the next such node.
    fn groups(&self) -> BTreeMap<String, Vec<NodeId>> {
        let mut groups = BTreeMap::new();
        let children: BTreeSet<_> = self.tree.values().flat_map(|node| node.children().iter().copied()).collect();
        let root = *self.tree.keys().find(|id| !children.contains(id)).expect("a root");
        self.walk(root, "", &mut groups);
        let reached: usize = groups.values().map(Vec::len).sum();
        assert_eq!(reached + 1, self.tree.len(), "some nodes are below none, or below several");
        groups
    }

    fn walk(&self, from: NodeId, group: &str, groups: &mut BTreeMap<String, Vec<NodeId>>) {
        let node = &self.tree[&from];
        let is_group = matches!(
            node.role(),
            Role::Group
                | Role::Toolbar
                | Role::TabList
                | Role::List
                | Role::Dialog
                | Role::AlertDialog
                | Role::Alert
                | Role::Status
        );
        let own = node.label().filter(|_| is_group).map_or(group.to_string(), str::to_string);
        for child in node.children() {
            groups.entry(own.clone()).or_default().push(*child);
            self.walk(*child, &own, groups);
        }
    }

    /// Every control has a name and a role, of which no two of a group share both, and a tooltip that says more than the name.
    pub(super) fn check(&self, what: &str) {
        for (group, members) in self.groups() {
            let mut seen = BTreeSet::new();
            for id in members {
                let node = &self.tree[&id];
                if !is_control(node) {
                    continue;
                }
                let name = node.label().unwrap_or_default();
                assert!(!name.trim().is_empty(), "{what}: a control without a name in {group:?}: {node:?}");
                assert!(
                    matches!(node.role(), Role::Button | Role::Slider | Role::Switch | Role::Tab),
                    "{what}: {name:?} is a {:?}",
                    node.role()
                );
                let about = node.description().unwrap_or_default();
                assert!(about.len() > 8 && about != name, "{what}: {name:?} in {group:?} has no tooltip: {about:?}");
                assert!(seen.insert(name.to_string()), "{what}: two controls {name:?} in {group:?}");
            }
        }
    }
}

/// True for what can be pressed, set or given the keyboard. A scroll bar is for the pointer alone: a control that gets the keyboard is scrolled to.
fn is_control(node: &Node) -> bool {
    node.role() != Role::ScrollBar
        && [Action::Click, Action::Focus, Action::SetValue].into_iter().any(|action| node.supports_action(action))
}

fn is_named(node: &Node, role: Role, name: &str) -> bool {
    node.role() == role && node.label() == Some(name)
}

/// Prevents a control that a screen reader calls "button" and nothing else, or two that sound the same.
#[test]
fn every_control_has_a_name_of_its_own_and_a_tooltip_in_every_mode_and_list() {
    for mode in Mode::ALL {
        for layout in [Layout::Single, Layout::Four, Layout::Beside, Layout::Pair] {
            let mut shown = Shown::new("");
            shown.apply(Command::Mode(mode));
            shown.apply(Command::Layout(layout));
            for tab in [InspectorTab::Look, InspectorTab::Planes, InspectorTab::Measure, InspectorTab::Marks] {
                shown.tab(tab);
                shown.check(&format!("{mode:?} {layout:?} {tab:?}"));
            }
        }
    }
    let mut shown = Shown::new("mode='plane'");
    shown.apply(Command::Tool(Tool::Measure(MeasureKind::Distance)));
    for point in [[0.0, 30.0, 0.0], [0.0, 40.0, 0.0], [0.0, 50.0, 0.0], [5.0, 60.0, 0.0]] {
        shown.apply(Command::Point(point, false));
    }
    shown.check("measurements");
    let measured = shown.names("Measurements");
    for name in [
        "1 Caliper 10.0 mm",
        "Delete measurement 1",
        "2 Caliper 11.2 mm",
        "Delete measurement 2",
        "Copy",
        "Save",
        "Clear",
    ] {
        assert!(measured.iter().any(|found| found == name), "{name}: {measured:?}");
    }
    assert!(shown.groups().contains_key("Click the first end."), "the next step is read");
}

/// The same of what tools add to the column, and of what is folded.
#[test]
fn what_tools_add_and_what_is_folded_has_names_and_tooltips() {
    for tool in [Tool::Clip, Tool::Cut, Tool::Brush, Tool::Region, Tool::Curve] {
        let mut shown = Shown::new("mode='surface'\nlayout='four'");
        for command in [Command::Tool(tool), Command::MoveClip(5.0), Command::ToggleStartCurve] {
            shown.apply(command);
        }
        shown.check(&format!("{tool:?}"));
    }
    for mode in ["surface", "volume", "mixed", "orthogonal", "tomography", "cube"] {
        let mut shown = Shown::new(&format!("mode='{mode}'"));
        let is_folded = |node: &&Node| node.is_expanded() == Some(false);
        while let Some(name) = shown.tree.values().find(is_folded).and_then(|node| node.label()).map(str::to_string) {
            let header = shown.find("Look", Role::Button, &name);
            shown.ask(header, Action::Click, None);
            shown.settle();
        }
        assert!(shown.names("Filters").len() > 1, "{mode}");
        shown.check(&format!("{mode}, all unfolded"));
        shown.tab(InspectorTab::Marks);
        assert!(shown.names("Sides").len() > 1, "{mode}");
        shown.check(&format!("{mode}, the sides"));
    }
}

/// Prevents a tool or a control in front that cannot be found by what it is called.
#[test]
fn the_tools_and_the_controls_in_front_are_found_by_role_and_name() {
    let mut shown = Shown::new("mode='surface'");
    for (group, names) in [
        ("Rendering", &["Surface", "Volume", "Mixed", "Cube", "MIP", "MinIP", "X-ray"][..]),
        ("View", &["3D", "VR | SR", "4-up", "3 planes", "Plane", "Slices"]),
        ("View from", &["Front", "Left", "Right", "Top"]),
        ("Tools", &["Turn", "Light", "Region", "Clip", "Cut", "Brush", "Crosshair", "Curve"]),
        ("Tools", &["Distance", "Area", "Angle", "Contours", "Text", "Body"]),
        ("Files, views and search", &["Open", "Save workspace", "Undo", "Redo", "Find a command", "Help"]),
        ("Quick looks", &["Face", "Skeleton", "Presets"]),
        ("Cine loop", &["Freeze", "Previous volume", "Play", "Next volume", "Export", "Save loop", "Save picture"]),
    ] {
        names.iter().for_each(|name| _ = shown.find(group, Role::Button, name));
    }
    let chosen = &shown.tree[&shown.find("Rendering", Role::Button, "Surface")];
    assert_eq!(chosen.toggled(), Some(Toggled::True));
    assert_eq!(shown.tree[&shown.find("Rendering", Role::Button, "Volume")].toggled(), Some(Toggled::False));
    assert_eq!(shown.tree[&shown.find("View", Role::Button, "3D")].toggled(), Some(Toggled::True));
    assert!(shown.tree[&shown.find("Files, views and search", Role::Button, "Redo")].is_disabled());
    for name in ["Threshold", "Gain", "Smooth", "Brightness", "Lamp", "Depth"] {
        let knob = &shown.tree[&shown.find("Controls", Role::Slider, name)];
        let [low, high] = [knob.min_numeric_value(), knob.max_numeric_value()].map(|n| n.expect("a range"));
        let value = knob.numeric_value().expect("a value");
        assert!(low < high && (low..=high).contains(&value), "{name}: {value} of {low}..{high}");
        assert!(knob.value().is_some_and(|shown| !shown.is_empty()), "{name} has no value in words");
        assert!(knob.description().is_some_and(|about| about.len() > 10), "{name} is not explained");
    }
    let unit = shown.tree[&shown.find("Controls", Role::Slider, "Depth")].value().map(str::to_string);
    assert!(unit.as_ref().is_some_and(|value| value.ends_with(" mm")), "{unit:?}");
    shown.find("Controls", Role::Switch, "Cast shadows");
    let advanced = &shown.tree[&shown.find("Look", Role::Button, "Advanced: Filters")];
    assert_eq!(advanced.is_expanded(), Some(false));
    shown.tab(InspectorTab::Measure);
    for name in ["Caliper", "Tape", "Angle", "Ellipse", "Trace", "Contours", "Automatic volume"] {
        shown.find("Measure", Role::Button, name);
    }
    shown.tab(InspectorTab::Marks);
    for name in ["Text", "Arrow", "Body mark"] {
        shown.find("Marks", Role::Button, name);
    }
    shown.find("Marks", Role::Switch, "Bar on saved pictures");
}

#[test]
fn the_picture_is_described() {
    let mut shown = Shown::new("mode='surface'");
    shown.apply(Command::LookFrom(Viewpoint::Front));
    let picture = |shown: &Shown| {
        let images = shown.tree.values().filter(|node| node.role() == Role::Image);
        let mut images = images.filter(|node| node.label() != Some("Light ball"));
        let (image, more) = (images.next().expect("the picture"), images.next());
        assert!(more.is_none(), "{more:?}");
        let bounds = image.bounds().expect("its place");
        let ([x, y], [width, height]) = panels::picture_area(SIZE, 1.0, true);
        assert_eq!([bounds.x0, bounds.y0, bounds.x1, bounds.y1], [x, y, x + width, y + height].map(f64::from));
        [image.label(), image.description()].map(|text| text.unwrap_or_default().to_string())
    };
    assert_eq!(picture(&shown)[0], "Surface from the front, live, Demo data (phantom)");
    for (seconds, said) in [(7, "Ended 7 s"), (119, "Ended 1 min"), (7200, "Ended 2 h")] {
        shown.timeliness.ended = Some(Duration::from_secs(seconds));
        shown.settle();
        assert_eq!(picture(&shown)[0], "Surface from the front, the source has ended, Demo data (phantom)");
        shown.find("Cine loop", Role::Button, said);
    }
    shown.apply(Command::Rotate([30.0, 20.0]));
    shown.timeliness.is_frozen = true;
    shown.apply(Command::Layout(Layout::Four));
    let [name, about] = picture(&shown);
    assert!(name.starts_with("Surface with three planes, turned to azimuth") && name.contains(", frozen,"), "{name}");
    assert_eq!(about, "Volume 3 of 20. 0 measurements.");
    shown.apply(Command::Plane(PlaneName::B));
    shown.apply(Command::Mode(Mode::Plane));
    assert_eq!(picture(&shown)[0], "Plane, plane B, frozen, Demo data (phantom)");
}

#[test]
fn messages_are_read_when_they_appear_and_faults_at_once() {
    use panels::accesskit::Live;
    let mut shown = Shown::new("");
    shown.banner = Some(Banner { title: "No probe".into(), text: "Connection refused".into(), is_fault: true });
    shown.notes = vec![Note { text: "Saved a.png".into(), is_fault: false }];
    shown.lay_out();
    let live = |name: &str| shown.tree.values().find(|node| node.label() == Some(name)).map(|n| (n.role(), n.live()));
    assert_eq!(live("No probe. Connection refused"), Some((Role::Alert, Some(Live::Assertive))));
    assert_eq!(live("Saved a.png"), Some((Role::Status, Some(Live::Polite))));
    shown.check("messages");
}

/// Prevents a screen reader that says every per cent, and one that cannot end the reading.
#[test]
fn what_is_being_read_is_announced_once_and_its_share_is_a_value() {
    use panels::accesskit::Live;
    let mut shown = Shown::new("");
    for (share, text, value) in [(None, "", None), (Some(0.25), "25 %", Some(25.0)), (Some(0.26), "26 %", Some(26.0))] {
        shown.reading = Some(Reading { name: "big.mha".into(), share, text: text.into() });
        shown.settle();
        shown.check("reading");
        let status = shown.tree.values().find(|node| node.label() == Some("Reading big.mha")).expect("a message");
        assert_eq!((status.role(), status.live()), (Role::Status, Some(Live::Polite)));
        let bar = shown.tree.values().find(|node| node.role() == Role::ProgressIndicator).expect("a bar");
        assert_eq!((bar.numeric_value(), bar.label()), (value, Some("Read so far")), "{bar:?}");
        assert!(text.is_empty() || bar.value() == Some(text));
    }
    let cancel = shown.find("Reading big.mha", Role::Button, "Cancel");
    assert_eq!(shown.ask(cancel, Action::Click, None), [Command::CancelReading]);
}

/// Prevents a list or a question that a screen reader cannot answer, and one that reaches what is behind the question.
#[test]
fn lists_and_questions_are_answered_by_a_screen_reader() {
    let mut shown = Shown::new("");
    shown.files = Some(("/data".into(), vec!["..  (the folder above)".into(), "a.mha".into(), "b.toml".into()]));
    shown.lay_out();
    shown.lay_out();
    shown.check("files");
    let file = shown.find("/data", Role::Button, "b.toml");
    assert_eq!(shown.ask(file, Action::Click, None), [Command::OpenFile(2)]);
    shown.files = None;
    shown.recordings = ["a.mha", "b.mha", "1/c.mha"].map(String::from).to_vec();
    shown.settle();
    shown.check("recordings");
    for (name, command) in [
        ("1/c.mha", Command::ShowRecording(2)),
        ("Close a.mha", Command::CloseRecording(0)),
        ("Close b.mha", Command::CloseRecording(1)),
    ] {
        let button = shown.find("Recordings", Role::Button, name);
        let about = shown.tree[&button].description().unwrap_or_default().to_string();
        assert!(about.contains("Ctrl+"), "{name} is not explained: {about}");
        assert_eq!(shown.ask(button, Action::Click, None), [command], "{name}");
    }
    let state = |shown: &Shown, name: &str| shown.tree[&shown.find("Recordings", Role::Button, name)].toggled();
    assert_eq!([state(&shown, "a.mha"), state(&shown, "b.mha")], [Some(Toggled::False), Some(Toggled::True)]);
    for (n, what) in ["help", "times", "exports"].into_iter().enumerate() {
        shown.open(n);
        shown.lay_out();
        shown.lay_out();
        shown.check(what);
    }
    shown.close();
    shown.presets = Some((vec!["Profile".into(), "12 weeks".into()], None));
    shown.settle();
    shown.check("presets");
    for (name, command) in [
        ("Glass", Command::Preset(2)),
        ("12 weeks", Command::Preset(7)),
        ("Rename 12 weeks", Command::RenamePreset(1)),
        ("Delete Profile", Command::DeletePreset(0)),
    ] {
        let button = shown.find("Looks", Role::Button, name);
        assert_eq!(shown.ask(button, Action::Click, None), [command], "{name}");
    }
    let undo = shown.find("Presets", Role::Button, "Undo");
    assert_eq!(shown.ask(undo, Action::Click, None), [Command::RestorePresets]);
    shown.presets = Some((Vec::new(), Some("Pro".into())));
    shown.settle();
    shown.check("a name");
    let keep = shown.find("Presets", Role::Button, "Keep");
    assert_eq!(shown.ask(keep, Action::Click, None), [Command::EndNaming]);
    shown.presets = None;
    shown.open(2);
    shown.settle();
    let cancel = shown.find("Export", Role::Button, "Cancel the export");
    assert_eq!(shown.ask(cancel, Action::Click, None), [Command::CancelExport]);
    shown.open(3);
    shown.lay_out();
    shown.lay_out();
    shown.check("the question");
    let behind = shown.find("Cine loop", Role::Button, "Save loop");
    assert_eq!(shown.ask(behind, Action::Click, None), [], "nothing behind it reacts");
    let leave = shown.find("The loop is not saved", Role::Button, "Leave without saving  (L)");
    assert_eq!(shown.ask(leave, Action::Click, None), [Command::Discard]);
}

#[test]
fn a_screen_reader_sets_a_slider_and_presses_buttons() {
    let mut shown = Shown::new("mode='surface'");
    let gain = shown.find("Controls", Role::Slider, "Gain");
    let before = SLIDERS[GAIN].get(shown.controls.settings());
    let asked = shown.ask(gain, Action::SetValue, Some(ActionData::NumericValue(0.2)));
    assert!(matches!(asked[..], [Command::SetSlider(GAIN, _)]), "{asked:?}");
    let set = SLIDERS[GAIN].get(shown.controls.settings());
    assert!((set - 0.2).abs() < 1e-9 && set != before, "{before} {set}");
    assert_eq!(shown.tree[&gain].numeric_value(), Some(set));
    shown.ask(gain, Action::Increment, None);
    assert!((SLIDERS[GAIN].get(shown.controls.settings()) - set - SLIDERS[GAIN].step).abs() < 1e-9);
    shown.ask(gain, Action::SetValue, Some(ActionData::NumericValue(1e9)));
    assert_eq!(SLIDERS[GAIN].get(shown.controls.settings()), SLIDERS[GAIN].range[1], "beyond its range");
    // A button does what a click with the pointer does.
    let volume = shown.find("Rendering", Role::Button, "Volume");
    let asked = shown.ask(volume, Action::Click, None);
    assert_eq!(asked, [Command::Mode(Mode::Volume)]);
    let mut clicked = Shown::new("mode='surface'");
    let bounds = clicked.tree[&volume].bounds().expect("its place");
    let at = [(bounds.x0 + bounds.x1) / 2.0, (bounds.y0 + bounds.y1) / 2.0];
    let commands: Vec<Command> = [
        Input::Moved(at),
        Input::Button { button: Button::Left, pressed: true },
        Input::Button { button: Button::Left, pressed: false },
    ]
    .iter()
    .flat_map(|input| {
        clicked.panels.input(input);
        clicked.lay_out()
    })
    .collect();
    assert_eq!(commands, asked);
    // A switch.
    shown.tab(InspectorTab::Marks);
    let bar = shown.find("Marks", Role::Switch, "Bar on saved pictures");
    assert_eq!(shown.tree[&bar].toggled(), Some(Toggled::False));
    assert_eq!(shown.ask(bar, Action::Click, None), [Command::SavesBar(true)]);
    // What is switched off does nothing.
    let redo = shown.find("Files, views and search", Role::Button, "Redo");
    assert_eq!(shown.ask(redo, Action::Click, None), []);
}

/// Requirement: each control is reached by Tab alone, in the order of the screen, and is marked while it has the keyboard.
#[test]
fn tab_reaches_every_control_and_marks_it() {
    let mut shown = Shown::new("mode='surface'");
    shown.recordings = ["a.mha", "b.mha"].map(String::from).to_vec();
    shown.reading = Some(Reading { name: "c.mha".into(), share: Some(0.5), text: "50 %".into() });
    shown.settle();
    let last = shown.tab_reaches_all("surface");
    // Back, and out.
    shown.key(Key::Tab, true);
    assert_eq!(shown.focus, Some(last));
    shown.key(Key::Escape, false);
    assert_eq!((shown.focus, shown.panels.has_focus()), (None, false));
    assert!(!shown.panels.key(Key::Space, Modifiers::default()), "the keys are those of the view again");
    let mut shown = Shown::new("mode='volume'\nlayout='four'");
    shown.apply(Command::Tool(Tool::Region));
    shown.apply(Command::ToggleStartCurve);
    shown.tab_reaches_all("4-up with the region");
    let mut shown = Shown::new("mode='plane'");
    shown.apply(Command::Tool(Tool::Measure(MeasureKind::Distance)));
    for n in 0..12 {
        shown.apply(Command::Point([0.0, 30.0 + f64::from(n), 0.0], false));
    }
    shown.tab_reaches_all("measurements");
    let mut shown = Shown::new("mode='surface'");
    shown.files = Some(("/data".into(), (0..20).map(|n| format!("recording-{n}.mha")).collect()));
    shown.settle();
    shown.tab_reaches_all("the files to open");
    shown.files = None;
    shown.open(2);
    shown.settle();
    shown.tab_reaches_all("the exports");
    shown.close();
    shown.inspector_does(&Command::Find);
    shown.tab_reaches_all("the search");
    shown.inspector_does(&Command::Find);
    shown.close();
    shown.presets = Some((vec!["Profile".into()], None));
    shown.settle();
    shown.tab_reaches_all("the presets");
    for (size, commands) in [
        ([800, 600], &[][..]),
        ([800, 600], &[Command::NextTab]),
        ([480, 400], &[Command::NextTab]),
        ([480, 400], &[Command::NextTab, Command::NextTab]),
    ] {
        let mut shown = Shown::sized("mode='surface'", size, 1.0);
        commands.iter().for_each(|command| shown.inspector_does(command));
        shown.tab_reaches_all(&format!("{size:?} {commands:?}"));
    }
}

impl Shown {
    /// The white corners at the edges of a control that are not among those of the `rest`.
    fn marks_of(&self, control: NodeId, rest: &[([f32; 2], [u8; 4])]) -> usize {
        let bounds = self.tree[&control].bounds().expect("its place");
        let [left, top, right, bottom] = [bounds.x0, bounds.y0, bounds.x1, bounds.y1].map(|n| n as f32);
        let is_at_edge = |[x, y]: [f32; 2]| {
            let out = (left - x).max(x - right).max(top - y).max(y - bottom);
            out.abs() < 5.0
        };
        let bright = self.corners.iter().filter(|corner| corner.1 == [255; 4] && is_at_edge(corner.0));
        bright.filter(|corner| !rest.contains(corner)).count()
    }

    fn is_in_sight(&self, control: NodeId) -> bool {
        let bounds = self.tree[&control].bounds();
        bounds.is_some_and(|b| b.y0 >= 0.0 && b.y1 <= f64::from(self.size[1]))
    }

    /// Goes by Tab from control to control, and returns the last one.
    fn tab_reaches_all(&mut self, what: &str) -> NodeId {
        let controls: BTreeSet<NodeId> =
            self.tree.iter().filter(|(_, node)| is_control(node) && !node.is_disabled()).map(|(id, _)| *id).collect();
        assert!(controls.len() > 20, "{what}: {}", controls.len());
        self.panels.drop_focus();
        self.settle();
        assert!(
            !self.panels.key(Key::Tab, Modifiers::default()),
            "Tab belongs to the view until a control has the keyboard"
        );
        // Marks are white.
        let rest: Vec<_> = self.corners.iter().filter(|corner| corner.1 == [255; 4]).copied().collect();
        self.panels.toggle_focus();
        assert!(self.panels.has_focus());
        self.lay_out();
        let mut reached = Vec::new();
        for _ in 0..controls.len() {
            let focus = self.focus.unwrap_or_else(|| panic!("{what}: no control has the keyboard after {reached:?}"));
            assert!(controls.contains(&focus), "{what}: {:?} takes the keyboard", self.tree[&focus]);
            if reached.contains(&focus) {
                break;
            }
            let name = self.tree[&focus].label().unwrap_or_default().to_string();
            // A panel scrolls to it, and its mark fades in: most controls are in sight and marked already, and laying out is most of this test.
            for _ in 0..10 {
                if self.marks_of(focus, &rest) >= 8 && self.is_in_sight(focus) {
                    break;
                }
                self.settle();
            }
            let new = self.marks_of(focus, &rest);
            let bounds = self.tree[&focus].bounds();
            assert!(new >= 8, "{what}: {name} is not marked: {new} corners at {bounds:?}");
            assert!(self.is_in_sight(focus), "{what}: {name} is out of sight: {bounds:?}");
            reached.push(focus);
            self.key(Key::Tab, false);
        }
        let missed: Vec<_> = controls.iter().filter(|id| !reached.contains(id)).map(|id| &self.tree[id]).collect();
        assert!(missed.is_empty(), "{what}: not reached: {missed:?}");
        *reached.last().expect("a control")
    }

    /// Walks through the list that is open, and returns the name of the entry that has the keyboard then.
    fn walked(&mut self, keys: &[Key], is_grid: bool) -> String {
        for key in keys {
            assert!(self.panels.walk(*key, Modifiers::default(), is_grid), "{key:?}");
        }
        // One key a layout, and a scroll to the entry.
        (0..keys.len() + 8).for_each(|_| _ = self.lay_out());
        let focus = self.focus.unwrap_or_else(|| panic!("no entry has the keyboard after {keys:?}"));
        let bounds = self.tree[&focus].bounds().expect("its place");
        assert!(bounds.y0 >= 0.0 && bounds.y1 <= f64::from(SIZE[1]), "{bounds:?} is out of sight");
        self.tree[&focus].label().unwrap_or_default().to_string()
    }
}

/// Prevents entries from the tenth on that need a Tab for each control before them.
#[test]
fn arrows_walk_through_lists_and_enter_chooses() {
    use Key::{Down, End, Home, PageDown, PageUp, Right, Up};
    let mut shown = Shown::new("mode='surface'");
    shown.files = Some(("/data".into(), (0..30).map(|n| format!("{n}.mha")).collect()));
    shown.settle();
    assert_eq!(shown.walked(&[Down], false), "0.mha");
    assert_eq!(shown.walked(&[Down], false), "1.mha");
    assert_eq!(shown.walked(&[PageDown], false), "11.mha");
    assert_eq!(shown.walked(&[Down, Down, Up], false), "12.mha", "keys that come faster than pictures");
    assert_eq!(shown.walked(&[PageUp, PageUp], false), "0.mha");
    assert_eq!(shown.walked(&[Up], false), "0.mha");
    assert_eq!(shown.walked(&[End], false), "29.mha");
    assert_eq!(shown.walked(&[Down], false), "29.mha");
    assert!(!shown.panels.walk(Key::Right, Modifiers::default(), false), "there is nothing beside it");
    assert_eq!(shown.key(Key::Enter, false), [Command::OpenFile(29)]);
    assert_eq!(shown.walked(&[Home], false), "0.mha");
    shown.key(Key::Tab, false);
    assert_eq!(shown.tree[&shown.focus.expect("the next one")].label(), Some("1.mha"), "Tab goes on from there");
    shown.files = None;
    shown.open(2);
    shown.settle();
    let names: Vec<&str> = crate::volume_export::FORMATS.iter().map(|format| format.name).collect();
    assert_eq!(shown.walked(&[End], false), names[names.len() - 1]);
    // Enter follows at once.
    for key in [Home, Down] {
        assert!(shown.panels.walk(key, Modifiers::default(), false));
    }
    assert!(shown.panels.key(Key::Enter, Modifiers::default()));
    let commands: Vec<Command> = (0..4).flat_map(|_| shown.lay_out()).collect();
    assert_eq!(commands, [Command::Export(1)]);
    shown.close();
    shown.presets = Some(((0..8).map(|n| format!("Own {n}")).collect(), None));
    shown.settle();
    assert_eq!(shown.walked(&[Down], true), "Face");
    assert_eq!(shown.walked(&[Right], true), "Skeleton");
    assert_eq!(shown.walked(&[Down], true), "Bone", "three stand beside each other");
    assert_eq!(shown.walked(&[End], true), "Own 7");
    assert_eq!(shown.key(Key::Enter, false), [Command::Preset(13)]);
    shown.panels.drop_focus();
    assert!(!shown.panels.has_focus(), "a name has the keys");
}

/// Prevents tabs and a drawer that do not say what they show.
#[test]
fn tabs_and_drawer_say_what_they_show() {
    const NAMES: [&str; 5] = ["Tools", "Look", "Planes", "Measure", "Marks"];
    let selected = |shown: &Shown, names: &[&str]| {
        let names = names.iter().map(|name| shown.tree[&shown.find("Inspector", Role::Tab, name)].is_selected());
        names.map(|is_selected| is_selected.expect("a tab")).collect::<Vec<bool>>()
    };
    let mut shown = Shown::new("mode='surface'");
    assert_eq!(selected(&shown, &NAMES[1..]), [true, false, false, false]);
    assert!(!shown.names("Inspector").contains(&"Tools".to_string()), "they are in the rail");
    let measure = shown.find("Inspector", Role::Tab, "Measure");
    assert_eq!(shown.ask(measure, Action::Click, None), [Command::InspectorTab(InspectorTab::Measure)]);
    shown.settle();
    assert_eq!(selected(&shown, &NAMES[1..]), [false, false, true, false]);
    // A tool brings the part with its options.
    shown.apply(Command::Tool(Tool::Curve));
    assert_eq!(selected(&shown, &NAMES[1..]), [false, true, false, false]);
    // In a small window it is a drawer, with tools and views too.
    let mut shown = Shown::sized("mode='surface'", [480, 400], 1.0);
    let drawer = shown.find("Cine loop", Role::Button, "Inspector");
    assert_eq!(shown.tree[&drawer].is_expanded(), Some(false));
    assert_eq!(shown.ask(drawer, Action::Click, None), [Command::ToggleDrawer]);
    shown.settle();
    shown.check("the drawer");
    assert_eq!(shown.tree[&drawer].is_expanded(), Some(true));
    shown.tab(InspectorTab::Tools);
    shown.check("the tools");
    assert_eq!(selected(&shown, &NAMES), [true, false, false, false, false]);
    shown.find("Tools", Role::Button, "Distance");
    shown.find("View", Role::Button, "4-up");
    for (tab, name) in [(true, "Look"), (true, "Planes"), (true, "Measure"), (true, "Marks"), (false, "")] {
        shown.inspector_does(&Command::NextTab);
        assert_eq!(shown.visible.inspector.is_open, tab, "{name}");
        assert!(!tab || selected(&shown, &[name]) == [true], "{name}");
    }
}

/// Prevents a search whose results no screen reader can choose.
#[test]
fn the_search_is_read_and_its_results_are_pressed() {
    let mut shown = Shown::new("mode='surface'");
    shown.inspector_does(&Command::Find);
    for letter in "save the pic".chars() {
        let key = if letter == ' ' { Key::Space } else { Key::Char(letter) };
        assert_eq!(shown.visible.key(key, Modifiers::default()), Some(Vec::new()));
    }
    shown.settle();
    shown.check("the search");
    let found = shown.find("Found", Role::Button, "Save the picture Ctrl+I");
    assert_eq!(shown.ask(found, Action::Click, None), [Command::Find, Command::SavePicture]);
}

/// Requirement: what the search finds among the controls is shown and has the keyboard, also where it is folded or in another part.
#[test]
fn a_control_that_is_searched_for_is_shown_and_has_the_keyboard() {
    for mode in ["surface", "volume", "tomography"] {
        let mut shown = Shown::new(&format!("mode='{mode}'"));
        for number in 0..SLIDERS.len() {
            let slider = &SLIDERS[number];
            if !slider.applies(shown.controls.settings()) {
                continue;
            }
            shown.panels.drop_focus();
            shown.inspector_does(&Command::ShowControl(number));
            (0..3).for_each(|_| shown.settle());
            let focus = shown.focus.unwrap_or_else(|| panic!("{mode}: {} has not the keyboard", slider.key));
            assert!(shown.is_in_sight(focus), "{mode}: {}", slider.key);
            assert!(matches!(shown.tree[&focus].role(), Role::Slider | Role::Switch), "{mode}: {}", slider.key);
        }
    }
}

#[test]
fn the_keyboard_moves_a_slider_and_presses_a_button() {
    let mut shown = Shown::new("mode='surface'");
    let gain = shown.find("Controls", Role::Slider, "Gain");
    shown.ask(gain, Action::Focus, None);
    assert_eq!(shown.focus, Some(gain));
    let before = SLIDERS[GAIN].get(shown.controls.settings());
    assert!(matches!(shown.key(Key::Right, false)[..], [Command::SetSlider(GAIN, _)]));
    let after = SLIDERS[GAIN].get(shown.controls.settings());
    assert!((after - before - SLIDERS[GAIN].step).abs() < 1e-9, "{before} {after}");
    assert_eq!(shown.focus, Some(gain), "the arrow is the slider's");
    let freeze = shown.find("Cine loop", Role::Button, "Freeze");
    shown.ask(freeze, Action::Focus, None);
    for key in [Key::Space, Key::Enter] {
        assert_eq!(shown.key(key, false), [Command::Freeze], "{key:?}");
    }
}
