//! The panels around and over the picture, laid out by egui. They show a [`PanelState`] and return commands. Their positions depend only on the size
//! of the window, so that the size of the picture is known before anything is drawn.
//!
//! The theme is dark, so that the picture is the brightest part of the screen. Tools, the button that freezes and those that save are large enough for
//! gloves; a larger scale makes everything readable from 2 m.

mod annotations;
mod bar;
mod body_marks;
mod canvas;
pub(super) mod colours;
mod compared;
mod curve;
#[cfg(test)]
pub(super) mod drawn;
pub(super) mod first_steps;
mod icons;
mod inspector;
mod labels;
mod lists;
mod look;
mod measures;
mod names;
mod overlays;
mod planes;
mod presets;
mod rail;
mod recordings;
mod region;
mod search;
mod sides;
mod tools;
mod top;
mod visible;
mod walking;
mod widgets;

use self::colours::{BACKGROUND, BUTTON, EDGE, ON_SELECTED, PANEL, SELECTED, TEXT, WEAK_TEXT};
pub(super) use self::lists::FilesShown;
pub(super) use self::presets::{PresetTile, PresetsShown};
pub(super) use self::recordings::Reading;
pub(super) use self::visible::Visible;
use super::command::Command;
use super::input::{Button, Input, Key, Modifiers, Phase};
use crate::cine_player::CineState;
use crate::compare;
use crate::comparison::Shown;
use crate::controls::Controls;
use crate::gpu;
use crate::keyboard_pointer::PointerMark;
use crate::picture::Picture;
use crate::progress_lines::Progress;
use crate::recordings::Named;
use crate::scene::Scene;
use crate::shown_picture::ShownPicture;
use crate::texts::{self, Unsaved};
use crate::times::Times;
pub use egui::accesskit;
use egui::accesskit::{ActionRequest, TreeUpdate};
use egui::{
    CornerRadius, Event, FontData, FontDefinitions, FontFamily, FontId, Modifiers as EguiModifiers, MouseWheelUnit,
    PointerButton, Pos2, Rect, Stroke, TextStyle, TextureId, Theme, TouchPhase, pos2, vec2,
};
use std::sync::Arc;
use std::time::Duration;

/// Takes the commands that panels give.
type Execute<'a> = &'a mut dyn FnMut(Command);

/// Pictures of tiles on the device, as far as they are made.
type Pictures<'a> = &'a [Option<TextureId>];

/// The result of a layout of the panels.
pub(super) struct PanelOutput {
    pub(super) panels: gpu::window::Panels,
    pub(super) commands: Vec<Command>,
    /// The accessibility tree of the panels; None if no screen reader listens.
    pub(super) tree: Option<TreeUpdate>,
    /// Time after which the panels need another layout even without an event.
    pub(super) repaint_after: Duration,
    /// The shapes of the panels, before they are divided into triangles.
    #[cfg(test)]
    pub(super) drawn: Vec<drawn::Drawn>,
}

#[cfg(test)]
impl PanelOutput {
    /// The corners of all triangles of the panels, points, and their colours: red, green, blue, opacity.
    pub(super) fn corners(&self) -> Vec<([f32; 2], [u8; 4])> {
        let meshes = self.panels.shapes.iter().filter_map(|shape| match &shape.primitive {
            egui::epaint::Primitive::Mesh(mesh) => Some(mesh),
            egui::epaint::Primitive::Callback(_) => None,
        });
        meshes.flat_map(|mesh| &mesh.vertices).map(|v| (v.pos.into(), v.color.to_array())).collect()
    }
}

/// The panels of one window: controls, messages and annotations around and over the picture.
#[derive(Default)]
pub(super) struct Panels {
    context: egui::Context,
    egui_input: EguiInput,
    /// Pixels per point.
    scale: f32,
    /// Whether a screen reader listens.
    is_described: bool,
    /// Whether the next layout moves the keyboard focus to a control.
    gets_focus: bool,
    thumbnails: presets::Textures,
}

impl Panels {
    /// `scale`: pixels per point, limited to 0.5..=4; a larger one enlarges everything.
    pub(super) fn new(scale: f32) -> Panels {
        let panels = Panels { scale: scale.clamp(0.5, 4.0), ..Panels::default() };
        apply_theme(&panels.context);
        panels
    }

    pub(super) fn scale(&self) -> f32 {
        self.scale
    }

    /// Makes the next layout send all textures again, because the device that had them was lost.
    pub(super) fn reset(&mut self) {
        let is_described = self.is_described;
        *self = Panels::new(self.scale);
        self.describe(is_described);
    }

    /// Sets whether later layouts describe the panels to a screen reader.
    pub(super) fn describe(&mut self, is_described: bool) {
        self.is_described = is_described;
        match is_described {
            true => self.context.enable_accesskit(),
            false => self.context.disable_accesskit(),
        }
    }

    #[cfg(feature = "screen-reader")]
    pub(super) fn is_described(&self) -> bool {
        self.is_described
    }

    /// Does what a screen reader requests of a control, in the next layout.
    pub(super) fn act(&mut self, request: ActionRequest) {
        self.egui_input.events.push(Event::AccessKitActionRequest(request));
    }

    /// True while a control has the keyboard focus.
    pub(super) fn has_focus(&self) -> bool {
        self.gets_focus || self.context.memory(|memory| memory.focused()).is_some()
    }

    /// Gives the keyboard focus to the first control, or removes it.
    pub(super) fn toggle_focus(&mut self) {
        let key = if self.has_focus() { egui::Key::Escape } else { egui::Key::Tab };
        self.gets_focus = key == egui::Key::Tab;
        self.egui_input.press(key, EguiModifiers::NONE);
    }

    /// Passes a pressed key to the focused control: Tab goes to the next one, arrows move a slider, Space and Enter press a button, Escape
    /// removes the focus. Returns false if no control has the focus, or if it does not use the key.
    pub(super) fn key(&mut self, key: Key, modifiers: Modifiers) -> bool {
        let plain = modifiers == Modifiers::default();
        let back = modifiers == Modifiers { shift: true, ..Modifiers::default() };
        let key = match key {
            Key::Tab if plain || back => egui::Key::Tab,
            _ if !plain => return false,
            Key::Enter => egui::Key::Enter,
            Key::Space => egui::Key::Space,
            Key::Escape => egui::Key::Escape,
            Key::Left => egui::Key::ArrowLeft,
            Key::Right => egui::Key::ArrowRight,
            Key::Up => egui::Key::ArrowUp,
            Key::Down => egui::Key::ArrowDown,
            _ => return false,
        };
        if !self.has_focus() {
            return false;
        }
        self.gets_focus &= key != egui::Key::Escape;
        self.egui_input.press(key, if back { EguiModifiers::SHIFT } else { EguiModifiers::NONE });
        true
    }

    /// Passes a key on that moves the focus through the open list. `is_grid`: entries are also side by side. Returns false if the key does not
    /// move it.
    pub(super) fn walk(&mut self, key: Key, modifiers: Modifiers, is_grid: bool) -> bool {
        let Some(key) = walking::key(key, is_grid).filter(|_| modifiers == Modifiers::default()) else { return false };
        self.gets_focus = true;
        self.egui_input.press(key, EguiModifiers::NONE);
        true
    }

    /// Removes the keyboard focus.
    pub(super) fn drop_focus(&mut self) {
        self.gets_focus = false;
        self.context.memory_mut(|memory| memory.focused().iter().for_each(|id| memory.surrender_focus(*id)));
    }

    pub(super) fn input(&mut self, input: &Input) {
        self.egui_input.input(input, self.scale);
    }

    /// True if a panel covers this position (pixels of the window), so that a press there does not reach the picture.
    pub(super) fn covers(&self, at: [f64; 2]) -> bool {
        let point = pos2(at[0] as f32 / self.scale, at[1] as f32 / self.scale);
        self.context.layer_id_at(point).is_some_and(|layer| layer.order != egui::Order::Background)
    }

    /// True if there is input that no layout has handled yet.
    pub(super) fn has_pending_input(&self) -> bool {
        self.egui_input.has_pending_input()
    }

    /// Lays out the panels in a window of this size, pixels. `time`: s since any fixed moment.
    pub(super) fn lay_out(&mut self, state: &PanelState, size: [u32; 2], time: f64) -> PanelOutput {
        let (events, modifiers) = self.egui_input.take();
        let points = vec2(size[0] as f32, size[1] as f32) / self.scale;
        let mut input = egui::RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), points)),
            time: Some(time),
            events,
            ..Default::default()
        };
        // Any event makes egui lay out twice, so the modifiers are sent only with other events.
        if !input.events.is_empty() {
            input.events.insert(0, Event::ModifiersChanged(modifiers));
        }
        if let Some(viewport) = input.viewports.get_mut(&egui::ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(self.scale);
        }
        let mut commands = Vec::new();
        self.gets_focus &= self.has_pending_input();
        let pictures = |tiles: &[PresetTile]| tiles.iter().map(|tile| tile.picture.clone()).collect::<Vec<_>>();
        let listed = state.presets.as_ref().map_or(Vec::new(), |shown| pictures(&shown.tiles));
        let compared = state.compared.map(Shown::pictures).unwrap_or_default();
        let [looks, thumbnails, of_loop, compared] =
            self.thumbnails.of(&self.context, [&pictures(&state.small.looks), &listed, state.small.of_loop, &compared]);
        // egui may lay out twice, to place what it sees for the first time: the inputs are in the first.
        let output = self.context.run_ui(input, |ui| {
            let from_panels = commands.len();
            let execute = &mut |command| commands.push(command);
            if state.shows_only_origin {
                if state.picture.is_some() {
                    annotations::paint_origin(ui, state, self.scale);
                }
                return;
            }
            names::picture(ui, state, self.scale);
            let shows_panels = state.visible.panels && state.room.picture.1 != size;
            if shows_panels {
                let edges = Edges::of(points.into(), true);
                if edges.above > 0.0 {
                    top::show(ui, state, edges.above, execute);
                }
                bar::show(ui, state, edges.below, &of_loop, execute);
                if edges.left > 0.0 {
                    rail::show(ui, state, points.y - edges.above - edges.below, execute);
                }
                if edges.right > 0.0 {
                    inspector::show_column(ui, state, edges.right, &looks, execute);
                } else if state.visible.inspector.is_open {
                    inspector::show_drawer(ui, state, points.into(), edges, &looks, execute);
                }
            }
            compared::paint(ui, state, &compared, self.scale);
            let taken = recordings::show_reading(ui, state, self.scale, execute);
            let messages = overlays::show_notes(ui, state, self.scale, taken);
            if state.picture.is_some() {
                match state.visible.panels {
                    true => annotations::paint(ui, state, self.scale, &messages),
                    false => annotations::paint_origin(ui, state, self.scale),
                }
                region::paint(ui, state, self.scale);
                curve::paint(ui, state, self.scale);
                measures::paint(ui, state, self.scale);
                body_marks::paint(ui, state, self.scale);
            }
            compared::show(ui, state, self.scale, execute);
            if state.visible.times {
                overlays::show_times(ui, state, self.scale);
            }
            if state.shows_first_steps {
                first_steps::show(ui, state, self.scale, execute);
            }
            // egui panics if a list has a negative height.
            if state.visible.help && size[1] as f32 > MIN_HELP_HEIGHT * self.scale {
                overlays::show_help(ui, state, execute);
            }
            if let Some(files) = &state.files {
                lists::show_files(ui, files, execute);
            }
            if state.visible.exports {
                lists::show_exports(ui, state.exporting, execute);
            }
            if let Some(search) = &state.visible.search {
                search::show(ui, search, execute);
            }
            if let Some(shown) = &state.presets {
                presets::show(ui, shown, &thumbnails, execute);
            }
            if let Some(unsaved) = state.leaving {
                // A screen reader reaches what a pointer does not.
                commands.truncate(from_panels);
                overlays::ask_to_leave(ui, unsaved, &mut |command| commands.push(command));
            }
            names::mark_focus(ui.ctx());
            overlays::paint_pointer(ui, state, self.scale);
        });
        let repaint_after = output.viewport_output.values().map(|v| v.repaint_delay).min().unwrap_or(Duration::MAX);
        #[cfg(test)]
        let drawn = drawn::drawn(&output.shapes);
        let shapes = self.context.tessellate(output.shapes, output.pixels_per_point);
        let panels = gpu::window::Panels { shapes, textures: output.textures_delta, scale: output.pixels_per_point };
        PanelOutput {
            panels,
            commands,
            tree: output.platform_output.accesskit_update,
            repaint_after,
            #[cfg(test)]
            drawn,
        }
    }
}

/// Converts inputs to egui's events: positions in points, and one finger as the pointer.
#[derive(Default)]
struct EguiInput {
    events: Vec<Event>,
    pointer: Pos2,
    modifiers: EguiModifiers,
    /// The button that was pressed or released last is down.
    is_pressed: bool,
    /// The finger that acts as the pointer.
    finger: Option<u64>,
}

impl EguiInput {
    /// `scale`: pixels per point.
    fn input(&mut self, input: &Input, scale: f32) {
        let at = |[x, y]: [f64; 2]| pos2(x as f32 / scale, y as f32 / scale);
        match *input {
            Input::Moved(place) => self.moved(at(place)),
            Input::Button { button, pressed } => self.button(button, pressed),
            Input::Scroll(notches) => self.events.push(Event::MouseWheel {
                unit: MouseWheelUnit::Line,
                delta: vec2(0.0, notches as f32),
                phase: TouchPhase::Move,
                modifiers: self.modifiers,
            }),
            // Keys have their own bindings: no panel has a text field. Those for a control come by `press`.
            Input::Key { .. } => {}
            Input::Modifiers(Modifiers { shift, control, alt }) => {
                self.modifiers = EguiModifiers { alt, ctrl: control, shift, mac_cmd: false, command: control };
            }
            Input::Touch { finger, phase, at: place } => self.touch(finger, phase, at(place)),
            // A control that is being dragged follows the pointer on.
            Input::PointerLeft if self.is_pressed => {}
            Input::PointerLeft => self.events.push(Event::PointerGone),
            Input::FocusLost => {
                (self.finger, self.is_pressed) = (None, false);
                self.events.push(Event::PointerGone);
            }
        }
    }

    /// A key that goes down and up.
    fn press(&mut self, key: egui::Key, modifiers: EguiModifiers) {
        // With the modifiers that egui is told before any event, the arrows and Tab would be other keys.
        for pressed in [true, false] {
            self.events.push(Event::Key { key, physical_key: None, pressed, repeat: false, modifiers });
        }
    }

    fn moved(&mut self, to: Pos2) {
        self.pointer = to;
        self.events.push(Event::PointerMoved(to));
    }

    fn button(&mut self, button: Button, pressed: bool) {
        let button = match button {
            Button::Left => PointerButton::Primary,
            Button::Right => PointerButton::Secondary,
            Button::Middle => PointerButton::Middle,
        };
        self.is_pressed = pressed;
        self.events.push(Event::PointerButton { pos: self.pointer, button, pressed, modifiers: self.modifiers });
    }

    fn touch(&mut self, finger: u64, phase: Phase, at: Pos2) {
        match phase {
            Phase::Down if self.finger.is_none() => {
                self.finger = Some(finger);
                self.moved(at);
                self.button(Button::Left, true);
            }
            _ if self.finger != Some(finger) => {}
            Phase::Down | Phase::Moved => self.moved(at),
            Phase::Up | Phase::Cancelled => {
                self.finger = None;
                // A cancelled touch clicks nothing.
                if phase == Phase::Up {
                    self.moved(at);
                    self.button(Button::Left, false);
                }
                self.events.push(Event::PointerGone);
            }
        }
    }

    /// True if egui has not received all events.
    fn has_pending_input(&self) -> bool {
        !self.events.is_empty()
    }

    /// The events of the next layout: all up to a key, because egui moves the focus once a layout.
    fn take(&mut self) -> (Vec<Event>, EguiModifiers) {
        let is_end = |event: &Event| matches!(event, Event::Key { pressed: false, .. });
        let count = self.events.iter().position(is_end).map_or(self.events.len(), |at| at + 1);
        (self.events.drain(..count).collect(), self.modifiers)
    }
}

/// Sizes of the panels, points.
const TOP_HEIGHT: f32 = 48.0;
const RAIL_WIDTH: f32 = 64.0;
const INSPECTOR_WIDTH: f32 = 300.0;
/// Of the bar at the bottom, in windows of these heights.
const BAR_HEIGHTS: [(f32, f32); 3] = [(700.0, 88.0), (560.0, 72.0), (0.0, 60.0)];
/// A smaller window shows the picture without panels, points.
const MIN_WINDOW: [f32; 2] = [180.0, 150.0];
/// A smaller window has only the bar at the bottom, points.
const MIN_FOR_RAIL: [f32; 2] = [600.0, 340.0];
/// The picture keeps this share of the window; with less there is no inspector beside it.
const LEAST_SHARE: f32 = 0.5;
/// The help needs a window of this height, points.
const MIN_HELP_HEIGHT: f32 = 200.0;

/// What the panels take of a window at its edges, points; 0 without a panel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Edges {
    above: f32,
    left: f32,
    right: f32,
    below: f32,
}

impl Edges {
    fn of([width, height]: [f32; 2], shows_panels: bool) -> Edges {
        let fits = |least: [f32; 2]| width >= least[0] && height >= least[1];
        if !shows_panels || !fits(MIN_WINDOW) {
            return Edges::default();
        }
        let below = BAR_HEIGHTS.into_iter().find(|(least, _)| height >= *least).map_or(0.0, |(_, bar)| bar);
        let (left, above) = if fits(MIN_FOR_RAIL) { (RAIL_WIDTH, TOP_HEIGHT) } else { (0.0, 0.0) };
        let picture = (width - left - INSPECTOR_WIDTH).max(0.0) * (height - above - below);
        let has_inspector = left > 0.0 && picture >= LEAST_SHARE * width * height;
        Edges { above, left, right: if has_inspector { INSPECTOR_WIDTH } else { 0.0 }, below }
    }
}

/// What the panels show in a layout.
pub(super) struct PanelState<'a> {
    pub(super) controls: &'a Controls,
    /// The scene to which controls refer: the one that is drawn next or was drawn last. None before the first.
    pub(super) scene: Option<&'a Scene>,
    /// The shown picture, to which marks over it refer; None before the first.
    pub(super) picture: Option<&'a ShownPicture>,
    pub(super) times: &'a Times,
    pub(super) room: Room,
    pub(super) visible: &'a Visible,
    /// What the pictures show if it is no patient, such as the phantom; otherwise None.
    pub(super) origin: Option<&'a str>,
    /// True if the hints of the first start are shown.
    pub(super) shows_first_steps: bool,
    /// True if nothing is drawn over the picture except `origin`.
    pub(super) shows_only_origin: bool,
    /// The question whether to save what leaving the program would lose; None while it is not shown.
    pub(super) leaving: Option<&'static Unsaved>,
    /// The list of files to open; None while it is not shown.
    pub(super) files: Option<FilesShown<'a>>,
    /// The open recordings; `reading` is the file that is being read.
    pub(super) recordings: &'a [Named],
    pub(super) reading: Option<&'a Reading>,
    /// The list of presets; None while it is not shown.
    pub(super) presets: Option<PresetsShown<'a>>,
    pub(super) small: SmallPictures<'a>,
    /// True if the turntable runs.
    pub(super) is_turning: bool,
    /// Name and progress of the running export; None if none runs.
    pub(super) exporting: Option<(&'a str, Option<Progress>)>,
    pub(super) timeliness: Timeliness,
    pub(super) cine: CineState,
    /// Name of the current rung of the quality ladder, and the frame budget (None: no limit).
    pub(super) quality: (&'a str, Option<Duration>),
    pub(super) banner: Option<Banner>,
    pub(super) notes: &'a [Note],
    /// Name of the key combination that ends the program, for the help.
    pub(super) exit_key: &'a str,
    pub(super) pointers: Pointers,
    /// The volume that is compared with the shown one; None if none is.
    pub(super) compared: Option<&'a Shown>,
}

/// Whether the picture shows what is there now.
#[derive(Clone, Copy, Default)]
pub(super) struct Timeliness {
    pub(super) is_frozen: bool,
    /// True if frames come from a probe or a pipe.
    pub(super) is_live: bool,
    /// True if the picture with the effect of the user's last action takes long.
    pub(super) is_late: bool,
    /// Time since the probe or the pipe ended, since when the picture is not live; None if it has not.
    pub(super) ended: Option<Duration>,
}

/// The pointers that the panels draw.
#[derive(Clone, Copy, Default)]
pub(super) struct Pointers {
    /// Where that of the mouse is drawn, pixels of the window; None if the window system draws it.
    pub(super) of_mouse: Option<[f64; 2]>,
    /// How the pointer that keys move is drawn; None while it is off.
    pub(super) of_keys: Option<PointerMark>,
}

/// Thumbnails in the panels.
pub(super) struct SmallPictures<'a> {
    /// True if thumbnails of presets and volumes are drawn.
    pub(super) are_drawn: bool,
    /// All presets, with their thumbnails, for the inspector.
    pub(super) looks: Vec<PresetTile<'a>>,
    /// The thumbnail of each volume of the cine loop; None for one that is not drawn yet.
    pub(super) of_loop: &'a [Option<Arc<Picture>>],
}

impl PanelState<'_> {
    /// How far a live picture is behind what arrives, in words, if it is by more than a second.
    fn delay(&self) -> Option<String> {
        let Timeliness { is_live, is_frozen, ended, .. } = self.timeliness;
        let is_live = is_live && !is_frozen && ended.is_none();
        self.times.delay().filter(|_| is_live).map(|s| texts::behind(format!("{s:.1} s")))
    }
}

/// A message that stays as long as its cause.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Banner {
    pub(super) title: String,
    pub(super) text: String,
    pub(super) is_fault: bool,
}

/// A message about an event, which is shown for a few seconds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Note {
    pub(super) text: String,
    pub(super) is_fault: bool,
}

/// The area that the panels leave for the picture in a window of this size, pixels: upper left corner and size. `scale`: pixels per point.
pub fn picture_area(size: [u32; 2], scale: f32, shows_panels: bool) -> ([u32; 2], [u32; 2]) {
    let edges = Edges::of(size.map(|n| n as f32 / scale), shows_panels);
    let Edges { above, left, right, below } = edges;
    let [above, left, right, below] = [above, left, right, below].map(|edge| (edge * scale).round() as u32);
    ([left, above], [size[0].saturating_sub(left + right).max(1), size[1].saturating_sub(above + below).max(1)])
}

/// How a window is divided between the panels and the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Room {
    /// Upper left corner and size of the picture, pixels of the window; of the first tile if there are several.
    pub(super) picture: ([u32; 2], [u32; 2]),
    /// Distance from a tile to the next of its row and of its column, pixels; 0 if there is only one.
    to_next: [u32; 2],
    /// Tiles in a row.
    columns: u32,
    /// True if there is a bar at the top.
    pub(super) has_top: bool,
    /// True if the inspector is a drawer over the picture, because there is no room beside it.
    pub(super) has_drawer: bool,
    /// True if the tools are a tab of the inspector, because not all of them have room at the edge of the window.
    pub(super) has_tools_tab: bool,
}

impl Room {
    /// `size`: that of the window, pixels; `scale`: pixels per point.
    pub(super) fn of(size: [u32; 2], scale: f32, shows_panels: bool) -> Room {
        let points = size.map(|n| n as f32 / scale);
        let Edges { above, left, right, below } = Edges::of(points, shows_panels);
        Room {
            picture: picture_area(size, scale, shows_panels),
            to_next: [0; 2],
            columns: 1,
            has_top: above > 0.0,
            has_drawer: right == 0.0 && below > 0.0,
            has_tools_tab: below > 0.0 && (left == 0.0 || rail::button_height(points[1] - above - below).is_none()),
        }
    }

    /// This room with its picture divided into up to four tiles.
    pub(super) fn divided(self, tiles: usize) -> Room {
        if tiles < 2 {
            return self;
        }
        let (corner, whole) = self.picture;
        let size = compare::tile_size(tiles, whole);
        let [columns, _] = compare::grid(tiles, whole);
        Room { picture: (corner, size), to_next: size.map(|edge| edge + compare::GAP), columns, ..self }
    }

    /// Upper left corner and size of a tile, pixels of the window; 0 is the picture.
    pub(super) fn tile(&self, n: u32) -> ([u32; 2], [u32; 2]) {
        let (corner, size) = self.picture;
        let at = [n % self.columns, n / self.columns];
        ([0, 1].map(|a| corner[a] + at[a] * self.to_next[a]), size)
    }
}

/// A small heading above a group of controls.
fn heading(ui: &mut egui::Ui, text: &str) {
    ui.add_space(4.0);
    ui.label(egui::RichText::new(text).size(SMALL_TEXT).color(WEAK_TEXT));
}

/// A group of controls below its name.
fn section(ui: &mut egui::Ui, title: &str, add: impl FnOnce(&mut egui::Ui)) {
    names::group(ui, title, |ui| {
        heading(ui, title);
        add(ui);
    });
}

/// The area of the picture in points.
fn picture_rect(state: &PanelState, scale: f32) -> Rect {
    tile_rect(state, 0, scale)
}

/// The area of a tile in points; 0 is the picture.
fn tile_rect(state: &PanelState, n: u32, scale: f32) -> Rect {
    let ([x, y], [w, h]) = state.room.tile(n);
    let [x, y, w, h] = [x, y, w, h].map(|n| n as f32 / scale);
    Rect::from_min_size(pos2(x, y), vec2(w, h))
}

/// The picture that is shown and its area in points, which reaches beyond that of the picture in the window while one of another size is still shown.
fn shown<'a>(state: &PanelState<'a>, scale: f32) -> Option<(&'a ShownPicture, Rect)> {
    let picture = state.picture?;
    let size = picture.scene.picture_size().map(|n| n as f32 / scale);
    Some((picture, Rect::from_min_size(picture_rect(state, scale).min, size.into())))
}

/// Size of running text, points.
const TEXT_SIZE: f32 = 16.0;
/// Size of important text, such as messages: at a scale of 1 on a monitor with 96 dots per inch it is read from 2 m.
const LARGE_TEXT: f32 = 26.0;
const SMALL_TEXT: f32 = 13.0;
/// Size of the text of marks over the picture.
const MARK_TEXT: f32 = 15.0;
/// Minimum size of a button over the picture for a gloved finger, points: 14 mm at 96 dots per inch.
const TOUCH_SIZE: f32 = 52.0;
/// Height of a button in the bar at the top and in the inspector, points.
const ROW_HEIGHT: f32 = 34.0;

/// Sets typeface, sizes and colours.
fn apply_theme(context: &egui::Context) {
    let mut fonts = FontDefinitions::empty();
    let faces = [
        ("sans", FontFamily::Proportional, dejavu::sans_condensed::regular()),
        ("mono", FontFamily::Monospace, dejavu::sans_mono::regular()),
    ];
    for (name, family, bytes) in faces {
        fonts.font_data.insert(name.into(), Arc::new(FontData::from_static(bytes)));
        fonts.families.insert(family, vec![name.into()]);
    }
    context.set_fonts(fonts);
    context.set_theme(Theme::Dark);
    let mut style = (*context.style_of(Theme::Dark)).clone();
    let text = |size| FontId::proportional(size);
    style.text_styles = [
        (TextStyle::Small, text(SMALL_TEXT)),
        (TextStyle::Body, text(TEXT_SIZE)),
        (TextStyle::Button, text(TEXT_SIZE)),
        (TextStyle::Heading, text(LARGE_TEXT)),
        (TextStyle::Monospace, FontId::monospace(SMALL_TEXT)),
    ]
    .into();
    style.spacing.item_spacing = vec2(8.0, 8.0);
    style.spacing.button_padding = vec2(8.0, 6.0);
    style.spacing.interact_size = vec2(TOUCH_SIZE, TOUCH_SIZE * 0.7);
    style.spacing.slider_rail_height = 6.0;
    style.spacing.scroll.bar_width = 10.0;
    style.interaction.selectable_labels = false;
    style.interaction.tooltip_delay = 0.6;
    let visuals = &mut style.visuals;
    visuals.panel_fill = PANEL;
    visuals.window_fill = PANEL;
    visuals.extreme_bg_color = BACKGROUND;
    visuals.selection.bg_fill = SELECTED;
    visuals.selection.stroke = Stroke::new(1.5, ON_SELECTED);
    visuals.slider_trailing_fill = true;
    visuals.handle_shape = egui::style::HandleShape::Circle;
    visuals.widgets.noninteractive.fg_stroke = Stroke::new(1.0, TEXT);
    let widgets = &mut visuals.widgets;
    for widget in [&mut widgets.inactive, &mut widgets.hovered, &mut widgets.active, &mut widgets.open] {
        // Rails and knobs of sliders; buttons.
        (widget.bg_fill, widget.weak_bg_fill) = (EDGE, BUTTON);
        widget.bg_stroke = Stroke::new(1.0, EDGE);
        // Text of buttons, and the edge of a knob.
        widget.fg_stroke = Stroke::new(2.0, TEXT);
        widget.corner_radius = CornerRadius::same(6);
        widget.expansion = 0.0;
    }
    visuals.widgets.hovered.bg_stroke = Stroke::new(1.0, TEXT);
    visuals.widgets.active.weak_bg_fill = SELECTED;
    visuals.widgets.active.fg_stroke = Stroke::new(2.0, ON_SELECTED);
    context.set_style_of(Theme::Dark, style);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_keeps_half_of_every_window_and_freeze_is_always_there() {
        for size in [[640, 480], [800, 600], [1000, 700], [1024, 768], [1280, 800], [1920, 1080], [3840, 2160]] {
            for scale in [1.0_f32, 1.25, 1.5, 2.0, 2.5, 3.0] {
                let (corner, picture) = picture_area(size, scale, true);
                let [window, shown] = [size, picture].map(|[w, h]| f64::from(w) * f64::from(h));
                assert!(shown >= 0.5 * window, "{size:?} at {scale}: {picture:?}");
                assert!(picture[1] < size[1], "{size:?} at {scale}: no bar");
                assert!(corner[0] + picture[0] <= size[0], "{size:?} at {scale}: {corner:?} {picture:?}");
            }
        }
        assert!(picture_area([1280, 800], 1.0, true).1[0] + 364 == 1280, "rail and inspector");
        assert_eq!(picture_area([1280, 800], 1.0, false), ([0, 0], [1280, 800]));
        assert_eq!(picture_area([1, 0], 1.0, true), ([0, 0], [1, 1]));
    }
}
