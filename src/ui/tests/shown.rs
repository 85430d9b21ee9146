//! The panels around the phantom, as the console lays them out, without a console.

use super::*;
use crate::cine_player::{CinePlayer, CineState, Loop};
use crate::command::InspectorTab;
use crate::controls::EXAMS;
use crate::live::cine::CineVolume;
use crate::panels::accesskit::{Action, ActionData, ActionRequest, Node, NodeId, TreeId, TreeUpdate};
use crate::panels::drawn::Drawn;
use crate::panels::{
    self, Banner, FilesShown, Note, PanelOutput, PanelState, Panels, Pointers, PresetTile, PresetsShown, Reading, Room,
    SmallPictures, Timeliness, Visible,
};
use crate::passes::unveil::StartLine;
use crate::picture::Picture;
use crate::progress_lines::Progress;
use crate::recordings::Named;
use crate::scene::Cine;
use crate::shown_picture::ShownPicture;
use crate::source::phantom::{Phantom, PhantomOptions};
use crate::texts::{UNSAVED_LOOP, Unsaved};
use crate::times::Times;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// The usual window.
pub(super) const SIZE: [u32; 2] = [1280, 800];

pub(super) struct Shown {
    pub(super) panels: Panels,
    pub(super) size: [u32; 2],
    pub(super) controls: Controls,
    pub(super) scene: Scene,
    pub(super) times: Times,
    pub(super) budget: Option<Duration>,
    pub(super) time: f64,
    /// Shows the hints of the first start; shows nothing but what the picture is of.
    pub(super) shows: [bool; 2],
    pub(super) visible: Visible,
    pub(super) leaving: Option<&'static Unsaved>,
    pub(super) has_drawn: bool,
    /// The scene of the picture that is shown while another one is drawn; none: the present one's.
    pub(super) kept: Option<Scene>,
    pub(super) timeliness: Timeliness,
    pub(super) cine: CineState,
    pub(super) banner: Option<Banner>,
    pub(super) notes: Vec<Note>,
    /// The folder whose files are listed, and their names; the first is a recent one. And the path that is being typed, with its fault.
    pub(super) files: Option<(String, Vec<String>)>,
    pub(super) typed: Option<(String, Option<String>)>,
    /// Names of the recordings that are open; the second is shown.
    pub(super) recordings: Vec<String>,
    pub(super) reading: Option<Reading>,
    /// The names of the presets of the user, while the list of presets is shown; and the name that is being typed.
    pub(super) presets: Option<(Vec<String>, Option<String>)>,
    pub(super) start_lines: Vec<StartLine>,
    /// The volume that is compared with the shown one.
    pub(super) compared: Option<crate::comparison::Shown>,
    pub(super) pointers: Pointers,
    /// What the last layout said.
    pub(super) tree: BTreeMap<NodeId, Node>,
    pub(super) focus: Option<NodeId>,
    /// What the last layout drew: corners of triangles and their colours, and the same before it became triangles.
    pub(super) corners: Vec<([f32; 2], [u8; 4])>,
    pub(super) drawn: Vec<Drawn>,
}

impl Shown {
    pub(super) fn new(toml: &str) -> Shown {
        Shown::sized(toml, SIZE, 1.0)
    }

    /// In a window of this size, pixels, at a scale.
    pub(super) fn sized(toml: &str, size: [u32; 2], scale: f32) -> Shown {
        let phantom = Phantom::new(PhantomOptions::default()).expect("a phantom");
        let geometry = Geometry::Sweep(phantom.probe(0).clone());
        let mut controls = Controls::new(settings("fetal", toml));
        controls.resize(panels::picture_area(size, scale, true).1);
        let scene = scene(&geometry, &controls.settings().clone().without_drawings());
        let mut panels = Panels::new(scale);
        panels.describe(true);
        let mut shown = Shown {
            panels,
            size,
            controls,
            scene,
            times: Times::default(),
            budget: None,
            time: 0.0,
            shows: [false; 2],
            visible: Visible { panels: true, ..Visible::default() },
            leaving: None,
            has_drawn: true,
            kept: None,
            timeliness: Timeliness::default(),
            cine: CinePlayer::default().state(
                Loop { cine: &Cine::default(), volumes: &(0..20).map(|_| CineVolume::default()).collect() },
                Some(2),
            ),
            banner: None,
            notes: Vec::new(),
            files: None,
            typed: None,
            recordings: Vec::new(),
            reading: None,
            presets: None,
            start_lines: Vec::new(),
            pointers: Pointers::default(),
            compared: None,
            tree: BTreeMap::new(),
            focus: None,
            corners: Vec::new(),
            drawn: Vec::new(),
        };
        shown.settle();
        shown
    }

    /// Opens the n-th of help, times, exports and the question whether to leave, and closes the others; any other number closes all.
    pub(super) fn open(&mut self, n: usize) {
        let [help, times, exports, asks] = std::array::from_fn(|open| open == n);
        (self.visible.help, self.visible.times, self.visible.exports, self.leaving) =
            (help, times, exports, asks.then_some(&UNSAVED_LOOP));
    }

    pub(super) fn close(&mut self) {
        self.open(usize::MAX);
    }

    /// Shows a part of the inspector.
    pub(super) fn tab(&mut self, tab: InspectorTab) {
        self.inspector_does(&Command::InspectorTab(tab));
    }

    /// Executes a command for the inspector, as the console does.
    pub(super) fn inspector_does(&mut self, command: &Command) {
        assert!(self.visible.apply(command, &Room::of(self.size, self.panels.scale(), true)));
        self.settle();
    }

    /// Lays the panels out until they stay: scroll areas know their content from the layout before, and what opens fades in.
    pub(super) fn settle(&mut self) {
        self.lay_out();
        self.time += 1.0;
        self.lay_out();
    }

    pub(super) fn apply(&mut self, command: Command) -> Change {
        let change = self.execute(&command);
        self.scene = scene(&self.scene.geometry, &self.controls.settings().clone().without_drawings());
        self.settle();
        change
    }

    /// As the console does: another tool brings its part of the inspector.
    fn execute(&mut self, command: &Command) -> Change {
        let tool = self.controls.tool();
        let change = self.controls.apply(command, Some(&self.scene));
        if self.controls.tool() != tool {
            self.visible.inspector.follow(self.controls.tool());
        }
        change
    }

    pub(super) fn room(&self) -> Room {
        let room = Room::of(self.size, self.panels.scale(), self.visible.panels);
        self.compared.as_ref().map_or(room, |shown| room.divided(shown.tiles()))
    }

    /// Lays the panels out, applies their commands, and returns these.
    pub(super) fn lay_out(&mut self) -> Vec<Command> {
        self.time += 0.1;
        let named =
            |(n, name): (usize, &String)| Named { name: name.clone(), path: format!("/data/{name}"), is_shown: n == 1 };
        let recordings: Vec<Named> = self.recordings.iter().enumerate().map(named).collect();
        let room = self.room();
        let picture = ShownPicture {
            scene: self.kept.clone().unwrap_or_else(|| self.scene.clone()),
            volume: 2,
            start_lines: self.start_lines.clone(),
        };
        let state = PanelState {
            controls: &self.controls,
            scene: Some(&self.scene),
            picture: self.has_drawn.then_some(&picture),
            times: &self.times,
            room,
            visible: &self.visible,
            origin: Some("Demo data (phantom)"),
            shows_first_steps: self.shows[0],
            shows_only_origin: self.shows[1],
            leaving: self.leaving,
            files: self.files.as_ref().map(|(folder, names)| FilesShown {
                folder,
                recent: names.len().min(1),
                names,
                typed: self.typed.as_ref().map(|(text, fault)| (text.as_str(), fault.as_deref())),
            }),
            recordings: &recordings,
            reading: self.reading.as_ref(),
            is_turning: false,
            exporting: Some(("Surface", Some(Progress { done: 12, of: 72 }))),
            presets: self.presets.as_ref().map(|(own, naming)| presets(own, naming.as_deref())),
            small: SmallPictures { are_drawn: true, looks: presets(&[], None).tiles, of_loop: &[] },
            timeliness: self.timeliness,
            cine: self.cine.clone(),
            quality: ("full", self.budget),
            banner: self.banner.clone(),
            notes: &self.notes,
            exit_key: "",
            pointers: self.pointers,
            compared: self.compared.as_ref(),
        };
        let output = self.panels.lay_out(&state, self.size, self.time);
        self.corners = output.corners();
        let PanelOutput { commands, tree, drawn, .. } = output;
        self.drawn = drawn;
        let TreeUpdate { nodes, focus, tree, .. } = tree.expect("a tree");
        let root = tree.expect("a root").root;
        self.tree = nodes.into_iter().collect();
        self.focus = Some(focus).filter(|focus| *focus != root);
        for command in &commands {
            self.execute(command);
            self.visible.inspector.apply(command, &room);
        }
        self.scene = scene(&self.scene.geometry, &self.controls.settings().clone().without_drawings());
        commands
    }

    pub(super) fn ask(&mut self, target_node: NodeId, action: Action, data: Option<ActionData>) -> Vec<Command> {
        self.panels.act(ActionRequest { action, target_tree: TreeId::ROOT, target_node, data });
        let commands = self.lay_out();
        self.lay_out();
        commands
    }
}

/// The list of presets as the console shows it, with pictures of some.
fn presets<'a>(own: &'a [String], naming: Option<&'a str>) -> PresetsShown<'a> {
    let picture = || Some(Arc::new(Picture { width: 2, height: 1, rgba: vec![90, 60, 40, 255, 10, 10, 10, 255] }));
    let built_in =
        EXAMS.iter().map(|exam| PresetTile { name: exam.title, hint: exam.hint, picture: picture(), own: None });
    let own =
        own.iter().enumerate().map(|(n, name)| PresetTile { name, hint: "Your own.", picture: None, own: Some(n) });
    PresetsShown {
        tiles: built_in.chain(own).collect(),
        can_save: true,
        fault: Some("/home/a/.config/echolume/presets.toml: line 3: damaged"),
        naming: naming.map(|text| (text, false)),
        can_restore: true,
    }
}
